"""The pressure tensor: its trace is the virial, layers have its mean, a fluid is isotropic, a rod by hand."""

import numpy as np
import pytest
from helpers.mixtures import mixture

import carom
from carom.block import Block, MomentumFlux
from carom.models import Andersen, Ball, Shear, SquareWell
from carom.observables.pressure_tensor import StreamTensor

ROUNDING = 1e-10
"""Sums of some thousand products, relative to the pressure."""

FIVE = 5.0


SCENES = {
    "a mixture": mixture(
        [10, 6], diameters=[1.0, 0.5], masses=[1.0, 0.25], dimension=2, packing_fraction=0.3, seed=1
    ),
    "walls": carom.Scene.random(12, 0.3, 2, seed=1, walls=True),
    "walls of an axis": carom.Scene.random(12, 0.3, 2, seed=1, walls="x"),
    "an obstacle": carom.Scene.random(12, 0.3, 2, seed=1, obstacles=[Ball((2.0, 2.0), 1.0)]),
    "wells": carom.Scene.crystal(16, dimension=2, density=0.3, interaction=SquareWell(1.5, 1.0)),
    "rods": carom.Scene.random(12, 0.5, 1, seed=1),
}


@pytest.mark.filterwarnings("ignore::carom.CaromWarning")
@pytest.mark.parametrize("name", SCENES)
def test_the_trace_is_the_pressure_from_the_virial_and_the_mean_over_the_layers_the_tensor(plain, name):
    sim, alone = (carom.Simulation(SCENES[name], seed=1) for _ in range(2))
    d = sim.scene.dimension
    kinds = carom.Pressure(), carom.PressureTensor(), carom.PressureProfile(axis=d - 1, bins=7)
    pressure, found, layers = sim.measure(*kinds, time=3.0, blocks=8)
    assert sim.collisions > 20
    assert alone.measure(carom.Pressure(), time=3.0, blocks=8).pressure == pressure.pressure
    assert found.pressure.mean == pytest.approx(pressure.pressure.mean, rel=ROUNDING)
    assert np.trace(found.tensor) / d == pytest.approx(pressure.pressure.mean, rel=ROUNDING)
    # Where kT fluctuates, both take it into account in a way of their own.
    assert found.pressure.error == pytest.approx(
        pressure.pressure.error, rel=0.8 if name == "wells" else 1e-6
    )
    assert found.tensor == pytest.approx(found.kinetic + found.collisional, rel=ROUNDING)
    assert (found.tensor == found.tensor.T).all()
    density = sim.scene.n / sim.scene.volume
    assert np.trace(found.kinetic) == pytest.approx(d * density * pressure.kT, rel=1e-9)
    scale = np.abs(found.collisional).max()
    assert layers.collisional.mean(axis=0) == pytest.approx(
        found.collisional, rel=ROUNDING, abs=ROUNDING * scale
    )
    assert np.ptp(layers.collisional[:, 0, 0]) > 0.0
    scaled = 0.1 if name == "walls of an axis" else ROUNDING  # 1 / n of it
    assert layers.kinetic.mean(axis=0) == pytest.approx(found.kinetic, abs=scaled * np.trace(found.kinetic))
    assert np.mean(layers.density) == pytest.approx(density, rel=ROUNDING)


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


@pytest.mark.parametrize(("d", "n", "drive", "factor"), [
    (2, 3, None, 1.5), (3, 3, None, 1.5), (4, 3, None, 1.5),
    (3, 3, Andersen(1.0, 1.0), 1.0), (2, 1, None, 1.0),
])  # fmt: skip
def test_a_sheared_box_has_the_tensor_viscosity_and_normal_stresses_of_its_blocks(d, n, drive, factor):
    """Any numbers will do for sums. Of three particles, a center of mass whose momentum is conserved takes a
    third of the motion.
    """
    rng = np.random.default_rng(d)
    durations, sums = rng.uniform(1.0, 2.0, 16), rng.uniform(1.0, 2.0, (16, 2, d, d))
    places = np.linspace(1.0, 4.0, n)[:, None] * np.ones(d)
    scene = carom.Scene(places, (5.0,) * d, motion=Shear(0.5), drive=drive)
    stretch = StreamTensor(scene)
    for time, (carried, handed_over) in zip(durations, sums, strict=True):
        stretch.add(Block(time, 1, 99.0, momentum_flux=MomentumFlux(carried, handed_over)))
    found = stretch.result()
    kinetic, collisional = sums.sum(axis=0) / 5.0**d / durations.sum()
    kinetic *= factor
    assert found.kinetic == pytest.approx(kinetic)
    assert found.collisional == pytest.approx(collisional)
    assert found.tensor == pytest.approx(kinetic + collisional)
    along = np.diag(kinetic + collisional)
    assert found.pressure.mean == pytest.approx(along.mean())
    assert found.viscosity.mean == pytest.approx(-2.0 * found.tensor[1, 0])
    assert [each.mean for each in found.normal_stresses] == pytest.approx(
        along[: min(d, 3) - 1] - along[1 : min(d, 3)]
    )
