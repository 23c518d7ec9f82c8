"""Try that each extra does what docs/quickstart.md says of it: ``python tests/extras.py [EXTRA ...]``.

Each has an environment of its own, which the plain install and ``pip install ".[EXTRA]"`` have made. What
asks for an extra is also tried without it: one sentence must say what to install. Run by ``.ci/run``.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from helpers.links import dead_links

ROOT = Path(__file__).parents[1]

LIMIT = 1800
"""Seconds after which a line is ended, and fails with exit code 124."""

SMALL = "--n 108 --equilibration 5 --collisions-per-particle 20"
STUDY = f"carom eos --eta 0.2 --replicas 2 {SMALL} --no-pictures"
GSD = "carom export small fluid.gsd"
MOVIE = "carom movie small fluid.mp4"
FREUD = "python -c 'import carom; carom.io.read(\"small/trajectory.h5md\").to_freud()[0].volume'"


class Extra(NamedTuple):
    """Lines of Bash for a folder that has the run ``small``; ``$ROOT`` is the checkout."""

    lines: tuple[str, ...]
    """What must work."""
    without: str = ""
    """What must say what to install, without the extra."""
    also: str = ""
    """What is installed besides: the program that the extra talks to, or the one that uses it."""


EXTRAS = {
    "gsd": Extra((GSD, "carom info fluid.gsd"), without=GSD),
    "freud": Extra((FREUD,), without=FREUD),
    "movie": Extra((MOVIE,), without=MOVIE),
    "dask": Extra(
        (
            "dask scheduler --host 127.0.0.1 --port 0 --no-dashboard --scheduler-file head.json & "
            "dask worker --scheduler-file head.json --nworkers 2 --nthreads 1 --no-dashboard & "
            "trap 'kill $(jobs -p)' EXIT; until [[ -s head.json ]]; do sleep 0.1; done; "
            f"{STUDY} --out eos --scheduler "
            "$(python -c 'import json; print(json.load(open(\"head.json\"))[\"address\"])')",
        ),
        without=f"{STUDY} --out eos --scheduler tcp://127.0.0.1:9",
    ),
    "mpi": Extra(
        (f"mpiexec --oversubscribe --allow-run-as-root -n 3 python -m mpi4py.futures -m {STUDY} --out eos",),
        without=f"{STUDY} --out eos --engine mpi",
        also="openmpi",
    ),
    "beside": Extra(
        (
            "cd $ROOT && pytest -n 0 -q -m slow --needing physical-validation,transport-analysis "
            "tests/validation",
        ),
        also=".[test]",
    ),
    "docs": Extra(("cd $ROOT && sphinx-build -W --keep-going -q -t stored -b html docs $OUT/html",)),
    "dev": Extra(
        (
            "cd $ROOT && ruff check .",
            "cd $ROOT && ruff format --check .",
            "cd $ROOT && mypy",
            "cd $ROOT && mypy --strict --follow-imports=silent tests/project/typed_lines.py",
            # Whether examples name what is there; the default tests run the quick ones.
            "cd $ROOT && mypy --follow-imports=silent "
            "--disable-error-code={var-annotated,union-attr,dict-item,arg-type,list-item} examples",
            "cd $ROOT && lint-imports --no-cache",
        )
    ),
}  # fmt: skip


def folder_of(environment: Path) -> Path:
    """Return where the programs of an environment are."""
    return environment / ("Scripts" if os.name == "nt" else "bin")


def pip(environment: Path, *words: str) -> None:
    """Install packages; those of the checkout by what the docs say."""
    command = [folder_of(environment) / "python", "-m", "pip", "install", "--quiet", *words]
    subprocess.run(command, cwd=ROOT, check=True, timeout=LIMIT)


def tried(line: str, environment: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a line with the programs of an environment alone in front."""
    path = os.pathsep.join([str(folder_of(environment)), os.environ["PATH"]])
    variables = {**os.environ, "PATH": path, "ROOT": str(ROOT), "OUT": str(folder)}
    return subprocess.run(
        ["timeout", str(LIMIT), "bash", "-c", line], cwd=folder, env=variables, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


def failure(name: str, plain: Path, small: Path, folder: Path) -> str:
    """Return what is wrong with an extra; nothing where all is well."""
    extra = EXTRAS[name]
    folder.mkdir()
    shutil.copytree(small, folder / "small")
    if extra.without:
        done = tried(extra.without, plain, folder)
        if done.returncode == 0 or f"carom[{name}]" not in done.stdout or ".tmp" in done.stdout:
            return f"without it: {extra.without}\n{done.stdout}"
    environment = folder / "venv"
    shutil.copytree(plain, environment, symlinks=True, copy_function=os.link)
    pip(environment, f".[{name}]", *extra.also.split())
    for line in extra.lines:
        done = tried(line, environment, folder)
        if done.returncode:
            return f"{line}\n{done.stdout}(exit code {done.returncode})"
    if name == "docs" and (dead := dead_links(folder / "html")):
        return f"dead links: {dead}"
    return ""


def main() -> None:
    """Try the extras that the command line names, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("extras", nargs="*", choices=[[], *EXTRAS], metavar="EXTRA", help=", ".join(EXTRAS))
    names = parser.parse_args().extras or list(EXTRAS)
    with tempfile.TemporaryDirectory() as work, ThreadPoolExecutor(2) as pool:
        folder = Path(work)
        venv.create(folder / "plain", with_pip=True)
        pip(folder / "plain", ".")
        run = tried(f"carom run {SMALL} --frames 2 --no-pictures --out small", folder / "plain", folder)
        assert run.returncode == 0, run.stdout

        def look(name: str) -> bool:
            begin = time.monotonic()
            wrong = failure(name, folder / "plain", folder / "small", folder / name)
            print(f"{name}: {wrong or 'does what it says'} ({time.monotonic() - begin:.0f} s)", flush=True)
            return bool(wrong)

        failed = sum(pool.map(look, names))
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
