"""What is simulated: components, box, walls and obstacles as plain values, checked once.

Nothing here moves, compiles or reads files; how a scene is set in motion is the simulation's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from carom.scene.scene import Scene

__all__ = ["Scene"]


def __getattr__(name: str) -> Any:
    """Import the scene when it is first used: its parts are needed below it."""
    if name == "Scene":
        from carom.scene.scene import Scene

        return Scene
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
