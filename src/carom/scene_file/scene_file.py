"""A scene and its run as a TOML file, with the names of the Python interface, and no code."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from carom import checks
from carom.errors import InputError
from carom.io.records import read_text, toml_lines, toml_tables, toml_value
from carom.models.files import to_tables
from carom.models.interactions.rule_files import RuleFile
from carom.models.obstacles import Obstacle
from carom.scene.scene import Scene
from carom.scene_file.sections import OutputSpec, RunSpec, SceneSpec, SpeciesSpec

__all__ = ["OutputSpec", "RunSpec", "SceneFile", "SceneSpec", "SpeciesSpec", "template"]

#: Largest scene file [bytes]. A scene file is about a page; parsing a larger file would only cost time.
LARGEST_FILE = 64 * 1024

A_SCENE = "a scene file (TOML) of about a page, as `carom init` writes it"


@dataclass(frozen=True)
class SceneFile:
    """A scene, its run and its output: what ``carom run`` does.

    Parameters
    ----------
    scene : SceneSpec
        What to simulate; by default 2048 spheres at packing fraction 0.45, from fcc.
    run : RunSpec
        How long to simulate.
    output : OutputSpec
        What to write.
    """

    scene: SceneSpec = field(default_factory=lambda: SceneSpec(cells=8, packing_fraction=0.45))
    run: RunSpec = field(default_factory=RunSpec)
    output: OutputSpec = field(default_factory=OutputSpec)

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
        text = read_text(path, A_SCENE, LARGEST_FILE)
        try:
            plan = cls.from_toml(text)
        except InputError as problem:
            raise InputError(f"{path}: {problem}") from problem
        return plan.beside(path.parent)

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Read a plan from TOML ``text``; sections and keys that are left out have their defaults.

        Raises
        ------
        InputError
            If the text is not TOML, or a section or key is unknown. If a value has the wrong type or range,
            or keys contradict each other. The message gives the line, or the nearest known key.
        """
        if len(text) > LARGEST_FILE:
            raise InputError(f"A scene file has at most {LARGEST_FILE} characters, found {len(text)}.")
        tables = toml_tables(text)
        specs = {f.name: f for f in dataclasses.fields(cls)}
        values: dict[str, Any] = {}
        for name, table in tables.items():
            if name not in specs:
                raise InputError(_unknown(name, tables[name], specs))
            if not isinstance(table, dict):
                raise InputError(f"[{name}] must be a section, found {checks.describe(table)}.")
            values[name] = _section(name, table)
        return cls(**values)

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
        lines: list[str] = []
        for section in dataclasses.fields(self):
            spec = getattr(self, section.name)
            lines.append(f"[{section.name}]")
            tables: list[str] = []
            for key in dataclasses.fields(spec):
                value = getattr(spec, key.name)
                if key.name in _TABLES:
                    for each in value:
                        tables += ["", f"[[{section.name}.{key.name}]]", *toml_lines(_TABLES[key.name](each))]
                elif key.name == "walls" and isinstance(value, Mapping):
                    for wall, table in to_tables.walls_to_table(value).items():
                        tables += ["", f"[{section.name}.walls.{wall}]", *toml_lines(table)]
                elif value is not None and key.name in _MODELS:
                    table = _model_table(key.name, value)
                    if key.name == "impact" and isinstance(to_tables.impact_to_table(value), float):
                        lines.append(f"impact = {toml_value(table['restitution'])}")
                        continue
                    tables += ["", f"[{section.name}.{key.name}]", *toml_lines(table)]
                elif value is not None:
                    lines.append(f"{key.name} = {toml_value(value)}")
            lines += [*tables, ""]
        return "\n".join(lines)

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
        return self.scene.build(self.run.seed)


def template() -> str:
    """Return the default plan as commented TOML, a start for your own."""
    from importlib.resources import files

    return files("carom").joinpath("scene.toml").read_text(encoding="utf-8")


def _obstacle_table(obstacle: Obstacle) -> dict[str, Any]:
    table = to_tables.obstacle_to_table(obstacle)
    if table["type"] == "own":
        raise InputError(
            f"The obstacle {obstacle.name} is of a class of one's own, which a scene file cannot hold."
        )
    return table


def _model_table(name: str, value: Any) -> dict[str, Any]:
    if not to_tables.holds(value):
        raise InputError(
            f"[scene] {name} is {checks.describe(value)}, of a class of one's own, which a scene file cannot "
            "hold: run it with carom.Simulation."
        )
    return dict(value.to_table())


#: Keys whose values are models.
_MODELS = ("interaction", "motion", "impact", "drive")

#: Keys whose values are lists of tables, and the function that makes such a table.
_TABLES: dict[str, Any] = {"species": dataclasses.asdict, "obstacles": _obstacle_table}

_SPECS: dict[str, Any] = {"scene": SceneSpec, "run": RunSpec, "output": OutputSpec}


#: What other words of [scene] are called here.
_INSTEAD = {
    "periodic": 'axes without walls are periodic: give walls = "y", say',
    "restitution": "give impact = 0.9, say",
    "elastic_below": "give impact = { restitution = 0.9, elastic_below = 0.01 }, say",
}


def _section(name: str, table: dict[str, Any]) -> Any:
    """Return the section as its dataclass, lists as tuples."""
    known = {f.name for f in dataclasses.fields(_SPECS[name])}
    for key in table:
        if key not in known:
            nearest = _INSTEAD.get(key) if name == "scene" else None
            nearest = checks.suggestion(key, known) if nearest is None else f"; {nearest}"
            raise InputError(f"[{name}] {_shown(key)} is no known key{nearest}.")
    values = {k: _tuples(v) for k, v in table.items()}
    if name == "scene" and values.get("initial", "fcc") == "fcc":
        # Only fcc, the default start, has a default size and density.
        counted = any(isinstance(each, dict) and "count" in each for each in _listed(values.get("species")))
        if not values.keys() & {"cells", "n"} and not counted:
            values["cells"] = 8
        if not values.keys() & {"packing_fraction", "density", "box"}:
            values["packing_fraction"] = 0.45
    return _SPECS[name](**values)


def _tuples(value: Any) -> Any:
    """Return lists as tuples, also those within lists and tables."""
    if isinstance(value, list):
        return tuple(_tuples(each) for each in value)
    if isinstance(value, dict):
        return {key: _tuples(each) for key, each in value.items()}
    return value


def _listed(value: Any) -> tuple[Any, ...]:
    """Return a value if it is a list (as a tuple), otherwise an empty one."""
    return value if isinstance(value, tuple) else ()


def _unknown(name: str, value: Any, specs: dict[str, Any]) -> str:
    """Return the message about an unknown section, or about a key outside of the sections."""
    if isinstance(value, dict):
        return f"[{_shown(name)}] is no known section{checks.suggestion(name, set(specs))}."
    for section, spec in _SPECS.items():
        if name in {f.name for f in dataclasses.fields(spec)}:
            return f"{name} stands outside of any section; write it below [{section}]."
    return f"{_shown(name)} stands outside of any section and is no known key."


def _shown(name: str) -> str:
    """Return a name for a message: short and printable."""
    shown = name if len(name) <= 40 else name[:37] + "..."
    return shown if shown.isprintable() and shown else repr(shown)
