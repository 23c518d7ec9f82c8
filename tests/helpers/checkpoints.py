"""Checkpoints with any number in the place of another, each refused in a sentence, or run; `python -m
helpers.checkpoints NAME...` tries all, in forks of a process that has compiled everything.
"""

import json
import os
import resource
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import carom
from carom.errors import CaromError
from carom.io import checkpoint
from carom.models import Kind, Ranges, draw
from carom.models.contacts.losses import Loss
from carom.models.motions.gravity import Gravity
from carom.models.motions.great_circles import GreatCircles
from carom.models.obstacles.paths import Sine
from carom.models.obstacles.planes import Plane
from carom.observables import HelfandCurrents
from helpers.mixtures import mixture

SECONDS = 20
"""Time of the processor for one of them; each takes some milliseconds."""

MEMORY = 6 << 30
"""Bytes for one of them: what asks for more is refused."""


def turning(unit, event):
    """A rule that turns, changes kind and aims."""
    unit.target = event.other
    if draw(unit) < 0.2:
        unit.kind = 1 - unit.kind
    unit.timer = 0.3 + draw(unit)


def _units():
    rng = np.random.default_rng(1)
    kinds = [Kind("a", (2.0, 3.0), 0.5, (1.0,)), Kind("b", (2.5,), 0.0, (0.0,))]
    return carom.Scene(
        rng.uniform(0.0, 11.0, (30, 2)), (11.0, 11.0), velocities=rng.normal(size=(30, 2)),
        species=np.arange(30) % 2, diameter=0.1, interaction=Ranges(kinds, turning),
    )  # fmt: skip


