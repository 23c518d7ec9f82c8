"""Equation-of-state studies: what is asked for, what is kept, what is flagged, what is fitted."""

import dataclasses
import itertools
import json
import math
import re
import subprocess
from html.parser import HTMLParser
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from helpers.drawn import outside, strange_bars
from helpers.marks import slow
from helpers.needs import chromium
from scipy.special import sph_harm_y
from scipy.stats import linregress, norm

import carom
from carom import studies, theory
from carom.errors import InputError
from carom.models import HardCores, Loss, SquareWell, Steps, StepTable
from carom.models.obstacles.named_walls import axes_without
from carom.observables import Estimate
from carom.observables.analysis import drift
from carom.scene import lattices
from carom.scene_file.sections import SceneSpec
from carom.studies import EquationOfState, StudySpec, executors as engines, folder as tasks, scenes
from carom.studies.eos import fits, pictures, table
from carom.studies.eos.measure import Planned, Point
from carom.studies.eos.order import ORDERS, q_6
from carom.studies.start import start as start_of
from carom.studies.study import Failure, perform
from carom.table import Table

SMALL = {"n": 108, "collisions_per_particle": 100, "equilibration": 20, "blocks": 64, "executor": "serial"}


load = EquationOfState.load


def simulate(task):
    """The record of a task."""
    return perform(Point.measure, task)


def rows_of_records(records, equation=None):
    """The rows of all points among records, whatever the study they are of."""
    points = {}
    for record in sorted(records, key=lambda record: record["task"]["replica"]):
        scene = record["task"]["scene"]
        point = scene["packing_fraction"], scene["n"], record["result"]["dimension"]
        points.setdefault(point, []).append(record)
    return [table.row(points[point], equation) for point in sorted(points)]


# What is asked for.


def test_the_default_study_has_twelve_densities_of_the_fluid():
    spec = StudySpec()
    assert StudySpec.from_toml("") == spec
    assert len(spec.packing_fraction) == 12
    assert max(spec.packing_fraction) < theory.FREEZING[3]
    for d in range(1, 7):
        assert len(StudySpec(dimension=d).packing_fraction) == 12


def test_tasks_come_longest_first_and_are_plain_values():
    asked = StudySpec(packing_fraction=(0.1, 0.4), n=(108, 500), replicas=2, relative_error=1e-3)
    found = asked.tasks()
    work = [task["scene"]["n"] * (task["equilibration"] + task["collisions_per_particle"]) for task in found]
    assert work == sorted(work, reverse=True)
    assert json.loads(tasks.canonical(found)) == found
    assert len({tasks.key(task) for task in found}) == 8


def test_the_length_of_a_run_follows_from_the_error_asked_for():
    """Noise falls as one over the root of the collisions, which the replicas share."""
    eta = 0.3
    z = theory.best(3)(eta)
    for error, replicas in ((1e-3, 1), (1e-3, 4), (5e-4, 2)):
        (task, *_) = StudySpec((eta,), n=(500,), replicas=replicas, relative_error=error).tasks()
        collisions = 0.5 * 500 * replicas * task["collisions_per_particle"]
        assert 1.2 * (z - 1) / z / math.sqrt(collisions) == pytest.approx(error, rel=1e-3)


def test_auto_starts_at_random_in_the_fluid_and_from_a_crystal_beyond():
    for d, eta, start in ((3, 0.49, "random"), (3, 0.55, "fcc"), (2, 0.7, "random"), (2, 0.73, "triangular")):
        (task, *_) = StudySpec(packing_fraction=(eta,), dimension=d).tasks()
        assert task["scene"]["initial"] == start
    # 4000 = 4 x 10^3 fills fcc; a triangular lattice nearly square has 2 x 48 x 42 sites nearby.
    (task, *_) = StudySpec(packing_fraction=(0.73,), dimension=2, n=(4096,)).tasks()
    assert abs(task["scene"]["n"] - 4096) < 100


def test_numbers_that_fill_the_same_lattice_are_one_point():
    """Both are nearest to 108: run as replicas of each other, they halved the variance with the same bits."""
    spec = StudySpec(packing_fraction=(0.2, 0.6), n=(100, 108), replicas=2)
    points = [(task["scene"]["packing_fraction"], task["scene"]["n"]) for task in spec.tasks()]
    assert sorted(points) == [(0.2, 100)] * 2 + [(0.2, 108)] * 2 + [(0.6, 108)] * 2
    assert len({tasks.key(task) for task in spec.tasks()}) == 6


BRIDGES = StepTable(Steps([1.0, 1.5], [math.inf, 0.0], leaving=[math.inf, -1.0]))


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ({"packing_fraction": (0.8,)}, "packing_fraction must be"),
        ({"packing_fraction": ("0.1",)}, "must be a number"),
        ({"n": (1,)}, "n must be at least 2|n must be between 2"),
        ({"relative_error": 0.0}, "relative_error must be"),
        ({"neighbors": "magic"}, "neighbors must be one of"),
        ({"dimension": 7}, "packing_fraction are needed"),
        ({"scene": {"packing_fraction": 0.1}}, r"section \[study\]"),
        ({"scene": {"diametre": 1.0}}, "did you mean diameter"),
        ({"lattice": "fcc", "dimension": 2}, "dimension is 3"),
        ({"scene": {"species": [{"count": 5}, {"count": 7, "diameter": 0.5}]}}, "give each a fraction"),
        ({"scene": {"impact": Loss(0.9, contact_time=1e-3)}}, "impact leaves no uniform phase"),
        ({"scene": {"interaction": HardCores()}}, "must be of steps, found a HardCores"),
        ({"scene": {"interaction": BRIDGES}}, "hysteretic"),
    ],
)
def test_studies_that_cannot_be_are_refused_before_anything_runs(words, text):
    with pytest.raises(InputError, match=text):
        StudySpec(**words)


