"""Reads and checks edited mission files beside the executor: in a process of its own, once per edit.

A thread would not do: it shares the interpreter, and while a file of 304 kB was read and checked the executor
waited up to 600 ms for its turn. The process gets the missions in force as a pickle, takes the edits over as
:meth:`MissionFolders.refresh` does, and gives its missions back. They are read in small slices, and replace
those in force at once.
"""

from __future__ import annotations

import gc
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from florence_bt.core.clock import Clock, Timer
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
        self._check: _Check | None = None
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
        self._waiting.clear()
        self._stop()

    def _start(self) -> None:
        self._checks += 1
        check = self._check = _Check()
        threading.Thread(target=self._work, args=(check,), name="check", daemon=True).start()

    def _work(self, check: _Check) -> None:
        """Start the process, wait for it, and read its output; on a thread of its own."""
        try:
            code, pickled = check.run(self._pickled)
        except OSError as error:
            problem = f"the missions cannot be checked: {error}"
            self._call_soon(lambda: self._failed(check, problem))
            return
        if code != 0:
            problem = f"the check of the missions ended with code {code}; its error is in the log"
            self._call_soon(lambda: self._failed(check, problem))
            return
        source = _Slices(pickled)
        with collector_paused():
            report = pickle.Unpickler(source).load()
            begin = source.position
            missions = pickle.Unpickler(source).load()
        # Compares texts, which takes as long as the files are large; so not on the executor's thread.
        again = _edited(missions)
        self._call_soon(lambda: self._checked(check, report, missions, pickled[begin:], again))

    def _checked(
        self, check: _Check, report: ReloadReport, missions: MissionFolders, pickled: bytes, again: bool
    ) -> None:
        if check is not self._check:
            return  # it came too late
        self._missions, self._pickled, self._report = missions, pickled, report
        self._adopt(missions)
        if not again:
            self._answer("")
        elif self._checks < AGAIN:
            self._start()
        else:
            self._answer("the files of the missions are being written at this moment; ask again")

    def _failed(self, check: _Check, problem: str) -> None:
        if check is self._check:
            self._answer(problem)

    def _too_late(self) -> None:
        self._answer(
            f"the edited missions were not checked within {LIMIT_S:g} s; undo the edit, or ask again"
        )

    def _answer(self, problem: str) -> None:
        waiting, self._waiting = self._waiting, []
        self._stop()
        for then in waiting:
            then(problem, self._report)

    def _stop(self) -> None:
        if self._limit is not None:
            self._limit.cancel()
            self._limit = None
        if self._check is not None:
            self._check.stop()
            self._check = None


def _edited(missions: MissionFolders) -> bool:
    try:
        return missions.edited()
    except OSError:
        return False  # a folder that is out of reach for a moment changes nothing


class _Check:
    """The process of one check. It is started on the thread that waits for it: a start takes up to 40 ms."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False

    def run(self, pickled: bytes) -> tuple[int, bytes]:
        """Run the process to its end; its exit code and its output.

        Raises:
            OSError: It cannot be started.
        """
        process = subprocess.Popen(
            [sys.executable, "-m", __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        with self._lock:
            self._process = process
            if self._stopped:
                process.kill()
        output, _ = process.communicate(pickled)
        return process.returncode, output

    def stop(self) -> None:
        """End the process, now or as soon as it has started."""
        with self._lock:
            self._stopped = True
            if self._process is not None and self._process.poll() is None:
                self._process.kill()


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


PROTOCOL = 3
"""Of the pickles: later ones are read in frames of 64 kB, which keeps the interpreter for 10 ms at a time."""


class _Slices:
    """Bytes to unpickle; whoever reads them lets other threads run every :data:`SLICE_S`."""

    def __init__(self, data: bytes) -> None:
        self.position = 0
        self._data = data
        self._until = time.perf_counter() + SLICE_S

    def read(self, count: int) -> bytes:
        """The next bytes."""
        self._yield_cpu()
        begin, self.position = self.position, self.position + count
        return self._data[begin : self.position]

    def readline(self) -> bytes:
        """The next line."""
        self._yield_cpu()
        begin, self.position = self.position, self._data.index(b"\n", self.position) + 1
        return self._data[begin : self.position]

    def _yield_cpu(self) -> None:
        if time.perf_counter() >= self._until:
            time.sleep(SLICE_S)
            self._until = time.perf_counter() + SLICE_S


def main() -> None:
    """Take edits over: missions in on the standard input, the report and the missions out."""
    missions: MissionFolders = pickle.load(sys.stdin.buffer)
    report = missions.refresh()
    for mission in missions.library:
        missions.findings_of(mission)
    pickle.dump(report, sys.stdout.buffer, PROTOCOL)
    pickle.dump(missions, sys.stdout.buffer, PROTOCOL)


if __name__ == "__main__":
    main()
