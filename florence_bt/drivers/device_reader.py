"""A thread that waits for what a device sends: the one reader that all drivers share."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from florence_bt.core.errors import DeviceError

T = TypeVar("T")

WAIT_S = 0.1
"""How long one wait may take, so the longest that :meth:`DeviceReader.stop` blocks."""


class DeviceReader(Generic[T]):
    """Reads a device on a thread of its own and hands on what comes.

    Both callbacks run on that thread; a node passes them on through ``FlorenceNode.call_soon``.
    """

    def __init__(
        self,
        read: Callable[[float], T | None],
        on_item: Callable[[T], None],
        on_lost: Callable[[DeviceError], None],
        name: str,
    ) -> None:
        """Prepare the thread.

        Args:
            read: Waits for the next item for at most so many seconds; gives nothing (None, no bytes) when the
                time is over, and raises DeviceError when the device fails. The device stays the caller's to
                close, after :meth:`stop`.
            on_item: Called with every item.
            on_lost: Called once when the device fails; the thread has nothing more to read then.
            name: What is read, for the name of the thread.
        """
        self._read = read
        self._on_item = on_item
        self._on_lost = on_lost
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reader of {name}", daemon=True)

    def start(self) -> None:
        """Begin to read."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread; after this no callback comes any more. Harmless when called twice."""
        self._stopping.set()
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join()

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                item = self._read(WAIT_S)
            except DeviceError as error:
                if not self._stopping.is_set():
                    self._on_lost(error)
                return
            if item and not self._stopping.is_set():
                self._on_item(item)
