"""The Open Interface's bytes: worked examples of REFERENCE 1.3, 1.5, 1.6 and 13; decoding noise."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.drivers.turtlebot import codec
from florence_bt.drivers.turtlebot.driver import STREAMED_PACKETS

EXAMPLE = bytes([19, 5, 29, 2, 25, 13, 0])


def test_worked_commands() -> None:
    assert codec.drive_direct(150, -150) == bytes([145, 0, 150, 255, 106])
    assert codec.start() + codec.full() + codec.leds(
        play=True, advance=False, power_colour=0, power_intensity=0
    ) == bytes([128, 132, 139, 2, 0, 0])
    assert codec.stream([29, 13]) == bytes([148, 2, 29, 13])
    assert codec.stream([]) == bytes([148, 0])
    assert codec.query_list([7, 19]) == bytes([149, 2, 7, 19])
    assert codec.sensors(6) == bytes([142, 6])
    assert codec.digital_outputs(5) == bytes([147, 5])
    assert codec.pause_stream() + codec.resume_stream() == bytes([150, 0, 150, 1])
    assert codec.passive() + codec.safe() + codec.soft_reset() == bytes([128, 131, 7])


def test_speeds_are_clamped_not_masked() -> None:
    assert codec.drive_direct(70_000, -501) == codec.drive_direct(500, -500)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: codec.digital_outputs(8),
        lambda: codec.leds(play=False, advance=False, power_colour=256, power_intensity=0),
        lambda: codec.sensors(43),
        lambda: codec.query_list([7, -1]),
        lambda: codec.query_list([7] * 256),
        lambda: codec.stream(range(7, 43)),
    ],
)
def test_arguments_out_of_range_are_refused(wrong: object) -> None:
    with pytest.raises(ConfigError):
        wrong()  # type: ignore[operator]


def test_group_sizes() -> None:
    sizes = [codec.packet_size(group) for group in range(7)]
    assert sizes == [26, 10, 6, 10, 14, 12, 52]
    assert {number: packet.size for number, packet in codec.PACKETS.items() if packet.size == 2}.keys() == {
        19, 20, 22, 23, 25, 26, 27, 28, 29, 30, 31, 33, 39, 40, 41, 42,
    }  # fmt: skip


def test_group_6() -> None:
    data = struct.pack(
        ">12B2hBHhb7HBH5B4h",
        *(0b01010, 1, 0, 1, 0, 0, 0, 16, 0, 0, 255, 4),
        *(-123, 90, 2, 16000, -1200, -5, 2500, 2700, 10, 11, 12, 13, 14, 16, 512, 3, 2, 1, 1, 43),
        *(500, -2000, 250, -250),
    )
    state = codec.decode_group6(data)
    assert state.bumps_wheeldrops == 0b01010
    assert state.wall is True
    assert state.cliff_front_left is True
    assert state.cliff
    assert state.distance == pytest.approx(-0.123)
    assert state.angle == pytest.approx(1.5707963)
    assert (state.charging_state, state.voltage, state.current, state.temperature) == (2, 16000, -1200, -5)
    assert (state.charge, state.capacity, state.user_analog_input) == (2500, 2700, 512)
    assert (state.oi_mode, state.song_number, state.song_playing) == (codec.OiMode.SAFE, 1, True)
    assert state.requested_radius == pytest.approx(-2.0)
    assert (state.requested_right_velocity, state.requested_left_velocity) == pytest.approx((0.25, -0.25))
    assert not state.wheels_stopped


def test_group_6_of_wrong_length() -> None:
    with pytest.raises(FrameError, match="52 bytes, not 51"):
        codec.decode_group6(bytes(51))


@pytest.mark.parametrize(
    ("checksum", "form"),
    [(182, codec.ChecksumForm.WITHOUT_HEADER), (163, codec.ChecksumForm.WITH_HEADER)],
)
def test_both_checksums_of_the_manuals_example(checksum: int, form: codec.ChecksumForm) -> None:
    decoder = codec.StreamDecoder([29, 13])
    assert decoder.feed(EXAMPLE + bytes([checksum])) == [codec.StreamFrame({29: 537, 13: 0})]
    assert decoder.checksum_form is form


def test_the_form_is_remembered_and_relearnt() -> None:
    decoder = codec.StreamDecoder([29, 13])
    other = EXAMPLE + bytes([163])
    decoder.feed(EXAMPLE + bytes([182]))
    # good (182), then 163 thrice: rejected, rejected, proven.
    assert [type(event) for event in decoder.feed(3 * other)] == [
        codec.FrameRejected,
        codec.FrameRejected,
        codec.StreamFrame,
    ]
    assert decoder.checksum_form is codec.ChecksumForm.WITH_HEADER
    assert (decoder.good_frames, decoder.bad_frames) == (2, 2)


def frame(values: bytes) -> bytes:
    """A good frame of the driver's stream, made from the table of sizes alone."""
    body, place = bytearray(), 0
    for number in STREAMED_PACKETS:
        size = codec.packet_size(number)
        body += bytes([number]) + values[place : place + size]
        place += size
    head = bytes([len(body)]) + body
    return bytes([19]) + head + bytes([-sum(head) % 256])


