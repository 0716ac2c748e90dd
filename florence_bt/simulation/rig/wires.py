"""The wires of the rig: they connect the ports of its components by name, in one process on one clock.

What is sent comes at the same moment, after what is going on, in the order in which it was sent. A
:class:`Link` makes a topic late, or drops some of what it carries, as a real network does.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from functools import partial
from random import Random
from types import SimpleNamespace
from typing import Any, Generic, TypeVar, get_type_hints

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import FramedPath, FramedPose, Pose2
from florence_bt.core.outcome import Outcome, Result, cancelled, failure
from florence_bt.core.ports import WARNING_PERIOD_S, Action, Delivery, Fields, Service, Topic
from florence_bt.core.skill import BaseRun, Event
from florence_bt.core.transforms import Transform3, TransformBuffer

T = TypeVar("T")
TRANSFORMS = "/tf"
"""The link of the frames that move."""


@dataclass(frozen=True, slots=True)
class Link:
    """Quality of a topic's link.

    Attributes:
        delay: Seconds until a value is there.
        drops: The share of values that is lost, 0 to 1; of reliable and latched topics none is.
        silent_from: From this second of the clock on nothing is carried, as when its sender has died.
        silent_for: For so many seconds.
    """

    delay: float = 0.0
    drops: float = 0.0
    silent_from: float = 0.0
    silent_for: float = 0.0


PERFECT = Link()
EVERY = "*"
"""The link of the topics that have none of their own."""


class RigTopic:
    """A topic as skills see it, whose messages have the fields of the interface."""

    def __init__(self) -> None:
        self._subscribers: list[Callable[[Any], None]] = []
        self.last: Any = None

    @property
    def listeners(self) -> int:
        """Count the listeners."""
        return len(self._subscribers)

    def subscribe(self, callback: Callable[[Any], None]) -> None:
        """Call back with each message."""
        self._subscribers.append(callback)

    def unsubscribe(self, callback: Callable[[Any], None]) -> None:
        """Call back no more."""
        self._subscribers.remove(callback)

    def publish(self, **values: Any) -> None:
        """Send a message with these fields, at once."""
        self.carry(SimpleNamespace(**values))

    def carry(self, message: Any) -> None:
        """Give a message to who listens."""
        self.last = message
        for callback in tuple(self._subscribers):
            callback(message)


class ComponentRun(BaseRun):
    """A run of a component in this process: accepted at once, ended by :meth:`finish`.

    Args:
        feedback: What the component does.
        on_cancel: Asks the component to stop; it then finishes the run.
    """

    def __init__(self, feedback: str, on_cancel: Callable[[], None]) -> None:
        super().__init__(feedback)
        self._on_cancel = on_cancel
        self.handle(Event.ACCEPTED)

    def cancel(self) -> None:
        """Ask the component to stop."""
        if self.handle(Event.CANCEL):
            self._on_cancel()

    def finish(self, result: Result) -> None:
        """End the run; later results are dropped."""
        self.handle(Event.FINISHED, result)


class ExclusiveComponent:
    """A component that serves one run at a time; a newer run ends the older one, as a Nav2 server would."""

    def __init__(self) -> None:
        self._run: ComponentRun | None = None

    @property
    def active(self) -> bool:
        """Tell whether a run is served."""
        return self._run is not None

    def begin(self, feedback: str, on_cancel: Callable[[], None]) -> ComponentRun:
        """Make the run that is served from now on."""
        self.finish(cancelled("preempted by a newer goal"))
        self._run = ComponentRun(feedback, on_cancel)
        return self._run

    def tell(self, feedback: str) -> None:
        """Change what the run says of itself, if there is one."""
        if self._run is not None:
            self._run.set_feedback(feedback)

    def finish(self, result: Result) -> None:
        """End the run that is served, if there is one."""
        run, self._run = self._run, None
        if run is not None:
            run.finish(result)


class WiredAction:
    """An action that a component serves."""

    def __init__(
        self, action: Action, begin: Callable[[Any], str | None], cancel: Callable[[], None]
    ) -> None:
        self._action, self._begin, self._cancel = action, begin, cancel
        self._component = ExclusiveComponent()
        self._read: Callable[[Any, Outcome], Result] = lambda result, outcome: cancelled()
        self._told: Callable[[Any], str] = str

    @property
    def active(self) -> bool:
        """Tell whether a goal is being worked on."""
        return self._component.active

    def start(
        self,
        goal: Mapping[str, Any],
        read: Callable[[Any, Outcome], Result],
        told: Callable[[Any], str],
    ) -> ComponentRun:
        """Send a goal.

        Args:
            goal: Its fields.
            read: The skill's result from the result's fields and the way the goal ended.
            told: A text for people from feedback.

        Returns:
            The run of the goal.
        """
        run = self._component.begin(self._action.name, self._cancel)
        self._read, self._told = read, told
        refusal = self._begin(made_of(self._action.goal, goal))
        if refusal is not None:
            self._component.finish(failure("rejected", refusal))
        return run

    def feedback(self, feedback: Fields) -> None:
        """Tell of the running goal."""
        self._component.tell(self._told(as_message(feedback)))

    def finish(self, result: Fields, outcome: Outcome) -> None:
        """End the running goal."""
        self._component.finish(self._read(as_message(result), outcome))


def made_of(kind: type[T], values: Fields) -> T:
    """Make a goal or request of the fields that a skill sends.

    Args:
        kind: Its dataclass.
        values: Path of a field -> value; a pose is of the map.
    """
    hints = get_type_hints(kind)
    made: dict[str, Any] = {}
    parts: defaultdict[str, dict[str, Any]] = defaultdict(dict)
    for path, value in values.items():
        name, _, rest = path.partition(".")
        if rest:
            parts[name][rest] = value
        else:
            made[name] = _framed(value)
    made |= {name: made_of(hints[name], below) for name, below in parts.items()}
    return kind(**made)


def _framed(value: Any) -> Any:
    match value:
        case Pose2():
            return FramedPose(value)
        case list() | tuple():
            return tuple(_framed(each) for each in value)
        case _:
            return value


def as_message(values: Fields) -> SimpleNamespace:
    """Make what skills read of a result, feedback or answer: it has the fields of the interface."""
    return SimpleNamespace(**{name: _as_field(value) for name, value in values.items()})


def _as_field(value: Any) -> Any:
    if isinstance(value, FramedPath):
        places = [SimpleNamespace(position=SimpleNamespace(x=each.x, y=each.y)) for each in value.poses]
        return SimpleNamespace(poses=[SimpleNamespace(pose=place) for place in places])
    if isinstance(value, tuple):
        return [_as_pose(each) if isinstance(each, Pose2) else each for each in value]
    return value


def _as_pose(pose: Pose2) -> SimpleNamespace:
    turn = SimpleNamespace(x=0.0, y=0.0, z=math.sin(pose.yaw / 2.0), w=math.cos(pose.yaw / 2.0))
    return SimpleNamespace(position=SimpleNamespace(x=pose.x, y=pose.y), orientation=turn)


class _Wire:
    """A listener to a topic, until it is closed."""

    def __init__(self, topic: RigTopic, receive: Callable[[Any], None]) -> None:
        self._topic, self._receive = topic, receive
        topic.subscribe(receive)

    def close(self) -> None:
        """Listen no more."""
        self._topic.unsubscribe(self._receive)


class _WiredFrames:
    """The frames as one component knows them."""

    def __init__(self, wires: Wires, *, moving: bool) -> None:
        self._wires, self._moving = wires, moving
        self.buffer = TransformBuffer()
        for parent, child, transform in wires.mounts:
            self.buffer.set_static(parent, child, transform)
        if moving:
            wires.buffers.append(self.buffer)

    def close(self) -> None:
        """Keep them no more."""
        if self._moving:
            self._wires.buffers.remove(self.buffer)


class _WiredOutput(Generic[T]):
    """A topic that a component publishes."""

    def __init__(self, wires: Wires, name: str, topic: Topic[T]) -> None:
        self._wires, self._name, self._topic = wires, name, topic
        self._carried = wires.topics[name]
        self._plain = topic.kind in (bool, float, str)

    @property
    def listeners(self) -> int:
        """Count the listeners."""
        return self._carried.listeners

    def send(self, value: T) -> None:
        """Send a value on its way."""
        message = SimpleNamespace(data=value) if self._plain else value
        sure = self._topic.delivery in (Delivery.RELIABLE, Delivery.LATCHED)
        if not self._carried.listeners and self._topic.delivery is not Delivery.LATCHED:
            return  # nobody hears it
        self._wires.carry(self._name, partial(self._carried.carry, message), value, sure=sure)


class Wires:
    """Connects components.

    Args:
        clock: Their time.
        mounts: Parent, child and transform of the frames that do not move.
        links: How well topics are carried, by name, frames by :data:`TRANSFORMS`, others by :data:`EVERY`;
            perfectly without one.
        seed: Decides what is dropped.

    Attributes:
        topics: By name.
        actions: Those that are served, by name.
        services: The same.
        refused: How many values were of no use, by topic or what else brought them.
        buffers: Where the frames that move are, as each component knows them.
        mounts: As given.
    """

    def __init__(
        self,
        clock: ManualClock,
        mounts: list[tuple[str, str, Transform3]],
        links: Mapping[str, Link] | None = None,
        seed: int = 0,
    ) -> None:
        self.clock = clock
        self.mounts = mounts
        self.topics: defaultdict[str, RigTopic] = defaultdict(RigTopic)
        self.actions: dict[str, WiredAction] = {}
        self.services: dict[str, Callable[[Fields], Any]] = {}
        self.refused: Counter[str] = Counter()
        self.buffers: list[TransformBuffer] = []
        self._links = links or {}
        self._chance = Random(seed)

    def carry(self, name: str, deliver: Callable[[], None], value: Any = None, *, sure: bool = False) -> None:
        """Send something on its way over the link of a topic."""
        link = self._link_of(name)
        if link.drops and not sure and self._chance.random() < link.drops:
            return
        if link.silent_from <= self.clock.now() < link.silent_from + link.silent_for:
            return
        if link.delay and hasattr(value, "read"):
            value.read()  # what a picture shows is of the moment at which it is taken
        self.clock.call_at(self.clock.now() + link.delay, deliver)

    def carry_frame(self, parent: str, child: str, when: float, pose: Pose2) -> None:
        """Send where a frame was to each component that keeps frames, over the link of all frames."""
        if self._link_of(TRANSFORMS).drops:  # each loses its own
            for buffer in self.buffers:
                self.carry(TRANSFORMS, partial(_place, [buffer], parent, child, when, pose))
        else:
            self.carry(TRANSFORMS, partial(_place, [*self.buffers], parent, child, when, pose))

    def _link_of(self, name: str) -> Link:
        return self._links.get(name) or self._links.get(EVERY, PERFECT)

    def check_links(self) -> None:
        """Refuse links of which nothing is known, once everything is connected.

        Raises:
            ConfigError: No component sends or hears a topic of this name.
        """
        known = {EVERY, TRANSFORMS, *self.topics}
        for name in self._links.keys() - known:
            raise ConfigError(f"nothing is carried on {name!r}", valid=closest_first(name, known))

    def ports(self, node: str, renamed: Mapping[str, str] | None = None) -> WiredPorts:
        """Make the ports of a component.

        Args:
            node: The name of its node.
            renamed: Topics of the component that are others here, as by the remappings of ROS.
        """
        return WiredPorts(self, node, renamed or {})


class WiredPorts:
    """The ports of one component in the rig."""

    def __init__(self, wires: Wires, node: str, renamed: Mapping[str, str]) -> None:
        self._wires, self._node, self._renamed = wires, node, renamed
        self.clock = self.steady = wires.clock

    def output(self, topic: Topic[T]) -> _WiredOutput[T]:
        """Publish on a topic."""
        return _WiredOutput(self._wires, self._whole(topic.name), topic)

    def listen(self, topic: Topic[Any], take: Callable[[Any], None]) -> _Wire:
        """Listen to a topic."""
        carried = self._wires.topics[self._whole(topic.name)]
        plain = topic.kind in (bool, float, str)
        wire = _Wire(carried, (lambda message: take(message.data)) if plain else take)
        if topic.delivery is Delivery.LATCHED and carried.last is not None:
            last = carried.last
            deliver = partial(take, last.data if plain else last)
            self._wires.carry(self._whole(topic.name), deliver, sure=True)
        return wire

    def _whole(self, name: str) -> str:
        return self._renamed.get(name, name).replace("~", self._node)

    def listen_to_frames(self, *, moving: bool = True) -> _WiredFrames:
        """Keep where all frames are."""
        return _WiredFrames(self._wires, moving=moving)

    def send_frame(self, parent: str, child: str, when: float, pose: Pose2) -> None:
        """Publish where a frame was."""
        self._wires.carry_frame(parent, child, when, pose)

    def serve(self, service: Service, answer: Callable[[Any], Fields]) -> None:
        """Serve a service."""

        def respond(request: Fields) -> Any:
            return as_message(answer(made_of(service.request, request)))

        self._wires.services[self._whole(service.name)] = respond

    def serve_goals(
        self, action: Action, begin: Callable[[Any], str | None], cancel: Callable[[], None]
    ) -> WiredAction:
        """Serve an action."""
        served = self._wires.actions[action.name] = WiredAction(action, begin, cancel)
        return served

    def work(self, task: Callable[[], T], done: Callable[[T], None]) -> None:
        """Do it at once; what comes of it is known after what is going on."""
        self.clock.call_at(self.clock.now(), partial(done, task()))

    def on_time_jump(self, callback: Callable[[], None]) -> None:
        """Forget the callback: this time does not jump."""

    def tell(self, text: str, *, good: bool) -> None:
        """Tell nobody: nobody reads along in the rig."""

    def warn(self, text: str, about: Hashable = None, period_s: float = WARNING_PERIOD_S) -> None:
        """Warn nobody."""

    def refuse(self, source: str, problem: str) -> None:
        """Count it among what was refused."""
        self._wires.refused[source] += 1


def _place(buffers: list[TransformBuffer], parent: str, child: str, when: float, pose: Pose2) -> None:
    for buffer in buffers:
        buffer.set_moving(parent, child, when, pose)
