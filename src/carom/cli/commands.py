"""The subcommands: what each takes, and which function of the library it calls."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from carom.cli.trouble import friendly

_SCENE = "The system (overrides a scene file)"
_LENGTH = "How long"
_OUTPUT = "What to write"

Json = Annotated[
    bool, typer.Option("--json", help="Print the summary as JSON, and nothing else, to standard output.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")]


Workers = Annotated[
    str,
    typer.Option("--workers", "-j", help="Threads that run this one system together: a number, or auto."),
]

Trusted = Annotated[
    bool,
    typer.Option(
        "--trust-code", help="Run the Python file that a scene with range rules names (read it first)."
    ),
]


def _workers(text: str) -> int | str:
    """Return a number of workers, where the option holds one."""
    return int(text) if text.isdecimal() else text


@friendly
def run(
    scene: Annotated[
        Path | None,
        typer.Argument(help="Scene file (TOML), as `carom init` writes it. Without: 2048 hard spheres."),
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the results.")] = Path("carom-run"),
    seed: Annotated[int | None, typer.Option(help="Seed of all random numbers.")] = None,
    as_json: Json = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the run in the folder.")] = False,
    initial: Annotated[
        str | None,
        typer.Option(help="fcc, triangular, cubic, dn or random.", rich_help_panel=_SCENE),
    ] = None,
    dimension: Annotated[
        int | None,
        typer.Option(
            "--dimension",
            "-d",
            help="Dimension of space. Alone, 1 to 6: a fluid of that dimension.",
            rich_help_panel=_SCENE,
        ),
    ] = None,
    n: Annotated[int | None, typer.Option("--n", help="Number of spheres.", rich_help_panel=_SCENE)] = None,
    cells: Annotated[
        int | None, typer.Option(help="Or: cells of the lattice along each axis.", rich_help_panel=_SCENE)
    ] = None,
    packing_fraction: Annotated[
        float | None, typer.Option(help="Fraction of the volume filled by spheres.", rich_help_panel=_SCENE)
    ] = None,
    density: Annotated[
        float | None, typer.Option(help="Or: number density, N diameter^d / V.", rich_help_panel=_SCENE)
    ] = None,
    equilibration: Annotated[
        float | None,
        typer.Option(help="Collisions per particle before anything is measured.", rich_help_panel=_LENGTH),
    ] = None,
    collisions_per_particle: Annotated[
        float | None,
        typer.Option(help="Collisions per particle in the measurement.", rich_help_panel=_LENGTH),
    ] = None,
    relative_error: Annotated[
        float | None,
        typer.Option(help="Or: measure until Z has this relative error.", rich_help_panel=_LENGTH),
    ] = None,
    max_walltime: Annotated[
        float | None,
        typer.Option(help="Limit of wall time for this, in seconds.", rich_help_panel=_LENGTH),
    ] = None,
    frames: Annotated[
        int | None,
        typer.Option(
            help="Number of frames. Default: 100; fewer in large systems, to keep the files below 200 MB.",
            rich_help_panel=_LENGTH,
        ),
    ] = None,
    checkpoint_every: Annotated[
        float | None, typer.Option(help="Seconds between checkpoints.", rich_help_panel=_OUTPUT)
    ] = None,
    event_log: Annotated[
        bool | None,
        typer.Option(
            "--event-log/--no-event-log", help="Write every collision to events.h5.", rich_help_panel=_OUTPUT
        ),
    ] = None,
    pictures: Annotated[
        bool | None,
        typer.Option("--pictures/--no-pictures", help="Three PNG files.", rich_help_panel=_OUTPUT),
    ] = None,
    workers: Workers = "1",
    trust_code: Trusted = False,
    explain: Annotated[
        bool,
        typer.Option("--explain", help="Print what would be compiled and which arrays are made, then stop."),
    ] = False,
) -> None:
    """Simulate: equilibrate, measure the pressure and g(r), sample a trajectory.

    The folder then holds scene.toml, trajectory.h5md, trajectory.extxyz, rdf.csv, summary.json, and pictures.
    Ctrl-C stops the run at once; `carom resume` continues it.

    [bold]Examples[/bold]

    carom run
    carom run scene.toml --out fluid --seed 7
    carom run --n 500 --packing-fraction 0.3 --out dilute
    carom run --dimension 2 --packing-fraction 0.65 --out disks
    carom run --cells 4 --collisions-per-particle 500 --frames 20 --out quick
    carom run --packing-fraction 0.3 --relative-error 1e-3 --max-walltime 600 --out precise
    carom run scene.toml --out fluid --json > summary.json
    carom run scene.toml --explain
    carom run battle.toml --trust-code
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.overrides import overridden
    from carom.cli.screen import predicted, results, watched
    from carom.plan.plan import Plan

    plan = overridden(
        None if scene is None else Plan.load(scene),
        scene={
            "initial": initial,
            "dimension": dimension,
            "n": n,
            "cells": cells,
            "packing_fraction": packing_fraction,
            "density": density,
        },
        run={
            "seed": seed,
            "equilibration": equilibration,
            "collisions_per_particle": collisions_per_particle,
            "relative_error": relative_error,
            "max_walltime": max_walltime,
            "frames": frames,
            "checkpoint_every": checkpoint_every,
        },
        output={"event_log": event_log, "pictures": pictures},
    )
    plan = plan.trusted() if trust_code else plan
    if explain:
        from carom.simulation.explanation import explain as explained

        found = explained(plan.build_scene(), neighbors=plan.run.neighbors, event_log=plan.output.event_log)
        typer.echo(str(found))
        return
    with watched() as progress, compiling_told():
        from carom import studies

        result = studies.run(
            plan,
            out,
            overwrite=overwrite,
            progress=progress,
            predicted=predicted,
            workers=_workers(workers),
        )
    results(result, as_json)


