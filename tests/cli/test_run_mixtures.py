"""What a run of a mixture, or between walls, leaves of g(r): a table of all pairs, or why there is none."""

import csv

import numpy as np
import pytest
from helpers.marks import slow

import carom
from carom import Scene, io, theory
from carom.cli.results import show
from carom.errors import FileError, InputError
from carom.models import Gravity, Loss
from carom.observables import RDF
from carom.observables.rdf import PartialRDF, species_of
from carom.pictures import plots
from carom.pictures.plots import partial_rdf as draw
from carom.scene_file.scene_file import SceneFile
from carom.studies.phase import ENDS, _mixture_theory, remark

BINARY = """
[scene]
dimension = {dimension}
packing_fraction = 0.2
{more}
species."a, b" = {{ count = 40, diameter = 1.0 }}
species.small = {{ count = 80, diameter = 0.5 }}

[run]
equilibration = 20
collisions_per_particle = 50
frames = 20
write = {trajectory}
"""


def plan(dimension=3, more="", trajectory='["h5md"]'):
    return SceneFile.from_toml(BINARY.format(dimension=dimension, more=more, trajectory=trajectory))


def table_of(path):
    """Columns of a table by name, as arrays without the empty cells, and the lines before it."""
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("# ")]
    rows = list(csv.DictReader(lines[len(comments) :]))
    return {name: np.array([float(row[name]) for row in rows if row[name]]) for name in rows[0]}, comments


@pytest.mark.parametrize("dimension", [slow(2), 3])
def test_a_run_of_a_mixture_leaves_and_shows_g_of_every_pair(tmp_path, dimension, monkeypatch, capsys):
    drawn, draw_pressure = {}, plots.pressure

    def seen(estimate, *, equations, path):
        drawn.update(equations)
        return draw_pressure(estimate, equations=equations, path=path)

    monkeypatch.setattr(plots, "pressure", seen)
    result = carom.run(plan(dimension), tmp_path / "run")
    rows = result.summary["theory"]
    assert drawn == {row["name"]: row["Z"] for row in rows}
    assert len(drawn) == dimension - 1
    columns, comments = table_of(result.folder / "rdf.csv")
    frames = io.read(result.folder / "trajectory.h5md", ":")
    pairs = [("a, b", "a, b"), ("a, b", "small"), ("small", "small")]
    assert [name for name in columns if name.startswith("g ")] == [f"g {a}-{b}" for a, b in pairs]
    for (a, b), contact in zip(pairs, (1.0, 0.75, 0.5), strict=True):
        alone = RDF(pair=(a, b)).over(frames)
        name = f"{a}-{b}"
        assert columns[f"r_lo {name}"][0] == contact
        for key, values in {"r_hi": alone.edges[1:], "g": alone.g, "error": alone.error}.items():
            assert np.array_equal(columns[f"{key} {name}"], values), (key, name)
        assert columns[f"counts {name}"].sum() == alone.counts.sum() > 0
        assert f"# contact {name}: {contact}" in comments
        assert result.summary["contact_values_from_rdf"][name]["mean"] == alone.contact_value.mean
    assert result.summary["without_rdf"] is None
    assert (result.folder / "rdf.png").stat().st_size > 10_000
    show(result, result.folder, as_json=False)
    shown = " ".join(capsys.readouterr().out.split())
    for a, b in pairs:
        assert f"g(σ+) {a}-{b}" in shown


@pytest.mark.parametrize(
    ("more", "trajectory", "says"),
    [
        slow('walls = "z"', '["h5md"]', "No g(r): with walls"),
        slow('obstacles.ball = { type = "ball", center = [1, 1, 1], radius = 1.0 }', '["h5md"]', "obstacles"),
        ("", "[]", "none was asked for"),
    ],
)
def test_a_run_without_g_says_why(tmp_path, capsys, monkeypatch, more, trajectory, says):
    result = carom.run(plan(3, more, trajectory), tmp_path / "run")
    assert not (result.folder / "rdf.csv").exists()
    assert not (result.folder / "rdf.png").exists()
    assert says in result.summary["without_rdf"]
    assert result.summary["contact_values_from_rdf"] == {}
    show(result, result.folder, as_json=False)
    assert says in " ".join(capsys.readouterr().out.split())
    drawn = []
    monkeypatch.setattr(plots, "snapshot", lambda frame, obstacles, path: drawn.extend(obstacles))
    if trajectory != "[]":
        result.plot()
    assert [each.name for each in drawn] == (["ball"] if "ball" in more else [])


