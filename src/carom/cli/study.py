"""The command of any study: its options follow from the fields of its specification."""

from __future__ import annotations

import contextlib
import functools
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from carom.cli.heartbeat import quiet, say
from carom.cli.options import Json, Quiet, argument, number_of, of_fields, option, shared, takes
from carom.cli.suggestions import Command
from carom.cli.trouble import PARTLY, started
from carom.texts import typed, visible

if TYPE_CHECKING:
    from carom.spec import Spec
    from carom.studies.folder import Folder
    from carom.studies.study import Study

WHERE, OUTPUT = "Where it runs", "What to write"

FILES = (".json", ".csv", ".txt", ".html", ".png", ".pdf", ".svg")
"""Suffixes of files, which no new folder has."""


def command_of(name: str, asked: type[Spec], kind: Callable[[], Any]) -> Callable[..., None]:
    """Return the command of a study, with the options of ``asked``; ``kind`` imports its class late."""

    def run(
        study: Path | None, out: Path, report: bool, pictures: bool, as_json: bool, quiet: bool = False,
        engine: str | None = None, scheduler: str | None = None, cores: str | None = None, **given: Any,
    ) -> None:  # fmt: skip
        from carom.declared import of_options
        from carom.errors import InputError

        if engine is not None and scheduler is not None:
            raise InputError("--engine and --scheduler contradict each other; give one of them.")
        refuse_folder(out, name, asked)  # first: to check a scene may compile for seconds
        carry_out(
            kind()(asked.of(study, of_options(asked, given))), out, executor=scheduler or engine, cores=cores,
            report=report, pictures=pictures, as_json=as_json,
        )  # fmt: skip

    run.__doc__ = asked.about
    places = {
        "engine": "processes, threads, serial or mpi.",
        "cores": "Number of processes or threads; default one per core.",
        "scheduler": "Address of a Dask scheduler, e.g. tcp://host:8786.",
    }
    where = [option(name, str, None, help=said, panel=WHERE) for name, said in places.items()]
    return takes(
        argument("study", asked.argument, asked.argument_name),
        option("out", Path, Path(f"carom-{name}"),
               help="Folder for the results; the same study continues there."),
        *of_fields(asked),
        *(() if asked.serial else where),
        option("report", bool, False, "--report", help="A page with tables and pictures: report.html.",
               panel=OUTPUT),
        option("pictures", bool, True, "--pictures/--no-pictures", help=f"{name}.png.", panel=OUTPUT),
        shared("as_json", Json),
        shared("quiet", Quiet),
    )(run)  # fmt: skip


def carry_out(
    study: Study[Any],
    out: Path,
    *,
    executor: str | None,
    cores: str | None,
    report: bool,
    pictures: bool,
    as_json: bool,
) -> None:
    """Run a study in a folder, print and write its results, and exit with its code."""
    from carom.studies.folder import Folder
    from carom.studies.signals import Interrupted

    def tell(known: Study[Any]) -> None:
        # Results are printed before files are written, because a full disk may refuse the files.
        show(known, as_json)
        with Folder(out).owned(*known.files()):
            write(known, out, report=report, pictures=pictures)

    described = functools.cache(lambda: describe(study, out))
    reserve(study, out)
    try:
        with watched(study.first) as (bar, look):

            def progress(fraction: float, text: str) -> None:
                described()  # before the first task, and after the folder was found to be free
                bar(fraction, text)

            study = study.run(
                executor=executor, cores=number_of(cores), out=out, progress=progress, look=look
            )
    except Interrupted as stopped:
        if study.anytime and stopped.so_far.records:
            tell(stopped.so_far)
        raise
    tell(study)
    if not as_json:
        print(visible(f"Results in {out}" + (f"; open {out / 'report.html'}" if report else "")))
        if type(study).__module__.startswith("carom."):  # one of one's own is known to its program alone
            print(visible(typed("Look: carom view", out)))
    finish(study, Folder(out))


def command(kind: type[Study[Any]]) -> None:
    """Run the command line of a study of one's own: its options are the fields of its specification."""
    app = typer.Typer(
        add_completion=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
        pretty_exceptions_show_locals=False,
    )
    app.command(kind.name, cls=Command)(command_of(kind.name, kind.Spec, lambda: kind))
    started(app)


