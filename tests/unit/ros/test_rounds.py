"""A loop that is too slow serves the newest of each topic, and is never more than a round behind."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import pytest

from florence_bt.ros.rounds import LATE_S, NewestReadings, Rounds


class Loop:
    """A queue that is worked off in the order of what comes in, as by the events executor."""

    def __init__(self) -> None:
        self.queue: deque[Callable[[], object]] = deque()
        self.now = 0.0
        self.late: list[float] = []
        self.rounds = Rounds(self.queue.append, self.late.append, lambda: self.now)

    def comes(self, topic: NewestReadings, *message: object) -> None:
        self.queue.append(lambda: topic.take(self.rounds, *message))

    def work(self, entries: int = 1_000_000) -> None:
        for _ in range(min(entries, len(self.queue))):
            self.queue.popleft()()

    def work_all(self) -> None:
        while self.queue:
            self.work()


def test_who_keeps_up_gets_every_message() -> None:
    loop = Loop()
    got: list[int] = []
    topic = NewestReadings(got.append)
    for number in range(5):
        loop.comes(topic, number)
        loop.work_all()
    assert got == [0, 1, 2, 3, 4] and topic.left_out == 0 and loop.late == []


def test_who_does_not_gets_the_first_and_the_newest_with_what_belongs_to_it() -> None:
    loop = Loop()
    got: list[object] = []
    topic = NewestReadings(lambda *message: got.append(message))
    for number in range(10):
        loop.comes(topic, number, f"about {number}")
    loop.work_all()
    assert got == [(0, "about 0"), (9, "about 9")] and topic.left_out == 8


def test_of_a_topic_of_several_publishers_more_are_served_in_their_order() -> None:
    loop = Loop()
    got: list[int] = []
    topic = NewestReadings(got.append, most=3)
    for number in range(10):
        loop.comes(topic, number)
    loop.work_all()
    assert got == [0, 1, 2, 7, 8, 9]


@pytest.mark.parametrize("topics", [1, 3])
def test_the_queue_stays_short_and_a_request_is_soon_served(topics: int) -> None:
    # Each callback takes so long that four messages of each topic come in meanwhile.
    loop = Loop()
    got: list[int] = []
    listening: list[NewestReadings] = []

    def slow(number: int) -> None:
        got.append(number)
        loop.now += 0.01
        for each in listening:
            for more in range(4):
                loop.comes(each, number + more)

    listening += [NewestReadings(slow) for _ in range(topics)]
    for each in listening:
        loop.comes(each, 0)
    longest = 0
    for _ in range(200):
        before = len(got)
        answered: list[int] = []
        loop.queue.append(lambda answered=answered: answered.append(len(got)))  # type: ignore[misc]
        while not answered:
            loop.work(1)
            longest = max(longest, len(loop.queue))
        assert answered[0] - before <= 2 * topics, "no more than a round or two are before it"
    assert longest < 30 * topics and loop.late == []


def test_a_slow_round_is_told() -> None:
    loop = Loop()

    def slow(number: int) -> None:
        loop.now += 0.4 * LATE_S

    topics = [NewestReadings(slow) for _ in range(3)]
    for each in topics:
        loop.comes(each, 1)
    loop.work_all()
    assert loop.late == [pytest.approx(1.2 * LATE_S)]
    loop.comes(topics[0], 2)
    loop.work_all()
    assert len(loop.late) == 1, "it keeps up again"
