"""Spherical codes: the best known ones are found, and solved for to 30 digits."""

import csv
import json
import math
import signal
from concurrent.futures import Future
from pathlib import Path

import mpmath
import numpy as np
import pytest
from typer.testing import CliRunner

import carom
from carom import cli
from carom.errors import InputError
from carom.studies import CodeSpec
from carom.studies.folder import Folder
from carom.studies.signals import Interrupted
from carom.studies.spherical_codes.basin_hopping import improve
from carom.studies.spherical_codes.compression import Caps, random_points
from carom.studies.spherical_codes.contacts import contact_graph
from carom.studies.spherical_codes.linear_programs import climb
from carom.studies.spherical_codes.newton import polish, refine
from carom.studies.spherical_codes.repulsion import _energy, repelled
from carom.studies.spherical_codes.search import first_to_agree
from carom.studies.spherical_codes.study import Codes, spherical_code

with open(Path(__file__).parents[1] / "data" / "spherical_codes.csv", encoding="utf-8") as file:
    TABLE = {
        (int(row["d"]), int(row["N"])): max(
            float(row[name]) for name in ("sloane_deg", "exact_deg", "own_deg") if row[name]
        )
        for row in csv.DictReader(line for line in file if not line.startswith("#"))
    }
"""Best known smallest angles [degrees] to seven decimals: Sloane, Hardin and Smith; exact; own."""

LAST_DIGIT = 1e-7
"""Of the table [degrees]."""

MOST = mpmath.mpf(10) ** -28
"""Residual that a polished code may have."""


def searched(n, dimension=3, tries=2, **arguments):
    return spherical_code(n, dimension, seed=0, tries=tries, executor="serial", **arguments)


def exact_cosine(n):
    """Return the cosine of a code on S^2 that is algebraic, in 40 digits."""
    with mpmath.workdps(40):
        if n == 4:
            return -mpmath.mpf(1) / 3
        if n == 6:
            return mpmath.mpf(0)
        if n == 7:  # 3 c^3 - 9 c^2 - 3 c + 1 = 0 (Schuette and van der Waerden 1951, by Cohn's table)
            return mpmath.findroot(lambda c: 3 * c**3 - 9 * c**2 - 3 * c + 1, 0.21)
        if n == 8:  # 7 c^2 + 2 c - 1 = 0, the square antiprism
            return (mpmath.sqrt(8) - 1) / 7
        if n == 12:  # the icosahedron
            return 1 / mpmath.sqrt(5)
        # The snub cube, by its tribonacci constant t (Robinson 1961): corners are the even permutations of
        # (1, 1/t, t) with an even number of signs, and the odd ones with an odd number.
        t = mpmath.findroot(lambda t: t**3 - t**2 - t - 1, 1.84)
        squares = 1 + t**2 + 1 / t**2
        return (t + 1 + 1 / t) / squares


@pytest.mark.parametrize("n", [4, 6, *(pytest.param(n, marks=pytest.mark.slow) for n in (7, 8, 12, 24))])
def test_algebraic_codes_come_out_to_thirty_digits(n):
    code = searched(n, digits=32)
    with mpmath.workdps(40):
        assert abs(code.cosine - exact_cosine(n)) < mpmath.mpf(10) ** -31
    assert code.residual < MOST
    assert code.rigid
    assert code.rattlers.size == 0
    assert code.angle == pytest.approx(TABLE.get((3, n), code.angle), abs=LAST_DIGIT)


@pytest.mark.parametrize(
    ("n", "dimension", "rigid"),
    [
        (2, 2, True), (2, 3, True), (3, 2, True), (3, 3, True), (3, 5, True), (4, 3, True), (4, 7, True),
        (5, 2, True), (6, 3, True), (8, 4, True), (5, 3, False), (7, 4, False),
    ],
)  # fmt: skip
def test_simplices_cross_polytopes_and_polygons_cannot_move_and_parts_of_cross_polytopes_can(
    n, dimension, rigid
):
    assert spherical_code(n, dimension).rigid is rigid


@pytest.mark.slow
@pytest.mark.parametrize("n", [4, 5, 6])
def test_what_is_known_exactly_is_found_by_caps_that_grow_as_well(n):
    """The search is not asked for these; here it is."""
    code = polish(np.array(Caps.measure({"n": n, "dimension": 3, "seed": 0, "rate": 0.02})["points"]))
    _, cosine, residual = refine(code, 32)
    assert residual < MOST
    with mpmath.workdps(40):
        assert abs(cosine - spherical_code(n).cosine) < mpmath.mpf(10) ** -31


