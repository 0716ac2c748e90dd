"""Follows people from picture to picture and gives them ids, as OpenNI's user generator did."""

from __future__ import annotations

import itertools
import math
import statistics
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from florence_bt.core.sensing import Posture, TrackedUser
from florence_bt.skills.people.user_tracker._kalman import ConstantVelocity
from florence_bt.skills.people.user_tracker.appearance import Histogram, blend, distance_if_known
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.evidence import Candidate, Verdict
from florence_bt.skills.people.user_tracker.identity import Gallery
from florence_bt.skills.people.user_tracker.lying_body import LyingBodies, LyingBody
from florence_bt.skills.people.user_tracker.parameters import TrackerParameters
from florence_bt.skills.people.user_tracker.rejected_places import CameraView, RejectedPlaces
from florence_bt.skills.people.user_tracker.returning import Sighting, contradict, reach

LOST_DISTANCE = 0.0
"""Distance that is published for a lost person, below the range of the Kinect (document, section 4.2.3)."""


class _Track:
    """One person, or what may become one.

    Args:
        detection: How it was seen first.
        now: When, seconds.
        params: How people are followed.
        number: Of the track.
        waits_s: It waits this long for the verifier, seconds.
        resting: Where people lie.
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
        self.filter = self._filter_at(detection)
        self.hits: deque[bool] = deque([True], maxlen=params.confirm_window)
        self.device_id = 0
        self.user_id = 0
        self.has_colours = False
        self.distance = detection.distance
        self.histogram: Histogram | None = detection.histogram
        self.looks = deque([detection], maxlen=params.posture_window)
        self._resting = resting
        self._lies_at: LyingBody | None = None
        self._lie(detection)
        self.seen = self.predicted = now
        self.lost = False
        self._first = now, detection

    def predict(self, now: float, coast_s: float) -> None:
        """Move on to a moment; a lost person stays where it was."""
        if not self.lost and now - self.seen > coast_s:
            self.lost = True
            self.filter.halt()
        if not self.lost:
            self.filter.predict(max(0.0, now - self.predicted))
        self.predicted = now

    def take(self, detection: Detection, now: float) -> None:
        """Take over where the person was seen."""
        if self.lost:
            self.filter = self._filter_at(detection)
        self.filter.update(np.array([detection.x, detection.y]), self._params.position_sigma)
        self.hits.append(True)
        self.looks.append(detection)
        self._lie(detection)
        self.distance, self.seen, self.lost = detection.distance, now, False
        if detection.histogram is not None:
            old = self.histogram
            self.histogram = detection.histogram if old is None else blend(old, detection.histogram, 0.3)

    def _lie(self, detection: Detection) -> None:
        if detection.posture == "lying":
            self._lies_at = self._resting.near(detection)
            self._lies_at.take(detection)

    def take_verdict(self, verdict: Verdict, now: float) -> None:
        """Take what the verifier says; once a person, always a person."""
        self.verdicts += 1
        self._agreed = self._agreed or verdict is Verdict.PERSON
        self._rejections += verdict is Verdict.NOBODY
        self._wait_until = now + (self._params.verdict_s if verdict is Verdict.NOBODY else 0.0)

    @property
    def denied(self) -> bool:
        """Whether the verifier has looked often enough and never seen a person, nor has it walked."""
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
        """Whether it has gone so far that it is no thing."""
        first = self._first[1]
        return math.dist((first.x, first.y), self.filter.state[:2]) >= self._params.walked

    def _filter_at(self, detection: Detection) -> ConstantVelocity:
        position = np.array([detection.x, detection.y])
        return ConstantVelocity(position, self._params.position_sigma, self._params.acceleration)

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
    def came(self) -> Sighting:
        """Where and when it was seen first, with what is known by now."""
        time, detection = self._first
        return Sighting(time, replace(self.as_user(), x=detection.x, y=detection.y))


class UserTracker:
    """Tracks people in a frame that does not jump (odom), each with a Kalman filter.

    A person is confirmed when it was seen in some of the last images. It then has a device id, counted
    from 1 at every start, and a persistent id by its colours, or by place and time. A lost person is
    published with the distance 0 for a while (a filter by the distance leaves only those who are there) and
    has its ids when it returns.

    Args:
        parameters: How people are followed.
        verifier: Whether there is a verifier besides the detector: candidates wait for its
            verdict (:meth:`candidates`, :meth:`take_verdict`). One that does not answer holds nobody up for
            long.

    Source:
        REFERENCE 9 and 12.9; document, sections 4.1.2 and 4.2.
    """

    def __init__(self, parameters: TrackerParameters | None = None, *, verifier: bool = False) -> None:
        self._params = parameters or TrackerParameters()
        self._waits_s = self._params.verdict_s if verifier else 0.0
        self._numbers = itertools.count()
        self._gallery = Gallery(self._params)
        self._rejected = RejectedPlaces(self._params)
        self._resting = LyingBodies()
        self._tracks: list[_Track] = []
        self._next_device_id = 1
        self._last = -math.inf
        self.running = False
        """Whether pictures are wanted."""

    def start(self, now: float) -> None:
        """Begin with no people and device ids from 1. The colours of people known before are kept, and the
        places where none was.
        """
        self.stop()
        self.running = True

    def stop(self) -> None:
        """Forget everybody who is tracked. Harmless when stopped already."""
        self.running = False
        self._tracks = []
        self._next_device_id = 1

    def update(
        self, now: float, detections: Sequence[Detection], view: CameraView | None = None
    ) -> tuple[TrackedUser, ...]:
        """Take what a picture shows.

        Args:
            now: The time of the picture, seconds.
            detections: The people in it, in the frame of the tracker.
            view: From where it was taken; without it no place is rejected.

        Returns:
            The confirmed people by device id, in the same frame; lost ones with the distance 0. Nobody when
            the tracker is stopped.
        """
        if not self.running:
            return ()
        self._last = now
        for track in self._tracks:
            track.predict(now, self._params.coast_s)
        credible = _credible(detections, self._params.sure)
        pairs = self._assign(credible)
        for track, detection in pairs:
            track.take(detection, now)
        matched_tracks = {id(track) for track, _ in pairs}
        matched_detections = {id(detection) for _, detection in pairs}
        for track in self._tracks:
            if id(track) not in matched_tracks:
                track.hits.append(False)
        self._tracks += [
            _Track(each, now, self._params, next(self._numbers), self._waits_s, self._resting)
            for each in credible
            if id(each) not in matched_detections
        ]
        self._tracks = [track for track in self._tracks if self._is_kept(track, now)]
        if view is not None:
            self._rejected.looked(now, view, detections)
        self._identify(now)
        return tuple(track.as_user() for track in self._confirmed())

    @property
    def undecided(self) -> bool:
        """Whether the last image showed somebody who is not confirmed yet, and may be."""
        return any(not track.denied and not self._is_rejected(track) for track in self._unconfirmed())

    @property
    def in_view(self) -> list[int]:
        """The persistent ids of those who are in the last image; the others are where they should be."""
        return self._present(self._last)

    def candidates(self, most: int) -> list[Candidate]:
        """Return those in the last image who are not confirmed, for the verifier to judge.

        Args:
            most: How many; those of whom the least was said come first.
        """
        asked = sorted(self._unconfirmed(), key=lambda track: track.verdicts)
        shown = [(track.number, track.looks[-1]) for track in asked]
        return [
            Candidate(number, look.region, look.posture) for number, look in shown if look.region is not None
        ][:most]

    def take_verdict(self, number: int, verdict: Verdict, now: float) -> None:
        """Take what the verifier says of a candidate; one that is gone by now does not matter.

        Args:
            number: Of the candidate.
            verdict: What it says.
            now: The time of the last image, seconds.
        """
        for track in self._tracks:
            if track.number == number:
                track.take_verdict(verdict, now)

    def _unconfirmed(self) -> list[_Track]:
        """Return those in the last image who are not confirmed."""
        return [track for track in self._tracks if not track.device_id and track.hits[-1]]

    def _confirmed(self) -> list[_Track]:
        return sorted((track for track in self._tracks if track.device_id), key=lambda track: track.device_id)

    def _assign(self, detections: Sequence[Detection]) -> list[tuple[_Track, Detection]]:
        """Pair tracks and detections: first those who are followed, then those who were lost."""
        followed = [track for track in self._tracks if not track.lost]
        lost = [track for track in self._tracks if track.lost]
        pairs = _cheapest(followed, detections, self._following_cost)
        taken = {id(detection) for _, detection in pairs}
        left = [each for each in detections if id(each) not in taken]
        return pairs + _cheapest(lost, left, self._return_cost)

    def _following_cost(self, track: _Track, detection: Detection) -> float:
        """Return twice the negative log-likelihood, up to a constant; infinite beyond the gate."""
        position, seen = np.array([detection.x, detection.y]), track.looks[-1]
        distance = track.filter.mahalanobis_squared(position, self._params.position_sigma)
        away = math.dist(position, (seen.x, seen.y))
        if distance > self._params.gate or away > reach(track.predicted - track.seen, self._params):
            return math.inf
        spread = math.log(np.linalg.det(track.filter.innovation_covariance(self._params.position_sigma)))
        return distance + spread + self._colour_cost(track, detection)

    def _return_cost(self, track: _Track, detection: Detection) -> float:
        """Return the cost for somebody seen again where they were seen last, or expected; else infinite."""
        user = replace(track.as_user(), distance=track.distance)
        seen = track.looks[-1]
        away = min(math.dist((detection.x, detection.y), (at.x, at.y)) for at in (user, seen))
        if away > self._params.return_margin or contradict(user, detection, self._params.height_tolerance):
            return math.inf
        return (away / self._params.return_margin) ** 2 + self._colour_cost(track, detection)

    def _colour_cost(self, track: _Track, detection: Detection) -> float:
        """Return the squared distance of the colours in standard deviations; 1 when it is not known."""
        apart = distance_if_known(track.histogram, detection.histogram)
        if apart is None:
            return 1.0
        return math.inf if apart >= self._params.differ_distance else (apart / self._params.colour_sigma) ** 2

    def _is_kept(self, track: _Track, now: float) -> bool:
        if track.device_id:
            return now - track.seen <= self._params.forget_s
        missed = len(track.hits) - sum(track.hits)
        return missed <= self._params.confirm_window - self._params.confirm_hits

    def _identify(self, now: float) -> None:
        """Give ids to who is confirmed now, and remember who is seen."""
        for track in self._tracks:
            if not track.device_id and track.is_a_person(now) and not self._is_rejected(track):
                present = self._present(now)
                others = [each.came for each in self._tracks if each is not track and self._may_be_new(each)]
                track.user_id = self._gallery.identify(track.histogram, now, present, track.came, others)
                track.device_id = self._next_device_id
                self._next_device_id += 1
                track.has_colours = track.histogram is not None
            if track.device_id and not track.has_colours and track.histogram is not None:
                track.has_colours = True
                present = self._present(now)
                track.user_id = self._gallery.recognise(
                    track.user_id, track.histogram, now, present, track.came
                )
            if track.device_id and track.seen == now:
                last = Sighting(now, track.as_user())
                if track.has_walked:
                    self._rejected.forget(track.came.user.x, track.came.user.y)
                else:
                    self._rejected.seen(now, last.user.x, last.user.y, track.looks[-1].confidence)
                self._gallery.observe(track.user_id, track.histogram, now, last)
        self._drop_doubles(now)

    def _present(self, now: float) -> list[int]:
        """Return the persistent ids of those who are in the last image."""
        return [track.user_id for track in self._tracks if track.device_id and track.seen == now]

    def _may_be_new(self, track: _Track) -> bool:
        """Tell whether a track without an id shows a person for sure."""
        sure = any(each.confidence >= self._params.sure for each in track.looks)
        return sure and not track.device_id and not track.denied

    def _is_rejected(self, track: _Track) -> bool:
        """Tell whether something else is known to stand where it was seen last."""
        sure = statistics.fmean(look.confidence for look in track.looks)
        return not track.has_walked and self._rejected.rejects(track.looks[-1], sure)

    def _drop_doubles(self, now: float) -> None:
        """Drop the track of somebody who was recognised elsewhere."""
        here = [track.user_id for track in self._tracks if track.device_id and track.seen == now]
        self._tracks = [track for track in self._tracks if track.seen == now or track.user_id not in here]


def _credible(detections: Sequence[Detection], sure: float) -> list[Detection]:
    """Return the detections without those that are probably nobody.

    Behind somebody the network often sees a second person, at the outline of the first. In simulated pictures
    of two people, three in four unsure detections with more than half of their columns behind somebody nearer
    were nobody, and one in sixteen of the other unsure ones.
    """
    regions = [(each.distance, each.region) for each in detections if each.region is not None]
    return [
        each
        for each in detections
        if each.confidence >= sure
        or each.region is None
        or all(
            near >= each.distance or each.region.share_of_columns(region) <= 0.5 for near, region in regions
        )
    ]


def _cheapest(
    tracks: Sequence[_Track],
    detections: Sequence[Detection],
    cost_of: Callable[[_Track, Detection], float],
) -> list[tuple[_Track, Detection]]:
    """Return as many pairs as there can be, with the smallest sum of costs; none of infinite cost."""
    if not tracks or not detections:
        return []
    cost = np.array([[cost_of(track, each) for each in detections] for track in tracks])
    rows, columns = linear_sum_assignment(np.where(np.isfinite(cost), cost, 1e6))
    return [
        (tracks[row], detections[column])
        for row, column in zip(rows, columns, strict=True)
        if np.isfinite(cost[row, column])
    ]


FLOOR_HEIGHT = 0.5
"""Metres; a person on the floor is nowhere higher than this; on a bed or a sofa they are."""


def on_the_floor(users: Iterable[TrackedUser]) -> bool:
    """Tell whether one of the people who are seen lies on the floor."""
    return any(
        user.posture == "lying" and user.height < FLOOR_HEIGHT and user.distance > LOST_DISTANCE
        for user in users
    )


ZERO_RADIUS = 0.5
"""Metres; the minimum range of the Kinect."""
FARTHEST = 4.5
OLDEST_S = 0.5


def filter_users(
    users: Sequence[TrackedUser],
    ages_s: Mapping[int, float] | None = None,
    *,
    zero_radius: float = ZERO_RADIUS,
    farthest: float = FARTHEST,
    oldest_s: float = OLDEST_S,
) -> tuple[TrackedUser, ...]:
    """Drop everybody who is not really there; the order stays.

    Args:
        users: The tracked people.
        ages_s: How old the position of a person is, by device id, seconds; 0 where it is not given.
        zero_radius: Nearer people are lost, metres.
        farthest: People further away are dropped, metres.
        oldest_s: People with an older position are dropped, seconds.

    Source:
        REFERENCE 12.9; document, section 4.2.
    """
    ages = ages_s or {}
    return tuple(
        user
        for user in users
        if math.isfinite(user.x)
        and math.isfinite(user.y)
        and zero_radius <= user.distance <= farthest
        and ages.get(user.device_id, 0.0) <= oldest_s
    )
