"""What changes the speed or the memory of a run, and not its physics."""

from __future__ import annotations

from dataclasses import dataclass

from carom.declared import Declared, described, number, option, switch, word
from carom.suggestions import corrected

Requested = tuple[str, float | None]  # the neighbor scheme that was asked for, and the reach of its lists


@described
@corrected()
@dataclass(frozen=True)
class Tuning(Declared):
    """How a simulation is computed: neighbors, what is counted, and how numbers are stored.

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

    neighbors: str = option(
        word("auto", "lists", "sectors", "all"),
        "Neighbor scheme: auto, lists, sectors or all; changes the speed, not the physics.",
        default="auto",
    )
    shell: float | None = option(
        number(low=1.0, open_low=True),
        "Reach of the neighbor lists in diameters. It asks for lists; the density says it by default.",
    )
    images: bool = option(
        switch, "Count the boxes that each particle crosses, for unwrapped positions.", default=True
    )
    precision: str = option(
        word("double", "single"),
        "Precision, double or single, in which positions, velocities and times are stored. All computations "
        "are in double precision. Single precision saves a fifth of the memory but no time, and leaves "
        "overlaps of 1e-7 of the box. It is refused for boxes of more than 8192 diameters, very near close "
        "packing, and for fast drifts.",
        default="double",
    )

    @property
    def requested(self) -> Requested:
        """The neighbor scheme and the reach of its lists."""
        return self.neighbors, self.shell


DEFAULT = Tuning()  # what is taken where nothing is said

TUNED = {name: f"tuning: tuning=carom.Tuning({name}=...)" for name in (*vars(DEFAULT), "images")}
"""What keywords of :class:`Tuning` are called in others."""
