"""A run on an action server, without ROS: what each event does, and any order of them, also impossible ones.

That no goal is left running on a server is shown in ``test_goal_orders.py``.
"""

from __future__ import annotations

import itertools

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success
from florence_bt.core.server_comparison import Lack
from florence_bt.core.skill import Phase
from florence_bt.ros._runs import GIVE_UP_S, ActionRun, Deadlines, StopAnswer

DEADLINES = Deadlines(accept_s=2.0, result_s=10.0, cancel_s=3.0, lost_s=1.0)


class FakeServer:
    """A server in reach of the run; what it was told is recorded."""

    def __init__(self, there: bool = True) -> None:
        self.there = there
        self.twins = 1
        self.sent: list[str] = []
        self.told = ""

    def lack(self) -> Lack:
        return Lack()

    def server_is_there(self) -> bool:
        return self.there

    def goals_server_is_there(self) -> bool:
        return self.there

    def servers(self) -> int:
        return self.twins

    def send(self) -> None:
        self.sent.append("goal")

    def feedback(self) -> str:
        return self.told

    def stop(self) -> None:
        self.sent.append("cancel")


def begin(there: bool = True, deadlines: Deadlines = DEADLINES) -> tuple[ManualClock, FakeServer, ActionRun]:
    clock, server = ManualClock(100.0), FakeServer(there)
    return clock, server, ActionRun(clock, server, deadlines, "action /dance")


def ended(run: ActionRun) -> Result:
    result = run.poll()
    assert result is not None
    return result


# What may happen to a run; "wait" lets every deadline pass.
EVENTS = ("accepted", "rejected", "finished", "cancel", "promised", "refused", "unknown", "shut_down", "wait")
ANSWERS = {"promised": StopAnswer.PROMISED, "refused": StopAnswer.REFUSED, "unknown": StopAnswer.UNKNOWN}


def apply(event: str, clock: ManualClock, run: ActionRun) -> None:
    if event == "accepted":
        run.accepted()
    elif event == "rejected":
        run.rejected()
    elif event == "finished":
        run.finished(success())
    elif event == "cancel":
        run.cancel()
    elif event == "shut_down":
        run.shut_down()
    elif event in ANSWERS:
        run.stop_answered(ANSWERS[event])
    else:
        clock.advance(100.0)


@pytest.mark.parametrize("there", [True, False])
def test_every_order_of_events_also_impossible_ones_ends_the_run_once(there: bool) -> None:
    for length in range(5):
        for events in itertools.product(EVENTS, repeat=length):
            clock, _server, run = begin(there)
            first: Result | None = None
            for event in (*events, "wait"):
                apply(event, clock, run)
                first = first or run.poll()
                assert first is None or run.poll() == first, f"{events}: the result changed"
            assert run.poll() is not None, f"{events}: the run never ended"
            assert ended(run).succeeded or ended(run).reason, f"{events}: no reason"
            assert clock.next_time() is None, f"{events}: a timer is left"
            assert not run.goal_open, f"{events}: it waits for ever"


def test_success() -> None:
    clock, server, run = begin()
    assert server.sent == ["goal"]
    run.accepted()
    assert run.phase is Phase.ACTIVE
    clock.advance(9.9)
    run.finished(success(x=1))
    assert run.poll() == success(x=1)
    assert server.sent == ["goal"]


def test_a_server_that_comes_late_gets_the_goal_once() -> None:
    clock, server, _run = begin(there=False)
    clock.advance(1.0)
    assert server.sent == []
    server.there = True
    clock.advance(0.5)
    assert server.sent == ["goal"]


def test_nobody_serves() -> None:
    clock, _, run = begin(there=False)
    clock.advance(1.99)
    assert run.poll() is None
    clock.advance(0.01)
    assert ended(run).code == "server_lost"
    assert "no server of action /dance" in ended(run).reason


def test_no_answer_to_the_goal() -> None:
    clock, server, run = begin()
    clock.advance(2.0)
    assert ended(run).code == "timed_out"
    assert server.sent == ["goal", "cancel"], "its yes may have got lost"
    run.accepted()
    assert server.sent == ["goal", "cancel", "cancel"], "who accepts too late is stopped"
    run.stop_answered(StopAnswer.PROMISED)
    clock.advance(100.0)
    assert server.sent == ["goal", "cancel", "cancel"]


def test_cancel_before_the_goal_is_sent() -> None:
    clock, server, run = begin(there=False)
    run.cancel()
    assert ended(run).outcome is Outcome.CANCELLED
    server.there = True
    clock.advance(20.0)
    assert server.sent == []


def test_cancel_before_the_acceptance() -> None:
    _clock, server, run = begin()
    run.cancel()
    run.cancel()
    assert run.poll() is None
    assert server.sent == ["goal"]
    run.accepted()
    assert server.sent == ["goal", "cancel"]
    run.finished(cancelled("stopped"))
    assert run.poll() == cancelled("stopped")


