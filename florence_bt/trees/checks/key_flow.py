"""The flow of keys through the tree of a mission: which keys have a value when a node begins and ends.

An abstract run of the tree: the state at a point is the set of keys that some way to it has written and the
set that every way has written. A node takes one state and gives one for its success and one for its failure;
where the end cannot come there is no state. Sets of keys are the bits of integers, so that a mission with
thousands of keys is followed as fast as a small one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

from florence_bt.trees import kinds
from florence_bt.trees.kinds import PolicyKind
from florence_bt.trees.language import model
from florence_bt.trees.language.expressions.compiling import constant_of
from florence_bt.trees.language.model import Expression, Node, Reference
from florence_bt.trees.language.outcomes import NodeOutcomes


@dataclass(frozen=True, slots=True)
class Written:
    """The keys that have a value at some point, as bits.

    Attributes:
        maybe: Those that some way to this point writes.
        surely: Those that every way to this point writes.
    """

    maybe: int
    surely: int

    def plus(self, keys: int) -> Written:
        """Return the state after these keys were written too."""
        return Written(self.maybe | keys, self.surely | keys)


State = Written | None
"""None: this point is never reached."""


@dataclass(frozen=True, slots=True)
class Flow:
    """The effect of a node on the keys.

    Attributes:
        success: The state after its success.
        failure: The state after its failure.
        touched: Every key that may have a value at any moment while it runs.
    """

    success: State
    failure: State
    touched: int


class ReadObserver(Protocol):
    """An observer that is called for every read while the flow is followed."""

    def read(self, reference: Reference, before: Written) -> Written:
        """Take note that a node reads a key that it needs, and return the state with which to go on."""


class KeyFlow:
    """Follows the keys through one tree.

    Args:
        bits: Key -> its bit.
        outcomes: Gives the outcomes that a node can have.
        writes: Gives the keys that a node itself writes.
    """

    def __init__(
        self,
        bits: Mapping[str, int],
        outcomes: Callable[[Node], NodeOutcomes],
        writes: Callable[[Node], Iterable[str]],
    ) -> None:
        self._bits = bits
        self._outcomes = outcomes
        self._writes = writes
        self._quiet: dict[tuple[Node, int, int], Flow] = {}

    def follow(self, node: Node, before: Written, observer: ReadObserver | None = None) -> Flow:
        """Follow the keys through a node.

        Args:
            node: The node.
            before: The state when it begins.
            observer: Called for every read, each once. Without one a read of a key that no way has written
                ends in failure, as it does at run time.
        """
        if observer is not None:
            return self._node(node, before, observer)
        key = (node, before.maybe, before.surely)
        if key not in self._quiet:
            self._quiet[key] = self._node(node, before, None)
        return self._quiet[key]

    # ---- one node -------------------------------------------------------------------------------------

    def _node(self, node: Node, before: Written, observer: ReadObserver | None) -> Flow:
        outcomes = self._outcomes(node)
        start, failed = self._reads(node, before, observer)
        if start is None:
            return Flow(None, before, before.maybe)
        if isinstance(node, kinds.Retry) and node.attempt_key is not None:
            start = start.plus(self._bit(node.attempt_key.text))
        body = self._body(node, start, observer)
        success, failure, touched = body.success, join(body.failure, failed), body.touched
        if success is not None and not isinstance(node, kinds.Retry | kinds.OnFailure | kinds.ForEach):
            success = success.plus(self._mask(self._writes(node)))
            touched |= success.maybe
        if node.holds is not None:
            failure = join(failure, Written(touched, before.surely))
        if node.cleanup is not None:
            cleaned = self.follow(node.cleanup, Written(touched, before.surely), observer).touched
            touched |= cleaned
            success, failure = _also_maybe(success, cleaned), _also_maybe(failure, cleaned)
        if node.when is not None:
            if outcomes.skip_succeeds:
                success = join(success, before)
            else:
                failure = join(failure, before)
        return Flow(
            success if outcomes.can_succeed else None, failure if outcomes.can_fail else None, touched
        )

    def _reads(self, node: Node, before: Written, observer: ReadObserver | None) -> tuple[State, State]:
        """Return the states after the reads with which a node begins: to go on with, and when one fails."""
        state, failed = before, None
        for reference in node.references():
            bit = self._bits.get(reference.key)
            if bit is None:
                continue  # nothing writes such a key: found elsewhere
            if not state.surely & bit:
                failed = join(failed, state)
            if observer is not None:
                state = observer.read(reference, state)
            elif not state.maybe & bit:
                return None, state
        return state, failed

    def _body(self, node: Node, before: Written, observer: ReadObserver | None) -> Flow:
        match node:
            case (
                kinds.Sequence(children=children, memory=True)
                | kinds.Selector(children=children, memory=True)
            ):
                return self._chain(node, children, before, observer)
            case kinds.Sequence(children=children) | kinds.Selector(children=children):
                return self._reactive(node, children, before, observer)
            case kinds.Parallel():
                return self._parallel(node, before, observer)
            case kinds.If():
                return self._if(node, before, observer)
            case kinds.Switch():
                ways = [self.follow(part, before, observer) for part in node.parts]
                return _either(ways, before, nothing_done=None, not_done=before)
            case kinds.WaitUntil(goal=goal):
                asked = self.follow(goal, self._together((goal,), before), observer)
                return Flow(asked.success, asked.failure, asked.touched)
            case model.Wrapper(child=child):
                return self._wrapper(node, child, before, observer)
        return Flow(before, before, before.maybe)

    # ---- composites -----------------------------------------------------------------------------------

    def _chain(
        self, node: Node, children: Iterable[Node], before: Written, observer: ReadObserver | None
    ) -> Flow:
        """Follow children in turn: a sequence goes on after a success, a selector after a failure."""
        is_sequence = isinstance(node, kinds.Sequence)
        state: State = before
        ended: State = None
        touched = before.maybe
        for child in children:
            if state is None:
                break
            flow = self.follow(child, state, observer)
            goes_on, ends = (flow.success, flow.failure) if is_sequence else (flow.failure, flow.success)
            state, ended, touched = goes_on, join(ended, ends), touched | flow.touched
        return Flow(state, ended, touched) if is_sequence else Flow(ended, state, touched)

    def _reactive(
        self, node: Node, children: tuple[Node, ...], before: Written, observer: ReadObserver | None
    ) -> Flow:
        """Follow children without memory: the first children begin again while a later one runs."""
        state = before
        while (touched := self._chain(node, children, state, None).touched) | state.maybe != state.maybe:
            state = Written(state.maybe | touched, state.surely)
        return self._chain(node, children, state, observer)

    def _parallel(self, node: kinds.Parallel, before: Written, observer: ReadObserver | None) -> Flow:
        children, policy = node.children, node.policy
        state = self._together(children, before)
        touched = state.maybe
        outcomes = [self.follow(child, state, observer).success for child in children]
        needed = policy.successes_needed(len(children))
        if policy.kind is PolicyKind.SELECTED:
            selected = set(node.selected)
            outcomes = [end for child, end in zip(children, outcomes, strict=True) if child in selected]
            needed = len(outcomes)
        good = [end.surely for end in outcomes if end is not None]
        failure = Written(touched, before.surely)
        if len(good) < needed:
            return Flow(None, failure, touched)
        surely = before.surely
        if needed == len(outcomes):
            for each in good:
                surely |= each
        else:
            common = good[0] if good else before.surely
            for each in good:
                common &= each
            surely |= common
        return Flow(Written(touched, surely), failure, touched)

    def _if(self, node: kinds.If, before: Written, observer: ReadObserver | None) -> Flow:
        if not node.memory:
            # Decided again at every tick: one branch may read what the other wrote.
            branches = [node.then, *([node.otherwise] if node.otherwise is not None else [])]
            state = before
            for branch in branches * 2:
                state = Written(state.maybe | self.follow(branch, state).touched, state.surely)
            before = state
        yes: State = before
        no: State = before
        touched = before.maybe
        if isinstance(node.condition, Expression):
            fixed = constant_of(node.condition)
            yes, no = (None if fixed is False else yes), (None if fixed is True else no)
        else:
            asked = self.follow(node.condition, before, observer)
            yes, no, touched = asked.success, asked.failure, asked.touched
        ways = [self.follow(node.then, yes, observer)] if yes is not None else []
        if node.otherwise is not None and no is not None:
            ways.append(self.follow(node.otherwise, no, observer))
            no = None
        flow = _either(ways, before, nothing_done=no if node.otherwise is None else None, not_done=None)
        return Flow(flow.success, flow.failure, flow.touched | touched)

    # ---- nodes with one node below ---------------------------------------------------------------------

    def _wrapper(
        self, node: model.Wrapper, child: Node, before: Written, observer: ReadObserver | None
    ) -> Flow:
        if isinstance(node, kinds.OnFailure):
            return self._on_failure(node, before, observer)
        if isinstance(node, kinds.ForEach):
            return self._for_each(node, before, observer)
        if isinstance(node, kinds.Until):
            return self._until(node, before, observer)
        if isinstance(node, kinds.Interruptible):
            return self._interruptible(node, before, observer)
        if isinstance(node, kinds.Retry | kinds.Repeat):
            return self._loop(node, self._start_of_rounds(node, before), observer)
        flow = self.follow(child, before, observer)
        stopped = join(flow.failure, Written(flow.touched, before.surely))
        match node:
            case kinds.Once():
                return flow
            case kinds.Succeed():
                return Flow(join(flow.success, flow.failure), None, flow.touched)
            case kinds.Invert() if self._outcomes(child).can_skip:
                # What is skipped below it stays so.
                return Flow(join(flow.failure, flow.success), join(flow.success, flow.failure), flow.touched)
            case kinds.Invert():
                return Flow(flow.failure, flow.success, flow.touched)
            case kinds.Timeout():
                return Flow(flow.success, stopped, flow.touched)
        # Of another kind it is not known whether it does what is below it at all, or to its end.
        return Flow(join(flow.success, before), join(stopped, before), flow.touched)

    def _on_failure(self, node: kinds.OnFailure, before: Written, observer: ReadObserver | None) -> Flow:
        flow = self.follow(node.child, before, observer)
        if flow.failure is None:
            return flow
        failed = flow.failure.plus(self._mask(self._writes(node)))
        ways = [self.follow(each, failed, observer) for _, each in node.handlers]
        # What is not caught stands; whether there is such a failure is known from the outcomes.
        return _either([flow, *ways], before, nothing_done=None, not_done=flow.failure)

    def _for_each(self, node: kinds.ForEach, before: Written, observer: ReadObserver | None) -> Flow:
        keys = self._mask(self._writes(node))
        state = before.plus(keys)
        goes_on = bool(node.goes_on_over) or node.first_success
        while True:
            flow = self.follow(node.child, state)
            again = flow.failure if node.first_success else flow.success
            again = join(again, flow.failure) if goes_on else again
            joined = join(state, again)
            if joined is None or joined == state:
                break
            state = joined
        flow = self.follow(node.child, state, observer)
        touched = flow.touched | state.maybe
        if node.first_success:
            return Flow(flow.success, join(before, flow.failure), touched)
        # The list may be empty.
        success = join(before, join(flow.success, flow.failure if goes_on else None))
        return Flow(success, join(flow.failure, before), touched)

    def _until(self, node: kinds.Until, before: Written, observer: ReadObserver | None) -> Flow:
        state = self._together(node.parts, before)
        self.follow(node.child, state, observer)
        goal = self.follow(node.goal, state, observer)
        touched = self._together(node.parts, state).maybe
        success = Written(touched, before.surely | goal.success.surely) if goal.success is not None else None
        if self._outcomes(node.child).can_skip:
            success = Written(touched, before.surely)
        return Flow(success, Written(touched, before.surely), touched)

    def _interruptible(
        self, node: kinds.Interruptible, before: Written, observer: ReadObserver | None
    ) -> Flow:
        state = self._together(node.parts, before)
        done = self.follow(node.child, state, observer).success
        asked = self.follow(node.goal, state, observer).success
        if asked is not None:
            self.follow(node.interruption, Written(state.maybe, asked.surely), observer)
        touched = self._together(node.parts, state).maybe
        success = Written(touched, done.surely) if done is not None else None
        return Flow(success, Written(touched, before.surely), touched)

    def _together(self, children: Iterable[Node], before: Written) -> Written:
        """Return the state when any of some nodes begins that are done at the same time, again and again."""
        state, children = before, tuple(children)
        while True:
            # Each may read what the others write.
            touched = state.maybe
            for child in children:
                touched |= self.follow(child, state).touched
            if touched == state.maybe:
                return state
            state = Written(touched, before.surely)

    def _loop(self, node: kinds.Retry | kinds.Repeat, start: Written, observer: ReadObserver | None) -> Flow:
        """Follow the last round, and what comes between two rounds."""
        flow = self.follow(node.child, start, observer)
        if not isinstance(node, kinds.Retry) or node.between is None or flow.failure is None:
            return flow
        pause = self.follow(node.between, flow.failure, observer)
        return Flow(flow.success, join(flow.failure, pause.failure), flow.touched | pause.touched)

    def _start_of_rounds(self, node: kinds.Retry | kinds.Repeat, before: Written) -> Written:
        """Return the state at the beginning of any round of a loop, the first one included."""
        state = before
        while True:
            flow = self.follow(node.child, state)
            again = flow.failure if isinstance(node, kinds.Retry) else flow.success
            if isinstance(node, kinds.Retry) and node.between is not None and again is not None:
                again = self.follow(node.between, again).success
            joined = join(state, again)
            if joined is None or joined == state:
                return state
            state = joined

    # ---- small steps ----------------------------------------------------------------------------------

    def _bit(self, key: str) -> int:
        return self._bits.get(key, 0)

    def _mask(self, keys: Iterable[str]) -> int:
        mask = 0
        for key in keys:
            mask |= self._bit(key)
        return mask


def join(one: State, other: State) -> State:
    """Return the state where two ways meet."""
    if one is None or other is None:
        return one if other is None else other
    return Written(one.maybe | other.maybe, one.surely & other.surely)


def _also_maybe(state: State, keys: int) -> State:
    return Written(state.maybe | keys, state.surely) if state is not None else None


def _either(ways: Iterable[Flow], before: Written, *, nothing_done: State, not_done: State) -> Flow:
    """Join several ways of which one is taken; or none, which is a success, or none, which is a failure."""
    success, failure, touched = nothing_done, not_done, before.maybe
    for way in ways:
        success, failure = join(success, way.success), join(failure, way.failure)
        touched |= way.touched
    return Flow(success, failure, touched)
