"""The potential energy with its error, of two rods, of fluids and in a field; and how a fluid comes to kT."""

import itertools
import json
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from helpers import full_run

import carom
from carom.block import Block, EnergySample, MomentumFlux, Sizes, VolumeSums
from carom.errors import InputError
from carom.models import Bonds, SquareWell, Steps, StepTable, chains
from carom.models.motions.gravity import Gravity
from carom.observables import Estimate
from carom.scene.description import kind
from carom.scene_file.scene_file import SceneFile
from carom.simulation.measuring import readings, stretches
from carom.simulation.measuring.until_precise import merged
from carom.studies.runs.driver import Measured
from carom.studies.runs.report import _other_temperature

EDGE = 5.0

FIVE = 5.0
"""Standard errors: one in two million."""

INF = math.inf

LOSSY = StepTable(Steps([1.0, 1.3], [INF, -0.2], leaving=[INF, -0.6]))

FEW = pytest.mark.filterwarnings("ignore::carom.CaromWarning")
"""Independent samples in runs as short as these."""


def two_rods(depth, interaction):
    """Return two rods on a ring, not in a well; the part of time in the well; the mean kT; and a period."""
    speed = 1.5
    scene = carom.Scene(
        [[0.0], [2.5]], EDGE, velocities=[[0.5 * speed], [-0.5 * speed]], interaction=interaction
    )
    # The distance goes to and fro between 1 and the edge less 1; within 1.75, either way round, it is faster.
    inside = math.sqrt(speed**2 + 4.0 * depth)
    within, beyond = 1.5 / inside, (EDGE - 3.5) / speed
    share = within / (within + beyond)
    kT = 0.5 * (share * inside**2 + (1.0 - share) * speed**2)
    return carom.Simulation(scene, seed=0), share, kT, within + beyond


@pytest.mark.parametrize(
    ("depth", "interaction"),
    [
        (1.0, SquareWell(1.75, 1.0)),
        (-0.4, SquareWell(1.75, -0.4)),
        (0.3, StepTable(Steps([1.0, 1.75], [INF, -0.3]))),
    ],
    ids=["well", "shoulder", "steps"],
)
@FEW
def test_two_rods_spend_the_exact_time_in_their_well(plain, depth, interaction):
    sim, share, kT, period = two_rods(depth, interaction)
    found = sim.measure(carom.Energy(), time=32 * period, blocks=32)
    assert found.U.mean == pytest.approx(-0.5 * depth * share, rel=1e-9)
    assert found.total.mean == pytest.approx(found.U.mean + found.kinetic.mean, rel=1e-12)
    assert found.kT.mean == pytest.approx(kT, rel=1e-9)
    assert found.U.error < 1e-9
    assert found.primary == found.U


def test_pairs_of_the_start_are_looked_for_once(plain, monkeypatch):
    asked = []
    real = readings.first_steps
    monkeypatch.setattr(readings, "first_steps", lambda scene: asked.append(scene) or real(scene))
    sim = carom.Simulation(carom.Scene.crystal(32, 0.3, interaction=SquareWell(1.5, 0.1)), seed=1)
    for _ in range(3):
        sim.run(collisions=2)
        assert sim.statistics.energy_drift < 1e-14
    assert len(asked) == 1


@pytest.mark.parametrize("g", [0.5, -0.5])
def test_a_ball_on_a_floor_has_two_thirds_of_its_highest_potential_energy(plain, g):
    position = 2.0 if g < 0.0 else 6.0
    scene = carom.Scene(
        [[4.0, position]], 8.0, mass=3.0, velocities=[[0.0, 0.0]], walls="y", motion=Gravity((0.0, g))
    )
    sim = carom.Simulation(scene, seed=0)
    assert sim.potential_energy == pytest.approx(3.0 * 0.5 * 2.0, rel=1e-12)
    found = sim.measure(carom.Energy(), time=300.0, blocks=200)
    # Of 1.5 above the floor, on which the center is half a diameter high; the mean of a parabola.
    exact = 3.0 * 0.5 * (0.5 + 1.5 * 2.0 / 3.0)
    # Some hundred looks at incommensurate times miss a period by some hundredths.
    assert found.U.mean == pytest.approx(exact, rel=2e-2)
    assert found.kT.mean == pytest.approx(2.0 * (3.0 * 0.5 * 2.0 - exact) / 2.0, rel=4e-2)


