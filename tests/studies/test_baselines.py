"""Baselines of the engine: compiled stepping is the stepping that is written to be read, and pseudo hard
spheres are what their article says.
"""

import math

import numpy as np
import pytest
from benchmarks.lammps_spheres import LammpsSpheres
from helpers.marks import slow
from helpers.naive.stepping import SteppedSystem

import carom
from carom.baselines.pairs import PairList
from carom.baselines.pseudo_hard import CUT, PseudoHardSpheres
from carom.baselines.stepping import Stepper
from carom.studies.trade.trade import melted

EPS = np.finfo(float).eps


def start(n, dimension, packing_fraction, seed=1):
    """Return spheres in motion without the engine: random places, Gaussian velocities without a drift."""
    scene = carom.Scene.random(n, packing_fraction, dimension, seed=seed)
    v = np.random.default_rng(seed).normal(size=(n, dimension))
    return scene.positions, v - v.mean(axis=0), np.asarray(scene.box)


@pytest.mark.parametrize(
    ("n", "dimension", "packing_fraction"),
    [slow(20, 1, 0.4), (100, 2, 0.4), (150, 3, 0.2), slow(120, 4, 0.05)],
)
@pytest.mark.parametrize("reach", [1.2, 1.7])
def test_every_pair_in_reach_is_listed_once(n, dimension, packing_fraction, reach):
    positions, _, box = start(n, dimension, packing_fraction)
    pairs = PairList(box, n)
    pairs.renew(np.ascontiguousarray(positions.T), reach)
    found = {frozenset(pair) for pair in zip(pairs.first.tolist(), pairs.second.tolist(), strict=True)}
    assert len(found) == pairs.count  # nobody twice
    r = positions[:, None] - positions[None]
    r -= box * np.rint(r / box)
    near = np.argwhere(np.triu((r * r).sum(axis=2) < reach**2, 1))
    if 2 * reach > box.min():
        assert pairs.count == n * (n - 1) // 2
    else:
        assert found == {frozenset(pair) for pair in near.tolist()}


def test_stepping_in_the_smallest_box_misses_no_pair():
    """Two meet 1.23 diameters away from where they were listed, in a box of two."""
    system = SteppedSystem([[0.0, 0.0], [0.9, 1.0]], [[0.0, 0.0], [0.0, -1.0]], [2.0, 2.0], step=0.01)
    [first] = system.run(60)[:1]
    assert first.time == pytest.approx(1.0 - math.sqrt(1.0 - 0.81), rel=1e-12)
    assert system.worst_overlap < 0.01


@pytest.mark.parametrize(
    ("n", "dimension", "packing_fraction"),
    [slow(12, 1, 0.7), slow(64, 2, 0.4), (64, 3, 0.25), slow(40, 4, 0.05)],
)
def test_compiled_stepping_makes_the_collisions_of_the_one_that_is_written_to_be_read(
    n, dimension, packing_fraction
):
    positions, velocities, box = start(n, dimension, packing_fraction)
    plain = SteppedSystem(positions, velocities, box, step=0.004)
    swift = Stepper(positions, velocities, box, step=0.004, skin=0.2)
    # Rounding differs, and grows: the first collisions a particle are the same.
    before, found = plain.run(250), swift.run(250, log=True)
    assert len(before) > n / 4
    assert [tuple(sorted(c[1:])) for c in found] == [(c.i, c.j) for c in before]
    np.testing.assert_allclose([c[0] for c in found], [c.time for c in before], rtol=1e-9)
    assert swift.collisions == plain.collisions == len(found)
    assert swift.virial == pytest.approx(plain.virial, rel=1e-9)
    assert swift.worst_overlap == pytest.approx(plain.worst_overlap, rel=1e-6)
    np.testing.assert_allclose(swift.positions, plain.positions, atol=1e-8)
    np.testing.assert_allclose(swift.velocities, plain.velocities, atol=1e-8)


