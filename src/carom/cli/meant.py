"""Answers to commands and options that do not exist: the one that is meant."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand, TyperGroup

COMMANDS = {
    "rdf": "measure PATH rdf",
    "order": "measure PATH order",
    "msd": "measure PATH msd",
    "status": "info PATH",
    "continue": "resume FOLDER",
    "convert": "export PATH FILE",
    "show": "view PATH",
}
"""Words that somebody may type as a command, and what does that."""

OPTIONS = {
    "--eta": (
        "--phi", "--fraction", "--volume-fraction", "--packing", "--packing-fractions", "--filling",
    ),
    "--density": ("--rho", "--number-density"),
    "--n": ("-n", "-N", "--N", "--number", "--particles", "--spheres", "--count", "--size"),
    "--dimension": ("-k", "--dim", "--dims", "--dimensions", "--ndim"),
    "--cores": ("--workers", "--threads", "--processes", "--jobs", "--cpus", "--nproc"),
    "--seed": ("--random-seed", "--first", "--rng"),
    "--out": ("--output", "--folder", "--directory", "--dir", "--target-folder"),
    "--overwrite": ("--force", "-f", "--replace", "--clobber"),
    "--quiet": ("--silent", "--no-progress"),
    "--walltime": ("--max-walltime", "--time-limit", "--hours", "--seconds"),
    "--collisions-per-particle": ("--collisions", "--length", "--steps"),
    "--relative-error": ("--error", "--accuracy", "--precision", "--tolerance"),
    "--target": ("--error", "--accuracy", "--precision", "--tolerance", "--relative-error"),
    "--dry-run": ("--explain", "--dryrun"),
    "--tries": ("--seeds",),
    "--until-Z": ("--until-pressure",),
    "--pictures": ("--png", "--plot", "--plots"),
    "--resume": ("--continue", "--restart"),
    "--rmax": ("--r-max", "--range"),
    "--color": ("--color-by",),
}  # fmt: skip
"""Names of options, and other words for them: of other programs, and of older versions."""


class Group(TyperGroup):
    """The commands. One that does not exist is answered with the one that is meant."""

    def get_command(self, ctx: Any, name: str) -> Any:
        """Return a command by its name."""
        if name not in self.commands and name in COMMANDS:
            ctx.fail(f"There is no command {name}; `carom {COMMANDS[name]}` does this.")
        return super().get_command(ctx, name)


class Command(TyperCommand):
    """A command. An option that does not exist is answered with the one that is meant."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments."""
        known = {name for each in self.params for name in (*each.opts, *each.secondary_opts)}
        for word in args[: args.index("--")] if "--" in args else args:
            name = word.split("=", 1)[0]
            if name not in known and (
                meant := [one for one in OPTIONS if one in known and name in OPTIONS[one]]
            ):
                ctx.fail(f"No such option: {name}. Did you mean {meant[0]}?")
        return super().parse_args(ctx, args)
