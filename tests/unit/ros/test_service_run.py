"""A service call as a run, without ROS."""

from __future__ import annotations

import itertools

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import Outcome, Result, success
from florence_bt.core.server_comparison import Lack
from florence_bt.ros._runs import ServiceRun


class FakeService:
    def __init__(self, there: bool) -> None:
        self.there = there
        self.log: list[str] = []

    def lack(self) -> Lack:
        return Lack()

    def server_is_there(self) -> bool:
        return self.there

    def send(self) -> None:
        self.log.append("sent")

    def stop(self) -> None:
        self.log.append("dropped")


def begin(there: bool = True) -> tuple[ManualClock, FakeService, ServiceRun]:
    clock, service = ManualClock(), FakeService(there)
    return clock, service, ServiceRun(clock, service, 2.0, "service /ask")


def ended(run: ServiceRun) -> Result:
    result = run.poll()
    assert result is not None
    return result


def test_answer() -> None:
    clock, service, run = begin()
    changes: list[None] = []
    run.on_change(lambda: changes.append(None))
    assert run.feedback == "calling service /ask"
    run.finished(success(y=2))
    assert run.poll() == success(y=2)
    assert service.log == ["sent"]
    assert changes == [None]
    assert clock.next_time() is None


def test_late_server() -> None:
    clock, service, _run = begin(there=False)
    clock.advance(1.0)
    service.there = True
    clock.advance(0.1)
    assert service.log == []  # it may not know the way back yet
    clock.advance(0.3)
    assert service.log == ["sent"]


def test_no_server_and_no_answer() -> None:
    clock, service, run = begin(there=False)
    clock.advance(2.0)
    assert ended(run).code == "server_lost"
    assert service.log == []
    clock, service, run = begin()
    clock.advance(2.0)
    assert ended(run).code == "timed_out"
    assert service.log == ["sent", "dropped"]


def test_cancel_ends_at_once_and_for_good() -> None:
    for there, times in itertools.product((True, False), (1, 2)):
        clock, service, run = begin(there)
        for _ in range(times):
            run.cancel()
        assert ended(run).outcome is Outcome.CANCELLED
        run.finished(success())
        service.there = True
        clock.advance(5.0)
        assert ended(run).outcome is Outcome.CANCELLED
        assert service.log == (["sent", "dropped"] if there else [])


def test_a_server_that_is_not_there_is_lost_before_the_deadline_of_the_skill() -> None:
    clock, _, run = begin(there=False)
    clock.advance(1.7)
    assert ended(run).code == "server_lost"


def test_a_server_that_dies_during_the_call_is_lost_at_once() -> None:
    clock, service, run = begin()
    service.there = False
    clock.advance(0.5)
    assert run.poll() is None  # discovery blinks
    clock.advance(1.0)
    assert ended(run).code == "server_lost"
    assert clock.next_time() is None
