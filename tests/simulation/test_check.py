"""What ``carom.check`` finds in models of one's own, and that a simulation finds it, too."""

import itertools
import math
import warnings
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest
from helpers.faulty import Curved, Drag, DragCores, Parity
from scipy.optimize import brentq

import carom
from carom.errors import CaromWarning, InputError
from carom.models import Ball, Cuboid, Plane, Segment, SphericalContainer
from carom.models.contacts.losses import Loss
from carom.models.interactions.steps import Steps
from carom.models.interactions.wells import StepTable
from carom.models.mathematics.contact import elastic, exit_sphere, first_contact
from carom.models.motions.gravity import Gravity
from carom.models.motions.great_circles import GreatCircles
from carom.models.obstacles.dressing import Shaken, Surface, Thermal
from carom.models.obstacles.paths import Sine, pace, place
from carom.models.questions.contact import exchanged_part, transfer
from carom.models.questions.interaction import core_square, interaction_time, jump
from carom.models.questions.motion import carry, meeting_time, position, velocity
from carom.models.questions.obstacle import encounter, fall, outward, recoil
from carom.models.questions.particles import NEVER
from carom.models.questions.steps import BOUNCE, CORE, IN, OUT, step_bits, step_jump, step_time
from carom.models.questions.walls import soonest_wall, wall_meeting
from carom.simulation import own_models
from carom.simulation.explanation import explain

SCENE = carom.Scene.random(30, 0.3, 2, seed=1)
PLACES = carom.Scene.random(10, box=(8.0, 6.0), seed=1).positions
OPEN = carom.Scene(PLACES + np.array([0.0, 2.5]), (8.0, 10.0), walls="y")


def conditions(value: Any, **options: Any) -> set[str]:
    """Return which conditions fail for a value."""
    return {failure.condition for failure in carom.check(value, pairs=60, **options).failures}


def refused(scene: carom.Scene, condition: str) -> None:
    """Let a simulation refuse a scene for a condition; nothing is compiled."""
    with pytest.raises(InputError, match=rf"condition of carom.check, .* {condition}: not so that"):
        carom.Simulation(scene)


class Cores(NamedTuple):
    """Hard cores of diameter 1 with a fault."""

    fault: str
    radii: np.ndarray
    masses: np.ndarray


@interaction_time.register
def _(pair: Cores, i, j, rr, rv, vv, now):
    contact = 0.9 if pair.fault == "core" else 1.0
    return NEVER if pair.fault == "lost" else first_contact(rr - contact, rv, vv)


@jump.register
def _(pair: Cores, i, j, rr, rv, now):
    a, b, virial = elastic(pair, i, j, rr, rv)
    if pair.fault == "energy":
        return 1.1 * a, 1.1 * b, 1.1 * virial
    if pair.fault == "clay":
        return 0.75 * a, 0.75 * b, 0.75 * virial
    if pair.fault == "unlike" and pair.masses[i] != pair.masses[j]:
        return a, b, -virial
    if pair.fault == "backwards":
        return -a, -b, -virial
    return a, b, {"sign": -virial, "size": 0.5 * virial}.get(pair.fault, virial)


@core_square.register
def _(pair: Cores, i, j, now):
    return 1.0


@dataclass(frozen=True)
class Mine:
    fault: str = ""

    def reach(self, scene):
        return 1.0

    def model(self, particles):
        wide = particles.with_ghost
        return Cores(self.fault, wide(particles.radii), wide(particles.masses))


@pytest.mark.parametrize(
    ("fault", "condition"),
    [
        ("sign", "virial"),
        ("size", "virial"),
        ("energy", "energy"),
        ("backwards", "V"),
        ("core", "core"),
        ("lost", "core"),
    ],
)
def test_a_wrong_pair_is_named_by_check_and_refused_by_a_simulation(fault, condition):
    assert condition in conditions(Mine(fault))
    with pytest.raises(InputError, match=r"condition of carom\.check"):
        carom.Simulation(SCENE.replace(interaction=Mine(fault)))


def test_one_unlike_component_among_many_is_tried():
    heavy = np.where(np.arange(SCENE.n) == 17, 2.0, 1.0)
    explain(SCENE.replace(interaction=Mine("unlike")))
    refused(SCENE.replace(interaction=Mine("unlike"), mass=heavy), "virial")


