"""g(r) as a value: a histogram of pair distances, with error bars, and its files."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import FileError, InputError
from carom.observables.statistics import Estimate

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False)
class RadialDistribution:
    """A histogram of pair distances, normalised to 1 for an ideal gas of the same n particles.

    Parameters
    ----------
    edges : (m + 1,) float64 array
        Edges of the bins [length]; the first is exactly the diameter.
    g, error : (m,) float64 arrays
        g(r) averaged over each shell, and its standard error: by blocking over 16 frames or more, otherwise
        that of independent pairs. A bin without any pair has the error of one pair.
    counts : (m,) int64 array
        Pairs seen in all frames.
    n, dimension, frames : int
        Number of particles, of dimensions and of frames.
    diameter : float
        Distance at contact [length]; for two species the distance at which they touch.
    packing_fraction : float
        Packing fraction of all components together.
    contact_value : Estimate or None
        g(sigma+), extrapolated (see :func:`carom.observables.contact.contact_value`); None if no bin begins
        at contact.
    pair : (int, int) or None
        The species of the two particles; None if all particles are counted.
    running : two (m,) arrays or None
        Running coordination numbers, which :meth:`coordination` returns.
    """

    edges: np.ndarray
    g: np.ndarray
    error: np.ndarray
    counts: np.ndarray
    n: int
    dimension: int
    frames: int
    diameter: float
    packing_fraction: float
    contact_value: Estimate | None = field(default=None)
    pair: tuple[int, int] | None = None
    running: tuple[np.ndarray, np.ndarray] | None = field(default=None, repr=False)

    @property
    def r(self) -> np.ndarray:
        """Centres of the bins (m,) [length]."""
        return 0.5 * (self.edges[:-1] + self.edges[1:])

    def coordination(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean number of neighbours up to the upper edge of each bin, and its error, (m,) each.

        For two species it is the number of neighbours of the second one around a component of the first.
        Errors are by blocking over 16 frames or more, otherwise those of independent pairs.

        Raises
        ------
        InputError
            If the distribution was made by MDAnalysis, which does not count frame by frame.
        """
        if self.running is None:
            raise InputError("Running coordination numbers need the counts of each frame: carom.rdf(frames).")
        return self.running

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file ``path``: ``.csv`` (see :meth:`to_csv`) or ``.npz`` (NumPy arrays), by its suffix.

        Raises
        ------
        FileError
            If the suffix is another one, or the file cannot be written.
        """
        path = Path(path)
        if path.suffix == ".csv":
            self.to_csv(path)
        elif path.suffix == ".npz":
            arrays = {"edges": self.edges, "g": self.g, "error": self.error, "counts": self.counts}
            if self.pair is not None:
                arrays["pair"] = np.array(self.pair)
            numbers = {name: np.array(value) for name, value in self._header().items()}
            with _writing(path):
                np.savez(path, allow_pickle=False, **arrays, **numbers)
        else:
            raise FileError(f"{path} ends in {path.suffix!r}; g(r) is written as .csv or .npz.")

    def to_pandas(self) -> pandas.DataFrame:
        """Return r, g and its error as a pandas DataFrame."""
        import pandas

        return pandas.DataFrame({"r": self.r, "g": self.g, "error": self.error})

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the columns ``r_lo, r_hi, g, error, counts`` to the file ``path``, with all digits.

        Lines that begin with # before them say what was measured.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        lines = [f"# {name}: {value}" for name, value in self._header().items()]
        if self.pair is not None:
            lines.append(f"# pair: {self.pair[0]} {self.pair[1]}")
        lines.append("r_lo,r_hi,g,error,counts")
        for k in range(self.g.size):
            row = (self.edges[k], self.edges[k + 1], self.g[k], self.error[k])
            lines.append(",".join(f"{value:.17g}" for value in row) + f",{self.counts[k]:d}")
        with _writing(Path(path)):
            Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")

    def _header(self) -> dict[str, float]:
        """Return the numbers at the head of a file, by name."""
        names = ("n", "dimension", "frames", "diameter", "packing_fraction")
        header = {name: getattr(self, name) for name in names}
        if self.contact_value is not None:
            header |= {"contact_value": self.contact_value.mean, "contact_error": self.contact_value.error}
        return header


def is_table(path: Path) -> bool:
    """Return whether a file is a table of g(r) that Carom wrote."""
    try:
        with path.open("rb") as file:
            return file.read(5) == b"# n: "
    except OSError:
        return False


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Raise FileError in place of an OSError."""
    try:
        yield
    except OSError as error:
        raise FileError(f"{path} cannot be written ({error.strerror}); choose another place.") from error
