"""Scenes from a Frame, an ``ase.Atoms`` or a file: ``Scene.from_frame``, ``from_ase`` and ``from_file``."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np

from carom import checks
from carom.errors import InputError, warn
from carom.frame import Frame
from carom.geometry import overlaps
from carom.geometry.contacts import Contacts
from carom.geometry.overlaps import Geometry, geometry_of
from carom.models.contacts.rough import Rough
from carom.models.interactions.hard_cores import HardCores
from carom.models.interactions.pinned import Pinned, mask as pinned_mask
from carom.models.motions.shear import Shear, start_tilt
from carom.models.obstacles import named_walls
from carom.scene import box
from carom.scene.fields import Fields, S
from carom.scene.keywords import refuse_unknown
from carom.scene.species import contact_matrix, labels, per_component

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Unpack

    import ase
    from numpy.typing import ArrayLike

    from carom.models.obstacles.named_walls import Walls
    from carom.scene.keywords import Keywords


def from_frame(
    cls: Callable[..., S],
    frame: Frame,
    **keywords: Unpack[Keywords],
) -> S:
    """Make a scene from a frame, without its images and time; its spins need ``impact=Rough(...)``.

    Parameters
    ----------
    frame : Frame
        Axes of the frame that are not periodic get plain walls, unless ``walls`` is given.
    **keywords
        Keywords of :class:`carom.Scene`, which a frame does not store: ``walls``, ``obstacles``, ``contact``,
        ``pinned``, ``interaction``, ``motion``, ``impact``, ``drive``.

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        As :class:`carom.Scene` does.

    Warns
    -----
    CaromWarning
        If spheres overlap by no more than the rounding of single precision, as in a GSD file. They are then
        moved apart by this small amount.
    """
    refuse_unknown("Scene.from_frame", keywords)
    interaction = keywords.get("interaction")
    arguments = of_frame(frame)
    if frame.positions.size and not getattr(interaction, "penetrable", False):
        sizes = per_component(arguments["diameter"], "diameter", frame.n)
        edges = box.edges(frame.box, frame.dimension, float(sizes.max()), float(sizes.min()))
        sides = named_walls.named(keywords.get("walls", arguments["walls"]), frame.dimension)
        room = geometry_of(edges, sides, keywords.get("obstacles", ()), frame.tilt or 0.0)
        kinds = labels(frame.species, frame.n)
        given = interaction.contact if isinstance(interaction, HardCores) else keywords.get("contact")
        contacts = Contacts(sizes, kinds, contact_matrix(given, kinds, sizes))
        given = interaction.which if isinstance(interaction, Pinned) else keywords.get("pinned")
        arguments["positions"] = parted(arguments["positions"], room, contacts, pinned_mask(given, frame.n))
    if frame.tilt:
        motion = keywords.get("motion")
        if not isinstance(motion, Shear):
            raise InputError(
                f"The frame is of a sheared box, with a tilt of {frame.tilt:g}: give "
                "motion=carom.models.Shear(rate)."
            )
        keywords["motion"] = motion.tilted(frame.tilt)
    if isinstance(keywords.get("impact"), Rough):
        arguments["spins"] = frame.spins
    return cls(**{**arguments, **keywords})


def from_ase(
    cls: Callable[..., S],
    atoms: ase.Atoms,
    *,
    diameter: float | ArrayLike | Mapping[str, float] | None = None,
    walls: Walls = False,
    **keywords: Any,
) -> S:
    """Make a scene from an ``ase.Atoms``: positions, cell, masses, momenta, radii and kinds.

    Parameters
    ----------
    atoms : ase.Atoms
        Atoms in a rectangular cell along the axes. The scene keeps the periodic axes: ``pbc`` "T T F" with
        all z equal gives a scene of disks, d = 2. Different chemical symbols become species with these
        names, and so do the numbers of an array ``kind``, which Carom writes.
    diameter : float, (n,) array_like or mapping, optional
        One diameter for all, one for each sphere, or one for each chemical symbol, such as ``{"Ar": 3.4,
        "Ne": 2.75}``, in the unit of length of ``atoms`` (angstrom in ASE). Omit it if ``atoms`` has an array
        ``radius``.
    walls : str, True, sequence of str, or mapping of str to Wall
        True gives walls, at the faces of the cell, to the axes that are not periodic, but along which
        coordinates differ. By default such axes are refused. They may also be named, as in
        :class:`carom.Scene`.
    **keywords
        The other keywords of :meth:`carom.Scene.from_frame`.

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        If the cell is skew, no axis is periodic, coordinates differ along an axis that is not periodic, the
        diameter is given twice or is missing for a symbol, and as :class:`carom.Scene` does.

    Warns
    -----
    CaromWarning
        If ``atoms`` has no radii and no diameter is given: it is then 1.
    """
    refuse_unknown("Scene.from_ase", keywords, ("diameter",))
    return cls(**of_atoms(atoms, diameter, walls), **keywords)


def from_file(
    cls: Callable[..., S],
    path: str | os.PathLike[str],
    frame: int = -1,
    *,
    diameter: float | Mapping[str, float] | None = None,
    box: Sequence[float] | None = None,
    **keywords: Unpack[Keywords],
) -> S:
    """Make a scene from a frame of a file that :func:`carom.open` reads, also of another program.

    Parameters
    ----------
    path : str or path
        A trajectory, a start such as a LAMMPS data file, or the folder of a run or packing.
    frame : int
        Which frame; the last by default.
    diameter, box : optional
        As for :func:`carom.open`, where the file holds none.
    **keywords
        Those of :meth:`carom.Scene.from_frame`.

    Returns
    -------
    Scene
        Without velocities, if the file holds none: they are then drawn.

    Raises
    ------
    FileError
        If the file cannot be read, or has no such frame.
    InputError
        As :class:`carom.Scene` does.

    Warns
    -----
    CaromWarning
        As :func:`carom.open` and :meth:`carom.Scene.from_frame` do.
    """
    from carom.io.trajectory import open_reader

    with open_reader(path, diameter=diameter, box=box) as frames:
        found = frames.frame(frame)
        drawn = {"velocities": None} if "velocities" in found.lacks else {}
        return from_frame(lambda **words: cls(**{**words, **drawn}), found, **keywords)


def to_frame(scene: Fields) -> Frame:
    """Return the frame of a scene at time 0; missing velocities are zero."""
    velocities = scene.positions * 0.0 if scene.velocities is None else scene.velocities
    return Frame(
        0.0, 0, scene.positions, velocities, scene.box, scene.diameters, scene.masses,
        species=scene.species, species_names=scene.species_names, periodic=scene.periodic, spins=scene.spins,
        tilt=start_tilt(scene.motion, scene.box) if isinstance(scene.motion, Shear) else None,
    )  # fmt: skip


def of_frame(frame: Frame) -> dict[str, Any]:
    """Return the arguments of a scene from a frame, without its images and time."""
    names = {
        "species": frame.species,
        "species_names": frame.species_names if frame.species is not None else (),
    }
    return {
        "positions": frame.positions,
        "box": frame.box,
        "diameter": _each(frame.diameters, "diameters", frame.n),
        "mass": _each(frame.masses, "masses", frame.n),
        "velocities": frame.velocities,
        "walls": named_walls.axes_without(box.periodicity(frame.periodic, frame.dimension)),
        **names,
    }


def of_atoms(atoms: ase.Atoms, diameter: Any, walls: Any) -> dict[str, Any]:
    """Return the arguments of a scene from an ``ase.Atoms``; see :meth:`carom.Scene.from_ase`."""
    if not all(hasattr(atoms, name) for name in ("positions", "cell", "pbc", "arrays", "get_masses")):
        raise InputError(f"atoms must be an ase.Atoms, found {checks.describe(atoms)}.")
    n = len(atoms)
    cell = checks.array(np.asarray(atoms.cell), "cell", "(3, 3)", ndim=2)
    places = checks.array(atoms.positions, "positions", "(n, 3)", ndim=2)
    periodic = np.asarray(atoms.pbc, dtype=bool)
    kept = periodic.copy()
    if n and walls is not False:
        kept |= np.ptp(places, axis=0) > 0
    if not kept.any():
        raise InputError(
            "atoms has no periodic axis (pbc is False everywhere); make one periodic, or give walls=True for "
            "walls at the faces of the cell."
        )
    off_axis = cell - np.diag(np.diag(cell))
    if off_axis[kept].any() or off_axis[:, kept].any():
        raise InputError("cell must have right angles along x, y and z, found a skew or rotated one.")
    for axis in np.nonzero(~kept)[0]:
        if n and np.ptp(places[:, axis]) > 0:
            raise InputError(
                f"Coordinates differ along {'xyz'[axis]}, where pbc is False; make the axis periodic, or all "
                "of its coordinates equal (a scene of fewer dimensions), or give walls=True."
            )
    if "radius" in atoms.arrays:
        if diameter is not None:
            raise InputError("atoms has radii and diameter is given too; leave one of them out.")
        diameter = 2 * _each(atoms.arrays["radius"], "radius", n)
    elif diameter is None:
        diameter = 1.0
        warn(
            "These atoms have no array 'radius'; a diameter of 1 was assumed, in the unit of their positions "
            "(ASE's are angstrom). Give diameter=..., or one for each symbol: "
            f"diameter={{'{atoms.get_chemical_symbols()[0] if n else 'Ar'}': ...}}."
        )
    elif isinstance(diameter, Mapping):
        symbols = atoms.get_chemical_symbols()
        if lacking := set(symbols) - set(diameter):
            raise InputError(f"diameter names no {', '.join(sorted(lacking))}, of which there are atoms.")
        diameter = np.array([diameter[symbol] for symbol in symbols])
    masses = _each(atoms.get_masses(), "masses", n)
    velocities = None
    if "momenta" in atoms.arrays:
        momenta = checks.array(atoms.arrays["momenta"], "momenta", "(n, 3)", ndim=2)
        velocities = momenta[:, kept] / masses[:, None]
    names, species = np.unique(atoms.get_chemical_symbols(), return_inverse=True)
    if "kind" in atoms.arrays:
        species = np.asarray(atoms.arrays["kind"])
        told = str(atoms.info.get("species_names", ""))
        names = np.array(
            [unquote(name) for name in told.split(",")]
            if told
            else [str(k) for k in range(int(species.max()) + 1)]
        )
    return {
        "positions": places[:, kept],
        "box": np.diag(cell)[kept],
        "diameter": diameter,
        "mass": masses,
        "velocities": velocities,
        "walls": _walls_of(walls, periodic[kept]),
        "species": species if len(names) > 1 else None,
        "species_names": tuple(map(str, names)) if len(names) > 1 else (),
    }


def _walls_of(walls: Any, periodic: np.ndarray) -> Any:
    """Return the walls of a scene with these periodic axes."""
    if isinstance(walls, bool):
        return named_walls.axes_without(periodic.tolist())
    found = named_walls.periodic_axes(named_walls.named(walls, len(periodic)), len(periodic))
    if found != tuple(periodic.tolist()):
        without = named_walls.axes_without(periodic.tolist())
        raise InputError(f"pbc of atoms leaves walls={without!r}, found walls={walls!r}.")
    return walls


def parted(positions: Any, room: Geometry, contacts: Contacts, pinned: np.ndarray | None) -> Any:
    """Return positions without overlaps of single precision, with a warning; deeper ones stay as they are."""
    diameters = contacts.diameters
    radii = 0.5 * diameters if pinned is None else np.where(pinned, 0.0, 0.5 * diameters)
    places = room.wrapped(checks.array(positions, "positions", "(n, d)", ndim=2))
    overlap = overlaps.deepest(places, room, contacts, pinned)
    intruder = overlaps.intruder(places, room, radii)
    single = overlaps.rounding(room.box, float(np.finfo(np.float32).eps))
    found = [each for each in (overlap, intruder) if each is not None]
    if not found or max(each.depth for each in found) > single:
        return positions
    from carom.scene import placement

    # The spheres of a fluid separate in a few steps. Otherwise they are jammed, and the overlap is an error.
    clearance = 1 + 2 * single / float(diameters.min())
    moved = placement.separated(places, room, contacts, radii, clearance, 200, pinned)
    if moved is None:
        return positions
    warn(
        f"In positions of single precision {found[0]}; such spheres were moved apart. Start from a float64 "
        "file (h5md, extxyz) to keep every digit."
    )
    return moved


def _each(values: Any, name: str, n: int) -> np.ndarray:
    """Return the values of all n components."""
    each = checks.array(values, name, "(n,)", ndim=1)
    if each.shape != (n,) or n == 0:
        raise InputError(
            f"{name} must hold one value for each of at least one particle, found {len(each)} for {n}."
        )
    return each
