"""The command ``carom transport``: transport coefficients from flags, a scene file or a study file."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from carom.cli.options import number_of
from carom.cli.studies import (
    COMPILING,
    FIRST,
    LENGTH,
    OUTPUT,
    Cores,
    Engine,
    Equilibration,
    Out,
    Report,
    RunLength,
    Scheduler,
    TableAsJson,
    farewell,
    fractions,
    integers,
    reserve,
    where,
    write,
)
from carom.cli.trouble import friendly

if TYPE_CHECKING:
    from carom.studies.coefficients.result import Transport
    from carom.studies.coefficients.study import Progress

_GRID = "What to simulate instead of the file's, or the default's"


@friendly
def transport(
    scene: Annotated[
        Path | None,
        typer.Argument(help=r"Scene file, or study file with \[study] (TOML). Without: six densities."),
    ] = None,
    out: Out = Path("carom-transport"),
    packing_fraction: Annotated[
        str | None,
        typer.Option(
            "--packing-fraction",
            "--eta",
            help="E.g. 0.1,0.2,0.3 or 0.1:0.4:7 (7 from 0.1 to 0.4).",
            rich_help_panel=_GRID,
        ),
    ] = None,
    n: Annotated[
        str | None,
        typer.Option("--n", help="Number of particles, or several: 256,500,1372.", rich_help_panel=_GRID),
    ] = None,
    replicas: Annotated[
        int | None, typer.Option(help="Independent runs of each point.", rich_help_panel=_GRID)
    ] = None,
    dimension: Annotated[
        int | None, typer.Option("--dimension", "-d", help="Of space, from 2 on.", rich_help_panel=_GRID)
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Source of all randomness.", rich_help_panel=_GRID)] = None,
    relative_error: Annotated[
        float | None,
        typer.Option(help="Of shear viscosity and thermal conductivity.", rich_help_panel=LENGTH),
    ] = None,
    collisions_per_particle: RunLength = None,
    equilibration: Equilibration = None,
    engine: Engine = None,
    cores: Cores = None,
    scheduler: Scheduler = None,
    report: Report = False,
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="transport.png.", rich_help_panel=OUTPUT)
    ] = True,
    as_json: TableAsJson = False,
) -> None:
    """Measure self-diffusion, viscosities and thermal conductivity, compared with Enskog's theory.

    The folder then holds study.toml, a result file for each run in tasks/, transport.csv and transport.png.
    Finished runs are not repeated: the same command continues a study that was stopped.

    [bold]Examples[/bold]

    carom transport --eta 0.2618 --relative-error 0.01
    carom transport scene.toml --replicas 8 --out scene-transport
    carom transport --eta 0.2618 --n 256,500,1372 --report
    """
    from carom.studies.coefficients.spec import TransportSpec, of_scene

    executor = where(engine, scheduler)
    given: dict[str, Any] = {
        "packing_fraction": fractions(packing_fraction),
        "n": integers(n),
        "replicas": replicas,
        "dimension": dimension,
        "seed": seed,
        "relative_error": relative_error,
        "collisions_per_particle": collisions_per_particle,
        "equilibration": equilibration,
    }
    values = {name: value for name, value in given.items() if value is not None}
    spec = TransportSpec(**values) if scene is None else of_scene(scene, **values)
    reserve(spec, out, "transport")
    from carom.cli.compiling import compiling_told

    with _watched() as progress, compiling_told():
        from carom.studies.coefficients.study import run

        result = run(spec, executor=executor, cores=number_of(cores), out=out, progress=progress)
    if as_json:
        print(json.dumps(result.to_dict()["table"], indent=2, allow_nan=False))
    else:
        _show(result)
    sys.stdout.flush()
    write(result, out, "transport", report, pictures)
    farewell(result, out, report, as_json)


def _show(result: Transport) -> None:
    from rich import box
    from rich.table import Table

    from carom.cli.tables import Screen, show
    from carom.studies.coefficients.pictures import UNITS

    console = Screen()
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    table.add_column("")
    for name in ("eta", "N", "value", "Enskog", "ratio", "slope between"):
        table.add_column(name, justify="right")
    for eta, n, name, *rest in result.cells():
        table.add_row(name, eta, n, *rest)
    show(console, table)
    for line in (*result.remarks(), UNITS):
        console.print(line)


@contextlib.contextmanager
def _watched() -> Iterator[Callable[[Progress], None]]:
    """Show a bar while the body runs; a line now and then without a terminal."""
    if not sys.stderr.isatty():
        from carom.cli.heartbeat import Heartbeat

        with Heartbeat(COMPILING).beating() as heart:
            yield lambda present: heart.tell(
                f"{present.done} of {present.total} runs" if present.done else COMPILING, present.fraction
            )
        return
    from rich.progress import Progress as Bar

    from carom.cli.screen import columns
    from carom.cli.tables import Screen
    from carom.notebook import advance

    with Bar(*columns(), console=Screen(stderr=True), transient=True) as bar:
        bar.add_task(FIRST, total=None)

        def progress(present: Progress) -> None:
            said = f"{present.done} of {present.total} runs" if present.done else FIRST
            advance(bar, present.fraction, said)

        yield progress
