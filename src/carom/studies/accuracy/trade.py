"""``carom trade``: speed against accuracy, measured on the user's machine and scene."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from carom.errors import FileError, InputError
from carom.observables.statistics import Estimate
from carom.paths import replacing, writing
from carom.scene import lattices
from carom.scene.fields import is_simple
from carom.scene.scene import Scene
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import SceneSpec
from carom.simulation.simulation import Simulation
from carom.simulation.tuning import Tuning
from carom.studies.accuracy.measures import (
    SAMPLES,
    Faithfulness,
    Measured,
    Track,
    expected_pressure,
    faithfulness,
    measured,
    reversal,
    speed,
    true_track,
)
from carom.studies.accuracy.methods import Method, engine, naive, oracle, pseudo_hard, stepping
from carom.studies.accuracy.picture import picture
from carom.studies.accuracy.rows import Horizon, Row, TradeResult
from carom.studies.accuracy.statistics import sampling, sizes
from carom.studies.places import refuse_others

SMALL = 64
"""Largest number of particles that the 50-digit oracle follows."""

STARTS = 3
"""Small scenes to follow. One is not enough: a grazing collision may end its trajectory early by chance."""

STEPS = (1e-1, 1e-2, 1e-3, 1e-4)
"""Steps of the time-driven method [mean free times]."""

VERLET = (5e-4, 1e-3, 2e-3)
"""Steps of pseudo hard spheres [sigma sqrt(m / epsilon)]: at 4e-3 their energy diverges."""

BACK = (5, 10, 20)
"""Collisions per particle forward, and as many back."""

FILES = ("trade.csv", "sizes.csv", "sampling.csv", "trade.json", "trade.png")

LYAPUNOV = {
    (2, 0.3): (2.377, 1.6201),
    (2, 0.7): (5.13, 9.2062),
    (3, 0.5): (5.627, 7.6244),
}
"""Largest Lyapunov exponent and collision rate of a particle by (d, density), at N = 64 and kT = 1, to 0.7 %.
From tangent-space dynamics after Dellago, Posch and Hoover, Phys. Rev. E 53, 1485 (1996). There 2 K / (d N)
is 1; with kT = 2 K / (d (N - 1)) all rates are smaller by sqrt(63 / 64).
"""


def methods(mean_free_time: float, dimension: int = 3) -> list[Method]:
    """Return the methods to compare, one per row of the table."""
    from carom.opponents.lammps import available

    return [
        engine("float64"),
        engine("float32", precision="single"),
        oracle(50),
        naive(),
        *(stepping(fraction, mean_free_time) for fraction in STEPS),
        *(stepping(fraction, mean_free_time, single=True) for fraction in STEPS[:2]),
        *(pseudo_hard(step, mean_free_time) for step in VERLET),
        *(
            pseudo_hard(step, mean_free_time, lammps=True)
            for step in VERLET
            if dimension == 3 and available()
        ),
    ]


def default_plan() -> SceneFile:
    """Return the plan of ``carom trade`` without a scene file: 2048 spheres at density 0.5."""
    return dataclasses.replace(SceneFile(), scene=SceneSpec(lattice="fcc", cells=8, density=0.5))


def trade(
    plan: SceneFile | None = None,
    out: str | PathLike[str] = "carom-trade",
    *,
    seconds: float = 8.0,
    overwrite: bool = False,
    progress: Callable[[str, float], object] | None = None,
) -> TradeResult:
    """Measure speed against accuracy, and write a table, a picture and the numbers to a folder.

    Parameters
    ----------
    plan : SceneFile, optional
        Only its scene and its seed are used. The scene must be equal spheres in a periodic box.
    out : path
        The folder; made if needed.
    seconds : float
        CPU seconds for the statistics of each row; the whole comparison takes some forty times as long, and a
        minute more.
    overwrite : bool
        Whether files of an earlier comparison may be replaced.
    progress : callable, optional
        Called as ``progress(stage, fraction)``.

    Returns
    -------
    TradeResult

    Raises
    ------
    InputError
        If the scene is not one of equal spheres in a periodic box.
    FileError
        If the folder cannot be written, or holds a comparison already.
    """
    from carom import checks

    checks.number(seconds, "seconds", low=0.0, open_low=True)
    plan = default_plan() if plan is None else plan
    report = (lambda stage, fraction: None) if progress is None else progress
    folder = _folder(Path(out), overwrite)
    report("Preparing", 0.0)
    scene, _ = melted(simple_scene(plan.build_scene()), plan.run.seed)
    followed_from = [melted(small_scene(scene), plan.run.seed + k) for k in range(STARTS)]
    small, mean_free_time = followed_from[0]
    followed = methods(mean_free_time, scene.dimension)
    exact = next(method for method in followed if method.many_digits)
    followings = []
    for k, (start, _) in enumerate(followed_from):
        track = true_track(
            start,
            exact,
            mean_free_time,
            _reach(seconds),
            lambda fraction, k=k: report("Oracle", (k + fraction) / STARTS),  # type: ignore[misc]
        )
        followings.append((start, track))
    rows: list[Row] = []
    rights: dict[int, tuple[float, Estimate]] = {}
    for k, method in enumerate(followed):
        report(method.name, k / len(followed))
        where = scene if method.fast else small
        found = measured(where, method, mean_free_time, seconds)
        if where.n not in rights:
            # The engine is the first method. Slow ones are compared with its D on the small scene.
            right = found if method.fast else measured(small, followed[0], mean_free_time, seconds)
            z = expected_pressure(where)  # without a theory, the engine's own Z
            own = right.pressure.Z.mean
            rights[where.n] = (own if z is None else z), right.diffusion
        rows.append(_row(method, where, found, followings, mean_free_time, seconds, *rights[where.n]))
    by_size = sizes(
        scene.dimension, scene.packing_fraction, plan.run.seed, 0.5 * seconds, lambda f: report("Sizes", f)
    )
    by_interval = sampling(
        _medium(scene), mean_free_time, plan.run.seed, round(250 * seconds), lambda f: report("Sampling", f)
    )
    result = TradeResult(folder, repr(scene), repr(small), rows, _horizon(followings), by_size, by_interval)
    _write(folder, result)
    with replacing(folder / "trade.png") as temporary:
        picture(result, path=temporary)
    report("Done", 1.0)
    return result


def _reach(seconds: float) -> float:
    """Return the collisions per particle of the oracle's trajectory: with 8 s, the horizon of doubles."""
    return min(max(7.5 * seconds, 12.0), 60.0)