def test_cancel_and_no_answer_to_the_goal() -> None:
    clock, server, run = begin()
    run.cancel()
    clock.advance(2.0)
    assert ended(run).outcome is Outcome.CANCELLED
    run.accepted()
    assert server.sent == ["goal", "cancel", "cancel"]


def test_cancel_while_active_has_a_deadline_of_its_own() -> None:
    clock, _server, run = begin()
    run.accepted()
    clock.advance(9.0)
    run.cancel()
    clock.advance(2.9)
    assert run.poll() is None, "the deadline of the result counts no more"
    clock.advance(0.2)
    assert ended(run).outcome is Outcome.CANCELLED
    assert "did not confirm the stop within 3 s" in ended(run).reason


def test_a_second_cancel_does_not_extend_the_deadline() -> None:
    clock, server, run = begin()
    run.accepted()
    run.cancel()
    run.stop_answered(StopAnswer.PROMISED)
    clock.advance(2.0)
    run.cancel()
    clock.advance(1.0)
    assert ended(run).outcome is Outcome.CANCELLED
    assert server.sent == ["goal", "cancel"]


def test_a_refused_cancel_is_named() -> None:
    clock, _, run = begin()
    run.accepted()
    run.cancel()
    run.stop_answered(StopAnswer.REFUSED)
    clock.advance(3.0)
    assert "refused to stop" in ended(run).reason


def test_a_stop_is_asked_for_until_the_server_promises_it() -> None:
    clock, server, run = begin()
    run.accepted()
    run.cancel()
    clock.advance(1.5)
    run.stop_answered(StopAnswer.REFUSED)
    clock.advance(4.0)
    assert run.poll() is not None and run.goal_open
    assert server.sent == ["goal", *["cancel"] * 6], "also after the run has ended"
    run.stop_answered(StopAnswer.PROMISED)
    assert not run.goal_open
    clock.advance(100.0)
    assert server.sent == ["goal", *["cancel"] * 6]


def test_nobody_is_asked_for_ever() -> None:
    clock, server, run = begin()
    run.accepted()
    run.cancel()
    clock.advance(10 * GIVE_UP_S)
    assert len(server.sent) == 1 + GIVE_UP_S and not run.goal_open


def test_a_server_that_was_restarted_while_it_was_asked_to_stop() -> None:
    _, _, run = begin()
    run.accepted()
    run.cancel()
    run.stop_answered(StopAnswer.UNKNOWN)
    assert ended(run).outcome is Outcome.CANCELLED and "was it restarted" in ended(run).reason


def test_a_server_that_does_not_know_a_goal_yet_may_still_accept_it() -> None:
    """The request to stop may overtake the goal: it is asked again, and the run goes on until then."""
    clock, server, run = begin()
    run.shut_down()
    assert server.sent == ["goal", "cancel"]
    run.stop_answered(StopAnswer.UNKNOWN)
    assert run.poll() is None and run.goal_open
    clock.advance(1.0)
    assert server.sent == ["goal", "cancel", "cancel"]
    run.accepted()
    run.stop_answered(StopAnswer.PROMISED)
    assert run.poll() is None
    run.finished(cancelled("ended"))
    assert ended(run) == cancelled("ended") and not run.goal_open


def test_a_goal_that_ended_meanwhile_keeps_its_result() -> None:
    _, _, run = begin()
    run.accepted()
    run.cancel()
    run.stop_answered(StopAnswer.OVER)
    assert run.poll() is None and not run.goal_open
    run.finished(success(x=2))
    assert run.poll() == success(x=2)


def test_result_deadline() -> None:
    clock, server, run = begin()
    run.accepted()
    clock.advance(10.0)
    assert ended(run).code == "timed_out"
    assert server.sent == ["goal", "cancel"]


def test_a_fast_simulation_makes_no_server_late() -> None:
    robot, steady, server = ManualClock(100.0), ManualClock(7.0), FakeServer()
    run = ActionRun(robot, server, DEADLINES, "action /dance", steady)
    robot.advance(1000.0)
    assert run.poll() is None
    steady.advance(1.9)
    run.accepted()
    run.cancel()
    robot.advance(1000.0)
    steady.advance(2.9)
    assert run.poll() is None, "the answer to a cancel depends on both"
    steady.advance(0.1)
    assert "did not confirm the stop" in ended(run).reason


def test_a_clock_that_stands_holds_no_cancelled_run() -> None:
    robot, steady, server = ManualClock(100.0), ManualClock(7.0), FakeServer()
    run = ActionRun(robot, server, DEADLINES, "action /dance", steady)
    run.accepted()
    run.cancel()
    steady.advance(11.9)
    assert run.poll() is None, "a slow simulation is given time"
    steady.advance(0.5)
    assert "did not confirm the stop" in ended(run).reason


