"""The commands ``carom run`` and ``carom resume``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from carom.cli import options
from carom.cli.options import FLAGS, Cores, GoOn, Json, Quiet, Trusted, number_of, option, shared
from carom.cli.trouble import friendly
from carom.declared import of_options
from carom.scene_file.sections import RunSpec, SceneSpec
from carom.texts import visible


@options.takes(
    options.argument(
        "scene", "Scene file (TOML), as `carom init` writes it, a file with frames to start from "
        "(start.data), or the folder of a run. Without: 2048 hard spheres.",
    ),
    option("out", Path, Path("carom-run"), help="Folder for the results."),
    option("overwrite", bool, False, "--overwrite", help="Replace the run in the folder."),
    *options.of_fields(SceneSpec, RunSpec),
    shared("as_json", Json),
    shared("quiet", Quiet),
    shared("go_on", GoOn),
    shared("cores", Cores, "1"),
    shared("trust_code", Trusted),
    option("verbose", bool, False, "--verbose", "-v",
           help="Print rate, drifts and overlaps of the run as well."),
    option("dry_run", bool, False, "--dry-run",
           help="Print what would be compiled and which arrays are made, then stop."),
)  # fmt: skip
def run(
    scene: Path | None,
    out: Path,
    as_json: bool,
    verbose: bool,
    overwrite: bool,
    go_on: bool,
    cores: str,
    trust_code: bool,
    dry_run: bool,
    quiet: bool = False,
    **given: Any,
) -> None:
    """Simulate a scene and measure its pressure and structure.

    The folder then holds scene.toml, trajectory.h5md, trajectory.extxyz, rdf.csv, summary.json, and pictures.
    Ctrl-C stops the run at once; `carom resume` continues it.

    [bold]Examples[/bold]

    carom run
    carom run fluid.toml --out fluid --seed 7
    carom run --n 500 --eta 0.3 --out dilute
    carom run -d 2 --eta 0.65 --out disks
    carom run --n 256 -c 500 --frames 20 --out quick
    carom run --lattice fcc --eta 0.55 --out crystal
    carom run --eta 0.4 --species 0.5:1 --species 0.5:1.4 --out mixture
    carom run --eta 0.3 --relative-error 1e-3 --walltime 600 --out precise
    carom run bed.toml --time 100 --out bed
    carom run fluid -c 50000 --out longer
    carom run fluid.toml --out fluid --resume --json > summary.json
    carom run fluid.toml --dry-run
    carom run start.data --diameter 0.9 --out melt
    carom run battle.toml --trust-code
    """
    from carom.cli.results import show
    from carom.cli.screen import predicted, watched
    from carom.errors import InputError
    from carom.scene_file.scene_file import SceneFile
    from carom.studies.runs.inputs import plan_of

    asked = SceneFile() if scene is None else plan_of(scene)
    words = of_options(SceneSpec, given)
    # Without a file, n and density have the defaults of what is given.
    there = SceneSpec(**words) if scene is None else asked.scene.replaced(**words)
    plan = SceneFile(there, asked.run.replaced(**of_options(RunSpec, given)))
    plan = plan.trusted() if trust_code else plan
    if go_on and overwrite:
        raise InputError("--resume and --overwrite contradict each other; give one of them.")
    if dry_run:
        from carom.simulation.explanation import explain as explained
        from carom.simulation.tuning import Tuning

        found = explained(
            plan.build_scene(),
            swaps=plan.run.swaps,
            barostat=plan.run.barostat,
            tuning=Tuning(neighbors=plan.run.neighbors),
            event_log=plan.run.event_log,
        )
        typer.echo(visible(found, lines=True))
        return
    with watched() as progress:
        from carom.studies.runs.execution import go_on as continued, run as carry_out

        how: dict[str, Any] = {"progress": progress, "predicted": predicted, "cores": number_of(cores)}
        if go_on:
            result = continued(plan, out, trust_code=trust_code, **how)
        else:
            result = carry_out(plan, out, overwrite=overwrite, **how)
    show(result, out, as_json=as_json, verbose=verbose)


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
    from carom.cli.results import show
    from carom.cli.screen import predicted, watched
    from carom.cli.study import carry_out
    from carom.layout import kind_at
    from carom.studies.at_path import load, resume as go_on

    kind = kind_at(folder)
    if kind is not None and kind.report:
        report = (folder / "report.html").exists()
        study = load(folder)
        carry_out(study, folder, executor=None, cores=cores, report=report, pictures=True, as_json=as_json)
        return
    how: dict[str, Any] = {"cores": number_of(cores), "trust_code": trust_code}
    with watched() as progress:
        found = go_on(folder, progress=progress, predicted=predicted, **how)
    show(found, folder, as_json=as_json)
