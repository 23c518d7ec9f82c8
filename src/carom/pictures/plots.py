"""Pictures: the convergence of the pressure, g(r), snapshots, packings. Each function returns a Figure.

A picture that is saved has the suffix of its format (png, pdf, svg); FileError if it cannot be written. No
function uses pyplot's global state. Plotting therefore needs no display, and does not change other figures of
a notebook.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import theory
from carom.errors import InputError
from carom.pictures.palette import GRAY, INK, PALE, THEORIES, WARM
from carom.pictures.paper import DPI, PIXELS, TITLE, TOP, lay_out, saved, shade, sheet
from carom.scene.conversion import to_frame
from carom.scene.description import particles
from carom.scene.fields import standing
from carom.texts import counted, label as label_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from carom.frame import Frame
    from carom.models.obstacles import Obstacle
    from carom.observables.packing import PackingNetwork
    from carom.observables.pressure import PressureResult
    from carom.observables.rdf import RDFResult
    from carom.observables.statistics import Estimate
    from carom.scene.scene import Scene

# More blocks than this are drawn as means of groups, so that points do not merge.
_MOST_POINTS = 64


def pressure(
    estimate: PressureResult,
    *,
    equations: Mapping[str, theory.Equation | float] | None = None,
    path: str | os.PathLike[str] | None = None,
) -> Figure:
    """Convergence of Z: block values, the running mean with its error band, and theory.

    Parameters
    ----------
    estimate : PressureResult
        The measured pressure.
    equations : mapping of str to callable or float, optional
        Equations of state of the fluid to draw, by label; each is shifted to the finite n of the run. A
        number is Z by theory, drawn as it is. By default the usual equation and the best one known for the
        dimension, for equal elastic spheres below freezing; otherwise none.
    path : path, optional
        Where to save the picture.

    Raises
    ------
    InputError
        If the estimate has no blocks.

    Notes
    -----
    The band is the final error times sqrt(total time / time so far): that of a stationary run of that length.
    """
    if not estimate.block_values:
        raise InputError("The estimate holds no block of the run, so there is nothing to draw.")
    figure, axes = sheet(7.0, 4.2)
    durations = np.array(estimate.block_durations)
    values = np.array(estimate.block_values)
    time = np.cumsum(durations)
    running = np.cumsum(durations * values) / time
    z = estimate.Z
    group = math.ceil(values.size / _MOST_POINTS)
    means, middles = _grouped(values, durations, group)
    label = "blocks" if group == 1 else f"means of {group} blocks"
    axes.plot(middles, means, ".", color=PALE, markersize=4, zorder=1, label=label)
    if math.isfinite(z.error):
        band = z.error * np.sqrt(time[-1] / time)
        axes.fill_between(time, running - band, running + band, color=INK, alpha=0.18, linewidth=0, zorder=2)
    axes.plot(time, running, color=INK, linewidth=1.6, zorder=4, label=f"running mean, Z = {_text(z)}")
    eta = estimate.packing_fraction
    if equations is None:
        stable = theory.is_stable_fluid(estimate.dimension, eta)
        fluid = estimate.simple and estimate.steady and stable
        equations = theory.equations(estimate.dimension) if fluid else {}
    shown = [z.mean]
    law = theory.crystal_finite_size_shift if estimate.solid else theory.finite_size_shift
    looks = THEORIES * len(equations)
    for (name, equation), (color, style) in zip(equations.items(), looks, strict=False):
        value = equation(eta) + law(eta, estimate.n, equation) if callable(equation) else equation
        shown.append(value)
        axes.axhline(
            value,
            color=color,
            linestyle=style,
            linewidth=1.3,
            zorder=5,
            label=f"{label_of(name)}, {value:.4f}",
        )
    axes.set_xlim(0.0, time[-1])
    _frame_values(axes, shown, means)
    axes.set(xlabel="time t", ylabel="compressibility factor Z")
    axes.set_title(_state(estimate.n, estimate.dimension, eta), fontsize=TITLE, y=TOP)
    axes.legend(loc="best", fontsize=8.5, framealpha=0.92, edgecolor="none")
    lay_out(figure, axes)
    return saved(figure, path)


def rdf(
    distribution: RDFResult,
    *,
    contact_value: Estimate | None = None,
    path: str | os.PathLike[str] | None = None,
) -> Figure:
    """g(r), with the region near contact enlarged, and the extrapolation to contact.

    Parameters
    ----------
    distribution : RDFResult
        The measured g(r).
    contact_value : Estimate, optional
        The contact value that the pressure implies, to compare with the extrapolated one.
    path : path, optional
        Where to save the picture.
    """
    figure, axes = sheet(7.0, 4.2)
    unit = distribution.diameter or 1.0
    r, g, error = distribution.r / unit, distribution.g, distribution.error
    edges = distribution.edges / unit
    axes.axhline(1.0, color=GRAY, linewidth=0.8, linestyle=":", zorder=1)
    axes.fill_between(r, g - error, g + error, color=INK, alpha=0.25, linewidth=0, zorder=2)
    axes.plot(r, g, color=INK, linewidth=1.4, zorder=3)
    if edges[0] > 0.0:
        # g is zero below contact, and jumps at contact.
        axes.plot([0.0, edges[0], edges[0]], [0.0, 0.0, g[0]], color=INK, linewidth=1.4, zorder=3)
    axes.set_xlim(max(edges[0] - 0.15 * (edges[-1] - edges[0]), 0.0), edges[-1])
    # Of a bin that is all but empty the error says more of the bin than of g.
    reach = np.where(error < g, g + error, g)
    top = 1.12 * float(np.max(reach))
    if distribution.contact_value is not None:
        # The inset lies above the right half, from 0.4 of the height on.
        far = reach[edges[1:] > 0.5 * sum(axes.get_xlim())]
        top = max(top, float(np.max(far)) / 0.38)
    axes.set_ylim(0.0, top)
    axes.set_xlabel("distance r/σ" if distribution.diameter else "distance r")
    axes.set_ylabel("radial distribution function g(r)")
    state = _state(distribution.n, distribution.dimension, distribution.packing_fraction)
    axes.set_title(f"{state}, {counted(distribution.frames, 'frame')}", fontsize=TITLE, y=TOP)
    if distribution.contact_value is not None:
        _contact_inset(axes, distribution, contact_value)
    lay_out(figure, axes)
    return saved(figure, path)


def partial_rdf(
    distributions: Mapping[str, RDFResult], *, path: str | os.PathLike[str] | None = None
) -> Figure:
    """g(r) of every pair of species of a mixture, each from its contact on.

    Parameters
    ----------
    distributions : mapping of str to RDFResult
        By the names of the two species, as :class:`carom.observables.rdf.PartialRDF` measures them.
    path : path, optional
        Where to save the picture.

    Raises
    ------
    InputError
        If there is no distribution.
    """
    if not distributions:
        raise InputError("There is no g(r), so there is nothing to draw.")
    figure, axes = sheet(7.0, 4.2)
    unit = max(found.diameter for found in distributions.values())
    axes.axhline(1.0, color=GRAY, linewidth=0.8, linestyle=":", zorder=1)
    for k, (name, found) in enumerate(distributions.items()):
        r, g = found.r / unit, found.g
        color = shade(k)
        axes.fill_between(r, g - found.error, g + found.error, color=color, alpha=0.25, linewidth=0, zorder=2)
        # g is zero below contact, and jumps at contact.
        contact = found.edges[0] / unit
        axes.plot(
            [contact, contact, *r],
            [0.0, g[0], *g],
            color=color,
            linewidth=1.3,
            label=label_of(name),
            zorder=3,
        )
    axes.set_ylim(bottom=0.0)
    axes.set(xlabel="distance r/σₘₐₓ", ylabel="partial distribution function gᵢⱼ(r)")
    some = next(iter(distributions.values()))
    axes.set_title(
        f"{_state(some.n, some.dimension, some.packing_fraction)}, {counted(some.frames, 'frame')}",
        fontsize=TITLE,
    )
    axes.legend(fontsize=8.5, framealpha=0.92, edgecolor="none")
    lay_out(figure, axes)
    return saved(figure, path)


def picture(scene: Scene, path: str | os.PathLike[str] | None = None) -> Figure:
    """Draw the particles of a scene: :func:`snapshot` of it, with its walls and obstacles.

    Parameters
    ----------
    scene : Scene
        What is drawn.
    path : path, optional
        Where to save the picture.
    """
    return snapshot(to_frame(scene), obstacles=standing(scene), path=path)


def snapshot(
    frame: Frame,
    *,
    obstacles: Sequence[Obstacle] = (),
    path: str | os.PathLike[str] | None = None,
) -> Figure:
    """The particles of a frame, to scale, in their box; species in different colors, walls thick.

    Parameters
    ----------
    frame : Frame
        In 1D it is drawn as rods on a line, in 2D as disks, with periodic copies at the border, and in 3D as
        shaded spheres in parallel projection. From 4D on only the first two coordinates are drawn, which the
        title says.
    obstacles : sequence of obstacles, optional
        Obstacles of the scene, drawn in 2D and 3D. Those of your own class need ``outline`` or ``surface``.
    path : path, optional
        Where to save the picture.
    """
    from carom.pictures.drawing import draw_disks, draw_obstacles, draw_projection, draw_rods, draw_spheres

    space = frame.dimension == 3
    figure, axes = sheet(6.0, 1.6 if frame.dimension == 1 else 6.4, PIXELS if space else DPI)
    if space:
        # Without axes there is nothing to lay out, and a layout engine would draw everything twice.
        figure.set_layout_engine("none")
        axes.set_position((0.0, 0.0, 1.0, 0.93))
        draw_spheres(axes, frame, obstacles)
    else:
        {1: draw_rods, 2: draw_disks}.get(frame.dimension, draw_projection)(axes, frame)
    if frame.dimension == 2:
        draw_obstacles(axes, obstacles, frame)
    volume = sum(theory.ball_volume(frame.dimension, float(s)) for s in frame.diameters)
    title = _state(frame.n, frame.dimension, volume / math.prod(frame.box))
    if frame.dimension > 3:
        title += "\nfirst two coordinates"
    axes.set_title(title, fontsize=TITLE, y=TOP)
    return saved(figure, path)


def packing(network: PackingNetwork, *, path: str | os.PathLike[str] | None = None) -> Figure:
    """Network of contacts of a packing: bonds of the backbone, rattlers dotted.

    Parameters
    ----------
    network : PackingNetwork
        Network of a packing in two or three dimensions. In three, the spheres of the backbone are not drawn.
    path : path, optional
        Where to save the picture.

    Raises
    ------
    InputError
        If the packing has another dimension.
    """
    from carom.pictures.drawing import draw_network, draw_network_in_space, draw_obstacles

    dimension = network.frame.dimension
    if dimension not in (2, 3):
        raise InputError(f"A network is drawn in two or three dimensions, found {dimension}.")
    figure, axes = sheet(6.4, 6.8)
    (draw_network if dimension == 2 else draw_network_in_space)(axes, network)
    axes.autoscale_view()
    if dimension == 2:
        draw_obstacles(axes, network.obstacles, network.frame)
    loose = len(network.rattlers)
    axes.set_title(
        f"{_state(network.frame.n, dimension, network.packing_fraction)}\n{network.counted}, "
        f"{counted(loose, 'rattler')}",
        fontsize=TITLE,
    )
    return saved(figure, path)


def gaps(network: PackingNetwork, *, path: str | os.PathLike[str] | None = None) -> Figure:
    """Number of pairs with a gap below h, with the void between contacts and near contacts.

    Parameters
    ----------
    network : PackingNetwork
        Network of a packing.
    path : path, optional
        Where to save the picture.
    """
    figure, axes = sheet(6.4, 4.0)
    # Pairs that overlap by rounding are drawn at the left border.
    positive = network.gaps[network.gaps > 0.0]
    least = float(positive.min()) if positive.size else network.gap
    axes.step(np.maximum(network.gaps, least), np.arange(1, len(network.gaps) + 1), where="post", color=INK)
    low, high = max(network.void[0], least), network.void[1]
    axes.axvspan(low, high, color=PALE, alpha=0.4, linewidth=0, label="void")
    axes.axvline(network.gap, color=WARM, linestyle="--", label=f"chosen gap {network.gap:.1e}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set(xlabel=r"gap $h = r / \sigma_{ij} - 1$", ylabel="pairs with a smaller gap")
    axes.legend(frameon=False, fontsize=8.5)
    return saved(figure, path)


def compression(
    history: np.ndarray,
    jamming_fraction: float,
    dimension: int,
    *,
    path: str | os.PathLike[str] | None = None,
) -> Figure:
    """Reduced pressure against the distance to the jammed density, with the free-volume law.

    Parameters
    ----------
    history : structured array
        Fields ``packing_fraction`` and ``Z``, as in :class:`carom.studies.packings.packing.Packing`.
    jamming_fraction : float
        Packing fraction of the jammed state. If it is NaN, the packing fraction itself is the abscissa.
    dimension : int
        d.
    path : path, optional
        Where to save the picture.
    """
    figure, axes = sheet(7.0, 4.2)
    fraction, pressure = history["packing_fraction"].copy(), history["Z"]
    # The pressure is that of a stretch, so the density is that of its middle.
    fraction[1:] = 0.5 * (fraction[1:] + fraction[:-1])
    if np.isfinite(jamming_fraction):
        left = 1.0 - fraction / jamming_fraction
        # The last differences are rounding, because the jamming density comes from this law.
        shown = left > 64 * np.finfo(float).eps
        axes.plot(left[shown], pressure[shown], ".", color=PALE, markersize=4, label="compression")
        if shown.any():
            # The jamming density is where the law through the last stretch diverges: N_b follows from both.
            leading = float((pressure * left)[shown][-1])
            ends = np.array([left[shown].min(), min(left[shown].max(), 0.1)])
            law = r"$d\,(N_b - 1)\,/\,N\,/\,(1 - \eta/\eta_J)$"
            axes.plot(ends, leading / ends, color=WARM, linewidth=1.1, label=law)
        axes.set_xscale("log")
        axes.invert_xaxis()
        axes.set_xlabel(r"$1 - \eta/\eta_J$")
        axes.set_title(rf"$\eta_J = {jamming_fraction:.6f}$", fontsize=TITLE)
    else:
        axes.plot(fraction, pressure, ".", color=PALE, markersize=4, label="compression")
        axes.set_xlabel(r"packing fraction $\eta$")
    axes.set_yscale("log")
    axes.set_ylabel(r"$Z = PV/NkT$")
    axes.legend(loc="upper left", fontsize=8.5, framealpha=0.92, edgecolor="none")
    return saved(figure, path)


def _state(n: int, dimension: int, packing_fraction: float) -> str:
    """Return number, kind and packing fraction, if they have one, of the particles, for a title."""
    count = f"{n:,}".replace(",", "\u202f") if n >= 10_000 else str(n)
    eta = f", η = {packing_fraction:.4g}" if packing_fraction else ""  # points fill nothing
    return f"{count} {particles(dimension, n)}{eta}"


def _text(estimate: Estimate) -> str:
    """Return an estimate as text for a picture."""
    return estimate.value_text.replace("+-", "±").replace("inf", "∞")


def _grouped(values: np.ndarray, durations: np.ndarray, group: int) -> tuple[np.ndarray, np.ndarray]:
    """Return means of ``group`` blocks each, and the time at the middle of each group."""
    starts = np.arange(0, values.size, group)
    lengths = np.add.reduceat(durations, starts)
    return np.add.reduceat(values * durations, starts) / lengths, np.cumsum(lengths) - 0.5 * lengths


def _frame_values(axes: Axes, shown: list[float], means: np.ndarray) -> None:
    """Set limits that show the convergence: most of the blocks, and every value in ``shown``."""
    low, high = np.quantile(means, [0.02, 0.98])
    low, high = min(low, *shown), max(high, *shown)
    margin = 0.12 * (high - low) or 0.05 * abs(high)
    axes.set_ylim(low - margin, high + margin)


def _contact_inset(axes: Axes, distribution: RDFResult, implied: Estimate | None) -> None:
    """Draw the first quarter of a diameter enlarged, with the contact values at its left border."""
    fitted: Any = distribution.contact_value
    unit = distribution.diameter
    r, near = distribution.r / unit, distribution.r < 1.25 * unit
    if near.sum() < 3:
        return
    inset = axes.inset_axes((0.52, 0.48, 0.46, 0.44))
    inset.errorbar(
        r[near],
        distribution.g[near],
        distribution.error[near],
        fmt=".",
        color=INK,
        markersize=4,
        linewidth=0.8,
    )
    shown = [(fitted, "extrapolated", "D", INK, 3.5)]
    if implied is not None and math.isfinite(implied.mean):
        shown.append((implied, "from the pressure", "o", WARM, 8.0))
    for value, name, marker, color, size in shown:
        error = value.error if math.isfinite(value.error) else 0.0
        inset.errorbar(
            [1.0], [value.mean], [error], fmt=marker, color=color, markersize=size,
            markerfacecolor="none", capsize=2, label=f"{name} {_text(value)}",
        )  # fmt: skip
    inset.set_xlim(0.98, 1.25)
    inset.set_title("contact value g(σ⁺)", fontsize=8.5, y=TOP)
    inset.tick_params(labelsize=7.5)
    inset.legend(fontsize=7.5, frameon=False, loc="best", handletextpad=0.2)