@pytest.mark.slow
def test_nineteen_points_leave_a_rattler_and_all_is_said_and_kept(tmp_path):
    code = searched(19, tries=4)
    assert code.angle == pytest.approx(47.6919141, abs=LAST_DIGIT)
    (loose,) = code.rattlers
    assert loose not in code.contacts
    assert set(code.angles) == {0, 1, 2, 3}
    assert code.seed in code.angles
    assert code.angles[code.seed] == pytest.approx(code.angle, abs=1e-12)
    # No other pair is nearer than a contact.
    products = code.points @ code.points.T - 2.0 * np.eye(19)
    assert products.max() <= float(code.cosine) + 4 * np.finfo(float).eps
    code.save(tmp_path / "code.json")
    again = carom.load(tmp_path / "code.json")
    assert str(again) == str(code)
    assert (again.contacts == code.contacts).all()
    code.save(tmp_path / "code.txt")
    with mpmath.workdps(40):
        lines = (tmp_path / "code.txt").read_text().splitlines()
        rows = [[mpmath.mpf(word) for word in line.split()] for line in lines]
        first, second = (rows[i] for i in code.contacts[0])
        assert abs(mpmath.fdot(first, second) - code.cosine) < mpmath.mpf(10) ** -31
    html = code._repr_html_()
    assert html.startswith("<table")
    assert "47.6919141" in html
    code.plot(tmp_path / "code.png", pixels=64)
    assert (tmp_path / "code.png").stat().st_size > 500


@pytest.mark.slow
def test_forces_balance_at_every_point():
    code = searched(13, tries=3)
    assert code.angle == pytest.approx(57.1367031, abs=LAST_DIGIT)  # Sloane's table
    assert code.forces.sum() == pytest.approx(1.0)
    assert code.forces.min() > 0.0
    total = np.zeros((13, 3))
    for (i, j), force in zip(code.contacts, code.forces, strict=True):
        total[i] += force * code.points[j]
        total[j] += force * code.points[i]
    radial = np.einsum("ij,ij->i", total, code.points)[:, None] * code.points
    assert np.abs(total - radial).max() < 1e-7  # the tolerance of the linear program


def test_hops_lead_to_a_code_that_is_not_worse():
    start = random_points(9, 3, 0.3, np.random.default_rng(3))
    better = improve(start, 6, np.random.default_rng(3))
    worst = lambda points: (points @ points.T - 2.0 * np.eye(9)).max()  # noqa: E731
    assert worst(start) > 0.5
    assert worst(better) == pytest.approx(1 / 3, abs=1e-12)
    assert np.abs(np.linalg.norm(better, axis=1) - 1.0).max() < 1e-15


@pytest.mark.slow
def test_a_compression_ends_where_the_caps_jam():
    """At a reduced pressure of 1e8, not after a number of collisions."""
    jammed = Caps.measure({"n": 9, "dimension": 3, "seed": 0, "rate": 0.2})
    assert 1e8 <= jammed["pressure"] < 1e10
    assert jammed["collisions"] < 9 * 500


def test_a_contact_graph_is_told_by_the_largest_leap_of_any_size():
    rng = np.random.default_rng(1)
    points = spherical_code(6).points
    for size in (1e-3, 1e-6, 1e-9):
        shaken = points + size * rng.standard_normal(points.shape)
        shaken /= np.linalg.norm(shaken, axis=1)[:, None]
        found = {tuple(sorted(pair)) for pair in contact_graph(shaken).tolist()}
        assert found == {tuple(sorted(pair)) for pair in spherical_code(6).contacts.tolist()}


@pytest.mark.slow
def test_a_climb_ends_at_the_optimum_wherever_it_starts_nearby():
    rng = np.random.default_rng(2)
    code = searched(12)
    shaken = code.points + 0.05 * rng.standard_normal((12, 3))
    top = climb(shaken / np.linalg.norm(shaken, axis=1)[:, None])
    assert (top @ top.T - 2.0 * np.eye(12)).max() == pytest.approx(1 / math.sqrt(5), abs=1e-12)


