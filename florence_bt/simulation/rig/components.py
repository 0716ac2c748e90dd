"""The components of the rig, each connected with its part of the configuration, as its node is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

from florence_bt.core.geometry import Pose2
from florence_bt.ros.parameters import fill_dataclass
from florence_bt.simulation.rig.wires import Wires
from florence_bt.skills.filters.depth_to_laser.fake_laser import FakeLaserParameters, ThrottleParameters
from florence_bt.skills.filters.depth_to_laser.low_obstacles import LowObstacleParameters
from florence_bt.skills.filters.depth_to_laser.overhangs import OverhangParameters
from florence_bt.skills.filters.depth_to_laser.projecting import DepthProjecting
from florence_bt.skills.filters.laser_combinator.combining import LaserCombining
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters
from florence_bt.skills.filters.laser_filter.filtering import LaserFiltering, LaserFilterTopics
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilterParameters
from florence_bt.skills.filters.velocity_filter.limiting import VelocityLimiting
from florence_bt.skills.filters.velocity_filter.velocity_filter import VelocityFilterParameters
from florence_bt.skills.locator.hotspots import Hotspots
from florence_bt.skills.locator.locating import Locating, LocatorParameters
from florence_bt.skills.locator.locator import Locator
from florence_bt.skills.navigation.localisation.localising import Localising, LocalisingParameters
from florence_bt.skills.navigation.localisation.parameters import LocaliserParameters
from florence_bt.skills.navigation.mapping.growing_map import GrowingMapParameters, MapMaker
from florence_bt.skills.navigation.mapping.map_making import MapMaking, MapMakingParameters
from florence_bt.skills.navigation.navigate.navigation import (
    Navigation,
    NavigationParameters,
)
from florence_bt.skills.navigation.navigate.parameters import NavigatorParameters
from florence_bt.skills.people.approach_user.approaching import Approaching, ApproachParameters
from florence_bt.skills.people.user_tracker.detector import Network, network_says
from florence_bt.skills.people.user_tracker.parameters import (
    DetectorParameters,
    LookParameters,
    TrackerParameters,
)
from florence_bt.skills.people.user_tracker.tracking import (
    UserTracking,
    UserTrackingParameters,
)
from florence_bt.skills.robot_description.room import RoomParameters
from florence_bt.skills.speech.speaking import Speaking
from florence_bt.skills.speech.voice import SilentVoice

T = TypeVar("T")
Config = Mapping[str, Mapping[str, Any]]
"""Parameters by node name."""


def parameters_of(cls: type[T], config: Config, node: str) -> T:
    """Return the part of a node's configuration that a pure component has parameters for."""
    return fill_dataclass(cls, config.get(node, {}).get)


def navigator_parameters(config: Config) -> NavigatorParameters:
    """Return all parameters of navigation from the flat section of the node ``navigate``."""
    return NavigatorParameters.read(lambda cls: parameters_of(cls, config, "navigate"))


def connect_localiser(wires: Wires, config: Config, start: Pose2, seed: int) -> None:
    """Connect localisation.

    Args:
        wires: Connect it.
        config: Parameters by node name.
        start: Where the robot believes to be at first, map frame.
        seed: Start of the random numbers.
    """
    own = parameters_of(LocalisingParameters, config, "localiser")
    Localising(
        wires.ports("localiser"),
        parameters_of(LocaliserParameters, config, "localiser"),
        replace(own, seed=seed, initial_x=start.x, initial_y=start.y, initial_yaw=start.yaw),
    )


def connect_mapping(wires: Wires, config: Config, maker: MapMaker) -> None:
    """Connect what makes the map in place of localisation."""
    MapMaking(
        wires.ports("mapping"),
        maker,
        parameters_of(GrowingMapParameters, config, "mapping"),
        parameters_of(MapMakingParameters, config, "mapping"),
    )


def connect_filters(wires: Wires, config: Config) -> None:
    """Connect the filters of velocities, scans and depth pictures."""

    def of(kind: type[T], node: str) -> T:
        return parameters_of(kind, config, node)

    VelocityLimiting(wires.ports("velocity_filter"), of(VelocityFilterParameters, "velocity_filter"))
    DepthProjecting(
        wires.ports("kinect_laser"),
        of(FakeLaserParameters, "kinect_laser"),
        of(LowObstacleParameters, "kinect_laser"),
        of(OverhangParameters, "kinect_laser"),
        of(ThrottleParameters, "kinect_laser"),
    )
    LaserCombining(wires.ports("laser_combinator"), of(CombinatorParameters, "laser_combinator"))
    LaserFiltering(
        wires.ports("laser_filter"),
        of(LaserFilterParameters, "laser_filter"),
        of(LaserFilterTopics, "laser_filter"),
    )


def connect_navigation(wires: Wires, config: Config) -> Navigation:
    """Connect navigation, and return it."""
    own = parameters_of(NavigationParameters, config, "navigate")
    return Navigation(wires.ports("navigate"), navigator_parameters(config), own)


def connect_user_tracking(wires: Wires, config: Config, network: Network = network_says) -> None:
    """Connect the user tracker; ``network`` tells it what pictures show."""
    node = "user_tracker_ni_node"
    UserTracking(
        wires.ports(node),
        parameters_of(UserTrackingParameters, config, node),
        parameters_of(DetectorParameters, config, node),
        parameters_of(TrackerParameters, config, node),
        parameters_of(LookParameters, config, node),
        network=network,
    )


def connect_approach(wires: Wires, config: Config) -> None:
    """Connect what proposes where to approach a user; it knows of the robot's room what navigation does."""
    Approaching(
        wires.ports("approach_user"),
        parameters_of(ApproachParameters, config, "approach_user"),
        parameters_of(RoomParameters, config, "navigate"),
    )


def connect_locator(wires: Wires, config: Config, hotspots: Hotspots, user_room: str) -> Locator:
    """Connect the locator, and return what it knows.

    Args:
        wires: Connect it.
        config: Parameters by node name.
        hotspots: The rooms and objects.
        user_room: Where the user was last seen, empty for unknown.
    """
    own = parameters_of(LocatorParameters, config, "florenceLocator")
    return Locating(
        wires.ports("florenceLocator"), hotspots, replace(own, initial_user_room=user_room)
    ).locator


def connect_voice(wires: Wires) -> None:
    """Connect a voice that takes its time and makes no sound."""
    Speaking(wires.ports("speech"), SilentVoice(wires.clock))
