"""What a person presses: whether it still counts, and the two buttons that need no toolkit's session.

A browser and its proxies may hold a press for seconds. To stop is right whenever it arrives. Everything else
was meant for what the person saw: it says which beat of the live stream was on the screen and how long it had
been there, and counts for a second.
"""

from __future__ import annotations

import json
import math
import time
from dataclasses import dataclass
from typing import Any

from fastapi import FastAPI, HTTPException, Request

from florence_bt.app.page.access import ROLE, Role
from florence_bt.app.page.ros_thread import RosThread
from florence_bt.core.errors import FlorenceError

STOP, RELEASE = "/robot/stop", "/robot/release"
EXPIRY_S = 1.0
"""Wall seconds after the press in which anything but a stop must have arrived."""
ROUNDED_S = 0.01
"""By how much a press may seem to come before it was made: both numbers are rounded."""
LONGEST_ID = 64
LARGEST_PRESS = 1_000
"""Bytes of a press."""
LATE = "that press came too late, so nothing was done: look again, and press again"


def beat() -> float:
    """Return the number that frames of the live stream carry: steady seconds of this machine."""
    return round(time.monotonic(), 3)


@dataclass(frozen=True, slots=True)
class Press:
    """The moment at which somebody pressed.

    Attributes:
        beat: That of the newest frame that the browser had (:func:`beat`).
        age_s: Seconds from the frame's arrival to the press.
    """

    beat: float
    age_s: float

    @classmethod
    def read(cls, sent: Any) -> Press | None:
        """Read what a browser sent; None when that is no press."""
        beat, age = (sent.get("beat"), sent.get("age")) if isinstance(sent, dict) else (None, None)
        if not isinstance(beat, int | float) or not isinstance(age, int | float):
            return None
        return cls(float(beat), float(age)) if max(abs(beat), abs(age)) < 1e12 else None

    @classmethod
    def of_texts(cls, beat: str, age: str) -> Press:
        """Read the texts of a message on the live stream; what is no number never counts."""
        try:
            return cls(float(beat), float(age))
        except ValueError:
            return cls(math.nan, math.nan)

    def late_s(self, now: float) -> float:
        """Return how long ago it was, in seconds: at most so long, as the frame needed its time, too."""
        return max(0.0, now - self.beat - self.age_s)

    def counts(self, now: float) -> bool:
        """Tell whether it still counts."""
        return (
            self.age_s >= 0.0 and self.beat + self.age_s <= now + ROUNDED_S and self.late_s(now) <= EXPIRY_S
        )


def counts(sent: Any) -> bool:
    """Tell whether a press, as a browser sent it, counts now; what is no press does not."""
    press = Press.read(sent)
    return press is not None and press.counts(time.monotonic())


def add_presses(app: FastAPI, ros: RosThread) -> None:
    """Add the buttons that stop and release the robot to an application.

    ``POST /robot/stop`` takes ``{"id": "..."}`` and answers ``{"confirmed": true, "word": "..."}`` once the
    base's driver has counted that stop and the base stands; until then browsers ask again, with the same id.
    ``POST /robot/release`` takes ``{"beat": 1.0, "age": 0.1, "stops": 3}``: what was on the screen.

    Args:
        app: The application.
        ros: Talks to the robot.
    """

    @app.post(STOP)
    async def stop(request: Request) -> dict[str, Any]:
        caller, sent = await _read(request)
        press = sent.get("id")
        if not isinstance(press, str) or not 0 < len(press) <= LONGEST_ID:
            raise HTTPException(422, f"a stop has an id of 1 to {LONGEST_ID} characters")
        confirmed, word = await ros.stop(press, caller)
        return {"confirmed": confirmed, "word": word}

    @app.post(RELEASE)
    async def release(request: Request) -> dict[str, Any]:
        caller, sent = await _read(request)
        press, stops = Press.read(sent), sent.get("stops")
        if press is None or not isinstance(stops, int) or not 0 <= stops < 2**32:
            raise HTTPException(422, "a release has beat, age and stops")
        now = time.monotonic()
        if not press.counts(now):
            return {"done": False, "word": LATE}
        try:
            done, word = await ros.release(stops, press.late_s(now), caller)
        except FlorenceError as error:
            done, word = False, str(error)
        return {"done": done, "word": word}


async def _read(request: Request) -> tuple[str, dict[str, Any]]:
    """Return who presses, for the journal, and what was sent."""
    role = request.scope.get(ROLE, Role.LOOK)
    if role < Role.RUN:
        raise HTTPException(403, "this token may only look")
    body = b""
    async for piece in request.stream():
        body += piece
        if len(body) > LARGEST_PRESS:
            raise HTTPException(413, "a press is smaller")
    try:
        sent = json.loads(body)
    except ValueError as error:
        raise HTTPException(422, "a press is a JSON object") from error
    if not isinstance(sent, dict):
        raise HTTPException(422, "a press is a JSON object")
    return f"page ({role.name.lower()})", sent
