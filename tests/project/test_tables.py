"""Tables of other programs' rates and of published pressures are those of the stored results."""

import json
from pathlib import Path

from helpers.scripts import module_of

import carom

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
peers = module_of(BENCHMARKS / "peers.py")
pressures = module_of(BENCHMARKS / "pressures.py")
with_table = module_of(BENCHMARKS / "pages.py").with_table
STORED = json.loads(peers.STORED.read_text())


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
