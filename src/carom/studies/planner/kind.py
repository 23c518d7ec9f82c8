"""The folder of a plan."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from carom.io import records
from carom.observables.statistics import value_with_error
from carom.studies.folder import RESULTS, SETTINGS
from carom.studies.kind import Info, Kind
from carom.studies.planner.outcome import NAME as OUTCOME, Outcome
from carom.studies.planner.plan import NAME, RunPlan, load
from carom.texts import typed

_REACHED = records.table(
    {
        "quantity": records.text,
        "value": records.number(),
        "reached": records.table({"error": records.number(low=0.0)}),
    }
)


class OfPlan(Kind):
    """A plan, and its runs if it was run."""

    name = "a plan"
    results = (NAME, OUTCOME)

    def load(self, folder: Path) -> RunPlan:
        """Return a plan."""
        return load(folder)

    def resume(self, folder: Path, *, cores: Any = None, progress: Any = None, **_: Any) -> Outcome:
        """Run a plan, or the rest of it."""
        return load(folder).run(out=folder, cores=cores, progress=progress)

    def info(self, folder: Path) -> Info:
        """Return target, promise and cost of a plan, and the outcome if there is one."""
        plan, done = load(folder), (folder / OUTCOME).is_file()
        found = Info(folder, self.name, "finished" if done else "not run")
        found.next = typed("carom view" if done else "carom resume", folder)
        for name, text in zip(("target", "promise", "cost"), plan._lines(), strict=False):
            found.add(name, text.removeprefix("promised "))
        found.values |= {"n": plan.design.n, "replicas": plan.design.replicas}
        if done:
            words = records.read_json(
                folder / OUTCOME, _REACHED, "the outcome of a plan", "run the plan again"
            )
            value, error = words["value"], words["reached"]["error"]
            said = f"{words['quantity']} = {value_with_error(value, error)} for infinitely many"
            found.add("result", f"{said}, bias included", value=value, error=error)
        elif (folder / SETTINGS).is_file():
            count = len(list((folder / RESULTS).glob("*.json")))
            found.state = f"not finished: {count} of {plan.design.replicas} runs are done"
        return found
