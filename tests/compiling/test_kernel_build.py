"""The kernel as it is built: without compilation, with bounds checks, vectorized, on any processor."""

import ast
import importlib
import shutil
import types
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from helpers.scripts import python
from helpers.tiny import run_tiny

import carom
from carom.compiling import machine, source, stored
from carom.compiling.entry import Translated, entry
from carom.compiling.registry import cold
from carom.engine import cycle
from carom.models import Gravity, SquareWell
from carom.models.interfaces.observer import ObserverModel
from carom.observables import pressure_profile

PACKAGE = Path(carom.__file__).parent


@pytest.mark.slow
def test_plain_python_gives_the_same_bits():
    assert run_tiny(NUMBA_DISABLE_JIT="1") == run_tiny()


@pytest.mark.slow
def test_no_index_is_out_of_bounds(tmp_path):
    assert run_tiny(NUMBA_BOUNDSCHECK="1", NUMBA_CACHE_DIR=str(tmp_path)) == run_tiny()


@pytest.mark.slow
@pytest.mark.needs("an x86-64 processor")
@pytest.mark.parametrize("name", ["haswell", "nehalem"])  # AVX2, and registers of two doubles
def test_other_processors_give_the_same_bits(name, tmp_path):
    assert run_tiny(NUMBA_CPU_NAME=name, NUMBA_CACHE_DIR=str(tmp_path)) == run_tiny()


CHECKED = """
import numpy as np
from carom.compiling.entry import entry

def element(table, i, j):
    return table[i, j]

asked = entry(element)
print(asked(np.arange(6.0).reshape(2, 3), 1, -1))
for i, j in ((2, 0), (0, 3), (0, -4)):
    try:
        print(asked(np.zeros((2, 3)), i, j))
    except IndexError as error:
        print(error)
"""


def test_an_index_out_of_bounds_is_an_error_where_indices_are_checked(tmp_path):
    (tmp_path / "checked.py").write_text(CHECKED)
    said = python("checked.py", cwd=tmp_path, NUMBA_BOUNDSCHECK="1", NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert said.splitlines() == [
        "5.0",
        "index 2 of an array of 2",
        "index 3 of an array of 3",
        "index -1 of an array of 3",  # counted from the beginning
    ]


@pytest.mark.slow
def test_an_edited_kernel_is_compiled_anew(tmp_path):
    folder = tmp_path / "src"
    shutil.copytree(PACKAGE, folder / "carom", ignore=shutil.ignore_patterns("__pycache__"))
    settings = {"source": folder, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    first = run_tiny(**settings)
    assert first == run_tiny()
    pair = folder / "carom" / "models" / "interactions" / "hard_cores.py"
    text = pair.read_text()
    # A little too elastic: half of the impulse would leave pairs at rest at contact, and the run never ends.
    edited = text.replace("    factor = rv / rr\n", "    factor = 1.0000001 * rv / rr\n")
    assert edited != text
    pair.write_text(edited)  # a module that the entry points only call into
    assert run_tiny(**settings) != first


FLUID = carom.Scene.crystal(cells=2, packing_fraction=0.3)
DISKS = carom.Scene.random(12, 0.3, 2, walls="y", obstacles=[carom.models.Ball((1.0, 3.0), 0.3)], seed=1)
SCENES = {
    "fluid": (FLUID, "lists"),
    "well": (FLUID.replace(interaction=SquareWell(1.5, 1.0)), "lists"),
    "disks": (DISKS, "sectors"),
    "falling": (DISKS.replace(motion=Gravity((0.0, -1.0))), "sectors"),
    "gas": (carom.Scene.random(64, dimension=3, packing_fraction=1e-6, seed=1), "all"),
}


def engine_of(name):
    scene, neighbors = SCENES[name]
    return carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors=neighbors))._state.engine


@cache
def imported(module):
    """Return where the names of a module come from that it imports from this package."""
    tree = ast.parse((PACKAGE / Path(*module.split(".")[1:])).with_suffix(".py").read_text(encoding="utf-8"))
    found = [node for node in tree.body if isinstance(node, ast.ImportFrom) and node.module]
    return {alias.asname or alias.name: node.module for node in found for alias in node.names}


def rooms_of(function):
    """Return the rooms of a function, and of what it names."""
    found = {function.__module__.split(".")[1]}
    for used in function.__code__.co_names:
        value, place = function.__globals__.get(used), imported(function.__module__).get(used, "")
        if not isinstance(value, types.ModuleType | type) and place.startswith("carom."):
            found.add(place.split(".")[1])
    return found


