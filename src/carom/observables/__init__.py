"""Measurements from frames and tallies, each number with its error bar.

Nothing here runs a simulation or reads the engine's arrays.
"""

from carom.observables.bond_order import BondOrder, BondOrderEstimate
from carom.observables.combined import combined
from carom.observables.dynamics import Dynamics, DynamicsEstimate
from carom.observables.flights import Distribution, FlightsEstimate
from carom.observables.moments import HelfandMoments
from carom.observables.packing import PackingNetwork, packing_network
from carom.observables.pair_distribution import PairDistribution
from carom.observables.potential_energy import PotentialEnergy, PotentialEnergyEstimate
from carom.observables.precision import Prediction
from carom.observables.pressure import Pressure, PressureEstimate
from carom.observables.protocol import Observable, averages
from carom.observables.radial import RadialDistribution
from carom.observables.statistics import Estimate, blocking
from carom.observables.structure import DensityProfile, ProfileEstimate
from carom.observables.wall_pressure import WallPressure, WallPressureEstimate

__all__ = [
    "BondOrder",
    "BondOrderEstimate",
    "DensityProfile",
    "Distribution",
    "Dynamics",
    "DynamicsEstimate",
    "Estimate",
    "FlightsEstimate",
    "HelfandMoments",
    "Observable",
    "PackingNetwork",
    "PairDistribution",
    "PotentialEnergy",
    "PotentialEnergyEstimate",
    "Prediction",
    "Pressure",
    "PressureEstimate",
    "ProfileEstimate",
    "RadialDistribution",
    "WallPressure",
    "WallPressureEstimate",
    "averages",
    "blocking",
    "combined",
    "packing_network",
]
