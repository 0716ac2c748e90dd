"""The manual override of the command line, with a mission server that is late to hear of it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from florence_bt.core.errors import DeviceTimeout
from florence_bt.wiring import client as module
from florence_bt.wiring.client import ANSWER_BUDGET_S, EVERYONE_S, OVERRIDDEN, MissionClient


class Client(MissionClient):
    """A client whose mission server takes a while for each answer, and hears only of some messages."""

    def __init__(self, answer_s, obeys_from):
        self.now = 100.0
        self.answer_s = list(answer_s)
        self.obeys_from = obeys_from
        self.told = 0
        self.destroyed = False
        self.held_up_s = 0.0
        self.node = SimpleNamespace(
            create_publisher=lambda *_: self, destroy_publisher=lambda _: setattr(self, "destroyed", True)
        )

    def publish(self, message):
        assert message.data
        self.told += 1

    def get_subscription_count(self):
        return 1

    def spin_until(self, done, budget_s, *, watch=None):
        if not done():
            self.now += budget_s + self.held_up_s
            self.held_up_s = 0.0
        return done()

    def status(self):
        self.now += self.answer_s.pop(0) if self.answer_s else 0.01
        return SimpleNamespace(blocked_by=OVERRIDDEN if self.told >= self.obeys_from else "")


@pytest.fixture
def override(monkeypatch):
    def run(answer_s=(), obeys_from=1, held_up_s=0.0):
        client = Client(answer_s, obeys_from)
        client.held_up_s = held_up_s
        monkeypatch.setattr(module.time, "monotonic", lambda: client.now)
        try:
            return client, client.override(True)
        finally:
            assert client.destroyed

    return run


def test_it_stays_until_everybody_has_heard_it(override):
    client, status = override()
    assert OVERRIDDEN in status.blocked_by and client.told == 1
    assert EVERYONE_S <= client.now - 100.0 < EVERYONE_S + 0.5


def test_a_server_that_is_being_started_again_is_told_again(override):
    client, status = override([4.0 * ANSWER_BUDGET_S], obeys_from=3)
    assert OVERRIDDEN in status.blocked_by and client.told == 3


def test_who_is_held_up_looks_once_more(override):
    client, status = override(held_up_s=2.0 * ANSWER_BUDGET_S)
    assert OVERRIDDEN in status.blocked_by and client.told == 1


def test_slow_answers_are_answers(override):
    _, status = override([ANSWER_BUDGET_S - 0.1] * 3)
    assert OVERRIDDEN in status.blocked_by


def test_a_server_that_does_not_obey_is_an_error(override):
    with pytest.raises(DeviceTimeout, match="did not obey"):
        override(obeys_from=10**6)
