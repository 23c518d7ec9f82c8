"""The oracle against what is known without it: exact cases, a search by brute force, conservation laws."""

import itertools
import json
import math
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest

from carom.errors import InputError, OverlapError
from carom.reference import NaiveSystem, NoMeetingFound, collisions
from carom.reference.arithmetic import make_arithmetic
from carom.reference.meeting import Contacts, next_meeting

DATA = Path(__file__).parents[1] / "data"
# 50 digits less what a few hundred collisions amplify: each multiplies an error by some ten at most.
FORTY_DIGITS = mpmath.mpf(10) ** -40


def lattice_gas(n, dimension, packing_fraction, seed):
    """Spheres of diameter 1 on random sites of a simple cubic lattice; normal velocities that add to zero."""
    rng = np.random.default_rng(seed)
    volume = math.pi ** (dimension / 2) / math.gamma(dimension / 2 + 1) / 2**dimension
    edge = (n * volume / packing_fraction) ** (1 / dimension)
    sites = math.ceil(n ** (1 / dimension))
    chosen = rng.permutation(sites**dimension)[:n]
    positions = np.array(np.unravel_index(chosen, (sites,) * dimension)).T * (edge / sites)
    velocities = rng.normal(size=(n, dimension))
    return positions, velocities - velocities.mean(axis=0), [edge] * dimension


def image_distances(positions, box, reach=2):
    """Distances of spheres 0 and 1 over all images within `reach` boxes."""
    r = np.asarray(positions[1] - positions[0], dtype=float)
    r = r - np.rint(r / box) * box
    offsets = np.array(list(itertools.product(range(-reach, reach + 1), repeat=len(box)))) * box
    return np.linalg.norm(r + offsets, axis=1)


def test_two_spheres_meet_when_and_where_the_quadratic_says():
    # |(4 - t, 0.6)| = 1 at t = 4 - 0.8; the normal is (0.8, 0.6), the normal speed 0.8.
    system = NaiveSystem([["0", "0"], ["4", "0.6"]], [[1, 0], [0, 0]], [20, 20])
    hit = system.step()
    assert (hit.i, hit.j, hit.image) == (0, 1, (0, 0))
    assert abs(5 * hit.time - 16) < FORTY_DIGITS
    assert abs(5 * hit.impulse - 4) < FORTY_DIGITS
    expected = np.array([[0.36, -0.48], [0.64, 0.48]])
    assert np.abs(system.velocities.astype(float) - expected).max() < 4 * np.finfo(float).eps


def test_unequal_masses_and_diameters_follow_the_laws_of_impact():
    # Contact at (1 + 3) / 2 = 2; reduced mass 3/4; the heavier goes on at (3 - 1) / 4 of its speed.
    system = NaiveSystem([[0], [6]], [[2], [0]], [50], diameter=[1, 3], masses=[3, 1], arithmetic="fraction")
    assert system.step() == (Fraction(2), 0, 1, (0,), Fraction(3))
    assert system.velocities.tolist() == [[1], [3]]
    assert system.virial == 2 * 3


def test_fractions_are_exact_in_one_dimension():
    rng = np.random.default_rng(7)
    positions = [[Fraction(3 * k) + Fraction(int(rng.integers(1, 99)), 100)] for k in range(5)]
    velocities = [[Fraction(int(v), 7)] for v in (-5, 3, 1, -2, 3)]
    exact = NaiveSystem(positions, velocities, [16], arithmetic="fraction")
    fine = NaiveSystem(positions, velocities, [16], arithmetic="mpmath")
    before = sorted(exact.velocities[:, 0])
    energy = exact.energy
    for _ in range(60):
        a, b = exact.step(), fine.step()
        assert isinstance(a.time, Fraction)
        assert a[1:4] == b[1:4]
        assert abs(b.time * a.time.denominator - a.time.numerator) < FORTY_DIGITS * a.time.denominator
        x = np.sort(exact.positions[:, 0])
        assert all(gap >= 1 for gap in np.diff(x))
    # Equal masses on a line exchange velocities, so the set of them never changes.
    assert sorted(exact.velocities[:, 0]) == before
    assert exact.energy == energy


def test_fractions_refuse_an_irrational_root():
    system = NaiveSystem([[0, 0], [4, Fraction(1, 2)]], [[1, 0], [0, 0]], [20, 20], arithmetic="fraction")
    with pytest.raises(InputError, match="irrational"):
        system.step()


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
@pytest.mark.parametrize("packing_fraction", [0.01, 0.2])
def test_doubles_keep_the_order_of_fifty_digits_for_two_collisions_a_particle(dimension, packing_fraction):
    # A collision multiplies errors by up to 2 l / sigma for a flight of length l: by far less than the 10^15
    # of a double in the two collisions a particle looked at here.
    n = 12
    scene = lattice_gas(n, dimension, packing_fraction, seed=dimension)
    double, fine = (
        list(itertools.islice(collisions(*scene, arithmetic=name), 2 * n)) for name in ("float", "mpmath")
    )
    assert [c[1:4] for c in double] == [c[1:4] for c in fine]


