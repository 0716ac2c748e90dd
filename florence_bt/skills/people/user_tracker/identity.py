"""Persistent ids: people who were lost are recognised by their colours, or by place and time."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from florence_bt.skills.people.user_tracker.appearance import Histogram, blend, distance_if_known
from florence_bt.skills.people.user_tracker.parameters import TrackerParameters
from florence_bt.skills.people.user_tracker.returning import (
    Sighting,
    away,
    is_doubtful,
    may_return,
    walked_share,
)

NEARBY = 2.0
"""Distance, in ``return_margin``, of a recognition by place only, for people whose known colours are not
seen."""
TOO_FAR = 1.5
"""Whoever would have walked so many times as far as people do is somebody else in like clothes."""
CLEARLY = 2.0
"""The best candidate must be this much better than the next; otherwise it is somebody new."""


@dataclass(slots=True)
class _Known:
    histogram: Histogram | None
    seen: float
    last: Sighting | None = None
    pictures: int = 0


_BARELY_KNOWN = 10.0
"""Cost of a match with what was seen in a few pictures only, such as a reflection: more than any other's."""


class Gallery:
    """The people that were seen in the last hour, by persistent id.

    Source: REFERENCE 12.9; document, section 4.1.2.
    """

    def __init__(self, parameters: TrackerParameters | None = None) -> None:
        self._params = parameters or TrackerParameters()
        self._known: dict[int, _Known] = {}
        self._next_id = 1

    def identify(
        self,
        histogram: Histogram | None,
        now: float,
        present: Collection[int],
        came: Sighting | None = None,
        others: Sequence[Sighting] = (),
    ) -> int:
        """Return the persistent id of somebody who was just confirmed.

        Args:
            histogram: The colours, None when they are not known.
            now: Seconds.
            present: The ids of the people who are there already; nobody is there twice.
            came: How they were seen first; None when only the colours count.
            others: How others were seen first who have no id yet.
        """
        absent = self._absent(now, present)
        best = self._by_colours(absent, histogram, came)
        if best is None and came is not None:
            best = self._by_place(absent, histogram, came, others)
        if best is None:
            best = self._add(histogram, now, present)
        self._known[best].seen = now
        return best

    def recognise(
        self, user_id: int, histogram: Histogram | None, now: float, present: Collection[int], came: Sighting
    ) -> int:
        """Return the persistent id of somebody whose colours are seen now and were not when they got an id.

        Args:
            user_id: The id that they have.
            histogram: The colours.
            now: Seconds.
            present: The ids of the people who are there.
            came: How they were seen first.

        Returns:
            The id of somebody who has these colours and is known well; else that which they have.
        """
        known = self._known.get(user_id)  # None: forgotten for others
        apart = distance_if_known(histogram, known.histogram) if known is not None else None
        if apart is not None and apart < self._params.match_distance:
            return user_id
        best = self._by_colours(self._absent(now, present), histogram, came)
        known_well = best is not None and self._known[best].pictures >= self._params.known_pictures
        return best if best is not None and known_well else user_id

    def _absent(self, now: float, present: Collection[int]) -> dict[int, _Known]:
        """Return the people who are remembered but not there; forget those not seen for long."""
        self._known = {
            key: each for key, each in self._known.items() if now - each.seen <= self._params.remember_s
        }
        return {key: each for key, each in self._known.items() if key not in present}

    def observe(
        self, user_id: int, histogram: Histogram | None, now: float, last: Sighting | None = None
    ) -> None:
        """Take how somebody who is tracked is seen; the colours as a running average."""
        known = self._known.setdefault(user_id, _Known(None, now))
        known.seen, known.last = now, last
        known.pictures += 1
        if histogram is not None:
            old = known.histogram
            known.histogram = histogram if old is None else blend(old, histogram, self._params.blend)

    def _by_colours(
        self, absent: Mapping[int, _Known], histogram: Histogram | None, came: Sighting | None
    ) -> int | None:
        """Return who has these colours; of several in like shirts, the best known who walked least."""
        best, best_cost = None, math.inf
        for user_id, known in absent.items():
            distance = distance_if_known(histogram, known.histogram)
            if distance is None or distance >= self._params.match_distance:
                continue
            if known.last and came and came.time <= known.last.time:
                continue  # seen at the same time, so they are two
            if known.last and came and self._is_doubtful(known.last, came):
                continue
            walked = walked_share(known.last, came, self._params) if known.last and came else 0.0
            if walked > TOO_FAR:
                continue
            cost = distance / self._params.match_distance + walked
            if known.pictures < self._params.known_pictures:
                cost += _BARELY_KNOWN
            if cost < best_cost:
                best, best_cost = user_id, cost
        return best

    def _is_doubtful(self, last: Sighting, came: Sighting) -> bool:
        return is_doubtful(last, came.surest, away(last, came), self._params)

    def _by_place(
        self,
        absent: Mapping[int, _Known],
        histogram: Histogram | None,
        came: Sighting,
        others: Sequence[Sighting],
    ) -> int | None:
        """Return who was lost so near and lately that it must be them; nobody if it may be two people."""
        fitting: dict[int, Sighting] = {}
        for user_id, known in absent.items():
            distance = distance_if_known(histogram, known.histogram)
            if distance is not None and distance >= self._params.differ_distance:
                continue
            if known.last is None or not may_return(known.last, came, self._params):
                continue
            # A reflection, or somebody in grey, is not the one who has colours and was elsewhere.
            unseen = distance is None and known.histogram is not None
            if unseen and away(known.last, came) > NEARBY * self._params.return_margin:
                continue
            fitting[user_id] = known.last
        if not fitting:
            return None
        walked = {key: walked_share(lost, came, self._params) for key, lost in fitting.items()}
        best = min(walked, key=lambda key: walked[key])
        lost = fitting[best]
        rivals = [share for key, share in walked.items() if key != best]
        rivals += [
            walked_share(lost, other, self._params)
            for other in others
            if may_return(lost, other, self._params)
        ]
        return best if all(share >= CLEARLY * walked[best] for share in rivals) else None

    def _add(self, histogram: Histogram | None, now: float, present: Collection[int]) -> int:
        """Remember somebody new; when there are too many the one not seen for longest makes room."""
        absent = [key for key in self._known if key not in present]
        if len(self._known) >= self._params.remembered_people and absent:
            del self._known[min(absent, key=lambda key: self._known[key].seen)]
        user_id = self._next_id
        self._next_id += 1
        self._known[user_id] = _Known(histogram, now)
        return user_id
