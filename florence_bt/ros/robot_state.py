"""The state of the robot as a listener hears it: each part with its age, by one rule (:class:`Heard`).

Commands, the page and the bring-up read it here. A listener names the parts that it wants; a part says on
which topic it comes, how often, and what is read of the message.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from action_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from florence_interfaces.msg import ManualOverride, RunState, StopReason, TrackedUsers
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry as OdometryMsg
from rclpy.qos import QoSProfile
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String

from florence_bt.core.diagnosis import DIAGNOSIS_PERIOD_S, Diagnosis, Severity
from florence_bt.core.geometry import Twist2
from florence_bt.core.heard import Heard, PresentTime
from florence_bt.core.topic_names import (
    BATTERY_STATE,
    CURRENT_GOAL,
    DIAGNOSTICS,
    FAILURES,
    LATENESS,
    NAVIGATE_THROUGH_POSES,
    NAVIGATE_TO_POSE,
    ODOMETRY,
    OVERRIDE_STATE,
    PROCESS,
    REFUSALS,
    RUN_STATE,
    SERVERS_STATUS,
    SPEAKING,
    STOP_REASON,
    SUPERVISOR,
    TRACKED_USERS,
)
from florence_bt.ros.conversions import stamp_from_ros, twist_from_ros
from florence_bt.ros.diagnostics import diagnosis_from_ros
from florence_bt.ros.endings import Tellers, tellers_of
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.present_time import PresentTimeOfStamps
from florence_bt.ros.qos import LATCHED, LATCHED_BY_MANY, NO_EVENTS, RELIABLE, SENSOR, STATE

T = TypeVar("T")

LATENESS_PERIOD_S = 2.0
"""Seconds between two words of a process that is late: it is late with its word each second, too."""
SERVERS_PERIOD_S = 5.0
"""Period in which the mission server tells which servers missions lack: discovery takes up to so long."""
PERIODS_S = {LATENESS: LATENESS_PERIOD_S, SERVERS_STATUS: SERVERS_PERIOD_S}
"""Parts of diagnostics that are told less often than the others."""

TOLD_WHILE_IN_TROUBLE = (LATENESS, REFUSALS, FAILURES, SERVERS_STATUS)
"""The parts of diagnostics that are repeated only while they are no good; that they are is told once."""


@dataclass(frozen=True, slots=True)
class BatteryCharge:
    """The charge of the base, as it tells it.

    Attributes:
        charge: Its share of the full charge, 0 to 1; None when the base does not measure it.
        charging: Whether it is charged.
    """

    charge: float | None
    charging: bool = False


@dataclass(frozen=True, slots=True)
class Told(Generic[T]):
    """A part of the state.

    Attributes:
        topic: Where it is told.
        message: The type of its messages.
        qos: How to listen; with a latched one as well, what was told before comes at once.
        read: Makes a value of a message.
        period_s: Seconds between two messages; None for what is told only when it changes.
    """

    topic: str
    message: type
    qos: tuple[QoSProfile, ...]
    read: Callable[[Any], T]
    period_s: float | None = None


def _battery(message: BatteryState) -> BatteryCharge:
    known = math.isfinite(message.percentage)
    charging = message.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING
    return BatteryCharge(float(message.percentage) if known else None, charging)


def _itself(message: Any) -> Any:
    return message


BATTERY = Told(BATTERY_STATE, BatteryState, (SENSOR, LATCHED), _battery, 1.0)
"""Of any base; ours keeps its last message for who comes later."""
OVERRIDE: Told[ManualOverride] = Told(OVERRIDE_STATE, ManualOverride, (LATCHED,), _itself, 0.5)
HELD: Told[str] = Told(
    STOP_REASON, StopReason, (LATCHED,), lambda message: message.text if message.code else ""
)
"""Causes that hold the base, in words; empty when nothing does."""
MOTION: Told[Twist2] = Told(
    ODOMETRY, OdometryMsg, (STATE,), lambda told: twist_from_ros(told.twist.twist), 0.1
)
"""Velocity of the base by its odometry."""
PEOPLE: Told[tuple[int, ...]] = Told(
    TRACKED_USERS, TrackedUsers, (RELIABLE,), lambda message: tuple(sorted(message.user_ids)), 0.2
)
"""The numbers of the people in view, while somebody looks for them."""
RUN: Told[RunState] = Told(RUN_STATE, RunState, (LATCHED,), _itself)
"""The run of a mission that goes on, or the last one."""
SPOKEN: Told[str] = Told(SPEAKING, String, (LATCHED,), lambda message: str(message.data))
"""The sentence that the robot says; empty when it says nothing."""
DRIVE_GOAL: Told[PoseStamped] = Told(CURRENT_GOAL, PoseStamped, (LATCHED,), _itself)
"""The goal of the drive that goes on; one without a frame when it is over."""
GOALS: Told[GoalStatusArray] = Told(
    f"{NAVIGATE_TO_POSE}/_action/status", GoalStatusArray, (LATCHED,), _itself
)
"""The drives to a place, as any navigation of Nav2's actions tells them."""
GOALS_OF_SEVERAL_POSES: Told[GoalStatusArray] = Told(
    f"{NAVIGATE_THROUGH_POSES}/_action/status", GoalStatusArray, (LATCHED,), _itself
)
"""The drives through several poses."""


