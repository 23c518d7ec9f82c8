"""A job: one long calculation in steps, kept from time to time, which goes on where it was after a kill.

A job is a dataclass. Its fields are its state, and are kept: numbers, texts, lists and dictionaries of them,
arrays, and the simulation. What follows from the task and the scene is made anew.
"""

from __future__ import annotations

import contextlib
import json
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from carom.errors import FileError, InputError
from carom.io import checkpoint as file
from carom.simulation.files import checkpoint
from carom.simulation.simulation import Simulation
from carom.version import __version__

EVERY = 5.0
"""Seconds between two writings of a state, at least."""

PART = 9.0
"""And so many times what the last one took, as a large state takes long to write."""

OTHERS = ("task", "sim")
"""Fields that are not kept as the others are: the name of the file says which task it is."""

MODELS = ("obstacles", "interaction", "motion", "impact", "drive")
"""Parts of a scene that may be of a class of one's own."""


class Stopped(Exception):
    """A job ended because it was told to stop."""


@dataclass(eq=False)
class Look:
    """What a job calls several times a second: whether it is to stop, and where it is kept."""

    stop: Callable[[], bool] | None = None  # None in a process of its own, which is ended from outside
    kept: Path | None = None  # the file of its state; None where there is no folder
    job: Job | None = None
    progress: Callable[[float, str], object] | None = None
    every: float | None = None  # seconds between two writings, at least; EVERY if left out
    due: float | None = None  # when it is kept next
    strict: bool = False  # whether it ends on a full disk; else it goes on, and is kept later

    def __post_init__(self) -> None:
        self.every = EVERY if self.every is None else self.every
        self.due = clock.perf_counter() + self.every if self.due is None else self.due

    def __call__(self, *_: object) -> None:
        """Keep the job if it is time, and end it if it is asked to; its state must be whole."""
        if self.job is not None and self.progress is not None:
            self.progress(min(max(self.job.fraction, 0.0), 1.0), self.job.stage)
        asked = self.stop is not None and self.stop()
        if self.kept is not None and (asked or clock.perf_counter() >= (self.due or 0.0)):
            self.keep(asked)
        if asked:
            raise Stopped

    def glance(self, *_: object) -> None:
        """End the job if it is asked to, in the middle of what no file holds: it goes on from before."""
        if self.stop is not None and self.stop():
            raise Stopped

    def keep(self, last: bool) -> None:
        """Write the state of the job."""
        began = clock.perf_counter()
        if self.job is not None and self.kept is not None:
            with contextlib.nullcontext() if last or self.strict else contextlib.suppress(FileError):
                self.job.save(self.kept)
        after = clock.perf_counter()
        self.due = after + max(self.every or 0.0, PART * (after - began))


@dataclass
class Job:
    """One long calculation, with a simulation or without; a subclass says how it begins, goes on and ends.

    Attributes
    ----------
    task : dict
        What is asked for.
    sim : Simulation or None
        What runs.
    """

    task: dict[str, Any]
    sim: Any = None

    what: ClassVar[str] = "a task"
    """What it is called where a file holds none."""

    @property
    def stage(self) -> str:
        """What is done now."""
        return "Running"

    @property
    def fraction(self) -> float:
        """Finished fraction of the stage."""
        return 0.0

    @classmethod
    def begin(cls, task: dict[str, Any]) -> Self:
        """Return the job at its start."""
        raise NotImplementedError

    def step(self, look: Look) -> bool:
        """Go on for a part of a second, or call ``look`` so often; return whether there is more to do."""
        raise NotImplementedError

    def result(self) -> dict[str, Any]:
        """Return the result of a job that is over, as JSON values."""
        raise NotImplementedError

    def notes(self) -> dict[str, Any]:
        """Return what is kept beside the simulation."""
        return {each.name: getattr(self, each.name) for each in fields(self) if each.name not in OTHERS}

    def save(self, path: Path) -> None:
        """Write the state.

        Raises
        ------
        FileError
            If the file cannot be written.
        InputError
            If a dictionary has keys that no file gives back.
        """
        notes = self.notes()
        _check_keys(notes, type(self).__name__)
        arrays = {name: notes.pop(name) for name, value in [*notes.items()] if isinstance(value, np.ndarray)}
        if self.sim is not None:
            checkpoint.save(path, self.sim._state, notes, arrays)
        else:
            extra = json.dumps(notes, default=checkpoint.plain)
            file.save(path, {f"extra.{name}": value for name, value in arrays.items()},
                      {"carom": __version__, "extra": extra})  # fmt: skip

    @classmethod
    def load(cls, task: dict[str, Any], path: Path) -> Self:
        """Return the job whose state :meth:`save` wrote.

        Raises
        ------
        FileError
            If the file is missing, damaged, of another version of Carom, or of another job.
        """
        arrays, attributes = file.load(path)
        if attributes.get("carom") != __version__:
            raise FileError(f"{path} was written by another version of Carom; begin anew.")
        try:
            notes = json.loads(attributes["extra"])
            notes |= {name[6:]: array for name, array in arrays.items() if name.startswith("extra.")}
            return cls(task, cls._simulation(task, path) if "scene" in attributes else None, **notes)
        except (KeyError, TypeError, ValueError) as error:
            raise FileError(f"{path} is not the checkpoint of {cls.what}: {error}.") from None

    @classmethod
    def _simulation(cls, task: dict[str, Any], path: Path) -> Simulation:
        """Return the simulation of a file, with models of one's own, which no file holds, from the start."""
        try:
            return Simulation.load(path)
        except FileError:
            if not task:
                raise
        begun = cls.begin(task).sim
        models = {name: getattr(begun.scene, name) for name in MODELS}
        return Simulation.load(path, observers=begun.observers, **models)

    @classmethod
    def measure(cls, task: dict[str, Any], look: Look | None = None) -> dict[str, Any]:
        """Return the result of a task: what is kept of it goes on, and otherwise it begins."""
        job, look = None, look or Look()
        if look.kept is not None and look.kept.exists():
            with contextlib.suppress(FileError):  # of a damaged file: begin anew
                job = cls.load(task, look.kept)
        found: dict[str, Any] = (job or cls.begin(task)).finish(look)
        return found

    def finish(self, look: Look) -> Any:
        """Go on to the end, and return the result."""
        look.job = self
        self.go_on(look)
        return self.result()

    def go_on(self, look: Look) -> None:
        """Go on to the end."""
        look()
        while self.step(look):
            look()


def _check_keys(value: Any, name: str) -> None:
    """Refuse dictionaries with keys that come back as texts, and would be others after a stop."""
    for key in value if isinstance(value, dict) else ():
        if not isinstance(key, str):
            raise InputError(f"{name} has the key {key!r}, and keys in a file are texts; give a text.")
        _check_keys(value[key], f"{name}.{key}")
