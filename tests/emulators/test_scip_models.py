"""What the two scanners differ in, and the faults that are told on command, byte by byte."""

import numpy as np
import pytest
from numpy.typing import NDArray

from florence_bt.simulation.emulators.scip import ScipEmulator
from florence_bt.simulation.emulators.scip_models import MODELS, URG_04LX, UTM_30LX
from tools.emulators.scip_program import ScipRoom


class Ramp:
    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        return np.arange(1000 + first_step, 1001 + last_step, dtype=np.int32)


@pytest.fixture
def utm() -> ScipEmulator:
    return ScipEmulator(Ramp(), model=UTM_30LX)


@pytest.fixture
def urg() -> ScipEmulator:
    return ScipEmulator(Ramp(), model=URG_04LX)


def status(scanner: ScipEmulator, command: str, now: float = 0.0) -> str:
    return scanner.receive(command.encode() + b"\n", now).split(b"\n")[1][:2].decode()


def decode(text: bytes) -> list[int]:
    return [
        ((a - 48) << 12) | ((b - 48) << 6) | (c - 48)
        for a, b, c in zip(text[::3], text[1::3], text[2::3], strict=True)
    ]


def data_of(reply: bytes) -> bytes:
    return b"".join(line[:-1] for line in reply.split(b"\n")[3:-2])


def test_a_utm_tells_its_numbers(utm: ScipEmulator) -> None:
    text = utm.receive(b"PP\n", 0.0)
    for line in (b"DMIN:23;", b"DMAX:60000;", b"ARES:1440;", b"AMIN:0;", b"AMAX:1080;", b"AFRT:540;"):
        assert line in text
    assert b"SCAN:2400;" in text


def test_distances_and_intensities(utm: ScipEmulator) -> None:
    utm.receive(b"BM\n", 0.0)
    reply = utm.receive(b"GE0100013001\n", 0.0)
    values = decode(data_of(reply))
    assert values[::2] == list(range(1100, 1131))
    assert values[1::2] == [4_000_000 // distance for distance in values[::2]]
    assert [len(line) for line in reply.split(b"\n")[3:-2]] == [65, 65, 59]


def test_a_stream_of_intensities(utm: ScipEmulator) -> None:
    assert utm.receive(b"ME0000108000002\n", 0.0) == b"ME0000108000002\n00P\n\n"
    sent = [data for step in range(100) if (data := utm.poll(step * 0.001))]
    assert [data.split(b"\n")[0] for data in sent] == [b"ME0000108000001", b"ME0000108000000"]
    assert len(decode(data_of(sent[0]))) == 2 * 1081


def test_commands_that_only_one_of_them_knows(urg: ScipEmulator, utm: ScipEmulator) -> None:
    for command in ("ME0000001001000", "GE0000001001", "RT", "%SL", "%ST"):
        assert status(urg, command) == "0E"
    assert (status(urg, "CR05"), status(utm, "CR05")) == ("00", "04")
    assert (status(utm, "RT"), status(utm, "%SL")) == ("00", "00")


def test_the_states_of_a_utm(utm: ScipEmulator) -> None:
    def state() -> bytes:
        return utm.receive(b"%ST\n", 0.0).split(b"\n")[2][:3]

    states = [state()]
    for command in (b"BM", b"MD0000108001000", b"QT", b"%SL", b"BM", b"TM0", b"TM2"):
        utm.receive(command + b"\n", 0.0)
        states.append(state())
    assert states == [b"000", b"003", b"004", b"000", b"005", b"003", b"002", b"000"]


def test_the_resets_differ_in_the_speed_of_the_line(utm: ScipEmulator) -> None:
    utm.receive(b"SS115200\n", 0.0)
    assert utm.receive(b"RT\n", 5.0) == b"RT\n00P\n\n"
    information = utm.receive(b"II\n", 5.0)
    assert b"SBPS:115200" in information
    assert b"TIME:000000" in information
    utm.receive(b"RS\n", 5.0)
    assert b"SBPS:19200" in utm.receive(b"II\n", 5.0)


def test_a_restart_must_be_asked_for_twice(urg: ScipEmulator) -> None:
    urg.receive(b"BM\n", 0.0)
    assert status(urg, "RB") == "01"
    assert status(urg, "VV") == "00"
    assert status(urg, "RB") == "01"
    assert urg.laser_on
    assert status(urg, "RB") == "00"
    assert not urg.laser_on


def test_information_is_given_in_time_mode_too(urg: ScipEmulator) -> None:
    urg.receive(b"TM0\n", 0.0)
    assert [status(urg, command) for command in ("VV", "II", "PP")] == ["00", "00", "0E"]


def test_answers_on_command(urg: ScipEmulator) -> None:
    urg.faults.statuses.update({"PP": "0A", "TM1": "0B"})
    assert urg.receive(b"PP\n", 0.0) == b"PP\n0Aa\n\n"
    assert urg.receive(b"TM0\n", 0.0) == b"TM0\n00P\n\n"
    assert urg.receive(b"TM1\n", 0.0) == b"TM1\n0Bb\n\n"
    urg.faults.bad_replies = 1
    assert urg.receive(b"TM2\n", 0.0) == b"TM2\n00Q\n\n"
    assert urg.receive(b"BM\n", 0.0) == b"BM\n00P\n\n"


def test_deaf(urg: ScipEmulator) -> None:
    urg.faults.commands_lost = True
    assert urg.receive(b"VV\n", 0.0) == b""
    urg.faults.commands_lost = False
    assert urg.receive(b"QT\n", 0.0) == b"QT\n00P\n\n"


def test_slow_answers(urg: ScipEmulator) -> None:
    urg.faults.delay_s = 0.5
    assert urg.receive(b"QT\n", 1.0) == b""
    assert urg.next_deadline() == 1.5
    assert urg.poll(1.49) == b""
    assert urg.poll(1.5) == b"QT\n00P\n\n"
    urg.faults.delay_s, urg.faults.bytes_per_second = 0.0, 10.0
    assert urg.receive(b"QT\n", 2.0) == b""
    assert urg.poll(2.35) == b"QT\n"
    urg.faults.bytes_per_second = None
    assert urg.poll(2.36) == b"00P\n\n"
    assert urg.next_deadline() is None


def test_the_room() -> None:
    for model in MODELS.values():
        room = ScipRoom(model)
        ahead, turn = model.number("AFRT"), model.number("ARES")
        assert room.measure(ahead, ahead).tolist() == [3000]
        assert room.measure(ahead + turn // 4, ahead + turn // 4).tolist() == [2000]
        assert room.measure(ahead - turn // 4, ahead - turn // 4).tolist() == [1500]
        pillar = ahead + round(np.arctan2(0.5, 1.5) / (2 * np.pi) * turn)
        assert room.measure(pillar, pillar)[0] == pytest.approx(1000 * (np.hypot(1.5, 0.5) - 0.15), abs=2)
        noisy = ScipRoom(model, seed=1)
        assert noisy.measure(0, 700).tolist() == ScipRoom(model, seed=1).measure(0, 700).tolist()
        assert noisy.measure(0, 700).tolist() != room.measure(0, 700).tolist()
