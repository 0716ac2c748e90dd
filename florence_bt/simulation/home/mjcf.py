"""Writes the MuJoCo model: the flat, the robot on its wheels, and the people as bodies moved from outside.

Geoms collide in two separate families, so that a touch differs from standing: wheels and casters
with the floor, the robot's body with everything else. Rays see only what is in ``SCENE_GROUP``.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence

from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.body import BodyPart, body_parts
from florence_bt.simulation.home.flat import Colour, Flat
from florence_bt.simulation.home.person import PersonSpec

SCENE_GROUP = 0
"""Geom group of everything that is not the robot."""

ROBOT_GROUP = 3
"""Geom group of the robot, which its own sensors do not see."""

WHEEL_SEPARATION_M = 0.26
WHEEL_RADIUS_M = 0.033
"""Source of both: REFERENCE 2.9."""

BASE_RADIUS_M = 0.168
"""Of the bumper's cylinder. Chosen."""
BASE_GEOM = "base"
"""The bumper's cylinder."""

TIMESTEP_S = 0.004
"""Of the physics. Chosen."""

_FLOOR_CONTACT = 1
_BODY_CONTACT = 2
"""Bits of MuJoCo's ``contype`` and ``conaffinity``: what touches the floor, and what touches bodies."""

_PLATES = ((0.085, 0.155), (0.142, 0.155), (0.199, 0.155), (0.45, 0.15), (0.93, 0.13))
"""(height, radius) of the plates in metres; the upper ones carry the camera and the screen."""

_POSTS = ((0.1, 0.09), (0.1, -0.09), (-0.1, 0.09), (-0.1, -0.09))
"""(x, y) of the narrow posts between the plates, metres."""


def build_mjcf(flat: Flat, people: Sequence[PersonSpec], start: Pose2, wheel_friction: float) -> str:
    """Write the model as MJCF text.

    Args:
        flat: Where everything stands.
        people: Who is there; each becomes a mocap body of that name.
        start: Pose of base_footprint in the map frame.
        wheel_friction: Coulomb friction between tyre and floor.
    """
    root = ET.Element("mujoco", model=flat.name)
    ET.SubElement(root, "compiler", angle="radian")
    option = ET.SubElement(
        root, "option", timestep=str(TIMESTEP_S), integrator="implicitfast", cone="elliptic", impratio="10"
    )
    # Unstable physics is an error (step_to of the world); MuJoCo would begin again at the start pose.
    ET.SubElement(option, "flag", warmstart="enable", autoreset="disable")
    world = ET.SubElement(root, "worldbody")
    left, low, right, high = flat.bounds
    _geom(
        world,
        name="floor",
        type="plane",
        pos=((left + right) / 2, (low + high) / 2, 0.0),
        size=((right - left) / 2 + 1.0, (high - low) / 2 + 1.0, 0.1),
        colour=flat.floor_colour,
        contype=0,
        conaffinity=_FLOOR_CONTACT,
        friction=(0.1, 0.005, 0.0001),
    )
    _add_solids(world, flat)
    for spec in people:
        _add_person(world, spec)
    _add_robot(world, start, wheel_friction)
    actuators = ET.SubElement(root, "actuator")
    for side in ("left", "right"):
        ET.SubElement(
            actuators, "velocity", name=side, joint=f"{side}_wheel", kv="0.6", forcerange="-0.6 0.6"
        )
    return ET.tostring(root, encoding="unicode")


def _add_solids(world: ET.Element, flat: Flat) -> None:
    for solid in flat.solids:
        half_height = (solid.top - solid.bottom) / 2
        size = (*solid.half, half_height) if solid.half else (solid.radius, half_height)
        _geom(
            world,
            name=None,
            type="box" if solid.half else "cylinder",
            pos=(solid.x, solid.y, solid.bottom + half_height),
            quat=(math.cos(solid.yaw / 2), 0.0, 0.0, math.sin(solid.yaw / 2)),
            size=size,
            colour=solid.colour,
            contype=0,
            conaffinity=_BODY_CONTACT,
        )


def _add_person(world: ET.Element, spec: PersonSpec) -> None:
    half_yaw = spec.pose.yaw / 2
    body = ET.SubElement(
        world,
        "body",
        name=f"person:{spec.name}",
        mocap="true",
        pos=_numbers((spec.pose.x, spec.pose.y, 0.0)),
        quat=_numbers((math.cos(half_yaw), 0.0, 0.0, math.sin(half_yaw))),
    )
    for part in body_parts(spec):
        half_height = (part.top - part.bottom) / 2
        _geom(
            body,
            name=None,
            type=part.shape,
            pos=(part.x, part.y, part.bottom + half_height),
            size=_part_size(part, half_height),
            colour=part.colour,
            contype=0,
            conaffinity=_BODY_CONTACT,
            quat=_orientation(part),
        )


