"""The methods that are compared, behind one interface: :class:`Motion`."""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np

from carom.baselines.pseudo_hard import PseudoHardSpheres
from carom.baselines.stepping import Stepper
from carom.observables.statistics import unwarned
from carom.reference import NaiveSystem
from carom.reference.arithmetic import ArithmeticName
from carom.scene.scene import Scene
from carom.scene.velocities import temperature
from carom.simulation.measuring import stretches
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning

UNTUNED = 0.3
"""Skin of neighbor lists where the CPU time is not measured [diameters]."""


class Motion(Protocol):
    """A scene in motion, whatever moves it."""

    def run(self, time: float) -> None:
        """Move on by a time (a stepping method: by the nearest number of steps)."""

    def settle(self, time: float) -> None:
        """Move on by at least a time, until averages are those of equilibrium."""
        self.run(time)

    def kT(self) -> float:
        """Return the mean temperature since :meth:`settle` [energy]."""

    def order(self) -> list[tuple[int, int]] | None:
        """Return the pairs that collided so far, the smaller index first; None without collisions."""

    def positions(self) -> np.ndarray:
        """Return the centers (n, d), up to whole boxes."""

    def reversed(self) -> Motion:
        """Return a motion from here with all velocities reversed."""

    def tally(self) -> tuple[float, int, float]:
        """Return time, collisions and virial so far."""

    def faults(self) -> tuple[float, float, float]:
        """Return the worst overlap [diameters], nan if unknown, and drifts of energy and momentum."""

    def bytes_per_particle(self) -> float:
        """Return the memory per particle of the state and its search structures [bytes]."""


@dataclass(frozen=True)
class Method:
    """A way to move hard spheres."""

    name: str  # as the table shows it
    kind: str  # "event-driven", "naive", "time-driven" or "pseudo-hard"
    start: Callable[[Scene, bool], Motion]
    """``start(scene, logged)``, of a scene with velocities. Only if ``logged`` it knows its order of
    collisions; such a motion is neither timed nor tuned, because logging takes time."""
    fast: bool = True  # whether speed, Z and D are measured on the scene itself; else on the small one
    many_digits: bool = False
    """Whether its rounding is far below that of doubles; it is then the reference of the others."""


def engine(name: str = "float64", precision: str = "double") -> Method:
    """Return the engine, which keeps its state in a precision."""
    return Method(name, "event-driven", lambda scene, logged: _Engine(scene, precision, logged))


def oracle(digits: int = 50) -> Method:
    """Return the naive algorithm with that many decimal digits."""
    return Method(
        f"{digits} digits",
        "naive",
        lambda scene, _: _Naive(naive_system(scene, arithmetic="mpmath", digits=digits)),
        fast=False,
        many_digits=True,
    )


def stepping(fraction: float, mean_free_time: float) -> Method:
    """Return time-driven stepping with a step of that fraction of the mean free time [time]."""
    return Method(
        f"step {fraction:g}",
        "time-driven",
        lambda scene, logged: _Stepping(
            _listed(Stepper, scene, logged, step=fraction * mean_free_time), logged
        ),
    )


def pseudo_hard(step: float, mean_free_time: float) -> Method:
    """Return pseudo hard spheres by velocity Verlet, with a step in units of sigma sqrt(m / epsilon).

    They have no collisions; their count is that of hard spheres in the same time, as is expected.
    """

    def start(scene: Scene, logged: bool) -> Motion:
        kT = temperature(scene, np.asarray(scene.velocities))
        system = _listed(PseudoHardSpheres, scene, logged, step=step, kT=kT)
        return _PseudoHard(system, 0.5 * scene.n / mean_free_time)

    return Method(f"Mie 50-49, step {step:g}", "pseudo-hard", start)


@dataclass
class _Engine(Motion):
    """The engine; its order of collisions comes from an event log."""

    scene: Scene
    precision: str
    logged: bool = True
    _folder: Any = field(init=False, default=None)

    def __post_init__(self) -> None:
        settings: dict[str, Any] = {}
        if self.logged:
            self._folder = tempfile.TemporaryDirectory(prefix="carom-trade-")
            settings["event_log"] = Path(self._folder.name) / "events.h5"
        tuning = Tuning(images=False, precision=self.precision)
        self.sim = Simulation(self.scene, seed=0, tuning=tuning, **settings)

    def run(self, time: float) -> None:
        self.sim.run(time=time)

    def kT(self) -> float:
        return self.sim.kT

    def order(self) -> list[tuple[int, int]]:
        from carom.io.events import read_events

        self.sim.close()
        events = read_events(Path(self._folder.name) / "events.h5")
        self._folder.cleanup()
        return [(min(i, j), max(i, j)) for i, j in zip(events.i.tolist(), events.j.tolist(), strict=True)]

    def positions(self) -> np.ndarray:
        return self.sim.frame().positions

    def reversed(self) -> Motion:
        frame = self.sim.frame()
        with unwarned():  # single precision leaves overlaps by rounding
            back = Scene.from_frame(replace(frame, velocities=-frame.velocities))
        return _Engine(back, self.precision, logged=False)

    def tally(self) -> tuple[float, int, float]:
        block = stretches.tally(self.sim)
        return block.duration, block.collisions, block.virial

    def faults(self) -> tuple[float, float, float]:
        found = self.sim.statistics
        return found.worst_overlap, found.energy_drift, found.momentum_drift

    def bytes_per_particle(self) -> float:
        from carom.simulation.explanation import explain

        return explain(self.sim).bytes_per_particle


