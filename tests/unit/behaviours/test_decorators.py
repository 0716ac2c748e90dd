"""Guards, pauses after a success, what is done once, and calls of other missions."""

import pytest
from py_trees.behaviour import Behaviour
from py_trees.behaviours import Success as Succeed
from py_trees.common import Status

from florence_bt.behaviours.decorators import CallMission, Once, StartGuard, While
from florence_bt.behaviours.expressions import CompiledExpression
from florence_bt.behaviours.keys import KeyReference, KeyStore
from florence_bt.behaviours.leaves import Fail, SetKey
from florence_bt.behaviours.why import Why, explain
from florence_bt.core.declaration import Kind, Port
from tests.ticking import make_context

FREE = CompiledExpression("$free", lambda keys: keys.read("free"), ("free",))


class Scripted(Behaviour):
    """Gives the statuses of a list, the last one again and again; counts its starts."""

    def __init__(self, *statuses):
        super().__init__("work")
        self.left = list(statuses)
        self.starts = 0

    def initialise(self):
        self.starts += 1

    def update(self):
        return self.left.pop(0) if len(self.left) > 1 else self.left[0]


@pytest.mark.parametrize("skipped_fails", [False, True])
@pytest.mark.parametrize(
    ("free", "skipped"), [(True, ""), (False, "skipped: $free does not hold (free is false)")]
)
def test_a_guard_lets_a_node_start_or_skips_it(clock, free, skipped, skipped_fails):
    context = make_context(clock, keys={"free": free})
    child = Scripted(Status.FAILURE)
    guard = StartGuard("guard", child, context, FREE, skipped_fails=skipped_fails)
    guard.tick_once()
    assert (child.starts, guard.feedback_message) == (0 if skipped else 1, skipped)
    assert guard.status is (Status.SUCCESS if skipped and not skipped_fails else Status.FAILURE)
    if skipped and skipped_fails:
        assert explain(guard) == Why("guard", "skipped", skipped)


def test_a_guard_that_has_no_value_fails_and_one_that_holds_is_not_asked_again(clock):
    context = make_context(clock)
    guard = StartGuard("guard", Scripted(Status.RUNNING), context, FREE)
    guard.tick_once()
    assert explain(guard).code == "missing_key"
    context.keys.write("free", True)
    guard.tick_once()
    context.keys.write("free", False)
    guard.tick_once()
    assert guard.status is Status.RUNNING


def test_a_node_that_is_skipped_forgets_how_it_ended_before(clock):
    context = make_context(clock, keys={"free": True})
    child = Scripted(Status.SUCCESS)
    guard = StartGuard("guard", child, context, FREE)
    guard.tick_once()
    assert child.status is Status.SUCCESS
    context.keys.write("free", False)
    guard.tick_once()
    assert (guard.status, child.status, child.starts) == (Status.SUCCESS, Status.INVALID, 1)


def test_while_stops_its_node_when_the_condition_ends(clock):
    context = make_context(clock, keys={"free": True})
    child = Scripted(Status.RUNNING)
    node = While("while", child, context, FREE)
    node.tick_once()
    assert (node.status, context.wake.take()) == (Status.RUNNING, False)
    context.keys.write("free", False)
    assert context.wake.take()
    node.tick_once()
    assert (node.status, child.status) == (Status.FAILURE, Status.INVALID)
    assert explain(node) == Why("while", "guard_failed", "$free does not hold (free is false)")
    context.keys.write("free", True)
    context.keys.write("free", False)
    assert not context.wake.take()
    node.tick_once()
    assert (node.status, child.starts) == (Status.FAILURE, 1)


def test_a_child_that_succeeds_with_the_step_that_ends_the_condition_has_succeeded(clock):
    context = make_context(clock, keys={"free": True})
    node = While("while", SetKey("set", context, {"free": False}), context, FREE)
    node.tick_once()
    assert node.status is Status.SUCCESS


@pytest.mark.parametrize("status", [Status.SUCCESS, Status.FAILURE])
def test_what_is_done_once_has_the_same_result_from_then_on(clock, status):
    child = Scripted(Status.RUNNING, status)
    node = Once("once", child)
    for _ in range(4):
        node.tick_once()
    assert (node.status, child.starts) == (status, 1)


def test_what_is_done_once_keeps_the_cause_and_does_again_what_was_stopped(clock):
    context = make_context(clock)
    node = Once("once", Fail("fail", context, "shut", "blocked"))
    node.tick_once()
    node.tick_once()
    assert explain(node) == Why("once/fail", "blocked", "shut")
    child = Scripted(Status.RUNNING, Status.SUCCESS)
    stopped = Once("once", child)
    stopped.tick_once()
    stopped.stop(Status.INVALID)
    stopped.tick_once()
    assert child.starts == 2


def test_a_called_mission_gets_its_inputs_and_hands_its_outputs_over(clock):
    context = make_context(clock, keys={"where": "hall"})
    called = KeyStore()
    ports = {"room": Port(Kind.TEXT, "where"), "times": Port(Kind.INTEGER, "how often", default=2)}
    child = SetKey("set", context.with_keys(called), {"found": KeyReference("room")})
    node = CallMission(
        "call", child, context, called, ports, {"room": KeyReference("where")}, {"found": "seen"}
    )
    node.tick_once()
    assert (node.status, context.keys.read("seen"), called.read("times")) == (Status.SUCCESS, "hall", 2)
    assert "found" not in context.keys


def test_a_called_mission_does_not_start_with_a_wrong_input_and_owes_its_outputs(clock):
    context = make_context(clock)
    ports = {"times": Port(Kind.INTEGER, "how often", minimum=1)}
    node = CallMission("call", Succeed("work"), context, KeyStore(), ports, {"times": 0}, {})
    node.tick_once()
    assert (explain(node).code, node.decorated.status) == ("bad_input", Status.INVALID)
    node = CallMission("call", Succeed("work"), context, KeyStore(), {}, {}, {"found": "seen"})
    node.tick_once()
    assert explain(node).code == "missing_key"
