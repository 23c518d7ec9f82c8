"""Spherical codes: the best known ones are found, and solved for to 30 digits."""

import csv
import json
import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
from typer.testing import CliRunner

import carom
from carom import cli
from carom.errors import FileError, InputError
from carom.studies.codes.climb import climb
from carom.studies.codes.code import SphericalCode
from carom.studies.codes.compression import compress, random_points
from carom.studies.codes.contacts import contact_graph
from carom.studies.codes.hops import improve
from carom.studies.codes.polish import polish, refine
from carom.studies.codes.repulsion import _energy, repelled
from carom.studies.codes.search import spherical_code
from carom.studies.codes.toml import parse
from carom.studies.signals import Interrupted

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


@pytest.mark.slow
@pytest.mark.parametrize("n", [4, 5, 6])
def test_what_is_known_exactly_is_found_by_caps_that_grow_as_well(n):
    """The search is not asked for these; here it is."""
    code = polish(np.array(compress({"n": n, "k": 3, "seed": 0, "rate": 0.02})["points"]))
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
    assert html.startswith("<table>")
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
    assert np.abs(total - radial).max() < 1e-7  # the tolerance of the linear programme


def test_hops_lead_to_a_code_that_is_not_worse():
    start = random_points(9, 3, 0.3, np.random.default_rng(3))
    better = improve(start, 6, np.random.default_rng(3))
    worst = lambda points: (points @ points.T - 2.0 * np.eye(9)).max()  # noqa: E731
    assert worst(start) > 0.5
    assert worst(better) == pytest.approx(1 / 3, abs=1e-12)
    assert np.abs(np.linalg.norm(better, axis=1) - 1.0).max() < 1e-15


def test_a_compression_ends_where_the_caps_jam():
    """At a reduced pressure of 1e8, not after a number of collisions."""
    jammed = compress({"n": 9, "k": 3, "seed": 0, "rate": 0.2})
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


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"n": 1}, "n must be"),
        ({"n": 5000}, "n must be"),
        ({"n": 9, "dimension": 1}, "dimension must be"),
        ({"n": 9, "tries": 0}, "tries must be"),
        ({"n": 9, "seed": -1}, "seed must be"),
        ({"n": 9, "seeds": 3}, "it is called tries"),
        ({"n": 9, "k": 4}, "it is called dimension"),
        ({"n": 9, "cores": 0}, "cores must be"),
        ({"n": 9, "rate": 0.0}, "rate must be"),
        ({"n": 9, "hops": -1}, "hops must be"),
        ({"n": 9, "starts": -1}, "starts must be"),
        ({"n": 9, "digits": 5}, "digits must be"),
        ({"n": 9, "executor": "abacus"}, "executor must be"),
    ],
)
def test_bad_input_is_answered_in_a_sentence(arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        spherical_code(**arguments)


def test_a_file_that_is_no_code_is_refused(tmp_path):
    for text in ("{}", "[", '{"format": "carom spherical code", "n": 3}'):
        (tmp_path / "no.json").write_text(text)
        with pytest.raises(InputError, match=r"no\.json"):
            carom.load(tmp_path / "no.json")


@pytest.mark.slow
def test_ctrl_c_leaves_the_best_so_far():
    def stop(stage, fraction):
        if fraction >= 0.2:
            import signal

            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted, match="of 10 tries") as stopped:
        spherical_code(9, seed=0, tries=10, executor="serial", progress=stop)
    assert stopped.value.so_far is not None
    assert stopped.value.so_far.angle == pytest.approx(TABLE[3, 9], abs=LAST_DIGIT)


@pytest.mark.slow
def test_the_command_prints_and_keeps_what_the_function_returns(tmp_path):
    out = tmp_path / "nine.json"
    done = CliRunner().invoke(cli.app, ["code", "9", "--tries", "2", "--json", "--out", str(out)])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told["angle"].startswith("70.528779")
    assert carom.load(out).to_dict() == told
    again = CliRunner().invoke(cli.app, ["code", "9", "--out", str(out)])
    assert again.exit_code == 2
    assert "--overwrite" in again.output
    refused = CliRunner().invoke(cli.app, ["code", "1"])
    assert refused.exit_code == 2
    assert "n must be" in refused.output


