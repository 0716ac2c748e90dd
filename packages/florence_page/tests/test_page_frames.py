"""What NiceGUI's own page says on its WebSocket goes through, and nothing else."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("nicegui")

from florence_page.frames import SOCKET, problem_with

PATH = f"{SOCKET}socket.io/"
HANDSHAKE = {"client_id": "c", "tab_id": "t", "document_id": "d", "old_tab_id": None, "next_message_id": 7}
EVENT = {"client_id": "c", "id": 4, "listener_id": "l", "args": ['{"x":1}', None]}


def frame(name: str, what: object, number: str = "") -> str:
    return f"42{number}{json.dumps([name, what])}"


@pytest.mark.parametrize(
    "text",
    [
        *("3", "1", "41", "40", '40{"token":"x"}'),
        frame("handshake", HANDSHAKE, "0"),
        frame("handshake", {**HANDSHAKE, "next_message_id": "12"}),
        frame("handshake", {key: HANDSHAKE[key] for key in ("client_id", "tab_id", "document_id")}),
        frame("event", EVENT),
        frame("event", {key: EVENT[key] for key in ("client_id", "id", "listener_id")}),
        frame("javascript_response", {"client_id": "c", "request_id": "r", "result": [1, {"a": None}]}),
        frame("ack", {"client_id": "c", "next_message_id": 3}),
        frame("log", {"client_id": "c", "level": "error", "message": "a\nb"}),
    ],
)
def test_what_the_page_says_goes_through(text: str) -> None:
    assert not problem_with(PATH, {"text": text})


@pytest.mark.parametrize(
    "text",
    [
        *("", "garbage", "0", "2", "2probe", "5", "6", "9", "4", "44{}", "45", "47", "\u0664\u0662[]"),
        *("42", "42{}", "42[", "42[]", "42[1]", '42["event"]', '42["event",{}]', '42["event",{},{}]'),
        *("43[]", '431["x"]', '451-["event",{"_placeholder":true,"num":0}]', '461-["x"]', "40/other,"),
        *("40[1]", "40{", '42["connect",{}]', '42["disconnect",{}]', '42["__del__",{}]'),
        "42" + "[" * 100_000,
        "42" + "9" * 5_000 + "[]",
        '42["ack",{"client_id":"c","next_message_id":' + "9" * 5_000 + "}]",
        '42["ack",{"client_id":"c","next_message_id":1e999}]',
        '42["ack",{"client_id":"c","next_message_id":NaN}]',
        '42["ack",{"client_id":"\\ud800","next_message_id":1}]',
        frame("handshake", {**HANDSHAKE, "next_message_id": "many"}),
        frame("handshake", {**HANDSHAKE, "client_id": ["c"]}),
        frame("event", {**EVENT, "args": "x"}),
        frame("event", {**EVENT, "args": [{"x": 1}]}),
        frame("event", {**EVENT, "id": "4"}),
        frame("log", {"client_id": "c", "level": "fatal", "message": "m"}),
        frame("event", EVENT) + "\n",
    ],
)
def test_what_no_page_says_does_not(text: str) -> None:
    assert problem_with(PATH, {"text": text})


def test_bytes_go_nowhere_and_other_sockets_take_any_text() -> None:
    assert problem_with(PATH, {"bytes": b"4"}) and problem_with("/live", {"bytes": b"ok"})
    assert not problem_with("/live", {"text": "ok"}) and not problem_with("/edit/live", {"text": "42{"})
