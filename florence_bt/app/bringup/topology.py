"""The processes, their nodes and parameters. A group of nodes is imported in its process only."""

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
from florence_bt.app.bringup.package_processes import package_processes, wanted_processes
from florence_bt.app.bringup.rehearsal import TOO_SLOW_ADVICE
from florence_bt.app.bringup.supervisor import STARTED_AGAIN
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.file_sets import replace_files
from florence_bt.core.paths import find_data
from florence_bt.core.serving import ConditionBinding, NodeBinding, SkillBinding
from florence_bt.ros.parameters import parameter_names
from florence_bt.skills.base import bindings as base
from florence_bt.skills.locator import bindings as locator
from florence_bt.skills.navigation.navigate import bindings as navigate
from florence_bt.skills.robot_description.room import RoomParameters
from florence_bt.skills.served import BINDINGS
from florence_bt.skills.speech import bindings as speech
from florence_bt.skills.speech.voice import NONE

if TYPE_CHECKING:
    from florence_bt.ros.node import FlorenceNode
    from florence_bt.simulation.hardware.server import HardwareServer

NODES: dict[str, tuple[str, ...]] = {
    "recorder": ("recorder",),
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
    "missions": ("speech", "florence_bt"),
}
"""Process -> its nodes, without those of other packages (:mod:`package_processes`), in the order of their
start; ended the other way round, so that missions cancel first and the base is stopped by its driver before
its port goes away. With ``--split`` each node has a process that is called as the node. The recorder is there
from the first message to the last."""

