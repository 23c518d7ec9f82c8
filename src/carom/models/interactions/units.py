"""Units that decide by rules, as the engine compiles them (Lubachevsky (1991), sec. 11, after Wieland).

The step of a pair is how many radii of all circles of all kinds exceed its distance: with both kinds it says
who is inside whose circle. Crossings exchange no momentum: they change counters and call rules. A rule reads
and writes records in the scene's units; the velocity that it writes is that of the unit from then on.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np

from carom import checks
from carom.compiling.registry import Questions
from carom.models.interactions.step_pairs import end_of_step
from carom.models.interfaces.memory import MOMENT, ORIGIN, ROOM, UNIT, kept, parameter
from carom.models.interfaces.particles import NEVER, lanes
from carom.models.interfaces.steps import IN, OUT, SteppedModel
from carom.models.mathematics.counter_random import uniform

ENTERED, LEFT, TIMER, CHANGED = 1, 2, 3, 4
"""Why a rule is asked: somebody came into a circle, or went out of it; the time that the rule set has come;
somebody in a circle was removed, or is of another kind now.
"""

NO_AGENT = -1

SPEED, KIND, TIME, AIM = 1, 2, 3, 4  # what can be wrong with a rule's answer

COMPLAINTS = {
    SPEED: "a velocity that is no number below 1e152",
    KIND: "a kind that there is not",
    TIME: "a timer that is not later than now",
    AIM: "a target that is no unit",
}


def unit_type(dimension: int, kinds: int, circles: int, memory: int) -> np.dtype:
    """Return the type of what a rule is handed of its unit."""
    fields: list = [
        ("position", "f8", (dimension,)),
        ("velocity", "f8", (dimension,)),
        ("counts", "i8", (max(circles, 1), kinds)),
        ("memory", "f8", (max(memory, 1),)),
        ("timer", "f8"),
        ("kind", "i8"),
        ("target", "i8"),
        ("removed", "i8"),
        ("number", "i8"),
        ("seed", "i8"),
        ("drawn", "i8"),
    ]
    return np.dtype(fields, align=True)


def event_type(dimension: int) -> np.dtype:
    """Return the type of what a rule is told of the event."""
    fields: list = [
        ("toward", "f8", (dimension,)),
        ("velocity", "f8", (dimension,)),
        ("distance", "f8"),
        ("time", "f8"),
        ("cause", "i8"),
        ("circle", "i8"),
        ("other", "i8"),
        ("kind", "i8"),
    ]
    return np.dtype(fields, align=True)


@lanes("present")
class Units(SteppedModel):
    """What the engine compiles. Arrays of one row a unit have one more, for the padding row."""

    rule: Any  # a value whose type says which rule is asked
    inner: np.ndarray
    """Square of the distance at which each step ends inwards, negative where it does not [length^2]."""
    outer: np.ndarray  # square of the distance at which it ends outwards, or infinity [length^2]
    energy: Annotated[np.ndarray, parameter(-2)]  # of a pair on each step: zero
    events: Annotated[np.ndarray, kept()]
    """How many crossings there were from each step, of each kind, (steps, 4) int64."""
    radii: np.ndarray  # of the units at walls and obstacles [length]
    masses: np.ndarray
    watch: np.ndarray  # which circle of a kind ends the step inwards, or NO_AGENT, (kinds, steps) int64
    kinds: Annotated[np.ndarray, kept()]  # of each unit at present, int64
    present: Annotated[np.ndarray, kept()]  # 1, or 0 of units that are removed, int64
    counts: Annotated[np.ndarray, kept()]
    """How many units of each kind are in each circle of each unit, (n + 1, circles, kinds) int64."""
    memory: Annotated[np.ndarray, kept()]  # numbers of the rule's own, (n + 1, m) float64
    timers: Annotated[np.ndarray, MOMENT]  # when each unit is to be asked, in the epoch, or NEVER
    targets: Annotated[np.ndarray, kept()]  # whom each unit aims at, or NO_AGENT, int64
    drawn: Annotated[np.ndarray, kept()]  # random numbers that each has drawn, int64
    news: Annotated[np.ndarray, kept()]
    """Who has changed in a circle of each unit that has not been told yet, or NO_AGENT, int64."""
    queue: Annotated[np.ndarray, kept()]  # who is to be told, int64
    queued: Annotated[np.ndarray, kept()]  # how many these are, (1,) int64
    asked: Annotated[np.ndarray, kept()]  # how often the rule was asked, by cause, (5,) int64
    fault: Annotated[np.ndarray, kept()]
    """What was wrong with the rule's first wrong answer, and for whom, (2,) int64."""
    begun: Annotated[np.ndarray, kept()]  # whether the units of each circle have been counted, (1,) int64
    units: Annotated[Any, ROOM]  # what the rules of two units are handed, (2,) records
    told: Annotated[Any, ROOM]  # what they are told of the event, (2,) records
    origin: Annotated[np.ndarray, ORIGIN]
    """When the counting of epochs began, since the start of the run, (1,) float64."""
    speed: Annotated[float, UNIT]  # the engine's unit of speed in the scene's: a power of two
    seed: int

    def step_time(self, i, j, step, rr, rv, vv, now):
        t = end_of_step(self.inner[step], self.outer[step], rr, rv, vv)
        return t if self.present[i] * self.present[j] > 0 else NEVER

    def step_jump(self, i, j, step, rr, rv, now):
        inwards = rr - self.inner[step] <= self.outer[step] - rr
        change = 1 if inwards else -1
        crossed = step if inwards else step - 1
        _count(self, i, j, crossed, change)
        _count(self, j, i, crossed, change)
        return 0.0, 0.0, 0.0, step + change, IN if inwards else OUT

    def shift_epoch(self, duration):
        for i in range(len(self.timers)):
            self.timers[i] -= duration

    def start_steps(self, pairs, step_numbers):
        if self.begun[0]:
            return
        self.begun[0] = 1
        for (i, j), step in zip(pairs.tolist(), step_numbers.tolist(), strict=True):
            for crossed in range(step):
                _count(self, i, j, crossed, 1)
                _count(self, j, i, crossed, 1)

    def error_message(self):
        fault, i = self.fault.tolist()
        return f"The rule gave unit {i} {COMPLAINTS[fault]}." if fault else None


