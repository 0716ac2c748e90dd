"""The Open Interface's bytes: worked examples of REFERENCE 1.3, 1.5, 1.6 and 13; decoding noise."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.drivers.turtlebot.codec.models import CREATE_2, model_named
from florence_bt.drivers.turtlebot.codec.packets import (
    GROUPS,
    PACKETS,
    OiMode,
    decode_packets,
    implausible,
    packet_size,
)
from florence_bt.drivers.turtlebot.codec.state import SensorState, state_from_values
from florence_bt.drivers.turtlebot.codec.stream_decoder import ChecksumForm, StreamDecoder
from florence_bt.drivers.turtlebot.sequences import STREAMED_PACKETS


def decode_group6(data: bytes) -> SensorState:
    return state_from_values(decode_packets([6], data))


EXAMPLE = bytes([19, 5, 29, 2, 25, 13, 0])


def test_worked_commands() -> None:
    assert commands.drive_direct(150, -150) == bytes([145, 0, 150, 255, 106])
    assert commands.start() + commands.full() + commands.leds(2, power_colour=0, power_intensity=0) == bytes(
        [128, 132, 139, 2, 0, 0]
    )
    assert commands.stream([29, 13]) == bytes([148, 2, 29, 13])
    assert commands.stream([]) == bytes([148, 0])
    assert commands.query_list([7, 19]) == bytes([149, 2, 7, 19])
    assert commands.sensors(6) == bytes([142, 6])
    assert commands.digital_outputs(5) == bytes([147, 5])
    assert commands.pause_stream() + commands.resume_stream() == bytes([150, 0, 150, 1])
    assert commands.passive() + commands.safe() + commands.soft_reset() == bytes([128, 131, 7])


def test_speeds_are_clamped_not_masked() -> None:
    assert commands.drive_direct(70_000, -501) == commands.drive_direct(500, -500)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: commands.digital_outputs(8),
        lambda: commands.leds(0, power_colour=256, power_intensity=0),
        lambda: commands.sensors(43),
        lambda: commands.query_list([7, -1]),
        lambda: commands.query_list([7] * 256),
        lambda: commands.stream(range(7, 43)),
    ],
)
def test_arguments_out_of_range_are_refused(wrong: object) -> None:
    with pytest.raises(ConfigError):
        wrong()  # type: ignore[operator]


def test_group_sizes() -> None:
    sizes = [packet_size(group) for group in range(7)]
    assert sizes == [26, 10, 6, 10, 14, 12, 52]
    assert [packet_size(group) for group in (100, 101, 106, 107)] == [80, 28, 12, 9]
    assert {number: packet.size for number, packet in PACKETS.items() if packet.size == 2}.keys() == {
        19, 20, 22, 23, 25, 26, 27, 28, 29, 30, 31, 33, 39, 40, 41, 42,
        43, 44, 46, 47, 48, 49, 50, 51, 54, 55, 56, 57,
    }  # fmt: skip


def test_group_6() -> None:
    data = struct.pack(
        ">12B2hBHhb7HBH5B4h",
        *(0b01010, 1, 0, 1, 0, 0, 0, 16, 0, 0, 255, 4),
        *(-123, 90, 2, 16000, -1200, -5, 2500, 2700, 10, 11, 12, 13, 14, 16, 512, 3, 2, 1, 1, 43),
        *(500, -2000, 250, -250),
    )
    state = decode_group6(data)
    assert state.bumps_wheeldrops == 0b01010
    assert state.wall is True
    assert state.cliff_front_left is True
    assert state.cliff
    assert state.distance == pytest.approx(-0.123)
    assert state.angle == pytest.approx(1.5707963)
    assert (state.charging_state, state.voltage, state.current, state.temperature) == (2, 16000, -1200, -5)
    assert (state.charge, state.capacity, state.user_analog_input) == (2500, 2700, 512)
    assert (state.oi_mode, state.song_number, state.song_playing) == (OiMode.SAFE, 1, True)
    assert state.requested_radius == pytest.approx(-2.0)
    assert (state.requested_right_velocity, state.requested_left_velocity) == pytest.approx((0.25, -0.25))
    assert not state.wheels_stopped


def test_group_6_of_wrong_length() -> None:
    with pytest.raises(FrameError, match="52 bytes, not 51"):
        decode_group6(bytes(51))


@pytest.mark.parametrize(
    ("checksum", "form"),
    [(182, ChecksumForm.WITHOUT_HEADER), (163, ChecksumForm.WITH_HEADER)],
)
def test_both_checksums_of_the_manuals_example(checksum: int, form: ChecksumForm) -> None:
    decoder = StreamDecoder([29, 13])
    assert decoder.feed(EXAMPLE + bytes([checksum])) == [{29: 537, 13: 0}]
    assert decoder.checksum_form is form


def test_the_form_is_remembered_and_relearnt() -> None:
    decoder = StreamDecoder([29, 13])
    other = EXAMPLE + bytes([163])
    decoder.feed(EXAMPLE + bytes([182]))
    # good (182), then 163 thrice: rejected, rejected, proven.
    assert [len(decoder.feed(other)) for _ in range(3)] == [0, 0, 1]
    assert decoder.checksum_form is ChecksumForm.WITH_HEADER
    assert (decoder.good_frames, decoder.bad_frames) == (2, 2)


def frame(values: bytes) -> bytes:
    """A good frame of the driver's stream, made from the table of sizes alone."""
    body, place = bytearray(), 0
    for number in STREAMED_PACKETS:
        size = packet_size(number)
        body += bytes([number]) + values[place : place + size]
        place += size
    head = bytes([len(body)]) + body
    return bytes([19]) + head + bytes([-sum(head) % 256])


