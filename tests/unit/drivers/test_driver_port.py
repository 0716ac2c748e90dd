"""A driver on its port, on a clock driven by hand and a port that does what the test says."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import DeviceError, DeviceLost, DeviceTimeout
from florence_bt.drivers.driver_port import DriverPort

LONG_S = 60.0


class Port:
    """Gives what it is fed, and keeps what is written."""

    name = "/dev/ttyTEST"

    def __init__(self) -> None:
        self.written: list[bytes] = []
        self.broken = False
        self.closed = False
        self._fed: deque[bytes] = deque()
        self._news = threading.Condition()

    def feed(self, data: bytes) -> None:
        with self._news:
            self._fed.append(data)
            self._news.notify_all()

    def read(self, timeout_s: float) -> bytes:
        with self._news:
            self._news.wait_for(lambda: bool(self._fed), timeout_s)
            return self._fed.popleft() if self._fed else b""

    def write(self, data: bytes) -> None:
        if self.broken:
            raise DeviceLost("the plug is out")
        self.written.append(data)

    def set_rts(self, level: bool) -> bool:
        return False

    def close(self) -> None:
        self.closed = True


class Driver:
    """Says what it is told to, and has a deadline every second after a start."""

    def __init__(self) -> None:
        self.to_say: list[bytes] = []
        self.heard = b""
        self.polls: list[float] = []
        self.deadline: float | None = None

    def start(self, now: float) -> None:
        self.to_say.append(b"hello")
        self.deadline = now

    def poll(self, now: float) -> bytes:
        self.polls.append(now)
        if self.deadline is not None:
            self.deadline = now + 1.0
        return self.to_say.pop(0) if self.to_say else b""

    def next_deadline(self) -> float | None:
        return self.deadline

    def shutdown(self) -> bytes:
        self.deadline = None
        return b"goodbye"


class Owner:
    """What a node does with it; callbacks of the reader's thread wait until :meth:`serve`."""

    def __init__(self) -> None:
        self.clock = ManualClock()
        self.driver = Driver()
        self.ports: list[Port] = []
        self.lost: list[tuple[str, bool]] = []
        self.problems: list[str] = []
        self.arrivals: list[float] = []
        self.refusal: DeviceError | None = None
        self._soon: deque[Callable[[], None]] = deque()
        self._called = threading.Condition()
        self.port = DriverPort(
            self.driver,
            self.clock,
            self._call_soon,
            self._open,
            on_open=lambda _port: self.driver.start(self.clock.now()),
            on_bytes=self._on_bytes,
            on_lost=lambda error: self.lost.append((str(error), self.port.device is not None)),
            on_problem=self.problems.append,
            send=self._send,
            delay_s=0.5,
            name="test",
        )

    def wait_for_bytes(self) -> None:
        """Until the reader's thread has handed something over; it is not served yet."""
        with self._called:
            assert self._called.wait_for(lambda: bool(self._soon), LONG_S)

    def serve(self) -> None:
        self.wait_for_bytes()
        self._soon.popleft()()

    def _open(self) -> Port:
        self.ports.append(Port())
        return self.ports[-1]

    def _on_bytes(self, data: bytes, arrived: float) -> None:
        self.driver.heard += data
        self.arrivals.append(arrived)
        self.port.pump()

    def _send(self, port: object, data: bytes) -> None:
        if data:
            port.write(data)  # type: ignore[attr-defined]
        if self.refusal is not None:
            raise self.refusal

    def _call_soon(self, callback: Callable[[], None]) -> None:
        with self._called:
            self._soon.append(callback)
            self._called.notify_all()


@pytest.fixture
def owner() -> Iterator[Owner]:
    owner = Owner()
    owner.port.open()
    yield owner
    owner.port.close()


def test_a_port_that_opens_starts_the_driver_and_lets_it_speak(owner: Owner) -> None:
    assert owner.ports[0].written == [b"hello"]
    assert owner.port.device is owner.ports[0]


def test_the_driver_is_asked_again_at_each_deadline(owner: Owner) -> None:
    owner.clock.advance(3.5)
    assert owner.driver.polls == [0.0, 1.0, 2.0, 3.0]
    owner.driver.deadline = None
    owner.port.pump()
    owner.clock.advance(10.0)
    assert owner.driver.polls[4:] == [3.5]


def test_what_is_pumped_in_between_moves_the_deadline(owner: Owner) -> None:
    owner.clock.advance(0.7)
    owner.port.pump()
    owner.clock.advance(0.5)
    assert owner.driver.polls == [0.0, 0.7]
    owner.clock.advance(0.5)
    assert owner.driver.polls == [0.0, 0.7, 1.7]


def test_an_answer_goes_out_when_bytes_came(owner: Owner) -> None:
    owner.clock.advance(0.25)
    owner.driver.to_say.append(b"answer")
    owner.ports[0].feed(b"question")
    owner.serve()
    assert (owner.driver.heard, owner.arrivals) == (b"question", [0.25])
    assert owner.ports[0].written == [b"hello", b"answer"]


def test_a_deadline_sees_first_what_has_come(owner: Owner) -> None:
    """An owner that is late must not think a device silent whose answer lies before it."""
    owner.ports[0].feed(b"in time")
    owner.wait_for_bytes()
    owner.clock.advance(1.0)
    assert owner.driver.heard == b"in time"


def test_a_port_that_cannot_be_written_is_opened_again(owner: Owner) -> None:
    owner.ports[0].broken = True
    owner.driver.to_say.append(b"anybody?")
    owner.port.pump()
    assert owner.lost == [("the plug is out", True)]
    assert owner.problems == [owner.port.problem] == ["the plug is out"]
    assert (owner.port.device, owner.ports[0].closed) == (None, True)
    polls = len(owner.driver.polls)
    owner.clock.advance(0.49)
    owner.port.pump()  # nobody to send to
    assert len(owner.driver.polls) == polls
    owner.clock.advance(0.02)
    assert owner.ports[1].written == [b"hello"]
    owner.port.works()
    assert owner.port.problem == ""


def test_whoever_sends_may_give_the_port_up(owner: Owner) -> None:
    owner.refusal = DeviceTimeout("nothing answers")
    owner.clock.advance(1.0)
    assert owner.lost == [("nothing answers", True)]
    owner.refusal = None
    owner.clock.advance(0.5)
    assert len(owner.ports) == 2
    polls = len(owner.driver.polls)
    owner.clock.advance(1.0)
    assert len(owner.driver.polls) == polls + 1  # the deadline of the lost port is forgotten


def test_the_last_words_are_said_and_nothing_after_them(owner: Owner) -> None:
    assert owner.port.close() == ""
    assert owner.ports[0].written == [b"hello", b"goodbye"]
    assert owner.ports[0].closed
    polls = len(owner.driver.polls)
    owner.clock.advance(10.0)
    assert (len(owner.driver.polls), len(owner.ports)) == (polls, 1)


def test_last_words_that_nobody_hears_are_told(owner: Owner) -> None:
    owner.ports[0].broken = True
    assert owner.port.close() == "the plug is out"
    assert owner.ports[0].closed
    assert owner.port.close() == ""  # there is no port any more
