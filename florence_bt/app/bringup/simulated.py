"""What a simulated bring-up adds: who is at home, where the robot starts, where the ports are."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from florence_bt.app.bringup.options import ABSENT, BringUp
from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import TransformBuffer
from florence_bt.simulation.hardware.ports import HardwareMounts, HardwareSettings
from florence_bt.simulation.home.flat import Flat, load_flat
from florence_bt.simulation.home.people import PersonSpec, place_person
from florence_bt.skills.robot_description.description import load_description

if TYPE_CHECKING:
    from florence_bt.drivers.kinect.motor.usb_motor import UsbMotor

LASER_FRAME = "base_laser_round_link"
CAMERA_FRAME = "camera_depth_optical_frame"


def robot_frames() -> TransformBuffer:
    """The static frames of the robot's description."""
    buffer = TransformBuffer()
    load_description().fill(buffer)
    return buffer


def hardware_mounts() -> HardwareMounts:
    """Where the robot's description puts the sensors."""
    frames = robot_frames()
    return HardwareMounts(
        laser=frames.lookup("base_footprint", LASER_FRAME),
        camera=frames.lookup("base_footprint", CAMERA_FRAME),
    )


def hardware_settings(options: BringUp) -> HardwareSettings:
    """Where the simulated ports of a bring-up are."""
    return HardwareSettings(Path(options.folder) / "ports", seed=options.seed)


def simulated_motor() -> Callable[[int], UsbMotor]:
    """Opens the motor of the simulated Kinect; what it tilts is not seen by the simulated camera."""
    from florence_bt.drivers.kinect.motor.usb_motor import UsbMotor
    from florence_bt.simulation.emulators.kinect_motor import KinectMotorBackend

    return partial(UsbMotor, backend=KinectMotorBackend(time.monotonic))


def clear_ports(options: BringUp) -> None:
    """Remove the ports that a killed bring-up left: they may lead to another terminal by now."""
    settings = hardware_settings(options)
    for port in (settings.base_port, settings.laser_port, settings.kinect_socket):
        if port.is_symlink() or port.is_socket():
            port.unlink()


def people_at_home(flat: Flat, options: BringUp) -> list[PersonSpec]:
    """The person that the bring-up asks for: in a room, anywhere, or nobody.

    Raises:
        ConfigError: There is no such room.
    """
    if options.person == ABSENT:
        return []
    return [place_person(flat, options.person, np.random.default_rng(options.seed))]


def start_of(options: BringUp) -> Pose2 | None:
    """Where the robot starts, None when a real robot must be given its pose."""
    if options.start_pose is not None or not options.in_flat:
        return options.start_pose
    return load_flat().start


def user_room(options: BringUp) -> str | None:
    """The room in which the user was last seen, None to leave it to the configuration.

    In the simulated flat it is the room the person is in, as presence sensors would report; with nobody at
    home it is the flat's first room.
    """
    if options.user_room is not None or not options.in_flat:
        return options.user_room
    flat = load_flat()
    people = people_at_home(flat, options)
    room = flat.room_at(people[0].pose.x, people[0].pose.y) if people else flat.rooms[0]
    return room.name if room else None
