"""Square wells, shoulders, steps by species and bonds: against the naive algorithm, and what they keep."""

import json
import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from helpers.goes_on import assert_goes_on
from helpers.marks import slow
from helpers.steps import assert_order
from typer.testing import CliRunner

import carom
from carom import cli
from carom.engine.pair_steps import read_steps
from carom.errors import InputError, OverlapError
from carom.geometry.overlaps import Geometry
from carom.io.events import read_events
from carom.models import Bonds, SquareWell, Steps, StepTable, chains, from_potential, rings
from carom.models.files.tables import from_table
from carom.observables.steps import StepSums, heat_capacity
from carom.scene.fields import first_steps
from carom.scene_file.scene_file import SceneFile

INF = math.inf

WELLS = {
    "well": (SquareWell(1.5, 1.0), [1.0, 1.5], [INF, -1.0]),
    "shoulder": (SquareWell(1.3, -0.5), [1.0, 1.3], [INF, 0.5]),
    "deep": (SquareWell(1.5, 1e4), [1.0, 1.5], [INF, -1e4]),
    "narrow": (SquareWell(1.0 + 1e-6, 2.0), [1.0, 1.0 + 1e-6], [INF, -2.0]),
    "high": (SquareWell(1.2, -1e12), [1.0, 1.2], [INF, 1e12]),
    "stairs": (
        StepTable(Steps([0.9, 1.1, 1.4, 1.6], [INF, -1.0, 0.7, -0.3])),
        [0.9, 1.1, 1.4, 1.6],
        [INF, -1.0, 0.7, -0.3],
    ),
    "penetrable": (StepTable(Steps([0.8, 1.2], [2.0, 0.5])), [0.8, 1.2], [2.0, 0.5]),
}
CORE = Steps([1.0], [INF])
AA = Steps([1.0, 1.3, 1.7], [INF, 0.4, -1.0])
AB = Steps([0.9, 1.4], [INF, -0.8], leaving=[INF, -1.2])
TABLE = StepTable([[AA, AB], [AB, CORE]])


def scattered(n, d, interaction, fraction, seed=1, kT=1.0, **more):
    rng = np.random.default_rng(seed)
    places = carom.Scene.random(n, fraction, d, seed=seed)
    v = math.sqrt(kT) * rng.normal(size=(n, d))
    return carom.Scene(places.positions, places.box, velocities=v, interaction=interaction, **more)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(
    ("name", "d"),
    [("well", 1), ("shoulder", 1), slow("well", 2), slow("well", 4), *(slow(name, 3) for name in WELLS)],
)
def test_events_are_those_of_the_naive_algorithm(name, d):
    interaction, distances, energies = WELLS[name]
    more = {"mass": np.linspace(0.5, 2.0, 9)} if d == 3 else {}
    scene = scattered(9, d, interaction, {1: 0.4, 2: 0.2, 3: 0.06, 4: 0.02}[d], 5 if d == 1 else 3, **more)
    assert_order(scene, lambda i, j: (distances, [*energies, 0.0]), 60)


def pairs_of_the_plane(i, j, out=False):
    steps = TABLE.table[i % 2][j % 2]
    energies = steps.leaving if out and steps.leaving is not None else steps.energies
    return steps.distances, [*energies, 0.0]


@pytest.mark.slow
def test_events_of_species_with_hysteretic_steps_are_those_of_the_naive_algorithm_in_the_plane(tmp_path):
    scene = scattered(10, 2, TABLE, 0.2, seed=4, species=np.arange(10) % 2)
    assert_order(
        scene,
        pairs_of_the_plane,
        80,
        leaving=lambda i, j: pairs_of_the_plane(i, j, out=True),
        event_log=tmp_path / "log.h5",
    )


def test_a_bonded_chain_in_a_well_follows_the_naive_algorithm(plain):
    n = 6
    bonds = Bonds(chains(1, n), inner=0.9, outer=1.2, others=SquareWell(1.5, 1.0))
    x = 2.0 + np.array([[1.05 * k, 0.1 * (k % 2), 0.0] for k in range(n)])
    v = np.random.default_rng(2).normal(size=(n, 3))
    scene = carom.Scene(x, 9.0, velocities=v, interaction=bonds)

    def potential(i, j):
        if j == i + 1:
            return [0.9, 1.2], [INF, 0.0, INF]
        return [1.0, 1.5], [INF, -1.0, 0.0]

    assert_order(scene, potential, 80)


