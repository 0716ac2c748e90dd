"""Service answers that come later, and that reach also a client that the server has not discovered yet.

A client may discover a server before the server discovers the client. An answer in that moment is
not sent: Fast DDS looks for the client for 0.1 s, then rclpy warns, and the client would wait forever. Here
such an answer is sent again until it goes out.

The events executor of rclpy 7.1 does not await service callbacks that are coroutines; it passes whatever the
callback returns to ``service.send_response``. A callback may therefore return a :class:`Deferred`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

from rclpy.exceptions import InvalidHandle

PAUSES_S = (0.1, 0.2, 0.4, 0.8, 1.6)
"""Machine time before each further attempt, seconds; each attempt may block the node for 0.1 s."""


class Deferred:
    """An answer that is given later, once."""

    def __init__(self) -> None:
        self._send: Callable[[Any], object] | None = None
        self._response: Any = None
        self._sent = False

    def answer(self, response: Any) -> bool:
        """Give the answer; False when it was given before."""
        if self._response is not None:
            return False
        self._response = response
        self._flush()
        return True

    def send_with(self, send: Callable[[Any], object]) -> None:
        """Set how the answer is sent; one that is there is sent now."""
        self._send = send
        self._flush()

    def _flush(self) -> None:
        if self._send is not None and self._response is not None and not self._sent:
            self._sent = True
            self._send(self._response)


def serve_answers(
    service: Any, call_later: Callable[[float, Callable[[], None]], Any], warn: Callable[[str], None]
) -> None:
    """Let a service send a :class:`Deferred` when it is there, and again what its client could not get yet.

    Args:
        service: The service of rclpy; its ``send_response`` is replaced.
        call_later: Calls back on the node's executor after this many seconds of the machine's time.
        warn: Called with a sentence when an answer is given up.
    """
    send_once = service.send_response

    def send(response: Any, header: Any, pauses: tuple[float, ...] = PAUSES_S) -> None:
        if isinstance(response, Deferred):
            response.send_with(lambda answer: send(answer, header))
            return
        if _sent(send_once, response, header):
            return
        if pauses:
            call_later(pauses[0], lambda: send_again(response, header, pauses[1:]))
        else:
            warn(f"{service.srv_name}: an answer is given up, the client that asked was never discovered")

    def send_again(response: Any, header: Any, pauses: tuple[float, ...]) -> None:
        try:
            send(response, header, pauses)
        except InvalidHandle:
            warn(f"{service.srv_name}: an answer is given up, the service was taken away meanwhile")

    service.send_response = send


def _sent(send_once: Callable[[Any, Any], None], response: Any, header: Any) -> bool:
    """Send an answer; False when it was dropped because the client is not known yet."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        send_once(response, header)
    dropped = False
    for warning in caught:
        if warning.category is RuntimeWarning and "failed to send response" in str(warning.message):
            dropped = True
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
    return not dropped
