"""Runs that are commanded on a topic, and that only publish, without ROS."""

from __future__ import annotations

import itertools

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import Outcome, success
from florence_bt.ros._runs import Deadlines, PublicationRun, TopicRun

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


def test_a_publication_is_over_when_the_message_is_out() -> None:
    clock, other = ManualClock(5.0), Other()
    assert PublicationRun(clock, other, 2.0, "topic /say").poll() == success()
    assert other.sent == ["command"] and clock.next_time() is None


def test_a_publication_waits_for_somebody_who_listens() -> None:
    clock, other = ManualClock(5.0), Other(there=False)
    run = PublicationRun(clock, other, 2.0, "topic /say")
    clock.advance(1.0)
    assert run.poll() is None and other.sent == []
    other.there = True
    clock.advance(1.0)
    assert run.poll() == success() and other.sent == ["command"] and clock.next_time() is None


def test_a_publication_that_nobody_hears_fails() -> None:
    for cancel in (False, True):
        clock, other = ManualClock(5.0), Other(there=False)
        run = PublicationRun(clock, other, 2.0, "topic /say")
        if cancel:
            run.cancel()
        clock.advance(10.0)
        result = run.poll()
        assert result is not None and result.code == ("cancelled" if cancel else "server_lost")
        assert cancel or result.reason.startswith("no subscriber of topic /say")
        assert other.sent == [] and clock.next_time() is None
