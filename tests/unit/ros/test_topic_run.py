"""A run that is commanded on a topic, without ROS."""

from __future__ import annotations

import itertools

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import Outcome, success
from florence_bt.ros._runs import Deadlines, TopicRun

DEADLINES = Deadlines(accept_s=2.0, result_s=10.0)


class Other:
    """The other side of the topics."""

    def __init__(self, there: bool = True) -> None:
        self.there = there
        self.sent: list[str] = []

    def server_is_there(self) -> bool:
        return self.there

    def send(self) -> None:
        self.sent.append("command")

    def stop(self) -> None:
        self.sent.append("stop")


def begin(there: bool = True) -> tuple[ManualClock, Other, TopicRun]:
    clock, other = ManualClock(5.0), Other(there)
    return clock, other, TopicRun(clock, other, DEADLINES, "topic /cmd")


def test_the_command_and_its_end() -> None:
    clock, other, run = begin()
    assert other.sent == ["command"] and run.sent
    run.set_feedback("on it")
    assert run.feedback == "on it"
    run.finished(success())
    clock.advance(100.0)
    assert run.poll() == success() and other.sent == ["command"] and clock.next_time() is None


def test_nobody_listens() -> None:
    clock, other, run = begin(there=False)
    clock.advance(1.9)
    assert run.poll() is None and not run.sent
    clock.advance(0.2)
    result = run.poll()
    assert result is not None and result.code == "server_lost" and "no subscriber of topic" in result.reason
    other.there = True
    clock.advance(10.0)
    assert other.sent == []


def test_no_end() -> None:
    clock, other, run = begin()
    clock.advance(10.0)
    result = run.poll()
    assert result is not None and result.code == "timed_out" and other.sent == ["command", "stop"]


def test_a_cancel_takes_the_command_back_if_it_is_out() -> None:
    for there, sent in ((True, ["command", "stop"]), (False, [])):
        clock, other, run = begin(there)
        run.cancel()
        run.cancel()
        other.there = True
        clock.advance(20.0)
        result = run.poll()
        assert result is not None and result.outcome is Outcome.CANCELLED and other.sent == sent


def test_every_order_ends_once() -> None:
    for events in itertools.product(("end", "cancel", "wait", "appear"), repeat=4):
        clock, other, run = begin(there=False)
        first = None
        for event in (*events, "wait"):
            if event == "end":
                run.finished(success())
            elif event == "cancel":
                run.cancel()
            elif event == "appear":
                other.there = True
                clock.advance(0.1)
            else:
                clock.advance(20.0)
            first = first or run.poll()
            assert first is None or run.poll() == first
        assert first is not None and clock.next_time() is None