def fluid(kT=1.5, cells=3, density=0.4, **settings):
    scene = carom.Scene.crystal(cells=cells, density=density).replace(interaction=SquareWell(1.5, 1.0))
    return carom.Simulation(scene, kT=kT, seed=2, **settings)


def inside(sim, end=1.5):
    """Pairs that are inside by their distances: certainly, and all that may be, as the pair of the moment."""
    room = Geometry(np.asarray(sim.scene.box), np.asarray(sim.scene.periodic))
    pairs = room.near(sim.frame().positions, end + 1e-9)
    distances = room.distances(sim.frame().positions, pairs)
    return tuple(
        {tuple(sorted(pair)) for pair in pairs[distances < end + hair].tolist()} for hair in (-1e-12, 1e-12)
    )


def test_the_step_that_is_stored_is_where_the_pair_is():
    sim = fluid()
    for _ in range(5):
        sim.run(collisions=4000)
        pairs, steps = read_steps(sim._state.engine.neighbors)
        assert (steps == 1).all()
        clearly, at_most = inside(sim)
        stored = set(map(tuple, pairs.tolist()))
        assert clearly <= stored <= at_most
        assert sim.potential_energy == -len(stored)


def test_energy_is_kept_to_rounding():
    sim = fluid()
    sim.run(collisions=50_000)
    # A random walk of rounding: 1e5 changes of about 1e-16 of one energy in 100.
    assert sim.statistics.energy_drift < 1e-13
    assert sim.statistics.momentum_drift < 1e-13
    assert sim.statistics.worst_overlap < 1e-12
    sums = sim.interaction
    assert sums.core + sums.into + sums.out + sums.bounce == sim.collisions
    assert sums.pairs.sum() == -sim.potential_energy


@pytest.mark.usefixtures("both_ways")
def test_a_run_goes_on_from_a_checkpoint_and_from_its_log_with_the_kinds_of_its_events(tmp_path):
    places = carom.Scene.crystal(cells=8, dimension=2, packing_fraction=0.35)
    scene = places.replace(interaction=TABLE, species=np.arange(places.n) % 2)
    whole, again = assert_goes_on(scene, tmp_path, 200)
    assert again.scene.interaction == TABLE  # the file describes it
    assert (again._state.engine.neighbors.refs == whole._state.engine.neighbors.refs).all()
    assert (again.interaction.events == whole.interaction.events).all()
    assert again.kT == whole.kT
    events = read_events(tmp_path / "log.h5")
    assert np.bincount(events.kind, minlength=4).tolist() == again.interaction.events.sum(axis=0).tolist()


def test_steps_survive_new_lists_and_a_change_of_temperature():
    sim = fluid()
    room = sim._state.scheme.capacity
    sim.run(collisions=20_000)
    assert sim._state.scheme.capacity > room  # lists were too short, and were built anew on the way
    before = sim.potential_energy
    sim.rescale(0.7)
    assert sim.kT == pytest.approx(0.7)
    assert sim.potential_energy == before
    for _ in range(2):
        clearly, at_most = inside(sim)
        stored = set(map(tuple, read_steps(sim._state.engine.neighbors)[0].tolist()))
        assert clearly <= stored <= at_most
        sim.run(collisions=2000)


def test_g_jumps_by_the_exponential_of_the_energy_and_gives_the_pressure_of_the_virial():
    sim = fluid(kT=2.0, cells=4, density=0.3)
    for _ in range(4):
        sim.run(collisions_per_particle=40)
        sim.rescale(2.0)
    sim.run(collisions_per_particle=60)
    start = sim.interaction
    pressure = sim.measure(carom.Pressure(), collisions=400_000, blocks=32)
    sums = sim.interaction - start
    well, core = sums.sides()
    assert (well.distance, core.distance) == (1.5, 1.0)
    error = math.hypot(well.inside_error / well.inside, well.outside_error / well.outside)
    # Of 256 components at constant energy: kT fluctuates by 2 / (3 n), and with it the exponential.
    finite = 1.0 / sim.scene.n
    assert well.inside / well.outside == pytest.approx(math.exp(1.0 / sums.kT), rel=6.0 * error + finite)
    z = pressure.Z
    assert abs(sums.compressibility_factor() - z.mean) < 6.0 * z.error + finite
    assert pressure.kT == pytest.approx(sums.kT, rel=1e-9)
    assert not pressure.note


