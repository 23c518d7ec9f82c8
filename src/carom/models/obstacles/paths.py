"""Paths: how floors, walls and containers move to and fro along a line, as functions of time.

A path is a value (:class:`Path`) with its compiled twin, which answers ``place`` and ``pace``. A path
of your own is a file like this one: any function of time with a continuous slope and a bounded acceleration.

path : model
    The compiled twin of a path.
t : float
    Time since the start of the run.
unit : TimeUnit
    The engine's unit of time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Protocol, runtime_checkable

import numpy as np

from carom import checks
from carom.declared import number, positive, said
from carom.errors import InputError
from carom.models.declared_values import FIELD, Value
from carom.models.interfaces.memory import parameter
from carom.models.interfaces.obstacle import PathModel
from carom.units import TimeUnit


@runtime_checkable
class Path(Protocol):
    """A path as users write it. Its bounds must hold, so that no contact is missed.

    Displacements stay between ``lowest`` and ``highest``, accelerations within ``acceleration``. ``period``
    is longer than the run if nothing repeats.
    """

    @property
    def lowest(self) -> float:
        """Least displacement [length]."""

    @property
    def highest(self) -> float:
        """Largest displacement [length]."""

    @property
    def acceleration(self) -> float:
        """Bound on the magnitude of the acceleration [length / time^2]."""

    @property
    def period(self) -> float:
        """Time after which it repeats itself."""

    def model(self, unit: TimeUnit) -> Any:
        """Return the model that the engine compiles, with its times in the engine's unit."""


def check_path(path: Any, name: str) -> Any:
    """Return a path; raise InputError if it is none, or has bounds that are not finite."""
    if isinstance(path, type) or not isinstance(path, Path):
        raise InputError(
            "shake must be a path, which has lowest, highest, acceleration, period and model, such as "
            f"Sine(0.2, period=1.5); found {checks.describe(path)}."
        )
    names = ("lowest", "highest", "acceleration", "period")
    bounds = [checks.number(getattr(path, each), f"{each} of {type(path).__name__}") for each in names]
    if bounds[0] > bounds[1] or bounds[3] <= 0.0:
        raise InputError(
            "A path must have lowest <= highest, and a period > 0 (longer than the run, where it does not "
            f"repeat itself); found {bounds}."
        )
    model = path.model(TimeUnit())
    for question in ("place", "pace"):
        checks.answer(question, model, 0.0)
    return path


said(check_path, anyOf=[{"$ref": "#/definitions/path"}])


@dataclass(frozen=True)
class Sine(Value):
    """Displacement ``amplitude sin(2 pi (t / period + phase))``.

    Parameters
    ----------
    amplitude : float
        Largest displacement [length].
    period : float
        Period [time].
    phase : float
        Phase at the start, in periods.

    Raises
    ------
    InputError
        If the amplitude or the period is not positive, or the phase is not a finite number.

    Examples
    --------
    >>> round(Sine(0.5, period=2.0).acceleration, 6)
    4.934802
    """

    type = "sine"
    after = " of a Sine"
    amplitude: Annotated[float, positive]
    period: Annotated[float, positive]
    phase: Annotated[float, FIELD] = 0.0

    def complete(self) -> None:
        """Keep the part of a period that is not whole."""
        self._put("phase", self.phase % 1.0)

    @property
    def lowest(self) -> float:
        """The least displacement [length]."""
        return -self.amplitude

    @property
    def highest(self) -> float:
        """The largest displacement [length]."""
        return self.amplitude

    @property
    def acceleration(self) -> float:
        """Largest acceleration [length / time^2]."""
        return self.amplitude * (2.0 * math.pi / self.period) ** 2

    def model(self, unit: TimeUnit) -> Swing:
        """Return the model that the engine compiles."""
        period = float(unit.to_kernel(self.period, 1))
        return Swing(self.amplitude, 2.0 * math.pi / period, 2.0 * math.pi * self.phase)


class Swing(PathModel):
    """``amplitude sin(frequency t + phase)``."""

    amplitude: float  # largest displacement [length]
    frequency: Annotated[float, parameter(-1)]  # angular frequency
    phase: float  # phase at time zero, in radians

    def place(self, t):
        return self.amplitude * math.sin(self.frequency * t + self.phase)

    def pace(self, t):
        return self.amplitude * self.frequency * math.cos(self.frequency * t + self.phase)


