"""A second reading of docs/reference/missions.md: missions interpreted step by step, without the engine.

It is written from the page and imports nothing of the product. A node is a generator: it is resumed in every
step, says "not yet" by yielding, and returns its result. Closing it stops it. One more kind is a method
``do_KIND``; one more modifier is a line in :data:`LAYERS`, from the inside to the outside, and its method.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from operator import eq, gt, lt, ne
from typing import Any

Node = dict[str, Any]
SKIPPED = "skipped"
OK = "ok"
"""Results are texts: this one, SKIPPED, or the code of a failure as ``Failed``."""
NO_MENDING = ("no_skill", "bad_input", "bad_output", "bad_expression")
GROUPS = {"out_of_order": ("broken", "jammed")}
"""The groups of codes of the skill ``task``."""
SUB = {
    "inputs": {"x": 0},
    "tree": {
        "sequence": [{"selector": [{"condition": "$x > 1"}, {"task": {"name": "sub"}}]}, {"set": {"y": 2}}]
    },
}
"""The mission that others call: its inputs with their defaults, and its tree; its output is ``y``."""


LONGEST = 20.0
"""When both readers give up a mission that still runs, seconds: some are interrupted for ever."""


class Interruption(BaseException):
    """What runs of a node that does one thing after the other begins again, when it goes on."""


@dataclass(frozen=True)
class Failed:
    """A failure.

    Attributes:
        code: Its code.
    """

    code: str


Result = str | Failed
Run = Generator[None, None, Result]


class Scope:
    """Keys: those of a mission, or those that a part of it has for itself."""

    def __init__(self, outer: Scope | None, values: Mapping[str, Any]) -> None:
        self.outer = outer
        self.values = dict(values)

    def holder(self, key: str) -> Scope:
        return self if self.outer is None or key in self.values else self.outer.holder(key)

    def read(self, key: str) -> Any:
        return self.holder(key).values[key]

    def write(self, key: str, value: Any) -> None:
        holder = self.holder(key)
        holder.values[key] = value
        # Outside, where no other loop has the name, the key holds what was written last.
        if holder.outer is not None:
            outside = holder.outer.holder(key)
            if outside.outer is None:
                outside.values[key] = value


@dataclass
class World:
    """A mission that is interpreted.

    Attributes:
        tasks: Task -> how its runs end, one after the other: seconds, code or None, the number that it gives.
    """

    tasks: Mapping[str, list[tuple[float, str | None, int]]]
    now: float = 0.0
    step: int = 0
    log: list[tuple[float, str, str]] = field(default_factory=list)
    keys: Scope = field(default_factory=lambda: Scope(None, {}))
    result: Result | None = None

    def __post_init__(self) -> None:
        self._root: Run = nothing()
        self._moments: set[float] = set()
        self._again = False
        self._beside: list[Run] = []
        self._began: dict[str, int] = {}
        self._once: dict[int, Result] = {}

    # ---- time -----------------------------------------------------------------------------------------

    def play(self, tree: Node, keys: Mapping[str, Any], stop_at: float | None = None) -> None:
        """Play a mission to its end, or as long as something can still happen."""
        self.keys = Scope(None, keys)
        root = self._root = self.node(tree, self.keys)  # kept: what still runs in the end is not stopped
        stopped = False
        while True:
            while True:
                self._take_step(root if self.result is None and not stopped else None)
                if not self._again:
                    break
            if self.result is not None and not self._beside:
                return
            moment = min((each for each in self._moments if each > self.now), default=None)
            if stop_at is not None and not stopped and (moment is None or stop_at < moment):
                self.now, stopped = stop_at, True
                if self.result is None:
                    self.result = "stopped"
                    root.close()
            elif moment is None or moment > LONGEST:
                return
            else:
                self.now = moment

    def _take_step(self, root: Run | None) -> None:
        self.step += 1
        self._again = False
        before = dict(self.keys.values)
        self._beside = [each for each in list(self._beside) if step(each) is None]
        if root is not None:
            result = step(root)
            self.result = OK if result == SKIPPED else result
        self._again = self._again or (root is not None and before != self.keys.values)

    def wake(self, seconds: float) -> float:
        moment = self.now + seconds
        self._moments.add(moment)
        return moment

    def next_step(self) -> Generator[None, None, None]:
        """Go on in the next step, which comes at once."""
        self._again = True
        yield from paused(lambda: None)

    def go_on_beside(self, run: Run) -> None:
        if step(run) is None:
            self._beside.append(run)

    # ---- a node with its modifiers --------------------------------------------------------------------

    def node(self, node: Node, scope: Scope) -> Run:
        if "when" in node and not holds(node["when"], scope):
            return SKIPPED
        return (yield from self.layer(node, scope, len(LAYERS)))

    def layer(self, node: Node, scope: Scope, depth: int) -> Run:
        """Run a node with its modifiers up to one of LAYERS."""
        if depth == 0:
            kind = kind_of(node)
            return getattr(self, f"do_{kind}")(node, scope)
        modifier, method = LAYERS[depth - 1]
        inner = self.layer(node, scope, depth - 1)
        return getattr(self, method)(node, scope, inner) if modifier in node else inner

    def interrupted(self, node: Node, scope: Scope, body: Run) -> Run:
        kind, asked = kind_of(node), node["interrupted_by"]
        in_turn = kind in ("sequence", "selector", "for_each", "retry", "repeat")
        in_turn = in_turn and node.get("memory") is not False
        goal, begun, goes_on = self.ask(asked["if"], scope), False, False
        try:
            while True:
                if goes_on and (result := step(body)) is not None:
                    return result
                answer = step(goal)
                if isinstance(answer, Failed):
                    return answer
                if answer is None:
                    if not goes_on and (result := step(body)) is not None:
                        return result
                    begun = goes_on = True
                    yield
                    continue
                goal.close()
                if begun and in_turn:
                    body.throw(Interruption())
                elif begun:
                    body.close()
                    body, begun = self.layer(node, scope, 0), False
                result = yield from self.node(asked["do"], scope)
                if isinstance(result, Failed):
                    return result
                yield from self.next_step()
                goal, goes_on = self.ask(asked["if"], scope), False
        finally:
            body.close()
            goal.close()

    def in_turn(self, node: Node, scope: Scope) -> Run:
        """Run one of several nodes; when it was interrupted it begins again."""
        run = self.node(node, scope)

        def begin_again() -> None:
            nonlocal run
            run.close()
            run = self.node(node, scope)

        try:
            while (result := step(run)) is None:
                yield from paused(begin_again)
            return result
        finally:
            run.close()

    def held(self, node: Node, scope: Scope, body: Run) -> Run:
        broken = Failed(node.get("code", "guard_failed") if "until" not in node else "guard_failed")
        try:
            while holds(node["while"], scope):
                result = step(body)
                if result is not None:
                    return result
                if not holds(node["while"], scope):
                    break
                yield
            return broken
        finally:
            body.close()

    def ended(self, node: Node, scope: Scope, body: Run) -> Run:
        goal = self.ask(node["until"], scope)
        try:
            while True:
                answer = step(goal)
                if answer is not None:
                    return answer
                result = step(body)
                if result is not None:
                    if result != OK:
                        return result
                    return step(goal) or Failed(node.get("code", "until_not_met"))
                yield
        finally:
            body.close()
            goal.close()

    def ask(self, goal: Any, scope: Scope) -> Run:
        """Ask until the answer is yes."""
        if isinstance(goal, str):
            while not holds(goal, scope):
                yield
            return OK
        while True:
            began = self.now
            result = yield from self.node(goal, scope)
            if result == OK or (isinstance(result, Failed) and result.code in NO_MENDING):
                return result
            rested, last = self.wake(max(0.0, began + 1.0 - self.now)), self.step
            self._again = self._again or rested == self.now
            while self.now < rested or self.step == last:
                yield

    def ensured(self, node: Node, scope: Scope, body: Run) -> Run:
        result = yield from body
        if isinstance(result, Failed) or holds(node["ensure"], scope):
            return result if isinstance(result, Failed) else OK
        return Failed(node.get("code", "not_ensured"))

    def handled(self, node: Node, scope: Scope, body: Run) -> Run:
        result = yield from body
        if not isinstance(result, Failed):
            return result
        words = node["on_failure"]
        groups = [group for group, codes in GROUPS.items() if result.code in codes]
        word = next((word for word in (result.code, *groups, "any") if word in words), None)
        if word is None:
            return result
        own = Scope(scope, {"failure_code": result.code})
        own.write("failure_code", result.code)
        end = yield from self.node(words[word], own)
        return result if end == SKIPPED else end

    def cleaned(self, node: Node, scope: Scope, body: Run) -> Run:
        if (
            not {"until", "on_failure", "ensure"} & set(node)
            and "while" in node
            and not holds(node["while"], scope)
        ):
            return (yield from body)  # it never starts
        try:
            result = yield from body
        except GeneratorExit:
            self.go_on_beside(self.node(node["finally"], scope))
            raise
        tidying = self.node(node["finally"], scope)
        while step(tidying) is None:
            try:
                yield
            except GeneratorExit:
                self.go_on_beside(tidying)
                raise
        return result

    # ---- kinds ----------------------------------------------------------------------------------------

    def do_sequence(self, node: Node, scope: Scope) -> Run:
        if node.get("memory") is False:
            return (yield from self.watched(node["sequence"], scope, OK))
        for child in node["sequence"]:
            result = yield from self.in_turn(child, scope)
            if isinstance(result, Failed):
                return result
        return OK

    def do_selector(self, node: Node, scope: Scope) -> Run:
        if node.get("memory") is False:
            return (yield from self.watched(node["selector"], scope, None))
        for child in node["selector"]:
            result = yield from self.in_turn(child, scope)
            if result == OK:
                return result
        return Failed(SKIPPED) if result == SKIPPED else result

    def watched(self, children: list[Node], scope: Scope, goes_on: Result | None) -> Run:
        """Ask plain conditions again while the last node runs."""
        *conditions, last = children
        run = None
        try:
            while True:
                for condition in conditions:
                    answer = step(self.node(condition, scope))
                    if (answer == OK) != (goes_on == OK):
                        return answer or OK
                run = run or self.node(last, scope)
                result = step(run)
                if result is not None:
                    return result if result != SKIPPED else (OK if goes_on == OK else Failed(SKIPPED))
                yield
        finally:
            if run is not None:
                run.close()

    def do_parallel(self, node: Node, scope: Scope) -> Run:
        branches = node["parallel"]
        runs = [self.node(child, scope) for child in branches]
        ends: list[Result | None] = [None] * len(runs)
        policy = node.get("policy", "all")
        wanted = [True] * len(runs)
        many = 1
        if isinstance(policy, list):
            wanted = [child.get("name") in policy for child in branches]
            needed = len(policy)
        elif isinstance(policy, dict):
            needed, many = policy["succeed"], policy.get("fail", len(runs) + 1)
        else:
            needed, many = {"all": (len(runs), 1), "any": (1, len(runs))}[policy]
        try:
            while True:
                ends = [step(run) if end is None else end for run, end in zip(runs, ends, strict=True)]
                failed = [end for end in ends if isinstance(end, Failed)]
                good = [end for end, want in zip(ends, wanted, strict=True) if want and end in (OK, SKIPPED)]
                if len(good) >= needed:
                    return OK
                if len(failed) >= many or len(runs) - len(failed) < (
                    1 if isinstance(policy, list) else needed
                ):
                    return failed[0]
                yield
        finally:
            for run in runs:
                run.close()

    def do_if(self, node: Node, scope: Scope) -> Run:
        asked = node["if"]
        if not isinstance(asked, str):
            answer = (yield from self.node(asked, scope)) == OK
        else:
            answer = holds(asked, scope)
        run = self.branch(node, scope, answer)
        try:
            while True:
                if node.get("memory") is False and holds(asked, scope) is not answer:
                    run.close()
                    answer = not answer
                    run = self.branch(node, scope, answer)
                result = step(run)
                if result is not None:
                    return result
                yield
        finally:
            run.close()

    def branch(self, node: Node, scope: Scope, answer: bool) -> Run:
        part = node.get("then" if answer else "else")
        return self.node(part, scope) if part is not None else nothing()

    def do_switch(self, node: Node, scope: Scope) -> Run:
        part = node["cases"].get(value(node["switch"], scope), node.get("default"))
        return (yield from self.node(part, scope)) if part is not None else Failed("no_case")

    def do_retry(self, node: Node, scope: Scope) -> Run:
        own = Scope(scope, {node["attempt"]: 1}) if "attempt" in node else scope
        codes = [code for word in node.get("on", ()) for code in GROUPS.get(word, (word,))]
        attempt = 1
        while True:
            if "attempt" in node:
                own.write(node["attempt"], attempt)
            if attempt > 1 and "between" not in node:
                yield from self.next_step()
            result = yield from self.in_turn(node["do"], own)
            ends = not isinstance(result, Failed) or attempt == node["retry"]
            if ends or (codes and result.code not in codes):
                return result
            if "between" in node:
                yield from self.next_step()
                pause = yield from self.in_turn(node["between"], own)
                if isinstance(pause, Failed):
                    return pause
            attempt += 1

    def do_repeat(self, node: Node, scope: Scope) -> Run:
        for number in range(node["repeat"]):
            if number:
                yield from self.next_step()
            result = yield from self.in_turn(node["do"], scope)
            if isinstance(result, Failed):
                return result
        return OK

    def do_for_each(self, node: Node, scope: Scope) -> Run:
        first, names = node.get("first_success"), [node["as"], *([node["index"]] if "index" in node else [])]
        own = Scope(scope, dict.fromkeys(names))
        over = [code for word in node.get("go_on_over", ()) for code in GROUPS.get(word, (word,))]
        for index, item in enumerate(node["for_each"]):
            for name, each in zip(names, (item, index), strict=False):
                own.write(name, each)
            if index:
                yield from self.next_step()
            result = yield from self.in_turn(node["do"], own)
            if result == OK and first:
                return OK
            if isinstance(result, Failed) and not (result.code in over or (first and not over)):
                return result
        return Failed(node.get("code", "none_worked")) if first else OK

    def do_timeout(self, node: Node, scope: Scope) -> Run:
        end = self.wake(seconds(node["timeout"]))
        run = self.node(node["do"], scope)
        try:
            while (result := step(run)) is None:
                if self.now >= end:
                    return Failed("timed_out")
                yield
            return result
        finally:
            run.close()

    def do_once(self, node: Node, scope: Scope) -> Run:
        if id(node) not in self._once:
            result = yield from self.node(node["once"], scope)
            if result == SKIPPED:
                return result
            self._once[id(node)] = result
        return self._once[id(node)]

    def do_invert(self, node: Node, scope: Scope) -> Run:
        result = yield from self.node(node["invert"], scope)
        if result == SKIPPED:
            return result
        return Failed(node.get("code", "unexpected_success")) if result == OK else OK

    def do_succeed(self, node: Node, scope: Scope) -> Run:
        yield from self.node(node["succeed"], scope)
        return OK

    def do_condition(self, node: Node, scope: Scope) -> Run:
        yield from ()
        return OK if holds(node["condition"], scope) else Failed(node.get("code", "condition_false"))

    def do_fail(self, node: Node, scope: Scope) -> Run:
        yield from ()
        return Failed(node.get("code", "failed"))

    def do_wait(self, node: Node, scope: Scope) -> Run:
        end = self.wake(seconds(node["wait"]))
        while self.now < end:
            yield
        return OK

    def do_wait_until(self, node: Node, scope: Scope) -> Run:
        end = self.wake(seconds(node["timeout"])) if "timeout" in node else None
        run = self.ask(node["wait_until"], scope)
        while (result := step(run)) is None:
            if end is not None and self.now >= end:
                return Failed("timed_out")
            yield
        return result

    def do_set(self, node: Node, scope: Scope) -> Run:
        yield from ()
        new = {key: value(each, scope) for key, each in node["set"].items()}
        for key, each in new.items():
            scope.write(key, each)
        return OK

    def do_add(self, node: Node, scope: Scope) -> Run:
        yield from ()
        new = {key: scope.read(key) + value(each, scope) for key, each in node["add"].items()}
        for key, each in new.items():
            scope.write(key, each)
        return OK

    def do_append(self, node: Node, scope: Scope) -> Run:
        yield from ()
        new = {key: (*scope.read(key), value(each, scope)) for key, each in node["append"].items()}
        for key, each in new.items():
            scope.write(key, each)
        return OK

    def do_run(self, node: Node, scope: Scope) -> Run:
        given = {key: value(each, scope) for key, each in node.get("with", {}).items()}
        inside = Scope(None, {**SUB["inputs"], **given})
        result = yield from self.node(SUB["tree"], inside)
        if isinstance(result, Failed):
            return result
        for output, key in node.get("out", {}).items():
            scope.write(key, inside.read(output))
        return OK

    def do_task(self, node: Node, scope: Scope) -> Run:
        name = node["task"]["name"]
        script = self.tasks[name]
        number = self._began[name] = self._began.get(name, -1) + 1
        after, code, given = script[min(number, len(script) - 1)]
        self.log.append((self.now, name, "begins"))
        end = self.wake(after)
        try:
            while self.now < end:
                yield
        except GeneratorExit:
            self.log.append((self.now, name, "stopped"))
            raise
        self.log.append((self.now, name, code or OK))
        if code is not None:
            return Failed(code)
        for key in node.get("out", {}).values():
            scope.write(key, given)
        return OK


LAYERS = (
    ("interrupted_by", "interrupted"),
    ("while", "held"),
    ("until", "ended"),
    ("on_failure", "handled"),
    ("ensure", "ensured"),
    ("finally", "cleaned"),
)
"""Modifiers and their methods, from the inside to the outside; `when` comes before them."""
MODIFIERS = ("name", "when", *(modifier for modifier, _ in LAYERS), "because")
"""What every node can have."""
_OF_KINDS = (
    *(
        "do",
        "then",
        "else",
        "cases",
        "default",
        "as",
        "index",
        "go_on_over",
        "first_success",
        "on",
        "attempt",
    ),
    *("between", "memory", "policy", "code", "with", "out", "every"),
)
_COMPARED = re.compile(r"\$(\w+) (<|>|==|!=) (\d+)")
_ADDED = re.compile(r"\$\{\$(\w+) \+ (\d+)\}")
_OPERATORS = {"<": lt, ">": gt, "==": eq, "!=": ne}


def kind_of(node: Node) -> str:
    if "wait_until" in node:
        return "wait_until"  # which can have a time-out
    (kind,) = [key for key in node if key not in MODIFIERS and key not in _OF_KINDS]
    return kind


def step(run: Run) -> Result | None:
    """Take one step; the result when that was the last one."""
    try:
        next(run)
    except StopIteration as end:
        result: Result = end.value
        return result
    return None


def paused(interrupted: Callable[[], None]) -> Generator[None, None, None]:
    """Wait for the next step; tell of each interruption that comes before it."""
    while True:
        try:
            yield
        except Interruption:
            interrupted()
        else:
            return


def nothing() -> Run:
    yield from ()
    return OK


def holds(text: str, scope: Scope) -> bool:
    if text.startswith("not ("):
        return not holds(text[5:-1], scope)
    key, operator, number = _COMPARED.fullmatch(text).groups()  # type: ignore[union-attr]
    return bool(_OPERATORS[operator](scope.read(key), int(number)))


def value(written: Any, scope: Scope) -> Any:
    if isinstance(written, str) and (added := _ADDED.fullmatch(written)):
        return scope.read(added[1]) + int(added[2])
    if isinstance(written, str) and written.startswith("$"):
        return scope.read(written[1:])
    return tuple(written) if isinstance(written, list) else written


def seconds(text: str) -> float:
    return float(text.removesuffix(" s"))
