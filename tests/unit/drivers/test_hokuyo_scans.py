"""Numbers and scans out of replies to measurement commands."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.errors import FrameError
from florence_bt.drivers.hokuyo.codec import (
    Measurement,
    ReplyParser,
    ScipReply,
    decode_scan,
    decode_time,
    decode_values,
)
from tests.sweeps import examples
from tests.unit.drivers.scip_writer import encode, scan_bytes, summed


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
        ScipReply("BM", "00"),
        ScipReply("MD0044004501000", "00"),
        ScipReply("MD0044004501000", "99", (b"0000",)),
        ScipReply("MD0044004501000", "99", (b"000", b"000000")),
        ScipReply("MD0044004501000", "99", (b"0000", b"000")),
        ScipReply("MD0044004501000", "99", (b"0000", b"000000000")),
        ScipReply("MD0044004501000", "99", (b"0000", b"000", b"000")),
        ScipReply("MD0044004501000", "99", (b"0000", b"00000p")),
    ],
)
def test_half_scans_are_refused(reply: ScipReply) -> None:
    with pytest.raises(FrameError):
        decode_scan(reply)


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


@settings(max_examples=examples(400))
@given(
    at=st.integers(0, len(SCANS) - 1),
    byte=st.integers(0, 255),
    how=st.sampled_from(["swap", "insert", "drop"]),
)
def test_one_wrong_byte_never_makes_a_wrong_scan(at: int, byte: int, how: str) -> None:
    head, tail = SCANS[:at], SCANS[at + (how != "insert") :]
    got = _scans(head + (b"" if how == "drop" else bytes([byte])) + tail)
    # The echo has no checksum, so its numbers are the driver's to compare with what it asked for.
    assert [scan[1:] for scan in got if scan not in SENT and scan[0] == 44] == []
    assert len(got) >= 1


@settings(deadline=None)
@given(start=st.integers(0, len(SCANS)), length=st.integers(0, len(SCANS) // 3 - 1))
def test_a_gap_shorter_than_a_scan_never_makes_a_wrong_scan(start: int, length: int) -> None:
    assert all(scan in SENT for scan in _scans(SCANS[:start] + SCANS[start + length :]))


def test_distances_are_plain_integers() -> None:
    assert decode_values(b"", 3).dtype == np.int32


@pytest.mark.parametrize("kind", ["MD", "MS", "ME", "GD", "GS", "GE"])
@given(
    first=st.integers(0, 900),
    steps=st.integers(0, 180),
    cluster=st.integers(0, 99),
    stamp=st.integers(0, (1 << 24) - 1),
    data=st.data(),
)
@settings(max_examples=examples(25))
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
    assert decode_time(ScipReply("TM1", "00", (b"m2@0",))) == 16_000_000
    for reply in (ScipReply("TM0", "00"), ScipReply("TM1", "04")):
        with pytest.raises(FrameError, match="holds no time"):
            decode_time(reply)


@pytest.mark.parametrize("stamp", [b"m2@", b"m2@0m", b"m2@0m2@0"])
def test_a_time_has_four_characters_in_an_answer_and_in_a_scan(stamp: bytes) -> None:
    with pytest.raises(FrameError, match=f"4 characters, not {len(stamp)}"):
        decode_time(ScipReply("TM1", "00", (stamp,)))
    with pytest.raises(FrameError, match=f"4 characters, not {len(stamp)}"):
        decode_scan(ScipReply("MD0000000101000", "99", (stamp, encode(100, 3) + encode(200, 3))))


def echo_reply(kind: str, last: int, data: bytes) -> ScipReply:
    return ScipReply(f"{kind}0000{last:04d}01000", "99", (encode(5, 4), data))


def test_every_echo_of_a_beam() -> None:
    data = encode(1000, 3) + encode(2000, 3) + b"&" + encode(2500, 3) + b"&" + encode(9000, 3) + encode(7, 3)
    scan = decode_scan(echo_reply("ND", 2, data))
    assert scan.distances_mm.tolist() == [1000, 2000, 7]
    assert scan.echoes_mm is not None
    assert scan.echoes_mm.tolist() == [[1000, -1, -1], [2000, 2500, 9000], [7, -1, -1]]
    assert scan.echo_intensities.shape == (3, 0)


def test_every_echo_with_its_intensity() -> None:
    data = b"".join([encode(1000, 3), encode(40, 3), b"&", encode(1500, 3), encode(30, 3)])
    scan = decode_scan(echo_reply("NE", 0, data))
    assert (scan.distances_mm.tolist(), scan.intensities.tolist()) == ([1000], [40])
    assert scan.echoes_mm is not None
    assert (scan.echoes_mm.tolist(), scan.echo_intensities.tolist()) == ([[1000, 1500]], [[40, 30]])


@pytest.mark.parametrize("data", [b"&000", b"000&", b"000&&000", b"000&00", b"000&000", b"000000000"])
def test_bad_echoes_are_refused(data: bytes) -> None:
    with pytest.raises(FrameError):
        decode_scan(echo_reply("ND", 1, data))


def test_several_echoes_need_a_command_that_asks_for_them() -> None:
    with pytest.raises(FrameError, match="several echoes"):
        decode_scan(echo_reply("MD", 0, b"000&000"))
