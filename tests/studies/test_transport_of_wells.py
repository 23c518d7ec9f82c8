"""Transport of square wells, by a scene file: the dilute gas against Chapman and Enskog.

The collision integrals of the square well are done here (E. F. Holleran and H. M. Hulburt, J. Chem. Phys. 19,
232 (1951)), from the angle by which a pair deflects each other, with none of Carom's code.
"""

import functools
import math

import numpy as np
import pytest

from carom.studies.transport.spec import TransportSpec
from carom.studies.transport.study import Transport

WIDTH, DEPTH = 1.5, 1.0
NODES, WEIGHTS = np.polynomial.legendre.leggauss(100)

FILE = f"""
[scene]
n = 256
dimension = 3
packing_fraction = 0.002

[scene.interaction]
type = "square-well"
range = {WIDTH}
depth = {DEPTH}

[transport]
kT = 2.0
"""


def cross_section(power, energy):
    """Return the cross section of ``1 - cos^power`` of the deflection, over that of hard spheres.

    A pair of relative energy ``energy`` enters the well as light enters glass, with this index:
    """
    index = math.sqrt(1.0 + DEPTH / energy)
    edge = min(index, WIDTH)  # impact parameter beyond which the cores miss each other
    total = 0.0
    for low, high, touch in ((0.0, edge, True), (edge, WIDTH, False)):
        angle = 0.25 * math.pi * (NODES + 1.0)  # b = low + (high - low) sin(angle): smooth where it grazes
        b = low + (high - low) * np.sin(angle)
        weight = (high - low) * np.cos(angle) * 0.25 * math.pi * WEIGHTS
        bend = np.arcsin(b / WIDTH) - np.arcsin(b / (index * WIDTH))
        turn = np.arcsin(np.minimum(b / index, 1.0)) if touch else 0.5 * math.pi
        cosine = np.cos(math.pi - 2.0 * (bend + turn))
        total += float(np.sum(2.0 * (1.0 - cosine**power) * b * weight))
    return total / (1.0 - (1.0 + (-1.0) ** power) / (2.0 * (1.0 + power)))


@functools.cache
def integral(power, moment, kT):
    """Return the reduced collision integral Omega^(power, moment)*, 1 for hard spheres."""
    y = np.linspace(0.0, 7.0, 1001)[1:]
    sections = np.array([cross_section(power, kT * x * x) for x in y])
    terms = sections * np.exp(-y * y) * 2.0 * y ** (2 * moment + 3)
    return float(terms.sum() * (y[1] - y[0])) / math.factorial(moment + 1)


def gas(density, kT):
    """Return D, shear viscosity and conductivity of the dilute gas, in Kihara's second approximation."""
    one, two = integral(1, 1, kT), integral(2, 2, kT)
    a, c, e = two / one, integral(1, 2, kT) / one, integral(2, 3, kT) / two
    speed = math.sqrt(kT / math.pi)
    viscosity = 5.0 / 16.0 * speed / two
    return (
        3.0 / 8.0 * speed / (density * one) * (1.0 + (6.0 * c - 5.0) ** 2 / (8.0 * (2.0 * a + 5.0))),
        viscosity * (1.0 + 3.0 / 196.0 * (8.0 * e - 7.0) ** 2),
        3.75 * viscosity * (1.0 + (8.0 * e - 7.0) ** 2 / 42.0),
    )


def test_the_integrals_are_those_of_hard_spheres_where_the_well_is_shallow():
    for power, moment in ((1, 1), (1, 2), (2, 2), (2, 3)):
        assert integral(power, moment, 1e6) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.slow
def test_a_dilute_gas_of_wells_is_that_of_chapman_and_enskog(tmp_path):
    path = tmp_path / "gas.toml"
    path.write_text(FILE)
    found = Transport(TransportSpec.of_argument(path).replaced(replicas=1, relative_error=0.04)).run(
        executor="serial"
    )
    (row,) = found.points
    kT = found.records[0]["result"]["kT"]
    density = row.n / row.edge**3
    diffusion, viscosity, conductivity = gas(density, kT)
    assert kT == pytest.approx(2.0, rel=0.02)
    # Hard spheres have 1.18 times this D, and 1.24 times the others. A density of 0.004, at which one in a
    # hundred is bound, takes 2 % of D; a quarter of it takes 1 %.
    for c, right in (
        (row.self_diffusion[0], diffusion),
        (row.self_diffusion_by_velocity[0], diffusion),
        (row.shear_viscosity, viscosity),
        (row.thermal_conductivity, conductivity),
    ):
        print(c.value_text, right, (c.mean - right) / c.error)
        assert c.mean == pytest.approx(right, abs=4.0 * c.error + 0.025 * right)
    # A gas of pairs has no bulk viscosity to first order in density.
    assert row.bulk_viscosity.mean < 0.02 * viscosity
