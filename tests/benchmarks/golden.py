"""Hashes of what runs come to, of every kind of scene in the tests: ``python golden.py take FILE [WORDS]``.

Before a change of the code that is to change no bit, ``take`` writes the hashes of final states, tallies,
event logs and the values in checkpoints. After it, ``compare`` runs the same scenes and names what differs.
Every run is cut in the middle by a checkpoint, and both go on. Names and layout of the arrays in a checkpoint
are free: what counts is their values. With WORDS, only scenes whose name holds one of them are run. Several
processes share the work by ``--part K/N``.
"""

import argparse
import hashlib
import json
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import carom
from carom.errors import CaromError
from carom.io.events import read_events

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers import checkpoints, oracle_scenes, oracle_sums

from carom.simulation.measuring import stretches

SCHEMES = ("sectors", "lists", "all")


def scenes() -> Iterator[tuple[str, Callable[[], tuple[carom.Scene, dict[str, Any]]]]]:
    """Yield names and makers of a scene with the arguments of its simulation."""
    for k, (name, (make, d)) in enumerate(oracle_scenes.CASES.items()):
        # Every scheme in the plane, one of them in turn elsewhere.
        for scheme in SCHEMES if d == 2 else (SCHEMES[k % len(SCHEMES)],):
            yield f"{name} {scheme}", lambda make=make, d=d, scheme=scheme: _of_case(make(d), scheme)
    for name, make in oracle_sums.KINDS.items():
        yield f"sums {name}", lambda make=make: _of_case(make(), None)
    for name, make in checkpoints.SCENES.items():
        yield f"checkpoint {name}", make
    for d, eta in ((1, 0.4), (2, 0.05), (2, 0.7), (3, 0.05), (3, 0.3), (3, 0.49), (4, 0.1)):
        yield f"fluid {d} {eta}", lambda d=d, eta=eta: (_fluid(d, eta), {})
    for d, eta, n in ((2, 0.7, 6000), (3, 0.3, 6912), (3, 0.05, 6912)):
        for workers in (1, 2):
            yield (
                f"workers {workers} {d} {eta}",
                lambda d=d, eta=eta, n=n, workers=workers: (_fluid(d, eta, n), {"cores": workers}),
            )


def _fluid(d, eta, n=500):
    if d == 3 and eta > 0.4:
        return carom.Scene.crystal(cells=5, packing_fraction=eta)
    return carom.Scene.random(n, eta, d, seed=1)


def _of_case(case, scheme):
    return case.scene, {
        **case.settings,
        **({} if scheme is None else {"tuning": carom.Tuning(neighbors=scheme)}),
    }


def _digest(*values: Any) -> str:
    found = hashlib.sha256()
    for value in values:
        found.update(value.tobytes() if isinstance(value, np.ndarray) else repr(value).encode())
    return found.hexdigest()[:16]


def _state(sim: carom.Simulation) -> dict[str, str]:
    frame, tally, done = sim.frame(), stretches.tally(sim), sim.statistics
    return {
        "state": _digest(frame.positions, frame.velocities, frame.unwrapped, float(sim.time)),
        "tally": _digest(
            tally.collisions, tally.virial, tally.kT_time, tally.duration,
            [(each.hits, each.impulse, each.work) for each in sim.obstacles],
            done.transits, done.advancements, done.clamped_roots, done.worst_overlap,
        ),
    }  # fmt: skip


def _values(path: Path) -> list[str]:
    """Return the hashes of the arrays of numbers in a checkpoint, sorted."""
    with h5py.File(path) as file:
        return sorted(_digest(item[()]) for item in file["arrays"].values())


def hashes(scene: carom.Scene, settings: dict[str, Any]) -> dict[str, Any]:
    """Return the hashes of a run of 12 collisions a component, and of the same resumed in the middle."""
    own = {"interaction": scene.interaction} if type(scene.interaction).__name__ == "Ranges" else {}
    steps = 6 * scene.n
    with tempfile.TemporaryDirectory() as folder:
        log, path = Path(folder) / "events.h5", Path(folder) / "state.h5"
        seeded = {} if scene.velocities is not None else {"seed": 2}
        plain = not own and not settings.keys() & {"observers", "growth"}
        with carom.Simulation(scene, **seeded, **settings, **({"event_log": log} if plain else {})) as sim:
            sim.run(collisions=steps, time=1e3)
            sim.save(path)
            found = {"checkpoint": _values(path)}
            again = carom.Simulation.load(path, **own)
            for each in (sim, again):
                each.run(collisions=steps, time=1e3)
            found |= _state(sim)
            if _state(again) != _state(sim):
                found["state"] = "a resumed run came to other bits"
        if plain:
            events = read_events(log)
            found["log"] = _digest(events.i, events.j, events.impulse)
    return found


def main() -> int:
    """Take or compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("take", "compare", "list"))
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("words", nargs="*")
    parser.add_argument("--part", default="0/1", help="K/N: every Nth scene, from the Kth on")
    asked = parser.parse_args()
    part, parts = map(int, asked.part.split("/"))
    known = json.loads(asked.file.read_text()) if asked.what == "compare" else {}
    wrong = 0
    for k, (name, make) in enumerate(scenes()):
        if k % parts != part or (asked.words and not any(word in name for word in asked.words)):
            continue
        if asked.what == "list":
            print(name)
            continue
        try:
            found = hashes(*make())
        except CaromError as error:  # a scheme that cannot hold the scene says so
            found = {"refused": f"{type(error).__name__}: {error}".split(" cannot be loaded")[-1]}
        if asked.what == "take":
            known[name] = found
            asked.file.write_text(json.dumps(known, indent=1))
        elif name in known:
            differ = [
                key for key in known[name].keys() | found.keys() if known[name].get(key) != found.get(key)
            ]
            if differ == ["checkpoint"]:  # arrays may be left out that hold what another holds
                lost = set(known[name]["checkpoint"]) - set(found["checkpoint"])
                new = set(found["checkpoint"]) - set(known[name]["checkpoint"])
                differ = [f"checkpoint: {len(lost)} values are gone, {len(new)} are new"] if lost else []
            wrong += bool(differ)
            print(f"{name}: {', '.join(differ) or 'equal'}", flush=True)
    if asked.what == "compare":
        print(f"{wrong} differ")
    return int(wrong > 0)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")  # compiled code divides by zero without a word
    sys.exit(main())
