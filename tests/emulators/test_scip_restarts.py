"""A scanner that stays in trouble is stopped, reset and started again, with growing pauses, and told of."""

from itertools import pairwise

import pytest

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.drivers.hokuyo.diagnosis import diagnose
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.simulation.emulators.scip_models import ScipFaults
from tests.emulators.scip_bench import Bench

LASTING = ["21", "35", "49", "98", "0M"]
"""What a sensor may send in the place of a scan and go on by itself."""

ENDING = ["01", "10", "20", "50", "97", "0A", "0I", "0L"]


class Noted(Bench):
    """Notes when the sensor was told what."""

    def __init__(self, **how: object) -> None:
        super().__init__(**how)  # type: ignore[arg-type]
        self.said: list[tuple[float, str]] = []
        receive = self.scanner.receive

        def note(data: bytes, now: float) -> bytes:
            self.said += [(now, line) for line in data.decode().split()]
            return receive(data, now)

        self.scanner.receive = note  # type: ignore[method-assign]

    def starts(self) -> list[float]:
        return [when for when, line in self.said if line == "RS"]

    def diagnosis(self) -> Diagnosis:
        return diagnose(self.driver, HokuyoParameters(), "/dev/ttyACM0", "", self.now)


def measuring(**how: object) -> Noted:
    bench = Noted(**how)
    bench.driver.start(0.0)
    assert len(bench.run(2.0)) >= 10
    bench.said.clear()
    return bench


@pytest.mark.parametrize("status", LASTING)
def test_a_check_that_never_ends_is_ended(status: str) -> None:
    bench = measuring()
    bench.scanner.faults.every_scan_status = status
    assert bench.run(4.5) == []
    assert bench.said == []  # it may go on by itself
    assert bench.diagnosis().level is Severity.WARN
    bench.run(1.0)
    found = bench.diagnosis()
    assert found.level is Severity.ERROR
    assert f"status {status}" in found.message
    assert found.message.endswith("the sensor is started again")
    bench.run(2.0)
    assert [line for _, line in bench.said] == [
        "SCIP2.0",
        "TM2",
        "QT",
        "RS",
        "PP",
        "VV",
        "II",
        "BM",
        "MD0044072501000",
    ]
    found = bench.diagnosis()
    assert found.level is Severity.ERROR  # still no scans
    assert (found.values["Scan Thread Lost Count"], found.values["Failures In A Row"]) == ("1", "1")
    bench.scanner.faults = ScipFaults()
    assert len(bench.run(2.0)) >= 18
    assert bench.diagnosis().level is Severity.OK


@pytest.mark.parametrize("status", ["21", "49"])
def test_a_check_is_told_once_not_ten_times_a_second(status: str) -> None:
    bench = measuring()
    bench.scanner.faults.every_scan_status = status
    bench.run(4.5)
    assert len(bench.problems) == 1
    assert bench.problems[0].startswith(f"no scans for now, status {status}: ")


@pytest.mark.parametrize("status", LASTING + ENDING)
def test_the_pauses_between_starts_grow_and_stay_bearable(status: str) -> None:
    bench = measuring(parameters=HokuyoParameters(calibrate_time=False, check_timeout_s=0.5))
    bench.scanner.faults.every_scan_status = status
    bench.run(70.0, step=0.02)
    gaps = [later - earlier for earlier, later in pairwise(bench.starts())]
    checked = 0.7 if status in LASTING else 0.2
    pauses = [round(gap - checked) for gap in gaps]
    assert pauses[:5] == [2, 4, 8, 10, 10]
    assert bench.diagnosis().values["Last Rest Before A Start"] == "10"
    assert bench.diagnosis().level is not Severity.OK


def test_a_check_that_ends_in_time_costs_no_restart() -> None:
    bench = measuring()
    for _ in range(5):
        bench.scanner.faults.every_scan_status = "21"
        bench.run(4.0)
        bench.scanner.faults.every_scan_status = None
        assert len(bench.run(1.0)) >= 9
        assert bench.diagnosis().level is Severity.OK
    assert bench.said == []
    assert len(bench.problems) == 5


def test_a_sensor_that_fails_soon_after_each_start_rests_longer_each_time() -> None:
    bench = measuring()
    for _ in range(4):
        while len(bench.run(0.1)) == 0:
            pass
        bench.scanner.faults.scan_status = "50"
        bench.run(0.3)
    pauses = [round(later - earlier) for earlier, later in pairwise(bench.starts())]
    assert pauses == [2, 4]
    assert bench.driver.retry.failures == 4
    assert bench.driver.retry.pause_s == 8.0


def test_a_sensor_that_works_for_long_is_forgiven() -> None:
    bench = measuring()
    for _ in range(4):
        bench.scanner.faults.scan_status = "50"
        bench.run(0.3)
        assert bench.driver.retry.pause_s == 1.0
        assert len(bench.run(4.0)) >= 20
        assert bench.driver.retry.failures == 0


def test_bad_sums_do_not_make_a_check_look_over() -> None:
    bench = measuring()
    bench.scanner.faults.every_scan_status = "21"
    bench.run(3.0)
    bench.scanner.faults.every_scan_status = None
    bench.scanner.faults.bad_checksums = 10**6
    bench.run(3.0)
    assert bench.driver.lost == 1


def test_a_self_test_in_a_check_begins_afresh() -> None:
    """What was waited for before the test does not count after it."""
    bench = measuring(parameters=HokuyoParameters(calibrate_time=False, self_test_scans=3))
    bench.scanner.faults.every_scan_status = "21"
    bench.run(1.0)
    bench.scanner.faults.every_scan_status = None
    results: list[object] = []
    bench.driver.begin_self_test(results.extend, bench.now)
    bench.run(8.0)
    assert len(results) == 6
    assert bench.driver.lost == 0
    assert len(bench.run(1.0)) >= 9


def test_a_finite_stream_of_checks_ends() -> None:
    """The emulated scanner: the last of the scans that were asked for ends the stream, whatever it was."""
    bench = Bench()
    bench.scanner.faults.every_scan_status = "21"
    bench.scanner.receive(b"MD0044072501002\n", 0.0)
    answers = [bench.scanner.poll(0.005 * step) for step in range(100)]
    assert [answer[:19] for answer in answers if answer] == [
        b"MD0044072501001\n21S",
        b"MD0044072501000\n21S",
    ]
    assert not bench.scanner.measuring
