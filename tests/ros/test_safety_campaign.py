"""Some overrides of the campaign: nothing moves until the release, whatever the mission server does."""

from __future__ import annotations

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.timeout(1800)]


def test_overrides_hold_the_robot_with_the_mission_server_alive_hung_and_dead(ros_domain: int) -> None:
    pytest.importorskip("rclpy")
    from tools.safety_campaign.overrides import SERVERS, SHIFT_M, override_many, overrides_table

    trials = override_many(6, seed=11, say=lambda text: None)
    assert [trial.server for trial in trials] == [server for server in SERVERS for _ in range(2)]
    for trial in trials:
        assert not trial.commanded and trial.shifted_m < SHIFT_M, trial
        assert trial.standing_s < 5.0, f"it never stood: {trial}"
    assert overrides_table(trials).count("\n") >= 4