FRAMES = st.binary(min_size=43, max_size=43).map(frame)


def decoded(pieces: list[bytes]) -> tuple[list[dict[int, int]], StreamDecoder]:
    decoder = StreamDecoder(STREAMED_PACKETS)
    return [frame for piece in pieces for frame in decoder.feed(piece)], decoder


def test_the_stream_fits_the_line() -> None:
    assert len(frame(bytes(43))) == 75
    assert commands.stream(STREAMED_PACKETS)[1] == len(STREAMED_PACKETS) == 29


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
    decoder = StreamDecoder(STREAMED_PACKETS)
    decoder.feed(good)
    assert decoder.feed(bytes(damaged) + good + good) == decoded([good, good])[0]


@given(FRAMES, st.integers(1, 74), FRAMES)
def test_a_cut_frame_is_dropped(cut: bytes, length: int, good: bytes) -> None:
    values, decoder = decoded([good, cut[:length], good])
    assert values == decoded([good, good])[0]
    assert decoder.good_frames == 2


@given(st.binary(max_size=400))
def test_any_bytes_are_survived(data: bytes) -> None:
    decoder = StreamDecoder(STREAMED_PACKETS)
    decoder.feed(data)
    assert decoder.noise_bytes + 75 * decoder.good_frames <= len(data)


# -- every command, every packet, both bases -----------------------------------------------------------------


def test_the_manuals_drive_and_the_special_radii() -> None:
    assert commands.drive(-200, 500) == bytes([137, 255, 56, 1, 244])
    assert commands.drive(200, None) == bytes([137, 0, 200, 128, 0])
    assert commands.drive(200, 0x7FFF) == bytes([137, 0, 200, 127, 255])
    assert commands.spin(150) == bytes([137, 0, 150, 0, 1])
    assert commands.spin(-150) == bytes([137, 0, 150, 255, 255])
    assert commands.drive(9000, -9000) == bytes([137, 1, 244, 248, 48])  # 500 and -2000


def test_further_commands() -> None:
    assert commands.baud(57600) + commands.baud(300) == bytes([129, 10, 129, 0])
    assert commands.demo(-1) + commands.spot() + commands.cover() + commands.cover_and_dock() == bytes(
        [136, 255, 134, 135, 143]
    )
    assert commands.low_side_drivers(5) + commands.pwm_low_side_drivers(128, 64, 0) == bytes(
        [138, 5, 144, 128, 64, 0]
    )
    assert commands.song(3, [(60, 16), (0, 8)]) + commands.play_song(3) == bytes(
        [140, 3, 2, 60, 16, 0, 8, 141, 3]
    )
    assert commands.send_ir(135) == bytes([151, 135])
    waits = [
        commands.wait_time(30),
        commands.wait_distance(-400),
        commands.wait_angle(90),
        commands.wait_event(-5),
        commands.play_script(),
    ]
    assert commands.script(waits) == bytes([152, 11, 155, 30, 156, 254, 112, 157, 0, 90, 158, 251, 153])
    assert commands.script([]) + commands.show_script() == bytes([152, 0, 154])
    assert commands.drive_pwm(300, -300) == bytes([146, 0, 255, 255, 1])
    assert commands.power_down() + commands.stop_interface() == bytes([133, 173])


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: commands.baud(57601),
        lambda: commands.demo(10),
        lambda: commands.song(16, [(60, 1)]),
        lambda: commands.song(5, [(60, 1)], CREATE_2),
        lambda: commands.song(0, []),
        lambda: commands.song(0, [(60, 1)] * 17),
        lambda: commands.song(0, [(60, 256)]),
        lambda: commands.pwm_low_side_drivers(129, 0, 0),
        lambda: commands.script([bytes(101)]),
        lambda: commands.wait_event(0),
        lambda: commands.wait_event(23),
        lambda: commands.wait_distance(40000),
        lambda: commands.sensors(59, CREATE_2),
        lambda: commands.sensors(100),
    ],
)
def test_what_the_base_cannot_do_is_refused(wrong: object) -> None:
    with pytest.raises(ConfigError):
        wrong()  # type: ignore[operator]