# The stream of a task.


def test_adding_densities_sizes_and_replicas_changes_no_other_task():
    length = {"collisions_per_particle": 100}
    (one,) = StudySpec((0.2,), n=(108,), replicas=1, **length).tasks()
    more = StudySpec((0.1, 0.2, 0.3), n=(32, 108), replicas=2, **length).tasks()
    assert one in more
    assert len(more) == 12


def test_replicas_and_seeds_differ():
    study = carom.equation_of_state([0.2], replicas=2, **SMALL)
    other = carom.equation_of_state([0.2], replicas=2, seed=2, **SMALL)
    means = [r["result"]["Z"]["mean"] for s in (study, other) for r in s.records]
    assert len(set(means)) == 4


def test_a_heavier_and_hotter_gas_has_the_same_z_within_five_errors():
    plain = carom.equation_of_state([0.2], replicas=1, **SMALL)
    (task,) = StudySpec(
        packing_fraction=(0.2,), n=(108,), replicas=1, collisions_per_particle=100, scene={"mass": 4.0}
    ).tasks()
    assert task["scene"]["mass"] == 4.0
    heavy = carom.equation_of_state([0.2], replicas=1, kT=2.0, scene={"mass": 4.0}, **SMALL)
    # Another scene has another stream; both measure the same gas.
    (a,), (b,) = plain.table, heavy.table
    assert abs(a.Z - b.Z) < 5.0 * math.hypot(a.Z_error, b.Z_error)


# What is kept.


def test_a_worker_of_another_version_is_refused():
    (task,) = StudySpec(packing_fraction=(0.1,), n=(32,), replicas=1).tasks()
    with pytest.raises(InputError, match="same version everywhere"):
        simulate({**task, "version": "0.0.0"})


# The table.


def made(values, *, eta=0.2, n=108, d=3, order=None, moved=5.0, initial="random", z=2.0, error=0.01,
         replica=0, time=100.0):  # fmt: skip
    """A record as a worker would send it."""
    estimate = {"mean": z, "error": error, "n_eff": 500.0, "tau": 1.0, "blocks": 512}
    pressure = {**estimate, "mean": 0.4 * z, "error": 0.3 * error}
    return {
        "task": {"scene": {"packing_fraction": eta, "n": n, "initial": initial}, "replica": replica},
        "result": {
            "n": n, "dimension": d, "packing_fraction": eta, "kT": 1.0, "Z": estimate,
            "reduced_pressure": pressure, "block_values": list(values), "moved": moved, "moved_at_end": moved,
            "order": order, "time": time, "collisions": 1000, "species": [[1.0, n]], "confined": False,
        },
        "provenance": {"seconds": 1.0},
    }  # fmt: skip


@pytest.mark.parametrize(("d", "end"), [(2, 0.6), (3, 0.55)])
def test_a_point_beyond_the_range_of_the_equation_stands_without_theory(d, end):
    def point(eta, equation=None):
        values = np.random.default_rng(1).normal(size=64)
        return table.row([made(values, eta=eta, d=d, z=9.0)], equation)

    inside, beyond = point(end), point(end + 0.01)
    assert math.isfinite(inside.theory)
    assert math.isfinite(inside.deviation)
    assert math.isnan(beyond.theory)
    assert math.isnan(beyond.deviation)
    assert math.isfinite(beyond.Z_infinite)  # the correction is of order 1 / n
    assert math.isfinite(point(end + 0.01, theory.henderson).theory)  # one that is asked for is shown


def test_replicas_are_weighted_and_their_chi_squared_told():
    rng = np.random.default_rng(1)
    records = [
        made(rng.normal(size=64), z=2.0, error=0.1, replica=0, time=4.0),
        made(rng.normal(size=64), z=2.3, error=0.2, replica=1, time=1.0),
    ]
    for several in (records, records[::-1]):
        (row,) = rows_of_records(several)
        assert pytest.approx((2.0 / 0.01 + 2.3 / 0.04) / (100 + 25), rel=1e-15) == row.Z
        assert row.Z_error == pytest.approx(1 / math.sqrt(125), rel=1e-15)
        assert row.chi2 == pytest.approx(0.09 / (0.01 + 0.04), rel=1e-12)
        assert row.reduced_pressure == pytest.approx(0.4 * row.Z)
        assert (row.replicas, row.collisions) == (2, 2000)
    assert row.equilibrated
    shift = theory.finite_size_shift(0.2, 108, theory.pieprzyk)
    assert row.Z_infinite == row.Z - shift
    assert row.deviation == pytest.approx((row.Z_infinite - theory.pieprzyk(0.2)) / row.Z_error)


def test_the_error_of_an_order_parameter_is_that_of_the_mean_of_replicas():
    rng = np.random.default_rng(1)
    means = [0.10, 0.14, 0.12, 0.20]
    records = [
        made(rng.normal(size=64), replica=k, order={"name": "Q_6", "values": [mean - 0.01, mean + 0.01] * 16})
        for k, mean in enumerate(means)
    ]
    (row,) = rows_of_records(records)
    assert row.order == pytest.approx(np.mean(means), rel=1e-14)
    assert row.order_error == pytest.approx(np.std(means, ddof=1) / math.sqrt(4), rel=1e-12)
    assert row.susceptibility == pytest.approx(108 * (np.var(means) + 0.01**2), rel=1e-12)
    (alone,) = rows_of_records(records[:1])
    assert math.isnan(alone.order_error)


