"""Structure on the way: density profiles and running coordination numbers."""

import numpy as np
import pytest
from helpers.frames import at_rest, frame_of
from helpers.mixtures import mixture

import carom
from carom.errors import InputError
from carom.observables import RDF, DensityProfile


@pytest.mark.usefixtures("unscheduled")
def test_a_profile_of_a_species_that_is_not_there_is_refused():
    scene = mixture([5, 5], diameters=[1.0, 0.5], packing_fraction=0.05, dimension=2, seed=1)
    frame = carom.Simulation(scene, seed=0).frame()
    DensityProfile(species=1).add(frame)
    with pytest.raises(InputError, match="species is 2; known are 0, 1"):
        DensityProfile(species=2).add(frame)


def test_a_uniform_fluid_has_a_flat_profile():
    sim = carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=1)
    sim.run(collisions_per_particle=30)
    found = sim.measure(DensityProfile(axis=1, bins=8), collisions_per_particle=200, blocks=128)
    assert len(found.middle) == 8
    density = sim.scene.number_density
    # All bins together hold everybody, at every time.
    assert np.mean(found.density) == pytest.approx(density, rel=1e-12)
    assert (np.abs(found.density - density) < 5.0 * found.error).all()


def test_an_ideal_profile_is_counted_by_hand():
    positions = np.array([[0.5, 0.5], [2.5, 1.0], [2.75, 3.0]])
    scene = carom.Scene(positions, 4.0, diameter=0.25, velocities=np.zeros((3, 2)))
    profile = DensityProfile(axis=0, bins=4)
    for _ in range(20):
        profile.add(carom.Simulation(scene, seed=0).frame())
    found = profile.result()
    assert found.density.tolist() == [0.25, 0.0, 0.5, 0.0]


def test_the_profile_of_a_species_counts_that_species_alone():
    positions = np.array([[0.5, 0.5], [2.5, 1.0], [2.75, 3.0], [1.5, 2.0]])
    frame = frame_of(positions, (4.0, 4.0), 0.25, species=np.array([0, 1, 0, 2]))
    expected = {0: [0.25, 0.0, 0.25, 0.0], 1: [0.0, 0.0, 0.25, 0.0], 2: [0.0, 0.25, 0.0, 0.0]}
    for species, right in expected.items():
        profile = DensityProfile(bins=4, species=species)
        for _ in range(2):
            profile.add(frame)
        assert profile.result().density.tolist() == right


def test_an_axis_that_is_none_is_refused():
    frame = carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=0).frame()
    with pytest.raises(InputError, match="axis"):
        DensityProfile(axis=3).add(frame)


def test_running_coordination_counts_the_shells_of_a_crystal():
    scene = carom.Scene.crystal(cells=4, packing_fraction=0.5)
    frame = carom.Simulation(scene, seed=0).frame()
    found = carom.RDF(rmax=2.2, width=0.05).over([frame])
    nearest = (0.5 * np.sqrt(2.0)) * scene.box[0] / 4
    number, error = found.coordination()
    assert (np.diff(error) >= 0.0).all()
    between = np.searchsorted(found.edges[1:], 1.2 * nearest)
    assert number[between] == pytest.approx(12.0, rel=1e-9)
    second = np.searchsorted(found.edges[1:], 1.55 * nearest)
    assert number[second] == pytest.approx(18.0, rel=1e-9)


def test_error_bars_of_running_coordination_are_the_scatter_of_runs():
    sim = carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.4), seed=1)
    sim.run(collisions_per_particle=50)
    found = [sim.measure(RDF(rmax=1.75, width=0.05), time=8.0, blocks=32).coordination() for _ in range(50)]
    numbers, errors = (np.array([each[k] for each in found]) for k in (0, 1))
    # A standard deviation of 50 runs in a row is known to some 12 %. Bins counted as independent gave 2.5
    # times as much.
    ratio = np.sqrt(np.mean(errors**2, axis=0)) / numbers.std(axis=0, ddof=1)
    assert ratio == pytest.approx(np.ones_like(ratio), abs=0.5)


def test_running_coordination_of_two_species_counts_each_others_neighbors():
    scene = mixture([20, 40], names=["a", "b"], dimension=3, packing_fraction=0.2, seed=1)
    frame = at_rest(scene, species_names=("a", "b"))
    rmax = 0.45 * min(scene.box)
    here, there = (carom.RDF(pair=p, bins=50, rmax=rmax).over([frame]) for p in (("a", "b"), ("b", "a")))
    number = here.coordination()[0][-1]
    assert 20 * number == pytest.approx(40 * there.coordination()[0][-1])
    one, two = (frame.positions[frame.species == k] for k in (0, 1))
    gaps = one[:, None] - two
    gaps -= np.array(scene.box) * np.rint(gaps / np.array(scene.box))
    near = np.sqrt(np.sum(gaps**2, axis=2)) < rmax
    assert 20 * number == pytest.approx(near.sum())