@pytest.mark.parametrize(
    ("dimension", "packing_fraction"), [(1, 0.6), (2, 0.4), (3, 0.1), (4, 0.05), (6, 0.002)]
)
@pytest.mark.parametrize("arithmetic", ["float", "mpmath"])
def test_energy_momentum_and_the_hard_core_are_kept(dimension, packing_fraction, arithmetic):
    n, steps = 6, 40
    system = NaiveSystem(*lattice_gas(n, dimension, packing_fraction, seed=3), arithmetic=arithmetic)
    energy, momentum, before = system.energy, system.momentum, system.positions
    box = np.array(system.box, dtype=float)
    # A dozen roundings a step.
    bound = 12 * steps * np.finfo(float).eps if arithmetic == "float" else FORTY_DIGITS
    total = 0
    for hit in itertools.islice(system, steps):
        r = system.positions[hit.j] + np.array(hit.image) * system.box - system.positions[hit.i]
        distance = float(sum(r * r)) ** 0.5
        # Unwrapped positions have been around the table many times by now.
        assert abs(distance - 1) < 1e-12 if arithmetic == "float" else abs(sum(r * r) - 1) < FORTY_DIGITS
        pairs = itertools.combinations(system.positions.astype(float), 2)
        assert min(image_distances(np.array(p), box, reach=1).min() for p in pairs) > 1 - 1e-12
        total += hit.impulse
    assert system.collisions == steps
    assert abs(system.energy - energy) < bound * energy
    assert max(abs(p - q) for p, q in zip(system.momentum, momentum, strict=True)) < bound * energy
    assert abs(system.virial - total) < bound * total
    # sum_i m_i x_i = momentum x time, only if images are counted right (no jump at the boundary).
    drift = (system.positions - before).sum(axis=0) - system.momentum * system.time
    scale = max(1.0, float(np.abs(system.positions.astype(float)).max()))
    assert max(abs(x) for x in drift) < bound * n * scale


SMALL_BOXES = [
    ((2.1,), (1.02,)),
    ((1.05, 1.8), (0.525, 0.9)),
    ((1.05, 1.05, 1.6), (0.5, 0.5, 0.8)),
    ((1.05, 1.8, 1.9), (0.5, 0.9, 0.9)),
    ((1.05, 1.05, 1.05, 1.05), (0.52, 0.525, 0.53, 0.52)),
    ((1.7, 9.0), (0.85, 0.6)),
]


@pytest.mark.parametrize(("box", "separation"), SMALL_BOXES, ids=lambda value: "x".join(map(str, value)))
def test_boxes_hardly_wider_than_a_sphere_agree_with_a_fine_search_over_images(box, separation):
    rng = np.random.default_rng(len(box))
    u = rng.normal(size=len(box))
    system = NaiveSystem([[0] * len(box), separation], [-u / 2, u / 2], box)
    edges, images = np.array(box), set()
    for _ in range(25):
        x, v, now = system.positions.astype(float), system.velocities.astype(float), float(system.time)
        hit = system.step()
        images.add(hit.image)
        flight = float(hit.time) - now
        # Up to just before the hit no image is touched; just after it the claimed one would be inside.
        for fraction in np.linspace(0.0, 0.999, 200):
            assert image_distances(x + v * (flight * fraction), edges).min() > 1 - 1e-9
        # The distance falls at the normal speed, the impulse for unit masses.
        inside = image_distances(x + v * (flight + 1e-6), edges).min()
        assert inside == pytest.approx(1 - 1e-6 * float(hit.impulse), abs=1e-10)
    assert len(images) > 1


def test_simultaneous_collisions_are_processed_by_index():
    x = [[0], [2], [10], [12], [20], [22]]
    v = [[1], [0], [1], [0], [1], [0]]
    system = NaiveSystem(x, v, [30], arithmetic="fraction")
    assert [system.step()[:3] for _ in range(3)] == [(1, 0, 1), (1, 2, 3), (1, 4, 5)]


def test_spheres_in_contact_at_the_start_collide_at_once_and_only_if_they_approach():
    closing = NaiveSystem([[0], [1]], [[1], [0]], [10], arithmetic="fraction")
    assert closing.step()[:3] == (0, 0, 1)
    opening = NaiveSystem([[0], [1]], [[0], [1]], [10], arithmetic="fraction")
    assert opening.step()[:4] == (8, 0, 1, (-1,))


@pytest.mark.parametrize(
    ("positions", "velocities"),
    [
        ([[1.0, 2.0]], [[1.0, 1.0]]),
        ([[1.0, 2.0], [4.0, 4.0]], [[0.0, 0.0], [0.0, 0.0]]),
        ([[1.0, 2.0], [4.0, 4.0]], [[1.0, 2.0], [1.0, 2.0]]),
        ([[1.0, 2.0], [4.0, 4.0]], [[1.0, 0.0], [0.0, 0.0]]),
    ],
    ids=["one", "at rest", "together", "passing by along an axis"],
)
def test_a_system_without_collisions_ends(positions, velocities):
    system = NaiveSystem(positions, velocities, [8.0, 8.0])
    assert list(system) == []
    assert system.advance_to(100) == []
    assert (
        system.positions.astype(float).tolist() == (np.array(positions) + 100 * np.array(velocities)).tolist()
    )


