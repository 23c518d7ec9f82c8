"""The tutorial notebook: its cells run in turn, and what it shows was made by them."""

import json
from pathlib import Path

import pytest
from helpers.scripts import python

NOTEBOOK = Path(__file__).parents[2] / "docs" / "tutorial.ipynb"
CELLS = [c for c in json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"] if c["cell_type"] == "code"]


def printed(cell):
    return "".join("".join(out["text"]) for out in cell["outputs"] if out["output_type"] == "stream")


@pytest.mark.ci
def test_the_cells_run_in_turn_and_print_what_the_notebook_shows(tmp_path):
    # A line that begins with % is a word for the notebook alone.
    code = [
        "".join(line for line in cell["source"] if not line.startswith("%")) + '\nprint("end of cell")'
        for cell in CELLS
    ]
    script = tmp_path / "tutorial.py"
    script.write_text("\n".join(code), encoding="utf-8")
    # The same seed gives the same bits: the numbers are those of the notebook.
    found = [part.strip() for part in python(script, cwd=tmp_path, MPLBACKEND="Agg").split("end of cell\n")]
    assert found[:-1] == [printed(cell).strip() for cell in CELLS]


def test_the_notebook_shows_pictures_and_no_error():
    outputs = [out for cell in CELLS for out in cell["outputs"]]
    assert all(out["output_type"] != "error" for out in outputs)
    assert sum("image/png" in out.get("data", {}) for out in outputs) == 3


def test_the_notebook_shows_the_columns_that_it_explains():
    (shown,) = (printed(cell) for cell in CELLS if "print(study)" in "".join(cell["source"]))
    assert all(column in shown.splitlines()[1] for column in ("infinite", "dev."))
