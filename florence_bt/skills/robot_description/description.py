"""Loads the robot's xacro file: the URDF text and the frames in it. Reads nothing before it is asked to."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from xml.parsers.expat import ExpatError

from florence_bt.core.errors import ConfigError
from florence_bt.core.paths import find_data
from florence_bt.core.transforms import TransformBuffer
from florence_bt.skills.robot_description.footprint import FLORENCE_FOOTPRINT, Footprint, corners_from_flat
from florence_bt.skills.robot_description.frames import (
    StaticFrame,
    TurningJoint,
    fill_buffer,
    static_frames,
    turning_joints,
)

FILE_NAME = "florence.urdf.xacro"


@dataclass(frozen=True, slots=True)
class DescriptionParameters:
    """Parameters of the robot description.

    Attributes:
        file: A xacro or URDF file; empty takes the one that comes with Florence.
        footprint: Outline on the floor, x, y, x, y, ... of its corners, metres in base_footprint
            (document, section 3.3.2).
    """

    file: str = ""
    footprint: tuple[float, ...] = FLORENCE_FOOTPRINT

    def __post_init__(self) -> None:
        Footprint.from_corners(corners_from_flat(self.footprint))


@dataclass(frozen=True, slots=True)
class RobotDescription:
    """A robot as its file describes it.

    Attributes:
        urdf_text: The URDF.
        frames: All frames, parents before children; those of turning joints at zero.
        joints: The joints that turn.
    """

    urdf_text: str
    frames: tuple[StaticFrame, ...]
    joints: tuple[TurningJoint, ...] = ()

    @property
    def fixed_frames(self) -> tuple[StaticFrame, ...]:
        """The frames that never move."""
        turning = {joint.child for joint in self.joints}
        return tuple(frame for frame in self.frames if frame[1] not in turning)

    def fill(self, buffer: TransformBuffer) -> None:
        """Put all the frames into a transform buffer."""
        fill_buffer(buffer, list(self.frames))


def load_description(file: str | Path = "") -> RobotDescription:
    """Load a robot description; each file is read once per process.

    Args:
        file: A xacro or URDF file; empty takes the one that comes with Florence.

    Raises:
        ConfigError: The file is missing or wrong.
    """
    return _load(Path(file).resolve() if file else default_file())


def default_file() -> Path:
    """Return the description that comes with Florence."""
    return find_data("urdf", FILE_NAME)


@functools.cache
def _load(path: Path) -> RobotDescription:
    urdf_text = _expand(path)
    try:
        frames, joints = static_frames(urdf_text), turning_joints(urdf_text)
    except ConfigError as error:
        # Line and column of the expanded text mean nothing in the file.
        raise ConfigError(error.problem, file=path, valid=error.valid) from error
    return RobotDescription(urdf_text, tuple(frames), tuple(joints))


def _expand(path: Path) -> str:
    """Run xacro, which works without ROS."""
    import xacro

    if not path.is_file():
        near = sorted(str(other) for other in path.parent.glob("*.xacro"))
        raise ConfigError(
            "the robot description does not exist", file=path, valid=near or ("a .urdf.xacro file",)
        )
    try:
        document = xacro.process_file(str(path))
    except ExpatError as error:
        raise ConfigError(
            f"not well-formed XML: {error}", file=path, line=error.lineno, column=error.offset + 1
        ) from error
    except Exception as error:
        # xacro evaluates Python expressions of the file, which may raise anything.
        raise ConfigError(f"xacro cannot expand it: {error}", file=path) from error
    # The comment that xacro puts on top holds the path, which differs from machine to machine.
    for node in list(document.childNodes):
        if node.nodeType == node.COMMENT_NODE:
            document.removeChild(node)
    return str(document.toprettyxml(indent="  "))
