"""The command ``carom pack``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from carom.cli.options import Json
from carom.cli.trouble import friendly
from carom.scene_file.commands import PackSpec
from carom.spec import helps

_SAYS = helps(PackSpec)

_SCENE = "The system"
_LENGTH = "How long"
_OUTPUT = "What to write"


@friendly
def pack(
    scene: Annotated[
        Path | None, typer.Argument(help=r"Scene file (TOML): \[scene] and \[pack]. Without: random points.")
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the results.")] = Path("carom-pack"),
    seed: Annotated[int | None, typer.Option(help=_SAYS["seed"])] = None,
    as_json: Json = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the packing in the folder.")
    ] = False,
    n: Annotated[
        int | None, typer.Option("--n", help="Number of points; 1000.", rich_help_panel=_SCENE)
    ] = None,
    dimension: Annotated[
        int | None,
        typer.Option("--dimension", "-d", help="Dimension of space, 1 to 12; 3.", rich_help_panel=_SCENE),
    ] = None,
    packing_fraction: Annotated[
        float | None,
        typer.Option(
            "--packing-fraction",
            "--eta",
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
    pictures: Annotated[
        bool | None,
        typer.Option("--pictures/--no-pictures", help=_SAYS["pictures"], rich_help_panel=_OUTPUT),
    ] = None,
) -> None:
    """Compress particles until they jam: points that grow into spheres, or the spheres of a scene.

    The folder then holds packing.h5md, packing.extxyz, history.csv, summary.json, and pictures. Ctrl-C stops
    at once; `carom resume` continues it.

    [bold]Examples[/bold]

    carom pack
    carom pack --n 2000 --dimension 2 --rate 0.01 --out disks
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
    asked = (PackSpec() if scene is None else PackSpec.load(scene)).replaced(
        seed=seed, rate=rate, until_Z=until_Z, collisions=collisions, stages=stages or None, common=common,
        pictures=pictures,
    )  # fmt: skip
    with watched() as progress, compiling_told():
        from carom.scene.species import Species
        from carom.scene_file.scene_file import SceneFile
        from carom.studies.packings.compression import pack as compress

        progress("Preparing", 0.0)
        packing = compress(
            n if scene is None else SceneFile.load(scene).scene.build(asked.seed),
            dimension=dimension,
            packing_fraction=packing_fraction,
            species=[Species(count=count, diameter=diameter) for count, diameter in kinds] or None,
            walls=walls or None,
            rate=asked.rate,
            until_Z=asked.until_Z,
            collisions=asked.collisions,
            stages=asked.stages,
            common=asked.common,
            seed=asked.seed,
            out=out,
            overwrite=overwrite,
            pictures=asked.pictures,
            progress=progress,
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
