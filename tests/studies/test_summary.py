"""The summary of a run: its declaration is what is written, what is read, and what the docs list."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.screens import NOTHING, found, summary

from carom.declared import fields_of
from carom.errors import InputError
from carom.observables import Estimate
from carom.studies.runs.summary import Summary, Theory

PAGE = Path(__file__).parents[2] / "docs" / "layouts.md"


def rows():
    """Return the lines of the table of the docs."""
    for name, field in fields_of(Summary).items():
        words, _, unit = field.opt.help.removesuffix("]").partition(" [")
        yield f"| `{name}` | {unit} | {words} |"


def test_the_docs_list_the_keys_in_their_order_with_units_and_words():
    assert "\n".join(["| key | unit | content |", "|---|---|---|", *rows(), "\n"]) in PAGE.read_text()


def test_what_is_written_is_read_as_the_same():
    whole = found(
        U=NOTHING | {"mean": 1.5, "error": 0.1, "n_eff": 3.0},
        theory=[{"name": "CS", "Z": 1.4, "Z_infinite": None, "contact_value": 1.1, "errors": 2.0}],
        barostat={"pressure": 1.0, "interval": 0.2, "step": None, "seed": 1, "tried": 9, "accepted": 3},
        layers=[{"low": 0.0, "high": 1.0, "members": 2.0, "kT": NOTHING}],
        swaps={"tried": 4, "accepted": 1},
        contact_values_from_rdf={"a-b": NOTHING | {"mean": 2.0}},
    )
    held = whole.to_dict()
    assert list(held) == list(fields_of(Summary))
    assert held["U"] == {"mean": 1.5, "error": 0.1, "n_eff": 3.0}
    assert held["temperature"] == held["layers"][0]["kT"] == NOTHING
    assert held["contact_values_from_rdf"]["a-b"] == NOTHING | {"mean": 2.0}
    assert Summary.of(held).to_dict() == held


def test_a_number_that_is_not_finite_is_null_and_a_theory_without_errors_has_no_key_for_them():
    held = found().to_dict()
    assert held["Z"] == {"mean": 2.0, "error": 0.01, "n_eff": None}
    exact = Summary(**{**vars(found()), "Z": Estimate.exact(1.0), "theory": [Theory("CS", 1.0, None, 1.0)]})
    assert exact.to_dict()["Z"] == {"mean": 1.0, "error": 0.0, "n_eff": None}
    assert exact.to_dict()["theory"] == [{"name": "CS", "Z": 1.0, "Z_infinite": None, "contact_value": 1.0}]


def test_a_summary_of_an_older_version_lacks_later_keys():
    old = {name: value for name, value in found().to_dict().items() if fields_of(Summary)[name].needed}
    assert old.keys() == summary().keys() - {"system"}
    read = Summary.of({**old, "retired": 1})
    assert (read.system, read.thermal, read.layers) == ("particles", True, ())
    assert read.U is read.barostat is None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"layers": "three"}, "layers must be a list"),
        ({"weight": "heavy"}, "weight must be a number"),
        ({"thermal": 1}, "thermal must be true or false"),
        ({"swaps": {"tried": 1}}, "swaps has no accepted"),
        ({"obstacles": [{"name": "wall", "force": NOTHING}]}, r"obstacles\[0\] has no pressure"),
        ({"barostat": {"pressure": 1.0}}, "barostat has no interval"),
    ],
)
def test_every_value_that_is_shown_is_checked(change, said):
    with pytest.raises(InputError, match=said):
        Summary.of({**found().to_dict(), **change})
