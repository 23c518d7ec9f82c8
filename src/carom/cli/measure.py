"""The command ``carom measure``: quantities of frames, each a line, a table and a picture."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Annotated, Any

import typer

from carom.cli.options import FLAGS, Box, Diameter, Json, Overwrite, Quiet, lacking, refuse_to_replace
from carom.cli.trouble import PARTLY, friendly
from carom.texts import typed, visible

_RDF = "Of g(r)"
_PROFILE = "Of the density profile"


@friendly
def measure(
    path: Annotated[
        Path, typer.Argument(help="Folder of a run or packing, or a trajectory, also of another program.")
    ],
    quantities: Annotated[
        list[str] | None,
        typer.Argument(help="rdf, structure, msd, order, profile, crystal. Without: all that apply."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(*FLAGS["out"], help="Folder for the tables and pictures; that of the frames."),
    ] = None,
    bins: Annotated[int | None, typer.Option(help="Number of bins.", rich_help_panel=_RDF)] = None,
    width: Annotated[
        float | None,
        typer.Option(help="Or: width of a bin, a length; 0.02 diameters.", rich_help_panel=_RDF),
    ] = None,
    rmax: Annotated[
        float | None,
        typer.Option(
            help="End of the last bin, a length; at most half the shortest edge.", rich_help_panel=_RDF
        ),
    ] = None,
    pair: Annotated[
        str | None,
        typer.Option(
            help="Two species of a mixture, by name or number: small,large. Without: every pair.",
            rich_help_panel=_RDF,
        ),
    ] = None,
    axis: Annotated[
        str | None,
        typer.Option(
            help="Axis: x, y, z or a number. Without: that of gravity or walls.", rich_help_panel=_PROFILE
        ),
    ] = None,
    diameter: Diameter = None,
    box: Box = None,
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="A picture of each: NAME.png.")
    ] = True,
    as_json: Json = False,
    quiet: Quiet = False,
    overwrite: Overwrite = False,
) -> None:
    """Measure g(r), S(k), displacements, order, density, crystals of frames.

    rdf is g(r), structure S(k), msd the mean square displacement, order psi_6 in the plane and q_6 in space,
    profile the density along an axis, crystal the largest crystalline cluster. Each gets a line here, and
    NAME.csv and NAME.png beside the frames, which replace older ones of this command. Without names it says
    what the frames hold, and measures all that apply.

    [bold]Examples[/bold]

    carom measure carom-run
    carom measure carom-run rdf msd
    carom measure carom-run/trajectory.extxyz rdf --rmax 3 --width 0.01 --out near
    carom measure mixture rdf --pair small,large
    carom measure bed profile --axis y
    carom measure dump.lammpstrj rdf crystal --diameter 1.1
    carom measure argon.xyz order --diameter 3.4 --box 36,36,36
    """  # fmt: skip
    from carom.cli.screen import watched
    from carom.errors import FileError, InputError
    from carom.io.trajectory import open_reader
    from carom.paths import refuse_dangling, writing
    from carom.studies import measuring
    from carom.studies.info import of_trajectory
    from carom.studies.result_folders import TABLES, is_table

    names = list(quantities or ())
    asked: dict[str, Any] = {}
    rdf = {
        "bins": bins,
        "width": width,
        "rmax": rmax,
        "pair": pair and tuple(map(str.strip, pair.split(","))),
    }
    if any(value is not None for value in rdf.values()):
        asked["rdf"] = rdf
    if axis is not None:
        asked["profile"] = {"axis": int(axis) if axis.isdecimal() else axis}
    for name in asked:
        if name not in names:
            raise InputError(
                f"The options of {name} go with its name: {typed('carom measure', path)} {name} ..."
            )
    wanted = [
        measuring.QUANTITIES[name].observable(**asked[name]) if name in asked else name for name in names
    ]
    folder = out or (path if path.is_dir() else path.parent)
    if folder.suffix in (".csv", ".npz", ".png"):
        raise InputError(f"--out names a folder, in which there are rdf.csv and so on; found {folder}.")
    refuse_dangling(folder)
    if folder.exists() and not folder.is_dir():
        raise FileError(f"{folder} is a file; give --out a folder.")
    for name in names or TABLES:
        if folder.exists() and name in TABLES and not is_table(folder, name):
            files = [folder / f"{name}.csv", *([folder / f"{name}.png"] if pictures else [])]
            refuse_to_replace(*files, overwrite=overwrite)
    given = {name: value for name, value in lacking(diameter, box).items() if value is not None}
    told = path.is_file() and not names and not as_json
    with open_reader(path, **given) if given or told else contextlib.nullcontext(path) as frames:
        if told and not isinstance(frames, Path):
            print(visible("\n".join(str(of_trajectory(frames)).splitlines()[:-1]), lines=True), flush=True)
        with watched() as progress:
            found = measuring.measure(frames, *wanted, progress=progress)
    if as_json:
        print(json.dumps({name: _plain(each) for name, each in found.items()}, indent=2, allow_nan=False))
    else:
        for name, each in found.items():
            print(visible(_line(name, each), lines=True), flush=True)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    written = [file for name, each in found.items() for file in _write(folder, name, each, pictures)]
    if not as_json:
        print(visible(f"{folder}: {'  '.join(written)}"))
    if {*names} - {*found}:
        raise typer.Exit(PARTLY)


def _line(name: str, found: Any) -> str:
    """Return what is printed of a quantity; of a mixture a line for each pair."""
    if isinstance(found, dict):
        return "\n".join(_line(f"{name} {pair}", each) for pair, each in found.items())
    return f"{name}: {found}"


def _plain(found: Any) -> Any:
    """Return a result as JSON values."""
    from carom.results import plain

    if isinstance(found, dict):
        return {pair: _plain(each) for pair, each in found.items()}
    return plain(found.to_dict())


def _write(folder: Path, name: str, found: Any, pictures: bool) -> list[str]:
    """Write the table of a quantity, and its picture if there is anything to draw; return their names."""
    from carom.errors import InputError

    made = []
    for suffix in (".csv", ".png") if pictures else (".csv",):
        file = folder / f"{name}{suffix}"
        with contextlib.suppress(InputError):
            found.save(file)
            made.append(file.name)
    return made
