"""Theory against tables, exact cases and its own limits."""

import csv
import inspect
import json
import math
from pathlib import Path

import numpy as np
import pytest

from carom import theory
from carom.errors import InputError
from carom.theory.transport import SONINE

DATA = Path(__file__).parents[1] / "data"


def table(name):
    """Rows of a reference file; its first lines, with #, are its sources."""
    with open(DATA / name, encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def column(rows, name):
    return np.array([float(row[name]) for row in rows])


SPHERES = table("hard_spheres_fluid.csv")
DISKS = table("hard_disks_fluid.csv")
SOLID = table("hard_spheres_fcc_solid.csv")
# The files round Z to six decimals, that of the crystal to five.
ROUNDING, FIVE_DECIMALS = 5.1e-7, 5.1e-6


def eta_of(rows):
    # That of spheres is rounded to seven digits in the file, rho is exact.
    return column(rows, "eta") if rows is DISKS else math.pi / 6 * column(rows, "rho")


@pytest.mark.parametrize(
    ("rows", "equation", "name", "atol"),
    [
        (SPHERES, theory.carnahan_starling, "Z_CS", ROUNDING),
        (SPHERES, theory.kolafa_labik_malijevsky, "Z_KLM", ROUNDING),
        (SPHERES, theory.pieprzyk, "Zref_mKLM", ROUNDING),
        (DISKS, theory.henderson, "Henderson", 2 * ROUNDING),
        (DISKS, theory.santos_lopez_de_haro_yuste, "SHY", 2 * ROUNDING),
        (DISKS, theory.best(2), "Zref", 2 * ROUNDING),
        (SOLID, theory.speedy, "Z_Speedy98", FIVE_DECIMALS),
        (SOLID, theory.almarza, "Z_Almarza", FIVE_DECIMALS),
        (SOLID, theory.hall, "Z_Hall", FIVE_DECIMALS),
    ],
)
def test_equations_give_the_tables_to_their_last_digit(rows, equation, name, atol):
    eta = eta_of(rows)
    np.testing.assert_allclose(equation(eta), column(rows, name), rtol=0, atol=atol)
    assert equation(float(eta[0])) == pytest.approx(equation(eta)[0], rel=1e-14)


SIZES = [*((SPHERES, n) for n in (108, 256, 500, 864, 1372, 4000)), *((DISKS, n) for n in (72, 256, 1024))]


@pytest.mark.parametrize(("rows", "n"), SIZES)
def test_finite_size_shifts_are_those_of_the_tables(rows, n):
    eta, equation = eta_of(rows), theory.best(2) if rows is DISKS else theory.pieprzyk
    shifted = equation(eta) + theory.finite_size_shift(eta, n, equation)
    # Five decimals, and the last one differs by one where the table used other differences.
    np.testing.assert_allclose(shifted, column(rows, f"Z_N{n}"), rtol=0, atol=1.1e-5)


@pytest.mark.parametrize("n", [1, 2, 10, 1000])
def test_finite_size_shift_is_exact_on_a_line(n):
    eta = np.linspace(0.05, 0.95, 10)
    # Differences with the step eps^(1/6) are good to eps^(2/3), times the sixth derivative near the pole.
    np.testing.assert_allclose(
        theory.tonks(eta) + theory.finite_size_shift(eta, n, theory.tonks), theory.tonks(eta, n), rtol=1e-6
    )


def test_tonks_gas_gives_the_table():
    for row in table("tonks_gas.csv"):
        if row["quantity"] == "Z":
            n = None if row["N"] == "inf" else int(row["N"])
            assert theory.tonks(float(row["rho"]), n) == pytest.approx(float(row["value"]), abs=5e-9)


def test_virial_coefficients_give_the_table():
    for row in table("virial_coefficients.csv"):
        d, k = int(row["d"]), int(row["k"])
        if k > 10:
            continue
        # Where several sources are listed they agree within three of their errors.
        error = 3 * float(row["err"]) + 1e-7
        assert theory.virial_coefficients(d)[k - 2] / 2 ** ((d - 1) * (k - 1)) == pytest.approx(
            float(row["Bk_over_B2^(k-1)"]), abs=error
        )


@pytest.mark.parametrize("dimension", [1, 2, 3, 4, 5, 6])
def test_every_equation_has_the_exact_second_and_third_virial_coefficients(dimension):
    beta = theory.virial_coefficients(dimension)
    assert beta[0] == 2 ** (dimension - 1)
    eta = 1e-4
    # (Z - 1) / eta - B_2 - B_3 eta is of order B_4 eta^2, times a factor that is below 2 this far down.
    remainder = (theory.best(dimension)(eta) - 1) / eta - beta[0] - beta[1] * eta
    assert abs(remainder) < 2 * abs(beta[2]) * eta**2 + 2 * np.finfo(float).eps / eta


@pytest.mark.parametrize("dimension", [1, 2, 3, 4, 5, 6])
def test_pade_approximants_reproduce_the_series(dimension):
    # The first power that an approximant of eight terms does not keep is the ninth, with a coefficient of the
    # order of the eighth's, which alternating series let grow by a factor of 20.
    eta = 0.02 / 2**dimension
    series = theory.virial_series(eta, dimension, order=9)
    bound = 20 * abs(theory.virial_coefficients(dimension)[-1]) * eta**8
    assert abs(theory.virial_pade(eta, dimension, (4, 4)) - series) < bound + 4 * np.finfo(float).eps


def test_four_dimensional_approximants_agree_where_the_fluid_is_dense():
    low, high = theory.virial_pade(0.25, 4, (3, 4)), theory.virial_pade(0.25, 4, (4, 3))
    assert abs(low - high) < 1e-3
    assert theory.best(4)(0.25) == pytest.approx(0.5 * (low + high), rel=1e-14)


def test_contact_values_give_the_table():
    for row in table("contact_values.csv"):
        d, eta = int(row["d"]), float(row["eta"])
        simple = theory.carnahan_starling if d == 3 else theory.henderson
        for equation, name in ((simple, "g_CS_or_Henderson"), (theory.best(d), "g_accurate")):
            value = theory.contact_value(equation(eta), eta, d)
            # The table's accurate values carry the error of its Z, up to 1e-5.
            assert value == pytest.approx(float(row[name]), abs=1.1e-6 if name != "g_accurate" else 1.1e-5)


@pytest.mark.parametrize("n", [None, 2, 100])
def test_contact_value_and_compressibility_factor_are_inverses(n):
    for dimension in range(1, 7):
        contact = theory.contact_value(1.7, 0.1, dimension, n)
        assert theory.compressibility_factor(contact, 0.1, dimension, n) == pytest.approx(1.7, rel=1e-15)


def test_contact_value_of_finitely_many_rods_is_the_exact_one():
    for row in table("tonks_gas.csv"):
        if row["quantity"] == "g_N" and row["r"] == "1.0000001":
            n, rho = int(row["N"]), float(row["rho"])
            # The table stands at r = 1 + 1e-7, where g has fallen by at most 1e-7 g N rho / (1 - rho).
            assert theory.contact_value(theory.tonks(rho, n), rho, 1, n) == pytest.approx(
                float(row["value"]), rel=5e-6
            )


def test_mean_free_times_give_the_tables():
    for rows, d, name in ((SPHERES, 3, "Zref_mKLM"), (DISKS, 2, "Zref")):
        # t0 is known to the relative rounding of Z - 1.
        computed = theory.mean_free_time(column(rows, name), d)
        np.testing.assert_allclose(computed, column(rows, "t0_meanfreetime"), rtol=1e-5)


def test_speed_factor_is_the_mean_speed_on_a_sphere():
    # One degree of freedom: |v| is 1 against sqrt(2 / pi) of a Gaussian.
    assert theory.speed_factor(1) == pytest.approx(math.sqrt(math.pi / 2), rel=1e-15)
    # The next term of the expansion is 1 / (32 D^2).
    assert theory.speed_factor(300) == pytest.approx(1 + 1 / 1200, abs=1 / 300**2)


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_tail_of_mode_coupling_is_the_sum_over_the_waves_of_a_box(dimension):
    # Of each wave, d - 1 of d directions are transverse and decay by exp(-(D + nu) k^2 t). In a box of edge L
    # the sum over all waves, k = 0 among them, is the tail up to exp(-L^2 / (4 (D + nu) t)), here e^-300.
    density, diffusion, viscosity, mass, kT, t = 0.4, 0.3, 0.7, 2.0, 1.5, 3.0
    spread = 4.0 * (diffusion + viscosity / (mass * density)) * t
    edge = math.sqrt(300.0 * spread)
    decays = np.exp(-0.25 * spread * (2.0 * math.pi / edge * np.arange(-200, 201)) ** 2)
    waves = decays.sum() ** dimension
    expected = (1.0 - 1.0 / dimension) * kT / (mass * density * edge**dimension) * waves
    amplitude = theory.velocity_tail(density, diffusion, viscosity, dimension, mass=mass, kT=kT)
    assert amplitude * t ** (-0.5 * dimension) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize(
    ("dimension", "volume"), [(1, 1), (2, math.pi / 4), (3, math.pi / 6), (4, math.pi**2 / 32)]
)
def test_ball_volumes(dimension, volume):
    assert theory.ball_volume(dimension) == pytest.approx(volume, rel=1e-15)
    assert theory.ball_volume(dimension, 2.0) == pytest.approx(volume * 2**dimension, rel=1e-15)


def test_equations_take_floats_and_arrays():
    equations = [theory.best(d) for d in range(1, 7)]
    equations += [theory.carnahan_starling, theory.henderson, theory.kolafa_labik_malijevsky]
    equations += [theory.santos_lopez_de_haro_yuste, lambda eta: theory.virial_series(eta, 3)]
    for equation in equations:
        assert isinstance(equation(0.05), float)
        assert equation(0.0) == 1.0
        # An array's powers are computed by another routine, within a few roundings of the float's.
        np.testing.assert_allclose(
            equation(np.array([0.05, 0.1])), [equation(0.05), equation(0.1)], rtol=16 * np.finfo(float).eps
        )


CRYSTALS = (theory.almarza, theory.speedy, theory.hall)
NO_CRYSTAL = ((0.3, "from 0.49"), (0.75, "close packing"))
NO_MIXTURES = (
    ([1.0], [1.0, 2.0], "needs one of each"), ([], [], "needs one of each"),
    ([-1.0, 2.0], [1.0, 1.0], "at least zero"), ([1.0], [0.0], "must be positive"),
)  # fmt: skip
OF_FRACTIONS = (
    lambda x, sigma: theory.bmcsl(0.3, x, sigma),
    lambda x, sigma: theory.bmcsl_contact_value(0.3, x, sigma),
    lambda x, sigma: theory.jenkins_mancini(0.3, x, sigma),
    lambda x, sigma: theory.santos_yuste_lopez_de_haro(0.3, x, sigma, 4),
    lambda x, sigma: theory.mixture_second_virial(x, sigma, 3),
)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: theory.collision_rate(2.0, 3, n=1), "n must be at least 2"),
        (lambda: theory.contact_value(2.0, 0.1, 3, n=1), "n must be at least 2"),
        (lambda: theory.compressibility_factor(2.0, 0.1, 3, n=0), "n must be at least 1"),
        (lambda: theory.mean_free_time(1.0, 3), "must be above 1"),
        (lambda: theory.mean_free_time(np.array([2.0, 1.0]), 3), "must be above 1"),
        (lambda: theory.speed_factor(0), "degrees_of_freedom must be greater than 0"),
        (lambda: theory.finite_size_shift(0.1, 0, theory.best(3)), "n must be at least 1"),
        (lambda: theory.crystal_finite_size_shift(0.6, 0, theory.almarza), "n must be at least 1"),
        (lambda: theory.tonks(0.1, 0), "n must be at least 1"),
        (lambda: theory.erpenbeck_wood(2.0), "between 0 and 1"),
        (lambda: theory.erpenbeck_wood(np.array([0.1, 0.6])), "from 0 to 0.5"),
        *((lambda crystal=f, at=x: crystal(at), said) for f in CRYSTALS for x, said in NO_CRYSTAL),
        *(
            (lambda x=x: theory.carnahan_starling(x), "between 0 and 1")
            for x in (-0.1, 1.0, math.nan, [0.1, 2.0])
        ),
        *((lambda d=d: theory.best(d), "1 to 6") for d in (0, 7)),
        (lambda: theory.free_volume(0.1, 7), "1 to 6"),
        (lambda: theory.structure_factor(1.0, 0.3, dimension=2), "1 and 3"),
        (lambda: theory.virial_series(0.1, 4, order=11), "B_1 to B_10"),
        (lambda: theory.virial_pade(0.1, 2, (6, 6)), "powers up to 12"),
        (lambda: theory.coexistence(theory.pieprzyk, theory.tonks), "no pressure"),
        (lambda: theory.coexistence(free_energy=4.0), "do not cross"),
        *((lambda of=of: theory.bmcsl(0.3, *of), said) for *of, said in NO_MIXTURES),
        *(
            (lambda f=f, x=x: f(x, [0.25, 0.75]), r"add up to .* exchange the arguments")
            for f in OF_FRACTIONS
            for x in ([1.0, 0.5], [3, 1], [0.5, 0.4])
        ),
    ],
)
def test_numbers_out_of_range_are_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()


