"""The command ``carom plan``: from a target to the run that reaches it, and its cost."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom.cli.options import Json, Quiet, argument, number_of, of_fields, option, shared, takes
from carom.scene_file.commands import PlanSpec
from carom.spec import tables_of

if TYPE_CHECKING:
    from carom.studies.planner.plan import RunPlan
    from carom.studies.planner.system import System

_SCENE, _OUTPUT = "The system, without a scene file", "What to do with the plan"

FORMS = ("FRACTION:DIAMETER", "FRACTION:DIAMETER:MASS")
"""What --species takes."""

FOLDER = Path("carom-plan")
"""Default folder for a plan that is run."""


@takes(
    argument("scene", r"Scene file (TOML): \[scene] and \[plan]."),
    option("packing_fraction", float, None, help="Fraction of the volume filled by spheres.", panel=_SCENE),
    option("dimension", int, None, help="Dimension of space, 2 to 6; 3.", panel=_SCENE),
    option("species", list[str], None, panel=_SCENE,
           help="FRACTION:DIAMETER, or FRACTION:DIAMETER:MASS. Repeat it for each species."),
    *of_fields(PlanSpec),
    option("run", bool, False, "--run", help="Run the plan, and compare the result with it.", panel=_OUTPUT),
    option("out", Path, None, panel=_OUTPUT,
           help="Folder for plan.json, and with --run for the study, which continues there; carom-plan."),
    shared("as_json", Json),
    shared("quiet", Quiet),
)  # fmt: skip
def plan(
    scene: Path | None, packing_fraction: float | None, dimension: int | None, species: list[str] | None,
    run: bool, out: Path | None, as_json: bool, quiet: bool = False, **given: Any,
) -> None:  # fmt: skip
    """Find a run that reaches an error for little CPU time.

    The plan says how many particles, how long, how many replicas, and what it costs here. A pilot of seconds
    measures rate, variance and equilibration on this machine. Of the sizes the plan takes the cheapest, or
    one that is much more accurate for a second more. If a target cannot be reached, or not in the given time,
    a sentence says so, and says what is possible.

    [bold]Examples[/bold]

    carom plan --target Z=1e-4 --packing-fraction 0.3
    carom plan --target D=0.01 --eta 0.4 --walltime 360 --run
    carom plan --target "g(contact)=+-0.01" --eta 0.45 --cores 8
    carom plan -t P=1e-3 --eta 0.3 --species 0.5:1 --species 0.5:1.4:2
    carom plan -t "D(1)=0.01" --eta 0.3 --species 0.5:1 --species 0.5:1.4:2
    carom plan scene.toml -t Z=1e-3 --run --out mine
    """
    from carom.cli.screen import watched
    from carom.studies.planner.plan import NAME

    folder = FOLDER if run and out is None else out
    with watched() as progress:
        from carom.studies.planner import plan as planner

        kinds = tables_of("--species", *FORMS)(species) if species else None
        given = {**given, "cores": number_of(given["cores"])}
        target = given.pop("target")
        if run and folder is not None and (folder / NAME).exists():
            system = planner.system_of(packing_fraction, dimension, kinds, scene)
            asked = planner.asked_of(target, scene, given)
            found = _held(folder, asked, system)
        else:
            found = planner.plan(
                target, packing_fraction=packing_fraction, dimension=dimension, species=kinds, scene=scene,
                out=folder, **given, progress=progress,
            )  # fmt: skip
    if not as_json:
        _show(found)
    if not run:
        if as_json:
            print(json.dumps(found.to_dict(), indent=2, allow_nan=False))
        return
    with watched() as progress:
        outcome = found.run(out=folder, progress=progress)
    from carom.cli.results import show

    assert folder is not None
    show(outcome, folder, as_json=as_json)


def _held(folder: Path, asked: PlanSpec, system: System) -> RunPlan:
    """Return the plan that a folder holds, if it is for this target and system, and for all that is given."""
    from carom.studies.planner.plan import load
    from carom.studies.planner.target import Target
    from carom.studies.result_folders import check_same

    found = load(folder)
    held = {"n": found.design.n, "seed": found.seed, "cores": found.cores, "walltime": found.walltime}
    given = {name: value for name in held if (value := getattr(asked, name)) is not None}
    if "n" in given:
        given["n"] = system.filling(given["n"])
    check_same(
        folder, "a plan", {"target": found.target, **found.system.words(), **held},
        {"target": Target.parse(asked.target), **system.words(), **held, **given},
    )  # fmt: skip
    return found


def _show(found: RunPlan) -> None:
    """Print a plan, and what other sizes would cost."""
    from carom.cli.tables import Screen

    console = Screen()
    # Lines are wrapped between words on a terminal, and not wrapped in a pipe.
    console.print(found.words(), soft_wrap=not console.is_terminal)
    chosen = next((k for k, size in enumerate(found.sizes) if size.n == found.design.n), 0)
    near = found.sizes[max(chosen - 3, 0) : chosen + 4]
    console.print(dataclasses.replace(found.table, rows=near).rich(console))