def _row(
    method: Method,
    where: Scene,
    found: Measured,
    followings: list[tuple[Scene, Track]],
    mean_free_time: float,
    seconds: float,
    z: float,
    diffusion: Estimate,
) -> Row:
    """Return the figures of a method; ``z`` and ``diffusion`` are the reference values."""
    small, track = followings[0]
    rate, moving = speed(where, method, SAMPLES * mean_free_time, 0.25 * seconds)
    # The oracle would only be compared with itself.
    follows = Faithfulness()
    if not method.many_digits:
        follows = median([faithfulness(start, method, true) for start, true in followings])
    longest = 0.5 * 2.0 * float(track.collisions[-1]) / small.n
    back = [
        reversal(small, method, count * mean_free_time) if count <= longest else math.nan for count in BACK
    ]
    overlap, energy, momentum = found.motion.faults()
    collisions = found.motion.tally()[1]
    mine, own = found.pressure.Z, found.diffusion
    # g(sigma+) is proportional to Z - 1.
    count = mine if method.kind == "pseudo-hard" else found.pressure.Z_from_rate
    contact = count.scaled(1.0 / (z - 1.0), offset=-1.0 / (z - 1.0))
    return Row(
        method=method.name,
        algorithm=method.kind,
        n_speed=where.n,
        collisions_per_second=rate,
        bytes_per_particle=moving.bytes_per_particle(),
        worst_overlap=overlap,
        energy_drift=energy * 1e6 / collisions,
        momentum_drift=momentum * 1e6 / collisions,
        horizon_order=follows.order,
        horizon_position=follows.position,
        error_1=follows.error,
        back_5=back[0],
        back_10=back[1],
        back_20=back[2],
        z_bias=mine.mean / z - 1.0,
        z_error=mine.error / z,
        contact_bias=contact.mean - 1.0,
        contact_error=contact.error,
        diffusion=own.mean,
        diffusion_bias=own.mean / diffusion.mean - 1.0,
        diffusion_error=math.hypot(own.relative_error, 0.0 if own is diffusion else diffusion.relative_error),
        z_cost=mine.relative_error * math.sqrt(found.seconds),
        diffusion_cost=own.relative_error * math.sqrt(found.seconds),
    )


def melted(scene: Scene, seed: int) -> tuple[Scene, float]:
    """Return the scene in motion, after 200 collisions per particle, and its mean free time."""
    sim = Simulation(scene, seed=seed, tuning=Tuning(images=False))
    if scene.n < 2:
        raise InputError("A scene of one particle has nothing to compare; take more.")
    sim.run(collisions_per_particle=100)
    start, before = sim.time, sim.collisions
    sim.run(collisions_per_particle=100)
    frame = sim.frame()
    moving = scene.replace(positions=frame.positions, velocities=frame.velocities)
    return moving, (sim.time - start) * scene.n / (2 * (sim.collisions - before))


