"""What holds of every observable: units, symmetries, one pass or several, a list or a file, and refusals."""

import dataclasses
import inspect
import re
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from helpers.frames import write
from helpers.plain import uncompiled

import carom
from carom.errors import FileError, InputError
from carom.frame import Frame
from carom.observables import Estimate
from carom.results import Result
from carom.simulation.measuring import stretches

N, FRAMES, BOX = 24, 12, np.array((7.0, 5.0, 6.0, 5.5))
ARRAYS = ("positions", "velocities", "diameters", "masses", "images", "species")


def frames_of(d, *, walls=False, mixture=False):
    """Return points in free flight, between walls reflected, with doubles that need all digits."""
    rng, box = np.random.default_rng(d), BOX[:d]
    start, velocities = rng.uniform(0.0, box, (N, d)), rng.normal(size=(N, d))
    velocities -= velocities.mean(axis=0)
    kinds = {"species": np.arange(N) % 2, "species_names": ("a", "b")} if mixture else {}
    found = []
    for k in range(FRAMES):
        place, v = start + 0.25 * k * velocities, velocities.copy()
        images = np.floor(place / box).astype(np.int32)
        inside = place - images * box
        if walls:  # along the last axis, as in a mirror
            back = images[:, -1] % 2 == 1
            inside[back, -1], v[back, -1] = box[-1] - inside[back, -1], -v[back, -1]
            images[:, -1] = 0
        periodic = (True,) * (d - 1) + (not walls,)
        found.append(
            Frame(0.25 * k, k, inside, v, tuple(box), np.full(N, 2.0**-40), np.full(N, 1.5), images=images,
                  periodic=periodic, **kinds)
        )  # fmt: skip
    return found


@dataclasses.dataclass(frozen=True)
class Case:
    """An observable of frames, with what it depends on."""

    make: object  # of one unit of length
    dimensions: tuple = (1, 2, 3, 4)
    walls: bool = True  # whether it can do with them
    sheared: str = ""  # why it cannot do with shear
    moves: bool = True  # whether a shift of all particles changes nothing


CASES = {
    "rdf": Case(lambda u=1.0: carom.RDF(bins=6, rmax=2.0 * u), walls=False),
    "g of a pair": Case(lambda u=1.0: carom.RDF(bins=6, rmax=2.0 * u, pair=("a", "b")), walls=False),
    "structure": Case(lambda u=1.0: carom.StructureFactor(shells=3), walls=False),
    "dynamics": Case(lambda u=1.0: carom.Dynamics(shells=2), sheared="grow with the flow"),
    "dynamics of one species": Case(lambda u=1.0: carom.Dynamics(species=1), sheared="grow with the flow"),
    "profile": Case(
        lambda u=1.0: carom.DensityProfile(axis=0, bins=5), sheared="take another axis", moves=False
    ),
    "profile of one species": Case(
        lambda u=1.0: carom.DensityProfile(axis=0, bins=5, species=1),
        sheared="take another axis",
        moves=False,
    ),
    "order": Case(lambda u=1.0: carom.BondOrder(4, nearest=4, rmax=2.0 * u, width=0.5 * u), (2, 3, 4)),
    "order of faces": Case(lambda u=1.0: carom.BondOrder(6, voronoi=True), (2, 3)),
    "order within a reach": Case(lambda u=1.0: carom.BondOrder(6, reach=2.0 * u), (2, 3, 4)),
    "crystal": Case(lambda u=1.0: carom.observables.Crystallinity(), dimensions=(3,)),
}
EACH = [(name, d, False) for name, case in CASES.items() for d in case.dimensions]
EACH += [(name, max(2, min(case.dimensions)), True) for name, case in CASES.items() if case.walls]
each = pytest.mark.parametrize(("name", "d", "walls"), EACH, ids=lambda value: str(value))


def given(name, d, walls=False):
    return CASES[name].make(), frames_of(d, walls=walls, mixture="pair" in name or "species" in name)


def values(found):
    """Return all numbers of a result by name, however deep."""
    if isinstance(found, Estimate):
        return {"": found.mean, "_error": found.error}
    if isinstance(found, dict):
        items = found.items()
    elif is_dataclass(found):
        items = [(each.name, getattr(found, each.name)) for each in fields(found)]
    elif isinstance(found, tuple | list):
        items = enumerate(found)
    else:
        return {"": found} if isinstance(found, int | float | np.ndarray) else {}
    return {f"{name}{below}": x for name, value in items for below, x in values(value).items()}


