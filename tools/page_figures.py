"""Measures the page: viewers, a tree of 2,000 nodes, a server that dies, 10,000 runs, strangers.

``python -m tools.page_figures --write docs/notes/page.md`` writes the table there between its marks. It
starts the page and, as a process of its own, a robot that says what one says; a quiet machine is wanted.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import re
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

from florence_bt.app.guard.guard import MOST_PAGES, SPAN_S
from tools.tables import command_of, milliseconds, table, write_table

VIEWERS = 10


@dataclass(frozen=True, slots=True)
class Load:
    """The amount that is measured.

    Attributes:
        seconds: Wall seconds of each measurement.
        nodes: Of the large tree.
        runs: In the journal.
        messages: That a hostile viewer says at once.
        pages: That somebody opens.
        strangers: Requests of each kind from other origins.
        drawing: Wall seconds in which a browser draws.
    """

    seconds: float = 15.0
    nodes: int = 2_000
    runs: int = 10_000
    messages: int = 10_000
    pages: int = 500
    strangers: int = 200
    drawing: float = 10.0

    def part(self, part: float) -> Load:
        """Return a part of it, of each at least one."""
        return Load(
            *(
                max(1, round(part * value)) if isinstance(value, int) else part * value
                for value in astuple(self)
            )
        )


_TICKS = os.sysconf("SC_CLK_TCK")


# ---- the robot, a process of its own ---------------------------------------------------------------------


def robot(nodes: int, tree_rate: float, name: str) -> None:
    """Say what a robot says while a mission runs, until killed: laser 10 Hz, transforms 20 Hz, tree."""
    import numpy as np
    from florence_interfaces.msg import RunState, RunTree
    from sensor_msgs.msg import LaserScan

    from florence_bt.core.geometry import Pose2
    from florence_bt.core.sensing import OccupancyGrid
    from florence_bt.ros.arguments import start_ros
    from florence_bt.ros.conversions import grid_to_ros
    from florence_bt.ros.executor import SpinLoop
    from florence_bt.ros.node import FlorenceNode
    from florence_bt.ros.qos import LATCHED, SENSOR
    from florence_bt.ros.tf import TransformBroadcaster

    start_ros()
    node = FlorenceNode("robot")
    cells = np.zeros((200, 240), np.int8)
    grid = grid_to_ros(OccupancyGrid(0.05, Pose2(-1.0, -0.5), cells), "map", 0.0)
    maps = node.create_publisher(type(grid), "map", LATCHED)
    maps.publish(grid)
    states = node.create_publisher(RunState, "florence_bt/run_state", LATCHED)
    states.publish(RunState(run_id=name, mission="patrol", state="ACTIVE"))
    scans = node.create_publisher(LaserScan, "filtered_scan", SENSOR)
    trees = node.create_publisher(RunTree, "florence_bt/run_tree", LATCHED)
    frames = TransformBroadcaster(node)
    tree = RunTree(mission="patrol", nodes=list(_nodes(nodes)))
    steps = 0

    def move() -> None:
        frames.send("map", "base_link", node.timebase.now(), Pose2(1.0 + 0.001 * (steps % 1000), 2.0, 0.5))

    def look() -> None:
        nonlocal steps
        steps += 1
        ranges = [1.0 + 0.001 * (steps % 1000)] * 683
        scan = LaserScan(angle_min=-2.1, angle_increment=0.006, range_min=0.1, range_max=5.0, ranges=ranges)
        scan.header.frame_id = "base_link"
        scan.header.stamp = node.get_clock().now().to_msg()
        scans.publish(scan)

    def tick() -> None:
        leaf = tree.nodes[-1]
        leaf.says = f"step {steps}"
        trees.publish(tree)

    node.create_timer(0.05, move)
    node.create_timer(0.1, look)
    if tree_rate:
        node.create_timer(1.0 / tree_rate, tick)
    tick()
    loop = SpinLoop()
    loop.add(node)
    print("up", flush=True)
    while True:
        loop.spin_once(1.0)


def _nodes(count: int, number: int = 0, depth: int = 0) -> Iterator[Any]:
    """Yield the nodes of a running tree, each with ten below it as long as there are so many."""
    from florence_interfaces.msg import TreeNode

    yield TreeNode(depth=depth, status=TreeNode.RUNNING, title=f"node {number}")
    for child in range(10 * number + 1, min(10 * number + 11, count)):
        yield from _nodes(count, child, depth + 1)


# ---- the page and who looks at it -----------------------------------------------------------------------


class Page:
    """The page of a domain of its own, as a process.

    Args:
        folder: Has the journal.
    """

    def __init__(self, folder: Path) -> None:
        with socket.socket() as server:
            server.bind(("127.0.0.1", 0))
            self.port = server.getsockname()[1]
        words = ["-m", "florence_bt.cli", "page", "--port", str(self.port), "--folder", str(folder)]
        environment = {**os.environ, "XDG_CONFIG_HOME": str(folder)}
        self.process = subprocess.Popen([sys.executable, *words], env=environment)
        while not self._answers():
            time.sleep(0.1)

    def _answers(self) -> bool:
        with socket.socket() as client:
            return client.connect_ex(("127.0.0.1", self.port)) == 0

    def seconds_used(self) -> float:
        """Return the processor time that the process has taken."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / _TICKS

    def memory_mb(self) -> float:
        """Return the memory that it has."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6

    def get(self, path: str, **headers: str) -> tuple[int, float]:
        """Get a page; gives the status and the seconds that it took."""
        begin = time.perf_counter()
        with closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)) as client:
            client.request("GET", path, headers=headers)
            answer = client.getresponse()
            answer.read()
            return answer.status, time.perf_counter() - begin


class Viewer(threading.Thread):
    """Takes frames as a browser does, on a thread."""

    def __init__(self, page: Page) -> None:
        from websockets.sync.client import connect

        super().__init__(daemon=True)
        self.frames = 0
        self.bytes = 0
        self.parts: dict[str, Any] = {}
        self.ended = False
        self._open = ExitStack()
        address, origin = f"ws://127.0.0.1:{page.port}/live", f"http://127.0.0.1:{page.port}"
        self.socket = self._open.enter_context(connect(address, origin=origin))
        self.start()

    def run(self) -> None:
        """Take frames until the end."""
        while not self.ended:
            try:
                text = self.socket.recv(timeout=0.2)
            except TimeoutError:
                continue
            self.frames += 1
            self.bytes += len(text)
            self.parts |= json.loads(text)
            self.socket.send("ok")

    def close(self) -> None:
        """Leave."""
        self.ended = True
        self.join()
        self._open.close()


@contextmanager
def robot_process(nodes: int, tree_rate: float, name: str = "1") -> Iterator[subprocess.Popen[str]]:
    """Have a robot in this domain."""
    words = [sys.executable, "-m", "tools.page_figures", "--robot", str(nodes), str(tree_rate), name]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "up\n"
            yield process
        finally:
            process.kill()


# ---- the measurements -----------------------------------------------------------------------------------


def looked_at(page: Page, viewers: int, seconds: float, *, deaf: bool = False) -> tuple[float, float]:
    """Let viewers look for a while.

    Returns:
        The share of a core that the page takes, and the frames a second that a viewer gets.
    """
    from websockets.sync.client import connect

    with ExitStack() as stack:
        if deaf:
            address = f"ws://127.0.0.1:{page.port}/live"
            stack.enter_context(connect(address, origin=f"http://127.0.0.1:{page.port}", max_queue=1))
        looking = [Viewer(page) for _ in range(viewers)]
        while not all("pose" in each.parts.get("scene", {}) for each in looking):
            time.sleep(0.1)
        time.sleep(1.0)
        before, used, begin = sum(each.frames for each in looking), page.seconds_used(), time.monotonic()
        time.sleep(seconds)
        passed = time.monotonic() - begin
        share = (page.seconds_used() - used) / passed
        frames = sum(each.frames for each in looking) - before
        for each in looking:
            each.close()
    return share, frames / passed / max(viewers, 1)


def in_a_browser(page: Page, seconds: float) -> str:
    """Return how smoothly a browser shows what comes: the pauses between the pictures that it draws."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium")
    if chromium is None:
        return "not measured: apt install chromium"
    with sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        opened = browser.new_page(viewport={"width": 1280, "height": 800})
        opened.goto(f"http://localhost:{page.port}/")
        opened.wait_for_selector("[role=treeitem]")
        pauses = opened.evaluate(_PAUSES, 1000.0 * seconds)
        rows = opened.locator("[role=treeitem]").count()
        browser.close()
    pauses.sort()
    median, late = milliseconds(pauses, 0.5), milliseconds(pauses, 0.99)
    return f"a picture every {median}, 99 of 100 within {late}; {rows} rows of the tree are in the page"


