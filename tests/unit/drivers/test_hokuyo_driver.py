"""The start-up table and failures of a scripted sensor; those of the emulator are in tests/emulators."""

from itertools import pairwise

import pytest

from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import ConfigError
from florence_bt.drivers.diagnosis import FrequencyMeter, is_off
from florence_bt.drivers.hokuyo.codec import checksum
from florence_bt.drivers.hokuyo.diagnosis import diagnose
from florence_bt.drivers.hokuyo.driver import DriverPhase, HokuyoDriver
from florence_bt.drivers.hokuyo.geometry import SensorGeometry
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters, HokuyoPortParameters
from florence_bt.drivers.hokuyo.start_up import Sensor, rates_to_try
from florence_bt.drivers.hokuyo.stream import plan_measurement


def test_the_first_command_and_its_deadline() -> None:
    driver = HokuyoDriver(HokuyoParameters())
    assert driver.next_deadline() is None
    driver.start(10.0)
    assert driver.poll(10.0) == b"SCIP2.0\n"
    assert driver.poll(10.5) == b""
    assert driver.next_deadline() == 11.0


def test_a_dumb_port_is_tried_patiently_for_ever() -> None:
    problems: list[str] = []
    driver = HokuyoDriver(HokuyoParameters(), problems.append)
    driver.start(0.0)
    sent: list[tuple[float, bytes]] = []
    now = 0.0
    while now < 60.0:
        if data := driver.poll(now):
            sent.append((now, data))
        deadline = driver.next_deadline()
        assert deadline is not None and deadline > now
        now = deadline
    # SCIP2.0 may stay unanswered; TM2 is tried three times; then rests of 1, 2, 4, 8, 10, 10 ... seconds.
    assert [data for _, data in sent[:5]] == [b"SCIP2.0\n", b"TM2\n", b"TM2\n", b"TM2\n", b"SCIP2.0\n"]
    starts = [when for when, data in sent if data == b"SCIP2.0\n"]
    assert [round(b - a) for a, b in pairwise(starts)] == [5, 6, 8, 12, 14, 14]
    assert set(problems) == {"no answer to TM2"}
    assert driver.lost == 0


VERSION = {"VEND": "Hokuyo", "PROD": "URG", "FIRM": "1", "PROT": "SCIP 2.0", "SERI": "H1"}
PARAMETERS = {
    "MODL": "URG-04LX",
    "DMIN": "20",
    "DMAX": "5600",
    "ARES": "1024",
    "AMIN": "44",
    "AMAX": "725",
    "AFRT": "384",
    "SCAN": "600",
}


def answer(command: str, status: str, fields: dict[str, str] | None = None) -> bytes:
    lines = [f"{tag}:{value}" for tag, value in (fields or {}).items()]
    return "\n".join(
        [command, status + chr(checksum(status.encode()))]
        + [f"{line};{chr(checksum(line.encode()))}" for line in lines]
        + ["", ""]
    ).encode()


def script_of(driver: HokuyoDriver, refused: tuple[str, ...] = ()) -> list[str]:
    """Answer what the driver says, until it has nothing to say; gives what it said."""
    fields = {"VV": VERSION, "PP": PARAMETERS, "II": {"STAT": "Sensor works well."}}
    said = []
    while data := driver.poll(0.0):
        for command in data.decode().split():
            said.append(command)
            status = "0E" if command[:2] in refused else "00"
            driver.receive(answer(command, status, fields.get(command)), 0.0)
    return said


def test_the_sequence_is_the_one_of_the_reference() -> None:
    driver = HokuyoDriver(HokuyoParameters(calibrate_time=False))
    driver.start(0.0)
    said = script_of(driver)
    assert said == ["SCIP2.0", "TM2", "QT", "RS", "PP", "VV", "II", "BM", "MD0044072501000"]
    assert driver.phase is DriverPhase.MEASURING


def test_a_sensor_without_intensities_measures_distances() -> None:
    problems: list[str] = []
    driver = HokuyoDriver(HokuyoParameters(calibrate_time=False, intensity=True), problems.append)
    driver.start(0.0)
    said = script_of(driver, refused=("ME",))
    assert said[-2:] == ["ME0044004401001", "MD0044072501000"]
    assert driver.phase is DriverPhase.MEASURING
    assert problems == ["this sensor measures no intensities: they are left out"]


@pytest.mark.parametrize(("firmware", "last"), [("1", 380), ("1.16.01(16/Nov./2009)", 760)])
def test_intensities_of_a_utm_are_kept_safe(firmware: str, last: int) -> None:
    geometry = SensorGeometry(23, 60000, 1440, 0, 1080, 540, 2400)
    version = VERSION | {"PROD": "SOKUIKI Sensor TOP-URG UTM-30LX", "FIRM": firmware}
    sensor = Sensor(version, {}, geometry, {})
    wide = HokuyoParameters(intensity=True, min_ang=-3.0, max_ang=3.0)
    measurement, warnings = plan_measurement(wide, sensor)
    assert (measurement.command, len(warnings)) == (f"ME0000{last:04d}01000", 1)
    wide = HokuyoParameters(intensity=True, min_ang=-3.0, max_ang=3.0, allow_unsafe_settings=True)
    assert plan_measurement(wide, sensor)[0].last_step == 1080
    plain, warnings = plan_measurement(HokuyoParameters(min_ang=-3.0, max_ang=3.0), sensor)
    assert (plain.command, warnings) == ("MD0000108001000", ())


