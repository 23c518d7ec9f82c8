"""Partial g(r) and the pressure of mixtures."""

import math

import numpy as np
import pytest
from helpers import beside_mdanalysis
from helpers.mixtures import mixed

import carom
from carom import Species, theory
from carom.block import Block
from carom.errors import InputError
from carom.frame import Frame
from carom.observables import RDF, Pressure
from carom.observables.rdf import PartialRDF
from carom.scene.scene import Scene

SIX_SIGMA = 6.0


def frame_of(positions, diameters, species, box, time=0.0, names=()) -> Frame:
    n = len(positions)
    return Frame(
        time, 0, np.asarray(positions, float), np.zeros_like(positions), box, np.asarray(diameters, float),
        np.ones(n), species=np.asarray(species), species_names=names,
    )  # fmt: skip


def test_species_may_touch_at_a_distance_of_their_own():
    frame = frame_of([[1.0, 1.0], [1.7, 1.0], [4.0, 4.0]], [1, 1, 1], [0, 1, 1], (6.0, 6.0))
    with pytest.raises(InputError, match=r"overlap .*contact 1"):
        RDF(pair=(0, 1)).over([frame])
    distribution = RDF(pair=(0, 1), contact=0.7, bins=5, rmax=2.0).over([frame])
    assert (distribution.edges[0], distribution.counts[0]) == (0.7, 1)


def test_the_same_partial_distribution_comes_through_mdanalysis():
    scene = Scene.random(
        species=[Species(count=60), Species(count=90, diameter=0.6)], packing_fraction=0.3, seed=5
    )
    frame = frame_of(scene.positions, scene.diameters, scene.species, scene.box, names=("big", "small"))
    universe = carom.io.universe([frame])
    end = 0.5 * scene.box[0] - 1e-3
    ours = RDF(pair=("big", "small"), bins=5, rmax=end).over([frame])
    _, theirs = beside_mdanalysis.counts(universe, 5, 0.8, end, "name big", "name small")
    assert ours.packing_fraction == pytest.approx(0.3, rel=1e-12)
    # A pair within single precision of a bin's edge may change sides: there is none here.
    np.testing.assert_array_equal(theirs, ours.counts)


def test_pairs_without_room_in_half_of_the_box_are_left_out():
    # Half of the shortest edge is 2.5: 1-1 touch at 1, 0-1 at 1.9, 0-0 at 2.8.
    positions = [[0.5, 0.5], [0.5, 3.4], [3.0, 0.5], [3.0, 3.4]]
    frame = frame_of(positions, [2.8, 2.8, 1.0, 1.0], [0, 0, 1, 1], (5.0, 6.0))
    scene = Scene.from_frame(frame)
    assert PartialRDF(scene).over([frame]).keys() == {"0-1", "1-1"}


def test_the_pressure_of_a_mixture_needs_no_diameter():
    blocks = [Block(1.0, 100 + k % 3, 30.0 + k % 5) for k in range(128)]
    common = {"n": 10, "dimension": 3, "volume": 100.0, "kT": 2.0}
    mixed = Pressure.estimate(blocks, **common, diameter=2.0, packing_fraction=0.1, simple=False)
    equal = Pressure.estimate(blocks, **common, diameter=1.0)
    assert mixed.Z == equal.Z
    assert mixed.collision_rate == equal.collision_rate
    # P sigma^d / kT with the sigma that was given.
    assert mixed.reduced_pressure.mean == pytest.approx(8 * equal.reduced_pressure.mean, rel=1e-14)
    assert mixed.packing_fraction == 0.1
    for name in ("contact_value", "Z_from_rate"):
        assert math.isnan(getattr(mixed, name).mean)
    with pytest.raises(InputError, match=r"mixture_finite_size_shift\(packing_fraction, fractions,"):
        mixed.infinite_size()
    with pytest.raises(InputError, match=r"alone \(.*missing.*'fractions' and 'diameters'\)"):
        mixed.infinite_size(theory.bmcsl)
    # What is told to be typed.
    species = [0.5, 0.5], [1.0, 0.5]
    shift = theory.mixture_finite_size_shift(0.1, *species, 3, 10, theory.bmcsl)
    found = mixed.infinite_size(lambda eta: theory.bmcsl(eta, *species))
    # It leaves out that the number of each species is fixed, a part of the effect.
    assert abs(found.mean - (mixed.Z.mean - shift)) < 0.1 * abs(shift)
    assert mixed.infinite_size(theory.carnahan_starling).mean != mixed.Z.mean


@pytest.mark.slow
def test_contact_values_of_a_binary_fluid_are_those_of_bmcsl():
    """Partial contact values of 1 : 0.5 at packing fraction 0.3, within errors and the 1 % of the theory."""
    diameters = [1.0, 0.5]
    scene = Scene.random(species=mixed(counts=[400, 400], diameters=diameters), packing_fraction=0.3, seed=1)
    sim = carom.Simulation(scene, seed=2)
    sim.run(collisions_per_particle=100)
    frames = list(sim.sample(every=0.2, count=400))
    expected = theory.bmcsl_contact_value(0.3, [0.5, 0.5], diameters)
    for a, b in ((0, 0), (0, 1), (1, 1)):
        found = RDF(pair=(a, b), rmax=2.0).over(frames).contact_value
        assert abs(found.mean - expected[a, b]) < SIX_SIGMA * found.error + 0.01 * expected[a, b]


def test_the_table_of_all_pairs_is_one_result(tmp_path):
    rng = np.random.default_rng(1)
    frame = carom.Frame(
        0.0, 0, rng.random((40, 2)) * 9.0, np.zeros((40, 2)), (9.0, 9.0),
        np.repeat([1e-3, 2e-3], 20), np.ones(40),
    )  # fmt: skip
    found = carom.measure([frame], "rdf")["rdf"]
    found.save(tmp_path / "rdf.json")
    assert carom.load(tmp_path / "rdf.json") == found
    found.save(tmp_path / "rdf.csv")
    table = found.to_dataframe()
    lines = [each for each in (tmp_path / "rdf.csv").read_text().splitlines() if not each.startswith("#")]
    assert lines[0].split(",") == [*table.columns]
    assert len(lines) == len(table) + 1 == max(each.g.size for each in found.values()) + 1
    assert all(name in found._repr_html_() for name in found)
