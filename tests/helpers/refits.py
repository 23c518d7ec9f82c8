"""Scenes with every model that remembers something, at any scale of time; and all that an engine holds, by
what its fields declare.
"""

import math
import sys
from types import SimpleNamespace

import numpy as np

import carom
from carom.engine.build import PARTS
from carom.engine.constants import POWERS
from carom.engine.observers.interface import listed
from carom.models import (
    TIMER,
    Active,
    Andersen,
    Brownian,
    Gravity,
    Kind,
    Langevin,
    Loss,
    Parabolas,
    Plane,
    Ranges,
    Rough,
    Shear,
    Sine,
    SquareWell,
    WhiteNoise,
    draw,
    own,
)
from carom.models.interfaces.memory import Field, copied, fields_of
from carom.models.motions.gravity import leaving
from carom.observables.energy import without_potential
from carom.simulation.measuring import readings, stretches

N = 6

STEP = 2.0**-10
"""Between two kicks of a drive, or two moves: times in which hot particles fly a diameter."""


def scene(s, **more):
    """A few disks with speeds of about s, which are in a box that they fill to 0.35."""
    start = carom.Scene.random(N, 0.35, 2, seed=1, walls=more.pop("walls", ""))
    return start.replace(velocities=s * np.random.default_rng(1).normal(size=(N, 2)), **more)


def over(s, below):
    """Disks over something, which they meet at once and again a while later."""
    start = scene(s, walls="y", obstacles=[below])
    return start.replace(velocities=s * np.random.default_rng(3).normal(size=(N, 2)))


def floor(s, **more):
    return over(s, Plane((0.0, 1.0), 0.0, "floor", **more))


def two_sizes(s, species, **more):
    """The same with two diameters."""
    sizes = [1.0, 1.0, 1.0, 0.7, 0.7, 0.7]
    return scene(s).replace(diameter=sizes, species=[0, 0, 0, 1, 1, 1] if species else None, **more)


@own.impact
class Remembering:
    """A contact law with every kind of quantity, and every kind of memory."""

    threshold: own.Speed
    least: own.Energy
    pause: own.Time
    rate: own.Rate
    pull: own.Acceleration
    impulse: own.Momentum
    last = own.memory(-math.inf, times=True)
    last_but_one = own.memory(-math.inf, times=True)
    contacts = own.memory(0)
    fastest: own.Speed = own.memory(0.0)
    energy: own.Energy = own.memory(0.0)
    lasted: own.Time = own.memory(0.0)

    @own.memory
    def steepest(self, particles) -> own.Acceleration:
        return np.full(len(particles.radii), self.pull)

    @own.prepared
    def hurried(self, particles) -> own.Rate:
        return 2.0 * self.rate

    def transfer(self, rr, rv):
        return 1.0 if rv * rv < self.threshold[0, 1] ** 2 * rr else 0.875

    def exchanged_part(self, i, j, rr, rv, now):
        u = abs(rv) / math.sqrt(rr)
        since = min(now - max(self.last[i], self.last[j]), self.pause)
        self.last_but_one[i] = max(self.last_but_one[i], self.last[i])
        self.last_but_one[j] = max(self.last_but_one[j], self.last[j])
        self.last[i] = self.last[j] = now
        self.contacts[i] += 1
        self.fastest[i] = max(self.fastest[i], u)
        self.energy[i] += 0.5 * u * u
        self.lasted[i] += since
        self.steepest[i] = max(self.steepest[i], u * self.hurried)
        slow = u < self.threshold[0, 1] or u * u < self.least or u * self.rate < self.pull or u < self.impulse
        early = since < 0.25 * self.pause or u < 0.01 * self.fastest[j]
        return 1.0 if slow or early else 0.875


