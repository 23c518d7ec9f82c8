"""Range rules under the name that scripts import them by; they live in ``carom.models``."""

from carom.models.ranges import Kind, Ranges
from carom.models.units import CHANGED, ENTERED, LEFT, TIMER, draw

__all__ = ["CHANGED", "ENTERED", "LEFT", "TIMER", "Kind", "Ranges", "draw"]
