"""Rough particles: the contact law exactly, what it keeps, and published statistics of rough gases."""

import math
from fractions import Fraction

import numpy as np
import pytest
from helpers.marks import slow

import carom
from carom.models import Ball, Rough, Sine, SphericalContainer, Wall
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import SceneSpec

EXACT = 64 * np.finfo(float).eps
"""Roundings of one contact: some twenty products and sums, of numbers up to three times as large."""


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def contact(r, vi, vj, wi, wj, mi, mj, radii, qi, qj, e, beta, friction=None):
    """Return velocities and spins after a contact, in fractions but for the square root of friction."""
    rr = dot(r, r)
    arms = [each / sum(radii) for each in radii]  # in units of r
    v = [b - a for a, b in zip(vi, vj, strict=True)]
    normal = [x * dot(v, r) / rr for x in r]
    turning = cross([arms[0] * a + arms[1] * b for a, b in zip(wi, wj, strict=True)], r)
    g = [a - b - c for a, b, c in zip(v, normal, turning, strict=True)]
    inverse = 1 / mi + 1 / mj
    p = [-(1 + e) * x / inverse for x in normal]
    part = (1 + beta) / (inverse + 1 / (qi * mi) + 1 / (qj * mj))
    if friction is not None and part * part * dot(g, g) > friction * friction * dot(p, p):
        part = Fraction(math.sqrt(friction * friction * dot(p, p) / dot(g, g)))
    t = [-part * x for x in g]
    turn = cross(r, t)
    whole = [a + b for a, b in zip(p, t, strict=True)]
    return (
        [a - b / mi for a, b in zip(vi, whole, strict=True)],
        [a + b / mj for a, b in zip(vj, whole, strict=True)],
        [a - b / (qi * mi * arms[0] * rr) for a, b in zip(wi, turn, strict=True)],
        [a - b / (qj * mj * arms[1] * rr) for a, b in zip(wj, turn, strict=True)],
    )


def in_space(values, about=False):
    """Return three fractions: of a vector in the plane, or ``about`` its third axis."""
    values = [Fraction(float(x)) for x in values]
    if len(values) == 3:
        return values
    return [Fraction(0), Fraction(0), *values] if about else [*values, Fraction(0)]


def a_pair(rng, d, **law):
    """Return two unequal particles that are about to touch, in a box that is wide enough for one image."""
    direction = rng.normal(size=d)
    direction /= np.linalg.norm(direction)
    velocities = rng.normal(size=(2, d))
    velocities[1] -= (2.0 + velocities[1] @ direction - velocities[0] @ direction) * direction
    return carom.Scene(
        [np.full(d, 5.0), np.full(d, 5.0) + 1.2 * direction], 10.0, diameter=[1.0, 0.7], mass=[1.0, 0.6],
        velocities=velocities, spins=rng.normal(size=(2, 1 if d == 2 else 3)),
        impact=Rough(**law, inertia=(0.4, 0.25)),
    )  # fmt: skip


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("law", [
    {"tangential": 1.0}, {"restitution": 0.8, "elastic_below": 1.9, "tangential": 0.3}, {"tangential": -0.4},
    {"restitution": 0.9, "elastic_below": 1e-9, "tangential": 0.9, "friction": 0.2},
], ids=["perfectly rough", "loses", "slides", "cone"])  # fmt: skip
def test_a_contact_follows_waltons_law(d, law):
    rng = np.random.default_rng(d)
    for _ in range(12 if d == 2 else 3):  # in space plain Python is ten times as slow
        scene = a_pair(rng, d, **law)
        sim = carom.Simulation(scene)
        sim.run(collisions=1)
        after = sim.frame()
        r = after.positions[1] - after.positions[0]
        r = in_space(r - 10.0 * np.rint(r / 10.0))  # some pass each other, and meet across the box
        given = [*map(in_space, scene.velocities), *(in_space(w, about=True) for w in scene.spins)]
        numbers = [Fraction(float(x)) for x in (*scene.masses, *scene.diameters, *scene.impact.inertia)]
        slow = dot(r, [b - a for a, b in zip(*given[:2], strict=True)]) ** 2 / dot(r, r)
        spared = slow < law.get("elastic_below", 0.0) ** 2  # about every other one, where that is 1.9
        e, beta = Fraction(1.0 if spared else law.get("restitution", 1.0)), Fraction(law["tangential"])
        friction = None if "friction" not in law else Fraction(law["friction"])
        told = contact(r, *given, *numbers[:2], numbers[2:4], *numbers[4:], e, beta, friction)
        found = [*map(in_space, after.velocities), *(in_space(w, about=True) for w in after.spins)]
        size = max(abs(float(x)) for each in told for x in each)
        error = max(
            abs(float(a - b)) for x, y in zip(told, found, strict=True) for a, b in zip(x, y, strict=True)
        )
        assert error < EXACT * size


