"""Frames of a run go to a file in one line."""

import numpy as np
import pytest

import carom
from carom.errors import FileError, InputError


def fluid():
    return carom.Simulation(carom.Scene.random(16, 0.2, 2, seed=1), seed=1)


@pytest.mark.parametrize("name", ["a.h5md", "a.extxyz"])
def test_what_is_written_is_what_is_sampled(name, tmp_path):
    seen = []
    assert fluid().write(tmp_path / name, every=0.25, count=5, progress=seen.append) == 5
    assert seen[-1] == 1.0
    with carom.io.open(tmp_path / name) as frames:
        for found, expected in zip(frames, fluid().sample(every=0.25, count=5), strict=True):
            np.testing.assert_array_equal(found.positions, expected.positions)
            assert found.time == expected.time


def test_a_file_is_replaced_only_on_request(tmp_path):
    path = tmp_path / "a.extxyz"
    fluid().write(path, times=[0.5, 1.0])
    with pytest.raises(FileError, match="exists already"):
        fluid().write(path, every=0.5, count=1)
    assert fluid().write(path, every=0.5, count=1, overwrite=True) == 1
    with carom.io.open(path) as frames:
        assert len(frames) == 1


def test_frames_without_end_are_refused(tmp_path):
    with pytest.raises(InputError, match="needs count= with every="):
        fluid().write(tmp_path / "a.h5md", every=0.5)
    assert not list(tmp_path.iterdir())


def test_an_estimate_counts_as_a_number():
    sim = fluid()
    sim.run(collisions_per_particle=20)
    pressure = sim.measure(carom.Pressure(), collisions_per_particle=200)
    assert float(pressure) == float(pressure.Z) == pressure.Z.mean
