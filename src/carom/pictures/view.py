"""A page that shows a trajectory, a packing, or a logged run in exact time: ``carom.view``."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from carom import checks
from carom.drawing.page import View, of_frames, title_of
from carom.errors import CaromError, FileError, InputError, warn
from carom.frame import Frame
from carom.io import records
from carom.io.events import is_log
from carom.io.formats import Reader
from carom.io.trajectory import open_reader
from carom.layout import FRAMES, STATES, SUMMARY, scene_at
from carom.models.drives import Drive
from carom.models.interfaces.contact import Impact
from carom.models.interfaces.interaction import Interaction
from carom.models.interfaces.motion import Motion
from carom.models.interfaces.obstacle import Obstacle
from carom.scene.box import LONGEST_EDGE
from carom.scene.conversion import to_frame
from carom.scene.fields import standing

ORDER = ("events.h5", *FRAMES)
"""Files of a folder that can be shown; the first that exists is taken."""


__all__ = ["View", "view"]


def view(
    source: Any,
    path: str | os.PathLike[str] | None = None,
    *,
    obstacles: Sequence[Obstacle] | None = None,
    collisions: int | None = None,
    begin: float | None = None,
    end: float | None = None,
    title: str | None = None,
    interaction: Interaction | None = None,
    motion: Motion | None = None,
    impact: Impact | None = None,
    drive: Drive | None = None,
) -> View:
    """Show spheres in a browser, in 3D with light, as a movie or collision by collision.

    Parameters
    ----------
    source : path, Frame, sequence of Frames, Reader, Packing, PackingNetwork, Scene or Simulation
        What to show. A path leads to a trajectory, to an event log (shown in exact time), or to the folder of
        a run or a packing.
    path : path, optional
        Where to write the page.
    obstacles : sequence of obstacles, optional
        Obstacles to draw; by default those of the scene, if the source contains it, or of the run in whose
        folder the trajectory lies. Of an event log all obstacles, in order, if one is of your own class.
    collisions : int, optional
        Largest number of collisions to show of an event log; by default 20 000.
    begin, end : float, optional
        Times between which to show [time since the start of the run]. By default all frames; of an event log
        from where the measurement of the run in whose folder it lies begins, otherwise from 0.
    title : str, optional
        Title of the page.
    interaction, motion, impact, drive : values, optional
        Of the scene of an event log, needed if no file holds them: those of your own class, and range rules,
        which are called again.

    Returns
    -------
    View
        The page. A notebook shows it; ``save(path)`` writes it.

    Raises
    ------
    InputError
        If the source cannot be shown: no frames, more than three dimensions; if ``collisions`` is below 1, or
        nothing happens between ``begin`` and ``end``.
    FileError
        If a file cannot be read or written, or a value of your own class is needed and not given.

    Examples
    --------
    >>> import carom
    >>> carom.view(carom.Scene.crystal(108, 0.4)).title
    '108 spheres'
    """
    if collisions is not None:
        collisions = checks.integer(collisions, "collisions", low=1)
    times = _times(begin, end)
    own = {"interaction": interaction, "motion": motion, "impact": impact, "drive": drive}
    data, name = _data(source, obstacles, collisions, times, own)
    shown = View(data, title or name)
    if path is not None:
        shown.save(path)
    return shown


def _data(
    source: Any,
    obstacles: Sequence[Obstacle] | None,
    collisions: int | None,
    times: tuple[float | None, float],
    own: dict[str, Any],
) -> tuple[dict[str, Any], str]:
    """Return the data of a page and its title."""
    from carom.observables.packing import PackingNetwork
    from carom.pictures import viewdata
    from carom.scene.scene import Scene

    if isinstance(source, str | os.PathLike):
        return _of_path(Path(source), obstacles, collisions, times, own)
    network = source if isinstance(source, PackingNetwork) else getattr(source, "network", None)
    if isinstance(network, PackingNetwork):
        return viewdata.of_network(network), f"Packing at {network.packing_fraction:.5g}"
    scene = source if isinstance(source, Scene) else getattr(source, "scene", None)
    if isinstance(scene, Scene):
        frames: Any = [to_frame(scene) if source is scene else source.frame()]
        obstacles = standing(scene) if obstacles is None else obstacles
    elif isinstance(source, Frame):
        frames = [source]
    elif isinstance(source, Reader | Sequence) and all(isinstance(each, Frame) for each in source[:1]):
        frames = source
    else:
        raise InputError(
            f"There is nothing to show in a {type(source).__name__}; expected a path, a Frame or several, a "
            "Reader, a Packing, a Scene or a Simulation."
        )
    data = of_frames(_between(frames, times), obstacles or ())
    return data, title_of(frames[0])


def _of_path(
    path: Path,
    obstacles: Sequence[Obstacle] | None,
    collisions: int | None,
    times: tuple[float | None, float],
    own: dict[str, Any],
) -> tuple[dict[str, Any], str]:
    """Return the data and the title of a file, or of a file in a folder."""
    from carom.pictures import viewdata

    others: list[Path] = []
    if path.is_dir():
        found = [path / name for name in ORDER if (path / name).exists()]
        if not found:
            raise FileError(f"{path} holds nothing to show: none of {', '.join(ORDER)}.")
        path, *others = found
    if is_log(path):
        from carom.simulation.replay import Replay

        run = Replay(path, obstacles=obstacles, **own)
        # A replay draws straight flights; of other motions the frames are shown, if there are none those of
        # the collisions.
        limit = viewdata.MOST_COLLISIONS if collisions is None else collisions
        straight = getattr(run.scene.motion, "straight", True)
        if straight or not others:
            measured = _measured_from(path)
            begin = measured if times[0] is None else times[0]
            run.advance_to(begin, logged=True)
            if straight:
                data = viewdata.of_replay(run, limit, times[1])
            else:
                frames = viewdata.at_collisions(run, limit, times[1])
                data = of_frames(frames, standing(run.scene))
            data["notes"].insert(
                0, f"from t = {begin:.6g}" + ", where the measurement begins" * (0.0 < measured == begin)
            )
            return data, _title(path)
        path = others[0]
    if path.name == "packing.h5md":
        from carom.observables.packing import network_of

        with open_reader(path) as reader:
            frame = reader[-1]
        shown = standing_beside(path, frame) if obstacles is None else obstacles
        return viewdata.of_network(network_of(frame, obstacles=shown)), _title(path)
    with open_reader(path) as reader:
        if obstacles is None and len(reader):
            obstacles = standing_beside(path, reader[0])
        return of_frames(_between(reader, times), obstacles or ()), _title(path)


def _times(begin: float | None, end: float | None) -> tuple[float | None, float]:
    """Return the times between which is shown, checked: the first is None by default."""
    until = math.inf if end is None else checks.number(end, "end", low=0.0)
    if begin is not None and checks.number(begin, "begin", low=0.0) > until:
        raise InputError(
            f"begin is {begin:g} and end {until:g}; expected an end that is not before the begin."
        )
    return begin, until


def _between(frames: Any, times: tuple[float | None, float]) -> Any:
    """Return the frames between two times; all of them, not yet read, if there are no limits."""
    begin, end = times
    if begin is None and math.isinf(end):
        return frames
    kept = [frame for frame in frames if (begin or 0.0) <= frame.time <= end]
    if frames and not kept:
        raise InputError(
            f"No frame lies between t = {begin or 0.0:g} and {end:g}; expected times from that of the first, "
            f"{frames[0].time:g}, and of the last, {frames[-1].time:g}."
        )
    return kept


def _measured_from(log: Path) -> float:
    """Return when the measurement of the run in whose folder a ``log`` lies begins; 0 if that is not known.

    Its frames are taken at equal intervals, the first one interval after the beginning.
    """
    for path in (log.parent / name for name in FRAMES):
        if path.exists() and scene_at(log):
            with open_reader(path) as reader:
                if len(reader) > 1:
                    return max(2.0 * reader[0].time - reader[1].time, 0.0)
    return 0.0


def _title(path: Path) -> str:
    """Return the title of the page of a file; a byte that is no text becomes a question mark in a diamond."""
    title = f"{path.parent.name}/{path.name}" if path.parent.name else path.name
    return os.fsencode(title).decode("utf-8", "replace")


def rules_beside(source: Path) -> Interaction | None:
    """Return the range rules that the scene file in or next to ``source`` names; this runs their code."""
    if (file := scene_at(source)) is None:
        return None
    from carom.scene_file.scene_file import SceneFile

    return SceneFile.load(file).trusted().scene.own().get("interaction")


def standing_beside(trajectory: Path, frame: Frame) -> Sequence[Obstacle]:
    """Return the obstacles of the run or packing in whose folder a ``trajectory`` lies; none in another box.

    A scene file alone is a plan of some run, of which this trajectory need not be.
    """
    folder = trajectory.parent
    summary, plan = folder / SUMMARY, scene_at(trajectory)
    if trajectory.stem == "packing" and summary.exists():
        return _of_packing(summary, frame)
    if plan is None or not (summary.exists() or (folder / STATES[0]).exists()):
        return ()
    from carom.models.obstacles import checked
    from carom.scene_file.scene_file import SceneFile

    try:
        scene = SceneFile.load(plan).scene
    except CaromError as error:
        warn(f"Obstacles of the run are not drawn: {error}")
        return ()
    box = _box_of(summary) or scene.box
    # Some formats keep six digits.
    if box is not None and not (len(box) == frame.dimension and np.allclose(box, frame.box, rtol=1e-5)):
        return ()
    try:
        return checked(scene.obstacles, tuple(frame.box), tuple(frame.periodic))
    except InputError:  # of another dimension, or of a larger box
        return ()


def _box_of(summary: Path) -> list[float] | None:
    """Return the edges of the box of a finished run; None if its summary does not say."""
    length = records.number(low=1.0 / checks.MAGNITUDE, high=LONGEST_EDGE * checks.MAGNITUDE)
    try:
        box = records.table({"box": records.listed(length)})
        return list(records.read_json(summary, box, "the summary of a run", "remove it")["box"])
    except FileError:
        return None


def _of_packing(summary: Path, frame: Frame) -> Sequence[Obstacle]:
    """Return the obstacles that the summary of a packing lists, of the dimension of its frame."""
    from carom.models.files.tables import from_table
    from carom.models.obstacles import checked

    found = records.read_json(
        summary,
        records.table({}, later={"obstacles": records.listed(records.anything)}),
        "the summary of a packing",
        "so its obstacles are not known: give them, obstacles=[...], to carom.view or carom.movie",
    )
    try:
        listed = [from_table(table, "obstacle") for table in found.get("obstacles", [])]
        return checked(listed, tuple(frame.box), (False,) * frame.dimension)
    except InputError as error:
        raise FileError(f"{summary}: {error}") from None