@pytest.mark.slow
def test_a_run_tells_what_walls_and_obstacles_bore_and_who_met_whom(tmp_path, capsys):
    more = (
        'walls = "z"\nimpact = { restitution = 0.99, elastic_below = 0.1 }\n'
        'obstacles.ball = { type = "ball", center = [1, 1, 1], radius = 0.5 }\n'
        'obstacles.floor = { type = "plane", normal = [0, 0, 1], offset = 0.01 }'
    )
    result = carom.run(plan(3, more, "[]"), tmp_path / "run")
    summary = result.summary
    lower, upper, ball, floor = summary["obstacles"]
    names = ["z_low", "z_high", "ball", "floor"]
    assert [each["name"] for each in summary["obstacles"]][:2] == names[:2]
    # Nobody reaches the wall behind the plane; what stands before it bears what the other wall bears.
    assert lower["force"]["mean"] == 0.0
    assert floor["pressure"]["mean"] is None
    errors = (upper["force"]["error"], floor["force"]["error"])
    assert abs(upper["force"]["mean"] - floor["force"]["mean"]) < 6.0 * np.hypot(*errors)
    area = summary["box"][0] ** 2
    assert upper["pressure"]["mean"] == pytest.approx(upper["force"]["mean"] / area, rel=1e-12)
    assert ball["pressure"]["mean"] == pytest.approx(ball["force"]["mean"] / np.pi, rel=1e-12)
    assert list(summary["collisions_by_species"]) == ["a, b-a, b", "a, b-small", "small-small"]
    counts = summary["collisions_by_species"].values()
    # The measured stretch begins at a multiple of its segments: a few collisions lie before it.
    before = sum(counts) - summary["collisions"] - summary["equilibration"]["collisions"]
    assert 0 <= before < summary["n"]
    assert summary["spared_contacts"] > 0
    show(result, result.folder, as_json=False)
    shown = " ".join(capsys.readouterr().out.split())
    for text in ("P σ³/kT on z_high", "force σ/kT on floor", "elastic contacts"):
        assert text in shown


def scene_of(diameters, **more):
    return Scene(
        Scene.crystal(cells=4, lattice="cubic", packing_fraction=0.01).positions[: len(diameters)], 20.0,
        diameter=diameters, **more,
    )  # fmt: skip


def test_sizes_without_names_are_species_and_many_sizes_are_none():
    scene = scene_of([1.0] * 30 + [2.0] * 20)
    assert species_of(scene).tolist() == [1] * 30 + [0] * 20
    assert species_of(scene_of(np.linspace(1.0, 2.0, 50))) is None
    assert PartialRDF(scene_of(np.linspace(1.0, 2.0, 50))).result() == {}
    # A species of several sizes is none either; its few sizes count instead.
    mixed = scene_of([1.0, 1.5] * 20, species=np.zeros(40, dtype=np.int64))
    assert species_of(mixed).tolist() == [1, 0] * 20


def names_of(scene):
    return [row.name.partition(",")[0] for row in _mixture_theory(scene)]


def test_theory_is_that_of_elastic_mixtures_that_fly_freely():
    scene = scene_of([1.0] * 8 + [0.5] * 8)
    assert names_of(scene) == ["BMCSL", "Santos-Yuste-Lopez de Haro"]
    for other in (
        {"impact": Loss(0.9, contact_time=1e-3)},
        {"motion": Gravity((0.0, 0.0, -1.0))},
        {"pinned": [0, 1, 2, 3]},
        {"impact": 0.9},
    ):
        assert names_of(scene.replace(**other)) == [], other


def test_theory_ends_where_its_equation_of_equal_spheres_does(monkeypatch):
    scene = scene_of([1.0] * 8 + [0.5] * 8)
    monkeypatch.setitem(theory.FREEZING, 3, 0.5 * scene.packing_fraction)
    assert names_of(scene) == ["BMCSL"]
    assert remark(None, scene) == ""
    monkeypatch.setitem(ENDS, "BMCSL", 0.6 * scene.packing_fraction)
    assert names_of(scene) == []
    assert remark(None, scene).startswith("BMCSL ends at packing fraction")
    # And where nobody knows one: the run is not lost.
    seven = Scene([[1.0] * 7, [3.0] * 7], 5.0, diameter=[1.0, 0.5])
    assert names_of(seven) == []


@pytest.mark.usefixtures("plain")
def test_pairs_touch_where_the_scene_says(tmp_path):
    species = np.repeat([0, 1, 2], [30, 29, 1])
    contact = np.array([[1.0, 0.6, 1.0], [0.6, 1.0, 1.0], [1.0, 1.0, 1.0]])
    sites = Scene.crystal(cells=4, lattice="cubic", packing_fraction=0.1)
    some = np.random.default_rng(2).permutation(sites.positions)[:60]
    scene = Scene(some, sites.box, diameter=1.0, species=species, contact=contact)
    frames = list(carom.Simulation(scene, kT=1.0, seed=1).sample(every=0.1, count=2))
    found = PartialRDF(scene).over(frames)
    # One component alone is no pair with itself.
    assert {name: one.diameter for name, one in found.items()} == {
        "0-0": 1.0, "0-1": 0.6, "0-2": 1.0, "1-1": 1.0, "1-2": 1.0,
    }  # fmt: skip
    found.save(tmp_path / "rdf.csv")
    columns, _ = table_of(tmp_path / "rdf.csv")
    lengths = {name: columns[f"g {name}"].size for name in found}
    # Bins are a fiftieth of the contact distance, as far as half of the box.
    assert lengths["0-1"] > lengths["0-0"] == lengths["1-1"]
    with pytest.raises(FileError, match="cannot be written"):
        found.save(tmp_path / "nowhere" / "rdf.csv")
    with pytest.raises(InputError, match="nothing to draw"):
        draw({})


def test_no_theory_holds_for_pairs_that_touch_at_other_distances_than_their_mean_diameter():
    species, sizes = [0] * 8 + [1] * 8, [1.0] * 8 + [0.5] * 8
    scene = scene_of(sizes)
    for between, names in ((0.75, True), (0.6, False)):
        contact = None if names else [[1.0, between], [between, 0.5]]
        assert bool(names_of(scene.replace(species=species, contact=contact))) == names
