"""Transport coefficients: the rule for slopes, error bars, Enskog's theory, published values."""

import dataclasses
import math
from dataclasses import replace
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
from helpers.drawn import outside, strange_bars

import carom
from carom import studies, theory
from carom.errors import InputError
from carom.observables import Estimate, combined
from carom.studies import Transport, TransportSpec
from carom.studies.transport import pictures, windows
from carom.studies.transport.analysis import Coefficient, Point, jackknife, line
from carom.studies.transport.points import coefficients_of

FIVE = 5.0  # errors: by chance in one of two million
WELL = {"type": "square-well", "range": 1.5, "depth": 0.5}


def test_enskog_is_that_of_the_literature():
    # Chapman and Cowling, eqs. 16.41,2 and 16.42,2; in the plane Gass (1971).
    eta, chi_of = 0.5 * math.pi / 6.0, lambda z, bn: (z - 1.0) / bn
    z = 3.2694
    bn = 2.0 * math.pi / 3.0 * 0.5
    g = chi_of(z, bn)
    found = theory.enskog(z, eta, 3)
    eta_0, lambda_0 = 5.0 / 16.0 / math.sqrt(math.pi) * 1.016034, 75.0 / 64.0 / math.sqrt(math.pi) * 1.025218
    assert found.shear_viscosity == pytest.approx(eta_0 * (1.0 / g + 0.8 * bn + 0.7615 * bn**2 * g), rel=1e-4)
    assert found.thermal_conductivity == pytest.approx(
        lambda_0 * (1.0 / g + 1.2 * bn + 0.7574 * bn**2 * g), rel=1e-4
    )
    assert found.self_diffusion == pytest.approx(
        1.018954 * 3.0 / (8.0 * 0.5 * g) / math.sqrt(math.pi), rel=1e-6
    )
    n, z = 0.4, 2.0
    bn = 0.5 * math.pi * n
    g = chi_of(z, bn)
    plane = theory.enskog(z, 0.25 * math.pi * n, 2)
    assert plane.shear_viscosity == pytest.approx(
        1.022 / (2.0 * math.sqrt(math.pi)) * (1.0 / g + bn + 0.8729 * bn**2 * g), rel=2e-4
    )
    assert plane.thermal_conductivity == pytest.approx(
        2.0 * 1.0297 / math.sqrt(math.pi) * (1.0 / g + 1.5 * bn + 0.8718 * bn**2 * g), rel=3e-4
    )


@pytest.mark.parametrize("d", [2, 3, 4])
def test_enskog_is_given_in_the_units_of_diameter_mass_and_temperature(d):
    one = theory.enskog(3.0, 0.2, d)
    found = theory.enskog(3.0, 0.2, d, diameter=2.0, mass=4.0, kT=9.0)
    speed = math.sqrt(9.0 / 4.0)
    assert found.self_diffusion == pytest.approx(one.self_diffusion * 2.0 * speed)
    for name in ("shear_viscosity", "bulk_viscosity"):
        assert getattr(found, name) == pytest.approx(getattr(one, name) * 4.0 * speed / 2.0 ** (d - 1))
    assert found.thermal_conductivity == pytest.approx(one.thermal_conductivity * speed / 2.0 ** (d - 1))


def test_the_fit_of_erpenbeck_and_wood_has_its_published_digits():
    # Phys. Rev. A 43, 4254 (1991): 1 + 0.05403 v + 6.3656 v^2 - 10.9425 v^3, v = n sigma^3 / sqrt 2.
    for v, right in ((0.1, 1.0581165), (0.5, 1.2506025), (0.625, 0.8488225)):
        eta = v * math.sqrt(2.0) * math.pi / 6.0
        assert theory.erpenbeck_wood(eta) == pytest.approx(right, abs=1e-7)


@pytest.mark.parametrize(
    ("diameters", "counts", "dimension", "scene", "title"),
    [
        ([1.0], [108], 3, {}, "hard spheres"),
        ([1.0, 0.5], [50, 150], 2, {}, "a mixture of hard disks: 0.25 of diameter 1, 0.75 of diameter 0.5"),
        ([1.0], [108], 3, {"interaction": WELL}, "spheres with square wells of range 1.5 and depth 0.5"),
    ],
)
def test_a_report_says_in_its_title_what_was_simulated(diameters, counts, dimension, scene, title):
    result = {"diameters": diameters, "counts": counts, "dimension": dimension}
    study = Transport(SimpleNamespace(scene=scene), ({"result": result},))
    assert study.title == f"Transport coefficients of {title}"


