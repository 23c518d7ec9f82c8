"""The result of a compression: a packing, its pressure and density, its contact network, and its files."""

from __future__ import annotations

import csv
import dataclasses
import functools
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from carom import io
from carom.arithmetic import power
from carom.densities import sphere_volume
from carom.errors import InputError
from carom.frame import Frame
from carom.io.paths import replacing, writing
from carom.models.files.to_tables import obstacle_to_table
from carom.models.obstacles import Obstacle
from carom.notebook import table
from carom.observables.packing import PackingNetwork, network_of
from carom.scene.overlaps import Room
from carom.scene.scene import Scene
from carom.scene.species import Contacts
from carom.texts import visible
from carom.version import __version__

HISTORY = np.dtype(
    [("collisions", np.int64), ("packing_fraction", float), ("pressure", float), ("rate", float)]
)
"""Fields of the record of every stretch between two rescalings."""

NETWORK = (
    "jamming_fraction", "rattlers", "rattler_fraction", "contacts", "isostatic", "excess", "coordination",
    "gap", "void", "sided", "contacts_note",
)  # fmt: skip
"""Keys of a summary for the network of contacts."""

BACKBONE_FROM = 1e3
"""Reduced pressure from which rattlers and backbone are distinguished: gaps are then 1e-3 and less."""

LARGEST_EXTENDED = 3
"""Largest dimension that extended XYZ can hold."""


