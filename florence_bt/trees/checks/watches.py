"""Checks of what a node without memory watches: that it can be watched, and that ``every`` has an effect."""

from __future__ import annotations

from florence_bt.core.declaration import Kind
from florence_bt.core.plain_yaml import Position
from florence_bt.trees import kinds
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.expressions.checking import has_threshold
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.model import Mission, Node
from florence_bt.trees.language.quantities import NUMERIC_KINDS
from florence_bt.trees.language.watching import asked_first, unwatched

_LIMITS = NUMERIC_KINDS - {Kind.INTEGER}
"""Kinds of inputs with which a condition is told its limit."""


class WatchChecks:
    """Looks for conditions that are not watched, and for what would be done at each question.

    Args:
        mission: The mission.
        analysis: Its surroundings.
        findings: Receives what is wrong.
    """

    def __init__(self, mission: Mission, analysis: Analysis, findings: FindingList) -> None:
        self._mission = mission
        self._known = analysis.of(mission)
        self._skills = analysis.declarations
        self._findings = findings
        self._told: set[Node] = set()
        self._measured = analysis.measured(mission)

    def check(self) -> None:
        """Check all nodes."""
        for node in self._known.all:
            for guard in node.watched:
                self._check_can_be_watched(guard)
                self._check_asked_once(guard)
            self._check_thresholds(node)
            if isinstance(node, kinds.Until | kinds.WaitUntil) and not self._known.of(node.goal).acts:
                self._check_can_be_watched(node.goal)
        self._check_every()

    def _check_can_be_watched(self, node: Node) -> None:
        """Refuse what cannot be watched: a clean-up, which each question would run, and ``once``."""
        facts = self._known.of(node)
        if facts.unwatchable is None or node in self._told:
            return
        mission, cause = facts.unwatchable
        if isinstance(node, kinds.CallMission) and cause is not node:
            self._told.add(node)
            place = cause.cleanup.position if cause.cleanup is not None else cause.position
            where = f" (in {mission.file}:{place.line}:{place.column})"
            self._refuse(node, cause, where)
            return
        if cause is node:
            self._told.add(node)
            self._refuse(node, cause, "")
        for part in node.parts:
            self._check_can_be_watched(part)

    def _refuse(self, node: Node, cause: Node, where: str) -> None:
        title = cause.default_title
        if cause.cleanup is not None:
            place = node.position if where else cause.cleanup.position
            message = f"finally: {title!r} is watched, so the clean-up would run after each question{where}"
            valid = ["finally at the node with memory: false, to clean up once in the end", "memory: true"]
        else:
            place = node.position
            message = f"{title!r} is asked only once, so nobody watches it{where}"
            inside = cause.child.title if isinstance(cause, model.Wrapper) else title
            valid = [f"{inside} without once", f"{inside} in a sequence before this node"]
        self._findings.error(place, message, valid)

    def _check_thresholds(self, node: Node) -> None:
        """Warn of a watched threshold by which one branch takes over from another, and gives it back."""
        match node:
            case kinds.If(memory=False, condition=model.Expression() as asked) if self._wavers(asked):
                self._warn_of_threshold(asked.text, asked.position)
            case kinds.If(memory=False) | kinds.Selector(memory=False):
                below = (each for guard in node.watched for each in model.walk(guard))
                for leaf in below:
                    if self._is_threshold(leaf):
                        self._warn_of_threshold(leaf.title, leaf.position)

    def _warn_of_threshold(self, title: str, place: Position) -> None:
        message = f"{title!r} is a threshold: when the reading wavers, the branches take over from each other"
        failure = "on_failure: with what is done instead, which then stands"
        valid = [f"memory: false, with sequence: [{title}, what it allows], and {failure}"]
        self._findings.warning(place, message, valid)

    def _wavers(self, expression: model.Expression) -> bool:
        return has_threshold(expression, self._measured)

    def _is_threshold(self, node: Node) -> bool:
        """Tell whether a node asks on which side of a value something measured is."""
        if isinstance(node, kinds.Condition):
            return self._wavers(node.condition)
        declaration = self._skills.get(node.skill) if isinstance(node, kinds.RunSkill) else None
        return (
            declaration is not None
            and declaration.instant
            and not declaration.outputs
            and any(port.kind in _LIMITS for port in declaration.inputs.values())
        )

    def _check_asked_once(self, guard: Node) -> None:
        """Warn of what takes time, as it is done once and not asked again."""
        node = asked_first(guard)
        if node.guards or not self._takes_time(node):
            return
        message = f"{node.title!r} takes time and is done only once, although a later node runs"
        valid = ["memory: true", "a condition or a look-up instead of it", f"once: {node.title}"]
        valid += ["every: 10 s, to watch it as a condition"] if isinstance(node, kinds.RunSkill) else []
        self._findings.warning(node.position, message, valid)

    def _takes_time(self, node: Node) -> bool:
        if isinstance(node, kinds.RunSkill):
            declaration = self._skills.get(node.skill)
            return declaration is not None and not node.is_condition(declaration)
        return isinstance(node, kinds.Wait)

    def _check_every(self) -> None:
        """Warn of ``every`` without effect: nobody asks again, or the skill itself says when to ask."""
        tree, skills = self._mission.tree, self._skills
        uses = [node for node in self._known.all if isinstance(node, kinds.RunSkill) and node.skill in skills]
        # A mission of nothing but conditions may be one where it is called.
        only_conditions = all(node.is_condition(skills[node.skill]) for node in uses)
        alone = set(unwatched(tree)) if tree is not None else set()
        for node in uses:
            if node.every is None:
                continue
            if skills[node.skill].reports_changes:
                message = f"'every' has no effect: {node.skill} reports changes and is asked then"
                self._findings.warning(node.position, message, [f"{node.skill} without every"])
            elif node in alone and not only_conditions:
                message = f"'every' has no effect: nobody asks {node.title!r} again here"
                valid = ["memory: false, and a node that runs after it", f"{node.skill} without every"]
                self._findings.warning(node.position, message, valid)
