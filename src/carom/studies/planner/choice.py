"""The size, the length and the replicas that reach a target for the least CPU."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from carom.errors import InputError

WORTH = 0.1
"""Part by which replicas on all cores may make a plan dearer, by equilibrating each."""

SHORT = 20.0
"""CPU seconds below which one run on one core is planned: starting workers would take as long."""

LEAST = 1.0
"""CPU seconds of a plan at least. A start of Python takes as long. The CPU time of much shorter runs
depends on what else the machine does: runs of 0.1 s took up to 1.8 times their median on a busy one."""

ROOM = 0.9
"""Part of the time for which an error is named that can be reached: the next pilot finds another rate."""

PART = 0.02
"""Part of a run that is equilibration at least: long waves, which a pilot is too short for, cost no more."""

CACHES, SLOWER = 10_000.0, 0.4
"""Beyond so many particles arrays leave the caches, and the rate falls as N to this power; a second pilot at
the chosen size measures it."""


@dataclass(frozen=True)
class Costs:
    """What a plan has to know of a size; errors are in the unit of the target.

    Attributes
    ----------
    n : int
    variance : float
        Squared error times pair collisions.
    bias : float
        What the correction to infinite size leaves.
    collisions_per_second : float
    setup_seconds, overhead_seconds : float
        CPU time of a run beside its collisions: to make the scene, and for the calls of its blocks.
    equilibration : float
        Collisions per particle, at least.
    shortest : float
        Collisions per particle without which there is no error bar.
    """

    n: int
    variance: float
    bias: float
    collisions_per_second: float
    setup_seconds: float
    overhead_seconds: float
    equilibration: float
    shortest: float


@dataclass(frozen=True)
class Design:
    """A run, or replicas of it, and what they are expected to reach.

    Attributes
    ----------
    n, replicas : int
    equilibration, collisions_per_particle : float
        Of each replica.
    statistical, bias, error : float
        Parts of the error, and both together.
    cpu_seconds : float
        Of all replicas.
    """

    n: int
    replicas: int
    equilibration: float
    collisions_per_particle: float
    statistical: float
    bias: float
    error: float
    cpu_seconds: float

    def seconds(self, cores: int) -> float:
        """Return the time on so many cores [s]."""
        return self.cpu_seconds * math.ceil(self.replicas / cores) / self.replicas


def design(costs: Costs, error: float, replicas: int = 1) -> Design | None:
    """Return the run of one size that reaches an error; None where the bias alone is larger."""
    if costs.bias >= error:
        return None
    collisions = costs.variance / (error**2 - costs.bias**2)
    per_particle = max(2.0 * collisions / costs.n / replicas, costs.shortest / replicas)
    # Few digits, so that a plan can be typed.
    per_particle = float(f"{per_particle:.4g}")
    equilibration = float(f"{max(costs.equilibration, PART * per_particle):.3g}")
    measured = 0.5 * costs.n * per_particle * replicas
    statistical = math.sqrt(costs.variance / measured)
    seconds = replicas * (costs.setup_seconds + costs.overhead_seconds)
    seconds += (0.5 * costs.n * equilibration * replicas + measured) / costs.collisions_per_second
    return Design(
        costs.n, replicas, equilibration, per_particle, statistical, costs.bias,
        math.hypot(statistical, costs.bias), seconds,
    )  # fmt: skip


def cheapest(candidates: Sequence[Costs], error: float) -> Design | None:
    """Return the design of least CPU over all sizes; None if every bias is too large."""
    designs = [found for each in candidates if (found := design(each, error)) is not None]
    return min(designs, key=lambda one: one.cpu_seconds, default=None)


def on_cores(costs: Costs, error: float, cores: int, limit: float) -> Design:
    """Return the design with replicas for the cores: as many as cost little, more if the time demands it.

    Parameters
    ----------
    costs : Costs
        Of the chosen size, whose bias is below the error.
    error : float
    cores : int
    limit : float
        Time that there is [s]; may be infinite.
    """
    one = design(costs, error)
    assert one is not None
    several = [found for k in range(2, cores + 1) if (found := design(costs, error, k)) is not None]
    best = one
    for each in several:
        cheap = one.cpu_seconds >= SHORT and each.cpu_seconds <= (1.0 + WORTH) * one.cpu_seconds
        if cheap or best.seconds(cores) > limit:
            best = min(best, each, key=lambda found: found.seconds(cores))
    return best


def filled(costs: Costs, limit: float) -> Costs:
    """Return costs with which no run is planned that takes less than :data:`LEAST`, if the limit allows it.

    A run of a tenth of that is made longer. Its error is then smaller than what was asked for.
    """
    if limit < 2.0 * LEAST:
        return costs
    constant = costs.setup_seconds + costs.overhead_seconds
    constant += 0.5 * costs.n * costs.equilibration / costs.collisions_per_second
    per_particle = 2.0 * (LEAST - constant) * costs.collisions_per_second / costs.n
    return dataclasses.replace(costs, shortest=max(costs.shortest, per_particle))


def within(costs: Costs, cores: int, limit: float) -> float:
    """Return the smallest error that a size reaches in a time on all cores; infinite if there is none."""
    each = limit - costs.setup_seconds - costs.overhead_seconds
    each -= 0.5 * costs.n * costs.equilibration / costs.collisions_per_second
    collisions = each / (1.0 + PART) * costs.collisions_per_second * cores
    if collisions <= 0.5 * costs.n * costs.shortest:
        return math.inf
    return math.hypot(math.sqrt(costs.variance / collisions), costs.bias)


def slowed(collisions_per_second: float, here: int, there: int) -> float:
    """Return the collisions per second of ``there`` particles, guessed from those of ``here``."""
    before, after = (max(n / CACHES, 1.0) ** -SLOWER for n in (here, there))
    return collisions_per_second * after / before


def afford(
    candidates: Sequence[Costs], chosen: Costs, error: float, cores: int, limit: float, what: str,
    shown: Callable[[float], str],
) -> Design:  # fmt: skip
    """Return the design for the cores, if it fits into the time.

    Parameters
    ----------
    candidates : sequence of Costs
        Of all sizes.
    chosen : Costs
        Of the size that was chosen.
    error, cores, limit
        As for :func:`on_cores`.
    what : str
        The target, for sentences.
    shown : callable
        From an error to the text of a target that asks for it.

    Raises
    ------
    InputError
        If it does not, with what would.
    """
    found = on_cores(chosen, error, cores, limit)
    if found.seconds(cores) <= limit:
        return found
    each = 0.5 * chosen.n * chosen.equilibration / chosen.collisions_per_second
    if each > limit:
        raise InputError(
            f"Equilibration alone takes {duration(each)} ({chosen.n} particles, {chosen.equilibration:g} "
            f"collisions per particle); the limit is {duration(limit)}. Give more hours, or a lower density."
        )
    best = min((within(one, cores, ROOM * limit) for one in candidates), default=math.inf)
    reach = f"; in this time {shown(best)} can be reached" if math.isfinite(best) else ""
    raise InputError(
        f"{what} takes {duration(found.seconds(cores))} on {cores} {'core' if cores == 1 else 'cores'}, and "
        f"there are {duration(limit)}{reach}."
    )


def duration(seconds: float) -> str:
    """Return a time in words: 42 s, 3.5 min, 2.1 h, 12 days."""
    for unit, size, most in (("s", 1.0, 120.0), ("min", 60.0, 7200.0), ("h", 3600.0, 172800.0)):
        if seconds < most:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 86400.0:.3g} days"