def test_fractions_that_were_rounded_to_three_digits_are_what_was_meant():
    thirds, sizes = [1 / 3, 1 / 3, 1 / 3], [1.0, 0.5, 0.7]
    assert theory.bmcsl(0.3, [0.333] * 3, sizes) == theory.bmcsl(0.3, thirds, sizes)


def test_without_density_there_is_no_finite_size_shift():
    assert theory.finite_size_shift(0.0, 100, theory.best(3)) == 0.0
    both = theory.finite_size_shift(np.array([0.0, 0.3]), 100, theory.carnahan_starling)
    np.testing.assert_array_equal(both, [0.0, theory.finite_size_shift(0.3, 100, theory.carnahan_starling)])


@pytest.mark.parametrize("dimension", [1, 2, 3, 4, 5, 6])
def test_free_volume_has_the_pole_of_close_packing(dimension):
    """Z (V / V_0 - 1) -> d: exact for crystals, whose last d N degrees of freedom all feel the volume."""
    gap = 1e-6
    eta = theory.CLOSE_PACKING[dimension] / (1.0 + gap)
    # The next term of the expansion in the gap is below twice the gap.
    assert theory.free_volume(eta, dimension) * gap == pytest.approx(dimension, rel=2.0 * gap)


def test_free_volume_is_exact_on_a_line():
    eta = np.linspace(0.1, 0.9, 9)
    np.testing.assert_allclose(theory.free_volume(eta, 1), theory.tonks(eta), rtol=1e-14)
    shifted = theory.tonks(eta) + theory.crystal_finite_size_shift(eta, 7, theory.tonks)
    np.testing.assert_allclose(shifted, theory.tonks(eta, 7), rtol=1e-14)