@own.interaction
class Soft:
    """Cores that throw apart with a least speed, and add up momenta."""

    contact: float
    least: own.Speed
    taken: own.Momentum = own.memory(0.0)

    def reach(self, scene):
        return self.contact

    def interaction_time(self, i, j, rr, rv, vv, now):
        return own.first_contact(rr - self.contact**2, rv, vv)

    def jump(self, i, j, rr, rv, now):
        return own.elastic(self, i, j, rr, rv)

    def record_impulse(self, i, j, momentum):
        self.taken[i] += max(momentum, self.least)
        self.taken[j] += momentum


@own.interaction
class Stairs:
    """Cores with a step."""

    height: own.Energy

    def reach(self, scene):
        return 1.25

    def energies(self):
        return (0.0, self.height, math.inf)

    def step_of(self, distance):
        return 0 if distance > 1.25 else 1

    def step_time(self, i, j, step, rr, rv, vv, now):
        low = (1.5625, 1.0)[min(step, 1)]
        return own.end_of_step(low, math.inf if step == 0 else 1.5625, rr, rv, vv)

    def step_jump(self, i, j, step, rr, rv, now):
        inwards = rr - 1.0 < 0.28125 or step == 0
        cost = self.energy[step + 1] - self.energy[step] if inwards else self.energy[0] - self.energy[step]
        return own.cross(self, i, j, step, rr, rv, inwards, cost)


@own.motion
class Drifting:
    """Parabolas along one axis."""

    g: own.Acceleration
    straight = False

    def position(self, axis, x, v, t):
        return x + (v + 0.5 * self.g * t * (axis == 0)) * t

    def velocity(self, axis, v, t):
        return v + self.g * t * (axis == 0)

    def exit_time(self, axis, x, v, low, high):
        return leaving(x, v, self.g * (axis == 0), low, high)


@own.obstacle
class Ledge:
    """A floor that throws slow particles up, and adds up what it gave."""

    least: own.Speed
    last = own.memory(-math.inf, times=True)
    given: own.Momentum = own.memory(0.0)
    waits: own.Time = own.memory(0.0)

    def gap(self, positions, radii, box, periodic):
        return positions[:, 1] - radii

    def encounter(self, x, v, radius, growth):
        return max((x[1] - radius) / -v[1], 0.0) if v[1] < 0.0 else own.NEVER

    def outward(self, x, axis):
        return 1.0 if axis == 1 else 0.0

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        if now - self.last[i] < 1e30:
            self.waits[i] += now - self.last[i]
        self.last[i] = now
        up = max(-v[1], self.least)
        self.given[i] += mass * (up - v[1])
        v[1] = up


@own.drive
class Kicks:
    """Kicks along one axis, the later the faster."""

    speed: own.Speed
    interval: own.Time
    kicks = own.memory(0)
    latest: own.Time = own.memory(0.0)

    def next_time(self, i, x, v, time):
        later = 0.25 * min(abs(v[0]) / self.speed, 1.0)
        return max((self.kicks[i] + 1 + i / 8 + later) * self.interval, time)

    def kick(self, i, mass, x, v, time):
        self.kicks[i] += 1
        self.latest[i] = time
        v[0] += self.speed * own.normal(1, i, self.kicks[i])


@own.observer
class Sums:
    """All that an observer is told."""

    times: own.Time = own.memory(0.0, 3)
    speeds: own.Speed = own.memory(0.0, 6)
    momenta: own.Momentum = own.memory(0.0, 2)
    energies: own.Energy = own.memory(0.0, 1)
    latest: own.Time = own.memory(0.0, 1)
    events = own.memory(0, 3)

    def at_pair(self, event):
        self.events[0] += 1
        self.times[0] += event.time
        self.latest[0] = event.time
        self.momenta[0] += event.virial
        self.speeds[0] += event.before[0, 0]
        self.speeds[1] += event.after[1, 1]

    def at_obstacle(self, event):
        self.events[1] += 1
        self.times[1] += event.time
        self.momenta[1] += event.momentum
        self.energies[0] += event.energy
        self.speeds[2] += event.before[1]
        self.speeds[3] += event.after[1]

    def at_epoch(self, event):
        self.events[2] += 1
        self.times[2] += event.time
        self.speeds[4] += event.v[0, 0]


