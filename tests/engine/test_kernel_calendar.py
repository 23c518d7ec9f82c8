"""The calendar against a list that is searched from end to end."""

import numpy as np
import pytest

import carom
from carom.engine import calendar as cal
from carom.engine.build import build, enlarge_heap
from carom.engine.neighbors.plan import NeighborPlan
from carom.engine.neighbors.prefetch import HUGE
from carom.simulation.system_of_scene import prepare

LENGTH = 8.0


def make_engine(n, heap=256, width=0.25):
    """Return an engine of n components whose times the tests set themselves."""
    edge = 4.0 * n
    chosen = NeighborPlan("sectors", (n,), 8, 0.0, 0, LENGTH, width, heap)
    positions = np.arange(n)[:, None] * 4.0
    scene = carom.Scene(positions, edge)
    engine = build(chosen, prepare(scene, 0.0 * positions, tuning=carom.Tuning(images=False)), positions, 0.0)
    return engine, chosen


class Book:
    """The calendar of an engine, and the plain search that says what must come out of it."""

    def __init__(self, event_time, leave, **settings):
        self.engine, self.scheme = make_engine(len(event_time), **settings)
        self.event_time = self.engine.state.rows["event_time"][: len(event_time)]
        self.crossing_time = self.engine.state.crossing_time
        self.event_time[:], self.crossing_time[:] = event_time, leave
        self.refused = 0
        self.laid_out = 0
        self.fill_window(0.0)

    def fill_window(self, start):
        self.laid_out += 1
        earliest = cal.fill_window(
            self.engine.calendar, self.engine.state, self.engine.model.boundary, start, LENGTH
        )
        assert self.control.inverse * self.control.width == 1.0  # however often it was narrowed
        return earliest

    @property
    def control(self):
        return self.engine.calendar.control[0]

    def enlarge(self):
        self.refused += 1
        self.scheme = self.scheme.with_larger_heap()
        self.engine = enlarge_heap(self.engine, self.scheme.heap)

    def next_event(self):
        """Return the component that is first in the whole epoch, or -1, as the cycle does."""
        while True:
            if self.control.full:
                self.fill_window(self.now)
                if cal.crowded(self.engine.calendar):
                    self.enlarge()
                    continue
            tight = self.control.waiting + cal.MOST_NEW_ENTRIES > len(self.engine.calendar.event_time)
            entry = (
                -2
                if tight
                else cal.next_event(
                    self.engine.calendar,
                    self.engine.state,
                    self.engine.neighbors,
                    self.engine.model.boundary,
                    self.engine.model.motion,
                )
            )
            if entry == -2 and cal.cluttered(self.engine.calendar, self.engine.state):
                self.control.full = 1
            elif entry == -2:
                self.enlarge()
            elif entry == -1 and self.control.end < LENGTH:
                self.engine.calendar.choose_width(len(self.event_time), LENGTH)
                self.fill_window(self.control.end)
                if self.control.full:
                    self.enlarge()
            else:
                return int(entry)

    def expected(self):
        """Return the first component by (time, number), or -1."""
        times = np.minimum(self.event_time, self.crossing_time)
        k = int(np.argmin(times))
        return k if times[k] < LENGTH else -1

    def reschedule(self, i, which, time):
        """Give component i another of its two times, ``event_time`` or ``leave``."""
        which[i] = time
        cal.insert(self.engine.calendar, np.uint64(i), min(self.event_time[i], self.crossing_time[i]))

    def check(self, next_time, steps=4000, rng=None):
        """Take component by component, give each a new time, and compare the order with the search's."""
        self.now = float(self.control.start)
        taken = 0
        for _ in range(steps):
            entry = self.next_event()
            assert entry == self.expected()
            if entry == -1:
                break
            which = (
                self.crossing_time if self.crossing_time[entry] < self.event_time[entry] else self.event_time
            )
            self.now = float(which[entry])
            self.control.cycles += 1
            cal.pop(self.engine.calendar)
            self.reschedule(entry, which, next_time(self.now))
            if rng is not None and rng.random() < 0.3:  # preempt another component's event, or put it off
                other = self.crossing_time if rng.random() < 0.5 else self.event_time
                self.reschedule(int(rng.integers(len(self.event_time))), other, next_time(self.now))
            taken += 1
        return taken


@pytest.mark.parametrize("n", [1, 3, 40, 400])
@pytest.mark.parametrize("width", [2.0**-12, 2.0**-4, 4.0])
def test_components_come_in_the_order_of_time(n, width):
    rng = np.random.default_rng(n)
    book = Book(rng.exponential(0.3, n), rng.exponential(0.3, n), width=width)
    assert book.check(lambda now: now + rng.exponential(0.3), rng=rng, steps=1500) > 4


def test_simultaneous_components_come_in_the_order_of_their_numbers():
    book = Book(np.full(300, 1.5), np.full(300, 1.5))
    order = []

    def never(now):
        order.append(now)
        return np.inf

    assert book.check(never) == 600
    assert set(order) == {1.5}


@pytest.mark.parametrize("width", [2.0**-14, 2.0**-6])
def test_a_few_events_a_bucket_whatever_the_width_to_begin_with(width):
    rng = np.random.default_rng(0)
    n, rate = 800, 8.0
    book = Book(rng.exponential(1.0 / rate, n), np.full(n, np.inf), width=width, heap=4096)

    def put_off(now):
        # By others, five times before it comes: what they leave behind fills buckets, too.
        for _ in range(5):
            book.reschedule(int(rng.integers(n)), book.event_time, now + rng.exponential(1.0 / rate))
        return now + rng.exponential(1.0 / rate)

    assert book.check(put_off, steps=2500) == 2500
    assert 2.0 <= n * rate * book.control.width <= 8.0


