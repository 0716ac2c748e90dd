"""The user tracker on ROS, ``user_tracker_ni_node``: :class:`UserTracking`, its parameters and markers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from visualization_msgs.msg import MarkerArray

from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts
from florence_bt.skills.people.user_tracker.colour_detector import ColourDetector
from florence_bt.skills.people.user_tracker.evidence import Verifier
from florence_bt.skills.people.user_tracker.markers import markers_of
from florence_bt.skills.people.user_tracker.parameters import (
    ColourParameters,
    DetectorParameters,
    LookParameters,
    TrackerParameters,
)
from florence_bt.skills.people.user_tracker.tracking import (
    SHOWN_USERS,
    ShownUsers,
    UserTracking,
    UserTrackingParameters,
)


class UserTrackerNode(FlorenceNode):
    """Tracks people while it is started, and looks for one on demand.

    Args:
        parameters: Overrides of the node's parameters.
        verifier: Is asked about candidates; the colour detector when None, if it is switched on.

    Raises:
        ColourNetworkUnusable: The colour detector is switched on, and its network is damaged or not
            installed.
    """

    parameter_classes = (
        UserTrackingParameters,
        DetectorParameters,
        ColourParameters,
        TrackerParameters,
        LookParameters,
    )

    def __init__(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        verifier: Verifier | None = None,
    ) -> None:
        super().__init__("user_tracker_ni_node", parameters=parameters)
        own = self.read_parameters(UserTrackingParameters)
        colours = self.read_parameters(ColourParameters)
        self._tracking = UserTracking(
            RosPorts(self, {SHOWN_USERS: self._markers}),
            own,
            self.read_parameters(DetectorParameters),
            self.read_parameters(TrackerParameters),
            self.read_parameters(LookParameters),
            verifier or (ColourDetector(colours) if own.colour_detector else None),
        )

    def close(self) -> None:
        """Take no more pictures."""
        self._tracking.close()

    def _markers(self, shown: ShownUsers) -> MarkerArray:
        return markers_of(shown.users, shown.frame, self.stamp(shown.stamp))