def rule(unit, event):
    """Turns at times of its own, and notes what it is told; its times are told by its speed."""
    speed = math.hypot(unit.velocity[0], unit.velocity[1])
    unit.memory[0] += event.distance
    unit.memory[1] = event.time * speed
    unit.target = event.other
    if event.cause == TIMER:
        angle = 2.0 * math.pi * draw(unit)
        unit.velocity[0], unit.velocity[1] = speed * math.cos(angle), speed * math.sin(angle)
        unit.timer = 0.125 * (0.5 + draw(unit)) / speed
        if event.time * speed > 0.5:
            unit.kind = 1 - unit.kind


def units(s):
    kinds = [Kind("a", (1.0, 1.5), 0.0625 / s, (0.0, 0.0)), Kind("b", (1.25,), 0.0, (0.0, 0.0))]
    return scene(s).replace(diameter=0.1, species=np.arange(N) % 2, interaction=Ranges(kinds, rule))


STILL = np.random.default_rng(1).normal(size=(N, 2)) * (np.arange(N) > 1)[:, None]
OBSERVED = {"observers": lambda: [Sums()]}
MATRIX = np.array([[0.005, 0.01], [0.01, 0.015]])

ROWS = {
    "rough": lambda s: (
        scene(
            s,
            impact=Rough(0.9, tangential=0.5, friction=0.3, elastic_below=0.125 * s),
            spins=s * np.random.default_rng(2).normal(size=(N, 1)),
        ),
        {},
    ),
    "restitution by species": lambda s: (two_sizes(s, True, impact=0.9), {}),
    "loss": lambda s: (
        scene(s, impact=Loss(0.9, contact_time=0.125 / s, at_speed=s, elastic_below=0.125 * s)),
        OBSERVED,
    ),
    "andersen": lambda s: (scene(s, drive=Andersen(kT=s * s, rate=s / STEP)), {}),
    "langevin": lambda s: (scene(s, drive=Langevin(kT=s * s, friction=s, step=STEP / s)), {}),
    "brownian": lambda s: (scene(s, drive=Brownian(kT=s * s, step=STEP / s)), {}),
    "white noise": lambda s: (scene(s, drive=WhiteNoise(power=s**3, rate=s / STEP)), {}),
    "noise of pairs": lambda s: (
        scene(s, drive=WhiteNoise(power=s**3, rate=s / STEP, pairs=True)),
        {},
    ),
    "active": lambda s: (scene(s, drive=Active(s, 4.0 / s, STEP / s, kT=0.25 * s * s)), {}),
    "tumbling": lambda s: (
        scene(s, drive=Active(s, 4.0 * STEP / s, STEP / s, kT=0.25 * s * s, kind="tumble")),
        {},
    ),
    "lossy floor": lambda s: (floor(s, impact=Loss(0.9, contact_time=0.125 / s)), OBSERVED),
    "rough floor": lambda s: (
        floor(s, impact=Rough(0.9, tangential=0.5)).replace(impact=Rough(0.9, tangential=0.5)),
        OBSERVED,
    ),
    "hot floor": lambda s: (floor(s, kT=s * s, seed=3), OBSERVED),
    "shaken floor": lambda s: (floor(s, shake=Sine(0.0625, 1.0 / s), impact=0.9), OBSERVED),
    "floor on parabolas": lambda s: (
        floor(s, shake=Parabolas([(0.25 / s, -2.0 * s * s), (0.25 / s, 2.0 * s * s)], speed=0.25 * s)),
        {},
    ),
    "gravity": lambda s: (floor(s, impact=0.9).replace(motion=Gravity((0.0, -s * s))), {}),
    "wells": lambda s: (scene(s, interaction=SquareWell(1.25, s * s)), {}),
    "pinned": lambda s: (scene(s).replace(pinned=[0, 1], velocities=s * STILL), {}),
    "shear": lambda s: (scene(s, motion=Shear(0.5 * s)), {}),
    "swaps": lambda s: (two_sizes(s, False), {"swaps": lambda: carom.Swaps(interval=STEP / s)}),
    "barostat": lambda s: (
        scene(s),
        {"barostat": lambda: carom.Barostat(pressure=s * s, interval=STEP / s, step=0.1)},
    ),
    "growth": lambda s: (two_sizes(s, False), {"growth": lambda: 0.0625 * s}),
    "units": lambda s: (units(s), {}),
    "own impact": lambda s: (
        scene(
            s,
            impact=Remembering(
                threshold=s * MATRIX,
                least=0.01 * s * s,
                pause=0.5 / s,
                rate=s,
                pull=0.0625 * s * s,
                impulse=0.125 * s,
            ),
        ),
        {},
    ),
    "own interaction": lambda s: (scene(s, interaction=Soft(contact=1.0, least=0.5 * s)), {}),
    "own steps": lambda s: (scene(s, interaction=Stairs(height=-s * s)), {}),
    "own obstacle": lambda s: (over(s, Ledge(least=2.0 * s)), OBSERVED),
    "own motion": lambda s: (scene(s, motion=Drifting(g=s * s)), {}),
    "own drive": lambda s: (scene(s, drive=Kicks(speed=s, interval=STEP / s)), {}),
}
"""By name: a scene whose speeds are about s, and makers of further arguments of its simulation."""


