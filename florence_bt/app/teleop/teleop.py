"""``florence teleop``: takes the robot by the manual override, drives it, and gives it back."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

from florence_interfaces.srv import StopMission
from geometry_msgs.msg import Twist
from rich.console import Console, Group
from rich.live import Live
from sensor_msgs.msg import Joy

from florence_bt.app.bringup.options import STARTS
from florence_bt.app.bringup.signals import ignored, once
from florence_bt.app.runs.client import (
    ACTIVE_STATES,
    ANSWER_BUDGET_S,
    MissionClient,
    SystemNotThere,
)
from florence_bt.app.runs.keyboard import Keyboard, in_front
from florence_bt.app.runs.switch_override import Stopped, StoppedAgain, release_the_robot, stop_the_robot
from florence_bt.app.runs.whereabouts import Whereabouts
from florence_bt.app.teleop.hands import HAND_PERIOD_S, Gamepad, GamepadLayout, Hand, Keys, TeleopParameters
from florence_bt.app.teleop.panel import KEYS, Situation, lines_of
from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.geometry import STANDSTILL
from florence_bt.core.heard import Freshness, age_text
from florence_bt.core.topic_names import JOY, MANUAL_CMD_VEL, OVERRIDE_STATE
from florence_bt.ros.conversions import twist_to_ros
from florence_bt.ros.qos import COMMAND, RELIABLE
from florence_bt.ros.robot_state import BATTERY, HELD, MOTION, OVERRIDE

FRAME_S = 0.1
"""Seconds between two pictures."""
STOP_RUN_S = 1.0
"""Seconds that the mission server gets to stop its run with our reason; the override stops it in any case."""
BY = "florence teleop"
REASON = f"{BY}: a person drives by hand"
LET_GO = "somebody has stopped the robot: let go, and begin anew"


class TakenBack(FlorenceError):
    """Somebody else ended the manual override, or the base's driver has gone."""


def drive_with_keys(console: Console, parameters: TeleopParameters) -> None:
    """Drive by the keys of the terminal until Ctrl-C, or until the terminal is closed.

    Raises:
        ConfigError: There is no terminal.
        FlorenceError: The robot could not be taken or given back, or somebody else took it.
    """
    if not in_front():
        raise ConfigError(
            "the keys come from a terminal, and this is not one (or not in its foreground)",
            valid=["florence teleop in a terminal", "florence teleop --joy with a gamepad"],
        )
    hand = Keys(parameters)
    with MissionClient("florence_teleop") as client, Keyboard() as keyboard:

        def read() -> bool:
            for key in keyboard.read(None, 0.0):
                hand.press(key, time.monotonic())
            return not keyboard.closed

        stop = f"it stops {parameters.timeout:g} s after the last key: keep one pressed to drive on"
        _Teleop(client, hand, console, [*KEYS, stop], read).drive()


def drive_with_gamepad(console: Console, parameters: TeleopParameters, layout: GamepadLayout) -> None:
    """Drive by the topic ``joy`` until Ctrl-C.

    Raises:
        FlorenceError: The robot could not be taken or given back, or somebody else took it.
    """
    hand = Gamepad(parameters, layout)
    hold = f"hold button {layout.enable_button}" + (
        f", or {layout.turbo_button} for twice the speed" if layout.turbo_button >= 0 else ""
    )
    text = [
        f"  {hold}; axes {layout.axis_linear} and {layout.axis_angular} drive",
        "  Ctrl-C gives the robot back",
        f"it stops when the button is let go, and {parameters.timeout:g} s after the last message on joy",
    ]
    with MissionClient("florence_teleop") as client:
        client.node.create_subscription(
            Joy,
            JOY,
            lambda message: hand.take(message.axes, message.buttons, time.monotonic()),
            COMMAND,
            judge_stamps=False,
        )
        _Teleop(client, hand, console, text, lambda: True, lambda: _pad_problem(client, hand)).drive()


def _pad_problem(client: MissionClient, hand: Gamepad) -> str:
    if client.node.count_publishers(JOY) == 0:
        return f"nobody publishes {client.node.resolve_topic_name(JOY)}: ros2 run joy joy_node"
    return hand.problem


