"""Solid-like particles and their clusters: crystals, a fluid, two grains, the definition by all pairs."""

import json

import numpy as np
import pytest
from helpers.frames import at_rest, frame_of

import carom
from carom.errors import InputError
from carom.observables import Crystallinity
from carom.observables.bond_order import harmonics

FEW = 0.02
"""Solid-like part of a fluid at packing fraction 0.40, at most: few, as ten Wolde et al. (1996) find."""


def one(scene, **settings):
    """Return the crystallinity of a scene at rest."""
    frame = frame_of(scene.positions, scene.box, scene.diameters)
    return Crystallinity(**settings).over([frame])


@pytest.mark.parametrize("eta", [0.545, 0.7])
def test_a_crystal_is_solid_in_one_cluster_also_when_it_moves(eta):
    sim = carom.Simulation(carom.Scene.crystal(256, eta), seed=1)
    sim.run(collisions_per_particle=20)
    found = sim.measure(Crystallinity(), collisions_per_particle=20)
    assert found.solid_fraction.mean > 1.0 - FEW
    assert found.largest.mean > 256 * (1.0 - FEW)
    assert one(carom.Scene.crystal(256, eta)).largest.mean == 256


def test_a_fluid_has_nearly_none():
    sim = carom.Simulation(carom.Scene.random(256, 0.4, seed=1), seed=1)
    sim.run(collisions_per_particle=50)
    found = sim.measure(Crystallinity(), collisions_per_particle=20)
    assert found.solid_fraction.mean < FEW
    assert found.largest.mean < FEW * 256


def test_a_box_half_crystal_and_half_fluid_is_half_one_cluster():
    """Of the crystal the two layers at the interfaces, of 8 along the axis, may be solid-like or not."""
    crystal, fluid = carom.Scene.crystal(256, 0.545), carom.Scene.random(256, 0.4, seed=1)
    edge = crystal.box[0]
    places = fluid.positions * (edge / fluid.box[0]) + [edge, 0.0, 0.0]
    frame = frame_of(np.concatenate([crystal.positions, places]), (2.0 * edge, edge, edge))
    found = Crystallinity().over([frame])
    assert 0.75 * 256 - FEW * 512 <= found.largest_cluster[0] <= 1.25 * 256 + FEW * 512


def test_two_grains_are_two_clusters_and_dust_between_them_is_none():
    grain = carom.Scene.crystal(108, 0.7)
    edge = grain.box[0]
    rng = np.random.default_rng(1)
    along = np.array([edge, 0.0, 0.0])
    dust = rng.uniform(0.0, edge, (40, 3)) + 1.5 * along
    few = grain.positions[grain.positions[:, 0] < 0.6 * edge] + 3.0 * along
    positions = np.concatenate([grain.positions, few, dust])
    frame = frame_of(positions, (5.0 * edge, edge, edge), 0.1)
    found = Crystallinity(reach=1.35 * edge / 3.0 / np.sqrt(2.0)).over([frame])
    surfaces = int(found.solid[0])
    assert 0 < found.largest_cluster[0] <= 108
    assert found.largest_cluster[0] < surfaces <= 108 + len(few)


def test_the_number_is_that_of_the_definition():
    rng = np.random.default_rng(3)
    n, box, reach = 60, 5.0, 1.7
    frame = frame_of(rng.uniform(0.0, box, (n, 3)), (box,) * 3, 0.1)
    apart = frame.positions[:, None] - frame.positions[None]
    apart -= box * np.rint(apart / box)
    near = (np.sum(apart**2, axis=2) <= reach**2) & ~np.eye(n, dtype=bool)
    orders = np.array(
        [
            harmonics(6, -apart[i, near[i]] / np.linalg.norm(apart[i, near[i]], axis=1)[:, None]).mean(axis=0)
            for i in range(n)
        ]
    )
    orders /= np.linalg.norm(orders, axis=1)[:, None]
    likeness, connections = 0.3, 2
    solid = ((orders @ orders.T > likeness) & near).sum(axis=1) >= connections
    clusters, left = [], {*np.flatnonzero(solid).tolist()}
    while left:
        reached, ends = set(), {left.pop()}
        while ends:
            one_end = ends.pop()
            reached.add(one_end)
            ends |= {k for k in np.flatnonzero(near[one_end] & solid).tolist() if k not in reached}
        left -= reached
        clusters.append(len(reached))
    found = Crystallinity(reach=reach, likeness=likeness, connections=connections).over([frame])
    assert 0 < solid.sum() < n
    assert (found.solid[0], found.largest_cluster[0]) == (solid.sum(), max(clusters))


def test_what_it_cannot_measure_is_refused():
    for settings in ({"connections": 0}, {"likeness": 2.0}, {"nearest": 3, "reach": 1.0}):
        with pytest.raises(InputError):
            Crystallinity(**settings)
    with pytest.raises(InputError, match="three dimensions"):
        one(carom.Scene.random(20, 0.2, 2, seed=1))
    with pytest.raises(InputError, match="12 neighbors"):
        Crystallinity().over([at_rest(carom.Scene.random(5, 0.1, seed=1), periodic=(False,) * 3)])


def test_the_result_is_a_table_a_picture_and_a_file(tmp_path):
    found = one(carom.Scene.crystal(108, 0.6))
    assert found.plot().axes
    for suffix in (".json", ".npz"):
        found.save(tmp_path / f"crystal{suffix}")
        assert carom.load(tmp_path / f"crystal{suffix}") == found
    found.save(tmp_path / "crystal.csv")
    lines = (tmp_path / "crystal.csv").read_text().splitlines()
    assert lines[0] == "time,solid,largest_cluster"
    assert lines[1].split(",")[1:] == ["108", "108"]
    assert json.loads(json.dumps(found.to_dict()))["n"] == 108
    assert "largest cluster = 108" in str(found)
