"""Compiled code on disk: used again where nothing has changed, and never where something has."""

import contextlib
import errno
import importlib
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from helpers.scripts import python, run_cell

from carom import arithmetic
from carom.compiling import machine, stored
from carom.compiling.entry import entry

pytestmark = pytest.mark.needs("compiled code")

MODEL = """
import numpy
import gravity
import units.scales
from carom.models.interfaces.obstacle import ObstacleModel
from heights import HEIGHT

class Floor(ObstacleModel):
    x: float
    LIMIT = 1
    LIMITS = numpy.array([0, 1])
    KIND = "hard"

    def by(self, by):
        return 2.0 * by - units.scales.Kind.HARD

    def encounter(self, x, v, radius, growth):
        more = self.by(self.LIMIT + self.LIMITS[0]) * units.scales.LENGTH - 1.0
        if self.KIND == "soft":
            more += 1.0
        return 1.0 * self.x + gravity.fall(x) + HEIGHT + more
"""
GRAVITY = """
import numpy
from carom.compiling.registry import approximate, fast
from strength import pull

TENTH = 0.1

@fast
def fall(x):
    return TENTH * pull(x)
"""
STRENGTH = """
def pull(x):
    return 1.0 * x
"""
HEIGHT = "HEIGHT = float(open('height.txt').read())\n"
PROBE = """
from carom.compiling import machine
from carom.compiling.entry import entry

said, compile_ = [], machine.machine_code
machine.machine_code = lambda text: said.append(text) or compile_(text)

@entry
def probe(obstacle, x):
    return obstacle.encounter(x, 0.0, 0.0, 0.0)

def show(obstacle):
    said.clear()
    time = probe(obstacle, 10.0)
    print("compiled" if said else "loaded", f"{time:.6g}")
"""
PROGRAM = "from probe import show; from floor_model import Floor; show(Floor(2.0))"
FILES = {
    "floor_model.py": MODEL,
    "gravity.py": GRAVITY,
    "strength.py": STRENGTH,
    "heights.py": HEIGHT,
    "height.txt": "0.0",
    "probe.py": PROBE,
    "units/__init__.py": "",
    "units/scales.py": "import enum\nLENGTH = 1.0\nclass Kind(enum.IntEnum):\n    HARD = 1\n",
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "units").mkdir()
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def run(folder, program=PROGRAM):
    """Return what a process of its own says: whether the code was compiled or loaded, and the time."""
    (folder / "program.py").write_text(program)
    return python("-B", "program.py", cwd=folder, NUMBA_CACHE_DIR=str(folder / "cache")).strip()


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def files(folder):
    return [*(folder / "cache").rglob("*.o")]


def test_an_edit_to_a_model_or_to_what_it_uses_is_seen_by_the_next_process(folder):
    assert run(folder) == "compiled 3"
    edit(folder / "floor_model.py", "1.0 * self.x", "2.0 * self.x")
    assert run(folder) == "compiled 5"
    edit(folder / "strength.py", "1.0 * x", "3.0 * x")  # which the model's helper calls
    assert run(folder) == "compiled 7"
    edit(folder / "gravity.py", "import numpy\n", "import numpy  # what counts\n")  # nothing that matters
    assert run(folder, PROGRAM + "; show(Floor(3.0))") == "loaded 7\nloaded 9"
    assert len(files(folder)) == 1  # the new code takes the place of the old


TOLD = (
    "import sys; print(flush=True); from probe import show; from floor_model import Floor; show(Floor(2.0))"
)
HOLDER = """
import filelock, sys, time
lock = filelock.FileLock(sys.argv[1])
lock.acquire()
print(flush=True)
time.sleep(600)
"""


