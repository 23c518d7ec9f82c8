"""Swaps of diameters: exact distributions, bits that nothing changes, files, and what is refused."""

import itertools
import math

import numpy as np
import pytest
from helpers.estimates import agrees
from helpers.goes_on import same

import carom
from carom.errors import InputError
from carom.frame import Frame
from carom.models import Gravity, SquareWell, Wall
from carom.observables.rdf import PartialRDF
from carom.observables.statistics import blocking
from carom.scene_file.scene_file import SceneFile
from carom.simulation import run_loop
from carom.simulation.explanation import explain
from carom.simulation.moves import swaps
from carom.studies import StudySpec
from carom.theory import bmcsl

SLOW = pytest.mark.slow

FOUR_SIGMA = 4.0
"""Above the standard error of some 30 averages in this file: one run in 500 would fail by chance, once."""


def spheres(n=16, fraction=0.2, **more):
    sizes = carom.sizes.power(n, ratio=0.4492, seed=3)
    return carom.Scene.random(packing_fraction=fraction, diameter=sizes, seed=1, **more)


def swapping(scene=None, *, interval=0.25, within=0.3, neighbors="auto", **more):
    return carom.Simulation(
        spheres() if scene is None else scene,
        swaps=carom.Swaps(interval, within=within),
        tuning=carom.Tuning(neighbors=neighbors),
        **more,
    )


def test_rods_between_walls_come_in_all_orders_equally_often_and_press_as_their_free_length_says(plain):
    sizes, edge = np.array([0.6, 1.0, 1.4]), 5.0
    scene = carom.Scene([[0.5], [2.0], [4.0]], box=edge, diameter=sizes, walls=True)
    scene = scene.replace(velocities=[[1.0], [-0.7], [1.2]])
    sim = swapping(scene, interval=1.0, within=None)
    orders, impulses = [], []
    for frame in sim.sample(every=1.0, count=400):
        orders.append(tuple(np.argsort(frame.positions[:, 0])[frame.diameters.argsort()].argsort()))
        impulses.append(sum(each.impulse for each in sim.obstacles))
    for order in itertools.permutations(range(3)):
        assert agrees([each == order for each in orders], 1.0 / 6.0)
    # Rods exchange velocities: the pressure is that of points in what the rods leave free of the box.
    pressures = np.diff(impulses) / 2.0
    assert agrees(pressures, np.sum(scene.velocities**2) / (edge - sizes.sum()))
    assert sim.statistics.worst_overlap < 1e-14


@SLOW
def test_four_spheres_in_a_small_box_are_as_far_apart_as_rejection_sampling_says():
    sizes, edge, rng = np.array([1.3, 1.1, 0.9, 0.7]), 3.6, np.random.default_rng(7)
    i, j = np.array(list(itertools.combinations(range(4), 2))).T

    def distances(places):
        r = places[..., j, :] - places[..., i, :]
        return np.sqrt(np.sum((r - edge * np.rint(r / edge)) ** 2, axis=-1))

    exact = distances(rng.uniform(0.0, edge, (2_000_000, 4, 3)))
    exact = exact[(exact >= 0.5 * (sizes[i] + sizes[j])).all(axis=1)]
    sim = swapping(carom.Scene.random(box=(edge,) * 3, diameter=sizes, seed=2), interval=0.7, within=None)
    found = np.array(
        [
            distances(frame.positions[np.argsort(-frame.diameters)])
            for frame in sim.sample(every=0.7, count=10_000)
        ]
    )
    assert sim.statistics.swaps_accepted > 0.5 * sim.statistics.swaps_tried
    for pair, part in itertools.product(range(6), (0.1, 0.3, 0.5, 0.7)):
        below = found[:, pair] < np.quantile(exact[:, pair], part)
        spread = math.sqrt(part * (1.0 - part) / len(exact))
        estimate = blocking(below.astype(float))
        assert abs(estimate.mean - part) < FOUR_SIGMA * math.hypot(estimate.error, spread)


