"""``carom trade``: time-driven stepping, what is asked of each method, and the whole comparison in small."""

import csv
import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.naive.stepping import SteppedSystem
from helpers.screens import printed

import carom
from carom import theory
from carom.errors import InputError
from carom.reference import NaiveSystem
from carom.scene.velocities import temperature
from carom.studies import Trade
from carom.studies.study import Look
from carom.studies.trade import measures as trade_measures, rows as trade_rows
from carom.studies.trade.diffusion import BLOCK, EinsteinSlope, looks
from carom.studies.trade.methods import engine, oracle, stepping
from carom.studies.trade.picture import LOOKS, pareto, picture
from carom.studies.trade.scenes import small_scene
from carom.studies.trade.spec import TradeSpec, methods
from carom.studies.trade.trade import LYAPUNOV, median, melted, method_of

EPS = np.finfo(float).eps


@pytest.fixture(scope="module")
def scene():
    """Sixteen disks in motion, and their mean free time."""
    return melted(carom.Scene.random(16, 0.3, 2, seed=1), 1)


# Stepping.


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_two_spheres_swap_their_velocities_a_step_too_late_at_most(dimension):
    box, first, second = [10.0] * dimension, [0.5] + [1.0] * (dimension - 1), [9.0] + [1.0] * (dimension - 1)
    # Towards each other through the face of the box: the gap of 0.5 closes in a time of 0.25.
    v = np.zeros((2, dimension))
    v[0, 0], v[1, 0] = -1.0, 1.0
    system = SteppedSystem([first, second], v, box, step=0.07)
    (collision,) = system.run(10)
    assert (collision.i, collision.j) == (0, 1)
    assert collision.time == pytest.approx(0.25, abs=16 * EPS)
    np.testing.assert_array_equal(system.velocities, -v)
    # Found after the fourth step, 0.03 too late: by so much, twice the speed of each, they overlap.
    assert system.worst_overlap == pytest.approx(0.06, abs=64 * EPS)
    assert system.virial == pytest.approx(2.0 * (1.0 - 0.06))


def test_stepping_conserves_energy_and_momentum(scene):
    start, mean_free_time = scene
    system = SteppedSystem(start.positions, start.velocities, start.box, step=0.01 * mean_free_time)
    system.run(3000)
    assert system.collisions > 100
    energy, before = (system.velocities**2).sum(), (start.velocities**2).sum()
    assert energy == pytest.approx(before, rel=system.collisions * 4 * EPS)
    np.testing.assert_allclose(system.velocities.sum(axis=0), 0.0, atol=system.collisions * 4 * EPS)


def test_the_error_of_stepping_shrinks_with_the_step(scene):
    start, mean_free_time = scene
    duration = 2 * mean_free_time  # thirteen collisions
    exact = NaiveSystem(start.positions, start.velocities, start.box, arithmetic="float")
    exact.advance_to(duration)
    errors = []
    for steps in (10, 100, 1000, 10000):
        system = SteppedSystem(start.positions, start.velocities, start.box, step=duration / steps)
        system.run(steps)
        errors.append(np.abs(system.positions - exact.positions).mean())
    # Of first order, a factor of 1000 in all, but for one of ten that chance decides.
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < errors[0] / 100


# What is asked.


@pytest.fixture(scope="module")
def track(scene):
    start, mean_free_time = scene
    return trade_measures.true_track(start, oracle(), mean_free_time, 12, Look())


@pytest.mark.parametrize("method", [engine(), oracle(20)], ids=lambda method: method.name)
def test_doubles_follow_the_true_trajectory_as_far_as_they_should(scene, track, method):
    found = trade_measures.faithfulness(scene[0], method, track, Look())
    # Ten roundings at most enter a collision, and a few of them make an error after one collision a particle.
    assert found.error < 64 * EPS * max(scene[0].box)
    assert found.order == found.position == math.inf  # twelve collisions a particle are no challenge
    assert len(track.order) == track.collisions[-1]
    order, positions = [*track.order], track.positions.copy()
    order[8], positions[-2, 3] = (-1, -1), 0.0
    found = trade_measures.faithfulness(
        scene[0], method, dataclasses.replace(track, order=order, positions=positions), Look()
    )
    assert found.order == 1.0  # eight collisions among sixteen disks
    assert found.position == track.collisions[-2] / 8


