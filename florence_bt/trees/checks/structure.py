"""Checks of the shape of a tree: recursion, size with all calls, branches that want the same resource."""

from __future__ import annotations

from collections.abc import Iterable

from florence_bt.core.plain_yaml import Position
from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import Analysis, chain_back, too_large
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.model import Mission, Node

_ASK_ONCE = "memory: true, to ask only once"
MAX_CHAIN = 100
"""Through how many missions a mission may call itself for the whole chain to be shown."""


def check_structure(mission: Mission, analysis: Analysis, findings: FindingList) -> None:
    """Report what is wrong with the shape of a mission's tree.

    Args:
        mission: The mission.
        analysis: Its surroundings.
        findings: Receives what is wrong.
    """
    _check_recursion(mission, analysis, findings)
    _check_size(mission, analysis, findings)
    for node in analysis.of(mission).all:
        match node:
            case kinds.Parallel(children=children):
                _check_resources(children, mission, analysis, findings, "sequence: one after the other")
            case kinds.Until() | kinds.Interruptible():
                together = (node.child, node.goal)
                _check_resources(together, mission, analysis, findings, "sequence: one after the other")
            case kinds.If(memory=False, condition=Node() as asked):
                # While a question that takes time is asked again, the branch goes on.
                for branch in node.parts[1:]:
                    _check_resources((asked, branch), mission, analysis, findings, _ASK_ONCE)
            case kinds.Sequence(memory=False) | kinds.Selector(memory=False):
                _check_asked_beside(node, mission, analysis, findings)


def _check_asked_beside(node: Node, mission: Mission, analysis: Analysis, findings: FindingList) -> None:
    """Report skills that a node without memory asks while nodes behind them want the same resource."""
    known = analysis.of(mission)
    for place, guard in enumerate(node.watched, 1):
        asked = [each for each in model.walk(guard) if isinstance(each, kinds.RunSkill | kinds.CallMission)]
        for each in asked:
            for later in node.parts[place:]:
                for resource in sorted(known.of(each).asked_resources & known.of(later).resources):
                    one, other = _named(each, resource, analysis), _named(later, resource, analysis)
                    message = f"{one} and {other} both need the {resource} at the same time"
                    findings.error(later.position, message, [_ASK_ONCE])


def _check_recursion(mission: Mission, analysis: Analysis, findings: FindingList) -> None:
    cycle = analysis.cycle_of(mission)
    if not cycle:
        return
    for call in analysis.of(mission).all:
        if isinstance(call, kinds.CallMission) and call.mission.text in cycle and not findings.full:
            rest = [call.mission.text, "...", mission.name]
            if len(cycle) <= MAX_CHAIN:
                rest = chain_back(call.mission.text, mission.name, cycle, analysis.callees_of)
            chain = " -> ".join([mission.name, *rest])
            valid = ["repeat: forever"] if call.mission.text == mission.name else []
            findings.error(call.mission.position, f"the mission calls itself: {chain}", valid)


def _check_size(mission: Mission, analysis: Analysis, findings: FindingList) -> None:
    for error in too_large(mission, analysis):
        findings.error(Position(error.line or 1, error.column or 1), error.problem, error.valid)


def _check_resources(
    together: Iterable[Node], mission: Mission, analysis: Analysis, findings: FindingList, instead: str
) -> None:
    """Report which of some nodes that can run at the same time want the same resource."""
    known = analysis.of(mission)
    users: dict[str, Node] = {}
    for child in together:
        for resource in sorted(known.of(child).resources):
            if resource in users:
                one, other = _named(users[resource], resource, analysis), _named(child, resource, analysis)
                message = f"{one} and {other} both need the {resource} at the same time"
                findings.error(child.position, message, [instead])
            users.setdefault(resource, child)


def _named(branch: Node, resource: str, analysis: Analysis) -> str:
    """Name a branch, with the skill or call in it that uses a resource when that is not the branch itself."""
    for node in model.walk(branch):
        uses = (
            isinstance(node, kinds.RunSkill)
            and node.skill in analysis.declarations
            and resource in analysis.declarations[node.skill].resources
        )
        called = analysis.called(node.mission.text) if isinstance(node, kinds.CallMission) else None
        if uses or (called is not None and called.root is not None and resource in called.root.resources):
            inside = f" (in {node.title!r})" if node is not branch else ""
            return f"{branch.title!r}{inside}"
    return repr(branch.title)
