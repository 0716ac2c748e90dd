import pytest
from py_trees.common import Status

from florence_bt.behaviours.keys import KeyReference
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.why import explain
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import cancelled, failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from tests.scripted_skill import ScriptedSkill
from tests.ticking import drain, make_context, tick_until

DRIVE = SkillDeclaration(
    "drive",
    "Drive a way",
    inputs={
        "way": Port(Kind.LENGTH, "how far", minimum=0.0, maximum=10.0),
        "speed": Port(Kind.SPEED, "how fast", default=0.3),
    },
    outputs={"driven": Port(Kind.LENGTH, "how far it went")},
    failures={"blocked": "something is in the way"},
    deadline_s=20.0,
)


def build(clock, *steps, way=2.0, keys=None, outputs=None):
    skill = ScriptedSkill(DRIVE, clock, steps)
    events = []
    context = make_context(
        clock,
        {"drive": skill},
        {"drive": DRIVE},
        keys,
        on_skill_started=lambda path, name, inputs: events.append(("started", path, name, dict(inputs))),
        on_skill_ended=lambda path, name, result: events.append(("ended", path, name, result.code)),
    )
    inputs = {} if way is None else {"way": way}
    node = RunSkill("drive", context, "drive", inputs, outputs)
    return node, skill, context, events


def test_success_writes_the_outputs_and_fills_in_defaults(clock):
    # tick at 0: RUNNING; at 3: SUCCESS
    node, skill, context, events = build(
        clock, Step(success(driven=1.9), after=3.0, feedback_at=((0.0, "driving"),)), outputs={"driven": "d"}
    )
    assert tick_until(node, clock, context) == 2
    assert (node.status, clock.now(), context.keys.read("d")) == (Status.SUCCESS, 3.0, 1.9)
    assert skill.calls == [{"way": 2.0, "speed": 0.3}]
    assert events == [
        ("started", "drive", "drive", {"way": 2.0, "speed": 0.3}),
        ("ended", "drive", "drive", "ok"),
    ]
    assert context.runs == []


def test_an_instant_run_is_over_in_one_tick_and_sets_no_timer(clock):
    node, _, context, _ = build(clock, Step(success(driven=0.0)))
    assert tick_until(node, clock, context) == 1
    assert node.status is Status.SUCCESS
    assert clock.next_time() is None


def test_feedback_is_shown_and_steady(clock):
    node, _, context, _ = build(clock, Step(success(driven=0.0), after=3.0, feedback_at=((0.0, "driving"),)))
    node.tick_once()
    node.tick_once()
    assert (node.status, node.feedback_message) == (Status.RUNNING, "driving")
    assert len(context.runs) == 1


def test_failure_keeps_code_and_reason(clock):
    node, _, context, _ = build(clock, Step(failure("blocked", "a chair is in the way"), after=1.0))
    tick_until(node, clock, context)
    why = explain(node)
    assert (node.status, why.path, why.code, why.reason) == (
        Status.FAILURE,
        "drive",
        "blocked",
        "a chair is in the way",
    )


@pytest.mark.parametrize("way", [11.0, -1.0, float("nan"), "far", True, None])
def test_bad_input_starts_nothing(clock, way):
    node, skill, context, events = build(clock, Step(), way=way)
    assert tick_until(node, clock, context) == 1
    assert node.status is Status.FAILURE
    assert node.result.code == "bad_input"
    assert "way" in node.result.reason
    assert (skill.runs, events) == ([], [])


def test_a_key_is_looked_up_when_the_skill_starts(clock):
    node, skill, context, _ = build(clock, Step(success(driven=0.0)), way=KeyReference("w"))
    context.keys.write("w", 4.0)
    tick_until(node, clock, context)
    assert skill.calls[0]["way"] == 4.0


def test_a_missing_key_is_a_failure_that_names_what_is_there(clock):
    node, skill, context, _ = build(clock, Step(), way=KeyReference("goal"), keys={"goals": 1.0})
    tick_until(node, clock, context)
    assert (node.status, node.result.code, skill.runs) == (Status.FAILURE, "missing_key", [])
    assert "'goal'" in node.result.reason and "goals" in node.result.reason


