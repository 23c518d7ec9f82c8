"""One task of a study of sheared fluids: a plain function that measures a flow in its balance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from carom.block import Block
from carom.observables.analysis.precision import Goal, lengthen
from carom.observables.statistics import Estimate, blocking
from carom.scene.fields import is_elastic, is_equal, is_usual
from carom.scene.scene import Scene
from carom.simulation.measuring import stretches
from carom.studies.coefficients.windows import mean_fluid
from carom.studies.folder import Task
from carom.studies.phase import finite
from carom.studies.scenes import simulation_of
from carom.studies.study import Look

HEAT = 0.1
"""Part of kT by which the flow heats elastic particles, about, before their velocities are scaled. The
viscosity, which goes as the root of kT, then differs from that at the mean kT by 1e-4."""

HEAT_ON_STEPS = 0.02
"""The same on steps, which take up a part of the heat, and whose viscosity is not Enskog's. The mean kT is
within 1 % of the one asked for, even if the flow heats by nothing or by twice as much."""

LEAST_LOSS = 0.1
"""Part of the energy of the normal motion that a contact is thought to lose at least, for the first kT."""


def measure(task: Task, look: Look) -> dict[str, Any]:
    """Bring the flow of a ``task`` to its balance and measure blocks of equal time; ``look`` may end it."""
    sim = simulation_of(task)
    scene, rate, kT = sim.scene, task["rate"], task["scene"]["kT"]
    if not task["rescale"] and scene.drive is None:
        sim.rescale(kT := balanced(scene, rate))
    fluid, collision_rate = mean_fluid(scene, kT)
    duration = task["strains"] / rate / task["blocks"]
    pieces, coldest = 1, kT
    if task["rescale"]:
        power = fluid.shear_viscosity * rate**2 * scene.volume
        heat = duration * power / (0.5 * scene.dimension * scene.n * kT)
        pieces = math.ceil(heat / (HEAT_ON_STEPS if sim._state.system.stepped else HEAT))
        coldest = kT / (1.0 + 0.5 * heat / pieces)  # so that the mean is kT
    series: dict[str, list[float]] = {}

    def block() -> dict[str, float]:
        look()
        parts: list[Block] = []
        for _ in range(pieces):
            parts += stretches.blocks(sim, duration / pieces, 1)
            if task["rescale"]:
                sim.rescale(coldest)
        return means(scene, parts, duration)

    for _ in range(math.ceil(task["equilibration"] / collision_rate / duration)):
        block()

    def extend(wanted: int) -> int:
        while len(series.get("stress", ())) < wanted:
            for name, value in block().items():
                series.setdefault(name, []).append(value)
        return wanted

    if task["relative_error"] is None:
        extend(task["blocks"])
    else:
        aim = Goal(min(task["relative_error"], 1.0))
        lengthen(aim, task["blocks"], extend, lambda: stress(series))
    statistics = sim.statistics
    return {
        "n": scene.n,
        "dimension": scene.dimension,
        "packing_fraction": scene.packing_fraction,
        "diameter": scene.diameter,
        "mass": scene.mass,
        "simple": is_usual(scene, "interaction") and is_elastic(scene) and is_equal(scene),
        "duration": duration,
        "series": series,
        "worst_overlap": statistics.worst_overlap,
        "energy_drift": finite(statistics.energy_drift),  # unknown with a drive
        "timings": {"engine_seconds": sim._state.seconds},
    }


def stress(series: dict[str, list[float]]) -> Estimate:
    """Return the shear stress ``-P_10`` [energy / length^d]."""
    return blocking(series["stress"])


def balanced(scene: Scene, rate: float) -> float:
    """Return kT at which contacts lose what the flow gives, by Enskog's theory [energy].

    The flow gives ``eta rate^2 V`` a time; a contact of restitution e loses ``(1 - e^2) kT`` in the mean. A
    run starts there: how the flow distorts the velocities makes the true one lower (Montanero et al., J.
    Fluid Mech. 389, 391 (1999)).
    """
    fluid, collision_rate = mean_fluid(scene, 1.0)
    loss = max(1.0 - getattr(scene.impact, "restitution", 1.0) ** 2, LEAST_LOSS)
    return float(2.0 * fluid.shear_viscosity * rate**2 * scene.volume / (scene.n * collision_rate * loss))


def means(scene: Scene, parts: Sequence[Any], duration: float) -> dict[str, float]:
    """Return the means over the ``parts`` of a block: collisions of one particle a time, kT and pressures."""
    fluxes = [part.momentum_flux for part in parts]
    # As in carom.PressureTensor: the center of mass takes part of the thermal motion.
    whole = sum(each.carried * (scene.n / (scene.n - 1.0)) + each.handed_over for each in fluxes)
    whole = whole / (scene.volume * duration)
    along = np.diag(whole)
    found = {
        "collision_rate": 2.0 * sum(part.collisions for part in parts) / (scene.n * duration),
        "kT": math.fsum(part.kT_time for part in parts) / duration,
        "stress": -float(whole[1, 0]),
        "pressure": float(along.mean()),
        "first": float(along[0] - along[1]),
    }
    return found if scene.dimension == 2 else {**found, "second": float(along[1] - along[2])}
