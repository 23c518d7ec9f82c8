"""What a study of sheared fluids asks for: the section ``[shear]``, and ``[scene]``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from carom.declared import described, integer, number, option, several, word
from carom.errors import InputError
from carom.spec import numbers_of
from carom.studies.grid import LENGTH, SYSTEM, Blocks, Length, Replicas, SceneGrid, Sizes

FIRST = 20.0
"""Strain after which the error of the viscosity is looked at first."""

REFUSED = ("walls", "obstacles", "pinned")
"""Keys of a scene that cannot be sheared."""


@described
@dataclass(frozen=True)
class ShearSpec(SceneGrid):
    """Sheared boxes: shear rates x packing fractions x numbers of particles x replicas.

    Raises
    ------
    InputError
        If a value is out of range, keys contradict each other, the scene cannot be sheared, or nothing takes
        the heat of the flow.

    Notes
    -----
    With steps (``scene={"interaction": SquareWell(1.5)}``) packing fractions, and the collisions of the
    equilibration, are those of hard cores of the scene's diameter.
    """

    study: ClassVar[str] = "shear flow"
    section: ClassVar[str] = "shear"
    argument: ClassVar[str] = r"Scene file (TOML): \[scene] and \[shear]. Without: four rates."
    about: ClassVar[str] = """Measure viscosity and normal stresses against the shear rate.

    The box is sheared as Lees and Edwards do. Elastic particles are kept at kT, and compared with Enskog's
    theory; inelastic ones come to a balance of their own. The folder then holds study.toml, a result file for
    each run in tasks/, shear.csv and shear.png. Finished runs are not repeated: the same command continues a
    study that was stopped.

    [bold]Examples[/bold]

    carom shear
    carom shear --rate 0.1:1:4 --eta 0.2,0.4 --relative-error 0.02
    carom shear --rate 1 --restitution 0.9 --eta 0.1:0.45:8 --strains 300 --report
    carom shear grains.toml --out grains -j 8
    """
    grid: ClassVar[tuple[str, ...]] = ("rate", *SceneGrid.grid)
    rivals: ClassVar[tuple[tuple[str, ...], ...]] = (("relative_error", "strains"),)
    measured: ClassVar[str] = "strains"
    error: ClassVar[float] = 0.02
    refused: ClassVar[Mapping[str, str]] = {
        "motion": "is the flow, of which [shear] says the rate; remove it.",
        **dict.fromkeys(REFUSED, "does not go with a shear flow; remove it."),
    }
    densities: ClassVar[Mapping[int, tuple[float, ...]]] = {2: (0.4,), 3: (0.25,), 4: (0.1,)}

    n: Sizes = (500,)
    replicas: Replicas = 2
    dimension: int = option(integer(low=2, high=12), "Dimension of space, from 2 on.", SYSTEM, default=3)
    kT: float = option(
        number(low=0.0, high=1e304, open_low=True),
        "Temperature kT, an energy; inelastic particles have one of their own.",
        SYSTEM,
        ("--kT",),
        default=1.0,
    )
    equilibration: Length = 300.0
    blocks: Blocks = 64
    rate: tuple[float, ...] = option(
        several(number(low=0.0, open_low=True)),
        "Shear rates; as an option 0.1,0.2,0.4 or 0.1:1:4 (4 from 0.1 to 1).",
        SYSTEM,
        read=numbers_of("--rate"),
        default=(0.1, 0.2, 0.4, 0.8),
    )
    restitution: float | None = option(
        number(low=0.0, high=1.0, open_low=True),
        "Normal velocity that contacts keep, instead of the impact of the scene.",
        SYSTEM,
    )
    thermostat: str = option(
        word("auto", "rescale", "none"),
        "rescale keeps kT by scaling velocities; auto does where no contact loses energy and the "
        "scene has no drive.",
        SYSTEM,
        default="auto",
    )
    strains: float | None = option(None, "Instead of an error: strain of every run.", LENGTH)

    @classmethod
    def of_sections(cls, words: dict[str, Any], others: dict[str, Any]) -> dict[str, Any]:
        """Return the fields from the section (``words``) and from ``[scene]`` in ``others``.

        The motion of the scene says the rate where the section does not.

        Raises
        ------
        InputError
            If the motion is not that of a steady flow that begins in a rectangular box.
        """
        scene = others.get("scene", {})
        motion = scene.get("motion")
        if isinstance(motion, Mapping) and motion.get("type") == "shear" and "rate" in motion:
            from carom.models.motions.shear import Shear
            from carom.scene_file.sections import SceneSpec

            flow = SceneSpec(motion=motion).motion
            if flow != Shear(flow.rate):
                raise InputError(
                    "[scene] motion has a period or a tilt, and a study measures steady flows that begin in "
                    "a rectangular box; leave them out, or use carom run."
                )
            words = {"rate": motion["rate"], **words}
            others = {"scene": {name: value for name, value in scene.items() if name != "motion"}}
        return super().of_sections(words, others)

    def complete(self) -> None:
        """Check the grid and what takes the heat of the flow; errors are those of :class:`ShearSpec`."""
        if self.restitution is not None and isinstance(self.scene, Mapping):
            self._put("scene", {**self.scene, "impact": self.restitution})
        super().complete()
        if "interaction" in self.scene and "impact" in self.scene:
            raise InputError(
                "[scene] interaction of steps does not go with contacts that lose energy; remove it, or the "
                "impact and restitution."
            )
        driven = "drive" in self.scene
        if driven and self.thermostat == "rescale":
            raise InputError('[scene] drive and rescaling contradict each other; give thermostat = "none".')
        if self.thermostat == "none" and not driven and self._conserves():
            raise InputError(
                "Without a thermostat the flow heats elastic particles without end; leave thermostat out, or "
                "give a restitution below 1 or a [scene] drive."
            )

    def tasks(self) -> list[dict[str, Any]]:
        """Return the tasks, the longest first."""
        from carom.models.motions.shear import Shear

        goal = self.relative_error and float(f"{self.relative_error * math.sqrt(self.replicas):.6g}")
        rescaled = (
            "drive" not in self.scene
            and self.thermostat != "none"
            and (self.thermostat == "rescale" or self._conserves())
        )
        tasks = [
            {
                **task,
                "scene": {**task["scene"], "motion": Shear(rate).to_table()},
                "rate": rate,
                "rescale": rescaled,
                "relative_error": goal,
                "strains": self.strains or FIRST,
            }
            for task in super().tasks()
            for rate in self.rate
        ]
        return sorted(tasks, key=duration, reverse=True)

    def _conserves(self) -> bool:
        """Return whether no contact loses energy."""
        from carom.scene_file.sections import SceneSpec

        impact = SceneSpec(impact=self.scene.get("impact")).impact
        return impact is None or bool(getattr(impact, "conserves_energy", False))


def duration(task: Mapping[str, Any]) -> float:
    """Return the work of a task: particles times the time of its strain, or of the first one."""
    return float(task["scene"]["n"] * task["strains"] / task["rate"])
