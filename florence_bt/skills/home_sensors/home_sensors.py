"""From reports of home sensors to the room of the user. The time is given; ROS and MQTT are not known here.

The rule. A motion detector counts while it sees motion, a device for a minute after it was operated. Of those
that count, the one that began last says where the user is. When none counts any more, the user stays where
they were seen last. When the one that began last no longer counts while a motion detector still sees motion,
that one takes over: the user has walked back before it had noticed that they were gone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.errors import FlorenceError, closest_first
from florence_bt.skills.home_sensors.settings import HomeSensor, SensorKind

HOLD_S = 60.0
"""Time for which a device that was operated counts: as long as motion detectors show motion."""
PRESS_S = 5.0
"""Largest age of a button's report for a press: one that the broker had kept is none."""
SENSOR_AHEAD_S = 5.0
"""Lead that the clock of a sensor may have over ours."""
CONTRADICTION_S = 120.0
"""Time of motion in two rooms before it is reported: longer than motion detectors show it."""


class BadReport(FlorenceError):
    """A report that is not used; says what would have worked."""


@dataclass(frozen=True, slots=True)
class Report:
    """The report of a sensor.

    Attributes:
        sensor: Its name.
        active: Motion, open, on, pressed.
        at: When, seconds; None when that is not known, as of a retained message without a time.
    """

    sensor: str
    active: bool
    at: float | None


@dataclass(frozen=True, slots=True)
class SensedRoom:
    """The room of the user, as far as home sensors know.

    Attributes:
        room: The label of the room.
        source: The sensor.
        since: When it began to say so, seconds.
        at: Until when it said so, seconds; the present time while it still does.
    """

    room: str
    source: str
    since: float
    at: float


@dataclass(slots=True)
class _State:
    """The state of one sensor; times in seconds."""

    active: bool | None = None
    last_report: float | None = None
    began: float | None = None
    """Time when it was last switched on or operated."""
    counts_from: float | None = None
    """The same, or when it took over."""
    ended: float | None = None
    """Time when motion ended, if it has."""
    late: int = 0
    """Reports that came too late to be used."""


