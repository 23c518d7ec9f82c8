"""Drives: exact averages, bits that nothing changes, drives of one's own, and what is refused."""

import json
import math

import numpy as np
import pytest
from helpers.estimates import agrees
from helpers.mixtures import mixture

import carom
from carom.errors import InputError
from carom.models import Active, SquareWell, own
from carom.models.drives import Andersen, Brownian, Langevin
from carom.models.interfaces.particles import NEVER, Particles
from carom.models.motions.gravity import Gravity
from carom.models.motions.great_circles import GreatCircles
from carom.models.white_noise import WhiteNoise, opponent, partner, rounds
from carom.observables import HelfandCurrents
from carom.observables.statistics import blocking
from carom.scene_file.scene_file import SceneFile
from carom.simulation.measuring import stretches
from carom.units import TimeUnit

SLOW = pytest.mark.slow

FOUR_SIGMA = 4.0
"""Above the standard error of some 40 averages in this file: one run in 400 would fail by chance, once."""


@own.drive
class OneWay:
    """Who comes from above is turned round."""

    place: float
    turned = own.memory(0)

    @own.prepared
    def edge(self, particles):
        return particles.box[0]

    def next_time(self, i, x, v, time):
        if v[0] >= 0.0:
            return NEVER
        return time + ((x[0] - self.place) % self.edge) / -v[0]

    def kick(self, i, mass, x, v, time):
        v[0] = -v[0]
        self.turned[i] += 1


def disks(drive, n=64, **changes):
    return carom.Scene.random(n, 0.3, 2, seed=1).replace(drive=drive, **changes)


def caps():
    points = [[5.0, 4.0, 4.0], [4.0, 5.0, 4.0]]
    return carom.Scene(points, box=(8.0,) * 3, diameter=0.4, motion=GreatCircles())


def heated(scene):
    carom.Simulation(scene).equilibrate(kT=2.0, collisions_per_particle=1)


@pytest.mark.parametrize("drive", [Andersen(0.7, rate=3.0), Langevin(0.7, friction=2.0, step=0.3)])
def test_disks_in_a_bath_have_the_energies_of_the_canonical_distribution(drive):
    sim = carom.Simulation(disks(drive), kT=2.0, seed=1)
    sim.run(time=20.0)
    degrees = 2 * 64  # no momentum is conserved
    energies = np.array([0.5 * np.sum(f.velocities**2) for f in sim.sample(every=0.5, count=4000)])
    assert agrees(energies, 0.5 * degrees * 0.7)
    assert agrees((energies - 0.5 * degrees * 0.7) ** 2, 0.5 * degrees * 0.7**2)
    assert sim.degrees_of_freedom == degrees


@SLOW
def test_each_species_has_the_temperature_of_its_bath():
    sizes = {"diameters": [1, 0.5], "masses": [1, 4]}
    scene = mixture([20, 20], **sizes, dimension=2, packing_fraction=0.02)
    sim = carom.Simulation(scene.replace(drive=Andersen((1.0, 3.0), rate=200.0)), seed=1)
    sim.run(time=1.0)
    # So often that collisions take no heat from one to the other: 0.02 of them come between two kicks.
    found = [f.masses * np.sum(f.velocities**2, axis=1) / 2 for f in sim.sample(every=0.05, count=1000)]
    for kind, kT in enumerate((1.0, 3.0)):
        assert np.mean(found, axis=0)[scene.species == kind].mean() == pytest.approx(kT, rel=0.03)


@pytest.mark.parametrize("d", [pytest.param(1, marks=SLOW), 2, pytest.param(3, marks=SLOW)])
def test_a_free_particle_forgets_its_velocity_at_the_rate_of_the_bath(d):
    """<v(0) v(t)> = (kT / m) exp(-rate t): events of a Poisson process."""
    scene = carom.Scene.random(256, dimension=d, box=(4e7,) * d, seed=1, mass=2.0).replace(
        drive=Andersen(3.0, rate=0.5)
    )
    sim = carom.Simulation(scene, kT=3.0, seed=1)
    v = np.array([f.velocities for f in sim.sample(every=1.0, count=400)])
    assert sim.collisions < 100  # points, nearly
    for lag in (1, 3):
        correlation = np.mean(v[lag:] * v[:-lag], axis=(1, 2))
        assert agrees(correlation, 1.5 * math.exp(-0.5 * lag))