def test_swaps_have_the_same_bits_however_the_run_is_cut(plain, tmp_path):
    whole = swapping()
    whole.run(time=2.125)
    assert whole.collisions > 20
    cut = swapping()
    for part in (0.25, 0.125, 0.375):  # a sweep is due at the end of some
        cut.run(time=part)
    cut.save(tmp_path / "swaps.h5")
    again = carom.Simulation.load(tmp_path / "swaps.h5")
    frames = list(again.sample(times=[0.75, 1.1, 1.25, 2.125]))
    assert same(whole, again, "diameters")
    assert whole.statistics.swaps_accepted == again.statistics.swaps_accepted > 10
    assert whole.statistics.swaps_tried == again.statistics.swaps_tried
    assert (np.sort(frames[-1].diameters) == np.sort(whole.scene.diameters)).all()
    assert (frames[0].diameters != frames[-1].diameters).any()
    assert whole.statistics.worst_overlap < 1e-13
    assert whole.statistics.energy_drift < 1e-13


@SLOW
def test_swaps_have_the_same_bits_whatever_finds_neighbors():
    one, other = (swapping(spheres(100, 0.45), neighbors=way) for way in ("auto", "sectors"))
    for sim in (one, other):
        sim.run(collisions=1000)
    assert one.statistics.swaps_accepted > 100
    assert same(one, other, "diameters")


def test_a_sweep_that_exchanges_equal_sizes_changes_no_bit(plain, monkeypatch):
    quiet = carom.Simulation(spheres(10))
    quiet.run(time=0.5)
    nobody = lambda run_state, sweeps: (np.arange(run_state.scene.n), 1, 1)  # noqa: E731
    monkeypatch.setattr(swaps, "_exchanged", nobody)
    swapped = swapping(spheres(10), interval=0.03)
    swapped.run(time=0.5)
    assert swapped.statistics.swaps_accepted == 16
    assert same(quiet, swapped, "diameters")


def test_g_of_sizes_is_that_of_the_sizes_of_each_frame():
    """The largest is species 0, whoever has its diameter now."""
    rng, edge = np.random.default_rng(1), 8.0
    sizes = np.array([0.5] * 12 + [1.0] * 8)
    places = np.stack(np.meshgrid(*[np.arange(5) * 1.6] * 2), -1).reshape(-1, 2)[:20]
    scene = carom.Scene(places, edge, diameter=sizes)
    frames, named = [], []
    for _ in range(3):
        order, moved = rng.permutation(20), places + rng.uniform(0.0, 0.3, (20, 2))  # nobody touches
        frame = Frame(0.0, 0, moved, 0.0 * moved, (edge, edge), sizes[order], np.ones(20))
        frames.append(frame)
        order = np.argsort(-frame.diameters, kind="stable")
        named.append(Frame(0.0, 0, moved[order], 0.0 * moved, (edge, edge), sizes[::-1].copy(), np.ones(20),
                           species=np.array([0] * 8 + [1] * 12)))  # fmt: skip
    found = PartialRDF(scene).over(frames)
    assert list(found) == ["0-0", "0-1", "1-1"]
    for a, b in ((0, 0), (0, 1), (1, 1)):
        alone = carom.RDF(pair=(a, b)).over(named)
        assert found[f"{a}-{b}"].counts.tolist() == alone.counts.tolist()
        assert alone.counts.sum() > 0


def test_diameters_that_differ_by_more_than_within_are_not_exchanged(plain):
    scene = carom.Scene.random(packing_fraction=0.3, diameter=[0.8, 1.0] * 5, seed=1)
    for within, exchanged in ((0.1, False), (0.21, True)):
        sim = swapping(scene, within=within)
        sim.run(time=1.0)
        assert (sim.statistics.swaps_tried > 0) == (sim.statistics.swaps_accepted > 2) == exchanged


