"""A TCP connection in the form of a serial port, on this machine."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest

from florence_bt.core.errors import DeviceLost, DeviceTimeout
from florence_bt.drivers.tcp_port import MOST_BYTES_WAITING, TcpPort


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(60.0)
        yield server


def opened(server: socket.socket) -> TcpPort:
    return TcpPort("127.0.0.1", server.getsockname()[1])


def test_what_is_written_before_the_connection_goes_out_with_it(server: socket.socket) -> None:
    port = opened(server)
    port.write(b"QT\n")
    assert port.read(60.0) == b""
    peer, _ = server.accept()
    with peer:
        peer.settimeout(60.0)
        assert peer.recv(100) == b"QT\n"
        port.write(b"VV\n")
        assert peer.recv(100) == b"VV\n"
        assert port.read(0.0) == b""
        peer.sendall(b"VV\n00P\n")
        assert port.read(60.0) == b"VV\n00P\n"
    with pytest.raises(DeviceLost, match="hung up"):
        port.read(60.0)
    port.close()


def test_a_port_that_is_closed(server: socket.socket) -> None:
    port = opened(server)
    port.close()
    port.close()
    with pytest.raises(DeviceLost):
        port.read(0.1)
    with pytest.raises(DeviceLost):
        port.write(b"x")
    assert port.set_rts(True) is False


def test_nobody_listens() -> None:
    with socket.socket() as taken:  # nobody else can get its number, and it does not listen
        taken.bind(("127.0.0.1", 0))
        number = taken.getsockname()[1]
        port = TcpPort("127.0.0.1", number)
        with pytest.raises(DeviceLost, match=rf"cannot reach 127.0.0.1:{number}: .*refused.*check"):
            for _ in range(100):
                port.read(1.0)
        port.close()


def test_a_name_that_nobody_knows(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*_args: object, **_how: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)  # a network may take long, or answer any name
    port = TcpPort("laser.invalid", 10940)
    with pytest.raises(DeviceLost, match=r"cannot reach laser\.invalid:10940"):
        port.read(0.1)
    port.close()


def test_a_name_with_both_kinds_of_addresses(server: socket.socket, monkeypatch: pytest.MonkeyPatch) -> None:
    number = server.getsockname()[1]
    found = [
        (socket.AF_INET6, socket.SOCK_STREAM, 6, "", ("::1", number, 0, 0)),
        (socket.AF_INET, socket.SOCK_STREAM, 6, "", ("127.0.0.1", number)),
    ]
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_args, **_how: found)
    port = TcpPort("laser", number)
    port.write(b"QT\n")
    assert port.read(60.0) == b""
    peer, _ = server.accept()
    with peer:
        peer.settimeout(60.0)
        assert peer.recv(100) == b"QT\n"
    port.close()


def test_writing_without_an_end_is_noticed(server: socket.socket) -> None:
    port = opened(server)
    with pytest.raises(DeviceTimeout):
        for _ in range(3):
            port.write(b"x" * (MOST_BYTES_WAITING // 2 + 1))
    port.close()
