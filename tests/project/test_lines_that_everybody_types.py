"""The lines that everybody types: studies are verbs of the package, and one word reads what was saved."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from helpers.commands import content, refused
from helpers.plain import uncompiled
from helpers.saved import one_of_each
from typer.testing import CliRunner

import carom
from carom import Species, cli, models
from carom.errors import CaromError, CaromWarning, FileError, InputError
from carom.frame import Frame
from carom.results import Result
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import SceneSpec
from carom.studies import EquationOfState, Packing, RunPlan, RunResult, SphericalCode, Transport
from carom.studies.runs.folder import RunFolder
from carom.studies.runs.inputs import plan_of_scene
from carom.studies.study import Study

LINES = 3
"""Most lines that a result prints, unless it is a study, which prints its table."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with one of each that can be saved."""
    return one_of_each(tmp_path_factory.mktemp("saved"))


SAVED = {
    "run1": RunResult,
    "pack1": Packing,
    "eos1": EquationOfState,
    "transport1": Transport,
    "plan1": RunPlan,
    "code.json": SphericalCode,
}


@pytest.mark.parametrize("name", SAVED)
def test_every_result_has_the_same_methods(folder, name, tmp_path):
    found = carom.load(folder / name)
    assert type(found) is SAVED[name]
    if isinstance(found, Study):
        assert all(str(table) in str(found) for table in found.printed())
        assert all(sentence in str(found) for sentence in found.sentences())
    else:
        assert 1 <= len(str(found).splitlines()) <= LINES
    assert "nan" not in str(found)
    assert found._repr_html_()
    assert isinstance(found, Result)
    words = found.to_dict()
    assert json.loads(json.dumps(words, allow_nan=False)) == json.loads(json.dumps(words))
    for suffix in (".json", ".npz"):
        found.save(tmp_path / f"result{suffix}")
        again = carom.load(tmp_path / f"result{suffix}")
        assert type(again) is type(found)
        assert json.dumps(again.to_dict()) == json.dumps(words)
    found.save(tmp_path / "result.csv")
    head, *rows = (tmp_path / "result.csv").read_text().splitlines()
    assert "," in head
    assert rows or name == "plan1"


@pytest.mark.parametrize("name", SAVED)
def test_every_result_becomes_a_data_frame(folder, name):
    found = carom.load(folder / name)
    assert tuple(found.to_dataframe().columns) == tuple(found._columns())


def test_a_run_is_read_back(folder):
    run = carom.load(folder / "run1")
    assert run.Z.mean == run.summary["Z"]["mean"] > 1.0
    assert run.to_dict()["Z_error"] == run.Z.error
    assert run.frames[-1].n == 32
    assert run.rdf.frames == 3
    assert run.plot().axes


def test_the_file_of_a_scene_that_is_run_loses_nothing(tmp_path):
    start = carom.Scene.random(24, 0.1, 2, walls="y", pinned=[3, 5], seed=2)
    moving = start.replace(velocities=np.random.default_rng(1).normal(size=(24, 2)) * ~start.pinned[:, None])
    plain = carom.Scene.crystal(32, 0.3)
    loss = carom.models.Loss(0.9, contact_time=1e-3)
    for scene in (moving, plain.replace(impact=0.9), plain.replace(impact=loss)):
        folder = RunFolder(tmp_path)
        plan, start = plan_of_scene(scene, None, folder)
        folder.begin(plan, start)
        first = SceneFile.from_toml(plan.to_toml()).build_scene()
        assert np.array_equal(first.positions, scene.positions)
        for name in ("velocities", "pinned"):
            assert np.array_equal(getattr(first, name), getattr(scene, name)), name
        assert (first.periodic, first.impact) == (scene.periodic, scene.impact)


def test_a_run_replaces_no_run(folder):
    with pytest.raises(FileError, match="holds a run already"):
        carom.run(carom.Scene.crystal(32, 0.3), folder / "run1")


def test_a_run_that_cannot_begin_leaves_its_folder_free(tmp_path):
    rest = carom.Scene.crystal(32, 0.3)
    with pytest.raises(InputError, match="Nothing moves"):
        carom.run(rest, tmp_path / "cold", kT=0.0, relative_error=0.1)
    assert not (tmp_path / "cold").exists()


DISKS = carom.Scene.crystal(32, 0.1)


class Own(models.Ball):
    """An obstacle of one's own, which no scene file holds."""


