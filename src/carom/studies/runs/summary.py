"""The summary of a finished run: every key of ``summary.json`` with its type, words and unit, said once.

What is written, the check of what is read, and what the screen calls the quantities follow from it.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from carom import checks
from carom.declared import fields_of, needed, option
from carom.io import records
from carom.observables.analysis.layers import Layer
from carom.results import plain
from carom.scene import lattices
from carom.scene.box import LONGEST_EDGE
from carom.studies.held import AT_LEAST_ZERO, POSITIVE, Measured, check_of, held

Positive = Annotated[float, AT_LEAST_ZERO]
Factor = Annotated[float, POSITIVE]
Edge = Annotated[float, records.number(low=0.0, high=LONGEST_EDGE * checks.MAGNITUDE, open_low=True)]
Length = Annotated[float, records.number(low=1.0 / checks.MAGNITUDE, high=checks.MAGNITUDE)]
Part = Annotated[float, records.number(low=checks.FINEST_ERROR, high=1.0)]


@dataclass(frozen=True)
class Moves:
    """Moves since the start."""

    tried: int
    accepted: int


@dataclass(frozen=True)
class BarostatMoves:
    """A barostat, and its moves since the start."""

    pressure: Positive
    interval: Positive
    step: Positive | None
    seed: int
    tried: int
    accepted: int


@dataclass(frozen=True)
class Surface:
    """What a wall or an obstacle bore, and the work it did a time."""

    name: str
    force: Measured
    pressure: Measured
    power: Measured = None


@dataclass(frozen=True)
class Theory:
    """What an equation of state says."""

    name: str
    Z: float | None
    Z_infinite: float | None
    contact_value: float | None
    errors: Factor | None = None  # the key is missing where there are none


_key = functools.partial(needed, None)
_later = functools.partial(option, None)  # a key that older summaries may lack


@dataclass(frozen=True, kw_only=True)
class Summary:
    """The keys in their order, each with words that end with the unit, and its name on the screen."""

    version: str | None = _later("of Carom; with it, `scene.toml` determines every bit")
    seed: int | None = _later("of the random numbers")
    n: Annotated[int, records.integer(low=1, high=lattices.MOST)] = _key("number of particles")
    dimension: Annotated[int, records.integer(low=1, high=lattices.MOST_DIMENSIONS)] = _key("of the box")
    packing_fraction: Positive = _key("of the whole box; with a barostat, that of the mean volume")
    box: list[Edge] = _key("edges of the box at the end [length]")
    diameter: Length = _key("sigma, the largest [length]")
    mass: float | None = _later("the mean [mass]")
    system: str = _later("what was simulated, such as `hard spheres`", default="particles")
    kT: Positive = _key("temperature; where it changes, its mean in the measurement [energy]")
    thermal: bool = _later("whether there is one kT, constant or averaged; in a field false", default=True)
    weight: float | None = _later("mean weight m g of a particle in a field [energy / length]")
    temperature: Measured = _later("with steps or a field: mean kT of the same time as `U` [energy]", "kT")
    equilibration: dict[str, float] | None = _later("`collisions` and `time` before the measurement")
    collisions: int = _key("of pairs, in the measurement")
    time: Positive = _key("of the measurement [time]")
    frames: int = _later("sampled in the measurement", default=0)
    trajectories: list[str] = _later("files with the frames", default=())
    without_trajectory: str | None = _later("why there is none although none was ruled out")
    relative_error: Part | None = _key("that of Z, if one was requested")
    U: Measured = _later("mean potential energy of a particle on steps or in a field [energy]", "U / N")
    volume: Measured = _later("its mean under a barostat [length^d]", "V")
    Z: Measured = _key("PV / NkT of this N", "Z")
    Z_from_rate: Measured = _later("Z from the number of collisions alone")
    Z_infinite: Measured = _key("Z of infinitely many, where theory gives the correction", "Z, infinite N")
    reduced_pressure: Measured = _key("P sigma^d / kT", "P σ^d/kT")
    collision_rate: Measured = _key("collisions of a particle a time [1 / time]", "collision rate of one")
    contact_value: Measured = _key("g(sigma+) from Z", "g(σ+) from collisions")
    contact_value_from_rdf: Measured = _key("g(sigma+) extrapolated from g(r)", "g(σ+) from g(r)")
    contact_values_from_rdf: dict[str, Measured] = _key("of each pair of species of a mixture", "g(σ+)")
    without_rdf: str | None = _key("why there is no g(r)")
    remarks: list[str] = _later("what speaks against equilibrium, what could not be computed", default=())
    note: str | None = _key("what kT, Z and P mean here, why there is no pressure, which theory ends before")
    obstacles: list[Surface] = _key("for each wall and obstacle: `name`, `force`, `pressure`, `power`")
    layers: list[Layer] = _later("in a field, from the bottom on: `low`, `high`, `members`, `kT`", default=())
    collisions_by_species: dict[str, int] | None = _later("pair collisions since the start, as `large-small`")
    units: dict[str, int] | None = _later("range rules: how many units of each kind are left")
    swaps: Moves | None = _later("swaps that were `tried` and `accepted` since the start")
    barostat: BarostatMoves | None = _later(
        "its parameters, and moves `tried` and `accepted` since the start"
    )
    spared_contacts: int = _key("contacts that `elastic_below` or `contact_time` made elastic")
    phase: str | None = _later("`fluid`, `solid` or `coexistence` of equal elastic particles")
    phase_note: str | None = _key("what phase, size or wells say against equilibrium")
    theory: list[Theory] = _key(
        "for each equation: `name`, `Z` (of N), `Z_infinite`, `contact_value`, `errors`"
    )
    energy_drift: float | None = _key("relative change since the start or the last scaling of velocities")
    momentum_drift: float | None = _key("the same of momentum; null where it is not conserved")
    worst_overlap: float = _key(
        "the deepest, of cores at collisions or beyond rounding of anything [diameters]"
    )
    frames_with_overlaps: int | None = _later("those that overlap by more than rounding, with `check`")
    advancement_fraction: Positive = _key("share of events that lost their partner to a third particle")
    clamped_roots: int | None = _later("negative times set to zero")
    transits: int | None = _later("sector crossings, or renewals of lists")

    @classmethod
    def of(cls, values: Any, name: str = "its summary") -> Summary:
        """Return the summary of which a file holds ``values``, checked, without keys that are not known."""
        found: Summary = check_of(cls)(values, name)
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return what the file holds."""
        return dict(plain(held(self)))


HEADS = {name: field.opt.panel for name, field in fields_of(Summary).items() if field.opt is not None}
"""What the screen calls the quantities."""


def checked(value: Any, name: str) -> dict[str, Any]:
    """Check what a file holds of a summary."""
    Summary.of(value, name)
    return dict(value)


def read_summary(path: Path) -> dict[str, Any]:
    """Return the summary of a finished run."""
    remedy = "remove it, and `carom resume` makes it anew"
    return dict(records.read_json(path, checked, "the summary of a run", remedy))


_TIMING = records.table(dict.fromkeys(("collisions_per_second", "seconds"), records.number(low=0.0)))


def read_timing(path: Path) -> dict[str, float]:
    """Return the rate and the wall time of a finished run; empty if the file is missing."""
    return dict(records.read_json(path, _TIMING, "the times of a run", "remove it")) if path.is_file() else {}
