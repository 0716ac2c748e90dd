"""Every socket that listens, and every route behind one, is walked over as a stranger who tries to get in."""

from __future__ import annotations

import http.server
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("foxglove")
pytest.importorskip("rclpy")

from florence_bt.app.guard.connections import HEAD_S
from florence_bt.app.recording.foxglove_port import PROTOCOLS
from tests.ros.conftest import GENEROUS_S, Child, own_domain
from tests.ros.stranger import (
    Door,
    doors_of,
    family,
    request,
    said,
    status_of,
    try_crowd,
    try_frames,
    try_route,
    try_slowness,
    try_socket,
)

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.xdist_group("who_gets_in")]

ROUTES = """
import json, sys
from florence_page.access import Access
from florence_page.ros_thread import RosThread
from florence_page.server import make_app

def walk(routes, above=""):
    for route in routes:
        path = above + getattr(route, "path", "")
        below = getattr(route, "routes", None)
        if below:
            yield from walk(below, path)
        elif type(route).__name__.endswith("WebSocketRoute"):
            yield path, ["WEBSOCKET"]
        else:
            yield path, sorted(getattr(route, "methods", None) or ["GET"])

with RosThread() as ros:
    json.dump(list(walk(vars(make_app(ros, Access({})))["_app"].routes)), sys.stdout)
"""
"""Prints the routes of the page's application, with those that NiceGUI adds."""
ENGINE = "/_nicegui_ws/socket.io/"
LOG_BYTES = 100_000
"""What strangers may write into the log in all, in the minutes of these tests."""


def free_port() -> int:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        return int(server.getsockname()[1])


def wait_until_it_answers(port: int) -> None:
    end = time.monotonic() + GENEROUS_S
    while True:
        with socket.socket() as client:
            if client.connect_ex(("127.0.0.1", port)) == 0:
                return
        assert time.monotonic() < end, f"nothing listens at {port}"
        time.sleep(0.05)


@pytest.fixture(scope="module")
def ros_domain() -> Iterator[int]:
    with own_domain() as domain:
        yield domain


@pytest.fixture(scope="module")
def system(ros_domain: int, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Child, Path]]:
    """A whole system that shows itself to the page and to Foxglove, with few files to be opened at once."""
    folder = tmp_path_factory.mktemp("system")
    command = [sys.executable, "-m", "florence_bt.cli", "up", "--sim", "--person", "hall", "--seed", "27"]
    ports = free_port(), free_port()
    command += ["--record", "--page", "--page-port", str(ports[0]), "--foxglove", str(ports[1])]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(folder))
        child = Child([*command, "--out", str(folder / "up")], folder / "up.txt")
    try:
        child.wait_for("ready after")
        for port in ports:
            wait_until_it_answers(port)
        for pid in family(child.process.pid):
            resource.prlimit(pid, resource.RLIMIT_NOFILE, (1024, 1024))
        yield child, folder / "up"
    finally:
        child.end(signal.SIGINT)


@pytest.fixture(scope="module")
def doors(system: tuple[Child, Path]) -> list[Door]:
    found = doors_of(family(system[0].process.pid))
    assert found
    return found


@pytest.fixture(scope="module")
def routes(ros_domain: int) -> list[tuple[str, list[str]]]:
    """The routes of the page: path, with a name in place of each variable, and methods."""
    done = subprocess.run([sys.executable, "-c", ROUTES], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = [(str(path), list(methods)) for path, methods in json.loads(done.stdout)]
    paths = {path for path, _ in found}
    assert {"/", "/edit/", "/edit/complete", "/live", "/edit/live", "/picture/{name}"} <= paths
    assert any(path.startswith("/_nicegui/") for path in paths)
    return [(_plain(path), methods) for path, methods in found]


def _plain(path: str) -> str:
    """Put a name in place of each variable."""
    while "{" in path:
        before, _, rest = path.partition("{")
        path = f"{before}x{rest.partition('}')[2]}"
    return path or "/"


def tcp(doors: list[Door]) -> list[Door]:
    return [each for each in doors if each.kind == "tcp"]


def the_page(doors: list[Door]) -> Door:
    """The door that shows the page."""
    return next(door for door in tcp(doors) if status_of(said(door, request(door, "/", {}))) == 200)


def test_what_listens_in_the_file_system_is_for_its_owner(
    doors: list[Door], system: tuple[Child, Path]
) -> None:
    for door in doors:
        if door.kind == "unix":
            place = Path(door.host)
            assert system[1] in place.parents, "no abstract name, which everybody may use"
            assert not place.parent.stat().st_mode & 0o077, door


def test_no_port_lets_another_site_in(doors: list[Door]) -> None:
    assert len(tcp(doors)) >= 2, "the page and Foxglove"
    wrong = [problem for door in tcp(doors) for problem in try_route(door, "/")]
    wrong += [problem for door in tcp(doors) for problem in try_socket(door, "/", ", ".join(PROTOCOLS))]
    assert not wrong


def test_no_route_of_the_page_lets_another_site_in(
    doors: list[Door], routes: list[tuple[str, list[str]]]
) -> None:
    page = the_page(doors)
    wrong: list[str] = []
    for path, methods in routes:
        for method in methods:
            wrong += try_socket(page, path, "") if method == "WEBSOCKET" else try_route(page, path, method)
    wrong += try_socket(page, f"{ENGINE}?EIO=4&transport=websocket", "")
    assert not wrong


def test_nobody_is_kept_waiting_by_unfinished_requests(doors: list[Door]) -> None:
    for door in tcp(doors):
        assert not list(try_crowd(door, 1_100))


def test_no_port_waits_for_ever(doors: list[Door]) -> None:
    assert not list(try_slowness(tcp(doors), HEAD_S + 5.0))


def test_nothing_that_is_said_fills_the_log(
    doors: list[Door], routes: list[tuple[str, list[str]]], system: tuple[Child, Path]
) -> None:
    child, folder = system
    page = the_page(doors)

    def logs() -> str:
        kept = [file.read_text(errors="replace") for file in sorted(folder.rglob("*.log"))]
        return "\n".join([child.output, *kept])

    before = len(logs())
    sockets = [path for path, methods in routes if methods == ["WEBSOCKET"]]
    assert sum(try_frames(page, path, "") for path in sockets) > 0
    assert try_frames(page, ENGINE, "", "?EIO=4&transport=websocket") > 0
    for door in tcp(doors):
        try_frames(door, "/", ", ".join(PROTOCOLS))
        for number in range(60):
            said(door, b"\x16\x03\x01 no HTTP\r\n\r\n")
            said(door, request(door, f"/_nicegui/{'x' * 5_000}/{number}", {}))
            said(door, request(door, f"/%0d%0aX:{number}?token=x", {}))
            said(door, request(door, "//evil.example/?token=x", {}))
    text = logs()
    assert len(text) - before < LOG_BYTES
    assert "Traceback" not in text


class Unguarded(http.server.BaseHTTPRequestHandler):
    """A server as one writes it who thinks of no stranger."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()

    def log_message(self, *arguments: Any) -> None:
        """Say nothing."""


def test_a_port_that_nobody_guards_is_found() -> None:
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Unguarded) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        port = server.server_address[1]
        (door,) = (each for each in doors_of([os.getpid()]) if each.port == port)
        assert len(list(try_route(door, "/"))) > 20
        assert list(try_slowness([door], 1.0))
        server.shutdown()
