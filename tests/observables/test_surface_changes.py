"""The force on obstacles of any shape: what sound carries to and fro is taken off, and the mean stays."""

import math
import warnings
from dataclasses import dataclass

import numpy as np
import pytest

import carom
from carom.block import Block
from carom.errors import CaromWarning
from carom.models import Ball, Plane, Segment
from carom.models.obstacles.named_walls import axes_without
from carom.observables import WallPressure
from carom.observables.analysis.surface_changes import MOST, freed, place_of, surface_sums
from carom.observables.statistics import ratio
from carom.simulation.measuring import stretches


@dataclass(frozen=True)
class Post:
    """A ball as a user would write it: Carom knows its distance from the components, not its field."""

    center: tuple[float, ...]
    radius: float
    name: str = "post"

    def check(self, box, periodic):
        return

    def gap(self, positions, radii, box, periodic):
        return self.model_of.gap(positions, radii, box, periodic)

    def model(self):
        return self.model_of.model()

    @property
    def model_of(self):
        return Ball(self.center, self.radius)


SLANTING = Plane((1.0, 1.0), 4.0, "slope")


@pytest.mark.usefixtures("both_ways")
def test_a_contact_changes_the_first_sum_by_what_the_obstacle_takes_up():
    scene = carom.Scene(
        [[5.0, 6.0]], 9.0, mass=2.0, velocities=[[-1.0, -0.5]], walls=True, obstacles=(SLANTING,)
    )
    sim = carom.Simulation(scene, seed=0)
    before = surface_sums(sim.frame(), scene)
    sim.run(time=5.0)
    slope = sim.obstacles[4]
    assert (slope.name, slope.hits) == ("slope", 1)
    after = surface_sums(sim.frame(), scene)
    # Distances are taken 2^-20 edges apart and hold 2^-52 of an edge.
    assert after[0] - before[0] == pytest.approx(slope.impulse, rel=1e-8)
    distance = SLANTING.gap(sim.frame().positions, np.array([0.5]), scene.box, scene.periodic)[0]
    assert after[1] == pytest.approx(after[0] * distance / 4.5, rel=1e-8)


def test_the_sound_of_an_obstacle_is_taken_off_by_its_own_sums():
    posts = (Post((8.0, 8.0), 0.5, "a"), Post((8.0, 3.0), 0.5, "b"), Post((2.0, 3.0), 0.5, "c"))
    scene = carom.Scene([[2.0, 8.0]], 10.0, obstacles=posts)
    rng = np.random.default_rng(1)
    durations, sums = rng.uniform(1.0, 2.0, 64), rng.normal(size=(64, 6))
    weights = rng.normal(size=(3, 2))
    for k in range(3):
        sound = sums[:, 2 * k : 2 * k + 2] @ weights[k]
        blocks = [
            Block(time, 1, 0.0, impulses=(9.0,) * k + (4.0 * time + more,) + (9.0,) * (2 - k),
                  surface_changes=tuple(changes))
            for time, more, changes in zip(durations, sound, sums, strict=True)
        ]  # fmt: skip
        found = WallPressure(k, area=2.0).of_scene(blocks, scene, kT=1.0)
        assert found.force.mean == pytest.approx(4.0, rel=1e-12)
        assert found.force.error < 1e-12
        assert found.pressure.mean == pytest.approx(2.0, rel=1e-12)


@pytest.mark.usefixtures("unscheduled")
def test_only_obstacles_without_a_field_have_sums():
    known = (Plane((0.0, 1.0), 0.3), Ball((5.0, 5.0), 1.0))
    scene = carom.Scene(
        [[2.0, 8.0]],
        10.0,
        velocities=[[1.0, 0.0]],
        walls="y",
        obstacles=(*known, Post((8.0, 8.0), 0.5), Post((8.0, 3.0), 0.5)),
    )
    assert [place_of(scene, k) for k in range(6)] == [None, None, None, None, 0, 2]
    frame = carom.Simulation(scene, seed=0).frame()
    assert len(surface_sums(frame, scene)) == 4
    many = scene.replace(obstacles=[Post((8.0, 8.0), 0.5)] * (MOST + 1))
    assert surface_sums(frame, many) == ()
    assert surface_sums(frame, scene.replace(obstacles=known)) == ()


