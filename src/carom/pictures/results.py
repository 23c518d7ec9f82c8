"""The picture of each result, which its method ``plot`` draws."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import InputError
from carom.pictures import plots
from carom.pictures.palette import GRAY, INK, PALE, SERIES, WARM
from carom.pictures.paper import TITLE, TOP, lay_out, saved, shade, sheet
from carom.texts import axis_name, label as label_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from carom.observables import (
        BondOrderResult,
        CrystallinityResult,
        DensityProfileResult,
        Distribution,
        DynamicsResult,
        EnergyResult,
        FreeFlightsResult,
        PressureProfileResult,
        PressureTensorResult,
        ShearModuliResult,
        StructureFactorResult,
        VolumeResult,
        WallPressureResult,
    )
    from carom.observables.statistics import Estimate


def draw(result: Any, path: str | os.PathLike[str] | None = None) -> Figure:
    """Return the picture of a ``result``, and save it if a ``path`` is given."""
    name = type(result).__name__
    if name in _WHOLE:
        return _WHOLE[name](result, path=path)
    if name not in _PICTURES:
        raise InputError(f"There is no picture of a {name}; to_dataframe() gives a table.")
    figure, axes = sheet(7.0, 4.2)
    _PICTURES[name](axes, result)
    axes.set_title(label_of(result._rows()[0]), fontsize=TITLE, y=TOP)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best", fontsize=8.5, framealpha=0.92, edgecolor="none")
    lay_out(figure, axes)
    return saved(figure, path)


def _curve(
    axes: Axes, x: np.ndarray, values: np.ndarray, errors: np.ndarray, label: str = "", color: str = INK
) -> None:
    """Draw a curve with its band of one standard error."""
    known = np.where(np.isfinite(errors), errors, 0.0)
    axes.fill_between(x, values - known, values + known, color=color, alpha=0.25, linewidth=0)
    axes.plot(x, values, color=color, linewidth=1.4, label=label or None)


def _course(axes: Axes, durations: Sequence[float], values: Sequence[float], mean: Estimate) -> None:
    """Draw block values and their running mean."""
    if not values:
        raise InputError("The result holds no block of the run, so there is nothing to draw.")
    steps, heights = np.array(durations), np.array(values)
    time = np.cumsum(steps)
    axes.plot(time - 0.5 * steps, heights, ".", color=PALE, markersize=4, label="blocks")
    text = mean.value_text.replace("+-", "±")
    axes.plot(
        time, np.cumsum(steps * heights) / time, color=INK, linewidth=1.6, label=f"running mean, {text}"
    )
    axes.set_xlabel("time t")


def _energy(axes: Axes, result: EnergyResult) -> None:
    _course(axes, result.block_durations, result.block_values, result.U)
    axes.set_ylabel("potential energy U of a particle")


def _wall_pressure(axes: Axes, result: WallPressureResult) -> None:
    _course(axes, result.block_durations, result.block_values, result.pressure)
    axes.set_ylabel("pressure P")


def _volume(axes: Axes, result: VolumeResult) -> None:
    _course(axes, result.block_durations, result.block_values, result.volume)
    axes.set_ylabel("volume V")


def _shear_moduli(axes: Axes, result: ShearModuliResult) -> None:
    parts = (result.storage, result.loss)
    for k, each in enumerate(parts):
        error = each.error if np.isfinite(each.error) else 0.0
        axes.errorbar([k], [each.mean], [error], fmt="o", color=SERIES[k], capsize=3)
    axes.axhline(0.0, color=GRAY, linestyle=":", linewidth=0.8)
    axes.set_xticks(range(len(parts)), ["storage $G'$", "loss $G''$"])
    axes.set(xlabel=f"frequency {result.frequency:.4g}, strain {result.strain:.4g}", ylabel="shear modulus")


def _pressure_tensor(axes: Axes, result: PressureTensorResult) -> None:
    pairs = result._pairs()
    for k, (a, b) in enumerate(pairs):
        axes.errorbar(
            [k],
            [result.tensor[a, b]],
            [result.error[a, b]],
            fmt="o",
            color=INK if a == b else WARM,
            capsize=3,
        )
    axes.axhline(result.pressure.mean, color=GRAY, linestyle="--", linewidth=0.9)
    axes.axhline(0.0, color=GRAY, linestyle=":", linewidth=0.8)
    axes.set_xticks(range(len(pairs)), [axis_name(a) + axis_name(b) for a, b in pairs])
    axes.set(xlabel="axes a, b", ylabel="pressure tensor $P_{ab}$")


def _pressure_profile(axes: Axes, result: PressureProfileResult) -> None:
    across = [a for a in range(result.dimension) if a != result.axis]
    for k, a in enumerate((result.axis, *across)):
        label, color = f"$P_{{{2 * axis_name(a)}}}$", shade(k)
        _curve(axes, result.middle, result.tensor[:, a, a], result.error[:, a, a], label, color)
    axes.set(xlabel=axis_name(result.axis), ylabel="pressure tensor $P_{aa}$")


def _structure_factor(axes: Axes, result: StructureFactorResult) -> None:
    axes.axhline(1.0, color=GRAY, linewidth=0.8, linestyle=":")
    errors = np.where(np.isfinite(result.error), result.error, 0.0)
    axes.errorbar(result.k, result.S, errors, fmt=".-", color=INK, linewidth=0.9, markersize=4)
    axes.set_xlim(left=0.0)
    axes.set(xlabel="wave number k", ylabel="structure factor S(k)")


def _dynamics(axes: Axes, result: DynamicsResult) -> None:
    _curve(axes, result.times, result.mean_square, result.mean_square_error, "measured")
    axes.set_xscale("log")
    if (result.mean_square > 0.0).all():
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        # At first all fly freely.
        flights = result.dimension * result.velocity_square.mean * result.times**2
        axes.plot(
            result.times,
            flights,
            "--",
            color=WARM,
            linewidth=1.1,
            label="free flight, ⟨v²⟩ t²",
        )
        if np.isfinite(result.fit_first):
            fitted = np.linspace(result.fit_first, result.fit_last)
            line = 2 * result.dimension * result.diffusion.mean * fitted + result.fit_offset
            text = result.diffusion.value_text.replace("+-", "±")
            axes.plot(fitted, line, color=WARM, linewidth=2.4, label=f"2dDt + c, D = {text}")
        axes.set_ylim(low, high)
    axes.set(xlabel="time t", ylabel="mean square displacement")


def _bond_order(axes: Axes, result: BondOrderResult) -> None:
    seen = np.isfinite(result.correlation)
    if not seen.any():
        raise InputError("The correlation of orders was not measured; give BondOrder(rmax=...).")
    _curve(axes, result.middle[seen], result.correlation[seen], result.correlation_error[seen])
    axes.axhline(0.0, color=GRAY, linewidth=0.8, linestyle=":")
    axes.set(xlabel="distance r", ylabel="correlation of local orders")


def _density_profile(axes: Axes, result: DensityProfileResult) -> None:
    axes.stairs(result.density, result.edges, color=INK, linewidth=1.2)
    errors = np.where(np.isfinite(result.error), result.error, 0.0)
    axes.errorbar(result.middle, result.density, errors, fmt="none", color=INK, linewidth=0.9)
    axes.set_ylim(bottom=0.0)
    axes.set(xlabel=axis_name(result.axis), ylabel="number density")


def _crystallinity(axes: Axes, result: CrystallinityResult) -> None:
    axes.plot(result.times, result.solid, ".-", color=PALE, markersize=4, linewidth=0.9, label="solid-like")
    axes.plot(
        result.times, result.largest_cluster, ".-", color=INK, markersize=4, linewidth=1.2,
        label="largest cluster",
    )  # fmt: skip
    axes.set_ylim(bottom=0.0)
    axes.set(xlabel="time t", ylabel="particles")


def _distribution(axes: Axes, result: Distribution) -> None:
    _curve(axes, result.middle, result.density, result.error)
    axes.axvline(result.mean.mean, color=GRAY, linestyle="--", linewidth=0.9)
    axes.set(xlabel=f"value, mean {result.mean.value_text.replace('+-', '±')}", ylabel="probability density")


def _free_flights(axes: Axes, result: FreeFlightsResult) -> None:
    for k, each in enumerate(result.free_time):
        label = f"species {k}" if len(result.free_time) > 1 else ""
        seen = each.density > 0.0
        color = shade(k)
        _curve(axes, each.middle[seen], each.density[seen], each.error[seen], label, color)
        # What the density were if a collision did not know when the last one was.
        rate = float(result.collision_rate[k])
        law = rate * np.exp(-rate * each.middle[seen])
        name = "" if k else "without memory"
        axes.plot(each.middle[seen], law, "--", color=color, linewidth=1.0, label=name or None)
    axes.set_yscale("log")
    axes.set(xlabel="free time", ylabel="probability density")


_WHOLE: dict[str, Callable[..., Figure]] = {
    "PartialRDFResult": plots.partial_rdf,
    "PressureResult": plots.pressure,
    "RDFResult": plots.rdf,
}
_PICTURES: dict[str, Any] = {
    "BondOrderResult": _bond_order,
    "CrystallinityResult": _crystallinity,
    "DensityProfileResult": _density_profile,
    "Distribution": _distribution,
    "DynamicsResult": _dynamics,
    "EnergyResult": _energy,
    "FreeFlightsResult": _free_flights,
    "PressureProfileResult": _pressure_profile,
    "PressureTensorResult": _pressure_tensor,
    "ShearModuliResult": _shear_moduli,
    "StructureFactorResult": _structure_factor,
    "VolumeResult": _volume,
    "WallPressureResult": _wall_pressure,
}
