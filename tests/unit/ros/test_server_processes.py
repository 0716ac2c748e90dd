"""Which discovered servers are still there, by the process in the id of an endpoint; no ROS graph."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy")

from florence_bt.ros import server_processes
from florence_bt.ros.server_processes import DiscoveredServers


def endpoint(pid: int, vendor: bytes = b"\x01\x0f") -> Any:
    identity = vendor + b"\x12\x34" + (pid & 0xFFFF).to_bytes(2, "little") + bytes(10)
    return SimpleNamespace(endpoint_gid=list(identity))


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch) -> Any:
    # It has not loaded a middleware; every Python has the C library.
    monkeypatch.setattr(server_processes, "LIBRARY", b"libc")
    child = subprocess.Popen(
        [sys.executable, "-c", "print('up', flush=True); input()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert child.stdout and child.stdout.readline() == b"up\n"  # before, it has loaded nothing
    yield child
    child.kill()
    child.communicate()


def test_a_process_that_was_killed_serves_nothing(program: Any) -> None:
    found = [endpoint(program.pid)]
    servers = DiscoveredServers(lambda: found)
    assert len(servers.ids()) == 1 and not servers.all_ended()
    program.kill()
    while servers.ids():
        pass  # a killed process takes a moment; nobody has waited for it, so it stays as a zombie
    assert servers.all_ended()
    found.append(endpoint(1, vendor=b"\x01\x10"))
    assert len(servers.ids()) == 1 and not servers.all_ended(), "another middleware: it is not known"
    found.clear()
    assert not servers.ids() and not servers.all_ended()


def test_only_a_process_with_the_middleware_is_the_one(program: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_processes, "LIBRARY", b"no such library")
    servers = DiscoveredServers(lambda: [endpoint(program.pid)])
    assert servers.ids()
    program.kill()
    program.wait()
    assert servers.ids(), "in a container the id is that of another process"
