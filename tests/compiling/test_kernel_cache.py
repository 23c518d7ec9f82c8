"""Compiled code on disk: used again where nothing has changed, and never where something has."""

import contextlib
import importlib
import os
import shutil
import subprocess
import sys
import time
from typing import NamedTuple

import numba
import pytest
from carom.compiling.code_digest import digest_of
from carom.compiling.compile_listeners import listening
from carom.compiling.dispatch import entry
from numba import types

from carom.compiling import cache
from carom.jit import compiled, compiled_on_call
from carom.models.questions.obstacle import encounter

MODEL = """
from typing import NamedTuple

import gravity
from carom.models.questions.obstacle import encounter
from heights import HEIGHT

class Floor(NamedTuple):
    x: float

@encounter.register
def _(obstacle: Floor, x, v, radius, growth):
    return 1.0 * obstacle.x + gravity.fall(x) + HEIGHT
"""
GRAVITY = """
import numba
import numpy
from carom.compiling.registry import fast, inner
from strength import pull

TENTH = 0.1

@inner
def fall(x):
    return TENTH * pull(x)
"""
STRENGTH = """
import numba

@numba.njit
def pull(x):
    return 1.0 * x
"""
HEIGHT = "HEIGHT = float(open('height.txt').read())\n"
PROBE = """
from carom.compiling.dispatch import entry
from carom.compiling.compile_listeners import listening
from carom.models.questions.obstacle import encounter

@entry
def probe(obstacle, x):
    return encounter(obstacle, x, 0.0, 0.0, 0.0)

def show(obstacle):
    said = []
    with listening(said.append):
        time = probe(obstacle, 10.0)
    print("compiled" if said else "loaded", f"{time:.6g}")
"""
PROGRAM = "from probe import show; from floor_model import Floor; show(Floor(2.0))"


@pytest.fixture
def folder(tmp_path):
    for name, text in (
        ("floor_model.py", MODEL),
        ("gravity.py", GRAVITY),
        ("strength.py", STRENGTH),
        ("heights.py", HEIGHT),
        ("height.txt", "0.0"),
        ("probe.py", PROBE),
    ):
        (tmp_path / name).write_text(text)
    return tmp_path


def cached(folder):
    """Return the environment of processes that keep their code there."""
    return {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}


