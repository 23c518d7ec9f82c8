"""What the numbers of a checkpoint must be, so that the engine, which trusts its arrays, can go on with them.

A wrong index or an endless chain would end the interpreter or never end, and a digest can be forged. So each
index, count, size and real is checked, and what follows from the scene is compared with it.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import checks
from carom.compiling.registry import is_ours
from carom.engine.build import arrays
from carom.engine.calendar import BLOCK
from carom.engine.constants import OBSTACLE, TIMER_EVENT
from carom.engine.neighbors.all_pairs import Everybody
from carom.engine.neighbors.bounds import EqualBounds
from carom.engine.neighbors.contact_cache import CAPACITY, STALE
from carom.engine.neighbors.grid import coordinate_bits
from carom.engine.neighbors.lists import NeighborLists
from carom.engine.neighbors.sectors import Sectors
from carom.engine.observers.interface import kept_arrays, listed
from carom.engine.observers.own import Own
from carom.models.interactions.units import COMPLAINTS, Units
from carom.models.interfaces.memory import fields_of
from carom.simulation.clock import LAST_EPOCH

if TYPE_CHECKING:
    from carom.engine.build import Engine
    from carom.simulation.run_state import RunState

MOST_BOXES = 2.0**20
"""Boxes from the origin, at most, and factor on speeds by which they may differ from those of now."""

FINITE = float(np.finfo(np.float64).max)  # largest number

PARTED = 2.0**-20  # largest part by which radii that have grown may differ from what rates and the clock say

FIXED = re.compile(
    r"calendar\..*|model\.obstacles\.(x|image|v)|state\.clock\.length"
    r"|neighbors\.(found|points|sizes|newcomers|hits|neighbor_cells|grid\.(neighbor_cells|gaps|ahead))"
    r"|neighbors\.(grid\.(shape|base|spans)|digits|ways|moves|faces|extra_slack|names)"
    r"|neighbors\.bounds\.(bounds|skins|rates|starts|size_classes|largest)|neighbors\.steps\.(kinds|outside)"
)
"""Arrays that follow from the scene, from the scheme and from when each component is due, and those that are
written before they are read.
"""

COUNTS = re.compile(
    r"tallies\.(collisions|advancements|transits|clamped|returns)"
    r"|model\.(pair\.(events|drawn|asked)|obstacles\.(hits|chain\..*)"
    r"|impact\.spared)|neighbors\.contacts\.versions"
)
"""Arrays of integers of which none is negative."""

SCRATCH = re.compile(
    r"neighbors\.(packed_flights|packed_self|paths|flight)|model\.(pair\.(memory|units\..*|told\..*)|timers\..*)"
)
"""Arrays of reals that are written before they are read, and memory of the rules of units."""

PARTS = ("state.", "neighbors.", "tallies.", "model.", "observers.")  # names of the engine's

UNENDING = re.compile(
    r"state\.(rows\.event_time|crossing_time)|neighbors\.contacts\.first_dropped|.*\.last|model\.pair\.(timers|inner|outer|enter|leave|energy)"
)
"""Arrays of reals that may be infinite."""


def whole(attributes: Mapping[str, Any], name: str, low: int, high: int) -> int:
    """Return an attribute that is an integer from `low` to `high`."""
    value = attributes[name]
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ValueError(f"its {name} is {checks.describe(value)}; expected an integer from {low} to {high}")
    return value


def real(attributes: Mapping[str, Any], name: str, low: float, high: float = math.inf) -> float:
    """Return an attribute that is a number from `low` to below `high`."""
    value = attributes[name]
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value < high:
        raise ValueError(f"its {name} is {checks.describe(value)}; expected a number from {low:g}")
    return float(value)


def reals(attributes: Mapping[str, Any], name: str, low: float) -> list[float]:
    """Return an attribute that is a list of finite numbers, of at least `low`, in JSON."""
    values = json.loads(str(attributes[name]))
    if not isinstance(values, list):
        raise ValueError(f"its {name} is {checks.describe(values)}; expected a list of numbers")
    return [real({name: value}, name, low) for value in values]


def base_of(attributes: Mapping[str, Any]) -> Fraction:
    """Return the time at which the counting of epochs began."""
    found = re.fullmatch(r"(\d{1,4000})/(\d{1,4000})", str(attributes["base"]))
    if found is None or int(found[2]) == 0 or (base := Fraction(int(found[1]), int(found[2]))) > 10**300:
        raise ValueError("its base is no time")
    return base


def logged_in(attributes: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return how much of the event log was written, or None without a log."""
    logged, path = attributes["logged"], attributes["event_log"]
    if logged is None:
        return None
    sums = logged["sums"]
    whole(logged, "events", 0, 2**62)
    if not isinstance(path, str) or "\0" in path or not isinstance(sums, dict):
        raise ValueError("its event_log is no path, or has no checksums")
    return {"events": logged["events"], "sums": sums}