def test_a_server_that_goes_away() -> None:
    clock, server, run = begin()
    run.accepted()
    clock.advance(2.0)
    server.there = False
    clock.advance(0.9)
    server.there = True
    clock.advance(3.0)
    assert run.poll() is None, "discovery may blink"
    server.there = False
    clock.advance(1.5)
    assert ended(run).code == "server_lost"


def test_a_server_that_goes_away_while_it_cancels() -> None:
    clock, server, run = begin()
    run.accepted()
    run.cancel()
    server.there = False
    clock.advance(1.5)
    assert ended(run).outcome is Outcome.CANCELLED
    assert "went away" in ended(run).reason


def test_rejection() -> None:
    _, server, run = begin()
    run.rejected()
    assert ended(run).code == "rejected"
    assert server.sent == ["goal"]


def test_a_failure_without_a_reason_gets_one() -> None:
    _, _, run = begin()
    run.accepted()
    run.finished(failure("stuck", ""))
    assert ended(run).reason == "action /dance failed"


def test_changes_are_told() -> None:
    _, _, run = begin()
    seen: list[tuple[Phase, str]] = []
    run.on_change(lambda: seen.append((run.phase, run.feedback)))
    run.accepted()
    run.set_feedback("half way")
    run.set_feedback("half way")
    run.finished(success())
    run.set_feedback("too late")
    assert seen == [
        (Phase.ACTIVE, "waiting for action /dance"),
        (Phase.ACTIVE, "running action /dance"),
        (Phase.ACTIVE, "half way"),
        (Phase.DONE, "half way"),
    ]


@pytest.mark.parametrize("name", ["accept_s", "result_s", "cancel_s", "lost_s"])
def test_deadlines_must_be_above_zero(name: str) -> None:
    with pytest.raises(ConfigError, match=name):
        Deadlines(**{name: 0.0})


@pytest.mark.parametrize("end", ["finished", "rejected"])
def test_two_servers_of_one_name_are_both_told_to_stop(end: str) -> None:
    """Each is sent the goal; the answer that comes first counts, and the other one must not work on."""
    clock, server, run = begin()
    server.twins = 2
    apply(end, clock, run)
    assert run.poll() is not None and server.sent == ["goal", "cancel"] and not run.goal_open
    clock.advance(GIVE_UP_S)
    assert server.sent == ["goal", "cancel"]


def test_feedback_is_looked_at_now_and_then_however_much_comes() -> None:
    clock, server, run = begin()
    run.accepted()
    changes = []
    run.on_change(lambda: changes.append(run.feedback))
    for number in range(3000):
        server.told = f"{number} m"
        clock.advance(0.001)
    assert run.feedback.endswith("m") and len(changes) <= 12


def refuse_the_stop() -> tuple[ManualClock, FakeServer, ActionRun]:
    """A run that has ended while the server still works on its goal."""
    clock, server = ManualClock(100.0), FakeServer()
    run = ActionRun(clock, server, DEADLINES, "action /dance", goal_id="c0ffee")
    run.accepted()
    run.cancel()
    run.stop_answered(StopAnswer.REFUSED)
    clock.advance(4.0)
    return clock, server, run


def test_the_reason_names_the_goal_that_is_still_open() -> None:
    _clock, _server, run = refuse_the_stop()
    assert "action /dance refused to stop within 3 s; its goal c0ffee is still open" in ended(run).reason
    assert run.goal_left


def test_no_second_goal_is_sent_beside_one_that_is_still_open() -> None:
    clock, server, old = refuse_the_stop()
    second = FakeServer()
    run = ActionRun(clock, second, DEADLINES, "action /dance", older=[old])
    asked = server.sent.count("cancel")
    clock.advance(3.0)
    assert second.sent == [] and server.sent.count("cancel") >= asked, "the old goal is asked to end again"
    assert (
        ended(run).code == "timed_out" and "goal c0ffee of action /dance is still open" in ended(run).reason
    )


@pytest.mark.parametrize("how", ["finished", "over", "unknown"])
def test_the_goal_is_sent_when_the_older_one_has_ended(how: str) -> None:
    clock, _server, old = refuse_the_stop()
    second = FakeServer()
    run = ActionRun(clock, second, DEADLINES, "action /dance", older=[old])
    clock.advance(1.0)
    assert second.sent == []
    if how == "finished":
        old.finished(cancelled())
    else:
        old.stop_answered(StopAnswer.OVER if how == "over" else StopAnswer.UNKNOWN)
    clock.advance(0.1)
    assert second.sent == ["goal"] and run.poll() is None
