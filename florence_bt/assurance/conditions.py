"""The conditions over keys that an author does not want to hold, looked at while a mission is explored.

What is compared may be a value that is not known: then both answers are explored, as for a condition of the
mission itself. A condition that has no value, because nothing has written a key yet, does not hold.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping

from florence_bt.assurance.events import Groups, Happening, is_at, is_end
from florence_bt.assurance.snapshot import Unchanging
from florence_bt.behaviours.expressions import CompiledExpression
from florence_bt.behaviours.keys import KeyStore, ValueProblem
from florence_bt.core.declaration import Kind
from florence_bt.trees.language.expressions.compiling import compile_expression
from florence_bt.trees.language.model import Property, PropertyEvent


class UnwantedConditions(Unchanging):
    """The properties of a mission that are about its keys.

    Args:
        properties: All its properties.
        groups: The groups of codes.
        kinds: The kinds of its keys.
        keys: Their values.
    """

    def __init__(
        self,
        properties: Iterable[Property],
        groups: Groups,
        kinds: Mapping[str, Kind],
        keys: KeyStore,
    ) -> None:
        self._groups = groups
        self._keys = keys
        self._watched: list[tuple[Property, CompiledExpression]] = [
            (each, compile_expression(each.condition, kinds))
            for each in properties
            if each.condition is not None
        ]

    def when(self, happening: Happening) -> Iterator[Happening]:
        """Yield what does not hold at something that happens to a skill: its begin counts as running, too."""
        for each, condition in self._watched:
            event = each.first
            begins = happening.what == "start" and (event is None or _runs(event, {happening.skill}))
            if begins or (event is not None and is_at(event, happening, self._groups)):
                yield from self._unwanted(each, condition)

    def after(self, running: Collection[str], end: tuple[str, str] | None) -> Iterator[Happening]:
        """Yield what does not hold after a step.

        Args:
            running: The skills that run.
            end: How the mission has ended when nothing of it is left: its status and code.
        """
        for each, condition in self._watched:
            event = each.first
            ended = event is not None and end is not None and is_end(event, *end, self._groups)
            if event is None or ended or _runs(event, running):
                yield from self._unwanted(each, condition)

    def _unwanted(self, wanted: Property, condition: CompiledExpression) -> Iterator[Happening]:
        try:
            holds = bool(condition.resolve(self._keys))
        except ValueProblem:
            holds = False
        if holds:
            yield Happening("unwanted", text=wanted.text)


def _runs(event: PropertyEvent, running: Collection[str]) -> bool:
    return event.how == "runs" and event.who in running
