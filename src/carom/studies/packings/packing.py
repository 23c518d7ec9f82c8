"""The result of a compression: a packing, its Z and density, its contact network, and its files."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
from collections.abc import Callable, Mapping, Sequence
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
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import Geometry
from carom.io.formats import SUFFIXES
from carom.io.validation import flaw
from carom.models.files.tables import from_table, obstacle_to_table
from carom.models.obstacles import Obstacle
from carom.observables.packing import PackingNetwork, network_of
from carom.paths import replacing, write_text, writing
from carom.results import Result, plain, shown
from carom.scene.scene import Scene
from carom.table import in_html as table
from carom.texts import counted, particles, visible
from carom.version import __version__

HISTORY = np.dtype([("collisions", np.int64), ("packing_fraction", float), ("Z", float), ("rate", float)])
"""Fields of the record of every stretch between two rescalings."""

NETWORK = (
    "jamming_fraction", "rattlers", "rattler_fraction", "contacts", "isostatic", "excess", "coordination",
    "gap", "void", "sided", "contacts_note",
)  # fmt: skip
"""Keys of a summary for the network of contacts."""

ARRAYS = ("positions", "velocities", "box", "diameters", "masses", "images", "species")
"""Arrays of a frame, of which the last two may be None."""

BACKBONE_FROM = 1e3
"""Z from which rattlers and backbone are distinguished: gaps are then 1e-3 and less."""

LARGEST_EXTENDED = 3
"""Largest dimension that extended XYZ can hold."""


@dataclass(frozen=True, eq=False)
class Packing(Result):
    """Spheres after a compression.

    Attributes
    ----------
    frame : Frame
        The final state. Diameters are reduced by the fraction ``shrunk``, so that nothing overlaps.
    history : structured array
        One row for each stretch between two rescalings: ``collisions`` so far, ``packing_fraction``, ``Z`` =
        PV / NkT, and growth ``rate`` of the mean diameter over the thermal speed.
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
        """Number of particles."""
        return self.frame.n

    @property
    def dimension(self) -> int:
        """Number of dimensions, d."""
        return self.frame.dimension

    @property
    def packing_fraction(self) -> float:
        """Fraction of the box that the particles fill."""
        volume = sphere_volume(self.dimension) * float(np.sum(power(self.frame.diameters, self.dimension)))
        return volume / math.prod(self.frame.box)

    @property
    def Z(self) -> float:
        """Z = PV / NkT during the last stretch; NaN if there was none."""
        return float(self.history["Z"][-1]) if len(self.history) else math.nan

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
        """Packing fraction at which Z will diverge; NaN if Z is too low.

        Notes
        -----
        It follows from the free-volume law ``Z = d (N_b - 1) / N / (1 - eta / eta_J)`` of a jammed backbone
        of N_b particles (Salsburg and Wood 1962; Donev, Torquato and Stillinger 2005). Below Z = 1e3, all
        particles count as backbone.
        """
        backbone = self.n
        if self.Z >= BACKBONE_FROM:
            backbone = int(self.network.backbone.sum()) or self.n
        leading = self.dimension * (backbone - 1) / self.n
        if not leading < self.Z:
            return math.nan
        # Z is that of a stretch, so the density is that of its middle.
        fractions = self.history["packing_fraction"][-2:]
        return float(fractions.mean()) / (1.0 - leading / self.Z)

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

    _numbers_above = False

    def _columns(self) -> dict[str, Any]:
        """Return the columns of the history, with a row for each stretch."""
        return {name: self.history[name].tolist() for name in HISTORY.names or ()}

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Draw the contacts and the rattlers.

        Parameters and errors are those of :func:`carom.pictures.plots.packing`.
        """
        from carom.pictures import plots

        return plots.packing(self.network, path=path)

    def _words(self) -> dict[str, Any]:
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
            "Z": plain(self.Z),
            "shrunk": self.shrunk,
        }
        try:
            network = self.network
        except InputError:  # no pair is near contact
            return summary | dict.fromkeys(NETWORK)
        values = (
            plain(self.jamming_fraction),
            len(network.rattlers),
            network.rattler_fraction,
            network.contacts,
            network.isostatic,
            network.contacts - network.isostatic,
            plain(network.coordination),
            network.gap,
            list(network.void),
            network.sided,
            network.note,
        )
        return summary | dict(zip(NETWORK, values, strict=True))

    def save(self, path: str | PathLike[str], *, pictures: bool = True) -> None:
        """Write a folder, from which :func:`carom.load` makes the packing again, or one file.

        Parameters
        ----------
        path : path
            Without a suffix a folder, for ``packing.h5md``, ``packing.extxyz`` (d <= 3), ``history.csv`` and,
            written last, ``summary.json``. With a suffix a file: .json (the results), .csv (the history), a
            trajectory (.h5md, .extxyz, .gsd) or a picture (.png, .pdf, .svg).
        pictures : bool
            Whether to draw ``packing.png``, ``compression.png`` and ``gaps.png`` in the folder.

        Raises
        ------
        InputError
            If the suffix is none of these.
        FileError
            If a file cannot be written.
        """
        folder = Path(path)
        if folder.suffix and not folder.is_dir():
            super().save(path)
            return
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
        for form in ("h5md", "extxyz") if self.dimension <= LARGEST_EXTENDED else ("h5md",):
            with replacing(folder / f"packing.{form}") as temporary:
                self.to_h5md(temporary)
        super().save(folder / "history.csv")
        summary = self.to_dict()
        if pictures and summary["gap"] is not None:
            from carom.pictures import plots

            if self.dimension in (2, 3):
                plots.packing(self.network, path=folder / "packing.png")
            else:
                plots.snapshot(self.frame, obstacles=self.network.obstacles, path=folder / "packing.png")
            plots.gaps(self.network, path=folder / "gaps.png")
            file = folder / "compression.png"
            plots.compression(self.history, self.jamming_fraction, self.dimension, path=file)
        write_text(folder / "summary.json", json.dumps(summary, indent=2, allow_nan=False) + "\n")

    def _saved(self) -> dict[str, Any]:
        """Return the frame, and the history."""
        arrays = {name: getattr(self.frame, name) for name in ARRAYS}
        lists = {name: None if value is None else value.tolist() for name, value in arrays.items()}
        others = {name: getattr(self.frame, name) for name in ("time", "step", "species_names", "periodic")}
        return {"history": self.history.tolist(), "frame": {**others, **lists}}

    @classmethod
    def _made(cls, values: Mapping[str, Any]) -> Packing:
        held = values["frame"]
        arrays: dict[str, Any] = {name: np.array(held[name], float) for name in ARRAYS[:-2]}
        arrays |= {name: None if held[name] is None else np.array(held[name]) for name in ARRAYS[-2:]}
        names, periodic = tuple(held["species_names"]), tuple(held["periodic"])
        frame = Frame(held["time"], held["step"], **arrays, species_names=names, periodic=periodic)
        if wrong := flaw(frame):
            raise InputError(f"its {wrong}")
        outside = np.abs(frame.positions - 0.5 * frame.box) > frame.box
        if outside.any() or frame.diameters.max() > 2.0 * frame.box.min():
            raise InputError("its particles do not fit into its box")
        history = np.array([tuple(row) for row in values["history"]], HISTORY)
        obstacles = tuple(from_table(each, "obstacle") for each in values["obstacles"])
        return cls(frame, history, values["note"], values["seed"], values["shrunk"], obstacles)

    def _writers(self) -> dict[str, Callable[[Path], object]]:
        return {**super()._writers(), **dict.fromkeys(SUFFIXES, self.to_h5md)}

    def _lines(self) -> list[str]:
        """Return what is printed: state, network, why it ended."""
        kind = particles(self.dimension, self.n)
        lines = [
            f"{self.n} {kind} at packing fraction {self.packing_fraction:.8g}, Z = PV/NkT = {self.Z:.3g}"
        ]
        summary = self.to_dict()
        if summary["gap"] is not None:
            jams = "" if summary["jamming_fraction"] is None else f"jams at {self.jamming_fraction:.8g}, "
            lines.append(f"{jams}{counted(summary['rattlers'], 'rattler')}, {self.network.counted}")
        return [*lines, f"ended: {self.note}"]

    def _repr_html_(self) -> str:
        from carom.pictures.view import view

        rows = {k: v for k, v in self.to_dict().items() if isinstance(v, int | float | str) and v != ""}
        words = table("Packing", [(k.replace("_", " "), shown(v)) for k, v in rows.items()])
        if self.dimension > 3 or "gap" not in rows:
            return words
        return view(self)._repr_html_() + words

    def __repr__(self) -> str:
        return (
            f"<Packing of {counted(self.n, 'particle')}, packing_fraction={self.packing_fraction:.6g}, "
            f"Z={self.Z:.3g}: {visible(self.note)}>"
        )


def parted(frame: Frame, obstacles: Sequence[Obstacle]) -> tuple[Frame, float]:
    """Return the frame with diameters reduced until nothing overlaps, and the fraction of the reduction."""
    room = Geometry(np.asarray(frame.box, dtype=float), np.asarray(frame.periodic), obstacles)
    contacts = Contacts(frame.diameters)
    pairs = room.pairs(frame.positions, contacts)
    gaps = [room.distances(frame.positions, pairs) / contacts.of(pairs) - 1.0]
    radii = 0.5 * frame.diameters
    gaps += [gap / radii[who] for _, who, gap in room.gaps(frame.positions, radii)]
    deepest = -min(float(gap.min(initial=0.0)) for gap in gaps)
    if deepest <= 0.0:
        return frame, 0.0
    shrunk = deepest + float(np.finfo(float).eps)
    return dataclasses.replace(frame, diameters=frame.diameters * (1.0 - shrunk)), shrunk