@pytest.mark.parametrize(
    "drive", [Brownian(3.0, step=0.5), Langevin(3.0, friction=2.0, step=0.5)], ids=["Brownian", "Langevin"]
)
def test_a_free_particle_diffuses_as_its_steps_say(drive):
    scene = carom.Scene.random(256, dimension=2, box=(4e7, 4e7), seed=1, mass=2.0).replace(drive=drive)
    sim = carom.Simulation(scene, kT=3.0, seed=1)
    x = np.array([f.unwrapped[:, 0] for f in sim.sample(every=20.0, count=400)])
    square = np.mean(np.diff(x, axis=0) ** 2, axis=1)
    c = drive.diffusion(mass=2.0), getattr(drive, "friction", math.inf)
    kept = math.exp(-c[1] * 0.5)
    # Displacements over k steps: 2 D t less what the first and the last remember.
    k, s2 = 40, 3.0 / 2.0 * 0.25
    exact = s2 * (k * (1 + kept) / (1 - kept) - 2 * kept * (1 - kept**k) / (1 - kept) ** 2)
    # Between kicks that come in the middle of a sample's interval the first and the last step are parts:
    # the exact value for whole steps is off by less than the square of one step.
    found = blocking(square)
    assert abs(found.mean - exact) < FOUR_SIGMA * found.error + s2
    assert 2.0 * c[0] * 20.0 == pytest.approx(exact, rel=0.1)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_no_draw_of_a_bath_is_used_twice(d):
    count, six_sigma = 6000, 6.0
    bath = Andersen(1.0, rate=1.0, seed=5).model(
        Particles((20.0,) * d, np.full(2, 0.5), np.ones(2), None, None, True, TimeUnit())
    )
    v, due = np.zeros((count, d)), [bath.due[1]]
    for k in range(count):
        bath.kick(1, 1.0, np.zeros(d), v[k], due[k])
        due.append(bath.next_time(1, np.zeros(d), v[k], due[k]))
    # In the order of the draws. By reflection x y^2 is nothing on average, with a variance of 3; numbers that
    # share a draw have 0.28, if it is the angle of one and the size of the other.
    x, waits = v.ravel(), np.repeat(np.diff(due) - 1.0, d)
    for lag in range(1, 2 * d + 1):
        for a, b in ((x[lag:], x[:-lag]), (x[:-lag], x[lag:])):
            assert abs((a * b**2).mean()) < six_sigma * math.sqrt(3.0 / len(a))
    # A wait less its mean has the variance 1. It would have 1 together with a size, and 0.28 with an angle.
    for shift in range(-d, d + 1):
        y = np.roll(x, shift)
        assert abs((waits * y).mean()) < six_sigma * math.sqrt(1.0 / count)
        assert abs((waits * (y**2 - 1.0)).mean()) < six_sigma * math.sqrt(2.0 / count)


@pytest.mark.slow
def test_two_disks_in_a_bath_are_bound_with_the_probability_of_boltzmann():
    kT, box, width = 0.8, 4.0, 1.5
    scene = carom.Scene([[0.5, 0.5], [2.5, 2.5]], box=(box, box), interaction=SquareWell(width, 1.0))
    sim = carom.Simulation(scene.replace(drive=Andersen(kT, rate=1.0)), seed=1)
    inside = []
    for frame in sim.sample(every=1.0, count=20_000):
        r = frame.positions[1] - frame.positions[0]
        r -= box * np.rint(r / box)
        inside.append(float(np.sum(r * r) < width**2))
    well = math.pi * (width**2 - 1.0) * math.exp(1.0 / kT)
    assert agrees(np.array(inside), well / (well + box**2 - math.pi * width**2))


@SLOW
def test_heavy_disks_in_a_bath_stand_at_the_heights_of_the_barometric_formula():
    scene = carom.Scene.random(8, dimension=2, box=(60.0, 9.0), walls="y", mass=2.0, seed=1, diameter=1e-3)
    scene = scene.replace(motion=Gravity((0.0, -0.5)), drive=Andersen(1.5, rate=0.3))
    sim = carom.Simulation(scene, kT=1.5, seed=1)
    heights = np.array([f.positions[:, 1].mean() for f in sim.sample(every=3.0, count=6000)])
    height, length = 1.5 / (2.0 * 0.5), 9.0
    exact = height - length / math.expm1(length / height)
    assert agrees(heights, exact)


