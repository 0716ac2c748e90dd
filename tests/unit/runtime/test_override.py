"""The manual override: everything stops, nothing drives, nothing starts until it is released."""

from __future__ import annotations

import pytest

from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.executor import RequestRefused
from florence_bt.runtime.run import MissionRequest, RunStatus, TriggerPolicy


def test_the_override_stops_all_and_blocks_until_it_is_released(bench):
    first = bench.executor.trigger(MissionRequest("drive_once"))
    second = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE))
    bench.clock.advance(1.0)
    bench.executor.override("Anna took the joystick")
    assert bench.drive.active == 0
    bench.clock.advance(1.0)
    assert (first.status, second.status) == (RunStatus.STOPPED, RunStatus.STOPPED)
    assert "manual override: Anna" in first.reason and "manual override" in second.reason
    with pytest.raises(RequestRefused, match=r"manual override is on \(Anna took the joystick\).*release"):
        bench.executor.trigger(MissionRequest("drive_once"))
    assert bench.executor.release() and not bench.executor.release()
    bench.executor.trigger(MissionRequest("drive_once"))


TIDY = """
mission: tidy
description: Drives, and drives to tidy up.
tree:
  sequence:
    - drive: {way: 1 m}
  finally:
    succeed:
      sequence:
        - wait: 4 s
        - succeed:
            drive: {way: 2 m}
        - work:
"""


@pytest.mark.parametrize("cleaning_for", [None, 2.0, 5.0], ids=["driving", "tidying", "driving to tidy"])
def test_nothing_drives_after_an_override_though_the_rest_of_the_clean_up_is_done(
    bench, tmp_path, cleaning_for
):
    bench.script_work(Step(success(pay=1), after=1.0))
    file = tmp_path / "tidy.yaml"
    file.write_text(TIDY)
    bench.executor.library.add_file(file)
    run = bench.executor.trigger(MissionRequest("tidy"))
    bench.clock.advance(1.0)
    if cleaning_for is not None:
        bench.executor.stop("enough")
        bench.clock.advance(cleaning_for)
    drives = len(bench.drive.runs)
    bench.executor.override("Anna took the joystick")
    assert bench.drive.active == 0
    bench.executor.release()
    bench.clock.advance(30.0)
    assert run.status is RunStatus.STOPPED
    assert len(bench.drive.runs) == drives, "also after the release: nothing resumes"
    assert len(bench.work.runs) == 1
    later = bench.executor.trigger(MissionRequest("drive_once"))
    bench.clock.advance(30.0)
    assert later.status is RunStatus.SUCCEEDED


def test_a_skill_that_breaks_when_it_is_cancelled_does_not_keep_the_override_away(bench):
    run = bench.executor.trigger(MissionRequest("drive_once"))
    waiting = bench.executor.trigger(MissionRequest("drive_once", policy=TriggerPolicy.QUEUE))
    bench.clock.advance(1.0)

    def break_down():
        raise RuntimeError("a bug in a skill")

    bench.drive.runs[0].cancel = break_down
    bench.executor.override("Anna took the joystick")
    assert waiting.status is RunStatus.STOPPED
    bench.clock.advance(30.0)
    assert run.status is RunStatus.STOPPED and "Anna took the joystick" in run.reason
    told = [event.data["detail"] for event in bench.events if event.kind is EventKind.BROKEN]
    assert told and all("RuntimeError: a bug in a skill" in detail for detail in told)


def test_releasing_the_override_lifts_no_other_block(bench):
    bench.executor.override("hands off")
    bench.executor.block("shutdown", "shutting down")
    bench.executor.release()
    with pytest.raises(RequestRefused, match="shutting down"):
        bench.executor.trigger(MissionRequest("drive_once"))
