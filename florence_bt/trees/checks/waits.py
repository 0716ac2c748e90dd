"""Checks of what is waited for: that something which runs meanwhile writes a key of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.model import Mission, Node

_Beside = tuple[tuple[Counter[str], frozenset[str]], ...]
"""Of each node whose parts run together: how many of them write each key, and the keys of this part."""
_Asking = kinds.WaitUntil | kinds.Until | kinds.Interruptible
"""Nodes that ask again until the answer is yes."""
_WORDS: dict[type[Node], str] = {
    kinds.WaitUntil: "wait_until",
    kinds.Until: "until",
    kinds.Interruptible: "interrupted_by",
}


class WaitChecks:
    """Looks for expressions that are asked again although nothing can change what they say.

    Args:
        mission: The mission.
        analysis: Its surroundings.
        findings: Receives what is wrong.
    """

    def __init__(self, mission: Mission, analysis: Analysis, findings: FindingList) -> None:
        self._mission = mission
        self._analysis = analysis
        self._kinds = analysis.of(mission).kinds
        self._findings = findings
        self._written: dict[Node, frozenset[str]] = {}

    def check(self) -> None:
        """Check all nodes."""
        if self._mission.tree is not None:
            self._check(self._mission.tree, ())

    def _check(self, node: Node, beside: _Beside) -> None:
        """Check a node with everything below it.

        Args:
            node: The node.
            beside: What runs beside it.
        """
        together = _run_together(node)
        writers = Counter(key for each in together for key in self._writes(each))
        for part in node.parts:
            others = (*beside, (writers, self._writes(part))) if together else beside
            self._check(part, others)
            if isinstance(node, _Asking) and part is node.goal:
                self._check_goal(node, others)
        if node.cleanup is not None:
            self._check(node.cleanup, beside)
        if node.holds is not None and self._never_change(node.holds.keys, node, beside):
            message = f"while: nothing that runs meanwhile writes {_named(node.holds.keys)}"
            valid = [f"when: {node.holds.text}, to ask once", "set: in the node, or in one beside it"]
            self._findings.warning(node.holds.position, message, valid)

    def _check_goal(self, node: _Asking, beside: _Beside) -> None:
        goal = node.goal
        asked = tuple(model.walk(goal))
        if any(isinstance(each, kinds.RunSkill | kinds.CallMission) for each in asked):
            return  # whose answer changes by itself
        keys = tuple(dict.fromkeys(reference.key for each in asked for reference in each.references()))
        if self._never_change(keys, goal, beside):
            word = _WORDS[type(node)]
            message = f"{word}: nothing that runs meanwhile writes {_named(keys)}"
            valid = ["parallel: with a node that writes it beside this one", "a skill that asks for it"]
            self._findings.warning(goal.position, message, valid)

    def _never_change(self, keys: tuple[str, ...], node: Node, beside: _Beside) -> bool:
        """Tell whether there are keys, and neither a node nor what runs beside it writes one."""
        own = self._writes(node)
        written = (
            key in own or any(writers[key] > (key in there) for writers, there in beside) for key in keys
        )
        return bool(keys) and not any(written)

    def _writes(self, node: Node) -> frozenset[str]:
        """Return the keys that a node writes with everything below it."""
        if node not in self._written:
            below = (*node.parts, *((node.cleanup,) if node.cleanup is not None else ()))
            own = (key.text for key, _ in self._analysis.writes(node, self._kinds))
            self._written[node] = frozenset(own).union(*map(self._writes, below))
        return self._written[node]


def _run_together(node: Node) -> tuple[Node, ...]:
    """Return the nodes below a node of which one may run, or be asked, while another one does."""
    together = isinstance(node, kinds.Parallel | kinds.Until | kinds.Interruptible) or node.watched
    return node.parts if together else ()


def _named(keys: Iterable[str]) -> str:
    return " or ".join(f"${key}" for key in keys)
