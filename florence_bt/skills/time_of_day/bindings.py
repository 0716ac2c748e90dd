"""Bindings of the skills of the time of day.

``wait_until: "22:00"`` is made of these skills. The moment is looked up once and stands in a key, and so in
the journal: a mission that goes on after a restart waits for the same moment.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import datetime, timedelta

from florence_bt.core.clock import Clock
from florence_bt.core.outcome import Result, failure, success
from florence_bt.core.serving import ClockBinding
from florence_bt.core.skill import FinishedRun, Inputs, InstantSkill

DATE_LOOK_S = 60.0
"""Period of looking whether the date was set, as by a computer that finds the network after its start.
Chosen: who waits for a time of day is a minute late at most."""
_TIME = re.compile(r"([01]?[0-9]|2[0-3]):([0-5][0-9])")


def next_moment(text: str, now: float) -> float | None:
    """Find when it is a time of day the next time.

    Args:
        text: Hours and minutes in the time zone of this computer.
        now: Seconds since 1970.

    Returns:
        Seconds since 1970, later than now; None when the text is no time of day.
    """
    match = _TIME.fullmatch(text.strip())
    if match is None:
        return None
    here = datetime.fromtimestamp(now)
    moment = here.replace(hour=int(match[1]), minute=int(match[2]), second=0, microsecond=0)
    if moment <= here:
        moment += timedelta(days=1)
    return moment.timestamp()


class TimeReached:
    """The condition that a moment has come; it reports that moment.

    Args:
        clock: Times the report.
        date: Gives the seconds since 1970.
    """

    def __init__(self, clock: Clock, date: Callable[[], float]) -> None:
        self._clock = clock
        self._date = date

    def start(self, inputs: Inputs) -> FinishedRun:
        """Compare the moment with now."""
        left = inputs["date"] - self._date()
        return FinishedRun(success() if left <= 0.0 else failure("too_early", f"there are {left:.0f} s left"))

    def watch(self, inputs: Inputs, callback: Callable[[], None]) -> Callable[[], None]:
        """Call back when the moment has come, also by a clock that was set meanwhile."""

        def look() -> None:
            left = inputs["date"] - self._date()
            if left <= 0.0:
                callback()
            else:
                timers.append(self._clock.call_at(self._clock.now() + min(left, DATE_LOOK_S), look))
                del timers[:-1]

        timers = [self._clock.call_at(self._clock.now(), look)]
        return lambda: timers[-1].cancel()


def _look_up(clock: Clock, date: Callable[[], float]) -> InstantSkill:
    def look_up(inputs: Inputs) -> Result:
        moment = next_moment(inputs["time"], date())
        if moment is None:
            return failure("no_time", f"{inputs['time']!r} is no time of day (would have worked: 22:00)")
        return success(date=moment)

    return InstantSkill(look_up)


BINDINGS = (
    ClockBinding(skill="look_up_time", make=_look_up),
    ClockBinding(skill="time_reached", make=TimeReached),
)
