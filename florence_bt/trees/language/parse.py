"""A mission file: from YAML to the model. What a mission refers to is checked elsewhere (``checks.lint``).

What is wrong is added to the findings; a broken node is left out and the rest is parsed.
"""

from __future__ import annotations

import difflib
import hashlib
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path

from florence_bt.core.declaration import Port
from florence_bt.core.errors import ConfigError, close_matches
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence, parse_yaml
from florence_bt.core.text_files import MAX_MISSION_BYTES, read_bytes
from florence_bt.core.unquoted_commas import unquoted_commas
from florence_bt.trees import kinds
from florence_bt.trees.kinds import words
from florence_bt.trees.kinds.ensure import NOT_ENSURED
from florence_bt.trees.language import _suggestions as suggestions
from florence_bt.trees.language import model, vocabulary
from florence_bt.trees.language.expressions.parser import negated
from florence_bt.trees.language.findings import MAX_FINDINGS
from florence_bt.trees.language.form import Form, NodeReader
from florence_bt.trees.language.ports import read_ports
from florence_bt.trees.language.properties import read_properties
from florence_bt.trees.language.quantities import with_article

_ALL_MODIFIERS = (*vocabulary.ANYWHERE, *words.MODIFIERS)
_NO_KEYS = ("mission", "description", "imported_from", "properties", "on_restart")
"""Keys of a mission whose values name no keys."""


def read_mission(path: Path) -> model.Mission:
    """Read a mission file; one that has not changed gives the mission of the last time.

    Returns:
        The mission; what is wrong with the file's form is in its findings.

    Raises:
        ConfigError: The file cannot be read or is not plain YAML.
    """
    return _mission_of(read_bytes(path, MAX_MISSION_BYTES), path)


def parse_mission(text: str, path: Path) -> model.Mission:
    """Parse the text of a mission file; ``path`` names it.

    Raises:
        ConfigError: As :func:`read_mission`.
    """
    return _MissionParser(path).mission(text.encode(), path)


@lru_cache(maxsize=256)  # the editor, a reload and tests read the same files again and again
def _mission_of(data: bytes, path: Path) -> model.Mission:
    return _MissionParser(path).mission(data, path)


