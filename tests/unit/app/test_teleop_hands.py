"""What keys and gamepads make of the base: pure, on times that the tests give."""

from __future__ import annotations

import pytest

from florence_bt.app.teleop.hands import DIRECTIONS, Gamepad, GamepadLayout, Keys, TeleopParameters
from florence_bt.app.teleop.panel import Situation, lines_of
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Twist2

STILL = Twist2(0.0, 0.0)


@pytest.mark.parametrize(
    ("key", "forward", "turn"),
    [
        *[("i", 1, 0), ("up", 1, 0), (",", -1, 0), ("down", -1, 0), ("j", 0, 1), ("left", 0, 1)],
        *[("l", 0, -1), ("right", 0, -1), ("u", 1, 1), ("o", 1, -1), ("m", -1, -1), (".", -1, 1)],
        *[(" ", 0, 0), ("k", 0, 0)],
    ],
)
def test_keys_drive_as_those_of_teleop_twist_keyboard(key, forward, turn):
    keys = Keys(TeleopParameters(speed=0.3, turn=0.5))
    keys.press(key, 10.0)
    assert keys.wanted(10.1) == Twist2(0.3 * forward, 0.5 * turn)


def test_the_robot_stands_when_the_time_out_is_over_and_a_repeated_key_keeps_it_going():
    keys = Keys(TeleopParameters(timeout=0.7))
    assert keys.wanted(0.0) == STILL
    keys.press("i", 10.0)
    assert keys.wanted(10.69) != STILL and keys.wanted(10.71) == STILL
    keys.press("i", 10.69)
    assert keys.wanted(11.38) != STILL and keys.wanted(11.4) == STILL
    assert keys.wanted(9.0) == STILL  # a clock that was set back


@pytest.mark.parametrize("other", [" ", "k", "enter", "p", "escape", "5"])
def test_space_and_every_key_that_means_nothing_stop(other):
    keys = Keys(TeleopParameters())
    keys.press("i", 10.0)
    keys.press(other, 10.1)
    assert keys.wanted(10.15) == STILL


def test_speed_steps_stay_within_the_limits_and_do_not_keep_the_robot_going():
    keys = Keys(TeleopParameters(speed=0.2, turn=0.8))
    keys.press("q", 10.0)
    assert keys.speeds == Twist2(pytest.approx(0.22), pytest.approx(0.88)) and keys.wanted(10.0) == STILL
    for _ in range(100):
        keys.press("w", 10.0)
        keys.press("e", 10.0)
    assert keys.speeds == Twist2(0.5, 2.0)
    for _ in range(100):
        keys.press("z", 10.0)
    assert keys.speeds.linear > 0.0 and keys.speeds.angular > 0.0
    for key in DIRECTIONS:
        keys.press(key, 10.0)
        assert abs(keys.wanted(10.0).linear) <= 0.5


def test_parameters_out_of_range_are_refused_with_what_would_do():
    with pytest.raises(ConfigError, match=r"speed is 3.*0\.5"):
        TeleopParameters(speed=3.0)


def pad(**layout) -> Gamepad:
    return Gamepad(TeleopParameters(speed=0.2, turn=0.8, timeout=0.5), GamepadLayout(**layout))


def test_a_pad_drives_only_while_its_button_is_held():
    hand = pad()
    buttons = [0] * 11
    hand.take([0.5, 1.0, 0, 0], buttons, 10.0)
    assert hand.wanted(10.0) == STILL
    buttons[4] = 1
    hand.take([0.5, 1.0, 0, 0], buttons, 10.1)
    assert hand.wanted(10.2) == Twist2(pytest.approx(0.2), pytest.approx(0.4))
    assert hand.wanted(10.6) == STILL  # the pad was switched off
    buttons[4], buttons[5] = 0, 1
    hand.take([0.0, -1.0, 0, 0], buttons, 10.7)
    assert hand.wanted(10.7) == Twist2(pytest.approx(-0.4), 0.0)
    buttons[5] = 0
    hand.take([0.0, -1.0, 0, 0], buttons, 10.8)
    assert hand.wanted(10.8) == STILL


def test_a_stick_that_does_not_rest_in_the_middle_moves_nothing():
    hand = pad()
    hand.take([0.04, -0.04], [0, 0, 0, 0, 1], 10.0)
    assert hand.wanted(10.0) == STILL


def test_a_pad_with_too_few_axes_or_buttons_says_so_and_drives_nothing():
    hand = pad(axis_angular=3, enable_button=9)
    hand.take([1.0, 1.0], [1] * 5, 10.0)
    assert hand.wanted(10.0) == STILL and "2 axes and 5 buttons" in hand.problem
    hand.take([1.0] * 4, [1] * 10, 10.1)
    assert hand.wanted(10.1) != STILL and not hand.problem


def test_the_panel_tells_what_holds_the_base():
    situation = Situation(
        Twist2(0.2, 0.8), Twist2(0.2, -0.0), Twist2(-0.0, 0.0), "the left bumper is pressed", 0.87
    )
    text = "\n".join(line.plain for line in lines_of(situation))
    assert "left bumper" in text and "87%" in text and "-0.00" not in text
    calm = "\n".join(line.plain for line in lines_of(Situation(Twist2(0.2, 0.8), STILL)))
    assert "stands still" in calm and "not known" in calm
