"""What an emulated Create 2 has more than a Create: packets, encoders, commands."""

import struct
from typing import Any

from florence_bt.simulation.emulators.create import Mode
from tests.emulators.create_bench import awake


def test_create_2_groups(base: Any) -> None:
    create = awake(base, model="create2")
    sizes = [len(create.receive(bytes([142, group]), 0.0)) for group in (100, 101, 106, 107, 6)]
    assert sizes == [80, 28, 12, 9, 52]
    assert awake(type(base)()).receive(bytes([142, 100]), 0.0) == b""


def test_create_2_counts_its_header(base: Any) -> None:
    create = awake(base, model="create2")
    create.receive(bytes([148, 2, 43, 44]), 0.0)
    assert sum(create.poll(0.015)) % 256 == 0
    assert create.baud_rate == 115200


def test_create_2_encoders_wrap(base: Any) -> None:
    create = awake(base, model="create2")
    base.rolled = (0.444565, -0.000444565)
    left, right = struct.unpack(">HH", create.receive(bytes([149, 2, 43, 44]), 0.0))
    assert left in (999, 1000)
    assert right == 65535


def test_create_2_commands(base: Any) -> None:
    create = awake(base, model="create2")
    create.receive(bytes([146, 0, 255, 255, 1]), 0.0)
    assert base.wheels == (-0.5, 0.5)
    create.receive(bytes([164, 72, 69, 76, 80, 136]), 0.0)  # text is read over; 136 has no number here
    assert create.mode is Mode.PASSIVE
    create.receive(bytes([132, 133]), 0.0)
    assert create.mode is Mode.PASSIVE
    create.receive(bytes([148, 1, 7, 173]), 0.0)
    assert create.mode is Mode.OFF
    assert create.poll(1.0) == b""
    assert create.receive(bytes([142, 35]), 1.0) == b""


def test_create_2_light_bumpers_motors_and_odd_mode(base: Any) -> None:
    create = awake(base, model="create2")
    create.faults.light_bumps = (0, 50, 200, 0, 0, 4095)
    create.faults.oi_mode_offset = 1
    create.receive(bytes([145, 0, 100, 0, 200]), 0.0)
    assert create.receive(bytes([142, 45]), 0.0) == bytes([0b100100])
    assert struct.unpack(">6H", create.receive(bytes([142, 106]), 0.0)) == (0, 50, 200, 0, 0, 4095)
    assert struct.unpack(">4hB", create.receive(bytes([142, 107]), 0.0)) == (120, 60, 0, 0, 1)
    assert create.receive(bytes([142, 35]), 0.0) == bytes([4])


def test_a_stream_of_every_packet_of_a_create_2(base: Any) -> None:
    """Its manual knows up to 108 packets in a stream; the Create's 43."""
    create = awake(base, model="create2")
    packets = [*range(7, 59), 35, 35]
    create.receive(bytes([148, len(packets), *packets]), 0.0)
    frame = create.poll(0.015)
    assert (frame[1], len(frame)) == (80 + 52 + 4, 80 + 52 + 4 + 3)
    assert create.receive(bytes([142, 38]), 0.016) == bytes([54])


def test_distance_saturates_and_begins_anew(base: Any) -> None:
    """What is not read in time is capped, and lost (REFERENCE 1.5)."""
    create = awake(base)
    base.rolled = (40.0, 40.0)
    assert create.receive(bytes([142, 19]), 1.0) == bytes([127, 255])
    assert create.receive(bytes([142, 19]), 1.0) == bytes([0, 0])
    base.rolled = (-0.0005, -0.0005)
    assert create.receive(bytes([142, 19]), 2.0) == bytes([128, 0])
    base.rolled = (-0.0015, -0.0015)
    assert create.receive(bytes([142, 19]), 3.0) == bytes([255, 255])  # the half millimetre is kept


def test_infrared_of_the_docks(base: Any) -> None:
    create = awake(base, model="create2")
    assert create.receive(bytes([149, 3, 17, 52, 53]), 0.0) == bytes([255] * 3)  # nothing (REFERENCE 1.5)
    create.faults.dock = True
    assert create.receive(bytes([149, 3, 17, 52, 53]), 0.1) == bytes([161] * 3)
    create.faults.infrared = 130
    assert create.receive(bytes([142, 17]), 0.2) == bytes([130])
