"""The paper's conditions I to V, and what else the engine relies on, for models of your own."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.frame import Frame
from carom.geometry.overlaps import Overlap
from carom.models import model_checks
from carom.models.interactions.growing_cores import Growing
from carom.models.interfaces.memory import copied
from carom.models.interfaces.obstacle import Obstacle
from carom.models.interfaces.particles import Particles
from carom.models.motions.free_flight import FreeFlight
from carom.models.obstacles.with_properties import Dressed, dressed
from carom.models.own.classes import kind_of, sized
from carom.models.own.kinds import DRIVE, IMPACT, MOTION, OBSERVER, PATH
from carom.scene.scene import Scene
from carom.simulation.measuring.depths import deepest, in_frames, present
from carom.simulation.model_validation import probes
from carom.simulation.model_validation.events import try_drive, try_events, try_impact
from carom.simulation.model_validation.interactions import refuse_short, refuse_without_steps
from carom.simulation.model_validation.motions import has_axis, try_flight
from carom.simulation.model_validation.obstacles import ObstacleTrial
from carom.simulation.model_validation.pairs import PairTrial
from carom.simulation.model_validation.setting import (
    SENTENCES,
    TOLERANCE,
    Failure,
    Record,
    Setting,
    in_plain_python,
)
from carom.simulation.simulation import Simulation
from carom.simulation.system_of_scene import driven_speed_of
from carom.units import TimeUnit

COMPONENTS = 8
"""Components that models are tried on."""

GROWTH = 0.05
"""Rate at which the diameters of half of the pairs on curves grow at most."""

UP_TO_FOUR = (1, 2, 3, 4)
"""Dimensions that are tried."""

EDGE = 20.0
"""Edge of the box in which pairs are tried [length]."""

SCALES = 4.0 ** np.arange(16)
"""Edges of boxes in which the surface of an obstacle is looked for [length]."""


@dataclass(frozen=True)
class Conditions:
    """What :func:`carom.check` found.

    Attributes
    ----------
    tried : dict of str to int
        How often each condition was tested.
    failures : tuple of Failure
        The first failure of each condition and dimension.
    """

    tried: dict[str, int]
    failures: tuple[Failure, ...]

    @property
    def passed(self) -> bool:
        """Whether all conditions held."""
        return not self.failures

    def __str__(self) -> str:
        failed = {failure.condition for failure in self.failures}
        lines = [
            f"{'FAILS' if name in failed else 'holds':<6}{name:<10}{SENTENCES[name]} ({count} tried)"
            for name, count in self.tried.items()
        ]
        return "\n".join([*lines, *map(str, self.failures)])


def check(
    value: Any,
    *,
    motion: Any = None,
    dimensions: tuple[int, ...] | None = None,
    pairs: int = 200,
    seed: int = 0,
    frames: Iterable[Frame] | None = None,
) -> Conditions:
    """Test the paper's conditions I to V on a model, or whether anything overlaps in frames of a scene.

    The conditions are those of Lubachevsky 1991, sec. 7, with further requirements. For a model nothing is
    compiled: the functions run as plain Python. A :class:`carom.Simulation` tests models that are not Carom's
    in the same way, on a few pairs of its own particles.

    Parameters
    ----------
    value : Scene, interaction, motion, impact, drive, obstacle or observer
        A scene is run for a while, and the distances of all particles, and to walls and obstacles, are
        computed from its frames, apart from how the engine finds events. A model is as
        :class:`carom.Scene` takes it. It is tested with eight particles of two species, with diameters
        from 0.6 to 1.4 and masses from 0.3 to 3; an obstacle with small particles near to it. An observer is
        told of made-up events.
    motion : motion, optional
        How particles move: an interaction or an obstacle may be right in one motion only. By default they
        fly freely.
    dimensions : tuple of int, optional
        Dimensions to test; by default those from 1 to 4 in which the model can be. A motion with a value for
        each axis is tested up to its number of axes, and an obstacle where it fits.
    pairs : int
        Number of pairs, or of flights towards an obstacle, in each dimension; of a scene, number of frames,
        in whose interval the fastest particle flies a diameter.
    seed : int
        Seed of the random pairs, and of the run of a scene.
    frames : iterable of Frame, optional
        Frames of a scene that are tested in place of a run, with their own times, boxes and diameters:
        samples of a simulation, or an open trajectory.

    Returns
    -------
    Conditions
        ``print`` shows it as a table; ``passed`` says whether all conditions hold.

    Raises
    ------
    InputError
        If the value is none of these. If a required question is
        not answered, an array of the model is too short, or a function fails in plain Python. If ``motion``
        is given for a motion or an impact, or ``frames`` are not those of a scene.

    Notes
    -----
    An overlap of up to 1e-12 contact distances + 64 eps L, L the diagonal of the box, is rounding; eps is
    that of single precision where all positions of a frame fit it.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(64, 0.3, 2), growth=0.01)
    >>> print(check(sim.scene, frames=[sim.frame()]))
    holds overlap   no two particles overlap, and none is inside a wall or an obstacle (1 tried)
    >>> from carom.models import HardCores
    >>> check(HardCores()).passed
    True
    """
    given, dimensions = dimensions, UP_TO_FOUR if dimensions is None else dimensions
    if not isinstance(dimensions, tuple | list):
        raise InputError(f"dimensions must be a tuple of integers, found {checks.describe(dimensions)}.")
    for each in dimensions:
        checks.integer(each, "dimensions", low=1)
    pairs = checks.integer(pairs, "pairs", low=1)
    if isinstance(value, Scene):
        return _check_scene(value, pairs, seed, frames)
    if frames is not None:
        raise InputError(f"frames= goes with a scene, found {checks.describe(value)}.")
    value = sized(value, COMPONENTS)
    kind = _kind(value)
    if kind == "obstacle":
        value = dressed(value)
        value = value.at(1.0) if isinstance(value, Dressed) else value
    if motion is not None and kind not in ("interaction", "obstacle"):
        raise InputError(
            f"motion= goes with an interaction or an obstacle, and {type(value).__name__} is neither."
        )
    flight = FreeFlight() if motion is None else model_checks.checked("motion", motion)
    record = Record()
    with in_plain_python(value, " In which dimensions to try it says dimensions=(2,)." * (given is None)):
        if kind == "obstacle":
            _check_obstacle(value, flight, dimensions, pairs, seed, record)
        else:
            found = _settings(value, value if kind == "motion" else flight, dimensions, seed, given is None)
            for some, moving, rng in found:
                _TRIED[kind](value, some, moving, pairs, rng, record)
    if model_checks.is_own(motion):
        with in_plain_python(motion):
            for _, moving, rng in _settings(motion, motion, dimensions, seed, given is None):
                for _ in range(pairs):
                    try_flight(moving, record, rng, relative=kind != "interaction")
    return Conditions(record.tried, tuple(record.failures.values()))


def _in_a_run(scene: Scene, count: int, seed: int) -> Iterator[tuple[float, Overlap | None]]:
    """Yield times of a run, in whose interval the fastest flies a diameter, and the deepest overlap then."""
    sim = Simulation(scene, seed=seed)
    fastest = max(float(np.abs(sim.frame().velocities).max()), driven_speed_of(scene))
    yield 0.0, deepest(sim._state, present(sim._state))
    for _ in sim.sample(every=scene.diameter / fastest, count=count - 1) if fastest > 0.0 else ():
        yield sim.time, deepest(sim._state, present(sim._state))


def _check_scene(scene: Scene, count: int, seed: int, frames: Iterable[Frame] | None) -> Conditions:
    """Look for overlaps in frames of a scene, or at ``count`` times of a run."""
    record = Record()
    for time, found in in_frames(scene, frames) if frames is not None else _in_a_run(scene, count, seed):
        who = {} if found is None else {"time": time, "who": str(found), "depth": found.depth}
        record.note("overlap", scene.dimension, found is None, **who)
    return Conditions(record.tried, tuple(record.failures.values()))


def _settings(
    value: Any, flight: Any, dimensions: tuple[int, ...], seed: int, skip: bool
) -> list[tuple[Particles, Setting, np.random.Generator]]:
    """Return components, how they move, and a generator, for each dimension in which a value can be.

    ``model`` may ask for more axes. ``skip`` leaves out dimensions of which curves do not fill all axes.
    """
    found, why = [], None
    for d in dimensions:
        rng = np.random.default_rng([seed, d])
        some = _some(rng, d)
        try:
            value.model(some)
            moving = _setting(flight, some)
        except IndexError as error:
            why = error
            continue
        if moving is None or (skip and moving.curved and not _fills(moving)):
            continue
        found.append((some, moving, rng))
    if not found and why is not None:
        raise why
    return found


def _fills(moving: Setting) -> bool:
    """Tell whether ``carry`` of a curved motion fills all coordinates."""
    x = 0.5 * moving.box + np.linspace(0.1, 0.9, moving.dimension) * moving.size
    places, speeds = moving.moved(x[None], np.full((1, moving.dimension), moving.speed), 0.5)
    return bool(np.isfinite(places).all() and np.isfinite(speeds).all())


def _setting(flight: Any, some: Particles) -> Setting | None:
    """Return how components move in a motion, or None where it has not so many axes."""
    d = len(some.box)
    model = model_checks.made(flight, some) if model_checks.is_own(flight) else flight.model(some)
    model_checks.answered("motion", model)
    if not has_axis(model, d - 1) or (model_checks.answers("meeting_time", model) and d < 2):
        return None
    return Setting(
        some,
        (True,) * d,
        model,
        straight=getattr(flight, "straight", True),
        curved=model_checks.answers("meeting_time", model),
        growth=GROWTH,
        masses_known=False,
    )


def _check_interaction(
    value: Any, some: Particles, moving: Setting, pairs: int, rng: np.random.Generator, record: Record
) -> None:
    own_model = model_checks.is_own(value)
    # Diameters grow in scenes of Carom's cores only.
    particles = Particles(**{**vars(some), "rates": None}) if own_model else some
    model_checks.checked("interaction", value)
    model = model_checks.made(value, particles) if own_model else value.model(particles)
    model_checks.answered("interaction", model)
    if own_model:
        refuse_without_steps(value, model)
        refuse_short(model, COMPONENTS, probes.outermost(value, particles, 0, COMPONENTS - 1))
    # A contact matrix of Carom's cores is checked by the scene.
    far = 2.0 * float(some.radii.max())
    contact_range = (
        model_checks.contact_range_of(value, _scene(some)) if own_model or hasattr(value, "steps") else far
    )
    trial = PairTrial(value, copied(model), moving, record, contact_range)
    for _ in range(pairs):
        i, j = (int(k) for k in rng.choice(COMPONENTS, 2, replace=False))
        trial.of(rng, i, j)
    if own_model and moving.free:
        _check_reach(value, model, some, contact_range, record)


def _check_reach(value: Any, model: Any, some: Particles, contact_range: float, record: Record) -> None:
    """Try that no two of the components act on each other beyond the reach of ``value``."""
    radii = some.radii if getattr(value, "by_radii", False) else np.full(COMPONENTS, 0.5 * contact_range)
    for i, j in itertools.combinations(range(COMPONENTS), 2):
        both = float(radii[i] + radii[j])
        step = probes.outermost(value, some, i, j)
        found = probes.contact_distance(model, i, j, contact_range, step=step)
        record.note(
            "reach",
            len(some.box),
            found <= both * (1.0 + TOLERANCE),
            i=i,
            j=j,
            distance=found,
            contact_range=both,
        )


def _check_motion(
    value: Any, some: Particles, moving: Setting, pairs: int, rng: np.random.Generator, record: Record
) -> None:
    # On curves two cores show whether meeting_time is right: half of them grow.
    size, rest = np.full(COMPONENTS, 0.15 * moving.size), np.zeros(COMPONENTS)
    growing = rng.uniform(0.0, 0.5, COMPONENTS) * moving.growth * moving.speed
    trials = [
        PairTrial(
            Growing(),
            Growing().model(Particles(**{**vars(some), "radii": size, "rates": rates})),
            moving,
            record,
            0.3 * moving.size,
        )
        for rates in (rest, growing)
    ]
    for k in range(pairs):
        try_flight(moving, record, rng)
        if moving.curved:
            i, j = (int(each) for each in rng.choice(COMPONENTS, 2, replace=False))
            trials[k % 2].of(rng, i, j)


def _check_impact(
    value: Any, some: Particles, moving: Setting, pairs: int, rng: np.random.Generator, record: Record
) -> None:
    model = model_checks.made(value, some) if model_checks.is_own(value) else value.model(some)
    if model is None:
        return
    model_checks.answered("impact", model)
    model = copied(model)
    for _ in range(pairs):
        i, j = (int(k) for k in rng.choice(COMPONENTS, 2, replace=False))
        try_impact(model, value, moving, record, rng, i, j)


def _check_drive(
    value: Any, some: Particles, moving: Setting, pairs: int, rng: np.random.Generator, record: Record
) -> None:
    model = model_checks.answered("drive", copied(model_checks.made(value, some)))
    for _ in range(pairs):
        try_drive(model, moving, record, rng, int(rng.integers(COMPONENTS)))


def _check_observer(
    value: Any, some: Particles, moving: Setting, pairs: int, rng: np.random.Generator, record: Record
) -> None:
    scene = _scene(some)
    try_events(value.model(some), scene, some.radii, 1)
    record.note("told", scene.dimension, True)


_TRIED = {
    "interaction": _check_interaction,
    "motion": _check_motion,
    "impact": _check_impact,
    "drive": _check_drive,
    "observer": _check_observer,
}

_OWN = {MOTION: "motion", IMPACT: "impact", DRIVE: "drive", OBSERVER: "observer"}
"""What kinds of models of one's own are, apart from those that a method tells."""


