"""Hard spheres at constant pressure, from a fluid and from a crystal: two densities where both last.

python examples/constant_pressure.py [--smoke] [--out DIR]

Fluid and crystal coexist at P = 11.5727(10) kT/sigma^3: Fernandez, Martin-Mayor, Seoane and Verrocchio,
Phys. Rev. Lett. 108 (2012) 165701. Around it either start keeps its phase for long: hysteresis.
"""

# %% Arguments: --smoke makes everything small; --out is the folder of the study, which goes on there.
import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure

import carom
from carom import theory
from carom.studies import own

COEXISTENCE = 11.5727


# %% What is asked for: pressures, from both starts.
@dataclass(frozen=True)
class PressureSpec(own.Spec):
    study = "constant pressure"
    about = "Measure the packing fraction of hard spheres at given pressures, from a fluid and a crystal."
    grid = ("pressure",)

    pressure: Annotated[
        tuple[float, ...],
        own.several(own.number(low=0.0, open_low=True)),
        own.Opt("Pressures P sigma^3 / kT.", read=own.numbers_of("--pressure")),
    ] = (7.0, 8.5, 10.0, 11.5, 13.0)
    cells: Annotated[int, own.integer(low=2), own.Opt("Cells of the crystal along each axis.")] = 3
    moves: Annotated[int, own.integer(low=64), own.Opt("Moves of the volume that are measured.")] = 5000
    seed: Annotated[int, own.integer(low=0), own.Opt("Seed of all random numbers.")] = 1

    def tasks(self):
        shared = {**self.settings(), "cells": self.cells, "moves": self.moves, "seed": self.seed}
        return [{**shared, "pressure": P, "start": start} for P in self.pressure for start in PHASES]


# %% One run: moves draw the volume; a third as many as are measured come before.
def measure(task, look):
    pressure, seed, interval = task["pressure"], task["seed"], 0.05
    n = 4 * task["cells"] ** 3
    if task["start"] == "crystal":
        scene = carom.Scene.crystal(cells=task["cells"], packing_fraction=0.55)
    else:
        scene = carom.Scene.random(n, packing_fraction=0.45, seed=seed)
    barostat = carom.Barostat(pressure, interval, seed=seed)
    sim = carom.Simulation(scene, barostat=barostat, seed=seed)
    sim.run(time=interval * task["moves"] / 3, progress=look)
    found = sim.measure(carom.Volume(), time=interval * task["moves"], progress=look)
    return {
        "eta": [found.packing_fraction.mean, found.packing_fraction.error],
        "P": [found.pressure.mean, found.pressure.error],
    }


# %% The published equations of state, at constant pressure and for as many spheres.
PHASES = {
    "fluid": (theory.kolafa_labik_malijevsky, theory.finite_size_shift, np.linspace(0.35, 0.53, 500)),
    "crystal": (theory.speedy, theory.crystal_finite_size_shift, np.linspace(0.5, 0.62, 500)),
}


def branch(phase, n):
    """Return packing fractions, and P sigma^3 / kT at each."""
    equation, law, eta = PHASES[phase]
    shift = law(eta, n, equation) + theory.constant_pressure_shift(eta, n, equation)
    return eta, eta / theory.ball_volume(3) * (equation(eta) + shift)


# %% One row a run: its packing fraction, beside that of either phase at this pressure.
@dataclass(frozen=True)
class Row:
    pressure: Annotated[float, own.Column("P", "g")]
    start: Annotated[str, own.Column("start", left=True)]
    collisional: Annotated[float, own.Column("P from collisions", own.error("collisional_error", told=True))]
    collisional_error: float
    packing_fraction: Annotated[float, own.Column("packing fraction", own.error("error", told=True))]
    error: float
    fluid: Annotated[float, own.Column("fluid", ".4f")]
    crystal: Annotated[float, own.Column("crystal", ".4f")]


@dataclass(frozen=True, repr=False)
class ConstantPressure(own.Study[PressureSpec]):
    Spec = PressureSpec
    name = "constant pressure"
    axes = "packing_fraction", "pressure", "start"
    measure = staticmethod(measure)

    @property
    def table(self):
        n = 4 * self.spec.cells**3
        branches = [branch(phase, n) for phase in PHASES]
        rows = []
        for each in self.records:
            task, result = each["task"], each["result"]
            P = task["pressure"]
            known = [float(np.interp(P, of_eta, eta, np.nan, np.nan)) for eta, of_eta in branches]
            rows.append(Row(P, task["start"], *result["P"], *result["eta"], *known))
        return own.Table(Row, sorted(rows, key=lambda row: (row.start, row.pressure)))


# %% Run it. Finished runs are not repeated: the same command goes on with a study that was stopped.
if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--smoke", action="store_true", help="few spheres and moves, at two pressures")
    parser.add_argument("--out", type=Path, default=Path("carom-constant-pressure"), help="folder")
    args = parser.parse_args()
    small = {"pressure": (5.0, 14.0), "cells": 2, "moves": 64}
    spec = PressureSpec(**(small if args.smoke else {}))
    study = ConstantPressure(spec).run(out=args.out, cores=2)
    print(study.table)
    figure = Figure(figsize=(7.0, 4.6), dpi=160, layout="constrained")
    axes = figure.add_subplot()
    for phase, marker, color in (("fluid", "o", "#1f4e79"), ("crystal", "s", "#c0392b")):
        name = {"fluid": "Kolafa, Labík and Malijevský", "crystal": "Speedy (fcc)"}[phase]
        axes.plot(*branch(phase, 4 * spec.cells**3), color=color, linewidth=1.0, label=name)
        rows = [row for row in study.table if row.start == phase]
        eta, P = [row.packing_fraction for row in rows], [row.pressure for row in rows]
        label = f"from a {phase}"
        axes.errorbar(eta, P, xerr=[row.error for row in rows], fmt=marker, color=color, label=label)
    axes.axhline(COEXISTENCE, color="#555555", linestyle=":", label=f"coexistence, P = {COEXISTENCE:.2f}")
    axes.set(xlabel=r"packing fraction $\eta$", ylabel=r"pressure $P\sigma^3/kT$", ylim=(0, 20))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=8.5, frameon=False)
    figure.savefig(args.out / "constant_pressure.png")
