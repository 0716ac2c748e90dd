"""Ports: how a component is connected, by the names of topics, frames, actions and services.

A component is given :class:`Ports` and knows nothing else of what is around it: a node connects it with ROS
(``ros.ports``), the rig with the other components of one process (``simulation.rig.wires``), a test with
lists. What passes are values of ``core`` and dataclasses whose fields have the names of the interface's
fields; the moments in them are of the component's clock.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from florence_bt.core.clock import Clock
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome
from florence_bt.core.transforms import TransformBuffer

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
T_contra = TypeVar("T_contra", contravariant=True)
Fields = Mapping[str, Any]
"""Fields of a message by name. Those that a type does not have are left out, so that several can be told the
same; durations are seconds, poses :class:`FramedPose`, ways :class:`FramedPath`."""


class Delivery(enum.Enum):
    """The ways in which a topic's values reach who listens (the quality of service of ROS 2)."""

    SENSOR = "sensor"
    """Readings that are soon replaced; when somebody is late, the newest counts."""
    STATE = "state"
    """The same, many times a second."""
    COMMAND = "command"
    """Commands that are replaced by the next one: nobody is given an older one late."""
    RELIABLE = "reliable"
    """Each reaches everybody."""
    LATCHED = "latched"
    """The last one also reaches who comes later."""


@dataclass(frozen=True, slots=True)
class Topic(Generic[T]):
    """A topic.

    Attributes:
        name: Its name.
        kind: The type of what it carries; of a :class:`Picture`, what can be read.
        delivery: How that reaches who listens.
        interface: The type of its messages where ``kind`` alone does not say it, e.g. ``std_msgs/msg/Bool``.
    """

    name: str
    kind: type[T]
    delivery: Delivery = Delivery.RELIABLE
    interface: str = ""


def pictures(name: str, kind: type[T]) -> Topic[Picture[T]]:
    """Name a topic of pictures, each of which is read when it is wanted."""
    return Topic(name, kind, Delivery.SENSOR)  # type: ignore[arg-type]


NOT_SAVED_PERIOD_S = 600.0
"""Between two warnings that something is not kept. Chosen: a full disk stays full for a while."""
WARNING_PERIOD_S = 5.0
"""Between two warnings about one thing, seconds (chosen)."""
REFUSED = 65535
"""The ``error_code`` of a goal that was refused."""


@dataclass(frozen=True, slots=True)
class NoFields:
    """The request of a service that is asked for nothing in particular, or its answer."""


@dataclass(frozen=True, slots=True)
class Service:
    """A service.

    Attributes:
        name: Its name; one that begins with ``~/`` is below the name of the node.
        interface: Its type.
        request: The dataclass of its requests, with the fields that are read.
    """

    name: str
    interface: str
    request: type = NoFields


@dataclass(frozen=True, slots=True)
class Action:
    """An action.

    Attributes:
        name: Its name.
        interface: Its type.
        goal: The dataclass of its goals, with the fields that are read.
        bad_goal_code: The ``error_code`` of a goal whose numbers are no numbers.
    """

    name: str
    interface: str
    goal: type
    bad_goal_code: int = REFUSED


class Picture(Protocol[T_co]):
    """A picture that costs something to read."""

    @property
    def stamp(self) -> float:
        """Return the time at which it was taken, seconds."""

    def read(self) -> T_co:
        """Return it.

        Raises:
            FlorenceError: It cannot be read.
        """


class Connection(Protocol):
    """A listener, until it is closed."""

    def close(self) -> None:
        """Listen no more."""


class Output(Protocol[T_contra]):
    """A topic that is published."""

    @property
    def listeners(self) -> int:
        """Count those who listen."""

    def send(self, value: T_contra) -> None:
        """Publish a value."""


class Frames(Connection, Protocol):
    """The frames that are published while somebody listens."""

    @property
    def buffer(self) -> TransformBuffer:
        """Give what is known of them; their moments are of the component's clock."""


class Goals(Protocol):
    """An action that is served, one goal at a time; a newer goal takes the place of an older one."""

    @property
    def active(self) -> bool:
        """Tell whether a goal is being worked on."""

    def feedback(self, feedback: Fields) -> None:
        """Tell of the running goal, if there is one."""

    def finish(self, result: Fields, outcome: Outcome) -> None:
        """End the running goal, if there is one."""


class Ports(Protocol):
    """The connections of a component. All callbacks come one at a time, and none within a call of these."""

    @property
    def clock(self) -> Clock:
        """The component's time."""

    @property
    def steady(self) -> Clock:
        """The time of the machine, for how long something takes it."""

    def output(self, topic: Topic[T]) -> Output[T]:
        """Publish on a topic."""

    def listen(self, topic: Topic[Any], take: Callable[[Any], None]) -> Connection:
        """Call back with each value of a topic; of pictures, with each :class:`Picture`."""

    def listen_to_frames(self, *, moving: bool = True) -> Frames:
        """Keep where all frames are and were.

        Args:
            moving: Also those that move. That is expensive, and not needed for the mounting of a sensor.
        """

    def send_frame(self, parent: str, child: str, when: float, pose: Pose2) -> None:
        """Publish where a frame was at a moment."""

    def serve(self, service: Service, answer: Callable[[Any], Fields]) -> None:
        """Answer a service, given its requests."""

    def serve_goals(
        self, action: Action, begin: Callable[[Any], str | None], cancel: Callable[[], None]
    ) -> Goals:
        """Serve an action.

        Args:
            action: It.
            begin: Given a goal: begins the work and returns None, or returns why the goal is refused.
            cancel: The goal shall end; ``finish`` is then called.
        """

    def work(self, task: Callable[[], T], done: Callable[[T], None]) -> None:
        """Do what takes long beside the rest, one after the other, and call back with the result."""

    def on_time_jump(self, callback: Callable[[], None]) -> None:
        """Call back when moments of before mean nothing any more."""

    def tell(self, text: str, *, good: bool) -> None:
        """Tell people what has happened."""

    def warn(self, text: str, about: Hashable = None, period_s: float = WARNING_PERIOD_S) -> None:
        """Warn people, at most once in so many seconds for what it is about."""

    def refuse(self, source: str, problem: str) -> None:
        """Count a value that is of no use, and tell people.

        Args:
            source: The topic that it came on, or what else brought it.
            problem: What is wrong with it, and what would have worked.
        """