class HomeSensors:
    """Finds the room of the user.

    Args:
        sensors: The sensors by name.
        now: The present time, seconds.

    Source:
        Document, section 3.8.1; REFERENCE 12.4. The rule is ours (docs/manual/home_sensors.md).
    """

    def __init__(self, sensors: Mapping[str, HomeSensor], now: float) -> None:
        self._sensors = sensors
        self._states = {name: _State() for name in self._sensors}
        self._started = now
        self._sensed: SensedRoom | None = None

    def take(self, report: Report, now: float) -> None:
        """Take a report over.

        Raises:
            BadReport: The sensor or the time cannot be meant.
        """
        sensor, state = self._sensors.get(report.sensor), self._states.get(report.sensor)
        if sensor is None or state is None:
            names = ", ".join(closest_first(report.sensor, self._sensors))
            raise BadReport(f"there is no home sensor {report.sensor!r} (would have worked: {names})")
        if report.at is None:
            if sensor.kind is SensorKind.DEVICE:
                # It tells the state, but not since when: the next report that differs is a change.
                state.active = report.active
            return
        if not math.isfinite(report.at) or report.at > now + SENSOR_AHEAD_S:
            raise BadReport(
                f"the time of {report.sensor!r} is {report.at - now:g} s after the present time "
                f"(would have worked: at most {SENSOR_AHEAD_S:g} s)"
            )
        at = min(report.at, now)
        if now - at > sensor.stale_after or (state.last_report is not None and at < state.last_report):
            state.late += 1
            return
        if _begins(sensor, state, report.active, at):
            state.began = state.counts_from = state.ended = at
        elif state.began is not None and state.active and not report.active:
            state.ended = self._until(report.sensor, at)
        state.active, state.last_report = report.active, at

    def is_press(self, report: Report, now: float) -> bool:
        """Tell whether a report says that a button was pressed a moment ago."""
        sensor = self._sensors[report.sensor]
        fresh = report.at is not None and now - report.at <= PRESS_S
        return sensor.kind is SensorKind.BUTTON and report.active and fresh

    def locate(self, now: float) -> SensedRoom | None:
        """Locate the user; None while no sensor has said anything. Call it after each report, and often."""
        last, began = self._sensed, self._candidates(now)
        if not began:
            return last
        name = max(began, key=lambda each: began[each])
        if last is not None and last.source != name and began[name] < last.since:
            self._states[name].counts_from = began[name] = now
        until = max(began[name], self._until(name, now))
        self._sensed = SensedRoom(self._sensors[name].room, name, began[name], until)
        return self._sensed

    def diagnoses(self, now: float) -> dict[str, Diagnosis]:
        """Report how each sensor does, and whether they agree."""
        return {
            "user": self._agreement(now),
            **{name: self._diagnosis(name, now) for name in self._sensors},
        }

    def _candidates(self, now: float) -> dict[str, float]:
        """Return the sensors that may say where the user is, and since when each has said it."""
        last = self._sensed
        began = {
            name: state.counts_from for name, state in self._states.items() if state.counts_from is not None
        }
        if last is None:
            return began
        counting = {
            name: since
            for name, since in began.items()
            if self._sees_motion(name, now) or (since >= last.since and self._was_operated(name, now))
        }
        return counting or {
            name: since for name, since in began.items() if name == last.source or since > last.at
        }

    def _until(self, name: str, now: float) -> float:
        """Return until when a sensor that has begun said that somebody is in its room."""
        sensor, state = self._sensors[name], self._states[name]
        if self._sees_motion(name, now):
            return now
        assert state.began is not None and state.last_report is not None and state.ended is not None
        if sensor.kind is not SensorKind.MOTION:
            return state.began
        # Silent or stuck: until it was trusted.
        return min(state.last_report, state.began + sensor.stuck_after) if state.active else state.ended

    def _was_operated(self, name: str, now: float) -> bool:
        """Tell whether it is a device that was operated a moment ago."""
        began = self._states[name].began
        return (
            self._sensors[name].kind is not SensorKind.MOTION and began is not None and now - began <= HOLD_S
        )

    def _sees_motion(self, name: str, now: float) -> bool:
        """Tell whether it is a motion detector that sees motion now, and is trusted."""
        sensor, state = self._sensors[name], self._states[name]
        return (
            sensor.kind is SensorKind.MOTION
            and bool(state.active)
            and state.last_report is not None
            and now - state.last_report <= sensor.stale_after
            and not self._is_stuck(name, now)
        )

    def _is_stuck(self, name: str, now: float) -> bool:
        sensor, state = self._sensors[name], self._states[name]
        return (
            sensor.kind is SensorKind.MOTION
            and bool(state.active)
            and state.began is not None
            and now - state.began > sensor.stuck_after
        )

    def _agreement(self, now: float) -> Diagnosis:
        """Report whether motion detectors see somebody in two rooms at once."""
        since: dict[str, float] = {}
        for name, sensor in self._sensors.items():
            began = self._states[name].began
            if began is not None and self._sees_motion(name, now):
                since[sensor.room] = min(began, since.get(sensor.room, began))
        sensed = self._sensed
        values = {
            "room": sensed.room if sensed else "",
            "sensor": sensed.source if sensed else "",
            "motion in": ", ".join(sorted(since)),
        }
        if sensed is None:
            return Diagnosis(Severity.OK, "no sensor has seen the user yet", values)
        if len(since) > 1 and now - sorted(since.values())[1] > CONTRADICTION_S:
            problem = f"motion in {' and '.join(sorted(since))} for more than {CONTRADICTION_S:g} s: "
            return Diagnosis(
                Severity.WARN,
                f"{problem}the user is taken to be in {sensed.room}, where it began last",
                values,
            )
        return Diagnosis(Severity.OK, f"the user was last seen in {sensed.room}", values)

    def _diagnosis(self, name: str, now: float) -> Diagnosis:
        sensor, state = self._sensors[name], self._states[name]
        last_report = self._started if state.last_report is None else state.last_report
        values = {
            "room": sensor.room,
            "kind": sensor.kind.value,
            "state": "unknown" if state.active is None else "on" if state.active else "off",
            "last report": "none" if state.last_report is None else f"{now - state.last_report:.0f} s ago",
            "reports that came too late": str(state.late),
        }
        if sensor.kind is SensorKind.MOTION and now - last_report > sensor.stale_after:
            problem = f"has not reported for {sensor.stale_after:g} s: it no longer counts"
            return Diagnosis(Severity.WARN, problem, values)
        if self._is_stuck(name, now):
            problem = f"has seen motion for more than {sensor.stuck_after:g} s: not believed until it is over"
            return Diagnosis(Severity.WARN, problem, values)
        return Diagnosis(
            Severity.OK, "has not reported yet" if state.last_report is None else "reports", values
        )


def _begins(sensor: HomeSensor, state: _State, active: bool, at: float) -> bool:
    """Tell whether a report is the beginning of something, and not the same state once more."""
    if sensor.kind is SensorKind.BUTTON:
        return active
    if sensor.kind is SensorKind.DEVICE:
        return active if state.active is None else active != state.active
    stale = state.last_report is not None and at - state.last_report > sensor.stale_after
    return active and (not state.active or stale)
