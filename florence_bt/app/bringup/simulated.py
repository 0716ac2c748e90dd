"""Additions of a simulated bring-up: who is at home, where the robot starts, where the ports are.

The home loads when it is asked for: it takes longer than all the rest of a process's start.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from florence_bt.app.bringup.options import ABSENT, BringUp
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import TransformBuffer
from florence_bt.simulation.hardware.ports import HardwareMounts, HardwareSettings

if TYPE_CHECKING:
    from florence_bt.drivers.kinect.motor.usb_motor import UsbMotor
    from florence_bt.simulation.home.flat import Flat
    from florence_bt.simulation.home.person import PersonSpec

LASER_FRAME = "base_laser_round_link"
CAMERA_FRAME = "camera_depth_optical_frame"

COMPANY, LEADING = "company", "leading"
"""Values of ``person``: two or three people; somebody who leads the robot through the home, and somebody else
who walks across their way."""
LEADER_WAITS_S = 30.0
"""This long after the start of the simulation the leader sets off: time to trigger ``follow_me``."""


def robot_frames() -> TransformBuffer:
    """Return the static frames of the robot's description."""
    from florence_bt.skills.robot_description.description import load_description

    buffer = TransformBuffer()
    load_description().fill(buffer)
    return buffer


def hardware_mounts() -> HardwareMounts:
    """Return where the robot's description puts the sensors."""
    frames = robot_frames()
    return HardwareMounts(
        laser=frames.lookup("base_footprint", LASER_FRAME),
        camera=frames.lookup("base_footprint", CAMERA_FRAME),
    )


def hardware_settings(options: BringUp) -> HardwareSettings:
    """Return where the simulated ports of a bring-up are."""
    return HardwareSettings(Path(options.folder) / "ports", seed=options.seed)


def simulated_motor() -> Callable[[int], UsbMotor]:
    """Return what opens the motor of the simulated Kinect; its camera does not see the tilt."""
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
    """Return the simulated home of a bring-up.

    Raises:
        ConfigError: Its file is wrong, with file:line:column.
    """
    from florence_bt.simulation.home.generate import choose_flat

    return choose_flat(
        Path(options.world_file) if options.world_file is not None else None, options.world_seed
    )


def with_world_files(options: BringUp) -> BringUp:
    """Write map and hotspots of a home that does not come with Florence into the folder of the bring-up.

    Returns:
        The options with these files, unless they name others. They are written again at each start.
    """
    if not options.own_world or options.mapping:
        return options
    from florence_bt.simulation.home.build_map import build_files
    from florence_bt.simulation.home.map_world import is_map

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


def who_is_at_home(flat: Flat, person: str | None, seed: int) -> tuple[list[PersonSpec], Pose2]:
    """Return the people that ``--person`` asks for, and where the robot starts.

    Args:
        flat: The home.
        person: A room, a situation (``SITUATIONS``, ``company``, ``leading``), ``absent`` for nobody; None
            for a random room.
        seed: Where the chance comes from.

    Raises:
        ConfigError: There is no such room or situation, or the home has no place for it.
    """
    import numpy as np

    from florence_bt.simulation.home.people import place_person
    from florence_bt.simulation.home.situations import SITUATIONS, company_in, led_walk, person_in

    rng = np.random.default_rng(seed)
    if person == ABSENT:
        return [], flat.start
    if person == LEADING:
        walk = led_walk(flat, rng)
        return [replace(walk.leader, wait=LEADER_WAITS_S), walk.visitor], walk.start
    if person == COMPANY:
        return company_in(flat, rng), flat.start
    if person in SITUATIONS:
        return [person_in(person, flat, rng)], flat.start
    names = [*(room.name for room in flat.rooms), *SITUATIONS, COMPANY, LEADING, ABSENT]
    if person is not None and person not in names:
        raise ConfigError(
            f"no room and no situation is called {person!r}", valid=closest_first(person, names)
        )
    return [place_person(flat, person, rng)], flat.start


def people_at_home(options: BringUp) -> list[PersonSpec]:
    """Return the people that the bring-up asks for; see :func:`who_is_at_home`."""
    return who_is_at_home(flat_of(options), options.person, options.seed)[0]


def with_places(options: BringUp) -> BringUp:
    """Return the options with where the robot starts, and the room in which the user was last seen.

    In the simulated flat that is the room the person is in, as presence sensors would report; with nobody at
    home it is the flat's first room. A real robot must be given its pose; its configuration says the room.
    """
    if not options.in_flat:
        return options
    people, start = who_is_at_home(flat := flat_of(options), options.person, options.seed)
    room = flat.room_at(people[0].pose.x, people[0].pose.y) if people else flat.rooms[0]
    return replace(
        options,
        start=options.start or (start.x, start.y, start.yaw),
        user_room=room.name if room and not options.mapping else None,
    )
