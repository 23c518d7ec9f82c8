"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from carom.cli.heartbeat import hush

Json = Annotated[
    bool, typer.Option("--json", help="Print the summary as JSON, and nothing else, to standard output.")
]
Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Show no progress.", callback=hush, expose_value=False),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")]

Cores = Annotated[
    str,
    typer.Option("--cores", "-j", help="Threads that run this one system together: a number, or auto."),
]

Trusted = Annotated[
    bool,
    typer.Option(
        "--trust-code", help="Run the Python file that a scene with range rules names (read it first)."
    ),
]


GoOn = Annotated[
    bool,
    typer.Option(
        "--resume", help="Go on with what the folder holds, or start: for scripts of a batch system."
    ),
]

FLAGS: dict[str, tuple[str, ...]] = {
    "packing_fraction": ("--packing-fraction", "--eta"),
    "dimension": ("--dimension", "-d"),
    "collisions_per_particle": ("--collisions-per-particle", "-c"),
    "cores": ("--cores", "-j"),
    "out": ("--out", "-o"),
    "quiet": ("--quiet", "-q"),
}
"""Options with more than one name, which they have in every command."""


_LACKING = "Files of other programs"

Diameter = Annotated[
    str | None,
    typer.Option(
        help="Of all particles, or of each species as NAME:1,NAME:1.4; 0 stands for points.",
        rich_help_panel=_LACKING,
    ),
]
Box = Annotated[
    str | None,
    typer.Option(help="Where a file holds none: edges, such as 10,10,10.", rich_help_panel=_LACKING),
]


def lacking(diameter: str | None, box: str | None) -> dict[str, Any]:
    """Return the options --diameter and --box as keywords of ``carom.open``."""
    from carom.errors import InputError
    from carom.spec import edges_in

    edges = None if box is None else edges_in(box)
    try:
        if diameter is None or ":" not in diameter:
            return {"diameter": None if diameter is None else float(diameter), "box": edges}
        pairs = [word.rpartition(":") for word in diameter.split(",")]
        return {"diameter": {name.strip(): float(value) for name, _, value in pairs}, "box": edges}
    except ValueError:
        raise InputError(
            f"--diameter takes a number, or one for each species as NAME:1,NAME:1.4, found {diameter!r}."
        ) from None


def number_of(cores: str | None) -> int | str | None:
    """Return the option --cores as a number if it is one, otherwise as it is."""
    return int(cores) if cores is not None and cores.isdecimal() else cores


def refuse_to_replace(*paths: Path, overwrite: bool) -> None:
    """Raise FileError for a file that exists, or that cannot be written; do nothing with --overwrite."""
    from carom.errors import FileError
    from carom.paths import writable

    for path in paths:
        if writable(path).exists() and not overwrite:
            raise FileError(f"{path} exists already and was left as it is; replace it with --overwrite.")
