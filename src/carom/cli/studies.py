"""Shared by the commands of studies: options, lists of numbers, files, and the last line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from carom.texts import visible

COMPILING = "Compiling, ten seconds or more the first time, and the first runs"
"""Text of the lines without a terminal until the first run of a study is done."""

FIRST = "First runs"
"""The same next to a bar, which has little room. A separate line reports that something is compiled."""

LENGTH = "How long"
WHERE = "Where it runs"
OUTPUT = "What to write"

RunLength = Annotated[float | None, typer.Option(help="Or: length of every run.", rich_help_panel=LENGTH)]

Equilibration = Annotated[
    float | None,
    typer.Option(help="Collisions per particle before anything is measured.", rich_help_panel=LENGTH),
]

Engine = Annotated[
    str | None,
    typer.Option(help="processes, threads, serial or mpi.", rich_help_panel=WHERE),
]

Scheduler = Annotated[
    str | None,
    typer.Option(help="Address of a Dask scheduler, e.g. tcp://host:8786.", rich_help_panel=WHERE),
]

Cores = Annotated[
    str | None,
    typer.Option(
        "--cores",
        "-j",
        help="Number of processes or threads; default one per core.",
        rich_help_panel=WHERE,
    ),
]

Report = Annotated[
    bool,
    typer.Option("--report", help="A page with tables and pictures: report.html.", rich_help_panel=OUTPUT),
]

TableAsJson = Annotated[
    bool,
    typer.Option(
        "--json",
        help="Print the table as JSON, and nothing else, to standard output.",
        rich_help_panel=OUTPUT,
    ),
]

Out = Annotated[
    Path, typer.Option("--out", "-o", help="Folder for the results; the same study continues there.")
]


MOST_POINTS = 10_000
"""Largest number of packing fractions from first to last."""


def fractions(text: str | None) -> list[float] | None:
    """Return packing fractions: numbers with commas, or first:last:count."""
    from carom.errors import InputError

    if text is None:
        return None
    try:
        if ":" in text:
            low, high, count = text.split(":")
            points, first, last = int(count), float(low), float(high)
            if points < 2:
                raise ValueError
        else:
            return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(
            f"--packing-fraction {text!r} must be numbers with commas (0.1,0.2), or first:last:count "
            "(0.1:0.4:7)."
        ) from None
    if points > MOST_POINTS:
        raise InputError(f"The count of --packing-fraction must be at most {MOST_POINTS}, found {points}.")
    # Rounded, so that 0.1:0.4:7 and 0.1,0.15,... are the same study.
    return [float(f"{first + (last - first) * k / (points - 1):.12g}") for k in range(points)]


def integers(text: str | None) -> list[int] | None:
    """Return numbers of particles: integers with commas."""
    from carom.errors import InputError

    if text is None:
        return None
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"--n {text!r} must be integers with commas, e.g. 500,1000.") from None


def where(engine: str | None, scheduler: str | None) -> str | None:
    """Return where a study runs: the value of whichever option is given."""
    from carom.errors import InputError

    if engine is not None and scheduler is not None:
        raise InputError("--engine and --scheduler contradict each other; give one of them.")
    return scheduler or engine


def reserve(spec: Any, out: Path, name: str) -> None:
    """Refuse a folder where :func:`write` would replace files of the user, or mix results; change nothing.

    Raises
    ------
    FileError
        If the folder holds other results; if it is new, and has files by the names of a study's; or if its
        study.toml was written or annotated by somebody and describes another study.
    """
    from carom.errors import FileError
    from carom.studies import places
    from carom.studies.tasks import SETTINGS

    places.refuse_others(out, "a study")
    if not (out / SETTINGS).exists():
        places.refuse_to_replace([out / f"{name}.csv", out / f"{name}.png", out / "report.html"], "a study")
    file = out / "study.toml"
    if file.exists() and places.of_the_user(file) and not _describes(file, spec):
        raise FileError(
            f"{file} was written or annotated by somebody and describes another study, so it was left as it "
            "is; choose another folder with --out, or move the file."
        )


def _describes(file: Path, spec: Any) -> bool:
    """Return whether a study file describes just this study."""
    from carom.errors import CaromError
    from carom.studies.eos.toml import load

    try:
        return bool(load(file, type(spec)) == spec)
    except CaromError:
        return False


def write(result: Any, out: Path, name: str, report: bool, pictures: bool) -> None:
    """Write the study, its table and its pictures to a folder; ``name`` is the stem of the files."""
    from carom.paths import replacing, writing
    from carom.studies.eos.toml import text
    from carom.studies.places import title

    file = out / "study.toml"
    if not _describes(file, result.spec):  # the user's own, with its comments
        with replacing(file) as temporary, writing(file):
            temporary.write_text(f"{title(f'carom {name}')}\n\n{text(result.spec)}", encoding="utf-8")
    result.save(out / f"{name}.csv")
    if pictures and result.records:
        with replacing(out / f"{name}.png") as temporary:
            result.plot(temporary)
    if report:
        result.report(out / "report.html")


def farewell(result: Any, out: Path, report: bool, as_json: bool) -> None:
    """Print where the results are; raise InputError if some runs are missing."""
    from carom.errors import InputError

    if not as_json:
        print(visible(f"Results in {out}" + (f"; open {out / 'report.html'}" if report else "")))
    if not result.complete:
        raise InputError(
            f"{len(result.records)} of {len(result.spec.tasks())} runs are done; "
            "the same command tries the rest again."
        )