def test_what_has_not_equilibrated_is_flagged():
    rng = np.random.default_rng(2)
    noise = rng.normal(size=512)
    falling = noise + np.linspace(1.0, 0.0, 512)
    order = {"name": "Q_6", "values": list(0.3 - 0.01 * np.arange(32) + 1e-3 * rng.normal(size=32))}
    cases = {
        "the pressure drifts": [made(falling)],
        "particles are where they began": [made(noise, moved=0.1)],
        "the crystal has melted": [made(noise, eta=0.6, initial="fcc", moved=3.0)],
        "Q_6 drifts": [made(noise, order=order)],
        "replicas disagree": [made(noise, z=2.0), made(noise, z=2.1, replica=1)],
    }
    for remark, records in cases.items():
        (row,) = rows_of_records(records)
        assert row.remarks == (remark,)
        assert not row.equilibrated
    # One replica of three is enough, wherever it stands.
    sound = {"random": [made(noise, replica=k) for k in (7, 8)]}
    sound["fcc"] = [made(noise, eta=0.6, initial="fcc", moved=0.1, replica=k) for k in (7, 8)]
    for remark in ("particles are where they began", "the crystal has melted"):
        (record,) = cases[remark]
        others = sound[record["task"]["scene"]["initial"]]
        for place in range(3):
            row = table.row([*others[:place], record, *others[place:]])
            assert remark in row.remarks
        assert row.moved == min(each["result"]["moved"] for each in (record, *others))
    short = made(noise)
    short["result"]["Z"] = short["result"]["Z"] | {"n_eff": 3.0}
    row = table.row([*sound["random"], short])
    assert row.remarks == ("too short for an error bar",)
    assert all(math.isnan(error) for error in (row.Z_error, row.reduced_pressure_error, row.order_error))
    assert "±" not in str(Table(table.Row, [row]))
    assert f"{row.Z:.4g} " in str(Table(table.Row, [row]))  # more digits would look like a small error
    assert "±" in str(Table(table.Row, [table.row(sound["random"])]))
    assert table.row(
        [sound["random"][0], made(noise) | {"result": made(noise)["result"] | {"relaxed": False}}]
    ).remarks
    differ = [made(noise, replica=k) for k in range(3)]
    for k, remarks in enumerate(((), ("species differ in temperature",))):  # one of several may, by chance
        differ[k]["result"]["species_differ"] = True
        assert table.row(differ).remarks == remarks
    for records in ([made(noise)], [made(noise, eta=0.6, initial="fcc", moved=0.1)]):
        (row,) = rows_of_records(records)
        assert row.equilibrated, row.remarks


def test_a_row_says_that_the_heavy_species_is_still_cold(monkeypatch):
    """And nothing of species that begin at one temperature."""
    species = [{"fraction": 0.5, "mass": 1000.0}, {"diameter": 0.5, "fraction": 0.5}]
    tasks = StudySpec(
        packing_fraction=(0.1,), n=(64,), replicas=2, collisions_per_particle=20, equilibration=1, blocks=16,
        frames=0, scene={"species": species},
    ).tasks()  # fmt: skip
    start = scenes.start

    def heavy_at_rest(*given):
        scene = start(*given)
        velocities = np.random.default_rng(1).normal(size=(scene.n, scene.dimension))
        velocities[scene.masses > 1.0] = 0.0
        return scene.replace(velocities=velocities)

    for begin, remark in ((start, False), (heavy_at_rest, True)):
        monkeypatch.setattr(scenes, "start", begin)
        records = [simulate(task) for task in tasks]
        row = table.row(records)
        assert all(record["result"]["species_differ"] is remark for record in records)
        assert ("species differ in temperature" in row.remarks) is remark
        assert not (remark and row.equilibrated)


@pytest.mark.parametrize("replicas", [1, 2, 4])
def test_the_error_asked_for_is_that_of_one_replica(replicas):
    # The mean of several has a smaller one. A tenth more than asked for is let pass.
    goal, z = 1e-3, 2.0
    for factor, remarks in ((1.05, ()), (1.15, ("the error asked for was not reached",))):
        noise = np.random.default_rng(2).normal(size=(replicas, 512))
        records = [made(values, z=z, error=factor * goal * z, replica=k) for k, values in enumerate(noise)]
        for record in records:
            record["task"]["relative_error"] = goal
        (row,) = rows_of_records(records)
        assert row.Z_error == pytest.approx(factor * goal * z / math.sqrt(replicas), rel=1e-14)
        assert row.remarks == remarks


def test_a_crystal_that_should_have_melted_is_seen():
    """Spheres that start from fcc at 0.49 stay a crystal, with a pressure that never drifts."""
    study = carom.equation_of_state(
        [0.49], lattice="fcc", n=256, replicas=1, equilibration=100, collisions_per_particle=300,
        executor="serial", frames=0,
    )  # fmt: skip
    (row,) = study.table
    assert row.phase == "fluid"
    assert "particles are where they began" in row.remarks


@pytest.mark.slow
def test_fluids_just_below_freezing_have_really_melted():
    study = carom.equation_of_state(
        [0.45, 0.48], n=256, replicas=1, equilibration=500, collisions_per_particle=500, executor="serial",
        frames=8,
    )  # fmt: skip
    for row in study.table:
        assert row.moved > drift.STUCK
        assert row.equilibrated, row.remarks
        if math.isfinite(row.order):
            # A crystal has 0.5; a fluid of n bonds' directions some n^(-1/2).
            assert row.order < 0.2


def test_crystals_stay_and_are_compared_with_the_crystal():
    study = carom.equation_of_state(
        [0.56], n=256, replicas=2, equilibration=100, collisions_per_particle=2000, executor="serial"
    )
    (row,) = study.table
    assert row.phase == "solid"
    assert row.equilibrated, row.remarks
    # Equations of the crystal are known to 6e-4 there (their spread), and a small one is seen through the
    # correction of order 1/N only.
    assert row.Z_infinite == pytest.approx(
        theory.almarza(0.56), abs=5 * row.Z_error + 12 * 6e-4 + 12 * 3 / 256**2
    )