@dataclass(frozen=True, eq=False)
class Packing:
    """Spheres after a compression.

    Attributes
    ----------
    frame : Frame
        The final state. Diameters are reduced by the fraction ``shrunk``, so that nothing overlaps.
    history : structured array
        One row for each stretch between two rescalings: ``collisions`` so far, ``packing_fraction``, reduced
        ``pressure`` PV / NkT, and growth ``rate`` of the mean diameter over the thermal speed.
    note : str
        Why the compression ended.
    seed : int
        Seed of the compression.
    shrunk : float
        Fraction by which diameters were reduced: the deepest overlap left by rounding.
    obstacles : tuple of obstacles
        Obstacles of the scene.
    """

    frame: Frame
    history: np.ndarray
    note: str
    seed: int
    shrunk: float
    obstacles: tuple[Obstacle, ...] = ()

    @property
    def n(self) -> int:
        """Number of components."""
        return self.frame.n

    @property
    def dimension(self) -> int:
        """Number of dimensions, d."""
        return self.frame.dimension

    @property
    def packing_fraction(self) -> float:
        """Fraction of the box that the components fill."""
        volume = sphere_volume(self.dimension) * float(np.sum(power(self.frame.diameters, self.dimension)))
        return volume / math.prod(self.frame.box)

    @property
    def pressure(self) -> float:
        """Reduced pressure PV / NkT during the last stretch; NaN if there was none."""
        return float(self.history["pressure"][-1]) if len(self.history) else math.nan

    @property
    def collisions(self) -> int:
        """Pair collisions of the whole compression."""
        return self.frame.step

    @functools.cached_property
    def network(self) -> PackingNetwork:
        """Contacts, rattlers and backbone; :func:`carom.observables.packing_network` has more options.

        After a fast compression, or in crystalline grains with straight edges, no backbone may remain if
        contacts on one side make a rattler. Rattlers are then identified by contact count only: fewer than
        d + 1 contacts.
        """
        return network_of(self.frame, obstacles=self.obstacles)

    @property
    def rattlers(self) -> np.ndarray:
        """Indices of the rattlers."""
        return self.network.rattlers

    @property
    def jamming_fraction(self) -> float:
        """Packing fraction at which the pressure will diverge; NaN if the pressure is too low.

        Notes
        -----
        It follows from the free-volume law ``Z = d (N_b - 1) / N / (1 - eta / eta_J)`` of a jammed backbone
        of N_b components (Salsburg and Wood 1962; Donev, Torquato and Stillinger 2005). Below Z = 1e3, all
        components count as backbone.
        """
        backbone = self.n
        if self.pressure >= BACKBONE_FROM:
            backbone = int(self.network.backbone.sum()) or self.n
        leading = self.dimension * (backbone - 1) / self.n
        if not self.pressure > leading:
            return math.nan
        # The pressure is that of a stretch, so the density is that of its middle.
        fractions = self.history["packing_fraction"][-2:]
        return float(fractions.mean()) / (1.0 - leading / self.pressure)

    def scene(self) -> Scene:
        """Return the packing as a scene, which verifies that nothing overlaps."""
        return Scene.from_frame(self.frame, obstacles=self.obstacles)

    def to_h5md(self, path: str | PathLike[str]) -> None:
        """Write the frame to the file ``path``: H5MD, or another format that its suffix chooses.

        Raises
        ------
        InputError
            If the suffix is unknown, or the format cannot hold the frame.
        FileError
            If the file cannot be written.
        """
        with io.open(path, "w") as writer:
            assert isinstance(writer, io.Writer)
            writer.write(self.frame)

    def to_pandas(self) -> Any:
        """Return the history as a pandas DataFrame."""
        import pandas

        return pandas.DataFrame(self.history)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the history as a table to the file ``path``.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        path = Path(path)
        with writing(path), path.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file)
            table.writerow(self.history.dtype.names or ())
            table.writerows(self.history.tolist())

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Draw the contacts and the rattlers.

        Parameters and errors are those of :func:`carom.pictures.plots.packing`.
        """
        from carom.pictures import plots

        return plots.packing(self.network, path=path)

    def summary(self) -> dict[str, Any]:
        """Return the results as JSON values; a number that does not exist is None."""
        summary = {
            "version": __version__,
            "seed": self.seed,
            "n": self.n,
            "dimension": self.dimension,
            "box": list(self.frame.box),
            "confined": not all(self.frame.periodic) or bool(self.obstacles),
            "obstacles": [obstacle_to_table(obstacle) for obstacle in self.obstacles],
            "collisions": self.collisions,
            "note": self.note,
            "packing_fraction": self.packing_fraction,
            "pressure": _finite(self.pressure),
            "shrunk": self.shrunk,
        }
        try:
            network = self.network
        except InputError:  # no pair is near contact
            return summary | dict.fromkeys(NETWORK)
        values = (
            _finite(self.jamming_fraction),
            len(network.rattlers),
            network.rattler_fraction,
            network.contacts,
            network.isostatic,
            network.contacts - network.isostatic,
            _finite(network.coordination),
            network.gap,
            list(network.void),
            network.sided,
            network.note,
        )
        return summary | dict(zip(NETWORK, values, strict=True))

    def save(self, folder: str | PathLike[str], *, pictures: bool = True) -> dict[str, Any]:
        """Write the frame, the history, pictures and, last, ``summary.json``.

        Parameters
        ----------
        folder : path
            An existing folder, for ``packing.h5md``, ``packing.extxyz`` (d <= 3) and ``history.csv``.
        pictures : bool
            Whether to draw ``packing.png``, ``compression.png`` and ``gaps.png``.

        Returns
        -------
        dict
            The summary.

        Raises
        ------
        FileError
            If a file cannot be written.
        """
        folder = Path(folder)
        for form in ("h5md", "extxyz") if self.dimension <= LARGEST_EXTENDED else ("h5md",):
            with replacing(folder / f"packing.{form}") as temporary:
                self.to_h5md(temporary)
        with replacing(folder / "history.csv") as temporary:
            self.to_csv(temporary)
        summary = self.summary()
        if pictures and summary["gap"] is not None:
            from carom.pictures import plots

            with replacing(folder / "packing.png") as temporary:
                if self.dimension in (2, 3):
                    plots.packing(self.network, path=temporary)
                else:
                    plots.snapshot(self.frame, path=temporary)
            with replacing(folder / "gaps.png") as temporary:
                plots.gaps(self.network, path=temporary)
            with replacing(folder / "compression.png") as temporary:
                plots.compression(self.history, self.jamming_fraction, self.dimension, path=temporary)
        text = json.dumps(summary, indent=2, allow_nan=False) + "\n"
        with replacing(folder / "summary.json") as temporary, writing(folder):
            temporary.write_text(text, encoding="utf-8")
        return summary

    def _repr_html_(self) -> str:
        from carom.pictures.view import view

        rows = {k: v for k, v in self.summary().items() if isinstance(v, int | float | str) and v != ""}
        shown = table("Packing", [(k.replace("_", " "), f"{v:.8g}" if isinstance(v, float) else str(v))
                                  for k, v in rows.items()])  # fmt: skip
        if self.dimension > 3 or "gap" not in rows:
            return shown
        return view(self)._repr_html_() + shown

    def __repr__(self) -> str:
        return (
            f"<Packing of {self.n} components, packing_fraction={self.packing_fraction:.6g}, "
            f"pressure={self.pressure:.3g}: {visible(self.note)}>"
        )


def parted(frame: Frame, obstacles: Sequence[Obstacle]) -> tuple[Frame, float]:
    """Return the frame with diameters reduced until nothing overlaps, and the fraction of the reduction."""
    room = Room(np.asarray(frame.box, dtype=float), np.asarray(frame.periodic), obstacles)
    contacts = Contacts(frame.diameters)
    pairs = room.pairs(frame.positions, contacts)
    gaps = [room.distances(frame.positions, pairs) / contacts.of(pairs) - 1.0]
    radii = 0.5 * frame.diameters
    gaps += [gap / radii for _, gap in room.gaps(frame.positions, radii)]
    deepest = -min(float(gap.min(initial=0.0)) for gap in gaps)
    if deepest <= 0.0:
        return frame, 0.0
    shrunk = deepest + float(np.finfo(float).eps)
    return dataclasses.replace(frame, diameters=frame.diameters * (1.0 - shrunk)), shrunk


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