def encoded(numbers: list[int], values: dict[int, int]) -> bytes:
    """The data of packets and groups as a base sends them."""
    packets = [PACKETS[member] for number in numbers for member in GROUPS.get(number, (number,))]
    return b"".join(struct.pack(">" + packet.code, values[packet.id]) for packet in packets)


def encoded_frame(numbers: list[int], values: dict[int, int], form: ChecksumForm) -> bytes:
    """A frame of the stream as a base sends it."""
    body = b"".join(bytes([number]) + encoded([number], values) for number in numbers)
    counted = bytes([len(body)]) + body
    return bytes([19]) + counted + bytes([-(sum(counted) + form.value) % 256])


@st.composite
def packet_values(draw: st.DrawFn) -> tuple[list[int], dict[int, int]]:
    """A request, and a value of each packet in it."""
    numbers = draw(st.lists(st.sampled_from([*PACKETS, *GROUPS]), min_size=1, max_size=6))
    values = {}
    for number in numbers:
        for packet in GROUPS.get(number, (number,)):
            low, high = {"B": (0, 255), "b": (-128, 127), "H": (0, 65535), "h": (-32768, 32767)}.get(
                PACKETS[packet].code, (0, 1)
            )
            highest = PACKETS[packet].highest
            values[packet] = draw(st.integers(low, high if highest is None else highest))
    return numbers, values


@given(packet_values())
def test_packets_there_and_back(case: tuple[list[int], dict[int, int]]) -> None:
    numbers, values = case
    assert decode_packets(numbers, encoded(numbers, values)) == values


@given(packet_values(), st.sampled_from(ChecksumForm))
def test_frames_there_and_back(case: tuple[list[int], dict[int, int]], form: ChecksumForm) -> None:
    numbers, values = case
    if sum(1 + packet_size(number) for number in numbers) > 255:
        return  # the length is one byte
    decoder = StreamDecoder(numbers)
    assert decoder.feed(encoded_frame(numbers, values, form)) == [values]
    assert decoder.checksum_form is form


def test_answers_of_the_wrong_length_and_implausible_counts() -> None:
    with pytest.raises(FrameError, match="80 bytes, not 79"):
        decode_packets([100], bytes(79))
    assert implausible({35: 4, 22: 15000, 27: 5000, 8: 255}) == {
        "oi_mode": 4,
        "wall_signal": 5000,
        "wall": 255,
    }


def test_models_by_name() -> None:
    assert model_named("roomba") is CREATE_2
    with pytest.raises(ConfigError, match="create2"):
        model_named("create_2")


# -- ten million random bytes --------------------------------------------------------------------------------

SHORT = bytes([19, 2, 7])
"""How each frame of a stream of packet 7 begins; then come the value and the checksum."""


def test_wrong_frames_pass_only_as_often_as_their_checksum_lets_them() -> None:
    # Frames that are right but for a random value and a random checksum: one in 256 is good by chance.
    rows = np.random.default_rng(1).integers(0, 256, (200_000, 2), dtype=np.uint8)
    rows = rows[(rows[:, 0] != 19) & (rows[:, 1] != 19)]  # a 19 would begin a frame of its own
    data = b"".join(SHORT + row.tobytes() for row in rows)
    decoder = StreamDecoder([7])
    decoder.feed(SHORT + bytes([0, 247]))
    frames = len(decoder.feed(data))
    good = int(np.sum((9 + rows.astype(int).sum(axis=1)) % 256 == 0))
    assert len(rows) / 256 == pytest.approx(good, rel=0.15)
    # Besides those, three frames in a row of the other form would change the form: next to never by chance.
    assert frames == pytest.approx(good, abs=0.02 * good)


@pytest.mark.slow
def test_ten_million_random_bytes() -> None:
    data = np.random.default_rng(2).integers(0, 256, 10_000_000, dtype=np.uint8).tobytes()
    driver_stream, short = StreamDecoder(STREAMED_PACKETS), StreamDecoder([7])
    for place in range(0, len(data), 4096):
        piece = data[place : place + 4096]
        assert driver_stream.feed(piece) == []
        short.feed(piece)
    # A frame of the short stream has 3 known bytes and a checksum: 10e6 / 2^32 are expected, so none.
    assert driver_stream.good_frames + short.good_frames <= 1
    assert len(data) - driver_stream.noise_bytes < 75
    candidates = data.count(SHORT)
    assert short.good_frames + short.bad_frames <= candidates
