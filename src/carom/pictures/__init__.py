"""Pictures, movies and pages of runs, files, scenes and packings.

Nothing here computes results or runs a simulation.
"""

from typing import Any


def __getattr__(name: str) -> Any:
    if name == "paper":  # an import would pass over an AttributeError
        raise ImportError("carom.pictures.paper is carom.figures.style now: from carom.figures import style.")
    raise AttributeError(f"module 'carom.pictures' has no attribute {name!r}")
