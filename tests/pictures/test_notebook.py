"""Notebooks: plots, bars and tables appear by themselves, and frames go to other programs in one word."""

import dataclasses

import numpy as np
import pytest
from helpers.frames import frames_of, write

import carom
import carom.io
from carom import notebook
from carom.bridges.converters import to_xarray
from carom.errors import InputError
from carom.observables import Estimate
from carom.table import in_html

MADE = (
    "import numpy as np, carom\n"
    "from carom import notebook\n"
    "frame = carom.Frame(0.0, 0, np.random.default_rng(1).random((5, 3)) * 9, np.ones((5, 3)), (9, 9, 9),\n"
    "                    np.ones(5), np.ones(5))\n"
    "with notebook.bar('Working') as shown:\n"
    "    for k in range(101):\n"
    "        shown(k / 100)",
    "carom.Block(1.0, 2000, 3.5)",
    "from carom.pictures import plots; plots.snapshot(frame)",
    "frame",
)

RUN = (
    "import carom\n"
    "sim = carom.Simulation(carom.Scene.crystal(cells=2, packing_fraction=0.3), seed=1)\n"
    "sim.run(collisions=2000, progress=True)",
    "sim.measure(carom.Pressure(), collisions=3000, progress=True, blocks=16)",
    "sim.statistics",
    "sim.run(time=0.3, every=0.1, call=carom.Live());",
)


def executed(cells):
    """Return what each cell shows, run headless by a kernel of its own."""
    import nbclient
    import nbformat

    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    nbclient.NotebookClient(book, timeout=600, kernel_name="python3").execute()
    return [[output.get("data", {}) for output in cell.outputs] for cell in book.cells]


def test_a_notebook_shows_bars_tables_plots_and_frames_without_a_magic_word():
    bar, block, plot, frame = executed(MADE)
    assert "<progress" in bar[0]["text/html"]
    assert "100 %" in bar[0]["text/html"]  # the bar's last state, in the place of its first
    assert "2000" in block[-1]["text/html"]
    assert len(plot[-1]["image/png"]) > 10_000
    assert "srcdoc=" in frame[-1]["text/html"]


def test_an_error_in_a_notebook_is_one_line_without_lines_of_the_source(capsys):
    from IPython.core.interactiveshell import InteractiveShell

    InteractiveShell().run_cell("import carom\ncarom.Scene.random(8, eta=0.3)")
    said = "Scene.random has no keyword 'eta'; it is called packing_fraction."
    assert capsys.readouterr().out.splitlines() == [f"InputError: {said}"]


@pytest.mark.slow
def test_a_run_in_a_notebook_shows_its_bar_and_results_as_tables():
    run, pressure, statistics, live = executed(RUN)
    assert len(live) == 1  # updated in its place
    assert "data:image/png;base64," in live[0]["text/html"]
    assert "kT" in live[0]["text/html"]
    assert "100 %" in run[0]["text/html"]
    assert "2000" in run[-1]["text/html"]
    assert "Z = PV / NkT" in pressure[-1]["text/html"]
    assert "energy drift" in statistics[-1]["text/html"]


def test_a_frame_prints_in_ten_lines_and_its_box_is_an_array():
    frame = frames_of(3)[0]
    for text in (str(frame), repr(frame)):
        assert len(text.splitlines()) <= 10
        assert "small 4, big 3" in text
        assert "walls" in text
    assert isinstance(frame.box, np.ndarray)
    np.testing.assert_array_equal(frame.box / 2.0, [edge / 2.0 for edge in frame.box])
    with pytest.raises(ValueError, match="read-only"):
        frame.box[0] = 1.0


@pytest.mark.parametrize("dimension", [2, 3])
def test_freud_gets_box_dimension_walls_and_centered_positions(dimension):
    frame = frames_of(dimension)[0]
    box, points = frame.to_freud()
    assert box.dimensions == dimension
    assert list(box.periodic) == [*frame.periodic, *[False] * (3 - dimension)]
    np.testing.assert_allclose(box.L[:dimension], frame.box, rtol=1e-6)
    np.testing.assert_allclose(points[:, :dimension], frame.positions - frame.box / 2, atol=1e-6)


