"""All sensors of a base as one value, in units that people use (REFERENCE 2.6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from florence_bt.drivers.turtlebot.codec.packets import PACKETS, OiMode


@dataclass(frozen=True, slots=True)
class SensorState:
    """Everything the base reports about itself: first the fields of TurtlebotSensorState but the header.

    Attributes:
        bumps_wheeldrops: Bits: bump right, bump left, drop right, drop left, drop caster.
        wall: The right-hand wall sensor sees one.
        cliff_left: The floor is missing there.
        cliff_front_left: The floor is missing there.
        cliff_front_right: The floor is missing there.
        cliff_right: The floor is missing there.
        virtual_wall: An infrared wall is seen.
        motor_overcurrents: Bits.
        dirt_detector_left: Always 0 on a Create.
        dirt_detector_right: Always 0 on a Create.
        remote_opcode: Infrared byte, 255 for nothing.
        buttons: Bits: 0 Play, 2 Advance.
        distance: Metres since the last read, forward positive.
        angle: Radians since the last read, counter-clockwise positive, in steps of one degree.
        charging_state: See ``ChargingState``.
        voltage: Battery, mV.
        current: mA, negative while discharging.
        temperature: Battery, degrees Celsius.
        charge: mAh.
        capacity: mAh.
        wall_signal: 0 to 4095.
        cliff_left_signal: 0 to 4095.
        cliff_front_left_signal: 0 to 4095.
        cliff_front_right_signal: 0 to 4095.
        cliff_right_signal: 0 to 4095.
        user_digital_outputs: Bits that the host set last; the base does not report them.
        user_digital_inputs: Bits.
        user_analog_input: 0 to 1023 for 0 to 5 V; the gyro.
        charging_sources_available: Bits: 0 internal charger, 1 home base.
        oi_mode: See ``OiMode``.
        song_number: Selected song.
        song_playing: A song plays.
        number_of_stream_packets: Packets in the stream.
        requested_velocity: m/s, from Drive.
        requested_radius: m, from Drive.
        requested_right_velocity: m/s, from Drive Direct.
        requested_left_velocity: m/s, from Drive Direct.
        left_encoder: Create 2: counts, 65535 is followed by 0.
        right_encoder: Create 2: counts.
        light_bumper: Create 2: bits, left to right.
        light_bump_left_signal: Create 2: 0 to 4095.
        light_bump_front_left_signal: Create 2: 0 to 4095.
        light_bump_center_left_signal: Create 2: 0 to 4095.
        light_bump_center_right_signal: Create 2: 0 to 4095.
        light_bump_front_right_signal: Create 2: 0 to 4095.
        light_bump_right_signal: Create 2: 0 to 4095.
        remote_opcode_left: Create 2: infrared byte.
        remote_opcode_right: Create 2: infrared byte.
        left_motor_current: Create 2: mA.
        right_motor_current: Create 2: mA.
        main_brush_current: Create 2: mA.
        side_brush_current: Create 2: mA.
        stasis: Create 2: bits; 0 the front wheel turns.
        stamp: When it arrived, seconds; told with what is published.
    """

    bumps_wheeldrops: int = 0
    wall: bool = False
    cliff_left: bool = False
    cliff_front_left: bool = False
    cliff_front_right: bool = False
    cliff_right: bool = False
    virtual_wall: bool = False
    motor_overcurrents: int = 0
    dirt_detector_left: int = 0
    dirt_detector_right: int = 0
    remote_opcode: int = 255
    buttons: int = 0
    distance: float = 0.0
    angle: float = 0.0
    charging_state: int = 0
    voltage: int = 0
    current: int = 0
    temperature: int = 0
    charge: int = 0
    capacity: int = 0
    wall_signal: int = 0
    cliff_left_signal: int = 0
    cliff_front_left_signal: int = 0
    cliff_front_right_signal: int = 0
    cliff_right_signal: int = 0
    user_digital_outputs: int = 0
    user_digital_inputs: int = 0
    user_analog_input: int = 0
    charging_sources_available: int = 0
    oi_mode: int = 0
    song_number: int = 0
    song_playing: bool = False
    number_of_stream_packets: int = 0
    requested_velocity: float = 0.0
    requested_radius: float = 0.0
    requested_right_velocity: float = 0.0
    requested_left_velocity: float = 0.0
    left_encoder: int = 0
    right_encoder: int = 0
    light_bumper: int = 0
    light_bump_left_signal: int = 0
    light_bump_front_left_signal: int = 0
    light_bump_center_left_signal: int = 0
    light_bump_center_right_signal: int = 0
    light_bump_front_right_signal: int = 0
    light_bump_right_signal: int = 0
    remote_opcode_left: int = 255
    remote_opcode_right: int = 255
    left_motor_current: int = 0
    right_motor_current: int = 0
    main_brush_current: int = 0
    side_brush_current: int = 0
    stasis: int = 0
    stamp: float = 0.0

    @property
    def cliff(self) -> bool:
        """Tell whether any of the four cliff sensors misses the floor."""
        return self.cliff_left or self.cliff_front_left or self.cliff_front_right or self.cliff_right

    @property
    def in_drive_mode(self) -> bool:
        """Tell whether the base is in a mode that takes speeds; one unknown to the manual is none."""
        return self.oi_mode in (OiMode.SAFE, OiMode.FULL)

    @property
    def wheels_stopped(self) -> bool:
        """Tell whether the base was last commanded to stand still."""
        return (
            self.requested_left_velocity == 0.0
            and self.requested_right_velocity == 0.0
            and self.requested_velocity == 0.0
        )


def state_from_values(values: Mapping[int, int], user_digital_outputs: int = 0) -> SensorState:
    """Build a state from packet values; packets that are not there leave the field's default.

    Args:
        values: Counts as they came over the wire, by packet number.
        user_digital_outputs: The bits that the host set last.
    """
    fields: dict[str, float] = {}
    for packet_id, value in values.items():
        packet = PACKETS[packet_id]
        if packet.is_flag:
            fields[packet.name] = bool(value)
        else:
            fields[packet.name] = value if packet.scale is None else value * packet.scale
    return SensorState(user_digital_outputs=user_digital_outputs, **fields)  # type: ignore[arg-type]
