"""The queued runs: by priority, then in the order in which they came. Bounded."""

from __future__ import annotations

from collections.abc import Iterator

from florence_bt.runtime.run import MissionRun


class RunQueue:
    """Waiting runs, the next one first.

    Args:
        limit: How many may wait at once; above zero. One more may wait for the end of the run that it stops.
    """

    def __init__(self, limit: int) -> None:
        if limit < 1:
            raise ValueError(f"a queue needs room for at least one run, not {limit}")
        self.limit = limit
        self._runs: list[MissionRun] = []

    @property
    def full(self) -> bool:
        """Tell whether no further run may be queued."""
        return len(self._runs) >= self.limit

    @property
    def crowded(self) -> bool:
        """Tell whether not even a run that stops the current one may wait."""
        return len(self._runs) > self.limit

    def add(self, run: MissionRun, *, first: bool = False) -> None:
        """Let a run wait.

        Args:
            run: The run.
            first: Whether it goes before runs of the same priority instead of behind them.
        """
        priority = run.request.priority
        for index, waiting in enumerate(self._runs):
            if priority > waiting.request.priority or (first and priority == waiting.request.priority):
                self._runs.insert(index, run)
                return
        self._runs.append(run)

    def take(self) -> MissionRun:
        """Take the next run out."""
        return self._runs.pop(0)

    def take_all(self) -> list[MissionRun]:
        """Take every run out."""
        runs, self._runs = self._runs, []
        return runs

    def remove(self, run_id: str) -> MissionRun | None:
        """Take the run with this id out; None when it does not wait here."""
        for run in self._runs:
            if run.run_id == run_id:
                self._runs.remove(run)
                return run
        return None

    def __iter__(self) -> Iterator[MissionRun]:
        return iter(tuple(self._runs))

    def __len__(self) -> int:
        return len(self._runs)
