"""Files of other programs that ASE and MDAnalysis read.

The readers of XTC and TRR are those of MDAnalysis below its trajectories, which would leave files with
offsets beside what they read.
"""

from __future__ import annotations

import dataclasses
import itertools
import tempfile
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from carom.io.foreign_source import UNENDED, RawFrame, Source, text_of
from carom.io.formats import foreign_format_of

if TYPE_CHECKING:
    import ase


class OfAse(Source):
    """What ASE reads: CIF, in which symmetries fill a crystal, and POSCAR, CONTCAR and XDATCAR of VASP."""

    units = "angstrom"
    ordered = True

    def __init__(self, path: Path):
        import ase.io

        super().__init__(path)
        last = text_of(path)[1].split()[-1:]
        if last and last[0][0] in "+-.0123456789":
            raise ValueError(UNENDED)
        form = {"CIF": "cif", "POSCAR": "vasp", "XDATCAR": "vasp-xdatcar"}[foreign_format_of(path) or ""]
        self._atoms: Any = ase.io.read(path, index=":", format=form)

    def __len__(self) -> int:
        return len(self._atoms)

    def read(self, k: int) -> RawFrame:
        """Return frame k."""
        atoms: ase.Atoms = self._atoms[k]
        time = atoms.info.get("time")
        return RawFrame(
            atoms.positions, atoms.cell[:], None, tuple(bool(flag) for flag in atoms.pbc),
            velocities=atoms.get_velocities() if atoms.has("momenta") else None,
            masses=atoms.get_masses(), kinds=np.array(atoms.get_chemical_symbols()),
            time=float(time) if isinstance(time, int | float) else None,
        )  # fmt: skip


class Traj(OfAse):
    """ASE's own trajectory, a frame at a time."""

    def __init__(self, path: Path):
        from ase.io.trajectory import TrajectoryReader

        Source.__init__(self, path)
        self._atoms = TrajectoryReader(str(path))

    def close(self) -> None:
        """Close the file."""
        self._atoms.close()


class _OfMDAnalysis(Source):
    """What MDAnalysis reads: float32."""

    units = "angstrom"
    ordered = True
    _box: np.ndarray | None = None

    def __init__(self, path: Path):
        import MDAnalysis  # noqa: F401  (whose import sets filters of warnings)

        super().__init__(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._frames = self._trajectory()

    def _trajectory(self) -> Any:
        raise NotImplementedError

    def __len__(self) -> int:
        return len(self._frames)

    def read(self, k: int) -> RawFrame:
        """Return frame k."""
        from MDAnalysis.lib.mdamath import triclinic_vectors

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            step = self._frames[k]
        box = self._box if step.dimensions is None else step.dimensions
        cell = None if box is None else triclinic_vectors(box).astype(np.float64)
        return RawFrame(step.positions, cell, kinds=self._kinds(), time=float(step.time))

    def _kinds(self) -> np.ndarray | None:
        return None

    def close(self) -> None:
        """Close the file."""
        self._frames.close()


class Pdb(_OfMDAnalysis):
    """PDB, a frame a model; species are elements where all atoms have one, or else names."""

    def _trajectory(self) -> Any:
        import MDAnalysis

        lines, rest = text_of(self.path)
        # Columns say whether the last atom is whole; what stands behind the atoms is not read.
        if rest and len(rest) < 54 and not rest.startswith(("END", "TER", "MASTER", "CONECT")):
            raise ValueError("its last line ends before the coordinates do")
        with tempfile.TemporaryDirectory() as folder:  # MDAnalysis unpacks no .xz
            path = self.path
            if path.suffix.lower() == ".xz":
                path = Path(folder, "a.pdb")
                path.write_text("\n".join([*lines, rest]))
            self._world = MDAnalysis.Universe(str(path), topology_format="PDB", format="PDB")
        for line in lines:  # MDAnalysis passes over a box before the first MODEL
            if line.startswith("CRYST1"):
                edges = [float(line[m:n]) for m, n in itertools.pairwise((6, 15, 24, 33, 40, 47, 54))]
                self._box = None if edges[:3] == [1.0] * 3 else np.array(edges)  # which stands for none
                break
        return self._world.trajectory

    def read(self, k: int) -> RawFrame:
        """Return frame k, which has no time: that of MDAnalysis is its number."""
        return dataclasses.replace(super().read(k), time=None)

    def _kinds(self) -> np.ndarray:
        elements = getattr(self._world.atoms, "elements", None)
        return np.array(
            self._world.atoms.names if elements is None or "" in elements else elements, dtype=str
        )


class Dcd(_OfMDAnalysis):
    """DCD: positions and boxes alone."""

    def _trajectory(self) -> Any:
        from MDAnalysis.coordinates.DCD import DCDReader
        from MDAnalysis.lib.formats.libdcd import DCDFile

        with DCDFile(str(self.path)) as file:  # which fails without a trace on the screen
            found = len(file)
        start = self.path.open("rb").read(12)
        order: Literal["little", "big"] = "little" if start[0] == 84 else "big"
        if (count := int.from_bytes(start[8:12], order)) > found:  # 0 where the writer did not come back
            raise ValueError(f"it announces {count} frames and holds {found}")
        return DCDReader(str(self.path))


class Xtc(Source):
    """XTC and TRR of GROMACS."""

    units = "nm"
    ordered = True

    def __init__(self, path: Path):
        from MDAnalysis.lib.formats import libmdaxdr

        super().__init__(path)
        kind = libmdaxdr.TRRFile if path.suffix.lower() == ".trr" else libmdaxdr.XTCFile
        self._file = kind(str(path))

    def __len__(self) -> int:
        return len(self._file)

    def read(self, k: int) -> RawFrame:
        """Return frame k."""
        self._file.seek(k)
        step = self._file.read()
        moving = getattr(step, "hasv", False)
        return RawFrame(
            np.array(step.x), np.array(step.box, dtype=np.float64),
            velocities=np.array(step.v) if moving else None, time=float(step.time),
        )  # fmt: skip

    def close(self) -> None:
        """Close the file."""
        self._file.close()
