"""The base as a state machine: bytes and the time in, bytes and readings out. No port, thread or clock.

The owner calls :meth:`TurtlebotDriver.start` when the port is open, hands over what the base sends, and asks
:meth:`TurtlebotDriver.poll` for what to send after every call and at :meth:`TurtlebotDriver.next_deadline`.

A base has no watchdog of its own: it keeps its last speed for ever. So the wanted speed is sent again and
again while the driver lives, and becomes zero when velocity commands stop coming.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError, DeviceTimeout, FrameError
from florence_bt.core.geometry import Twist2
from florence_bt.core.sensing import Odometry
from florence_bt.drivers.turtlebot import codec
from florence_bt.drivers.turtlebot._script import Script
from florence_bt.drivers.turtlebot.codec.packets import WHEEL_DROPS, OiMode, SensorState, state_from_values
from florence_bt.drivers.turtlebot.drive_control import DriveControl
from florence_bt.drivers.turtlebot.gyro import GyroReading
from florence_bt.drivers.turtlebot.hazards import StopReason, contact, lost_mode
from florence_bt.drivers.turtlebot.odometry import MotionEstimator
from florence_bt.drivers.turtlebot.parameters import OPERATION_MODES, TurtlebotParameters

STREAM_PERIOD_S = 0.015
STREAMED_PACKETS = (*range(7, 15), *range(17, 36), 41, 42)
"""All packets but the unused ones (15, 16), the songs and stream count (36 to 38) and those of the Drive
command that we never send (39, 40): 75 bytes a frame, where 86 is the limit and all 36 would be 91."""

MODE_WAIT_S = 0.5
"""After 128, 131 and 132 (REFERENCE 1.1, start-up sequence)."""

RECOVERY_PERIOD_S = 2.0
_ENTER_MODE = {OiMode.SAFE: codec.safe(), OiMode.FULL: codec.full()}


@dataclass(frozen=True, slots=True)
class Reading:
    """What one frame of the base says.

    Attributes:
        stamp: When it arrived, in seconds.
        state: All sensors.
        odometry: Dead-reckoned pose and velocity.
        gyro: Rate and heading; None without a gyro or before its rest offset is known.
        at_rest: The wheels are told to stand still and do.
        stop_reason: Why the base is held, or None.
    """

    stamp: float
    state: SensorState
    odometry: Odometry
    gyro: GyroReading | None
    at_rest: bool
    stop_reason: StopReason | None


class TurtlebotDriver:
    """Drives one iRobot Create over its Open Interface.

    Attributes:
        wanted_mode: The mode that was asked for last.
        decoder: The decoder of the stream, for its counters; a new one after each :meth:`start`.
        refused_readings: Frames so far whose motion was impossible and was left out.
    """

    def __init__(self, parameters: TurtlebotParameters | None = None) -> None:
        self._parameters = parameters or TurtlebotParameters()
        self.wanted_mode = OiMode(self._parameters.operation_mode)
        self.decoder = codec.StreamDecoder(STREAMED_PACKETS)
        self.refused_readings = 0
        self._outputs = self._parameters.digital_outputs
        self._motion = MotionEstimator(
            self._parameters.odometry(), self._parameters.gyro(), has_gyro=self._parameters.has_gyro
        )
        self._drive = DriveControl(self._parameters.wheels(), self._parameters.cmd_vel_timeout)
        self._script = Script()
        self._open = False
        self._pending = b""
        self._first_frame_dropped = False
        self._last_stamp = -math.inf
        self._heard: float | None = None
        self._state: SensorState | None = None
        self._stop_reason: StopReason | None = None
        self._mode_lost = False
        self._recover_at = math.inf

    @property
    def refused_commands(self) -> int:
        """Velocity commands with NaN or infinity so far; each stopped the base."""
        return self._drive.refused

    @property
    def starting(self) -> bool:
        """Whether a start-up or change of mode is under way."""
        return self._script.busy

    def start(self, now: float) -> None:
        """Begin the start-up sequence on a port that was just opened; the pose goes on where it was."""
        self.decoder = codec.StreamDecoder(STREAMED_PACKETS)
        self._open = True
        self._pending = b""
        self._last_stamp = -math.inf
        self._state = None
        self._enter_mode(now)

    def set_mode(self, mode: int, now: float) -> None:
        """Change the operating mode; the base stops.

        Args:
            mode: 1 passive (the digital outputs go off), 2 safe, 3 full.
            now: Seconds.

        Raises:
            ConfigError: There is no such mode to ask for.
        """
        if mode not in OPERATION_MODES:
            raise ConfigError(f"there is no operating mode {mode}", valid=OPERATION_MODES.values())
        self.wanted_mode = OiMode(mode)
        self._enter_mode(now)

    def set_digital_outputs(self, bits: int) -> None:
        """Switch the digital outputs; every later change of mode sets them again.

        Args:
            bits: 0 to 7; bit i is output i.

        Raises:
            ConfigError: There are no such outputs, or the base is in Passive mode, which ignores them.
        """
        if self.wanted_mode < OiMode.SAFE:
            raise ConfigError("the digital outputs need a drive mode", valid=("mode 2 or 3 first",))
        self._pending += codec.digital_outputs(bits)
        self._outputs = bits

    def command(self, twist: Twist2, now: float) -> None:
        """Take a velocity command; it holds until the next one or the time-out. NaN and infinity stop."""
        self._drive.command(twist, now)

    def receive(self, data: bytes, now: float) -> list[Reading]:
        """Take bytes from the base.

        Args:
            data: As they came, in pieces of any size.
            now: When they came, in seconds.

        Returns:
            One reading per good frame, oldest first. The very first frame is left out: its distance and
            angle were added up before this driver existed (REFERENCE 2.4, row "First packet").
        """
        frames = [event for event in self.decoder.feed(data) if isinstance(event, codec.StreamFrame)]
        if frames:
            self._heard = now
        readings = []
        for later_frames, frame in zip(reversed(range(len(frames))), frames, strict=True):
            # Frames that came together were measured one period apart.
            stamp = max(self._last_stamp, now - later_frames * STREAM_PERIOD_S)
            reading = self._read(frame, stamp)
            self._last_stamp = stamp
            if reading is not None:
                readings.append(reading)
        return readings

    def poll(self, now: float) -> bytes:
        """What to send to the base now, often nothing.

        Raises:
            DeviceTimeout: The base has been silent for too long; close the port, open it anew, start again.
        """
        if not self._open:
            return b""
        out = self._script.take(now)
        if self._script.busy:
            return out
        self._check_silence(now)
        if now >= self._recover_at and self._drive.wants_motion(now):
            self._recover_at = now + RECOVERY_PERIOD_S
            self._script.begin(
                [(_ENTER_MODE[self.wanted_mode], MODE_WAIT_S), (self._output_bytes(), 0.0)], now
            )
            return out + self._script.take(now)
        out, self._pending = out + self._pending, b""
        enabled = self._state is not None and self._state.oi_mode >= OiMode.SAFE
        return out + self._drive.take(now, self._stop_reason, enabled=enabled)

    def next_deadline(self) -> float | None:
        """When :meth:`poll` has something to do at the latest; None when the driver is not started."""
        if not self._open:
            return None
        if self._script.due is not None:
            return self._script.due
        silence = math.inf if self._heard is None else self._heard + self._parameters.data_timeout
        return min(self._drive.due, silence)

    def shutdown(self) -> bytes:
        """End the work.

        Returns:
            The bytes that stop the base and silence it; send them before the port is closed.
        """
        self._open = False
        self._drive.stop()
        return codec.drive_direct(0, 0) + codec.pause_stream()

    def _enter_mode(self, now: float) -> None:
        """Go through Passive, which stops the motors, to the wanted mode; then ask for the stream."""
        self._drive.stop()
        self._heard = None
        self._mode_lost = False
        self._stop_reason = None
        self._recover_at = math.inf
        steps = [(codec.passive(), MODE_WAIT_S)]
        if self.wanted_mode in _ENTER_MODE:
            steps.append((_ENTER_MODE[self.wanted_mode], MODE_WAIT_S))
        elif self._state is not None and self._state.oi_mode >= OiMode.SAFE:
            steps.insert(0, (codec.digital_outputs(0), 0.0))
        steps.append((self._output_bytes() + codec.stream(STREAMED_PACKETS), 0.0))
        self._script.begin(steps, now)

    def _output_bytes(self) -> bytes:
        return codec.digital_outputs(self._outputs) if self.wanted_mode in _ENTER_MODE else b""

    def _check_silence(self, now: float) -> None:
        if self._heard is None:
            self._heard = now
        if now - self._heard > self._parameters.data_timeout:
            raise DeviceTimeout(
                f"the base sent no good frame for {now - self._heard:.1f} s "
                f"({self.decoder.bad_frames} bad ones): is it switched on, and is it the right port?"
            )

    def _read(self, frame: codec.StreamFrame, stamp: float) -> Reading | None:
        outputs = self._outputs if self.wanted_mode in _ENTER_MODE else 0
        state = self._state = state_from_values(frame.values, outputs)
        self._judge(state, stamp)
        if not self._first_frame_dropped:
            self._first_frame_dropped = True
            return None
        # A base in somebody's hands is not at rest: the gyro follows, and learns no offset from it.
        stopped = state.wheels_stopped and not state.bumps_wheeldrops & WHEEL_DROPS
        try:
            motion = self._motion.update(
                stamp, state.distance, state.angle, state.user_analog_input, wheels_stopped=stopped
            )
        except FrameError:
            self.refused_readings += 1
            return None
        return Reading(stamp, state, motion.odometry, motion.gyro, motion.at_rest, self._stop_reason)

    def _judge(self, state: SensorState, stamp: float) -> None:
        """Find out what holds the base, and when it may return to its mode."""
        lost = None if self._script.busy else lost_mode(state, self.wanted_mode)
        if lost is not None and not self._mode_lost:
            self._drive.stop()
        self._mode_lost = lost is not None
        self._stop_reason = lost or contact(
            state,
            heed_bumps=self._parameters.stop_motors_on_bump,
            heed_cliffs=self._parameters.stop_on_cliff,
        )
        if lost is not StopReason.MODE_LOST:
            self._recover_at = math.inf
        elif self._recover_at == math.inf:
            self._recover_at = stamp + self._parameters.recovery_delay
