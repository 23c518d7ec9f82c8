"""Obstacles that move, lose energy or have a memory: their contacts, and the sums over these.

Scenes without them have none of this. An obstacle is *live* where its value has ``live``.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np

from carom.compiling import registry
from carom.compiling.registry import answering, inner, optional
from carom.engine import obstacles
from carom.engine.obstacles import Chain, Crowd, Obstacles, normal_along
from carom.engine.rubbing import rub_obstacle
from carom.models.questions.interaction import growth, mass
from carom.models.questions.memory import ROOM, kept, remembers, shift_epoch
from carom.models.questions.obstacle import LIVE, at_time, recoil


@answering(obstacles)
class ObstacleWork(NamedTuple):
    """What live obstacles add up to."""

    work: Annotated[np.ndarray, kept(-2)]
    """Energy that each wall and obstacle gave to components, (numbers,) float64."""
    energy: Annotated[np.ndarray, ROOM]
    """That of the contact now, (1,) float64."""

    def reflect(self, model, state, i, number, now):
        obstacles = model.obstacles
        set_time(obstacles.chain, number, now)
        normal_along(obstacles.chain, obstacles, model.boundary, number)
        reflect_from(obstacles.chain, model, state, np.int64(i), number, now)
        me = state.rows[i]
        along = 0.0
        energy = 0.0
        for axis in range(len(model.boundary.edges)):
            change = obstacles.v[axis] - me.v[axis]
            along += obstacles.image[axis] * change
            energy += 0.5 * change * (obstacles.v[axis] + me.v[axis])
            me.v[axis] = obstacles.v[axis]
        weight = mass(model.pair, np.int64(i))
        self.energy[0] = weight * energy
        self.work[number] += weight * energy
        return weight * along


def is_live(model: Any) -> bool:
    """Return whether the model of an obstacle remembers something, or answers one of these questions."""
    return remembers(model) or any(registry.answers(question, type(model)) for question in LIVE)


def with_work(obstacles: Obstacles | None, models) -> Obstacles | None:
    """Return obstacles that are live, if one of their models is."""
    if obstacles is None or not any(map(is_live, models)):
        return obstacles
    return obstacles._replace(live=ObstacleWork(np.zeros(len(obstacles.hits)), np.zeros(1)))


def spared_by_number(chain: Any) -> dict[int, tuple[int, int]]:
    """Return, by obstacle, contacts that lost nothing, and those thrown faster than they came."""
    found: dict[int, tuple[int, int]] = {}
    while chain is not None:
        for k, model in enumerate(chain.head if isinstance(chain, Chain) else ()):
            if hasattr(model, "spared"):
                found[chain.number + k] = (int(model.spared[0]), int(model.spared[1]))
        chain = chain.tail
    return found


@inner
def age_obstacles(obstacles, duration):
    """Refer the times that obstacles remember to the start of the next epoch."""
    if obstacles is not None:
        age_live(obstacles.live, obstacles.chain, duration)


@inner
def age_live(live, chain, duration):
    """Do so, if there are live ones."""
    if live is not None:
        age_link(chain, duration)


@optional
def age_link(chain, duration):
    """Do so for a chain."""
    return


@age_link.register
def _(chain: Chain, duration):
    age_link(chain.tail, duration)
    for k in range(len(chain.head)):
        shift_epoch(chain.head[k], duration)


@age_link.register
def _(chain: Crowd, duration):
    age_link(chain.tail, duration)


@optional
def set_time(chain, number, now):
    """Tell the obstacle of that number the time, if it is in the chain."""
    return


@set_time.register
def _(chain: Chain, number, now):
    set_time(chain.tail, number, now)
    k = number - chain.number
    if 0 <= k < len(chain.head):
        at_time(chain.head[k], now)


@set_time.register
def _(chain: Crowd, number, now):
    set_time(chain.tail, number, now)


@optional
def reflect_from(chain, model, state, i, number, now):
    """Replace the room's velocity by that after the contact with an obstacle.

    It is elastic where the number is none of a chain of single obstacles: a wall of the box, one of a crowd.
    """
    there = model.obstacles
    recoil(
        None, model.motion, i, mass(model.pair, i), there.x, there.v, there.image, growth(model.pair, i), now
    )


@reflect_from.register
def _(chain: Chain, model, state, i, number, now):
    k = number - chain.number
    if 0 <= k < len(chain.head):
        there = model.obstacles
        rate = growth(model.pair, i)
        recoil(chain.head[k], model.motion, i, mass(model.pair, i), there.x, there.v, there.image, rate, now)
        rub_obstacle(chain.head[k], model.impact, model, state, i, now)
    else:
        reflect_from(chain.tail, model, state, i, number, now)


@reflect_from.register
def _(chain: Crowd, model, state, i, number, now):
    reflect_from(chain.tail, model, state, i, number, now)
