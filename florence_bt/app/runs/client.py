"""Talks to a running system from the command line: triggers, status, the live tree."""

from __future__ import annotations

import functools
import json
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import rclpy
from florence_interfaces.msg import RunState
from florence_interfaces.msg import RunTree as RunTreeMsg
from florence_interfaces.srv import (
    AnswerQuestion,
    GetXYPhi,
    ListMissions,
    MissionStatus,
    PauseMission,
    ReloadMissions,
    ResumeMission,
    RunMission,
    SetBreakpoints,
    StopMission,
)
from std_msgs.msg import String
from std_srvs.srv import Trigger

from florence_bt.app.bringup.locks import bring_up_here
from florence_bt.app.bringup.options import STARTS
from florence_bt.app.bringup.signals import held_back
from florence_bt.core.closing import Closing, ending_anyway
from florence_bt.core.errors import DeviceTimeout, FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.topic_names import RUN_STATE, RUN_TREE, SAY, SIMULATOR_TRUTH
from florence_bt.ros.arguments import start_ros, where_else
from florence_bt.ros.domain_neighbours import DomainNeighbours
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE

if TYPE_CHECKING:
    from florence_bt.ros.robot_state import RobotState
    from florence_bt.runtime.viewers.run_tree import RunTree

ACTIVE_STATES = ("PENDING", "ACTIVE")
"""States of a run that is not over."""
ANSWER_BUDGET_S = 5.0
"""Wall seconds to wait for the answer of a service that is there, and for a service to be discovered."""
BUSY_BUDGET_S = 25.0
"""Wall seconds more for each of the two while a bring-up is seen on this machine: perhaps it starts its
mission server again, or the machine is busy."""
_TRIES = 3
"""Times that a question that may be repeated is asked within the time for its answer."""
LOOK_S, DISCOVERY_LOOK_S = 0.05, 0.005
"""Wall seconds between two looks at what is waited for, while no callback runs: usually, and while something
is discovered, of which no callback tells."""
LAST_MESSAGES_S = 0.2
"""Wall seconds for the last messages of a node that was served."""
RELOAD_BUDGET_S = 30.0
"""Wall seconds for the answer to a reload: every mission that changed is checked."""
OVERRIDDEN = "manual override"
"""The mission server's status while the override is on."""
LOCATOR = "florenceLocator"
"""Node name of the locator, and the first part of its services' names."""
ROBOT_POSE = f"{LOCATOR}/getRobotPosXYPhi"
"""The service that tells where the robot is."""
MISSION_SERVER = "florence_bt"
"""Node name of the mission server."""
RUN_MISSION = f"{MISSION_SERVER}/run_mission"
"""The service that starts missions."""
STATUS_SERVICE = f"{MISSION_SERVER}/status"
"""The service that tells how a run is."""


class SystemNotThere(FlorenceError):
    """No running system answers."""


LEAVING_S = 30.0
"""Wall seconds. Chosen: leaving takes a tenth of one. Fast DDS may hang there for ever when others end at the
same moment (its issue 6502): an ``up`` that had ended everything kept its lock for minutes."""


