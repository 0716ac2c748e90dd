"""The mission server under a lifecycle manager: a plain node of rclpy in a process of its own plays it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, ClassVar

import pytest

from florence_bt.core.outcome import cancelled
from florence_bt.mission_testing.mocks.mocks import Step
from tests.ros.conftest import MissionBench

pytestmark = pytest.mark.ros

MANAGER = """\
import sys
import rclpy
from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetState

rclpy.init()
node = rclpy.create_node("lifecycle_manager")
node.create_subscription(
    TransitionEvent,
    "florence_bt/transition_event",
    lambda event: print("event", event.transition.label, event.goal_state.label, flush=True),
    10,
)


def call(kind, name, request):
    client = node.create_client(kind, f"florence_bt/{name}")
    assert client.wait_for_service(60.0)
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future)
    return future.result()


for word in sys.argv[1:]:
    transition = Transition(id=int(word)) if word.isdigit() else Transition(label=word)
    done = call(ChangeState, "change_state", ChangeState.Request(transition=transition)).success
    state = call(GetState, "get_state", GetState.Request()).current_state
    print(word, done, state.id, state.label, flush=True)
print("end", flush=True)
"""


class ManagedBench(MissionBench):
    parameters: ClassVar[dict[str, bool]] = {"autostart": False}


@pytest.fixture
def bench(ros: Any, tmp_path: Path) -> ManagedBench:
    return ManagedBench(ros, tmp_path, (Step(None, cancel_takes=3600.0),))


@pytest.fixture
def manage(ros: Any, start_process: Any) -> Any:
    def manage(*transitions: str, until: str = "end") -> str:
        manager = start_process(sys.executable, "-c", MANAGER, *transitions)
        ros.spin_until(lambda: until in manager.output or manager.process.poll(), what=until)
        assert until in manager.output, manager.output
        return manager.output

    return manage


def test_a_manager_starts_and_stops_it(ros: Any, bench: ManagedBench, manage: Any) -> None:
    refused = bench.run("drive_once")
    assert not refused.accepted and "unconfigured" in refused.message
    # The numbers that Nav2's manager sends: configure, activate.
    told = manage("3", "1", "3")
    assert "3 False 1 unconfigured" in told and "1 True 2 inactive" in told and "3 True 3 active" in told
    assert "event activate activating" in told and "event transition_success active" in told
    assert bench.run("drive_once").accepted
    ros.spin_until(lambda: bench.drive.runs, what="the drive")
    manager = manage("deactivate", until="event deactivate deactivating")
    ros.spin_until(lambda: bench.drive.runs[-1].cancelled, what="the cancel")
    assert "deactivate True" not in manager, "the robot has not stopped yet"
    assert "deactivating" in bench.run("drive_once").message
    bench.end_drive(cancelled())
    assert "the mission server is deactivating" in bench.wait("STOPPED").reason
    ros.spin_until(lambda: "inactive" in bench.status().blocked_by, what="the end of the transition")
    assert "inactive" in bench.trigger("be_quick").message
    told = manage("activate", "activate", "shutdown")
    assert "activate False 3 active" in told and "shutdown True 4 finalized" in told
    assert "finalized" in bench.run("be_quick").message


def test_configuring_loads_the_missions_anew(bench: ManagedBench, manage: Any) -> None:
    manage("configure", "cleanup")
    (bench.missions / "late.yaml").write_text("mission: late\ntree:\n  wait: 1 ms\n")
    assert "cleanup" not in manage("configure", "activate").splitlines()[0]
    assert bench.trigger("late").success
    bench.wait("SUCCEEDED")


def test_by_itself_it_is_active(ros: Any, bench_of: Any, manage: Any) -> None:
    bench = bench_of(Step(None))
    assert bench.trigger("be_quick").success
    assert "deactivate True 2 inactive" in manage("deactivate")
