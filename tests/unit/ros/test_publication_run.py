"""Runs that only publish, without ROS."""

from __future__ import annotations

import itertools

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import success
from florence_bt.core.server_comparison import Lack
from florence_bt.ros._runs import PublicationRun

LIMIT_S = 2.0


class Listener:
    """The other side of the topic."""

    def __init__(self, there: bool = True) -> None:
        self.there = there
        self.sent: list[str] = []

    def lack(self) -> Lack:
        return Lack()

    def server_is_there(self) -> bool:
        return self.there

    def send(self) -> None:
        self.sent.append("message")

    def stop(self) -> None:
        self.sent.append("stop")


def begin(there: bool = True) -> tuple[ManualClock, Listener, PublicationRun]:
    clock, other = ManualClock(5.0), Listener(there)
    return clock, other, PublicationRun(clock, other, LIMIT_S, "topic /say")


def test_a_publication_is_over_when_the_message_is_out() -> None:
    clock, other, run = begin()
    assert run.poll() == success()
    assert other.sent == ["message"] and clock.next_time() is None


def test_a_publication_waits_for_somebody_who_listens() -> None:
    clock, other, run = begin(there=False)
    clock.advance(1.0)
    assert run.poll() is None and other.sent == []
    other.there = True
    clock.advance(1.0)
    assert run.poll() == success() and other.sent == ["message"] and clock.next_time() is None


def test_a_publication_that_nobody_hears_fails() -> None:
    for cancel in (False, True):
        clock, other, run = begin(there=False)
        if cancel:
            run.cancel()
        clock.advance(10.0)
        result = run.poll()
        assert result is not None and result.code == ("cancelled" if cancel else "server_lost")
        assert cancel or result.reason.startswith("no subscriber of topic /say")
        other.there = True
        clock.advance(10.0)
        assert other.sent == [] and clock.next_time() is None


def test_every_order_ends_once() -> None:
    for events in itertools.product(("cancel", "wait", "appear"), repeat=4):
        clock, other, run = begin(there=False)
        first = None
        for event in (*events, "wait"):
            if event == "cancel":
                run.cancel()
            elif event == "appear":
                other.there = True
                clock.advance(0.5)
            else:
                clock.advance(20.0)
            first = first or run.poll()
            assert first is None or run.poll() == first
        assert first is not None and other.sent in ([], ["message"]) and clock.next_time() is None
