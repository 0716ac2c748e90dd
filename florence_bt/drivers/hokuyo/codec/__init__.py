"""SCIP 2.0 on the wire: commands to bytes, bytes to replies, replies to numbers.

Framing, check sums and number decoding only: no port, no clock, no thread, no sequence of commands (that is
``driver.py`` with its scripts) and no meaning of angles (that is ``geometry.py``).
"""

from florence_bt.drivers.hokuyo.codec.commands import (
    BIT_RATES,
    KINDS,
    Measurement,
    debug_mode,
    motor_speed,
    request,
    scan_command,
    sensitivity,
    serial_speed,
    time_mode,
)
from florence_bt.drivers.hokuyo.codec.numbers import check_sum, decode_values
from florence_bt.drivers.hokuyo.codec.replies import LONGEST_FRAME, Reply, ReplyParser, parse_frame
from florence_bt.drivers.hokuyo.codec.scans import ScanReply, decode_scan, decode_time

__all__ = [
    "BIT_RATES",
    "KINDS",
    "LONGEST_FRAME",
    "Measurement",
    "Reply",
    "ReplyParser",
    "ScanReply",
    "check_sum",
    "debug_mode",
    "decode_scan",
    "decode_time",
    "decode_values",
    "motor_speed",
    "parse_frame",
    "request",
    "scan_command",
    "sensitivity",
    "serial_speed",
    "time_mode",
]
