"""No orphan goals: every order of what can happen between a run and its server, on a model of the server.

The world knows what is true of the goal; the run knows only what it is told. After each order both are left
alone until nothing happens any more. Then the run must have ended, and no goal may be running on a server
that lives. Two orders are beyond a client: it leaves while the server is out of its sight, or while the
server refuses to stop. What is left then is cancelled when missions start again
(``florence_bt.app.bringup.make_safe``).
"""

from __future__ import annotations

import itertools

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.outcome import cancelled, success
from florence_bt.core.server_comparison import Lack
from florence_bt.ros._runs import ActionRun, Deadlines, StopAnswer
from tests.sweeps import sweep

DEADLINES = Deadlines(accept_s=2.0, result_s=10.0, cancel_s=3.0, lost_s=1.0)
LEAVING_S = 2.0


class World:
    """A server with at most one goal, the wire between, and a client that may leave."""

    def __init__(self, there: bool = True, refusals: int = 0) -> None:
        self.clock = ManualClock(100.0)
        self.alive = True
        self.life, self.first_seen = 1, 0
        self.in_sight = there
        self.left = False
        self.beyond_us = False
        self.answer: StopAnswer | None = None
        self.goal = "none"
        self.refusals = refusals
        self.stops_waiting = 0
        self.run = ActionRun(self.clock, self, DEADLINES, "action /dance")

    # What the run does.

    def lack(self) -> Lack:
        return Lack()

    def server_is_there(self) -> bool:
        return self.alive and self.in_sight

    def goals_server_is_there(self) -> bool:
        if not self.server_is_there():
            return False
        self.first_seen = self.first_seen or self.life
        return self.life == self.first_seen

    def servers(self) -> int:
        return int(self.server_is_there())

    def send(self) -> None:
        self.goal = "on its way"

    def feedback(self) -> str:
        return ""

    def stop(self) -> None:
        if self.alive and self.in_sight:
            self.stops_waiting += 1
            if self.goal != "on its way":
                self.work()

    # What the server does.

    def work(self) -> None:
        """Look at the requests to stop; they wait behind the goal, as in a server's own queue."""
        while self.stops_waiting:
            self.stops_waiting -= 1
            if self.goal == "running" and self.refusals:
                self.refusals -= 1
                self.tell(StopAnswer.REFUSED)
            elif self.goal == "running":
                self.goal = "stopping"
                self.tell(StopAnswer.PROMISED)
            else:
                self.tell(StopAnswer.OVER if self.goal in ("over", "stopping") else StopAnswer.UNKNOWN)

    def tell(self, answer: StopAnswer) -> None:
        self.answer = answer
        if not self.left and self.in_sight:
            self.run.stop_answered(answer)

    def happen(self, event: str) -> None:
        getattr(self, f"on_{event}")()

    def on_send(self) -> None:
        """The server comes into sight, at the start or again."""
        self.in_sight = True
        self.clock.advance(0.3)

    def on_accept(self) -> None:
        if self.alive and self.goal == "on its way":
            self.goal = "running"
            if not self.left and self.in_sight:
                self.run.accepted()
            self.work()

    def on_accept_unheard(self) -> None:
        """The server takes the goal, and its answer gets lost."""
        if self.alive and self.goal == "on its way":
            self.goal = "running"
            self.work()

    def on_reject(self) -> None:
        if self.alive and self.goal == "on its way":
            self.goal = "over"
            if not self.left and self.in_sight:
                self.run.rejected()
            self.work()

    def on_feedback(self) -> None:
        if self.alive and not self.left:
            self.run.set_feedback("dancing")

    def on_result(self) -> None:
        if self.alive and self.goal in ("running", "stopping"):
            result = success() if self.goal == "running" else cancelled("stopped")
            self.goal = "over"
            if not self.left and self.in_sight:
                self.run.finished(result)

    def on_cancel(self) -> None:
        if not self.left:
            self.run.cancel()

    def on_dies(self) -> None:
        self.alive = False
        self.goal = "gone"
        self.stops_waiting = 0

    def on_restarts(self) -> None:
        """A server of the same name that knows nothing of the goal; discovery may have missed the change."""
        self.alive = self.in_sight = True
        self.life += 1
        self.goal = "gone"
        self.stops_waiting = 0

    def on_hides(self) -> None:
        self.in_sight = False

    def on_shut_down(self) -> None:
        """The client's node goes away; it lingers for a moment while a goal is open."""
        if self.left:
            return
        self.run.shut_down()
        end = self.clock.now() + LEAVING_S
        while self.run.goal_open and self.clock.now() < end:
            self.clock.advance(0.1)
        self.left = True
        self.beyond_us = not self.in_sight or self.answer is StopAnswer.REFUSED or self.refusals > 0

    def on_wait(self) -> None:
        if not self.left:
            self.clock.advance(0.7)

    def on_long_wait(self) -> None:
        if not self.left:
            self.clock.advance(12.0)

    def settle(self) -> None:
        """Everything that lives does its work; the server comes into sight again if it lives."""
        for _ in range(3):
            self.on_send() if not self.left else None
            if self.goal == "on its way" and self.left:
                self.on_accept()
            self.on_long_wait()
            if self.goal == "stopping":
                self.on_result()
            if self.goal == "on its way":
                self.on_accept()


def check(events: tuple[str, ...], world: World) -> None:
    for event in events:
        world.happen(event)
    world.settle()
    assert world.left or world.run.poll() is not None, f"{events}: the run never ended"
    orphan = world.alive and world.goal in ("running", "on its way")
    assert world.beyond_us or not orphan, f"{events}: the goal is {world.goal}"
    result = world.run.poll()
    assert result is None or result.succeeded or result.reason, f"{events}: no reason"


NAMED = ("send", "accept", "reject", "feedback", "result", "cancel", "dies", "shut_down")
"""The events that the project's own promise names."""
ALL = (*NAMED, "accept_unheard", "hides", "restarts", "wait", "long_wait")


@pytest.mark.parametrize("first", sweep(NAMED, every=3))
def test_every_order_of_the_named_events(first: str) -> None:
    rest = [event for event in NAMED if event != first]
    for events in ((first, *others) for others in itertools.permutations(rest)):
        check(events, World(there=False))
        check(tuple(event for event in events if event not in ("dies", "shut_down")), World(there=False))


@pytest.mark.parametrize("refusals", [0, 2])
@pytest.mark.parametrize("there", [True, False])
@pytest.mark.parametrize("length", [0, 1, 2, 3, pytest.param(4, marks=pytest.mark.sweep)])
def test_every_order_of_some_of_all_events(there: bool, refusals: int, length: int) -> None:
    for events in itertools.permutations(ALL, length):
        check(events, World(there, refusals))


def test_a_server_started_anew_is_noticed_before_the_deadline_of_the_result() -> None:
    """The name is there all the time: only that it is another server tells that the goal is gone."""
    world = World()
    for event in ("accept", "wait", "restarts"):
        world.happen(event)
    world.clock.advance(DEADLINES.lost_s + 0.5)
    result = world.run.poll()
    assert result is not None and result.code == "server_lost"


def test_the_model_can_leave_an_orphan() -> None:
    """A run that only shrugged at a deadline would be found out."""
    world = World()
    world.on_accept_unheard()
    world.run._stop.ask_now = lambda: None  # type: ignore[method-assign]
    world.on_long_wait()
    assert world.run.poll() is not None and world.goal == "running"
