"""The kernel as it is built: with and without compilation, with bounds checks, vectorized, never stale."""

import shutil
from pathlib import Path

import numba
import numpy as np
import pytest
from helpers.scripts import python
from helpers.tiny import run_tiny
from numba.core import event

import carom
from carom.compiling import dispatch, registry, simd
from carom.engine.state import row_type


class Names(event.Listener):
    """The functions that are compiled, in their order."""

    def __init__(self):
        self.compiled = []

    def on_start(self, begun):
        self.compiled.append(begun.data["dispatcher"].py_func.__name__)

    def on_end(self, ended):
        pass


@pytest.mark.slow
def test_plain_python_gives_the_same_bits():
    assert run_tiny(NUMBA_DISABLE_JIT="1") == run_tiny()


@pytest.mark.slow
def test_no_index_is_out_of_bounds(tmp_path):
    # Bounds checks are no part of the cache's key.
    checked = run_tiny(NUMBA_BOUNDSCHECK="1", NUMBA_CACHE_DIR=str(tmp_path))
    assert checked == run_tiny()


@pytest.mark.slow
def test_an_edited_kernel_is_compiled_anew(tmp_path):
    source = tmp_path / "src"
    shutil.copytree(
        Path(carom.__file__).parent, source / "carom", ignore=shutil.ignore_patterns("__pycache__")
    )
    settings = {"source": source, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    first = run_tiny(**settings)
    assert first == run_tiny()
    pair = source / "carom" / "models" / "interactions" / "hard_cores.py"
    text = pair.read_text()
    # A little too elastic: half of the impulse would leave pairs at rest at contact, and the run never ends.
    edited = text.replace("    factor = rv / rr\n", "    factor = 1.0000001 * rv / rr\n")
    assert edited != text
    pair.write_text(edited)  # a module that the entry points only call into
    assert run_tiny(**settings) != first


def test_room_on_the_stack_is_that_of_the_function_that_asks_for_it():
    # In a function of its own, which is inlined, its life would end before it is used.
    def asks(rows):
        return len(simd.candidate_block(rows)[0])

    names = Names()
    with event.install_listener("numba:compile", names):
        assert numba.njit(**dispatch.ENTRY)(asks)(np.zeros(3, row_type(3)).view(np.recarray)) == 8
    assert names.compiled == ["asks"]


def test_an_inlined_function_is_compiled_once_for_all_its_callers():
    @registry.inner
    def half(x):
        return 0.5 * x

    @registry.inner
    def quarter(x):
        return half(half(x))

    @numba.njit(**dispatch.ENTRY)
    def both(x):
        return half(x) + quarter(x)

    names = Names()
    with event.install_listener("numba:compile", names):
        assert both(4.0) == 3.0
    assert sorted(names.compiled) == ["both", "half", "quarter"]


@pytest.mark.needs("an x86-64 processor")
@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize("kind", ["lists", "sectors"])
def test_the_search_for_a_partner_is_vectorized(kind):
    from carom.compiling.borrowed import borrowed
    from carom.engine import cycle

    sim = carom.Simulation(
        carom.Scene.crystal(cells=5, packing_fraction=0.3), seed=1, tuning=carom.Tuning(neighbors=kind)
    )
    engine = sim._state.engine

    @numba.njit(**dispatch.STRICT)
    def search(model, state, neighbors, i, now):
        model, state, neighbors = borrowed(model), borrowed(state), borrowed(neighbors)
        return cycle.search(model, state, neighbors, i, now, 0, cycle.NO_REF)

    search.compile(tuple(map(numba.typeof, (engine.model, engine.state, engine.neighbors, 0, 0.0))))
    (listing,) = search.inspect_asm().values()
    for instruction in ("sqrtpd", "divpd"):  # packed doubles: a scalar one ends in sd
        lines = [line for line in listing.splitlines() if instruction in line]
        assert lines, f"no {instruction}: the loop over candidates is not vectorized"


def test_a_cache_that_names_a_vanished_model_is_compiled_anew(tmp_path):
    # As after an upgrade that renamed a model, or without the module of somebody's own obstacle.
    (tmp_path / "doubling.py").write_text(
        "from carom.compiling.dispatch import entry\n@entry\ndef double(model):\n    return 2.0 * model[0]\n"
    )
    models = tmp_path / "models.py"
    own = "from typing import NamedTuple\nclass Own(NamedTuple):\n    x: float\n"
    plain = "from doubling import double; print(double((1.5,)))"
    for content, program, expected in (
        (own, "from doubling import double; from models import Own; print(double(Own(1.0)))", "2.0"),
        ("", plain, "3.0"),
        (own, "from doubling import double; from models import Own; print(double(Own(2.0)))", "4.0"),
        (None, plain, "3.0"),
    ):
        models.unlink(missing_ok=True)
        if content is not None:
            models.write_text(content)
        said = python("-B", "-c", program, cwd=tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
        assert said.strip() == expected
    # Files are named after what is in them: processes that save at the same time do not mix them up.
    assert len(list((tmp_path / "cache").rglob("*.nbc"))) == 2
