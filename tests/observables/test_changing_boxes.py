"""Observables of frames whose box changes, each in its own box: ideal gases, and lattices that are scaled."""

import dataclasses
import warnings

import numpy as np
import pytest

import carom
from carom.errors import CaromWarning, InputError
from carom.observables import DensityProfile

SIX_SIGMA = 6.0


def gas(d, frames=64, n=300, *, kinds=1, shapes=False, shrink=False):
    """Return points at random in a box whose edges change by a third and more; its shape as well if asked."""
    rng = np.random.default_rng(d)
    found = []
    for k in range(frames):
        edges = (
            6.0 * (1.4 if shrink else 1.0) * (1.0 + 0.2 * (k % 3) * (-1.0 if shrink else 1.0)) * np.ones(d)
        )
        edges[0] *= 1.3 if shapes and k % 2 else 1.0
        x = rng.random((n, d)) * edges
        found.append(
            carom.Frame(float(k), k, x, rng.normal(size=(n, d)), edges, np.zeros(n), np.ones(n),
                        images=np.zeros((n, d), np.int32), species=np.arange(n) % kinds,
                        species_names=("a", "b")[:kinds])
        )  # fmt: skip
    return found


@pytest.mark.parametrize("d", [1, 2, 3, 4])
@pytest.mark.parametrize("pair", [None, (0, 1), (1, 1)])
@pytest.mark.parametrize("few", [False, True])
def test_g_of_an_ideal_gas_is_one_in_every_box(d, pair, few):
    """With errors by blocking or, of few frames, of independent pairs. In the first volume g is .6 to 1.4."""
    frames = gas(d, 9 if few else 64, kinds=2, shapes=d > 1)
    found = carom.RDF(rmax=3.0, width=0.5, pair=pair).over(frames)
    assert found.frames == len(frames)
    assert (np.abs(found.g - 1.0) < SIX_SIGMA * found.error).all()
    assert found.error.max() < (0.1 if d < 4 else 1.5)
    counts = carom.RDF(rmax=3.0, width=0.5, pair=pair).over(frames[:1]).counts
    assert (counts < found.counts).all()


def test_two_disks_fill_each_box_and_count_with_its_area():
    boxes, places = ((6.0, 6.0), (9.0, 9.0)), np.array([[1.0, 1.0], [2.5, 1.0]])
    frames = [carom.Frame(0.0, 0, places, np.zeros((2, 2)), box, np.ones(2), np.ones(2)) for box in boxes]
    found = carom.RDF(rmax=2.0, width=1.0).over(frames)
    areas, shell = np.array([36.0, 81.0]), 3.0 * np.pi
    assert found.packing_fraction == pytest.approx(np.mean(0.5 * np.pi / areas), rel=1e-12)
    assert found.g == pytest.approx([np.mean(areas) / shell], rel=1e-12)
    assert found.error == pytest.approx([0.5 * np.sqrt(np.sum(areas**2)) / shell], rel=1e-12)


@pytest.mark.parametrize("tilt", [None, 0.0, 0.3])
def test_bins_that_a_later_box_has_no_room_for_are_left_out(tilt):
    frames = [dataclasses.replace(frame, tilt=tilt) for frame in gas(3, 30, shrink=True)]
    whole = carom.RDF().over(frames)
    least = min(float(frame.box.min()) for frame in frames)
    assert 0.9 * 0.5 * least < whole.edges[-1] <= 0.5 * least
    assert whole.g.size == whole.counts.size == whole.neighbors.size == len(whole.edges) - 1
    assert (np.abs(whole.g - 1.0) < SIX_SIGMA * whole.error).all()
    with pytest.raises(
        InputError, match=r"rmax is 4, beyond half of the shortest box edge \(2\.52|rmax is 4"
    ):
        carom.RDF(rmax=4.0).over(frames)


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("pair", [None, ("a", "b"), ("a", "a")])
def test_the_structure_factor_of_an_ideal_gas_is_that_of_its_waves_in_every_box(d, pair):
    """With the waves of the first box S is some n times too large for those that do not fit another one."""
    frames = gas(d, 200, kinds=2, shapes=d > 1)
    found = carom.StructureFactor(shells=5, pair=pair).over(frames)
    assert found.pair == {"b": (0, 1), "a": (0, 0)}.get(pair and pair[1])
    assert (np.abs(found.S - (pair != ("a", "b"))) < SIX_SIGMA * found.error).all()
    assert found.error.max() < 0.2
    shortest = np.mean([2.0 * np.pi / frame.box.max() for frame in frames])
    if d == 1:
        np.testing.assert_allclose(found.k, shortest * np.arange(1, 6), rtol=1e-12)
    assert found.k[0] == pytest.approx(shortest, rel=0.15)