def test_few_components_on_steps_without_energy_have_the_pressure_of_the_virial():
    """At constant energy and momentum pairs are faster than at constant kT: 1 / (4 D), 2.8 % of four."""
    scene = carom.Scene.random(4, density=0.1, seed=1, interaction=SquareWell(1.5, 1e-6))
    sim = carom.Simulation(scene, kT=1.0, seed=1)
    sim.run(collisions_per_particle=1000)
    start = sim.interaction
    z = sim.measure(carom.Pressure(), collisions_per_particle=100_000).Z
    sums = sim.interaction - start
    assert sums.degrees_of_freedom == 9
    # Events and virial are of the same run; what is left is the scatter of either, below 0.3 %.
    assert sums.compressibility_factor() - 1.0 == pytest.approx(z.mean - 1.0, rel=0.01)


def test_both_sides_of_a_step_have_the_error_of_their_own_events():
    """Of the outer end of a well: 400 pairs come from outside, 900 from inside."""
    events = np.array([[100, 300, 0, 0], [16, 0, 500, 400]])
    sums = StepSums(
        time=2.0, kT_time=3.0, n=10, dimension=3, volume=20.0, mass=0.5, degrees_of_freedom=math.inf,
        inner=np.array([1.5, 1.0]), outer=np.array([math.inf, 1.5]), energies=np.array([0.0, -1.0]),
        pairs=np.zeros(2, int), events=events,
    )  # fmt: skip
    well, core = sums.sides()
    rate = 45.0 / 20.0 * 4.0 * math.pi * 1.5**2 * math.sqrt(1.5 / (0.5 * math.pi)) * 2.0
    assert (well.outside, well.inside) == pytest.approx((400.0 / rate, 900.0 / rate))
    assert (well.outside_error, well.inside_error) == pytest.approx((20.0 / rate, 30.0 / rate))
    assert (core.inside, core.inside_error) == (0.0, 0.0)
    assert core.outside_error == pytest.approx(4.0 * 1.5**2 / rate)


def test_ends_of_ideal_chains_are_apart_as_links_of_free_joints_are():
    count, length, box = 200, 4, 12.0
    rng = np.random.default_rng(3)
    links = rng.normal(size=(count, length, 3))
    # Uniform between two spheres. Every chain keeps its own energy and angular momentum: from another start
    # it would not come to this distribution, but from this one nothing may lead away.
    lengths = np.cbrt(rng.uniform(0.8**3, 1.2**3, (count, length, 1)))
    links *= lengths / np.linalg.norm(links, axis=2, keepdims=True)
    x = (rng.uniform(0.0, box, (count, 1, 3)) + np.cumsum(links, axis=1)).reshape(-1, 3)
    scene = carom.Scene(x, box, diameter=0.5, interaction=Bonds(chains(count, length), inner=0.8, outer=1.2))
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions_per_particle=50)
    assert sim.interaction.core + sim.interaction.bounce == sim.collisions
    square, fourth = [], []
    for frame in sim.sample(every=5.0, count=60):
        steps = np.diff(frame.positions.reshape(count, length, 3), axis=1)
        ends = np.sum(steps - box * np.rint(steps / box), axis=1)
        square.append(np.sum(ends**2, axis=1))
        fourth.append(np.sum(ends**2, axis=1) ** 2)

    def moment(power):  # of a link that is anywhere between two spheres
        return 3.0 / (3.0 + power) * (1.2 ** (3 + power) - 0.8 ** (3 + power)) / (1.2**3 - 0.8**3)

    n = length - 1
    expected = n * moment(2), n * moment(4) + n * (n - 1) * moment(2) ** 2 * (1.0 + 2.0 / 3.0)
    for found, exact in zip((square, fourth), expected, strict=True):
        chain = np.mean(found, axis=0)
        assert abs(chain.mean() - exact) < 4.0 * chain.std(ddof=1) / math.sqrt(count)
        assert 4.0 * chain.std(ddof=1) / math.sqrt(count) < 0.25 * exact


