"""Sends the live parts to everybody who looks."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from fastapi import WebSocket, WebSocketDisconnect

from florence_bt.app.page.parts import LiveParts

FRAME_S = 0.1
"""Seconds between two frames for a viewer, at least."""
ANSWER_S = 20.0
"""A viewer that has not taken a frame for so long is left alone."""
MOST_VIEWERS = 50


class Viewers:
    """Sends each viewer what has changed, when it has taken what came before: the newest state wins.

    Args:
        parts: What they are sent.
        look: Called with whether there is a viewer when that changes.
        note: Called with a sentence about a viewer that is gone.
    """

    def __init__(self, parts: LiveParts, look: Callable[[bool], None], note: Callable[[str], None]) -> None:
        self._parts = parts
        self._look = look
        self._note = note
        self._count = 0

    async def serve(self, socket: WebSocket) -> None:
        """Serve one viewer until it leaves."""
        if self._count >= MOST_VIEWERS:
            await socket.close(1013, f"{MOST_VIEWERS} viewers are here already")
            return
        await socket.accept()
        self._add(1)
        try:
            await self._send_all(socket)
        except (WebSocketDisconnect, TimeoutError, RuntimeError) as error:
            # It has left, maybe amid a frame, or takes nothing: others are not concerned.
            self._note(f"a viewer is gone: {error!r}")
        finally:
            self._add(-1)

    async def _send_all(self, socket: WebSocket) -> None:
        taken = asyncio.Event()
        listening = asyncio.create_task(_listen(socket, taken))
        seen: dict[str, int] = {}
        try:
            while not listening.done():
                frame, seen = self._parts.since(seen)
                if frame:
                    taken.clear()
                    await asyncio.wait_for(socket.send_text(frame), ANSWER_S)
                    done = asyncio.create_task(taken.wait())
                    await asyncio.wait(
                        {listening, done}, timeout=ANSWER_S, return_when=asyncio.FIRST_COMPLETED
                    )
                    if not done.done():
                        done.cancel()
                        return
                await asyncio.wait({listening}, timeout=FRAME_S)
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)

    def _add(self, more: int) -> None:
        self._count += more
        self._look(self._count > 0)


async def _listen(socket: WebSocket, taken: asyncio.Event) -> None:
    """Note that a viewer has taken its frame, until it leaves."""
    while True:
        await socket.receive_text()
        taken.set()
