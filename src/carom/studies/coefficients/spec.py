"""The parameters of a transport study as a frozen value: the section ``[study]``."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from carom import checks, theory
from carom.errors import InputError
from carom.io.records import toml_tables
from carom.models.files import to_tables
from carom.scene.scene import Scene
from carom.scene_file.scene_file import SceneFile
from carom.studies.coefficients import windows
from carom.studies.eos.spec import GRID, StudySpec, replaced, scene_spec
from carom.studies.tasks import Task

DENSITIES = {2: (0.1, 0.2, 0.3, 0.4, 0.5, 0.6), 3: (0.05, 0.1, 0.2, 0.3, 0.4, 0.45)}
"""Default packing fractions, by dimension."""

RELATIVE_ERROR = 0.01
"""Default relative error of shear viscosity and thermal conductivity."""

REFUSED = ("walls", "obstacles", "motion", "impact", "pinned")
"""Keys of a scene with which there is no bulk fluid in equilibrium."""

KEPT = ("diameter", "mass", "kT", "contact", "interaction", *REFUSED)
"""Keys that a study takes from a scene file; the refused ones are taken so that they raise an error."""


@dataclass(frozen=True)
class TransportSpec(StudySpec):
    """A grid of simulations as of :class:`carom.studies.eos.spec.StudySpec`, for transport coefficients.

    Parameters
    ----------
    packing_fraction, n, replicas, dimension
        As in :class:`carom.studies.eos.spec.StudySpec`, but d >= 2; by default 500 particles and 4 replicas.
    relative_error : float
        Relative error of shear viscosity and thermal conductivity at each point, all replicas together; 0.01
        if neither length is given. It sets the length before the run.
    collisions_per_particle : float
        Alternatively, the length of each run.
    equilibration : float
        Collisions per particle before the measurement.
    seed, initial
        As in :class:`carom.studies.eos.spec.StudySpec`.
    blocks : int
        Blocks per run, which give the error bars.
    frames : int
        Not used: transport needs no order parameter.
    neighbors, scene
        As in :class:`carom.studies.eos.spec.StudySpec`.

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

    n: tuple[int, ...] = (500,)
    replicas: int = 4
    equilibration: float = 300.0
    blocks: int = 16

    def __post_init__(self) -> None:
        d = checks.integer(self.dimension, "dimension", low=2)
        if not self.packing_fraction and d in DENSITIES:
            object.__setattr__(self, "packing_fraction", DENSITIES[d])
        if self.relative_error is None and self.collisions_per_particle is None:
            object.__setattr__(self, "relative_error", RELATIVE_ERROR)
        for name in REFUSED:
            if name in self.scene:
                raise InputError(f"[scene] {name} leaves no bulk fluid in equilibrium to measure; remove it.")
        interaction = self.scene.get("interaction") if isinstance(self.scene, Mapping) else None
        if interaction is not None and not isinstance(interaction, Mapping):  # as a file has it
            table = to_tables.to_table(interaction, "interaction")
            object.__setattr__(self, "scene", {**self.scene, "interaction": table})
        super().__post_init__()

    def _task(self, eta: float, n: int, replica: int) -> Task:
        if not theory.is_stable_fluid(self.dimension, eta):
            freezing = theory.FREEZING[self.dimension]
            raise InputError(f"packing_fraction {eta:g} is beyond freezing ({freezing:g}); expected a fluid.")
        task = super()._task(eta, n, replica)
        task["study"] = "transport"
        task["every"] = self._every(task)
        task["blocks"] = self.blocks
        for name in ("relative_error", "frames"):
            del task[name]
        return task

    def _every(self, task: Task) -> float:
        """Return the time between samples, rounded to four digits."""
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

    def _length(self, eta: float, n: int) -> float:
        """Return the collisions per particle of a run that reaches the error, rounded to four digits."""
        if self.collisions_per_particle is not None:
            return self.collisions_per_particle
        assert self.relative_error is not None
        d = self.dimension
        components = min(d, (d - 1) * (d + 2) // 2)
        free_times = windows.relative_variance(components, 1.0) / self.relative_error**2 / self.replicas
        fewest = self.blocks * windows.SHORTEST * windows.LAGS[-1] / windows.PER_FREE_TIME
        return float(f"{max(free_times, fewest):.4g}")

    def settings(self) -> dict[str, Any]:
        """Return the settings that all tasks share, which must be the same for all studies in one folder."""
        return {**super().settings(), "study": "transport"}


def of_scene(path: str | Path, **given: Any) -> TransportSpec:
    """Return the study of a file.

    A file without ``[study]`` is a scene file; its size and density are then the grid.

    Parameters
    ----------
    path : path
        TOML.
    **given
        Fields of :class:`TransportSpec` that replace those of the file. A length replaces the other one, and
        a new dimension the densities.

    Raises
    ------
    InputError
        If the scene starts from a file, or is not a bulk fluid in equilibrium.
    """
    from carom.studies.eos import toml

    text = toml.read(path)
    if "study" in toml_tables(text):
        return TransportSpec(**replaced(vars(toml.load(path, TransportSpec)), given))
    plan = SceneFile.load(path)
    words: dict[str, Any] = {"initial": "auto"}
    scene = plan.scene
    if scene.initial == "file":
        raise InputError(
            "Transport needs [scene] that says what there is, with another initial than file: every replica "
            "has a start of its own."
        )
    made: Scene = plan.build_scene()
    words |= {"packing_fraction": (made.packing_fraction,), "n": (made.n,), "dimension": made.dimension}
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
    return TransportSpec(**replaced({**words, "scene": kept}, given))


__all__ = ["GRID", "TransportSpec", "of_scene"]