AT_REST = DISKS.replace(velocities=np.zeros((32, 3)))
RULE = """
def behave(unit, event):
    unit.kind = 7
"""
RULES = """
[scene]
box = [20.0, 20.0]
species.hare = { count = 4, diameter = 0.1 }
[scene.interaction]
type = "ranges"
file = "rules.py"
rule = "behave"
seed = 1
kinds = [ { name = "hare", circles = [0.3], timer = 0.0, memory = [0.0] } ]
"""

REFUSED = {
    "an unknown argument": (DISKS, {"colections": 3}),
    "two lengths": (DISKS, {"time": 1.0, "collisions_per_particle": 3}),
    "cores of a small box": (DISKS, {"cores": 2}),
    "a log of an oscillating shear": (
        DISKS.replace(motion=models.Shear(0.5, period=2.0)),
        {"event_log": True},
    ),
    "swaps of equal diameters": (DISKS, {"swaps": carom.Swaps(interval=1.0)}),
    "swaps in a log": (DISKS, {"swaps": carom.Swaps(interval=1.0), "event_log": True}),
    "a barostat between walls": (
        carom.Scene.random(9, 0.1, 2, walls="y"),
        {"barostat": carom.Barostat(pressure=1.0, interval=1.0)},
    ),
    "a barostat at rest": (AT_REST, {"barostat": carom.Barostat(pressure=1.0, interval=1.0)}),
    "the pressure of who rests": (AT_REST, {"relative_error": 0.1}),
    "a format of three dimensions": (carom.Scene.random(9, 0.01, 4), {"write": ["extxyz"]}),
    "a class of one's own": (
        carom.Scene([[1.0, 1.0], [5.0, 5.0]], (8.0, 8.0), obstacles=[Own((3.0, 6.0), 1.0)]),
        {},
    ),
    "a missing file": ("missing.xyz", {}),
    "an overlap": (SceneFile(SceneSpec(n=32, packing_fraction=0.9)), {}),
    "a rule that is wrong at the first event": ("rules.toml", {"trust_code": True}),
}


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("name", REFUSED)
def test_a_run_that_is_refused_leaves_every_byte_of_the_one_that_it_was_to_replace(
    folder, tmp_path, monkeypatch, name
):
    monkeypatch.chdir(tmp_path)
    Path("rules.py").write_text(RULE)
    Path("rules.toml").write_text(RULES)
    scene, how = REFUSED[name]
    shutil.copytree(folder / "run1", "run1")
    before = content(tmp_path)
    with pytest.raises(CaromError):
        carom.run(scene, "run1", overwrite=True, **how)
    assert content(tmp_path) == before


def test_a_run_that_another_process_keeps_is_not_replaced(folder, tmp_path):
    shutil.copytree(folder / "run1", tmp_path / "run1")
    before = content(tmp_path)
    with RunFolder(tmp_path / "run1").owned(), pytest.raises(FileError, match="Another process"):
        carom.run(DISKS, tmp_path / "run1", overwrite=True)
    assert content(tmp_path) == before


PACKINGS = {
    "one particle": (1, {}),
    "nothing moves": (AT_REST, {}),
    "an unknown argument": (9, {"rat": 1.0}),
    "no end": (9, {"stages": [(1.0, None)]}),
    "steps of pairs": (carom.Scene.random(2, 0.01, 2, interaction=models.SquareWell(1.5, 1.0)), {}),
}


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("name", PACKINGS)
def test_a_packing_that_is_refused_leaves_every_byte_of_the_one_that_it_was_to_replace(
    folder, tmp_path, name
):
    start, how = PACKINGS[name]
    shutil.copytree(folder / "pack1", tmp_path / "pack1")
    before = content(tmp_path)
    with pytest.raises(CaromError):
        carom.pack(start, out=tmp_path / "pack1", overwrite=True, **how)
    assert content(tmp_path) == before


STUDIES = {
    "other settings": {"seed": 5},
    "no cores": {"cores": 0},
    "an unknown executor": {"executor": "clouds"},
    "an unknown argument": {"replica": 2},
    "a density beyond all packings": {"packing_fractions": [0.1, 0.9]},
}


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_that_is_refused_leaves_every_byte_of_what_its_folder_holds(folder, tmp_path, name):
    shutil.copytree(folder / "eos1", tmp_path / "eos1")
    before = content(tmp_path)
    how = {"n": 32, "replicas": 1, "equilibration": 5, "executor": "serial", "collisions_per_particle": 40}
    how |= STUDIES[name]
    with pytest.raises(CaromError):
        carom.equation_of_state(how.pop("packing_fractions", [0.1, 0.2]), out=tmp_path / "eos1", **how)
    assert content(tmp_path) == before