def test_drift_is_a_standard_normal_number_in_equilibrium():
    rng = np.random.default_rng(3)
    found = np.array([drift.drift(rng.normal(size=512)) for _ in range(2000)])
    # Mean and variance of 2000 standard normal numbers, within five of their own errors.
    assert abs(found.mean()) < 5 / math.sqrt(2000)
    assert abs(found.var() - 1.0) < 5 * math.sqrt(2 / 2000)
    alarms = sum(drift.drifts(list(pair)) for pair in found.reshape(-1, 2))
    # One in a thousand; of 1000, more than 8 come with a probability of 1e-6.
    assert alarms <= 8


@pytest.mark.parametrize("parts", [4, 5, 16])
def test_drift_has_the_probability_of_the_slope_of_a_line(parts):
    """Against SciPy's regression, whose p-value knows that few points leave few degrees of freedom."""
    values = np.random.default_rng(parts).normal(size=7 * parts + 3)
    means = values[3:].reshape(parts, 7).mean(axis=1)
    line = linregress(np.arange(parts), means)
    found = drift.drift(values, parts)
    assert 2 * norm.sf(abs(found)) == pytest.approx(line.pvalue, rel=1e-9)
    assert math.copysign(1.0, found) == math.copysign(1.0, line.slope)


def test_drift_sees_a_relaxation_and_ignores_constants():
    rng = np.random.default_rng(4)
    decay = np.exp(-np.arange(512) / 100.0)
    assert drift.drift(rng.normal(size=512) + 3.0 * decay) < -4.0
    assert drift.drift(np.full(64, 1 / 3)) == 0.0
    assert drift.drift([1.0, 2.0]) == 0.0


# Starts.


@pytest.mark.parametrize(("n", "eta", "dimension"), [(500, 0.45, 3), (300, 0.3, 3), slow(600, 0.2, 4)])
def test_a_random_start_well_below_freezing_is_a_crystal_that_melts(n, eta, dimension):
    asked = SceneSpec(n=n, packing_fraction=eta, dimension=dimension, mass=2.0)
    scene = start_of(asked, np.random.default_rng(1))
    assert (scene.n, scene.dimension, scene.mass) == (n, dimension, 2.0)
    assert scene.packing_fraction == pytest.approx(eta, rel=1e-12)
    planes = np.unique(scene.positions[:, 0].round(9)).size
    assert planes < 20
    again = start_of(asked, np.random.default_rng(1))
    assert np.array_equal(scene.positions, again.positions)
    sim = carom.Simulation(scene, kT=1.0, seed=1)
    sim.run(collisions_per_particle=100)
    # The structure factor at reciprocal vectors of the lattice: n in a crystal, of the order of 1 in a fluid.
    signs = np.array([*itertools.product((-1.0, 1.0), repeat=dimension)])
    vectors = np.pi * planes / scene.box[0] * signs
    before, after = (
        np.mean(np.abs(np.exp(1j * where @ vectors.T).sum(axis=0)) ** 2) / n
        for where in (scene.positions, sim.frame().positions)
    )
    assert before == pytest.approx(n, rel=1e-6)
    assert after < 10.0


@pytest.mark.parametrize(
    ("n", "eta", "dimension"), [slow(500, 0.49, 3), (450, 0.52, 3), slow(32, 0.475, 3), slow(600, 0.3, 4)]
)
def test_a_random_start_near_freezing_is_a_melted_crystal_that_was_squeezed(n, eta, dimension):
    asked = SceneSpec(n=n, packing_fraction=eta, dimension=dimension, mass=2.0, diameter=3.0)
    scene = start_of(asked, np.random.default_rng(1))
    assert (scene.n, scene.dimension, scene.mass, scene.diameter) == (n, dimension, 2.0, 3.0)
    assert scene.packing_fraction == pytest.approx(eta, rel=1e-12)
    again = start_of(asked, np.random.default_rng(1))
    assert np.array_equal(scene.positions, again.positions)
    # Nothing is left of the planes of the lattice, of which there are few.
    assert np.unique(scene.positions[:, 0].round(6)).size > 0.9 * n
    if dimension == 3 and n > 100:
        # The mean of a fluid is that of as many bonds of random directions, some six a sphere: sqrt(1 / 6 n).
        # Neighboring bonds are not independent, near freezing by a factor of two; a crystal has 0.4 or more.
        assert q_6(carom.Simulation(scene, seed=0).frame()) < 3.0 / np.sqrt(6.0 * n)


@pytest.mark.parametrize(
    "more",
    [
        {"packing_fraction": 0.55},
        {"dimension": 2},
        {"n": 33},  # 108 sites of a lattice would have to fit
        {"n": 300, "packing_fraction": 0.45},  # 500 sites, as many as fit at a lower density
        {"walls": "z"},
        {"impact": 0.9},
    ],
)
def test_other_random_starts_are_placed_at_random(more):
    words = {"n": 256, "packing_fraction": 0.4, "dimension": 3, **more}
    asked = SceneSpec(**words)
    scene = start_of(asked, np.random.default_rng(1))
    assert np.array_equal(scene.positions, asked.build(np.random.default_rng(1)).positions)


# Fits.


def rows_of(dimension, etas, error, rng, *, sizes=(10**9,)):
    """Rows as a perfect study would give them."""
    equation = theory.best(dimension)
    rows = []
    for eta in etas:
        for n in sizes:
            z = equation(eta) + theory.finite_size_shift(eta, n, equation)
            sigma = error * z
            noisy = z + sigma * rng.normal()
            record = made(rng.normal(size=64), eta=eta, n=n, d=dimension, z=noisy, error=sigma)
            rows += rows_of_records([record])
    return rows


