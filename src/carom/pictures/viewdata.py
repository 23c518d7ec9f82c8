"""The data of the page of :func:`carom.view`: frames or collisions as plain numbers, ready for JSON."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.bridges.embedding import embed, names_of, upright
from carom.errors import InputError
from carom.figures.palette import DIVERGING, FACES, SEQUENTIAL
from carom.frame import Frame
from carom.io.formats import Reader
from carom.models.questions.obstacle import Obstacle
from carom.observables.neighbors import nearest
from carom.observables.packing import PackingNetwork
from carom.pictures.shapes import shapes_of
from carom.scene.fields import standing
from carom.scene.overlaps import room_of_frame
from carom.texts import counted, particles

if TYPE_CHECKING:
    from carom.simulation.replay import Replay

MOST_PLACES = 2_000_000
"""Largest number of positions on a page, 24 bytes each with a velocity; of more frames, evenly spaced ones
are kept."""

MOST_COLLISIONS = 20_000
"""Default number of collisions of a replay, from the first one on."""

EMPTY = "This log holds no collision in the time that is asked for, so there is nothing to replay."

GONE = 255
"""Kind of a unit that was removed."""

NOBODY = -1
"""Partner of a particle that met a wall or an obstacle."""

SIX = 6  # neighbors that psi_6 is computed from

FAST = 2.5
"""Speed at the end of the color scale [root mean square speeds]."""


def _packed(values: Any, kind: Any) -> str:
    """Return an array as base64, little endian."""
    array = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(array.tobytes()).decode("ascii")


def _common(frame: Frame, obstacles: Sequence[Obstacle]) -> dict[str, Any]:
    """Return the data that do not change with time."""
    if not 1 <= frame.dimension <= 3:
        raise InputError(
            f"The viewer shows one to three dimensions, and these frames have {frame.dimension}; "
            "carom.pictures.plots.snapshot shows two of their coordinates."
        )
    shapes = None if frame.dimension == 1 else shapes_of(obstacles, frame.box, frame.periodic)
    kinds = None if frame.species is None else _packed(frame.species % 256, "u1")
    names = list(names_of(frame)) if frame.species is not None else []
    reach = 0.5 * float(frame.diameters.max())
    return {
        "n": frame.n,
        "dimension": frame.dimension,
        "box": [*frame.box.tolist(), *[0.0] * (3 - frame.dimension)],
        "boxes": None,
        "periodic": [*frame.periodic, *[False] * (3 - frame.dimension)],
        "reach": reach,
        "radii": _packed(0.5 * frame.diameters, "f4"),
        "kinds": kinds,
        "names": names,
        "palette": list(FACES),
        "maps": {"sequential": SEQUENTIAL, "diverging": DIVERGING},
        "positions": None,
        "velocities": None,
        "psi_6": None,
        "top": 1.0,
        "times": [frame.time],
        "marks": None,
        "bonds": None,
        "pairs": None,
        "replay": None,
        "notes": [],
        "subtitle": f"{frame.n} {particles(frame.dimension, frame.n)}",
        "obstacles": {
            "spheres": [] if shapes is None else shapes.spheres.tolist(),
            "lines": [] if shapes is None else shapes.segments.tolist(),
            "triangles": [] if shapes is None else shapes.triangles.tolist(),
        },
    }


def of_frames(frames: Sequence[Frame] | Reader, obstacles: Sequence[Obstacle]) -> dict[str, Any]:
    """Return the data of a trajectory; if there are too many frames, evenly spaced ones."""
    if len(frames) == 0:
        raise InputError("There are no frames to show; expected at least one.")
    first = frames[0]
    most = max(MOST_PLACES // first.n, 1)
    stride = math.ceil(len(frames) / most)
    kept = [frames[k] for k in range(0, len(frames), stride)]
    for frame in kept:
        if frame.n != first.n or frame.dimension != first.dimension:
            raise InputError("The frames to show differ in their number of particles or in their dimension.")
    data = _common(first, obstacles)
    boxes = np.array([frame.box for frame in kept])
    if (boxes != boxes[0]).any():
        data["boxes"], data["box"] = embed(boxes).tolist(), embed(boxes.max(axis=0)[None])[0].tolist()
        data["notes"].append("the box changes")
    velocities = np.array([frame.velocities for frame in kept])
    diameters = np.array([frame.diameters for frame in kept])
    if (diameters != diameters[0]).any():
        data["radii"] = _packed(0.5 * diameters, "f4")
        data["notes"].append("diameters change")
    if stride > 1:
        data["notes"].append(f"one of {stride} of {len(frames)} frames: a page has room for {most}")
    data["positions"] = _packed([embed(upright(frame)) for frame in kept], "f4")
    data["times"] = [float(frame.time) for frame in kept]
    data["top"] = FAST * math.sqrt(float(np.mean(np.sum(velocities**2, axis=2)))) or 1.0
    if velocities.any():  # a start has none yet, nor have many files
        data["velocities"] = _packed([embed(each) for each in velocities], "f4")
    if first.dimension == 2 and first.n > SIX:
        data["psi_6"] = _packed([psi_6(frame) for frame in kept], "f4")
    return data


def psi_6(frame: Frame) -> np.ndarray:
    """Return argument and modulus of psi_6 of every disk, (n, 2), from its six nearest neighbors."""
    room = room_of_frame(frame)
    _, bonds = nearest(room, room.wrapped(frame.positions), SIX)
    x, y = bonds(slice(None)).T
    psi = np.exp(6j * np.arctan2(y, x)).reshape(-1, SIX).mean(axis=1)
    return np.stack([np.angle(psi), np.abs(psi)], axis=1)


def of_network(network: PackingNetwork) -> dict[str, Any]:
    """Return the data of a packing: its spheres with rattlers marked, and the bonds of its backbone."""
    data = of_frames([network.frame], network.obstacles)
    frame, held = network.frame, network.held
    ends, steps = network.bonds[held], network.vectors[held]
    first = frame.positions[ends[:, 0]]
    pairs = ends[:, 1] < frame.n
    second = frame.positions[ends[pairs, 1]]
    # A bond that crosses the border is drawn from both of its ends.
    crosses = np.abs(first[pairs] + steps[pairs] - second).max(axis=1) > 0.25 * float(frame.box.min())
    segments = [
        np.stack([embed(first), embed(first + steps)], axis=1),
        np.stack([embed(second[crosses]), embed((second - steps[pairs])[crosses])], axis=1),
    ]
    data["bonds"] = _packed(np.concatenate(segments), "f4")
    data["pairs"] = _packed(np.where(network.bonds < frame.n, network.bonds, -1), "i4")
    data["marks"] = _packed(~network.backbone, "u1")
    data["subtitle"] += f" \N{MIDDLE DOT} {network.counted}, {counted(len(network.rattlers), 'rattler')}"
    return data


def at_collisions(run: Replay, collisions: int, end: float = math.inf) -> list[Frame]:
    """Return the frames of a logged run now and after each event until ``end``, as many as a page holds."""
    frames = [run.frame()]
    most = min(collisions + 1, max(MOST_PLACES // frames[0].n, 2))
    while len(frames) < most and run.step() and run.time <= end:
        frames.append(run.frame())
    if len(frames) == 1:
        raise InputError(EMPTY)
    return frames


def of_replay(run: Replay, collisions: int, end: float = math.inf) -> dict[str, Any]:
    """Return the data of a logged run from now on: place and velocity of each particle after each event."""
    frame = run.frame()
    begin = frame.time
    data = _common(frame, standing(run.scene))
    n, velocities = frame.n, frame.velocities
    owners, times, partners = [np.arange(n)], [np.full(n, frame.time)], [np.full(n, NOBODY)]
    places, speeds = [frame.positions], [velocities]
    nobody = np.zeros(n, np.int64)
    kinds = nobody if run.decided is None else run.decided
    became = [kinds]
    contacts: list[float] = []
    goes_on = False
    while (goes_on := run.step() and run.time <= end) and len(contacts) < collisions:
        frame = run.frame()
        now = nobody if run.decided is None else run.decided
        met = np.flatnonzero((frame.velocities != velocities).any(axis=1) | (now != kinds))
        velocities, kinds = frame.velocities, now
        became.append(kinds[met])
        owners.append(met)
        partners.append(met[::-1] if len(met) == 2 else np.full(len(met), NOBODY))
        times.append(np.full(len(met), frame.time))
        places.append(frame.positions[met])
        speeds.append(velocities[met])
        contacts.append(frame.time)
    if not contacts:
        raise InputError(EMPTY)
    if goes_on:
        data["notes"].append(f"the log goes on after these {counted(len(contacts), 'collision')}")
    owner, time = np.concatenate(owners), np.concatenate(times)
    order = np.lexsort((time, owner))
    flight = (contacts[-1] - begin) / len(contacts) * n / 2.0
    data["replay"] = {
        "starts": _packed(np.searchsorted(owner[order], np.arange(n + 1)), "i4"),
        "times": _packed(time[order], "f8"),
        "places": _packed(embed(np.concatenate(places)[order]), "f4"),
        "velocities": _packed(embed(np.concatenate(speeds)[order]), "f4"),
        "partners": _packed(np.concatenate(partners)[order], "i4"),
        "contacts": _packed(contacts, "f8"),
        # Half a mean free time per second, and half of one at the end, so that the last collision is seen.
        "pace": 0.5 * flight,
        "end": contacts[-1] + 0.5 * flight,
        "units": None if run.decided is None else _of_units(run, np.concatenate(became)[order]),
    }
    data["top"] = FAST * math.sqrt(float(np.mean(np.sum(velocities**2, axis=1)))) or 1.0
    return data


def _of_units(run: Replay, kinds: np.ndarray) -> dict[str, Any]:
    """Return the kind of the unit in each record, GONE if it was removed; and names and circles of kinds."""
    known = run.scene.interaction.kinds  # type: ignore[attr-defined]
    return {
        "kinds": _packed(np.where(kinds < 0, GONE, kinds % GONE), "u1"),
        "names": [kind.name for kind in known],
        "circles": [list(kind.circles) for kind in known],
    }
