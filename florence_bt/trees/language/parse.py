"""A mission file: from YAML to the model. What a mission refers to is checked elsewhere (``checks.lint``).

What is wrong is added to the findings; a broken node is left out and the rest is parsed.
"""

from __future__ import annotations

import difflib
import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path

from florence_bt.behaviours.keys import HIDDEN
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError, close_matches
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, YamlSequence, parse_yaml
from florence_bt.core.text_files import MAX_MISSION_BYTES, read_bytes
from florence_bt.core.unquoted_commas import unquoted_commas
from florence_bt.trees import kinds
from florence_bt.trees.language import _suggestions as suggestions
from florence_bt.trees.language import model, vocabulary
from florence_bt.trees.language.expressions.parser import negated
from florence_bt.trees.language.expressions.syntax import Binary, Key, print_term
from florence_bt.trees.language.findings import MAX_FINDINGS
from florence_bt.trees.language.form import Fields, Form, NodeReader
from florence_bt.trees.language.ports import read_ports
from florence_bt.trees.language.quantities import read_value, with_article
from florence_bt.trees.language.values import term_of

SHORTEST_S = 0.01
"""The shortest period of ``every``: as often as an executor of BehaviorTree.CPP usually ticks."""
_ALL_MODIFIERS = (*vocabulary.ANYWHERE, *vocabulary.MODIFIERS)
_TIME_OF_DAY = re.compile(r"(?P<time>\d{1,2}:\d{2})(?: or (?P<sooner>.+))?")
"""A time of day, perhaps with what ends the waiting sooner: ``22:00``, ``22:00 or $done``."""
_TIME_TO_WAIT_FOR = re.compile(r"(?:until|till|at) ((?:[01]?\d|2[0-3]):[0-5]\d)")
"""A time of day where a duration is wanted: ``until 22:00``."""
_TIME_MEANT = re.compile(
    r"(?:[^\W\d]+,? )?(?:at |um )?(?P<hours>\d{1,2})(?:(?P<sign>[:.h])(?P<minutes>\d{2})(?::\d{2})?)?"
    r"\s*(?P<half>[ap]\.?m\.?)?\s*(?P<word>uhr|o'clock|h)?",
    re.IGNORECASE,
)
"""How people write times of the day: ``8pm``, ``20.00``, ``20 Uhr``, ``Monday 08:00``."""
_ASSIGNMENT = re.compile(r"\$?(?P<key>[a-z][a-z0-9_]*)\s*[:=]\s*(?P<value>[^=].*)")
"""What people write who know a programming language: ``tries = 3``."""
_NO_KEYS = ("mission", "description", "imported_from", "on_restart")
"""Keys of a mission whose values name no keys."""
_EXAMPLES = {"retry": "3", "repeat": "3", "for_each": "$rooms"}
"""How the value after a kind key is written; where nothing stands it is a duration."""


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
            on_restart=(restart and self.choice(restart, "on_restart", vocabulary.ON_RESTART)) or "abort",
            tree=self.node(tree) if tree is not None else None,
            positions={**key_positions, **output_positions, **input_positions},
            findings=tuple(self.findings),
            lost=frozenset(_named_anywhere(source)) if self.findings else frozenset(),
            version=hashlib.sha256(data).hexdigest()[:16],
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
        if key.text not in vocabulary.NODE_KINDS and suggestions.is_no_skill(key, value, source):
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
        code = fields.pop("code", None) or model.Literal(vocabulary.NOT_ENSURED, False, ensure.position)
        node = self._unensured(key, value, YamlMapping(inner, source.position))
        expression = self.expression(ensure, "ensure")
        if node is None or expression is None:
            return None
        condition = kinds.Condition(
            condition=expression, name=f"ensure {expression.text}", code=code, position=ensure.position
        )
        return model.Ensure(children=(node, condition), **fields)

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
        self.error(key.position, message, meant or vocabulary.NODE_KINDS)
        if meant and meant[0] in vocabulary.NODE_KINDS:
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
        return model.Sequence(children=children, position=key.position) if children else None

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
        goal = self._question(until, "until") if until is not None else None
        caught = self._handlers(handlers) if handlers is not None else ()
        if node is None or (goal is None and until is not None):
            return None
        if goal is not None and not caught:
            return model.Until(child=node, goal=goal, **fields)
        if goal is not None:
            code = fields.pop("code", None)
            node = model.Until(child=node, goal=goal, code=code, position=key.position)
        return model.OnFailure(child=node, handlers=caught, **fields)

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
        return model.Interruptible(child=node, goal=goal, interruption=interruption, **fields)

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
        return self._question(parts["if"], "interrupted_by"), self.node(parts["do"])

    def _question(self, source: YamlNode, what: str) -> model.Node | None:
        """Read a node that is asked; an expression is the condition of that text."""
        if isinstance(source, YamlMapping):
            return self.node(source)
        if isinstance(source, YamlScalar) and (time := _time_meant(source.text)) is not None:
            valid = [f'"{time}"' if what == "wait_until" else f'{{wait_until: "{time}"}}']
            self.error(source.position, f"{what}: {source.text!r} is no time of day", valid)
            return None
        condition = self.expression(source, what, or_node=True)
        return kinds.Condition(condition=condition, position=source.position) if condition else None

    def _handlers(self, source: YamlNode) -> tuple[tuple[model.Literal, model.Node], ...]:
        """Read ``on_failure``: what is done about failures, by code."""
        entries = source.entries if isinstance(source, YamlMapping) else ()
        if not entries:
            self.error(source.position, "on_failure needs codes and nodes", ["on_failure: {any: {a node}}"])
        handlers = []
        for key, item in entries:
            if key.text in vocabulary.NODE_KINDS:
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
        if key.text in kinds.BY_WORD:
            return kinds.BY_WORD[key.text].read(Form(self, key, value, mapping))
        match key.text:
            case "sequence":
                children, memory = self._children(key, value), self._memory(mapping)
                return model.Sequence(children=children, memory=memory, **self.fields(key, mapping))
            case "selector":
                children, memory = self._children(key, value), self._memory(mapping)
                return model.Selector(children=children, memory=memory, **self.fields(key, mapping))
            case "parallel":
                return self._parallel(key, value, mapping)
            case "if":
                return self._if(key, value, mapping)
            case "switch":
                return self._switch(key, value, mapping)
            case kind if kind in vocabulary.MODIFIERS["do"]:
                return self._decorator(key, value, mapping)
            case "once" | "invert" | "succeed":
                fields, child = self.fields(key, mapping), self.node(value)
                wrapper = {"once": model.Once, "invert": model.Invert, "succeed": model.Succeed}[key.text]
                return wrapper(child=child, **fields) if child is not None else None
            case "fail":
                reason, fields = self.template(value, "fail"), self.fields(key, mapping)
                return model.Fail(reason=reason, **fields) if reason is not None else None
            case "wait" if isinstance(value, YamlScalar) and (
                time := _TIME_TO_WAIT_FOR.fullmatch(value.text)
            ):
                self.error(
                    value.position, f"wait: {value.text!r} is a time of day", [f"wait_until: {time[1]}"]
                )
                return None
            case "wait":
                duration, fields = self.value(value, "wait"), self.fields(key, mapping)
                return model.Wait(duration=duration, **fields) if duration is not None else None
            case "wait_until":
                return self._wait_until(key, value, mapping)
            case "set":
                return self._set(key, value, mapping)
            case "add":
                return self._sums(value, self.fields(key, mapping))
            case "append":
                values, fields = self.values(value, "append"), self.fields(key, mapping)
                if not isinstance(value, YamlMapping) or not value.entries:
                    self.error(value.position, "append needs keys and values", ['append: {report: "text"}'])
                return model.Append(values=values, **fields)
            case "run":
                return self._call_mission(key, value, mapping)
        skill = self._run_skill(key, value, mapping)
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
            if close and key.text not in vocabulary.NODE_KINDS and not suggestions.is_else_if(key.text):
                self.error(key.position, f"unknown modifier {key.text!r}", close)
                return self.node(_renamed(source, key, close[0])) if source.get(close[0]) is None else None
        names = " and ".join(repr(key.text) for key in keys)
        value = source.get(keys[1].text)
        valid = suggestions.for_two_kinds(keys[0], keys[1], value) if value is not None else ()
        self.error(keys[1].position, f"a node has exactly one kind, not {names}", valid)
        lists = [value for key in keys if isinstance(value := source.get(key.text), YamlSequence)]
        return self._together(keys[0], (self._if_node(item) for each in lists for item in each.items))

    def _check_modifiers(self, kind: str, mapping: YamlMapping) -> None:
        own = kind if kind in vocabulary.NODE_KINDS else "a skill"
        for key, _ in mapping.entries:
            kinds = vocabulary.MODIFIERS.get(key.text)
            beside = vocabulary.BESIDE.get(key.text, ())
            named = [word for word in beside if mapping.get(word) is not None]
            if kinds is not None and own in kinds and (not named or kind != "for_each" or _may_fail(mapping)):
                named.insert(0, own)
            if len(named) > 1:
                message = f"{key.text}: it is not clear whether that is about {' or '.join(map(repr, named))}"
                self.error(key.position, message, ["sequence: [the node with what stays inside]"])
            elif kinds is not None and not named:
                owners = (*kinds, *(f"a node with {word}" for word in beside))
                message = f"{key.text!r} does not belong to {kind!r} but to {' and '.join(owners)}"
                usable = [name for name, owners in vocabulary.MODIFIERS.items() if own in owners]
                of_if = (f"{key.text} indented like the if that it belongs to",) if kinds == ("if",) else ()
                self.error(key.position, message, (*of_if, *usable, *vocabulary.ANYWHERE))

    def _is_misplaced(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> bool:
        """Tell whether modifiers stand inside the value of a kind key, indented one step too far."""
        if not isinstance(value, YamlMapping):
            return False
        if key.text in vocabulary.MODIFIERS["do"]:
            kind, example = key.text, f"{key.text}: {_EXAMPLES.get(key.text, '30 s')}"
            message = f"a single value is needed after {kind}; `do` has the same indentation as {kind}"
            self.error(key.position, message, [example])
            return True
        if key.text == "if" and value.get("then") is not None and mapping.get("then") is None:
            valid = ["then: indented like if", "if: $distance < 1 m"]
            self.error(value.position, "the branch is inside the condition of the if", valid)
            return True
        return False

    # ---- composites -----------------------------------------------------------------------------------

    def _children(self, key: YamlScalar, value: YamlNode) -> tuple[model.Node, ...]:
        if not isinstance(value, YamlSequence) or not value.items:
            valid = suggestions.for_children(key, value)
            self.error(value.position, f"{key.text} needs a list of nodes", valid)
            return ()
        return tuple(node for item in value.items if (node := self.node(item)) is not None)

    def _child(self, key: YamlScalar, mapping: YamlMapping, modifier: str = "do") -> model.Node | None:
        source = mapping.get(modifier)
        if source is None:
            message = f"{key.text} needs a node under `{modifier}`"
            self.error(key.position, message, [f"{modifier}: {{a node}}"])
            return None
        return self.node(source)

    def _optional_child(self, mapping: YamlMapping, modifier: str) -> model.Node | None:
        source = mapping.get(modifier)
        return self.node(source) if source is not None else None

    def _memory(self, mapping: YamlMapping) -> bool:
        source = mapping.get("memory")
        return source is None or self.choice(source, "memory", ("true", "false")) != "false"

    def _parallel(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> model.Node:
        children = self._children(key, value)
        source = mapping.get("policy")
        policy = self._policy(source, children) if source is not None else model.ParallelPolicy()
        return model.Parallel(children=children, policy=policy, **self.fields(key, mapping))

    def _policy(self, source: YamlNode, children: tuple[model.Node, ...]) -> model.ParallelPolicy:
        if isinstance(source, YamlMapping):
            return self._counting_policy(source)
        if isinstance(source, YamlScalar):
            if source.text in vocabulary.POLICIES:
                return model.ParallelPolicy(model.PolicyKind(source.text), position=source.position)
            valid = (*vocabulary.POLICIES, "[the name of a branch]", "{succeed: 2, fail: 1}")
            self.error(source.position, f"policy cannot be {source.text!r}", valid)
            return model.ParallelPolicy(position=source.position)
        if not source.items:
            self.error(source.position, "no branch is named", [f"[{child.title}]" for child in children])
        names = tuple(
            model.Literal(name, True, item.position)
            for item in source.items
            if (name := self.text(item, "the name of a branch")) is not None
        )
        return model.ParallelPolicy(model.PolicyKind.SELECTED, names=names, position=source.position)

    def _counting_policy(self, source: YamlMapping) -> model.ParallelPolicy:
        for key, _ in source.entries:
            if key.text not in vocabulary.POLICY_KEYS:
                self.unknown(
                    key.position, f"unknown key of a policy {key.text!r}", key.text, vocabulary.POLICY_KEYS
                )
        if not any(difflib.get_close_matches(key.text, ["succeed"]) for key, _ in source.entries):
            self.error(source.position, "the policy lacks succeed", ["{succeed: 2, fail: 1}"])
        succeed, fail = (self._count(source.get(name), name) for name in vocabulary.POLICY_KEYS)
        return model.ParallelPolicy(
            model.PolicyKind.COUNTED, succeed=succeed or 1, fail=fail, position=source.position
        )

    def _count(self, source: YamlNode | None, name: str) -> int | None:
        if source is None:
            return None
        try:
            number = read_value(source.text, Kind.INTEGER) if isinstance(source, YamlScalar) else 0
        except ConfigError:
            number = 0
        if number < 1:
            self.error(source.position, f"{name} must be a number of branches", [f"{name}: 1"])
            return None
        return int(number)

    def _if(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> model.Node | None:
        condition: model.Expression | model.Node | None
        if isinstance(value, YamlMapping):
            condition = self.node(value)
        else:
            condition = self.expression(value, "if", or_node=True)
        then, otherwise = self._child(key, mapping, "then"), self._optional_child(mapping, "else")
        fields, memory = self.fields(key, mapping), self._memory(mapping)
        if condition is None or then is None:
            return None
        return model.If(condition=condition, then=then, otherwise=otherwise, memory=memory, **fields)

    def _switch(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> model.Node | None:
        switched_on = self.value(value, "switch")
        source = mapping.get("cases")
        entries = source.entries if isinstance(source, YamlMapping) else ()
        if not entries:
            position = source.position if source is not None else key.position
            self.error(position, "switch needs cases", ["cases: {value: node, value: node}"])
        cases = tuple(
            (model.Literal(name.text, name.quoted, name.position), node)
            for name, item in entries
            if (node := self.node(item)) is not None
        )
        default, fields = self._optional_child(mapping, "default"), self.fields(key, mapping)
        if switched_on is None:
            return None
        return model.Switch(value=switched_on, cases=cases, default=default, **fields)

    # ---- decorators -----------------------------------------------------------------------------------

    def _decorator(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> model.Node | None:
        """Read a node with the node below it under ``do``."""
        fields, child = self.fields(key, mapping), self._child(key, mapping)
        endless = isinstance(value, YamlScalar) and value.text == vocabulary.FOREVER
        if isinstance(value, YamlScalar) and (meant := suggestions.for_rounds(key.text, value.text)):
            self.error(value.position, f"{key.text}: a whole number is needed, not {value.text!r}", [meant])
            endless = True
        argument = None if endless else self.value(value, key.text)
        if child is None or (argument is None and not (endless and key.text == "repeat")):
            return None
        if key.text == "repeat":
            return model.Repeat(child=child, rounds=argument, **fields)
        assert argument is not None  # that was a loop
        return model.Timeout(child=child, duration=argument, **fields)

    def _wait_until(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> model.Node | None:
        fields = self.fields(key, mapping)
        given = value.get("time") if isinstance(value, YamlMapping) and len(value.entries) == 1 else None
        if given is not None:
            time = self.value(given, "time")
            return self._wait_for_time(time, None, given.position, fields) if time is not None else None
        written = _TIME_OF_DAY.fullmatch(value.text.strip()) if isinstance(value, YamlScalar) else None
        if isinstance(value, YamlScalar) and written is not None:
            sooner = self._sooner(value, written) if written["sooner"] else None
            literal = model.Literal(written["time"], True, value.position)
            return self._wait_for_time(literal, sooner, value.position, fields)
        goal = self._question(value, "wait_until")
        return model.WaitUntil(goal=goal, **fields) if goal is not None else None

    def _sooner(self, value: YamlScalar, written: re.Match[str]) -> model.Node | None:
        """Read the expression behind a time of day and ``or``."""
        start = value.text.index(written["sooner"])
        column = None if value.first_column is None else value.first_column + start
        place = value.position if column is None else Position(value.position.line, column)
        return self._question(YamlScalar(written["sooner"], False, place, column), "wait_until")

    def _wait_for_time(
        self, time: model.Value, sooner: model.Node | None, place: Position, fields: Fields
    ) -> model.Node:
        """Read a time of day, ``wait_until: "22:00"``: the next such moment is looked up, and waited for.

        Args:
            time: Hours and minutes, written out or in a key.
            sooner: What ends the waiting, too, if anything does.
            place: Where it stands.
            fields: What every node has.
        """
        shown = model.show(time)
        if isinstance(time, model.Literal) and _time_meant(shown) != f"{shown:0>5}":
            self.error(place, f"wait_until: {shown!r} is no time of day", ["22:00"])
        written = shown.replace(":", "_") if isinstance(time, model.Literal) else f"of_line_{place.line}"
        name = f"{HIDDEN}time_{written}"
        look_up = model.RunSkill(
            skill="look_up_time",
            inputs=((model.Literal("time", True, place), time),),
            outputs=((model.Literal("date", True, place), model.Literal(name, True, place)),),
            position=place,
        )
        asked: model.Node = model.RunSkill(
            skill="time_reached",
            inputs=((model.Literal("date", True, place), model.Reference(name, place)),),
            position=place,
        )
        if sooner is not None:
            asked = model.Selector(children=(asked, sooner), position=place)
        wait = model.WaitUntil(goal=asked, position=place)
        fields["name"] = fields.get("name") or f"wait until {shown}"
        return model.Sequence(children=(look_up, wait), **fields)

    # ---- leaves ---------------------------------------------------------------------------------------

    def _set(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> model.Node:
        fields, empty = self.fields(key, mapping), isinstance(value, YamlScalar) and value.empty
        if isinstance(value, YamlScalar) and not empty and (match := _ASSIGNMENT.fullmatch(value.text)):
            valid = [f"set: {{{match['key']}: {suggestions.as_value(match['value'])}}}"]
            self.error(value.position, "set must be a mapping (key: value)", valid)
            return model.Set(values=(), **fields)
        values = self.values(value, "set")
        if empty or (isinstance(value, YamlMapping) and not value.entries):
            self.error(value.position, "set needs keys and values", ["set: {key: value}"])
        return model.Set(values=values, **fields)

    def _sums(self, value: YamlNode, fields: Fields) -> model.Node:
        """Read ``add: {n: 1}``, which is short for ``set: {n: "${$n + 1}"}``."""
        if not isinstance(value, YamlMapping) or not value.entries:
            written = value.text.removeprefix("$") if isinstance(value, YamlScalar) else ""
            meant = written if vocabulary.IDENTIFIER.fullmatch(written) else "key"
            self.error(value.position, "add needs keys and values", [f"add: {{{meant}: 1}}"])
            return model.Add(values=(), **fields)
        values = self.values(value, "add")
        sums = []
        for name, given in values:
            if (term := term_of(given)) is not None:
                total = Binary("+", Key(name.text, name.position), term, given.position)
                sums.append((name, model.Expression(print_term(total), total, given.position)))
                continue
            message = f"add: {model.show(given)!r} is no number and no quantity"
            valid = [f"append: {{{name.text}: {model.show(given)}}}, to a text or a list"]
            self.error(given.position, message, valid)
        return model.Add(values=tuple(sums), **fields)

    def _call_mission(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> model.Node | None:
        fields = self.fields(key, mapping)
        if isinstance(value, YamlMapping):
            valid = ["run: goto_room", "with: {room: kitchen} indented like run"]
            self.error(value.position, "run needs the name of a mission, not a mapping", valid)
            return None
        mission = self.identifier(value, "run", suggestions.for_call(value))
        given = mapping.get("with")
        inputs, outputs = self.values(given, "with"), self.keys(mapping.get("out"))
        if mission is None:
            return None
        unread = _unread(given, inputs)
        return model.CallMission(mission=mission, inputs=inputs, outputs=outputs, unread=unread, **fields)

    def _run_skill(self, key: YamlScalar, value: YamlNode, mapping: YamlMapping) -> model.Node:
        """Read a skill: every kind key that is not a kind of node is the name of a skill."""
        given = isinstance(value, YamlMapping)
        value = self._without_modifiers(key, value)
        inputs = self.values(value, key.text) if given else ()
        return model.RunSkill(
            skill=key.text,
            inputs=inputs,
            outputs=self.keys(mapping.get("out")),
            mapping_given=given or (isinstance(value, YamlScalar) and value.empty),
            unread=_unread(value, inputs),
            written=value.text if isinstance(value, YamlScalar) else "",
            every=self._every(mapping.get("every")),
            **self.fields(key, mapping),
        )

    def _every(self, source: YamlNode | None) -> float | None:
        """Read ``every`` in seconds."""
        seconds = self.duration(source, "every") if source is not None else None
        if source is None or seconds is None:
            return None
        if seconds < SHORTEST_S:
            self.error(source.position, "every: at least 10 ms are needed", ["1 s", "100 ms"])
            return None
        return seconds

    def _without_modifiers(self, key: YamlScalar, value: YamlNode) -> YamlNode:
        """Leave out modifiers that were indented as if they were inputs, and say so."""
        if not isinstance(value, YamlMapping):
            return value
        for name, _ in value.entries:
            if name.text in vocabulary.NEVER_INPUTS:
                message = f"{name.text!r} stands among the inputs of {key.text}"
                self.error(name.position, message, [f"{name.text} indented like {key.text}"])
        entries = tuple(
            (name, item) for name, item in value.entries if name.text not in vocabulary.NEVER_INPUTS
        )
        return YamlMapping(entries, value.position)


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


def _time_meant(text: str) -> str | None:
    """Return a time of day that is written in another way as hours and minutes: ``20:00`` for ``8 pm``."""
    match = _TIME_MEANT.fullmatch(text.strip())
    if match is None or not (match["sign"] or match["half"] or match["word"]):
        return None
    hours, minutes = int(match["hours"]), int(match["minutes"] or 0)
    if match["half"]:
        hours = hours % 12 + 12 * (match["half"][0] in "pP")
    return f"{hours:02}:{minutes:02}" if hours < 24 and minutes < 60 else None


def _may_fail(loop: YamlMapping) -> bool:
    """Tell whether a ``for_each`` has a failure of its own, which its ``code`` may be about."""
    first = loop.get("first_success")
    return isinstance(first, YamlScalar) and first.text == "true"


def _is_misspelt(mapping: YamlMapping, name: str) -> bool:
    """Tell whether one of the unknown keys, which are findings already, probably means this key."""
    unknown = [
        key.text for key, _ in mapping.entries[:MAX_FINDINGS] if key.text not in vocabulary.MISSION_KEYS
    ]
    return any(suggestions.for_section(key, vocabulary.MISSION_KEYS)[0].startswith(name) for key in unknown)


def _unread(
    source: YamlNode | None, inputs: tuple[tuple[model.Literal, model.Value], ...]
) -> tuple[str, ...]:
    """Return the names in a mapping whose values could not be read."""
    read = {name.text for name, _ in inputs}
    entries = source.entries if isinstance(source, YamlMapping) else ()
    return tuple(name.text.split(":")[0] for name, _ in entries if name.text not in read)
