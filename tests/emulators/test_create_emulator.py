"""The emulated Create against the manual's own words: bytes in, bytes out, with nothing of the driver."""

import struct
from typing import Any

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.simulation.emulators.create import BOOT_S, CreateEmulator, Mode
from florence_bt.simulation.sensors.base_noise import PERFECT_BASE, BaseNoiseParameters, BaseSensors

PERIOD = 0.015


def make(base: Any, **how: Any) -> CreateEmulator:
    return CreateEmulator(base, BaseSensors(base, 0, PERFECT_BASE), **how)


def woken(base: Any, mode: int = 132, **how: Any) -> CreateEmulator:
    create = make(base, **how)
    create.receive(bytes([128, mode]), 0.0)
    return create


def test_off_means_deaf_until_started(base: Any) -> None:
    create = make(base)
    assert create.receive(bytes([142, 35, 132, 145, 0, 100, 0, 100]), 0.0) == b""
    assert create.mode is Mode.OFF
    assert create.receive(bytes([128, 142, 35]), 0.0) == bytes([1])
    assert base.wheels == (0.0, 0.0)


@pytest.mark.parametrize(("opcode", "mode"), [(128, 1), (130, 2), (131, 2), (132, 3)])
def test_modes(base: Any, opcode: int, mode: int) -> None:
    assert woken(base, opcode).receive(bytes([142, 35]), 0.0) == bytes([mode])


def test_group_6_at_once(base: Any) -> None:
    answer = woken(base).receive(bytes([142, 6]), 0.0)
    assert len(answer) == 52
    values = struct.unpack(">12B2hBHhb7HBH5B4h", answer)
    assert values[10] == 255  # infrared: nothing
    assert values[13 + 13] == 512  # the gyro at rest (27th value, packet 33)
    assert values[28] == 3


@pytest.mark.parametrize(("group", "size"), list(enumerate([26, 10, 6, 10, 14, 12, 52])))
def test_group_sizes(base: Any, group: int, size: int) -> None:
    assert len(woken(base).receive(bytes([142, group]), 0.0)) == size


def test_query_list_has_neither_header_nor_checksum(base: Any) -> None:
    assert woken(base).receive(bytes([149, 2, 7, 19]), 0.0) == bytes([0, 0, 0])


@pytest.mark.parametrize(
    ("command", "wheels"),
    [
        ([145, 0, 150, 255, 106], (-0.150, 0.150)),  # right first
        ([145, 1, 9, 0, 135], (0.135, 0.265)),
        ([145, 3, 232, 252, 24], (-0.5, 0.5)),  # 1000 and -1000 are clamped
        ([137, 0, 200, 128, 0], (0.2, 0.2)),
        ([137, 0, 200, 127, 255], (0.2, 0.2)),
        ([137, 0, 200, 255, 255], (0.2, -0.2)),  # clockwise
        ([137, 0, 200, 0, 1], (-0.2, 0.2)),  # counter-clockwise
        ([137, 255, 56, 1, 244], (-0.148, -0.252)),  # -200 mm/s on a radius of 500 mm
    ],
)
def test_drive_commands(base: Any, command: list[int], wheels: tuple[float, float]) -> None:
    create = woken(base)
    create.receive(bytes(command), 0.0)
    assert base.wheels == pytest.approx(wheels)


def test_the_last_speed_persists(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([145, 0, 100, 0, 100]), 0.0)
    create.poll(3600.0)
    assert base.wheels == (0.1, 0.1)


def test_passive_stops(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([145, 0, 100, 0, 100]), 0.0)
    create.receive(bytes([128]), 0.1)
    assert base.wheels == (0.0, 0.0)
    assert create.receive(bytes([145, 0, 100, 0, 100]), 0.2) == b""
    assert base.wheels == (0.0, 0.0)
    assert create.rejected == {145: 1}


def test_commands_byte_by_byte_and_unknown_ones(base: Any) -> None:
    create = make(base)
    # 200 and 5 are no opcodes; 140 is a song of two notes.
    for byte in [128, 200, 5, 132, 140, 0, 2, 60, 8, 62, 8, 145, 0, 50, 0, 60]:
        create.receive(bytes([byte]), 0.0)
    assert base.wheels == (0.06, 0.05)
    assert create.unknown_bytes == 2
    assert create.songs.notes(0) == bytes([60, 8, 62, 8])
    assert create.rejected == {}


def test_stream_of_the_manuals_example(base: Any) -> None:
    create = woken(base)
    assert create.receive(bytes([148, 2, 29, 13]), 0.0) == b""
    assert create.poll(0.014) == b""
    frame = create.poll(0.015)
    assert frame[:3] == bytes([19, 5, 29])
    assert len(frame) == 8
    assert sum(frame[1:]) % 256 == 0  # the header is not counted


def test_the_other_checksum(base: Any) -> None:
    create = woken(base, header_in_checksum=True)
    create.receive(bytes([148, 2, 29, 13]), 0.0)
    assert sum(create.poll(0.015)) % 256 == 0


