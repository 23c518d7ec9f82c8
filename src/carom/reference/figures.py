"""The algorithms of the paper's Figures 4.1 and 6.1, line by line, with four amendments to the printed text.

The variables have the paper's names, balls and obstacles are numbered from 1, and every number in a comment
``# line 14`` is a line of the figure. No heap and no lists: minima are taken over everything, as printed. The
interaction times P_ij and Q_ik depend on old events only and are remembered until one of them changes.

The amendments (docs/algorithm.md) can be left out to see what happens: 1, the settled partner is left out of
A(i*); 2, the third party is a component; 3, no event, no partner; 4, in (15) ``N + 1 <= j``.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Literal, NamedTuple

from carom.errors import CaromError, InputError
from carom.reference.arithmetic import NEVER
from carom.reference.billiard import Billiard, State

LAMBDA = None
"""No partner."""

Kind = Literal["start", "collision", "second half", "crossing", "advancement"]


class InvariantError(CaromError):
    """An invariant of the paper's sec. 8 does not hold after a cycle."""


class Cycle(NamedTuple):
    """What one turn of the main loop did; balls and obstacles count from 1.

    Attributes
    ----------
    number : int
        Number of the cycle, from 1.
    time : number
        ``current_time`` [time].
    ball : int
        i*, the ball whose event was processed.
    kind : str
        Kind of this event: ``"start"``, ``"collision"`` (first half), ``"second half"``, ``"crossing"`` or
        ``"advancement"``.
    partner : int or None
        j*, the ball with which a collision was scheduled.
    third_party : int or None
        m*, the ball whose event was turned into an advancement.
    """

    number: int
    time: Any
    ball: int
    kind: Kind
    partner: int | None
    third_party: int | None


class Scheduled(NamedTuple):
    """The old and the new event of one ball, as the paper's Figures 5.2 and 5.3 draw them.

    The old event has `old_time`, `old_position` and `old_velocity`. If nothing is scheduled, `new_position`
    and `new_velocity` are None, and `new_time` is infinite. `partner` is the ball (from 1) of a scheduled
    collision, or None.
    """

    old_time: Any
    """[time]"""
    old_position: Any
    """Unwrapped position (d,) [length]."""
    old_velocity: Any
    """(d,) [length / time]"""
    new_time: Any
    """[time]"""
    new_position: Any
    """Unwrapped position (d,) [length]."""
    new_velocity: Any
    """(d,) [length / time]"""
    partner: int | None
    """Number of the partner, from 1."""


