"""What the driver nodes cost, over real pseudo-terminals with their emulators in processes of their own."""

from __future__ import annotations

import json
import os
import signal
import statistics
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks.measure import size

pytest.importorskip("rclpy")

TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")
MEASURED_S = size(10.0, 0.5)
READY_S = 20.0


EMULATORS = str(Path(__file__).parents[1] / "tools" / "emulators")


def cpu_seconds() -> float:
    """User and system time of this process so far."""
    times = os.times()
    return times.user + times.system


class Emulator:
    """An emulated device in a process of its own."""

    def __init__(self, device: str, link: Path) -> None:
        self.link = link
        self.process = subprocess.Popen(
            [sys.executable, EMULATORS, device, "--link", str(link)],
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


def has_gyro(reading: Any) -> bool:
    return reading is not None and reading.gyro is not None


def test_turtlebot_cpu(benchmark: Any, figures: Any, ros: Bench, create: Emulator) -> None:
    from florence_bt.drivers.turtlebot.node import TurtlebotNode

    node = ros.add(TurtlebotNode(parameters={"port": str(create.link)}))
    ros.spin(READY_S, lambda: has_gyro(node._driving._reading))
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
    figures.limit(rate, least=60.0)
    figures.limit(cpu / wall, most=0.10)


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
        from florence_bt.drivers.turtlebot.codec.packets import PACKETS
        from florence_bt.drivers.turtlebot.sequences import STREAMED_PACKETS

        values = dict.fromkeys(range(7, 43), 0) | {33: 512, 35: 3, 25: 2000, 26: 2700, 22: 15000}
        number = 0
        while not self._end.wait(0.015):
            self._line.read()
            # The frame's number goes as the wall signal, so that the answer can be told from the others.
            number += 1
            values[27] = number % 4096
            body = b"".join(
                struct.pack(f">B{PACKETS[packet].code}", packet, values[packet])
                for packet in STREAMED_PACKETS
            )
            counted = bytes([len(body)]) + body
            frame = bytes([19]) + counted + bytes([-sum(counted) % 256])
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
    figures.limit(median, most=3.0)


@pytest.fixture
def laser(tmp_path: Path) -> Iterator[Emulator]:
    emulator = Emulator("scip", tmp_path / "laser")
    yield emulator
    emulator.end()


def test_hokuyo_cpu(benchmark: Any, figures: Any, ros: Bench, laser: Emulator) -> None:
    from florence_bt.drivers.hokuyo.node import HokuyoNode

    node = ros.add(HokuyoNode(parameters={"port": str(laser.link)}))
    ros.spin(READY_S, lambda: node._driver.scans > 5)
    scans = node._driver.scans

    def measure() -> tuple[float, float]:
        wall, cpu = time.perf_counter(), cpu_seconds()
        ros.spin(MEASURED_S)
        return time.perf_counter() - wall, cpu_seconds() - cpu

    wall, cpu = benchmark.pedantic(measure, rounds=1)
    rate = (node._driver.scans - scans) / wall
    figures.add(
        "hokuyo node at full rate", f"{100 * cpu / wall:.1f} % of a core", f"{rate:.1f} scans/s of 682 values"
    )
    figures.limit(rate, least=9.0)
    figures.limit(cpu / wall, most=0.15)


class ScanScript:
    """A scanner's end of a line: answers the start-up, then sends 682 values ten times a second."""

    def __init__(self, link: Path) -> None:
        import numpy as np

        from florence_bt.simulation.emulators.pty_port import PseudoTerminal
        from florence_bt.simulation.emulators.scip import ScipEmulator

        class Counter:
            """The scan's number goes as its first distance, so that each can be told from the others."""

            number = 0

            def measure(self, first_step: int, last_step: int) -> Any:
                self.number += 1
                values = np.full(last_step - first_step + 1, 1000, np.int32)
                values[0] = 100 + self.number
                return values

        self._line = PseudoTerminal(link)
        self._world = Counter()
        self._scanner = ScipEmulator(self._world)
        self._end = threading.Event()
        self.sent: dict[int, float] = {}
        self._thread = threading.Thread(target=self._run)

    def start(self) -> None:
        self._thread.start()

    def _run(self) -> None:
        start = time.perf_counter()
        while not self._end.wait(0.002):
            now = time.perf_counter() - start
            if data := self._line.read():
                self._line.write(self._scanner.receive(data, now))
            if scan := self._scanner.poll(now):
                self._line.write(scan[:-1])
                self.sent[self._world.number] = time.perf_counter()
                self._line.write(scan[-1:])

    def close(self) -> None:
        self._end.set()
        self._thread.join()
        self._line.close()


def test_hokuyo_latency(benchmark: Any, figures: Any, ros: Bench, tmp_path: Path) -> None:
    from sensor_msgs.msg import LaserScan

    from florence_bt.drivers.hokuyo.node import HokuyoNode
    from florence_bt.ros.node import FlorenceNode
    from florence_bt.ros.qos import SENSOR

    script = ScanScript(tmp_path / "laser")
    latencies: list[float] = []

    def on_scan(message: Any) -> None:
        number = round(1000.0 * message.ranges[0]) - 100
        latencies.append(time.perf_counter() - script.sent[number])

    listener = ros.add(FlorenceNode("listener"))
    listener.create_subscription(LaserScan, "scan", on_scan, SENSOR)
    ros.add(HokuyoNode(parameters={"port": str(tmp_path / "laser"), "calibrate_time": False}))
    script.start()
    try:
        ros.spin(READY_S, lambda: len(latencies) > 10)
        latencies.clear()
        benchmark.pedantic(lambda: ros.spin(MEASURED_S), rounds=1)
    finally:
        script.close()
    median = 1000.0 * statistics.median(latencies)
    slowest = 1000.0 * max(latencies)
    figures.add(
        "hokuyo node: last byte to message received",
        f"{median:.2f} ms",
        f"slowest {slowest:.1f} ms, {len(latencies)} scans",
    )
    figures.limit(median, most=3.0)


class KinectPeer:
    """Sends frames to the Kinect's node and listens to it, in a process of its own."""

    def __init__(self, path: str, seconds: float, *, colour: bool) -> None:
        script = Path(__file__).with_name("kinect_peer.py")
        self.process = subprocess.Popen(
            [sys.executable, script, path, str(seconds), "colour" if colour else "depth"],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline().strip() == "ready"

    def result(self) -> Any:
        """What it printed at its end."""
        text, _ = self.process.communicate(timeout=60)
        return json.loads(text.splitlines()[-1])


def kinect_cpu(ros: Bench, node: Any) -> tuple[float, float]:
    """Share of a core, and depth pictures a second, while a node works for ten seconds."""
    ros.spin(READY_S, lambda: node._driver.depth_images > 30)
    pictures, wall, cpu = node._driver.depth_images, time.perf_counter(), cpu_seconds()
    ros.spin(MEASURED_S)
    wall = time.perf_counter() - wall
    return (cpu_seconds() - cpu) / wall, (node._driver.depth_images - pictures) / wall


@pytest.mark.parametrize("colour", [False, True], ids=["depth", "depth and colour"])
def test_kinect(benchmark: Any, figures: Any, ros: Bench, tmp_path: Path, colour: bool) -> None:
    from florence_bt.drivers.kinect.node import KinectNode

    socket = str(tmp_path / "kinect.sock")
    peer = KinectPeer(socket, MEASURED_S + 5.0, colour=colour)
    node = ros.add(KinectNode(parameters={"source": socket, "reconnect_delay_s": 0.1}))
    share, rate = benchmark.pedantic(lambda: kinect_cpu(ros, node), rounds=1)
    ros.spin(READY_S, lambda: peer.process.poll() is not None)
    latencies = [1000.0 * latency for latency in peer.result()[30:] if latency == latency]
    median, slowest = statistics.median(latencies), statistics.quantiles(latencies, n=100)[-1]
    what = "depth and colour" if colour else "depth"
    figures.add(f"Kinect node, {what} 320x240", f"{100 * share:.1f} % of a core", f"{rate:.1f} depth/s")
    figures.add(
        f"Kinect node, {what}: last byte to depth picture in another process",
        f"{median:.2f} ms",
        f"99th percentile {slowest:.1f} ms, {len(latencies)} pictures",
    )
    figures.limit(rate, least=28.0)
    figures.limit(share, most=0.40)
    figures.limit(median, most=3.0)


def test_kinect_through_libfreenect(
    benchmark: Any, figures: Any, ros: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from florence_bt.core.errors import DeviceLost
    from florence_bt.drivers.kinect.fakenect import COLOUR_HEAD, DEPTH_HEAD, INDEX
    from florence_bt.drivers.kinect.freenect_source import FOLDER_VARIABLE, find_fakenect
    from florence_bt.drivers.kinect.node import KinectNode

    try:
        find_fakenect()
    except DeviceLost as missing:
        pytest.skip(str(missing))
    monkeypatch.setenv(FOLDER_VARIABLE, "")
    (tmp_path / "depth").write_bytes(DEPTH_HEAD + b"\x20\x03" * (640 * 480))
    (tmp_path / "colour").write_bytes(COLOUR_HEAD + bytes(640 * 480 * 3))
    names = []
    for number in range(round(30 * (MEASURED_S + 8.0))):
        for name, target in (
            (f"d-{number / 30:.6f}-0.pgm", "depth"),
            (f"r-{number / 30:.6f}-0.ppm", "colour"),
        ):
            (tmp_path / name).symlink_to(target)
            names.append(name)
    (tmp_path / INDEX).write_text("\n".join(names) + "\n")
    peer = KinectPeer("-", MEASURED_S + 5.0, colour=True)
    node = ros.add(KinectNode(parameters={"source": f"recording:{tmp_path}"}))
    share, rate = benchmark.pedantic(lambda: kinect_cpu(ros, node), rounds=1)
    peer.result()
    figures.add(
        "Kinect node over libfreenect (fakenect), depth and colour 640x480",
        f"{100 * share:.1f} % of a core",
        f"{rate:.1f} depth/s; reading the recording included; published at 320x240",
    )
    figures.limit(rate, least=25.0)  # fakenect's own pauses are a little too long
    figures.limit(share, most=0.40)