FRAMES = st.binary(min_size=43, max_size=43).map(frame)


def decoded(pieces: list[bytes]) -> tuple[list[dict[int, int]], codec.StreamDecoder]:
    decoder = codec.StreamDecoder(STREAMED_PACKETS)
    events = [event for piece in pieces for event in decoder.feed(piece)]
    return [event.values for event in events if isinstance(event, codec.StreamFrame)], decoder


def test_the_stream_fits_the_line() -> None:
    assert len(frame(bytes(43))) == 75
    assert codec.stream(STREAMED_PACKETS)[1] == len(STREAMED_PACKETS) == 29


@given(st.lists(FRAMES, max_size=4), st.integers(1, 200))
def test_whole_and_in_pieces_give_the_same(frames: list[bytes], piece: int) -> None:
    data = b"".join(frames)
    whole, decoder = decoded([data])
    pieces, _ = decoded([data[start : start + piece] for start in range(0, len(data), piece)])
    assert len(whole) == len(frames) == decoder.good_frames
    assert whole == pieces
    assert decoder.noise_bytes == 0


@given(st.lists(st.tuples(st.lists(st.sampled_from([19, 72, 7, 8, 0, 255, 130])), FRAMES), max_size=4))
def test_noise_never_takes_a_good_frame_with_it(parts: list[tuple[list[int], bytes]]) -> None:
    noisy, decoder = decoded([bytes([byte]) for noise, good in parts for byte in bytes(noise) + good])
    assert noisy == decoded([good for _, good in parts])[0]
    assert decoder.noise_bytes == sum(len(noise) for noise, _ in parts)


@given(FRAMES, st.integers(0, 74), st.integers(1, 255), FRAMES)
def test_a_broken_byte_costs_one_frame_only(broken: bytes, place: int, change: int, good: bytes) -> None:
    damaged = bytearray(broken)
    damaged[place] ^= change
    decoder = codec.StreamDecoder(STREAMED_PACKETS)
    decoder.feed(good)
    events = decoder.feed(bytes(damaged) + good + good)
    values = [event.values for event in events if isinstance(event, codec.StreamFrame)]
    assert values == decoded([good, good])[0]


@given(FRAMES, st.integers(1, 74), FRAMES)
def test_a_cut_frame_is_dropped(cut: bytes, length: int, good: bytes) -> None:
    values, decoder = decoded([good, cut[:length], good])
    assert values == decoded([good, good])[0]
    assert decoder.good_frames == 2


@given(st.binary(max_size=400))
def test_any_bytes_are_survived(data: bytes) -> None:
    decoder = codec.StreamDecoder(STREAMED_PACKETS)
    decoder.feed(data)
    assert decoder.noise_bytes + 75 * decoder.good_frames <= len(data)
