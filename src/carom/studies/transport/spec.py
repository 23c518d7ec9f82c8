"""What a transport study asks for: the section ``[transport]``, and ``[scene]``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from carom.declared import described, integer, option
from carom.errors import InputError
from carom.studies.grid import SYSTEM, Blocks, GridSpec, Length, Replicas, Sizes

REFUSED = ("walls", "obstacles", "motion", "impact", "drive", "pinned")
"""Keys of a scene with which there is no bulk fluid in equilibrium, whose momentum and energy last."""


@described
@dataclass(frozen=True)
class TransportSpec(GridSpec):
    """A grid of simulations, and the relative error of shear viscosity and conductivity at each point.

    Raises
    ------
    InputError
        If a value is out of range, keys contradict each other, or the scene is not a bulk fluid of hard cores
        or steps.

    Notes
    -----
    With steps (``scene={"interaction": SquareWell(1.5)}``) packing fractions, mean free times and lengths are
    those of hard cores of the scene's diameter.
    """

    study: ClassVar[str] = "transport"
    section: ClassVar[str] = "transport"
    argument: ClassVar[str] = r"Scene file (TOML): \[scene] and \[transport]. Without: six densities."
    about: ClassVar[str] = """Measure self-diffusion, viscosities and thermal conductivity.

    They are compared with Enskog's theory. The folder then holds study.toml, a result file for each run in
    tasks/, transport.csv and transport.png. Finished runs are not repeated: the same command continues a
    study that was stopped.

    [bold]Examples[/bold]

    carom transport --eta 0.2618 --relative-error 0.01
    carom transport scene.toml --replicas 8 --out scene-transport
    carom transport --eta 0.2618 --n 256,500,1372 --report
    """
    error: ClassVar[float] = 0.01
    refused: ClassVar[Mapping[str, str]] = dict.fromkeys(
        REFUSED, "leaves no bulk fluid in equilibrium, whose momentum and energy last; remove it."
    )
    densities: ClassVar[Mapping[int, tuple[float, ...]]] = {
        2: (0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
        3: (0.05, 0.1, 0.2, 0.3, 0.4, 0.45),
    }

    n: Sizes = (500,)
    replicas: Replicas = 4
    dimension: int = option(integer(low=2, high=12), "Dimension of space, from 2 on.", SYSTEM, default=3)
    equilibration: Length = 300.0
    blocks: Blocks = 64

    def task(self, eta: float, n: int, replica: int) -> dict[str, Any]:
        """Return one run (``eta``, ``n``, ``replica``), with the time between its samples.

        Raises
        ------
        InputError
            If the fluid is beyond freezing.
        """
        from carom import theory

        if not theory.is_stable_fluid(self.dimension, eta):
            freezing = theory.FREEZING[self.dimension]
            raise InputError(f"packing_fraction {eta:g} is beyond freezing ({freezing:g}); expected a fluid.")
        task = super().task(eta, n, replica)
        return {**task, "every": self._every(task)}

    def _every(self, task: dict[str, Any]) -> float:
        """Return the time between samples, rounded to four digits."""
        from carom.studies.scenes import scene_spec
        from carom.studies.transport import windows

        scene = scene_spec(task["scene"])
        species = scene.species
        if species:
            weights = [float(s.fraction or 0.0) for s in species]
            fractions = [w / math.fsum(weights) for w in weights]
            diameters, masses = [s.diameter for s in species], [s.mass for s in species]
        else:
            fractions, diameters, masses = [1.0], [scene.diameter or 1.0], [scene.mass or 1.0]
        time = windows.free_time(
            task["scene"]["packing_fraction"], diameters, masses, fractions, self.dimension, self.kT
        )
        return float(f"{time / windows.PER_FREE_TIME:.4g}")

    def length(self, eta: float, n: int) -> float:
        """Return the collisions per particle that reach the error at ``eta`` with ``n``, to four digits."""
        from carom.studies.transport import windows

        assert self.relative_error is not None
        d = self.dimension
        components = min(d, (d - 1) * (d + 2) // 2)
        free_times = windows.relative_variance(components, 1.0) / self.relative_error**2 / self.replicas
        blocks = min(self.blocks, windows.FEWEST_BLOCKS)
        fewest = blocks * windows.SHORTEST * windows.LAGS[-1] / windows.PER_FREE_TIME
        return float(f"{max(free_times, fewest):.4g}")
