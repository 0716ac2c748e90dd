"""The simulator as a node: what goes wrong in its thread ends the process."""

from __future__ import annotations

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.simulation.node import SimulatorNode

pytestmark = pytest.mark.ros


def test_a_world_that_cannot_be_made_is_reported_and_not_a_silent_standstill(ros):
    def broken():
        raise ConfigError("the flat has no floor")

    ros.add(SimulatorNode(broken))
    with pytest.raises(ConfigError, match="no floor"):
        ros.spin_until(lambda: False, timeout_s=20.0)
