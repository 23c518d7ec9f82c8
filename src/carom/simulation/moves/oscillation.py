"""A shear that oscillates: stages of constant rate, between which velocities relative to the stream stay.

The homogeneous equations of motion (Evans and Morriss, Statistical Mechanics of Nonequilibrium Liquids, 2nd
ed. (2008), sec. 6.3) leave peculiar velocities as they are when the rate jumps. All is scheduled anew then.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

from carom.errors import InputError
from carom.models.motions.shear import STAGES, Shear
from carom.scene.scene import Scene


class Oscillation(NamedTuple):
    """The shear of a run, and how many stages are behind it."""

    shear: Shear
    done: int = 0

    @property
    def next(self) -> Fraction:
        """When the present stage ends [time]."""
        return (self.done + 1) * Fraction(self.shear.period or 0.0) / STAGES

    def contains(self, instant: Fraction) -> bool:
        """Tell whether an instant is in the present stage, or at one of its ends [time]."""
        return self._replace(done=self.done - 1).next <= instant <= self.next


def oscillation_of(scene: Scene, done: int = 0) -> Oscillation | None:
    """Return the stages of a scene whose shear oscillates, else None."""
    motion = scene.motion
    return Oscillation(motion, done) if isinstance(motion, Shear) and motion.period else None


def refuse_oscillation(scene: Scene, name: str, instead: str) -> None:
    """Raise InputError where ``name`` needs a shear that is constant."""
    if oscillation_of(scene):
        raise InputError(f"{name} needs a constant shear, and its rate oscillates: {instead}.")


def change_rate(run_state: Any) -> None:
    """Enter the stage that begins at the present time."""
    before: Oscillation = run_state.oscillation
    run_state.refit(move=(before.next, {"oscillation": before._replace(done=before.done + 1)}))
