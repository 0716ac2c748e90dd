"""The real Hokuyo driver against the emulated scanner, through bytes, with the time driven by hand."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.core.diagnosis import Severity
from florence_bt.drivers.hokuyo.codec import LONGEST_FRAME
from florence_bt.drivers.hokuyo.diagnosis import diagnose
from florence_bt.drivers.hokuyo.driver import DriverPhase
from florence_bt.drivers.hokuyo.geometry import MultiEchoScan
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.simulation.emulators.scip_models import (
    MODELS,
    UST_10LX,
    UTM_30LX,
    UTM_30LX_EW,
    ScannerModel,
    ScipFaults,
)
from tests.emulators.scip_bench import Bench, started


def test_from_power_on_to_scans() -> None:
    bench = started()
    scans = bench.run(2.0)
    assert len(scans) == 20
    scan = scans[-1]
    assert len(scan.ranges) == 682
    assert scan.angle_min == pytest.approx(-2.086214, abs=1e-6)
    assert scan.angle_max == pytest.approx(2.092350, abs=1e-6)
    assert scan.frame_id == "base_laser_round_link"
    assert bench.driver.rate(bench.now) == pytest.approx(10.0, rel=0.03)
    assert bench.driver.expected_rate == pytest.approx(10.0)
    assert bench.driver.sensor is not None
    assert bench.driver.sensor.version["SERI"] == "H0614967"
    assert bench.driver.sensor.stat == "Sensor works well."
    assert (bench.driver.corrupted, bench.driver.lost, bench.problems) == (0, 0, [])


def test_the_stamp_is_the_moment_of_the_first_beam() -> None:
    bench = started()
    for scan in bench.run(1.0, step=0.001):
        measured_ahead = (scan.ranges[0] - 1.0) % 4.0
        ahead = 384 - 44
        assert scan.stamp + ahead * scan.time_increment == pytest.approx(measured_ahead, abs=0.002)


def test_latency_and_offset_move_the_stamp() -> None:
    bench = started(parameters=HokuyoParameters(use_sensor_clock=False, latency_s=0.2, time_offset=0.01))
    scan = bench.run(0.3)[-1]
    received = bench.driver._frequency._arrivals[-1]
    assert scan.stamp == pytest.approx(received - 0.2 + 44 * scan.time_increment + 0.01)


@pytest.mark.parametrize("piece", [1, 7, 64])
def test_bytes_in_small_pieces(piece: int) -> None:
    assert len(started(piece=piece).run(0.5)) == 5


def test_window_cluster_and_skip() -> None:
    parameters = HokuyoParameters(
        calibrate_time=False, min_ang=-math.pi / 2, max_ang=math.pi / 2, cluster=3, skip=1
    )
    scans = started(parameters=parameters).run(2.0)
    assert len(scans) == 10
    assert len(scans[0].ranges) == 171
    assert scans[0].angle_min == pytest.approx(-math.pi / 2)
    assert scans[0].scan_time == pytest.approx(0.2)


@pytest.mark.parametrize("short_status", [False, True])
def test_old_firmware_is_switched_to_scip_2(short_status: bool) -> None:
    bench = started(
        0.5, scip1=True, short_status=short_status
    )  # in half the time that one missing answer would cost
    assert len(bench.run(0.5)) == 5
    assert bench.driver.corrupted == 0


def test_a_stream_left_over_from_a_crash_is_ended_first() -> None:
    bench = Bench()
    bench.scanner.receive(b"MD0100020001000\n", 0.0)
    bench.run(0.5)
    bench.driver.start(bench.now)
    scans = bench.run(1.0)
    assert {len(scan.ranges) for scan in scans} == {682}


def test_time_mode_left_over_from_a_crash_is_ended_first() -> None:
    bench = Bench()
    bench.scanner.receive(b"TM0\n", 0.0)
    bench.driver.start(0.0)
    assert len(bench.run(1.0)) >= 8


def test_a_bad_check_sum_costs_that_scan_only() -> None:
    bench = started()
    bench.scanner.faults.bad_checksums = 3
    assert len(bench.run(1.0)) == 7
    assert bench.driver.corrupted == 3
    assert bench.problems == []


def test_noise_before_a_scan_costs_nothing() -> None:
    bench = started()
    bench.scanner.faults.noise = b"\xff\x00MD00\n99b\nxyz"
    assert len(bench.run(1.0)) == 10
    assert bench.driver.corrupted == 1


def test_half_a_scan_costs_itself_only() -> None:
    bench = started()
    bench.scanner.faults.cut_scan_at = 700
    scans = bench.run(1.0)
    assert len(scans) == 9
    assert all(len(scan.ranges) == 682 for scan in scans)
    assert bench.driver.corrupted == 1


@pytest.mark.parametrize("status", ["50", "97", "0A"])
def test_trouble_in_the_sensor_restarts_it(status: str) -> None:
    bench = started()
    bench.scanner.faults.scan_status = status
    bench.run(0.5)
    assert status in bench.problems[0]
    assert bench.driver.lost == 1
    assert "status " + status in bench.driver.problem
    assert len(bench.run(2.0)) >= 8
    assert bench.driver.problem == ""


def test_a_sensor_that_checks_itself_is_waited_for() -> None:
    bench = started()
    bench.scanner.faults.every_scan_status = "21"
    bench.run(0.1)
    bench.scanner.faults.every_scan_status = "98"
    bench.run(0.1)
    bench.scanner.faults.every_scan_status = None
    assert len(bench.run(3.0)) == 30
    assert (len(bench.problems), bench.driver.lost) == (1, 0)
    assert "no scans for now, status 21: measuring stopped while the sensor checks" in bench.problems[0]
    assert bench.driver.problem == ""


@pytest.mark.parametrize("statuses", [("21", "50"), ("50",)])
def test_a_sensor_that_finds_itself_broken_is_started_again(statuses: tuple[str, ...]) -> None:
    bench = started()
    for status in statuses:
        bench.scanner.faults.every_scan_status = status
        bench.run(0.1)
    bench.scanner.faults.laser_broken = True
    bench.run(5.0)
    assert all(status in problem for status, problem in zip(statuses, bench.problems, strict=False))
    found = diagnose(bench.driver, HokuyoParameters(), "/dev/ttyACM0", "", bench.now)
    assert found.level is Severity.ERROR
    bench.scanner.faults.laser_broken = False
    bench.scanner.faults.every_scan_status = None
    assert len(bench.run(15.0)) > 10


def test_a_sensor_that_never_ends_its_check_is_started_again() -> None:
    bench = started()
    bench.scanner.faults.scan_status = "21"  # the emulator stops measuring then
    bench.run(0.5)
    found = diagnose(bench.driver, HokuyoParameters(), "/dev/ttyACM0", "", bench.now)
    assert (found.level, "status 21" in found.message) == (Severity.WARN, True)
    assert len(bench.run(4.0)) > 5
    assert bench.driver.lost == 1


def test_a_newer_sensor_calls_itself_stable() -> None:
    bench = Bench()
    bench.scanner.faults.stat = "Stable 000 no error."
    bench.driver.start(0.0)
    assert len(bench.run(1.0)) >= 8


def test_silence_restarts_the_sensor() -> None:
    bench = started()
    bench.scanner.faults.silent = True
    assert bench.run(30.0) == []
    assert bench.problems[0] == "no scan arrived in time"
    assert bench.driver.lost == 1
    bench.scanner.faults.silent = False
    assert len(bench.run(15.0)) > 10


def test_a_power_cut_is_survived() -> None:
    bench = started()
    bench.scanner.set_power(False, bench.now)
    assert bench.run(5.0) == []
    bench.scanner.set_power(True, bench.now)
    assert len(bench.run(15.0)) > 10


def test_a_stuck_timer_is_noticed() -> None:
    bench = started()
    bench.scanner.faults.frozen_timer_ms = 77
    assert len(bench.run(0.5)) == 2
    assert "same time stamp 77 ms" in bench.problems[0]
    bench.scanner.faults.frozen_timer_ms = None
    assert len(bench.run(2.0)) > 5


def test_the_timer_may_wrap() -> None:
    bench = started()
    bench.scanner.set_timer((1 << 24) - 500, bench.now)
    assert len(bench.run(1.0)) == 10
    assert bench.problems == []


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({"stat": "Sensor is ill."}, "Sensor is ill."),
        ({"laser_broken": True}, "'BM' was refused with status '01'"),
    ],
)
def test_a_sick_sensor_is_not_used_and_tried_again(fault: dict[str, object], words: str) -> None:
    bench = Bench()
    bench.scanner.faults = ScipFaults(**fault)  # type: ignore[arg-type]
    bench.driver.start(0.0)
    assert bench.run(15.0) == []
    assert words in bench.problems[0]
    bench.scanner.faults = ScipFaults()
    assert len(bench.run(15.0)) > 10


def test_a_lost_acceptance_of_md_does_not_matter() -> None:
    bench = Bench()
    bench.driver.start(0.0)
    now, data = 0.0, bench.driver.poll(0.0)
    while not data.startswith(b"MD"):
        bench.driver.receive(bench.scanner.receive(data, now), now)
        data = bench.driver.poll(now)
    bench.scanner.receive(data, now)  # its answer is lost; the first scan says the same
    assert len(bench.run(1.0)) >= 8
    assert bench.problems == []


def test_shutdown_switches_the_laser_off() -> None:
    bench = started()
    bench.scanner.receive(bench.driver.shutdown(), bench.now)
    assert not bench.scanner.laser_on
    assert bench.run(1.0) == []


def test_diagnosis_follows_the_scanner() -> None:
    bench = started()
    bench.run(1.0)
    found = diagnose(bench.driver, HokuyoParameters(), "/dev/ttyACM0", "", bench.now)
    assert (found.level, found.message) == (Severity.OK, "measuring")
    assert found.values["Device ID"] == "H0614967"
    assert found.values["Device Status"] == "Sensor works well."
    assert found.values["Computed Latency"] == "0.0709"
    bench.scanner.faults.silent = True
    bench.run(0.8)
    assert diagnose(bench.driver, HokuyoParameters(), "", "", bench.now).level is Severity.WARN
    bench.run(5.0)
    found = diagnose(bench.driver, HokuyoParameters(), "", "", bench.now)
    assert found.level is Severity.ERROR
    assert found.values["Scan Thread Lost Count"] == "1"


@pytest.mark.parametrize("model", [UTM_30LX_EW, UST_10LX])
def test_a_sensor_that_streams_already_is_stopped_and_started(model: ScannerModel) -> None:
    bench = Bench(model=model)
    assert bench.scanner.receive(b"MD0000108001000\n", 0.0).startswith(b"MD0000108001000\n00P")
    bench.run(0.3)
    assert bench.scanner.receive(b"TM2\n", bench.now).startswith(b"TM2\n10")
    bench.driver.start(bench.now)
    assert len(bench.run(2.0)) > 30
    assert bench.driver.phase is DriverPhase.MEASURING
    assert bench.problems == []


def test_a_sensor_that_was_left_in_time_mode_is_started() -> None:
    bench = Bench(model=UTM_30LX_EW)
    bench.scanner.receive(b"TM0\n", 0.0)
    assert bench.scanner.receive(b"QT\n", 0.0).startswith(b"QT\n10")
    bench.driver.start(0.0)
    assert bench.run(2.0)


@pytest.mark.parametrize("model", MODELS.values(), ids=list(MODELS))
def test_every_model_is_healthy_and_measures(model: ScannerModel) -> None:
    bench = started(model=model, parameters=HokuyoParameters(calibrate_time=True), seconds=8.0)
    assert bench.driver.sensor is not None and bench.driver.sensor.stat == model.healthy
    assert bench.driver.calibrated
    assert bench.scans
    assert bench.problems == []


@pytest.mark.parametrize("intensity", [False, True])
def test_every_echo_is_told_where_the_sensor_has_them(intensity: bool) -> None:
    parameters = HokuyoParameters(
        calibrate_time=False, multi_echo=True, intensity=intensity, allow_unsafe_settings=True
    )
    bench = started(model=UTM_30LX_EW, parameters=parameters)
    scan = bench.scans[-1]
    assert isinstance(scan, MultiEchoScan)
    assert scan.echoes.shape == (len(scan.ranges), 2)
    assert np.array_equal(scan.echoes[:, 0], scan.ranges)
    glass = scan.echoes[::10]
    assert np.allclose(glass[:, 1] - glass[:, 0], 0.5)
    assert np.isnan(scan.echoes[1:10, 1]).all()
    assert scan.echo_intensities.shape == (len(scan.ranges), 2 if intensity else 0)
    assert len(scan.intensities) == (len(scan.ranges) if intensity else 0)


def test_a_sensor_of_one_echo_measures_without_the_others() -> None:
    parameters = HokuyoParameters(calibrate_time=False, multi_echo=True, intensity=True)
    bench = started(model=UTM_30LX, parameters=parameters)
    assert not isinstance(bench.scans[-1], MultiEchoScan)
    assert len(bench.scans[-1].intensities)
    assert "this sensor measures one echo of a beam only: multi_echo is left out" in bench.problems


# -- replies that are damaged, and scans without a distance --------------------------------------------------


class SpoiltBench(Bench):
    """A bench on a line that spoils what it carries."""

    spoil: Callable[[bytes], bytes] = staticmethod(bytes)

    def _deliver(self, data: bytes) -> None:
        super()._deliver(self.spoil(data))

    def said(self) -> tuple[Severity, str]:
        found = diagnose(self.driver, HokuyoParameters(), "/dev/hokuyo", "", self.now)
        return found.level, found.message


@pytest.fixture
def spoilt() -> SpoiltBench:
    bench = SpoiltBench()
    bench.driver.start(0.0)
    bench.run(1.5)
    assert bench.said() == (Severity.OK, "measuring")
    return bench


def scan_without_a_line(data: bytes) -> bytes:
    """Leave out a whole data line: every sum fits, and 21 steps are missing."""
    head, _, rest = data.partition(b"\n")
    lines = rest.split(b"\n")
    return b"\n".join([head, *lines[:3], *lines[4:]]) if head.startswith(b"MD") and len(lines) > 5 else data


def wrong_sum(data: bytes) -> bytes:
    return data[:-40] + b"\x01" + data[-39:] if data.startswith(b"MD") and len(data) > 1000 else data


@pytest.mark.parametrize(
    "spoil",
    [
        wrong_sum,
        scan_without_a_line,
        lambda data: data[: len(data) // 2],
        lambda data: b"\xff" * len(data),
        lambda data: b"\n" * len(data),
        lambda data: bytes(len(data)),
    ],
    ids=["sum", "steps", "cut", "ff", "blank", "zeros"],
)
def test_damaged_scans_are_not_taken_are_told_and_the_sensor_comes_back(
    spoilt: SpoiltBench, spoil: Callable[[bytes], bytes]
) -> None:
    spoilt.spoil = spoil
    assert spoilt.run(5.0) == []
    level, message = spoilt.said()
    assert level is Severity.ERROR and message
    assert len(spoilt.driver._parser._buffer) <= LONGEST_FRAME
    spoilt.spoil = bytes
    spoilt.run(15.0)
    assert len(spoilt.run(12.0)) == 120
    assert spoilt.said() == (Severity.OK, "measuring")


def test_that_damaged_replies_came_in_the_place_of_scans_is_told(spoilt: SpoiltBench) -> None:
    spoilt.spoil = wrong_sum
    spoilt.run(2.0)
    assert "that came were damaged: check the cable" in spoilt.said()[1]


def test_a_line_that_damages_every_third_scan_is_told(spoilt: SpoiltBench) -> None:
    scans = 0

    def now_and_then(data: bytes) -> bytes:
        nonlocal scans
        scans += data.startswith(b"MD") and len(data) > 1000
        return wrong_sum(data) if scans % 3 == 0 else data

    spoilt.spoil = now_and_then
    assert len(spoilt.run(9.0)) == 60
    level, message = spoilt.said()
    assert level is Severity.WARN and "was damaged" in message


def _all(code: int, first_step: int, last_step: int) -> NDArray[np.int32]:
    return np.full(last_step - first_step + 1, code, np.int32)


@pytest.mark.parametrize("code", [0, 1, 6, 19, 5601, 65_533])
def test_a_laser_that_sees_nothing_at_all_is_told_and_its_codes_are_no_distances(
    spoilt: SpoiltBench, code: int
) -> None:
    spoilt.world.measure = partial(_all, code)  # type: ignore[method-assign]
    scan = spoilt.run(1.0)[-1]
    assert not scan.valid().any()
    level, message = spoilt.said()
    assert level is Severity.WARN and "no beam has a distance (682 of 682" in message
    del spoilt.world.measure
    spoilt.run(1.0)
    assert spoilt.said() == (Severity.OK, "measuring")
