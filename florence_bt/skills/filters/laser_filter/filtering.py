"""The laser filter as a component: scans in, filtered scans out, one for one.

Source: document, section 3.5.1.
"""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.errors import ConfigError
from florence_bt.core.ports import Delivery, Output, Ports, Topic
from florence_bt.core.sensing import LaserScan
from florence_bt.core.topic_names import (
    FILTERED_KINECT_LOW_SCAN,
    FILTERED_KINECT_OVERHANG_SCAN,
    FILTERED_KINECT_SCAN,
    FILTERED_LASER_SCAN,
    FILTERED_SCAN,
    KINECT_LOW_SCAN,
    KINECT_OVERHANG_SCAN,
    KINECT_SCAN,
    SCAN,
    SCAN_COMBINED,
)
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilter, LaserFilterParameters

OF_THE_KINECT = {
    SCAN: FILTERED_LASER_SCAN,
    KINECT_SCAN: FILTERED_KINECT_SCAN,
    KINECT_LOW_SCAN: FILTERED_KINECT_LOW_SCAN,
    KINECT_OVERHANG_SCAN: FILTERED_KINECT_OVERHANG_SCAN,
}
"""Topic that is filtered -> topic of the result, when the scans of the Kinect are filtered on their own."""


@dataclass(frozen=True, slots=True)
class LaserFilterTopics:
    """The topics that the component listens to.

    Attributes:
        input_topic: The scan to filter (the document remaps ``scan`` to ``scan_combined``).
        filter_kinect: Whether ``kinect_scan``, ``kinect_low_scan`` and ``kinect_overhang_scan`` are filtered
            too, for costmap layers of their own in which the laser's far beams do not clear what only the
            Kinect sees; and ``scan``, the laser's alone, which tells what of that has left.
    """

    input_topic: str = SCAN_COMBINED
    filter_kinect: bool = False

    def __post_init__(self) -> None:
        if not self.input_topic:
            raise ConfigError(
                "input_topic is empty", valid=("input_topic: scan_combined", "input_topic: scan")
            )


class LaserFiltering:
    """Filters every scan as it comes."""

    def __init__(self, ports: Ports, parameters: LaserFilterParameters, topics: LaserFilterTopics) -> None:
        self._ports = ports
        self._filter = LaserFilter(parameters)
        self._connect(topics.input_topic, FILTERED_SCAN)
        if topics.filter_kinect:
            for source, result in OF_THE_KINECT.items():
                self._connect(source, result)

    def _connect(self, source: str, result: str) -> None:
        output: Output[LaserScan] = self._ports.output(Topic(result, LaserScan, Delivery.SENSOR))

        def pass_on(scan: LaserScan) -> None:
            output.send(self._filter.filter(scan))

        self._ports.listen(Topic(source, LaserScan, Delivery.SENSOR), pass_on)
