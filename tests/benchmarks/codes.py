"""How many seeds reach the best known spherical codes, and what a seed costs.

    python tests/benchmarks/codes.py                # 4 to 40 points on S^2, 8 seeds each
    python tests/benchmarks/codes.py 35 --seeds 40
    python tests/benchmarks/codes.py 35 --seeds 40 --until      # no more seeds after one has reached it
    python tests/benchmarks/codes.py 8 10 24 -k 4 --seeds 20

One row a code: the table's angle, the best of these seeds, how many reached the table's (the best, where the
table has none), and CPU seconds a seed. One process, everything compiled before the clock starts.
"""

import argparse
import csv
import math
import time
from pathlib import Path

from carom.studies.spherical_codes.compression import Caps
from carom.studies.spherical_codes.repulsion import starts_for
from carom.studies.spherical_codes.search import Try
from carom.studies.spherical_codes.spec import RATES, CodeSpec

TABLE = Path(__file__).parents[1] / "data" / "spherical_codes.csv"


def best_known():
    """Return the angles of the table [degrees] by dimension and size."""
    lines = (line for line in TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
    names = ("sloane_deg", "exact_deg", "own_deg")
    return {
        (int(row["d"]), int(row["N"])): max(float(row[name]) for name in names if row[name])
        for row in csv.DictReader(lines)
    }


def goal_of(angle):
    """Return the cosine that a code has that reaches an angle to the digits of the table [degrees]."""
    return math.cos(math.radians(angle - 1e-7))


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("n", type=int, nargs="*", default=range(7, 41))
    parser.add_argument("-k", type=int, default=3)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--hops", type=int, default=CodeSpec.hops)
    parser.add_argument("--until", action="store_true", help="no more seeds after one has reached the table")
    parser.add_argument("--starts", type=int, help="as carom code has them, if left out")
    chosen = parser.parse_args()
    table = best_known()
    Caps.measure({"n": 9, "dimension": chosen.k, "seed": 0, "rate": 0.2})
    print("|  n | table | best found | seeds that reached it | CPU s a seed |")
    print("|---|---|---|---|---|")
    for n in chosen.n:
        begin = time.process_time()
        starts = starts_for(n) if chosen.starts is None else chosen.starts
        common = {"n": n, "dimension": chosen.k, "hops": chosen.hops, "starts": starts}
        tasks = [{**common, "seed": seed, "rate": RATES[seed % 2]} for seed in range(chosen.seeds)]
        known = table.get((chosen.k, n))
        cosines: list[float] = []
        for task in tasks:
            cosine = Try.measure(task)["cosine"]
            cosines.append(math.inf if cosine is None else cosine)
            if chosen.until and known is not None and min(cosines) <= goal_of(known):
                break
        spent = (time.process_time() - begin) / len(cosines)
        best = math.degrees(math.acos(min(cosines)))
        reached = sum(cosine <= goal_of(best if known is None else known) for cosine in cosines)
        print(
            f"| {n} | {known or '-'} | {best:.7f} | {reached} of {len(cosines)} | {spent:.1f} |", flush=True
        )


if __name__ == "__main__":
    main()
