"""The mission server alone: its services, action and topics over skills that follow scripts."""

from __future__ import annotations

import json

import pytest

from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime import missions as missions_module
from florence_bt.runtime.journal import JournalReader

pytestmark = pytest.mark.ros


@pytest.mark.parametrize(
    ("mission", "inputs", "policy", "message"),
    [
        ("drive_onc", {}, "", "drive_once"),
        ("", {}, "", "there is no mission ''"),
        ("torn", {}, "", "torn.yaml"),
        ("wrong", {}, "", "driv"),
        ("not-a-ros-name", {}, "", "not-a-ros-name.yaml"),
        ("drive_once", {"weigh": "1 m"}, "", "no input 'weigh'"),
        ("drive_once", {"way": "9 m"}, "", "way"),
        ("drive_once", {"way": "1 kg"}, "", "way"),
        ("drive_far", {}, "", "way is missing"),
        ("drive_once", {}, "perhaps", "unknown policy 'perhaps'.*reject, queue, preempt"),
    ],
)
def test_a_bad_trigger_is_answered_with_what_works(bench_of, mission, inputs, policy, message):
    import re

    bench = bench_of()
    answer = bench.run(mission, policy=policy, **inputs)
    assert not answer.accepted and answer.run_id == "" and re.search(message, answer.message), answer.message
    assert bench.status().tree == "no mission has run yet" and not bench.drive.runs


def test_names_without_values_are_refused(bench_of):
    from florence_interfaces.srv import RunMission

    answer = bench_of().call(RunMission, "run_mission", mission="drive_once", input_names=["way"])
    assert not answer.accepted and "1 input names came with 0 values" in answer.message


def test_a_run_from_trigger_to_record(bench_of):
    bench = bench_of()
    answer = bench.run("drive_once", way="2 m")
    assert answer.accepted and answer.message == "drive_once starts"
    status = bench.wait("RUNNING")
    assert status.run_id == answer.run_id and status.mission == "drive_once" and "[>] drive" in status.tree
    assert bench.drive.calls == [{"way": 2.0}]
    bench.end_drive(failure("blocked", "a chair is in the way"))
    status = bench.wait("FAILED", answer.run_id)
    assert (status.code, status.reason) == ("blocked", "a chair is in the way") and "[x] drive" in status.tree
    assert bench.status().run_id == answer.run_id
    assert [record.folder for record in bench.recorded] == [bench.runs / answer.run_id]


def test_a_trigger_reads_each_mission_file_once(bench_of, monkeypatch):
    bench = bench_of()
    read = []
    look = missions_module._fingerprint
    monkeypatch.setattr(missions_module, "_fingerprint", lambda path: (read.append(path), look(path))[1])
    assert bench.run("drive_once").accepted
    assert read and len(read) == len(set(read))


def test_called_missions_are_folded_for_people_and_whole_in_the_records(bench_of):
    from florence_interfaces.srv import MissionStatus

    bench = bench_of()
    (bench.missions / "go.yaml").write_text(
        "mission: go\ntree:\n  sequence: [{run: be_quick}, {run: drive_once}, {run: be_quick, name: rest}]\n"
    )
    (bench.missions / "be_quick.yaml").write_text(
        "mission: be_quick\ntree: {sequence: [{wait: 1 ms, name: a moment}]}\n"
    )
    _, trees = bench.listen()
    run_id = bench.run("go").run_id
    status = bench.wait("RUNNING", run_id)
    assert "[>] drive" in status.tree and "a moment" not in status.tree
    whole = bench.call(MissionStatus, "whole_status", run_id=run_id)
    assert whole.run_id == run_id and "[>] drive" in whole.tree and "[+] a moment" in whole.tree
    bench.end_drive(success())
    status = bench.wait("SUCCEEDED", run_id)
    bench.ros.spin_until(lambda: "SUCCEEDED" in trees[-1].data, what="the last tree")
    for text in (status.tree, trees[-1].data):
        assert "[+] run drive_once" in text and "[+] rest" in text and "a moment" not in text
    assert "[+] a moment" in (bench.runs / run_id / "tree.txt").read_text()
    with JournalReader(bench.runs) as journal:
        assert "[+] a moment" in journal.run(run_id).tree