@pytest.fixture(scope="module")
def fluid():
    """Return a fluid of wells that was brought to kT = 3 at a density of 0.3."""
    scene = carom.Scene.crystal(cells=4, density=0.3).replace(interaction=SquareWell(1.5, 1.0))
    sim = carom.Simulation(scene, seed=3)
    sim.equilibrate(kT=3.0, collisions_per_particle=600)
    return sim


# Of 32 runs one may be flagged by chance: one of some hundreds is.
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The potential energy (drifts|relaxes)")
def test_the_error_of_the_energy_is_the_scatter_of_runs(fluid):
    request = carom.Energy()
    runs = [fluid.measure(request, collisions_per_particle=1500).U for _ in range(32)]
    means = np.array([run.mean for run in runs])
    rms = math.sqrt(float(np.mean([((run.mean - means.mean()) / run.error) ** 2 for run in runs])))
    # A standard deviation of 32 normal numbers is known to 12.5 %; one of them is the mean.
    assert abs(rms - 1.0) < 4.0 * 0.125


def test_the_energy_can_be_measured_to_an_error(fluid):
    found = fluid.measure(carom.Energy(), relative_error=3e-3, blocks=16)
    assert found.U.error <= 3e-3 * abs(found.U.mean)
    longer = fluid.measure(carom.Energy(), collisions_per_particle=1000, blocks=64)
    error = math.hypot(found.U.error, longer.U.error)
    assert abs(found.U.mean - longer.U.mean) < FIVE * error


def test_after_the_equilibration_kT_is_the_one_asked_for_within_its_error():
    pulls = []
    for seed in range(6):
        scene = carom.Scene.crystal(cells=3, density=0.3).replace(interaction=SquareWell(1.5, 1.0))
        sim = carom.Simulation(scene, kT=3.0, seed=seed)
        sim.equilibrate(kT=3.0, collisions_per_particle=1600)
        kT = sim.measure(carom.Energy(), collisions_per_particle=600).kT
        pulls.append((kT.mean - 3.0) / kT.error)  # what it misses is the error of a stretch as long
    # Six sums of two errors: their root mean square is sqrt(2), known to 29 %.
    assert math.sqrt(float(np.mean(np.square(pulls)))) < math.sqrt(2.0) * (1.0 + 3.0 * 0.29)


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize(
    ("change", "settings", "reason"),
    [
        ({"impact": 0.9}, {}, "contacts or rules"),
        ({}, {"growth": 0.01}, "leave out growth"),
        ({"interaction": LOSSY}, {}, "contacts or rules"),
    ],
    ids=["restitution", "growth", "hysteresis"],
)
def test_a_run_without_a_lasting_temperature_is_not_brought_to_one(change, settings, reason):
    scene = carom.Scene.crystal(cells=3, density=0.3).replace(**change)
    with pytest.raises(InputError, match=reason):
        carom.Simulation(scene, **settings).equilibrate(kT=1.0, collisions_per_particle=10)


def test_where_nothing_has_a_potential_energy_it_is_zero_and_all_is_kinetic():
    sim = carom.Simulation(carom.Scene.crystal(cells=2, packing_fraction=0.2), kT=2.0, seed=0)
    found = sim.measure(carom.Energy(), collisions_per_particle=10)
    assert Estimate.exact(0.0) == found.U
    assert found.total.mean == found.kinetic.mean == pytest.approx(0.5 * 2.0 * 3 * 31 / 32, rel=1e-12)
    assert found.primary == found.kinetic


def test_blocks_without_energies_are_refused():
    well = carom.Simulation(
        carom.Scene.crystal(cells=3, density=0.3).replace(interaction=SquareWell()), seed=0
    )
    with pytest.raises(InputError, match="Blocks hold no energies"):
        stretches.estimate(well, carom.Energy(), [well.run(collisions=10)])


def block_of(value, duration):
    """Return a block in which no field is left out, and each number is another one."""
    numbers = (value + 2.0**k for k in itertools.count())

    def some(count):
        return tuple(itertools.islice(numbers, count))

    flux = MomentumFlux(*(np.reshape(some(4), (2, 2)) for _ in range(2)))
    return Block(
        duration, int(value), next(numbers), some(2), some(3), next(numbers), Sizes(*some(2), True), some(2),
        some(4), EnergySample(*some(2)), flux, VolumeSums(*some(3)),
    )  # fmt: skip


