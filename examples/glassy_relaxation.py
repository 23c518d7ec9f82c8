"""How long a dense liquid of many sizes remembers, with and without swaps: a study of relaxation.

python examples/glassy_relaxation.py [--smoke] [--out DIR]
"""

# %% Arguments: --smoke makes everything small; --out is the folder of the study, which goes on there.
import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

import carom
from carom.studies import own


# %% What is asked for: packing fractions, with and without swaps, and independent replicas of each.
@dataclass(frozen=True)
class RelaxationSpec(own.Spec):
    study = "relaxation"
    about = "Measure the relaxation time and chi_4 of spheres of many sizes, with and without swaps."
    grid = ("packing_fraction", "replicas")

    packing_fraction: Annotated[
        tuple[float, ...],
        own.several(own.number(low=0.0, high=0.64, open_low=True)),
        own.Opt("Packing fractions.", read=own.numbers_of("--packing-fraction")),
    ] = (0.5, 0.55, 0.58, 0.6)
    n: Annotated[int, own.integer(low=10), own.Opt("Number of spheres.")] = 300
    replicas: Annotated[int, own.integer(low=2), own.Opt("Independent runs of each point.")] = 4
    equilibration: Annotated[float, own.number(low=0.0), own.Opt("Time with swaps before.")] = 200.0
    time: Annotated[float, own.number(low=0.1), own.Opt("Time over which F_s is followed.")] = 200.0
    seed: Annotated[int, own.integer(low=0), own.Opt("Seed of all random numbers.")] = 1

    def tasks(self):
        words = {"n": self.n, "equilibration": self.equilibration, "time": self.time, "seed": self.seed}
        cases = [
            (e, s, r) for e in self.packing_fraction for s in (False, True) for r in range(self.replicas)
        ]
        shared = {**self.settings(), **words}
        return [{**shared, "packing_fraction": eta, "swaps": s, "replica": r} for eta, s, r in cases]


# %% One run: swaps bring the liquid to equilibrium; from there, with or without them, F_s at the first peak.
def scattering(sim, length, origins=9):
    """Return times up to ``length``, and F_s(k, t) of all particles at each, (starts, times).

    F_s is the mean of cos(k . displacement), k near 2 pi over the mean diameter, the center being at rest.
    """
    k = 2.0 * np.pi / sim.scene.box[0] * round(sim.scene.box[0])
    times = np.unique(np.geomspace(length / 5000, length, 60).round(6))
    begin = sim.time + np.linspace(0.0, length, origins)
    wanted = np.unique(np.concatenate([begin, (begin[:, None] + times).ravel()]))
    placed = np.array([frame.unwrapped for frame in sim.sample(times=wanted)])
    placed -= placed.mean(axis=1, keepdims=True)
    first = placed[np.searchsorted(wanted, begin)]
    later = placed[np.searchsorted(wanted, begin[:, None] + times)]
    return times, np.cos(k * (later - first[:, None])).mean(axis=(2, 3))


def measure(task, look):
    seed = 10**6 * task["seed"] + task["replica"]  # runs with and without swaps begin alike
    sizes = carom.sizes.power(task["n"], ratio=0.4492, seed=seed)
    scene = carom.Scene.random(packing_fraction=task["packing_fraction"], diameter=sizes, seed=seed)
    swaps = carom.Swaps(interval=0.1, attempts=10, within=0.2, seed=seed)
    sim = carom.Simulation(scene, swaps=swaps, seed=seed)
    sim.run(time=task["equilibration"], progress=look)
    look()
    sim = carom.Simulation(carom.Scene.from_frame(sim.frame()), swaps=swaps if task["swaps"] else None)
    times, curves = scattering(sim, task["time"])
    accepted = sim.statistics.swaps_accepted / sim.statistics.swaps_tried if task["swaps"] else 0.0
    return {"times": times.tolist(), "F_s": curves.tolist(), "accepted": accepted}


# %% One row a point: when F_s falls to 1/e, or a lower bound; n times the variance of F_s at its peak, chi_4.
def tau(times, curve):
    """Return the time at which a curve is 1/e; the last time if it stays above."""
    below = np.flatnonzero(curve < np.exp(-1.0))
    if not below.size:
        return times[-1]
    k = max(below[0], 1)
    return np.interp(np.exp(-1.0), curve[[k, k - 1]], times[[k, k - 1]])


@dataclass(frozen=True)
class Row:
    packing_fraction: Annotated[float, own.Column("packing fraction", "g")]
    swaps: Annotated[str, own.Column("swaps", left=True)]
    accepted: Annotated[float, own.Column("accepted", ".3f")]
    tau: Annotated[float, own.Column("tau", own.error("tau_error", told=True))]
    tau_error: float
    bound: Annotated[str, own.Column("", left=True)]
    chi4: Annotated[float, own.Column("chi_4 peak", own.error("chi4_error", told=True))]
    chi4_error: float


def row(eta, swapped, n, results):
    times = np.array(results[0]["times"])
    curves = np.array([each["F_s"] for each in results])  # (replicas, starts, times)
    each = curves.mean(axis=1)
    found = np.array([tau(times, curve) for curve in each])
    stays = (each > np.exp(-1.0)).all(axis=1).any()
    error = np.nan if stays else found.std(ddof=1) / np.sqrt(len(found))
    chi4 = n * curves.var(axis=(0, 1)).max()
    # Starts of one run are not independent: the error is a jackknife over runs.
    without = [n * np.delete(curves, r, axis=0).var(axis=(0, 1)).max() for r in range(len(curves))]
    return Row(
        eta, "with" if swapped else "without", np.mean([each["accepted"] for each in results]),
        found.mean(), error, "or longer" if stays else "",
        chi4, np.std(without) * np.sqrt(len(without) - 1),
    )  # fmt: skip


@dataclass(frozen=True, repr=False)
class Relaxation(own.Study[RelaxationSpec]):
    Spec = RelaxationSpec
    name = "relaxation"
    axes = "packing_fraction", "tau", "swaps"
    measure = staticmethod(measure)

    @property
    def table(self):
        points = {}
        for each in self.records:
            task = each["task"]
            points.setdefault((task["packing_fraction"], task["swaps"]), []).append(each["result"])
        done = sorted(point for point in points if len(points[point]) > 1)
        rows = [row(eta, swapped, self.spec.n, points[eta, swapped]) for eta, swapped in done]
        return own.Table(Row, rows, flagged=lambda each: bool(each.bound))


# %% Run it. Finished runs are not repeated: the same command goes on with a study that was stopped.
if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="few spheres, thin, for a short time")
    parser.add_argument("--out", type=Path, default=Path("carom-relaxation"), help="folder of the study")
    args = parser.parse_args()
    small = {"packing_fraction": (0.3, 0.45), "n": 40, "replicas": 2, "equilibration": 2.0, "time": 5.0}
    spec = RelaxationSpec(**(small if args.smoke else {}))
    study = Relaxation(spec).run(out=args.out, cores=2)
    study.save(args.out / "relaxation.csv")
    figure = study.plot()
    figure.axes[0].set_yscale("log")
    figure.savefig(args.out / "glassy_relaxation.png", dpi=110)
    print(study.table)
