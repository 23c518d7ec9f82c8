"""Whole studies: runs with a folder of results, packings, equations of state, transport, spherical codes.

Nothing here knows how a component moves; the simulation does.
"""

from carom.studies.codes.code import SphericalCode
from carom.studies.codes.search import CodeInterrupted, spherical_code
from carom.studies.coefficients.result import Transport
from carom.studies.coefficients.spec import TransportSpec
from carom.studies.coefficients.study import transport
from carom.studies.eos.result import EquationOfState
from carom.studies.eos.spec import StudySpec
from carom.studies.eos.study import equation_of_state
from carom.studies.packings.compression import PackingInterrupted, holds_packing, pack, points, resume_packing
from carom.studies.packings.packing import Packing
from carom.studies.planner.outcome import Outcome
from carom.studies.planner.plan import RunPlan, plan
from carom.studies.planner.target import Target
from carom.studies.runs.execution import RunResult, resume, run
from carom.studies.signals import Interrupted

__all__ = [
    "CodeInterrupted",
    "EquationOfState",
    "Interrupted",
    "Outcome",
    "Packing",
    "PackingInterrupted",
    "RunPlan",
    "RunResult",
    "SphericalCode",
    "StudySpec",
    "Target",
    "Transport",
    "TransportSpec",
    "equation_of_state",
    "holds_packing",
    "pack",
    "plan",
    "points",
    "resume",
    "resume_packing",
    "run",
    "spherical_code",
    "transport",
]
