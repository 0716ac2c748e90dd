"""The emulated Create's other commands against the manual: songs, scripts, demos."""

import struct
from typing import Any

import pytest

from florence_bt.simulation.emulators.create import CreateEmulator, Mode
from tests.emulators.create_bench import awake


def roll(create: CreateEmulator, base: Any, start: float, seconds: float, until: Any = None) -> float:
    """Let time pass in steps of 5 ms; gives the time at which a condition became so, or the end."""
    now = start
    while now < start + seconds - 1e-9:
        base.step(0.005)
        now += 0.005
        create.poll(now)
        if until is not None and until():
            return now
    return now


# -- songs, lights, drivers ---------------------------------------------------------------------------------


def test_a_song_plays_as_long_as_its_notes(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([140, 2, 2, 60, 32, 64, 32]), 0.0)
    assert create.receive(bytes([149, 2, 36, 37]), 0.0) == bytes([0, 0])
    create.receive(bytes([141, 2]), 0.0)
    assert create.receive(bytes([149, 2, 36, 37]), 0.9) == bytes([2, 1])
    create.receive(bytes([140, 3, 1, 70, 8, 141, 3]), 0.95)  # ignored: another one plays
    assert create.receive(bytes([149, 2, 36, 37]), 1.0) == bytes([2, 0])
    assert create.songs.played == [2]
    assert create.rejected == {141: 1}


def test_songs_need_a_number_and_a_drive_mode(base: Any) -> None:
    create = awake(base, 128)
    create.receive(bytes([140, 16, 1, 60, 8, 140, 1, 1, 60, 8, 141, 1]), 0.0)
    assert create.songs.played == []
    assert create.rejected == {140: 1, 141: 1}


def test_low_side_drivers_and_infrared(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([138, 5]), 0.0)
    assert create.low_side_drivers == (128, 0, 128)
    create.receive(bytes([144, 10, 20, 30, 151, 135]), 0.0)
    assert create.low_side_drivers == (30, 20, 10)  # driver 2 comes first
    assert create.infrared_sent == [135]
    create.receive(bytes([128]), 0.0)
    assert create.low_side_drivers == (0, 0, 0)


def test_baud(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([129, 7]), 0.0)
    assert create.baud_rate == 19200
    create.receive(bytes([129, 12]), 0.0)
    assert (create.baud_rate, create.rejected) == (19200, {129: 1})


def test_signals_inputs_and_buttons(base: Any) -> None:
    create = awake(base)
    faults = create.faults
    faults.wall, faults.virtual_wall, faults.infrared, faults.buttons = True, True, 250, 5
    faults.digital_inputs, faults.overcurrents = 6, 24
    answer = create.receive(bytes([149, 7, 8, 13, 14, 17, 18, 32, 27]), 0.0)
    assert answer == bytes([1, 1, 24, 250, 5, 0x16, 1, 44])


# -- scripts -------------------------------------------------------------------------------------------------


def test_a_script_is_stored_shown_and_cleared(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([152, 3, 155, 30, 153]), 0.0)
    assert create.receive(bytes([154]), 0.0) == bytes([3, 155, 30, 153])
    create.receive(bytes([152, 0]), 0.0)
    assert create.receive(bytes([154]), 0.0) == bytes([0])


def test_the_manuals_kind_of_script_drives_400_mm_and_stops(base: Any) -> None:
    create = awake(base, 131)
    drive, wait, stop = [137, 1, 44, 128, 0], [156, 1, 144], [145, 0, 0, 0, 0]
    script = [*drive, *wait, *stop]
    create.receive(bytes([152, len(script), *script, 153]), 0.0)
    assert base.wheels == (0.3, 0.3)
    # Nothing is obeyed while it waits.
    create.receive(bytes([145, 0, 0, 0, 0]), 0.01)
    assert base.wheels == (0.3, 0.3)
    roll(create, base, 0.01, 2.0)
    assert base.wheels == (0.0, 0.0)
    assert base.advanced == pytest.approx(0.4, abs=0.003)
    assert create.receive(bytes([142, 35]), 3.0) == bytes([2])  # it listens again


def test_waits_for_angle_and_time(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([145, 0, 130, 255, 126, 157, 0, 90]), 0.0)  # 1 rad/s to the left
    end = roll(create, base, 0.0, 5.0, lambda: create.receive(bytes([142, 35]), 0.0) != b"")
    assert end == pytest.approx(1.5708, abs=0.006)
    create.receive(bytes([155, 20]), 10.0)
    assert create.receive(bytes([142, 35]), 11.9) == b""
    assert create.receive(bytes([142, 35]), 12.0) == bytes([3])


