"""The Hokuyo driver against the emulated scanners: calibration, intensities, self test, every fault."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import DeviceError
from florence_bt.drivers.hokuyo.diagnosis import diagnose
from florence_bt.drivers.hokuyo.driver import DriverPhase
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.drivers.hokuyo.self_test import SelfTestResult
from florence_bt.simulation.emulators.scip_models import URG_04LX, UTM_30LX, ScannerModel, ScipFaults
from tests.emulators.scip_bench import Bench, started
from tests.sweeps import examples, sweep

PLAIN = HokuyoParameters(calibrate_time=False)
TESTS = [
    "Status Test",
    "Laser Test",
    "Polled Data Test",
    "Streamed Data Test",
    "Streamed Intensity Data Test",
    "Laser Off Test",
]


# -- the latency ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("delay", "wraps"), [(0.0, False), (0.03, False), (0.0, True)], ids=["prompt", "slow", "wrapping"]
)
def test_the_latency_is_measured(delay: float, wraps: bool) -> None:
    bench = Bench(HokuyoParameters())
    bench.driver.start(0.0)
    bench.scanner.faults.delay_s = delay
    if wraps:
        bench.run(0.3, step=0.001)
        bench.scanner.set_timer((1 << 24) - 500, bench.now)
    bench.run(5.0, step=0.001)
    assert bench.problems == []
    assert bench.driver.phase is DriverPhase.MEASURING
    assert bench.driver.calibrated
    # The clock's answers are late as well, and half of their way is taken off.
    assert bench.driver.latency == pytest.approx(0.0709 + delay / 2, abs=0.003)
    for scan in bench.run(1.0, step=0.001):
        ahead = (384 - 44) * scan.time_increment
        moment = (scan.ranges[0] - 1.0) % 4.0 + 4.0
        assert scan.stamp + ahead == pytest.approx(moment, abs=delay / 2 + 0.004)


def test_the_latency_is_measured_once_per_sensor() -> None:
    bench = started(4.0, parameters=HokuyoParameters())
    latency = bench.driver.latency
    bench.driver.disconnected("the plug was pulled")
    bench.driver.start(bench.now)
    assert len(bench.run(1.0)) >= 8
    assert bench.driver.latency == latency


def test_a_sensor_that_cannot_tell_the_time_measures_all_the_same() -> None:
    bench = Bench(HokuyoParameters())
    bench.scanner.faults.statuses["TM0"] = "0E"
    bench.driver.start(0.0)
    assert len(bench.run(6.0)) >= 10
    assert bench.problems == [
        "the latency could not be measured: 'TM0' was refused with status '0E': "
        "the command is unknown or not allowed now (time adjustment mode)"
    ]
    assert bench.driver.latency == pytest.approx(726 * 0.1 / 1024)


def test_scans_that_come_late_keep_their_moments() -> None:
    bench = started(3.0)
    bench.scanner.faults.delay_s = 0.08
    late = bench.run(0.95)
    assert bench.driver.late_s == pytest.approx(0.08, abs=0.006)
    for scan in late[-5:]:
        ahead = (384 - 44) * scan.time_increment
        assert scan.stamp + ahead == pytest.approx((scan.ranges[0] - 1.0) % 4.0, abs=0.012)


def test_scans_that_come_in_a_burst_keep_their_moments() -> None:
    bench = started(1.005)
    held = b""
    for _ in range(80):
        bench.now += 0.005
        bench.world.now = bench.now
        held += bench.scanner.poll(bench.now)
    scans = bench.driver.receive(held, bench.now)
    stamps = [scan.stamp for scan in scans]
    assert len(scans) == 4
    np.testing.assert_allclose(np.diff(stamps), 0.1, atol=1e-6)
    assert stamps[-1] < bench.now


# -- UTM-30LX and intensities --------------------------------------------------------------------------------


def test_a_utm_is_measured_whole() -> None:
    wanted = HokuyoParameters(calibrate_time=False, min_ang=-math.pi, max_ang=math.pi)
    bench = started(parameters=wanted, model=UTM_30LX)
    scans = bench.run(1.0)
    assert len(scans) == 40
    scan = scans[-1]
    assert len(scan.ranges) == 1081
    assert scan.angle_min == pytest.approx(-2.356194, abs=1e-6)
    assert scan.angle_max == pytest.approx(2.356194, abs=1e-6)
    assert (scan.range_min, scan.range_max) == (pytest.approx(0.023), pytest.approx(60.0))
    assert scan.scan_time == pytest.approx(0.025)
    assert len(scan.intensities) == 0


@pytest.mark.parametrize("cluster", [0, 1, 4])
def test_a_utm_gives_intensities(cluster: int) -> None:
    wanted = HokuyoParameters(
        calibrate_time=False, intensity=True, cluster=cluster, min_ang=-0.8, max_ang=0.8
    )
    scans = started(parameters=wanted, model=UTM_30LX).run(1.0)
    assert len(scans) == 40
    scan = scans[-1]
    assert len(scan.intensities) == len(scan.ranges) == -(-367 // max(1, cluster))
    np.testing.assert_allclose(scan.intensities, 4_000_000 // np.rint(scan.ranges * 1000.0))


def test_a_urg_has_no_intensities_and_goes_on_without() -> None:
    bench = started(3.0, parameters=HokuyoParameters(calibrate_time=False, intensity=True))
    assert len(bench.run(1.0)) == 10
    assert bench.problems == ["this sensor measures no intensities: they are left out"]
    assert bench.driver.measurement is not None and bench.driver.measurement.kind == "MD"


def test_error_codes_pass_as_ranges_that_are_too_small() -> None:
    bench = started(parameters=HokuyoParameters(calibrate_time=False))
    bench.world.measure = lambda first, last: np.full(last - first + 1, 6, np.int32)  # type: ignore[method-assign]
    bench.run(0.2)
    scan = bench.run(0.2)[-1]
    assert np.allclose(scan.ranges, 0.006)
    assert not scan.valid().any()
    assert bench.driver.beams_without_range() == "682 of 682, mostly: other error"


# -- the self test -------------------------------------------------------------------------------------------


def results_of(bench: Bench, seconds: float = 60.0) -> list[SelfTestResult]:
    found: list[SelfTestResult] = []
    bench.driver.begin_self_test(found.extend, bench.now)
    for _ in range(round(seconds)):
        assert bench.run(1.0) == [] or bench.driver.phase is DriverPhase.MEASURING
        if found:
            break
    return found


@pytest.mark.parametrize("model", [None, UTM_30LX], ids=["urg", "utm"])
def test_the_self_test_passes(model: object) -> None:
    bench = started(**({} if model is None else {"model": model}))
    found = results_of(bench)
    assert [result.name for result in found] == TESTS
    assert {result.level for result in found} == {Severity.OK}
    assert found[0].message == bench.scanner.model.healthy
    assert found[3].message == "all 99 scans came"
    assert ("no intensities" in found[4].message) is (model is None)
    assert len(bench.run(1.0)) >= 8
    assert bench.driver.lost == 0


@pytest.mark.parametrize(
    ("fault", "failed", "words"),
    [
        ({"stat": "Sensor is ill."}, ["Status Test"], "Sensor is ill."),
        ({"statuses": {"GD": "0A"}}, ["Polled Data Test"], "'0A'"),
        ({"statuses": {"II": "0I"}}, ["Status Test"], "firmware update"),
        ({"statuses": {"BM": "01"}}, ["Laser Test", "Polled Data Test"], "cannot be switched on"),
        ({"statuses": {"MD": "0A"}}, ["Streamed Data Test"], "'0A'"),
    ],
)
def test_the_self_test_finds_what_is_wrong(fault: dict[str, object], failed: list[str], words: str) -> None:
    bench = started(parameters=HokuyoParameters(calibrate_time=False, self_test_scans=5))
    bench.scanner.faults = ScipFaults(**fault)  # type: ignore[arg-type]
    found = results_of(bench)
    bad = [result for result in found if result.level is Severity.ERROR]
    assert [result.name for result in bad] == failed
    assert words in bad[0].message
    bench.scanner.faults = ScipFaults()
    assert len(bench.run(15.0)) > 10


@pytest.mark.parametrize(("spoilt", "level"), [(1, Severity.WARN), (2, Severity.ERROR)])
def test_damaged_scans_are_counted(spoilt: int, level: Severity) -> None:
    bench = started(parameters=HokuyoParameters(calibrate_time=False, self_test_scans=5))
    bench.scanner.faults.bad_checksums = spoilt
    assert results_of(bench)[3].level is level


def test_a_port_that_is_lost_ends_the_self_test() -> None:
    bench = started()
    found: list[object] = []
    bench.driver.begin_self_test(found.append, bench.now)
    bench.run(0.5)
    bench.driver.disconnected("the plug was pulled")
    assert found == [()]


def test_no_self_test_without_a_sensor() -> None:
    bench = Bench()
    with pytest.raises(DeviceError, match="stopped"):
        bench.driver.begin_self_test(lambda results: None, 0.0)


# -- faults --------------------------------------------------------------------------------------------------


def set_faults(**how: object) -> Callable[[Bench], None]:
    def change(bench: Bench) -> None:
        for name, value in how.items():
            setattr(bench.scanner.faults, name, value)

    return change


FAULTS: dict[str, Callable[[Bench], None]] = {
    "silence": set_faults(silent=True),
    "commands lost and stopped": lambda bench: (
        bench.scanner.receive(b"QT\n", bench.now),
        set_faults(commands_lost=True)(bench),
    ),
    "bad sums for ever": set_faults(bad_checksums=10**6, bad_replies=10**6),
    "a broken laser": set_faults(laser_broken=True),
    "a check without end": set_faults(every_scan_status="21"),
    "a timer that stands": set_faults(frozen_timer_ms=5),
    "no power": lambda bench: bench.scanner.set_power(False, bench.now),
    "a sleeping line": set_faults(bytes_per_second=20.0),
}


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_is_told_and_ends_with_scans_again(name: str) -> None:
    bench = started()
    FAULTS[name](bench)
    bench.run(4.0)
    seen = len(bench.scans)
    bench.run(6.0)
    assert len(bench.scans) - seen <= 4  # a timer that stands lets two scans through at each new start
    found = diagnose(bench.driver, PLAIN, "/dev/ttyACM0", "", bench.now)
    assert found.level is not Severity.OK, found
    assert bench.driver.problem
    assert bench.driver.lost >= 1
    bench.scanner.faults = ScipFaults()
    bench.scanner.set_power(True, bench.now)
    bench.run(25.0)
    scans = bench.run(3.0)
    assert len(scans) >= 29
    assert diagnose(bench.driver, PLAIN, "/dev/ttyACM0", "", bench.now).level is Severity.OK
    ahead = (384 - 44) * scans[-1].time_increment
    moment = math.remainder(scans[-1].stamp + ahead - (scans[-1].ranges[0] - 1.0), 4.0)
    assert abs(moment) < 0.012  # nothing stale is published


TROUBLES: dict[str, Callable[[Bench], object]] = FAULTS | {
    "some bad scans": set_faults(bad_checksums=3),
    "some bad replies": set_faults(bad_replies=5),
    "noise": set_faults(noise=bytes(range(256))),
    "half a scan": set_faults(cut_scan_at=300),
    "a check": set_faults(scan_status="21"),
    "trouble": set_faults(scan_status="50"),
    "an odd status": set_faults(statuses={"TM1": "0E", "II": "0I"}),
    "late answers": set_faults(delay_s=0.6),
    "an ill sensor": set_faults(stat="Sensor is ill."),
    "a stream of somebody else": lambda bench: bench.scanner.receive(b"QT\nMD0100020001000\n", bench.now),
    "time mode": lambda bench: bench.scanner.receive(b"TM0\n", bench.now),
    "half a command": lambda bench: bench.scanner.receive(b"MD00", bench.now),
    "sleep": lambda bench: bench.scanner.receive(b"%SL\n", bench.now),
    "a new plug": lambda bench: (bench.driver.disconnected("unplugged"), bench.driver.start(bench.now)),
    "a self test": lambda bench: (
        bench.driver.phase is DriverPhase.MEASURING
        and bench.driver.begin_self_test(lambda results: None, bench.now)
    ),
}


@settings(max_examples=examples(40))
@given(
    model=st.sampled_from([URG_04LX, UTM_30LX]),
    scip1=st.booleans(),
    calibrate=st.booleans(),
    intensity=st.booleans(),
    troubles=st.lists(st.tuples(st.sampled_from(sorted(TROUBLES)), st.floats(0.0, 2.0)), max_size=8),
)
def test_any_troubles_in_any_order_end_with_scans_again(
    model: ScannerModel,
    scip1: bool,
    calibrate: bool,
    intensity: bool,
    troubles: list[tuple[str, float]],
) -> None:
    wanted = HokuyoParameters(
        calibrate_time=calibrate, intensity=intensity, min_ang=-0.5, max_ang=0.5, self_test_scans=3
    )
    bench = Bench(wanted, model=model, scip1=scip1)
    bench.driver.start(0.0)
    for name, seconds in troubles:
        TROUBLES[name](bench)
        bench.run(seconds, step=0.01)
    bench.scanner.faults = ScipFaults()
    bench.scanner.set_power(True, bench.now)
    # At worst: a pause of ten seconds, and the calibration.
    for _ in range(30):
        if len(bench.run(1.0, step=0.01)) >= 9:
            break
    else:
        pytest.fail(f"no scans: {bench.driver.phase}, {bench.problems[-3:]}")
    assert diagnose(bench.driver, wanted, "", "", bench.now).level is not Severity.ERROR


STATUSES = ["01", "04", "10", "0A", "0B", "0C", "0D", "0E", "0F", "0G", "0H", "0I"]


@pytest.mark.parametrize(
    ("status", "command"), sweep(itertools.product(STATUSES, ["QT", "RS", "PP", "BM", "MD"]), every=7)
)
def test_every_status_of_every_command_is_survived(status: str, command: str) -> None:
    bench = Bench()
    bench.scanner.faults.statuses[command] = status
    bench.driver.start(0.0)
    assert bench.run(13.0, step=0.02) == []
    assert f"refused with status '{status}'" in bench.problems[0]
    bench.scanner.faults = ScipFaults()
    assert len(bench.run(15.0, step=0.02)) > 10


@pytest.mark.parametrize("status", STATUSES)
def test_whatever_tm2_is_answered_with_the_sensor_is_started(status: str) -> None:
    bench = Bench()
    bench.scanner.faults.statuses["TM2"] = status
    bench.driver.start(0.0)
    assert len(bench.run(3.0)) > 10


@pytest.mark.parametrize("status", ["01", "02", "10", "21", "35", "49", "50", "73", "97", "0A", "0B", "0I"])
def test_every_status_in_the_place_of_a_scan(status: str) -> None:
    bench = started()
    bench.scanner.faults.scan_status = status
    bench.run(0.5)
    assert f"status {status}" in bench.driver.problem
    assert len(bench.run(3.0)) > 5


def test_a_sensor_that_checks_itself_goes_on() -> None:
    """Status 98: it measures again after a check."""
    bench = started()
    bench.driver.receive(b"MD0044072501000\n98a\n\n", bench.now)
    assert len(bench.run(1.0)) == 10
    assert bench.problems == []
