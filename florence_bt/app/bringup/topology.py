"""Which nodes run in which process, with which parameters. A group is imported in its process only."""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable, Collection
from dataclasses import fields
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from florence_bt.app.bringup.config import Config, Parameters, check_config, config_of
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.rehearsal import TOO_SLOW_ADVICE
from florence_bt.app.bringup.supervisor import STARTED_AGAIN
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.paths import find_data
from florence_bt.core.serving import ConditionBinding, NodeBinding, SkillBinding
from florence_bt.ros.parameters import parameter_names
from florence_bt.skills.base import declaration as base
from florence_bt.skills.locator import declaration as locator
from florence_bt.skills.navigation.navigate import declaration as navigate
from florence_bt.skills.robot_description.room import RoomParameters
from florence_bt.skills.served import BINDINGS
from florence_bt.skills.speech import declaration as speech

if TYPE_CHECKING:
    from florence_bt.ros.node import FlorenceNode
    from florence_bt.simulation.hardware.server import HardwareServer

NODES: dict[str, tuple[str, ...]] = {
    "simulator": ("simulator",),
    "hardware": (
        "turtlebot_node",
        "hokuyo_node",
        "kinect_node",
        "kinect_aux",
        "kinect_laser",
        "laser_combinator",
        "laser_filter",
        "velocity_filter",
        "robot_description",
    ),
    "navigation": ("map_server", "localiser", "mapping", "navigate"),
    "people": ("user_tracker_ni_node", "florenceLocator", "approach_user", "home_sensors"),
    "missions": ("florence_bt", "speech"),
}
"""Process -> its nodes, in the order of their start; ended the other way round, so that missions cancel first
and the base is stopped by its driver before its port goes away."""

NODE_CLASSES = {
    "simulator": "simulation.hardware.node:SimulatorNode",
    "turtlebot_node": "drivers.turtlebot.node:TurtlebotNode",
    "hokuyo_node": "drivers.hokuyo.node:HokuyoNode",
    "kinect_node": "drivers.kinect.node:KinectNode",
    "kinect_aux": "drivers.kinect.motor.node:KinectMotorNode",
    "kinect_laser": "skills.filters.depth_to_laser.node:FakeLaserNode",
    "laser_combinator": "skills.filters.laser_combinator.node:LaserCombinatorNode",
    "laser_filter": "skills.filters.laser_filter.node:LaserFilterNode",
    "velocity_filter": "skills.filters.velocity_filter.node:VelocityFilterNode",
    "robot_description": "skills.robot_description.node:RobotDescriptionNode",
    "map_server": "skills.navigation.map_server.node:MapServerNode",
    "localiser": "skills.navigation.localisation.node:LocaliserNode",
    "mapping": "skills.navigation.mapping.node:MappingNode",
    "navigate": "skills.navigation.navigate.node:NavigationNode",
    "user_tracker_ni_node": "skills.people.user_tracker.node:UserTrackerNode",
    "florenceLocator": "skills.locator.node:LocatorNode",
    "approach_user": "skills.people.approach_user.node:ApproachNode",
    "home_sensors": "skills.home_sensors.node:HomeSensorsNode",
    "florence_bt": "runtime.node:MissionNode",
    "speech": "skills.speech.node:SpeechNode",
}
"""Node -> module (below ``florence_bt``) and class."""

OPTIONAL = ("home_sensors", "speech")
"""Nodes that are not in every bring-up: they need a file, or another program has their place."""

MAPPING, WITHOUT_MAPPING = ("mapping",), ("map_server", "localiser")
"""Nodes of a bring-up that makes a map, and those that are there in their place otherwise."""

ENDED_TOGETHER = ("navigation", "people")
"""Processes that are ended side by side: neither needs the other."""

MISSIONS, BASE = "missions", "hardware"
"""The processes of the mission server and of the base's driver."""

REMAPPINGS = (
    "turtlebot_node:cmd_vel:=filtered_cmd_vel",
    "turtlebot_node:manual_cmd_vel:=filtered_manual_cmd_vel",
)
"""The base takes its commands from the velocity filter, not from navigation (REFERENCE 6.5)."""

OWN_CLOCK = "/clock:=clock"
"""Each simulated robot has a time of its own."""

Factory = Callable[[], "FlorenceNode"]


