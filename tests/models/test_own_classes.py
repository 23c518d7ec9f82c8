"""Models of one's own as one class each: the bits of Carom's, and all that is refused in a sentence."""

import dataclasses
import math
import re

import numpy as np
import pytest
from helpers.scripts import python

import carom
from carom import seeds
from carom.compiling.entry import entry
from carom.errors import FileError, InputError, OverlapError
from carom.models import Andersen, Gravity, Loss, Plane, Sine, SquareWell, own
from carom.simulation.system_of_scene import prepare
from carom.units import TimeUnit

FLUID = carom.Scene.random(60, 0.3, 2, seed=1)


@own.interaction
class Cores:
    """Hard cores of one diameter."""

    diameter: float

    def reach(self, scene):
        return self.diameter

    def interaction_time(self, i, j, rr, rv, vv, now):
        return own.first_contact(rr - self.diameter**2, rv, vv)

    def core_square(self, i, j, now):
        return self.diameter**2

    def jump(self, i, j, rr, rv, now):
        return own.elastic(self, i, j, rr, rv)


@own.interaction
class Well:
    """A square well around a hard core: pairs are on step 0 outside of it, and on step 1 inside."""

    core: float
    edge: float
    depth: own.Energy
    penetrable = True

    def reach(self, scene):
        return self.edge

    def energies(self):
        return 0.0, -self.depth

    def step_of(self, distance):
        return -1 if distance < self.core else int(distance < self.edge)

    def step_time(self, i, j, step, rr, rv, vv, now):
        if step == 0:
            return own.end_of_step(self.edge**2, own.NEVER, rr, rv, vv)
        return own.end_of_step(self.core**2, self.edge**2, rr, rv, vv)

    def step_jump(self, i, j, step, rr, rv, now):
        if step == 0:
            return own.cross(self, i, j, step, rr, rv, True, -self.depth)
        inwards = rr - self.core**2 <= self.edge**2 - rr
        return own.cross(self, i, j, step, rr, rv, inwards, own.NEVER if inwards else self.depth)


@own.motion
class Falling:
    """Everybody falls with the same acceleration."""

    g: own.Acceleration
    straight = False

    def conserves(self, axis):
        return self.g[axis] == 0.0

    def position(self, axis, x, v, t):
        return x + (v + 0.5 * self.g[axis] * t) * t

    def velocity(self, axis, v, t):
        return v + self.g[axis] * t

    def exit_time(self, axis, x, v, low, high):
        g = self.g[axis]
        up = np.int64(v > 0.0 or (v == 0.0 and g > 0.0))
        root = v * v + 2.0 * g * ((high if up else low) - x)
        if root < 0.0:  # it turns round before, and leaves at the other end
            up = np.int64(1) - up
            back = np.sqrt(max(v * v + 2.0 * g * ((high if up else low) - x), 0.0))
            return (abs(v) + back) / abs(g), up
        way = abs(v) + np.sqrt(root)
        return 2.0 * abs((high if up else low) - x) / way if way > 0.0 else own.NEVER, up


@own.impact
class Tired:
    """A restitution, and elastic contacts where one of the two had its last contact a moment ago."""

    restitution: float
    contact_time: own.Time
    last = own.memory(-math.inf, times=True)

    def transfer(self, rr, rv):
        return 0.5 * (1.0 + self.restitution)

    def exchanged_part(self, i, j, rr, rv, now):
        soon = now - max(self.last[i], self.last[j]) < self.contact_time
        self.last[i] = now
        self.last[j] = now
        return 1.0 if soon else 0.5 * (1.0 + self.restitution)


@own.obstacle
class Floor:
    """A floor of the plane."""

    height: float

    def glides(self, axis):
        return axis != 1

    def gap(self, positions, radii, box, periodic):
        return positions[:, 1] - self.height - radii

    def encounter(self, x, v, radius, growth):
        approach = growth - v[1]
        return max((-self.height - radius + x[1]) / approach, 0.0) if approach > 0.0 else own.NEVER

    def outward(self, x, axis):
        return 1.0 if axis == 1 else 0.0


