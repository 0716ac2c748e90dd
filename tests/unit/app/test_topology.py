"""What the processes of a bring-up give their nodes."""

from __future__ import annotations

import pytest

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.topology import factories

TIMEOUTS = [
    ("hardware", "VelocityFilterNode", "command_timeout"),
    ("navigation", "NavigationNode", "scan_timeout"),
]


@pytest.mark.ros
@pytest.mark.parametrize(("group", "node", "name"), TIMEOUTS)
@pytest.mark.parametrize(("speed", "factor"), [(0.5, 1.0), (1.0, 1.0), (4.0, 4.0)])
def test_what_finds_out_silence_has_the_real_time_of_the_robot(tmp_path, group, node, name, speed, factor):
    pytest.importorskip("rclpy")
    file = tmp_path / "robot.yaml"
    file.write_text("velocity_filter: {command_timeout: 0.25}\n")
    options = BringUp(folder=str(tmp_path), speed=speed, config_file=str(file))
    (made,) = (part for part in factories(group, options) if part.func.__name__ == node)
    assert made.keywords["parameters"].get(name, 0.25) == 0.25 * factor


@pytest.mark.ros
def test_only_a_real_robot_that_is_given_no_start_goes_on_where_it_was(tmp_path):
    pytest.importorskip("rclpy")

    def of_localiser(**options):
        made = factories("navigation", BringUp(folder=str(tmp_path), **options))
        (localiser,) = (part for part in made if part.func.__name__ == "LocaliserNode")
        return localiser.keywords["parameters"]

    assert of_localiser(simulated=False)["pose_file"] == str(tmp_path / "pose.json")
    given = of_localiser(simulated=False, start=(1.0, 2.0, 0.5))
    assert "pose_file" not in given
    assert given["initial_yaw"] == 0.5
    assert "pose_file" not in of_localiser()
