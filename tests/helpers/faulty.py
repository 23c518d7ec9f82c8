"""Models of one's own with the faults that are looked for: each is right without its fault."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import carom
from carom.models import own
from carom.models.drives import DriveModel
from carom.models.interfaces.contact import ImpactModel
from carom.models.interfaces.interaction import PairModel
from carom.models.interfaces.motion import MotionModel
from carom.models.interfaces.obstacle import ObstacleModel
from carom.models.interfaces.particles import NEVER, lanes
from carom.models.interfaces.steps import BOUNCE, CORE, IN, OUT, SteppedModel, step_bits
from carom.models.interfaces.walls import soonest_wall
from carom.models.mathematics.contact import elastic, exit_sphere, first_contact

SCENE = carom.Scene.random(30, 0.3, 2, seed=1)
PLACES = carom.Scene.random(10, box=(8.0, 6.0), seed=1).positions
OPEN = carom.Scene(PLACES + np.array([0.0, 2.5]), (8.0, 10.0), walls="y")


def conditions(value, **options):
    """Return which conditions fail for a value."""
    return {failure.condition for failure in carom.check(value, pairs=60, **options).failures}


class Cores(PairModel):
    """Hard cores of diameter 1 with a fault."""

    fault: str
    radii: np.ndarray
    masses: np.ndarray

    def interaction_time(self, i, j, rr, rv, vv, now):
        if self.fault == "lost":
            return NEVER
        contact = {"core": 0.9, "unlike times": 0.9 if i < j else 1.0}.get(self.fault, 1.0)
        return first_contact(rr - contact, rv, vv) * (1.5 if self.fault == "late" else 1.0)

    def jump(self, i, j, rr, rv, now):
        a, b, virial = elastic(self, i, j, rr, rv)
        parts = {
            "energy": 1.1, "clay": 0.75, "soft": 0.1, "unlike jumps": 1.5 if i < j else 1.0,
            "backwards": -1.0,
        }  # fmt: skip
        part = parts.get(self.fault, 1.0)
        turned = self.fault == "sign" or (self.fault == "unlike" and self.masses[i] != self.masses[j])
        virial *= -1.0 if turned else 0.5 if self.fault == "size" else 1.0
        return part * a, part * b * (2.0 if self.fault == "momentum" else 1.0), part * virial

    def core_square(self, i, j, now):
        return 1.0


@dataclass(frozen=True)
class Mine:
    fault: str = ""

    def reach(self, scene):
        return 1.05

    def model(self, particles):
        wide = particles.with_padding
        return Cores(self.fault, wide(particles.radii), wide(particles.masses))


class Ledge(SteppedModel):
    """Spheres that cost energy while they are inside each other, with a fault."""

    fault: str
    energy: np.ndarray
    events: np.ndarray
    radii: np.ndarray
    masses: np.ndarray

    def step_time(self, i, j, step, rr, rv, vv, now):
        return exit_sphere(rr - 1.0, rv, vv) if step == 1 else first_contact(rr - 1.0, rv, vv)

    def step_jump(self, i, j, step, rr, rv, now):
        r = math.sqrt(rr)
        u = rv / r
        mu = self.masses[i] * self.masses[j] / (self.masses[i] + self.masses[j])
        cost = 2.0 * self.energy[1] / mu
        if step == 0:
            left = u * u - (0.5 * cost if self.fault == "in" else cost)
            new, after, kind = (-math.sqrt(left), 1, IN) if left > 0.0 else (-u, 0, CORE)
        else:
            new, after, kind = math.sqrt(u * u + (0.5 * cost if self.fault == "out" else cost)), 0, OUT
        if self.fault == "kind" and kind == OUT:
            kind = BOUNCE
        if self.fault == "unlike kinds" and kind == CORE and i < j:
            kind = BOUNCE
        if self.fault == "step" and kind == IN:
            after = 7
        p = mu * (new - u)
        virial = -p * r if self.fault == "virial" else p * r
        return -p / (self.masses[i] * r), -p / (self.masses[j] * r), virial, after, kind


@dataclass(frozen=True)
class Shoulder:
    fault: str = ""
    far: float = 1.0
    keeps: bool = True
    penetrable = True

    def reach(self, scene):
        return self.far

    def conserves(self, diameter):
        return self.keeps

    def steps(self, particles):
        return 2, np.zeros((1, 1), np.int64)

    def steps_of(self, pairs, distances, species, diameter):
        return (distances < 1.0).astype(np.int64)

    def model(self, particles):
        size, wide = 2 ** step_bits(2), particles.with_padding
        energy = np.zeros(3 if self.fault == "short" else size)
        energy[1] = float(particles.unit.to_kernel(1.0, -2))
        events = None if self.fault == "events" else np.zeros((size, 4), np.int64)
        return Ledge(self.fault, energy, events, wide(particles.radii), wide(particles.masses))


class Two(PairModel):
    """Hard cores: unlike kinds touch at one distance, like ones at another."""

    like: float
    unlike: float
    kinds: np.ndarray
    radii: np.ndarray
    masses: np.ndarray

    def interaction_time(self, i, j, rr, rv, vv, now):
        return first_contact(rr - (self.like if self.kinds[i] == self.kinds[j] else self.unlike), rv, vv)

    def jump(self, i, j, rr, rv, now):
        return elastic(self, i, j, rr, rv)


@dataclass(frozen=True)
class Parity:
    """Components with even and odd numbers."""

    like: float = 1.0
    unlike: float = 0.6
    far: object = 1.0
    change: tuple = ()
    penetrable = True

    def reach(self, scene):
        return self.far

    def model(self, particles):
        kinds = particles.with_padding(np.arange(len(particles.radii)) % 2, np.int64)
        sizes = particles.with_padding(particles.radii), particles.with_padding(particles.masses)
        return Two(self.like**2, self.unlike**2, kinds, *sizes)._replace(**dict(self.change))


@own.motion
class Drag:
    """Drag: v' = -g v."""

    g: own.Rate
    straight = False

    def conserves(self, axis):
        return False

    def position(self, axis, x, v, t):
        return x - v * math.expm1(-self.g * t) / self.g

    def velocity(self, axis, v, t):
        return v * math.exp(-self.g * t)

    def exit_time(self, axis, x, v, low, high):
        way = max(high - x, 0.0) if v > 0.0 else max(x - low, 0.0)
        part = self.g * way / abs(v) if v != 0.0 else 1.0
        return (-math.log1p(-part) / self.g if part < 1.0 else NEVER), np.int64(v > 0.0)