def _orientation(part: BodyPart) -> tuple[float, ...]:
    """Return a part's tilt about y, then its turn about z, as a quaternion."""
    turn, tilt = part.turn / 2, part.tilt / 2
    return (
        math.cos(turn) * math.cos(tilt),
        -math.sin(turn) * math.sin(tilt),
        math.cos(turn) * math.sin(tilt),
        math.sin(turn) * math.cos(tilt),
    )


def _part_size(part: BodyPart, half_height: float) -> tuple[float, ...]:
    return part.size if part.shape == "sphere" else (*part.size, half_height)


def _add_robot(world: ET.Element, start: Pose2, wheel_friction: float) -> None:
    robot = ET.SubElement(
        world,
        "body",
        name="robot",
        pos=_numbers((start.x, start.y, 0.0)),
        quat=_numbers((math.cos(start.yaw / 2), 0.0, 0.0, math.sin(start.yaw / 2))),
    )
    ET.SubElement(robot, "freejoint", name="robot")
    # 3.5 kg base with its battery, 2.5 kg superstructure and laptop.
    ET.SubElement(robot, "inertial", pos="0 0 0.12", mass="6.0", diaginertia="0.25 0.25 0.07")
    _robot_geom(robot, BASE_GEOM, "cylinder", (0.0, 0.0, 0.05), (BASE_RADIUS_M, 0.03))
    for index, (height, radius) in enumerate(_PLATES):
        _robot_geom(robot, f"plate_{index}", "cylinder", (0.0, 0.0, height), (radius, 0.004))
    for index, (x, y) in enumerate(_POSTS):
        _robot_geom(robot, f"post_{index}", "cylinder", (x, y, 0.51), (0.008, 0.43))
    for name, x in (("front", 0.13), ("rear", -0.13)):
        _geom(
            robot,
            name=f"caster_{name}",
            type="sphere",
            pos=(x, 0.0, 0.015),
            size=(0.015,),
            colour=(40, 40, 40),
            group=ROBOT_GROUP,
            contype=_FLOOR_CONTACT,
            conaffinity=0,
            condim=1,
            priority=2,
            solref=(0.02, 1.0),
        )
    for side, y in (("left", WHEEL_SEPARATION_M / 2), ("right", -WHEEL_SEPARATION_M / 2)):
        _add_wheel(robot, side, y, wheel_friction)


def _add_wheel(robot: ET.Element, side: str, y: float, friction: float) -> None:
    """Add a wheel that touches the floor in one point: round in every direction, like a narrow tyre."""
    wheel = ET.SubElement(robot, "body", name=f"{side}_wheel", pos=_numbers((0.0, y, WHEEL_RADIUS_M)))
    ET.SubElement(
        wheel, "joint", name=f"{side}_wheel", type="hinge", axis="0 1 0", armature="0.002", damping="0.001"
    )
    ET.SubElement(wheel, "inertial", pos="0 0 0", mass="0.15", diaginertia="1e-4 1.5e-4 1e-4")
    _geom(
        wheel,
        name=f"{side}_wheel",
        type="sphere",
        pos=(0.0, 0.0, 0.0),
        size=(WHEEL_RADIUS_M,),
        colour=(30, 30, 30),
        group=ROBOT_GROUP,
        contype=_FLOOR_CONTACT,
        conaffinity=0,
        condim=3,
        priority=1,
        friction=(friction, 0.005, 0.0001),
    )


def _robot_geom(
    parent: ET.Element, name: str, shape: str, pos: tuple[float, ...], size: tuple[float, ...]
) -> None:
    _geom(
        parent,
        name=name,
        type=shape,
        pos=pos,
        size=size,
        colour=(60, 60, 66),
        group=ROBOT_GROUP,
        contype=_BODY_CONTACT,
        conaffinity=0,
        friction=(0.3, 0.005, 0.0001),
    )


def _geom(
    parent: ET.Element, *, name: str | None, colour: Colour, group: int = SCENE_GROUP, **values: object
) -> None:
    attributes = {"group": str(group), "rgba": _numbers((*(channel / 255 for channel in colour), 1.0))}
    if name is not None:
        attributes["name"] = name
    for key, value in values.items():
        attributes[key] = _numbers(value) if isinstance(value, tuple) else str(value)
    ET.SubElement(parent, "geom", attributes)


def _numbers(values: Iterable[object]) -> str:
    return " ".join(repr(value) for value in values)