@friendly
def resume(
    folder: Annotated[Path, typer.Argument(help="Folder of a run that was stopped or killed.")],
    as_json: Json = False,
    workers: Workers = "1",
    trust_code: Trusted = False,
) -> None:
    """Continue a run or packing that was stopped. The result is bit-identical to an uninterrupted run.

    [bold]Examples[/bold]

    carom resume carom-run
    carom resume fluid --json
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.screen import packed, predicted, results, watched

    with watched() as progress, compiling_told():
        from carom import studies

        if studies.holds_packing(folder):
            packing = studies.resume_packing(folder, progress=progress)
            packed(packing.summary(), folder, as_json)
            return
        result = studies.resume(
            folder,
            progress=progress,
            predicted=predicted,
            workers=_workers(workers),
            trust_code=trust_code,
        )
    results(result, as_json)


@friendly
def pack(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the results.")] = Path("carom-pack"),
    seed: Annotated[int, typer.Option(help="Seed of all random numbers.")] = 0,
    as_json: Json = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the packing in the folder.")
    ] = False,
    n: Annotated[int, typer.Option("--n", help="Number of spheres.", rich_help_panel=_SCENE)] = 1000,
    dimension: Annotated[
        int, typer.Option("--dimension", "-d", help="Dimension of space, 1 to 12.", rich_help_panel=_SCENE)
    ] = 3,
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
    until_pressure: Annotated[
        float | None,
        typer.Option(help="Pressure at the end, as Z = PV/NkT; 1e10.", rich_help_panel=_LENGTH),
    ] = None,
    stage: Annotated[
        list[str] | None,
        typer.Option(
            help="Instead of both: RATE:PRESSURE. Repeat the option for each stage.", rich_help_panel=_LENGTH
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
    """Let points grow into spheres while they move, until they jam.

    The folder then holds packing.h5md, packing.extxyz, history.csv, summary.json, and pictures. Ctrl-C stops
    at once; `carom resume` continues it.

    [bold]Examples[/bold]

    carom pack
    carom pack --n 2000 --dimension 2 --rate 0.01 --out disks
    carom pack --dimension 2 --species 500:1 --species 500:1.4 --out mixture
    carom pack --n 500 --stage 0.02:1e3 --stage 3e-4:1e12 --out isostatic
    carom pack --n 27 --dimension 2 --rate 0.01 --collisions 100000 --out billiard
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.screen import packed, watched

    kinds = [(_count(count), diameter) for count, diameter in _pairs(species, "--species", "COUNT:DIAMETER")]
    stages = _pairs(stage, "--stage", "RATE:PRESSURE")
    with watched() as progress, compiling_told():
        from carom import studies

        progress("Preparing", 0.0)
        scene = studies.points(
            None if kinds else n,
            dimension,
            counts=[count for count, _ in kinds] or None,
            diameters=[diameter for _, diameter in kinds] or (1.0,),
            periodic=not walls,
            seed=seed,
        )
        packing = studies.pack(
            scene,
            rate=rate,
            until_pressure=until_pressure,
            collisions=collisions,
            stages=stages or None,
            common=common,
            seed=seed,
            out=out,
            overwrite=overwrite,
            pictures=pictures,
            progress=progress,
        )
    packed(packing.summary(), out, as_json)