def simulation(name, s, **more):
    """The simulation of a row at a scale."""
    start, arguments = ROWS[name](s)
    return carom.Simulation(start, **{key: make() for key, make in arguments.items()}, **more)


def duration(name, s, hot):
    """Time for some events, a power of two."""
    start, arguments = ROWS[name](s)
    often = start.drive is not None or "swaps" in arguments or "barostat" in arguments
    return (2.0 * STEP if hot else 4.0 * STEP if often else 0.5) / s


def unsaved(scene):
    """Values of a scene that no file holds."""
    values = {name: getattr(scene, name) for name in ("interaction", "impact", "motion", "drive")}
    mine = {name: each for name, each in values.items() if type(each).__module__ == __name__}
    if isinstance(values["interaction"], Ranges):
        mine["interaction"] = values["interaction"]
    return {"obstacles": scene.obstacles, **mine}


def loaded(sim, path):
    """Save and load it, with the values that no file holds."""
    sim.save(path)
    observers = [Sums()] if sim.observers else ()
    again = carom.Simulation.load(path, observers=observers, **unsaved(sim.scene))
    for one, other in ((sim, again), (sim._state, again._state), (sim._state.clock, again._state.clock)):
        for name in ("collisions", "time", "counted", "instant", "base", "epoch", "offset", "length"):
            assert getattr(one, name, None) == getattr(other, name, None), name
    return again


def held(sim):
    """All numbers of an engine's model, {name: (value in the scene's unit of time, its field)}.

    Moments are told from now on, and sums over time until now.
    """
    state, found = sim._state, {}
    observers = copied(state.engine.model.observers)
    observers.at_rest(state.in_epoch(), state.in_epoch())

    def gather(name, value, what, exponent):
        if isinstance(value, tuple):
            declared = fields_of(type(value))
            for field, part in zip(declared or map(str, range(len(value))), value, strict=True):
                said = declared.get(field, what)
                said = what._replace(power=said.power) if what.role == "given" else said
                inside = 0 if said.role == "given" else exponent
                gather(f"{name}.{type(value).__name__}.{field}", part, said, inside)
        elif isinstance(value, np.ndarray | float | int) and what.role not in ("room", "unit", "origin"):
            value = value - state.in_epoch() if what.role == "moment" else np.array(value)
            found[name] = scaled(value, np.multiply(what.power, exponent)), what

    gather("observers", observers, Field(), state.unit.exponent)
    for part in PARTS:
        gather(part, getattr(state.engine.model, part), Field(), state.unit.exponent)
    for name in state.engine.tallies.dtype.names:
        gather(name, state.engine.tallies[name], Field(POWERS.get(name, 0), "kept"), state.unit.exponent)
    return found