@own.drive
class Bath:
    """Andersen's thermostat."""

    kT: float
    rate: float
    seed: int
    drawn = own.memory(0)
    masses = own.per_particle("masses")

    @own.memory
    def due(self, particles):
        n = len(particles.radii)
        return np.array([-math.log(own.uniform(self.seed, i, 1 << 62)) / self.rate for i in range(n)])

    def next_time(self, i, x, v, time):
        return self.due[i]

    def kick(self, i, mass, x, v, time):
        first = self.drawn[i] * (2 * len(v) + 1)
        self.drawn[i] += 1
        for axis in range(len(v)):
            v[axis] = math.sqrt(self.kT / mass) * own.normal(self.seed, i, first + 2 * axis)
        self.due[i] -= math.log(own.uniform(self.seed, i, first + 2 * len(v))) / self.rate


@own.observer
class Tally:
    """Counts of events, and when each particle met its first obstacle."""

    floors: int
    pairs = own.memory(0, 1)
    hits = own.memory(0, "floors")
    first = own.memory(-1.0)
    masses = own.per_particle("masses")

    def at_pair(self, event):
        self.pairs[0] += 1

    def at_obstacle(self, event):
        self.hits[event.obstacle] += 1
        if self.first[event.i] < 0.0:
            self.first[event.i] = event.time

    @property
    def total(self):
        return int(self.pairs[0] + self.hits.sum())


@own.path
class Swing:
    """A sine, as Carom's."""

    amplitude: float
    period: own.Time

    @property
    def lowest(self):
        return -self.amplitude

    @property
    def highest(self):
        return self.amplitude

    @property
    def acceleration(self):
        return self.amplitude * (2.0 * math.pi / self.period) ** 2

    def place(self, t):
        return self.amplitude * math.sin(2.0 * math.pi / self.period * t)

    def pace(self, t):
        w = 2.0 * math.pi / self.period
        return self.amplitude * w * math.cos(w * t)


def floored(*obstacles):
    inside = carom.Scene.random(30, box=(8.0, 6.5), walls="y", seed=2)
    places = inside.positions + np.array([0.0, 1.0])
    return carom.Scene(places, (8.0, 8.0), walls="y", obstacles=obstacles)


def roofed(floor, path):
    """Return disks between a floor and a shaken roof."""
    return floored(floor, Plane((0.0, -1.0), -7.75, "Roof", shake=path))


BITS = {
    "cores that tire, in a bath, between a floor and a roof on a path": (
        roofed(Floor(0.5), Swing(0.2, 3.0)).replace(
            interaction=Cores(1.0), impact=Tired(0.9, 1e-2), drive=Bath(2.0, 0.25, seeds.word(1, "drives"))
        ),
        roofed(Plane((0.0, 1.0), 0.5, "Floor"), Sine(0.2, 3.0)).replace(
            impact=Loss(0.9, contact_time=1e-2), drive=Andersen(2.0, 0.25)
        ),
        ("interaction", "impact", "drive", "obstacles"),
    ),
    "wells": (
        FLUID.replace(interaction=Well(1.0, 1.5, 1.0)),
        FLUID.replace(interaction=SquareWell(1.5, 1.0)),
        ("interaction",),
    ),
    "disks that fall": (
        FLUID.replace(motion=Falling((0.0, -0.5))),
        FLUID.replace(motion=Gravity((0.0, -0.5))),
        ("motion",),
    ),
}
TIRED, *_ = BITS["cores that tire, in a bath, between a floor and a roof on a path"]


@pytest.mark.parametrize("name", ["radii", "diameters", "masses", "species"])
def test_arrays_of_a_scene_are_those_that_a_class_asks_for(name):
    scene = carom.Scene([[1.0, 1.0], [3.0, 3.0]], 5.0, diameter=[1.0, 0.5], mass=[2.0, 3.0], species=[1, 0])
    found = own.per_particle(name).made(None, prepare(scene, np.zeros((2, 2))).particles)
    wanted = {"radii": 0.5 * scene.diameters, "diameters": scene.diameters, "masses": scene.masses}
    assert found.tolist() == wanted.get(name, scene.species).tolist()