@pytest.mark.parametrize(
    ("n", "k", "degrees", "contacts"),
    [(2, 2, 180.0, 1), (2, 5, 180.0, 1), (5, 2, 72.0, 5), (3, 3, 120.0, 3), (5, 4, 104.4775122, 10),
     (8, 4, 90.0, 24), (6, 3, 90.0, 12)],
)  # fmt: skip
def test_sizes_that_are_known_for_all_dimensions_are_exact(n, k, degrees, contacts):
    code = spherical_code(n, k, digits=40)
    assert code.angle == pytest.approx(degrees, abs=LAST_DIGIT)
    assert len(code.contacts) == contacts
    assert code.residual < mpmath.mpf(10) ** -40
    assert "optimal" in code.note
    assert code.seed is None
    assert code.coordinates.shape == (n, k)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_code_wherever_it_runs():
    here, there = searched(10), spherical_code(10, seed=0, tries=2, executor="threads", cores=2)
    assert (here.coordinates == there.coordinates).all()
    assert here.angles == there.angles


@pytest.mark.slow
def test_ctrl_c_leaves_the_best_so_far():
    def stop(fraction, text):
        if fraction >= 0.2:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted, match="of 10 tries") as stopped:
        spherical_code(9, seed=0, tries=10, executor="serial", progress=stop)
    assert stopped.value.so_far is not None
    assert stopped.value.so_far.angle == pytest.approx(TABLE[3, 9], abs=LAST_DIGIT)


@pytest.fixture
def without_growth(monkeypatch):
    """Let tries be quick: all find the code of seven points, or, from seeds 1, 4, 5 and 8, a worse one."""
    seeds = []
    code = polish(climb(repelled(7, 3, np.random.default_rng(1))[0]))

    def search(task, look=lambda: None):
        look()
        seeds.append(task["seed"])
        worse = task["seed"] in (1, 4, 5, 8)
        return {
            "points": code.points.tolist(),
            "cosine": code.cosine + 1e-6 * worse,
            "contacts": code.contacts.tolist(),
            "forces": code.forces.tolist(),
        }

    monkeypatch.setattr(Codes, "measure", staticmethod(search))
    return seeds


def typed(*words):
    """Type ``carom code`` with one process."""
    return CliRunner().invoke(cli.app, ["code", *map(str, words), "--engine", "serial"])


def test_the_command_prints_and_keeps_what_the_function_returns(tmp_path, without_growth):
    code = spherical_code(7, tries=3, executor="serial")
    done = typed(7, "--tries", 3, "--out", tmp_path / "seven", "--report")
    assert done.exit_code == 0, done.output
    assert str(code.to_dict()["angle"]) in done.stdout
    assert carom.load(tmp_path / "seven" / "code.json") == code
    assert carom.load(tmp_path / "seven").code == code
    rows = list(csv.DictReader((tmp_path / "seven" / "code.csv").open(encoding="utf-8")))
    assert [(row["seed"], row["best"]) for row in rows] == [("1", "false"), ("2", "true"), ("3", "true")]
    points = list(csv.DictReader((tmp_path / "seven" / "points.csv").open(encoding="utf-8")))
    assert [float(row["z"]) for row in points] == code.points[:, 2].tolist()
    page = (tmp_path / "seven" / "report.html").read_text(encoding="utf-8")
    assert code.to_dict()["angle"] in page
    assert (code.to_dict()["seed"], code.to_dict()["reached"]) == (2, 2)


def test_digits_are_no_other_search(tmp_path, without_growth):
    assert typed(7, "--tries", 2, "--out", tmp_path / "seven").exit_code == 0
    assert typed(7, "--tries", 2, "--digits", 20, "--out", tmp_path / "seven").exit_code == 0
    assert without_growth == [1, 2]
    assert carom.load(tmp_path / "seven").code.digits == 20


def test_ctrl_c_prints_and_writes_the_best_so_far(tmp_path, without_growth, monkeypatch):
    whole = Codes.measure

    def search(task, look):
        if task["seed"] == 3:
            signal.raise_signal(signal.SIGINT)
        return whole(task, look)

    monkeypatch.setattr(Codes, "measure", staticmethod(search))
    done = typed(7, "--tries", 5, "--out", tmp_path / "seven")
    assert done.exit_code == 130
    assert "reached by 1 of 2, first by seed 2" in done.stdout
    assert carom.load(tmp_path / "seven" / "code.json").seed == 2


def test_progress_tells_the_best_so_far(without_growth):
    said = []
    spherical_code(7, tries=3, executor="serial", progress=lambda fraction, text: said.append(text))
    assert said[0] == "0 of 3 tries"
    best = math.degrees(math.acos(float(exact_cosine(7))))
    assert said[-1] == f"3 of 3 tries, best {best:.7f} degrees"


