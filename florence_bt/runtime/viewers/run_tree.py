"""A run with its tree as people are shown it: the one form from which texts and screens are made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from florence_bt.runtime.events import seconds_text
from florence_bt.runtime.run import RunStatus
from florence_bt.trees.drawings.ascii import TreeRow


@dataclass(frozen=True, slots=True)
class RunTree:
    """A run at one moment.

    Attributes:
        run_id: The run; empty when there is none.
        mission: Its mission.
        state: One of :class:`~florence_bt.runtime.run.RunStatus`.
        caller: Who asked for it.
        seconds: How long it has taken, of a run that died with its process at least; None before it began.
        notes: What is told before the tree: when it was accepted, its inputs, notes.
        nodes: All nodes of its tree, those above before those below them.
        text: The tree as it was written down, where its nodes are not known any more.
        outputs: The outputs, as the mission language writes them.
        why: Why it failed or stands still, in a sentence; empty otherwise.
        warnings: What people should know beside.
    """

    run_id: str = ""
    mission: str = ""
    state: str = ""
    caller: str = ""
    seconds: float | None = None
    notes: tuple[str, ...] = ()
    nodes: tuple[TreeRow, ...] = ()
    text: str = ""
    outputs: Mapping[str, str] = field(default_factory=dict)
    why: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def took(self) -> str:
        """Write how long it has taken, for people; empty before it began."""
        text = "" if self.seconds is None else seconds_text(0.0, self.seconds)
        return f"at least {text}" if text and self.state == RunStatus.ABORTED.value else text

    @property
    def facts(self) -> tuple[str, ...]:
        """The parts of the head line behind mission and state: duration, id and caller."""
        return tuple(filter(None, [self.took, f"run {self.run_id}", f"asked by {self.caller}"]))

    @property
    def facts_without_id(self) -> tuple[str, ...]:
        """The same where there is no room for the id."""
        return tuple(filter(None, [self.took, f"asked by {self.caller}"]))

    @property
    def head(self) -> str:
        """One line: mission, state, duration, id and caller."""
        if not self.mission:
            return "no mission has run yet"
        return " · ".join((f"{self.mission}: {self.state}", *self.facts))

    @property
    def outputs_line(self) -> str:
        """The outputs in one line; empty without any."""
        return ", ".join(f"{name}: {text}" for name, text in self.outputs.items())

    @property
    def endings(self) -> tuple[str, ...]:
        """The lines after the tree: the outputs, why it failed or stands still, warnings."""
        outputs = f"outputs {self.outputs_line}" if self.outputs else ""
        return (*filter(None, [outputs, self.why]), *(f"warning: {warning}" for warning in self.warnings))

    def text_with(self, tree: str) -> str:
        """Write it with a tree that was drawn from the nodes; a line each."""
        parts = (self.head, *self.notes, tree.rstrip("\n"), *self.endings)
        return "\n".join(part for part in parts if part)
