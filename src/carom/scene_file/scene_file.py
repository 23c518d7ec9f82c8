"""A scene file: what there is and how to run it as TOML, with the names of the Python interface, no code."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from carom.errors import InputError
from carom.io.records import toml_lines
from carom.models.interactions.rule_files import RuleFile
from carom.scene.scene import Scene
from carom.scene_file.fields import tuples
from carom.scene_file.sections import RunSpec, SceneSpec
from carom.scene_file.words import scene_lines, words_of
from carom.spec import read, sections

__all__ = ["RunSpec", "SceneFile", "SceneSpec"]


@dataclass(frozen=True)
class SceneFile:
    """What ``carom run`` does: a scene, and how to run it.

    Parameters
    ----------
    scene : SceneSpec
        What there is; by default 2048 spheres at packing fraction 0.45.
    run : RunSpec
        How to run it, and what to write.
    """

    scene: SceneSpec = field(default_factory=SceneSpec)
    run: RunSpec = field(default_factory=RunSpec)

    def __post_init__(self) -> None:
        # A frame of a file has velocities, and anything else needs a temperature for them.
        if self.run.kT is None and self.scene.file is None:
            object.__setattr__(self, "run", self.run.replaced(kT=1.0))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read the TOML file ``path``; a relative ``file`` in it refers to the folder of the TOML file.

        Raises
        ------
        FileError
            If the file is missing, unreadable, too large or not text in UTF-8.
        InputError
            As from :meth:`from_toml`, with the name of the file.
        """
        path = Path(path)
        text = read(path)
        try:
            plan = cls.from_toml(text)
        except InputError as problem:
            raise InputError(f"{path}: {problem}") from problem
        return plan.beside(path.parent)

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Read ``[scene]`` and ``[run]`` of TOML ``text``; what is left out has its default.

        Raises
        ------
        InputError
            If the text is not TOML, or a section or key is unknown. If a value has the wrong type or range,
            or keys contradict each other. The message gives the line, or the nearest known key.
        """
        found = sections(text, "scene", "run")
        scene, run = found.get("scene", {}), found.get("run", {})
        SceneSpec.check_file(scene)
        RunSpec.check_words(run)
        return cls(SceneSpec(**tuples(scene)), RunSpec(**run))

    def beside(self, folder: str | Path) -> Self:
        """Return the plan with absolute paths of the files that its scene names, as seen from a folder."""
        there: dict[str, Any] = {}
        if self.scene.file is not None:
            there["file"] = str((Path(folder) / self.scene.file).absolute())
        if isinstance(self.scene.interaction, RuleFile):
            there["interaction"] = self.scene.interaction.beside(Path(folder))
        if not there:
            return self
        return dataclasses.replace(self, scene=dataclasses.replace(self.scene, **there))

    def to_toml(self) -> str:
        """Return the plan as TOML, from which :meth:`from_toml` makes an equal plan.

        Raises
        ------
        InputError
            If an obstacle, the interaction, the motion or the impact is of a class of one's own.
        """
        lines = [*scene_lines(words_of(self.scene)), "", "[run]", *toml_lines(self.run.words())]
        return "\n".join(lines) + "\n"

    def trusted(self) -> Self:
        """Return the plan with permission to run the code that its scene names: the file of a range rule.

        Raises
        ------
        InputError
            If that file cannot be read, or was edited since its digest was recorded.
        """
        rules = self.scene.interaction
        if not isinstance(rules, RuleFile):
            return self
        scene = dataclasses.replace(self.scene, interaction=rules.trusted())
        return dataclasses.replace(self, scene=scene)

    def build_scene(self) -> Scene:
        """Return the scene, placed and checked; see :meth:`SceneSpec.build`."""
        return self.scene.build(self.run.seed, self.run.kT)
