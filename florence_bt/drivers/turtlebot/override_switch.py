"""The manual override: who switches it, what the base makes of it, and who may end it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError
from florence_bt.core.ports import Delivery, Fields, Ports, Service, Topic
from florence_bt.core.topic_names import MANUAL_OVERRIDE, OVERRIDE_STATE, RELEASE_OVERRIDE, SWITCH_OVERRIDE
from florence_bt.drivers.turtlebot.override_file import OverrideFile

BEAT_S = 0.5
"""Seconds between two messages on the override's state: whoever shows it knows by their absence that it is
old."""
LATE_S = 1.0
"""A release that comes later than this after the person pressed is refused."""


class BaseWord(NamedTuple):
    """State of the base, for those who stop it.

    Attributes:
        standing: The wheels are commanded to stand still, and do, as its encoders say.
        driven_by_hand: A command by hand moves it.
        problem: Why no command reaches it; empty when it answers.
    """

    standing: bool
    driven_by_hand: bool
    problem: str


@dataclass(frozen=True, slots=True)
class OverrideState:
    """State of override and base, as ``florence_interfaces/ManualOverride`` has it; see there."""

    on: bool
    stops: int
    sent_at: float
    switched_on: float
    standing: bool
    driven_by_hand: bool
    problem: str


@dataclass(frozen=True, slots=True)
class ReleaseRequest:
    """The request of ``florence_interfaces/ReleaseOverride``; see there."""

    stops: int
    pressed_at: float
    by: str


FLAG = Topic(MANUAL_OVERRIDE, bool, Delivery.LATCHED)
STATE = Topic(OVERRIDE_STATE, OverrideState, Delivery.LATCHED, "florence_interfaces/msg/ManualOverride")
SWITCH = Topic(SWITCH_OVERRIDE, bool)
RELEASE = Service(RELEASE_OVERRIDE, "florence_interfaces/srv/ReleaseOverride", ReleaseRequest)


class OverrideSwitch:
    """Switches the manual override of a base, keeps it in a file, and says how it stands.

    Args:
        ports: Its connections.
        file: Keeps it over restarts.
        switch: Gives the base to a person (true) or back; the wheels have a zero when it returns.
        base: What the base says.

    Attributes:
        on: Whether the override is on.
    """

    def __init__(
        self,
        ports: Ports,
        file: OverrideFile,
        switch: Callable[[bool], None],
        base: Callable[[], BaseWord],
    ) -> None:
        self._ports = ports
        self._file = file
        self._switch = switch
        self._base = base
        self.on = file.is_on()
        self._stops = int(self.on)
        self._flag, self._state = ports.output(FLAG), ports.output(STATE)
        self._tell()
        ports.listen(SWITCH, self._take_switch)
        ports.serve(RELEASE, self._answer_release)
        self._beating = call_every(ports.steady, BEAT_S, self.tell_state)

    def close(self) -> None:
        """Tell nothing more."""
        self._beating.cancel()

    def tell_state(self) -> None:
        """Say how the override and the base stand now."""
        standing, by_hand, problem = self._base()
        self._state.send(
            OverrideState(
                on=self.on,
                stops=self._stops,
                sent_at=self._ports.steady.now(),
                switched_on=self._file.switched_on,
                standing=standing,
                driven_by_hand=by_hand,
                problem=problem,
            )
        )

    def _tell(self) -> None:
        self._flag.send(self.on)
        self.tell_state()

    def _take_switch(self, on: bool) -> None:
        if on:
            self.stop()
        elif self.on:
            self.release()
        else:
            self._tell()  # each message is answered: its sender, or a new subscriber, wants to know

    def stop(self) -> None:
        """Stop the wheels first, then tell the listeners, then the disk, then those who were absent."""
        news, self.on = not self.on, True
        self._stops += 1
        self._switch(True)
        self._tell()
        if news:
            self._ports.tell("manual override on: the base obeys manual_cmd_vel only", good=False)
            self._keep()
            self.tell_state()

    def release(self, by: str = "") -> None:
        """Give the base back."""
        self.on = False
        self._switch(False)
        self._tell()
        self._ports.tell(f"manual override off{by}: the base obeys velocity commands again", good=False)
        self._keep()

    def _keep(self) -> None:
        try:
            self._file.keep(self.on)
        except ConfigError as error:
            self._ports.tell(str(error), good=False)

    def _answer_release(self, request: ReleaseRequest) -> Fields:
        refusal = self._objection(request)
        if refusal:
            return {"success": False, "message": f"not released: {refusal}; look, then release it again"}
        if not self.on:
            return {"success": True, "message": "the manual override is off already"}
        self.release(f", by {request.by}" if request.by else "")
        return {"success": True, "message": "the manual override is off: missions may start again"}

    def _objection(self, request: ReleaseRequest) -> str:
        """Say why the override stays on, empty when it may end or has."""
        if self.on and request.stops != self._stops:
            return "somebody has stopped the robot since"
        late = self._ports.steady.now() - request.pressed_at
        return "this came too late" if self.on and not 0.0 <= late <= LATE_S else ""
