"""Checks of names: skills, missions, inputs, outputs, branches; and of every value that is given to them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import close_matches, closest_first, spelling
from florence_bt.trees import kinds
from florence_bt.trees.checks.values import ValueChecks, literal_kind
from florence_bt.trees.language import model
from florence_bt.trees.language._suggestions import OTHER_KINDS, OTHER_SKILLS
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.model import Literal, Mission, Node, PolicyKind
from florence_bt.trees.language.outcomes import COUNT, PAUSE
from florence_bt.trees.language.quantities import NUMERIC_KINDS, example_of, with_article
from florence_bt.trees.language.values import fits
from florence_bt.trees.language.vocabulary import NODE_KINDS

_SEVERAL = re.compile(r"(\w+)(?:, ?| or | ?\| ?)(\w+)")
"""A case that is meant to stand for several values: ``yes, ja``."""
HOW_TO_DECLARE = (
    "NAME.skills.yaml beside the mission, if it is your own (docs/reference/missions.md#skills-of-your-own)"
)
"""Where a skill is declared that this installation does not have."""
SKILLS_THERE_ARE = ("a skill of docs/reference/skills.md",)
"""Where the skills of an installation stand."""


class NameChecks:
    """Checks every node of a mission by itself.

    Args:
        mission: The mission.
        analysis: Its surroundings.
        findings: Receives what is wrong.
    """

    def __init__(self, mission: Mission, analysis: Analysis, findings: FindingList) -> None:
        self._mission = mission
        self._analysis = analysis
        self._findings = findings
        self._kinds = analysis.of(mission).kinds
        self._values = ValueChecks(mission, analysis, findings)

    def check(self) -> None:
        """Check all nodes."""
        nodes = self._analysis.of(self._mission).all
        # A skill without its code in `on_failure`, reported there: below it stand inputs and no node.
        inputs = {
            handler
            for node in nodes
            if isinstance(node, model.OnFailure)
            for code, handler in node.handlers
            if code.text in self._analysis.declarations
        }
        for node in nodes:
            if self._findings.full:
                return
            if node in inputs:
                continue
            self._check_node(node)
            self._check_conditions(node)
            self._check_writes(node)

    def _check_node(self, node: Node) -> None:
        check = self._values.check
        match node:
            case model.RunSkill():
                self._check_run_skill(node)
            case model.CallMission():
                self._check_call_mission(node)
            case kinds.Retry(attempts=count) if count is not None:
                check(count, COUNT, "retry")
            case model.Repeat(rounds=count) if count is not None:
                check(count, COUNT, "repeat")
            case model.Timeout(duration=duration) | model.Wait(duration=duration):
                check(duration, PAUSE, type(node).__name__.lower())
            case model.Set(values=values):
                for key, value in values:
                    check(value, self._mission.keys.get(key.text), key.text)
            case model.Append(values=values):
                for key, value in values:
                    self._check_append(key, value)
            case kinds.ForEach(items=items):
                self._check_list(items)
            case model.Fail(reason=reason):
                self._values.text(reason, "fail")
            case model.Switch():
                self._check_switch(node)
            case model.Parallel():
                self._check_policy(node)

    def _check_append(self, key: Literal, value: model.Value) -> None:
        kind = self._kinds.get(key.text)
        if kind is not None and kind.item is not None:
            self._values.check(value, Port(kind.item, ""), key.text)
        elif kind is Kind.TEXT:
            self._values.text(value, key.text)
        else:
            what = with_article(kind) if kind is not None else "of no known kind"
            message = f"append: ${key.text} is {what}, and only a text or a list can be added to"
            valid = [f'keys: {{{key.text}: {{type: text, default: ""}}}}', f"set: {{{key.text}: ...}}"]
            if kind in NUMERIC_KINDS:
                valid.insert(0, f"add: {{{key.text}: {model.show(value)}}}")
            self._findings.error(key.position, message, valid)

    def _check_list(self, items: model.Value) -> None:
        kind = self._values.kind(items)
        if isinstance(items, model.ListItems) or kind is None or kind.item is not None:
            self._values.check(items, None, "for_each")
            return
        valid = [f"[{model.show(items)}]", "an input or a key with type: list of text"]
        if isinstance(items, Literal) and items.text in self._kinds:
            valid.insert(0, f"${items.text}")
        message = f"for_each needs a list, but {model.show(items)!r} is {with_article(kind)}"
        self._findings.error(items.position, message, valid)

    def _check_conditions(self, node: Node) -> None:
        named = (("when", node.when), ("while", node.holds))
        for what, expression in named:
            if expression is not None:
                self._values.condition(expression, what)
        if isinstance(node, model.If) and isinstance(node.condition, model.Expression):
            self._values.condition(node.condition, "if")
        if isinstance(node, kinds.Condition):
            self._values.condition(node.condition, "condition")

    # ---- skills and missions --------------------------------------------------------------------------

    def _check_run_skill(self, node: model.RunSkill) -> None:
        declaration = self._analysis.declarations.get(node.skill)
        if declaration is None:
            self._unknown_kind(node)
            return
        if declaration.deprecated:
            message = f"{node.skill} is deprecated: use {declaration.deprecated}"
            self._findings.warning(node.position, message)
        if not node.mapping_given:
            first = next((name for name, port in declaration.inputs.items() if port.required), "input")
            about = f"{node.skill}: {{{first}: {node.written or 'value'}}}" if declaration.inputs else ""
            if node.written and declaration.inputs and declaration.inputs[first].kind is Kind.POSE:
                about = f"run: goto_room, with: {{room: {node.written}}}"
            message = f"the inputs of {node.skill} must be a mapping"
            self._findings.error(node.position, message, [about or f"{node.skill}:"])
            return
        self._check_inputs(node.skill, node, declaration.inputs)
        self._check_outputs(node.skill, declaration.outputs, node.outputs)

    def _unknown_kind(self, node: model.RunSkill) -> None:
        """Report a name that is no skill and no kind of node; missions are called otherwise."""
        missions = {name: f"run: {name}" for name in self._analysis.library.names()}
        names = dict.fromkeys((*NODE_KINDS, *self._analysis.declarations, *missions))
        close = closest_first(node.skill, names)
        if len(close) < len(names):
            own = (*NODE_KINDS, *self._analysis.declarations)
            valid = [name if name in own else missions[name] for name in close]
        else:
            valid = [f"skills: {{{node.skill}: {{summary: ...}}}} in {HOW_TO_DECLARE}", *SKILLS_THERE_ARE]
        known = {**OTHER_KINDS, **OTHER_SKILLS}
        others = [kind for name, kind in known.items() if spelling(name) == spelling(node.skill)]
        message = f"there is no skill and no kind of node {node.skill!r}"
        self._findings.error(node.position, message, dict.fromkeys(others) or valid)

    def _check_call_mission(self, node: model.CallMission) -> None:
        name = node.mission.text
        mission = self._analysis.library.find(name)
        unreadable = self._analysis.library.unreadable().get(name) if mission is None else None
        if unreadable is not None:
            message = f"the mission {name!r} cannot be read: {unreadable}"
            self._findings.error(node.mission.position, message)
            return
        if mission is None:
            message = f"there is no mission {name!r}"
            if name in self._analysis.declarations or name in NODE_KINDS:
                what = "skill" if name in self._analysis.declarations else "kind of node"
                given = ", ".join(f"{key.text}: {model.show(value)}" for key, value in node.inputs)
                valid = [f"{name}: {{{given}}}" if what == "skill" else f"{name}: without run"]
                self._findings.error(node.mission.position, f"{message}, but a {what}", valid)
                return
            self._findings.unknown(node.mission.position, message, name, self._analysis.library.names())
            return
        self._check_inputs(name, node, mission.inputs)
        self._check_outputs(name, mission.outputs, node.outputs)

    def _check_inputs(
        self, owner: str, node: model.RunSkill | model.CallMission, ports: Mapping[str, Port]
    ) -> None:
        names = set(node.unread)
        for name, value in node.inputs:
            names.add(name.text)
            if name.text in ports:
                self._values.check(value, ports[name.text], name.text)
            else:
                # A misspelt input is not reported as missing too.
                names.update(close_matches(name.text, ports)[:1])
                self._findings.unknown(name.position, f"{owner} has no input {name.text!r}", name.text, ports)
        for missing in (name for name, port in ports.items() if port.required and name not in names):
            about = f" ({ports[missing].description})" if ports[missing].description else ""
            valid = [_with_input(node, f"{missing}: {example_of(ports[missing].kind)}")]
            self._findings.error(node.position, f"{owner} needs the input {missing!r}{about}", valid)

    def _check_outputs(
        self, owner: str, ports: Mapping[str, Port], given: Iterable[tuple[Literal, Literal]]
    ) -> None:
        for output, key in given:
            if output.text in ports:
                continue
            message = f"{owner} has no output {output.text!r}"
            if key.text in ports:
                self._findings.error(output.position, message, [f"{key.text}: {output.text}"])
            else:
                self._findings.unknown(output.position, message, output.text, ports)

    def _check_writes(self, node: Node) -> None:
        for key, kind in self._analysis.writes(node, self._kinds):
            known = self._kinds.get(key.text)
            if key.text in self._mission.inputs:
                message = f"the key {key.text!r} is an input of the mission and cannot be written"
                self._findings.error(key.position, message, [f"another key, such as new_{key.text}"])
            elif known is None or fits(kind, known) or kind is None:
                continue
            elif key.text not in self._mission.keys:
                message = (
                    f"the key {key.text!r} is {with_article(known)} elsewhere and {with_article(kind)} here"
                )
                self._findings.error(key.position, message)
            elif not isinstance(node, model.Set):
                there, here = with_article(known), with_article(kind)
                message = f"the key {key.text!r} is declared as {there}, but {here} is written here"
                self._findings.error(key.position, message)

    # ---- composites -----------------------------------------------------------------------------------

    def _check_switch(self, node: model.Switch) -> None:
        self._values.check(node.value, None, "switch")
        kind = self._values.kind(node.value)
        first: dict[tuple[bool, object], int] = {}
        for case, _ in node.cases:
            if kind is not None:
                self._values.check(case, Port(kind, ""), "case")
            literal = literal_kind(case, kind)
            value = (isinstance(literal, bool), literal)  # for Python 1 is True, and 0 is False
            if value in first:
                message = f"the case {case.text!r} is duplicated (first in line {first[value]})"
                self._findings.error(case.position, message, ["another value", "one case"])
            first.setdefault(value, case.position.line)
            if case.text == "default" and not case.quoted and node.default is None:
                message = "'default' is a case like another here"
                self._findings.warning(case.position, message, ["default: indented like cases", '"default"'])
            if kind is Kind.TEXT and not case.quoted and (several := _SEVERAL.fullmatch(case.text)):
                message = f"the case {case.text!r} is one text, and not several"
                valid = [f"{several[1]}: and {several[2]}: each with its node", f'"{case.text}" for the text']
                self._findings.warning(case.position, message, valid)
        if node.default is not None and {(True, True), (True, False)} <= first.keys():
            message = "the default is never reached: there are cases for true and for false"
            self._findings.in_vain(node.default.position, message, ["leaving out the default"])

    def _check_policy(self, node: model.Parallel) -> None:
        policy, count = node.policy, len(node.children)
        titles = Counter(child.title for child in node.children)
        position = policy.position or node.position
        for name in policy.names:
            if name.text not in titles:
                message = f"the policy names {name.text!r}, but no branch has this name"
                self._findings.unknown(name.position, message, name.text, titles)
            elif titles[name.text] > 1:
                message = f"the policy names {name.text!r}, but {titles[name.text]} branches have this name"
                self._findings.error(name.position, message, ["a `name` of its own for each branch"])
        if policy.kind is PolicyKind.COUNTED:
            for what, number in (("succeed", policy.succeed), ("fail", policy.fail)):
                if number is not None and not 1 <= number <= count:
                    message = f"{what}: {number} branches are asked for, but there are {count}"
                    self._findings.error(position, message, [f"{what}: 1 to {count}"])


def _with_input(node: model.RunSkill | model.CallMission, entry: str) -> str:
    """Return an input as it would have worked; with the table round it when there is none."""
    if node.inputs or node.unread:
        return entry
    return f"with: {{{entry}}}" if isinstance(node, model.CallMission) else f"{node.skill}: {{{entry}}}"