class _Teleop:
    """Takes what the hand wants to the base, and shows what the base says.

    Args:
        client: Talks to the system.
        hand: Who drives.
        console: Where to show it.
        help_lines: What the keys or the pad do.
        read: Reads keys; False when there will be no more.
        problem: Why the hand cannot drive.
    """

    def __init__(
        self,
        client: MissionClient,
        hand: Hand,
        console: Console,
        help_lines: list[str],
        read: Callable[[], bool],
        problem: Callable[[], str] = lambda: "",
    ) -> None:
        self._client = client
        self._hand = hand
        self._console = console
        self._help = help_lines
        self._read = read
        self._problem = problem
        self._stops = 0
        self._must_let_go = self._gone = False
        self._stopped: Stopped | None = None
        self._command_at = self._draw_at = 0.0
        self._told = ""
        node = client.node
        self._velocity = node.create_publisher(Twist, MANUAL_CMD_VEL, RELIABLE)
        state = client.robot
        self._override = state.listen(OVERRIDE, self._on_override)
        self._held, self._driven, self._battery = (state.listen(part) for part in (HELD, MOTION, BATTERY))
        self._whereabouts = Whereabouts(client)

    def drive(self) -> None:
        """Take the robot, drive it until Ctrl-C or the end of the keys, and give it back."""
        with once(), self._taken():
            shown = self._console.is_terminal and not self._console.is_dumb_terminal
            if shown:
                self._say("\n".join(self._help))
            live = Live(console=self._console, auto_refresh=False, transient=True) if shown else None
            with live or nullcontext():
                self._client.spin_until(
                    lambda: not self._read(), float("inf"), watch=lambda: self._step(live)
                )

    @contextmanager
    def _taken(self) -> Iterator[None]:
        """Hold the manual override; one that was on before is left on."""
        node = self._client.node
        if not self._client.wait_for(lambda: self._override.last is not None):
            raise SystemNotThere(
                f"no driver of a base says {node.resolve_topic_name(OVERRIDE_STATE)}; "
                f"is the system up? Start it with: {', or '.join(STARTS)}"
            )
        ours = not self._overridden
        if ours:
            self._stop_run()
            self._stopped = stop_the_robot(BY)
            self._client.spin_until(lambda: bool(self._overridden), ANSWER_BUDGET_S)
        self._must_let_go = False  # the stops until now are none of somebody else's
        try:
            self._say(
                "you have the robot (manual override)"
                if ours
                else "the manual override is on already: you drive, and it stays on afterwards"
            )
            yield
        finally:
            with ignored():
                self._velocity.publish(Twist())
                if ours:
                    self._give_back()

    def _stop_run(self) -> None:
        """Let a run end with our reason, if the mission server is quick; the override ends it otherwise."""
        self._client.spin_until(lambda: self._client.state.state in ACTIVE_STATES, HAND_PERIOD_S)
        if self._client.state.state not in ACTIVE_STATES:
            return
        answer = self._client.ask(StopMission, "florence_bt/stop", StopMission.Request(reason=REASON))
        self._client.spin_until(answer.done, STOP_RUN_S)

    def _give_back(self) -> None:
        if not self._overridden:
            return
        try:
            release_the_robot(BY, self._stopped)
        except StoppedAgain:
            self._say("somebody has stopped the robot meanwhile: the manual override stays on")
            return
        self._say("the robot is given back: missions may start again; what was stopped stays stopped")

    def _step(self, live: Live | None) -> None:
        """Send what is wanted, and draw; call it often."""
        now = time.monotonic()
        if not self._overridden:
            raise TakenBack("the manual override was released by somebody else: missions may drive the robot")
        wanted = self._hand.wanted(now)
        self._must_let_go = self._must_let_go and not wanted.is_zero()
        if self._must_let_go:
            wanted = STANDSTILL
        if now >= self._command_at + HAND_PERIOD_S:
            self._command_at = now
            self._velocity.publish(twist_to_ros(wanted))
        if now < self._draw_at + FRAME_S:
            return
        self._draw_at = now
        if self._client.node.count_publishers(OVERRIDE_STATE) == 0:
            self._gone = True
            raise TakenBack(
                "the base's driver is gone; the manual override stays on: florence release, once it is back"
            )
        situation = Situation(
            self._hand.speeds,
            wanted,
            self._driven.fresh,
            self._held.fresh or "",
            None if (battery := self._battery.fresh) is None else battery.charge,
            self._whereabouts.text(),
            LET_GO if self._must_let_go else self._problem() or self._silence(),
        )
        if live is not None:
            live.update(Group(*lines_of(situation)), refresh=True)
        elif (held := situation.problem or situation.stop_reason) != self._told:
            self._told = held
            self._say(held or "nothing holds the base")

    @property
    def _overridden(self) -> bool:
        """Tell whether the manual override is on, as the base's driver said last before it went."""
        return not self._gone and self._override.last is not None and self._override.last.on

    def _silence(self) -> str:
        """Say that the base's driver, which is there, tells nothing; empty while it does."""
        if self._override.freshness is Freshness.FRESH:
            return ""
        return f"the base's driver has said nothing for {age_text(self._override.age)}; does the base obey?"

    def _say(self, line: str) -> None:
        try:
            self._console.print(line, highlight=False, markup=False, soft_wrap=True)
        except OSError:  # the terminal was closed
            self._console.quiet = True

    def _on_override(self) -> None:
        message = self._override.last
        assert message is not None
        # A stop of somebody else takes the robot out of the hand, as it does in the base's driver.
        ours = self._stopped is not None and self._stops < message.stops <= self._stopped.stops
        self._must_let_go |= bool(message.on) and message.stops != self._stops and not ours
        self._stops = int(message.stops)
