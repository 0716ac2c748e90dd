"""The Hokuyo node between an emulated scanner on a pseudo-terminal and ROS subscribers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from diagnostic_msgs.srv import SelfTest
from sensor_msgs.msg import LaserScan

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.hokuyo.node import HokuyoNode
from florence_bt.ros.clock import RosClock
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE, SENSOR
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.emulators.scip import ScipEmulator
from florence_bt.simulation.emulators.scip_models import UTM_30LX
from tests.ros.hokuyo_hardware import Hardware, LockStep, Room
from tools.emulators.tcp_line import TcpLine

pytestmark = pytest.mark.ros


@pytest.fixture
def hardware(tmp_path: Path) -> Iterator[Hardware]:
    hardware = Hardware(tmp_path / "ttyACM0")
    hardware.plug_in()
    yield hardware
    hardware.unplug()


@pytest.fixture
def lock_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LockStep]:
    hardware = LockStep(tmp_path / "ttyACM0")
    time_of_hardware = property(lambda _node: hardware.clock, lambda _node, _clock: None)
    monkeypatch.setattr(HokuyoNode, "timebase", time_of_hardware, raising=False)
    monkeypatch.setattr(RosClock, "arrival_time", lambda _clock: hardware.clock.now())
    hardware.plug_in()
    yield hardware
    hardware.unplug()


class Spy:
    def __init__(self, ros: Any, namespace: str = "") -> None:
        node = ros.add(FlorenceNode("spy", namespace=namespace))
        self.scans: list[LaserScan] = []
        self.reports: list[DiagnosticStatus] = []
        node.create_subscription(LaserScan, "scan", self.scans.append, SENSOR, judge_stamps=False)
        node.create_subscription(
            DiagnosticArray, "diagnostics", lambda m: self.reports.extend(m.status), RELIABLE
        )


def laser(ros: Any, hardware: Hardware, *, namespace: str = "", **parameters: Any) -> HokuyoNode:
    """The node, with more patience than any machine needs that is held up."""
    settings = {"port": str(hardware.link), "reply_timeout_s": 10.0, "silence_timeout_s": 10.0, **parameters}
    return ros.add(HokuyoNode(namespace=namespace, parameters=settings))


def serving(hardware: Hardware, condition: Callable[[], Any]) -> Callable[[], Any]:
    def check() -> Any:
        hardware.serve()
        return condition()

    return check


def test_scans_are_published(ros: Any, hardware: Hardware) -> None:
    spy = Spy(ros)
    node = laser(ros, hardware, calibrate_time=False)
    ros.spin_until(serving(hardware, lambda: len(spy.scans) >= 5), what="five scans")
    scan = spy.scans[-1]
    assert scan.header.frame_id == "base_laser_round_link"
    assert scan.angle_min == pytest.approx(-2.086214, abs=1e-6)
    assert scan.angle_max == pytest.approx(2.092350, abs=1e-6)
    assert scan.angle_increment == pytest.approx(0.00613592, abs=1e-8)
    assert (scan.range_min, scan.range_max) == (pytest.approx(0.02), pytest.approx(5.6))
    assert scan.scan_time == pytest.approx(0.1)
    np.testing.assert_allclose(scan.ranges, np.arange(1044, 1726) / 1000.0, rtol=1e-6)
    age = node.timebase.now() - (scan.header.stamp.sec + scan.header.stamp.nanosec * 1e-9)
    assert 0.06 < age < 30.0
    report = ros.spin_until(serving(hardware, lambda: spy.reports and spy.reports[-1]), what="diagnostics")
    assert report.hardware_id == "H0614967"
    assert {value.key: value.value for value in report.values}["Corrupted Scan Count"] == "0"


def test_closing_the_node_switches_the_laser_off(ros: Any, hardware: Hardware) -> None:
    spy = Spy(ros)
    node = laser(ros, hardware, calibrate_time=False)
    ros.spin_until(serving(hardware, lambda: spy.scans), what="a scan")
    assert hardware.scanner.laser_on
    ros.close_node(node)
    ros.spin_until(serving(hardware, lambda: not hardware.scanner.laser_on), what="the laser going off")


def test_the_plug_is_pulled_and_comes_back(ros: Any, hardware: Hardware) -> None:
    spy = Spy(ros)
    laser(ros, hardware, calibrate_time=False, reconnect_delay_s=0.1)
    ros.spin_until(serving(hardware, lambda: spy.scans), what="a scan")
    spy.reports.clear()
    hardware.unplug()
    worst = ros.spin_until(
        lambda: [r for r in spy.reports if r.level == DiagnosticStatus.ERROR], what="an error"
    )
    assert str(hardware.link) in worst[0].message
    spy.scans.clear()
    hardware.plug_in()
    ros.spin_until(serving(hardware, lambda: len(spy.scans) > 3), what="scans again")
    ros.spin_until(
        serving(hardware, lambda: spy.reports[-1].level != DiagnosticStatus.ERROR),
        what="the end of the error",
    )


def test_a_scanner_that_is_plugged_in_late(ros: Any, hardware: Hardware) -> None:
    hardware.unplug()
    spy = Spy(ros)
    laser(ros, hardware, calibrate_time=False, reconnect_delay_s=0.1)
    report = ros.spin_until(lambda: spy.reports and spy.reports[-1], what="diagnostics")
    assert report.level == DiagnosticStatus.ERROR
    assert "there is no such port" in report.message
    hardware.plug_in()
    ros.spin_until(serving(hardware, lambda: spy.scans), what="a scan")


def test_a_sensor_in_trouble_recovers(ros: Any, hardware: Hardware) -> None:
    spy = Spy(ros)
    laser(ros, hardware, calibrate_time=False, restart_delay_s=0.1)
    ros.spin_until(serving(hardware, lambda: spy.scans), what="a scan")
    hardware.scanner.faults.scan_status = "50"
    ros.spin_until(serving(hardware, lambda: not hardware.scanner.measuring), what="the trouble")
    spy.scans.clear()
    ros.spin_until(serving(hardware, lambda: len(spy.scans) > 3), what="scans again")


def test_a_check_that_never_ends_is_told_and_ended(ros: Any, hardware: Hardware) -> None:
    spy = Spy(ros)
    laser(ros, hardware, calibrate_time=False, check_timeout_s=0.3, restart_delay_s=0.1)
    ros.spin_until(serving(hardware, lambda: spy.scans), what="a scan")
    hardware.scanner.faults.every_scan_status = "21"

    def started_in_vain() -> bool:
        values = {v.key: v.value for v in spy.reports[-1].values} if spy.reports else {}
        failures = int(values.get("Failures In A Row", "0"))
        return failures >= 2 and spy.reports[-1].level == DiagnosticStatus.ERROR

    ros.spin_until(serving(hardware, started_in_vain), what="an error that starts do not cure")
    hardware.scanner.faults.every_scan_status = None
    spy.scans.clear()
    ros.spin_until(serving(hardware, lambda: len(spy.scans) > 3), what="scans again")


def test_parameters_and_namespace(ros: Any, hardware: Hardware) -> None:
    spy = Spy(ros, namespace="robot1")
    laser(
        ros,
        hardware,
        namespace="robot1",
        calibrate_time=False,
        min_ang=-math.pi / 2,
        max_ang=math.pi / 2,
        cluster=3,
        frame_id="laser",
    )
    ros.spin_until(serving(hardware, lambda: spy.scans), what="a scan")
    assert len(spy.scans[0].ranges) == 171
    assert spy.scans[0].header.frame_id == "laser"
    assert spy.scans[0].angle_min == pytest.approx(-math.pi / 2)


def test_a_real_serial_line_is_brought_to_its_speed(ros: Any, hardware: Hardware) -> None:
    hardware.strict_baud = True
    spy = Spy(ros)
    wanted = {"calibrate_time": False, "port": str(hardware.link), "baud_rate": 57600}
    ros.add(HokuyoNode(parameters=wanted))
    ros.spin_until(serving(hardware, lambda: len(spy.scans) > 2), what="scans")
    assert hardware.scanner.bit_rate == 57600
    assert isinstance(hardware.terminal, PseudoTerminal)
    assert hardware.terminal.client_baud == 57600


def test_a_wrong_parameter_is_named(ros: Any) -> None:
    with pytest.raises(ConfigError, match="skip"):
        HokuyoNode(parameters={"skip": 10})


def test_the_latency_is_calibrated(ros: Any, hardware: Hardware) -> None:
    spy = Spy(ros)
    laser(ros, hardware)
    ros.spin_until(serving(hardware, lambda: len(spy.scans) >= 5), what="five scans")

    def measured() -> bool:
        values = {v.key: v.value for v in spy.reports[-1].values} if spy.reports else {}
        return values.get("Latency Measured") == "yes"

    ros.spin_until(serving(hardware, measured), what="the measured latency")


def test_the_limits_of_the_sensor_are_parameters(ros: Any, hardware: Hardware) -> None:
    spy = Spy(ros)
    node = laser(ros, hardware, calibrate_time=False)
    assert not node.has_parameter("min_ang_limit")
    ros.spin_until(serving(hardware, lambda: spy.scans), what="a scan")
    values = [node.get_parameter(name).value for name in ("min_ang_limit", "max_ang_limit")]
    assert values == [pytest.approx(-2.086214, abs=1e-6), pytest.approx(2.092350, abs=1e-6)]
    assert node.get_parameter("min_range").value == pytest.approx(0.02)
    assert node.get_parameter("max_range").value == pytest.approx(5.6)


def test_a_utm_on_the_network_with_intensities(ros: Any, hardware: Hardware) -> None:
    hardware.unplug()
    hardware.scanner = ScipEmulator(Room(), model=UTM_30LX)
    line = hardware.terminal = TcpLine()
    spy = Spy(ros)
    ros.add(
        HokuyoNode(
            parameters={
                "calibrate_time": False,
                "intensity": True,
                "min_ang": -0.5,
                "max_ang": 0.5,
                "ip_address": "127.0.0.1",
                "ip_port": line.port,
                "reconnect_delay_s": 0.1,
            }
        )
    )
    ros.spin_until(serving(hardware, lambda: len(spy.scans) > 3), what="scans")
    assert len(spy.scans[-1].intensities) == len(spy.scans[-1].ranges) == 231
    hardware.unplug()
    ros.spin_until(lambda: [r for r in spy.reports if r.level == DiagnosticStatus.ERROR], what="an error")
    spy.scans.clear()
    hardware.terminal = TcpLine(port=line.port)
    ros.spin_until(serving(hardware, lambda: len(spy.scans) > 3), what="scans again")


def test_a_dumb_port_is_opened_again(ros: Any, lock_step: LockStep) -> None:
    hardware = lock_step
    spy = Spy(ros)
    hardware.scanner.faults.commands_lost = True
    settings = {"port": str(hardware.link), "calibrate_time": False, "reply_timeout_s": 0.05}
    ros.add(HokuyoNode(parameters=settings | {"reconnect_delay_s": 0.1}, open_port=hardware.open_port))
    report = ros.spin_until(
        serving(hardware, lambda: [r for r in spy.reports if "nothing that speaks" in r.message]),
        what="the warning",
    )
    assert report[0].level == DiagnosticStatus.ERROR
    hardware.scanner.faults.commands_lost = False
    ros.spin_until(serving(hardware, lambda: spy.scans), what="a scan")


def ask_self_test(ros: Any, hardware: Hardware, spy_node: Any) -> SelfTest.Response:
    client = spy_node.create_client(SelfTest, "hokuyo_node/self_test")
    ros.spin_until(serving(hardware, client.service_is_ready), what="the service")
    future = client.call_async(SelfTest.Request())
    ros.spin_until(serving(hardware, future.done), what="the answer")
    return future.result()


def test_the_self_test(ros: Any, lock_step: LockStep) -> None:
    """In lock-step: each of the tests waits for answers, which are late on a machine that is busy."""
    hardware = lock_step
    spy = Spy(ros)
    asker = ros.add(FlorenceNode("asker"))
    settings = {"port": str(hardware.link), "calibrate_time": False, "self_test_scans": 3}
    ros.add(HokuyoNode(parameters=settings, open_port=hardware.open_port))
    ros.spin_until(serving(hardware, lambda: spy.scans), what="a scan")
    answer = ask_self_test(ros, hardware, asker)
    assert (answer.id, answer.passed) == ("H0614967", b"\x01")
    assert [status.name for status in answer.status] == [
        "Status Test",
        "Laser Test",
        "Polled Data Test",
        "Streamed Data Test",
        "Streamed Intensity Data Test",
        "Laser Off Test",
    ]
    spy.scans.clear()
    ros.spin_until(serving(hardware, lambda: spy.scans), what="scans after the test")
    hardware.scanner.faults.statuses["GD"] = "0A"
    answer = ask_self_test(ros, hardware, asker)
    assert answer.passed == b"\x00"
    assert answer.status[2].level == DiagnosticStatus.ERROR


def test_the_self_test_without_a_sensor(ros: Any, hardware: Hardware) -> None:
    hardware.unplug()
    asker = ros.add(FlorenceNode("asker"))
    ros.add(HokuyoNode(parameters={"port": str(hardware.link)}))
    answer = ask_self_test(ros, hardware, asker)
    assert (answer.id, answer.passed) == ("unknown", b"\x00")
    assert "there is no such port" in answer.status[0].message
