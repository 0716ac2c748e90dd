"""The mission server: pause, resume, the manual override, reload, and what it answers to hostile callers."""

from __future__ import annotations

import time

import pytest

pytest.importorskip("rclpy")
from std_msgs.msg import String

from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.ros.conversions import stamp_to_ros
from florence_bt.ros.qos import RELIABLE

pytestmark = pytest.mark.ros

BRANCHES = (
    "description: Reads and writes keys.\ninputs:\n  way: {type: length, default: 1 m, min: 0.5 m}\n"
    "outputs:\n  far: {type: length, description: how far}\n"
    "tree:\n  sequence:\n    - set: {far: $way}\n    - drive: {way: $far}\n"
)


def test_pause_and_resume(bench_of):
    bench = bench_of(Step(None), Step(success(), after=0.1))
    assert "no mission is running" in bench.pause().message and not bench.resume().success
    run_id = bench.run("drive_once").run_id
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    assert not bench.pause("another").success and "'another'" in bench.pause("another").message
    assert not bench.resume().success and "is not paused" in bench.resume().message
    paused = bench.pause(run_id, "a visitor")
    assert paused.success and paused.message == f"{run_id} is paused"
    status = bench.wait("PAUSED")
    assert status.reason == "a visitor" and bench.drive.runs[0].cancelled and not bench.drive.active
    again = bench.pause(reason="somebody else")
    assert again.success and again.message == f"{run_id} is paused already, because: a visitor"
    busy = bench.run("be_quick")
    assert not busy.accepted
    assert bench.resume().success
    assert bench.wait("SUCCEEDED").run_id == run_id and len(bench.drive.calls) == 2


def test_a_start_and_a_resume_that_come_after_their_date_do_nothing(bench_of):
    """A server that hangs keeps what it was asked: hours later nobody wants it any more."""
    from florence_interfaces.srv import ResumeMission, RunMission

    bench = bench_of()
    past, future = stamp_to_ros(time.time() - 0.5), stamp_to_ros(time.time() + 600.0)
    late = bench.call(RunMission, "run_mission", mission="drive_once", valid_until=past)
    assert not late.accepted and "after the date" in late.message and not bench.drive.runs
    run_id = bench.call(RunMission, "run_mission", mission="drive_once", valid_until=future).run_id
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    assert bench.pause(run_id).success
    bench.wait("PAUSED")
    late = bench.call(ResumeMission, "resume", valid_until=past)
    assert not late.success and "after the date" in late.message
    assert bench.status().state == "PAUSED"


def test_breakpoints_pause_a_run_before_its_node_and_a_stop_works_as_always(bench_of):
    bench = bench_of(Step(success(), after=0.1))
    run_id = bench.run_with_breakpoint("drive_once", "drive").run_id
    status = bench.wait("PAUSED")
    assert status.run_id == run_id and "drive" in status.reason and "breakpoint" in status.tree
    assert not bench.drive.runs
    assert bench.call_step().success
    assert bench.wait("SUCCEEDED").run_id == run_id and len(bench.drive.runs) == 1
    second = bench.run("drive_once").run_id
    assert bench.wait("PAUSED").run_id == second
    assert bench.stop().success and bench.wait("STOPPED").run_id == second
    assert not bench.call_step().success and len(bench.drive.runs) == 1
    assert not bench.breakpoints(remove=["no such node"]).success
    assert bench.breakpoints(clear=True).breakpoints == []


def test_a_step_that_comes_after_its_date_does_nothing(bench_of):
    from florence_interfaces.srv import ResumeMission

    bench = bench_of()
    bench.run_with_breakpoint("drive_once", "drive")
    bench.wait("PAUSED")
    late = bench.call(ResumeMission, "step", valid_until=stamp_to_ros(time.time() - 0.5))
    assert not late.success and bench.status().state == "PAUSED" and not bench.drive.runs


def test_a_paused_mission_can_be_stopped(bench_of):
    bench = bench_of()
    bench.run("drive_once")
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    assert bench.pause().success
    assert bench.stop().success
    assert bench.wait("STOPPED").code == "stopped"


