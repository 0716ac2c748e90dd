"""The Hokuyo driver without a port: bytes and the time go in, scans and bytes come out.

What is said to the sensor stands in scripts (``start_up.py``, ``stream.py``, ``self_test.py``). A script that
fails makes the driver rest and start again, so whatever happens on the line, it ends up measuring again once
the sensor answers as it should.

Source: REFERENCE 4.6, 4.7, 4.9.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping, Sequence

from florence_bt.core.errors import DeviceError, FrameError
from florence_bt.core.sensing import LaserScan
from florence_bt.drivers.diagnosis import FrequencyMeter, LineQuality
from florence_bt.drivers.hokuyo.codec import (
    Measurement,
    ReplyParser,
    ScanReply,
    ScipReply,
    decode_scan,
    request,
)
from florence_bt.drivers.hokuyo.conversation import Conversation, Script
from florence_bt.drivers.hokuyo.geometry import (
    SensorGeometry,
    range_errors,
    scan_from_distances,
    summarise,
    with_echoes,
)
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.drivers.hokuyo.retry_policy import RetryPolicy
from florence_bt.drivers.hokuyo.scan_clock import ScanClock
from florence_bt.drivers.hokuyo.self_test import SelfTestResult, self_test
from florence_bt.drivers.hokuyo.start_up import HEALTHY, Sensor, rates_to_try, start_up
from florence_bt.drivers.hokuyo.status import (
    ACCEPTED,
    SCAN_FOLLOWS,
    describe_status,
    goes_on_by_itself,
    is_checking,
)
from florence_bt.drivers.hokuyo.stream import AcceptedStream, begin_stream, plan_measurement

SAME_STAMPS_LIMIT = 2
"""hokuyo_node gives up when more scans than this carry the same time stamp."""

TestsDone = Callable[[Sequence[SelfTestResult]], None]


class DriverPhase(enum.Enum):
    """The phases of the driver."""

    STOPPED = "stopped"
    STARTING = "starting"
    MEASURING = "measuring"
    TESTING = "testing itself"
    RESTING = "resting before it starts again"


class HokuyoDriver:
    """Starts the sensor, keeps it measuring and makes scans of its replies.

    Call :meth:`start` once the port is open, :meth:`receive` with what was read, and :meth:`poll` after each
    of them and at :meth:`next_deadline`; write what ``poll`` returns.

    Attributes:
        phase: What it is about.
        problem: The last failure, empty since the last scan.
        scans: Scans received so far.
        lost: How often a running stream broke.
        retry: Counts the failures in a row, and has the pause after the last of them.
        sensor: The sensor, None before it is known.
        measurement: What it measures, None before that was accepted.
        bit_rate: The speed that the line must have when what :meth:`poll` returns is written; None for any.
        line: How much of what came lately was damaged, in replies.
        no_answer: The last start failed without any answer: the port may be the wrong one, or dead.
    """

    def __init__(
        self,
        parameters: HokuyoParameters,
        on_problem: Callable[[str], None] | None = None,
        bit_rate: int | None = None,
    ) -> None:
        """Prepare; :meth:`start` begins.

        Args:
            parameters: How to measure.
            on_problem: Told each failure, in words.
            bit_rate: The wanted speed of a serial line; None where it has none.
        """
        self._parameters = parameters
        self._wanted_rate = self.bit_rate = bit_rate
        self._on_problem = on_problem
        self._parser = ReplyParser(some=True)
        self._frequency = FrequencyMeter()
        self.line = LineQuality()
        self._corrupted_before = 0
        self._clock = ScanClock()
        self._conversation: Conversation | None = None
        self._then: Callable[[Conversation, float], None] = self._on_started
        self._tests_done: TestsDone | None = None
        self._deadline: float | None = None
        self.retry = RetryPolicy(parameters.restart_delay_s, parameters.check_timeout_s)
        self._last_rate: int | None = None
        self._misses = 0
        self._same_stamps = 0
        self._last_scan: ScanReply | None = None
        self._calibrated: dict[str, float] = {}
        self.phase = DriverPhase.STOPPED
        self.problem = ""
        self.scans = self.lost = 0
        self.sensor: Sensor | None = None
        self.measurement: Measurement | None = None
        self.no_answer = False

    @property
    def corrupted(self) -> int:
        """Replies with wrong checksums or layout so far."""
        return self._parser.corrupted

    @property
    def geometry(self) -> SensorGeometry | None:
        """The sensor's numbers, None before they are known."""
        return None if self.sensor is None else self.sensor.geometry

    @property
    def expected_rate(self) -> float:
        """Scans a second that the sensor should deliver; 0 before its speed is known."""
        return 0.0 if self.sensor is None else 1.0 / self._scan_interval(self.sensor.geometry)

    @property
    def latency(self) -> float:
        """Seconds from the sensor passing step 0 to the scan's arrival, as set or as measured.

        Without both it is the time of the sweep up to the last step, because no scan can arrive earlier.
        """
        if self._parameters.latency_s is not None:
            return self._parameters.latency_s
        if self.sensor is None:
            return 0.0
        geometry, last = self.sensor.geometry, self._parameters.max_ang
        return self._calibrated.get(
            self.sensor.device_id, (geometry.step_at(last) + 1) * geometry.time_increment
        )

    @property
    def calibrated(self) -> bool:
        """Tell whether the latency was measured."""
        return self.sensor is not None and self.sensor.device_id in self._calibrated

    @property
    def late_s(self) -> float:
        """Return how late the last scan arrived, in seconds, by the sensor's own clock."""
        return self._clock.late_s

    def rate(self, now: float) -> float:
        """Return the scans per second that arrived lately."""
        return self._frequency.rate(now)

    @property
    def blind(self) -> bool:
        """Tell whether no beam of the last scan is a distance."""
        scan, sensor = self._last_scan, self.sensor
        return scan is not None and sensor is not None and sensor.geometry.is_blind(scan.distances_mm)

    def beams_without_range(self) -> str:
        """Return how many beams of the last scan are no distances, and why; empty before the first scan."""
        if self._last_scan is None or self.sensor is None:
            return ""
        return summarise(self._last_scan.distances_mm, self.sensor.geometry, self._errors(self.sensor))

    def start(self, now: float) -> None:
        """Begin the start-up, also after the port was lost."""
        self._halt()
        self._parser.clear()
        self._clock.reset()
        self._same_stamps, self._last_scan = 0, None
        self.no_answer = False
        rates = rates_to_try(self._wanted_rate, self._last_rate, self._misses)
        self._converse(DriverPhase.STARTING, start_up(self._wanted_rate, rates), self._on_started, now)

    def shutdown(self) -> bytes:
        """Stop, and return the bytes that switch the laser off."""
        self._halt()
        return request("QT")

    def disconnected(self, reason: str) -> None:
        """Forget everything under way until :meth:`start`: the port is gone."""
        if self.phase is DriverPhase.MEASURING:
            self.lost += 1
        self.problem = reason
        self.retry.reset_failures()  # whoever opens the port again makes pauses of his own
        self._halt()

    def begin_with(self, sensor: Sensor) -> None:
        """Measure with a sensor that was started and measures already, as in the rig."""
        self.sensor = sensor
        self.measurement, warnings = plan_measurement(self._parameters, sensor)
        self._warn(warnings)
        self.phase = DriverPhase.MEASURING
        self.retry.begin()

    def begin_self_test(self, on_done: TestsDone, now: float) -> None:
        """Leave the stream, run the tests, report what they found, and measure again.

        Args:
            on_done: Called with the results once; with none when the port was lost meanwhile.
            now: The time.

        Raises:
            DeviceError: The sensor does not measure now.
        """
        if self.phase is not DriverPhase.MEASURING or self.sensor is None:
            raise DeviceError(f"the tests need a sensor that measures; the driver is {self.phase.value}")
        self._tests_done = on_done
        script = self_test(self.sensor.geometry, self._parameters.self_test_scans)
        self._converse(DriverPhase.TESTING, script, self._on_tested, now)

    def next_deadline(self) -> float | None:
        """Return when :meth:`poll` must be called at the latest, or None."""
        return self._deadline if self._conversation is None else self._conversation.deadline

    def poll(self, now: float) -> bytes:
        """Do what is due and return the bytes to send."""
        if self._conversation is not None:
            self._conversation.poll(now)
            self._settle(now)
        elif self._deadline is not None and now >= self._deadline:
            self._overdue(now)
        return b"" if self._conversation is None else self._conversation.take_bytes()

    def receive(self, data: bytes, now: float) -> list[LaserScan]:
        """Take bytes that arrived at ``now`` and return the scans that they complete."""
        scans = []
        corrupted = self.corrupted
        replies = self._parser.feed(data)
        for reply in replies:
            if self._conversation is not None:
                self._conversation.receive(reply, now)
                self._settle(now)
            elif self.phase is DriverPhase.MEASURING and (scan := self._take_scan(reply, now)) is not None:
                scans.append(scan)
        self.line.note(now, len(replies), self.corrupted - corrupted)
        return scans

    # --- conversations ----------------------------------------------------------------------------------

    def _converse(
        self, phase: DriverPhase, script: Script, then: Callable[[Conversation, float], None], now: float
    ) -> None:
        self.phase = phase
        self._deadline = None
        self._then = then
        self._conversation = Conversation(script, self._parameters.reply_timeout_s, now)
        self._settle(now)

    def _settle(self, now: float) -> None:
        conversation = self._conversation
        if conversation is None:
            return
        self.bit_rate = conversation.bit_rate or self.bit_rate
        if not conversation.done:
            return
        self._conversation = None
        self.no_answer = conversation.error is not None and not conversation.answered
        self._misses = self._misses + 1 if self.no_answer else 0
        if conversation.error is not None:
            self._fail(now, str(conversation.error))
        else:
            self._then(conversation, now)

    def _on_started(self, conversation: Conversation, now: float) -> None:
        sensor: Sensor = conversation.result
        self.sensor = sensor
        self._last_rate = self.bit_rate
        if sensor.ill:
            self._fail(now, f"the sensor reports {sensor.stat!r} instead of {HEALTHY[0]!r}")
            return
        wanted, warnings = plan_measurement(self._parameters, sensor)
        self._warn((*sensor.warnings, *warnings))
        self._stream(wanted, now)

    def _stream(self, wanted: Measurement, now: float) -> None:
        calibrate = (
            self._parameters.calibrate_time and self._parameters.latency_s is None and not self.calibrated
        )
        self._converse(DriverPhase.STARTING, begin_stream(wanted, calibrate), self._on_streaming, now)

    def _on_streaming(self, conversation: Conversation, now: float) -> None:
        stream: AcceptedStream = conversation.result
        self.measurement = stream.measurement
        if stream.latency_s is not None and self.sensor is not None:
            self._calibrated[self.sensor.device_id] = stream.latency_s
        self._warn(stream.warnings)
        self.phase = DriverPhase.MEASURING
        self.retry.begin()
        self._expect_scan(now)

    def _on_tested(self, conversation: Conversation, now: float) -> None:
        self._report_tests(conversation.result)
        if self.measurement is not None:
            self._stream(self.measurement, now)

    def _report_tests(self, results: Sequence[SelfTestResult]) -> None:
        done, self._tests_done = self._tests_done, None
        if done is not None:
            done(results)

    def _warn(self, warnings: Sequence[str]) -> None:
        for warning in warnings:
            if self._on_problem is not None:
                self._on_problem(warning)

    # --- measuring --------------------------------------------------------------------------------------

    def _take_scan(self, reply: ScipReply, now: float) -> LaserScan | None:
        if self.measurement is None or self.sensor is None or reply.echo != self.measurement.command:
            return None
        if reply.status == ACCEPTED:
            return None
        if reply.status != SCAN_FOLLOWS:
            self._take_trouble(reply.status, describe_status(self.measurement.kind, reply.status), now)
            return None
        try:
            scan = decode_scan(reply)
        except FrameError:
            self._parser.corrupted += 1
            return None
        return self.measured(scan, now)

    def measured(self, scan: ScanReply, now: float) -> LaserScan | None:
        """Take a scan as values, in place of the bytes of a reply.

        Args:
            scan: What the sensor measured.
            now: When it came.

        Returns:
            The scan; None when the sensor turns out to be stuck.
        """
        assert self.sensor is not None, "it measures"
        if self._is_stuck(scan):
            self._fail(now, f"{self._same_stamps + 1} scans carry the same time stamp {scan.timestamp_ms} ms")
            return None
        if self._same_stamps == 0:
            self.retry.scan(now)
        self.scans += 1
        self.problem = ""
        self._corrupted_before = self.corrupted
        self._frequency.tick(now)
        self._expect_scan(now)
        return self._scan_of(scan, self.sensor, now)

    def _take_trouble(self, status: str, meaning: str, now: float) -> None:
        """Take a status in the place of a scan; one that passes by itself is waited for, for a while."""
        if not goes_on_by_itself(status):
            self._fail(now, f"measuring ended with status {status}: {meaning}")
            return
        if self.retry.interrupt(f"status {status}: {meaning}", now) and is_checking(status):
            self.problem = f"no scans for now, {self.retry.why}"
            self._warn((self.problem,))
        self._expect_scan(now)

    def _scan_of(self, scan: ScanReply, sensor: Sensor, now: float) -> LaserScan:
        geometry, wanted = sensor.geometry, self._parameters
        undelayed = self._clock.arrival(scan.timestamp_ms, now, self._scan_interval(geometry))
        arrived = undelayed if wanted.use_sensor_clock else now
        stamp = arrived - self.latency + scan.first_step * geometry.time_increment + wanted.time_offset
        found = scan_from_distances(
            scan.distances_mm,
            scan.first_step,
            scan.cluster,
            geometry,
            stamp,
            wanted.frame_id,
            skip=wanted.skip,
            intensities=scan.intensities,
        )
        return found if scan.echoes_mm is None else with_echoes(found, scan.echoes_mm, scan.echo_intensities)

    def _errors(self, sensor: Sensor) -> Mapping[int, str]:
        return range_errors(sensor.parameters.get("MODL", ""), sensor.geometry.maximum_mm)

    def _is_stuck(self, scan: ScanReply) -> bool:
        same = self._last_scan is not None and scan.timestamp_ms == self._last_scan.timestamp_ms
        self._same_stamps = self._same_stamps + 1 if same else 0
        self._last_scan = scan
        return self._same_stamps >= SAME_STAMPS_LIMIT

    def _expect_scan(self, now: float) -> None:
        if self.sensor is not None:
            interval = self._scan_interval(self.sensor.geometry)
            self._deadline = self.retry.limit(now + interval + self._parameters.silence_timeout_s)

    def _scan_interval(self, geometry: SensorGeometry) -> float:
        return geometry.scan_period * (self._parameters.skip + 1)

    # --- ends -------------------------------------------------------------------------------------------

    def _overdue(self, now: float) -> None:
        if self.phase is DriverPhase.RESTING:
            self.start(now)
        elif self.retry.why:
            self._fail(now, f"no more scans came after {self.retry.why}; the sensor is started again")
        else:
            self._fail(now, f"no scan arrived in time{self._received_instead()}")

    def _received_instead(self) -> str:
        """Say that damaged replies came in the place of scans; empty when nothing came."""
        damaged = self.corrupted - self._corrupted_before
        return f"; {damaged} that came were damaged: check the cable and its plugs" if damaged else ""

    def _halt(self) -> None:
        self.phase = DriverPhase.STOPPED
        self._deadline = None
        if self._conversation is not None:
            self._conversation.close()
            self._conversation = None
        self._report_tests(())

    def _fail(self, now: float, reason: str) -> None:
        if self.phase is DriverPhase.MEASURING:
            self.lost += 1
        self._halt()
        self.phase = DriverPhase.RESTING
        self.problem = reason
        self._deadline = now + self.retry.fail()
        self._warn((reason,))
