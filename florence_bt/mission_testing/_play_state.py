"""One run of a mission in a test: where it stands and what it did."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn

from florence_bt.behaviours.keys import KeyStore
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.mocks.board import Call
from florence_bt.mission_testing.paths import MissionMap, Place, matching, read_pattern
from florence_bt.mission_testing.record import INVALID, Change, Record, seconds_text, trace_text
from florence_bt.mission_testing.unmatched import unmatched
from florence_bt.mission_testing.values import read_kind, same
from florence_bt.runtime.run import MissionRun, RunStatus
from florence_bt.trees.language.quantities import format_value

__tracebackhide__ = True
"""pytest shows the line of the test that failed, not the lines in here."""


class Unmet(AssertionError):
    """Something that a test expects does not hold.

    Attributes:
        problem: What, in a sentence or a few lines.
        report: The tree, the calls and what broke.
    """

    def __init__(self, problem: str, report: str) -> None:
        self.problem = problem
        self.report = report
        super().__init__(f"{problem}\n\n{report}")


class PlayState:
    """One run of a mission, without the assertions.

    Attributes:
        run: The run as the executor keeps it.
        places: The nodes of the mission.
        record: What the nodes did.
        unused: Tells the mocks that answered no call, for the report.
    """

    def __init__(
        self,
        run: MissionRun,
        places: MissionMap,
        declarations: Mapping[str, SkillDeclaration],
        all_calls: Sequence[Call],
        render: Callable[[MissionRun], str],
    ) -> None:
        self.run = run
        self.places = places
        self.record = Record(places)
        self.key_store: KeyStore | None = None
        self.unused: Callable[[], Sequence[str]] = tuple
        self._declarations = declarations
        self._all_calls = all_calls
        self._render = render

    # ---- where it stands ------------------------------------------------------------------------------

    @property
    def status(self) -> str:
        """QUEUED, RUNNING, PAUSED, ENDING, SUCCEEDED, FAILED or STOPPED."""
        return self.run.status.value

    @property
    def done(self) -> bool:
        """Whether nothing can change any more."""
        return self.run.status.final

    @property
    def succeeded(self) -> bool:
        """Whether it ended well."""
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
        return self.places.find(self.run.why.path).shown if self.run.why else ""

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
        """When it started, on the test's clock; 0 before."""
        return self.run.started or 0.0

    @property
    def tree(self) -> str:
        """The tree as ASCII text; of an ended run as it stood at the end."""
        return self._render(self.run)

    # ---- what it did ----------------------------------------------------------------------------------

    def trace(self, pattern: str = "**", *, inner: bool = False) -> str:
        """What the nodes did, a line for each change of a status: ``4.2 s  look_for_user: SUCCESS``.

        Args:
            pattern: Which nodes.
            inner: Whether to show nodes with others below too, not only leaves.
        """
        return trace_text(self.changes(pattern, inner=inner))

    def changes(self, pattern: str = "**", *, inner: bool = False) -> list[Change]:
        """The changes that the lines of a trace are about; arguments as of :meth:`trace`."""
        read = read_pattern(pattern)
        return [
            change
            for change in self.record.changes()
            if (inner or change.place.leaf) and change.new != INVALID and read.matches(change.place)
        ]

    def calls(self, pattern: str = "**") -> list[Call]:
        """The starts of skills by nodes that a pattern means, in order."""
        read = read_pattern(pattern)
        return [c for c in self._all_calls if c.run_id == self.run.run_id and read.matches(c.place)]

    def inputs(self, pattern: str = "**") -> list[dict[str, Any]]:
        """The inputs of those calls, in SI units."""
        return [dict(call.inputs) for call in self.calls(pattern)]

    @property
    def order(self) -> list[str]:
        """The names of the skills in the order of their starts."""
        return [call.skill for call in self.calls()]

    # ---- helpers --------------------------------------------------------------------------------------

    def check_pattern(self, pattern: str) -> list[Place]:
        """The nodes that a pattern means.

        Raises:
            ConfigError: It means none; the error lists the closest ones.
        """
        places = self.places.places.values()
        found = matching(pattern, places)
        if not found and pattern not in self._declarations:
            raise unmatched(pattern, self.places, self._declarations, skills_only=False)
        return found

    def fits(self, call: Call, wanted: Mapping[str, Any]) -> bool:
        """Whether a call has these inputs (others may be there beside).

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

    def call_text(self, call: Call) -> str:
        """One line about a call."""
        ports = self._declarations[call.skill].inputs
        inputs = ", ".join(f"{n}={format_value(v, ports[n].kind)}" for n, v in call.inputs.items())
        end = "still runs"
        if call.ended is not None and call.result is not None:
            code = call.result.code if not call.result.succeeded else "ok"
            end = f"{code} after {seconds_text(call.ended - call.started)}"
        start = seconds_text(call.started - self.started)
        skill = "" if call.place.short.split(" (")[0].endswith(call.skill) else f": {call.skill}"
        return f"{start:>10}  {call.place.short}{skill}({inputs}): {end}"

    def report(self) -> str:
        """The tree, the calls and what broke, for messages."""
        calls = "\n".join(self.call_text(call) for call in self.calls()) or "      none"
        broken = "".join(f"\n\nan exception came out of the tree:\n{text}" for text in self.record.broken)
        tree = "\n".join(visited(self.tree)) or "(no node was reached)"
        unused = ", ".join(self.unused())
        unused = f"\n\nmocks that answered no call: {unused}" if unused else ""
        return f"{tree}\n\ncalls of skills:\n{calls}{unused}{broken}"

    def fail(self, problem: str) -> NoReturn:
        """Fail the test with a problem, the tree and the calls.

        Raises:
            Unmet: Always.
        """
        raise Unmet(problem, self.report())


def visited(tree: str) -> list[str]:
    """The lines of a dump without the nodes that were not reached."""
    return [line.rstrip() for line in tree.splitlines() if not line.lstrip().startswith("[ ]")]