class MissionClient(Closing):
    """A client of the mission server. Use as a context manager.

    Args:
        name: Node name of this client.

    Attributes:
        told_tree: What was told last of a run and its tree, as a message; None before the first.
        state: The run of a mission that goes on, or the last one.
        state_is_told: Whether the mission server has told it: one that hangs is there and tells nothing.
        truth: What the simulator says is really so, while somebody follows it.
    """

    def __init__(self, name: str = "florence_client") -> None:
        self._context = rclpy.Context()
        self._neighbours = DomainNeighbours()
        reach = start_ros(self._context)
        self.node = FlorenceNode(name, context=self._context, of_a_command=True)
        self._neighbours.started(reach)
        self._loop = SpinLoop(self._context)
        self._loop.add(self.node)
        self._clients: dict[str, Any] = {}
        self.told_tree: RunTreeMsg | None = None
        self.state = RunState(state="IDLE")
        self.state_is_told = False
        self.truth: Mapping[str, Any] = {}
        self.node.create_subscription(RunTreeMsg, RUN_TREE, self._on_tree, LATCHED)
        self.node.create_subscription(RunState, RUN_STATE, self._on_state, LATCHED)

    @functools.cached_property
    def robot(self) -> RobotState:
        """Listen to the robot's state, from the first use on."""
        from florence_bt.ros.robot_state import RobotState  # loads messages that few commands need

        return RobotState(self.node)

    def close(self) -> None:
        """Leave ROS; a process that does not get out of it ends all the same."""
        with ending_anyway(LEAVING_S):
            self.node.shut_down()
            self._loop.close()
            self.node.destroy_node()
            rclpy.shutdown(context=self._context)

    @contextmanager
    def serving(self, make: Callable[[rclpy.Context], FlorenceNode]) -> Iterator[FlorenceNode]:
        """Serve one more node while the block runs; it is closed, and its last messages sent, at the end."""
        node = make(self._context)
        self._loop.add(node)
        try:
            yield node
        finally:
            with held_back():
                node.shut_down()
                self.spin_until(lambda: False, LAST_MESSAGES_S)
                self._loop.remove(node)
                node.destroy_node()

    def tree_of(self, run_id: str) -> RunTree | None:
        """Return a run with its tree as it was told last, any run without an id; None if that was another."""
        told = self.told_tree
        if told is None or (run_id and told.run_id != run_id):
            return None
        from florence_bt.app.runs.run_trees import (
            run_tree_from_ros,
        )  # loads py_trees, which stop has no use for

        return run_tree_from_ros(told)

    def follow_speech(self, show: Callable[[str], None]) -> None:
        """Call back with each sentence that the robot begins to say."""
        self.node.create_subscription(String, SAY, lambda message: show(message.data), RELIABLE)

    def follow_truth(self) -> None:
        """Keep ``truth`` up to date with what the simulator says is really so."""
        self.node.create_subscription(String, SIMULATOR_TRUTH, self._on_truth, LATCHED)

    def spin_until(
        self,
        done: Callable[[], bool],
        budget_s: float,
        *,
        watch: Callable[[], None] | None = None,
        every_s: float = 0.0,
        look_s: float = LOOK_S,
    ) -> bool:
        """Serve callbacks until a condition holds.

        Args:
            done: The condition.
            budget_s: Wall seconds at most.
            watch: Called between callbacks, e.g. to raise when a process has died.
            every_s: Wall seconds between two looks at the condition; 0 looks after each callback.
            look_s: Wall seconds after which to look when no callback runs.

        Returns:
            Whether the condition holds.

        Raises:
            KeyboardInterrupt: A signal asked for the end meanwhile.
        """
        end = time.monotonic() + budget_s
        next_look = -math.inf
        # Callbacks run below C++ code, which does not survive a KeyboardInterrupt: it comes at the end.
        with held_back() as interrupted:
            while True:
                if time.monotonic() >= next_look:
                    if done():
                        return True
                    next_look = time.monotonic() + every_s
                if watch is not None:
                    watch()
                if interrupted() or time.monotonic() > end:
                    return False
                self._loop.spin_once(look_s)

    def call(
        self,
        service_type: Any,
        name: str,
        request: Any,
        *,
        repeat: bool = False,
        budget_s: float = ANSWER_BUDGET_S,
    ) -> Any:
        """Call a service and wait for the answer.

        Args:
            service_type: The service.
            name: Its name.
            request: The request.
            repeat: Ask again when no answer comes, for questions that change nothing: the answer to a client
                that is brand new can be lost, because the server may not know the way back to it yet.
            budget_s: Wall seconds to wait for the answer; more while a bring-up is seen on this machine.

        Raises:
            SystemNotThere: It has no server.
            DeviceTimeout: It does not answer.
        """
        client = self._client(service_type, name)
        if not self.wait_for(lambda: bool(client.service_is_ready())):
            begun = "a florence up is about to start it: look at its terminal" if bring_up_here() else ""
            start = begun or f"is the system up? Start it with: {', or '.join(STARTS)}"
            raise SystemNotThere(
                f"no server of {self.node.resolve_service_name(name)} was found; "
                f"{where_else(self._namespaces()) or start}"
            )
        begin, future = time.monotonic(), client.call_async(request)
        while not self.spin_until(future.done, budget_s / _TRIES):
            passed = time.monotonic() - begin
            enough = passed >= budget_s + BUSY_BUDGET_S or (passed >= budget_s and not bring_up_here())
            if repeat or enough:
                client.remove_pending_request(future)
            if enough:
                raise DeviceTimeout(f"{name} did not answer within {passed:.0f} s")
            if repeat:
                future = client.call_async(request)
        return future.result()

    def patience(self, budget_s: float) -> float:
        """Return the wall seconds for which to look for a part of the system; 0 where nobody can be.

        Args:
            budget_s: The time in which a part that is there is discovered.
        """
        return 0.0 if self._neighbours.certainly_none() and not bring_up_here() else budget_s

    def wait_for(self, shows: Callable[[], bool]) -> bool:
        """Wait until a part of the system shows, longer while a bring-up is seen on this machine."""
        patience = time.monotonic() + self.patience(ANSWER_BUDGET_S)

        def settled() -> bool:
            return shows() or (time.monotonic() > patience and not bring_up_here())

        most = ANSWER_BUDGET_S + BUSY_BUDGET_S
        return self.spin_until(settled, most, look_s=DISCOVERY_LOOK_S) and shows()

    def expect(self, service_type: Any, name: str) -> None:
        """Begin to look for a service, so that it is found by the time that it is called."""
        self._client(service_type, name)

    def _client(self, service_type: Any, name: str) -> Any:
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self.node.create_client(service_type, name)
        return client

    def knows_pose(self) -> bool:
        """Tell whether the robot knows where it is."""
        try:
            return self.robot_pose() is not None
        except (SystemNotThere, DeviceTimeout):
            return False  # a start on a busy machine; the caller has a limit of its own

    def robot_pose(self) -> Pose2 | None:
        """Ask where the robot is in the map; None when it does not know.

        Raises:
            SystemNotThere: There is no locator.
            DeviceTimeout: It does not answer.
        """
        answer = self.call(GetXYPhi, ROBOT_POSE, GetXYPhi.Request(), repeat=True)
        return Pose2(answer.x, answer.y, answer.phi) if answer.valid else None

    def sees(self, node: str) -> bool:
        """Tell whether a node has been discovered."""
        return node in self.node.get_node_names()

    def servers(self) -> int:
        """Return how many mission servers have been discovered in our namespace."""
        return self._namespaces().count(self.node.get_namespace())

    def _namespaces(self) -> list[str]:
        """Return the namespace of each mission server that has been discovered."""
        nodes = self.node.get_node_names_and_namespaces()
        return [where for name, where in nodes if name == MISSION_SERVER]

    def run(
        self, mission: str, inputs: Mapping[str, str], *, caller: str, policy: str = "", priority: int = 0
    ) -> Any:
        """Trigger a mission; the answer has accepted, run_id and message."""
        request = RunMission.Request(
            mission=mission,
            input_names=list(inputs),
            input_values=list(inputs.values()),
            caller=caller,
            policy=policy,
            priority=priority,
        )
        return self.call(RunMission, RUN_MISSION, request)

    def status(self, run_id: str = "") -> Any:
        """Ask for the status of a run, or of the current or last one.

        Args:
            run_id: The run; empty for the current or last one.
        """
        return self.call(MissionStatus, STATUS_SERVICE, MissionStatus.Request(run_id=run_id), repeat=True)

    def ask_status(self) -> Any:
        """Ask for the status without waiting; the answer comes in the future that is returned."""
        return self.ask(MissionStatus, STATUS_SERVICE, MissionStatus.Request())

    def ask(self, service_type: Any, name: str, request: Any) -> Any:
        """Call a service without waiting; the answer comes in the future that is returned."""
        return self._client(service_type, name).call_async(request)

    def drop(self, name: str, future: Any) -> None:
        """Wait no more for what :meth:`ask` asked."""
        self._clients[name].remove_pending_request(future)

    def stop(self, reason: str, run_id: str = "") -> Any:
        """Stop a run, or the current one."""
        return self.call(StopMission, "florence_bt/stop", StopMission.Request(run_id=run_id, reason=reason))

    def pause(self, reason: str, run_id: str = "") -> Any:
        """Pause a run, or the current one; the answer has success and message."""
        request = PauseMission.Request(run_id=run_id, reason=reason)
        return self.call(PauseMission, "florence_bt/pause", request)

    def resume(self, run_id: str = "") -> Any:
        """Go on with a paused run, or the current one; the answer has success and message."""
        return self.call(ResumeMission, "florence_bt/resume", ResumeMission.Request(run_id=run_id))

    def step(self, run_id: str = "") -> Any:
        """Let a run, or the current one, go on to its next leaf; the answer has success and message."""
        return self.call(ResumeMission, "florence_bt/step", ResumeMission.Request(run_id=run_id))

    def breakpoints(self, add: Sequence[str] = (), remove: Sequence[str] = (), *, clear: bool = False) -> Any:
        """Set breakpoints and take others away; the answer has success, message and breakpoints."""
        request = SetBreakpoints.Request(add=list(add), remove=list(remove), clear=clear)
        return self.call(SetBreakpoints, "florence_bt/breakpoints", request)

    def reload(self) -> Any:
        """Let the mission server read its mission files again; the answer has success and report."""
        return self.call(
            ReloadMissions,
            "florence_bt/reload_missions",
            ReloadMissions.Request(),
            budget_s=RELOAD_BUDGET_S,
        )

    def answer(self, text: str) -> Any:
        """Answer the question that is open; without a text ask which it is. Gives accepted and message."""
        return self.call(AnswerQuestion, "florence_bt/answer", AnswerQuestion.Request(text=text))

    def reload_places(self) -> Any:
        """Let the locator read its hotspot file again; the answer has success and message."""
        return self.call(Trigger, f"{LOCATOR}/reloadHotspots", Trigger.Request(), repeat=True)

    def missions(self) -> Any:
        """Return the missions that the mission server has, with their inputs; see ListMissions."""
        return self.call(ListMissions, "florence_bt/list_missions", ListMissions.Request(), repeat=True)

    def _on_tree(self, message: RunTreeMsg) -> None:
        self.told_tree = message

    def _on_state(self, message: RunState) -> None:
        self.state, self.state_is_told = message, True

    def _on_truth(self, message: String) -> None:
        self.truth = json.loads(message.data)


