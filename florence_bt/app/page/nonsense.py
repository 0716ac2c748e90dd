"""Nonsense from browsers, which is none of what the page sends: passed over, with a line in the log."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

from nicegui import core

T = TypeVar("T")
_EVENTS = ("handshake", "event", "javascript_response", "ack", "log")
"""The events that NiceGUI hears on its socket, beside the beginning and the end."""
_EVERY_S = 1.0
"""From one line of the log to the next at least: who floods the page must not hold it up by its log."""


class NonsenseFilter:
    """Has what is no event of NiceGUI passed over; by itself it writes a traceback for each.

    Args:
        log: Takes a line now and then.
    """

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log = log
        self._next = 0.0

    def install(self) -> None:
        """Stand before what NiceGUI does with events."""
        for handlers, names in ((core.sio.handlers["/"], _EVENTS), (core.sio.eio.handlers, ("message",))):
            for name in names:
                handlers[name] = partial(self._heed, name, handlers[name])

    async def _heed(self, name: str, handler: Callable[..., Any], *sent: Any) -> Any:
        try:
            answer = handler(*sent)
            return await answer if inspect.isawaitable(answer) else answer
        except Exception as error:  # of NiceGUI, about what was sent: those of the page's handlers it keeps
            now = time.monotonic()
            if now >= self._next:
                self._next = now + _EVERY_S
                self._log(f"a browser sent what is no {name}: {type(error).__name__}: {error}"[:200])
            return None


def value_sent(sent: Any, name: str, kind: type[T]) -> T | None:
    """Return a value of what an element of ours has sent; None when there is none of this kind.

    Args:
        sent: What came, of any type and size.
        name: Of the value.
        kind: Its type.
    """
    value = sent.get(name) if isinstance(sent, dict) else None
    return value if isinstance(value, kind) else None
