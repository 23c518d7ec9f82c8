"""The command ``carom pack``: one packing, or a study of several seeds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from carom.cli.options import Json
from carom.cli.trouble import friendly

if TYPE_CHECKING:
    from carom.studies.packings.spec import PackSpec

_SCENE = "The system"
_LENGTH = "How long"
_SEEDS = "Several packings"
_OUTPUT = "What to write"


@friendly
def pack(
    scene: Annotated[
        Path | None,
        typer.Argument(
            help=r"Scene file (TOML) to start from, or a study file with \[pack]. Without: random points."
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the results.")] = Path("carom-pack"),
    seed: Annotated[int | None, typer.Option(help="Seed of all random numbers; 1.")] = None,
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
    seeds: Annotated[
        int | None,
        typer.Option(help="Number of packings, with seeds from --seed on.", rich_help_panel=_SEEDS),
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
        bool,
        typer.Option(
            "--pictures/--no-pictures", help="Three PNG files; pack.png of several.", rich_help_panel=_OUTPUT
        ),
    ] = True,
) -> None:
    """Compress particles until they jam: points that grow into spheres, or the spheres of a scene.

    The folder then holds packing.h5md, packing.extxyz, history.csv, summary.json, and pictures. Ctrl-C stops
    at once; `carom resume` continues it.

    With --seeds it holds a folder for each packing, pack.csv and pack.png. The same command continues a study
    that was stopped, and adds packings to it.

    [bold]Examples[/bold]

    carom pack
    carom pack --n 2000 --dimension 2 --rate 0.01 --out disks
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
    stages = _pairs(stage, "--stage", "RATE:Z")
    if (
        spec := _several(
            scene, n=n, dimension=dimension, packing_fraction=packing_fraction, species=kinds, walls=walls,
            rate=rate, until_Z=until_Z, stages=stages, collisions=collisions, common=common, seed=seed,
            seeds=seeds,
        )
    ) is not None:  # fmt: skip
        if overwrite:
            raise InputError("--overwrite is for one packing; a study of several goes on in its folder.")
        from carom.cli.study import carry_out
        from carom.studies.packings.study import Packings

        carry_out(
            Packings(spec), out, executor=None, cores=cores, report=report, pictures=pictures, as_json=as_json
        )
        return
    if cores is not None or report:
        raise InputError(
            f"{'--report' if report else '--cores'} is for several packings; give --seeds, or leave it out."
        )
    if scene is not None and (n, dimension, packing_fraction, kinds, walls) != (None, None, None, [], False):
        raise InputError(
            "A scene file says what is packed: leave out --n, --dimension, --packing-fraction, --species and "
            "--walls."
        )
    with watched() as progress, compiling_told():
        from carom.scene.species import Species
        from carom.studies.packings.compression import pack as compress

        progress("Preparing", 0.0)
        packing = compress(
            n if scene is None else scene,
            dimension=dimension,
            packing_fraction=packing_fraction,
            species=[Species(count=count, diameter=diameter) for count, diameter in kinds] or None,
            walls=walls or None,
            rate=rate,
            until_Z=until_Z,
            collisions=collisions,
            stages=stages or None,
            common=common,
            seed=1 if seed is None else seed,
            out=out,
            overwrite=overwrite,
            pictures=pictures,
            progress=progress,
        )
    packed(packing.to_dict(), out, as_json)


def _several(file: Path | None, **given: Any) -> PackSpec | None:
    """Return the study that is asked for by --seeds, or by a file with ``[pack]``; None if one packing is."""
    from carom.errors import InputError
    from carom.io.records import toml_tables
    from carom.studies.packings.spec import PackSpec
    from carom.studies.spec import read

    of_file = file is not None and "pack" in toml_tables(read(file))
    if given["seeds"] is None and not of_file:
        return None
    if file is not None and not of_file:
        raise InputError("A scene file is the start of one packing; --seeds packs points, or leave it out.")
    species = [{"count": count, "diameter": diameter} for count, diameter in given.pop("species")]
    given = {
        name: value
        for name, value in given.items()
        if value is not None and value is not False and value != []
    }
    given |= {"species": species} if species else {}
    return PackSpec(**given) if file is None else PackSpec.load(file).replaced(**given)


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