def test_what_is_not_known_of_virial_coefficients_grows_as_the_second_one():
    """Three points fit three terms: all that is left is the prior of the others, 2^(d-1)."""
    errors = [
        fits.virials(rows_of(d, (0.05, 0.1, 0.15), 1e-8, np.random.default_rng(1))).errors for d in (2, 3, 4)
    ]
    for more, less in zip(errors[1:], errors, strict=False):
        assert more == pytest.approx([2.0 * error for error in less], rel=1e-3)


@pytest.mark.parametrize("dimension", [2, 3, 4])
def test_virial_coefficients_come_out_within_honest_errors(dimension):
    rng = np.random.default_rng(dimension)
    pulls = []
    for _ in range(40):
        rows = rows_of(dimension, StudySpec(dimension=dimension).packing_fraction, 1e-4, rng)
        found = fits.virials([dataclasses.replace(r, equilibrated=True, remarks=()) for r in rows])
        pulls.append([(v - k) / e for v, k, e in zip(found.values, found.known, found.errors, strict=True)])
        # Honest, and still of use.
        assert found.errors[0] < 5e-3 * found.values[0]
        assert found.errors[2] < 0.2 * found.values[2]
    # Root mean square of 40 pulls: one would have scattered to 1.4 with a probability below 1e-4.
    assert (np.sqrt(np.mean(np.square(pulls), axis=0)) < 1.4).all()
    assert np.abs(pulls).max() < 4.5


def test_virials_need_points():
    rows = rows_of(3, [0.1, 0.2], 1e-4, np.random.default_rng(1))
    with pytest.raises(InputError, match="need at least 3"):
        fits.virials(rows)
    with pytest.raises(InputError, match="order"):
        fits.virials(rows, order=9)


def test_extrapolation_finds_the_infinite_system_and_the_slope():
    rng = np.random.default_rng(7)
    rows = rows_of(3, [0.2, 0.4], 1e-5, rng, sizes=(500, 1000, 2000, 4000))
    for fit in fits.extrapolate(rows):
        eta = fit.packing_fraction
        assert fit.sizes == (500, 1000, 2000, 4000)
        assert abs(fit.Z - theory.pieprzyk(eta)) < 4 * fit.Z_error
        assert abs(fit.slope - fit.theory_slope) < 4 * fit.slope_error
        assert fit.theory_slope == pytest.approx(theory.finite_size_shift(eta, 1, theory.pieprzyk))
        assert fit.chi2 < 20.0
    assert fits.extrapolate(rows_of(3, [0.2], 1e-4, rng)) == []


def test_the_slope_by_theory_is_that_of_the_theory_compared_with():
    rng = np.random.default_rng(9)
    sizes = (500, 2000)
    records = [made(rng.normal(size=64), eta=0.3, n=n) for n in sizes]
    (fit,) = fits.extrapolate(rows_of_records(records, theory.carnahan_starling))
    shift = theory.finite_size_shift(0.3, 1, theory.carnahan_starling)
    assert fit.theory_slope == pytest.approx(shift, rel=1e-9)
    crystals = [made(rng.normal(size=64), eta=0.6, n=n, initial="fcc", moved=0.1) for n in sizes]
    (fit,) = fits.extrapolate(rows_of_records(crystals))
    assert fit.theory_slope == theory.crystal_finite_size_shift(0.6, 1, theory.almarza)
    for record in records:
        record["result"]["confined"] = True
    (fit,) = fits.extrapolate(rows_of_records(records))
    assert math.isnan(fit.theory_slope)


def test_extrapolation_leaves_out_sizes_at_which_the_next_order_shows():
    rng = np.random.default_rng(8)
    rows = rows_of(3, [0.4], 1e-5, rng, sizes=(100, 250, 1000, 2000, 4000))
    # Far off the line, by a term of 1 / N^2.
    bent = [dataclasses.replace(r, Z=r.Z - 40.0 / r.n**2) for r in rows]
    (fit,) = fits.extrapolate([*reversed(bent)])
    assert fit.sizes in [(250, 1000, 2000, 4000), (1000, 2000, 4000)]
    assert abs(fit.Z - theory.pieprzyk(0.4)) < 4 * fit.Z_error
    # Two points are all there is: nothing is left to judge them by.
    (fit,) = fits.extrapolate(bent[:2])
    assert fit.sizes == (100, 250)


def test_combining_leaves_out_what_has_no_error():
    assert table.combined([1.0, 5.0], [0.1, math.inf], [1.0, 1.0])[:2] == (1.0, pytest.approx(0.1))
    mean, error, chi2 = table.combined([1.0, 3.0], [math.inf, math.inf], [1.0, 1.0])
    assert (mean, error) == (2.0, math.inf)
    assert math.isnan(chi2)


def test_an_error_that_came_out_too_small_does_not_decide_the_mean():
    mean, error, chi2 = table.combined([1.0, 2.0], [0.3, 1.0], [5.0, 5.0])
    assert mean == 1.5
    assert error == pytest.approx(math.sqrt(0.09 + 1.0) / 2)
    assert chi2 == pytest.approx(2 * 0.25 / (0.5 * 1.09))


def test_engines_that_do_not_exist_are_refused():
    for choice in ("magic", object(), True):
        with pytest.raises(InputError, match="executor must be"), engines.opened(choice):
            pass
    with pytest.raises(InputError, match="cores"), engines.opened("threads", 0):
        pass


# Order parameters.


