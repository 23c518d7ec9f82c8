"""What is measured from frames and tallies, each number with its error bar."""

from carom.observables.packing import PackingNetwork, packing_network
from carom.observables.precision import Prediction
from carom.observables.pressure import Pressure, PressureEstimate
from carom.observables.rdf import RadialDistribution
from carom.observables.statistics import Estimate, blocking
from carom.observables.wall_pressure import WallPressure, WallPressureEstimate

__all__ = [
    "Estimate",
    "PackingNetwork",
    "Prediction",
    "Pressure",
    "PressureEstimate",
    "RadialDistribution",
    "WallPressure",
    "WallPressureEstimate",
    "blocking",
    "packing_network",
]