@contextlib.contextmanager
def holding(lock):
    """Let another process hold a lock, as one that compiles."""
    with subprocess.Popen([sys.executable, "-c", HOLDER, str(lock)], stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        try:
            holder.stdout.readline()
            yield holder
        finally:
            holder.kill()


@pytest.mark.parametrize("finished", [True, False])
def test_who_comes_second_waits_and_loads_what_the_first_has_compiled(folder, finished):
    run(folder)
    (kept,), (lock,) = files(folder), folder.rglob("*.lock")
    content = kept.read_bytes()
    kept.unlink()
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
    command = [sys.executable, "-B", "-c", TOLD]
    settings = {"cwd": folder, "env": environment, "stdout": subprocess.PIPE, "text": True}
    with holding(lock) as holder, subprocess.Popen(command, **settings) as process:
        assert process.stdout is not None
        process.stdout.readline()
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(4.0)  # it waits for longer than it takes to compile
        if finished:
            kept.write_bytes(content)
        holder.kill()  # the lock of one that is killed ends with it
        assert process.communicate(timeout=60)[0] == ("loaded 3\n" if finished else "compiled 3\n")


def twice(x):
    return 2.0 * x


@pytest.fixture
def result(tmp_path, monkeypatch):
    """Return a function that says whether code was compiled or loaded, in this process."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    said, compile_ = [], machine.machine_code
    monkeypatch.setattr(machine, "machine_code", lambda text: said.append(text) or compile_(text))

    def asked():
        said.clear()
        assert entry(twice)(1.5) == 3.0
        return "compiled" if said else "loaded"

    return asked


def test_a_compiler_that_has_stopped_keeps_nobody_waiting_for_ever(tmp_path, monkeypatch, result):
    monkeypatch.setattr(stored, "PATIENCE", 0.5)
    assert result() == "compiled"
    (kept,), (lock,) = tmp_path.rglob("*.o"), tmp_path.rglob("*.lock")
    kept.unlink()
    with holding(lock):
        began = time.monotonic()
        assert result() == "compiled"
    assert time.monotonic() - began >= 0.5


def test_code_that_checks_bounds_or_is_for_another_processor_has_files_of_its_own(
    tmp_path, monkeypatch, result
):
    assert result() == "compiled"
    with monkeypatch.context() as other:
        other.setattr("carom.compiling.entry.CHECKED", True)
        assert [result(), result()] == ["compiled", "loaded"]
    with monkeypatch.context() as other:
        other.setattr(machine, "processor", lambda: ("another", ""))
        assert [result(), result()] == ["compiled", "loaded"]
    assert result() == "loaded"
    assert len([*tmp_path.rglob("*.o")]) == 3


def flipped(at):
    """Return a function that changes one byte of a file's content."""
    return lambda content: content[:at] + bytes([content[at] ^ 255]) + content[at + 1 :]


DAMAGES = {
    "cut": lambda content: content[:500],
    "emptied": lambda content: b"",
    "overwritten": lambda content: bytes(len(content)),
    "longer": lambda content: content + b"x",
    "its checksum": flipped(3),
    "its facts": flipped(40),
    "its middle": lambda content: flipped(len(content) // 2)(content),
    "somebody's": lambda content: b"a poem\n",
}


def test_a_damaged_file_is_compiled_again(tmp_path, result):
    # A changed byte in the header of the machine code ended the process that loaded it.
    assert [result(), result()] == ["compiled", "loaded"]
    (kept,) = tmp_path.rglob("*.o")
    whole = kept.read_bytes()
    for name, damage in DAMAGES.items():
        kept.write_bytes(damage(whole))
        assert [result(), result()] == ["compiled", "loaded"], name
    kept.unlink()
    kept.mkdir()  # nothing can be stored there
    assert [result(), result()] == ["compiled", "compiled"]
    assert not [*tmp_path.rglob("*.o.*")]


def test_a_folder_that_is_gone_full_or_no_folder_is_no_reason_to_stop(tmp_path, monkeypatch, result):
    assert result() == "compiled"
    shutil.rmtree(tmp_path / "carom")
    assert result() == "compiled"
    shutil.rmtree(tmp_path / "carom")
    (tmp_path / "carom").write_text("")
    assert [result(), result()] == ["compiled", "compiled"]
    (tmp_path / "carom").unlink()

    def full(path, content):
        Path.open(path, "wb").close()
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as drive:
        drive.setattr(Path, "write_bytes", full)
        assert [result(), result()] == ["compiled", "compiled"]
    assert [*tmp_path.rglob("*.o*")] == []


@pytest.mark.needs("a user who is not root")
def test_a_folder_that_cannot_be_written_is_no_reason_to_stop(tmp_path, result):
    (tmp_path / "carom").mkdir(mode=0o500)
    assert [result(), result()] == ["compiled", "compiled"]


def test_where_nothing_can_be_written_beside_carom_it_is_in_the_user_s_folder(tmp_path, monkeypatch, result):
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    beside, home = stored.folders()
    assert home == tmp_path / "home" / "carom"
    assert beside.name == "compiled"
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(stored, "folders", lambda: [tmp_path / "file" / "compiled", home])
    assert [result(), result()] == ["compiled", "loaded"]
    assert len([*home.glob("*.o")]) == 1


@pytest.fixture
def importing(folder, monkeypatch):
    """Return a function that imports a module of the folder, all of whose files are read anew."""
    monkeypatch.syspath_prepend(folder)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def forget():
        for name in ("units", "units.scales", *(path.stem for path in folder.glob("*.py"))):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()

    def module(name):
        forget()
        return importlib.import_module(name)

    yield module
    forget()


@pytest.fixture
def digest(importing):
    """Return a function that gives the digest of a floor, or None where what is called was not followed."""

    def of_floor():
        walk, floor = stored.Walk(), importing("floor_model").Floor
        walk.visit_classes([floor])
        return walk.found.hexdigest() if floor.encounter in walk.functions else None

    return of_floor


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("floor_model.py", "1.0 * self.x", "2.0 * self.x"),  # the model
        ("floor_model.py", "x: float\n", "x: float = 1.0\n"),  # a default
        ("gravity.py", "TENTH * pull(x)", "TENTH + pull(x)"),  # a function that it calls
        ("gravity.py", "@fast", "@approximate"),  # how that is compiled
        ("gravity.py", "@fast\n", ""),
        ("gravity.py", "TENTH = 0.1", "TENTH = 0.2"),  # a number that it reads
        ("gravity.py", "TENTH = 0.1", "TENTH = numpy.array([0.1])"),
        ("strength.py", "1.0 * x", "3.0 * x"),  # a function that this calls, in a third file
        ("strength.py", "(x)", "(x, y=1.0)"),
        ("height.txt", "0.0", "0.5"),  # a number that no source holds
        ("floor_model.py", "LIMIT = 1", "LIMIT = 2"),  # one of the class
        ("floor_model.py", "array([0, 1])", "array([1, 0])"),
        ("floor_model.py", '"hard"', '"soft"'),
        ("floor_model.py", "2.0 * by", "3.0 * by"),  # a method that it calls
        ("units/scales.py", "LENGTH = 1.0", "LENGTH = 2.0"),  # one of a module in a module
        ("units/scales.py", "HARD = 1", "HARD = 3"),  # one of an enumeration
    ],
)
def test_what_a_model_is_made_of_has_another_digest_after_an_edit(folder, digest, file, old, new):
    before = digest()
    assert before is not None
    assert digest() == before
    edit(folder / file, old, new)
    assert digest() not in (before, None)