def test_tries_without_a_code_are_in_the_table_and_none_with_one_is_an_error(tmp_path, monkeypatch):
    def search(task, look):
        return {"points": None, "cosine": None, "problem": "the caps never jammed."}

    monkeypatch.setattr(Codes, "measure", staticmethod(search))
    done = typed(7, "--tries", 2, "--out", tmp_path / "seven")
    assert done.exit_code == 3
    assert "None of 2 tries led to a code; from seed 1, the caps never jammed. Give more" in done.stdout
    assert not (tmp_path / "seven" / "code.json").exists()
    with pytest.raises(InputError, match="None of 2 tries led to a code"):
        spherical_code(7, tries=2, executor="serial")


@pytest.mark.parametrize(
    ("cosines", "count", "needed"),
    [
        ([0.5, 0.5], 2, 2),
        ([0.4, 0.5, 0.4, 0.3, 0.3], 2, 3),  # the best of the first three, not of all
        ([0.5, 0.4, 0.3, 0.4, 0.3], 2, 5),
        ([0.5, None, 0.5], 2, 3),
        ([0.5, 0.5 - 2.0**-46, 0.5 - 2.0**-45], 3, 3),  # one code, up to rounding
        ([0.5, 0.5 - 2.0**-44, 0.5 - 2.0**-43], 3, None),  # the first is no longer the best
        ([0.5, 0.4, 0.3], 2, None),
        ([None, None], 2, None),
        ([], 2, None),
    ],
)
def test_the_first_tries_that_agree(cosines, count, needed):
    assert first_to_agree(cosines, count) == needed


class Backwards:
    """An Executor that runs what it was given when it has all of it, the last first."""

    def __init__(self, count):
        self.count, self.given = count, []

    def submit(self, function, value):
        self.given.append((future := Future(), function, value))
        if len(self.given) == self.count:
            for each, call, task in reversed(self.given):
                each.set_result(call(task))
        return future


def test_a_search_ends_when_tries_agree_and_does_not_depend_on_who_ends_first(tmp_path, without_growth):
    """Of seeds 1 to 8, 1 is worse; 2 and 3 agree."""
    code = spherical_code(7, tries=8, agree=2, executor="serial")
    assert without_growth == [1, 2, 3]
    assert (list(code.angles), code.reached, code.seed) == ([1, 2, 3], 2, 2)
    again = Codes(CodeSpec(7, tries=8, agree=2)).run(executor=Backwards(8), out=tmp_path / "seven")
    assert again.code == code
    assert again.complete
    assert again.fraction == 1.0
    assert len(list((tmp_path / "seven" / "tasks").iterdir())) == 8
    assert carom.load(tmp_path / "seven").code == code
    Folder(tmp_path / "seven").result(again.tasks[0]).unlink()  # the others agree, and that may not decide
    done = typed(7, "--tries", 8, "--agree", 2, "--out", tmp_path / "seven")
    assert done.exit_code == 0
    assert without_growth[-1] == 1
    assert "reached by 2 of 3, first by seed 2" in done.stdout
    assert len(Codes(CodeSpec(7, tries=8)).run(out=tmp_path / "seven").records) == 8


def test_two_tries_are_to_agree_unless_a_number_of_tries_is_given():
    assert [CodeSpec(7).agree, CodeSpec(7, tries=5).agree, CodeSpec(7, agree=3).tries] == [2, None, 40]


def test_tries_that_do_not_agree_all_run(without_growth):
    code = spherical_code(7, tries=4, seed=2, agree=3, executor="serial")  # 2 and 3 agree; 4 and 5 are worse
    assert without_growth == [2, 3, 4, 5]
    assert code.reached == 2


@pytest.mark.slow
def test_tries_agree_on_the_same_code_on_any_number_of_workers():
    one, two = (spherical_code(9, tries=6, agree=2, hops=2, cores=cores) for cores in (1, 2))
    assert one == two


def test_a_file_says_what_is_searched_for_and_options_override_it(tmp_path):
    file = tmp_path / "search.toml"
    file.write_text("[code]\nn = 8\ndimension = 4\ntries = 3\ndigits = 20\n")
    done = typed(file, "--digits", 25, "--json", "--out", tmp_path / "eight")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert (told["n"], told["dimension"]) == (8, 4)
    assert told["angle"] == "90." + 23 * "0"
    text = "[code]\nn = 24\ndimension = 4\ntries = 3\nseed = 5\nrate = 0.1\nhops = 2\nagree = 2\n"
    spec = CodeSpec.from_toml(text)
    assert spec == CodeSpec(24, 4, tries=3, seed=5, rate=0.1, hops=2, agree=2, starts=50)
    assert CodeSpec.from_toml(spec.to_toml()) == spec