def test_one_frame_every_15_ms_and_no_burst(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([148, 1, 7]), 0.0)
    frames = [create.poll(step * 0.001) for step in range(1, 301)]
    assert sum(1 for frame in frames if frame) == 20
    assert len(create.poll(2.0)) == 5
    assert create.poll(2.001) == b""


def test_pause_resume_and_end(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([148, 1, 7, 150, 0]), 0.0)
    assert create.poll(1.0) == b""
    create.receive(bytes([150, 1]), 1.0)
    assert create.poll(1.0 + PERIOD) == bytes([19, 2, 7, 0, 247])
    create.receive(bytes([148, 0]), 1.1)
    assert create.poll(2.0) == b""


def drive(create: CreateEmulator, base: Any, seconds: float, start: float = 0.0) -> None:
    for number in range(1, round(seconds / 0.01) + 1):
        base.step(0.01)
        create.poll(start + number * 0.01)


def test_distance_and_angle_reset_when_read_and_keep_the_rest(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([145, 0, 101, 0, 100]), 0.0)
    total_distance = total_angle = 0
    for part in range(20):
        drive(create, base, 0.07, part * 0.07)
        distance, angle = struct.unpack(">hh", create.receive(bytes([149, 2, 19, 20]), (part + 1) * 0.07))
        total_distance += distance
        total_angle += angle
    assert total_distance == 140  # 140.7 mm
    assert total_angle == 0  # 0.3 degrees
    assert create.receive(bytes([142, 19]), 1.4) == bytes([0, 0])


def test_query_and_stream_share_the_reset(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([145, 0, 100, 0, 100, 148, 1, 19]), 0.0)
    base.step(0.1)
    assert create.poll(0.1)[3:5] == bytes([0, 10])
    assert create.receive(bytes([142, 19]), 0.1) == bytes([0, 0])


def test_distance_saturates(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([145, 1, 244, 1, 244]), 0.0)
    base.step(100.0)
    assert struct.unpack(">h", create.receive(bytes([142, 19]), 100.0)) == (32767,)


def test_gyro_of_the_reference(base: Any) -> None:
    create = woken(base)
    base.set_wheels(-0.13 * 0.7853981634, 0.13 * 0.7853981634)  # +45 degrees/s
    assert struct.unpack(">H", create.receive(bytes([142, 33]), 0.0)) == (398,)


@pytest.mark.parametrize(
    "fault", [{"wheel_drops": 16}, {"charger": True}, {"cliffs": (False, True, False, False)}]
)
def test_safe_mode_protects_and_full_does_not(base: Any, fault: dict[str, Any]) -> None:
    for opcode, mode, speed in ((131, Mode.PASSIVE, 0.0), (132, Mode.FULL, 0.1)):
        create = woken(base, opcode)
        create.receive(bytes([145, 0, 100, 0, 100]), 0.0)
        for name, value in fault.items():
            setattr(create.faults, name, value)
        create.poll(0.01)
        assert (create.mode, base.wheels) == (mode, (speed, speed))


@pytest.mark.parametrize(
    ("command", "mode"),
    [
        ([145, 255, 156, 255, 156], Mode.SAFE),  # straight back
        ([145, 255, 206, 255, 106], Mode.SAFE),  # back around a far point
        ([145, 0, 10, 255, 106], Mode.PASSIVE),  # back around a point within the robot
        ([145, 0, 100, 255, 156], Mode.SAFE),  # spin
    ],
)
def test_cliffs_matter_by_direction(base: Any, command: list[int], mode: Mode) -> None:
    create = woken(base, 131)
    create.faults.cliffs = (True, False, False, False)
    create.receive(bytes(command), 0.0)
    assert create.mode is mode


def test_bumpers_are_only_told(base: Any) -> None:
    create = woken(base, 131)
    create.receive(bytes([145, 0, 100, 0, 100]), 0.0)
    base.pressed = (True, False)
    create.faults.right_bumper = True
    assert create.receive(bytes([142, 7]), 0.0) == bytes([3])
    assert base.wheels == (0.1, 0.1)


def test_entering_safe_ends_charging_and_the_plug_ends_safe(base: Any) -> None:
    create = woken(base, 128)
    create.faults.charger = True
    create.poll(0.0)
    assert create.receive(bytes([149, 2, 21, 34]), 0.0) == bytes([2, 1])
    create.receive(bytes([132]), 0.0)
    assert create.receive(bytes([142, 21]), 0.0) == bytes([0])
    create.receive(bytes([128, 131]), 0.0)
    assert create.mode is Mode.PASSIVE


def test_soft_reset_boots_for_a_while(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([147, 1, 145, 0, 100, 0, 100, 148, 1, 7, 7]), 0.0)
    assert (create.mode, base.wheels, create.digital_outputs) == (Mode.OFF, (0.0, 0.0), 7)
    assert create.poll(0.4) == b""
    assert create.receive(bytes([128, 142, 35]), 0.6).startswith(b"bl-start\r\n")
    assert create.poll(BOOT_S).startswith(b"RDK by iRobot!\r\n")
    assert create.digital_outputs == 0
    assert create.receive(bytes([128, 142, 35]), BOOT_S + 0.1) == bytes([1])


