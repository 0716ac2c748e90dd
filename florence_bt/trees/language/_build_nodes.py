"""Nodes of a mission to behaviours: the structure. The leaves and values are in ``_build_leaves``."""

from __future__ import annotations

from collections.abc import Iterable

from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy
from py_trees.composites import Parallel, Sequence

from florence_bt.behaviours.branching import If, Switch
from florence_bt.behaviours.composites import Finally, ReactiveSelector, ReactiveSequence, Selector
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.decorators import CallMission, ForceFailure, ForceSuccess, Invert
from florence_bt.behaviours.guards import StartGuard, While
from florence_bt.behaviours.keys import KeyStore
from florence_bt.behaviours.pacing import Delay, Repeat, Retry, Timeout, Wait
from florence_bt.behaviours.parallel import CountingParallel
from florence_bt.behaviours.restarts import Cooldown, Once
from florence_bt.behaviours.watched_skill import WatchedSkill
from florence_bt.behaviours.why import Because, give_reason
from florence_bt.core.declaration import Kind
from florence_bt.core.errors import closest_first
from florence_bt.trees.language import model
from florence_bt.trees.language._build_leaves import LeafBuilder, declared_keys, targets
from florence_bt.trees.language.findings import ERROR
from florence_bt.trees.language.model import Node, PolicyKind
from florence_bt.trees.language.origin import Origin, give_origin
from florence_bt.trees.language.values import template_of
from florence_bt.trees.language.watching import guards_of, passes_on