def check_settings(settings: Mapping[str, Any], saved: Mapping[str, np.ndarray], dimension: int) -> None:
    """Refuse a scheme whose sizes are not those of the arrays, before room is made for it."""
    largest = max((array.size for array in saved.values()), default=0)
    shape = settings["shape"]
    if settings["kind"] not in ("lists", "sectors", "all", "pairs") or len(shape) != dimension:
        raise ValueError(f"its scheme is {settings['kind']!r} of {len(shape)} axes")
    for axis in range(dimension):
        whole({f"shape[{axis}]": shape[axis]}, f"shape[{axis}]", 1, largest)
    if math.prod(shape) > largest:
        raise ValueError(f"its scheme has {math.prod(shape)} cells, for which there are no arrays")
    for name in ("cell_capacity", "capacity"):
        whole(settings, name, 0, largest)
    whole(settings, "heap", 0, 4 * len(saved["initial_velocities"]) + 2**16)
    whole(settings, "step", 0, 2**40)
    for name in ("epoch", "width"):
        if math.frexp(real(settings, name, 5e-324))[0] != 0.5:
            raise ValueError(f"its {name} is no power of two")
    for name in ("list_range", "span", "horizon"):
        if math.isnan(settings[name]) or settings[name] < 0.0:
            raise ValueError(f"its {name} is {settings[name]}; expected a number from 0")


def check_start(saved: Mapping[str, np.ndarray]) -> None:
    """Refuse velocities, radii and rates at the start that are no numbers, or not one for each component."""
    shape = saved["scene.positions"].shape
    for name, wanted in (
        ("initial_velocities", shape),
        ("contents.radii", shape[:1]),
        ("contents.rates", shape[:1]),
    ):
        array = saved.get(name, np.zeros(wanted))
        least = -math.inf if name == "initial_velocities" else 0.0
        if array.shape != wanted or array.dtype != np.float64 or not np.isfinite(array).all():
            raise ValueError(f"its {name} holds what is no number, or not one for each component")
        if array.min() < least:
            raise ValueError(f"its {name} holds {array.min()}; expected {least:g} or more")


def check_exchanged(radii: np.ndarray, rates: np.ndarray | None, diameters: np.ndarray) -> None:
    """Refuse radii that do not grow, and are not those of the scene in some order."""
    if rates is None and (np.sort(2.0 * radii) != np.sort(diameters)).any():
        raise ValueError("its contents.radii are not those of its scene")


def following(engine: Engine, names: Iterable[str]) -> list[str]:
    """Return which of these arrays of an engine follow from others, or are scratch; no file holds them."""
    pair: Any = engine.model.pair
    ours = type(pair).__module__.startswith("carom.")
    fields = fields_of(type(pair)).items() if ours else ()  # type: ignore[arg-type]
    fixed = {f"model.pair.{name}" for name, each in fields if each.role == "parameter"}
    if isinstance(engine.neighbors, Sectors):  # in lists it has all neighbors
        fixed.add("neighbors.refs")
    return [name for name in names if name in fixed or FIXED.fullmatch(name)]


