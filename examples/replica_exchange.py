"""Replica exchange: copies of a square-well fluid at several temperatures exchange their configurations.

    python examples/replica_exchange.py [--smoke] [--out DIR]

A copy that is stuck at a low temperature warms up, moves on, and cools down again. Each task of the study is
a ladder of all temperatures, with a seed of its own.
"""

# %% Arguments: --smoke makes everything small, --out says where the results go.
import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

import carom
from carom.models import Andersen, SquareWell
from carom.observables.statistics import blocking
from carom.studies import own


# %% What the study takes, and its tasks.
@dataclass(frozen=True)
class LadderSpec(own.Spec):
    study = "replica exchange"
    about = "Measure the energy of a square-well fluid at several temperatures by replica exchange."
    grid = ("seeds",)

    kT: Annotated[
        tuple[float, ...], own.several(own.number(low=0.01)), own.Opt("Temperatures, in order.")
    ] = (0.5, 0.6, 0.72, 0.86)
    n: Annotated[int, own.integer(low=2), own.Opt("Number of particles.")] = 64
    dimension: Annotated[int, own.integer(low=1), own.Opt("Dimension.")] = 2
    packing_fraction: Annotated[float, own.number(low=0.0), own.Opt("Packing fraction.")] = 0.3
    every: Annotated[float, own.number(low=0.0), own.Opt("Time between two exchanges.")] = 5.0
    rounds: Annotated[int, own.integer(low=32), own.Opt("Exchanges that are tried.")] = 1000
    seeds: Annotated[tuple[int, ...], own.several(own.integer(low=0)), own.Opt("A ladder for each.")] = (1, 2)

    def tasks(self):
        names = ("n", "dimension", "packing_fraction", "every", "rounds")
        shared = {**self.settings(), "kT": list(self.kT), **{name: getattr(self, name) for name in names}}
        return [{**shared, "seed": seed} for seed in self.seeds]


# %% A ladder. Neighbors exchange with the probability min(1, exp((1/kT_i - 1/kT_j) (U_i - U_j))), which keeps
# the canonical distribution of all together. Velocities are drawn anew, as the thermostat would do.
def measure(task, look):
    rng = np.random.default_rng(task["seed"])
    kT, rounds = task["kT"], task["rounds"]
    size = task["n"], task["packing_fraction"], task["dimension"]
    first = carom.Scene.random(*size, interaction=SquareWell(1.5, 1.0), seed=task["seed"])

    def at(kT, scene):
        seed = int(rng.integers(2**62))
        return carom.Simulation(scene.replace(drive=Andersen(kT, rate=1.0, seed=seed)), kT=kT, seed=seed)

    sims = [at(each, first) for each in kT]
    energies, exchanged = np.zeros((rounds, len(kT))), np.zeros(len(kT) - 1)
    for k in range(rounds):
        look()
        for sim in sims:
            sim.run(time=task["every"])
        energies[k] = U = [sim.potential_energy for sim in sims]
        for i in range(k % 2, len(kT) - 1, 2):
            if rng.random() < np.exp(min((1.0 / kT[i] - 1.0 / kT[i + 1]) * (U[i] - U[i + 1]), 0.0)):
                places = [sims[j].frame().positions for j in (i + 1, i)]
                sims[i : i + 2] = [
                    at(kT[i + side], first.replace(positions=each)) for side, each in enumerate(places)
                ]
                exchanged[i] += 1
    means = [blocking(series[rounds // 8 :] / task["n"]) for series in energies.T]
    accepted = [2.0 * count / rounds for count in exchanged]  # a pair tries in every second round
    return {"U": [[mean.mean, mean.error] for mean in means], "exchanged": [*accepted, 0.0]}


# %% The table, one row a temperature of each ladder.
@dataclass(frozen=True)
class Row:
    seed: Annotated[int, own.Column("seed", "d")]
    kT: Annotated[float, own.Column("kT", "g")]
    energy: Annotated[float, own.Column("U / N", own.error("energy_error", told=True))]
    energy_error: float
    exchanged: Annotated[float, own.Column("exchanged upwards", ".2f")]


@dataclass(frozen=True, repr=False)
class Ladders(own.Study[LadderSpec]):
    Spec = LadderSpec
    name = "replica-exchange"
    axes = "kT", "energy", "seed"
    measure = staticmethod(measure)

    @property
    def table(self):
        rows = []
        for record in self.records:
            task, result = record["task"], record["result"]
            for kT, (U, error), part in zip(task["kT"], result["U"], result["exchanged"], strict=True):
                rows.append(Row(task["seed"], kT, U, error, part))
        return own.Table(Row, rows)


# %% The run. What was finished is kept in the folder, and not run again.
def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="two particles, few rounds")
    parser.add_argument("--out", type=Path, default=Path("replica-exchange"), help="folder of the study")
    args = parser.parse_args()
    small = {"n": 2, "packing_fraction": 0.1, "rounds": 64, "every": 1.0} if args.smoke else {}
    print(Ladders(LadderSpec(**small)).run(executor="serial", out=args.out).table)


if __name__ == "__main__":
    main()
