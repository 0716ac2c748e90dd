"""Closing things at the end of a ``with``."""

from __future__ import annotations

import faulthandler
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self


class Closing(ABC):
    """A context manager that is itself and closes itself."""

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close it, whatever happened."""
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Let go of what it holds."""


@contextmanager
def ending_anyway(after_s: float) -> Iterator[None]:
    """End this process when the block has not come to its end by itself; for the last that a process does.

    It then writes its stacks to the standard error, and its exit code is 1. A thread of C does that, which
    needs no lock of Python's: a library that hangs may hold it.

    Args:
        after_s: Wall seconds.
    """
    faulthandler.dump_traceback_later(after_s, exit=True)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()
