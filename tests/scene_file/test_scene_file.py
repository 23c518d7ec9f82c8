"""Scene files: TOML, read strictly."""

from __future__ import annotations

import dataclasses
import string

import numpy as np
import pytest
from helpers.commands import refused
from helpers.frames import at_rest, write
from hypothesis import given, settings, strategies as st

import carom.io
from carom.declared import fields_of
from carom.errors import CaromWarning, FileError, InputError, OverlapError
from carom.frame import Frame
from carom.scene.scene import Scene
from carom.scene_file.scene_file import RunSpec, SceneFile, SceneSpec
from carom.spec import LARGEST_FILE


def test_an_empty_file_is_the_default_plan_of_2048_spheres_at_045():
    assert SceneFile.from_toml("") == SceneFile()
    scene = SceneFile().build_scene()
    assert (scene.n, scene.dimension) == (2048, 3)
    assert scene.packing_fraction == pytest.approx(0.45, rel=1e-14)


SCENES = [
    ("lattice = 'fcc'\ncells = 3\ndensity = 0.5", 108, 3),
    ("lattice = 'fcc'\ncells = [2, 3, 4]\npacking_fraction = 0.5", 96, 3),
    ("lattice = 'fcc'\nn = 256\npacking_fraction = 0.5", 256, 3),
    ("lattice = 'fcc'", 2048, 3),
    ("lattice = 'cubic'\ndimension = 1\nn = 7\npacking_fraction = 0.5", 7, 1),
    ("lattice = 'cubic'\ndimension = 4\ncells = 3\npacking_fraction = 0.2", 81, 4),
    ("lattice = 'triangular'\ncells = [4, 2]\npacking_fraction = 0.7", 16, 2),
    ("lattice = 'dn'\ndimension = 4\ncells = 2\npacking_fraction = 0.2", 128, 4),
    ("lattice = 'none'\nn = 50\ndimension = 2", 50, 2),
    ("n = 50", 50, 3),
    ("n = 50\ndimension = 7", 50, 7),
    ("n = 50\nbox = [9, 9.5]\ndiameter = 0.5\nmass = 2", 50, 2),
]


@pytest.mark.parametrize(("scene", "n", "dimension"), SCENES)
def test_a_section_scene_builds_its_scene(scene, n, dimension):
    plan = SceneFile.from_toml("[scene]\n" + scene)
    assert SceneFile.from_toml(plan.to_toml()) == plan
    built = plan.build_scene()
    assert (built.n, built.dimension) == (n, dimension)
    assert built.diameter == plan.scene.diameter
    assert built.mass == plan.scene.mass