@own.interaction
class DragCores:
    """Hard cores whose times are those of the drag."""

    g: own.Rate

    def reach(self, scene):
        return 1.0

    def interaction_time(self, i, j, rr, rv, vv, now):
        part = self.g * first_contact(rr - 1.0, rv, vv)
        return -math.log1p(-part) / self.g if part < 1.0 else NEVER

    def jump(self, i, j, rr, rv, now):
        return elastic(self, i, j, rr, rv)


class Curve(MotionModel):
    """Free flight, as if it were a curve."""

    edges: tuple
    images: bool

    def position(self, axis, x, v, t):
        return x

    def velocity(self, axis, v, t):
        return v

    def carry(self, x, v, t, there, then):
        for axis in range(len(x)):
            there[axis], then[axis] = x[axis] + v[axis] * t, v[axis]
        return there, then, 0.0

    def meeting_time(self, me, other, now, contact, rate, limit, span):
        soonest, most = NEVER, 6 if self.images else 0
        for left in range(-most, most + 1):
            for up in range(-most, most + 1):
                rr, rv, vv = -contact * contact, -contact * rate, -rate * rate
                for axis in range(2):
                    r = other.x[axis] - me.x[axis] + (left, up)[axis] * self.edges[axis]
                    r += other.v[axis] * (now - other.t) - me.v[axis] * (now - me.t)
                    u = other.v[axis] - me.v[axis]
                    rr, rv, vv = rr + r * r, rv + r * u, vv + u * u
                soonest = min(soonest, first_contact(rr, rv, vv))
        return soonest, False


@dataclass(frozen=True)
class Curved:
    images: bool
    straight = False
    curved = True

    def conserves(self, axis):
        return True

    def model(self, particles):
        return Curve(particles.box, self.images)


class Bare(NamedTuple):
    """A model that answers nothing."""

    masses: np.ndarray


class Flight(MotionModel):
    """Free flight with one thing wrong, or what bends and does not say so."""

    fault: str
    part: float = 1.0

    def position(self, axis, x, v, t):
        if self.fault == "bends":
            return x + (v - 0.5 * t) * t
        return x + v * {"squared": t * t, "brakes": 1.0 - np.exp(-t)}.get(self.fault, t)

    def velocity(self, axis, v, t):
        return v - t if self.fault == "bends" else v * np.exp(-t) if self.fault == "brakes" else v

    def exit_time(self, axis, x, v, low, high):
        up = int(v > 0.0)
        return ((high if up else low) - x) / v * (2.0 if self.fault == "exit" else 1.0), up


class Walled(Flight):
    """Free flight that meets walls after some part of the time."""

    def wall_meeting(self, walls, x, v, radius, growth):
        t, number = soonest_wall(walls, x, v, radius, growth)
        return self.part * t, number


@dataclass(frozen=True)
class Flying:
    fault: str = ""
    part: float | None = None
    straight: bool = True

    def model(self, particles):
        return Flight(self.fault) if self.part is None else Walled(self.fault, self.part)


class Part(ImpactModel):
    """The part that is exchanged, and a memory."""

    part: float
    asked: np.ndarray

    def transfer(self, rr, rv):
        return self.part

    def exchanged_part(self, i, j, rr, rv, now):
        self.asked[i] += 1
        self.asked[j] += 1
        return self.part


