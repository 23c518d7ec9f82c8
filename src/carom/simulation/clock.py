"""The exact time of a run: an epoch and an offset within it, in the engine's unit."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from carom.errors import InputError
from carom.units import TimeUnit

LAST_EPOCH = 2**61  # epochs that a clock can count, with room to spare


@dataclass
class Clock:
    """The present, as an exact number."""

    unit: TimeUnit
    length: float  # of an epoch, a power of two [engine's time]
    base: Fraction = Fraction(0)  # when the counting of epochs began [time]
    epoch: int = 0  # epochs since then
    offset: float = 0.0  # since the start of that epoch [engine's time]
    _known: tuple[int, float, Fraction] | None = field(default=None, repr=False, compare=False)

    @property
    def instant(self) -> Fraction:
        """The present [time]."""
        # Asked for several times a run: fractions are slow.
        if self._known is None or self._known[:2] != (self.epoch, self.offset):
            elapsed = self.epoch * Fraction(self.length) + Fraction(self.offset)
            self._known = self.epoch, self.offset, self.base + self.unit.to_scene(elapsed, 1)
        return self._known[2]

    def since_base(self, instant: Fraction) -> Fraction:
        """Return the time from when the counting began to an instant [engine's time]."""
        return self.unit.to_kernel(instant - self.base, 1)

    def split(self, instant: Fraction) -> tuple[int, float]:
        """Return the epoch and the offset of an instant."""
        length = Fraction(self.length)
        elapsed = self.since_base(instant)
        epoch = int(elapsed // length)
        if epoch >= LAST_EPOCH:
            raise InputError(
                f"A time of {float(instant):g} is {float(epoch):g} epochs of "
                f"{self.unit.to_scene(self.length, 1):g}; expected fewer than {LAST_EPOCH:g}, so ask for "
                "less time."
            )
        offset = float(elapsed - epoch * length)
        return (epoch, offset) if offset < self.length else (epoch + 1, 0.0)
