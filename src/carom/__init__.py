"""Carom: event-driven molecular dynamics of hard particles in any dimension.

Only values and functions that several subpackages share are here; all else is in the subpackages.
"""

from __future__ import annotations

import importlib
from typing import Any

from carom import above
from carom.version import __version__

# Name -> module; imported when first used, so that `import carom` and `carom --help` stay fast.
_LAZY = {
    "Scene": "carom.scene.scene",
    "Species": "carom.scene.species",
    "Simulation": "carom.simulation.simulation",
    "Statistics": "carom.simulation.simulation",
    "Frame": "carom.frame",
    "Block": "carom.block",
    "Pressure": "carom.observables.pressure",
    "PotentialEnergy": "carom.observables.potential_energy",
    "WallPressure": "carom.observables.wall_pressure",
    "explain": "carom.simulation.explanation",
    "check": "carom.simulation.conditions",
    "rdf": "carom.observables.rdf",
    "view": "carom.pictures.view",
    "movie": "carom.pictures.movie",
    "CaromError": "carom.errors",
    "InputError": "carom.errors",
    "BusyError": "carom.errors",
    "OverlapError": "carom.errors",
    "FileError": "carom.errors",
    "CaromWarning": "carom.errors",
}
_MODULES = {
    "io": "carom.io",
    "models": "carom.models",
    "observables": "carom.observables",
    "plots": "carom.pictures.plots",
    "reference": "carom.reference",
    "studies": "carom.studies",
    "theory": "carom.theory",
}


def _grown() -> Any:
    from carom.simulation.growth import grown

    return grown


def _viewed() -> Any:
    from carom.pictures.view import view

    return view


def _picture() -> Any:
    from carom.pictures.plots import picture

    return picture


# Functions that subpackages need from subpackages above them.
above.install("grown", _grown)
above.install("viewed", _viewed)
above.install("picture", _picture)

__all__ = [*_LAZY, *_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    if name in _MODULES:
        return importlib.import_module(_MODULES[name])
    raise AttributeError(f"module 'carom' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
