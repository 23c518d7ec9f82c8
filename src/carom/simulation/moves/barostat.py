"""A barostat: the volume of the box changes at times between events, so that the pressure is constant.

A move scales box and positions, at the same velocities. At given places in units of the edges V has the
density V^N exp(-P V / kT), from the volume on at which the nearest two touch. By default V is drawn from it.
With a step, V' is drawn uniformly in ln V, and without overlap it is accepted with the probability
min(1, exp(-P (V' - V) / kT + (N + 1) ln(V' / V))) (Eppenga, Frenkel, Mol. Phys. 52 (1984) 1303). With flight
either samples the isothermal-isobaric ensemble exactly. After a change all is scheduled anew. Draws depend on
the move's number alone. Sums between two changes are divided by the volume of that time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from carom import checks, seeds
from carom.arithmetic import exponential, root
from carom.block import VolumeSums
from carom.declared import SEED, Declared, described, needed, number, option, positive
from carom.errors import InputError, OverlapError
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import closest
from carom.scene.box import LONGEST_EDGE
from carom.scene.fields import geometry_at_start, standing
from carom.scene.velocities import temperature
from carom.simulation.moves.swaps import beside_free_hard_cores
from carom.suggestions import corrected

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene

LEAST = -700.0  # logarithm of a probability that no random number is below, and whose exponential is no zero


@described
@corrected()
@dataclass(frozen=True)
class Barostat(Declared):
    """Constant pressure: moves of the volume at equal intervals of time, for hard particles.

    The box keeps its shape, and velocities do not change. Pressure and the kT of the run together give the
    distribution of the volume.

    Raises
    ------
    InputError
        If a parameter is out of range.

    Examples
    --------
    >>> import carom
    >>> scene = carom.Scene.random(32, packing_fraction=0.2)
    >>> sim = carom.Simulation(scene, barostat=carom.Barostat(pressure=1.0, interval=0.5, step=0.1))
    >>> block = sim.run(time=10.0)
    >>> 0 < sim.statistics.volume_moves_accepted < sim.statistics.volume_moves_tried == 20
    True
    """

    after: ClassVar[str] = " of Barostat"

    pressure: float = needed(positive, "The pressure P [energy / length^d].")
    interval: float = needed(
        positive,
        "Time between two moves [time]. All is scheduled anew after one, which costs as much as some 450 "
        "collisions of each of 32 particles, 120 of 256, 50 of 1000: let some mean free times lie between.",
    )
    step: float | None = option(
        number(low=0.0, open_low=True, high=1.0),
        "Largest change of ln V in a move that may be refused, at most 1. By default each move draws the "
        "volume from its distribution at the present places: none is refused.",
    )
    seed: int = option(SEED, "Seed of the moves.", default=1)


class VolumeMoves(NamedTuple):
    """The moves of the volume of a run, how far they are, and what added up until the last accepted one."""

    barostat: Barostat
    tried: int = 0
    accepted: int = 0
    last: int = 0  # number of the last that was accepted
    virial: float = 0.0  # sum of ``r_ij . dp_ij`` over collisions [mass length^2 / time]
    volume_time: float = 0.0  # this and the next two: :class:`carom.block.VolumeSums`
    inverse_time: float = 0.0
    virial_density: float = 0.0

    @property
    def next(self) -> Fraction:
        """When the next move is due [time]."""
        return (self.tried + 1) * Fraction(self.barostat.interval)

    def sums(self, instant: Fraction, volume: float, virial: float) -> VolumeSums:
        """Return what added up until an instant, with the volume and the virial of then."""
        duration = float(instant - self.last * Fraction(self.barostat.interval))
        return VolumeSums(
            self.volume_time + volume * duration,
            self.inverse_time + duration / volume,
            self.virial_density + (virial - self.virial) / volume,
        )


def volume_sums(run_state: Any) -> VolumeSums | None:
    """Return what added up since the start; None without a barostat."""
    moves: VolumeMoves | None = run_state.volume_moves
    if moves is None:
        return None
    return moves.sums(run_state.clock.instant, run_state.scene.volume, _virial(run_state))


def _virial(run_state: Any) -> float:
    """Return the sum of ``r_ij . dp_ij`` since the start [mass length^2 / time]."""
    return float(run_state.unit.to_scene(float(run_state.engine.tallies[0].virial), -1))


def checked_barostat(
    barostat: Any, scene: Scene, system: System, velocities: np.ndarray | None, **others: Any
) -> VolumeMoves | None:
    """Return the moves before the first, or None; ``others`` are further arguments that must not be given.

    ``velocities`` are those at the start, if they are known.
    """
    if barostat is None:
        return None
    if not isinstance(barostat, Barostat):
        raise InputError(f"barostat must be carom.Barostat(...), found {checks.describe(barostat)}.")
    for wrong, found in (
        ("walls", not all(scene.periodic)),
        ("obstacles", bool(standing(scene))),
        *beside_free_hard_cores(scene, system),
        ("a drive", scene.drive is not None),
        ("a single particle", scene.n == 1),
        ("growth", system.rates is not None),
        *((name, bool(given)) for name, given in others.items()),
    ):
        if found:
            raise InputError(f"A barostat is not defined with {wrong}: leave one of the two out.")
    if velocities is not None and not temperature(scene, velocities) > 0.0:
        raise InputError("A barostat needs a temperature, and the particles do not move: give kT.")
    return VolumeMoves(barostat)


def move_volume(run_state: Any) -> None:
    """Try the move that is due at the present time; all is scheduled anew if it is accepted."""
    scene, moves, unit = run_state.scene, run_state.volume_moves, run_state.unit
    kT = unit.to_scene(temperature(scene, run_state.speeds), -2)
    number, barostat = moves.tried + 1, moves.barostat
    rng = np.random.default_rng(seeds.stream(barostat.seed, "volume", moves.tried))
    if barostat.step is None:
        places = run_state.frame().positions
        scale: float | None = _drawn(rng, scene, barostat, kT, places)
    elif scale := _tried(rng, scene, barostat, kT):
        places = run_state.frame().positions  # not of a move that is refused for its work
    moved = _scaled(scene, places, scale) if scale else None
    if moved is None:
        run_state.volume_moves = moves._replace(tried=number)
        return
    virial = _virial(run_state)
    volume, inverse, density = moves.sums(moves.next, scene.volume, virial)
    after = moves._replace(tried=number, accepted=moves.accepted + 1, last=number)
    after = after._replace(virial=virial, volume_time=volume, inverse_time=inverse, virial_density=density)
    run_state.refit(move=(moves.next, {"scene": moved, "volume_moves": after}))


def _tried(rng: np.random.Generator, scene: Scene, barostat: Barostat, kT: float) -> float | None:
    """Return by how much a move of at most a step scales lengths, None if it is refused for its work."""
    change, threshold = float(barostat.step or 0.0) * (2.0 * rng.random() - 1.0), rng.random()
    scale = _exponential(change / scene.dimension)
    volume = math.prod(edge * scale for edge in scene.box)
    logarithm = (scene.n + 1) * change - barostat.pressure * (volume - scene.volume) / kT
    return scale if threshold < _exponential(max(min(logarithm, 0.0), LEAST)) else None


def _drawn(
    rng: np.random.Generator, scene: Scene, barostat: Barostat, kT: float, places: np.ndarray
) -> float:
    """Return by how much lengths are scaled to the volume that is drawn.

    The density of ln V is exp(g), with g = (N + 1) ln V - P V / kT. It is largest at the top, where V is
    (N + 1) kT / P, or at contact. From there on g is concave in u = ln V - ln V_top: below its largest value,
    and below its tangents at ``width`` on either side. A draw from what these bound is kept with the
    probability that is left.
    """
    d, shape = scene.dimension, scene.n + 1
    contacts = Contacts(scene.diameters, scene.species, scene.contact)
    contact = 1.0 / closest(places, geometry_at_start(scene), contacts)
    contact = max(contact, scene.diameter / min(scene.box))
    free = root(shape * kT / (barostat.pressure * scene.volume), d)
    top = max(contact, free)
    work = barostat.pressure * scene.volume * top**d / kT

    def g(u: float) -> float:
        return shape * u - work * (_exponential(u) - 1.0)

    width = 1.0 / (work - shape + math.sqrt(shape))
    fall = work * _exponential(width) - shape
    right = width + g(width) / fall
    left, rise = 0.0, math.inf
    if contact < top:
        left = -width
        if contact < top * _exponential(-width / d):
            rise = shape - work * _exponential(-width)
            left -= g(-width) / rise
    while True:
        pick = rng.random() * (1.0 / rise + right - left + 1.0 / fall)
        beyond = rng.standard_exponential()
        if pick < 1.0 / rise:
            u, bound = left - beyond / rise, -beyond
        elif pick < 1.0 / rise + right - left:
            u, bound = left + pick - 1.0 / rise, 0.0
        else:
            u, bound = right + beyond / fall, -beyond
        scale = top * _exponential(u / d)
        if scale >= contact and rng.random() < _exponential(max(g(u) - bound, LEAST)):
            return scale


def _exponential(x: float) -> float:
    return float(exponential(np.array(x)))


def _scaled(scene: Scene, places: np.ndarray, scale: float) -> Scene | None:
    """Return a scene with all lengths but the diameters scaled; None if they do not fit."""
    box = tuple(edge * scale for edge in scene.box)
    if not scene.diameter < min(box) or max(box) > LONGEST_EDGE * scene.diameters.min():
        return None
    # A product must not be rounded up to the edge, which is the place 0 of the next image.
    positions = np.minimum(places * scale, np.nextafter(box, 0.0))
    try:
        return scene.replace(positions=positions, box=box)
    except OverlapError:
        return None
