"""The study of sheared fluids: its table, what stops and goes on, what is refused, and published flows."""

import math

import numpy as np
import pytest

import carom
from carom.errors import InputError
from carom.studies import ShearFlow, ShearSpec

FIVE = 5.0
"""Standard errors within which two numbers agree."""

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


def test_a_study_of_a_flow_goes_on_where_it_was_stopped(grains):
    first, out = grains
    next((out / "tasks").iterdir()).unlink()
    half = carom.load(out)
    assert isinstance(half, ShearFlow)
    assert not half.complete
    assert half.run(out=out, executor="serial").table.csv() == first.table.csv()
    more = carom.shear([0.5, 1.0, 2.0], restitution=0.9, strains=100, out=out, **SMALL)
    assert more.table.csv().startswith(first.table.csv())
    for name in ("f.csv", "f.png", "f.html", "f.json"):
        more.save(out / name)
        assert (out / name).stat().st_size > 500
    assert carom.load(out / "f.json").to_dict() == more.to_dict()
    assert "viscosity" in str(more)


def test_one_rate_at_several_packing_fractions_is_drawn_against_the_packing_fraction(grains):
    study, _ = grains
    assert study.plot().axes[0].get_xlabel() == "shear rate"
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
        ({"thermostat": "rescale", "scene": {"drive": carom.models.Andersen(1.0, 1.0)}}, "contradict"),
        ({"strains": 10, "relative_error": 0.1}, "relative_error and strains contradict"),
        ({"dimension": 1}, "dimension must be"),
        ({"rate": 0.0}, "rate must be"),
        ({"strains": -1}, "strains must be"),
        ({"scene": {"walls": True}}, "walls does not go with a shear flow"),
        ({"scene": {"interaction": carom.models.SquareWell(1.5)}}, "interaction is for carom.Simulation"),
        ({"scene": {"motion": carom.models.Gravity((0.0, 0.0, -1.0))}}, "motion is the flow"),
        ({"rates": 1.0}, "no argument 'rates'; did you mean rate"),
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
