"""The emulated Create alone: its lines of text, its line, its process, and other people's clients."""

from __future__ import annotations

import fcntl
import json
import os
import signal
import subprocess
import sys
import termios
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import serial

from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from tests.emulators.program_bench import EMULATORS, LONG_S, EmulatorProcess, Hand, documented_commands
from tools.emulators.__main__ import main
from tools.emulators.create_program import CreateOptions, CreateProgram
from tools.emulators.modem_lines import pretended_modem_lines


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Callable[..., CreateProgram]]:
    programs: list[CreateProgram] = []

    def made(clock: Hand | None = None, **how: Any) -> CreateProgram:
        if "tcp_port" not in how:
            how["link"] = tmp_path / "create"
        programs.append(CreateProgram(CreateOptions(**how), clock or Hand()))
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
    run, faults = program.run, program.create.faults
    for line in (
        "silent on",
        "commands_lost on",
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
        "power off",
        "",
    ):
        assert run(line) == "ok", line
    assert (faults.silent, faults.commands_lost, len(faults.noise), faults.bad_checksums) == (
        True,
        True,
        12,
        3,
    )
    assert (faults.partial_frames, faults.wheel_drops) == (2, 24)
    assert (faults.left_bumper, faults.right_bumper) == (False, True)
    assert faults.cliffs == (False, True, False, True)
    assert (faults.wall, faults.virtual_wall, faults.charger, faults.dock) == (True,) * 4
    assert (faults.charging_fault, program.create.battery.charge_mah) == (True, 1350.0)
    assert (faults.buttons, faults.infrared, faults.digital_inputs, faults.overcurrents) == (5, 250, 5, 24)
    assert (faults.gyro_drift, faults.gyro_dead) == (0.5, True)
    assert (faults.light_bumps, faults.oi_mode_offset) == ((1, 2, 3, 4, 5, 6), 1)
    assert not program.create.powered
    assert run("cliff all") == "ok"
    assert faults.cliffs == (True,) * 4
    assert run("clear") == "ok"
    assert not any((faults.silent, faults.noise, faults.wheel_drops, any(faults.cliffs), faults.gyro_dead))
    assert program.create.powered


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
    answer = make().run(line)
    assert answer.startswith("error: ")
    assert hint in answer


def test_status_and_help(make: Callable[..., CreateProgram]) -> None:
    program = make()
    status = json.loads(program.run("status"))
    assert (status["model"], status["mode"], status["plugged"], status["pose"]) == (
        "create",
        "off",
        True,
        [0.0, 0.0, 0.0],
    )
    commands = {line.split()[0] for line in program.run("help").splitlines()}
    assert commands == documented_commands("iRobot Create")


# -- the line ------------------------------------------------------------------------------------------------


def test_a_client_drives_the_base(make: Callable[..., CreateProgram]) -> None:
    clock = Hand()
    program = make(clock)
    with serial.Serial(program.path, 57600, timeout=0.01) as port:
        assert ask(program, port, bytes([128, 132, 142, 35]), 1) == b"\x03"
        port.write(bytes([145, 0, 100, 0, 100]))
        while program.create.wheels == (0, 0):
            program.step()
        clock.now += 2.0
        program.step()
        assert json.loads(program.run("status"))["pose"] == [0.2, 0.0, 0.0]
        assert ask(program, port, bytes([142, 19]), 2) == bytes([0, 200])


def test_a_script_ends_where_it_should_although_the_emulator_was_held_up(
    make: Callable[..., CreateProgram],
) -> None:
    clock = Hand()
    program = make(clock)
    drive, wait, stop = [145, 0, 200, 0, 200], [156, 0, 100], [145, 0, 0, 0, 0]
    with serial.Serial(program.path, 57600, timeout=0.01) as port:
        port.write(bytes([128, 132, 152, 13, *drive, *wait, *stop, 153]))
        while program.create.wheels == (0, 0):
            program.step()
        clock.now += 5.0
        program.step()
    assert program.create.wheels == (0, 0)
    assert json.loads(program.run("status"))["pose"] == [pytest.approx(0.1, abs=0.002), 0.0, 0.0]


def test_unplug_and_plug(make: Callable[..., CreateProgram], tmp_path: Path) -> None:
    program = make()
    port = serial.Serial(program.path, 57600, timeout=0.01)
    program.run("unplug")
    program.step()
    with pytest.raises((OSError, serial.SerialException)):
        port.read(1)
        port.write(b"x")
    port.close()
    assert not (tmp_path / "create").exists()
    program.run("plug")
    with serial.Serial(program.path, 57600, timeout=0.01) as again:
        assert ask(program, again, bytes([128, 142, 35]), 1) == b"\x01"


