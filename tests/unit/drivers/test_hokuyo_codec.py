"""SCIP 2.0 on the wire. The bytes here are written by hand or by the small writer below, from the manual."""

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
    Reply,
    ReplyParser,
    check_sum,
    debug_mode,
    decode_scan,
    decode_time,
    decode_values,
    motor_speed,
    parse_frame,
    request,
    scan_command,
    sensitivity,
    serial_speed,
    time_mode,
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


def test_every_command_has_its_text() -> None:
    assert [time_mode(action) for action in (0, 1, 2)] == ["TM0", "TM1", "TM2"]
    assert serial_speed(19200) == "SS019200"
    assert (motor_speed(5), motor_speed(99)) == ("CR05", "CR99")
    assert (sensitivity(False), sensitivity(True)) == ("HS0", "HS1")
    assert debug_mode(10) == "DB10"
    assert scan_command("ME", 0, 1080, 0, 0, 1) == "ME0000108000001"
    assert scan_command("GE", 0, 1080, 1) == "GE0000108001"
    assert request("BM", "Robot 1") == b"BM;Robot 1\n"


@pytest.mark.parametrize(
    "make",
    [
        lambda: time_mode(3),
        lambda: serial_speed(9600),
        lambda: motor_speed(11),
        lambda: debug_mode(100),
        lambda: request("BM", "seventeen letters"),
        lambda: request("BM", "a/b"),
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


@pytest.mark.parametrize("kind", ["MD", "MS", "ME", "GD", "GS", "GE"])
@given(
    first=st.integers(0, 900),
    steps=st.integers(0, 180),
    cluster=st.integers(0, 99),
    stamp=st.integers(0, (1 << 24) - 1),
    data=st.data(),
)
@settings(max_examples=25, deadline=None)
def test_scans_of_every_kind_survive_the_wire(
    kind: str, first: int, steps: int, cluster: int, stamp: int, data: st.DataObject
) -> None:
    wanted = Measurement(kind, first, first + steps, cluster)
    count = -(-(steps + 1) // max(1, cluster))
    width = 2 if kind[1] == "S" else 3
    numbers = st.lists(st.integers(0, 64**width - 1), min_size=count, max_size=count)
    distances = data.draw(numbers)
    intensities = data.draw(numbers) if kind[1] == "E" else []
    values = (
        [v for pair in zip(distances, intensities, strict=True) for v in pair] if intensities else distances
    )
    text = b"".join(encode(value, width) for value in values)
    blocks = [summed(text[at : at + 64]) for at in range(0, len(text), 64)]
    status = b"99b" if wanted.streams else b"00P"
    lines = [wanted.command.encode(), status, summed(encode(stamp, 4)), *blocks, b"", b""]
    (reply,) = ReplyParser().feed(b"\n".join(lines))
    scan = decode_scan(reply)
    assert (scan.first_step, scan.timestamp_ms) == (first, stamp)
    assert scan.distances_mm.tolist() == distances
    assert scan.intensities.tolist() == intensities


def test_a_value_may_lie_across_two_lines() -> None:
    # 64 is no multiple of 6, so the 11th pair of ME begins at the end of the first line.
    data = b"".join(encode(value, 3) for value in range(100, 124))
    lines = [b"ME0000001101000", b"99b", summed(encode(1, 4)), summed(data[:64]), summed(data[64:]), b"", b""]
    (reply,) = ReplyParser().feed(b"\n".join(lines))
    assert decode_scan(reply).distances_mm.tolist() == list(range(100, 124, 2))
    assert decode_scan(reply).intensities.tolist() == list(range(101, 124, 2))


def test_times() -> None:
    assert decode_time(Reply("TM1", "00", (b"m2@0",))) == 16_000_000
    for reply in (Reply("TM0", "00"), Reply("TM1", "04"), Reply("TM1", "00", (b"m2@",))):
        with pytest.raises(FrameError):
            decode_time(reply)


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
    assert "speed" in describe_status("CR05", "04")
    assert "sensitivity" in describe_status("HS1", "02")
    assert "malfunction" in describe_status("DB01", "05")
    assert "once more" in describe_status("RB", "01")
    assert "laser is off" in describe_status("GE0000108001", "10")
    for letters in ("MD", "GD", "BM", "TM", "SS", "CR", "HS", "DB", "VV", "%SL"):
        for status in ("0A", "0B", "0C", "0D", "0E", "0F", "0G", "0H", "0I"):
            assert "no meaning" not in describe_status(letters, status)
