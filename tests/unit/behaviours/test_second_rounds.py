"""A node that begins again has forgotten its last round: result, message, branch and what ran below it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from florence_bt.behaviours.branching import If, Switch
from florence_bt.behaviours.catching import OnFailure
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.decorators import Invert, StartGuard, While
from florence_bt.behaviours.expressions import CompiledExpression
from florence_bt.behaviours.keys import KeyReference
from florence_bt.behaviours.leaves import AppendToKeys, Condition, Fail, SetKey
from florence_bt.behaviours.pacing import Timeout, Wait
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.ticking.ticker import Ticker
from florence_bt.behaviours.why import explain
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from tests.scripted_skill import ScriptedSkill
from tests.ticking import make_context

FREE = CompiledExpression("$free", lambda keys: keys.read("free"), ("free",))
VALUE = KeyReference("value")


class Leaf(Behaviour):
    """Does as a key says, and notes how it was left."""

    def __init__(self, name: str, context: TreeContext, key: str = "ends") -> None:
        super().__init__(name)
        self.left: list[Status] = []
        self._context, self._key = context, key

    def update(self) -> Status:
        return Status[self._context.keys.read(self._key)]

    def terminate(self, new_status: Status) -> None:
        self.left.append(new_status)


Make = Callable[[TreeContext], Behaviour]
NODES: dict[str, tuple[Make, dict[str, Any], dict[str, Any], str]] = {
    "wait": (lambda context: Wait("n", context, VALUE), {}, {"value": 0}, "missing_key"),
    "set": (lambda context: SetKey("n", context, {"other": VALUE}), {}, {"value": 3}, "missing_key"),
    "append": (
        lambda context: AppendToKeys("n", context, {"list": VALUE}),
        {"list": ()},
        {"value": 3},
        "missing_key",
    ),
    "condition": (
        lambda context: Condition("n", context, FREE),
        {"free": False},
        {"free": True},
        "condition_false",
    ),
    "timeout": (
        lambda context: Timeout("n", Leaf("leaf", context), context, VALUE),
        {"ends": "SUCCESS"},
        {"value": 2.0},
        "missing_key",
    ),
    "while": (
        lambda context: While("n", Leaf("leaf", context), context, FREE),
        {"ends": "SUCCESS", "free": False},
        {"free": True},
        "guard_failed",
    ),
    "guard": (
        lambda context: StartGuard("n", Leaf("leaf", context), context, holds=FREE),
        {"ends": "SUCCESS", "free": False},
        {"free": True},
        "guard_failed",
    ),
    "invert": (
        lambda context: Invert("n", Leaf("leaf", context)),
        {"ends": "SUCCESS"},
        {"ends": "FAILURE"},
        "unexpected_success",
    ),
    "if": (
        lambda context: If("n", context, FREE, Leaf("leaf", context)),
        {"ends": "SUCCESS"},
        {"free": True},
        "missing_key",
    ),
    "switch": (
        lambda context: Switch("n", context, VALUE, [((1,), Leaf("leaf", context))], labels=["1"]),
        {"ends": "SUCCESS", "value": 7},
        {"value": 1},
        "no_case",
    ),
}


@pytest.mark.parametrize("ticked_by", ["py_trees", "the ticker"])
@pytest.mark.parametrize("name", NODES)
def test_a_node_that_failed_and_then_succeeds_says_nothing_of_the_failure(
    clock: ManualClock, name: str, ticked_by: str
) -> None:
    make, before, then, code = NODES[name]
    context = make_context(clock, keys=before)
    node: Any = make(context)
    tick = Ticker(node).tick if ticked_by == "the ticker" else node.tick_once
    tick()
    why = explain(node)
    assert node.status is Status.FAILURE and why is not None
    assert (why.path, why.code) == ("n", code)
    assert node.feedback_message == node.result.reason == why.reason
    for key, value in then.items():
        context.keys.write(key, value)
    tick()
    assert node.status is Status.SUCCESS
    assert node.result is None
    assert why.reason not in node.feedback_message


@pytest.mark.parametrize(
    "make", [lambda context: Fail("n", context, "no"), lambda context: Wait("n", context, 1.0)]
)
def test_a_leaf_that_was_never_ticked_has_no_result(clock: ManualClock, make: Make) -> None:
    node: Any = make(make_context(clock))
    assert (node.result, node.feedback_message) == (None, "")


def test_a_reason_is_made_anew_in_each_round(clock: ManualClock) -> None:
    context = make_context(clock, keys={"value": "one"})
    node = Fail("n", context, VALUE, "own")
    for value in ("one", "two"):
        context.keys.write("value", value)
        node.tick_once()
        why = explain(node)
        assert why is not None and (why.code, why.reason) == ("own", value)


def test_the_current_child_is_the_one_that_runs_the_question_or_the_branch(clock: ManualClock) -> None:
    context = make_context(clock, keys={"ends": "RUNNING", "then": "RUNNING", "else": "RUNNING"})
    asked, then, other = Leaf("asked", context), Leaf("then", context, "then"), Leaf("else", context, "else")
    node = If("n", context, asked, then, other)
    node.tick_once()
    assert (node.status, node.current_child, node.cause) == (Status.RUNNING, asked, None)
    context.keys.write("ends", "FAILURE")
    node.tick_once()
    assert (node.current_child, node.cause) == (other, other)
    context.keys.write("else", "SUCCESS")
    node.tick_once()
    assert node.status is Status.SUCCESS
    context.keys.write("ends", "RUNNING")
    node.tick_once()
    assert (node.current_child, node.cause) == (asked, None), "a new round has no branch yet"


def test_an_if_without_memory_stops_the_branch_that_it_leaves(clock: ManualClock) -> None:
    context = make_context(clock, keys={"free": True, "ends": "RUNNING"})
    then, other = Leaf("then", context), Leaf("else", context)
    node = If("n", context, FREE, then, other, memory=False)
    node.tick_once()
    assert (then.status, other.status, node.feedback_message) == (
        Status.RUNNING,
        Status.INVALID,
        "holds (free is true)",
    )
    context.wake.take()  # type: ignore[attr-defined]
    context.keys.write("free", True)
    assert not context.wake.asked  # type: ignore[attr-defined]
    context.keys.write("free", False)
    assert context.wake.asked, "another answer asks for a tick"  # type: ignore[attr-defined]
    node.tick_once()
    assert (then.status, then.left, other.status) == (Status.INVALID, [Status.INVALID], Status.RUNNING)
    assert node.feedback_message.startswith("does not hold")
    node.stop(Status.INVALID)
    context.wake.take()  # type: ignore[attr-defined]
    context.keys.write("free", True)
    assert not context.wake.asked, "who is not asked any more does not wake anybody"  # type: ignore[attr-defined]


def test_a_handler_of_the_last_round_is_stopped_when_the_body_begins_again(clock: ManualClock) -> None:
    context = make_context(clock, keys={"ends": "FAILURE", "handles": "RUNNING"})
    body, handler = Leaf("body", context), Leaf("handler", context, "handles")
    node = OnFailure("n", context, body, [handler], {}, handler)
    node.tick_once()
    assert (node.status, handler.status, node.cause) == (Status.RUNNING, Status.RUNNING, handler)
    assert node.feedback_message.startswith("failed")
    context.keys.write("handles", "SUCCESS")
    node.tick_once()
    assert node.status is Status.SUCCESS
    context.keys.write("ends", "RUNNING")
    node.tick_once()
    assert (node.status, node.current_child, node.cause) == (Status.RUNNING, body, body)
    assert (handler.status, node.feedback_message, node.result) == (Status.INVALID, "", None)


def test_who_waits_for_a_resource_hears_of_each_end_of_a_run(clock: ManualClock) -> None:
    declared = SkillDeclaration("drive", "Drive", resources=frozenset({"base"}), failures={"blocked": "no"})
    skill = ScriptedSkill(
        declared, clock, [Step(success(), after=1.0), Step(failure("blocked", "no"), after=1.0)]
    )
    context = make_context(clock, {"drive": skill}, {"drive": declared})
    ends: list[float] = []
    context.waiting.append(lambda: ends.append(clock.now()))
    for _ in range(2):
        node = RunSkill("drive", context, "drive")
        node.tick_once()
        held = context.holder("drive")
        assert held is not None and held.path == "drive"
        clock.advance(1.0)
        node.tick_once()
        assert context.holder("drive") is None
    assert ends == [1.0, 2.0]
    node = RunSkill("drive", context, "drive")
    node.tick_once()
    node.stop(Status.INVALID)
    clock.advance(5.0)
    assert len(ends) == 3 and context.holder("drive") is None