def test_the_slowest_of_those_that_fly_along_an_axis_meet_as_well():
    # Sphere 0 passes the others 420 times, out of their reach, until 1 has come to 2.
    positions, velocities = [[1.0, 6.0], [1.0, 2.0], [8.0, 2.0]], [[7.0, 0.0], [0.01, 0.0], [0.0, 0.0]]
    met = NaiveSystem(positions, velocities, [10.0, 10.0], arithmetic="fraction").step()
    assert (met.i, met.j, float(met.time)) == (1, 2, pytest.approx(600.0))


def test_spheres_that_fly_along_a_channel_for_ever_are_reported():
    # Relative motion along the diagonal of a square returns to itself and misses by sqrt(8) - 1.
    positions, velocities, box = [[0.0, 0.0], [4.0, 0.0]], [[1.0, 1.0], [0.0, 0.0]], [8.0, 8.0]
    assert NaiveSystem(positions, velocities, box).advance_to(1000) == []
    with pytest.raises(NoMeetingFound, match="time to stop at"):
        next_meeting(
            *map(np.array, (positions, velocities)), Contacts(np.ones(2), np.zeros(2)), np.array(box),
            make_arithmetic("float"), windows_limit=2**10,
        )  # fmt: skip


def test_advance_to_does_not_change_the_collisions():
    scene = lattice_gas(8, 2, 0.3, seed=5)
    whole = list(itertools.islice(collisions(*scene), 30))
    stopped = NaiveSystem(*scene)
    seen = []
    while len(seen) < 30:
        seen += stopped.advance_to(stopped.time + mpmath.mpf("0.037"))
    assert [c[1:4] for c in seen[:30]] == [c[1:4] for c in whole]
    assert max(abs(a.time - b.time) for a, b in zip(seen, whole, strict=False)) < FORTY_DIGITS
    with pytest.raises(InputError, match="cannot go back"):
        stopped.advance_to(0)


@pytest.mark.parametrize("case", [1, 2, 3, 5], ids=lambda k: f"case {k}")
def test_two_spheres_on_a_torus_have_the_exact_pressure(case):
    """Z = 1 + W / (d N kT t), kT = 2K / (d (N - 1)), against the table.

    Each replica starts from the stationary distribution (uniform in free space, isotropic velocity) and runs
    for a fixed time, so the mean over replicas is unbiased, and its standard error follows from their spread.
    """
    exact = json.loads((DATA / "few_body_exact.json").read_text())["torus_N2"][case]
    d, sigma, edge = exact["d"], exact["sigma"], exact["L"]
    rng = np.random.default_rng(case)
    values, replicas, duration = [], 60, 20 * exact["mean_time_between_collisions"]
    while len(values) < replicas:
        r, u = rng.uniform(-edge / 2, edge / 2, d), rng.normal(size=d)
        if np.linalg.norm(r) < sigma:
            continue
        # K = m u^2 / 4 = d kT / 2 with kT = 1.
        u *= math.sqrt(2 * d) / np.linalg.norm(u)
        system = NaiveSystem([[0.0] * d, r], [-u / 2, u / 2], [edge] * d, diameter=sigma, arithmetic="float")
        system.advance_to(duration)
        kT = 2 * system.energy / d
        values.append(1 + system.virial / (d * 2 * kT * duration))
    error = np.std(values, ddof=1) / math.sqrt(replicas)
    assert error < 0.05 * (exact["Z_canonical"] - 1)
    assert abs(np.mean(values) - exact["Z_canonical"]) < 4 * error


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"positions": [[0, 0], [0.5, 0]]}, OverlapError, "Spheres 0 and 1 overlap by 0.5 "),
        ({"positions": [[0.1, 0], [8.9, 0]], "box": [9, 9]}, OverlapError, "overlap by 0.8 "),
        ({"box": [0.9, 9]}, OverlapError, "its own image"),
        ({"positions": [[0, math.nan], [3, 0]]}, InputError, "positions has nan"),
        ({"velocities": [[0, 0], [math.inf, 0]]}, InputError, "velocities has inf"),
        ({"velocities": [[0, 0]]}, InputError, "expected \\(2, 2\\)"),
        ({"positions": [["zero", 0], [3, 0]]}, InputError, "where a number is expected"),
        ({"positions": []}, InputError, "expected \\(n, d\\)"),
        ({"box": [9]}, InputError, "2 positive edges"),
        ({"box": [9, -9]}, InputError, "2 positive edges"),
        ({"masses": [1, 0]}, InputError, "positive numbers"),
        ({"diameter": [1, 1, 1]}, InputError, "expected 2 positive"),
        ({"arithmetic": "decimal"}, InputError, "'decimal'"),
        ({"digits": 5}, InputError, "at least 15"),
    ],
)
def test_bad_input_is_told_in_one_sentence(change, error, words):
    good = {"positions": [[0, 0], [3, 0]], "velocities": [[1, 0], [0, 0]], "box": [9, 9]}
    with pytest.raises(error, match=words):
        collisions(**(good | change))
