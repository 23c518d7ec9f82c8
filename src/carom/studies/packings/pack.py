"""``pack``: one packing, from points, from a scene or from what a scene file asks for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from carom import checks
from carom.errors import InputError
from carom.notebook import watchable
from carom.scene.scene import Scene
from carom.scene.species import Species
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import SceneSpec
from carom.spec import file_of, read, sections
from carom.studies.job import Look, Stopped
from carom.studies.packings.compression import Compression, PackingFolder, Progress
from carom.studies.packings.packing import Packing
from carom.studies.packings.spec import PackSpec
from carom.studies.result_folders import check_same
from carom.studies.signals import Interrupted, stoppable
from carom.studies.signatures import documented
from carom.texts import typed

POINTS = ("n", "dimension", "packing_fraction", "species", "walls")
"""What is said of points, and not of the particles of a scene."""


def asked_of(source: Any, given: Mapping[str, Any]) -> tuple[PackSpec, SceneSpec | None]:
    """Return what is to be packed, and its ``[scene]``; None for points.

    The source is a scene file, a folder that holds one, or the number of points. ``given`` fields of
    :class:`PackSpec` replace those of the file, unless they are None.
    """
    asked = PackSpec.of(source, given)
    if not isinstance(source, str | PathLike):
        return asked, None
    path = file_of(Path(source))
    found = sections(read(path), "scene", "pack")
    if "scene" not in found:
        return asked, None
    if {*POINTS} & {*found.get("pack", {}), *(name for name, value in given.items() if value is not None)}:
        raise InputError(
            r"[scene] says what is packed: leave out n, dimension, packing_fraction, species and walls of "
            "[pack], and their options."
        )
    if asked.seeds is not None:
        raise InputError("[scene] is the start of one packing; leave out seeds of [pack], or [scene].")
    return asked, SceneFile.load(path).scene


@documented(PackSpec, hidden=("n", "seeds"))
@watchable("Packing")
def pack(
    start: int | Scene | str | PathLike[str] | None = None,
    *,
    species: Sequence[Species] | None = None,
    stages: Sequence[tuple[float, float | None]] | None = None,
    out: str | PathLike[str] | None = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: Progress | None = None,
    **given: Any,
) -> Packing:
    """Let particles grow while they move, until they jam (Lubachevsky and Stillinger; the paper's sec. 9).

    Parameters
    ----------
    start : int, Scene or path
        Number of random points in a cubic box; 1000 if neither it nor species with counts are given. Or the
        scene to start from, of any density and in a box of any kind. Or a scene file (TOML) with ``[scene]``,
        ``[pack]`` or both, whose values other arguments replace.
    @
    species : sequence of :class:`carom.Species`, optional
        Species of the points, each with a ``count`` or a ``fraction``; their diameters are approximately the
        final ones [length].
    stages : sequence of (rate, until_Z), optional
        Stages instead of one rate and Z, e.g. fast, then slow. The last Z may be None. Beyond 1e13 gaps are
        lost in rounding.
    out : path, optional
        Folder for results and checkpoints; :func:`carom.resume` continues from there.
    overwrite : bool
        Whether a packing that the folder holds may be replaced.
    resume : bool
        Whether to go on with the packing that the folder holds, if it is this one.
    progress : callable, optional
        Called as ``progress(fraction, "Packing")``; True shows a bar.

    Returns
    -------
    Packing
        The final state, and the history of the compression.

    Raises
    ------
    InputError
        If an argument is unknown or out of range, nothing moves, or the particles become as wide as the box.
    FileError
        If the folder holds a packing and ``overwrite`` and ``resume`` are false, or another one than is to be
        resumed, or it cannot be written.
    Interrupted
        After Ctrl-C; its ``so_far`` is the packing until then.

    Notes
    -----
    Between two rescalings there are ``HEATING / rate`` collisions per particle, at most ``LONGEST``. Z comes
    from the virial of each stretch, with the integral of kT over its time. An increase of Z by a factor e
    takes some ``3.4 / rate`` collisions per particle (d = 3). At the rate 1e-3, growth from Z = 1e3 to 1e12
    takes 70 000.

    Examples
    --------
    >>> import carom
    >>> packing = carom.pack(30, dimension=2, rate=0.1, until_Z=1e6)
    >>> packing.note
    'Z = PV/NkT = 1e+06 reached'
    """
    if "seeds" in given:
        raise InputError(_SEVERAL)
    given |= {k: v for k, v in (("species", species), ("stages", stages)) if v is not None}
    if isinstance(start, Scene):
        if points := sorted({*POINTS} & {*given}):
            raise InputError(f"{points[0]} is for points, and pack() starts from a scene: leave it out.")
        return packed(PackSpec(**given), start, out, overwrite, resume, progress)
    if start is not None and not isinstance(start, int | np.integer | str | PathLike):
        raise InputError(
            f"pack() starts from a number of particles, a Scene or a scene file (TOML), found "
            f"{checks.describe(start)}."
        )
    asked, scene = asked_of(start, given)
    if asked.seeds is not None:
        raise InputError(_SEVERAL)
    return packed(asked, scene, out, overwrite, resume, progress)


_SEVERAL = "pack() makes one packing; packings(..., seeds=8) makes several."


def packed(
    asked: PackSpec,
    start: Scene | SceneSpec | None,
    out: str | PathLike[str] | None,
    overwrite: bool,
    resume: bool,
    progress: Progress | None,
) -> Packing:
    """Return what is asked for, from a scene or from points; other arguments are as in :func:`pack`."""
    folder = None if out is None else PackingFolder(Path(out))
    goes_on = folder is not None and resume and folder.checkpoint.is_file()
    if folder is not None and not goes_on:
        folder.check_free(overwrite)  # first: to make a scene may compile for seconds
    scene = asked.start(asked.seed) if start is None else start
    if isinstance(scene, SceneSpec):
        scene = scene.build(asked.seed)
    if scene.n < 2:
        raise InputError("A packing needs at least two particles, found one.")
    if getattr(scene.motion, "curved", False):
        raise InputError("A packing is one of a box; for caps on a sphere there is spherical_code().")
    compression = Compression.begun(scene, asked)
    if folder is None:
        return carried_out(compression, None, progress)
    with folder.owned():
        if goes_on:
            kept = Compression.load({}, folder.checkpoint)
            check_same(folder.path, folder.kind, kept.settings(), compression.settings())
            compression = kept
        else:
            folder.clear()
        return carried_out(compression, folder, progress)


def carried_out(compression: Compression, folder: PackingFolder | None, progress: Progress | None) -> Packing:
    """Run a compression to the end, and write the results to the folder if there is one."""
    with stoppable() as stop:
        stop.deferred = True
        kept = None if folder is None else folder.checkpoint
        try:
            packing: Packing = compression.finish(
                Look(lambda: stop.asked, kept, progress=progress, due=-math.inf, strict=True)
            )
        except Stopped:
            goes_on = "" if folder is None else f"; `{typed('carom resume', folder.path)}` goes on"
            raise Interrupted(f"Stopped{goes_on}.", compression.packing("stopped")) from None
        if folder is not None:
            compression.save(folder.checkpoint)
            stop.deferred = False
            packing.save(folder.path, pictures=compression.pictures)
    return packing
