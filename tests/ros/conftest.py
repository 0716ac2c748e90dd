"""What tests over real ROS share: a domain of their own, a spinning helper, and child processes that end.

``ros`` gives a test an initialised ROS in a domain that nobody else on this machine uses::

    @pytest.mark.ros
    def test_talk(ros):
        node = ros.add(FlorenceNode("talker"))
        ros.spin_until(lambda: node.count_subscribers("chat") == 1)
"""

from __future__ import annotations

import fcntl
import gc
import itertools
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import pytest

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.ros.environment import reach_of

N = TypeVar("N")

DOMAINS = range(1, 101)
"""Higher ones use ports that Linux gives to others."""
FIRST_PORT, PORTS_OF_DOMAIN = 7400, 250
"""Of RTPS (DDSI-RTPS 2.5, 9.6.2.3)."""
_tests = itertools.count()

GENEROUS_S = 300.0
"""How long to wait for what takes milliseconds, on a machine that may be busy."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the whole systems: they mostly wait, and what is short fills the cores beside them."""
    here = Path(__file__).parent
    items.sort(key=lambda item: here not in item.path.parents or not item.get_closest_marker("slow"))


def domains_of_processes() -> set[int]:
    """The domains that processes were started with: what tests that were killed have left, and other work."""
    found = set()
    for entry in Path("/proc").iterdir():
        try:
            variables = (entry / "environ").read_bytes().split(b"\0") if entry.name.isdigit() else []
        except OSError:
            continue  # it has ended meanwhile, or is somebody else's
        found |= {
            int(value)
            for name, _, value in (variable.partition(b"=") for variable in variables)
            if name == b"ROS_DOMAIN_ID" and value.isdigit()
        }
    return found


