"""Builds the rig from the files of the package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2

from florence_bt.app.bringup.config import load_config
from florence_bt.app.bringup.simulated import robot_frames, who_is_at_home
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.zones import Zone
from florence_bt.simulation.home.build_map import hotspots_yaml, laser_map
from florence_bt.simulation.home.flat import Flat, load_flat
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.rig.components import Config, parameters_of
from florence_bt.simulation.rig.rig import Rig, RigSetting, SkillChange
from florence_bt.simulation.rig.robot import USUAL_QUALITY, SensorQuality
from florence_bt.simulation.rig.wires import Link
from florence_bt.skills.locator.hotspots import Hotspots, parse_hotspots
from florence_bt.skills.navigation.mapping.growing_map import MapMaker
from florence_bt.trees.language.loader import MissionLibrary


def make_rig(
    *,
    seed: int = 0,
    person: str | PersonSpec | None = None,
    user_room: str | None = None,
    runs_folder: Path | None = None,
    flat: Flat | None = None,
    others: Sequence[PersonSpec] = (),
    start: Pose2 | None = None,
    believed: Pose2 | None = None,
    grid: OccupancyGrid | None = None,
    zones: Sequence[Zone] = (),
    mapping: bool = False,
    hotspots: Hotspots | None = None,
    missions: MissionLibrary | None = None,
    links: Mapping[str, Link] | None = None,
    quality: SensorQuality = USUAL_QUALITY,
    change_skills: SkillChange = lambda skills, clock: skills,
    drawn_people: bool = False,
) -> Rig:
    """Make a rig of a home with its map and hotspots.

    Args:
        seed: Start of every random generator; the place and posture of the person come from it too.
        person: A ready person, or what ``--person`` takes (``who_is_at_home``).
        user_room: Where the user was last seen; the person's room when not given.
        runs_folder: Where the runs leave their folders; None for nowhere.
        flat: The home; the flat that comes with Florence when not given.
        others: Who else is there.
        start: Where the robot stands at first, map frame; the home's own place, or that of the situation,
            when not given.
        believed: Where the robot believes to stand at first, where it does when not given.
        grid: The map; that of the home when not given.
        zones: Where the robot does not drive, or drives slowly.
        mapping: Whether the robot makes its map and knows no places; the map's frame is where it starts.
        hotspots: The rooms; those of the home when not given.
        missions: The missions; those of this installation when not given.
        links: How well topics are carried, by name; perfectly when not given.
        quality: How good the sensors are.
        change_skills: Given the skills and the clock, returns those that missions get.
        drawn_people: As of :class:`RigSetting`.

    Raises:
        ConfigError: There is no such room or situation.
    """
    cv2.setNumThreads(1)  # rigs run side by side, one on a core; threads that wait for each other are slower
    flat = flat or load_flat()
    if isinstance(person, PersonSpec):
        people, place = [person], flat.start
    else:
        people, place = who_is_at_home(flat, person, seed)
    room = flat.room_at(people[0].pose.x, people[0].pose.y) if people else flat.rooms[0]
    config = load_config()
    if mapping:
        config["navigate"] = {**config.get("navigate", {}), "map_grows": True}
    if hotspots is None:
        hotspots = Hotspots() if mapping else parse_hotspots(hotspots_yaml(flat))
    hotspots.zones = tuple(zones)
    if user_room is None:
        user_room = room.name if room and hotspots.get(room.name) else ""
    if grid is None and not mapping:
        grid = laser_map(flat)
    return Rig(
        RigSetting(
            flat=flat,
            grid=grid,
            hotspots=hotspots,
            frames=robot_frames(),
            config=config,
            people=[*people, *others],
            start=start or place,
            believed=believed,
            user_room=user_room,
            seed=seed,
            runs_folder=runs_folder,
            map_maker=_map_maker(config) if mapping else None,
            missions=missions,
            links=links or {},
            quality=quality,
            change_skills=change_skills,
            drawn_people=drawn_people,
        )
    )


def _map_maker(config: Config) -> MapMaker:
    from florence_bt.skills.navigation.mapping.slam import Slam, SlamParameters

    return Slam(parameters_of(SlamParameters, config, "mapping"))
