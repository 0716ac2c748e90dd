"""A stranger: finds what listens, and tries to get in as a web site and as a rude program do.

Nothing of ours is asked which ports there are: the sockets of the processes tell (``/proc``,
proc_pid_fdinfo(5)).
"""

from __future__ import annotations

import base64
import os
import resource
import socket
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

_LISTENS, _ACCEPTS = "0A", 0x10000
"""State of a TCP socket, flag of a Unix socket (``__SO_ACCEPTCON``)."""
FRAMING = ("frame-ancestors 'none'", "x-frame-options: deny", "x-content-type-options: nosniff")
PATIENCE_S = 60.0
EVIL = {
    "another origin": {"Origin": "http://evil.example"},
    "an origin that begins like ours": {"Origin": "http://localhost.evil.example"},
    "another port of this machine": {"Origin": "http://localhost:1"},
    "no origin that one could name": {"Origin": "null"},
    "another host": {"Host": "evil.example"},
    "another host with a dot": {"Host": "evil.example."},
    "a host in capitals": {"Host": "EVIL.EXAMPLE"},
    "another host, and its origin": {"Host": "evil.example", "Origin": "http://evil.example"},
    "a picture of another site": {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"},
    "a page of another port": {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "cors"},
    "a frame of another site": {
        "Sec-Fetch-Site": "cross-site",
        "Sec-Fetch-Mode": "navigate",
        "Sec-Fetch-Dest": "iframe",
    },
}
"""What a browser says on behalf of another site, or of a name that leads here by a trick."""
FRAMES = {
    "a text that is no JSON": b"\x81\x87garbage",
    "bytes": b"\x82\x83\x00\x01\x02",
    "an opcode that there is not": b"\x83\x80",
    "a text that is no UTF-8": b"\x81\x82\xff\xfe",
    "the end of a message that has not begun": b"\x80\x80",
    "more than there can be": b"\x81\xff" + (2**62).to_bytes(8, "big"),
    "an event that is none": b'\x81\x8c42["event",1]'[:14],
    "an attachment that never comes": b'\x81\x8a451-["x",0',
}
"""Frames of a WebSocket, the mask left out; each on a connection of its own."""


@dataclass(frozen=True, slots=True)
class Door:
    """Something that listens.

    Attributes:
        pid: The process.
        kind: ``tcp`` or ``unix``.
        host: The address, or the path.
        port: The TCP port.
    """

    pid: int
    kind: str
    host: str
    port: int = 0


def family(pid: int) -> list[int]:
    """Return a process and all below it."""
    parents: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue  # it has ended meanwhile
            parents.setdefault(int(fields[1]), []).append(int(entry.name))
    found = [pid]
    for each in found:
        found += parents.get(each, ())
    return found


def doors_of(pids: Sequence[int]) -> list[Door]:
    """Return what listens in some processes: streams, over TCP and in the file system.

    UDP is left out: it is that of DDS, on the loopback alone (test_reach.py); browsers cannot speak it.
    """
    owners = {inode: pid for pid in pids for inode in _sockets_of(pid)}
    found = []
    for table, length in (("tcp", 8), ("tcp6", 32)):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == _LISTENS and fields[9] in owners:
                address, _, port = fields[1].partition(":")
                host = "127.0.0.1" if length == 8 else "::1"
                assert int(address, 16) == (0x0100007F if length == 8 else 0x01000000), address
                found.append(Door(owners[fields[9]], "tcp", host, int(port, 16)))
    for line in Path("/proc/net/unix").read_text().splitlines()[1:]:
        fields = line.split(maxsplit=7)
        if int(fields[3], 16) & _ACCEPTS and fields[6] in owners:
            found.append(Door(owners[fields[6]], "unix", fields[7] if len(fields) > 7 else ""))
    return found


def _sockets_of(pid: int) -> Iterator[str]:
    for file in Path(f"/proc/{pid}/fd").iterdir():
        try:
            target = os.readlink(file)
        except OSError:
            continue  # it is closed meanwhile
        if target.startswith("socket:["):
            yield target[8:-1]


# ---- one request ----------------------------------------------------------------------------------------


def said(door: Door, data: bytes, wait_s: float = PATIENCE_S) -> bytes:
    """Send bytes; give what comes until the end, or until nothing has come for so long."""
    with closing(socket.create_connection((door.host, door.port), timeout=wait_s)) as peer:
        peer.sendall(data)
        answer = b""
        try:
            while len(answer) < 100_000 and (more := peer.recv(65_536)):
                answer += more
        except (TimeoutError, ConnectionError):
            pass
        return answer


def request(door: Door, path: str, headers: dict[str, str], method: str = "GET") -> bytes:
    """Return a request as a browser writes it."""
    lines = {"Host": f"localhost:{door.port}", "Connection": "close", **headers}
    return "".join(
        [f"{method} {path} HTTP/1.1\r\n", *(f"{name}: {value}\r\n" for name, value in lines.items()), "\r\n"]
    ).encode("latin-1")


def handshake(door: Door, path: str, headers: dict[str, str], protocols: str) -> bytes:
    """Return a request for a WebSocket."""
    upgrade = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": base64.b64encode(bytes(16)).decode(),
    }
    chosen = {"Sec-WebSocket-Protocol": protocols} if protocols else {}
    return request(door, path, {**upgrade, **chosen, **headers})


