"""SCIP 2.0 on the wire. The bytes here are written by hand or by the small writer below, from the manual."""

import tracemalloc
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import ChecksumError, ConfigError, FrameError
from florence_bt.drivers.hokuyo.codec import (
    LONGEST_FRAME,
    Measurement,
    ReplyParser,
    ScipReply,
    checksum,
    decode_values,
    parse_frame,
    request,
    serial_speed,
    time_mode,
)
from florence_bt.drivers.hokuyo.status import describe_status, goes_on_by_itself, is_checking
from tests.sweeps import examples
from tests.unit.drivers.scip_writer import PP, encode, information, scan_bytes, summed

STATUSES = ["00", "01", "02", "03", "04", "05", "06", "07", "10", "99"]
STATUSES += ["0A", "0B", "0C", "0D", "0E", "0F", "0G", "0H", "0I"]


@pytest.mark.parametrize(
    ("status", "letter"),
    list(zip(STATUSES, "PQRSTUVWQbabcdefghi", strict=True)),
)
def test_status_sums(status: str, letter: str) -> None:
    assert checksum(status.encode()) == ord(letter)


def test_requests() -> None:
    assert request("VV") == b"VV\n"
    assert request(Measurement("MD", 44, 725, 1).command) == b"MD0044072501000\n"
    assert request(Measurement("GD", 44, 725, 1).command) == b"GD0044072501\n"
    assert Measurement("MD", 0, 768, 3, 2, 10).command == "MD0000076803210"


def test_time_vector() -> None:
    (reply,) = ReplyParser().feed(b"TM1\n00P\nm2@0?\n\n")
    assert reply == ScipReply("TM1", "00", (b"m2@0",))
    assert decode_values(reply.lines[0], 4)[0] == 16_000_000


def test_measurement_acceptance_vector() -> None:
    assert ReplyParser().feed(b"MD0044072501000\n00P\n\n") == [ScipReply("MD0044072501000", "00")]


def test_information_sums_cover_the_text_before_the_semicolon() -> None:
    (reply,) = ReplyParser().feed(PP)
    assert reply.information() == {
        "MODL": "URG-04LX(Hokuyo Automatic Co.,Ltd.)",
        "DMIN": "20",
        "DMAX": "5600",
        "ARES": "1024",
        "AMIN": "44",
        "AMAX": "725",
        "AFRT": "384",
        "SCAN": "600",
    }


def test_an_information_line_whose_sum_is_a_semicolon() -> None:
    text = next(b"SERI:%d" % n for n in range(2000) if checksum(b"SERI:%d" % n) == ord(";"))
    (reply,) = ReplyParser().feed(b"VV\n00P\n" + text + b";;\n\n")
    assert reply.lines == (text,)


def test_an_information_line_without_a_colon_is_refused() -> None:
    (reply,) = ReplyParser().feed(b"VV\n00P\n" + b"SERI" + b";" + summed(b"SERI")[-1:] + b"\n\n")
    with pytest.raises(FrameError):
        reply.information()


PUBLISHED = (
    b"MODL:URG-04LX(Hokuyo Automatic Co.,Ltd.)",
    b"LASR:OFF",
    b"SCSP:Initial(600[rpm])<-Default setting by user",
    b"STAT: Sensor works well.",
)


def test_the_sum_of_a_remark_may_be_missing() -> None:
    # An URG-04LX sums the remark as well (the URG network's wiki), a UTM-30LX does not (hokuyoaist).
    urg = information(b"II", *PUBLISHED)
    assert b"user;A\n" in urg
    utm = urg.replace(b"user;A\n", b"user;[\n")
    for reply in (urg, utm):
        (found,) = ReplyParser().feed(reply)
        assert found.information()["SCSP"] == "Initial(600[rpm])<-Default setting by user"
        assert found.information()["STAT"] == "Sensor works well."
    parser = ReplyParser()
    assert parser.feed(urg.replace(b"user;A\n", b"user;B\n")) == []
    assert parser.corrupted == 1


def test_the_switch_to_scip_2_is_answered_in_scip_1() -> None:
    parser = ReplyParser()
    assert parser.feed(b"SCIP2.0\n0\n\n") == [ScipReply("SCIP2.0", "00")]
    assert parser.feed(b"SCIP2.0\n0Ee\n\n") == [ScipReply("SCIP2.0", "0E")]
    assert parser.corrupted == 0
    assert parser.feed(b"QT\n0\n\nSCIP2.0\nE\n\n") == []
    assert parser.corrupted == 2


def test_the_user_string_is_no_part_of_the_echo() -> None:
    assert ReplyParser().feed(b"BM;Robot 1\n02R\n\n") == [ScipReply("BM", "02")]


def test_frames_are_checked() -> None:
    with pytest.raises(ChecksumError):
        parse_frame([b"QT", b"00Q"])
    with pytest.raises(FrameError):
        parse_frame([b"QT"])
    with pytest.raises(FrameError):
        parse_frame([b"hello", b"00P"])
    with pytest.raises(FrameError):
        parse_frame([b"QT", summed(b"0")])


