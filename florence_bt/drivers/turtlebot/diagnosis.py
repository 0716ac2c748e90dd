"""The diagnostics of the base: the eight lines of REFERENCE 2.7."""

from __future__ import annotations

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.drivers.turtlebot.battery import battery_of
from florence_bt.drivers.turtlebot.codec.packets import ChargingState, OiMode
from florence_bt.drivers.turtlebot.codec.state import SensorState
from florence_bt.drivers.turtlebot.driver import BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.gyro import Gyro
from florence_bt.drivers.turtlebot.hazards import StopReason

CHARGING_SOURCES = {0: "None", 1: "Internal Charger", 2: "Base Dock"}
CHARGING_STATES = ("Not Charging", "Reconditioning", "Full Charging", "Trickle Charging", "Waiting", "Fault")
LOW_CHARGE = 0.15
"""Fraction of the capacity; the old node let a base charge below it (REFERENCE 2.4, row 7)."""

GYRO_UNPOWERED = 100
"""Counts at rest below which a gyro has no power (REFERENCE 1.8)."""
GYRO_PLAUSIBLE = (425, 575)
"""Counts at rest of a gyro that is well (REFERENCE 1.8)."""

DROPS_FRACTIONS = (
    "the base counts less way than it was commanded: its firmware drops fractions of a millimetre and of a "
    "degree at each reading; the odometry goes by the commands within what was counted"
)

REFUSED = "the base counted more way than it can drive: that was left out of the odometry"
REFUSED_S = 60.0
"""Time for which a refused reading is told."""

_OF_A_READING = ("Operating Mode", "Battery", "Charging Sources", "Cliff Sensor", "Wall Sensor")


def diagnose(
    driver: TurtlebotDriver, reading: BaseReading | None, port: str, port_problem: str
) -> dict[str, Diagnosis]:
    """Judge the base.

    Args:
        driver: The driver.
        reading: The newest reading; None when there is none on this connection.
        port: The serial device.
        port_problem: Why the base is not connected; empty when it is.

    Returns:
        Diagnoses by their names, the same names at any time.
    """
    found = {"TurtleBot Node": _connection(driver, reading, port, port_problem)}
    if reading is None:
        silent = Diagnosis(Severity.STALE, "no data from the base")
        return found | dict.fromkeys((*_OF_A_READING, "Gyro Sensor", "Digital Outputs"), silent)
    state = reading.state
    return found | {
        "Operating Mode": _operating_mode(driver, reading),
        "Battery": _battery(state),
        "Charging Sources": _charging_sources(state),
        "Cliff Sensor": _cliffs(state),
        "Wall Sensor": _wall(state),
        "Gyro Sensor": _gyro(driver, reading),
        "Digital Outputs": _digital_outputs(state.user_digital_outputs),
    }


def _connection(
    driver: TurtlebotDriver, reading: BaseReading | None, port: str, port_problem: str
) -> Diagnosis:
    form = driver.decoder.checksum_form
    values = {
        "Port": port,
        "Model": driver.parameters.model.name,
        "Good Frames": str(driver.decoder.good_frames),
        "Bad Frames": str(driver.decoder.bad_frames),
        "Noise Bytes": str(driver.decoder.noise_bytes),
        "Checksum Form": "unknown" if form is None else form.name.lower().replace("_", " "),
        "Refused Readings": str(driver.refused_readings),
        "Refused Commands": str(driver.refused_commands),
        "Late Commands": str(driver.late_commands),
        "Charge Resets": str(driver.charge_resets),
        "Fractions Of Counts": "dropped" if driver.fractions.drops else "kept",
    }
    if port_problem:
        return Diagnosis(Severity.ERROR, port_problem, values)
    if driver.starting or reading is None:
        return Diagnosis(Severity.WARN, "STARTING", values)
    if reading.stop_reason is StopReason.NO_RESPONSE:
        return Diagnosis(Severity.ERROR, StopReason.NO_RESPONSE.value, values)
    if driver.implausible:
        said = ", ".join(f"{name} {count}" for name, count in driver.implausible.items())
        return Diagnosis(Severity.WARN, f"the base says what its manual does not know: {said}", values)
    if reading.stamp - driver.refused_at < REFUSED_S:
        return Diagnosis(Severity.WARN, REFUSED, values)
    if damage := driver.line.complaint(reading.stamp):
        return Diagnosis(Severity.WARN, damage, values)
    if driver.fractions.drops:
        return Diagnosis(Severity.WARN, DROPS_FRACTIONS, values)
    return Diagnosis(Severity.OK, "RUNNING", values)


