"""The mocked skills of one test: which mock answers a call, and what was called with which inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from inspect import isgenerator
from typing import Any, cast

from florence_bt.core.clock import Clock
from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Result
from florence_bt.core.skill import Inputs, SkillRun
from florence_bt.mission_testing.mocks.mocks import Routine, RoutineRun, ScriptedRun, Step, broken_function
from florence_bt.mission_testing.mocks.scripts import (
    Function,
    MockReply,
    Script,
    replies_of,
    reply_per_call,
    to_step,
)
from florence_bt.mission_testing.paths import (
    MissionMap,
    NodeRef,
    Pattern,
    made_up_node,
    read_pattern,
    unmatched,
)
from florence_bt.trees.language.quantities import example_of


class MockError(AssertionError):
    """A mission did with a skill what the test did not provide for, or a mock what the real skill cannot."""


@dataclass(eq=False, slots=True)
class SkillCall:
    """One start of a mocked skill.

    Attributes:
        skill: The name of the skill.
        node: The node that started it.
        inputs: The complete inputs in SI units.
        run_id: The run of the mission that it belongs to.
        started: When, in seconds on the test's clock.
        ended: When it ended, None while it runs.
        result: How it ended, None while it runs.
        cancelled: Whether it was cancelled before its end.
    """

    skill: str
    node: NodeRef
    inputs: Mapping[str, Any]
    run_id: str
    started: float
    ended: float | None = None
    result: Result | None = None
    cancelled: bool = False

    @property
    def path(self) -> str:
        """The path of the node that started it, with the names of missions and skills."""
        return self.node.shown


@dataclass(eq=False, slots=True)
class Mock:
    """A script and whom it is for.

    Attributes:
        pattern: The skills or nodes that it answers.
        default: Whether every mock that is not a default comes before it, and it need not be used.
        replies: What its calls get, one after the other; empty when a function decides.
        function: The function that decides, or None.
        calls: The calls that it answered.
        asked: Whether a call came to it at all.
        until: The moment until which the present step is given to every call.
    """

    pattern: Pattern
    default: bool
    replies: tuple[MockReply, ...]
    function: Function | None
    calls: list[SkillCall] = field(default_factory=list)
    asked: bool = False
    until: float = float("-inf")
    _turns: Iterator[MockReply] | None = None
    _lasting: MockReply | None = None

    @property
    def inputs(self) -> list[Mapping[str, Any]]:
        """The inputs of the calls that it answered."""
        return [call.inputs for call in self.calls]

    def next(self, now: float) -> MockReply | None:
        """Return what the next call gets, None when the script has no more."""
        if self._turns is None:
            self._turns = reply_per_call(self.replies)
        if now >= self.until:
            reply = self._lasting = next(self._turns, None)
            if reply is not None and reply.lasts is not None:
                self.until = now + reply.lasts
        return self._lasting


class MockBoard:
    """The mocks of a test, as the skills of a robot.

    Args:
        clock: Drives the runs.
        declarations: What the real skills say about themselves.
        find_node: Gives the node of a path.
        run_id: Gives the ID of the current run of a mission.

    Attributes:
        calls: Every call of a mocked skill, in order.
        problems: What went wrong with the mocks; the test must fail with the first.
    """

    def __init__(
        self,
        clock: Clock,
        declarations: Mapping[str, SkillDeclaration],
        find_node: Callable[[str], NodeRef] = made_up_node,
        run_id: Callable[[], str] = str,
    ) -> None:
        self.calls: list[SkillCall] = []
        self.problems: list[str] = []
        self._find_node = find_node
        self._run_id = run_id
        self._clock = clock
        self._declarations = declarations
        self._mocks: list[Mock] = []
        self._chosen: dict[str, Mock | None] = {}
        self._used: set[str] = set()
        self._watches: list[tuple[str, Callable[[], None]]] = []

    def patterns(self) -> list[Pattern]:
        """Return whom the mocks are for."""
        return [mock.pattern for mock in self._mocks]

    def unused(self) -> list[str]:
        """Return the patterns of the mocks that answered no call yet; those of the whole test need not."""
        return [mock.pattern.text for mock in self._mocks if not mock.default and not mock.asked]

    def skills(self) -> Mapping[str, MockedSkill]:
        """Return a skill for each declaration, also for those that missions bring along later."""
        return _MockedSkills(self, self._declarations)

    def add(self, pattern: str, script: Script, *, default: bool = False) -> Mock:
        """Add a mock.

        Raises:
            ConfigError: The pattern or the script cannot be read, or the skill that it names cannot do that.
        """
        function = script if callable(script) else None
        replies = () if callable(script) else replies_of(script)
        mock = Mock(read_pattern(pattern), default, replies, function)
        declaration = self._declarations.get(pattern)
        if declaration is not None:
            for reply in replies:
                to_step(reply, declaration)
        self._mocks.append(mock)
        self._chosen.clear()
        return mock

    def check_patterns(self, mission: MissionMap) -> None:
        """See that every mock is for something in a mission that is about to start.

        Args:
            mission: The nodes of the mission.

        Raises:
            ConfigError: A mock matches none of them, nor any of an earlier mission, or the skill that it
                matches cannot do what its script says.
        """
        self._chosen.clear()
        nodes = mission.uses()
        for mock in self._mocks:
            if any(mock.pattern.matches(node) for node in nodes):
                self._used.add(mock.pattern.text)
            elif mock.pattern.text not in self._used and not self._may_be_unused(mock):
                raise self._unmatched(mock, mission)
        for node in nodes:
            chosen = self.mock_for(node)
            if chosen is not None:
                self._check_replies(chosen, node)
        self._chosen.clear()

    def mock_for(self, node: NodeRef) -> Mock | None:
        """Return the mock that says most about a node; of equals the one that was added last."""
        if node.path not in self._chosen:
            fitting = [mock for mock in self._mocks if mock.pattern.matches(node)]
            self._chosen[node.path] = max(
                reversed(fitting), key=lambda mock: (not mock.default, *mock.pattern.rank), default=None
            )
        return self._chosen[node.path]

    def start(self, declaration: SkillDeclaration, path: str, inputs: Inputs) -> SkillRun:
        """Begin the run that the mock of a node says.

        Raises:
            MockError: There is no mock for it, or it cannot be; also noted in :attr:`problems`.
        """
        try:
            return self._start(declaration, self._find_node(path), inputs)
        except MockError as error:
            self.problems.append(str(error))
            raise

    def _start(self, declaration: SkillDeclaration, node: NodeRef, inputs: Inputs) -> SkillRun:
        problems = declaration.problems_with(inputs)
        problems += [f"{name} was not filled in" for name in declaration.inputs if name not in inputs]
        if problems:
            raise MockError(f"{node.shown} was started with bad inputs: {'; '.join(problems)}")
        mock = self.mock_for(node)
        if mock is None:
            raise MockError(_how_to_mock(declaration, node))
        call = SkillCall(declaration.name, node, dict(inputs), self._run_id(), self._clock.now())
        mock.asked = True
        answer = _ask(mock, call) if mock.function is not None else self._next(mock, declaration)
        if mock.function is None and answer is None:
            raise MockError(
                f"{node.shown} was started, but the mock {mock.pattern.text!r} has answers for only "
                f"{len(mock.calls)} calls; let its last step have no count, or 'always'"
            )
        self.calls.append(call)
        mock.calls.append(call)
        return self._run(answer, declaration, call)

    def _next(self, mock: Mock, declaration: SkillDeclaration) -> MockReply | None:
        """Return the next step of a script; a skill that reports changes reports when it is over."""
        before, now = mock.until, self._clock.now()
        reply = mock.next(now)
        if declaration.reports_changes and mock.until > max(before, now):
            self._clock.call_at(mock.until, partial(self._report_change, declaration.name))
        return reply

    def watch(self, skill: str, callback: Callable[[], None]) -> Callable[[], None]:
        """Call back when a mock of a skill that reports changes goes to its next step."""
        watch = (skill, callback)
        self._watches.append(watch)
        return partial(self._watches.remove, watch)

    def _report_change(self, skill: str) -> None:
        for name, callback in tuple(self._watches):
            if name == skill:
                callback()

    def _run(self, answer: Any, declaration: SkillDeclaration, call: SkillCall) -> SkillRun:
        def settle(said: Any) -> Step:
            try:
                step = to_step(said, declaration)
                check_outputs(step, call.node, declaration)
            except ConfigError as error:
                raise MockError(f"the mock of {call.path} does what the skill cannot: {error}") from error
            return step

        run: RoutineRun | ScriptedRun
        if isgenerator(answer):
            run = RoutineRun(self._clock, cast(Routine, answer), settle, self.problems, call.path)
        else:
            step = settle(answer)
            if step.error is not None and step.after <= 0.0:
                raise step.error
            run = ScriptedRun(self._clock, step, call.inputs)
        self._watch(call, run)
        return run

    def _watch(self, call: SkillCall, run: RoutineRun | ScriptedRun) -> None:
        """Note the end of a run in its call."""

        def look() -> None:
            call.cancelled = run.cancelled
            if call.ended is None and run.result is not None:
                call.ended, call.result = self._clock.now(), run.result

        run.on_change(look)
        look()

    def _unmatched(self, mock: Mock, mission: MissionMap) -> ConfigError:
        error = unmatched(mock.pattern.text, mission, self._declarations, skills_only=True, what="the mock ")
        if mock.pattern.text in self._declarations:
            more = "defaults(...) for mocks that need not be used"
            return ConfigError(error.problem, valid=[*error.valid, more])
        return error

    def _may_be_unused(self, mock: Mock) -> bool:
        """Tell whether a mock may stay unused: a default whose plain name, if any, is that of a skill."""
        return mock.default and (not mock.pattern.plain or mock.pattern.text in self._declarations)

    def _check_replies(self, mock: Mock, node: NodeRef) -> None:
        if node.skill is None:
            return
        for reply in mock.replies:
            try:
                declaration = self._declarations[node.skill]
                check_outputs(to_step(reply, declaration), node, declaration)
            except ConfigError as error:
                raise ConfigError(
                    f"the mock {mock.pattern.text!r} at {node.shown}: {error.problem}", valid=error.valid
                ) from error


class _MockedSkills(Mapping[str, "MockedSkill"]):
    """A skill for each declaration, made when it is asked for."""

    def __init__(self, board: MockBoard, declarations: Mapping[str, SkillDeclaration]) -> None:
        self._board = board
        self._declarations = declarations
        self._made: dict[str, MockedSkill] = {}

    def __getitem__(self, name: str) -> MockedSkill:
        declaration = self._declarations[name]
        if name not in self._made:
            kind = MockedWakingSkill if declaration.reports_changes else MockedSkill
            self._made[name] = kind(self._board, declaration)
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._declarations)

    def __len__(self) -> int:
        return len(self._declarations)


class MockedSkill:
    """A skill whose runs come from a board."""

    def __init__(self, board: MockBoard, declaration: SkillDeclaration) -> None:
        self._board = board
        self._declaration = declaration

    def start(self, inputs: Inputs) -> SkillRun:
        """Begin a run for a caller that does not say where it stands in the tree."""
        return self.start_at(self._declaration.name, inputs)

    def start_at(self, path: str, inputs: Inputs) -> SkillRun:
        """Begin a run for the node with this path."""
        return self._board.start(self._declaration, path, inputs)


class MockedWakingSkill(MockedSkill):
    """One that reports changes of its answer."""

    def watch(self, inputs: Inputs, callback: Callable[[], None]) -> Callable[[], None]:
        """Call back when the script goes to its next step."""
        return self._board.watch(self._declaration.name, callback)


def _ask(mock: Mock, call: SkillCall) -> Any:
    """Ask the function of a mock for its answer to a call.

    Raises:
        MockError: It raised something: a mistake in the test, as opposed to a skill that ``raises``.
    """
    assert mock.function is not None
    try:
        return mock.function(call.inputs)
    except MockError:
        raise
    except Exception as error:
        raise MockError(broken_function(call.path, error)) from error


def check_outputs(step: Step, node: NodeRef, declaration: SkillDeclaration) -> None:
    """See that a success gives what the mission takes.

    Raises:
        ConfigError: An output is missing.
    """
    if step.result is None or not step.result.succeeded:
        return
    missing = [name for name in node.outputs if name not in step.result.outputs]
    if missing:
        raise ConfigError(
            f"it succeeds without {' and '.join(missing)}, which the mission takes",
            valid=[_success(declaration, node.outputs)],
        )


def _success(declaration: SkillDeclaration, outputs: Iterable[str]) -> str:
    """Write a success that gives some outputs."""
    given = ", ".join(f"{name}={_example(declaration.outputs[name].kind)}" for name in outputs)
    return f"SUCCESS ({given})" if given else "SUCCESS"


def _example(kind: Kind) -> str:
    return "(1 m, 2 m, 90 deg)" if kind is Kind.POSE else example_of(kind)


def _how_to_mock(declaration: SkillDeclaration, node: NodeRef) -> str:
    success = _success(declaration, declaration.outputs)
    example = success if declaration.instant else f"running 3 s, then {success}"
    return (
        f"{node.shown} was started, but {declaration.name} has no mock; give it one:\n"
        f'    in Python: florence.mock("{declaration.name}", "{example}")\n'
        f'    in a scenario, under skills: {declaration.name}: "{example}"'
    )