def gas(d, n=100, packing_fraction=0.2, seed=1, **law):
    return carom.Scene.random(n, packing_fraction, d, seed=seed, impact=Rough(**law))


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("d", [2, 3])
def test_smooth_particles_have_the_bits_of_plain_ones(d):
    rough = carom.Simulation(gas(d, 30, tangential=-1.0), seed=1)
    plain = carom.Simulation(carom.Scene.random(30, 0.2, d, seed=1), seed=1)
    for sim in (rough, plain):
        sim.run(collisions=100 if d == 2 else 50)
    assert rough.frame().positions.tobytes() == plain.frame().positions.tobytes()
    assert not rough.frame().spins.any()


@pytest.mark.parametrize("d", [slow(2), 3])
def test_perfectly_rough_particles_keep_the_energy_and_share_it_equally(d):
    sim = carom.Simulation(gas(d, tangential=1.0), seed=1)
    sim.run(collisions_per_particle=40)
    means = []
    for _ in range(200):
        sim.run(collisions_per_particle=4)
        means.append((sim.kT_rotational, sim.kT))
    assert sim.statistics.energy_drift < 1e-13
    assert sim.statistics.momentum_drift < 1e-14
    turning, flying = np.mean(means, axis=0)
    # Of n particles both fluctuate by a tenth; 800 collisions each are some 100 independent samples.
    assert turning / flying == pytest.approx(1.0, abs=0.03)
    # The energy is what d (n - 1) velocities had.
    spins = 1 if d == 2 else 3
    assert (d * 99 * flying + spins * 100 * turning) / (d * 99) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("d", [2, 3])
def test_time_runs_backwards(d):
    scene = gas(d, n=30, tangential=1.0)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions=60)  # errors grow tenfold with two collisions each
    there = sim.frame()
    back = carom.Simulation(
        scene.replace(positions=there.positions, velocities=-there.velocities, spins=-there.spins)
    )
    back.run(time=there.time)
    distance = back.frame().positions - scene.positions
    distance -= np.rint(distance / scene.box) * scene.box
    assert np.abs(distance).max() < 1e-6
    assert np.abs(back.frame().spins).max() < 1e-6


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("d", [2, 3])
def test_angular_momentum_is_kept_in_a_smooth_round_container(d):
    inside = SphericalContainer([5.0] * d, 4.5)
    rng = np.random.default_rng(3)
    grid = np.stack(np.meshgrid(*[np.arange(3.0, 8.0, 1.3)] * d), axis=-1).reshape(-1, d)
    places = [place for place in grid if np.linalg.norm(place - 5.0) < 3.9][:20]
    n = len(places)
    axes = 1 if d == 2 else 3
    scene = carom.Scene(
        places, 10.0, diameter=rng.uniform(0.6, 1.0, n), mass=rng.uniform(0.5, 2.0, n), walls=True,
        obstacles=[inside], velocities=rng.normal(size=(n, d)), spins=rng.normal(size=(n, axes)),
        impact=Rough(0.95, elastic_below=1e-6, tangential=0.4, friction=0.5),
    )  # fmt: skip
    sim = carom.Simulation(scene)

    def angular(frame):
        inertias = scene.impact.inertias(scene.masses, d) * (0.5 * scene.diameters) ** 2
        arms = frame.positions - 5.0
        about = np.cross(arms, frame.velocities) if d == 3 else (
            arms[:, :1] * frame.velocities[:, 1:] - arms[:, 1:] * frame.velocities[:, :1]
        )  # fmt: skip
        return scene.masses @ about + inertias @ frame.spins

    before = angular(sim.frame())
    sim.run(collisions=150 if d == 2 else 60)
    assert angular(sim.frame()) == pytest.approx(before, abs=1e-12 * n)
    assert sim.obstacles[-1].hits > 10


def gains(kinetic, turning, d, e, beta, q):
    """Return what one collision changes of both energies, of Maxwellians with these temperatures (m = 1).

    Huthmann and Zippelius, Phys. Rev. E 56 (1997) R6275; Luding et al., Phys. Rev. E 58 (1998) 3416.
    """
    eta = q * (1 + beta) / (2 * (1 + q))
    lost = -(1 - e * e) * kinetic - 2 * (d - 1) * eta * ((1 - eta) * kinetic - eta * turning / q)
    return lost, 2 * (d - 1) * eta / q * (eta * kinetic - (1 - eta / q) * turning)


