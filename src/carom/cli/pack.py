"""The command ``carom pack``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.options import FLAGS, GoOn, Json, Quiet, file_of
from carom.cli.trouble import friendly

_SCENE = "The system"
_LENGTH = "How long"
_OUTPUT = "What to write"


@friendly
def pack(
    scene: Annotated[
        Path | None, typer.Argument(help="Scene file (TOML) to start from. Without: random points.")
    ] = None,
    out: Annotated[Path, typer.Option(*FLAGS["out"], help="Folder for the results.")] = Path("carom-pack"),
    seed: Annotated[int, typer.Option(help="Seed of all random numbers.")] = 1,
    as_json: Json = False,
    quiet: Quiet = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the packing in the folder.")
    ] = False,
    go_on: GoOn = False,
    n: Annotated[
        int | None, typer.Option("--n", help="Number of points; 1000.", rich_help_panel=_SCENE)
    ] = None,
    dimension: Annotated[
        int | None,
        typer.Option(*FLAGS["dimension"], help="Dimension of space, 1 to 12; 3.", rich_help_panel=_SCENE),
    ] = None,
    packing_fraction: Annotated[
        float | None,
        typer.Option(
            *FLAGS["packing_fraction"],
            help="Packing fraction of the start, instead of points.",
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
        bool, typer.Option("--walls", help="Hard walls instead of a periodic box.", rich_help_panel=_SCENE)
    ] = False,
    rate: Annotated[
        float | None,
        typer.Option(
            help="Growth of the mean diameter over the thermal speed. Without: 0.02 to Z = PV/NkT of "
            "1e3, then 1e-3.",
            rich_help_panel=_LENGTH,
        ),
    ] = None,
    until_Z: Annotated[
        float | None,
        typer.Option(help="Z = PV/NkT at the end; 1e10.", rich_help_panel=_LENGTH),
    ] = None,
    stage: Annotated[
        list[str] | None,
        typer.Option(
            help="Instead of both: RATE:Z. Repeat the option for each stage.", rich_help_panel=_LENGTH
        ),
    ] = None,
    collisions: Annotated[
        int | None, typer.Option(help="Number of collisions after which to stop.", rich_help_panel=_LENGTH)
    ] = None,
    common: Annotated[
        bool,
        typer.Option(
            "--common", help="One rate for all, not in proportion to size.", rich_help_panel=_LENGTH
        ),
    ] = False,
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="Three PNG files.", rich_help_panel=_OUTPUT)
    ] = True,
) -> None:
    """Compress particles until they jam.

    Points grow into spheres, or the spheres of a scene grow. The folder then holds packing.h5md,
    packing.extxyz, history.csv, summary.json, and pictures. Ctrl-C stops at once; `carom resume` continues
    it.

    [bold]Examples[/bold]

    carom pack
    carom pack --n 2000 -d 2 --rate 0.01 --out disks --resume
    carom pack --dimension 2 --species 500:1 --species 500:1.4 --out mixture
    carom pack --n 500 --stage 0.02:1e3 --stage 3e-4:1e12 --out isostatic
    carom pack scene.toml --out mine
    carom pack --n 27 --dimension 2 --rate 0.01 --collisions 100000 --out billiard
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.screen import packed, watched
    from carom.errors import InputError

    kinds = [(_count(count), diameter) for count, diameter in _pairs(species, "--species", "COUNT:DIAMETER")]
    stages = _pairs(stage, "--stage", "RATE:Z")
    if scene is not None and (n, dimension, packing_fraction, kinds, walls) != (None, None, None, [], False):
        raise InputError(
            "A scene file says what is packed: leave out --n, --dimension, --packing-fraction, --species and "
            "--walls."
        )
    if go_on and overwrite:
        raise InputError("--resume and --overwrite contradict each other; give one of them.")
    with watched() as progress, compiling_told():
        from carom.scene.species import Species
        from carom.studies.packings.compression import holds_packing, resume_packing
        from carom.studies.packings.compression import pack as compress

        progress("Preparing", 0.0)
        packing = (
            resume_packing(out, progress=progress)
            if go_on and holds_packing(out)
            else compress(
                n if scene is None else file_of(scene),
                dimension=dimension,
                packing_fraction=packing_fraction,
                species=[Species(count=count, diameter=diameter) for count, diameter in kinds] or None,
                walls=walls or None,
                rate=rate,
                until_Z=until_Z,
                collisions=collisions,
                stages=stages or None,
                common=common,
                seed=seed,
                out=out,
                overwrite=overwrite,
                pictures=pictures,
                progress=progress,
            )
        )
    packed(packing.to_dict(), out, as_json)


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


def _count(number: float) -> int:
    """Return a number of spheres as an integer."""
    from carom.errors import InputError

    if not number.is_integer() or number < 1:
        raise InputError(f"--species takes a whole number of spheres before the colon, found {number:g}.")
    return int(number)