def assert_same(one, other):
    assert one.collisions == other.collisions
    assert (one.frame().positions == other.frame().positions).all()
    assert (one.frame().velocities == other.frame().velocities).all()


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("name", BITS)
def test_models_of_ones_own_have_the_bits_of_caroms_and_go_on_from_a_file(name, tmp_path):
    scene, caroms, keywords = BITS[name]
    mine, theirs = (carom.Simulation(each, seed=1) for each in (scene, caroms))
    for sim in (mine, theirs):
        sim.run(collisions=150)
    assert mine.obstacles == theirs.obstacles
    assert all(each.hits for each in mine.obstacles if each.name in ("Floor", "Roof"))
    assert_same(mine, theirs)
    mine.save(tmp_path / "run.h5")
    given = {keyword: getattr(scene, keyword) for keyword in keywords}
    again = carom.Simulation.load(tmp_path / "run.h5", **given)
    for sim in (mine, again):
        sim.run(collisions=50)
    assert_same(mine, again)
    with pytest.raises(FileError, match=re.escape("which no file holds")):
        carom.Simulation.load(tmp_path / "run.h5")


def answers(pair, impact, drive, floor, motion, path, x, v):
    """Ask models of one's own what an engine asks."""
    kicked = v.copy()
    drive.kick(3, 1.0, x, kicked, 0.5)
    met = impact.exchanged_part(2, 3, 4.0, -2.0, 1.0), impact.exchanged_part(3, 4, 4.0, -2.0, 1.001)
    pairs = pair.interaction_time(0, 1, 4.0, -2.0, 2.0, 0.0), pair.core_square(0, 1, 0.0)
    flight = motion.position(1, 2.0, -1.0, 0.5), motion.velocity(1, -1.0, 0.5)
    return (
        *pairs, *pair.jump(0, 1, 1.0, -2.0, 0.0), *met, impact.last[3],
        drive.next_time(3, x, v, 0.0), kicked[0], kicked[1], drive.drawn[3],
        floor.encounter(x, v, 0.5, 0.0), floor.outward(x, 1),
        *flight, *motion.exit_time(1, 2.0, -1.0, 0.0, 8.0), path.place(0.3), path.pace(0.3),
    )  # fmt: skip


def test_compiled_answers_of_ones_own_are_those_of_plain_python(unscheduled):
    def models():
        model = carom.Simulation(TIRED, seed=1)._state.engine.model
        falling, _, _ = BITS["disks that fall"]
        return (
            model.pair, model.impact, model.timers.drive, model.obstacles.chain.head[0],
            carom.Simulation(falling, seed=1)._state.engine.model.motion, Swing(0.2, 3.0).model(TimeUnit()),
            np.array([1.0, 2.0]), np.array([0.5, -1.0]),
        )  # fmt: skip

    assert entry(answers)(*models()) == answers(*models())


@pytest.mark.usefixtures("both_ways")
def test_an_observer_of_ones_own_counts_what_the_run_counts(tmp_path):
    scene = floored(Plane((0.0, 1.0), 0.5))
    sim = carom.Simulation(scene, seed=1, observers=[Tally(3)])
    sim.run(collisions=100)
    (seen,) = sim.observers
    assert seen.pairs[0] == sim.collisions
    assert seen.hits.tolist() == [each.hits for each in sim.obstacles]
    assert seen.total == sim.collisions + seen.hits.sum()
    assert seen.first.shape == (scene.n,)
    sim.save(tmp_path / "run.h5")
    again = carom.Simulation.load(tmp_path / "run.h5", observers=[Tally(3)])
    stretch = sim.measure(Tally(3), time=1.0)
    again.run(time=1.0)
    assert stretch.pairs[0] == again.observers[0].pairs[0] - seen.pairs[0] > 0
    with pytest.raises(FileError, match="Tally with floors = 3, and the value given has floors = 4"):
        carom.Simulation.load(tmp_path / "run.h5", observers=[Tally(4)])


