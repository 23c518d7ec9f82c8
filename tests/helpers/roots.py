"""A study of one's own of a moment: the roots of some numbers."""

import math
from dataclasses import dataclass
from typing import Annotated

from carom.studies import own


@dataclass(frozen=True)
class RootSpec(own.Spec):
    study, about, grid = "roots of numbers", "Roots of numbers.", ("x",)
    x: Annotated[tuple[float, ...], own.several(own.number()), own.Opt("Numbers.")] = (1.0, 4.0)
    seed: Annotated[int, own.integer(low=0), own.Opt("Seed.")] = 1

    def tasks(self):
        return [{**self.settings(), "x": x} for x in self.x]


@dataclass(frozen=True)
class Row:
    x: Annotated[float, own.Column("x", "g")]
    root: Annotated[float, own.Column("root", "g")]


@dataclass(frozen=True, repr=False)
class Roots(own.Study[RootSpec]):
    Spec, name, axes = RootSpec, "roots", ("x", "root")
    measure = staticmethod(lambda task, look: {"root": math.sqrt(task["x"])})

    @property
    def table(self):
        return own.Table(Row, [Row(r["task"]["x"], r["result"]["root"]) for r in self.records])
