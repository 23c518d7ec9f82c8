"""The commands ``carom run`` and ``carom resume``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from carom.cli.options import Cores, Json, Trusted, number_of
from carom.cli.trouble import friendly
from carom.texts import visible

_SCENE = "The system (overrides a scene file)"
_LENGTH = "How long"
_OUTPUT = "What to write"


@friendly
def run(
    scene: Annotated[
        Path | None,
        typer.Argument(
            help="Scene file (TOML), as `carom init` writes it, or the folder of a run. Without: 2048 hard "
            "spheres."
        ),
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
        float | None,
        typer.Option(
            "--packing-fraction",
            "--eta",
            help="Fraction of the volume filled by spheres.",
            rich_help_panel=_SCENE,
        ),
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
    walltime: Annotated[
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
    cores: Cores = "1",
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
    carom run --packing-fraction 0.3 --relative-error 1e-3 --walltime 600 --out precise
    carom run scene.toml --out fluid --json > summary.json
    carom run scene.toml --explain
    carom run battle.toml --trust-code
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.overrides import overridden
    from carom.cli.screen import predicted, results, watched
    from carom.studies.runs.asked import plan_of

    plan = overridden(
        None if scene is None else plan_of(scene),
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
            "walltime": walltime,
            "frames": frames,
            "checkpoint_every": checkpoint_every,
        },
        output={"event_log": event_log, "pictures": pictures},
    )
    plan = plan.trusted() if trust_code else plan
    if explain:
        from carom.simulation.explanation import explain as explained
        from carom.simulation.tuning import Tuning

        found = explained(
            plan.build_scene(), tuning=Tuning(neighbors=plan.run.neighbors), event_log=plan.output.event_log
        )
        typer.echo(visible(found, lines=True))
        return
    with watched() as progress, compiling_told():
        from carom.studies.runs.execution import run as carry_out

        result = carry_out(
            plan,
            out,
            overwrite=overwrite,
            progress=progress,
            predicted=predicted,
            cores=number_of(cores),
        )
    results(result, as_json)


@friendly
def resume(
    folder: Annotated[Path, typer.Argument(help="Folder of what was stopped or killed.")],
    as_json: Json = False,
    cores: Annotated[
        str | None,
        typer.Option("--cores", "-j", help="Threads of a run, 1; processes of a study, one per core."),
    ] = None,
    trust_code: Trusted = False,
) -> None:
    """Continue what was stopped: a run, a packing, a study or a plan.

    The result is bit-identical to an uninterrupted one.

    [bold]Examples[/bold]

    carom resume carom-run
    carom resume fluid --json
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.screen import packed, predicted, results, staged, watched
    from carom.cli.study import carry_out
    from carom.studies.places import kind_of

    if folder.is_dir() and kind_of(folder) == "a study":
        from carom.studies.saved import load

        report = (folder / "report.html").exists()
        carry_out(
            load(folder), folder, executor=None, cores=cores, report=report, pictures=True, as_json=as_json
        )
        return
    with watched() as progress, compiling_told():
        from carom.studies.packings.packing import Packing
        from carom.studies.runs.result import RunResult
        from carom.studies.saved import resume as go_on

        found = go_on(
            folder,
            progress=staged(progress),
            predicted=predicted,
            cores=number_of(cores),
            trust_code=trust_code,
        )
    if isinstance(found, Packing):
        packed(found.to_dict(), folder, as_json)
    elif isinstance(found, RunResult):
        results(found, as_json)
    else:
        print(
            json.dumps(found.to_dict(), indent=2, allow_nan=False) if as_json else visible(found, lines=True)
        )
