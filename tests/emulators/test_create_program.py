"""The emulated Create alone: its lines of text, its line, its process, and other people's clients."""

from __future__ import annotations

import fcntl
import json
import os
import signal
import socket
import subprocess
import sys
import termios
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import serial

from florence_bt.simulation.emulators.create_program import CreateOptions, CreateProgram
from florence_bt.simulation.emulators.pty_port import PseudoTerminal

LONG_S = 10.0


class Hand:
    """A clock that stands until somebody turns it."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Callable[..., CreateProgram]]:
    programs: list[CreateProgram] = []

    def made(**how: Any) -> CreateProgram:
        programs.append(CreateProgram(CreateOptions(link=tmp_path / "create", **how), Hand()))
        return programs[-1]

    yield made
    for program in programs:
        program.close()


def ask(program: CreateProgram, port: serial.Serial, command: bytes, size: int) -> bytes:
    """Send a command, let the program look, and read the answer."""
    port.write(command)
    answer = b""
    end = time.monotonic() + LONG_S
    while len(answer) < size and time.monotonic() < end:
        program.step()
        answer += port.read(size)
    return answer


# -- lines of text -------------------------------------------------------------------------------------------


def test_every_fault_can_be_told(make: Callable[..., CreateProgram]) -> None:
    program = make(model="create2")
    run, faults = program.control.run, program.create.faults
    for line in (
        "silent on",
        "deaf on",
        "noise 12",
        "bad_checksums 3",
        "partial_frames 2",
        "wheel_drop left caster",
        "bump right",
        "cliff front_left right",
        "wall on",
        "virtual_wall on",
        "charger on",
        "dock on",
        "charging_fault on",
        "battery 50",
        "buttons play advance",
        "infrared 250",
        "inputs 5",
        "overcurrents 24",
        "gyro_drift 0.5",
        "gyro off",
        "light_bumps 1 2 3 4 5 6",
        "oi_mode_offset 1",
        "",
    ):
        assert run(line) == "ok", line
    assert (faults.silent, faults.deaf, len(faults.noise), faults.bad_checksums) == (True, True, 12, 3)
    assert (faults.partial_frames, faults.wheel_drops) == (2, 24)
    assert (faults.left_bumper, faults.right_bumper) == (False, True)
    assert faults.cliffs == (False, True, False, True)
    assert (faults.wall, faults.virtual_wall, faults.charger, faults.dock) == (True,) * 4
    assert (faults.charging_fault, program.create.battery.charge_mah) == (True, 1350.0)
    assert (faults.buttons, faults.infrared, faults.digital_inputs, faults.overcurrents) == (5, 250, 5, 24)
    assert (faults.gyro_drift, faults.gyro_dead) == (0.5, True)
    assert (faults.light_bumps, faults.oi_mode_offset) == ((1, 2, 3, 4, 5, 6), 1)
    assert run("cliff all") == "ok"
    assert faults.cliffs == (True,) * 4
    assert run("clear") == "ok"
    assert not any((faults.silent, faults.noise, faults.wheel_drops, any(faults.cliffs), faults.gyro_dead))


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("wheel_drp left", "wheel_drop"),
        ("wheel_drop middle", "caster"),
        ("wheel_drop", "none"),
        ("silent maybe", "on, off"),
        ("battery full", "0 to 100"),
        ("battery 101", "0 to 100"),
        ("bad_checksums 1.5", "whole number"),
        ("light_bumps 1 2", "six numbers"),
        ("noise -1", "0 to 10000"),
    ],
)
def test_what_is_not_understood_is_answered(make: Callable[..., CreateProgram], line: str, hint: str) -> None:
    answer = make().control.run(line)
    assert answer.startswith("error: ")
    assert hint in answer


def test_status_and_help(make: Callable[..., CreateProgram]) -> None:
    program = make()
    status = json.loads(program.control.run("status"))
    assert (status["model"], status["mode"], status["plugged"], status["pose"]) == (
        "create",
        "off",
        True,
        [0.0, 0.0, 0.0],
    )
    words = {line.split()[0].rstrip(",") for line in program.control.run("help").splitlines()}
    assert set(program.control._verbs) - words <= {"virtual_wall", "overcurrents"}


# -- the line ------------------------------------------------------------------------------------------------


def test_a_client_drives_the_base(make: Callable[..., CreateProgram]) -> None:
    program = make()
    with serial.Serial(program.path, 57600, timeout=0.01) as port:
        assert ask(program, port, bytes([128, 132, 142, 35]), 1) == b"\x03"
        port.write(bytes([145, 0, 100, 0, 100]))
        while program.create.wheels == (0, 0):
            program.step()
        program._clock.now += 2.0  # type: ignore[attr-defined]
        program.step()
        assert json.loads(program.control.run("status"))["pose"] == [0.2, 0.0, 0.0]
        assert ask(program, port, bytes([142, 19]), 2) == bytes([0, 200])


def test_unplug_and_plug(make: Callable[..., CreateProgram]) -> None:
    program = make()
    port = serial.Serial(program.path, 57600, timeout=0.01)
    program.control.run("unplug")
    program.step()
    with pytest.raises((OSError, serial.SerialException)):
        port.read(1)
        port.write(b"x")
    port.close()
    assert not Path(program._options.link or "").exists()
    program.control.run("plug")
    with serial.Serial(program.path, 57600, timeout=0.01) as again:
        assert ask(program, again, bytes([128, 142, 35]), 1) == b"\x01"


def test_the_wrong_speed_is_garbage_when_strict(make: Callable[..., CreateProgram]) -> None:
    program = make(strict_baud=True)
    with serial.Serial(program.path, 115200, timeout=0.01) as port:
        port.write(bytes([128, 132, 142, 35]))
        for _ in range(20):
            program.step()
        assert program.create.mode == 0
        port.baudrate = 57600
        assert ask(program, port, bytes([128, 142, 35]), 1) == b"\x01"


def test_a_new_client_finds_a_fresh_line(tmp_path: Path) -> None:
    line = PseudoTerminal(tmp_path / "line")
    assert not line.has_client
    line.write(b"nobody is there")
    first = os.open(line.path, os.O_RDWR | os.O_NOCTTY)
    assert line.has_client
    line.write(b"this is not read")
    # It leaves the line locked and with an echo.
    fcntl.ioctl(first, termios.TIOCEXCL)
    settings = termios.tcgetattr(first)
    settings[3] |= termios.ECHO | termios.ICANON
    termios.tcsetattr(first, termios.TCSANOW, settings)
    os.write(first, b"last words\n")
    os.close(first)
    received = b""
    while b"last words\n" not in received:  # an echo of what was not read may come with it
        received += line.read()
    assert not line.has_client
    second = os.open(line.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    assert termios.tcgetattr(second)[3] & (termios.ECHO | termios.ICANON) == 0
    assert fcntl.ioctl(second, 0x80045440, b"\0\0\0\0") == b"\0\0\0\0"  # TIOCGEXCL: no lock
    with pytest.raises(BlockingIOError):
        os.read(second, 100)
    line.write(b"fresh")
    os.set_blocking(second, True)
    assert os.read(second, 100) == b"fresh"
    assert line.lost_bytes == len(b"nobody is there")
    os.close(second)
    line.close()


# -- the process ---------------------------------------------------------------------------------------------


class Process:
    """The program, and its control socket."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.link, self._socket = folder / "create", folder / "create.sock"
        words = ["create", "--link", str(self.link), "--control", str(self._socket), *options]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "florence_bt.simulation.emulators", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline().strip() == str(self.link)

    def say(self, line: str) -> str:
        with socket.socket(socket.AF_UNIX) as peer:
            peer.settimeout(LONG_S)
            peer.connect(str(self._socket))
            peer.sendall(line.encode() + b"\n")
            with peer.makefile() as answers:
                return answers.readline().strip()

    def status(self) -> dict[str, Any]:
        return dict(json.loads(self.say("status")))

    def end(self, number: signal.Signals = signal.SIGTERM) -> int:
        with self.process:
            if self.process.poll() is None:
                self.process.send_signal(number)
        return self.process.returncode


