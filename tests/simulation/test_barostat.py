"""Constant pressure: exact distributions of the volume, bits that nothing changes, files, what is refused."""

import json
import math

import numpy as np
import pytest
from helpers.goes_on import same

import carom
from carom.errors import FileError, InputError
from carom.io import checkpoint
from carom.models import Ball, Gravity, SquareWell
from carom.models.drives import Langevin
from carom.observables.statistics import blocking
from carom.simulation.moves.barostat import VolumeMoves, volume_sums
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


def check_rods(n, pressure, kT, count):
    sim = at_pressure(rods(n, 2.0 * n), pressure, interval=0.7, step=1.0, kT=kT, seed=n)
    lengths = np.array([frame.box[0] for frame in sim.sample(every=0.7, count=count)])
    mean, variance = moments_of_rods(n, pressure / kT)
    for values, exact in ((lengths, mean), ((lengths - mean) ** 2, variance)):
        found = blocking(values)
        assert abs(found.mean - exact) < FOUR_SIGMA * found.error
        assert found.error < 0.2 * exact
    assert 0.1 * count < sim.statistics.volume_moves_accepted < 0.9 * count
    assert sim.statistics.volume_moves_tried == count
    assert sim.statistics.worst_overlap < 1e-12


def test_the_length_of_a_ring_of_rods_has_the_exact_mean_and_variance(plain):
    check_rods(2, pressure=1.5, kT=2.0, count=500)


@SLOW
@pytest.mark.parametrize("n", [3, 5])
def test_the_length_of_rings_of_rods_has_the_exact_mean_and_variance_in_long_runs(n):
    check_rods(n, pressure=1.5, kT=2.0, count=10_000)


def mixture(n=8, fraction=0.3, d=2, **more):
    sizes = np.where(np.arange(n) % 2, 1.0, 0.7)
    masses = np.where(np.arange(n) % 3, 1.0, 4.0)
    return carom.Scene.random(packing_fraction=fraction, diameter=sizes, mass=masses, dimension=d, **more)


def test_moves_of_the_volume_have_the_same_bits_however_the_run_is_cut(plain, tmp_path):
    whole = at_pressure(mixture(), 2.0, interval=0.3)
    whole.run(time=3.1)
    cut = at_pressure(mixture(), 2.0, interval=0.3)
    for part in (0.3, 0.25, 0.65):  # a move is due at the end of some
        cut.run(time=part)
    cut.save(tmp_path / "npt.h5")
    again = carom.Simulation.load(tmp_path / "npt.h5")
    assert same(cut, again, "box", "images")
    frames = list(again.sample(times=[1.2, 1.5, 1.7, 3.1]))
    assert same(whole, again, "box", "images")
    assert whole.statistics.volume_moves_tried == again.statistics.volume_moves_tried == 10
    assert 2 < whole.statistics.volume_moves_accepted == again.statistics.volume_moves_accepted < 10
    assert whole.collisions == again.collisions > 20
    assert whole.scene.box == tuple(frames[-1].box) != tuple(frames[0].box)
    assert whole.statistics.energy_drift < 1e-13
    assert whole.statistics.worst_overlap < 1e-12


def test_a_checkpoint_whose_step_was_changed_to_more_than_one_is_refused(plain, tmp_path):
    path = tmp_path / "npt.h5"
    at_pressure(mixture(), 2.0, interval=0.3).save(path)
    arrays, attributes = checkpoint.load(path)
    moves = json.loads(attributes["volume_moves"])
    moves[VolumeMoves._fields.index("step")] = 1e300
    checkpoint.save(path, arrays, {**attributes, "volume_moves": json.dumps(moves)})
    with pytest.raises(FileError, match="the step of its barostat is above 1"):
        carom.Simulation.load(path)