def test_the_skin_changes_nothing_but_the_time():
    positions, velocities, box = start(100, 2, 0.5)
    runs = [Stepper(positions, velocities, box, step=0.01, skin=skin) for skin in (0.02, 0.3, None)]
    orders = [[pair[1:] for pair in run.run(60, log=True)] for run in runs]
    # The order of two within a list may differ, the pairs do not.
    first = [tuple(sorted(pair)) for pair in orders[0]]
    assert first
    assert all([tuple(sorted(pair)) for pair in order] == first for order in orders)


def test_the_force_between_pseudo_hard_spheres_is_the_slope_of_their_potential():
    def energy(r):
        system = PseudoHardSpheres(
            [[1.0, 1.0, 1.0], [1.0 + r, 1.0, 1.0]], np.zeros((2, 3)), [5.0] * 3, step=1e-3, skin=0.1
        )
        return system.energy, float(system._f[0].max())

    assert energy(CUT * (1 + 1e-12))[0] == 0.0  # cut at the minimum, and shifted
    assert energy(1.0)[0] == pytest.approx(1.0 / 1.5)  # u(sigma) = epsilon = 2 kT / 3
    for r in (0.97, 0.99, 1.01):
        h = 1e-6
        slope = (energy(r + h)[0] - energy(r - h)[0]) / (2 * h)
        assert energy(r)[1] == pytest.approx(-slope, rel=1e-6)


def test_the_error_of_verlet_falls_with_the_square_of_the_step():
    positions, velocities, box = start(64, 3, 0.25)
    drifts = []
    for step in (4e-4, 2e-4, 1e-4):
        system = PseudoHardSpheres(positions, velocities, box, step=step, skin=0.2)
        begin = system.energy
        worst = 0.0
        for _ in range(40):
            system.run(round(2e-3 / step))
            worst = max(worst, abs(system.energy - begin) / begin)
        drifts.append(worst)
    # The next order, of the fourth power, and rounding change these by a hundredth or two.
    assert drifts[0] / drifts[1] == pytest.approx(4.0, rel=0.1)
    assert drifts[1] / drifts[2] == pytest.approx(4.0, rel=0.1)


def test_equilibration_leaves_nothing_in_the_sums():
    system = PseudoHardSpheres([[1.0] * 3, [1.97, 1.0, 1.0]], np.eye(2, 3), [5.0] * 3, step=1e-3, skin=0.1)
    system.run(1)
    assert system.closest < 1.0
    system.equilibrate(50)
    assert (system.steps, system.virial, system.action, system.closest) == (0, 0.0, 0.0, 5.0)


@pytest.mark.slow
def test_pseudo_hard_spheres_keep_their_temperature_and_have_the_pressure_of_hard_ones():
    scene, _ = melted(carom.Scene.crystal(cells=4, density=0.5), 1)
    system = PseudoHardSpheres(scene.positions, scene.velocities, scene.box, step=2e-3)
    system.equilibrate(2000)
    begin = system.energy
    system.run(6000)
    kT = 2.0 * system.action / system.time / (3 * (scene.n - 1))
    assert abs(system.energy - begin) / system.kinetic_energy < 0.01
    assert kT == pytest.approx(1.0, abs=0.02)
    z = 1.0 + system.virial / system.time / (3 * scene.n * kT)
    # Jover et al. have Z within a percent; 7 units of time of 256 spheres are good for two more.
    assert z == pytest.approx(3.2694, rel=0.03)
    assert 0.94 < system.closest < 1.0


@pytest.mark.needs("LAMMPS")
def test_lammps_moves_pseudo_hard_spheres_as_carom_does():
    scene, _ = melted(carom.Scene.crystal(cells=3, density=0.5), 1)
    ours, theirs = (
        make(scene.positions, scene.velocities, scene.box, step=1e-3)
        for make in (PseudoHardSpheres, LammpsSpheres)
    )
    assert ours.energy == pytest.approx(theirs.energy, rel=64 * EPS)
    for system in (ours, theirs):
        system.run(200)
    away = ours.positions - theirs.positions
    away -= np.asarray(scene.box) * np.rint(away / scene.box)
    # Roundings that grew for two mean free times; e^5 a mean free time, a hundred of them a step.
    assert np.abs(away).max() < 1e-9
    assert math.isclose(ours.energy, theirs.energy, rel_tol=1e-9)
    theirs.close()
