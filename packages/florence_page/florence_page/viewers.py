"""Sends the live parts to everybody who looks."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable

from fastapi import WebSocket, WebSocketDisconnect

from florence_page.parts import LiveParts
from florence_page.presses import beat

FRAME_S = 0.1
"""Seconds between two frames for a viewer, at least."""
BEAT_S = 0.5
"""Seconds between two frames at most, also when nothing is new: a browser that has none knows that it is cut
off."""
FRAME_LIMIT_S = 20.0
"""A viewer that has not taken a frame for so long is left alone."""
MOST_PAGE_VIEWERS = 50
LONGEST_WORDS = 200
"""Characters of a message that are read."""


class Viewers:
    """Sends each viewer what has changed, when it has taken what came before: the newest state wins.

    Args:
        parts: What they are sent.
        note: Called with a sentence about a viewer that is gone.
    """

    def __init__(self, parts: LiveParts, note: Callable[[str], object]) -> None:
        self._parts = parts
        self._note = note
        self._count = 0

    def joined(self, socket: WebSocket) -> None:
        """Take note of a viewer."""

    def left(self, socket: WebSocket) -> None:
        """Take note that a viewer has left."""

    def heed(self, socket: WebSocket, words: list[str]) -> None:
        """Hear what a viewer says beside that it has taken a frame."""

    async def serve(self, socket: WebSocket) -> None:
        """Serve one viewer until it leaves."""
        if self._count >= MOST_PAGE_VIEWERS:
            await socket.close(1013, f"{MOST_PAGE_VIEWERS} viewers are here already")
            return
        self._count += 1
        try:
            await socket.accept()
            self.joined(socket)
            try:
                await self._send_all(socket)
            finally:
                self.left(socket)
        except (WebSocketDisconnect, TimeoutError, RuntimeError) as error:
            # It has left, maybe amid a frame, or takes nothing: others are not concerned.
            self._note(f"a viewer is gone: {error!r}")
        finally:
            self._count -= 1

    async def _send_all(self, socket: WebSocket) -> None:
        taken = asyncio.Event()
        listening = asyncio.create_task(self._listen(socket, taken))
        seen: dict[str, int] = {}
        next_beat = -math.inf
        try:
            while not listening.done():
                frame, seen = self._parts.since(seen)
                now = time.monotonic()
                if frame or now >= next_beat:
                    next_beat = now + BEAT_S
                    frame = f'{{"beat":{beat()}{"," + frame[1:] if frame else "}"}'
                    taken.clear()
                    await asyncio.wait_for(socket.send_text(frame), FRAME_LIMIT_S)
                    done = asyncio.create_task(taken.wait())
                    await asyncio.wait(
                        {listening, done}, timeout=FRAME_LIMIT_S, return_when=asyncio.FIRST_COMPLETED
                    )
                    if not done.done():
                        done.cancel()
                        return
                await asyncio.wait({listening}, timeout=FRAME_S)
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)

    async def _listen(self, socket: WebSocket, taken: asyncio.Event) -> None:
        """Note that a viewer has taken a frame, and heed what else it says, until it leaves."""
        while True:
            text = await socket.receive_text()
            if text == "ok":
                taken.set()
            else:
                self.heed(socket, text[:LONGEST_WORDS].split())
