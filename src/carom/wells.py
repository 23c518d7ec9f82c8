"""Wells, steps and bonds, under their public name; they are defined in ``carom.models``."""

from carom.models.bonds import Bonds, chains, rings
from carom.models.steps import Steps
from carom.models.wells import SquareWell, StepTable, from_potential

__all__ = ["Bonds", "SquareWell", "StepTable", "Steps", "chains", "from_potential", "rings"]
