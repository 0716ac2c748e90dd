"""The processes that work for the editor, as the server of the page has them: bounded, and ended with it."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from florence_bt.app.bringup.parent import child_command
from florence_bt.core.errors import ConfigError, DeviceTimeout, FlorenceError
from florence_bt.core.text_files import MAX_MISSION_BYTES
from florence_page.parts import LiveParts

if TYPE_CHECKING:
    from florence_page.editor.trial_request import TrialRequest

TEXT_LOOK_LIMIT_S = 30.0
"""Longest that a look at a text may take; with nothing else to do it is under a second."""
SCENARIOS_S = 120.0
"""Longest that the scenarios of a mission may take."""
VERIFICATION_S = 600.0
"""Longest that a mission may be verified, with those that it calls."""
STOP_S = 10.0
"""Longest that a mission in the rig may take to end when it is stopped."""
START_S = 180.0
"""Longest until the rig shows something: the first time its hot loops are compiled."""
_LONGEST_LINE = 32_000_000
_PACKAGE = "florence_page.editor"


async def _start(module: str, *arguments: str, **more: Any) -> asyncio.subprocess.Process:
    """Start a program of ours.

    Raises:
        FlorenceError: The machine has no room for it.
    """
    try:
        return await asyncio.create_subprocess_exec(
            *child_command(module, *arguments),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            limit=_LONGEST_LINE,
            **more,
        )
    except OSError as error:
        raise FlorenceError(f"a process cannot be started: {error.strerror}") from error


async def _end(process: asyncio.subprocess.Process) -> None:
    with contextlib.suppress(ProcessLookupError):
        process.kill()
    await process.wait()


class Worker:
    """A process that looks at texts; the next question starts another when one took too long.

    Args:
        limit_s: Longest that an answer may take.
    """

    def __init__(self, limit_s: float = TEXT_LOOK_LIMIT_S) -> None:
        self._limit_s = limit_s
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()

    async def ask(
        self, what: str, folders: Sequence[Path], hotspots: Path | None, **more: Any
    ) -> dict[str, Any]:
        """Ask the process; see :func:`florence_page.editor.worker.answer`.

        Raises:
            DeviceTimeout: It took too long.
            FlorenceError: It cannot answer.
        """
        question = {
            "what": what,
            "folders": [str(folder) for folder in folders],
            "hotspots": str(hotspots or ""),
            **more,
        }
        async with self._turn:
            try:
                answer = await asyncio.wait_for(self._answer(question), self._limit_s)
            except TimeoutError as error:
                raise DeviceTimeout(
                    f"looking at this took more than {self._limit_s:g} s and was given up"
                ) from error
            except (ConnectionError, ValueError) as error:
                raise FlorenceError(
                    "what looks at texts broke down; the next change tries it again"
                ) from error
        if "problem" in answer:
            raise FlorenceError(answer["problem"])
        return answer

    async def _answer(self, question: dict[str, Any]) -> dict[str, Any]:
        if self._process is None or self._process.returncode is not None:
            self._process = await _start(f"{_PACKAGE}.worker")
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(json.dumps(question).encode() + b"\n")
            await process.stdin.drain()
            answer: dict[str, Any] = json.loads(await process.stdout.readline())
        except BaseException:
            # Also when nobody waits any more: the answer in the pipe would be taken for the next one.
            await self._close()
            raise
        return answer

    async def _close(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            await _end(process)

    async def close(self) -> None:
        """End the process."""
        await self._close()


class Trials:
    """The rig of the page: one mission at a time, for all who look.

    Attributes:
        parts: What viewers are sent.
        picture: The map as a PNG; empty before the first trial.
        last: How the last one ended: as ``Trial.run`` says, or ``problem``; None while one runs, and before
            the first.
        seen: Whether the one that runs has shown something.
    """

    def __init__(self) -> None:
        self.parts = LiveParts()
        self.picture = b""
        self.last: dict[str, Any] | None = None
        self.seen = False
        self._stopping = False
        self._process: asyncio.subprocess.Process | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def running(self) -> bool:
        """Tell whether one runs."""
        return self._task is not None and not self._task.done()

    async def start(self, request: TrialRequest) -> None:
        """Start one.

        Raises:
            FlorenceError: Another one runs.
        """
        if self.running:
            raise FlorenceError("a mission runs in the rig already: wait for its end, or stop it")
        self.last, self.seen, self._stopping = None, False, False
        self.parts.put(
            "run", {"mission": request.name, "state": "PENDING", "code": "", "reason": "", "run_id": ""}
        )
        for name, nothing in (
            ("tree", []),
            ("plan", []),
            ("scene", {"pose": None, "scan": [], "people": []}),
        ):
            self.parts.put(name, nothing)
        self._task = asyncio.create_task(self._serve(request))

    async def _serve(self, request: TrialRequest) -> None:
        try:
            # Its folder is ours: it is gone with the process, however that ends.
            with tempfile.TemporaryDirectory(prefix="florence_trial_") as folder:
                await self._play(request, folder)
        except (FlorenceError, OSError, ValueError) as error:
            broken = "the rig broke down; the terminal of the page says more"
            why = str(error) if isinstance(error, FlorenceError) else broken
            self.last = {"problem": "it was stopped" if self._stopping else why}
        if self.last is not None and "problem" in self.last:
            self.parts.put(
                "run", {"mission": request.name, "state": "ABORTED", "reason": self.last["problem"]}
            )

    async def _play(self, request: TrialRequest, folder: str) -> None:
        self._process = process = await _start(f"{_PACKAGE}.trial", folder)
        assert process.stdin is not None and process.stdout is not None
        try:
            process.stdin.write(json.dumps(asdict(request)).encode() + b"\n")
            await process.stdin.drain()
            while self.last is None:
                line = await asyncio.wait_for(process.stdout.readline(), START_S)
                if not line:
                    raise ConnectionError
                self._take(json.loads(line))
        finally:
            await _end(process)
            self._process = None

    def _take(self, news: dict[str, Any]) -> None:
        if "over" in news or "problem" in news:
            self.last = news.get("over") or news
            return
        if "picture" in news:
            self.picture = base64.b64decode(news.pop("picture"))
        self.seen = True
        for name, value in news.items():
            self.parts.put(name, value)

    async def stop(self) -> None:
        """Stop the mission; its process is ended when that takes too long."""
        process, task = self._process, self._task
        if process is None or task is None or process.stdin is None:
            return
        self._stopping = True
        with contextlib.suppress(ConnectionError):
            process.stdin.write(b"stop\n")
            await process.stdin.drain()
        await asyncio.wait({task}, timeout=STOP_S)
        if not task.done():
            await _end(process)

    async def close(self) -> None:
        """End what runs."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)


