"""A plan as a value: what to run for a target, what it should reach, and what it will cost."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Annotated, Any

from carom import checks
from carom.errors import InputError
from carom.io import records
from carom.notebook import watchable
from carom.observables.statistics import unwarned
from carom.paths import writing
from carom.processors import cores as all_cores
from carom.results import Result, html_of, plain
from carom.scene_file.commands import PlanSpec
from carom.scene_file.scene_file import SceneFile
from carom.spec import file_of
from carom.studies import executors
from carom.studies.folder import Folder, Task
from carom.studies.held import AT_LEAST_ZERO, COUNT, POSITIVE, check_of
from carom.studies.job import Look
from carom.studies.planner.choice import Costs, Design, afford, chosen, design, duration, filled
from carom.studies.planner.diffusion import DiffusionMethod
from carom.studies.planner.outcome import NAME as OUTCOME, Outcome
from carom.studies.planner.pilot import Pilot, carried_out
from carom.studies.planner.pressure import PressureMethod
from carom.studies.planner.sizes import sizes
from carom.studies.planner.system import System, of_plan
from carom.studies.planner.target import Target
from carom.studies.result_folders import refuse_others, refuse_to_replace
from carom.studies.signatures import documented
from carom.table import Column, Table
from carom.texts import counted
from carom.version import __version__

PILOT_SECONDS = 15.0
"""CPU time that each of the two pilots may take; a typical one takes some two seconds."""

NAME = "plan.json"
"""File of a plan in its folder."""

PILOTS = ".pilots"
"""Folder in it, of the pilots until the plan is made."""

PLAIN = ("value", "estimator", "ratios", "cores", "walltime", "seed", "pilot_seconds")
"""Fields of a plan that are JSON values."""


def _time(value: Any, name: str) -> float:
    return math.inf if value is None else float(AT_LEAST_ZERO(value, name))


def _target(value: Any, name: str) -> Target:
    return Target.parse(records.text(value, name))


def _time_text(seconds: float, row: object) -> str:
    # By name: an annotation knows the names of its module, and a lambda in it does not.
    return duration(seconds)


@dataclass(frozen=True)
class Size:
    """The cost of one number of particles."""

    n: Annotated[int, Column("N", key=True), COUNT]
    bias: Annotated[float, Column("bias", ".1e"), AT_LEAST_ZERO]
    """Possible one after the correction, in the unit of the quantity."""
    cpu_seconds: Annotated[float, Column("CPU", _time_text, missing="the bias is larger"), _time]


@dataclass(frozen=True, repr=False)
class RunPlan(Result):
    """What to run, which error it should reach, and what it will cost on this machine.

    Attributes
    ----------
    target : Target
        The quantity, and the error to reach.
    system : System
        The system to simulate.
    value : float
        Expected value of the quantity, as accurate as the pilot.
    estimator : str
        The estimator with the smallest variance; :attr:`route` describes it.
    ratios : dict
        Variance of every estimator over that of the chosen one.
    design : Design
        N, replicas, equilibration, length, the promised error and the promised CPU time.
    cores : int
        Number of cores that are available.
    walltime : float or None
        Wall time that is available [s].
    seed : int
        Seed of the runs.
    sizes : tuple of Size
        Cost with other numbers of particles.
    pilot_seconds : float
        CPU time of the pilots [s].
    """

    target: Annotated[Target, _target]
    system: System
    value: Annotated[float, POSITIVE]
    estimator: str
    ratios: Mapping[str, Annotated[float, AT_LEAST_ZERO]]
    design: Design
    cores: Annotated[int, COUNT]
    walltime: Annotated[float, POSITIVE] | None
    seed: int
    sizes: tuple[Size, ...] = field(default=(), repr=False)
    pilot_seconds: Annotated[float, AT_LEAST_ZERO] = 0.0

    @property
    def error(self) -> float:
        """Promised error, bias included, in the unit of the quantity."""
        return self.design.error

    @property
    def cpu_seconds(self) -> float:
        """Promised CPU time [s]."""
        return self.design.cpu_seconds

    @property
    def seconds(self) -> float:
        """Expected wall time on these cores [s]."""
        return self.design.seconds(self.cores)

    @property
    def route(self) -> str:
        """How the quantity is measured."""
        return method(self.system, self.target).estimators[self.estimator]

    @property
    def sampling(self) -> str:
        """How often frames are taken."""
        return method(self.system, self.target).sampling

    @watchable("Running")
    def run(
        self,
        *,
        out: str | PathLike[str] | None = None,
        executor: Any = None,
        cores: int | str | None = None,
        progress: Callable[[float, str], object] | None = None,
    ) -> Outcome:
        """Run the plan as a study, and compare the result with the promise.

        Parameters
        ----------
        out : path, optional
            Folder with a file for each run; an interrupted plan continues there.
        executor, cores : optional
            As for :func:`carom.equation_of_state`. By default one run is in this process, and several
            are in as many processes as the plan has cores.
        progress : callable, optional
            Called with the finished fraction, and a sentence.
        """
        if executor is None:
            executor = "serial" if self.design.replicas == 1 else "processes"
        workers = executors.check(executor, cores)
        if executor != "serial" and workers is None:
            workers = min(self.cores, self.design.replicas)
        how, one = method(self.system, self.target), self.design
        records = carried_out(
            how.run.measure,
            how.tasks(one.n, one.replicas, one.equilibration, one.collisions_per_particle, self.seed),
            "runs", out=out, executor=executor, cores=workers, progress=progress,
        )  # fmt: skip
        value, bias, remarks = how.reached(records, self.estimator)
        seconds = math.fsum(s for record in records for s in record["provenance"]["cpu_seconds"].values())
        return Outcome(self, value, bias, seconds, records, tuple(remarks))

    _numbers_above = False

    @property
    def table(self) -> Table:
        """The sizes that were compared, one :class:`Size` for each."""
        return Table(Size, self.sizes, "Other sizes")

    def _words(self) -> dict[str, Any]:
        """Return the plan as JSON values."""
        return {
            "carom": __version__,
            "target": str(self.target),
            "system": self.system.words(),
            **{name: getattr(self, name) for name in PLAIN},
            "design": dataclasses.asdict(self.design),
            "promised": {name: getattr(self, name) for name in ("error", "cpu_seconds", "seconds")},
            "sizes": plain(self.table.dictionaries()),
        }

    @classmethod
    def _made(cls, values: Mapping[str, Any]) -> RunPlan:
        return of_words(values, "its content")

    def _columns(self) -> dict[str, Any]:
        """Return the sizes that were compared: n, the bias and the CPU time of each."""
        return {name: [getattr(size, name) for size in self.sizes] for name in self.table.names()}

    def _repr_html_(self) -> str:
        return html_of(self._lines()[0], self._columns())

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Draw the CPU time against the number of particles.

        Parameters and errors are those of :meth:`carom.results.Result.plot`.
        """
        from carom.figures.style import saved, sheet

        figure, axes = sheet(6.4, 4.0)
        known = [size for size in self.sizes if math.isfinite(size.cpu_seconds)]
        axes.plot([size.n for size in known], [size.cpu_seconds for size in known], "o-", label="other sizes")
        axes.plot([self.design.n], [self.design.cpu_seconds], "D", label="chosen")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel("particles, $N$")
        axes.set_ylabel(f"CPU seconds for {self.target}")
        axes.legend(frameon=False)
        return saved(figure, path)

    def save(self, path: str | PathLike[str]) -> None:
        """Write ``plan.json`` to a folder, from which :func:`carom.load` reads it, or one file.

        Parameters
        ----------
        path : path
            Without a suffix a folder. With a suffix a file: .json, .csv (the sizes) or a picture.

        Raises
        ------
        InputError
            If the suffix is none of these.
        FileError
            If the folder holds other results, or files of others by these names; if it cannot be written.
        """
        if Path(path).suffix and not Path(path).is_dir():
            super().save(path)
            return
        path = Path(path) / NAME
        reserve(path.parent)
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
        super().save(path)

    def _lines(self) -> list[str]:
        """Return what is printed: the target, the run, the promise."""
        one = self.design
        return [
            f"{self.target} for {self.system}: {self._runs} of {one.n} "
            f"particles, {one.collisions_per_particle:g} collisions per particle",
            f"promised {self._error()}",
            f"{duration(one.cpu_seconds)} of CPU, {duration(self.seconds)} on {counted(self.cores, 'core')} "
            "here",
        ]

    @property
    def _runs(self) -> str:
        """How many runs there are, in words."""
        return "one run" if self.design.replicas == 1 else f"{self.design.replicas} runs"

    def words(self) -> str:
        """Return the whole plan in words, as ``carom plan`` prints it."""
        one = self.design
        number = f"{one.replicas * 0.5 * one.n * one.collisions_per_particle:.2g}".replace("e+0", "e")
        lines = [
            f"{self.target} for {self.system}",
            f"N              {one.n}",
            f"equilibration  {one.equilibration:g} collisions per particle",
            f"length         {one.collisions_per_particle:g} collisions per particle ({number} in all)",
            f"replicas       {self._runs} on {counted(self.cores, 'core')}",
            f"estimator      {self.route}{self._rivals()}",
            f"sampling       {self.sampling}",
            f"promised       {self._error()}",
            f"cost           {duration(one.cpu_seconds)} of CPU, {duration(self.seconds)} here",
        ]
        return "\n".join(lines)

    def _rivals(self) -> str:
        """Return the variances of the other estimators, in words."""
        others = [f"{name} {ratio:.2g}" for name, ratio in self.ratios.items() if name != self.estimator]
        return f" (variance of others: {', '.join(others)})" if others else ""

    def _error(self) -> str:
        """Return the expected value and the parts of its error, in words."""
        one, name = self.design, self.target.quantity
        return (
            f"{name} about {self.value:.4g} +- {one.error:.2g}{self.target.unit}, "
            f"{one.error / abs(self.value):.2g} of it: statistics {one.statistical:.2g}, "
            f"bias of this N at most about {one.bias:.2g}"
        )


