"""The commands that make one file from another: export, view, movie; and init, which writes a scene."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from carom.cli.options import FLAGS, Box, Diameter, Overwrite, Quiet, Trusted, lacking, refuse_to_replace
from carom.cli.trouble import friendly
from carom.texts import counted, typed, visible


@friendly
def export(
    source: Annotated[
        Path, typer.Argument(help="Trajectory, also of another program, or the folder of a run or packing.")
    ],
    target: Annotated[
        Path,
        typer.Argument(help="What to write: .h5md, .extxyz, .gsd, .lammpstrj, .data (LAMMPS), .dcd, .pdb."),
    ],
    diameter: Diameter = None,
    box: Box = None,
    quiet: Quiet = False,
    overwrite: Overwrite = False,
) -> None:
    """Convert a trajectory from one format to another.

    [bold]Examples[/bold]

    carom export carom-run fluid.gsd
    carom export carom-run/trajectory.extxyz again.h5md --overwrite
    carom export carom-run fluid.lammpstrj
    carom export argon.xyz argon.h5md --diameter 3.4 --box 36,36,36
    """
    from carom.io import convert

    _write(
        target, overwrite, "Converting",
        lambda *to, **how: convert(source, *to, overwrite=overwrite, **lacking(diameter, box), **how),
    )  # fmt: skip


def _write(target: Path, overwrite: bool, doing: str, write: Callable[..., int]) -> None:
    """Let ``write`` make a file of frames, and say how many there are."""
    from carom.cli.screen import watched

    refuse_to_replace(target, overwrite=overwrite)
    with watched() as progress:
        count = write(target, progress=lambda done, total: progress(done / total, doing))
    typer.echo(visible(f"{target}: {counted(count, 'frame')}"))


@friendly
def view(
    source: Annotated[
        Path, typer.Argument(help="Trajectory, event log, or the folder of a run, packing or study.")
    ],
    out: Annotated[
        Path | None, typer.Option(*FLAGS["out"], help="Page to write; next to the source by default.")
    ] = None,
    collisions: Annotated[
        int | None, typer.Option(help="Collisions to show of an event log, at least 1; 20 000 by default.")
    ] = None,
    begin: Annotated[
        float | None,
        typer.Option(
            "--from", help="Time to begin at; an event log begins where the measurement of its run does."
        ),
    ] = None,
    end: Annotated[float | None, typer.Option("--to", help="Time to end at.")] = None,
    show: Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")] = True,
    trust_code: Trusted = False,
    overwrite: Overwrite = False,
) -> None:
    """Show a run, packing or study in the browser.

    Of an event log every collision is shown, in exact time, from where the measurement begins; of a study its
    report opens. The page is one file of HTML that needs no network; send it to whom you like. An older page
    of Carom is replaced.

    [bold]Examples[/bold]

    carom view carom-run
    carom view carom-pack --out packing.html --no-open
    carom view carom-eos
    carom view run/events.h5 --collisions 5000
    carom view run/events.h5 --from 0 --to 2.5
    """
    from carom.cli.screen import watched
    from carom.drawing.page import is_page
    from carom.errors import InputError
    from carom.layout import kind_at
    from carom.pictures.view import rules_beside, view as shown

    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        # With --overwrite a page could otherwise replace the trajectory that it shows.
        raise InputError(f"{out} has the suffix '{out.suffix}'; expected .html.")
    kind = kind_at(source)
    reported = kind is not None and kind.report
    name = "report.html" if reported else "view.html"
    page = out or (source / name if source.is_dir() else source.with_suffix(".html"))
    refuse_to_replace(page, overwrite=overwrite or is_page(page))
    if reported:
        given = {"--collisions": collisions, "--from": begin, "--to": end}
        if named := [name for name, value in given.items() if value is not None]:
            raise InputError(f"{named[0]} is of a run, and {source} holds a study; leave it out.")
        from carom.studies.at_path import load

        load(source).report(page)
    else:
        rules = rules_beside(source) if trust_code else None
        with watched("Reading"):  # a replay passes all collisions before its beginning
            shown(source, page, collisions=collisions, begin=begin, end=end, interaction=rules)
    typer.echo(visible(f"{page}: {page.stat().st_size / 1e6:.1f} MB"))
    if show:
        typer.launch(str(page))


@friendly
def movie(
    trajectory: Annotated[
        Path, typer.Argument(help="Trajectory (.h5md, .extxyz, .gsd), or the folder of a run or packing.")
    ],
    target: Annotated[Path, typer.Argument(help="What to write: .mp4 or .gif.")],
    fps: Annotated[int, typer.Option(help="Frames of the trajectory in a second, in a GIF at most 50.")] = 24,
    size: Annotated[int, typer.Option(help="Pixels of the shorter edge.")] = 480,
    color: Annotated[
        str,
        typer.Option("--color", "--colour", help="species, speed, psi_6 or rattlers (of a packing)."),
    ] = "species",
    quiet: Quiet = False,
    overwrite: Overwrite = False,
) -> None:
    """Make a movie of a run or trajectory.

    MP4 needs the package imageio-ffmpeg; GIF does not.

    [bold]Examples[/bold]

    carom movie carom-run fluid.mp4
    carom movie disks disks.gif --color psi_6 --fps 12
    carom movie carom-pack packing.gif --color rattlers
    """
    from carom.pictures.movie import movie as made

    _write(
        target, overwrite, "Drawing frames",
        lambda *to, **how: made(trajectory, *to, fps=fps, size=size, color=color, **how),
    )  # fmt: skip


@friendly
def init(
    path: Annotated[Path | None, typer.Argument(help="File to write; TEMPLATE.toml by default.")] = None,
    template: Annotated[
        str, typer.Option("--template", help="What to start from; --list shows all.")
    ] = "fluid",
    listed: Annotated[bool, typer.Option("--list", help="List the templates.")] = False,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema by which editors complete scene files.")
    ] = False,
    overwrite: Overwrite = False,
) -> None:
    """Write a commented scene file to start from.

    [bold]Examples[/bold]

    carom init
    carom init --list
    carom init disks.toml --template walls
    carom init --schema > carom-schema.json
    """
    import json

    from carom import suggestions
    from carom.cli import templates
    from carom.errors import InputError
    from carom.paths import write_text

    if schema:
        typer.echo(json.dumps(templates.schema(), indent=2))
        return
    if listed:
        typer.echo("\n".join(f"{name:<13}{templates.title(name)}" for name in templates.NAMES))
        return
    if template not in templates.NAMES:
        raise InputError(
            f"There is no template {template!r}{suggestions.suggestion(template, templates.NAMES)}; "
            "`carom init --list` shows all."
        )
    path = Path(f"{template}.toml") if path is None else path
    if path.suffix != ".toml":
        raise InputError(f"{path} has the suffix '{path.suffix}'; expected .toml.")
    texts = {path: templates.template(template, path.name)}
    if (code := templates.code(template)) is not None:
        texts[path.with_suffix(".py")] = code
    refuse_to_replace(*texts, overwrite=overwrite)
    for file, text in texts.items():
        write_text(file, text)
    command = templates.source(template).removeprefix("# ").partition(f" {template}.toml")[0]
    it = "it" if len(texts) == 1 else "them"
    typer.echo(visible(f"{' and '.join(map(str, texts))} written; edit {it}, then `{typed(command, path)}`."))