STREAM = PP + scan_bytes(list(range(100, 150))) + b"QT\n00P\n\n" + scan_bytes(list(range(500, 650)), first=0)
WHOLE = ReplyParser().feed(STREAM)


@settings(deadline=None)
@given(st.lists(st.integers(0, len(STREAM)), max_size=30))
def test_pieces_of_any_size_give_the_same_replies(cuts: list[int]) -> None:
    parser, got = ReplyParser(), []
    edges = [0, *sorted(cuts), len(STREAM)]
    for start, stop in pairwise(edges):
        got += parser.feed(STREAM[start:stop])
    assert got == WHOLE
    assert parser.corrupted == 0


def test_byte_by_byte() -> None:
    parser = ReplyParser()
    assert [reply for byte in STREAM for reply in parser.feed(bytes([byte]))] == WHOLE
    assert len(WHOLE) == 4


@settings(max_examples=examples(200))
@given(noise=st.binary(max_size=200))
def test_after_noise_the_next_blank_line_starts_afresh(noise: bytes) -> None:
    got = ReplyParser().feed(noise + b"\n\n" + STREAM)
    assert got[-4:] == WHOLE


def test_bad_sums_are_counted_and_the_scan_is_dropped() -> None:
    good = scan_bytes([1000] * 30)
    bad = good.replace(encode(1000, 3), encode(1001, 3), 1)
    parser = ReplyParser()
    assert len(parser.feed(good + bad + good)) == 2
    assert parser.corrupted == 1


def test_endless_noise_does_not_pile_up() -> None:
    parser = ReplyParser()
    noise = b"\x55" * LONGEST_FRAME
    tracemalloc.start()
    try:
        for _ in range(200):
            assert parser.feed(noise) == []
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert held < 10 * LONGEST_FRAME
    assert parser.corrupted == 100, "two pieces are too long each time, and are dropped together"
    assert parser.feed(PP) == WHOLE[:1]
    assert parser.corrupted == 100, "nothing of the noise is left before the reply"


def test_a_frame_may_be_as_long_as_the_longest() -> None:
    parser = ReplyParser()
    half = PP[:-2].ljust(LONGEST_FRAME, b"\x55")
    assert parser.feed(half) == [] and parser.corrupted == 0
    assert parser.feed(b"\x55") == [] and parser.corrupted == 1
    assert parser.feed(PP) == WHOLE[:1]


def test_clear_forgets_half_a_reply() -> None:
    parser = ReplyParser()
    parser.feed(PP[:40])
    parser.clear()
    assert len(parser.feed(PP)) == 1


@pytest.mark.parametrize(
    "line",
    [
        b"STAT Sensor works well",  # neither sign nor sum
        b"STAT:well" + b":" + summed(b"STAT:well")[-1:],
        b"STAT:\xfe;" + summed(b"STAT:\xfe")[-1:],
        b";",
        b"",
    ],
)
def test_an_information_line_needs_its_sign_and_printable_text(line: bytes) -> None:
    with pytest.raises(FrameError):
        parse_frame([b"PP", b"00P", line])
    with pytest.raises(ChecksumError):
        parse_frame([b"PP", b"00P", b"DMIN:20;5"])


@pytest.mark.parametrize("command", [b"VV", b"II"])
def test_lines_of_an_identification_that_cannot_be_read_are_left_out_and_counted(command: bytes) -> None:
    good = information(command, b"SERI:H1", b"PROD:URG", b"no colon")
    torn = good.replace(b"PROD:URG", b"PROD:UTG")
    parser = ReplyParser(some=True)
    for head in (b"", b"noise"):
        (reply,) = parser.feed(head + torn)
        assert (reply.echo, reply.lines, reply.unreadable) == (command.decode(), (b"SERI:H1",), 2)
        assert reply.identification() == ({"SERI": "H1"}, 2)
    assert parser.corrupted == 2
    assert ReplyParser().feed(torn) == []
    assert ReplyParser(some=True).feed(torn.replace(b"\n00P\n", b"\n00Q\n")) == [], (
        "nor is it with a bad status"
    )
    (whole,) = ReplyParser(some=True).feed(information(command, b"SERI: H1 ", b"no colon"))
    assert whole.identification() == ({"SERI": "H1"}, 1)
    with pytest.raises(FrameError, match="no colon"):
        whole.information()


def test_the_numbers_a_sensor_measures_with_are_all_read_or_none() -> None:
    parser = ReplyParser(some=True)
    assert parser.feed(PP.replace(b"DMIN:20", b"DMIN:21")) == []
    assert parser.corrupted == 1


@pytest.mark.parametrize(("status", "checks"), [("20", False), ("21", True), ("49", True), ("50", False)])
def test_which_statuses_pass_by_themselves(status: str, checks: bool) -> None:
    assert is_checking(status) is checks
    assert goes_on_by_itself(status) is checks
    assert ("checks an error" in describe_status("MD", status)) is checks


