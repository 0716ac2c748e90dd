"""A Hokuyo through its real driver: the one of ``--device``, or the emulated one in a time driven by hand.

``--device hokuyo=/dev/ttyACM0`` for one on a serial port, ``--device hokuyo=192.168.0.10:10940`` for one on
the network. Nothing moves.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.core.sensing import LaserScan
from florence_bt.drivers.hokuyo.diagnosis import diagnose
from florence_bt.drivers.hokuyo.driver import DriverPhase, HokuyoDriver
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters, HokuyoPortParameters
from florence_bt.drivers.hokuyo.self_test import SelfTestResult
from florence_bt.drivers.serial_port import BytePort, SerialPort
from florence_bt.drivers.tcp_port import TcpPort
from tests.hardware.hand_driven import Emulated, HandPort
from tools.emulators.scip_program import ScipOptions, ScipProgram

pytestmark = pytest.mark.slow

READY_S = 30.0


class Scanner:
    """Port and driver, served for as long as somebody waits."""

    def __init__(self, device: str | Emulated, parameters: HokuyoParameters) -> None:
        emulated = isinstance(device, Emulated)
        path = device.program.path if emulated else device
        host, colon, number = path.rpartition(":")
        where = HokuyoPortParameters(port=path, ip_address=host)
        self.clock = device.clock if emulated else time.monotonic
        self.port: BytePort
        if emulated:
            self.port = HandPort(device, where.baud_rate)
        else:
            self.port = TcpPort(host, int(number)) if colon else SerialPort(path, where.baud_rate)
        self.parameters = parameters
        self.problems: list[str] = []
        self.driver = HokuyoDriver(parameters, self.problems.append, where.line_rate)
        self.driver.start(self.clock())

    def run(self, seconds: float, until: Callable[[], bool] | None = None) -> list[LaserScan]:
        """Serve the driver; gives the scans of that time."""
        scans: list[LaserScan] = []
        end = self.clock() + seconds
        while self.clock() < end and not (until is not None and until()):
            data = self.driver.poll(self.clock())
            if self.driver.bit_rate is not None and isinstance(self.port, SerialPort):
                self.port.set_baud_rate(self.driver.bit_rate)
            self.port.write(data)
            data = self.port.read(0.005)
            if data:
                scans += self.driver.receive(data, self.clock())
        return scans

    def run_for(self, count: int) -> list[LaserScan]:
        """Serve the driver until this many scans have come."""
        scans: list[LaserScan] = []
        end = self.clock() + READY_S
        while len(scans) < count:
            assert self.clock() < end, f"{len(scans)} of {count} scans came: {self.driver.problem}"
            scans += self.run(0.1)
        return scans

    def ready(self) -> None:
        self.run(READY_S, until=lambda: self.driver.phase is DriverPhase.MEASURING)
        assert self.driver.phase is DriverPhase.MEASURING, (
            f"the scanner does not measure: {self.driver.problem or 'it is silent'}"
        )

    def close(self) -> None:
        self.port.write(self.driver.shutdown())
        self.port.close()


@pytest.fixture(scope="module")
def device(
    device_path: Callable[..., tuple[str, str] | None], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[str | Emulated]:
    found = device_path("hokuyo")
    if found is not None:
        yield found[1]
        return
    options = ScipOptions(link=tmp_path_factory.mktemp("laser") / "line", seed=1)
    emulated = Emulated(lambda clock: ScipProgram(options, clock))
    yield emulated
    emulated.program.close()


@pytest.fixture
def opened(device: str | Emulated) -> Iterator[Callable[[HokuyoParameters], Scanner]]:
    scanners: list[Scanner] = []

    def make(parameters: HokuyoParameters) -> Scanner:
        scanners.append(Scanner(device, parameters))
        scanners[-1].ready()
        return scanners[-1]

    yield make
    for scanner in scanners:
        scanner.close()


def test_scans_come_at_their_rate_and_whole(opened: Callable[..., Scanner]) -> None:
    scanner = opened(HokuyoParameters())
    assert scanner.driver.calibrated, scanner.problems
    assert 0.0 < scanner.driver.latency < 0.3
    scanner.run(0.5)
    damaged = scanner.driver.corrupted
    scans = scanner.run_for(30)
    rate = scanner.driver.expected_rate
    geometry = scanner.driver.geometry
    assert geometry is not None
    assert len(scans[-1].ranges) == geometry.step_at(2.092350) - geometry.step_at(-2.086214) + 1
    # By the sensor's own clock. A busy machine may miss turns, so a gap may be several of them.
    turns = np.diff([scan.stamp for scan in scans]) * rate
    assert np.median(turns) == pytest.approx(1.0, abs=0.04)
    np.testing.assert_allclose(turns, np.rint(turns), atol=0.04 * rate / 10.0)
    assert scanner.driver.corrupted <= damaged + 1
    found = diagnose(scanner.driver, scanner.parameters, "", "", scanner.clock())
    assert found.level is not Severity.ERROR, found


def test_something_is_measured(opened: Callable[..., Scanner]) -> None:
    scan = opened(HokuyoParameters(calibrate_time=False)).run_for(5)[-1]
    assert scan.valid().mean() > 0.1, "most beams measure nothing: is something before the scanner?"


def test_clusters_and_skips(opened: Callable[..., Scanner]) -> None:
    scanner = opened(HokuyoParameters(calibrate_time=False, min_ang=-0.5, max_ang=0.5, cluster=3, skip=1))
    scans = scanner.run_for(10)
    gaps = np.diff([scan.stamp for scan in scans])
    assert np.median(gaps) == pytest.approx(1.0 / scanner.driver.expected_rate, rel=0.04)
    assert scans[-1].angle_increment == pytest.approx(3 * scanner.driver.geometry.step_angle)


def test_the_self_test(opened: Callable[..., Scanner]) -> None:
    scanner = opened(HokuyoParameters(calibrate_time=False, self_test_scans=10))
    found: list[Sequence[SelfTestResult]] = []
    scanner.driver.begin_self_test(found.append, scanner.clock())
    scanner.run(READY_S, until=lambda: bool(found))
    assert [result for result in found[0] if result.level is Severity.ERROR] == []
    assert scanner.run_for(6)
