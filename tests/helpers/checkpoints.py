"""Small scenes of every kind of array that a checkpoint may hold."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

import carom
from carom.io import checkpoint
from carom.models import Kind, Ranges, draw
from carom.models.contacts.losses import Loss
from carom.models.motions.gravity import Gravity
from carom.models.motions.great_circles import GreatCircles
from carom.models.obstacles.paths import Sine
from carom.models.obstacles.planes import Plane
from carom.observables import HelfandCurrents
from helpers.mixtures import mixture


def turning(unit, event):
    """A rule that turns, changes kind and aims."""
    unit.target = event.other
    if draw(unit) < 0.2:
        unit.kind = 1 - unit.kind
    unit.timer = 0.3 + draw(unit)


def _units():
    rng = np.random.default_rng(1)
    kinds = [Kind("a", (2.0, 3.0), 0.5, (1.0,)), Kind("b", (2.5,), 0.0, (0.0,))]
    return carom.Scene(
        rng.uniform(0.0, 11.0, (30, 2)), (11.0, 11.0), velocities=rng.normal(size=(30, 2)),
        species=np.arange(30) % 2, diameter=0.1, interaction=Ranges(kinds, turning),
    )  # fmt: skip


def _bed():
    places = [(1.0 + 1.6 * (k % 5), 2.0 + 1.6 * (k // 5)) for k in range(6)]
    loss = Loss(0.9, contact_time=1e-3)
    floor = Plane((0.0, 1.0), 0.5, "floor", shake=Sine(0.3, 2.0), impact=loss)
    return carom.Scene(
        np.array(places), (8.5, 12.0), velocities=np.random.default_rng(1).normal(size=(6, 2)),
        walls="y", motion=Gravity((0.0, -1.0)), obstacles=[floor], impact=loss,
    )  # fmt: skip


def _column():
    places = [(0.5 + 0.9 * (k % 10), 0.5 + 0.4 * (k // 10)) for k in range(20)]
    return carom.Scene(
        np.array(places), (10.0, 400.0), diameter=1e-2, walls="y", motion=Gravity((0.0, -0.5)),
        obstacles=[Plane((0.0, 1.0), 0.25, "floor", kT=2.0, seed=3)],
    )  # fmt: skip


def _caps():
    points = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return carom.Scene(4.0 + points, box=(8.0,) * 3, diameter=0.4, motion=GreatCircles())


def _fluid(n=80, d=2, eta=0.3, **more):
    return carom.Scene.random(n, eta, d, seed=1, **more)


def _mixture(**more):
    return mixture([30, 30], diameters=[1.0, 0.5], dimension=2, packing_fraction=0.4, seed=1, **more)


WELL = carom.models.SquareWell(1.5, 1.0)

SCENES: dict[str, Any] = {
    "disks": lambda: (_fluid(), {}),
    "disks in lists": lambda: (_fluid(), {"tuning": carom.Tuning(neighbors="lists")}),
    "spheres": lambda: (carom.Scene.crystal(cells=4, packing_fraction=0.4), {}),
    "a small box": lambda: (carom.Scene.random(4, dimension=2, box=3.0, seed=1), {}),
    "a gas": lambda: (_fluid(6, 3, 1e-4), {}),
    "a mixture": lambda: (_mixture(), {"tuning": carom.Tuning(neighbors="lists")}),
    "growing": lambda: (_mixture(), {"tuning": carom.Tuning(neighbors="lists"), "growth": 1e-3}),
    "wells": lambda: (carom.Scene.crystal(cells=3, density=0.4).replace(interaction=WELL), {}),
    "lossy": lambda: (_fluid(walls="y").replace(impact=0.9), {}),
    "pinned": lambda: (_fluid().replace(pinned=np.arange(5)), {}),
    "currents": lambda: (_mixture(), {"observers": [HelfandCurrents()]}),
    "single": lambda: (_fluid(), {"tuning": carom.Tuning(precision="single")}),
    "units": lambda: (_units(), {}),
    "a bed": lambda: (_bed(), {}),
    "a column": lambda: (_column(), {}),
    "caps": lambda: (_caps(), {}),
}


def saved(name: str, path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Save a run of this name, and load it once, so that all is compiled; return what the file holds."""
    scene, settings = SCENES[name]()
    own = {"interaction": scene.interaction} if name == "units" else {}
    sim = carom.Simulation(scene, **({} if scene.velocities is not None else {"seed": 1}), **settings)
    sim.run(time=3.0)
    sim.save(path)
    used(path, own)
    return checkpoint.load(path)


def used(path: Path, own: dict[str, Any]) -> None:
    """Load a checkpoint and go on with it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim = carom.Simulation.load(path, **own)
        sim.run(time=1.0, collisions=3000, walltime=3.0)
        sim.frame()
