"""Nodes of the tree of a mission: from the source to the model."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from typing import Any

from florence_bt.trees._reader import Reader
from florence_bt.trees.kinds import ANYWHERE, MODIFIERS, NEVER_INPUTS, NODE_KINDS
from florence_bt.trees.model import (
    Call,
    Fail,
    Invert,
    Literal,
    Node,
    Parallel,
    Reasons,
    Repeat,
    Retry,
    Selector,
    Sequence,
    Set,
    Succeed,
    Timeout,
    Use,
    Value,
    Wait,
)
from florence_bt.trees.source import Listing, Source, Table, Text

_ALL_MODIFIERS = (*ANYWHERE, *MODIFIERS)


class NodeParser:
    """Parses nodes; what is wrong is noted in the reader and the broken node left out.

    Args:
        reader: Collects the findings.
    """

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self._kinds: dict[str, Callable[[Text, Source, Table], Node | None]] = {
            "sequence": self._sequence,
            "selector": self._selector,
            "parallel": self._parallel,
            "retry": self._retry,
            "repeat": self._repeat,
            "timeout": self._timeout,
            "invert": lambda key, value, table: self._wrapper(Invert, key, value, table),
            "succeed": lambda key, value, table: self._wrapper(Succeed, key, value, table),
            "fail": self._fail,
            "wait": self._wait,
            "set": self._set,
            "run": self._call,
        }

    def node(self, source: Source) -> Node | None:
        """Parse one node with everything below it."""
        if not isinstance(source, Table):
            written = (
                f"; write `{source.text}: {{}}`" if isinstance(source, Text) and not source.empty else ""
            )
            self._reader.problem(source.position, f"a node must be a table with a kind key{written}")
            return None
        kinds = [(key, value) for key, value in source.entries if key.text not in _ALL_MODIFIERS]
        if len(kinds) != 1:
            self._not_one_kind(source, [key for key, _ in kinds])
            return None
        key, value = kinds[0]
        self._check_modifiers(key.text, source)
        return self._kinds.get(key.text, self._use)(key, value, source)

    def _not_one_kind(self, source: Table, keys: list[Text]) -> None:
        if not keys:
            self._reader.problem(
                source.position, "this node has no kind", (*NODE_KINDS, "the name of a skill")
            )
            return
        for key in keys:
            close = difflib.get_close_matches(key.text, _ALL_MODIFIERS, n=1, cutoff=0.7)
            if close and key.text not in NODE_KINDS:
                self._reader.problem(key.position, f"unknown modifier {key.text!r}", close)
                return
        names = " and ".join(repr(key.text) for key in keys)
        self._reader.problem(
            keys[1].position, f"a node has exactly one kind, not {names}", ["sequence: [a node for each]"]
        )

    def _check_modifiers(self, kind: str, table: Table) -> None:
        own = kind if kind in NODE_KINDS else "a skill"
        for key, _ in table.entries:
            kinds = MODIFIERS.get(key.text)
            if kinds is not None and own not in kinds:
                message = f"{key.text!r} does not belong to {kind!r} but to {' and '.join(kinds)}"
                usable = [name for name, owners in MODIFIERS.items() if own in owners]
                self._reader.problem(key.position, message, (*usable, *ANYWHERE))

    def _common(self, key: Text, table: Table) -> dict[str, Any]:
        name = table.get("name")
        because = table.get("because")
        cleanup = table.get("finally")
        return {
            "position": key.position,
            "name": self._reader.text(name, "name") if name is not None else None,
            "reasons": self._reasons(because) if because is not None else None,
            "cleanup": self.node(cleanup) if cleanup is not None else None,
        }

    def _reasons(self, source: Source) -> Reasons | None:
        if not isinstance(source, Table):
            always = self._text(source, "because")
            return Reasons(always, {}, source.position) if always is not None else None
        by_code = {}
        for key, item in source.entries:
            code = self._reader.identifier(key, "a code in because")
            text = self._text(item, f"because {key.text}")
            if code is not None and text is not None:
                by_code[code.text] = text
        return Reasons(None, by_code, source.position)

    def _text(self, source: Source, what: str) -> Value | None:
        if isinstance(source, Table):
            self._reader.problem(source.position, f"{what} must be a text")
            return None
        value = self._reader.value(source, what)
        return Literal(value.text, True, value.position) if isinstance(value, Literal) else value

    # ---- composites -----------------------------------------------------------------------------------

    def _children(self, key: Text, value: Source) -> tuple[Node, ...]:
        if not isinstance(value, Listing) or not value.items:
            self._reader.problem(
                value.position, f"{key.text} needs a list of nodes", [f"{key.text}: [node, node]"]
            )
            return ()
        return tuple(node for item in value.items if (node := self.node(item)) is not None)

    def _memory(self, table: Table) -> bool:
        source = table.get("memory")
        return source is None or self._reader.choice(source, "memory", ("true", "false"), "true") == "true"

    def _sequence(self, key: Text, value: Source, table: Table) -> Node | None:
        children = self._children(key, value)
        return Sequence(children=children, memory=self._memory(table), **self._common(key, table))

    def _selector(self, key: Text, value: Source, table: Table) -> Node | None:
        children = self._children(key, value)
        return Selector(children=children, memory=self._memory(table), **self._common(key, table))

    def _parallel(self, key: Text, value: Source, table: Table) -> Node | None:
        children = self._children(key, value)
        policy = table.get("policy")
        enough = policy is not None and self._reader.choice(policy, "policy", ("all", "any"), "all") == "any"
        return Parallel(children=children, any_is_enough=enough, **self._common(key, table))

    # ---- decorators -----------------------------------------------------------------------------------

    def _do(self, key: Text, table: Table) -> Node | None:
        source = table.get("do")
        if source is None:
            self._reader.problem(key.position, f"{key.text} needs a node under `do`", ["do: {a node}"])
            return None
        return self.node(source)

    def _retry(self, key: Text, value: Source, table: Table) -> Node | None:
        common, child = self._common(key, table), self._do(key, table)
        attempts = self._reader.value(value, "retry")
        on, attempt = table.get("on"), table.get("attempt")
        codes = self._reader.identifiers(on, "a code in on") if on is not None else ()
        attempt_key = self._reader.identifier(attempt, "attempt") if attempt is not None else None
        if child is None or attempts is None:
            return None
        return Retry(child=child, attempts=attempts, on=codes, attempt_key=attempt_key, **common)

    def _repeat(self, key: Text, value: Source, table: Table) -> Node | None:
        common, child = self._common(key, table), self._do(key, table)
        rounds = self._reader.value(value, "repeat")
        return (
            Repeat(child=child, rounds=rounds, **common) if child is not None and rounds is not None else None
        )

    def _timeout(self, key: Text, value: Source, table: Table) -> Node | None:
        common, child = self._common(key, table), self._do(key, table)
        duration = self._reader.value(value, "timeout")
        if child is None or duration is None:
            return None
        return Timeout(child=child, duration=duration, **common)

    def _wrapper(self, kind: type[Invert | Succeed], key: Text, value: Source, table: Table) -> Node | None:
        common, child = self._common(key, table), self.node(value)
        return kind(child=child, **common) if child is not None else None

    # ---- leaves ---------------------------------------------------------------------------------------

    def _fail(self, key: Text, value: Source, table: Table) -> Node | None:
        reason, common, code = self._text(value, "fail"), self._common(key, table), table.get("code")
        name = self._reader.identifier(code, "code") if code is not None else None
        return Fail(reason=reason, code=name, **common) if reason is not None else None

    def _wait(self, key: Text, value: Source, table: Table) -> Node | None:
        duration, common = self._reader.value(value, "wait"), self._common(key, table)
        return Wait(duration=duration, **common) if duration is not None else None

    def _set(self, key: Text, value: Source, table: Table) -> Node | None:
        values, common = self._reader.values(value, "set"), self._common(key, table)
        if not isinstance(value, Table) or not value.entries:
            self._reader.problem(value.position, "set needs keys and values", ["set: {key: value}"])
        return Set(values=values, **common)

    def _use(self, key: Text, value: Source, table: Table) -> Node | None:
        given = isinstance(value, Table)
        value = self._without_modifiers(key, value)
        return Use(
            skill=key.text,
            inputs=self._reader.values(value, key.text) if given else (),
            outputs=self._reader.keys(table.get("out")),
            table_given=given or (isinstance(value, Text) and value.empty),
            **self._common(key, table),
        )

    def _without_modifiers(self, key: Text, value: Source) -> Source:
        """Leave out modifiers that were indented as if they were inputs, and say so."""
        if not isinstance(value, Table):
            return value
        for name, _ in value.entries:
            if name.text in NEVER_INPUTS:
                message = f"{name.text!r} stands among the inputs of {key.text}"
                self._reader.problem(name.position, message, [f"{name.text} indented like {key.text}"])
        entries = tuple((name, item) for name, item in value.entries if name.text not in NEVER_INPUTS)
        return Table(entries, value.position)

    def _call(self, key: Text, value: Source, table: Table) -> Node | None:
        mission, common = self._reader.identifier(value, "run"), self._common(key, table)
        inputs = self._reader.values(table.get("with"), "with")
        outputs = self._reader.keys(table.get("out"))
        return (
            Call(mission=mission, inputs=inputs, outputs=outputs, **common) if mission is not None else None
        )
