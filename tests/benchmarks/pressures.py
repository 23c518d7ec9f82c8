"""Z of hard spheres to 2e-5 and of hard disks to 5e-5, beside the best published values.

``python tests/benchmarks/pressures.py FOLDER [--cores N] [--quick]``

Each point is planned (``carom.plan``), run and corrected to infinite size; a folder that has some of them
goes on with the rest. Three CPU hours; ``--quick`` asks for errors a hundred times as large. Two rows at the
end keep the number of disks for which Li et al. published Z. The rows go to ``results/pressures.json``, and
their table to docs/benchmarks.md; quick ones are printed only.
"""

import argparse
import csv
import datetime
import json
import math
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from pages import ROOT, processor, write_table

import carom
from carom import theory
from carom.observables.statistics import value_with_error
from carom.studies.eos.table import Row
from carom.studies.planner import outcome

ETAS = {
    3: (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.43, 0.46, 0.48, 0.494),
    2: (0.1, 0.2, 0.3, 0.4, 0.5, 0.55, 0.6, 0.65),
}
ERRORS = {3: 2e-5, 2: 5e-5}
SOURCES = {3: "Pieprzyk et al. 2019", 2: "Padé, ten virial coefficients"}

# Li, Nishikawa, Höllmer, Carillo, Maggs and Krauth, J. Chem. Phys. 157, 234111 (2022): disks in a square box,
# event-chain Monte Carlo; number of disks, packing fraction, Z, its error.
PUBLISHED = ((72, 0.65, 8.338601, 0.000086), (870, 0.67, 9.362390, 0.000029))

DATA = Path(__file__).parents[1] / "data"
STORED = Path(__file__).parent / "results" / "pressures.json"


def known(d: int, eta: float) -> tuple[float, float]:
    """Return the best published Z of the infinite fluid, and its uncertainty."""
    name = {3: "hard_spheres_fluid.csv", 2: "hard_disks_fluid.csv"}[d]
    with (DATA / name).open() as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    etas, uncertainties = ([float(row[key]) for row in rows] for key in ("eta", "uncert"))
    return float(theory.best(d)(eta)), math.exp(np.interp(eta, etas, np.log(uncertainties)))


def infinite(folder: Path, d: int, eta: float, accuracy: float) -> dict:
    """Plan and run one point of the infinite fluid, and return its row."""
    if d == 3 and eta > theory.FREEZING[3]:
        return metastable(folder, eta, accuracy)
    file = folder / outcome.NAME
    if not file.exists():
        plan = carom.plan(f"Z={ERRORS[d] * accuracy}", packing_fraction=eta, dimension=d, cores=1)
        plan.run(out=folder).save(folder)
        (folder / "size.json").write_text(json.dumps({"n": plan.design.n}))
    found = json.loads(file.read_text())
    published, uncertainty = known(d, eta)
    return {
        "d": d, "eta": eta, "N": json.loads((folder / "size.json").read_text())["n"], "infinite": True,
        "Z": found["value"], "error": found["reached"]["error"], "promised": found["promised"]["error"],
        "cpu_seconds": found["reached"]["cpu_seconds"],
        "published": published, "uncertainty": uncertainty, "source": SOURCES[d],
    }  # fmt: skip


def of_size(folder: Path, d: int, n: int, eta: float, accuracy: float) -> tuple[dict, Row]:
    """Run n particles, and return what all rows hold of them, and all that the study says of the point."""
    began = time.process_time()
    wanted = ERRORS[d] * accuracy
    study = carom.equation_of_state(
        [eta],
        n=n,
        dimension=d,
        relative_error=wanted,
        replicas=1,
        lattice="none",
        out=folder,
        executor="serial",
    )
    (point,) = study.table
    spent = folder / "cpu_seconds.json"
    if not spent.exists():
        spent.write_text(f"{time.process_time() - began:.1f}")
    row = {"d": d, "eta": eta, "N": n, "error": point.Z_error, "promised": wanted * point.Z}
    return {**row, "cpu_seconds": float(spent.read_text())}, point


def metastable(folder: Path, eta: float, accuracy: float) -> dict:
    """Run the fluid of spheres where the crystal is stable, which is not planned, and return its row."""
    row, point = of_size(folder, 3, 5793, eta, accuracy)
    published, uncertainty = known(3, eta)
    return {
        **row, "infinite": True, "Z": point.Z_infinite, "published": published, "uncertainty": uncertainty,
        "source": SOURCES[3],
    }  # fmt: skip


def finite(folder: Path, n: int, eta: float, published: float, uncertainty: float, accuracy: float) -> dict:
    """Run a fixed number of disks as in the source, and return its row."""
    row, point = of_size(folder, 2, n, eta, accuracy)
    return {
        **row, "infinite": False, "Z": point.Z, "published": published, "uncertainty": uncertainty,
        "source": "Li et al. 2022",
    }  # fmt: skip


def deviation(row: dict) -> float:
    """Return Carom minus the published value, in standard errors of both."""
    return (row["Z"] - row["published"]) / math.hypot(row["error"], row["uncertainty"])


def table(found: dict) -> str:
    """Return the rows as Markdown, with chi squared of each dimension, the CPU time, and where it was."""
    rows = found["rows"]
    lines = ["| d | packing fraction | N | Z | published | difference / error |", "|---|---|---|---|---|---|"]
    for row in rows:
        ours, published = (
            value_with_error(row[value], row[error])
            for value, error in (("Z", "error"), ("published", "uncertainty"))
        )
        lines.append(
            f"| {row['d']} | {row['eta']} | {row['N']} | {ours} | {published} | {deviation(row):+.1f} |"
        )
    chi = []
    for d in ETAS:
        away = [deviation(row) for row in rows if row["d"] == d]
        chi.append(f"{math.fsum(z * z for z in away):.1f} for {len(away)} points in d = {d}")
    kept = max(row["error"] / row["promised"] for row in rows)
    hours = math.fsum(row["cpu_seconds"] for row in rows) / 3600.0
    lines += [
        "",
        f"Chi squared: {', '.join(chi)}. {hours:.1f} CPU hours on {found['processor']}, {found['date']}. "
        f"The error reached is at most {kept:.2f} of the promised one.",
    ]
    return "\n".join(lines)


def main() -> None:
    """Make the rows that are missing, and show them all."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="errors a hundred times as large")
    given = parser.parse_args()
    accuracy = 100.0 if given.quick else 1.0
    with ProcessPoolExecutor(given.cores) as pool:
        # The densest need most time, so they start first.
        points = sorted(((d, eta) for d in ETAS for eta in ETAS[d]), key=lambda point: -point[1])
        made = [pool.submit(infinite, given.folder / f"d{d}-eta{eta}", d, eta, accuracy) for d, eta in points]
        made += [
            pool.submit(finite, given.folder / f"disks{n}-eta{eta}", n, eta, z, e, accuracy)
            for n, eta, z, e in PUBLISHED
        ]
        rows = sorted(
            (each.result() for each in made), key=lambda row: (-row["d"], not row["infinite"], row["eta"])
        )
    found = {"date": str(datetime.date.today()), "processor": processor(), "rows": rows}
    print(table(found))
    if not given.quick:
        STORED.write_text(json.dumps(found, indent=1) + "\n")
        write_table(ROOT / "docs" / "benchmarks.md", "pressures", table(found))


if __name__ == "__main__":
    main()
