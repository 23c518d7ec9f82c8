"""The size, the length and the replicas that reach a target for little CPU time."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

from carom.errors import InputError
from carom.studies.held import AT_LEAST_ZERO, COUNT, POSITIVE
from carom.texts import counted

WORTH = 0.1
"""Largest relative increase of CPU time by replicas, each of which has to equilibrate."""

SHORT = 20.0
"""CPU seconds below which one run on one core is planned: the start of workers would take as long."""

LEAST = 1.0
"""Least CPU seconds of a plan: a start of Python takes as long. The CPU time of much shorter runs depends on
the load of the machine: on a busy one runs of 0.1 s took up to 1.8 times their median."""

CLOSE = 0.1
"""Largest relative difference of errors that is not worth more CPU time."""

ROOM = 0.9
"""Fraction of the time for which a reachable error is reported: the next pilot finds another rate."""

PART = 0.02
"""Least fraction of a run for equilibration. A pilot is too short for long waves; this covers them."""

CACHES, SLOWER = 10_000.0, 0.4
"""Number of particles beyond which arrays exceed the caches, and the power of N with which the rate falls
there. A second pilot at the chosen size measures the rate."""


@dataclass(frozen=True)
class Costs:
    """Costs of a run of one size; errors are in the unit of the target."""

    n: int
    variance: float  # squared error times pair collisions
    bias: float  # possible bias after the correction to infinite size
    collisions_per_second: float
    setup_seconds: float  # CPU time to make the scene
    equilibration: float  # least collisions per particle of equilibration
    shortest: float  # least collisions per particle that give an error bar


@dataclass(frozen=True)
class Design:
    """A run, or replicas of it, and what they are expected to reach."""

    n: Annotated[int, COUNT]
    replicas: Annotated[int, COUNT]
    equilibration: Annotated[float, AT_LEAST_ZERO]  # collisions per particle, for each replica
    collisions_per_particle: Annotated[float, POSITIVE]  # for each replica
    statistical: Annotated[float, AT_LEAST_ZERO]
    bias: Annotated[float, AT_LEAST_ZERO]
    error: Annotated[float, POSITIVE]  # the whole, of the two parts above
    cpu_seconds: Annotated[float, POSITIVE]  # of all replicas

    def seconds(self, cores: int) -> float:
        """Return the time on so many cores [s]."""
        return self.cpu_seconds * math.ceil(self.replicas / cores) / self.replicas


def design(costs: Costs, error: float, replicas: int = 1) -> Design | None:
    """Return the run of one size that reaches an error; None where the bias alone is larger."""
    if costs.bias >= error:
        return None
    collisions = costs.variance / (error**2 - costs.bias**2)
    per_particle = max(2.0 * collisions / costs.n / replicas, costs.shortest / replicas)
    # Rounded, so that a plan is easy to type.
    per_particle = float(f"{per_particle:.4g}")
    equilibration = float(f"{max(costs.equilibration, PART * per_particle):.3g}")
    measured = 0.5 * costs.n * per_particle * replicas
    statistical = math.sqrt(costs.variance / measured)
    seconds = replicas * costs.setup_seconds
    seconds += (0.5 * costs.n * equilibration * replicas + measured) / costs.collisions_per_second
    return Design(
        costs.n, replicas, equilibration, per_particle, statistical, costs.bias,
        math.hypot(statistical, costs.bias), seconds,
    )  # fmt: skip


def cheapest(candidates: Sequence[Costs], error: float) -> Design | None:
    """Return the design of least CPU time over all sizes; None if every bias is too large."""
    designs = [found for each in candidates if (found := design(each, error)) is not None]
    return min(designs, key=lambda one: one.cpu_seconds, default=None)


def chosen(candidates: Sequence[Costs], error: float, limit: float) -> Costs | None:
    """Return the cheapest size whose error, a second after the cheapest run, is within a tenth of the least.

    A second more of the cheapest run lowers its statistical error alone; the same second may pay for a size
    with much less bias. Of long runs it buys nothing: the cheapest size stays. None if every bias is too
    large; ``limit`` is the available time [s].
    """
    least = cheapest(candidates, error)
    if least is None:
        return None
    time = max(min(least.cpu_seconds + LEAST, limit), least.cpu_seconds)
    after = {one.n: within(one, 1, time) for one in candidates}
    after[least.n] = min(after[least.n], least.error)
    close = [one for one in candidates if after[one.n] <= (1.0 + CLOSE) * min(after.values())]
    costs = {one.n: found.cpu_seconds for one in close if (found := design(one, error)) is not None}
    return min(close, key=lambda one: (float(f"{costs.get(one.n, math.inf):.3g}"), after[one.n]))


def on_cores(costs: Costs, error: float, cores: int, limit: float) -> Design:
    """Return the design with replicas for the cores: as many as cost little, and more if time is short.

    The bias of the ``costs`` is below the error; ``limit`` is the available wall time [s], perhaps infinite.
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
    """Return costs whose plans take at least :data:`LEAST` of CPU time, if the limit allows it.

    A shorter run is lengthened. Its error is then smaller than requested.
    """
    if limit < 2.0 * LEAST:
        return costs
    constant = costs.setup_seconds + 0.5 * costs.n * costs.equilibration / costs.collisions_per_second
    per_particle = 2.0 * (LEAST - constant) * costs.collisions_per_second / costs.n
    return dataclasses.replace(costs, shortest=max(costs.shortest, per_particle))


