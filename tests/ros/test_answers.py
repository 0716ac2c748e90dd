"""Answers of services to clients that discovery has not told the server of yet."""

from __future__ import annotations

import warnings
from typing import Any

import pytest

pytest.importorskip("rclpy")

from rclpy.exceptions import InvalidHandle
from rclpy.service import Service
from std_srvs.srv import Trigger

from florence_bt.ros.answers import PAUSES_S, Deferred, serve_answers
from florence_bt.ros.node import FlorenceNode

pytestmark = pytest.mark.ros


@pytest.fixture
def unknown_client(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What rclpy does while the client is not known yet, the first three times of the service ``ask``."""
    sent: list[str] = []
    send = Service.send_response

    def send_response(self: Any, response: Any, header: Any) -> None:
        if self.srv_name == "ask":
            sent.append(response.message)
            if len(sent) <= 3:
                warnings.warn(
                    "failed to send response (timeout): client unknown", RuntimeWarning, stacklevel=2
                )
                return
        send(self, response, header)

    monkeypatch.setattr(Service, "send_response", send_response)
    return sent


def test_a_client_that_is_discovered_late_gets_its_answer_once(ros: Any, unknown_client: list[str]) -> None:
    server, client_node = ros.add(FlorenceNode("server")), ros.add(FlorenceNode("client"))
    server.create_service(Trigger, "ask", lambda _, response: Trigger.Response(message="here"))
    client = client_node.create_client(Trigger, "ask")
    ros.spin_until(client.service_is_ready)
    answer = client.call_async(Trigger.Request())
    ros.spin_until(answer.done)
    assert answer.result().message == "here" and unknown_client == ["here"] * 4


class FakeService:
    """A service whose client stays unknown, or that sends or fails as told."""

    srv_name = "ask"

    def __init__(self, *then: Any) -> None:
        self.then = list(then)
        self.sends = 0
        self.sent: list[tuple[Any, Any]] = []

    def send_response(self, response: Any, header: Any) -> None:
        self.sends += 1
        what = self.then.pop(0) if self.then else "unknown"
        if isinstance(what, Exception):
            raise what
        if what == "unknown":
            warnings.warn("failed to send response (timeout): unknown", RuntimeWarning, stacklevel=2)
        elif what == "sent":
            self.sent.append((response, header))
        elif what == "other":
            warnings.warn("something else", RuntimeWarning, stacklevel=2)


class Later:
    """Collects what is to be done later, and does it."""

    def __init__(self) -> None:
        self.waiting: list[Any] = []
        self.pauses: list[float] = []

    def __call__(self, pause: float, callback: Any) -> None:
        self.pauses.append(pause)
        self.waiting.append(callback)

    def run(self) -> None:
        while self.waiting:
            self.waiting.pop(0)()


def wrapped(*then: Any) -> tuple[FakeService, Later, list[str]]:
    service, later, told = FakeService(*then), Later(), []
    serve_answers(service, later, told.append)
    return service, later, told


def test_an_answer_to_nobody_is_given_up_and_told() -> None:
    service, later, told = wrapped()
    service.send_response("answer", "header")
    assert service.sends == 1 and told == []
    later.run()
    assert service.sends == 1 + len(PAUSES_S) and tuple(later.pauses) == PAUSES_S
    assert len(told) == 1 and "never discovered" in told[0]


def test_a_service_that_goes_meanwhile_is_told() -> None:
    service, later, told = wrapped("unknown", InvalidHandle("gone"))
    service.send_response("answer", "header")
    later.run()
    assert service.sends == 2 and "taken away" in told[0]


def test_other_warnings_and_errors_come_through() -> None:
    service, later, told = wrapped("other", InvalidHandle("gone"))
    with pytest.warns(RuntimeWarning, match="something else"):
        service.send_response("answer", "header")
    with pytest.raises(InvalidHandle):
        service.send_response("answer", "header")
    assert later.waiting == [] and told == []


@pytest.mark.parametrize("answer_first", [True, False])
def test_a_deferred_answer_is_sent_once_when_it_is_there(answer_first: bool) -> None:
    service, waiting, told = wrapped("sent")
    later = Deferred()
    if answer_first:
        assert later.answer("yes")
    service.send_response(later, 7)
    if not answer_first:
        assert service.sent == []
        assert later.answer("yes")
    assert not later.answer("no")
    assert service.sent == [("yes", 7)] and waiting.waiting == [] and told == []


def test_a_deferred_answer_is_sent_again_until_its_client_is_known() -> None:
    service, later, told = wrapped("unknown", "sent")
    deferred = Deferred()
    service.send_response(deferred, 7)
    deferred.answer("yes")
    assert service.sends == 1
    later.run()
    assert service.sends == 2 and service.sent[-1] == ("yes", 7) and told == []