def domains_of_ports() -> set[int]:
    """The domains in which somebody listens, such as nodes of an earlier test that are not collected yet."""
    lines = Path("/proc/net/udp").read_text().splitlines()[1:]
    ports = (int(line.split()[1].rpartition(":")[2], 16) for line in lines)
    return {(port - FIRST_PORT) // PORTS_OF_DOMAIN for port in ports if port >= FIRST_PORT}


@contextmanager
def own_domain() -> Iterator[int]:
    """Have a ROS domain that no other test has at the moment, in this or any other process."""
    folder = Path(tempfile.gettempdir()) / "florence-ros-domains"
    folder.mkdir(exist_ok=True)
    # Another one for each test: what an earlier test left in discovery is of no concern.
    first = (os.getpid() + 7 * next(_tests)) % len(DOMAINS)
    taken = domains_of_processes() | domains_of_ports()
    for domain in [*DOMAINS[first:], *DOMAINS[:first]]:
        if domain in taken:
            continue
        with (folder / str(domain)).open("w") as file, pytest.MonkeyPatch.context() as patch:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            patch.setenv("ROS_DOMAIN_ID", str(domain))
            for name, value in reach_of({}).variables.items():
                patch.delenv(name, raising=False) if value is None else patch.setenv(name, value)
            yield domain
            return
    pytest.fail("every ROS domain is taken")


@pytest.fixture
def ros_domain() -> Iterator[int]:
    """A ROS domain of the test's own."""
    with own_domain() as domain:
        yield domain


class RosBench:
    """Nodes of a test and the loop that serves them."""

    def __init__(self) -> None:
        from florence_bt.ros.executor import SpinLoop

        self.loop = SpinLoop()
        self._nodes: list[Any] = []

    def add(self, node: N) -> N:
        """Serve a node from now on; it is closed at the end of the test."""
        self._nodes.append(node)
        self.loop.add(node)  # type: ignore[arg-type]
        return node

    def close_node(self, node: Any) -> None:
        """Close and destroy a node now."""
        self._nodes.remove(node)
        node.shut_down()
        self.loop.drain()
        self.loop.remove(node)
        node.destroy_node()

    def spin_until(
        self, condition: Callable[[], Any], timeout_s: float = GENEROUS_S, what: str = "the condition"
    ) -> Any:
        """Serve the nodes until a condition holds, and give its value; fail after the time-out."""
        end = time.monotonic() + timeout_s
        while True:
            value = condition()
            if value:
                return value
            assert time.monotonic() < end, f"waited {timeout_s} s for {what}"
            self.loop.spin_once(0.01)

    def spin_for(self, seconds: float) -> None:
        """Serve the nodes for a while: only to show that something does not happen."""
        end = time.monotonic() + seconds
        while (rest := end - time.monotonic()) > 0.0:
            self.loop.spin_once(min(rest, 0.05))

    def close(self) -> None:
        """Close every node."""
        for node in reversed(tuple(self._nodes)):
            self.close_node(node)
        self.loop.close()


@pytest.fixture
def ros(ros_domain: int) -> Iterator[RosBench]:
    """An initialised ROS in a domain of its own."""
    rclpy = pytest.importorskip("rclpy")
    from rclpy.signals import SignalHandlerOptions

    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    bench = RosBench()
    try:
        yield bench
        bench.close()
    finally:
        rclpy.try_shutdown()
        # Nodes refer to themselves by their callbacks, and listen until they are collected.
        gc.collect()


class Child:
    """A child process and what it prints (standard output and error together)."""

    def __init__(self, command: Sequence[str | Path], output: Path) -> None:
        self._output = output
        with output.open("w") as file:
            self.process = subprocess.Popen(
                [str(word) for word in command],
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )

    @property
    def output(self) -> str:
        """Everything printed so far."""
        return self._output.read_text()

    def wait_for(self, text: str, timeout_s: float = GENEROUS_S, *, begin: int = 0) -> str:
        """Wait until a text was printed, after so many characters; give the whole output."""
        end = time.monotonic() + timeout_s
        while text not in self.output[begin:]:
            assert self.process.poll() is None, f"ended with {self.process.returncode}:\n{self.output}"
            assert time.monotonic() < end, f"did not print {text!r} within {timeout_s} s:\n{self.output}"
            time.sleep(0.01)
        return self.output

    def end(self, number: signal.Signals = signal.SIGINT, timeout_s: float = GENEROUS_S) -> int:
        """Send a signal and wait for the exit code; kill what does not end, and fail."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            pytest.fail(f"did not end within {timeout_s} s of {number.name}:\n{self.output}")


PATROL = """\
mission: patrol
description: Drives to and fro until somebody ends it.
on_restart: restart
tree:
  repeat: 1000
  do:
    sequence:
      - run: goto_room
        with: {room: kitchen}
      - run: goto_room
        with: {room: bedroom}
"""


@pytest.fixture
def patrol(tmp_path: Path) -> Path:
    """A folder with a mission that drives and never ends by itself, however long a test is held up."""
    folder = tmp_path / "patrol"
    folder.mkdir()
    (folder / "patrol.yaml").write_text(PATROL)
    return folder


@pytest.fixture
def start_process(ros_domain: int, tmp_path: Path) -> Iterator[Callable[..., Child]]:
    """Start a child process in the test's ROS domain: ``start_process("script.py", "argument")``.

    A first word that ends in ``.py`` (or is ``-m`` or ``-c``) is run by this Python. Ended with the test.
    """
    children: list[Child] = []

    def start(*command: str | Path) -> Child:
        words = [str(word) for word in command]
        if words[0].endswith(".py") or words[0] in ("-m", "-c"):
            words.insert(0, sys.executable)
        children.append(Child(words, tmp_path / f"child{len(children)}.txt"))
        return children[-1]

    yield start
    for child in children:
        if child.process.poll() is None:
            child.process.kill()
            child.process.wait()


BROWSER_MOMENT_MS = 60_000


@pytest.fixture
def open_page(
    ros: RosBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start_process: Callable[..., Child]
) -> Iterator[Callable[..., Any]]:
    """Open the robot's page in chromium: ``open_page("look")`` as somebody with a token of that role.

    Further words are those of ``florence page``.
    """
    from playwright.sync_api import sync_playwright

    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        port: int = server.getsockname()[1]
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    with sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])

        def open_as(role: str = "", *words: str | Path) -> Any:
            from florence_page.access import make_token, tokens_file

            asked = f"?token={make_token(role, tokens_file())}" if role else ""
            page = start_process("-m", "florence_bt.cli", "page", "--port", str(port), *words)
            page.wait_for("Ctrl-C ends it")
            opened = chromium.new_page()
            opened.set_default_timeout(BROWSER_MOMENT_MS)
            opened.goto(f"http://localhost:{port}/{asked}")
            opened.get_by_role("tree").wait_for()
            return opened

        yield open_as
        chromium.close()


DRIVE = SkillDeclaration(
    "drive",
    "Drive some way",
    inputs={"way": Port(Kind.LENGTH, "how far", default=1.0)},
    failures={"blocked": "something is in the way"},
    resources=frozenset({"base"}),
)
MISSIONS = {
    "drive_once": "description: Drives once.\ninputs:\n  way: {type: length, default: 1 m, max: 5 m}\n"
    "tree:\n  sequence:\n    - drive: {way: $way}\n",
    "drive_far": "description: Drives far.\ninputs:\n  way: {type: length, description: how far}\n"
    "tree:\n  drive: {way: $way}\n",
    "be_quick": "description: Waits a moment.\ntree:\n  wait: 1 ms\n",
    "wrong": "description: Has an error.\ntree:\n  sequence:\n    - driv: {way: 1 m}\n",
}


class FakeSafety:
    """Making safe is done at once."""

    def __init__(self):
        self.made_safe = 0

    def make_safe(self):
        from florence_bt.core.outcome import success
        from florence_bt.core.skill import FinishedRun

        self.made_safe += 1
        return FinishedRun(success())


class MissionBench:
    """A mission server with a client's node beside it."""

    parameters: ClassVar[dict] = {}

    def __init__(self, ros, folder, script):
        from florence_bt.ros.node import FlorenceNode
        from florence_bt.runtime.node import MissionNode

        self.ros = ros
        self.runs = folder / "runs"
        missions = folder / "missions"
        missions.mkdir()
        for name, text in MISSIONS.items():
            (missions / f"{name}.yaml").write_text(f"mission: {name}\n{text}")
        (missions / "not-a-ros-name.yaml").write_text("mission: not-a-ros-name\ntree:\n  wait: 1 s\n")
        (missions / "torn.yaml").write_text("mission: [")
        self.missions = missions
        self.recorded = []
        self.safety = FakeSafety()

        from tests.scripted_skill import ScriptedSkill

        def make_skills(node):
            self.drive = ScriptedSkill(DRIVE, node.timebase, script)
            return {"drive": self.drive}

        self.server = ros.add(
            MissionNode(
                make_skills,
                {"drive": DRIVE},
                make_safety=lambda node, goals: self.safety,
                on_recorded=self.recorded.append,
                parameters={
                    "runs_folder": str(self.runs),
                    "mission_folders": (str(missions),),
                    **self.parameters,
                },
            )
        )
        self.node = ros.add(FlorenceNode("client"))
        self._clients = {}

    def end_drive(self, result):
        """End the drive that goes on, as soon as it has begun."""
        self.ros.spin_until(lambda: self.drive.runs and self.drive.runs[-1].active, what="the drive")
        self.drive.runs[-1]._finish(result)

    def call(self, service_type, name, **fields):
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self.node.create_client(service_type, f"florence_bt/{name}")
        self.ros.spin_until(client.service_is_ready, what=name)
        future = client.call_async(service_type.Request(**fields))
        self.ros.spin_until(future.done, what=f"the answer of {name}")
        return future.result()

    def run(self, mission, *, policy="", priority=0, **inputs):
        from florence_interfaces.srv import RunMission

        return self.call(
            RunMission,
            "run_mission",
            mission=mission,
            input_names=list(inputs),
            input_values=list(inputs.values()),
            caller="test",
            policy=policy,
            priority=priority,
        )

    def trigger(self, mission):
        from std_srvs.srv import Trigger

        return self.call(Trigger, f"missions/{mission}")

    def status(self, run_id=""):
        from florence_interfaces.srv import MissionStatus

        return self.call(MissionStatus, "status", run_id=run_id)

    def pause(self, run_id="", reason="a test"):
        from florence_interfaces.srv import PauseMission

        return self.call(PauseMission, "pause", run_id=run_id, reason=reason)

    def resume(self, run_id=""):
        from florence_interfaces.srv import ResumeMission

        return self.call(ResumeMission, "resume", run_id=run_id)

    def breakpoints(self, add=(), remove=(), clear=False):
        from florence_interfaces.srv import SetBreakpoints

        return self.call(SetBreakpoints, "breakpoints", add=list(add), remove=list(remove), clear=clear)

    def run_with_breakpoint(self, mission, node):
        """Start a mission that is to be paused before a node."""
        answer = self.breakpoints(add=[node])
        assert answer.success and list(answer.breakpoints) == [node]
        return self.run(mission)

    def call_step(self):
        from florence_interfaces.srv import ResumeMission

        return self.call(ResumeMission, "step")

    def override(self, on):
        """Say what the base's driver would say."""
        from tests.ros.override_driver import OverrideDriver

        if not hasattr(self, "driver"):
            self.driver = self.ros.add(OverrideDriver())
        self.driver.override.stop() if on else self.driver.override.release()

    def stop(self, run_id=""):
        from florence_interfaces.srv import StopMission

        return self.call(StopMission, "stop", run_id=run_id, reason="a test wants it")

    def wait(self, state, run_id=""):
        self.ros.spin_until(lambda: self.status(run_id).state == state, what=state)
        return self.status(run_id)

    def listen(self):
        from florence_interfaces.msg import RunState
        from std_msgs.msg import String

        from florence_bt.ros.qos import LATCHED

        states, trees = [], []
        self.node.create_subscription(RunState, "florence_bt/run_state", states.append, LATCHED)
        self.node.create_subscription(String, "florence_bt/tree", trees.append, LATCHED)
        return states, trees


@pytest.fixture
def bench_of(ros: RosBench, tmp_path: Path) -> Callable[..., MissionBench]:
    """A mission server over one skill, ``drive``, that follows a script."""
    from florence_bt.mission_testing.mocks.mocks import Step

    return lambda *script: MissionBench(ros, tmp_path, script or (Step(None),))
