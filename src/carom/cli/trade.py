"""``carom trade``: the command, and the tables it prints."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from carom.cli.options import FLAGS, Overwrite, Quiet, file_of
from carom.cli.trouble import friendly

if TYPE_CHECKING:
    from carom.studies.accuracy.rows import TradeResult


@friendly
def trade(
    scene: Annotated[
        Path | None, typer.Argument(help="Scene file (TOML). Without: 2048 hard spheres at density 0.5.")
    ] = None,
    out: Annotated[Path, typer.Option(*FLAGS["out"], help="Folder for the results.")] = Path("carom-trade"),
    seconds: Annotated[
        float,
        typer.Option(
            help="CPU seconds for the statistics of a row; the whole takes some forty times as long, and a "
            "minute more."
        ),
    ] = 8.0,
    quiet: Quiet = False,
    overwrite: Overwrite = False,
) -> None:
    """Compare methods by speed and accuracy, on this machine.

    The engine, the naive algorithm in 50 digits and in doubles, compiled time-driven stepping, and pseudo
    hard spheres (Mie 50-49; by LAMMPS, too, where it is installed) move the same spheres. The folder then
    holds trade.csv, sizes.csv, sampling.csv, trade.json, and a picture, trade.png.

    [bold]Examples[/bold]

    carom trade
    carom trade scene.toml --out mine
    carom trade --seconds 1 --out quick
    """
    from carom.cli.compiling import compiling_told
    from carom.cli.screen import watched
    from carom.scene_file.scene_file import SceneFile

    file = file_of(scene)
    plan = None if file is None else SceneFile.load(file)
    with watched() as progress, compiling_told():
        from carom.studies.accuracy.trade import trade as compare

        result = compare(plan, out, seconds=seconds, overwrite=overwrite, progress=progress)
    _print(result)


def _print(result: TradeResult) -> None:
    from carom.cli.tables import Screen, show

    console = Screen()
    console.print(f"Speed: {result.scene}")
    console.print(f"Trajectories: {result.small}")
    rows = result.rows
    show(
        console,
        _table(
            "Speed, memory, faults in a million collisions",
            ["", "collisions / s", "bytes / particle", "overlap [σ]", "energy", "momentum"],
            [
                [
                    row.method, f"{row.collisions_per_second:.3g}", _whole(row.bytes_per_particle),
                    _small(row.worst_overlap), _small(row.energy_drift), _small(row.momentum_drift),
                ]
                for row in rows
            ],
        )
    )  # fmt: skip
    show(
        console,
        _table(
            "Trajectories: collisions a particle until lost; error after one; error forward and back [σ]",
            ["", "order", "position", "after 1", "5 back", "10 back", "20 back"],
            [
                [
                    row.method, _horizon(row.horizon_order, result), _horizon(row.horizon_position, result),
                    _small(row.error_1), _small(row.back_5), _small(row.back_10), _small(row.back_20),
                ]
                for row in rows
            ],
        )
    )  # fmt: skip
    h = result.horizon
    known = "" if math.isnan(h.published_to_one) else f" (published exponent: {h.published_to_one:.1f})"
    console.print(
        f"Theory for doubles, ln(1/eps) / λ times the collision rate: {h.to_one:.1f} collisions "
        f"a particle to 1 σ{known}, {h.to_apart:.1f} to 0.001 σ; λ = {h.lyapunov:.3g}, rate {h.rate:.3g}."
    )
    show(
        console,
        _table(
            "Bias, relative",
            ["", "Z", "±", "g(σ+)", "±", "D", "±"],
            [
                [
                    row.method, _signed(row.z_bias), _small(row.z_error), _signed(row.contact_bias),
                    _small(row.contact_error), _signed(row.diffusion_bias), _small(row.diffusion_error),
                ]
                for row in rows
            ],
        )
    )  # fmt: skip
    show(
        console,
        _table(
            "Relative error after one CPU second",
            ["", "N", "Z", "D", "D (length² / time)"],
            [
                [
                    row.method, str(row.n_speed), _small(row.z_cost), _small(row.diffusion_cost),
                    f"{row.diffusion:.5f}",
                ]
                for row in rows
            ],
        )
    )  # fmt: skip
    show(
        console,
        _table(
            "Z: how many particles",
            ["N", "collisions / s", "error after 1 s", "finite-size bias", "corrected", "±", "equal after"],
            [
                [
                    str(row.n), f"{row.collisions_per_second:.3g}", _small(row.relative_error_1s),
                    _signed(row.finite_size_bias), _signed(row.corrected_bias), _small(row.corrected_error),
                    f"{row.break_even:.3g} s",
                ]
                for row in result.sizes
            ],
        )
    )  # fmt: skip
    show(
        console,
        _table(
            "g(r): how often to sample one stretch of time",
            ["mean free times", "frames", "error of g(σ+)", "of g(r)", "CPU s"],
            [
                [
                    f"{row.interval:g}", str(row.frames), _small(row.contact_error), _small(row.g_error),
                    f"{row.cpu_seconds:.2f}",
                ]
                for row in result.sampling
            ],
        )
    )  # fmt: skip
    console.print(f"Results in {result.folder}")


def _table(title: str, head: list[str], rows: list[list[str]]) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column(head[0])
    for name in head[1:]:
        table.add_column(name, justify="right")
    for row in rows:
        table.add_row(*row)
    return table


def _small(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.1e}"


def _whole(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.0f}"


def _signed(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:+.1e}"


def _horizon(value: float, result: TradeResult) -> str:
    """Return a number of collisions, as a lower bound if the trajectory was never lost."""
    if math.isnan(value):
        return "-"
    return f"> {result.horizon.followed:.0f}" if math.isinf(value) else f"{value:.1f}"
