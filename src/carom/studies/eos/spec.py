"""What a study of the equation of state asks for: the section ``[study]``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from carom.declared import described, integer, option
from carom.studies.grid import Blocks, GridSpec, Length, Replicas, Sizes

EXCESS = 1.2
"""Relative error of Z - 1 after one collision. For independent collisions it is 2 / sqrt(pi) = 1.13, because
``|u_n|`` of a collision has the second moment 4 / pi, in squares of its mean. The rest is a margin, so that
most runs need not be lengthened."""

FEWEST = 200.0
"""Smallest number of measured collisions per particle, also for a large requested error."""

FRAMES = 8
"""Default number of frames for the order parameter near freezing; each takes some 0.04 s (N = 4000)."""

REFUSED = (
    "leaves no uniform phase at one temperature, of which a study could measure Z; remove it, or use "
    "carom run."
)


@described
@dataclass(frozen=True)
class StudySpec(GridSpec):
    """A grid of simulations, and the relative error of Z at each point, all replicas together.

    Raises
    ------
    InputError
        If a value is out of range, keys contradict each other, or the scene has a `motion`, an `impact`, or
        an `interaction` other than steps that conserve the energy.
    """

    study: ClassVar[str] = "equation of state"
    argument: ClassVar[str] = r"Scene file (TOML): \[scene] and \[study]. Without: 12 densities."
    about: ClassVar[str] = """Measure the equation of state of a fluid or crystal.

    Z over packing fractions, sizes and replicas is compared with theory. The folder then holds study.toml, a
    result file for each run in tasks/, eos.csv and eos.png. Finished runs are not repeated: the same command
    continues a study that was stopped, killed or extended.

    [bold]Examples[/bold]

    carom eos
    carom eos --eta 0.1:0.4:7 --n 1000 --relative-error 1e-3 --out quick
    carom eos --eta 0.3,0.45 --n 250,500,1000,2000 --report
    carom eos study.toml --out big --scheduler tcp://head:8786
    mpiexec -n 9 python -m mpi4py.futures -m carom eos study.toml --out big
    """
    # The default study of spheres then takes some ten minutes on two cores.
    error: ClassVar[float] = 7e-5
    refused: ClassVar[Mapping[str, str]] = {
        "motion": REFUSED,
        "impact": REFUSED,
        "pinned": "leaves no pressure, because forces from outside hold the particles; remove it.",
    }
    # Twelve of the fluid, up to where theory is known to 1e-4.
    densities: ClassVar[Mapping[int, tuple[float, ...]]] = {
        1: tuple(round(0.075 * k, 3) for k in range(1, 13)),
        2: (0.025, *(round(0.05 * k, 2) for k in range(1, 10)), 0.475, 0.50),
        3: (0.025, *(round(0.05 * k, 2) for k in range(1, 10)), 0.475, 0.49),
        4: tuple(round(0.02 * k, 2) for k in range(1, 13)),
        5: tuple(round(0.012 * k, 3) for k in range(1, 13)),
        6: tuple(round(0.0075 * k, 4) for k in range(1, 13)),
    }

    # The finite-size correction of 4000 particles is below 2e-4, and its own error far below that.
    n: Sizes = (4000,)
    replicas: Replicas = 2
    equilibration: Length = 1000.0
    blocks: Blocks = 256
    frames: int | None = option(
        integer(low=0),
        "Frames per run for the order parameter and its drift. Without: 8 from just below freezing on, "
        "and none at lower densities.",
        flags=None,
    )

    def complete(self) -> None:
        """Check the grid, and that frames are no more than blocks; errors are those of :class:`StudySpec`."""
        if self.frames is not None:
            from carom import checks

            checks.integer(self.frames, "frames", low=0, high=self.blocks)
        super().complete()

    def task(self, eta: float, n: int, replica: int) -> dict[str, Any]:
        """Return one run (``eta``, ``n``, ``replica``), with an error by which the mean has its own."""
        goal = self.relative_error and float(f"{self.relative_error * math.sqrt(self.replicas):.6g}")
        return {**super().task(eta, n, replica), "relative_error": goal, "frames": self._frames(eta)}

    def _frames(self, eta: float) -> int:
        if self.frames is not None:
            return self.frames
        from carom import theory

        ordered = eta > theory.NEAR_FREEZING * theory.FREEZING.get(self.dimension, 1.0)
        return min(FRAMES, self.blocks) if ordered else 0

    def length(self, eta: float, n: int) -> float:
        """Return the collisions per particle that reach the error at ``eta`` with ``n``, to four digits."""
        assert self.relative_error is not None
        collisions = (EXCESS * excess_part(eta, self.dimension) / self.relative_error) ** 2
        # Rounded, because powers and logarithms differ in the last bit between machines.
        return float(f"{max(2.0 * collisions / n / self.replicas, FEWEST):.4g}")


def excess_part(eta: float, dimension: int) -> float:
    """Return ``(Z - 1) / Z`` by theory, or its upper bound 1 where there is no theory."""
    if dimension > 6:
        return 1.0
    from carom import theory

    crystal = eta > theory.FREEZING.get(dimension, 1.0)
    equation = (theory.solid if crystal else theory.best)(dimension)
    z = float(equation(min(eta, 0.999 * theory.CLOSE_PACKING[dimension])))
    return max(0.0, (z - 1.0) / z)