def test_answers_to_other_questions_do_not_lead_on() -> None:
    driver = HokuyoDriver(HokuyoParameters())
    driver.start(0.0)
    driver.poll(0.0)
    driver.receive(b"QT\n00P\n\nRS\n00P\n\n", 0.1)
    assert driver.poll(0.1) == b""
    driver.receive(b"SCIP2.0\n0Ee\n\n", 0.1)
    assert driver.poll(0.1) == b"TM2\n"


def test_a_refused_command_is_tried_again_and_then_explained() -> None:
    problems: list[str] = []
    driver = HokuyoDriver(HokuyoParameters(), problems.append)
    driver.start(0.0)
    driver.receive(b"SCIP2.0\n00P\n\nTM2\n03S\n\n", 0.0)
    assert driver.poll(0.0) == b"SCIP2.0\nTM2\nQT\n"
    for now in (0.5, 1.5, 2.5):
        driver.receive(b"QT\n0Ee\n\n", now)
        driver.poll(now + 0.5)
    assert driver.phase is DriverPhase.RESTING
    assert problems == [
        "'QT' was refused with status '0E': the command is unknown or not allowed now (time adjustment mode)"
    ]


def test_shutdown_quits_and_stays_quiet() -> None:
    driver = HokuyoDriver(HokuyoParameters())
    driver.start(0.0)
    assert driver.shutdown() == b"QT\n"
    assert driver.next_deadline() is None
    assert driver.poll(100.0) == b""
    assert driver.receive(b"SCIP2.0\n00P\n\n", 1.0) == []
    assert driver.poll(100.0) == b""


def test_a_lost_port_stops_everything_until_the_next_start() -> None:
    driver = HokuyoDriver(HokuyoParameters())
    driver.start(0.0)
    driver.disconnected("the plug was pulled")
    assert driver.phase is DriverPhase.STOPPED
    assert driver.problem == "the plug was pulled"
    assert driver.poll(100.0) == b""
    driver.start(101.0)
    assert driver.poll(101.0) == b"SCIP2.0\n"


def test_frequency() -> None:
    meter = FrequencyMeter()
    assert meter.rate(0.0) == 0.0
    for count in range(50):
        meter.tick(count * 0.1)
    assert meter.rate(4.95) == pytest.approx(10.0)
    assert meter.rate(6.0) < 8.0
    assert meter.rate(20.0) == 0.0
    meter.tick(20.0)
    meter.tick(20.0)
    assert meter.rate(20.0) == 0.0


def test_diagnosis_of_a_scanner_without_a_port() -> None:
    parameters = HokuyoParameters(time_offset=0.1)
    found = diagnose(HokuyoDriver(parameters), parameters, "/dev/ttyACM0", "no such port", 0.0)
    assert (found.level, found.message) == (Severity.ERROR, "no such port")
    assert found.values["User Time Offset"] == "0.1000"
    assert found.values["Computed Latency"] == "0.0000"


def test_diagnosis_of_a_scanner_that_starts() -> None:
    parameters = HokuyoParameters()
    driver = HokuyoDriver(parameters)
    driver.start(0.0)
    found = diagnose(driver, parameters, "/dev/ttyACM0", "", 0.0)
    assert (found.level, found.message) == (Severity.WARN, "the driver is starting")
    assert found.values["Device ID"] == "unknown"


def test_the_frequency_window() -> None:
    assert not is_off(9.6, 10.0)
    assert not is_off(10.4, 10.0)
    assert is_off(9.4, 10.0)
    assert is_off(10.6, 10.0)


@pytest.mark.parametrize(
    ("how", "rate"),
    [
        ({"port": "/dev/ttyUSB0"}, 115200),
        ({"port": "/dev/ttyUSB0", "baud_rate": 19200}, 19200),
        ({"port": "/dev/ttyUSB0", "baud_rate": 230400}, None),  # no sensor knows it
        ({"port": "/dev/ttyACM0"}, None),
        ({"ip_address": "192.168.0.10"}, None),
    ],
)
def test_which_lines_have_a_speed(how: dict[str, object], rate: int | None) -> None:
    assert HokuyoPortParameters(**how).line_rate == rate  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("wanted", "last", "misses", "rates"),
    [
        (None, None, 0, ()),
        (None, None, 7, ()),
        (115200, None, 0, (115200, 19200, 38400, 57600)),
        (19200, None, 3, (19200, 115200, 38400, 57600)),
        (750000, None, 0, (750000, 19200, 115200, 38400, 57600)),
        (115200, 115200, 0, (115200, 19200)),
        (115200, 115200, 1, (115200, 19200, 38400)),
        (115200, 115200, 2, (115200, 19200, 57600)),
        (115200, 115200, 3, (115200, 19200, 38400)),
        (115200, 19200, 0, (19200,)),
        (115200, 19200, 1, (19200, 115200)),
        (750000, 750000, 1, (750000, 19200, 115200)),
    ],
)
def test_where_a_sensor_is_looked_for(
    wanted: int | None, last: int | None, misses: int, rates: tuple[int, ...]
) -> None:
    assert rates_to_try(wanted, last, misses) == rates


@pytest.mark.parametrize(
    "name", ["check_timeout_s", "silence_timeout_s", "restart_delay_s", "reply_timeout_s"]
)
def test_a_time_that_makes_no_sense_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match=f"{name} is 0.0"):
        HokuyoParameters(**{name: 0.0})  # type: ignore[arg-type]
