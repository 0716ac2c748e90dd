"""The codes with which navigation ends, and the numbers Nav2 gives them. Light: no numpy, no ROS."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success

HELD = ("wheel_drop", "overcurrent", "no_response", "charger", "battery")
"""What keeps the base from every motion, a goal ends at once (codes of florence_interfaces/StopReason)."""

TOUCHES = ("bumper", "cliff", "dock")
"""What keeps the base from driving forward; a drive backs off first, a turn in place is not touched by it."""

NO_POSE = "the robot does not know where it is in the map"
NO_MAP = "there is no map yet; the map server publishes it on 'map'"
MAP_IS_FIXED = (
    "the map does not grow, so there is nothing to explore (would have worked: florence up --mapping)"
)
OUT_OF_REACH = "the map ends, as wide as a door, where the robot neither gets to nor sees more"

STOP_CODES = {code: 10001 + place for place, code in enumerate((*HELD, *TOUCHES))}
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

PLAN_SERVER_CODES = {
    code: SERVER_CODES[code]
    for code in ("ok", "cancelled", "bad_input", "no_transform", "start_outside", "goal_outside")
} | {"start_occupied": 205, "goal_occupied": 206, "timed_out": 207, "no_path": 208, "no_pose": 202}
"""Our code -> error_code of ComputePathToPose (REFERENCE 7.9)."""

THROUGH_SERVER_CODES = {
    code: number + 100 if 200 <= number < 300 else number for code, number in SERVER_CODES.items()
} | {"no_poses": 309}
"""Our code -> error_code of NavigateThroughPoses: its planner has a family of its own (REFERENCE 7.9)."""

PATH_SERVER_CODES = {**SERVER_CODES, "bad_input": 103, "no_transform": 102, "blocked": 104}
"""Our code -> error_code of FollowPath (REFERENCE 7.9): a drive that is blocked has waited before."""


def _behaviour_codes(family: int, collision_ahead: int, bad_input: int) -> dict[str, int]:
    """Map our codes to the error codes of an action of Nav2's behaviour server, which begin with ``family``.

    Nav2 has no number for one without data, and leaves the last three of each family free.
    """
    return {
        "ok": 0,
        "cancelled": 0,
        "bad_input": bad_input,
        "no_scan": family + 7,
        "time_allowance": family + 1,
        "timed_out": family + 1,
        "no_pose": family + 2,
        "collision_ahead": collision_ahead,
        **STOP_CODES,
    }


SPIN_SERVER_CODES = _behaviour_codes(700, 703, 700)
BACK_UP_SERVER_CODES = _behaviour_codes(710, 714, 713)
HEADING_SERVER_CODES = _behaviour_codes(720, 723, 724)
WAIT_SERVER_CODES = _behaviour_codes(740, 743, 740)
"""Our code -> error_code of Spin, BackUp, DriveOnHeading and Wait (REFERENCE 7.9)."""

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
THROUGH_CODES_BY_NUMBER = {
    **NAVIGATE_CODES_BY_NUMBER,
    **{number + 100: code for number, code in NAVIGATE_CODES_BY_NUMBER.items() if 200 <= number < 300},
    309: "bad_input",
}
"""error_code of NavigateThroughPoses -> our code."""
PLAN_CODES_BY_NUMBER = {
    **{number: code for code, number in PLAN_SERVER_CODES.items() if number},
    202: "no_transform",
}
"""error_code of ComputePathToPose -> our code."""
SPIN_CODES_BY_NUMBER = {
    700: "turn_failed",
    701: "time_allowance",
    702: "no_pose",
    703: "collision_ahead",
    707: "no_scan",
    **{STOP_CODES[code]: code for code in HELD},
}
"""error_code of Spin -> our code."""


def _straight_codes(codes: dict[str, int], unknown: int) -> dict[int, str]:
    by_number = {number: code for code, number in codes.items() if number}
    return {**by_number, codes["time_allowance"]: "time_allowance", unknown: "drive_failed"}


BACK_UP_CODES_BY_NUMBER = _straight_codes(BACK_UP_SERVER_CODES, 710)
HEADING_CODES_BY_NUMBER = _straight_codes(HEADING_SERVER_CODES, 720)
"""error_code of BackUp and DriveOnHeading -> our code."""
FOLLOW_CODES_BY_NUMBER = {
    SERVER_CODES[code]: code for code in ("user_lost", "blocked", "no_pose", "no_scan", *TOUCHES, *HELD)
}
"""error_code of FollowUser -> our code."""
SEARCH_CODES_BY_NUMBER = {n: code for n, code in FOLLOW_CODES_BY_NUMBER.items() if code != "blocked"}
"""error_code of a search, which is a FollowUser too -> our code."""


def result_from_approach(outcome: Outcome, code: str, reason: str) -> Result:
    """Return our result for the end of an approach; code and reason are empty when the server gave none."""
    if outcome is Outcome.SUCCEEDED:
        return success()
    if outcome is Outcome.CANCELLED:
        return cancelled(reason or "cancelled on request")
    return failure(code or "rejected", reason or "the server gave no reason; its log may say more")


def result_from_server(
    skill: str, codes: Mapping[int, str], unknown: str, message: Any, outcome: Outcome
) -> Result:
    """Return our result for the answer of an action server, ours or Nav2's, without outputs.

    Args:
        skill: The skill that the action is.
        codes: Error number of the server -> our code.
        unknown: The code for any other error number.
        message: The result message, with ``error_code`` and ``error_msg``.
        outcome: How the goal ended.
    """
    if outcome is Outcome.SUCCEEDED:
        return success()
    number, text = message.error_code, message.error_msg
    if outcome is Outcome.CANCELLED:
        return cancelled(text or "cancelled on request")
    code = codes.get(number, unknown)
    return failure(code, text or f"{skill} failed with error code {number}")


@dataclass(frozen=True, slots=True)
class BaseStop:
    """The reason why the base is held.

    Codes that are neither of the two kinds below pass by themselves, such as a gyro that is calibrated.

    Attributes:
        code: One word, empty when nothing holds it.
        text: A sentence that names the sensor.
    """

    code: str = ""
    text: str = ""

    @property
    def holds_all(self) -> bool:
        """Tell whether no motion is possible: a goal ends at once."""
        return self.code in HELD

    @property
    def holds_forward(self) -> bool:
        """Tell whether the base can still back off and turn."""
        return self.code in TOUCHES

    def failure(self, text: str = "") -> Result:
        """End a goal because of it, with another text than its own where one is given."""
        return failure(self.code, text or self.text)
