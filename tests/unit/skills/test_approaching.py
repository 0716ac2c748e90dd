"""The approach of a user as a component."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.topics import GLOBAL_COSTMAP, RUN_STATE, RunState
from florence_bt.simulation.rig.skills import rig_skills
from florence_bt.simulation.rig.wires import Wires
from florence_bt.skills.people.approach_user.approach_status import FINAL_REPEATS
from florence_bt.skills.people.approach_user.approaching import (
    PROPOSE,
    STATUS,
    UNCHECKED,
    Approaching,
    ApproachParameters,
)
from florence_bt.skills.robot_description.room import RoomParameters

USER = Pose2(2.0, 0.0)


class Surroundings:
    """The approach, and who publishes costmaps and runs."""

    def __init__(self, **own: Any) -> None:
        self.clock = ManualClock()
        self.wires = Wires(self.clock, [])
        Approaching(self.wires.ports("approach_user"), ApproachParameters(**own), RoomParameters())
        other = self.wires.ports("other")
        self.costmaps, self.runs = other.output(GLOBAL_COSTMAP), other.output(RUN_STATE)
        self.words: list[str] = []
        other.listen(STATUS, self.words.append)

    def send_costmap(self, cost: int) -> None:
        cells = np.full((120, 120), cost, np.int8)
        self.costmaps.send(OccupancyGrid(0.05, Pose2(-2.0, -2.0), cells))
        self.clock.advance(0.0)

    def tell(self, run_id: str, state: str, mission: str = "goto_user") -> None:
        self.runs.send(RunState(run_id, mission, state))
        self.clock.advance(0.0)

    def propose(self, trial: int = 1, safe_distance: float = 0.5) -> Result:
        skill = rig_skills(self.wires)["propose_approach_pose"]
        given = {"user": USER, "robot": Pose2(), "trial": trial, "safe_distance": safe_distance}
        result = skill.start(given).poll()
        assert result is not None
        return result


def test_proposals_look_at_the_newest_costmap() -> None:
    around = Surroundings()
    around.send_costmap(0)
    assert around.propose().outputs["pose"].distance_to(USER) == pytest.approx(0.5)
    assert around.propose(trial=4).outputs["pose"].distance_to(USER) == pytest.approx(0.5, abs=0.05)
    around.send_costmap(100)
    assert around.propose().code == "pose_occupied"


def test_without_a_costmap_a_proposal_says_that_it_is_unchecked() -> None:
    around = Surroundings()
    request = {"user_x": 2.0, "user_y": 0.0, "robot_x": 0.0, "robot_y": 0.0, "trial": 1}
    answer = around.wires.services[PROPOSE.name]({**request, "safe_distance": 0.5})
    assert answer.valid and answer.message == UNCHECKED


def test_a_request_without_a_distance_gets_that_of_the_parameters() -> None:
    around = Surroundings(safe_distance=0.8)
    assert around.propose(safe_distance=0.0).outputs["pose"].distance_to(USER) == pytest.approx(0.8)


def test_the_status_repeats_while_a_run_goes_on_and_its_end_a_few_times() -> None:
    around = Surroundings(status_period_s=0.2)
    around.tell("a", "SUCCEEDED")
    around.clock.advance(5.0)
    assert around.words == [], "the latched end of a run from before"
    around.tell("b", "ACTIVE")
    around.clock.advance(1.1)
    assert around.words == ["ACTIVE"] * 6
    around.tell("b", "PREEMPTED")
    around.clock.advance(5.0)
    assert around.words[6:] == ["ABORTED"] * (1 + FINAL_REPEATS)
    around.tell("c", "ACTIVE", mission="patrol")
    around.clock.advance(1.0)
    assert len(around.words) == 7 + FINAL_REPEATS
