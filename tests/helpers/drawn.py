"""What a picture holds: the data of its artists, and whether they lie within its axes."""

import numpy as np
from matplotlib.collections import Collection, LineCollection


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
