"""Skills below a node without memory: conditions that are asked again, and actions that are done once."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from py_trees.common import Status

from florence_bt.behaviours._wake_timer import WakeTimer
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.watching import Spot
from florence_bt.behaviours.why import path_of
from florence_bt.core.outcome import Result

EVERY_S = 1.0
"""Period of asking a condition that does not report changes, unless the mission says otherwise."""


@dataclass(frozen=True, slots=True)
class _Answer:
    """The end of a run of a skill."""

    status: Status
    result: Result | None
    message: str
    inputs: Mapping[str, Any] | None = None

    def tells_the_same(self, other: _Answer) -> bool:
        """Tell whether the tree goes on in the same way with another answer."""
        codes = [each.result.code if each.result is not None else "" for each in (self, other)]
        return self.status is other.status and codes[0] == codes[1]


class InCondition(RunSkill):
    """A skill in a condition: its answer may stand longer than its run.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        skill: The name of the skill, one of the context's declarations.
        inputs: Values in SI units or value sources, by input name.
        outputs: Output name -> key that receives it.
        spot: Where it stands in the condition.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        skill: str,
        inputs: Mapping[str, Any],
        outputs: Mapping[str, str],
        spot: Spot,
    ) -> None:
        super().__init__(name, context, skill, inputs, outputs)
        self._spot = spot
        self._answer: _Answer | None = None

    def _show(self, answer: _Answer) -> Status:
        """Show the answer that stands, with its outputs where somebody has reset the keys of the mission."""
        self.result, self.feedback_message = answer.result, answer.message
        if answer.status is Status.SUCCESS and answer.result is not None:
            for output, key in self.outputs.items():
                if key not in self._context.keys:
                    self._context.keys.write(key, answer.result.outputs[output])
        return answer.status


class ConditionAction(InCondition):
    """A skill in a condition that is no condition itself: an action.

    One that took time is not done again as long as nothing before it has changed, nor what it is given.
    """

    _took_time = False

    def initialise(self) -> None:
        """Start the skill, unless what it has done still stands."""
        self._answer, self._took_time = self._spot.recall(), False
        if self._answer is None or self._answer.inputs != self._complete_inputs():
            self._answer = None
            super().initialise()

    def update(self) -> Status:
        """Return the status of the run, or of the one that stands."""
        if self._answer is not None:
            return self._show(self._answer)
        inputs = self._entry.inputs if self._entry is not None else None
        status = super().update()
        if status is Status.RUNNING:
            self._took_time = True
        elif self._took_time:
            self._spot.keep(_Answer(status, self.result, self.feedback_message, inputs))
        return status


class WatchedSkill(InCondition):
    """A skill as a condition: it keeps its answer until it gives another one.

    The first run is that of :class:`RunSkill`. After its end the skill is asked again when it reports a
    change (:class:`~florence_bt.core.skill.WakingSkill`), else after a period; also when a key that it takes
    has changed, and when the mission goes on after a pause. It is asked in the background: until the new
    answer is there the old one stands, so that a later node runs on. When a loop comes to it a second time
    while the condition is asked, it is asked like any skill. It ends with :meth:`stop_watching`.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        skill: The name of the skill, one of the context's declarations.
        inputs: Values in SI units or value sources, by input name.
        outputs: Output name -> key that receives it.
        spot: Where it stands in the condition.
        keys: The keys that the inputs are made of.
        every: Seconds between an answer and the next question, for a skill that does not report changes.

    Attributes:
        used_in: The round of the condition in which it has given its answer last.
    """

    only_asks = True
    """A run of it takes nothing away from the later nodes."""

    def __init__(
        self,
        name: str,
        context: TreeContext,
        skill: str,
        inputs: Mapping[str, Any],
        outputs: Mapping[str, str],
        spot: Spot,
        *,
        keys: Collection[str] = (),
        every: float = EVERY_S,
    ) -> None:
        super().__init__(name, context, skill, inputs, outputs, spot)
        self._keys = frozenset(keys).difference(self.outputs.values())
        self._every = every
        self._due = self._asking = self._watching = False
        self.used_in = 0
        self._timer = WakeTimer(context, self.ask_again)
        self._end_source: Callable[[], None] | None = None
        self._end_keys: Callable[[], None] | None = None
        spot.watch.root.skills.append(self)
        spot.watch.keep()

    def ask_again(self) -> None:
        """Ask with the next tick; the previous answer stands until the new one is there."""
        # A question that was suspended for a pause is asked once more in any case.
        self._due = self._entry is None or not self._entry.suspended

    @property
    def is_asked_again(self) -> bool:
        """Tell whether an answer stands that a new one will replace; after a pause that is waited for."""
        return self._answer is not None and (self._due or self._asking)

    def _conditions_above(self) -> Iterator[Any]:
        """Return none: a question waits for no other."""
        return iter(())

    def initialise(self) -> None:
        """Start the skill, unless an answer stands that the condition has not used yet."""
        now = self._spot.watch.root.round
        used, self.used_in = self.used_in == now, now
        if self._answer is not None and (self._spot.replays or not used):
            return
        self._answer, self._due = None, False
        if self._asking:
            self._asking = False  # what is asked in the background already
        else:
            super().initialise()

    def update(self) -> Status:
        """Return the answer that is kept; RUNNING before the first one."""
        if self._answer is None:
            status = super().update()
            if status is not Status.RUNNING:
                self._begin_watch()
                self._keep(status)
            return status
        self.look()
        return self._answer.status

    def look(self) -> None:
        """Ask again in the background when it is time, and take the answer when it is there."""
        if self._answer is None:
            return
        if self._due and not self._asking:
            self._due, self._asking = False, True
            self._timer.cancel()
            self._context.on_asked_again(path_of(self))
            super().initialise()
        if not self._asking:
            self._show(self._answer)
            return
        before, status = self._answer, super().update()
        if status is not Status.RUNNING:
            self._asking = False
            self._keep(status)
            if not self._answer.tells_the_same(before):
                self._spot.change()
        self._show(self._answer)

    def terminate(self, new_status: Status) -> None:
        """Leave no run behind, except the one that asks again in the background."""
        if not self._asking:
            super().terminate(new_status)

    def stop_watching(self) -> None:
        """Forget the answer and stop asking, until the node starts again."""
        if not self._watching:
            return
        self._watching = self._asking = False
        self._answer = None
        self._end_source_watch()
        if self._end_keys is not None:
            self._end_keys()
            self._end_keys = None
        self._context.watching.remove(self.ask_again)
        super().terminate(Status.INVALID)

    def _keep(self, status: Status) -> None:
        """Keep the answer of the run that has just ended, and see to it that the skill is asked again."""
        inputs = self._entry.inputs if self._entry is not None else None
        self._answer = _Answer(status, self.result, self.feedback_message)
        self._end_source_watch()
        if inputs is not None:
            watch = getattr(self._context.skills[self.skill], "watch", None)
            if watch is not None:
                self._end_source = watch(inputs, self._on_source)
            else:
                self._timer.start(self._every)
        if self._due:
            self._context.wake()

    def _begin_watch(self) -> None:
        if not self._watching:
            self._watching = True
            self._end_keys = self._context.keys.watch(self._keys, lambda key: self._on_source())
            self._context.watching.append(self.ask_again)

    def _end_source_watch(self) -> None:
        self._timer.cancel()
        if self._end_source is not None:
            self._end_source()
            self._end_source = None

    def _on_source(self) -> None:
        self.ask_again()
        self._context.wake()