class RobotState:
    """Listens to the parts of the state that somebody wants.

    Args:
        node: Subscribes.
        time: The clocks by which ages are told; those of stamps when not given.
    """

    def __init__(self, node: FlorenceNode, time: PresentTime | None = None) -> None:
        self.time: PresentTime = PresentTimeOfStamps(node) if time is None else time
        self._node = node
        self._diagnoses: dict[str, Heard[Diagnosis]] = {}
        self._on_diagnosis: list[Callable[[str, Diagnosis], object]] = []
        self._hears_diagnostics = False
        self._tellers: list[Tellers] = []

    def listen(
        self,
        part: Told[T],
        on_news: Callable[[], object] = lambda: None,
        *,
        vouched_by: Heard[Any] | None = None,
    ) -> Heard[T]:
        """Listen to a part; what was heard last of it is brought up to date from now on.

        Args:
            part: The part.
            on_news: Called when it has come, and when nobody is left who has told it
                (:meth:`look_who_is_left`).
            vouched_by: The word that shows that its teller lives, of what is told only when it changes.
        """
        heard: Heard[T] = Heard(self.time, part.period_s, on_news, vouched_by)
        tellers = tellers_of(self._node, part.topic, heard.forget) if part.period_s is None else None
        if tellers is not None:
            self._tellers.append(tellers)

        def take(message: Any) -> None:
            header = None if part.period_s is None else getattr(message, "header", None)
            heard.take(part.read(message), 0.0 if header is None else stamp_from_ros(header.stamp))
            if tellers is not None:
                tellers.heard()

        self._subscribe(part.message, part.topic, take, part.qos)
        return heard

    def look_who_is_left(self) -> None:
        """Forget what is told only when it changes and whose tellers are all gone; to be called often."""
        for tellers in self._tellers:
            tellers.look()

    def listen_to_diagnostics(self, on_diagnosis: Callable[[str, Diagnosis], object] | None = None) -> None:
        """Listen to what all nodes say of how they do; see :meth:`diagnoses`.

        Args:
            on_diagnosis: Is told each line, its name and what it says, as often as it comes.
        """
        if on_diagnosis is not None:
            self._on_diagnosis.append(on_diagnosis)
        if self._hears_diagnostics:
            return
        self._hears_diagnostics = True
        self._subscribe(DiagnosticArray, DIAGNOSTICS, self._take_diagnostics, (RELIABLE, LATCHED_BY_MANY))

    def diagnoses(self, of: str = "", about: str = "") -> Iterator[tuple[str, Heard[Diagnosis]]]:
        """Go over what nodes have said of how they do, by the names of the lines.

        Args:
            of: The node; of each when empty.
            about: What it is about, the end of the name; everything when empty.
        """
        for name, heard in sorted(self._diagnoses.items()):
            node, _, what = name.partition(": ")
            if of in ("", node) and about in ("", what):
                yield name, heard

    def fresh_diagnoses(self, of: str = "", about: str = "") -> Iterator[tuple[str, str, Diagnosis]]:
        """Go over those of :meth:`diagnoses` that are fresh: the node, what it is about, and what is said."""
        for name, heard in self.diagnoses(of, about):
            if (told := heard.fresh) is not None:
                node, _, what = name.partition(": ")
                yield node, what, told

    def diagnosis(self, of: str, about: str) -> Heard[Diagnosis] | None:
        """Return what a node has said last about something; None before it has."""
        return next((heard for _, heard in self.diagnoses(of, about)), None)

    def late(self) -> list[str]:
        """Return which processes are late now, a sentence each."""
        return [
            lateness_text(node, told)
            for node, _, told in self.fresh_diagnoses(about=LATENESS)
            if told.level is not Severity.OK
        ]

    def processes_in_trouble(self) -> dict[str, str]:
        """Return which processes of ``florence up`` do not run as they should, and how they are."""
        return {
            what: told.message
            for _, what, told in self.fresh_diagnoses(SUPERVISOR)
            if told.level is not Severity.OK
        }

    def processes_down(self) -> set[str]:
        """Return which processes of ``florence up`` have died or do not answer, by their names."""
        return {
            what.removeprefix(PROCESS)
            for _, what, told in self.fresh_diagnoses(SUPERVISOR)
            if told.level is Severity.ERROR
        }

    def _subscribe(
        self, message: type, topic: str, take: Callable[[Any], None], qos: tuple[QoSProfile, ...]
    ) -> None:
        for each in qos:  # its events are not wanted: see NO_EVENTS
            self._node.create_subscription(
                message, topic, take, each, judge_stamps=False, event_callbacks=NO_EVENTS
            )

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        stamp = stamp_from_ros(message.header.stamp)
        for status in message.status:
            heard = self._diagnoses.get(status.name)
            if heard is None:
                period_s = PERIODS_S.get(status.name.partition(": ")[2], DIAGNOSIS_PERIOD_S)
                heard = self._diagnoses[status.name] = Heard(self.time, period_s)
            told = diagnosis_from_ros(status)
            ends = told.level is Severity.OK and status.name.partition(": ")[2] in TOLD_WHILE_IN_TROUBLE
            heard.take(told, stamp, repeated=not ends)
            for on_diagnosis in self._on_diagnosis:
                on_diagnosis(status.name, told)


def lateness_text(node: str, told: Diagnosis) -> str:
    """Say that the process of a node is late, for people."""
    return f"the process of {node} is {told.message}: the machine is too busy"