def load(folder: str | PathLike[str]) -> RunPlan:
    """Return the plan in a ``folder``."""
    path = Path(folder) / NAME
    return records.read_json(path, of_words, "a plan of Carom", "give another folder, or plan again")


def reserve(folder: Path) -> None:
    """Refuse a folder in which a plan would be mixed with other results, or replace files of others."""
    path = folder / NAME
    if os.path.lexists(path):
        # Another plan is replaced, and nothing else that has this name. The study of a plan is beside it.
        refuse_others(folder, "a plan", "a study")
        records.read_json(path, _NAMED, "a plan of Carom", "give another folder")
    else:
        refuse_to_replace([path.with_name(OUTCOME)], "a plan")
        refuse_others(folder, "a plan")


def of_words(value: Any, name: str) -> RunPlan:
    """Return the plan of the words that ``RunPlan.to_dict`` returned."""
    if (version := _NAMED(value, name)["carom"]) != __version__:
        raise InputError(f"it is of Carom {version}")
    found: RunPlan = check_of(RunPlan)(value, name)
    known = method(found.system, found.target).estimators
    if found.estimator not in known:
        raise InputError(f"estimator must be one of {', '.join(known)}, found {found.estimator[:40]!r}.")
    return found


_NAMED = records.table({"carom": records.text})


