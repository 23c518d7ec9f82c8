"""Packings beside spheropack (a C++ program on PyPI), at the same growth rate to the same packing fraction.

    python tests/benchmarks/packing.py [--n 1000] [--dimension 3] [--rate 0.02] [--rounds 5]

Both start from random points and grow at the same rate (mean diameter a time over the thermal speed). First
each goes to a reduced pressure of 1e6; then both go to 0.999 of the lower of the two packing fractions. The
CPU time of each is that of its process, compiled before; of the rounds the median counts. spheropack is run,
not depended on: without it, Carom is timed alone.
"""

import argparse
import statistics
import time

import carom
from carom.studies.packings.compression import points

PRESSURE = 1e6
"""Reduced pressure to which spheropack's own packing goes."""

SHARE = 0.999
"""Part of the density reached there at which both are timed: some half of the e-folds of the pressure."""


def timed(run):
    """Return the CPU seconds of a call, and what it returned."""
    began = time.process_time()
    result = run()
    return time.process_time() - began, result


def carom_run(n, dimension, rate, seed):
    """Return a packing to the same reduced pressure."""
    return carom.pack(points(n, dimension, seed=seed), rate=rate, until_Z=PRESSURE, seed=seed)


def first_above(packing, fraction):
    """Return the collisions after which a packing had reached a density."""
    history = packing.history
    return int(history["collisions"][history["packing_fraction"] >= fraction][0])


def main():
    """Time both and print a line for each, and the ratio."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--n", type=int, default=1000)
    parser.add_argument("--dimension", type=int, default=3)
    parser.add_argument("--rate", type=float, default=0.02)
    parser.add_argument("--rounds", type=int, default=5)
    args = parser.parse_args()
    try:
        import spheropack
    except ImportError:
        spheropack = None
    ours, theirs = [], []
    carom_run(args.n, args.dimension, args.rate, 0)  # compiles
    for seed in range(1, args.rounds + 1):
        seconds, full = timed(lambda: carom_run(args.n, args.dimension, args.rate, seed))  # noqa: B023
        line = f"seed {seed}: to Z = {PRESSURE:g} carom {seconds:.2f} s ({full.packing_fraction:.5f})"
        density = SHARE * full.packing_fraction
        if spheropack is not None:

            def peer(**to):
                box = spheropack.Box([1.0] * args.dimension)
                return spheropack.pack(args.n, container=box, growth_rate=args.rate, seed=seed, **to)  # noqa: B023

            stop = [spheropack.stop.Pressure(PRESSURE)]
            seconds, other = timed(lambda: peer(density="max", stop=stop))  # noqa: B023
            line += f", spheropack {seconds:.2f} s ({other.density:.5f})"
            density = min(density, SHARE * other.density)
            seconds, other = timed(lambda: peer(density=density))  # noqa: B023
            theirs.append(seconds)
        collisions = first_above(full, density)
        begun = points(args.n, args.dimension, seed=seed)
        seconds, packing = timed(
            lambda: carom.pack(begun, rate=args.rate, collisions=collisions, seed=seed)  # noqa: B023
        )
        ours.append(seconds)
        line += f"; to {density:.5f} carom {seconds:.2f} s ({packing.packing_fraction:.5f})"
        print(line + (f", spheropack {theirs[-1]:.2f} s ({other.density:.5f})" if theirs else ""), flush=True)
    mine = statistics.median(ours)
    print(f"carom: median {mine:.2f} s")
    if theirs:
        other = statistics.median(theirs)
        print(f"spheropack: median {other:.2f} s, {other / mine:.2f} times as long")


if __name__ == "__main__":
    main()
