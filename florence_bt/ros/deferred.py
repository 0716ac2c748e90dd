"""Service answers that come later. Knows the service only by its ``send_response``, not ROS itself.

The events executor of rclpy 7.1 does not await service callbacks that are coroutines; it passes whatever the
callback returns to ``service.send_response``. A callback may therefore return a :class:`Deferred`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Deferred:
    """An answer that is given later, once."""

    def __init__(self) -> None:
        self._send: Callable[[Any], None] | None = None
        self._response: Any = None
        self._sent = False

    def answer(self, response: Any) -> bool:
        """Give the answer; False when it was given before."""
        if self._response is not None:
            return False
        self._response = response
        self._flush()
        return True

    def send_with(self, send: Callable[[Any], None]) -> None:
        """Tell how to send the answer."""
        self._send = send
        self._flush()

    def _flush(self) -> None:
        if self._send is not None and self._response is not None and not self._sent:
            self._sent = True
            self._send(self._response)


def allow_deferred(service: Any) -> None:
    """Let the callback of a service return a :class:`Deferred`."""
    send_now = service.send_response

    def send_response(response: Any, header: Any) -> None:
        if isinstance(response, Deferred):
            response.send_with(lambda answer: send_now(answer, header))
        else:
            send_now(response, header)

    service.send_response = send_response