def test_a_graze_in_one_of_three_starts_does_not_decide_the_horizon():
    one, rest = trade_measures.Faithfulness(3.0, 3.4, 2e-7), trade_measures.Faithfulness(11.0, 12.0, 1e-7)
    never = trade_measures.Faithfulness(math.inf, math.inf, 3e-7)
    assert median([one, never, rest]) == trade_measures.Faithfulness(11.0, 12.0, 2e-7)


def test_a_coarse_step_loses_the_trajectory_at_once_and_a_fine_one_later(scene, track):
    start, mean_free_time = scene
    coarse, fine = (
        trade_measures.faithfulness(start, stepping(step, mean_free_time), track, Look())
        for step in (1e-1, 1e-4)
    )
    assert coarse.position < 2.0
    assert coarse.position < fine.position < math.inf
    assert coarse.error > 10 * fine.error


def test_runs_come_back_as_far_as_their_arithmetic_allows(scene):
    start, mean_free_time = scene
    duration = 3 * mean_free_time
    assert trade_measures.reversal(start, oracle(), duration) < 4 * EPS * max(start.box)  # as doubles see it
    assert trade_measures.reversal(start, engine(), duration) < 1e-10
    assert trade_measures.reversal(start, oracle(20), duration) < 1e-10
    assert trade_measures.reversal(start, stepping(0.1, mean_free_time), duration) > 1e-3


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize("method", [engine(), oracle(20), stepping(0.1, 1.0)], ids=lambda method: method.name)
def test_every_method_has_the_temperature_of_its_start(scene, method):
    start, _ = scene
    kT = temperature(start, start.velocities)
    assert kT == pytest.approx(np.sum(start.velocities**2) / (2 * 15), rel=64 * EPS)  # about the rest
    assert method.start(start, False).kT() == pytest.approx(kT, rel=64 * EPS)


def test_the_bias_of_coarse_stepping_is_seen_and_the_engine_has_none(scene):
    start, mean_free_time = scene
    true = trade_measures.expected_pressure(start)
    good = trade_measures.measured(start, engine(), mean_free_time, 0.2, Look())
    bad = trade_measures.measured(start, stepping(0.3, mean_free_time), mean_free_time, 0.2, Look())
    z, wrong = good.pressure.Z, bad.pressure.Z
    for found in (good, bad):
        # The longer step is 0.3, and a block has a whole number of them.
        np.testing.assert_allclose(found.pressure.block_durations, BLOCK * mean_free_time, rtol=0.3 / BLOCK)
    # Sixteen disks: what the correction of order 1/N leaves out, beside four errors.
    assert abs(z.mean - true) < 4 * z.error + 0.02 * true
    assert abs(wrong.mean - z.mean) > 4 * math.hypot(wrong.error, z.error)
    assert bad.motion.faults()[0] > 0.05


def test_the_front_is_of_those_that_nobody_beats_twice():
    speeds = [100.0, 10.0, 1.0, 50.0, 5.0]
    errors = [1e-3, 1e-6, 1e-9, 1e-2, math.nan]
    assert pareto(speeds, errors) == [2, 1, 0]


def test_the_picture_has_the_error_of_each_bias_and_both_errors_of_each_size():
    rng = np.random.default_rng(2)
    rows = [
        SimpleNamespace(algorithm=algorithm, method=f"{algorithm} {k}", collisions_per_second=rate,
                        error_1=rate, z_bias=bias, z_error=error)
        for k, algorithm in enumerate(LOOKS)
        for rate, bias, error in rng.uniform(0.1, 1.0, (2, 3)) * [1.0, -1.0, 0.5]
    ]  # fmt: skip
    sizes = [SimpleNamespace(n=n, relative_error_1s=1.0 / n, finite_size_bias=-9.0 / n**2) for n in (64, 256)]
    _, panel, last = picture(rows, sizes).axes
    bars = [line.get_data() for line in panel.get_lines() if line.get_linewidth() == 1.0]
    ends = [(end := max(-row.z_bias, row.z_error), end + row.z_error) for row in rows]
    assert [tuple(y) for _, y in bars] == ends
    assert [tuple(x) for x, _ in bars] == [(row.collisions_per_second,) * 2 for row in rows]
    assert [line.get_ydata().tolist() for line in last.get_lines()] == [
        [row.relative_error_1s for row in sizes],
        [-row.finite_size_bias for row in sizes],
    ]


