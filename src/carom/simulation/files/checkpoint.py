"""Contents of a checkpoint: everything that a run needs to continue, bit for bit."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from os import PathLike
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import FileError, InputError
from carom.paths import reason
from carom.scene.storage import from_arrays, to_arrays
from carom.simulation import own_observers
from carom.simulation.clock import LAST_EPOCH, Clock
from carom.simulation.files.recorder import Recorder
from carom.simulation.measuring import flying
from carom.simulation.moves.barostat import Barostat, VolumeMoves
from carom.simulation.moves.oscillation import oscillation_of
from carom.simulation.moves.swaps import Swaps, Sweeps
from carom.simulation.run_state import RunState
from carom.simulation.system_of_scene import speeds_of, system_of, thresholds_of, with_thresholds
from carom.simulation.tuning import Tuning
from carom.units import TimeUnit

if TYPE_CHECKING:
    from carom.models.obstacles import Obstacle

MORE_ROOM = 1.25
"""A state may become larger by this factor: lists are given more room where they overflow."""

RESERVE = 1.1
"""The same where it is packed: what is empty takes nothing, but times and images are all 0 at first."""

CHOSEN = ("images", "single", "currents", "flights")
"""Fields of the system that a file holds by their names."""

LONGEST = 2200  # exponents of all powers of two by which units of time of two doubles can differ

_UNSOUND = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, MemoryError, RecursionError)
"""What attributes of any kind and arrays of any size can lead to."""


def plain(value: Any) -> Any:
    """Return numbers and arrays of NumPy as those of Python."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is none of the values of a file")


