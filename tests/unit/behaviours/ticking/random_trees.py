"""Random trees of py_trees whose nodes write down every call, and a script of what happens between the ticks.

The same seed gives the same tree and the same script, so a tree that py_trees ticks can be compared with one
that our ticker ticks.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

from py_trees import behaviours, blackboard, composites, decorators
from py_trees.behaviour import Behaviour
from py_trees.common import Access, ComparisonExpression, OneShotPolicy, ParallelPolicy, Status
from py_trees.trees import BehaviourTree

from florence_bt.behaviours.ticking import Ticker

TICKS = 15
ENDS = (Status.SUCCESS, Status.FAILURE)
Log = list[tuple[Any, ...]]


class TickedTree(BehaviourTree):
    """The tree of py_trees, whose shape can be changed, with our ticker."""

    def __init__(self, root: Behaviour) -> None:
        super().__init__(root)
        self._ticker = Ticker(root)

    def tick(self, *_: Any) -> None:
        self._ticker.root = self.root
        self._ticker.tick()


class Scripted(Behaviour):
    """A leaf that answers what a seeded generator says, and writes down its calls."""

    def __init__(self, name: str, seed: int, log: Log, odd: bool) -> None:
        super().__init__(name)
        self._random = random.Random(seed)
        self._log = log
        self._odd = odd

    def initialise(self) -> None:
        self._log.append((self.name, "initialise", self.status))

    def update(self) -> Any:
        self._log.append((self.name, "update", self.status))
        dice = self._random.random()
        self.feedback_message = f"{dice:.1f}"
        if self._odd and dice < 0.1:
            return Status.INVALID if dice < 0.05 else "nonsense"
        return self._random.choices((Status.SUCCESS, Status.FAILURE, Status.RUNNING), (4, 3, 5))[0]

    def terminate(self, new_status: Status) -> None:
        self._log.append((self.name, "terminate", self.status, new_status))


class Silent(Scripted):
    """The same without ``initialise`` and ``terminate`` of its own."""

    initialise = Behaviour.initialise
    terminate = Behaviour.terminate


class OwnTick(Scripted):
    """A leaf with a ``tick`` of its own, unknown to the ticker."""

    def tick(self):
        self._log.append((self.name, "own tick", self.status))
        yield from super().tick()


class OwnStop(composites.Sequence):
    """A composite with a ``stop`` of its own, unknown to the ticker."""

    def stop(self, new_status: Status = Status.INVALID) -> None:
        self.feedback_message = f"own stop {new_status}"
        super().stop(new_status)


class LoudSequence(composites.Sequence):
    """A sequence that only adds ``initialise`` and ``terminate``."""

    log: Log

    def initialise(self) -> None:
        self.log.append((self.name, "initialise", self.status))

    def terminate(self, new_status: Status) -> None:
        self.log.append((self.name, "terminate", self.status, new_status))


class LoudDecorator(decorators.PassThrough):
    """A decorator of a user, which sometimes stops its child by itself."""

    log: Log

    def update(self) -> Status:
        status = self.decorated.status
        self.log.append((self.name, "update", status))
        if status is Status.RUNNING and len(self.log) % 5 == 0:
            self.decorated.stop(Status.INVALID)
            return Status.FAILURE
        return status


class Script:
    """Builds the tree of a seed and does what the seed wants between the ticks."""

    def __init__(self, seed: int, odd: bool = False) -> None:
        self.random = random.Random(seed)
        self.log: Log = []
        self._count = 0
        self._odd = odd
        self.blackboard = blackboard.Client(name="script")
        for key in ("flag", "items", "status", "item"):
            self.blackboard.register_key(key=key, access=Access.WRITE)
        self.blackboard.flag = True
        self.blackboard.items = [1, 2, 3]
        self.blackboard.status = Status.RUNNING

    def name(self, kind: str) -> str:
        self._count += 1
        return f"{kind} {self._count}"

    def tree(self, depth: int) -> Behaviour:
        dice = self.random.random()
        if depth == 0 or dice < 0.1:
            return self.leaf()
        if dice < 0.35:
            return self.decorator(self.tree(depth - 1))
        return self.composite(
            [self.tree(depth - 1) for _ in range(self.random.choice((0, 1, 2, 2, 3, 3, 4)))]
        )

    def leaf(self) -> Behaviour:
        r = self.random
        seed = r.randrange(1 << 30)
        makers: list[Callable[[], Behaviour]] = [
            lambda: Scripted(self.name("scripted"), seed, self.log, self._odd),
            lambda: Scripted(self.name("scripted"), seed, self.log, self._odd),
            lambda: Scripted(self.name("scripted"), seed, self.log, self._odd),
            lambda: Silent(self.name("silent"), seed, self.log, self._odd),
            lambda: OwnTick(self.name("own tick"), seed, self.log, self._odd),
            lambda: behaviours.Success(self.name("success")),
            lambda: behaviours.Failure(self.name("failure")),
            lambda: behaviours.Running(self.name("running")),
            lambda: behaviours.Dummy(self.name("dummy")),
            lambda: behaviours.Periodic(self.name("periodic"), 2),
            lambda: behaviours.TickCounter(self.name("counter"), 2, r.choice(ENDS)),
            lambda: behaviours.SuccessEveryN(self.name("every n"), 3),
            lambda: behaviours.StatusQueue(self.name("queue"), list(ENDS), r.choice((None, Status.RUNNING))),
            lambda: behaviours.CheckBlackboardVariableValue(
                self.name("check"), ComparisonExpression("flag", True, lambda a, b: a == b)
            ),
        ]
        return r.choice(makers)()

    def composite(self, children: list[Behaviour]) -> Behaviour:
        r = self.random
        memory = r.random() < 0.5
        kind = r.randrange(8)
        if kind <= 1:
            return composites.Sequence(self.name("sequence"), memory, children)
        if kind <= 3 and (children or not memory):
            return composites.Selector(self.name("selector"), memory, children)
        if kind == 4:
            loud = LoudSequence(self.name("loud sequence"), memory, children)
            loud.log = self.log
            return loud
        if kind == 5:
            return OwnStop(self.name("own stop"), memory, children)
        policies: list[ParallelPolicy.Base] = [
            ParallelPolicy.SuccessOnAll(synchronise=memory),
            ParallelPolicy.SuccessOnOne(),
        ]
        if children:
            chosen = r.sample(children, r.randint(1, len(children)))
            policies.append(ParallelPolicy.SuccessOnSelected(chosen, synchronise=memory))
        return composites.Parallel(self.name("parallel"), r.choice(policies), children)

    def decorator(self, child: Behaviour) -> Behaviour:
        node = self.random.choice(DECORATORS)(self, child)
        if isinstance(node, LoudDecorator):
            node.log = self.log
        return node

    def between_ticks(self, tree: BehaviourTree) -> None:
        """Now and then stop the tree or a part of it, or change its shape or the blackboard."""
        dice = self.random.random()
        nodes = list(tree.root.iterate())
        node = self.random.choice(nodes)
        if dice < 0.06:
            tree.root.stop(Status.INVALID)
        elif dice < 0.12:
            node.stop(Status.INVALID)
        elif dice < 0.2 and isinstance(node, composites.Composite):
            tree.insert_subtree(self.tree(1), node.id, self.random.randint(0, len(node.children)))
        elif dice < 0.28 and may_go(node):
            tree.prune_subtree(node.id)
        elif dice < 0.34 and may_go(node):
            tree.replace_subtree(node.id, self.tree(2))
        elif dice < 0.4:
            self.blackboard.flag = not self.blackboard.flag


def may_go(node: Behaviour) -> bool:
    """Whether py_trees can take a node away without failing at the next tick: the parent keeps a policy or a
    memory that names its children."""
    parent = node.parent
    if not isinstance(parent, composites.Composite) or len(parent.children) < 2:
        return False
    if isinstance(parent, composites.Parallel):
        return not isinstance(parent.policy, ParallelPolicy.SuccessOnSelected)
    return not (isinstance(parent, composites.Selector) and parent.memory and parent.current_child is node)


def _plain(cls: Any) -> Callable[[Script, Behaviour], Behaviour]:
    return lambda script, child: cls(script.name(cls.__name__), child)


DECORATORS: list[Callable[[Script, Behaviour], Behaviour]] = [
    *(
        _plain(cls)
        for cls in (
            decorators.Count,
            decorators.FailureIsRunning,
            decorators.FailureIsSuccess,
            decorators.Inverter,
            decorators.PassThrough,
            decorators.RunningIsFailure,
            decorators.RunningIsSuccess,
            decorators.SuccessIsFailure,
            decorators.SuccessIsRunning,
            LoudDecorator,
        )
    ),
    lambda s, c: decorators.Condition(s.name("condition"), c, s.random.choice(list(Status))),
    lambda s, c: decorators.EternalGuard(s.name("guard"), c, lambda: bool(s.blackboard.flag)),
    lambda s, c: decorators.EternalGuard(
        s.name("guard"), c, lambda: Status.RUNNING if s.blackboard.flag else Status.FAILURE
    ),
    lambda s, c: decorators.ForEach(s.name("for each"), c, "items", "item"),
    lambda s, c: decorators.OneShot(s.name("one shot"), c, s.random.choice(list(OneShotPolicy))),
    lambda s, c: decorators.Repeat(s.name("repeat"), c, s.random.choice((-1, 2))),
    lambda s, c: decorators.Retry(s.name("retry"), c, 2),
    lambda s, c: decorators.StatusToBlackboard(s.name("to blackboard"), c, "status"),
    lambda s, c: decorators.Timeout(s.name("timeout"), c, s.random.choice((2.0, 1e6))),
]
"""Every decorator of py_trees, and one of a user."""


def state_of(root: Behaviour) -> Log:
    """All that can be seen of a tree."""
    state: Log = []
    for node in root.iterate():
        current = getattr(node, "current_child", None)
        tip = node.tip()
        state.append(
            (node.name, node.status, node.feedback_message, current and current.name, tip and tip.name)
        )
    return state


def play(
    seed: int, make_tree: Callable[[Behaviour], BehaviourTree], depth: int = 3, odd: bool = False
) -> list[Any]:
    """Everything that can be seen of a script: the state of the tree after each tick, and every call."""
    blackboard.Blackboard.clear()
    script = Script(seed, odd)
    tree = make_tree(script.tree(depth))
    story: list[Any] = []
    for _ in range(TICKS):
        tree.tick()
        story.append((state_of(tree.root), tuple(script.log)))
        script.log.clear()
        script.between_ticks(tree)
        story.append((state_of(tree.root), tuple(script.log)))
        script.log.clear()
    return story
