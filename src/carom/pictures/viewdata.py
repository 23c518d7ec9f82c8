"""The data of the page of :func:`carom.view`: frames or collisions as plain numbers, ready for JSON."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.bridges.embedding import embed
from carom.drawing.page import FAST, MOST_PLACES, common, of_frames, packed
from carom.errors import InputError
from carom.frame import Frame
from carom.observables.packing import PackingNetwork
from carom.scene.fields import standing
from carom.texts import counted

if TYPE_CHECKING:
    from carom.simulation.replay import Replay

MOST_COLLISIONS = 20_000
"""Default number of collisions of a replay, from the first one on."""

EMPTY = "This log holds no collision in the time that is asked for, so there is nothing to replay."

GONE = 255
"""Kind of a unit that was removed."""

NOBODY = -1
"""Partner of a particle that met a wall or an obstacle."""


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
    data["bonds"] = packed(np.concatenate(segments), "f4")
    data["pairs"] = packed(np.where(network.bonds < frame.n, network.bonds, -1), "i4")
    data["marks"] = packed(~network.backbone, "u1")
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
    data = common(frame, standing(run.scene))
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
        "starts": packed(np.searchsorted(owner[order], np.arange(n + 1)), "i4"),
        "times": packed(time[order], "f8"),
        "places": packed(embed(np.concatenate(places)[order]), "f4"),
        "velocities": packed(embed(np.concatenate(speeds)[order]), "f4"),
        "partners": packed(np.concatenate(partners)[order], "i4"),
        "contacts": packed(contacts, "f8"),
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
        "kinds": packed(np.where(kinds < 0, GONE, kinds % GONE), "u1"),
        "names": [kind.name for kind in known],
        "circles": [list(kind.circles) for kind in known],
    }
