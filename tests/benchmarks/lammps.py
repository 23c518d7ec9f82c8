"""The engine compared with pseudo hard spheres, by Carom's own Verlet and by LAMMPS, in CPU seconds.

python tests/benchmarks/lammps.py                     # densities 0.1 to 0.92, N = 500 to 108 000
python tests/benchmarks/lammps.py --sizes 2048 --densities 0.5 0.85

Prints the CPU time of one core for the same stretch of time, and Z with its distance from the infinite fluid.
LAMMPS is left out where it cannot be imported. All start from one melted configuration; pseudo hard spheres
are first held at kT = 1.5 epsilon.
"""

from __future__ import annotations

import argparse
import math
import time as clock

import carom
from carom import theory
from carom.opponents.lammps import LammpsSpheres, available
from carom.opponents.pseudo_hard import PseudoHardSpheres
from carom.studies.accuracy.trade import melted


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--densities", type=float, nargs="+", default=[0.1, 0.3, 0.5, 0.7, 0.85, 0.92])
    parser.add_argument("--sizes", type=int, nargs="+", default=[500, 2048, 16384, 108000])
    parser.add_argument("--steps", type=float, nargs="+", default=[5e-4, 1e-3, 2e-3])
    parser.add_argument("--work", type=float, default=2e7, help="steps times spheres of the finest row")
    arguments = parser.parse_args()
    makes = {"verlet": PseudoHardSpheres} | ({"lammps": LammpsSpheres} if available() else {})
    print("density      N  method             time  CPU s  ratio        Z  Z / fluid - 1  kT / 1.5 eps")
    for density in arguments.densities:
        fluid = float(theory.best(3)(math.pi / 6.0 * density))
        for size in arguments.sizes:
            scene, _ = melted(carom.Scene.fcc(round((size / 4) ** (1 / 3)), density=density), 1)
            duration = arguments.work / scene.n * min(arguments.steps) * (1.5**0.5)
            sim = carom.Simulation(scene, images=False)
            sim.run(collisions=1000)
            began = clock.process_time()
            found = sim.measure(carom.Pressure(), time=duration)
            base = clock.process_time() - began
            z = found.compressibility_factor.mean
            row(density, scene.n, "engine", duration, base, base, z, fluid, 1.0)
            for name, make in makes.items():
                for step in arguments.steps:
                    system = make(scene.positions, scene.velocities, scene.box, step=step)
                    system.equilibrate(round(0.1 * duration / system.step))
                    began = clock.process_time()
                    system.run(round(duration / system.step))
                    spent = clock.process_time() - began
                    kT = 2.0 * system.action / system.time / (3 * (scene.n - 1))
                    z = 1.0 + system.virial / system.time / (3 * (scene.n - 1) * kT)
                    row(density, scene.n, f"{name} {step:g}", system.time, spent, base, z, fluid, kT)
                    getattr(system, "close", lambda: None)()


def row(density, n, method, time, spent, base, z, fluid, kT) -> None:
    """Print one line."""
    print(
        f"{density:7.2f} {n:6d}  {method:15s} {time:7.2f} {spent:6.2f} {spent / base:6.1f} "
        f"{z:8.4f} {z / fluid - 1:+14.4f} {kT:13.4f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
