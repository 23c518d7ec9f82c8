"""One try of a search for a spherical code, and the best code of several."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from carom.errors import InputError
from carom.studies.folder import Record
from carom.studies.job import Look
from carom.studies.spherical_codes.basin_hopping import improve, largest_product
from carom.studies.spherical_codes.code import SphericalCode
from carom.studies.spherical_codes.compression import Caps
from carom.studies.spherical_codes.contacts import contact_graph, forces
from carom.studies.spherical_codes.known import known
from carom.studies.spherical_codes.linear_programs import climb
from carom.studies.spherical_codes.newton import Polished, equations, polish, refine
from carom.studies.spherical_codes.repulsion import repelled

SAME = 2.0**-44
"""Largest difference of two cosines of the same code in doubles, with a margin of some ten."""


@dataclass
class Try(Caps):
    """The code of one seed: caps that jam, or points that repel each other, improved by hops.

    If there is none, points and cosine are None, and ``problem`` says why.
    """

    points: np.ndarray | None = None  # the best so far, once the caps have jammed
    other: np.ndarray | None = None  # the best of the points that repel each other
    least: float = math.inf  # its energy
    starts: int = 0  # of such points, so far
    hops: int = 0
    rng: dict[str, Any] | None = None  # state of the random numbers of starts, or of hops

    def step(self, look: Look) -> bool:
        """Go on for a stretch of growth, a start, or a hop."""
        n, k = self.task["n"], self.task["dimension"]
        if self.points is None:
            if not super().step(look):
                self.points, self.sim = self.jammed(), None
        elif self.starts < self.task["starts"]:
            with self._random(2) as rng:
                x, energy = repelled(n, k, rng)
            if energy < self.least:
                self.other, self.least = x, energy
            self.starts += 1
            if self.starts == self.task["starts"]:
                assert self.other is not None
                self.points, self.rng = min(self.points, climb(self.other), key=largest_product), None
        elif self.hops < self.task["hops"]:
            with self._random(1) as rng:
                self.points = improve(self.points, 1, rng)
            self.hops += 1
        else:
            return False
        return True

    @contextlib.contextmanager
    def _random(self, number: int) -> Iterator[np.random.Generator]:
        """Draw random numbers of a stream in the body of a ``with``."""
        rng = np.random.default_rng([*(self.task[name] for name in ("n", "dimension", "seed")), number])
        if self.rng is not None:
            rng.bit_generator.state = self.rng
        yield rng
        self.rng = dict(rng.bit_generator.state)

    def result(self) -> dict[str, Any]:
        """Return ``points``, ``cosine``, ``contacts`` and ``forces``."""
        assert self.points is not None
        try:
            code = polish(self.points)
        except ValueError as problem:
            return {"points": None, "cosine": None, "problem": str(problem)}
        return {
            "points": code.points.tolist(),
            "cosine": code.cosine,
            "contacts": code.contacts.tolist(),
            "forces": code.forces.tolist(),
        }


def first_to_agree(cosines: Sequence[float | None], count: int) -> int | None:
    """Return how many of the first tries hold ``count`` that led to the best code of them; None if none do.

    A cosine, of the smallest angle of a try, is None if it led to no code.
    """
    best: list[float] = []
    for k, cosine in enumerate(cosines, start=1):
        if cosine is not None:
            least = min([*best, cosine])
            best = [each for each in (*best, cosine) if each <= least + SAME]
            if len(best) >= count:
                return k
    return None


def angle_of(cosine: float | None) -> float:
    """Return an angle [degrees]; NaN for None."""
    return math.nan if cosine is None else math.degrees(math.acos(cosine))


def reached(records: Sequence[Record]) -> list[int]:
    """Return the seeds of the tries that led to the best code, in their order."""
    cosines = {record["task"]["seed"]: record["result"]["cosine"] for record in records}
    least = min((cosine for cosine in cosines.values() if cosine is not None), default=math.nan)
    return [seed for seed, cosine in cosines.items() if cosine is not None and cosine <= least + SAME]


def best_of(records: Sequence[Record], digits: int) -> SphericalCode | None:
    """Return the best code of some tries, polished to many digits; None if they led to no code."""
    found = {record["task"]["seed"]: record["result"] for record in records}
    seeds = reached(records)
    if not seeds:
        return None
    result = found[seeds[0]]
    points = np.array(result["points"])
    code = Polished(points, result["cosine"], np.array(result["contacts"]), np.array(result["forces"]))
    try:
        coordinates, cosine, residual = refine(code, digits)
    except ValueError as problem:
        raise InputError(
            f"The best of {len(found)} codes, of seed {seeds[0]}, has no {digits} digits: {problem} "
            "Give more tries."
        ) from None
    angles = {seed: angle_of(each["cosine"]) for seed, each in found.items()}
    searched = seeds[0], angles, len(seeds), "the best of a search"
    return _code(code, coordinates, cosine, residual, digits, *searched)


def _code(held: Polished, points: Any, cosine: Any, residual: Any, digits: int, *found: Any) -> SphericalCode:
    """Return a code with the contacts of a polished one; ``found`` are seed, angles, agreement, note."""
    contacts = held.contacts, held.forces, held.rattlers, held.rigid
    return SphericalCode(np.array(points, object), cosine, residual, digits, *contacts, *found)


def exact(n: int, dimension: int, digits: int) -> SphericalCode:
    """Return a code that is known without a search."""
    code = known(n, dimension, digits)
    if code is None:
        raise InputError(
            f"The best code of {n} points in {dimension} dimensions is not known; search for it."
        )
    coordinates, cosine, note = code
    points = np.array(coordinates, object).astype(float)
    pairs = contact_graph(points) if n > 2 else np.array([[0, 1]])
    bear = forces(points, pairs)
    held = Polished(points, float(cosine), pairs[bear > 0.0], bear[bear > 0.0] / bear.sum())
    residual = max(map(abs, equations(coordinates, cosine, held.contacts, digits)))
    return _code(held, coordinates, cosine, residual, digits, None, {}, 0, note)
