"""Every result prints, draws itself, and goes to tables and files and back."""

import dataclasses
import json
import math
import sys
import warnings

import numpy as np
import pytest
from helpers.drawn import strange_bars
from helpers.frames import at_rest
from helpers.plain import uncompiled

import carom
from carom import results
from carom.errors import CaromError, FileError, InputError
from carom.observables import Estimate


@pytest.fixture(scope="module")
def found():
    species = [carom.Species("a", count=10), carom.Species("b", count=6, diameter=0.5, mass=0.25)]
    scene = carom.Scene.random(species=species, dimension=2, packing_fraction=0.2, seed=1)
    with uncompiled(), warnings.catch_warnings():
        warnings.simplefilter("ignore", carom.CaromWarning)
        return carom.Simulation(scene, seed=1).measure(
            carom.Pressure(), carom.PressureTensor(), carom.Energy(), carom.RDF(rmax=2.0, pair=("a", "b")),
            carom.StructureFactor(shells=6), carom.Dynamics(shells=2), carom.BondOrder(rmax=2.0),
            carom.DensityProfile(bins=8), carom.FreeFlights(), carom.PressureProfile(axis=1, bins=8),
            time=20.0, blocks=64,
        )  # fmt: skip


@pytest.fixture(scope="module")
def walls():
    with uncompiled():
        sim = carom.Simulation(carom.Scene.random(6, 0.3, 2, seed=1, walls=True), seed=1)
        return sim.measure(carom.WallPressure(), time=20.0, blocks=32)


@pytest.fixture(scope="module")
def others():
    """Results of a box whose volume changes, of one whose shear oscillates, and of a crystal."""
    barostat, flow = carom.Barostat(1.0, interval=0.2, step=0.4), carom.models.Shear(0.5, period=1.0)
    fluid = carom.Scene.random(6, 0.2, 2, seed=1)
    with uncompiled(), warnings.catch_warnings():
        warnings.simplefilter("ignore", carom.CaromWarning)
        sim = carom.Simulation(fluid, seed=1, barostat=barostat)
        sheared = carom.Simulation(fluid.replace(motion=flow), seed=1)
        return [
            sim.measure(carom.Volume(), time=20.0, blocks=32),
            sheared.measure(carom.observables.ShearModuli(), time=4.0, blocks=64),
            carom.observables.Crystallinity().over(
                [at_rest(carom.Scene.crystal(108, 0.6), t) for t in range(3)]
            ),
        ]


KINDS = (
    "PressureResult", "PressureTensorResult", "EnergyResult", "RDFResult", "StructureFactorResult",
    "DynamicsResult", "BondOrderResult", "DensityProfileResult", "FreeFlightsResult",
    "PressureProfileResult", "WallPressureResult", "VolumeResult", "ShearModuliResult", "CrystallinityResult",
)  # fmt: skip


def fitted_line(found):
    times = np.linspace(found.fit_first, found.fit_last)
    return times, 4 * found.diffusion.mean * times + found.fit_offset


def middles(found):
    """Return the middle of each bin, from its ends."""
    return (found.edges[1:] + found.edges[:-1]) / 2


def flights_lines(found):
    for k, each in enumerate(found.free_time):
        seen, rate = each.density > 0.0, found.collision_rate[k]
        times = middles(each)[seen]
        yield times, each.density[seen]
        yield times, rate * np.exp(-rate * times)


def running_lines(found):
    """Return each block over the middle of its time, and their mean up to the end of each."""
    durations, values = np.array(found.block_durations), np.array(found.block_values)
    ends = np.cumsum(durations)
    return [(ends - durations / 2, values), (ends, np.cumsum(durations * values) / ends)]


LINES = {
    **dict.fromkeys(("PressureResult", "WallPressureResult", "VolumeResult"), running_lines),
    "StructureFactorResult": lambda found: [(found.k, found.S)],
    "DynamicsResult": lambda found: [
        (found.times, found.mean_square),
        # That of one component of v; then the line whose slope gives D.
        (found.times, 2 * found.velocity_square.mean * found.times**2),
        fitted_line(found),
    ],
    "BondOrderResult": lambda found: [
        np.array((middles(found), found.correlation))[:, np.isfinite(found.correlation)]
    ],
    "FreeFlightsResult": lambda found: list(flights_lines(found)),
    "PressureProfileResult": lambda found: [(middles(found), found.tensor[:, a, a]) for a in (1, 0)],
    "CrystallinityResult": lambda found: [(found.times, [108] * 3)] * 2,
}
"""Numbers of the lines of each picture in the plane, in order."""


