"""Which spheres of a picture are hidden, and that leaving them out does not change the picture."""

import numpy as np

from carom.drawing import render
from carom.frame import Frame


def spheres(n, dimension, packing_fraction, seed):
    rng = np.random.default_rng(seed)
    edge = (n * np.pi / 6 / packing_fraction) ** (1 / 3)
    x = rng.random((n, dimension)) * edge
    return Frame(0.0, 0, x, 0 * x, (edge,) * dimension, rng.choice([1.0, 0.4], n), np.ones(n))


def test_a_disc_is_hidden_by_a_later_one_that_lies_on_it_and_not_by_an_earlier_one(monkeypatch):
    monkeypatch.setattr(render, "FEW", 0)
    centers = np.array([[0.0, 0.0], [5.0, 5.0], [5.1, 5.0], [0.05, 0.0], [9.0, 0.0]])
    radii = np.array([1.0, 0.5, 1.0, 1.2, 1.0])
    assert render.visible(centers, radii).tolist() == [False, False, True, True, True]
    assert render.visible(centers[::-1], radii[::-1]).tolist() == [True, True, True, True, True]


def test_a_disc_is_seen_if_and_only_if_a_point_shows_it(monkeypatch):
    monkeypatch.setattr(render, "FEW", 0)
    rng = np.random.default_rng(1)
    centers, radii = rng.random((200, 2)) * 5.6, rng.uniform(0.3, 1.5, 200)
    seen = render.visible(centers, radii)
    # A grid of other points, ten times finer: what shows there by a thirtieth of the disc must be seen.
    points = np.stack(np.meshgrid(*[np.arange(-1.5, 7.1, 0.02)] * 2, indexing="ij"), axis=-1)
    last = np.full(points.shape[:2], -1)
    for k, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        last[((points - center) ** 2).sum(axis=-1) < radius**2] = k
    shown = np.bincount(last[last >= 0], minlength=200) * 0.02**2 / (np.pi * radii**2)
    assert seen[shown > 1 / 10].all()
    assert not seen[shown == 0.0].any()
    assert seen.sum() < 100


def test_a_picture_without_the_hidden_spheres_is_the_same(monkeypatch):
    frame = spheres(1500, 3, 0.45, 2)
    camera = render.Camera.on(frame, 300)
    whole = render.rendered(frame, camera).astype(float)
    monkeypatch.setattr(render, "FEW", 0)
    left = render.rendered(frame, camera).astype(float)
    # One pixel in a hundred may show a sliver of what is left out.
    assert (np.abs(left - whole).max(axis=2) > 16).mean() < 0.01