@pytest.mark.parametrize(
    ("scene", "perfect"),
    [
        # Steinhardt, Nelson and Ronchetti, Phys. Rev. B 28, 784 (1983).
        (carom.Scene.crystal(cells=12, dimension=2, packing_fraction=0.8), 1.0),
        (carom.Scene.crystal(cells=5, packing_fraction=0.6), 0.57452),
        (carom.Scene.crystal(lattice=lattices.cubic(3), cells=6, packing_fraction=0.4), 0.35355),
    ],
    ids=lambda value: value if isinstance(value, float) else value.dimension,
)
@pytest.mark.usefixtures("unscheduled")
def test_order_parameters_know_a_crystal_and_have_the_same_bits_every_time(scene, perfect):
    _, order = ORDERS[scene.dimension]
    # Published to five digits.
    assert order(carom.Simulation(scene, seed=0).frame()) == pytest.approx(perfect, abs=1e-5)
    fluid = carom.Simulation(
        carom.Scene.random(1000, dimension=scene.dimension, packing_fraction=0.45, seed=0), seed=0
    ).frame()
    (same,) = {order(fluid) for _ in range(5)}
    assert same < 0.2


@pytest.mark.parametrize("periodic", [(True, True, True), (True, False, True)])
@pytest.mark.usefixtures("unscheduled")
def test_q_6_is_the_sum_over_spherical_harmonics_of_all_bonds(periodic):
    frame = carom.Simulation(
        carom.Scene.random(200, 0.4, walls=axes_without(periodic), seed=0), seed=0
    ).frame()
    ways = frame.positions[:, None] - frame.positions[None]
    box = np.asarray(frame.box)
    ways -= np.where(periodic, box * np.rint(ways / box), 0.0)
    distance = np.linalg.norm(ways, axis=2)
    near = (distance > 0.0) & (distance < 1.2 * 2 ** (1 / 6) * (box.prod() / 200) ** (1 / 3))
    x, y, z = (ways[near] / distance[near][:, None]).T
    means = [np.mean(sph_harm_y(6, m, np.arccos(z), np.arctan2(y, x))) for m in range(-6, 7)]
    exact = np.sqrt(4 * np.pi / 13 * np.sum(np.abs(means) ** 2))
    # Terms of order one cancel down to the square of Q_6, some 1e-3.
    assert q_6(frame) == pytest.approx(exact, rel=1e-11)


def balanced(page):
    """Whether every element of a page that is opened is closed, in order."""

    class Nesting(HTMLParser):
        stack: ClassVar[list[str]] = []

        def handle_starttag(self, tag, attrs):
            if tag not in ("meta", "img"):
                self.stack.append(tag)

        def handle_endtag(self, tag):
            assert self.stack.pop() == tag

    parser = Nesting()
    parser.feed(page)
    return not parser.stack


