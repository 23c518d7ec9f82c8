"""A shear that oscillates: against all pairs and images, an exact solid, the steady viscosity, and files."""

import math
from fractions import Fraction
from unittest.mock import Mock

import numpy as np
import pytest
from helpers.goes_on import assert_same_bits
from helpers.marks import slow
from helpers.sheared import Naive

import carom
from carom import theory
from carom.errors import FileError, InputError
from carom.models import Shear, SquareWell
from carom.models.motions.shear import STAGES
from carom.observables import ShearModuli, averages
from carom.simulation.explanation import explain
from carom.simulation.measuring.readings import momentum_flux


def gas(d=2, n=40, packing_fraction=0.2, rate=0.7, period=2.0, **given):
    return carom.Scene.random(n, packing_fraction, d, seed=1, motion=Shear(rate, period=period), **given)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize(("box", "n"), [((7.0, 6.0), 16), ((6.0, 5.6, 5.8), 20)], ids=["plane", "space"])
def test_collisions_are_those_of_all_pairs_and_images(box, n):
    rng, d = np.random.default_rng(5), len(box)
    side = int(np.ceil(n ** (1 / d)))
    places = (np.argwhere(np.ones((side,) * d))[:n] + 0.5) * np.array(box) / side
    peculiar = rng.normal(size=places.shape)
    peculiar -= peculiar.mean(axis=0)
    rate, period = 1.0, 3.2
    sim = carom.Simulation(carom.Scene(places, box, velocities=peculiar, motion=Shear(rate, period=period)))
    naive = Naive(places, peculiar, box, 0.0)
    for stage in range(20):
        strains = [math.sin(2.0 * math.pi * k / STAGES) / (2.0 * math.pi) for k in (stage, stage + 1)]
        naive.change_rate(rate * STAGES * (strains[1] - strains[0]))
        naive.run_for(period / STAGES)
        sim.run(time=float(Fraction(period) * (stage + 1) / STAGES) - sim.time)
        assert sim.collisions == naive.collisions
        # Chaos: an error grows about tenfold with a collision of each, of which there are at most five.
        assert sim.frame().velocities == pytest.approx(naive.peculiar, abs=1e-7)
    assert naive.collisions > n // 2
    assert sim.frame().tilt == pytest.approx(naive.strain, abs=1e-12)
    assert abs(naive.strain) > 0.3


@pytest.mark.filterwarnings("ignore:Fewer than")
@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(("d", "n"), [(2, 6), (3, 6), slow(4, 6), (2, 1)])
def test_particles_that_never_meet_are_a_solid(d, n):
    """Their stress is the strain times ``sum m u_1^2 / V``; the peculiar velocities come back."""
    rng = np.random.default_rng(2)
    places, v = rng.uniform(0.2, 7.8, (n, d)), rng.normal(size=(n, d))
    v -= v.mean(axis=0) if n > 1 else 0.0
    scene = carom.Scene(places, (8.0,) * d, diameter=1e-6, velocities=v, motion=Shear(0.5, 0.1, period=3.0))
    sim = carom.Simulation(scene)
    sim.run(time=0.7)  # the phase counts from the start of the run
    found = sim.measure(ShearModuli(), time=6.0, blocks=26)
    sim.run(time=2.3)
    assert sim.collisions == 0
    modulus = np.sum(v[:, 1] ** 2) / 8.0**d * (n / (n - 1) if n > 1 else 1.0)
    # A polygon of 32 stages: the lowest of its harmonics that 13 blocks a period take for the period are
    # the 127th and 129th, of 1 / 127^2 = 6e-5, of which the mean over a block leaves a hundredth.
    assert found.storage.mean == pytest.approx(modulus, rel=2e-6)
    assert found.loss.mean == pytest.approx(0.0, abs=2e-6 * modulus)
    assert (found.periods, found.strain) == (2, pytest.approx(0.5 * 3.0 / (2.0 * math.pi)))
    assert sim.velocities == pytest.approx(v, abs=1e-13)
    assert sim.frame().tilt == pytest.approx(0.1, abs=1e-14)
    assert found.frequency == pytest.approx(2.0 * math.pi / 3.0)
    assert "2 periods" in str(found)
    assert str(found).index(found.storage.value_text) < str(found).index("G''")


