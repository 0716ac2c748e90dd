"""The frames of a URDF text: which sits where on which. Only the standard library reads the XML."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.transforms import Transform3, TransformBuffer

StaticFrame = tuple[str, str, Transform3]
"""(parent, child, transform that takes points of the child to the parent)."""

RIGID = "fixed"
AT_ZERO = ("continuous", "revolute")
"""Joints that move a link in place (wheels); their frame is given at the joint's zero."""


@dataclass(frozen=True, slots=True)
class TurningJoint:
    """A joint that turns, such as a wheel's.

    Attributes:
        name: As joint_states calls it.
        parent: The link that it sits on.
        child: The link that it turns.
        origin: parent from child at zero.
        axis: Shape (3,), unit length, in the child's frame.
    """

    name: str
    parent: str
    child: str
    origin: Transform3
    axis: NDArray[np.float64]

    def at(self, angle: float) -> Transform3:
        """Return the transform of the parent from the child.

        Args:
            angle: Radians.
        """
        x, y, z = self.axis * math.sin(angle / 2.0)
        turn = Transform3.from_quaternion((0.0, 0.0, 0.0), (x, y, z, math.cos(angle / 2.0)))
        return self.origin @ turn


def turning_joints(urdf_text: str) -> list[TurningJoint]:
    """Return the joints of a robot that turn, in the order of the file.

    Raises:
        ConfigError: As :func:`static_frames`, or an axis has no direction.
    """
    at_zero = {child: (parent, transform) for parent, child, transform in static_frames(urdf_text)}
    joints = []
    for joint in ElementTree.fromstring(urdf_text).findall("joint"):
        if joint.get("type") not in AT_ZERO:
            continue
        name = _attribute(joint, "name", "a <joint>")
        link = joint.find("child")
        assert link is not None  # static_frames has checked it
        child = str(link.get("link"))
        axis = np.array(_triple(joint.find("axis"), "xyz", name, default="1 0 0"))
        length = float(np.linalg.norm(axis))
        if length == 0.0:
            raise ConfigError(f"the axis of joint {name!r} has no direction", valid=('xyz="0 1 0"',))
        parent, origin = at_zero[child]
        joints.append(TurningJoint(name, parent, child, origin, axis / length))
    return joints


def static_frames(urdf_text: str) -> list[StaticFrame]:
    """Read the frames of a robot.

    Args:
        urdf_text: URDF, as xacro makes it.

    Returns:
        One entry per joint, parents before their children.

    Raises:
        ConfigError: The text is not URDF, a joint is not usable, or the links do not form one tree.
    """
    try:
        robot = ElementTree.fromstring(urdf_text)
    except ElementTree.ParseError as error:
        line, column = error.position
        raise ConfigError(
            f"the robot description is not XML: {error}", line=line, column=column + 1
        ) from error
    if robot.tag != "robot":
        raise ConfigError(f"the robot description starts with <{robot.tag}>", valid=("<robot>",))
    links = [_attribute(link, "name", "a <link>") for link in robot.findall("link")]
    for link in links:
        if link.startswith("/"):
            raise ConfigError(f"frame names have no leading slash: {link!r}", valid=(link.lstrip("/"),))
    joints = [_frame_of_joint(joint, links) for joint in robot.findall("joint")]
    return _in_tree_order(links, joints)


def fill_buffer(buffer: TransformBuffer, frames: list[StaticFrame]) -> None:
    """Put all the frames into a transform buffer."""
    for parent, child, transform in frames:
        buffer.set_static(parent, child, transform)


def _frame_of_joint(joint: ElementTree.Element, links: list[str]) -> StaticFrame:
    name = _attribute(joint, "name", "a <joint>")
    kind = _attribute(joint, "type", f"joint {name!r}")
    if kind != RIGID and kind not in AT_ZERO:
        raise ConfigError(
            f"joint {name!r} has the type {kind!r}, whose frame is not static", valid=(RIGID, *AT_ZERO)
        )
    ends = []
    for end in ("parent", "child"):
        element = joint.find(end)
        if element is None:
            raise ConfigError(f"joint {name!r} has no {end}", valid=(f'<{end} link="..."/>',))
        link = _attribute(element, "link", f"the {end} of joint {name!r}")
        if link not in links:
            raise ConfigError(
                f"joint {name!r} names an unknown link {link!r}", valid=closest_first(link, links)
            )
        ends.append(link)
    origin = joint.find("origin")
    xyz, rpy = (_triple(origin, key, name) for key in ("xyz", "rpy"))
    return ends[0], ends[1], Transform3.from_xyz_rpy(xyz, rpy)


def _triple(
    element: ElementTree.Element | None, key: str, joint: str, default: str = "0 0 0"
) -> tuple[float, ...]:
    text = default if element is None else element.get(key, default)
    try:
        numbers = tuple(float(word) for word in text.split())
    except ValueError:
        numbers = ()
    if len(numbers) != 3 or not all(math.isfinite(number) for number in numbers):
        raise ConfigError(
            f"{key}={text!r} of joint {joint!r} is not three numbers", valid=(f'{key}="0 0 0"',)
        )
    return numbers


def _in_tree_order(links: list[str], joints: list[StaticFrame]) -> list[StaticFrame]:
    """Sort the joints from the root outwards and check that they form one tree."""
    if len(set(links)) != len(links):
        twice = next(link for link in links if links.count(link) > 1)
        raise ConfigError(f"link {twice!r} is defined twice")
    children: dict[str, list[StaticFrame]] = {}
    parent_of: dict[str, str] = {}
    for joint in joints:
        parent, child, _ = joint
        if child in parent_of:
            raise ConfigError(f"link {child!r} hangs on both {parent_of[child]!r} and {parent!r}; one may be")
        parent_of[child] = parent
        children.setdefault(parent, []).append(joint)
    roots = [link for link in links if link not in parent_of]
    if len(roots) != 1:
        found = ", ".join(roots) or "none: the joints form a loop"
        raise ConfigError(f"a robot has exactly one link without a parent; found {found}")
    ordered: list[StaticFrame] = []
    waiting = [roots[0]]
    for link in waiting:
        for joint in children.get(link, ()):
            ordered.append(joint)
            waiting.append(joint[1])
    if len(ordered) != len(joints):
        reached = {child for _, child, _ in ordered}
        lost = ", ".join(child for _, child, _ in joints if child not in reached)
        raise ConfigError(f"these links form a loop apart from the robot: {lost}")
    return ordered


def _attribute(element: ElementTree.Element, key: str, owner: str) -> str:
    value = element.get(key)
    if not value:
        raise ConfigError(f"{owner} has no {key}", valid=(f'{key}="..."',))
    return value
