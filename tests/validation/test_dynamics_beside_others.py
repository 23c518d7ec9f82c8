"""Dynamics and structure beside programs that nobody here wrote; each an optional extra."""

import numpy as np
import pytest
from helpers.mixtures import mixture

import carom
from carom import io
from carom.observables import Dynamics

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def frames():
    sim = carom.Simulation(carom.Scene.crystal(cells=3, packing_fraction=0.3), seed=1)
    sim.run(collisions_per_particle=50)
    return list(sim.sample(every=0.0625, count=150))


@pytest.fixture(scope="module")
def found(frames):
    dynamics = Dynamics(shells=4)
    for frame in frames:
        dynamics.add(frame)
    return dynamics.result()


def universe_of(frames):
    """Return a Universe of unwrapped positions."""
    import dataclasses

    unwrapped = [dataclasses.replace(f, positions=f.unwrapped, images=None) for f in frames]
    return io.universe(unwrapped)


def test_mean_squares_are_those_of_mdanalysis(frames, found):
    from MDAnalysis.analysis import msd

    universe = universe_of(frames)
    theirs = msd.EinsteinMSD(universe, select="all", msd_type="xyz", fft=False).run().results.timeseries
    for k in range(15):  # lags over which both average all frames
        assert found.mean_square[k] == pytest.approx(theirs[k + 1], rel=1e-4)  # single precision


@pytest.mark.needs("transport-analysis")
def test_the_velocity_autocorrelation_is_that_of_transport_analysis(frames, found):
    from transport_analysis.velocityautocorr import VelocityAutocorr

    universe = universe_of(frames)
    theirs = VelocityAutocorr(universe.atoms, fft=False).run().results.timeseries
    for k in range(15):
        ours = 3.0 * found.velocity_autocorrelation[k]
        assert ours == pytest.approx(theirs[k + 1], rel=1e-4, abs=1e-6 * theirs[0])


def test_the_structure_factor_is_that_of_freud(frames, found):
    import freud

    shortest = found.wave_numbers[0]
    theirs = freud.diffraction.StaticStructureFactorDirect(
        bins=200, k_max=float(found.wave_numbers[-1] * 1.2), num_sampled_k_points=0
    )
    box = freud.box.Box(*frames[0].box)
    # freud takes wave vectors of one octant only: mirror images of the frames have those of the others.
    for frame in frames:
        centered = frame.positions - 0.5 * np.array(frame.box)
        for mirror in ((1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1)):
            theirs.compute((box, box.wrap(centered * mirror)), reset=False)
    for q, ours in zip(found.wave_numbers, found.structure_factor, strict=True):
        k = int(np.argmin(np.abs(theirs.bin_centers - q)))
        near = theirs.S_k[max(k - 1, 0) : k + 2]
        value = near[np.isfinite(near) & (near > 0.0)]
        assert ours == pytest.approx(value[0], rel=1e-3), q / shortest


def units_of(pv):
    """Return our units in the words of physical-validation."""
    return pv.data.UnitData(
        kb=1.0, energy_conversion=1.0, length_conversion=1.0, volume_conversion=1.0,
        temperature_conversion=1.0, pressure_conversion=1.0, time_conversion=1.0,
        energy_str="kT", length_str="sigma", volume_str="sigma^3", temperature_str="kT",
        pressure_str="kT/sigma^3", time_str="t",
    )  # fmt: skip


@pytest.mark.needs("physical-validation")
def test_kinetic_energy_of_a_part_passes_physical_validation():
    import physical_validation as pv

    # At constant energy the ensemble has no distribution of energies, but parts of the fluid are canonical up
    # to 1 / N: eight spheres of 864.
    sim = carom.Simulation(carom.Scene.crystal(cells=6, packing_fraction=0.3), seed=1)
    sim.run(collisions_per_particle=50)
    few = 8
    energies = [0.5 * np.sum(frame.velocities[:few] ** 2) for frame in sim.sample(every=2.0, count=500)]
    data = pv.data.SimulationData(
        units=units_of(pv),
        ensemble=pv.data.EnsembleData("NVT", natoms=few, volume=1.0, temperature=863.0 / 864.0),
        system=pv.data.SystemData(
            natoms=few, nconstraints=0, ndof_reduction_tra=0, ndof_reduction_rot=0, mass=np.ones(few)
        ),
        observables=pv.data.ObservableData(kinetic_energy=np.array(energies)),
    )
    mean, width = pv.kinetic_energy.distribution(data, strict=False, verbosity=0)
    assert abs(mean) < 4.0  # standard errors
    assert abs(width) < 4.0


@pytest.mark.needs("physical-validation")
def test_light_and_heavy_spheres_pass_the_equipartition_of_physical_validation():
    import physical_validation as pv

    scene = mixture(
        [432, 432], diameters=[1.0, 0.7], masses=[4.0, 1.0], dimension=3, packing_fraction=0.3, seed=2
    )
    sim = carom.Simulation(scene, seed=2)
    sim.run(collisions_per_particle=100)
    # Eight of each. The momentum of all is zero, which takes m / M from the energy of each, 2e-3 at most.
    few = np.concatenate([np.flatnonzero(scene.species == k)[:8] for k in (0, 1)])
    frames = list(sim.sample(every=2.0, count=400))
    velocities = np.array([frame.velocities[few] for frame in frames])
    masses = scene.masses[few]
    data = pv.data.SimulationData(
        units=units_of(pv),
        ensemble=pv.data.EnsembleData("NVT", natoms=len(few), volume=1.0, temperature=863.0 / 864.0),
        system=pv.data.SystemData(
            natoms=len(few), nconstraints=0, ndof_reduction_tra=0, ndof_reduction_rot=0, mass=masses,
            molecule_idx=np.arange(len(few)), nconstraints_per_molecule=np.zeros(len(few)),
        ),
        observables=pv.data.ObservableData(
            kinetic_energy=0.5 * np.sum(masses[:, None] * velocities**2, axis=(1, 2))
        ),
        trajectory=pv.data.TrajectoryData(np.array([f.positions[few] for f in frames]), velocities),
    )  # fmt: skip
    found = pv.kinetic_energy.equipartition(
        data, molec_groups=[list(range(8)), list(range(8, 16))], verbosity=0, bootstrap_seed=1
    )
    print(found)
    deviations = np.array([each for each in found if np.isfinite(each).all()])
    assert len(deviations) >= 3  # all, the heavy and the light ones
    assert (np.abs(deviations) < 4.0).all()  # standard errors
