"""Folders of results hold one kind each, failures have exit codes, and standard streams may be full."""

import subprocess

import pytest
from helpers.commands import CAROM, content, refused, typed
from helpers.frames import make_frames, write
from helpers.needs import skip_without
from helpers.options import COMMANDS, PLAN

from carom.errors import FileError
from carom.layout import KINDS
from carom.scene_file.sections import SceneSpec
from carom.studies.folder import Folder
from carom.studies.packings.compression import PackingFolder
from carom.studies.result_folders import of_the_user, title
from carom.studies.runs.folder import RunFolder

INTO = {
    "run": ("a run", ["--n", "32", "--overwrite"]),
    "pack": ("a packing", ["--n", "20", "--overwrite"]),
    "eos": ("a study", ["--eta", "0.1", "--n", "32"]),
    "transport": ("a study", ["--eta", "0.1", "--n", "32"]),
    "shear": ("a study", ["--eta", "0.1", "--n", "32"]),
    "code": ("a study", ["5"]),
    "plan": ("a plan", ["--eta", "0.1", "-t", "Z=0.1"]),
    "trade": ("a study", []),
}
"""Commands that fill a folder: what they put there, and their arguments."""


@pytest.mark.parametrize("command", INTO)
def test_a_folder_holds_one_kind_of_results(tmp_path, command):
    kind, words = INTO[command]
    for other, known in KINDS.items():
        for name in known.marks:
            if other == kind:
                continue
            folder = tmp_path / name
            folder.mkdir()
            (folder / name).write_text("{}")
            said = refused(command, *words, "--out", folder, cwd=folder)
            assert f"holds {other} already ({name})" in said


@pytest.mark.parametrize("folder", [RunFolder, PackingFolder, Folder])
def test_files_by_which_a_folder_is_known_are_its_own(folder):
    assert {*KINDS[folder.kind].marks} <= {*folder.files}


@pytest.mark.parametrize("command", INTO)
def test_a_folder_is_refused_before_a_scene_is_made(tmp_path, monkeypatch, command):
    def late(*_):
        raise AssertionError("a scene is made, which may compile for seconds")

    monkeypatch.setattr(SceneSpec, "build", late)
    kind, words = INTO[command]
    scene = tmp_path / "scene.toml"
    scene.write_text('[scene]\nlattice = "fcc"\ncells = 2\npacking_fraction = 0.3\n')
    words = words if command == "code" else [str(scene), *({"plan": ["-t", "Z=0.1"]}.get(command, []))]
    (tmp_path / "plan.json" if kind != "a plan" else tmp_path / "events.h5").write_text("{}")
    assert "already" in refused(command, *words, "--out", tmp_path, cwd=tmp_path)


def test_where_nothing_was_written_yet_the_same_command_is_named(tmp_path):
    said = refused("resume", tmp_path)
    assert "type the command that began there again" in said
    assert "carom run" not in said


def test_every_command_with_a_folder_is_looked_at():
    with_folder = {
        name for name, command in COMMANDS.items()
        if any("older for" in (getattr(each, "help", None) or "") for each in command.params)
    }  # fmt: skip
    assert with_folder - {"measure"} == INTO.keys()  # which writes beside the frames of others


def test_a_folder_with_a_run_and_a_packing_is_not_resumed_as_one_of_them(tmp_path):
    for name in ("checkpoint.h5", "compression.h5"):
        (tmp_path / name).write_text("")
    assert "holds a run (checkpoint.h5) and a packing" in refused("resume", tmp_path)


def test_a_scene_file_of_the_user_is_not_replaced_by_a_run(tmp_path):
    (tmp_path / "scene.toml").write_text("# Mine.\n[scene]\nn = 32\npacking_fraction = 0.1\n")
    for options in ([], ["--overwrite"]):
        said = refused("run", "scene.toml", "--out", ".", *options, cwd=tmp_path)
        assert "written or annotated by somebody" in said


def test_what_somebody_wrote_is_known_by_its_comments(tmp_path):
    path = tmp_path / "study.toml"
    assert not of_the_user(path)
    for text, theirs in [
        (f'{title("carom eos")}\n\n[study]\nn = 3\nname = "a # b \\" # c"\n', False),
        (f"{title('carom eos')}\n\n[study]\nn = 3 # mine\n", True),
        (f"{title('carom eos')}\n# mine\n[study]\nn = 3\n", True),
        ("[study]\nn = 3\n", True),
        ("", True),
    ]:
        path.write_text(text)
        assert of_the_user(path) == theirs, text