def _pairs(given: list[str] | None, option: str, form: str) -> list[tuple[float, float]]:
    """Return what an option gave as numbers on both sides of a colon."""
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
    """Return a number of spheres."""
    from carom.errors import InputError

    if not number.is_integer() or number < 1:
        raise InputError(f"--species takes a whole number of spheres before the colon, found {number:g}.")
    return int(number)


@friendly
def export(
    source: Annotated[Path, typer.Argument(help="Trajectory: .h5md, .extxyz or .gsd.")],
    target: Annotated[
        Path,
        typer.Argument(help="What to write: these, or .lammpstrj, .data (LAMMPS), .dcd, .pdb."),
    ],
    overwrite: Overwrite = False,
) -> None:
    """Convert a trajectory from one format to another.

    [bold]Examples[/bold]

    carom export carom-run/trajectory.h5md fluid.gsd
    carom export carom-run/trajectory.extxyz again.h5md --overwrite
    carom export carom-run/trajectory.h5md fluid.lammpstrj
    """
    from carom import io
    from carom.cli.screen import watched
    from carom.errors import FileError

    if not overwrite and target.exists():
        raise FileError(f"{target} exists already and was left as it is; replace it with --overwrite.")
    with watched() as progress:
        count = io.convert(
            source,
            target,
            overwrite=overwrite,
            progress=lambda done, total: progress("Converting", done / total),
        )
    typer.echo(f"{target}: {count} frame{'s' if count != 1 else ''}")


@friendly
def view(
    source: Annotated[Path, typer.Argument(help="Trajectory, event log, or the folder of a run or packing.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Page to write; next to the source by default.")
    ] = None,
    collisions: Annotated[
        int | None, typer.Option(help="Collisions to show of an event log; 20 000 by default.")
    ] = None,
    show: Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")] = True,
    trust_code: Trusted = False,
    overwrite: Overwrite = False,
) -> None:
    """Show a trajectory, a packing, or an event log in exact time, in the browser.

    The page is one file of HTML that needs no network; send it to whom you like.

    [bold]Examples[/bold]

    carom view carom-run
    carom view carom-pack --out packing.html --no-open
    carom view run/events.h5 --collisions 5000
    """
    from carom.errors import FileError
    from carom.io.paths import writable
    from carom.pictures.view import rules_beside
    from carom.pictures.view import view as shown

    page = out or (source / "view.html" if source.is_dir() else source.with_suffix(".html"))
    if writable(page).exists() and not overwrite:
        raise FileError(f"{page} exists already and was left as it is; replace it with --overwrite.")
    shown(source, page, collisions=collisions, interaction=rules_beside(source) if trust_code else None)
    typer.echo(f"{page}: {page.stat().st_size / 1e6:.1f} MB")
    if show:
        typer.launch(str(page))