def test_the_override_stops_everything_and_blocks_until_released(bench_of):
    bench = bench_of()
    current = bench.run("drive_once").run_id
    waiting = bench.run("drive_once", policy="queue").run_id
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    assert bench.status().waiting == [waiting] and bench.status().blocked_by == ""
    who = bench.node.create_publisher(String, "manual_override_by", RELIABLE)
    bench.ros.spin_until(who.get_subscription_count, what="the mission server")
    who.publish(String(data="page (run)"))
    bench.ros.spin_for(0.2)
    bench.override(True)
    bench.ros.spin_until(lambda: bench.status().blocked_by, what="the override")
    for each in (current, waiting):
        reason = bench.wait("STOPPED", each).reason
        assert "manual override" in reason and "page (run)" in reason
    assert bench.drive.runs[0].cancelled
    refused = bench.run("be_quick", policy="preempt", priority=9)
    assert not refused.accepted and "florence release" in refused.message
    assert not bench.trigger("be_quick").success
    bench.override(False)
    bench.ros.spin_until(lambda: not bench.status().blocked_by, what="the release")
    assert bench.status().state == "STOPPED", "nothing resumes"
    assert bench.run("be_quick").accepted


def test_who_switches_the_override_counts_for_that_switch_only(bench_of):
    bench = bench_of()
    who = bench.node.create_publisher(String, "manual_override_by", RELIABLE)
    bench.ros.spin_until(who.get_subscription_count, what="the mission server")

    def switch(on, by=""):
        if by:
            who.publish(String(data=by))
            bench.ros.spin_for(0.2)
        bench.override(on)
        bench.ros.spin_until(lambda: bool(bench.status().blocked_by) is on, what=f"the override {on}")
        return bench.status().blocked_by

    assert "Anna" in switch(True, "Anna")
    bench.override(True)
    bench.driver.override.tell_state()
    bench.ros.spin_for(0.1)
    assert "Anna" in bench.status().blocked_by, "the driver says again that it is on"
    switch(False, "Anna")
    reason = switch(True)
    assert "manual override" in reason and "Anna" not in reason


def test_an_override_that_was_on_and_released_while_the_server_hung_ends_everything(bench_of):
    """Of a latched topic only the last message is left: that the override is off."""
    from builtin_interfaces.msg import Time
    from florence_interfaces.msg import ManualOverride

    from florence_bt.ros.qos import LATCHED

    bench = bench_of()
    state = bench.node.create_publisher(ManualOverride, "manual_override_state", LATCHED)
    state.publish(ManualOverride(stops=1, switched_on=Time(sec=1_700_000_000)))
    runs = [bench.run("drive_once", policy="queue").run_id for _ in range(2)]
    bench.ros.spin_for(0.2)
    assert bench.status().state == "RUNNING", "that was before the runs"
    state.publish(ManualOverride(stops=2, switched_on=Time(sec=1_700_000_900)))
    for run_id in runs:
        assert "manual override" in bench.wait("STOPPED", run_id).reason
    assert bench.run("be_quick").accepted


def test_a_false_without_an_override_changes_nothing(bench_of):
    bench = bench_of()
    bench.run("drive_once")
    bench.override(False)
    bench.ros.spin_for(0.1)
    assert bench.status().state == "RUNNING"


