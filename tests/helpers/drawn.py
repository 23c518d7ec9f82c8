"""What a picture holds: the data of its artists, and whether they lie within its axes."""

import dataclasses

import numpy as np
from matplotlib.collections import Collection, LineCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D

MOST_EMPTY = 0.2
"""Part of an axis that the data of its curves fill at least."""

HIDDEN = 0.1
"""Part of the points of axes that a legend may lie over: of a cloud of blocks, not of a curve."""


def points_of(axes):
    """Yield every artist of the axes that is drawn at places of data, and these places (m, 2)."""
    for line in axes.get_lines():
        if line.get_transform() == axes.transData and len(line.get_xdata()) > 0:
            yield line, np.column_stack([np.asarray(each, float) for each in line.get_data()])
    for collection in axes.collections:
        paths = collection.get_paths() if collection.get_transform() == axes.transData else []
        places = [path.vertices for path in paths if len(path.vertices)]
        if isinstance(collection, Collection) and collection.get_offset_transform() == axes.transData:
            places.append(np.asarray(collection.get_offsets(), float))
        if places:
            yield collection, np.concatenate(places)


def outside(figure, but=lambda artist: False):
    """Return the artists of a figure with data outside of their axes, except those that may be there."""
    found = []
    for axes in figure.axes:
        for inset in (axes, *axes.child_axes):
            limits = np.array([sorted(inset.get_xlim()), sorted(inset.get_ylim())])
            room = 1e-9 * np.ptp(limits, axis=1)
            for artist, places in points_of(inset):
                places = places[np.isfinite(places).all(axis=1)]
                inside = (places >= limits[:, 0] - room) & (places <= limits[:, 1] + room)
                if not but(artist) and not inside.all():
                    found.append((artist, places[~inside.all(axis=1)]))
    return found


def segments(figure):
    """Return the ends of all lines of the collections of a figure, (m, 2, 2)."""
    collections = [c for axes in figure.axes for c in axes.collections if isinstance(c, LineCollection)]
    return [np.array(each) for c in collections for each in c.get_segments()]


def bars(axes):
    """Return the middle of every error bar of the axes and of every point of a band, and half its length."""
    ends = [
        segment[:, 1]
        for container in axes.containers
        for collection in container.lines[2]
        for segment in collection.get_segments()
    ]
    for band in axes.collections:
        if isinstance(band, PolyCollection):
            x, y = np.concatenate([path.vertices for path in band.get_paths()]).T
            ends += [y[x == each] for each in np.unique(x)]
    return [(0.5 * (min(each) + max(each)), 0.5 * (max(each) - min(each))) for each in ends]


def told(found):
    """Return the numbers of a result that have a standard error of their own, and the error, (m, 2).

    ``name_error`` is that of ``name``, and ``error`` that of all other arrays of its shape.
    """
    if isinstance(found, list | tuple) and not hasattr(found, "_fields"):
        return np.concatenate([np.zeros((0, 2)), *map(told, found)])
    if not dataclasses.is_dataclass(found) and not hasattr(found, "_fields"):
        return np.zeros((0, 2))
    names = getattr(found, "_fields", None) or [each.name for each in dataclasses.fields(found)]
    values = {name: getattr(found, name) for name in names}
    pairs = [told(list(values.values()))]
    for name, error in values.items():
        own = [name.removesuffix("_error")] if name.endswith("_error") else []
        if name == "error":
            alike = [one for one in values if np.shape(values[one]) == np.shape(error)]
            own = ["mean"] if "mean" in alike else alike
        for one in own:
            pairs.append(np.column_stack([np.ravel(values[one]), np.ravel(error)]).astype(float))
    return np.concatenate(pairs)


def strange_bars(axes, found, scale=1.0):
    """Return how many bars the axes have, and those that are of no number of a result and its error.

    What is drawn is a number of the result over ``scale``.
    """
    pairs = told(found) / scale
    pairs[~np.isfinite(pairs[:, 1]), 1] = 0.0
    drawn = [each for one in (axes, *axes.child_axes) for each in bars(one)]
    strange = []
    for middle, half in drawn:
        near = 8.0 * np.finfo(float).eps * (abs(middle) + half)  # its ends are rounded, and their sum
        if not (np.abs(pairs - [middle, half]) <= near).all(axis=1).any():
            strange.append((middle, half))
    return len(drawn), strange


def wrong_with(figure, colors):
    """Return what a reader would miss in a figure, in words.

    That are colors that are none of the palette, a legend over data, words outside of the canvas, and an axis
    that errors have set, so that the data fill little of it.
    """
    figure.draw_without_rendering()
    renderer, found = figure.canvas.get_renderer(), []
    for axes in figure.axes:
        for inset in (axes, *axes.child_axes):
            for line in inset.get_lines():
                marked = line.get_linestyle() == "None"  # then the color of the line is not seen
                color = to_hex(line.get_markeredgecolor() if marked else line.get_color())
                if len(line.get_xdata()) and color not in colors:
                    found.append(f"color {color} of {line.get_label()}")
            limits = np.array([sorted(inset.get_xlim()), sorted(inset.get_ylim())])
            curves = [(artist, p) for artist, p in points_of(inset) if isinstance(artist, Line2D)]
            places = [p for line, p in curves if len(p) > 2 or line.get_marker() != "None"]
            places = np.concatenate(places or [np.zeros((0, 2))])
            places = places[np.isfinite(places).all(axis=1)]
            seen = places[((places >= limits[:, 0]) & (places <= limits[:, 1])).all(axis=1)]
            if len(seen) and np.ptp(seen[:, 1]) > 0.0 and inset.get_yscale() == "linear":
                base = 0.0 if limits[1, 0] == 0.0 else seen[:, 1].min()  # an axis may begin at zero
                part = (seen[:, 1].max() - base) / np.ptp(limits[1])
                if part < MOST_EMPTY:
                    found.append(f"data fill {part:.2f} of the axis of {inset.get_ylabel()}")
            if (legend := inset.get_legend()) is not None:
                box = legend.get_window_extent(renderer)
                marks = inset.transData.transform(seen) if len(seen) else []
                under = sum(box.contains(*mark) for mark in marks)
                if under > HIDDEN * len(marks):
                    found.append(f"{under} points under a legend")
        for part in (axes.xaxis, axes.yaxis, axes.title, axes.get_legend()):
            hidden = part is None or not axes.axison or (part is axes.title and not part.get_text())
            box = None if hidden else part.get_tightbbox(renderer)
            if box is not None and box.width and not _within(box, figure.bbox):
                found.append(f"{part} outside of the canvas")
    return found


def _within(box, canvas):
    """Tell whether a box lies on the canvas, up to half a pixel."""
    low, high = box.min - canvas.min + 0.5, canvas.max - box.max + 0.5
    return (low >= 0.0).all() and (high >= 0.0).all()