def test_a_create_2_tells_of_its_reset_and_counts_from_nothing(base: Any) -> None:
    create = woken(base, model="create2")
    create.receive(bytes([145, 0, 100, 0, 100]), 0.0)
    base.step(1.0)
    assert create.receive(bytes([149, 2, 43, 44]), 1.0) == bytes([0, 224, 0, 224])
    create.receive(bytes([7]), 1.0)
    texts = [create.poll(1.0 + 0.5 * step) for step in range(7)]
    assert b"".join(texts) == b"Soft reset!\n\xfeRoomba by iRobot!\r\nstm32\r\n"
    assert create.receive(bytes([128, 149, 3, 43, 44, 19]), 5.0) == bytes(6)


def test_switching_it_off_and_on(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([129, 11, 140, 0, 1, 60, 8, 147, 5, 145, 0, 100, 0, 100, 148, 1, 7]), 0.0)
    create.set_power(False, 0.1)
    assert (create.mode, base.wheels, create.digital_outputs) == (Mode.OFF, (0.0, 0.0), 0)
    assert create.receive(bytes([128, 142, 35]), 1.0) + create.poll(5.0) == b""
    create.set_power(True, 5.0)
    create.set_power(True, 5.1)
    assert (create.digital_outputs, create.baud_rate) == (7, 57600)
    assert create.poll(5.0 + BOOT_S) != b""
    assert (create.digital_outputs, create.mode) == (0, Mode.OFF)
    assert create.receive(bytes([142, 35]), 9.0) == b""
    assert create.receive(bytes([128, 132, 141, 0, 142, 37]), 9.0) == bytes([0])  # the song is forgotten


def test_leds_and_outputs(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([139, 2, 10, 20, 147, 5]), 0.0)
    assert (create.leds, create.digital_outputs) == ((2, 10, 20), 5)
    create.receive(bytes([131]), 0.1)
    assert (create.leds, create.digital_outputs) == ((0, 0, 0), 5)  # as the manual says of Safe


def test_faults_of_the_line(base: Any) -> None:
    create = woken(base)
    create.receive(bytes([148, 1, 7]), 0.0)
    create.faults.noise = b"\x13\x00"
    create.faults.bad_checksums = 1
    assert create.poll(0.015) == bytes([0x13, 0, 19, 2, 7, 0, 248])
    create.faults.partial_frames = 1
    assert create.poll(0.030) == bytes([19, 2])
    create.faults.silent = True
    assert create.poll(0.045) == b""
    create.faults.silent = False
    assert create.poll(0.060) == bytes([19, 2, 7, 0, 247])


def test_battery_drains_and_charges(base: Any) -> None:
    def charge(create: CreateEmulator, now: float) -> int:
        return int.from_bytes(create.receive(bytes([142, 25]), now), "big")

    create = woken(base, 128)
    full = charge(create, 0.0)
    assert charge(create, 3600.0) == full - 250
    create.faults.charger = True
    create.poll(3600.0)
    create.poll(3600.0)
    assert charge(create, 3600.0 + 360.0) > full - 250


# -- noise -------------------------------------------------------------------------------------------------


def measured(
    base: Any, seed: int, parameters: BaseNoiseParameters | None = None
) -> tuple[int, int, list[int]]:
    sensors = BaseSensors(base, seed, parameters)
    base.set_wheels(0.2, 0.3)
    counts = []
    for number in range(500):
        base.step(0.01)
        sensors.update((number + 1) * 0.01)
        counts.append(sensors.gyro_adc())
    return sensors.take_distance_mm(), sensors.take_angle_deg(), counts


def test_same_seed_same_noise(base: Any) -> None:
    first = measured(base, 7)
    assert measured(type(base)(), 7) == first
    assert measured(type(base)(), 8) != first


def test_the_noise_is_as_large_as_declared(base: Any) -> None:
    runs = [measured(type(base)(), seed) for seed in range(40)]
    distances = [run[0] for run in runs]
    mean = sum(distances) / len(distances)
    assert mean == pytest.approx(1250, abs=4)
    spread = (sum((distance - mean) ** 2 for distance in distances) / len(distances)) ** 0.5
    # 0.5 % of each wheel's metre and more: sqrt(0.5^2 + 0.75^2) * 0.005 = 4.5 mm, slip 1.6 mm.
    assert 3.0 < spread < 7.0
    adc = [count for run in runs for count in run[2]]
    level = sum(adc) / len(adc)
    assert level == pytest.approx(512 * (1 - 22.035 / 202.5), abs=0.3)
    assert 0.9 < (sum((count - level) ** 2 for count in adc) / len(adc)) ** 0.5 < 1.2


def test_nothing_moves_nothing_measured(base: Any) -> None:
    sensors = BaseSensors(base, 3)
    for number in range(1000):
        sensors.update(number * 0.01)
    assert (sensors.take_distance_mm(), sensors.take_angle_deg()) == (0, 0)


def test_wrong_noise_is_named() -> None:
    with pytest.raises(ConfigError, match="slip_sigma"):
        BaseNoiseParameters(slip_sigma=-1.0)
    with pytest.raises(ConfigError, match="gyro_offset"):
        BaseNoiseParameters(gyro_offset=0.0)
