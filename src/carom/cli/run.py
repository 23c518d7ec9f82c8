"""The commands ``carom run`` and ``carom resume``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from carom.cli.options import FLAGS, Cores, GoOn, Json, Quiet, Trusted, number_of
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
    out: Annotated[Path, typer.Option(*FLAGS["out"], help="Folder for the results.")] = Path("carom-run"),
    seed: Annotated[int | None, typer.Option(help="Seed of all random numbers.")] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Print rate, drifts and overlaps of the run as well.")
    ] = False,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the run in the folder.")] = False,
    go_on: GoOn = False,
    initial: Annotated[
        str | None,
        typer.Option(help="fcc, triangular, cubic, dn or random.", rich_help_panel=_SCENE),
    ] = None,
    dimension: Annotated[
        int | None,
        typer.Option(
            *FLAGS["dimension"],
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
            *FLAGS["packing_fraction"],
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
        typer.Option(
            *FLAGS["collisions_per_particle"],
            help="Collisions per particle in the measurement.",
            rich_help_panel=_LENGTH,
        ),
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
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Print what would be compiled and which arrays are made, then stop."),
    ] = False,
) -> None:
    """Simulate a scene and measure its pressure and structure.

    The folder then holds scene.toml, trajectory.h5md, trajectory.extxyz, rdf.csv, summary.json, and pictures.
    Ctrl-C stops the run at once; `carom resume` continues it.

    [bold]Examples[/bold]

    carom run
    carom run scene.toml --out fluid --seed 7
    carom run --n 500 --eta 0.3 --out dilute
    carom run -d 2 --eta 0.65 --out disks
    carom run --cells 4 -c 500 --frames 20 --out quick
    carom run --eta 0.3 --relative-error 1e-3 --walltime 600 --out precise
    carom run fluid -c 50000 --out longer
    carom run scene.toml --out fluid --resume --json > summary.json
    carom run scene.toml --dry-run
    carom run battle.toml --trust-code
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.overrides import overridden
    from carom.cli.screen import predicted, results, watched
    from carom.errors import InputError
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
    if go_on and overwrite:
        raise InputError("--resume and --overwrite contradict each other; give one of them.")
    if dry_run:
        from carom.simulation.explanation import explain as explained
        from carom.simulation.tuning import Tuning

        found = explained(
            plan.build_scene(), tuning=Tuning(neighbors=plan.run.neighbors), event_log=plan.output.event_log
        )
        typer.echo(visible(found, lines=True))
        return
    with watched() as progress, compiling_told():
        from carom.studies.runs.execution import go_on as continued
        from carom.studies.runs.execution import run as carry_out

        how: dict[str, Any] = {"progress": progress, "predicted": predicted, "cores": number_of(cores)}
        if go_on:
            result = continued(plan, out, trust_code=trust_code, **how)
        else:
            result = carry_out(plan, out, overwrite=overwrite, **how)
    results(result, as_json, verbose)


@friendly
def resume(
    folder: Annotated[Path, typer.Argument(help="Folder of what was stopped or killed.")],
    as_json: Json = False,
    quiet: Quiet = False,
    cores: Annotated[
        str | None,
        typer.Option(*FLAGS["cores"], help="Threads of a run, 1; processes of a study, one per core."),
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
    from carom.cli.screen import packed, predicted, reached, results, staged, watched
    from carom.cli.study import settle

    with watched() as progress, compiling_told():
        from carom.studies.packings.packing import Packing
        from carom.studies.planner.outcome import Outcome
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
    elif isinstance(found, Outcome):
        reached(found, folder, as_json)
    else:
        settle(found, folder, report=False, pictures=True, as_json=as_json)
