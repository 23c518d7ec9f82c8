"""Tables that benchmarks write into pages, each between two marks, and the processor that they ran on."""

import platform
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def with_table(text: str, name: str, table: str) -> str:
    """Return a page with another table where that of the benchmark ``name`` is."""
    begin, end = f"<!-- {name}: written by tests/benchmarks/{name}.py -->", f"<!-- end of {name} -->"
    before, _, rest = text.partition(begin)
    _, _, after = rest.partition(end)
    return f"{before}{begin}\n{table}\n{end}{after}"


def write_table(page: Path, name: str, table: str) -> None:
    """Replace the table of a benchmark in a page."""
    page.write_text(with_table(page.read_text(encoding="utf-8"), name, table), encoding="utf-8")


def processor() -> str:
    """Return the kind of processor."""
    info = Path("/proc/cpuinfo")
    found = re.search(r"model name\s*:\s*(.+)", info.read_text()) if info.exists() else None
    return re.sub(r"\((R|TM)\)", "", found[1]).strip() if found else platform.processor()
