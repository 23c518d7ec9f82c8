"""How deep components overlap, from their distances: a collision that was lost leaves no other trace.

The engine looks at two cores only where they collide. Here the distances of all are looked at, of some states
at which runs ended (samples among them), and of the present one; and only when somebody asks.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carom.errors import InputError
from carom.frame import Frame
from carom.geometry import overlaps
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import Geometry, Overlap
from carom.models import model_checks
from carom.scene.fields import standing
from carom.simulation.model_validation.obstacles import known_to_move
from carom.simulation.model_validation.probes import by_kind, kinds_of
from carom.simulation.system_of_scene import prepare

if TYPE_CHECKING:
    from carom.engine.system import System
    from carom.scene.scene import Scene

MOST = 64
"""States that are kept; from then on every second, every fourth ... end of a run is kept."""

BYTES = 2**25
"""Bytes that they may take; one is kept in any case."""


class State(NamedTuple):
    """A state at which a run ended."""

    instant: Fraction  # time since the start [time]
    positions: np.ndarray  # centers in the box, (n, d) [length]
    box: tuple[float, ...]  # edges, which a barostat changes [length]
    diameters: np.ndarray  # (n,) [length]
    tilt: float  # tilt of the lattice (``carom.models.Shear``)
    epsilon: float  # spacing of the numbers of the positions at 1


class Depths:
    """States of a run that nobody has looked at yet."""

    def __init__(self) -> None:
        self._kept: list[State] = []
        self._ended, self._stride = 0, 1
        self._seen: tuple[Fraction, int] | None = None
        self._deepest = 0.0

    def keep(self, run_state: Any) -> None:
        """Keep the present state, or not if there are many: called where a run ends."""
        self._ended += 1
        if self._ended % self._stride:
            return
        size = 8 * run_state.scene.n * run_state.scene.dimension
        if len(self._kept) >= max(1, min(MOST, BYTES // size)):
            self._kept = self._kept[1::2]
            self._stride *= 2
        self._kept.append(present(run_state))

    def look(self, run_state: Any) -> float:
        """Return the deepest overlap [diameters] now and in states looked at, or kept until now, or 0."""
        now = run_state.clock.instant, run_state.collisions
        states, self._kept = self._kept, []
        if _forgets(run_state):
            states = []
        if now != self._seen and (not states or states[-1].instant != now[0]):
            states.append(present(run_state))
        self._seen = now
        found = (deepest(run_state, state) for state in states)
        self._deepest = max([self._deepest, *(each.relative for each in found if each is not None)])
        return self._deepest


def present(run_state: Any) -> State:
    """Return the present state."""
    system, now = run_state.system, run_state.in_epoch()
    instant, box, diameters = run_state.clock.instant, run_state.scene.box, run_state.diameters
    epsilon = float(np.finfo(np.float32 if system.single else np.float64).eps)
    if system.straight:  # without the compiled code that makes frames, which may not be needed else
        rows = run_state.engine.state.rows[: system.n]
        x, v, t = (np.asarray(rows[name], np.float64) for name in ("x", "v", "t"))
        positions = x + v * (now - t)[:, None]
        return State(instant, positions, box, diameters, 0.0, epsilon)
    frame = run_state.frame()
    return State(instant, frame.positions, box, diameters, frame.tilt or 0.0, epsilon)


def in_frames(scene: Scene, frames: Iterable[Frame]) -> Iterator[tuple[float, Overlap | None]]:
    """Yield the time of each frame of a scene, and its deepest overlap beyond rounding.

    Positions that all fit single precision are taken for rounded to it, as files of other programs have them.
    """
    velocities = np.zeros_like(scene.positions) if scene.velocities is None else scene.velocities
    system = prepare(scene, velocities)
    pair, interaction = system.interaction.model(system.particles), system.interaction
    unknown = system.stepped and not hasattr(interaction, "cores_of")
    if unknown or (model_checks.is_own(interaction) and model_checks.answers("record_impulse", pair)):
        raise InputError(
            f"Frames do not hold what pairs of {type(interaction).__name__} remember, on which their cores "
            "depend; leave out frames, or look at worst_overlap in the statistics of the simulation."
        )
    for frame in frames:
        if frame.positions.shape != scene.positions.shape:
            raise InputError(
                f"A frame has {frame.n} particles in {frame.dimension} dimensions, and the scene {scene.n} "
                f"in {scene.dimension}; give the frames of a run of this scene."
            )
        single = (frame.positions == frame.positions.astype(np.float32)).all()
        epsilon = float(np.finfo(np.float32 if single else np.float64).eps)
        box = tuple(map(float, frame.box))
        when, tilt = Fraction(frame.time), frame.tilt or 0.0
        state = State(when, frame.positions, box, frame.diameters, tilt, epsilon)
        yield frame.time, deepest_of(scene, system, pair, state, system.unit.to_kernel(frame.time, 1))


def _forgets(run_state: Any) -> bool:
    """Tell whether only the present state can be looked at: the model knows nothing of earlier ones."""
    pair = run_state.engine.model.pair
    if not model_checks.is_own(run_state.system.interaction):
        return False
    return run_state.system.stepped or any(
        model_checks.answers(question, pair) for question in ("shift_epoch", "record_impulse")
    )


def deepest(run_state: Any, state: State) -> Overlap | None:
    """Return the deepest overlap of a state beyond rounding: of two cores, or with a wall or an obstacle."""
    later = run_state.unit.to_kernel(float(state.instant - run_state.clock.instant), 1)
    now, steps = run_state.in_epoch() + later, None
    if run_state.system.stepped and not hasattr(run_state.system.interaction, "cores_of"):
        from carom.engine.pair_steps import read_steps

        steps = read_steps(run_state.engine.neighbors) if run_state.steps is None else run_state.steps
    pair = run_state.engine.model.pair
    return deepest_of(run_state.scene, run_state.system, pair, state, now, steps)


def deepest_of(
    scene: Scene, system: System, pair: Any, state: State, now: float, steps: Any = None
) -> Overlap | None:
    """Return the deepest overlap of a state beyond rounding, in contact distances or diameters.

    ``now`` is what models are told. ``steps`` has pairs (m, 2) within reach and their steps (m,), for a model
    that says of steps alone where cores are.
    """
    geometry = Geometry(np.asarray(state.box), np.asarray(scene.periodic), standing(scene), state.tilt)
    places, radii = geometry.wrapped(state.positions), 0.5 * state.diameters
    own = model_checks.is_own(system.interaction)
    if own and model_checks.answers("radius_of", pair):
        radii = np.array([float(pair.radius_of(i, now)) for i in range(scene.n)])
    if scene.pinned is not None:
        radii = np.where(scene.pinned, -np.inf, radii)
    models = zip(standing(scene), system.obstacle_models, strict=True)
    unknown = {id(value) for value, model in models if not known_to_move(value, model)}
    found = [overlaps.intruder(places, geometry, radii, state.instant, state.epsilon, unknown)]
    if system.stepped or own:
        pairs, cores = _cores(scene, system, pair, geometry, places, now, steps)
        if len(pairs):
            found.append(overlaps.worst(places, geometry, pairs, cores, state.epsilon))
    elif scene.n > 1:
        contacts = Contacts(state.diameters, scene.species, scene.contact)
        found.append(overlaps.deepest(places, geometry, contacts, scene.pinned, state.epsilon))
    there = [each for each in found if each is not None]
    return max(there, key=lambda each: each.relative, default=None)


def _cores(
    scene: Scene, system: System, pair: Any, geometry: Geometry, places: np.ndarray, now: float, steps: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Return near pairs (m, 2) of a model with steps or of one's own, and their cores (m,) [length]."""
    interaction: Any = system.interaction
    if system.stepped and not hasattr(interaction, "cores_of"):
        pairs, step_numbers = steps
        squares = [max(float(pair.step_core_square(step)), 0.0) for step in range(len(pair.energy))]
        return pairs, np.sqrt(squares)[step_numbers]
    if not system.stepped and not model_checks.answers("core_square", pair):
        return np.zeros((0, 2), np.int64), np.zeros(0)
    pairs = geometry.near(places, system.diameter)
    if system.stepped:
        return pairs, interaction.cores_of(pairs, scene.species, scene.diameter)
    kinds = kinds_of(pair, system)
    return pairs, np.sqrt(by_kind(kinds, pairs, lambda i, j: max(float(pair.core_square(i, j, now)), 0.0)))
