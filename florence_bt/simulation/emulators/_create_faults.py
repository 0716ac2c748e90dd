"""What can go wrong with an emulated base, and what people and rooms do to it."""

from __future__ import annotations

from dataclasses import dataclass

NO_INFRARED = 255


@dataclass(slots=True)
class CreateFaults:
    """What goes wrong and what happens to the robot; set any of it at any time.

    Attributes:
        silent: Nothing arrives at the host, what is sent meanwhile is lost; commands are still obeyed.
        deaf: Commands are lost on the line; what the base sends still arrives.
        noise: Bytes put before what is sent next, once.
        bad_checksums: How many of the next frames get a wrong checksum.
        partial_frames: How many of the next frames and answers lose their second half.
        wheel_drops: Bits as in packet 7: 4 right, 8 left, 16 caster.
        left_bumper: Pressed, whatever the plant says.
        right_bumper: Pressed, whatever the plant says.
        cliffs: Left, front left, front right, right.
        wall: A wall to the right.
        virtual_wall: The beam of a virtual wall.
        charger: The charger is plugged in and powered.
        dock: The base stands on its home base.
        charging_fault: The contacts are dirty: it cannot charge.
        infrared: The code that is received (packet 17, of a Create 2 also 52 and 53); 255 is nothing.
        buttons: Bits of packet 18.
        overcurrents: Bits of packet 14.
        digital_inputs: Bits 0 to 3 of packet 32.
        gyro_drift: Counts per second that the gyro's rest offset moves from now on.
        gyro_dead: The gyro has no power.
        light_bumps: Create 2: the six signals from left to right, 0 to 4095.
        oi_mode_offset: What packet 35 tells too much, as some Create 2 firmware does.
    """

    silent: bool = False
    deaf: bool = False
    noise: bytes = b""
    bad_checksums: int = 0
    partial_frames: int = 0
    wheel_drops: int = 0
    left_bumper: bool = False
    right_bumper: bool = False
    cliffs: tuple[bool, bool, bool, bool] = (False, False, False, False)
    wall: bool = False
    virtual_wall: bool = False
    charger: bool = False
    dock: bool = False
    charging_fault: bool = False
    infrared: int = NO_INFRARED
    buttons: int = 0
    overcurrents: int = 0
    digital_inputs: int = 0
    gyro_drift: float = 0.0
    gyro_dead: bool = False
    light_bumps: tuple[int, int, int, int, int, int] = (0, 0, 0, 0, 0, 0)
    oi_mode_offset: int = 0
