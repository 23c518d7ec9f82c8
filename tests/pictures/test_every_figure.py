"""Every kind of figure: one palette, words on the canvas, legends beside the data, axes that the data set."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.drawn import wrong_with
from helpers.frames import frame_of
from helpers.plain import uncompiled
from matplotlib.colors import to_hex

import carom
from carom.figures import palette, style
from carom.figures.caps import COLORS
from carom.figures.palette import FACES
from carom.observables import Crystallinity
from carom.observables.rdf import RDF, PartialRDF
from carom.pictures import plots
from carom.results import KINDS, Result
from carom.studies.eos import pictures as eos
from carom.studies.trade.picture import picture as of_methods

PALETTE = {
    *map(
        to_hex,
        (
            *palette.SERIES,
            *(color for color, _ in palette.THEORIES),
            palette.PALE,
            palette.GRAY,
            palette.WARM,
        ),
    ),
    *map(to_hex, (*FACES, *COLORS, "white")),
}


DRAWN = {
    name
    for name, kind in KINDS.items()
    if kind.__module__.startswith("carom.observables.")
    and getattr(kind, "_draw_into", Result._draw_into) != Result._draw_into
} - {"OneNumber"}
"""Results that draw themselves."""


def studies():
    """Yield the figures of studies, by name."""
    small = {"replicas": 1, "equilibration": 5, "executor": "serial"}
    study = carom.equation_of_state([0.1, 0.2, 0.3], n=(32, 108), collisions_per_particle=30, **small)
    shear = carom.shear([0.5, 1.0], n=32, packing_fraction=[0.1, 0.2], strains=4, **small)
    transport = carom.transport([0.1, 0.2], n=32, collisions_per_particle=60, **small)
    rows = [
        dataclasses.replace(row, order=0.3 + k / 20, order_error=0.02, susceptibility=1.0 + k)
        for k, row in enumerate(study.table)
    ]
    yield "equation of state", study.plot()
    yield "order", eos.order(SimpleNamespace(table=rows))
    yield "sizes", eos.sizes(study)
    yield "shear", shear.plot()
    yield "transport", transport.plot()
    methods = [("event-driven", "float64", 2e6, 1e-16, 1e-3), ("naive", "50 digits", 450.0, 0.0, 1e-2)]
    methods += [("time-driven", f"step {step}", 3e7 * step, step, step) for step in (0.1, 0.01, 0.001)]
    yield (
        "trade",
        of_methods(
            [
                SimpleNamespace(
                    algorithm=kind,
                    method=name,
                    collisions_per_second=rate,
                    error_1=error,
                    z_bias=bias,
                    z_error=bias / 3,
                )
                for kind, name, rate, error, bias in methods
            ],
            [
                SimpleNamespace(n=n, relative_error_1s=1e-3, finite_size_bias=1.0 / n)
                for n in (100, 1000, 10_000)
            ],
        ),
    )
    yield "spherical code", carom.spherical_code(6).plot()


def results():
    """Yield the figures of results, by name."""
    kinds = [carom.Species("large", fraction=0.5), carom.Species("small", fraction=0.5, diameter=0.6)]
    with uncompiled():
        sim = carom.Simulation(carom.Scene.crystal(32, 0.3), seed=1)
        slit = carom.Simulation(carom.Scene.random(30, 0.2, 2, walls="y", seed=1), seed=1)
        mixture = carom.Simulation(carom.Scene.random(40, 0.2, species=kinds, seed=1), seed=1)
        found = [
            *sim.measure(
                carom.Pressure(), carom.PressureTensor(), carom.RDF(),
                carom.StructureFactor(), carom.Dynamics(), carom.BondOrder(6, reach=1.5, rmax=1.6),
                carom.FreeFlights(), Crystallinity(), time=3.0, blocks=16,
            ),
            *slit.measure(
                carom.WallPressure("y_low"), carom.PressureProfile(axis=1, bins=8),
                carom.DensityProfile(axis=1, bins=16), time=10.0, blocks=16,
            ),
            PartialRDF(mixture.scene).over(mixture.sample(every=0.3, count=10)),
        ]  # fmt: skip
        points = [
            dataclasses.replace(frame, diameters=np.zeros(frame.n))
            for frame in sim.sample(every=0.1, count=10)
        ]
    flights = next(each for each in found if type(each).__name__ == "FreeFlightsResult")
    found.append(flights.normal_speed[0, 0])
    # The energy of hard spheres has no blocks; its picture is that of the pressure on a wall.
    assert {type(each).__name__ for each in found} == DRAWN - {
        "EnergyResult",
        "VolumeResult",
        "ShearModuliResult",
    }
    for each in found:
        yield type(each).__name__, each.plot()
    yield "points", plots.rdf(RDF().over(points))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::carom.errors.CaromWarning")  # of runs so short
@pytest.mark.parametrize("figures", [studies, results])
def test_a_figure_has_the_palette_and_shows_its_data(figures):
    wrong = {name: said for name, figure in figures() if (said := wrong_with(figure, PALETTE))}
    assert wrong == {}


def test_theories_differ_in_color_and_in_line():
    colors, lines = zip(*palette.THEORIES, strict=True)
    assert len({*colors}) == len({*lines}) == len(palette.THEORIES)
    assert len({*palette.SERIES}) == len(palette.SERIES)


def test_points_have_no_packing_fraction_and_no_errors_of_empty_bins_in_their_picture():
    rng = np.random.default_rng(1)
    frames = [frame_of(8.0 * rng.random((30, 3)), (8.0,) * 3, 0.0) for _ in range(3)]
    found = RDF(bins=100).over(frames)
    wide = dataclasses.replace(found, error=np.where(found.g > 0.0, found.error, 30.0))
    axes = plots.rdf(wide).axes[0]
    assert axes.get_ylim()[1] < 2.5 * wide.g.max()
    assert "η" not in axes.get_title()


def test_a_figure_that_errors_have_set_is_found():
    figure, axes = style.sheet(5.0, 3.6)
    axes.errorbar([1.0, 2.0, 3.0], [1.0, 1.1, 1.2], [0.1, 0.1, 30.0], color="C3", label="x")
    axes.text(0.5, 0.5, "off", transform=axes.transAxes)
    axes.set_title("long " * 60)
    said = wrong_with(figure, PALETTE)
    assert any("fill" in each for each in said)
    assert any("color #d62728" in each for each in said)
    assert any("canvas" in each for each in said)
