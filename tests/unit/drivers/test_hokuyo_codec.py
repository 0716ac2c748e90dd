"""SCIP 2.0 on the wire. The bytes here are written by hand or by the small writer below, from the manual."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import ChecksumError, FrameError
from florence_bt.drivers.hokuyo.codec import (
    LONGEST_FRAME,
    Reply,
    ReplyParser,
    check_sum,
    decode_scan,
    decode_values,
    parse_frame,
    request,
    scan_command,
)
from florence_bt.drivers.hokuyo.status import describe_status


def encode(value: int, width: int) -> bytes:
    return bytes(((value >> 6 * place) & 63) + 48 for place in range(width - 1, -1, -1))


def summed(line: bytes) -> bytes:
    return line + bytes([(sum(line) & 63) + 48])


def scan_bytes(distances: list[int], stamp: int = 1000, first: int = 44) -> bytes:
    last = first + len(distances) - 1
    data = b"".join(encode(distance, 3) for distance in distances)
    blocks = [summed(data[at : at + 64]) for at in range(0, len(data), 64)]
    head = [f"MD{first:04d}{last:04d}01000".encode(), b"99b", summed(encode(stamp, 4))]
    return b"\n".join([*head, *blocks, b"", b""])


PP = (
    b"PP\n00P\nMODL:URG-04LX(Hokuyo Automatic Co.,Ltd.);N\nDMIN:20;4\nDMAX:5600;_\nARES:1024;\\\n"
    b"AMIN:44;7\nAMAX:725;o\nAFRT:384;6\nSCAN:600;e\n\n"
)


STATUSES = ["00", "01", "02", "03", "04", "05", "06", "07", "10", "99"]
STATUSES += ["0A", "0B", "0C", "0D", "0E", "0F", "0G", "0H", "0I"]


@pytest.mark.parametrize(
    ("status", "letter"),
    list(zip(STATUSES, "PQRSTUVWQbabcdefghi", strict=True)),
)
def test_status_sums(status: str, letter: str) -> None:
    assert check_sum(status.encode()) == ord(letter)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1234, "CB"),
        (5432, "1Dh"),
        (20, "0D"),
        (5600, "1GP"),
        (0, "000"),
        (1, "001"),
        (16_000_000, "m2@0"),
        (65533, "?om"),
    ],
)
def test_number_vectors(value: int, text: str) -> None:
    assert decode_values(text.encode(), len(text)).tolist() == [value]


@settings(deadline=None)
@given(width=st.sampled_from([2, 3, 4]), data=st.data())
def test_numbers_survive_encoding(width: int, data: st.DataObject) -> None:
    values = data.draw(st.lists(st.integers(0, 64**width - 1), max_size=50))
    assert decode_values(b"".join(encode(value, width) for value in values), width).tolist() == values


@pytest.mark.parametrize("text", [b"0", b"0000", b"/00", b"00p", b"\xff00", b"0 0"])
def test_bad_numbers_are_refused(text: bytes) -> None:
    with pytest.raises(FrameError):
        decode_values(text, 3)


def test_requests() -> None:
    assert request("VV") == b"VV\n"
    assert request(scan_command("MD", 44, 725, 1)) == b"MD0044072501000\n"
    assert request(scan_command("GD", 44, 725, 1)) == b"GD0044072501\n"
    assert scan_command("MD", 0, 768, 3, 2, 10) == "MD0000076803210"


def test_time_vector() -> None:
    (reply,) = ReplyParser().feed(b"TM1\n00P\nm2@0?\n\n")
    assert reply == Reply("TM1", "00", (b"m2@0",))
    assert decode_values(reply.lines[0], 4)[0] == 16_000_000


def test_measurement_acceptance_vector() -> None:
    assert ReplyParser().feed(b"MD0044072501000\n00P\n\n") == [Reply("MD0044072501000", "00")]


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
    text = next(b"SERI:%d" % n for n in range(2000) if check_sum(b"SERI:%d" % n) == ord(";"))
    (reply,) = ReplyParser().feed(b"VV\n00P\n" + text + b";;\n\n")
    assert reply.lines == (text,)


def test_an_information_line_without_a_colon_is_refused() -> None:
    (reply,) = ReplyParser().feed(b"VV\n00P\n" + b"SERI" + b";" + summed(b"SERI")[-1:] + b"\n\n")
    with pytest.raises(FrameError):
        reply.information()


def test_the_user_string_is_no_part_of_the_echo() -> None:
    assert ReplyParser().feed(b"BM;Robot 1\n02R\n\n") == [Reply("BM", "02")]


def test_a_full_scan() -> None:
    distances = [(17 * n) % 5600 for n in range(682)]
    data = scan_bytes(distances, stamp=123456)
    assert len(data.split(b"\n")) == 3 + 32 + 2  # head, 31 lines of 64 and one of 62, the end
    (reply,) = ReplyParser().feed(data)
    scan = decode_scan(reply)
    assert (scan.first_step, scan.cluster, scan.remaining, scan.timestamp_ms) == (44, 1, 0, 123456)
    assert scan.distances_mm.tolist() == distances


def test_a_clustered_polled_scan_of_two_characters() -> None:
    data = b"GS0044005303\n00P\n" + summed(encode(5, 4)) + b"\n"
    data += summed(b"".join(encode(value, 2) for value in (1, 20, 4095, 7))) + b"\n\n"
    (reply,) = ReplyParser().feed(data)
    scan = decode_scan(reply)
    assert scan.cluster == 3
    assert scan.distances_mm.tolist() == [1, 20, 4095, 7]


@pytest.mark.parametrize(
    "reply",
    [
        Reply("BM", "00"),
        Reply("MD0044004501000", "00"),
        Reply("MD0044004501000", "99", (b"0000",)),
        Reply("MD0044004501000", "99", (b"000", b"000000")),
        Reply("MD0044004501000", "99", (b"0000", b"000")),
        Reply("MD0044004501000", "99", (b"0000", b"000000000")),
        Reply("MD0044004501000", "99", (b"0000", b"000", b"000")),
        Reply("MD0044004501000", "99", (b"0000", b"00000p")),
    ],
)
def test_half_scans_are_refused(reply: Reply) -> None:
    with pytest.raises(FrameError):
        decode_scan(reply)


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


@settings(max_examples=200, deadline=None)
@given(noise=st.binary(max_size=200))
def test_after_noise_the_next_blank_line_starts_afresh(noise: bytes) -> None:
    got = ReplyParser().feed(noise + b"\n\n" + STREAM)
    assert got[-4:] == WHOLE


def _scans(data: bytes) -> list[tuple[int, int, tuple[int, ...]]]:
    scans = []
    for reply in ReplyParser().feed(data):
        try:
            scan = decode_scan(reply)
        except FrameError:
            continue
        scans.append((scan.first_step, scan.timestamp_ms, tuple(scan.distances_mm.tolist())))
    return scans


SCANS = b"".join(scan_bytes(list(range(start, start + 60)), stamp=start) for start in (100, 900, 5000))
SENT = _scans(SCANS)


@settings(max_examples=400, deadline=None)
@given(
    at=st.integers(0, len(SCANS) - 1),
    byte=st.integers(0, 255),
    how=st.sampled_from(["swap", "insert", "drop"]),
)
def test_one_wrong_byte_never_makes_a_wrong_scan(at: int, byte: int, how: str) -> None:
    head, tail = SCANS[:at], SCANS[at + (how != "insert") :]
    got = _scans(head + (b"" if how == "drop" else bytes([byte])) + tail)
    # The echo has no check sum, so its numbers are the driver's to compare with what it asked for.
    assert [scan[1:] for scan in got if scan not in SENT and scan[0] == 44] == []
    assert len(got) >= 1


@settings(deadline=None)
@given(start=st.integers(0, len(SCANS)), length=st.integers(0, len(SCANS) // 3 - 1))
def test_a_gap_shorter_than_a_scan_never_makes_a_wrong_scan(start: int, length: int) -> None:
    assert all(scan in SENT for scan in _scans(SCANS[:start] + SCANS[start + length :]))


def test_bad_sums_are_counted_and_the_scan_is_dropped() -> None:
    good = scan_bytes([1000] * 30)
    bad = good.replace(encode(1000, 3), encode(1001, 3), 1)
    parser = ReplyParser()
    assert len(parser.feed(good + bad + good)) == 2
    assert parser.corrupted == 1


def test_endless_noise_does_not_pile_up() -> None:
    parser = ReplyParser()
    for _ in range(10):
        assert parser.feed(b"\x55" * LONGEST_FRAME) == []
    assert parser.corrupted >= 4
    assert parser.feed(b"\n\n" + PP) == ReplyParser().feed(PP)


def test_clear_forgets_half_a_reply() -> None:
    parser = ReplyParser()
    parser.feed(PP[:40])
    parser.clear()
    assert len(parser.feed(PP)) == 1


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


def test_distances_are_plain_integers() -> None:
    assert decode_values(b"", 3).dtype == np.int32
