"""``carom code``: the best code of some seeds, printed and kept."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from carom.cli.trouble import friendly

if TYPE_CHECKING:
    from carom.studies import SphericalCode


@friendly
def code(
    n: Annotated[int, typer.Argument(help="Number of points.")],
    k: Annotated[
        int, typer.Option("--dimension", "-k", help="Of the space of the sphere; 3 is the usual one.")
    ] = 3,
    seeds: Annotated[int, typer.Option(help="How many random starts.")] = 40,
    first: Annotated[int, typer.Option(help="The first of the seeds.")] = 0,
    rate: Annotated[
        float | None,
        typer.Option(
            help="Growth of the caps over the thermal speed. Without: 0.01 and 0.2, of even and odd seeds."
        ),
    ] = None,
    hops: Annotated[
        int, typer.Option(help="How often each seed moves a few points into holes, and climbs.")
    ] = 20,
    digits: Annotated[int, typer.Option(help="Decimal digits of the result.")] = 32,
    workers: Annotated[int | None, typer.Option(help="Processes; as many as cores.")] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="File: .json for all, .png for a picture, else one point a line."),
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a file that is there.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Search for points on a sphere whose smallest angle is as large as possible.

    Caps on great circles grow until they jam, and hops lead to better codes; the contacts of the best are
    then solved for to many digits.
    Ctrl-C ends the search with the best so far.

    [bold]Examples[/bold]

    carom code 24
    carom code 24 -k 4 --seeds 200 --rate 0.1
    carom code 12 --out icosahedron.txt
    carom code 24 --out caps.png
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.screen import watched
    from carom.errors import FileError
    from carom.io.paths import writable
    from carom.studies import CodeInterrupted, spherical_code

    if out is not None and writable(out).exists() and not overwrite:
        raise FileError(f"{out} exists already and was left as it is; replace it with --overwrite.")
    try:
        with watched() as progress, compiling_told():
            found = spherical_code(
                n,
                k,
                seeds=range(first, first + max(seeds, 0)),
                rate=rate,
                hops=hops,
                digits=digits,
                workers=workers,
                progress=progress,
            )
    except CodeInterrupted as stopped:
        if stopped.code is not None:
            _show(stopped.code, out, as_json)
        raise
    _show(found, out, as_json)


def _show(found: SphericalCode, out: Path | None, as_json: bool) -> None:
    """Write the code and print it."""
    if out is not None and out.suffix == ".png":
        found.plot(out)
    elif out is not None:
        found.save(out)
    print(json.dumps(found.summary(), indent=2, allow_nan=False) if as_json else found)