def species_between_walls():
    """Enough for two workers, in lists."""
    species = [carom.Species(count=3000), carom.Species(count=3000, diameter=1.4)]
    return carom.Scene.random(species=species, packing_fraction=0.5, walls="y", seed=1)


def scaled(value, exponents):
    """A number times a power of two; whole numbers as they are."""
    return np.ldexp(value, np.asarray(exponents, np.int32)) if np.any(exponents) else np.array(value)


def models_of(sim):
    """All models in an engine."""
    found, waiting = [], [getattr(sim._state.engine.model, part) for part in PARTS]
    waiting += listed(sim._state.engine.model.observers)
    while waiting:
        each = waiting.pop()
        if isinstance(each, tuple):
            found.append(each)
            waiting += each
    return found


def models_in(sim):
    """Their types."""
    return set(map(type, models_of(sim)))


def known_models():
    """Types of tuples of Carom, among which are its models and the parts of an engine."""
    modules = [module for name, module in sys.modules.items() if name.startswith("carom.")]
    kinds = {kind for module in modules for kind in vars(module).values() if isinstance(kind, type)}
    return {kind for kind in kinds if hasattr(kind, "_fields") and kind.__module__.startswith("carom.")}


def seen(sim):
    """What a user sees, as (value, power) by name."""
    frame, done = sim.frame(), sim.statistics
    numbers = SimpleNamespace(**{name: (getattr(done, name), 0) for name in COUNTED})
    found = vars(numbers) | {
        "positions": (frame.positions, 0), "velocities": (frame.velocities, -1),
        "diameters": (frame.diameters, 0), "box": (frame.box, 0), "time": (sim.time, 1), "kT": (sim.kT, -2),
    }  # fmt: skip
    if frame.images is not None:
        found["images"] = frame.images, 0
    if frame.spins is not None:
        found["spins"] = frame.spins, -1
    sums = stretches.tally(sim)
    found["virial"] = sums.virial, -1
    if sums.volumes is not None:
        found["volumes"] = np.array(sums.volumes), (1, 1, -1)
    if sim.scene.species is not None:
        found["collisions by species"] = sim.collisions_by_species, 0
    if without_potential(sim.scene) is None:
        found["potential energy"] = sim.potential_energy, -2
    if sim.scene.pinned is not None:
        found["pinned impulse"] = sim.pinned_impulse, -1
    if readings.kT_time(sim._state) is not None:
        found["kT time"] = readings.kT_time(sim._state), -1
    for k, flux in enumerate(readings.momentum_flux(sim._state) or ()):
        found[f"flux {k}"] = flux, -1
    for impact in sim.obstacles:
        found[f"hits of {impact.name}"] = impact.hits, 0
        found[f"impulse of {impact.name}"] = impact.impulse, -1
        found[f"work of {impact.name}"] = impact.work, -2
        found[f"spared and lifted by {impact.name}"] = np.array([impact.spared, impact.lifted]), 0
    return found


COUNTED = (
    *("collisions", "third_party_first", "spared_contacts", "energy_drift", "momentum_drift"),
    *("swaps_tried", "swaps_accepted", "volume_moves_tried", "volume_moves_accepted"),
)

OF_SCHEMES = ("transits", "advancements")
"""What depends on the neighbor scheme, and on windows that were run again."""


def assert_alike(one, other, scale):
    """What two twins hold and show is the same, scaled, but what their neighbor schemes count."""
    shown = seen(one), seen(other)
    inside = [{key: (value, what.power) for key, (value, what) in held(sim).items()} for sim in (one, other)]
    for first, second in (shown, inside):
        assert first.keys() == second.keys()
        wrong = [
            key
            for key, (value, power) in first.items()
            if key not in OF_SCHEMES
            and not np.array_equal(
                scaled(value, np.multiply(power, -scale)), np.asarray(second[key][0]), equal_nan=True
            )
        ]
        assert not wrong, wrong