@pytest.mark.parametrize("equation", CRYSTALS)
def test_crystal_equations_approach_the_free_volume_law(equation):
    eta = 0.9999 * theory.CLOSE_PACKING[3]
    assert equation(eta) == pytest.approx(theory.free_volume(eta, 3), rel=1e-3)


def test_coexistence_is_that_of_the_same_free_energy_and_of_the_literature():
    published = json.loads((DATA / "hard_spheres_coexistence.json").read_text())
    own = published["own_maxwell_construction"]
    found = theory.coexistence(theory.pieprzyk, theory.almarza)
    # The two were made with different crystals, which differ by 5e-4 at melting; so do the pressures less.
    assert found.pressure == pytest.approx(own["betaP_sigma3"], rel=5e-5)
    assert found.freezing == pytest.approx(own["eta_f"], rel=5e-5)
    assert found.melting == pytest.approx(own["eta_s"], rel=5e-5)
    assert found.chemical_potential == pytest.approx(own["beta_mu"], rel=5e-5)
    # The free energy of reference is known to 3e-5; the direct simulations' pressure to 1e-3, and 5e-4 apart.
    assert found.pressure == pytest.approx(published["literature"][0]["betaP_sigma3"], rel=1e-3)


MIXTURE = json.loads((DATA / "mixtures.json").read_text())["data"][0]
BINARY = (MIXTURE["x"], MIXTURE["sigma"])


