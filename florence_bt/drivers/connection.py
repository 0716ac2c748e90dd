"""A device that is read on a thread, and opened again whenever it is lost: all driver nodes share this.

The time, the executor and the device are given, so this runs on a manual clock as well as on ROS.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Generic, Protocol, TypeVar

from florence_bt.core.clock import Clock, Timer
from florence_bt.core.errors import DeviceError

T_co = TypeVar("T_co", covariant=True)
T = TypeVar("T")
D = TypeVar("D", bound="ReadableDevice[object]")

LONGEST_BACK_OFF = 10
"""The longest pause, as a multiple of the first."""


class ReadableDevice(Protocol[T_co]):
    """A device that can be read and closed: a serial port, a socket, a source of frames."""

    def read(self, timeout_s: float) -> T_co | None:
        """Wait for the next item; see :class:`DeviceReader`."""

    def close(self) -> None:
        """Give the device back; harmless when it is closed already."""


class Connection(Generic[D, T]):
    """Keeps a device open: reads it on a thread, and opens it again, with growing pauses, when it is lost.

    The pauses grow until :meth:`works` is called: a device that opens but says nothing does not count.

    Attributes:
        device: The open device, None while there is none.
        problem: Why there is none, or why the last one was lost; empty once the device works.
        lost: How often a device was lost so far.
    """

    def __init__(
        self,
        clock: Clock,
        call_soon: Callable[[Callable[[], None]], None],
        open_device: Callable[[], D],
        *,
        on_open: Callable[[D], None],
        on_item: Callable[[T, float], None],
        on_lost: Callable[[DeviceError], None],
        on_problem: Callable[[str], None],
        delay_s: float,
        name: str,
        on_readers_thread: bool = False,
        arrival_time: Callable[[], float] | None = None,
    ) -> None:
        """Prepare; :meth:`open` begins.

        Args:
            clock: Gives the time of arrival and the moments of the attempts.
            call_soon: Runs a callback on the owner's thread; called from the reader's.
            open_device: Opens the device, or raises DeviceError.
            on_open: Called with each device that was opened, on the owner's thread like all the others.
            on_item: Called with what the device sent and when it came.
            on_lost: Called while a device that failed is still there, to send it a shutdown command.
            on_problem: Called with each new problem, once, for the log.
            delay_s: The first pause; doubled each time, up to ten times.
            name: What the device is called, for the reader's thread.
            on_readers_thread: Call on_item on the reader's thread, for an owner that drops what it has no
                time for. All other callbacks stay on the owner's.
            arrival_time: The time of what has just come, called on the reader's thread; the clock's when not
                given.
        """
        self._clock = clock
        self._call_soon = call_soon
        self._open_device = open_device
        self._on_open = on_open
        self._on_item = on_item
        self._on_lost = on_lost
        self._on_problem = on_problem
        self._delay_s = delay_s
        self._on_readers_thread = on_readers_thread
        self._arrival_time = arrival_time or clock.now
        self._name = name
        self._reader: DeviceReader[T] | None = None
        self._retry: Timer | None = None
        self._attempts = 0
        self._reported = ""
        self._inbox: deque[tuple[D, T, float]] = deque()
        self._scheduled = False
        self.device: D | None = None
        self.problem = ""
        self.lost = 0

    def open(self) -> None:
        """Open the device now; when that fails, again and again."""
        self._retry = None
        try:
            device = self._open_device()
        except DeviceError as error:
            self._retry_later(error)
            return
        self.device = device
        self._reader = DeviceReader(
            device.read,  # type: ignore[arg-type]
            partial(self._arrived, device),
            partial(self._failed, device),
            self._name,
        )
        self._reader.start()
        self._on_open(device)

    def works(self) -> None:
        """Note that the device works: the problem is over, and the next pause is a short one.

        One that was lost in the meantime does not.
        """
        if self.device is None:
            return
        self.problem = self._reported = ""
        self._attempts = 0

    def serve(self) -> None:
        """Hand on what has come already.

        That happens by itself; an owner that is late calls this before it thinks the device silent.
        """
        self._scheduled = False
        while self._inbox:
            device, item, arrived = self._inbox.popleft()
            if device is self.device:
                self._on_item(item, arrived)

    def lose(self, error: DeviceError) -> None:
        """Let go of a device that failed, and open it again later."""
        if self.device is None:
            return
        self.lost += 1
        self._on_lost(error)
        self._release()
        self._retry_later(error)

    def close(self) -> None:
        """Let go of the device for good."""
        if self._retry is not None:
            self._retry.cancel()
            self._retry = None
        self._release()

    def _release(self) -> None:
        device, reader = self.device, self._reader
        self.device = self._reader = None
        if reader is not None:
            reader.stop()
        if device is not None:
            device.close()

    def _retry_later(self, error: DeviceError) -> None:
        self.problem = str(error)
        if self.problem != self._reported:
            self._reported = self.problem
            self._on_problem(self.problem)
        delay = self._delay_s * min(2 ** min(self._attempts, 4), LONGEST_BACK_OFF)
        self._attempts += 1
        self._retry = self._clock.call_at(self._clock.now() + delay, self.open)

    # ---- the reader's thread ----------------------------------------------------------------------------

    def _arrived(self, device: D, item: T) -> None:
        arrived = self._arrival_time()
        if self._on_readers_thread:
            self._on_item(item, arrived)
            return
        self._inbox.append((device, item, arrived))
        if not self._scheduled:
            self._scheduled = True
            self._call_soon(self.serve)

    def _failed(self, device: D, error: DeviceError) -> None:
        self._call_soon(lambda: self.lose(error) if device is self.device else None)


WAIT_S = 0.1
"""Limit of one wait, so the longest that :meth:`DeviceReader.stop` blocks."""


class DeviceReader(Generic[T]):
    """Reads a device on a thread of its own and passes on what comes.

    Both callbacks run on that thread; a node passes them on through ``FlorenceNode.call_soon``.
    """

    def __init__(
        self,
        read: Callable[[float], T | None],
        on_item: Callable[[T], None],
        on_lost: Callable[[DeviceError], None],
        name: str,
    ) -> None:
        """Prepare the thread.

        Args:
            read: Waits at most this many seconds for the next item; gives nothing (None, no bytes) when the
                time is over, and raises DeviceError when the device fails. The device stays the caller's to
                close, after :meth:`stop`.
            on_item: Called with every item.
            on_lost: Called once when the device fails; the thread has nothing more to read then.
            name: What is read, for the name of the thread.
        """
        self._read = read
        self._on_item = on_item
        self._on_lost = on_lost
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reader of {name}", daemon=True)

    def start(self) -> None:
        """Begin to read."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread; no callback comes after this. Harmless when called twice."""
        self._stopping.set()
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                item = self._read(WAIT_S)
            except DeviceError as error:
                if not self._stopping.is_set():
                    self._on_lost(error)
                return
            if item and not self._stopping.is_set():
                self._on_item(item)
