"""A skill as a condition in a composite without memory: asked again while a later node runs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from py_trees.common import Status

from florence_bt.behaviours._wake_timer import WakeTimer
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.core.outcome import Result

EVERY_S = 1.0
"""How often a condition that does not report changes is asked again, unless the mission says otherwise."""


@dataclass(frozen=True, slots=True)
class _Answer:
    """How a run of the skill ended."""

    status: Status
    result: Result | None
    message: str


class WatchedSkill(RunSkill):
    """Runs a skill, and keeps the answer until the skill gives another one.

    The first run is that of :class:`RunSkill`. After its end the skill is asked again when it reports a
    change (:class:`~florence_bt.core.skill.WakingSkill`), else after a period; also when a key that it takes
    has changed, and when the mission goes on after a pause. It is asked in the background: until the new
    answer is there the old one stands, so that a later node runs on. A reset by a composite that begins again
    within the same tick does not end this; a reset that lasts does, and so does :meth:`stop_watching`.

    Args:
        name: The name of the node in dumps.
        context: What the tree shares.
        skill: The name of the skill, one of the context's declarations.
        inputs: Values in SI units or value sources, by input name.
        outputs: Output name -> key that receives it.
        keys: The keys that the inputs are made of.
        every: Seconds between an answer and the next question, for a skill that does not report changes.
    """

    def __init__(
        self,
        name: str,
        context: TreeContext,
        skill: str,
        inputs: Mapping[str, Any] | None = None,
        outputs: Mapping[str, str] | None = None,
        *,
        keys: Collection[str] = (),
        every: float = EVERY_S,
    ) -> None:
        super().__init__(name, context, skill, inputs, outputs)
        self._keys = frozenset(keys).difference(self.outputs.values())
        self._every = every
        self._answer: _Answer | None = None
        self._due = self._asking = self._left = False
        self._timer = WakeTimer(context, self.ask_again)
        self._end_source: Callable[[], None] | None = None
        self._end_keys: Callable[[], None] | None = None

    def ask_again(self) -> None:
        """Ask with the next tick; the previous answer stands until the new one is there."""
        # A question that was suspended for a pause is asked once more in any case.
        self._due = self._entry is None or not self._entry.suspended

    @property
    def is_asked_again(self) -> bool:
        """Whether an answer stands that a new one will replace; after a pause that is waited for."""
        return self._answer is not None and (self._due or self._asking) and not self._left

    def _conditions_above(self) -> Iterator[Any]:
        """None: a question waits for no other."""
        return iter(())

    def initialise(self) -> None:
        """Start the skill, unless an answer is kept."""
        self._left = False
        if self._answer is None:
            self._due = False
            super().initialise()

    def update(self) -> Status:
        """The answer that is kept; RUNNING before the first one."""
        if self._answer is None:
            status = super().update()
            if status is not Status.RUNNING:
                self._begin_watch()
                self._keep(status)
            return status
        if self._due and not self._asking:
            self._due, self._asking = False, True
            self._timer.cancel()
            super().initialise()
        if self._asking:
            status = super().update()
            if status is not Status.RUNNING:
                self._asking = False
                self._keep(status)
        return self._show(self._answer)

    def terminate(self, new_status: Status) -> None:
        """Leave no run behind, except the one that asks again in the background."""
        if new_status is Status.INVALID and self._answer is not None:
            self._left = True
            self._context.later(self._stop_if_left)
        elif not self._asking:
            super().terminate(new_status)

    def stop_watching(self) -> None:
        """Forget the answer and stop asking, until the node starts again."""
        if self._answer is None:
            return
        self._answer, self._asking = None, False
        self._end_source_watch()
        if self._end_keys is not None:
            self._end_keys()
            self._end_keys = None
        self._context.watching.remove(self.ask_again)
        super().terminate(Status.INVALID)

    def _stop_if_left(self) -> None:
        if self._left:
            self.stop_watching()

    def _show(self, answer: _Answer) -> Status:
        """Show the answer that stands, with its outputs where somebody has reset the keys of the mission."""
        self.result, self.feedback_message = answer.result, answer.message
        if answer.status is Status.SUCCESS and answer.result is not None:
            for output, key in self.outputs.items():
                if key not in self._context.keys:
                    self._context.keys.write(key, answer.result.outputs[output])
        return answer.status

    def _keep(self, status: Status) -> None:
        """Keep the answer of the run that has just ended, and see to it that the skill is asked again."""
        self._answer = _Answer(status, self.result, self.feedback_message)
        self._end_source_watch()
        inputs = self._entry.inputs if self._entry is not None else None
        if inputs is not None:
            watch = getattr(self._context.skills[self.skill], "watch", None)
            if watch is not None:
                self._end_source = watch(inputs, self._on_source)
            else:
                self._timer.start(self._every)
        if self._due:
            self._context.wake()

    def _begin_watch(self) -> None:
        context = self._context
        self._end_keys = context.keys.watch(self._keys, lambda key: self._on_source())
        context.watching.append(self.ask_again)

    def _end_source_watch(self) -> None:
        self._timer.cancel()
        if self._end_source is not None:
            self._end_source()
            self._end_source = None

    def _on_source(self) -> None:
        self.ask_again()
        self._context.wake()