@pytest.mark.slow
@pytest.mark.parametrize(("d", "pairs"), [(2, True), (3, False)])
def test_white_noise_gives_what_contacts_lose(d, pairs):
    """van Noije and Ernst, Granular Matter 1 (1998) 57; in a box too small for waves of velocity.

    Noise of single particles moves them all together, too, further and further: no contact takes that. So
    velocities count relative to their mean.
    """
    e, power = 0.9, 0.1
    scene = carom.Scene.random(256, 0.05, d, impact=e, seed=1)
    sim = carom.Simulation(scene.replace(drive=WhiteNoise(power, rate=20.0, pairs=pairs)), seed=1)
    sim.run(collisions_per_particle=100)
    collisions, start = sim.collisions, sim.time
    found = []
    for frame in sim.sample(every=0.5, count=2000):
        relative = frame.velocities - frame.velocities.mean(axis=0)
        found.append((relative**2).sum() / (d * 255))
    kT = np.mean(found)
    # Enskog's collisions a time and particle, and Sonine's coefficient a2.
    a2 = 16 * (1 - e) * (1 - 2 * e**2) / (9 + 24 * d + 8 * d * e - 41 * e + 30 * (1 - e) * e**2)
    rate = (sim.collisions - collisions) * 2 / 256 / (sim.time - start)
    omega = rate / math.sqrt(kT) / (1 + 3 * a2 / 16)
    # Kicks in pairs heat 255 d degrees of freedom with the power of 256 d.
    heat = power * (256 / 255 if pairs else 1.0)
    theory = (d * heat / ((1 - e**2) * omega * (1 + 3 * a2 / 16))) ** (2 / 3)
    # The error of the mean is .8 % in the plane.
    assert kT == pytest.approx(theory, rel=0.025)
    assert np.mean(found[:1000]) == pytest.approx(np.mean(found[1000:]), rel=0.05)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(("d", "n"), [(1, 5), (2, 7), (3, 8)])
def test_noise_in_pairs_conserves_momentum_and_heats_by_its_power(d, n):
    """No contact matters in so thin a gas: the energy grows by d m power / 2 a time."""
    rng = np.random.default_rng(5)
    masses = rng.uniform(0.5, 4.0, n)
    scene = carom.Scene(
        np.arange(n)[:, None] * np.ones(d) + 0.5, box=(1e3,) * d, diameter=1e-6, mass=masses,
        drive=WhiteNoise(0.3, rate=2.0, pairs=True),
    )  # fmt: skip
    sim = carom.Simulation(scene, kT=1.0, seed=1)
    before = sim.frame().velocities
    assert sim.degrees_of_freedom == (n - 1) * d
    sim.run(time=50.0)
    kicks = sim.drive.drawn
    assert kicks.min() >= 99  # at the rate, and none is left out
    assert kicks.max() <= 100
    # Of an odd number one is left out of each round, and the others get more.
    kicked = np.mean([partner(sim.drive, i, k) != i for i in range(n) for k in range(20)])
    assert sim.drive.width**2 * kicked == pytest.approx(0.3 / 2.0, rel=1e-12)
    after = sim.frame().velocities
    rounding = 2.0**-52 * 100 * n * np.abs(masses[:, None] * after).max()
    assert np.abs(masses @ (after - before)).max() < rounding
    # Squares of normal numbers, one a degree of freedom.
    heat = 0.5 * d * masses.sum() * 0.3 * 50.0
    gained = 0.5 * masses @ (after**2 - before**2).sum(axis=1)
    assert abs(gained - heat) < FOUR_SIGMA * math.sqrt(2 / (d * (n - 1))) * heat


@pytest.mark.parametrize("n", [2, 3, 8, 9])
def test_in_a_tournament_everybody_meets_each_other_once(n):
    met = [(i, opponent(i, n, r)) for r in range(rounds(n)) for i in range(n)]
    assert all((j, i) in met for i, j in met)
    assert sorted((i, j) for i, j in met if i != j) == [(i, j) for i in range(n) for j in range(n) if i != j]


@pytest.mark.slow
def test_a_growing_fluid_keeps_the_temperature_of_its_bath():
    """Its engine is made anew time and again: the memory of the drive goes along."""
    sim = carom.Simulation(disks(Andersen(1.0, rate=20.0)), growth=0.05, seed=1)
    sim.run(time=10.0)
    assert (sim.frame().diameters > 1.49).all()
    found = [block.kT for block in stretches.blocks(sim, 0.05, 20)]
    # Growth heats by some parts in a hundred between two kicks.
    assert np.mean(found) == pytest.approx(1.0, rel=0.1)
    due = sim.drive.due
    assert due.min() >= sim.time
    assert np.mean(due - sim.time) == pytest.approx(1 / 20, rel=FOUR_SIGMA / math.sqrt(64))


@pytest.mark.usefixtures("both_ways")
def test_pinned_disks_are_not_kicked():
    sim = carom.Simulation(disks(Andersen(1.0, rate=5.0), pinned=[0, 1, 2]), seed=1)
    sim.run(time=1.0)
    assert (sim.frame().velocities[:3] == 0.0).all()
    assert (sim.drive.drawn[:3] == 0).all()
    assert (sim.drive.drawn[3:] > 0).any()


