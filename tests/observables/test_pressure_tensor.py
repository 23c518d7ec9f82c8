"""The pressure tensor: its trace is the virial, a fluid is isotropic, and a lone rod is computed by hand."""

import numpy as np
import pytest
from helpers.marks import slow
from helpers.plain import plain_python

import carom
from carom.errors import InputError
from carom.models import Ball, Gravity, SquareWell
from carom.models.drives import Andersen

ROUNDING = 1e-10
"""Sums of some thousand products, relative to the pressure."""

FIVE = 5.0


def disks(**more):
    sim = carom.Simulation(carom.Scene.random(64, 0.3, 2, seed=1, **more), seed=1)
    sim.run(collisions_per_particle=20)
    return sim


SCENES = {
    "a mixture": lambda: carom.Simulation(
        carom.Scene.random(
            dimension=2,
            packing_fraction=0.3,
            species=[carom.Species(count=40), carom.Species(count=24, diameter=0.5, mass=0.25)],
            seed=1,
        ),
        seed=1,
    ),
    "walls": lambda: disks(walls=True),
    "an obstacle": lambda: disks(obstacles=[Ball((3.0, 3.0), 1.0)]),
    "wells": lambda: carom.Simulation(
        carom.Scene.crystal(108, density=0.3, interaction=SquareWell(1.5, 1.0)), seed=1
    ),
}


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("name", ["a mixture", slow("walls"), slow("an obstacle"), "wells"])
def test_the_trace_is_the_pressure_from_the_virial_of_the_same_stretch(name):
    sim = SCENES[name]()
    pressure, found = sim.measure(
        carom.Pressure(), carom.PressureTensor(), collisions_per_particle=60, blocks=32
    )
    d = sim.scene.dimension
    assert found.pressure.mean == pytest.approx(pressure.pressure.mean, rel=ROUNDING)
    assert np.trace(found.tensor) / d == pytest.approx(pressure.pressure.mean, rel=ROUNDING)
    # Where kT fluctuates, both take it into account in a way of their own.
    assert found.pressure.error == pytest.approx(
        pressure.pressure.error, rel=0.2 if name == "wells" else 1e-6
    )
    assert found.tensor == pytest.approx(found.kinetic + found.collisional, rel=ROUNDING)
    assert (found.tensor == found.tensor.T).all()
    volume = sim.scene.volume
    assert np.trace(found.kinetic) == pytest.approx(d * sim.scene.n * pressure.kT / volume, rel=1e-9)


def test_a_fluid_is_isotropic_and_nothing_changes_the_run():
    sim, plain = disks(), disks()
    found = sim.measure(carom.PressureTensor(), collisions_per_particle=1000)
    plain.measure(carom.Pressure(), collisions_per_particle=1000)
    assert (sim.frame().positions == plain.frame().positions).all()
    assert abs(found.tensor[0, 1]) < FIVE * found.error[0, 1]
    difference = found.tensor[0, 0] - found.tensor[1, 1]
    # Along a line of constant energy both differ in opposite ways: their errors add up.
    assert abs(difference) < FIVE * (found.error[0, 0] + found.error[1, 1])
    assert found.error.max() < 0.05 * found.pressure.mean


def test_between_walls_it_is_the_force_on_each():
    sim = disks(walls="y")
    tensor, low, high = sim.measure(
        carom.PressureTensor(),
        carom.WallPressure("y_low"),
        carom.WallPressure("y_high"),
        collisions_per_particle=2000,
    )
    edge = sim.scene.box[1]
    # A centre turns back half a diameter before a wall: the free length of the axis.
    wall = 0.5 * (low.pressure.mean + high.pressure.mean) * (edge - 1.0) / edge
    error = tensor.error[1, 1] + 0.5 * (low.pressure.error + high.pressure.error)
    assert abs(tensor.tensor[1, 1] - wall) < FIVE * error


TWO_DISKS = """
import carom
positions, velocities = [[2.0, 5.0], [6.0, 5.0]], [[1.0, 0.0], [-1.0, 0.0]]
sim = carom.Simulation(carom.Scene(positions, (8.0, 8.0), velocities=velocities))
print(*sim.measure(carom.PressureTensor(), time=600.0, blocks=200).tensor.ravel())
"""


def test_two_disks_on_a_line_press_along_it_alone():
    found = [float(text) for text in plain_python("-c", TWO_DISKS).split()]
    # From one contact to the next they move 6 towards each other, at a relative speed of 2: once in 3.
    kinetic, collisional = 2.0, 2.0 / 3.0
    # Half of all freedom is that of the centre of mass: the kinetic part is twice what both carry.
    assert found[0] == pytest.approx((2.0 * kinetic + collisional) / 64.0, rel=1e-2)
    assert found[1:] == [0.0, 0.0, 0.0]


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize(
    ("change", "settings", "says"),
    [
        ({"pinned": [0]}, {}, "pinned"),
        ({"motion": Gravity((0.0, -1.0))}, {}, "momentum"),
        ({"drive": Andersen(1.0, rate=1.0)}, {}, "drive"),
        ({}, {"growth": 0.1}, "do not grow"),
    ],
)
def test_it_is_refused_where_events_do_not_tell_it(change, settings, says):
    scene = carom.Scene([[2.0, 5.0], [6.0, 5.0]], (8.0, 8.0)).replace(**change)
    with pytest.raises(InputError, match=says):
        carom.Simulation(scene, **settings).measure(carom.PressureTensor(), time=1.0)
