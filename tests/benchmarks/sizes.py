"""What the correction to infinite size leaves behind for few particles: ``python tests/benchmarks/sizes.py``.

Ten CPU minutes. The last column is what the planner takes for it (carom.studies.planner.sizes.residual).
"""

import sys

from carom.studies.planner.measures import BLOCKS, PressureRun, estimates_of
from carom.studies.planner.sizes import residual
from carom.studies.planner.system import System
from carom.studies.study import Look

COLLISIONS = 12e6 if "--quick" not in sys.argv else 3e5
POINTS = {
    3: ((0.2, 0.35, 0.42, 0.45, 0.49), (64, 108, 256)),
    2: ((0.3, 0.5, 0.6, 0.66), (56, 120, 504)),
}

print("d  eta   N     relative bias after the correction  planner")
for d, (etas, sizes) in POINTS.items():
    for eta in etas:
        system = System(eta, d)
        for n in sizes:
            length = 2.0 * COLLISIONS / n
            spec = system.spec(n, collisions_per_particle=length, equilibration=1000.0, blocks=BLOCKS, seed=7)
            result = PressureRun.measure(spec.tasks()[0], Look())
            z = next(iter(estimates_of(d, result).values()))
            exact = system.z()
            bias = (z.mean - system.shift(n) - exact) / exact
            print(
                f"{d}  {eta:<4}  {n:<4}  {bias:+.1e} +- {z.error / exact:.1e}"
                f"                 {residual(system, n) / exact:.1e}",
                flush=True,
            )
