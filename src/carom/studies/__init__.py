"""Whole studies: runs with a folder of results, packings, equations of state, transport, flows, codes.

Nothing here knows how a particle moves; the simulation does. What users call is in ``carom``; here are the
classes of what it returns.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from carom.studies.eos.spec import StudySpec as StudySpec
    from carom.studies.eos.study import EquationOfState as EquationOfState
    from carom.studies.packings.packing import Packing as Packing
    from carom.studies.packings.spec import PackSpec as PackSpec
    from carom.studies.packings.study import Packings as Packings
    from carom.studies.planner.outcome import Outcome as Outcome
    from carom.studies.planner.plan import RunPlan as RunPlan
    from carom.studies.planner.target import Target as Target
    from carom.studies.runs.result import RunResult as RunResult
    from carom.studies.shear.spec import ShearSpec as ShearSpec
    from carom.studies.shear.study import ShearFlow as ShearFlow
    from carom.studies.spherical_codes.code import SphericalCode as SphericalCode
    from carom.studies.spherical_codes.spec import CodeSpec as CodeSpec
    from carom.studies.spherical_codes.study import Codes as Codes
    from carom.studies.trade.spec import TradeSpec as TradeSpec
    from carom.studies.trade.study import Trade as Trade
    from carom.studies.transport.spec import TransportSpec as TransportSpec
    from carom.studies.transport.study import Transport as Transport

_LAZY = {
    "RunResult": "carom.studies.runs.result",
    "Packing": "carom.studies.packings.packing",
    "Packings": "carom.studies.packings.study",
    "PackSpec": "carom.studies.packings.spec",
    "SphericalCode": "carom.studies.spherical_codes.code",
    "Codes": "carom.studies.spherical_codes.study",
    "CodeSpec": "carom.studies.spherical_codes.spec",
    "EquationOfState": "carom.studies.eos.study",
    "Transport": "carom.studies.transport.study",
    "ShearFlow": "carom.studies.shear.study",
    "RunPlan": "carom.studies.planner.plan",
    "Outcome": "carom.studies.planner.outcome",
    "Trade": "carom.studies.trade.study",
    "StudySpec": "carom.studies.eos.spec",
    "TransportSpec": "carom.studies.transport.spec",
    "ShearSpec": "carom.studies.shear.spec",
    "TradeSpec": "carom.studies.trade.spec",
    "Target": "carom.studies.planner.target",
}

__all__ = [*_LAZY]


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'carom.studies' has no attribute {name!r}")
