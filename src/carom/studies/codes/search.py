"""The search over many seeds, and the polish of the best code."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.notebook import by_stage, watchable
from carom.studies import executors
from carom.studies.arguments import processes, refuse_unknown
from carom.studies.codes.climb import climb
from carom.studies.codes.code import MOST_DIGITS, SphericalCode
from carom.studies.codes.compression import compress
from carom.studies.codes.contacts import contact_graph, forces
from carom.studies.codes.hops import improve, largest_product
from carom.studies.codes.known import known
from carom.studies.codes.polish import Digits, Polished, equations, polish, refine
from carom.studies.codes.repulsion import repelled, starts_for
from carom.studies.signals import Interrupted, stoppable

MOST = 1000
"""Largest number of points: every cap is compared with all others."""

TRIES = 40
"""Default number of tries."""

HOPS = 20
"""Default number of hops of a try."""

RATES = (0.01, 0.2)
"""Default growth rates of the diameters over the thermal speed, for even and odd seeds. Slow growth orders,
and finds the best code of most sizes often. For some sizes it prefers another code: for 15 points on S^2 one
slow seed in 20 ends at the best known one, and one fast seed in six.
"""

SAME = 2.0**-44
"""Largest difference of two cosines of the same code in doubles, with a margin of some ten."""

ARGUMENTS = (
    "dimension", "seed", "tries", "rate", "hops", "starts", "digits", "executor", "cores", "progress",
)  # fmt: skip
"""Keywords of :func:`spherical_code`."""

Progress = Callable[[str, float], object]


@watchable("Searching", by_stage)
def spherical_code(
    n: int,
    dimension: int = 3,
    *,
    seed: int = 1,
    tries: int = TRIES,
    rate: float | None = None,
    hops: int = HOPS,
    starts: int | None = None,
    digits: int = 32,
    executor: Any = None,
    cores: int | str | None = None,
    progress: Progress | None = None,
    **others: Any,
) -> SphericalCode:
    """Search for n points on the unit sphere in d dimensions whose smallest angle is as large as possible.

    In every try, random points move on great circles and grow into caps until they jam (Smith; the paper's
    sec. 10). In addition, sets of points that repel each other lead to other codes, in a hundredth of the
    time. Hops improve the better of both. Newton's method then solves the equations of the contacts, for the
    best code in ``mpmath``.

    Parameters
    ----------
    n : int
        Number of points, 2 to 1000.
    dimension : int
        d of the space around the sphere, at least 2; 3 for the usual sphere.
    seed : int
        Seed of the first try; each further one adds 1.
    tries : int
        Number of random starts.
    rate : float, optional
        Growth rate of the diameters over the thermal speed. By default it is 0.01 for even seeds and 0.2 for
        odd ones: slow growth orders the points, and fast growth leads to more different codes.
    hops : int
        Number of hops in each try. A hop moves one to three points into holes and optimises again; a result
        that is not worse is kept.
    starts : int, optional
        Number of sets of points that repel each other, in every try. By default 50, and fewer for more than
        60 points. With 0 the caps only grow.
    digits : int
        Decimal digits of the result.
    executor, cores : optional
        Where the tries run, as for :func:`carom.equation_of_state`. The result is the same everywhere.
    progress : callable, optional
        Called as ``progress("Searching", fraction)``; True shows a bar.
    **others
        None: any other argument is an error that names the right one.

    Returns
    -------
    SphericalCode
        The best code. For d = 2 and for n <= 2 d it is the known optimum, without a search.

    Raises
    ------
    InputError
        If an argument is unknown or out of range, or none of the tries led to a code.
    Interrupted
        After Ctrl-C; its ``so_far`` is the best code until then.

    Examples
    --------
    >>> import carom
    >>> code = carom.spherical_code(6)
    >>> code.angle, len(code.contacts), code.note
    (90.0, 12, 'the cross-polytope, optimal (Rankin 1955)')
    """
    refuse_unknown("spherical_code()", others, ARGUMENTS)
    n = checks.integer(n, "n", low=2, high=MOST)
    k = checks.integer(dimension, "dimension", low=2, high=12)
    digits = checks.integer(digits, "digits", low=15, high=MOST_DIGITS)
    hops = checks.integer(hops, "hops", low=0)
    starts = starts_for(n) if starts is None else checks.integer(starts, "starts", low=0)
    if rate is not None:
        rate = checks.number(rate, "rate", low=0.0, high=1.0, open_low=True)
    first = checks.integer(seed, "seed", low=0)
    numbers = [first + j for j in range(checks.integer(tries, "tries", low=1))]
    workers = processes(cores)
    executors.check(executor, workers)
    exact = known(n, k, digits)
    if exact is not None:
        return _exact(*exact, digits)
    tasks = [
        {"n": n, "k": k, "seed": one, "rate": rate or RATES[one % 2], "hops": hops, "starts": starts}
        for one in numbers
    ]
    found: dict[int, dict[str, Any]] = {}
    failed: dict[int, str] = {}

    def report() -> None:
        if progress is not None:
            progress("Searching", (len(found) + len(failed)) / len(tasks))

    def done(task: dict[str, Any], record: dict[str, Any]) -> None:
        found[task["seed"]] = record
        report()

    def lost(task: dict[str, Any], reason: str) -> None:
        failed[task["seed"]] = reason
        report()

    with stoppable() as stop:
        report()
        stop.deferred = True
        asked = lambda: stop.asked  # noqa: E731
        with executors.opened(executor, workers, len(tasks)) as place:
            function = functools.partial(search, stop=asked) if place.local else search
            ended = executors.run(function, tasks, place, done=done, failed=lost, stop=asked)
            if not ended:
                place.end(True)
        stop.deferred = False
        if not ended:
            jammed = any(record["points"] is not None for record in found.values())
            raise Interrupted(
                f"Stopped after {len(found)} of {len(tasks)} tries.",
                _best(found, digits) if jammed else None,
            )
    if failed:
        which, why = min(failed.items())
        raise InputError(f"The search from seed {which} failed: {why}.")
    return _best({one: found[one] for one in numbers}, digits)


def search(task: dict[str, Any], stop: Callable[[], bool] = lambda: False) -> dict[str, Any]:
    """Return the code of one seed: points, contacts, forces and cosine; points are None if there is no code.

    Parameters and task are those of :func:`carom.studies.codes.compression.compress`. The task also holds the
    number of ``starts`` of points that repel each other, and of ``hops`` that follow.
    """
    n, k, seed, starts = (task[name] for name in ("n", "k", "seed", "starts"))
    points = np.array(compress(task, stop)["points"])
    if starts:
        other = climb(repelled(n, k, starts, np.random.default_rng([n, k, seed, 2]), stop))
        points = min(points, other, key=largest_product)
    rng = np.random.default_rng([n, k, seed, 1])
    try:
        code = polish(improve(points, task["hops"], rng, stop))
    except ValueError as problem:
        return {"points": None, "cosine": math.inf, "problem": str(problem)}
    return {
        "points": code.points.tolist(),
        "cosine": code.cosine,
        "contacts": code.contacts.tolist(),
        "forces": code.forces.tolist(),
    }


def _best(found: dict[int, dict[str, Any]], digits: int) -> SphericalCode:
    """Return the best code, polished to many digits."""
    least = min(record["cosine"] for record in found.values())
    if least == math.inf:
        seed, record = next(iter(found.items()))
        raise InputError(
            f"None of {len(found)} tries led to a code; of seed {seed}, {record['problem']}. Give more tries."
        )
    reached = [seed for seed, record in found.items() if record["cosine"] <= least + SAME]
    record = found[reached[0]]
    points = np.array(record["points"])
    code = Polished(points, record["cosine"], np.array(record["contacts"]), np.array(record["forces"]))
    try:
        coordinates, cosine, residual = refine(code, digits)
    except ValueError as problem:
        raise InputError(
            f"The best of {len(found)} codes, of seed {reached[0]}, has no {digits} digits: {problem} "
            "Give more tries."
        ) from None
    angles = {
        seed: math.degrees(math.acos(each["cosine"])) if each["points"] is not None else math.nan
        for seed, each in found.items()
    }
    return SphericalCode(
        np.array(coordinates, object),
        cosine,
        residual,
        digits,
        code.contacts,
        code.forces,
        code.rattlers,
        code.rigid,
        reached[0],
        angles,
        len(reached),
        "the best of a search",
    )


def _exact(coordinates: Digits, cosine: Any, note: str, digits: int) -> SphericalCode:
    """Return a code that is known exactly."""
    points = np.array(coordinates, object).astype(float)
    n = len(points)
    pairs = contact_graph(points) if n > 2 else np.array([[0, 1]])
    bear = forces(points, pairs)
    code = Polished(points, float(cosine), pairs[bear > 0.0], bear[bear > 0.0] / bear.sum())
    return SphericalCode(
        np.array(coordinates, object),
        cosine,
        max(map(abs, equations(coordinates, cosine, code.contacts, digits))),
        digits,
        code.contacts,
        code.forces,
        code.rattlers,
        code.rigid,
        None,
        {},
        0,
        note,
    )
