"""Scenes with obstacles at the walls of the box, and what is found in them."""

import numpy as np

import carom
from carom.models import own
from carom.models.contacts.losses import Loss
from carom.models.mathematics.parabolas import first_landing
from carom.models.motions.gravity import Gravity
from carom.models.obstacles.arcs import Arc
from carom.models.obstacles.blocks import Cuboid
from carom.models.obstacles.containers import CylindricalContainer, SphericalContainer
from carom.models.obstacles.named_walls import axes_without
from carom.models.obstacles.paths import Sine
from carom.models.obstacles.planes import Plane
from carom.models.obstacles.segments import Segment
from carom.models.obstacles.with_properties import Shaken, Surface

LOSS = Loss(0.5, elastic_below=1e-6)
EDGE = 5.3  # no sum of its digits is exact


@own.obstacle
class Flypaper:
    """An obstacle at a height: whoever touches it leaves with a tenth of its speed. It knows no walls."""

    height: float = 0.0
    name: str = "floor"

    def gap(self, positions, radii, box, periodic):
        return positions[:, 1] - self.height - radii

    def encounter(self, x, v, radius, growth):
        gap = x[1] - radius - self.height
        return max(gap / -v[1], 0.0) if v[1] < 0.0 else own.NEVER

    def fall(self, g, x, v, radius, growth, now):
        return first_landing(x[1] - radius - self.height, v[1], g[1])

    def outward(self, x, axis):
        return float(axis == 1)

    def recoil(self, motion, i, mass, x, v, normal, growth, now):
        v[1] = -0.1 * v[1]


def normal(d, axis, side):
    return tuple((1.0 - 2.0 * side) * (k == axis) for k in range(d))


def floor_at(d, axis, side, before=0.0):
    """Return a plane in a wall, or so far before it."""
    return Plane(normal(d, axis, side), before - EDGE * side, "floor")


def hits(sim):
    return {each.name: each.hits for each in sim.obstacles if each.hits}


def alone(d, axis, side, obstacles, **more):
    """Return what a sphere hits that flies to a wall and back, and its speed after that."""
    place = np.full((1, d), 0.5 * EDGE)
    velocity = -np.array([normal(d, axis, side)])
    scene = carom.Scene(
        place, EDGE, walls=True, velocities=velocity, obstacles=obstacles, diameter=0.9, **more
    )
    sim = carom.Simulation(scene, seed=0)
    sim.run(time=4.0)
    return hits(sim), float(np.abs(sim.frame().velocities).max())


def every_wall():
    """A lossy floor in each wall, in one to four dimensions; in the plane also off by rounding."""
    found = []
    for d in (1, 2, 3, 4):
        for axis in range(d):
            for side in (0, 1):
                for off in (0.0, 2.0**-50, -(2.0**-50)) if d == 2 else (0.0,):
                    found.append(alone(d, axis, side, [Surface(floor_at(d, axis, side, off), LOSS)]))
    return found


def every_shape():
    """What lies in a wall in part, or touches it from inside, where it is met; and beside it."""
    ball = SphericalContainer((0.5 * EDGE,) * 2, 0.5 * EDGE, "floor")
    tube = CylindricalContainer(0, (0.5 * EDGE,) * 3, 0.5 * EDGE, "floor")
    rods = SphericalContainer((0.5 * EDGE,), 0.5 * EDGE, "floor")
    arc = Arc((0.5 * EDGE,) * 2, 0.5 * EDGE, 180.0, 180.0, "floor")
    patch = Segment((0.4 * EDGE, 0.0), (0.6 * EDGE, 0.0), 0.0, "floor")
    roof = Segment((0.4 * EDGE, EDGE), (0.6 * EDGE, EDGE), 0.0, "floor")
    block = Cuboid((0.0, -1.0), (EDGE, 0.0), 0.0, "floor")
    beside = Segment((0.7 * EDGE, 0.0), (0.9 * EDGE, 0.0), 0.0, "floor")
    return {
        "ball": alone(2, 1, 0, [Surface(ball, LOSS)]),
        "tube": alone(3, 1, 0, [Surface(tube, LOSS)]),
        "rods": alone(1, 0, 1, [Surface(rods, LOSS)]),
        "arc": alone(2, 1, 0, [Surface(arc, LOSS)]),
        "patch": alone(2, 1, 0, [Surface(patch, LOSS)]),
        "roof": alone(2, 1, 1, [Surface(roof, LOSS)]),
        "block": alone(2, 1, 0, [Surface(block, LOSS)]),
        "beside": alone(2, 1, 0, [Surface(beside, LOSS)]),
        "plain plane": alone(2, 1, 0, [floor_at(2, 1, 0)]),
        "plain patch": alone(2, 1, 1, [roof]),
        "own": alone(2, 1, 0, [Flypaper()]),
        "own, falling": alone(2, 1, 0, [Flypaper()], motion=Gravity((0.0, -0.01))),
        "own, before": alone(2, 1, 0, [Flypaper(0.1)]),
    }


def bed(obstacles, d=2, time=12.0, **more):
    """Return the simulation of spheres of two sizes that fall along the last axis."""
    g = (0.0,) * (d - 1) + (-1.0,)
    places = np.full((2, d), 2.0)
    places[:, 0], places[:, -1] = (1.0, 3.5), (2.0, 3.0)
    scene = carom.Scene(
        places, EDGE, diameter=[1.0, 0.6], walls=axes_without([True] * (d - 1) + [False]),
        velocities=np.zeros((2, d)), motion=Gravity(g), obstacles=obstacles, **more,
    )  # fmt: skip
    sim = carom.Simulation(scene, seed=0)
    sim.run(time=time)
    return sim


def beds():
    """A bed that comes to rest on a floor in the wall; the pressure on it; a floor that dips behind it."""
    found = {}
    for d in (2, 3):
        sim = bed([Surface(floor_at(d, d - 1, 0), Loss(0.3, contact_time=0.15))], d, time=7.0)
        lowest = (sim.frame().positions[:, -1] - 0.5 * sim.scene.diameters).tolist()
        pressure = sim.measure(carom.WallPressure("floor"), time=8.0, blocks=8)
        found[f"rest {d}"] = hits(sim), lowest, pressure.force.mean, pressure.area
    for path in (Sine(0.25, period=2.0), Sine(0.3, period=1.0, phase=0.25)):
        sim = bed([Shaken(floor_at(2, 1, 0), (0.0, 1.0), path)])
        found[f"shaken {path.period:g}"] = hits(sim), sim.obstacles[2].work != 0.0, sim.time
    return found


def growing():
    """Rods that grow between two planes in the walls, and next to a patch."""
    found = {}
    for name, obstacles in (
        ("planes", [floor_at(2, 1, 0), Plane((0.0, -1.0), -EDGE, "ceiling")]),
        ("patches", [Segment((0.0, 0.0), (EDGE, 0.0), 0.0, "floor"),
                     Segment((0.0, EDGE), (EDGE, EDGE), 0.0, "ceiling")]),
    ):  # fmt: skip
        scene = carom.Scene(
            [[1.0, 2.0], [4.0, 3.0]], EDGE, diameter=0.5, walls=True, velocities=[[0.1, 0.5], [0.0, -0.4]],
            obstacles=obstacles,
        )  # fmt: skip
        sim = carom.Simulation(scene, growth=0.1, seed=0)
        sim.run(time=15.0)
        gaps = [float(gap.min()) for gap in (each.gap(
            sim.frame().positions, 0.5 * sim.frame().diameters, scene.box, scene.periodic
        ) for each in obstacles)]  # fmt: skip
        found[name] = hits(sim), min(gaps)
    return found
