"""The parameters of the laser combinator."""

from __future__ import annotations

import math
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError, closest_first

RANGE_MAX_SOURCES = ("largest", "kinect")
STAMP_SOURCES = ("laser", "kinect")


@dataclass(frozen=True, slots=True)
class CombinatorParameters:
    """Parameters of the laser combinator (REFERENCE 6.3; document, table 9).

    Attributes:
        frame_id: Frame written on the output; empty takes the laser's own.
        kinect_frame_id: Frame of the Kinect scan for ``project_origin``; empty takes the scan's own.
        max_ang: Kinect ranges are used only in beams whose angle is at most this, either way, in radians
            (document: ``hokuyo_node/max_ang``).
        freshness: Both scans must be younger than this, in seconds, or nothing is published.
        upside_down: The laser hangs upside down (REFERENCE 4.11), so its beam at angle a looks towards -a.
            Without ``project_origin`` this is all that is known of the mounting.
        project_origin: Move the Kinect's points into the laser frame instead of comparing equal angles from
            two different places. False is the old behaviour.
        range_max_source: "largest" keeps the laser's hits beyond the Kinect's reach; "kinect" writes the
            Kinect's range_max, as the old component did.
        stamp_source: Whose stamp the output carries.
        allow_partial: Go on with one scan while the other is stale. False is the old behaviour.
    """

    frame_id: str = ""
    kinect_frame_id: str = "camera_depth_frame"
    max_ang: float = 1.570
    freshness: float = 1.0
    upside_down: bool = True
    project_origin: bool = False
    range_max_source: str = "largest"
    stamp_source: str = "laser"
    allow_partial: bool = False

    def __post_init__(self) -> None:
        if not 0.0 < self.max_ang <= math.pi:
            raise ConfigError(
                f"max_ang ({self.max_ang}) must be an angle in (0, pi]", valid=("max_ang: 1.570",)
            )
        if not 0.0 < self.freshness < math.inf:
            raise ConfigError(
                f"freshness ({self.freshness}) must be above zero seconds", valid=("freshness: 1.0",)
            )
        for name, choices in (("range_max_source", RANGE_MAX_SOURCES), ("stamp_source", STAMP_SOURCES)):
            value = getattr(self, name)
            if value not in choices:
                raise ConfigError(f"{name} cannot be {value!r}", valid=closest_first(str(value), choices))