def test_a_row_has_the_bias_of_each_quantity_with_the_errors_of_both():
    spent = {"collisions_per_second": 1e6, "cpu_seconds": 4.0}
    unknown = ("bytes_per_particle", "worst_overlap", "order", "position", "error_1")
    found = {
        "method": "steps", "algorithm": "time-driven", "n": 64, "energy_drift": 0.0, "momentum_drift": 0.0,
        "order_kept": False, "position_kept": False, "back": [None] * 3, **dict.fromkeys(unknown),
        "Z": [3.3, 0.03], "count": [3.2, 0.04], "D": [0.3, 0.006],
    }  # fmt: skip
    task = {"method": {"kind": "time-driven", "step": 0.1}}
    record = {"task": task, "result": found, "provenance": spent}
    made = trade_rows.row(record, {64: (3.0, [0.25, 0.0025])})
    assert (made.z_bias, made.z_error) == pytest.approx((0.1, 0.01))
    assert (made.contact_bias, made.contact_error) == pytest.approx((0.1, 0.02))
    assert (made.diffusion_bias, made.diffusion_error) == pytest.approx((0.2, math.hypot(0.02, 0.01)))
    assert (made.z_cost, made.diffusion_cost) == pytest.approx((2.0 * 0.03 / 3.3, 2.0 * 0.02))
    assert trade_rows.row(record, {64: (3.0, [0.3, 0.006])}).diffusion_error == 0.02
    assert made.choice.startswith("for no Z to better than 0.1;")  # ten standard errors
    assert "no bias is seen" in trade_rows.row(record, {64: (3.25, [0.3, 0.006])}).choice
    of_size = {"n": 64, "Z": [2.0, 0.02], "bias": -0.005, "corrected": 0.001}
    sized = trade_rows.size_row({"result": of_size, "provenance": spent})
    assert (sized.relative_error_1s, sized.corrected_error) == pytest.approx((0.02, 0.01))
    assert sized.break_even == pytest.approx(16.0)  # seconds after which 0.02 has become 0.005
    assert sized.choice.startswith("for errors of Z above 0.005,")


def test_a_small_scene_has_the_same_density_and_room_for_stepping():
    for scene in (
        carom.Scene.crystal(cells=8, density=0.5),
        carom.Scene.crystal(cells=8, packing_fraction=0.6),
        carom.Scene.crystal(cells=30, dimension=2, packing_fraction=0.7),
        carom.Scene.crystal(cells=4, lattice="dn", dimension=4, packing_fraction=0.2),
    ):
        small = small_scene(scene)
        assert 16 <= small.n <= 64
        assert small.packing_fraction == pytest.approx(scene.packing_fraction, rel=1e-12)
        assert min(small.box) >= 2.0


def test_every_method_is_one_line():
    assert [method_of(words, 1.0).name for words in methods()] == [
        "float64", "float32", "50 digits", "step 0.1", "step 0.01", "step 0.001", "step 0.0001",
        "Mie 50-49, step 0.0005", "Mie 50-49, step 0.001", "Mie 50-49, step 0.002",
    ]  # fmt: skip


# Diffusion.


def test_the_slope_of_a_random_walk_through_the_box_is_its_d():
    rng, box, duration = np.random.default_rng(1), [3.0, 4.0], 0.5
    at = rng.uniform(size=(500, 2)) * box
    slope = EinsteinSlope(at, box, duration)
    for _ in range(200):
        for _ in range(3):
            at = np.mod(at + rng.normal(scale=0.2, size=at.shape), box)
            slope.look(at)
        slope.mark()
    found = slope.estimate()
    right = 3 * 0.2**2 / (2.0 * duration)
    assert found.error < 0.02 * right
    assert abs(found.mean - right) < 5.0 * found.error


def test_positions_are_looked_at_before_anybody_crosses_half_of_the_box():
    assert looks([10.0, 20.0], 1.0, 0.8) == 1
    assert looks([10.0, 20.0], 1.0, 8.0) == 10  # six thermal velocities, five lengths


# The whole.