def test_more_at_one_time_than_lines_can_hold_come_in_order_all_the_same():
    n = 1500
    book = Book(np.full(n, 1.5), np.full(n, np.inf), width=LENGTH * 2.0**-20)
    book.control.width = LENGTH * cal.NARROWEST
    for _ in range(2):
        book.fill_window(1.5)
        assert book.control.full  # all in one bucket, and 90 lines of 14
    assert book.control.width == LENGTH * cal.NARROWEST
    lines = len(book.engine.calendar.lines)
    book.now = 1.5
    assert [book.next_event(), book.expected()] == [0, 0]
    assert len(book.engine.calendar.lines) > lines  # and none is missing
    assert int(book.control.waiting) == n
    for i in range(n):
        assert book.next_event() == i
        cal.pop(book.engine.calendar)
        book.event_time[i] = np.inf
    assert book.laid_out < 10


def test_a_window_that_does_not_hold_what_is_due_at_one_time_is_not_laid_out_for_ever(monkeypatch):
    # From far before that time: windows become narrow until it is behind them, and wide until it is not.
    monkeypatch.setattr(cal, "NARROWEST", 2.0**-16)
    n = 1300
    book = Book(np.full(n, 7.5), np.full(n, np.inf), width=LENGTH * 2.0**-12)
    book.now, order = 0.0, []
    while (entry := book.next_event()) != -1:
        order.append(entry)
        cal.pop(book.engine.calendar)
        book.event_time[entry], book.now = np.inf, 7.5
        assert book.laid_out < 200
    assert order == list(range(n))


def test_lines_grow_up_to_what_all_components_fill():
    n = 1500
    book = Book(np.full(n, 1.5), np.full(n, np.inf))
    for _ in range(12):
        book.enlarge()
        built, _ = make_engine(n, heap=book.scheme.heap)
        assert len(built.calendar.lines) == len(book.engine.calendar.lines)  # as a checkpoint expects it
    assert len(book.engine.calendar.lines) == cal.most_lines(n)
    assert 2 * (1 + n // cal.ENTRIES) <= cal.most_lines(n)  # never crowded


def test_stale_entries_do_not_fill_the_heap_for_ever():
    # A few that are put off again and again at the present time.
    n = 40
    book = Book(np.full(n, 1.5), np.full(n, np.inf))
    book.now = 1.5
    assert book.next_event() == 0
    rng = np.random.default_rng(0)
    for _ in range(2500):
        book.reschedule(int(rng.integers(n)), book.event_time, 1.5 + 1e-13 * rng.random())
        assert book.next_event() == book.expected()
    assert len(book.engine.calendar.event_time) <= 4 * (2 * n + cal.BLOCK)


def test_one_full_bucket_spills_into_lines():
    rng = np.random.default_rng(0)
    book = Book(1.5 + 1e-9 * rng.random(300), 7.0 + 1e-9 * rng.random(300), heap=1024)
    assert book.control.lines > 20  # 300 entries in one bucket of 14
    assert book.check(lambda now: np.inf) == 600


def test_the_heap_asks_for_room_and_goes_on():
    rng = np.random.default_rng(0)
    book = Book(1.5 + 1e-9 * rng.random(300), np.full(300, 1.5))
    assert book.check(lambda now: np.inf) == 600
    assert book.refused >= 1


def test_exhausted_lines_lose_nothing():
    # Entries made stale again and again fill bucket after bucket, until no line is left.
    rng = np.random.default_rng(1)
    n = 20
    book = Book(np.full(n, 7.0), np.full(n, 6.0), width=1.0)
    for _ in range(20_000):
        book.reschedule(int(rng.integers(n)), book.crossing_time, 5.0 + rng.random())
        if book.control.full:
            break
    assert book.control.full
    assert book.check(lambda now: now + 0.5, rng=rng, steps=300) == 300 or book.expected() == -1


def test_the_far_future_waits_outside_the_window():
    book = Book(
        [0.5, LENGTH, 3.0, 1e300, np.inf], [np.inf, 7.999, 1e9, np.inf, LENGTH - 1e-16], width=2.0**-10
    )
    found = []

    def never(now):
        found.append(now)
        return np.inf

    book.check(never)
    assert found == [0.5, 3.0, 7.999]  # LENGTH - 1e-16 is LENGTH in doubles, and the next epoch's


def test_an_empty_calendar_says_so():
    book = Book([np.inf], [np.inf])
    assert book.next_event() == -1
    assert book.fill_window(0.0) == np.inf


def test_a_pair_has_one_entry():
    book = Book([1.0, 1.0, 3.0], [np.inf] * 3)
    bits = book.engine.model.boundary.bits if hasattr(book.engine.model.boundary, "bits") else 0
    book.engine.state.partner[:2] = [1 << bits, 0]
    book.fill_window(0.0)
    assert book.next_event() == 0
    cal.pop(book.engine.calendar)
    book.event_time[:2] = np.inf
    assert book.next_event() == 2


@pytest.mark.parametrize(
    ("n", "cycles", "factor"),
    [(400, 3, 2.0), (400, 6, 1.0), (400, 9, 0.5), (HUGE, 1, 2.0), (HUGE, 3, 1.0), (HUGE, 6, 0.5)],
)
def test_buckets_hold_a_few_cycles_and_fewer_where_memory_is_asked_for(n, cycles, factor):
    """A system of ``n`` components that had so many cycles a bucket gets buckets so much wider."""
    width = 2.0**-10
    book = Book(np.full(400, 1.0), np.full(400, 1.0), width=width)
    book.fill_window(0.0)
    book.control.cycles = cycles * cal.buckets_in_window(book.engine.calendar)
    book.engine.calendar.choose_width(n, LENGTH)
    assert book.control.width == factor * width
