"""The study of sheared fluids: its table, what stops and goes on, what is refused, and published flows."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.drawn import strange_bars

import carom
from carom.errors import InputError
from carom.models import Andersen, Shear
from carom.observables.statistics import blocking, linear_ratio, ratio
from carom.simulation.measuring import stretches
from carom.studies import ShearFlow, ShearSpec
from carom.studies.scenes import simulation_of
from carom.studies.shear.measure import Flow, means
from carom.studies.shear.study import _row

FIVE = 5.0
"""Standard errors within which two numbers agree."""

WELL = carom.models.SquareWell(1.5)

BRIDGES = carom.models.StepTable(carom.models.Steps([1.0, 1.3], [math.inf, -0.2], leaving=[math.inf, -0.6]))

WELLS = """
[scene]
n = 12
dimension = 2
packing_fraction = 0.3
interaction = { type = "square-well", range = 1.5, depth = 1.0 }
motion = { type = "shear", rate = 1.0 }

[shear]
kT = 0.8
strains = 1
replicas = 1
equilibration = 2
blocks = 16
"""
"""A few disks with wells, deep enough that they pull more than they push at times."""

SMALL = {"n": 64, "packing_fraction": 0.2, "replicas": 1, "equilibration": 100, "executor": "serial"}


@pytest.fixture(scope="module")
def grains(tmp_path_factory):
    """Return a study of inelastic spheres at two rates, and its folder."""
    out = tmp_path_factory.mktemp("flow") / "out"
    return carom.shear([0.5, 1.0], restitution=0.9, strains=100, out=out, **SMALL), out


def test_inelastic_spheres_know_no_time_but_that_of_the_flow(grains):
    slow, fast = grains[0].table
    for name, power in (("kT", 2), ("viscosity", 1), ("collision_rate", 1), ("pressure", 2), ("N1", 0)):
        one, two = (getattr(row, name) / row.rate**power for row in (slow, fast))
        errors = [getattr(row, f"{name}_error") / row.rate**power for row in (slow, fast)]
        assert one == pytest.approx(two, abs=FIVE * math.hypot(*errors)), name
        assert 0.0 < max(errors) < 0.2 * (abs(one) + 0.1), name
    assert math.isnan(fast.enskog)
    assert fast.strain == pytest.approx(100.0)


def test_replicas_have_the_strain_of_all_and_the_mean_of_one(grains):
    for point in grains[0].by_point():
        one, three = (_row(point * times) for times in (1, 3))
        assert three.strain == pytest.approx(3.0 * one.strain, rel=1e-12)
        for name in ("kT", "viscosity", "collision_rate", "pressure", "N1", "N2"):
            assert getattr(three, name) == pytest.approx(getattr(one, name), rel=1e-9), name
        # One that had not settled is enough, whichever it is.
        (record,) = point
        kT = [value * (0.5 + k / 64) for k, value in enumerate(record["result"]["series"]["kT"])]
        result = {**record["result"], "series": {**record["result"]["series"], "kT": kT}}
        late = {**record, "result": result}
        said = [_row(records).remark for records in ([late, record], [record, late], point * 2)]
        assert ["had not settled" in remark for remark in said] == [True, True, False]


def test_one_rate_at_several_packing_fractions_is_drawn_against_the_packing_fraction(grains):
    study, _ = grains
    (axes,) = study.plot().axes
    assert axes.get_xlabel() == "shear rate"
    assert strange_bars(axes, study.table[:]) == (2, [])
    one = carom.shear(1.0, restitution=0.9, strains=10, **{**SMALL, "packing_fraction": [0.1, 0.2]})
    axes = one.plot().axes[0]
    assert axes.get_xlabel() == "packing fraction"
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["rate 1"]


def test_elastic_spheres_are_kept_at_their_temperature_and_are_near_enskog():
    (row,) = carom.shear(0.4, kT=2.0, relative_error=0.05, **{**SMALL, "n": 108}).table
    # By how much the flow heats between two scalings is known to a tenth or so of a tenth.
    assert row.kT == pytest.approx(2.0, rel=0.02)
    assert row.viscosity_error <= 0.06 * row.viscosity
    # 108 spheres at this density are some 5 % from Enskog's infinitely many.
    assert row.viscosity == pytest.approx(row.enskog, abs=FIVE * row.viscosity_error + 0.05 * row.enskog)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"thermostat": "none"}, "heats elastic particles without end"),
        ({"thermostat": "rescale", "scene": {"drive": Andersen(1.0, 1.0)}}, "contradict"),
        ({"strains": 10, "relative_error": 0.1}, "relative_error and strains contradict"),
        ({"dimension": 1}, "dimension must be"),
        ({"rate": 0.0}, "rate must be"),
        ({"scene": {"walls": True}}, "walls does not go with a shear flow"),
        ({"scene": {"interaction": WELL, "impact": 0.9}}, "does not go with contacts that lose energy"),
        ({"scene": {"interaction": WELL}, "restitution": 0.9}, "does not go with contacts that lose energy"),
        ({"scene": {"interaction": WELL}, "thermostat": "none"}, "heats elastic particles without end"),
        ({"scene": {"interaction": BRIDGES}}, "hysteretic steps"),
        ({"scene": {"interaction": carom.models.Bonds([(0, 1)], outer=1.5)}}, "has bonds"),
        ({"scene": {"motion": carom.models.Gravity((0.0, 0.0, -1.0))}}, "motion is the flow"),
    ],
)
def test_what_cannot_flow_is_refused_at_once_in_one_sentence(given, says):
    with pytest.raises(InputError, match=says) as caught:
        carom.shear(**{"packing_fraction": 0.2, **given})
    assert "\n" not in str(caught.value)


def test_a_scene_file_of_a_flow_says_its_rate_and_its_contacts():
    text = (
        "[scene]\nn = 40\npacking_fraction = 0.2\ndimension = 2\nimpact = 0.9\n"
        "motion = { type = 'shear', rate = 0.5 }\n[shear]\nstrains = 30\n"
    )
    spec = ShearSpec.from_toml(text)
    assert (spec.n, spec.rate, spec.dimension, spec.strains) == ((40,), (0.5,), 2, 30.0)
    task = spec.tasks()[0]
    assert (task["rescale"], task["scene"]["impact"], task["scene"]["motion"]["rate"]) == (False, 0.9, 0.5)
    assert ShearSpec.from_toml(spec.to_toml()) == spec
    elastic = spec.replaced(restitution=1.0, rate=[0.2])
    assert (elastic.tasks()[0]["rescale"], elastic.rate) == (True, (0.2,))
    assert "impact" not in elastic.tasks()[0]["scene"]
    assert ShearSpec.from_toml(elastic.to_toml()) == elastic
    assert spec.replaced(relative_error=0.1).strains is None


MIXED = [{"fraction": 0.5}, {"fraction": 0.5, "diameter": 0.5}]


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize(
    ("given", "simple"),
    [({}, True), ({"species": MIXED}, False), ({"interaction": WELL}, False), ({"impact": 0.9}, False)],
)
def test_flows_of_equal_elastic_hard_particles_alone_are_compared_with_enskog(given, simple):
    (task,) = ShearSpec(rate=1.0, n=60, packing_fraction=0.2, replicas=1, scene=given).tasks()
    assert Flow.begin(task).result()["simple"] == simple


@pytest.mark.usefixtures("plain")
def test_wells_of_a_scene_file_are_kept_at_their_temperature():
    study = ShearFlow(ShearSpec.from_toml(WELLS)).run(executor="serial")
    (row,), series = study.table, study.records[0]["result"]["series"]
    assert row.kT == pytest.approx(0.8, abs=FIVE * row.kT_error + 0.01 * 0.8)
    assert row.kT_error < 0.04
    assert math.isnan(row.enskog)
    assert min(series["pressure"]) < 0.0
    assert pytest.approx(math.fsum(series["first"]) / math.fsum(series["pressure"]), rel=1e-12) == row.N1
    assert row.N1_error > 0.0


@pytest.mark.usefixtures("plain")
def test_the_stress_of_wells_is_the_power_of_the_flow():
    sim = simulation_of(ShearSpec.from_toml(WELLS).tasks()[0])
    kinetic, potential = 0.5 * sim.degrees_of_freedom * sim.kT, sim.potential_energy
    parts = list(stretches.blocks(sim, 0.3, 4))
    gained = 0.5 * sim.degrees_of_freedom * sim.kT - kinetic + sim.potential_energy - potential
    assert sim.potential_energy != potential
    # The stress has a factor n / (n - 1) in the part that particles carry: the center of mass rests here.
    carried = math.fsum(float(part.momentum_flux.carried[1, 0]) for part in parts)
    power = means(sim.scene, parts, 1.2)["stress"] * sim.scene.volume + carried / (1.2 * (sim.n - 1.0))
    assert abs(gained) > 0.1 * kinetic
    assert gained == pytest.approx(1.2 * power, abs=1e-13 * kinetic * sim.collisions)


@pytest.mark.parametrize(
    ("d", "drive", "factor"),
    [(2, None, 1.25), (3, None, 1.25), (4, None, 1.25), (3, Andersen(1.0, 1.0), 1.0)],
)
def test_the_means_of_a_block_are_those_of_its_pressure_tensor(d, drive, factor):
    rng = np.random.default_rng(d)
    carried, handed_over = rng.normal(size=(2, 3, d, d))  # of three parts of a block
    parts = [
        SimpleNamespace(
            momentum_flux=SimpleNamespace(carried=carried[k], handed_over=handed_over[k]),
            collisions=10 * k, kT_time=0.5 * k,
        )
        for k in range(3)
    ]  # fmt: skip
    scene = carom.Scene.random(5, 0.1, d, motion=Shear(1.0), drive=drive)
    found = means(scene, parts, 2.0)
    # The center of mass rests, and takes a fifth of the thermal motion, unless a drive takes up momentum.
    tensor = (factor * carried + handed_over).sum(axis=0) / (scene.volume * 2.0)
    expected = {
        "collision_rate": 2.0 * 30 / (5 * 2.0), "kT": 0.75, "stress": -tensor[1, 0],
        "pressure": np.trace(tensor) / d, "first": tensor[0, 0] - tensor[1, 1],
    }  # fmt: skip
    if d > 2:
        expected["second"] = tensor[1, 1] - tensor[2, 2]
    assert found == pytest.approx(expected, rel=1e-12)


def test_normal_stresses_are_a_ratio_of_means_with_its_error():
    rng = np.random.default_rng(1)
    b = 1.0 + 0.1 * rng.normal(size=256)
    a = 0.3 * b + 0.1 * rng.normal(size=256)
    assert linear_ratio(a, b).mean == pytest.approx(ratio(a, b).mean, rel=1e-12)
    assert linear_ratio(a, b).error == pytest.approx(ratio(a, b).error, rel=1e-9)
    b -= 0.95  # blocks of either sign, as in wells
    quotient = a.mean() / b.mean()
    assert b.min() < 0.0 < b.max()
    assert linear_ratio(a, b).mean == pytest.approx(quotient, rel=1e-12)
    assert linear_ratio(a, b).error == pytest.approx(blocking((a - quotient * b) / b.mean()).error, rel=1e-9)


def test_each_rate_has_random_numbers_of_its_own_and_the_longest_runs_first():
    tasks = ShearSpec(rate=(0.1, 1.0), packing_fraction=(0.1, 0.2), n=(40,), replicas=2).tasks()
    assert len(tasks) == 8
    assert [task["rate"] for task in tasks] == [0.1] * 4 + [1.0] * 4
    assert len({str(task["scene"]) for task in tasks}) == 4


@pytest.mark.slow
def test_disks_that_lose_a_tenth_have_the_known_steady_state():
    # Of another program of a hundred lines, with 1000 disks. Four errors of both.
    (row,) = carom.shear(
        1.0, n=1000, packing_fraction=0.4, dimension=2, restitution=0.9, strains=240, executor="serial"
    ).table
    for name, told, err in (
        ("kT", 3.05, 0.02), ("viscosity", 1.146, 0.010), ("pressure", 4.34, 0.02), ("N1", 0.056, 0.004),
    ):  # fmt: skip
        found, mine = getattr(row, name), getattr(row, f"{name}_error")
        assert found == pytest.approx(told, abs=4.0 * np.hypot(err, mine)), name
    assert 1.0 / row.collision_rate == pytest.approx(0.1371, abs=4.0 * 0.0006)


@pytest.mark.slow
def test_elastic_spheres_have_the_known_viscosity_at_two_rates():
    # Of the same program, 500 spheres at density 0.4: over Enskog's 0.963(20) and 0.987(10).
    table = carom.shear([0.2, 0.4], packing_fraction=0.4 * math.pi / 6.0, relative_error=0.01).table
    for row, told, err in zip(table, (0.963, 0.987), (0.020, 0.010), strict=True):
        mine = row.viscosity_error / row.enskog
        assert row.viscosity / row.enskog == pytest.approx(told, abs=4.0 * math.hypot(err, mine))
        assert abs(row.N1) < 0.05


@pytest.mark.slow
def test_the_viscosity_of_square_wells_is_that_of_their_fluctuations_at_rest():
    # Helfand's slope at rest, with the same 108 particles, so that the box has the same effect on both. A
    # tenth of the collision rate of the cores is slow: the flow does not change the fluid yet.
    given = {"n": 108, "kT": 1.5, "replicas": 1, "scene": {"interaction": WELL}, "executor": "serial"}
    rest = carom.transport(0.25, relative_error=0.04, **given).shear_viscosity
    for row in carom.shear([0.2, 0.4], packing_fraction=0.25, relative_error=0.03, **given).table:
        assert row.kT == pytest.approx(1.5, rel=0.01)
        # In 1 % of kT this viscosity changes by less than 1 %.
        error = math.hypot(row.viscosity_error, rest.error)
        assert error < 0.06 * rest.mean
        assert row.viscosity == pytest.approx(rest.mean, abs=4.0 * error + 0.01 * rest.mean)