_PAUSES = """longest => new Promise(done => {
  const pauses = [], begin = performance.now(); let last = begin;
  const next = now => {
    pauses.push((now - last) / 1000); last = now;
    if (now - begin < longest) requestAnimationFrame(next); else done(pauses);
  };
  requestAnimationFrame(next);
})"""
"""The seconds between two pictures, for so many milliseconds."""


def after_a_death(page: Page) -> float:
    """Kill the robot's process and start another: seconds from its start until a viewer sees it."""
    with robot_process(30, 1.0):
        viewer = Viewer(page)
        while viewer.parts.get("run", {}).get("run_id") != "1":
            time.sleep(0.05)
    begin = time.monotonic()
    with robot_process(30, 1.0, "2"):
        while viewer.parts["run"]["run_id"] != "2":
            time.sleep(0.01)
        seconds = time.monotonic() - begin
    viewer.close()
    return seconds


def write_journal(folder: Path, runs: int) -> None:
    """Write a journal of so many runs."""
    from florence_bt.runtime.events import EventKind, RunEvent
    from florence_bt.runtime.journal import Journal
    from florence_bt.runtime.run import MissionRequest, MissionRun, RunStatus

    journal = Journal(folder)
    for number in range(runs):
        run = MissionRun(f"T-{number:05d}-patrol", MissionRequest("patrol", {}, "figures"), {})
        run.status, run.started = RunStatus.RUNNING, 0.0
        journal.write(run, RunEvent(0.0, run.run_id, EventKind.STARTED, {}, 1))
        run.status, run.ended = RunStatus.SUCCEEDED, 1.0
        journal.write(run, RunEvent(1.0, run.run_id, EventKind.ENDED, {"status": "SUCCEEDED"}, 1))
    journal.close()