def test_a_lattice_that_is_scaled_has_the_peak_of_its_mean_length():
    """S is n at the reciprocal lattice of each frame: all scatter in phase."""
    crystal = carom.Scene.crystal(108, 0.5)
    frames = []
    for k in range(20):
        scale = 1.0 + 0.01 * k
        frames.append(
            carom.Frame(
                float(k), k, crystal.positions * scale, np.zeros((108, 3)), np.array(crystal.box) * scale,
                np.ones(108), np.ones(108),
            )
        )  # fmt: skip
    found = carom.StructureFactor(shells=32).over(frames)
    one = carom.StructureFactor(shells=32).over(frames[:1])
    np.testing.assert_allclose(found.S, one.S, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.k, one.k * np.mean(1.0 / (1.0 + 0.01 * np.arange(20))), rtol=1e-12)


def test_a_density_is_that_of_slabs_of_each_frame():
    frames = gas(2, 60, shapes=True)
    found = DensityProfile(axis=0, bins=6).over(frames)
    expected = np.mean([frame.n / np.prod(frame.box) for frame in frames])
    assert (np.abs(found.density - expected) < SIX_SIGMA * found.error).all()
    assert found.error.max() < 0.05 * expected
    np.testing.assert_allclose(
        found.edges, np.linspace(0.0, np.mean([frame.box[0] for frame in frames]), 7), rtol=1e-12
    )


def test_order_of_a_crystal_is_the_same_in_every_box_and_correlated_where_it_has_room():
    """Q_6 of fcc is .57452, and q.q is its square at every distance; the last box has no room for some."""
    crystal = carom.Scene.crystal(256, 0.5)
    frames = [
        carom.Frame(float(k), k, crystal.positions * scale, np.zeros((256, 3)), np.array(crystal.box) * scale,
                    np.ones(256), np.ones(256))
        for k, scale in enumerate(np.linspace(1.0, 0.8, 20))
    ]  # fmt: skip
    half = 0.5 * min(crystal.box)
    found = carom.BondOrder(6, rmax=half, width=0.25).over(frames)
    assert found.local_order.mean == pytest.approx(0.57452, abs=1e-5)
    seen = found.correlation[~np.isnan(found.correlation)]
    np.testing.assert_allclose(seen, 0.57452**2, rtol=1e-4)
    with pytest.raises(InputError, match="beyond half of the shortest edge"):
        carom.BondOrder(6, rmax=1.01 * half).over(frames)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_displacements_are_those_of_the_same_steps_in_one_box(d):
    rng, n = np.random.default_rng(d), 40
    steps, edges = (
        rng.normal(size=(60, n, d)),
        [6.0 * (1.0 + 0.2 * (k % 3)) * np.arange(1, d + 1) for k in range(60)],
    )

    def walked(boxes):
        at = rng.random((n, d))  # in edges
        for k, box in enumerate(boxes):
            images = np.floor(at).astype(np.int32)
            yield carom.Frame(
                float(k), k, (at - images) * box, np.zeros((n, d)), box, np.ones(n), np.ones(n), images=images
            )
            at = at + steps[k] / (0.5 * (box + boxes[min(k + 1, len(boxes) - 1)]))

    changing, one = (carom.Dynamics().over(walked(boxes)) for boxes in (edges, edges[:1] * 60))
    np.testing.assert_allclose(changing.mean_square, one.mean_square, rtol=1e-12)
    np.testing.assert_allclose(changing.mean_square_error, one.mean_square_error, rtol=1e-9)
    with pytest.raises(InputError, match="leave out shells"):
        carom.Dynamics(shells=1).over(walked(edges))


def test_all_quantities_of_frames_are_measured_in_boxes_that_change():
    frames = [dataclasses.replace(frame, velocities=np.zeros((300, 3))) for frame in gas(3, 12, shrink=True)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)  # few frames
        found = carom.measure(frames, "rdf", "structure", "order", "crystal", "msd")
    assert sorted(found) == ["crystal", "msd", "order", "rdf", "structure"]
