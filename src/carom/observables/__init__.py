"""Observables, and results that give each number with its error bar.

Nothing here runs a simulation or reads the engine's arrays.
"""

from carom.observables.analysis.combined import combined
from carom.observables.analysis.moments import HelfandCurrents, HelfandMoments
from carom.observables.analysis.precision import Prediction
from carom.observables.bond_order import BondOrder, BondOrderResult
from carom.observables.crystallinity import Crystallinity, CrystallinityResult
from carom.observables.density_profile import DensityProfile, DensityProfileResult
from carom.observables.dynamics import Dynamics, DynamicsResult
from carom.observables.energy import Energy, EnergyResult
from carom.observables.flights import Distribution, FreeFlights, FreeFlightsResult
from carom.observables.packing import PackingNetwork, packing_network
from carom.observables.pressure import Pressure, PressureResult
from carom.observables.pressure_profile import PressureProfile, PressureProfileResult
from carom.observables.pressure_tensor import PressureTensor, PressureTensorResult
from carom.observables.protocol import Observable, averages
from carom.observables.rdf import RDF, RDFResult
from carom.observables.shear_moduli import ShearModuli, ShearModuliResult
from carom.observables.statistics import Estimate, blocking
from carom.observables.structure_factor import StructureFactor, StructureFactorResult
from carom.observables.volume import Volume, VolumeResult
from carom.observables.wall_pressure import WallPressure, WallPressureResult

__all__ = [
    "RDF",
    "BondOrder",
    "BondOrderResult",
    "Crystallinity",
    "CrystallinityResult",
    "DensityProfile",
    "DensityProfileResult",
    "Distribution",
    "Dynamics",
    "DynamicsResult",
    "Energy",
    "EnergyResult",
    "Estimate",
    "FreeFlights",
    "FreeFlightsResult",
    "HelfandCurrents",
    "HelfandMoments",
    "Observable",
    "PackingNetwork",
    "Prediction",
    "Pressure",
    "PressureProfile",
    "PressureProfileResult",
    "PressureResult",
    "PressureTensor",
    "PressureTensorResult",
    "RDFResult",
    "ShearModuli",
    "ShearModuliResult",
    "StructureFactor",
    "StructureFactorResult",
    "Volume",
    "VolumeResult",
    "WallPressure",
    "WallPressureResult",
    "averages",
    "blocking",
    "combined",
    "packing_network",
]
