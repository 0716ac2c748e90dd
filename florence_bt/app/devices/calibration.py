"""``florence calibrate``: turns the base before a wall and prints, or writes, better factors."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.context import Context
from rclpy.parameter import parameter_value_to_python

from florence_bt.app.devices.config_edit import set_numbers
from florence_bt.app.runs.client import ANSWER_BUDGET_S, LIVE_STATES, OVERRIDDEN, MissionClient
from florence_bt.core.errors import ConfigError
from florence_bt.skills.calibration.factors import GYRO_PARAMETER, ODOMETRY_PARAMETER, Factors
from florence_bt.skills.calibration.node import CalibrationNode

BASE_NODE = "turtlebot_node"
SIMULATED = "use_sim_time"
LONGEST_S = 3600.0
"""Wall seconds for all rounds; the calibration's own limits are far below it."""
SIMULATED_PATIENCE_S = 30.0
"""Simulated seconds that a sensor may be silent. A message that is lost comes again after three seconds of
this machine's time, in which a simulation may run far ahead."""
CLAIM_LOOK_S = 0.5
"""Wall seconds between two questions whether a mission or a person wants the base."""


@dataclass(frozen=True, slots=True)
class Calibrated:
    """The result of a calibration.

    Attributes:
        succeeded: Whether the factors became steady.
        reason: Why not; empty on success.
        values: Parameter of the base -> (old value, factor, new value).
        rounds: The factors of each round.
    """

    succeeded: bool
    reason: str
    values: Mapping[str, tuple[float, float, float]]
    rounds: Sequence[Factors]


def calibrate(
    say: Callable[[str], None],
    *,
    rounds: int = 5,
    speeds: Sequence[float] = (),
    rest_s: float | None = None,
) -> Calibrated:
    """Calibrate the robot of the running system.

    Args:
        say: Called with what goes on, a line at a time.
        rounds: How often to repeat at most.
        speeds: Turning speeds in rad/s; the usual ones when empty.
        rest_s: Seconds at rest for the gyro's drift; the usual ones when None.

    Raises:
        SystemNotThere: No running system answers.
        ConfigError: A mission is running, the manual override is on, or a value is wrong.
        KeyboardInterrupt: A signal asked for the end; by then the base was stopped.
    """
    with MissionClient("florence_calibrate") as client:
        old = _parameters_of_base(client)
        # Of the base: the publisher of the time may not have been discovered yet.
        simulated = old.pop(SIMULATED) == 1.0
        claims = _Claims(client)
        has_gyro = GYRO_PARAMETER in old
        ended: list[bool] = []

        def make(context: Context) -> CalibrationNode:
            parameters = {
                "use_sim_time": simulated,
                "patience": SIMULATED_PATIENCE_S if simulated else None,
                "odom_scale": old[ODOMETRY_PARAMETER],
                "has_gyro": has_gyro,
                "rounds": rounds,
                "speeds": tuple(speeds) or None,
                "imu_calibrate_time": rest_s,
            }
            return CalibrationNode(say, lambda: ended.append(True), parameters=parameters, context=context)

        with client.serving(make) as node:
            assert isinstance(node, CalibrationNode)
            client.spin_until(lambda: bool(ended or claims.claim), LONGEST_S, watch=claims.look)
            measured = node.rounds
    result = measured.result
    factors = {ODOMETRY_PARAMETER: measured.odometry}
    if measured.gyro is not None:
        factors = {GYRO_PARAMETER: measured.gyro, **factors}
    return Calibrated(
        result is not None and result.succeeded,
        (claims.claim or "it was not done in time") if result is None else result.reason,
        {name: (old[name], factor, old[name] * factor) for name, factor in factors.items()},
        measured.rounds,
    )


class _Claims:
    """The others who want the base: the calibration gives way to a mission and to the manual override.

    Raises:
        ConfigError: It is in use already.
    """

    def __init__(self, client: MissionClient) -> None:
        self._client = client
        self._asked: Any = None
        self._next = 0.0
        self.claim = ""
        status = client.status()
        if OVERRIDDEN in status.blocked_by:
            raise ConfigError("the manual override is on", valid=["florence release, then calibrate"])
        if status.found and status.state in LIVE_STATES:
            raise ConfigError(f"{status.run_id} is running", valid=["florence stop, then calibrate"])

    def look(self) -> None:
        """Ask the mission server twice a second; afterwards ``claim`` says why to end, or is empty.

        Not by the override's topic: the message of a publisher that was just discovered can be missed.
        """
        now = time.monotonic()
        if self._asked is not None and self._asked.done():
            self._judge(self._asked.result())
            self._asked, self._next = None, now + CLAIM_LOOK_S
        elif now >= self._next:
            # Also again after a while, should an answer be lost.
            self._asked, self._next = self._client.ask_status(), now + ANSWER_BUDGET_S

    def _judge(self, status: Any) -> None:
        if OVERRIDDEN in status.blocked_by:
            self.claim = "the manual override was switched on"
        elif status.found and status.state in LIVE_STATES:
            self.claim = f"{status.run_id} was started meanwhile"


def report_lines(calibrated: Calibrated) -> list[str]:
    """Write the report for people, in the words of the document (section 7.2) where it has some."""
    lines = []
    for number, factors in enumerate(calibrated.rounds, 1):
        found = ", ".join(f"{name} x {factor:.4f}" for name, factor in factors.by_parameter().items())
        lines.append(f"round {number}: {found}")
    if not calibrated.rounds:
        return [*lines, f"no round was completed: {calibrated.reason}"]
    for name, (old, factor, new) in calibrated.values.items():
        lines.append(f"Multiply the '{BASE_NODE}/{name}' parameter by {factor:f} ({old:g} -> {new:.6g})")
    if not calibrated.succeeded:
        lines.append(f"not steady yet: {calibrated.reason}")
    return lines


def write_config(calibrated: Calibrated, file: Path) -> Path:
    """Write the new values into a robot's configuration.

    Returns:
        The copy of the file as it was.

    Raises:
        ConfigError: The file cannot be read or written.
    """
    return set_numbers(file, BASE_NODE, {name: new for name, (_, _, new) in calibrated.values.items()})


def _parameters_of_base(client: MissionClient) -> dict[str, float]:
    """Return the base's scales, the gyro's only if it has one, and whether its time is simulated (1 or 0)."""
    names = [ODOMETRY_PARAMETER, GYRO_PARAMETER, "has_gyro", SIMULATED]
    answer = client.call(
        GetParameters, f"{BASE_NODE}/get_parameters", GetParameters.Request(names=names), repeat=True
    )
    numbers = [float(parameter_value_to_python(value) or 0.0) for value in answer.values]
    values = dict(zip(names, numbers, strict=False))
    if values.pop("has_gyro", 0.0) != 1.0:
        values.pop(GYRO_PARAMETER, None)
    return values
