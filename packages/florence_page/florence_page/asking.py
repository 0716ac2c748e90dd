"""A question that is put to a service again and again, without waiting."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from florence_bt.ros.node import FlorenceNode

T = TypeVar("T")

ANSWER_S = 3.0
"""Seconds for which an answer counts, and after which one that has not come is lost: six questions."""


class StandingQuestion(Generic[T]):
    """Asks a service whenever it is told to, one call at a time, and has its last answer while that is new.

    Args:
        node: Calls the service.
        service_type: The type of the service; an empty request asks.
        name: The name of the service.
        read: Makes the value of an answer.
        unknown: The value while there is no new answer.
    """

    def __init__(
        self, node: FlorenceNode, service_type: Any, name: str, read: Callable[[Any], T], unknown: T
    ) -> None:
        self._node = node
        self._request = service_type.Request
        self._client = node.create_client(service_type, name)
        self._read = read
        self._unknown = self._value = unknown
        self._value_until = self._asked_until = -math.inf
        self._asked: Any = None

    @property
    def value(self) -> T:
        """The last answer, while that is new."""
        return self._value if self._node.steady.now() < self._value_until else self._unknown

    def take(self, value: T) -> None:
        """Take note of a value that is known from elsewhere, as from the answer to a change."""
        self._value, self._value_until = value, self._node.steady.now() + ANSWER_S

    def ask(self) -> None:
        """Ask, unless a question is open."""
        now = self._node.steady.now()
        if not self._client.service_is_ready():
            self._value_until = -math.inf
        elif self._asked is None or self._asked.done() or now >= self._asked_until:
            if self._asked is not None:
                self._client.remove_pending_request(self._asked)
            self._asked = self._client.call_async(self._request())
            self._asked_until = now + ANSWER_S
            self._asked.add_done_callback(self._node.guarded(self._on_answer))

    def _on_answer(self, asked: Any) -> None:
        self.take(self._read(asked.result()))
