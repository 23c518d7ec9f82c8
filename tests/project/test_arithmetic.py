"""Arithmetic that has the same bits on every processor, and the observables that are computed with it."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
from helpers.scripts import python

from carom import arithmetic

EPS = np.finfo(float).eps

WIDE = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR X86_V4 AVX2 FMA3 X86_V3"
"""Instructions of wide registers, by NumPy's names."""

OBSERVED = """
import hashlib, numpy as np, carom
from carom.frame import Frame
from carom.theory import santos_yuste_lopez_de_haro

def frames(d, n=64, kinds=2):
    rng = np.random.default_rng(d)
    species = np.arange(n) % kinds
    x, v = 9.0 * rng.random((n, d)), rng.normal(size=(n, d))
    v -= v.mean(axis=0)
    size = np.full(n, 1e-3) if kinds == 1 else np.where(species == 0, 1e-3, 1.4e-3)
    for k in range(20):
        yield Frame(0.1 * k, k, (x + 0.1 * k * v) % 9.0, v, (9.0,) * d, size, np.ones(n), species=species,
                    periodic=(True,) * d, images=np.floor((x + 0.1 * k * v) / 9.0).astype(np.int32))

def put(found, seen):
    for value in vars(found).values() if hasattr(found, "__dict__") else [found]:
        if isinstance(value, np.ndarray):
            seen.update(value.tobytes())
        elif isinstance(value, (list, tuple)):
            for each in value:
                put(each, seen)
        else:
            seen.update(repr(value).encode())

def told(name, *found):
    seen = hashlib.sha256()
    for each in found:
        put(each, seen)
    print(name, seen.hexdigest())

for d in (2, 3):
    pair = carom.RDF(rmax=3.0, width=0.1, pair=(0, 1))
    order = carom.BondOrder(rmax=2.0, width=0.2)
    motion = carom.Dynamics(shells=4)
    for observable in (pair, order, motion):
        for frame in frames(d):
            observable.add(frame)
        told(f"{type(observable).__name__} in {d}D", observable.result())
    told(f"g(r) in {d}D", carom.RDF(rmax=3.0, width=0.1).over(list(frames(d, kinds=1))[:1]))
two = [carom.Species(count=20), carom.Species(count=12, diameter=1.4)]
scene = carom.Scene.random(species=two, packing_fraction=0.1, seed=1)
told("box and places of a mixture", scene.positions, np.array(scene.box), scene.packing_fraction)
told("theory of a mixture", santos_yuste_lopez_de_haro(0.3, [0.4, 0.6], [1.0, 1.4], 3))
"""


def same(ours, theirs, units=1.0):
    """Return whether floats lie within some units in the last place of numbers of high precision."""
    off = [abs(mpmath.mpf(float(a)) / b - 1) for a, b in zip(ours, theirs, strict=True)]
    return max(off) <= units * EPS


def test_powers_are_products():
    x = np.random.default_rng(1).random(200)
    for k in range(13):
        exact = [Fraction(float(each)) ** k for each in x]
        error = [abs(Fraction(float(a)) / b - 1) for a, b in zip(arithmetic.power(x, k), exact, strict=True)]
        assert max(error) <= k * EPS


def test_exponentials_are_right_to_a_unit_in_the_last_place():
    x = np.concatenate([np.random.default_rng(1).uniform(-700.0, 700.0, 500), [0.0, 1.0, -1e-17]])
    with mpmath.workdps(40):
        assert same(arithmetic.exponential(x), [mpmath.exp(mpmath.mpf(float(each))) for each in x])


def test_cosines_and_sines_of_turns_are_right_in_every_quarter():
    turns = np.concatenate([np.random.default_rng(1).uniform(-9.0, 9.0, 500), np.arange(-8, 9) / 8.0])
    with mpmath.workdps(40):
        angles = [2 * mpmath.pi * mpmath.mpf(float(each)) for each in turns]
        for ours, exact in zip(arithmetic.cosine_and_sine(turns), (mpmath.cos, mpmath.sin), strict=True):
            off = [abs(mpmath.mpf(float(a)) - exact(b)) for a, b in zip(ours, angles, strict=True)]
            assert max(off) <= 2.0 * EPS


@pytest.mark.parametrize("rank", [1, 2, 3, 4])
def test_factors_and_pseudo_inverses_of_matrices_of_any_rank(rank):
    columns = np.random.default_rng(rank).normal(size=(4, rank))
    form = columns @ columns.T
    factor = arithmetic.factor(form, 1e-9)
    assert factor.shape == (4, rank)
    np.testing.assert_allclose(factor @ factor.T, form, atol=16 * EPS * np.abs(form).max())
    expected = np.linalg.pinv(form, rcond=1e-12, hermitian=True)
    condition = np.abs(form).max() * np.abs(expected).max()
    np.testing.assert_allclose(
        arithmetic.pseudo_inverse(form), expected, atol=64 * EPS * condition * np.abs(expected).max()
    )


def test_least_squares_leave_out_a_column_of_zeros():
    x = np.linspace(-1.0, 1.0, 50)
    columns = np.stack([np.ones(50), 0.0 * x, x], axis=1)
    np.testing.assert_allclose(
        arithmetic.least_squares(columns, 2.0 - 3.0 * x), [2.0, 0.0, -3.0], atol=50 * EPS
    )


def test_observables_have_the_same_bits_with_narrow_registers_and_with_other_matrix_products():
    def observed(**other):
        return python("-W", "ignore", "-c", OBSERVED, **other).splitlines()

    here = observed()
    assert len(here) == 10
    assert observed(NPY_DISABLE_CPU_FEATURES=WIDE, OPENBLAS_CORETYPE="Nehalem") == here
