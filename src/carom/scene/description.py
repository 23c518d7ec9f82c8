"""A scene in words, for its ``repr``, notebooks, titles and tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.models.obstacles.faces import name_of, stand_ins
from carom.models.obstacles.planes import sides
from carom.scene.fields import Fields
from carom.texts import html, visible


def particles(dimension: int, number: int = 2) -> str:
    """Return the word for `number` particles: "rods", "disk", "spheres in 4D"."""
    name = {1: "rod", 2: "disk"}.get(dimension, "sphere") + ("" if number == 1 else "s")
    return f"{name} in {dimension}D" if dimension > 3 else name


def kind(dimension: int, number: int = 2, interaction: Any = None) -> str:
    """Return what is simulated, for a title: "hard spheres", "disk with wells and bonds", "units".

    Parameters
    ----------
    dimension, number : int
        Of space; of particles.
    interaction : interaction, optional
        What acts between them, if not hard cores. It may have ``words`` for it; otherwise its class is named.
    """
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
        "diameter": _span(scene.diameters),
        "mass": _span(scene.masses),
        "packing_fraction": f"{scene.packing_fraction:.6g}",
    }
    if scene.species is not None:
        counts = np.bincount(scene.species, minlength=scene.species_count)
        names = scene.species_names or [str(k) for k in range(len(counts))]
        facts["species"] = ", ".join(
            f"{visible(name)} {count}" for name, count in zip(names, counts, strict=True)
        )
    if scene.contact is not None:
        facts["contact"] = "by species"
    standing = stand_ins(scene.obstacles, scene.box, scene.periodic)
    axes = dict.fromkeys(str(wall[0]) for wall in sides(scene.periodic) if wall not in standing)
    if axes:
        facts["walls"] = f"axis {', '.join(axes)}"
    if scene.obstacles:
        facts["obstacles"] = ", ".join(visible(name) for name in _named(scene, standing))
    if scene.pinned is not None:
        facts["pinned"] = str(int(scene.pinned.sum()))
    if scene.restitution < 1:
        facts["restitution"] = f"{scene.restitution:.6g}"
    if scene.drive is not None:
        facts["drive"] = type(scene.drive).__name__
    if scene.velocities is not None:
        facts["velocities"] = "given"
    return facts


def _named(scene: Fields, standing: dict[tuple[int, int], int]) -> list[str]:
    """Return the names of the obstacles, and for which walls they stand."""
    names = []
    for k, obstacle in enumerate(scene.obstacles):
        walls = ", ".join(name_of(wall) for wall, number in standing.items() if number == k)
        names.append(f"{obstacle.name} (for the {walls})" if walls else obstacle.name)
    return names


def table(scene: Fields) -> str:
    """Return these properties as a table in HTML."""
    rows = "".join(
        f"<tr><th>{html(k.replace('_', ' '))}</th><td>{html(v)}</td></tr>" for k, v in facts(scene).items()
    )
    return f"<table><caption>carom.Scene</caption>{rows}</table>"


def _span(values: np.ndarray) -> str:
    """Return the smallest and the largest value as text, or one if they are equal."""
    low, high = float(values.min()), float(values.max())
    return f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"