def test_some_other_statuses_pass_by_themselves_too() -> None:
    assert goes_on_by_itself("98") and goes_on_by_itself("0M")
    assert not is_checking("98") and not is_checking("0M") and not goes_on_by_itself("10")
    for status, hardware in (("49", False), ("50", True), ("97", True), ("98", False)):
        assert ("hardware trouble" in describe_status("ME", status)) is hardware
    assert "hardware" not in describe_status("BM", "60"), "of measurements alone"


def test_statuses_in_words() -> None:
    assert describe_status("MD", "00") == "accepted"
    assert "laser is off" in describe_status("GD0044072501", "10")
    assert "checks an error" in describe_status("MD", "21")
    assert "checks an error" in describe_status("MD", "49")
    assert "hardware trouble" in describe_status("MD", "50")
    assert "hardware trouble" in describe_status("MD", "97")
    assert "cannot be switched on" in describe_status("BM", "01")
    assert "not allowed now" in describe_status("BM", "0E")
    assert describe_status("QT", "7Z") == "no meaning is documented"


def test_every_command_has_its_text() -> None:
    assert [time_mode(action) for action in (0, 1, 2)] == ["TM0", "TM1", "TM2"]
    assert serial_speed(19200) == "SS019200"
    assert Measurement("ME", 0, 1080, 0, 0, 1).command == "ME0000108000001"
    assert Measurement("GE", 0, 1080, 1).command == "GE0000108001"


def test_every_argument_may_be_at_its_limit() -> None:
    assert Measurement("HE", 9999, 9999, 99).command == "HE9999999999"
    assert Measurement("NE", 0, 9999, 99, 9, 99).command == "NE0000999999999"
    assert [Measurement(kind, 1, 1).streams for kind in ("MD", "MS", "ME", "ND", "NE")] == [True] * 5
    assert [Measurement(kind, 1, 1).streams for kind in ("GD", "GS", "GE", "HD", "HE")] == [False] * 5
    assert Measurement("MD", 44, 725, 1, 2, 10).head == "MD00440725012"
    assert Measurement("GD", 44, 725, 1, 2, 10).head == "GD0044072501"


@pytest.mark.parametrize(
    "make",
    [
        lambda: Measurement("MD", -1, 5),
        lambda: Measurement("MD", 0, 1, cluster=-1),
        lambda: Measurement("MD", 0, 1, skip=-1),
        lambda: Measurement("MD", 0, 1, count=-1),
        lambda: time_mode(-1),
        lambda: time_mode(3),
        lambda: serial_speed(9600),
        lambda: Measurement("XX", 0, 1),
        lambda: Measurement("MD", 2, 1),
        lambda: Measurement("MD", 0, 10_000),
        lambda: Measurement("MD", 0, 1, cluster=100),
        lambda: Measurement("MD", 0, 1, skip=10),
        lambda: Measurement("MD", 0, 1, count=100),
    ],
)
def test_commands_that_no_sensor_knows(make: Callable[[], object]) -> None:
    with pytest.raises(ConfigError):
        make()


def test_noise_right_before_a_reply_costs_nothing() -> None:
    parser = ReplyParser()
    assert parser.feed(b"\xff\x00x\nyz" + PP) == ReplyParser().feed(PP)
    half = scan_bytes([1000] * 60)[:100]
    assert len(parser.feed(half + PP)) == 1
    assert parser.corrupted == 2


def test_ten_million_random_bytes_are_no_reply() -> None:
    parser = ReplyParser()
    noise = np.random.default_rng(1)
    replies = [reply for _ in range(100) for reply in parser.feed(noise.bytes(100_000))]
    assert replies == []
    assert parser.feed(b"\n\n" + PP) == ReplyParser().feed(PP)


def test_random_lines_pass_with_the_probability_of_a_six_bit_sum() -> None:
    """Frames with a right head and one random line: one in 64 has a sum that fits."""
    noise = np.random.default_rng(2)
    tries = 20_000
    lines = noise.integers(0x30, 0x70, (tries, 5), np.uint8)
    parser = ReplyParser()
    got = parser.feed(b"".join(b"TM1\n00P\n" + line.tobytes() + b"\n\n" for line in lines))
    assert 0.8 * tries / 64 < len(got) < 1.2 * tries / 64
    assert len(got) + parser.corrupted == tries


def test_more_statuses_in_words() -> None:
    assert "bit rate" in describe_status("SS019200", "02")
    assert "once more" in describe_status("RB", "01")
    assert "laser is off" in describe_status("GE0000108001", "10")
    for letters in ("MD", "GD", "BM", "TM", "SS", "CR", "HS", "DB", "VV", "%SL"):
        for status in ("0A", "0B", "0C", "0D", "0E", "0F", "0G", "0H", "0I"):
            assert "no meaning" not in describe_status(letters, status)
