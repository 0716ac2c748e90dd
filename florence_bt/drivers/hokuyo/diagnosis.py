"""The lines of the diagnostics about the scanner. Source: REFERENCE 4.9."""

from __future__ import annotations

from collections.abc import Mapping

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.drivers.diagnosis import is_off
from florence_bt.drivers.hokuyo.driver import DriverPhase, HokuyoDriver
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters


def diagnose(
    driver: HokuyoDriver, parameters: HokuyoParameters, port: str, port_problem: str, now: float
) -> Diagnosis:
    """Judge the scanner.

    Args:
        driver: The driver.
        parameters: How it is to measure.
        port: The serial device, or the address on the network.
        port_problem: Why the port is not open; empty when it is.
        now: The time.
    """
    rate, sensor, failures = driver.rate(now), driver.sensor, driver.retry.failures
    device: Mapping[str, str] = {} if sensor is None else sensor.version
    values = {
        "Device Status": "unknown" if sensor is None else sensor.stat,
        "Port": port,
        "Device ID": device.get("SERI", "unknown"),
        "Vendor Name": device.get("VEND", "unknown"),
        "Product Name": device.get("PROD", "unknown"),
        "Firmware Version": device.get("FIRM", "unknown"),
        "Protocol Version": device.get("PROT", "unknown"),
        "Scan Thread Lost Count": str(driver.lost),
        "Failures In A Row": str(failures),
        "Last Rest Before A Start": f"{driver.retry.pause_s:g}",
        "Corrupted Scan Count": str(driver.corrupted),
        "Scans": str(driver.scans),
        "Frequency": f"{rate:.2f}",
        "Expected Frequency": f"{driver.expected_rate:.2f}",
        "Computed Latency": f"{driver.latency:.4f}",
        "Latency Measured": "yes" if driver.calibrated else "no",
        "Last Scan Late": f"{driver.late_s:.4f}",
        "Beams Without Range": driver.beams_without_range() or "unknown",
        "Measurement": "none" if driver.measurement is None else driver.measurement.command,
        "User Time Offset": f"{parameters.time_offset:.4f}",
    }
    if port_problem:
        return Diagnosis(Severity.ERROR, port_problem, values)
    if driver.phase is not DriverPhase.MEASURING:
        level = Severity.ERROR if driver.problem else Severity.WARN
        return Diagnosis(level, driver.problem or f"the driver is {driver.phase.value}", values)
    if driver.problem:
        # What a new start did not cure is worse than a check that is new.
        return Diagnosis(Severity.ERROR if failures else Severity.WARN, driver.problem, values)
    if damage := driver.line.complaint(now):
        return Diagnosis(Severity.WARN, damage, values)
    if is_off(rate, driver.expected_rate):
        return Diagnosis(
            Severity.WARN, f"{rate:.1f} scans a second instead of {driver.expected_rate:.1f}", values
        )
    if driver.blind:
        return Diagnosis(
            Severity.WARN,
            f"no beam has a distance ({driver.beams_without_range()}): is the laser covered, or its window "
            "dirty?",
            values,
        )
    if sensor is not None and sensor.warnings:
        return Diagnosis(Severity.WARN, "; ".join(sensor.warnings), values)
    return Diagnosis(Severity.OK, "measuring", values)