@pytest.mark.usefixtures("both_ways")
def test_a_run_goes_on_from_a_checkpoint(tmp_path):
    sim = carom.Simulation(gas(), seed=1)
    sim.run(time=0.77)  # in the middle of a stage
    sim.save(tmp_path / "half.h5")
    again = carom.Simulation.load(tmp_path / "half.h5")
    assert again.scene.motion == sim.scene.motion
    for each in (sim, again):
        each.run(time=0.5)
    assert_same_bits(again.frame(), sim.frame())
    assert sum(momentum_flux(again._state)).tobytes() == sum(momentum_flux(sim._state)).tobytes()
    assert again._state.oscillation.done == math.floor(1.27 * STAGES / 2.0)
    state = again._state
    state.oscillation = state.oscillation._replace(done=state.oscillation.done + 1)
    again.save(tmp_path / "half.h5")
    with pytest.raises(FileError, match="stage of its shear is not that of its time"):
        carom.Simulation.load(tmp_path / "half.h5")


@pytest.mark.parametrize("law", [{}, {"interaction": SquareWell(1.4)}], ids=["hard", "wells"])
def test_energy_grows_by_the_work_of_every_stage(plain, law):
    sim = carom.Simulation(gas(n=20, **law), seed=1)

    def energy():
        return 0.5 * sim.degrees_of_freedom * sim.kT + (sim.potential_energy if law else 0.0)

    before, work, state = energy(), 0.0, sim._state
    for _ in range(STAGES // 2):
        rate, passed = state.system.motion.rate, sum(momentum_flux(state))[1, 0]
        sim.run(time=float(state.oscillation.next) - sim.time)
        work -= rate * (sum(momentum_flux(state))[1, 0] - passed)
    assert energy() - before == pytest.approx(work, abs=1e-12 * before)
    assert abs(work) > 0.01 * before
    assert math.isnan(sim.statistics.energy_drift)  # the rate of now is not that of all its stages


def test_stops_and_ctrl_c_do_not_matter(plain, monkeypatch):
    whole, parts = (carom.Simulation(gas(n=20), seed=1) for _ in range(2))
    whole.run(time=1.0)
    parts.run(time=1.0 / 32.0)
    monkeypatch.setattr(parts._state, "schedule", Mock(side_effect=KeyboardInterrupt))  # as the rate changes
    with pytest.raises(KeyboardInterrupt):
        parts.run(time=1.0)
    monkeypatch.undo()
    while parts.time < 1.0:
        parts.run(time=min(1.0 / 16.0, 1.0 - parts.time))
    assert whole.positions.tobytes() == parts.positions.tobytes()
    assert sum(momentum_flux(whole._state)) == pytest.approx(sum(momentum_flux(parts._state)), rel=1e-12)


@pytest.mark.parametrize(("attempt", "said"), [
    (lambda sim: Shear(1.0, period=0.0), "period of Shear must be"),
    (lambda sim: sim.measure(ShearModuli(), time=4.0, blocks=8), "A block is 0.25 periods long"),
    (lambda sim: sim.measure(ShearModuli(), time=1.0, blocks=8), "a whole period at least"),
    (lambda sim: carom.Simulation(sim.scene, event_log="log.h5"), "An event log needs a constant shear"),
    (lambda sim: explain(sim.scene, event_log=True), "An event log needs a constant shear"),
    (lambda sim: carom.Simulation(gas(n=10).replace(motion=Shear(1.0))).measure(ShearModuli(), time=1.0),
     "needs a shear that oscillates"),
])  # fmt: skip
def test_what_does_not_go_is_one_sentence(plain, attempt, said):
    with pytest.raises(InputError, match=said):
        attempt(carom.Simulation(gas(n=10), seed=1))


@pytest.mark.slow
def test_a_dilute_gas_has_one_relaxation_time():
    """It is Maxwell's fluid, whose time is the viscosity over n kT."""
    eta, n = 0.01, 500
    density = 6.0 * eta / math.pi
    time = theory.enskog(theory.best(3)(eta), eta, 3).shear_viscosity / density
    for times in (0.5, 1.0):
        period = 2.0 * math.pi * time / times
        shear = Shear(0.2 * times / time, period=period)
        sim = carom.Simulation(carom.Scene.random(n, eta, seed=1, motion=shear), seed=1)
        sim.run(time=2.0 * period)
        found = []
        for _ in range(100):
            sim.rescale(1.0)
            one = sim.measure(ShearModuli(), time=period, blocks=16)
            found.append([one.storage.mean, one.loss.mean])
        storage, loss = averages(found)
        for estimate, exact in ((storage, times**2), (loss, times)):
            exact *= density / (1.0 + times**2)
            # Three hundredths for Enskog's first approximation, and for the heat of half a period.
            assert abs(estimate.mean - exact) < 4.0 * estimate.error + 0.03 * exact
            assert estimate.error < 0.1 * exact