def test_pictures_and_the_report_show_every_kind_of_point(tmp_path):
    rng = np.random.default_rng(5)
    order = {"name": "Q_6", "values": [0.1] * 32}
    records = [
        made(rng.normal(size=64), eta=eta, n=n, z=2.0 + eta, order=order, moved=moved)
        for eta in (0.1, 0.2, 0.3, 0.4)
        for n, moved in ((108, 5.0), (500, 5.0), (1000, 0.1))
    ]
    for record in records:
        record["provenance"].update(
            began=0.0, engine_seconds=1.0, host="<here>", process=1, python="3", numpy="2"
        )
    spec = StudySpec(packing_fraction=(0.1, 0.2, 0.3, 0.4), n=(108, 500, 1000), replicas=1)
    failures = [Failure(spec.tasks()[0], "it <failed>")]
    study = studies.EquationOfState(spec, records, failures)
    study.plot(tmp_path / "eos.png", equations={"CS": theory.carnahan_starling})
    study.with_theory(theory.carnahan_starling).plot(tmp_path / "own.svg")
    assert (tmp_path / "eos.png").stat().st_size > 10_000
    study.save(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    # Self-contained: nothing is fetched, and what others wrote is text.
    assert not re.findall(r"https?:|<script|<link|<iframe|@import|url\(", page)
    assert all(
        source.startswith("data:image/svg+xml;base64,") for source in re.findall(r'src="([^"]*)', page)
    )
    assert "href" not in page
    assert balanced(page)
    assert page.count("data:image/svg+xml;base64,") == 3
    assert "it &lt;failed&gt;" in page
    assert "&lt;here&gt;" in page
    assert page.count('class="flagged"') == 5
    assert "particles are where they began" in page
    assert "packing_fraction = [0.1, 0.2, 0.3, 0.4]" in page
    # The four points with 1000 particles are flagged: hollow in each picture.
    for figure in (study.plot(), pictures.order(study), pictures.sizes(study)):
        assert not outside(figure)
        hollow = [
            point
            for line in figure.axes[0].get_lines()
            if line.get_markerfacecolor() == "white"
            for point in line.get_xdata()
            if point > 0.0  # where 1 / N is 0 stands what is extrapolated
        ]
        assert len(hollow) == (1 if figure.axes[0].get_xlabel() == "$1/N$" else 4)
    rows = study.table[:]
    top, bottom = study.plot().axes  # the pressure is Z times the density: it has no panel of its own
    assert strange_bars(top, [Estimate(row.Z_infinite, row.Z_error, 1.0, 1.0, 1) for row in rows]) == (12, [])
    above = [
        Estimate(100.0 * (row.Z_infinite / row.theory - 1.0), 100.0 * row.Z_error / row.theory, 1.0, 1.0, 1)
        for row in rows
    ]
    assert strange_bars(bottom, above) == (12, [])
    for axes, fit in zip(pictures.sizes(study).axes, study.extrapolate(), strict=False):
        assert strange_bars(axes, [rows, study.extrapolate()]) == (4, [])  # with the fitted value at 0
        lines = {line.get_label(): line.get_xydata() for line in axes.lines}
        for name, slope in (("fit", fit.slope), ("slope by theory", fit.theory_slope)):
            (low, at_low), (high, at_high) = lines[name]
            assert (low, at_low, at_high) == pytest.approx((0.0, fit.Z, fit.Z + slope * high))
            assert high > 1.0 / 108
    known = [dataclasses.replace(row, order_error=0.01 * (k + 1)) for k, row in enumerate(rows)]
    axes = pictures.order(SimpleNamespace(table=known)).axes[0]
    assert strange_bars(axes, known) == (12, [])
    studies.EquationOfState(spec).report(tmp_path / "empty.html")


@pytest.mark.needs("Chromium")
def test_a_report_opens_in_a_browser_without_a_network(tmp_path):
    study = carom.equation_of_state([0.1, 0.2, 0.3], replicas=1, **SMALL)
    study.report(tmp_path / "report.html")
    picture = tmp_path / "page.png"
    done = subprocess.run(
        [chromium(), "--headless", "--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND",
         f"--user-data-dir={tmp_path / 'profile'}", "--window-size=1100,2400", f"--screenshot={picture}",
         (tmp_path / "report.html").as_uri()],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert picture.stat().st_size > 20_000


# Mixtures, and other dimensions.


@pytest.mark.parametrize(("dimension", "eta"), [(1, 0.5), (2, 0.4), slow(4, 0.1)])
def test_studies_of_other_dimensions_agree_with_theory(dimension, eta):
    study = carom.equation_of_state(
        [eta], dimension=dimension, n=256, relative_error=1e-2, executor="serial", seed=3
    )
    (row,) = study.table
    assert row.equilibrated, row.remarks
    assert row.Z_error < 1.1e-2 * row.Z
    assert abs(row.deviation) < 4.0


MIXTURE = {"species": [{"diameter": 1.0, "fraction": 0.5}, {"diameter": 0.5, "fraction": 0.5, "mass": 0.125}]}


def test_mixtures_are_compared_with_the_theory_of_mixtures():
    study = carom.equation_of_state(
        [0.1, 0.3], n=256, relative_error=4e-3, scene=MIXTURE, executor="serial", seed=2
    )
    dilute, dense = study.table
    assert dilute.theory == pytest.approx(theory.bmcsl(0.1, [0.5, 0.5], [1.0, 0.5]), rel=1e-12)
    # An independent simulation, N = 864: tests/data/mixtures.json.
    found = dense.Z_infinite + theory.finite_size_shift(0.3, 864, theory.pieprzyk)
    assert abs(found - 3.5124) < 4.0 * math.hypot(dense.Z_error, 0.0018)
    assert StudySpec.from_toml(study.spec.to_toml()) == study.spec
    with pytest.raises(InputError, match="need at least 3"):
        study.virials()


@pytest.mark.slow
def test_walls_are_simulated_and_compared_with_nothing():
    study = carom.equation_of_state([0.2], replicas=1, scene={"walls": "z"}, **SMALL)
    (row,) = study.table
    assert math.isnan(row.theory)
    assert math.isnan(row.Z_infinite)
    assert row.Z > 1.0
    assert "from theory" not in str(study)


def mixed(record, diameters, **scene):
    """A record of equally many of each diameter, with more words of its scene."""
    record["result"]["species"] = [[s, record["result"]["n"] // len(diameters)] for s in diameters]
    record["task"]["scene"].update(scene)
    return record


WELL = {"type": "square-well", "range": 1.5, "depth": 1.0}


@pytest.mark.parametrize(
    "scene", [{"contact": [[1.0, 1.2], [1.2, 0.5]]}, {"impact": 0.9}, {"interaction": WELL}, {"pinned": 10}]
)
def test_what_has_no_theory_is_compared_with_none(scene):
    """That of additive mixtures was 20 errors off for one that is not additive."""
    noise = np.random.default_rng(3).normal(size=64)
    (row,) = rows_of_records([mixed(made(noise), (0.5, 1.0))])
    assert row.theory == theory.bmcsl(0.2, [0.5, 0.5], [0.5, 1.0])
    record = mixed(made(noise), (0.5, 1.0), **scene)
    (row,) = rows_of_records([record])
    assert math.isnan(row.theory)
    assert math.isnan(row.deviation)
    study = studies.EquationOfState(StudySpec(packing_fraction=(0.2,)), [record])
    # What the size does to a crystal is known of crystals without walls and the like only.
    (row,) = rows_of_records([mixed(made(noise, eta=0.6, initial="fcc", moved=0.1), (0.5, 1.0), **scene)])
    assert row.phase == "solid"
    assert math.isnan(row.Z_infinite)
    figure = study.plot()
    assert len(figure.axes) == 1
    # One of points with its error bars, and no curve.
    assert len(figure.axes[0].get_legend().get_texts()) == 1
    (row,) = study.with_theory(theory.carnahan_starling).table
    assert row.theory == theory.carnahan_starling(0.2)


@pytest.mark.slow
def test_wells_are_brought_to_the_temperature_asked_for():
    study = carom.equation_of_state(
        [0.3],
        n=400,
        replicas=1,
        dimension=1,
        equilibration=400,
        collisions_per_particle=100,
        scene={"interaction": SquareWell(1.5, 1.0)},
        executor="serial",
    )
    (row,) = study.table
    # The mean kT of 400 rods scatters by some 2 %; without rescaling it is 1.22 to 1.29.
    assert row.kT == pytest.approx(1.0, abs=0.1)
    assert math.isnan(row.theory)
    assert math.isnan(row.Z_infinite)


def test_the_error_of_a_negative_z_is_relative_to_its_size():
    """Wells can pull harder than cores push; no error would be small enough for such a Z."""
    assert Planned(0.1, 16).reached(Estimate(-1.0, 0.05, 100.0, 1.0, 64))
    assert not Planned(0.1, 16).reached(Estimate(-1.0, 0.2, 100.0, 1.0, 64))


def test_a_point_at_another_temperature_is_flagged():
    record = made(np.random.default_rng(3).normal(size=64))
    record["task"]["scene"].update(interaction=WELL, kT=0.9)
    (row,) = rows_of_records([record])
    assert (row.equilibrated, row.remarks) == (False, ("kT is 1, not 0.9",))
    for kT, off in ((0.4, 0.03), (40.0, 1.0)):  # 7.5 % and 2.5 %
        record["task"]["scene"]["kT"], record["result"]["kT"] = kT, kT + off
        (row,) = rows_of_records([record])
        assert row.equilibrated == (kT == 40.0)


def test_a_result_names_every_diameter():
    """The first 64 of 100 gave theory another mixture than the one simulated."""
    species = [{"diameter": 0.5 + 0.01 * k, "fraction": 0.01} for k in range(100)]
    (task,) = StudySpec(
        packing_fraction=(0.1,), n=(100,), replicas=1, collisions_per_particle=1, equilibration=1,
        blocks=16, scene={"species": species},
    ).tasks()  # fmt: skip
    assert sum(count for _, count in simulate(task)["result"]["species"]) == 100


def test_mixtures_of_disks_do_not_freeze_where_equal_disks_do():
    noise = np.random.default_rng(4).normal(size=64)
    (equal,) = rows_of_records([made(noise, eta=0.71, d=2)])
    (unequal,) = rows_of_records([mixed(made(noise, eta=0.71, d=2), (0.7, 1.0))])
    assert (equal.phase, unequal.phase) == ("coexistence", "fluid")
    assert unequal.theory == theory.santos_yuste_lopez_de_haro(0.71, [0.5, 0.5], [0.7, 1.0], 2)


@pytest.mark.parametrize(("dimension", "name"), [(2, "Santos"), (3, "Mansoori")])
def test_pictures_of_mixtures_show_the_theory_of_mixtures(dimension, name):
    """The curve of Z ends at the last density, on its equation of state."""
    equation = theory.bmcsl if dimension == 3 else theory.santos_yuste_lopez_de_haro
    more = () if dimension == 3 else (dimension,)
    noise = np.random.default_rng(5).normal(size=64)
    z = equation(0.3, [0.5, 0.5], [0.5, 1.0], *more)
    record = mixed(made(noise, eta=0.3, d=dimension, z=z), (0.5, 1.0))
    study = studies.EquationOfState(StudySpec(dimension=dimension), [record])
    figure = study.plot()
    assert figure.axes[0].get_title().startswith("Mixture of hard")
    (curve,) = (line for line in figure.axes[0].get_lines() if len(line.get_xdata()) > 2)
    assert name in curve.get_label()
    assert curve.get_xdata()[-1] == 0.3
    assert curve.get_ydata()[-1] == pytest.approx(z, rel=1e-12)


def test_a_run_goes_on_until_its_error_is_small_enough():
    """A third of the length that the plan has: the error asked for is reached all the same."""
    spec = StudySpec(packing_fraction=(0.3,), n=(108,), replicas=1, relative_error=5e-3)
    (task,) = spec.tasks()
    short = {**task, "collisions_per_particle": task["collisions_per_particle"] / 3}
    result = simulate(short)["result"]
    z = result["Z"]
    assert len(result["block_values"]) > task["blocks"]
    assert z["error"] <= 5e-3 * z["mean"]
    # Not much more was run than had to be.
    assert z["error"] > 0.5 * 5e-3 * z["mean"]
    limited = simulate({**short, "relative_error": 1e-6, "blocks": 32, "collisions_per_particle": 10.0})[
        "result"
    ]
    assert len(limited["block_values"]) == 16 * 32
    (row,) = rows_of_records(
        [{"task": {**short, "relative_error": 1e-6}, "result": limited, "provenance": {"seconds": 1.0}}]
    )
    assert "the error asked for was not reached" in row.remarks
    assert row.equilibrated


def test_a_line_through_three_sizes_has_one_degree_of_freedom():
    sizes = (100, 200, 400)
    rows = rows_of(3, [0.2], 1e-4, np.random.default_rng(1), sizes=sizes)

    def fitted(off):
        on_a_line = [
            dataclasses.replace(row, Z=3.0 + 5.0 / row.n + (row.n == 100) * off, Z_error=0.01) for row in rows
        ]
        (fit,) = fits.extrapolate(on_a_line)
        return fit

    one = fitted(0.01).chi2
    assert 0.0 < one < 1.0
    # One normal number in a thousand has a square above 10.83; with two of them it is 13.8.
    assert fitted(0.01 * math.sqrt(10.5 / one)).sizes == sizes
    assert fitted(0.01 * math.sqrt(11.2 / one)).sizes == sizes[1:]


def test_a_study_of_dense_disks_says_that_phases_may_coexist():
    words = {"dimension": 2, "replicas": 1, "n": 418, "collisions_per_particle": 10, "lattice": "none"}
    for fractions, told in (([0.70, 0.74], True), ([0.60], False)):
        spec = StudySpec(tuple(fractions), **{**words, "n": (64,)})
        records = [simulate({**task, "equilibration": 0.0}) for task in spec.tasks()]
        said = "freezes at 0.7 and the solid melts at 0.72: between these, phases may coexist"
        assert (said in " ".join(str(EquationOfState(spec, tuple(records))).split())) is told


def test_a_number_that_a_lattice_changes_is_told():
    study = EquationOfState(StudySpec((0.75,), n=(400, 418), dimension=2, replicas=1))
    assert [task["scene"]["n"] for task in study.tasks] == [418]
    assert "Lattices were filled, with the nearest number: 418 for n = 400." in str(study)
    assert "nearest" not in str(EquationOfState(StudySpec((0.75,), n=(418,), dimension=2)))
