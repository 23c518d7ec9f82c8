"""Interactions of two components, tried event by event on the way that a motion takes them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from carom import checks
from carom.errors import CaromError, OverlapError
from carom.models import model_checks
from carom.models.interfaces.particles import NEVER
from carom.models.interfaces.steps import BOUNCE, CORE
from carom.simulation.model_validation import probes
from carom.simulation.model_validation.setting import (
    GRAZING,
    TOLERANCE,
    Record,
    Setting,
    direction,
    number_of,
    record_of,
    same,
    time_of,
)

EVENTS = 6  # events in a row of a pair on steps that are tried

LOOKS = 33  # times at which the way of two components is looked at

SPAN = 20.0
"""How far ahead meetings along curves are looked for, in the time of a displacement of the usual size."""


class Meeting(NamedTuple):
    """Two that meet."""

    i: int
    j: int
    step: int | None
    x: np.ndarray
    v: np.ndarray
    now: float
    r: np.ndarray  # from the one to the other [length]


class PairTrial:
    """The conditions of an interaction in one setting; two act on each other up to ``reach`` [length]."""

    def __init__(self, value: Any, pair: Any, setting: Setting, record: Record, contact_range: float):
        self._value, self._pair, self._setting, self._record = value, pair, setting, record
        self._reach = contact_range
        self._stepped = model_checks.answers("step_time", pair)
        self._span = SPAN * setting.size / setting.speed
        self._keeps_momentum = getattr(value, "keeps_momentum", True)
        conserves = getattr(value, "conserves", None)
        diameter = 2.0 * float(setting.particles.radii.max())
        self._keeps_energy = self._keeps_momentum and (conserves is None or bool(conserves(diameter)))

    def of(self, rng: np.random.Generator, i: int, j: int) -> int:
        """Try components i and j on a way from ``rng``, and return how many events they had."""
        setting = self._setting
        contact = self._contact(i, j)
        far, start = self._places(rng, contact)
        if start is None:
            return 0
        x, v = start
        r = x[1] - x[0]
        step = None
        if self._stepped:
            step = self._first_step(i, j, float(np.sqrt(r @ r)))
            if step is None:
                return 0
            v = v * self._speed_on_steps(rng, i, j)
        elif setting.curved and not np.sqrt(r @ r) > far:
            return 0
        now, events = 0.0, 0
        while events < (1 if step is None else EVENTS):
            after = self._event(rng, i, j, step, x, v, now)
            if after is None:
                break
            events += 1
            x, v, now, step = after
        return events

    def _contact(self, i: int, j: int) -> float:
        """Return about how near the two come, which is where their ways are to lead [length]."""
        if self._stepped:
            return self._reach
        core = math.sqrt(max(number_of("core_square", self._pair, i, j, 0.0), 0.0))
        if self._setting.curved:
            return core
        head_on = probes.contact_distance(self._pair, i, j, self._reach, self._setting.speed)
        return max(core, head_on) or self._reach

    def _places(
        self, rng: np.random.Generator, contact: float
    ) -> tuple[float, tuple[np.ndarray, np.ndarray] | None]:
        """Return a distance, and places and velocities (2, d) of two further apart than it, that approach."""
        setting, d = self._setting, self._setting.dimension
        nearest_ratio = 0.02 if self._stepped else 1.05
        r = contact * rng.uniform(nearest_ratio, 3.0) * direction(rng, d)
        aside = contact * rng.uniform(0.0, min(1.1, float(np.linalg.norm(r)) / contact))
        aim = r + aside * direction(rng, d)
        u = -aim / (np.linalg.norm(aim) or 1.0) * setting.speed * 10.0 ** rng.uniform(-1.0, 1.0)
        if self._stepped and rng.uniform() < 0.3:
            u = -u
        drift = rng.normal(size=d) * setting.speed
        if setting.free:
            return contact, (np.array([0.0 * r, r]), np.array([drift, drift + u]))
        x = 0.5 * setting.box + setting.size * rng.uniform(-1.0, 1.0, d)
        # To go nowhere is to be put where the motion has its components.
        x, v = setting.moved(np.array([x, x + r]), np.array([drift, drift + u]), 0.0)
        return contact, (x, v) if np.isfinite(x).all() else None

    def _first_step(self, i: int, j: int, distance: float) -> int | None:
        """Return the step on which two at a distance start, or None where they cannot be."""
        particles = self._setting.particles
        diameter = 2.0 * float(particles.radii.max())
        try:
            found = self._value.steps_of(
                np.array([[min(i, j), max(i, j)]]), np.array([distance]), particles.species, diameter
            )
        except CaromError as error:  # inside a core, or beyond a bond
            if hasattr(self._value, "step_of") and not isinstance(error, OverlapError):
                raise
            return None
        return int(found[0])

    def _speed_on_steps(self, rng: np.random.Generator, i: int, j: int) -> float:
        """Return a factor with which some speeds are of the order of those that the energies give."""
        energies = self._pair.energy[np.isfinite(self._pair.energy)]
        scale = float(np.abs(energies).max(initial=0.0))
        if scale == 0.0 or rng.uniform() < 0.5:
            return 1.0
        a, b = self._masses(i, j)
        return math.sqrt(2.0 * scale * (1.0 / a + 1.0 / b)) / self._setting.speed

    def _masses(self, i: int, j: int) -> tuple[float, float]:
        if self._setting.masses_known:
            a, b = self._setting.particles.masses[[i, j]].tolist()
            return a, b
        if model_checks.answers("mass_of", self._pair) or hasattr(self._pair, "masses"):
            return number_of("mass_of", self._pair, i), number_of("mass_of", self._pair, j)
        return 1.0, 1.0

    def _rate(self, i: int, j: int) -> float:
        return float(self._pair.growth_of(i) + self._pair.growth_of(j))

    def _time(self, i: int, j: int, step: int | None, x: np.ndarray, v: np.ndarray, now: float) -> float:
        """Return when two interact that are at places x with velocities v, (2, d), at the time now."""
        pair = self._pair
        if self._setting.curved:
            contact = math.sqrt(max(number_of("core_square", pair, i, j, now), 0.0))
            me, other = (record_of(*each) for each in zip(x, v, strict=True))
            rate = self._rate(i, j)
            return time_of(
                self._setting.motion.meeting_time, me, other, 0.0, contact, rate, self._span, self._span
            )
        r, u = x[1] - x[0], v[1] - v[0]
        scalars = (np.float64(r @ r), np.float64(r @ u), np.float64(u @ u), now)
        if step is None:
            return time_of("interaction_time", pair, i, j, *scalars)
        return time_of("step_time", pair, i, j, step, *scalars)

    def _jump(self, i: int, j: int, step: int | None, rr: float, rv: float, now: float) -> tuple[Any, ...]:
        rr, rv = np.float64(rr), np.float64(rv)
        if step is None:
            return checks.answer("jump", self._pair, i, j, rr, rv, now)
        found = checks.answer("step_jump", self._pair, i, j, step, rr, rv, now)
        return (*found[:3], step, CORE) if math.isnan(found[3]) else found

    def _note(self, condition: str, holds: Any, **numbers: Any) -> None:
        self._record.note(condition, self._setting.dimension, holds, **numbers)

    def _event(
        self,
        rng: np.random.Generator,
        i: int,
        j: int,
        step: int | None,
        x: np.ndarray,
        v: np.ndarray,
        now: float,
    ) -> tuple[np.ndarray, np.ndarray, float, int | None] | None:
        """Try the next event of two, and return places, velocities, time and step after it, or None."""
        setting = self._setting
        t = self._time(i, j, step, x, v, now)
        other = self._time(j, i, step, x[::-1], v[::-1], now)
        on_step = {} if step is None else {"step": step}
        facts: dict[str, Any] = {"i": i, "j": j, **on_step, "r": x[1] - x[0], "v": v[1] - v[0], "time": t}
        if setting.curved:
            facts = {"i": i, "j": j, "x": x, "v": v, "time": t}
        self._note("I", same(t, other), **facts, exchanged=other)
        chord = self._way(i, j, step, x, v, now, t, facts)
        if not t < NEVER:
            return None
        part = rng.uniform(0.0, 1.0) * t
        left = self._time(i, j, step, *setting.moved(x, v, part), now + part)
        u = v[1] - v[0]
        scale = setting.size / (setting.speed if setting.curved else math.sqrt(u @ u) or setting.speed)
        self._note("IV", abs(part + left - t) <= TOLERANCE * (t + scale), **facts, part=part, left=left)
        x, v = setting.moved(x, v, t)
        r, u, now = (x[1] - x[0] if chord is None else chord), v[1] - v[0], now + t
        rr, rv = float(r @ r), float(r @ u)
        if abs(rv - math.sqrt(rr) * self._rate(i, j)) < GRAZING * math.sqrt(rr * float(u @ u)):
            return None
        return self._thrown(Meeting(i, j, step, x, v, now, r), facts)

    def _thrown(
        self, met: Meeting, facts: dict[str, Any]
    ) -> tuple[np.ndarray, np.ndarray, float, int | None] | None:
        """Try what an event does, and return the state after it."""
        i, j, step, x, v, now, r = met
        rr, rv, rate = float(r @ r), float(r @ (v[1] - v[0])), self._rate(i, j)
        a, b, virial, *outcome = self._jump(i, j, step, rr, rv, now)
        mine, yours, its, *alike = self._jump(j, i, step, rr, rv, now)
        agree = same(a, yours) and same(b, mine) and same(virial, its) and outcome == alike
        self._note("II", agree, **facts, jump=(a, b, virial), exchanged=(mine, yours, its))
        ours, theirs = self._masses(i, j)
        if self._keeps_momentum:
            momentum_lost = ours * a - theirs * b
            self._note(
                "momentum",
                abs(momentum_lost) <= TOLERANCE * (abs(ours * a) + abs(theirs * b)),
                **facts,
                momentum_lost=momentum_lost,
            )
            contact = -theirs * b * rr
            self._note("virial", same(virial, contact), **facts, virial=virial, contact=contact)
        w = self._pushed(x, v, a, b, r, rr)
        reached = step
        if step is not None:
            known = self._pair.energy
            reached, kind = (int(each) for each in outcome)
            sound = CORE <= kind <= BOUNCE and 0 <= reached < len(known) and math.isfinite(known[reached])
            sound = sound and (reached == step) == (kind in (CORE, BOUNCE))
            self._note("step", sound, **facts, kind=kind, reached=reached)
            if not sound:
                return None
        self._energy(ours, theirs, v, w, step, reached, virial * rate / math.sqrt(rr), facts)
        next_time = self._time(i, j, reached, x, w, now)
        self._note("V", next_time > 0.0, **facts, velocity_after=w[1] - w[0], next_time=next_time)
        return (x, w, now, reached) if np.isfinite(w).all() else None

    def _way(
        self,
        i: int,
        j: int,
        step: int | None,
        x: np.ndarray,
        v: np.ndarray,
        now: float,
        t: float,
        facts: dict[str, Any],
    ) -> np.ndarray | None:
        """Try that two are not inside a core on their way, and return the chord at the end of a curve."""
        setting, pair = self._setting, self._pair

        def core_at(later: float) -> float:
            asked = ("core_square", pair, i, j, later) if step is None else ("step_core_square", pair, step)
            return math.sqrt(max(number_of(*asked), 0.0))

        start, u = x[1] - x[0], v[1] - v[0]
        core = core_at(now)
        if core == 0.0 or math.sqrt(start @ start) < core:
            return None
        passing = 4.0 * math.sqrt(start @ start) / (math.sqrt(u @ u) or setting.speed)
        until = t if t < NEVER else self._span if setting.curved else passing
        times = np.linspace(0.0, until, LOOKS)
        if setting.free and u @ u > 0.0:  # and where they are nearest
            times = np.append(times, min(max(-(start @ u) / (u @ u), 0.0), until))
        places = setting.course(x, v, times)
        distances = places[:, 1] - places[:, 0]
        cores = np.array([core_at(now + s) for s in times])
        slack = TOLERANCE * (core + setting.size)
        if not setting.curved:
            gaps = np.linalg.norm(distances, axis=1) - cores
            self._note("core", gaps.min() >= -slack, **facts, core=core, least_gap=gaps.min())
            return None
        if not t < NEVER:
            return None
        # A motion may, or may not, look at the images of a periodic box.
        edges = np.where(setting.periodic, setting.box, np.inf)
        images = distances - np.where(setting.periodic, setting.box, 0.0) * np.rint(distances / edges)
        for chords in (distances, images):
            gaps = np.linalg.norm(chords, axis=1) - cores
            touches = abs(gaps[-1]) <= slack and gaps.min() >= -slack
            if touches:
                break
        self._note("first", touches, **facts, least_gap=gaps.min(), last_gap=gaps[-1])
        return np.asarray(chords[-1])

    def _pushed(
        self, x: np.ndarray, v: np.ndarray, a: float, b: float, r: np.ndarray, rr: float
    ) -> np.ndarray:
        """Return the velocities (2, d) after a jump of two."""
        motion, axes = self._setting.motion, range(self._setting.dimension)
        mine = np.array([motion.push_direction(axis, x[0, axis], r[axis], rr) for axis in axes])
        its = np.array([motion.push_direction(axis, x[1, axis], -r[axis], rr) for axis in axes])
        return np.array([v[0] + a * mine, v[1] + b * its])

    def _energy(
        self,
        ours: float,
        theirs: float,
        v: np.ndarray,
        w: np.ndarray,
        step: int | None,
        reached: int | None,
        work: float,
        facts: dict[str, Any],
    ) -> None:
        """Try that no energy is made but by surfaces that grow, and that on steps none is lost either."""
        if not self._keeps_energy or (self._setting.curved and work != 0.0):
            return
        if self._setting.curved:
            kinetic = [0.5 * (ours * (u[0] @ u[0]) + theirs * (u[1] @ u[1])) for u in (v, w)]
        else:  # relative to each other: the rest is that of the total momentum
            reduced = ours * theirs / (ours + theirs)
            kinetic = [0.5 * reduced * float((u[1] - u[0]) @ (u[1] - u[0])) for u in (v, w)]
        before, after = (0.0 if k is None else float(self._pair.energy[k]) for k in (step, reached))
        made = kinetic[1] - kinetic[0] + after - before - work
        scale = sum(kinetic) + abs(before) + abs(after) + abs(work)
        # What is lost without steps is a contact that is not elastic.
        held = made <= TOLERANCE * scale and (step is None or made >= -TOLERANCE * scale)
        self._note("energy", held, **facts, made=made, kinetic_before=kinetic[0])
