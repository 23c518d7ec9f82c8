"""Constant pressure: exact distributions of the volume, bits that nothing changes, files, what is refused."""

import contextlib
import math
from types import SimpleNamespace

import numpy as np
import pytest

import carom
from carom import theory
from carom.errors import CaromWarning, InputError
from carom.models import Ball, Gravity, Langevin, Shear, SquareWell
from carom.observables import blocking
from carom.simulation.moves.barostat import _drawn, _tried
from carom.theory import pieprzyk

SLOW = pytest.mark.slow

FOUR_SIGMA = 4.0
"""Above the standard error of some ten averages in this file: one run in 1500 would fail by chance, once."""


def at_pressure(scene, pressure=1.0, *, interval=0.5, step=0.1, neighbors="auto", **more):
    return carom.Simulation(
        scene,
        barostat=carom.Barostat(pressure, interval, step),
        tuning=carom.Tuning(neighbors=neighbors),
        **more,
    )


def rods(n, edge):
    return carom.Scene(edge / n * (0.5 + np.arange(n))[:, None], box=edge)


def moments_of_rods(n, pressure_over_kT):
    """Return mean and variance of the length of a ring of n rods of length 1 at constant pressure.

    A rod may be anywhere, and the gaps then share l = L - n, so that Z_N is proportional to L l^(n - 1). With
    the weight exp(-P L / kT) this is a sum of two Gamma distributions of l.
    """

    def integral(k):
        return sum(
            weight * math.gamma(shape + k) / pressure_over_kT ** (shape + k)
            for weight, shape in ((1.0, n + 1), (n, n))
        )

    mean, square = integral(1) / integral(0), integral(2) / integral(0)
    return n + mean, square - mean**2


def check_rods(n, pressure, kT, count, step):
    sim = at_pressure(rods(n, 2.0 * n), pressure, interval=0.7, step=step, kT=kT, seed=n)
    lengths = np.array([frame.box[0] for frame in sim.sample(every=0.7, count=count)])
    mean, variance = moments_of_rods(n, pressure / kT)
    for values, exact in ((lengths, mean), ((lengths - mean) ** 2, variance)):
        found = blocking(values)
        assert abs(found.mean - exact) < FOUR_SIGMA * found.error
        assert found.error < 0.2 * exact
    least, most = (count, count) if step is None else (0.1 * count, 0.9 * count)
    assert least <= sim.statistics.volume_moves_accepted <= most
    assert sim.statistics.volume_moves_tried == count
    assert sim.statistics.worst_overlap < 1e-12


@pytest.mark.parametrize("step", [None, 1.0])
def test_the_length_of_a_ring_of_rods_has_the_exact_mean_and_variance(plain, step):
    check_rods(2, pressure=1.5, kT=2.0, count=500, step=step)


@SLOW
@pytest.mark.parametrize("n", [3, 5])
@pytest.mark.parametrize("step", [None, 1.0])
def test_the_length_of_rings_of_rods_has_the_exact_mean_and_variance_in_long_runs(n, step):
    # Lengths that are tried change more slowly than those that are drawn.
    check_rods(n, pressure=1.5, kT=2.0, count=4000 if step is None else 10_000, step=step)


def mixture(n=8, fraction=0.3, d=2, **more):
    sizes = np.where(np.arange(n) % 2, 1.0, 0.7)
    masses = np.where(np.arange(n) % 3, 1.0, 4.0)
    return carom.Scene.random(packing_fraction=fraction, diameter=sizes, mass=masses, dimension=d, **more)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_a_move_scales_all_places_and_changes_nothing_else(plain, d):
    sim = at_pressure(mixture(4, 0.1, d), 1e-6, interval=1e-3, seed=1)
    before = sim.frame()
    sim.run(time=1e-3)
    assert sim.statistics.volume_moves_accepted == 1
    assert sim.collisions == 0
    after = sim.frame()
    places = before.unwrapped + 1e-3 * before.velocities
    scale = after.box[0] / before.box[0]
    assert 1.0 < scale < math.exp(0.1 / d)
    assert np.allclose(after.box, scale * np.array(before.box), rtol=1e-14)
    assert np.allclose(after.unwrapped, scale * places, rtol=1e-12, atol=1e-12)
    assert (after.velocities == before.velocities).all()
    assert sim.packing_fraction == pytest.approx(0.1 / scale**d, rel=1e-12)
    assert sim.time == 1e-3