@SLOW
def test_rates_of_growth_go_with_the_diameters():
    scene = spheres(100, fraction=0.4)
    sim = swapping(scene, growth=0.02 * scene.diameters, seed=1)
    block = sim.run(time=5.0)
    assert sim.statistics.swaps_accepted > 100
    assert np.allclose(np.sort(sim.diameters), 1.1 * np.sort(scene.diameters), rtol=1e-12)
    sim.rescale(1.0)
    sim.run(time=0.3)
    assert sim.statistics.worst_overlap < 1e-13
    filled = (1.1**4 - 1.0) / 0.4  # the mean of the cube of 1 to 1.1
    assert block.sizes.packing_fraction == pytest.approx(filled * scene.packing_fraction, rel=1e-12)


def test_rates_of_growth_stay_with_the_diameters_in_another_engine_and_from_a_file(plain, tmp_path):
    scene = spheres(12, fraction=0.2)
    sim = swapping(scene, growth=0.02 * scene.diameters, seed=1)
    block = sim.run(time=1.0)
    assert sim.statistics.swaps_accepted > 5
    filled = (1.02**4 - 1.0) / 0.08  # the mean of the cube of 1 to 1.02
    assert block.sizes.packing_fraction == pytest.approx(filled * scene.packing_fraction, rel=1e-12)
    sim.rescale(1.0)
    sim.run(time=0.2)
    sim.save(tmp_path / "growing.h5")
    again = carom.Simulation.load(tmp_path / "growing.h5")
    again.run(time=0.2)
    for each, grown in ((sim, 1.024), (again, 1.028)):
        assert np.allclose(np.sort(each.diameters), grown * np.sort(scene.diameters), rtol=1e-12)


@SLOW
@pytest.mark.parametrize(("fraction", "settling"), [(0.45, 20.0), (0.55, 60.0)])
@pytest.mark.parametrize("swapped", [False, True])
def test_spheres_of_many_sizes_have_the_pressure_of_theory(fraction, settling, swapped):
    """Measured by another program: 8.50 and 8.51 at 0.45, 16.42 and 16.42 at 0.55, with n = 300."""
    scene = spheres(300, fraction)
    sim = swapping(scene, within=0.2, seed=1) if swapped else carom.Simulation(scene, seed=1)
    sim.run(time=settling)
    found = sim.measure(carom.Pressure(), time=100.0)
    n = scene.n
    assert found.Z.mean == pytest.approx(bmcsl(fraction, np.full(n, 1.0 / n), scene.diameters), rel=0.01)


TOML = """
[scene]
n = 20
packing_fraction = 0.2
sizes = { type = "power", ratio = 0.5 }
[run]
swaps = { interval = 0.5, within = 0.3, seed = 7 }
collisions_per_particle = 4
equilibration = 1
frames = 2
pictures = false
write = ["h5md"]
"""


def test_a_scene_file_has_sizes_and_swaps():
    plan = SceneFile.from_toml(TOML)
    assert SceneFile.from_toml(plan.to_toml()) == plan
    assert plan.run.swaps == carom.Swaps(0.5, within=0.3, seed=7)
    assert (plan.build_scene().diameters == carom.sizes.power(20, ratio=0.5)).all()
    with pytest.raises(InputError, match="sizes are for carom run"):
        StudySpec.from_toml(TOML)


