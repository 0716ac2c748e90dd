"""The base of every ROS node of Florence."""

from __future__ import annotations

import functools
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

from nav_msgs.msg import OccupancyGrid
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock as RclClock
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Timer as RclTimer

from florence_bt.core.clock import Clock
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.ros.answers import serve_answers
from florence_bt.ros.clock import RosClock, SteadyClock
from florence_bt.ros.graph_names import GraphNames
from florence_bt.ros.node_health import NodeHealth
from florence_bt.ros.parameters import fill_dataclass, to_parameter
from florence_bt.ros.qos import COMMAND, STATE
from florence_bt.ros.raw_messages import UnreadableBytes, is_read_here, read_message
from florence_bt.ros.rclpy_internals import forget, throttle_logs_by_steady_time
from florence_bt.ros.rounds import NewestReadings, Rounds
from florence_bt.ros.validation import MAX_STAMP_OFFSET_S, problem_with

if TYPE_CHECKING:
    from florence_bt.ros.server_graph import ServerGraph

MOST_OF_MANY = 20
"""Messages of ``/tf`` that a process that is late still takes at once: those of some publishers."""

MAX_COMMAND_AGE_S = 1.0
"""Seconds after which a command is one of before. Chosen: a process that is silent for so long counts as one
that hangs, and the base has been stopped meanwhile (docs/manual/runtime.md)."""


class Stamped(Protocol):
    """A frozen dataclass with a moment in seconds."""

    @property
    def stamp(self) -> float:
        """Return the time at which it was measured."""


T = TypeVar("T")
S = TypeVar("S", bound=Stamped)
REASON_FIELDS = ("message", "reason", "report", "error_msg", "tree")
"""Fields of answers and results that say why, the first that there is."""
FAILURES = (("result", "RESULT_UNDEFINED_FAILURE"),)
"""Fields of answers whose default is success, and the constant of the type that says failure:
``nav2_msgs/LoadMap``."""


