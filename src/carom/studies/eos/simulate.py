"""One task of a study: a scene, equilibrated and measured. A plain function, for workers anywhere."""

from __future__ import annotations

import contextlib
import math
import threading
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from carom.block import Block
from carom.errors import CaromWarning
from carom.frame import Frame
from carom.observables import Estimate, Pressure
from carom.observables.precision import lengthen
from carom.simulation.equipartition import Thermometer
from carom.studies.eos.order import OrderParameter
from carom.studies.executors import Stopped
from carom.studies.tasks import Record, Task
from carom.studies.worker import Stopwatch, refuse_other_version, simulation_of

MOST = 16
"""Times the planned length that a run may reach on its way to the error asked for."""

GROWTH = 2.0
"""Times its length that a run becomes before its error bar is looked at again."""

ROOM = 1.05
"""Part by which a run is made longer than its error bar asks for, because that is known to some 5 % only."""


def simulate(task: Task, stop: Callable[[], bool] = lambda: False) -> Record:
    """Equilibrate and measure one run.

    Parameters
    ----------
    task : dict
        As :meth:`StudySpec.tasks` makes it.
    stop : callable, optional
        Asked now and then; if true, the run ends with :class:`Stopped`.

    Returns
    -------
    dict
        ``task``; ``result``, whose bits depend on the task alone; and ``provenance``: where and how long.

    Raises
    ------
    InputError
        If the scene cannot be made, or the worker has another version of Carom than the task asks for.
    """
    watch = Stopwatch()
    refuse_other_version(task)

    def look(_: float = 0.0) -> None:
        if stop():
            raise Stopped

    with _quiet():
        sim = simulation_of(task)
        scene = sim.scene
        began_at = sim.frame().unwrapped
        sim.run(collisions_per_particle=task["equilibration"], progress=look)
        equilibration = sim.time
        moved = _moved(began_at, sim.frame())
        sampler = OrderParameter(scene.dimension) if task["frames"] else None
        every = task["blocks"] // task["frames"] if task["frames"] else 0
        request = Pressure(blocks=task["blocks"])
        duration = sim.time_for(0.5 * scene.n * task["collisions_per_particle"]) / task["blocks"]
        blocks: list[Block] = []
        thermometer = Thermometer(sim.machine)

        def extend(wanted: int) -> int:
            for block in sim.blocks(duration, wanted - len(blocks)):
                look()
                blocks.append(block)
                thermometer.look()
                if sampler is not None and len(blocks) % every == 0:
                    sampler.add(sim.frame())
            return wanted

        def error_bar() -> Estimate:
            return sim.estimate(request, blocks).compressibility_factor

        lengthen(Planned(task["relative_error"], task["blocks"]), task["blocks"], extend, error_bar)
        estimate = sim.estimate(request, blocks)
        statistics = sim.statistics
    diameters, counts = np.unique(scene.diameters, return_counts=True)
    result = {
        "n": scene.n,
        "dimension": scene.dimension,
        "packing_fraction": scene.packing_fraction,
        "compressibility_factor": _plain(estimate.compressibility_factor),
        "reduced_pressure": _plain(estimate.reduced_pressure),
        "collision_rate": _plain(estimate.collision_rate),
        "block_values": [float(value) for value in estimate.block_values],
        "time": math.fsum(estimate.block_durations),
        "equilibration_time": equilibration,
        "collisions": statistics.collisions,
        "moved": moved,
        "moved_at_end": _moved(began_at, sim.frame()),
        "order": None if sampler is None else sampler.values(),
        "species_differ": bool(thermometer.differences()),
        "species": [[float(s), int(c)] for s, c in zip(diameters, counts, strict=True)],
        "confined": bool(scene.walls or scene.obstacles),
        "worst_overlap": statistics.worst_overlap,
        "energy_drift": statistics.energy_drift,
        "advancement_fraction": statistics.advancement_fraction,
    }
    return watch.record(task, result, sim)


@dataclass(frozen=True)
class Planned:
    """Near the length planned, which takes collisions for independent: else, near freezing, a run goes on.

    Parameters
    ----------
    relative_error : float or None
        Asked for; None keeps to the plan.
    blocks : int
        The length planned.
    """

    relative_error: float | None
    blocks: int

    def reached(self, z: Estimate) -> bool:
        """Tell whether the error is small enough."""
        return self.relative_error is None or z.error <= self.relative_error * z.mean

    def next_look(self, length: int, z: Estimate) -> int:
        """Return the number of blocks after which the error should be small enough."""
        assert self.relative_error is not None
        factor = ROOM * (z.error / (self.relative_error * z.mean)) ** 2
        # The error bar of a short run with long correlations is a guess, and most often too large a one here.
        return min(math.ceil(min(factor, GROWTH) * length), MOST * self.blocks)


def _moved(start: np.ndarray, frame: Frame) -> float:
    """Return the median distance from the start, in units of the mean spacing ``(V / n)^(1/d)``."""
    distance = np.sqrt(np.sum((frame.unwrapped - start) ** 2, axis=1))
    spacing = (math.prod(frame.box) / frame.n) ** (1.0 / frame.dimension)
    return float(np.median(distance)) / spacing


def _plain(estimate: Estimate) -> dict[str, float | None]:
    values = {name: getattr(estimate, name) for name in ("mean", "error", "n_eff", "tau", "blocks")}
    return {name: value if math.isfinite(value) else None for name, value in values.items()}


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep warnings of single runs from the screen: the table says what they say."""
    # Filters are the whole process's, and only the main thread may exchange them.
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)
        yield