def within(costs: Costs, cores: int, limit: float) -> float:
    """Return the smallest error of a size within the time limit on all cores; infinite if there is none."""
    each = limit - costs.setup_seconds - 0.5 * costs.n * costs.equilibration / costs.collisions_per_second
    collisions = each / (1.0 + PART) * costs.collisions_per_second * cores
    if collisions <= 0.5 * costs.n * costs.shortest:
        return math.inf
    return math.hypot(math.sqrt(costs.variance / collisions), costs.bias)


def slowed(collisions_per_second: float, here: int, there: int) -> float:
    """Return the collisions per second of ``there`` particles, estimated from those of ``here``."""
    before, after = (max(n / CACHES, 1.0) ** -SLOWER for n in (here, there))
    return collisions_per_second * after / before


def afford(
    candidates: Sequence[Costs], chosen: Costs, error: float, cores: int, limit: float, what: str,
    shown: Callable[[float], str],
) -> Design:  # fmt: skip
    """Return the design for the cores (:func:`on_cores`), if it fits into the time ``limit`` [s].

    If not, the error names the target ``what`` and, as ``shown`` has it, the error that a candidate can reach
    in this time.
    """
    found = on_cores(chosen, error, cores, limit)
    if found.seconds(cores) <= limit:
        return found
    each = 0.5 * chosen.n * chosen.equilibration / chosen.collisions_per_second
    if each > limit:
        raise InputError(
            f"Equilibration alone takes {duration(each)} ({chosen.n} particles, {chosen.equilibration:g} "
            f"collisions per particle); the limit is {duration(limit)}. Give more walltime, or a lower "
            "density."
        )
    best = min((within(one, cores, ROOM * limit) for one in candidates), default=math.inf)
    reach = f"; in this time {shown(best)} can be reached" if math.isfinite(best) else ""
    raise InputError(
        f"{what} takes {duration(found.seconds(cores))} on {counted(cores, 'core')}, and there "
        f"are {duration(limit)}{reach}."
    )


def duration(seconds: float) -> str:
    """Return a time in words: 42 s, 3.5 min, 2.1 h, 12 days."""
    for unit, size, most in (("s", 1.0, 120.0), ("min", 60.0, 7200.0), ("h", 3600.0, 172800.0)):
        if seconds < most:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 86400.0:.3g} days"
