"""The parameters of the laser combinator."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from florence_bt.core.limits import Limits, Positive, check_limits


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
    max_ang: Annotated[float, Limits(0.0, math.pi, above=True)] = 1.570
    freshness: Positive = 1.0
    upside_down: bool = True
    project_origin: bool = False
    range_max_source: Literal["largest", "kinect"] = "largest"
    stamp_source: Literal["laser", "kinect"] = "laser"
    allow_partial: bool = False

    def __post_init__(self) -> None:
        check_limits(self)
