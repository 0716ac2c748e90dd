"""The way back to a lost device, on a clock driven by hand and a device that does what the test says."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import DeviceError, DeviceLost
from florence_bt.drivers.connection import Connection

LONG_S = 60.0


class Device:
    """Gives what it is fed; fails when told to."""

    def __init__(self) -> None:
        self.closed = False
        self._items: deque[bytes | DeviceError] = deque()
        self._fed = threading.Condition()

    def feed(self, item: bytes | DeviceError) -> None:
        with self._fed:
            self._items.append(item)
            self._fed.notify_all()

    def read(self, timeout_s: float) -> bytes | None:
        with self._fed:
            self._fed.wait_for(lambda: bool(self._items), timeout_s)
            item = self._items.popleft() if self._items else b""
        if isinstance(item, DeviceError):
            raise item
        return item

    def close(self) -> None:
        self.closed = True


class Owner:
    """Collects what the connection tells; other threads' callbacks wait until :meth:`serve`."""

    def __init__(self, *, direct: bool = False, arrival_time: Callable[[], float] | None = None) -> None:
        self.clock = ManualClock()
        self.waiting: list[Device | DeviceError] = []
        self.opened: list[tuple[float, Device]] = []
        self.attempts: list[float] = []
        self.items: list[tuple[bytes, float]] = []
        self.lost: list[str] = []
        self.problems: list[str] = []
        self.soon: deque[Callable[[], None]] = deque()
        self.called = threading.Condition()
        self.connection: Connection[Device, bytes] = Connection(
            self.clock,
            self._call_soon,
            self._open,
            on_open=lambda device: self.opened.append((self.clock.now(), device)),
            on_item=lambda item, arrived: self.items.append((item, arrived)),
            on_lost=lambda error: self.lost.append(str(error)),
            on_problem=self.problems.append,
            delay_s=0.5,
            name="device",
            on_readers_thread=direct,
            arrival_time=arrival_time,
        )

    def serve(self) -> None:
        """Wait for one callback of the reader's thread and run it."""
        with self.called:
            assert self.called.wait_for(lambda: bool(self.soon), LONG_S)
            callback = self.soon.popleft()
        callback()

    def _open(self) -> Device:
        self.attempts.append(self.clock.now())
        device = self.waiting.pop(0) if self.waiting else DeviceLost("there is none")
        if isinstance(device, DeviceError):
            raise device
        return device

    def _call_soon(self, callback: Callable[[], None]) -> None:
        with self.called:
            self.soon.append(callback)
            self.called.notify_all()


@pytest.fixture
def owner() -> Owner:
    return Owner()


def test_the_owner_may_tell_the_time_of_arrival() -> None:
    owner = Owner(arrival_time=lambda: 7.0)
    device = Device()
    owner.waiting = [device]
    owner.connection.open()
    device.feed(b"abc")
    owner.serve()
    assert owner.items == [(b"abc", 7.0)]


def test_reads_loses_and_opens_again(owner: Owner) -> None:
    first, second = Device(), Device()
    owner.waiting = [first, second]
    owner.connection.open()
    owner.connection.works()
    first.feed(b"abc")
    owner.serve()
    assert owner.items == [(b"abc", 0.0)]
    first.feed(DeviceLost("the plug is out"))
    owner.serve()
    assert (owner.lost, owner.connection.problem, first.closed) == (
        ["the plug is out"],
        "the plug is out",
        True,
    )
    assert owner.connection.device is None
    owner.clock.advance(0.5)
    assert owner.connection.device is second
    assert owner.connection.problem == "the plug is out"  # until it works
    owner.connection.works()
    assert owner.connection.problem == ""
    owner.connection.close()
    assert second.closed


def test_pauses_grow_up_to_ten_times_and_the_log_is_told_once(owner: Owner) -> None:
    owner.connection.open()
    owner.clock.advance(40.0)
    gaps = [after - before for before, after in zip(owner.attempts, owner.attempts[1:], strict=False)]
    assert gaps[:6] == [0.5, 1.0, 2.0, 4.0, 5.0, 5.0]
    assert owner.problems == ["there is none"]
    owner.connection.close()
    attempts = len(owner.attempts)
    owner.clock.advance(40.0)
    assert len(owner.attempts) == attempts


def test_a_device_that_opens_but_never_works_is_tried_less_and_less(owner: Owner) -> None:
    owner.waiting = [Device() for _ in range(5)]
    owner.connection.open()
    for _ in range(4):
        owner.connection.lose(DeviceLost("silent"))
        owner.clock.advance(6.0)
    assert [round(time, 1) for time, _ in owner.opened] == [0.0, 0.5, 7.0, 14.0, 22.0]
    assert owner.problems == ["silent"]
    assert owner.connection.lost == 4
    owner.connection.close()


def test_what_was_heard_before_a_loss_does_not_end_the_problem(owner: Owner) -> None:
    """An owner that answers before it looks at what came may lose the device over the answer."""
    owner.waiting.append(Device())
    owner.connection.open()
    owner.connection.lose(DeviceLost("the plug is out"))
    owner.connection.works()
    assert owner.connection.problem == "the plug is out"
    owner.clock.advance(0.5)
    assert owner.attempts == [0.0, 0.5]
    owner.clock.advance(0.75)
    assert owner.attempts == [0.0, 0.5]  # the pauses go on growing


def test_what_an_old_device_said_late_is_left_out(owner: Owner) -> None:
    first, second = Device(), Device()
    owner.waiting = [first, second]
    owner.connection.open()
    first.feed(b"late")
    with owner.called:
        assert owner.called.wait_for(lambda: bool(owner.soon), LONG_S)
    owner.connection.lose(DeviceLost("gone"))
    owner.clock.advance(0.5)
    owner.serve()
    assert owner.items == []
    owner.connection.close()


def test_items_may_stay_on_the_readers_thread() -> None:
    owner = Owner(direct=True)
    device = Device()
    owner.waiting = [device]
    owner.connection.open()
    device.feed(b"x")
    device.feed(DeviceLost("end"))
    owner.serve()
    assert owner.items == [(b"x", 0.0)]
    assert owner.lost == ["end"]
    owner.connection.close()


def test_losing_nothing_is_harmless(owner: Owner) -> None:
    owner.connection.lose(DeviceLost("nothing there"))
    owner.connection.close()
    owner.connection.close()
    assert owner.lost == []