@pytest.mark.parametrize("name", SCENES)
def test_all_that_is_compiled_lies_where_the_sources_count(unscheduled, name, monkeypatch):
    monkeypatch.setattr(source, "_plans", {})
    Translated(cycle.run.__wrapped__, (*engine_of(name), 0, 0.0, 1, 1), "run")
    functions = [each for each in source._plans if each.__module__.startswith("carom.")]
    assert len(functions) > 50
    for function in functions:
        assert rooms_of(function) <= {*stored.ROOMS}, function


def entries():
    """Yield the module and the name of all entry points."""
    for path in sorted(PACKAGE.rglob("*.py")):
        if "\n@entry\n" in (text := path.read_text(encoding="utf-8")):
            module = ".".join(("carom", *path.relative_to(PACKAGE).with_suffix("").parts))
            for node in ast.parse(text).body:
                if any(getattr(each, "id", "") == "entry" for each in getattr(node, "decorator_list", ())):
                    yield module, node.name


@pytest.mark.parametrize(("module", "name"), [*entries()])
def test_an_entry_point_is_compiled_anew_when_its_file_was_edited(module, name, monkeypatch):
    function = getattr(importlib.import_module(module), name).__wrapped__
    assert rooms_of(function) <= {*stored.ROOMS, module.split(".")[1]}
    edited, read = Path(function.__code__.co_filename), Path.read_bytes

    def file():
        stored.sources.cache_clear()
        return stored.Shelf(function, [], [], False).file

    try:
        before = file()
        monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + b"#" * (path == edited))
        assert file() != before
    finally:
        stored.sources.cache_clear()


def test_what_observes_for_a_measure_lies_where_the_sources_count():
    observers = [each for each in ObserverModel.__subclasses__() if each.__module__.startswith("carom.")]
    assert pressure_profile.LayerFlux in observers
    for each in observers:
        assert each.__module__.split(".")[1] in stored.ROOMS, each


@pytest.mark.needs("an x86-64 processor")
@pytest.mark.parametrize("name", ["fluid", "disks"])
def test_the_search_for_a_partner_is_vectorized(unscheduled, name):
    def search(model, state, neighbors, i, now):
        return neighbors.earliest_partner(model, state, i, now, 0, cycle.NO_REF)

    engine = engine_of(name)
    translated = Translated(search, (engine.model, engine.state, engine.neighbors, 0, 0.0), "search")
    listing = machine.assembly(translated.text).splitlines()
    for instruction in ("sqrtpd", "divpd"):  # packed doubles: a scalar one ends in sd
        assert any(instruction in line for line in listing), f"no {instruction}: it is not vectorized"


def test_a_loop_whose_rounds_depend_on_each_other_is_not_called_vectorized():
    def roots(values):
        for k in range(1, len(values)):
            values[k] = np.sqrt(values[k] + values[k - 1])
        return values[-1]

    listing = machine.assembly(Translated(roots, (np.ones(9),), "roots").text)
    assert "sqrtsd" in listing
    assert "sqrtpd" not in listing


def test_private_parts_of_numba_are_used_nowhere_and_llvmlite_in_two_files():
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert not name.startswith("numba."), path
                if name.partition(".")[0] == "llvmlite":
                    assert path.relative_to(PACKAGE).as_posix() in (
                        "compiling/machine.py",
                        "compiling/stored.py",
                    )


def test_what_an_entry_point_is_given_may_be_of_any_kind():
    def taken(numbers, arrays, nothing):
        whole, real, flag = numbers
        return (arrays[0][whole] + real, flag, nothing is None, len(arrays)), whole

    asked = entry(taken)
    for whole in (1, np.int64(1), np.uint64(1), np.int8(1)):
        for real in (0.5, np.float64(0.5), np.float32(0.5)):
            numbers = whole, real, np.bool_(True)
            assert asked(numbers, (np.arange(3.0),), None) == ((1.5, True, True, 1), 1)
    with pytest.raises(ValueError, match="must be contiguous"):
        asked((1, 0.5, True), (np.arange(6.0)[::2],), None)


@cold
def doubled(values, k):
    values[k] += values[k]
    return values[k]


def test_an_array_may_have_each_element_on_a_line_of_its_own():
    """Partners and times of leaving do, at the ends of rows of the plane."""

    def changed(values, others):
        values[:] = 3.0
        values[1] = others[1] + len(values)
        return doubled(values, 1), doubled(others, 2)

    room = np.zeros((4, 8))
    others = np.arange(4.0)
    assert entry(changed)(room[:, 6], others) == (10.0, 4.0)
    np.testing.assert_array_equal(room[:, 6], [3.0, 10.0, 3.0, 3.0])
    assert room[:, :6].sum() == room[:, 7].sum() == 0.0
    assert others.tolist() == [0.0, 1.0, 4.0, 3.0]
