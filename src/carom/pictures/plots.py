"""Pictures: the convergence of the pressure, g(r), snapshots, packings. Each function returns a Figure.

A picture that is saved has the suffix of its format (png, pdf, svg); FileError if it cannot be written. No
function uses pyplot's global state. Plotting therefore needs no display, and does not change other figures of
a notebook.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import theory
from carom.drawing.particles import (
    BOND,
    BORDER,
    EDGE,
    PALE_EDGE,
    PALE_FACE,
    SIZE,
    SOLID,
    THIN,
    box_and_axes,
    circles,
    draw_obstacles,
    snapshot,
    with_copies,
)  # fmt: skip
from carom.drawing.render import Camera, edges_of
from carom.drawing.shapes import shapes_of
from carom.errors import InputError
from carom.figures.palette import INK, PALE, WARM
from carom.figures.style import TITLE, saved, sheet, state
from carom.observables.rdf import PartialRDFResult
from carom.scene.conversion import to_frame
from carom.scene.fields import standing
from carom.texts import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from carom.observables.packing import PackingNetwork
    from carom.observables.pressure import PressureResult
    from carom.observables.rdf import RDFResult
    from carom.observables.statistics import Estimate
    from carom.scene.scene import Scene

__all__ = [
    "compression", "gaps", "packing", "partial_rdf", "picture", "pressure", "rdf", "snapshot",
]  # fmt: skip


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
    return estimate._picture(path, equations=equations)


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
    return distribution._picture(path, contact_value=contact_value)


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
    return PartialRDFResult(distributions).plot(path)


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
        f"{state(network.frame.n, dimension, network.packing_fraction)}\n{network.counted}, "
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


def draw_network(axes: Axes, network: PackingNetwork) -> None:
    """2D: a packing, its backbone's contacts as bonds, its rattlers dotted."""
    frame = network.frame
    centers, owners, copies = with_copies(frame)
    radii, solid = 0.5 * frame.diameters[owners], network.backbone[owners]
    for here, face, edge in ((copies, "none", PALE_EDGE), (~copies, PALE_FACE, EDGE)):
        circles(axes, centers[here & solid], radii[here & solid], face, edge)
        circles(axes, centers[here & ~solid], radii[here & ~solid], "none", edge, linestyle=":")
    _bonds(axes, network, np.eye(2))
    box_and_axes(axes, frame.box, float(frame.diameters.max()), frame.periodic)


def draw_network_in_space(axes: Axes, network: PackingNetwork) -> None:
    """3D, in parallel projection: bonds of a packing's backbone, rattlers as dotted circles, obstacles."""
    from matplotlib.collections import LineCollection, PolyCollection

    frame = network.frame
    plane = Camera.on(frame, SIZE).axes[:2].T
    center = 0.5 * np.asarray(frame.box)
    shapes = shapes_of(network.obstacles, np.asarray(frame.box), frame.periodic)
    circles(axes, (shapes.spheres[:, :3] - center) @ plane, shapes.spheres[:, 3], SOLID, BORDER, alpha=0.6)
    axes.add_collection(PolyCollection((shapes.triangles - center) @ plane, facecolor=SOLID, alpha=0.3))
    lines = np.concatenate([[ends for ends, _ in edges_of(frame)], shapes.segments])
    axes.add_collection(LineCollection((lines - center) @ plane, color=BORDER, linewidth=0.9))
    _bonds(axes, network, plane, center)
    loose = network.rattlers
    flat = (frame.positions[loose] - center) @ plane
    circles(axes, flat, 0.5 * frame.diameters[loose], "none", EDGE, linestyle=":")
    axes.set_aspect("equal")
    axes.set_axis_off()


def _bonds(axes: Axes, network: PackingNetwork, plane: np.ndarray, center: np.ndarray | float = 0.0) -> None:
    """Draw the bonds of the backbone, from both ends, as they may cross the border."""
    from matplotlib.collections import LineCollection

    frame, held = network.frame, network.held
    starts, steps = network.bonds[held], network.vectors[held]
    first = (frame.positions[starts[:, 0]] - center) @ plane
    pairs = starts[:, 1] < frame.n
    second = (frame.positions[starts[pairs, 1]] - center) @ plane
    lines = [np.stack([first, first + steps @ plane], axis=1)]
    lines.append(np.stack([second, second - steps[pairs] @ plane], axis=1))
    # Thinner than a tenth of a disk, of which there is room for so many in the figure.
    many = 2.0 + float(np.ptp(frame.positions @ plane, axis=0).max()) / float(frame.diameters.min())
    figure: Any = axes.get_figure(root=True)
    width = min(0.9, THIN * 72.0 * float(min(figure.get_size_inches())) / many)
    axes.add_collection(LineCollection(list(np.concatenate(lines)), color=BOND, linewidth=width, zorder=3))
