"""The missions of the package on mocked skills; most of their tests are the scenarios in ``scenarios/``."""

import pytest

USER = "(3 m, 2 m, 180 deg)"
PROPOSALS = (
    "(2.5 m, 2 m, 0 deg)",
    "(2.6 m, 2.4 m, -45 deg)",
    "(2.6 m, 1.6 m, 45 deg)",
    "(2.2 m, 1.9 m, 7 deg)",
    "(2.2 m, 2.3 m, -20 deg)",
    "(2 m, 1.5 m, 25 deg)",
)


@pytest.fixture
def robot(florence):
    """A robot on which everything succeeds; it is elsewhere, and the user is seen at the first look."""
    florence.defaults(
        get_user_room="SUCCESS (room=kitchen)",
        get_views="SUCCESS (poses=[(4 m, 5 m, 30 deg)])",
        get_hotspot="SUCCESS (pose=(4 m, 5 m, 30 deg))",
        plan_to="SUCCESS (length=5 m)",
        navigate_to="accepted after 100 ms, cancel takes 500 ms, running 10 s, then SUCCESS",
        turn="accepted after 100 ms, cancel takes 200 ms, running 2 s, then SUCCESS",
        drive_straight="SUCCESS",
        start_tracker="accepted after 50 ms, running 100 ms, then SUCCESS",
        stop_tracker="accepted after 50 ms, running 100 ms, then SUCCESS",
        look_for_user=f"running 1 s, then SUCCESS (user={USER}, distance=2 m, user_id=7)",
        set_user_position="SUCCESS",
        get_robot_pose="SUCCESS (pose=(1 m, 2 m, 0 deg))",
        propose_approach_pose=lambda inputs: (
            f"running 50 ms, SUCCESS (pose={PROPOSALS[inputs['trial'] - 1]})"
        ),
    )
    return florence