VALUES = [
    Cores(1.0), Well(1.0, 1.5, 1.0), Falling((0.0, -0.5)), Tired(0.9, 1e-2), Floor(0.5), Bath(2.0, 1.0, 1),
    Tally(8),
]  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_a_model_of_ones_own_without_fault_keeps_all_conditions(value):
    found = carom.check(value, pairs=50)
    assert found.passed, str(found)
    assert found.tried


def test_a_value_is_a_frozen_dataclass():
    assert Cores(1) == Cores(diameter=1.0) != Cores(2.0)
    assert hash(Cores(1)) == hash(Cores(1.0))
    assert repr(Well(1, 1.5, depth=2)) == "Well(core=1.0, edge=1.5, depth=2.0)"
    assert Floor(0.5).name == "Floor"
    assert Floor(0.5, name="bottom").name == "bottom"
    ground = {"__module__": __name__, "closest": lambda self, x, axis: 0.0, "name": "ground"}
    assert own.obstacle(type("Odd", (), ground))().name == "ground"
    assert dataclasses.replace(Falling([0, 1]), g=(1.0, 2.0)).g == (1.0, 2.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        Cores(1.0).diameter = 2.0


# ------------------------------------------------------------------------------- fields and arrays


@own.interaction
class Charged:
    """Hard cores with charges and a table, of which the search reads the charges."""

    charge: own.PerParticle
    table: own.Array
    labels: str = "none"
    wide: bool = True
    least: float | None = None
    penetrable = True
    SHARE = 0.5

    @own.per_particle
    def sizes(self, particles):
        return 2.0 * particles.radii * self.table[0]

    @own.prepared
    def ends(self, particles):
        return (1.0, 2.0 * len(particles.radii))

    def reach(self, scene):
        return 2.0

    def interaction_time(self, i, j, rr, rv, vv, now):
        contact = meeting_of(self.sizes[i], self.sizes[j], self.SHARE)
        return own.first_contact(rr - contact * contact, rv, vv) if self.charge[i] != 3 else own.NEVER

    def jump(self, i, j, rr, rv, now):
        return own.elastic(self, i, j, rr, rv)


def meeting_of(a, b, share):
    return share * (a + b)


def test_fields_and_arrays_are_what_their_names_say(unscheduled):
    charge = np.arange(60) % 2
    value = Charged(charge, [[1.0, 2.0], [2.0, 3.0]][0])
    assert not value.charge.flags.writeable
    scene = FLUID.replace(interaction=value)
    pair = carom.Simulation(scene, seed=1, tuning=carom.Tuning(neighbors="sectors"))._state.engine.model.pair
    assert type(pair) is Charged.Compiled
    assert pair.charge.tolist() == [*charge, charge[0]]
    assert pair.table.tolist() == [1.0, 2.0]
    assert pair.ends == (1.0, 120.0)
    assert (pair.wide, pair.least, pair.SHARE) == (True, None, 0.5)
    assert len(pair.sizes) == len(pair.radii) == len(pair.masses) == 61
    assert set(pair.lanes) == {"charge", "sizes"}
    assert not hasattr(pair, "labels")
    assert value == Charged(charge.tolist(), (1.0, 2.0)) != Charged(charge + 1, (1.0, 2.0))
    assert carom.check(value).passed
    with pytest.raises(InputError, match="charge of Charged has 60 values; expected 6, one a particle"):
        carom.Scene.random(6, 0.1, 2, interaction=value)


@pytest.mark.usefixtures("both_ways")
def test_memory_is_copied_and_times_are_shifted():
    sim = carom.Simulation(TIRED.replace(impact=Tired(0.9, 0.5)), seed=1)
    sim.run(collisions=200)
    before = sim._state.engine.model.impact.last.copy()
    assert np.isfinite(before).any()
    sim.rescale(1.0)
    after = sim._state.engine.model.impact.last
    met = np.isfinite(before)
    assert (np.isfinite(after) == met).all()
    assert (np.argsort(before[met]) == np.argsort(after[met])).all()
    assert (after[met] <= 0.0).all()  # new epochs begin now


# ------------------------------------------------------------------------------------ what is refused


def cores(**changes):
    """Return the body of a class of cores, with other methods or fields."""
    body = {
        "__annotations__": {"diameter": float}, "__module__": __name__, "reach": Cores.reach,
        "interaction_time": Cores.interaction_time, "jump": Cores.jump,
    }  # fmt: skip
    return type("Odd", (), {name: each for name, each in {**body, **changes}.items() if each is not None})


def short(self, i, j, rr, rv):
    return 0.0, 0.0, 0.0


def calls(self, i, j, rr, rv, now):
    return self.helped(rr)


def asks(self, i, j, rr, rv, now):
    return self.diametre, 0.0, 0.0


def shows(self, i, j, rr, rv, now):
    return self.label, 0.0, 0.0


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"jump": None}, "Odd is an interaction and has no jump: give it def jump(self, i, j, rr, rv, now)."),
        ({"jump": None, "jmp": Cores.jump}, "has no jump, but jmp: give it"),
        ({"reach": None}, "Odd is an interaction and has no reach: give it def reach(self, scene)."),
        ({"reach": short},
         "reach of Odd must be written def reach(self, scene), found the parameters (self, i,"),
        ({"sum": own.memory(0, "many")}, "The memory sum has as many items as the field many, which is no"),
        ({"__annotations__": {"_d": float}}, "The field _d of Odd begins with an underscore: leave that out"),
        ({"jump": short},
         "must be written def jump(self, i, j, rr, rv, now), found the parameters (self, i,"),
        ({"contact_tme": short}, "Odd has contact_tme, which nobody asks; did you mean contact_time?"),
        *(
            ({"__annotations__": {"diameter": float, name: float}},
             f"Odd has a field {name}, which is the name of a question that Carom asks of an interaction")
            for name in ("contact_time", "shift_epoch", "mass_of")
        ),
        ({"jump": calls, "helped": short, "core_square": None, "growth_of": short},
         "Odd has growth_of: write growth."),
        ({"jump": asks},
         "jump of Odd reads self.diametre, which is no number and no array of the class; did"),
        ({"jump": shows, "label": "x"}, "jump of Odd reads self.label, which is no number and no array"),
        ({"__annotations__": {"diameter": list}},
         "The field diameter of Odd is annotated with list; expected"),
        ({"__annotations__": {"diameter": "Nowhere"}}, "An annotation of Odd cannot be read: name 'Nowhere'"),
        ({"step_time": short}, "step_time of Odd must be written def step_time(self, i, j, step, rr, rv, vv"),
    ],
)  # fmt: skip
def test_a_class_with_a_fault_is_refused_where_it_is_decorated(body, words):
    with pytest.raises(InputError, match=re.escape(words)):
        own.interaction(cores(**body))