def test_a_code_that_is_known_needs_no_try_and_one_in_four_dimensions_has_no_picture(tmp_path):
    done = typed(6, "-d", 4, "--out", tmp_path / "six", "--report")
    assert done.exit_code == 0, done.output
    assert not list((tmp_path / "six").glob("*.png"))
    assert not list((tmp_path / "six" / "tasks").iterdir())
    assert "optimal (Rankin 1955)" in done.stdout
    with pytest.raises(InputError, match="three dimensions"):
        carom.load(tmp_path / "six").plot()


def found_among_forty(n, k):
    """Return the best code of the first seeds that reach the table, forty at most: the default."""
    for seed, tries in ((0, 1), (1, 3), (4, 12), (16, 24)):
        code = spherical_code(n, k, seed=seed, tries=tries)
        if code.angle > TABLE[k, n] - LAST_DIGIT:
            break
    return code


@pytest.mark.slow
@pytest.mark.parametrize(
    ("k", "n"), [(k, n) for k, n in TABLE if (k == 3 and n <= 24) or (k == 4 and n <= 16)]
)
def test_the_best_known_codes_are_found(k, n):
    code = found_among_forty(n, k)
    assert code.angle > TABLE[k, n] - LAST_DIGIT
    assert code.residual < MOST


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "k", "one_over", "contacts"),
    [
        (10, 4, 6, None),  # the Petersen code (Bachoc and Vallentin 2009)
        (24, 4, 2, 96),  # the 24-cell: eight neighbors each
        (16, 5, 5, 80),  # half of the corners of a cube: ten
        (27, 6, 4, 216),  # Schlaefli: sixteen
        (56, 7, 3, 756),  # Hess: twenty-seven
    ],
)
def test_codes_of_lattices_and_polytopes_are_found_by_the_first_seed(n, k, one_over, contacts):
    """With fewer hops than the default, which take long in many dimensions."""
    code = searched(n, k, tries=1, hops=4)
    with mpmath.workdps(40):
        assert abs(code.cosine - mpmath.mpf(1) / one_over) < mpmath.mpf(10) ** -31
    assert code.residual < MOST
    assert contacts in (None, len(code.contacts))
    assert code.rattlers.size == 0


@pytest.mark.slow
@pytest.mark.parametrize(("n", "starts", "degrees", "contacts"), [(24, 40, 60.0, 96), (120, 12, 36.0, 720)])
def test_points_that_repel_each_other_become_the_24_cell_and_the_600_cell(n, starts, degrees, contacts):
    """From some random sets of points, without growth or hops."""
    rng = np.random.default_rng(1)
    best, _ = min((repelled(n, 4, rng) for _ in range(starts)), key=lambda found: found[1])
    code = polish(climb(best))
    assert math.degrees(math.acos(code.cosine)) == pytest.approx(degrees, abs=1e-11)
    assert len(code.contacts) == contacts


def test_the_gradient_of_the_repulsion_is_its_derivative():
    rng = np.random.default_rng(2)
    flat, step = rng.standard_normal(15), 2.0**-18
    _, slope = _energy(flat, 5, 3, 16.0)
    for axis in range(15):
        ahead = np.eye(15)[axis] * step
        rise = _energy(flat + ahead, 5, 3, 16.0)[0] - _energy(flat - ahead, 5, 3, 16.0)[0]
        # Of second order in the step, with third derivatives of about the cube of the exponent.
        assert rise / (2.0 * step) == pytest.approx(slope[axis], abs=16.0**3 * step**2 + 1e-10)


def test_the_caps_of_a_picture_touch_at_the_contacts(monkeypatch):
    from carom.figures import caps

    drawn = []
    monkeypatch.setattr(caps, "caps", lambda *arguments, **options: drawn.append(arguments))
    code = searched(6)
    code.plot()
    ((points, radius, pairs),) = drawn
    i, j = np.asarray(pairs).T
    between = np.degrees(np.arccos(np.sum(points[i] * points[j], axis=1)))
    assert len(pairs) == 12  # the edges of the octahedron
    assert between == pytest.approx(2.0 * radius, rel=1e-12)
