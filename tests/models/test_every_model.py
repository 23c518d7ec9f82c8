"""What holds of every model: symmetries, balance of energy, compiled as in plain Python.

Units, refits, ends of epochs and files: ``tests/simulation/test_refits.py``, over the same table.
"""

import math

import numpy as np
import pytest
from helpers import refits
from helpers.goes_on import assert_same_bits
from helpers.plain import uncompiled

import carom
from carom.models import Shear
from carom.observables.energy import without_potential
from carom.simulation.replay import Replay

RANDOM = (
    *("andersen", "langevin", "brownian", "white noise", "noise of pairs", "active", "tumbling", "hot floor"),
    *("swaps", "barostat", "units", "own drive"),
)
"""Random numbers belong to the number of a particle, and to an axis."""

DETERMINED = [name for name in refits.ROWS if name not in RANDOM]


def changed(scene, order, turn):
    """Return a scene with its particles in another ``order``, and mirrored along axis 0 if ``turn`` is -1."""
    x, v = scene.positions[order].copy(), scene.velocities[order].copy()
    if turn < 0:
        x[:, 0], v[:, 0] = (scene.box[0] - x[:, 0]) % scene.box[0], -v[:, 0]
    more = {}
    for name in ("species", "pinned"):
        if getattr(scene, name) is not None:
            more[name] = getattr(scene, name)[order]
    if scene.spins is not None:
        more["spins"] = turn * scene.spins[order]
    if isinstance(scene.motion, Shear):
        more["motion"] = Shear(turn * scene.motion.rate)
    elif isinstance(scene.motion, refits.Drifting):
        more["motion"] = refits.Drifting(g=turn * scene.motion.g)
    return scene.replace(positions=x, velocities=v, diameter=scene.diameters[order], **more)


def run(name, order=None, turn=1, **more):
    """Return the simulation of a row, and what it has to say, brought back."""
    scene, arguments = refits.ROWS[name](1.0)
    order = np.arange(scene.n) if order is None else order
    scene = changed(scene, order, turn) if turn < 0 or (order != np.arange(scene.n)).any() else scene
    sim = carom.Simulation(scene, **{key: make() for key, make in arguments.items()}, **more)
    sim.run(time=refits.duration(name, 1.0, False))
    back, frame = np.argsort(order), sim.frame()
    x = frame.positions[back].copy()
    if turn < 0:
        x[:, 0] = scene.box[0] - x[:, 0]
    found = {
        "angles": 2.0 * math.pi * x / np.array(scene.box),
        "v": frame.velocities[back] * [turn, 1],
        "diameters": frame.diameters[back],
        "collisions": sim.collisions,
    }
    if frame.spins is not None:
        found["spins"] = turn * frame.spins[back]
    for impact in sim.obstacles:
        found[impact.name] = np.array([impact.hits, impact.impulse, impact.work])
    angles = found.pop("angles")
    return sim, found | {"cosines": np.cos(angles), "sines": np.sin(angles)}


@pytest.mark.parametrize("name", DETERMINED)
def test_numbers_of_particles_and_left_and_right_are_nothing(name, plain):
    _, right = run(name)
    assert right["collisions"] > 0
    changes = [{"turn": -1}]
    if name != "own impact":  # which remembers of i and not of j
        changes.append({"order": np.array([3, 1, 5, 0, 4, 2])})
    for change in changes:
        _, found = run(name, **change)
        for key, value in right.items():
            # Places are rounded otherwise, and some ten collisions multiply that.
            np.testing.assert_allclose(found[key], value, rtol=1e-8, atol=1e-8, err_msg=key)


GIVES = ("lossy floor", "hot floor", "shaken floor", "floor on parabolas", "gravity", "own obstacle")
KEEPS = ("wells", "pinned", "own steps", "units")


def energy(sim):
    frame = sim.frame()
    found = 0.5 * float(frame.masses @ np.sum(frame.velocities**2, axis=1))
    return found + (sim.potential_energy if without_potential(sim.scene) is None else 0.0)


@pytest.mark.parametrize("name", [*GIVES, *KEEPS])
def test_energy_changes_by_the_work_of_obstacles_alone(name, plain):
    before, (sim, _) = energy(refits.simulation(name, 1.0)), run(name)
    work = sum(each.work for each in sim.obstacles)
    assert energy(sim) - before == pytest.approx(work, abs=1e-12 * abs(before))
    assert (work != 0.0) == (name in GIVES)


@pytest.mark.slow
@pytest.mark.parametrize("name", refits.ROWS)
def test_compiled_code_has_the_bits_of_plain_python(name):
    compiled, _ = run(name)
    with uncompiled():
        plain, _ = run(name)
    refits.assert_alike(plain, compiled, 0)


UNLOGGED = ("swaps", "barostat", "growth")


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("name", [name for name in refits.ROWS if name not in UNLOGGED])
def test_a_run_that_is_saved_and_the_replay_of_its_log_have_the_bits_of_one_undisturbed(name, tmp_path):
    whole, half = refits.simulation(name, 1.0), refits.simulation(name, 1.0, event_log=tmp_path / "log.h5")
    end = 3 if whole.scene.drive is not None else 18  # collisions; there are many kicks between two of them
    whole.run(collisions=end)
    with half:
        half.run(collisions=end // 3)
        assert len(list(half.sample(every=half.time / 64.0, count=3))) == 3
        again = refits.loaded(half, tmp_path / "half.h5")
    with again:
        again.run(collisions=end - again.collisions)
    refits.assert_alike(again, whole, 0)
    replay = Replay(tmp_path / "log.h5", **refits.unsaved(whole.scene))
    while replay.step():
        pass
    assert_same_bits(replay.frame(), whole.frame())
