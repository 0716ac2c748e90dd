"""Clients that pulse RTS or DTR on a pseudo-terminal, which has no such lines."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial

from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from tools.emulators import modem_lines
from tools.emulators.modem_lines import pretended_modem_lines

CLIENT = """
import sys, serial
with serial.Serial(sys.argv[1], 57600) as port:
    port.rts = port.dtr = False
    port.rts = True
    print(port.cts)
sys.exit(7)
"""


@pytest.fixture
def path(tmp_path: Path) -> Iterator[str]:
    line = PseudoTerminal(tmp_path / "line")
    yield line.path
    line.close()


def test_lines_are_pretended_and_nothing_else(path: str) -> None:
    with serial.Serial(path, 57600) as port:
        with pytest.raises(OSError, match="ioctl"):
            port.rts = True
        with pretended_modem_lines():
            port.rts, port.dtr, port.rts = False, True, True
            assert (port.cts, port.dsr, port.in_waiting) == (False, False, 0)
            with pytest.raises(OSError, match="ioctl"):
                fcntl.ioctl(port.fd, 0x5401FFFF)
            with open(os.devnull) as other, pytest.raises(OSError, match="ioctl"):
                fcntl.ioctl(other, modem_lines.READ_LINES)
        with pytest.raises(OSError, match="ioctl"):
            port.rts = True


@pytest.mark.parametrize("program", [["-m", modem_lines.__name__], [str(modem_lines.__file__)]])
def test_any_python_runs_a_client_with_it(path: str, tmp_path: Path, program: list[str]) -> None:
    client = tmp_path / "client.py"
    client.write_text(CLIENT)
    done = subprocess.run(
        [sys.executable, *program, str(client), path], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (7, "False\n", "")


def test_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert modem_lines.main([]) == 2
    assert "CLIENT.py" in capsys.readouterr().err