def test_triggers_by_name_are_served_for_missions_without_required_inputs(bench_of):
    bench = bench_of()
    answer = bench.trigger("drive_once")
    assert answer.success and "run " in answer.message
    again = bench.trigger("drive_once")
    assert not again.success and "is running" in again.message
    bench.end_drive(success())
    bench.wait("SUCCEEDED")
    names = {name for name, _ in bench.node.get_service_names_and_types()}
    assert "/florence_bt/missions/be_quick" in names
    assert not any(word in name for name in names for word in ("drive_far", "not-a-ros-name", "torn"))


def test_the_topic_of_the_document_starts_and_stops_the_search(bench_of):
    from std_msgs.msg import Bool

    bench = bench_of(Step(None, cancel_takes=0.1))
    (bench.missions / "detect_user.yaml").write_text("mission: detect_user\ntree:\n  drive: {}\n")
    command = bench.node.create_publisher(Bool, "detect_user/cmd", 10)
    bench.ros.spin_until(lambda: command.get_subscription_count() == 1, what="the mission server")
    command.publish(Bool(data=False))
    command.publish(Bool(data=True))
    status = bench.wait("RUNNING")
    assert status.mission == "detect_user"
    command.publish(Bool(data=True))
    command.publish(Bool(data=False))
    status = bench.wait("STOPPED")
    assert status.reason.startswith("false on detect_user/cmd")
    assert len(bench.drive.runs) == 1, "a second true while it runs is refused"
    other = bench.run("drive_once").run_id
    command.publish(Bool(data=False))
    bench.wait("RUNNING", other)
    bench.ros.spin_for(0.3)
    assert bench.status(other).state == "RUNNING", "false stops no other mission"


def test_older_runs_are_told_from_their_records(bench_of):
    bench = bench_of()
    first = bench.run("be_quick").run_id
    bench.wait("SUCCEEDED", first)
    second = bench.run("be_quick").run_id
    bench.wait("SUCCEEDED", second)
    old = bench.status(first)
    assert old.found and (old.run_id, old.mission, old.state) == (first, "be_quick", "SUCCEEDED")
    assert "be_quick: SUCCEEDED" in old.tree
    unknown = bench.status("../runs")
    assert not unknown.found and "no run '../runs'" in unknown.tree


def test_stops(bench_of):
    bench = bench_of(Step(None, cancel_takes=0.1))
    assert bench.stop().message == "no mission is running" and not bench.stop("T-1").success
    run_id = bench.run("drive_once").run_id
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    assert "'T-1'" in bench.stop("T-1").message and bench.drive.active
    stopped = bench.stop(run_id)
    assert stopped.success and stopped.message == f"{run_id} stops"
    status = bench.wait("STOPPED")
    assert status.reason == "a test wants it (was at 'drive')" and bench.drive.runs[0].cancelled


def test_queue_and_preemption(bench_of):
    bench = bench_of(Step(None), Step(success(), after=0.05))
    first = bench.run("drive_once", priority=2)
    waiting = bench.run("drive_once", policy="queue")
    assert waiting.accepted and "waits" in waiting.message
    assert bench.status(waiting.run_id).state == "QUEUED"
    assert bench.status().run_id == first.run_id
    low = bench.run("be_quick", policy="preempt", priority=1)
    assert not low.accepted and "priority 2" in low.message
    high = bench.run("be_quick", policy="preempt", priority=3)
    assert high.accepted
    for run_id, state in (
        (high.run_id, "SUCCEEDED"),
        (waiting.run_id, "SUCCEEDED"),
        (first.run_id, "STOPPED"),
    ):
        bench.wait(state, run_id)
    results = {
        r: json.loads((bench.runs / r / "result.json").read_text())
        for r in (first.run_id, high.run_id, waiting.run_id)
    }
    assert "preempted by" in results[first.run_id]["reason"]
    starts = [results[run.run_id]["started"] for run in (first, high, waiting)]
    assert starts == sorted(starts)


