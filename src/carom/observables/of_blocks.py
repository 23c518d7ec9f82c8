"""The bases of observables of blocks, and of results with one number by which a run knows when to end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

from carom.block import Block
from carom.errors import InputError
from carom.figures import curves
from carom.observables.statistics import Estimate
from carom.results import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from carom.scene.scene import Scene

Found = TypeVar("Found", bound=Result)


class OfBlocks(Generic[Found]):
    """Base of an observable with ``_of(blocks, scene, kT)``, which gets blocks of positive duration only."""

    _what: ClassVar[str] = ""
    """Name of the quantity in messages."""

    def of_scene(self, blocks: Sequence[Block], scene: Scene, *, kT: float) -> Found:
        """Return the result of a scene, from blocks of its run at the temperature ``kT``.

        Parameters
        ----------
        blocks : sequence of Block
            Sums over the stretches of the run.
        scene : Scene
            The scene of the run; its box is that of any moment.
        kT : float
            Temperature, where blocks do not hold their own [energy].

        Raises
        ------
        InputError
            If no block has a positive duration, or blocks lack what is measured.

        Warns
        -----
        CaromWarning
            If there are too few independent blocks.
        """
        kept = [block for block in blocks if block.duration > 0.0]
        if not kept:
            raise InputError(f"No block of positive duration was given; run before measuring {self._what}.")
        return self._of(kept, scene, kT)

    def _of(self, blocks: Sequence[Block], scene: Scene, kT: float) -> Found:
        raise NotImplementedError


class OneNumber(Result):
    """Base of a result with one number, a ``quantity``, by whose error :meth:`measure` may end a run."""

    _main: ClassVar[str] = ""
    """Name of the field with this number."""

    quantity: ClassVar[str] = ""
    """Name of the measured quantity, for messages."""

    _ylabel: ClassVar[str] = ""
    """What stands at the vertical axis of the picture: this number over time, block by block."""

    block_values: tuple[float, ...]
    block_durations: tuple[float, ...]

    def __float__(self) -> float:
        """Return the mean of this number."""
        return float(getattr(self, self._main).mean)

    @property
    def primary(self) -> Estimate:
        """The number that a ``relative_error`` refers to."""
        found: Estimate = getattr(self, self._main)
        return found

    def _draw_into(self, axes: Axes) -> None:
        text = curves.stated(getattr(self, self._main).value_text)
        curves.running_mean(axes, self.block_durations, self.block_values, text)
        axes.set_ylabel(self._ylabel)