def node_class(name: str) -> type[FlorenceNode]:
    """Import the class of a node; takes up to a second."""
    module, _, kind = NODE_CLASSES[name].partition(":")
    found: type[FlorenceNode] = getattr(importlib.import_module(f"florence_bt.{module}"), kind)
    return found


def refuse_wrong_parameters(config: Config) -> None:
    """Check a configuration against the parameters of every node (:func:`check_config`).

    Raises:
        ConfigError: With the place in the file.
    """
    check_config(config, {name: partial(node_class, name) for name in NODE_CLASSES})


def remappings(options: BringUp) -> tuple[str, ...]:
    """Return the rules of every process that go before those of the user."""
    return (*REMAPPINGS, OWN_CLOCK) if options.simulated and options.namespace else REMAPPINGS


def groups(options: BringUp) -> list[str]:
    """Return the processes of a bring-up in the order of their start."""
    absent = {
        "simulator": not options.in_flat,
        "hardware": options.base == "running",
        "navigation": options.nav == "nav2",
        "people": options.missions_only,
    }
    return [group for group in NODES if not absent.get(group)]


def own_bindings(options: BringUp) -> list[SkillBinding]:
    """Return the skills that nodes of this bring-up serve; of the others the servers may come and go."""
    if options.missions_only:
        served: Collection[SkillBinding] = locator.BINDINGS
    else:
        others = [
            *speech.BINDINGS,  # --speech none leaves the voice to another node
            *(navigate.BINDINGS if options.nav == "nav2" else ()),
            *(base.BINDINGS if options.base == "running" else ()),
        ]
        served = [each for each in BINDINGS if each not in others]
    return [each for each in served if isinstance(each, NodeBinding | ConditionBinding)]


def factories(group: str, options: BringUp) -> list[Factory]:
    """Return how to build the nodes of one process.

    Raises:
        ConfigError: Unknown group, or a wrong configuration.
    """
    builders = {
        "simulator": _simulator,
        "hardware": _hardware,
        "navigation": _navigation,
        "people": _people,
        "missions": _missions,
    }
    if group not in builders:
        raise ConfigError(f"unknown group of nodes {group!r}", valid=closest_first(group, builders))
    return builders[group](_Settings(options))


class _Settings:
    """The parameters of every node: the configuration with what this bring-up adds."""

    def __init__(self, options: BringUp) -> None:
        self.options = options
        self.config = config_of(options)

    @property
    def map_file(self) -> Path:
        return Path(self.options.map_file) if self.options.map_file else find_data("maps", "flat.yaml")

    @property
    def hotspots_file(self) -> Path:
        """The hotspots; the copy of those of the package is made here.

        A robot that is not ours has none at first, as the flat is not its home, and on a map that is made
        nothing has a place yet.
        """
        file = self.options.hotspots
        if self.options.hotspots_file is None and not file.exists():
            flat = find_data("hotspots", "flat.yaml")
            file.write_bytes(b"" if self.options.has_no_places else flat.read_bytes())
        return file

    def of(self, node: str, **overrides: Any) -> Parameters:
        """Return the parameters of a node; simulated ones follow the simulated time."""
        known = parameter_names(node_class(node).parameter_classes)
        return self.config.of(node, known, use_sim_time=self.options.simulated or None, **overrides)

    def of_map_server(self) -> Parameters:
        """Return the map server's parameters; by default it saves maps below the bring-up's folder."""
        saved = {"save_folder": str(Path(self.options.folder).resolve() / "maps")}
        return saved | self.of("map_server", map_file=str(self.map_file))

    def of_approach(self) -> Parameters:
        """Return the parameters of the approach; where the robot fits is what navigation is told."""
        shared = {field.name for field in fields(RoomParameters)}
        told = {name: value for name, value in self.of("navigate").items() if name in shared}
        return told | self.of("approach_user")

    def with_timeout(self, node: str, name: str, default_s: float) -> Parameters:
        """Return the parameters of a node with a time-out that notices a silent process or device.

        These need the real time that they need on the robot: in a simulation that is faster, they count as
        many more simulated seconds.
        """
        parameters = self.of(node)
        value = parameters.get(name)
        if (
            self.options.simulated
            and self.options.speed > 1.0
            and (value is None or isinstance(value, float))
        ):
            parameters[name] = (value or default_s) * self.options.speed
        return parameters


