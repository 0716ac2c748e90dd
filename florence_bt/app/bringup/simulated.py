"""What a simulated bring-up adds: who is at home, where the robot starts, where the ports are."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from florence_bt.app.bringup.options import ABSENT, BringUp
from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import TransformBuffer
from florence_bt.simulation.hardware.ports import HardwareMounts, HardwareSettings
from florence_bt.simulation.home.build_map import build_files
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.generate import choose_flat
from florence_bt.simulation.home.map_world import is_map
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


def flat_of(options: BringUp) -> Flat:
    """The simulated home of a bring-up.

    Raises:
        ConfigError: Its file is wrong, with file:line:column.
    """
    return choose_flat(
        Path(options.world_file) if options.world_file is not None else None, options.world_seed
    )


def with_world_files(options: BringUp) -> BringUp:
    """Write map and hotspots of a home that does not come with Florence into the folder of the bring-up.

    Returns:
        The options with these files, unless they name others. They are written again at each start.
    """
    if not options.own_world:
        return options
    folder = Path(options.folder) / "world"
    for name, content in build_files(flat := flat_of(options)).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    made = str(folder / "maps" / f"{flat.name}.yaml")
    own_map = options.world_file if options.world_file and is_map(Path(options.world_file)) else made
    return replace(
        options,
        map_file=options.map_file or own_map,
        hotspots_file=options.hotspots_file or str(folder / "hotspots" / f"{flat.name}.yaml"),
    )


def people_at_home(options: BringUp) -> list[PersonSpec]:
    """The person that the bring-up asks for: in a room, anywhere, or nobody.

    Raises:
        ConfigError: There is no such room, or the home's file is wrong.
    """
    flat = flat_of(options)
    if options.person == ABSENT:
        return []
    return [place_person(flat, options.person, np.random.default_rng(options.seed))]


def start_of(options: BringUp) -> Pose2 | None:
    """Where the robot starts, None when a real robot must be given its pose."""
    if options.start_pose is not None or not options.in_flat:
        return options.start_pose
    return flat_of(options).start


def user_room(options: BringUp) -> str | None:
    """The room in which the user was last seen, None to leave it to the configuration.

    In the simulated flat it is the room the person is in, as presence sensors would report; with nobody at
    home it is the flat's first room.
    """
    if options.user_room is not None or not options.in_flat:
        return options.user_room
    flat, people = flat_of(options), people_at_home(options)
    room = flat.room_at(people[0].pose.x, people[0].pose.y) if people else flat.rooms[0]
    return room.name if room else None
