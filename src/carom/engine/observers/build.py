"""The observers of a scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.engine.observers.currents import make_currents, make_held
from carom.engine.observers.energy import make_balance
from carom.engine.observers.flights import make_flights
from carom.engine.observers.interface import Observers, chained
from carom.engine.observers.own import Own, make_own
from carom.engine.observers.species import make_by_species
from carom.engine.obstacles import numbers_of
from carom.engine.requirements import Contents
from carom.models.pinned import PinnedCores


def make_observers(contents: Contents, pair: Any, velocities: np.ndarray, lossy: bool) -> Observers | None:
    """Return everything that observes a scene with velocities (n, d), before anything has happened.

    ``lossy`` says whether contacts may change the energy.
    """
    particles = contents.particles
    made: list[Any] = []
    kinds = None if contents.kinds is None else particles.with_ghost(contents.kinds, np.int64)
    if contents.straight and lossy:
        made.append(make_balance(particles.masses, velocities, contents.still))
    if kinds is not None:
        made.append(make_by_species(kinds))
    if contents.currents:
        held = make_held(contents.n, contents.dimension, pair.energy) if contents.stepped else None
        made.append(make_currents(particles.masses, velocities, kinds, held))
    if contents.flights:
        inverse = pair.inverse if isinstance(pair, PinnedCores) else None
        made.append(make_flights(contents.n, kinds, inverse))
    return chained([*made, *owned(contents)])


def owned(contents: Contents, origin: float = 0.0) -> list[Own]:
    """Return the user's own observers, as the engine tells them of events.

    ``origin`` is when the counting of epochs began, since the start of the run.
    """
    if not contents.observers:
        return []
    numbers = numbers_of(contents.periodic, contents.obstacle_models)
    exponent = contents.unit.exponent
    return [
        make_own(each, contents.n, contents.dimension, exponent, numbers, origin)
        for each in contents.observers
    ]
