"""Volume and pressure under a barostat, measured: exact values of rods, runs of scene files, refusals."""

import functools
import json
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.commands import assert_same_run
from typer.testing import CliRunner

import carom
from carom import theory
from carom.block import Block, VolumeSums
from carom.cli import app
from carom.observables import Volume
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import RunSpec, SceneSpec
from carom.simulation.measuring.until_precise import merged
from carom.simulation.moves.barostat import VolumeMoves, volume_sums
from carom.studies.job import Look
from carom.studies.phase import MeanBox, _theory, phase_of, shift
from carom.studies.runs.driver import Measured, Run
from carom.studies.runs.report import at_constant_pressure

SLOW = pytest.mark.slow

FOUR_SIGMA = 4.0
"""Above the standard error of some ten averages in this file: one run in 1500 would fail by chance, once."""


def rods(n):
    return carom.Scene(2.0 * (0.5 + np.arange(n))[:, None], box=2.0 * n)


def mean_length(n, p):
    """Return the mean length of a ring of n rods of length 1 at the pressure p kT.

    Z_N is proportional to L (L - n)^(n - 1). With exp(-p L) this is a sum of two Gamma distributions.
    """
    weights = np.array([n / p, n])  # of the shapes n + 1 and n, over a common factor
    return n + float(weights @ (np.array([n + 1, n]) / p)) / weights.sum()


