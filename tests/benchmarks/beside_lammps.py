"""CPU time of pseudo hard spheres in LAMMPS over that of the engine, for the same stretch of time.

python tests/benchmarks/beside_lammps.py                     # densities 0.1 to 0.92, N = 500 to 100 000
python tests/benchmarks/beside_lammps.py --sizes 2048 --densities 0.5 0.85
python tests/benchmarks/beside_lammps.py --method verlet     # Carom's own velocity Verlet instead

All methods start from one melted configuration. Pseudo hard spheres are first held at kT = 1.5 epsilon. Then
the engine and every time step run in turn, on one core. A line has the median of the ratios over the turns,
their lowest and highest, Z with its standard error over the turns, and kT while it was measured.
"""

from __future__ import annotations

import argparse
import math
import time as clock

import numpy as np
from lammps_spheres import LammpsSpheres

import carom
from carom import theory
from carom.baselines.pseudo_hard import PseudoHardSpheres

METHODS = {"lammps": LammpsSpheres, "verlet": PseudoHardSpheres}

FEWEST = 200
"""Steps of a turn at least, so that LAMMPS's set-up of a run (a list and the forces) does not count."""


MELTING = 50
"""Collisions per sphere before anything is measured."""


class Engine:
    """The engine, and what it measured in every turn."""

    name = "engine"

    def __init__(self, scene: carom.Scene, seconds: float):
        self.sim = carom.Simulation(scene, tuning=carom.Tuning(images=False))
        self.sim.run(collisions=5000)  # compiles
        before, began = self.sim.time, clock.process_time()
        self.sim.run(collisions=20_000)
        self.duration = seconds * (self.sim.time - before) / (clock.process_time() - began)
        self.costs: list[float] = []
        self.z: list[float] = []
        self.kT = 1.0

    def turn(self) -> None:
        """Run for one turn."""
        before, began = self.sim.time, clock.process_time()
        found = self.sim.measure(carom.Pressure(), time=self.duration)
        self.costs.append((clock.process_time() - began) / (self.sim.time - before))
        self.z.append(found.Z.mean)


class PseudoHard:
    """Pseudo hard spheres with one time step, and what was measured in every turn."""

    def __init__(self, make, scene: carom.Scene, step: float, seconds: float, warm: float):
        self.name = f"{step:g}"
        self.system = make(scene.positions, scene.velocities, scene.box, step=step)
        began = clock.process_time()
        self.system.equilibrate(max(FEWEST, round(warm / self.system.step)))
        rate = max(FEWEST, round(warm / self.system.step)) / (clock.process_time() - began)
        self.steps = max(FEWEST, 5 * round(seconds * rate / 5))
        self.costs: list[float] = []
        self.z: list[float] = []
        self.kTs: list[float] = []

    def turn(self) -> None:
        """Run for one turn."""
        system, degrees = self.system, 3 * (self.system.n - 1)
        before = np.array([system.virial, system.action, system.time]) if system.time else np.zeros(3)
        began = clock.process_time()
        system.run(self.steps)
        self.costs.append((clock.process_time() - began) / (self.steps * system.step))
        virial, action, time = np.array([system.virial, system.action, system.time]) - before
        self.kTs.append(2.0 * action / time / degrees)
        self.z.append(1.0 + virial / time / (degrees * self.kTs[-1]))

    @property
    def kT(self) -> float:
        """Temperature over all turns."""
        return float(np.mean(self.kTs))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--densities", type=float, nargs="+", default=[0.1, 0.3, 0.5, 0.7, 0.85, 0.92])
    parser.add_argument("--sizes", type=int, nargs="+", default=[500, 2048, 16384, 100000])
    parser.add_argument("--steps", type=float, nargs="+", default=[5e-4, 1e-3, 2e-3])
    parser.add_argument("--method", choices=METHODS, default="lammps")
    parser.add_argument("--seconds", type=float, default=0.3, help="CPU time of a turn")
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--warm", type=float, default=1.0, help="time at kT before, [sigma (m/kT)^1/2]")
    arguments = parser.parse_args()
    print(f"| density | N | step | {arguments.method} / engine | lowest, highest | Z | Z / fluid - 1 | kT |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    for density in arguments.densities:
        for size in arguments.sizes:
            scene = fluid_of(size, density)
            fluid = float(theory.best(3)(math.pi / 6.0 * density))
            engine = Engine(scene, arguments.seconds)
            others = [
                PseudoHard(METHODS[arguments.method], scene, step, arguments.seconds, arguments.warm)
                for step in arguments.steps
            ]
            for _ in range(arguments.turns):
                for each in (engine, *others):
                    each.turn()
            for each in (engine, *others):
                print(line(density, scene.n, each, engine, fluid), flush=True)
                if isinstance(each, PseudoHard):
                    getattr(each.system, "close", lambda: None)()


def fluid_of(n: int, density: float) -> carom.Scene:
    """Return a fluid of n spheres in motion, from a random start."""
    scene = carom.Scene.random(n, density=density, seed=1)
    sim = carom.Simulation(scene, seed=1, tuning=carom.Tuning(images=False))
    sim.run(collisions_per_particle=MELTING)
    frame = sim.frame()
    return scene.replace(positions=frame.positions, velocities=frame.velocities)


def line(density: float, n: int, each: Engine | PseudoHard, engine: Engine, fluid: float) -> str:
    """Return a row of the table."""
    ratios = np.array(each.costs) / np.array(engine.costs)
    low, high = ratios.min(), ratios.max()
    z, error = float(np.mean(each.z)), float(np.std(each.z, ddof=1)) / math.sqrt(len(each.z))
    return (
        f"| {density:g} | {n} | {each.name} | {np.median(ratios):.1f} | {low:.1f}, {high:.1f} "
        f"| {z:.4f} ± {error:.4f} | {z / fluid - 1.0:+.4f} | {each.kT:.3f} |"
    )


if __name__ == "__main__":
    main()