# ---- simulated hardware ---------------------------------------------------------------------------------


def _simulator(settings: _Settings) -> list[Factory]:
    from florence_bt.simulation.hardware.node import SimulatorNode

    options = settings.options
    parameters = {"speed": options.speed, "catch_up": options.emulated}
    return [partial(SimulatorNode, partial(_make_server, options), parameters=parameters)]


def _make_server(options: BringUp) -> HardwareServer:
    from florence_bt.app.bringup.simulated import (
        flat_of,
        hardware_mounts,
        hardware_settings,
        people_at_home,
        start_of,
    )
    from florence_bt.simulation.hardware.server import HardwareServer
    from florence_bt.simulation.home.world import SimulatedWorld

    people = people_at_home(options)
    world = SimulatedWorld(flat_of(options), people=people, start=start_of(options), seed=options.seed)
    return HardwareServer(world, hardware_mounts(), hardware_settings(options))


# ---- the robot ------------------------------------------------------------------------------------------


def _hardware(settings: _Settings) -> list[Factory]:
    from florence_bt.drivers.hokuyo.node import HokuyoNode
    from florence_bt.drivers.kinect.motor.node import KinectMotorNode
    from florence_bt.drivers.kinect.node import KinectNode
    from florence_bt.drivers.turtlebot.node import TurtlebotNode
    from florence_bt.skills.filters.depth_to_laser.node import FakeLaserNode
    from florence_bt.skills.filters.laser_combinator.node import LaserCombinatorNode
    from florence_bt.skills.filters.laser_filter.node import LaserFilterNode
    from florence_bt.skills.filters.velocity_filter.node import VelocityFilterNode
    from florence_bt.skills.filters.velocity_filter.velocity_filter import VelocityFilterParameters
    from florence_bt.skills.robot_description.node import RobotDescriptionNode

    command_timeout = VelocityFilterParameters().command_timeout
    velocity_filter = settings.with_timeout("velocity_filter", "command_timeout", command_timeout)
    motor: dict[str, Any] = {}
    ports: dict[str, str | None] = {"base": None, "laser": None, "kinect": None}
    if settings.options.in_flat:
        from florence_bt.app.bringup.simulated import hardware_settings, simulated_motor

        simulated = hardware_settings(settings.options)
        motor = {"open_motor": simulated_motor()}
        ports = {
            "base": str(simulated.base_port),
            "laser": str(simulated.laser_port),
            "kinect": str(simulated.kinect_socket),
        }
    base = {"port": ports["base"], "override_file": str(Path(settings.options.folder) / "manual_override")}
    return [
        partial(TurtlebotNode, parameters=settings.of("turtlebot_node", **base)),
        partial(HokuyoNode, parameters=settings.of("hokuyo_node", port=ports["laser"])),
        partial(KinectNode, parameters=settings.of("kinect_node", source=ports["kinect"])),
        partial(KinectMotorNode, parameters=settings.of("kinect_aux"), **motor),
        partial(FakeLaserNode, parameters=settings.of("kinect_laser")),
        partial(LaserCombinatorNode, parameters=settings.of("laser_combinator")),
        partial(LaserFilterNode, parameters=settings.of("laser_filter")),
        partial(VelocityFilterNode, parameters=velocity_filter),
        partial(RobotDescriptionNode, parameters=settings.of("robot_description")),
    ]


def _navigation(settings: _Settings) -> list[Factory]:
    from florence_bt.app.bringup.simulated import start_of
    from florence_bt.skills.navigation.localisation.node import LocaliserNode
    from florence_bt.skills.navigation.map_server.node import MapServerNode
    from florence_bt.skills.navigation.mapping.drive import SUFFIX
    from florence_bt.skills.navigation.mapping.node import MappingNode
    from florence_bt.skills.navigation.navigate.node import NavigationNode
    from florence_bt.skills.navigation.navigate.parameters import CycleParameters

    mapping = settings.options.mapping
    navigate = settings.with_timeout("navigate", "scan_timeout", CycleParameters().scan_timeout)
    navigate["map_grows"] = mapping
    if settings.options.emulated:
        navigate.setdefault("silence_advice", f"is the simulated world too slow here? {TOO_SLOW_ADVICE}")
    start = start_of(settings.options)
    initial: dict[str, Any] = {"pose_file": str(Path(settings.options.folder) / "pose.json")}
    if start is not None:
        initial = {"initial_x": start.x, "initial_y": start.y, "initial_yaw": start.yaw}
    place = [
        partial(MapServerNode, parameters=settings.of_map_server()),
        partial(LocaliserNode, parameters=settings.of("localiser", seed=settings.options.seed, **initial)),
    ]
    drive = {
        "drive_file": str(Path(settings.options.folder) / f"mapping{SUFFIX}"),
        "resumed_drive": settings.options.resumed_drive,
    }
    growing = [partial(MappingNode, parameters=settings.of("mapping", **drive))]
    return [*(growing if mapping else place), partial(NavigationNode, parameters=navigate)]


