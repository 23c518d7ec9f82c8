"""The observers of a scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from carom.engine.observers.currents import make_currents, make_held
from carom.engine.observers.energy import make_balance
from carom.engine.observers.flights import make_flights
from carom.engine.observers.interface import Nobody, Observers, chained
from carom.engine.observers.own import Own, make_own
from carom.engine.observers.species import make_by_species
from carom.engine.observers.stream import make_stream_sums
from carom.engine.obstacles import numbers_of
from carom.engine.system import System
from carom.models.interactions.pinned import PinnedCores
from carom.models.motions.shear import Shear


def make_observers(system: System, pair: Any, velocities: np.ndarray, lossy: bool) -> Observers | Nobody:
    """Return what observes a scene, at the start; ``lossy`` if contacts may change the energy."""
    particles = system.particles
    made: list[Any] = []
    species = None if system.scene.species is None else particles.with_padding(system.scene.species, np.int64)
    if system.straight and lossy:
        made.append(make_balance(particles.masses, velocities, system.still))
    if isinstance(system.motion, Shear):
        rate = float(system.unit.to_kernel(system.motion.rate, -1))
        made.append(make_stream_sums(rate, particles.masses, velocities, system.still))
    if species is not None:
        made.append(make_by_species(species))
    if system.currents:
        held = make_held(system.n, system.dimension, pair.energy) if system.stepped else None
        made.append(make_currents(particles.masses, velocities, species, held))
    if system.flights:
        inverse = pair.inverse if isinstance(pair, PinnedCores) else None
        made.append(make_flights(system.n, species, inverse))
    return chained([*made, *owned(system)])


def owned(system: System, origin: float = 0.0) -> list[Own]:
    """Return the user's observers as the engine tells them; ``origin`` is when epochs began."""
    if not system.observers:
        return []
    numbers = numbers_of(system.periodic, system.obstacle_models)
    exponent = system.unit.exponent
    return [
        make_own(each, system.n, system.dimension, exponent, numbers, origin) for each in system.observers
    ]
