"""S(k): by hand, of an ideal gas, from g(r), and beside Percus and Yevick; its error bars cover."""

import numpy as np
import pytest

import carom
from carom import theory
from carom.errors import InputError
from carom.frame import Frame

FIVE = 5.0


def gas(n, box, seed, species=None):
    d = len(box)
    positions = np.random.default_rng(seed).random((n, d)) * box
    ones = np.ones(n)
    return Frame(
        0.1 * seed, seed, positions, np.zeros((n, d)), box, 1e-9 * ones, ones, species=species,
        species_names=() if species is None else ("a", "b"),
    )  # fmt: skip


@pytest.mark.parametrize("box", [(7.0,), (7.0, 9.0), (5.0, 5.0, 5.0), (3.0, 3.0, 3.0, 3.0)])
def test_it_is_the_square_of_a_sum_over_particles(box):
    frame = gas(20, box, 1)
    found = carom.StructureFactor(kmax=2.5).over([frame])
    counts = np.stack(np.meshgrid(*[np.arange(-6, 7)] * len(box), indexing="ij"), -1).reshape(-1, len(box))
    k = 2.0 * np.pi * counts / np.array(box)
    lengths = np.sqrt(np.sum(k * k, axis=1))
    assert found.k.max() <= 2.5 < lengths[lengths > found.k.max() * (1 + 1e-9)].min()
    values = np.abs(np.exp(1j * frame.positions @ k.T).sum(axis=0)) ** 2 / 20
    for length, value, vectors in zip(found.k, found.S, found.vectors, strict=True):
        of = np.abs(lengths - length) < 1e-9 * length
        assert of.sum() == 2 * vectors
        assert value == pytest.approx(values[of].mean(), rel=1e-9)


@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_an_ideal_gas_has_one_and_two_species_of_it_nothing_in_common(dimension):
    species = (np.arange(60) % 3 == 0).astype(np.int64)
    frames = [gas(60, (6.0,) * dimension, seed, species) for seed in range(400)]
    for pair, right in ((None, 1.0), (("a", "a"), 1.0), ((0, 1), 0.0)):
        found = carom.StructureFactor(shells=6, pair=pair).over(frames)
        assert (np.abs(found.S - right) < FIVE * found.error).all()
        assert found.error.max() < 0.1
    assert found.pair == (0, 1)


def test_dilute_spheres_agree_with_percus_and_yevick():
    sim = carom.Simulation(carom.Scene.random(256, 0.1, 3, seed=1), seed=1)
    sim.run(collisions_per_particle=50)
    found = sim.measure(carom.StructureFactor(shells=24), collisions_per_particle=300, blocks=512)
    right = theory.structure_factor(found.k, 0.1)
    assert (np.abs(found.S - right) < FIVE * found.error + 0.01).all()
    assert found.S[0] < 0.6  # far from that of an ideal gas


def test_it_is_the_transform_of_the_correlation_of_pairs():
    """S(k) = 1 + rho int (g - 1) exp(ikr); g of n particles goes to 1 at n (n - 1) pairs, and to 1 beyond."""
    sim = carom.Simulation(carom.Scene.random(64, 0.3, 2, seed=1), seed=1)
    sim.run(collisions_per_particle=50)
    frames = list(sim.sample(every=0.5, count=200))
    found = carom.StructureFactor(shells=12).over(frames)
    # At a wave vector of the box, the sum over all pairs within it is exact, whatever the shape of the range.
    k = 2.0 * np.pi * np.array([[1, 0], [0, 1]]) / np.array(sim.scene.box)
    pairs = []
    for frame in frames:
        r = frame.positions[:, None] - frame.positions[None]
        pairs.append([np.cos(r @ each).sum() / frame.n for each in k])
    assert found.S[0] == pytest.approx(np.mean(pairs), rel=1e-9)


def test_rods_have_the_exact_structure_factor():
    # Points anywhere on a ring, between any two of which a rod is put.
    rng, edge, ones = np.random.default_rng(1), (250.0,), np.ones(100)
    frames = [
        Frame(float(k), k, (np.sort(rng.uniform(0.0, 150.0, 100)) + np.arange(100))[:, None],
              np.zeros((100, 1)), edge, ones, ones)
        for k in range(400)
    ]  # fmt: skip
    found = carom.StructureFactor(shells=40).over(frames)
    right = theory.structure_factor(found.k, 0.4, dimension=1)
    # Of n rods it differs by the order of 1 / n.
    assert (np.abs(found.S - right) < FIVE * found.error + 2.0 / 100).all()


def test_theory_has_its_limits():
    assert theory.structure_factor(0.0, 0.4, dimension=1) == pytest.approx(0.36, rel=1e-12)
    compressibility = (1.0 - 0.3) ** 4 / (1.0 + 2.0 * 0.3) ** 2  # of the Percus-Yevick equation
    assert theory.structure_factor(0.0, 0.3) == pytest.approx(compressibility, rel=1e-12)
    assert theory.structure_factor(np.array([1e3]), 0.3)[0] == pytest.approx(1.0, abs=1e-3)
    assert theory.structure_factor(7.0, 0.3) == theory.structure_factor(3.5, 0.3, diameter=2.0)
    with pytest.raises(InputError, match="1 and 3"):
        theory.structure_factor(1.0, 0.3, dimension=2)


@pytest.mark.parametrize(
    "observable", [carom.StructureFactor(shells=8), carom.DensityProfile(bins=8)], ids=["S(k)", "profile"]
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


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: carom.StructureFactor(shells=3, kmax=2.0), "one of them"),
        (lambda: carom.StructureFactor(shells=0), "shells"),
        (lambda: carom.StructureFactor(kmax=0.1).over([gas(9, (4.0, 4.0), 1)]), "shortest wave vector"),
        (lambda: carom.StructureFactor(kmax=1e5).over([gas(9, (4.0, 4.0), 1)]), "more than"),
        (lambda: carom.StructureFactor().over([]), "No frame"),
        (lambda: carom.StructureFactor().over([gas(9, (4.0, 4.0), 1), gas(8, (4.0, 4.0), 1)]), "same system"),
        (lambda: carom.StructureFactor(pair=(0, 1)).over([gas(9, (4.0, 4.0), 1)]), "no species"),
    ],
)
def test_what_cannot_be_measured_is_refused(make, says):
    with pytest.raises(InputError, match=says):
        make()