def check(run_state: RunState, saved: Mapping[str, np.ndarray]) -> None:
    """Refuse an engine that has numbers with which it cannot go on, and arrays that it has not."""
    mine = arrays(run_state.engine)
    for name in saved:
        if name.startswith(PARTS) and name not in mine:
            raise ValueError(f"its {name} belongs to no part of such a run")
    for problem in _problems(run_state, mine):
        raise ValueError(f"its {problem}")


def _problems(run_state: RunState, mine: Mapping[str, np.ndarray]) -> Iterator[str]:
    """Yield what is wrong, as the end of a sentence."""
    for name, array in mine.items():
        if name.startswith("observers.") or _is_of_users_model(run_state, name):
            continue
        if array.dtype.kind == "f" and array.size and not SCRATCH.fullmatch(name):
            low, high = array.min(), array.max()
            if np.isnan(low) or (np.isinf([low, high]).any() and not UNENDING.fullmatch(name)):
                yield f"{name} holds NaN or infinite values"
        if array.dtype.kind == "i" and array.size and COUNTS.fullmatch(name) and array.min() < 0:
            yield f"{name} holds negative numbers"
    yield from _of_clock(run_state)
    yield from _of_state(run_state)
    neighbors = run_state.engine.neighbors
    if isinstance(neighbors, NeighborLists):
        yield from _of_lists(run_state, neighbors)
    elif isinstance(neighbors, Sectors):
        yield from _of_sectors(run_state, neighbors)
    elif isinstance(neighbors, Everybody):
        yield from _of_everybody(run_state, neighbors)
    yield from _of_model(run_state)


def _is_of_users_model(run_state: RunState, name: str) -> bool:
    """Tell whether an array is the memory of a model that is not Carom's: what it may hold is not known."""
    part: Any = run_state.engine
    for word in name.split(".")[:-1]:
        part = part[int(word)] if word.isdigit() else getattr(part, word)
        if isinstance(part, tuple) and type(part) is not tuple and not is_ours(type(part).__module__):
            return True
    return False


def _outside(name: str, values: np.ndarray, low: float, high: float) -> Iterator[str]:
    """Yield what is wrong where not all values lie from `low` to `high`."""
    if values.size and not (values.min() >= low and values.max() <= high):
        yield f"{name} holds {values.min()} to {values.max()}; expected {low} to {high}"


def _of_clock(run_state: RunState) -> Iterator[str]:
    clock, record = run_state.clock, run_state.engine.state.clock[0]
    length = float(record.length)
    if not 0 <= clock.epoch < LAST_EPOCH or not 0 <= clock.epoch - int(record.epoch) <= 1:
        yield f"clock is in the epochs {clock.epoch} and {int(record.epoch)}; expected the same or the next"
    if not 0.0 <= clock.offset <= length or not 0.0 <= float(record.now) <= length:
        yield f"clock is at {clock.offset} and {float(record.now)}; expected 0 to {length}"
    if not math.isfinite(math.ldexp(float(clock.epoch), math.frexp(length)[1] + run_state.unit.exponent)):
        yield "clock is at no time"
    if not 0 <= run_state.counted <= run_state.collisions:
        yield f"collisions are {run_state.collisions}, and {run_state.counted} before them"


def _of_state(run_state: RunState) -> Iterator[str]:
    scene, engine = run_state.scene, run_state.engine
    rows, n, length = engine.state.rows, scene.n, float(engine.state.clock[0].length)
    far = MOST_BOXES * max(scene.box)
    # Rows in single precision round the times.
    now, time_rounding = float(engine.state.clock[0].now), PARTED * length
    yield from _outside("state.rows.x", rows["x"], -far, far)
    yield from _outside("state.rows.t", rows["t"], 0.0, now + time_rounding)
    yield from _outside("state.rows.event_time", rows["event_time"][:n], now - time_rounding, math.inf)
    yield from _outside("state.crossing_time", engine.state.crossing_time, now - time_rounding, math.inf)
    if np.count_nonzero(rows["event_time"][:n] < now) > BLOCK // 4:
        yield "state.rows.event_time is before the present for many"
    if rows["event_time"][n] != -math.inf:
        yield "state.rows.event_time lets the padding row meet somebody"
    with np.errstate(over="ignore"):
        squares = np.sum(np.square(rows["v"].astype(np.float64)))
    if not math.isfinite(squares):
        yield "state.rows.v holds speeds whose squares are beyond all numbers"
    name, refs, model = "state.partner", engine.state.partner.astype(np.int64), engine.model
    bits = getattr(model.boundary, "bits", 0)
    named = refs[refs >= 0]
    yield from _outside(name, named >> bits, 0, n - 1)
    if hasattr(model.boundary, "digits"):
        yield from _outside(name, named & ((1 << bits) - 1), 0, 3**scene.dimension - 1)
    fixed = refs[(refs <= OBSTACLE) & (refs != TIMER_EVENT)]
    count = 0 if model.obstacles is None else len(model.obstacles.hits)
    yield from _outside(name, OBSTACLE - fixed, 0, count - 1)
    if model.rules is None and model.timers is None and (refs == TIMER_EVENT).any():
        yield f"{name} has events of single components, and no rules or drive"


