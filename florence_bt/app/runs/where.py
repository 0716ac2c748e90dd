"""``florence where``: where the robot is and what it is doing, on one screen; what is not known says why."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from action_msgs.msg import GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from florence_interfaces.msg import TrackedUsers
from florence_interfaces.srv import GetRoom, GetUserSeen, GetXYPhi
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState
from std_msgs.msg import Bool

from florence_bt.app.runs.client import (
    ACTIVE_STATES,
    LOCATOR,
    MISSION_SERVER,
    ROBOT_POSE,
    MissionClient,
    SystemNotThere,
    is_paused,
)
from florence_bt.app.runs.whereabouts import GOAL_POSE, GOAL_ROOM, ROBOT_ROOM, DriveWatch
from florence_bt.app.wrapping import hanging
from florence_bt.core.errors import DeviceTimeout
from florence_bt.core.geometry import degrees_text
from florence_bt.ros.conversions import stamp_from_ros
from florence_bt.ros.qos import LATCHED, NO_EVENTS, RELIABLE, SENSOR, STATE
from florence_bt.ros.topics import MANUAL_OVERRIDE, SERVERS_STATUS

if TYPE_CHECKING:
    from rich.console import Console

WAIT_S = 2.5
"""Wall seconds for what is published once a second. Florence's own nodes have the last message ready; others
may not."""
ANOTHER_CLOCK_S = 86_400.0
"""Stamps that are further from the date than this are of another clock, such as that of a simulation."""
OLD_S = 3.0
"""Wall seconds after which such a message is old."""
SEEN_S = 1.5
"""Wall seconds for which a person counts as seen: the camera's node tells of people five times a second."""
WATCH_PERIOD_S = 0.5
USER_SEEN = f"{LOCATOR}/getUserSeen"
_LOCALISER, _MAPPING = "Place in the map", "mapping:"
_GOALS = "navigate_to_pose/_action/status"
_THROUGHS = "navigate_through_poses/_action/status"
_DRIVING = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING)
_ENDS = {"SUCCEEDED": "succeeded", "PREEMPTED": "was stopped", "ABORTED": "failed"}
"""How a run ended, in words, by the goal states of the document that ``run_state`` has."""


@dataclass(frozen=True, slots=True)
class Fact:
    """One thing that is known, or why it is not.

    Attributes:
        text: For people.
        known: Whether it is known.
        values: For programs; metres, degrees, seconds, shares.
    """

    text: str
    known: bool = True
    values: dict[str, Any] = field(default_factory=dict)


class _Latest:
    """The newest message of a topic, and when it came and was sent: a latched one may be old when it comes.

    Args:
        now: The present time of stamps, seconds; None while it is not known.
    """

    def __init__(self, now: Callable[[], float | None] = time.time) -> None:
        self.message: Any = None
        self._at = -math.inf
        self._now = now
        self._sent = 0.0

    def take(self, message: Any, sent: float = 0.0) -> None:
        """Take a message, with its stamp; 0 where it has none."""
        self.message, self._at, self._sent = message, time.monotonic(), sent

    @property
    def of_another_clock(self) -> bool:
        """Tell whether its stamp is not of this machine's date."""
        return bool(self._sent) and abs(time.time() - self._sent) > ANOTHER_CLOCK_S

    @property
    def age(self) -> float:
        """Seconds since it was sent, by its stamp, or since it came; infinity before the first.

        A stamp of a clock that has not been heard tells nothing.
        """
        came, now = time.monotonic() - self._at, self._now()
        if now is None and not self.of_another_clock:
            now = time.time()
        return max(came, now - self._sent) if self._sent and now is not None else came