class Builder(LeafBuilder):
    """Builds the nodes of one call of one mission.

    Every method that builds a node is told whether a skipped node counts as failure there: it does below a
    selector, seen through decorators and branches, up to the end of the mission.
    """

    def root(self, default_name: str | None = None) -> Behaviour:
        """Build the tree of the mission.

        Args:
            default_name: What the root is called unless the author says otherwise.

        Raises:
            ConfigError: The mission has an error that a check would have found.
        """
        for finding in self.mission.findings:
            if finding.severity == ERROR:
                raise finding.as_error()
        if self.mission.tree is None:
            raise self.error(None, "the mission has no tree")
        tree = self.mission.tree
        name = None if tree.guards else tree.name or default_name
        root = self.node(tree, skipped_fails=False, name=name)
        if tree.guards and default_name:
            root.name = default_name
        return root

    def node(self, node: Node, *, skipped_fails: bool, name: str | None = None) -> Behaviour:
        """Build a node with everything below it, its guards and its clean-up."""
        name = one_step(name or node.title)
        if node.cleanup is None:
            behaviour = self._while(node, self._bare(node, name, skipped_fails))
        else:
            behaviour = self._finally(node, node.cleanup, name, skipped_fails)
        behaviour = self._start_guard(node, behaviour, skipped_fails)
        if node.reasons is not None:
            always = node.reasons.always
            by_code = {code: template_of(text) for code, text in node.reasons.by_code.items()}
            texts = template_of(always) if always is not None else None
            give_reason(behaviour, Because(self.context.keys, texts, by_code))
        give_origin(behaviour, Origin(self.mission, node))
        return behaviour

    # ---- guards and clean-ups -------------------------------------------------------------------------

    def _finally(self, node: Node, cleanup: Node, name: str, skipped_fails: bool) -> Behaviour:
        def make_cleanup(context: TreeContext) -> Behaviour:
            own = context.with_keys(self.context.keys)
            return Builder(self.mission, self.facts, own, self.callers).node(cleanup, skipped_fails=False)

        body = self._while(node, self._bare(node, one_step(node.default_title), skipped_fails))
        return Finally(name, self.context, body, make_cleanup)

    def _while(self, node: Node, behaviour: Behaviour) -> Behaviour:
        if node.holds is None:
            return behaviour
        name = one_step(f"while {node.holds.text}")
        return While(name, behaviour, self.context, self.condition(node.holds))

    def _start_guard(self, node: Node, behaviour: Behaviour, skipped_fails: bool) -> Behaviour:
        # A clean-up belongs to what was started: `while` is then asked before both, and watched inside.
        holds = node.holds if node.cleanup is not None else None
        if node.when is None and node.unless is None and holds is None:
            return behaviour
        guards = (("unless", node.unless), ("when", node.when), ("while", holds))
        name = ", ".join(f"{word} {guard.text}" for word, guard in guards if guard is not None)
        unless, when, goes_on = (self.condition(g) if g is not None else None for _, g in guards)
        return StartGuard(
            one_step(name), behaviour, self.context, when, unless, goes_on, skipped_fails=skipped_fails
        )

    # ---- composites -----------------------------------------------------------------------------------

    def _bare(self, node: Node, name: str, skipped_fails: bool) -> Behaviour:
        match node:
            case model.Sequence(children=children, memory=True):
                return Sequence(name, True, self._children(children, False))
            case model.Selector(children=children, memory=True):
                return Selector(name, True, self._children(children, True))
            case model.Sequence():
                parts, watched = self._watching(node, False)
                return ReactiveSequence(name, parts, watched) if watched else Sequence(name, False, parts)
            case model.Selector():
                parts, watched = self._watching(node, True)
                return ReactiveSelector(name, parts, watched) if watched else Selector(name, False, parts)
            case model.Parallel():
                return self._parallel(node, name)
            case model.If():
                return self._if(node, name, skipped_fails)
            case model.Switch():
                return self._switch(node, name, skipped_fails)
            case model.Call():
                return self._call(node, name)
            case model.Wrapper():
                outer = self.watched
                self.watched = outer if passes_on(node) else None
                child = self.node(node.child, skipped_fails=skipped_fails)
                self.watched = outer
                return self._wrapper(node, name, child)
            case _:
                return self.leaf(node, name)

    def _children(self, nodes: Iterable[Node], skipped_fails: bool) -> list[Behaviour]:
        return numbered([self.node(node, skipped_fails=skipped_fails) for node in nodes])

    def _watching(self, node: Node, skipped_fails: bool) -> tuple[list[Behaviour], list[WatchedSkill]]:
        """Build the children of a node without memory, and tell which skills it is the one to watch.

        Where such nodes stand in each other the outermost of which a skill is a condition watches it.
        """
        outer, guards = self.watched, {id(guard) for guard in guards_of(node)}
        watched: list[WatchedSkill] = []
        children = []
        for part in node.parts:
            self.watched = watched if outer is None and id(part) in guards else outer
            children.append(self.node(part, skipped_fails=skipped_fails))
        self.watched = outer
        return numbered(children), watched

    def _parallel(self, node: model.Parallel, name: str) -> Behaviour:
        children = self._children(node.children, False)
        policy = node.policy
        if policy.kind is PolicyKind.ALL:
            return Parallel(name, ParallelPolicy.SuccessOnAll(), children)
        if policy.kind is PolicyKind.SELECTED:
            titles = [child.title for child in node.children]
            for wanted in policy.names:
                if titles.count(wanted.text) != 1:
                    problem = f"the policy needs one branch that is called {wanted.text!r}"
                    raise self.error(wanted.position, problem, closest_first(wanted.text, titles))
            chosen = [children[titles.index(wanted.text)] for wanted in policy.names]
            return Parallel(name, ParallelPolicy.SuccessOnSelected(children=chosen), children)
        needed = policy.successes_needed(len(children))
        if max(needed, policy.fail or 1) > len(children):
            raise self.error(policy.position, f"the policy counts more than {len(children)} branches")
        return CountingParallel(name, children, needed, policy.fail)

    def _if(self, node: model.If, name: str, skipped_fails: bool) -> Behaviour:
        parts, watched = self._watching(node, skipped_fails)
        condition = parts.pop(0) if isinstance(node.condition, Node) else self.condition(node.condition)
        return If(name, self.context, condition, *parts, memory=node.memory, watched=watched)

    def _switch(self, node: model.Switch, name: str, skipped_fails: bool) -> Behaviour:
        branches = self._children(node.parts, skipped_fails)
        wanted = [self.case_values(literal, node.value) for literal, _ in node.cases]
        default = branches.pop() if node.default is not None else None
        labels = [literal.text for literal, _ in node.cases]
        value = self.value(node.value, None)
        cases = list(zip(wanted, branches, strict=True))
        return self.titled(node, Switch(name, self.context, value, cases, default, labels), value, None)

    # ---- decorators -----------------------------------------------------------------------------------

    def _wrapper(self, node: model.Wrapper, name: str, child: Behaviour) -> Behaviour:
        match node:
            case model.Invert():
                return Invert(name, child)
            case model.Succeed() | model.Force(success=True):
                return ForceSuccess(name, child)
            case model.Force():
                return ForceFailure(name, child)
            case model.Once():
                return Once(name, child)
            case model.Retry(attempts=count) | model.Repeat(rounds=count):
                rounds = self.value(count, Kind.INTEGER)
                return self.titled(node, self._counting(node, name, child, rounds), rounds, Kind.INTEGER)
            case model.Timeout(duration=duration) | model.Delay(duration=duration):
                seconds = self.value(duration, Kind.DURATION)
                return self.titled(node, self._timed(node, name, child, seconds), seconds, Kind.DURATION)
            case model.Cooldown(duration=duration):
                seconds = self.value(duration, Kind.DURATION)
                cooldown = Cooldown(name, child, self.context, seconds)
                return self.titled(node, cooldown, seconds, Kind.DURATION)
            case _:
                raise TypeError(f"no behaviour is known for {type(node).__name__}")

    def _counting(self, node: Node, name: str, child: Behaviour, rounds: object) -> Behaviour:
        if not isinstance(node, model.Retry):
            return Repeat(name, child, self.context, rounds)
        key = node.attempt_key.text if node.attempt_key else None
        return Retry(name, child, self.context, rounds, [code.text for code in node.on], key)

    def _timed(self, node: Node, name: str, child: Behaviour, seconds: object) -> Behaviour:
        if isinstance(node, model.Timeout):
            return Timeout(name, child, self.context, seconds)
        return Delay(name, Wait("wait", self.context, seconds), child)

    # ---- calls ----------------------------------------------------------------------------------------

    def _call(self, node: model.Call, name: str) -> Behaviour:
        called = node.mission.text
        if called in self.callers:
            chain = " -> ".join((*self.callers, called))
            raise self.error(node.position, f"the mission {called!r} calls itself: {chain}")
        mission = self.facts.library.get(called)
        keys = KeyStore()
        keys.declare(declared_keys(mission))
        builder = Builder(mission, self.facts, self.context.with_keys(keys), (*self.callers, called))
        builder.watched = self.watched
        inputs = self.inputs(node.inputs, mission.inputs, f"{called} has no input")
        return CallMission(
            name,
            builder.root(),
            self.context,
            keys,
            mission.inputs,
            inputs,
            targets(node.outputs),
            watched=self.watched is not None,
        )


def one_step(name: str) -> str:
    """A name that is one step of a path: the slash between steps stands in no name."""
    return name.replace("/", "\N{DIVISION SLASH}")


def numbered(siblings: list[Behaviour]) -> list[Behaviour]:
    """Number siblings with equal names, so that every path is unique."""
    taken: set[str] = set()
    counts: dict[str, int] = {}
    for behaviour in siblings:
        name = behaviour.name
        count = counts.get(name, 1)
        while behaviour.name in taken:
            count += 1
            behaviour.name = f"{name} ({count})"
        counts[name] = count
        taken.add(behaviour.name)
    return siblings
