"""The emulated URG-04LX against the manual's examples, byte by byte."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from florence_bt.simulation.emulators.scip import ScipEmulator


class Ramp:
    """A world whose distance is 1000 mm plus the step number; every measurement is noted."""

    def __init__(self) -> None:
        self.asked: list[tuple[int, int]] = []

    def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
        self.asked.append((first_step, last_step))
        return np.arange(1000 + first_step, 1001 + last_step, dtype=np.int32)


@pytest.fixture
def scanner() -> ScipEmulator:
    return ScipEmulator(Ramp())


def decode(text: str) -> int:
    value = 0
    for character in text:
        value = value * 64 + ord(character) - 48
    return value


def sums_fit(line: str) -> bool:
    return (sum(line[:-1].encode()) & 63) + 48 == ord(line[-1])


def run(scanner: ScipEmulator, start: float, stop: float, step: float = 0.01) -> list[tuple[float, bytes]]:
    sent = []
    for count in range(round((stop - start) / step) + 1):
        now = start + count * step
        if data := scanner.poll(now):
            sent.append((now, data))
    return sent


def test_pp_vector(scanner: ScipEmulator) -> None:
    assert scanner.receive(b"PP\n", 0.0) == (
        b"PP\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nDMIN:20;4\nDMAX:5600;_\nARES:1024;\\\n"
        b"AMIN:44;7\nAMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n"
    )


def test_the_published_reply_to_ii(scanner: ScipEmulator) -> None:
    # Of an URG-04LX, from the wiki of the URG network; hosts such as hokuyoaist insist on this form.
    scanner.set_timer(0x081615, 0.0)
    assert scanner.receive(b"II\n", 0.0) == (
        b"II\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nLASR:OFF;7\n"
        b"SCSP:Initial(600[rpm])<-Default setting by user;A\nMESM:IDLE;:\n"
        b"SBPS:19200[bps]<-Default setting by user;A\nTIME:081615;N\nSTAT:Sensor works well.;8\n\n"
    )


def test_vv_and_ii(scanner: ScipEmulator) -> None:
    version = scanner.receive(b"VV\n", 0.0).decode().splitlines()
    assert [line.split(":")[0] for line in version[2:-1]] == ["VEND", "PROD", "FIRM", "PROT", "SERI"]
    information = scanner.receive(b"II\n", 0.0).decode().splitlines()
    tags = [line.split(":")[0] for line in information[2:-1]]
    assert tags == ["MODL", "LASR", "SCSP", "MESM", "SBPS", "TIME", "STAT"]
    assert "STAT:Sensor works well." in information[-2]


def test_time_vector(scanner: ScipEmulator) -> None:
    assert scanner.receive(b"TM0\n", 0.0) == b"TM0\n00P\n\n"
    scanner.set_timer(16_000_000, 5.0)
    assert scanner.receive(b"TM1\n", 5.0) == b"TM1\n00P\nm2@0?\n\n"


def test_the_timer_wraps_after_24_bits(scanner: ScipEmulator) -> None:
    scanner.receive(b"TM0\n", 0.0)
    scanner.set_timer((1 << 24) - 10, 0.0)
    assert scanner.receive(b"TM1\n", 0.020).split(b"\n")[2][:4] == b"000:"


def test_measurement_acceptance_vector(scanner: ScipEmulator) -> None:
    assert scanner.receive(b"MD0044072501000\n", 0.0) == b"MD0044072501000\n00P\n\n"


def test_a_stream_of_scans(scanner: ScipEmulator) -> None:
    scanner.receive(b"MD0044072501000\n", 0.0)
    sent = run(scanner, 0.0, 1.0)
    assert len(sent) == 10
    lines = sent[3][1].decode().split("\n")
    assert lines[:2] == ["MD0044072501000", "99b"]
    assert lines[-2:] == ["", ""]
    assert all(sums_fit(line) for line in lines[1:-2])
    assert decode(lines[2][:4]) == 300
    data = "".join(line[:-1] for line in lines[3:-2])
    assert [len(line) for line in lines[3:-2]] == [65] * 31 + [63]
    assert [decode(data[at : at + 3]) for at in range(0, len(data), 3)] == list(range(1044, 1726))
    # A scan leaves when step 725 has passed: 70.9 ms after step 0.
    assert sent[0][0] == pytest.approx(0.08)


def test_the_world_is_measured_when_the_beam_looks_ahead(scanner: ScipEmulator) -> None:
    scanner.receive(b"MD0044072501000\n", 0.0)
    assert scanner.next_deadline() == pytest.approx(384 * 0.1 / 1024)
    scanner.poll(0.0376)
    assert scanner.next_deadline() == pytest.approx(726 * 0.1 / 1024)
    assert scanner.poll(0.0709) != b""
    assert scanner.next_deadline() == pytest.approx(0.1 + 384 * 0.1 / 1024)


def test_a_counted_stream_ends_and_the_laser_goes_off(scanner: ScipEmulator) -> None:
    scanner.receive(b"MS0384038601003\n", 0.0)
    assert scanner.laser_on
    echoes = [data.split(b"\n")[0] for _, data in run(scanner, 0.0, 2.0)]
    assert echoes == [b"MS0384038601002", b"MS0384038601001", b"MS0384038601000"]
    assert not scanner.laser_on
    assert scanner.next_deadline() is None


def test_skipped_turns(scanner: ScipEmulator) -> None:
    scanner.receive(b"MD0044072501200\n", 0.0)
    assert len(run(scanner, 0.0, 3.0)) == 10


def test_missed_turns_are_gone(scanner: ScipEmulator) -> None:
    scanner.receive(b"MD0044072501000\n", 0.0)
    lines = scanner.poll(10.0).decode().split("\n")
    assert decode(lines[2][:4]) == 9900
    assert scanner.poll(10.0) == b""


def test_clusters_take_the_smallest_valid_value() -> None:
    class Codes:
        def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
            return np.array([6, 900, 800, 7, 6, 19, 30], np.int32)

    scanner = ScipEmulator(Codes())
    scanner.receive(b"BM\n", 0.0)
    lines = scanner.receive(b"GD0100010603\n", 0.0).decode().split("\n")
    assert [decode(lines[3][at : at + 3]) for at in (0, 3, 6)] == [800, 6, 30]


def test_steps_that_the_sensor_cannot_see() -> None:
    plant = Ramp()
    scanner = ScipEmulator(plant)
    scanner.receive(b"BM\n", 0.0)
    lines = scanner.receive(b"GD0000076801\n", 0.0).decode().split("\n")
    data = "".join(line[:-1] for line in lines[3:-2])
    values = [decode(data[at : at + 3]) for at in range(0, len(data), 3)]
    assert plant.asked == [(44, 725)]
    assert values == [19] * 44 + list(range(1044, 1726)) + [19] * 43


def test_two_characters_end_at_4095() -> None:
    class Far:
        def measure(self, first_step: int, last_step: int) -> NDArray[np.int32]:
            return np.array([4094, 4095, 5600], np.int32)

    scanner = ScipEmulator(Far())
    scanner.receive(b"BM\n", 0.0)
    assert scanner.receive(b"GS0384038601\n", 0.0).split(b"\n")[3][:6] == b"onoooo"


@pytest.mark.parametrize(
    ("request_text", "status"),
    [
        ("MD00x4072501000", "01"),
        ("MD004407250100", "0C"),
        ("MD0044x72501000", "02"),
        ("MD00440725x1000", "03"),
        ("MD0044076901000", "04"),
        ("MD0044004301000", "05"),
        ("MD0044072501x00", "06"),
        ("MD00440725010x0", "07"),
        ("GD0044072501", "10"),
        ("GDx044072501", "01"),
        ("XX", "0E"),
        ("V", "0E"),
        ("VVV", "0E"),
        ("SCIP2.0", "0E"),
        ("TM", "0C"),
        ("TM3", "01"),
        ("TM1", "04"),
        ("TM2", "03"),
        ("SS01920x", "01"),
        ("SS012345", "02"),
        ("SS019200", "03"),
        ("SS115200", "00"),
        ("CR0x", "01"),
        ("CR11", "02"),
        ("CR00", "03"),
        ("CR05", "00"),
        ("CR99", "00"),
        ("HS2", "01"),
        ("HS0", "02"),
        ("HS1", "00"),
        ("VV;12345678901234567", "0G"),
        ("VV;a/b", "0H"),
        ("BM;hello", "00"),
    ],
)
def test_statuses(scanner: ScipEmulator, request_text: str, status: str) -> None:
    lines = scanner.receive(request_text.encode() + b"\n", 0.0).decode().split("\n")
    assert lines[0] == request_text
    assert lines[1][:2] == status
    assert sums_fit(lines[1])


def test_time_mode_refuses_everything_else(scanner: ScipEmulator) -> None:
    scanner.receive(b"BM\n", 0.0)
    scanner.receive(b"TM0\n", 0.0)
    assert not scanner.laser_on
    for command in (b"BM", b"RS", b"QT", b"MD0044072501000"):
        assert scanner.receive(command + b"\n", 0.0) == command + b"\n0Ee\n\n"
    assert scanner.receive(b"TM0\n", 0.0) == b"TM0\n02R\n\n"
    assert scanner.receive(b"TM2\n", 0.0) == b"TM2\n00P\n\n"
    assert scanner.receive(b"BM\n", 0.0) == b"BM\n00P\n\n"
    assert scanner.receive(b"BM\n", 0.0) == b"BM\n02R\n\n"


def test_stop_and_reset(scanner: ScipEmulator) -> None:
    scanner.receive(b"MD0044072501000\n", 0.0)
    assert scanner.receive(b"MD0044072501000\n", 0.0) == b"MD0044072501000\n0Bb\n\n"
    assert scanner.receive(b"QT\n", 0.0) == b"QT\n00P\n\n"
    assert run(scanner, 0.0, 1.0) == []
    assert not scanner.laser_on
    scanner.receive(b"CR10\n", 1.0)
    assert b"SCSP:10%down(540[rpm]);" in scanner.receive(b"II\n", 1.0)
    scanner.receive(b"RS\n", 1.0)
    assert b"SCSP:Initial(600[rpm])<-Default" in scanner.receive(b"II\n", 1.0)


def test_a_slower_motor(scanner: ScipEmulator) -> None:
    scanner.receive(b"CR10\n", 0.0)
    scanner.receive(b"MD0044072501000\n", 0.0)
    assert len(run(scanner, 0.0, 9.98)) == 90


def test_scip_1_1_until_told_otherwise() -> None:
    scanner = ScipEmulator(Ramp(), speaks_scip1=True)
    assert scanner.receive(b"QT\n", 0.0) == b"QT\nE\n\n"
    who = scanner.receive(b"V\n", 0.0).split(b"\n")
    assert who[:2] == [b"V", b"0"]
    assert [line[:5] for line in who[2:]] == [b"VEND:", b"PROD:", b"FIRM:", b"PROT:", b"SERI:", b"", b""]
    assert scanner.receive(b"SCIP2.0\n", 0.0) == b"SCIP2.0\n00P\n\n"  # REFERENCE 4.3 and 4.6
    assert scanner.receive(b"QT\n", 0.0) == b"QT\n00P\n\n"


def test_the_short_answer_of_the_manual() -> None:
    scanner = ScipEmulator(Ramp(), speaks_scip1=True, short_status=True)
    assert scanner.receive(b"SCIP2.0\n", 0.0) == b"SCIP2.0\n0\n\n"
    assert scanner.receive(b"SCIP2.0\n", 0.0) == b"SCIP2.0\n0Ee\n\n"  # it speaks 2.0 already


def test_power(scanner: ScipEmulator) -> None:
    scanner.receive(b"MD0044072501000\nPP", 0.0)
    scanner.set_power(False, 0.5)
    assert not scanner.powered
    assert scanner.receive(b"VV\n", 0.6) == b""
    assert run(scanner, 0.6, 1.0) == []
    scanner.set_power(True, 1.0)
    assert not scanner.measuring
    assert scanner.receive(b"QT\n", 1.0) == b"QT\n00P\n\n"


def test_faults(scanner: ScipEmulator) -> None:
    scanner.receive(b"MD0044072501000\n", 0.0)
    scanner.faults.noise = b"\xff\x00"
    scanner.faults.cut_scan_at = 100
    first, second = (data for _, data in run(scanner, 0.0, 0.2))
    assert first[:2] == b"\xff\x00"
    assert len(first) == 102
    assert second.endswith(b"\n\n")
    scanner.faults.bad_checksums = 1
    bad, good = (data.decode().split("\n") for _, data in run(scanner, 0.2, 0.4))
    assert [sums_fit(line) for line in bad[1:-2]] == [True] * 33 + [False]
    assert all(sums_fit(line) for line in good[1:-2])
    scanner.faults.silent = True
    assert run(scanner, 0.4, 0.6) == []
    scanner.faults.silent = False
    scanner.faults.scan_status = "50"
    assert [data for _, data in run(scanner, 0.6, 1.0)] == [b"MD0044072501000\n50U\n\n"]
    scanner.faults.laser_broken = True
    assert scanner.receive(b"BM\n", 1.0) == b"BM\n01Q\n\n"
    scanner.faults.stat = "Sensor is ill."
    assert b"STAT:Sensor is ill." in scanner.receive(b"II\n", 1.0)


@settings(deadline=None)
@given(st.lists(st.binary(max_size=40), max_size=20))
def test_any_input_is_survived(pieces: list[bytes]) -> None:
    scanner = ScipEmulator(Ramp())
    for piece in pieces:
        scanner.receive(piece, 0.0)
    answer = scanner.receive(b"\n\nTM2\nRS\n", 0.0)
    assert answer.endswith(b"RS\n00P\n\n")


def test_requests_in_pieces_and_with_cr(scanner: ScipEmulator) -> None:
    assert scanner.receive(b"Q", 0.0) == b""
    assert scanner.receive(b"T\r\nBM\r", 0.0) == b"QT\n00P\n\nBM\n00P\n\n"
