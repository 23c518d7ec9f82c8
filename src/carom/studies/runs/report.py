"""The results of a run: pressure, g(r), comparison with theory, pictures, and the summary, written last."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from carom.block import Block
from carom.errors import CaromError, FileError, InputError, OverlapError, warn
from carom.frame import Frame
from carom.geometry.overlaps import Overlap
from carom.io.trajectory import open_reader
from carom.models.obstacles.box_walls import sides
from carom.models.obstacles.faces import stand_ins
from carom.observables import Estimate, Pressure, PressureResult, WallPressure
from carom.observables.analysis.drift import LEVEL, moved
from carom.observables.analysis.equilibrium import doubts_about, slow_structure
from carom.observables.analysis.layers import Layer
from carom.observables.analysis.quantiles import student_above
from carom.observables.energy import Energy, EnergyResult, without_potential
from carom.observables.pressure import without_pressure
from carom.observables.rdf import MOST_SPECIES, rdf_of, species_of
from carom.observables.statistics import ratio, unwarned
from carom.observables.volume import Volume, VolumeResult
from carom.observables.wall_pressure import obstacle_names
from carom.paths import write_text
from carom.scene.description import kind
from carom.scene.fields import is_equal, is_simple, is_usual, standing
from carom.scene.scene import Scene
from carom.scene.species import pair_name
from carom.scene.velocities import kept_by_motion
from carom.simulation.measuring import stretches
from carom.simulation.measuring.equilibration import drifts, mean_square_displacement
from carom.simulation.moves.barostat import VolumeMoves
from carom.simulation.simulation import Simulation
from carom.studies import phase as phases
from carom.studies.phase import MeanBox, Phase, phase_of
from carom.studies.runs.summary import BarostatMoves, Moves, Summary, Surface, Theory
from carom.version import __version__

if TYPE_CHECKING:
    from carom.studies.runs.driver import Run

T = TypeVar("T")

OTHER = 0.01
"""Part of a temperature by which the mean of a run may differ from it, and no sentence says so."""

OF_PRESSURE = ("Z", "Z_from_rate", "reduced_pressure", "collision_rate", "contact_value")
OF_ENGINE = (
    "spared_contacts", "momentum_drift", "worst_overlap", "advancement_fraction", "clamped_roots", "transits",
)  # fmt: skip

SCALED_BY = 0.375
"""Part of the equilibration whose mean kT velocities are scaled by last."""


class _Parts:
    """Computes the parts of a report. One that fails is left out with a remark, and the run is not lost."""

    def __init__(self) -> None:
        self.remarks: list[str] = []  # what is missing, and why
        self.fault: Exception | None = None  # the first that is no CaromError, to be raised at the end

    def of(self, name: str, make: Callable[[], T], otherwise: T) -> T:
        """Return what ``make`` returns, or ``otherwise``."""
        try:
            return make()
        except (FileError, OSError):
            raise  # a full disk, or a damaged file: the run can be resumed
        except CaromError as error:
            self.remarks.append(f"No {name}: {error}")
        except Exception as error:
            self.remarks.append(f"No {name}: {type(error).__name__} ({error}), an error of the program.")
            self.fault = self.fault or error
        return otherwise


def write(run: Run) -> dict[str, Any]:
    """Write g(r), the pictures, the times and the summary, in this order, and return the summary.

    An error of the program in one of its parts, or an overlap, is raised when all others are written.
    """
    parts = _Parts()
    if run.overlaps:
        parts.fault = OverlapError(_overlapping(run))
    summary = _summary(run, parts).to_dict()
    # In a file of their own, so that all others depend on the plan alone.
    timing = {
        "collisions_per_second": summary["collisions"] / run.engine_seconds,
        "seconds": run.wall_seconds,
    }
    for path, found in ((run.folder.timing, timing), (run.folder.summary, summary)):
        write_text(path, json.dumps(found, indent=2, allow_nan=False, ensure_ascii=False) + "\n")
    for sentence in summary["remarks"]:
        warn(sentence)
    if parts.fault is not None:
        raise parts.fault
    run.tell(1.0, "Done")
    return summary


def _summary(run: Run, parts: _Parts) -> Summary:
    """Return what was measured; write g(r) and the pictures."""
    sim, scene, asked, statistics = run.sim, run.sim.scene, run.plan.run, run.sim.statistics
    pressure = parts.of("pressure", lambda: pressure_of(sim, run.measured), None)
    volume = parts.of("volume", lambda: volume_of(sim, run.measured), None)
    energy = parts.of("potential energy", lambda: energy_of(sim, run.measured), None)
    reason = without_rdf(scene, bool(run.trajectories or run.without), volume is not None)
    rdf: Any = None
    if reason is None:
        rdf = parts.of("g(r)", lambda: _distribution(run), None)
        reason = " ".join(parts.remarks[-1:]) or None if rdf is None else None
    phase = parts.of("phase", lambda: _phase(run, volume), None)
    compared = parts.of("theory", lambda: phases.compared(scene, phase, volume), list[Theory]())
    if asked.pictures:
        run.tell(0.0, "Drawing")
        parts.of("pictures", lambda: _draw(run, pressure, rdf, phases.lines(compared)), None)
    moves = sim._state.volume_moves
    given: dict[str, Any] = {name: getattr(pressure, name, None) for name in OF_PRESSURE}
    if volume is not None and moves is not None:
        given |= at_constant_pressure(volume, moves, scene.diameter)
    infinite = parts.of(
        "Z of infinite size", lambda: phases.of_infinite_size(pressure, phase, volume, given["Z"]), None
    )
    borne = parts.of("pressure on walls and obstacles", lambda: _obstacles(run), list[Surface]())
    doubts = parts.of("test of equilibrium", lambda: _doubts(run, volume or pressure, energy), list[str]())
    other, early = (None if energy is None else _other_temperature(run, energy.kT)) or ("", False)
    without = None if _decides(scene) else no_pressure(scene)
    noted = without if pressure is None else pressure.note
    layers = parts.of("layers", run.bed.found, list[Layer]())
    kT = _temperature(run, pressure, energy)
    # The change since velocities were scaled last, at the first mark.
    drift = run.energy_drift if run.rounds else statistics.energy_drift
    interaction = None if is_usual(scene, "interaction") else scene.interaction
    swaps = None if asked.swaps is None else Moves(statistics.swaps_tried, statistics.swaps_accepted)
    pairs = {k: g.contact_value for k, g in rdf.items()} if isinstance(rdf, dict) else {}
    return Summary(
        version=__version__,
        seed=asked.seed,
        packing_fraction=scene.packing_fraction if volume is None else volume.packing_fraction.mean,
        box=list(scene.box),
        system=kind(scene.dimension, scene.n, interaction),
        kT=kT,
        thermal=_thermal(run, pressure),
        weight=run.bed.weight,
        temperature=getattr(energy, "kT", None),
        equilibration=dict(zip(("collisions", "time"), run.equilibrated or (), strict=True)),
        collisions=sum(block.collisions for block in run.measured),
        time=math.fsum(block.duration for block in run.measured),
        frames=run.written,
        trajectories=[path.name for path in run.trajectories],
        without_trajectory=run.without,
        relative_error=asked.relative_error,
        U=getattr(energy, "U", None),
        Z_infinite=infinite,
        contact_value_from_rdf=getattr(rdf, "contact_value", None),
        contact_values_from_rdf=pairs,
        without_rdf=reason,
        remarks=[*doubts, *([other] if early else []), *parts.remarks],
        note=" ".join(filter(None, (noted, "" if early else other, phases.remark(phase, scene)))),
        obstacles=borne,
        layers=layers,
        collisions_by_species=_by_species(sim),
        units=_units(sim),
        swaps=swaps,
        barostat=moves
        and BarostatMoves(**asdict(moves.barostat), tried=moves.tried, accepted=moves.accepted),
        phase=None if phase is None else phase.name,
        phase_note=phases.doubt(phase, scene, kT),
        theory=compared,
        energy_drift=drift,
        frames_with_overlaps=len(run.overlaps) if asked.check else None,
        **given,
        **{name: getattr(scene, name) for name in ("n", "dimension", "diameter", "mass")},
        **{name: getattr(statistics, name) for name in OF_ENGINE},
    )


def _overlapping(run: Run) -> str:
    """Return a sentence on the frames that overlap: the deepest in all, and the first."""
    found = [(time, Overlap(*each)) for time, *each in run.overlaps]
    time, worst = max(found, key=lambda each: each[1].relative)
    return (
        f"In {len(found)} of {run.written} frames there are overlaps, the first at time "
        f"{found[0][0]:.6g}: at time {time:.6g} {worst}. An event was missed, and the results are "
        "wrong: `carom.check` a model of your own, and else report the scene and the seed."
    )


def pressure_of(sim: Simulation, blocks: list[Block]) -> PressureResult | None:
    """Return the pressure in a box that keeps its volume; None where there is none (:func:`no_pressure`), or
    nothing moves.
    """
    without = sim.kT == 0.0 or no_pressure(sim.scene) is not None or sim._state.volume_moves is not None
    return None if without else stretches.estimate(sim, Pressure(), blocks)


def volume_of(sim: Simulation, blocks: list[Block]) -> VolumeResult | None:
    """Return the mean volume, and the pressure from collisions; None without a barostat."""
    return None if sim._state.volume_moves is None else stretches.estimate(sim, Volume(), blocks)


def at_constant_pressure(found: VolumeResult, moves: VolumeMoves, diameter: float) -> dict[str, Estimate]:
    """Return the numbers of the summary under a barostat by name; Z has the pressure of the barostat."""
    return {
        "volume": found.volume,
        "Z": found.volume.scaled(moves.barostat.pressure / (found.n * found.kT)),
        "reduced_pressure": found.pressure.scaled(diameter**found.dimension / found.kT),
    }


def energy_of(sim: Simulation, blocks: list[Block]) -> EnergyResult | None:
    """Return the potential energy; None where there is none."""
    return None if without_potential(sim.scene) else stretches.estimate(sim, Energy(), blocks)


def no_pressure(scene: Scene) -> str | None:
    """Return a sentence on why a run of a scene has no pressure; None if it has one."""
    if _decides(scene):
        return "There is no pressure where units decide by rules: they are in no equilibrium."
    return without_pressure(scene)


def _decides(scene: Scene) -> bool:
    """Return whether units decide by rules; they are not in equilibrium, and conserve nothing."""
    return getattr(scene.interaction, "decides", False)


def without_rdf(scene: Scene, frames: bool, barostat: bool = False) -> str | None:
    """Return a sentence on why a run with or without ``frames`` has no g(r); None if it has one."""
    if barostat:
        return "No g(r): a barostat changes the volume; `carom measure FOLDER` gives g(r) of the frames."
    if _decides(scene):
        return "No pressure and no g(r): units that decide by rules are in no equilibrium."
    if scene.walls or scene.obstacles:
        what = "walls" if scene.walls else "obstacles"
        return f"No g(r): with {what} the fluid is not the same everywhere, and g depends on more than r."
    if not frames:
        return "No g(r): it comes from the frames of a trajectory, and none was asked for."
    species = np.zeros(scene.n, dtype=np.int64) if is_equal(scene) else species_of(scene)
    if species is None:
        return f"No g(r): there are more than {MOST_SPECIES} sizes, too many for a g(r) of every pair."
    narrowest = float(scene.diameters.min())
    if scene.n < 2 or min(scene.box) <= 2.0 * narrowest:
        return "No g(r): it needs two particles, and a box with edges of more than two diameters."
    return None


def _distribution(run: Run) -> Any:
    """Write and return g(r), or that of each pair of species of a mixture by its name."""

    def frames() -> Iterator[Frame]:
        if run.without:  # the final state replaces the missing frames
            run.tell(0.0, "Computing g(r)")
            yield run.sim.frame()
            return
        # From the file, so that a resumed run sees every frame; H5MD is preferred, as text is slow to read.
        source = next((path for path in run.trajectories if path.suffix == ".h5md"), run.trajectories[0])
        with open_reader(source) as reader:
            for k, frame in enumerate(reader):
                run.tell(k / len(reader), "Computing g(r)")
                yield frame

    found = rdf_of(run.sim.scene).over(frames()) or None  # of a mixture perhaps of no pair
    if found is not None:
        found.save(run.folder.rdf)
    return found


def _draw(run: Run, pressure: PressureResult | None, rdf: Any, lines: dict[str, float]) -> None:
    from carom.pictures import plots

    implied, folder = None if pressure is None else pressure.contact_value, run.folder.path
    # First, because what it takes in memory is free again for the others.
    plots.snapshot(run.sim.frame(), obstacles=standing(run.sim.scene), path=folder / "snapshot.png")
    if pressure is not None:
        plots.pressure(pressure, equations=lines, path=folder / "pressure.png")
    if isinstance(rdf, dict):
        plots.partial_rdf(rdf, path=folder / "rdf.png")
    elif rdf is not None:
        plots.rdf(rdf, contact_value=implied, path=folder / "rdf.png")


def _phase(run: Run, volume: VolumeResult | None = None) -> Phase | None:
    """Return the phase of equal elastic particles in a periodic box; None for other scenes."""
    scene = run.sim.scene
    if not is_simple(scene) or run.first_places is None:
        return None
    filled = scene if volume is None else MeanBox.of(volume)
    return phase_of(filled, run.plan.scene.start, moved(run.first_places, run.sim.frame()))


def _other_temperature(run: Run, kT: Estimate) -> tuple[str, bool] | None:
    """Return a sentence where a run came to another temperature than was asked for, and whether it speaks
    against equilibrium.
    """
    asked, scene = run.plan.run.kT, run.sim.scene
    decided = scene.drive is not None or drifts(run.sim) is not None
    if asked is None or scene.velocities is not None or decided:
        return None  # contacts, surfaces or a drive decide, and no equilibration brings kT back
    scaled = bool(run.rounds) and not run.plan.run.event_log
    # Velocities were scaled by a mean over a part of the equilibration, which has an error of its own.
    measured = math.fsum(block.duration for block in run.measured)
    _, time = run.equilibrated or (0, 0.0)
    longer = measured / (SCALED_BY * time) if scaled and time else 0.0
    chance = student_above(0.5 * LEVEL, max(kT.n_eff - 1.0, 1.0)) * kT.error * math.sqrt(1.0 + longer)
    if not abs(kT.mean - asked) > max(OTHER * asked, chance):
        return None
    said = f"kT = {asked:g} was asked for, and its mean is {kT.mean:.4g}: kinetic and potential energy are"
    if scaled:
        return f"{said} still being exchanged, so equilibrate longer.", True
    if run.plan.run.event_log:
        return f"{said} exchanged, and velocities are not scaled where an event log is written.", False
    return f"{said} exchanged.", False


def _doubts(run: Run, main: PressureResult | VolumeResult | None, energy: EnergyResult | None) -> list[str]:
    """Return what speaks against the equilibrium of the run."""
    sim, scene = run.sim, run.sim.scene
    said = [sentence for found in (main, energy) if found is not None for sentence in doubts_about(found)]
    if main is not None and getattr(main, "steady", True) and run.first_places is not None:
        # Where the particles were when the stretch began is not kept: they move alike before and in it.
        part = math.fsum(block.duration for block in run.measured) / sim.time
        distance = mean_square_displacement(run.first_places, sim.frame())
        said += slow_structure(scene, part * distance)
    error = math.inf if main is None else main.primary.relative_error
    return said if _decides(scene) else said + run.thermometer.doubts(error)


def _temperature(run: Run, pressure: PressureResult | None, energy: EnergyResult | None) -> float:
    """Return kT, where it changes as an average over the measured stretch."""
    if pressure is not None:
        return pressure.kT
    if energy is not None:
        return energy.kT.mean
    if run.bed.kT is not None:
        return run.bed.kT
    times = [block.kT_time for block in run.measured if block.kT_time is not None]
    duration = math.fsum(block.duration for block in run.measured)
    return math.fsum(times) / duration if times else run.sim.kT


def _thermal(run: Run, pressure: PressureResult | None) -> bool:
    """Return whether pressures may be given in units of kT: where it is constant, or averaged."""
    scene = run.sim.scene
    if run.bed.weight is not None or _decides(scene):
        return False
    straight = getattr(scene.motion, "straight", True) and all(kept_by_motion(scene))
    return pressure is not None or straight


def _obstacles(run: Run) -> list[Surface]:
    """Return what every wall and obstacle bore and gave in the measured stretch, but for walls for which an
    obstacle stands.
    """
    scene = run.sim.scene
    gone = stand_ins(standing(scene), scene.box, scene.periodic)
    walls = sides(scene.periodic)
    rubbed = not is_usual(scene, "impact")
    working = [*(rubbed for _ in walls), *(rubbed or hasattr(each, "live") for each in standing(scene))]
    # The area of a plane inside the box is not known, so it has only a force.
    return [
        Surface(name, _borne(run, k, 1.0), _borne(run, k, None), _power(run, k) if working[k] else None)
        for k, name in enumerate(obstacle_names(scene))
        if k >= len(walls) or walls[k] not in gone
    ]


def _power(run: Run, k: int) -> Estimate | None:
    """Return the energy that wall or obstacle k gave a time; None where it gave and took none."""
    given = [block.works[k] for block in run.measured]
    if not any(given):
        return None
    with unwarned():
        return ratio(given, [block.duration for block in run.measured])


def _borne(run: Run, k: int, area: float | None) -> Estimate | None:
    """Return the pressure on wall or obstacle k; None where there is none."""
    with unwarned(), contextlib.suppress(InputError):  # the pressure of the fluid has warned of few blocks
        return WallPressure(k, area=area).of_scene(run.measured, run.sim.scene, kT=run.sim.kT).pressure
    return None


def _by_species(sim: Simulation) -> dict[str, int]:
    """Return the collisions of every pair of species since the start, by the names or numbers of species."""
    if sim.scene.species is None:
        return {}
    counts = sim.collisions_by_species
    names = sim.scene.species_names or tuple(map(str, range(len(counts))))
    pairs = itertools.combinations_with_replacement(range(len(counts)), 2)
    return {pair_name(names[i], names[j]): int(counts[i, j]) for i, j in pairs}


def _units(sim: Simulation) -> dict[str, int]:
    """Return the number of remaining units of each kind, where units decide by rules."""
    if not _decides(sim.scene):
        return {}
    units, kinds = sim.interaction, sim.scene.interaction.kinds  # type: ignore[attr-defined]
    left = np.bincount(units.kinds[units.present], minlength=len(kinds)).tolist()
    return {kind.name: count for kind, count in zip(kinds, left, strict=True)}