def test_a_packing_is_read_back_bit_for_bit(folder, tmp_path):
    packing = carom.load(folder / "pack1")
    assert packing.Z >= 1e4
    assert packing.to_dict() == json.loads((folder / "pack1" / "summary.json").read_text())
    packing.save(tmp_path / "again")
    again = carom.load(tmp_path / "again")
    assert np.array_equal(again.frame.positions, packing.frame.positions)
    assert np.array_equal(again.history, packing.history)


@pytest.mark.usefixtures("plain")
def test_a_packing_begins_from_a_scene_file(tmp_path):
    scene, out = tmp_path / "scene.toml", tmp_path / "p"
    scene.write_text("[scene]\nn = 9\ndimension = 2\npacking_fraction = 0.2\n")
    words = ["pack", str(scene), "--collisions", "20", "--no-pictures", "--json", "--out", str(out)]
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["n"] == 9


def test_a_scene_file_gives_its_scene_and_a_checkpoint_its_simulation(folder):
    assert isinstance(carom.load(folder / "scene.toml"), carom.Scene)
    sim = carom.load(folder / "state.h5")
    assert isinstance(sim, carom.Simulation)
    assert sim.collisions == 50


def test_what_cannot_be_loaded_is_a_sentence_that_lists_what_can(folder, tmp_path):
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "other.json").write_text('{"kind": "thing"}')
    (tmp_path / "empty").mkdir()
    frames = next((folder / "run1").glob("*.h5md"))
    unknown = [tmp_path / name for name in ("notes.txt", "other.json", "empty", "no")]
    for path in (*unknown, frames, 3):
        with pytest.raises(CaromError, match=r"a scene file .*, a checkpoint .*, the folder of a run, pack"):
            carom.load(path)


CHANGES = {
    "eos1": [(("records",), "x"), (("records", 0, "result", "Z", "mean"), 1.0), (("records", 0), {})],
    "transport1": [(("records", 0, "result", "blocks"), []), (("study", "scene"), "x"), (("records",), None)],
    "run1": [(("summary", "U"), 5), (("summary", "temperature", "mean"), "x"), (("kind",), {})],
    "pack1": [
        (("frame", "positions"), None),
        (("frame", "positions", 0, 0), 1e300),
        (("frame", "diameters", 0), 2**70),
        (("history", 0, 0), 2**70),
        (("frame", "species"), [0.5] * 20),
    ],
}
"""What somebody changes in the file of a saved result: where, and to what."""


@pytest.mark.parametrize("name", CHANGES)
def test_a_file_that_was_changed_by_hand_is_a_sentence(folder, name, tmp_path):
    path = tmp_path / "result.json"
    carom.load(folder / name).save(path)
    text = path.read_text()
    for where, value in CHANGES[name]:
        words = json.loads(text)
        part = words
        for key in where[:-1]:
            part = part[key]
        part[where[-1]] = value
        path.write_text(json.dumps(words))
        with pytest.raises(CaromError):
            carom.load(path)


@pytest.mark.parametrize("where", [("U",), ("temperature",), ("U", "mean")])
def test_the_summary_of_a_run_is_checked_in_all_that_is_shown(folder, where, tmp_path):
    words = json.loads((folder / "run1" / "summary.json").read_text())
    (words if len(where) == 1 else words[where[0]])[where[-1]] = "x"
    (tmp_path / "summary.json").write_text(json.dumps(words))
    with pytest.raises(FileError, match=where[-1]):
        carom.load(tmp_path)


def test_what_is_not_finished_says_how_to_go_on(folder, tmp_path):
    for source, name in (("run1", "checkpoint.h5"), ("pack1", "compression.h5")):
        (tmp_path / source).mkdir()
        (tmp_path / source / name).write_bytes((folder / source / name).read_bytes())
        with pytest.raises(FileError, match=f"carom resume .*{source}"):
            carom.load(tmp_path / source)