@pytest.mark.parametrize("k", range(len(KINDS)), ids=KINDS)
class TestEveryResult:
    @pytest.fixture
    def result(self, found, walls, others, k):
        return (*found, walls, *others)[k]

    def test_comes_back_from_files_as_it_was(self, result, k, tmp_path):
        assert type(result).__name__ == KINDS[k]
        for suffix in (".json", ".npz"):
            result.save(tmp_path / f"result{suffix}")
            again = results.loaded(tmp_path / f"result{suffix}")
            assert type(again) is type(result)
            assert again == result
            assert str(again) == str(result)
        assert results.from_dict(result.to_dict()) == result

    def test_prints_three_lines_at_most_and_a_short_table(self, result, k):
        assert 1 <= len(str(result).splitlines()) <= 3
        assert "\n" not in str(result) or len(str(result)) < 300
        html = result._repr_html_()
        assert html.startswith("<table")
        assert len(html) < 3000
        assert len(repr(result)) < 20000

    def test_is_a_table_with_all_digits(self, result, k, tmp_path):
        table = result.to_dataframe()
        result.save(tmp_path / "result.csv")
        lines = [line for line in (tmp_path / "result.csv").read_text().splitlines() if line[0] != "#"]
        header = lines[0].split(",")
        assert set(header) <= set(table.columns)
        assert len(lines) == len(table) + 1
        for name, text in zip(header, lines[1].split(","), strict=True):
            if isinstance(table[name][0], float):
                assert (float(text) == table[name][0]) if math.isfinite(table[name][0]) else text == ""

    def test_draws_the_error_of_each_number_beside_it(self, result, k):
        if KINDS[k] in ("EnergyResult", "CrystallinityResult"):  # nothing is drawn, or a number of each frame
            return
        (axes,) = result.plot().axes
        if KINDS[k] in ("PressureResult", "WallPressureResult", "VolumeResult"):
            # The band is that of the mean up to there.
            assert len(strange_bars(axes, result)[1]) == (len(result.block_values) - 1) * (k == 0)
            return
        if KINDS[k] == "PressureProfileResult":
            curves = axes.get_legend_handles_labels()[1]
            assert {"$P_{xx}$", "$P_{yy}$"} <= set(curves), "axes are called x, y, z"
        if KINDS[k] == "PressureTensorResult":
            assert axes.get_xticklabels()[0].get_text() == "xx"
        count, strange = strange_bars(axes, result)
        assert not strange
        assert count >= (2 if KINDS[k] == "ShearModuliResult" else 3)

    def test_draws_lines_through_its_numbers(self, result, k):
        if KINDS[k] not in LINES:
            return
        (axes,) = result.plot().axes
        right = LINES[KINDS[k]](result)
        curves = [line for line in axes.lines if len(line.get_xdata()) > 2]
        assert len(curves) == len(right)
        for line, (x, y) in zip(curves, right, strict=True):
            np.testing.assert_allclose(line.get_xdata(), x, rtol=1e-12)
            np.testing.assert_allclose(line.get_ydata(), y, rtol=1e-12)

    def test_draws_itself(self, result, k, tmp_path):
        if KINDS[k] == "EnergyResult":
            with pytest.raises(InputError, match="nothing to draw"):
                result.save(tmp_path / "picture.png")
            return
        figure = result.plot(tmp_path / "picture.svg")
        drawn = (tmp_path / "picture.svg").read_text(encoding="utf-8")
        assert "<text" in drawn  # lines and words, not pixels or outlines of letters
        assert "<image" not in drawn
        theory = {"DynamicsResult": "free flight", "FreeFlightsResult": "without memory"}
        assert theory.get(KINDS[k], "") in drawn
        result.save(tmp_path / "picture.png")
        assert (tmp_path / "picture.png").stat().st_size > 1000
        assert figure.axes[0].get_xlabel()
        assert figure.axes[0].get_ylabel()