def test_bmcsl_gives_the_table_and_its_contact_values_give_its_pressure():
    eta = MIXTURE["eta"]
    z = theory.bmcsl(eta, *BINARY)
    assert z == pytest.approx(MIXTURE["BMCSL"], abs=5e-6)
    # Its accuracy against simulation is 0.4 %.
    assert z == pytest.approx(MIXTURE["Z"], rel=4e-3)
    x, sigma = np.array(BINARY[0]), np.array(BINARY[1])
    contact = 0.5 * (sigma[:, None] + sigma)
    g = theory.bmcsl_contact_value(eta, *BINARY)
    virial = 1.0 + 4.0 * eta * (x @ (contact**3 * g) @ x) / (x @ sigma**3)
    assert virial == pytest.approx(z, rel=1e-14)


def test_mixtures_of_one_species_are_no_mixtures():
    eta = np.array([0.1, 0.3, 0.45])
    for x, sigma in (([1.0], [2.0]), ([0.75, 0.25], [0.7, 0.7])):
        np.testing.assert_allclose(theory.bmcsl(eta, x, sigma), theory.carnahan_starling(eta), rtol=1e-14)
        np.testing.assert_allclose(theory.jenkins_mancini(eta, x, sigma), theory.henderson(eta), rtol=1e-13)
        for d in (1, 2, 3, 4):
            mixed = theory.santos_yuste_lopez_de_haro(eta / d, x, sigma, d)
            np.testing.assert_allclose(mixed, theory.best(d)(eta / d), rtol=1e-13)


