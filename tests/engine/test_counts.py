"""Counts that are known exactly, and scenes of every kind scaled by powers of two."""

import math

import numpy as np
import pytest
from helpers import oracle_scenes
from helpers.marks import slow

import carom
from carom.models import Ball, Restitution
from carom.models.obstacles.named_walls import axes_without
from carom.simulation.measuring import stretches


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(("edge", "each"), [(2.5, 2), (9.0, 0)])
def test_two_rods_on_a_ring_schedule_each_other_again_at_once_only_if_they_see_around_it(edge, each):
    # Both halves of a collision do: m* = i*. On a long ring sectors are crossed before.
    scene = carom.Scene([[0.5], [0.5 + 0.5 * edge]], (edge,), velocities=[[1.0], [-1.0]])
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"), seed=0)
    sim.run(collisions=10)
    assert sim.statistics.third_party_first == 10 * each


def test_hits_of_walls_are_no_advancements(plain):
    scene = carom.Scene([[1.0, 2.0]], (5.0, 6.0), velocities=[[1.0, 0.7]], walls=True)
    sim = carom.Simulation(scene, seed=0)
    sim.run(time=50.0)
    hits = [
        1 + math.floor((50.0 - ahead / speed) / (width / speed))
        for ahead, width, speed in [(3.5, 4.0, 1.0), (3.5, 5.0, 0.7)]
    ]
    assert sum(impact.hits for impact in sim.obstacles) == sum(hits)
    assert sim.statistics.advancements == 0
    assert sim.statistics.advancement_fraction == 0.0


@pytest.mark.slow
def test_a_preempted_partner_is_one_advancement():
    # 0 and 1 are to meet at time 2. At 1 a lighter one kicks 1 out of the way, and flies off itself.
    places, velocities = [[2.0, 5.0], [5.0, 5.0], [5.0, 8.0]], [[1.0, 0.0], [0.0, 0.0], [0.0, -2.0]]
    scene = carom.Scene(places, (12.0, 12.0), velocities=velocities, mass=[1.0, 1.0, 0.5])
    sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"), seed=0)
    sim.run(time=1.9)
    assert (sim.collisions, sim.statistics.advancements) == (1, 0)
    sim.run(time=0.2)
    assert (sim.collisions, sim.statistics.advancements) == (1, 1)


def scaled(scene, length, mass, speed):
    """Return the scene in other units, powers of two."""
    return carom.Scene(
        scene.positions * length,
        np.array(scene.box) * length,
        diameter=scene.diameters * length,
        mass=scene.masses * mass,
        velocities=scene.velocities * speed,
        walls=axes_without(scene.periodic),
        obstacles=tuple(
            Ball(tuple(length * x for x in ball.center), length * ball.radius, ball.name)
            for ball in scene.obstacles
        ),
        impact=Restitution(
            scene.impact.restitution,
            elastic_below=None if scene.impact.elastic_below is None else scene.impact.elastic_below * speed,
        ),
    )


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("make", ["unequal", slow("boxed"), slow("lorentz"), slow("inelastic"), "growing"])
@pytest.mark.parametrize("units", [(2.0**37, 2.0**-21, 2.0**13), (2.0**-60, 2.0**44, 2.0**-9)])
def test_scenes_of_every_kind_are_free_of_scale(make, units):
    length, mass, speed = units
    case = getattr(oracle_scenes, make)(2)
    usual = scaled(case.scene, 1.0, 1.0, 1.0)
    growth = case.settings.get("growth")
    sims = [
        carom.Simulation(usual, growth=growth, seed=0),
        carom.Simulation(scaled(usual, *units), growth=None if growth is None else growth * speed, seed=0),
    ]
    for sim in sims:
        sim.run(collisions=12)
    one, other = (sim.frame() for sim in sims)
    assert sims[1].time == sims[0].time * length / speed
    np.testing.assert_array_equal(other.positions, one.positions * length)
    np.testing.assert_array_equal(other.velocities, one.velocities * speed)
    np.testing.assert_array_equal(other.diameters, one.diameters * length)
    assert stretches.tally(sims[1]).virial == stretches.tally(sims[0]).virial * mass * length * speed
    for a, b in zip(sims[0].obstacles, sims[1].obstacles, strict=True):
        assert (a.hits, a.impulse * mass * speed) == (b.hits, b.impulse)
    assert sims[1].statistics.spared_contacts == sims[0].statistics.spared_contacts