def method(system: System, target: Target) -> DiffusionMethod | PressureMethod:
    """Return the method that measures a target."""
    if target.quantity == "D" or target.species is not None:
        return DiffusionMethod(system, target.species)
    return PressureMethod(system, target.quantity)


@documented(PlanSpec, hidden=("pilot",))
@watchable("Planning")
def plan(
    target: str | Target | None = None,
    *,
    packing_fraction: float | None = None,
    dimension: int | None = None,
    species: Sequence[Mapping[str, float]] | None = None,
    scene: Any = None,
    pilot_seconds: float | None = None,
    out: str | PathLike[str] | None = None,
    progress: Callable[[float, str], object] | None = None,
    **given: Any,
) -> RunPlan:
    """Return the run that reaches a target for little CPU time, and its cost on this machine.

    Parameters
    ----------
    target : str or Target
        The quantity of the infinite system and its error, the bias of the finite size included. ``"Z=1e-4"``
        has a relative error, ``"Z=+-0.002"`` an absolute one. Quantities are Z, P (or pressure), g(contact),
        D, and D(A) of the species A of a mixture, by its name or its number from 0 on. ``"Z=1e-3"`` if left
        out.
    @
    packing_fraction : float
        Packing fraction of hard spheres with diameter, mass and kT 1. Give this or ``scene``.
    dimension : int
        d; 3 if left out.
    species : sequence of mappings, optional
        Species of a mixture, such as ``{"fraction": 0.5, "diameter": 1.4, "mass": 2.0}``.
    scene : path, SceneFile or System
        A scene. The plan may change its number of particles. Of a scene file (TOML) ``[plan]`` is read as
        well, whose values other arguments replace.
    pilot_seconds : float
        CPU time that each of two pilots may take [s]; 15 if left out.
    out : path, optional
        Folder for ``plan.json``; pilots that were interrupted go on there.
    progress : callable, optional
        Called with the finished fraction of the pilot, and a sentence; True shows a bar.

    Returns
    -------
    RunPlan
        The plan; ``plan.run()`` runs it.

    Raises
    ------
    InputError
        If the target cannot be reached: phases coexist, there is no equilibrium within pilot or walltime, the
        bias is too large at every size, or the CPU time is more than available. The message says what is
        possible.

    Examples
    --------
    >>> import carom
    >>> found = carom.plan("Z=1e-2", packing_fraction=0.1, cores=1)
    >>> found.design.replicas
    1
    """
    if target is not None and not isinstance(target, str | Target):
        raise InputError(f'plan() begins with a target such as "Z=1e-4", found {checks.describe(target)}.')
    with contextlib.nullcontext() if out is None else _begun(Path(out)) as folder:  # before a scene is made
        system = system_of(packing_fraction, dimension, species, scene)
        asked = asked_of(target, scene, {"pilot": pilot_seconds, **given})
        goal = target if isinstance(target, Target) else Target.parse(asked.target)
        made = _made(system, goal, asked, folder, progress)
        if folder is not None:
            made.save(folder)
            shutil.rmtree(folder / PILOTS, ignore_errors=True)
    return made


