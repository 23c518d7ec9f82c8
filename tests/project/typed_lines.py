"""The lines that everybody types, for ``mypy --strict``: what users call has types."""

from typing import assert_type

import numpy as np

import carom
from carom import models
from carom.models import own
from carom.studies import EquationOfState


def fluid() -> float:
    scene = carom.Scene.random(256, packing_fraction=0.40)
    sim = carom.Simulation(scene, kT=1.0, seed=1)
    sim.equilibrate(collisions_per_particle=50)
    p, g = sim.measure(carom.Pressure(), carom.RDF(), collisions_per_particle=500)
    print(p)
    g.plot("g.png")
    pressure: carom.Estimate = p.Z
    assert_type(sim, carom.Simulation)
    assert_type(sim.kT, float)
    assert_type(sim.run(time=1.0).duration, float)
    return pressure.mean + pressure.error


def starts() -> list[carom.Scene]:
    large, small = carom.Species("large", fraction=0.2), carom.Species("small", fraction=0.8, diameter=0.5)
    mixture = carom.Scene.random(500, 0.40, species=[large, small])
    crystal = carom.Scene.crystal(500, 0.60)
    walls = carom.Scene.random(500, 0.20, walls="z")
    well = carom.Scene.random(256, density=0.3, interaction=models.SquareWell(range=1.5, depth=1.0))
    placed = carom.Scene([[1.0, 1.0]], box=4.0, obstacles=[models.Ball((2.0, 2.0), 0.5)])
    assert_type(crystal.packing_fraction, float)
    return [mixture, crystal, walls, well, placed.replace(walls=True), carom.Scene.from_frame(frames()[0])]


def bed() -> float:
    loss = models.Loss(0.9, contact_time=1e-3)
    floor = models.Wall(shake=models.Sine(0.3, period=2.0), impact=loss)
    gravity = models.Gravity((0.0, -1.0))
    scene = carom.Scene.random(252, 0.2, dimension=2, walls={"y_low": floor}, motion=gravity, impact=loss)
    sim = carom.Simulation(scene)
    sim.run(time=3.0)
    return sum(each.work for each in sim.obstacles)


def frames() -> list[carom.Frame]:
    sim = carom.Simulation(carom.Scene.random(64, 0.3, 2))
    written: int = sim.write("fluid.h5md", every=0.5, count=20)
    found = list(sim.sample(every=0.5, count=written))
    positions: np.ndarray = found[0].positions
    print(positions.shape, carom.RDF().over("fluid.h5md"))
    carom.view("fluid.h5md")
    with carom.open("fluid.h5md") as reader:
        print(len(reader))
    return found


def studies() -> None:
    packing = carom.pack(500, until_Z=1e12)
    packing.plot()
    print(packing.Z, packing.to_dict(), carom.spherical_code(24, tries=4).angle)
    study = carom.equation_of_state([0.1, 0.2], n=500, relative_error=1e-2, out="eos")
    study.save("eos.json")
    assert_type(study, EquationOfState)
    viscosity = carom.transport(0.1, n=108).shear_viscosity
    print(float(viscosity), viscosity.error, viscosity.window)
    assert_type(viscosity.error, float)
    run = carom.run(carom.Scene.crystal(500, 0.60), "run1")
    assert_type(run.Z, carom.Estimate)
    print(run.Z.mean, carom.load("run1"), carom.resume("run1"))
    plan = carom.plan("Z=1e-3", packing_fraction=0.3)
    print(plan.run().value)
    print(carom.theory.carnahan_starling(0.40))


@own.interaction
class Rods:
    """Unequal hard cores on a line."""

    diameters: own.PerParticle

    def interaction_time(self, i: int, j: int, r: own.Array, v: own.Array) -> own.Time:
        return own.first_contact(r, v, 0.5 * (self.diameters[i] + self.diameters[j]))


def own_models() -> None:
    carom.check(Rods(np.ones(3)))
