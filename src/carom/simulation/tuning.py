"""What changes the speed or the memory of a run, and not its physics."""

from __future__ import annotations

from dataclasses import dataclass

from carom import checks
from carom.errors import InputError
from carom.meant import corrected

Requested = tuple[str, float | None]
"""The neighbour scheme that was asked for, and the reach of its lists."""

SCHEMES = ("auto", "lists", "sectors", "all")
PRECISIONS = ("double", "single")


@corrected()
@dataclass(frozen=True)
class Tuning:
    """How a simulation is computed: neighbors, what is counted, and how numbers are stored.

    Parameters
    ----------
    neighbors : {"auto", "lists", "sectors", "all"}
        Neighbor scheme; changes the speed, not the physics.
    shell : float, optional
        Reach of the neighbor lists in diameters. It asks for lists; by default it follows from the density.
    images : bool
        Count the boxes that each particle crosses, for unwrapped positions.
    precision : {"double", "single"}
        Precision in which positions, velocities and times are stored. All computations are in double
        precision. Single precision saves a fifth of the memory but no time, and leaves overlaps of 1e-7 of
        the box. It is refused for boxes of more than 8192 diameters, very near close packing, and for fast
        drifts.

    Raises
    ------
    InputError
        If there is no such scheme or precision, or lists cannot have such a reach.

    Examples
    --------
    >>> import carom
    >>> scene = carom.Scene.crystal(108, 0.3)
    >>> sim = carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors", images=False))
    """

    neighbors: str = "auto"
    shell: float | None = None
    images: bool = True
    precision: str = "double"

    def __post_init__(self) -> None:
        if self.neighbors not in SCHEMES:
            raise InputError(
                f"neighbors is {self.neighbors!r}; expected 'auto', 'lists', 'sectors' or 'all'."
            )
        if self.precision not in PRECISIONS:
            raise InputError(f"precision is {self.precision!r}; expected 'double' or 'single'.")
        if self.shell is not None:
            object.__setattr__(self, "shell", checks.number(self.shell, "shell", low=1.0, open_low=True))

    @property
    def requested(self) -> Requested:
        """The neighbor scheme and the reach of its lists."""
        return self.neighbors, self.shell


DEFAULT = Tuning()
"""What is taken where nothing is said."""

TUNED = {name: f"tuning: tuning=carom.Tuning({name}=...)" for name in (*vars(DEFAULT), "images")}
"""What keywords of :class:`Tuning` are called in others."""
