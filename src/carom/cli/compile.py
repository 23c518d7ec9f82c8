"""The command ``carom compile``: what runs need is compiled before they start."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
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
    the nodes of a cluster; NUMBA_CACHE_DIR says where the code is kept. A kind is a dimension, what the scene
    has, and its neighbors: sectors where it is dilute, lists where it is dense. Other numbers are no other
    kind. Processes that need the same kind wait for the first of them.

    [bold]Examples[/bold]

    carom compile
    carom compile bed.toml mixture.toml
    NUMBA_CACHE_DIR=/shared/carom carom compile
    """
    import tempfile

    from carom.cli.compiling import compiling_told
    from carom.cli.screen import watched

    works: list[Work] = [(path.name, partial(_run, path)) for path in scenes] if scenes else _usual()
    with watched() as progress, compiling_told(), tempfile.TemporaryDirectory() as folder:
        for k, (name, work) in enumerate(works):
            progress(k / len(works), name)
            work(Path(folder) / f"{k}")
    print(f"Compiled: {', '.join(name for name, _ in works)}.")


BRIEFLY: dict[str, Any] = {
    "equilibration": 1.0, "collisions_per_particle": 2.0, "frames": 2, "pictures": False,
}  # fmt: skip

Work = tuple[str, Callable[[Path], object]]


def _usual() -> list[Work]:
    """Return what compiles for all commands: disks and spheres, with sectors and with lists."""
    works: list[Work] = []
    for d, name, dense in ((2, "disks", 0.6), (3, "spheres", 0.45)):
        works += [
            (f"thin {name}", partial(_fluid, 0.1, d)),
            (f"dense {name}", partial(_fluid, dense, d)),
            (f"transport of {name}", partial(_transport, d)),
            (f"packings of {name}", partial(_packing, d)),
        ]
    return works


def _run(scene: Any, out: Path) -> None:
    """Run a scene, or a scene file, as briefly as can be."""
    import carom

    carom.run(scene, out, **BRIEFLY)


def _fluid(packing_fraction: float, dimension: int, out: Path) -> None:
    from carom.scene.scene import Scene

    _run(Scene.random(300, packing_fraction, dimension), out)


def _transport(dimension: int, out: Path) -> None:
    import carom

    carom.transport(
        [0.2], n=64, dimension=dimension, equilibration=1.0, replicas=1, collisions_per_particle=20.0,
        blocks=16, executor="serial",
    )  # fmt: skip


def _packing(dimension: int, out: Path) -> None:
    import carom

    carom.pack(64, dimension=dimension, until_Z=1e3)
