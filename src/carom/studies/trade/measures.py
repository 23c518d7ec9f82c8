"""Measures of every method: speed, horizon, reversibility, bias of Z and D."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from carom import theory
from carom.block import Block
from carom.observables import Pressure, PressureResult
from carom.observables.statistics import Estimate, unwarned
from carom.reference import NaiveSystem
from carom.scene.scene import Scene
from carom.scene.velocities import temperature
from carom.studies import phase
from carom.studies.trade.diffusion import BLOCK, EinsteinSlope, looks
from carom.studies.trade.methods import Method, Motion, naive_system

NUDGE = 1e-30
"""Displacement of the oracle's twin [box edges]: far above its rounding, and too small to saturate."""

APART = 1e-3
"""Distance from the true position at which a trajectory counts as lost [diameters]."""

SAMPLES = 4
"""Samples of a trajectory per mean free time."""

FEWEST = 16
"""Smallest number of values of D, also for a slow method."""


@dataclass(frozen=True)
class Track:
    """The true trajectory, from the oracle."""

    times: np.ndarray  # of the samples, (m,) [time]
    positions: np.ndarray  # centers (m, n, d), up to whole boxes [length]
    collisions: np.ndarray  # so far, at each sample, (m,)
    order: list[tuple[int, int]]  # the pairs that collided
    lyapunov: float  # the largest Lyapunov exponent [1 / time], from a twin moved by 10^-30

    @property
    def rate(self) -> float:
        """Collisions of one particle per unit of time."""
        return 2.0 * float(self.collisions[-1]) / (self.positions.shape[1] * float(self.times[-1]))