class Rule(Questions):
    """A rule, by its type."""

    def call_rule(self, unit, event):
        """Let the rule decide."""
        raise NotImplementedError


def draw(unit):
    """Return the next random number of the stream of a ``unit``, in (0, 1]."""
    number = uniform(unit.seed, unit.number, unit.drawn)
    unit.drawn += 1
    return number


def _count(pair, i, j, crossed, change):
    circle = pair.watch[pair.kinds[i], crossed]
    if circle >= 0:
        pair.counts[i, circle, pair.kinds[j]] += change


def recount(pair, i, j, step, was):
    """Bring the counters of i and j, who are on a step, up to date: i was of the kind ``was`` before.

    The counters of i have been set to zero. Unit j is to be told, if i is in a circle of it.
    """
    if pair.present[j] == 0:
        return
    found = False
    for crossed in range(step):
        circle = pair.watch[pair.kinds[j], crossed]
        if circle >= 0:
            pair.counts[j, circle, was] -= 1
            pair.counts[j, circle, pair.kinds[i]] += pair.present[i]
            found = True
        circle = pair.watch[pair.kinds[i], crossed]
        if circle >= 0:
            pair.counts[i, circle, pair.kinds[j]] += pair.present[i]
    if found:
        if pair.news[j] == NO_AGENT:
            pair.queue[pair.queued[0]] = j
            pair.queued[0] += 1
        pair.news[j] = i


def fill_agent(pair, slot, i, x, v, now):
    """Fill in what the rule of unit i is handed; its place ``x`` and velocity ``v`` are those of now."""
    unit = pair.units[slot]
    for axis in range(len(x)):
        unit.position[axis] = x[axis]
        unit.velocity[axis] = v[axis] * pair.speed
    for circle in range(pair.counts.shape[1]):
        for kind in range(pair.counts.shape[2]):
            unit.counts[circle, kind] = pair.counts[i, circle, kind]
    for k in range(pair.memory.shape[1]):
        unit.memory[k] = pair.memory[i, k]
    unit.timer = (pair.timers[i] - now) / pair.speed
    unit.kind = pair.kinds[i]
    unit.target = pair.targets[i]
    unit.removed = 0
    unit.number = i
    unit.seed = pair.seed
    unit.drawn = pair.drawn[i]


def fill_event(pair, slot, cause, circle, other, time):
    """Fill in what a rule is told of an event; the caller adds where the other is, and its velocity."""
    event = pair.told[slot]
    event.cause = cause
    event.circle = circle
    event.other = other
    event.kind = pair.kinds[other] if other >= 0 else NO_AGENT
    event.time = time / pair.speed
    event.distance = 0.0
    for axis in range(len(event.toward)):
        event.toward[axis] = 0.0
        event.velocity[axis] = 0.0


def place_other(pair, slot, axis, r, v):
    """Fill in a coordinate of the vector to the other, and of its velocity."""
    event = pair.told[slot]
    event.toward[axis] = r
    event.velocity[axis] = v * pair.speed
    event.distance = np.hypot(event.distance, r)


def apply(pair, slot, i, v, now):
    """Do what the rule of unit i decided; return its former kind if that has changed, else NOBODY."""
    unit = pair.units[slot]
    pair.asked[pair.told[slot].cause] += 1
    timer = pair.timers[i]
    fault = 0
    if unit.timer != (timer - now) / pair.speed:  # one that the rule left alone may be due at this very time
        timer = now + unit.timer * pair.speed
        if not timer > now:
            fault = TIME
    for axis in range(len(v)):
        if not abs(unit.velocity[axis]) < checks.FASTEST:
            fault = SPEED
    if not 0 <= unit.kind < len(pair.watch):
        fault = KIND
    if not NO_AGENT <= unit.target < len(pair.kinds) - 1:
        fault = AIM
    if fault != 0:
        if pair.fault[0] == 0:
            pair.fault[0] = fault
            pair.fault[1] = i
        return NO_AGENT
    was = pair.kinds[i]
    changed = unit.kind != was or unit.removed != 0
    for axis in range(len(v)):
        v[axis] = unit.velocity[axis] / pair.speed
    for k in range(pair.memory.shape[1]):
        pair.memory[i, k] = unit.memory[k]
    pair.timers[i] = timer
    pair.targets[i] = unit.target
    pair.drawn[i] = unit.drawn
    pair.kinds[i] = unit.kind
    if unit.removed != 0:
        pair.present[i] = 0
        pair.timers[i] = NEVER
        pair.news[i] = NO_AGENT
        for axis in range(len(v)):
            v[axis] = 0.0
    if changed:
        for circle in range(pair.counts.shape[1]):
            for kind in range(pair.counts.shape[2]):
                pair.counts[i, circle, kind] = 0
    return was if changed else NO_AGENT


def cause_of(pair, i, now):
    """Return why unit i is asked on its own, and about whom; what it waited for is over."""
    other = pair.news[i]
    if other != NO_AGENT:
        pair.news[i] = NO_AGENT
        return CHANGED, other
    pair.timers[i] = NEVER
    other = pair.targets[i]
    if other != NO_AGENT and pair.present[other] == 0:
        pair.targets[i] = NO_AGENT
        other = NO_AGENT
    return TIMER, other
