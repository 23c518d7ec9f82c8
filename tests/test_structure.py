"""Structure on the way: density profiles and running coordination numbers."""

import numpy as np
import pytest

import carom
from carom.errors import InputError
from carom.observables import DensityProfile


def test_a_uniform_fluid_has_a_flat_profile():
    sim = carom.Simulation(carom.Scene.fcc(cells=3, packing_fraction=0.3), seed=1)
    sim.run(collisions_per_particle=30)
    found = sim.measure(DensityProfile(axis=1, bins=8, blocks=128), collisions_per_particle=200)
    assert len(found.middle) == 8
    density = sim.scene.number_density
    # All bins together hold everybody, at every time.
    assert np.mean([e.mean for e in found.density]) == pytest.approx(density, rel=1e-12)
    for each in found.density:
        assert each.mean == pytest.approx(density, abs=5.0 * each.error)


def test_an_ideal_profile_is_counted_by_hand():
    positions = np.array([[0.5, 0.5], [2.5, 1.0], [2.75, 3.0]])
    scene = carom.Scene(positions, 4.0, diameter=0.25, velocities=np.zeros((3, 2)))
    profile = DensityProfile(axis=0, bins=4)
    for _ in range(20):
        profile.update(carom.Simulation(scene).frame())
    found = profile.result()
    assert [e.mean for e in found.density] == [0.25, 0.0, 0.5, 0.0]


def test_an_axis_that_is_none_is_refused():
    frame = carom.Simulation(carom.Scene.fcc(cells=3, packing_fraction=0.3)).frame()
    with pytest.raises(InputError, match="axis"):
        DensityProfile(axis=3).update(frame)


def test_running_coordination_counts_the_shells_of_a_crystal():
    scene = carom.Scene.fcc(cells=4, packing_fraction=0.5)
    frame = carom.Simulation(scene).frame()
    found = carom.rdf([frame], rmax=2.2, width=0.05)
    nearest = (0.5 * np.sqrt(2.0)) * scene.box[0] / 4
    number, error = found.coordination()
    assert (np.diff(error) >= 0.0).all()
    between = np.searchsorted(found.edges[1:], 1.2 * nearest)
    assert number[between] == pytest.approx(12.0, rel=1e-9)
    second = np.searchsorted(found.edges[1:], 1.55 * nearest)
    assert number[second] == pytest.approx(18.0, rel=1e-9)