def odd(base, **body):
    """Return a class with other methods or facts than one without fault."""
    body = {"__module__": __name__, "__annotations__": {}, **body}
    return getattr(own, base._own.kind.decorator)(type("Odd", (base,), body))


def assigns(self, event):
    self.hits = 0


def assigns_at_the_end(self, block):
    self.hits = 0


@pytest.mark.parametrize(
    ("base", "body", "words"),
    [
        (Cores, {"__init__": assigns}, "Odd has __init__: leave it out."),
        (Cores, {"__annotations__": {"a": own.Array}, "a": np.ones(2)}, "not those of a dataclass: mutable"),
        (Cores, {"conserves": True}, "written def conserves(self, diameter), found the boolean true."),
        (Cores, {"penetrabel": True}, "Odd has penetrabel, which nobody asks; did you mean penetrable?"),
        (Well, {"events": own.memory(0)}, "The events of steps is an array of Carom's own: give the field"),
        (Falling, {"conserves": lambda self: False}, "(self, axis), found the parameters (self)."),
        (Falling, {"straight": lambda self: False}, "must be written straight = ..., found the parameters"),
        (Tired, {"transfer": lambda self, rr, *, rv: 1.0},
         "(self, rr, rv), found the parameters (self, rr, *"),
        (Floor, {"gap": 3.0}, "written def gap(self, positions, radii, box, periodic), found 3.0."),
        (Floor, {"is_periodic": lambda self: True}, "and no anchor: give it def anchor(self, axis)."),
        (Floor, {"is_periodic": True}, "must be written def is_periodic(self), found the boolean true."),
        (Bath, {"pace": 1.0}, "pace of Odd must be written def pace(self, scene), found 1.0."),
        (Tally, {"result": lambda self, block: 0.0},
         "written def result(self), found the parameters (self, b"),
        (Tally, {"at_pair": assigns}, "at_pair of Odd assigns to .hits, and fields and arrays stay what"),
        (Tally, {"add": assigns_at_the_end}, "add of Odd assigns to .hits, and fields and arrays stay what"),
        (Swing, {"lowest": lambda self: 0.0}, "must be written lowest = ..., found the parameters (self)."),
    ],
)  # fmt: skip
def test_a_wrong_declaration_of_each_kind_is_refused_in_a_sentence(base, body, words):
    with pytest.raises(InputError, match=re.escape(words)):
        odd(base, **body)


