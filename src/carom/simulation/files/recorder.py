"""The event log of a run: from the engine's buffer to a file."""

from __future__ import annotations

import json
import os
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.scene.storage import to_arrays
from carom.simulation.system_of_scene import thresholds_of

if TYPE_CHECKING:
    from carom.io.events import EventLog
    from carom.simulation.run_state import RunState

BUFFER = 1 << 16  # collisions kept in memory before they go to the file


class Recorder:
    """Writer of every collision of a run to a file; ``buffer`` is what the engine writes into.

    With ``mark``, what :meth:`mark` returned at the present of the run, the file goes on: what it holds
    beyond is dropped when something is written. Without, a new log begins.
    """

    def __init__(self, path: str | PathLike[str], run_state: RunState, mark: dict[str, Any] | None = None):
        from carom.engine.observers.event_log import make_log
        from carom.io.events import EventLog, verify

        self._process = os.getpid()
        self.path = Path(path)
        self._place = self.path.absolute()  # the folder of the process may change before it grows
        self._begun = run_state.clock.instant
        self._mark = mark
        self._file: EventLog | None = None  # of a log that continues: it is only read until it grows
        if mark is None:
            self._file = EventLog(path, _header(run_state), kinds=run_state.system.stepped)
        else:
            verify(self.path, int(mark["events"]), mark["sums"])
        self.buffer = make_log(BUFFER)

    @property
    def inherited(self) -> bool:
        """Whether another process, of which this one is a fork, writes the file."""
        return self._process != os.getpid()

    def mark(self) -> dict[str, Any]:
        """Return how many events the file holds, of pairs and with what is fixed, and their checksums."""
        if self._file is None:
            assert self._mark is not None
            return self._mark
        return {"events": len(self._file), "sums": self._file.sums}

    def _opened(self) -> EventLog:
        """Return the file, open to grow; what it holds beyond the mark is dropped."""
        from carom.io.events import EventLog

        if self._file is None:
            assert self._mark is not None
            self._file = EventLog(self._place, keep=int(self._mark["events"]), sums=self._mark["sums"])
        return self._file

    def flush(self, run_state: RunState) -> None:
        """Write what the buffer holds."""
        from carom.engine.constants import LAMBDA, OBSTACLE, TIMER_EVENT

        used = int(self.buffer.used[0])
        if used == 0:
            if run_state.clock.instant != self._begun:  # the run goes on, and nothing happens in it
                self._opened()
            return
        stepped = run_state.system.stepped
        bits = run_state.engine.model.boundary.bits if stepped else _bits(run_state)
        ref = self.buffer.ref[:used]
        other, image = ref >> bits, ref & ((1 << bits) - 1)
        kind = image.copy() if stepped else None
        if stepped:
            image[:] = 0
        alone = ref == TIMER_EVENT  # asked or kicked on its own: the number after those of all obstacles
        other[alone], image[alone] = run_state.scene.n + len(run_state.obstacle_numbers()), 0
        fixed = (ref < LAMBDA) & ~alone
        if fixed.any():  # the paper's partners N + k
            public = np.argsort(run_state.obstacle_numbers())
            order = np.sort(run_state.obstacle_numbers())
            k = public[np.searchsorted(order, OBSTACLE - ref[fixed])]
            other[fixed], image[fixed] = run_state.scene.n + k, 0
        if kind is not None:
            kind[ref < LAMBDA] = 0
        self._opened().append(
            self.buffer.epoch[:used],
            run_state.unit.to_scene(self.buffer.time[:used], 1),
            self.buffer.i[:used],
            other,
            image,
            run_state.unit.to_scene(self.buffer.impulse[:used], -1),
            kind,
        )
        self.buffer.used[0] = 0

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()


def _header(run_state: RunState) -> dict[str, Any]:
    """Return the state before the first event, and what its words mean."""
    scene, attributes = to_arrays(run_state.scene)
    return {
        **{name: values for name, values in scene.items() if name not in ("diameter", "mass")},
        "diameters": run_state.scene.diameters,
        "masses": run_state.scene.masses,
        "scene": np.frombuffer(json.dumps(attributes).encode(), np.uint8),
        "thresholds": np.array(thresholds_of(run_state.system)),
        "positions": run_state.scene.positions,
        "velocities": run_state.velocities,
        "box": np.asarray(run_state.scene.box),
        "diameter": np.float64(run_state.scene.diameter),
        "mass": np.float64(run_state.scene.mass),
        "epoch_length": np.float64(run_state.unit.to_scene(run_state.scheme.epoch, 1)),
        "shape": np.asarray(run_state.scheme.shape, np.int64),
        "bits": np.int64(_bits(run_state)),
        "single": np.int64(run_state.system.single),
    }


def _bits(run_state: RunState) -> int:
    """Return how many bits of a word name the image: none in a wide box."""
    from carom.engine.boundary import SectorImage

    boundary = run_state.engine.model.boundary
    return boundary.bits if isinstance(boundary, SectorImage) else 0
