"""Only what a scene requires: which models, arrays and neighbors a scene gets, and what is not there."""

import re

import numpy as np
import pytest
from helpers.commands import carom as command

import carom
from carom.errors import InputError
from carom.models import SquareWell
from carom.observables import HelfandCurrents
from carom.simulation.explanation import explain

PLAIN = carom.Scene.crystal(cells=5, packing_fraction=0.45)


def names(explanation):
    return {array.name for array in explanation.arrays}


FEATURES = {
    "diameters of their own": (lambda: PLAIN.replace(diameter=np.linspace(0.8, 1.0, PLAIN.n)), {}),
    "masses of their own": (lambda: PLAIN.replace(mass=np.linspace(1.0, 2.0, PLAIN.n)), {}),
    "growth": (lambda: PLAIN, {"growth": 0.01}),
    "species": (lambda: PLAIN.replace(species=np.arange(PLAIN.n) % 2), {}),
    "a contact matrix": (
        lambda: PLAIN.replace(species=np.arange(PLAIN.n) % 2, contact=[[1.0, 0.9], [0.9, 1.0]]),
        {},
    ),
    "restitution": (lambda: PLAIN.replace(impact=0.9), {}),
    "steps of pairs": (lambda: PLAIN.replace(interaction=SquareWell(1.2)), {}),
    "currents": (lambda: carom.Simulation(PLAIN, observers=[HelfandCurrents()]), {}),
    "walls and obstacles": (lambda: carom.Scene([[1.0] * 3, [3.0] * 3], 4.0, walls=True), {}),
}


def test_the_plain_scene_has_no_array_for_what_it_does_not_have():
    found = explain(PLAIN, tuning=carom.Tuning(images=False))
    assert found.models == {
        "pair": "EqualCores",
        "motion": "Inertial",
        "boundary": "NearestImage",
        "timing": "FromRows",
        "neighbors": "NeighborLists",
    }
    others = {"image counts", "an event log", "swaps", "a barostat"}
    assert {*FEATURES, *others} == {*found.absent}
    # Nothing belongs to the pair, to walls, to restitution, to species; nothing counts images.
    assert not any(name.startswith(("model", "observers")) for name in names(found))
    assert not any("steps" in name for name in names(found))
    assert "state.images" not in names(found)
    assert {name for name in names(found) if name.startswith("state")} == {
        "state.rows", "state.partner", "state.crossing_time", "state.clock",
    }  # fmt: skip


def test_a_component_of_the_plain_scene_is_one_cache_line_and_what_schedules_it():
    arrays = {
        array.name: array.nbytes / PLAIN.n
        for array in explain(PLAIN, tuning=carom.Tuning(images=False)).arrays
    }
    per_component = (PLAIN.n + 1) / PLAIN.n  # the padding row has a row, too
    assert arrays["state.rows"] == 64 * per_component
    assert arrays["state.partner"] == 4
    assert arrays["state.crossing_time"] == 8


def test_images_are_counted_only_where_they_are_asked_for():
    without, counted = explain(PLAIN, tuning=carom.Tuning(images=False)), explain(PLAIN)
    assert names(counted) - names(without) == {"state.images"}
    assert counted.bytes_per_particle - without.bytes_per_particle == 3 * 4
    assert "image counts" not in counted.absent


@pytest.mark.parametrize("feature", FEATURES)
def test_a_feature_that_a_scene_has_is_there(unscheduled, feature):
    scene, settings = FEATURES[feature]
    assert feature not in explain(scene(), **settings).absent


def test_nothing_is_compiled_and_the_simulation_agrees(unscheduled):
    scene = PLAIN
    before, sim = explain(scene), carom.Simulation(scene, seed=1)
    now = sim.explain()
    assert (now.models, now.absent, now.neighbors) == (before.models, before.absent, before.neighbors)
    assert names(now) == names(before)


def test_single_precision_is_explained_as_it_runs(unscheduled):
    found, double = explain(PLAIN, tuning=carom.Tuning(precision="single")), explain(PLAIN)
    assert (
        found.arrays
        == carom.Simulation(PLAIN, seed=1, tuning=carom.Tuning(precision="single")).explain().arrays
    )
    rows, twice = (
        next(array.nbytes for array in each.arrays if array.name == "state.rows") for each in (found, double)
    )
    assert 2 * rows == twice


def test_an_event_log_is_there_where_it_is_asked_for(unscheduled, tmp_path):
    assert "an event log" not in explain(PLAIN, event_log=True).absent
    with carom.Simulation(PLAIN, event_log=tmp_path / "events.h5") as sim:
        assert sim.explain() == explain(PLAIN, event_log=True)


@pytest.mark.parametrize("kind", ["lists", "sectors"])
def test_the_scheme_that_is_explained_is_the_one_that_runs(kind):
    found = explain(PLAIN, tuning=carom.Tuning(neighbors=kind))
    assert found.models["neighbors"].lower().removeprefix("neighbor") == kind
    assert "asked for" in found.neighbors


@pytest.mark.parametrize(
    ("scene", "says"),
    [
        (carom.Scene.crystal(cells=5, packing_fraction=0.45),
         "lists.*faster above a packing fraction of 0.36"),
        (carom.Scene.crystal(cells=5, packing_fraction=0.1),
         "sectors: faster below a packing fraction of 0.36"),
        (carom.Scene.crystal(cells=1, packing_fraction=0.5), "box is too small for lists.*told apart"),
    ],
)  # fmt: skip
def test_the_choice_of_neighbors_has_a_reason(scene, says):
    assert re.search(says, explain(scene).neighbors)


def test_lists_that_do_not_fit_are_refused_as_by_the_simulation():
    scene = carom.Scene.crystal(cells=1, packing_fraction=0.5)
    with pytest.raises(InputError, match="use neighbors='sectors'"):
        explain(scene, tuning=carom.Tuning(neighbors="lists"))


def test_the_command_line_explains_and_runs_nothing(tmp_path):
    done = command("run", "--lattice", "fcc", "--cells", "4", "--eta", "0.4", "--dry-run", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "EqualCores" in done.stdout
    assert "bytes a particle" in done.stdout
    assert "masses of their own" in done.stdout
    assert "an event log" in done.stdout
    logged = command("run", "--lattice", "fcc", "--cells", "4", "--event-log", "--dry-run", cwd=tmp_path)
    assert "an event log" not in logged.stdout
    assert not list(tmp_path.iterdir())
