"""Examples run while the documentation is built; what they made is kept until they or Carom change.

An example of ``AT_FULL_SIZE`` runs as a reader would run it, any other with ``--smoke``. The gallery then
also shows the stored pictures of its full size (``pictures.py``). Results are in ``docs/_build/examples``.
The name of their folder is a digest of the example, of Carom's sources and of Numba's and NumPy's versions.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numba
import numpy
from pictures import ROOT, executed

import carom

KEPT = ROOT / "docs" / "_build" / "examples"
AT_FULL_SIZE = frozenset(
    {
        "bad_input_tour",
        "crystal",
        "cushions_160",
        "disks_27",
        "export_ovito_ase",
        "fluid_in_ten_lines",
        "four_balls",
        "rdf_mdanalysis",
        "restart",
    }
)
"""Examples that take less than half a minute of CPU time at full size, without compilation."""
WORKERS = min(4, os.cpu_count() or 1)
PRINTED = "printed.txt"

Report = Callable[[str], object]


class Result(NamedTuple):
    """What a run of an example made.

    Parameters
    ----------
    pictures : list of Path
        Its pictures.
    printed : str
        Its output.
    full : bool
        Whether it ran at full size.
    """

    pictures: list[Path]
    printed: str
    full: bool


def package_digest() -> str:
    """Return a digest of all that examples depend on but themselves."""
    digest = hashlib.sha256(f"{numba.__version__} {numpy.__version__}".encode())
    package = Path(carom.__file__).parent
    for path in sorted([*package.rglob("*"), *(ROOT / "examples" / "data").glob("*")]):
        if path.is_file() and "__pycache__" not in path.parts:
            digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def result_of(script: Path, package: str, kept: Path = KEPT, report: Report = print) -> Result:
    """Return what an example makes with the present Carom; run it if that is not known.

    Parameters
    ----------
    script : Path
        The example.
    package : str
        From :func:`package_digest`.
    kept : Path
        The folder of all results.
    report : callable
        Called with a line before the example runs.

    Raises
    ------
    Failed
        If the example ends with an error.
    """
    full = script.stem in AT_FULL_SIZE
    digest = hashlib.sha256(f"{package} {full} ".encode() + script.read_bytes()).hexdigest()[:16]
    folder = kept / f"{script.stem}-{digest}"
    if not folder.exists():
        report(f"running examples/{script.name}{'' if full else ' --smoke'}")
        _run(script, full, folder)
    pictures = sorted(path for path in folder.iterdir() if path.name != PRINTED)
    return Result(pictures, folder.joinpath(PRINTED).read_text(encoding="utf-8"), full)


def _run(script: Path, full: bool, folder: Path) -> None:
    """Run an example and move what it made into a folder of its own, complete or not at all."""
    part = folder.with_name(f"{folder.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    made, printed = executed(script, part / "run", *(() if full else ("--smoke",)))
    for name, path in made.items():
        shutil.move(path, part / name)
    shutil.rmtree(part / "run")
    part.joinpath(PRINTED).write_text(printed, encoding="utf-8")
    for old in folder.parent.glob(f"{script.stem}-{'?' * 16}"):
        shutil.rmtree(old)
    part.rename(folder)


def results(scripts: list[Path], report: Report = print) -> dict[str, Result]:
    """Return what every example makes, by its name. Several run at a time."""
    package = package_digest()
    with ThreadPoolExecutor(WORKERS) as pool:
        made = pool.map(lambda script: result_of(script, package, KEPT, report), scripts)
        return {script.stem: result for script, result in zip(scripts, made, strict=True)}
