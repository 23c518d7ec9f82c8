"""The scene that a section ``[scene]`` describes.

What is ``asked`` for is a :class:`carom.scene_file.sections.SceneSpec`, which calls :func:`build`.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from carom import seeds, sizes
from carom.errors import InputError
from carom.frame import Frame
from carom.scene import lattices
from carom.scene.storage import MODELS
from carom.simulation.moves.growth import Scene


def build(asked: Any, seed: Any, kT: float | None = None) -> Scene:
    """Return the scene; see :meth:`carom.scene_file.sections.SceneSpec.build`."""
    if asked.file is not None:
        from carom.io.trajectory import open_reader

        with open_reader(asked.file, diameter=asked.diameter, box=asked.box) as reader:
            return of_frame(asked, reader.frame(-1 if asked.frame is None else asked.frame), seed, kT)
    words: dict[str, Any] = {"obstacles": asked.obstacles}
    words |= {
        name: value for name in ("packing_fraction", "density", "walls") if (value := getattr(asked, name))
    }
    if asked.species:
        words |= {"n": asked.n, "species": list(asked.species), "contact": asked.contact, "seed": seed}
    else:
        diameters = None if asked.sizes is None else sizes.of_table(asked.sizes, asked.n, seed)
        words |= {"diameter": asked.diameter if diameters is None else diameters, "mass": asked.mass}
    if asked.lattice is None:
        words |= {"n": asked.n, "dimension": asked.dimension, "box": asked.box, "seed": seed}
        scene = Scene.random(**words)
    else:
        lattice, cells = lattices.named(asked.lattice, asked.dimension), asked.cells
        if cells is None and not asked.species:
            cells = lattices.cells_for(lattice, asked.n)
        scene = Scene.crystal(lattice=lattice, cells=cells, **words)
    added = _added(asked, scene.n, seed)
    return scene.replace(**added) if added else scene


def of_frame(asked: Any, frame: Frame, seed: Any, kT: float | None) -> Scene:
    """Return the scene that starts from a frame of its file."""
    drawn = kT is not None or "velocities" in frame.lacks
    if drawn:  # a pinned one may have flown in the file
        frame = dataclasses.replace(frame, velocities=np.zeros_like(frame.velocities))
    given = {"contact": asked.contact, "obstacles": asked.obstacles, **_added(asked, frame.n, seed)}
    if asked.walls is not None:
        given["walls"] = asked.walls
    scene = Scene.from_frame(frame, **given)
    return scene.replace(velocities=None) if drawn else scene


def _added(asked: Any, n: int, seed: Any) -> dict[str, Any]:
    """Return the models and pinned particles given, by argument name."""
    given = {name: value for name in MODELS if (value := getattr(asked, name)) is not None}
    given |= asked.own()
    if asked.pinned is not None:
        given["pinned"] = _who_is_pinned(asked.pinned, n, seed)
    return given


def _who_is_pinned(pinned: int | tuple[int, ...], n: int, seed: Any) -> np.ndarray:
    """Return the numbers of the particles that are pinned."""
    if isinstance(pinned, tuple):
        return np.array(pinned, np.int64)
    if pinned > n:
        raise InputError(f"[scene] pinned is {pinned}, and there are {n} particles.")
    return np.sort(seeds.generator(seed, "pinned").permutation(n)[:pinned])
