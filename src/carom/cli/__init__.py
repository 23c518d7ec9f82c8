"""The command ``carom``: options, screen and exit codes; nothing here computes a result.

Only typer is imported here. The engine, matplotlib and the rest load inside the command that needs them, so
that ``--help`` answers at once.
"""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from carom import studies
from carom.cli import code, files, info, measure, pack, plan, run, study, trade
from carom.cli.trouble import told, whole_streams
from carom.pictures.importing import nobody_reads_docstrings
from carom.studies.coefficients.spec import TransportSpec
from carom.studies.eos.spec import StudySpec
from carom.version import __version__

app = typer.Typer(
    name="carom",
    help="Event-driven molecular dynamics of hard particles in any dimension.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    # A traceback that shows local variables would print whole arrays.
    pretty_exceptions_show_locals=False,
    add_completion=True,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"carom {__version__}")
        raise typer.Exit


@app.callback()
def _carom(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and exit.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    pass


START, SIMULATE, STUDY, LOOK = "Start", "Simulate", "Study", "Look"

app.command("init", rich_help_panel=START)(files.init)
app.command("info", rich_help_panel=START)(info.info)
app.command("run", rich_help_panel=SIMULATE)(run.run)
app.command("pack", rich_help_panel=SIMULATE)(pack.pack)
app.command("code", rich_help_panel=SIMULATE)(code.code)
app.command("resume", rich_help_panel=SIMULATE)(run.resume)
app.command("eos", rich_help_panel=STUDY)(study.command_of("eos", StudySpec, lambda: studies.EquationOfState))
app.command("transport", rich_help_panel=STUDY)(
    study.command_of("transport", TransportSpec, lambda: studies.Transport)
)
app.command("plan", rich_help_panel=STUDY)(plan.plan)
app.command("trade", rich_help_panel=STUDY)(trade.trade)
app.command("measure", rich_help_panel=LOOK)(measure.measure)
app.command("view", rich_help_panel=LOOK)(files.view)
app.command("movie", rich_help_panel=LOOK)(files.movie)
app.command("export", rich_help_panel=LOOK)(files.export)


def started(command: Any) -> None:
    """Run a command to the end of the process, with its exit code."""
    whole_streams()
    nobody_reads_docstrings()
    try:
        with told():
            try:
                command()
            finally:
                # Here, because a full device may refuse nothing before.
                sys.stdout.flush()
    except typer.Exit as ended:
        sys.exit(ended.exit_code)


def main() -> None:
    """Run the command line."""
    started(app)