@pytest.mark.parametrize("beta", [-0.5, 0.0, 0.5])
def test_rough_spheres_cool_as_theory_says(beta):
    d = 3
    law = {"restitution": 0.9, "elastic_below": 1e-6, "tangential": beta}
    found = []
    for seed in range(8):
        sim = carom.Simulation(gas(d, 500, 0.02, seed, **law), seed=seed)
        start = sim.kT
        sim.run(collisions_per_particle=5)
        found.append((sim.kT / start, sim.kT_rotational / sim.kT))
    kinetic, turning, parts = 1.0, 0.0, 1000
    for _ in range(5 * parts):
        a, b = gains(kinetic, turning, d, 0.9, beta, 2 / (d + 2))
        kinetic, turning = kinetic + a / d / parts, turning + b / 3 / parts
    # Spins and velocities are correlated, which the theory leaves out: 2 to 3 per cent as measured there.
    assert np.mean(found, axis=0) == pytest.approx([kinetic, turning / kinetic], rel=0.05)


FLOOR = Rough(0.8, elastic_below=1e-9, tangential=0.5, friction=0.4)


def falling(d, spins, velocity, **given):
    """Return one particle above a rough floor."""
    place = [5.0] * d
    place[1] = 1.0
    return carom.Scene(
        [place], 10.0, walls={"y_low": Wall(impact=FLOOR, **given)}, velocities=[velocity], spins=[spins],
        impact=Rough(tangential=-1.0),
    )  # fmt: skip


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(("d", "spins", "velocity"), [
    (2, [3.0], [0.7, -1.0]), (2, [0.1], [0.05, -1.0]), (3, [1.0, 2.0, -0.5], [0.3, -1.5, 0.2]),
    (3, [0.1, 0.2, 0.3], [0.0, -1.5, 0.1]),
], ids=["slides", "sticks", "slides in space", "sticks in space"])  # fmt: skip
def test_a_rough_floor_is_a_partner_of_infinite_mass(d, spins, velocity):
    scene = falling(d, spins, velocity)
    sim = carom.Simulation(scene)
    sim.run(time=0.9)
    after = sim.frame()
    down = [Fraction(0), Fraction(-1), Fraction(0)]
    huge, zero = Fraction(10) ** 60, [Fraction(0)] * 3
    told = contact(
        down, in_space(velocity), zero, in_space(spins, about=True), zero, Fraction(1), huge,
        [Fraction(1, 2), Fraction(1, 2)], Fraction(float(scene.impact.inertias(np.ones(1), d)[0])), huge,
        Fraction(0.8), Fraction(0.5), Fraction(0.4),
    )  # fmt: skip
    assert sum(each.hits for each in sim.obstacles) == 1
    assert np.array(in_space(after.velocities[0]), float) == pytest.approx(
        np.array(told[0], float), abs=EXACT * 4
    )
    # r has length 1 in this law, and the arm is half of it: spins are those of a sphere of radius 1/2.
    assert np.array(in_space(after.spins[0], about=True), float) == pytest.approx(
        np.array(told[2], float), abs=EXACT * 8
    )


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("phase", [0.0, 0.125])
def test_a_floor_that_moves_along_itself_carries_a_particle_along(phase):
    belt = {"shake": Sine(amplitude=1.0, period=20.0, phase=phase), "direction": (1, 0)}
    sim = carom.Simulation(falling(2, [0.0], [0.0, -1.0], **belt))
    sim.run(time=0.9)
    belt = math.pi / 10 * math.cos(math.pi / 10 * 0.5 + 2.0 * math.pi * phase)
    # The impulse of Walton's law: 1.5 / (1 + 2) of the slip, below the cone of 0.4 * 1.8.
    assert sim.frame().velocities[0, 0] == pytest.approx(0.5 * belt, rel=1e-12)
    assert sim.frame().spins[0, 0] == pytest.approx(2.0 * 0.5 * belt / 0.5 * -1.0 * -1.0, rel=1e-12)


