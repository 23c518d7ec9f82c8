"""Observables of frames give the same on the way and from a file: formats, dimensions, walls, mixtures."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from carom import io
from carom.errors import InputError
from carom.frame import Frame
from carom.observables import RDF, BondOrder, DensityProfile, Dynamics, Estimate

N, FRAMES, BOX = 24, 20, (7.0, 5.0, 6.0, 5.5)


def frames_of(dimension, walls, mixture):
    """Return frames of points in free flight, between walls reflected, with doubles that need all digits."""
    rng = np.random.default_rng(dimension)
    box = np.array(BOX[:dimension])
    start, velocities = rng.uniform(0.0, box, (N, dimension)), rng.normal(size=(N, dimension))
    species = np.arange(N) % 2 if mixture else None
    found = []
    for k in range(FRAMES):
        place, v = start + 0.25 * k * velocities, velocities.copy()
        images = np.floor(place / box).astype(np.int32)
        inside = place - images * box
        if walls:  # along the last axis, as in a mirror
            back = images[:, -1] % 2 == 1
            inside[back, -1], v[back, -1] = box[-1] - inside[back, -1], -v[back, -1]
            images[:, -1] = 0
        found.append(
            Frame(
                0.25 * k, k, inside, v, tuple(box), np.full(N, 1e-9), np.full(N, 1.5), images=images,
                species=species, species_names=("a", "b") if mixture else (),
                periodic=(True,) * (dimension - 1) + (not walls,),
            )
        )  # fmt: skip
    return found


def observables(dimension, walls, mixture):
    """Return new observables of all kinds that such frames have."""
    some = 1 if mixture else None
    found = [
        Dynamics(shells=2),
        Dynamics(species=some),
        DensityProfile(axis=dimension - 1, bins=5, species=some),
    ]
    if not walls:
        found.append(RDF(bins=6, rmax=2.0, pair=("a", "b") if mixture else None))
    if dimension > 1:
        found += [BondOrder(4, nearest=4, species=some, rmax=2.0, width=0.5), BondOrder(6, reach=2.0)]
    return found


def numbers(value):
    """Return all numbers in a result, however deep."""
    if isinstance(value, Estimate):
        return [value.mean, value.error]
    if is_dataclass(value):
        return [x for each in fields(value) for x in numbers(getattr(value, each.name))]
    if isinstance(value, list | tuple):
        return [x for each in value for x in numbers(each)]
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    return [value] if isinstance(value, int | float) else []


def results(frames, seen):
    """Return the numbers that observables measure."""
    for frame in frames:
        for each in seen:
            each.add(frame)
    return [numbers(each.result()) for each in seen]


CASES = [
    ("xyz", 1, False, False),
    ("xyz", 1, True, True),
    ("xyz", 2, False, True),
    ("xyz", 3, True, False),
    ("h5md", 1, False, True),
    ("h5md", 2, True, False),
    ("h5md", 3, False, True),
    ("h5md", 4, False, False),
    ("h5md", 4, True, True),
    ("gsd", 2, False, True),
    ("gsd", 3, False, False),
]


@pytest.mark.parametrize(("suffix", "dimension", "walls", "mixture"), CASES)
def test_a_file_gives_what_the_frames_gave(suffix, dimension, walls, mixture, tmp_path):
    frames = frames_of(dimension, walls, mixture)
    path = tmp_path / f"run.{suffix}"
    with io.open(path, "w") as trajectory:
        for frame in frames:
            trajectory.write(frame)
    on_the_way = results(frames, observables(dimension, walls, mixture))
    with io.open(path) as trajectory:
        from_file = results(trajectory, observables(dimension, walls, mixture))
    assert len(on_the_way) == (3 if dimension == 1 else 5) + (not walls)
    for ours, theirs in zip(on_the_way, from_file, strict=True):
        assert len(ours) >= 10
        assert np.isfinite(ours).sum() > 0.5 * len(ours)
        if suffix == "gsd":  # single precision
            assert theirs == pytest.approx(ours, rel=1e-4, abs=1e-4, nan_ok=True)
        else:
            np.testing.assert_array_equal(theirs, ours)


def test_bonds_on_a_line_and_walls_of_g_of_r_are_refused_from_files_too(tmp_path):
    with io.open(tmp_path / "run.xyz", "w") as trajectory:
        trajectory.write(frames_of(1, True, False)[0])
    with io.open(tmp_path / "run.xyz") as trajectory:
        (frame,) = trajectory
    with pytest.raises(InputError, match="on a line"):
        BondOrder(6, nearest=2).add(frame)
    with pytest.raises(InputError, match="walls"):
        RDF(rmax=2.0).add(frame)