def _people(settings: _Settings) -> list[Factory]:
    from florence_bt.skills.people.approach_user.node import ApproachNode
    from florence_bt.skills.people.user_tracker.node import UserTrackerNode

    return [
        partial(UserTrackerNode, parameters=settings.of("user_tracker_ni_node")),
        _locator(settings),
        partial(ApproachNode, parameters=settings.of_approach()),
        *_home_sensors(settings),
    ]


def _locator(settings: _Settings) -> Factory:
    from florence_bt.app.bringup.simulated import user_room
    from florence_bt.skills.locator.node import LocatorNode

    parameters = settings.of(
        "florenceLocator",
        hotspots_file=str(settings.hotspots_file),
        initial_user_room=None if settings.options.mapping else user_room(settings.options),
        habits_file=str(Path(settings.options.folder) / "habits.json"),
    )
    return partial(LocatorNode, parameters=parameters)


def _home_sensors(settings: _Settings) -> list[Factory]:
    if settings.options.home_file is None:
        return []
    from florence_bt.skills.home_sensors.node import HomeSensorsNode

    files = {"home_file": settings.options.home_file, "hotspots_file": str(settings.hotspots_file)}
    return [partial(HomeSensorsNode, parameters=settings.of("home_sensors", **files))]


def _speech(settings: _Settings) -> list[Factory]:
    from florence_bt.skills.speech.node import SpeechNode
    from florence_bt.skills.speech.voice import NONE

    parameters = settings.of("speech", program=settings.options.speech)
    return [] if parameters.get("program") == NONE else [partial(SpeechNode, parameters=parameters)]


def _missions(settings: _Settings) -> list[Factory]:
    from florence_bt.app.bringup.make_safe import BaseSafety
    from florence_bt.app.bringup.skills_ros import make_skills
    from florence_bt.app.demo.pictures import BackgroundPictures
    from florence_bt.runtime.node import MissionNode
    from florence_bt.skills.navigation.navigate.declaration import ACTIONS_WITHOUT_SKILL, NOT_OF_NAV2
    from florence_bt.trees.language.declarations import collect_declarations
    from florence_bt.trees.language.declared_skills import STOCK, mappings_in
    from florence_bt.trees.language.third_party import ThirdParty

    installed = [folder for _, folder in ThirdParty().mission_folders()]
    mappings = mappings_in([STOCK.parent, *installed, *map(Path, settings.options.mission_folders)])
    alone = settings.options.missions_only
    without = NOT_OF_NAV2 if settings.options.nav == "nav2" and not alone else ()
    parameters = settings.of(
        "florence_bt",
        runs_folder=str(settings.options.runs),
        mission_folders=settings.options.mission_folders or None,
        # Its predecessor has just died, and the system has been up all the time.
        recovery_limit=inf if os.environ.get(STARTED_AGAIN) else None,
    )
    has_map = settings.options.map_file or not settings.options.has_no_places
    pictures = BackgroundPictures(settings.map_file, settings.hotspots_file)

    def mission_node() -> FlorenceNode:
        node = MissionNode(
            partial(make_skills, without=without, mappings=mappings),
            {**{name: each.declaration for name, each in mappings.items()}, **collect_declarations()},
            make_safety=BaseSafety,
            on_recorded=pictures.draw if has_map else None,
            other_actions=ACTIONS_WITHOUT_SKILL,
            own_skills=[each.skill.name for each in own_bindings(settings.options)],
            only_used=alone,
            parameters=parameters,
        )
        node.on_close(pictures.close)
        return node

    places = [_locator(settings), *_home_sensors(settings)] if alone else []
    return [*places, *_speech(settings), mission_node]
