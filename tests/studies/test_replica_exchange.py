"""The example of replica exchange: Boltzmann's probabilities at every temperature, and the same numbers."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.drawn import strange_bars
from helpers.scripts import module_of

import carom

FOUR_SIGMA = 4.0
"""Above the standard error of five means: one run in 3000 would fail by chance, once."""


@pytest.fixture
def example():
    return module_of(Path(__file__).parents[2] / "examples" / "replica_exchange.py")


@pytest.fixture
def measure(example):
    return example.measure


def still(first, energy):
    """Return what stands for Simulation: copies that stay where they are; the ``first`` begin there."""

    class Still:
        begun, ran = 0, []

        def __init__(self, scene, kT, seed):
            assert scene.drive.kT == kT
            self.kT = kT
            self.places = first[Still.begun] if Still.begun < len(first) else scene.positions
            Still.begun += 1

        def run(self, time):
            Still.ran.append((self.kT, time))

        @property
        def potential_energy(self):
            return energy(self.places)

        def frame(self):
            return SimpleNamespace(positions=self.places)

    return Still


def test_copies_that_move_by_exchange_alone_are_where_boltzmann_has_them(example, monkeypatch, tmp_path):
    # Of three copies of two disks the first is bound, by a well of 1.
    kT, rounds = (0.4, 0.8, 1.6), 400
    places = [np.array([[1.0, 1.0], [1.0 + apart, 1.0]]) for apart in (1.2, 2.0, 2.2)]
    Still = still(places, lambda now: -1.0 if now[1, 0] - now[0, 0] < 1.5 else 0.0)
    monkeypatch.setattr(example, "carom", SimpleNamespace(Scene=carom.Scene, Simulation=Still))
    spec = example.LadderSpec(kT=kT, n=2, packing_fraction=0.1, every=1.0, rounds=rounds, seeds=(1,))
    study = example.Ladders(spec).run(executor="serial", out=tmp_path / "out")
    assert Still.ran == [(each, 1.0) for each in kT] * rounds
    bound = np.exp(1.0 / np.array(kT))
    bound /= bound.sum()
    for row, right in zip(study.table, bound, strict=True):
        assert abs(-2.0 * row.energy - right) < FOUR_SIGMA * 2.0 * row.energy_error
        assert row.energy_error < 0.03
    for i, row in enumerate(study.table[:2]):  # refused at times where the colder one is bound
        part = 1.0 + bound[i] * math.expm1(1.0 / kT[i + 1] - 1.0 / kT[i])
        assert abs(row.exchanged - part) < FOUR_SIGMA * math.sqrt(part * (1.0 - part) / (rounds / 2))
    assert study.table[2].exchanged == 0.0
    (axes,) = study.plot().axes
    assert strange_bars(axes, study.table[:]) == (3, [])


def test_copies_exchange_their_configurations(measure, monkeypatch):
    # Of three copies with the energies 0, -2 and -4 the lowest sinks to the lowest temperature, for good.
    first = carom.Scene([[0.0, 0.0], [4.0, 4.0]], 9.0)
    scenes = SimpleNamespace(random=lambda *size, **given: first.replace(interaction=given["interaction"]))
    stuck = still([first.positions + k for k in range(3)], lambda places: -2.0 * float(places[0, 0]))
    monkeypatch.setitem(measure.__globals__, "carom", SimpleNamespace(Scene=scenes, Simulation=stuck))
    ladder = {"kT": [0.01, 0.02, 0.04], "n": 2, "dimension": 2, "packing_fraction": 0.1, "every": 1.0}
    found = measure({**ladder, "rounds": 64, "seed": 1}, lambda: None)
    assert [mean for mean, _ in found["U"]] == [-2.0, -1.0, 0.0]
    # Neighbors swap places at 0, 1 and 2, and later tries are refused: 3 of 64 rounds.
    assert [64 * part / 2.0 for part in found["exchanged"]] == [2.0, 1.0, 0.0]


@pytest.mark.slow
def test_two_disks_are_bound_with_the_probability_of_boltzmann_at_every_temperature(measure):
    ladder = {"kT": [0.4, 0.8, 1.6], "n": 2, "dimension": 2, "packing_fraction": 0.1, "every": 1.0, "seed": 1}
    found = measure({**ladder, "rounds": 600}, lambda: None)
    box, width = math.sqrt(2.0 * math.pi / 4.0 / 0.1), 1.5
    bound = []
    for kT, (energy, error) in zip(ladder["kT"], found["U"], strict=True):
        well = math.pi * (width**2 - 1.0) * math.exp(1.0 / kT)
        bound.append(well / (well + box**2 - math.pi * width**2))
        assert abs(-2.0 * energy - bound[-1]) < FOUR_SIGMA * 2.0 * error
        assert error < 0.03
    for i in (0, 1):  # refused at times if the colder one is bound and the other is not
        gap = 1.0 / ladder["kT"][i] - 1.0 / ladder["kT"][i + 1]
        part = 1.0 - bound[i] * (1.0 - bound[i + 1]) * -math.expm1(-gap)
        # Of 300 tries one in five, at least, is independent: a pair is bound for some rounds.
        assert abs(found["exchanged"][i] - part) < FOUR_SIGMA * math.sqrt(part * (1.0 - part) / 60)
    again = [measure({**ladder, "rounds": 40}, lambda: None) for _ in range(2)]
    assert again[0] == again[1]
