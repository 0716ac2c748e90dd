"""The emulated scanner alone: its lines of text, its line, its process, and other people's clients."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import serial

from florence_bt.core.errors import DeviceLost
from tests.emulators.program_bench import LONG_S, EmulatorProcess, Hand, documented_commands
from tools.emulators.scip_program import ScipOptions, ScipProgram


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Callable[..., ScipProgram]]:
    programs: list[ScipProgram] = []

    def made(**how: Any) -> ScipProgram:
        if "tcp_port" not in how:
            how["link"] = tmp_path / "laser"
        programs.append(ScipProgram(ScipOptions(**how), Hand()))
        return programs[-1]

    yield made
    for program in programs:
        program.close()


# -- lines of text -------------------------------------------------------------------------------------------


def test_every_fault_can_be_told(make: Callable[..., ScipProgram]) -> None:
    program = make()
    for line in (
        "silent on",
        "commands_lost on",
        "noise 12",
        "bad_checksums 3",
        "bad_replies 2",
        "partial 700",
        "scan_status 50",
        "every_scan_status 21",
        "status_of PP 0A",
        "laser_broken on",
        "stat Sensor is ill.",
        "freeze_timer on",
        "delay 0.5",
        "speed 1000",
        "power off",
        "",
    ):
        assert program.run(line) == "ok", line
    faults = program.scanner.faults
    assert (faults.silent, faults.commands_lost, len(faults.noise)) == (True, True, 12)
    assert (faults.bad_checksums, faults.bad_replies, faults.cut_scan_at) == (3, 2, 700)
    assert (faults.scan_status, faults.statuses, faults.laser_broken) == ("50", {"PP": "0A"}, True)
    assert faults.every_scan_status == "21"
    assert (faults.stat, faults.frozen_timer_ms) == ("Sensor is ill.", 0)
    assert (faults.delay_s, faults.bytes_per_second) == (0.5, 1000.0)
    assert not program.scanner.powered
    for line in ("status_of PP none", "every_scan_status none", "stat", "speed 0", "clear"):
        assert program.run(line) == "ok", line
    assert program.scanner.faults == type(faults)()
    assert program.scanner.powered


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("silnt on", "silent"),
        ("silent", "on, off"),
        ("noise -1", "a number from 0"),
        ("noise 1.5", "whole number"),
        ("delay x", "a number from 0"),
        ("scan_status 5", "not a status"),
        ("status_of PP", "PP 0A"),
    ],
)
def test_a_wrong_line_is_explained(make: Callable[..., ScipProgram], line: str, words: str) -> None:
    answer = make().run(line)
    assert answer.startswith("error: ")
    assert words in answer


def test_status_and_help(make: Callable[..., ScipProgram]) -> None:
    program = make(model="utm-30lx", scip1=True)
    found = json.loads(program.run("status"))
    assert (found["model"], found["plugged"], found["laser"], found["scip"]) == (
        "utm-30lx",
        True,
        False,
        "1.1",
    )
    commands = {line.split()[0] for line in program.run("help").splitlines()}
    assert commands == documented_commands("Hokuyo")


# -- the line ------------------------------------------------------------------------------------------------


def test_the_plug(make: Callable[..., ScipProgram], tmp_path: Path) -> None:
    program = make()
    assert program.path == str(tmp_path / "laser")
    program.run("unplug")
    assert not (tmp_path / "laser").exists()
    program.step()
    program.run("plug")
    with serial.Serial(program.path, timeout=0) as port:
        port.write(b"QT\n")
        answer = b""
        end = time.monotonic() + LONG_S
        while len(answer) < 8 and time.monotonic() < end:
            program.step()
            answer += port.read(100)
    assert answer == b"QT\n00P\n\n"


def conversation(program: ScipProgram, peer: socket.socket, command: bytes, size: int) -> bytes:
    peer.sendall(command)
    peer.setblocking(False)
    answer = b""
    end = time.monotonic() + LONG_S
    while len(answer) < size and time.monotonic() < end:
        program.step()
        try:
            answer += peer.recv(4096)
        except BlockingIOError:
            continue
    return answer


def test_one_client_after_the_other_by_tcp(make: Callable[..., ScipProgram]) -> None:
    program = make(tcp_port=0)
    host, number = program.path.split(":")
    for _ in range(2):
        with socket.create_connection((host, int(number))) as peer:
            assert conversation(program, peer, b"QT\n", 8) == b"QT\n00P\n\n"
        end = time.monotonic() + LONG_S
        while program._line is not None and program._line.has_client and time.monotonic() < end:
            program.step()
    program.unplug()
    with pytest.raises(OSError):
        socket.create_connection((host, int(number)), timeout=1.0)
    program.plug()
    assert program.path == f"{host}:{number}"


def test_a_port_that_is_taken(make: Callable[..., ScipProgram]) -> None:
    program = make(tcp_port=0)
    with pytest.raises(DeviceLost, match="cannot listen at"):
        make(tcp_port=int(program.path.split(":")[1]))


# -- the process ---------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_process(start: Callable[..., EmulatorProcess], tmp_path: Path) -> None:
    program = start("scip", "--link", str(tmp_path / "laser"))
    assert program.path == str(tmp_path / "laser")
    program.type("status\nscan_status 50\n")
    assert json.loads(program.read())["model"] == "urg-04lx"
    assert program.read() == "ok\n"
    with serial.Serial(program.path, timeout=LONG_S) as port:
        port.write(b"MD0044072501001\n")
        assert port.read_until(b"\n\n") == b"MD0044072501001\n00P\n\n"
        assert port.read_until(b"\n\n") == b"MD0044072501000\n50U\n\n"
    assert program.end() == 0
    assert not (tmp_path / "laser").exists()


# -- other people's clients ----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_hokuyolx(start: Callable[..., EmulatorProcess]) -> None:
    """hokuyolx 0.9 over TCP: information, time, single scans, streams, intensities, states and resets.

    On a busy machine it takes two replies that wait for it as one, unless it reads byte by byte, and asks for
    the time again and again when scans come late, unless it tolerates that.
    """
    hokuyolx = pytest.importorskip("hokuyolx")
    program = start("scip", "--model", "utm-30lx", "--tcp", "0")
    address = ("127.0.0.1", int(program.path.split(":")[1]))
    patient = {"buf": 1, "timeout": LONG_S, "time_tolerance": 1000 * LONG_S}
    with closing(hokuyolx.HokuyoLX(addr=address, **patient)) as laser:
        _use_hokuyolx(laser)


def _use_hokuyolx(laser: Any) -> None:
    assert (laser.amin, laser.amax, laser.ares, laser.scan_freq) == (0, 1080, 1440, 40)
    assert laser.version()["SERI"] == "H1000001"
    assert laser.sensor_state()["STAT"] == "Stable 000 no error."
    _, distances = laser.get_dist()
    assert (len(distances), distances[540]) == (1081, 3000)
    _, pairs = laser.get_intens(start=500, end=599)
    assert pairs.shape == (100, 2)
    assert len(list(laser.iter_dist(scans=20))) == 20
    scans = [scan for scan, _, _ in laser.iter_intens(scans=10, skips=1, start=100, end=500)]
    assert [scan.shape for scan in scans] == [(401, 2)] * 10
    laser.standby()
    assert laser.laser_state()[0] == 0
    laser.sleep()
    assert laser.laser_state()[0] == 5
    assert laser.activate()[0] == 0
    laser.reset()
    laser.partial_reset()
    laser.reboot()


@pytest.mark.slow
@pytest.mark.parametrize(("words", "answer"), [((), b"SCIP2.0\n00P\n\n"), (("short",), b"SCIP2.0\n0\n\n")])
def test_the_ways_out_of_scip_1_1(
    start: Callable[..., EmulatorProcess], words: tuple[str, ...], answer: bytes
) -> None:
    program = start("scip", "--tcp", "0", "--scip1", *words)
    host, port = program.path.split(":")
    with closing(socket.create_connection((host, int(port)), LONG_S)) as line:
        line.sendall(b"SCIP2.0\n")
        heard = b""
        while len(heard) < len(answer):
            heard += line.recv(100)
    assert heard == answer
