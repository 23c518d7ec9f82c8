"""What packings ask for: one, or one for each of several seeds; the section ``[pack]``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from carom.declared import SEED, described, fields_of, integer, number, option, said, switch
from carom.errors import InputError
from carom.scene_file.commands import Beside
from carom.spec import tables_of
from carom.studies.grid import Neighbors

SYSTEM, LENGTH, SEEDS, OUTPUT = "The system", "How long", "Several packings", "What to write"


def _stages(value: Any, name: str) -> tuple[list[Any], ...]:
    """Check stages, each a rate and a Z."""
    from carom.studies.packings.compression import stages_of

    return tuple([stage.rate, stage.until_Z] for stage in stages_of(None, None, 1, value))


said(
    _stages, type="array", items={"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
)


def _stages_in(texts: Sequence[str]) -> list[list[float]]:
    """Return the stages that options name."""
    return [[*each.values()] for each in tables_of("--stage", "RATE:Z")(texts)]


def _species(value: Any, name: str) -> tuple[dict[str, Any], ...]:
    """Check species as [scene] does, and return them as a file has them."""
    from carom.scene_file import fields
    from carom.studies.scenes import plain

    return tuple(plain(fields.species(value, name), name))


@described
@dataclass(frozen=True)
class PackSpec(Beside):
    """How particles grow until they jam, and from which points, if not from the particles of a scene.

    Raises
    ------
    InputError
        If a value is out of range, or keys contradict each other.
    """

    study: ClassVar[str] = "packings"
    section: ClassVar[str] = "pack"
    or_file: ClassVar[str] = "n"
    grid: ClassVar[tuple[str, ...]] = ("seeds", "seed", "pictures")
    rivals: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("n", "species"), ("stages", "rate"), ("stages", "until_Z"),
    )  # fmt: skip

    n: int | None = option(
        integer(low=2), "Number of points; by default 1000, or that of the species.", SYSTEM
    )
    dimension: int = option(integer(low=1, high=12), "Dimension of space.", SYSTEM, default=3)
    seeds: int | None = option(
        integer(low=1, high=10**6), "Number of packings; by default one, from seed.", SEEDS
    )
    seed: int = option(
        SEED,
        "Seed of random numbers; each further packing has the next.",
        default=1,
    )
    packing_fraction: float | None = option(
        number(low=0.0), "Packing fraction of the start, instead of points.", SYSTEM
    )
    species: Sequence[Any] | None = option(
        _species,
        "Species of the points, each with a count or a fraction; as an option COUNT:DIAMETER, for each.",
        SYSTEM,
        read=tables_of("--species", "COUNT:DIAMETER"),
        many=True,
    )
    walls: bool = option(
        switch,
        "Whether the box has hard walls instead of periodic boundaries.",
        SYSTEM,
        ("--walls",),
        default=False,
    )
    rate: float | None = option(
        number(low=0.0),
        "Growth of the mean diameter over the thermal speed; by default 0.02 up to Z = 1e3, then 1e-3.",
        LENGTH,
    )
    until_Z: float | None = option(
        number(low=0.0),
        "Z = PV/NkT at the end; by default 1e10, if no number of collisions is given.",
        LENGTH,
    )
    stages: Sequence[Any] | None = option(
        _stages,
        "Instead of both: rate and Z of each stage, e.g. fast, then slow; as an option RATE:Z, for each.",
        LENGTH,
        ("--stage",),
        _stages_in,
        many=True,
    )
    collisions: int | None = option(integer(low=1), "Number of pair collisions after which to stop.", LENGTH)
    common: bool = option(
        switch,
        "Whether all diameters grow at one rate, not in proportion to size.",
        LENGTH,
        ("--common",),
        default=False,
    )
    neighbors: Neighbors = "auto"
    pictures: bool = option(
        switch, "Whether to draw PNG files.", OUTPUT, ("--pictures/--no-pictures",), default=True
    )

    def complete(self) -> None:
        """Check stages, and of several packings the start; errors are those of :class:`PackSpec`."""
        plan = self.plan
        if self.seeds is None:
            return
        if self.stages is not None and plan[-1].until_Z is None:
            raise InputError("Each of the stages of a study needs a Z at which it ends.")
        self.start(self.seed)

    @property
    def plan(self) -> tuple[Any, ...]:
        """The stages."""
        from carom.studies.packings.compression import stages_of

        return stages_of(self.rate, self.until_Z, self.collisions, self.stages)

    def start(self, seed: int) -> Any:
        """Return the points of a ``seed``, a Scene."""
        from carom.scene.species import Species
        from carom.studies.packings.compression import N, points

        species = [Species(**each) for each in self.species or ()]
        n = N if self.n is None and not (species and species[0].count is not None) else self.n
        fraction = self.packing_fraction or None
        return points(
            n, self.dimension, seed=seed, species=species or None, walls=self.walls, packing_fraction=fraction
        )

    def tasks(self) -> list[dict[str, Any]]:
        """Return the packings, by seed."""
        shared = self.settings()
        return [{**shared, "seed": seed} for seed in range(self.seed, self.seed + (self.seeds or 1))]

    @classmethod
    def of_task(cls, task: Mapping[str, Any]) -> Self:
        """Return what a ``task`` asks for: one packing."""
        return cls(**{name: task[name] for name in fields_of(cls) if name in task})