def test_an_interaction_of_ones_own_is_not_replaced_by_cores_that_grow():
    with pytest.raises(InputError, match="growth is of Carom's hard cores, and the interaction is a Mine"):
        carom.Simulation(SCENE.replace(interaction=Mine()), growth=0.1)


def test_a_right_pair_passes_though_its_contacts_may_lose_energy():
    for fault in ("", "clay"):
        assert conditions(Mine(fault)) == set()
        explain(SCENE.replace(interaction=Mine(fault)))


class Ledge(NamedTuple):
    """Spheres that cost energy while they are inside each other, with a fault."""

    fault: str
    energy: np.ndarray
    events: np.ndarray
    radii: np.ndarray
    masses: np.ndarray


@step_time.register
def _(pair: Ledge, i, j, step, rr, rv, vv, now):
    return exit_sphere(rr - 1.0, rv, vv) if step == 1 else first_contact(rr - 1.0, rv, vv)


@step_jump.register
def _(pair: Ledge, i, j, step, rr, rv, now):
    r = math.sqrt(rr)
    u = rv / r
    mu = pair.masses[i] * pair.masses[j] / (pair.masses[i] + pair.masses[j])
    cost = 2.0 * pair.energy[1] / mu
    if step == 0:
        left = u * u - (0.5 * cost if pair.fault == "in" else cost)
        new, after, kind = (-math.sqrt(left), 1, IN) if left > 0.0 else (-u, 0, CORE)
    else:
        new, after, kind = math.sqrt(u * u + (0.5 * cost if pair.fault == "out" else cost)), 0, OUT
    if pair.fault == "kind" and kind == OUT:
        kind = BOUNCE
    if pair.fault == "step" and kind == IN:
        after = 7
    p = mu * (new - u)
    virial = -p * r if pair.fault == "virial" else p * r
    return -p / (pair.masses[i] * r), -p / (pair.masses[j] * r), virial, after, kind


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
        size, wide = 2 ** step_bits(2), particles.with_ghost
        energy = np.zeros(3 if self.fault == "short" else size)
        energy[1] = float(particles.unit.to_kernel(1.0, -2))
        events = None if self.fault == "events" else np.zeros((size, 4), np.int64)
        return Ledge(self.fault, energy, events, wide(particles.radii), wide(particles.masses))


@pytest.mark.parametrize(
    ("fault", "condition"),
    [("in", "energy"), ("out", "energy"), ("virial", "virial"), ("kind", "step"), ("step", "step")],
)
def test_a_wrong_event_on_steps_is_named_by_check_and_refused_by_a_simulation(fault, condition):
    assert condition in conditions(Shoulder(fault))
    refused(SCENE.replace(interaction=Shoulder(fault)), condition)


def test_right_steps_pass_with_the_fields_that_the_documentation_asks_for():
    report = carom.check(Shoulder(), pairs=60)
    assert report.passed, report
    assert {"energy", "virial", "step", "V", "reach"} <= report.tried.keys()
    explain(SCENE.replace(interaction=Shoulder()))


def test_steps_that_are_not_to_keep_the_energy_say_so():
    assert conditions(Shoulder("in", keeps=False)) == set()
    explain(SCENE.replace(interaction=Shoulder("in", keeps=False)))
    assert conditions(StepTable(Steps([1.0, 1.5], [math.inf, -1.0], leaving=[math.inf, -1.5]))) == set()


def test_steps_beyond_the_reach_are_found():
    assert "reach" in conditions(Shoulder(far=0.7))
    with pytest.raises(InputError, match="act on each other 1 apart, beyond reach"):
        carom.Simulation(SCENE.replace(interaction=Shoulder(far=0.7)))


class Nowhere(Shoulder):
    steps_of = None


class Mute(Shoulder):
    def model(self, particles):
        return Mine().model(particles)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (Shoulder("events"), "Ledge has steps, and no array events"),
        (Nowhere(), "Nowhere has steps, and no steps_of: give it both"),
        (Mute(), "Mute has steps, and Cores does not answer step_time"),
    ],
)
def test_steps_without_a_part_are_refused_in_a_sentence(value, words):
    for make in (carom.check, lambda v: carom.Simulation(SCENE.replace(interaction=v))):
        with pytest.raises(InputError, match=words):
            make(value)


