"""Persistent ids: people are recognised by their colours after they were lost."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from florence_bt.skills.people.user_tracker.appearance import Histogram, blend, histogram_distance
from florence_bt.skills.people.user_tracker.parameters import TrackerParameters


@dataclass(slots=True)
class _Known:
    histogram: Histogram | None
    seen: float


class Gallery:
    """The people that were seen in the last hour, by persistent id.

    Source: REFERENCE 12.9; document, section 4.1.2.
    """

    def __init__(self, parameters: TrackerParameters | None = None) -> None:
        self._use = parameters or TrackerParameters()
        self._known: dict[int, _Known] = {}
        self._next_id = 1

    def identify(self, histogram: Histogram | None, now: float, present: Collection[int]) -> int:
        """The persistent id of somebody who was just confirmed.

        Args:
            histogram: The colours, None when they are not known: such a person is always a new one.
            now: Seconds.
            present: The ids of the people who are there already; nobody is there twice.
        """
        self._known = {
            key: each for key, each in self._known.items() if now - each.seen <= self._use.remember_s
        }
        best, best_distance = None, self._use.match_distance
        for user_id, known in self._known.items():
            if histogram is None or known.histogram is None or user_id in present:
                continue
            distance = histogram_distance(histogram, known.histogram)
            if distance < best_distance:
                best, best_distance = user_id, distance
        if best is None:
            best = self._add(histogram, now, present)
        self._known[best].seen = now
        return best

    def observe(self, user_id: int, histogram: Histogram | None, now: float) -> None:
        """Take the colours of somebody who is tracked, as a running average."""
        known = self._known.setdefault(user_id, _Known(None, now))
        known.seen = now
        if histogram is not None:
            old = known.histogram
            known.histogram = histogram if old is None else blend(old, histogram, self._use.blend)

    def _add(self, histogram: Histogram | None, now: float, present: Collection[int]) -> int:
        """Remember somebody new; when there are too many the one not seen for longest makes room."""
        absent = [key for key in self._known if key not in present]
        if len(self._known) >= self._use.remembered_people and absent:
            del self._known[min(absent, key=lambda key: self._known[key].seen)]
        user_id = self._next_id
        self._next_id += 1
        self._known[user_id] = _Known(histogram, now)
        return user_id
