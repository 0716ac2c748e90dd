"""A driver on its port: what the nodes of all devices that speak through a port of bytes share.

What the driver wants to say is sent when bytes came and when its time has come. The time, the executor and
the port are given, so this runs on a manual clock as well as on ROS.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import DeviceError
from florence_bt.drivers.connection import Connection
from florence_bt.drivers.serial_port import BytePort


class ByteDriver(Protocol):
    """A driver without a port; it is given bytes and the time."""

    def poll(self, now: float) -> bytes:
        """Do what is due and return the bytes to send."""

    def next_deadline(self) -> float | None:
        """Return when :meth:`poll` must be called at the latest, or None."""

    def shutdown(self) -> bytes:
        """Stop, and return the bytes that leave the device safe."""


class DriverPort:
    """Keeps a driver's port open, sends what the driver says, and comes back at its deadlines."""

    def __init__(
        self,
        driver: ByteDriver,
        clock: Clock,
        call_soon: Callable[[Callable[[], None]], None],
        open_port: Callable[[], BytePort],
        *,
        on_open: Callable[[BytePort], None],
        on_bytes: Callable[[bytes, float], None],
        on_lost: Callable[[DeviceError], None],
        on_problem: Callable[[str], None],
        send: Callable[[BytePort, bytes], None],
        delay_s: float,
        name: str,
        arrival_time: Callable[[], float] | None = None,
    ) -> None:
        """Prepare; :meth:`open` begins.

        Args:
            driver: The driver.
            clock: Gives the time.
            call_soon: Runs a callback on the owner's thread; called from another one.
            open_port: Opens the port, or raises DeviceError.
            on_open: Called with each port that was opened, to start the driver.
            on_bytes: Called with what the device sent and when it came; calls :meth:`pump` once the driver
                has it.
            on_lost: Called while a port that failed is still there, to send it a shutdown command.
            on_problem: Called with each new problem, once, for the log.
            send: Sends what the driver said, if anything, and looks after the port besides; raises
                DeviceError to give the port up.
            delay_s: The first pause before the port is opened again; doubled each time, up to ten times.
            name: What the port is called.
            arrival_time: As of :class:`Connection`.
        """
        self._driver = driver
        self._clock = clock
        self._start_driver = on_open
        self._on_port_lost = on_lost
        self._send = send
        self._deadline: Timer | None = None
        self._connection: Connection[BytePort, bytes] = Connection(
            clock,
            call_soon,
            open_port,
            on_open=self._on_open,
            on_item=on_bytes,
            on_lost=self._on_lost,
            on_problem=on_problem,
            delay_s=delay_s,
            name=name,
            arrival_time=arrival_time,
        )

    @property
    def device(self) -> BytePort | None:
        """The open port, None while there is none."""
        return self._connection.device

    @property
    def problem(self) -> str:
        """Say why there is no port, or why the last one was lost; empty once the device works."""
        return self._connection.problem

    def open(self) -> None:
        """Open the port now; when that fails, again and again."""
        self._connection.open()

    def works(self) -> None:
        """Note that the device works: the problem is over, and the next pause is a short one."""
        self._connection.works()

    def pump(self) -> None:
        """Send what the driver wants to say, and come back when it next has something to do."""
        port = self._connection.device
        if port is None:
            return
        try:
            self._send(port, self._driver.poll(self._clock.now()))
        except DeviceError as error:
            self._connection.lose(error)
            return
        self._forget_deadline()
        if (when := self._driver.next_deadline()) is not None:
            self._deadline = self._clock.call_at(when, self._on_deadline)

    def close(self) -> str:
        """Leave the device safe and release the port for good.

        Returns:
            Why the device may not have received the shutdown command; empty when it has, or without one.
        """
        self._forget_deadline()
        shutdown_command, port, not_sent = self._driver.shutdown(), self._connection.device, ""
        if port is not None:
            try:
                port.write(shutdown_command)
            except DeviceError as error:
                not_sent = str(error)
        self._connection.close()
        return not_sent

    def _on_open(self, port: BytePort) -> None:
        self._start_driver(port)
        self.pump()

    def _on_lost(self, error: DeviceError) -> None:
        self._forget_deadline()
        self._on_port_lost(error)

    def _on_deadline(self) -> None:
        # What has come already may be what the driver waits for.
        self._connection.serve()
        self.pump()

    def _forget_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
