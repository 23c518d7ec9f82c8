"""Rough surfaces of obstacles, which turn particles (``carom.models.contacts.rough``)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from carom.models.obstacles.surfaces import Lossy, pass_on
from carom.models.questions.memory import copy_state, shift_epoch
from carom.models.questions.obstacle import recoil


class RoughSurface(NamedTuple):
    """A surface that exchanges momentum along itself, too."""

    body: Lossy
    """What it does along the normal."""
    tangential: float
    """beta."""
    friction: float
    """Largest ratio of the tangential to the normal impulse."""

    @property
    def spared(self) -> np.ndarray:
        """As of :class:`Lossy`."""
        return self.body.spared


pass_on(RoughSurface)


@shift_epoch.register
def _(obstacle: RoughSurface, duration):
    shift_epoch(obstacle.body, duration)


@copy_state.register
def _(obstacle: RoughSurface, before, instant, passed, slower):
    copy_state(obstacle.body, before.body, instant, passed, slower)


@recoil.register
def _(obstacle: RoughSurface, motion, i, mass, x, v, normal, growth, now):
    recoil(obstacle.body, motion, i, mass, x, v, normal, growth, now)