def test_a_folder_is_accepted_wherever_a_file_is(folder, tmp_path):
    with carom.open(folder / "run1") as frames:
        assert len(frames) == 3
        assert isinstance(frames[-1], Frame)
        assert np.isfinite(carom.RDF().over(frames).g).all()
    with carom.open(folder / "pack1") as frames:
        assert frames[-1].n == 20
    assert carom.io.read(folder / "run1").n == 32
    assert carom.io.convert(folder / "run1", tmp_path / "out.extxyz") == 3
    assert carom.movie(folder / "run1", tmp_path / "run.gif", size=32) == 3
    assert "32 spheres" in carom.view(folder / "run1").title or carom.view(folder / "run1").html
    with pytest.raises(FileError, match="a folder without a trajectory"):
        carom.open(folder)


@pytest.mark.parametrize("command", ["export", "movie", "measure", "view"])
def test_a_command_takes_a_folder_and_replaces_its_own_page_or_table(folder, tmp_path, command):
    words = {
        "export": [str(tmp_path / "out.extxyz")],
        "movie": [str(tmp_path / "out.gif"), "--size", "32", "--color", "speed"],
        "measure": ["rdf", "--rmax", "1.5"],
        "view": ["--no-open"],
    }[command]
    for again in (False, True):
        done = CliRunner().invoke(cli.app, [command, str(folder / "run1"), *words])
        if again and command in ("export", "movie"):
            assert done.exit_code == 2
            assert "--overwrite" in done.output
        else:
            assert done.exit_code == 0, done.output


def test_a_page_of_somebody_else_is_not_replaced(folder, tmp_path):
    (tmp_path / "view.html").write_text("<html>mine</html>")
    (tmp_path / "trajectory.extxyz").touch()
    assert "--overwrite" in refused("view", ".", "--no-open", cwd=tmp_path)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: carom.pack(3.5), "starts from a number of particles, a Scene or a scene file"),
        (lambda: carom.pack(100, eta=0.3), "it is called packing_fraction"),
        (lambda: carom.pack(100, until_pressure=1e3), "it is called until_Z"),
        (lambda: carom.pack(carom.Scene.crystal(32, 0.3), dimension=3), "dimension is for points"),
        (lambda: carom.run(100), "takes a Scene, a scene file .* or the folder of a run"),
        (lambda: carom.run(carom.Scene.crystal(32, 0.3), hours=3), "it is called walltime"),
        (lambda: carom.run(seconds=3), "it is called walltime"),
        (lambda: carom.equation_of_state(phi=0.3), "it is called packing_fraction"),
        (lambda: carom.equation_of_state(0.3, workers=2), "it is called cores"),
        (lambda: carom.equation_of_state(packing_fractions=[0.3]), "it is called packing_fraction"),
        (lambda: carom.transport(eta=0.1), "it is called packing_fraction"),
        (lambda: carom.transport(0.1, cores=0), "cores must be"),
        (lambda: carom.spherical_code(5, seeds=3), "it is called tries"),
        (lambda: carom.plan(0.3), "begins with a target"),
        (lambda: carom.plan("Z=1e-3", eta=0.3), "it is called packing_fraction"),
        (lambda: carom.plan("Z=1e-3", packing_fraction=0.3, hours=1.0), "it is called walltime"),
        (lambda: carom.run(dim=2), "dimension is a keyword of Scene.random and Scene.crystal"),
        (lambda: carom.pack(100, num_particles=3), "it is called n"),
        (lambda: carom.transport(0.1, temperature=2.0), "it is called kT"),
        (lambda: carom.shear(0.1, replica=2), "did you mean replicas"),
        (lambda: carom.shear(0.1, shear_rate=2), "it is called rate"),
        (lambda: carom.Species("small", diamter=2.0), "Species has no keyword 'diamter'; did you mean diam"),
        (lambda: carom.Tuning(neighbours="lists"), "did you mean neighbors"),
        (lambda: carom.Barostat(P=1.0), "'P'; it is called pressure"),
        (lambda: carom.Swaps(attemps=1.0), "did you mean attempts"),
        (lambda: carom.open(3), "the path of a file or folder"),
    ],
)
def test_a_wrong_argument_is_a_sentence_with_the_right_word(call, sentence):
    with pytest.raises(InputError, match=sentence):
        call()


def test_the_coefficients_of_one_point_are_attributes(folder):
    study = carom.load(folder / "transport1")
    assert study.shear_viscosity is not None
    assert math.isnan(study.shear_viscosity.mean)  # of so short a run
    assert "unknown" in str(study)
    whole = " ".join(str(study.table).split())
    assert "nan" not in whole
    assert "blocks too short" in whole