class Where:
    """Gathers where the robot is from the topics and services of a running system.

    Args:
        client: Talks to the system.
    """

    def __init__(self, client: MissionClient) -> None:
        self._client = client
        self._simulated = _Latest()
        self._battery, self._users, self._localiser = _Latest(self._now), _Latest(), _Latest(self._now)
        self._goals, self._throughs, self._override = _Latest(), _Latest(), _Latest()
        self._servers = _Latest()
        self._drives = DriveWatch(client.node)
        subscribe = client.node.create_subscription
        subscribe(Clock, "/clock", self._simulated.take, STATE)
        # Of any base, and the last message of ours.
        subscribe(BatteryState, "battery_state", self._on_battery, SENSOR)
        subscribe(BatteryState, "battery_state", self._on_battery, LATCHED, event_callbacks=NO_EVENTS)
        subscribe(TrackedUsers, "filtered_tracked_users", self._users.take, RELIABLE)
        subscribe(DiagnosticArray, "diagnostics", self._on_diagnostics, LATCHED, event_callbacks=NO_EVENTS)
        subscribe(GoalStatusArray, _GOALS, self._goals.take, LATCHED)
        subscribe(GoalStatusArray, _THROUGHS, self._throughs.take, LATCHED)
        subscribe(Bool, MANUAL_OVERRIDE, self._override.take, LATCHED)
        for service_type, service in (
            (GetXYPhi, ROBOT_POSE),
            (GetRoom, ROBOT_ROOM),
            (GetUserSeen, USER_SEEN),
        ):
            client.expect(service_type, service)

    def find(self) -> bool:
        """Wait for a system, then a little for what it publishes now and then; tell whether it is there."""
        client, nodes = self._client, (LOCATOR, MISSION_SERVER)
        there = client.wait_for(lambda: any(map(client.sees, nodes)))
        if there:
            client.spin_until(lambda: self._told() and all(map(client.sees, nodes)), WAIT_S)
        return there

    def _told(self) -> bool:
        stamped = (self._battery, self._localiser)
        simulated = self._client.node.count_publishers("/clock") > 0
        simulated = simulated or any(each.of_another_clock for each in stamped)
        awaited = (*stamped, *([self._simulated] if simulated else []))
        return all(each.message is not None for each in awaited)

    def facts(self) -> dict[str, Fact]:
        """Return everything: a word for what it is -> what is known of it."""
        missing = self._missing_servers()
        return {
            "robot": self._robot(),
            "certainty": self._certainty(),
            "goal": self._goal(),
            "mission": self._mission(),
            **({"servers": missing} if missing is not None else {}),
            "battery": self._battery_charge(),
            "user": self._user(),
            "seen": self._seen(),
        }

    def _ask(self, service_type: Any, name: str) -> Any:
        if not self._client.sees(LOCATOR):
            raise SystemNotThere("no locator")
        return self._client.call(service_type, name, service_type.Request(), repeat=True)

    def _robot(self) -> Fact:
        try:
            pose, room = self._ask(GetXYPhi, ROBOT_POSE), self._ask(GetRoom, ROBOT_ROOM)
        except (SystemNotThere, DeviceTimeout):
            return Fact("not known: no locator answers", False)
        if not pose.valid:
            return Fact("not known: no transform leads from the map to the robot", False)
        return Fact(
            f"{_in(room)}at {_place(pose)}, heading {degrees_text(pose.phi)}", True, _values(pose, room)
        )

    def _certainty(self) -> Fact:
        status = self._localiser.message
        if status is None:
            return Fact(f"not known: no localiser has told within {WAIT_S:g} s", False)
        values = {value.key: value.value for value in status.values}
        if status.name.startswith(_MAPPING):
            return Fact(status.message, status.level == status.OK)
        fit, metres, degrees = (float(value) for value in list(values.values())[:3])
        text = f"{status.message}; {100 * fit:.0f} % of the scan fits the map"
        text += f", ± {100 * metres:.0f} cm, ± {degrees:.1f} deg" if status.level == status.OK else ""
        if self._localiser.age > OLD_S:
            return Fact(f"not known: the localiser told last {self._localiser.age:.0f} s ago: {text}", False)
        facts = {"fit": fit, "deviation_m": metres, "deviation_deg": degrees}
        return Fact(text, status.level == status.OK, facts)

    def _goal(self) -> Fact:
        if self._goals.message is None and self._throughs.message is None:
            if self._client.node.count_publishers(_GOALS):
                return Fact("none: nothing has been driven to yet")
            return Fact("not known: there is no navigation (navigate_to_pose)", False)
        to_goal = _is_driving(self._goals.message)
        if not to_goal and not _is_driving(self._throughs.message):
            return Fact("none: nothing drives to a place", True)
        values: dict[str, Any] = {}
        text = "a drive has just begun" if to_goal else "a drive through several poses"
        try:
            pose, room = self._ask(GetXYPhi, GOAL_POSE), self._ask(GetRoom, GOAL_ROOM)
        except (SystemNotThere, DeviceTimeout):
            pose = None
        if to_goal and pose is not None and pose.valid:
            text, values = f"{_in(room)}at {_place(pose)}", _values(pose, room)
        drive = self._drives.now()
        if drive is not None and drive.to_goal == to_goal:
            values["distance_left_m"] = round(drive.distance, 3)
            text += f", {drive.distance:.1f} m left"
        return Fact(text, True, values)

    def _mission(self) -> Fact:
        blocked = "; the manual override is on" if getattr(self._override.message, "data", False) else ""
        state = self._client.state
        if not self._client.sees(MISSION_SERVER):
            return Fact(f"not known: no mission server is there{blocked}", False)
        if not state.run_id:
            return Fact(f"none has run yet{blocked}")
        paused = is_paused(state)
        values = {"mission": state.mission, "run_id": state.run_id, "state": state.state, "paused": paused}
        if paused:
            how = f"is paused (run {state.run_id}): {state.reason}; go on with: florence resume"
            return Fact(f"{state.mission} {how}{blocked}", True, values)
        if state.state in ACTIVE_STATES:
            how = "waits for its turn" if state.state == "PENDING" else "runs"
            return Fact(f"{state.mission} {how} (run {state.run_id}){blocked}", True, values)
        reason = f": {state.reason}" if state.reason else ""
        how = _ENDS.get(state.state, state.state)
        return Fact(f"none; the last one, {state.mission}, {how}{reason}{blocked}", True, values)

    def _missing_servers(self) -> Fact | None:
        """Return which servers missions lack, and why; None while none is known to be missing."""
        status = self._servers.message
        missing = {value.key: value.value for value in status.values} if status is not None else {}
        if not missing:
            return None
        lines = "; ".join(f"{skill}: {server}" for skill, server in missing.items())
        return Fact(f"{len(missing)} missing: {lines}", True, missing)

    def _battery_charge(self) -> Fact:
        battery = self._battery.message
        if battery is None or self._battery.age > OLD_S:
            last = "" if battery is None else f", the last time {self._battery.age:.0f} s ago"
            return Fact(f"not known: the base's driver does not tell its battery{last}", False)
        if not math.isfinite(battery.percentage):
            return Fact("not known: the base does not measure its charge", False)
        charging = battery.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING
        share = round(float(battery.percentage), 3)
        text = f"{100 * share:.0f} %, {'charging' if charging else 'not charging'}"
        return Fact(text, True, {"charge": share, "charging": charging})

    def _user(self) -> Fact:
        try:
            seen = self._ask(GetUserSeen, USER_SEEN)
        except (SystemNotThere, DeviceTimeout):
            return Fact("not known: no locator answers", False)
        if not seen.valid:
            return Fact("not known: nothing has told yet where the user is", False)
        values = {"room": seen.room, "age_s": round(seen.age, 1), "source": seen.source}
        return Fact(f"last in {seen.room}, {_ago(seen.age)}, by {seen.source}", True, values)

    def _seen(self) -> Fact:
        users = self._users.message
        if users is None or self._users.age > SEEN_S:
            since = "" if users is None else f" for {_duration(self._users.age)}"
            return Fact(f"not known: nobody has been looked for{since} (the user tracker rests)", False)
        ids = sorted(users.user_ids)
        if not ids:
            return Fact("nobody is in view", True, {"users": []})
        numbers = ", ".join(map(str, ids))
        people = "one person is" if len(ids) == 1 else f"{len(ids)} people are"
        return Fact(f"{people} in view (number {numbers})", True, {"users": ids})

    def _on_battery(self, message: BatteryState) -> None:
        self._battery.take(message, stamp_from_ros(message.header.stamp))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name.endswith(_LOCALISER):
                self._localiser.take(status, stamp_from_ros(message.header.stamp))
            elif status.name == f"{MISSION_SERVER}: {SERVERS_STATUS}":
                self._servers.take(status)

    def _now(self) -> float | None:
        """Return the time of a simulation; None where there is none, or nobody has told it yet."""
        clock = self._simulated.message
        return None if clock is None else stamp_from_ros(clock.clock)


