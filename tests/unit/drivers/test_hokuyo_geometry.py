import math

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.drivers.hokuyo.geometry import URG_04LX, SensorGeometry, scan_from_distances
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters, HokuyoPortParameters

FIELDS = {
    "MODL": "URG-04LX(Hokuyo Automatic Co.,Ltd.)",
    "DMIN": "20",
    "DMAX": "5600",
    "ARES": "1024",
    "AMIN": "44",
    "AMAX": "725",
    "AFRT": "384",
    "SCAN": "600",
}
UTM_30LX = SensorGeometry(23, 60000, 1440, 0, 1080, 540, 2400)


def test_the_pp_reply_gives_the_urg() -> None:
    assert SensorGeometry.from_information(FIELDS) == URG_04LX


@pytest.mark.parametrize(
    "change",
    [
        {"AMIN": ""},
        {"SCAN": "fast"},
        {"ARES": "0"},
        {"SCAN": "0"},
        {"AFRT": "800"},
        {"DMIN": "6000"},
        {"AMAX": "-1"},
        {"AMAX": "10000"},
    ],
)
def test_a_broken_pp_reply_is_refused(change: dict[str, str]) -> None:
    with pytest.raises(FrameError):
        SensorGeometry.from_information(FIELDS | change)


def test_a_missing_field_is_named() -> None:
    with pytest.raises(FrameError, match="AFRT"):
        SensorGeometry.from_information({tag: value for tag, value in FIELDS.items() if tag != "AFRT"})


def test_reference_angles() -> None:
    assert URG_04LX.step_angle == pytest.approx(0.00613592, abs=1e-8)
    assert URG_04LX.angle_of(44) == pytest.approx(-2.086214, abs=1e-6)
    assert URG_04LX.angle_of(725) == pytest.approx(2.092350, abs=1e-6)
    assert URG_04LX.angle_of(384) == 0.0
    assert URG_04LX.time_increment == pytest.approx(9.765625e-5)
    assert URG_04LX.scan_period == pytest.approx(0.1)
    assert UTM_30LX.angle_of(0) == pytest.approx(-2.356194, abs=1e-6)
    assert UTM_30LX.time_increment == pytest.approx(1.736e-5, abs=1e-8)


def test_steps_and_angles_are_inverse() -> None:
    assert [URG_04LX.step_at(URG_04LX.angle_of(step)) for step in range(44, 726)] == list(range(44, 726))


def test_windows() -> None:
    assert (URG_04LX.step_at(-math.pi / 2), URG_04LX.step_at(math.pi / 2)) == (128, 640)
    assert (URG_04LX.step_at(-2.086214), URG_04LX.step_at(2.092350)) == (44, 725)
    assert (URG_04LX.step_at(-math.pi), URG_04LX.step_at(math.pi)) == (44, 725)


def test_the_scan_of_the_full_window() -> None:
    scan = scan_from_distances(np.full(682, 1500, np.int32), 44, 1, URG_04LX, 12.5, "laser")
    assert scan.stamp == 12.5
    assert scan.frame_id == "laser"
    assert scan.angle_min == pytest.approx(-2.086214, abs=1e-6)
    assert scan.angle_max == pytest.approx(2.092350, abs=1e-6)
    assert scan.range_min == pytest.approx(0.02)
    assert scan.range_max == pytest.approx(5.6)
    assert scan.scan_time == pytest.approx(0.1)
    assert scan.time_increment == pytest.approx(9.765625e-5)
    assert scan.ranges.dtype == np.float32
    np.testing.assert_allclose(scan.ranges, 1.5)
    assert len(scan.intensities) == 0


def test_clusters_and_skips() -> None:
    scan = scan_from_distances(np.zeros(228, np.int32), 44, 3, URG_04LX, 0.0, "laser", skip=2)
    assert scan.angle_increment == pytest.approx(3 * URG_04LX.step_angle)
    assert scan.time_increment == pytest.approx(3 * URG_04LX.time_increment)
    assert scan.scan_time == pytest.approx(0.3)
    zero = scan_from_distances(np.zeros(5, np.int32), 44, 0, URG_04LX, 0.0, "laser")
    assert zero.angle_increment == URG_04LX.step_angle


def test_error_codes_pass_through_below_range_min() -> None:
    scan = scan_from_distances(np.array([0, 6, 19, 20, 5599, 5600], np.int32), 44, 1, URG_04LX, 0.0, "laser")
    np.testing.assert_allclose(scan.ranges, [0.0, 0.006, 0.019, 0.02, 5.599, 5.6])
    assert scan.valid().tolist() == [False, False, False, True, True, False]


@pytest.mark.parametrize(
    "wrong",
    [
        {"min_ang": 1.0, "max_ang": 0.5},
        {"min_ang": -4.0},
        {"max_ang": math.nan},
        {"cluster": 100},
        {"skip": -1},
        {"skip": 10},
        {"time_offset": 0.3},
        {"latency_s": -0.1},
        {"reply_timeout_s": 0.0},
        {"silence_timeout_s": math.inf},
    ],
)
def test_wrong_parameters_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError):
        HokuyoParameters(**wrong)  # type: ignore[arg-type]


def test_wrong_port_parameters_are_refused() -> None:
    with pytest.raises(ConfigError, match="baud_rate"):
        HokuyoPortParameters(baud_rate=5)


@pytest.mark.parametrize(
    "wrong",
    [
        {"ARES": "0"},
        {"ARES": "1"},
        {"ARES": "700", "AMIN": "0"},
        {"ARES": "999999999"},
        {"AMAX": "9999"},
        {"SCAN": "0"},
        {"SCAN": "1"},
        {"SCAN": "99999999"},
        {"DMAX": "99999999"},
        {"DMAX": "20"},
        {"AFRT": "-1"},
        {"AMIN": "x"},
    ],
)
def test_numbers_of_a_sensor_that_cannot_be_are_refused(wrong: dict[str, str]) -> None:
    """A step angle of nothing, or beams more than once round, would make a map of nonsense."""
    good = {"DMIN": "20", "DMAX": "5600", "ARES": "1024", "AMIN": "44", "AMAX": "725", "AFRT": "384"}
    assert SensorGeometry.from_information({**good, "SCAN": "600"}) == URG_04LX
    with pytest.raises(FrameError, match=next(iter(wrong)) + "|cannot be right"):
        SensorGeometry.from_information({**good, "SCAN": "600", **wrong})