def test_studies_go_on_from_their_folder(folder):
    before = carom.load(folder / "eos1")
    study = carom.resume(folder / "eos1", cores=1)
    assert study.complete
    assert study.engine == ""  # nothing was left to run
    assert study.table == before.table
    assert carom.resume(folder / "transport1").complete
    done = CliRunner().invoke(cli.app, ["resume", str(folder / "eos1")])
    assert done.exit_code == 0, done.output
    assert "0.2" in done.output


def test_a_fluid_a_mixture_a_crystal_and_walls(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = carom.Scene.random(256, packing_fraction=0.30)
    sim = carom.Simulation(scene, kT=1.0, seed=1)
    sim.equilibrate(collisions_per_particle=50)
    p, g = sim.measure(carom.Pressure(), carom.RDF(), collisions_per_particle=50)
    assert float(p) == pytest.approx(carom.theory.carnahan_starling(0.30), rel=0.1)
    g.plot("g.png")
    large, small = Species("large", fraction=0.2), Species("small", fraction=0.8, diameter=0.5)
    assert np.bincount(carom.Scene.random(500, 0.40, species=[large, small]).species).tolist() == [100, 400]
    assert carom.Scene.crystal(500, 0.60).n == 500
    with uncompiled():
        between = carom.Simulation(carom.Scene.random(8, 0.10, walls="z"), seed=1)
        with pytest.warns(CaromWarning, match="independent samples"):
            assert between.measure(carom.WallPressure("z_high"), time=4.0, blocks=2).pressure.mean > 0.0
    sim.write("f.extxyz", every=0.5, count=2)
    sim.view("f.html")
    sim.plot("f.png")
    carom.movie("f.extxyz", "f.gif", color="speed")
    assert {each.name for each in tmp_path.iterdir()} == {"g.png", "f.extxyz", "f.html", "f.png", "f.gif"}


@pytest.mark.slow
def test_a_square_well_and_a_granular_bed():
    well = carom.Scene.random(100, density=0.3, interaction=models.SquareWell(range=1.5, depth=1.0))
    sim = carom.Simulation(well)
    sim.equilibrate(collisions_per_particle=250, kT=1.5)
    assert sim.measure(carom.Energy(), collisions_per_particle=2000).U.mean < -1.5
    loss = models.Loss(0.9, contact_time=1e-3)
    floor = models.Wall(shake=models.Sine(0.3, period=2.0), impact=loss)
    gravity = models.Gravity((0.0, -1.0))
    scene = carom.Scene.random(60, 0.2, dimension=2, walls={"y_low": floor}, motion=gravity, impact=loss)
    bed = carom.Simulation(scene)
    bed.run(time=3.0)
    assert next(each for each in bed.obstacles if each.name == "y_low").work > 0.0


@pytest.mark.parametrize(
    "call",
    [
        lambda: carom.observables.blocking([1.0]),
        lambda: carom.Scene.crystal(20, 0.3, nearest=True),
        lambda: SceneSpec(lattice="fcc", n=20, packing_fraction=0.3, nearest=True),
    ],
)
def test_a_warning_is_at_the_line_of_the_user(call):
    with pytest.warns(CaromWarning) as found:
        call()
    assert {each.filename for each in found} == {__file__}


def test_all_warnings_find_that_line_in_one_way():
    package = Path(carom.__file__).parent
    assert [path.name for path in package.rglob("*.py") if "stacklevel" in path.read_text("utf-8")] == [
        "errors.py"
    ]


def test_what_new_users_try_is_answered_by_what_to_write():
    scene = carom.Scene([[1.0, 1.0], [3.0, 3.0]], 5.0)
    with pytest.raises(AttributeError, match=r"'pressure'; take sim\.measure\(carom\.Pressure\(\)\)"):
        carom.Simulation(scene).pressure  # noqa: B018
    with pytest.raises(AttributeError, match=r"'velocites'; take sim\.velocities$"):
        carom.Simulation(scene).velocites  # noqa: B018
    with pytest.raises(
        InputError, match=r"write drive=models\.Langevin\(kT=\.\.\., friction=\.\.\., step=\.\.\.\)"
    ):
        scene.replace(drive="langevin")
    jar = {"type": "sphere", "center": [2.0, 2.0], "radius": 1.0}
    with pytest.raises(InputError, match='a solid sphere in the box is a Ball, in a file type = "ball"'):
        SceneSpec(n=2, dimension=2, box=(9.0, 9.0), obstacles=[jar]).build(1)
