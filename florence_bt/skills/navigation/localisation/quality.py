"""Quality of the localisation, for ``diagnostics``."""

from __future__ import annotations

import math

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.topic_names import DEVIATION_DEG, DEVIATION_M, SCAN_FIT
from florence_bt.skills.navigation.localisation.localiser import Localiser


def diagnosis_of(localiser: Localiser) -> Diagnosis:
    """Report what a localiser knows; a warning while there is no pose, or hardly a scan fits there."""
    x, y, yaw = (math.sqrt(max(0.0, variance)) for variance in localiser.covariance.diagonal().tolist())
    values = {
        SCAN_FIT: f"{localiser.fit:.2f}",
        DEVIATION_M: f"{math.hypot(x, y):.3f}",
        DEVIATION_DEG: f"{math.degrees(yaw):.2f}",
    }
    if localiser.lost:
        return Diagnosis(Severity.WARN, "lost: searching the whole map for the robot", values)
    if localiser.map_from_odom is None:
        return Diagnosis(Severity.WARN, "no scan has confirmed yet where the robot is", values)
    if localiser.doubtful:
        return Diagnosis(
            Severity.WARN, "hardly anything of the scan fits the map at the estimated pose", values
        )
    return Diagnosis(Severity.OK, "the place is known", values)