def assert_equal(found, right, **close):
    mine, its = values(found), values(right)
    assert mine.keys() == its.keys()
    for name in mine:
        if close:
            np.testing.assert_allclose(mine[name], its[name], err_msg=name, **close)
        else:
            np.testing.assert_array_equal(mine[name], its[name], err_msg=name)


def over(observable, frames):
    """Return the result of frames that are added one by one."""
    for frame in frames:
        observable.add(frame)
    return observable.result()


@each
def test_a_list_a_loop_a_file_and_a_folder_give_the_same(name, d, walls, tmp_path):
    observable, frames = given(name, d, walls)
    right = observable.over(frames)
    assert isinstance(right, Result)
    assert np.isfinite(np.concatenate([np.ravel(x) for x in values(right).values()])).mean() > 0.5
    for found in (over(observable.fresh(), frames), observable.over(iter(frames))):
        assert_equal(found, right)
    for suffix in (".h5md", ".xyz", ".gsd")[: 3 if d == 2 else 1]:
        path = tmp_path / suffix[1:] / f"trajectory{suffix}"
        path.parent.mkdir()
        with pytest.warns(carom.errors.CaromWarning) if walls and suffix == ".gsd" else uncompiled():
            write(path, frames)
        single = {"rtol": 1e-3, "atol": 1e-3} if suffix == ".gsd" else {}
        for where in (path, path.parent)[: 1 + (suffix != ".xyz")]:
            assert_equal(observable.over(where), right, **single)


@each
def test_names_of_particles_and_where_the_box_begins_are_nothing(name, d, walls):
    observable, frames = given(name, d, walls)
    right = observable.over(frames)
    order = np.random.default_rng(1).permutation(N)
    turned = [
        replace(f, **{k: getattr(f, k)[order] for k in ARRAYS if getattr(f, k) is not None}) for f in frames
    ]
    assert_equal(observable.over(turned), right, rtol=1e-9, atol=1e-12)
    if walls or not CASES[name].moves:
        return
    shift = np.array((2.5, 1.25, 4.0, 0.5))[:d]
    moved = []
    for f in frames:
        carried = np.floor((f.positions + shift) / BOX[:d])
        moved.append(replace(f, positions=f.positions + shift - carried * BOX[:d],
                             images=f.images + carried.astype(np.int32)))  # fmt: skip
    assert_equal(observable.over(moved), right, rtol=1e-6, atol=1e-9)


@each
def test_what_does_not_fit_is_refused(name, d, walls, tmp_path):
    case, (observable, frames) = CASES[name], given(name, d, walls)
    for nothing in (observable.fresh().result, lambda: observable.over([])):
        with pytest.raises(InputError, match=r"No frame|too few"):
            nothing()
    with pytest.raises(FileError, match="folder without a trajectory"):
        observable.over(tmp_path)
    for wrong in (3, frames[0], [1.0]):
        with pytest.raises(InputError, match="frames must"):
            observable.over(wrong)
    arrays = [k for k in ARRAYS if getattr(frames[1], k) is not None]
    fewer = replace(frames[1], **{k: getattr(frames[1], k)[:-2] for k in arrays})
    with pytest.raises(InputError, match=f"n {N - 2}, the first one {N}|same system"):
        observable.over([frames[0], fewer])
    if not case.walls:
        with pytest.raises(InputError, match="walls"):
            observable.over(frames_of(d, walls=True, mixture=frames[0].species is not None))
    if case.sheared and d > 1:
        with pytest.raises(InputError, match=f"right angles, and this one is sheared: .*{case.sheared}"):
            observable.over([replace(frames[0], tilt=0.1)])


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if len(case.dimensions) < 4])
def test_other_dimensions_are_refused(name):
    for d in {1, 2, 3, 4} - {*CASES[name].dimensions}:
        with pytest.raises(InputError):
            CASES[name].make().over(frames_of(d))


# Error bars.


def with_errors(found):
    """Yield name, values and standard errors of all that a result has errors of."""
    numbers = values(found)
    for name in numbers:
        of = {"g": "error", "density": "error", "S": "error"}.get(name, f"{name}_error")
        if of in numbers:
            yield name, np.ravel(numbers[name]), np.ravel(numbers[of])