def is_paused(state: RunState) -> bool:
    """Tell whether a run stands still until somebody resumes it.

    The document's goal states have none for that; but of a run that goes on ``run_state`` gives no reason,
    and of a paused one it says why.
    """
    return state.state == "ACTIVE" and bool(state.reason)


class OpenQuestion:
    """One question at a time to a service, asked without waiting; one without an answer is dropped.

    Args:
        client: The client that is spun meanwhile.
        patience_s: Wall seconds after which a question counts as lost.
    """

    def __init__(self, client: MissionClient, patience_s: float = ANSWER_BUDGET_S) -> None:
        self._client = client
        self._patience_s = patience_s
        self._asked: tuple[str, Any, float] | None = None

    def take(self) -> Any:
        """Return the answer, once; None while there is none."""
        if self._asked is None or not self._asked[1].done():
            return None
        answer, self._asked = self._asked[1].result(), None
        return answer

    def ask(self, service_type: Any, name: str, request: Any) -> bool:
        """Ask, unless a question is open; tell whether it was asked."""
        now = time.monotonic()
        if self._asked is not None:
            asked, future, since = self._asked
            if now - since < self._patience_s:
                return False
            self._client.drop(asked, future)
        self._asked = (name, self._client.ask(service_type, name, request), now)
        return True


