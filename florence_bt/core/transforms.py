"""Rigid transforms in space and a buffer of them over time (a small tf2)."""

from __future__ import annotations

import bisect
import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2, normalize_angle


class TransformUnavailable(FlorenceError):
    """Two frames are not connected, or not at the time asked for."""


class TransformTooOld(TransformUnavailable):
    """The time asked for is before everything that is known of a frame: waiting does not help."""


@dataclass(frozen=True, slots=True)
class Transform3:
    """A rigid transform; applied to points of the child frame it gives points of the parent frame.

    Attributes:
        rotation: Shape (3, 3).
        translation: Shape (3,), metres.
    """

    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]

    @staticmethod
    def identity() -> Transform3:
        """Return the transform that changes nothing."""
        return Transform3(np.eye(3), np.zeros(3))

    @staticmethod
    def from_xyz_rpy(xyz: Iterable[float], rpy: Iterable[float]) -> Transform3:
        """Make a transform from an offset and fixed-axis roll, pitch, yaw, as in URDF."""
        roll, pitch, yaw = rpy
        cr, sr = math.cos(roll), math.sin(roll)
        cp, sp = math.cos(pitch), math.sin(pitch)
        cy, sy = math.cos(yaw), math.sin(yaw)
        rotation = np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
        return Transform3(rotation, np.array(list(xyz), float))

    @staticmethod
    def from_quaternion(xyz: Iterable[float], quaternion: tuple[float, float, float, float]) -> Transform3:
        """Make a transform from an offset and a quaternion (x, y, z, w) of any length but zero."""
        x, y, z, w = np.array(quaternion, float) / math.sqrt(sum(q * q for q in quaternion))
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        return Transform3(rotation, np.array(list(xyz), float))

    @staticmethod
    def from_pose2(pose: Pose2) -> Transform3:
        """Make a transform from a motion in the plane z = 0."""
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        rotation = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
        return Transform3(rotation, np.array((pose.x, pose.y, 0.0), float))

    def quaternion(self) -> tuple[float, float, float, float]:
        """Return the rotation as a unit quaternion (x, y, z, w) with w >= 0."""
        m = self.rotation
        # The largest of the four squares keeps the division well conditioned (Shepperd's method).
        squares = np.array(
            [
                1 + m[0, 0] - m[1, 1] - m[2, 2],
                1 - m[0, 0] + m[1, 1] - m[2, 2],
                1 - m[0, 0] - m[1, 1] + m[2, 2],
                1 + m[0, 0] + m[1, 1] + m[2, 2],
            ]
        )
        best = int(np.argmax(squares))
        rows = np.array(
            [
                [squares[0], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
                [m[0, 1] + m[1, 0], squares[1], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
                [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], squares[2], m[1, 0] - m[0, 1]],
                [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], squares[3]],
            ]
        )
        q = rows[best] / np.linalg.norm(rows[best])
        q = -q if q[3] < 0 else q
        return float(q[0]), float(q[1]), float(q[2]), float(q[3])

    def __matmul__(self, other: Transform3) -> Transform3:
        """Compose: ``a_from_b @ b_from_c`` is a from c."""
        return Transform3(
            self.rotation @ other.rotation, self.rotation @ other.translation + self.translation
        )

    def inverse(self) -> Transform3:
        """Return the inverse transform."""
        return Transform3(self.rotation.T, -self.rotation.T @ self.translation)

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Take points of shape (..., 3) from the child to the parent frame."""
        return points @ self.rotation.T + self.translation

    def to_pose2(self) -> Pose2:
        """Return the part in the plane: x, y and the heading of the child's x axis."""
        return Pose2(
            float(self.translation[0]),
            float(self.translation[1]),
            math.atan2(self.rotation[1, 0], self.rotation[0, 0]),
        )


PARENT_KEPT_S = 1.0
"""For so long after its newest sample a moving frame keeps its parent (chosen: several times the period of
what publishes on /tf)."""