def _check_obstacle(
    value: Any, flight: Any, dimensions: tuple[int, ...], pairs: int, seed: int, record: Record
) -> None:
    """Try an obstacle in those dimensions in which it fits a box."""
    why: Exception | None = None
    for d in dimensions:
        rng = np.random.default_rng([seed, d])
        try:
            found = _near(value, d, rng)
        except (InputError, ArithmeticError, IndexError, TypeError, ValueError) as error:
            why = error
            continue
        if found is None:
            continue
        some, periodic, places = found
        moving = _setting(flight, some)
        if moving is None:
            continue
        setting = Setting(some, periodic, moving.motion, moving.straight, moving.curved, float(some.radii[0]))
        trial = ObstacleTrial(value, setting, record)
        for start in itertools.islice(trial.starts(rng, places, np.resize(some.radii, len(places))), pairs):
            trial.of(*start)
    if not record.tried and why is not None:
        raise InputError(f"{value.name} fits no box of {_listed(dimensions)} dimensions: {why}") from why
    if not record.tried:
        raise InputError(
            f"No component near {value.name} and outside of it was found: let gap return the distance of "
            "each component's surface from the obstacle."
        )


def _near(
    value: Any, d: int, rng: np.random.Generator
) -> tuple[Particles, tuple[bool, ...], np.ndarray] | None:
    """Return small components, which axes of their box are periodic, and places near an obstacle."""
    reason: InputError | None = None
    for scale in SCALES.tolist():
        box = (4.0 * scale,) * d
        for periodic in itertools.product((False, True), repeat=d):
            try:
                value.check(box, periodic)
                break
            except InputError as error:
                reason = error
        else:
            continue
        places = rng.uniform(0.0, 2.0 * scale, (4096, d))
        radii = rng.uniform(0.01, 0.05, COMPONENTS) * scale
        gaps = np.asarray(value.gap(places, np.resize(radii, len(places)), box, periodic), np.float64)
        close = places[(gaps > 0.0) & (gaps < scale)]
        if len(close) > 0.01 * len(places):
            some = _some(rng, d)
            return Particles(**{**vars(some), "box": box, "radii": radii, "rates": None}), periodic, close
    if reason is not None:
        raise reason
    return None