@pytest.mark.usefixtures("both_ways")
def test_a_gate_of_ones_own_lets_disks_pass_one_way_and_keeps_the_energy(tmp_path):
    sim = carom.Simulation(carom.Scene.random(16, 0.1, 2, seed=1, drive=OneWay(3.0)), seed=1)
    before = np.sum(sim.frame().velocities ** 2)
    sim.run(time=12.0)
    sim.save(tmp_path / "gate.h5")
    with pytest.raises(InputError, match="OneWay, which no file holds"):
        carom.Simulation.load(tmp_path / "gate.h5")
    after = sim.frame()
    assert np.sum(after.velocities**2) == pytest.approx(before, rel=1e-12)
    assert after.velocities[:, 0].mean() > 0.3
    # Each has crossed the place as often as it went round: no one came back.
    rounds = np.floor((after.unwrapped[:, 0] - 3.0) / after.box[0])
    start = np.floor((sim.scene.positions[:, 0] - 3.0) / after.box[0])
    assert (rounds >= start).all()
    assert rounds.sum() > start.sum()


@own.drive
class AtOnce:
    finite: bool = True

    def next_time(self, i, x, v, time):
        return time

    def kick(self, i, mass, x, v, time):
        v[0] = 1.0 if self.finite else np.nan


def test_a_wrong_drive_is_told_from_a_right_one():
    assert not carom.check(AtOnce()).passed
    assert carom.check(OneWay(1.0)).passed


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Andersen(1.0, rate=0.0), "rate of Andersen"),
        (lambda: Langevin(-1.0, friction=1.0, step=0.1), "kT of Langevin"),
        (lambda: Brownian(1.0, step=math.inf), "step of Brownian"),
        (lambda: Andersen((-1.0, 1.0), rate=1.0), "kT of Andersen must be one number, or one a species"),
        (lambda: Langevin((1.0, -1.0), friction=1.0, step=0.1), "one a species, of 0 to"),
        (lambda: Brownian((1.0, 0.0, -1e-300), step=0.1), "one a species, of 0 to"),
        (lambda: WhiteNoise(0.0, rate=1.0), "power of WhiteNoise"),
        (lambda: WhiteNoise(1.0, rate=1.0, pairs=1), "pairs of WhiteNoise must be true or false"),
        (lambda: carom.Scene([[1.0]], box=2.0, drive=WhiteNoise(1.0, 1.0, pairs=True)), "has only one"),
        (lambda: disks(Andersen((1.0, 2.0), rate=1.0)), "2 numbers, and the scene has 1 species"),
        (lambda: carom.Simulation(disks(Andersen(1.0, 1.0)), observers=[HelfandCurrents()]), "or drive"),
        (lambda: heated(disks(Andersen(1.0, 1.0))), "brings the particles to kT"),
        (lambda: carom.Simulation(caps().replace(drive=Andersen(1.0, 1.0))), "is curved: a kick could"),
        (lambda: carom.Simulation(disks(Andersen(1.0, 1.0), n=6000), cores=2), "its drive"),
        (lambda: carom.Simulation(disks(AtOnce())), "AtOnce does not keep.*do not all come at one time"),
        (lambda: carom.Simulation(disks(AtOnce(finite=False))), "kick leaves a velocity that is finite"),
        (lambda: disks(3.0), "drive must be a value with model, such as Andersen"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_one_sentence(make, says):
    with pytest.raises(InputError, match=says):
        make()


@pytest.mark.parametrize(
    "drive",
    [
        Andersen((1.0, 2.0), 3.0),
        Langevin(1.0, 2.0, 0.1),
        Brownian(1.0, 0.1),
        WhiteNoise(0.1, 20.0, pairs=True),
        Active((1.0, 0.0), 2.0, 0.1, kind="tumble"),
    ],
)
def test_a_drive_of_a_scene_file_is_that_of_python(drive):
    lines = "\n".join(f"{name} = {json.dumps(value)}" for name, value in drive.to_table().items())
    plan = SceneFile.from_toml(f"[scene]\nlattice = 'fcc'\ncells = 2\n[scene.drive]\n{lines}\n")
    assert plan.scene.drive == SceneFile.from_toml(plan.to_toml()).scene.drive == drive


def test_everybody_is_kicked_in_all_epochs_of_a_gas_so_thin_that_pairs_are_searched_without_it(plain):
    """So thin a gas is searched among all pairs at the beginning of an epoch, but not under a drive."""
    gas = {"n": 16, "packing_fraction": 4e-4, "dimension": 2, "seed": 1}
    assert carom.Simulation(carom.Scene.random(**gas))._state.scheme.kind == "all"
    sim = carom.Simulation(carom.Scene.random(**gas, drive=Brownian(0.7, step=50.0)), kT=0.7, seed=1)
    for _ in range(3):
        sim.run(time=400.0)
        assert np.abs(sim.drive.drawn - sim.time / 50.0).max() <= 1.0
    with pytest.raises(ValueError, match="no drive"):
        carom.Simulation(sim.scene, tuning=carom.Tuning(neighbors="all"))
