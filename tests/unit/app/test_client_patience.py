"""How long the command line waits for an answer, on a clock of the test's own."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from florence_bt.app.runs import client as module
from florence_bt.app.runs.client import ANSWER_BUDGET_S, BUSY_BUDGET_S, MissionClient, SystemNotThere
from florence_bt.core.errors import DeviceTimeout


class Client(MissionClient):
    """A client of a service that is there, and answers each request after a while, or never."""

    there = True

    def __init__(self, answer_s, alone=False):
        self.now = 100.0
        self._neighbours = SimpleNamespace(certainly_none=lambda: alone)
        self.node = SimpleNamespace(resolve_service_name=str, get_node_names_and_namespaces=list)
        self.answer_s = list(answer_s)
        self.asked = self.removed = 0
        self._clients = {"ask": self}

    def service_is_ready(self):
        return self.there

    def call_async(self, request):
        self.asked += 1
        due = self.now + self.answer_s.pop(0)
        return SimpleNamespace(done=lambda: self.now >= due, result=lambda: "here")

    def remove_pending_request(self, future):
        self.removed += 1

    def spin_until(self, done, budget_s, *, watch=None, look_s=0.05):
        if not done():
            self.now += budget_s
        return done()


@pytest.fixture
def call(monkeypatch):
    def run(*answer_s, bring_up, repeat=False):
        client = Client(answer_s)
        monkeypatch.setattr(module.time, "monotonic", lambda: client.now)
        monkeypatch.setattr(module, "bring_up_here", lambda: bring_up)
        try:
            return client, client.call(None, "ask", "request", repeat=repeat)
        except DeviceTimeout as error:
            return client, str(error)

    return run


NEVER = float("inf")


def test_a_busy_machine_is_given_its_time_and_asked_once(call):
    client, answer = call(ANSWER_BUDGET_S + BUSY_BUDGET_S - 1.0, bring_up=True)
    assert answer == "here" and (client.asked, client.removed) == (1, 0)


def test_without_a_bring_up_here_nobody_waits_long(call):
    client, answer = call(NEVER, bring_up=False)
    assert "ask did not answer within 5 s" in answer and (client.asked, client.removed) == (1, 1)
    assert client.now == pytest.approx(100.0 + ANSWER_BUDGET_S)


@pytest.mark.parametrize("bring_up", [False, True])
def test_a_question_is_asked_again_when_its_answer_was_lost(call, bring_up):
    client, answer = call(NEVER, 0.1, bring_up=bring_up, repeat=True)
    assert answer == "here" and (client.asked, client.removed) == (2, 1)


def test_there_is_an_end(call):
    client, answer = call(*[NEVER] * 100, bring_up=True, repeat=True)
    assert "did not answer within 3" in answer and client.asked == client.removed
    assert client.now == pytest.approx(100.0 + ANSWER_BUDGET_S + BUSY_BUDGET_S, abs=2.0)


@pytest.mark.parametrize(
    ("alone", "bring_up", "waits_s"),
    [(True, False, 0.0), (False, False, ANSWER_BUDGET_S), (True, True, ANSWER_BUDGET_S + BUSY_BUDGET_S)],
)
def test_where_nobody_can_be_nobody_is_waited_for(monkeypatch, alone, bring_up, waits_s):
    client = Client([], alone)
    client.there = False

    def spin_until(done, budget_s, look_s):
        begin = client.now
        while not done() and client.now < begin + budget_s:
            client.now += 0.25
        return done()

    client.spin_until = spin_until
    monkeypatch.setattr(module.time, "monotonic", lambda: client.now)
    monkeypatch.setattr(module, "bring_up_here", lambda: bring_up)
    with pytest.raises(SystemNotThere, match="florence up"):
        client.call(None, "ask", "request")
    assert client.now - 100.0 == pytest.approx(waits_s, abs=0.5)