def measured_rods(n, seed, moves, pressure=1.5, kT=2.0):
    barostat = carom.Barostat(pressure, interval=0.7, seed=seed)
    sim = carom.Simulation(rods(n), barostat=barostat, kT=kT, seed=seed)
    sim.run(time=35.0)
    return sim.measure(Volume(), time=0.7 * moves, blocks=moves // 4)


def test_rods_have_the_length_and_the_pressure_of_the_ensemble(plain):
    found = measured_rods(2, seed=2, moves=480)
    assert abs(found.pressure.mean - 1.5) < FOUR_SIGMA * found.pressure.error < 0.8
    exact = mean_length(2, 1.5 / 2.0)
    assert abs(found.volume.mean - exact) < FOUR_SIGMA * found.volume.error < 0.2 * exact
    assert found.packing_fraction.mean == pytest.approx(2.0 / found.volume.mean, rel=1e-14)
    assert found.packing_fraction.relative_error == pytest.approx(found.volume.relative_error, rel=1e-12)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_volume_and_pressure_are_means_over_the_time_of_all_blocks(d):
    rng = np.random.default_rng(d)
    durations, sums = rng.uniform(1.0, 2.0, 256), rng.uniform(1.0, 2.0, (256, 3))
    sums[:, 0] = np.repeat(sums[::4, 0], 4)  # a volume is slower than the rest
    blocks = [
        Block(time, 1, 99.0, volumes=VolumeSums(*each)) for time, each in zip(durations, sums, strict=True)
    ]
    scene = carom.Scene(2.0 * np.eye(2, d), box=(5.0,) * d)
    found = Volume().of_scene(blocks, scene, kT=3.0)
    volume, inverse, virial = sums.sum(axis=0) / durations.sum()
    assert found.volume.mean == pytest.approx(volume)
    assert found.pressure.mean == pytest.approx(2 * 3.0 * inverse + virial / d)
    assert found.pressure.n_eff == found.volume.n_eff < 200
    assert found.packing_fraction.mean == pytest.approx(scene.packing_fraction * scene.volume / volume)
    assert found.block_values == pytest.approx(sums[:, 0] / durations)
    numbers = at_constant_pressure(found, VolumeMoves(carom.Barostat(0.7, 1.0, 0.1)), 2.0)
    assert numbers["Z"].mean == pytest.approx(0.7 * volume / (2 * 3.0))
    assert numbers["reduced_pressure"].mean == pytest.approx(found.pressure.mean * 2.0**d / 3.0)
    assert numbers["volume"] == found.volume


@SLOW
def test_error_bars_of_length_and_pressure_cover_the_exact_values():
    """Of 60 intervals of 95 %, fewer than 50 cover by chance three times in 10 000, for each of the two."""
    exact, covered = mean_length(3, 1.5 / 2.0), np.zeros(2)
    for seed in range(60):
        found = measured_rods(3, seed, moves=400)
        for k, (each, value) in enumerate(((found.volume, exact), (found.pressure, 1.5))):
            low, high = each.confidence(0.95)
            covered[k] += low < value < high
    assert (covered >= 50).all(), covered


@SLOW
def test_spheres_have_the_pressure_of_their_barostat():
    barostat = carom.Barostat(pressure=3.0, interval=0.1, step=0.025)
    sim = carom.Simulation(carom.Scene.random(32, 0.33, seed=1), barostat=barostat, seed=1)
    sim.run(time=50.0)
    found = sim.measure(Volume(), time=1000.0, blocks=512)
    assert abs(found.pressure.mean - 3.0) < FOUR_SIGMA * found.pressure.error
    assert found.pressure.error < 0.06 * 3.0


@pytest.mark.parametrize("n", [200, 2000])
def test_the_shift_of_z_at_constant_pressure_is_exact_for_rods_to_order_one_over_n(n):
    """The next order is 1 / n^2, with a coefficient of the order of Z."""
    p = 1.7
    length = mean_length(n, p)
    eta = n / length
    phase = phase_of(MeanBox(n, 1, eta), "random", 9.0)
    more = shift(MeanBox(n, 1, eta), phase, theory.tonks)
    assert more == pytest.approx(1.0 / n, rel=1e-6)
    (row,) = _theory(MeanBox(n, 1, eta), phase)  # 1 + d ln Z / d ln eta, with Z = 1 / (1 - eta)
    assert row.errors == pytest.approx(1.0 / (1.0 - eta), rel=1e-3)
    assert abs(p * length / n - theory.tonks(eta) - more) < 10.0 / n**2


def test_blocks_add_up_to_the_whole_however_the_run_is_cut(plain):
    def fresh():
        return carom.Simulation(rods(3), barostat=carom.Barostat(1.0, 0.3, 1.0), seed=1)

    whole = fresh().run(time=12.0)
    sim = fresh()
    together = functools.reduce(merged, [sim.run(time=length) for length in (0.3, 0.35, 5.05, 6.3)])
    assert together.volumes == pytest.approx(whole.volumes, rel=1e-12)
    assert together.virial == pytest.approx(whole.virial, rel=1e-12)
    assert sim.statistics.volume_moves_accepted > 5
    assert carom.Simulation(rods(3)).run(time=0.1).volumes is None


def test_a_stretch_that_begins_anew_holds_nothing_of_the_pilot(plain):
    sim = carom.Simulation(rods(3), barostat=carom.Barostat(1.0, 0.3, 1.0), seed=1)
    stretch = Measured({}, sim)
    for segments in (2, 4):
        stretch.begin_segments(segments, 1.5 * segments)
        start = volume_sums(sim._state)
        for _ in range(segments):
            stretch.run_block(Look())
            stretch.temperatures.append((1.0,))
            stretch.layers.append((1.0,))
        blocks = stretch.blocks()
        assert len(blocks) == len(stretch.temperatures) == len(stretch.layers) == segments
        added = np.sum([block.volumes for block in blocks], axis=0)
        assert added == pytest.approx(np.subtract(volume_sums(sim._state), start), rel=1e-12)


def test_what_happens_between_two_moves_counts_with_the_volume_of_then(plain):
    barostat = carom.Barostat(1.0, 0.25, 1.0)
    sim, right = carom.Simulation(rods(3), barostat=barostat, seed=1), np.zeros(3)
    for _ in range(40):
        volume = sim.scene.volume
        block = sim.run(time=0.25)  # a move is made at the end
        right += 0.25 * volume, 0.25 / volume, block.virial / volume
    assert tuple(volume_sums(sim._state)) == pytest.approx(tuple(right), rel=1e-12)
    assert sim.statistics.volume_moves_accepted > 5
    assert sim.collisions > 5


def test_an_observable_of_ones_own_is_measured_under_a_barostat(plain):
    class Length:
        def add(self, frame):
            return frame.box[0]

    sim = carom.Simulation(rods(2), barostat=carom.Barostat(1.0, 0.3, 1.0), seed=1)
    own, found = sim.measure(Length(), Volume(), time=30.0, blocks=50)
    assert own.mean == pytest.approx(found.volume.mean, rel=0.1)


TOML = """
[scene]
n = 8
dimension = 2
packing_fraction = 0.3

[run]
barostat = { pressure = 1.2, interval = 0.1, step = 0.2, seed = 7 }
equilibration = 4
time = 8.0
frames = 4
write = ["h5md", "extxyz"]
pictures = false
checkpoint_every = 1e-6
"""


def test_a_scene_file_has_a_barostat():
    plan = SceneFile.from_toml(TOML)
    assert plan.run.barostat == carom.Barostat(1.2, 0.1, 0.2, seed=7)
    assert SceneFile.from_toml(plan.to_toml()) == plan


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("pressure = 1.2, ", "", "barostat: the table needs pressure"),
        ("pressure = 1.2", "pressure = -1.2", "pressure of Barostat"),
        ("interval = 0.1", "every = 0.1", "has no 'every'"),
        ("{ pressure = 1.2, interval = 0.1, step = 0.2, seed = 7 }", "1.2", "must be a table with pressure"),
        ("frames", "event_log = true\nframes", "event_log goes without a barostat"),
        ("frames", "swaps = { interval = 1.0 }\nframes", "swaps goes without a barostat"),
        ("n = 8", 'n = 8\nwalls = "x"', "not defined with walls"),
        ("n = 8", "n = 8\nimpact = 0.9", "lose energy"),
    ],
)
def test_what_goes_without_a_barostat_in_a_scene_file_ends_with_code_2(tmp_path, old, new, said):
    path = tmp_path / "npt.toml"
    path.write_text(TOML.replace(old, new))
    done = CliRunner().invoke(app, ["run", str(path), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert said in " ".join(done.output.split())
    assert not (tmp_path / "out").exists()


def test_the_page_of_a_dry_run_names_the_barostat(tmp_path):
    path = tmp_path / "npt.toml"
    path.write_text(TOML)
    done = CliRunner().invoke(app, ["run", str(path), "--dry-run"])
    assert "pressure 1.2, a move at every 0.1" in done.output


class Killed(Exception):
    pass


@pytest.fixture
def finished(tmp_path):
    """Return the folder of a run that went through, and that of one that was killed and resumed."""
    plan = SceneFile.from_toml(TOML)
    carom.run(plan, tmp_path / "whole")

    def killed(fraction, stage):
        if stage == "Measuring" and fraction > 0.6:
            raise Killed

    with pytest.raises(Killed):
        carom.run(plan, tmp_path / "cut", progress=killed)
    assert (tmp_path / "cut" / "checkpoint.h5").exists()
    assert not (tmp_path / "cut" / "summary.json").exists()
    carom.resume(tmp_path / "cut")
    return tmp_path / "whole", tmp_path / "cut"


@pytest.mark.filterwarnings("ignore::carom.CaromWarning")
def test_a_run_at_constant_pressure_that_was_killed_ends_with_the_same_bits(finished):
    whole, cut = finished
    assert_same_run(whole, cut)
    found = json.loads((whole / "summary.json").read_text())
    barostat, volume = found["barostat"], found["volume"]
    assert barostat["pressure"] == 1.2
    assert 0 < barostat["accepted"] < barostat["tried"]
    assert found["packing_fraction"] == pytest.approx(2.0 * np.pi / volume["mean"], rel=1e-12)
    assert found["Z"]["mean"] == pytest.approx(1.2 * volume["mean"] / 8, rel=1e-12)
    assert found["Z_infinite"]["mean"] == pytest.approx(found["Z"]["mean"] - 1.0 / 8, rel=1e-9)
    pressure = found["reduced_pressure"]
    assert abs(pressure["mean"] - 1.2) < FOUR_SIGMA * pressure["error"]
    with carom.open(whole) as frames:
        volumes = [np.prod(frame.box) for frame in frames]
    assert len(set(volumes)) == 4
    result = carom.resume(whole)
    assert result.volume.mean == volume["mean"]
    assert "a barostat changes the volume" in result.summary["without_rdf"]
    shown = CliRunner().invoke(app, ["resume", str(whole)]).output
    assert "of the barostat" in shown
    assert "volume moves accepted, step 0.2" in shown


@pytest.mark.filterwarnings("ignore::carom.CaromWarning")
def test_volumes_that_are_drawn_are_told_and_refuse_nothing(tmp_path):
    plan = SceneFile.from_toml(TOML.replace(" step = 0.2,", ""))
    found = carom.run(plan, tmp_path / "drawn").summary["barostat"]
    assert found["step"] is None
    assert found["accepted"] == found["tried"] > 80
    assert SceneFile.from_toml(plan.to_toml()) == plan
    assert "volume moves" not in CliRunner().invoke(app, ["info", str(tmp_path / "drawn")]).output


def test_the_places_where_a_run_began_are_scaled_to_the_box_that_it_has():
    spec = SceneSpec(n=8, dimension=2, packing_fraction=0.2)
    plan = SceneFile(scene=spec, run=RunSpec(barostat=carom.Barostat(1.0, interval=0.2), time=1.0))
    start = plan.build_scene()
    scale = np.array([1.5, 0.75])
    scene = SimpleNamespace(positions=start.positions, box=tuple(scale * start.box))
    run = SimpleNamespace(plan=plan, sim=SimpleNamespace(scene=scene))
    np.testing.assert_allclose(Run.first_places.func(run), scale * start.positions, rtol=1e-14)
