"""Whole studies: from a plan to a folder of results."""

from carom.studies.runs import RunResult, resume, run
from carom.studies.signals import Interrupted

__all__ = ["Interrupted", "RunResult", "resume", "run"]