def _listed_once(name: str, found: np.ndarray, places: np.ndarray, right: np.ndarray) -> Iterator[str]:
    """Yield what is wrong where not every component is ``found`` once, in its ``right`` one of the places."""
    if len(found) != len(right) or not np.array_equal(np.sort(found), np.arange(len(right))):
        yield f"{name} does not hold every component once"
    elif not np.array_equal(right[found], places):
        yield f"{name} holds a component where it is not"


def _of_lists(run_state: RunState, lists: NeighborLists) -> Iterator[str]:
    n, dimension = run_state.scene.n, run_state.scene.dimension
    cell_capacity = lists.cells.shape[1]
    yield from _outside("neighbors.members", lists.members, 0, cell_capacity)
    yield from _outside("neighbors.cells", lists.cells, 0, n)
    bits = 0 if lists.steps is None else lists.steps.bits
    yield from _outside("neighbors.refs", lists.refs >> np.uint32(bits), 0, n)
    if isinstance(lists.bounds, EqualBounds):
        begins = np.arange(n + 1) * int(lists.bounds.capacity)
        levels = np.zeros(n, np.int64)
    else:
        begins, levels = lists.bounds.starts, lists.bounds.size_classes[:n].astype(np.int64)
    counts = lists.counts.astype(np.int64)
    if (counts < 0).any() or (counts > np.diff(begins)).any():
        yield "neighbors.counts is more than lists have room for"
        return
    if lists.steps is not None:
        yield from _outside("neighbors.steps.ready", lists.steps.ready, 0, 1)
    width = coordinate_bits(dimension)
    cell = np.zeros(n, np.int64)
    for axis in range(dimension):
        step = (lists.reference >> np.uint64(width * axis)).astype(np.int64) & ((1 << width) - 1)
        cell = cell * lists.grid.shape[levels, axis] + ((step * lists.grid.shape[levels, axis]) >> width)
    held = np.arange(cell_capacity) < lists.members[:, np.newaxis]
    listed_cell = np.broadcast_to(np.arange(len(lists.members))[:, np.newaxis], held.shape)[held]
    yield from _listed_once(
        "neighbors.cells",
        lists.cells[:-1][held].astype(np.int64),
        listed_cell,
        lists.grid.base[levels] + cell,
    )
    # Whoever lists another is listed by that one, on the same step: each finds the entry of the other.
    mine = np.repeat(np.arange(n), counts)
    places = np.arange(len(mine)) + np.repeat(begins[:-1] - (np.cumsum(counts) - counts), counts)
    refs = lists.refs[places].astype(np.int64)
    other, step = refs >> bits, refs & ((1 << bits) - 1)
    if (other == mine).any() or (other >= n).any():
        yield "neighbors.refs lists nobody, or a component with itself"
        return
    sides = [np.sort(((a * n + b) << bits) + step) for a, b in ((mine, other), (other, mine))]
    if not np.array_equal(sides[0], sides[1]) or (sides[0][1:] >> bits == sides[0][:-1] >> bits).any():
        yield "neighbors.refs does not list both of each pair once"


