"""Goals of the base that no mission sent: they are shown, and ended by stop and by the override."""

from __future__ import annotations

import uuid
from typing import Any

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("florence_interfaces")
from florence_interfaces.srv import MissionStatus, RunMission, StopMission
from nav2_msgs.action import Spin
from std_srvs.srv import SetBool
from unique_identifier_msgs.msg import UUID

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import Outcome, success
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.action_skill import ActionSkill
from florence_bt.ros.node import FlorenceNode
from florence_bt.runtime.node import MissionNode
from tests.ros.override_driver import OverrideDriver

pytestmark = pytest.mark.ros

TURN = SkillDeclaration("spin_arm", "A skill of another package.", resources=frozenset({"arm"}))
LOOK = SkillDeclaration("look", "A skill that occupies nothing.")


class Server(FlorenceNode):
    """Serves three actions; a goal goes on until it is cancelled."""

    def __init__(self) -> None:
        super().__init__("server")
        self.goals: dict[str, SingleGoalServer] = {}
        for name in ("spin_arm", "look", "follow_path"):
            self.goals[name] = SingleGoalServer(
                self,
                Spin,
                name,
                on_goal=lambda goal: None,
                on_cancel=lambda name=name: self.goals[name].finish(Spin.Result(), Outcome.CANCELLED),
            )


class Bench:
    def __init__(self, ros: Any, tmp_path: Any) -> None:
        self.ros = ros
        (tmp_path / "turn.yaml").write_text("mission: turn\ntree:\n  spin_arm:\n")
        self.server = ros.add(Server())
        self.missions = ros.add(
            MissionNode(
                lambda node: {name: skill(node, name) for name in ("spin_arm", "look")},
                {"spin_arm": TURN, "look": LOOK},
                other_actions=("follow_path",),
                parameters={"runs_folder": str(tmp_path / "runs"), "mission_folders": (str(tmp_path),)},
            )
        )
        self.node = ros.add(FlorenceNode("somebody"))
        self.driver = ros.add(OverrideDriver())
        self._clients: dict[str, Any] = {}

    def send_goal(self, name: str) -> str:
        """Send a goal that no mission knows of; gives what the status says of it."""
        kind = Spin.Impl.SendGoalService
        client = self.node.create_client(kind, f"{name}/_action/send_goal")
        self.ros.spin_until(client.service_is_ready, what=name)
        goal_id = uuid.uuid4()
        request = kind.Request(goal_id=UUID(uuid=list(goal_id.bytes)), goal=Spin.Goal(target_yaw=1.0))
        future = client.call_async(request)
        self.ros.spin_until(future.done, what="the acceptance")
        assert future.result().accepted
        return f"{name} (goal {goal_id.hex[:8]})"

    def call(self, kind: Any, name: str, **fields: Any) -> Any:
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self.node.create_client(kind, f"florence_bt/{name}")
        self.ros.spin_until(client.service_is_ready, what=name)
        future = client.call_async(kind.Request(**fields))
        self.ros.spin_until(future.done, what=f"the answer of {name}")
        return future.result()

    def unowned(self) -> list[str]:
        return list(self.call(MissionStatus, "status").unowned_goals)


def skill(node: FlorenceNode, name: str) -> ActionSkill:
    return ActionSkill(
        node,
        Spin,
        name,
        to_goal=lambda inputs: Spin.Goal(target_yaw=1.0),
        to_result=lambda message, outcome: success(),
    )


@pytest.fixture
def bench(ros: Any, tmp_path: Any) -> Bench:
    return Bench(ros, tmp_path)


def test_a_goal_of_somebody_else_is_shown_and_stop_ends_it(bench: Bench) -> None:
    answer = bench.call(StopMission, "stop")
    assert not answer.success and answer.message == "no mission is running"
    bench.send_goal("look")
    shown = bench.send_goal("spin_arm")
    assert bench.ros.spin_until(bench.unowned, what="the goal in the status") == [shown]
    answer = bench.call(StopMission, "stop")
    assert answer.success
    assert answer.message == f"no mission is running; cancelled, owned by no mission: {shown}"
    bench.ros.spin_until(lambda: not bench.server.goals["spin_arm"].active, what="the end of the goal")
    bench.ros.spin_until(lambda: not bench.unowned(), what="the status without it")
    assert bench.server.goals["look"].active, "it occupies nothing, so it is not ours to end"
    bench.server.goals["look"].finish(Spin.Result(), Outcome.SUCCEEDED)
    bench.ros.spin_for(0.1)


def test_stop_ends_a_goal_that_no_skill_could_send(bench: Bench) -> None:
    shown = bench.send_goal("follow_path")
    assert bench.ros.spin_until(bench.unowned, what="the goal in the status") == [shown]
    assert bench.call(StopMission, "stop").success
    bench.ros.spin_until(lambda: not bench.server.goals["follow_path"].active, what="the end of the goal")


def test_stop_ends_the_docking_of_the_base(bench: Bench) -> None:
    asked: list[bool] = []

    def dock(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        asked.append(request.data)
        return response

    bench.server.create_service(SetBool, "turtlebot_node/dock", dock)
    watcher = bench.node.create_client(SetBool, "turtlebot_node/dock")
    bench.ros.spin_until(watcher.service_is_ready, what="the base")

    def ends() -> bool:
        bench.call(StopMission, "stop")  # it may not have met the base yet
        return bool(asked)

    bench.ros.spin_until(ends, what="the end of docking")
    assert set(asked) == {False}


def test_the_goal_of_a_mission_is_its_own(bench: Bench) -> None:
    assert bench.call(RunMission, "run_mission", mission="turn").accepted
    bench.ros.spin_until(lambda: bench.server.goals["spin_arm"].active, what="the goal of the mission")
    bench.ros.spin_for(0.2)
    assert bench.unowned() == []
    answer = bench.call(StopMission, "stop")
    assert answer.success and answer.message.endswith("-turn stops")


def test_the_override_ends_them(bench: Bench) -> None:
    bench.send_goal("spin_arm")
    bench.ros.spin_until(bench.unowned, what="the goal in the status")
    bench.driver.override.stop()
    bench.ros.spin_until(lambda: not bench.server.goals["spin_arm"].active, what="the end of the goal")
