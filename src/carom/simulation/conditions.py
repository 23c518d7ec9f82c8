"""The paper's conditions I to V for models of your own, tested on random pairs in any dimension."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.models import choice
from carom.models.interface import Particles, position, step_time
from carom.simulation.own_models import refuse_short
from carom.simulation.trials import SENTENCES, Failure, Trial
from carom.units import TimeUnit


@dataclass(frozen=True)
class Conditions:
    """What :func:`carom.check` found.

    Attributes
    ----------
    tried : dict of str to int
        Number of pairs on which each condition was tested.
    failures : tuple of Failure
        The first failure of each condition and dimension.
    """

    tried: dict[str, int]
    failures: tuple[Failure, ...]

    @property
    def passed(self) -> bool:
        """Whether all conditions held."""
        return not self.failures

    def __str__(self) -> str:
        failed = {failure.condition for failure in self.failures}
        lines = [
            f"{'FAILS' if name in failed else 'holds':<6}{name:<9}{SENTENCES[name]} ({count} pairs)"
            for name, count in self.tried.items()
        ]
        return "\n".join([*lines, *map(str, self.failures)])


def check(
    value: Any, *, dimensions: tuple[int, ...] = (1, 2, 3, 4), pairs: int = 200, seed: int = 0
) -> Conditions:
    """Test the paper's conditions I to V (Lubachevsky 1991, sec. 7) on a model, and further requirements.

    Nothing is compiled: the functions run as plain Python.

    Parameters
    ----------
    value : interaction, motion or impact
        As :class:`carom.Scene` takes it. It is tested with eight components of two species, with diameters
        from 0.6 to 1.4 and masses from 0.3 to 3.
    dimensions : tuple of int
        Dimensions to test. A motion with a value for each axis is tested up to its number of axes.
    pairs : int
        Number of pairs in each dimension.
    seed : int
        Seed of the random pairs.

    Returns
    -------
    Conditions
        ``print`` shows it as a table; ``passed`` says whether all conditions hold.

    Raises
    ------
    InputError
        If the value is neither an interaction, a motion nor an impact, a required question is not answered,
        or an array of the model is too short.

    Examples
    --------
    >>> from carom.models.hard_cores import HardCores
    >>> check(HardCores()).passed
    True
    """
    if not isinstance(dimensions, tuple | list):
        raise InputError(f"dimensions must be a tuple of integers, found {checks.describe(dimensions)}.")
    for each in dimensions:
        checks.integer(each, "dimensions", low=1)
    pairs = checks.integer(pairs, "pairs", low=1)
    kind = _kind(value)
    tried: dict[str, int] = {}
    failures: dict[tuple[str, int], Failure] = {}
    for d in dimensions:
        rng = np.random.default_rng([seed, d])
        some = _some(rng, d)
        model = choice.made(value, some) if choice.is_own(value) else value.model(some)
        if model is None or (kind == "motion" and not _has_axis(model, d - 1)):
            continue
        choice.answered(kind, model)
        if kind == "interaction" and choice.is_own(value):
            refuse_short(model, len(some.radii))
        straight = kind == "motion" and getattr(value, "straight", True)
        trial = Trial(model, d, tried, failures, straight=straight)
        for _ in range(pairs):
            with np.errstate(all="ignore"):
                getattr(trial, kind)(rng)
        if kind == "interaction" and choice.is_own(value) and not choice.answers(step_time, model):
            trial.reach(value, some)
    return Conditions(tried, tuple(failures.values()))


def _kind(value: Any) -> str:
    """Return which of the three a value is, by the questions that its model answers."""
    if isinstance(value, type) or not callable(getattr(value, "model", None)):
        raise InputError(
            "check() needs the value of an interaction, a motion or an impact, found "
            + (f"the class {value.__name__}." if isinstance(value, type) else _without_model(value))
        )
    if callable(getattr(value, "reach", None)):
        return "interaction"
    model = value.model(_some(np.random.default_rng(0), 2))
    for question in (*choice.REQUIRED["interaction"], *choice.STEPPED):
        if choice.answers(question, model):
            raise InputError(
                f"{type(value).__name__} is an interaction, as its model answers {question.__name__}, and "
                f"{choice.lacks(value, 'reach')}(scene): the largest distance at which two act on each other."
            )
    return "motion" if choice.answers_any("motion", model) else "impact"


def _without_model(value: Any) -> str:
    return f"{checks.describe(value)}, which {choice.lacks(value, 'model')}."


def _has_axis(motion: Any, axis: int) -> bool:
    """Tell whether a motion has a value for so many axes, where it has one for each."""
    try:
        position(motion, axis, 0.0, 0.0, 0.0)
    except IndexError:
        return False
    return True


def _some(rng: np.random.Generator, d: int) -> Particles:
    """Return eight different components of two species."""
    n = 8
    return Particles(
        box=(20.0,) * d,
        radii=rng.uniform(0.3, 0.7, n),
        masses=rng.uniform(0.3, 3.0, n),
        species=np.arange(n) % 2,
        rates=rng.uniform(0.0, 0.05, n),
        equal=False,
        unit=TimeUnit(),
    )