def run(folder, program=PROGRAM):
    """Return what a process of its own says: whether the code was compiled or loaded, and the time."""
    (folder / "program.py").write_text(program)
    command = [sys.executable, "-B", "program.py"]
    done = subprocess.run(
        command, cwd=folder, env=cached(folder), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_an_edit_to_a_model_or_to_what_it_uses_is_seen_by_the_next_process(folder):
    assert run(folder) == "compiled 3"
    edit(folder / "floor_model.py", "1.0 * obstacle.x", "2.0 * obstacle.x")
    assert run(folder) == "compiled 5"
    edit(folder / "strength.py", "1.0 * x", "3.0 * x")  # which the model's helper calls
    assert run(folder) == "compiled 7"
    edit(folder / "gravity.py", "import numba\n", "import numba  # what compiles\n")  # nothing that matters
    assert run(folder, PROGRAM + "; show(Floor(3.0))") == "loaded 7\nloaded 9"
    # The new code takes the place of the old.
    assert len(list((folder / "cache").rglob("*.nbc"))) == 1


def test_what_is_compiled_already_is_loaded_without_what_compiles(folder):
    """Numba's implementations of Python's types are imported once something is compiled after all."""
    program = (
        "import sys; from probe import show; from floor_model import Floor; import numba\n"
        "show(Floor(2.0)); print('numba.typed.typedlist' in sys.modules, numba.njit(lambda x: [x, x])(1))"
    )
    assert run(folder, program) == "compiled 3\nTrue [1, 1]"
    assert run(folder, program) == "loaded 3\nFalse [1, 1]"


TOLD = """
from carom.compiling.compile_listeners import listening
with listening(lambda news: print(news, flush=True)):
    from probe import probe
    from floor_model import Floor
    print(probe(Floor(2.0), 10.0))
"""
HOLDER = """
import filelock, sys, time
lock = filelock.FileLock(sys.argv[1])
lock.acquire()
print(flush=True)
time.sleep(600)
"""


@contextlib.contextmanager
def busy(folder):
    """Let another process hold the lock of the only code that is kept, which is gone."""
    run(folder)
    (kept,), (lock,) = folder.rglob("*.nbc"), folder.rglob("*.lock")
    content = kept.read_bytes()
    kept.unlink()
    with subprocess.Popen([sys.executable, "-c", HOLDER, str(lock)], stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        try:
            holder.stdout.readline()
            yield holder, lambda: kept.write_bytes(content)
        finally:
            holder.kill()


@contextlib.contextmanager
def telling(folder):
    """Let a process compile, or load, and say what it does."""
    command, said = [sys.executable, "-B", "-c", TOLD], subprocess.PIPE
    with subprocess.Popen(command, cwd=folder, env=cached(folder), stdout=said, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "Waiting for another process, which compiles probe (Floor).\n"
        yield process


def test_who_comes_second_waits_and_loads_what_the_first_has_compiled(folder):
    with busy(folder) as (holder, compile_), telling(folder) as process:
        compile_()
        holder.kill()
        assert process.communicate(timeout=60)[0] == "3.0\n"


def test_a_killed_compiler_keeps_nobody_waiting(folder):
    with busy(folder) as (holder, _), telling(folder) as process:
        holder.kill()
        said = process.communicate(timeout=60)[0].splitlines()
        # Of what it calls, nothing is told.
        assert [line for line in said if line] == [
            "Compiling probe (Floor), which is new here: ten seconds or more.",
            "3.0",
        ]


def test_a_compiler_that_has_stopped_keeps_nobody_waiting_for_ever(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(cache, "PATIENCE", 0.5)
    assert entry(twice)(1.5) == 3.0
    (kept,), (lock,) = tmp_path.rglob("*.nbc"), tmp_path.rglob("*.lock")
    kept.unlink()
    said, times = [], []
    with subprocess.Popen([sys.executable, "-c", HOLDER, str(lock)], stdout=subprocess.PIPE) as holder:
        assert holder.stdout is not None
        holder.stdout.readline()
        with listening(said.append), listening(lambda _: times.append(time.monotonic())):
            assert entry(twice)(1.5) == 3.0
        holder.kill()
    assert said == [
        "Waiting for another process, which compiles twice.",
        "Compiling twice, which is new here: ten seconds or more.",
    ]
    assert times[1] - times[0] >= 0.5


def test_code_that_checks_bounds_has_files_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    for checked in (None, 1):
        monkeypatch.setattr(cache.config, "BOUNDSCHECK", checked)
        assert entry(twice)(1.5) == 3.0
    assert len([*tmp_path.rglob("*.nbc")]) == 2


def test_it_is_told_how_long_the_last_one_took(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    entry(twice)(1.5)
    said = []
    with listening(said.append):
        entry(twice)(1)
    assert said == ["Compiling twice, which is new here: it took 0 s the last time."]


@pytest.fixture
def importing(folder, monkeypatch):
    """Return a function that imports a module of the folder, all of whose files are read anew."""
    monkeypatch.syspath_prepend(folder)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def forget():
        for path in folder.glob("*.py"):
            sys.modules.pop(path.stem, None)
        importlib.invalidate_caches()

    def module(name):
        forget()
        return importlib.import_module(name)

    yield module
    forget()


@pytest.fixture
def digest(importing):
    """Return a function that gives the digest of what a floor is made of."""

    def of_floor():
        floor = importing("floor_model").Floor
        return digest_of(encounter, (types.NamedTuple((types.float64,), floor),))

    return of_floor


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("floor_model.py", "1.0 * obstacle.x", "2.0 * obstacle.x"),  # the model
        ("floor_model.py", "x: float\n", "x: float = 1.0\n"),  # a default
        ("gravity.py", "TENTH * pull(x)", "TENTH + pull(x)"),  # a function that it calls
        ("gravity.py", "@inner", "@fast"),  # how that is compiled
        ("gravity.py", "TENTH = 0.1", "TENTH = 0.2"),  # a number that it reads
        ("gravity.py", "TENTH = 0.1", "TENTH = numpy.array([0.1])"),
        ("strength.py", "1.0 * x", "3.0 * x"),  # a function that this calls, in a third file
        ("strength.py", "numba.njit\n", "numba.njit(fastmath=True)\n"),
        ("height.txt", "0.0", "0.5"),  # a number that no source holds
    ],
)
def test_what_a_model_is_made_of_has_another_digest_after_an_edit(folder, digest, file, old, new):
    before = digest()
    assert before is not None
    assert digest() == before
    edit(folder / file, old, new)
    assert digest() not in (before, None)


@pytest.mark.parametrize(
    "helper",
    [
        # Compiled by a rule that is elsewhere.
        "from numba.extending import register_jitable\n@register_jitable\ndef fall(x):\n    return 0.1 * x\n",
        # Code that is made while it is compiled.
        "from numba.extending import intrinsic\n@intrinsic\ndef fall(context, x):\n"
        "    return x(x), lambda context, builder, signature, args: args[0]\n",
        # Code in another language.
        "import ctypes, math\nfall = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(math.sqrt)\n",
        # A class that other processes do not find.
        "from numba.experimental import jitclass\n@jitclass([])\nclass fall:\n"
        "    def __init__(self):\n        pass\n",
    ],
)
def test_what_cannot_be_followed_has_no_digest(folder, digest, helper):
    (folder / "gravity.py").write_text(helper)
    assert digest() is None


def test_a_model_without_a_digest_is_compiled_in_every_process(folder):
    # A class of the script itself is another one in every process.
    assert run(folder, "from probe import show\n" + MODEL + "\nshow(Floor(2.0))") == "compiled 3"
    edited = MODEL.replace("1.0 *", "7.0 *")
    assert run(folder, "from probe import show\n" + edited + "\nshow(Floor(2.0))") == "compiled 15"
    assert not list((folder / "cache").rglob("*.nbc"))


def test_what_a_scene_lacks_does_not_keep_its_code_from_the_disk():
    assert (
        digest_of(numba.njit(lambda model: model), (types.none, types.Tuple((types.none, types.float64))))
        is not None
    )


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


def flipped(at):
    """Return a function that changes one byte of a file's content."""
    return lambda content: content[:at] + bytes([content[at] ^ 255]) + content[at + 1 :]


def twice(x):
    return 2.0 * x


DAMAGES = {
    "cut": lambda content: content[:1000],
    "emptied": lambda content: b"",
    "overwritten": lambda content: bytes(len(content)),
    "longer": lambda content: content + b"x",
    "its checksum": flipped(3),
    "its header": flipped(100),
    "its middle": lambda content: flipped(len(content) // 2)(content),
}


MAKERS = {
    "an entry point": lambda: entry(twice),
    "a function of one signature": lambda: compiled(twice, types.float64(types.float64)),
    "a function of any": lambda: compiled_on_call(twice),
}


@pytest.mark.parametrize("maker", MAKERS)
def test_a_damaged_file_is_compiled_again(tmp_path, monkeypatch, maker):
    # A changed byte in the header of the machine code ended the process that loaded it.
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    def result():
        said = []
        with listening(said.append):
            assert MAKERS[maker]()(1.5) == 3.0
        return "compiled" if said else "loaded"

    assert [result(), result()] == ["compiled", "loaded"]
    (kept,) = tmp_path.rglob("*.nbc")
    whole = kept.read_bytes()
    for name, damage in DAMAGES.items():
        kept.write_bytes(damage(whole))
        assert [result(), result()] == ["compiled", "loaded"], name
    kept.unlink()
    kept.mkdir()  # nothing can be stored there
    assert [result(), result()] == ["compiled", "compiled"]


def test_a_cache_folder_that_is_gone_is_no_reason_to_stop(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    double = entry(twice)
    double(1)
    shutil.rmtree(tmp_path / "cache")
    (tmp_path / "cache").write_text("")
    assert double(1.5) == 3.0


def test_a_helper_is_compiled_anew_after_an_edit_to_its_file(folder):
    text = "import numba\nfrom carom.jit import compiled\ndef twice(x):\n    return 2.0 * x\n"
    (folder / "helper.py").write_text(text + "print(compiled(twice, numba.f8(numba.f8))(1.5))\n")
    assert run(folder, "import helper") == "3.0"
    edit(folder / "helper.py", "2.0 * x", "40.0 * x")
    assert run(folder, "import helper") == "60.0"


def _climb(steps, x):
    return encounter(steps[0], x, 0.0, 0.0, 0.0)


CELL = """
class Part(NamedTuple):
    size: float

class Step(NamedTuple):
    part: Part

@encounter.register
def _(obstacle: Step, x, v, radius, growth):
    return HEIGHT * obstacle.part.size
"""


@pytest.mark.parametrize("nested", [False, True])
def test_classes_of_one_name_have_code_of_their_own(nested):
    # As a notebook cell that is edited and run again: what Numba sees of both classes is the same.
    climb, steps = entry(_climb), []
    for height in (1.0, 2.0, 3.0):
        cell = {"NamedTuple": NamedTuple, "encounter": encounter, "HEIGHT": height, "__name__": "cell"}
        exec(CELL, cell)
        step = cell["Step"](cell["Part"](5.0))
        steps.append(((step,),) if nested else (step,))
    climbs = [climb(step[0] if nested else step, 0.0) for step in (*steps, *steps[::-1])]
    assert climbs == [5.0, 10.0, 15.0, 15.0, 10.0, 5.0]


def test_a_module_that_is_loaded_again_has_code_of_its_own(folder, importing):
    climb, floor = entry(_climb), importing("floor_model")
    before = floor.Floor(2.0)
    assert climb((before,), 10.0) == 3.0
    edit(folder / "floor_model.py", "1.0 * obstacle.x", "5.0 * obstacle.x")
    importlib.invalidate_caches()
    after = importlib.reload(floor).Floor(2.0)
    assert [climb((each,), 10.0) for each in (after, before)] == [11.0, 3.0]


def test_a_class_that_no_module_knows_is_not_taken_for_one_that_is():
    # Code that is executed without the name of a module makes classes of the module "builtins".
    cell = {"NamedTuple": NamedTuple}
    exec("class Pair(NamedTuple):\n    first: float\n    second: int\n", cell)
    assert cell["Pair"].__module__ == "builtins"
    kinds = (types.NamedTuple((types.float64, types.int64), cell["Pair"]),)
    assert digest_of(encounter, kinds) is None


def test_a_function_that_is_compiled_cannot_be_replaced():
    # As in a notebook, where the cell of the function is run again, and that of the class is not.
    class Step(NamedTuple):
        x: float

    @encounter.register
    def _(obstacle: Step, x, v, radius, growth):
        return 1.0 * obstacle.x

    @encounter.register
    def _(obstacle: Step, x, v, radius, growth):  # nobody has asked yet
        return 2.0 * obstacle.x

    assert entry(lambda step: encounter(step, 0.0, 0.0, 0.0, 0.0))(Step(3.0)) == 6.0
    with pytest.raises(RuntimeError, match=r"encounter is compiled for Step: .* Define Step anew"):

        @encounter.register
        def _(obstacle: Step, x, v, radius, growth):
            return 4.0 * obstacle.x

    with pytest.raises(RuntimeError, match="encounter is compiled for Step"):
        encounter.register(Step)(lambda *args: 5.0)
    assert encounter(Step(3.0), 0.0, 0.0, 0.0, 0.0) == 6.0


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
        words = [sys.executable, "-c", GOES_ON, what]
        subprocess.run(words, cwd=tmp_path, check=True, env=cached(tmp_path))
        found.append(
            {(path.name, path.stat().st_mtime_ns) for path in (tmp_path / "cache").rglob("cycle.*.nbc")}
        )
    assert len(found[0]) == 2, "the cycle and the schedule"
    assert found[0] == found[1] == found[2]
