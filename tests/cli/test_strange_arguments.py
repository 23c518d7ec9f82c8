"""Arguments that nobody means: a sentence and exit code 2, neither a traceback nor a hang."""

import pytest
from helpers.commands import typed
from helpers.frames import make_frames, write
from helpers.options import COMMANDS
from typer.testing import CliRunner

import carom
from carom.cli import app
from carom.errors import InputError
from carom.simulation.system_of_scene import unit_of


@pytest.mark.parametrize(
    "words",
    [
        ["transport", "--eta", "1e-320", "--n", "100"],
        ["eos", "--eta", "0.1:0.4:2000000000"],
        ["pack", "--rate", "1e-320"],
        ["pack", "--stage", "1e-320:1e3"],
        ["pack", "--dimension", "99999999999999999999"],
        ["run", "--n", "32", "--cores", "99999999999999999999"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_a_number_far_too_small_or_large_is_refused_in_a_sentence(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, words)
    assert (done.exit_code, type(done.exception)) == (2, SystemExit)
    assert "expected" in done.output or "must be" in done.output
    assert not list(tmp_path.iterdir()), "nothing is begun"


NEEDED = {
    "code": ["5"], "measure": ["start.xyz", "rdf"], "movie": ["start.xyz", "a.mp4"],
    "export": ["start.xyz", "a.gsd"],
} | {name: ["start.xyz"] for name in ("info", "view", "resume")}  # fmt: skip
"""Arguments that a command must have."""

ANY = ("--out", "--scheduler")
"""Options that take any text: names and addresses."""


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("command", COMMANDS)
def test_no_option_takes_a_value_that_means_nothing(command, tmp_path, monkeypatch):
    """It is refused in one sentence that says which option it is, before anything is done."""
    monkeypatch.chdir(tmp_path)
    lattice = 'Lattice="6 0 0 0 5 0 0 0 4" Properties=species:S:1:pos:R:3'
    (tmp_path / "start.xyz").write_text(f"2\n{lattice}\nA 1.0 1.0 1.0\nA 3.0 1.0 1.0\n")
    for parameter in COMMANDS[command].params:
        option = parameter.opts[0]
        if parameter.param_type_name == "argument" or parameter.is_flag or option in ANY:
            continue
        words = [command, *NEEDED.get(command, ()), option, "no such value"]
        if (command, option) == ("measure", "--axis"):
            words[2] = "profile"
        if command == "plan" and option in ("--target", "--cores"):
            words += ["--eta", "0.3"]
        done = CliRunner().invoke(app, words, env={"COLUMNS": "300"})
        assert (done.exit_code, type(done.exception)) == (2, SystemExit), words
        said = " ".join(done.output.replace("│", "").split())
        if command != "resume":  # there is no such folder, either
            assert "no such value" in said or option.strip("-").replace("-", "_") in said.replace("-", "_")
        assert "Traceback" not in said
        assert [each.name for each in tmp_path.iterdir()] == ["start.xyz"]


@pytest.mark.parametrize(
    ("line", "way"),
    [
        ("run --packing-fracton 0.3", "--packing-fraction"),
        ("run --ndim 3", "Did you mean --dimension?"),
        ("run --T 3", "Did you mean --kT?"),
        ("run --phi 0.3", "Did you mean --eta?"),
        ("run --box 3,3", "Take a larger box or fewer particles."),
        ("run --eta 0.7", "Scene.crystal, --lattice), for equal ones up to 0.74"),
        ("transport --num-particles 3", "Did you mean --n?"),
        ("pack --temperature 3", "carom pack has no kT"),
        ("code 5 --eta 0.3", "carom code has no eta"),
        ("code 5 --num-particles 3", "Did you mean N?"),
        ("plan --target Z=0", "--eta"),
        ("plan --target Z=0 --eta 0.3", "the relative error of the target must be at least"),
        ("measure cut.h5md rdf", "carom.io.rebuild(source, target, keep)"),
        (
            "measure start.xyz profile --axis q",
            "axis must be x, y, z or a number from 0, found the string 'q'",
        ),
        ("info cut.h5md", "carom.io.rebuild(source, target, keep)"),
    ],
)
def test_a_line_that_cannot_be_meant_points_the_right_way(line, way, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cut.h5md").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    done = CliRunner().invoke(app, line.split(), env={"COLUMNS": "300"})
    assert (done.exit_code, type(done.exception)) == (2, SystemExit)
    assert way in " ".join(done.output.replace("│", "").split())


def test_growth_that_no_diameter_would_notice_is_refused():
    scene = carom.Scene.crystal(cells=1, packing_fraction=0.1)
    velocities = scene.positions - scene.positions.mean(axis=0)
    with pytest.raises(InputError, match="do not grow"):
        unit_of(scene, velocities, 1e-320 + 0.0 * scene.diameters)
    for rates in (0.0, 1e-12):
        unit_of(scene, velocities, rates + 0.0 * scene.diameters)


def test_a_superscript_is_no_number_of_a_species(tmp_path):
    done = CliRunner().invoke(app, ["measure", str(tmp_path / "none.h5md"), "rdf", "--pair", "0,²"])
    assert (done.exit_code, type(done.exception)) == (2, SystemExit)
    assert "does not exist" in done.output


@pytest.mark.parametrize("inside", ["", "sub"])
@pytest.mark.parametrize(
    "line",
    [
        "run --n 8 --eta 0.1 -c 5 --out", "pack --n 8 --out", "eos --eta 0.1 --n 8 --out", "code 5 --out",
        "plan Z=0.01 --eta 0.1 --out", "measure a.h5md rdf --out", "transport --eta 0.1 --n 8 --out",
    ],
)  # fmt: skip
def test_a_folder_that_is_a_link_to_nothing_is_told_before_anything_is_computed(
    tmp_path, line, inside, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "a.h5md", make_frames(3))
    (tmp_path / "link").symlink_to("gone")
    done = typed(*line.split(), f"link/{inside}")
    assert done.exit_code == 2
    assert "link is a link to gone, which does not exist; create that" in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize("name", ["l.extxyz", "l.gif", "l.html", "l.toml"])
def test_a_file_that_is_a_link_to_nothing_is_not_replaced(tmp_path, name, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "a.h5md", make_frames(3))
    (tmp_path / name).symlink_to("gone")
    line = {
        "l.extxyz": "export a.h5md",
        "l.gif": "movie a.h5md",
        "l.html": "view a.h5md --no-open -o",
        "l.toml": "init",
    }
    done = typed(*line[name].split(), name)
    assert (done.exit_code, (tmp_path / name).is_symlink()) == (2, True), done.output
    assert "exists already" in done.stderr