@SLOW
def test_a_run_of_a_scene_file_reports_how_many_swaps_were_accepted(tmp_path):
    plan = SceneFile.from_toml(TOML)
    found = carom.run(plan, tmp_path / "run").summary["swaps"]
    alone = carom.Simulation(plan.build_scene(), kT=1.0, swaps=plan.run.swaps)
    alone.run(time=carom.Simulation.load(tmp_path / "run" / "checkpoint.h5").time)
    statistics = alone.statistics
    assert found == {"tried": statistics.swaps_tried, "accepted": statistics.swaps_accepted}
    assert 0 < found["accepted"] < found["tried"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("interval = 0.5, ", "", "swaps: the table needs interval"),
        ("interval = 0.5", "interval = 0.0", "interval of Swaps"),
        ("interval = 0.5", "every = 0.5", "has no 'every'"),
        ("frames", "event_log = true\nframes", "event_log"),
        (", ratio = 0.5", "", "needs ratio"),
        ("power", "powr", "type must be one of power"),
        ("n = 20", "n = 20\ndiameter = 1.0", "diameter and sizes contradict"),
        ("n = 20", "n = 32\nlattice = 'fcc'", "sizes has no meaning with lattice"),
    ],
)
def test_swaps_and_sizes_of_no_meaning_in_a_scene_file_are_refused(old, new, said):
    with pytest.raises(InputError, match=said):
        SceneFile.from_toml(TOML.replace(old, new))


def test_the_page_of_a_run_names_its_swaps(unscheduled):
    scene = spheres(12, 0.1)
    text = "10 tried a particle at every 0.5"
    assert explain(scene, swaps=carom.Swaps(0.5)).models["swaps"] == text
    assert swapping(scene, interval=0.5).explain().models["swaps"] == text
    assert "swaps" in explain(scene).absent
    with pytest.raises(InputError, match="equal diameters"):
        explain(carom.Scene.crystal(32, 0.3), swaps=carom.Swaps(0.5))


def pairs(**more):
    return spheres(12, 0.1).replace(**more)


@pytest.mark.parametrize(
    ("scene", "more", "said"),
    [
        (lambda: carom.Scene.crystal(32, 0.3), {}, "equal diameters"),
        (lambda: pairs(mass=np.arange(1.0, 13.0)), {}, "different masses"),
        (lambda: pairs(species=[0, 1] * 6), {}, "species"),
        (lambda: pairs(pinned=[0]), {}, "pinned"),
        (lambda: carom.Scene.crystal(32, 0.3, interaction=SquareWell(1.5, 0.1)), {}, "hard cores"),
        (lambda: pairs(motion=Gravity((0.0, 0.0, -1.0))), {}, "free flight"),
        (lambda: pairs(impact=0.9), {}, "lose energy"),
        (lambda: spheres(12, 0.1, walls={"x_low": Wall(impact=0.9)}), {}, "walls or obstacles"),
        (pairs, {"tuning": carom.Tuning(precision="single")}, "precision"),
        (pairs, {"event_log": "events.h5"}, "event log"),
        (pairs, {"cores": 2}, "its swaps"),
        (pairs, {"swaps": 3}, "Swaps"),
    ],
)
def test_what_swaps_are_not_for_is_refused_in_a_sentence(unscheduled, scene, more, said):
    with pytest.raises(InputError, match=said):
        carom.Simulation(scene(), **{"swaps": carom.Swaps(1.0), **more})


@pytest.mark.parametrize("wrong", [{"interval": 0.0}, {"attempts": 0}, {"within": -1.0}, {"seed": -1}])
def test_swaps_of_no_meaning_are_refused(wrong):
    with pytest.raises(InputError, match=f"{next(iter(wrong))} of Swaps"):
        carom.Swaps(**{"interval": 1.0, **wrong})


def test_a_sweep_is_done_before_what_else_is_due_at_its_time(unscheduled):
    sim = swapping()
    assert run_loop._next_stop(sim._state, sim._state.sweeps.next, None)[1] == "sweeps"


def test_a_checkpoint_from_before_there_were_swaps_is_read(plain, tmp_path):
    from carom.io import checkpoint

    scene = carom.Scene.random(16, packing_fraction=0.1, dimension=2)
    path = tmp_path / "state.h5"
    carom.Simulation(scene, seed=1).save(path)
    arrays, attributes = checkpoint.load(path)
    del attributes["swaps"]
    checkpoint.save(path, arrays, attributes)
    assert carom.Simulation.load(path).n == 16
