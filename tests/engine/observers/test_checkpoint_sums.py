"""What a run has added up so far survives a checkpoint: each sum is that of a run that was never saved."""

import dataclasses
import os
import signal

import numpy as np
import pytest
from helpers.mixtures import mixture

import carom
from carom import Simulation, Species
from carom.io.events import read_events
from carom.models import Ball, Restitution
from carom.simulation.measuring import stretches
from carom.studies.packings import compression
from carom.studies.packings.compression import points

CLOCK = {"collisions_per_second", "seconds"}


def scene_of(growing=False):
    """A mixture between walls, around a ball, that loses energy where diameters do not grow."""
    return mixture(
        [20, 28], diameters=[1.0, 0.6], masses=[1.0, 0.3], dimension=2, packing_fraction=0.1, walls="y",
        obstacles=(Ball((2.0, 2.0), 0.6),), seed=2,
    ).replace(**({} if growing else {"impact": Restitution(0.95, 0.5)}))  # fmt: skip


def settings(kind, log):
    if kind == "growing":
        return {"growth": 0.01, "seed": 1}
    return {"seed": 1, "event_log": log}


def sums_of(sim):
    """Everything that a simulation has added up."""
    statistics = dataclasses.asdict(sim.statistics)
    return {
        **{name: value for name, value in statistics.items() if name not in CLOCK},
        "tally": stretches.tally(sim), "impacts": sim.obstacles, "spared": sim.statistics.spared_contacts,
        "by species": sim.collisions_by_species.tolist(), "kT": sim.kT,
        "positions": sim.frame().positions.tolist(), "images": sim.frame().images.tolist(),
    }  # fmt: skip


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("kind", ["inelastic", "growing"])
def test_every_sum_survives_a_checkpoint(tmp_path, kind):
    growing = kind == "growing"
    whole, part = (
        Simulation(scene_of(growing), **settings(kind, tmp_path / name)) for name in ("whole.h5", "part.h5")
    )
    whole.run(collisions=200)
    part.run(collisions=90)
    part.save(tmp_path / "state.h5")
    before = sums_of(part)
    loaded = Simulation.load(tmp_path / "state.h5")
    assert sums_of(loaded) == before
    assert np.sum(before["by species"]) > 90, "pairs of two species are counted twice in the table"
    assert sum(each.hits for each in before["impacts"]) > 0
    assert growing or before["spared"] > 0
    loaded.run(collisions=110)
    assert sums_of(loaded) == sums_of(whole)
    for sim in (whole, part, loaded):
        sim.close()


def test_a_checkpoint_leaves_no_event_in_memory(plain, tmp_path):
    """A kill after it would cost what the checkpoint counts on."""
    sim = Simulation(scene_of(), seed=1, event_log=tmp_path / "events.h5")
    sim.run(collisions=100)
    sim.save(tmp_path / "state.h5")
    logged = 100 + sum(each.hits for each in sim.obstacles)
    assert len(read_events(tmp_path / "events.h5").i) == logged > 100
    sim.run(collisions=100)
    sim.close()
    at_the_end = read_events(tmp_path / "events.h5")
    # As after a kill: the log has gone on, and the checkpoint has not.
    with Simulation.load(tmp_path / "state.h5") as again:
        assert len(read_events(tmp_path / "events.h5").i) == len(at_the_end.i), "loading only reads"
        again.run(collisions=40)
        again._state.flush_log()
        assert logged < len(read_events(tmp_path / "events.h5").i) < len(at_the_end.i)
        again.run(collisions=60)
    for mine, its in zip(read_events(tmp_path / "events.h5"), at_the_end, strict=True):
        assert np.array_equal(mine, its)


def test_a_packing_goes_on_inside_a_stretch_with_the_sums_of_it(plain, tmp_path, monkeypatch):
    monkeypatch.setattr(compression, "PART", 10)
    wanted = {"rate": 0.2, "until_Z": 100.0, "seed": 2, "pictures": False}
    whole = carom.pack(points(12, dimension=2, seed=1), **wanted)
    part, parts = compression.Compression._part, []

    def impatient(self):
        part(self)
        # After a part of a stretch, and before its end.
        if not parts and self.history and self.left and self.virial > 0.0:
            parts.append((self.virial, self.kT_time, self.duration))
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(compression.Compression, "_part", impatient)
    with pytest.raises(carom.Interrupted, match="carom resume"):
        carom.pack(points(12, dimension=2, seed=1), **wanted, out=tmp_path / "pack")
    assert parts
    resumed = carom.resume(tmp_path / "pack")
    assert np.array_equal(resumed.history, whole.history)
    assert np.array_equal(resumed.frame.positions, whole.frame.positions)


@pytest.mark.slow
@pytest.mark.parametrize("stretches", [2, 20])
def test_a_packing_between_walls_of_several_species_goes_on(tmp_path, stretches):
    def start():
        kinds = [Species(count=12), Species(count=18, diameter=1.4)]
        return points(None, 2, species=kinds, walls="y", seed=4)

    wanted = {"rate": 0.05, "until_Z": 1e3, "seed": 4, "pictures": False}
    whole = carom.pack(start(), **wanted)
    assert len(whole.history) > stretches
    seen = []

    def impatient(fraction, stage):
        seen.append(fraction)
        if len(seen) == stretches:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(carom.Interrupted, match="carom resume"):
        carom.pack(start(), **wanted, out=tmp_path / "pack", progress=impatient)
    later = []
    resumed = carom.resume(tmp_path / "pack", progress=lambda *look: later.append(look))
    assert len(later) == len(whole.history) + 1 - stretches, "the packing did not go on, but started again"
    assert np.array_equal(resumed.history, whole.history)
    assert np.array_equal(resumed.frame.positions, whole.frame.positions)
    assert np.array_equal(resumed.frame.diameters, whole.frame.diameters)