def test_who_joins_late_hears_of_the_run_that_goes_on(bench_of):
    bench = bench_of()
    states, trees = bench.listen()
    bench.ros.spin_until(lambda: states, what="the first state")
    assert states[-1].state == "IDLE" and not trees
    first = bench.run("drive_once")
    waiting = bench.run("drive_once", policy="queue")
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    states, trees = bench.listen()
    bench.ros.spin_until(lambda: states and trees, what="the latched messages")
    assert (states[0].run_id, states[0].state, states[0].mission) == (first.run_id, "ACTIVE", "drive_once")
    assert "[>] drive" in trees[0].data and "drive_once: RUNNING" in trees[0].data
    assert bench.stop(waiting.run_id).success
    states, trees = bench.listen()
    bench.ros.spin_until(lambda: states and trees, what="the latched messages")
    assert states[0].run_id == first.run_id and first.run_id in trees[0].data
    bench.stop()
    bench.ros.spin_until(lambda: states[-1].state == "PREEMPTED", what="the end")
    bench.ros.spin_until(lambda: "stopped because: a test wants it" in trees[-1].data, what="the last tree")


def test_missions_are_listed_and_checked(bench_of):
    from florence_interfaces.srv import CheckMission, ListMissions

    bench = bench_of()
    listed = bench.call(ListMissions, "list_missions")
    missions = dict(zip(listed.names, listed.descriptions, strict=True))
    assert missions["drive_once"] == "Drives once." and "goto_user" in missions and "torn" not in missions
    assert bench.call(CheckMission, "check_mission", mission="drive_once").ok
    for mission, text in (("wrong", "driv"), ("torn", "torn.yaml"), ("drive_onc", "drive_once")):
        answer = bench.call(CheckMission, "check_mission", mission=mission)
        assert not answer.ok and text in answer.report


def test_runs_that_cannot_be_recorded_still_run(bench_of):
    bench = bench_of(Step(success(), after=0.05))
    bench.runs.write_text("a file where the folder should be")
    bench.run("drive_once")
    bench.wait("SUCCEEDED")
    assert bench.recorded == []


def send(bench, feedback=None, **goal):
    from florence_interfaces.action import ExecuteMission
    from rclpy.action import ActionClient

    if not hasattr(bench, "action"):
        bench.action = ActionClient(bench.node, ExecuteMission, "florence_bt/execute_mission")
        bench.node.on_close(bench.action.destroy)
    bench.ros.spin_until(bench.action.server_is_ready, what="the action")
    heard = feedback if feedback is not None else []
    future = bench.action.send_goal_async(
        ExecuteMission.Goal(**goal), feedback_callback=lambda message: heard.append(message.feedback)
    )
    bench.ros.spin_until(future.done, what="the acceptance")
    return future.result()


def result_of(bench, goal):
    future = goal.get_result_async()
    bench.ros.spin_until(future.done, what="the result")
    return future.result()


def test_the_action_runs_a_mission_and_tells_its_tree(bench_of):
    from action_msgs.msg import GoalStatus

    bench = bench_of()
    feedback = []
    goal = send(bench, feedback, mission="drive_once", input_names=["way"], input_values=["2 m"])
    assert goal.accepted
    bench.ros.spin_until(lambda: feedback, what="the feedback")
    bench.end_drive(success())
    answer = result_of(bench, goal)
    assert answer.status == GoalStatus.STATUS_SUCCEEDED
    assert (answer.result.state, answer.result.code) == (
        "SUCCEEDED",
        "ok",
    ) and "[+] drive" in answer.result.tree
    assert feedback[0].tip == "drive" and "[>] drive" in feedback[0].tree
    assert feedback[0].run_id == answer.result.run_id and bench.drive.calls == [{"way": 2.0}]


