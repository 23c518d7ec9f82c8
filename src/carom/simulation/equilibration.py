"""How pairs on steps come to a temperature: they exchange kinetic for potential energy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from carom import checks
from carom.errors import InputError
from carom.notebook import watchable

ENDS = (*(k / 32 for k in range(1, 13)), 3 / 4)
"""Parts of the length after which velocities are scaled. The first rounds are short, as kT changes much; the
last is long, because the error of its mean is what the temperature misses.
"""

Look = Callable[[float], object]
"""Called from time to time with a fraction that is done."""


class Equilibration:
    """An equilibration at a given mean temperature, in rounds; the last part is undisturbed.

    Each round scales the velocities by the ratio of the temperature that is wanted to the mean of the round,
    since kT fluctuates at constant energy. Where a part of the energy goes to the potential one, a round
    corrects only a part of the difference. What remains is then an average over several rounds.

    Parameters
    ----------
    sim : Simulation
        A run in which contacts conserve the energy.
    kT : float
        The temperature [energy].
    collisions : int
        Pair collisions of the whole.
    begun : sequence of (int, float, float or None), optional
        What :attr:`begun` was when the run was stopped.

    Attributes
    ----------
    begun : list of (int, float, float or None)
        Collisions, time and integral of kT at the beginning of each round so far.
    """

    def __init__(self, sim: Any, kT: float, collisions: int, begun: Sequence[Any] = ()):
        self._sim, self._kT = sim, kT
        self.begun: list[tuple[Any, ...]] = [tuple(each) for each in begun] or [self._now()]
        start = int(self.begun[0][0])
        self._ends = [start + round(part * collisions) for part in (*ENDS, 1.0)]

    def run(self, look: Look) -> None:
        """Run to the end; after an interruption, go on to it."""
        for end in self._ends[len(self.begun) - 1 : -1]:
            self._advance(end, look)
            self._scale()
            self.begun.append(self._now())
        self._advance(self._ends[-1], look)

    def _advance(self, end: int, look: Look) -> None:
        if self._sim.collisions < end:
            self._sim.run(collisions=end - self._sim.collisions, progress=look)

    def _scale(self) -> None:
        """Scale the velocities by the mean kT of the round that ends now."""
        _, time, heat = self.begun[-1]
        _, present, more = self._now()
        if heat is None:  # no contact changes kT
            self._sim.rescale(self._kT)
        elif present > time:  # no time may pass where the length is zero
            self._sim.rescale(self._sim.kT * self._kT * (present - time) / (more - heat))

    def _now(self) -> tuple[Any, ...]:
        tally = self._sim.tally
        return int(tally.collisions), tally.duration, tally.kT_time


@watchable("Equilibrating")
def equilibrate(
    sim: Any, kT: float = 1.0, *, collisions_per_particle: float, progress: Look | None = None
) -> None:
    """Continue the run for some time, and bring its mean temperature to ``kT``.

    Pairs that fall into wells heat, and kT fluctuates at constant energy. Velocities are therefore scaled
    several times, each time by the mean kT since the last. The last quarter is undisturbed.

    Parameters
    ----------
    kT : float
        The temperature [energy].
    collisions_per_particle : float
        Length of the equilibration. The mean kT afterwards misses ``kT`` by about the standard error of a
        mean over three eighths of this length, if the structure is in equilibrium by then.
    progress : callable or True, optional
        Called with the fraction done; does not affect the trajectory. True shows a bar.

    Raises
    ------
    InputError
        If contacts, growth or rules change the energy, or a field does; if nothing moves, or there is an
        event log, which holds collisions only.

    Examples
    --------
    >>> import carom
    >>> from carom.models import SquareWell
    >>> scene = carom.Scene.crystal(108, density=0.3, interaction=SquareWell(1.5, 1.0))
    >>> sim = carom.Simulation(scene, seed=1)
    >>> sim.equilibrate(2.0, collisions_per_particle=100)
    >>> round(sim.tally.collisions / sim.scene.n)
    50
    """
    kT = checks.number(kT, "kT", low=0.0, open_low=True, high=checks.HOTTEST)
    collisions = checks.collisions_of(collisions_per_particle, sim.scene.n)
    if reason := drifts(sim):
        raise InputError(reason)
    if sim.machine.log is not None:
        raise InputError("equilibrate() scales velocities, which no event log holds: close() the log first.")
    start = sim.collisions

    def look(_: float) -> None:
        if progress is not None:
            progress(min((sim.collisions - start) / collisions, 1.0) if collisions else 1.0)

    Equilibration(sim, kT, collisions).run(look)


def drifts(sim: Any) -> str | None:
    """Return a sentence on why scaling velocities does not set the mean kT of a run; None if it does."""
    system, scene = sim.machine.system, sim.scene
    if system.rates is not None:
        return "equilibrate() needs a temperature that lasts, and growing diameters heat: leave out growth."
    conserves = getattr(scene.interaction, "conserves", None)
    hysteretic = conserves is not None and not conserves(scene.diameter)
    if not system.conserves_energy or hysteretic or sim.machine.engine.model.rules is not None:
        return "equilibrate() needs a temperature that lasts, and here contacts or rules change the energy."
    if system.drive is not None:
        return f"{type(system.drive).__name__} sets the temperature: run() instead of equilibrate()."
    if not system.straight:
        return (
            f"equilibrate() needs the mean of kT, which is not known in {type(scene.motion).__name__}: run() "
            "and rescale() in turn."
        )
    if any(hasattr(each, "live") for each in scene.obstacles):
        return "equilibrate() needs a temperature that lasts, and surfaces change the energy: run() instead."
    return None
