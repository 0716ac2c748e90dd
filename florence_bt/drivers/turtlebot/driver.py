"""The base as a state machine: bytes and the time in, bytes and readings out. No port, thread or clock.

The owner calls :meth:`TurtlebotDriver.start` when the port is open, hands over what the base sends, and asks
:meth:`TurtlebotDriver.poll` for what to send after every call and at :meth:`TurtlebotDriver.next_deadline`.

A base has no watchdog of its own: it keeps its last speed for ever. So the wanted speed is sent again and
again while the driver lives, and becomes zero when velocity commands stop coming.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from florence_bt.core.errors import ConfigError, DeviceTimeout, FrameError
from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.core.sensing import Odometry
from florence_bt.drivers.diagnosis import LineQuality
from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.drivers.turtlebot.codec.packets import HOME_BASE, WHEEL_DROPS, OiMode, implausible
from florence_bt.drivers.turtlebot.codec.state import SensorState, state_from_values
from florence_bt.drivers.turtlebot.codec.stream_decoder import StreamDecoder
from florence_bt.drivers.turtlebot.drive_control import DriveControl
from florence_bt.drivers.turtlebot.fractions import FractionWatch
from florence_bt.drivers.turtlebot.gyro import Gyro, GyroReading, GyroWatch
from florence_bt.drivers.turtlebot.hazards import (
    ChargeWatch,
    OvercurrentWatch,
    StopReason,
    contact,
    describe,
    lost_mode,
)
from florence_bt.drivers.turtlebot.odometry import EncoderTravel, MotionEstimator
from florence_bt.drivers.turtlebot.parameters import OPERATION_MODES, TurtlebotParameters
from florence_bt.drivers.turtlebot.sequences import (
    ENTER_MODE,
    FILL_PARTIAL_COMMAND,
    MODE_WAIT_S,
    WAKE_UP,
    CommandSequence,
    SequenceStep,
    enter_mode,
    reset,
    stand,
    streamed_packets,
)
from florence_bt.drivers.turtlebot.tune import play_notes, play_tune
from florence_bt.drivers.turtlebot.wheels import WheelSpeeds

STREAM_PERIOD_S = 0.015
"""Between two frames. Source: REFERENCE 1.1."""
RECOVERY_PERIOD_S = 2.0
"""Between two attempts to bring a base back into its mode. Chosen: more than the waits of one."""
OI_MODE, STREAM_PACKETS = 35, 38
LEFT_ENCODER, RIGHT_ENCODER = 43, 44
"""Numbers of packets. Source: REFERENCE 1.5."""


@dataclass(frozen=True, slots=True)
class BaseReading:
    """The reading of one frame of the base.

    Attributes:
        stamp: When it arrived, in seconds.
        state: All sensors.
        odometry: Dead-reckoned pose and velocity.
        gyro: Rate and heading; None without a gyro or before its rest offset is known.
        at_rest: The wheels are commanded to stand still and do.
        stop_reason: Why the base is held, or None.
    """

    stamp: float
    state: SensorState
    odometry: Odometry
    gyro: GyroReading | None
    at_rest: bool
    stop_reason: StopReason | None

    @property
    def stop_text(self) -> str:
        """The stop reason as a sentence that names the sensor; empty without one."""
        return "" if self.stop_reason is None else describe(self.stop_reason, self.state)


WAITED_S = 0.1
"""Seconds for which a driver that was held up takes no command to move. Chosen: what waited for it is served
at once, and who still drives sends the next command within 50 ms."""


class _HoldUps:
    """Tells whether what has just come may have waited while this process was held up.

    Commands have no time stamp: one that was sent seconds ago would be driven as one of now.
    """

    def __init__(self, held_up_after_s: float) -> None:
        self._held_up_after_s = held_up_after_s
        self._at: float | None = None
        self._waited_until = -math.inf

    def note(self, now: float) -> None:
        """Note that the process does something."""
        if self._at is not None and now - self._at > self._held_up_after_s:
            self._waited_until = now + WAITED_S
        self._at = now

    def may_have_waited(self, now: float) -> bool:
        """Tell whether what comes now may have waited: the process was held up just before."""
        return 0.0 <= self._waited_until - now <= WAITED_S


LET_GO_S = 1.0
"""A hand that has said nothing for so long has let go, seconds. Chosen: a few lost commands are no end."""


class _Hand:
    """Driving by hand, as the driver knows it: a stop takes the base out of the hand until it begins anew."""

    def __init__(self) -> None:
        self._held = False
        self._told_at = -math.inf

    def hold(self) -> None:
        """Take the base away: somebody has stopped it."""
        self._held = True

    def drives_on(self, now: float) -> None:
        """Note a command that does not count: that this process was held up is no silence of the hand."""
        self._told_at = now

    def may_drive(self, twist: Twist2, now: float) -> bool:
        """Take a command of the hand, and tell whether it counts."""
        silent = now - self._told_at > LET_GO_S
        self._told_at = now
        if silent or twist == STANDSTILL:
            self._held = False
        return not self._held


class TurtlebotDriver:
    """Drives one iRobot Create over its Open Interface.

    Attributes:
        parameters: Its parameters.
        wanted_mode: The mode that was asked for last.
        decoder: The decoder of the stream, for its counters; a new one after each :meth:`start`.
        late_commands: Commands to move so far that may have waited while this process was held up; they did
            not count.
        refused_readings: Frames so far whose motion was impossible and was left out.
        refused_at: When the last of them came, in seconds.
        line: How much of what came lately was damaged, in bytes.
        implausible: The counts of the newest frame that the manual does not know, by the field's name.
        fractions: Whether the base drops fractions of what it counts, and what to make of that.
        charge_resets: How often a base that did not charge was reset so far.
        manual_override: Whether a person drives: only manual commands count (:meth:`set_manual_override`).
    """

    def __init__(self, parameters: TurtlebotParameters | None = None) -> None:
        self.manual_override = False
        self._hand = _Hand()
        self.parameters = parameters or TurtlebotParameters()
        model = self.parameters.model
        self.wanted_mode = OiMode(self.parameters.operation_mode)
        self._packets = streamed_packets(model, self.parameters.drive_mode)
        self._stream_request = commands.stream(self._packets, model)
        self.decoder = StreamDecoder(self._packets)
        self._hold_ups = _HoldUps(self.parameters.cmd_vel_timeout)
        self.late_commands = 0
        self.refused_readings = 0
        self.refused_at = -math.inf
        self.line = LineQuality()
        self.implausible: Mapping[str, int] = {}
        self.charge_resets = 0
        self._outputs = self.parameters.digital_outputs
        self._outputs_on = 0
        self._motion = MotionEstimator(
            self.parameters.odometry(), self.parameters.gyro(), has_gyro=self.parameters.gyro_fitted
        )
        wheels = self.parameters.wheels()
        self._encoders = (
            None
            if model.metres_per_tick is None
            else EncoderTravel(model.metres_per_tick, wheels.wheel_separation)
        )
        self._drive = DriveControl(wheels, self.parameters.cmd_vel_timeout, self.parameters.drive_mode)
        self.fractions = FractionWatch()
        self._gyro_rate: float | None = None
        self._charge_watch = ChargeWatch()
        self._gyro_watch = GyroWatch(self.parameters.max_gyro_disagreement)
        self._gyro_lost = False
        self._overcurrent = OvercurrentWatch()
        self._sequence = CommandSequence()
        self._open = False
        self._pending = b""
        self._first_frame_dropped = False
        self._last_stamp = -math.inf
        self._last_frame: float | None = None
        self._noise_before = 0
        self._refused_in_a_row = 0
        self._state: SensorState | None = None
        self._stop_reason: StopReason | None = None
        self._touched: StopReason | None = None
        self._mode_lost = self._docking = False
        self._recover_at = math.inf

    @property
    def refused_commands(self) -> int:
        """Velocity commands with NaN or infinity so far; each stopped the base."""
        return self._drive.refused

    @property
    def starting(self) -> bool:
        """Tell whether a start-up or change of mode is under way."""
        return self._sequence.busy

    @property
    def wheels(self) -> WheelSpeeds:
        """The speeds that the base was sent last."""
        return self._drive.wheels

    @property
    def digital_outputs(self) -> int:
        """The bits of the outputs that are on."""
        return self._outputs_on

    @property
    def gyro(self) -> Gyro | None:
        """The gyro, None when the base has none."""
        return self._motion.gyro

    @property
    def rts(self) -> bool | None:
        """The level that the line RTS shall have; None for as it is. Look after each :meth:`poll`."""
        return self._sequence.rts

    def start(self, now: float, *, wake: bool = False) -> None:
        """Begin the start-up sequence on a port that was just opened; the pose goes on where it was.

        Args:
            now: Seconds.
            wake: Wake the base by pulses on RTS first.
        """
        self.decoder = StreamDecoder(self._packets)
        self._noise_before = self._refused_in_a_row = 0
        self.line = LineQuality()
        self._open = True
        self._pending = b""
        self._last_stamp = -math.inf
        self._state = None
        before = (*(WAKE_UP if wake else ()), SequenceStep(FILL_PARTIAL_COMMAND))
        self._enter_mode(now, before=before, tune=self.parameters.bonus)

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
            ConfigError: There are no such outputs, or the base is not in a mode that switches them.
        """
        if not self.parameters.model.cargo_bay:
            raise ConfigError(f"{self.parameters.model.name} has no digital outputs")
        self._need_drive_mode("the digital outputs")
        self._pending += commands.digital_outputs(bits)
        self._outputs = self._outputs_on = bits

    def set_leds(self, bits: int, power_colour: int, power_intensity: int) -> None:
        """Set the lights, see :func:`commands.leds`.

        Raises:
            ConfigError: A number is out of range, or the base is not in a mode that sets them.
        """
        self._need_drive_mode("the lights")
        self._pending += commands.leds(bits, power_colour=power_colour, power_intensity=power_intensity)

    def play_song(self, notes: Sequence[int], durations_s: Sequence[float]) -> None:
        """Store a song and play it.

        Args:
            notes: 1 to 16 MIDI numbers, 31 to 127; anything else is a rest.
            durations_s: Seconds, one for each note, 0 to 3.98.

        Raises:
            ConfigError: The song cannot be played, or the base is not in a mode that plays it.
        """
        self._need_drive_mode("songs")
        self._pending += play_notes(notes, durations_s, self.parameters.model)

    def dock(self, now: float) -> None:
        """Let the firmware look for the home base and drive onto it; any velocity command ends that.

        Raises:
            ConfigError: The base cannot do that now.
        """
        self._need_drive_mode("docking")
        if self.manual_override:
            raise ConfigError("the base does not dock: the manual override is on; release it first")
        if self._stop_reason is not None and self._stop_reason is not StopReason.BATTERY:
            raise ConfigError(f"the base cannot dock now: {self._why_lost()}")
        if self._drive.wants_motion(now):
            raise ConfigError("the base is being driven: stop it first, then let it dock")
        self._drive.stop()
        self._docking = True
        self._pending += commands.cover_and_dock()

    def end_docking(self, now: float) -> None:
        """Stop a base that docks, and return to its mode; of no effect on any other."""
        if not self._docking:
            return
        self._docking = False
        self._pending = b""
        self._sequence.begin(
            [SequenceStep(stand(self.wanted_mode), MODE_WAIT_S), SequenceStep(self._output_bytes())], now
        )

    def set_manual_override(self, on: bool, now: float) -> None:
        """Give the base to a person, or back. It stops at once, without a ramp, and forgets its command.

        A hand that drives has to let go first, with a zero or a second of silence: a stop counts for it, too.
        """
        self.manual_override = on
        self._hand.hold()
        self.end_docking(now)
        self._drive.stop()

    def command(self, twist: Twist2, now: float, *, manual: bool = False) -> None:
        """Take a velocity command; it holds until the next one or the time-out. NaN and infinity stop.

        Just after this process was held up, because a signal stopped it or the machine had no time for it,
        only a stop counts: a command to move may have waited for as long.

        Args:
            twist: The wanted velocity.
            now: Seconds.
            manual: Whether a person sends it by hand. Such a command counts only while the manual override is
                on, and nothing else counts then.
        """
        self._hold_ups.note(now)
        if twist != STANDSTILL and self._hold_ups.may_have_waited(now):
            self.late_commands += 1
            if manual:
                self._hand.drives_on(now)
            return
        counts = not manual or self._hand.may_drive(twist, now)
        if counts and manual is self.manual_override:
            self.end_docking(now)
            self._drive.command(twist, now)

    def driven_by_hand(self, now: float) -> bool:
        """Tell whether a command by hand moves the base."""
        return self.manual_override and self._drive.wants_motion(now)

    def receive(self, data: bytes, now: float) -> list[BaseReading]:
        """Take bytes from the base.

        Args:
            data: As they came, in pieces of any size.
            now: When they came, in seconds.

        Returns:
            One reading per good frame, oldest first. The very first frame is left out: its distance and
            angle were added up before this driver existed (REFERENCE 2.4, row "First packet").
        """
        self._hold_ups.note(now)
        noise_before = self.decoder.noise_bytes
        frames = self.decoder.feed(data)
        self.line.note(now, len(frames) * self.decoder.frame_size, self.decoder.noise_bytes - noise_before)
        if frames:
            self._noise_before = self.decoder.noise_bytes
            if not self._refused_in_a_row:  # a base that never says where it is has not said anything
                self._last_frame = now
        readings = []
        for later_frames, frame in zip(reversed(range(len(frames))), frames, strict=True):
            # Frames that came together were measured one period apart.
            stamp = max(self._last_stamp, now - later_frames * STREAM_PERIOD_S)
            reading = self._read(self._measure(frame, stamp), stamp)
            self._last_stamp = stamp
            if reading is not None:
                readings.append(reading)
        return readings

    def measured(self, state: SensorState, now: float) -> BaseReading | None:
        """Take what the base has measured as values, in place of the bytes of a frame.

        Args:
            state: All sensors; distance and angle are those since the last call.
            now: When they came, in seconds.

        Returns:
            The reading; None for the very first, as of :meth:`receive`, and for one that cannot be.
        """
        self._hold_ups.note(now)
        self._last_frame = self._last_stamp = now
        return self._read(self._with_fractions(state, now) if self._encoders is None else state, now)

    def poll(self, now: float) -> bytes:
        """Return what to send to the base now, often nothing.

        Raises:
            DeviceTimeout: The base has been silent for too long; open the port again, and start again.
        """
        self._hold_ups.note(now)
        if not self._open:
            return b""
        out = self._sequence.take(now)
        if self._sequence.busy:
            return out
        self._check_silence(now)
        if now >= self._recover_at and self._drive.wants_motion(now):
            self._recover_at = now + RECOVERY_PERIOD_S
            self._sequence.begin(
                [SequenceStep(ENTER_MODE[self.wanted_mode], MODE_WAIT_S), SequenceStep(self._output_bytes())],
                now,
            )
            return out + self._sequence.take(now)
        out, self._pending = out + self._pending, b""
        enabled = self._state is not None and self._state.in_drive_mode
        return out + self._drive.take(now, self._stop_reason, enabled=enabled)

    def next_deadline(self) -> float | None:
        """Return when :meth:`poll` has something to do at the latest; None when the driver is not started."""
        if not self._open:
            return None
        if self._sequence.due is not None:
            return self._sequence.due
        silence = math.inf if self._last_frame is None else self._last_frame + self.parameters.data_timeout
        return min(self._drive.due, silence)

    def shutdown(self) -> bytes:
        """End the work.

        Returns:
            The bytes that stop the base and silence it; send them before the port is closed.
        """
        self._open = False
        self._drive.stop()
        # A base that charges stays in Passive mode, in which alone it does.
        docking, self._docking = self._docking, False
        stop = stand(self.wanted_mode) if docking else commands.drive_direct(0, 0)
        return stop + commands.pause_stream()

    def _need_drive_mode(self, what: str) -> None:
        if self.wanted_mode < OiMode.SAFE:
            raise ConfigError(f"a drive mode is needed for {what}", valid=("mode 2 or 3 first",))
        if self._mode_lost:
            raise ConfigError(f"the base is not in its drive mode now: {self._why_lost()}")

    def _why_lost(self) -> str:
        return (self._stop_reason or StopReason.MODE_LOST).value

    def _enter_mode(self, now: float, before: Sequence[SequenceStep] = (), *, tune: bool = False) -> None:
        """Go through Passive, which stops the motors, to the wanted mode; then ask for the stream."""
        self._settle()
        outputs_on = self._state is not None and self._state.in_drive_mode
        then = self._output_bytes() + self._stream_request
        if tune and self.wanted_mode in ENTER_MODE:
            then += play_tune(self.parameters.model)
        self._sequence.begin([*before, *enter_mode(self.wanted_mode, then, outputs_on=outputs_on)], now)

    def _reset(self, now: float) -> None:
        """Reboot a base that does not charge; it stays in Passive mode until somebody wants to drive."""
        outputs_on = self._state is not None and self._state.in_drive_mode
        self._settle()
        self._outputs_on = 0
        self.charge_resets += 1
        self._sequence.begin(reset(self._stream_request, outputs_on=outputs_on), now)

    def _settle(self) -> None:
        """Forget the command and what held it: the base is about to stop."""
        self._drive.stop()
        self._drive.acknowledgement.clear()
        self._last_frame = None
        self._mode_lost = self._docking = False
        self._stop_reason = None
        self._recover_at = math.inf

    def _output_bytes(self) -> bytes:
        """Switch the outputs as they were asked for: not in Passive mode, and a Create 2 has none."""
        drives = self.wanted_mode in ENTER_MODE and self.parameters.model.cargo_bay
        self._outputs_on = self._outputs if drives else 0
        return commands.digital_outputs(self._outputs) if drives else b""

    def _check_silence(self, now: float) -> None:
        if self._last_frame is None or now < self._last_frame:
            self._last_frame = now
        if now - self._last_frame > self.parameters.data_timeout:
            raise DeviceTimeout(
                f"the base sent no good frame for {self.parameters.data_timeout:g} s, "
                f"{self._received_instead()}"
            )

    def _received_instead(self) -> str:
        """Say what came instead of good frames, and what to do about it."""
        if self._refused_in_a_row:
            return "only ways that no base can go: is the robot_type right, and do the wheels' sensors work?"
        if self.decoder.noise_bytes > self._noise_before:
            return "only bytes that make no frame: are the port and its baud rate right?"
        if self.decoder.good_frames:
            return "and nothing else: is it still switched on, and its cable in place?"
        return "and nothing else: is it switched on, and is it the right port?"

    def _read(self, state: SensorState, stamp: float) -> BaseReading | None:
        self._state = state
        self._drive.acknowledgement.look(state, stamp)
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
            self._refused_in_a_row += 1
            self.refused_at = stamp
            return None
        self._refused_in_a_row = 0
        self._gyro_rate = None if motion.gyro is None else motion.gyro.rate
        self._watch_gyro(stamp, motion.gyro, state)
        return BaseReading(stamp, state, motion.odometry, motion.gyro, motion.at_rest, self._stop_reason)

    def _watch_gyro(self, stamp: float, gyro: GyroReading | None, state: SensorState) -> None:
        """Stop for a gyro whose offset moved away while driving, and go on when it is learnt again."""
        carried = state.bumps_wheeldrops & WHEEL_DROPS
        if self._gyro_lost and self.gyro is not None and self.gyro.calibrated:
            self._gyro_lost = False
        if gyro is None or gyro.resting or carried:
            self._gyro_watch.clear()
        elif self.gyro is not None and self._gyro_watch.disagrees(stamp, gyro.rate, state.angle):
            self._gyro_lost = True
            self.gyro.recalibrate()
            self._drive.stop()
            self._touched = self._stop_reason = StopReason.GYRO

    def _lost_mode(self, state: SensorState) -> StopReason | None:
        lost = lost_mode(state, self.wanted_mode)
        if state.charging_sources_available & HOME_BASE:
            self._docking = False  # it has arrived
        return StopReason.DOCKING if self._docking and lost is StopReason.MODE_LOST else lost

    def _objection(self, state: SensorState, stamp: float) -> StopReason | None:
        overcurrent = self._overcurrent.look(state, stamp)
        touched = contact(
            state,
            use_bumpers=self.parameters.stop_motors_on_bump,
            use_cliffs=self.parameters.stop_on_cliff,
            lowest_charge=self.parameters.lowest_charge,
        )
        if self.parameters.check_acknowledgement and self._drive.acknowledgement.unresponsive:
            return StopReason.NO_RESPONSE
        if overcurrent:
            return StopReason.OVERCURRENT
        return touched or (StopReason.GYRO if self._gyro_lost else None)

    def _measure(self, values: dict[int, int], stamp: float) -> SensorState:
        values.setdefault(STREAM_PACKETS, len(self._packets))
        values[OI_MODE] -= self.parameters.oi_mode_offset if values[OI_MODE] else 0
        self.implausible = implausible(values)
        state = state_from_values(values, self._outputs_on)
        if self._encoders is None:
            return self._with_fractions(state, stamp)
        distance, angle = self._encoders.update(values[LEFT_ENCODER], values[RIGHT_ENCODER])
        return replace(state, distance=distance, angle=angle)

    def _with_fractions(self, state: SensorState, stamp: float) -> SensorState:
        """Return the state with the distance and angle of a base that drops fractions of what it counts."""
        sent = self._drive.speed
        speed = 1000.0 * sent.linear, math.degrees(sent.angular)
        count = round(1000.0 * state.distance), round(math.degrees(state.angle))
        obeys = state.in_drive_mode and not self._docking and self._stop_reason is None
        if obeys and not state.bumps_wheeldrops & WHEEL_DROPS:
            gyro = None if self._gyro_rate is None else math.degrees(self._gyro_rate)
            self.fractions.look(*count, speed, gyro)
        else:
            self.fractions.clear()
        distance_mm, angle_deg = self.fractions.corrected(stamp, *count, speed if obeys else (0.0, 0.0))
        if (distance_mm, angle_deg) == count:
            return state
        return replace(state, distance=distance_mm / 1000.0, angle=math.radians(angle_deg))

    def _judge(self, state: SensorState, stamp: float) -> None:
        """Find out what holds the base, and when it may return to its mode."""
        lost = None if self._sequence.busy else self._lost_mode(state)
        touched = self._objection(state, stamp)
        # What begins stops the base, whatever it does; a new command may then lead away from it.
        if (lost is not None and not self._mode_lost) or (
            touched is not None and touched is not self._touched
        ):
            self._drive.stop()
        self._mode_lost = lost is not None
        self._touched = touched
        self._stop_reason = lost or touched
        if lost is not StopReason.MODE_LOST:
            self._recover_at = math.inf
        elif self._recover_at > stamp + self.parameters.recovery_delay + RECOVERY_PERIOD_S:
            self._recover_at = stamp + self.parameters.recovery_delay
        if self.parameters.charge_reset and not self._sequence.busy:
            standing = state.wheels_stopped and not self._drive.wants_motion(stamp)
            if self._charge_watch.is_due(state, stamp, standing=standing):
                self._reset(stamp)
