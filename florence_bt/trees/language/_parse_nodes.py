"""Nodes of the tree of a mission, from the source to the model: finds the kind and its parser."""

from __future__ import annotations

import difflib

from florence_bt.core.torn_texts import torn_texts
from florence_bt.trees.language._parse_common import Maker, Parsing
from florence_bt.trees.language._parse_composites import COMPOSITES
from florence_bt.trees.language._parse_decorators import DECORATORS
from florence_bt.trees.language._parse_leaves import LEAVES, use
from florence_bt.trees.language._suggestions import instead_of_two_kinds, no_kind_meant, node_meant
from florence_bt.trees.language.kinds import ANYWHERE, MODIFIERS, NODE_KINDS
from florence_bt.trees.language.model import Node
from florence_bt.trees.language.source import Source, Table, Text

_ALL_MODIFIERS = (*ANYWHERE, *MODIFIERS)
_MAKERS: dict[str, Maker] = {**COMPOSITES, **DECORATORS, **LEAVES}


class NodeParser(Parsing):
    """Parses nodes; what is wrong is noted in the reader and the broken node left out.

    Args:
        reader: Collects the findings.
    """

    def node(self, source: Source) -> Node | None:
        """Parse one node with everything below it."""
        if not isinstance(source, Table):
            self.reader.problem(source.position, *node_meant(source))
            return None
        kinds = [(key, value) for key, value in source.entries if key.text not in _ALL_MODIFIERS]
        if len(kinds) != 1:
            self._not_one_kind(source, [key for key, _ in kinds])
            return None
        key, value = kinds[0]
        self._check_modifiers(key.text, source)
        return _MAKERS.get(key.text, use)(self, key, value, source)

    def _not_one_kind(self, source: Table, keys: list[Text]) -> None:
        if not keys:
            self.reader.problem(source.position, *no_kind_meant([key.text for key, _ in source.entries]))
            return
        torn = list(torn_texts(source))
        for text in torn:
            self.reader.torn(text)
        if torn:
            return
        for key in keys:
            close = difflib.get_close_matches(key.text, _ALL_MODIFIERS, n=1, cutoff=0.7)
            if close and key.text not in NODE_KINDS:
                self.reader.problem(key.position, f"unknown modifier {key.text!r}", close)
                return
        names = " and ".join(repr(key.text) for key in keys)
        value = source.get(keys[1].text)
        valid = instead_of_two_kinds(keys[0], keys[1], value) if value is not None else ()
        self.reader.problem(keys[1].position, f"a node has exactly one kind, not {names}", valid)

    def _check_modifiers(self, kind: str, table: Table) -> None:
        own = kind if kind in NODE_KINDS else "a skill"
        for key, _ in table.entries:
            kinds = MODIFIERS.get(key.text)
            if kinds is not None and own not in kinds:
                message = f"{key.text!r} does not belong to {kind!r} but to {' and '.join(kinds)}"
                usable = [name for name, owners in MODIFIERS.items() if own in owners]
                self.reader.problem(key.position, message, (*usable, *ANYWHERE))
