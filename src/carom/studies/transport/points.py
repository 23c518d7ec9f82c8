"""The coefficients of one point of a transport study."""

from __future__ import annotations

import math
from dataclasses import dataclass

from carom import theory
from carom.observables.statistics import UNKNOWN, Estimate
from carom.studies.folder import Record
from carom.studies.transport.analysis import Coefficient, Point
from carom.theory.transport import HIGHEST

PLANE = (
    "in two dimensions the coefficients grow with the logarithm of time and size without end: what is shown "
    "is the value of this window and this n, and no property of the fluid"
)


@dataclass(frozen=True)
class Coefficients:
    """The coefficients of one point."""

    packing_fraction: float
    n: int
    dimension: int
    replicas: int
    blocks: int
    edge: float  # the longest of the box [length]
    mean_free_time: float
    Z: Estimate  # of this n, with the smallest error
    by_virial: Estimate
    by_rate: Estimate
    self_diffusion: dict[int, Coefficient]  # of each species, by the mean square displacement
    self_diffusion_by_velocity: dict[int, Coefficient]  # by the velocity autocorrelation
    self_diffusion_infinite: Estimate  # by infinite_diffusion(); of equal spheres in d = 3
    shear_viscosity: Coefficient
    bulk_viscosity: Coefficient
    thermal_conductivity: Coefficient
    mutual_diffusion: Coefficient | None  # of a binary mixture
    thermal_diffusion: Coefficient | None
    enskog: theory.Enskog | None  # of equal spheres, by the best equation of state
    at_rest: dict[int, float]
    """Of each species, the factor M / (M - m) that the drift of all others, opposite to the motion of one of
    mass m, takes from its diffusion; M is the mass of all."""
    remarks: tuple[str, ...] = ()

    @property
    def exists(self) -> bool:
        """Whether the coefficients are properties of the fluid: not in two dimensions."""
        return self.dimension > 2

    @property
    def erpenbeck_wood(self) -> float:
        """Self-diffusion at infinite N by :func:`carom.theory.erpenbeck_wood`, up to its highest density; nan
        where the measured is.
        """
        measured = math.isfinite(self.self_diffusion_infinite.mean)
        if self.enskog is None or not measured or self.packing_fraction > HIGHEST:
            return math.nan
        return float(theory.erpenbeck_wood(self.packing_fraction)) * self.enskog.self_diffusion

    def quantities(self) -> dict[str, tuple[Coefficient, float]]:
        """Return all coefficients by name, each with Enskog's value or nan."""
        several = len(self.self_diffusion) > 1
        found = {
            f"self_diffusion_{k}" if several else "self_diffusion": (
                c, getattr(self.enskog, "self_diffusion", math.nan),
            )
            for k, c in self.self_diffusion.items()
        }  # fmt: skip
        for name in (
            "shear_viscosity", "bulk_viscosity", "thermal_conductivity", "mutual_diffusion",
            "thermal_diffusion",
        ):  # fmt: skip
            if (value := getattr(self, name)) is not None:
                found[name] = value, getattr(self.enskog, name, math.nan)
        return found


def coefficients_of(records: list[Record]) -> Coefficients:
    """Return the coefficients of one point from the records of its replicas."""
    point = Point(records)
    first = point.first
    eta = float(records[0]["task"]["scene"]["packing_fraction"])
    d, n = point.dimension, point.n
    diffusion, by_velocity = {}, {}
    for k, count in enumerate(first["counts"]):
        if count:
            diffusion[k], by_velocity[k] = point.self_diffusion(k)
    by_virial, by_rate, both = point.compressibility_factors()
    enskog, infinite = None, UNKNOWN
    viscosity = point.shear_viscosity()
    if first["simple"]:
        z = float(theory.best(d)(eta)) if d in theory.FREEZING else both.mean
        enskog = theory.enskog(
            z, eta, d, diameter=first["diameters"][0], mass=first["masses"][0], kT=point.kT
        )
        if d == 3 and math.isfinite(viscosity.mean):
            infinite = infinite_diffusion(diffusion[0], viscosity, point)
    conductivity, bulk = point.thermal_conductivity(), point.bulk_viscosity()
    mutual, thermal = point.mutual_diffusion(), point.thermal_diffusion()
    every: dict[str, list[Coefficient | None]] = {
        "self-diffusion": [*diffusion.values()],
        "shear viscosity": [viscosity],
        "bulk viscosity": [bulk],
        "thermal conductivity": [conductivity],
        "mutual diffusion": [mutual],
        "thermal diffusion": [thermal],
    }
    remarks = [PLANE] if d == 2 else []
    remarks += [
        f"{name} had not settled: blocks are too short for the rule, or the fluid is slow"
        for name, found in every.items()
        if d > 2 and not all(c.settled for c in found if c is not None)
    ]
    collisions = sum(block["collisions"] for block in point.blocks)
    duration = sum(block["duration"] for block in point.blocks)
    return Coefficients(
        packing_fraction=eta,
        n=n,
        dimension=d,
        replicas=len(records),
        blocks=len(point.blocks),
        edge=max(first["box"]),
        mean_free_time=0.5 * n * duration / collisions,
        Z=both,
        by_virial=by_virial,
        by_rate=by_rate,
        self_diffusion=diffusion,
        self_diffusion_by_velocity=by_velocity,
        self_diffusion_infinite=infinite,
        shear_viscosity=viscosity,
        bulk_viscosity=bulk,
        thermal_conductivity=conductivity,
        mutual_diffusion=mutual,
        thermal_diffusion=thermal,
        enskog=enskog,
        at_rest={k: point.at_rest(k) for k in diffusion},
        remarks=tuple(remarks),
    )


def infinite_diffusion(diffusion: Estimate, viscosity: Estimate, point: Point, species: int = 0) -> Estimate:
    """Return self-diffusion of infinitely many spheres from that of N: ``M / (M - m) D_N`` plus the shift.

    The momentum of all, of mass M, is zero; :func:`carom.theory.diffusion_shift` is of order ``N^(-1/3)``.
    """
    alone, shift = diffusion.scaled(point.at_rest(species)), 0.0
    for _ in range(20):  # fixed point: the shift depends on the result, and is a tenth of it
        shift = theory.diffusion_shift(
            point.n,
            point.n / point.volume,
            viscosity.mean,
            self_diffusion=alone.mean + shift,
            mass=point.mean_mass,
            kT=point.kT,
        )
    error = math.hypot(alone.error, shift * viscosity.relative_error)
    return Estimate(alone.mean + shift, error, alone.n_eff, alone.tau, alone.blocks)