class _MissionParser(NodeReader):
    """Parses one mission file."""

    # ---- the file -------------------------------------------------------------------------------------

    def mission(self, data: bytes, path: Path) -> model.Mission:
        problems: list[ConfigError] = []
        source = parse_yaml(data, path, problems, _ALL_MODIFIERS)
        for error in problems:
            self.error(Position(error.line or 1, error.column or 1), error.problem, error.valid)
        if not isinstance(source, YamlMapping):
            self.error(source.position, "a mission file must be a mapping", vocabulary.MISSION_KEYS)
            return model.Mission(path.stem, "", path, findings=tuple(self.findings))
        if source.get("scenarios") is not None and source.get("tree") is None:
            message = "this is a file of scenarios, and no mission"
            self.error(source.position, message, [f"florence test {path.name}"])
            return model.Mission(path.stem, "", path, findings=tuple(self.findings))
        for key, _ in source.entries:
            if key.text not in vocabulary.MISSION_KEYS and not self.full:
                valid = suggestions.for_section(key.text, vocabulary.MISSION_KEYS)
                self.error(key.position, f"unknown key of a mission {key.text!r}", valid)
        restart, tree = (source.get(key) for key in ("on_restart", "tree"))
        inputs, input_positions = read_ports(self, source.get("inputs"), "an input", vocabulary.INPUT_KEYS)
        outputs, output_positions = read_ports(
            self, source.get("outputs"), "an output", vocabulary.OUTPUT_KEYS
        )
        keys, key_positions = read_ports(self, source.get("keys"), "a key", vocabulary.KEY_KEYS)
        self._check_keys(keys, key_positions, inputs, outputs)
        if tree is None and not _is_misspelt(source, "tree"):
            self.error(source.position, "the mission has no tree", ["tree: {a node}"])
        return model.Mission(
            name=self._name(source, path),
            description=self._text(source, "description"),
            file=path,
            inputs=inputs,
            outputs=outputs,
            keys=keys,
            properties=read_properties(self, source.get("properties")),
            on_restart=(restart and self.choice(restart, "on_restart", vocabulary.ON_RESTART)) or "abort",
            tree=self.node(tree) if tree is not None else None,
            positions={**key_positions, **output_positions, **input_positions},
            findings=tuple(self.findings),
            lost=frozenset(_named_anywhere(source)) if self.findings else frozenset(),
            version=hashlib.sha256(data).hexdigest()[:16],
            text=data.decode(),
            imported_from=self._text(source, "imported_from"),
        )

    def _text(self, mapping: YamlMapping, key: str) -> str:
        source = mapping.get(key)
        return (self.text(source, key) or "") if source is not None else ""

    def _name(self, mapping: YamlMapping, path: Path) -> str:
        source = mapping.get("mission")
        if source is None and _is_misspelt(mapping, "mission"):
            return path.stem
        if source is None:
            self.error(mapping.position, "the mission has no name", [f"mission: {path.stem}"])
            return path.stem
        name = self.identifier(source, "mission")
        if name is None:
            return path.stem
        if name.text != path.stem:
            valid = [path.stem] if vocabulary.IDENTIFIER.fullmatch(path.stem) else []
            message = f"the mission is called {name.text!r} but its file is {path.name}"
            self.error(name.position, message, valid)
        return name.text

    def _check_keys(
        self,
        keys: Mapping[str, Port],
        positions: Mapping[str, Position],
        inputs: Mapping[str, Port],
        outputs: Mapping[str, Port],
    ) -> None:
        for name, port in keys.items():
            if name in inputs:
                self.error(positions[name], f"{name!r} is an input, which is a key already")
            elif name in outputs and outputs[name].kind is not port.kind:
                kinds = f"{with_article(port.kind)} here and {with_article(outputs[name].kind)} as output"
                self.error(positions[name], f"{name!r} is {kinds}", [f"type: {outputs[name].kind.value}"])

    # ---- any node -------------------------------------------------------------------------------------

    def node(self, source: YamlNode) -> model.Node | None:
        """Parse one node with everything below it."""
        if not isinstance(source, YamlMapping):
            self.error(source.position, *suggestions.for_not_a_node(source))
            return None
        source = self._without_unless(source)
        kinds = [(key, value) for key, value in source.entries if key.text not in _ALL_MODIFIERS]
        if source.get("wait_until") is not None and source.get("timeout") is not None:
            return self._wait_in_time(source)
        if len(kinds) != 1:
            return self._not_one_kind(source, [key for key, _ in kinds])
        key, value = kinds[0]
        if key.text not in words.NODE_KINDS and suggestions.is_no_skill(key, value, source):
            return self._unknown_kind(key, value, source)
        self._check_modifiers(key.text, source)
        if self._is_misplaced(key, value, source):
            return None
        ensure = source.get("ensure")
        if ensure is not None:
            return self._ensured(key, value, source, ensure)
        return self._unensured(key, value, source)

    def _ensured(
        self, key: YamlScalar, value: YamlNode, source: YamlMapping, ensure: YamlNode
    ) -> model.Node | None:
        """Read a node and the condition that its success must meet."""
        outside = (*vocabulary.OUTSIDE, "code")
        entries = [entry for entry in source.entries if entry[0].text != "ensure"]
        inner = tuple(entry for entry in entries if entry[0].text not in outside)
        outer = tuple(entry for entry in entries if entry[0].text in outside)
        fields = self.fields(key, YamlMapping(outer, source.position))
        code = fields.pop("code", None) or model.Literal(NOT_ENSURED, False, ensure.position)
        node = self._unensured(key, value, YamlMapping(inner, source.position))
        expression = self.expression(ensure, "ensure")
        if node is None or expression is None:
            return None
        condition = kinds.Condition(
            condition=expression, name=f"ensure {expression.text}", code=code, position=ensure.position
        )
        return kinds.Ensure(children=(node, condition), **fields)

    def _unensured(self, key: YamlScalar, value: YamlNode, source: YamlMapping) -> model.Node | None:
        """Read a node without ``ensure``."""
        until, handlers = source.get("until"), source.get("on_failure")
        if (
            key.text == "for_each"
            and isinstance(until, YamlScalar)
            and close_matches(until.text, ["success"])
        ):
            message = f"until: {until.text!r} is no expression; that the first success ends a list has a word"
            self.error(until.position, message, ["first_success: true"])
            until = None
        if until is None and handlers is None:
            return self._interruptible(key, value, source)
        return self._wrapped(key, value, source, until, handlers)

    def _without_unless(self, source: YamlMapping) -> YamlMapping:
        """Refuse ``unless``, which was another word for ``when: not``."""
        key, value, when = source.key("unless"), source.get("unless"), source.get("when")
        if key is None:
            return source
        wanted = negated(value.text if isinstance(value, YamlScalar) else "")
        if isinstance(when, YamlScalar):
            wanted = f"({when.text}) and {wanted}"
        self.error(key.position, "there is no 'unless' any more: 'when' says it", [f"when: {wanted}"])
        entries = tuple(entry for entry in source.entries if entry[0] is not key)
        return YamlMapping(entries, source.position)

    def _unknown_kind(self, key: YamlScalar, value: YamlNode, source: YamlMapping) -> model.Node | None:
        """Report what looks like a kind of node and is none; what stands below it is parsed all the same."""
        meant = suggestions.meant_kind(key.text)
        message = f"there is no skill and no kind of node {key.text!r}"
        self.error(key.position, message, meant or words.NODE_KINDS)
        if meant and meant[0] in words.NODE_KINDS:
            return self.node(_renamed(source, key, meant[0]))
        below = value.items if isinstance(value, YamlSequence) else (value,)
        return self._together(key, (*map(self._if_node, below), *self._below(source)))

    def _below(self, source: YamlMapping) -> Iterator[model.Node | None]:
        """Yield the nodes below the modifiers of a node that cannot have them."""
        for name in ("do", "then", "else", "default"):
            yield self._if_node(source.get(name))
        cases = source.get("cases")
        yield from (
            self._if_node(case) for _, case in (cases.entries if isinstance(cases, YamlMapping) else ())
        )

    def _if_node(self, source: YamlNode | None) -> model.Node | None:
        return self.node(source) if isinstance(source, YamlMapping) else None

    @staticmethod
    def _together(key: YamlScalar, nodes: Iterable[model.Node | None]) -> model.Node | None:
        """Hold nodes that are checked, although what holds them is wrong."""
        children = tuple(node for node in nodes if node is not None)
        return kinds.Sequence(children=children, position=key.position) if children else None

    def _wait_in_time(self, source: YamlMapping) -> model.Node | None:
        """Read ``wait_until`` with a ``timeout`` beside it: the short form of a ``timeout`` round it."""
        inner = [entry for entry in source.entries if entry[0].text == "wait_until"]
        outer = [entry for entry in source.entries if entry[0].text != "wait_until"]
        key = inner[0][0]
        around = YamlScalar("do", quoted=False, position=key.position)
        return self.node(
            YamlMapping((*outer, (around, YamlMapping(tuple(inner), key.position))), source.position)
        )

    def _wrapped(
        self,
        key: YamlScalar,
        value: YamlNode,
        source: YamlMapping,
        until: YamlNode | None,
        handlers: YamlNode | None,
    ) -> model.Node | None:
        """Wrap a node in what its ``until`` and ``on_failure`` make of it."""
        outside = (*vocabulary.OUTSIDE, *(("code",) if until is not None else ()))
        entries = [entry for entry in source.entries if entry[0].text not in ("until", "on_failure")]
        inner = tuple(entry for entry in entries if entry[0].text not in outside)
        outer = tuple(entry for entry in entries if entry[0].text in outside)
        fields = self.fields(key, YamlMapping(outer, source.position))
        node = self._interruptible(key, value, YamlMapping(inner, source.position))
        goal = self.question(until, "until") if until is not None else None
        caught = self._handlers(handlers) if handlers is not None else ()
        if node is None or (goal is None and until is not None):
            return None
        if goal is not None and not caught:
            return kinds.Until(child=node, goal=goal, **fields)
        if goal is not None:
            code = fields.pop("code", None)
            node = kinds.Until(child=node, goal=goal, code=code, position=key.position)
        return kinds.OnFailure(child=node, handlers=caught, **fields)

    def _interruptible(self, key: YamlScalar, value: YamlNode, source: YamlMapping) -> model.Node | None:
        """Read a node of a kind, and what interrupts it."""
        interrupted_by = source.get("interrupted_by")
        if interrupted_by is None:
            return self._of_kind(key, value, source)
        entries = [entry for entry in source.entries if entry[0].text != "interrupted_by"]
        guarded = source.get("while") is not None
        outside = (*vocabulary.ANYWHERE, *(("code",) if guarded else ()))
        inner = tuple(entry for entry in entries if entry[0].text not in outside)
        outer = tuple(entry for entry in entries if entry[0].text in outside)
        node = self._of_kind(key, value, YamlMapping(inner, source.position))
        goal, interruption = self._interruption(interrupted_by)
        fields = self.fields(key, YamlMapping(outer, source.position))
        if node is None or goal is None or interruption is None:
            return None
        return kinds.Interruptible(child=node, goal=goal, interruption=interruption, **fields)

    def _interruption(self, source: YamlNode) -> tuple[model.Node | None, model.Node | None]:
        """Read ``interrupted_by``: what is asked, and what is done then."""
        entries = source.entries if isinstance(source, YamlMapping) else ()
        unknown = [key for key, _ in entries if key.text not in vocabulary.INTERRUPTION_KEYS]
        if unknown or len(entries) != len(vocabulary.INTERRUPTION_KEYS):
            position = unknown[0].position if unknown else source.position
            valid = ["interrupted_by: {if: an expression or a node, do: a node}"]
            self.error(position, "interrupted_by needs what is asked and what is done then", valid)
            return None, None
        parts = {key.text: item for key, item in entries}
        return self.question(parts["if"], "interrupted_by"), self.node(parts["do"])

    def _handlers(self, source: YamlNode) -> tuple[tuple[model.Literal, model.Node], ...]:
        """Read ``on_failure``: what is done about failures, by code."""
        entries = source.entries if isinstance(source, YamlMapping) else ()
        if not entries:
            self.error(source.position, "on_failure needs codes and nodes", ["on_failure: {any: {a node}}"])
        handlers = []
        for key, item in entries:
            if key.text in words.NODE_KINDS:
                message = f"on_failure: {key.text!r} is a kind of node, and the code is missing"
                self.error(key.position, message, [f"any: {{{key.text}: ...}}"])
                continue
            alone = (
                [f"{each.strip()}: with its node" for each in key.text.split(",")] if "," in key.text else ()
            )
            code, node = self.identifier(key, "a code in on_failure", alone), self.node(item)
            if code is not None and node is not None:
                handlers.append((code, node))
        return tuple(handlers)

    def _of_kind(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> model.Node | None:
        form, kind = Form(self, key, value, mapping), kinds.BY_WORD.get(key.text)
        if kind is not None:
            return kind.read(form)
        skill = kinds.RunSkill.read(form)
        wrong = tuple(self._below(mapping))
        return self._together(key, (skill, *wrong)) if any(wrong) else skill

    def _not_one_kind(self, source: YamlMapping, keys: list[YamlScalar]) -> model.Node | None:
        """Say what is wrong with none or several kinds in one node, and go on with what was meant."""
        if not keys:
            modifiers = [key.text for key, _ in source.entries]
            self.error(source.position, *suggestions.for_no_kind(modifiers))
            return None
        fallen_apart = list(unquoted_commas(source))
        for text in fallen_apart:
            self.unquoted_comma(text)
        if fallen_apart:
            return None
        for key in keys:
            other = suggestions.other_modifier(key.text, source) if key is not keys[0] else None
            close = [other] if other else difflib.get_close_matches(key.text, _ALL_MODIFIERS, n=1, cutoff=0.7)
            if close and key.text not in words.NODE_KINDS and not suggestions.is_else_if(key.text):
                self.error(key.position, f"unknown modifier {key.text!r}", close)
                return self.node(_renamed(source, key, close[0])) if source.get(close[0]) is None else None
        names = " and ".join(repr(key.text) for key in keys)
        value = source.get(keys[1].text)
        valid = suggestions.for_two_kinds(keys[0], keys[1], value) if value is not None else ()
        self.error(keys[1].position, f"a node has exactly one kind, not {names}", valid)
        lists = [value for key in keys if isinstance(value := source.get(key.text), YamlSequence)]
        return self._together(keys[0], (self._if_node(item) for each in lists for item in each.items))

    def _check_modifiers(self, kind: str, mapping: YamlMapping) -> None:
        own = kind if kind in words.NODE_KINDS else "a skill"
        for key, _ in mapping.entries:
            kinds = words.OWNERS.get(key.text)
            beside = vocabulary.BESIDE.get(key.text, ())
            named = [word for word in beside if mapping.get(word) is not None]
            if kinds is not None and own in kinds and (not named or _may_fail(kind, mapping)):
                named.insert(0, own)
            if len(named) > 1:
                message = f"{key.text}: it is not clear whether that is about {' or '.join(map(repr, named))}"
                self.error(key.position, message, ["sequence: [the node with what stays inside]"])
            elif kinds is not None and not named:
                owners = (*kinds, *(f"a node with {word}" for word in beside))
                message = f"{key.text!r} does not belong to {kind!r} but to {' and '.join(owners)}"
                usable = [name for name, owners in words.OWNERS.items() if own in owners]
                of_if = (f"{key.text} indented like the if that it belongs to",) if kinds == ("if",) else ()
                self.error(key.position, message, (*of_if, *usable, *vocabulary.ANYWHERE))

    def _is_misplaced(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> bool:
        """Tell whether modifiers stand inside the value of a kind key, indented one step too far."""
        if not isinstance(value, YamlMapping):
            return False
        if key.text in words.OWNERS["do"]:
            kind = key.text
            example = f"{kind}: {kinds.BY_WORD[kind].kind.argument}"
            message = f"a single value is needed after {kind}; `do` has the same indentation as {kind}"
            self.error(key.position, message, [example])
            return True
        if key.text == "if" and value.get("then") is not None and mapping.get("then") is None:
            valid = ["then: indented like if", "if: $distance < 1 m"]
            self.error(value.position, "the branch is inside the condition of the if", valid)
            return True
        return False


def _named_anywhere(source: YamlMapping) -> Iterator[str]:
    """Yield the keys that a mission names in any of its parts, also in those that cannot be read."""
    for key, value in source.entries:
        if key.text == "tree":
            yield from suggestions.written_keys(value)
        elif key.text not in _NO_KEYS:
            yield from suggestions.named_in(value)
            # A tree under a misspelt name.
            yield from suggestions.written_keys(value)


def _renamed(source: YamlMapping, key: YamlScalar, name: str) -> YamlMapping:
    """Rename a key of a table."""
    renamed = YamlScalar(name, key.quoted, key.position, key.first_column)
    entries = tuple((renamed if one is key else one, value) for one, value in source.entries)
    return YamlMapping(entries, source.position)


def _may_fail(kind: str, mapping: YamlMapping) -> bool:
    """Tell whether a node has a failure of its own, which its ``code`` may be about."""
    return kind not in kinds.BY_WORD or kinds.BY_WORD[kind].has_own_failure(mapping)


def _is_misspelt(mapping: YamlMapping, name: str) -> bool:
    """Tell whether one of the unknown keys, which are findings already, probably means this key."""
    unknown = [
        key.text for key, _ in mapping.entries[:MAX_FINDINGS] if key.text not in vocabulary.MISSION_KEYS
    ]
    return any(suggestions.for_section(key, vocabulary.MISSION_KEYS)[0].startswith(name) for key in unknown)