def test_the_action_refuses_and_fails(bench_of):
    from action_msgs.msg import GoalStatus

    bench = bench_of(Step(failure("blocked", "a chair"), after=0.05))
    refused = result_of(bench, send(bench, mission="drive_onc"))
    assert refused.status == GoalStatus.STATUS_ABORTED and refused.result.run_id == ""
    assert refused.result.code == "rejected" and "drive_once" in refused.result.reason
    assert not bench.drive.calls
    answer = result_of(bench, send(bench, mission="drive_once"))
    assert answer.status == GoalStatus.STATUS_ABORTED
    assert (answer.result.state, answer.result.code, answer.result.reason) == ("FAILED", "blocked", "a chair")


def test_a_cancel_of_the_action_stops_the_mission(bench_of):
    from action_msgs.msg import GoalStatus

    bench = bench_of(Step(None, cancel_takes=0.1))
    goal = send(bench, mission="drive_once")
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    cancel = goal.cancel_goal_async()
    bench.ros.spin_until(cancel.done, what="the answer to the cancel")
    answer = result_of(bench, goal)
    assert answer.status == GoalStatus.STATUS_CANCELED and answer.result.state == "STOPPED"
    assert "cancelled by the action client" in answer.result.reason and not bench.drive.active


def test_a_newer_goal_of_the_action_leaves_no_older_run_behind(bench_of):
    from action_msgs.msg import GoalStatus

    bench = bench_of()
    service = bench.run("drive_once")
    older = send(bench, mission="drive_once", policy="queue")
    assert older.accepted
    # Its result would have to wait for the older one's place: that is what the service is for.
    refused = result_of(bench, send(bench, mission="drive_once", policy="queue")).result
    assert refused.code == "rejected" and "use the service run_mission" in refused.reason
    newer = send(bench, mission="be_quick", policy="preempt")
    assert newer.accepted
    replaced = result_of(bench, older)
    assert replaced.status == GoalStatus.STATUS_ABORTED
    assert (replaced.result.state, replaced.result.code) == ("STOPPED", "stopped"), replaced
    assert "a newer goal of the action" in replaced.result.reason and replaced.result.run_id
    assert result_of(bench, newer).result.state == "SUCCEEDED"
    bench.ros.spin_for(0.1)
    assert len(bench.drive.runs) == 1 and bench.status(service.run_id).state == "STOPPED"


def test_shutting_down_cancels_the_skill_and_completes_the_record(bench_of):
    bench = bench_of(Step(None, cancel_takes=5.0))
    run_id = bench.run("drive_once").run_id
    waiting = bench.run("drive_once", policy="queue").run_id
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    bench.ros.close_node(bench.server)
    assert [run.cancelled for run in bench.drive.runs] == [True]
    for each in (run_id, waiting):
        result = json.loads((bench.runs / each / "result.json").read_text())
        assert result["status"] == "STOPPED" and "shutting down" in result["reason"]
    with JournalReader(bench.runs) as journal:
        for each in (run_id, waiting):
            assert journal.run(each).state == "STOPPED" and journal.events(each)[-1].kind == "ended"
        assert not journal.unfinished()
    assert bench.recorded == []  # no pictures while the system goes down


