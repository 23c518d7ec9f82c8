"""How deep components overlap, from their distances: a collision that was lost leaves no other trace.

The engine looks at two cores only where they collide. Here the distances of all are looked at, of some states
at which runs ended (samples among them), and of the present one; and only when somebody asks.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from carom.models import model_checks
from carom.models.questions.interaction import core_square, radius, record_impulse
from carom.models.questions.memory import shift_epoch
from carom.models.questions.steps import step_core_square
from carom.scene import overlaps
from carom.scene.fields import standing
from carom.scene.overlaps import Room
from carom.scene.species import Contacts
from carom.simulation.obstacle_trials import gaps_of, known_to_move
from carom.simulation.own_models import by_kind, kinds_of
from carom.units import TimeUnit

MOST = 64
"""States that are kept; from then on every second, every fourth ... end of a run is kept."""

BYTES = 2**25
"""Bytes that they may take; one is kept in any case."""


class State(NamedTuple):
    """A state at which a run ended."""

    instant: Fraction
    """Time since the start [time]."""
    positions: np.ndarray
    """Centres in the box, (n, d) [length]."""
    box: tuple[float, ...]
    """Edges, which a barostat changes [length]."""
    diameters: np.ndarray
    """(n,) [length]."""
    now: float
    """The time in the epoch, as models are told it."""
    tilt: float = 0.0
    """Tilt of the lattice (``carom.models.Shear``)."""


class Depths:
    """States of a run that nobody has looked at yet."""

    def __init__(self) -> None:
        self._kept: list[State] = []
        self._ended, self._stride = 0, 1
        self._seen: tuple[Fraction, int] | None = None

    def keep(self, run_state: Any) -> None:
        """Keep the present state, or not if there are many: called where a run ends."""
        self._ended += 1
        if self._ended % self._stride:
            return
        size = 8 * run_state.scene.n * run_state.scene.dimension
        if len(self._kept) >= max(1, min(MOST, BYTES // size)):
            self._kept = self._kept[1::2]
            self._stride *= 2
        self._kept.append(_present(run_state))

    def look(self, run_state: Any) -> float:
        """Return the deepest overlap in the states kept and the present one, 0 within rounding [diameters].

        States that were looked at are not looked at again.
        """
        now = run_state.clock.instant, run_state.collisions
        states, self._kept = self._kept, []
        if _forgets(run_state):
            states = []
        if now != self._seen and (not states or states[-1].instant != now[0]):
            states.append(_present(run_state))
        self._seen = now
        return max((deepest(run_state, state) for state in states), default=0.0)


def _present(run_state: Any) -> State:
    system, now = run_state.system, run_state.in_epoch()
    if system.straight:  # without the compiled code that makes frames, which may not be needed else
        rows = run_state.engine.state.rows[: system.n]
        x, v, t = (np.asarray(rows[name], np.float64) for name in ("x", "v", "t"))
        positions = x + v * (now - t)[:, None]
        return State(run_state.clock.instant, positions, run_state.scene.box, run_state.diameters, now)
    frame = run_state.frame()
    present = run_state.clock.instant, frame.positions, run_state.scene.box, run_state.diameters, now
    return State(*present, frame.tilt or 0.0)


def _forgets(run_state: Any) -> bool:
    """Tell whether only the present state can be looked at: the model knows nothing of earlier ones."""
    pair = run_state.engine.model.pair
    if not model_checks.is_own(run_state.system.interaction):
        return False
    return run_state.system.stepped or any(
        model_checks.answers(question, pair) for question in (shift_epoch, record_impulse)
    )


def deepest(run_state: Any, state: State) -> float:
    """Return the deepest overlap of a state beyond rounding: of two cores, or with a wall or an obstacle."""
    scene, system = run_state.scene, run_state.system
    geometry = Room(np.asarray(state.box), np.asarray(scene.periodic), standing(scene), state.tilt)
    state = state._replace(positions=geometry.wrapped(state.positions))
    rounded = float(np.finfo(np.float32).eps) if system.single else float(np.finfo(np.float64).eps)
    slack = overlaps.FLIGHTS * overlaps.rounding(geometry.box, rounded)
    return max(_of_pairs(run_state, state, geometry, slack), _at_obstacles(run_state, state, geometry, slack))


def _of_pairs(run_state: Any, state: State, geometry: Room, slack: float) -> float:
    """Return the deepest overlap of two cores, in distances of contact."""
    scene, system, interaction = run_state.scene, run_state.system, run_state.system.interaction
    if scene.n < 2:
        return 0.0
    pair, cores = run_state.engine.model.pair, None
    if system.stepped and hasattr(interaction, "cores_of"):
        pairs = geometry.near(state.positions, system.diameter)
        cores = interaction.cores_of(pairs, scene.species, scene.diameter)
    elif system.stepped:
        pairs, cores = _cores_on_steps(run_state)
    elif model_checks.is_own(interaction):
        if not model_checks.answers(core_square, pair):
            return 0.0
        pairs = geometry.near(state.positions, system.diameter)
        now = run_state.in_epoch() + run_state.unit.to_kernel(
            float(state.instant - run_state.clock.instant), 1
        )
        kinds = kinds_of(pair, system)
        cores = np.sqrt(by_kind(kinds, pairs, lambda i, j: max(float(core_square(pair, i, j, now)), 0.0)))
    else:
        contacts = Contacts(state.diameters, scene.species, scene.contact)
        found = overlaps.deepest(state.positions, geometry, contacts, scene.pinned)
        return 0.0 if found is None or found.depth <= slack else found.depth / found.contact
    if not len(pairs):
        return 0.0
    depths = cores - geometry.distances(state.positions, pairs)
    over = depths > overlaps.ENGINE_OVERLAP * cores + slack
    return float((depths[over] / cores[over]).max()) if over.any() else 0.0


def _cores_on_steps(run_state: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs (m, 2) within reach, and the core (m,) of the step that each is on, 0 without one."""
    from carom.engine.pair_steps import read_steps

    pair = run_state.engine.model.pair
    pairs, step_numbers = (
        read_steps(run_state.engine.neighbors) if run_state.steps is None else run_state.steps
    )
    squares = [max(float(step_core_square(pair, step)), 0.0) for step in range(len(pair.energy))]
    return pairs, np.sqrt(squares)[step_numbers]