def test_rods_of_two_lengths_are_the_tonks_gas():
    eta = np.array([0.2, 0.7])
    mixed = theory.santos_yuste_lopez_de_haro(eta, [0.3, 0.7], [1.0, 0.2], 1)
    np.testing.assert_allclose(mixed, theory.tonks(eta), rtol=1e-14)


def test_disks_of_two_sizes_follow_the_printed_form_of_jenkins_and_mancini():
    eta, x, sigma = 0.6, np.array([0.5, 0.5]), np.array([1.0, 1.4])
    xi = (x @ sigma) ** 2 / (x @ sigma**2)
    printed = xi * theory.henderson(eta) + (1 - xi) / (1 - eta)
    assert theory.jenkins_mancini(eta, x, sigma) == pytest.approx(printed, rel=1e-14)


def test_contact_values_of_two_theories_of_spheres_have_the_same_first_order():
    """That is exact: what is left is of the order of the packing fraction times it."""
    eta, x, sigma = 1e-5, [0.2, 0.5, 0.3], [1.0, 0.2, 0.7]
    first = (theory.santos_yuste_lopez_de_haro_contact_value(eta, x, sigma, 3) - 1.0) / eta
    assert first == pytest.approx((theory.bmcsl_contact_value(eta, x, sigma) - 1.0) / eta, rel=10.0 * eta)
    assert np.ptp(first) > 1.0


@pytest.mark.parametrize("dimension", [1, 2, 3, 4, 5, 6])
def test_mixtures_have_the_exact_second_virial_coefficient(dimension):
    x, sigma = [0.2, 0.5, 0.3], [1.0, 0.4, 0.7]
    exact = theory.mixture_second_virial(x, sigma, dimension)
    eta = 1e-6
    slope = (theory.santos_yuste_lopez_de_haro(eta, x, sigma, dimension) - 1.0) / eta
    # What is left is B_3 eta, with B_3 below B_2^2.
    assert slope == pytest.approx(exact, rel=2.0 * exact * eta)
    if dimension == 3:
        assert (theory.bmcsl(eta, x, sigma) - 1.0) / eta == pytest.approx(exact, rel=2.0 * exact * eta)
    assert theory.mixture_second_virial([1.0], [3.0], dimension) == pytest.approx(2.0 ** (dimension - 1))


@pytest.mark.parametrize("dimension", [1, 2, 3, 4])
def test_collision_rates_of_a_species_are_those_of_equal_particles(dimension):
    eta, sigma, mass = 0.2, 1.3, 0.6
    z = theory.best(dimension)(eta)
    density = eta / theory.ball_volume(dimension, sigma)
    g = theory.contact_value(z, eta, dimension)
    rate = theory.species_collision_rate(density, g, sigma, mass / 2, dimension, kT=2.0)
    same = theory.collision_rate(z, dimension, diameter=sigma, mass=mass, kT=2.0)
    assert rate == pytest.approx(same, rel=1e-13)


