from __future__ import annotations

import socket
from pathlib import Path

import pytest

from florence_bt.core.socket_paths import LONGEST, short_path


@pytest.mark.parametrize("length", [LONGEST - 1, LONGEST, LONGEST + 1, LONGEST + 100])
def test_a_socket_can_be_anywhere(tmp_path: Path, length: int) -> None:
    folder = tmp_path
    while len(str(folder)) < length - 40:
        folder /= "d" * min(30, length - 10 - len(str(folder)))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / ("s" * max(1, length - len(str(folder)) - 1))
    with socket.socket(socket.AF_UNIX) as server, socket.socket(socket.AF_UNIX) as client:
        with short_path(path) as place:
            server.bind(place)
        server.listen()
        assert path.is_socket()
        with short_path(str(path)) as place:
            client.connect(place)
        peer, _ = server.accept()
        with peer:
            peer.sendall(b"here")
            assert client.recv(4) == b"here"


def test_a_short_path_is_left_alone_and_a_folder_that_is_not_there_is_told(tmp_path: Path) -> None:
    with short_path("s") as place:
        assert place == "s"
    with pytest.raises(FileNotFoundError), short_path(tmp_path / ("d" * 200) / "s"):
        pass