def shaken(path):
    return Plane((0.0, 1.0), 0.5, "floor", shake=path)


CHECKED = [
    (odd(Cores, jump=lambda self, i, j, rr, rv, now: (1.0, 2.0))(1.0), "a, b, virial, found a"),
    (odd(Cores, core_square=lambda self, i, j, now: None)(1.0), "a number, found nothing."),
    (odd(Cores, p=own.prepared(lambda self, particles: "a"))(1.0), "array of them, found the"),
    (odd(Cores, p=own.memory(lambda self, particles: 1.0))(1.0), "an array of numbers, found 1"),
    (odd(Well, step_of=lambda self, distance: 0.5)(1.0, 1.5, 1.0), "must be an integer"),
    (odd(Well, step_of=lambda self, distance: 7)(1.0, 1.5, 1.0), "between -1 and 1, found 7"),
    (odd(Falling, position=lambda self, axis, x, v, t: None)((0.0,)), "found nothing."),
    (odd(Bath, kick=lambda self, i, mass, x, v, time: -v)(1.0, 1.0, 1),
     "kick of Odd returns a ndarray; expected nothing: write the new velocity into v"),
    (odd(Falling, exit_time=lambda self, axis, x, v, low, high: 1.0)((0.0,)),
     "exit_time of Odd must return the time, and 1 at the upper end or 0, found 1.0."),
    (odd(Tired, transfer=lambda self, rr, rv: "a")(0.9, 0.1), "a number, found the string"),
    (odd(Bath, next_time=lambda self, i, x, v, time: (1.0,))(1.0, 1.0, 1), "a number, found"),
    (odd(Floor, encounter=lambda self, x, v, radius, growth: (1.0, 2.0))(0.5), "encounter of Odd"),
]  # fmt: skip


def beside(obstacle):
    return carom.Scene([[1.0, 1.0]], 8.0, walls=True, obstacles=[obstacle])


def convex(**methods):
    """Return an obstacle that says its closest point alone."""
    body = {"__module__": __name__, "closest": lambda self, x, axis: 4.0, **methods}
    return own.obstacle(type("Odd", (), body))()


WIDE = convex(closest=lambda self, x, axis: x)


@pytest.mark.parametrize(
    ("ask", "value", "words"),
    [
        *((carom.check, *row) for row in CHECKED),
        (lambda value: value.gap(np.ones((3, 2)), np.ones(3), (8.0, 8.0), (False, False)),
         odd(Floor, gap=lambda self, positions, radii, box, periodic: positions)(0.5),
         "gap of Odd must return 3 distances, one a particle, found the shape (3, 2)."),
        (shaken, odd(Swing, place=lambda self, t: None)(0.2, 3.0), "place of Odd must return a number"),
        (shaken, odd(Swing, lowest="a")(0.2, 3.0), "lowest of Odd must be a number, found the string 'a'."),
        (beside, WIDE, "closest of Odd must return a number, found a list of 2."),
        (beside, convex(rounding=lambda self: -1.0), "rounding() of Odd must be at least 0, found -1.0."),
        (lambda value: carom.Simulation(FLUID.replace(drive=value)),
         odd(Bath, pace=lambda self, scene: None)(1.0, 1.0, 1),
         "pace(scene) of Odd must be a number, found nothing."),
        (lambda value: carom.Simulation(FLUID.replace(interaction=value)),
         odd(Well, energies=lambda self: ("a", "b"))(1.0, 1.5, 1.0),
         "energies() of Odd must return one energy for each of at least two steps, found ('a', 'b')."),
    ],
)  # fmt: skip
def test_a_wrong_answer_is_refused_in_a_sentence_that_names_its_method(plain, ask, value, words):
    with pytest.raises(InputError, match=re.escape(words)):
        ask(value)