def test_a_merged_block_is_the_sum_of_its_parts_field_by_field():
    one, other = block_of(3.0, 1.0), block_of(40.0, 3.0)
    assert None not in one
    both = merged(one, other)
    for name, a, b in zip(Block._fields, one, other, strict=True):
        found, means = getattr(both, name), name in ("sizes", "energy")
        x, y = (0.25, 0.75) if means else (1.0, 1.0)
        assert type(found) is type(a), name
        assert np.array_equal(np.array(found), x * np.array(a) + y * np.array(b)), name
        if Block._field_defaults.get(name, ()) is None:
            assert getattr(merged(one, other._replace(**{name: None})), name) is None
    assert merged(one, other._replace(sizes=Sizes(1.0, 1.0, False))).sizes.equal is False


@pytest.mark.parametrize("heat", [None, 3.0])
def test_a_segment_has_the_mean_energy_of_both_of_its_ends(heat):
    # Collisions, virial, integral of kT; potential energy and kT now: the energy rises from -4 to 0.
    first = Block(0.0, 0, 0.0, kT_time=heat and 1.0, energy=(-10.0, 1.0))
    last = Block(2.0, 5, 2.0, kT_time=heat and 1.0 + heat, energy=(-8.0, 4 / 3))
    sim = SimpleNamespace(degrees_of_freedom=12, scene=carom.Scene.random(5, 0.05, seed=1))
    stretch = Measured({}, sim, duration=2.0, marks=[first, last])
    (block,) = stretch.blocks()
    assert block.energy.kT == pytest.approx(1.5 if heat else 7 / 6)
    assert block.energy.potential == pytest.approx(-2.0 - 9.0 if heat else -9.0)
    assert stretch.energy_drift == pytest.approx(4.0 / 6.0)


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize(
    ("kT", "error", "impact", "equilibration", "told"),
    [
        (1.98, 0.0, None, 50.0, True),
        (1.995, 0.0, None, 50.0, False),
        (2.005, 0.0, None, 50.0, False),
        (2.02, 0.0, None, 50.0, True),
        (1.0, 0.0, 0.9, 50.0, False),  # contacts decide it
        (2.04, 0.02, None, 50.0, False),  # two error bars
        (2.12, 0.02, None, 50.0, True),
        (2.12, 0.02, None, 2.0, False),  # velocities were scaled by a mean that was hardly known
        (2.12, math.inf, None, 50.0, False),
    ],
)
def test_a_temperature_that_is_missed_by_more_than_its_error_bar_is_told(
    kT, error, impact, equilibration, told
):
    plan = SimpleNamespace(run=SimpleNamespace(kT=2.0, event_log=False))
    sim = carom.Simulation(carom.Scene.crystal(32, 0.3, impact=impact), seed=0)
    run = SimpleNamespace(
        plan=plan, sim=sim, rounds=[(0, 0.0)], measured=[Block(10.0, 1, 1.0)], equilibrated=(9, equilibration)
    )
    said = _other_temperature(run, Estimate(kT, error, 100.0, 1.0, 100))
    assert (said is not None) == told
    if told:
        assert f"its mean is {kT}" in said[0]
        assert said[1]  # it speaks against equilibrium


WELLS = """
[scene]
lattice = "fcc"
cells = 3
density = 0.3

[scene.interaction]
type = "square-well"

[run]
kT = 3.0
seed = 2
equilibration = {equilibration}
collisions_per_particle = {measured}
frames = 2
checkpoint_every = 0.02
pictures = false
event_log = {log}
"""


