"""The command ``carom compile``: what runs need is compiled before they start."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from carom.cli.options import Quiet
from carom.cli.trouble import friendly


@friendly
def compile_(
    scenes: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Scene files (TOML), or run folders. Without: disks and spheres of all commands."
        ),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Compile ahead what runs need.

    The first run of a kind of scene compiles for ten seconds or more. This does it now, for a container or
    the nodes of a cluster; NUMBA_CACHE_DIR says where the code is kept. Scenes with other numbers, densities
    or seeds are of the same kind.

    [bold]Examples[/bold]

    carom compile
    carom compile bed.toml mixture.toml
    NUMBA_CACHE_DIR=/shared/carom carom compile
    """
    import tempfile

    from carom.cli.compiling import compiling_told
    from carom.cli.screen import watched

    works = [*_of_scenes(scenes)] if scenes else [*_usual()]
    with watched() as progress, compiling_told(), tempfile.TemporaryDirectory() as folder:
        for k, (name, work) in enumerate(works):
            progress(name, k / len(works))
            work(Path(folder) / f"{k}")
    print(f"Compiled: {', '.join(name for name, _ in works)}.")


BRIEFLY: dict[str, Any] = {
    "equilibration": 1.0, "collisions_per_particle": 2.0, "frames": 2, "pictures": False,
}  # fmt: skip

Work = tuple[str, Callable[[Path], object]]


def _of_scenes(scenes: list[Path]) -> Iterator[Work]:
    """Return what compiles for each scene file: a run as brief as can be."""
    import carom

    for path in scenes:
        yield path.name, lambda out, path=path: carom.run(path, out, **BRIEFLY)  # type: ignore[misc]


def _usual() -> Iterator[Work]:
    """Return what compiles for all commands: disks and spheres, with sectors and with lists."""
    import carom

    for d, name, dense in ((2, "disks", 0.6), (3, "spheres", 0.45)):
        for density, eta in (("thin", 0.1), ("dense", dense)):
            scene = carom.Scene.random(300, eta, d)
            yield f"{density} {name}", lambda out, scene=scene: carom.run(scene, out, **BRIEFLY)  # type: ignore[misc]
        brief: dict[str, Any] = {"n": 64, "dimension": d, "equilibration": 1.0, "replicas": 1}
        yield (
            f"transport of {name}",
            lambda out, brief=brief: carom.transport(  # type: ignore[misc]
                [0.2], **brief, collisions_per_particle=20.0, blocks=16, executor="serial"
            ),
        )
        yield f"packings of {name}", lambda out, d=d: carom.pack(64, dimension=d, until_Z=1e3)  # type: ignore[misc]
