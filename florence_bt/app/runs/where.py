"""``florence where``: where the robot is and what it is doing, on one screen; what is not known says why."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from action_msgs.msg import GoalStatus, GoalStatusArray
from florence_interfaces.srv import GetRoom, GetUserSeen, GetXYPhi

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
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.errors import DeviceTimeout
from florence_bt.core.geometry import degrees_text
from florence_bt.core.heard import Heard, age_text
from florence_bt.core.topic_names import (
    CLOCK,
    DEVIATION_DEG,
    DEVIATION_M,
    PLACE_STATUS,
    SCAN_FIT,
    SERVERS_STATUS,
    SUPERVISOR,
)
from florence_bt.ros.present_time import PresentTimeOfStamps, is_of_another_clock
from florence_bt.ros.robot_state import (
    BATTERY,
    GOALS,
    GOALS_OF_SEVERAL_POSES,
    OVERRIDE,
    PEOPLE,
    RobotState,
)

if TYPE_CHECKING:
    from rich.console import Console

REPORTS_WAIT_S = 2.5
"""Wall seconds for what is published once a second. Florence's own nodes have the last message ready; others
may not."""
WHERE_PERIOD_S = 0.5
"""Period of looking again while it is watched. Chosen."""
USER_SEEN = f"{LOCATOR}/getUserSeen"
_DRIVING = (GoalStatus.STATUS_ACCEPTED, GoalStatus.STATUS_EXECUTING)
_ENDS = {"SUCCEEDED": "succeeded", "PREEMPTED": "was stopped", "ABORTED": "failed"}
"""Ends of a run in words, by the goal states of the document that ``run_state`` has."""


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


class Where:
    """Gathers where the robot is from the topics and services of a running system.

    Args:
        client: Talks to the system.
    """

    def __init__(self, client: MissionClient) -> None:
        self._client = client
        self._time = PresentTimeOfStamps(client.node)
        self._state = state = RobotState(client.node, self._time)
        self._battery, self._people = state.listen(BATTERY), state.listen(PEOPLE)
        self._override = state.listen(OVERRIDE)
        state.listen_to_diagnostics()
        self._goals, self._throughs = state.listen(GOALS), state.listen(GOALS_OF_SEVERAL_POSES)
        self._drives = DriveWatch(client.node)
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
            client.spin_until(lambda: self._told() and all(map(client.sees, nodes)), REPORTS_WAIT_S)
        return there

    def _told(self) -> bool:
        place = self._place()
        if place is None or self._battery.last is None:
            return False
        if self._client.sees(MISSION_SERVER) and not self._client.state_is_told:
            return False
        if self._client.sees(SUPERVISOR) and not any(self._state.diagnoses(SUPERVISOR)):
            return False
        simulated = self._client.node.count_publishers(CLOCK) > 0
        simulated = simulated or any(map(is_of_another_clock, (self._battery.stamp, place.stamp)))
        return not simulated or self._time.simulated() is not None

    def _place(self) -> Heard[Diagnosis] | None:
        """Return what the localiser, or what makes the map, has said about the robot's place."""
        return next((heard for _, heard in self._state.diagnoses(about=PLACE_STATUS)), None)

    def facts(self) -> dict[str, Fact]:
        """Return everything: a word for what it is -> what is known of it."""
        missing = self._missing_servers()
        return {
            "robot": self._robot(),
            "certainty": self._certainty(),
            "goal": self._goal(),
            "mission": self._mission(),
            **({"servers": missing} if missing is not None else {}),
            **({"processes": trouble} if (trouble := self._trouble()) is not None else {}),
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
            return Fact("not known: no transform of the last seconds leads from the map to the robot", False)
        return Fact(
            f"{_in(room)}at {_place(pose)}, heading {degrees_text(pose.phi)}", True, _values(pose, room)
        )

    def _certainty(self) -> Fact:
        heard = self._place()
        if heard is None or heard.last is None:
            return Fact(f"not known: no localiser has told within {REPORTS_WAIT_S:g} s", False)
        place, text, facts = heard.last, heard.last.message, {}
        if SCAN_FIT in place.values:
            fit, metres, degrees = (
                float(place.values[key]) for key in (SCAN_FIT, DEVIATION_M, DEVIATION_DEG)
            )
            text += f"; {100 * fit:.0f} % of the scan fits the map"
            text += f", ± {100 * metres:.0f} cm, ± {degrees:.1f} deg" if place.level is Severity.OK else ""
            facts = {"fit": fit, "deviation_m": metres, "deviation_deg": degrees}
        if heard.fresh is None:
            return Fact(f"not known: the localiser told last {age_text(heard.age)} ago: {text}", False)
        return Fact(text, place.level is Severity.OK, facts)

    def _goal(self) -> Fact:
        if self._goals.last is None and self._throughs.last is None:
            if self._client.node.count_publishers(GOALS.topic):
                return Fact("none: nothing has been driven to yet")
            return Fact("not known: there is no navigation (navigate_to_pose)", False)
        to_goal = _is_driving(self._goals.last)
        if not to_goal and not _is_driving(self._throughs.last):
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
        blocked = self._blocked()
        state = self._client.state
        if not self._client.sees(MISSION_SERVER):
            return Fact(f"not known: no mission server is there{blocked}", False)
        if not self._client.state_is_told:
            return Fact(f"not known: the mission server is there and tells nothing{blocked}", False)
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

    def _blocked(self) -> str:
        """Say that the manual override holds missions; empty when it does not."""
        override = self._override.last
        if override is None or not override.on:
            return ""
        if self._override.fresh is not None:
            return "; the manual override is on"
        return f"; the manual override was on {age_text(self._override.age)} ago, by the driver's last word"

    def _missing_servers(self) -> Fact | None:
        """Return which servers missions lack, and why; None while none is known to be missing."""
        heard = self._state.diagnosis(MISSION_SERVER, SERVERS_STATUS)
        if heard is None or heard.last is None or not heard.last.values:
            return None
        missing = dict(heard.last.values)
        lines = "; ".join(f"{skill}: {server}" for skill, server in missing.items())
        text = f"{len(missing)} missing: {lines}"
        if heard.fresh is None:
            return Fact(f"not known: the mission server told last {age_text(heard.age)} ago: {text}", False)
        return Fact(text, True, missing)

    def _trouble(self) -> Fact | None:
        """Return which processes do not run as they should, or are late; None while all is well."""
        found, late = self._state.processes_in_trouble(), self._state.late()
        lines = [*(f"{what}: {message}" for what, message in found.items()), *late]
        return Fact("; ".join(lines), True, found | {"late": late}) if lines else None

    def _battery_charge(self) -> Fact:
        battery = self._battery.fresh
        if battery is None:
            never = self._battery.last is None
            last = "" if never else f", the last time {age_text(self._battery.age)} ago"
            return Fact(f"not known: the base's driver does not tell its battery{last}", False)
        if battery.charge is None:
            return Fact("not known: the base does not measure its charge", False)
        share = round(battery.charge, 3)
        text = f"{100 * share:.0f} %, {'charging' if battery.charging else 'not charging'}"
        return Fact(text, True, {"charge": share, "charging": battery.charging})

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
        ids = self._people.fresh
        if ids is None:
            since = "" if self._people.last is None else f" for {age_text(self._people.age)}"
            return Fact(f"not known: nobody has been looked for{since} (the user tracker rests)", False)
        if not ids:
            return Fact("nobody is in view", True, {"users": []})
        numbers = ", ".join(map(str, ids))
        people = "one person is" if len(ids) == 1 else f"{len(ids)} people are"
        return Fact(f"{people} in view (number {numbers})", True, {"users": list(ids)})


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
            again=lambda: client.spin_until(lambda: False, WHERE_PERIOD_S),
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
    return "just now" if seconds < 2.0 else f"{age_text(seconds)} ago"
