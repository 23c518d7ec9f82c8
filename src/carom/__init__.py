"""Carom: event-driven molecular dynamics of hard particles in any dimension.

Only values and functions that several subpackages share are here; all else is in the subpackages.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from carom import above
from carom.version import __version__

if TYPE_CHECKING:
    from carom import (
        io as io,
    )
    from carom import (
        models as models,
    )
    from carom import (
        observables as observables,
    )
    from carom import (
        reference as reference,
    )
    from carom import (
        results as results,
    )
    from carom import (
        sizes as sizes,
    )
    from carom import (
        theory as theory,
    )
    from carom.block import Block as Block
    from carom.errors import BusyError as BusyError
    from carom.errors import CaromError as CaromError
    from carom.errors import CaromWarning as CaromWarning
    from carom.errors import FileError as FileError
    from carom.errors import InputError as InputError
    from carom.errors import OverlapError as OverlapError
    from carom.frame import Frame as Frame
    from carom.io.trajectory import open as open
    from carom.observables.bond_order import BondOrder as BondOrder
    from carom.observables.density_profile import DensityProfile as DensityProfile
    from carom.observables.dynamics import Dynamics as Dynamics
    from carom.observables.energy import Energy as Energy
    from carom.observables.flights import FreeFlights as FreeFlights
    from carom.observables.pair_distribution import RDF as RDF
    from carom.observables.pressure import Pressure as Pressure
    from carom.observables.pressure_profile import PressureProfile as PressureProfile
    from carom.observables.pressure_tensor import PressureTensor as PressureTensor
    from carom.observables.statistics import Estimate as Estimate
    from carom.observables.structure_factor import StructureFactor as StructureFactor
    from carom.observables.volume import Volume as Volume
    from carom.observables.wall_pressure import WallPressure as WallPressure
    from carom.pictures.live import Live as Live
    from carom.pictures.movie import movie as movie
    from carom.pictures.view import view as view
    from carom.scene.scene import Scene as Scene
    from carom.scene.species import Species as Species
    from carom.simulation.barostat import Barostat as Barostat
    from carom.simulation.callbacks import hit as hit
    from carom.simulation.conditions import check as check
    from carom.simulation.csv_log import CSVLog as CSVLog
    from carom.simulation.simulation import Simulation as Simulation
    from carom.simulation.simulation import Statistics as Statistics
    from carom.simulation.swaps import Swaps as Swaps
    from carom.simulation.tuning import Tuning as Tuning
    from carom.studies.codes.study import spherical_code as spherical_code
    from carom.studies.coefficients.study import transport as transport
    from carom.studies.eos.study import equation_of_state as equation_of_state
    from carom.studies.flow.study import shear as shear
    from carom.studies.measuring import measure as measure
    from carom.studies.packings.pack import pack as pack
    from carom.studies.packings.study import packings as packings
    from carom.studies.planner.plan import plan as plan
    from carom.studies.runs.execution import run as run
    from carom.studies.saved import load as load
    from carom.studies.saved import resume as resume
    from carom.studies.signals import Interrupted as Interrupted

# Name -> module; imported when first used, so that `import carom` and `carom --help` stay fast.
_LAZY = {
    "Scene": "carom.scene.scene",
    "Species": "carom.scene.species",
    "Simulation": "carom.simulation.simulation",
    "Tuning": "carom.simulation.tuning",
    "Swaps": "carom.simulation.swaps",
    "Barostat": "carom.simulation.barostat",
    "CSVLog": "carom.simulation.csv_log",
    "hit": "carom.simulation.callbacks",
    "Statistics": "carom.simulation.simulation",
    "Frame": "carom.frame",
    "Block": "carom.block",
    "Pressure": "carom.observables.pressure",
    "PressureProfile": "carom.observables.pressure_profile",
    "PressureTensor": "carom.observables.pressure_tensor",
    "Volume": "carom.observables.volume",
    "WallPressure": "carom.observables.wall_pressure",
    "Energy": "carom.observables.energy",
    "RDF": "carom.observables.pair_distribution",
    "StructureFactor": "carom.observables.structure_factor",
    "Dynamics": "carom.observables.dynamics",
    "BondOrder": "carom.observables.bond_order",
    "DensityProfile": "carom.observables.density_profile",
    "FreeFlights": "carom.observables.flights",
    "Estimate": "carom.observables.statistics",
    "check": "carom.simulation.conditions",
    "run": "carom.studies.runs.execution",
    "pack": "carom.studies.packings.pack",
    "packings": "carom.studies.packings.study",
    "spherical_code": "carom.studies.codes.study",
    "equation_of_state": "carom.studies.eos.study",
    "transport": "carom.studies.coefficients.study",
    "shear": "carom.studies.flow.study",
    "plan": "carom.studies.planner.plan",
    "measure": "carom.studies.measuring",
    "resume": "carom.studies.saved",
    "load": "carom.studies.saved",
    "open": "carom.io.trajectory",
    "view": "carom.pictures.view",
    "movie": "carom.pictures.movie",
    "Live": "carom.pictures.live",
    "CaromError": "carom.errors",
    "InputError": "carom.errors",
    "BusyError": "carom.errors",
    "OverlapError": "carom.errors",
    "FileError": "carom.errors",
    "CaromWarning": "carom.errors",
    "Interrupted": "carom.studies.signals",
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


def _grown() -> Any:
    from carom.simulation.growth import grown

    return grown


def _viewed() -> Any:
    from carom.pictures.view import view

    return view


def _command() -> Any:
    from carom.cli.study import command

    return command


def _drawn() -> Any:
    from carom.pictures.results import draw

    return draw


def _name_results() -> Any:
    for name in ("carom.observables", "carom.studies.saved"):
        importlib.import_module(name)
    return lambda: None


def _opened() -> Any:
    from carom.io.trajectory import open_reader

    return open_reader


def _plotted() -> Any:
    from carom.pictures.plots import snapshot

    return snapshot


def _picture() -> Any:
    from carom.pictures.plots import picture

    return picture


# Functions that subpackages need from subpackages above them.
above.install("command", _command)
above.install("drawn", _drawn)
above.install("grown", _grown)
above.install("name_results", _name_results)
above.install("opened", _opened)
above.install("viewed", _viewed)
above.install("plotted", _plotted)
above.install("picture", _picture)

__all__ = [*_LAZY, *_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    if name in _MODULES:
        return importlib.import_module(_MODULES[name])
    meant = f"; take {_MEANT[name]}" if name in _MEANT else ""
    raise AttributeError(f"module 'carom' has no attribute {name!r}{meant}")


def __dir__() -> list[str]:
    return sorted(__all__)