class _Figure:
    """Base class of both figures: the arrays, the minimizations, the invariants.

    Parameters
    ----------
    billiard : Billiard
        The particles and their basic functions.
    amendments : collection of int
        Which of the four amendments to apply; ``()`` is the text as printed.

    Attributes
    ----------
    current_time : number
        Time of the last cycle [time].
    cycles, crossings, advancements : int
        Cycles done, sector crossings and advancements processed.
    first_is_third : int
        How often m* = i* was met.
    collisions : list of (time, i, j)
        In the order of processing, i < j counted from 0 as in :class:`carom.reference.NaiveSystem`.
    """

    def __init__(self, billiard: Billiard, *, amendments: Collection[int] = (1, 2, 3, 4)) -> None:
        if not set(amendments) <= {1, 2, 3, 4}:
            raise InputError(f"amendments is {amendments!r}; expected some of 1, 2, 3, 4.")
        self.billiard = billiard
        self.amendments = frozenset(amendments)
        n = billiard.n
        self.current_time: Any = 0
        self.cycles = self.crossings = self.advancements = self.first_is_third = 0
        self.collisions: list[tuple[Any, int, int]] = []
        # event[1:N, 1:2] of the paper; row 0 is never used.
        zero = billiard.arithmetic.number(0)
        self.new, self.old = [1] * (n + 1), [2] * (n + 1)
        self.time: list[list[Any]] = [[zero] * 3 for _ in range(n + 1)]
        self.partner: list[list[int | None]] = [[LAMBDA] * 3 for _ in range(n + 1)]
        self.state: list[list[State]] = [[billiard.initial[max(i, 1) - 1]] * 3 for i in range(n + 1)]
        self._started: set[int] = set()
        self._half_processed: int | None = None
        self._p: dict[tuple[int, int], tuple[State, State, Any]] = {}

    @property
    def balls(self) -> range:
        """1 to N."""
        return range(1, self.billiard.n + 1)

    def P(self, i: int, j: int) -> Any:
        """Interaction time of balls i and j after their old events; evaluated for i < j (condition I)."""
        i, j = min(i, j), max(i, j)
        first, second = self.state[i][self.old[i]], self.state[j][self.old[j]]
        known = self._p.get((i, j))
        if known is None or known[0] is not first or known[1] is not second:
            time = self.billiard.interaction_time(
                first, self.time[i][self.old[i]], second, self.time[j][self.old[j]]
            )
            self._p[i, j] = known = (first, second, time)
        return known[2]

    def Q(self, i: int, k: int) -> Any:
        """Interaction time of ball i and obstacle k after the old event of i."""
        return self.billiard.crossing_time(self.state[i][self.old[i]], self.time[i][self.old[i]], k)

    def _next_ball(self) -> int:
        return min(self.balls, key=lambda i: self.time[i][self.new[i]])

    def _settled(self, i: int, j: int) -> bool:
        """Whether the pending event of j is the second half of a collision that i has processed."""
        raise NotImplementedError

    def _minimize(self, i: int) -> tuple[Any, int, Any, int]:
        """P and j*, Q and k*: the two minimizations, with the smallest index where times are equal."""
        best_p, j_star, best_q, k_star = NEVER, 0, NEVER, 0
        for j in self.balls:
            if j == i or (1 in self.amendments and self._settled(i, j)):
                continue
            p = self.P(i, j)
            if p < best_p and self.time[j][self.new[j]] >= p:
                best_p, j_star = p, j
        for k in range(1, self.billiard.obstacles + 1):
            q = self.Q(i, k)
            if q < best_q:
                best_q, k_star = q, k
        return best_p, j_star, best_q, k_star

    def _count(self, i: int, kind: Kind) -> Kind:
        """Count a processed event; the first one of a ball is its initial state."""
        if i not in self._started:
            self._started.add(i)
            return "start"
        self.crossings += kind == "crossing"
        self.advancements += kind == "advancement"
        return kind

    def _collide(self, i: int, j: int) -> None:
        """Record a collision; the half of ball j is still to be processed."""
        self.collisions.append((self.current_time, min(i, j) - 1, max(i, j) - 1))
        self._half_processed = j

    def cycle(self) -> Cycle | None:
        """Do one turn of the main loop; None if no particle has an event left."""
        raise NotImplementedError

    def run(
        self,
        *,
        collisions: int | None = None,
        end_time: Any = NEVER,
        cycles: int | None = None,
        check: bool = False,
    ) -> None:
        """Do cycles until one of the ends is reached, or nothing more happens.

        Parameters
        ----------
        collisions, end_time, cycles
            Collisions and cycles since the very start, and the paper's ``end_time``.
        check : bool
            Call :meth:`check_invariants` after each cycle.

        Raises
        ------
        InvariantError
            If `check` finds an invariant broken.
        """
        while (
            self.current_time < end_time
            and (collisions is None or len(self.collisions) < collisions)
            and (cycles is None or self.cycles < cycles)
            and self.cycle() is not None
        ):
            if check:
                self.check_invariants()

    def check_invariants(self) -> None:
        """Check (13) after any cycle, and (14) to (16) unless a collision is half processed.

        Comparisons are exact: the interaction times compared are those that were scheduled, so rounding does
        not matter. Invariant (14) presumes condition VI (no ball meets two others at the same time).

        Raises
        ------
        InvariantError
            Naming the first broken invariant and the balls.
        """
        due = {i: self.time[i][self.new[i]] for i in self.balls}
        earliest = min(due.values())
        for i in self.balls:
            if self.time[i][self.old[i]] > earliest:
                raise InvariantError(
                    f"(13): the old event of ball {i} is later than a new event at {earliest}."
                )
        if self._half_processed is not None:
            return
        n, low = self.billiard.n, self.billiard.n + (1 if 4 in self.amendments else 2)
        for i in self.balls:
            times = {j: self.P(i, j) for j in self.balls if j != i}
            walls = [self.Q(i, k) for k in range(1, self.billiard.obstacles + 1)]
            bound = min([p for j, p in times.items() if due[j] >= p] + walls, default=NEVER)
            if due[i] > bound:
                raise InvariantError(
                    f"(14): ball {i} has its new event at {due[i]}, after an interaction at {bound}."
                )
            j = self.partner[i][self.new[i]]
            if not (
                j is LAMBDA
                or low <= j <= n + self.billiard.obstacles
                or (1 <= j <= n and self.partner[j][self.new[j]] == i)
            ):
                raise InvariantError(f"(15): ball {i} has the partner {j}, which is not its own.")
            if min([*times.values(), *walls], default=NEVER) < earliest:
                raise InvariantError(f"(16): ball {i} interacts before the earliest new event at {earliest}.")

    def scheduled(self, i: int) -> Scheduled:
        """Old and new event of ball `i` (from 1)."""
        raise NotImplementedError

    def _scheduled(self, i: int, after: State | None, partner: int | None) -> Scheduled:
        """Return old and new event of ball `i`, given its state after the new one and its partner."""
        old, new = self.old[i], self.new[i]
        before, ends = self.state[i][old], after is not None and self.time[i][new] < NEVER
        return Scheduled(
            self.time[i][old],
            before.position,
            before.velocity,
            self.time[i][new],
            after.position if after is not None and ends else None,
            after.velocity if after is not None and ends else None,
            partner,
        )


