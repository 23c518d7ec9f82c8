"""What a scene requires and what not: its models, its arrays, its neighbor scheme and the reason for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.scene.scene import Scene
from carom.simulation.moves.barostat import checked_barostat
from carom.simulation.moves.oscillation import refuse_oscillation
from carom.simulation.moves.swaps import checked_swaps
from carom.simulation.system_of_scene import prepare
from carom.simulation.tuning import DEFAULT, Requested, Tuning

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from carom.engine.build import Engine
    from carom.engine.neighbors.plan import NeighborPlan
    from carom.engine.system import System
    from carom.simulation.moves.barostat import Barostat
    from carom.simulation.moves.swaps import Swaps
    from carom.simulation.simulation import Simulation


@dataclass(frozen=True)
class Array:
    """An array of a run.

    Attributes
    ----------
    name : str
        Its place in the engine, such as ``state.rows``.
    shape : tuple of int
        Its shape.
    dtype : str
        Type of an item; the fields of a record, with its size.
    nbytes : int
        Memory [bytes].
    """

    name: str
    shape: tuple[int, ...]
    dtype: str
    nbytes: int


@dataclass(frozen=True)
class Explanation:
    """What a run of a scene consists of.

    Attributes
    ----------
    scene : str
        The scene in one line.
    n : int
        Number of particles.
    models : dict of str to str
        The compiled model of each kind, by the name of its type.
    absent : tuple of str
        Features that this scene does not use, and that therefore cost no array, no branch and no byte.
    arrays : tuple of Array
        All arrays, the largest first.
    neighbors : str
        The neighbor scheme and why it was chosen.
    """

    scene: str
    n: int
    models: dict[str, str]
    absent: tuple[str, ...]
    arrays: tuple[Array, ...]
    neighbors: str

    @property
    def bytes_per_particle(self) -> float:
        """Memory of all arrays, divided by the number of particles [bytes]."""
        return sum(array.nbytes for array in self.arrays) / self.n

    def __str__(self) -> str:
        lines = [self.scene, "", "Compiled in"]
        lines += [f"  {kind:<12} {model}" for kind, model in self.models.items()]
        lines += [
            "",
            "Not there",
            "  " + ", ".join(self.absent) if self.absent else "  (nothing is left out)",
        ]
        lines += ["", "Neighbors", f"  {self.neighbors}"]
        lines += ["", f"Arrays: {self.bytes_per_particle:.4g} bytes a particle"]
        lines += [
            f"  {array.nbytes / self.n:10.4g}  {array.name:<26} {array.shape} {array.dtype}"
            for array in self.arrays
        ]
        return "\n".join(lines)


def explain(
    scene: Scene | Simulation,
    *,
    growth: float | ArrayLike | None = None,
    swaps: Swaps | None = None,
    barostat: Barostat | None = None,
    tuning: Tuning = DEFAULT,
    event_log: bool = False,
) -> Explanation:
    """Report what a simulation of a scene compiles, its arrays, and its neighbor scheme.

    Nothing is compiled and nothing moves.

    Parameters
    ----------
    scene : Scene or Simulation
        A simulation is described in its present state, and takes no other argument.
    growth, swaps, barostat, tuning
        As in :class:`carom.Simulation`.
    event_log : bool
        Whether collisions go to an event log. Its buffer, of one size for all scenes, is not among the
        arrays.

    Returns
    -------
    Explanation
        ``print`` shows it as a page.

    Raises
    ------
    InputError
        If such a simulation is not possible.

    Examples
    --------
    >>> import carom
    >>> found = explain(carom.Scene.crystal(2048, 0.3), tuning=carom.Tuning(images=False))
    >>> found.models["pair"]
    'EqualCores'
    >>> "masses of their own" in found.absent
    True
    """
    if not isinstance(scene, Scene):
        state = scene._state
        parts = scene.scene, state.system, state.scheme, state.engine, state.requested
        swaps = None if state.sweeps is None else state.sweeps.swaps
        barostat = None if state.volume_moves is None else state.volume_moves.barostat
        return _explanation(*parts, state.log is not None, swaps, barostat)
    from carom.engine.build import build
    from carom.engine.neighbors.plan import choose

    at_rest = np.zeros_like(scene.positions)
    velocities = at_rest if scene.velocities is None else scene.velocities
    system = prepare(scene, velocities, growth=growth, tuning=tuning)
    checked_swaps(swaps, scene, system, event_log or None)
    checked_barostat(barostat, scene, system, scene.velocities, swaps=swaps, event_log=event_log)
    if event_log:
        refuse_oscillation(scene, "An event log", "leave one of the two out")
    try:
        chosen = choose(system, 1.0, *tuning.requested)
    except ValueError as error:
        raise InputError(str(error)) from None
    engine = build(chosen, system, scene.positions, at_rest)
    return _explanation(scene, system, chosen, engine, tuning.requested, event_log, swaps, barostat)


def _explanation(
    scene: Scene,
    system: System,
    chosen: NeighborPlan,
    engine: Engine,
    requested: Requested,
    logged: bool,
    swaps: Swaps | None,
    barostat: Barostat | None,
) -> Explanation:
    from carom.engine.observers.own import name_of

    parts = engine.model._replace(observers=None)._asdict()
    models = {kind: type(part).__name__ for kind, part in parts.items() if part is not None}
    observers = _observers(engine)
    if observers:
        models["observers"] = ", ".join(map(name_of, observers))
    if swaps is not None:
        models["swaps"] = f"{swaps.attempts} tried a particle at every {swaps.interval:g}"
    if barostat is not None:
        models["barostat"] = f"pressure {barostat.pressure:g}, a move at every {barostat.interval:g}"
    models["neighbors"] = type(engine.neighbors).__name__
    missing = {
        "diameters of their own": system.radii is None,
        "masses of their own": system.radii is None,
        "a contact matrix": system.scene.contact is None,
        "species": system.scene.species is None,
        "growth": system.rates is None,
        "walls and obstacles": engine.model.obstacles is None,
        "restitution": engine.model.impact is None,
        "steps of pairs": not system.stepped,
        "image counts": engine.state.images is None,
        "an event log": not logged,
        "currents": not system.currents,
        "swaps": swaps is None,
        "a barostat": barostat is None,
    }
    return Explanation(
        scene=repr(scene),
        n=scene.n,
        models=models,
        absent=tuple(name for name, absent in missing.items() if absent),
        arrays=_arrays(engine),
        neighbors=_reason(system, chosen, requested),
    )


def _observers(engine: Engine) -> list[Any]:
    """Return what observes but the event log, whose buffer has one size for all scenes."""
    from carom.engine.observers.event_log import Log
    from carom.engine.observers.interface import listed

    return [each for each in listed(engine.model.observers) if not isinstance(each, Log)]


def _arrays(engine: Engine) -> tuple[Array, ...]:
    """Return every array once, the largest first."""
    from carom.engine.observers.own import name_of

    found: dict[int, Array] = {}

    def add_arrays(name: str, value: Any) -> None:
        if isinstance(value, np.ndarray):
            fields = value.dtype.names
            kind = f"({', '.join(fields)}), {value.dtype.itemsize} bytes" if fields else str(value.dtype)
            # The neighbor scheme and the boundary may hold the same array.
            found.setdefault(
                value.__array_interface__["data"][0], Array(name, value.shape, kind, value.nbytes)
            )
        elif isinstance(value, tuple) and hasattr(value, "_fields"):
            for field, part in zip(value._fields, value, strict=True):
                add_arrays(f"{name}.{field}" if name else field, part)
        elif isinstance(value, tuple):
            for index, part in enumerate(value):
                add_arrays(f"{name}[{index}]", part)

    for part in ("state", "neighbors", "calendar", "tallies"):
        add_arrays(part, getattr(engine, part))
    add_arrays("model", engine.model._replace(observers=None))
    for each in _observers(engine):
        add_arrays(f"observers.{name_of(each)}", each)
    return tuple(sorted(found.values(), key=lambda array: -array.nbytes))


def _reason(system: System, chosen: NeighborPlan, requested: Requested) -> str:
    """Say which neighbor scheme there is, and why."""
    from carom.engine.neighbors.plan import dilute

    cells = " x ".join(map(str, chosen.shape))
    fraction, dimension = system.packing_fraction, system.dimension
    limit = dilute(dimension)
    mean_contact = (system.narrowest + 2.0 * system.diameter) / 4.0
    if chosen.kind == "lists":
        what = (
            f"lists with a reach of {chosen.list_range / system.diameter:.3g} diameters, from {cells} cells"
        )
    elif chosen.kind == "all":
        what = "everybody, along paths through the images of the box"
    elif chosen.kind == "pairs":
        return "all pairs, one by one: they do not fly straight relative to each other."
    else:
        what = f"{cells} sectors"
    if system.stepped:
        list_range = f"{chosen.list_range / system.diameter:.3g} times that of the steps"
        what = f"lists with a reach of {chosen.list_range:.3g}, {list_range}, from {cells} cells"
        why = "they hold on which step each pair is"
    elif requested[0] != "auto":
        why = "asked for"
    elif chosen.kind == "all":
        why = "flights are so long, or sectors around one so many, that this costs less than any sectors"
    elif requested[1] is not None and chosen.kind == "lists":
        why = "a shell was asked for"
    elif chosen.kind == "lists" and fraction > limit:
        why = f"faster above a packing fraction of {limit:g} in d = {dimension}, and this is {fraction:.3g}"
    elif chosen.kind == "lists":
        why = "the largest components are larger than a sector should be"
    elif fraction > limit:
        why = (
            "the box is too small for lists, which could reach no further than "
            f"{mean_contact / system.diameter:.3g} diameters without confusing images"
        )
    else:
        why = f"faster below a packing fraction of {limit:g} in d = {dimension}, and this is {fraction:.3g}"
    if chosen.kind == "sectors" and any(
        size < 4 and wraps for size, wraps in zip(chosen.shape, system.periodic, strict=True)
    ):
        why += "; fewer than four along an edge, so that images are told apart by their sectors"
    return f"{what}: {why}."
