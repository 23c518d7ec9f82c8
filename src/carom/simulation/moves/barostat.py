"""A barostat: the volume of the box changes at times between events, so that the pressure is constant.

A move draws V' uniformly in ln V and scales box and positions, at the same velocities. Without overlap it is
accepted with the probability min(1, exp(-P (V' - V) / kT + (N + 1) ln(V' / V))), which with flight samples
the isothermal-isobaric ensemble exactly (Eppenga, Frenkel, Mol. Phys. 52 (1984) 1303). After it all is
scheduled anew. Draws depend on the move's number alone. Sums between two changes are divided by the volume of
that time.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from carom import checks, seeds
from carom.arithmetic import exponential
from carom.block import VolumeSums
from carom.declared import SEED, Declared, described, needed, number, option, positive
from carom.errors import InputError, OverlapError
from carom.meant import corrected
from carom.scene.box import LONGEST_EDGE
from carom.scene.fields import standing
from carom.scene.velocities import temperature
from carom.simulation.moves.swaps import beside_free_hard_cores

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
        "Time between two moves [time]. An accepted one costs as much as tens of collisions a particle, "
        "because neighbors are chosen anew. Some mean free times are a good choice.",
    )
    step: float | None = option(
        number(low=0.0, open_low=True, high=1.0),
        "Largest change of ln V in a move, at most 1. By default equilibration tunes it until half of the "
        "moves are accepted, and it is held from then on; before, it is 2 kT / P V of the first move.",
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
    step: float = 0.0  # that of the next move; 0 before the first, if the barostat says none
    tunes: int = 0  # whether each move changes the step

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


def checked_barostat(barostat: Any, scene: Scene, system: System, **others: Any) -> VolumeMoves | None:
    """Return the moves before the first, or None; ``others`` are further arguments that must not be given."""
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
    return VolumeMoves(barostat, step=barostat.step or 0.0)


@contextlib.contextmanager
def tuning(run_state: Any) -> Iterator[None]:
    """Tune the step of a barostat that says none, and hold it afterwards."""
    moves: VolumeMoves | None = run_state.volume_moves
    if moves is not None and moves.barostat.step is None:
        run_state.volume_moves = moves._replace(tunes=1)
    try:
        yield
    finally:
        if moves is not None:
            run_state.volume_moves = run_state.volume_moves._replace(tunes=0)


def move_volume(run_state: Any) -> None:
    """Try the move that is due at the present time; all is scheduled anew if it is accepted."""
    scene, moves, unit = run_state.scene, run_state.volume_moves, run_state.unit
    kT = unit.to_scene(temperature(scene, run_state.speeds), -2)
    if not kT > 0.0:
        raise InputError("A barostat needs a temperature, and the particles do not move: give kT.")
    moves = moves._replace(step=moves.step or _first_step(scene, moves.barostat.pressure / kT))
    moved, number = _moved(run_state, moves, kT), moves.tried + 1
    step = _tuned(moves, moved is not None) if moves.tunes else moves.step
    if moved is None:
        run_state.volume_moves = moves._replace(tried=number, step=step)
        return
    virial = _virial(run_state)
    volume, inverse, density = moves.sums(moves.next, scene.volume, virial)
    after = moves._replace(tried=number, accepted=moves.accepted + 1, last=number, step=step)
    after = after._replace(virial=virial, volume_time=volume, inverse_time=inverse, virial_density=density)
    run_state.refit(move=(moves.next, {"scene": moved, "volume_moves": after}))


def _first_step(scene: Scene, pressure_over_kT: float) -> float:
    """Return a step of which about half of the moves are accepted, where the volume is right."""
    return min(2.0 / max(pressure_over_kT * scene.volume, scene.n), 1.0)


def _tuned(moves: VolumeMoves, accepted: bool) -> float:
    """Return the next step: larger after an accepted move, by ever less (Robbins and Monro)."""
    change = (1.0 if accepted else -1.0) / math.sqrt(moves.tried + 1)
    return min(moves.step * float(exponential(np.array(change))), 1.0)


def _moved(run_state: Any, moves: VolumeMoves, kT: float) -> Scene | None:
    """Return the scene after a move from the present state, None if it is refused."""
    scene, barostat = run_state.scene, moves.barostat
    rng = np.random.default_rng(seeds.stream(barostat.seed, "volume", moves.tried))
    change, threshold = moves.step * (2.0 * rng.random() - 1.0), rng.random()
    scale = float(exponential(np.array(change / scene.dimension)))
    box = tuple(edge * scale for edge in scene.box)
    work = barostat.pressure * (math.prod(box) - scene.volume)
    logarithm = (scene.n + 1) * change - work / kT
    chance = exponential(np.array(max(min(logarithm, 0.0), LEAST)))
    fits = scene.diameter < min(box) and max(box) <= LONGEST_EDGE * scene.diameters.min()
    if not fits or threshold >= chance:
        return None
    frame = run_state.frame()
    # A product must not be rounded up to the edge, which is the place 0 of the next image.
    places = np.minimum(frame.positions * scale, np.nextafter(box, 0.0))
    try:
        return scene.replace(positions=places, box=box)
    except OverlapError:
        return None
