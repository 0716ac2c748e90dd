"""Runs that died after a pause, or after they had been taken up once: each goes on where it stood."""

from __future__ import annotations

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.run import MissionRequest, RunStatus
from tests.unit.runtime.recovery_bench import Process

MISSION = """
mission: m
on_restart: resume
tree:
  sequence:
    - drive: {goal: {x: 1 m, y: 2 m, yaw: 0 deg}}
    - look:
"""


def arrives(**options):
    return Step(success(pose=Pose2(1.0, 2.0, 0.0)), **options)


def process(folder, *drives, name="A", start=0.0):
    (folder / "m.yaml").write_text(MISSION)
    return Process(folder, name=name, start=start, drive=list(drives))


def goes_on_at_the_look(folder, run_id):
    """A process that takes the run up and finds that it has arrived."""
    last = process(folder, Step(None), name="Z", start=9000.0)
    assert last.executor.current is not None, last.told
    assert (last.told, last.skills["drive"].runs) == ([f"{run_id} goes on after a crash, at 'look'"], [])
    last.clock.advance(60.0)
    assert last.past(run_id).state == "SUCCEEDED"


def paused(first, seconds=1.0):
    first.executor.pause("asked")
    first.clock.advance(seconds)
    first.executor.resume()


@pytest.mark.parametrize("later_s", [0.0, 0.1, 0.5])
def test_a_skill_that_answered_at_once_after_a_pause(tmp_path, later_s):
    first = process(tmp_path, Step(None), arrives(after=0.0))
    run = first.executor.trigger(MissionRequest("m"))
    first.clock.advance(1.0)
    paused(first)
    first.clock.advance(later_s)
    assert run.status is RunStatus.RUNNING and len(first.skills["look"].runs) == 1
    goes_on_at_the_look(tmp_path, run.run_id)


def test_a_skill_that_answered_at_once_after_a_crash(tmp_path):
    first = process(tmp_path, Step(None))
    run = first.executor.trigger(MissionRequest("m"))
    first.clock.advance(1.0)
    second = process(tmp_path, arrives(after=0.0), name="B", start=5000.0)
    second.clock.advance(0.5)
    assert len(second.skills["look"].runs) == 1
    goes_on_at_the_look(tmp_path, run.run_id)


@pytest.mark.parametrize("later_s", [0.5, 2.5])
def test_a_tick_that_changed_nothing_came_before_the_pause(tmp_path, later_s):
    first = process(tmp_path, Step(None), arrives(after=2.0))
    run = first.executor.trigger(MissionRequest("m"))
    first.clock.advance(1.0)
    ticks = run.ticks
    first.executor.wake()  # as the feedback of a skill does
    first.clock.advance(0.1)
    assert run.ticks == ticks + 1
    paused(first)
    first.clock.advance(later_s)
    if later_s > 2.0:
        goes_on_at_the_look(tmp_path, run.run_id)
        return
    second = process(tmp_path, arrives(after=1.0), name="B", start=5000.0)
    assert second.told == [f"{run.run_id} goes on after a crash, at 'drive'"]
    second.clock.advance(60.0)
    assert second.past(run.run_id).state == "SUCCEEDED" and len(second.skills["drive"].runs) == 1


def test_a_skill_that_succeeded_although_it_was_cancelled_for_a_pause(tmp_path):
    first = process(tmp_path, arrives(after=1.0, cancel_takes=9.0))
    run = first.executor.trigger(MissionRequest("m"))
    first.clock.advance(0.5)
    paused(first, seconds=2.0)
    first.clock.advance(0.5)
    assert len(first.skills["drive"].runs) == len(first.skills["look"].runs) == 1
    goes_on_at_the_look(tmp_path, run.run_id)
