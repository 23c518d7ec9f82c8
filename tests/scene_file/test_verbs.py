"""A function reads a scene file exactly as the command of the same name does."""

import importlib

import pytest
from helpers.commands import refused
from typer.testing import CliRunner

import carom
from carom import cli
from carom.errors import InputError

FILE = """
[scene]
n = 32
dimension = 2
packing_fraction = 0.3

[run]
kT = 2.0
seed = 3
collisions_per_particle = 77

[study]
replicas = 3
seed = 4

[transport]
replicas = 5
seed = 5

[plan]
target = "Z=0.05"
n = 64
seed = 6
cores = 1
pilot = 3.5

[code]
n = 9
dimension = 4
seed = 7

[pack]
seed = 8
rate = 0.2
until_Z = 50.0
common = true
"""

POINTS = "[pack]\nn = 20\ndimension = 2\nseeds = 3\nseed = 2\nrate = 0.2\n"

CALLS = {
    "run": (lambda path, **given: carom.run(path, "out", **given), {"seed": 9}),
    "pack": (lambda path, **given: carom.pack(path, **given), {"seed": 9}),
    "packings": (lambda path, **given: carom.packings(path, **given), {"seeds": 2}),
    "eos": (lambda path, **given: carom.equation_of_state(scene=path, **given), {"replicas": 2}),
    "transport": (lambda path, **given: carom.transport(scene=path, **given), {"seed": 9}),
    "plan": (lambda path, **given: carom.plan(scene=path, **given), {"target": "P=0.1"}),
    "code": (lambda path, **given: carom.spherical_code(path, **given), {"tries": 3}),
}
"""The function of each command, and an argument that is an option of the same name."""


class Asked(Exception):
    """What was to be done, before anything is done."""


def ask(*values):
    raise Asked(values)


@pytest.fixture(autouse=True)
def nothing_runs(monkeypatch, tmp_path):
    importlib.import_module("carom.studies.at_path")  # whose docstrings are those of Study.run
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("carom.studies.study.Study.run", lambda study, **how: ask(study.spec))
    monkeypatch.setattr(
        "carom.studies.runs.driver.Run.from_the_start", lambda run, _: ask(run.plan.to_toml())
    )
    monkeypatch.setattr(
        "carom.studies.packings.pack.Compression.begun",
        lambda scene, asked: ask(scene.positions.tobytes(), scene.diameters.tobytes(), asked),
    )
    monkeypatch.setattr(
        "carom.studies.planner.pressure.PressureMethod.pilot",
        lambda method, n, **how: ask(
            str(method.system), method.quantity, n, how["seed"], how["seconds"], method.system.kT
        ),
    )


def asked(call, *arguments, **given):
    with pytest.raises(Asked) as caught:
        call(*arguments, **given)
    return caught.value.args[0]


def typed(command, path, *options):
    done = CliRunner().invoke(cli.app, [command.replace("packings", "pack"), str(path), *options])
    assert isinstance(done.exception, Asked), done.output
    return done.exception.args[0]


@pytest.mark.parametrize("name", CALLS)
def test_a_function_and_its_command_read_the_same_of_a_scene_file(name, tmp_path):
    call, given = CALLS[name]
    (tmp_path / "folder").mkdir()
    path = tmp_path / "folder" / "scene.toml"
    path.write_text(POINTS if name == "packings" else FILE)
    options = [word for key, value in given.items() for word in (f"--{key}", str(value))]
    one, other = asked(call, str(path)), asked(call, path, **given)
    assert one == typed(name, path) == asked(call, path.parent) == typed(name, path.parent)
    assert other == typed(name, path, *options) != one


