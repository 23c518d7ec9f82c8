"""Make a release: set the version, run all checks, build the files, and tell what is left to type.

    python tests/release.py 0.2.0             # in a clean checkout; about two hours
    python tests/release.py 0.2.0 --dry-run   # says what it would do

It stops at the first check that fails. It neither tags nor publishes.
"""

import argparse
import datetime
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PLACES = {
    "src/carom/version.py": r'(__version__ = ")[^"]+',
    "CITATION.cff": r"(?m)(^version: ).+$",
    "docs/packaging/codemeta.json": r'(?m)(^  "version": ")[^"]+',
    "docs/packaging/conda/meta.yaml": r'({% set version = ")[^"]+',
}
"""Where the version stands; ``tests/project/test_metadata.py`` compares them."""
PYTHON = sys.executable
CHECKS = (
    "bash .ci/run",
    f"{PYTHON} -m pytest -m slow",
    f"{PYTHON} -m pytest -m slow -n 0 tests/project/test_docs_browser.py",
    f"{PYTHON} -m pip install --quiet cffconvert build",
    "cffconvert --validate",
    "git diff --exit-code HEAD",  # what was built was committed
    f"{PYTHON} -m build --outdir dist",
)


def with_version(text: str, pattern: str, version: str) -> str:
    """Return a file's text with a version in the one place that a pattern finds."""
    found, count = re.subn(pattern, lambda match: match[1] + version, text)
    if count != 1:
        raise SystemExit(f"Found {count} places for the version by {pattern!r}, expected one.")
    return found


def dated(text: str, version: str, date: str) -> str:
    """Return the changelog with the number and the date of the top section."""
    top = re.search(r"(?m)^## .+$", text)
    again = f"## [{version}] - "  # after a check that failed
    if top is None or not (top[0].endswith("unreleased") or top[0].startswith(again)):
        raise SystemExit("CHANGELOG.md must begin with a section that ends with 'unreleased'.")
    return f"{text[: top.start()]}## [{version}] - {date}{text[top.end() :]}"


def changed(version: str, date: str, root: Path = ROOT) -> dict[Path, str]:
    """Return the new texts of all files that name the version."""
    texts = {
        root / name: with_version(root.joinpath(name).read_text(encoding="utf-8"), pattern, version)
        for name, pattern in PLACES.items()
    }
    log = root / "CHANGELOG.md"
    return {**texts, log: dated(log.read_text(encoding="utf-8"), version, date)}


def main() -> None:
    """Make the release that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("version", help="such as 0.2.0")
    parser.add_argument("--dry-run", action="store_true", help="change and run nothing")
    args = parser.parse_args()
    if not re.fullmatch(r"\d+\.\d+\.\d+", args.version):
        parser.error(f"a version is three numbers such as 0.2.0, found {args.version!r}")
    texts = changed(args.version, datetime.date.today().isoformat())
    steps = [f"git diff --quiet HEAD || git commit -am 'Version {args.version}'", *CHECKS]
    print(f"{args.version} into {', '.join(str(path.relative_to(ROOT)) for path in texts)}", flush=True)
    if not args.dry_run:
        if subprocess.run(["git", "status", "--porcelain"], cwd=ROOT, capture_output=True, check=True).stdout:
            raise SystemExit("The checkout has changes; commit them first.")
        for path, text in texts.items():
            path.write_text(text, encoding="utf-8")
    for step in steps:
        print(f"$ {step}", flush=True)
        if not args.dry_run and subprocess.run(step, shell=True, cwd=ROOT).returncode:
            raise SystemExit(f"This failed: {step}. Nothing is tagged or published.")
    print(f"Left to you: git tag v{args.version} && git push --tags")
    print(f"             twine upload dist/carom-{args.version}*, and the conda recipe")


if __name__ == "__main__":
    main()
