"""Species in files: their names, and a species that no component belongs to (a count or fraction of zero)."""

import csv
import dataclasses
import itertools

import numpy as np
import pytest
from helpers.marks import slow
from helpers.mixtures import mixed, mixture

import carom
from carom import InputError, Scene, Simulation, io
from carom.observables import RDF
from carom.observables.rdf import PartialRDF
from carom.scene.species import pair_name
from carom.scene_file.scene_file import SceneFile

PLAN = """
[scene]
dimension = 2
packing_fraction = 0.3
{species}
[run]
equilibration = 4
collisions_per_particle = 4
frames = 2
write = ["h5md", "extxyz"]
pictures = true
"""

NAMES, DIAMETERS = ("a", "b", "c"), (1.0, 0.8, 0.6)

KINDS = "".join(f'species."{{}}" = {{{{ fraction = 0.25, diameter = {s} }}}}\n' for s in (1, 1, 0.8, 0.6))

#: The empty species stands first, in the middle, last, and all but one are empty.
COUNTS = [(0, 18, 12), (18, 0, 12), (18, 12, 0), (30, 0, 0), (0, 0, 30)]


def plan_of(counts):
    """A plan of three species, of which there are so many."""
    table = "species.{} = {{ diameter = {}, count = {} }}\n"
    species = "\n".join(table.format(*row) for row in zip(NAMES, DIAMETERS, counts, strict=True))
    return SceneFile.from_toml(PLAN.format(species=species))


@pytest.mark.parametrize("counts", COUNTS[:3])
def test_a_run_with_an_empty_species_has_a_summary(tmp_path, counts):
    assert_summary(tmp_path, counts)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("counts", [COUNTS[3], slow(COUNTS[4])])
def test_a_run_of_one_of_several_species_has_a_summary(tmp_path, counts):
    assert_summary(tmp_path, counts)


def assert_summary(tmp_path, counts):
    result = carom.run(plan_of(counts), tmp_path / "run")
    by_species = result.summary["collisions_by_species"]
    pairs = [f"{a}-{b}" for a, b in itertools.combinations_with_replacement(NAMES, 2)]
    assert list(by_species) == pairs
    empty = [name for name, count in zip(NAMES, counts, strict=True) if count == 0]
    occurs = [pair for pair in pairs if not {*pair.split("-")} & {*empty}]
    assert all((by_species[pair] > 0) == (pair in occurs) for pair in pairs)
    found = result.summary["contact_values_from_rdf"]
    assert list(found) == (occurs if len(empty) == 1 else [])
    # A single species of a mixture has the g(r) of equal disks.
    assert (result.summary["contact_value_from_rdf"]["mean"] is None) == (len(empty) == 1)
    for form in ("h5md", "extxyz"):
        frame = io.read(result.folder / f"trajectory.{form}")
        assert frame.species_names == NAMES
        assert np.bincount(frame.species, minlength=3).tolist() == list(counts)
    with pytest.raises(InputError, match="too few components"):
        RDF(pair=(empty[-1], empty[-1])).over([frame])


def test_every_pair_of_species_has_a_name_of_its_own(tmp_path, monkeypatch):
    names = ["a", "a-b", "b-c", "c", '"a', '"a"', "a-b-c"]
    pairs = [*itertools.combinations_with_replacement(names, 2)]
    assert len({pair_name(*pair) for pair in pairs}) == len(pairs)
    assert pair_name("large", "small") == "large-small"
    assert pair_name('"a', "b") == '"\\"a"-b'
    assert pair_name("very-large", 1) == '"very-large"-1'

    text = PLAN.format(species=f"n = 60\n{KINDS.format(*names[:4])}").replace("true", "false")
    result = carom.run(SceneFile.from_toml(text), tmp_path / "run")
    wanted = [pair_name(*pair) for pair in itertools.combinations_with_replacement(names[:4], 2)]
    assert list(result.summary["collisions_by_species"]) == wanted
    assert sum(result.summary["collisions_by_species"].values()) >= result.summary["collisions"]
    assert list(result.summary["contact_values_from_rdf"]) == wanted
    lines = (result.folder / "rdf.csv").read_text(encoding="utf-8").splitlines()
    heads = next(csv.reader(line for line in lines if not line.startswith("#")))
    assert [head for head in heads if head.startswith("g ")] == [f"g {name}" for name in wanted]


@pytest.mark.usefixtures("unscheduled")
def test_a_species_whose_name_is_a_number_is_found_by_its_name():
    scene = mixture(
        [30, 20], diameters=[1.0, 0.6], names=["1", "0"], dimension=2, packing_fraction=0.2, seed=1
    )
    frame = Simulation(scene, seed=1).frame()
    assert RDF(pair=("1", "1")).over([frame]).counts.sum() == RDF(pair=(0, 0)).over([frame]).counts.sum()
    unnamed = dataclasses.replace(frame, species_names=())
    assert RDF(pair=("1", "1")).over([unnamed]).counts.sum() == RDF(pair=(1, 1)).over([frame]).counts.sum()


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize("counts", COUNTS)
def test_pairs_keep_the_contact_of_their_species_where_another_is_empty(counts):
    table = np.array([[1.0, 0.7, 0.75], [0.7, 0.8, 0.65], [0.75, 0.65, 0.6]])
    scene = mixture(
        counts, diameters=DIAMETERS, names=NAMES, contact=table, dimension=2, packing_fraction=0.2, seed=1
    )
    found = PartialRDF(scene).over([Simulation(scene, seed=1).frame()])
    pairs = itertools.combinations_with_replacement(np.flatnonzero(counts), 2)
    right = {pair_name(NAMES[i], NAMES[j]): table[i, j] for i, j in pairs}
    assert {name: each.diameter for name, each in found.items()} == right


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("counts", COUNTS)
def test_tables_of_pairs_have_a_row_for_every_species(tmp_path, counts):
    scene = Scene.random(
        species=mixed(counts=counts, diameters=DIAMETERS, names=NAMES), dimension=2, packing_fraction=0.3,
        seed=1,
    )  # fmt: skip
    sim = Simulation(scene, seed=1)
    sim.run(collisions=100)
    for given in (sim, _saved_and_loaded(sim, tmp_path)):
        collisions = given.collisions_by_species
        assert collisions.shape == (3, 3)
        assert np.triu(collisions).sum() == 100
        assert not collisions[np.array(counts) == 0].any()


@pytest.mark.slow
def test_an_empty_species_has_no_say_in_how_far_contacts_reach():
    """A contact matrix says how large the empty species would be: the run is that of a scene without it."""
    full = np.array([[1.0, 0.9, 5.0], [0.9, 0.8, 5.0], [5.0, 5.0, 9.0]])
    given = {"dimension": 2, "packing_fraction": 0.3, "seed": 1}
    whole = mixture((30, 20, 0), diameters=(1.0, 0.8, 9.0), contact=full, **given)
    part = mixture((30, 20), diameters=(1.0, 0.8), contact=full[:2, :2], **given)
    runs = [Simulation(scene, seed=1) for scene in (whole, part)]
    for sim in runs:
        sim.run(collisions=500)
    one, other = (sim._state for sim in runs)
    assert one.scheme == other.scheme
    assert np.array_equal(one.frame().positions, other.frame().positions)


def _saved_and_loaded(sim, folder):
    sim.save(folder / "state.h5")
    return Simulation.load(folder / "state.h5")