def check_size(text: str) -> None:
    """Refuse a text that no mission may have.

    Raises:
        ConfigError: It is too long.
    """
    if len(text) > MAX_MISSION_BYTES or len(text.encode("utf-8", errors="replace")) > MAX_MISSION_BYTES:
        raise ConfigError(f"a mission has at most {MAX_MISSION_BYTES} bytes")


class Verifications:
    """Verifies missions as ``florence verify`` does, one at a time."""

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._process: asyncio.subprocess.Process | None = None
        self._stopped = False

    @property
    def running(self) -> bool:
        """Tell whether one is being verified."""
        return self._turn.locked()

    async def run(self, text: str, file: Path, folders: Sequence[Path]) -> dict[str, Any]:
        """Verify a mission on a text that need not be saved.

        Args:
            text: Its text.
            file: Where it stands, or will.
            folders: Folders of missions.

        Returns:
            The answer (:func:`florence_page.editor.verification.answer`).

        Raises:
            DeviceTimeout: It took too long.
            FlorenceError: Another one is verified, it was stopped, or it cannot be verified.
        """
        check_size(text)
        if self.running:
            raise FlorenceError("a mission is being verified already: wait for its end, or stop it")
        request = {"text": text, "file": str(file), "folders": [str(each) for each in folders]}
        async with self._turn:
            self._stopped = False
            self._process = process = await _start(f"{_PACKAGE}.verification")
            try:
                question = b"" if self._stopped else json.dumps(request).encode() + b"\n"
                said, _ = await asyncio.wait_for(process.communicate(question), VERIFICATION_S)
            except TimeoutError as error:
                raise DeviceTimeout(f"to verify it took more than {VERIFICATION_S:g} s") from error
            finally:
                await _end(process)
                self._process = None
        if self._stopped:
            raise FlorenceError("it was stopped")
        if not said:
            raise FlorenceError("what verifies missions broke down; the terminal of the page says more")
        answer: dict[str, Any] = json.loads(said)
        if "problem" in answer:
            raise FlorenceError(answer["problem"])
        return answer

    async def stop(self) -> None:
        """Stop what is being verified."""
        self._stopped = True
        if self._process is not None:
            await _end(self._process)

    async def close(self) -> None:
        """End what runs."""
        await self.stop()


class ScenarioRuns:
    """Runs the scenarios of missions as ``florence test`` does, one file at a time."""

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._process: asyncio.subprocess.Process | None = None

    async def run(
        self, name: str, text: str, scenarios: Path, folders: Sequence[Path], told: Callable[[str], None]
    ) -> list[dict[str, str]]:
        """Run the scenarios of a mission on a text that need not be saved.

        Args:
            name: The mission.
            text: Its text.
            scenarios: The file of the scenarios.
            folders: Folders of missions.
            told: Called with what the program said when it gave no results.

        Returns:
            For each scenario its ``name``, and ``problem``: what did not hold, empty when all did.

        Raises:
            DeviceTimeout: They took too long.
            FlorenceError: Others run, or the text is too long.
        """
        check_size(text)
        if self._turn.locked():
            raise FlorenceError("scenarios are being played already: wait for their end")
        async with self._turn:
            with tempfile.TemporaryDirectory(prefix="florence_scenarios_") as folder:
                own = Path(folder) / "missions"
                own.mkdir()
                (own / f"{name}.yaml").write_text(text, encoding="utf-8", errors="replace")
                report = Path(folder) / "report.xml"
                missions = [each for path in (*folders, own) for each in ("--missions", str(path))]
                self._process = process = await _start(
                    "florence_bt.cli",
                    "test",
                    str(scenarios.absolute()),
                    *missions,
                    "--junit",
                    str(report),
                    cwd=folder,
                    stderr=asyncio.subprocess.STDOUT,
                )
                try:
                    said, _ = await asyncio.wait_for(process.communicate(), SCENARIOS_S)
                except TimeoutError as error:
                    raise DeviceTimeout(f"the scenarios took more than {SCENARIOS_S:g} s") from error
                finally:
                    await _end(process)
                    self._process = None
                if not report.is_file():
                    told(said.decode(errors="replace"))
                    return []
                return _results(report)

    async def close(self) -> None:
        """End what runs."""
        if self._process is not None:
            await _end(self._process)


def _results(report: Path) -> list[dict[str, str]]:
    cases = ElementTree.parse(report).getroot().iter("testcase")
    return [{"name": case.get("name", ""), "problem": _problem(case)} for case in cases]


def _problem(case: ElementTree.Element) -> str:
    found = case.find("failure")
    if found is None:
        found = case.find("error")
    return "" if found is None else found.text or found.get("message") or "it failed"