def status_of(answer: bytes) -> int:
    """Return the status of an answer; 0 when it is none."""
    words = answer.split(b" ", 2)
    return int(words[1]) if words[0].startswith(b"HTTP/1.") and len(words) > 1 else 0


# ---- what is tried --------------------------------------------------------------------------------------


def try_route(door: Door, path: str, method: str = "GET") -> Iterator[str]:
    """Try to get a route as another site; yield where that went well."""
    for what, headers in EVIL.items():
        answer = said(door, request(door, path, headers, method))
        status = status_of(answer)
        if not 400 <= status < 500:
            yield f"{what} gets {status} of {method} {path} at port {door.port}"
        head = answer.partition(b"\r\n\r\n")[0].decode("latin-1").lower()
        for each in FRAMING:
            if each not in head:
                yield f"{method} {path} at port {door.port} answers without {each} ({what})"


def try_socket(door: Door, path: str, protocols: str) -> Iterator[str]:
    """Try to open a WebSocket as another site; yield where that went well."""
    for what, headers in EVIL.items():
        status = status_of(said(door, handshake(door, path, headers, protocols)))
        if not 400 <= status < 500:
            yield f"{what} gets {status} for a WebSocket of {path} at port {door.port}"


def try_frames(door: Door, path: str, protocols: str, query: str = "") -> int:
    """Say what nobody can mean on a WebSocket that is open; gives how many were let in to say it."""
    let_in = 0
    for frame in FRAMES.values():
        masked = frame[:2] + (frame[2:10] if frame[1] == 0xFF else b"")
        data = frame[len(masked) :]
        opening = handshake(door, path + query, {"Origin": f"http://localhost:{door.port}"}, protocols)
        with closing(socket.create_connection((door.host, door.port), timeout=PATIENCE_S)) as peer:
            peer.sendall(opening)
            let_in += status_of(peer.recv(65_536)) == 101
            peer.sendall(masked + bytes(4) + data)
            peer.settimeout(0.2)
            try:
                while peer.recv(65_536):
                    pass
            except (TimeoutError, ConnectionError):
                pass
    return let_in


def try_crowd(door: Door, count: int) -> Iterator[str]:
    """Begin many requests and finish none; yield what a viewer who comes then does not get."""
    own = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(own[1], 4 * count), own[1]))
    try:
        with ExitStack() as crowd:
            for _ in range(count):
                peer = crowd.enter_context(
                    closing(socket.create_connection((door.host, door.port), timeout=PATIENCE_S))
                )
                peer.sendall(b"GET / HTTP/1.1\r\nHost: local")
            for _ in range(3):
                status = status_of(said(door, request(door, "/", {})))
                if status not in (200, 426):
                    yield f"with {count} unfinished requests at port {door.port} a viewer gets {status}"
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, own)


def try_slowness(doors: Sequence[Door], most_s: float) -> Iterator[str]:
    """Begin a request at each door and go on a byte at a time; yield where that may go on for longer."""
    beginnings = {
        "head": b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ",
        "second head": b"GET /none HTTP/1.1\r\nHost: localhost\r\n\r\nGET / HTTP/1.1\r\nX: ",
        "first byte": b"",
    }
    with ExitStack() as opened:
        peers = {}
        for door in doors:
            for what, data in beginnings.items():
                peer = opened.enter_context(
                    closing(socket.create_connection((door.host, door.port), timeout=PATIENCE_S))
                )
                peer.sendall(data)
                peer.settimeout(0.01)
                peers[door, what] = peer
        end = time.monotonic() + most_s
        while peers and time.monotonic() < end:
            time.sleep(0.2)
            for key, peer in list(peers.items()):
                try:
                    if key[1] != "first byte":
                        peer.sendall(b"x")
                    if not peer.recv(65_536):
                        del peers[key]
                except TimeoutError:
                    pass
                except ConnectionError:
                    del peers[key]
        for door, what in peers:
            yield f"port {door.port} waits for longer than {most_s} s for a {what}"