def test_what_a_model_calls_in_a_room_of_carom_counts_with_it(monkeypatch):
    def walked(function):
        stored.sources.cache_clear()
        walk = stored.Walk()
        walk.visit(function)
        return walk.found.hexdigest()

    with_power, without, read = lambda x: arithmetic.power(x, 2), lambda x: np.sum(x), Path.read_bytes
    before, edited = [walked(with_power), walked(without)], Path(arithmetic.__file__)
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + b"#" * (path == edited))
    assert walked(with_power) != before[0]
    assert walked(without) == before[1]
    stored.sources.cache_clear()


FALLS = "def fall(x):\n    return 0.1 * x\n"


@pytest.mark.parametrize(
    "helper",
    [
        f"import numba\n@numba.njit\n{FALLS}",  # compiled by rules that are elsewhere
        f"import functools\n@functools.cache\n{FALLS}",
        "import ctypes, math\nfall = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(math.sqrt)\n",
        "class fall:\n    def __init__(self, x):\n        pass\n",
    ],
)
def test_what_cannot_be_followed_has_no_digest(folder, digest, helper):
    (folder / "gravity.py").write_text(helper)
    assert digest() is None


def test_a_function_that_numba_compiles_is_seen_after_an_edit(folder):
    (folder / "strength.py").write_text("import numba\n@numba.njit\ndef pull(x):\n    return 1.0 * x\n")
    assert [run(folder), run(folder)] == ["compiled 3", "compiled 3"]
    edit(folder / "strength.py", "1.0 * x", "3.0 * x")
    assert run(folder) == "compiled 5"
    assert not files(folder)


