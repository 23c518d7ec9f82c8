"""The command ``carom pack``: one packing, or a study of several seeds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.options import FLAGS, GoOn, Json, Quiet
from carom.cli.study import carry_out
from carom.cli.trouble import friendly
from carom.declared import helps
from carom.studies.packings.spec import PackSpec

_SAYS = helps(PackSpec)
_SCENE = "The system"
_LENGTH = "How long"
_SEEDS = "Several packings"
_OUTPUT = "What to write"


@friendly
def pack(
    scene: Annotated[
        Path | None, typer.Argument(help=r"Scene file (TOML): \[scene] and \[pack]. Without: random points.")
    ] = None,
    out: Annotated[Path, typer.Option(*FLAGS["out"], help="Folder for the results.")] = Path("carom-pack"),
    seed: Annotated[int | None, typer.Option(help=_SAYS["seed"])] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the packing in the folder.")
    ] = False,
    go_on: GoOn = False,
    n: Annotated[int | None, typer.Option("--n", help=_SAYS["n"], rich_help_panel=_SCENE)] = None,
    dimension: Annotated[
        int | None,
        typer.Option(*FLAGS["dimension"], help=_SAYS["dimension"], rich_help_panel=_SCENE),
    ] = None,
    packing_fraction: Annotated[
        float | None,
        typer.Option(
            *FLAGS["packing_fraction"],
            help=_SAYS["packing_fraction"],
            rich_help_panel=_SCENE,
        ),
    ] = None,
    species: Annotated[
        list[str] | None,
        typer.Option(
            help="Instead of --n: COUNT:DIAMETER. Repeat the option for each species.", rich_help_panel=_SCENE
        ),
    ] = None,
    walls: Annotated[
        bool | None, typer.Option("--walls", help=_SAYS["walls"], rich_help_panel=_SCENE)
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(help=_SAYS["rate"], rich_help_panel=_LENGTH),
    ] = None,
    until_Z: Annotated[
        float | None,
        typer.Option(help=_SAYS["until_Z"], rich_help_panel=_LENGTH),
    ] = None,
    stage: Annotated[
        list[str] | None,
        typer.Option(
            help="Instead of both: RATE:Z. Repeat the option for each stage.", rich_help_panel=_LENGTH
        ),
    ] = None,
    collisions: Annotated[int | None, typer.Option(help=_SAYS["collisions"], rich_help_panel=_LENGTH)] = None,
    common: Annotated[
        bool | None, typer.Option("--common", help=_SAYS["common"], rich_help_panel=_LENGTH)
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option(help=_SAYS["seeds"], rich_help_panel=_SEEDS),
    ] = None,
    cores: Annotated[
        str | None,
        typer.Option(
            "--cores", "-j", help="Number of processes; default one per core.", rich_help_panel=_SEEDS
        ),
    ] = None,
    report: Annotated[
        bool,
        typer.Option(
            "--report", help="A page with tables and pictures: report.html.", rich_help_panel=_SEEDS
        ),
    ] = False,
    pictures: Annotated[
        bool | None,
        typer.Option("--pictures/--no-pictures", help=_SAYS["pictures"], rich_help_panel=_OUTPUT),
    ] = None,
) -> None:
    """Compress particles until they jam.

    Points grow into spheres, or the spheres of a scene grow. The folder then holds packing.h5md,
    packing.extxyz, history.csv, summary.json, and pictures. Ctrl-C stops at once; `carom resume` continues
    it.

    With --seeds it holds a folder for each packing, pack.csv and pack.png. The same command continues a study
    that was stopped, and adds packings to it.

    [bold]Examples[/bold]

    carom pack
    carom pack --n 2000 -d 2 --rate 0.01 --out disks --resume
    carom pack --dimension 2 --species 500:1 --species 500:1.4 --out mixture
    carom pack --n 500 --stage 0.02:1e3 --stage 3e-4:1e12 --out isostatic
    carom pack scene.toml --out mine
    carom pack --n 27 --dimension 2 --rate 0.01 --collisions 100000 --out billiard
    carom pack --n 1000 --dimension 2 --rate 1e-3 --seeds 8 --report --out several
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.screen import packed, watched
    from carom.errors import InputError

    kinds = [(_whole(count), diameter) for count, diameter in _pairs(species, "--species", "COUNT:DIAMETER")]
    given = {
        "n": n, "dimension": dimension, "packing_fraction": packing_fraction, "walls": walls,
        "species": [{"count": count, "diameter": diameter} for count, diameter in kinds] or None,
        "seeds": seeds, "seed": seed, "rate": rate, "until_Z": until_Z, "collisions": collisions,
        "stages": _pairs(stage, "--stage", "RATE:Z") or None, "common": common, "pictures": pictures,
    }  # fmt: skip
    from carom.studies.packings.pack import asked_of, packed as compressed

    asked, start = asked_of(scene, given)
    if asked.seeds is not None:
        if overwrite:
            raise InputError("--overwrite is for one packing; a study of several goes on in its folder.")
        from carom.studies.packings.study import Packings

        carry_out(
            Packings(asked), out, executor=None, cores=cores, report=report, pictures=asked.pictures,
            as_json=as_json,
        )  # fmt: skip
        return
    if cores is not None or report:
        raise InputError(
            f"{'--report' if report else '--cores'} is for several packings; give --seeds, or leave it out."
        )
    if go_on and overwrite:
        raise InputError("--resume and --overwrite contradict each other; give one of them.")
    with watched() as progress, compiling_told():
        progress("Preparing", 0.0)
        found = compressed(asked, start, out, overwrite, go_on, progress)
    packed(found.to_dict(), out, as_json)


def _pairs(given: list[str] | None, option: str, form: str) -> list[tuple[float, float]]:
    """Return the values of an option, each two numbers with a colon between them."""
    from carom.errors import InputError

    result = []
    for text in given or ():
        try:
            first, second = map(float, text.split(":"))
        except ValueError:
            raise InputError(f"{option} takes {form}, two numbers, found '{text}'.") from None
        result.append((first, second))
    return result


def _whole(number: float) -> int:
    """Return a number of spheres as an integer."""
    from carom.errors import InputError

    if not number.is_integer() or number < 1:
        raise InputError(f"--species takes a whole number of spheres before the colon, found {number:g}.")
    return int(number)
