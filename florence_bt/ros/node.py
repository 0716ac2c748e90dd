"""The base of every ROS node of Florence."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.clock import Clock as RclClock
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.service import Service
from rclpy.timer import Timer as RclTimer

from florence_bt.core.clock import Clock
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.ros.answers import send_until_known
from florence_bt.ros.clock import RosClock, SteadyClock
from florence_bt.ros.parameters import fill_dataclass, to_parameter

T = TypeVar("T")


class FlorenceNode(Node):
    """A node with the core's clock, parameters as dataclasses, and an orderly end.

    Attributes:
        timebase: The node's ROS clock as a core clock; its callbacks run on the executor.
        ros_timebase: The same as what it is.
        steady: The time of this machine as a core clock, for what depends on other processes only.
        served_by: Identity of the thread that runs callbacks of the node right now, None between them.
        failures: Exceptions of guarded callbacks; whoever spins the node raises them
            (:class:`florence_bt.ros.executor.SpinLoop` does).
    """

    timebase: Clock
    steady: Clock

    def __init__(
        self,
        name: str,
        *,
        parameters: Mapping[str, Any] | None = None,
        namespace: str = "",
        context: Context | None = None,
    ) -> None:
        """Make the node.

        Args:
            name: The node's name.
            parameters: Values of parameters by name, ``use_sim_time`` among them; None values are left out.
            namespace: Goes before the node's name and its relative topics.
            context: The ROS context; the process's own one when not given.
        """
        self.failures: deque[Exception] = deque()
        self.served_by: int | None = None
        self._soon: deque[Callable[[], None]] = deque()
        self._closers: list[Callable[[], None]] = []
        self._settled: list[Callable[[], bool]] = []
        self._destroyers: list[Callable[[], None]] = []
        self._given = {
            key: to_parameter(value) for key, value in (parameters or {}).items() if value is not None
        }
        overrides = [Parameter(key, value=value) for key, value in self._given.items()]
        super().__init__(name, namespace=namespace, parameter_overrides=overrides, context=context)
        self.ros_timebase = RosClock(self, self.call_soon)
        self.timebase = self.ros_timebase
        self._steady = SteadyClock(self)
        self.steady = self._steady

    def get_clock(self) -> RclClock:
        """The node's clock of rclpy; to be read at once: a kept one stands still while nobody asks here."""
        if hasattr(self, "ros_timebase"):
            self.ros_timebase.refresh()
        return super().get_clock()

    def create_timer(self, *arguments: Any, **options: Any) -> RclTimer:
        """A timer of rclpy; on simulated time it runs also while nobody else asks for the time."""
        if hasattr(self, "ros_timebase"):
            self.ros_timebase.refresh()
        return super().create_timer(*arguments, **options)

    def create_service(self, *arguments: Any, **options: Any) -> Service:
        """A service of rclpy whose answers also reach a client that is discovered only later."""
        service = super().create_service(*arguments, **options)
        send_until_known(
            service,
            lambda pause, callback: self.steady.call_at(self.steady.now() + pause, callback),
            lambda words: self.get_logger().warning(words),
        )
        return service

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
        """What is wrong with the names of the parameters that were given, when all were declared."""
        declared = [name for name in self._parameters if name not in _OWN_PARAMETERS]
        for name in self._given:
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
        """Wrap a callback that is handed to a future or an action client.

        The events executor of rclpy 7.1 dies of an exception in such a callback (it runs as a task); wrapped,
        the exception waits in :attr:`failures`.
        """

        def run(*arguments: Any) -> None:
            try:
                callback(*arguments)
            except Exception as error:
                self.failures.append(error)

        return run

    def on_close(self, callback: Callable[[], None]) -> None:
        """Call back when the node is closed, the latest first; servers and clients end themselves so."""
        self._closers.append(callback)

    def before_leaving(self, settled: Callable[[], bool]) -> None:
        """Let a closed node be served on, for a moment, until this says that nothing is open any more.

        The time of this machine goes on for it meanwhile, so that what got no answer is said again.
        """
        self._settled.append(settled)

    def may_leave(self) -> bool:
        """Whether nothing of a closed node waits for an answer any more."""
        return all(settled() for settled in self._settled)

    def on_destroy(self, callback: Callable[[], None]) -> None:
        """Call back when the node is destroyed, the latest first: for clients that hear the last answers."""
        self._destroyers.append(callback)

    def retire_service(self, service: Service) -> None:
        """Destroy a service that may have just been called.

        What the events executor of rclpy 7.1 has noticed but not served yet it serves also when its object
        was destroyed meanwhile, and that ends the process. So the executor is told first to let go of it;
        what it has noticed before that is served, and then the service is destroyed.
        """
        self._services.remove(service)
        self._wake_executor()
        self._when_let_go(service.destroy)

    def _when_let_go(self, destroy: Callable[[], None]) -> None:
        """Run when the executor has let go of what was taken from the node's lists, and has served the rest.

        It works in the order of what comes in. The first task comes after the letting go; what was noticed
        until then stands before the second one.
        """
        executor = self.executor
        if executor is None:
            destroy()
        else:
            executor.create_task(lambda: executor.create_task(destroy) and None)

    def destroy_node(self) -> None:
        """Take the node away; nobody serves it any more."""
        while self._destroyers:
            self._destroyers.pop()()
        self._steady.close()
        super().destroy_node()

    def missing(self) -> list[str]:
        """What the node needs and does not find yet, for people; empty when it is ready to work."""
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
        """Run what waits now; whoever spins the node calls it after each event.

        Returns:
            Whether more has come meanwhile.
        """
        soon = self._soon
        for _ in range(len(soon)):
            try:
                soon.popleft()()
            except Exception as error:
                self.failures.append(error)
        return bool(soon)

    def _read_parameter(self, name: str, default: Any) -> Any:
        descriptor = ParameterDescriptor(dynamic_typing=True, read_only=True)
        if not self.has_parameter(name):
            self.declare_parameter(name, default, descriptor)
        return self.get_parameter(name).value


_EXECUTOR: Any = vars(Node)["executor"]
_OWN_PARAMETERS = frozenset({"use_sim_time", "start_type_description_service"})
