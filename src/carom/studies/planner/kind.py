"""The folder of a plan."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from carom.io import records
from carom.observables.statistics import value_with_error
from carom.studies.folder import SETTINGS, Folder
from carom.studies.info import Info
from carom.studies.planner.outcome import NAME as OUTCOME, Outcome
from carom.studies.planner.plan import load as load

_REACHED = records.table(
    {
        "quantity": records.text,
        "value": records.number(),
        "reached": records.table({"error": records.number(low=0.0)}),
    }
)


def resume(folder: Path, *, cores: Any, progress: Any, **_: Any) -> Outcome:
    """Run a plan, or the rest of it."""
    return load(folder).run(out=folder, cores=cores, progress=progress)


def tell(found: Info, folder: Path) -> None:
    """Add target, promise and cost of a plan, and the outcome if there is one."""
    plan = load(folder)
    for name, text in zip(("target", "promise", "cost"), plan._lines(), strict=False):
        found.add(name, text.removeprefix("promised "))
    found.values |= {"n": plan.design.n, "replicas": plan.design.replicas}
    if (path := folder / OUTCOME).is_file():
        words = records.read_json(path, _REACHED, "the outcome of a plan", "run the plan again")
        value, error = words["value"], words["reached"]["error"]
        said = f"{words['quantity']} = {value_with_error(value, error)} for infinitely many"
        found.add("result", f"{said}, bias included", value=value, error=error)
    else:
        found.state = "not run"
        if (folder / SETTINGS).is_file():
            found.state = f"not finished: {Folder(folder).done()} of {plan.design.replicas} runs are done"
