"""Tables of ``carom trade``: a row for each method, each number of particles, each interval of sampling."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from carom.table import Column


def _with(error: str) -> Callable[[float, Any], str]:
    """Return the form of a bias with its standard error."""
    return lambda value, row: f"{value:+.1e} ± {getattr(row, error):.1e}"


def _horizon(kept: str) -> Callable[[float, Any], str]:
    """Return the form of a number of collisions that is a lower bound if the trajectory was ``kept``."""
    return lambda value, row: f"> {value:.0f}" if getattr(row, kept) else f"{value:.1f}"


def _small(head: str) -> Column:
    return Column(head, ".1e", missing="-")


Choice = Annotated[str, Column("choose it", left=True)]

CLEAR = 3.0
"""Standard errors from which a bias counts as measured."""


@dataclass(frozen=True)
class Row:
    """The figures of one method, on one core; nan where none was measured."""

    method: Annotated[str, Column("", left=True, key=True)]
    algorithm: str
    n_speed: Annotated[int, Column("N")]  # of the scene on which speed, Z and D were measured
    # A CPU second.
    collisions_per_second: Annotated[float, Column("collisions / s", ".3g")]
    bytes_per_particle: Annotated[float, Column("bytes / particle", ".0f", missing="-")]
    worst_overlap: Annotated[float, _small("overlap [σ]")]
    # Relative, per million collisions.
    energy_drift: Annotated[float, _small("energy")]
    momentum_drift: Annotated[float, _small("momentum")]
    # Collisions per particle until their order is not the oracle's, and until any position differs by 10^-3
    # diameters; if ``kept``, that did not happen in so many. Medians of three starts.
    horizon_order: Annotated[float, Column("order", _horizon("order_kept"), missing="-")]
    order_kept: bool
    horizon_position: Annotated[float, Column("position", _horizon("position_kept"), missing="-")]
    position_kept: bool
    # Distances [diameters]: from the true positions after one collision per particle; from the start after so
    # many forward and back.
    error_1: Annotated[float, _small("after 1")]
    back_5: Annotated[float, _small("5 back")]
    back_10: Annotated[float, _small("10 back")]
    back_20: Annotated[float, _small("20 back")]
    # Biases are relative; that of D is the deviation from the engine's at the same N.
    z_bias: Annotated[float, Column("Z", _with("z_error"), missing="-")]
    z_error: float
    contact_bias: Annotated[float, Column("g(σ+)", _with("contact_error"), missing="-")]
    contact_error: float
    diffusion: Annotated[float, Column("D [length² / time]", ".5f")]
    diffusion_bias: Annotated[float, Column("D", _with("diffusion_error"), missing="-")]
    diffusion_error: float
    # Relative statistical errors after one CPU second.
    z_cost: Annotated[float, _small("error of Z")]
    diffusion_cost: Annotated[float, _small("of D")]
    choice: Choice


def _choice(task: dict[str, Any], bias: float, error: float) -> str:
    """Return when to choose a method, from the words of its task and its relative bias of Z."""
    method = task["method"]
    if method["kind"] == "event-driven":
        if method["precision"] == "double":
            return "for every measurement: what is wrong is rounding"
        return "for means of large systems, where memory is short; its trajectories are lost sooner"
    if method["kind"] == "naive":
        return "never to measure: it is what the others are checked with"
    if abs(bias) > CLEAR * error:
        return f"for no Z to better than {abs(bias):.1g}; a shorter step costs in proportion"
    return "where motion between collisions must be stepped; no bias is seen within the error"


def _number(value: Any) -> Any:
    """Return a value of a record; nan for one that was not measured."""
    return math.nan if value is None else value


def row(record: dict[str, Any], references: dict[int, tuple[float, list[float]]]) -> Row:
    """Return the figures of a method from the record of its task.

    ``references`` holds by the number of particles the right Z, and D of the engine with its standard error.
    """
    found, spent = record["result"], record["provenance"]
    z, right = references.get(found["n"], (math.nan, [math.nan, math.nan]))
    (mine, error), (count, count_error), own = found["Z"], found["count"], found["D"]
    relative = own[1] / abs(own[0])
    known = 0.0 if own == right else right[1] / abs(right[0])

    same = (
        "method", "algorithm", "bytes_per_particle", "worst_overlap", "energy_drift", "momentum_drift",
        "order_kept", "position_kept", "error_1",
    )  # fmt: skip
    back_5, back_10, back_20 = map(_number, found["back"])
    return Row(
        **{name: _number(found[name]) for name in same},
        n_speed=found["n"],
        collisions_per_second=spent["collisions_per_second"],
        horizon_order=_number(found["order"]),
        horizon_position=_number(found["position"]),
        back_5=back_5,
        back_10=back_10,
        back_20=back_20,
        z_bias=mine / z - 1.0,
        z_error=error / z,
        # g(sigma+) is proportional to Z - 1.
        contact_bias=(count - 1.0) / (z - 1.0) - 1.0,
        contact_error=count_error / abs(z - 1.0),
        diffusion=own[0],
        diffusion_bias=own[0] / right[0] - 1.0,
        diffusion_error=math.hypot(relative, known),
        z_cost=error / abs(mine) * math.sqrt(spent["cpu_seconds"]),
        diffusion_cost=relative * math.sqrt(spent["cpu_seconds"]),
        choice=_choice(record["task"], mine / z - 1.0, error / z),
    )


@dataclass(frozen=True)
class SizeRow:
    """Cost and error of Z at one N; nan without a theory."""

    n: Annotated[int, Column("N", key=True)]
    collisions_per_second: Annotated[float, Column("collisions / s", ".3g")]
    z: float
    error: float
    relative_error_1s: Annotated[float, _small("error after 1 s")]
    finite_size_bias: Annotated[float, Column("finite-size bias", "+.1e", missing="-")]
    # Against theory, after the correction to leading order.
    corrected_bias: Annotated[float, Column("corrected", _with("corrected_error"), missing="-")]
    corrected_error: float
    # CPU seconds after which the uncorrected bias is larger than the statistical error.
    break_even: Annotated[float, Column("equal after [s]", ".3g", missing="-")]
    choice: Choice


def size_row(record: dict[str, Any]) -> SizeRow:
    """Return the figures of a number of particles."""
    found, spent = record["result"], record["provenance"]
    (z, error), bias, corrected = found["Z"], found["bias"], found["corrected"]
    relative = error / abs(z)
    after_1s = relative * math.sqrt(spent["cpu_seconds"])
    even = (after_1s / bias) ** 2 if bias else math.nan
    choice = (
        f"for errors of Z above {abs(bias):.1g}, or corrected to infinite size" if bias else "as you like"
    )
    return SizeRow(
        n=found["n"],
        collisions_per_second=spent["collisions_per_second"],
        z=z,
        error=error,
        relative_error_1s=after_1s,
        finite_size_bias=_number(bias),
        corrected_bias=_number(corrected),
        corrected_error=relative,
        break_even=even,
        choice=choice,
    )


@dataclass(frozen=True)
class SamplingRow:
    """Cost and error of g(r) at one sampling interval."""

    interval: Annotated[float, Column("mean free times", "g", key=True)]
    frames: Annotated[int, Column("frames")]
    contact_error: Annotated[float, _small("error of g(σ+)")]
    g_error: Annotated[float, _small("of g(r)")]  # mean in bins of 0.02 diameters, up to two diameters
    cpu_seconds: Annotated[float, Column("CPU [s]", ".2f")]
    choice: Choice


FRESH, SELDOM = 1.0, 3.0
"""Intervals from which a frame hardly resembles the one before, and up to which frames are many [mean free
times]."""


def _interval(interval: float) -> str:
    """Return when to choose an interval."""
    if interval < FRESH:
        return "where time is dear and frames cost nothing: they resemble each other"
    if interval <= SELDOM:
        return "by default: each frame tells something new"
    return "where the disk is short: fewer frames, larger error"


def sampling_row(record: dict[str, Any]) -> SamplingRow:
    """Return the figures of an interval."""
    found = record["result"]
    return SamplingRow(
        found["interval"], found["frames"], _number(found["contact_error"]), found["g_error"],
        record["provenance"]["cpu_seconds"], _interval(found["interval"]),
    )  # fmt: skip