def save(
    path: str | PathLike[str],
    run_state: RunState,
    extra: dict[str, Any],
    more: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> None:
    """Write a checkpoint, small values that JSON can hold, and ``more`` arrays, named ``extra.NAME``.

    See :meth:`carom.Simulation.save`.
    """
    with run_state.alone.reading():
        _save(path, run_state, extra, more)


def _save(
    path: str | PathLike[str], run_state: RunState, extra: dict[str, Any], more: Mapping[str, np.ndarray]
) -> None:
    from carom.io import checkpoint
    from carom.version import __version__

    if not run_state.scheduled:  # a file says that it is
        run_state.schedule()
    run_state.flush_log()
    system, clock = run_state.system, run_state.clock
    arrays, scene_attributes = _arrays(run_state)
    arrays |= {f"extra.{name}": value for name, value in more.items()}
    attributes = {
        "carom": __version__,
        "scene": json.dumps(scene_attributes),
        "time_unit": run_state.unit.exponent,
        "thresholds": json.dumps(thresholds_of(system)),
        "base": f"{clock.base.numerator}/{clock.base.denominator}",
        "counted": run_state.counted,
        "wish": json.dumps(run_state.requested),
        "scheme": json.dumps(dataclasses.asdict(run_state.scheme)),
        **{name: getattr(system, name) for name in CHOSEN},
        "observers": json.dumps([own_observers.described(each) for each in system.observers]),
        "epoch": clock.epoch,
        "offset": clock.offset,
        "seconds": run_state.seconds,
        "swaps": _table_of(run_state.sweeps),
        "volume_moves": _table_of(run_state.volume_moves),
        "stage": 0 if run_state.oscillation is None else run_state.oscillation.done,
        "event_log": "" if run_state.log is None else str(run_state.log.path),
        "logged": None if run_state.log is None else run_state.log.mark(),
        "extra": json.dumps(extra, default=plain),
    }
    checkpoint.save(path, arrays, attributes)


def size(run_state: RunState) -> int:
    """Return how many bytes the arrays of a checkpoint take in memory."""
    return sum(array.nbytes for array in _arrays(run_state)[0].values())


def size_of_file(run_state: RunState) -> float:
    """Return how many bytes a checkpoint of the run takes at most; of a large scene lists must be filled."""
    from carom.io.array_compression import expected
    from carom.io.checkpoint import LARGE

    if (plain := size(run_state)) <= LARGE:
        return MORE_ROOM * plain
    return RESERVE * sum(expected(array) for array in _arrays(run_state)[0].values())


def _arrays(run_state: RunState) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Return every array of a checkpoint, and the attributes of its scene."""
    from carom.engine.build import arrays as arrays_of
    from carom.simulation.files.checkpoint_validation import following

    system, engine = run_state.system, run_state.engine
    arrays = {**arrays_of(engine), "initial_velocities": run_state.velocities}
    for name in following(engine, arrays):
        del arrays[name]
    scene_arrays, attributes = to_arrays(run_state.scene)
    arrays.update({f"scene.{name}": value for name, value in scene_arrays.items()})
    if (system.rates is not None or run_state.sweeps is not None) and system.radii is not None:
        arrays["contents.radii"] = system.radii
    if system.rates is not None:
        arrays["contents.rates"] = system.rates
    return arrays, attributes


def _table_of(moves: Sweeps | VolumeMoves | None) -> str:
    """Return the swaps or the moves of the volume of a run, and how far they are, as text."""
    return json.dumps(None if moves is None else [dataclasses.asdict(moves[0]), *moves[1:]])


def _moves_of(attributes: Mapping[str, Any], name: str, of: Any, settings: type) -> Any:
    """Return what was so written; None where there is nothing, as in earlier files."""
    table = json.loads(str(attributes.get(name, "null")))
    if table is None:
        return None
    for found, zero in zip(table[1:], of._field_defaults.values(), strict=True):
        below = LAST_EPOCH if type(zero) is int else math.inf
        if type(found) is not type(zero) or not 0 <= found < below:
            raise ValueError(f"its {name} have the counts and sums {table[1:]}")
    return of(settings(**table[0]), *table[1:])


def load(
    path: str | PathLike[str],
    event_log: str | PathLike[str] | None,
    obstacles: Sequence[Obstacle] | None,
    observers: Sequence[Any],
    **own: Any,
) -> RunState:
    """Return what runs; see :meth:`carom.Simulation.load`."""
    from carom.engine.build import arrays as arrays_of, restore
    from carom.engine.neighbors.plan import NeighborPlan
    from carom.io import checkpoint
    from carom.simulation.files import checkpoint_validation
    from carom.version import __version__

    arrays, attributes = checkpoint.load(path)
    try:
        version = str(attributes["carom"])
        if version != __version__:
            raise FileError(
                f"{path} was written by Carom {version}, this is {__version__}, and the same bits "
                "are only promised within one version; go on with that version, or start from a frame."
            )
        settings = json.loads(str(attributes["scheme"]))
        checkpoint_validation.check_start(arrays)
        checkpoint_validation.check_settings(settings, arrays, arrays["initial_velocities"].shape[1])
        scheme = NeighborPlan(**{**settings, "shape": tuple(settings["shape"])})
        scene = from_arrays(
            {name[6:]: value for name, value in arrays.items() if name.startswith("scene.")},
            json.loads(str(attributes["scene"])),
            obstacles=obstacles,
            **own,
        )
        unit = TimeUnit(checkpoint_validation.whole(attributes, "time_unit", -LONGEST, LONGEST))
        rates = arrays.get("contents.rates")
        velocities = arrays["initial_velocities"]
        growing = None if rates is None else unit.to_scene(rates, -1)
        stage = checkpoint_validation.whole(attributes, "stage", 0, LAST_EPOCH)
        chosen = {name: bool(attributes[name]) for name in CHOSEN}
        system = system_of(speeds_of(scene, velocities, growing, unit), growing, stage=stage, **chosen)
        system = with_thresholds(system, checkpoint_validation.reals(attributes, "thresholds", 0.0))
        recalled = json.loads(str(attributes["observers"])), observers, system.particles
        system = dataclasses.replace(system, observers=own_observers.recalled(*recalled))
        sweeps = _moves_of(attributes, "swaps", Sweeps, Swaps)
        if rates is not None or sweeps is not None:
            radii = arrays["contents.radii"]
            checkpoint_validation.check_exchanged(radii, rates, scene.diameters)
            system = dataclasses.replace(system, radii=radii, diameter=2.0 * float(radii.max()))
        neighbors, shell = json.loads(str(attributes["wish"]))
        requested = Tuning(neighbors, shell).requested
        run_state = RunState(scene, velocities, system, requested, scheme)
        mine = arrays_of(run_state.engine)
        fixed = checkpoint_validation.following(run_state.engine, mine)
        restore(run_state.engine, arrays | {name: mine[name] for name in fixed})
        run_state.sweeps = sweeps
        run_state.oscillation = oscillation_of(scene, stage)
        if moves := _moves_of(attributes, "volume_moves", VolumeMoves, Barostat):
            run_state.volume_moves = moves
        run_state.counted = checkpoint_validation.whole(attributes, "counted", 0, LAST_EPOCH)
        epoch, offset = (
            checkpoint_validation.whole(attributes, "epoch", 0, LAST_EPOCH),
            checkpoint_validation.real(attributes, "offset", 0.0),
        )
        run_state.clock = Clock(unit, scheme.epoch, checkpoint_validation.base_of(attributes), epoch, offset)
        run_state.seconds = checkpoint_validation.real(attributes, "seconds", 0.0)
        if run_state.oscillation and not run_state.oscillation.contains(run_state.clock.instant):
            raise ValueError("the stage of its shear is not that of its time")
        checkpoint_validation.check(run_state, arrays)
        if not isinstance(json.loads(str(attributes["extra"])), dict):
            raise ValueError("its extra is no table")
        logged = checkpoint_validation.logged_in(attributes)
    except _UNSOUND as error:
        if isinstance(error, FileError):
            raise
        sentence = reason(error).rstrip(".")
        raise FileError(f"{path} cannot be loaded as a checkpoint: {sentence}.") from None
    if run_state.system.flights:  # it was saved while they were measured
        flying.leave_out(run_state)
    if event_log is not None and logged is None:
        raise InputError(f"{path} was written without an event log, so {event_log} cannot be its log.")
    if logged is not None:
        run_state.begin_log(Recorder(event_log or str(attributes["event_log"]), run_state, logged))
    return run_state