@pytest.mark.parametrize(
    ("name", "inputs", "way"),
    [
        (
            "follow_me",
            {"desired_follow_distance": "length", "max_lin_speed": "speed", "max_ang_speed": "number"},
            "$x + $desired_follow_distance",
        ),
        (
            "approach_me",
            {
                "desired_distance": "length",
                "desired_p2r_orientation": "angle",
                "desired_r2p_orientation": "angle",
                "max_lin_speed": "speed",
                "max_ang_speed": "number",
            },
            "$x + $desired_distance",
        ),
    ],
)
def test_the_documents_actions_with_a_person_run_the_missions_of_that_name(bench_of, name, inputs, way):
    from action_msgs.msg import GoalStatus
    from rclpy.action import ActionClient

    from florence_bt.runtime.node import _mission_action

    action = getattr(_mission_action, name.upper())
    bench = bench_of(Step(None, cancel_takes=0.1))
    declared = "\n".join(
        f"  {field}: {{type: {kind}}}" for field, kind in {"x": "length", "y": "length", **inputs}.items()
    )
    tree = f"tree: {{drive: {{way: '${{{way}}}'}}}}"
    (bench.missions / f"{name}.yaml").write_text(f"mission: {name}\ninputs:\n{declared}\n{tree}\n")
    # Waits for the check of the new file; a goal that comes meanwhile is refused.
    assert not bench.run("nothing").accepted
    client = ActionClient(bench.node, action.type, name)
    bench.node.on_close(client.destroy)
    said_by_skill = action.skill_type.Impl.FeedbackMessage
    feedback = bench.node.create_publisher(said_by_skill, f"{action.skills[-1]}/_action/feedback", 10)
    bench.ros.spin_until(client.server_is_ready, what="the action")
    bench.ros.spin_until(lambda: feedback.get_subscription_count() == 1, what="the mission server")
    said = []

    def goal(**fields):
        future = client.send_goal_async(action.type.Goal(**fields), feedback_callback=said.append)
        bench.ros.spin_until(future.done, what="the answer to the goal")
        return future.result()

    def reason(answer):
        return getattr(answer.result, "reason", None)

    first = goal(x=1.5, y=-0.25, **{next(iter(inputs)): 0.5})
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    assert bench.drive.calls == [{"way": 2.0}]
    feedback.publish(said_by_skill(feedback=action.skill_type.Feedback(x=1.0, y=0.5)))
    bench.ros.spin_until(lambda: said, what="the feedback")
    assert (said[0].feedback.x, said[0].feedback.y) == (1.0, 0.5)
    # A newer goal takes the place of the older one, and of nothing else.
    second = goal(x=2.0)
    older = result_of(bench, first)
    assert (older.status, older.result.x, older.result.y) == (GoalStatus.STATUS_ABORTED, 1.0, 0.5)
    assert reason(older) is None or "newer goal" in reason(older)
    cancel = second.cancel_goal_async()
    bench.ros.spin_until(cancel.done, what="the answer to the cancel")
    ended = result_of(bench, second)
    assert (ended.status, ended.result.x, ended.result.y) == (GoalStatus.STATUS_CANCELED, 2.0, 0.0)
    bench.ros.spin_until(lambda: not bench.drive.active, what="the end of the first")
    other = bench.run("drive_once").run_id
    bench.wait("RUNNING", other)
    refused = result_of(bench, goal(x=1.0))
    assert refused.status == GoalStatus.STATUS_ABORTED
    assert reason(refused) is None or "drive_once" in reason(refused)
    assert bench.status(other).state == "RUNNING"
    for bad, says in (({"x": float("nan")}, "x is nan"), ({next(iter(inputs)): -0.5}, " is -0.5")):
        before = bench.server.health.refused[name]
        wrong = result_of(bench, goal(**bad))
        assert wrong.status == GoalStatus.STATUS_ABORTED
        assert reason(wrong) is None or says in reason(wrong)
        assert bench.server.health.refused[name] == before + 1


def test_who_is_late_is_told_in_the_status_as_long_as_it_is(bench_of):
    from florence_bt.ros.node import FlorenceNode

    bench = bench_of()
    busy = bench.ros.add(FlorenceNode("busy"))
    told = "warning: the process of busy is 3.2 s behind"
    busy.health.count_late(3.2)
    bench.ros.spin_until(lambda: told in bench.status().tree, what="the status without a run")
    bench.run("drive_once", way="2 m")
    assert told in bench.wait("RUNNING").tree
    bench.ros.close_node(busy)
    bench.ros.spin_until(lambda: told not in bench.status().tree, what="that it is gone")