def _operating_mode(driver: TurtlebotDriver, reading: BaseReading) -> Diagnosis:
    code = reading.state.oi_mode
    known = code in (OiMode.PASSIVE, OiMode.SAFE, OiMode.FULL)
    name = OiMode(code).name.capitalize() if known else f"unknown mode {code}"
    values = {"Mode": name, "Wanted Mode": driver.wanted_mode.name.capitalize()}
    if not known:
        return Diagnosis(Severity.ERROR, name, values)
    if reading.stop_reason is not None:
        return Diagnosis(Severity.WARN, f"{name}: {reading.stop_text}", values)
    return Diagnosis(Severity.OK, name, values)


def _battery(state: SensorState) -> Diagnosis:
    values = {
        "Voltage (V)": f"{state.voltage / 1000:.3f}",
        "Current (A)": f"{state.current / 1000:.3f}",
        "Temperature (C)": str(state.temperature),
        "Charge (Ah)": f"{state.charge / 1000:.3f}",
        "Capacity (Ah)": f"{state.capacity / 1000:.3f}",
    }
    if state.charging_state == ChargingState.FAULT:
        return Diagnosis(Severity.ERROR, "charging fault: clean the contacts, or change the battery", values)
    battery = battery_of(state)
    if battery.doubts:
        return Diagnosis(Severity.WARN, f"not known: {'; '.join(battery.doubts)}", values)
    if state.current <= 0 and battery.is_below(LOW_CHARGE):
        return Diagnosis(Severity.WARN, "the battery is low: bring the base to its charger", values)
    return Diagnosis(Severity.OK, "OK", values)


def _charging_sources(state: SensorState) -> Diagnosis:
    sources, charging = state.charging_sources_available, state.charging_state
    known = charging < len(CHARGING_STATES)
    values = {"Charging State": CHARGING_STATES[charging] if known else f"unknown state {charging}"}
    if sources in CHARGING_SOURCES:
        return Diagnosis(Severity.OK, CHARGING_SOURCES[sources], values)
    what = "Internal Charger and Base Dock at once" if sources == 3 else f"unknown sources {sources}"
    return Diagnosis(Severity.ERROR, what, values)


def _cliffs(state: SensorState) -> Diagnosis:
    values = {}
    for place in ("left", "front_left", "front_right", "right"):
        label = place.replace("_", " ").title()
        values[label] = str(getattr(state, f"cliff_{place}"))
        values[f"{label} Signal"] = str(getattr(state, f"cliff_{place}_signal"))
    if not state.cliff:
        return Diagnosis(Severity.OK, "OK", values)
    if state.current > 0:
        return Diagnosis(Severity.OK, "near a cliff; while charging that is the plate of the dock", values)
    return Diagnosis(Severity.WARN, "near a cliff", values)


def _wall(state: SensorState) -> Diagnosis:
    values = {
        "Wall": str(state.wall),
        "Wall Signal": str(state.wall_signal),
        "Virtual Wall": str(state.virtual_wall),
    }
    return (
        Diagnosis(Severity.ERROR, "a wall to the right", values)
        if state.wall
        else Diagnosis(Severity.OK, "OK", values)
    )


def _gyro(driver: TurtlebotDriver, reading: BaseReading) -> Diagnosis:
    gyro = driver.gyro
    values = {"Gyro Enabled": str(gyro is not None)}
    if gyro is None:
        if not driver.parameters.model.cargo_bay:
            return Diagnosis(Severity.OK, "this base has no input for a gyro", values)
        return Diagnosis(Severity.WARN, "the gyro is disabled: set has_gyro, or the heading drifts", values)
    offset = gyro.offset
    values |= {
        "Raw Gyro Rate": str(gyro.adc),
        "Calibration Offset": "none yet" if offset is None else f"{offset:.2f}",
        "Calibration Buffer": str(gyro.rest_samples),
    }
    if reading.stop_reason is StopReason.GYRO:
        return Diagnosis(Severity.ERROR, StopReason.GYRO.value, values)
    return Diagnosis(*_judge_offset(gyro), values)


def _judge_offset(gyro: Gyro) -> tuple[Severity, str]:
    offset = gyro.offset
    if offset is None and not gyro.adc:
        return (
            Severity.ERROR,
            "the gyro gives no signal: check its power and the wire to the analog pin",
        )
    if offset is None:
        return Severity.WARN, "the gyro waits to be calibrated: let the base stand still for a second"
    if offset < GYRO_UNPOWERED:
        return Severity.ERROR, "the gyro has no power: check the wires; the heading comes from the wheels"
    if not GYRO_PLAUSIBLE[0] <= offset <= GYRO_PLAUSIBLE[1]:
        return Severity.ERROR, "the gyro's offset is bad: let the base stand still, or check the gyro"
    return Severity.OK, "OK"


def _digital_outputs(bits: int) -> Diagnosis:
    values = {"Raw Byte": str(bits)}
    for place in (2, 1, 0):
        values[f"Digital Out {place}"] = "ON" if bits >> place & 1 else "OFF"
    return Diagnosis(Severity.OK, "OK", values)
