"""What ``carom.check`` lets pass, and what it finds of curves, motions and paths."""

import math
from dataclasses import dataclass

import pytest
from helpers.faulty import (
    OPEN,
    SCENE,
    Bouncy,
    Curve,
    Curved,
    Drag,
    DragCores,
    Floor,
    Law,
    Mine,
    Shoulder,
    conditions,
)
from helpers.magnetic import Magnetic

import carom
from carom.models import Active, Andersen, Ball, Brownian, Cuboid, Plane, Segment, SphericalContainer
from carom.models.contacts.losses import Loss
from carom.models.contacts.restitution import Restitution
from carom.models.interactions.growing_cores import Growing
from carom.models.interactions.hard_cores import HardCores
from carom.models.interactions.steps import Steps
from carom.models.interactions.wells import StepTable
from carom.models.interfaces.obstacle import PathModel
from carom.models.mathematics.contact import first_contact
from carom.models.motions.free_flight import FreeFlight
from carom.models.motions.gravity import Gravity
from carom.models.motions.great_circles import GreatCircles
from carom.models.obstacles.paths import Sine
from carom.models.obstacles.with_properties import Shaken, Surface, Thermal
from carom.simulation.explanation import explain
from carom.simulation.model_validation import own_models


def test_a_right_pair_passes_though_its_contacts_may_lose_energy():
    assert conditions(Mine()) == conditions(Mine("clay")) == set()


def test_right_steps_pass_with_the_fields_that_the_documentation_asks_for():
    report = carom.check(Shoulder(), pairs=60)
    assert report.passed, report
    assert {"energy", "virial", "step", "V", "reach"} <= report.tried.keys()


def test_steps_that_are_not_to_keep_the_energy_say_so():
    assert conditions(Shoulder("in", keeps=False)) == set()
    assert conditions(StepTable(Steps([1.0, 1.5], [math.inf, -1.0], leaving=[math.inf, -1.5]))) == set()


def test_an_interaction_is_tried_with_its_motion():
    assert conditions(DragCores(0.2), motion=Drag(0.2)) == set()
    assert "IV" in conditions(DragCores(0.2))
    assert "IV" in conditions(Mine(), motion=Drag(0.2))


OF_CAROM = [
    (HardCores(), {}),
    (HardCores([[1.0, 0.7], [0.7, 0.8]]), {}),
    (Growing(), {}),
    (FreeFlight(), {}),
    (Gravity((0.3, -0.5, 0.0, 0.1)), {"dimensions": (4,)}),
    (Gravity((-0.7,)), {"dimensions": (1,)}),
    (Restitution(0.7, 0.1), {}),
    (Loss(0.8, contact_time=1.0), {}),
    (Loss(0.8, elastic_below=0.1, at_speed=1.0), {}),
    (Andersen(1.0, 1.0), {}),
    (Brownian(1.0, step=0.01), {}),
    (Active(2.0, 3.0, 0.01, kind="tumble"), {}),
    (Plane((0.0, 1.0), 0.0, impact=0.9), {"dimensions": (2,)}),
    (Ball((2.0, 2.0), 0.5, kT=2.0), {"dimensions": (2,)}),
]


@pytest.mark.parametrize(("value", "options"), OF_CAROM)
def test_models_of_carom_keep_all_conditions(value, options):
    report = carom.check(value, pairs=120, **options)
    assert report.passed, report
    assert min(report.tried.values()) >= 100


@pytest.mark.parametrize("seed", [6, 7])
def test_the_motion_on_great_circles_passes_whatever_the_seed(seed):
    report = carom.check(GreatCircles(), dimensions=(2, 3, 4), pairs=60, seed=seed)
    assert report.passed, report
    assert {"I", "III", "IV", "V", "first", "energy"} <= report.tried.keys()


@dataclass(frozen=True)
class Bending(Curved):
    """Straight flight as curves, with times that are wrong at some rates of growth."""

    wrong_at: str = ""

    def model(self, particles):
        return Bent(particles.box, self.images, self.wrong_at)


class Bent(Curve):
    wrong_at: str = ""

    def meeting_time(self, me, other, now, contact, rate, limit, span):
        r, u = other.x - me.x, other.v - me.v
        t = first_contact(r @ r - contact * contact, r @ u - contact * rate, u @ u - rate * rate)
        late = {"rest": rate == 0.0, "growth": rate > 0.0}.get(self.wrong_at, False)
        return (1.5 * t if late else t), False


def test_curves_are_tried_with_and_without_growth():
    assert conditions(Bending(images=False), dimensions=(2,)) == set()
    for wrong_at in ("rest", "growth"):
        assert "first" in conditions(Bending(images=False, wrong_at=wrong_at), dimensions=(2,))


def test_a_motion_in_the_plane_passes_though_nobody_names_the_dimension():
    report = carom.check(Magnetic(1.5), pairs=20)
    assert report.passed, report
    assert report.tried["first"] > 5
    assert "III" in conditions(Magnetic(1.5), dimensions=(3,))


def test_what_is_tried_leaves_nothing_in_the_memory_of_a_value():
    law = Law(0.9)
    carom.check(law)
    explain(SCENE.replace(impact=law))
    assert not law.asked.any()


def test_obstacles_of_carom_are_not_tried_by_a_simulation(monkeypatch):
    tried = []
    monkeypatch.setitem(own_models.TRIALS, "obstacle", lambda value, *_: tried.append(value.name))
    usual = (
        Plane((0.0, 1.0), 0.5, "usual"),
        Shaken(Ball((4.0, 0.5), 0.25, "shaken"), (0, 1), Sine(0.1, 1.0)),
    )
    explain(OPEN.replace(obstacles=[*usual, Surface(Floor(name="own"), Loss(0.9, contact_time=1e-3))]))
    assert tried == ["own"]
    explain(OPEN.replace(obstacles=[Floor(name=f"{k}") for k in range(31)]))
    assert len(tried) == 1 + own_models.SEVERAL


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


class Swing(PathModel):
    w: float

    def place(self, t):
        return 0.2 * math.sin(self.w * t)

    def pace(self, t):
        return 0.2 * self.w * math.cos(self.w * t)


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
