"""Random trees of our own nodes: conditions over keys, jobs that others end, pauses; and others beside them.

Two copies of a tree grow from the same seed, each with keys and a clock of its own; the same happens to both
between the ticks.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

from py_trees import behaviours
from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite, Sequence

from florence_bt.behaviours.branching import If, Switch
from florence_bt.behaviours.catching import OnFailure
from florence_bt.behaviours.cleaning_up import Finally
from florence_bt.behaviours.composites import Selector
from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.decorators import (
    ForceSuccess,
    Invert,
    Once,
    StartGuard,
    While,
)
from florence_bt.behaviours.expressions import CompiledExpression, operation
from florence_bt.behaviours.keys import KeyReference, KeyStore
from florence_bt.behaviours.looping import Repeat, Retry
from florence_bt.behaviours.pacing import Timeout, Wait
from florence_bt.behaviours.parallel import CountingParallel
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.until import Interruptible, Question, Until
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.core.skill import BaseRun, Event
from tests.unit.behaviours.ticking import random_trees

FIXED = (Finally, If, Interruptible, Switch)
KEYS = ("a", "b", "c", "d")
TICKS = 25


class Asks(Behaviour):
    """A condition: a key is above a limit."""

    def __init__(self, name: str, keys: KeyStore, key: str, limit: int) -> None:
        super().__init__(name)
        self._keys, self._key, self._limit = keys, key, limit

    def update(self) -> Status:
        value = self._keys.read(self._key)
        self.feedback_message = f"{self._key} is {value}"
        return Status.SUCCESS if value > self._limit else Status.FAILURE


class Job(Behaviour):
    """Works until somebody ends it; writes down its starts and stops."""

    def __init__(self, name: str, log: list) -> None:
        super().__init__(name)
        self.log = log
        self.end: Status | None = None

    def initialise(self) -> None:
        self.log.append((self.name, "starts"))
        self.end = None

    def update(self) -> Status:
        self.feedback_message = "works" if self.end is None else "is done"
        return self.end or Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        if self.status is Status.RUNNING:
            self.log.append((self.name, "ends", new_status))

    def finish(self, end: Status) -> None:
        if self.status is Status.RUNNING:
            self.end = end


class Ends(Behaviour):
    """Ends a job at once: one line in the log."""

    def __init__(self, job: Job) -> None:
        super().__init__(job.name)
        self.log = job.log

    def update(self) -> Status:
        self.log.append((self.name, "ended"))
        return Status.SUCCESS


class Skill:
    """Runs that others end; writes down their starts and ends."""

    def __init__(self, log: list) -> None:
        self.log = log
        self.runs: list[SkillRun] = []

    def start(self, inputs: Any) -> SkillRun:
        self.runs.append(SkillRun(self, len(self.runs)))
        self.log.append(("skill starts", len(self.runs)))
        return self.runs[-1]


class SkillRun(BaseRun):
    def __init__(self, skill: Skill, number: int) -> None:
        super().__init__("works")
        self.skill = skill
        self.number = number
        self.handle(Event.ACCEPTED)

    def cancel(self) -> None:
        if self.result is None:
            self.skill.log.append(("skill is cancelled", self.number))
            self.handle(Event.CANCEL)
            self.handle(Event.FINISHED, failure("cancelled", "was cancelled"))


class Writes(Behaviour):
    """Writes the next number into a key each time it is ticked: in the middle of a tick."""

    def __init__(self, name: str, keys: KeyStore, key: str, seed: int) -> None:
        super().__init__(name)
        self._random = random.Random(seed)
        self._keys, self._key = keys, key

    def update(self) -> Status:
        self._keys.write(self._key, self._random.randrange(4))
        return self._random.choice((Status.SUCCESS, Status.SUCCESS, Status.FAILURE, Status.RUNNING))


class CleanUp(Sequence):
    """What a clean-up does."""


class ReactiveScript(random_trees.Script):
    """Builds the tree of a seed and does what the seed wants between the ticks."""

    def __init__(self, seed: int, quiet: bool) -> None:
        super().__init__(seed)
        self.clock = ManualClock()
        self.keys = KeyStore(dict.fromkeys(KEYS, 1))
        self.skill = Skill(self.log)
        declared = {"work": SkillDeclaration("work", "Works", deadline_s=4.0)}
        self.context = TreeContext(self.clock, lambda: None, {"work": self.skill}, declared, keys=self.keys)
        self.quiet = quiet
        self.jobs: list[Job] = []

    def leaf(self) -> Behaviour:
        r = self.random
        dice = r.random()
        if dice < 0.45:
            return Asks(self.name("asks"), self.keys, r.choice(KEYS), r.randrange(3))
        if dice < 0.65:
            return RunSkill(self.name("run"), self.context, "work")
        if dice < 0.75:
            self.jobs.append(Job(self.name("job"), self.log))
            return self.jobs[-1]
        if dice < 0.85:
            return Wait(self.name("wait"), self.context, r.choice((0.5, 2.0)))
        if self.quiet:
            constants = (behaviours.Success, behaviours.Failure, behaviours.Running)
            return r.choice(constants)(self.name("constant"))
        if dice < 0.92:
            return Writes(self.name("writes"), self.keys, r.choice(KEYS), r.randrange(1 << 30))
        return super().leaf()

    def composite(self, children: list[Behaviour]) -> Behaviour:
        dice = self.random.random()
        if children and dice < 0.15:
            return Selector(self.name("own selector"), self.random.random() < 0.5, children)
        if children and dice < 0.25:
            enough = self.random.randint(1, len(children))
            many = self.random.choice((None, 1, 2))
            return CountingParallel(self.name("counting"), children, enough, many)
        if self.quiet:
            while True:
                node = super().composite(children)
                if not isinstance(node, (random_trees.OwnStop, random_trees.LoudSequence)):
                    return node
                for child in children:
                    child.parent = None
        return super().composite(children)

    def formula(self) -> CompiledExpression:
        return above(self.random.choice(KEYS), self.random.randrange(3))

    def cleanup(self) -> Callable[[TreeContext], Behaviour]:
        """A clean-up that works a moment and writes down that it did."""
        name = self.name("clean-up")

        def make(context: TreeContext) -> Behaviour:
            job = Job(f"{name} done", self.log)
            return CleanUp(name, True, [Wait(f"{name} waits", context, 0.5), ForceSuccess("ends", Ends(job))])

        return make

    def decorator(self, child: Behaviour) -> Behaviour:
        if self.quiet or self.random.random() < 0.5:
            return self.random.choice(OWN_DECORATORS)(self, child)
        return super().decorator(child)

    def happens(self, root: Behaviour) -> None:
        """What happens between two ticks."""
        r = self.random
        for _ in range(r.choice((0, 1, 1, 2))):
            dice = r.random()
            if dice < 0.4:
                self.keys.write(r.choice(KEYS), r.randrange(4))
            elif dice < 0.75 and self.jobs:
                r.choice(self.jobs).finish(r.choice(random_trees.ENDS))
            elif dice < 0.8 and self.skill.runs:
                run = r.choice(self.skill.runs[-6:])
                run.set_feedback(f"works on {dice:.2f}")
                if r.random() < 0.7:
                    result = success() if r.random() < 0.6 else failure("blocked", "it is blocked")
                    run.handle(Event.FINISHED, result)
            elif dice < 0.85:
                self.clock.advance(1.0)
            elif dice < 0.9:
                root.stop(Status.INVALID)
            elif dice < 0.94:
                r.choice(list(root.iterate())).stop(Status.INVALID)
            elif dice < 0.97:
                self.change_shape(root)

    def change_shape(self, root: Behaviour) -> None:
        node = self.random.choice(list(root.iterate()))
        parent: Any = node.parent
        if isinstance(node, FIXED) or isinstance(parent, FIXED):
            return  # these know their children by heart
        if any(isinstance(each, CleanUp) for each in (node, parent, getattr(parent, "parent", None))):
            return  # another one is built like it when it is interrupted
        if random_trees.may_go(node):
            parent.replace_child(node, self.tree(1))
        elif isinstance(node, Composite):
            node.insert_child(self.tree(1), self.random.randint(0, len(node.children)))


def above(key: str, limit: int) -> CompiledExpression:
    """The expression ``$key > limit``."""
    term = operation(">", KeyReference(key).resolve, lambda keys: limit)
    return CompiledExpression(f"${key} > {limit}", term, (key,))


OWN_DECORATORS: list[Callable[[ReactiveScript, Behaviour], Behaviour]] = [
    lambda s, c: StartGuard(s.name("guard"), c, s.context, when=s.formula(), skipped_fails=True),
    lambda s, c: StartGuard(s.name("guard"), c, s.context, when=s.formula(), holds=s.formula()),
    lambda s, c: While(s.name("while"), c, s.context, s.formula()),
    lambda s, c: Once(s.name("once"), c),
    lambda s, c: OnFailure(s.name("on failure"), s.context, c, [h := s.leaf()], {"broken": h}, h),
    lambda s, c: Until(s.name("until"), s.context, c, Question(s.context, s.leaf(), None), "not_met"),
    lambda s, c: Interruptible(
        s.name("interrupted"), s.context, c, Question(s.context, s.leaf(), None), s.leaf()
    ),
    lambda s, c: Finally(s.name("finally"), s.context, c, s.cleanup()),
    lambda s, c: If(s.name("if"), s.context, s.formula(), c, s.leaf(), memory=s.random.random() < 0.5),
    lambda s, c: If(s.name("if node"), s.context, s.leaf(), c, memory=s.random.random() < 0.5),
    lambda s, c: Switch(
        s.name("switch"), s.context, KeyReference(s.random.choice(KEYS)), [((1,), c), ((2, 3), s.leaf())]
    ),
    lambda s, c: Invert(s.name("invert"), c),
    lambda s, c: ForceSuccess(s.name("force"), c),
    lambda s, c: Retry(s.name("retry"), c, s.context, 2),
    lambda s, c: Repeat(s.name("repeat"), c, s.context, 2),
    lambda s, c: Timeout(s.name("timeout"), c, s.context, 1.5),
]


def play(
    seed: int, make_tick: Callable[[Behaviour], Callable[[], object]], depth: int, quiet: bool
) -> list[Any]:
    """Everything that two ways of ticking must have in common.

    Args:
        seed: Chooses the tree and the script.
        make_tick: From a root: what ticks it.
        depth: How deep the tree may be.
        quiet: Without nodes that write keys or answer at random.
    """
    random_trees.blackboard.Blackboard.clear()
    script = ReactiveScript(seed, quiet)
    root = script.tree(depth)
    tick = make_tick(root)
    story: list[Any] = []
    for _ in range(TICKS):
        script.context.tick_beside()
        tick()
        story.append((random_trees.state_of(root), tuple(script.log)))
        script.log.clear()
        script.happens(root)
        story.append(tuple(script.log))
        script.log.clear()
    return story
