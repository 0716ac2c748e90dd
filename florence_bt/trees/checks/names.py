"""Checks of names: skills, missions, inputs, outputs, branches; and of every value that is given to them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import close_matches, closest_first, spelling
from florence_bt.trees import kinds
from florence_bt.trees.checks.values import ValueChecks
from florence_bt.trees.kinds.words import NODE_KINDS
from florence_bt.trees.language import model
from florence_bt.trees.language._suggestions import OTHER_KINDS, OTHER_SKILLS
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.model import Literal, Mission, Node
from florence_bt.trees.language.quantities import example_of, with_article
from florence_bt.trees.language.values import fits

HOW_TO_DECLARE = (
    "NAME.skills.yaml beside the mission, if it is your own (docs/reference/missions.md#skills-of-your-own)"
)
"""Places for the declaration of a skill that this installation does not have."""
SKILLS_THERE_ARE = ("a skill of docs/reference/skills.md",)
"""Places of the skills of an installation."""


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
            if isinstance(node, kinds.OnFailure)
            for code, handler in node.handlers
            if code.text in self._analysis.declarations
        }
        for node in nodes:
            if self._findings.full:
                return
            if node in inputs:
                continue
            self._check_node(node)
            self._check_guards(node)
            self._check_writes(node)

    def _check_node(self, node: Node) -> None:
        match node:
            case kinds.RunSkill():
                self._check_run_skill(node)
            case kinds.CallMission():
                self._check_call_mission(node)
            case _:
                node.check(self._values)

    def _check_guards(self, node: Node) -> None:
        for what, expression in (("when", node.when), ("while", node.holds)):
            if expression is not None:
                self._values.condition(expression, what)

    # ---- skills and missions --------------------------------------------------------------------------

    def _check_run_skill(self, node: kinds.RunSkill) -> None:
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

    def _unknown_kind(self, node: kinds.RunSkill) -> None:
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

    def _check_call_mission(self, node: kinds.CallMission) -> None:
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
        self, owner: str, node: kinds.RunSkill | kinds.CallMission, ports: Mapping[str, Port]
    ) -> None:
        names = set(node.unread)
        for name, value in node.inputs:
            names.add(name.text)
            if name.text in ports:
                self._values.value(value, ports[name.text], name.text)
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
            elif not isinstance(node, kinds.Set):
                there, here = with_article(known), with_article(kind)
                message = f"the key {key.text!r} is declared as {there}, but {here} is written here"
                self._findings.error(key.position, message)


def _with_input(node: kinds.RunSkill | kinds.CallMission, entry: str) -> str:
    """Return an input as it would have worked; with the table round it when there is none."""
    if node.inputs or node.unread:
        return entry
    return f"with: {{{entry}}}" if isinstance(node, kinds.CallMission) else f"{node.skill}: {{{entry}}}"
