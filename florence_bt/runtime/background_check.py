"""Reads and checks edited mission files beside the executor: in a process of its own.

A thread would not do: it shares the interpreter, and while a file of 304 kB was read and checked the executor
waited up to 600 ms for its turn. The process gets the missions in force as a pickle, takes the edits over as
:meth:`MissionFolders.refresh` does, and gives its missions back. They are read in small slices, replace those
in force at once, and those are freed in small slices too. The process is started with the node and stays:
a start holds every thread up for some milliseconds.
"""

from __future__ import annotations

import gc
import pickle
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from florence_bt.core.clock import Clock, Timer
from florence_bt.runtime.check_process import PROTOCOL, CheckFailed, CheckProcess
from florence_bt.runtime.missions import MissionFolders, ReloadReport

LIMIT_S = 25.0
"""How long a check may take; the first start of Python on a busy machine takes some seconds of it."""
AGAIN = 5
"""How often files that were edited during their check are checked again before somebody gets an answer."""
SLICE_S = 0.0005
"""How long the interpreter is kept from the executor at a time."""

WhenFresh = Callable[[str, ReloadReport], None]
"""Called with why the files could not be checked (mostly empty) and the report about the edits."""


class BackgroundCheck:
    """Keeps missions up to date without holding their executor up.

    Args:
        missions: The missions in force.
        adopt: Takes newer ones over, on the executor's thread.
        call_soon: Runs a callback on the executor's thread; may be called from any thread.
        steady: For the limit.
    """

    def __init__(
        self,
        missions: MissionFolders,
        adopt: Callable[[MissionFolders], None],
        call_soon: Callable[[Callable[[], None]], object],
        steady: Clock,
    ) -> None:
        self._missions = missions
        self._adopt = adopt
        self._call_soon = call_soon
        self._steady = steady
        self._pickled = pickle.dumps(missions, PROTOCOL)
        self._waiting: list[WhenFresh] = []
        self._report = ReloadReport()
        self._checks = 0
        self._process: CheckProcess | None = CheckProcess()
        self._limit: Timer | None = None

    def when_fresh(self, then: WhenFresh) -> None:
        """Call back when every edit until now has been checked: at once when there is none."""
        if not self._waiting and not _edited(self._missions):
            then("", self._missions.refresh())
            return
        self._waiting.append(then)
        if self._limit is None:
            self._checks = 0
            self._report = ReloadReport()
            self._limit = self._steady.call_at(self._steady.now() + LIMIT_S, self._too_late)
            self._start()

    def close(self) -> None:
        """End a check that goes on; nobody is called back any more."""
        self._stop_waiting()
        if self._process is not None:
            self._process.close()
            self._process = None

    def _start(self) -> None:
        self._checks += 1
        threading.Thread(target=self._work, args=(self._process,), name="check", daemon=True).start()

    def _work(self, process: CheckProcess | None) -> None:
        """Let the process check, and read its answer; on a thread of its own, because a start takes time."""
        try:
            if process is None:
                process = self._process = CheckProcess()
            answer = process.check(self._pickled)
        except (OSError, CheckFailed) as error:
            if process is None or not process.killed:
                problem = f"the missions cannot be checked: {error}"
                self._call_soon(lambda: self._failed(problem))
            return
        source = _Slices(answer)
        with collector_paused():
            report = pickle.Unpickler(source).load()
            begin = source.position
            missions = pickle.Unpickler(source).load()
        # Compares texts, which takes as long as the files are large; so not on the executor's thread.
        again = _edited(missions)
        self._call_soon(lambda: self._checked(process, report, missions, answer[begin:], again))

    def _checked(
        self,
        process: CheckProcess,
        report: ReloadReport,
        missions: MissionFolders,
        pickled: bytes,
        again: bool,
    ) -> None:
        if process.killed:
            return  # it came too late
        replaced: list[object] = [self._missions]
        self._missions, self._pickled, self._report = missions, pickled, report
        self._adopt(missions)
        threading.Thread(target=_free, args=(replaced,), name="free", daemon=True).start()
        if not again:
            self._answer("")
        elif self._checks < AGAIN:
            self._start()
        else:
            self._answer("the files of the missions are being written at this moment; ask again")

    def _failed(self, problem: str) -> None:
        self._process = None
        self._answer(problem)

    def _too_late(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process = None
        self._answer(
            f"the edited missions were not checked within {LIMIT_S:g} s; undo the edit, or ask again"
        )

    def _answer(self, problem: str) -> None:
        for then in self._stop_waiting():
            then(problem, self._report)

    def _stop_waiting(self) -> list[WhenFresh]:
        waiting, self._waiting = self._waiting, []
        if self._limit is not None:
            self._limit.cancel()
            self._limit = None
        return waiting


def _edited(missions: MissionFolders) -> bool:
    try:
        return missions.edited()
    except OSError:
        return False  # a folder that is out of reach for a moment changes nothing


@contextmanager
def collector_paused() -> Iterator[None]:
    """Let the garbage collector pause, and never look at what was made meanwhile.

    A collection visits all that was read so far, and every thread waits for it. What is made here lives long,
    as what was made at the start of the process (``ros.spin``).
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def _free(parts: list[object]) -> None:
    """Let go of a model object by object; all at once that would keep the interpreter for 10 ms and more.

    Args:
        parts: The model; everything that it is made of is added.
    """
    slices = _TimeSlices()
    seen = set()
    for part in parts:
        for inner in gc.get_referents(part):
            slices.yield_if_over()
            if id(inner) not in seen and _is_model(type(inner)):
                seen.add(id(inner))
                parts.append(inner)
    parts.reverse()  # whole before part
    while parts:
        parts.pop()
        slices.yield_if_over()


def _is_model(kind: type) -> bool:
    return kind in (dict, list, tuple) or kind.__module__.startswith("florence_bt.trees.")


class _TimeSlices:
    """Lets other threads run every :data:`SLICE_S`."""

    def __init__(self) -> None:
        self._until = time.perf_counter() + SLICE_S

    def yield_if_over(self) -> None:
        """Pause when a slice is over."""
        if time.perf_counter() >= self._until:
            time.sleep(SLICE_S)
            self._until = time.perf_counter() + SLICE_S


class _Slices:
    """Bytes to unpickle; reading them lets other threads run."""

    def __init__(self, data: bytes) -> None:
        self.position = 0
        self._data = data
        self._slices = _TimeSlices()

    def read(self, count: int) -> bytes:
        """The next bytes."""
        self._slices.yield_if_over()
        begin, self.position = self.position, self.position + count
        return self._data[begin : self.position]

    def readline(self) -> bytes:
        """The next line."""
        self._slices.yield_if_over()
        begin, self.position = self.position, self._data.index(b"\n", self.position) + 1
        return self._data[begin : self.position]