def _of_sectors(run_state: RunState, sectors: Sectors) -> Iterator[str]:
    n, dimension = run_state.scene.n, run_state.scene.dimension
    for axis, size in enumerate(sectors.shape):
        yield from _outside("neighbors.cell", sectors.cell[:, axis], 0, size - 1)
    yield from _outside("neighbors.wraps", sectors.wraps, -MOST_BOXES, MOST_BOXES)
    yield from _outside("neighbors.exit_face", sectors.exit_face, 0, 2 * dimension - 1)
    cell_capacity = sectors.members.shape[1] - 1
    counts = sectors.members[:, -1]
    yield from _outside("neighbors.members", counts, 0, cell_capacity)
    yield from _outside("neighbors.members", sectors.members[:, :-1], 0, n)
    held = np.arange(cell_capacity) < counts[:, np.newaxis]
    listed_cell = np.broadcast_to(np.arange(len(counts))[:, np.newaxis], held.shape)[held]
    cell = np.zeros(n, np.int64)
    for axis, size in enumerate(sectors.shape):
        cell = cell * size + sectors.cell[:n, axis]
    yield from _listed_once(
        "neighbors.members", sectors.members[:, :-1][held].astype(np.int64), listed_cell, cell
    )


def _of_everybody(run_state: RunState, everybody: Everybody) -> Iterator[str]:
    n, contacts = run_state.scene.n, everybody.contacts
    yield from _outside("neighbors.contacts.found", contacts.found["other"], 0, n - 1)
    yield from _outside("neighbors.contacts.counts", contacts.counts, STALE, CAPACITY)
    yield from _outside("neighbors.lined_up_epoch", everybody.lined_up_epoch, -1, LAST_EPOCH)
    fastest = float(np.abs(run_state.engine.state.rows["v"][:n].astype(np.float64)).max())
    most = MOST_BOXES * max(fastest * everybody.span * inverse for inverse in everybody.inverse)
    yield from _outside("neighbors.fastest", everybody.fastest, 0.0, most)
    yield from _outside("neighbors.swiftest", everybody.swiftest, 0.0, most)


def _of_model(run_state: RunState) -> Iterator[str]:
    model, n = run_state.engine.model, run_state.scene.n
    record = run_state.engine.state.clock[0]
    if run_state.system.rates is not None and run_state.system.radii is not None:
        elapsed = float(record.epoch) * float(record.length)
        grown = run_state.system.radii + run_state.system.rates * elapsed
        if not np.allclose(model.pair.radii[:n], grown, rtol=PARTED, atol=0.0):
            yield "model.pair.radii is not what has grown until now"
    pair = model.pair
    if isinstance(pair, Units):
        kinds = pair.counts.shape[-1]
        for name, values, low, high in (
            ("kinds", pair.kinds, 0, kinds - 1),
            ("present", pair.present, 0, 1),
            ("counts", pair.counts, 0, n),
            ("targets", pair.targets, -1, n - 1),
            ("news", pair.news, -1, n - 1),
            ("queue", pair.queue, 0, n - 1),
            ("queued", pair.queued, 0, 0),
            ("begun", pair.begun, 0, 1),
            ("fault", pair.fault[:1], 0, max(COMPLAINTS)),
            ("fault", pair.fault[1:], -1, n - 1),
            ("timers", pair.timers, -math.inf, math.inf),  # of who was removed, a past time
        ):
            yield from _outside(f"model.pair.{name}", values, low, high)
    yield from _of_observers(run_state)


def _of_observers(run_state: RunState) -> Iterator[str]:
    record, observers = run_state.engine.state.clock[0], run_state.engine.model.observers
    oldest = -(float(record.epoch) + 1.0) * float(record.length)
    for each, (name, its) in zip(listed(observers), kept_arrays(observers).items(), strict=True):
        known = each.limits(run_state.scene.n, oldest)
        for field, array in its.items():
            if isinstance(each, Own) and field != "origin":  # the user's
                continue
            least, most = (-FINITE, FINITE) if array.dtype.kind == "f" else (0, np.iinfo(array.dtype).max)
            yield from _outside(f"observers.{name}.{field}", array, *known.get(field, (least, most)))
