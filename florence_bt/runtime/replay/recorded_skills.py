"""Skills that answer what they answered when a run was recorded, at the same moments of its journal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from py_trees.common import Status

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import Outcome, Result, cancelled
from florence_bt.core.skill import Inputs
from florence_bt.runtime.events import EventKind
from florence_bt.runtime.journal import JournaledEvent
from florence_bt.runtime.journal.rows import typed
from florence_bt.runtime.journal.text import match_ends
from florence_bt.runtime.replay.moments import TICKED, Moment


@dataclass
class Now:
    """The moment at which a replay stands.

    Attributes:
        moment: The number of the moment that is being replayed.
    """

    moment: int = 0


@dataclass
class RecordedEnd:
    """The end of a recorded run of a skill; without a result it went on when the process died.

    Attributes:
        moment: The moment in which the end was published, or after which.
        late: Whether it comes behind what its moment decided. A run that was left ended after it.
        in_pause: Whether it ended in a pause: it was cancelled for that, or left before.
        after_leaving: Whether it ended only after its node had left it: the node never saw the end.
        result: How it ended.
    """

    moment: int = 0
    late: bool = False
    in_pause: bool = False
    after_leaving: bool = False
    result: Result | None = None


class RecordedSkill:
    """A skill that answers what it answered then, run by run in the order of the starts."""

    def __init__(self, declaration: SkillDeclaration, now: Now) -> None:
        self.declaration = declaration
        self.ends: list[RecordedEnd] = []
        self._now = now
        self._starts = 0
        self._open: list[RecordedRun] = []

    def start(self, inputs: Inputs) -> RecordedRun:
        """Start the next recorded run; one that never ends when the journal has no more."""
        end = self.ends[self._starts] if self._starts < len(self.ends) else RecordedEnd()
        self._starts += 1
        run = RecordedRun(end, self._now)
        self._open.append(run)
        return run

    def watch(self, inputs: Inputs, callback: Callable[[], None]) -> Callable[[], None]:
        """Do nothing: the journal reports changes, and no timer asks again."""
        return lambda: None

    def release(self) -> None:
        """Tell the runs that have ended by now."""
        for run in tuple(self._open):
            run.release()
        # A long journal has thousands of runs: those that have ended are not asked again.
        self._open = [run for run in self._open if run.result is None]

    def let_go(self) -> None:
        """End the runs that were left and had not ended when the process died."""
        for run in tuple(self._open):
            run.let_go()


@dataclass
class RecordedRun:
    """One recorded run of a skill."""

    end: RecordedEnd
    now: Now
    callbacks: list[Callable[[], None]] = field(default_factory=list)
    result: Result | None = None
    feedback: str = ""
    left: bool = False

    def poll(self) -> Result | None:
        """Return the recorded result, from the recorded moment on."""
        if self._has_ended():
            self.result = self.end.result
        return self.result

    def cancel(self) -> None:
        """Take the time that it took then: others may have waited for its end."""
        self.left = True

    def on_change(self, callback: Callable[[], None]) -> None:
        """Remember whom to wake."""
        self.callbacks.append(callback)

    def release(self) -> None:
        """Take the recorded result if the run has ended by now, and wake who waits."""
        if self._has_ended():
            self._end(self.end.result)

    def let_go(self) -> None:
        """End if it was left: the process that would have published its end has died."""
        if self.left and self.result is None:
            self._end(self.end.result or cancelled())

    def _has_ended(self) -> bool:
        if (self.end.after_leaving or self.end.in_pause) and not self.left:
            return False
        last = self.end.moment + (self.left and self.end.late)
        return self.result is None and self.end.result is not None and self.now.moment >= last

    def _end(self, result: Result | None) -> None:
        self.result = result
        for callback in self.callbacks:
            callback()


def recorded_skills(
    moments: Sequence[Moment], declarations: Mapping[str, SkillDeclaration], now: Now
) -> dict[str, RecordedSkill]:
    """Make the skills of a replay.

    Args:
        moments: The journal of the run.
        declarations: What the skills say about themselves.
        now: Where the replay stands.

    Returns:
        Every declared skill; each recorded start has the end that belongs to it.
    """
    skills = {name: RecordedSkill(declaration, now) for name, declaration in declarations.items()}
    events = [event for moment in moments for event in moment.events]
    moment_of = [moment for moment in moments for _ in moment.events]
    ends: dict[int, RecordedEnd] = {}
    for index, event in enumerate(events):
        if event.kind == EventKind.SKILL_STARTED.value and event.skill in skills:
            ends[index] = RecordedEnd()
            skills[event.skill].ends.append(ends[index])
    unseen = _ends_after_leaving(events, moment_of)
    for start, index in match_ends(events):
        event, moment = events[index], moment_of[index]
        if start in ends:
            end = ends[start]
            end.moment, end.late = moment.number, _is_late(index, moment)
            end.in_pause = bool(event.data.get("paused"))
            end.after_leaving = index in unseen
            end.result = _result(event, declarations[event.skill])
    return skills


def _is_late(index: int, moment: Moment) -> bool:
    """Tell whether an end came after what its moment decided: between two ticks, and nothing followed."""
    event = moment.events[index - moment.first]
    return bool(event.data.get("between_ticks")) and index >= moment.first + moment.decided


def _result(event: JournaledEvent, declaration: SkillDeclaration) -> Result:
    outputs = {name: typed(value, declaration.outputs.get(name)) for name, value in event.outputs.items()}
    outcome = Outcome(event.data.get("outcome", Outcome.FAILED.value))
    return Result(outcome, event.code or "ok", event.reason, outputs)


def _ends_after_leaving(events: Sequence[JournaledEvent], moment_of: Sequence[Moment]) -> frozenset[int]:
    """Return the ends of skills that came only after their nodes had left them.

    Args:
        events: Everything that the journal has of a run.
        moment_of: The moment of each of them.

    Returns:
        Indices of events.
    """
    answered, left = _answered(events), _left_before(events)
    found = set()
    for start, end in match_ends(events):
        event, moment = events[end], moment_of[end]
        was_cancelled = event.data.get("outcome") == Outcome.CANCELLED.value
        # A run that took too long was cancelled by its node, which fails for that reason in the same tick.
        unseen = was_cancelled and answered.get((event.tick, event.node)) != event.code
        if unseen or (_is_late(end, moment) and (left[end] > start or _was_left(start, moment))):
            found.add(end)
    return frozenset(end for end in found if not events[end].data.get("paused"))


def _was_left(start: int, moment: Moment) -> bool:
    """Tell whether a run that ends late in a moment must have been left.

    Around a pause it may also have ended for that, or have answered at once after it; in a stop it may be one
    of a clean-up.
    """
    stopped = moment.kind == EventKind.STOP_ASKED.value and start < moment.first
    return stopped or moment.kind in TICKED


def _answered(events: Iterable[JournaledEvent]) -> dict[tuple[int, str], str]:
    """Map every tick and node in which the node ended by itself to the code with which it did."""
    ends = (Status.SUCCESS.value, Status.FAILURE.value)
    return {
        (event.tick, event.node): event.code or "ok"
        for event in events
        if event.kind == EventKind.NODE.value and event.new in ends
    }


def _left_before(events: Sequence[JournaledEvent]) -> dict[int, int]:
    """Map each end of a skill to the last time before that its node was left; indices of events, or -1."""
    left: dict[str, int] = {}
    found = {}
    for index, event in enumerate(events):
        if event.kind == EventKind.NODE.value and event.new == Status.INVALID.value:
            left[event.node] = index
        elif event.kind == EventKind.SKILL_ENDED.value:
            found[index] = left.get(event.node, -1)
    return found