def test_a_plan_replaces_a_plan_and_nothing_else(tmp_path):
    PLAN.save(tmp_path)
    PLAN.save(tmp_path)
    for name in ("plan.json", "outcome.json"):
        folder = tmp_path / name[0]
        folder.mkdir()
        (folder / name).write_text('{"mine": 1}')
        with pytest.raises(FileError):
            PLAN.save(folder)
        assert content(folder) == {name: b'{"mine": 1}'}


@pytest.mark.parametrize("inside", ["", "sub"])
@pytest.mark.parametrize(
    "line",
    [
        "run --n 8 --eta 0.1 -c 5 --out", "pack --n 8 --out", "plan Z=0.01 --eta 0.1 --out",
        "measure a.h5md rdf --out",
    ],
)  # fmt: skip
def test_a_folder_that_is_a_link_to_nothing_is_told_before_anything_is_computed(tmp_path, line, inside):
    write(tmp_path / "a.h5md", make_frames(3))
    (tmp_path / "link").symlink_to("gone")
    said = refused(*line.split(), f"link/{inside}", cwd=tmp_path)
    assert "link is a link to gone, which does not exist; create that" in said


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("export a.h5md", "l.extxyz"), ("movie a.h5md", "l.gif"), ("view a.h5md --no-open -o", "l.html"),
        ("init", "l.toml"),
    ],
)  # fmt: skip
def test_a_file_that_is_a_link_to_nothing_is_not_replaced(tmp_path, line, name):
    write(tmp_path / "a.h5md", make_frames(3))
    (tmp_path / name).symlink_to("gone")
    assert "exists already" in refused(*line.split(), name, cwd=tmp_path)
    assert (tmp_path / name).is_symlink()


# Exit codes.

WRONG = {
    "run": ["nowhere.toml"], "resume": ["nowhere"], "pack": ["--n", "1"],
    "info": ["nowhere"], "measure": ["nowhere"],
    "plan": ["-t", "Y=1", "--eta", "0.1"], "eos": ["--eta", "2"], "transport": ["--eta", "2"],
    "shear": ["--eta", "2"], "code": ["1"], "trade": ["--seconds", "0"],
}  # fmt: skip


def test_a_result_under_the_name_of_another_task_is_not_taken(tmp_path):
    folder, tasks = Folder(tmp_path), [{"seed": 1}, {"seed": 2}]
    folder.store({"task": tasks[0], "result": {"Z": 1.5}, "provenance": {}})
    folder.result(tasks[1]).write_bytes(folder.result(tasks[0]).read_bytes())
    assert folder.load(tasks[0])["result"] == {"Z": 1.5}
    assert folder.load(tasks[1]) is None


def test_a_command_that_fails_says_so_in_its_exit_code_with_json_as_well(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert WRONG.keys() == {
        name for name, each in COMMANDS.items() if any("--json" in one.opts for one in each.params)
    }
    for name, words in WRONG.items():
        for options in ([], ["--json"]):
            done = typed(name, *words, *options)
            assert (done.exit_code, done.stdout) == (2, ""), (name, options, done.output)


# Streams.


@pytest.mark.needs("Unix")
@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("--help > /dev/full", 2),
        ("init scene.toml > /dev/full", 2),
        ("init scene.toml 2> /dev/full", 0),
        ("init scene.toml 2>&-", 0),
        ("init scene.toml >&- 2>&- <&-", 0),
        ("measure nowhere.h5md 2> /dev/full", 2),
    ],
)
def test_full_and_closed_streams_are_no_traceback(tmp_path, words, code):
    if "/dev/full" in words:
        skip_without("/dev/full")
    command = " ".join([*CAROM, words])
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == code, done
    assert "Traceback" not in done.stderr
    if code == 2 and "2>" not in words:
        assert done.stderr.startswith("Error: The output cannot be written: No space left on device")
    assert (tmp_path / "scene.toml").exists() == ("init" in words)
