"""The command ``carom eos``: an equation-of-state study from flags or a file, with a live table."""

from __future__ import annotations

import contextlib
import json
import math
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
    from carom.studies.eos.result import EquationOfState
    from carom.studies.eos.study import Progress

_GRID = "The system (overrides the study file)"


@friendly
def eos(
    study: Annotated[
        Path | None,
        typer.Argument(
            help=r"Study file (TOML): \[study], and \[scene] for more. Without: 12 densities of the fluid."
        ),
    ] = None,
    out: Out = Path("carom-eos"),
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
        typer.Option("--n", help="Number of particles, or several: 500,1000,2000.", rich_help_panel=_GRID),
    ] = None,
    replicas: Annotated[
        int | None, typer.Option(help="Independent runs of each point.", rich_help_panel=_GRID)
    ] = None,
    dimension: Annotated[
        int | None,
        typer.Option("--dimension", "-d", help="Dimension of space, 1 to 12.", rich_help_panel=_GRID),
    ] = None,
    initial: Annotated[
        str | None,
        typer.Option(help="auto, random, fcc, triangular, cubic or dn.", rich_help_panel=_GRID),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of all random numbers.", rich_help_panel=_GRID)
    ] = None,
    relative_error: Annotated[
        float | None, typer.Option(help="Of Z, at every point.", rich_help_panel=LENGTH)
    ] = None,
    collisions_per_particle: RunLength = None,
    equilibration: Equilibration = None,
    engine: Engine = None,
    cores: Cores = None,
    scheduler: Scheduler = None,
    report: Report = False,
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="eos.png.", rich_help_panel=OUTPUT)
    ] = True,
    as_json: TableAsJson = False,
) -> None:
    """Measure the equation of state: Z over packing fractions, sizes and replicas, compared with theory.

    The folder then holds study.toml, a result file for each run in tasks/, eos.csv and eos.png. Finished
    runs are not repeated: the same command continues a study that was stopped, killed or extended.

    [bold]Examples[/bold]

    carom eos
    carom eos --eta 0.1:0.4:7 --n 1000 --relative-error 1e-3 --out quick
    carom eos --eta 0.3,0.45 --n 250,500,1000,2000 --report
    carom eos study.toml --out big --scheduler tcp://head:8786
    mpiexec -n 9 python -m mpi4py.futures -m carom eos study.toml --out big
    """
    executor = where(engine, scheduler)
    spec = _spec(
        study,
        {
            "packing_fraction": fractions(packing_fraction),
            "n": integers(n),
            "replicas": replicas,
            "dimension": dimension,
            "initial": initial,
            "seed": seed,
            "relative_error": relative_error,
            "collisions_per_particle": collisions_per_particle,
            "equilibration": equilibration,
        },
    )
    reserve(spec, out, "eos")
    from carom.cli.compiling import compiling_told

    with _watched() as progress, compiling_told():
        from carom.studies.eos.study import run

        result = run(spec, executor=executor, cores=number_of(cores), out=out, progress=progress)
    # Results are printed before files are written, because a full disk may refuse the files.
    if as_json:
        print(json.dumps(result.to_dict(), indent=2, allow_nan=False))
    else:
        _show(result)
    sys.stdout.flush()
    write(result, out, "eos", report, pictures)
    farewell(result, out, report, as_json)


def _spec(path: Path | None, given: dict[str, Any]) -> Any:
    """Return the study of the file, or the default one, with the values that the command line gives."""
    from carom.studies.eos.spec import StudySpec, replaced
    from carom.studies.eos.toml import load

    values = {name: value for name, value in given.items() if value is not None}
    return StudySpec(**(values if path is None else replaced(vars(load(path)), values)))


@contextlib.contextmanager
def _watched() -> Iterator[Callable[[Progress], None]]:
    """Show a bar and the table so far while the body runs; without a terminal, print a line now and then."""
    if not sys.stderr.isatty():
        from carom.cli.heartbeat import Heartbeat

        with Heartbeat(COMPILING).beating() as heart:
            yield lambda present: heart.tell(
                f"{present.done} of {present.total} runs" if present.done else COMPILING, present.fraction
            )
        return
    from rich.console import Group
    from rich.live import Live
    from rich.progress import Progress as Bar

    from carom.cli.screen import columns
    from carom.cli.tables import Screen, fitted
    from carom.notebook import advance

    bar = Bar(*columns())
    # The bar moves to and fro until the first run is done, because the total time is not known before.
    bar.add_task(FIRST, total=None)
    with Live(bar, console=Screen(stderr=True), transient=True, refresh_per_second=4) as live:

        def progress(present: Progress) -> None:
            if present.done:
                said = f"{present.done} of {present.total} runs"
                advance(bar, present.fraction, said)
            live.update(Group(fitted(live.console, _table(present.so_far)), bar))

        yield progress


def _show(result: EquationOfState) -> None:
    from carom.cli.tables import Screen, show

    console = Screen()
    show(console, _table(result))
    if math.isfinite(chi2 := result.chi2_per_point):
        console.print(f"Mean squared deviation of the fluid from theory, in standard errors: {chi2:.2f}")
    flagged = sum(not row.equilibrated for row in result.table)
    if flagged:
        console.print(f"{flagged} point{'s' * (flagged > 1)} flagged, and left out of fits.")


def _table(result: EquationOfState) -> Any:
    """Return the points so far as a table."""
    from rich import box
    from rich.table import Table

    from carom.cli.screen import decimals_of

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True, caption_justify="left")
    for name in ("η", "N", "runs", "Z", "infinite", "theory", "dev.", "P*"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("")
    for row in result.table:
        decimals = decimals_of(row.Z_error)
        table.add_row(
            f"{row.packing_fraction:.5g}",
            str(row.n),
            str(row.replicas),
            f"{row.Z:.{decimals}f} ± {row.Z_error:.{decimals}f}",
            f"{row.Z_infinite:.{decimals}f}" if math.isfinite(row.Z_infinite) else "",
            f"{row.theory:.{decimals}f}" if math.isfinite(row.theory) else "",
            f"{row.deviation:+.1f}" if math.isfinite(row.deviation) else "",
            f"{row.reduced_pressure:.{decimals_of(row.reduced_pressure_error)}f}",
            "*" if row.remarks else "",
            style=None if row.equilibrated else "red",
        )
    d = result.spec.dimension
    units = f"P* = P σ^{d}/kT, σ the largest diameter. dev. = (infinite - theory) / standard error."
    remarks = (
        f"* η = {row.packing_fraction:.5g}, N = {row.n}: {'; '.join(row.remarks)}"
        for row in result.table
        if row.remarks
    )
    table.caption = "\n".join([units, *remarks])
    return table
