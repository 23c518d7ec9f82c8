"""Carom: event-driven molecular dynamics of hard particles in any dimension.

Only values and functions that several subpackages share are here; all else is in the subpackages.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from carom.version import __version__

if TYPE_CHECKING:
    from carom import (
        io as io,
        models as models,
        observables as observables,
        reference as reference,
        results as results,
        sizes as sizes,
        theory as theory,
    )
    from carom.block import Block as Block
    from carom.errors import (
        BusyError as BusyError,
        CaromError as CaromError,
        CaromWarning as CaromWarning,
        FileError as FileError,
        InputError as InputError,
        OverlapError as OverlapError,
    )
    from carom.frame import Frame as Frame
    from carom.io.trajectory import open as open
    from carom.observables.bond_order import BondOrder as BondOrder
    from carom.observables.density_profile import DensityProfile as DensityProfile
    from carom.observables.dynamics import Dynamics as Dynamics
    from carom.observables.energy import Energy as Energy
    from carom.observables.flights import FreeFlights as FreeFlights
    from carom.observables.pressure import Pressure as Pressure
    from carom.observables.pressure_profile import PressureProfile as PressureProfile
    from carom.observables.pressure_tensor import PressureTensor as PressureTensor
    from carom.observables.rdf import RDF as RDF
    from carom.observables.statistics import Estimate as Estimate
    from carom.observables.structure_factor import StructureFactor as StructureFactor
    from carom.observables.volume import Volume as Volume
    from carom.observables.wall_pressure import WallPressure as WallPressure
    from carom.pictures.live import Live as Live
    from carom.pictures.movie import movie as movie
    from carom.pictures.view import view as view
    from carom.scene.species import Species as Species
    from carom.simulation.callbacks import hit as hit
    from carom.simulation.files.csv_log import CSVLog as CSVLog
    from carom.simulation.model_validation.check import check as check
    from carom.simulation.moves.barostat import Barostat as Barostat
    from carom.simulation.moves.growth import Scene as Scene
    from carom.simulation.moves.swaps import Swaps as Swaps
    from carom.simulation.simulation import Simulation as Simulation, Statistics as Statistics
    from carom.simulation.tuning import Tuning as Tuning
    from carom.studies.at_path import load as load, resume as resume
    from carom.studies.eos.study import equation_of_state as equation_of_state
    from carom.studies.measuring import measure as measure
    from carom.studies.packings.pack import pack as pack
    from carom.studies.packings.study import packings as packings
    from carom.studies.planner.plan import plan as plan
    from carom.studies.runs.execution import run as run
    from carom.studies.shear.study import shear as shear
    from carom.studies.signals import Interrupted as Interrupted
    from carom.studies.spherical_codes.study import spherical_code as spherical_code
    from carom.studies.transport.study import transport as transport

# Name -> module; imported when first used, so that `import carom` and `carom --help` stay fast.
_LAZY = {
    name: home
    for home, names in {
        "carom.simulation.moves.growth": "Scene",
        "carom.scene.species": "Species",
        "carom.simulation.simulation": "Simulation Statistics",
        "carom.simulation.tuning": "Tuning",
        "carom.simulation.moves.swaps": "Swaps",
        "carom.simulation.moves.barostat": "Barostat",
        "carom.simulation.files.csv_log": "CSVLog",
        "carom.simulation.callbacks": "hit",
        "carom.frame": "Frame",
        "carom.block": "Block",
        "carom.observables.pressure": "Pressure",
        "carom.observables.pressure_profile": "PressureProfile",
        "carom.observables.pressure_tensor": "PressureTensor",
        "carom.observables.volume": "Volume",
        "carom.observables.wall_pressure": "WallPressure",
        "carom.observables.energy": "Energy",
        "carom.observables.rdf": "RDF",
        "carom.observables.structure_factor": "StructureFactor",
        "carom.observables.dynamics": "Dynamics",
        "carom.observables.bond_order": "BondOrder",
        "carom.observables.density_profile": "DensityProfile",
        "carom.observables.flights": "FreeFlights",
        "carom.observables.statistics": "Estimate",
        "carom.simulation.model_validation.check": "check",
        "carom.studies.runs.execution": "run",
        "carom.studies.packings.pack": "pack",
        "carom.studies.packings.study": "packings",
        "carom.studies.spherical_codes.study": "spherical_code",
        "carom.studies.eos.study": "equation_of_state",
        "carom.studies.transport.study": "transport",
        "carom.studies.shear.study": "shear",
        "carom.studies.planner.plan": "plan",
        "carom.studies.measuring": "measure",
        "carom.studies.at_path": "resume load",
        "carom.io.trajectory": "open",
        "carom.pictures.view": "view",
        "carom.pictures.movie": "movie",
        "carom.pictures.live": "Live",
        "carom.errors": "CaromError InputError BusyError OverlapError FileError CaromWarning",
        "carom.studies.signals": "Interrupted",
    }.items()
    for name in names.split()
}
_MODULES = {
    "io": "carom.io",
    "models": "carom.models",
    "observables": "carom.observables",
    "results": "carom.results",
    "reference": "carom.reference",
    "sizes": "carom.sizes",
    "theory": "carom.theory",
}

_MEANT = {
    "PotentialEnergy": "carom.Energy",
    "plots": "the method plot() of a result, or carom.pictures.plots",
    "rdf": 'carom.measure(frames, "rdf") or carom.RDF().over(frames)',
}

__all__ = [*_LAZY, *_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    if name in _MODULES:
        return importlib.import_module(_MODULES[name])
    from carom import models
    from carom.suggestions import nearest

    shelves = {each: f"models.{each}" for each in models.__all__} | {each: each for each in __all__}
    alike = nearest(name, shelves)
    hint = f"; take {_MEANT[name]}" if name in _MEANT else f"; did you mean {shelves[alike]}" if alike else ""
    raise AttributeError(f"module 'carom' has no attribute {name!r}{hint}")


def __dir__() -> list[str]:
    return sorted(__all__)