def true_track(
    scene: Scene,
    method: Method,
    mean_free_time: float,
    collisions_per_particle: float,
    look: Callable[..., object],
) -> Track:
    """Follow the oracle, and its twin for the first half of the time."""
    interval = mean_free_time / SAMPLES
    count = max(round(collisions_per_particle * SAMPLES), 8 * SAMPLES)
    motion, twin = method.start(scene, True), _twin(scene)
    origin = twin.time
    positions, collisions, apart = [], [], []
    for k in range(1, count + 1):
        motion.run(interval)
        positions.append(motion.positions())
        collisions.append(motion.tally()[1])
        if 2 * k <= count:
            twin.advance_to(origin + twin.arithmetic.number(interval) * k)
            difference = motion.system.positions - twin.positions  # type: ignore[attr-defined]
            apart.append(0.5 * math.log(float((difference * difference).sum())))
        look()
    times = interval * np.arange(1, count + 1)
    # During the first mean free times the difference turns into the direction of fastest growth.
    late = slice(len(apart) // 5, None)
    slope = np.polyfit(times[: len(apart)][late], np.array(apart)[late], 1)[0]
    return Track(times, np.array(positions), np.array(collisions), motion.order() or [], float(slope))


def _twin(scene: Scene) -> NaiveSystem:
    """Return the oracle, started from positions displaced by random vectors of the size ``NUDGE``."""
    rng = np.random.default_rng(0)
    system = naive_system(scene)
    number = np.vectorize(system.arithmetic.number, otypes=[object])
    moved = number(rng.normal(size=scene.positions.shape)) * system.arithmetic.number(NUDGE * max(scene.box))
    return naive_system(scene, number(scene.positions) + moved)


@dataclass(frozen=True)
class Faithfulness:
    """How long a trajectory follows the true one; ``order`` is nan for a method without collisions."""

    order: float = math.inf  # collisions per particle until the order of collisions differs; inf if never
    position: float = math.inf
    """Collisions per particle until any position differs by 10^-3 diameters; inf if never."""
    error: float = 0.0
    """Median distance from the true positions after one collision per particle [diameters]; 0 where
    doubles do not resolve it."""


def faithfulness(scene: Scene, method: Method, track: Track, look: Callable[..., object]) -> Faithfulness:
    """Follow the true trajectory with a method until it is lost."""
    motion = method.start(scene, True)
    box, n = np.asarray(scene.box), scene.n
    one = int(np.searchsorted(2.0 * track.collisions / n, 1.0))
    lost, error, step = math.inf, math.nan, float(track.times[0])
    for k, right in enumerate(track.positions):
        look()
        motion.run(step)
        away = motion.positions() - right
        away -= box * np.rint(away / box)
        distances = np.sqrt((away * away).sum(axis=1)) / scene.diameter
        if k == one:
            error = float(np.median(distances))
        if math.isinf(lost) and distances.max() > APART:
            lost = 2.0 * track.collisions[k] / n
        # The order is lost soon after the positions, and going on would be slow.
        if k >= one and 2.0 * track.collisions[k] / n > lost + 8.0:
            break
    order = motion.order()
    if order is None:
        return Faithfulness(math.nan, lost, error)
    same = next((k for k, (a, b) in enumerate(zip(order, track.order, strict=False)) if a != b), None)
    return Faithfulness(math.inf if same is None else 2.0 * same / n, lost, error)


def reversal(scene: Scene, method: Method, duration: float) -> float:
    """Return the largest distance from the start after running forward and back [diameters]."""
    motion = method.start(scene, True)
    motion.run(duration)
    back = motion.reversed()
    motion.order()
    back.run(duration)
    box = np.asarray(scene.box)
    away = back.positions() - scene.positions
    away -= box * np.rint(away / box)
    return float(np.sqrt((away * away).sum(axis=1)).max()) / scene.diameter


def speed(
    scene: Scene, method: Method, interval: float, seconds: float, look: Callable[..., object]
) -> tuple[float, Motion]:
    """Return collisions per CPU second, and the motion they were measured on, in calls for ``interval``."""
    motion = method.start(scene, False)
    motion.run(interval)
    before, began = motion.tally()[1], clock.process_time()
    while (spent := clock.process_time() - began) < seconds:
        motion.run(interval)
        look()
    return (motion.tally()[1] - before) / spent, motion


@dataclass(frozen=True)
class Measured:
    """Results of a run of a method."""

    pressure: PressureResult
    diffusion: Estimate  # D by the rule of EinsteinSlope [length^2 / time]
    seconds: float  # CPU seconds of the motion, without those of the analysis
    motion: Motion


def measured(
    scene: Scene, method: Method, mean_free_time: float, seconds: float, look: Callable[..., object]
) -> Measured:
    """Return Z and D from a run of so many CPU seconds."""
    motion = method.start(scene, False)
    motion.settle(8.0 * mean_free_time)
    duration = BLOCK * mean_free_time
    thermal = math.sqrt(temperature(scene, np.asarray(scene.velocities)) / scene.mass)
    parts = looks(scene.box, thermal, duration)
    blocks: list[Block] = []
    slope = EinsteinSlope(motion.positions(), scene.box, duration)
    last, spent = motion.tally(), 0.0
    while spent < seconds or len(slope.values) < FEWEST:
        for _ in range(parts):
            began = clock.process_time()
            motion.run(duration / parts)
            spent += clock.process_time() - began
            slope.look(motion.positions())
            look()
        slope.mark()
        now = motion.tally()
        blocks.append(Block(*(b - a for a, b in zip(last, now, strict=True))))  # type: ignore[arg-type]
        last = now
    with unwarned():  # the table shows the error bar
        found = Pressure.estimate(
            blocks,
            n=scene.n,
            dimension=scene.dimension,
            volume=scene.volume,
            diameter=scene.diameter,
            kT=motion.kT(),
            mass=scene.mass,
        )
    return Measured(found, slope.estimate(), spent, motion)


def theory_of(scene: Scene) -> tuple[str, theory.Equation] | None:
    """Return the phase of a scene that began as a crystal, and its equation of state; None without one."""
    state = phase.expected(scene.packing_fraction, scene.dimension, "crystal")
    equation = phase.usual_equation(scene.dimension, state)
    ends = state == "fluid" and scene.packing_fraction > phase.end(scene.dimension)
    return None if equation is None or ends else (state, equation)


def expected_pressure(scene: Scene) -> float | None:
    """Return Z of the scene's N by the best equation of state, or None where there is none."""
    known, eta = theory_of(scene), scene.packing_fraction
    if known is None:
        return None
    return phase.finite(float(known[1](eta)) + phase.finite_size_shift(known[0], eta, scene.n, known[1]))
