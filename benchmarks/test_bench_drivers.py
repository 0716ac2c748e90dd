"""What the driver nodes cost, over real pseudo-terminals with their emulators in processes of their own."""

from __future__ import annotations

import os
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
MEASURED_S = 10.0
READY_S = 20.0


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "48")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


def cpu_seconds() -> float:
    """User and system time of this process so far."""
    times = os.times()
    return times.user + times.system


class Emulator:
    """An emulated device in a process of its own."""

    def __init__(self, device: str, link: Path) -> None:
        self.link = link
        self.process = subprocess.Popen(
            [sys.executable, "-m", "florence_bt.simulation.emulators", device, "--link", str(link)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline().strip() == str(link)

    def end(self) -> None:
        with self.process:
            self.process.send_signal(signal.SIGTERM)
        assert self.process.returncode == 0


@pytest.fixture
def create(tmp_path: Path) -> Iterator[Emulator]:
    emulator = Emulator("create", tmp_path / "create")
    yield emulator
    emulator.end()


class Bench:
    """One node, served in this process."""

    def __init__(self) -> None:
        import rclpy
        from rclpy.signals import SignalHandlerOptions

        from florence_bt.ros.executor import SpinLoop

        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self.loop = SpinLoop()
        self._nodes: list[Any] = []

    def add(self, node: Any) -> Any:
        self._nodes.append(node)
        self.loop.add(node)
        return node

    def spin(self, seconds: float, until: Any = None) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end and not (until is not None and until()):
            self.loop.spin_once(0.05)

    def close(self) -> None:
        import rclpy

        for node in reversed(self._nodes):
            node.shut_down()
            self.loop.remove(node)
            node.destroy_node()
        self.loop.close()
        rclpy.try_shutdown()


@pytest.fixture
def ros(domain: None) -> Iterator[Bench]:
    bench = Bench()
    yield bench
    bench.close()


def test_turtlebot_cpu(benchmark: Any, figures: Any, ros: Bench, create: Emulator) -> None:
    from florence_bt.drivers.turtlebot.node import TurtlebotNode

    node = ros.add(TurtlebotNode(parameters={"port": str(create.link)}))
    ros.spin(READY_S, lambda: node._reading is not None and node._reading.gyro is not None)
    frames = node._driver.decoder.good_frames

    def measure() -> tuple[float, float]:
        wall, cpu = time.perf_counter(), cpu_seconds()
        ros.spin(MEASURED_S)
        return time.perf_counter() - wall, cpu_seconds() - cpu

    wall, cpu = benchmark.pedantic(measure, rounds=1)
    rate = (node._driver.decoder.good_frames - frames) / wall
    figures.add(
        "turtlebot node at full rate",
        f"{100 * cpu / wall:.1f} % of a core",
        f"{rate:.1f} frames/s; odom, imu and tf 30 Hz, sensor state and joints 10 Hz",
    )
    assert rate > 60.0
    assert cpu / wall < 0.10


class Script:
    """The base's end of a line that a test writes frames to, from a thread of its own."""

    def __init__(self, link: Path) -> None:
        from florence_bt.simulation.emulators.pty_port import PseudoTerminal

        self._line = PseudoTerminal(link)
        self._end = threading.Event()
        self.sent: list[float] = []
        self._thread = threading.Thread(target=self._run)

    def start(self) -> None:
        self._thread.start()

    def _run(self) -> None:
        from florence_bt.drivers.turtlebot.codec import ChecksumForm, encode_frame
        from florence_bt.drivers.turtlebot.sequences import STREAMED_PACKETS

        values = dict.fromkeys(range(7, 43), 0) | {33: 512, 35: 3, 25: 2000, 26: 2700, 22: 15000}
        number = 0
        while not self._end.wait(0.015):
            self._line.read()
            # The frame's number goes as the wall signal, so that the answer can be told from the others.
            number += 1
            frame = encode_frame(STREAMED_PACKETS, values | {27: number % 4096}, ChecksumForm.WITHOUT_HEADER)
            self._line.write(frame[:-1])
            self.sent.append(time.perf_counter())
            self._line.write(frame[-1:])

    def close(self) -> None:
        self._end.set()
        self._thread.join()
        self._line.close()


def test_turtlebot_latency(benchmark: Any, figures: Any, ros: Bench, tmp_path: Path) -> None:
    from florence_interfaces.msg import TurtlebotSensorState

    from florence_bt.drivers.turtlebot.node import TurtlebotNode
    from florence_bt.ros.node import FlorenceNode
    from florence_bt.ros.qos import RELIABLE

    script = Script(tmp_path / "create")
    latencies: list[float] = []

    def on_state(message: Any) -> None:
        if message.wall_signal:
            latencies.append(time.perf_counter() - script.sent[message.wall_signal - 1])

    listener = ros.add(FlorenceNode("listener"))
    listener.create_subscription(TurtlebotSensorState, "turtlebot_node/sensor_state", on_state, RELIABLE)
    node = ros.add(TurtlebotNode(parameters={"port": str(tmp_path / "create"), "sensor_state_rate": 66.0}))
    script.start()
    try:
        ros.spin(READY_S, lambda: len(latencies) > 10 and not node._driver.starting)
        latencies.clear()
        benchmark.pedantic(lambda: ros.spin(MEASURED_S), rounds=1)
    finally:
        script.close()
    median = 1000.0 * statistics.median(latencies)
    slowest = 1000.0 * statistics.quantiles(latencies, n=100)[-1]
    figures.add(
        "turtlebot node: last byte to message received",
        f"{median:.2f} ms",
        f"99th percentile {slowest:.1f} ms, {len(latencies)} frames",
    )
    assert median < 3.0
