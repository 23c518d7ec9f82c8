"""A simulation: a scene set in motion. Compile, run, sample, measure, checkpoint, resume."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks, densities
from carom.block import Block
from carom.errors import InputError
from carom.frame import Frame
from carom.notebook import watchable
from carom.scene.scene import Scene
from carom.scene.temperature import conserved, degrees_of_freedom
from carom.scene.velocities import maxwell_velocities
from carom.simulation import (
    checkpoint,
    flying,
    helfand,
    loop,
    measuring,
    mechanics,
    pair_steps,
    sampling,
    units,
)
from carom.simulation.alone import looks
from carom.simulation.machine import Machine, wish_of
from carom.simulation.mechanics import Impacts, Statistics
from carom.simulation.preparation import contents_of, growth_rates, in_single, thermal_speed, unit_of
from carom.simulation.recorder import Recorder
from carom.simulation.team import team_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.models.interface import Impact, Interaction, Motion, Obstacle
    from carom.observables.steps import StepSums
    from carom.simulation.units import UnitsNow

__all__ = ["Impacts", "Simulation", "Statistics"]


class Simulation:
    """Event-driven dynamics of a scene.

    Parameters
    ----------
    scene : Scene
        What is simulated.
    kT : float, optional
        Temperature of the Maxwell velocities that are drawn for a scene without velocities; by default 1.
    seed : int
        Seed of those velocities. The same scene, seed and version give the same bits.
    neighbors : {"auto", "lists", "sectors", "all"}
        Neighbour scheme; changes the speed, not the physics.
    shell : float, optional
        Reach of the neighbour lists in diameters.
    images : bool
        Count the boxes that each component crosses, for unwrapped positions.
    precision : {"double", "single"}
        Precision in which positions, velocities and times are stored. All computations are in double
        precision. Single precision saves a fifth of the memory, no time, and leaves overlaps of 1e-7 of the
        box. It is refused for boxes of more than 8192 diameters, very near close packing, and for fast
        drifts.
    growth : float or (n,) array_like, optional
        Rate at which the diameters grow [length / time], as in the paper's sec. 8. A contact is then elastic
        in the frame of the surfaces, so that the energy grows, too; see :meth:`rescale`.
    event_log : path, optional
        Write every collision to this HDF5 file (see ``docs/files``).
    currents : bool
        Add up the currents of momentum and heat, for :meth:`helfand`.
    flights : bool
        Keep histograms of free flights and of normal speeds, for :meth:`free_flights`.
    workers : int or "auto"
        Threads that run this one system together. The bits are those of one worker (``docs/parallel``).
        "auto" takes two where this was measured to be faster: large systems in the plane.

    Raises
    ------
    InputError
        If the scene has velocities and ``kT`` is given too, or a parameter is out of range; or if several
        workers are requested for a scene that allows only one.

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
        currents: bool = False,
        flights: bool = False,
        workers: int | str = 1,
    ):
        if not isinstance(scene, Scene):
            raise InputError(f"A simulation needs a Scene, found {checks.describe(scene)}.")
        wish = wish_of(neighbors, shell)
        if scene.velocities is None:
            kT = 1.0 if kT is None else kT
            velocities = maxwell_velocities(
                scene.n, scene.dimension, scene.masses, kT, seed, conserved(scene), scene.pinned
            )
            if hasattr(scene.motion, "tangent") and kT > 0.0:
                velocities = scene.motion.tangent(scene.positions, velocities, scene.box)
                velocities = mechanics.at_temperature(velocities, scene, kT)
        elif kT is None:
            velocities = scene.velocities
        else:
            raise InputError("The scene has velocities and kT is given too: leave out one of them.")
        rates = growth_rates(growth, scene)
        if rates is not None and event_log is not None:
            raise InputError(
                "An event log holds one diameter a component, but growth is given: leave out one."
            )
        single = in_single(precision, scene, velocities)
        unit = unit_of(scene, velocities, rates)
        speed = thermal_speed(scene, velocities, unit)
        contents = contents_of(scene, rates, speed, images, single, unit)
        if currents:
            helfand.check(contents)
            contents = dataclasses.replace(contents, currents=True)
        contents = dataclasses.replace(contents, flights=bool(flights))
        self._face(Machine(scene, velocities, contents, unit, wish), {})
        self.machine.team = team_of(self.machine, workers)
        self.machine.schedule()
        if event_log is not None:
            self.machine.log = Recorder(event_log, self.machine)

    def _face(self, machine: Machine, notes: dict[str, Any]) -> None:
        # What moves is all in the machine; it is no part of the public interface.
        self.machine = machine
        self.scene = machine.scene
        self.notes = notes  # what the caller kept with the checkpoint this was loaded from

    @property
    @looks
    def time(self) -> float:
        """Time since the start [sigma sqrt(m / kT)], rounded to a double."""
        return float(self.machine.clock.instant)

    @property
    @looks
    def epoch_length(self) -> float:
        """Length of an epoch [time]: a power of two."""
        return self.machine.unit.to_scene(self.machine.scheme.epoch, 1)

    @property
    @looks
    def collisions(self) -> int:
        """Pair collisions since the start."""
        return self.machine.collisions

    @property
    @looks
    def tally(self) -> Block:
        """Duration, collisions and virial since the start; also the time integral of kT, where it changes."""
        record = self.machine.engine.tallies[0]
        virial = self.machine.unit.to_scene(float(record.virial), -1)
        return Block(self.time, int(record.collisions), virial, kT_time=mechanics.kT_time(self.machine))

    @property
    @looks
    def seconds(self) -> float:
        """Wall time spent in the engine [s]."""
        return self.machine.seconds

    @property
    @looks
    def kT(self) -> float:
        """Temperature [energy]: twice the kinetic energy over the :attr:`degrees_of_freedom`, about the
        motion of the centre of mass along every axis on which the momentum is conserved.
        """
        return mechanics.temperature(self.machine)

    @property
    @looks
    def potential_energy(self) -> float:
        """Potential energy of all pairs, if pairs have steps [energy].

        Raises
        ------
        InputError
            If pairs have no steps.
        """
        return pair_steps.potential_energy(self.machine)

    @property
    @looks
    def steps(self) -> StepSums:
        """Events at the ends of every step since the start, by kind, and the pairs that are on it now.

        Raises
        ------
        InputError
            If pairs have no steps.
        """
        return pair_steps.step_sums(self.machine)

    @property
    @looks
    def units(self) -> UnitsNow:
        """Present kinds, counters, memory and timers of units that decide by rules (``docs/range-rules``).

        Raises
        ------
        InputError
            If the scene has none.
        """
        return units.present(self.machine)

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom of the velocities: d n, minus one for every axis along which momentum is
        conserved; so d (n - 1) in a periodic box. Walls and obstacles take up momentum; a single component is
        free along all axes.
        """
        return degrees_of_freedom(self.scene)

    @property
    @looks
    def diameters(self) -> np.ndarray:
        """Diameter of each component at the present time, (n,) [length]."""
        return self.machine.diameters

    @property
    @looks
    def packing_fraction(self) -> float:
        """Fraction of the box that the components fill at the present time."""
        dimension, motion = self.scene.dimension, self.scene.motion
        if hasattr(motion, "packing_fraction"):
            return float(motion.packing_fraction(self.diameters, self.scene.box))
        volume = densities.sphere_volume(dimension) * float(np.sum(self.diameters**dimension))
        return volume / self.scene.volume

    @property
    @looks
    def pinned_impulse(self) -> np.ndarray:
        """Momentum that each pinned component received so far along the normals of its contacts, (n,); zero
        for moving components [mass length / time].

        Raises
        ------
        InputError
            If the scene has no pinned components.
        """
        return mechanics.pinned_impulse(self.machine)

    @property
    @looks
    def collisions_by_species(self) -> np.ndarray:
        """Pair collisions since the start of every pair of species, (K, K), symmetric.

        Raises
        ------
        InputError
            If the scene has no species.
        """
        return mechanics.collisions_by_species(self.machine)

    @property
    @looks
    def virial_by_species(self) -> np.ndarray:
        """Sum of ``r_ij . dp_ij`` since the start of every pair of species, (K, K), symmetric
        [mass length^2 / time].

        Raises
        ------
        InputError
            If the scene has no species.
        """
        return mechanics.virial_by_species(self.machine)

    @property
    @looks
    def obstacles(self) -> tuple[Impacts, ...]:
        """Hits and momentum of walls and obstacles since the start, in the order of their numbers: the walls
        of each axis without periodicity, lower before upper, then the scene's obstacles.
        """
        return mechanics.impacts(self.machine)

    @property
    @looks
    def spared_contacts(self) -> int:
        """Contacts that were elastic for they were slow (``elastic_below``) or soon (``contact_time``)."""
        spared = getattr(self.machine.engine.model.impact, "spared", None)
        return 0 if spared is None else int(spared[0])

    @property
    @looks
    def statistics(self) -> Statistics:
        """Counters of the run so far, and its numerical errors."""
        return mechanics.statistics(self.machine)

    @watchable("Running")
    def run(
        self,
        *,
        collisions: int | None = None,
        collisions_per_particle: float | None = None,
        time: float | None = None,
        walltime: float | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> Block:
        """Run until the first of the given limits is reached.

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
        progress : callable or True, optional
            Called from time to time with the fraction done; does not affect the trajectory. True shows a bar.

        Returns
        -------
        Block
            Duration, collisions and virial of this stretch.

        Raises
        ------
        InputError
            If no limit is given, or one is not a number of at least zero; or if a time cannot be reached,
            because growing components jam before it or have no room at all. The state is then that at which
            the run stopped.
        BusyError
            If another thread uses this simulation, or if this is called by a callback of a run.

        Warns
        -----
        CaromWarning
            If the requested collisions cannot happen: nothing moves, there is only one component, or there
            was no collision in a thousand mean free times.
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
            added = checks.collisions_of(collisions_per_particle, self.scene.n)
            collisions = added if collisions is None else min(collisions, added)
        end = None if time is None else self.machine.clock.instant + Fraction(float(time))
        return loop.advance(
            self.machine, None if collisions is None else int(collisions), end, walltime, progress
        )

    def rescale(self, kT: float = 1.0, *, growth: float | ArrayLike | None = None) -> None:
        """Scale all velocities to the temperature ``kT``; momentum that is conserved is set to zero.

        Meant for growing diameters: every contact adds energy, but only the ratio of growth rate and thermal
        speed matters. The events of all components are predicted again.

        Parameters
        ----------
        kT : float
            The new temperature [energy].
        growth : float or (n,) array_like, optional
            New growth rate of the diameters, if they grew before [length / time].

        Raises
        ------
        InputError
            If nothing moves, if ``growth`` is not positive or the diameters did not grow before, or if there
            is an event log, which holds collisions only.
        """
        kT = checks.number(kT, "kT", low=0.0, open_low=True)
        with self.machine.alone.changing():
            self._rescale(kT, growth)

    def _rescale(self, kT: float, growth: float | ArrayLike | None) -> None:
        if self.machine.log is not None:
            raise InputError(
                "After rescale() no state could be rebuilt from the event log: close() the log first."
            )
        rates = growth_rates(growth, self.scene)
        if growth is not None and (rates is None or self.machine.contents.rates is None):
            raise InputError(
                "rescale() changes one growth into another: give Simulation() a positive growth, too."
            )
        self.machine.refit(mechanics.at_temperature(self.frame().velocities, self.scene, kT), rates)

    @looks
    def frame(self) -> Frame:
        """Return all components at the present time; does not affect the trajectory."""
        return self.machine.frame()

    # Long enough for modules of their own.
    sample = sampling.sample
    measure = measuring.measure
    helfand = helfand.helfand
    free_flights = flying.free_flights

    def estimate(self, observable, blocks: Sequence[Block]):
        """Return the observable's estimate from blocks of this run, such as :meth:`blocks` yields."""
        if self.machine.contents.rates is not None and any(block.sizes is None for block in blocks):
            raise InputError("Sums since the start do not know how diameters grew; use blocks of run().")
        return observable.of_scene(blocks, self.scene, kT=self.kT)

    def blocks(self, duration: float, count: int) -> Iterator[Block]:
        """Continue the run for ``count`` blocks of equal time and yield each."""
        start, step = self.machine.clock.instant, Fraction(checks.number(duration, "duration", low=0.0))
        before = mechanics.momenta_at_walls(self.machine)
        for k in range(1, checks.integer(count, "count", low=0) + 1):
            block = loop.advance(self.machine, None, start + k * step)
            after = mechanics.momenta_at_walls(self.machine)
            momenta, surfaces = (
                tuple(b - a for a, b in zip(*pair, strict=True)) for pair in zip(before, after, strict=True)
            )
            yield block._replace(momentum_changes=momenta, surface_changes=surfaces)
            before = after

    def time_for(self, collisions: float) -> float:
        """Return the time that this number of pair collisions takes, from the rate so far.

        A run with fewer than 1000 collisions so far first runs a pilot of 1000.
        """
        collisions = checks.number(collisions, "collisions", low=0.0)
        if self.scene.n == 1 or self.machine.start.energy == 0.0:
            raise InputError("Nothing collides in this scene: give time= instead of a number of collisions.")
        if self.collisions < 1000:
            self.run(collisions=1000 - self.collisions)
        if self.collisions == 0:
            raise InputError("Nothing collides in this scene: give time= instead of a number of collisions.")
        return float(collisions) * self.time / self.collisions

    @looks
    def save(self, path: str | PathLike[str], **extra: Any) -> None:
        """Write a checkpoint: the continued run equals the uninterrupted one, bit for bit.

        Parameters
        ----------
        path : path
            An HDF5 file, replaced atomically.
        **extra
            Small values that JSON can hold, stored with it (e.g. what the caller was doing).
        """
        checkpoint.save(path, self.machine, extra)

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        *,
        event_log: str | PathLike[str] | None = None,
        obstacles: Sequence[Obstacle] | None = None,
        interaction: Interaction | None = None,
        motion: Motion | None = None,
        impact: Impact | None = None,
        workers: int | str = 1,
    ) -> Simulation:
        """Return the simulation that a checkpoint holds.

        Parameters
        ----------
        path : path
            A file that :meth:`save` wrote.
        event_log : path, optional
            Where the event log is now, if it was moved; events after the checkpoint are dropped.
        obstacles : sequence of obstacles, optional
            All obstacles of the scene, if one is of your own class, because a file holds no code.
        interaction, motion, impact : values, optional
            Those of the scene, if one is of your own class.
        workers : int or "auto"
            Threads, as for a new simulation; their number may differ from before.

        Raises
        ------
        FileError
            If the file is missing, truncated, foreign, or of another version of Carom, or if an obstacle of
            your own class is not given.
        """
        sim = cls.__new__(cls)
        own = {"interaction": interaction, "motion": motion, "impact": impact}
        sim._face(*checkpoint.load(path, event_log, obstacles, **own))
        sim.machine.team = team_of(sim.machine, workers)
        return sim

    def close(self) -> None:
        """Flush and close the event log, if there is one, and end the threads of several workers."""
        with self.machine.alone.changing():
            self.machine.close_log()
            if self.machine.team is not None:
                self.machine.team.close()

    def __reduce__(self) -> Any:
        """Refuse to be pickled or copied."""
        raise TypeError("A Simulation cannot be pickled or copied: save() it, and load() the file as often.")

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Simulation of {self.scene!r} at time {self.time:g}, {self.collisions} collisions>"
