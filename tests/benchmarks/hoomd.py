"""Z at the states that HOOMD-blue is validated with: hard spheres and hard disks of three densities.

    python tests/benchmarks/hoomd.py [0.75 0.60 0.8887] [--runs 20] [--out FILE]

Without `--runs`, as many as in docs/benchmarking.md. The file holds a line for each run; the same command
computes those that it lacks, and prints the table of all. A run takes 8 to 17 seconds of CPU time.
"""

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import numpy as np

import carom
from carom import theory
from carom.observables import Estimate, combined
from carom.observables.statistics import blocking
from carom.simulation.measuring import stretches

STATES: dict[str, dict[str, Any]] = {
    "0.75": {
        "d": 3, "density": 0.75, "n": 4000, "melt": 500, "length": 10_000, "runs": 44, "claimed": 6.6566,
    },
    "0.60": {
        "d": 3, "density": 0.60, "n": 4000, "melt": 500, "length": 10_000, "runs": 8, "claimed": 4.2952,
    },
    "0.8887": {
        "d": 2, "density": 0.8887212022251435, "n": 128**2, "melt": 8000, "length": 2000, "runs": 12,
        "claimed": 9.17079 / 0.8887212022251435,
    },
}  # fmt: skip
"""Density, number of components, collisions a component before a run and in it, and Z as HOOMD's file says.

Disks so near freezing forget slowly: their runs follow each other, and only the first one is melted.
"""

BLOCK = 250
"""Collisions a component in a block."""


def simulation(state: dict[str, Any], seed: int) -> carom.Simulation:
    """Return a fluid at the density of a state, in equilibrium."""
    d = state["d"]
    eta = state["density"] * theory.ball_volume(d)
    sim = carom.Simulation(
        carom.Scene.random(state["n"], dimension=d, packing_fraction=eta, seed=seed), seed=seed, kT=1.0
    )
    sim.run(collisions_per_particle=state["melt"])
    return sim


def blocks(sim: carom.Simulation, collisions_per_particle: float) -> list[tuple[float, float]]:
    """Run on, and return Z of each block by the virial and by the collision rate."""
    d, n = sim.scene.dimension, sim.scene.n
    per = theory.collision_rate(2.0, d, n=n, diameter=1.0, mass=1.0, kT=sim.kT)
    length = stretches.time_for(sim, 0.5 * n * BLOCK)
    return [
        (
            1.0 + block.virial / block.duration / (d * n * sim.kT),
            1.0 + 2.0 * block.collisions / block.duration / n / per,
        )
        for block in stretches.blocks(sim, length, round(collisions_per_particle / BLOCK))
    ]


def mean(values: np.ndarray, correlated: bool) -> Estimate:
    """Return the mean of the values of blocks."""
    if correlated:
        return blocking(values)
    error = float(np.std(values, ddof=1)) / math.sqrt(len(values))
    return Estimate(float(values.mean()), error, float(len(values)), 1.0, len(values))


def row(name: str, lines: list[dict[str, Any]]) -> str:
    """Return Z of a state by three estimators, and corrected to infinite size."""
    state = STATES[name]
    pairs = np.concatenate([line["blocks"] for line in lines])
    eta, equation = state["density"] * theory.ball_volume(state["d"]), theory.best(state["d"])
    disks = state["d"] == 2
    by_virial, by_rate = (mean(pairs[:, k], disks) for k in (0, 1))
    # Where blocks forget slowly both routes follow the same fluctuation, and nothing is gained by both.
    both = by_virial if disks else combined(pairs[:, 0], pairs[:, 1])
    # Disks are compared at HOOMD's own size; so near the hexatic phase no equation of state holds.
    shift = 0.0 if disks else float(theory.finite_size_shift(eta, state["n"], equation))
    infinite, expected = both.mean - shift, "" if disks else f"{float(equation(eta)):.5f}"
    return (
        f"| {state['density']:.10g} | {state['n']} | {len(lines)} "
        f"| {by_virial.mean:.5f} ± {by_virial.error:.5f} | {by_rate.mean:.5f} ± {by_rate.error:.5f} "
        f"| {both.mean:.5f} ± {both.error:.5f} | {'' if disks else f'{infinite:.5f}'} "
        f"| {expected} | {state['claimed']:.5f} "
        f"| {(infinite - state['claimed']) / both.error:+.1f} |"
    )


def main() -> None:
    """Compute the runs that the file lacks, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("states", nargs="*", default=list(STATES), help="densities; all three if left out")
    parser.add_argument("--runs", type=int)
    parser.add_argument("--out", type=Path, default=Path("hoomd-states.jsonl"))
    given = parser.parse_args()
    lines = [json.loads(line) for line in given.out.read_text().splitlines()] if given.out.exists() else []
    for name in given.states:
        state = STATES[name]
        done = {line["run"] for line in lines if line["state"] == name}
        sim = None
        for run in range(given.runs or state["runs"]):
            if run in done:
                continue
            began = time.process_time()
            if sim is None or state["d"] == 3:
                sim = simulation(state, 1 + run)
            found = blocks(sim, state["length"])
            line = {"state": name, "run": run, "blocks": found, "seconds": time.process_time() - began}
            lines.append(line)
            with given.out.open("a") as file:
                file.write(json.dumps(line) + "\n")
    print("| density | N | runs | virial | rate | both | infinite N | equation | HOOMD's | standard errors |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name in given.states:
        if mine := [line for line in lines if line["state"] == name]:
            print(row(name, mine))
    print(f"{sum(line['seconds'] for line in lines):.0f} seconds of CPU time")


if __name__ == "__main__":
    main()
