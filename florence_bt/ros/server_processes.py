"""Processes of discovered servers: discovery misses one that was killed only after its lease.

The lease is the server's own, 20 s by default in Fast DDS. But an endpoint's id in Fast DDS has the id of the
process (``GuidPrefix_t``: two bytes of vendor, two of the host, two of the process id, little endian), and
``/proc`` says at once whether a process on this machine has ended.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from rclpy.topic_endpoint_info import TopicEndpointInfo

FAST_DDS = b"\x01\x0f"
"""The vendor id of eProsima at the begin of each endpoint's id (DDSI-RTPS 2.5, 9.3.1.5)."""
LIBRARY = b"libfastrtps"
"""A library that the process of an endpoint has loaded: in a container other processes have the same ids."""
PROC = Path("/proc")


@dataclass(frozen=True, slots=True)
class _Process:
    pid: int
    began: bytes
    """Field 22 of proc(5) ``stat``: the id may be given to another process later."""

    def has_ended(self) -> bool:
        return _began(self.pid) != self.began


class DiscoveredServers:
    """The servers of one name, or who else has a topic, without those whose process is known to have ended.

    A process of another user or machine, or with another middleware, counts until discovery misses it.

    Args:
        endpoints: Gives what discovery knows: one endpoint for each server.
    """

    def __init__(self, endpoints: Callable[[], Iterable[TopicEndpointInfo]]) -> None:
        self._endpoints = endpoints
        self._processes: dict[bytes, _Process | None] = {}

    def ids(self) -> set[bytes]:
        """Return the ids of the endpoints of servers that are there."""
        found = self._found()
        return {each for each in found if not self._has_ended(each)}

    def all_ended(self) -> bool:
        """Tell whether discovery knows servers, and the processes of all of them have ended."""
        found = self._found()
        return bool(found) and all(map(self._has_ended, found))

    def _found(self) -> list[bytes]:
        found = [bytes(one.endpoint_gid) for one in self._endpoints()]
        self._processes = {
            each: self._processes[each] if each in self._processes else _process_of(each) for each in found
        }
        return found

    def _has_ended(self, endpoint: bytes) -> bool:
        process = self._processes[endpoint]
        return process is not None and process.has_ended()


def _process_of(endpoint: bytes) -> _Process | None:
    """Find the process of an endpoint; None when it is not certainly one that we may look at."""
    if not endpoint.startswith(FAST_DDS):
        return None
    low = int.from_bytes(endpoint[4:6], "little")
    for pid in range(low, _pid_max(), 1 << 16):
        began = _began(pid)
        if began and _has_loaded(pid, LIBRARY):
            return _Process(pid, began)
    return None


def _pid_max() -> int:
    return int((PROC / "sys/kernel/pid_max").read_text())


def _began(pid: int) -> bytes:
    """Return when a process began, in ticks since the boot; empty when it has ended or is not there."""
    try:
        fields = (PROC / str(pid) / "stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return b""
    return b"" if fields[0] in (b"Z", b"X") else fields[19]


def _has_loaded(pid: int, library: bytes) -> bool:
    try:
        return library in (PROC / str(pid) / "maps").read_bytes()
    except OSError:
        return pid == os.getpid()