def test_a_file_says_what_is_searched_for_and_options_override_it(tmp_path):
    file = tmp_path / "search.toml"
    file.write_text("[code]\nn = 8\ndimension = 4\ntries = 3\ndigits = 20\n")
    done = CliRunner().invoke(cli.app, ["code", str(file), "--digits", "25", "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert (told["n"], told["dimension"]) == (8, 4)
    assert told["angle"] == "90." + 23 * "0"
    words = parse("[code]\nn = 24\ndimension = 4\ntries = 3\nseed = 5\nrate = 0.1\nhops = 2\n")
    assert words == {"n": 24, "dimension": 4, "tries": 3, "seed": 5, "rate": 0.1, "hops": 2}


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("[code]\nn = 8\nseeds = 3\n", "did you mean seed"),
        ("[code]\nn = 8\ntries = 0\n", "tries must be"),
        ("[code]\nn = 8\nseed = -1\n", "seed must be"),
        ("[code]\nn = 'many'\n", "n must be"),
        ("[code]\ntries = 3\n", "must have n"),
        ("code = 3\n", "must be a section"),
        ("[scene]\nn = 8\n", "no section"),
        ("[code\n", "no valid TOML"),
    ],
)
def test_a_file_that_says_no_search_is_refused_in_a_sentence(tmp_path, content, sentence):
    file = tmp_path / "search.toml"
    file.write_text(content)
    refused = CliRunner().invoke(cli.app, ["code", str(file)])
    assert refused.exit_code == 2
    assert sentence in " ".join(refused.output.split())


def test_a_picture_of_caps_in_four_dimensions_is_refused_before_the_search(tmp_path, monkeypatch):
    monkeypatch.setattr("carom.studies.codes.search.spherical_code", None)
    refused = CliRunner().invoke(cli.app, ["code", "6", "-d", "4", "--out", str(tmp_path / "x.png")])
    assert refused.exit_code == 2
    assert "3 dimensions, and these have 4" in " ".join(refused.output.split())


def test_a_code_that_cannot_be_written_is_printed_all_the_same(tmp_path, monkeypatch):
    def full(*_):
        raise FileError("the disk is full")

    monkeypatch.setattr(SphericalCode, "save", full)
    done = CliRunner().invoke(cli.app, ["code", "4", "--tries", "1", "--out", str(tmp_path / "4.txt")])
    assert done.exit_code == 2
    assert "109.47" in done.stdout
    assert "the disk is full" in done.stderr


def test_what_is_neither_a_number_nor_a_file_is_refused():
    for text, sentence in (("eight", "number of points"), ("nowhere.toml", "does not exist")):
        refused = CliRunner().invoke(cli.app, ["code", text])
        assert refused.exit_code == 2
        assert sentence in " ".join(refused.output.split())


def found_among_forty(n, k):
    """Return the best code of the first seeds that reach the table, forty at most: the default."""
    for seed, tries in ((0, 1), (1, 3), (4, 12), (16, 24)):
        code = spherical_code(n, k, seed=seed, tries=tries)
        if code.angle > TABLE[k, n] - LAST_DIGIT:
            break
    return code


@pytest.mark.slow
@pytest.mark.parametrize(
    ("k", "n"), [(k, n) for k, n in TABLE if (k == 3 and n <= 40) or (k == 4 and n <= 22)]
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
        (24, 4, 2, 96),  # the 24-cell: eight neighbours each
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
@pytest.mark.parametrize(
    ("n", "starts", "degrees", "contacts"),
    [(24, 40, 60.0, 96), (120, 12, 36.0, 720)],
)
def test_points_that_repel_each_other_become_the_24_cell_and_the_600_cell(n, starts, degrees, contacts):
    """From some random sets of points, without growth or hops."""
    code = polish(climb(repelled(n, 4, starts, np.random.default_rng(1))))
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
    from carom.pictures import caps

    drawn = []
    monkeypatch.setattr(caps, "caps", lambda *arguments, **options: drawn.append(arguments))
    code = searched(6)
    code.plot()
    ((points, radius, pairs),) = drawn
    i, j = np.asarray(pairs).T
    between = np.degrees(np.arccos(np.sum(points[i] * points[j], axis=1)))
    assert len(pairs) == 12  # the edges of the octahedron
    assert between == pytest.approx(2.0 * radius, rel=1e-12)