@pytest.mark.parametrize(
    ("width", "depth", "kT"), [(1.5, 1.0, 1e-9), (1.5, 1e9, 1.0), (1.0 + 1e-6, 1.0, 0.3)]
)
def test_cold_deep_and_narrow_wells_keep_their_energy(width, depth, kT):
    scene = carom.Scene.crystal(cells=3, density=0.5).replace(interaction=SquareWell(width, depth))
    sim = carom.Simulation(scene, kT=kT, seed=1)
    sim.run(collisions=10_000)
    total = 1.5 * kT * scene.n + depth * sim.interaction.bonds_per_particle * scene.n
    assert sim.statistics.energy_drift * 1.5 * kT * scene.n < 1e-12 * total
    assert sim.statistics.worst_overlap < 1e-12
    clearly, at_most = inside(sim, width)
    assert clearly <= set(map(tuple, read_steps(sim._state.engine.neighbors)[0].tolist())) <= at_most


def test_hysteretic_steps_lose_what_their_energies_differ_by():
    steps = Steps([1.0, 1.5], [INF, -1.0], leaving=[INF, -1.5])
    scene = carom.Scene.crystal(cells=3, density=0.3).replace(interaction=StepTable(steps))
    sim = carom.Simulation(scene, kT=3.0, seed=1)
    kinetic = 0.5 * float((sim.frame().velocities ** 2).sum())
    start, before = kinetic + sim.potential_energy, sim.interaction.out
    sim.run(collisions=3000)
    lost = 0.5 * (sim.interaction.out - before)
    kinetic = 0.5 * float((sim.frame().velocities ** 2).sum())
    assert kinetic + sim.potential_energy == pytest.approx(start - lost, rel=1e-12)


@pytest.mark.parametrize("interaction", [case[0] for case in WELLS.values()])
def test_wells_hold_the_conditions_of_the_paper(interaction):
    report = carom.check(interaction)
    assert report.passed, report
    assert {"I", "II", "IV", "V", "momentum"} <= report.tried.keys()


def test_steps_of_equal_energy_are_where_the_potential_is_half_way():
    def u(r):
        return 4.0 * (r**-12 - r**-6)

    steps = from_potential(u, reach=2.5, core=0.95, count=12, spacing="energy")
    assert steps.energies[0] == INF
    inside_of, outside = np.array(steps.energies[1:]), np.array([*steps.energies[2:], 0.0])
    found = np.array([u(r) for r in steps.distances[1:]])
    assert np.abs(found - 0.5 * (inside_of + outside)).max() < 1e-9
    assert np.ptp(np.abs(inside_of - outside)) < 1e-9


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_steps_of_equal_volume_keep_the_integral_of_the_potential(d):
    def u(r):
        return -(r ** (-2.0 * d))

    steps = from_potential(u, reach=2.0, core=1.0, count=7, dimension=d)
    volumes = np.diff(np.array(steps.distances) ** d)
    assert np.ptp(volumes) < 1e-12
    assert volumes @ steps.energies[1:] == pytest.approx(-(1.0 - 2.0**-d), rel=1e-9)


def test_bonds_of_chains_and_rings_join_those_that_follow_each_other_from_the_first_on():
    assert chains(2, 3, first=4) == [(4, 5), (5, 6), (7, 8), (8, 9)]
    assert {*rings(2, 3, first=4)} == {(4, 5), (5, 6), (4, 6), (7, 8), (8, 9), (7, 9)}


TOML = """
[scene]
lattice = "fcc"
cells = 4
density = 0.3

[scene.interaction]
"""


@pytest.mark.parametrize(
    ("text", "interaction"),
    [
        ('type = "square-well"\nrange = 1.5\ndepth = 1.0', SquareWell(1.5, 1.0)),
        ('type = "steps"\ndistances = [1, 1.2, 1.6]\nenergies = [inf, 0.5, -1]\nleaving = [inf, 0.5, -1]',
         StepTable(Steps([1.0, 1.2, 1.6], [INF, 0.5, -1.0]))),
        ('type = "bonds"\npairs = [[0, 1]]\nouter = 1.2\nothers = {type = "square-well"}',
         Bonds([(0, 1)], outer=1.2, others=SquareWell())),
    ],
)  # fmt: skip
def test_a_scene_file_describes_an_interaction(text, interaction):
    plan = SceneFile.from_toml(TOML + text)
    assert plan.scene.interaction == interaction
    assert SceneFile.from_toml(plan.to_toml()) == plan
    assert tomllib.loads(plan.to_toml())["scene"]["interaction"]["type"] in text


