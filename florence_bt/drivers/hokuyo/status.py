"""Meanings of the two status characters of a reply. Source: REFERENCE 4.6, 4.7."""

from __future__ import annotations

from florence_bt.drivers.hokuyo.codec import KINDS

ACCEPTED = "00"
SCAN_FOLLOWS = "99"
RESUMED = "98"
UNSTABLE = "0M"
"""Newer sensors send it in the place of a scan while they settle; the stream goes on."""

_GENERIC = {
    "0A": "the sensor could not build the reply",
    "0B": "the sensor's buffer is short, or it is still busy with the same command",
    "0C": "parameters are missing",
    "0D": "the command is unknown",
    "0E": "the command is unknown or not allowed now (time adjustment mode)",
    "0F": "parameters are missing",
    "0G": "the user string is longer than 16 characters",
    "0H": "the user string has a forbidden character",
    "0I": "the sensor is in firmware update mode",
    UNSTABLE: "the sensor is not stable yet",
}
_MEASUREMENT = {
    "01": "the start step is not numeric",
    "02": "the end step is not numeric",
    "03": "the cluster count is not numeric",
    "04": "the end step is out of range",
    "05": "the end step is below the start step",
    "06": "the scan interval is not numeric",
    "07": "the number of scans is not numeric",
    "10": "the laser is off",
    RESUMED: "measuring resumes after a check",
    SCAN_FOLLOWS: "scan data follows",
}
_OTHERS = {
    "BM": {"01": "the laser cannot be switched on", "02": "the laser is on already"},
    "TM": {
        "01": "the parameter is wrong",
        "02": "the mode is on already",
        "03": "the mode is off already",
        "04": "the time was asked for while the mode is off",
    },
    "SS": {
        "01": "the bit rate is not numeric",
        "02": "the sensor does not know this bit rate",
        "03": "the sensor runs at this bit rate already",
        "04": "this sensor cannot change its bit rate",
    },
    "RB": {"01": "the sensor restarts when asked once more"},
}


def is_checking(status: str) -> bool:
    """Tell whether a sensor with this status in place of a scan checks itself, and may go on (98)."""
    return status.isdecimal() and 21 <= int(status) <= 49


def goes_on_by_itself(status: str) -> bool:
    """Tell whether a sensor with this status in place of a scan may send scans again without being asked."""
    return status in (RESUMED, UNSTABLE) or is_checking(status)


def describe_status(command: str, status: str) -> str:
    """Say in words what a status means.

    Args:
        command: The request or its first two letters, e.g. ``MD``.
        status: The two status characters.
    """
    if status == ACCEPTED:
        return "accepted"
    letters = command[:2]
    known = _MEASUREMENT if letters in KINDS else _OTHERS.get(letters, {})
    if status in known:
        return known[status]
    if known is _MEASUREMENT and status.isdecimal():
        if is_checking(status):
            return "measuring stopped while the sensor checks an error"
        if 50 <= int(status) <= 97:
            return "hardware trouble in the sensor"
    return _GENERIC.get(status, "no meaning is documented")
