"""How well bounces in a field keep the energy.

    python tests/benchmarks/bounces.py                    # 2e5 bounces of each scene, and 1e6
    python tests/benchmarks/bounces.py --bounces 20000

One row a scene and a number of bounces: contacts with obstacles and walls of the box, collisions of pairs,
and the relative change of the energy, kinetic and potential, since the start.
"""

from __future__ import annotations

import argparse

import numpy as np

import carom
from carom.models import Ball, SphericalContainer
from carom.models.motions.gravity import Gravity
from carom.models.obstacles.planes import Plane


def round_container(dimension: int) -> carom.Scene:
    """Return one component that bounces at the bottom of a round container."""
    rest = (0.0,) * (dimension - 2)
    return carom.Scene(
        [(5.3, 1.5, *(5.0 for _ in rest))],
        (10.0,) * dimension,
        velocities=[(0.3, 0.1, *(0.2 for _ in rest))],
        walls=True,
        motion=Gravity((0.1, -1.0, *rest)),
        obstacles=[SphericalContainer((5.0,) * dimension, 4.5)],
    )


def around_a_ball() -> carom.Scene:
    """Return one disk between a round container and a ball in its middle."""
    return carom.Scene(
        [[6.0, 2.0]],
        (10.0, 10.0),
        velocities=[[3.0, 1.0]],
        walls=True,
        motion=Gravity((0.1, -1.0)),
        obstacles=[SphericalContainer((5.0, 5.0), 4.5), Ball((5.0, 5.0), 1.0)],
    )


def column() -> carom.Scene:
    """Return thirty disks over a flat floor."""
    places = [(1.0 + 1.6 * (k % 5), 2.0 + 1.6 * (k // 5)) for k in range(30)]
    return carom.Scene(
        places,
        (8.5, 40.0),
        velocities=np.random.default_rng(1).normal(size=(30, 2)),
        walls="y",
        motion=Gravity((0.0, -1.0)),
        obstacles=[Plane((0.0, 1.0), 0.5, "floor")],
    )


def count(sim: carom.Simulation) -> int:
    """Return the bounces so far."""
    return sum(each.hits for each in sim.obstacles)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--bounces", type=int, nargs="+", default=[200_000, 1_000_000])
    goals = sorted(parser.parse_args().bounces)
    scenes = {
        "a disk in a round container": round_container(2),
        "a sphere in a round container": round_container(3),
        "a disk in a round container, around a ball": around_a_ball(),
        "30 disks over a flat floor": column(),
    }
    print("| scene | bounces | collisions of pairs | energy drift |\n|---|---|---|---|")
    for name, scene in scenes.items():
        sim = carom.Simulation(scene)
        for goal in goals:
            while (bounces := count(sim)) < goal:
                # Half of what is missing, at the rate so far; at most as long again.
                missing = 0.5 * (goal - bounces) * sim.time / max(bounces, 1)
                sim.run(time=max(1.0, min(missing, sim.time)))
            drift = sim.statistics.energy_drift
            print(f"| {name} | {bounces} | {sim.collisions} | {drift:.1e} |", flush=True)


if __name__ == "__main__":
    main()
