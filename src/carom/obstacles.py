"""What stands in a scene, under the name that scripts import it by; it lives in ``carom.models``."""

from carom.models.obstacles import *  # noqa: F403
from carom.models.obstacles import __all__ as __all__
