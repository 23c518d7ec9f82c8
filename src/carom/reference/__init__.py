"""Slow and correct: the naive algorithm in any arithmetic, and the paper's figures with their amendments.

This is the oracle of the tests. Nothing here shares code with the engine, so that it cannot share its faults.
"""

from carom.reference.any_model import Step, follow
from carom.reference.billiard import Billiard, State
from carom.reference.figures import Cycle, Figure1, Figure2, InvariantError, Scheduled
from carom.reference.meeting import NoMeetingFound
from carom.reference.naive import Collision, NaiveSystem, collisions

__all__ = [
    "Billiard",
    "Collision",
    "Cycle",
    "Figure1",
    "Figure2",
    "InvariantError",
    "NaiveSystem",
    "NoMeetingFound",
    "Scheduled",
    "State",
    "Step",
    "collisions",
    "follow",
]