# The literature's numbers themselves: what is compared with itself elsewhere is wrong together.
def test_freezing_melting_and_close_packing_are_those_of_the_sources():
    # 2D: Bernard and Krauth 2011; 3D: coexistence(); 4D to 6D: van Meel et al. 2009.
    assert theory.FREEZING == {2: 0.70, 3: 0.4917, 4: 0.288, 5: 0.174, 6: 0.105}
    assert theory.MELTING == {2: 0.72, 3: 0.5433, 4: 0.337, 5: 0.206, 6: 0.138}
    # Conway and Sloane, table 1.2: densities of Z, A2, D3, D4, D5, E6 to five digits.
    densities = (1.0, 0.90690, 0.74048, 0.61685, 0.46526, 0.37295)
    for dimension, density in enumerate(densities, start=1):
        assert theory.CLOSE_PACKING[dimension] == pytest.approx(density, abs=5.1e-6)


def test_virial_coefficients_are_those_of_clisby_and_mccoy():
    # J. Stat. Phys. 122, 15 (2006), B_k / B_2^(k-1): k, dimension, value to its last digit.
    published = [
        (3, 4, 0.50634, 5e-6), (4, 4, 0.15184606, 5e-9), (5, 4, 0.0357041, 5e-8), (6, 4, 0.0077359, 5e-8),
        (7, 4, 0.0014303, 5e-8), (8, 4, 0.0002888, 5e-8), (5, 5, 0.0129551, 5e-8), (6, 5, 0.0009815, 5e-8),
        (5, 2, 0.33355604, 5e-9), (8, 2, 0.0649930, 5e-8),
    ]  # fmt: skip
    for k, dimension, value, last_digit in published:
        reduced = theory.virial_coefficients(dimension)[k - 2] / 2.0 ** ((dimension - 1) * (k - 1))
        assert reduced == pytest.approx(value, abs=last_digit)


@pytest.mark.parametrize(
    ("eta", "ratio", "large", "measured", "error", "low"),
    [
        # Carom's own runs of 746 to 2000 spheres (the first two: test_validation_scenes.py).
        # Z of infinitely many is higher by 5e-4 of it at most.
        (0.3, 2.0, 0.5, 3.5117, 0.0013, (0.0, 0.003)),
        (0.4224, 4.62, 0.135, 3.8695, 0.0050, (0.003, 0.007)),
        (0.4, 5.0, 0.1, 3.289, 0.004, (0.005, 0.007)),
        (0.4, 5.0, 0.02, 3.739, 0.004, (0.005, 0.007)),
    ],
)
def test_bmcsl_is_as_low_as_its_help_says(eta, ratio, large, measured, error, low):
    z = theory.bmcsl(eta, [large, 1.0 - large], [1.0, 1.0 / ratio])
    least, most = (1.0 - part for part in low)
    assert measured * most - 4.0 * error <= z <= measured * least + 4.0 * error
    assert "0.7 % for 1 : 5" in " ".join(theory.bmcsl.__doc__.split())


@pytest.mark.parametrize("eta", [0.05, 0.3, 0.45])
def test_long_waves_of_density_have_the_compressibility(eta):
    """Of rods, (1 - eta)^2, and of spheres that of the Percus-Yevick equation (Wertheim 1963)."""
    assert theory.structure_factor(0.0, eta, dimension=1) == pytest.approx((1.0 - eta) ** 2, rel=1e-12)
    spheres = (1.0 - eta) ** 4 / (1.0 + 2.0 * eta) ** 2
    assert theory.structure_factor(0.0, eta) == pytest.approx(spheres, rel=1e-12)
    assert theory.structure_factor(1e-3, eta, diameter=2.0) == theory.structure_factor(2e-3, eta)
    assert theory.structure_factor(np.array([1e3]), eta)[0] == pytest.approx(1.0, abs=1e-3)


NUMBERS = {
    "packing_fraction": 0.3, "dimension": 3, "fractions": [0.5, 0.5], "diameters": [1.0, 0.5], "n": 100,
    "equation": theory.pieprzyk, "degrees_of_freedom": 300.0, "well": 1.5, "compressibility_factor": 4.0,
}  # fmt: skip


