"""What is simulated: components, box, walls and obstacles as plain values, checked once.

Nothing here reads files; the simulation sets a scene in motion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from carom.scene.scene import Scene

__all__ = ["Scene"]


def __getattr__(name: str) -> Any:
    """Import Scene when it is first used: modules that it imports use other modules of this package."""
    if name == "Scene":
        from carom.scene.scene import Scene

        return Scene
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