def small_scene(scene: Scene) -> Scene:
    """Return a scene of the same density that the oracle can follow: the scene itself, if it is small."""
    if scene.n <= SMALL:
        return scene.replace(velocities=None)
    d, eta = scene.dimension, scene.packing_fraction
    for lattice in (lattices.cubic(d), lattices.densest(d)):
        cells = 1
        while lattice.count(lattices.cells_along(lattice, cells + 1)) <= SMALL:
            cells += 1
        if eta < 0.95 * lattice.limit:
            return Scene.crystal(
                lattice=lattice, cells=cells, packing_fraction=eta, diameter=scene.diameter, mass=scene.mass
            )
    raise InputError(
        f"A packing fraction of {eta:.6g} is too near close packing for the oracle's small scene; lower it."
    )


def _medium(scene: Scene) -> Scene:
    """Return a scene of the same density with about 500 particles, for g(r)."""
    lattice = lattices.densest(scene.dimension)
    cells = max(2, round((500 / len(lattice.basis) * math.prod(lattice.shape)) ** (1.0 / scene.dimension)))
    return Scene.crystal(
        cells=cells,
        dimension=scene.dimension,
        packing_fraction=scene.packing_fraction,
        diameter=scene.diameter,
        mass=scene.mass,
    )


def simple_scene(scene: Scene) -> Scene:
    """Return the scene, or raise InputError if the reference algorithms cannot move it."""
    if not is_simple(scene):
        raise InputError(
            "carom trade compares elastic, equal spheres in a periodic box, and this scene has more; leave "
            "out walls, obstacles, losses, pinned components, interactions and motions."
        )
    return scene


def median(found: list[Faithfulness]) -> Faithfulness:
    """Return the median of each of the figures."""
    middle = np.median([dataclasses.astuple(one) for one in found], axis=0)
    return Faithfulness(*(float(x) for x in middle))


def _horizon(followings: list[tuple[Scene, Track]]) -> Horizon:
    """Return the horizon of doubles by the mean Lyapunov exponent of the oracle's trajectories."""
    eps = float(np.finfo(float).eps)
    small, track = followings[0]
    density = small.n / math.prod(edge / small.diameter for edge in small.box)
    published = next(
        (
            -math.log(eps) / exponent * rate
            for (d, rho), (exponent, rate) in LYAPUNOV.items()
            if d == small.dimension and abs(density / rho - 1.0) < 0.01
        ),
        math.nan,
    )
    lyapunov = float(np.mean([each.lyapunov for _, each in followings]))
    rate = float(np.mean([each.rate for _, each in followings]))
    return Horizon(
        lyapunov=lyapunov,
        rate=rate,
        to_one=-math.log(eps) / lyapunov * rate,
        to_apart=math.log(1e-3 / eps) / lyapunov * rate,
        published_to_one=published,
        followed=2.0 * float(track.collisions[-1]) / small.n,
    )


def _folder(path: Path, overwrite: bool) -> Path:
    """Make the folder, and refuse one that holds a comparison."""
    refuse_others(path, "a comparison")
    with writing(path):
        path.mkdir(parents=True, exist_ok=True)
        found = [name for name in FILES if (path / name).exists()]
    if found and not overwrite:
        raise FileError(
            f"{path} holds a comparison already ({found[0]}); choose another folder with --out, "
            "or replace it with --overwrite."
        )
    return path


def _write(folder: Path, result: TradeResult) -> None:
    tables: dict[str, list[Any]] = {
        "trade.csv": result.rows,
        "sizes.csv": result.sizes,
        "sampling.csv": result.sampling,
    }
    for name, rows in tables.items():
        lines = [[field.name for field in dataclasses.fields(rows[0])]]
        for row in rows:
            values = dataclasses.astuple(row)
            lines.append([format(v, ".6g") if isinstance(v, float) else str(v) for v in values])
        with replacing(folder / name) as temporary, writing(folder / name):
            table = io.StringIO()
            csv.writer(table, lineterminator="\n").writerows(lines)  # quotes names with commas
            temporary.write_text(table.getvalue(), encoding="utf-8")
    facts = {
        "scene": result.scene,
        "small": result.small,
        "horizon": {
            name: value if math.isfinite(value) else None
            for name, value in dataclasses.asdict(result.horizon).items()
        },
    }
    with replacing(folder / "trade.json") as temporary, writing(folder / "trade.json"):
        temporary.write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
