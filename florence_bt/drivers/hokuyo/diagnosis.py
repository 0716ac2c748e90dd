"""What the diagnostics say about the scanner. Source: REFERENCE 4.9."""

from __future__ import annotations

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
    status, rate = driver.status, driver.rate(now)
    values = {
        "Device Status": status.device_status,
        "Port": port,
        "Device ID": status.device.get("SERI", "unknown"),
        "Vendor Name": status.device.get("VEND", "unknown"),
        "Product Name": status.device.get("PROD", "unknown"),
        "Firmware Version": status.device.get("FIRM", "unknown"),
        "Protocol Version": status.device.get("PROT", "unknown"),
        "Scan Thread Lost Count": str(status.lost),
        "Failures In A Row": str(status.failures),
        "Last Rest Before A Start": f"{status.pause_s:g}",
        "Corrupted Scan Count": str(status.corrupted),
        "Scans": str(status.scans),
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
    if status.phase is not DriverPhase.MEASURING:
        level = Severity.ERROR if status.problem else Severity.WARN
        return Diagnosis(level, status.problem or f"the driver is {status.phase.value}", values)
    if status.problem:
        # What a new start did not cure is worse than a check that is new.
        return Diagnosis(Severity.ERROR if status.failures else Severity.WARN, status.problem, values)
    if is_off(rate, driver.expected_rate):
        return Diagnosis(
            Severity.WARN, f"{rate:.1f} scans a second instead of {driver.expected_rate:.1f}", values
        )
    return Diagnosis(Severity.OK, "measuring", values)
