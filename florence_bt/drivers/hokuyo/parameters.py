"""What can be set on the Hokuyo driver and node."""

from __future__ import annotations

import math
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError


@dataclass(frozen=True, slots=True)
class HokuyoParameters:
    """How to measure.

    Attributes:
        min_ang: First angle in radians, -pi..pi, clipped to what the sensor can see. The default is the
            whole window of the URG-04LX; hokuyo_node had -pi/2.
        max_ang: Last angle in radians, min_ang..pi, clipped likewise.
        cluster: Neighbouring steps that are joined into one value, 0..99 (0 and 1: none).
        skip: Turns left out between two scans, 0..9.
        frame_id: The sensor's frame.
        time_offset: Added to every stamp, -0.25..0.25 s.
        latency_s: Seconds between the sensor passing step 0 and the scan's arrival. None takes the
            time that the sweep up to the last step lasts: no scan can arrive before.
        reply_timeout_s: Wait this long for the answer to a command.
        silence_timeout_s: Start afresh when the next scan is overdue by this long.
        restart_delay_s: Rest this long after a failure before starting again; doubled on each failure that
            follows, up to ten times as long.

    Source: REFERENCE 4.9; document, section 2.1.
    """

    min_ang: float = -2.086214
    max_ang: float = 2.092350
    cluster: int = 1
    skip: int = 0
    frame_id: str = "base_laser_round_link"
    time_offset: float = 0.0
    latency_s: float | None = None
    reply_timeout_s: float = 1.0
    silence_timeout_s: float = 1.0
    restart_delay_s: float = 1.0

    def __post_init__(self) -> None:
        if not -math.pi <= self.min_ang <= self.max_ang <= math.pi:
            raise ConfigError(
                f"min_ang {self.min_ang} and max_ang {self.max_ang} do not fit",
                valid=["-pi <= min_ang <= max_ang <= pi"],
            )
        _check("cluster", self.cluster, 0, 99)
        _check("skip", self.skip, 0, 9)
        _check("time_offset", self.time_offset, -0.25, 0.25)
        if self.latency_s is not None:
            _check("latency_s", self.latency_s, 0.0, 1.0)
        _check("reply_timeout_s", self.reply_timeout_s, 0.05, 60.0)
        _check("silence_timeout_s", self.silence_timeout_s, 0.05, 60.0)
        _check("restart_delay_s", self.restart_delay_s, 0.05, 60.0)


@dataclass(frozen=True, slots=True)
class HokuyoPortParameters:
    """How to reach the sensor.

    Attributes:
        port: The serial device; the sensor is a USB modem class device (REFERENCE 4.2).
        baud_rate: Bits a second on a real serial line; without effect over USB.
        reconnect_delay_s: Seconds between two attempts to open the port; doubled each time, up to ten times.
    """

    port: str = "/dev/ttyACM0"
    baud_rate: int = 115200
    reconnect_delay_s: float = 0.5

    def __post_init__(self) -> None:
        _check("baud_rate", self.baud_rate, 9600, 1_000_000)
        _check("reconnect_delay_s", self.reconnect_delay_s, 0.05, 60.0)


def _check(name: str, value: float, lowest: float, highest: float) -> None:
    if not lowest <= value <= highest:
        raise ConfigError(f"{name} {value!r} is out of range", valid=[f"{lowest}..{highest}"])
