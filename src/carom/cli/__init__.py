"""The command ``carom``: options, screen and exit codes; nothing here computes a result.

Only typer is imported here. The engine, matplotlib and the rest load inside the command that needs them, so
that ``--help`` answers at once.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Annotated

import typer

from carom import studies
from carom.cli import files, info, measure, pack, plan, run, study
from carom.cli.suggestions import Command, Group
from carom.cli.trouble import started
from carom.studies.eos.spec import StudySpec
from carom.studies.shear.spec import ShearSpec
from carom.studies.spherical_codes.spec import CodeSpec
from carom.studies.trade.spec import TradeSpec
from carom.studies.transport.spec import TransportSpec
from carom.version import __version__

app = typer.Typer(
    name="carom",
    cls=Group,
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


COMMANDS: dict[str, dict[str, Callable[..., None]]] = {
    "Start": {"init": files.init, "info": info.info},
    "Simulate": {
        "run": run.run, "pack": pack.pack,
        "code": study.command_of("code", CodeSpec, lambda: studies.Codes), "resume": run.resume,
    },
    "Study": {
        "eos": study.command_of("eos", StudySpec, lambda: studies.EquationOfState),
        "transport": study.command_of("transport", TransportSpec, lambda: studies.Transport),
        "shear": study.command_of("shear", ShearSpec, lambda: studies.ShearFlow),
        "plan": plan.plan,
        "trade": study.command_of("trade", TradeSpec, lambda: studies.Trade),
    },
    "Look": {
        "measure": measure.measure, "view": files.view, "movie": files.movie, "export": files.export,
    },
}  # fmt: skip
"""The commands by name, in groups."""

for _group, _commands in COMMANDS.items():
    for _name, _command in _commands.items():
        # Paragraphs are as wide as the terminal; each example has a line.
        _said, *_examples = re.split(r"(?=\[bold\])", inspect.getdoc(_command) or "", maxsplit=1)
        _said = re.sub(r"(?<!\n)\n(?!\n)", " ", _said)
        app.command(_name, help="".join([_said, *_examples]), rich_help_panel=_group, cls=Command)(_command)


def main() -> None:
    """Run the command line."""
    started(app)
