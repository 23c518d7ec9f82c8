"""A simulation: a scene set in motion. Compile, run, sample, measure, checkpoint, resume."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks, densities
from carom.arithmetic import power
from carom.errors import InputError
from carom.frame import Frame
from carom.models.interfaces.memory import copied
from carom.scene.fields import standing
from carom.scene.keywords import ELSEWHERE
from carom.scene.scene import Scene
from carom.scene.velocities import at_temperature, degrees_of_freedom, velocities_of
from carom.simulation import own_observers, running
from carom.simulation.files import checkpoint
from carom.simulation.files.recorder import Recorder
from carom.simulation.measuring import equilibration, helfand, measure, mechanics, readings, sampling
from carom.simulation.measuring.mechanics import Impacts, Statistics
from carom.simulation.moves.barostat import checked_barostat
from carom.simulation.moves.oscillation import refuse_oscillation
from carom.simulation.moves.swaps import checked_swaps
from carom.simulation.run_guard import exclusive
from carom.simulation.run_loop import warn_of_haste
from carom.simulation.run_state import RunState
from carom.simulation.system_of_scene import growth_rates, prepare
from carom.simulation.tuning import DEFAULT, TUNED, Tuning
from carom.simulation.workers.choose_workers import executive_of
from carom.suggestions import corrected, nearest
from carom.texts import counted

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.models.drives import Drive
    from carom.models.interfaces.contact import Impact
    from carom.models.interfaces.interaction import Interaction
    from carom.models.interfaces.motion import Motion
    from carom.models.interfaces.obstacle import Obstacle
    from carom.simulation.moves.barostat import Barostat
    from carom.simulation.moves.swaps import Swaps

__all__ = ["Impacts", "Simulation", "Statistics"]

MEANT = {
    **dict.fromkeys(("pressure", "Z", "compressibility_factor"), "sim.measure(carom.Pressure())"),
    "rdf": "carom.RDF().over(sim.sample(every=..., count=...))",
    "temperature": "sim.kT",
    "box": "sim.scene.box",
    "step": "sim.run(...)",
}
"""What to write for what is no attribute."""


class Simulation:
    """Event-driven dynamics of a scene.

    Parameters
    ----------
    scene : Scene
        What is simulated.
    kT : float, optional
        Temperature of the Maxwell velocities that are drawn for a scene without velocities; by default 1.
    seed : int or numpy.random.Generator
        Source of those velocities, independent of places drawn with the same seed. The same scene, seed and
        version give the same bits.
    growth : float or (n,) array_like, optional
        Rate at which the diameters grow [length / time], as in the paper's sec. 9. A contact is then elastic
        in the frame of the surfaces, so that the energy grows, too; see :meth:`rescale`.
    swaps : Swaps, optional
        Pairs of particles exchange their diameters between events (``docs/driven``), on one core.
    barostat : Barostat, optional
        Constant pressure: the volume of the box changes between events (``docs/measuring``), on one core.
    event_log : path, optional
        Write every collision to this HDF5 file (see ``docs/layouts``); in double precision only.
    observers : sequence of observers
        Observers of your own, which add up something of every event (``docs/models``). They need one core.
        For :meth:`helfand` also :class:`carom.observables.HelfandCurrents`.
    cores : int or "auto"
        Cores that run this one system together. The bits are those of one core (``docs/studies``). "auto"
        takes two where this was measured to be faster: large systems in the plane.
    tuning : Tuning
        What changes the speed or the memory, and not the physics.

    Raises
    ------
    InputError
        If the scene has velocities and ``kT`` is given too, or a parameter is out of range; or if several
        cores are requested for a scene that allows only one.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.crystal(108, 0.3), seed=1)
    >>> block = sim.run(collisions_per_particle=10)
    >>> block.collisions
    540
    """

    @corrected(TUNED, ELSEWHERE)
    def __init__(
        self,
        scene: Scene,
        *,
        kT: float | None = None,
        seed: int | np.random.Generator = 1,
        growth: float | ArrayLike | None = None,
        swaps: Swaps | None = None,
        barostat: Barostat | None = None,
        event_log: str | PathLike[str] | None = None,
        observers: Sequence[Any] = (),
        cores: int | str = 1,
        tuning: Tuning = DEFAULT,
    ):
        if not isinstance(scene, Scene):
            raise InputError(f"A simulation needs a Scene, found {checks.describe(scene)}.")
        if not isinstance(tuning, Tuning):
            raise InputError(f"tuning must be carom.Tuning(...), found {checks.describe(tuning)}.")
        if scene.velocities is None:
            velocities = velocities_of(scene, 1.0 if kT is None else kT, seed)
        elif kT is None:
            velocities = scene.velocities
        else:
            raise InputError("The scene has velocities and kT is given too: leave out one of them.")
        observers, currents = helfand.taken_out(observers)
        system = prepare(scene, velocities, growth=growth, tuning=tuning, currents=currents)
        if system.rates is not None and event_log is not None:
            raise InputError(
                "An event log holds one diameter a particle, but growth is given: leave out one."
            )
        if event_log is not None:
            refuse_oscillation(scene, "An event log", "leave one of the two out")
        sweeps = checked_swaps(swaps, scene, system, event_log)
        others = {"swaps": sweeps, "observers": observers or currents, "an event log": event_log}
        volume_moves = checked_barostat(barostat, scene, system, velocities, **others)
        if currents:
            helfand.check(system)
        state = RunState(scene, velocities, system, tuning.requested)
        state.sweeps, state.volume_moves = sweeps, volume_moves
        if observers:
            state.let_in(own_observers.checked(observers, scene, system))
        state.executive = executive_of(state, cores)
        state.schedule()
        warn_of_haste(state)
        if event_log is not None:
            state.begin_log(Recorder(event_log, state))
        self._state = state  # all that moves

    @property
    def scene(self) -> Scene:
        """What is simulated, as it was at the start, or with a barostat at the last change of the box."""
        return self._state.scene

    @property
    def n(self) -> int:
        """Number of particles."""
        return self.scene.n

    @property
    def positions(self) -> np.ndarray:
        """Positions in the box at the present time, (n, d) [length]."""
        return self.frame().positions

    @property
    def velocities(self) -> np.ndarray:
        """Velocities at the present time, (n, d) [length / time]."""
        return self.frame().velocities

    @property
    @exclusive
    def time(self) -> float:
        """Time since the start [time], rounded to a double."""
        return float(self._state.clock.instant)

    @property
    @exclusive
    def collisions(self) -> int:
        """Pair collisions since the start."""
        return self._state.collisions

    @property
    @exclusive
    def kT(self) -> float:
        """Temperature: twice the kinetic energy over the :attr:`degrees_of_freedom` [energy].

        The motion of the center of mass is subtracted along every axis on which momentum is conserved.
        """
        return readings.kT(self._state)

    @property
    @exclusive
    def kT_rotational(self) -> float:
        """Temperature of the spins of rough particles: twice their energy over the number of spins [energy].

        Raises
        ------
        InputError
            If the particles are smooth (``carom.models.Rough``).
        """
        return mechanics.kT_rotational(self._state)

    @property
    @exclusive
    def potential_energy(self) -> float:
        """Potential energy now, of all pairs on steps and of all particles in a field [energy].

        Its mean with an error bar is :class:`carom.Energy`.

        Raises
        ------
        InputError
            If there is none, or crossings of the box along the field were not counted (``images=False``).
        """
        return readings.potential_energy(self._state)

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom of the velocities: d (n - 1) in a periodic box.

        They are d n, minus one for every axis along which momentum is conserved. Walls and obstacles take up
        momentum. A single particle is free along all axes, and a pinned one along none. On great circles
        they are n (d - 1).
        """
        return degrees_of_freedom(self.scene)

    @property
    @exclusive
    def diameters(self) -> np.ndarray:
        """Diameter of each particle at the present time, (n,) [length]."""
        return self._state.diameters

    @property
    @exclusive
    def packing_fraction(self) -> float:
        """Fraction of the box that the particles fill at the present time."""
        dimension, motion = self.scene.dimension, self.scene.motion
        if hasattr(motion, "packing_fraction"):
            return float(motion.packing_fraction(self.diameters, self.scene.box))
        volume = densities.sphere_volume(dimension) * float(np.sum(power(self.diameters, dimension)))
        return volume / self.scene.volume

    @property
    @exclusive
    def pinned_impulse(self) -> np.ndarray:
        """Momentum that each pinned particle received so far, (n,) [mass length / time].

        It is the sum over the particle's contacts, each along its normal. It is zero for moving particles.

        Raises
        ------
        InputError
            If the scene has no pinned particles.
        """
        return mechanics.pinned_impulse(self._state)

    @property
    @exclusive
    def collisions_by_species(self) -> np.ndarray:
        """Pair collisions of every pair of species since the start, (K, K), symmetric.

        Raises
        ------
        InputError
            If the scene has no species.
        """
        return mechanics.collisions_by_species(self._state)

    @property
    @exclusive
    def obstacles(self) -> tuple[Impacts, ...]:
        """Hits and momentum of each wall and obstacle since the start, in the order of their numbers.

        The walls of each axis without periodicity come first, lower before upper, then the scene's obstacles.
        Nothing hits a wall for which an obstacle stands.
        """
        return mechanics.impacts(self._state)

    @property
    @exclusive
    def observers(self) -> tuple[Any, ...]:
        """Observers of your own, with copies of what they have added up since the start."""
        return tuple(map(copied, self._state.system.observers))

    @property
    @exclusive
    def interaction(self) -> Any:
        """What the interaction has added up, or remembers now; None for hard cores.

        Of pairs on steps: a ``StepSums`` with the events at the ends of every step since the start, by kind,
        and the pairs that are on it now. Of particles that follow rules: their present kinds, counters,
        memory and timers (``docs/range-rules``).
        """
        if self._state.engine.model.rules is not None:
            return readings.units_now(self._state)
        return readings.step_sums(self._state) if self._state.system.stepped else None

    @property
    @exclusive
    def drive(self) -> Any:
        """The model of what kicks single particles, with a copy of its memory now; None without a drive."""
        timers = self._state.engine.model.timers
        return None if timers is None else copied(timers.drive)

    @property
    @exclusive
    def statistics(self) -> Statistics:
        """Counters and numerical errors of the run so far."""
        return mechanics.statistics(self._state)

    @exclusive
    def frame(self) -> Frame:
        """Return all particles at the present time; does not affect the trajectory."""
        return self._state.frame()

    def view(self, path: str | PathLike[str] | None = None) -> Any:
        """Return a page that shows the particles in a browser: ``carom.view`` of this simulation.

        Parameters
        ----------
        path : path, optional
            Where to write the page.

        Raises
        ------
        InputError
            In more than three dimensions.
        FileError
            If the file cannot be written.
        """
        from carom.drawing.page import shown

        return shown([self.frame()], path, obstacles=standing(self.scene))

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Return a picture of the particles and obstacles at the present time, a Matplotlib figure.

        Parameters
        ----------
        path : path, optional
            Where to save the picture; the suffix is the format (png, pdf, svg).

        Raises
        ------
        FileError
            If the picture cannot be saved.
        """
        from carom.drawing.particles import snapshot

        return snapshot(self.frame(), obstacles=standing(self.scene), path=path)

    def explain(self) -> Any:
        """Return what this run consists of: models, arrays, the neighbor scheme and the reason for it.

        ``print`` shows it as a page.
        """
        from carom.simulation.explanation import explain

        return explain(self)

    def rescale(self, kT: float = 1.0, *, growth: float | ArrayLike | None = None) -> None:
        """Scale all velocities to the temperature ``kT``; momentum that is conserved is set to zero.

        It is meant for growing diameters. Every contact then adds energy, but only the ratio of growth rate
        to thermal speed matters. The events of all particles are predicted again.

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
        with self._state.alone.changing():
            self._rescale(kT, growth)

    def _rescale(self, kT: float, growth: float | ArrayLike | None) -> None:
        if self._state.log is not None:
            raise InputError(
                "After rescale() no state could be rebuilt from the event log: close() the log first."
            )
        rates = growth_rates(growth, self.scene)
        if growth is not None and (rates is None or self._state.system.rates is None):
            raise InputError(
                "rescale() changes one growth into another: give Simulation() a positive growth, too."
            )
        self._state.refit(at_temperature(self.scene, self.frame().velocities, kT), rates)

    # Long enough for modules of their own.
    run = running.run
    equilibrate = equilibration.equilibrate
    sample = corrected()(sampling.sample)
    write = corrected()(sampling.write)
    measure = corrected()(measure.measure)
    helfand = helfand.helfand

    def save(self, path: str | PathLike[str]) -> None:
        """Write a checkpoint: the continued run equals the uninterrupted one, bit for bit.

        Parameters
        ----------
        path : path
            An HDF5 file, replaced atomically.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        checkpoint.save(path, self._state, {})

    @classmethod
    @corrected()
    def load(
        cls,
        path: str | PathLike[str],
        *,
        event_log: str | PathLike[str] | None = None,
        obstacles: Sequence[Obstacle] | None = None,
        interaction: Interaction | None = None,
        motion: Motion | None = None,
        impact: Impact | None = None,
        drive: Drive | None = None,
        observers: Sequence[Any] = (),
        cores: int | str = 1,
    ) -> Simulation:
        """Return the simulation that a checkpoint holds.

        Parameters
        ----------
        path : path
            A file that :meth:`save` wrote.
        event_log : path, optional
            Where the event log is now, if it was moved. Events after the checkpoint are dropped when the
            loaded run has gone on and writes; until then the file is only read.
        obstacles : sequence of obstacles, optional
            All obstacles of the scene, if one is of your own class, because a file holds no code.
        interaction, motion, impact, drive : values, optional
            Those of the scene, if one is of your own class.
        observers : sequence of observers
            The observers that the run was made with; what they had added up is taken from the file.
        cores : int or "auto"
            As for a new simulation; their number may differ from before.

        Raises
        ------
        FileError
            If the file is missing, truncated, foreign, or of another version of Carom, or if an obstacle of
            your own class is not given.
        """
        sim = cls.__new__(cls)
        user_models = {"interaction": interaction, "motion": motion, "impact": impact, "drive": drive}
        sim._state = checkpoint.load(path, event_log, obstacles, observers, **user_models)
        sim._state.executive = executive_of(sim._state, cores)
        return sim

    def close(self) -> None:
        """Flush and close the event log, if there is one, and end the threads of several cores."""
        with self._state.alone.changing():
            self._state.close_log()
            if self._state.executive is not None:
                self._state.executive.close()

    if not TYPE_CHECKING:

        def __getattr__(self, name):
            alike = None if name.startswith("_") else nearest(name, dir(type(self)))
            hint = MEANT.get(name, f"sim.{alike}" if alike else "")
            said = f"a simulation has no attribute {name!r}" + f"; take {hint}" * bool(hint)
            raise AttributeError(said, name=name, obj=self)

    def __reduce__(self) -> Any:
        """Refuse to be pickled or copied."""
        raise TypeError("A Simulation cannot be pickled or copied: save() it, and load() the file as often.")

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return (
            f"<Simulation of {self.scene!r} at time {self.time:g}, {counted(self.collisions, 'collision')}>"
        )
