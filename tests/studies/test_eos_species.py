"""Studies of mixtures: a row says where species of different masses have not shared out their energy."""

import numpy as np
import pytest

from carom.studies import scenes
from carom.studies.eos.measure import measure
from carom.studies.eos.spec import StudySpec
from carom.studies.eos.table import row as row_of
from carom.studies.study import perform

SPECIES = [
    {"diameter": 1.0, "fraction": 0.5, "mass": 1000.0},
    {"diameter": 0.5, "fraction": 0.5, "mass": 1.0},
]


@pytest.fixture(scope="module")
def tasks():
    return StudySpec(
        packing_fraction=(0.1,), n=(64,), replicas=2, collisions_per_particle=20, equilibration=1, blocks=16,
        frames=0, scene={"species": SPECIES},
    ).tasks()  # fmt: skip


def heavy_at_rest(start):
    def begin(*given):
        scene = start(*given)
        velocities = np.random.default_rng(1).normal(size=(scene.n, scene.dimension))
        velocities[scene.masses > 1.0] = 0.0
        return scene.replace(velocities=velocities)

    return begin


def test_a_row_says_that_the_heavy_species_is_still_cold(tasks, monkeypatch):
    monkeypatch.setattr(scenes, "start", heavy_at_rest(scenes.start))
    row = row_of([perform(measure, task) for task in tasks])
    assert "species differ in temperature" in row.remarks
    assert not row.equilibrated


def test_species_that_begin_at_one_temperature_are_not_remarked_upon(tasks):
    records = [perform(measure, task) for task in tasks]
    assert not any(record["result"]["species_differ"] for record in records)
    row = row_of(records)
    assert "species differ in temperature" not in row.remarks


def test_one_doubt_among_several_replicas_is_chance(tasks):
    records = [perform(measure, task) for task in tasks]
    records[0]["result"]["species_differ"] = True
    row = row_of(records)
    assert "species differ in temperature" not in row.remarks