def test_an_energy_for_too_few_steps_is_refused():
    with pytest.raises(InputError, match=r"field energy of Ledge has the shape \(3,\); expected \(4,\)"):
        carom.Simulation(SCENE.replace(interaction=Shoulder("short")))


def test_an_interaction_is_tried_with_its_motion():
    assert conditions(DragCores(0.2), motion=Drag(0.2)) == set()
    assert "IV" in conditions(DragCores(0.2))
    assert "IV" in conditions(Mine(), motion=Drag(0.2))
    with pytest.raises(InputError, match="motion= goes with an interaction or an obstacle"):
        carom.check(Drag(0.2), motion=Drag(0.2))


@pytest.mark.parametrize("seed", range(6, 10))
def test_the_motion_on_great_circles_passes_whatever_the_seed(seed):
    report = carom.check(GreatCircles(), dimensions=(2, 3), pairs=60, seed=seed)
    assert report.passed, report


@dataclass(frozen=True)
class Bending(Curved):
    """Straight flight as curves, with times that are wrong at some rates of growth."""

    wrong_at: str = ""

    def model(self, particles):
        return Bent(particles.box, self.images, self.wrong_at)


class Bent(NamedTuple):
    edges: tuple
    images: bool
    wrong_at: str


for question in (position, velocity, carry):
    question.register(Bent, question.registry[type(Curved(images=True).model(SCENE))])


@meeting_time.register
def _(motion: Bent, me, other, now, contact, rate, limit, span):
    r, u = other.x - me.x, other.v - me.v
    t = first_contact(r @ r - contact * contact, r @ u - contact * rate, u @ u - rate * rate)
    late = {"rest": rate == 0.0, "growth": rate > 0.0}.get(motion.wrong_at, False)
    return (1.5 * t if late else t), False


def test_curves_are_tried_with_and_without_growth():
    assert conditions(Bending(images=False), dimensions=(2,)) == set()
    for wrong_at in ("rest", "growth"):
        assert "first" in conditions(Bending(images=False, wrong_at=wrong_at), dimensions=(2,))


class Turn(NamedTuple):
    """Charges of one frequency in a magnetic field, in the plane."""

    w: float
    edge: float


for question in (position, velocity):
    question.register(Turn, question.registry[Bent])


@carry.register
def _(motion: Turn, x, v, t, there, then):
    s, c = math.sin(motion.w * t), 2.0 * math.sin(0.5 * motion.w * t) ** 2
    vx, vy = v[0], v[1]
    there[0], there[1] = x[0] + (vx * s + vy * c) / motion.w, x[1] + (vy * s - vx * c) / motion.w
    then[0], then[1] = vx + vy * s - vx * c, vy - vx * s - vy * c
    return there, then, 0.0


@meeting_time.register
def _(motion: Turn, me, other, now, contact, rate, limit, span):
    def gap(t):
        apart = [carry(motion, each.x, each.v, t, np.empty(2), np.empty(2))[0] for each in (other, me)]
        return math.dist(*apart) - contact - rate * t

    times = np.linspace(0.0, 2.0 * math.pi / motion.w, 200)
    for before, after in itertools.pairwise(times.tolist()):
        if gap(before) > 0.0 >= gap(after):
            return brentq(gap, before, after, xtol=1e-14), False
    return NEVER, False


class Magnetic:
    straight, curved = False, True

    def conserves(self, axis):
        return False

    def model(self, particles):
        return Turn(1.5, float(particles.box[1]))


def test_a_motion_in_the_plane_passes_though_nobody_names_the_dimension():
    report = carom.check(Magnetic(), pairs=20)
    assert report.passed, report
    assert report.tried["first"] > 5
    assert "III" in conditions(Magnetic(), dimensions=(3,))
    with pytest.raises(InputError, match=r"Magnetic fails where Carom asks it .* IndexError"):
        carom.check(Magnetic(), dimensions=(1,))


class Part(NamedTuple):
    """The part that is exchanged, and a memory."""

    part: float
    asked: np.ndarray


@transfer.register
def _(impact: Part, rr, rv):
    return impact.part


@exchanged_part.register
def _(impact: Part, i, j, rr, rv, now):
    impact.asked[i] += 1
    return impact.part