@friendly
def movie(
    trajectory: Annotated[Path, typer.Argument(help="Trajectory: .h5md, .extxyz or .gsd.")],
    target: Annotated[Path, typer.Argument(help="What to write: .mp4 or .gif.")],
    fps: Annotated[int, typer.Option(help="Frames of the trajectory in a second.")] = 24,
    size: Annotated[int, typer.Option(help="Pixels of the longer edge.")] = 480,
    colour: Annotated[
        str, typer.Option(help="species, speed, psi_6 or rattlers (of a packing).")
    ] = "species",
    overwrite: Overwrite = False,
) -> None:
    """Make a movie of a trajectory: MP4 (which needs the package imageio-ffmpeg) or GIF.

    [bold]Examples[/bold]

    carom movie carom-run/trajectory.h5md fluid.mp4
    carom movie disks/trajectory.h5md disks.gif --colour psi_6 --fps 12
    carom movie carom-pack/packing.h5md packing.gif --colour rattlers
    """
    from carom.cli.screen import watched
    from carom.errors import FileError
    from carom.io.paths import writable
    from carom.pictures.movie import movie as made

    if writable(target).exists() and not overwrite:
        raise FileError(f"{target} exists already and was left as it is; replace it with --overwrite.")
    with watched() as progress:
        count = made(
            trajectory, target, fps=fps, size=size, colour=colour,
            progress=lambda done, total: progress("Drawing frames", done / total),
        )  # fmt: skip
    typer.echo(f"{target}: {count} frame{'s' if count != 1 else ''}")


@friendly
def rdf(
    trajectory: Annotated[Path, typer.Argument(help="Trajectory: .h5md, .extxyz or .gsd.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="Table to write: .csv or .npz.")] = Path("rdf.csv"),
    png: Annotated[bool, typer.Option("--png", help="Draw a picture as well.")] = False,
    rmax: Annotated[
        float | None, typer.Option(help="End of the last bin, a length; at most half the shortest edge.")
    ] = None,
    width: Annotated[
        float | None, typer.Option(help="Width of a bin, a length; 0.02 diameters by default.")
    ] = None,
    pair: Annotated[
        str | None, typer.Option(help="Two species of a mixture, by name or number: small,large.")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Compute g(r) of a trajectory, with error bars and the contact value.

    [bold]Examples[/bold]

    carom rdf carom-run/trajectory.h5md
    carom rdf carom-run/trajectory.extxyz --rmax 3 --width 0.01 --png
    carom rdf mixture/trajectory.h5md --pair small,large
    """
    from carom import io, observables
    from carom.cli.screen import watched
    from carom.errors import FileError, InputError
    from carom.io.paths import replacing, writable
    from carom.observables.rdf import rdf as compute

    picture = out.with_suffix(".png")
    species: Any = None
    if pair is not None:
        species = tuple(int(word) if word.strip().isdigit() else word.strip() for word in pair.split(","))
    if out.suffix not in (".csv", ".npz"):
        raise InputError(f"{out} has the suffix '{out.suffix}'; expected .csv or .npz.")
    for path in (out, picture) if png else (out,):
        if writable(path).exists() and not overwrite:
            raise FileError(f"{path} exists already and was left as it is; replace it with --overwrite.")
    with watched() as progress, io.open(trajectory) as reader:
        assert isinstance(reader, io.Reader)

        def frames():
            for k, frame in enumerate(reader):
                progress("Computing g(r)", k / len(reader))
                yield frame

        distribution: observables.RadialDistribution = compute(frames(), rmax=rmax, width=width, pair=species)
    with replacing(out) as temporary:
        distribution.save(temporary)
    if png:
        from carom.pictures import plots

        with replacing(picture) as temporary:
            plots.rdf(distribution, path=temporary)
    contact = distribution.contact_value
    typer.echo(
        f"{out}: {distribution.g.size} bins from {distribution.frames} frames"
        + ("" if contact is None else f"; contact value {contact.value_text}")
    )


@friendly
def init(
    path: Annotated[Path, typer.Argument(help="File to write.")] = Path("scene.toml"),
    overwrite: Overwrite = False,
) -> None:
    """Write a commented scene file to start from.

    [bold]Examples[/bold]

    carom init
    carom init disks.toml
    """
    from carom.errors import FileError
    from carom.io.paths import replacing, writable, writing
    from carom.plan.plan import template

    if writable(path).exists() and not overwrite:
        raise FileError(f"{path} exists already and was left as it is; replace it with --overwrite.")
    with replacing(path) as temporary, writing(path):
        temporary.write_text(template(), encoding="utf-8")
    typer.echo(f"{path} written; edit it, then `carom run {path}`.")
