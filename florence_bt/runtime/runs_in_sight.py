"""The runs that an executor knows, for those who look at them: the current, the waiting, the last one."""

from __future__ import annotations

from florence_bt.behaviours.keys import KeyStore
from florence_bt.runtime.run import MissionRun, RunStatus
from florence_bt.runtime.run_queue import RunQueue
from florence_bt.runtime.tree_run import TreeRun
from florence_bt.trees.drawings.ascii import draw_rows
from florence_bt.trees.language.compile import CompiledTree


class RunsInSight:
    """Knows runs and shows them; what becomes of them is decided elsewhere.

    Args:
        queue: The runs that wait.

    Attributes:
        current: The run that is not over yet, or None.
        last: The run that ended last, or None.
    """

    def __init__(self, queue: RunQueue) -> None:
        self.current: MissionRun | None = None
        self.last: MissionRun | None = None
        self._queue = queue
        self._active: TreeRun | None = None

    @property
    def waiting(self) -> tuple[MissionRun, ...]:
        """The runs that wait for their turn, the next one first."""
        return tuple(self._queue)

    def find(self, run_id: str | None = None) -> MissionRun | None:
        """The run with this id among the current, the queued and the last one; without an id the current
        run or else the last one.
        """
        candidates = [self.current, *self._queue, self.last]
        for run in candidates:
            if run is not None and run_id in (None, "", run.run_id):
                return run
        return None

    def render(
        self,
        run: MissionRun,
        *,
        colour: bool = False,
        visited_only: bool = False,
        durations: bool = False,
        width: int | None = None,
    ) -> str:
        """The ASCII tree of a run: live for the current one, as it was at the end for others.

        Args:
            run: The run.
            colour: Whether to colour the marks for a terminal.
            visited_only: Whether to leave out nodes that were not reached.
            durations: Whether nodes tell how long they took, on the clock of the run.
            width: Characters of a line at most; what nodes say is cut.
        """
        live = (RunStatus.RUNNING, RunStatus.PAUSED)
        rows = run.rows
        if self._active is not None and run is self._active.run and run.status in live:
            rows = self._active.rows()
        elif not rows:
            return run.tree
        return draw_rows(rows, colour=colour, visited_only=visited_only, durations=durations, width=width)

    def tip(self) -> str:
        """The name of the node that the current run waits for, empty when nothing runs."""
        return self._active.tip() if self._active is not None else ""

    @property
    def tree(self) -> CompiledTree | None:
        """The tree of the current run for those who look at it, None when nothing runs."""
        return self._active.tree if self._active is not None else None

    def keys(self) -> KeyStore | None:
        """The keys of the current run's mission, None when nothing runs."""
        return self._active.tree.keys if self._active is not None else None
