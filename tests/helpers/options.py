"""All commands, and a plan that some of them take."""

import typer

from carom import cli
from carom.studies.planner.choice import Design
from carom.studies.planner.plan import RunPlan
from carom.studies.planner.system import System
from carom.studies.planner.target import Target

COMMANDS = typer.main.get_command(cli.app).commands


PLAN = RunPlan(
    Target("Z", 0.1), System(0.3), 3.98, "virial", {"virial": 1.0},
    Design(32, 1, 10.0, 64.0, 0.1, 0.01, 0.1005, 0.01), cores=1, walltime=None, seed=1,
)  # fmt: skip
"""What a planner that is only asked returns."""
