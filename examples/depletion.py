"""Potential of mean force of two big disks among small ones, which push them together: depletion.

    python examples/depletion.py [--smoke] [--out DIR]

A bond with steps of energy holds the two near each other. Round by round its energies are adjusted, until
all distances are equally frequent: umbrella sampling (G. M. Torrie and J. P. Valleau, J. Comput. Phys. 23,
187 (1977)) with the flat histogram of B. A. Berg and T. Neuhaus (Phys. Rev. Lett. 68, 9 (1992)).
"""

# %% Arguments: --smoke makes everything small, --out is the folder of the study.
import argparse
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

import carom
from carom.figures import palette
from carom.models import Andersen, Bonds, Steps, StepTable
from carom.studies import own


# %% What is asked for. The big disks have the diameter 1, and kT is 1: hard disks have no other energy.
@dataclass(frozen=True)
class DepletionSpec(own.Spec):
    study = "depletion"
    about = "Measure the potential of mean force of two big disks among small ones."
    grid = ("packing_fraction", "replicas")

    packing_fraction: Annotated[
        tuple[float, ...],
        own.several(own.number(low=0.0, high=0.5, open_low=True)),
        own.Opt("Packing fractions of the small disks.", read=own.numbers_of("--packing-fraction")),
    ] = (0.2, 0.4)
    ratio: Annotated[float, own.number(low=0.1, high=1.0), own.Opt("Diameter of the small.")] = 0.2
    time: Annotated[float, own.number(low=0.1), own.Opt("Time that a run measures.")] = 500.0
    replicas: Annotated[int, own.integer(low=2), own.Opt("Runs of each packing fraction.")] = 4

    def tasks(self):
        shared = {**self.settings(), "ratio": self.ratio, "time": self.time}
        cases = [(eta, seed) for eta in self.packing_fraction for seed in range(self.replicas)]
        return [{**shared, "packing_fraction": eta, "seed": seed} for eta, seed in cases]


# %% How often the pair is at a distance. It arrives at the end of a step as often as it is near it. Arrivals
# from both sides, over the sum of both Boltzmann factors of the bond, have neither bins nor bias.
def frequencies(scene, others, edges, time, seed, look=lambda: None, rate=0.2):
    """Return how often particles 0 and 1 are at the ``edges`` without the bond, up to a factor.

    Four rounds of a quarter of the ``time`` adjust the energies; the next one, of all of it, measures. A bath
    kicks every particle at this ``rate``; few particles alone need more kicks than a fluid.
    """
    energies = np.zeros(len(edges) - 1)
    for k in range(5):
        look()
        interaction = Bonds(
            [(0, 1)], bond=Steps(edges, [math.inf, *energies], outside=math.inf), others=others
        )
        drive = Andersen(kT=1.0, rate=rate, seed=10 * seed + k)
        sim = carom.Simulation(scene.replace(interaction=interaction, drive=drive), kT=1.0, seed=seed)
        sim.run(time=time if k == 4 else time / 4.0)
        scene = scene.replace(positions=sim.frame().positions)
        sums = sim.interaction
        bonded = np.flatnonzero(np.isfinite(sums.outer))[::-1]  # from the inside outwards
        core, into, out, bounce = sums.events[bonded].T
        arrived = np.append(core + into, 0) + np.append(0, out + bounce)
        factors = np.append(np.exp(-energies), 0.0) + np.append(0.0, np.exp(-energies))
        found = np.maximum(arrived, 0.5) / factors  # where nobody was yet, half an arrival: finite energies
        energies = 0.5 * np.log(found[1:] * found[:-1])
        energies -= energies.mean()
    return found


