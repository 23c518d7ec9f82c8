"""Wells against published simulations by other programs: energy, pressure, events, diffusion, coexistence.

``pytest -m slow -s tests/validation/test_wells_published.py`` prints the table of docs/benchmarks.md.
"""

import math
import warnings
from dataclasses import dataclass, field

import numpy as np
import pytest
from helpers.mixtures import mixture

import carom
from carom.errors import CaromWarning
from carom.models import SquareWell, Steps, StepTable

INF = math.inf


@dataclass(frozen=True)
class Published:
    """A run of ``events`` events at constant energy by another program: kinetic plus potential ``energy`` of
    one component, and the ``values`` that it prints, by the names of `observed` ("kT" is twice the kinetic
    energy over d N).
    """

    source: str
    events: int
    energy: float
    values: dict[str, float] = field(default_factory=dict)


WEBSITE = "github.com/dynamomd/DynamO-Website, commit 06e80ae, htdocs/pages"

THIN = Published(
    f"DynamO, tutorial 4: {WEBSITE}/output.tut4.xml",
    events=1_000_000,
    energy=-3194.9999999999995 / 4000 + 1.5 * 1.9751905078351808,  # their last U and kT
    values={
        "kT": 1.9695813386316516,
        "U": -3161.3449847792272 / 4000,
        "P": 0.17880478250452167,
        "time": 68.801254983240516,
        "core": 454654 / 2e6,  # they count an event for each of the two
        "in": 581768 / 2e6,
        "out": 581922 / 2e6,
        "bounce": 381656 / 2e6,
        "D": 1.9569056352302285,
    },
)
"""4000 spheres of density 0.1, well 1.5 wide and 1 deep."""

MIXTURE = Published(
    f"DynamO, tutorial 5: {WEBSITE}/output.tut5.xml",
    events=1_000_000,
    energy=-16854.000000000004 / 4000 + 1.5 * 1.4955841973958153,
    values={
        "kT": 1.4874191074455181,
        "U": -16805.009460298483 / 4000,
        "P": 5.1808996081240641,
        "time": 2.957395222718798,
        "core": (282 + 46148 + 589236) / 2e6,
        "in": (490 + 33986 + 427344) / 2e6,
        "out": (486 + 33950 + 427020) / 2e6,
        "bounce": (410 + 32332 + 408316) / 2e6,
        "D_A": 0.094944658505663653,
        "D_B": 0.21671559001213933,
    },
)
"""100 large and 3900 half as large spheres of an eighth of their mass, packing fraction 0.3, wells 1.5 wide
and 1 deep for every pair."""


def scene_of_thin():
    return carom.Scene.crystal(cells=10, density=0.1).replace(interaction=SquareWell(1.5, 1.0))


def scene_of_mixture():
    places = mixture([100, 3900], diameters=[1.0, 0.5], masses=[1.0, 0.125], packing_fraction=0.3, seed=5)
    assert places.box[0] == pytest.approx(10.083897274776522, rel=1e-12)  # theirs
    cores = [[1.0, 0.75], [0.75, 0.5]]
    table = StepTable([[Steps([core, 1.5 * core], [INF, -1.0]) for core in row] for row in cores])
    return places.replace(interaction=table)


def energy_of(sim):
    """Return the kinetic and potential energy of a component."""
    return (sim.potential_energy + 0.5 * sim.degrees_of_freedom * sim.kT) / sim.scene.n


def set_energy(sim, energy):
    """Scale velocities until kinetic and potential energy are this, for each component."""
    kinetic = energy * sim.scene.n - sim.potential_energy
    sim.rescale(2.0 * kinetic / sim.degrees_of_freedom)


