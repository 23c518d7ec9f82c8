"""A simulation: a scene set in motion. Compile, run, sample, measure, checkpoint, resume."""

from __future__ import annotations

import dataclasses
import json
import math
import time as clock
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carom import checks, initial
from carom.contents import conserved, contents_of, growth_rates, refuse_single
from carom.errors import CaromWarning, FileError, InputError
from carom.frame import Frame
from carom.scene import Scene
from carom.tally import Block
from carom.units import TimeUnit

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.kernel.scheme import Engine, Scheme
    from carom.observables.precision import Prediction
    from carom.obstacles import Obstacle

CYCLES = 20_000
"""Cycles between two looks at the clock and at Ctrl-C: some 10 ms."""

PATIENCE = 1000.0
"""Mean free times without any collision after which a run towards a number of collisions gives up."""

LEAST_ENERGY, MOST_ENERGY = 1e-304, 1e304
"""Temperatures must not be below the one, nor kinetic energies above the other: as doubles they have all
their digits, with some room for their products.
"""

LAST_EPOCH = 2**61
"""Epochs that a clock can count, with room to spare."""

LOG_BUFFER = 1 << 16
"""Collisions kept in memory before they go to the event log."""


@dataclass(frozen=True)
class Statistics:
    """What a run did, and how well.

    Attributes
    ----------
    collisions : int
        Pair collisions, each counted once.
    transits : int
        Sector crossings, or renewals of a neighbour list.
    advancements : int
        Events left without a partner by a preemption.
    advancement_fraction : float
        Advancements over all processed events, a collision counting as two, as in the paper's section 6.
    third_party_first : int
        Pairs that scheduled each other again right after colliding: the paper's m* = i*.
    clamped_roots : int
        Negative times until contact replaced by zero.
    collisions_per_second : float
        Pair collisions per second of wall time spent in the engine.
    worst_overlap : float
        Largest depth of two cores seen at a collision, in diameters.
    energy_drift, momentum_drift : float
        Change since the start: of the energy, relative to it (also what inelastic contacts took and growth
        brought); of the momentum, relative to ``sum(m |v|)`` (NaN where walls or obstacles take it up).
    """

    collisions: int
    transits: int
    advancements: int
    advancement_fraction: float
    third_party_first: int
    clamped_roots: int
    collisions_per_second: float
    worst_overlap: float
    energy_drift: float
    momentum_drift: float


class Impacts(NamedTuple):
    """What a wall or an obstacle took up.

    Attributes
    ----------
    name : str
        Which one.
    hits : int
        Collisions with it.
    impulse : float
        Sum of the momentum along its normal [mass length / time]; over time and area this is a pressure.
    """

    name: str
    hits: int
    impulse: float


