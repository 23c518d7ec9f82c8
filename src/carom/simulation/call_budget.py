"""The work of compiled code in one call: some hundredths of a second.

Ctrl-C, a limit of wall time and a progress bar are handled between two calls. An event takes a microsecond in
three dimensions, and a second among the images of a box in twelve.
"""

from __future__ import annotations

from carom.compiling import entry

CYCLES, MOST_CYCLES = 20_000, 400_000
"""Cycles between two looks at whether a run comes nearer to its end: the first, and twice as many after each
that saw collisions, some 0.2 s in two and three dimensions at most. A call ends earlier, after ``SHORT`` to
``LONG``.
"""

MOST_SCHEDULED = 100_000  # components scheduled in one call, at most

SHORT, LONG = 0.02, 0.05
"""Seconds that a call should take: after a shorter one the next does twice as much, after a longer one less.
"""

FIRST = 1
"""How much the first call does: nobody knows yet how long that takes."""


class CallBudget:
    """So much at a time, ``count`` for the next call; ``with budget:`` goes around a call."""

    def __init__(self, most: int):
        self._most = most
        self.count = min(FIRST, most)
        self._began = 0.0

    def __enter__(self) -> None:
        self._began = entry.running()

    def __exit__(self, *error: object) -> None:
        spent = entry.running() - self._began
        if spent < SHORT:
            self.count = min(2 * self.count, self._most)
        elif spent > LONG:
            self.count = max(int(self.count * SHORT / spent), 1)