def _listed(dimensions: tuple[int, ...]) -> str:
    return " or ".join(map(str, dimensions))


def _kind(value: Any) -> str:
    """Return which of the six a value is, by its methods and the questions that its model answers."""
    known = kind_of(value)
    if known in _OWN:
        return _OWN[known]
    if known is PATH:
        raise InputError(
            f"{type(value).__name__} is a path: check the obstacle that moves along it, Shaken(...)."
        )
    if isinstance(value, type) or not callable(getattr(value, "model", None)):
        raise InputError(
            "check() needs the value of an interaction, a motion, an impact, a drive or an obstacle, found "
            + (f"the class {value.__name__}." if isinstance(value, type) else _without_model(value))
        )
    if isinstance(value, Obstacle):
        return "obstacle"
    if callable(getattr(value, "gap", None)):
        missing = next(name for name in ("name", "check") if not hasattr(value, name))
        raise InputError(
            f"{type(value).__name__} is an obstacle, as it has gap, and {model_checks.lacks(value, missing)}."
        )
    if callable(getattr(value, "reach", None)):
        return "interaction"
    with in_plain_python(value):
        model = value.model(_some(np.random.default_rng(0), 2))
    for question in (*model_checks.REQUIRED["interaction"], *model_checks.STEPPED):
        if model_checks.answers(question, model):
            raise InputError(
                f"{type(value).__name__} is an interaction, as its model answers {question}, and "
                f"{model_checks.lacks(value, 'reach')}(scene): the largest distance at which two act on each "
                "other."
            )
    for kind in ("motion", "drive"):
        if any(model_checks.answers(question, model) for question in model_checks.REQUIRED[kind]):
            return kind
    return "impact"


def _without_model(value: Any) -> str:
    return f"{checks.describe(value)}, which {model_checks.lacks(value, 'model')}."


def _some(rng: np.random.Generator, d: int) -> Particles:
    """Return eight different components of two species."""
    return Particles(
        box=(EDGE,) * d,
        radii=rng.uniform(0.3, 0.7, COMPONENTS),
        masses=rng.uniform(0.3, 3.0, COMPONENTS),
        species=np.arange(COMPONENTS) % 2,
        rates=rng.uniform(0.0, 0.05, COMPONENTS),
        equal=False,
        unit=TimeUnit(),
    )


def _scene(some: Particles) -> Scene:
    """Return a scene of components in a row."""
    places = np.zeros((COMPONENTS, len(some.box)))
    places[:, 0] = 2.5 * np.arange(COMPONENTS)
    return Scene(places, some.box, diameter=2.0 * some.radii, mass=some.masses, species=some.species)
