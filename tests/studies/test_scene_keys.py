"""What a study does with each key of ``[scene]``: it is in what runs, or it is refused; never dropped."""

from pathlib import Path

import numpy as np
import pytest

import carom
from carom.declared import fields_of
from carom.errors import InputError
from carom.models import Shear
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import SceneSpec
from carom.studies import ShearSpec, StudySpec, TradeSpec, TransportSpec
from carom.studies.packings.pack import asked_of
from carom.studies.planner.system import of_plan
from carom.studies.scenes import simulation_of
from carom.studies.study_registry import STUDIES

SPECIES = "{ a = { fraction = 0.5 }, b = { fraction = 0.5, diameter = 0.5 } }"

USUAL = {"n": "20", "packing_fraction": "0.2"}

# A key: lines that take the place of the usual ones or stand beside them, and whether it is in a scene.
KEYS = {
    "n": ({"n": "30"}, lambda scene: scene.n == 30),
    "packing_fraction": ({"packing_fraction": "0.1"}, lambda scene: np.isclose(scene.packing_fraction, 0.1)),
    "density": ({"packing_fraction": "", "density": "0.25"},
                lambda scene: np.isclose(scene.n / scene.volume, 0.25)),
    "box": ({"packing_fraction": "", "box": "[5, 5, 5]"}, lambda scene: np.allclose(scene.box, 5.0)),
    "long box": ({"packing_fraction": "", "box": "[5, 5, 6]"}, lambda scene: scene.box == (5.0, 5.0, 6.0)),
    "dimension": ({"dimension": "2"}, lambda scene: scene.dimension == 2),
    "lattice": ({"n": "32", "lattice": "'fcc'"},
                lambda scene: np.allclose(scene.positions * 4.0 / scene.box[0] % 1.0, 0.5)),
    "nearest": ({"n": "30", "lattice": "'fcc'", "nearest": "true"}, lambda scene: scene.n == 32),
    "cells": ({"n": "", "lattice": "'fcc'", "cells": "2"}, lambda scene: scene.n == 32),
    "long cells": ({"n": "", "lattice": "'fcc'", "cells": "[2, 2, 3]"}, lambda scene: scene.n == 48),
    "diameter": ({"diameter": "2.0"}, lambda scene: scene.diameter == 2.0),
    "sizes": ({"sizes": "{ type = 'uniform', polydispersity = 0.1 }"},
              lambda scene: len({*scene.diameters}) == 20),
    "mass": ({"mass": "3.0"}, lambda scene: scene.mass == 3.0),
    "species": ({"species": SPECIES}, lambda scene: {*scene.diameters} == {0.5, 1.0}),
    "contact": ({"species": SPECIES, "contact": "[[1.0, 0.7], [0.7, 0.5]]"},
                lambda scene: scene.contact is not None),
    "file": ({"n": "", "packing_fraction": "", "file": "'start.extxyz'"}, lambda scene: scene.n == 20),
    "frame": ({"n": "", "packing_fraction": "", "file": "'start.extxyz'", "frame": "0"},
              lambda scene: scene.n == 20),
    "walls": ({"walls": "'x'"}, lambda scene: scene.periodic == (False, True, True)),
    "obstacles": ({"obstacles": "{ pillar = { type = 'ball', center = [1, 1, 1], radius = 0.5 } }"},
                  lambda scene: len(scene.obstacles) == 1),
    "interaction": ({"n": "64", "interaction": "{ type = 'square-well', range = 1.2, depth = 0.1 }"},
                    lambda scene: hasattr(scene.interaction, "steps")),
    "motion": ({"motion": "{ type = 'gravity', g = [0, 0, -1] }"},
               lambda scene: isinstance(scene.motion, carom.models.Gravity)),
    "shear": ({"motion": "{ type = 'shear', rate = 0.5 }"}, lambda scene: scene.motion == Shear(0.5)),
    "oscillating shear": ({"motion": "{ type = 'shear', rate = 0.5, period = 1.0 }"},
                          lambda scene: scene.motion == Shear(0.5, period=1.0)),
    "tilted shear": ({"packing_fraction": "0.01", "motion": "{ type = 'shear', rate = 0.5, tilt = 0.5 }"},
                     lambda scene: scene.motion == Shear(0.5, tilt=0.5)),
    "impact": ({"impact": "0.9"}, lambda scene: scene.impact.restitution == 0.9),
    "drive": ({"drive": "{ type = 'andersen', kT = 1.0, rate = 1.0 }"},
              lambda scene: scene.drive is not None),
    "pinned": ({"pinned": "3"}, lambda scene: len(scene.pinned) == 3),
}  # fmt: skip

OF_A_GRID = {"sizes", "file", "frame", "motion", "pinned", "long box", "long cells", "oscillating shear",
             "tilted shear"}  # fmt: skip