@pytest.mark.usefixtures("both_ways")
def test_a_bumpy_floor_of_pinned_particles_turns_those_that_fall_on_it():
    places = [[x + 0.5, 0.5] for x in range(10)] + [[x + 0.9, 3.0] for x in range(0, 10, 2)]
    scene = carom.Scene(
        places, (10.0, 6.0), walls="y", pinned=range(10), diameter=0.9,
        velocities=[[0.0, 0.0]] * 10 + [[0.3, -1.0]] * 5, impact=Rough(tangential=1.0),
    )  # fmt: skip
    sim = carom.Simulation(scene)
    sim.run(time=20.0)
    frame = sim.frame()
    assert not frame.spins[:10].any()
    assert frame.spins[10:].all()
    moving = 0.5 * 0.45**2 * np.mean(frame.spins[10:] ** 2)  # I w^2, of disks of mass 1
    assert sim.kT_rotational == pytest.approx(moving, rel=1e-12)
    assert sim.statistics.energy_drift < 1e-13


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("suffix", ["h5md", "extxyz"])
def test_files_hold_spins_to_the_last_bit_and_a_run_goes_on_from_them(plain, d, suffix, tmp_path):
    scene = gas(d, 20, restitution=0.9, tangential=0.5)
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions=30)
    sim.write(tmp_path / f"run.{suffix}", every=0.1, count=3)
    with carom.io.open(tmp_path / f"run.{suffix}") as frames:
        last = frames[-1]
    assert last.spins.tobytes() == sim.frame().spins.tobytes()
    again = carom.Scene.from_frame(last, impact=scene.impact)
    assert np.array_equal(again.spins, last.spins)
    assert np.array_equal(carom.io.from_ase(last.to_ase()).spins, last.spins)
    table = last.to_pandas()
    assert ("w" if d == 2 else "wz") in table


@pytest.mark.parametrize("given", [
    {"tangential": 1.0}, {"tangential": 1.0, "friction": 0.3}, {"inertia": 0.4},
    {"restitution": 0.9, "elastic_below": 0.1, "tangential": -0.5}, {"inertia": (0.4, 0.5)},
])  # fmt: skip
def test_rough_contacts_of_a_scene_file_stay_rough_where_nothing_is_lost_along_the_normal(given):
    law = Rough(**given)
    plan = SceneFile(scene=SceneSpec(n=2, dimension=2, packing_fraction=0.2, impact=law))
    assert plan.scene.impact == law
    assert SceneFile.from_toml(plan.to_toml()).build_scene().impact == law
    assert SceneFile(scene=SceneSpec(impact=carom.models.Restitution(1.0))).scene.impact is None


def test_pressure_of_a_rough_gas_is_that_of_a_smooth_one():
    sim = carom.Simulation(gas(3, tangential=1.0), seed=1)
    sim.run(collisions_per_particle=50)
    pressure = sim.measure(carom.Pressure(), collisions_per_particle=1000)
    # Statics of hard spheres do not know spins: Carnahan and Starling's Z, of 100 particles.
    told = carom.theory.carnahan_starling(0.2)
    assert pressure.Z.mean == pytest.approx(told, abs=4.0 * pressure.Z.error + 0.3 * told / 100)


@pytest.mark.parametrize(("change", "said"), [
    (lambda: carom.Scene.random(10, 0.2, 1, impact=Rough()), "disks and spheres, found 1"),
    (lambda: carom.Scene.random(10, 0.1, 4, impact=Rough()), "disks and spheres, found 4"),
    (lambda: carom.Scene([[1.0, 1.0]], 4.0, spins=[1.0]), "impact=carom.models.Rough"),
    (lambda: carom.Scene([[1.0, 1.0]], 4.0, spins=[[1.0, 2.0]], impact=Rough()), r"\(1, 1\) finite numbers"),
    (lambda: carom.Scene([[1.0, 1.0]], 4.0, spins=[math.nan], impact=Rough()), "finite numbers"),
    (lambda: carom.Scene([[1.0, 1.0]], 4.0, impact=Rough(inertia=[0.5, 0.5])), "inertia holds 2 values"),
    (lambda: carom.Simulation(gas(2), growth=0.1), "growth is not defined for rough"),
    (lambda: carom.Simulation(carom.Scene.random(
        20, 0.2, 2, impact=Rough(), interaction=carom.models.SquareWell(1.5, 1.0))), "sum of their radii"),
    (lambda: carom.Simulation(carom.Scene(
        [[5.0, 5.0]], 10.0, obstacles=[Ball([1.0, 1.0], 0.5, impact=Rough())])), "do not spin"),
    (lambda: Rough(tangential=1.5), "tangential"),
    (lambda: Rough(friction=-0.1), "friction"),
    (lambda: Rough(inertia=0.0), "inertia"),
    (lambda: carom.Simulation(carom.Scene.random(20, 0.2, 2)).kT_rotational, "smooth and do not spin"),
], ids=range(13))  # fmt: skip
def test_what_makes_no_sense_is_one_sentence(change, said):
    with pytest.raises(carom.InputError, match=said) as caught:
        change()
    assert "\n" not in str(caught.value)