DETOUR_M, DETOUR_RAD = 0.04, math.radians(4.0)
"""Detour by a third sample that the motion from one sample to another may have. Chosen: at 0.5 m/s a frame
comes 2 cm far in 40 ms, and may have done so there and back."""


HISTORY_S = 10.0
"""For so long a moving frame can be looked up at a past moment, as in tf2."""


class TransformBuffer:
    """Remembers transforms between frames and answers for any pair and moment.

    Static transforms hold at every time. Moving ones are kept for ``keep`` seconds; between two samples the
    planar part is interpolated (everything that moves on this robot moves in the plane).

    A frame has one parent, and is static or moves. Where two publishers contradict each other, Florence's own
    transform wins for ever; of others, what moves wins over what is static, and the known parent over a
    second one.
    """

    def __init__(self, keep: float = HISTORY_S) -> None:
        self._keep = keep
        self._static: dict[str, tuple[str, Transform3]] = {}
        self._static_lookups: dict[tuple[str, str], Transform3] = {}
        self._moving: dict[str, tuple[str, deque[tuple[float, Pose2]]]] = {}
        self._own: set[str] = set()

    def set_static(self, parent: str, child: str, transform: Transform3, *, own: bool = False) -> str | None:
        """Set where a child frame always is.

        Args:
            parent: The parent frame.
            child: The child frame.
            transform: From the child to the parent.
            own: Whether it comes from a node of Florence.

        Returns:
            Which transform is not used, and why; None when nothing contradicts.
        """
        refused = None
        if own:
            refused = self._take_over(parent, child, self._static)
        else:
            problem = self._why_not_static(parent, child)
            if problem is not None:
                known = self._static.get(child)
                return None if known is not None and _same(known, (parent, transform)) else problem
        self._moving.pop(child, None)
        self._static[child] = (parent, transform)
        self._static_lookups.clear()
        return refused

    def set_moving(
        self, parent: str, child: str, stamp: float, pose: Pose2, *, own: bool = False
    ) -> str | None:
        """Set where a child frame was at a moment. Samples that come late are sorted in.

        Args:
            parent: The parent frame.
            child: The child frame.
            stamp: The moment, seconds.
            pose: Of the child in the parent.
            own: Whether it comes from a node of Florence.

        Returns:
            As :meth:`set_static`.
        """
        refused = None
        if own:
            refused = self._take_over(parent, child, self._moving)
        else:
            problem = self._why_not_moving(parent, child, stamp)
            if problem is not None:
                return problem
        if self._static.pop(child, None) is not None:
            self._static_lookups.clear()
            refused = f"the static transform of {child!r} is not used any more, because the frame moves"
        known = self._moving.get(child)
        if known is None or known[0] != parent:
            known = self._moving[child] = (parent, deque())
        _sort_in(known[1], stamp, pose, self._keep)
        return refused

    def agrees(self, parent: str, child: str, stamp: float, pose: Pose2) -> bool:
        """Tell whether a pose lies on the way between the samples before and after it.

        So does each sample that was lost, also when the frame jumped meanwhile. Outside of what the samples
        span nothing is known, and everything agrees.
        """
        known = self._moving.get(child)
        if known is None or known[0] != parent:
            return False
        samples = known[1]
        before = bisect.bisect_left(samples, stamp, key=lambda sample: sample[0]) - 1
        after = bisect.bisect_right(samples, stamp, key=lambda sample: sample[0])
        if before < 0 or after >= len(samples):
            return True
        one, other = samples[before][1], samples[after][1]
        detour = one.distance_to(pose) + pose.distance_to(other) - one.distance_to(other)
        turns = [abs(normalize_angle(b.yaw - a.yaw)) for a, b in ((one, pose), (pose, other), (one, other))]
        return detour <= DETOUR_M and turns[0] + turns[1] - turns[2] <= DETOUR_RAD

    def is_own(self, child: str) -> bool:
        """Tell whether a node of Florence publishes a frame."""
        return child in self._own

    def _take_over(self, parent: str, child: str, kind: Mapping[str, tuple[str, Any]]) -> str | None:
        """Make a frame one of Florence's own; what others said of it, or against it, is forgotten."""
        known = self._moving.get(child) or self._static.get(child)
        if child in self._own and known is not None and known[0] == parent:
            return None
        refused = None
        if known is not None and child not in self._own:
            # A message of our own comes twice, and the copy may be the first.
            a_copy = child in kind and known[0] == parent
            self._forget(child)
            if not a_copy:
                refused = _florences(known[0], child)
        self._own.add(child)
        above = self._line_above(parent)
        if child in above:
            for frame in above[: above.index(child)]:
                if frame not in self._own:
                    self._forget(frame)
                    refused = f"{frame!r} below its own child {child!r} is not used any more"
        return refused

    def _forget(self, child: str) -> None:
        self._moving.pop(child, None)
        self._static.pop(child, None)
        self._static_lookups.clear()

    def _why_not_static(self, parent: str, child: str) -> str | None:
        if child in self._own:
            return _florences(parent, child)
        if child in self._moving:
            return f"a static transform of {child!r}, which moves below {self._moving[child][0]!r}"
        known = self._static.get(child)
        if known is not None and known[0] != parent:
            return _second_parent(child, known[0], parent)
        return self._why_no_loop(parent, child) if known is None else None

    def _why_not_moving(self, parent: str, child: str, stamp: float) -> str | None:
        if child in self._own:
            return _florences(parent, child)
        known = self._moving.get(child)
        if known is not None and known[0] == parent:
            return None
        if known is not None and abs(stamp - known[1][-1][0]) < PARENT_KEPT_S:
            return _second_parent(child, known[0], parent)
        return self._why_no_loop(parent, child)

    def _why_no_loop(self, parent: str, child: str) -> str | None:
        if child in self._line_above(parent):
            return f"{child!r} below {parent!r}, which is below {child!r} itself: a loop of frames"
        return None

    def _line_above(self, frame: str) -> list[str]:
        """Return a frame, its parent, the parent of that, and so on."""
        line = [frame]
        while (link := self._static.get(line[-1]) or self._moving.get(line[-1])) is not None:
            if link[0] in line:
                break
            line.append(link[0])
        return line

    def clear_moving(self) -> None:
        """Forget every moving frame: the clock has jumped, and what was on its way may seem the newest."""
        self._moving.clear()

    def mounts(self) -> list[tuple[str, str, Transform3]]:
        """Return parent, child and transform of all frames that do not move."""
        return [(parent, child, transform) for child, (parent, transform) in self._static.items()]

    def latest_stamp(self, child: str) -> float | None:
        """Return the time of the newest sample of a moving frame, None when it was never seen."""
        known = self._moving.get(child)
        return known[1][-1][0] if known else None

    def frames(self) -> tuple[str, ...]:
        """Return the names of all child frames."""
        return tuple(sorted({*self._static, *self._moving}))

    def lookup(self, target: str, source: str, stamp: float | None = None) -> Transform3:
        """Return the transform that takes points of ``source`` to ``target``.

        Args:
            target: The frame to express points in.
            source: The frame the points are in.
            stamp: The moment in seconds; None takes the newest sample of every link.

        Raises:
            TransformTooOld: The moment is before the first sample of a moving link.
            TransformUnavailable: No chain of frames connects the two, or the moment is more than
                :data:`EXTRAPOLATION_LIMIT_S` after the last sample of a moving link.
        """
        known = self._static_lookups.get((target, source))
        if known is not None:
            return known
        # The way up to the target itself counts first: above it, somebody may have closed a loop.
        up_source = self._chain(source, stamp, target)
        if target in up_source:
            if all(frame in self._static for frame in up_source if frame != target):
                self._static_lookups[target, source] = up_source[target]
            return up_source[target]
        up_target = self._chain(target, stamp)
        for root, source_to_root in up_source.items():
            if root in up_target:
                return up_target[root].inverse() @ source_to_root
        raise TransformUnavailable(
            f"no transform from {source!r} to {target!r}; known frames: {', '.join(self.frames()) or 'none'}"
        )

    def newest_between(self, one: str, other: str) -> float | None:
        """Return the time up to which every moving link between two frames is known; None when none moves."""
        links = self._chain(one, None).keys() ^ self._chain(other, None).keys()
        return min((self._moving[frame][1][-1][0] for frame in links if frame in self._moving), default=None)

    def lookup_pose(self, target: str, source: str, stamp: float | None = None) -> Pose2:
        """Return the planar part of :meth:`lookup`."""
        return self.lookup(target, source, stamp).to_pose2()

    def _chain(self, frame: str, stamp: float | None, last: str | None = None) -> dict[str, Transform3]:
        """Return every ancestor of a frame with the transform to it, nearest first, up to ``last``."""
        chain, so_far = {frame: Transform3.identity()}, None
        here = frame
        while here != last:
            if here in self._static:
                parent, link = self._static[here]
            elif here in self._moving:
                parent, samples = self._moving[here]
                link = Transform3.from_pose2(_sample_at(samples, stamp, here))
            else:
                return chain
            if parent in chain:
                raise TransformUnavailable(f"the frames {parent!r} and {here!r} form a loop")
            so_far = link if so_far is None else link @ so_far
            chain[parent] = so_far
            here = parent
        return chain