def history(page: Page, path: str) -> str:
    """Return how long a part of the list takes, the median and the longest of ten."""
    times = []
    for _ in range(10):
        status, seconds = page.get(path)
        assert status == 200, status
        times.append(seconds)
    return f"{1000 * statistics.median(times):.0f} ms, at most {1000 * max(times):.0f} ms"


def strangers(page: Page, count: int) -> str:
    """Return what a browser of another origin gets."""
    from websockets.exceptions import WebSocketException
    from websockets.sync.client import connect

    evil = "http://evil.example"
    served = sum(page.get("/", Origin=evil)[0] != 403 for _ in range(count))
    served += sum(page.get("/", Host="evil.example")[0] != 403 for _ in range(count))
    opened = 0
    for _ in range(count):
        try:
            with connect(f"ws://127.0.0.1:{page.port}/live", origin=evil) as client:
                client.recv(timeout=5.0)
            opened += 1
        except WebSocketException:
            pass
    return f"{served + opened} of {3 * count} requests were served"


def flood(page: Page, messages: int) -> str:
    """Return what becomes of a viewer that says many things at once, and of one beside it."""
    from websockets.exceptions import ConnectionClosed

    viewer, hostile = Viewer(page), Viewer(page)
    hostile.ended = True  # it takes nothing any more
    hostile.join()
    ended = "all are taken"
    before, begin = viewer.frames, time.monotonic()
    try:
        for _ in range(messages):
            hostile.socket.send("drive 1 x " + "y" * 10_000)
    except ConnectionClosed:
        ended = "it is left alone"
    return f"{ended}; {beside(viewer, before, begin)}"


def beside(viewer: Viewer, before: int, begin: float) -> str:
    """Return how often a viewer gets a frame, at least 3 s long, and let it leave."""
    time.sleep(max(0.0, begin + 3.0 - time.monotonic()))
    frames = (viewer.frames - before) / (time.monotonic() - begin)
    viewer.close()
    return f"the viewer beside it gets {frames:.1f} frames a second"


@contextmanager
def browser_socket(port: int) -> Iterator[tuple[Any, str]]:
    """Open NiceGUI's own socket as a browser does; gives it, and an event with 10 kB for an element."""
    from websockets.sync.client import connect

    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=60)) as client:
        client.request("GET", "/")
        found = re.search(r"client_id': '([0-9a-f-]{36})'", client.getresponse().read().decode())
    assert found is not None
    query = f"client_id={found[1]}&next_message_id=0&implicit_handshake=true&tab_id=t&document_id=d"
    address = f"ws://127.0.0.1:{port}/_nicegui_ws/socket.io/?EIO=4&transport=websocket&{query}"
    event = {"client_id": found[1], "id": 0, "listener_id": "x", "args": [json.dumps("y" * 10_000)]}
    with connect(address, origin=f"http://127.0.0.1:{port}", max_size=None) as opened:
        opened.send("40")
        while not opened.recv(timeout=60.0).startswith("40"):
            pass
        yield opened, "42" + json.dumps(["event", event])


