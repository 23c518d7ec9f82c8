"""Wells, steps and bonds, under their public name; they are defined in ``carom.models``."""

from carom.models.interactions.bonds import Bonds, chains, rings
from carom.models.interactions.steps import Steps
from carom.models.interactions.wells import SquareWell, StepTable, from_potential

__all__ = ["Bonds", "SquareWell", "StepTable", "Steps", "chains", "from_potential", "rings"]