def test_what_a_file_says_is_done_by_the_function(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(FILE)
    (_, _, spec) = asked(carom.pack, path)
    assert (spec.plan, spec.collisions, spec.common) == (((0.2, 50.0),), None, True)
    assert (spec.seed, spec.neighbors) == (8, "auto")
    assert asked(carom.plan, scene=path)[1:] == ("Z", 64, 6, 3.5, 2.0)
    (spec,) = asked(carom.equation_of_state, [0.1], scene=path)
    assert (spec.packing_fraction, spec.n, spec.dimension, spec.replicas) == ((0.1,), (32,), 2, 3)
    (spec,) = asked(carom.spherical_code, path, 5)
    assert (spec.n, spec.dimension, spec.seed) == (9, 5, 7)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda path: carom.equation_of_state(path), "a scene file is given as scene="),
        (lambda path: carom.transport(path), "a scene file is given as scene="),
        (lambda path: carom.pack(path, dimension=3), r"\[scene\] says what is packed"),
        (lambda path: carom.packings(path, seeds=2), r"\[scene\] is the start of one packing"),
        (
            lambda path: carom.plan(scene=path, dimension=3),
            "contradicts packing_fraction, dimension",
        ),
        (lambda path: carom.pack("points.toml"), "packings"),
    ],
)
def test_a_file_that_contradicts_the_arguments_is_refused(call, says, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(FILE)
    (tmp_path / "points.toml").write_text(POINTS)
    with pytest.raises(InputError, match=says):
        call(str(path))


LOSS = "{ type = 'loss', restitution = 0.9, contact_time = 1e-3 }"

BAD = [
    ("eos", "[study]\nreplicas = 0\n", "replicas must be between"),
    ("eos", "[study]\npacking_fraction = [0.1, 0.1]\n", "names a value twice"),
    ("eos", "[study]\nn = [100, 'x']\n", "n must be an integer"),
    ("eos", "[study]\nrelative_error = 1e-3\ncollisions_per_particle = 10\n", "contradict"),
    ("eos", "[study]\nblocks = 20\nframes = 30\n", "frames must be between 0 and 20"),
    ("eos", "[scene]\nmotion = { type = 'gravity', g = [0, 0, -1] }\n[study]\n", "no uniform phase"),
    ("eos", "[studdy]\nn = 3\n", "did you mean study"),
    ("eos", "[study]\nreplica = 2\n", "did you mean replicas"),
    ("eos", "[study]\nlattice = 'bcc'\n", "did you mean fcc"),
    (
        "transport",
        "[study]\nn = 3\n",
        "is for another command; this one reads [transport] or [scene]",
    ),
    ("transport", "[transport]\ninitial = 'fcc'\n", 'give lattice = "fcc"'),
    ("transport", "[scene]\nfile = 'x.h5md'\n", "file has no meaning in a study"),
    ("transport", "[transport]\ndimension = 1\n", "between 2 and 12"),
    ("transport", "[scene]\npinned = [0]\n[transport]\n", "no bulk fluid"),
    ("transport", "[transport]\npacking_fraction = 0.6\n", "beyond freezing"),
    ("transport", "[transport]\nkT = 0\n", "kT must be"),
    ("transport", "[transport]\nkT = 0\n[scene]\nspecies = { a = { fraction = 1 } }\n", "kT must be"),
    ("transport", f"[scene]\nimpact = {LOSS}\n", "impact leaves no bulk fluid"),
    ("code", "[code]\nn = 1\n", "n must be between 2 and"),
    ("code", "[code]\nn = 5000\n", "n must be between 2 and"),
    ("code", "[code]\nn = 5.5\n", "n must be an integer"),
    ("code", "[code]\nn = 9\ndimension = 1\n", "dimension must be"),
    ("code", "[code]\nn = 9\ntries = 0\n", "tries must be"),
    ("code", "[code]\nn = 9\nk = 4\n", "it is called dimension"),
    ("code", "[code]\nn = 9\nrate = 0\n", "rate must be"),
    ("code", "[code]\nn = 9\ndigits = 5\n", "digits must be"),
    ("code", "[code]\nn = 9\nagree = 1\n", "agree must be"),
    ("code", "[scene]\nn = 8\n", "this one reads [code]"),
    ("code", "[code]\ndimension = 3\n", "must have n"),
    ("code", "[code]\nn = 9\nagree = 50\n", "agree must be at most"),
    ("pack", "[pack]\nstages = [[0.1]]\n", "A stage is"),
    ("pack", "[pack]\nn = 20\nrate = -1\n", "rate must be at least 0"),
    ("pack", "[pack]\nspecies.a = { count = 3, size = 2 }\n", "species a has no 'size'"),
    ("plan", "[scene]\n[plan]\nwalltime = -4\n", "walltime must be greater than 0"),
    ("plan", "[scene]\n[plan]\ntarget = 'Q=1'\n", "Expected QUANTITY=ERROR"),
    ("trade", "[scene]\nwalls = true\n", "leave out [scene] walls"),
    ("trade", "[trade]\nseconds = 0\n", "seconds must be greater than 0"),
    ("run", "[run]\ntime = 1\ncollisions_per_particle = 3\n", "each says how long"),
]


@pytest.mark.parametrize(("command", "text", "says"), BAD)
def test_a_bad_section_is_one_sentence_and_nothing_is_written(command, text, says, tmp_path):
    (tmp_path / "scene.toml").write_text(text)
    assert says in refused(command, "scene.toml", cwd=tmp_path)
