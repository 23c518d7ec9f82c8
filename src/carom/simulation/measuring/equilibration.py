"""How a run comes to equilibrium, and to a temperature where kinetic and potential energy are exchanged."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.errors import InputError, warn
from carom.models.active import Active
from carom.notebook import watchable
from carom.observables.analysis.drift import STUCK
from carom.observables.analysis.equilibrium import RENEWED, RENEWED_OTHERWISE, caged, slow_structure
from carom.scene.fields import is_usual, standing
from carom.simulation.measuring import stretches
from carom.suggestions import corrected
from carom.theory import FREEZING, NEAR_FREEZING

if TYPE_CHECKING:
    from carom.frame import Frame
    from carom.simulation.run_state import RunState
    from carom.simulation.simulation import Simulation

ENDS = (*(k / 32 for k in range(1, 13)), 3 / 4)
"""Parts of the length after which velocities are scaled. The first rounds are short, as kT changes much; the
last is long, because the error of its mean is what the temperature misses.
"""

SAMPLES = 512  # samples of kT in all, in a field, where its integral over time is not known

MOST_LENGTHS = 16.0
"""An equilibration goes on until the particles have left their neighborhoods, up to so many lengths."""

LEAST_MORE = 0.25  # part of the length so far that it goes on for, at least, before it looks again

Look = Callable[[float], object]  # called from time to time with a fraction that is done


class Equilibration:
    """An equilibration at a mean temperature ``kT``, in rounds; the last part is undisturbed.

    As kT fluctuates at constant energy, a round scales by the wanted over its mean temperature (in a field,
    of samples at equal times); one is enough where kT is constant. Where energy goes to the potential it
    corrects a part of the difference, and the rest averages over rounds. ``begun`` holds collisions, time and
    integral of kT at the beginning of each round, for a run that goes on.
    """

    def __init__(self, sim: Simulation, kT: float, collisions: int, begun: Sequence[Any] = ()):
        self._sim, self._kT = sim, kT
        self.begun: list[tuple[Any, ...]] = [tuple(each) for each in begun] or [self._now()]
        start = int(self.begun[0][0])
        self._ends = [start + round(part * collisions) for part in (*ENDS, 1.0)]
        self._samples: list[float] = []
        self._every: float | None = None
        if not sim._state.system.straight and collisions:
            self._every = stretches.time_for(sim, collisions) / SAMPLES

    def run(self, look: Look) -> None:
        """Run to the end; after an interruption, go on to it."""
        if self._every is None and self.begun[0][2] is None:
            self._sim.rescale(self._kT)
            self._advance(self._ends[-1], look)
            return
        for end in self._ends[len(self.begun) - 1 : -1]:
            self._advance(end, look)
            self._scale()
            self.begun.append(self._now())
        self._advance(self._ends[-1], look)

    def _advance(self, end: int, look: Look) -> None:
        self._samples.clear()
        if self._sim.collisions < end:
            note = None if self._every is None else lambda sim: self._samples.append(sim.kT)
            more = end - self._sim.collisions
            self._sim.run(collisions=more, every=self._every, call=note, progress=look)

    def _scale(self) -> None:
        """Scale the velocities by the mean kT of the round that ends now."""
        _, time, heat = self.begun[-1]
        _, present, more = self._now()
        if self._samples:
            mean = math.fsum(self._samples) / len(self._samples)
            self._sim.rescale(self._sim.kT * self._kT / mean)
        elif heat is not None and present > time:  # no time may pass where the length is zero
            self._sim.rescale(self._sim.kT * self._kT * (present - time) / (more - heat))

    def _now(self) -> tuple[Any, ...]:
        tally = stretches.tally(self._sim)
        return int(tally.collisions), tally.duration, tally.kT_time


@watchable("Equilibrating")
@corrected()
def equilibrate(
    sim: Simulation,
    *,
    collisions_per_particle: float = 200.0,
    kT: float | None = None,
    progress: Look | None = None,
) -> None:
    """Continue the run to equilibrium, and bring its mean temperature to ``kT``, if that is given.

    The run goes on until the particles have left their neighborhoods: in a fluid near freezing, and in a
    fluid of hard particles that began on a lattice. It then lasts up to 16 times as long. In a shear they
    leave them across the stream.

    Pairs that fall into wells heat, and so do particles that fall in a field. Velocities are therefore scaled
    several times, each time by the mean kT since the last. The last quarter is undisturbed. Where kT is
    constant, they are scaled once, at the beginning. A barostat that says no step finds it, and holds it.

    Parameters
    ----------
    collisions_per_particle : float
        Length of the equilibration. The mean kT afterwards misses ``kT`` by about the standard error of a
        mean over three eighths of this length, if the structure is in equilibrium by then.
    kT : float, optional
        The temperature [energy]; by default it stays as it is. With a drive, it is the temperature of the
        drive.
    progress : callable or True, optional
        Called with the fraction done; does not affect the trajectory. True shows a bar.

    Raises
    ------
    InputError
        If diameters grow. With ``kT``, if contacts, rules or surfaces change the energy, or a drive has
        another temperature; if nothing moves, or there is an event log, which holds collisions only.

    Warns
    -----
    CaromWarning
        If the particles have not left their neighborhoods at the end.

    Examples
    --------
    >>> import carom
    >>> from carom.models import SquareWell
    >>> scene = carom.Scene.crystal(108, density=0.3, interaction=SquareWell(1.5, 1.0))
    >>> sim = carom.Simulation(scene, seed=1)
    >>> sim.equilibrate(collisions_per_particle=100, kT=2.0)
    >>> round(sim.collisions / sim.n)
    50
    """
    length = checks.number(collisions_per_particle, "collisions_per_particle", low=0.0)
    collisions = checks.collisions_of(length, sim.n)
    if sim._state.system.rates is not None:
        raise InputError("equilibrate() needs diameters that last: leave out growth, or run() instead.")
    if kT is not None:
        kT = checks.number(kT, "kT", low=0.0, open_low=True, high=checks.HOTTEST)
        _refuse_kT(sim, kT)
    start, relaxation = sim.collisions, StructuralRelaxation(sim._state)

    def look(_: float) -> None:
        if progress is not None:
            progress(min((sim.collisions - start) / collisions, 1.0) if collisions else 1.0)

    if kT is not None and sim.scene.drive is None:
        Equilibration(sim, kT, collisions).run(look)
    else:
        if kT is not None:
            sim.rescale(kT)
        sim.run(collisions=collisions, progress=look)
    _leave_neighborhoods(sim, start, collisions, relaxation)


def _leave_neighborhoods(
    sim: Simulation, start: int, collisions: int, relaxation: StructuralRelaxation
) -> None:
    """Run on until the particles have left their neighborhoods; the run began at a number of collisions."""
    while True:
        moved, needed = relaxation.distances()
        done = sim.collisions - start
        if moved >= needed or not done:
            return
        left = MOST_LENGTHS * collisions - done
        if left < 1.0:
            warn(
                f"The particles moved by {moved:.2g} mean spacings in {2.0 * done / sim.n:.3g} collisions "
                f"per particle, and {needed:g} are needed to leave their neighborhoods: they are not in "
                "equilibrium. Equilibrate longer, or begin at a lower density."
            )
            return
        # The mean square distance grows with time.
        more = min(max((needed / moved) ** 2 - 1.0, LEAST_MORE), 1.0) if moved > 0.0 else 1.0
        before = sim.collisions
        sim.run(collisions=max(math.ceil(min(more * done, left)), 1))
        if sim.collisions == before:  # it has warned of that
            return


def _refuse_kT(sim: Simulation, kT: float) -> None:
    """Raise InputError where scaling velocities does not bring the mean temperature to kT."""
    if reason := drifts(sim):
        raise InputError(reason)
    drive = sim.scene.drive
    if drive is not None:
        held = None if isinstance(drive, Active) else getattr(drive, "kT", None)
        values = set(held if isinstance(held, tuple) else (held,))
        if values != {kT}:
            name = type(drive).__name__
            has = f"{name} brings the particles to kT = {held}" if held is not None else f"{name} sets it"
            raise InputError(f"kT is {kT:g}, and {has}: leave out kT.")
    if sim._state.log is not None:
        raise InputError(
            "equilibrate(kT=...) scales velocities, which no event log holds: close() the log first."
        )


def exchanges(sim: Simulation) -> bool:
    """Tell whether pairs exchange kinetic for potential energy, at a temperature that lasts."""
    system = sim._state.system
    return system.stepped and system.straight and system.scene.drive is None and drifts(sim) is None


def drifts(sim: Simulation) -> str | None:
    """Return a sentence on why no temperature of a run lasts; None if one does."""
    system, scene = sim._state.system, sim.scene
    if system.rates is not None:
        return "equilibrate(kT=...) needs a temperature that lasts, and growing diameters heat."
    conserves = getattr(scene.interaction, "conserves", None)
    hysteretic = conserves is not None and not conserves(scene.diameter)
    if not system.conserves_energy or hysteretic or sim._state.engine.model.rules is not None:
        return (
            "equilibrate(kT=...) needs a temperature that lasts, and here contacts or rules change the "
            "energy: leave out kT."
        )
    if any(hasattr(each, "live") for each in standing(scene)):
        return "equilibrate(kT=...) needs a temperature that lasts, and surfaces change it: leave out kT."
    return None


class StructuralRelaxation:
    """Compares the positions at the end of a stretch with those at its beginning.

    Not watched are growing diameters, and runs without counts of images, where particles cannot be followed.
    """

    def __init__(self, run_state: RunState, start: np.ndarray | None = None):
        self._run_state = run_state
        followed = run_state.engine.state.images is not None and run_state.system.rates is None
        self.start = start if start is not None or not followed else run_state.frame().unwrapped
        """Unwrapped positions at the beginning, (n, d) [length]; None where they are not watched."""
        self._box = np.array(run_state.scene.box)

    def doubts(self) -> list[str]:
        """Return a sentence if the arrangement has not relaxed since the beginning (``slow_structure``)."""
        if self.start is None:
            return []
        return slow_structure(self._run_state.scene, self._square())

    def distances(self) -> tuple[float, float]:
        """Return how far particles moved, and must move to leave their neighborhoods [mean spacing], or 0.

        Near freezing that is as in ``observables.analysis.equilibrium``; below it hard
        particles alone in a periodic box must have left their places. Nothing is asked of crystals, glasses,
        rods on a line, and below freezing of what walls, pinned particles or wells may keep.
        """
        scene = self._run_state.scene
        freezing = FREEZING.get(scene.dimension)
        if self.start is None or freezing is None:
            return 0.0, 0.0
        moved = math.sqrt(self._square()) / (scene.volume / scene.n) ** (1.0 / scene.dimension)
        if scene.packing_fraction >= NEAR_FREEZING * freezing:
            held = scene.packing_fraction >= freezing and caged(scene, moved)
            return moved, 0.0 if held else RENEWED.get(scene.dimension, RENEWED_OTHERWISE)
        hard = all(is_usual(scene, kind) for kind in ("interaction", "motion", "impact"))
        alone = hard and all(scene.periodic) and not scene.obstacles and scene.pinned is None
        return moved, STUCK if alone else 0.0

    def _square(self) -> float:
        assert self.start is not None
        scale = np.array(self._run_state.scene.box) / self._box  # a barostat moves all places with the box
        return mean_square_displacement(self.start * scale, self._run_state.frame())


def mean_square_displacement(start: np.ndarray, frame: Frame) -> float:
    """Return the mean square distance of a frame from ``start`` (n, d), without the common part [length^2].

    In a shear it is ``d / (d - 1)`` times that across the stream, which carries particles apart.
    """
    distance = frame.unwrapped - start
    if frame.tilt is not None:
        distance = distance[:, 1:]
    distance -= distance.mean(axis=0)
    part = distance.shape[1] / frame.dimension
    return float(np.mean(np.sum(distance * distance, axis=1))) / part
