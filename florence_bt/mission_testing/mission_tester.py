"""The tester of missions: missions, mocked skills, a clock that is moved by hand, and the real executor."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.mocks.board import Mock, MockBoard, MockError, SkillCall
from florence_bt.mission_testing.mocks.scripts import Script
from florence_bt.mission_testing.mocks.stubs import copied, mocked_missions, put_stubs
from florence_bt.mission_testing.paths import MissionMap, MissionMaps, NodeRef, all_declarations, made_up_node
from florence_bt.mission_testing.record import STATUSES, seconds_text
from florence_bt.mission_testing.test_run import TestRun
from florence_bt.mission_testing.values import read_duration, read_pose
from florence_bt.runtime.events import RunEvent
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import MissionRequest, MissionRun, RunIds, RunStatus, TriggerPolicy
from florence_bt.trees.drawings.ascii import draw_rows
from florence_bt.trees.language.loader import MissionLibrary

__tracebackhide__ = True
"""pytest shows the line of the test that failed, not the lines in here."""

LIMIT = "24 h"
"""Limit of a test's wait for something, in the time of the mission."""
MAX_EVENTS_OF_WAIT = 100_000
"""Events while a test waits for one thing, at most: a wait that never ends is noticed within seconds."""


class MissionTester:
    """Runs missions with mocked skills, in no time.

    Args:
        folders: Mission folders beside the built-in missions; later ones shadow earlier ones.
        declarations: The skills; all that are installed when not given.
        library: Missions that are loaded already, instead of ``folders``.
        maps: Where maps of missions are kept between several stages on the same library.
        scratch: A folder for missions that are given as text.

    Attributes:
        clock: The clock; :meth:`advance` moves it.
        executor: The executor, the same as on a robot.
        runs: Every run so far, in order.
    """

    def __init__(
        self,
        folders: Sequence[Path | str] = (),
        *,
        declarations: Mapping[str, SkillDeclaration] | None = None,
        library: MissionLibrary | None = None,
        maps: MissionMaps | None = None,
        scratch: Path | None = None,
    ) -> None:
        self.clock = ManualClock()
        paths = [Path(folder) for folder in folders]
        self.library = copied(library) if library is not None else MissionLibrary.load(paths)
        known = declarations if declarations is not None else all_declarations()
        self.declarations: Mapping[str, SkillDeclaration] = self.library.with_declared(known)
        self.runs: list[TestRun] = []
        self._maps = maps or MissionMaps()
        self._scratch = scratch
        self._board = MockBoard(self.clock, self.declarations, self._find_node, self._run_id)
        self._by_id: dict[str, TestRun] = {}
        self._early: list[tuple[MissionRun, RunEvent]] = []
        self.executor = Executor(
            self.library,
            self._board.skills(),
            self.declarations,
            self.clock,
            RunIds("test"),
            on_tick=self._on_tick,
        )
        self.executor.add_listener(self._on_event)

    # ---- missions and mocks ---------------------------------------------------------------------------

    def load(self, mission: str | Path) -> str:
        """Make a mission known.

        Args:
            mission: A file (with those beside it that it calls), a folder, a text, or a known mission's name.

        Returns:
            The name of the mission; of a folder its name.

        Raises:
            ConfigError: It cannot be read; the error has the first thing that is wrong with it.
        """
        if isinstance(mission, str) and "\n" in mission:
            return self.load(self._write(mission))
        path = Path(mission)
        if path.is_dir():
            for file in sorted(path.glob("*.yaml")):
                self.library.add_file(file)
            return path.name
        if path.suffix not in (".yaml", ".yml"):
            return self.library.get(str(mission)).name
        self.library.add_file(path)
        self.library.add_neighbours([self.library.get(path.stem)])
        self.mission_map_of(path.stem)
        return path.stem

    def mock(self, pattern: str, script: Script = "SUCCESS") -> Mock:
        """Say what a skill does when a node starts it.

        Args:
            pattern: The name of a skill, or a pattern of paths such as ``approach_user/**/navigate_to``; or
                of a called mission, which is then mocked whole.
            script: A text such as ``running 3 s, then FAILURE 203 twice, then SUCCESS``, a reply
                (``succeed``, ``fail``, ``never``, ``raises``), a list of them, or a function of the inputs.

        Returns:
            The mock, which knows the calls that it answered.

        Raises:
            ConfigError: The script cannot be read, or the skill cannot do that.
        """
        return self._board.add(pattern, script)

    def defaults(self, mocks: Mapping[str, Script] | None = None, /, **more: Script) -> None:
        """Add mocks that are used when none of :meth:`mock` matches; a mission need not use them."""
        for pattern, script in {**(mocks or {}), **more}.items():
            self._board.add(pattern, script, default=True)

    # ---- running --------------------------------------------------------------------------------------

    def start(
        self,
        mission: str | Path,
        inputs: Mapping[str, Any] | None = None,
        /,
        *,
        policy: str = "reject",
        priority: int = 0,
        caller: str = "test",
        **more: Any,
    ) -> TestRun:
        """Trigger a mission as a caller of the robot would, and do what there is to do at this moment.

        Args:
            mission: Its name or its file.
            inputs: Its inputs: texts as in a mission file, or values in SI units.
            policy: What to do when another mission runs: reject, queue or preempt.
            priority: A higher number goes before a lower one.
            caller: Who asks.
            **more: Inputs too.

        Raises:
            ConfigError: No such mission, an error in it, bad inputs, or a mock that fits nothing in it.
            RequestRefused: Another mission runs, or triggers are blocked.
            MockError: The mission started a skill without a mock.
        """
        name = self.load(mission)
        wanted = _policy(policy)
        self._mock_missions(name)
        mission_map = self.mission_map_of(name)
        self._board.check_patterns(mission_map)
        given = self._readable(name, {**(inputs or {}), **more})
        run = self.executor.trigger(MissionRequest(name, given, caller, wanted, priority))
        test_run = TestRun(
            run,
            mission_map,
            self.declarations,
            self._board.calls,
            lambda run: draw_rows(self.executor.nodes_of(run)) or run.tree,
            self._board.unused,
        )
        self.runs.append(test_run)
        self._by_id[run.run_id] = test_run
        early, self._early = self._early, []
        for waiting_run, event in early:
            self._on_event(waiting_run, event)
        self.settle()
        return test_run

    def run(self, mission: str | Path, inputs: Mapping[str, Any] | None = None, /, **more: Any) -> TestRun:
        """Trigger a mission and let it run to its end; arguments as of :meth:`start`."""
        test_run = self.start(mission, inputs, **more)
        self.run_until_done(test_run)
        return test_run

    @property
    def last_run(self) -> TestRun:
        """The run that was triggered last.

        Raises:
            AssertionError: There is none yet.
        """
        if not self.runs:
            raise AssertionError("no mission was started yet; florence.start('goto_user') starts one")
        return self.runs[-1]

    @property
    def calls(self) -> list[SkillCall]:
        """Every start of a mocked skill in any run, in order."""
        return list(self._board.calls)

    @property
    def now(self) -> float:
        """Seconds since the beginning of the test."""
        return self.clock.now()

    def settle(self) -> None:
        """Do what there is to do at this moment.

        Raises:
            MockError: A mission did with a skill what the test does not provide for.
        """
        self._go_to(self.clock.now())

    def advance(self, duration: float | str) -> None:
        """Let time pass: ``"3 s"``, or seconds.

        Raises:
            MockError: A mission did with a skill what the test does not provide for.
        """
        self._go_to(self.clock.now() + read_duration(duration))

    def run_until_done(self, test_run: TestRun | None = None, *, limit: float | str = LIMIT) -> TestRun:
        """Let time pass until a run has ended, the last one when not given.

        Raises:
            AssertionError: It does not end by itself, or not within the limit.
        """
        wanted = test_run or self.last_run
        self._wait(lambda: wanted.done, wanted, "does not end", limit)
        return wanted

    def run_until(
        self,
        what: str | Callable[[], object],
        status: str = "RUNNING",
        *,
        test_run: TestRun | None = None,
        limit: float | str = LIMIT,
    ) -> TestRun:
        """Let time pass until a node has a status, or until a function says so.

        Args:
            what: A pattern of nodes, or a function that is asked after everything that happens.
            status: RUNNING, SUCCESS, FAILURE or INVALID.
            test_run: The run, the last one when not given.
            limit: How long at most.

        Raises:
            ConfigError: The pattern matches no node; the error lists the closest ones.
            AssertionError: It did not come to that.
        """
        wanted = test_run or self.last_run
        if callable(what):
            self._wait(lambda: bool(what()), wanted, "did not reach what was waited for", limit)
            return wanted
        if status.upper() not in STATUSES:
            raise ConfigError(f"{status!r} is not a status of a node", valid=STATUSES)
        paths = [place.path for place in wanted.check_pattern(what)]
        statuses = wanted.record.statuses

        def reached() -> bool:
            return any(statuses.get(path) == status.upper() for path in paths)

        self._wait(reached, wanted, f"ended before {what!r} was {status.upper()}", limit)
        return wanted

    # ---- what people do during a run ---------------------------------------------------------------------

    def stop(self, reason: str = "requested by the test", test_run: TestRun | None = None) -> None:
        """Stop a run, the current one when not given."""
        self.executor.stop(reason, test_run.run.run_id if test_run else None)
        self.settle()

    def pause(self, reason: str = "requested by the test") -> None:
        """Pause the current run."""
        self.executor.pause(reason)
        self.settle()

    def resume(self) -> None:
        """Go on with the paused run."""
        self.executor.resume()
        self.settle()

    def override(self, reason: str = "requested by the test") -> None:
        """Stop everything and let nothing start, as the manual override does."""
        self.executor.override(reason)
        self.settle()

    def release(self) -> None:
        """End the manual override."""
        self.executor.release()
        self.settle()

    # ---- inside ---------------------------------------------------------------------------------------

    def mission_map_of(self, mission: str) -> MissionMap:
        """Return the nodes of a mission.

        Raises:
            ConfigError: There is no such mission, or it has errors.
        """
        return self._maps.of(self.library.get(mission), self.library, self.declarations)

    def check_mocks(self) -> None:
        """See that no call of a skill went unanswered.

        Raises:
            MockError: One did.
        """
        if self._board.problems:
            tree = self.runs[-1].report() if self.runs else ""
            raise MockError(f"{self._board.problems[0]}\n\n{tree}".rstrip())

    def _mock_missions(self, mission: str) -> None:
        """Put stubs for the called missions that mocks name."""
        mocked = mocked_missions(self._board.patterns(), self.mission_map_of(mission), self.declarations)
        if mocked:
            put_stubs(mocked, self.library, self.declarations)
            self._maps = MissionMaps()

    def _readable(self, mission: str, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Return the inputs with poses in every form of tests; what is wrong with them is reported later."""
        ports = self.library.get(mission).inputs
        given = dict(inputs)
        for name, value in inputs.items():
            if name in ports and ports[name].kind is Kind.POSE:
                with contextlib.suppress(ConfigError):
                    given[name] = read_pose(value)
        return given

    def _go_to(self, when: float) -> None:
        for _ in range(MAX_EVENTS_OF_WAIT):
            self.check_mocks()
            due = self.clock.next_time()
            if due is None or due > when:
                self.clock.advance_to(when)
                return
            self.clock.run_next()
        raise AssertionError(f"more than {MAX_EVENTS_OF_WAIT} events before {seconds_text(when)}")

    def _wait(self, done: Callable[[], bool], test_run: TestRun, problem: str, limit: float | str) -> None:
        end = self.clock.now() + read_duration(limit, "a limit")
        for _ in range(MAX_EVENTS_OF_WAIT):
            self.check_mocks()
            if done():
                self.settle()
                return
            due = self.clock.next_time()
            if due is None or test_run.done:
                test_run.fail(f"{test_run.run.mission} {problem}{self._hint(test_run)}")
            if due > end:
                self.clock.advance_to(end)
                test_run.fail(f"{test_run.run.mission} {problem} within {limit}")
            self.clock.run_next()
        test_run.fail(f"{test_run.run.mission} {problem}, and more than {MAX_EVENTS_OF_WAIT} events")

    def _hint(self, test_run: TestRun) -> str:
        if test_run.run.status is RunStatus.PAUSED:
            return ": it is paused; resume() lets it go on"
        waiting = [call.node.short for call in test_run.calls() if call.ended is None]
        if waiting:
            return f": nothing more will happen: {' and '.join(waiting)} never end by themselves"
        return "" if test_run.done else ": nothing more will happen"

    def _find_node(self, path: str) -> NodeRef:
        test_run = self._by_id.get(self._run_id())
        return test_run.mission_map.find(path) if test_run is not None else made_up_node(path)

    def _run_id(self) -> str:
        run = self.executor.current
        return run.run_id if run is not None else ""

    def _on_tick(self, run: MissionRun) -> None:
        test_run = self._by_id.get(run.run_id)
        if test_run is not None and test_run.key_store is None:
            test_run.key_store = self.executor.keys()

    def _on_event(self, run: MissionRun, event: RunEvent) -> None:
        test_run = self._by_id.get(run.run_id)
        if test_run is None:
            # Inside the trigger, before the run is known here.
            self._early.append((run, event))
        else:
            test_run.record.note(event, run.ticks)

    def _write(self, text: str) -> Path:
        match = re.search(r"^mission:\s*([a-z][a-z0-9_]*)\s*(#.*)?$", text, re.MULTILINE)
        if match is None:
            raise ConfigError("the text of a mission needs its name", valid=["mission: my_mission"])
        if self._scratch is None:
            raise ConfigError("a stage without a scratch folder takes no texts", valid=["a file"])
        path = self._scratch / f"{match[1]}.yaml"
        path.write_text(text, encoding="utf-8")
        return path


def _policy(name: str) -> TriggerPolicy:
    policies = [policy.value for policy in TriggerPolicy]
    if name not in policies:
        raise ConfigError(f"there is no policy {name!r}", valid=policies)
    return TriggerPolicy(name)
