"""Whole studies: from a plan to a folder of results."""

from carom.studies.eos.result import EquationOfState
from carom.studies.eos.spec import StudySpec
from carom.studies.eos.study import equation_of_state
from carom.studies.runs import RunResult, resume, run
from carom.studies.signals import Interrupted

__all__ = [
    "EquationOfState",
    "Interrupted",
    "RunResult",
    "StudySpec",
    "equation_of_state",
    "resume",
    "run",
]