def as_text(facts: dict[str, Fact], columns: int | None = None) -> str:
    """Write the facts for people, one a line, broken at blanks where a terminal has too few columns."""
    width = max(map(len, facts))
    lines = (f"{name:<{width}}  {fact.text}" for name, fact in facts.items())
    return "\n".join(hanging(line, columns) for line in lines)


def as_json(facts: dict[str, Fact]) -> str:
    """Write the facts as a JSON object: for each ``known``, ``text`` and ``values``."""
    return json.dumps({name: asdict(fact) for name, fact in facts.items()}, ensure_ascii=False)


def show_where(console: Console, *, watch: bool, json_lines: bool) -> None:
    """Show where the robot is, once or until Ctrl-C.

    Args:
        console: Where to.
        watch: Whether to go on.
        json_lines: Whether to write JSON, one object a line.

    Raises:
        SystemNotThere: No system is up.
    """
    with MissionClient("florence_where") as client:
        where = Where(client)
        if not where.find():
            raise SystemNotThere("no system was found; is it up? Start it with: florence up --sim")
        _show(
            where,
            where.facts(),
            console,
            watch=watch,
            json_lines=json_lines,
            again=lambda: client.spin_until(lambda: False, WATCH_PERIOD_S),
        )


def _show(
    where: Where,
    facts: dict[str, Fact],
    console: Console,
    *,
    watch: bool,
    json_lines: bool,
    again: Callable[[], object],
) -> None:
    if json_lines or not watch or not console.is_terminal:
        _print(facts, console, json_lines)
        while watch:
            again()
            _print(where.facts(), console, json_lines)
        return
    from rich.live import Live
    from rich.text import Text

    with Live(Text(as_text(facts, console.width)), console=console, auto_refresh=False) as live:
        while True:
            again()
            live.update(Text(as_text(where.facts(), console.width)), refresh=True)


def _print(facts: dict[str, Fact], console: Console, json_lines: bool) -> None:
    columns = console.width if console.is_terminal else None
    text = as_json(facts) if json_lines else as_text(facts, columns)
    console.print(text, highlight=False, markup=False, soft_wrap=True)


def _is_driving(goals: GoalStatusArray | None) -> bool:
    return goals is not None and any(goal.status in _DRIVING for goal in goals.status_list)


def _in(room: Any) -> str:
    return f"in {room.room}, " if room.valid else ""


def _place(pose: Any) -> str:
    return f"({pose.x:.2f} m, {pose.y:.2f} m)"


def _degrees(pose: Any) -> float:
    return math.degrees(math.remainder(pose.phi, math.tau))


def _values(pose: Any, room: Any) -> dict[str, Any]:
    place = {"x": round(pose.x, 3), "y": round(pose.y, 3), "yaw_deg": round(_degrees(pose), 1)}
    return place | ({"room": room.room} if room.valid else {})


def _ago(seconds: float) -> str:
    return "just now" if seconds < 2.0 else f"{_duration(seconds)} ago"


def _duration(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"
