"""Lines of text for a running emulator: from its console and through a Unix socket."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Callable
from pathlib import Path

from florence_bt.core.socket_paths import short_path

LONGEST_LINE = 1000


class ControlChannel:
    """The control channel: lines on the console and on the connections of a Unix socket."""

    def __init__(self, path: Path | None, console: int | None) -> None:
        self._path = path
        self._server: socket.socket | None = None
        self._peers: dict[int, tuple[socket.socket | None, bytearray]] = {}
        if console is not None:
            self._peers[console] = (None, bytearray())
        if path is not None:
            path.unlink(missing_ok=True)
            self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            with short_path(path) as place:
                self._server.bind(place)
            self._server.listen()

    def descriptors(self) -> list[int]:
        """What to wait for."""
        return [*self._peers, *([self._server.fileno()] if self._server is not None else [])]

    def serve(self, ready: list[int], run: Callable[[str], str]) -> None:
        """Obey what came."""
        for descriptor in ready:
            if descriptor in self._peers:
                self._serve_peer(descriptor, run)
            elif self._server is not None and descriptor == self._server.fileno():
                peer, _ = self._server.accept()
                self._peers[peer.fileno()] = (peer, bytearray())

    def close(self) -> None:
        """Hang up and remove the socket."""
        for peer, _ in self._peers.values():
            if peer is not None:
                peer.close()
        if self._server is not None and self._path is not None:
            self._server.close()
            self._path.unlink(missing_ok=True)

    def _serve_peer(self, descriptor: int, run: Callable[[str], str]) -> None:
        peer, waiting = self._peers[descriptor]
        try:
            data = os.read(descriptor, LONGEST_LINE)
        except OSError:
            data = b""  # a peer that broke off has nothing more to say, like one that hung up
        waiting += data
        while (end := waiting.find(b"\n")) >= 0:
            line = waiting[:end].decode(errors="replace")
            del waiting[: end + 1]
            self._answer(peer, run(line))
        if not data or len(waiting) > LONGEST_LINE:
            del self._peers[descriptor]
            if peer is not None:
                peer.close()

    def _answer(self, peer: socket.socket | None, text: str) -> None:
        if peer is None:
            print(text, flush=True)
            return
        try:
            peer.sendall(text.encode() + b"\n")
        except OSError as error:
            print(f"the control channel broke off: {error}", file=sys.stderr)
