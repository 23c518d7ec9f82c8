"""Which phase `carom run` takes a run for, and with what it compares it."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.frames import at_rest

import carom
from carom import theory
from carom.block import Block
from carom.models import SquareWell
from carom.observables import Pressure
from carom.observables.analysis.drift import moved
from carom.scene_file.scene_file import SceneFile
from carom.scene_file.sections import RunSpec, SceneSpec
from carom.studies import TransportSpec
from carom.studies.phase import (
    _theory,
    compared,
    doubt,
    expected,
    finite_size_shift,
    lines,
    of_infinite_size,
    phase_of,
)
from carom.studies.planner.system import System
from carom.studies.runs.report import _phase
from carom.studies.trade.measures import theory_of

CRYSTAL, GONE = 0.15, 2.0

SPHERES = ["Carnahan-Starling", "Pieprzyk et al."]
FCC = ["Speedy (fcc)", "Almarza (fcc)"]


@pytest.mark.parametrize(
    ("d", "eta", "initial", "distance", "name", "equations", "doubt", "remark"),
    [
        (3, 0.45, "fcc", GONE, "fluid", SPHERES, "", ""),
        (3, 0.45, "fcc", CRYSTAL, "fluid", SPHERES, "near where they began", ""),
        (3, 0.52, "fcc", CRYSTAL, "solid", FCC, "below melting", ""),
        (3, 0.55, "fcc", CRYSTAL, "solid", FCC, "", "fcc crystal"),
        (3, 0.55, "dn", CRYSTAL, "solid", FCC, "", "fcc crystal"),
        (3, 0.55, "cubic", CRYSTAL, "solid", [], "a crystal or a glass", ""),
        (3, 0.55, "random", CRYSTAL, "solid", [], "a crystal or a glass", ""),
        (4, 0.35, "dn", CRYSTAL, "solid", [], "a crystal or a glass", ""),
        (3, 0.52, "random", GONE, "fluid", SPHERES, "metastable", ""),
        (2, 0.70, "triangular", GONE, "coexistence", [], "side by side", ""),
        (2, 0.71, "random", CRYSTAL, "coexistence", [], "side by side", ""),
        (2, 0.75, "triangular", CRYSTAL, "solid", [], "crystal or a glass", ""),
        (2, 0.6, "random", GONE, "fluid", ["Henderson", "Padé of ten virials"], "", ""),
        (2, 0.65, "random", GONE, "fluid", [], "", "end at packing fraction 0.6"),
        (3, 0.58, "random", GONE, "fluid", SPHERES[:1], "metastable", "Pieprzyk et al. end at packing"),
        (1, 0.70, "cubic", CRYSTAL, "fluid", ["Tonks (exact)"], "", ""),
    ],
)
def test_the_phase_decides_what_a_run_is_compared_with(
    d, eta, initial, distance, name, equations, doubt, remark
):
    """Where an equation ends, and a crystal beyond melting, are no doubts about equilibrium."""

    class Dense:
        dimension, packing_fraction = d, eta

    found = phase_of(Dense, initial, distance)
    assert (found.name, list(found.equations)) == (name, equations)
    for said, part in ((found.doubt, doubt), (found.remark, remark)):
        assert part in said
        assert bool(said) == bool(part)


@pytest.mark.usefixtures("plain")
def test_the_summary_of_a_run_tells_remarks_from_doubts(tmp_path):
    run = RunSpec(collisions_per_particle=4, equilibration=2, frames=1, pictures=False)
    for eta, against, remark in ((0.52, "below melting", ""), (0.6, None, "with the fcc crystal")):
        plan = SceneFile(SceneSpec(n=32, packing_fraction=eta, lattice="fcc"), run)
        summary = carom.run(plan, tmp_path / str(eta)).summary
        assert remark in summary["note"]
        assert against is summary["phase_note"] or against in summary["phase_note"]


@pytest.mark.parametrize("eta", [0.7, 0.7 + 1e-16, 7 * 0.1, math.nextafter(0.7, 0.0)])
def test_run_study_plan_and_picture_agree_at_freezing_itself(eta):
    """However 0.7 was computed: none of them takes disks there for a fluid that is in equilibrium."""

    class Dense:
        dimension, packing_fraction = 2, eta

    assert not theory.is_stable_fluid(2, eta)
    assert theory.is_stable_fluid(2, 0.7 - 1e-8)
    assert phase_of(Dense, "random", GONE).name == "coexistence"
    assert expected(eta, 2, "random") == "coexistence"
    with pytest.raises(carom.InputError, match="coexist"):
        System(eta, 2)
    with pytest.raises(carom.InputError, match="beyond freezing"):
        TransportSpec(packing_fraction=(eta,), n=(100,), dimension=2).tasks()


def test_carom_trade_compares_with_a_theory_of_the_phase_within_its_range():
    assert theory_of(carom.Scene.crystal(cells=10, dimension=2, packing_fraction=0.65)) is None
    assert theory_of(carom.Scene.crystal(cells=10, dimension=2, packing_fraction=0.55))[0] == "fluid"
    assert theory_of(carom.Scene.crystal(cells=3, packing_fraction=0.6)) == ("solid", theory.almarza)


def test_a_crystal_is_compared_with_a_crystal_of_as_many():
    scene = carom.Scene.crystal(cells=3, packing_fraction=0.55)
    images = np.zeros((108, 3), dtype=np.int32)
    images[:60, 0] = 1
    frame = at_rest(scene, images=images)
    # Most have gone around the box once: 108^(1/3) spacings.
    assert moved(scene.positions, frame) == pytest.approx(108 ** (1 / 3), rel=1e-12)
    phase = phase_of(scene, "fcc", 0.0)
    best = _theory(scene, phase)[-1]
    infinite = theory.almarza(0.55)
    assert best.Z_infinite == pytest.approx(infinite, rel=1e-12)
    assert pytest.approx(1 + (infinite - 1) * 107 / 108, rel=1e-12) == best.Z
    measured = Pressure.estimate(
        [Block(1.0, 100, 3 * 108 * (best.Z - 1))] * 32,
        n=108, dimension=3, volume=scene.volume, diameter=1.0, kT=1.0,
    )  # fmt: skip
    measured = dataclasses.replace(measured, solid=True)
    assert of_infinite_size(measured, phase).mean == pytest.approx(infinite, rel=1e-12)
    # The picture of the pressure draws what the table shows.
    still = at_rest(scene, images=0 * images)
    sim = SimpleNamespace(scene=scene, frame=lambda: still)
    plan = SimpleNamespace(scene=SimpleNamespace(start="fcc"))
    run = SimpleNamespace(sim=sim, plan=plan, first_places=scene.positions)
    drawn = lines(compared(scene, _phase(run)))
    assert list(drawn) == ["Speedy (fcc)", "Almarza (fcc)"]
    assert drawn["Almarza (fcc)"] == best.Z


def test_few_spheres_have_a_lower_pressure_than_many_and_the_report_takes_it_off():
    """The canonical ensemble lacks fluctuations of the density: Z_N < Z, by the Tonks gas exactly."""
    shift = finite_size_shift("fluid", 0.6, 20, theory.tonks)
    assert shift == pytest.approx(theory.tonks(0.6, 20) - theory.tonks(0.6), rel=1e-6)
    scene = carom.Scene([[float(k)] for k in range(6)], 10.0)
    (row,) = _theory(scene, phase_of(scene, "file", 9.0))
    assert row.Z_infinite == pytest.approx(1.0 / 0.4, rel=1e-12)
    assert math.isclose(row.Z, 1.0 + 5 / 6 * 0.6 / 0.4, rel_tol=1e-6)
    virial = 6 * (row.Z - 1)
    measured = Pressure.estimate(
        [Block(1.0, 100, virial)] * 32, n=6, dimension=1, volume=10.0, diameter=1.0, kT=1.0
    )
    assert of_infinite_size(measured, phase_of(scene, "file", 9.0)).mean == pytest.approx(2.5, rel=1e-6)
    assert math.isclose(row.contact_value, 2.5, rel_tol=1e-6)


@pytest.mark.parametrize(
    ("density", "kT", "well", "dimension", "known"),
    [
        (0.3, 1.0, SquareWell(1.5, 1.0), 3, True),
        (0.3, 2.0, SquareWell(1.5, 2.0), 3, True),
        (0.3, 1.22, SquareWell(1.5, 1.0), 3, False),
        (0.02, 1.0, SquareWell(1.5, 1.0), 3, False),
        (0.1, 1.0, SquareWell(1.5, 1.0), 3, True),
        (0.6, 1.0, SquareWell(1.5, 1.0), 3, True),
        (0.7, 1.0, SquareWell(1.5, 1.0), 3, False),
        (0.3, 0.5, SquareWell(1.3, 1.0), 3, False),
        (0.3, 1.0, SquareWell(1.5, -1.0), 3, False),
        (0.3, 1.0, SquareWell(1.5, 1.0), 2, False),
    ],
)
def test_wells_in_which_gas_and_liquid_are_known_to_coexist_say_so(density, kT, well, dimension, known):
    scene = carom.Scene.random(100, dimension=dimension, density=density, diameter=1.0, interaction=well)
    said = doubt(None, scene, kT)
    assert bool(said) is known
    assert not known or "Gas and liquid of these wells coexist" in said