def test_keys_are_those_of_the_attributes(found, tmp_path):
    pressure = found[0].to_dict()
    assert pressure["kind"] == "PressureResult"
    assert pressure["Z"] == found[0].Z.mean
    assert pressure["Z_error"] == found[0].Z.error
    assert {"pressure", "reduced_pressure", "contact_value", "collision_rate", "kT", "n"} <= pressure.keys()
    assert {"U", "U_error", "kinetic", "total"} <= found[2].to_dict().keys()
    assert found[3].to_dict()["g"] == found[3].g.tolist()
    found[3].save(tmp_path / "g.csv")
    assert "# pair: 0 1\n" in (tmp_path / "g.csv").read_text()


def test_a_saved_result_is_strict_json(found, tmp_path):
    found[0].save(tmp_path / "z.json")  # a mixture has no contact value

    def refuse(name):
        raise ValueError(name)

    values = json.loads((tmp_path / "z.json").read_text(), parse_constant=refuse)
    assert values["contact_value"] == "nan"
    assert values["contact_value_error"] == "inf"
    assert math.isnan(results.loaded(tmp_path / "z.json").contact_value.mean)


def test_results_that_differ_are_not_equal(found):
    first = found[0].to_dict()
    assert results.from_dict({**first, "Z": first["Z"] + 1e-12}) != found[0]
    assert found[0] != found[1]
    assert found[0] != 1


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.csv", "r,g\n", "is a table"),
        ("a.json", "[1]", "holds no result"),
        ("a.json", '{"kind": "os.system"}', "No kind of result"),
        ("a.json", '{"kind": "EnergyResult"}', "lacks 'U'"),
        ("a.json", "{", "holds no result"),
        ("a.npz", "PK", "holds no result"),
        ("missing.json", None, "cannot be read"),
    ],
)
def test_what_is_no_result_is_not_loaded(name, text, says, tmp_path):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(FileError, match=says):
        results.loaded(tmp_path / name)


@pytest.mark.parametrize(
    ("k", "key", "value"),
    [
        (0, "Z", "x"), (0, "Z_error", -1.0), (0, "Z_n_eff", None), (0, "Z_blocks", 2.5), (0, "n", True),
        (0, "packing_fraction", []), (0, "note", 5), (0, "kind", ["PressureResult"]),
        (3, "edges", "x"), (3, "g", [1.0]), (3, "g", ["a", "b"]), (3, "pair", [0.5, 1]),
        (7, "density", {}),
        (8, "free_time", [1.0]), (8, "collision_rate", [[1.0], [2.0]]), (8, "normal_speed", {"a-b": None}),
    ],
)  # fmt: skip
def test_a_saved_result_that_was_changed_is_refused(found, tmp_path, k, key, value):
    path = tmp_path / "a.json"
    path.write_text(json.dumps(found[k].to_dict() | {key: value}))
    with pytest.raises(CaromError):
        carom.load(path)


def test_a_note_from_a_file_is_text_in_a_notebook(found, tmp_path):
    found[0].save(tmp_path / "z.json")
    words = json.loads((tmp_path / "z.json").read_text())
    (tmp_path / "z.json").write_text(json.dumps({**words, "note": "<img src=x>"}))
    page = carom.load(tmp_path / "z.json")._repr_html_()
    assert "&lt;img src=x&gt;" in page
    assert "<img" not in page


def test_files_that_cannot_be_written_are_said(found, tmp_path):
    for result in (found[0], found[3]):
        with pytest.raises(InputError, match=r"\.json, \.csv, \.npz, \.png, \.pdf, \.svg"):
            result.save(tmp_path / "a.txt")
        for suffix in (".json", ".csv", ".npz", ".png"):
            with pytest.raises(FileError, match="cannot be written"):
                result.save(tmp_path / "missing" / f"a{suffix}")


def test_without_pandas_a_table_is_a_sentence(found, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="pip install pandas"):
        found[0].to_dataframe()


def test_a_result_of_estimates_alone_has_a_default_text():
    @dataclasses.dataclass(frozen=True, eq=False, repr=False)
    class HeightResult(results.Result):
        height: Estimate

        def _rows(self):
            return "Height", [("h [length]", self.height.value_text)]

    found = HeightResult(Estimate(1.0, 0.1, 10.0, 1.0, 10))
    assert str(found) == "Height: h [length] = 1.00 +- 0.10"
    assert repr(found) == "<HeightResult: Height: h [length] = 1.00 +- 0.10>"
    assert results.from_dict(found.to_dict()) == found
    with pytest.raises(InputError, match="no picture of a HeightResult"):
        found.plot()
    with pytest.raises(TypeError):
        hash(found)
    assert np.isfinite(found._columns()["height"][0])
