"""Checks of what can never happen: nodes that are never reached, retries without effect."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import pairwise

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.trees import kinds
from florence_bt.trees.kinds import PolicyKind
from florence_bt.trees.kinds.wait import PAUSE
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.code_groups import ANY, codes_named
from florence_bt.trees.language.expressions.compiling import constant_of
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.model import Expression, Mission, Node
from florence_bt.trees.language.quantities import example_of, format_value, guess_value
from florence_bt.trees.language.values import port_value
from florence_bt.trees.language.vocabulary import FOREVER, IDENTIFIER, MAX_QUICK_ROUNDS

MAX_DIGITS = 12
"""As many digits of a number of rounds are read; more are too many anyway."""
RENAMED_CODES = {
    "no_picture": "no_image",
    "not_so": "condition_false",
    "inverted": "unexpected_success",
}
"""Failure codes as missions may still name them, and what they are called now."""


_OTHERS = ("else", "default", "other", "others", "otherwise", "all", "rest", "every", "error", "failure")
"""People's words for ``any``."""


class ReachChecks:
    """Looks for what cannot be intended, because it never has an effect.

    Args:
        mission: The mission.
        analysis: Its surroundings.
        findings: Receives what is wrong.
    """

    def __init__(self, mission: Mission, analysis: Analysis, findings: FindingList) -> None:
        self._mission = mission
        self._declarations = analysis.declarations
        self._known = analysis.of(mission)
        self._findings = findings
        self._groups = analysis.groups

    def check(self) -> None:
        """Check all nodes."""
        for node in self._known.all:
            self._check_guards(node)
            self._check_words(node)
            self._check_cleanup(node)
            match node:
                case kinds.Sequence(children=children):
                    self._check_sequence(children)
                case kinds.Selector(children=children):
                    self._check_selector(children)
                case kinds.Parallel():
                    self._check_parallel(node)
                case kinds.If():
                    self._check_if(node)
                case kinds.Switch():
                    self._check_switch(node)
                case kinds.Retry():
                    self._check_retry(node)
                case kinds.Repeat():
                    self._check_repeat(node)
                case kinds.Timeout():
                    self._check_timeout(node)
                case kinds.ForEach():
                    self._check_for_each(node)
                case kinds.OnFailure():
                    self._check_on_failure(node)
                case kinds.Until():
                    self._check_goal(node, "until")
                case kinds.Interruptible():
                    self._check_goal(node, "interrupted_by")
                case kinds.WaitUntil():
                    self._check_wait_until(node)
                case kinds.Condition(condition=condition):
                    self._check_constant(condition, "condition")

    # ---- codes ----------------------------------------------------------------------------------------

    def _can_be(self, word: str, codes: frozenset[str]) -> bool:
        """Tell whether a code, or one of a group, is among some codes."""
        return not codes_named(word, self._groups).isdisjoint(codes)

    def _check_code(
        self, code: model.Literal, what: str, codes: frozenset[str], *others: str, sure: bool = True
    ) -> None:
        """Check that a failure that is named is possible: a code, or one of a group's own.

        Args:
            code: The code or group.
            what: What would fail.
            codes: The codes that it can fail with.
            others: What else would have worked.
            sure: Whether naming it in vain is an error.
        """
        valid = (*self._most_likely(code.text, codes), *others)
        if not self._can_be(code.text, codes):
            report = self._findings.in_vain if sure else self._findings.warning
            report(code.position, f"{what} cannot fail with {self._in_words(code.text)}", valid)
        elif everyones := self._everyones(code.text, codes):
            names = " and ".join(everyones)
            message = f"{what} has of the group {code.text!r} only {names}, as every skill has"
            self._findings.warning(code.position, message, (*everyones, *others))

    def _everyones(self, word: str, codes: frozenset[str]) -> list[str]:
        """Return what can be of a group, if that is only what any skill may fail with; else nothing."""
        group = self._groups[word].codes if word in self._groups else frozenset()
        possible = group & codes
        return (
            sorted(possible) if possible <= COMMON_CODES.keys() and not group <= COMMON_CODES.keys() else []
        )

    def _in_words(self, word: str) -> str:
        return f"any code of the group {word!r}" if word in self._groups else repr(word)

    def _most_likely(self, code: str, codes: Collection[str]) -> Sequence[str]:
        """Return the possible codes and groups, the one first that a wrong code most likely stands for."""
        groups = [name for name, group in self._groups.items() if not group.codes.isdisjoint(codes)]
        return closest_first(RENAMED_CODES.get(code, code), [*codes, *groups])

    # ---- how a node can end ---------------------------------------------------------------------------

    def _can_succeed(self, node: Node) -> bool:
        return self._known.of(node).outcomes.can_succeed

    def _can_fail(self, node: Node) -> bool:
        return self._known.of(node).outcomes.can_fail

    # ---- composites -----------------------------------------------------------------------------------

    def _check_sequence(self, children: tuple[Node, ...]) -> None:
        for before, after in pairwise(children):
            if not self._can_succeed(before):
                message = f"{after.title!r} is never reached: {before.title!r} before it never succeeds"
                self._findings.in_vain(
                    after.position, message, [f"{before.title} as the last node of a sequence"]
                )
                return

    def _check_selector(self, children: tuple[Node, ...]) -> None:
        for before, after in pairwise(children):
            if not self._can_fail(before):
                message = f"{after.title!r} is never tried: {before.title!r} before it never fails"
                self._findings.in_vain(
                    after.position, message, [f"{before.title} as the last node of a selector"]
                )
                return

        for child in children[:-1]:
            if not self._can_succeed(child) and _does_nothing(child):
                message = (
                    f"{child.title!r} has no effect in the middle of a selector: "
                    "it never succeeds, and the next node is tried all the same"
                )
                valid = [f"{child.title} as the last node of the selector", "leaving it out"]
                self._findings.in_vain(child.position, message, valid)

    def _check_parallel(self, node: kinds.Parallel) -> None:
        hopeless = [child for child in node.children if not self._can_succeed(child)]
        if hopeless and not self._can_succeed(node) and node.policy.kind is not PolicyKind.ANY:
            message = f"the parallel never succeeds, because {hopeless[0].title!r} never does"
            self._findings.warning(hopeless[0].position, message)

    def _check_if(self, node: kinds.If) -> None:
        if isinstance(node.condition, Expression):
            fixed = constant_of(node.condition)
            shown, position = node.condition.text, node.condition.position
        else:
            sure = not self._can_fail(node.condition)
            fixed = True if sure else None if self._can_succeed(node.condition) else False
            shown, position = node.condition.title, node.condition.position
        if fixed is None:
            return
        never = node.otherwise if fixed else node.then
        always = "always holds" if fixed else "never holds"
        if never is None:
            self._findings.warning(position, f"if: {shown!r} {always}", ["an expression with a $key"])
        else:
            message = f"{never.title!r} is never reached: {shown!r} {always}"
            self._findings.in_vain(never.position, message, ["an expression with a $key"])

    def _check_switch(self, node: kinds.Switch) -> None:
        """Check a switch: a value that is always the same leads to the same branch every time."""
        if not isinstance(node.value, model.Literal):
            return
        text = node.value.text
        same = [guess_value(case.text)[1] == guess_value(text)[1] for case, _ in node.cases]
        never = next((part for fits, (_, part) in zip(same, node.cases, strict=True) if not fits), None)
        never = never or (node.default if any(same) else None)
        if never is not None:
            message = f"{never.title!r} is never reached: the value is always {text!r}"
            valid = [f"${text}"] if IDENTIFIER.fullmatch(text) else []
            self._findings.in_vain(never.position, message, [*valid, "an expression with a $key"])

    # ---- decorators -----------------------------------------------------------------------------------

    def _check_retry(self, node: kinds.Retry) -> None:
        below = self._known.of(node.child)
        self._check_rounds(node, surely=not below.outcomes.can_succeed)
        if not below.known:
            return
        title = node.child.title
        if not below.outcomes.can_fail:
            message = f"the retry has no effect: {title!r} never fails"
            self._findings.in_vain(node.position, message, [f"{title} without retry"])
            return
        if not self._known.of(node).outcomes.ends:
            message = f"the retry never ends: {title!r} never succeeds"
            self._findings.in_vain(node.position, message, ["a number of attempts", f"repeat: {FOREVER}"])
        for code in node.on:
            self._check_code(code, "what is retried", below.outcomes.codes)
        if node.between is not None and not self._can_succeed(node.between):
            message = f"there is never a second attempt: {node.between.title!r} between two never succeeds"
            self._findings.in_vain(node.between.position, message, [f"finally: {node.between.title}"])
        if isinstance(node.child, kinds.Once):
            message = f"the retry has no effect: {title!r} keeps its first result"
            self._findings.in_vain(node.position, message, ["once: {retry: ..., do: ...}"])

    def _check_repeat(self, node: kinds.Repeat) -> None:
        title = node.child.title
        self._check_rounds(node, surely=not self._can_fail(node.child))
        if not self._can_succeed(node.child):
            self._findings.warning(node.position, f"there is never a second round: {title!r} never succeeds")
        elif isinstance(node.child, kinds.Once):
            self._findings.warning(
                node.position, f"the repeat has no effect: {title!r} keeps its first result"
            )

    def _check_timeout(self, node: kinds.Timeout) -> None:
        """Check the duration: a time-out of no time stops everything."""
        try:
            duration = port_value(node.duration, PAUSE)
        except ConfigError:
            return  # said elsewhere
        if duration != 0.0:
            return
        title = node.child.title
        message = f"timeout: {title!r} is stopped at once: it has {format_value(0.0, Kind.DURATION)}"
        valid = [example_of(Kind.DURATION), f"{title} without timeout"]
        self._findings.in_vain(node.duration.position, message, valid)

    def _check_for_each(self, node: kinds.ForEach) -> None:
        below = self._known.of(node.child)
        if node.code is not None and not node.first_success:
            message = "code: a for_each has a failure of its own only with `first_success: true`"
            self._findings.error(node.code.position, message, ["first_success: true"])
        if not below.known:
            return
        if not below.outcomes.ends:
            self._findings.warning(
                node.position, f"there is never a second item: {node.child.title!r} never ends"
            )
        for code in node.goes_on_over:
            self._check_code(code, f"go_on_over: {node.child.title!r}", below.outcomes.codes)

    def _check_on_failure(self, node: kinds.OnFailure) -> None:
        below, title = self._known.of(node.child), node.child.title
        if not below.known:
            return
        if not below.outcomes.can_fail:
            message = f"on_failure has no effect: {title!r} never fails"
            self._findings.in_vain(node.handlers[0][0].position, message, [f"{title} without on_failure"])
            return
        for code, _ in node.handlers:
            if code.text in self._declarations:
                message = f"on_failure: {code.text!r} is a skill, and the code is missing"
                self._findings.error(code.position, message, [f"any: {{{code.text}: ...}}"])
            elif code.text in _OTHERS and not self._can_be(code.text, below.outcomes.codes):
                message = f"on_failure: {title!r} cannot fail with {code.text!r}"
                self._findings.in_vain(code.position, message, [ANY])
            elif code.text != ANY:
                self._check_code(code, f"on_failure: {title!r}", below.outcomes.codes, ANY)

    def _check_goal(self, node: kinds.Until | kinds.Interruptible, word: str) -> None:
        goal = self._known.of(node.goal)
        if not goal.known:
            return
        if not goal.outcomes.can_succeed:
            message = f"{word}: {node.goal.title!r} never succeeds"
            self._findings.in_vain(node.goal.position, message, ["a node that succeeds at some point"])
        elif not goal.outcomes.can_fail and not goal.lasting:
            message = f"{node.child.title!r} is never reached: {node.goal.title!r} succeeds at once"
            self._findings.in_vain(node.goal.position, message, ["an expression with a $key", "wait: 10 s"])

    def _check_wait_until(self, node: kinds.WaitUntil) -> None:
        goal, title = self._known.of(node.goal), node.goal.title
        if not goal.known:
            return
        if goal.acts:
            message = f"wait_until: {title!r} does something, and only a condition can be waited for"
            valid = [f"{title}, which is waited for anyway", f"until: {title}, at what is done meanwhile"]
            self._findings.error(node.goal.position, message, valid)
        elif not goal.outcomes.can_succeed:
            self._findings.in_vain(node.goal.position, f"wait_until: {title!r} never succeeds")
        elif not goal.outcomes.can_fail:
            message = f"wait_until: {title!r} succeeds at once"
            self._findings.warning(node.goal.position, message, ["an expression with a $key"])

    def _check_rounds(self, node: kinds.Retry | kinds.Repeat, *, surely: bool) -> None:
        """Check that a loop of nodes that take no time is ended at some point.

        Args:
            node: The loop.
            surely: Whether nothing ends it before its last round.
        """
        below = self._known.of(node.child)
        rounds = self._quick_rounds(node)
        lasting = any(self._known.of(part).lasting for part in node.parts)
        if not below.known or lasting or rounds <= MAX_QUICK_ROUNDS:
            return
        number = node.attempts if isinstance(node, kinds.Retry) else node.rounds
        endless = number is None
        message = (
            f"{node.default_title!r}: nothing below it takes time, and "
            f"{'rounds without end' if endless else f'{rounds} rounds'} are more than the "
            f"{MAX_QUICK_ROUNDS} that such a loop may have (spinning)"
        )
        valid = [f"at most {MAX_QUICK_ROUNDS} rounds", "wait: 1 s, in each round"]
        report = self._findings.error if surely else self._findings.warning
        report(node.position, message, valid)

    def _quick_rounds(self, node: Node) -> int:
        """Return how often a node has the tree ticked at most, as far as written; at least once."""
        below = max((self._quick_rounds(part) for part in node.parts), default=1)
        match node:
            case (
                kinds.Retry(attempts=model.Literal(text=text)) | kinds.Repeat(rounds=model.Literal(text=text))
            ) if text.isdecimal():
                return int(text[:MAX_DIGITS]) * below
            case kinds.Repeat(rounds=None) | kinds.Retry(attempts=None):
                return 10**MAX_DIGITS
        return below

    # ---- what every node may have ---------------------------------------------------------------------

    def _check_guards(self, node: Node) -> None:
        for expression, what in ((node.when, "when"), (node.holds, "while")):
            if expression is not None:
                self._check_constant(expression, what)

    def _check_constant(self, expression: Expression, what: str) -> None:
        fixed = constant_of(expression)
        if fixed is not None:
            always = "always holds" if fixed else "never holds"
            message = f"{what}: {expression.text!r} {always}"
            self._findings.warning(expression.position, message, ["an expression with a $key"])

    def _check_words(self, node: Node) -> None:
        if node.reasons is None or not self._known.of(node).known:
            return
        codes = self._known.of(node).outcomes.codes
        for code in node.reasons.by_code:
            place = node.reasons.places.get(code, node.reasons.position)
            self._check_code(model.Literal(code, True, place), f"because: {node.title!r}", codes, sure=False)

    def _check_cleanup(self, node: Node) -> None:
        cleanup = node.cleanup
        if cleanup is not None and not self._known.of(cleanup).outcomes.ends:
            message = f"finally: {cleanup.title!r} never ends, and the mission is over only when it has"
            self._findings.in_vain(cleanup.position, message, [f"timeout: 1 min, with do: {cleanup.title}"])
        elif cleanup is not None and not self._can_succeed(cleanup):
            message = f"finally: {cleanup.title!r} never succeeds, and how a clean-up ends changes nothing"
            self._findings.warning(cleanup.position, message, ["a node that puts something in order"])


def _does_nothing(node: Node) -> bool:
    """Tell whether a node is a ``fail``, or holds nothing else: it neither acts nor asks nor takes time."""
    holds = isinstance(node, kinds.Fail | kinds.Sequence | kinds.Selector | kinds.Parallel | kinds.Once)
    return holds and node.cleanup is None and all(map(_does_nothing, node.parts))
