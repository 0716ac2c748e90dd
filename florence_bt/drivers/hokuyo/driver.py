"""The Hokuyo driver without a port: bytes and the time go in, scans and bytes come out.

The start-up sequence is one table. Each step sends a command and waits for its echo; a wrong status or
silence repeats it, and a step that never succeeds makes the driver rest and start afresh. Whatever happens on
the line, the driver ends up measuring again once the sensor answers as it should.

Source: REFERENCE 4.6, 4.7, 4.9.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from florence_bt.core.errors import FrameError
from florence_bt.core.sensing import LaserScan
from florence_bt.drivers.frequency import FrequencyMeter
from florence_bt.drivers.hokuyo.codec import Reply, ReplyParser, ScanReply, decode_scan, request, scan_command
from florence_bt.drivers.hokuyo.geometry import SensorGeometry, scan_from_distances
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters
from florence_bt.drivers.hokuyo.status import ACCEPTED, SCAN_FOLLOWS, describe_status

HEALTHY = "Sensor works well."
"""The text of STAT that hokuyo_node insists on (REFERENCE 4.5)."""

RESUMED = "98"
SAME_STAMPS_LIMIT = 2
"""hokuyo_node gives up when more scans than this carry the same time stamp."""


class Phase(enum.Enum):
    """What the driver is about."""

    STOPPED = "stopped"
    STARTING = "starting"
    MEASURING = "measuring"
    RESTING = "resting before it starts again"


@dataclass(frozen=True, slots=True)
class Step:
    """One command of the start-up.

    Attributes:
        command: The text to send; ``MD`` is completed with the window.
        accepted: Statuses that lead on; empty: any answer, or none at all.
        attempts: How often to try, one reply time-out apart.
    """

    command: str
    accepted: tuple[str, ...] = (ACCEPTED,)
    attempts: int = 3


START_UP = (
    Step("SCIP2.0", (), 1),  # old firmware wakes up in SCIP 1.1, newer firmware answers 0E
    Step("TM2", (ACCEPTED, "03")),  # in time mode everything else is refused
    Step("QT"),
    Step("RS"),
    Step("PP"),
    Step("VV"),
    Step("II"),
    Step("BM", (ACCEPTED, "02"), 10),
    Step("MD", (ACCEPTED, SCAN_FOLLOWS)),  # a scan proves as well that the stream runs
)


@dataclass(slots=True)
class DriverStatus:
    """A picture of the driver for diagnostics.

    Attributes:
        phase: What it is about.
        problem: The last failure, empty since the last scan.
        device: What VV told: VEND, PROD, FIRM, PROT, SERI.
        device_status: The sensor's own STAT text.
        scans: Scans received.
        corrupted: Replies with wrong check sums or layout.
        lost: How often a running stream broke.
    """

    phase: Phase = Phase.STOPPED
    problem: str = ""
    device: Mapping[str, str] = field(default_factory=dict)
    device_status: str = "unknown"
    scans: int = 0
    corrupted: int = 0
    lost: int = 0


class HokuyoDriver:
    """Starts the sensor, keeps it measuring and makes scans of its replies.

    Call :meth:`start` once the port is open, :meth:`receive` with what was read, and :meth:`poll` after each
    of them and at :meth:`next_deadline`; write what ``poll`` returns.

    Args:
        parameters: How to measure.
        on_problem: Told each failure, in words.
    """

    def __init__(self, parameters: HokuyoParameters, on_problem: Callable[[str], None] | None = None) -> None:
        self._parameters = parameters
        self._on_problem = on_problem
        self._parser = ReplyParser()
        self._status = DriverStatus()
        self._frequency = FrequencyMeter()
        self._outbox = bytearray()
        self._deadline: float | None = None
        self._index = 0
        self._attempt = 0
        self._awaited = ""
        self._refusal = ""
        self._failures = 0
        self._same_stamps = 0
        self._last_stamp_ms: int | None = None
        self.geometry: SensorGeometry | None = None

    @property
    def status(self) -> DriverStatus:
        """The state for diagnostics; treat it as read-only."""
        self._status.corrupted = self._parser.corrupted
        return self._status

    @property
    def expected_rate(self) -> float:
        """Scans a second that the sensor should deliver; 0 before it told its speed."""
        return 0.0 if self.geometry is None else 1.0 / self._scan_interval(self.geometry)

    @property
    def latency(self) -> float:
        """Seconds between the sensor passing step 0 and the scan's arrival, as set or as the sweep lasts."""
        if self._parameters.latency_s is not None or self.geometry is None:
            return self._parameters.latency_s or 0.0
        return (self.geometry.step_at(self._parameters.max_ang) + 1) * self.geometry.time_increment

    def rate(self, now: float) -> float:
        """Scans a second that did arrive lately."""
        return self._frequency.rate(now)

    def start(self, now: float) -> None:
        """Begin the start-up, also after the port was lost."""
        self._parser.clear()
        self._outbox.clear()
        self._begin(0, now)

    def shutdown(self) -> bytes:
        """Stop, and return the bytes that switch the laser off."""
        self._halt()
        return request("QT")

    def disconnected(self, reason: str) -> None:
        """The port is gone: forget everything under way until :meth:`start`."""
        if self._status.phase is Phase.MEASURING:
            self._status.lost += 1
        self._status.problem = reason
        self._halt()

    def next_deadline(self) -> float | None:
        """When :meth:`poll` must be called at the latest, or None."""
        return self._deadline

    def poll(self, now: float) -> bytes:
        """Do what is due and return the bytes to send."""
        if self._deadline is not None and now >= self._deadline:
            self._overdue(now)
        data = bytes(self._outbox)
        self._outbox.clear()
        return data

    def receive(self, data: bytes, now: float) -> list[LaserScan]:
        """Take bytes that arrived at ``now`` and return the scans that they complete."""
        scans = []
        for reply in self._parser.feed(data):
            if self._status.phase is Phase.STARTING:
                self._take_answer(reply, now)
            elif self._status.phase is Phase.MEASURING and reply.echo == self._awaited:
                scan = self._take_scan(reply, now)
                if scan is not None:
                    scans.append(scan)
        return scans

    # --- start-up ---------------------------------------------------------------------------------------

    def _begin(self, index: int, now: float) -> None:
        self._status.phase = Phase.STARTING
        self._index = index
        self._attempt = 0
        self._send(now)

    def _send(self, now: float) -> None:
        self._attempt += 1
        self._refusal = ""
        command = START_UP[self._index].command
        self._awaited = self._scan_command() if command == "MD" else command
        self._outbox += request(self._awaited)
        self._deadline = now + self._parameters.reply_timeout_s

    def _take_answer(self, reply: Reply, now: float) -> None:
        if reply.echo != self._awaited:
            return  # a scan of an older stream, or an answer that came too late
        step = START_UP[self._index]
        self._refusal = self._objection(step, reply)
        if self._refusal:
            return  # tried again at the deadline
        if self._index + 1 < len(START_UP):
            self._begin(self._index + 1, now)
        else:
            self._status.phase = Phase.MEASURING
            self._same_stamps, self._last_stamp_ms = 0, None
            self._expect_scan(now)

    def _objection(self, step: Step, reply: Reply) -> str:
        """Why an answer does not lead on; empty when it does."""
        if step.accepted and reply.status not in step.accepted:
            return (
                f"{step.command} was answered {reply.status}: {describe_status(step.command, reply.status)}"
            )
        try:
            match step.command:
                case "PP":
                    self.geometry = SensorGeometry.from_information(reply.information())
                case "VV":
                    self._status.device = reply.information()
                case "II":
                    self._status.device_status = reply.information().get("STAT", "unknown")
                    if self._status.device_status != HEALTHY:
                        return f"the sensor reports {self._status.device_status!r} instead of {HEALTHY!r}"
        except FrameError as error:
            return str(error)
        return ""

    def _scan_command(self) -> str:
        geometry, wanted = self._known_geometry(), self._parameters
        first, last = geometry.step_at(wanted.min_ang), geometry.step_at(wanted.max_ang)
        return scan_command("MD", first, last, wanted.cluster, wanted.skip, 0)

    def _known_geometry(self) -> SensorGeometry:
        if self.geometry is None:
            raise FrameError("the sensor's geometry is known only after its answer to PP")
        return self.geometry

    # --- measuring --------------------------------------------------------------------------------------

    def _take_scan(self, reply: Reply, now: float) -> LaserScan | None:
        if reply.status == RESUMED:
            self._expect_scan(now)
        if reply.status in (ACCEPTED, RESUMED):
            return None
        if reply.status != SCAN_FOLLOWS:
            self._fail(
                now, f"measuring ended with status {reply.status}: {describe_status('MD', reply.status)}"
            )
            return None
        try:
            scan = decode_scan(reply)
        except FrameError:
            self._parser.corrupted += 1
            return None
        if self._is_stuck(scan):
            self._fail(now, f"{self._same_stamps + 1} scans carry the same time stamp {scan.timestamp_ms} ms")
            return None
        self._status.scans += 1
        self._status.problem = ""
        self._failures = 0
        self._frequency.tick(now)
        self._expect_scan(now)
        return self._scan_of(scan, now)

    def _scan_of(self, scan: ScanReply, now: float) -> LaserScan:
        geometry, wanted = self._known_geometry(), self._parameters
        stamp = now - self.latency + scan.first_step * geometry.time_increment + wanted.time_offset
        return scan_from_distances(
            scan.distances_mm,
            scan.first_step,
            scan.cluster,
            geometry,
            stamp,
            wanted.frame_id,
            skip=wanted.skip,
        )

    def _is_stuck(self, scan: ScanReply) -> bool:
        same = scan.timestamp_ms == self._last_stamp_ms
        self._same_stamps = self._same_stamps + 1 if same else 0
        self._last_stamp_ms = scan.timestamp_ms
        return self._same_stamps >= SAME_STAMPS_LIMIT

    def _expect_scan(self, now: float) -> None:
        interval = self._scan_interval(self._known_geometry())
        self._deadline = now + interval + self._parameters.silence_timeout_s

    def _scan_interval(self, geometry: SensorGeometry) -> float:
        return geometry.scan_period * (self._parameters.skip + 1)

    # --- ends ---------------------------------------------------------------------------------------

    def _overdue(self, now: float) -> None:
        match self._status.phase:
            case Phase.RESTING:
                self.start(now)
            case Phase.MEASURING:
                self._fail(now, "no scan arrived in time")
            case Phase.STARTING:
                step = START_UP[self._index]
                if self._attempt < step.attempts:
                    self._send(now)
                elif not step.accepted:
                    self._begin(self._index + 1, now)
                else:
                    self._fail(now, self._refusal or f"no answer to {step.command}")
            case Phase.STOPPED:
                self._deadline = None

    def _halt(self) -> None:
        self._status.phase = Phase.STOPPED
        self._deadline = None
        self._outbox.clear()

    def _fail(self, now: float, reason: str) -> None:
        if self._status.phase is Phase.MEASURING:
            self._status.lost += 1
        self._status.phase = Phase.RESTING
        self._status.problem = reason
        self._deadline = now + self._parameters.restart_delay_s * min(2 ** min(self._failures, 4), 10)
        self._failures += 1
        if self._on_problem is not None:
            self._on_problem(reason)
