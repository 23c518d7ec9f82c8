"""``carom code``: the best code of some seeds, printed and saved."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from carom.cli.options import FLAGS, Json, Overwrite, Quiet, number_of, refuse_to_replace
from carom.cli.trouble import friendly
from carom.texts import visible

if TYPE_CHECKING:
    from carom.studies.codes.code import SphericalCode


@friendly
def code(
    n: Annotated[
        str,
        typer.Argument(
            help=r"Number of points, or a file (TOML) with \[code]: n, and options by their long names."
        ),
    ],
    dimension: Annotated[
        int | None,
        typer.Option(*FLAGS["dimension"], help="Dimension of the space of the sphere. Without: 3."),
    ] = None,
    tries: Annotated[int | None, typer.Option(help="Number of random starts. Without: 40.")] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of the first; each further one adds 1. Without: 1.")
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(
            help="Growth of the caps over the thermal speed. Without: 0.01 and 0.2, of even and odd seeds."
        ),
    ] = None,
    hops: Annotated[
        int | None,
        typer.Option(
            help="How many times each try moves points into holes and optimises again. Without: 20."
        ),
    ] = None,
    starts: Annotated[
        int | None,
        typer.Option(
            help="Sets of points that repel each other, in every try. Without: 50; fewer beyond 60 points."
        ),
    ] = None,
    digits: Annotated[int | None, typer.Option(help="Decimal digits of the result. Without: 32.")] = None,
    cores: Annotated[
        str | None, typer.Option(*FLAGS["cores"], help="Number of processes; default one per core.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(*FLAGS["out"], help="File: .json for all, .png, .csv, or else one point per line."),
    ] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Spread n points on a sphere as far apart as possible.

    Caps on great circles grow until they jam, and points repel each other; hops lead to better codes. The
    contacts of the best are then solved for to many digits.
    Ctrl-C ends the search with the best so far.

    [bold]Examples[/bold]

    carom code 24
    carom code 24 -d 4
    carom code 12 --out icosahedron.txt
    carom code 24 --out caps.png
    carom code search.toml --tries 100
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.screen import watched
    from carom.errors import InputError
    from carom.studies.codes.search import spherical_code
    from carom.studies.signals import Interrupted

    words = _words(n)
    options = {
        "dimension": dimension, "seed": seed, "tries": tries, "rate": rate, "hops": hops, "starts": starts,
        "digits": digits,
    }  # fmt: skip
    words |= {name: value for name, value in options.items() if value is not None}
    if out is not None:
        if out.suffix == ".png" and words.get("dimension", 3) != 3:
            raise InputError(
                f"A picture shows caps on a sphere in 3 dimensions, and these have {words['dimension']}; "
                "give --out with .json or .txt."
            )
        refuse_to_replace(out, overwrite=overwrite)
    try:
        with watched() as progress, compiling_told():
            found = spherical_code(**words, cores=number_of(cores), progress=progress)
    except Interrupted as stopped:
        if stopped.so_far is not None:
            _show(stopped.so_far, out, as_json)
        raise
    _show(found, out, as_json)


def _words(text: str) -> dict[str, Any]:
    """Return the arguments of the search, from a number of points or from a file."""
    from carom.errors import InputError
    from carom.studies.codes.toml import load

    if text.isdecimal():
        return {"n": int(text)}
    if Path(text).suffix != ".toml":
        raise InputError(f"N must be a number of points, or a file that ends with .toml, found {text!r}.")
    return load(text)


def _show(found: SphericalCode, out: Path | None, as_json: bool) -> None:
    """Print the code, and write it afterwards: a full disk may refuse the file."""
    if as_json:
        told = json.dumps(found.to_dict(), indent=2, allow_nan=False)
    else:
        head = f"Spherical code of {found.n} points on S^{found.dimension - 1}"
        told = "\n".join([head, *(f"  {name:<15} {visible(text)}" for name, text in found.words())])
    print(visible(told, lines=True), flush=True)
    if out is not None:
        found.save(out)
