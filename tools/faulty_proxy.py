"""A proxy in front of a TCP port of this machine, whose line breaks, holds, delays and reorders."""

from __future__ import annotations

import asyncio
import random
import threading
from typing import Literal, Self

Fault = Literal["none", "break", "hold", "delay", "reorder"]


class FaultyProxy:
    """Passes connections on to a port. A context manager; it serves on a thread of its own.

    ``break`` ends every connection and accepts none; ``hold`` takes all and passes nothing on until it is
    over; ``delay`` passes everything on later; ``reorder`` delays each connection by its own time, so that
    what was sent on one overtakes what was sent before on another.

    Args:
        target: The port that it leads to.
        seed: Of the times of ``reorder``.

    Attributes:
        port: The port to connect to.
    """

    def __init__(self, target: int, seed: int = 0) -> None:
        self.port = 0
        self._target = target
        self._dice = random.Random(seed)
        self._fault: Fault = "none"
        self._lag_s = 0.0
        self._writers: set[asyncio.StreamWriter] = set()
        self._tasks: set[asyncio.Task[None]] = set()
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._end = asyncio.Event()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._serve(),))

    def __enter__(self) -> Self:
        """Listen."""
        self._thread.start()
        self._ready.wait()
        return self

    def __exit__(self, *exc_info: object) -> None:
        """End every connection."""
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join()
        self._loop.close()

    def begin(self, fault: Fault, lag_s: float = 0.5) -> None:
        """Let the line be so from now on.

        Args:
            fault: What it does.
            lag_s: By how much ``delay`` delays, and ``reorder`` at most.
        """
        self._loop.call_soon_threadsafe(self._begin, fault, lag_s)

    def _begin(self, fault: Fault, lag_s: float) -> None:
        self._fault, self._lag_s = fault, lag_s
        if fault == "break":
            self._cut()

    def _cut(self) -> None:
        for writer in self._writers:
            writer.transport.abort()

    async def _serve(self) -> None:
        server = await asyncio.start_server(self._take, "127.0.0.1", 0)
        self.port = server.sockets[0].getsockname()[1]
        self._ready.set()
        await self._end.wait()
        server.close()
        self._cut()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _take(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._fault == "break":
            writer.transport.abort()
            return
        try:
            there, back = await asyncio.open_connection("127.0.0.1", self._target)
        except OSError:
            writer.transport.abort()
            return
        lag = self._dice.random()
        self._writers |= {writer, back}
        pumps = [asyncio.create_task(self._pump(*each, lag)) for each in ((reader, back), (there, writer))]
        self._tasks |= set(pumps)
        await asyncio.wait(pumps, return_when=asyncio.FIRST_COMPLETED)
        for each in (writer, back):
            each.transport.abort()
        await asyncio.gather(*pumps, return_exceptions=True)
        self._writers -= {writer, back}
        self._tasks -= set(pumps)

    async def _pump(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, lag: float) -> None:
        try:
            while data := await reader.read(65_536):
                if self._fault == "delay":
                    await asyncio.sleep(self._lag_s)
                elif self._fault == "reorder":
                    await asyncio.sleep(lag * self._lag_s)
                while self._fault == "hold":
                    await asyncio.sleep(0.02)
                writer.write(data)
                await writer.drain()
        except OSError:
            return  # one end is gone: so is the other
