"""All that a study of one's own imports: ``from carom.studies import own``.

A study is a specification, whose fields have checks and help; a function ``measure`` of a task; and a table
of the results. The page on studies of one's own shows one.
"""

from __future__ import annotations

from typing import Any

from carom.declared import Opt, integer, number, several, word
from carom.spec import Spec, integers_of, numbers_of
from carom.studies.folder import Record, Task, stream
from carom.studies.job import Job, Look
from carom.studies.signatures import documented
from carom.studies.study import Study
from carom.table import Column, Table, error, facts
from carom.version import __version__ as version

__all__ = [
    "Column", "Job", "Look", "Opt", "Record", "Spec", "Study", "Table", "Task", "command", "documented",
    "error", "facts", "integer", "integers_of", "number", "numbers_of", "several", "stream", "version",
    "word",
]  # fmt: skip


def command(kind: type[Study[Any]]) -> None:
    """Run the command line of a study: its options are the fields of its specification.

    Parameters
    ----------
    kind : type
        The study.
    """
    from carom.cli import study

    study.command(kind)
