"""The pressure tensor: its trace is the virial, a fluid is isotropic, and a lone rod is computed by hand."""

import numpy as np
import pytest
from helpers.mixtures import mixture

import carom
from carom.block import Block, MomentumFlux
from carom.errors import InputError
from carom.models import Ball, Gravity, Shear, SquareWell
from carom.models.drives import Andersen
from carom.observables.pressure_tensor import StreamTensor

ROUNDING = 1e-10
"""Sums of some thousand products, relative to the pressure."""

FIVE = 5.0


SCENES = {
    "a mixture": mixture(
        [10, 6], diameters=[1.0, 0.5], masses=[1.0, 0.25], dimension=2, packing_fraction=0.3, seed=1
    ),
    "walls": carom.Scene.random(12, 0.3, 2, seed=1, walls=True),
    "an obstacle": carom.Scene.random(12, 0.3, 2, seed=1, obstacles=[Ball((2.0, 2.0), 1.0)]),
    "wells": carom.Scene.crystal(16, dimension=2, density=0.3, interaction=SquareWell(1.5, 1.0)),
}


@pytest.mark.filterwarnings("ignore::carom.CaromWarning")
@pytest.mark.parametrize("name", SCENES)
def test_the_trace_is_the_pressure_from_the_virial_of_the_same_stretch(plain, name):
    sim, alone = (carom.Simulation(SCENES[name], seed=1) for _ in range(2))
    pressure, found = sim.measure(carom.Pressure(), carom.PressureTensor(), time=3.0, blocks=8)
    assert sim.collisions > 20
    assert alone.measure(carom.Pressure(), time=3.0, blocks=8).pressure == pressure.pressure
    d = sim.scene.dimension
    assert found.pressure.mean == pytest.approx(pressure.pressure.mean, rel=ROUNDING)
    assert np.trace(found.tensor) / d == pytest.approx(pressure.pressure.mean, rel=ROUNDING)
    # Where kT fluctuates, both take it into account in a way of their own.
    assert found.pressure.error == pytest.approx(
        pressure.pressure.error, rel=0.8 if name == "wells" else 1e-6
    )
    assert found.tensor == pytest.approx(found.kinetic + found.collisional, rel=ROUNDING)
    assert (found.tensor == found.tensor.T).all()
    volume = sim.scene.volume
    assert np.trace(found.kinetic) == pytest.approx(d * sim.scene.n * pressure.kT / volume, rel=1e-9)


@pytest.mark.slow
def test_a_fluid_is_isotropic():
    sim = carom.Simulation(carom.Scene.random(64, 0.3, 2, seed=1), seed=1)
    sim.run(collisions_per_particle=20)
    found = sim.measure(carom.PressureTensor(), collisions_per_particle=1000)
    assert abs(found.tensor[0, 1]) < FIVE * found.error[0, 1]
    difference = found.tensor[0, 0] - found.tensor[1, 1]
    # Along a line of constant energy both differ in opposite ways: their errors add up.
    assert abs(difference) < FIVE * (found.error[0, 0] + found.error[1, 1])
    assert found.error.max() < 0.05 * found.pressure.mean


@pytest.mark.filterwarnings("ignore::carom.CaromWarning")
@pytest.mark.parametrize(("along", "edge"), [([1.0, 0.0], 8.0), ([0.5**0.5, 0.5**0.5], 8.0 * 2.0**0.5)])
def test_two_disks_on_a_line_press_along_it_alone(plain, along, edge):
    places, velocities = np.outer([-2.0, 2.0], along) + 4.0, np.outer([1.0, -1.0], along)
    sim = carom.Simulation(carom.Scene(places, (8.0, 8.0), velocities=velocities))
    # From one contact to the next they move an edge less 2 towards each other, at a relative speed of 2.
    period = (edge - 2.0) / 2.0
    found = sim.measure(carom.PressureTensor(), time=40 * period, blocks=40).tensor
    # Half of all freedom is that of the center of mass: the kinetic part is twice what both carry.
    right = (2.0 * 2.0 + 2.0 / period) / 64.0 * np.outer(along, along)
    assert found == pytest.approx(right, rel=1e-9, abs=1e-12)


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


@pytest.mark.parametrize("d", [2, 3, 4])
def test_a_sheared_box_has_the_tensor_viscosity_and_normal_stresses_of_its_blocks(d):
    """Any numbers will do for sums. Of three particles, the center of mass takes a third of the motion."""
    rng = np.random.default_rng(d)
    durations, sums = rng.uniform(1.0, 2.0, 16), rng.uniform(1.0, 2.0, (16, 2, d, d))
    scene = carom.Scene(np.linspace(1.0, 4.0, 3)[:, None] * np.ones(d), (5.0,) * d, motion=Shear(0.5))
    stretch = StreamTensor(scene)
    for time, (carried, handed_over) in zip(durations, sums, strict=True):
        stretch.add(Block(time, 1, 99.0, momentum_flux=MomentumFlux(carried, handed_over)))
    found = stretch.result()
    kinetic, collisional = sums.sum(axis=0) * np.array([1.5, 1.0])[:, None, None] / 5.0**d / durations.sum()
    assert found.kinetic == pytest.approx(kinetic)
    assert found.collisional == pytest.approx(collisional)
    assert found.tensor == pytest.approx(kinetic + collisional)
    along = np.diag(kinetic + collisional)
    assert found.pressure.mean == pytest.approx(along.mean())
    assert found.viscosity.mean == pytest.approx(-2.0 * found.tensor[1, 0])
    assert [each.mean for each in found.normal_stresses] == pytest.approx(
        along[: min(d, 3) - 1] - along[1 : min(d, 3)]
    )