def observed(sim, events):
    """Return what is published of a stretch of so many events."""
    scene, start, steps = sim.scene, sim.frame(), sim.interaction
    n, d = scene.n, scene.dimension
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CaromWarning)  # only the mean is taken, and many runs tell its error
        pressure = sim.measure(carom.Pressure(), collisions=events, blocks=16)
    end, steps = sim.frame(), sim.interaction - steps
    free = d * n / sim.degrees_of_freedom  # their kT counts the motion of the center of mass
    kT = steps.kT / free
    moved = ((end.unwrapped - start.unwrapped) ** 2).sum(axis=1) / (2 * d * steps.time)
    found = {
        "kT": kT,
        "U": energy_of(sim) - 0.5 * d * kT,  # their sum is constant
        "P": n / scene.volume * (kT + steps.kT * (pressure.Z.mean - 1.0)),
        "time": steps.time,
        "core": steps.core / events,
        "in": steps.into / events,
        "out": steps.out / events,
        "bounce": steps.bounce / events,
        "D": moved.mean(),
    }
    if scene.species is not None:
        found |= {"D_A": moved[scene.species == 0].mean(), "D_B": moved[scene.species == 1].mean()}
    return found


def compared(published, stretches):
    """Print and return how many errors each published value is off the mean of our stretches."""
    print(f"\n{published.source}\n| | published | Carom | difference / error |\n|---|---|---|---|")
    off = {}
    for name, value in published.values.items():
        ours = np.array([stretch[name] for stretch in stretches])
        spread, error = ours.std(ddof=1), ours.std(ddof=1) / math.sqrt(len(ours))
        off[name] = (value - ours.mean()) / math.hypot(spread, error)
        print(f"| {name} | {value:.5g} | {ours.mean():.5g} +- {error:.1g} | {off[name]:+.1f} |", flush=True)
    return off


@pytest.mark.slow
# Errors are those of the stretches, each as short as theirs.
@pytest.mark.filterwarnings("ignore:Only .* independent samples", "ignore:Fewer than 4 independent samples")
@pytest.mark.filterwarnings("ignore:The temperatures of species change slowly")
@pytest.mark.parametrize(
    ("published", "scene"), [(THIN, scene_of_thin), (MIXTURE, scene_of_mixture)], ids=["thin", "mixture"]
)
def test_a_published_run_at_constant_energy_is_one_of_ours(published, scene):
    """Ten of our runs as long as theirs say how much such a run scatters: theirs lies within four errors."""
    sim = carom.Simulation(scene(), kT=1.5, seed=1)
    for _ in range(2):
        set_energy(sim, published.energy)
        sim.run(collisions=published.events)
    stretches = [observed(sim, published.events) for _ in range(10)]
    assert energy_of(sim) == pytest.approx(published.energy, rel=1e-12)
    off = compared(published, stretches)
    assert max(abs(each) for each in off.values()) < 4.0


@pytest.mark.slow
def test_disks_that_ten_steps_repel_have_the_published_mean_free_time():
    """DynamO's own test: github.com/toastedcrumpets/DynamO, commit 78d4ee1f, src/dynamo/tests,
    2dstepped_potential_test.cpp. From a square lattice of density 1, on which nobody is on a step, at an
    energy of 1; after 1e6 events, 0.0419518 within a hundredth.
    """
    n, reach = 128, np.arange(1, 11) / 10.0
    grid = np.stack(np.meshgrid(*[np.arange(n) + 0.5] * 2), axis=-1).reshape(-1, 2)
    interaction = StepTable(Steps(reach, 1.1 - reach))
    sim = carom.Simulation(carom.Scene(grid, (n, n), interaction=interaction), kT=1.0, seed=1)
    set_energy(sim, 1.0)
    sim.run(collisions=1_000_000)
    free = []
    for _ in range(2):
        before = sim.time
        sim.run(collisions=1_000_000)
        free.append((sim.time - before) * n * n / 2e6)
    print(f"\n2dstepped_potential_test.cpp: 0.0419518, Carom {free[0]:.6f} and {free[1]:.6f}")
    assert np.mean(free) == pytest.approx(0.0419518, rel=0.01)
