"""What a transport study asks for: the section ``[study]``, or a scene file."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from carom.errors import InputError
from carom.studies.grid import SYSTEM, Blocks, GridSpec, Length, Replicas, Sizes
from carom.studies.spec import Opt, integer, read

REFUSED = ("walls", "obstacles", "motion", "impact", "pinned")
"""Keys of a scene with which there is no bulk fluid in equilibrium."""

KEPT = ("diameter", "mass", "kT", "contact", "interaction", *REFUSED)
"""Keys that a study takes from a scene file; the refused ones are taken so that they raise an error."""


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
    argument: ClassVar[str] = r"Scene file, or study file with \[study] (TOML). Without: six densities."
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
        REFUSED, "leaves no bulk fluid in equilibrium to measure; remove it."
    )
    densities: ClassVar[Mapping[int, tuple[float, ...]]] = {
        2: (0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
        3: (0.05, 0.1, 0.2, 0.3, 0.4, 0.45),
    }

    n: Sizes = (500,)
    replicas: Replicas = 4
    dimension: Annotated[int, integer(low=2, high=12), Opt("Dimension of space, from 2 on.", SYSTEM)] = 3
    equilibration: Length = 300.0
    blocks: Blocks = 16

    def complete(self) -> None:
        """Check the grid; an interaction may be a value of Python, too."""
        interaction = self.scene.get("interaction") if isinstance(self.scene, Mapping) else None
        if interaction is not None and not isinstance(interaction, Mapping):  # as a file has it
            from carom.models.files import to_tables

            self._put("scene", {**self.scene, "interaction": to_tables.to_table(interaction, "interaction")})
        super().complete()

    @classmethod
    def of_argument(cls, path: str | Path) -> TransportSpec:
        """Return the study of a file; one without ``[study]`` is a scene file, whose size is the grid.

        Raises
        ------
        InputError
            If the scene starts from a file, or is not a bulk fluid in equilibrium.
        """
        from carom.io.records import toml_tables
        from carom.scene_file.scene_file import SceneFile

        if "study" in toml_tables(read(path)):
            return cls.load(path)
        file = SceneFile.load(path)
        scene = file.scene
        if scene.initial == "file":
            raise InputError(
                "Transport needs [scene] that says what there is, with another initial than file: every "
                "replica has a start of its own."
            )
        made = file.build_scene()
        kept = {
            f.name: getattr(scene, f.name)
            for f in dataclasses.fields(scene)
            if f.name in KEPT and getattr(scene, f.name) not in (None, ())
        }
        if scene.species:
            kept["species"] = [
                {k: v for k, v in dataclasses.asdict(s).items() if v is not None and k != "count"}
                | {"fraction": float(s.count if s.count is not None else s.fraction or 0.0)}
                for s in scene.species
            ]
        return cls((made.packing_fraction,), n=(made.n,), dimension=made.dimension, scene=kept)

    def task(self, eta: float, n: int, replica: int) -> dict[str, Any]:
        """Return one run, with the time between its samples."""
        from carom import theory

        if not theory.is_stable_fluid(self.dimension, eta):
            freezing = theory.FREEZING[self.dimension]
            raise InputError(f"packing_fraction {eta:g} is beyond freezing ({freezing:g}); expected a fluid.")
        task = super().task(eta, n, replica)
        return {**task, "every": self._every(task)}

    def _every(self, task: dict[str, Any]) -> float:
        """Return the time between samples, rounded to four digits."""
        from carom.studies.coefficients import windows
        from carom.studies.scenes import scene_spec

        scene = scene_spec(task["scene"])
        species = scene.species
        kT = 1.0 if scene.kT is None else scene.kT
        if species:
            weights = [float(s.fraction or 0.0) for s in species]
            fractions = [w / math.fsum(weights) for w in weights]
            diameters, masses = [s.diameter for s in species], [s.mass for s in species]
        else:
            fractions, diameters, masses = [1.0], [scene.diameter or 1.0], [scene.mass or 1.0]
        time = windows.free_time(
            task["scene"]["packing_fraction"], diameters, masses, fractions, self.dimension, kT
        )
        return float(f"{time / windows.PER_FREE_TIME:.4g}")

    def length(self, eta: float, n: int) -> float:
        """Return the collisions per particle of a run that reaches the error, rounded to four digits."""
        from carom.studies.coefficients import windows

        assert self.relative_error is not None
        d = self.dimension
        components = min(d, (d - 1) * (d + 2) // 2)
        free_times = windows.relative_variance(components, 1.0) / self.relative_error**2 / self.replicas
        fewest = self.blocks * windows.SHORTEST * windows.LAGS[-1] / windows.PER_FREE_TIME
        return float(f"{max(free_times, fewest):.4g}")
