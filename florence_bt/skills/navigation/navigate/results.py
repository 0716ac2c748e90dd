"""The codes with which navigation ends, and the numbers Nav2 gives them. Light: no numpy, no ROS."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success

HELD_FAILURES = {
    "wheel_drop": "a wheel of the base hangs in the air",
    "overcurrent": "a wheel of the base is blocked: its motor draws too much current",
    "no_response": "the base does not answer, or does not follow its commands",
    "charger": "the charger is plugged into the base",
    "battery": "the battery of the base is empty",
}
"""What keeps the base from every motion, a goal ends at once (codes of florence_interfaces/StopReason)."""

TOUCH_FAILURES = {
    "bumper": "a bumper is pressed, and backing off did not release it",
    "cliff": "a cliff sensor misses the floor, and backing off did not help",
    "dock": "the base stands on its dock, and backing off did not help",
}
"""What keeps the base from driving forward; a drive backs off first, a turn in place is not touched by it."""

NAVIGATE_FAILURES = {
    "no_path": "no way leads to the goal",
    "goal_occupied": "the robot does not fit at the goal",
    "goal_outside": "the goal lies outside of the map",
    "start_outside": "the robot is outside of the map",
    "blocked": "something stands in the way, and waiting, turning and looking for another way did not help",
    "no_progress": "the robot does not get any nearer",
    "no_pose": "the robot does not know where it is in the map, or the odometry is silent",
    "no_scan": "no laser scan came for too long; without it the robot does not move",
    "no_transform": "the goal's frame is not connected to the map",
    **TOUCH_FAILURES,
    **HELD_FAILURES,
}
"""The codes of ``navigate_to``."""

TURN_FAILURES = {
    "collision_ahead": "the robot would hit something while turning",
    "turn_failed": "the server could not turn the robot; the reason says more",
    "time_allowance": "the turn took longer than allowed",
    "no_pose": NAVIGATE_FAILURES["no_pose"],
    "no_scan": NAVIGATE_FAILURES["no_scan"],
    **HELD_FAILURES,
}
"""The codes of ``turn``."""

FOLLOW_FAILURES = {
    "user_lost": "the person is out of sight, also from where they were seen last",
    **{
        code: NAVIGATE_FAILURES[code]
        for code in ("blocked", "no_pose", "no_scan", *TOUCH_FAILURES, *HELD_FAILURES)
    },
}
"""The codes of ``follow_user``."""

APPROACH_FAILURES = {
    "user_lost": "nobody is, or nobody is any more, where the person should be",
    "blocked": "something stands in the way, and did not go away",
    "no_progress": NAVIGATE_FAILURES["no_progress"],
    "no_pose": "the odometry is silent",
    "no_scan": NAVIGATE_FAILURES["no_scan"],
    **TOUCH_FAILURES,
    **HELD_FAILURES,
}
"""The codes of ``approach_person``."""

STOP_CODES = {code: 10001 + place for place, code in enumerate((*HELD_FAILURES, *TOUCH_FAILURES))}
"""Our code -> error_code of both actions; Nav2 has none for them and leaves numbers from 10000 on free."""

SERVER_CODES = {
    "ok": 0,
    "cancelled": 0,
    "bad_input": 200,
    "no_transform": 202,
    "start_outside": 203,
    "goal_outside": 204,
    "goal_occupied": 206,
    "timed_out": 207,
    "no_path": 208,
    "no_pose": 102,
    "no_progress": 105,
    "blocked": 106,
    "no_scan": 107,
    "user_lost": 10000,
    **STOP_CODES,
}
"""Our code -> error_code of NavigateToPose (REFERENCE 7.9) and of FollowUser."""

NO_SCAN_IN_SPIN = 707
"""As 107 of NavigateToPose; Nav2 has no number for a Spin without data, and leaves 704 to 709 free."""
SPIN_SERVER_CODES = {
    "ok": 0,
    "cancelled": 0,
    "bad_input": 700,
    "no_scan": NO_SCAN_IN_SPIN,
    "time_allowance": 701,
    "timed_out": 701,
    "no_pose": 702,
    "collision_ahead": 703,
    **STOP_CODES,
}
"""Our code -> error_code of Spin (REFERENCE 7.9)."""

NAVIGATE_CODES_BY_NUMBER = {
    **{number: code for code, number in SERVER_CODES.items() if number},
    # Nav2 splits our "blocked" further; its 107 is a costmap that gets no data.
    100: "blocked",
    101: "blocked",
    103: "blocked",
    104: "blocked",
    205: "blocked",
}
"""error_code of NavigateToPose, ours or Nav2's -> our code."""
SPIN_CODES_BY_NUMBER = {
    700: "turn_failed",
    701: "time_allowance",
    702: "no_pose",
    703: "collision_ahead",
    NO_SCAN_IN_SPIN: "no_scan",
    **{STOP_CODES[code]: code for code in HELD_FAILURES},
}
"""error_code of Spin -> our code."""