def test_a_skill_that_the_robot_lacks(clock):
    context = make_context(clock, {}, {"drive": DRIVE})
    node = RunSkill("drive", context, "drive", {"way": 1.0})
    node.tick_once()
    assert (node.status, node.result.code) == (Status.FAILURE, "no_skill")
    assert node.result.reason == "this robot has no skill drive (it has: none)"


def test_the_deadline_cancels_the_run_and_waits_for_its_end(clock):
    # 0: RUNNING; 20: FAILURE timed_out; 22: the run has ended
    node, skill, context, events = build(
        clock, Step(None, feedback_at=((0.0, "1 m to go"),), cancel_takes=2.0)
    )
    assert tick_until(node, clock, context) == 2
    assert (clock.now(), node.status, node.result.code) == (20.0, Status.FAILURE, "timed_out")
    assert node.result.reason == "drive was not done within 20 s, at the end: 1 m to go"
    assert skill.runs[0].cancelled and len(context.runs) == 1
    drain(clock, context)
    assert (clock.now(), skill.active, events[-1]) == (22.0, 0, ("ended", "drive", "drive", "cancelled"))


@pytest.mark.parametrize(
    ("result", "code", "reason"),
    [
        (cancelled("manual override"), "cancelled", "manual override"),
        (cancelled(""), "cancelled", "drive was cancelled by its server"),
        (failure("blocked", "a chair"), "blocked", "a chair"),
        (failure("blocked", ""), "blocked", "drive failed with blocked"),
    ],
)
def test_a_run_that_failed_or_was_cancelled_by_its_own_side_says_why(clock, result, code, reason):
    node, _, context, _ = build(clock, Step(result, after=1.0))
    tick_until(node, clock, context)
    assert (node.status, node.result.code, node.result.reason) == (Status.FAILURE, code, reason)


@pytest.mark.parametrize("when", [0.0, 0.5, 1.0, 2.5])
@pytest.mark.parametrize("accept_after", [0.0, 1.0])
def test_stopping_the_node_leaves_no_run(clock, when, accept_after):
    node, skill, context, events = build(
        clock, Step(success(driven=1.0), after=3.0, accept_after=accept_after, cancel_takes=0.25)
    )
    node.tick_once()
    clock.advance(when)
    node.stop(Status.INVALID)
    node.stop(Status.INVALID)  # harmless twice
    drain(clock, context)
    assert (skill.active, context.runs) == (0, [])
    assert clock.now() == pytest.approx(max(when, accept_after) + 0.25)
    assert [event[0] for event in events] == ["started", "ended"]
    assert clock.next_time() is None  # the deadline is forgotten too


def test_a_new_round_starts_a_new_run(clock):
    node, skill, context, _ = build(clock, Step(failure("blocked", "x")), Step(success(driven=1.0)))
    tick_until(node, clock, context)
    assert node.status is Status.FAILURE
    tick_until(node, clock, context)
    assert (node.status, node.result.succeeded, len(skill.runs)) == (Status.SUCCESS, True, 2)


def test_written_inputs_are_checked_once_and_given_afresh_each_time(clock):
    node, skill, context, _ = build(clock, Step(success(driven=1.0), after=0.0))
    tick_until(node, clock, context)
    skill.runs[0].inputs["way"] = 5.0
    tick_until(node, clock, context)
    assert skill.runs[1].inputs["way"] == 2.0
    context.skills.clear()  # as when a run is taken up by a robot that lacks the skill
    node.tick_once()
    assert (node.status, node.result.code) == (Status.FAILURE, "no_skill")


@pytest.mark.parametrize("outputs", [{}, {"driven": "far"}, {"driven": float("inf")}])
def test_a_success_without_the_promised_output_is_a_failure(clock, outputs):
    node, _, context, _ = build(clock, Step(success(**outputs)), outputs={"driven": "d"})
    tick_until(node, clock, context)
    assert (node.status, node.result.code, "d" in context.keys) == (Status.FAILURE, "bad_output", False)


def test_a_failure_without_a_reason_gets_one(clock):
    node, _, context, _ = build(clock, Step(failure("blocked", "")))
    tick_until(node, clock, context)
    assert node.result.reason == "drive failed with blocked"
