"""Service answers that reach also a client that the server has not discovered yet.

A client may discover a server before the server discovers the client. An answer in that moment is
not sent: Fast DDS looks for the client for 0.1 s, then rclpy warns, and the client would wait forever. Here
such an answer is sent again until it goes out.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

from rclpy.exceptions import InvalidHandle

PAUSES_S = (0.1, 0.2, 0.4, 0.8, 1.6)
"""Machine time before each further attempt, seconds; each attempt may block the node for 0.1 s."""


def send_until_known(
    service: Any, call_later: Callable[[float, Callable[[], None]], Any], warn: Callable[[str], None]
) -> None:
    """Let a service send an answer again that its client could not get yet.

    Args:
        service: The service of rclpy; its ``send_response`` is replaced.
        call_later: Calls back on the node's executor after this many seconds of the machine's time.
        warn: Called with a sentence when an answer is given up.
    """
    send_once = service.send_response

    def send(response: Any, header: Any, pauses: tuple[float, ...] = PAUSES_S) -> None:
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