def _at_obstacles(run_state: Any, state: State, geometry: Room, slack: float) -> float:
    """Return the deepest overlap with a wall or an obstacle, in diameters; at most 1, if one is behind it."""
    scene, pair = run_state.scene, run_state.engine.model.pair
    everything = geometry.everything()
    if not everything:
        return 0.0
    radii = 0.5 * state.diameters
    if model_checks.is_own(run_state.system.interaction) and model_checks.answers(radius, pair):
        radii = np.array([float(radius(pair, i, state.now)) for i in range(scene.n)])
    if scene.pinned is not None:
        radii = np.where(scene.pinned, 0.0, radii)
    worst = 0.0
    models = (*(None,) * (len(everything) - len(standing(scene))), *run_state.system.obstacle_models)
    for k, who in geometry.near_obstacles(state.positions, radii):
        value, size = everything[k], radii[who]
        if models[k] is not None and not known_to_move(value, models[k]):
            continue
        places = state.positions[who]
        gaps = gaps_of(value, places, size, state.instant, scene.box, scene.periodic, TimeUnit())
        over = (size > 0.0) & (-gaps > 2.0 * overlaps.ENGINE_OVERLAP * size + slack)
        if over.any():
            worst = max(worst, float((-gaps[over] / (2.0 * size[over])).max()))
    return min(worst, 1.0)


def folded(depth: float) -> float:
    """Return the square of contact over distance of an overlap: what the engine's tally holds."""
    return math.inf if depth >= 1.0 else 1.0 / (1.0 - depth) ** 2
