"""S(k): by hand, of rods, beside Percus and Yevick; profiles of species; coordination; their error bars."""

import numpy as np
import pytest
from helpers.frames import at_rest, frame_of
from helpers.mixtures import mixture

import carom
from carom import RDF, DensityProfile, StructureFactor, theory

FIVE = 5.0


@pytest.mark.parametrize("box", [(7.0,), (7.0, 9.0), (5.0, 5.0, 5.0), (3.0, 3.0, 3.0, 3.0)])
def test_it_is_the_square_of_a_sum_over_particles(box):
    frame = frame_of(np.random.default_rng(1).random((20, len(box))) * box, box, 1e-9)
    found = StructureFactor(kmax=2.5).over([frame])
    counts = np.stack(np.meshgrid(*[np.arange(-6, 7)] * len(box), indexing="ij"), -1).reshape(-1, len(box))
    k = 2.0 * np.pi * counts / np.array(box)
    lengths = np.sqrt(np.sum(k * k, axis=1))
    assert found.k.max() <= 2.5 < lengths[lengths > found.k.max() * (1 + 1e-9)].min()
    values = np.abs(np.exp(1j * frame.positions @ k.T).sum(axis=0)) ** 2 / 20
    for length, value, vectors in zip(found.k, found.S, found.vectors, strict=True):
        of = np.abs(lengths - length) < 1e-9 * length
        assert of.sum() == 2 * vectors
        assert value == pytest.approx(values[of].mean(), rel=1e-9)


def test_dilute_spheres_agree_with_percus_and_yevick():
    sim = carom.Simulation(carom.Scene.random(256, 0.1, 3, seed=1), seed=1)
    sim.run(collisions_per_particle=50)
    found = sim.measure(StructureFactor(shells=24), collisions_per_particle=300, blocks=512)
    right = theory.structure_factor(found.k, 0.1)
    assert (np.abs(found.S - right) < FIVE * found.error + 0.01).all()
    assert found.S[0] < 0.6  # far from that of an ideal gas


def test_rods_have_the_exact_structure_factor():
    # Points anywhere on a ring, between any two of which a rod is put.
    rng = np.random.default_rng(1)
    points = [np.sort(rng.uniform(0.0, 150.0, 100)) for _ in range(400)]
    frames = [frame_of((each + np.arange(100))[:, None], (250.0,)) for each in points]
    found = StructureFactor(shells=40).over(frames)
    right = theory.structure_factor(found.k, 0.4, dimension=1)
    # Of n rods it differs by the order of 1 / n.
    assert (np.abs(found.S - right) < FIVE * found.error + 2.0 / 100).all()


@pytest.mark.parametrize(
    "observable", [StructureFactor(shells=8), DensityProfile(bins=8)], ids=["S(k)", "profile"]
)
@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
def test_error_bars_cover(observable):
    """Of 40 short runs of a small system, about the mean of all: a root mean square near one."""
    sim = carom.Simulation(carom.Scene.random(32, 0.3, 2, seed=1), seed=1)
    sim.run(collisions_per_particle=50)
    runs = [sim.measure(observable, collisions_per_particle=60, blocks=64) for _ in range(40)]
    name = "S" if hasattr(runs[0], "S") else "density"
    values, errors = (np.array([getattr(run, key) for run in runs]) for key in (name, "error"))
    pulls = (values - values.mean(axis=0)) / errors
    # 40 runs and 8 numbers of each: known to a tenth, and to less as shells of a run are not independent.
    assert 0.8 < np.sqrt(np.mean(pulls**2) * 40 / 39) < 1.2


def test_the_profile_of_a_species_counts_that_species_alone():
    positions = np.array([[0.5, 0.5], [2.5, 1.0], [2.75, 3.0], [1.5, 2.0]])
    frame = frame_of(positions, (4.0, 4.0), 0.25, species=np.array([0, 1, 0, 2]))
    expected = {0: [0.25, 0.0, 0.25, 0.0], 1: [0.0, 0.0, 0.25, 0.0], 2: [0.0, 0.25, 0.0, 0.0]}
    for species, right in expected.items():
        profile = DensityProfile(bins=4, species=species)
        for _ in range(2):
            profile.add(frame)
        assert profile.result().density.tolist() == right


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
    here, there = (RDF(pair=p, bins=50, rmax=rmax).over([frame]) for p in (("a", "b"), ("b", "a")))
    number = here.coordination()[0][-1]
    assert 20 * number == pytest.approx(40 * there.coordination()[0][-1])
    one, two = (frame.positions[frame.species == k] for k in (0, 1))
    gaps = one[:, None] - two
    gaps -= np.array(scene.box) * np.rint(gaps / np.array(scene.box))
    near = np.sqrt(np.sum(gaps**2, axis=2)) < rmax
    assert 20 * number == pytest.approx(near.sum())