class Figure1(_Figure):
    """The simulation algorithm of Figure 4.1: new states are computed when an event is scheduled."""

    __doc__ += "\n" + (_Figure.__doc__ or "").partition("\n")[2]

    def _settled(self, i: int, j: int) -> bool:
        return self.partner[j][self.new[j]] == i

    def cycle(self) -> Cycle | None:
        """Do one turn of the main loop; return None if no particle has an event left."""
        time, state, partner, new, old = self.time, self.state, self.partner, self.new, self.old
        i = self._next_ball()  # line 2
        if time[i][new[i]] == NEVER:
            return None
        self.current_time = time[i][new[i]]
        self.cycles += 1
        crossed = state[i][new[i]].sector != state[i][old[i]].sector
        new[i] = old[i]  # line 3
        old[i] = 3 - new[i]
        kind = self._kind(i, crossed)
        p, j, q, k = self._minimize(i)  # lines 4, 5
        r = min(p, q)  # line 6
        time[i][new[i]] = r
        j_star = m_star = None
        if r < NEVER:  # line 7
            state1 = self.billiard.advance(state[i][old[i]], time[i][old[i]], r)  # line 8
            if q < p:  # line 9
                state[i][new[i]] = self.billiard.cross(state1, k)  # line 10
                partner[i][new[i]] = LAMBDA  # line 11
            else:
                j_star = j
                time[j][new[j]] = r  # line 13
                state2 = self.billiard.advance(state[j][old[j]], time[j][old[j]], r)  # line 14
                # Line 15, in the order of the indices (condition II, to the last bit).
                if i < j:
                    state[i][new[i]], state[j][new[j]] = self.billiard.jump(state1, state2)
                else:
                    state[j][new[j]], state[i][new[i]] = self.billiard.jump(state2, state1)
                m = partner[j][new[j]]  # line 16
                partner[i][new[i]], partner[j][new[j]] = j, i  # line 17
                self.first_is_third += m == i
                if m is not LAMBDA and m != i:  # line 18
                    m_star = m
                    state[m][new[m]] = self.billiard.advance(
                        state[m][old[m]], time[m][old[m]], time[m][new[m]]
                    )  # line 19
                    partner[m][new[m]] = LAMBDA  # line 20
        elif 3 in self.amendments:
            partner[i][new[i]] = LAMBDA
        return Cycle(self.cycles, self.current_time, i, kind, j_star, m_star)

    def _kind(self, i: int, crossed: bool) -> Kind:
        """Return the kind of the event that has just become the old event of ball i."""
        j = self.partner[i][self.old[i]]
        if j is LAMBDA:
            return self._count(i, "crossing" if crossed else "advancement")
        if self._half_processed == i:
            self._half_processed = None
            return self._count(i, "second half")
        self._collide(i, j)
        return self._count(i, "collision")

    def scheduled(self, i: int) -> Scheduled:
        """Old and new event of ball `i` (from 1)."""
        new = self.new[i]
        return self._scheduled(i, self.state[i][new], self.partner[i][new])


