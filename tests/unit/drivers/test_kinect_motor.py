"""Motor, light and accelerometer: bytes of the reference, and the emulated USB device."""

import math
import struct
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.clock import ManualClock
from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import ConfigError, DeviceLost, FrameError
from florence_bt.drivers.kinect.motor.codec import (
    MotorRequest,
    MotorState,
    TiltStatus,
    decode_state,
    led_request,
    tilt_request,
)
from florence_bt.drivers.kinect.motor.driver import MotorParameters, diagnose, tilt_warning
from florence_bt.drivers.kinect.motor.usb_motor import UsbMotor
from florence_bt.simulation.emulators.kinect_motor import KinectMotorBackend


@pytest.mark.parametrize(
    ("degrees", "value"),
    [
        (0.0, 0),
        (10.0, 20),
        (31.0, 62),
        (-31.0, 0xFFC2),
        (-0.5, 0xFFFF),
        (90.0, 62),
        (-90.0, 0xFFC2),
        (5.2, 10),
    ],
)
def test_tilt_on_the_wire(degrees: float, value: int) -> None:
    assert tilt_request(degrees) == MotorRequest(0x31, value)


@pytest.mark.parametrize("degrees", [math.nan, math.inf, -math.inf])
def test_no_number_never_moves_the_head(degrees: float) -> None:
    with pytest.raises(ConfigError, match=r"-31\.\.31"):
        tilt_request(degrees)


def test_light_on_the_wire() -> None:
    assert [led_request(option) for option in range(8)] == [MotorRequest(0x06, option) for option in range(8)]
    for option in (-1, 8, 65535):
        with pytest.raises(ConfigError, match=r"0\.\.7"):
            led_request(option)


def test_the_state_of_the_reference() -> None:
    state = decode_state(bytes([0, 0, 0xFF, 0xFF, 0x03, 0x33, 0x01, 0x00, 0xF6, 4]))
    assert state == MotorState((-1, 819, 256), -10, TiltStatus.MOVING)
    assert state.tilt_deg == -5.0
    assert state.acceleration[1] == pytest.approx(9.80665)
    assert decode_state(bytes(8) + b"\x80\x04").tilt_deg is None


@given(st.binary(max_size=20))
def test_any_bytes(data: bytes) -> None:
    if len(data) == 10:
        assert decode_state(data).counts == struct.unpack(">hhh", data[2:8])
    else:
        with pytest.raises(FrameError, match="10"):
            decode_state(data)


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(100.0)


@pytest.fixture
def bus(clock: ManualClock) -> KinectMotorBackend:
    return KinectMotorBackend(clock.now)


def test_the_head_moves_and_arrives(bus: KinectMotorBackend, clock: ManualClock) -> None:
    motor = UsbMotor(backend=bus)
    motor.send(tilt_request(-20.0))
    state = motor.read(0.0)
    assert (state.status, state.tilt_deg) == (TiltStatus.MOVING, None)
    clock.advance_to(101.0)
    bus.faults.silent_while_moving = False
    assert motor.read(0.0).tilt_deg == -15.0
    clock.advance_to(103.0)
    state = motor.read(0.0)
    assert (state.status, state.tilt_deg) == (TiltStatus.STOPPED, -20.0)
    assert math.hypot(*state.acceleration) == pytest.approx(9.80665, rel=0.002)
    motor.send(tilt_request(45.0))
    motor.read(0.0)
    clock.advance_to(110.0)
    assert motor.read(0.0).status == TiltStatus.LIMIT
    assert bus.requests[0] == (0xC0, 0x10, 0)
    assert (0x40, 0x31, 0xFFD8) in bus.requests and (0x40, 0x31, 62) in bus.requests


def test_the_light(bus: KinectMotorBackend) -> None:
    motor = UsbMotor(backend=bus)
    motor.send(led_request(3))
    motor.send(led_request(6))
    motor.read(0.0)
    assert bus.led == 3
    motor.read(0.0)
    assert bus.led == 6


def test_unplug_and_replug(bus: KinectMotorBackend) -> None:
    motor = UsbMotor(backend=bus)
    bus.faults.unplugged = True
    with pytest.raises(DeviceLost, match="went away"):
        motor.read(0.0)
    motor.close()
    motor.close()
    with pytest.raises(DeviceLost, match="closed"):
        motor.read(0.0)
    with pytest.raises(DeviceLost, match=r"045e:02b0; found 0.*12 V"):
        UsbMotor(backend=bus)
    bus.faults.unplugged = False
    assert UsbMotor(backend=bus).read(0.0).counts == (0, 819, 0)


def test_what_is_wrong_is_said(bus: KinectMotorBackend) -> None:
    bus.faults.forbidden = True
    with pytest.raises(DeviceLost, match=r"99-florence\.rules"):
        UsbMotor(backend=bus)
    bus.faults.forbidden = False
    with pytest.raises(DeviceLost, match="Kinect 1"):
        UsbMotor(1, backend=bus)
    bus.faults.init_answer = 0
    with pytest.raises(DeviceLost, match="answered 00"):
        UsbMotor(backend=bus)
    bus.faults.init_answer = 0x22
    motor = UsbMotor(backend=bus)
    bus.faults.short = 7
    with pytest.raises(DeviceLost, match="7 bytes"):
        motor.read(0.0)


@pytest.mark.parametrize("camera", [0x02AE, 0x02BF])
def test_models_without_a_motor_of_their_own(bus: KinectMotorBackend, camera: int) -> None:
    bus.faults.products = (camera, 0x02AD)
    with pytest.raises(DeviceLost, match=r"1473.*audio"):
        UsbMotor(backend=bus)


def test_no_pyusb_names_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "usb.core", None)
    with pytest.raises(DeviceLost, match=r"pip install pyusb.*python3-usb"):
        UsbMotor()


def test_warnings_about_angles() -> None:
    assert tilt_warning(27.0) == tilt_warning(-27.0) == ""
    assert "recommends" in tilt_warning(-28.0)
    assert "31" in tilt_warning(40.0)


def test_diagnosis() -> None:
    rest = MotorState((0, 819, 0), 4, TiltStatus.STOPPED)
    assert diagnose(rest, "", 0).level is Severity.OK
    assert diagnose(rest, "", 0).values["Tilt"] == "2 degrees"
    assert diagnose(None, "", 0).level is Severity.WARN
    assert diagnose(rest, "gone", 1).level is Severity.ERROR
    assert diagnose(MotorState((0, 0, 0), 62, TiltStatus.LIMIT), "", 0).level is Severity.WARN
    assert "9" in diagnose(MotorState((0, 0, 0), None, 9), "", 0).values["Status"]


@pytest.mark.parametrize(
    "wrong", [{"device_index": -1}, {"device_index": 99}, {"reconnect_delay_s": 0.0}], ids=str
)
def test_wrong_parameters(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError):
        MotorParameters(**wrong)  # type: ignore[arg-type]
