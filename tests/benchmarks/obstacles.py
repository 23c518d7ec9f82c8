"""Many fixed obstacles, found in cells: events a CPU second, and how many obstacles a look asks.

Balls and pinned particles in turn in one process, one mover among many balls, and a polygon of many sides
and an empty box in turn. Events are contacts with particles (pinned ones too) and obstacles.

python tests/benchmarks/obstacles.py
python tests/benchmarks/obstacles.py --dimension 3 --balls 1024 --many 100000 --sides 2000
"""

import argparse
import math
import statistics
import time

import numpy as np

import carom
from carom.models import Ball, polygon


def events(sim):
    """Return contacts with particles and obstacles so far."""
    return sim.collisions + sum(impacts.hits for impacts in sim.obstacles)


def in_turn(sims, seconds, turns):
    """Return the median of events a CPU second of each simulation, run in turn."""
    rates = []
    for turn in range(turns + 1):
        row = []
        for sim in sims:
            before, began = events(sim), time.process_time()
            sim.run(walltime=seconds)
            row.append((time.process_time() - began, events(sim) - before))
        if turn:  # the first compiles
            rates.append([count / spent for spent, count in row])
    return [statistics.median(column) for column in zip(*rates, strict=True)]


def asked(sim):
    """Return the mean number of obstacles of a cell, and how many images would be asked without cells."""
    crowd = sim._state.engine.model.obstacles.chain
    return len(crowd.grid.members) / math.prod(crowd.grid.shape), len(crowd.head[0]) * 3**sim.scene.dimension


def among_balls(fixed, movers, d):
    """Return simulations of particles among fixed balls, and among as many pinned particles."""
    scene = carom.Scene.random(fixed + movers, dimension=d, packing_fraction=0.15, seed=1)
    who = np.random.default_rng(0).permutation(scene.n)
    balls = [Ball(tuple(x), 0.5) for x in scene.positions[who[:fixed]].tolist()]
    free = scene.positions[who[fixed:]]
    scenes = carom.Scene(free, scene.box, obstacles=balls), scene.replace(pinned=who[:fixed])
    return [carom.Simulation(each, seed=1) for each in scenes]


def one_mover(count, d):
    """Return a simulation of one mover among balls on a cubic lattice, and the seconds of making it."""
    edge = math.ceil(count ** (1.0 / d))
    places = (np.stack(np.unravel_index(np.arange(count), (edge,) * d), axis=1) + 0.5) * 2.3
    began = time.process_time()
    balls = [Ball(tuple(x), 0.9) for x in places.tolist()]
    scene = carom.Scene([[0.0] * d], (2.3 * edge,) * d, diameter=0.2, obstacles=balls)
    return carom.Simulation(scene, seed=1, kT=1.0), time.process_time() - began


def in_polygon(sides, n):
    """Return simulations of disks in a polygon of many sides, and in a periodic box."""
    edge, turns = math.sqrt(n / 0.3), np.arange(sides) * math.tau / sides
    corners = 0.5 * edge + 0.49 * edge * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    inner = carom.Scene.random(n, box=(0.68 * edge,) * 2, walls=True, seed=1).positions + 0.16 * edge
    walled = carom.Scene(inner, (edge,) * 2, walls=True, obstacles=polygon(corners.tolist()))
    return [carom.Simulation(each, seed=1) for each in (walled, carom.Scene(inner, (edge,) * 2))]


def main():
    """Print a line for each kind of scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dimension", type=int, default=2)
    parser.add_argument("--balls", type=int, default=1024)
    parser.add_argument("--movers", type=int, default=200)
    parser.add_argument("--many", type=int, default=100_000)
    parser.add_argument("--sides", type=int, default=2000)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=1.0)
    options = parser.parse_args()
    d, turns, seconds = options.dimension, options.turns, options.seconds

    sims = among_balls(options.balls, options.movers, d)
    balls, pinned = in_turn(sims, seconds, turns)
    print(
        f"{options.balls} balls {balls:.3g}, as many pinned particles {pinned:.3g} events / CPU s", flush=True
    )
    print("asked in a cell {:.1f}, without cells {}".format(*asked(sims[0])))

    sim, spent = one_mover(options.many, d)
    (rate,) = in_turn([sim], seconds, turns)
    print(
        f"one mover among {options.many} balls, made in {spent:.1f} CPU s: {rate:.3g} events / CPU s",
        flush=True,
    )
    print("asked in a cell {:.1f}, without cells {}".format(*asked(sim)))

    if options.sides:
        sims = in_polygon(options.sides, 500)
        inside, free = in_turn(sims, seconds, turns)
        print(f"polygon of {options.sides} sides {inside:.3g}, periodic box {free:.3g} events / CPU s")
        print("asked in a cell {:.1f}, without cells {}".format(*asked(sims[0])))


if __name__ == "__main__":
    main()
