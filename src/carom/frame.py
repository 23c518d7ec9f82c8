"""All components at one time: sampling yields frames, files hold them, observables are computed from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from carom.configuration import Configuration
from carom.table import in_html
from carom.texts import axis_name, span, visible

if TYPE_CHECKING:
    import ase
    import freud
    import ovito
    import pandas
    import xarray


class Frame(Configuration):
    """All particles at one time: in the paper's words, a global state.

    Parameters
    ----------
    time : float
        Time since the start of the run [time].
    step : int
        Pair collisions realized since the start of the run.
    positions : (n, d) float64 array
        Centers [length], wrapped into ``0 <= x < edge``.
    velocities : (n, d) float64 array
        Velocities [length / time].
    box : (d,) float64 array
        Edges of the box [length]. Any sequence of d numbers is accepted.
    diameters, masses : (n,) float64 arrays
        Diameter [length] and mass of each particle.
    images : (n, d) int32 array or None
        How many times each particle left the box through an upper face, minus those through a lower one.
    species : (n,) int64 array or None
        Species of each particle, counted from 0.
    species_names : tuple of str
        Names of the species, or ().
    periodic : tuple of d bools
        Which axes are periodic; the others have walls at 0 and at the edge. By default all are periodic.
    spins : (n, 1) or (n, 3) float64 array or None
        Angular velocity of each rough particle, one number in the plane, three in space [1 / time].
    tilt : float or None
        Of a sheared box: the image one edge up along axis 1 is shifted by ``tilt`` of that edge along axis 0.
        Positions are then inside the tilted cell, and velocities are relative to the stream.
    lacks : frozenset of str
        Fields that the file of another program does not hold, such as "velocities" or "time": those here are
        assumed.

    Examples
    --------
    >>> import carom
    >>> frame = carom.Simulation(carom.Scene.random(64, 0.3, 2)).frame()
    >>> frame.n, frame.time, frame.positions.shape
    (64, 0.0, (64, 2))
    """

    def __repr__(self) -> str:
        return f"Frame({', '.join(f'{name}={text}' for name, text in self._facts().items())})"

    def __str__(self) -> str:
        facts = self._facts()
        width = max(map(len, facts))
        return "\n".join(f"{name:<{width}}  {text}" for name, text in facts.items())

    def _facts(self) -> dict[str, str]:
        """Return the properties of this frame as text, by name: fewer than ten lines."""
        facts = {
            "n": str(self.n),
            "dimension": str(self.dimension),
            "time": f"{self.time:.8g}",
            "step": str(self.step),
            "box": "(" + ", ".join(f"{edge:.6g}" for edge in self.box) + ")",
            "diameters": span(self.diameters),
            "masses": span(self.masses),
        }
        if self.species is not None:
            counts = np.bincount(self.species, minlength=len(self.species_names))
            names = self.species_names or tuple(map(str, range(len(counts))))
            facts["species"] = ", ".join(
                f"{visible(name)} {k}" for name, k in zip(names, counts, strict=True)
            )
        if self.tilt is not None:
            facts["tilt"] = f"{self.tilt:.6g}"
        if not all(self.periodic):
            axes = (axis_name(axis) for axis, repeats in enumerate(self.periodic) if not repeats)
            facts["walls"] = ", ".join(axes)
        return facts

    def _repr_html_(self) -> str:
        from carom.drawing.page import embedded

        return embedded(self) or in_html("Frame", self._facts().items())

    def to_ase(self) -> ase.Atoms:
        """Return this frame as an ``ase.Atoms``; errors are those of :func:`carom.io.to_ase`."""
        from carom.bridges.ase import to_ase

        return to_ase(self)

    def to_freud(self) -> tuple[freud.box.Box, np.ndarray]:
        """Return a freud box and positions (n, 3) float32 centered on the origin: a ``system`` for freud.

        Raises
        ------
        InputError
            If freud is not installed, or the frame has neither two nor three dimensions.
        """
        from carom.bridges.converters import to_freud

        return to_freud(self)

    def to_ovito(self) -> ovito.data.DataCollection:
        """Return OVITO's data: types, colors, radii, velocities, and the cell with its walls and dimension.

        Raises
        ------
        InputError
            If OVITO is not installed, or the frame has more than three dimensions.
        """
        from carom.bridges.converters import to_ovito

        return to_ovito(self)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a row for each particle: x, y, ..., vx, vy, ..., diameter, mass, and its species' name.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        from carom.bridges.converters import to_pandas

        return to_pandas(self)

    def to_xarray(self) -> xarray.Dataset:
        """Return positions, velocities, diameters and masses with named dimensions; see ``Reader.to_xarray``.

        Raises
        ------
        InputError
            If xarray is not installed.
        """
        from carom.bridges.converters import to_xarray

        return to_xarray([self]).isel(time=0)
