"""One run of a mission in a test: where it stands, what it did, and what a test may assert about it."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, NoReturn, Self

from florence_bt.behaviours.keys import KeyStore, readable
from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.mocks.board import SkillCall
from florence_bt.mission_testing.paths import MissionMap, NodeRef, matching, read_pattern, unmatched
from florence_bt.mission_testing.record import (
    INVALID,
    NodeRecord,
    StatusChange,
    aligned,
    read_line,
    same_trace,
    seconds_text,
    trace_text,
)
from florence_bt.mission_testing.values import expected_like, read_duration, read_kind, same
from florence_bt.runtime.run import MissionRun, RunStatus
from florence_bt.trees.language.quantities import format_value

__tracebackhide__ = True
"""pytest shows the line of the test that failed, not the lines in here."""


class ExpectationFailed(AssertionError):
    """Something that a test expects does not hold.

    Attributes:
        problem: What, in a sentence or a few lines.
        report: The tree, the calls and what broke.
    """

    def __init__(self, problem: str, report: str) -> None:
        self.problem = problem
        self.report = report
        super().__init__(f"{problem}\n\n{report}")


class TestRun:
    """One run of a mission, made by a ``MissionTester``, which also moves the time.

    Each assertion returns the run, so that they can be written in a row, and raises an AssertionError with
    the tree and the calls when it does not hold.

    Attributes:
        run: The run as the executor keeps it.
        mission_map: The nodes of the mission.
        record: What the nodes did.
        key_store: The keys of the run, from its first tick on.
    """

    __test__: ClassVar = False
    """Not a class of tests for pytest, whatever its name begins with."""

    def __init__(
        self,
        run: MissionRun,
        mission_map: MissionMap,
        declarations: Mapping[str, SkillDeclaration],
        all_calls: Sequence[SkillCall],
        render: Callable[[MissionRun], str],
        unused_mocks: Callable[[], Sequence[str]],
    ) -> None:
        self.run = run
        self.mission_map = mission_map
        self.record = NodeRecord(mission_map)
        self.key_store: KeyStore | None = None
        self._declarations = declarations
        self._all_calls = all_calls
        self._render = render
        self._unused_mocks = unused_mocks

    # ---- where it stands ------------------------------------------------------------------------------

    @property
    def status(self) -> str:
        """QUEUED, RUNNING, PAUSED, ENDING, SUCCEEDED, FAILED or STOPPED."""
        return self.run.status.value

    @property
    def done(self) -> bool:
        """Tell whether nothing can change any more."""
        return self.run.status.final

    @property
    def succeeded(self) -> bool:
        """Tell whether it ended well."""
        return self.run.status is RunStatus.SUCCEEDED

    @property
    def code(self) -> str:
        """The short code of the end, ``ok`` after success, empty while it runs."""
        return self.run.code

    @property
    def reason(self) -> str:
        """The reason of a failure or a stop."""
        return self.run.reason

    @property
    def leaf(self) -> str:
        """The path of the node that caused a failure."""
        return self.mission_map.find(self.run.why.path).shown if self.run.why else ""

    @property
    def outputs(self) -> dict[str, Any]:
        """The outputs of the mission, in SI units."""
        return dict(self.run.outputs)

    @property
    def keys(self) -> dict[str, Any]:
        """The keys of the mission (not of those it calls) and their values, in SI units."""
        return self.key_store.as_dict() if self.key_store is not None else {}

    @property
    def duration(self) -> float | None:
        """Seconds from the start to the end, None before the end."""
        if self.run.started is None or self.run.ended is None:
            return None
        return self.run.ended - self.run.started

    @property
    def started(self) -> float:
        """Return the time at which it started, on the test's clock; 0 before."""
        return self.run.started or 0.0

    @property
    def tree(self) -> str:
        """The tree as ASCII text; of an ended run as it stood at the end."""
        return self._render(self.run)

    # ---- what it did ----------------------------------------------------------------------------------

    def trace(self, pattern: str = "**", *, inner: bool = False) -> str:
        """Show what the nodes did, a line for each change of a status: ``4.2 s  look_for_user: SUCCESS``.

        Args:
            pattern: Which nodes.
            inner: Whether to show nodes with others below too, not only leaves.
        """
        return trace_text(self.changes(pattern, inner=inner))

    def changes(self, pattern: str = "**", *, inner: bool = False) -> list[StatusChange]:
        """Return the changes that the lines of a trace are about; arguments as of :meth:`trace`."""
        read = read_pattern(pattern)
        return [
            change
            for change in self.record.changes()
            if (inner or change.node.leaf) and change.new != INVALID and read.matches(change.node)
        ]

    def calls(self, pattern: str = "**") -> list[SkillCall]:
        """Return the starts of skills by nodes that a pattern means, in order."""
        read = read_pattern(pattern)
        return [c for c in self._all_calls if c.run_id == self.run.run_id and read.matches(c.node)]

    def inputs(self, pattern: str = "**") -> list[dict[str, Any]]:
        """Return the inputs of those calls, in SI units."""
        return [dict(call.inputs) for call in self.calls(pattern)]

    @property
    def order(self) -> list[str]:
        """The names of the skills in the order of their starts."""
        return [call.skill for call in self.calls()]

    # ---- what a test expects of it --------------------------------------------------------------------

    def assert_status(self, status: str) -> Self:
        """Assert that the run has this status."""
        wanted = status.upper()
        if wanted not in RunStatus.__members__:
            raise ConfigError(f"{status!r} is not a status of a run", valid=RunStatus.__members__)
        if self.status != wanted:
            self.fail(f"{self.run.mission} is {self._state_text()}, not {wanted}")
        return self

    def assert_succeeded(self, **outputs: Any) -> Self:
        """Assert that the run ended well, with these outputs among its outputs."""
        self.assert_status("SUCCEEDED")
        return self.assert_outputs(outputs)

    def assert_failed(
        self, code: str | None = None, reason: str | None = None, leaf: str | None = None
    ) -> Self:
        """Assert that the run failed.

        Args:
            code: With this code.
            reason: With a reason that contains this.
            leaf: Because of the node that this pattern means.
        """
        self.assert_status("FAILED")
        return self.assert_why(code, reason, leaf)

    def assert_stopped(self, reason: str | None = None) -> Self:
        """Assert that the run was stopped, with a reason that contains this."""
        self.assert_status("STOPPED")
        return self.assert_why(reason=reason)

    def assert_why(self, code: str | None = None, reason: str | None = None, leaf: str | None = None) -> Self:
        """Assert that the cause of the end is this; arguments as of :meth:`assert_failed`."""
        if code is not None and self.code != code:
            reason = f"; the reason: {self.reason}" if self.reason else ""
            self.fail(f"the code is {self.code!r}, not {code!r}{reason}")
        if reason is not None and reason not in self.reason:
            self.fail(f"the reason does not contain {reason!r}; it is: {self.reason!r}")
        if leaf is not None:
            self.check_pattern(leaf)
            path = self.run.why.path if self.run.why else ""
            if not path or not read_pattern(leaf).matches(self.mission_map.find(path)):
                self.fail(f"the cause is not {leaf!r} but {self.leaf or 'nothing at all'}")
        return self

    def assert_outputs(self, outputs: Mapping[str, Any]) -> Self:
        """Assert that the mission gave these outputs; texts are read with their units."""
        kinds = {name: port.kind for name, port in self.mission_map.outputs.items()}
        return self._assert_values("output", outputs, self.outputs, kinds)

    def assert_keys(self, keys: Mapping[str, Any]) -> Self:
        """Assert that the keys of the mission have these values; texts are read with their units."""
        return self._assert_values("key", keys, self.keys, self.mission_map.outcomes.kinds)

    def assert_called(
        self,
        pattern: str,
        /,
        *,
        times: int | None = None,
        inputs: Mapping[str, Any] | None = None,
        **more: Any,
    ) -> Self:
        """Assert that a skill was started.

        Args:
            pattern: The skill, or the nodes that start it.
            times: How often exactly; at least once when not given.
            inputs: Only calls with these inputs (others may be there beside) count; texts have units.
            **more: Inputs too.
        """
        self.check_pattern(pattern)
        wanted = {**(inputs or {}), **more}
        calls = self.calls(pattern)
        fitting = [call for call in calls if self.fits(call, wanted)]
        if not fitting if times is None else len(fitting) != times:
            what = f"{pattern!r}{f' with {_inputs_text(wanted)}' if wanted else ''}"
            want = "at least once" if times is None else _times(times)
            others = f" ({_times(len(calls))} in all)" if wanted else ""
            self.fail(f"{what} was started {_times(len(fitting))}{others}, not {want}")
        return self

    def assert_not_called(self, *patterns: str) -> Self:
        """Assert that none of these skills or nodes was started."""
        for pattern in patterns:
            self.assert_called(pattern, times=0)
        return self

    def assert_order(self, *patterns: str) -> Self:
        """Assert that calls of these skills or nodes came in this order; others may have come between."""
        return self.assert_calls(patterns)

    def assert_calls(
        self, wanted: Sequence[str | tuple[str, Mapping[str, Any]]], *, only: bool = False
    ) -> Self:
        """Assert that calls came in this order.

        Args:
            wanted: Patterns, or patterns with inputs.
            only: Whether no others may have come before, between or after.
        """
        calls, number = self.calls(), 0
        for item in wanted:
            pattern, inputs = (item, {}) if isinstance(item, str) else item
            self.check_pattern(pattern)
            found = self._find_call(calls, number, pattern, inputs, only)
            if found is None:
                what = f"{pattern!r}{f' with {_inputs_text(inputs)}' if inputs else ''}"
                self.fail(f"{what} was not called {self._place_in_order(calls, number, only)}")
            number = found + 1
        if only and number < len(calls):
            self.fail(f"a further call came: {self.call_text(calls[number]).strip()}")
        return self

    def assert_tree(self, expected: str) -> Self:
        """Assert that the ASCII text of the tree is this. When no line of it is marked ``[ ]``, nodes that
        were not reached are left out of the comparison.
        """
        wanted = _lines(expected)
        whole = any(line.lstrip().startswith("[ ]") for line in wanted)
        return self._assert_text("tree", wanted, _lines(self.tree) if whole else _visited(self.tree))

    def assert_trace(self, expected: str, pattern: str = "**", *, inner: bool = False) -> Self:
        """Assert that the trace is this; arguments as of :meth:`trace`. Its lines may name nodes by patterns.

        Raises:
            ConfigError: A line is not a line of a trace, or names no node of the mission.
        """
        wanted = [read_line(line) for line in _lines(expected) if line.strip()]
        for line in wanted:
            self.check_pattern(line.node)
        actual = self.changes(pattern, inner=inner)
        if same_trace(wanted, actual):
            return self
        nodes = self.mission_map.nodes.values()
        return self._assert_text("trace", aligned(wanted, actual, nodes), [str(each) for each in actual])

    def assert_duration(self, duration: float | str, *, at_most: bool = False) -> Self:
        """Assert that the run took this long (seconds, or e.g. ``3 s``), to the millisecond, or at most."""
        seconds = read_duration(duration)
        if self.duration is None:
            self.fail(f"{self.run.mission} has not ended")
        slack = self.duration - seconds
        if slack > 1e-3 or (slack < -1e-3 and not at_most):
            want = f"{'at most ' if at_most else ''}{seconds_text(seconds)}"
            self.fail(f"{self.run.mission} took {seconds_text(self.duration)}, not {want}")
        return self

    def _find_call(
        self, calls: list[SkillCall], start: int, pattern: str, inputs: Mapping[str, Any], only: bool
    ) -> int | None:
        """Return the number of the next call that fits; the very next one when there may be no others."""
        read = read_pattern(pattern)
        for number in range(start, min(len(calls), start + 1) if only else len(calls)):
            if read.matches(calls[number].node) and self.fits(calls[number], inputs):
                return number
        return None

    def _place_in_order(self, calls: list[SkillCall], number: int, only: bool) -> str:
        if only and number < len(calls):
            return f"as number {number + 1}, but {self.call_text(calls[number]).strip()}"
        return f"after {calls[number - 1].node.short}" if number else "at all"

    def _state_text(self) -> str:
        why = f": {self.reason} [{self.code}] at {self.leaf}" if self.run.why else ""
        return f"{self.status}{why}"

    def _assert_values(
        self, what: str, wanted: Mapping[str, Any], actual: Mapping[str, Any], kinds: Mapping[str, Kind]
    ) -> Self:
        for name, value in wanted.items():
            kind = kinds.get(name)
            try:
                read = value if kind is None else read_kind(value, kind)
                if name in actual and kind is None:
                    read = expected_like(value, actual[name])
            except ConfigError as error:
                raise ConfigError(f"the {what} {name!r}: {error.problem}", valid=error.valid) from error
            if name not in actual:
                known = ", ".join(actual) or "none"
                why = (
                    f"; a mission that is {self.status} gives no outputs"
                    if what == "output" and not actual
                    else ""
                )
                self.fail(f"there is no {what} {name!r} (there are: {known}{why})")
            elif not same(read, actual[name]):
                is_, not_ = (_shown(each, kind) for each in (actual[name], read))
                self.fail(f"the {what} {name} is {is_}, not {not_}")
        return self

    def _assert_text(self, what: str, wanted: list[str], actual: list[str]) -> Self:
        if wanted != actual:
            difference = "\n".join(difflib.unified_diff(wanted, actual, "expected", "was", lineterm="", n=2))
            text = "\n".join(actual)
            self.fail(f"the {what} differs:\n{difference}\n\nthe whole {what}, as it was:\n{text}")
        return self

    # ---- helpers --------------------------------------------------------------------------------------

    def check_pattern(self, pattern: str) -> list[NodeRef]:
        """Return the nodes that a pattern means.

        Raises:
            ConfigError: It means none; the error lists the closest ones.
        """
        nodes = self.mission_map.nodes.values()
        found = matching(pattern, nodes)
        if not found and pattern not in self._declarations:
            raise unmatched(pattern, self.mission_map, self._declarations, skills_only=False)
        return found

    def fits(self, call: SkillCall, wanted: Mapping[str, Any]) -> bool:
        """Tell whether a call has these inputs (others may be there beside).

        Raises:
            ConfigError: The skill has no such input, or the value is of another kind.
        """
        ports = self._declarations[call.skill].inputs
        for name, value in wanted.items():
            if name not in ports:
                raise ConfigError(f"{call.skill} has no input {name!r}", valid=list(ports))
            if not same(read_kind(value, ports[name].kind), call.inputs[name]):
                return False
        return True

    def call_text(self, call: SkillCall) -> str:
        """Write one line about a call."""
        ports = self._declarations[call.skill].inputs
        inputs = ", ".join(f"{n}={format_value(v, ports[n].kind)}" for n, v in call.inputs.items())
        end = "still runs"
        if call.ended is not None and call.result is not None:
            code = call.result.code if not call.result.succeeded else "ok"
            end = f"{code} after {seconds_text(call.ended - call.started)}"
        start = seconds_text(call.started - self.started)
        skill = "" if call.node.short.split(" (")[0].endswith(call.skill) else f": {call.skill}"
        return f"{start:>10}  {call.node.short}{skill}({inputs}): {end}"

    def report(self) -> str:
        """Write the tree, the calls and what broke, for messages."""
        calls = "\n".join(_shortened([self.call_text(call) for call in self.calls()])) or "      none"
        broken = "".join(f"\n\nan exception came out of the tree:\n{text}" for text in self.record.broken)
        tree = "\n".join(_visited(self.tree)) or "(no node was reached)"
        unused = ", ".join(self._unused_mocks())
        unused = f"\n\nmocks that answered no call: {unused}" if unused else ""
        return f"{tree}\n\ncalls of skills:\n{calls}{unused}{broken}"

    def fail(self, problem: str) -> NoReturn:
        """Fail the test with a problem, the tree and the calls.

        Raises:
            ExpectationFailed: Always.
        """
        raise ExpectationFailed(problem, self.report())


MOST_CALLS = 40
"""Calls that a report shows at most: a mission that repeats something has thousands."""


def _shortened(calls: list[str]) -> list[str]:
    """Leave out what is in the middle of a long list."""
    if len(calls) <= MOST_CALLS:
        return calls
    half = MOST_CALLS // 2
    return [*calls[:half], f"{'...':>10}  {len(calls) - 2 * half} more calls", *calls[-half:]]


def _visited(tree: str) -> list[str]:
    """Return the lines of a dump without the nodes that were not reached."""
    return [line.rstrip() for line in tree.splitlines() if not line.lstrip().startswith("[ ]")]


def _shown(value: Any, kind: Kind | None) -> str:
    return format_value(value, kind) if kind is not None else readable(value)


def _times(number: int) -> str:
    return {0: "never", 1: "once", 2: "twice"}.get(number, f"{number} times")


def _inputs_text(inputs: Mapping[str, Any]) -> str:
    return ", ".join(f"{name}={readable(value)}" for name, value in inputs.items())


def _lines(text: str) -> list[str]:
    """Return the lines of an expected text without blank ones at its ends."""
    return [line.rstrip() for line in text.strip("\n").rstrip().splitlines()]
