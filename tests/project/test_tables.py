"""Tables of other programs' rates and of published pressures are those of the stored results."""

import json
import re
from pathlib import Path

import pytest
from helpers.pages import ROOT
from helpers.scripts import module_of

import carom

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
costs = module_of(BENCHMARKS / "costs.py")
peers = module_of(BENCHMARKS / "peers.py")
pressures = module_of(BENCHMARKS / "pressures.py")
with_table = module_of(BENCHMARKS / "pages.py").with_table
STORED = json.loads(peers.STORED.read_text())
PAGE = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")


def sections(text):
    """Return what stands below each heading, without what is below one of a lower level."""
    parts = re.split(r"^#+ (.+)\n", text, flags=re.M)[1:]
    return dict(zip(parts[::2], parts[1::2], strict=True))


def table(heading):
    """Return the rows of the first table below a heading of the page, by their first cell."""
    lines = re.search(r"(^\|.*\n)+", sections(PAGE)[heading], re.M)[0].splitlines()[2:]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return {first: rest for first, *rest in rows}


def test_the_front_page_has_the_table_of_the_stored_results():
    text = peers.PAGE.read_text(encoding="utf-8")
    assert text.count("<!-- peers: ") == text.count("<!-- end of peers -->") == 1
    assert with_table(text, "peers", peers.table(STORED)) == text


def test_the_page_has_the_stored_pressures_and_they_agree_with_what_is_published():
    found = json.loads(pressures.STORED.read_text())
    text = (pressures.ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert text.count("<!-- pressures: ") == text.count("<!-- end of pressures -->") == 1
    assert with_table(text, "pressures", pressures.table(found)) == text
    assert [row["eta"] for row in found["rows"] if row["infinite"]] == [
        eta for d in (3, 2) for eta in pressures.ETAS[d]
    ]
    assert [row["N"] for row in found["rows"] if not row["infinite"]] == [n for n, *_ in pressures.PUBLISHED]
    for row in found["rows"]:
        assert row["error"] < 1.3 * row["promised"], row
        assert row["promised"] < 1.001 * pressures.ERRORS[row["d"]] * row["Z"], row
        assert abs(pressures.deviation(row)) < 3.0, row


def test_another_result_is_another_page():
    marks = "<!-- peers: written by tests/benchmarks/peers.py -->", "<!-- end of peers -->"
    page = "before\n{}\nold\n{}\nafter\n".format(*marks)
    found = {**STORED[0], "ratio": 9.87, "date": "2026-01-02", "processor": "abacus", "remark": ""}
    text = with_table(page, "peers", peers.table([found]))
    assert "9.87" in text
    assert "2026-01-02, abacus." in text
    assert "old" not in text
    assert text.startswith("before\n")
    assert text.endswith("\nafter\n")


def test_disks_are_written_as_spheres_in_a_plane_and_diameters_as_two_kinds(tmp_path):
    disks = carom.Scene([(0.5, 0.5), (2.0, 1.5)], (4.0, 4.0), diameter=[1.0, 0.5])
    peers.write_sph(disks, tmp_path / "start.sph")
    number, box, *lines = tmp_path.joinpath("start.sph").read_text().splitlines()
    assert number == "2"
    assert [float(edge) for edge in box.split()] == [4.0, 4.0, peers.PLANE]
    assert [line.split()[0] for line in lines] == ["a", "b"]
    assert [[float(x) for x in line.split()[1:]] for line in lines] == [
        [0.5, 0.5, 0.5 * peers.PLANE, 0.5],
        [2.0, 1.5, 0.5 * peers.PLANE, 0.25],
    ]


@pytest.mark.usefixtures("unscheduled")
def test_the_page_has_the_bytes_of_every_feature(tmp_path):
    shown = {name: float(cells[-1]) for name, cells in table("Features").items()}
    for name, (scene, settings) in costs.scenes().items():
        if settings.pop("event_log", False):
            settings["event_log"] = tmp_path / "events.h5"
        if "observers" in settings:  # their sums are made when a run begins
            continue
        sim = carom.Simulation(scene, seed=1, **settings)
        # Lists grow a little in a run.
        assert costs.size_of(sim) == pytest.approx(shown.pop(name), rel=0.05), name
        sim.close()
    assert set(shown) == {"currents of momentum and heat", "free flights and returns"}


def test_the_page_has_what_is_published_of_wells():
    wells = module_of(ROOT / "tests" / "validation" / "test_wells_published.py")
    published = list(table("Wells compared with DynamO").values())
    diffusion = {"D": wells.THIN.values["D"]}, {"D": wells.MIXTURE.values["D_B"]}
    for column, state, last in zip((0, 2), (wells.THIN, wells.MIXTURE), diffusion, strict=True):
        values = {**state.values, **last}
        for cells, key in zip(published, ("kT", "U", "P", "time", "core", "D"), strict=True):
            digits = len(cells[column].partition(".")[2])
            assert cells[column] == f"{values[key]:.{digits}f}", key


def test_every_table_has_its_command_below_the_same_heading():
    made = sections((ROOT / "docs" / "benchmarking.md").read_text(encoding="utf-8"))
    for heading, text in sections(PAGE).items():
        if "\n|" in text:
            assert "```bash" in made["Rate and memory" if heading == "Features" else heading], heading
