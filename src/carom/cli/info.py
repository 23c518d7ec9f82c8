"""The command ``carom info``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from carom.cli.options import Json
from carom.cli.trouble import friendly
from carom.texts import visible


@friendly
def info(
    path: Annotated[Path, typer.Argument(help="Any file or folder of Carom, or frames of another program.")],
    as_json: Json = False,
) -> None:
    """Tell what a file or folder is, how far it is, and what to type next.

    It may be a scene file, a run, a packing, a study, a plan, a code, a trajectory, a checkpoint, an event
    log or a saved result.

    [bold]Examples[/bold]

    carom info carom-run
    carom info fluid.toml
    carom info carom-run --json
    """
    from carom.results import plain
    from carom.studies.at_path import info as found

    told = found(path)
    print(
        json.dumps(plain(told.to_dict()), indent=2, allow_nan=False) if as_json else visible(told, lines=True)
    )
