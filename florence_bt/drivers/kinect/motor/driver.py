"""Decisions of the motor's node, without USB and ROS: limits, warnings, diagnosis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.limits import CheckedParameters, Limits
from florence_bt.drivers.kinect.motor.codec import (
    RECOMMENDED_TILT_DEG,
    TILT_LIMIT_DEG,
    MotorState,
    TiltStatus,
)

MOST_DEVICES = 16
"""Kinects that can be told apart by their index. Chosen."""
STATUS_NAMES: dict[int, str] = {
    TiltStatus.STOPPED: "stopped",
    TiltStatus.LIMIT: "at the limit",
    TiltStatus.MOVING: "moving",
}


@dataclass(frozen=True, slots=True)
class MotorParameters(CheckedParameters):
    """The parameters of the motor's node.

    Attributes:
        device_index: Which Kinect, from 0.
        frame_id: Frame of the accelerations: the device's own axes, y up when it is level.
        reconnect_delay_s: Seconds before the device is opened again; doubled each time, up to ten times.
    """

    device_index: Annotated[int, Limits(0, MOST_DEVICES - 1)] = 0
    frame_id: str = "camera_accelerometer_frame"
    reconnect_delay_s: Annotated[float, Limits(0.05, 60.0)] = 0.5


def tilt_warning(degrees: float) -> str:
    """Return what to say about a wanted angle; empty when nothing."""
    if abs(degrees) > TILT_LIMIT_DEG:
        return f"the Kinect tilts by {TILT_LIMIT_DEG:g} degrees at most, not by {degrees:g}"
    if abs(degrees) > RECOMMENDED_TILT_DEG:
        return f"{degrees:g} degrees is beyond the {RECOMMENDED_TILT_DEG:g} that the maker recommends"
    return ""


def diagnose(state: MotorState | None, problem: str, lost: int) -> Diagnosis:
    """Report how the motor does.

    Args:
        state: What it said last, None before that.
        problem: Why there is none; empty when there is one.
        lost: How often it was lost.
    """
    values = {"Times Lost": str(lost)}
    if problem:
        return Diagnosis(Severity.ERROR, problem, values)
    if state is None:
        return Diagnosis(Severity.WARN, "the Kinect's motor has not answered yet", values)
    values["Tilt"] = "unknown" if state.tilt_deg is None else f"{state.tilt_deg:g} degrees"
    values["Status"] = STATUS_NAMES.get(state.status, f"unknown ({state.status})")
    if state.status == TiltStatus.LIMIT:
        return Diagnosis(Severity.WARN, "the Kinect's motor is at its limit", values)
    return Diagnosis(Severity.OK, "the Kinect's motor answers", values)
