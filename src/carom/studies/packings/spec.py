"""What a study of packings asks for: one packing for each seed; the section ``[pack]``."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from carom.errors import InputError
from carom.studies.spec import Opt, Spec, integer, number, word


@dataclass(frozen=True)
class PackSpec(Spec):
    """Packings of points that grow until they jam, one for each seed.

    Raises
    ------
    InputError
        If a value is out of range, or keys contradict each other.
    """

    study: ClassVar[str] = "packings"
    section: ClassVar[str] = "pack"
    what: ClassVar[str] = "a study of packings"
    grid: ClassVar[tuple[str, ...]] = ("seeds", "seed")
    rivals: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("n", "species"), ("stages", "rate"), ("stages", "until_Z"),
    )  # fmt: skip

    n: Annotated[
        int | None, integer(low=2), Opt("Number of points; by default 1000, or that of the species.")
    ] = None
    dimension: Annotated[int, integer(low=1, high=12), Opt("Dimension of space.")] = 3
    seeds: Annotated[int, integer(low=1, high=10**6), Opt("Number of packings.")] = 8
    seed: Annotated[int, integer(low=0), Opt("Seed of the first packing; each further one has the next.")] = 1
    packing_fraction: Annotated[float | None, None, Opt("Of the start, instead of points.")] = None
    species: Annotated[
        Sequence[Any] | None, None, Opt("Species of the points, each with a ``count`` or a ``fraction``.")
    ] = None
    walls: Annotated[bool, None, Opt("Whether the box has hard walls instead of periodic boundaries.")] = (
        False
    )
    rate: Annotated[
        float | None,
        None,
        Opt(
            "Growth rate of the mean diameter over the thermal speed. By default it is 0.02 up to Z = 1e3, "
            "then 1e-3."
        ),
    ] = None
    until_Z: Annotated[
        float | None,
        None,
        Opt("Z = PV / NkT to reach; by default 1e10, if no number of collisions is given."),
    ] = None
    stages: Annotated[
        Sequence[Any] | None,
        None,
        Opt("Stages (rate, until_Z) instead of one rate and Z, e.g. fast, then slow."),
    ] = None
    collisions: Annotated[
        int | None, integer(low=1), Opt("Number of pair collisions after which each compression ends.")
    ] = None
    common: Annotated[
        bool, None, Opt("Whether all diameters grow at one rate, instead of in proportion to themselves.")
    ] = False
    neighbors: Annotated[
        str, word("auto", "lists", "sectors", "all"), Opt("How pairs are found: auto, lists, sectors or all.")
    ] = "auto"

    def complete(self) -> None:
        """Check the stages and the start, rather than in a worker an hour later.

        Raises
        ------
        InputError
            If they cannot be used.
        """
        from carom import checks
        from carom.scene.species import listed
        from carom.studies.packings.compression import stages_of

        for name in ("walls", "common"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(
                    f"{name} must be true or false, found {checks.describe(getattr(self, name))}."
                )
        for name in ("rate", "until_Z", "packing_fraction"):
            if (value := getattr(self, name)) is not None:
                self._put(name, number(low=0.0)(value, name))
        plan = stages_of(self.rate, self.until_Z, self.collisions, self.stages)
        if self.stages is not None:
            if plan[-1].until_Z is None:
                raise InputError("Each of the stages of a study needs a Z at which it ends.")
            self._put("stages", tuple([stage.rate, stage.until_Z] for stage in plan))
        if self.species is not None:
            self._put("species", tuple(map(_table, listed(self.species, "species"))))
        self.start(self.seed)

    def start(self, seed: int) -> Any:
        """Return the points of a ``seed``, a Scene."""
        return points_of({**self.words(), "seed": seed})

    def tasks(self) -> list[dict[str, Any]]:
        """Return the packings, by seed."""
        shared = self.settings()
        return [{**shared, "seed": seed} for seed in range(self.seed, self.seed + self.seeds)]


def points_of(task: Mapping[str, Any]) -> Any:
    """Return the points of a ``task``, a Scene."""
    from carom.scene.species import Species
    from carom.studies.packings.compression import start_of

    given = {name: task[name] for name in ("packing_fraction", "walls") if task.get(name)}
    if "species" in task:
        given["species"] = [Species(**each) for each in task["species"]]
    return start_of(task.get("n"), {"dimension": task["dimension"], **given}, task["seed"])


def _table(species: Any) -> dict[str, Any]:
    """Return a species as a file has it.

    Raises
    ------
    InputError
        If it is none.
    """
    from carom import checks
    from carom.scene.species import Species

    known = [field.name for field in dataclasses.fields(Species)]
    if isinstance(species, Mapping):
        for name in species:
            if name not in known:
                raise InputError(f"A species has no {name!r}{checks.suggestion(str(name), known)}.")
        species = Species(**species)
    if not isinstance(species, Species):
        raise InputError(f"species must hold Species, found {checks.describe(species)} in it.")
    return {name: value for name, value in dataclasses.asdict(species).items() if value is not None}
