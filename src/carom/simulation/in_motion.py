"""What functions below :class:`carom.Simulation` know of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from carom.block import Block
    from carom.frame import Frame
    from carom.scene.scene import Scene
    from carom.simulation.run_state import RunState


class InMotion(Protocol):
    """A scene in motion: its state, and how it goes on. There is one class of this kind, the simulation."""

    _state: RunState

    @property
    def scene(self) -> Scene:
        """What is simulated."""

    @property
    def n(self) -> int:
        """Number of particles."""

    @property
    def time(self) -> float:
        """Time since the start [time]."""

    @property
    def collisions(self) -> int:
        """Pair collisions since the start."""

    @property
    def kT(self) -> float:
        """Temperature [energy]."""

    @property
    def potential_energy(self) -> float:
        """Potential energy now [energy]."""

    def frame(self) -> Frame:
        """Return all particles at the present time."""

    def rescale(self, kT: float = ...) -> None:
        """Scale all velocities to a temperature."""

    def run(
        self, *, collisions: int | None = ..., every: float | None = ..., call: Any = ..., progress: Any = ...
    ) -> Block:
        """Run on."""
