"""What the engine asks of an interaction whose pairs have steps; it stores the step of every pair."""

from __future__ import annotations

from carom.models.interfaces.interaction import PairModel

CORE, IN, OUT, BOUNCE = 0, 1, 2, 3
"""Kinds of events: thrown back at the inner end of a step, across it, across the outer end, thrown back."""


def step_bits(count: int) -> int:
    """Return the number of bits that ``count`` steps need: at least 2, for the four kinds of events."""
    return max((count - 1).bit_length(), 2)


class SteppedModel(PairModel):
    """What an interaction whose pairs have steps answers."""

    def step_time(self, i, j, step, rr, rv, vv, now):
        """Time from now until particles i and j, which are on ``step``, reach one of its ends, or NEVER.

        The step is an index of the model's arrays, which have ``2**step_bits(count)`` items for ``count``
        steps. The other parameters, and the conditions for a vectorized loop, are those of
        ``interaction_time``.
        """
        raise NotImplementedError

    def step_jump(self, i, j, step, rr, rv, now):
        """Return what happens to a pair that reaches an end of its ``step``.

        Returns
        -------
        a, b, virial : float
            As from ``jump``.
        step : int
            The step that the pair is on from now on.
        kind : int
            CORE, IN, OUT or BOUNCE.
        """
        raise NotImplementedError

    def step_core_square(self, step):
        """Return the square of the inner end of ``step`` if it is a hard core, else 0 [length^2].

        The deepest overlap of a run is measured with it.
        """
        return 0.0

    def start_steps(self, pairs, step_numbers):
        """Record ``step_numbers`` (m,), on which the ``pairs`` (m, 2) within reach start; called from Python.

        The lists may be built several times before the first event. By default nothing is recorded.
        """
        return