def test_enskog_has_no_coefficient_on_a_line():
    with pytest.raises(InputError, match="d >= 2"):
        theory.enskog(2.0, 0.5, 1)


def test_the_shift_of_a_periodic_cube_is_yeh_and_hummers_where_diffusion_is_slow():
    slow = theory.diffusion_shift(1372, 0.5, 0.558, self_diffusion=1e-12)
    assert slow == pytest.approx(theory.diffusion_shift(1372, 0.5, 0.558))
    assert theory.diffusion_shift(1372, 0.5, 0.558) == pytest.approx(
        2.837297 / (6.0 * math.pi * 0.558 * (1372 / 0.5) ** (1.0 / 3.0))
    )


def block_of(squares, lags=windows.LAGS):
    """Return what the analysis reads of a block, all of it from one curve."""
    row = [float(x) for x in squares]
    zero = [0.0] * len(lags)
    return {
        "shear": [row, zero, zero], "heat": [row, zero, zero], "bulk": [zero, row], "rate": 0.0,
        "change": 0.0, "fluxes": [[row]], "moved": [], "collisions": 1, "virial": 1.0, "duration": 1.0,
    }  # fmt: skip


def block_of_pressure(x, lags=windows.LAGS):
    """Return a block whose bulk viscosity is that of one integral of the pressure."""
    changes = [x[lag:] - x[:-lag] for lag in lags]
    bulk = [[float(c.mean()) for c in changes], [float(np.mean(c * c)) for c in changes]]
    return block_of(lags, lags) | {"bulk": bulk, "change": float(x[-1] - x[0])}


def result_of(blocks, every=0.5, samples=10**9):
    """Return the result of a run of blocks; V, kT and the mean free time are 1."""
    return {
        "every": every, "dimension": 3, "n": 100, "kT": 1.0, "box": [1.0, 1.0, 1.0], "samples": samples,
        "counts": [100], "simple": True, "blocks": blocks,
    }  # fmt: skip


def point_of(blocks, every=0.5, samples=10**9):
    """Return the analysis of the blocks of one run."""
    return Point([{"result": result_of(blocks, every, samples)}])


@pytest.mark.parametrize("decay", [1.25, 1.9])
def test_the_rule_for_slopes_leaves_less_than_a_thousandth_behind(decay):
    # M(t) of a current whose correlation decays as exp(-t / decay), the slowest of the dilute gas 1.9 mean
    # free times; C = 1.
    t = 0.5 * np.array(windows.LAGS)
    squares = 2.0 * (t - decay * (1.0 - np.exp(-t / decay)))
    found = point_of([block_of(squares)] * 4).shear_viscosity()
    assert found.mean == pytest.approx(1.0, abs=1e-3)
    assert found.mean < 1.0


def test_the_rule_waits_for_a_slow_decay():
    t, slow = 0.5 * np.array(windows.LAGS), 8.0
    squares = 2.0 * (t - slow * (1.0 - np.exp(-t / slow)))
    rng = np.random.default_rng(1)
    # The blocks scatter little beside the decay, so that 10 mean free times are seen to be too short.
    blocks = [block_of(squares * (1.0 + 1e-3 * rng.standard_normal())) for _ in range(16)]
    found = point_of(blocks).shear_viscosity()
    assert found.window == (40.0, 80.0)
    assert found.mean == pytest.approx(1.0, abs=2e-3)


