"""The command ``carom``: options, screen and exit codes; nothing here computes a result.

Only typer is imported here. The engine, matplotlib and the rest load inside the command that needs them, so
that ``--help`` answers at once.
"""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from carom import studies
from carom.cli import files, pack, plan, run, study, trade
from carom.cli.trouble import told, whole_streams
from carom.pictures.importing import nobody_reads_docstrings
from carom.studies.codes.spec import CodeSpec
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


app.command("run")(run.run)
app.command("pack")(pack.pack)
app.command("resume")(run.resume)
app.command("export")(files.export)
app.command("view")(files.view)
app.command("movie")(files.movie)
app.command("rdf")(files.rdf)
app.command("init")(files.init)
app.command("trade")(trade.trade)
app.command("plan")(plan.plan)
app.command("eos")(study.command_of("eos", StudySpec, lambda: studies.EquationOfState))
app.command("code")(study.command_of("code", CodeSpec, lambda: studies.Codes))
app.command("transport")(study.command_of("transport", TransportSpec, lambda: studies.Transport))


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