@contextlib.contextmanager
def _begun(folder: Path) -> Iterator[Path]:
    """Make the folder of a plan; one that is refused leaves nothing there."""
    reserve(folder)
    new = not folder.exists()
    Folder(folder).make()
    try:
        yield folder
    except InputError:
        shutil.rmtree(folder / PILOTS, ignore_errors=True)
        if new:
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise


def _made(
    system: System, goal: Target, asked: PlanSpec, folder: Path | None,
    progress: Callable[[float, str], object] | None,
) -> RunPlan:  # fmt: skip
    """Return the plan for a target, by pilots that the folder keeps until it is made."""
    n, walltime = asked.n, asked.walltime
    cores = executors.check(cores=asked.cores) or all_cores()
    limit = math.inf if walltime is None else walltime
    seed = 1 if asked.seed is None else asked.seed
    how = method(system, goal)
    every = sizes(system) if n is None else [system.filling(n)]
    pilots: list[Pilot] = []

    def pilot(size: int, equilibration: float | None = None) -> Any:
        """Return the results of a pilot, which is kept in the folder until the plan is made."""
        part = 0.5 * len(pilots)

        def measure(task: Task, look: Look) -> dict[str, Any]:
            if progress is not None:
                look.progress = lambda done, _: progress(part + 0.5 * done, f"Pilot of {size} particles")
            return how.trial.measure(task, look)

        seconds = PILOT_SECONDS if asked.pilot is None else asked.pilot
        task = how.pilot(size, seed=seed, seconds=seconds, equilibration=equilibration)
        kept = None if folder is None else folder / PILOTS
        with unwarned():
            (record,) = carried_out(measure, [task], "pilots", out=kept, executor="serial")
        pilots.append(how.found(record))
        return pilots[-1]

    found = pilot(every[0] if n is not None else system.filling(how.first_size))
    value, error = found.value, goal.absolute(found.value)
    candidates = [filled(how.costs(found, size), limit) for size in every]
    costs = chosen(candidates, error, limit)
    if costs is None:
        best = min(candidates, key=lambda one: one.bias)
        raise InputError(
            f"With {best.n} particles the bias of the finite size alone is about "
            f"{best.bias / abs(value):.2g} of {goal.quantity} after its correction, and {goal} asks for "
            f"{error / abs(value):.2g}. "
            + ("Give more particles, or leave out --n." if n is not None else "Ask for a larger error.")
        )
    afford(candidates, costs, error, cores, limit, str(goal), _asking(goal, value))
    if costs.n != found.n:
        again = pilot(costs.n, found.equilibration)
        timed = how.costs(again, costs.n)
        if again.sure:
            found, costs = again, timed
        else:  # its error bar is not used, but its speed is
            speed = ("collisions_per_second", "setup_seconds")
            costs = dataclasses.replace(costs, **{name: getattr(timed, name) for name in speed})
    costs = filled(costs, limit)
    last = afford([costs], costs, error, cores, limit, str(goal), _asking(goal, value))
    least = min(found.variances.values())
    return RunPlan(
        target=goal, system=system, value=value, estimator=found.estimator,
        ratios={name: float(f"{v / least:.3g}") for name, v in found.variances.items()},
        design=last, cores=cores, walltime=walltime, seed=seed,
        sizes=tuple(_size(each, error, last) for each in candidates),
        pilot_seconds=math.fsum(one.seconds for one in pilots),
    )  # fmt: skip


