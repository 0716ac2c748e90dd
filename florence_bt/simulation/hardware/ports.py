"""Places of the simulated hardware on the robot, and of its ports. Light: no physics is loaded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from florence_bt.core.limits import CheckedParameters, Limits
from florence_bt.core.transforms import Transform3


@dataclass(frozen=True, slots=True)
class HardwareMounts:
    """The places of the sensors on the robot.

    Attributes:
        laser: base_footprint from the laser's frame.
        camera: base_footprint from the depth camera's optical frame.
    """

    laser: Transform3
    camera: Transform3


@dataclass(frozen=True, slots=True)
class HardwareSettings(CheckedParameters):
    """The settings of the hardware: the folder of the ports, and how often the Kinect gives a frame.

    Attributes:
        folder: Holds the links ``create`` and ``hokuyo`` to the pseudo-terminals and the socket ``kinect``.
        kinect_rate: Frames per simulated second; 30 on the real device.
        seed: Start of every noise generator.
    """

    folder: Path
    kinect_rate: Annotated[float, Limits(0.0, 30.0, above=True)] = 10.0
    seed: int = 0

    @property
    def base_port(self) -> Path:
        """The serial port of the base."""
        return self.folder / "create"

    @property
    def laser_port(self) -> Path:
        """The serial port of the laser."""
        return self.folder / "hokuyo"

    @property
    def kinect_socket(self) -> Path:
        """The socket of the Kinect's frames."""
        return self.folder / "kinect"
