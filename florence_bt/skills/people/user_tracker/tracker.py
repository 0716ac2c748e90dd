"""Follows people from picture to picture and gives them ids, as OpenNI's user generator did."""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import TrackedUser
from florence_bt.skills.people.user_tracker.appearance import distance_if_known
from florence_bt.skills.people.user_tracker.camera_view import CameraView
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.evidence import Candidate, Verdict
from florence_bt.skills.people.user_tracker.identity import Gallery
from florence_bt.skills.people.user_tracker.leg_tracker import LegTracker
from florence_bt.skills.people.user_tracker.lying_body import FLOOR_HEIGHT, LyingBodies
from florence_bt.skills.people.user_tracker.parameters import TrackerParameters
from florence_bt.skills.people.user_tracker.rejected_places import RejectedPlaces
from florence_bt.skills.people.user_tracker.returning import contradict, is_doubtful, reach
from florence_bt.skills.people.user_tracker.track import LOST_DISTANCE, Track


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
        self._tracks: list[Track] = []
        self._legs = LegTracker()
        self._next_device_id = 1
        self._last = -math.inf
        self.running = False
        """Pictures are wanted."""

    def start(self) -> None:
        """Begin with no people and device ids from 1. The colours of people known before are kept, and the
        places where none was.
        """
        self.stop()
        self.running = True

    def stop(self) -> None:
        """Forget everybody who is tracked. Harmless when stopped already."""
        self.running = False
        self._tracks = []
        self._legs = LegTracker()
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
            track.predict(now)
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
            Track(each, now, self._params, next(self._numbers), self._waits_s, self._resting)
            for each in credible
            if id(each) not in matched_detections
        ]
        self._tracks = [track for track in self._tracks if self._is_kept(track, now)]
        if view is not None:
            self._rejected.looked(now, view, detections)
        self._identify(now)
        return tuple(track.as_user() for track in self._confirmed())

    def saw_scan(self, now: float, unmapped: NDArray[np.float64], robot: Pose2) -> tuple[TrackedUser, ...]:
        """Go on with the legs of those whom the camera does not see at the moment.

        Args:
            now: The time of the scan, seconds.
            unmapped: Where beams end at nothing of the map, in the order of the scan, shape (n, 2), metres,
                in the frame of the tracker.
            robot: The robot in that frame.

        Returns:
            Those whose legs were seen, with the distance 0 when the camera has lost them.
        """
        if not self.running:
            return ()
        return tuple(track.as_user() for track in self._legs.saw(now, unmapped, robot, self._confirmed()))

    @property
    def undecided(self) -> bool:
        """Tell whether the last image showed somebody who is not confirmed yet, and may be."""
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

    def _unconfirmed(self) -> list[Track]:
        """Return those in the last image who are not confirmed."""
        return [track for track in self._tracks if not track.device_id and track.hits[-1]]

    def _confirmed(self) -> list[Track]:
        return sorted((track for track in self._tracks if track.device_id), key=lambda track: track.device_id)

    def _assign(self, detections: Sequence[Detection]) -> list[tuple[Track, Detection]]:
        """Pair tracks and detections: first those who are followed, then those who were lost."""
        followed = [track for track in self._tracks if track.followed]
        lost = [track for track in self._tracks if not track.followed]
        pairs = _cheapest(followed, detections, self._following_cost)
        taken = {id(detection) for _, detection in pairs}
        left = [each for each in detections if id(each) not in taken]
        return pairs + _cheapest(lost, left, self._return_cost)

    def _following_cost(self, track: Track, detection: Detection) -> float:
        """Return twice the negative log-likelihood, up to a constant; infinite beyond the gate."""
        position = np.array([detection.x, detection.y])
        distance = track.filter.mahalanobis_squared(position, self._params.position_sigma)
        away = math.dist(position, track.place)
        if distance > self._params.gate or away > reach(track.predicted - track.noticed, self._params):
            return math.inf
        if is_doubtful(track.last, detection.confidence, away, self._params):
            return math.inf
        spread = math.log(np.linalg.det(track.filter.innovation_covariance(self._params.position_sigma)))
        return distance + spread + self._colour_cost(track, detection)

    def _return_cost(self, track: Track, detection: Detection) -> float:
        """Return the cost for somebody seen again where they were seen last, or expected; else infinite."""
        user, seen = track.last.user, track.looks[-1]
        away = min(math.dist((detection.x, detection.y), (at.x, at.y)) for at in (user, seen))
        if away > self._params.return_margin or contradict(user, detection, self._params.height_tolerance):
            return math.inf
        if is_doubtful(track.last, detection.confidence, away, self._params):
            return math.inf
        return (away / self._params.return_margin) ** 2 + self._colour_cost(track, detection)

    def _colour_cost(self, track: Track, detection: Detection) -> float:
        """Return the squared distance of the colours in standard deviations; 1 when it is not known."""
        apart = distance_if_known(track.histogram, detection.histogram)
        if apart is None:
            return 1.0
        return math.inf if apart >= self._params.differ_distance else (apart / self._params.colour_sigma) ** 2

    def _is_kept(self, track: Track, now: float) -> bool:
        if track.device_id:
            return now - track.noticed <= self._params.forget_s
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
                last = track.last
                if track.has_walked:
                    self._rejected.forget(track.came.user.x, track.came.user.y)
                else:
                    self._rejected.seen(now, last.user.x, last.user.y, track.looks[-1].confidence)
                self._gallery.observe(track.user_id, track.histogram, now, last)
        self._drop_doubles(now)

    def _present(self, now: float) -> list[int]:
        """Return the persistent ids of those who are in the last image."""
        return [track.user_id for track in self._tracks if track.device_id and track.seen == now]

    def _may_be_new(self, track: Track) -> bool:
        """Tell whether a track without an id shows a person for sure."""
        sure = any(each.confidence >= self._params.sure for each in track.looks)
        return sure and not track.device_id and not track.denied

    def _is_rejected(self, track: Track) -> bool:
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
    tracks: Sequence[Track],
    detections: Sequence[Detection],
    cost_of: Callable[[Track, Detection], float],
) -> list[tuple[Track, Detection]]:
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


def on_the_floor(users: Iterable[TrackedUser]) -> bool:
    """Tell whether one of the people who are seen lies on the floor."""
    return any(
        user.posture == "lying" and user.height < FLOOR_HEIGHT and user.distance > LOST_DISTANCE
        for user in users
    )


ZERO_RADIUS = 0.5
"""Metres; the minimum range of the Kinect."""
FARTHEST_USER, OLDEST_S = 4.5, 0.5
"""Metres and seconds; whoever is farther away, or was seen longer ago, is dropped (REFERENCE 12.9)."""


def filter_users(
    users: Sequence[TrackedUser],
    ages_s: Mapping[int, float] | None = None,
    *,
    zero_radius: float = ZERO_RADIUS,
    farthest: float = FARTHEST_USER,
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
