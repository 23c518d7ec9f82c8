"""Stretches of a run, for whatever measures: sums since the start, blocks of equal time, their estimate."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.block import Block, EnergySample, MomentumFlux, VolumeSums, weighted_sum
from carom.errors import InputError
from carom.models.motions.shear import Shear
from carom.observables.analysis.drift import STUCK, moved
from carom.observables.pressure import PressureResult
from carom.observables.statistics import FewSamples, unwarned
from carom.scene.velocities import degrees_of_freedom
from carom.simulation import run_loop
from carom.simulation.measuring import mechanics, readings
from carom.simulation.system_of_scene import driven_speed_of
from carom.theory import is_stable_fluid

if TYPE_CHECKING:
    from carom.simulation.simulation import Simulation


def tally(sim: Simulation) -> Block:
    """Return duration, collisions and virial since the start, and the time integral of kT where it changes.

    The sizes of growing diameters are not known of it.
    """
    with sim._state.alone.reading():
        return mechanics.sums(sim._state)


def estimate(sim: Simulation, observable: Any, blocks: Sequence[Block]) -> Any:
    """Return the estimate of an ``observable`` from ``blocks``, such as :func:`blocks` yields."""
    if sim._state.system.rates is not None and any(block.sizes is None for block in blocks):
        raise InputError("Sums since the start do not know how diameters grew; use blocks of run().")
    scene = sim.scene
    with unwarned(FewSamples):  # carom.observables.analysis.equilibrium.doubts says it, and of what
        found = observable.of_scene(blocks, scene, kT=sim.kT)
    if isinstance(found, PressureResult) and found.simple and scene.dimension > 1:
        frozen = not is_stable_fluid(scene.dimension, found.packing_fraction)
        solid = frozen and moved(scene.positions, sim.frame()) < STUCK
        found = dataclasses.replace(found, solid=solid)
    return found


def mark(sim: Simulation) -> Block:
    """Return the sums since the start, with momenta at walls and energies as they are now."""
    state = sim._state
    momenta, surfaces = mechanics.momenta_at_walls(state)
    energy = readings.energy_now(state)
    return tally(sim)._replace(momentum_changes=momenta, surface_changes=surfaces, energy=energy)


def recalled(words: Sequence[Any]) -> Block:
    """Return the mark of which a file has the numbers in lists."""
    values: list[Any] = [tuple(each) if isinstance(each, list) else each for each in words]
    found = Block(*values)
    return found._replace(
        energy=found.energy and EnergySample(*found.energy),
        momentum_flux=found.momentum_flux and MomentumFlux(*map(np.asarray, found.momentum_flux)),
        volumes=found.volumes and VolumeSums(*found.volumes),
    )


def between(sim: Simulation, before: Block, after: Block, duration: float) -> Block:
    """Return the sums over a ``duration`` [time] between two marks of a simulation."""
    block: Block = weighted_sum(after, before, 1, -1)
    block = block._replace(duration=duration)
    freedoms = degrees_of_freedom(sim.scene)
    return block._replace(energy=readings.mean_energy(before.energy, after.energy, block, freedoms))


def run_to(sim: Simulation, instant: Fraction, look: Callable[[float], object] | None = None) -> Block:
    """Continue a run to an exact instant; ``look`` may save it on the way, or end it by what it raises."""
    return run_loop.advance(sim._state, None, instant, progress=look)


def blocks(sim: Simulation, duration: float, count: int) -> Iterator[Block]:
    """Continue a run for ``count`` blocks of the time ``duration`` [time] and yield each."""
    start, step = sim._state.clock.instant, Fraction(checks.number(duration, "duration", low=0.0))
    before = mark(sim)
    for k in range(1, checks.integer(count, "count", low=0) + 1):
        block, after = run_to(sim, start + k * step), mark(sim)
        yield between(sim, before, after, block.duration)._replace(sizes=block.sizes)
        before = after


def time_for(sim: Simulation, collisions: float) -> float:
    """Return the time that a number of pair collisions takes at the rate so far [time].

    With fewer than 1000 collisions so far, the run first continues up to 1000.
    """
    collisions = checks.number(collisions, "collisions", low=0.0)
    if sim.n == 1 or _rests(sim):
        raise InputError("Nothing collides in this scene: give time= instead of a number of collisions.")
    if sim.collisions < 1000:
        sim.run(collisions=1000 - sim.collisions)
    if sim.collisions == 0:
        raise InputError("Nothing collides in this scene: give time= instead of a number of collisions.")
    return float(collisions) * sim.time / sim.collisions


def _rests(sim: Simulation) -> bool:
    """Tell whether nothing moves, and no field, obstacle, growth or rule will change that."""
    state = sim._state
    starts = state.system.rates is not None or state.engine.model.rules is not None
    starts = starts or sim.scene.drive is not None or driven_speed_of(sim.scene) > 0.0
    return state.start.energy == 0.0 and sim.collisions == 0 and not starts


def cools(sim: Simulation) -> bool:
    """Return whether contacts lose energy, and growth adds none."""
    system = sim._state.system
    sheared = isinstance(system.motion, Shear)  # the stream makes up for what is lost
    return not system.conserves_energy and system.rates is None and not sheared


class Blocks:
    """Successive blocks of a simulation, of about so many pair collisions.

    In blocks of equal time nearly all collisions of a cooling gas would fall into the first. Lengths follow
    from the temperature at the beginning and earlier collisions, never a block's own: no mean is biased.
    """

    def __init__(self, sim: Simulation, collisions: float):
        self._sim, self._wanted = sim, collisions
        self._duration = time_for(sim, collisions)
        self._cools = cools(sim)
        self._seen, self._thermal = 0, 0.0

    def next(self, size: int = 1) -> Block:
        """Run on for a block of ``size`` times the collisions, and return it."""
        if self._cools and self._seen:
            rate = self._seen / self._thermal * math.sqrt(self._sim.kT)
            self._duration = self._wanted / rate
        (block,) = blocks(self._sim, size * self._duration, 1)
        if block.kT_time is not None:
            self._seen += block.collisions
            self._thermal += math.sqrt(block.kT_time * block.duration)  # of the time in units of 1 / speed
        return block