def test_particles_whose_engine_has_another_unit_of_time_have_the_same_boxes_and_sums(plain):
    """Speeds 2^30 times as large are beyond what the engine computes in the unit of the scene."""
    fast, found = 2.0**30, []
    for speed in (1.0, fast):
        sim = at_pressure(rods(2, 4.0), 1.5 * speed**2, interval=0.7 / speed, step=1.0, kT=2.0 * speed**2)
        sim.run(time=21.0 / speed)
        sums = volume_sums(sim._state)
        scaled = sums.volume * speed, sums.inverse * speed, sums.virial / speed
        found.append((sim.scene.box, sim.statistics.volume_moves_accepted, *scaled))
    assert sim._state.unit.exponent != 0
    assert found[0] == found[1]
    assert found[0][1] > 5


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


def test_equilibration_tunes_a_step_that_is_not_given_and_it_is_held_from_then_on(plain, tmp_path):
    """Of 200 moves 100 are accepted, within four standard errors."""
    sim = carom.Simulation(rods(8, 12.0), barostat=carom.Barostat(4.0, interval=0.25), seed=1)
    sim.run(time=0.25)
    assert sim._state.volume_moves.step == pytest.approx(2.0 / (4.0 * 12.0))
    sim.equilibrate(collisions_per_particle=150)
    held, before = sim._state.volume_moves.step, sim.statistics
    sim.save(tmp_path / "state.h5")
    for each in (sim, carom.Simulation.load(tmp_path / "state.h5")):
        each.run(time=50.0)
        after = each.statistics
        accepted = after.volume_moves_accepted - before.volume_moves_accepted
        assert each._state.volume_moves.step == held > 0.05
        assert after.volume_moves_tried - before.volume_moves_tried == 200
        assert 72 < accepted < 128
    given = at_pressure(rods(8, 12.0), 4.0)
    given.equilibrate(collisions_per_particle=20)
    assert given._state.volume_moves.step == 0.1


def test_a_state_saved_while_the_step_is_tuned_holds_it_until_it_is_tuned_again(plain, tmp_path):
    file = tmp_path / "state.h5"
    sim = carom.Simulation(rods(8, 12.0), barostat=carom.Barostat(4.0, interval=0.25), seed=1)
    sim.equilibrate(collisions_per_particle=50, progress=lambda part: part < 0.5 and sim.save(file))
    again = carom.Simulation.load(file)
    held = again._state.volume_moves.step
    assert 0.0 < held != sim._state.volume_moves.step
    again.run(time=20.0)
    assert again._state.volume_moves.step == held
    again.equilibrate(collisions_per_particle=20)
    assert again._state.volume_moves.step != held


def test_particles_at_rest_have_no_temperature_for_a_barostat(plain):
    sim = at_pressure(mixture().replace(velocities=np.zeros((8, 2))))
    with pytest.raises(InputError, match="needs a temperature"):
        sim.run(time=1.0)


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
    sim = at_pressure(carom.Scene.random(n, fraction, seed=1), pressure(fraction), interval=0.1, step=0.006)
    sim.run(time=20.0)
    found = blocking(np.array([np.prod(frame.box) for frame in sim.sample(every=0.5, count=4000)]))
    assert abs(found.mean - exact) < FOUR_SIGMA * found.error
    assert found.error < 0.01 * exact
    assert sim.statistics.worst_overlap < 1e-12


def test_frames_are_measured_each_in_its_own_box(plain):
    scene = carom.Scene.random(8, packing_fraction=0.3, dimension=2)
    frames = list(at_pressure(scene, 2.0).sample(every=0.5, count=12))
    assert len({float(frame.box[0]) for frame in frames}) > 1
    found = carom.measure(frames, carom.RDF(), carom.DensityProfile(), carom.StructureFactor())
    assert {each.frames for each in found.values()} == {12}
    # All particles are in some slab, so that the mean density is that of the frames.
    assert found["profile"].density.mean() == pytest.approx(np.mean([8.0 / np.prod(f.box) for f in frames]))
    assert np.isfinite(carom.measure(frames, carom.Dynamics())["msd"].mean_square).all()
    assert at_pressure(scene, 2.0).measure(carom.RDF(), time=2.0, blocks=4).frames == 5


def test_the_page_of_a_run_names_its_barostat(unscheduled):
    text = "pressure 2, a move at every 0.5"
    assert at_pressure(mixture(), 2.0).explain().models["barostat"] == text
    assert "barostat" not in carom.Simulation(mixture()).explain().models
