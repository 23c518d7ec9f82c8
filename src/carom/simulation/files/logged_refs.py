"""The refs under which a run knew whom its components met, from what its log holds of them.

In a wide box that is the index. Of the two parts that are not logged, the step of a pair follows from the
steps at the start and all events since, and the image in a small box from the states.
"""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np

from carom.engine.advance import advance
from carom.engine.boundary import NearestImage
from carom.engine.neighbors.build import edges_of, images_in
from carom.engine.neighbors.interface import NeighborScheme
from carom.engine.neighbors.sectors import make_sectors
from carom.engine.pair_steps import SteppedImage, fresh_ref, make_steps, stepped_ref
from carom.engine.rules import recount_ref
from carom.engine.system import System
from carom.scene.fields import first_steps
from carom.scene.scene import Scene


class Listed(NeighborScheme):
    """Who has been on a step with whom: in a replay in place of the engine's lists."""

    refs: list[dict[int, int]]  # the ref under which each component knows another
    steps: Any  # how refs name steps

    def put_step(self, i, j, step):
        """Note that i and j are on another step."""
        self.refs[i][int(j)] = int(stepped_ref(self.steps, j, step))

    def recount_listed(self, rules, boundary, i, was):
        """Bring the counters of unit i, and of all that it knows, up to date."""
        for ref in [*self.refs[i].values()]:
            recount_ref(self, rules, boundary, i, ref, was)


class Refs:
    """Refs of the components of a logged run; ``pair``, the interaction, is told of the steps at the start.

    ``shape`` is sectors along each edge, ``bits`` those of a ref that named a sector: 0 in a wide box.
    ``boundary`` is how the engine reads refs; ``listed`` who is on which step, None without steps.
    """

    def __init__(self, system: System, scene: Scene, pair: Any, shape: np.ndarray, bits: int):
        edges, inverse = edges_of(system)
        self.listed: Listed | None = None
        self._shape, self._box = shape, np.array(edges)
        if system.stepped:
            starting_steps = first_steps(scene)
            self.listed = Listed(
                [{} for _ in range(scene.n)], make_steps(system.interaction, system.particles)
            )
            for (i, j), step in zip(*(each.tolist() for each in starting_steps), strict=True):
                self.listed.put_step(i, j, step)
                self.listed.put_step(j, i, step)
            pair.start_steps(*starting_steps)
            self.boundary: Any = SteppedImage(edges, inverse, self.listed.steps.bits)
        elif bits == 0:
            self.boundary = NearestImage(edges, inverse)
        else:  # all components in one sector: the next sectors are images of the box
            nothing = (0.0,) * scene.dimension
            sectors = make_sectors(scene.n, edges, (1,) * scene.dimension, 0, nothing)
            self.boundary = images_in(sectors, system)
            walled = sectors.digits[:, ~np.array(scene.periodic)]
            self._codes = np.flatnonzero((walled == 0).all(axis=1))

    def of(self, model: Any, state: Any, i: int, j: int, code: int, now: float) -> int:
        """Return the ref of j, which i meets at ``now`` in the epoch, by the logged ``code``."""
        if self.listed is not None:
            ref = self.listed.refs[i].get(j)
            return int(fresh_ref(self.listed.steps, i, j)) if ref is None else ref
        if type(self.boundary) is NearestImage:
            return j
        rows = [copy.deepcopy(state.rows[k]) for k in (i, j)]
        for k in range(2):
            advance(model, state._replace(rows=rows, images=None), NeighborScheme(), k, now)
        contact = math.sqrt(model.pair.core_square(i, j, now))
        return j << self.boundary.bits | self._image(np.array([row.x for row in rows]), code, contact)

    def _image(self, x: np.ndarray, code: int, contact: float) -> int:
        """Return the code of the image that is met by two at ``x`` (2, d), at the distance ``contact``.

        The logged code is a sector next to that of the first, by an account whose rounding at faces is not
        logged. So it is the image nearest to that distance; of several the one in that sector.
        """
        digits, codes = self.boundary.digits, self._codes
        images = x[1] - x[0] + self._box * digits[codes]
        misses = np.abs(np.sqrt((images * images).sum(axis=1)) - contact)
        # Positions are rounded in the last place of the box; images further apart than that are no tie.
        ties = codes[misses <= misses.min() + 2.0**-40 * float(self._box.max())]
        sectors = np.floor(x / self._box * self._shape)
        named = (sectors[0] + digits[code] - sectors[1]) / self._shape
        return int(ties[np.argmin(np.abs(digits[ties] - named).sum(axis=1))])
