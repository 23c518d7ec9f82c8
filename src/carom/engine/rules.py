"""Units that decide by rules: when a rule is called, and the consequences of its decision.

It is called when a pair crosses a circle, a timer runs out, or a unit in a circle has changed (these two with
the partner TIMER_EVENT). A queue tells units of such a change: each gets an event at the present time.
"""

from __future__ import annotations

from carom.engine.advance import advance
from carom.engine.constants import TIMER_EVENT
from carom.engine.pair_steps import step_of
from carom.models.interactions.units import (
    ENTERED,
    LEFT,
    NO_AGENT,
    apply,
    cause_of,
    fill_agent,
    fill_event,
    place_other,
    recount,
)
from carom.models.interfaces.steps import IN


def recount_ref(neighbors, rules, boundary, i, ref, was):
    """Do so for the one that a ref names."""
    j = boundary.index(ref)
    recount(rules, i, j, step_of(boundary, ref), was)
    if rules.present[i] == 0:  # who meets nobody is in no circle, wherever the others go
        neighbors.put_step(i, j, 0)
        neighbors.put_step(j, i, 0)


def _settle(rules, model, state, neighbors, slot, i, now):
    """Carry out the decision of unit i, and update counters and news if it has changed."""
    me = state.rows[i]
    dimension = len(model.boundary.edges)
    before = 0.0
    for axis in range(dimension):
        before += me.v[axis] * me.v[axis]
    was = apply(rules, slot, i, me.v, now)
    after = 0.0
    for axis in range(dimension):
        after += me.v[axis] * me.v[axis]
    model.observers.gain(0.5 * rules.mass_of(i) * (after - before), now)
    if was != NO_AGENT:
        neighbors.recount_listed(rules, model.boundary, i, was)


def on_crossing(rules, model, state, neighbors, i, j, ref, kind, now):
    """Call the rules of those whose circle a pair has crossed now; both decide on the state before."""
    if rules is None:
        return
    crossed = step_of(model.boundary, ref) - (kind != IN)
    mine = rules.watch[rules.kinds[i], crossed]
    yours = rules.watch[rules.kinds[j], crossed]
    if mine < 0 and yours < 0:
        return
    cause = ENTERED if kind == IN else LEFT
    clock = state.clock[0]
    time = rules.origin[0] + (clock.epoch * clock.length + now)
    me = state.rows[i]
    other = state.rows[j]
    fill_agent(rules, 0, i, me.x, me.v, now)
    fill_agent(rules, 1, j, other.x, other.v, now)
    fill_event(rules, 0, cause, mine, j, time)
    fill_event(rules, 1, cause, yours, i, time)
    for axis in range(len(model.boundary.edges)):
        r = model.boundary.separation(i, ref, axis, other.x[axis] - me.x[axis])
        place_other(rules, 0, axis, r, other.v[axis])
        place_other(rules, 1, axis, -r, me.v[axis])
    if mine >= 0:
        rules.rule.call_rule(rules.units[0], rules.told[0])
    if yours >= 0:
        rules.rule.call_rule(rules.units[1], rules.told[1])
    if mine >= 0:
        _settle(rules, model, state, neighbors, 0, i, now)
    if yours >= 0:
        _settle(rules, model, state, neighbors, 1, j, now)


def rule_event(rules, model, state, i, now, t, code):
    """Return time and code of the next call of unit i's rule, if before ``t``; else ``t`` and ``code``."""
    if rules is None:
        return t, code
    until = now if rules.news[i] != NO_AGENT else max(rules.timers[i], now)
    return (until, TIMER_EVENT) if until < t else (t, code)


def run_rule(rules, model, state, neighbors, i, code, now):
    """Call the rule of unit i alone, if the code names that; tell whether it does."""
    if rules is None:
        return False
    if code != TIMER_EVENT:
        return False
    advance(model, state, neighbors, i, now)
    on_timer(rules, model, state, neighbors, i, code, now)
    model.observers.record(state.clock[0], i, code, 0.0)
    return True


def on_timer(rules, model, state, neighbors, i, ref, now):
    """Ask unit i alone, which is at the time now."""
    cause, other = cause_of(rules, i, now)
    clock = state.clock[0]
    me = state.rows[i]
    fill_agent(rules, 0, i, me.x, me.v, now)
    time = rules.origin[0] + (clock.epoch * clock.length + now)
    fill_event(rules, 0, cause, NO_AGENT, other, time)
    if other != NO_AGENT:
        far = state.rows[other]
        for axis in range(len(model.boundary.edges)):
            x = model.motion.position(axis, far.x[axis], far.v[axis], now - far.t)
            r = model.boundary.separation(i, ref, axis, x - me.x[axis])
            place_other(rules, 0, axis, r, model.motion.velocity(axis, far.v[axis], now - far.t))
    rules.rule.call_rule(rules.units[0], rules.told[0])
    _settle(rules, model, state, neighbors, 0, i, now)
