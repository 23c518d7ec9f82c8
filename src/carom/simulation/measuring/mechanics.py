"""Energy, momentum and impulses of a run, and how well they were kept."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carom.arithmetic import power
from carom.block import Block, Sizes
from carom.densities import sphere_volume
from carom.errors import InputError
from carom.models.interfaces.particles import species_count
from carom.models.motions.shear import Shear
from carom.scene.velocities import conserved, kept_by_motion
from carom.simulation.measuring.invariants import EnergyMomentum
from carom.simulation.measuring.readings import energy_of_first_steps, energy_of_steps, kT_time, momentum_flux
from carom.simulation.moves.barostat import volume_sums
from carom.simulation.run_state import spins_of
from carom.table import in_html as table

if TYPE_CHECKING:
    from carom.scene.scene import Scene
    from carom.simulation.run_state import RunState


@dataclass(frozen=True)
class Statistics:
    """Counters of a run, and its numerical errors.

    Attributes
    ----------
    collisions : int
        Pair collisions, each counted once.
    transits : int
        Sector crossings, or renewals of a neighbor list.
    advancements : int
        Events that lost their partner to a third party.
    advancement_fraction : float
        Advancements over all processed events. A collision counts as two events (the paper's sec. 10).
    third_party_first : int
        Pairs that scheduled each other again right after colliding: the paper's m* = i*.
    clamped_roots : int
        Negative times until contact replaced by zero.
    spared_contacts : int
        Contacts of two particles that lost nothing: too slow, or too soon after the last contact.
    seconds : float
        Wall time spent in the engine [s].
    collisions_per_second : float
        Pair collisions per second of that time.
    worst_overlap : float
        Deepest overlap, in diameters. It is that of two cores at a collision. If it exceeds rounding, it is
        that of any two, or with a wall or an obstacle: now, or where a run or a sample ended (of many ends,
        64 are looked at). A collision that was lost shows here only.
    energy_drift : float
        Change of the energy, kinetic and potential, since the start, relative to the kinetic one. What
        inelastic contacts lost, and growth and ``rescale()`` added, is included.
    momentum_drift : float
        Change of the momentum since the start, relative to ``sum(m |v|)``; NaN where walls, obstacles or the
        motion change it. What ``rescale()`` took away is included, the exact change by a shear is not.
    swaps_tried, swaps_accepted : int
        Pairs whose diameters were to be exchanged, and those where there was room for it.
    volume_moves_tried, volume_moves_accepted : int
        Changes of the volume that a barostat tried, and those that were accepted.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(64, 0.3, 2))
    >>> block = sim.run(collisions=500)
    >>> sim.statistics.collisions, sim.statistics.energy_drift < 1e-12
    (500, True)
    """

    collisions: int
    transits: int
    advancements: int
    advancement_fraction: float
    third_party_first: int
    clamped_roots: int
    spared_contacts: int
    seconds: float
    collisions_per_second: float
    worst_overlap: float
    energy_drift: float
    momentum_drift: float
    swaps_tried: int = 0
    swaps_accepted: int = 0
    volume_moves_tried: int = 0
    volume_moves_accepted: int = 0

    def __str__(self) -> str:
        return "\n".join(f"{name:<21}  {value}" for name, value in self._rows())

    def _repr_html_(self) -> str:
        return table("Statistics", self._rows())

    def _rows(self) -> list[tuple[str, str]]:
        tried, moves = self.swaps_tried, self.volume_moves_tried
        drifts = {"energy drift": self.energy_drift, "momentum drift": self.momentum_drift}
        return [
            ("collisions", str(self.collisions)),
            ("per second", f"{self.collisions_per_second:.3g}"),
            ("transits", str(self.transits)),
            (
                "advancements",
                f"{self.advancements} ({100.0 * self.advancement_fraction:.1f} % of all events)",
            ),
            ("third party first", str(self.third_party_first)),
            ("clamped roots", str(self.clamped_roots)),
            ("worst overlap", f"{self.worst_overlap:.1e} diameters"),
            *((name, f"{drift:.1e}") for name, drift in drifts.items() if math.isfinite(drift)),
            *([("swaps accepted", f"{self.swaps_accepted} of {tried}")] if tried else []),
            *([("volume moves", f"{self.volume_moves_accepted} of {moves}")] if moves else []),
        ]


class Impacts(NamedTuple):
    """What a wall or an obstacle took up.

    Attributes
    ----------
    name : str
        Name of the wall or obstacle.
    hits : int
        Collisions with it.
    impulse : float
        Sum of the momentum along its normal [mass length / time]. Divided by time and area it is a pressure.
    work : float
        Energy that it gave to particles: by its motion or temperature, less what contacts lost [energy].
    spared : int
        Contacts that lost nothing, because they were slow or came too soon.
    lifted : int
        Contacts after which a particle left faster than the contact law says, because it would rest.
    """

    name: str
    hits: int
    impulse: float
    work: float = 0.0
    spared: int = 0
    lifted: int = 0


def statistics(run_state: RunState) -> Statistics:
    """Return what the run did so far, and how well."""
    tally = run_state.engine.tallies[0]
    at_collisions = 1.0 - 1.0 / math.sqrt(tally.depth) if tally.depth > 1.0 else 0.0
    start, present = (
        run_state.start,
        EnergyMomentum.of(run_state.scene.masses, run_state.speeds, run_state.unit),
    )
    events = 2 * tally.collisions + tally.advancements + tally.transits
    exchanges_momentum = run_state.engine.model.obstacles is not None or run_state.scene.pinned is not None
    exchanges_momentum |= run_state.engine.model.rules is not None or run_state.scene.drive is not None
    exchanges_momentum |= not all(kept_by_motion(run_state.scene))
    motion, stage = run_state.scene.motion, run_state.oscillation.done if run_state.oscillation else 0
    strain = motion.strain(float(run_state.clock.instant), stage) if isinstance(motion, Shear) else 0.0
    elastic_contacts = getattr(run_state.engine.model.impact, "spared", None)
    return Statistics(
        collisions=int(tally.collisions),
        transits=int(tally.transits),
        advancements=int(tally.advancements),
        advancement_fraction=float(tally.advancements / events) if events else 0.0,
        third_party_first=int(tally.returns),
        clamped_roots=int(tally.clamped),
        spared_contacts=0 if elastic_contacts is None else int(elastic_contacts[0]),
        seconds=run_state.seconds,
        collisions_per_second=float(tally.collisions / run_state.seconds) if run_state.seconds else 0.0,
        worst_overlap=max(at_collisions, run_state.depths.look(run_state)),
        energy_drift=_energy_drift(run_state, present),
        momentum_drift=math.nan if exchanges_momentum else present.momentum_drift(start, strain),
        swaps_tried=0 if run_state.sweeps is None else run_state.sweeps.tried,
        swaps_accepted=0 if run_state.sweeps is None else run_state.sweeps.accepted,
        volume_moves_tried=0 if run_state.volume_moves is None else run_state.volume_moves.tried,
        volume_moves_accepted=0 if run_state.volume_moves is None else run_state.volume_moves.accepted,
    )


def _energy_drift(run_state: RunState, present: EnergyMomentum) -> float:
    """Return the relative change of the energy since the start, with that in a field.

    Steps of pairs count as a change. NaN where crossings are not counted, rules or a drive change velocities,
    or the stream does work at a rate that oscillates.
    """
    changed = (run_state.engine.model.rules, run_state.scene.drive, run_state.oscillation)
    if any(each is not None for each in changed):
        return math.nan
    scene, before, after = run_state.scene, run_state.start.energy, present.energy
    flux = momentum_flux(run_state)
    if flux is not None and isinstance(scene.motion, Shear):
        if all(conserved(scene)):  # the flux is about the center of mass
            twice_mass = 2.0 * float(scene.masses.sum())
            before -= math.fsum(run_state.start.momentum**2) / twice_mass
            after -= math.fsum(present.momentum**2) / twice_mass
        # Less what the stream did: momentum along axis 0 that passed along axis 1.
        after += scene.motion.rate * float(flux.carried[1, 0] + flux.handed_over[1, 0])
    before += rotational_energy(scene, scene.spins)
    after += rotational_energy(scene, spins_of(run_state.engine.model, run_state.unit))
    if run_state.system.stepped:
        after += energy_of_steps(run_state) - energy_of_first_steps(run_state)
    if hasattr(scene.motion, "potential_energy"):
        frame = run_state.frame()
        if frame.images is None:
            return math.nan
        places = frame.positions + frame.images * np.array(scene.box)
        before += scene.motion.potential_energy(scene.masses, scene.positions, scene.box)
        after += scene.motion.potential_energy(scene.masses, places, scene.box)
    return abs(after - before) / before if before else 0.0


def rotational_energy(scene: Scene, spins: np.ndarray | None) -> float:
    """Return the energy of rotation of all particles with ``spins`` (n, 1) or (n, 3), or None [energy]."""
    if spins is None:
        return 0.0
    impact: Any = scene.impact
    inertias = impact.inertias(scene.masses, scene.dimension) * (0.5 * scene.diameters) ** 2
    return 0.5 * float(inertias @ (spins**2).sum(axis=1))


def kT_rotational(run_state: RunState) -> float:
    """Return twice the energy of rotation over its degrees of freedom [energy]."""
    spins = spins_of(run_state.engine.model, run_state.unit)
    if spins is None:
        raise InputError("The particles are smooth and do not spin: give the scene impact=Rough(...).")
    scene = run_state.scene
    free = scene.n if scene.pinned is None else int(np.count_nonzero(~scene.pinned))
    return 2.0 * rotational_energy(scene, spins) / (free * spins.shape[1])


def sums(run_state: RunState) -> Block:
    """Return what has added up since the start; what it does not hold is None."""
    tally = run_state.engine.tallies[0]
    return Block(
        float(run_state.clock.instant),
        int(tally.collisions),
        run_state.unit.to_scene(float(tally.virial), -1),
        impulses(run_state),
        kT_time=kT_time(run_state),
        momentum_flux=momentum_flux(run_state),
        volumes=volume_sums(run_state),
    )


def sizes(run_state: RunState, diameters: np.ndarray, duration: float) -> Sizes | None:
    """Return the averages over a stretch that began with diameters (n,), or None where none grows."""
    rates = run_state.system.rates
    if rates is None:
        return None
    dimension = run_state.scene.dimension
    gain = run_state.unit.to_kernel(2.0 * rates, 1) * duration
    if run_state.sweeps is not None:  # those of the start, in the present order
        diameters = run_state.diameters - gain
    # Powers of diameters are polynomials in time, for which so many points of Gauss are exact.
    nodes, weights = np.polynomial.legendre.leggauss(dimension // 2 + 1)
    filled = largest = 0.0
    for node, weight in zip(0.5 * (1.0 + nodes), 0.5 * weights, strict=True):
        powers = power(diameters + node * gain, dimension)
        filled += weight * float(powers.sum())
        largest += weight * float(powers.max())
    same = bool((diameters == diameters[0]).all() and (rates == rates[0]).all())
    return Sizes(float(sphere_volume(dimension) * filled / run_state.scene.volume), float(largest), same)


def impacts(run_state: RunState) -> tuple[Impacts, ...]:
    """Return what each wall and obstacle took up since the start."""
    from carom.observables.wall_pressure import obstacle_names

    tally, numbers = run_state.engine.model.obstacles, run_state.obstacle_numbers()
    if tally is None:
        return ()
    hits = tally.hits[numbers].tolist()
    found = list(map(Impacts, obstacle_names(run_state.scene), hits, impulses(run_state)))
    if tally.live is not None:
        from carom.engine.obstacles import spared_by_number

        elastic_contacts = spared_by_number(tally.chain)
        for index, k in enumerate(numbers):
            work = run_state.unit.to_scene(float(tally.live.work[k]), -2)
            found[index] = Impacts(*found[index][:3], work, *elastic_contacts.get(k, (0, 0)))
    return tuple(found)


def impulses(run_state: RunState) -> tuple[float, ...]:
    """Return the momentum that each wall and obstacle took up since the start."""
    if run_state.engine.model.obstacles is None:
        return ()
    impulse = run_state.engine.model.obstacles.impulse[run_state.obstacle_numbers()]
    return tuple(run_state.unit.to_scene(impulse, -1).tolist())


def momenta_at_walls(run_state: RunState) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the weighted momentum of each wall and obstacle now, and the sums of those without one."""
    from carom.observables.analysis.momentum_balance import weighted_momenta
    from carom.observables.analysis.surface_changes import surface_sums

    if run_state.engine.model.obstacles is None:
        return (), ()
    frame = run_state.frame()
    return weighted_momenta(frame, run_state.scene), surface_sums(frame, run_state.scene)


def pinned_impulse(run_state: RunState) -> np.ndarray:
    """Return what each component took up while pinned: :attr:`carom.Simulation.pinned_impulse`."""
    pinned = run_state.scene.pinned
    if pinned is None:
        raise InputError("The scene has no pinned components: give it pinned=.")
    impulse = run_state.unit.to_scene(run_state.engine.model.pair.impulse[:-1], -1)
    return np.where(pinned, impulse, 0.0)


def collisions_by_species(run_state: RunState) -> np.ndarray:
    """Return the pair collisions of every pair of species, (K, K), symmetric."""
    from carom.engine.observers.species import BySpecies

    sums = run_state.observer(BySpecies)
    if sums is None:
        raise InputError("The scene has no species: give it species=.")
    counts, count = sums.collisions, species_count(run_state.scene)
    whole = np.zeros((count, count), np.int64)  # the engine knows no species after the last that occurs
    whole[: len(counts), : len(counts)] = counts + np.triu(counts, 1).T
    return whole
