"""The base as a component: velocities in; odometry, battery, what holds it and how it does out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Diagnoses
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.core.ports import Fields, Ports
from florence_bt.core.topics import BASE_STOP, DIAGNOSES, ODOMETRY
from florence_bt.drivers.device_line import DeviceLine
from florence_bt.drivers.diagnosis import DIAGNOSTICS_PERIOD_S
from florence_bt.drivers.turtlebot.diagnosis import diagnose
from florence_bt.drivers.turtlebot.driver import BaseReading, TurtlebotDriver
from florence_bt.drivers.turtlebot.hazards import StopReason
from florence_bt.drivers.turtlebot.messages import (
    BATTERY,
    COMMANDS,
    CREATE_2_STATE,
    DOCK,
    IMU,
    JOINTS,
    MANUAL_COMMANDS,
    PLAY_SONG,
    RAW_IMU,
    SET_LEDS,
    SET_MODE,
    SET_OUTPUTS,
    STATE,
    BaseOdometry,
    DigitalOutputs,
    DockRequest,
    JointState,
    LedRequest,
    ModeRequest,
    SongRequest,
    TurnRate,
    battery_state,
)
from florence_bt.drivers.turtlebot.odometry import JOINT_NAMES, WheelJoints
from florence_bt.drivers.turtlebot.override_file import OverrideFile
from florence_bt.drivers.turtlebot.override_switch import BaseWord, OverrideSwitch
from florence_bt.drivers.turtlebot.parameters import TurtlebotNodeParameters
from florence_bt.drivers.turtlebot.report import RateLimiter, StateReport

BASE_SILENT_S = 0.5
"""Seconds without a frame of the base after which it is not said to stand; one comes each 15 ms."""


class BaseDriving:
    """Drives the base by ``cmd_vel`` and tells what it senses.

    While the manual override is on (``florenceLocator/manualOverride``), the base stops and obeys
    ``manual_cmd_vel`` only. This component alone says whether it is on (:class:`OverrideSwitch`): it acts
    where the wheels are, needs no other process, and is kept over restarts.

    Source: document, section 2.3; REFERENCE 2.1.
    """

    def __init__(
        self,
        ports: Ports,
        driver: TurtlebotDriver,
        line: DeviceLine,
        settings: TurtlebotNodeParameters,
        kept: OverrideFile,
    ) -> None:
        """Connect the base.

        Args:
            ports: Its connections.
            driver: Speaks with it.
            line: Carries that.
            settings: Rates, frames and the like.
            kept: Keeps the override over restarts.
        """
        self._ports, self._driver, self._line, self._settings = ports, driver, line, settings
        self._reading: BaseReading | None = None
        self._held: StopReason | None = None
        self._told: BaseStop | None = None
        self._report = StateReport()
        self._joints = WheelJoints(settings.wheel_radius, driver.parameters.wheels().wheel_separation)
        self._odometry_limiter = RateLimiter(settings.update_rate)
        self._state_limiter = RateLimiter(settings.sensor_state_rate)
        self._joint_limiter = RateLimiter(settings.joint_state_rate)
        self._make_outputs()
        self._serve()
        self._diagnosing = call_every(ports.clock, DIAGNOSTICS_PERIOD_S, self._tell_diagnoses)
        self._override = OverrideSwitch(ports, kept, self._give_to_person, self._word)
        driver.manual_override = self._override.on

    def _make_outputs(self) -> None:
        output = self._ports.output
        self._odometry, self._imu, self._raw_imu = output(ODOMETRY), output(IMU), output(RAW_IMU)
        self._state, self._stops, self._joint_states = output(STATE), output(BASE_STOP), output(JOINTS)
        self._battery, self._diagnoses = output(BATTERY), output(DIAGNOSES)
        has_encoders = self._driver.parameters.model.metres_per_tick is not None
        self._create_2_state = output(CREATE_2_STATE) if has_encoders else None

    def _serve(self) -> None:
        self._ports.listen(COMMANDS, lambda twist: self._command(twist, manual=False))
        self._ports.listen(MANUAL_COMMANDS, lambda twist: self._command(twist, manual=True))
        self._ports.serve(SET_OUTPUTS, self._set_outputs)
        self._ports.serve(SET_MODE, self._set_mode)
        self._ports.serve(SET_LEDS, self._set_leds)
        self._ports.serve(PLAY_SONG, self._play_song)
        self._ports.serve(DOCK, self._dock)

    def close(self) -> None:
        """Tell nothing more."""
        self._diagnosing.cancel()
        self._override.close()

    # ---- what the base says ------------------------------------------------------------------------------

    def take(self, readings: Sequence[BaseReading]) -> None:
        """Take what the driver made of what the base sent: what stops it is sent before anything is told."""
        self._line.pump()
        for reading in readings:
            self._line.works()
            self._reading = reading
            self._tell(reading)

    def forget(self) -> None:
        """Forget the newest reading: the base is not connected any more."""
        self._reading = None

    def lost(self, problem: str) -> None:
        """Tell that the base does not answer, and why."""
        self._tell_stop(BaseStop(StopReason.NO_RESPONSE.code, problem))
        self._tell_diagnoses()

    # ---- commands ----------------------------------------------------------------------------------------

    def fail(self) -> None:
        """Stop the base until the next good command."""
        self._driver.command(STANDSTILL, self._ports.clock.now(), manual=self._driver.manual_override)
        self._line.pump()

    def _give_to_person(self, on: bool) -> None:
        """Give the base to a person, or back; the wheels have their zero when this returns."""
        self._driver.set_manual_override(on, self._ports.clock.now())
        self._line.pump()

    def _word(self) -> BaseWord:
        now, reading = self._ports.clock.now(), self._reading
        problem = self._line.problem
        if reading is None or now - reading.stamp > BASE_SILENT_S:
            problem = problem or "the base says nothing"
        elif reading.stop_reason is StopReason.NO_RESPONSE:
            problem = reading.stop_text
        standing = reading is not None and reading.at_rest and not problem
        return BaseWord(standing, self._driver.driven_by_hand(now), problem)

    def _command(self, twist: Twist2, *, manual: bool) -> None:
        refused = self._driver.refused_commands
        self._driver.command(twist, self._ports.clock.now(), manual=manual)
        if self._driver.refused_commands > refused:
            self._ports.warn("a velocity command is not finite: the base stops", COMMANDS)
        self._line.pump()

    def _set_outputs(self, request: DigitalOutputs) -> Fields:
        return {"done": not self._refusal(lambda: self._driver.set_digital_outputs(request.bits))}

    def _set_mode(self, request: ModeRequest) -> Fields:
        now = self._ports.clock.now()
        refusal = self._refusal(lambda: self._driver.set_mode(request.mode, now), when_connected=False)
        return {"valid_mode": not refusal}

    def _set_leds(self, request: LedRequest) -> Fields:
        colour, intensity = request.power_colour, request.power_intensity
        return self._answer(lambda: self._driver.set_leds(request.leds, colour, intensity))

    def _play_song(self, request: SongRequest) -> Fields:
        return self._answer(lambda: self._driver.play_song(request.notes, request.durations))

    def _dock(self, request: DockRequest) -> Fields:
        now = self._ports.clock.now()
        return self._answer(lambda: self._driver.dock(now) if request.data else self._driver.end_docking(now))

    def _answer(self, act: Callable[[], None]) -> Fields:
        refusal = self._refusal(act)
        return {"success": not refusal, "message": refusal}

    def _refusal(self, act: Callable[[], None], *, when_connected: bool = True) -> str:
        """Act on the base; why it was refused, empty when it was not. A refusal is also logged."""
        try:
            if when_connected and self._line.device is None:
                raise ConfigError("the base is not connected")
            act()
        except ConfigError as error:
            self._ports.tell(str(error), good=False)
            return str(error)
        self._line.pump()
        return ""

    # ---- what is told ------------------------------------------------------------------------------------

    def _tell(self, reading: BaseReading) -> None:
        self._report.add(reading.state)
        self._joints.add(reading.state)
        news = reading.stop_reason is not self._held
        if news:
            self._held = reading.stop_reason
            if self._held is not None:
                self._ports.tell(reading.stop_text, good=False)
        code = "" if reading.stop_reason is None else reading.stop_reason.code
        self._tell_stop(BaseStop(code, reading.stop_text))
        if self._odometry_limiter.is_due(reading.stamp):
            self._tell_motion(reading)
        if self._joint_limiter.is_due(reading.stamp):
            self._tell_joints(reading)
        if self._state_limiter.is_due(reading.stamp) or news:
            self._tell_state(reading)
        if news:
            self._tell_diagnoses()

    def _tell_state(self, reading: BaseReading) -> None:
        state = self._report.take(reading.state)
        if self._state.listeners:
            self._state.send(replace(state, stamp=reading.stamp))
        if self._create_2_state is not None:
            self._create_2_state.send(replace(state, stamp=reading.stamp))

    def _tell_stop(self, stop: BaseStop) -> None:
        """Say what holds the base, once for each change."""
        if stop != self._told:
            self._told = stop
            self._stops.send(stop)

    def _tell_motion(self, reading: BaseReading) -> None:
        odometry, settings = reading.odometry, self._settings
        self._odometry.send(BaseOdometry(reading.stamp, odometry.pose, odometry.twist, reading.at_rest))
        if settings.publish_tf:
            self._ports.send_frame(settings.odom_frame, settings.base_frame, reading.stamp, odometry.pose)
        gyro = reading.gyro
        if gyro is None:
            return
        if self._imu.listeners:
            self._imu.send(TurnRate(reading.stamp, gyro.rate, gyro.yaw))
        if self._raw_imu.listeners:
            legacy = gyro.legacy_raw_rate, gyro.legacy_raw_yaw
            raw = legacy if settings.legacy_imu_raw else (gyro.raw_rate, gyro.raw_yaw)
            self._raw_imu.send(TurnRate(reading.stamp, *raw))

    def _tell_joints(self, reading: BaseReading) -> None:
        twist = reading.odometry.twist
        velocities = self._joints.velocities(twist.linear, twist.angular)
        self._joint_states.send(
            JointState(reading.stamp, JOINT_NAMES, tuple(self._joints.positions), velocities)
        )

    def _tell_diagnoses(self) -> None:
        found = diagnose(self._driver, self._reading, self._settings.port, self._line.problem)
        self._diagnoses.send(Diagnoses(found, self._driver.parameters.model.name))
        if self._reading is not None:
            self._battery.send(battery_state(self._reading))