class Simulation:
    """Event-driven dynamics of a scene.

    Parameters
    ----------
    scene : Scene
        What is simulated.
    kT : float, optional
        Temperature of the Maxwell velocities drawn for a scene that has none; 1 if left out.
    seed : int
        Seed of those velocities. The same scene, seed and version give the same bits.
    neighbors : {"auto", "lists", "sectors"}
        Neighbour scheme; changes the speed, not the physics.
    shell : float, optional
        Reach of the neighbour lists in diameters.
    images : bool
        Count the boxes that each component crosses, for unwrapped positions.
    precision : {"double", "single"}
        What positions, velocities and times are kept in; what is computed with them is in double precision
        either way. Single precision halves the rows of the state, and its overlaps are of 1e-7 of the box: it
        is refused for boxes of more than 8192 diameters, very near close packing, and for fast drifts.
    growth : float or (n,) array_like, optional
        Rate at which the diameters grow [length / time], as in the paper's sec. 8. A contact is then elastic
        in the frame of the surfaces, so that the energy grows, too; see :meth:`rescale`.
    event_log : path, optional
        Write every collision to this HDF5 file (see ``docs/files``).

    Raises
    ------
    InputError
        If the scene has velocities and ``kT`` is given too, or a parameter is out of range.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.fcc(cells=3, packing_fraction=0.3), seed=1)
    >>> block = sim.run(collisions_per_particle=10)
    >>> block.collisions
    540
    """

    def __init__(
        self,
        scene: Scene,
        *,
        kT: float | None = None,
        seed: int = 0,
        neighbors: str = "auto",
        shell: float | None = None,
        images: bool = True,
        precision: str = "double",
        growth: float | ArrayLike | None = None,
        event_log: str | PathLike[str] | None = None,
    ):
        if neighbors not in ("auto", "lists", "sectors"):
            raise InputError(f"neighbors is {neighbors!r}; expected 'auto', 'lists' or 'sectors'.")
        if precision not in ("double", "single"):
            raise InputError(f"precision is {precision!r}; expected 'double' or 'single'.")
        if shell is not None:
            shell = checks.number(shell, "shell", low=1.0, open_low=True)
        if scene.velocities is None:
            velocities = initial.maxwell_velocities(
                scene.n, scene.dimension, scene.masses, 1.0 if kT is None else kT, seed, conserved(scene)
            )
        elif kT is None:
            velocities = scene.velocities
        else:
            raise InputError("The scene has velocities and kT is given too: leave out one of them.")

        rates = growth_rates(growth, scene)
        if rates is not None and event_log is not None:
            raise InputError(
                "An event log holds one diameter a component, but growth is given: leave out one."
            )
        self.scene = scene
        if precision == "single":
            refuse_single(scene, velocities)
        self._wish = (neighbors, shell)
        self._unit = self._unit_for(velocities, rates)
        self._contents = contents_of(
            scene, rates, self._thermal_speed(velocities), images, precision == "single", self._unit
        )
        self._setup(velocities, self._choose(velocities))
        self._schedule()
        if event_log is not None:
            self._open_log(event_log, keep=None)

    def _unit_for(self, velocities: np.ndarray, rates: np.ndarray | None) -> TimeUnit:
        """Return the kernel's unit of time for velocities and rates of growth.

        Raises
        ------
        InputError
            If the energy is out of range.
        """
        fastest = float(np.abs(velocities).max())
        unit = TimeUnit.of(
            max(fastest, 0.0 if rates is None else 2.0 * float(rates.max())), self.scene.diameter
        )
        v = unit.to_kernel(velocities, -1)
        twice = unit.to_scene(float(np.sum(self.scene.masses[:, None] * v * v)), -2)
        if fastest > 0.0 and not (LEAST_ENERGY * self.degrees_of_freedom <= twice <= MOST_ENERGY):
            raise InputError(
                f"Velocities of up to {fastest:g} make a kinetic energy of {0.5 * twice:g}; expected between "
                f"{LEAST_ENERGY:g} a degree of freedom and {MOST_ENERGY:g} in all, or rest, to keep all "
                "digits: choose another unit of time or of mass."
            )
        return unit

    def _thermal_speed(self, velocities: np.ndarray) -> float:
        """Return ``sqrt(kT / m)`` with the mean mass [length / kernel's time]."""
        v = self._unit.to_kernel(velocities, -1)
        twice = float(np.sum(self.scene.masses[:, None] * v * v))
        return math.sqrt(twice / (self.degrees_of_freedom * self.scene.mass))

    def _choose(self, velocities: np.ndarray, rate: float | None = None, wish: tuple = ()) -> Scheme:
        """Return the scheme for velocities [length / time]; ``rate`` is in the kernel's unit, ``wish`` stands
        for the user's.
        """
        from carom.kernel import scheme

        v = self._unit.to_kernel(velocities, -1)
        speed = math.sqrt(float(np.mean(np.sum(v * v, axis=1))))
        if self._contents.rates is not None:
            speed += 2.0 * float(self._contents.rates.max())
        try:
            neighbors, shell = wish or self._wish
            return scheme.choose(self._contents, speed, neighbors, shell, rate)
        except ValueError as error:
            raise InputError(str(error)) from None

    def _setup(self, velocities: np.ndarray, chosen: Scheme) -> None:
        """Make the arrays and what never changes during a run."""
        from carom.kernel import scheme

        self._scheme = chosen
        self._initial_velocities = np.array(velocities)
        self._engine: Engine = scheme.build(
            chosen, self._contents, self.scene.positions, self._unit.to_kernel(velocities, -1)
        )
        self._energy0, self._momentum0, self._momentum_scale = self._mechanics()
        self._base = Fraction(0)  # when the counting of epochs began
        self._counted = 0  # the collisions until then
        self._epoch, self._offset = 0, 0.0
        self._seconds = 0.0
        self._log: Any = None
        self._log_file: Any = None
        self.notes: dict[str, Any] = {}  # what the caller kept with the checkpoint this was loaded from

    # Time: an epoch and an offset within it, both exact, in the kernel's unit; instants are in the scene's.

    @property
    def time(self) -> float:
        """Time since the start [sigma sqrt(m / kT)], rounded to a double."""
        return float(self._instant())

    @property
    def epoch_length(self) -> float:
        """Length of an epoch [time]: a power of two."""
        return self._unit.to_scene(self._scheme.epoch, 1)

    def _instant(self) -> Fraction:
        passed = self._epoch * Fraction(self._scheme.epoch) + Fraction(self._offset)
        return self._base + self._unit.to_scene(passed, 1)

    def _split(self, instant: Fraction) -> tuple[int, float]:
        """Return the epoch and the offset of an exact time."""
        length = Fraction(self._scheme.epoch)
        passed = self._unit.to_kernel(instant - self._base, 1)
        epoch = int(passed // length)
        if epoch >= LAST_EPOCH:
            raise InputError(
                f"A time of {float(instant):g} is {float(epoch):g} epochs of {self.epoch_length:g}; "
                f"expected fewer than {LAST_EPOCH:g}, so ask for less time."
            )
        offset = float(passed - epoch * length)
        return (epoch, offset) if offset < self._scheme.epoch else (epoch + 1, 0.0)

    @property
    def collisions(self) -> int:
        """Pair collisions since the start."""
        return int(self._engine.tallies.collisions[0])

    @property
    def tally(self) -> Block:
        """Duration, collisions and virial since the start."""
        record = self._engine.tallies[0]
        return Block(self.time, int(record.collisions), self._unit.to_scene(float(record.virial), -1))

    @property
    def seconds(self) -> float:
        """Wall time spent in the engine [s]."""
        return self._seconds

    @property
    def kT(self) -> float:
        """Temperature [energy]: twice the kinetic energy over the :attr:`degrees_of_freedom`."""
        v = self._speeds()
        kT = float(np.sum(self.scene.masses[:, None] * v * v) / self.degrees_of_freedom)
        return self._unit.to_scene(kT, -2)

    def _speeds(self) -> np.ndarray:
        """Return velocities in the kernel's unit, (n, d) float64: in single precision squares overflow."""
        return np.asarray(self._engine.state.rows["v"][: self.scene.n], np.float64)

    @property
    def degrees_of_freedom(self) -> int:
        """Coordinates of velocity that are free: d n, less one for every axis along which the momentum is
        conserved, so d (n - 1) in a periodic box. Walls and obstacles take up momentum; a single component is
        free along all axes.
        """
        return self.scene.dimension * self.scene.n - sum(conserved(self.scene))

    @property
    def diameters(self) -> np.ndarray:
        """Diameter of each component at the present time, (n,) [length]."""
        if self._contents.rates is None:
            return self.scene.diameters
        pair = self._engine.model.pair
        return 2.0 * (pair.radii + pair.rates * self._in_epoch())[: self.scene.n]

    def _in_epoch(self) -> float:
        """Return the present time relative to the epoch that the kernel is in, in the kernel's unit."""
        ahead = self._epoch - int(self._engine.state.clock[0].epoch)
        return self._offset + float(ahead) * self._scheme.epoch

    @property
    def packing_fraction(self) -> float:
        """Part of the box that the components fill at the present time."""
        dimension = self.scene.dimension
        volume = initial.sphere_volume(dimension) * float(np.sum(self.diameters**dimension))
        return volume / self.scene.volume

    @property
    def collisions_by_species(self) -> np.ndarray:
        """Pair collisions since the start of every pair of species, (K, K), symmetric.

        Raises
        ------
        InputError
            If the scene has no species.
        """
        counts = self._species_tally().collisions
        return counts + np.triu(counts, 1).T

    @property
    def virial_by_species(self) -> np.ndarray:
        """Sum of ``r_ij . dp_ij`` since the start of every pair of species, (K, K), symmetric
        [mass length^2 / time].
        """
        sums = self._unit.to_scene(self._species_tally().virial, -1)
        return sums + np.triu(sums, 1).T

    def _species_tally(self):
        if self._engine.by_species is None:
            raise InputError("The scene has no species: build it with species=, or with Scene.mixture().")
        return self._engine.by_species

    @property
    def obstacles(self) -> tuple[Impacts, ...]:
        """What walls and obstacles took up since the start, in the order of their numbers: the walls of each
        axis without periodicity, lower before upper, then the scene's obstacles.
        """
        from carom.observables.wall_pressure import obstacle_names

        tally = self._engine.model.obstacles
        return tuple(
            Impacts(name, int(tally.hits[k]), self._unit.to_scene(float(tally.impulse[k]), -1))
            for name, k in zip(obstacle_names(self.scene), self._obstacle_numbers(), strict=True)
        )

    def _obstacle_numbers(self) -> list[int]:
        """Return the kernel's number of each wall and obstacle."""
        from carom.kernel.obstacle import numbering

        walls = [
            2 * axis + side for axis, wraps in enumerate(self.scene.periodic) if not wraps for side in (0, 1)
        ]
        first = 2 * self.scene.dimension
        return walls + [first + k for k in numbering(self._contents.obstacles)]

    @property
    def spared_contacts(self) -> int:
        """Contacts that were elastic because they were slower than ``Scene.elastic_below``."""
        impact = self._engine.model.impact
        return 0 if impact is None else int(impact.spared[0])

    # Running.

    def run(
        self,
        *,
        collisions: int | None = None,
        collisions_per_particle: float | None = None,
        time: float | None = None,
        walltime: float | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> Block:
        """Run on, until the first of the given limits.

        Parameters
        ----------
        collisions : int, optional
            Pair collisions to add.
        collisions_per_particle : float, optional
            The same per component: every collision counts for two components.
        time : float, optional
            Time to add [sigma sqrt(m / kT)]; the run then ends exactly there.
        walltime : float, optional
            Seconds.
        progress : callable, optional
            Called now and then with the fraction done; changes no bit of the run.

        Returns
        -------
        Block
            Duration, collisions and virial of this stretch.

        Raises
        ------
        InputError
            If no limit is given or one is not a number at least zero.

        Warns
        -----
        CaromWarning
            If the collisions asked for cannot be had: nothing moves, or nobody is met in a thousand mean free
            times.
        """
        limits = {
            "collisions": collisions,
            "collisions_per_particle": collisions_per_particle,
            "time": time,
            "walltime": walltime,
        }
        for name, value in limits.items():
            if value is not None:
                checks.number(value, name, low=0.0)
        if all(value is None for value in limits.values()):
            raise InputError(f"run() needs a limit: one of {', '.join(limits)}.")
        if collisions_per_particle is not None:
            added = round(collisions_per_particle * self.scene.n / 2)
            collisions = added if collisions is None else min(collisions, added)
        end = None if time is None else self._instant() + Fraction(float(time))
        return self._run(None if collisions is None else int(collisions), end, walltime, progress)

    def _run(
        self,
        collisions: int | None,
        end: Fraction | None,
        walltime: float | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> Block:
        from carom.kernel import constants, cycle, scheme

        before = self._engine.tallies[0].copy()
        impulses = self._impulses()
        start = self._instant()
        target = np.int64(2**62 if collisions is None else min(int(before.collisions) + collisions, 2**62))
        deadline = math.inf if walltime is None else clock.perf_counter() + walltime
        patience = self._patience() if collisions is not None and end is None else math.inf
        last_seen, last_instant = int(before.collisions), start
        while True:
            stop, final = self._stop(end)
            began = clock.perf_counter()
            code = cycle.run(*self._engine, self._log, *stop, target, np.int64(CYCLES))
            now = clock.perf_counter()
            self._seconds += now - began
            record = self._engine.state.clock[0]
            if code == constants.IDLE and (end is not None or not final):
                self._rest_until(stop)
                code = constants.REACHED_TIME
            if code == constants.REACHED_TIME:
                self._epoch, self._offset = int(stop[0]), float(stop[1])
                if final:
                    break
                self._refit()
            else:
                # Where a run ended at a time, the last event lies behind the present.
                self._epoch, self._offset = max(
                    (self._epoch, self._offset), (int(record.epoch), float(record.now))
                )
            if code == constants.REACHED_COLLISIONS:
                break
            if code == constants.IDLE:
                if collisions is not None:
                    self._warn("Nothing moves, so nobody will ever collide: the run ended.")
                break
            if code == constants.NEEDS_HEAP:
                self._scheme = self._scheme.with_larger_heap()
                self._engine = scheme.enlarge_heap(self._engine, self._scheme)
            elif code == constants.NEEDS_NEIGHBORS:
                self._enlarge_neighbors()
                self._schedule()
            elif code == constants.NEEDS_LOG:
                self._flush_log()
            if progress is not None:
                progress(self._fraction(before, start, target, end))
            if now >= deadline:
                break
            if self.collisions > last_seen:
                last_seen, last_instant = self.collisions, self._instant()
            elif self._instant() - last_instant > patience:
                self._warn(
                    f"No collision in {PATIENCE:g} mean free times, after {self.collisions} in all: "
                    "the components seem to miss each other for ever, and the run ended; "
                    "ask for time= instead of collisions."
                )
                break
        if progress is not None:
            progress(1.0)
        after = self._engine.tallies[0]
        return Block(
            float(self._instant() - start),
            int(after.collisions - before.collisions),
            self._unit.to_scene(float(after.virial - before.virial), -1),
            tuple(b - a for a, b in zip(impulses, self._impulses(), strict=True)),
        )

    def _impulses(self) -> tuple[float, ...]:
        """Return the momentum that each wall and obstacle took up since the start."""
        if self._engine.model.obstacles is None:
            return ()
        return tuple(impact.impulse for impact in self.obstacles)

    def _stop(self, end: Fraction | None) -> tuple[tuple[np.int64, float], bool]:
        """Return where the kernel has to return, as an epoch and an offset, and whether the run ends so."""
        if self._contents.rates is not None:
            refit = self._base + self._unit.to_scene(Fraction(self._scheme.horizon), 1)
            if end is None or refit < end:
                epoch, offset = self._split(refit)
                return (np.int64(epoch), float(offset)), False
        if end is None:
            return (np.int64(2**62), 0.0), True
        epoch, offset = self._split(end)
        return (np.int64(epoch), float(offset)), True

    def rescale(self, kT: float = 1.0, *, growth: float | ArrayLike | None = None) -> None:
        """Scale all velocities, so that the temperature is ``kT``; momentum that is conserved is made zero.

        For diameters that grow: every contact adds energy, and what counts is their rate of growth in units
        of the thermal speed. Everything is then scheduled anew.

        Parameters
        ----------
        kT : float
            The new temperature [energy].
        growth : float or (n,) array_like, optional
            Rate at which the diameters grow from now on, where they grew before [length / time].

        Raises
        ------
        InputError
            If nothing moves, or a growth that is not positive takes the place of another, or of none.
        """
        kT = checks.number(kT, "kT", low=0.0, open_low=True)
        if growth is not None:
            rates = growth_rates(growth, self.scene)
            if rates is None or self._contents.rates is None:
                raise InputError(
                    "rescale() changes one growth into another: give Simulation() a positive growth, too."
                )
        velocities = self.frame().velocities
        masses = self.scene.masses[:, None]
        momentum = np.where(conserved(self.scene), np.sum(masses * velocities, axis=0), 0.0)
        velocities -= momentum / masses.sum()
        twice = float(np.sum(masses * velocities * velocities))
        if twice == 0.0:
            raise InputError("Nothing moves, so there is no temperature to scale; give the scene velocities.")
        half = math.frexp(twice)[1] // 2  # a temperature over another may be no double; their roots are
        factor = math.sqrt(kT * self.degrees_of_freedom / math.ldexp(twice, -2 * half))
        self._refit(np.ldexp(factor * velocities, -half), None if growth is None else rates)

    def _refit(self, velocities: np.ndarray | None = None, rates: np.ndarray | None = None) -> None:
        """Choose the neighbour scheme anew, for the diameters of the present, and schedule everything."""
        from carom.kernel import scheme

        frame = self.frame()
        velocities = frame.velocities if velocities is None else velocities
        instant, old, before = self._instant(), self._engine, self._unit
        if self._contents.rates is not None and rates is None:
            rates = before.to_scene(self._contents.rates, -1)
        self._unit = unit = self._unit_for(velocities, rates)
        threshold = before.to_scene(self._contents.threshold, -1)
        self._contents = dataclasses.replace(self._contents, threshold=unit.to_kernel(threshold, -1))
        if rates is not None:
            radii = 0.5 * frame.diameters
            self._contents = dataclasses.replace(
                self._contents,
                radii=radii,
                diameter=2.0 * float(radii.max()),
                rates=unit.to_kernel(rates, -1),
            )
        passed, seen = float(before.to_kernel(instant - self._base, 1)), self.collisions - self._counted
        rate = None
        if seen >= self.scene.n and passed > 0.0:
            rate = before.to_scene(2.0 * seen / (self.scene.n * passed), -1)
            quicker = float(np.abs(velocities).max()) / float(np.abs(frame.velocities).max())
            rate = unit.to_kernel(math.ldexp(rate, round(math.log2(quicker))), -1)
        try:
            self._scheme = self._choose(velocities, rate)
        except InputError:  # components have outgrown the lists that were asked for
            self._scheme = self._choose(velocities, rate, ("sectors", None))
        self._engine = scheme.build(
            self._scheme, self._contents, frame.positions, unit.to_kernel(velocities, -1)
        )
        scheme.keep_tallies(old, self._engine, unit.exponent - before.exponent)
        images = self._engine.state.images
        if frame.images is not None and images is not None:
            images[:] = frame.images
        self._base, self._epoch, self._offset = instant, 0, 0.0
        self._counted = self.collisions
        self._schedule()

    @staticmethod
    def _warn(text: str) -> None:
        warnings.warn(text, CaromWarning, stacklevel=4)

    def _patience(self) -> float:
        """Return the time without a collision after which none is to be expected [time]."""
        return math.inf if self._contents.rates is not None else self._unit.to_scene(self._lonely(), 1)

    def _lonely(self) -> float:
        """Return the same in the kernel's unit, for diameters that do not grow."""
        from carom.kernel import scheme

        v, masses = self._speeds(), self.scene.masses
        fastest = float(np.abs(v).max())
        if self._engine.model.obstacles is None:
            v = v - np.average(v, axis=0, weights=masses)  # a common drift meets nobody
        speed = math.sqrt(float(np.sum(masses[:, None] * v * v)) / (self.scene.mass * self.scene.n))
        if speed <= 8.0 * np.finfo(float).eps * fastest:
            return self._scheme.epoch
        if self._contents.restitution < 1.0:  # they cool until contacts are slower than this, hence elastic
            speed = min(speed, self._contents.threshold)
        rate = scheme.collision_rate(
            self.scene.packing_fraction, self.scene.dimension, self.scene.diameter, speed
        )
        return PATIENCE / rate + self._scheme.epoch if rate > 0.0 else self._scheme.epoch

    def _fraction(self, before, start: Fraction, target, end) -> float:
        done = [0.0]
        if target < 2**62 and target > before.collisions:
            done.append((self.collisions - int(before.collisions)) / (int(target) - int(before.collisions)))
        if end is not None:
            span = end - start
            done.append(float((self._instant() - start) / span) if span else 1.0)
        return min(max(done), 1.0)

    def _rest_until(self, end: tuple[np.int64, float]) -> None:
        """Let time pass where nothing moves."""
        record = self._engine.state.clock[0]
        record.epoch, record.now = end
        self._engine.state.rows["t"] = end[1]
        self._engine.calendar.control.end[0] = self._scheme.epoch

    def _schedule(self) -> None:
        from carom.kernel import cycle

        while not cycle.schedule(*self._engine):
            self._enlarge_neighbors()

    def _enlarge_neighbors(self) -> None:
        from carom.kernel import scheme

        self._scheme = self._scheme.with_larger_neighbors()
        self._engine = scheme.enlarge_neighbors(self._engine, self._scheme, self._contents)

    # Looking.

    def frame(self) -> Frame:
        """Return all components at the present time; changes no bit of the run."""
        from carom.kernel.project import project

        n, dimension = self.scene.n, self.scene.dimension
        state = self._engine.state
        positions, velocities = np.empty((n, dimension)), np.empty((n, dimension))
        images = None if state.images is None else state.images.copy()
        project(self._engine.model, state, self._in_epoch(), positions, velocities, images)
        velocities = self._unit.to_scene(velocities, -1)
        return Frame(
            time=self.time,
            step=self.collisions,
            positions=positions,
            velocities=velocities,
            box=self.scene.box,
            diameters=self.diameters,
            masses=self.scene.masses,
            images=images,
            species=self.scene.species,
            species_names=self.scene.species_names,
            periodic=self.scene.periodic,
        )

    def sample(
        self,
        *,
        every: float | None = None,
        count: int | None = None,
        times: Iterable[float] | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> Iterator[Frame]:
        """Run on and yield Frames exactly at the given times; changes no bit of the run.

        Parameters
        ----------
        every : float
            Time between two frames; the first one is ``every`` after the present.
        count : int, optional
            How many frames; without end if left out.
        times : iterable of float
            Times since the start of the run instead, not decreasing, none of them past.
        progress : callable, optional
            Called with the fraction of the frames done.

        Raises
        ------
        InputError
            If neither or both of ``every`` and ``times`` are given, or a time lies in the past.
        """
        if (every is None) == (times is None):
            raise InputError("sample() needs either every= (with count=) or times=.")
        if every is not None:
            every = checks.number(every, "every", low=0.0, open_low=True)
            count = None if count is None else checks.integer(count, "count", low=0)
        else:
            several = times if isinstance(times, Iterable) else [times]
            times = [checks.number(time, "a sample's time", low=0.0) for time in several]
        return self._frames(every, count, times, progress)

    def _frames(self, every, count, times, progress) -> Iterator[Frame]:
        if times is None:
            start, step = self._instant(), Fraction(float(every))
            instants: Iterable[Fraction] = (
                start + k * step for k in (range(1, count + 1) if count is not None else _forever())
            )
        else:
            count = len(times)
            instants = (Fraction(float(t)) for t in times)
        for k, instant in enumerate(instants, start=1):
            present = self._instant()
            if instant < present and float(instant) == float(present):
                instant = present  # the present, as `sim.time` rounds it
            if instant < present:
                raise InputError(
                    f"A sample at time {float(instant):g} is asked for at {self.time:g}; "
                    "times must not decrease."
                )
            self._run(None, instant)
            if progress is not None and count:
                progress(k / count)
            yield self.frame()

    def measure(
        self,
        observable,
        *,
        collisions: int | None = None,
        collisions_per_particle: float | None = None,
        time: float | None = None,
        relative_error: float | None = None,
        max_walltime: float | None = None,
        progress: Callable[[float], object] | None = None,
        predicted: Callable[[Prediction], object] | None = None,
    ):
        """Run on and measure an observable of the collisions, such as :class:`carom.Pressure`.

        The stretch is cut into ``observable.blocks`` blocks of equal *time*, whatever the limit is given in:
        blocks that end with a collision would bias the mean. A number of collisions is turned into a time by
        the rate seen so far, or in a short pilot.

        Parameters
        ----------
        observable : carom.Pressure, carom.WallPressure, or what has their ``blocks`` and ``of_scene``
            What is measured.
        collisions, collisions_per_particle, time : float, optional
            How long, as in :meth:`run`.
        relative_error : float, optional
            Instead of these: until one standard error is at most this part of the mean (of Z, for the
            pressure), and at least 64 independent blocks say so.
        max_walltime : float, optional
            Seconds after which that is given up.
        progress : callable, optional
            Called with the fraction done; with ``relative_error``, of what is expected so far.
        predicted : callable, optional
            Called with a :class:`carom.observables.Prediction` after a pilot of 64 collisions per particle
            and again whenever the error bar was looked at.

        Returns
        -------
        The observable's estimate, with its error bar.

        Raises
        ------
        InputError
            If not exactly one length is given, or nobody collides.

        Warns
        -----
        CaromWarning
            If ``max_walltime`` came first.
        """
        given = {
            "collisions": collisions,
            "collisions_per_particle": collisions_per_particle,
            "time": time,
            "relative_error": relative_error,
        }
        if sum(value is not None for value in given.values()) != 1:
            raise InputError(f"measure() needs exactly one of {', '.join(given)}.")
        if relative_error is not None:
            from carom import measuring
            from carom.observables.precision import Goal

            seconds = (
                math.inf
                if max_walltime is None
                else checks.number(max_walltime, "max_walltime", low=0.0, open_low=True)
            )
            return measuring.until(
                self,
                observable,
                Goal(relative_error),
                max_walltime=seconds,
                progress=progress,
                predicted=predicted,
            )
        if max_walltime is not None or predicted is not None:
            raise InputError("max_walltime and predicted go with relative_error, which is missing.")
        if time is None:
            if collisions_per_particle is not None:
                collisions = round(0.5 * self.scene.n * collisions_per_particle)
            assert collisions is not None
            time = self.time_for(collisions)
        blocks = []
        for block in self.blocks(time / observable.blocks, observable.blocks):
            blocks.append(block)
            if progress is not None:
                progress(len(blocks) / observable.blocks)
        return self.estimate(observable, blocks)

    def estimate(self, observable, blocks: Sequence[Block]):
        """Return the observable's estimate from blocks of this run, such as :meth:`blocks` yields."""
        return observable.of_scene(blocks, self.scene, kT=self.kT)

    def blocks(self, duration: float, count: int) -> Iterator[Block]:
        """Run on for ``count`` blocks of equal time and yield each."""
        start, step = self._instant(), Fraction(checks.number(duration, "duration", low=0.0))
        for k in range(1, count + 1):
            yield self._run(None, start + k * step)

    def time_for(self, collisions: float) -> float:
        """Return the time in which about so many pair collisions happen, from the rate so far.

        A run with fewer than 1000 collisions behind it first runs a pilot of as many.
        """
        if self.scene.n == 1 or self._energy0 == 0.0:
            raise InputError("Nobody collides in this scene: give time= instead of a number of collisions.")
        if self.collisions < 1000:
            self.run(collisions=1000 - self.collisions)
        if self.collisions == 0:
            raise InputError("Nobody collides in this scene: give time= instead of a number of collisions.")
        return float(collisions) * self.time / self.collisions

    def _mechanics(self) -> tuple[float, np.ndarray, float]:
        """Return energy, momentum (d,), and the momentum that the same speeds would have in one direction."""
        v = self._speeds()
        masses = self.scene.masses[:, None]
        energy = 0.5 * math.fsum((masses * v * v).ravel())
        momentum = np.array([math.fsum(column) for column in (masses * v).T])
        scale = float(np.sum(masses[:, 0] * np.sqrt(np.sum(v * v, axis=1))))
        unit = self._unit
        return unit.to_scene(energy, -2), unit.to_scene(momentum, -1), unit.to_scene(scale, -1)

    @property
    def statistics(self) -> Statistics:
        """What the run did so far, and how well."""
        tally = self._engine.tallies[0]
        energy, momentum, _ = self._mechanics()
        events = 2 * tally.collisions + tally.advancements + tally.transits
        worst = 1.0 - 1.0 / math.sqrt(tally.depth) if tally.depth > 1.0 else 0.0
        return Statistics(
            collisions=int(tally.collisions),
            transits=int(tally.transits),
            advancements=int(tally.advancements),
            advancement_fraction=float(tally.advancements / events) if events else 0.0,
            third_party_first=int(tally.returns),
            clamped_roots=int(tally.clamped),
            collisions_per_second=float(tally.collisions / self._seconds) if self._seconds else 0.0,
            worst_overlap=worst,
            energy_drift=abs(energy - self._energy0) / self._energy0 if self._energy0 else 0.0,
            momentum_drift=self._momentum_drift(momentum),
        )

    def _momentum_drift(self, momentum: np.ndarray) -> float:
        if self._engine.model.obstacles is not None:
            return math.nan
        change = float(np.linalg.norm(momentum - self._momentum0))
        return change / self._momentum_scale if self._momentum_scale else 0.0

    def anatomy(self) -> tuple:
        """Return contents, scheme, engine, wish, whether there is a log: what :func:`carom.explain` tells."""
        return self._contents, self._scheme, self._engine, self._wish, self._log is not None

    # Keeping.

    def save(self, path: str | PathLike[str], **extra: Any) -> None:
        """Write a checkpoint: the continued run equals the uninterrupted one, bit for bit.

        Parameters
        ----------
        path : path
            An HDF5 file, replaced atomically.
        **extra
            Small JSON-able values kept with it (what the caller was doing).
        """
        import carom
        from carom.io import checkpoint
        from carom.kernel import scheme

        self._flush_log()
        arrays = {
            **scheme.arrays(self._engine),
            "initial_velocities": self._initial_velocities,
        }
        scene_arrays, scene_attributes = self.scene.to_arrays()
        arrays.update({f"scene.{name}": value for name, value in scene_arrays.items()})
        if self._contents.rates is not None and self._contents.radii is not None:
            arrays["contents.radii"] = self._contents.radii
            arrays["contents.rates"] = self._contents.rates
        attributes = {
            "carom": carom.__version__,
            "scene": json.dumps(scene_attributes),
            "time_unit": self._unit.exponent,
            "threshold": self._contents.threshold,
            "base": f"{self._base.numerator}/{self._base.denominator}",
            "counted": self._counted,
            "wish": json.dumps(self._wish),
            "scheme": json.dumps(dataclasses.asdict(self._scheme)),
            "images": self._engine.state.images is not None,
            "single": self._contents.single,
            "epoch": self._epoch,
            "offset": self._offset,
            "seconds": self._seconds,
            "event_log": "" if self._log_file is None else str(self._log_file.path),
            "extra": json.dumps(extra),
        }
        checkpoint.save(path, arrays, attributes)

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        *,
        event_log: str | PathLike[str] | None = None,
        obstacles: Sequence[Obstacle] | None = None,
    ) -> Simulation:
        """Return the simulation that a checkpoint holds.

        Parameters
        ----------
        path : path
            A file that :meth:`save` wrote.
        event_log : path, optional
            Where the event log is now, if it was moved; what it holds beyond the checkpoint is dropped.
        obstacles : sequence of obstacles, optional
            All of the scene's, where some are of a class of one's own, which no file holds.

        Raises
        ------
        FileError
            If the file is missing, truncated, foreign, or of another version of Carom, or an obstacle of
            one's own is not given.
        """
        import carom
        from carom.io import checkpoint
        from carom.kernel import scheme

        arrays, attributes = checkpoint.load(path)
        try:
            version = str(attributes["carom"])
            if version != carom.__version__:
                raise FileError(
                    f"{path} was written by Carom {version}, this is {carom.__version__}, and the same bits "
                    "are only promised within one version; go on with that version, or start from a frame."
                )
            settings = json.loads(str(attributes["scheme"]))
            chosen = scheme.Scheme(**{**settings, "shape": tuple(settings["shape"])})
            sim = cls.__new__(cls)
            sim.scene = Scene.from_arrays(
                {name[6:]: value for name, value in arrays.items() if name.startswith("scene.")},
                json.loads(str(attributes["scene"])),
                obstacles=obstacles,
            )
            sim._unit = TimeUnit(int(attributes["time_unit"]))
            rates = arrays.get("contents.rates")
            contents = contents_of(
                sim.scene, rates, 0.0, bool(attributes["images"]), bool(attributes["single"]), sim._unit
            )
            contents = dataclasses.replace(contents, threshold=float(attributes["threshold"]), rates=rates)
            if rates is not None:
                radii = arrays["contents.radii"]
                contents = dataclasses.replace(contents, radii=radii, diameter=2.0 * float(radii.max()))
            sim._contents = contents
            neighbors, shell = json.loads(str(attributes["wish"]))
            sim._wish = (neighbors, shell)
            sim._setup(arrays["initial_velocities"], chosen)
            scheme.restore(sim._engine, arrays)
            sim._base, sim._counted = Fraction(str(attributes["base"])), int(attributes["counted"])
            sim._epoch, sim._offset = int(attributes["epoch"]), float(attributes["offset"])
            sim._seconds = float(attributes["seconds"])
            sim.notes = json.loads(str(attributes["extra"]))
        except (KeyError, TypeError, ValueError) as error:
            if isinstance(error, FileError):
                raise
            raise FileError(f"{path} is not a checkpoint of a simulation: {error}.") from None
        log = event_log or str(attributes.get("event_log", ""))
        if log:
            sim._open_log(log, keep=sim._logged())
        return sim

    # The event log.

    def _open_log(self, path, keep: int | None) -> None:
        from carom.io.events import EventLog
        from carom.kernel.tally import make_log

        scene, attributes = self.scene.to_arrays()
        header: dict[str, Any] = {
            **{name: values for name, values in scene.items() if name not in ("diameter", "mass")},
            "diameters": self.scene.diameters,
            "masses": self.scene.masses,
            "scene": np.frombuffer(json.dumps(attributes).encode(), np.uint8),
            "threshold": np.float64(self._unit.to_scene(self._contents.threshold, -1)),
            "positions": self.scene.positions,
            "velocities": self._initial_velocities,
            "box": np.asarray(self.scene.box),
            "diameter": np.float64(self.scene.diameter),
            "mass": np.float64(self.scene.mass),
            "epoch_length": np.float64(self.epoch_length),
            "shape": np.asarray(self._scheme.shape, np.int64),
            "bits": np.int64(self._bits()),
        }
        self._log_file = EventLog(path, header) if keep is None else EventLog(path, keep=keep)
        self._log = make_log(LOG_BUFFER)

    def _bits(self) -> int:
        """Return how many bits of a word name the image: none in a wide box."""
        from carom.kernel.boundary import SectorImage

        boundary = self._engine.model.boundary
        return boundary.bits if isinstance(boundary, SectorImage) else 0

    def _logged(self) -> int:
        """Return how many entries the event log has by now: collisions of pairs and with obstacles."""
        tally = self._engine.model.obstacles
        return self.collisions + (0 if tally is None else int(tally.hits.sum()))

    def _flush_log(self) -> None:
        if self._log is None:
            return
        from carom.kernel.constants import LAMBDA, OBSTACLE

        used = int(self._log.used[0])
        bits = self._bits()
        word = self._log.word[:used]
        other, image = word >> bits, word & ((1 << bits) - 1)
        fixed = word < LAMBDA
        if fixed.any():  # the paper's partners N + k
            public = np.argsort(self._obstacle_numbers())
            order = np.sort(self._obstacle_numbers())
            k = public[np.searchsorted(order, OBSTACLE - word[fixed])]
            other[fixed], image[fixed] = self.scene.n + k, 0
        self._log_file.append(
            self._log.epoch[:used],
            self._unit.to_scene(self._log.time[:used], 1),
            self._log.i[:used],
            other,
            image,
            self._unit.to_scene(self._log.impulse[:used], -1),
        )
        self._log.used[0] = 0

    def close(self) -> None:
        """Flush and close the event log, if there is one."""
        if self._log_file is not None:
            self._flush_log()
            self._log_file.close()
            self._log = self._log_file = None

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Simulation of {self.scene!r} at time {self.time:g}, {self.collisions} collisions>"


def _forever() -> Iterator[int]:
    k = 0
    while True:
        k += 1
        yield k