def test_the_wrong_speed_is_garbage_when_strict(make: Callable[..., CreateProgram]) -> None:
    program = make(strict_baud=True)
    with serial.Serial(program.path, 115200, timeout=0.01) as port:
        port.write(bytes([128, 132, 142, 35]))
        while program.create.unknown_bytes < 4:
            program.step()
        assert program.create.mode == 0
        port.baudrate = 57600
        assert ask(program, port, bytes([128, 142, 35]), 1) == b"\x01"


def test_answers_leave_later(make: Callable[..., CreateProgram]) -> None:
    """Some clients send a question, and then throw away what they have not read yet."""
    clock = Hand()
    program = make(clock, latency_s=0.005)
    with serial.Serial(program.path, 57600, timeout=0) as port:
        port.write(bytes([128, 142, 35]))
        while program.create.mode == 0:
            program.step()
        program.step()
        assert port.in_waiting == 0
        assert program._longest_wait() == pytest.approx(0.005)
        clock.now += 0.006
        assert ask(program, port, b"", 1) == b"\x01"


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


@pytest.fixture
def process(start: Callable[..., EmulatorProcess], tmp_path: Path) -> Callable[..., EmulatorProcess]:
    return partial(start, "create", "--link", str(tmp_path / "create"))


def test_runs_alone_and_tidies_up(process: Callable[..., EmulatorProcess]) -> None:
    program = process("--model", "create2")
    assert program.status()["model"] == "create2"
    assert program.say("nonsense").startswith("error: ")
    program.type("wall on\n")
    assert program.read() == "ok\n"
    assert program.end(signal.SIGINT) == 130
    assert not Path(program.path).is_symlink()
    assert not program.control.exists()


def test_quit_ends_it_well(process: Callable[..., EmulatorProcess]) -> None:
    program = process()
    assert program.say("quit") == "ok"
    assert program.process.wait(LONG_S) == 0


def test_a_link_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("precious")
    words = ["create", "--link", str(tmp_path / "taken")]
    done = subprocess.run(
        [sys.executable, EMULATORS, *words],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert "cannot link" in done.stderr
    assert (tmp_path / "taken").read_text() == "precious"


@pytest.mark.parametrize("wrong", ["-1", "x", "nan", "11"])
def test_a_wrong_latency_is_explained(wrong: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["create", "--latency", wrong])
    assert "a number from 0 to 10 is needed" in capsys.readouterr().err


def test_a_client_by_tcp(make: Callable[..., CreateProgram]) -> None:
    program = make(tcp_port=0)
    with serial.serial_for_url(f"socket://{program.path}", timeout=0.01) as port:
        port.rts = True  # a network has no such line, and pyserial does not mind
        assert ask(program, port, bytes([128, 142, 35]), 1) == b"\x01"


# -- other people's clients; they are not among our dependencies ---------------------------------------------


@pytest.mark.slow
def test_pycreate2(process: Callable[..., EmulatorProcess]) -> None:
    pycreate2 = pytest.importorskip("pycreate2")
    program = process("--model", "create2")
    bot = pycreate2.Create2(program.path, 115200)
    bot.SCI.ser.timeout = LONG_S  # a second is short on a busy machine
    with pretended_modem_lines():
        bot.wake()
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
def test_pyroombaadapter(process: Callable[..., EmulatorProcess]) -> None:
    module = pytest.importorskip("pyroombaadapter")
    program = process("--model", "create2")
    adapter = module.PyRoombaAdapter(program.path)
    adapter.serial_con.timeout = LONG_S
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
def test_create_serial(process: Callable[..., EmulatorProcess]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        module = pytest.importorskip("create_serial")
    program = process()
    # It takes half a second without an answer for an answer, so on a busy machine it may fail by itself. It
    # gets some chances; what the emulator does wrong fails each time.
    for chances_left in reversed(range(5)):
        with closing(module.Create(program.path)) as robot:
            try:
                _use_create_serial(module, robot, program)
                return
            except Exception:
                if not chances_left:
                    raise


def _use_create_serial(module: Any, robot: Any, program: EmulatorProcess) -> None:
    before = program.status()["pose"][0]
    robot.toFullMode()
    assert robot.getMode() == 3
    robot.move(20, 20)  # by a script with a wait
    sensed = robot.sensors([module.VOLTAGE, module.OI_MODE])
    # Of a full battery, which is hardly used by then.
    assert (sensed[module.VOLTAGE], sensed[module.OI_MODE]) == (pytest.approx(16080, abs=200), 3)
    assert program.status()["pose"][0] - before == pytest.approx(0.2, abs=0.01)


@pytest.mark.slow
def test_a_base_that_keeps_what_comes_during_a_wait(process: Callable[..., EmulatorProcess]) -> None:
    program = process("--keep-input")
    with serial.Serial(program.path, 57600, timeout=LONG_S) as port:
        port.write(bytes([128, 155, 2]))
        port.write(bytes([142, 35]))
        assert port.read(1) == b"\x01"