def finish(study: Study[Any], folder: Folder) -> None:
    """Exit with a code of its own if points are missing, flagged, or not in the ``folder``."""
    if not study.complete:
        say(f"Note: {study.progress} are done; the same command tries the rest again.")
    kept = all(folder.result(record["task"]).exists() for record in study.records)
    if not (study.complete and kept) or any(map(study.table.flagged, study.table)):
        raise typer.Exit(PARTLY)


def refuse_folder(out: Path, name: str, asked: type[Spec]) -> None:
    """Refuse a folder for a study that holds other results, and a file; change nothing."""
    from carom.errors import FileError
    from carom.studies.folder import Folder

    if out.suffix in FILES and not out.is_dir():
        raise FileError(f"--out is a folder, in which {name} writes its files; found the file {out}.")
    Folder(out).check_study(asked.study)


def reserve(study: Study[Any], out: Path) -> None:
    """Refuse a folder where :func:`write` would replace files of the user, or mix results; change nothing."""
    from carom.errors import FileError
    from carom.studies import result_folders
    from carom.studies.folder import SETTINGS

    refuse_folder(out, study.name, type(study.spec))
    if not (out / SETTINGS).exists():
        names = (*study.files(), "report.html")
        result_folders.refuse_to_replace([out / name for name in names], "a study")
    file = out / "study.toml"
    if file.exists() and result_folders.of_the_user(file) and not _describes(file, study.spec):
        raise FileError(
            f"{file} was written or annotated by somebody and describes another study, so it was left as it "
            "is; choose another folder with --out, or move the file."
        )


def _describes(file: Path, spec: Any) -> bool:
    """Return whether the file of a study describes just this one."""
    from carom.errors import CaromError

    try:
        return bool(type(spec).load(file) == spec)
    except CaromError:
        return False


def describe(study: Study[Any], out: Path) -> None:
    """Write what is asked for to study.toml in a folder."""
    from carom.paths import write_text
    from carom.studies.result_folders import title

    file = out / "study.toml"
    if not _describes(file, study.spec):  # the user's own, with its comments
        write_text(file, f"{title(study.command)}\n\n{study.spec.to_toml()}")


def write(study: Study[Any], out: Path, *, report: bool, pictures: bool) -> None:
    """Write the table of a study and its pictures to a folder."""
    for name, save in study.files().items():
        if pictures or not name.endswith(".png"):
            save(out / name)
    if report:
        study.report(out / "report.html")


def show(study: Study[Any], as_json: bool) -> None:
    """Print the results on standard output."""
    if as_json:
        print(json.dumps(study.to_dict(), indent=2, allow_nan=False))
    else:
        from carom.cli.tables import Screen

        console = Screen()
        for table in study.printed():
            console.print(table.rich(console))
        for sentence in study.sentences():
            console.print(sentence)
    sys.stdout.flush()


@contextlib.contextmanager
def watched(first: str) -> Iterator[tuple[Callable[[float, str], None], Callable[[Any], None] | None]]:
    """Show a bar and the table so far while the body runs; without a terminal, print a line now and then."""
    from carom.cli import screen

    if quiet() or not sys.stderr.isatty():
        said = f"Compiling if need be, and {first}"
        with screen.watched(said) as line:
            yield (lambda fraction, text: line(fraction, text if fraction else said)), None
        return
    from rich.console import Group
    from rich.live import Live
    from rich.progress import Progress

    from carom.cli.tables import Screen
    from carom.notebook import advance

    bar = Progress(*screen.columns())
    # The bar moves to and fro until the first task is done, because the total time is not known before.
    bar.add_task(f"{first[0].upper()}{first[1:]}", total=None)
    with Live(bar, console=Screen(stderr=True), transient=True, refresh_per_second=4) as live:

        def progress(fraction: float, text: str) -> None:
            if fraction:
                advance(bar, fraction, text)

        def look(study: Any) -> None:
            # The bar is above: of a table that is longer than the screen, the end is cut off.
            live.update(Group(bar, study.table.rich(live.console)) if study.records else bar)

        yield progress, look