EXTRAPOLATION_LIMIT_S = 0.05
"""For so long after its newest sample a frame counts as where it was then; tf2 has no such time. Chosen: a
little longer than the 0.04 s after which the base tells its next odometry at the latest. At 1 rad/s it is 3
degrees. A reading that is newer waits for the pose of its moment."""


def _florences(parent: str, child: str) -> str:
    return f"{child!r} below {parent!r}, while Florence itself publishes {child!r}"


def _second_parent(child: str, known: str, parent: str) -> str:
    return f"{parent!r} as a second parent of {child!r}, which is below {known!r}"


def _same(one: tuple[str, Transform3], other: tuple[str, Transform3]) -> bool:
    """Tell whether two static transforms say the same."""
    return (
        one[0] == other[0]
        and np.allclose(one[1].rotation, other[1].rotation)
        and np.allclose(one[1].translation, other[1].translation)
    )


def _sort_in(samples: deque[tuple[float, Pose2]], stamp: float, pose: Pose2, keep: float) -> None:
    """Add a sample in the order of time; forget those that are more than ``keep`` seconds older."""
    if samples and stamp == samples[-1][0]:
        samples[-1] = (stamp, pose)
    elif samples and stamp < samples[-1][0]:
        ordered = [sample for sample in samples if sample[0] != stamp] + [(stamp, pose)]
        ordered.sort(key=lambda sample: sample[0])
        samples.clear()
        samples.extend(ordered)
    else:
        samples.append((stamp, pose))
    while samples[-1][0] - samples[0][0] > keep:
        samples.popleft()


def _sample_at(samples: deque[tuple[float, Pose2]], stamp: float | None, frame: str) -> Pose2:
    if stamp is None or stamp == samples[-1][0]:
        return samples[-1][1]
    if stamp > samples[-1][0]:
        if stamp - samples[-1][0] > EXTRAPOLATION_LIMIT_S:
            raise TransformUnavailable(f"{frame!r} is {stamp - samples[-1][0]:.2f} s older than requested")
        return samples[-1][1]
    index = bisect.bisect_left(samples, stamp, key=lambda sample: sample[0])
    after_stamp, after = samples[index]
    if after_stamp == stamp:
        return after
    if index == 0:
        raise TransformTooOld(
            f"{frame!r} is known only from {samples[0][0]:.2f} s on, requested: {stamp:.2f} s"
        )
    before_stamp, before = samples[index - 1]
    part = (stamp - before_stamp) / (after_stamp - before_stamp)
    return Pose2(
        before.x + part * (after.x - before.x),
        before.y + part * (after.y - before.y),
        normalize_angle(before.yaw + part * normalize_angle(after.yaw - before.yaw)),
    )
