"""The command ``carom pack``: one packing, or a study of several seeds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from carom.cli.options import GoOn, Json, Quiet, argument, of_fields, option, shared, takes
from carom.cli.study import carry_out
from carom.declared import of_options
from carom.studies.packings.spec import SEEDS, PackSpec


@takes(
    argument("scene", r"Scene file (TOML): \[scene] and \[pack]. Without: random points."),
    option("out", Path, Path("carom-pack"), help="Folder for the results."),
    shared("as_json", Json),
    shared("quiet", Quiet),
    option("overwrite", bool, False, "--overwrite", help="Replace the packing in the folder."),
    shared("go_on", GoOn),
    *of_fields(PackSpec),
    option("cores", str, None, help="Number of processes; default one per core.", panel=SEEDS),
    option("report", bool, False, "--report", help="A page with tables and pictures: report.html.",
           panel=SEEDS),
)  # fmt: skip
def pack(
    scene: Path | None, out: Path, as_json: bool, overwrite: bool, go_on: bool, cores: str | None,
    report: bool, quiet: bool = False, **given: Any,
) -> None:  # fmt: skip
    """Compress particles until they jam.

    Points grow into spheres, or the spheres of a scene grow. The folder then holds packing.h5md,
    packing.extxyz, history.csv, summary.json, and pictures. Ctrl-C stops at once; `carom resume` continues
    it.

    With --seeds it holds a folder for each packing, pack.csv and pack.png. The same command continues a study
    that was stopped, and adds packings to it.

    [bold]Examples[/bold]

    carom pack
    carom pack --n 2000 -d 2 --rate 0.01 --out disks --resume
    carom pack --dimension 2 --species 500:1 --species 500:1.4 --out mixture
    carom pack --n 500 --stage 0.02:1e3 --stage 3e-4:1e12 --out isostatic
    carom pack scene.toml --out mine
    carom pack --n 27 --dimension 2 --rate 0.01 --collisions 100000 --out billiard
    carom pack --n 1000 --dimension 2 --rate 1e-3 --seeds 8 --report --out several
    """
    from carom.cli.results import show
    from carom.cli.screen import watched
    from carom.errors import InputError
    from carom.studies.packings.pack import asked_of, packed

    asked, start = asked_of(scene, of_options(PackSpec, given))
    if asked.seeds is not None:
        if overwrite:
            raise InputError("--overwrite is for one packing; a study of several goes on in its folder.")
        from carom.studies.packings.study import Packings

        carry_out(
            Packings(asked), out, executor=None, cores=cores, report=report, pictures=asked.pictures,
            as_json=as_json,
        )  # fmt: skip
        return
    if cores is not None or report:
        raise InputError(
            f"{'--report' if report else '--cores'} is for several packings; give --seeds, or leave it out."
        )
    if go_on and overwrite:
        raise InputError("--resume and --overwrite contradict each other; give one of them.")
    with watched() as progress:
        progress(0.0, "Preparing")
        found = packed(asked, start, out, overwrite, go_on, progress)
    show(found, out, as_json=as_json)