def wells(equilibration=2000, measured=1000, log=False):
    return SceneFile.from_toml(
        WELLS.format(equilibration=equilibration, measured=measured, log="true" if log else "false")
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the summary of an uninterrupted run of wells."""
    return carom.run(wells(), tmp_path_factory.mktemp("wells") / "run").summary


def test_a_run_of_wells_is_at_its_temperature_and_tells_its_energy(whole):
    kT, u = whole["temperature"], whole["U"]
    assert abs(kT["mean"] - 3.0) < FIVE * math.sqrt(2.0) * kT["error"]
    assert kT["mean"] == pytest.approx(whole["kT"], rel=1e-12)
    # The published fit, as above; 108 spheres.
    assert u["mean"] == pytest.approx(-2.07423 + 0.09186 * (kT["mean"] - 3.0), rel=0.035)
    assert 0.0 < u["error"] < 0.02
    assert whole["system"] == "spheres with square wells of range 1.5 and depth 1"
    assert whole["energy_drift"] < 1e-12
    assert "was asked for" not in whole["note"]


@pytest.mark.parametrize(
    ("stage", "after"), [("Equilibrating", 0.2), ("Equilibrating", 0.5), ("Measuring", 0.5)]
)
def test_a_run_of_wells_goes_on_from_every_round(whole, tmp_path, stage, after):
    out = full_run.stopped(wells(), tmp_path / "run", stage, after)
    again = carom.resume(out).summary
    for name in ("U", "temperature", "Z", "collisions", "energy_drift"):
        assert again[name] == whole[name], name


@pytest.mark.slow
def test_a_run_with_an_event_log_tells_that_it_came_to_another_temperature(tmp_path):
    summary = carom.run(wells(500, 1000, log=True), tmp_path / "run").summary
    assert abs(summary["kT"] - 3.0) > 0.1
    assert summary["note"].startswith(f"kT = 3 was asked for, and its mean is {summary['kT']:.4g}")
    assert "event log" in summary["note"]


@FEW
def test_a_column_in_a_field_tells_its_energy_and_that_it_came_to_another_temperature(plain, tmp_path):
    gravity, walls = 'motion = { type = "gravity", g = [0.0, -3.0] }', 'walls = "y"'
    plan = SceneFile.from_toml(
        f"scene = {{ dimension = 2, n = 8, packing_fraction = 0.1, {walls}, {gravity} }}\n"
        "run = { kT = 1.0, equilibration = 15, time = 20.0, frames = 2, pictures = false }"
    )
    summary = carom.run(plan, tmp_path / "run").summary
    u, kT = summary["U"], summary["temperature"]
    assert summary["kT"] == kT["mean"]
    assert "kT = 1 was asked for" in summary["note"]
    # Total energy is conserved: both ends of the run belong to the means.
    scene = plan.build_scene()
    before = scene.motion.potential_energy(scene.masses, scene.positions, scene.box) + 0.5 * (2 * 8 - 1)
    after = 8.0 * u["mean"] + 0.5 * (2 * 8 - 1) * kT["mean"]
    assert after == pytest.approx(before, rel=1e-9)


@pytest.mark.parametrize(
    ("interaction", "words"),
    [
        (None, "hard disks"),
        (SquareWell(1.5, 1.0), "disks with square wells of range 1.5 and depth 1"),
        (SquareWell(1.2, -2.0), "disks with square shoulders of range 1.2 and height 2"),
        (StepTable(Steps([1.0, 1.2, 1.8], [INF, 0.5, -1.0])), "disks with wells and shoulders"),
        (StepTable(Steps([1.0], [INF])), "disks with hard cores"),
        (Bonds(chains(1, 3), inner=1.0, outer=1.2), "disks with bonds"),
        (Bonds(chains(1, 3), inner=1.0, outer=1.2, others=SquareWell()), "disks with wells and bonds"),
        (LOSSY, "disks with wells that lose energy"),
        (object(), "disks with object"),
    ],
)
def test_what_is_simulated_is_called_by_its_interaction(interaction, words):
    assert kind(2, 5, interaction) == words


def test_the_screen_shows_wells_with_their_energy_and_temperature(whole, tmp_path, capsys):
    from carom.cli.results import show
    from carom.studies.runs.result import RunResult

    show(RunResult(tmp_path, whole, new=True), tmp_path, as_json=False)
    shown = " ".join(capsys.readouterr().out.split())
    assert "108 spheres with square wells of range 1.5 and depth 1 at packing fraction" in shown
    energy, kT = (f"{whole[name]['mean']:.3f}"[:-1] for name in ("U", "temperature"))
    assert re.search(rf"U / N {energy}\d* ± 0\.0\d+ kT {kT}", shown)
    assert "hard" not in shown
    json.dumps(whole, allow_nan=False)
