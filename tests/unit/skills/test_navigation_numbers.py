"""Numbers that other programs rely on, or that decide near people: error codes, tracks, trails, glass."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import Pose2, Twist2
from florence_bt.core.outcome import Outcome
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.skills.navigation.navigate import results
from florence_bt.skills.navigation.navigate.glass import GlassMemory
from florence_bt.skills.navigation.navigate.people import People, PeopleParameters
from florence_bt.skills.navigation.navigate.people_tracks import PeopleTracks
from florence_bt.skills.navigation.navigate.person_track import PersonTrack
from florence_bt.skills.navigation.navigate.person_trail import PersonTrail
from florence_bt.skills.navigation.navigate.personal_space import NEAREST_M, keep_off
from florence_bt.skills.navigation.navigate.vacated_cells import VacatedCells

# ---- error codes (REFERENCE 7.9) -----------------------------------------------------------------------

STOPS = {
    "wheel_drop": 10001,
    "overcurrent": 10002,
    "no_response": 10003,
    "charger": 10004,
    "battery": 10005,
    "bumper": 10006,
    "cliff": 10007,
    "dock": 10008,
}
DRIVES = {
    "ok": 0,
    "cancelled": 0,
    "no_pose": 102,
    "no_progress": 105,
    "blocked": 106,
    "no_scan": 107,
    "bad_input": 200,
    "no_transform": 202,
    "start_outside": 203,
    "goal_outside": 204,
    "goal_occupied": 206,
    "timed_out": 207,
    "no_path": 208,
    "user_lost": 10000,
}


def behaviour(first: int, collision_ahead: int, bad_input: int) -> dict[str, int]:
    return {
        "ok": 0,
        "cancelled": 0,
        "bad_input": bad_input,
        "no_scan": first + 7,
        "time_allowance": first + 1,
        "timed_out": first + 1,
        "no_pose": first + 2,
        "collision_ahead": collision_ahead,
    }


@pytest.mark.parametrize(
    ("codes", "numbers"),
    [
        (results.STOP_CODES, {}),
        (results.SERVER_CODES, DRIVES),
        (
            results.THROUGH_SERVER_CODES,
            DRIVES
            | {"bad_input": 300, "no_transform": 302, "start_outside": 303, "goal_outside": 304}
            | {"goal_occupied": 306, "timed_out": 307, "no_path": 308, "no_poses": 309},
        ),
        (results.PATH_SERVER_CODES, DRIVES | {"bad_input": 103, "no_transform": 102, "blocked": 104}),
        (results.SPIN_SERVER_CODES, behaviour(700, 703, 700)),
        (results.BACK_UP_SERVER_CODES, behaviour(710, 714, 713)),
        (results.HEADING_SERVER_CODES, behaviour(720, 723, 724)),
        (results.WAIT_SERVER_CODES, behaviour(740, 743, 740)),
    ],
)
def test_our_servers_answer_with_the_numbers_of_nav2(codes: dict[str, int], numbers: dict[str, int]) -> None:
    assert codes == numbers | STOPS


def test_a_planner_has_no_base_that_could_be_stopped() -> None:
    assert results.PLAN_SERVER_CODES == {
        "ok": 0,
        "cancelled": 0,
        "bad_input": 200,
        "no_transform": 202,
        "start_outside": 203,
        "goal_outside": 204,
        "start_occupied": 205,
        "goal_occupied": 206,
        "timed_out": 207,
        "no_path": 208,
        "no_pose": 202,
    }


@pytest.mark.parametrize(
    ("codes", "number", "code"),
    [
        *((results.NAVIGATE_CODES_BY_NUMBER, number, "blocked") for number in (100, 101, 103, 104, 106, 205)),
        (results.NAVIGATE_CODES_BY_NUMBER, 102, "no_pose"),
        (results.NAVIGATE_CODES_BY_NUMBER, 105, "no_progress"),
        (results.NAVIGATE_CODES_BY_NUMBER, 107, "no_scan"),
        (results.NAVIGATE_CODES_BY_NUMBER, 208, "no_path"),
        (results.NAVIGATE_CODES_BY_NUMBER, 10006, "bumper"),
        (results.THROUGH_CODES_BY_NUMBER, 305, "blocked"),
        (results.THROUGH_CODES_BY_NUMBER, 308, "no_path"),
        (results.THROUGH_CODES_BY_NUMBER, 309, "bad_input"),
        (results.PLAN_CODES_BY_NUMBER, 202, "no_transform"),
        (results.PLAN_CODES_BY_NUMBER, 205, "start_occupied"),
        (results.SPIN_CODES_BY_NUMBER, 700, "turn_failed"),
        (results.SPIN_CODES_BY_NUMBER, 701, "time_allowance"),
        (results.SPIN_CODES_BY_NUMBER, 702, "no_pose"),
        (results.SPIN_CODES_BY_NUMBER, 703, "collision_ahead"),
        (results.SPIN_CODES_BY_NUMBER, 707, "no_scan"),
        (results.SPIN_CODES_BY_NUMBER, 10005, "battery"),
        (results.BACK_UP_CODES_BY_NUMBER, 710, "drive_failed"),
        (results.BACK_UP_CODES_BY_NUMBER, 711, "time_allowance"),
        (results.BACK_UP_CODES_BY_NUMBER, 714, "collision_ahead"),
        (results.HEADING_CODES_BY_NUMBER, 720, "drive_failed"),
        (results.HEADING_CODES_BY_NUMBER, 721, "time_allowance"),
        (results.HEADING_CODES_BY_NUMBER, 723, "collision_ahead"),
        (results.FOLLOW_CODES_BY_NUMBER, 10000, "user_lost"),
        (results.FOLLOW_CODES_BY_NUMBER, 106, "blocked"),
    ],
)
def test_numbers_of_a_server_become_codes(codes: dict[int, str], number: int, code: str) -> None:
    said = SimpleNamespace(error_code=number, error_msg="")
    result = results.result_from_server("drive", codes, "unknown", said, Outcome.FAILED)
    assert (result.code, result.reason) == (code, f"drive failed with error code {number}")


def test_a_number_that_nobody_knows_has_the_code_for_that_and_the_servers_words_count() -> None:
    said = SimpleNamespace(error_code=999, error_msg="its own words")
    codes = results.SEARCH_CODES_BY_NUMBER
    assert 106 not in codes
    failed = results.result_from_server("look", codes, "user_lost", said, Outcome.FAILED)
    assert (failed.code, failed.reason) == ("user_lost", "its own words")
    assert results.result_from_server("look", codes, "x", said, Outcome.SUCCEEDED).succeeded
    ended = results.result_from_server("look", codes, "x", said, Outcome.CANCELLED)
    assert (ended.outcome, ended.reason) == (Outcome.CANCELLED, "its own words")
    said.error_msg = ""
    ended = results.result_from_server("look", codes, "x", said, Outcome.CANCELLED)
    assert ended.reason == "cancelled on request"


def test_the_end_of_an_approach() -> None:
    assert results.result_from_approach(Outcome.SUCCEEDED, "", "").succeeded
    assert results.result_from_approach(Outcome.CANCELLED, "", "").reason == "cancelled on request"
    assert results.result_from_approach(Outcome.CANCELLED, "", "by hand").reason == "by hand"
    failed = results.result_from_approach(Outcome.FAILED, "", "")
    assert failed.code == "rejected" and "gave no reason" in failed.reason
    failed = results.result_from_approach(Outcome.FAILED, "blocked", "a chair")
    assert (failed.code, failed.reason) == ("blocked", "a chair")


@pytest.mark.parametrize(
    ("code", "holds_all", "holds_forward"),
    [
        *((code, True, False) for code in results.HELD),
        *((code, False, True) for code in results.TOUCHES),
        ("gyro", False, False),
        ("", False, False),
    ],
)
def test_what_holds_the_base(code: str, holds_all: bool, holds_forward: bool) -> None:
    stop = BaseStop(code, "because")
    assert (stop.holds_all, stop.holds_forward) == (holds_all, holds_forward)
    assert (stop.failure().reason, stop.failure("other words").reason) == ("because", "other words")


# ---- people --------------------------------------------------------------------------------------------


def test_how_somebody_walks_is_averaged_over_some_time() -> None:
    track = PersonTrack(0.6, 0.7)
    assert not track.is_seen(0.0)
    for step in range(40):
        track.saw(0.1 * step, 0.05 * step, -0.02 * step)
    assert track.velocity == pytest.approx((0.5, -0.2), abs=0.01)
    assert track.speed == pytest.approx(math.hypot(0.5, 0.2), abs=0.01) and track.walks
    once = PersonTrack(0.6, 0.7)
    once.saw(0.0, 0.0, 0.0)
    once.saw(0.6, 0.6, 0.0)
    assert once.velocity == pytest.approx((0.5, 0.0)), "half of 1 m/s after as long as the average"
    assert once.walks_away(Pose2(), 0.0) == pytest.approx(0.5)
    assert once.walks_away(Pose2(0.0, 0.0, math.pi / 2), math.pi / 2) == pytest.approx(-0.5)
    once.saw(0.6, 9.0, 9.0)
    assert once.last == (0.6, 0.0), "a sight that is not newer says nothing"


def test_who_was_seen_walks_on_for_a_moment() -> None:
    track = PersonTrack(0.6, 0.7)
    track.saw(0.0, 0.0, 0.0)
    track.suppose(2.0, (1.0, 2.0))
    assert (track.last, track.velocity) == ((1.0, 2.0), (0.5, 1.0))
    assert track.at(-1.0) == (1.0, 2.0)
    assert track.at(0.5) == pytest.approx((1.25, 2.5))
    assert track.at(9.0) == pytest.approx((1.35, 2.7)), "no longer than they count as in sight"
    assert (track.is_seen(0.7), track.is_seen(0.71), track.is_seen(3.0, 3.0)) == (True, False, True)
    track.velocity = (0.0, 0.09)
    assert not track.walks
    track.velocity = (0.0, 0.1)
    assert track.walks


def test_people_are_where_they_walk_on_to_and_no_faster_than_people_walk() -> None:
    tracks = PeopleTracks(PeopleParameters(), 0.7)
    for step in range(60):
        tracks.saw(0.1 * step, 1, 0.1 * step, 0.0)
        tracks.saw(0.1 * step, 2, 0.0, 0.4 * step)
        tracks.saw(0.1 * step, 3, 5.0, 0.005 * step)
    rows = {round(row[2], 1): row for row in tracks.people(6.4).rows.tolist()}
    assert rows[1.0][0] == pytest.approx(5.9 + 0.5, abs=0.02)
    fast = next(row for row in tracks.people(6.4).rows.tolist() if row[3] > 1.0)
    assert fast[3] == pytest.approx(2.0), "faster is a mistake"
    slow = next(row for row in tracks.people(6.4).rows.tolist() if row[0] == 5.0)
    assert slow[2:4] == [0.0, 0.0], "who seems to creep stands"
    assert all(row[4] == PeopleParameters().people_distance for row in tracks.people(6.4).rows)
    assert len(tracks.people(6.4, without=1).rows) == 2
    assert len(tracks.people(6.9).rows) == 3 and len(tracks.people(6.91).rows) == 0
    assert len(tracks.people(5.9, place=(5.9, 0.29)).rows) == 2
    assert len(tracks.people(5.9, place=(5.9, 0.31)).rows) == 3


def test_who_was_not_seen_for_half_a_minute_is_forgotten_but_for_who_is_followed() -> None:
    tracks = PeopleTracks(PeopleParameters(), 0.7)
    for who in (1, 2):
        tracks.saw(10.0, who, float(who), 0.0)
    tracks.forget(40.0)
    assert [tracks.of(who).seen for who in (1, 2)] == [10.0, 10.0]
    tracks.forget(40.1, but=2)
    assert [tracks.of(who).seen for who in (1, 2)] == [None, 10.0]
    tracks.forget(9.0)
    assert tracks.of(2).seen is None, "the clock was set back"


def test_where_the_others_were_is_remembered_for_ten_seconds() -> None:
    tracks = PeopleTracks(PeopleParameters(), 0.7)
    tracks.saw(0.0, 1, 0.0, 0.0)
    tracks.saw(5.0, 1, 0.5, 0.0)
    tracks.saw(5.0, 2, 9.0, 9.0)
    assert tracks.others(2, 10.0) == [(0.0, 0.0), (0.5, 0.0)]
    assert tracks.others(2, 10.1) == [(0.5, 0.0)]
    assert tracks.others(1, 10.0) == [(9.0, 9.0)]


def test_a_trail_has_points_a_decimetre_apart_and_begins_anew_after_a_gap() -> None:
    trail = PersonTrail()
    for stamp, x in enumerate((0.0, 0.09, 0.1, 0.25, 0.34)):
        trail.saw(float(stamp), (x, 0.0))
    assert trail.since(0.0) == [(0.0, 0.0), (0.1, 0.0), (0.25, 0.0)]
    assert trail.since(3.0) == [(0.25, 0.0)]
    assert trail.last(0.15) == [(0.1, 0.0), (0.25, 0.0)]
    trail.saw(9.0, (0.85, 0.0))
    assert len(trail.since(0.0)) == 4, "0.6 m further it is the same way"
    trail.saw(10.0, (1.46, 0.0))
    assert trail.since(0.0) == [(1.46, 0.0)], "more is not"


def test_places_are_left_at_a_step_and_forgotten_after_a_minute() -> None:
    cells = VacatedCells()
    assert cells.saw(0.0, 1, (0.0, 0.0)) == []
    assert cells.saw(1.0, 1, (0.6, 0.0)) == []
    assert cells.saw(2.0, 1, (0.61, 0.0)) == [(0.0, 0.0)]
    assert cells.saw(3.0, 1, (3.2, 0.0)) == [(0.6, 0.0)], "0.6 m and 2 m in a second"
    assert cells.saw(4.0, 1, (5.81, 0.0)) == [], "further nobody gets: it is somebody else"
    assert cells.saw(64.1, 2, (0.0, 0.0)) == []
    assert cells.saw(64.2, 1, (6.6, 0.0)) == [], "nobody knows any more where they were"


def test_towards_somebody_who_is_too_near_the_robot_does_not_drive() -> None:
    command, turn = Twist2(0.3, 0.4), Twist2(0.0, 0.4)
    for person, driven in (
        ((NEAREST_M - 0.01, 0.0), turn),
        ((NEAREST_M + 0.01, 0.0), command),
        ((0.3 * math.cos(0.99), 0.3 * math.sin(0.99)), turn),
        ((0.3 * math.cos(1.01), -0.3 * math.sin(1.01)), command),
        ((-0.3, 0.0), command),
    ):
        assert keep_off(Pose2(), person, command) == driven
    assert keep_off(Pose2(), (0.3, 0.0), Twist2(-0.1, 0.2)) == Twist2(-0.1, 0.2), "back it may"


def people(*rows: tuple[float, ...], **parameters: float) -> People:
    return People(np.array(rows, float).reshape(-1, 5), PeopleParameters(**parameters))


@pytest.mark.parametrize(
    ("row", "linear", "speed"),
    [
        ((1.4, 0.0, 0.0, 0.0, 0.4), 0.6, 0.5),  # 1 m left, to be there in 2 s at the soonest
        ((1.2, 0.0, -0.2, 0.0, 0.4), 0.6, 0.2),  # they come nearer by themselves
        ((-1.4, 0.0, 0.0, 0.0, 0.4), 0.6, 0.6),
        ((-1.4, 0.0, 0.0, 0.0, 0.4), -0.6, -0.5),
        ((0.45, 0.0, 0.0, 0.0, 0.4), 0.3, 0.08),
    ],
)
def test_the_robot_drives_so_that_it_is_near_somebody_in_two_seconds_at_the_soonest(
    row: tuple[float, ...], linear: float, speed: float
) -> None:
    slowed = people(row, people_prediction_time=0.1).slowed(Pose2(), Twist2(linear, 0.2 * linear))
    assert (slowed.linear, slowed.angular) == pytest.approx((speed, 0.2 * speed))
    for off in ({"people_distance": 0.0}, {"people_time_to_contact": 0.0}):
        free = people((9.0, 9.0, 0.0, 0.0, 0.4), row, people_prediction_time=0.01, **off)
        assert free.slowed(Pose2(), Twist2(linear, 0.0)) == Twist2(linear, 0.0)


def test_a_goal_near_somebody_may_be_driven_to() -> None:
    near, far = (1.0, 0.0, 0.0, 0.0, 0.4), (5.0, 0.0, 0.0, 0.0, 0.4)
    rows = people(near, far).around_goal(Pose2(0.7, 0.0)).rows
    assert rows[:, 4] == pytest.approx([0.2, 0.4]), "as near as the goal, less 0.1 m"
    assert people(near).around_goal(Pose2(0.95, 0.0)).rows[0, 4] == 0.0
    assert people(near).anybody_beside(Pose2(0.61, 0.0)) and not people(near).anybody_beside(Pose2(0.59, 0.0))
    assert not people().anybody_beside(Pose2())
    turned = people((1.0, 0.0, 0.5, 0.0, 0.4)).in_map(Pose2(2.0, 3.0, math.pi / 2))
    assert turned == pytest.approx(np.array([[2.0, 4.0, 0.0, 0.5]]))
    assert people().in_map(Pose2()).shape == (0, 4)


# ---- glass ---------------------------------------------------------------------------------------------


def glass_of(memory: GlassMemory) -> set[tuple[int, int]]:
    cells = np.zeros((40, 40), np.int8)
    cells[:, 30] = 100
    cells[0, 0] = -1
    found = memory.added_to(OccupancyGrid(0.1, Pose2(-1.0, -1.0), cells))
    return {(int(v), int(u)) for v, u in np.argwhere((found.cells == 100) & (cells != 100))}


def ends(*points: tuple[float, float]) -> np.ndarray:
    return np.array(points, float).reshape(-1, 2)


def test_what_was_met_twice_on_free_floor_is_glass() -> None:
    memory = GlassMemory()
    pane = ends((0.55, 0.05), (0.55, 0.15), (1.85, 0.05), (-0.95, -0.95), (9.0, 9.0))
    memory.saw(0.0, pane, Pose2())
    assert glass_of(memory) == set()
    memory.saw(1.0, pane, Pose2(0.09, 0.0, 0.09))
    assert glass_of(memory) == set(), "the robot has hardly moved: that is the same scan"
    memory.saw(2.0, pane, Pose2(0.1, 0.0))
    assert glass_of(memory) == {(10, 15), (11, 15)}, "not where a wall is, or nothing is known"
    memory.forget()
    assert glass_of(memory) == set()


def test_glass_is_met_from_near_by_and_remembered_for_five_minutes() -> None:
    memory = GlassMemory()
    pane = ends((0.55, 0.05))
    memory.saw(0.0, pane, Pose2(-1.94, 0.0))
    memory.saw(1.0, pane, Pose2(-1.96, 0.0, 0.5))
    assert glass_of(memory) == set(), "one of them was too far away"
    memory.saw(2.0, pane, Pose2(0.0, 0.0))
    assert glass_of(memory) == {(10, 15)}
    memory.saw(301.9, ends(), Pose2(0.5, 0.0))
    assert glass_of(memory) == set(), "the first of them is too old"
    memory.saw(302.5, pane, Pose2(0.0, 0.0))
    memory.saw(302.6, pane, Pose2(0.0, 0.0, 0.1))
    assert glass_of(memory) == {(10, 15)}
    memory.saw(10.0, ends(), Pose2(0.5, 0.0))
    assert glass_of(memory) == set(), "the clock was set back"
