"""What NiceGUI's part of a page may say on its WebSocket, and where its files are.

python-socketio decodes whatever comes, keeps announced attachments for ever, and logs a traceback for what
it does not understand; so only what NiceGUI's own page says goes through. Sources: Engine.IO protocol 4,
Socket.IO protocol 5; ``nicegui/static/nicegui.js`` has the events.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from fastapi import Request, Response
from nicegui import __version__, core, json

SOCKET = "/_nicegui_ws/"
"""Where NiceGUI's WebSocket is."""
PARTS = (
    "/picture/",
    "/edit/picture/",
    *(
        f"/_nicegui/{__version__}/{folder}/"
        for folder in ("static", "libraries", "components", "resources", "dynamic_resources", "esm")
    ),
)
"""Where what belongs to a page begins: files and pictures, which cost little."""
URGENT = ("/robot/",)
"""Where the buttons are that stop the robot."""

_TEXT, _NUMBER = str, int
_EVENTS: Mapping[str, Mapping[str, type]] = {
    "handshake": {"client_id": _TEXT, "tab_id": _TEXT, "document_id": _TEXT},
    "event": {"client_id": _TEXT, "id": _NUMBER, "listener_id": _TEXT},
    "javascript_response": {"client_id": _TEXT, "request_id": _TEXT},
    "ack": {"client_id": _TEXT, "next_message_id": _NUMBER},
    "log": {"client_id": _TEXT, "level": _TEXT, "message": _TEXT},
}
"""The events, and what each must have."""
_LEVELS = ("debug", "info", "warning", "error")
_LEAVES, _PONG = ("1", "41"), "3"
_CONNECT = re.compile(r"40(\{.*\})?", re.DOTALL)
_EVENT = re.compile(r"42[0-9]{0,9}(\[.*\])", re.DOTALL)


def answer_plainly_what_is_not_there() -> None:
    """Have a wrong address answered with a sentence: NiceGUI makes a page of it, keeps that, and logs the
    address.
    """

    async def not_there(request: Request, error: Exception) -> Response:
        return Response("nothing is here: open /\n", 404, media_type="text/plain")

    core.app.add_exception_handler(404, not_there)


def problem_with(path: str, message: Mapping[str, Any]) -> str:
    """Tell what is wrong with a message on a WebSocket; an empty text when it may go through.

    Args:
        path: Of the WebSocket.
        message: Of ASGI, with ``text`` or ``bytes``.
    """
    text = message.get("text")
    if text is None:
        return "nothing here takes bytes: send text"
    return "" if not path.startswith(SOCKET) or _is_of_a_page(text) else "no page says that"


def _is_of_a_page(text: str) -> bool:
    if text in _LEAVES or text == _PONG:
        return True
    try:
        if connect := _CONNECT.fullmatch(text):
            return isinstance(json.loads(connect[1] or "{}"), dict)
        event = _EVENT.fullmatch(text)
        return event is not None and _is_event(json.loads(event[1]))
    except (ValueError, RecursionError):
        return False


def _is_event(said: Any) -> bool:
    """Tell whether an event is one of NiceGUI's page, with what it must have."""
    if len(said) != 2 or not isinstance(said[0], str) or not isinstance(said[1], dict):
        return False
    needed, given = _EVENTS.get(said[0]), said[1]
    if needed is None or not all(isinstance(given.get(key), kind) for key, kind in needed.items()):
        return False
    match said[0]:
        case "handshake":
            number = given.get("next_message_id")
            return number is None or bool(re.fullmatch(r"[0-9]{1,15}", str(number)))
        case "event":
            arguments = given.get("args", [])
            return isinstance(arguments, list) and all(isinstance(each, str | None) for each in arguments)
        case "log":
            return given["level"] in _LEVELS
    return True
