"""One of each that Carom saves, small."""

import carom
from carom.studies import RunPlan
from carom.studies.planner.choice import Design
from carom.studies.planner.system import System
from carom.studies.planner.target import Target
from helpers.plain import uncompiled


def one_of_each(where):
    """Fill a folder with a run, a packing, two studies, a plan, a code and a checkpoint; return it."""
    scene = carom.Scene.crystal(32, 0.3)
    carom.run(scene, where / "run1", collisions_per_particle=60, equilibration=5, frames=3, pictures=False)
    with uncompiled():  # of some hundred events
        carom.pack(20, dimension=2, rate=1.0, until_Z=1e4, out=where / "pack1", pictures=False)
    small = {"n": 32, "replicas": 1, "equilibration": 5, "executor": "serial"}
    carom.equation_of_state([0.1, 0.2], collisions_per_particle=40, out=where / "eos1", **small)
    carom.transport(0.1, collisions_per_particle=40, out=where / "transport1", **small)
    plan_of_a_moment().save(where / "plan1")
    carom.spherical_code(6).save(where / "code.json")
    sim = carom.Simulation(scene, seed=1)
    sim.run(collisions=50)
    sim.save(where / "state.h5")
    (where / "scene.toml").write_text("[scene]\nn = 32\npacking_fraction = 0.3\n")
    return where


def plan_of_a_moment():
    """Return a plan that no pilot was needed for."""
    design = Design(32, 1, 10.0, 64.0, 0.1, 0.01, 0.1005, 0.01)
    return RunPlan(
        Target("Z", 0.1), System(0.3), 3.98, "virial", {"virial": 1.0}, design, cores=1, walltime=None, seed=1
    )
