"""Options of commands: those of the fields of specifications, and those that several commands share."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from carom.cli.heartbeat import hush
from carom.cli.trouble import friendly

if TYPE_CHECKING:
    from carom.spec import Spec

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


def takes(*options: inspect.Parameter) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator for a command with these options, whose errors are sentences."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        made = friendly(command)
        made.__signature__ = inspect.Signature(options)  # type: ignore[attr-defined]
        made.__annotations__ = {each.name: each.annotation for each in options}
        return made

    return decorate


def shared(name: str, hint: Any, default: Any = False) -> inspect.Parameter:
    """Return an option of many commands, such as :data:`Json`."""
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def argument(name: str, help: str, metavar: str | None = None) -> inspect.Parameter:
    """Return the argument of a command, a file; it can be left out if its name is in brackets, or unsaid."""
    hint = Annotated[Path | None, typer.Argument(help=help, metavar=metavar, show_default=False)]
    needed = metavar is not None and not metavar.startswith("[")
    return shared(name, hint, inspect.Parameter.empty if needed else None)


def option(
    name: str, kind: Any, default: Any, *flags: str, help: str = "", panel: str = ""
) -> inspect.Parameter:
    """Return an option that typer understands."""
    said = typer.Option(*(flags or FLAGS.get(name, ())), help=help, rich_help_panel=panel or None)
    return shared(name, Annotated[kind | None if default is None else kind, said], default)


def of_fields(*kinds: type[Spec]) -> list[inspect.Parameter]:
    """Return the options of the fields of specifications; without one, its default or the file's is meant."""
    from carom.declared import fields_of

    found = []
    for field in (each for kind in kinds for each in fields_of(kind).values() if each.is_option):
        opt, kind = field.opt, field.kind
        assert opt is not None
        if opt.read is not None:
            kind = list[str] if opt.many else str
        kind = next((k for k in get_args(kind) if k is not type(None) and not opt.many), kind)
        found.append(option(field.name, kind, None, *(opt.flags or ()), help=opt.help, panel=opt.panel))
    return found


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
    typer.Option(
        help="Where a file holds none: edges, such as 10,10,10, or one of a cube.", rich_help_panel=_LACKING
    ),
]


def lacking(diameter: str | None, box: str | None) -> dict[str, Any]:
    """Return the options --diameter and --box as keywords of ``carom.open``."""
    from carom.errors import InputError
    from carom.spec import edges_in

    edges: Any = None if box is None else edges_in(box)
    edges = edges[0] if edges and len(edges) == 1 else edges
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
        if os.path.lexists(writable(path)) and not overwrite:
            raise FileError(f"{path} exists already and was left as it is; replace it with --overwrite.")