@pytest.mark.parametrize("keeps_input", [False, True])
def test_what_comes_during_a_wait_is_ignored_unless_told_otherwise(base: Any, keeps_input: bool) -> None:
    """REFERENCE 1.4; some clients send a wait, the stop and a question in pieces, and need the option."""
    create = awake(base, keeps_input=keeps_input)
    create.receive(bytes([145, 0, 100, 0, 100, 155, 10]), 0.0)
    assert create.receive(bytes([145, 0, 0, 0, 0, 142, 35]), 0.5) == b""
    assert base.wheels == (0.1, 0.1)
    answer = bytes([3]) if keeps_input else b""
    assert create.poll(1.0) == answer
    assert base.wheels == ((0.0, 0.0) if keeps_input else (0.1, 0.1))
    assert create.receive(bytes([145, 0, 0, 0, 0, 142, 35]), 1.1) == bytes([3])
    assert base.wheels == (0.0, 0.0)


def test_a_command_of_which_only_the_beginning_came_before_a_wait_is_no_command(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([155, 10, 142, 35, 145, 0]), 0.0)
    create.receive(bytes([100, 0, 100]), 0.5)
    assert create.receive(bytes([142, 35, 142, 35, 142, 35]), 1.0) == bytes([3, 3, 3, 3])
    assert base.wheels == (0.0, 0.0)


def test_what_came_together_with_a_wait_is_obeyed_after_it(base: Any) -> None:
    """Clients send a wait, the stop, and a question whose answer tells them that the wait is over."""
    create = awake(base)
    create.receive(bytes([145, 0, 100, 0, 100, 156, 0, 50, 145, 0, 0, 0, 0, 152, 0, 154]), 0.0)
    assert base.wheels == (0.1, 0.1)
    base.step(0.4)
    assert (create.poll(0.4), base.wheels) == (b"", (0.1, 0.1))
    base.step(0.2)
    assert (create.poll(0.6), base.wheels) == (bytes([0]), (0.0, 0.0))


@pytest.mark.parametrize(("wait", "packet", "shown"), [(156, 19, 50), (157, 20, 51)])
def test_waits_reset_their_packet(base: Any, wait: int, packet: int, shown: int) -> None:
    create = awake(base)
    speeds = [0, 100, 0, 100] if wait == 156 else [0, 100, 255, 156]
    create.receive(bytes([145, *speeds]), 0.0)
    roll(create, base, 0.0, 1.0)  # 100 mm, or 44 degrees
    create.receive(bytes([wait, 0, 50, 145, 0, 0, 0, 0]), 1.0)
    roll(create, base, 1.0, 2.0)
    assert int.from_bytes(create.receive(bytes([142, packet]), 4.0), "big") == pytest.approx(shown, abs=1)


def test_showing_the_script_halts_the_stream(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([148, 1, 7]), 0.0)
    assert create.receive(bytes([154]), 0.0) == bytes([0])
    assert create.poll(0.1) == b""
    create.receive(bytes([150, 1]), 0.1)
    assert create.poll(0.2) != b""


@pytest.mark.parametrize("velocity", [(0, 0), (0, 100)])
def test_radius_0_is_straight_on(base: Any, velocity: tuple[int, int]) -> None:
    """PyRobot's ``stop`` is velocity 0 and radius 0."""
    create = awake(base)
    create.receive(bytes([145, 0, 200, 0, 100, 137, *velocity, 0, 0]), 0.0)
    assert base.wheels == (velocity[1] / 1000.0, velocity[1] / 1000.0)


def test_a_negative_distance_waits_for_the_way_back(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([145, 255, 156, 255, 156, 156, 255, 206]), 0.0)  # 100 mm/s back, wait for -50 mm
    assert roll(create, base, 0.0, 2.0, lambda: create.receive(bytes([142, 35]), 0.0) != b"") == (
        pytest.approx(0.5, abs=0.006)
    )


def test_a_script_that_goes_round_without_a_wait_does_not_hang(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([152, 6, 145, 0, 10, 0, 10, 153, 153]), 0.0)
    create.poll(0.1)
    assert base.wheels == (0.01, 0.01)
    assert create.receive(bytes([128, 142, 35]), 0.2) == bytes([1])


