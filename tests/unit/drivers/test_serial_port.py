"""The real serial port on a pseudo-terminal, and its reader thread."""

import errno
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from florence_bt.core.errors import DeviceError, DeviceLost, DeviceTimeout
from florence_bt.drivers.connection import DeviceReader
from florence_bt.drivers.serial_port import SerialPort, _explain_open
from florence_bt.simulation.emulators.pty_port import PseudoTerminal

LONG_S = 60.0
"""A limit for what takes microseconds."""


@pytest.fixture
def device(tmp_path: Path) -> Iterator[PseudoTerminal]:
    terminal = PseudoTerminal(tmp_path / "create")
    yield terminal
    terminal.close()


@pytest.fixture
def port(device: PseudoTerminal) -> Iterator[SerialPort]:
    opened = SerialPort(device.path, 57600)
    yield opened
    opened.close()


ALL_BYTES = bytes(range(256))


def read_exactly(port: SerialPort, count: int) -> bytes:
    data = b""
    while len(data) < count:
        piece = port.read(LONG_S)
        assert piece, "nothing came"
        data += piece
    return data


def test_every_byte_passes_unchanged_both_ways(device: PseudoTerminal, port: SerialPort) -> None:
    device.write(ALL_BYTES)
    assert read_exactly(port, 256) == ALL_BYTES
    port.write(ALL_BYTES)
    received = b""
    while len(received) < 256:
        received += device.read()
    assert received == ALL_BYTES


def test_no_bytes_no_wait(port: SerialPort, device: PseudoTerminal) -> None:
    assert port.read(0.0) == b""
    assert device.read() == b""


def test_unplugged(device: PseudoTerminal, port: SerialPort) -> None:
    path = Path(device.path)
    assert path.is_symlink()
    device.unplug()
    assert not path.is_symlink()
    with pytest.raises(DeviceLost, match="create went away while reading"):
        port.read(LONG_S)
    with pytest.raises(DeviceLost, match="while writing"):
        port.write(b"x")
    with pytest.raises(DeviceLost, match="closed"):
        device.read()
    device.unplug()
    with pytest.raises(DeviceLost, match="no such port"):
        SerialPort(str(path), 57600)


def test_client_closes_and_comes_back(device: PseudoTerminal) -> None:
    first = SerialPort(device.path, 57600)
    first.close()
    first.close()
    device.write(b"nobody reads this")
    with pytest.raises(DeviceLost):
        first.read(0.0)
    second = SerialPort(device.path, 57600)
    device.write(b"hello")
    assert read_exactly(second, 5) == b"hello"  # what came before the opening is gone
    second.close()


def test_only_one_client(device: PseudoTerminal, port: SerialPort) -> None:
    with pytest.raises(DeviceLost, match="another program uses it"):
        SerialPort(device.path, 57600)


def test_the_advice_fits_the_error() -> None:
    # Root may open everything, so the error itself is made here.
    with pytest.raises(DeviceLost, match="not a serial port"):
        SerialPort("/dev/null", 57600)
    assert "group dialout" in _explain_open("/dev/x", PermissionError(errno.EACCES, "no"))
    assert "correct the parameter 'port'" in _explain_open("/dev/x", OSError(errno.EIO, "broken"))


def test_a_folder_is_no_port(tmp_path: Path) -> None:
    with pytest.raises(DeviceLost, match="parameter 'port'; ports found:"):
        SerialPort(str(tmp_path), 57600)


def test_nobody_reads(device: PseudoTerminal, port: SerialPort) -> None:
    for _ in range(100):
        device.write(bytes(1000))
    assert 0 < device.lost_bytes < 100_000
    with pytest.raises(DeviceTimeout, match="took no bytes"):
        for _ in range(100):
            port.write(bytes(1000))


def test_links(tmp_path: Path) -> None:
    link = tmp_path / "port"
    link.symlink_to("/nowhere")
    terminal = PseudoTerminal(link)
    assert os.path.realpath(terminal.path).startswith("/dev/pts/")
    terminal.close()
    assert not link.is_symlink()
    link.write_text("precious")
    with pytest.raises(DeviceLost, match="cannot link"):
        PseudoTerminal(link)
    assert link.read_text() == "precious"


def test_a_newer_line_keeps_its_link(tmp_path: Path) -> None:
    old = PseudoTerminal(tmp_path / "port")
    new = PseudoTerminal(tmp_path / "port")
    old.close()
    assert (tmp_path / "port").is_symlink()
    new.close()


class Mailbox:
    """Collects what a reader hands over, and lets a test wait for it."""

    def __init__(self) -> None:
        self.data = b""
        self.errors: list[DeviceError] = []
        self._changed = threading.Condition()

    def on_data(self, data: bytes) -> None:
        with self._changed:
            self.data += data
            self._changed.notify_all()

    def on_lost(self, error: DeviceError) -> None:
        with self._changed:
            self.errors.append(error)
            self._changed.notify_all()

    def wait(self, condition: Callable[[], bool]) -> None:
        with self._changed:
            assert self._changed.wait_for(condition, LONG_S)


def test_reader(device: PseudoTerminal, port: SerialPort) -> None:
    box = Mailbox()
    reader = DeviceReader(port.read, box.on_data, box.on_lost, port.name)
    reader.start()
    for _ in range(10):
        device.write(ALL_BYTES)
    box.wait(lambda: len(box.data) == 2560)
    assert box.data == 10 * ALL_BYTES
    reader.stop()
    reader.stop()
    device.write(b"too late")
    assert box.data == 10 * ALL_BYTES
    assert box.errors == []


def test_reader_tells_once_that_the_port_is_lost(device: PseudoTerminal, port: SerialPort) -> None:
    box = Mailbox()
    reader = DeviceReader(port.read, box.on_data, box.on_lost, port.name)
    reader.start()
    device.unplug()
    box.wait(lambda: len(box.errors) == 1)
    reader.stop()
    assert isinstance(box.errors[0], DeviceLost)
    assert len(box.errors) == 1


def test_a_reader_that_never_started_stops(port: SerialPort) -> None:
    box = Mailbox()
    DeviceReader(port.read, box.on_data, box.on_lost, port.name).stop()
    assert box.data == b""


def test_a_pseudo_terminal_has_no_modem_lines(port: SerialPort, device: PseudoTerminal) -> None:
    assert port.set_rts(True) is False
    device.write(b"still there")
    assert read_exactly(port, 11) == b"still there"