@pytest.fixture
def process(tmp_path: Path) -> Iterator[Callable[..., Process]]:
    started: list[Process] = []

    def start(*options: str) -> Process:
        started.append(Process(tmp_path, *options))
        return started[-1]

    yield start
    for one in started:
        one.end()


def test_runs_alone_and_tidies_up(process: Callable[..., Process]) -> None:
    program = process("--model", "create2")
    assert program.status()["model"] == "create2"
    assert program.say("nonsense").startswith("error: ")
    assert program.process.stdin is not None
    assert program.process.stdout is not None
    program.process.stdin.write("wall on\n")
    program.process.stdin.flush()
    assert program.process.stdout.readline() == "ok\n"
    assert program.end(signal.SIGINT) == 130
    assert not program.link.is_symlink()
    assert not program._socket.exists()


def test_quit_ends_it_well(process: Callable[..., Process]) -> None:
    program = process()
    assert program.say("quit") == "ok"
    assert program.process.wait(LONG_S) == 0


def test_a_link_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("precious")
    words = ["create", "--link", str(tmp_path / "taken")]
    done = subprocess.run(
        [sys.executable, "-m", "florence_bt.simulation.emulators", *words],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert "cannot link" in done.stderr
    assert (tmp_path / "taken").read_text() == "precious"


# -- other people's clients; they are not among our dependencies ---------------------------------------------


@pytest.mark.slow
def test_pycreate2(process: Callable[..., Process]) -> None:
    pycreate2 = pytest.importorskip("pycreate2")
    program = process("--model", "create2")
    bot = pycreate2.Create2(str(program.link), 115200)
    bot.start()
    bot.full()
    bot.drive_direct(100, 50)  # right, left
    sensors = bot.get_sensors()
    assert (sensors.velocity_right, sensors.velocity_left, sensors.open_interface_mode) == (100, 50, 3)
    program.say("bump left")
    bumps = bot.get_sensors().bumps_wheeldrops
    assert bumps.bump_left or bumps.bump_right
    del bot  # its last words stop the base and leave the interface
    status = program.status()
    assert (status["mode"], status["wheels_mmps"], status["unknown_bytes"]) == ("off", [0, 0], 0)


@pytest.mark.slow
def test_pyroombaadapter(process: Callable[..., Process]) -> None:
    module = pytest.importorskip("pyroombaadapter")
    program = process("--model", "create2")
    adapter = module.PyRoombaAdapter(str(program.link))
    adapter.change_mode_to_full()
    adapter.send_drive_direct(200, 200)
    assert adapter.request_oi_mode() == 3
    assert adapter.request_capacity() == 2700
    adapter.data_stream_start(["OI Mode", "Voltage", "Angle"])
    assert [len(adapter.data_stream_read()) for _ in range(5)] == [3] * 5
    adapter.data_stream_stop()
    adapter.send_song_cmd(0, 2, [60, 64], [8, 8])
    adapter.send_play_cmd(0)
    assert program.status()["songs_played"] == [0]
    adapter.serial_con.close()
    adapter.serial_con = None


@pytest.mark.slow
def test_create_serial(process: Callable[..., Process]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        module = pytest.importorskip("create_serial")
    program = process()
    robot = module.Create(str(program.link))
    robot.toFullMode()
    assert robot.getMode() == 3
    robot.move(20, 20)  # by a script with a wait
    sensed = robot.sensors([module.VOLTAGE, module.OI_MODE])
    assert (sensed[module.VOLTAGE], sensed[module.OI_MODE]) == (16080, 3)
    assert program.status()["pose"][0] == pytest.approx(0.2, abs=0.01)
    robot.close()