def test_the_seed_places_random_spheres():
    text = "[scene]\nn = 20\n[run]\nseed = {}"
    first, again, other = (SceneFile.from_toml(text.format(s)).build_scene().positions for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


BAD = [
    ("[scen]\ncells = 8", r"\[scen\] is no known section; did you mean scene"),
    ("[color]", r"\[color\] is no known section \(known: code, pack, plan, run, scene, shear, study, trade"),
    ("[eos]\nseed = 1", r"\[eos\] is no known section; carom eos reads \[study\]"),
    ("[output]\nevent_log = true", r"\[output\] is no known section; its keys stand in \[run\]"),
    ("[study]\nn = 8", r"\[study\] is for another command; this one reads \[scene\] or \[run\]"),
    ("cells = 8", r"cells stands outside of any section; write it below one, such as \[scene\]"),
    ("scene = 8", r"\[scene\] must be a section, found 8"),
    ("[scene]\n[code]\n[[pack]]", r"\[pack\] must be a section, found a list"),
    ("[scene]\nceels = 8", r"\[scene\] ceels is no known key; did you mean cells"),
    ("[run]\nzzz = 8", r"\[run\] zzz is no known key \(known: barostat, check, checkpoint_every,"),
    ("[run]\ntrajectory = ['h5md']", r"trajectory is no known key; give write = "),
    ("[run]\npressure = 10.0", r"pressure is no known key; give barostat = \{ pressure = 10.0"),
    ("[scene]\ninitial = 'fcc'", r'initial is no known key; places are random; give lattice = "fcc"'),
    ("[model]\nkind = 'square-well'", "is no known section; a potential stands in .scene.: interaction"),
    ("[scene]\nseed = 2", r"seed is no known key; the section of a command has it, such as \[run\] seed = 2"),
    ("[scene]\nkT = 2.0", r"kT is no known key; the section of a command has it, such as \[run\] kT = 2.0"),
    ("[scene]\nphi = 0.3", "phi is no known key; it is called packing_fraction"),
    ("[run]\nphi = 0.3", r"phi is no known key; packing_fraction is a key of \[scene\]"),
    ("[run]\npacking_fracton = 0.3", "did you mean packing_fraction; packing_fraction is a key of .scene."),
    ("[run]\nrestitution = 0.9", r"in \[scene\], give impact = 0.9"),
    ("[scene]\nequilibration = 9", r"such as \[run\] equilibration = 500"),
    ("[scene]\ndt = 0.1", "dt is no known key; there is none, as events are computed"),
    ("[scene]\ntemperature = 2.0", r"temperature is no known key; .* a command has it, such as \[run\] kT"),
    ("[scene]\nbox = [.5, 1.0]", "a number begins with a digit: 0.5"),
    ("[scene]\ncells = ", "line 2|end of document"),
    ("[scene]\ncells = 1\nmass = 1 1\n", "line 3"),
    ("[scene]\ncells = 1\ncells = 2", "overwrite"),
    ("[scene]\ncells = '8'", "cells must be an integer, found the string '8'"),
    ("[scene]\ncells = 8.0", "integer, found 8.0"),
    ("[scene]\ncells = true", "integer, found the boolean true"),
    ("[scene]\ncells = [8, 'x', 8]", "integer, found the string 'x'"),
    ("[scene]\ncells = []", "one value an axis, found 0"),
    ("[scene]\ncells = 0", "between 1"),
    ("[scene]\nlattice = 'fcc'\ncells = 8\nn = 2048", "cells and n contradict"),
    ("[scene]\ndensity = 1\npacking_fraction = 0.4", "packing_fraction and density contradict"),
    ("[scene]\npacking_fraction = '0.45'", "found the string '0.45'.*plain number"),
    ("[scene]\npacking_fraction = 1.5", "at most 1"),
    ("[scene]\npacking_fraction = nan", "finite"),
    ("[scene]\npacking_fraction = true", "boolean"),
    ("[scene]\npacking_fraction = 1979-05-27", "found a date"),
    ("[scene]\ndiameter = '1 nm'", "reduced units"),
    ("[scene]\ndiameter = 0", "diameter must be"),
    ("[scene]\nmass = -1.0", "mass must be"),
    ("[scene]\nlattice = 'fc'", "found the string 'fc'; did you mean fcc"),
    ("[scene]\nlattice = 3", "must be one of none, fcc"),
    ("[scene]\nlattice = 'fcc'\ndimension = 2", "dimension is 3 with lattice"),
    ("[scene]\nlattice = 'dn'\ncells = 2\ndensity = 0.1\ndimension = 2", "at least 3"),
    ("[scene]\nlattice = 'fcc'\nbox = [9, 9, 9]", "box has no meaning with lattice"),
    ("[scene]\nn = 0", "n must be between 1"),
    ("[scene]\nn = 9\ncells = 2", "cells needs a lattice"),
    ("[scene]\nn = 9\nframe = 2", "frame has no meaning without a file"),
    ("[scene]\nn = 9\nbox = 9", "box must be a list of edges, found 9"),
    ("[scene]\nn = 9\nbox = [9, 0]", "box must be at least"),
    ("[scene]\nn = 9\nbox = [9, 9]\ndensity = 1", "density and box contradict"),
    ("[scene]\nn = 9\nbox = [9, 9]\ndimension = 3", "must have 3 edges, found 2"),
    ("[scene]\nfile = 3", "file must be a string"),
    ("[scene]\nfile = ''", "name of a file"),
    ("[scene]\nfile = 'a'\nn = 3", "n has no meaning with file"),
    ("[scene]\nfile = 'a'\nlattice = 'fcc'", "lattice has no meaning with file"),
    ("[run]\nkT = inf", "finite"),
    ("[run]\nkT = -1", "at least 0"),
    ("[run]\nseed = -1", "seed must be between 0"),
    ("[run]\nseed = 1.5", "seed must be an integer"),
    ("[run]\nseed = 9223372036854775808", "more than 18 digits"),
    ("[run]\nequilibration = -1", "at least 0"),
    ("[run]\ncollisions_per_particle = 0", "greater than 0"),
    ("[run]\ntime = 0", "greater than 0"),
    ("[run]\ntime = 1\nrelative_error = 0.1", "has time and relative_error: each says how long"),
    ("[run]\ntime = 1\nwalltime = 3", "walltime goes with relative_error, which is missing"),
    ("[run]\nrelative_error = 0.0", "at least 1e-09"),
    ("[run]\nrelative_error = 2.0", "at most 1"),
    ("[run]\nframes = 0", "frames must be between 1"),
    ("[run]\ncheckpoint_every = '10 s'", "plain number"),
    ("[run]\nneighbors = 'list'", "did you mean lists"),
    ("[run]\nwrite = 'h5md'", "list of formats, found the string"),
    ("[run]\nwrite = ['pdb']", "must be one of h5md, extxyz, gsd; found the string 'pdb'"),
    ("[run]\nwrite = ['gsd', 'gsd']", "names a format twice"),
    ("[run]\nevent_log = 1", "true or false, found 1"),
    ("[run]\npictures = 'yes'", "true or false, found the string"),
    ("[scene]\ninteraction = 0", "interaction must be a table, found 0"),
    ("[scene]\nmotion = 1979-05-27", "motion must be a table"),
    ("[scene]\nimpact = ['loss']", "impact must be a table, found a list of 1"),
    ("x = " + "[" * 9000, "nested too deeply"),
    ("x = " + "1" * 9000, "no valid TOML.*expected a scene file .*, or frames|outside of any section"),
    ("ITEM: TIMESTEP", "no valid TOML.*expected a scene file .*, or frames with the suffix of a format"),
    ("#" * (LARGEST_FILE + 1), "at most"),
]


SPECIES = "species = {a = {fraction = 0.25}, b = {fraction = 0.75}}"
BAD_SCENES = [
    ("species = 3", "tables with names"),
    ("species = [3]", r"tables with names, as \[scene.species.small\]; found a list"),
    ("[[scene.species]]\nname = 'a'", "tables with names"),
    ("species.a = 3", "species a must be a table"),
    ("species.a = {color = 1}", "species a has no 'color'"),
    ("species.a = {}", "a count for each, or a fraction"),
    ("species = {a = {count = 1}, b = {fraction = 1}}", "a count for each, or a fraction"),
    ("species.a = {count = 5}\nn = 5", "n has no meaning"),
    ('species."" = {fraction = 1}', "must have a name"),
    ("species = {a = {fraction = 0.5}, b = {fraction = 0.4}}", "add up to 0.9, and all particles are 1"),
    ("species = {b = {fraction = 0.5, name = 'a'}, a = {fraction = 0.5}}", "different names"),
    (SPECIES + "\ndiameter = 1.0", "diameter has no meaning with species"),
    (SPECIES + "\nmass = 2.0", "mass has no meaning with species"),
    (SPECIES + "\nsizes = {type = 'power', ratio = 0.5}", "sizes has no meaning with species"),
    (SPECIES + "\ncontact = [1.0]", "list of lists"),
    ("contact = [[1.0]]", "contact needs"),
    ("walls = 1", "walls must name axes"),
    ("walls.x_lo = {}", "no wall 'x_lo' in 3 dimensions; did you mean x_low"),
    ("walls.x_low = 3", "wall x_low must be a table"),
    ("walls.x_low = {color = 1}", "wall x_low has no 'color'"),
    ("walls.x_low = {impact = 0.9, kT = 1.0}", "impact or kT"),
    ("walls.x_low = {shake = {amplitude = 1.0}}", "sine needs period"),
    ("periodic = false", 'axes without walls are periodic: give walls = "y"'),
    ("impact = 0", "greater than 0"),
    ("restitution = 0.9", "give impact = 0.9"),
    ("elastic_below = 0.1", "restitution = 0.9, elastic_below"),
    ("obstacles.a = {type = 'hole'}", "type of an obstacle"),
    ("obstacles.a = {type = 'ball', center = [0, 0, 0]}", "obstacles a: .* of type ball needs radius"),
    ("obstacles.a = 3", "must be an obstacle"),
    ("obstacles = [3]", r"tables with names, as \[scene.obstacles.pillar\]; found a list"),
    ("file = 'x.h5md'\n" + SPECIES, "species has no meaning"),
]


@pytest.mark.parametrize(
    ("text", "says"), [*BAD, *(("[scene]\n" + lines, says) for lines, says in BAD_SCENES)]
)
def test_a_bad_scene_file_is_named_in_one_sentence(text, says):
    with pytest.raises(InputError, match=says) as caught:
        SceneFile.from_toml(text)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 250


def test_the_number_nearest_to_n_fills_the_lattice_where_the_key_says_so():
    with pytest.warns(CaromWarning, match="^2048 particles were placed"):
        plan = SceneFile.from_toml(
            "[scene]\nlattice = 'fcc'\nn = 2000\npacking_fraction = 0.5\nnearest = true"
        )
    assert plan.build_scene().n == plan.scene.n == 2048
    again = SceneFile.from_toml(plan.to_toml()).scene
    assert again == plan.scene
    with pytest.warns(CaromWarning, match="^864 particles were placed"):
        assert again.replaced(n=1000).n == 864  # as an option --n
    assert SceneSpec(lattice="fcc", cells=3, nearest=False) == SceneSpec(lattice="fcc", cells=3)
    for keys, says in (({}, "without a lattice"), ({"lattice": "fcc", "cells": 3}, "contradict")):
        with pytest.raises(InputError, match=says):
            SceneSpec(nearest=True, **keys)
    said = refused("run", "--lattice", "fcc", "--n", "1000", "--out", "never")
    assert "take n = 864 or 1372 (nearest=True does, as an option --nearest)" in said


@pytest.mark.parametrize(
    "change", [{"mass": "1"}, {"cells": 2.5}, {"file": 3}, {"density": 3.0}, {"packing_fraction": 7}]
)
def test_a_plan_made_in_python_is_checked_alike(change):
    with pytest.raises(InputError):
        dataclasses.replace(SceneFile().scene, **change)


def test_another_lattice_leaves_out_the_cells_of_the_one_before_and_keeps_n():
    celled = SceneSpec(lattice="fcc", cells=3, density=0.5)
    counted = SceneSpec(lattice="fcc", n=108, density=0.5)
    assert celled.replaced(lattice="none").cells is None
    assert celled.replaced(lattice="fcc").cells == celled.replaced(density=0.4).cells == 3
    assert counted.replaced(lattice="none").build(seed=1).n == 108


def test_a_scene_starts_from_a_frame_of_a_file(tmp_path):
    start = Scene.random(10, dimension=2, seed=3)
    velocities = np.random.default_rng(1).standard_normal((4, 10, 2))
    (tmp_path / "old").mkdir()
    still = at_rest(start, images=np.zeros((10, 2), int))
    frames = [dataclasses.replace(still, time=float(k), step=k, velocities=velocities[k]) for k in range(4)]
    write(tmp_path / "old" / "run.h5md", frames)
    scene_file = tmp_path / "scene.toml"
    scene_file.write_text("[scene]\nfile = 'old/run.h5md'\nframe = 2\n")
    plan = SceneFile.load(scene_file)
    scene = plan.build_scene()
    np.testing.assert_array_equal(scene.positions, start.positions)
    np.testing.assert_array_equal(scene.velocities, velocities[2])
    for frame in (0, 1, -1, -4):
        other = dataclasses.replace(plan, scene=plan.scene.replaced(frame=frame))
        np.testing.assert_array_equal(other.build_scene().velocities, velocities[frame])
    warmer = dataclasses.replace(plan, run=plan.run.replaced(kT=2.0))
    assert warmer.build_scene().velocities is None
    assert (plan.run.kT, warmer.run.kT) == (None, 2.0)
    assert SceneFile.from_toml(plan.to_toml()) == plan


XYZ = """3
Lattice="6 0 0 0 5 0 0 0 4" Properties=species:S:1:pos:R:3{more} pbc="T T T"
A 1.0 1.0 1.0{v}
A 3.0 1.0 1.0{v}
A 1.0 3.0 1.0{v}
"""
DUMP = """ITEM: TIMESTEP
0
ITEM: NUMBER OF ATOMS
3
ITEM: BOX BOUNDS pp pp pp
0 6
0 5
0 4
ITEM: ATOMS id type x y z{more}
1 1 1.0 1.0 1.0{v}
2 1 3.0 1.0 1.0{v}
3 1 1.0 3.0 1.0{v}
"""


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize(
    ("name", "text", "columns"),
    [
        ("start.xyz", XYZ, ":vel:R:3"),
        ("start.extxyz", XYZ, ":velocities:R:3"),
        ("start.dump", DUMP, " vx vy vz"),
    ],
)
def test_a_start_from_the_file_of_another_program_moves(name, text, columns, tmp_path):
    """Its velocities are those of the file, or drawn, where it has none or a temperature is given."""
    path = tmp_path / name
    spec = SceneSpec(file=str(path), diameter=1.0)
    path.write_text(text.format(more="", v=""))
    with pytest.warns(CaromWarning, match="no velocities"):
        drawn = spec.build(1)
    assert drawn.velocities is None
    np.testing.assert_array_equal(drawn.positions, [[1.0, 1.0, 1.0], [3.0, 1.0, 1.0], [1.0, 3.0, 1.0]])
    sim = carom.Simulation(drawn, seed=1)
    assert sim.kT == pytest.approx(1.0)
    assert (sim.velocities != 0.0).all()
    path.write_text(text.format(more=columns, v=" 0.5 -0.25 0.125"))
    with pytest.warns(CaromWarning, match="assumed a mass of 1"):
        given, drawn = spec.build(1), spec.build(1, kT=2.0)
    np.testing.assert_array_equal(given.velocities, [[0.5, -0.25, 0.125]] * 3)
    assert drawn.velocities is None


def test_a_missing_folder_binary_or_large_file_is_refused(tmp_path):
    (tmp_path / "binary").write_bytes(b"\x89HDF\xff\xfe")
    (tmp_path / "large").write_bytes(b"#" * (LARGEST_FILE + 1))
    for name, says in (
        ("missing", "does not exist"),
        (".", "not a file"),
        ("binary", "not text in UTF-8"),
        ("large", "more than"),
        ("x" * 5000, "cannot be read|does not exist"),
        ("\0", "cannot be read|does not exist"),
    ):
        with pytest.raises(FileError, match=says):
            SceneFile.load(tmp_path / name)


def test_an_error_in_a_file_names_the_file(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text("[scene]\nceels = 8")
    with pytest.raises(InputError, match=r"scene\.toml: \[scene\] ceels"):
        SceneFile.load(path)


def test_a_file_with_a_byte_order_mark_and_windows_lines_is_read(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf[scene]\r\nn = 3\r\n")
    assert SceneFile.load(path).scene.n == 3


@given(name=st.text(min_size=1, max_size=30).filter(lambda s: "\0" not in s))
def test_any_name_of_a_file_survives_the_round_trip(name):
    try:
        plan = SceneFile(SceneSpec(file=name))
    except InputError:
        assert name != name.encode("utf-8", "ignore").decode()
        return
    assert SceneFile.from_toml(plan.to_toml()) == plan


KEYS = [name for spec in (SceneSpec, RunSpec) for name in fields_of(spec)]
KEYS += ["", "é", "a.b", "packing_fractoin", "__class__", "x" * 100]

toml_value = st.one_of(
    st.integers().map(str),
    st.floats().map(lambda x: repr(x)),
    st.sampled_from(
        ["true", "false", "1979-05-27", "07:32:00", "{a = 1}", "[]", "[[1]]", "0x1F", "'1 nm'", "''"]
    ),
    st.sampled_from(["'fcc'", "'cubic'", "'triangular'", "'dn'", "'none'", "'file'", "'lists'", "['gsd']"]),
    st.lists(st.integers(-2, 9), max_size=4).map(repr),
    st.lists(st.floats(0, 20), max_size=4).map(repr),
    st.integers(1, 300).map(str),
    st.floats(0, 1).map(repr),
    st.text(string.printable, max_size=8),
)
toml_key = st.sampled_from(KEYS).map(lambda k: k if k.isidentifier() and k.isascii() else f"'{k}'")
toml_section = st.builds(
    lambda name, pairs: f"[{name}]\n" + "".join(f"{k} = {v}\n" for k, v in pairs),
    st.sampled_from(["scene", "scene", "run", "pack", "sceen", "scene.file", "a b"]),
    st.lists(st.tuples(toml_key, toml_value), max_size=5, unique_by=lambda pair: pair[0]),
)
toml_text = st.one_of(st.lists(toml_section, max_size=3).map("".join), st.text(max_size=60))


@settings(max_examples=400, deadline=1000)
@given(text=toml_text)
def test_any_text_becomes_a_plan_or_an_input_error(text):
    try:
        plan = SceneFile.from_toml(text)
    except InputError:
        return
    assert SceneFile.from_toml(plan.to_toml()) == plan


scene_keys = st.fixed_dictionaries(
    {},
    optional={
        "lattice": st.sampled_from(["fcc", "cubic", "triangular", "dn", "none"]),
        "cells": st.integers(1, 4) | st.lists(st.integers(1, 3), min_size=1, max_size=4).map(tuple),
        "n": st.integers(1, 300),
        "dimension": st.integers(1, 4),
        "packing_fraction": st.floats(0, 1),
        "density": st.floats(0, 2),
        "box": st.lists(st.floats(0.5, 9), min_size=1, max_size=3).map(tuple),
        "diameter": st.sampled_from([0.5, 1.0, 3.0]),
    },
)


@settings(max_examples=200, deadline=2000)
@given(keys=scene_keys)
def test_a_plan_that_reads_builds_a_scene_or_says_why_not(keys):
    try:
        plan = SceneFile(SceneSpec(**keys))
        scene = plan.build_scene()
    except InputError:
        return
    assert scene.n >= 1
    if plan.scene.packing_fraction is not None:
        assert scene.packing_fraction == pytest.approx(plan.scene.packing_fraction, rel=1e-14)


def test_a_model_of_one_s_own_fits_no_scene_file():
    class Mine:
        elastic = False

    for name in ("interaction", "motion", "impact"):
        plan = SceneFile(scene=SceneSpec(n=32, packing_fraction=0.3, **{name: Mine()}))
        with pytest.raises(InputError, match=rf"\[scene\] {name} is .*class of one's own"):
            plan.to_toml()
        with pytest.raises(InputError, match=rf"\[scene\] {name} must be a table, found the string"):
            SceneSpec(n=32, packing_fraction=0.3, **{name: "x"})


def test_a_run_writes_absolute_paths_so_that_it_goes_on_from_its_folder(tmp_path, monkeypatch):
    from carom.models.interactions.ranges import Kind
    from carom.models.interactions.rule_files import RuleFile
    from carom.studies.runs import execution

    started = []

    class Noted(Exception):
        pass

    def begin(plan, *rest):
        started.append(plan)
        raise Noted

    rules = RuleFile([Kind("hare", (1.5,))], "rules.py", "rule")
    monkeypatch.setattr(execution, "Run", begin)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Noted):
        execution.run(SceneFile(scene=SceneSpec(file="f.h5md", interaction=rules)), "out")
    scene = started[0].scene
    assert scene.file == str(tmp_path / "f.h5md")
    assert scene.interaction.file == str(tmp_path / "rules.py")
    assert started[0].beside("elsewhere") == started[0]


def test_a_list_of_pinned_components_has_any_length():
    text = "[scene]\nn = 30\ndimension = 2\npacking_fraction = 0.1\npinned = {}\n"
    assert SceneFile.from_toml(text.format(list(range(20)))).build_scene().pinned.sum() == 20
    assert SceneFile.from_toml(text.format([])).build_scene().pinned is None


def frame_of(positions, **changes):
    n, d = np.shape(positions)
    values = {"time": 0.0, "step": 0, "velocities": np.ones((n, d)), "box": (8.0,) * d, "masses": np.ones(n)}
    return Frame(positions=np.array(positions), diameters=np.ones(n), **(values | changes))


def test_a_start_from_a_file_knows_who_may_overlap(tmp_path):
    from carom.models.interactions.steps import Steps
    from carom.models.interactions.wells import StepTable

    near = frame_of([[1.0, 1.0], [1.4, 1.0], [5.0, 5.0]])
    write(tmp_path / "near.h5md", [near])
    start = {"file": str(tmp_path / "near.h5md")}
    soft = StepTable(Steps([1.0], [1.0]))
    scene = SceneSpec(**start, interaction=soft).build(1, kT=1.0)
    np.testing.assert_array_equal(scene.positions, near.positions)
    assert Scene.from_frame(near, interaction=soft).velocities is not None
    assert SceneSpec(**start, pinned=(0, 1)).build(1, kT=1.0).pinned.tolist() == [True, True, False]
    with pytest.raises(OverlapError):
        SceneSpec(**start, pinned=(0, 2)).build(1, kT=1.0)
    with pytest.raises(InputError, match="Component 0 is pinned, and has a velocity"):
        SceneSpec(**start, pinned=(0, 1)).build(1)


def test_what_a_frame_is_joined_with_is_checked():
    apart = [[1.0, 1.0], [3.0, 1.0], [5.0, 5.0]]
    mixed = frame_of(apart, species=np.array([0, 1, 0]), species_names=("a", "b"))
    cases = [
        (mixed, {"contact": [[1.0]]}, "table of 1 species"),
        (mixed, {"contact": "x"}, "contact must be"),
        (frame_of(apart), {"contact": [[1.0, 0.7], [0.7, 1.0]]}, "contact needs species"),
        (mixed, {"obstacles": 5}, "obstacles must be a tuple"),
        (mixed, {"pinned": [7]}, "pinned must name"),
    ]
    for frame, given_with_it, says in cases:
        with pytest.raises(InputError, match=says):
            Scene.from_frame(frame, **given_with_it)
    apart = Scene.from_frame(mixed, contact=[[1.0, 0.7], [0.7, 1.0]])
    assert apart.contact[0, 1] == 0.7