def test_slopes_of_noise_with_a_memory_cover_their_truth():
    # Currents of an Ornstein-Uhlenbeck process with C = 1, in blocks as short as the rule allows.
    rng = np.random.default_rng(7)
    every, memory, count, inside, runs = 0.5, 1.9, 1280, 0, 200
    decay = math.exp(-every / memory / 16.0)
    values = []
    for _ in range(runs):
        noise = rng.standard_normal((16, count * 16)) * math.sqrt((1.0 - decay**2) / memory)
        from scipy.signal import lfilter

        current = lfilter([1.0], [1.0, -decay], noise, axis=1)
        moment = np.cumsum(current, axis=1)[:, ::16] * every / 16.0
        blocks = [block_of([np.mean((x[lag:] - x[:-lag]) ** 2) for lag in windows.LAGS]) for x in moment]
        value = point_of(blocks).shear_viscosity()
        values.append(value.mean)
        low, high = value.confidence(0.95)
        inside += low <= 1.0 <= high
    # 95 % of 200 are 190, give or take 3.1; Student's interval is meant to be on the wide side.
    assert inside >= 180
    # The bias of the rule, which looks at the data, is a small part of one error bar.
    assert abs(np.mean(values) - 1.0) < 0.3 * np.std(values)


# In the second case the window ends at a fourth of the run: uncorrected, slopes would be 3/8 too small.
@pytest.mark.parametrize(("total", "count", "runs"), [(8, 1280, 60), (1, 161, 1000)])
def test_the_mean_taken_out_of_the_pressure_is_made_good(total, count, runs):
    rng = np.random.default_rng(3)
    values, every = [], 0.5
    for _ in range(runs):
        walks = np.cumsum(rng.standard_normal((total, count)), axis=1) * math.sqrt(2.0 * every)
        blocks = [block_of_pressure(x, [lag for lag in windows.LAGS if lag <= count // 4]) for x in walks]
        values.append(point_of(blocks, every, count).bulk_viscosity().mean)
    error = np.std(values) / math.sqrt(len(values))
    assert error < 0.07
    assert np.mean(values) == pytest.approx(1.0, abs=FIVE * error)


def test_a_mixture_conducts_without_a_flux_of_any_species():
    # Mean products that grow as 2 L t. Without a flux of the first species the heat is L_00 - L_01^2 / L_11.
    heat, cross, first = 2.0, 0.6, 0.5
    counts = (40.0, 60.0)  # masses are equal, and the center of mass rests: the fluxes are opposite
    matrix = np.array([[heat, cross, -cross], [cross, first, -first], [-cross, -first, first]])
    block = block_of(windows.LAGS)
    block["fluxes"] = (matrix[..., None] * np.array(windows.LAGS)).tolist()
    result = {**result_of([block] * 4), "counts": list(counts)}
    point = Point([{"result": result}])
    assert point.thermal_conductivity().mean == pytest.approx(heat - cross**2 / first)
    assert point.thermal_diffusion().mean == pytest.approx(cross)
    # D of Maxwell and Stefan: N_1 N_2 / N of the relative motion of the mean positions, whose squares are
    # first (1 / N_1 + 1 / N_2)^2.
    relative = first * (1.0 / counts[0] + 1.0 / counts[1]) ** 2
    assert point.mutual_diffusion().mean == pytest.approx(24.0 * relative)


def test_a_mixture_whose_conductivity_has_not_settled_says_so():
    matrix = np.array([[2.0, 0.6, -0.6], [0.6, 0.5, -0.5], [-0.6, -0.5, 0.5]])

    def conductivity(lags, power):
        noise = [block_of(lags, lags) for _ in range(4)]
        for k, block in enumerate(noise):
            growth = (1.0 + 1e-6 * k) * np.array(lags, dtype=float) ** power
            block["fluxes"] = (matrix[..., None] * growth).tolist()
        point = Point([{"result": {**result_of(noise), "counts": [40.0, 60.0]}}])
        return point.thermal_conductivity()

    assert conductivity(windows.LAGS, 1.0).settled
    assert not conductivity(windows.LAGS, 1.5).settled
    short = conductivity(windows.LAGS[:2], 1.0)
    assert not short.settled
    assert math.isnan(short.mean)


def test_a_study_without_theory_draws_every_species():
    half = Estimate(0.5, 0.01, 100.0, 1.0, 100)
    curve = Coefficient.of(half, (2.0, 4.0), times=(1.0, 2.0, 4.0), running=(half, half, half))
    names = ("self_diffusion_0", "self_diffusion_1", "shear_viscosity", "mutual_diffusion")
    row = SimpleNamespace(
        n=100, packing_fraction=0.2, mean_free_time=1.0, exists=True, enskog=None,
        quantities=lambda: dict.fromkeys(names, (curve, math.nan)),
    )  # fmt: skip
    figure = pictures.study([row])
    left, right = figure.axes
    assert [each.get_label() for each in left.containers] == [f"$\\eta$ = 0.2, species {k}" for k in (0, 1)]
    assert len(right.containers) == 1
    assert not outside(figure)
    assert "Enskog" not in left.get_ylabel() + right.get_ylabel()
    unknown = Coefficient.of(replace(half, mean=math.nan), (2.0, 4.0), times=(1.0,), running=(half,))
    row.enskog, row.quantities = True, lambda: {"shear_viscosity": (unknown, 1.0)}
    left, right = pictures.study([row]).axes
    assert [each.get_text() for each in left.texts] == ["not known yet"]
    assert len(right.containers) == 1


def test_replicas_of_unequal_pressure_have_the_bulk_viscosity_of_each():
    # With steps each replica has its own energy: here pressures differ by far more than they fluctuate.
    rng = np.random.default_rng(5)
    records = []
    for pressure in (0.0, 50.0):
        mean = pressure * 0.5 * np.arange(1280)
        blocks = [block_of_pressure(np.cumsum(rng.standard_normal(1280)) + mean) for _ in range(8)]
        records.append({"result": result_of(blocks, samples=1280)})
    found = Point(records).bulk_viscosity()
    assert found.mean == pytest.approx(1.0, abs=FIVE * found.error)
    assert found.error < 0.3


def test_replicas_of_unequal_temperature_are_scaled_by_the_mean_of_all():
    blocks = [block_of(windows.LAGS) | {"bulk": [[0.0] * len(windows.LAGS), [*windows.LAGS]]}] * 4
    found = Point([{"result": {**result_of(blocks), "kT": kT}} for kT in (1.0, 3.0)])
    one = point_of(blocks)
    for name, power in (("shear_viscosity", 1), ("bulk_viscosity", 1), ("thermal_conductivity", 2)):
        alone, both = (getattr(point, name)().mean for point in (one, found))
        assert both == pytest.approx(alone / 2.0**power, rel=1e-6), name


def test_diffusion_of_a_species_is_as_uncertain_as_its_number_makes_it():
    moved = {"times": [0.5 * lag for lag in windows.LAGS], "means": [[3.0 * lag] * 4 for lag in windows.LAGS]}
    blocks = [block_of(windows.LAGS) | {"moved": [moved, moved]}] * 16
    result = {**result_of(blocks, samples=1000), "counts": [2, 98], "wave_time": 0.0}
    rare, common = (Point([{"result": result}]).self_diffusion(species)[0] for species in (0, 1))
    assert rare.mean == common.mean == pytest.approx(1.0)
    # Blocks that do not scatter have the least error, that of independent particles.
    assert rare.error == pytest.approx(7.0 * common.error)


def test_two_estimators_combine_to_less_than_either():
    rng = np.random.default_rng(1)
    x, y = rng.standard_normal((2, 4000))
    one, two = 3.0 + x, 3.0 + 0.3 * x + 0.9 * y
    found = combined(one, two)
    assert found.error < min(one.std(), two.std()) / math.sqrt(4000)
    # Least variance by hand: minimize var(a + w (b - a)).
    weights = np.linspace(-1.0, 2.0, 3001)
    least = min((1.0 - 0.7 * w) ** 2 + (0.9 * w) ** 2 for w in weights)
    assert found.error == pytest.approx(math.sqrt(least / 4000), rel=0.05)
    assert found.mean == pytest.approx(3.0, abs=FIVE * found.error)


def test_a_line_through_points_is_found_with_its_errors():
    rng = np.random.default_rng(1)
    x, error = np.array([0.05, 0.07, 0.1, 0.125]), np.array([1e-3, 5e-4, 2e-4, 8e-4])
    deviations = []
    for _ in range(400):
        value, slope, _ = line(x, 0.265 - 0.22 * x + error * rng.standard_normal(4), error)
        deviations.append([(value.mean - 0.265) / value.error, (slope.mean + 0.22) / slope.error])
    # Standard deviations of 400 normal deviates are known to 3.5 %.
    assert np.std(deviations, axis=0) == pytest.approx([1.0, 1.0], abs=FIVE * 0.035)


def test_the_jackknife_of_a_mean_is_its_standard_error():
    x = np.random.default_rng(2).standard_normal(50)
    (found,) = jackknife(x, lambda m: m)
    assert found.error == pytest.approx(x.std(ddof=1) / math.sqrt(50))


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Return a small study of spheres at a third of freezing, and its folder."""
    out = tmp_path_factory.mktemp("study") / "out"
    settings = {"n": 64, "replicas": 2, "collisions_per_particle": 6000, "equilibration": 100}
    return carom.transport(0.15, **settings, executor="serial", out=out), out, settings


def test_a_fluid_of_moderate_density_is_near_enskog(study):
    (row,) = study[0].points
    for name, (c, enskog) in row.quantities().items():
        # 64 spheres: what is beyond Enskog, and beyond 64, is some 5 % at this density, for D up to 8 %.
        assert c.mean == pytest.approx(enskog, abs=FIVE * c.error + 0.1 * enskog), name
        assert 0.0 < c.relative_error < 0.3
    for c in (row.shear_viscosity, row.thermal_conductivity):
        assert c.kinetic.mean + c.cross.mean + c.collisional.mean == pytest.approx(c.mean)
    d, v = row.self_diffusion[0], row.self_diffusion_by_velocity[0]
    assert d.mean == pytest.approx(v.mean, abs=FIVE * math.hypot(d.error, v.error))
    assert row.self_diffusion_infinite.mean > d.mean
    wood = float(theory.erpenbeck_wood(0.15)) * row.enskog.self_diffusion
    assert row.erpenbeck_wood == wood
    (line,) = (line for line in study[0].remarks() if "Erpenbeck and Wood" in line)
    assert f"{wood:.5g}" in line


def test_the_picture_of_a_study_has_the_error_of_each_coefficient_over_enskogs(study):
    (row,) = study[0].points
    left, right = study[0].plot().axes

    def over(found, enskog):
        return [Estimate(each.mean / enskog, each.error / enskog, 1.0, 1.0, 1) for each in found]

    assert strange_bars(left, [over([c], enskog) for c, enskog in row.quantities().values()]) == (4, [])
    shear, enskog = row.quantities()["shear_viscosity"]
    shown = [each for each in shear.running if each.relative_error < pictures.WIDEST]
    assert strange_bars(right, over(shown, enskog)) == (len(shown), [])
    (window,) = (line.get_xdata() for line in right.get_lines() if line.get_linewidth() == 4.0)
    assert [x * row.mean_free_time for x in window] == pytest.approx(list(shear.window))


def test_the_row_of_infinitely_many_shows_enskogs_value_and_the_ratio_to_it(study):
    (row,) = study[0].points
    quantities = {each.quantity: each for each in study[0].table}
    finite, infinite = quantities["self_diffusion"], quantities["self_diffusion_infinite"]
    assert infinite.enskog == finite.enskog == row.enskog.self_diffusion
    assert infinite.ratio == row.self_diffusion_infinite.mean / row.enskog.self_diffusion
    assert "self diffusion, N = inf" in str(study[0].table)


def test_infinitely_many_spheres_diffuse_by_the_mass_of_all_over_that_of_the_others_faster(study):
    (row,) = study[0].points
    d, infinite, eta = row.self_diffusion[0], row.self_diffusion_infinite, row.shear_viscosity
    rho = 0.15 * 6.0 / math.pi
    shift = theory.diffusion_shift(64, rho, eta.mean, self_diffusion=infinite.mean)
    assert row.at_rest == {0: 64 / 63}
    assert infinite.mean - shift == pytest.approx(d.mean * 64 / 63, rel=1e-9)
    at_two_sizes = [
        dataclasses.replace(row, n=n, edge=edge, at_rest={0: n / (n - 1)})
        for n, edge in ((8, 2.0), (64, 4.0))
    ]
    with mock.patch.dict(study[0].__dict__, points=at_two_sizes):
        (line,) = study[0].extrapolate()
    # The same D of both sizes: a line through D 8 / 7 at 1 / 2 and D 64 / 63 at 1 / 4.
    assert line.value.mean == pytest.approx(d.mean * (2 * 64 / 63 - 8 / 7), rel=1e-9)


def test_the_drift_of_a_mixture_is_that_of_its_masses():
    point = object.__new__(Point)
    point.n, point.first = 5, {"masses": [1.0, 3.0], "counts": [2, 3]}
    assert [point.at_rest(k) for k in (0, 1)] == [11 / 10, 11 / 8]


def test_z_by_both_routes_has_the_smallest_error(study):
    (row,) = study[0].points
    assert row.Z.error <= 1.02 * min(row.by_virial.error, row.by_rate.error)
    shift = theory.finite_size_shift(0.15, 64, theory.best(3))
    right = theory.best(3)(0.15) + shift
    assert row.Z.mean == pytest.approx(right, abs=FIVE * row.Z.error)


@pytest.mark.slow
def test_identical_species_diffuse_and_conduct_as_one(study):
    species = [{"name": "a", "fraction": 0.5}, {"name": "b", "fraction": 0.5}]
    mixed = carom.transport(0.15, **study[2], scene={"species": species}, executor="serial")
    (one,), (two,) = study[0].points, mixed.points
    for name in ("shear_viscosity", "thermal_conductivity"):
        a, b = getattr(one, name), getattr(two, name)
        assert a.mean == pytest.approx(b.mean, abs=FIVE * math.hypot(a.error, b.error)), name
    # Equal spheres of two colors: what they exchange is self-diffusion, but for the correlation of unlike
    # neighbors.
    mutual = two.mutual_diffusion
    assert mutual.mean == pytest.approx(two.self_diffusion[0].mean, abs=FIVE * mutual.error)
    # Heat and color have nothing to do with each other.
    heat = two.thermal_diffusion
    assert abs(heat.mean) < FIVE * heat.error


@pytest.mark.slow
def test_in_two_dimensions_no_number_is_given_for_what_does_not_exist():
    found = carom.transport(
        0.3, n=64, replicas=1, dimension=2, collisions_per_particle=1500, equilibration=50, executor="serial"
    )
    (row,) = found.points
    assert not row.exists
    assert "logarithm" in str(found)
    running = row.self_diffusion[0].running
    assert running[-1].mean > running[0].mean
    assert all(each["value"] is None for each in found.to_dict()["table"])


def test_what_is_given_takes_the_place_of_what_a_file_says(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text("[transport]\npacking_fraction = [0.1]\n")
    spec = TransportSpec.of_argument(path)
    assert spec.replaced(collisions_per_particle=5.0).relative_error is None
    assert spec.replaced(dimension=3, seed=2).packing_fraction == (0.1,)
    assert spec.replaced(dimension=2).packing_fraction == TransportSpec.densities[2]
    assert spec.replaced(dimension=2, packing_fraction=(0.3,)).packing_fraction == (0.3,)
    path.write_text("[transport]\npacking_fraction = [0.1]\ncollisions_per_particle = 50\n")
    spec = TransportSpec.of_argument(path).replaced(relative_error=0.1)
    assert (spec.relative_error, spec.collisions_per_particle) == (0.1, None)
    assert spec.packing_fraction == (0.1,)
    path.write_text("[scene]\nlattice = 'fcc'\ncells = 2\npacking_fraction = 0.4\n")
    spec = TransportSpec.of_argument(path)
    assert spec.packing_fraction == pytest.approx((0.4,))
    assert spec.replaced(dimension=2).packing_fraction == TransportSpec.densities[2]


def test_the_length_follows_from_the_error_asked_for():
    loose, tight = (studies.TransportSpec(packing_fraction=(0.3,), relative_error=e) for e in (0.01, 0.005))
    one, two = (spec.tasks()[0]["collisions_per_particle"] for spec in (loose, tight))
    assert two == pytest.approx(4.0 * one, rel=1e-3)
    alone, many = (replace(tight, replicas=k).tasks()[0]["collisions_per_particle"] for k in (1, 3))
    assert 3.0 * many == pytest.approx(alone, rel=1e-3)  # of each, which share the whole


def test_the_time_between_samples_is_in_the_units_of_diameters_and_masses():
    def every(length, mass, mixed):
        kinds = [{"diameter": x * length, "mass": x * x * mass} for x in (1.0, 0.5)]
        scene = {"species": [{"fraction": 0.5} | kind for kind in kinds]} if mixed else kinds[1]
        return studies.TransportSpec(packing_fraction=(0.3,), scene=scene).tasks()[0]["every"]

    for mixed in (False, True):
        one = every(1.0, 1.0, mixed)
        rounded = pytest.approx(2.0 * one, rel=2e-3)  # to four digits
        assert every(2.0, 1.0, mixed) == rounded
        assert every(1.0, 4.0, mixed) == rounded


@pytest.mark.slow
def test_published_values_are_met():
    # L. Lue, J. Chem. Phys. 122, 044513 (2005), at rho = 0.5, and Erpenbeck and Wood (1991) for infinite N.
    found = carom.transport(0.5 * math.pi / 6.0, n=500, relative_error=0.02)
    (row,) = found.points
    assert row.mean_free_time == pytest.approx(0.13031, abs=3e-4)
    assert row.shear_viscosity.mean == pytest.approx(0.58, abs=0.06)
    assert row.thermal_conductivity.mean == pytest.approx(2.3, abs=0.2)
    shift = theory.diffusion_shift(1372, 0.5, row.shear_viscosity.mean)
    at_1372 = (row.self_diffusion_infinite.mean - shift) * 1371 / 1372
    assert at_1372 == pytest.approx(0.247, abs=math.hypot(3 * 0.002, 3 * row.self_diffusion_infinite.error))
    wood = float(theory.erpenbeck_wood(0.5 * math.pi / 6.0)) * row.enskog.self_diffusion
    assert row.self_diffusion_infinite.mean == pytest.approx(wood, rel=0.02)


@pytest.mark.slow
def test_thin_and_dense_fluids_diffuse_as_erpenbeck_and_wood_found():
    # Phys. Rev. A 43, 4254 (1991): infinite N, their formula for D over Enskog's.
    etas = [rho * math.pi / 6.0 for rho in (0.1, 0.7, 0.8)]
    thin, _, dense = rows = carom.transport(etas, replicas=2, relative_error=0.02).points
    for r in rows:
        found, wood = r.self_diffusion_infinite, theory.erpenbeck_wood(r.packing_fraction)
        print(r.packing_fraction, found.value_text, float(wood) * r.enskog.self_diffusion)
        assert found.mean == pytest.approx(
            float(wood) * r.enskog.self_diffusion, rel=0.02, abs=FIVE * found.error
        )
    # Enskog's theory is good to a percent in a gas, and too small near freezing.
    for name in ("shear_viscosity", "thermal_conductivity"):
        c, enskog = getattr(thin, name), getattr(thin.enskog, name)
        assert c.mean == pytest.approx(enskog, rel=0.01, abs=FIVE * c.error)
    assert dense.shear_viscosity.mean > 1.1 * dense.enskog.shear_viscosity
    # The slope a window later is the same: nothing of the slow decay is cut off.
    for r in rows:
        c = r.shear_viscosity
        late = next(x for t, x in zip(c.times, c.running, strict=True) if t > c.window[1])
        assert late.mean == pytest.approx(c.mean, abs=FIVE * late.error)


@pytest.mark.slow
def test_the_viscosity_of_an_isotopic_mixture_is_that_of_erpenbecks_enskog_theory():
    # J. J. Erpenbeck, Phys. Rev. A 39, 4718 (1989): V = 3 V_0, masses 1 and 0.1, tenth Enskog approximation.
    species = [
        {"name": "heavy", "fraction": 0.5, "mass": 1.0},
        {"name": "light", "fraction": 0.5, "mass": 0.1},
    ]
    eta = math.sqrt(2.0) / 3.0 * math.pi / 6.0
    (r,) = carom.transport(eta, n=256, replicas=2, relative_error=0.02, scene={"species": species}).points
    print(r.shear_viscosity)
    # At this density what is beyond Enskog takes some percent of a pure fluid's viscosity.
    assert r.shear_viscosity.mean == pytest.approx(
        0.2937862, abs=4.0 * r.shear_viscosity.error + 0.03 * 0.2937862
    )


@pytest.mark.slow
def test_error_bars_of_100_short_runs_cover():
    settings = {"n": 32, "collisions_per_particle": 3000, "equilibration": 100}
    many = carom.transport(0.2, replicas=100, **settings)
    records = many.records

    def numbers(r):
        return [r.shear_viscosity, r.thermal_conductivity, r.bulk_viscosity, r.self_diffusion[0]]

    truths = [c.mean for c in numbers(coefficients_of(records))]
    inside, deviations = np.zeros(4), []
    for record in records:
        found = numbers(coefficients_of([record]))
        held = [
            low <= truth <= high
            for truth, (low, high) in zip(truths, (v.confidence() for v in found), strict=True)
        ]
        inside += held
        deviations.append([(v.mean - truth) / truth for v, truth in zip(found, truths, strict=True)])
    print("inside 95 %:", inside / len(records), "bias:", np.mean(deviations, axis=0))
    assert (inside >= 0.88 * len(records)).all()  # 95 %, less three standard deviations of a count
    errors = np.std(deviations, axis=0) / math.sqrt(len(records))
    assert (np.abs(np.mean(deviations, axis=0)) < 0.35 * math.sqrt(len(records)) * errors).all()


@pytest.mark.slow
def test_different_masses_conduct_by_enskog_with_and_without_labels():
    # Isotopes: equal sizes, masses 1 and 0.1, at three times the volume of close packing. Enskog's shear
    # viscosity is 0.2937862 in units of the heavy mass: J. J. Erpenbeck, Phys. Rev. A 39, 4718 (1989).
    eta = math.pi / math.sqrt(18.0) / 3.0
    species = [{"name": "a", "fraction": 0.5, "mass": 1.0}, {"name": "b", "fraction": 0.5, "mass": 0.1}]
    found = carom.transport(eta, n=216, relative_error=0.03, scene={"species": species})
    value = found.points[0].shear_viscosity
    assert value.mean == pytest.approx(0.2937862, abs=FIVE * value.error + 0.03 * 0.2937862)


def test_the_shift_and_the_tail_are_given_in_the_units_of_length_mass_and_temperature():
    length, mass, kT = 2.0, 4.0, 9.0
    speed = math.sqrt(kT / mass)
    time, of_diffusion = length / speed, length * speed
    density, viscosity, diffusion = 0.5, 0.7, 0.3
    units = {"mass": mass, "kT": kT}
    scaled = density / length**3, viscosity * mass * speed / length**2
    one = theory.diffusion_shift(500, density, viscosity, self_diffusion=diffusion)
    found = theory.diffusion_shift(500, *scaled, self_diffusion=diffusion * of_diffusion, **units)
    assert found == pytest.approx(one * of_diffusion, rel=1e-12)
    for d in (2, 3):
        scaled = density / length**d, diffusion * of_diffusion, viscosity * mass * speed / length ** (d - 1)
        one = theory.velocity_tail(density, diffusion, viscosity, d)
        found = theory.velocity_tail(*scaled, d, **units)
        assert found == pytest.approx(one * speed**2 * time ** (0.5 * d), rel=1e-12)


def test_few_blocks_have_no_small_error_by_chance():
    """16 blocks of a current without memory: one run in 60 was 3 standard errors off, one in 1500 five."""
    rng = np.random.default_rng(1)
    lags, count, components, pulls = (20, 40, 80), 640, 3, []
    for _ in range(400):
        walks = np.cumsum(rng.standard_normal((16, components, count)), axis=2) * math.sqrt(2.0 * 0.5)
        squares = [np.mean((walks[..., lag:] - walks[..., :-lag]) ** 2, axis=(1, 2)) for lag in lags]
        point = point_of([block_of([0.0])] * 16, samples=count + 1)
        point.lags, point.times = np.array(lags), 0.5 * np.array(lags)
        value = point.coefficient(np.stack(squares, axis=1)[:, None], 1.0, components)
        pulls.append((value.mean - 1.0) / value.error)
    # Without the least error the root mean square is 1.11, and 6 of 400 are beyond 3; 1.1 are expected.
    assert np.std(pulls) < 1.06
    assert np.sum(np.abs(pulls) > 3.0) <= 4


def test_a_short_run_has_blocks_that_hold_all_lags():
    assert [windows.blocks_within(length, 64) for length in (100.0, 5120.0, 6400.0, 1e6)] == [16, 16, 20, 64]
    assert windows.blocks_within(1e6, 16) == 16
