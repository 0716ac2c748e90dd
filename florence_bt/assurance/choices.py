"""Choices that are left open: a step is taken once for each way in which they can be made."""

from __future__ import annotations

from florence_bt.assurance.snapshot import Unchanging


class Choices(Unchanging):
    """Makes choices along a path, and finds the paths that are left.

    A step asks with :meth:`take`. What stands in the path is answered first; beyond it the first option is
    taken. :meth:`next` goes to the next path in the order of counting.
    """

    def __init__(self) -> None:
        self.path: list[int] = []
        self._counts: list[int] = []
        self._asked = 0

    def begin(self, path: list[int] | tuple[int, ...] = ()) -> None:
        """Begin a step that answers as a path says."""
        self.path = list(path)
        self._counts = []
        self._asked = 0

    def take(self, count: int) -> int:
        """Choose one of some options, counted from 0."""
        if self._asked == len(self.path):
            self.path.append(0)
        self._counts.append(count)
        self._asked += 1
        return self.path[self._asked - 1]

    def next(self) -> list[int] | None:
        """Return the path of the step after this one, None when every option was tried."""
        path = self.path[: self._asked]
        while path:
            last = path.pop() + 1
            if last < self._counts[len(path)]:
                return [*path, last]
        return None
