"""Parameters of the Hokuyo driver and node."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import Annotated

from florence_bt.core.limits import CheckedParameters, Limits, check_order
from florence_bt.drivers.hokuyo.codec import BIT_RATES

USB_MODEM = "ttyACM"
"""Linux's name of a serial port over USB whose speed means nothing."""


@dataclass(frozen=True, slots=True)
class HokuyoParameters(CheckedParameters):
    """The parameters of measuring.

    Attributes:
        min_ang: First angle in radians, -pi..pi, clipped to what the sensor can see. The default is the
            whole window of the URG-04LX; hokuyo_node had -pi/2.
        max_ang: Last angle in radians, min_ang..pi, clipped likewise.
        intensity: Measure intensities too (ME instead of MD), where the sensor can.
        multi_echo: Measure every echo of a beam, such as a glass door's and that of what is behind it (ND
            instead of MD), where the sensor can; ``scan`` has the first echoes, ``echoes`` all of them.
        allow_unsafe_settings: Let a UTM-30LX send intensities of any window; with more than 95 degrees a
            cluster it may crash.
        cluster: Neighbouring steps that are joined into one value, 0..99 (0 and 1: none).
        skip: Turns left out between two scans, 0..9.
        frame_id: The sensor's frame.
        time_offset: Added to every stamp, -0.25..0.25 s.
        calibrate_time: Measure the latency against the sensor's own clock at the first start (some seconds).
        latency_s: Seconds between the sensor passing step 0 and the scan's arrival. None takes what was
            measured or, without that, the time that the sweep up to the last step lasts: no scan can arrive
            before.
        use_sensor_clock: Take the spacing of the stamps from the sensor's clock, so that a scan that was
            delayed on its way does not look newer; hokuyo_node took the arrival alone.
        self_test_scans: Scans of each stream of the self test, 1..99; hokuyo_node took 99.
        reply_timeout_s: Wait this long for the answer to a command.
        silence_timeout_s: Start again when the next scan is overdue by this long.
        check_timeout_s: Start again when the sensor has reported for this long, in place of scans, that it
            checks itself.
        restart_delay_s: Rest this long after a failure before starting again; doubled on each failure that
            follows before the sensor has measured for as long as it rested, up to ten times as long.

    Source: REFERENCE 4.9, 4.10; document, section 2.1.
    """

    min_ang: Annotated[float, Limits(-math.pi, math.pi)] = -2.086214
    max_ang: Annotated[float, Limits(-math.pi, math.pi)] = 2.092350
    intensity: bool = False
    multi_echo: bool = False
    allow_unsafe_settings: bool = False
    cluster: Annotated[int, Limits(0, 99)] = 1
    skip: Annotated[int, Limits(0, 9)] = 0
    frame_id: str = "base_laser_round_link"
    time_offset: Annotated[float, Limits(-0.25, 0.25)] = 0.0
    calibrate_time: bool = True
    latency_s: Annotated[float, Limits(0.0, 1.0)] | None = None
    use_sensor_clock: bool = True
    self_test_scans: Annotated[int, Limits(1, 99)] = 99
    reply_timeout_s: Annotated[float, Limits(0.05, 60.0)] = 1.0
    silence_timeout_s: Annotated[float, Limits(0.05, 60.0)] = 1.0
    check_timeout_s: Annotated[float, Limits(0.05, 600.0)] = 5.0
    restart_delay_s: Annotated[float, Limits(0.05, 60.0)] = 1.0

    def _check(self) -> None:
        check_order(self, ("min_ang", "max_ang"), equal=True)


@dataclass(frozen=True, slots=True)
class HokuyoPortParameters(CheckedParameters):
    """The parameters for reaching the sensor.

    Attributes:
        port: The serial device; the sensor is a USB modem class device (REFERENCE 4.2).
        baud_rate: Bits per second that a real serial line shall have (SS); the sensor is looked for at others
            too. Without effect over USB (ttyACM).
        ip_address: Address or name of a sensor on the network, such as 192.168.0.10; used instead of the port
            when it is set. Sensors with a network plug speak the same protocol there.
        ip_port: Its TCP port.
        reconnect_delay_s: Seconds between two attempts to open the port; doubled each time, up to ten times.
    """

    port: str = "/dev/ttyACM0"
    baud_rate: Annotated[int, Limits(9600, 1_000_000)] = 115200
    ip_address: str = ""
    ip_port: Annotated[int, Limits(1, 65535)] = 10940
    reconnect_delay_s: Annotated[float, Limits(0.05, 60.0)] = 0.5

    @property
    def place(self) -> str:
        """Say where the sensor is, for people."""
        return f"{self.ip_address}:{self.ip_port}" if self.ip_address else self.port

    @property
    def line_rate(self) -> int | None:
        """The wanted speed of a real serial line; USB modems and networks have none."""
        if self.ip_address or USB_MODEM in os.path.realpath(self.port):
            return None
        return self.baud_rate if self.baud_rate in BIT_RATES else None