def test_a_scene_file_runs_from_the_command_line_beside_no_theory_of_hard_spheres(tmp_path):
    (tmp_path / "well.toml").write_text(
        TOML + 'type = "square-well"\n[run]\nequilibration = 5\ncollisions_per_particle = 40\nframes = 2\n'
        "pictures = false\n"
    )
    done = CliRunner().invoke(cli.app, ["run", str(tmp_path / "well.toml"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["theory"] == []
    assert summary["energy_drift"] < 1e-13
    resumed = carom.Simulation.load(tmp_path / "out" / "checkpoint.h5")
    assert resumed.scene.interaction == SquareWell(1.5, 1.0)


def test_the_page_runs_as_it_stands(capsys):
    page = Path(__file__).parents[2] / "docs" / "wells.md"
    cells = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    page_of = {}
    exec("\n".join(cells), page_of)
    assert "True True" in capsys.readouterr().out.splitlines()
    # What the page says of the temperature: it is 1.5 within the errors of two stretches, of 1000 and of 750.
    kT = page_of["found"].kT
    assert abs(kT.mean - 1.5) < 4.0 * kT.error * math.sqrt(1.0 + 1000 / 750)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: SquareWell(1.0), "range must be greater than 1"),
        (lambda: SquareWell(1.5, math.nan), "depth must be finite"),
        (lambda: Steps([], []), "at least one distance"),
        (lambda: Steps([1.0, 1.0 + 1e-9], [INF, -1.0]), "rise by more than rounding"),
        (lambda: Steps([-1.0], [INF]), "rise by more than rounding"),
        (lambda: Steps([1.0, 1.5], [INF]), "one energy for each of the 2 distances"),
        (lambda: Steps([1.0, 1.5], [INF, INF]), "Only the first of energies may be infinite"),
        (lambda: Steps([1.0], [INF], outside=INF), "no pair could be anywhere"),
        (lambda: Steps("ab", [1.0]), "must be a list of numbers"),
        (lambda: Steps([1.0], [INF], outside="far"), "outside must hold numbers"),
        (lambda: Bonds(3, outer=1.0), "pairs must be m pairs"),
        (lambda: from_potential(1.0, reach=2.0, core=1.0, count=3), "u must be a function"),
        (lambda: Steps([1.0, 1.5], [INF, -1.0], leaving=[0.0, -2.0]), "in both energies and leaving"),
        (lambda: Steps([1.0, 1.5], [0.0, -1.0], leaving=[INF, -2.0]), "in both energies and leaving"),
        (lambda: from_table({"type": "steps", "table": AA, "distances": [1.0]}, "interaction"), "two ways"),
        (lambda: StepTable([[AA, CORE], [AB, AA]]), "a pair has one potential"),
        (lambda: StepTable([[AA, AB]]), "as many columns as rows"),
        (lambda: StepTable(Steps([1.0, 1.5], [INF, 0.0], outside=-1.0)), "only a bond has"),
        (lambda: Bonds([], outer=1.0), "at least one bond"),
        (lambda: Bonds([(1, 1)], outer=1.0), "bonded to itself"),
        (lambda: Bonds([(0, 1), (1, 0)], outer=1.0), "names a pair twice"),
        (lambda: Bonds([(0, -1)], outer=1.0), "0 or more"),
        (lambda: Bonds([(0, 1)]), "needs outer"),
        (lambda: Bonds([(0, 1)], outer=1.0, bond=CORE), "say the same as bond"),
        (lambda: Bonds([(0, 1)], bond={"distances": [1.0]}), "needs energies"),
        (lambda: Bonds([(0, 1)], bond=CORE), "else the two could part"),
        (lambda: Bonds([(0, 1)], outer=1.0, others=CORE), "must be a SquareWell or a StepTable"),
        (lambda: rings(1, 2), "length must be at least 3"),
        (lambda: from_potential(lambda r: INF, reach=2.0, core=1.0, count=3), "expected finite energies"),
        (lambda: from_potential(lambda r: r, reach=0.5, core=1.0, count=3), "reach must be greater than"),
    ],
)
def test_bad_steps_are_refused_in_a_sentence(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


def test_scenes_that_cannot_have_steps_are_refused_in_a_sentence():
    well, cubic = SquareWell(1.5, 1.0), carom.Scene.crystal(cells=3, density=0.4)
    with pytest.raises(InputError, match="components of one diameter"):
        cubic.replace(diameter=np.where(np.arange(cubic.n) % 2, 1.0, 0.8), interaction=well)
    with pytest.raises(InputError, match="Steps are given for 2 species"):
        cubic.replace(interaction=TABLE)
    for beyond in (cubic.n, 999):
        with pytest.raises(InputError, match=f"A bond names component {beyond}, and there are {cubic.n}"):
            cubic.replace(interaction=Bonds([(0, beyond)], outer=1.2))
    scene = cubic.replace(interaction=well)
    with pytest.raises(InputError, match="kept in neighbor lists"):
        carom.Simulation(scene, tuning=carom.Tuning(neighbors="sectors"), seed=0)
    for settings in ({"growth": 0.1}, {"tuning": carom.Tuning(precision="single")}):
        with pytest.raises(InputError, match="is not for pairs on steps"):
            carom.Simulation(scene, **settings)
    with pytest.raises(InputError, match="impact is not for pairs on steps"):
        carom.Simulation(scene.replace(impact=0.9), seed=0)
    with pytest.raises(InputError, match="needs box edges above"):
        carom.Simulation(carom.Scene([[0.5] * 3, [2.0] * 3], 3.0, interaction=well), seed=0)
    with pytest.raises(OverlapError, match=r"0\.9 apart, inside the hard core of 1"):
        carom.Scene([[1.0, 1.0], [1.9, 1.0]], 8.0, interaction=well)
    with pytest.raises(InputError, match=r"bonded and 2 apart; a bond reaches to 1\.2"):
        carom.Scene([[1.0, 1.0], [3.0, 1.0]], 8.0, interaction=Bonds([(0, 1)], outer=1.2))
    with pytest.raises(InputError, match="have no steps"):
        _ = carom.Simulation(cubic, seed=0).potential_energy
    with pytest.raises(InputError, match=r"Steps end at 9e-07, and at 1; expected at least 9\.5e-07"):
        cubic.replace(interaction=StepTable(Steps([9e-7, 1.0], [INF, 1.0])))


@pytest.mark.parametrize(("depth", "kT"), [(1e14, 1.0), (-1e27, 1.0), (1.0, 1e-14), (1e20, 1e6)])
def test_steps_beyond_the_digits_of_a_thermal_energy_are_refused(depth, kT):
    scene = carom.Scene.crystal(cells=3, density=0.4).replace(interaction=SquareWell(1.5, depth))
    with pytest.raises(InputError, match=r"high, where kT is \S+; expected at most 8\.8e\+12 kT"):
        carom.Simulation(scene, kT=kT, seed=1)
    usual = carom.Simulation(scene, kT=abs(depth), seed=1)
    before = usual.frame().velocities
    with pytest.raises(InputError, match="high, where kT is"):
        usual.rescale(kT=abs(depth) * 1e-14)
    np.testing.assert_array_equal(usual.frame().velocities, before)
    # Of what rests, or drifts in common, no step is too high.
    rest = np.broadcast_to([abs(depth) ** 0.5, 0.0, 0.0], scene.positions.shape)
    for velocities in (0.0 * rest, rest):
        assert carom.Simulation(scene.replace(velocities=velocities), seed=0).kT == 0.0
    noise = rest * (1.0 + 1e-15 * np.arange(scene.n)[:, None])
    assert 0.0 < carom.Simulation(scene.replace(velocities=noise), seed=0).kT < 1e-20 * abs(depth)


@pytest.mark.slow
def test_a_dilute_gas_has_the_exact_virial_coefficients():
    rho, well = 0.03, SquareWell(1.5, 1.0)
    scene = carom.Scene.crystal(cells=5, density=rho).replace(interaction=well)
    sim = carom.Simulation(scene, kT=2.0, seed=4)
    for _ in range(6):
        sim.run(collisions_per_particle=60)
        sim.rescale(2.0)
    sim.run(collisions_per_particle=100)
    start, energies = sim.interaction, []
    pressure = sim.measure(carom.Pressure(), collisions=3_000_000, blocks=64)
    kT = (sim.interaction - start).kT
    for _ in sim.sample(every=2.0, count=1500):
        energies.append(sim.potential_energy / scene.n)

    def virial(beta):  # Kihara, Rev. Mod. Phys. 25 (1953) 831; for widths up to 2
        d, l, b0 = math.exp(beta) - 1.0, 1.5, 2.0 * math.pi / 3.0
        b2 = b0 * (1.0 - (l**3 - 1.0) * d)
        third = 5.0 - (l**6 - 18 * l**4 + 32 * l**3 - 15) * d
        third -= (2 * l**6 - 36 * l**4 + 32 * l**3 + 18 * l**2 - 16) * d**2
        third -= (6 * l**6 - 18 * l**4 + 18 * l**2 - 6) * d**3
        return b2, b0**2 / 8.0 * third

    beta = 1.0 / kT
    b2, b3 = virial(beta)
    z, ours = 1.0 + b2 * rho + b3 * rho**2, pressure.Z
    # What is left out is of the order of (b0 rho)^3, and 1 / n of the second coefficient.
    rest = (2.0 * math.pi / 3.0 * rho) ** 3 + abs(b2) * rho / scene.n
    assert abs(ours.mean - z) < 4.0 * ours.error + rest
    assert 4.0 * ours.error + rest < 0.1 * abs(b2 * rho)
    h = 1e-5
    slopes = [(a - b) / (2.0 * h) for a, b in zip(virial(beta + h), virial(beta - h), strict=True)]
    u = rho * slopes[0] + 0.5 * rho**2 * slopes[1]
    blocks = np.mean(np.reshape(energies, (30, -1)), axis=1)
    assert np.mean(energies) == pytest.approx(u, abs=4.0 * blocks.std() / math.sqrt(30) + 0.01 * abs(u))
    assert sim.interaction.kT > 0.0


def test_a_heat_capacity_follows_from_the_variance_of_the_temperature():
    # var(K) / <K>^2 = (2 / f) (1 - f / 2 C): an ideal gas has none; f = 6 and C = 12 make 1 / 4.
    assert heat_capacity([2.0, 2.0, 2.0], 6) == 3.0
    assert heat_capacity([1.0, 3.0], 6) == 12.0
    assert heat_capacity([0.5, 1.5, 0.5, 1.5], 2) == pytest.approx(4.0 / 3.0)
    assert heat_capacity([1.0, 3.0], 8) == math.inf


@pytest.mark.slow
def test_the_heat_capacity_of_fluctuations_is_the_slope_of_the_energy():
    def mean_energy(kT):
        sim = fluid(kT=kT, cells=4, density=0.2)
        for _ in range(8):
            sim.run(collisions_per_particle=60)
            sim.rescale(kT)
        sim.run(collisions_per_particle=100)
        samples, energies = [], []
        for _ in sim.sample(every=1.0, count=3000):
            samples.append(sim.kT)
            energies.append(sim.potential_energy)
        return np.mean(samples), np.mean(energies), samples, sim.degrees_of_freedom

    cold, warm, middle = (mean_energy(kT) for kT in (1.9, 2.1, 2.0))
    slope = (warm[1] - cold[1]) / (warm[0] - cold[0]) + 0.5 * middle[3]
    # 3000 samples know a variance to sqrt(2 / 3000) = 2.6 %, and C from it to 3 %; the slope is as good.
    assert heat_capacity(middle[2], middle[3]) == pytest.approx(slope, rel=0.12)


@pytest.mark.parametrize("depth", [1.0, -0.5])
def test_a_pair_exactly_at_the_edge_of_a_well_starts_outside(depth):
    hair = 2.0**-50  # a unit in the last place of the coordinates
    for apart, energy in ((1.5, 0.0), (1.5 + hair, 0.0), (1.5 - hair, -depth), (1.0, -depth)):
        places = [[2.0, 2.0, 2.0], [2.0 + apart, 2.0, 2.0]]
        scene = carom.Scene(places, 8.0, interaction=SquareWell(1.5, depth), velocities=np.zeros((2, 3)))
        pairs, steps = first_steps(scene)
        levels = {0: 0.0, 1: -depth}
        assert sum(levels[int(step)] for step in steps) == energy
        assert len(pairs) <= 1


def test_each_of_several_edges_belongs_to_the_step_outside_of_it():
    staircase = StepTable([[Steps([1.0, 1.25, 1.5], [INF, -2.0, -1.0])]])
    pairs = np.array([[0, 1]] * 6)
    distances = np.array([1.0, np.nextafter(1.25, 0.0), 1.25, np.nextafter(1.5, 0.0), 1.5, 1.75])
    assert staircase.steps_of(pairs, distances, None, 1.0).tolist() == [2, 2, 1, 1, 0, 0]
