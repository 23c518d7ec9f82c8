"""Observables, and results that give each number with its error bar.

Nothing here runs a simulation or reads the engine's arrays.
"""

from carom.observables.analysis.moments import (
    HelfandCurrents as HelfandCurrents,
    HelfandMoments as HelfandMoments,
)
from carom.observables.analysis.precision import Prediction as Prediction, combined as combined
from carom.observables.bond_order import BondOrder as BondOrder, BondOrderResult as BondOrderResult
from carom.observables.crystallinity import (
    Crystallinity as Crystallinity,
    CrystallinityResult as CrystallinityResult,
)
from carom.observables.density_profile import (
    DensityProfile as DensityProfile,
    DensityProfileResult as DensityProfileResult,
)
from carom.observables.dynamics import Dynamics as Dynamics, DynamicsResult as DynamicsResult
from carom.observables.energy import Energy as Energy, EnergyResult as EnergyResult
from carom.observables.flights import (
    Distribution as Distribution,
    FreeFlights as FreeFlights,
    FreeFlightsResult as FreeFlightsResult,
)
from carom.observables.packing import PackingNetwork as PackingNetwork, packing_network as packing_network
from carom.observables.pressure import Pressure as Pressure, PressureResult as PressureResult
from carom.observables.pressure_profile import (
    PressureProfile as PressureProfile,
    PressureProfileResult as PressureProfileResult,
)
from carom.observables.pressure_tensor import (
    PressureTensor as PressureTensor,
    PressureTensorResult as PressureTensorResult,
)
from carom.observables.protocol import Observable as Observable, averages as averages
from carom.observables.rdf import RDF as RDF, RDFResult as RDFResult
from carom.observables.shear_moduli import ShearModuli as ShearModuli, ShearModuliResult as ShearModuliResult
from carom.observables.statistics import Estimate as Estimate, blocking as blocking
from carom.observables.structure_factor import (
    StructureFactor as StructureFactor,
    StructureFactorResult as StructureFactorResult,
)
from carom.observables.volume import Volume as Volume, VolumeResult as VolumeResult
from carom.observables.wall_pressure import (
    WallPressure as WallPressure,
    WallPressureResult as WallPressureResult,
)

__all__ = sorted(name for name, value in vars().items() if callable(value))