def independent(name, d, count, seed):
    """Return frames of independent points."""
    rng, (first, *_) = np.random.default_rng(seed), given(name, d)[1]
    return [
        replace(first, time=0.25 * k, step=k, positions=rng.uniform(0.0, first.box, (N, d)))
        for k in range(count)
    ]


RUNS = 32


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("frames", [2, 12, 18])  # fewer and more than blocking needs
@pytest.mark.parametrize("name", [name for name, case in CASES.items() if "dynamics" not in name])
def test_error_bars_are_the_scatter_of_runs_of_few_frames(name, frames):
    d, seen = max(2, min(CASES[name].dimensions)), 0
    runs = [list(with_errors(CASES[name].make().over(independent(name, d, frames, k)))) for k in range(RUNS)]
    for field, _, _ in runs[0]:
        told = [(np.asarray(mean), error) for run in runs for each, mean, error in run if each == field]
        if any(mean.size == 0 or np.isnan(mean).all() for mean, _ in told):
            continue
        means, errors = (np.array(each) for each in zip(*told, strict=True))
        scatter = means.var(axis=0, ddof=1)
        if (scatter == 0.0).any():  # of few particles in few frames none is in a crystal
            continue
        # One ratio is known to sqrt(1 / (2 RUNS)) = 0.13, and by four of these no error is too small. Of few
        # samples correlation is not told from chance, so that errors by blocking are up to twice too large.
        ratio = np.sqrt((errors**2).mean(axis=0) / scatter)
        assert (ratio > 0.5).all(), field
        assert np.median(ratio) < (1.5 if frames > 16 else 2.2), field
        seen += 1
    assert seen or name == "crystal"


# Units: a result tells the unit of each number. Lengths x 2, times x 1/2, masses x 4 are exact in binary.

EXPONENT = {"length": 1, "time": -1, "mass": 2}
EXPONENT["energy"] = EXPONENT["mass"] + 2 * EXPONENT["length"] - 2 * EXPONENT["time"]


def exponent(unit, d):
    """Return the power of two by which a number in a unit is larger."""
    total = 0
    for way, part in zip((1, -1), unit.partition(" / ")[::2], strict=True):
        for word in re.findall(r"[a-z]+(?:\^\(?[\dd+-]+\)?)?", part):
            base, _, power = word.partition("^")
            total += way * EXPONENT[base] * (eval(power, {"d": d}) if power else 1)
    return total


def units(kind):
    """Return the unit of each field, from the docstring: one for all names of an entry, or one each."""
    found = {}
    entries = inspect.getdoc(kind).partition("----\n")[2]
    for names, text in re.findall(r"^(\w[\w, ]*) : .*\n((?:(?: .*)?\n?)*)", entries, re.MULTILINE):
        several, told = names.split(", "), re.findall(r"\[([a-z1][^\]]*)\]", text) or [""]
        found |= dict(zip(several, told if len(told) == len(several) else told * len(several), strict=True))
    return found


def assert_scaled(found, right, d):
    """Each number of a result is larger by its unit."""
    told, seen = units(type(right)), 0
    for name, value in values(right).items():
        field = max((each for each in told if name.startswith(each)), key=len)
        factor = 2.0 ** exponent(told[field], d)
        if re.search(r"[\d)](density|error)$", name):  # of a distribution
            factor = 1.0 / factor
        np.testing.assert_array_equal(np.asarray(values(found)[name]) / factor, value, err_msg=name)
        seen += factor != 1.0
    return seen


@each
def test_results_of_frames_have_the_units_that_they_tell(name, d, walls):
    observable, frames = given(name, d, walls)
    larger = [
        replace(f, time=0.5 * f.time, positions=2 * f.positions, velocities=4 * f.velocities,
                box=tuple(2 * x for x in f.box), diameters=2 * f.diameters, masses=4 * f.masses)
        for f in frames
    ]  # fmt: skip
    assert_scaled(CASES[name].make(2.0).over(larger), observable.over(frames), d)


