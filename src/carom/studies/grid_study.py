"""A study of a grid of packing fractions, sizes and replicas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

from carom.studies.folder import Record, Task
from carom.studies.grid import SceneGrid, collisions
from carom.studies.study import Study

G = TypeVar("G", bound=SceneGrid)


@dataclass(frozen=True, repr=False)
class GridStudy(Study[G], Generic[G]):
    """A study of a grid: where its tasks are, and what they cost."""

    unit_of_cost: ClassVar[str] = "collisions"

    @staticmethod
    def cost(task: Task) -> float:
        """Return the work of a task [collisions]."""
        return collisions(task)

    @property
    def first(self) -> str:
        """What is said before the first task is done: the longest begins."""
        return f"{super().first}, of {max(map(self.cost, self.tasks)):.2g} {self.unit_of_cost} at most"

    def place(self, task: Task) -> str:
        """Return where a task is, in words."""
        return f"at packing fraction {task['scene']['packing_fraction']:g} with n = {task['scene']['n']}"

    @staticmethod
    def point(task: Task) -> tuple[Any, ...]:
        """Return what tells the point of a task from others."""
        return task["scene"]["packing_fraction"], task["scene"]["n"]

    def by_point(self) -> list[list[Record]]:
        """Return the records of each point, in the order of :meth:`point` and replica."""
        found: dict[tuple[Any, ...], list[Record]] = {}
        # Sorted, so that sums are bit-identical whatever the order in which replicas finished.
        for record in sorted(self.records, key=lambda record: int(record["task"]["replica"])):
            found.setdefault(self.point(record["task"]), []).append(record)
        return [found[point] for point in sorted(found)]

    def sentences(self) -> list[str]:
        """Return what became of numbers of particles that fill no lattice."""
        taken = (pair for eta in self.spec.packing_fraction for pair in self.spec.taken(eta).items())
        other = [f"{each} for n = {n}" for n, each in dict.fromkeys(taken) if each != n]
        return [f"Lattices were filled, with the nearest number: {', '.join(other)}."] if other else []