@pytest.mark.parametrize(
    ("value", "condition"),
    [
        (odd(Tired, elastic=True)(0.9, 0.1), "elastic"),
        (odd(Bath, kick=lambda self, i, mass, x, v, time: None)(1.0, 1.0, 1), "later"),
    ],
)
def test_what_a_law_says_of_itself_and_a_kick_after_which_none_is_due_are_tried(value, condition):
    assert {failure.condition for failure in carom.check(value, dimensions=(2,)).failures} == {condition}


def test_a_memory_with_a_unit_of_time_holds_floats():
    @own.drive
    class Late(Bath):
        last: own.Time = own.memory(0)
        seen = own.memory(0)

    model = Late(1.0, 1.0, 1).model(prepare(FLUID, np.zeros((60, 2))).particles)
    assert (model.last.dtype, model.seen.dtype) == (np.float64, np.int64)


def test_check_says_that_a_last_step_without_a_core_has_a_negative_end():
    found = carom.check(Well(0.0, 1.5, 1.0), dimensions=(1,))
    assert {failure.condition for failure in found.failures} >= {"IV"}
    assert "A last step that does not end inwards has the end low = -1" in str(found)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Cores("1"), "diameter of Cores must be a number, found the string '1'."),
        (lambda: Cores(math.nan), "diameter of Cores must be finite"),
        (lambda: Tally(1.5), "floors of Tally must be an integer"),
        (lambda: Falling("down"), "g of Falling must be"),
        (lambda: Charged("a", [1.0]), "charge of Charged must be an array of numbers, found the string 'a'."),
        (lambda: Charged([1.0], [1.0], wide=1), "wide of Charged must be a boolean, found 1."),
        (lambda: own.per_particle("color"), "per_particle() takes one of radii, diameters, masses, species"),
        (lambda: own.memory("0"), "memory() starts with a number, found the string '0'."),
        (lambda: own.memory(0, ("a", "b")), "memory() takes how many items it has"),
        (lambda: own.memory(0, -3), "or the name of one field that holds an int; found -3."),
        (lambda: own.prepared(1.0), "is made by a method, def name(self, particles), found 1.0."),
        (lambda: carom.check(Tally(-1)), "floors of Tally must be at least 0, found -1."),
        (lambda: own.interaction(3), "own.interaction decorates a class, found 3."),
        (lambda: FLUID.replace(interaction="reac"), "found the string 'reac', which has no reach."),
        (lambda: FLUID.replace(interaction=np.float64(1.5)), "found 1.5, which has no reach."),
        (lambda: carom.Simulation(FLUID).run(100), "run() takes collisions=, "),
        (lambda: carom.Simulation(FLUID).sample(0.1, 3), "sample() takes every=, "),
        (lambda: carom.Simulation(FLUID, 300.0), "Simulation takes kT=, seed=, "),
        (lambda: carom.io.rebuild("a.extxyz", "a.h5md", "all"), "keep must be an integer"),
        (lambda: FLUID.replace(motion=Cores(1.0)), "found Cores, which is made with own.interaction."),
        (lambda: carom.check(Swing(0.1, 1.0)), "Swing is a path: check the obstacle that moves along it"),
        (lambda: carom.Simulation(FLUID, observers=[Cores(1.0)]), "An observer is a value of a class with"),
    ],
)
def test_a_value_that_is_none_is_refused_in_a_sentence(make, words):
    with pytest.raises(InputError, match=re.escape(words)):
        make()