def flood_of_events(page: Page, messages: int) -> str:
    """Return what becomes of a browser that sends many events on NiceGUI's own socket, and of a viewer."""
    from websockets.exceptions import ConnectionClosed

    viewer, ended = Viewer(page), "all are taken"
    with browser_socket(page.port) as (hostile, event):
        before, begin = viewer.frames, time.monotonic()
        try:
            for _ in range(messages):
                hostile.send(event)
        except ConnectionClosed:
            ended = "it is left alone"
        return f"{ended}; {beside(viewer, before, begin)}"


def flood_of_pages(page: Page, pages: int) -> str:
    """Return what becomes of somebody who opens a page many times, and of a viewer."""
    viewer = Viewer(page)
    before, begin = viewer.frames, time.monotonic()
    served = sum(page.get("/")[0] == 200 for _ in range(pages))
    return f"it gets {served} pages; {beside(viewer, before, begin)}"


def rows(folder: Path, load: Load) -> Iterator[Sequence[str]]:
    """Measure everything, one after the other."""
    write_journal(folder, load.runs)
    page = Page(folder)
    try:
        with robot_process(30, 2.0):
            page_alone = page.seconds_used()
            time.sleep(load.seconds)
            yield "nobody looks", f"{(page.seconds_used() - page_alone) / load.seconds:.1%} of a core"
            for viewers in (1, VIEWERS):
                share, frames = looked_at(page, viewers, load.seconds)
                yield (
                    f"{viewers} viewers, a tree of 30 nodes",
                    f"{share:.1%} of a core, {frames:.1f} frames a second each",
                )
            share, frames = looked_at(page, VIEWERS, load.seconds, deaf=True)
            yield (
                "the same beside one that reads nothing",
                f"{share:.1%} of a core, {frames:.1f} frames a second each",
            )
            yield "memory of the page", f"{page.memory_mb():.0f} MB"
            yield f"a viewer that says {load.messages:,} long things at once", flood(page, load.messages)
            yield (
                f"{load.messages:,} long events at once on NiceGUI's own socket",
                flood_of_events(page, load.messages),
            )
            yield f"somebody who opens a page {load.pages} times", flood_of_pages(page, load.pages)
            if load.pages >= MOST_PAGES:
                time.sleep(SPAN_S)
        for rate in (2.0, 10.0):
            with robot_process(load.nodes, rate):
                share, frames = looked_at(page, VIEWERS, load.seconds)
                what = (
                    f"{VIEWERS} viewers, a tree of {load.nodes:,} nodes that changes {rate:g} times a second"
                )
                yield what, f"{share:.1%} of a core, {frames:.1f} frames a second each"
        with robot_process(load.nodes, 2.0):
            yield f"a browser with a tree of {load.nodes:,} nodes", in_a_browser(page, load.drawing)
        yield (
            "a process in place of the mission server is killed and started: until a viewer sees its run",
            f"{after_a_death(page):.1f} s, with the start of the process",
        )
        yield f"the first part of {load.runs:,} runs", history(page, "/runs")
        yield f"the last part of {load.runs:,} runs", history(page, f"/runs?page={load.runs // 25 - 1}")
        yield "pages of another origin and other names", strangers(page, load.strangers)
    finally:
        page.process.terminate()
        page.process.wait()


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print the table, and write it into a page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", type=float, default=1.0, help="of times, nodes, runs, messages, pages")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="a page with the marks of the table")
    parser.add_argument("--robot", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.robot:
        robot(int(given.robot[0]), float(given.robot[1]), given.robot[2])
        return 0
    measured = []
    with tempfile.TemporaryDirectory() as folder:
        for row in rows(Path(folder), Load().part(given.part)):
            print(": ".join(row), flush=True)
            measured.append(row)
    if given.write is not None:
        text = table(("what", "measured"), measured)
        write_table(given.write, "figures", text, command_of("-m tools.page_figures", arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
