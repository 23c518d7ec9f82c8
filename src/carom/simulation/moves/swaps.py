"""Swaps: pairs of particles exchange their diameters at times between events, so that dense liquids relax.

Exchanges that are undone where they make an overlap keep the uniform distribution, as a pair is drawn as
often before as after; so does flight, and both in any fixed order. Masses are equal: velocities, energy and
momentum stay. Berthier, Coslovich, Ninarello, Ozawa, Phys. Rev. Lett. 116 (2016) 238002; with molecular
dynamics Berthier et al., J. Stat. Mech. (2019) 064004. All is scheduled anew if a pair has changed. Draws
depend on the sweep's number alone.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from carom import checks, seeds
from carom.compiling.entry import entry
from carom.declared import SEED, Declared, described, integer, needed, number, option, positive
from carom.errors import InputError
from carom.geometry.overlaps import Geometry
from carom.models.motions.free_flight import FreeFlight
from carom.scene.fields import is_elastic, is_usual, standing
from carom.suggestions import corrected

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene

SLIGHT = 2.0**-20  # pairs are listed up to contacts that are longer by so much, so that rounding loses none


@described
@corrected()
@dataclass(frozen=True)
class Swaps(Declared):
    """Exchanges of diameters between particles, in sweeps at equal intervals of time.

    Raises
    ------
    InputError
        If a parameter is out of range.

    Examples
    --------
    >>> import carom
    >>> sizes = carom.sizes.power(108, ratio=0.45)
    >>> scene = carom.Scene.random(packing_fraction=0.4, diameter=sizes)
    >>> sim = carom.Simulation(scene, swaps=carom.Swaps(interval=1.0, within=0.2))
    >>> block = sim.run(time=5.0)
    >>> 0 < sim.statistics.swaps_accepted < sim.statistics.swaps_tried
    True
    """

    after: ClassVar[str] = " of Swaps"

    interval: float = needed(
        positive,
        "Time between two sweeps [time]; all events are predicted anew after each, which costs about as much "
        "as one collision of each particle.",
    )
    attempts: int = option(
        integer(low=1, high=1_000_000), "Pairs that are drawn in a sweep, for each particle.", default=10
    )
    within: float | None = option(
        number(low=0.0),
        "Largest difference of two diameters that are exchanged [length]; by default there is no limit. "
        "Exchanges of very different ones are hardly ever accepted.",
    )
    seed: int = option(SEED, "Seed of the pairs drawn.", default=1)


class Sweeps(NamedTuple):
    """The swaps of a run, and how far they are."""

    swaps: Swaps
    done: int = 0
    tried: int = 0
    accepted: int = 0

    @property
    def next(self) -> Fraction:
        """When the next sweep is due [time]."""
        return (self.done + 1) * Fraction(self.swaps.interval)


def beside_free_hard_cores(scene: Scene, system: System) -> tuple[tuple[str, bool], ...]:
    """Return what cannot go with moves that keep the distribution of free hard cores, and if it is there."""
    return (
        ("pinned particles", scene.pinned is not None),
        ("an interaction other than hard cores", not is_usual(scene, "interaction")),
        ("a motion other than free flight", not isinstance(scene.motion, FreeFlight)),
        ("contacts that lose energy", not is_elastic(scene)),
        ("precision='single'", system.single),
    )


def checked_swaps(swaps: Any, scene: Scene, system: System, event_log: Any) -> Sweeps | None:
    """Return the swaps of a run before the first, or None where none are asked for."""
    if swaps is None:
        return None
    if not isinstance(swaps, Swaps):
        raise InputError(f"swaps must be carom.Swaps(...), found {checks.describe(swaps)}.")
    moves = any(hasattr(each, "live") for each in standing(scene))
    for wrong, found in (
        ("different masses", np.ptp(scene.masses) != 0.0),
        ("species, which would not go with the diameters", scene.species is not None),
        *beside_free_hard_cores(scene, system),
        ("walls or obstacles that move or lose energy", moves),
        ("an event log, which holds one diameter a particle", event_log is not None),
        ("equal diameters", np.ptp(scene.diameters) == 0.0),
    ):
        if found:
            raise InputError(f"swaps are not defined for {wrong}: leave one of the two out.")
    return Sweeps(swaps)


def sweep(run_state: Any) -> None:
    """Try the exchanges that are due at the present time; all is scheduled anew if a pair has changed."""
    from carom.engine.build import enlarge_neighbors

    sweeps: Sweeps = run_state.sweeps
    order, tried, accepted = _exchanged(run_state, sweeps)
    sweeps = sweeps._replace(
        done=sweeps.done + 1, tried=sweeps.tried + tried, accepted=sweeps.accepted + accepted
    )
    if not accepted:
        run_state.sweeps = sweeps
        return
    engine, system = run_state.engine, run_state.system
    pair, with_padding = engine.model.pair, np.append(order, order[:1])
    both = {name: getattr(pair, name)[with_padding] for name in ("radii", "rates") if hasattr(pair, name)}
    engine = engine._replace(model=engine.model._replace(pair=pair._replace(**both)))
    system = dataclasses.replace(
        system,
        radii=None if system.radii is None else system.radii[order],
        rates=None if system.rates is None else system.rates[order],
    )
    engine = enlarge_neighbors(engine, run_state.scheme, system)
    engine.state.clock[0].now = run_state.in_epoch()
    # Ctrl-C comes before all of it, or after.
    vars(run_state).update(engine=engine, system=system, sweeps=sweeps, scheduled=False)
    run_state.schedule()


def _exchanged(run_state: Any, sweeps: Sweeps) -> tuple[np.ndarray, int, int]:
    """Return whose size each particle gets, (n,), and how many exchanges were tried and accepted."""
    frame, swaps = run_state.frame(), sweeps.swaps
    room = Geometry(np.asarray(frame.box), np.asarray(frame.periodic), standing(run_state.scene))
    places = room.wrapped(frame.positions)
    pairs = room.near(places, float(frame.diameters.max()) * (1.0 + SLIGHT))
    apart = room.separations(places, pairs) ** 2
    squares = apart[:, 0]
    for axis in range(1, frame.dimension):  # in this order on every processor
        squares = squares + apart[:, axis]
    one, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    by_first = np.argsort(one, kind="stable")
    starts = np.zeros(frame.n + 1, np.int64)
    np.cumsum(np.bincount(one, minlength=frame.n), out=starts[1:])
    widest = np.full(frame.n, np.inf)
    everything, largest = room.everything(), np.full(frame.n, 0.5 * frame.diameters.max())
    for k, who in room.near_obstacles(places, largest):
        gap = everything[k].gap(places[who], np.zeros(len(who)), frame.box, frame.periodic)
        widest[who] = np.minimum(widest[who], gap)
    rng = np.random.default_rng(seeds.stream(swaps.seed, "swaps", sweeps.done))
    order, counts = np.arange(frame.n), np.zeros(2, np.int64)
    near = Near(
        starts,
        other[by_first].astype(np.int64),
        np.concatenate([squares, squares])[by_first],
        np.ascontiguousarray(widest),
    )
    within = np.inf if swaps.within is None else swaps.within
    radii = 0.5 * frame.diameters
    for _ in range(swaps.attempts):
        drawn = rng.integers(frame.n, size=(frame.n, 2))
        _exchange(radii, order, near, drawn, 0.5 * within, counts)
    return order, int(counts[0]), int(counts[1])


class Near(NamedTuple):
    """Who is near each particle, and how near."""

    starts: np.ndarray  # (n + 1,): the neighbors of i are ``others[starts[i] : starts[i + 1]]``
    others: np.ndarray  # (m,)
    squares: np.ndarray  # (m,), of their distances [length^2]
    widest: np.ndarray  # (n,), the largest radius that walls and obstacles leave [length]


@entry
def _exchange(radii, order, near, drawn, within, counts):
    """Exchange the radii, and the order, of those pairs drawn that then overlap nobody."""
    starts, others, squares, widest = near
    for k in range(len(drawn)):
        i, j = drawn[k, 0], drawn[k, 1]
        if radii[i] < radii[j]:
            i, j = j, i
        big = radii[i]
        if big == radii[j] or big - radii[j] > within:
            continue
        counts[0] += 1
        # Particle j grows. The contact of the two stays as it is, and i, which shrinks, overlaps nobody.
        free = big <= widest[j]
        for m in range(starts[j], starts[j + 1]):
            contact = big + radii[others[m]]
            if others[m] != i and squares[m] < contact * contact:
                free = False
                break
        if free:
            radii[i], radii[j] = radii[j], radii[i]
            order[i], order[j] = order[j], order[i]
            counts[1] += 1
