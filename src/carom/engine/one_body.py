"""Events of one component: a contact with an obstacle (the paper's Q_ik), the timer of a rule, of a drive.

Each *source*, a part of the model or None, says when it has an event for a component, and runs it. The
earliest is taken here and nowhere else; the partner is then its code (:mod:`carom.engine.constants`).
"""

from __future__ import annotations

from carom.compiling.registry import inner, optional
from carom.engine.constants import LAMBDA


@optional
def earlier_event(source, model, state, i, now, t, code):
    """Return time and code of a source's next event for i, if before ``t``; else ``t`` and ``code``."""
    return t, code


@optional
def run_event(source, model, state, neighbors, i, code, now):
    """Run the event of component i if the code is one of the source's; tell whether it is."""
    return False


@inner
def schedule_one_body(model, state, i, now, before):
    """Give i its next own event, if before ``before``; tell whether. Ties: the first source."""
    t, code = earlier_event(model.obstacles, model, state, i, now, before, LAMBDA)
    t, code = earlier_event(model.rules, model, state, i, now, t, code)
    t, code = earlier_event(model.timers, model, state, i, now, t, code)
    if t >= before:
        return False
    state.rows[i].event_time = t
    state.partner[i] = code
    return True


@inner
def run_one_body(model, state, neighbors, i, code, now):
    """Run the event of component i that the code names; False if it is an advancement."""
    if run_event(model.rules, model, state, neighbors, i, code, now):
        return True
    if run_event(model.timers, model, state, neighbors, i, code, now):
        return True
    return run_event(model.obstacles, model, state, neighbors, i, code, now)