def navigate_error_code(result: Result) -> int:
    """The error_code of NavigateToPose for a result."""
    return result.server_code or SERVER_CODES.get(result.code, 100)


def spin_error_code(result: Result) -> int:
    """The error_code of Spin for a result."""
    return result.server_code or SPIN_SERVER_CODES.get(result.code, 700)


def result_from_navigate(outcome: Outcome, error_code: int, error_msg: str) -> Result:
    """Our result for the answer of a NavigateToPose server (ours or Nav2's)."""
    return _result(outcome, error_code, error_msg, NAVIGATE_CODES_BY_NUMBER, "blocked", "navigation")


def result_from_follow(outcome: Outcome, error_code: int, error_msg: str) -> Result:
    """Our result for the answer of a FollowUser server."""
    codes = {SERVER_CODES[code]: code for code in FOLLOW_FAILURES}
    return _result(outcome, error_code, error_msg, codes, "blocked", "following")


def result_from_approach(outcome: Outcome, code: str, reason: str) -> Result:
    """Our result for the end of an approach; code and reason are empty when the server gave none."""
    if outcome is Outcome.SUCCEEDED:
        return success()
    if outcome is Outcome.CANCELLED:
        return cancelled(reason or "cancelled on request")
    return failure(code or "rejected", reason or "the server gave no reason; its log may say more")


def result_from_spin(outcome: Outcome, error_code: int, error_msg: str) -> Result:
    """Our result for the answer of a Spin server (ours or Nav2's)."""
    return _result(outcome, error_code, error_msg, SPIN_CODES_BY_NUMBER, "turn_failed", "the turn")


def _result(
    outcome: Outcome, number: int, text: str, codes: dict[int, str], default: str, who: str
) -> Result:
    if outcome is Outcome.SUCCEEDED:
        return success()
    if outcome is Outcome.CANCELLED:
        return cancelled(text or "cancelled on request")
    code = codes.get(number, default)
    return failure(code, text or f"{who} failed with error code {number}", server_code=number)


@dataclass(frozen=True, slots=True)
class BaseStop:
    """What holds the base.

    Codes that are neither of the two kinds below pass by themselves, such as a gyro that is calibrated.

    Attributes:
        code: One word, empty when nothing holds it.
        text: A sentence that names the sensor.
    """

    code: str = ""
    text: str = ""

    @property
    def holds_all(self) -> bool:
        """Whether no motion is possible: a goal ends at once."""
        return self.code in HELD_FAILURES

    @property
    def holds_forward(self) -> bool:
        """Whether the base can still back off and turn."""
        return self.code in TOUCH_FAILURES

    def failure(self, text: str = "") -> Result:
        """The end of a goal because of it, with another text than its own where one is given."""
        return failure(self.code, text or self.text, server_code=SERVER_CODES[self.code])
