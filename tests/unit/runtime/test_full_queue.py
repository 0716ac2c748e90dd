"""A queue without room: nobody may wait for a turn any more, but who preempts takes the next free place."""

from __future__ import annotations

import pytest

from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import QUEUE_LIMIT, RequestRefused
from florence_bt.runtime.run import MissionRequest, RunStatus, TriggerPolicy


@pytest.fixture
def crowd(bench):
    """A run that takes 0.5 s to stop, and as many behind it as may wait."""
    bench.script(Step(after=9.0, cancel_takes=0.5), Step(after=1.0))
    bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(1.0)
    for _ in range(QUEUE_LIMIT):
        bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE))
    return bench


def preempt(bench, priority=0):
    return bench.executor.trigger(
        MissionRequest("drive_once", policy=TriggerPolicy.PREEMPT, priority=priority)
    )


def test_the_queue_is_bounded(crowd):
    with pytest.raises(RequestRefused, match=f"{QUEUE_LIMIT} runs wait already.*policy 'preempt'"):
        crowd.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE, priority=9))
    assert len(crowd.executor.waiting) == QUEUE_LIMIT


def test_a_preempting_run_is_not_refused_because_others_wait(crowd):
    old, waiting = crowd.executor.current, crowd.executor.waiting
    new = preempt(crowd)
    assert old.status is RunStatus.ENDING and crowd.executor.waiting == (new, *waiting)
    crowd.clock.advance(0.6)
    assert old.status is RunStatus.STOPPED and new.reason == "" and crowd.executor.current is new
    assert crowd.executor.waiting == waiting, "nobody lost the place"
    crowd.clock.advance(QUEUE_LIMIT + 2.0)
    assert {run.status for run in (new, *waiting)} == {RunStatus.SUCCEEDED}


def test_only_one_run_at_a_time_goes_above_the_limit(crowd):
    first = preempt(crowd)
    for policy in (TriggerPolicy.QUEUE, TriggerPolicy.PREEMPT):
        with pytest.raises(RequestRefused, match=r"5[01] runs wait already"):
            crowd.executor.trigger(MissionRequest("drive_once", policy=policy))
    crowd.clock.advance(0.6)
    assert crowd.executor.current is first
    second = preempt(crowd)
    crowd.clock.advance(0.6)
    assert first.status is RunStatus.STOPPED and crowd.executor.current is second


def test_a_lower_priority_is_told_so_whether_there_is_room_or_not(crowd):
    with pytest.raises(RequestRefused, match="above the priority -1 of this request"):
        preempt(crowd, priority=-1)


def test_a_preempting_run_waits_behind_higher_priorities_also_in_a_full_queue(bench):
    bench.script(Step(after=9.0, cancel_takes=0.5), Step(after=1.0))
    bench.executor.trigger(MissionRequest("drive_once"))
    for _ in range(QUEUE_LIMIT):
        bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE, priority=5))
    low = preempt(bench, priority=1)
    assert bench.executor.waiting[-1] is low
    bench.clock.advance(0.6)
    assert len(bench.executor.waiting) == QUEUE_LIMIT and bench.executor.waiting[-1] is low