class Law:
    def __init__(self, part, adds_energy=False, length=31):
        self.part, self.adds_energy, self.asked = part, adds_energy, np.zeros(length, np.int64)

    def model(self, particles):
        return Part(self.part, self.asked)


class Fading(ImpactModel):
    """A contact law that knows the time, and forgets it."""

    last: np.ndarray

    def transfer(self, rr, rv):
        return 1.0

    def shift_epoch(self, duration):
        self.last[0] -= duration


class Fades:
    def model(self, particles):
        return Fading(np.zeros(1))


class Level(ObstacleModel):
    """A floor at the height 1, with a fault."""

    fault: str

    def encounter(self, x, v, radius, growth):
        height = x[1] - 1.0 - radius
        if (self.fault == "hair" and height < 0.0) or self.fault == "lost" or v[1] >= 0.0:
            return NEVER
        return max(height / -v[1], 0.0) * {"late": 2.0, "early": 0.5}.get(self.fault, 1.0)

    def fall(self, g, x, v, radius, growth, now):
        height, late = x[1] - 1.0 - radius, 1.25 if self.fault == "late" else 1.0
        root = math.sqrt(max(v[1] * v[1] - 2.0 * g[1] * height, 0.0))
        return 0.0 if height <= 0.0 and v[1] < 0.0 else late * (v[1] + root) / -g[1]

    def outward(self, x, axis):
        return {"long": 1.1, "double": 2.0, "inwards": -1.0}.get(self.fault, 1.0) if axis == 1 else 0.0

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        v[1] *= {"gain": -1.5, "through": 0.9}.get(self.fault, -0.9)


@dataclass(frozen=True)
class Floor:
    fault: str = ""
    sense: float = 1.0
    name: str = "floor"

    def check(self, box, periodic):
        return

    def gap(self, positions, radii, box, periodic):
        return self.sense * (positions[:, 1] - 1.0) - radii

    def model(self):
        return Level(self.fault)


class Bouncy(Floor):
    def live(self, particles):
        return self.model()


class Clock(DriveModel):
    """Events at random times: ``kind`` says of which fault."""

    kind: str
    due: np.ndarray
    drawn: np.ndarray

    def draw(self, i, time):
        return -math.log(own.uniform(1, i, self.drawn[i]))

    def next_time(self, i, x, v, time):
        if self.kind == "kept":
            return self.due[i]
        if self.kind == "kept from the first question":
            if self.due[i] <= time:
                self.due[i] = time + self.draw(i, time)
            return self.due[i]
        if self.kind == "a place ahead":  # moves towards it at the same speed, and on from there
            return time + ((7.0 - x[0]) / v[0] - 1e-6) % (20.0 / abs(v[0])) + 1e-6
        if self.kind == "a turn":
            return 0.25 * (math.floor(time / 0.25 + 1e-9) + 1.0)
        if self.kind == "drawn by the question":
            self.drawn[i] += 1
        if self.kind == "an age":
            return time + 1.0 / np.linalg.norm(v)
        if self.kind == "never, until then":
            return NEVER if time < 0.3 else self.due[i] + 0.3
        return time + self.draw(i, time)

    def kick(self, i, mass, x, v, time):
        self.drawn[i] += 1
        if self.kind == "kept":
            self.due[i] += self.draw(i, time)
        if self.kind not in ("kept", "a place ahead"):
            v *= -1.0


@dataclass(frozen=True)
class Clocked:
    """Kicks at the times of a clock."""

    kind: str

    def model(self, particles):
        n = len(particles.radii)
        return Clock(self.kind, np.full(n, 0.5 * (self.kind == "kept")), np.zeros(n, np.int64))


@lanes("radii")
class Beside(PairModel):
    """Hard cores that name a lane."""

    radii: np.ndarray
    masses: np.ndarray

    jump = Two.jump

    def interaction_time(self, i, j, rr, rv, vv, now):
        return first_contact(rr - 1.0, rv, vv)


class Bounded(PairModel):
    """Hard cores that say how far apart they keep two."""

    core: float
    radii: np.ndarray
    masses: np.ndarray

    jump = Two.jump

    def interaction_time(self, i, j, rr, rv, vv, now):
        return first_contact(rr - self.core, rv, vv) if rr >= self.core else NEVER

    def core_square(self, i, j, now):
        return self.core


class Misspelt(PairModel):
    """Hard cores one of whose answers reads what they have not."""

    radii: np.ndarray
    masses: np.ndarray

    jump = Two.jump

    def interaction_time(self, i, j, rr, rv, vv, now):
        return first_contact(rr - self.square, rv, vv)


class Modelled(Parity):
    """Cores with another model: ``make`` is given radii, masses and the particles."""

    make: object = None

    def model(self, particles):
        wide = particles.with_padding
        return self.make(wide(particles.radii), wide(particles.masses), particles)


def modelled(make, name="Modelled", **fields):
    """Return cores of a class of that name, whose model is made of radii, masses and particles."""
    return type(name, (Modelled,), {"make": staticmethod(make)})(**fields)
