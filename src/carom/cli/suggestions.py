"""Answers to commands and options that do not exist: the one that is meant."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand, TyperGroup

from carom import suggestions
from carom.declared import fields_of

COMMANDS = {
    "rdf": "measure PATH rdf",
    "order": "measure PATH order",
    "msd": "measure PATH msd",
    "status": "info PATH",
    "inspect": "info PATH",
    "simulate": "run SCENE",
    "plot": "measure PATH",
    "new": "init FILE",
    "continue": "resume FOLDER",
    "convert": "export PATH FILE",
    "show": "view PATH",
}
"""Words that somebody may type as a command, and what does that."""


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
        known |= {each.metavar for each in self.params if each.metavar and each.param_type_name == "argument"}
        for word in args[: args.index("--")] if "--" in args else args:
            name = word.split("=", 1)[0]
            if not name.startswith("-") or name in known:
                continue
            if one := suggestions.synonym(name, sorted(known)):
                ctx.fail(f"No such option: {name}. Did you mean {one}?")
            if said := self._elsewhere(name.lstrip("-").replace("-", "_")):
                ctx.fail(f"No such option: {name}. {said}.")
            if other := suggestions.synonym(name, suggestions.FIRST):
                ctx.fail(f"No such option: {name}. {ctx.command_path} has no {other}.")
        return super().parse_args(ctx, args)

    def _elsewhere(self, word: str) -> str:
        """Return where a word that is no option stands, or why nowhere; else ""."""
        from carom.scene_file.sections import RunSpec, SceneSpec

        if one := suggestions.named(word, suggestions.NOWHERE):
            return suggestions.NOWHERE[one].capitalize()
        if "scene" not in {each.name for each in self.params}:
            return ""
        for spec in (SceneSpec, RunSpec) if self.name == "run" else (SceneSpec,):
            gone = {name: text for name, text in spec.gone.items() if "give " in text}
            if one := suggestions.named(word, gone):
                return f"In [{spec.section}] of a scene file {gone[one]}"
            if one := suggestions.named(word, [*fields_of(spec)]):
                return f"A scene file has {one}, in [{spec.section}]"
        return ""
