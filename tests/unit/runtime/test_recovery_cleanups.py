"""Runs that died with a clean-up beside the tree, or with a skill that had just been cancelled."""

from __future__ import annotations

from functools import cache

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.run import MissionRequest, RunStatus
from tests.sweeps import sweep
from tests.unit.runtime.recovery_bench import THERE, Process

HEAD = "mission: NAME\ninputs:\n  there: {type: pose}\non_restart: resume\n"
TIDY = """
timeout: 2.2 s
do:
  sequence:
    - drive: {goal: $there}
  finally:
    sequence:
      - speak: {text: I tidy up}
      - wait: 0.7 s
      - CLEANS
      - look:
"""
MISSIONS = {
    # The tree goes on: a look each second, from 0 s to 9 s.
    "beside": "tree:\n  parallel:\n    - succeed:\nTIDY\n    - repeat: 9\n      do:\n        look:\n",
    # The tree has failed; only the clean-up is left.
    "ends": "tree:\nTIDY\n",
    # The time is up in the clean-up, which goes on where it was.
    "late": "tree:\nTIDY\n",
    "no_cleanup": "tree:\n  sequence:\n    - succeed:\n        timeout: 2 s\n        do:\n"
    "          drive: {goal: $there}\n    - repeat: 4\n      do:\n        look:\n",
}
ARRIVES = Step(success(pose=Pose2(1.0, 2.0, 0.0)), after=1.0)
SPEAKS, DRIVES = "speak: {text: it is tidy}", "drive: {goal: $there}"


def write(folder, name, cleans):
    indent = {"beside": 8, "ends": 2, "late": 2}.get(name, 0)
    tidy = "\n".join(" " * indent + line for line in TIDY.strip().replace("CLEANS", cleans).splitlines())
    if name == "late":
        tidy = tidy.replace("drive: {goal: $there}", "wait: 1.9 s", 1)
    (folder / f"{name}.yaml").write_text(HEAD.replace("NAME", name) + MISSIONS[name].replace("TIDY", tidy))


def begun(folder, name, cleans, brakes_s, *, seconds, late=None):
    """A process after some seconds of a run; its first drive never arrives and takes a while to brake."""
    folder.mkdir(exist_ok=True)
    write(folder, name, cleans)
    process = Process(folder, drive=[Step(None, cancel_takes=brakes_s), ARRIVES], late=late)
    run = process.executor.trigger(MissionRequest(name, THERE))
    process.clock.advance(seconds)
    return process, run


def over_and_done_with(process):
    """Skill -> how many of its runs have ended, or were told to."""
    return {
        name: sum(run.cancelled or not run.active for run in mock.runs)
        for name, mock in process.skills.items()
    }


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Runs a mission whose process does not die."""

    @cache  # many moments of a death are compared with it
    def run(name, cleans, brakes_s):
        return begun(tmp_path_factory.mktemp("whole"), name, cleans, brakes_s, seconds=60.0)

    return run


@pytest.mark.parametrize("tenth", sweep(range(1, 90, 4), every=3))
@pytest.mark.parametrize("brakes_s", [0.0, 0.3, 1.9])
@pytest.mark.parametrize(
    ("name", "cleans"),
    [("beside", SPEAKS), ("beside", DRIVES), ("ends", SPEAKS), ("late", SPEAKS), ("no_cleanup", SPEAKS)],
)
def test_it_goes_on_where_its_process_died(tmp_path, undisturbed, name, cleans, brakes_s, tenth):
    whole, whole_run = undisturbed(name, cleans, brakes_s)
    first, run = begun(tmp_path / "died", name, cleans, brakes_s, seconds=tenth / 10.0 + 0.05)
    if run.status.final:
        second = Process(tmp_path / "died", start=5000.0, name="B")
        assert second.executor.current is None and not second.told
        assert second.past(run.run_id).state == whole_run.status.value
        assert not any(mock.runs for mock in second.skills.values())
        return
    done = over_and_done_with(first)
    drives = [ARRIVES] if done["drive"] else [Step(None), ARRIVES]
    second = Process(tmp_path / "died", start=5000.0, name="B", drive=drives)
    assert second.executor.current is not None, second.told
    second.clock.advance(60.0)
    assert second.past(run.run_id).state == whole_run.status.value
    assert second.past(run.run_id).reason == whole_run.reason
    # What had ended is not done again; what went on is started again, once.
    for skill, mock in whole.skills.items():
        assert len(second.skills[skill].runs) == len(mock.runs) - done[skill], skill


@pytest.mark.parametrize("seed", sweep(range(24), every=3))
@pytest.mark.parametrize("name", ["beside", "ends"])
def test_timers_that_ring_late_do_not_keep_it_from_going_on(tmp_path, name, seed):
    _, run = begun(tmp_path, name, SPEAKS, 0.3, seconds=2.3 + 0.15 * seed, late=seed)
    second = Process(tmp_path, start=70.0, name="B", late=seed + 100)
    assert (second.executor.current is None) is run.status.final, second.told


@pytest.mark.parametrize("name", ["beside", "ends"])
def test_it_goes_on_after_several_crashes(tmp_path, name):
    _, run = begun(tmp_path, name, SPEAKS, 0.3, seconds=2.4)
    for number in range(3):
        process = Process(tmp_path, start=1000.0 * (number + 1), name=f"B{number}", drive=[ARRIVES])
        assert process.executor.current is not None, process.told
        process.clock.advance(0.4 + 0.5 * (number == 1))
    process.clock.advance(60.0)
    assert process.past(run.run_id).state == ("SUCCEEDED" if name == "beside" else "FAILED")
    assert not process.skills["drive"].runs


def test_a_run_that_had_failed_cleans_up_and_drives_no_more(tmp_path):
    _, run = begun(tmp_path, "ends", SPEAKS, 0.3, seconds=2.4)
    assert run.status is RunStatus.ENDING and run.code == "", "it has not ended yet"
    second = Process(tmp_path, start=5000.0, name="B", drive=[ARRIVES])
    current = second.executor.current
    assert current is not None and current.status is RunStatus.ENDING
    assert second.told == [f"{run.run_id} goes on after a crash, with its clean-up"]
    assert [mock.inputs["text"] for mock in second.skills["speak"].runs] == ["I tidy up"]
    second.clock.advance(60.0)
    assert not second.skills["drive"].runs and len(second.skills["look"].runs) == 1
    past = second.past(run.run_id)
    assert (past.state, past.code) == ("FAILED", "timed_out") and "not done within 2.2 s" in past.reason


def test_a_clean_up_that_never_ends_after_a_crash_does_not_keep_the_robot(tmp_path):
    _, run = begun(tmp_path, "ends", SPEAKS, 0.3, seconds=2.4)
    second = Process(tmp_path, start=5000.0, name="B", speak=[Step(None)])
    assert len(second.skills["speak"].runs) == 1
    second.clock.advance(3600.0)
    assert second.past(run.run_id).state == "FAILED" and second.executor.current is None