def _size(costs: Costs, error: float, chosen: Design) -> Size:
    """Return the cost of an error at one size; of the size that is run, that of its design."""
    found = chosen if costs.n == chosen.n else design(costs, error)
    return Size(costs.n, costs.bias, math.inf if found is None else found.cpu_seconds)


def _asking(goal: Target, value: float) -> Callable[[float], str]:
    """Return a function from an error to its target as text, rounded up to two digits."""

    def shown(error: float) -> str:
        wanted = error / abs(value) if goal.relative else error
        power = 10.0 ** (math.floor(math.log10(wanted)) - 1)
        return str(dataclasses.replace(goal, error=min(math.ceil(wanted / power) * power, 1.0)))

    return shown


def asked_of(target: str | Target | None, scene: Any, given: Mapping[str, Any]) -> PlanSpec:
    """Return for what to plan: what is ``given``, and ``[plan]`` of the scene if that is a file."""
    file = scene if isinstance(scene, str | PathLike) else None
    return PlanSpec.of(file, {**given, "target": None if target is None else str(target)})


def system_of(
    packing_fraction: float | None,
    dimension: int | None,
    species: Sequence[Mapping[str, float]] | None,
    scene: Any,
) -> System:
    """Return the system that the arguments of :func:`plan` describe."""
    if scene is not None:
        if (packing_fraction, dimension, species) != (None, None, None):
            raise InputError(
                "A scene contradicts packing_fraction, dimension and species; leave out one or the other."
            )
        if isinstance(scene, System):
            return scene
        if hasattr(scene, "build_scene"):
            return of_plan(scene)
        if not isinstance(scene, str | PathLike):
            raise InputError(
                "scene must be the path of a scene file, a SceneFile or a System, "
                f"found {checks.describe(scene)}."
            )
        return of_plan(SceneFile.load(file_of(Path(scene))))
    if packing_fraction is None:
        raise InputError(
            "A plan needs packing_fraction (--eta), or a scene (a file, such as fluid.toml); found neither."
        )
    words = {"species": [{"fraction": 1.0 / len(species), **each} for each in species]} if species else {}
    return System(packing_fraction, 3 if dimension is None else dimension, words)