class Figure2(_Figure):
    """The version with delayed update of Figure 6.1: new states are computed when an event is processed."""

    __doc__ += "\n" + (_Figure.__doc__ or "").partition("\n")[2]

    def _settled(self, i: int, j: int) -> bool:
        pending = self.partner[j][self.new[j]]
        return pending is not LAMBDA and pending < 0

    def cycle(self) -> Cycle | None:
        """Do one turn of the main loop; return None if no particle has an event left."""
        time, state, partner, new, old, n = (
            self.time,
            self.state,
            self.partner,
            self.new,
            self.old,
            self.billiard.n,
        )
        i = self._next_ball()  # line 2
        if time[i][new[i]] == NEVER:
            return None
        self.current_time = time[i][new[i]]
        self.cycles += 1
        state1 = self.billiard.advance(state[i][old[i]], time[i][old[i]], time[i][new[i]])  # line 3
        sharp = partner[i][new[i]]  # line 4
        kind: Kind
        if sharp is LAMBDA:  # line 5
            state[i][new[i]] = state1
            kind = self._count(i, "advancement")
        elif sharp > n:  # lines 7, 8
            state[i][new[i]] = self.billiard.cross(state1, sharp - n)
            kind = self._count(i, "crossing")
        elif sharp > 0:  # line 9
            j = sharp
            state2 = self.billiard.advance(state[j][old[j]], time[j][old[j]], time[j][new[j]])  # line 10
            # Line 11, in the order of the indices (condition II, to the last bit).
            if i < j:
                state[i][new[i]], state[j][new[j]] = self.billiard.jump(state1, state2)
            else:
                state[j][new[j]], state[i][new[i]] = self.billiard.jump(state2, state1)
            partner[j][new[j]] = -i  # line 12
            self._collide(i, j)
            kind = self._count(i, "collision")
        else:
            self._half_processed = None
            kind = self._count(i, "second half")
        new[i] = old[i]  # line 13
        old[i] = 3 - new[i]
        p, j, q, k = self._minimize(i)  # lines 14, 15
        r = min(p, q)  # line 16
        time[i][new[i]] = r
        j_star = m_star = None
        if r < NEVER:  # line 17
            if q < p:  # line 18
                partner[i][new[i]] = n + k
            else:
                j_star = j
                time[j][new[j]] = r  # line 20
                m = partner[j][new[j]]  # line 21
                partner[i][new[i]], partner[j][new[j]] = j, i  # line 22
                self.first_is_third += m == i
                if m is not LAMBDA and m != i:  # line 23
                    if 1 <= m <= n:
                        m_star = m
                        partner[m][new[m]] = LAMBDA
                    elif 2 not in self.amendments:
                        raise IndexError(f"Line 23 as printed stores into partner[{m}, .], but N = {n}.")
        elif 3 in self.amendments:
            partner[i][new[i]] = LAMBDA
        return Cycle(self.cycles, self.current_time, i, kind, j_star, m_star)

    def scheduled(self, i: int) -> Scheduled:
        """Old and new event of ball `i` (from 1); the new state is that after the new event."""
        old, new, n = self.old[i], self.new[i], self.billiard.n
        partner, time = self.partner[i][new], self.time[i][new]
        if partner is not LAMBDA and partner < 0:
            return self._scheduled(i, self.state[i][new], -partner)
        if time == NEVER:
            return self._scheduled(i, None, None)
        after = self.billiard.advance(self.state[i][old], self.time[i][old], time)
        if partner is None or partner > n:
            return self._scheduled(i, after, None)
        other = self.billiard.advance(
            self.state[partner][self.old[partner]], self.time[partner][self.old[partner]], time
        )
        return self._scheduled(i, self.billiard.jump(after, other)[0], partner)