def test_pandas_and_xarray_hold_a_frame_and_a_trajectory(tmp_path):
    import pandas
    import xarray

    frames = frames_of(2)
    table = frames[0].to_pandas()
    assert isinstance(table, pandas.DataFrame)
    assert list(table) == ["x", "y", "vx", "vy", "diameter", "mass", "species"]
    np.testing.assert_array_equal(table["y"], frames[0].positions[:, 1])
    assert table["species"].tolist() == [("small", "big")[kind] for kind in frames[0].species]
    write(tmp_path / "a.h5md", frames)
    with carom.io.open(tmp_path / "a.h5md") as reader:
        data = reader.to_xarray()
    assert isinstance(data, xarray.Dataset)
    np.testing.assert_array_equal(data.time, [frame.time for frame in frames])
    np.testing.assert_array_equal(data.unwrapped.isel(time=2), frames[2].unwrapped)
    small = data.positions.sel(axis="x")[:, (data.species == "small").values]
    assert small.shape == (3, int((frames[0].species == 0).sum()))
    assert frames[0].to_xarray().positions.shape == frames[0].positions.shape


def test_xarray_has_each_field_of_each_frame():
    frames = [
        dataclasses.replace(frame, diameters=frame.diameters * (k + 1), box=frame.box + k)
        for k, frame in enumerate(frames_of(2))
    ]
    data = to_xarray(frames)
    for name in ("time", "step", "positions", "velocities", "diameters", "box", "unwrapped"):
        np.testing.assert_array_equal(data[name], [getattr(frame, name) for frame in frames])
    np.testing.assert_array_equal(data.masses, frames[0].masses)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_each_column_of_a_table_is_the_axis_that_it_names(d):
    rng = np.random.default_rng(d)
    turns = {2: ["w"], 3: ["wx", "wy", "wz"]}.get(d, [])
    spins = rng.normal(size=(5, len(turns))) if turns else None
    places, speeds = rng.random((2, 5, d))
    frame = carom.Frame(0.0, 0, places, speeds, (9.0,) * d, np.ones(5), np.ones(5), spins=spins)
    axes = ["x", "y", "z"][:d] if d < 4 else ["x0", "x1", "x2", "x3"]
    columns = np.column_stack([places, speeds, *([] if spins is None else [spins])])
    table = frame.to_pandas()
    assert list(table)[:-2] == [*axes, *(f"v{axis}" for axis in axes), *turns]
    np.testing.assert_array_equal(table.to_numpy()[:, :-2], columns)


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "freud", None)
    with pytest.raises(InputError, match=r"pip install 'carom\[freud\]'"):
        frames_of(3)[0].to_freud()


def test_tables_escape_what_they_show():
    assert "&lt;b&gt;" in in_html("<b>", [("a", "<c>")])
    assert "10.012 ± 0.003" in Estimate(10.0123, 0.0031, 100.0, 1.0, 64)._repr_html_()


def test_progress_true_shows_a_bar_and_false_none(capsys):
    @notebook.watchable("Working")
    def work(progress=None):
        if progress is not None:
            progress(0.5)
        return progress is not None

    assert work() is False
    assert work(progress=False) is False
    assert work(progress=True) is True
    seen = []
    assert work(progress=seen.append) is True
    assert seen == [0.5]


@pytest.mark.usefixtures("plain")
def test_live_numbers_are_those_of_the_run_now():
    sim, live = carom.Simulation(carom.Scene.random(20, 0.3, 2), seed=1), carom.Live()
    shown = []
    sim.run(time=1.0, every=0.5, call=[live, lambda sim: shown.append(live.html(sim))])
    assert len(shown) == 2
    assert f"<td>{sim.collisions}</td>" in shown[-1]
    assert "data:image/png;base64," in shown[-1]
    assert "img" not in carom.Live(picture=False).html(sim)
