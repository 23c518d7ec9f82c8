"""A simulation: a scene set in motion. Compile, run, sample, measure, checkpoint, resume."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from carom import checks
from carom.errors import InputError
from carom.scene.scene import Scene
from carom.scene.temperature import at_temperature
from carom.scene.velocities import velocities_of
from carom.simulation import checkpoint, equilibration, flying, helfand, measuring, own_observers, sampling
from carom.simulation.mechanics import Impacts, Statistics
from carom.simulation.recorder import Recorder
from carom.simulation.run_guard import exclusive
from carom.simulation.run_state import RunState, requested_of
from carom.simulation.running import Running
from carom.simulation.system_of_scene import growth_rates, prepare
from carom.simulation.workers.choose_workers import executive_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.models.drives import Drive
    from carom.models.questions.contact import Impact
    from carom.models.questions.interaction import Interaction
    from carom.models.questions.motion import Motion
    from carom.models.questions.obstacle import Obstacle

__all__ = ["Impacts", "Simulation", "Statistics"]


class Simulation(Running):
    """Event-driven dynamics of a scene.

    Parameters
    ----------
    scene : Scene
        What is simulated.
    kT : float, optional
        Temperature of the Maxwell velocities that are drawn for a scene without velocities; by default 1.
    seed : int
        Seed of those velocities, independent of places drawn with the same one. The same scene, seed and
        version give the same bits.
    neighbors : {"auto", "lists", "sectors", "all"}
        Neighbour scheme; changes the speed, not the physics.
    shell : float, optional
        Reach of the neighbour lists in diameters. It asks for lists; by default it follows from the density.
    images : bool
        Count the boxes that each component crosses, for unwrapped positions.
    precision : {"double", "single"}
        Precision in which positions, velocities and times are stored. All computations are in double
        precision. Single precision saves a fifth of the memory but no time, and leaves overlaps of 1e-7 of
        the box. It is refused for boxes of more than 8192 diameters, very near close packing, and for fast
        drifts.
    growth : float or (n,) array_like, optional
        Rate at which the diameters grow [length / time], as in the paper's sec. 8. A contact is then elastic
        in the frame of the surfaces, so that the energy grows, too; see :meth:`rescale`.
    event_log : path, optional
        Write every collision to this HDF5 file (see ``docs/files``); in double precision only.
    currents : bool
        Add up the currents of momentum and heat, for :meth:`helfand`.
    flights : bool
        Keep histograms of free flights and of normal speeds, for :meth:`free_flights`. It needs straight
        flight and obstacles at rest.
    observers : sequence of observers
        Observers of your own, which add up something of every event (``docs/models``). They need one worker.
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
    >>> sim = carom.Simulation(carom.Scene.crystal(108, 0.3), seed=1)
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
        observers: Sequence[Any] = (),
        workers: int | str = 1,
    ):
        if not isinstance(scene, Scene):
            raise InputError(f"A simulation needs a Scene, found {checks.describe(scene)}.")
        requested = requested_of(neighbors, shell)
        if scene.velocities is None:
            velocities = velocities_of(scene, 1.0 if kT is None else kT, seed)
        elif kT is None:
            velocities = scene.velocities
        else:
            raise InputError("The scene has velocities and kT is given too: leave out one of them.")
        system = prepare(scene, velocities, growth=growth, precision=precision, images=images)
        if system.rates is not None and event_log is not None:
            raise InputError(
                "An event log holds one diameter a component, but growth is given: leave out one."
            )
        if currents:
            helfand.check(system)
            system = dataclasses.replace(system, currents=True)
        if flights:
            flying.check(system)
            system = dataclasses.replace(system, flights=True)
        if observers:
            own = own_observers.checked(observers, scene, system)
            system = dataclasses.replace(system, observers=own)
        self._attach(RunState(scene, velocities, system, requested), {})
        self.machine.executive = executive_of(self.machine, workers)
        self.machine.schedule()
        if event_log is not None:
            self.machine.log = Recorder(event_log, self.machine)

    def rescale(self, kT: float = 1.0, *, growth: float | ArrayLike | None = None) -> None:
        """Scale all velocities to the temperature ``kT``; momentum that is conserved is set to zero.

        It is meant for growing diameters. Every contact then adds energy, but only the ratio of growth rate
        to thermal speed matters. The events of all components are predicted again.

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
        if growth is not None and (rates is None or self.machine.system.rates is None):
            raise InputError(
                "rescale() changes one growth into another: give Simulation() a positive growth, too."
            )
        self.machine.refit(at_temperature(self.scene, self.frame().velocities, kT), rates)

    # Long enough for modules of their own.
    equilibrate = equilibration.equilibrate
    sample = sampling.sample
    write = sampling.write
    measure = measuring.measure
    helfand = helfand.helfand
    free_flights = flying.free_flights

    @exclusive
    def save(self, path: str | PathLike[str], **extra: Any) -> None:
        """Write a checkpoint: the continued run equals the uninterrupted one, bit for bit.

        Parameters
        ----------
        path : path
            An HDF5 file, replaced atomically.
        **extra
            Small values that JSON can hold, such as notes of the caller; stored with the checkpoint.

        Raises
        ------
        FileError
            If the file cannot be written.
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
        drive: Drive | None = None,
        observers: Sequence[Any] = (),
        workers: int | str = 1,
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
        workers : int or "auto"
            Threads, as for a new simulation; their number may differ from before.

        Raises
        ------
        FileError
            If the file is missing, truncated, foreign, or of another version of Carom, or if an obstacle of
            your own class is not given.
        """
        sim = cls.__new__(cls)
        own = {"interaction": interaction, "motion": motion, "impact": impact, "drive": drive}
        sim._attach(*checkpoint.load(path, event_log, obstacles, observers, **own))
        sim.machine.executive = executive_of(sim.machine, workers)
        return sim

    def close(self) -> None:
        """Flush and close the event log, if there is one, and end the threads of several workers."""
        with self.machine.alone.changing():
            self.machine.close_log()
            if self.machine.executive is not None:
                self.machine.executive.close()

    def __reduce__(self) -> Any:
        """Refuse to be pickled or copied."""
        raise TypeError("A Simulation cannot be pickled or copied: save() it, and load() the file as often.")

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Simulation of {self.scene!r} at time {self.time:g}, {self.collisions} collisions>"