def test_a_model_that_reads_species_needs_some():
    @own.interaction
    class Unlike(Cores):
        species = own.per_particle("species")

        def interaction_time(self, i, j, rr, rv, vv, now):
            t = own.first_contact(rr - self.diameter**2, rv, vv)
            return t if self.species[i] != self.species[j] else own.NEVER

    scene = FLUID.replace(interaction=Unlike(1.0))
    with pytest.raises(InputError, match="Unlike reads the species of the particles, and the scene has none"):
        carom.Simulation(scene)
    assert Unlike.Compiled.lanes == ("species",)


def test_a_subclass_needs_a_decorator():
    class Softer(Cores):
        pass

    with pytest.raises(InputError, match="Softer is a subclass of Cores without a decorator of its own"):
        carom.Simulation(FLUID.replace(interaction=Softer(1.0)))


def test_a_well_refuses_pairs_where_they_have_no_step():
    with pytest.raises(OverlapError, match="where Well has no step for them: move them"):
        carom.Simulation(FLUID.replace(interaction=Well(1.2, 1.5, 1.0)))


# ------------------------------------------------------------------- code that changes, and is kept


def kicked(drive, v):
    drive.kick(0, 1.0, v, v, 0.5)
    return v[0]


def test_a_class_that_is_defined_again_is_another(unscheduled):
    # As a notebook cell that is edited and run again.
    def drive_to(speed):
        def wanted():
            return 3.0 * speed

        @own.drive
        class Push:
            done = own.memory(0)

            def next_time(self, i, x, v, time):
                return 0.5 if self.done[i] == 0 else own.NEVER

            def kick(self, i, mass, x, v, time):
                v[0] = wanted()
                self.done[i] = 1

        return Push()

    scene = carom.Scene([[1.0, 1.0], [3.0, 3.0]], (6.0, 6.0), velocities=[[0.0, 1e-3], [0.0, 1e-3]])
    asked = entry(kicked)
    for value, speed in ((drive_to(1.0), 3.0), (drive_to(2.0), 6.0)):
        model = carom.Simulation(scene.replace(drive=value))._state.engine.model
        assert asked(model.timers.drive, np.zeros(2)) == speed


MODULE = """
from carom.models import own

STRENGTH = 2.0

def pulled(x):
    return STRENGTH * x

@own.obstacle
class Wall:
    place: float

    def gap(self, positions, radii, box, periodic):
        return positions[:, 0] - self.place - radii

    def encounter(self, x, v, radius, growth):
        return pulled(self.place) + self._thick(radius)

    def outward(self, x, axis):
        return 1.0 if axis == 0 else 0.0

    def _thick(self, radius):
        return self.twice(radius) - radius

    def twice(self, radius):
        return 2.0 * radius
"""
PROBE = """
from carom.compiling import machine
from carom.compiling.entry import entry
from walls import Wall

@entry
def probe(obstacle, x):
    return obstacle.encounter((x,), (0.0,), 0.5, 0.0)

said, compile_ = [], machine.machine_code
machine.machine_code = lambda text: said.append(text) or compile_(text)
time = probe(Wall(1.5).model(), 10.0)
print("compiled" if said else "loaded", time)
"""


def test_code_of_a_class_and_of_methods_that_compiled_ones_call_is_kept_until_it_changes(tmp_path):
    (tmp_path / "probe.py").write_text(PROBE)

    def said(text):
        (tmp_path / "walls.py").write_text(text)
        return python("-B", "probe.py", cwd=tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache")).strip()

    assert [said(MODULE), said(MODULE)] == ["compiled 3.5", "loaded 3.5"]
    for old, new, time in (
        ("STRENGTH = 2.0", "STRENGTH = 4.0", 6.5),
        ("+ self._thick", "+ 1.0 + self._thick", 4.5),
        ("2.0 * radius", "3.0 * radius", 4.0),
    ):
        edited = MODULE.replace(old, new)
        assert [said(edited), said(edited)] == [f"compiled {time}", f"loaded {time}"]