ASK_PERIOD_S = 2.0
"""Wall seconds between two questions to the mission server."""
RESTART_S = 60.0
"""Wall seconds without an answer after which it is gone although its bring-up runs, which starts it again."""
LIVE_STATES = ("QUEUED", "RUNNING", "PAUSED", "ENDING")
"""States of a run that is not over, as the status service has them."""


class RunWatch:
    """Knows whether a run is over.

    The topic ``run_state`` says so at once, but keeps one message only: the start of the next run may hide
    the end of this one. So the mission server is asked now and then, which shows as well that it is there.

    Args:
        client: The client that is spun meanwhile.
        run_id: The run; empty to watch nothing but the mission server.
    """

    def __init__(self, client: MissionClient, run_id: str = "") -> None:
        self._client = client
        self._run_id = run_id
        self._answered = time.monotonic()
        self._next_question = self._answered + ASK_PERIOD_S
        self._unanswered = 0

    def over(self) -> bool:
        """Tell whether the run has ended.

        Raises:
            SystemNotThere: The mission server went away, or does not know the run.
        """
        state = self._client.state
        if self._run_id and state.run_id == self._run_id and state.state not in ACTIVE_STATES:
            return True
        if time.monotonic() < self._next_question:
            return False
        over = self._ask()
        self._next_question = time.monotonic() + ASK_PERIOD_S
        return over

    def result(self) -> Any:
        """Return the status of the run once it is over.

        Raises:
            SystemNotThere: The mission server went away meanwhile; the run was stopped by its end, or before.
        """
        try:
            return self._client.status(self._run_id)
        except (SystemNotThere, DeviceTimeout) as error:
            raise self._gone() from error

    def _ask(self) -> bool:
        try:
            status = self._client.status(self._run_id)
        except (SystemNotThere, DeviceTimeout) as error:
            self._unanswered += 1
            enough = isinstance(error, SystemNotThere) or self._unanswered > 1
            if enough and not (bring_up_here() and time.monotonic() < self._answered + RESTART_S):
                raise self._gone() from error
            return False
        self._unanswered = 0
        self._answered = time.monotonic()
        if self._run_id and not status.found:
            raise SystemNotThere(f"the mission server was restarted and does not know the run {self._run_id}")
        return bool(self._run_id) and status.state not in LIVE_STATES

    def _gone(self) -> SystemNotThere:
        state = self._client.state
        last = (
            f"; its last reason was: {state.reason}" if state.run_id == self._run_id and state.reason else ""
        )
        return SystemNotThere(f"the mission server went away, see the logs of the bring-up{last}")