# %% A run: two big disks are put into a fluid of small ones, and those which overlap them are taken out.
def measure(task, look):
    eta, ratio = task["packing_fraction"], task["ratio"]
    outer, unlike = 1.0 + 2.0 * ratio, 0.5 * (1.0 + ratio)
    n = round(eta * (2.2 * outer) ** 2 / (0.25 * math.pi * ratio**2))
    fluid = carom.Scene.random(n, eta, 2, diameter=ratio, seed=task["seed"])
    big = 0.5 * np.array(fluid.box) + unlike * np.array([[-1.0, 0.0], [1.0, 0.0]])
    apart = fluid.positions[:, None] - big
    apart -= fluid.box * np.rint(apart / fluid.box)
    small = fluid.positions[(np.linalg.norm(apart, axis=2) > unlike).all(axis=1)]
    core = [[Steps([s], [math.inf]) for s in row] for row in ((1.0, unlike), (unlike, ratio))]
    species = np.repeat([0, 1], [2, len(small)])
    scene = carom.Scene([*big, *small], fluid.box, species=species, diameter=np.where(species, ratio, 1.0))
    edges = np.linspace(1.0, outer, 13)
    found = frequencies(scene, StepTable(core), edges, task["time"], task["seed"], look)
    w = -np.log(found / edges)
    return {"r": edges.tolist(), "w": (w - w[6:].mean()).tolist()}  # 0 beyond one small diameter


# %% The table, with the potential of Asakura and Oosawa (J. Chem. Phys. 22, 1255 (1954)), which is exact for
# small ones that pass through each other: their pressure times the area from which both keep them away.
@dataclass(frozen=True)
class Row:
    packing_fraction: Annotated[float, own.Column("packing fraction", "g")]
    r: Annotated[float, own.Column("r", ".4f")]
    w: Annotated[float, own.Column("w / kT", own.error("w_error", told=True))]
    w_error: float
    asakura_oosawa: Annotated[float, own.Column("Asakura and Oosawa", ".3f")]


def asakura_oosawa(r, eta, ratio):
    x = np.minimum(r / (1.0 + ratio), 1.0)  # of the distance at which both keep away from the same place
    both = 0.5 * (1.0 + ratio) ** 2 * (x * np.sqrt(1.0 - x * x) - np.arccos(x))  # the area, with a minus
    return eta / (0.25 * math.pi * ratio**2) * both


@dataclass(frozen=True, repr=False)
class Depletion(own.Study[DepletionSpec]):
    Spec = DepletionSpec
    name = "depletion"
    axes = "r", "w", "packing_fraction"
    measure = staticmethod(measure)

    @property
    def table(self):
        points = {}
        for each in self.records:
            points.setdefault(each["task"]["packing_fraction"], []).append(each["result"])
        rows = []
        for eta, results in sorted(points.items()):
            w = np.array([each["w"] for each in results])
            error = w.std(axis=0, ddof=1) / np.sqrt(len(w)) if len(w) > 1 else np.full(w.shape[1], np.nan)
            r = np.array(results[0]["r"])
            theory = asakura_oosawa(r, eta, self.spec.ratio)
            rows += [Row(eta, *each) for each in zip(r, w.mean(axis=0), error, theory, strict=True)]
        return own.Table(Row, rows)


# %% Run it, and draw the potentials with those of Asakura and Oosawa.
if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--smoke", action="store_true", help="small disks of half the size, few, for a short time"
    )
    parser.add_argument("--out", type=Path, default=Path("carom-depletion"), help="folder of the study")
    args = parser.parse_args()
    small = {"packing_fraction": (0.1,), "ratio": 0.5, "time": 10.0, "replicas": 2}
    study = Depletion(DepletionSpec(**(small if args.smoke else {}))).run(out=args.out, cores=2)
    figure = study.plot()
    for eta in study.spec.packing_fraction:
        r = np.linspace(1.0, 1.0 + 2.0 * study.spec.ratio, 200)
        theory = asakura_oosawa(r, eta, study.spec.ratio)
        name = "Asakura and Oosawa" if eta == study.spec.packing_fraction[-1] else None
        figure.axes[0].plot(r, theory, "--", color=palette.WARM, lw=1.0, label=name)
    figure.axes[0].legend(frameon=False)
    figure.savefig(args.out / "depletion.png", dpi=110)
    print(study.table)