def _bed():
    places = [(1.0 + 1.6 * (k % 5), 2.0 + 1.6 * (k // 5)) for k in range(6)]
    loss = Loss(0.9, contact_time=1e-3)
    floor = Plane((0.0, 1.0), 0.5, "floor", shake=Sine(0.3, 2.0), impact=loss)
    return carom.Scene(
        np.array(places), (8.5, 12.0), velocities=np.random.default_rng(1).normal(size=(6, 2)),
        walls="y", motion=Gravity((0.0, -1.0)), obstacles=[floor], impact=loss,
    )  # fmt: skip


def _column():
    places = [(0.5 + 0.9 * (k % 10), 0.5 + 0.4 * (k // 10)) for k in range(20)]
    return carom.Scene(
        np.array(places), (10.0, 400.0), diameter=1e-2, walls="y", motion=Gravity((0.0, -0.5)),
        obstacles=[Plane((0.0, 1.0), 0.25, "floor", kT=2.0, seed=3)],
    )  # fmt: skip


def _caps():
    points = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return carom.Scene(4.0 + points, box=(8.0,) * 3, diameter=0.4, motion=GreatCircles())


def _fluid(n=80, d=2, eta=0.3, **more):
    return carom.Scene.random(n, eta, d, seed=1, **more)


def _mixture(**more):
    return mixture([30, 30], diameters=[1.0, 0.5], dimension=2, packing_fraction=0.4, seed=1, **more)


WELL = carom.models.SquareWell(1.5, 1.0)

SCENES: dict[str, Any] = {
    "disks": lambda: (_fluid(), {}),
    "disks in lists": lambda: (_fluid(), {"tuning": carom.Tuning(neighbors="lists")}),
    "spheres": lambda: (carom.Scene.crystal(cells=4, packing_fraction=0.4), {}),
    "a small box": lambda: (carom.Scene.random(4, dimension=2, box=3.0, seed=1), {}),
    "a gas": lambda: (_fluid(6, 3, 1e-4), {}),
    "a mixture": lambda: (_mixture(), {"tuning": carom.Tuning(neighbors="lists")}),
    "growing": lambda: (_mixture(), {"tuning": carom.Tuning(neighbors="lists"), "growth": 1e-3}),
    "wells": lambda: (carom.Scene.crystal(cells=3, density=0.4).replace(interaction=WELL), {}),
    "lossy": lambda: (_fluid(walls="y").replace(impact=0.9), {}),
    "pinned": lambda: (_fluid().replace(pinned=np.arange(5)), {}),
    "currents": lambda: (_mixture(), {"observers": [HelfandCurrents()]}),
    "single": lambda: (_fluid(), {"tuning": carom.Tuning(precision="single")}),
    "units": lambda: (_units(), {}),
    "a bed": lambda: (_bed(), {}),
    "a column": lambda: (_column(), {}),
    "caps": lambda: (_caps(), {}),
}


def saved(name: str, path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Save a run of this name; return what the file holds."""
    scene, settings = SCENES[name]()
    sim = carom.Simulation(scene, **({} if scene.velocities is not None else {"seed": 1}), **settings)
    sim.run(time=3.0)
    sim.save(path)
    return checkpoint.load(path)


def used(path: Path, own: dict[str, Any]) -> None:
    """Load a checkpoint and go on with it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sim = carom.Simulation.load(path, **own)
        sim.run(time=1.0, collisions=3000, walltime=3.0)
        sim.frame()


INTEGERS = (-(2**62), -(2**30), -1, 0, 1, 7, 2**15, 2**30, 2**62)
REALS = (np.nan, np.inf, -np.inf, -1.0, 0.0, 1.0, 1e300, -1e300)
LEAVES = (
    None,
    -1,
    0,
    1,
    2**30,
    2**62,
    10**30,
    1e300,
    -1e300,
    float("nan"),
    float("inf"),
    "x",
    "",
    [],
    {},
    True,
)


def arrays_changed(arrays: dict[str, np.ndarray]) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Yield the arrays with one of them changed, in all its places, the first or one in the middle."""
    for name, array in arrays.items():
        if array.size == 0 or array.dtype.kind not in "iufb":
            continue
        kind = array.dtype
        if kind.kind == "f":
            values = REALS
        elif kind.kind == "b":
            values = (0, 1)
        else:
            limits = np.iinfo(kind)
            values = sorted({*(v for v in INTEGERS if limits.min <= v <= limits.max), limits.min, limits.max})
        for value in values:
            for place in (slice(None), 0, array.size // 2):
                changed = array.copy()
                with np.errstate(over="ignore"):
                    changed.reshape(-1)[place] = value
                if changed.tobytes() != array.tobytes():
                    yield f"{name}[{place}] = {value}", {**arrays, name: changed}
        yield f"{name} reversed", {**arrays, name: np.ascontiguousarray(array[::-1])}
        yield f"{name} missing", {key: other for key, other in arrays.items() if key != name}
        yield f"{name} longer", {**arrays, name: np.concatenate([array, array])}


def attributes_changed(attributes: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the attributes with one value changed, at any depth."""
    for key, value in attributes.items():
        inner = None
        if isinstance(value, str):
            try:
                inner = json.loads(value)
            except ValueError:
                inner = None
        if isinstance(inner, dict | list):
            for what, changed in _leaves(inner):
                yield f"{key}{what}", {**attributes, key: json.dumps(changed)}
        for other in LEAVES:
            yield f"{key} = {other!r}", {**attributes, key: other}
        yield f"{key} missing", {name: each for name, each in attributes.items() if name != key}


def _leaves(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield copies of a value of JSON with one leaf changed."""
    if isinstance(value, dict):
        for key, part in value.items():
            yield f".{key} missing", {name: each for name, each in value.items() if name != key}
            for what, changed in _leaves(part):
                yield f".{key}{what}", {**value, key: changed}
    elif isinstance(value, list) and value:
        for k, part in enumerate(value):
            for what, changed in _leaves(part):
                yield f"[{k}]{what}", [*value[:k], changed, *value[k + 1 :]]
    for other in LEAVES:
        yield f" = {other!r}", other


def outcome(path: Path, own: dict[str, Any]) -> str:
    """Return what became of a checkpoint: "refused", "ran", or what went wrong."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        # The engine is deaf to what Python would do, and the machine may be busy with others.
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        try:
            used(path, own)
            said = "ran"
        except CaromError as error:
            said = "refused" if "\n" not in str(error) else f"a page: {error}"
        except BaseException as error:
            said = f"{type(error).__name__}: {error}"
        os.write(write, said.encode()[:2000])
        os._exit(0)
    os.close(write)
    said = os.read(read, 4000).decode(errors="replace")
    os.close(read)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return f"signal {signal.Signals(os.WTERMSIG(status)).name}"
    return said or "nothing was said"


def faults(name: str, *, every: int = 1, only: str = "") -> list[str]:
    """Return what went wrong with the checkpoints of a scene; ``every`` so many is tried."""
    found = []
    own: dict[str, Any] = {"interaction": SCENES[name]()[0].interaction} if name == "units" else {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "state.h5"
        arrays, attributes = saved(name, path)
        used(path, own)  # so that all is compiled
        cases = [(what, changed, attributes) for what, changed in arrays_changed(arrays)]
        cases += [(what, arrays, changed) for what, changed in attributes_changed(attributes)]
        counts: dict[str, int] = {}
        for what, *content in cases[::every]:
            if only and only not in what:
                continue
            checkpoint.save(path, *content)
            said = outcome(path, own)
            counts[said] = counts.get(said, 0) + 1
            if said not in ("ran", "refused"):
                found.append(f"{what}: {said}")
                print(f"{name}: {what}: {said}", flush=True)
    print(name, {said: count for said, count in counts.items() if said in ("ran", "refused")}, len(found))
    return found


if __name__ == "__main__":
    begin = time.time()
    for each in sys.argv[1:] or SCENES:
        faults(each)
        print(f"{time.time() - begin:.0f} s", flush=True)
