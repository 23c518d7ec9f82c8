"""What happens on the way of a run: functions called at exact times, and what ends it besides its limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks, suggestions
from carom.errors import InputError

if TYPE_CHECKING:
    from carom.engine.build import Engine
    from carom.simulation.run_state import RunState
    from carom.simulation.simulation import Simulation

Call = Callable[[Any], object]  # a function that is called with the simulation


@dataclass(frozen=True)
class Hit:
    """Contacts with walls or obstacles that end a run; made by :func:`hit`."""

    obstacles: tuple[Any, ...]
    count: int


def hit(*obstacles: Any, count: int = 1) -> Hit:
    """Return what ends a run at a contact with an obstacle, for ``until=`` of :meth:`carom.Simulation.run`.

    Parameters
    ----------
    *obstacles : str or obstacle
        Names of walls and obstacles (those of :attr:`carom.Simulation.obstacles`), or obstacles of the scene.
        Contacts with each of them count.
    count : int
        Number of contacts, from the beginning of the run on.

    Raises
    ------
    InputError
        If no obstacle is given, or ``count`` is below 1.

    Examples
    --------
    >>> import carom
    >>> door = carom.models.Ball((5.0, 5.0), 1.0, "door")
    >>> scene = carom.Scene.random(16, box=(10.0, 10.0), obstacles=[door], seed=1)
    >>> sim = carom.Simulation(scene)
    >>> block = sim.run(until=carom.hit("door", count=3))
    >>> sim.obstacles[0].hits
    3
    """
    if not obstacles:
        raise InputError('hit() needs the name of an obstacle, such as hit("door").')
    return Hit(obstacles, checks.integer(count, "count of hit()", low=1))


class Callbacks:
    """What a run calls, and what ends it: contacts, to the event, or a condition, wherever it is looked at.

    The first call is ``every`` after the present; ``next``, a Fraction or None, is the instant of the next
    one.
    """

    def __init__(self, sim: Simulation, every: Any, call: Any, until: Any):
        self._sim = sim
        self._calls: tuple[Call, ...] = _several(call)
        self._condition = until if callable(until) else None
        self._step: Fraction | None = None
        self.next: Fraction | None = None
        self._stop = _stop_at(sim._state, until) if isinstance(until, Hit) else None
        if until is not None and self._condition is None and self._stop is None:
            raise InputError(
                "until must be carom.hit(...) or a function of the simulation, found "
                f"{checks.describe(until)}. A number of collisions is collisions=."
            )
        if every is None:
            if self._calls:
                raise InputError("call= needs every=, the time between two calls.")
        elif not self._calls and self._condition is None:
            raise InputError("every= needs call=, what is called so often.")
        else:
            self._step = Fraction(checks.number(every, "every", low=0.0, open_low=True))
            self.next = sim._state.clock.instant + self._step

    @property
    def needs_events(self) -> bool:
        """Whether it matters which events happen together, so that the run needs one worker."""
        return self._stop is not None or (self._condition is not None and self._step is None)

    def holds(self) -> bool:
        """Return whether the condition holds at the present."""
        return self._condition is not None and bool(self._condition(self._sim))

    def watched(self, engine: Engine) -> Engine:
        """Return the engine with a counter of the contacts that end the run, if some do."""
        from carom.engine.observers.interface import Observers

        if self._stop is None:
            return engine
        observers = Observers(self._stop, engine.model.observers)
        return engine._replace(model=engine.model._replace(observers=observers))

    def pause(self) -> bool:
        """Call everything, at the instant of the next call; return whether the run ends here."""
        assert self.next is not None
        assert self._step is not None
        self.next += self._step  # first, so that nothing is called twice
        for call in self._calls:
            call(self._sim)
        return self.holds()

    def ends_between_events(self) -> bool:
        """Return whether the run ends after some events, where no times are given."""
        return self._step is None and self.holds()


def _several(call: Any) -> tuple[Call, ...]:
    """Return what is to be called, checked."""
    several = () if call is None else tuple(call) if isinstance(call, Sequence) else (call,)
    for each in several:
        if not callable(each):
            raise InputError(f"call must be a function, or several, found {checks.describe(each)}.")
    return several


def _stop_at(state: RunState, asked: Hit) -> Any:
    """Return the engine's counter of contacts."""
    from carom.engine.observers.stop_at_hit import StopAtHit
    from carom.observables.wall_pressure import obstacle_names

    names, numbers, obstacles = obstacle_names(state.scene), state.obstacle_numbers(), state.scene.obstacles
    wanted = np.zeros(max(numbers, default=0) + 1, np.bool_)
    for each in asked.obstacles:
        if isinstance(each, str):
            found = [k for name, k in zip(names, numbers, strict=True) if name == each]
        else:
            places = [
                len(numbers) - len(obstacles) + k
                for k, one in enumerate(obstacles)
                if one is each or one == each
            ]
            found = [numbers[k] for k in places]
        if not found:
            what = f"named {each!r}" if isinstance(each, str) else f"such as this {type(each).__name__}"
            hint = suggestions.suggestion(str(each), names) if names else ""
            raise InputError(f"The scene has no obstacle {what}{hint}.")
        wanted[found] = True
    return StopAtHit(wanted, np.array([asked.count]))
