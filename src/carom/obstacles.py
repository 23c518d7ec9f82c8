"""Obstacles of a scene, under their public name; they are defined in ``carom.models``."""

from carom.models.obstacles import *  # noqa: F403
from carom.models.obstacles import __all__ as __all__
