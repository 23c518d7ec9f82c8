"""A scene in words, for its ``repr``, notebooks, titles and tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.models.contacts.restitution import Restitution
from carom.models.interfaces.particles import species_count
from carom.models.obstacles.box_walls import wall_name
from carom.models.obstacles.faces import stand_ins
from carom.scene.fields import Fields, is_elastic, standing
from carom.texts import axis_name, html, particles, span, visible


def kind(dimension: int, number: int = 2, interaction: Any = None) -> str:
    """Return what is simulated, for a title: "hard spheres", "disk with wells and bonds", "units"."""
    name = particles(dimension, number)
    if interaction is None:
        return f"hard {name}"
    if getattr(interaction, "decides", False):
        return "unit" if number == 1 else "units"
    return f"{name} with {getattr(interaction, 'words', type(interaction).__name__)}"


def facts(scene: Fields) -> dict[str, str]:
    """Return the properties of a scene as text, by name."""
    facts = {
        "n": str(scene.n),
        "dimension": str(scene.dimension),
        "box": "(" + ", ".join(f"{x:.6g}" for x in scene.box) + ("," if scene.dimension == 1 else "") + ")",
        "diameter": span(scene.diameters),
        "mass": span(scene.masses),
        "packing_fraction": f"{scene.packing_fraction:.6g}",
    }
    if scene.species is not None:
        counts = np.bincount(scene.species, minlength=species_count(scene))
        names = scene.species_names or [str(k) for k in range(len(counts))]
        facts["species"] = ", ".join(
            f"{visible(name)} {count}" for name, count in zip(names, counts, strict=True)
        )
    if scene.contact is not None:
        facts["contact"] = "by species"
    if scene.walls:
        facts["walls"] = _walls(scene)
    if scene.obstacles:
        facts["obstacles"] = ", ".join(visible(name) for name in _named(scene))
    if scene.pinned is not None:
        facts["pinned"] = str(int(scene.pinned.sum()))
    if not is_elastic(scene):
        law = scene.impact
        facts["impact"] = f"{law.restitution:.6g}" if isinstance(law, Restitution) else type(law).__name__
    if scene.drive is not None:
        facts["drive"] = type(scene.drive).__name__
    if scene.velocities is not None:
        facts["velocities"] = "given"
    return facts


def _walls(scene: Fields) -> str:
    """Return the axes with walls, and the walls with properties."""
    axes = ", ".join(axis_name(axis) for axis, wraps in enumerate(scene.periodic) if not wraps)
    special = ", ".join(name for name, wall in scene.walls.items() if not wall.is_plain)
    return f"{axes} ({special} with properties)" if special else axes


def _named(scene: Fields) -> list[str]:
    """Return the names of the obstacles, and for which walls they stand."""
    names, everything = [], standing(scene)
    replaced = stand_ins(everything, scene.box, scene.periodic)
    before = len(everything) - len(scene.obstacles)
    for k, obstacle in enumerate(scene.obstacles, before):
        walls = ", ".join(wall_name(*wall) for wall, number in replaced.items() if number == k)
        names.append(f"{obstacle.name} (for the wall {walls})" if walls else obstacle.name)
    return names


def table(scene: Fields) -> str:
    """Return these properties as a table in HTML."""
    rows = "".join(
        f"<tr><th>{html(k.replace('_', ' '))}</th><td>{html(v)}</td></tr>" for k, v in facts(scene).items()
    )
    return f"<table><caption>carom.Scene</caption>{rows}</table>"
