"""A run as it is seen and continued: its state at the present time, and the stretches that follow."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks, densities
from carom.arithmetic import power
from carom.block import Block
from carom.errors import InputError
from carom.frame import Frame
from carom.models.copies import copied
from carom.notebook import watchable
from carom.scene.temperature import degrees_of_freedom
from carom.simulation import agents, energy, mechanics, pair_steps, run_loop, temperature
from carom.simulation.mechanics import Impacts, Statistics
from carom.simulation.run_guard import exclusive
from carom.simulation.run_state import RunState
from carom.simulation.system_of_scene import driven_speed_of

if TYPE_CHECKING:
    from carom.observables.steps import StepSums
    from carom.simulation.agents import UnitsNow


class Running:
    """What every run has, however it was made. :class:`carom.Simulation` makes, measures and saves runs."""

    def _attach(self, machine: RunState, notes: dict[str, Any]) -> None:
        # What moves is all in the machine; it is no part of the public interface.
        self.machine = machine
        self.scene = machine.scene
        self.notes = notes  # what the caller kept with the checkpoint this was loaded from

    @property
    @exclusive
    def time(self) -> float:
        """Time since the start [time], rounded to a double."""
        return float(self.machine.clock.instant)

    @property
    @exclusive
    def epoch_length(self) -> float:
        """Length of an epoch [time]: a power of two."""
        return self.machine.unit.to_scene(self.machine.scheme.epoch, 1)

    @property
    @exclusive
    def collisions(self) -> int:
        """Pair collisions since the start."""
        return self.machine.collisions

    @property
    @exclusive
    def tally(self) -> Block:
        """Duration, collisions and virial since the start; also the time integral of kT, where it changes."""
        record = self.machine.engine.tallies[0]
        virial = self.machine.unit.to_scene(float(record.virial), -1)
        return Block(self.time, int(record.collisions), virial, kT_time=temperature.kT_time(self.machine))

    @property
    @exclusive
    def seconds(self) -> float:
        """Wall time spent in the engine [s]."""
        return self.machine.seconds

    @property
    @exclusive
    def kT(self) -> float:
        """Temperature: twice the kinetic energy over the :attr:`degrees_of_freedom` [energy].

        The motion of the centre of mass is subtracted along every axis on which momentum is conserved.
        """
        return temperature.temperature(self.machine)

    @property
    @exclusive
    def kT_rotational(self) -> float:
        """Temperature of the spins of rough particles: twice their energy over the number of spins [energy].

        Raises
        ------
        InputError
            If the particles are smooth (``carom.models.Rough``).
        """
        return mechanics.kT_rotational(self.machine)

    @property
    @exclusive
    def potential_energy(self) -> float:
        """Potential energy now, of all pairs on steps and of all components in a field [energy].

        Its mean with an error bar is :class:`carom.observables.PotentialEnergy`.

        Raises
        ------
        InputError
            If there is none, or crossings of the box along the field were not counted (``images=False``).
        """
        return energy.potential_energy(self.machine)

    @property
    @exclusive
    def steps(self) -> StepSums:
        """Events at the ends of every step since the start, by kind, and the pairs that are on it now.

        Raises
        ------
        InputError
            If pairs have no steps.
        """
        return pair_steps.step_sums(self.machine)

    @property
    @exclusive
    def units(self) -> UnitsNow:
        """Present kinds, counters, memory and timers of units that decide by rules (``docs/range-rules``).

        Raises
        ------
        InputError
            If the scene has no such units.
        """
        return agents.present(self.machine)

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom of the velocities: d (n - 1) in a periodic box.

        They are d n, minus one for every axis along which momentum is conserved. Walls and obstacles take up
        momentum. A single component is free along all axes, and a pinned one along none. On great circles
        they are n (d - 1).
        """
        return degrees_of_freedom(self.scene)

    @property
    @exclusive
    def diameters(self) -> np.ndarray:
        """Diameter of each component at the present time, (n,) [length]."""
        return self.machine.diameters

    @property
    @exclusive
    def packing_fraction(self) -> float:
        """Fraction of the box that the components fill at the present time."""
        dimension, motion = self.scene.dimension, self.scene.motion
        if hasattr(motion, "packing_fraction"):
            return float(motion.packing_fraction(self.diameters, self.scene.box))
        volume = densities.sphere_volume(dimension) * float(np.sum(power(self.diameters, dimension)))
        return volume / self.scene.volume

    @property
    @exclusive
    def pinned_impulse(self) -> np.ndarray:
        """Momentum that each pinned component received so far, (n,) [mass length / time].

        It is the sum over the component's contacts, each along its normal. It is zero for moving components.

        Raises
        ------
        InputError
            If the scene has no pinned components.
        """
        return mechanics.pinned_impulse(self.machine)

    @property
    @exclusive
    def collisions_by_species(self) -> np.ndarray:
        """Pair collisions of every pair of species since the start, (K, K), symmetric.

        Raises
        ------
        InputError
            If the scene has no species.
        """
        return mechanics.collisions_by_species(self.machine)

    @property
    @exclusive
    def virial_by_species(self) -> np.ndarray:
        """Sum of ``r_ij . dp_ij`` of every pair of species since the start [mass length^2 / time].

        It is a (K, K) array, symmetric.

        Raises
        ------
        InputError
            If the scene has no species.
        """
        return mechanics.virial_by_species(self.machine)

    @property
    @exclusive
    def obstacles(self) -> tuple[Impacts, ...]:
        """Hits and momentum of each wall and obstacle since the start, in the order of their numbers.

        The walls of each axis without periodicity come first, lower before upper, then the scene's obstacles.
        Nothing hits a wall for which an obstacle stands.
        """
        return mechanics.impacts(self.machine)

    @property
    @exclusive
    def observers(self) -> tuple[Any, ...]:
        """Observers of your own, with copies of what they have added up since the start."""
        return tuple(map(copied, self.machine.system.observers))

    @property
    @exclusive
    def drive(self) -> Any:
        """The model of what kicks single components, with a copy of its memory now; None without a drive."""
        timers = self.machine.engine.model.timers
        return None if timers is None else copied(timers.drive)

    @property
    @exclusive
    def spared_contacts(self) -> int:
        """Contacts of two components that lost nothing: too slow, or too soon after the last contact."""
        spared = getattr(self.machine.engine.model.impact, "spared", None)
        return 0 if spared is None else int(spared[0])

    @property
    @exclusive
    def statistics(self) -> Statistics:
        """Counters and numerical errors of the run so far."""
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
            Pair collisions to add, a whole number.
        collisions_per_particle : float, optional
            The same per component: every collision counts for two components.
        time : float, optional
            Time to add [time]; the run then ends exactly there.
        walltime : float, optional
            Seconds of wall time, without those of compiling.
        progress : callable or True, optional
            Called from time to time with the fraction done; does not affect the trajectory. True shows a bar.

        Returns
        -------
        Block
            Duration, collisions and virial of this stretch.

        Raises
        ------
        InputError
            If no limit is given, or one is not a number of at least zero. Also if a time cannot be reached,
            because growing components jam before it or have no room at all; the state is then that at which
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
        if collisions is not None and collisions % 1 != 0:
            raise InputError(f"collisions must be a whole number, found {checks.describe(collisions)}.")
        if all(value is None for value in limits.values()):
            raise InputError(f"run() needs a limit: one of {', '.join(limits)}.")
        if collisions_per_particle is not None:
            added = checks.collisions_of(collisions_per_particle, self.scene.n)
            collisions = added if collisions is None else min(collisions, added)
        end = None if time is None else self.machine.clock.instant + Fraction(float(time))
        return run_loop.advance(
            self.machine, None if collisions is None else int(collisions), end, walltime, progress
        )

    @exclusive
    def frame(self) -> Frame:
        """Return all components at the present time; does not affect the trajectory."""
        return self.machine.frame()

    def estimate(self, observable, blocks: Sequence[Block]):
        """Return the estimate of an ``observable`` from ``blocks``, such as :meth:`blocks` yields.

        Raises
        ------
        InputError
            If diameters grow and a block does not hold their averages, as :attr:`tally`.
        """
        if self.machine.system.rates is not None and any(block.sizes is None for block in blocks):
            raise InputError("Sums since the start do not know how diameters grew; use blocks of run().")
        return observable.of_scene(blocks, self.scene, kT=self.kT)

    def blocks(self, duration: float, count: int) -> Iterator[Block]:
        """Continue the run for ``count`` blocks of the time ``duration`` [time] and yield each.

        Raises
        ------
        InputError
            If the duration or the count is negative, and as from :meth:`run`.
        """
        start, step = self.machine.clock.instant, Fraction(checks.number(duration, "duration", low=0.0))
        before, energy_before = mechanics.momenta_at_walls(self.machine), energy.now(self.machine)
        for k in range(1, checks.integer(count, "count", low=0) + 1):
            block = run_loop.advance(self.machine, None, start + k * step)
            after = mechanics.momenta_at_walls(self.machine)
            momenta, surfaces = (
                tuple(b - a for a, b in zip(*pair, strict=True)) for pair in zip(before, after, strict=True)
            )
            energy_after = energy.now(self.machine)
            means = energy.mean(energy_before, energy_after, block, self.degrees_of_freedom)
            yield block._replace(momentum_changes=momenta, surface_changes=surfaces, energy=means)
            before, energy_before = after, energy_after

    def time_for(self, collisions: float) -> float:
        """Return the time that a number of pair collisions takes at the rate so far [time].

        With fewer than 1000 collisions so far, the run first continues up to 1000.

        Raises
        ------
        InputError
            If nothing collides in this scene.
        """
        collisions = checks.number(collisions, "collisions", low=0.0)
        if self.scene.n == 1 or self._rests():
            raise InputError("Nothing collides in this scene: give time= instead of a number of collisions.")
        if self.collisions < 1000:
            self.run(collisions=1000 - self.collisions)
        if self.collisions == 0:
            raise InputError("Nothing collides in this scene: give time= instead of a number of collisions.")
        return float(collisions) * self.time / self.collisions

    def _rests(self) -> bool:
        """Tell whether nothing moves, and no field, obstacle, growth or rule will change that."""
        machine = self.machine
        starts = machine.system.rates is not None or machine.engine.model.rules is not None
        starts = starts or self.scene.drive is not None or driven_speed_of(self.scene) > 0.0
        return machine.start.energy == 0.0 and self.collisions == 0 and not starts