NODE_CLASSES = {
    "recorder": "app.recording.node:RecorderNode",
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

START_NUMBA = "florence_bt.app.bringup.numba_start:start_numba"
MADE_WITH = {
    **dict.fromkeys(
        ("simulator", "laser_filter", "localiser", "mapping", "user_tracker_ni_node"), (START_NUMBA,)
    ),
    "robot_description": ("xacro",),
    "florence_bt": (
        "florence_bt.app.bringup.make_safe",
        "florence_bt.app.bringup.skills_ros",
        "florence_bt.app.demo.pictures",
        "florence_bt.ros.topic_skill",
        "florence_bt.trees.language.declarations:own_declarations",
    ),
}
"""Node -> modules that are imported, and functions that are called, only when it is made
(``ForkServer.load``)."""

SIMULATED_WITH = {
    "simulator": ("florence_bt.app.bringup.simulated", "florence_bt.simulation.home.generate"),
    "kinect_aux": ("florence_bt.app.bringup.simulated", "florence_bt.simulation.emulators.kinect_motor"),
}
"""The same of those that are other ones in the simulated flat."""

DEVICE_NODES = ("turtlebot_node", "hokuyo_node", "kinect_node", "kinect_aux")
"""The drivers; each publishes its diagnostics once a second."""
RECORDER = "recorder"
"""Nothing depends on it, nor on the processes of other packages: they are observers."""

OPTIONAL = ("home_sensors", "speech", RECORDER)
"""Nodes that are not in every bring-up: they are asked for, or another program has their place."""

MAPPING, WITHOUT_MAPPING = ("mapping",), ("map_server", "localiser")
"""Nodes of a bring-up that makes a map, and those that are there in their place otherwise."""

ENDED_TOGETHER = ("navigation", "people")
"""Processes that are ended side by side: neither needs the other."""

SIMULATOR, MISSIONS, BASE, LOCALISER = "simulator", "florence_bt", "turtlebot_node", "localiser"
"""Nodes of which the supervisor knows what their end means."""

REMAPPINGS = (
    "turtlebot_node:cmd_vel:=filtered_cmd_vel",
    "turtlebot_node:manual_cmd_vel:=filtered_manual_cmd_vel",
)
"""The base takes its commands from the velocity filter, not from navigation (REFERENCE 6.5)."""

CLOCK_WAIT_S = 600.0
"""Seconds that the recorder waits for the time of a simulation that is about to come up."""

OWN_CLOCK = "/clock:=clock"
"""Each simulated robot has a time of its own."""

Factory = Callable[[], "FlorenceNode"]


def node_classes() -> dict[str, str]:
    """Return ``module:Class`` of every node, also of those that other packages bring."""
    own = {name: f"florence_bt.{place}" for name, place in NODE_CLASSES.items()}
    return own | {each.node: each.node_class for each in package_processes()}


def node_class(name: str) -> type[FlorenceNode]:
    """Import the class of a node; takes up to a second."""
    module, _, kind = node_classes()[name].partition(":")
    found: type[FlorenceNode] = getattr(importlib.import_module(module), kind)
    return found


def loaded_for(process: str, options: BringUp) -> list[str]:
    """Return what the fork server loads for a process: the modules of its nodes, and what makes these."""
    nodes, classes = processes(options)[process], node_classes()
    tables = (MADE_WITH, SIMULATED_WITH) if options.in_flat else (MADE_WITH,)
    return [
        *(classes[node].partition(":")[0] for node in nodes),
        *(module for node in nodes for table in tables for module in table.get(node, ())),
    ]


def refuse_wrong_parameters(config: Config) -> None:
    """Check a configuration against the parameters of every node (:func:`check_config`).

    Raises:
        ConfigError: With the place in the file.
    """
    check_config(config, {name: partial(node_class, name) for name in node_classes()})


def remappings(options: BringUp) -> tuple[str, ...]:
    """Return the rules of every process that go before those of the user."""
    return (*REMAPPINGS, OWN_CLOCK) if options.simulated and options.namespace else REMAPPINGS


def processes(options: BringUp) -> dict[str, tuple[str, ...]]:
    """Return the processes of a bring-up with their nodes, both in the order of their start."""
    absent = {
        "recorder": not options.has_recorder,
        "simulator": not options.in_flat,
        "hardware": options.base == "running",
        "navigation": options.nav == "nav2",
        "people": options.missions_only,
    }
    found = {group: names for group, names in NODES.items() if not absent.get(group)}
    found |= {each.name: (each.node,) for each in wanted_processes(options)}
    if options.missions_only:
        found["missions"] = ("florenceLocator", "home_sensors", *found["missions"])
    without = {
        *(["home_sensors"] if options.home_file is None else []),
        *(["speech"] if _speaks_by(options) == NONE else []),
        *(WITHOUT_MAPPING if options.mapping else MAPPING),
    }
    kept = {group: tuple(name for name in names if name not in without) for group, names in found.items()}
    return {name: (name,) for names in kept.values() for name in names} if options.split else kept


def process_of(node: str, options: BringUp) -> str:
    """Return the process that a node is in; empty when this bring-up has no such node."""
    return next((name for name, nodes in processes(options).items() if node in nodes), "")


def ended_together(options: BringUp) -> list[str]:
    """Return the processes that are ended side by side."""
    nodes = {node for group in ENDED_TOGETHER for node in NODES[group]}
    return [name for name, its in processes(options).items() if nodes.issuperset(its)]


def observers(options: BringUp) -> set[str]:
    """Return the processes that nothing depends on: when one hangs or dies, nothing stops or waits."""
    nodes = {RECORDER, *(each.node for each in package_processes())}
    return {name for name, its in processes(options).items() if nodes.issuperset(its)}


def companions(process: str, options: BringUp) -> list[str] | None:
    """Return the processes that start again with one that died, because they rely on what it knew.

    A new driver of the base counts its odometry from zero, so the localisation begins anew, at the last pose
    that it kept. A localisation that is not ours cannot be told, and a map that is made would have a tear.

    Args:
        process: The one that died.
        options: The bring-up.

    Returns:
        Their names; None when the process itself cannot be started again.
    """
    nodes = processes(options)[process]
    torn = options.nav != "own" or options.mapping
    if SIMULATOR in nodes or (BASE in nodes and torn) or not set(MAPPING).isdisjoint(nodes):
        return None
    localiser = process_of(LOCALISER, options)
    return [localiser] if BASE in nodes and localiser != process else []


def _speaks_by(options: BringUp) -> str | None:
    return options.speech or config_of(options).of("speech").get("program")


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


def factories(process: str, options: BringUp) -> list[Factory]:
    """Return how to build the nodes of one process.

    Raises:
        ConfigError: Unknown process, or a wrong configuration.
    """
    known = processes(options)
    if process not in known:
        raise ConfigError(f"unknown process {process!r}", valid=closest_first(process, known))
    settings = _Settings(options)
    added = {each.node: each.parameters(options) for each in wanted_processes(options)}
    return [
        _MAKERS.get(node, partial(_plain, node, **added.get(node, {})))(settings) for node in known[process]
    ]


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
            replace_files({file: b"" if self.options.has_no_places else flat.read_bytes()})
        return file

    def of(self, node: str, **overrides: Any) -> Parameters:
        """Return the parameters of a node; simulated ones follow the simulated time."""
        known = parameter_names(node_class(node).parameter_classes)
        return self.config.of(node, known, use_sim_time=self.options.simulated or None, **overrides)

    def port(self, name: str) -> str | None:
        """Return a port of the simulated hardware; None where the configuration says which."""
        if not self.options.in_flat:
            return None
        from florence_bt.app.bringup.simulated import hardware_settings

        return str(getattr(hardware_settings(self.options), name))

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
        value = default_s if value is None else value
        if self.options.simulated and self.options.speed > 1.0 and isinstance(value, int | float):
            parameters[name] = value * self.options.speed
        return parameters


# ---- the nodes that need more than their part of the configuration -----------------------------------------


def _plain(node: str, settings: _Settings, **overrides: Any) -> Factory:
    return partial(node_class(node), parameters=settings.of(node, **overrides))


def recorder_parameters(options: BringUp) -> Parameters:
    """Return the parameters of the recorder; the configuration may say where the recordings go."""
    given = _Settings(options).of(
        "recorder",
        folder=None if options.record else "",
        foxglove_port=options.foxglove_port or None,
        clock_wait=CLOCK_WAIT_S if options.simulated else None,
    )
    # It takes the time from what it records: to follow the clock besides would be a sixth of its work.
    given.pop("use_sim_time", None)
    return {"folder": str(Path(options.folder).resolve() / "recordings")} | given


def _recorder(settings: _Settings) -> Factory:
    return partial(node_class("recorder"), parameters=recorder_parameters(settings.options))


def _simulator(settings: _Settings) -> Factory:
    from florence_bt.simulation.hardware.node import SimulatorNode

    options = settings.options
    parameters = {"speed": options.speed, "catch_up": options.emulated}
    return partial(SimulatorNode, partial(_make_server, options), parameters=parameters)


def _make_server(options: BringUp) -> HardwareServer:
    from florence_bt.app.bringup.simulated import (
        flat_of,
        hardware_mounts,
        hardware_settings,
        people_at_home,
    )
    from florence_bt.simulation.hardware.server import HardwareServer
    from florence_bt.simulation.home.world import SimulatedWorld

    people = people_at_home(options)
    world = SimulatedWorld(flat_of(options), people=people, start=options.start_pose, seed=options.seed)
    return HardwareServer(world, hardware_mounts(), hardware_settings(options))


def _base(settings: _Settings) -> Factory:
    override_file = str(Path(settings.options.folder) / "manual_override")
    return _plain(BASE, settings, port=settings.port("base_port"), override_file=override_file)


def _laser(settings: _Settings) -> Factory:
    return _plain("hokuyo_node", settings, port=settings.port("laser_port"))


def _kinect(settings: _Settings) -> Factory:
    return _plain("kinect_node", settings, source=settings.port("kinect_socket"))


def _kinect_motor(settings: _Settings) -> Factory:
    if not settings.options.in_flat:
        return _plain("kinect_aux", settings)
    from florence_bt.app.bringup.simulated import simulated_motor
    from florence_bt.drivers.kinect.motor.node import KinectMotorNode

    return partial(KinectMotorNode, parameters=settings.of("kinect_aux"), open_motor=simulated_motor())


def _velocity_filter(settings: _Settings) -> Factory:
    from florence_bt.skills.filters.velocity_filter.velocity_filter import VelocityFilterParameters

    timeout = VelocityFilterParameters().command_timeout
    parameters = settings.with_timeout("velocity_filter", "command_timeout", timeout)
    return partial(node_class("velocity_filter"), parameters=parameters)


def _map_server(settings: _Settings) -> Factory:
    return partial(node_class("map_server"), parameters=settings.of_map_server())


def _localiser(settings: _Settings) -> Factory:
    options, start = settings.options, settings.options.start_pose
    initial: dict[str, Any] = {"pose_file": str(Path(options.folder) / "pose.json")}
    if start is not None:
        # Kept for a localiser that is started again; the next bring-up begins at its own start.
        kept = Path(options.folder) / "simulated_pose.json"
        if not os.environ.get(STARTED_AGAIN):
            kept.unlink(missing_ok=True)
        initial = {
            "initial_x": start.x,
            "initial_y": start.y,
            "initial_yaw": start.yaw,
            "pose_file": str(kept),
        }
    return _plain(LOCALISER, settings, seed=options.seed, **initial)


def _mapping(settings: _Settings) -> Factory:
    from florence_bt.skills.navigation.mapping.drive import SUFFIX

    file = Path(settings.options.folder) / f"mapping{SUFFIX}"
    return _plain("mapping", settings, drive_file=str(file), resumed_drive=settings.options.resumed_drive)


def _navigate(settings: _Settings) -> Factory:
    from florence_bt.skills.navigation.navigate.parameters import CycleParameters

    parameters = settings.with_timeout("navigate", "scan_timeout", CycleParameters().scan_timeout)
    parameters["map_grows"] = settings.options.mapping
    if settings.options.emulated:
        parameters.setdefault("silence_advice", f"is the simulated world too slow here? {TOO_SLOW_ADVICE}")
    return partial(node_class("navigate"), parameters=parameters)


def _locator(settings: _Settings) -> Factory:
    return _plain(
        "florenceLocator",
        settings,
        hotspots_file=str(settings.hotspots_file),
        initial_user_room=settings.options.user_room,
        habits_file=str(Path(settings.options.folder) / "habits.json"),
    )


def _approach(settings: _Settings) -> Factory:
    return partial(node_class("approach_user"), parameters=settings.of_approach())


def _home_sensors(settings: _Settings) -> Factory:
    files = {"home_file": settings.options.home_file, "hotspots_file": str(settings.hotspots_file)}
    return _plain("home_sensors", settings, **files)


def _speech(settings: _Settings) -> Factory:
    return _plain("speech", settings, program=settings.options.speech)


def _missions(settings: _Settings) -> Factory:
    from florence_bt.app.bringup.make_safe import BaseSafety
    from florence_bt.app.bringup.skills_ros import make_skills
    from florence_bt.app.demo.pictures import BackgroundPictures
    from florence_bt.runtime.node import MissionNode
    from florence_bt.skills.navigation.navigate.bindings import ACTIONS_WITHOUT_SKILL, NOT_OF_NAV2
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
            own_skills=[each.skill for each in own_bindings(settings.options)],
            only_used=alone,
            parameters=parameters,
        )
        node.on_close(pictures.close)
        return node

    return mission_node


_MAKERS: dict[str, Callable[[_Settings], Factory]] = {
    "recorder": _recorder,
    SIMULATOR: _simulator,
    BASE: _base,
    "hokuyo_node": _laser,
    "kinect_node": _kinect,
    "kinect_aux": _kinect_motor,
    "velocity_filter": _velocity_filter,
    "map_server": _map_server,
    LOCALISER: _localiser,
    "mapping": _mapping,
    "navigate": _navigate,
    "florenceLocator": _locator,
    "approach_user": _approach,
    "home_sensors": _home_sensors,
    "speech": _speech,
    MISSIONS: _missions,
}
"""Node -> what makes its factory; the others need their part of the configuration only."""