@pytest.fixture(scope="module")
def finished():
    """A comparison in small."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("carom.studies.trade.spec.SIZES", (64, 256))
        patch.setattr("carom.studies.trade.spec.STEPS", (1e-1, 1e-2))
        patch.setattr("carom.studies.trade.spec.VERLET", (2e-3,))
        spec = TradeSpec(seconds=0.05, scene={"dimension": 2, "n": 16, "packing_fraction": 0.3})
        yield Trade(spec).run()


def test_the_tables_hold_what_was_found(finished, tmp_path):
    study = finished
    for name, save in study.files().items():
        save(tmp_path / name)
    for name, rows in (("trade", study.rows), ("sizes", study.sizes), ("sampling", study.sampling)):
        with (tmp_path / f"{name}.csv").open() as stream:
            table = list(csv.DictReader(stream))
        assert len(table) == len(rows)
        for line, row in zip(table, rows, strict=True):
            for key, text in line.items():
                value = getattr(row, key)
                if isinstance(value, float):
                    assert math.isnan(value) if text == "" else float(text) == value, (name, key)
                else:
                    assert text == str(value).lower() or text == value, (name, key)
    assert study.more()["horizon"]["to_one"] > 0.0
    assert (tmp_path / "trade.png").stat().st_size > 10_000
    for shown in study.tables():
        lines = printed(shown, 60, terminal=True).splitlines()
        assert all(len(line) <= 60 for line in lines)
        for word in (word for _, column in shown.columns() for word in column.head.split()):
            assert any(word in line for line in lines), word
        assert {*shown.to_dataframe().columns} == {*shown.names()}
    first = [printed(table, 80, terminal=True).splitlines() for table in study.printed()]
    assert max(len(line) for lines in first for line in lines) <= 80
    assert sum(map(len, first)) < 3 * len(study.rows) + 20
    study.report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    titles = [table.title for table in study.tables()]
    assert len(titles) == 7
    assert all(title.partition(";")[0] in page for title in titles)


def test_the_comparison_shows_what_the_paper_says(finished):
    rows = {row.method: row for row in finished.rows}
    event_driven, step = rows["float64"], rows["step 0.1"]
    assert event_driven.worst_overlap < 1e-12 < step.worst_overlap
    assert event_driven.error_1 < 1e-12 < step.error_1
    assert event_driven.energy_drift < 1e-10
    assert event_driven.error_1 < rows["float32"].error_1 < step.error_1
    assert rows["float32"].bytes_per_particle < event_driven.bytes_per_particle
    assert rows["50 digits"].energy_drift < 1e-40
    # The same observables of all.
    for row in rows.values():
        assert math.isfinite(row.contact_bias)
        assert abs(row.diffusion_bias) < max(6.0 * row.diffusion_error, 0.2)
        assert row.diffusion_cost > 0.0 < row.z_cost
    assert event_driven.diffusion_bias == 0.0


def test_a_crystal_without_room_for_the_small_scene_is_refused_before_anything_runs():
    with pytest.raises(InputError, match="too near close packing"):
        TradeSpec(scene={"lattice": "fcc", "packing_fraction": 0.73})
    with pytest.raises(InputError, match="nothing to compare"):
        TradeSpec(scene={"lattice": "cubic", "cells": 1, "packing_fraction": 0.1})


@pytest.mark.parametrize(("dimension", "density"), LYAPUNOV)
def test_the_published_rates_are_at_our_temperature(dimension, density):
    # Of 64 particles 2 K / (d N) = 1 is another temperature: all rates are 0.8 % higher.
    eta, equation = density * theory.ball_volume(dimension, 1.0), theory.best(dimension)
    z = equation(eta) + theory.finite_size_shift(eta, 64, equation)
    _, rate = LYAPUNOV[dimension, density]
    assert rate == pytest.approx(float(theory.collision_rate(z, dimension, n=64)), rel=0.007)


@pytest.mark.slow
@pytest.mark.parametrize(("dimension", "density"), LYAPUNOV)
def test_the_horizon_is_the_one_of_the_lyapunov_exponent(dimension, density):
    start, mean_free_time = melted(
        carom.Scene.crystal(
            cells=64 if dimension == 1 else 8 if dimension == 2 else 4,
            lattice="cubic",
            dimension=dimension,
            density=density,
        ),
        1,
    )
    track = trade_measures.true_track(start, oracle(), mean_free_time, 80, Look())
    exponent, rate = LYAPUNOV[dimension, density]
    print(f"d={dimension} density={density}: exponent {track.lyapunov:.3f}, published {exponent}")
    # A finite-time exponent of some forty mean free times scatters by about a tenth.
    assert track.lyapunov / track.rate == pytest.approx(exponent / rate, rel=0.25)
    found = trade_measures.faithfulness(start, engine(), track, Look())
    theory = math.log(1e-3 / EPS) / track.lyapunov * track.rate
    print(f"lost after {found.position:.1f} (order {found.order:.1f}), theory {theory:.1f}")
    assert found.position == pytest.approx(theory, rel=0.25)
    assert found.order == pytest.approx(found.position, rel=0.25)