def test_what_comes_back_leaves_the_mean_and_takes_the_scatter():
    rng = np.random.default_rng(4)
    n = 256
    steady = 3.0 + 0.1 * rng.normal(size=n)
    sums = np.column_stack([np.sin(np.arange(n + 1) * 2.0 * math.pi / 37.0), np.cos(np.arange(n + 1) / 5.0)])
    changes = np.diff(sums, axis=0)
    impulses = steady - 4.0 * changes[:, 0] + 9.0 * changes[:, 1]
    found, flux = freed(impulses, changes, np.full(n, 2.0))
    np.testing.assert_allclose(flux, steady, atol=0.2)  # multiples are known to 0.1 of what scatters
    assert found.error < 2.0 * ratio(steady, np.full(n, 2.0)).error
    # The mean differs by the change of bounded sums over the whole, divided by its length.
    assert abs(found.mean - impulses.sum() / (2.0 * n)) < 13.0 * 2.0 / (2.0 * n)


def test_of_a_few_blocks_the_momentum_stays_as_it_is():
    rng = np.random.default_rng(5)
    impulses, durations = rng.random(15), np.full(15, 0.5)
    found, flux = freed(impulses, rng.normal(size=(15, 2)), durations)
    assert flux is impulses
    assert found.mean == ratio(impulses, durations).mean


@pytest.mark.parametrize(("n", "groups"), [(64, 64), (160, 64), (20, 20)])
def test_an_error_bar_knows_what_a_regression_takes_by_chance(n, groups):
    # A regression on m columns of noise takes m of the n - 1 parts of the scatter of n stretches.
    rng = np.random.default_rng(6)
    impulses, changes, durations = 1.0 + rng.normal(size=n), rng.normal(size=(n, 2)), np.ones(n)
    found, flux = freed(impulses, changes, durations)
    starts = np.linspace(0, n, groups + 1).astype(int)[:-1]
    left = ratio(np.add.reduceat(flux, starts), np.add.reduceat(durations, starts))
    assert found.error**2 == pytest.approx(left.error**2 * (groups - 1) / (groups - 3))


CASES = [
    ("slope", (False, False), (SLANTING,)),
    ("post", (True, True), (Post((6.0, 6.0), 2.0),)),
    ("segment", (True, False), (Segment((3.0, 4.0), (7.0, 7.0)),)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "periodic", "obstacles"), CASES)
def test_error_bars_of_any_obstacle_cover(name, periodic, obstacles):
    """Of the momentum taken up alone the pulls of the slope would be 0.5."""
    runs, forces = 100, []
    for seed in range(runs):
        scene = carom.Scene.random(
            60,
            dimension=2,
            packing_fraction=0.25,
            walls=axes_without(periodic),
            seed=seed,
            obstacles=obstacles,
        )
        sim = carom.Simulation(scene, seed=seed)
        sim.run(collisions_per_particle=30)
        with warnings.catch_warnings():
            # One of a thousand sound runs is called drifting, and there are many here.
            warnings.simplefilter("ignore", CaromWarning)
            blocks = list(stretches.blocks(sim, stretches.time_for(sim, 128 * 30) / 256, 256))
            forces.append(
                [
                    stretches.estimate(sim, WallPressure(name, 1.0), series).force
                    for series in (blocks, [block._replace(surface_changes=()) for block in blocks])
                ]
            )
    rms = []
    for route in zip(*forces, strict=True):
        means = np.array([force.mean for force in route])
        pulls = (means - means.mean()) / [force.error for force in route]
        rms.append(math.sqrt(np.sum(pulls**2) / (runs - 1)))
    print(name, "pulls", rms[0], "and of the momentum taken up", rms[1])
    assert 0.8 < rms[0] < 1.25