def test_reload_takes_good_edits_and_keeps_what_worked(bench_of):
    from florence_interfaces.srv import ListMissions, ReloadMissions

    bench = bench_of()
    assert bench.call(ReloadMissions, "reload_missions").report == "nothing has changed"
    (bench.missions / "branches.yaml").write_text(f"mission: branches\n{BRANCHES}")
    (bench.missions / "drive_once.yaml").write_text("mission: drive_once\ntree:\n  driv: {way: 1 m}\n")
    (bench.missions / "drive_far.yaml").unlink()
    answer = bench.call(ReloadMissions, "reload_missions")
    assert not answer.success
    for part in ("branches: reloaded", "drive_far: removed", "drive_once", "driv"):
        assert part in answer.report, answer.report
    listed = bench.call(ListMissions, "list_missions")
    assert "branches" in listed.names and "drive_far" not in listed.names
    (branches,) = (mission for mission in listed.missions if mission.name == "branches")
    (way,) = branches.inputs
    assert (way.name, way.type, way.required, way.default_value) == ("way", "length", False, "1 m")
    assert (way.minimum, way.maximum) == ("0.5 m", "") and branches.problem == ""
    assert [port.name for port in branches.outputs] == ["far"] and branches.on_restart == "abort"
    assert branches.file.endswith("branches.yaml")
    (wrong,) = (mission for mission in listed.missions if mission.name == "wrong")
    assert "driv" in wrong.problem
    bench.ros.spin_until(
        lambda: "/florence_bt/missions/branches" in dict(bench.node.get_service_names_and_types()),
        what="the trigger of the new mission",
    )
    started = bench.run("drive_once")
    assert started.accepted and "drive_once" in started.message and "driv" in started.message


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"mission": "x" * 5000}, "the name of the mission is too long"),
        ({"mission": "drive_once", "input_names": ["way"] * 2, "input_values": ["1 m"] * 2}, "given twice"),
        ({"mission": "drive_once", "input_names": ["w"] * 99, "input_values": ["1"] * 99}, "99 inputs"),
        ({"mission": "drive_once", "caller": "a\x1b[31mb"}, "cannot be printed"),
        (
            {"mission": "drive_once", "input_names": ["way"], "input_values": ["1" * 10_000]},
            "the value of the input 'way' is too long",
        ),
    ],
)
def test_a_hostile_caller_gets_one_clear_sentence(bench_of, fields, message):
    from florence_interfaces.srv import RunMission

    bench = bench_of()
    answer = bench.call(RunMission, "run_mission", **fields)
    assert not answer.accepted and message in answer.message and len(answer.message) < 500
    assert not bench.drive.runs


def test_reasons_are_bounded_too(bench_of):
    bench = bench_of()
    bench.run("drive_once")
    assert "too long" in bench.pause(reason="x" * 5000).message
    assert "too long" in bench.stop("y" * 5000).message
    assert bench.status().state == "RUNNING"


def test_the_action_tells_the_cause_and_the_outputs(bench_of):
    from florence_interfaces.action import ExecuteMission
    from rclpy.action import ActionClient

    bench = bench_of(Step(success()))
    (bench.missions / "branches.yaml").write_text(f"mission: branches\n{BRANCHES}")
    bench.run("branches")  # new files count at the next trigger
    bench.wait("SUCCEEDED")
    client = ActionClient(bench.node, ExecuteMission, "florence_bt/execute_mission")
    bench.node.on_close(client.destroy)
    bench.ros.spin_until(client.server_is_ready, what="the action")
    sent = client.send_goal_async(
        ExecuteMission.Goal(mission="branches", input_names=["way"], input_values=["2.5 m"], caller="me")
    )
    bench.ros.spin_until(sent.done, what="the acceptance")
    ended = sent.result().get_result_async()
    bench.ros.spin_until(ended.done, what="the result")
    result = ended.result().result
    assert dict(zip(result.output_names, result.output_values, strict=True)) == {"far": "2.5 m"}
    assert "outputs far: 2.5 m" in bench.status(result.run_id).tree.splitlines()
    assert bench.status(result.run_id).caller == "me"


def test_a_crashed_run_is_taken_up_when_the_base_is_safe(bench_of, ros, tmp_path):
    """The process before died on a run: the journal says so, and the base is made safe first."""
    from florence_bt.core.clock import ManualClock
    from florence_bt.runtime.events import EventKind, RunEvent
    from florence_bt.runtime.journal import Journal
    from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus

    journal = Journal(tmp_path / "runs")
    run = MissionRun("20200101T000000Z-001-drive_once", MissionRequest("drive_once"), {"way": 1.0})
    run.status, run.started = RunStatus.RUNNING, 1.0
    journal.write(run, RunEvent(ManualClock(1.0).now(), run.run_id, EventKind.STARTED, {}))
    journal.close()
    bench = bench_of()
    assert bench.safety.made_safe == 1
    status = bench.status(run.run_id)
    assert (status.state, status.code) == ("ABORTED", "crashed"), status
    assert bench.run("be_quick").accepted