class Law:
    def __init__(self, part, adds_energy=False):
        self.part, self.adds_energy, self.asked = part, adds_energy, np.zeros(31, np.int64)

    def model(self, particles):
        return Part(self.part, self.asked)


@pytest.mark.parametrize("part", [0.4, -1.0, math.nan])
def test_a_contact_law_that_leaves_two_approaching_is_refused(part):
    assert "part" in conditions(Law(part))
    refused(SCENE.replace(impact=Law(part)), "part")


def test_a_contact_law_that_adds_energy_says_so_or_a_simulation_warns():
    assert conditions(Law(1.5)) == {"gain"}
    assert conditions(Law(1.5, adds_energy=True)) == set()
    with pytest.warns(CaromWarning, match="Law makes energy. gain: not so that a contact adds no energy"):
        explain(SCENE.replace(impact=Law(1.5)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        explain(SCENE.replace(impact=Law(1.5, adds_energy=True)))


def test_what_is_tried_leaves_nothing_in_the_memory_of_a_value():
    law = Law(0.9)
    carom.check(law)
    explain(SCENE.replace(impact=law))
    assert not law.asked.any()


class Level(NamedTuple):
    """A floor at the height 1, with a fault."""

    fault: str


@encounter.register
def _(obstacle: Level, x, v, radius, growth):
    height = x[1] - 1.0 - radius
    if (obstacle.fault == "hair" and height < 0.0) or v[1] >= 0.0:
        return NEVER
    t = max(height / -v[1], 0.0)
    if obstacle.fault == "lost":
        return NEVER
    return t * {"late": 2.0, "early": 0.5}.get(obstacle.fault, 1.0)


@fall.register
def _(obstacle: Level, g, x, v, radius, growth, now):
    height, late = x[1] - 1.0 - radius, 1.25 if obstacle.fault == "late" else 1.0
    root = math.sqrt(max(v[1] * v[1] - 2.0 * g[1] * height, 0.0))
    if height <= 0.0 and v[1] < 0.0:
        return 0.0
    return late * (v[1] + root) / -g[1]


@outward.register
def _(obstacle: Level, x, axis):
    length = {"long": 1.1, "double": 2.0, "inwards": -1.0}.get(obstacle.fault, 1.0)
    return length if axis == 1 else 0.0


@recoil.register
def _(obstacle: Level, motion, i, mass, x, v, normal, growth, now):
    v[1] *= -1.5 if obstacle.fault == "gain" else -0.9


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


FAULTS = [
    ("late", "encounter"),
    ("early", "encounter"),
    ("lost", "encounter"),
    ("hair", "touching"),
    ("long", "outward"),
    ("double", "outward"),
    ("inwards", "outward"),
]


@pytest.mark.parametrize(("fault", "condition"), FAULTS)
def test_a_wrong_obstacle_is_named_by_check_and_refused_by_a_simulation(fault, condition):
    assert conditions(Floor(fault)) == {condition}
    refused(OPEN.replace(obstacles=[Floor(fault)]), condition)
    refused(OPEN.replace(obstacles=[Surface(Floor(fault), Loss(0.9, contact_time=1e-3))]), condition)


def test_obstacles_of_carom_are_not_tried_by_a_simulation(monkeypatch):
    tried = []
    monkeypatch.setattr(own_models, "refuse_obstacle", lambda value, *_: tried.append(value.name))
    usual = (
        Plane((0.0, 1.0), 0.5, "usual"),
        Shaken(Ball((4.0, 0.5), 0.25, "shaken"), (0, 1), Sine(0.1, 1.0)),
    )
    explain(OPEN.replace(obstacles=[*usual, Surface(Floor(name="own"), Loss(0.9, contact_time=1e-3))]))
    assert tried == ["own"]


def test_a_gap_of_the_wrong_sign_is_found():
    assert "encounter" in conditions(Floor(sense=-1.0))


def test_right_obstacles_pass():
    container = SphericalContainer((5.0, 5.0), 4.0)
    floor = Plane((0.0, 1.0), 1.0, "floor")
    own = (Floor(), Surface(Floor(), Loss(0.9, contact_time=1e-3)), Bouncy())
    usual = (floor, Ball((40.0, 50.0), 7.0), Cuboid((1, 1, 1), (3, 4, 2)), Segment((1, 2), (5, 3)), container)
    moving = (
        Shaken(floor, (0, 1), Sine(0.2, period=1.5)),
        Thermal(Shaken(container, (1, 0), Sine(0.2, 1.5)), 1.0),
    )
    for value in (*own, *usual, *moving):
        report = carom.check(value, pairs=60)
        assert report.passed, f"{value}: {report}"
        assert report.tried["V"] > 20, value
    for value in own:
        explain(OPEN.replace(obstacles=[value]))


def test_an_obstacle_is_tried_in_a_field():
    falling = Gravity((0.0, -1.0))
    assert conditions(Floor(), motion=falling) == set()
    assert "encounter" in conditions(Floor("late"), motion=falling)
    refused(OPEN.replace(motion=falling, obstacles=[Floor("late")]), "encounter")


def test_an_obstacle_whose_contacts_add_energy_says_so_or_a_simulation_warns():
    assert conditions(Bouncy("gain")) == {"gain"}
    with pytest.warns(CaromWarning, match="floor makes energy"):
        explain(OPEN.replace(obstacles=[Bouncy("gain")]))


class Swing(NamedTuple):
    w: float


@place.register
def _(path: Swing, t):
    return 0.2 * math.sin(path.w * t)


@pace.register
def _(path: Swing, t):
    return 0.2 * path.w * math.cos(path.w * t)


@dataclass(frozen=True)
class Swinging:
    """A sine whose acceleration is said to be smaller than it is."""

    part: float
    lowest, highest, period = -0.2, 0.2, 1.0

    @property
    def acceleration(self):
        return self.part * 0.2 * (2.0 * math.pi) ** 2

    def model(self, unit):
        return Swing(2.0 * math.pi / float(unit.to_kernel(self.period, 1)))


def test_bounds_of_a_path_of_ones_own_that_do_not_hold_are_found():
    floor = Plane((0.0, 1.0), 1.0, "floor")
    assert conditions(Shaken(floor, (0, 1), Swinging(1.0)), dimensions=(2,)) == set()
    assert "encounter" in conditions(Shaken(floor, (0, 1), Swinging(0.01)), dimensions=(2,))


def test_an_obstacle_that_is_none_is_refused_in_a_sentence():
    class Nameless:
        def gap(self, positions, radii, box, periodic):
            return radii

        def model(self):
            return None

    class Nowhere(Floor):
        def gap(self, positions, radii, box, periodic):
            return np.full(len(positions), -1.0)

    with pytest.raises(InputError, match="Nameless is an obstacle, as it has gap, and has no name"):
        carom.check(Nameless())
    with pytest.raises(InputError, match="No component near floor and outside of it was found"):
        carom.check(Nowhere())


class Walled(NamedTuple):
    """Free flight that meets walls after some part of the time."""

    part: float


@position.register
def _(motion: Walled, axis, x, v, t):
    return x + v * t


@velocity.register
def _(motion: Walled, axis, v, t):
    return v


@wall_meeting.register
def _(motion: Walled, walls, x, v, radius, growth):
    t, number = soonest_wall(walls, x, v, radius, growth)
    return motion.part * t, number


@dataclass(frozen=True)
class Late:
    part: float

    def model(self, particles):
        return Walled(self.part)


def test_a_motion_that_meets_walls_at_another_time_is_refused():
    explain(OPEN.replace(motion=Late(1.0)))
    for part in (0.5, 2.0):
        refused(OPEN.replace(motion=Late(part)), "encounter")


class Misspelt(NamedTuple):
    radii: np.ndarray
    masses: np.ndarray


@interaction_time.register
def _(pair: Misspelt, i, j, rr, rv, vv, now):
    return first_contact(rr - pair.square, rv, vv)


@jump.register
def _(pair: Misspelt, i, j, rr, rv, now):
    return elastic(pair, i, j, rr, rv)


class MisspeltCores(Parity):
    def model(self, particles):
        return Misspelt(particles.with_ghost(particles.radii), particles.with_ghost(particles.masses))


def test_a_function_that_fails_in_python_is_told_in_a_sentence():
    for make in (carom.check, lambda v: carom.Simulation(SCENE.replace(interaction=v))):
        with pytest.raises(InputError, match=r"MisspeltCores fails where Carom asks it .* AttributeError"):
            make(MisspeltCores())
