"""Order parameters near freezing, by freud where it is installed: psi_6 in 2D, Q_6 in 3D."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from carom.frame import Frame

NEIGHBORS = 12
"""Nearest neighbours that Q_6 looks at: those of a close packing."""

NAMES = {2: "psi_6", 3: "Q_6"}
"""Name of the order parameter, by dimension."""


def available() -> bool:
    """Return whether freud can be imported."""
    from importlib.util import find_spec

    return find_spec("freud") is not None


class OrderParameter:
    """The global order parameter of successive frames.

    Parameters
    ----------
    dimension : int
        2 (the modulus of the mean psi_6) or 3 (the global Q_6 of Steinhardt); in others nothing is measured.
    """

    def __init__(self, dimension: int):
        self.name = NAMES.get(dimension) if available() else None
        self._values: list[float] = []

    def add(self, frame: Frame) -> None:
        """Measure one frame."""
        if self.name is None:
            return
        import freud

        # The sums of several threads depend on who comes first; and the other cores have work of their own.
        with freud.parallel.NumThreads(1):
            self._values.append(_psi_6(frame) if frame.dimension == 2 else _q_6(frame))

    def values(self) -> dict[str, Any] | None:
        """Return the name and the values so far; None where nothing is measured."""
        return None if self.name is None else {"name": self.name, "values": self._values}


def _psi_6(frame: Frame) -> float:
    import freud

    points = np.zeros((frame.n, 3), dtype=np.float32)
    points[:, :2] = frame.positions - 0.5 * np.asarray(frame.box)
    box = freud.box.Box(Lx=frame.box[0], Ly=frame.box[1], is2D=True)
    # Neighbours are those of the Voronoi tessellation, as in the literature of melting.
    voronoi = freud.locality.Voronoi()
    voronoi.compute((box, points))
    hexatic = freud.order.Hexatic(k=6)
    hexatic.compute((box, points), neighbors=voronoi.nlist)
    return float(abs(np.mean(hexatic.particle_order.astype(np.complex128))))


def _q_6(frame: Frame) -> float:
    import freud

    box = freud.box.Box(*frame.box)
    points = (frame.positions - 0.5 * np.asarray(frame.box)).astype(np.float32)
    steinhardt = freud.order.Steinhardt(l=6)
    steinhardt.compute((box, points), neighbors={"num_neighbors": min(NEIGHBORS, frame.n - 1)})
    value = float(steinhardt.order)
    return value if math.isfinite(value) else 0.0
