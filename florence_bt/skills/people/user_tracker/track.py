"""One person as they are followed from picture to picture, and beside the picture by their legs."""

from __future__ import annotations

import math
import statistics
from collections import deque
from dataclasses import replace

import numpy as np

from florence_bt.core.geometry import Point2
from florence_bt.core.sensing import Posture, TrackedUser
from florence_bt.skills.people.user_tracker._kalman import ConstantVelocity
from florence_bt.skills.people.user_tracker.appearance import Histogram, blend
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.evidence import Verdict
from florence_bt.skills.people.user_tracker.lying_body import LyingBodies, LyingBody
from florence_bt.skills.people.user_tracker.parameters import TrackerParameters
from florence_bt.skills.people.user_tracker.returning import Sighting

LOST_DISTANCE = 0.0
"""Distance that is published for a lost person, below the range of the Kinect (document, section 4.2.3)."""


class Track:
    """One person, or what may become one.

    Args:
        detection: How it was seen first.
        now: When, seconds.
        params: How people are followed.
        number: Of the track.
        waits_s: It waits this long for the verifier, seconds.
        resting: Where people lie.

    Attributes:
        seen: When the camera saw it last, seconds.
        noticed: When the camera or the laser did.
        place: Where that was, metres.
        lost: Whether the camera has not seen it for a while.
        surest: The greatest confidence with which the camera has seen it.
        followed: Whether it is where it should be, as neither of them has missed it for long.
    """

    def __init__(
        self,
        detection: Detection,
        now: float,
        params: TrackerParameters,
        number: int,
        waits_s: float,
        resting: LyingBodies,
    ) -> None:
        self._params = params
        self.number = number
        self.verdicts = self._rejections = 0
        self._agreed = False
        self._wait_until = now + waits_s
        self.filter = self._filter_at((detection.x, detection.y))
        self.hits: deque[bool] = deque([True], maxlen=params.confirm_window)
        self.device_id = 0
        self.user_id = 0
        self.has_colours = False
        self.distance = detection.distance
        self.surest = detection.confidence
        self.histogram: Histogram | None = detection.histogram
        self.looks = deque([detection], maxlen=params.posture_window)
        self._resting = resting
        self._lies_at: LyingBody | None = None
        self._lie(detection, now)
        self.seen = self.noticed = self.predicted = now
        self.place: Point2 = (detection.x, detection.y)
        self.lost, self.followed = False, True
        self._first = now, detection

    def predict(self, now: float) -> None:
        """Move on to a moment; who was not noticed for long stays where they were."""
        self.lost = self.lost or now - self.seen > self._params.coast_s
        if now - self.noticed > self._params.coast_s:
            self.followed = False
            self.filter.halt()
        else:
            self.filter.predict(max(0.0, now - self.predicted))
        self.predicted = max(self.predicted, now)

    def expected(self, now: float) -> Point2:
        """Return where they should be at a moment, metres, without moving on to it."""
        x, y, vx, vy = (float(value) for value in self.filter.state)
        passed = min(self._params.coast_s, max(0.0, now - self.predicted))
        return x + vx * passed, y + vy * passed

    def take(self, detection: Detection, now: float) -> None:
        """Take over where the camera saw the person."""
        self._notice((detection.x, detection.y), self._params.position_sigma, now)
        self.hits.append(True)
        self.looks.append(detection)
        self.surest = max(self.surest, detection.confidence)
        self._lie(detection, now)
        self.distance, self.seen, self.lost = detection.distance, now, False
        if detection.histogram is not None:
            old = self.histogram
            self.histogram = detection.histogram if old is None else blend(old, detection.histogram, 0.3)

    def take_legs(self, place: Point2, now: float) -> None:
        """Take over where the laser saw their legs, metres."""
        self.filter.predict(max(0.0, now - self.predicted))
        self.predicted = max(self.predicted, now)
        self._notice(place, self._params.legs_sigma, now)

    def _notice(self, place: Point2, sigma: float, now: float) -> None:
        if not self.followed:
            self.filter = self._filter_at(place)
        self.filter.update(np.array(place), sigma)
        self.place, self.noticed, self.followed = place, now, True

    def _lie(self, detection: Detection, now: float) -> None:
        if detection.posture == "lying":
            self._lies_at = self._resting.near(detection, now)
            self._lies_at.take(detection)

    def take_verdict(self, verdict: Verdict, now: float) -> None:
        """Take what the verifier says; once a person, always a person."""
        self.verdicts += 1
        self._agreed = self._agreed or verdict is Verdict.PERSON
        self._rejections += verdict is Verdict.NOBODY
        self._wait_until = now + (self._params.verdict_s if verdict is Verdict.NOBODY else 0.0)

    @property
    def denied(self) -> bool:
        """Tell whether the verifier has looked often enough and never seen a person, nor has it walked."""
        return not self._agreed and self._rejections >= self._params.rejections and not self.has_walked

    def is_a_person(self, now: float) -> bool:
        """Tell whether it was seen often enough, and the verifier is not against it."""
        hits = sum(self.hits)
        if self._agreed:
            return hits >= self._params.agreed_hits
        may_be = self.has_walked or (now >= self._wait_until and not self.denied)
        return hits >= self._params.confirm_hits and may_be

    @property
    def has_walked(self) -> bool:
        """Tell whether it has gone so far that it is no thing."""
        first = self._first[1]
        return math.dist((first.x, first.y), self.filter.state[:2]) >= self._params.walked

    def _filter_at(self, place: Point2) -> ConstantVelocity:
        return ConstantVelocity(np.array(place), self._params.position_sigma, self._params.acceleration)

    def as_user(self) -> TrackedUser:
        """Return what is published of it."""
        x, y, vx, vy = (float(value) for value in self.filter.state)
        distance = LOST_DISTANCE if self.lost else self.distance
        posture = self._posture()
        if posture == "lying" and self._lies_at is not None and self._lies_at.place is not None:
            (x, y), vx, vy = self._lies_at.place, 0.0, 0.0
        height = statistics.median([each.height for each in self.looks if each.height] or [0.0])
        sure = self.looks[-1].confidence
        return TrackedUser(self.user_id, self.device_id, x, y, distance, posture, height, vx, vy, sure)

    def _posture(self) -> Posture:
        """Return the posture that most of the last looks tell."""
        told = [each.posture for each in self.looks if each.posture != "unknown"]
        return statistics.mode(told) if told else "unknown"

    @property
    def last(self) -> Sighting:
        """Return when and from where the camera saw it last, with where it should be by now."""
        return Sighting(self.seen, replace(self.as_user(), distance=self.distance), self.surest)

    @property
    def came(self) -> Sighting:
        """Return where and when it was seen first, with what is known by now."""
        time, detection = self._first
        return Sighting(time, replace(self.as_user(), x=detection.x, y=detection.y), self.surest)