@dataclass
class _Naive(Motion):
    """The naive algorithm, in any arithmetic."""

    system: NaiveSystem
    pairs: list[tuple[int, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._energy, self._momentum = self.system.energy, self.system.momentum
        self._start = self.system.time

    def run(self, time: float) -> None:
        later = self.system.time + self.system.arithmetic.number(time)
        self.pairs += [(c.i, c.j) for c in self.system.advance_to(later)]

    def kT(self) -> float:
        n, d = self.system.positions.shape
        return 2.0 * float(self.system.energy) / (d * (n - 1))

    def order(self) -> list[tuple[int, int]]:
        return self.pairs

    def positions(self) -> np.ndarray:
        return self.system.positions.astype(float)

    def reversed(self) -> Motion:
        system = self.system
        back = NaiveSystem(
            system.positions,
            -system.velocities,
            system.box,
            diameter=system.diameters,
            masses=list(system.masses),
            arithmetic=cast(ArithmeticName, system.arithmetic.name),
        )
        return _Naive(back)

    def tally(self) -> tuple[float, int, float]:
        system = self.system
        return float(system.time - self._start), system.collisions, float(system.virial)

    def faults(self) -> tuple[float, float, float]:
        system = self.system
        energy = float(abs(system.energy - self._energy) / self._energy)
        change = system.momentum - self._momentum
        speeds = np.sqrt((system.velocities.astype(float) ** 2).sum(axis=1))
        scale = float(system.masses.astype(float) @ speeds)
        return math.nan, energy, float(sum(change * change)) ** 0.5 / scale

    def bytes_per_particle(self) -> float:
        number = self.system.positions.flat[0]
        if isinstance(number, float):
            size = 8
        else:
            parts = number._mpf_
            size = 8 + sum(sys.getsizeof(part) for part in (number, parts, *parts))
        return 2.0 * self.system.positions.shape[1] * size


@dataclass
class _Stepping(Motion):
    """Time-driven stepping."""

    system: Stepper
    logged: bool = True
    pairs: list[tuple[int, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._asked = 0.0
        self._speeds = self.system.velocities

    def run(self, time: float) -> None:
        self._asked += time
        steps = round(self._asked / self.system.step) - self.system.steps
        found = self.system.run(steps, log=self.logged)
        self.pairs += [(min(i, j), max(i, j)) for _, i, j in found]

    def kT(self) -> float:
        v = self.system.velocities
        return self.system.mass * float((v * v).sum()) / (v.shape[1] * (len(v) - 1))

    def order(self) -> list[tuple[int, int]]:
        return self.pairs

    def positions(self) -> np.ndarray:
        # At the requested time, which is within half a step of the present time.
        return self.system.positions + self.system.velocities * (self._asked - self.system.time)

    def reversed(self) -> Motion:
        return _Stepping(self.system.reversed(), self.logged)

    def tally(self) -> tuple[float, int, float]:
        return self.system.time, self.system.collisions, self.system.virial

    def faults(self) -> tuple[float, float, float]:
        energy, momentum = _changes(self._speeds, self.system.velocities)
        return self.system.worst_overlap, energy, momentum

    def bytes_per_particle(self) -> float:
        return self.system.bytes / len(self._speeds)


@dataclass
class _PseudoHard(Motion):
    """Pseudo hard spheres."""

    system: Any
    rate: float
    """Collisions of all hard spheres per unit of time."""

    def __post_init__(self) -> None:
        self._asked, self._begun = 0.0, 0
        self._energy, self._speeds = self.system.energy, self.system.velocities

    def run(self, time: float) -> None:
        self._asked += time
        self.system.run(round(self._asked / self.system.step) - (self.system.steps - self._begun))

    def settle(self, time: float) -> None:
        self.system.equilibrate(max(round(4.0 * time / self.system.step), 50))
        self._begun, self._asked = self.system.steps, 0.0
        self._energy, self._speeds = self.system.energy, self.system.velocities

    def kT(self) -> float:
        n, d = self._speeds.shape
        return 2.0 * self.system.action / self.system.time / (d * (n - 1))

    def order(self) -> None:
        return None

    def positions(self) -> np.ndarray:
        return self.system.positions

    def reversed(self) -> Motion:
        return _PseudoHard(self.system.reversed(), self.rate)

    def tally(self) -> tuple[float, int, float]:
        time = self.system.time
        return time, round(self.rate * time), self.system.virial

    def faults(self) -> tuple[float, float, float]:
        kinetic = self.system.mass * float((self._speeds**2).sum()) / 2.0
        energy = abs(self.system.energy - self._energy) / kinetic
        overlap = 1.0 - getattr(self.system, "closest", math.nan)
        return overlap, energy, _changes(self._speeds, self.system.velocities)[1]

    def bytes_per_particle(self) -> float:
        return getattr(self.system, "bytes", math.nan) / len(self._speeds)


def _changes(before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """Return the relative changes of kinetic energy and momentum of equal masses."""
    energy = abs(float(np.sum(after * after) / np.sum(before * before)) - 1.0)
    change = after.sum(axis=0) - before.sum(axis=0)
    scale = float(np.sqrt((after * after).sum(axis=1)).sum())
    return energy, float(np.linalg.norm(change)) / scale


def _listed(kind: type[Any], scene: Scene, logged: bool, **settings: Any) -> Any:
    """Return the spheres of a scene with a list of pairs; a logged motion is not tuned."""
    settings |= {"diameter": scene.diameter, "mass": scene.mass, "skin": UNTUNED if logged else None}
    return kind(scene.positions, scene.velocities, scene.box, **settings)


def naive_system(scene: Scene, positions: Any = None, **arithmetic: Any) -> NaiveSystem:
    """Return a scene, perhaps at other positions, for the naive algorithm."""
    where = scene.positions if positions is None else positions
    masses = [scene.mass] * scene.n
    return NaiveSystem(
        where, scene.velocities, scene.box, diameter=scene.diameter, masses=masses, **arithmetic
    )
