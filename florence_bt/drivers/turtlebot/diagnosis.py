"""What the diagnostics say about the base (REFERENCE 2.7)."""

from __future__ import annotations

from florence_bt.drivers.diagnosis import Diagnosis, Level
from florence_bt.drivers.turtlebot.codec.packets import ChargingState, OiMode
from florence_bt.drivers.turtlebot.driver import Reading, TurtlebotDriver


def diagnose(
    driver: TurtlebotDriver, reading: Reading | None, port: str, port_problem: str
) -> dict[str, Diagnosis]:
    """Judge the base.

    Args:
        driver: The driver.
        reading: The newest reading; None when there is none on this connection.
        port: The serial device.
        port_problem: Why the base is not connected; empty when it is.

    Returns:
        Diagnoses by their names.
    """
    found = {"TurtleBot Node": _connection(driver, reading, port, port_problem)}
    if reading is None:
        silent = Diagnosis(Level.STALE, "no data from the base")
        return found | {"Operating Mode": silent, "Battery": silent}
    return found | {"Operating Mode": _operating_mode(driver, reading), "Battery": _battery(reading)}


def _connection(driver: TurtlebotDriver, reading: Reading | None, port: str, port_problem: str) -> Diagnosis:
    form = driver.decoder.checksum_form
    values = {
        "Port": port,
        "Good Frames": str(driver.decoder.good_frames),
        "Bad Frames": str(driver.decoder.bad_frames),
        "Noise Bytes": str(driver.decoder.noise_bytes),
        "Checksum Form": "unknown" if form is None else form.name.lower().replace("_", " "),
        "Refused Readings": str(driver.refused_readings),
        "Refused Commands": str(driver.refused_commands),
    }
    if port_problem:
        return Diagnosis(Level.ERROR, port_problem, values)
    if driver.starting or reading is None:
        return Diagnosis(Level.WARN, "STARTING", values)
    return Diagnosis(Level.OK, "RUNNING", values)


def _operating_mode(driver: TurtlebotDriver, reading: Reading) -> Diagnosis:
    code = reading.state.oi_mode
    known = code in (OiMode.PASSIVE, OiMode.SAFE, OiMode.FULL)
    name = OiMode(code).name.capitalize() if known else f"unknown mode {code}"
    values = {"Mode": name, "Wanted Mode": driver.wanted_mode.name.capitalize()}
    if not known:
        return Diagnosis(Level.ERROR, name, values)
    if reading.stop_reason is not None:
        return Diagnosis(Level.WARN, f"{name}: {reading.stop_reason.value}", values)
    return Diagnosis(Level.OK, name, values)


def _battery(reading: Reading) -> Diagnosis:
    state = reading.state
    values = {
        "Voltage (V)": f"{state.voltage / 1000:.3f}",
        "Current (A)": f"{state.current / 1000:.3f}",
        "Temperature (C)": str(state.temperature),
        "Charge (Ah)": f"{state.charge / 1000:.3f}",
        "Capacity (Ah)": f"{state.capacity / 1000:.3f}",
    }
    if state.charging_state == ChargingState.FAULT:
        return Diagnosis(Level.ERROR, "charging fault: clean the contacts, or change the battery", values)
    return Diagnosis(Level.OK, "OK", values)