def test_a_model_of_the_script_itself_is_known_by_what_is_in_it(folder):
    text = "from probe import show\n" + MODEL
    assert run(folder, text + "\nshow(Floor(2.0))") == "compiled 3"
    assert run(folder, text.replace("1.0 *", "7.0 *") + "\nshow(Floor(2.0))") == "compiled 15"
    assert run(folder, text + "\nshow(Floor(2.0))") == "compiled 3"


def test_models_of_one_name_in_two_files_do_not_take_each_others_code(folder):
    (folder / "another.py").write_text(MODEL.replace("1.0 *", "5.0 *"))
    both = PROGRAM + "; from another import Floor; show(Floor(2.0))"
    assert run(folder, both) == "compiled 3\ncompiled 11"
    assert run(folder, both) == "loaded 3\nloaded 11"


def test_a_plain_scene_imports_nobodys_model(folder):
    run(folder)
    (folder / "floor_model.py").write_text("raise SystemExit('imported')")
    plane = "from carom.models.obstacles.planes import HalfSpace"
    plain = f"from probe import show; {plane}; show(HalfSpace((1.0,), 0.0))"
    edit(folder / "probe.py", "x, 0.0, 0.0, 0.0)", "(x,), (-1.0,), 0.0, 0.0)")
    assert run(folder, plain) == "compiled 10"
    assert run(folder, plain) == "loaded 10"


def _climb(steps, x):
    return steps[0].encounter(x, 0.0, 0.0, 0.0)


CELL = """
from typing import NamedTuple
from carom.models.interfaces.obstacle import ObstacleModel

class Part(NamedTuple):
    size: float

class Step(ObstacleModel):
    part: Part

    def encounter(self, x, v, radius, growth):
        return HEIGHT * self.part.size
"""


@pytest.mark.parametrize("nested", [False, True])
def test_classes_of_one_name_have_code_of_their_own(nested):
    # As a notebook cell that is edited and run again: the fields and the names of the classes are the same.
    climb, steps = entry(_climb), []
    for height in (1.0, 2.0, 3.0):
        cell = {"HEIGHT": height, "__name__": "cell"}
        run_cell(CELL, f"<cell of height {height}>", cell)
        step = cell["Step"](cell["Part"](5.0))
        steps.append(((step,),) if nested else (step,))
    climbs = [climb(step[0] if nested else step, 0.0) for step in (*steps, *steps[::-1])]
    assert climbs == [5.0, 10.0, 15.0, 15.0, 10.0, 5.0]


def test_a_module_that_is_loaded_again_has_code_of_its_own(folder, importing):
    climb, floor = entry(_climb), importing("floor_model")
    before = floor.Floor(2.0)
    assert climb((before,), 10.0) == 3.0
    edit(folder / "floor_model.py", "1.0 * self.x", "5.0 * self.x")
    importlib.invalidate_caches()
    after = importlib.reload(floor).Floor(2.0)
    assert [climb((each,), 10.0) for each in (after, before)] == [11.0, 3.0]


GOES_ON = """
import sys
from carom import Scene, Simulation
scene = Scene.crystal(cells=3, packing_fraction=0.3)
sim = Simulation(scene, seed=1) if sys.argv[1] == "new" else Simulation.load("c.h5")
sim.run(collisions=100)
sim.save("c.h5")
"""


@pytest.mark.slow
def test_a_resumed_run_uses_the_code_of_the_run_and_so_does_the_next(tmp_path):
    found = []
    for what in ("new", "resumed", "new"):
        python("-c", GOES_ON, what, cwd=tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
        found.append({(path.name, path.stat().st_mtime_ns) for path in files(tmp_path)})
    assert {name.partition("-")[0] for name, _ in found[0]} == {"run", "schedule"}
    assert found[0] == found[1] == found[2]