class FlorenceNode(Node):
    """A node with the core's clock, parameters as dataclasses, checked messages and an orderly end.

    Every message and request is checked by its type (:mod:`florence_bt.ros.validation`) before a callback
    gets it, and an exception of a callback leaves the executor alone: see :attr:`failures`.

    Attributes:
        timebase: The node's time as a core clock, for everything that is a duration: it does not leap when
            the ROS clock does. Its callbacks run on the executor.
        ros_timebase: The same as what it is.
        steady: The time of this machine as a core clock, for what depends on other processes only.
        served_by: Identity of the thread that runs callbacks of the node right now, None between them.
        health: Counts, logs and publishes refused messages and failed callbacks.
        failures: Exceptions of callbacks; the :class:`~florence_bt.ros.executor.SpinLoop` raises them or
            hands them to :meth:`fail`.
        before_long_work: Called before a callback that may take seconds, so that nobody takes the process for
            one that hangs: before each on a map, which may have 25 million cells.
        fatal: An exception after which the node cannot work; the loop that spins the node raises it.
    """

    timebase: Clock
    steady: Clock

    replaced_parameters: ClassVar[Mapping[str, str]] = {}
    """Parameters that a user of other programs may expect -> what to use instead."""

    parameter_classes: ClassVar[tuple[type, ...]] = ()
    """Classes that :meth:`read_parameters` is asked for; ``florence up`` checks them before any process
    starts."""

    def __init__(
        self,
        name: str,
        *,
        parameters: Mapping[str, Any] | None = None,
        namespace: str = "",
        context: Context | None = None,
        of_a_command: bool = False,
    ) -> None:
        """Make the node.

        Args:
            name: The node's name.
            parameters: Values of parameters by name, ``use_sim_time`` among them; None values are left out.
            namespace: Goes before the node's name and its relative topics.
            context: The ROS context; the process's own one when not given.
            of_a_command: Whether it goes with a command that was typed. Nobody sets its parameters, or reads
                its log elsewhere: it has no services for them and no ``/rosout``, which takes 80 ms less.
        """
        self.failures: deque[Exception] = deque()
        self.before_long_work: Callable[[], None] = lambda: None
        self.fatal: Exception | None = None
        self.health = NodeHealth(self)
        self.loop_rounds: Rounds | None = None
        self._graph_names = GraphNames(lambda words: self.get_logger().warning(words))
        self.served_by: int | None = None
        self._soon: deque[Callable[[], None]] = deque()
        self._closers: list[Callable[[], None]] = []
        self._settled: list[Callable[[], bool]] = []
        self._destroyers: list[Callable[[], None]] = []
        self._given = {
            key: to_parameter(value) for key, value in (parameters or {}).items() if value is not None
        }
        overrides = [Parameter(key, value=value) for key, value in self._given.items()]
        if of_a_command:
            overrides.append(Parameter("start_type_description_service", value=False))
        super().__init__(
            name,
            namespace=namespace,
            parameter_overrides=overrides,
            context=context,
            start_parameter_services=not of_a_command,
            enable_rosout=not of_a_command,
        )
        self.add_on_set_parameters_callback(self._refuse_another_time)
        self.ros_timebase = RosClock(self, self.call_soon)
        self.timebase = self.ros_timebase
        self._steady = SteadyClock(self)
        self.steady = self._steady

    @functools.cached_property
    def server_graph(self) -> ServerGraph:
        """Look at what other nodes offer; made when it is first asked for, because few nodes do."""
        from florence_bt.ros.server_graph import ServerGraph

        return ServerGraph(self)

    def stamp(self, when: float | None = None) -> float:
        """Return a message's stamp on the scale of the ROS clock: of now, or of a ``timebase`` moment."""
        return self.ros_timebase.ros_now() if when is None else self.ros_timebase.stamp_of(when)

    def time_of(self, stamp: float) -> float:
        """Return the moment of ``timebase`` that the stamp of a message names."""
        return self.ros_timebase.time_of(stamp)

    def timed(self, reading: S) -> S:
        """Return a reading from a message, with its moment of ``timebase`` in place of the stamp."""
        when = self.ros_timebase.time_of(reading.stamp)
        return reading if when == reading.stamp else replace(reading, stamp=when)  # type: ignore[type-var]

    def stamped(self, reading: S) -> S:
        """Return a reading that goes into a message, with a stamp in place of its moment of ``timebase``."""
        stamp = self.ros_timebase.stamp_of(reading.stamp)
        return reading if stamp == reading.stamp else replace(reading, stamp=stamp)  # type: ignore[type-var]

    def get_clock(self) -> RclClock:
        """Return the node's clock of rclpy; to be read at once: a kept one is not brought up to date."""
        if hasattr(self, "ros_timebase"):
            self.ros_timebase.refresh()
        return super().get_clock()

    def get_topic_names_and_types(self, no_demangle: bool = False) -> list[tuple[str, list[str]]]:
        """Return the topics of the graph whose names ROS allows, with their types (:class:`GraphNames`).

        Args:
            no_demangle: Give all of them, by the names that they have in DDS.
        """
        found = super().get_topic_names_and_types(no_demangle)
        return found if no_demangle else self._graph_names.typed("topic", found)

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return the services of the graph whose names ROS allows, with their types."""
        return self._graph_names.typed("service", super().get_service_names_and_types())

    def get_action_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return the actions of the graph whose names ROS allows, with their types."""
        from rclpy.action import get_action_names_and_types  # most nodes need nothing of it

        return self._graph_names.typed("action", get_action_names_and_types(self))

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return the nodes of the graph whose names ROS allows: names and namespaces."""
        return self._graph_names.nodes(super().get_node_names_and_namespaces())

    def get_node_names(self) -> list[str]:
        """Return the names of these nodes."""
        return [name for name, _ in self.get_node_names_and_namespaces()]

    def create_timer(
        self, timer_period_sec: float, callback: Callable[[], None], *arguments: Any, **options: Any
    ) -> RclTimer:
        """Make a timer of rclpy; on simulated time it runs also while the time is not read otherwise.

        On a robot it runs by the steady clock: who sets the machine's clock does not hold it up.
        """
        if hasattr(self, "ros_timebase"):
            self.ros_timebase.refresh()
            if options.get("clock") is None and not self.ros_timebase.simulated:
                options["clock"] = self._steady.rcl_clock
        return super().create_timer(timer_period_sec, self.guarded(callback), *arguments, **options)

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[..., None],
        qos_profile: QoSProfile | int,
        *,
        judge_stamps: bool = True,
        limits: bool = True,
        refused: Callable[[str], None] | None = None,
        newest_only: bool | None = None,
        sift: Callable[[bytes], bool] | None = None,
        **options: Any,
    ) -> Subscription:
        """Make a subscription of rclpy whose callback gets only messages that pass the check of their type.

        A stamp must be near the present time of the node, except on a latched topic, whose last message may
        be old, and with ``judge_stamps=False``, where the stamps are of another clock than the node's.

        ``limits=False`` lets every message through: those of other robots, whose skills judge each field that
        they read. ``refused`` is told why a message was not let through.

        When the process falls behind, the newest message of a best-effort subscription counts, and the rest
        is left out (:mod:`florence_bt.ros.rounds`); ``newest_only`` says otherwise: False for events, all of
        which count, True for costly callbacks on reliable topics. Of topics with several publishers, which
        have a deep history, it is the newest :data:`MOST_OF_MANY`.

        A command (:data:`~florence_bt.ros.qos.COMMAND`) that was sent more than :data:`MAX_COMMAND_AGE_S` ago
        is refused: it waited for a process that was held up, and who sent it may have let go meanwhile.

        ``sift`` gets the serialised message and says whether it is wanted at all: to decode one is most of
        the work. Messages that come often are read by :mod:`florence_bt.ros.raw_messages`: they have the
        fields of their type, but are no objects of its class.
        """
        if qos_profile is COMMAND:
            callback = self._of_now(callback, topic)
        if not options.get("raw"):
            latched = (
                isinstance(qos_profile, QoSProfile)
                and qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
            )
            if limits:
                judge_stamps = judge_stamps and not latched
                callback = self._checked(callback, topic, msg_type, refused, judge_stamps=judge_stamps)
            qos = qos_profile if isinstance(qos_profile, QoSProfile) else QoSProfile(depth=qos_profile)
            if newest_only is None:
                newest_only = qos.reliability == ReliabilityPolicy.BEST_EFFORT
            if newest_only or sift is not None or is_read_here(msg_type):
                options["raw"] = True  # what is left out is not decoded
                callback = self._decoded(callback, topic, msg_type, sift)
            if newest_only:
                callback = self._only_newest(callback, 1 if qos.depth <= STATE.depth else MOST_OF_MANY)
        if qos_profile is COMMAND:
            callback = _unpacked(callback)
        return super().create_subscription(msg_type, topic, callback, qos_profile, **options)

    # Each of these is wrapped, so that rclpy sees whether the callback also takes the information about the
    # message.

    def _checked(
        self,
        callback: Callable[..., None],
        topic: str,
        msg_type: type,
        refused: Callable[[str], None] | None,
        *,
        judge_stamps: bool,
    ) -> Callable[..., None]:
        """Make a callback for messages that may be wrong, which refuses those."""

        def ros_now_near(stamp: float) -> float:
            return self.ros_timebase.ros_now_near(stamp, MAX_STAMP_OFFSET_S)

        now = ros_now_near if judge_stamps else None

        @functools.wraps(callback)
        def receive(message: Any, *information: Any) -> None:
            problem = problem_with(message, now, msg_type)
            if problem is not None:
                self.health.count_refused(topic, problem)
                self.attempt(self.on_refused, topic)
                if refused is not None:
                    self.attempt(refused, problem)
                return
            if isinstance(message, OccupancyGrid):
                self.before_long_work()
            self.attempt(callback, message, *information)

        return receive

    def _of_now(self, callback: Callable[..., None], topic: str) -> Callable[..., None]:
        """Make a callback for commands that refuses those of before, by when their sender sent them.

        The date of a machine whose clock is further off than any stamp may be tells nothing.
        """

        def receive(message: Any, information: Any) -> None:
            age = time.time() - information["source_timestamp"] * 1e-9
            if MAX_COMMAND_AGE_S < age <= MAX_STAMP_OFFSET_S:
                allowed = f"{MAX_COMMAND_AGE_S:g} s at most, by clocks that agree"
                self.health.count_refused(topic, f"sent {age:.1f} s ago (would have worked: {allowed})")
                self.attempt(self.on_refused, topic)
                return
            callback(message)

        return receive

    def _decoded(
        self,
        callback: Callable[..., None],
        topic: str,
        msg_type: Any,
        sift: Callable[[bytes], bool] | None = None,
    ) -> Callable[..., None]:
        """Make a callback for serialised messages, which decodes those that are wanted."""
        decode = read_message if is_read_here(msg_type) else deserialize_message

        @functools.wraps(callback)
        def receive(serialised: bytes, *information: Any) -> None:
            if sift is not None and not sift(serialised):
                return
            try:
                message = decode(serialised, msg_type)
            except (UnreadableBytes, RuntimeError) as error:  # RuntimeError: of the middleware
                self.health.count_refused(topic, str(error))
                return
            callback(message, *information)

        return receive

    def _only_newest(self, callback: Callable[..., None], most: int) -> Callable[..., None]:
        """Make a callback that gets the newest messages only when the process falls behind."""
        readings = NewestReadings(callback, most)

        @functools.wraps(callback)
        def receive(*message: Any) -> None:
            if self.loop_rounds is None:
                callback(*message)
            else:
                readings.take(self.loop_rounds, *message)

        return receive

    def create_service(
        self, srv_type: Any, srv_name: str, callback: Callable[..., Any], **options: Any
    ) -> Service:
        """Make a service of rclpy that refuses requests which do not pass the check of their type.

        The answer to such a request, and to one whose callback fails, has the reason in the field that the
        type has for one (:data:`REASON_FIELDS`). Answers also reach a client that is discovered only later.
        A callback may return a :class:`~florence_bt.ros.answers.Deferred` and answer later.
        """

        def serve(request: Any, response: Any) -> Any:
            problem = problem_with(request)
            if problem is not None:
                self.health.count_refused(srv_name, problem)
                return failed(type(response), problem)
            try:
                return callback(request, response)
            except Exception as error:
                self.failures.append(error)
                return failed(type(response), f"the node {self.get_name()} failed: {error!r}")

        service = super().create_service(srv_type, srv_name, serve, **options)
        serve_answers(
            service,
            lambda pause, callback: self.steady.call_at(self.steady.now() + pause, callback),
            lambda words: self.get_logger().warning(words),
        )
        return service

    def resolve_action_name(self, name: str) -> str:
        """Return the full name of an action, with the rules for it.

        rcl applies a rule for the name of an action to none of the services and topics that it consists of.
        """
        return self.resolve_topic_name(name)

    def read_parameters(self, cls: type[T]) -> T:
        """Declare a parameter for each field of a frozen dataclass and read them all.

        The parameters are read-only afterwards: what a component was built with is what it works with.

        Raises:
            ConfigError: A value does not fit, is missing, or the dataclass refuses it; names the parameter.
        """
        try:
            return fill_dataclass(cls, self._read_parameter)
        except ConfigError as error:
            raise ConfigError(f"node {self.get_name()}: {error.problem}", valid=error.valid) from error

    def unknown_parameters(self) -> ConfigError | None:
        """Return what is wrong with the names of the parameters that were given, when all were declared."""
        declared = [name for name in self.get_parameters_by_prefix("") if name not in _OWN_PARAMETERS]
        for name in self._given:
            if name in self.replaced_parameters:
                instead = self.replaced_parameters[name]
                return ConfigError(f"node {self.get_name()} has no parameter {name!r}: {instead}")
            if not self.has_parameter(name):
                return ConfigError(
                    f"node {self.get_name()} has no parameter {name!r}", valid=closest_first(name, declared)
                )
        return None

    def call_soon(self, callback: Callable[[], None]) -> None:
        """Run a callback on the executor's thread; may be called from any thread.

        An exception of the callback ends the process as one of a subscription would.
        """
        self._soon.append(callback)
        if self.served_by == threading.get_ident():
            return  # within a callback: the loop looks when it is over, which a task would do much later
        executor = self.executor
        if executor is not None:
            executor.create_task(self.run_soon)

    def guarded(self, callback: Callable[..., Any]) -> Callable[..., None]:
        """Wrap a callback that is passed to a future or an action client.

        The events executor of rclpy 7.1 dies of an exception in such a callback (it runs as a task); wrapped,
        the exception waits in :attr:`failures`.
        """
        return functools.partial(self.attempt, callback)

    def attempt(self, callback: Callable[..., Any], *arguments: Any) -> None:
        """Call back; an exception waits in :attr:`failures`."""
        try:
            callback(*arguments)
        except Exception as error:
            self.failures.append(error)

    def fail(self, error: Exception) -> None:
        """Take note of an exception of a callback, stop what the node moves, and go on."""
        self.health.count_failed(error)
        try:
            self.on_failure(f"the node {self.get_name()} failed: {error!r}")
        except Exception as another:
            self.health.count_failed(another)

    def on_failure(self, reason: str) -> None:
        """Stop what this node moves: a callback failed. Nodes that move something override this."""

    def on_refused(self, topic: str) -> None:
        """Note that a message of a topic was refused. Nodes that a wrong command must stop override this."""

    def on_close(self, callback: Callable[[], None]) -> None:
        """Call back when the node is closed, the latest first; servers and clients end themselves so."""
        self._closers.append(callback)

    def before_leaving(self, settled: Callable[[], bool]) -> None:
        """Let a closed node be served on, for a moment, until this says that nothing is open any more.

        The time of this machine goes on for it meanwhile, so that what got no answer is sent again.
        """
        self._settled.append(settled)

    def may_leave(self) -> bool:
        """Tell whether nothing of a closed node waits for an answer any more."""
        return all(settled() for settled in self._settled)

    def on_destroy(self, callback: Callable[[], None]) -> None:
        """Call back when the node is destroyed, the latest first: for clients that need the last answers."""
        self._destroyers.append(callback)

    def retire(self, service: Service) -> None:
        """Destroy a service that may have just got a request.

        What the events executor of rclpy 7.1 has noticed but not served yet it serves also when its object
        was destroyed meanwhile, and that ends the process. So the executor first releases it;
        what it has noticed before that is served, and then the service is destroyed.
        """
        forget(self, service)
        self._when_let_go(service.destroy)

    def _when_let_go(self, destroy: Callable[[], None]) -> None:
        """Run when the executor has released what was taken from the node's lists, and has served the rest.

        It works in the order of what comes in. The first task comes after the letting go; what was noticed
        until then stands before the second one.
        """
        executor = self.executor
        if executor is None:
            destroy()
        else:
            executor.create_task(lambda: executor.create_task(destroy) and None)

    def destroy_node(self) -> None:
        """Take the node away; no executor serves it any more."""
        while self._destroyers:
            self._destroyers.pop()()
        self._steady.close()
        super().destroy_node()

    def missing(self) -> list[str]:
        """Return what the node needs and does not find yet, for people; empty when it is ready to work."""
        return []

    def close(self) -> None:
        """Leave the hardware safe and stop threads. Components override this."""

    def shut_down(self) -> None:
        """Close the node: its own :meth:`close` first, then everything of :meth:`on_close`.

        Every part is closed even when an earlier one fails.

        Raises:
            ExceptionGroup: Some of them failed.
        """
        errors: list[Exception] = []
        for part in (self.close, *reversed(self._closers), self.ros_timebase.close):
            try:
                part()
            except Exception as error:
                errors.append(error)
        self._closers.clear()
        if errors:
            raise ExceptionGroup(f"closing {self.get_name()}", errors)

    @property
    def executor(self) -> Any:
        """The executor that spins the node, None before there is one."""
        return _EXECUTOR.__get__(self)

    @executor.setter
    def executor(self, executor: Any) -> None:
        _EXECUTOR.__set__(self, executor)
        if executor is not None and self._soon:
            executor.create_task(self.run_soon)

    def run_soon(self) -> bool:
        """Run what waits now; the loop that spins the node calls it after each event.

        Returns:
            Whether more has come meanwhile.
        """
        soon = self._soon
        for _ in range(len(soon)):
            self.attempt(soon.popleft())
        return bool(soon)

    def _refuse_another_time(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        """Keep the clock that the node began with: every stamp and every wait is of it."""
        now = self.get_parameter("use_sim_time").value
        if all(each.name != "use_sim_time" or each.value == now for each in parameters):
            return SetParametersResult(successful=True)
        reason = f"use_sim_time is {now} for as long as the node runs: start it again with the other value"
        return SetParametersResult(successful=False, reason=reason)

    def _read_parameter(self, name: str, default: Any) -> Any:
        descriptor = ParameterDescriptor(dynamic_typing=True, read_only=True)
        if not self.has_parameter(name):
            self.declare_parameter(name, default, descriptor)
        return self.get_parameter(name).value


def with_reason(answer: Any, reason: str) -> Any:
    """Put a reason into the field that an answer or a result has for it; without one it stays as it is."""
    field = next((name for name in REASON_FIELDS if hasattr(answer, name)), None)
    if field is not None:
        setattr(answer, field, reason)
    return answer


def failed(answer_type: type, reason: str) -> Any:
    """Return the answer of a service that did nothing: no field says success, and its own has the reason."""
    answer = with_reason(answer_type(), reason)
    for field, constant in FAILURES:
        if hasattr(answer_type, constant):
            setattr(answer, field, getattr(answer_type, constant))
    return answer


def _unpacked(callback: Callable[..., None]) -> Callable[..., None]:
    """Make a callback for a message and what is known of it, which rclpy's events executor gives in one."""

    @functools.wraps(callback)
    def receive(*arguments: Any) -> None:
        callback(*(arguments[0] if len(arguments) == 1 else arguments))

    return receive


throttle_logs_by_steady_time()
_EXECUTOR: Any = Node.executor
_OWN_PARAMETERS = frozenset({"use_sim_time", "start_type_description_service"})
