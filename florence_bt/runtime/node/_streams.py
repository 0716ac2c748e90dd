"""Streams that watchers open and close: one topic each, and an end for those that nobody closes.

A watcher that is killed closes nothing. A stream that nobody listens to is therefore closed after a while.

While streams are open, their listeners are counted now and then. The executor could report who joins and
leaves, but it crashes when a publisher that it watches so is destroyed at such a moment.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Generic, TypeVar

from rclpy.exceptions import InvalidTopicNameException
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_topic_name import validate_topic_name

from florence_bt.core.errors import ConfigError
from florence_bt.ros.latched_publisher import LatchedPublisher
from florence_bt.ros.node import FlorenceNode
from florence_bt.runtime.viewers.streams import MAX_STREAMS, topic_of

LOOK_S = 0.1
"""How often the listeners of open streams are counted, in steady time."""
LINGER_S = 30.0
"""How long a stream stays open without a listener, in steady time."""

T = TypeVar("T")


class ViewerStream(Generic[T]):
    """One open stream.

    Attributes:
        publisher: Where it goes.
        wanted: What the watcher wants to see.
        shown: What it was shown last, to know what is new; None before the first time.
        shown_at: When that was, steady time.
        users: How many have opened it under the same name.
        listeners: How many listened when they were counted last.
        heard_at: When somebody listened last, steady time.
    """

    def __init__(self, publisher: LatchedPublisher, wanted: T) -> None:
        self.publisher = publisher
        self.wanted = wanted
        self.shown: Any = None
        self.shown_at = 0.0
        self.users = 1
        self.listeners = 0
        self.heard_at = 0.0


class ViewerStreams(Generic[T]):
    """The open streams of one kind.

    Args:
        node: The node that publishes them.
        message_type: Type of their messages.
        folder: Where they live below the node's name.
        automatic: Begin of the names that are made for those who want none.
        show: Publishes the state of the moment on a stream, unless all who listen have it.
    """

    def __init__(
        self,
        node: FlorenceNode,
        message_type: Any,
        *,
        folder: str,
        automatic: str,
        show: Callable[[ViewerStream[T]], None],
    ) -> None:
        self._node = node
        self._type = message_type
        self._folder = folder
        self._automatic = automatic
        self._show = show
        self._open: dict[str, ViewerStream[T]] = {}
        self._count = 0
        self._looks = False

    def __iter__(self) -> Iterator[ViewerStream[T]]:
        """The open streams, in the order in which they were opened."""
        return iter(tuple(self._open.values()))

    def __len__(self) -> int:
        return len(self._open)

    def find(self, topic: str) -> ViewerStream[T] | None:
        """The stream with this topic, None when there is none."""
        return self._open.get(topic)

    def open(self, wanted_topic: str, wanted: T) -> str:
        """Open a stream; one with the same name is shared, and shows what was wanted last.

        Returns:
            Its full topic.

        Raises:
            ConfigError: The name cannot be used, or too many streams are open.
        """
        topic = self._full_name(wanted_topic)
        known = self._open.get(topic)
        if known is not None:
            known.users += 1
            known.wanted = wanted
            return topic
        if len(self._open) >= MAX_STREAMS:
            raise ConfigError(
                f"{MAX_STREAMS} streams are open already", valid=["closing one that is not needed any more"]
            )
        self._refuse_other_types(topic)
        stream = ViewerStream(LatchedPublisher(self._node, self._type, topic), wanted)
        stream.heard_at = self._node.steady.now()
        self._open[topic] = stream
        self._show(stream)
        if not self._looks:
            self._look_later()
        return topic

    def close(self, topic: str) -> bool:
        """Close a stream for one of its users; whether there was such a stream."""
        stream = self._open.get(topic)
        if stream is None:
            return False
        stream.users -= 1
        if stream.users == 0:
            self._end(topic)
        return True

    def on_close(self, request: Any, response: Any) -> Any:
        """Serve the service that closes a stream."""
        response.result = self.close(request.topic_name)
        return response

    def _full_name(self, wanted: str) -> str:
        relative = topic_of(wanted, self._count, folder=self._folder, automatic=self._automatic)
        try:
            validate_topic_name(relative)
            full = str(self._node.resolve_topic_name(relative))
            validate_full_topic_name(full)
        except (InvalidTopicNameException, ValueError) as error:
            raise ConfigError(
                f"{wanted!r} cannot be the name of a topic: {str(error).splitlines()[0]}",
                valid=["letters, digits and _, e.g. my_stream"],
            ) from error
        if not wanted:
            self._count += 1
        return full

    def _refuse_other_types(self, topic: str) -> None:
        package, kind = self._type.__module__.split(".")[:2]
        own = f"{package}/{kind}/{self._type.__name__}"
        for name, types in self._node.get_topic_names_and_types():
            if name == topic and own not in types:
                raise ConfigError(f"the topic {topic} is taken by {', '.join(types)}", valid=["another name"])

    def _look_later(self) -> None:
        self._looks = True
        self._node.steady.call_at(self._node.steady.now() + LOOK_S, self._look)

    def _look(self) -> None:
        """See who has joined and which streams nobody listens to any more."""
        now = self._node.steady.now()
        for topic, stream in tuple(self._open.items()):
            before, stream.listeners = stream.listeners, stream.publisher.listeners
            if stream.listeners > before:
                self._show(stream)
            if stream.listeners:
                stream.heard_at = now
            elif now - stream.heard_at >= LINGER_S:
                self._end(topic)
        self._looks = False
        if self._open:
            self._look_later()

    def _end(self, topic: str) -> None:
        self._open.pop(topic).publisher.close()
