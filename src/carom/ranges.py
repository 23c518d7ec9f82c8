"""Range rules, under their public name; they are defined in ``carom.models``."""

from carom.models.interactions.ranges import Kind, Ranges
from carom.models.interactions.units import CHANGED, ENTERED, LEFT, TIMER, draw

__all__ = ["CHANGED", "ENTERED", "LEFT", "TIMER", "Kind", "Ranges", "draw"]