REFUSED = {
    "eos": OF_A_GRID | {"shear", "impact"},
    "transport": OF_A_GRID | {"shear", "impact", "drive", "walls", "obstacles"},
    "shear": OF_A_GRID | {"walls", "obstacles"},
    "trade": KEYS.keys() - {"n", "packing_fraction", "density", "box", "long box", "dimension", "lattice",
                            "nearest", "cells", "long cells", "diameter", "mass"},
    "pack": {"contact", "interaction", "pinned"},
    "plan": KEYS.keys() - {"n", "packing_fraction", "density", "box", "dimension", "lattice", "cells",
                           "nearest", "diameter", "mass", "species", "interaction"},
}  # fmt: skip
"""What a study refuses; the rest is in what runs."""

OF_THE_PLAN = {"n", "box", "lattice", "cells", "nearest"}
"""Of these a plan takes the packing fraction and the dimension; n and the start are its choice."""


def _of_a_grid(kind):
    def scene_of(words):
        return simulation_of(kind.from_toml(f"{words}\n[{kind.section}]").tasks()[0]).scene

    return scene_of


def _of_trade(words):
    return SceneSpec.of_words(TradeSpec.from_toml(f"{words}\n[trade]").scene).build(1)


def _of_pack(words):
    Path("pack.toml").write_text(words, encoding="utf-8")
    _, scene = asked_of("pack.toml", {})
    made = scene.build(1)
    carom.Simulation(made, seed=1, growth=0.01)  # as a packing does
    return made


def _of_plan(words):
    system = of_plan(SceneFile.from_toml(f"{words}\n[run]\nkT = 1.0"))
    (task,) = system.spec(30).tasks()
    return simulation_of(task).scene


SCENES = {
    "eos": _of_a_grid(StudySpec),
    "transport": _of_a_grid(TransportSpec),
    "shear": _of_a_grid(ShearSpec),
    "trade": _of_trade,
    "pack": _of_pack,
    "plan": _of_plan,
}


DRIVES = [
    carom.models.Andersen(1.0, 1.0), carom.models.Langevin(1.0, 1.0, 0.1), carom.models.Brownian(1.0, 0.1),
    carom.models.WhiteNoise(1.0, 1.0), carom.models.Active(1.0, 1.0, 0.1),
]  # fmt: skip


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize("drive", DRIVES, ids=lambda drive: type(drive).__name__)
def test_replicas_share_no_random_number_and_each_has_its_own_again(drive):
    tasks = StudySpec(0.1, n=8, replicas=2, scene={"drive": drive}).tasks()
    one, other, again = map(simulation_of, (*tasks, tasks[0]))
    for look in (lambda s: s.positions.tolist(), lambda s: s.velocities.tolist(), lambda s: s.scene.drive):
        assert look(one) == look(again) != look(other)


def test_the_table_has_every_key_and_every_study_that_reads_a_scene():
    assert fields_of(SceneSpec).keys() <= KEYS.keys()
    assert SCENES.keys() == REFUSED.keys()
    reading = {kind.name for kind in STUDIES.values() if "scene" in kind.Spec.tables}
    assert reading | {"plan"} == SCENES.keys()


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.filterwarnings("ignore:32 particles were placed")
@pytest.mark.parametrize("study", SCENES)
@pytest.mark.parametrize("key", KEYS)
def test_a_study_uses_a_key_of_a_scene_or_refuses_it(study, key, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines, holds = KEYS[key]
    if "file" in lines:
        start = carom.Scene.random(20, 0.2, seed=1)
        with carom.io.open("start.extxyz", "w", start) as writer:
            writer.write(carom.Simulation(start, seed=1).frame())
    words = "\n".join(["[scene]", *(f"{name} = {value}" for name, value in (USUAL | lines).items() if value)])
    if key in REFUSED[study]:
        with pytest.raises(InputError):
            SCENES[study](words)
        return
    scene = SCENES[study](words)
    if study == "plan" and key in OF_THE_PLAN:
        described = SceneFile.from_toml(words).build_scene()
        assert scene.dimension == described.dimension
        assert np.isclose(scene.packing_fraction, described.packing_fraction)
    else:
        assert holds(scene)


def test_a_study_of_driven_particles_is_kept_and_compared_with_nothing(plain, tmp_path):
    """The energy of driven particles has no drift, and no file holds NaN."""
    drive = carom.models.Andersen(kT=1.0, rate=1.0)
    study = carom.equation_of_state(
        [0.2], n=4, dimension=1, replicas=1, collisions_per_particle=16, equilibration=1, blocks=16,
        scene={"drive": drive}, executor="serial", out=tmp_path,
    )  # fmt: skip
    (record,) = study.load(tmp_path).records
    assert record["result"]["energy_drift"] is None
    assert np.isnan(study.table[0].theory)
