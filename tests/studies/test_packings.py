"""Packings of several seeds in one study: the bits of single packings, means, folder, resume, command."""

import math
import signal

import numpy as np
import pytest
from helpers.commands import in_this_process, refused, typed

import carom
from carom.errors import InputError
from carom.studies import Packings, PackSpec
from carom.studies.folder import Folder
from carom.studies.packings.compression import Compression
from carom.studies.signals import Interrupted

SMALL = {"dimension": 2, "rate": 0.1, "until_Z": 1e6}
OPTIONS = ("--n", "40", "-d", "2", "--rate", "0.1", "--until-Z", "1e6")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Three packings of forty disks, in a folder."""
    out = tmp_path_factory.mktemp("packings") / "several"
    return carom.packings(40, seeds=3, executor="serial", out=out, **SMALL)


def test_what_a_packing_costs_is_said_before_it_starts(study):
    found = [packing.collisions for packing in study.packings]
    assert study.cost(study.tasks[0]) == pytest.approx(np.mean(found), rel=0.2)
    assert study.first == "the first packings, of about 6.4e+03 collisions each"
    assert study.cost({**study.tasks[0], "collisions": 500}) == 500


def test_each_packing_is_that_of_its_seed(study):
    assert [packing.seed for packing in study.packings] == [1, 2, 3]
    for packing in study.packings:
        assert packing == carom.pack(40, seed=packing.seed, **SMALL)
    assert study.packings[0] != study.packings[1]


def test_means_have_the_standard_error_of_independent_packings(study):
    values = [packing.jamming_fraction for packing in study.packings]
    mean, error = study.mean("jamming_fraction")
    assert mean == pytest.approx(np.mean(values))
    assert error == pytest.approx(math.sqrt(np.var(values, ddof=1) / 3))
    assert study.to_dict()["jamming_fraction"] == mean
    assert "over 3 packings" in str(study)
    one = carom.packings(40, seeds=1, executor="serial", out=study.folder, **SMALL)
    assert math.isnan(one.mean("jamming_fraction")[1])
    assert one.to_dict()["jamming_fraction_error"] is None
    with pytest.raises(InputError, match="no numbers 'note'"):
        study.mean("note")


def test_packings_whose_value_is_unknown_count_in_no_mean_and_no_error(study):
    unknown = {**study.records[1], "result": dict(study.records[1]["result"], jamming_fraction=None)}
    some = Packings(study.spec, (study.records[0], unknown, study.records[2]))
    a, b = (study.packings[k].jamming_fraction for k in (0, 2))
    assert some.mean("jamming_fraction") == pytest.approx((0.5 * (a + b), 0.5 * abs(a - b)), rel=1e-12)
    assert some.mean("packing_fraction") == study.mean("packing_fraction")
    assert len(next(line for line in some.plot().axes[0].lines if line.get_marker() == "o").get_xdata()) == 2


def test_numbers_of_contacts_that_are_not_clear_are_not_told(study):
    """Such a fast compression leaves no void between the gaps of contacts and the others."""
    assert all(packing.network.note for packing in study.packings)
    assert [(row.contacts, row.excess) for row in study.table] == 3 * [(None, None)]
    assert "unclear: no void" in str(study.table)
    slow = dict(study.records[0]["result"], contacts_note="", contacts=60, excess=-1)
    clear = Packings(study.spec, ({**study.records[0], "result": slow},))
    assert [(row.contacts, row.excess) for row in clear.table] == [(60, -1)]
    assert "unclear" not in str(clear.table)
    some = Packings(study.spec, (*clear.records, *study.records[1:]))
    assert [row.excess for row in some.table] == [-1, None, None]
    assert "unclear: no void" in str(some.table)


def test_how_packings_ended_is_below_the_table(study):
    other = {**study.records[1], "result": {**study.records[1]["result"], "note": "the box is full"}}
    mixed = Packings(study.spec, (study.records[0], other, study.records[2]))
    assert mixed.table.notes[2:] == [
        "Ended: Z = PV/NkT = 1e+06 reached (seeds 1, 3).", "Ended: the box is full (seeds 2).",
    ]  # fmt: skip
    assert study.table.notes[2:] == ["Ended: Z = PV/NkT = 1e+06 reached."]


def test_the_picture_has_a_point_for_each_seed(study):
    (axes,) = study.plot().axes
    points = next(line for line in axes.lines if line.get_marker() == "o")
    assert list(points.get_ydata()) == [1, 2, 3]
    assert list(points.get_xdata()) == [packing.jamming_fraction for packing in study.packings]
    mean, error = study.mean("jamming_fraction")
    (span,) = axes.patches
    ends = span.get_x(), span.get_x() + span.get_width()
    assert ends == pytest.approx((mean - error, mean + error), rel=1e-12)


def test_ctrl_c_inside_a_packing_loses_nothing(study, tmp_path, monkeypatch):
    part, parts = Compression._part, []

    def impatient(self):
        parts.append(self.seed)
        if parts.count(2) == 10 and len(parts) == parts.count(1) + 10:
            signal.raise_signal(signal.SIGINT)
        part(self)

    monkeypatch.setattr(Compression, "_part", impatient)
    out = tmp_path / "several"
    with pytest.raises(Interrupted, match="1 of 3 packings are done") as stopped:
        carom.packings(40, seeds=3, executor="serial", out=out, **SMALL)
    assert stopped.value.so_far.packings == study.packings[:1]
    assert [path.suffix for path in sorted((out / "tasks").iterdir())].count(".h5") == 1
    begun = len(parts)
    again = Packings.load(out).run(out=out, executor="serial")
    assert again.packings == study.packings
    assert not list((out / "tasks").glob("*.h5"))
    assert parts[begun:].count(2) == len(study.packings[1].history) - 10


def test_remnants_of_states_are_swept(study):
    left = study.folder / "tasks" / f".{Folder(study.folder).kept(study.tasks[0]).stem}.123.tmp.h5"
    left.touch()
    carom.packings(40, seeds=3, executor="serial", out=study.folder, **SMALL)
    assert not left.exists()


def test_the_command_writes_a_folder_for_each_packing(study, tmp_path):
    out = tmp_path / "several"
    with in_this_process():
        done = typed("pack", *OPTIONS, "--seeds", 2, "--out", out, "-j", 1)
    assert done.exit_code == 0, done.output
    assert "Means and standard errors over 2 packings" in " ".join(done.stdout.split())
    assert carom.load(out / "seed-2") == study.packings[1]
    assert (out / "pack.png").exists()


def test_one_packing_and_several_need_folders_of_their_own(study, tmp_path):
    carom.pack(40, out=tmp_path / "one", pictures=False, **SMALL)
    assert not [*(tmp_path / "one").glob("*.png")]
    assert "holds a packing already" in refused("pack", *OPTIONS, "--seeds", 2, "--out", tmp_path / "one")
    assert "holds a study already" in refused("pack", *OPTIONS, "--out", study.folder)


def test_the_function_for_one_packing_names_that_for_several():
    with pytest.raises(InputError, match=r"packings\(\.\.\., seeds=8\) makes several"):
        carom.pack(40, seeds=3)


def test_a_study_of_packings_is_a_file():
    mixture = [carom.Species(count=20), carom.Species("small", count=20, diameter=0.7)]
    spec = PackSpec(dimension=2, species=mixture, stages=[(0.1, 1e3), (0.01, 1e5)], seeds=2, common=True)
    assert PackSpec.from_toml(spec.to_toml()) == spec
    assert spec.start(1).n == 40
    assert spec.replaced(n=30).species is None
    assert spec.replaced(until_Z=1e4).stages is None
    for wrong, sentence in (
        ({"species": [3]}, "species 0 must be a table, found 3"),
        ({"stages": [(0.1, None)], "collisions": 100, "seeds": 2}, "needs a Z"),
        ({"walls": "y"}, "walls must be true or false"),
        ({"neighbors": "none"}, "neighbors must be one of"),
        ({"dimension": 13}, "dimension must be"),
    ):
        with pytest.raises(InputError, match=sentence):
            PackSpec(**wrong)


@pytest.mark.parametrize(
    "given",
    [
        {"n": 6, "packing_fraction": 0.1, "walls": True},
        {"n": 7, "packing_fraction": 0.2},
        {"n": 8, "walls": True, "species": [{"fraction": 0.5}, {"fraction": 0.5, "diameter": 0.5}]},
        {"species": [{"count": 5}]},
    ],
)
def test_packings_start_from_what_is_asked_for(given):
    spec = PackSpec(dimension=2, seeds=2, **given)
    for start in (spec.start(1), PackSpec.of_task(spec.tasks()[0]).start(1)):
        assert start.n == given.get("n", 5)
        assert start.periodic == (not given.get("walls", False),) * 2
        if "packing_fraction" in given:
            assert start.packing_fraction == pytest.approx(given["packing_fraction"], rel=1e-12)
        assert len(np.unique(start.diameters)) == len(given.get("species", [0]))
    assert (spec.start(2).positions == PackSpec.of_task(spec.tasks()[1]).start(2).positions).all()


def test_species_of_points_have_names_as_those_of_a_scene():
    named = PackSpec.from_toml(
        "[pack]\nspecies.a = { count = 8 }\nspecies.b = { count = 4, diameter = 1.4 }\n"
    )
    assert [each["name"] for each in named.species] == ["a", "b"]
    assert PackSpec.from_toml(named.to_toml()) == named
    assert named.start(1).n == 12