BULK = carom.Scene.random(12, 0.3, 2, seed=1)
OF_RUNS = {
    "bulk": (BULK, 2.0, 16, lambda u: {}, lambda: (carom.Pressure(), carom.PressureTensor(), carom.Energy())),
    "flights": (BULK, 2.0, 8, lambda u: {}, lambda: (carom.FreeFlights(),)),
    "walls": (
        carom.Scene.random(9, box=(6.0, 5.0), walls="y", seed=1), 4.0, 16, lambda u: {},
        lambda: (carom.WallPressure("y_high"), carom.PressureProfile("y", bins=4)),
    ),
    "barostat": (
        BULK, 1.0, 8, lambda u: {"barostat": carom.Barostat(u**4 * 2.0, interval=0.0625 / u)},
        lambda: (carom.Volume(),),
    ),
    "oscillating shear": (
        carom.Scene.random(4, 0.1, 2, seed=1, motion=carom.models.Shear(0.5, period=0.5)), 0.5, 8,
        lambda u: {},
        lambda: (carom.observables.ShearModuli(),),
    ),
}  # fmt: skip
"""Scene, time and blocks, arguments of its simulation in a unit u of length, and what is measured."""


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("name", OF_RUNS)
def test_results_of_runs_have_the_units_that_they_tell(name, plain, monkeypatch):
    scene, time, blocks, arguments, kinds = OF_RUNS[name]
    speeds, found = np.random.default_rng(1).normal(size=scene.positions.shape), []
    monkeypatch.setattr(stretches, "time_for", lambda sim, count: count * sim.time / sim.collisions)
    for u in (1.0, 2.0):
        motion = {}
        if isinstance(scene.motion, carom.models.Shear):
            motion["motion"] = replace(
                scene.motion, rate=u * scene.motion.rate, period=scene.motion.period / u
            )
        larger = carom.Scene(
            u * scene.positions, tuple(u * x for x in scene.box), diameter=u, mass=u * u,
            walls="y" if scene.walls else "", velocities=u * u * speeds, **motion,
        )  # fmt: skip
        sim = carom.Simulation(larger, seed=1, **arguments(u))
        sim.run(time=0.25 / u)  # instead of a pilot
        several = sim.measure(*kinds(), time=time / u, blocks=blocks)
        found.append(several if isinstance(several, tuple) else (several,))
    assert sum(assert_scaled(b, a, 2) for a, b in zip(*found, strict=True)) > 3


IN_MOTION = {
    "wells": BULK.replace(interaction=carom.models.SquareWell(1.25, 0.5)),
    "shear": BULK.replace(motion=carom.models.Shear(0.5)),
    "gravity": OF_RUNS["walls"][0].replace(motion=carom.models.Gravity((0.0, -1.0))),
}
OF_EPOCHS = OF_RUNS | {
    name: (scene, *OF_RUNS["walls" if scene.walls else "bulk"][1:]) for name, scene in IN_MOTION.items()
}


@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")
@pytest.mark.parametrize("name", OF_EPOCHS)
def test_results_of_runs_depend_on_no_end_of_an_epoch(name, plain, monkeypatch, request):
    scene, time, blocks, arguments, kinds = OF_EPOCHS[name]
    monkeypatch.setattr(stretches, "time_for", lambda sim, count: count * sim.time / sim.collisions)
    found = []
    for _ in range(2):
        sim = carom.Simulation(scene, kT=1.0, seed=1, **arguments(1.0))
        sim.run(time=0.25)
        several = sim.measure(*kinds(), time=time, blocks=blocks)
        found.append(several if isinstance(several, tuple) else (several,))
        request.getfixturevalue("short_epochs")
    assert sim.time > 8 * sim._state.epoch_length
    for one, other in zip(*found, strict=True):
        for field, value in values(one).items():
            # Some collisions of each make a thousand of the last digits.
            np.testing.assert_allclose(values(other)[field], value, rtol=1e-9, atol=1e-9, err_msg=field)


def test_every_observable_is_in_a_table():
    """Of all results of the package, a mixture's alone is made of others."""
    kinds = {kind for kind in vars(carom.observables).values() if isinstance(kind, type)}
    results = {kind.__name__ for kind in kinds if issubclass(kind, Result)}
    of_frames = {type(case.make()).__name__ for case in CASES.values()}
    of_runs = {type(each).__name__ for *_, kinds in OF_RUNS.values() for each in kinds()}
    assert {f"{name}Result" for name in of_frames | of_runs} | {"Distribution"} == results