@pytest.mark.parametrize(
    "name", [name for name in theory.__all__ if inspect.isfunction(getattr(theory, name))]
)
def test_text_is_no_number_of_any_function(name):
    """NumPy takes "0.3" for 0.3 in some places, and is silent or says something of its own in others."""
    function = getattr(theory, name)
    parameters = inspect.signature(function).parameters
    needed = {
        each: NUMBERS.get(each, 1.0)
        for each, of in parameters.items()
        if of.default is inspect.Parameter.empty
    }
    for each in parameters:
        for text in ("0.3", "x", b"1", ["0.3", 0.4], np.array(["0.3"]), np.array("0.3"), [[1.0], ["2"]]):
            with pytest.raises(
                InputError, match=f"{each} must be an? (number|equation) .*; leave out the quotes"
            ):
                function(**{**needed, each: text})
    with pytest.raises(InputError, match="leave out the quotes"):
        theory.best(3)("0.3")


def sonine_orders(d, orders):
    """Return factors over the first order of self-diffusion, viscosity and conductivity, for every order.

    Brackets of the linearized Boltzmann equation, by Gaussian quadrature that is exact for polynomials: over
    the relative velocity g, the angle of the line of centers to it, and the mean velocity.
    """
    from scipy.special import eval_genlaguerre, roots_genlaguerre, roots_jacobi

    nodes = 2 * orders + 2

    def length(k):  # of a Gaussian vector in k dimensions
        x, w = roots_genlaguerre(nodes, 0.5 * k - 1.0)
        return np.sqrt(2.0 * x), w / w.sum()

    along, height = np.polynomial.hermite_e.hermegauss(nodes)
    cosine, share = roots_jacobi(nodes, 0.5 * (d - 3), 0)
    rules = [length(d + 1), (0.5 * (cosine + 1.0), share / share.sum())]
    rules += [(along, height / height.sum())] * 2 + [length(d - 2)]
    g, square, a, b, rest = (x.ravel() for x in np.meshgrid(*(rule[0] for rule in rules), indexing="ij"))
    weight = np.einsum("a,b,c,d,e->abcde", *(rule[1] for rule in rules)).ravel()
    c, s, none = np.sqrt(square), np.sqrt(1.0 - square), np.zeros_like(g)
    mean = np.stack([a, b, rest])
    before, after = np.stack([g, none, none]), np.stack([g * (1.0 - 2.0 * c * c), -2.0 * c * s * g, none])
    old, new = ([(mean + sign * r) / math.sqrt(2.0) for sign in (1.0, -1.0)] for r in (before, after))

    def changes(index, order, of):  # of a polynomial of one particle, or of both
        return [
            (sign * eval_genlaguerre(order, index, 0.5 * np.sum(u * u, axis=0)), u)
            for sign, velocities in ((1.0, new), (-1.0, old))
            for u in velocities[:of]
        ]

    def product(u, v, rank):
        dot = np.sum(u * v, axis=0)
        return dot if rank == 1 else dot**2 - np.sum(u * u, axis=0) * np.sum(v * v, axis=0) / d

    found = []
    for rank, of, first in ((1, 1, 0), (2, 2, 0), (1, 2, 1)):
        terms = [changes(0.5 * d + rank - 1.0, first + k, of) for k in range(orders)]
        bracket = np.array([
            [np.sum(weight * sum(f * h * product(u, v, rank) for f, u in x for h, v in y)) for y in terms]
            for x in terms
        ])  # fmt: skip
        found.append([bracket[0, 0] * np.linalg.inv(bracket[:k, :k])[0, 0] for k in range(1, orders + 1)])
    return found


@pytest.mark.parametrize("d", [3, 5, 8, 12])
def test_factors_of_sonine_are_where_their_orders_lead(d):
    """From d = 5 on there were none, and Enskog's coefficients were 1 to 2 % too small."""
    fluid = theory.enskog(2.0, 0.1, d)
    for (_, second, third), factor in zip(sonine_orders(d, 3), SONINE[d], strict=True):
        # Each order adds less than a third of what the one before has added.
        assert third < factor < third + 0.5 * (third - second)
    assert fluid.self_diffusion == pytest.approx(0.25 * math.sqrt(math.pi) * SONINE[d][0])