def test_a_reset_ends_a_script(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([152, 2, 155, 10, 7]), 0.0)
    create.poll(4.0)
    assert create.receive(bytes([128, 154]), 4.0) == bytes([0])


# -- built-in behaviours -------------------------------------------------------------------------------------


def test_cover_drives_in_passive_mode_and_turns_away_from_what_it_hits(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([135]), 0.0)
    create.poll(0.1)
    assert (create.mode, base.wheels) == (Mode.PASSIVE, (0.3, 0.3))
    base.pressed = (True, False)
    create.poll(0.2)
    base.pressed = (False, False)
    assert base.wheels[0] < 0.0
    create.poll(1.0)
    assert base.wheels == (-0.15, 0.15)
    create.poll(3.0)
    assert base.wheels == (0.3, 0.3)
    create.receive(bytes([131]), 3.1)
    assert (create.mode, base.wheels) == (Mode.SAFE, (0.0, 0.0))


def test_demos_end(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([136, 0]), 0.0)
    create.poll(1.0)
    assert base.wheels == (0.3, 0.3)
    create.receive(bytes([136, 255]), 1.1)
    assert base.wheels == (0.0, 0.0)
    create.receive(bytes([143]), 2.0)
    create.poll(2.1)
    create.faults.dock = True
    create.poll(2.2)
    assert base.wheels == (0.0, 0.0)
    create.receive(bytes([134]), 3.0)
    create.poll(3.1)
    create.faults.wheel_drops = 8
    create.poll(3.2)
    assert base.wheels == (0.0, 0.0)
    create.receive(bytes([136, 10]), 4.0)
    assert create.rejected == {136: 1}


# -- dock, charging, gyro, line ------------------------------------------------------------------------------


def test_the_dock_ends_safe_mode_on_arrival_and_can_be_left(base: Any) -> None:
    create = awake(base, 131)
    create.receive(bytes([145, 0, 100, 0, 100]), 0.0)
    create.faults.dock = True
    create.poll(0.1)
    assert (create.mode, base.wheels) == (Mode.PASSIVE, (0.0, 0.0))
    assert create.receive(bytes([149, 3, 21, 34, 17]), 0.2) == bytes([2, 2, 254])
    create.receive(bytes([131, 145, 255, 156, 255, 156]), 0.3)
    create.poll(0.4)
    assert (create.mode, base.wheels) == (Mode.SAFE, (-0.1, -0.1))


def test_charging_states(base: Any) -> None:
    create = awake(base, 128)
    create.faults.dock = True

    def state(now: float) -> int:
        return create.receive(bytes([142, 21]), now)[0]

    create.battery.charge_mah = 20.0
    assert state(0.0) == 1  # reconditioning
    create.battery.charge_mah = 2000.0
    assert state(1.0) == 2
    create.poll(2.0)
    create.poll(3600.0)
    assert (state(3600.0), create.battery.charge_mah) == (3, 2700.0)  # full: trickle
    create.faults.charging_fault = True
    assert state(3601.0) == 5
    create.faults.charging_fault = False
    create.battery.charge_mah = 2000.0
    create.battery.temperature_c = 50.0
    assert state(3602.0) == 4  # waits until it is cool
    for minute in range(30):
        create.poll(3602.0 + 60.0 * minute)
    assert state(5500.0) == 2


def test_gyro_faults(base: Any) -> None:
    create = awake(base)
    create.faults.gyro_drift = 2.0
    create.poll(0.0)
    create.poll(10.0)
    assert struct.unpack(">H", create.receive(bytes([142, 33]), 10.0)) == (532,)
    create.faults.gyro_dead = True
    assert create.receive(bytes([142, 33]), 10.0) == bytes([0, 0])


def test_deaf_and_cut_answers(base: Any) -> None:
    create = awake(base)
    create.faults.commands_lost = True
    assert create.receive(bytes([142, 35]), 0.0) == b""
    create.faults.commands_lost = False
    create.faults.partial_frames = 1
    assert len(create.receive(bytes([142, 6]), 0.0)) == 26
    create.faults.noise = b"\xaa"
    assert create.receive(bytes([142, 35]), 0.0) == b"\xaa\x03"


def test_a_stream_longer_than_its_length_byte_is_cut(base: Any) -> None:
    create = awake(base)
    create.receive(bytes([148, 6, 6, 6, 6, 6, 6, 7]), 0.0)
    frame = create.poll(0.015)
    assert frame[1] == 4 * 53 + 2
    assert create.receive(bytes([142, 38]), 0.016) == bytes([5])