def _pieces(values: Any, what: str) -> tuple[tuple[float, float], ...]:
    """Return pairs of a duration and an acceleration."""
    if isinstance(values, str) or not isinstance(values, Sequence) or not len(values):
        raise InputError(f"{what} must be pairs of duration and acceleration, found {values!r}.")
    found = []
    for piece in values:
        if isinstance(piece, str) or not isinstance(piece, Sequence) or len(piece) != 2:
            raise InputError(f"{what} must be pairs of duration and acceleration, found {piece!r}.")
        found.append((positive(piece[0], f"duration of {what}"), FIELD(piece[1], f"acceleration of {what}")))
    return tuple(found)


@dataclass(frozen=True)
class Parabolas(Value):
    """Periodic sequence of stretches of constant acceleration.

    Parameters
    ----------
    pieces : sequence of (duration, acceleration)
        Duration [time] and acceleration [length / time^2] of each stretch.
    speed : float
        Speed at the start, where the displacement is zero [length / time].

    Raises
    ------
    InputError
        If a number is out of range, or if displacement or speed do not return to their start after the last
        piece: a jump of the speed would be an infinite acceleration.

    Examples
    --------
    >>> Parabolas([(1.0, -2.0), (1.0, 2.0)], speed=1.0).highest
    0.25
    """

    type = "parabolas"
    after = " of Parabolas"
    pieces: Annotated[tuple[tuple[float, float], ...], _pieces]
    speed: Annotated[float, number(low=-checks.FASTEST, high=checks.FASTEST)]

    def complete(self) -> None:
        """Raise InputError where the path does not come back to its start."""
        _, places, speeds = self._knots()
        fastest = max(map(abs, speeds))
        off = max(
            abs(places[-1]) / (fastest * self.period or 1.0), abs(speeds[-1] - self.speed) / (fastest or 1.0)
        )
        if off > 2.0**-40:
            raise InputError(
                f"After its period the path is at {places[-1]:g} with speed {speeds[-1]:g}; expected 0 and "
                f"{self.speed:g}, where it started."
            )

    def _knots(self) -> tuple[list[float], list[float], list[float]]:
        """Return times, places and speeds where pieces begin, and at the end."""
        times, places, speeds = [0.0], [0.0], [self.speed]
        for duration, bend in self.pieces:
            times.append(times[-1] + duration)
            places.append(places[-1] + (speeds[-1] + 0.5 * bend * duration) * duration)
            speeds.append(speeds[-1] + bend * duration)
        return times, places, speeds

    @property
    def _extremes(self) -> list[float]:
        _, places, speeds = self._knots()
        turns = [
            x - 0.5 * v * v / bend
            for x, v, (duration, bend) in zip(places, speeds, self.pieces, strict=False)
            if bend and 0.0 < -v / bend < duration
        ]
        return [*places, *turns]

    @property
    def lowest(self) -> float:
        """The least displacement [length]."""
        return min(self._extremes)

    @property
    def highest(self) -> float:
        """The largest displacement [length]."""
        return max(self._extremes)

    @property
    def acceleration(self) -> float:
        """Largest acceleration [length / time^2]."""
        return max(abs(bend) for _, bend in self.pieces)

    @property
    def period(self) -> float:
        """Time after which it repeats itself."""
        return math.fsum(duration for duration, _ in self.pieces)

    def model(self, unit: TimeUnit) -> Arcs:
        """Return the model that the engine compiles."""
        times, places, speeds = self._knots()
        bends = [bend for _, bend in self.pieces]
        return Arcs(
            np.asarray(unit.to_kernel(np.array(times), 1)),
            np.array(places),
            np.asarray(unit.to_kernel(np.array(speeds), -1)),
            np.asarray(unit.to_kernel(np.array(bends), -2)),
        )


class Arcs(PathModel):
    """Pieces of parabolas."""

    times: Annotated[np.ndarray, parameter(1)]
    """Time at which each piece begins, and the end, (k + 1,) float64."""
    places: np.ndarray  # displacement at the beginning of each piece, (k,) float64 [length]
    speeds: Annotated[np.ndarray, parameter(-1)]  # speed at the beginning of each piece, (k,) float64
    bends: Annotated[np.ndarray, parameter(-2)]  # acceleration of each piece, (k,) float64

    def place(self, t):
        t = t % self.times[-1]
        k = 0
        while k + 1 < len(self.bends) and t >= self.times[k + 1]:
            k += 1
        t -= self.times[k]
        return self.places[k] + (self.speeds[k] + 0.5 * self.bends[k] * t) * t

    def pace(self, t):
        t = t % self.times[-1]
        k = 0
        while k + 1 < len(self.bends) and t >= self.times[k + 1]:
            k += 1
        return self.speeds[k] + self.bends[k] * (t - self.times[k])