def test_a_compression_that_makes_an_overlap_is_refused(plain):
    touching = [[0.5, 0.5], [1.5 + 1e-9, 0.5], [2.5, 2.5]]
    scene = carom.Scene(touching, box=4.0, velocities=[[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    sim = at_pressure(scene, 1e6, interval=1e-3, step=0.01)
    sim.run(time=0.1)
    assert sim.statistics.volume_moves_tried == 100
    assert sim.statistics.volume_moves_accepted == 0
    assert sim.scene.box == scene.box


def test_overlaps_of_earlier_states_are_looked_for_in_their_own_box(plain):
    sim = at_pressure(rods(2, 2.5), 1e-6, interval=0.1, step=1.0)
    for _ in range(20):  # states are kept at the ends of runs, and looked at when somebody asks
        sim.run(time=0.1)
    assert sim.scene.box[0] > 5.0
    assert sim.statistics.worst_overlap < 1e-12


def test_files_hold_the_box_of_each_frame(plain, tmp_path):
    boxes = [tuple(frame.box) for frame in at_pressure(mixture(), 2.0).sample(every=0.5, count=4)]
    assert len(set(boxes)) > 1
    for suffix in ("h5md", "extxyz"):
        at_pressure(mixture(), 2.0).write(tmp_path / f"npt.{suffix}", every=0.5, count=4)
        with carom.open(tmp_path / f"npt.{suffix}") as read:
            assert [tuple(frame.box) for frame in read] == boxes


@pytest.mark.parametrize(
    ("scene", "more", "said"),
    [
        (lambda: mixture(walls="x"), {}, "walls"),
        (lambda: mixture(fraction=0.1, obstacles=[Ball((1.0, 1.0), 0.2)]), {}, "obstacles"),
        (lambda: mixture().replace(pinned=[0]), {}, "pinned"),
        (lambda: carom.Scene.crystal(32, 0.3, interaction=SquareWell(1.5, 0.1)), {}, "hard cores"),
        (lambda: mixture().replace(motion=Gravity((0.0, -1.0))), {}, "free flight"),
        (lambda: mixture().replace(impact=0.9), {}, "lose energy"),
        (lambda: mixture().replace(drive=Langevin(kT=1.0, friction=1.0, step=0.1)), {}, "a drive"),
        (lambda: carom.Scene([[0.5, 0.5]], box=2.0), {}, "a single particle"),
        (mixture, {"growth": 0.1}, "growth"),
        (mixture, {"tuning": carom.Tuning(precision="single")}, "precision"),
        (mixture, {"event_log": "events.h5"}, "an event log"),
        (lambda: mixture().replace(mass=1.0), {"swaps": carom.Swaps(1.0)}, "swaps"),
        (mixture, {"observers": [carom.observables.HelfandCurrents()]}, "observers"),
        (mixture, {"cores": 2}, "its barostat"),
        (mixture, {"barostat": 3}, "Barostat"),
    ],
)
def test_what_a_barostat_is_not_for_is_refused_in_a_sentence(unscheduled, scene, more, said):
    with pytest.raises(InputError, match=said):
        carom.Simulation(scene(), **{"barostat": carom.Barostat(1.0, 1.0, 0.1), **more})


def test_methods_that_need_one_box_are_refused(unscheduled):
    sim = at_pressure(mixture())
    for observable in (carom.Pressure(), carom.PressureTensor(), carom.FreeFlights()):
        with pytest.raises(InputError, match=r"needs a box that does not change.*carom\.Volume"):
            sim.measure(observable, time=1.0)
    with pytest.raises(InputError, match="give Simulation a barostat"):
        carom.Simulation(mixture()).measure(carom.Volume(), time=1.0)


@pytest.mark.parametrize(
    ("n", "d", "edge", "pressure"),
    [
        (2, 1, 4.0, 1.0),
        (2, 1, 2.05, 1.0),
        (8, 2, 6.0, 0.01),
        (8, 2, 6.0, 0.3),
        (8, 2, 6.0, 50.0),
        (30, 3, 6.0, 0.14),
    ],
)
def test_volumes_that_are_drawn_have_their_density(unscheduled, n, d, edge, pressure):
    """V has the density V^N exp(-P V / kT) from contact on: far below its top, beside it, far above."""
    scene = carom.Scene.random(n, n * theory.ball_volume(d) / edge**d, d, seed=1)
    apart = scene.positions[:, None] - scene.positions[None]
    apart -= edge * np.rint(apart / edge)
    nearest = np.linalg.norm(apart, axis=2)[np.triu_indices(n, 1)].min()
    contact = scene.volume / min(nearest, edge) ** d
    rng, barostat = np.random.default_rng(n), carom.Barostat(pressure, 1.0)
    scales = np.array([_drawn(rng, scene, barostat, 1.0, scene.positions) for _ in range(3000)])
    volumes = scene.volume * scales**d
    assert volumes.min() > contact * (1.0 - 1e-15)
    top = max(contact, n / pressure)
    grid = contact + np.linspace(0.0, 1.0, 400_001) ** 2 * 60.0 * (math.sqrt(n) + 1.0) / pressure
    weights = np.exp(n * np.log(grid / top) - pressure * (grid - top)) * np.gradient(grid)
    mean = np.average(grid, weights=weights)
    variance = np.average((grid - mean) ** 2, weights=weights)
    assert abs(volumes.mean() - mean) < FOUR_SIGMA * math.sqrt(variance / 3000)
    fourth = np.average((grid - mean) ** 4, weights=weights)
    assert abs(volumes.var() - variance) < FOUR_SIGMA * math.sqrt((fourth - variance**2) / 3000)


@pytest.mark.parametrize(("n", "d"), [(2, 1), (2, 3), (9, 2)])
def test_volumes_that_are_tried_have_their_density_where_nobody_touches(n, d):
    """V has the density V^N exp(-P V / kT), a Gamma distribution of N + 1."""
    rng, barostat, kT = np.random.default_rng(n + d), carom.Barostat(1.5, 1.0, step=1.0), 2.0
    room, volumes = SimpleNamespace(n=n, dimension=d, box=(1.0,) * d, volume=1.0), []
    for _ in range(12_000):
        scale = _tried(rng, room, barostat, kT) or 1.0
        room.box = tuple(edge * scale for edge in room.box)
        room.volume = math.prod(room.box)
        volumes.append(room.volume * 1.5 / kT)
    found = np.array(volumes[2000:])
    for values, exact in ((found, n + 1.0), ((found - n - 1.0) ** 2, n + 1.0)):
        mean = blocking(values)
        assert abs(mean.mean - exact) < FOUR_SIGMA * mean.error < 0.2 * exact


def test_particles_at_rest_have_no_temperature_for_a_barostat(plain):
    with pytest.raises(InputError, match="needs a temperature"):
        at_pressure(mixture().replace(velocities=np.zeros((8, 2))))


@pytest.mark.parametrize(("interval", "warned"), [(1e-9, True), (0.01, False)])
@pytest.mark.parametrize("name", ["Barostat.interval", "Swaps.interval", "Shear.period"])
def test_moves_so_often_that_a_run_hardly_gets_on_are_warned_of(plain, name, interval, warned):
    scene, how = carom.Scene.random(8, 0.3, 2, diameter=np.linspace(0.9, 1.0, 8)), {}
    if name == "Shear.period":
        scene = scene.replace(motion=Shear(1.0, period=interval))
    elif name == "Swaps.interval":
        how["swaps"] = carom.Swaps(interval=interval)
    else:
        how["barostat"] = carom.Barostat(pressure=1.0, interval=interval)
    expected = pytest.warns(CaromWarning, match=f"{name} is so short") if warned else contextlib.nullcontext()
    with expected:
        carom.Simulation(scene, **how)


@pytest.mark.parametrize("wrong", [{"pressure": 0.0}, {"interval": 0.0}, {"step": 2.0}, {"seed": -1}])
def test_barostats_of_no_meaning_are_refused(wrong):
    with pytest.raises(InputError, match=f"{next(iter(wrong))} of Barostat"):
        carom.Barostat(**{"pressure": 1.0, "interval": 1.0, "step": 0.1, **wrong})


@SLOW
def test_spheres_at_the_pressure_of_theory_have_its_volume():
    """The equation of state is good to 1e-4, a hundredth of the error here.

    To leading order in 1 / N the canonical partition function is exp(-F / kT) / sqrt(2 pi N rho V dP/drho),
    from which <V> = N v (1 + chi / N), with chi = kT drho/dP.
    """
    n, fraction, step = 64, 0.4, 1e-4

    def pressure(eta):
        return 6.0 / math.pi * eta * float(pieprzyk(eta))

    chi = 6.0 / math.pi * 2.0 * step / (pressure(fraction + step) - pressure(fraction - step))
    exact = math.pi / 6.0 * (n + chi) / fraction
    sim = at_pressure(carom.Scene.random(n, fraction, seed=1), pressure(fraction), interval=0.1, step=None)
    sim.run(time=20.0)
    found = blocking(np.array([np.prod(frame.box) for frame in sim.sample(every=0.5, count=1000)]))
    assert abs(found.mean - exact) < FOUR_SIGMA * found.error
    assert found.error < 0.01 * exact
    assert sim.statistics.worst_overlap < 1e-12


def test_g_is_measured_at_constant_pressure(plain):
    sim = at_pressure(carom.Scene.random(8, packing_fraction=0.3, dimension=2), 2.0)
    assert sim.measure(carom.RDF(), time=2.0, blocks=4).frames == 5
