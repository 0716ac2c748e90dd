"""The hot loops of the localisation. Plain arrays in and out; no state, no random numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Pose = tuple[float, float, float]
"""x, y in metres, yaw in radians."""
Frame = tuple[float, float, float]
"""The outer corner of cell [0, 0], x and y, and metres per cell."""
_BACK = 0.3
"""A beam that ends where the surface looks away from the robot, also one cell before its end, did not measure
that surface; cosine of the angle from which on it looks away."""


@njit(cache=True)
def _is_back(
    normals: NDArray[np.float32],
    x: float,
    y: float,
    along_x: float,
    along_y: float,
    length: float,
    resolution: float,
) -> bool:
    """Tell whether a beam from x, y, which ends in the map, ends on the back of a surface."""
    share = max(0.0, 1.0 - resolution / length)
    column = math.floor((x + share * along_x) / resolution)
    row = math.floor((y + share * along_y) / resolution)
    rows, columns, _ = normals.shape
    if not (0 <= row < rows and 0 <= column < columns):
        return False
    return normals[row, column, 0] * along_x + normals[row, column, 1] * along_y > _BACK * length


@njit(cache=True, fastmath=True)  # everything is finite, and the sum may be in any order: twice as fast
def weigh_particles(
    particles: NDArray[np.float64],
    points: NDArray[np.float64],
    cubes: NDArray[np.float32],
    normals: NDArray[np.float32],
    outside: float,
    origin_x: float,
    origin_y: float,
    resolution: float,
) -> NDArray[np.float64]:
    """Compute the likelihood of the scan at each particle: 1 + sum of pz^3.

    Args:
        particles: Shape (n, 3): x, y, yaw in the map frame.
        points: Shape (m, 2): beam ends in the base frame, metres.
        cubes: Shape (rows, columns): pz^3 of a beam that ends in the cell.
        normals: Shape (rows, columns, 2): where the nearest surface looks, length 1, or 0 when to both sides.
        outside: pz^3 of a beam that ends off the map, or on the back of a surface.
        origin_x: Outer corner of cell [0, 0].
        origin_y: Outer corner of cell [0, 0].
        resolution: Metres per cell.

    Source:
        REFERENCE 7.7.
    """
    # Everything in cells and in float32, and nothing in the inner loop that branches: three times faster.
    count = len(points)
    ends, shorter = np.empty((count, 2), np.float32), np.empty(count, np.float32)
    backs = np.empty(count, np.float32)
    for k in range(count):
        length = math.hypot(points[k, 0], points[k, 1])
        shorter[k] = max(0.0, 1.0 - resolution / length)
        backs[k] = _BACK * length / resolution
        ends[k, 0], ends[k, 1] = points[k, 0] / resolution, points[k, 1] / resolution
    none, zero = np.float32(outside), np.int32(0)
    last_row, last_column = np.int32(cubes.shape[0] - 1), np.int32(cubes.shape[1] - 1)
    weights = np.empty(len(particles))
    for i in range(len(particles)):
        c, s = np.float32(math.cos(particles[i, 2])), np.float32(math.sin(particles[i, 2]))
        u = np.float32((particles[i, 0] - origin_x) / resolution)
        v = np.float32((particles[i, 1] - origin_y) / resolution)
        total = np.float32(1.0)
        for k in range(count):
            along_u, along_v = c * ends[k, 0] - s * ends[k, 1], s * ends[k, 0] + c * ends[k, 1]
            end_u, end_v = u + along_u, v + along_v
            column = np.uintp(min(max(np.int32(end_u), zero), last_column))
            row = np.uintp(min(max(np.int32(end_v), zero), last_row))
            inside = (end_u >= zero) & (end_v >= zero) & (end_u < last_column + 1) & (end_v < last_row + 1)
            before_u, before_v = u + shorter[k] * along_u, v + shorter[k] * along_v
            before_column = np.uintp(min(max(np.int32(before_u), zero), last_column))
            before_row = np.uintp(min(max(np.int32(before_v), zero), last_row))
            normal = normals[before_row, before_column]
            met = inside & (normal[0] * along_u + normal[1] * along_v <= backs[k])
            total += none + np.float32(met) * (cubes[row, column] - none)
        weights[i] = total
    return weights


@njit(cache=True)
def resample_systematic(weights: NDArray[np.float64], start: float, count: int) -> NDArray[np.int64]:
    """Draw particles in proportion to their weights with one random number.

    Args:
        weights: Shape (n,), sum 1.
        start: A random number in [0, 1).
        count: How many to draw.

    Returns:
        Shape (count,), indices in rising order.

    Source:
        Probabilistic Robotics, table 4.4 (low variance sampler).
    """
    drawn = np.empty(count, np.int64)
    index, reached = 0, weights[0]
    for k in range(count):
        wanted = (start + k) / count
        while reached < wanted and index < len(weights) - 1:
            index += 1
            reached += weights[index]
        drawn[k] = index
    return drawn


@njit(cache=True)
def match_terms(
    pose: Pose,
    points: NDArray[np.float64],
    signed: NDArray[np.float32],
    normals: NDArray[np.float32],
    frame: Frame,
    scale: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, int]:
    """Compute the normal equations of a scan against the field, at a pose.

    Each beam end pulls towards the nearest surface with the weight 1 / (1 + (d / scale)^2)^2
    (Geman-McClure), so that what is not in the map hardly counts; not towards the back of a surface.

    Returns:
        The matrix (3, 3) and the vector (3,) of the weighted least squares problem, the sum of the weights'
        square roots, of which Geman-McClure's cost is the negative, and how many beam ends lie within
        ``scale`` of a surface.
    """
    rows, columns = signed.shape
    x, y, yaw = pose
    origin_x, origin_y, resolution = frame
    matrix, vector = np.zeros((3, 3)), np.zeros(3)
    c, s = math.cos(yaw), math.sin(yaw)
    total, near = 0.0, 0
    jacobian = np.empty(3)
    for k in range(len(points)):
        px, py = points[k, 0], points[k, 1]
        # Distances are kept at the cells' centres; between four centres they are interpolated.
        along_x, along_y = c * px - s * py, s * px + c * py
        u = (x + along_x - origin_x) / resolution - 0.5
        v = (y + along_y - origin_y) / resolution - 0.5
        column, row = math.floor(u), math.floor(v)
        if not (0 <= row < rows - 1 and 0 <= column < columns - 1):
            continue
        fu, fv = u - column, v - row
        d00, d01 = signed[row, column], signed[row, column + 1]
        d10, d11 = signed[row + 1, column], signed[row + 1, column + 1]
        distance = (1 - fv) * ((1 - fu) * d00 + fu * d01) + fv * ((1 - fu) * d10 + fu * d11)
        gx = ((1 - fv) * (d01 - d00) + fv * (d11 - d10)) / resolution
        gy = ((1 - fu) * (d10 - d00) + fu * (d11 - d01)) / resolution
        if _is_back(normals, x - origin_x, y - origin_y, along_x, along_y, math.hypot(px, py), resolution):
            continue
        weight = 1.0 / (1.0 + (distance / scale) ** 2) ** 2
        jacobian[0], jacobian[1] = gx, gy
        jacobian[2] = gy * along_x - gx * along_y
        for i in range(3):
            vector[i] += weight * jacobian[i] * distance
            for j in range(3):
                matrix[i, j] += weight * jacobian[i] * jacobian[j]
        total += math.sqrt(weight)
        if abs(distance) < scale:
            near += 1
    return matrix, vector, total, near


@njit(cache=True)
def _cost_of(
    pose: NDArray[np.float64],
    points: NDArray[np.float64],
    signed: NDArray[np.float32],
    normals: NDArray[np.float32],
    frame: Frame,
    belief: NDArray[np.float64],
    information: NDArray[np.floating[Any]],
    gain: float,
    scale: float,
) -> tuple[float, int]:
    """Tell how badly a pose fits a scan and a belief together, but for a constant; how many beam ends fit."""
    _, _, fit, near = match_terms((pose[0], pose[1], pose[2]), points, signed, normals, frame, scale)
    offset = pose - belief
    offset[2] = math.atan2(math.sin(offset[2]), math.cos(offset[2]))
    return float(offset @ information @ offset) - gain * scale**2 * fit, near


@njit(cache=True)
def gauss_newton(
    start: NDArray[np.float64],
    points: NDArray[np.float64],
    signed: NDArray[np.float32],
    normals: NDArray[np.float32],
    frame: Frame,
    belief: NDArray[np.float64],
    covariance: NDArray[np.float64],
    gain: float,
    sigma: float,
    steps: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Take Gauss-Newton steps from a pose to where a scan and the belief in that pose fit best.

    Args:
        start: Shape (3,): x, y, yaw where the steps begin.
        points: Shape (n, 2), beam ends in the base frame, metres.
        signed: As in :func:`match_terms`, with those that follow.
        normals: As there.
        frame: As there.
        belief: Shape (3,): x, y, yaw of the belief.
        covariance: Shape (3, 3), of the belief.
        gain: What a beam's squared distance in metres counts.
        sigma: Standard deviation of a beam end from the map's surface in metres.
        steps: Most steps to take.

    Returns:
        The pose (3,); its covariance (3, 3); how many beam ends lie near a surface there.
    """
    information = np.linalg.inv(covariance + 1e-8 * np.eye(3))
    here, matrix = start.copy(), information
    # A wider pull first, so that a belief a decimetre or two off is still caught, then a narrow one.
    for k in range(steps):
        scale = 3.0 * sigma * (2.0 / 3.0) ** (k / max(1, steps - 1))
        normal, vector, _, _ = match_terms((here[0], here[1], here[2]), points, signed, normals, frame, scale)
        offset = here - belief
        offset[2] = math.atan2(math.sin(offset[2]), math.cos(offset[2]))
        matrix = gain * normal + information
        step = np.linalg.solve(matrix, -(gain * vector + information @ offset))
        here = here + step
        if k > 0 and abs(step[0]) + abs(step[1]) < 1e-4 and abs(step[2]) < 1e-4:
            break
    # Gauss-Newton may end in a worse place than it began, where the wide pull led it past the right one.
    cost, near = _cost_of(here, points, signed, normals, frame, belief, information, gain, 2.0 * sigma)
    cost_before, near_before = _cost_of(
        start, points, signed, normals, frame, belief, information, gain, 2.0 * sigma
    )
    fitted = np.linalg.inv(matrix)
    return (start, fitted, near_before) if cost > cost_before else (here, fitted, near)


@njit(cache=True)
def score_blocks(
    blocks: NDArray[np.int32],
    beam_cells: NDArray[np.int32],
    table: NDArray[np.uint8],
    least: float,
) -> NDArray[np.float32]:
    """Score how well a scan fits at poses that are given in whole cells.

    Args:
        blocks: Shape (n, 3): row, column and number of the heading.
        beam_cells: Shape (h, m, 2): for each heading the beams' ends, in rows and columns from the robot.
        table: Shape (rows, columns), 0 to 255: how well a beam fits that ends in the cell.
        least: A score below this is not worked out to the end.

    Returns:
        Shape (n,): the mean over the beams, 0 to 1; 0 for less than ``least``.
    """
    rows, columns = table.shape
    count = beam_cells.shape[1]
    scores = np.zeros(len(blocks), np.float32)
    for i in range(len(blocks)):
        row, column, heading = blocks[i, 0], blocks[i, 1], blocks[i, 2]
        total, needed = 0, least * 255.0 * count
        for k in range(count):
            v, u = row + beam_cells[heading, k, 0], column + beam_cells[heading, k, 1]
            if 0 <= v < rows and 0 <= u < columns:
                total += table[v, u]
            if total + 255.0 * (count - 1 - k) < needed:
                break
        if total >= needed:
            scores[i] = total / (255.0 * count)
    return scores


@njit(cache=True)
def contradicted_part(
    pose: Pose,
    points: NDArray[np.float64],
    signed: NDArray[np.float32],
    frame: Frame,
    near: float,
    beyond: float,
) -> float:
    """Return the part of a scan's beams that, seen from a pose, went through a wall of the map.

    A beam that is too short has met something that is not in the map. One that is too long contradicts it.

    Args:
        pose: Of the base in the map frame.
        points: Shape (n, 2), beam ends in the base frame, metres.
        signed: Shape (rows, columns), metres, below zero in what is solid.
        frame: Of the grid.
        near: A beam that ends so near to a surface has met it, metres.
        beyond: It went through what is further before its end, metres.
    """
    rows, columns = signed.shape
    x, y, yaw = pose
    origin_x, origin_y, resolution = frame
    c, s = math.cos(yaw), math.sin(yaw)
    through = 0
    for k in range(len(points)):
        along_x, along_y = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
        column = math.floor((x + along_x - origin_x) / resolution)
        row = math.floor((y + along_y - origin_y) / resolution)
        if 0 <= row < rows and 0 <= column < columns and abs(signed[row, column]) <= near:
            continue
        length = math.hypot(along_x, along_y)
        for step in range(max(0, int((length - beyond) / resolution))):
            share = step * resolution / length
            column = math.floor((x + share * along_x - origin_x) / resolution)
            row = math.floor((y + share * along_y - origin_y) / resolution)
            if 0 <= row < rows and 0 <= column < columns and signed[row, column] < 0.0:
                through += 1
                break
    return through / max(1, len(points))


@njit(cache=True)
def draw_distances(
    distances: NDArray[np.float32],
    points: NDArray[np.float64],
    pose: Pose,
    frame: Frame,
    far: float,
    gap: float,
) -> None:
    """Draw a scan into a grid of distances to the nearest surface.

    Args:
        distances: Shape (rows, columns), metres; made smaller where the scan's surfaces are nearer.
        points: Shape (n, 2), beam ends in the base frame, metres, in the order of the beams.
        pose: Of the base in the grid's frame.
        frame: Of the grid.
        far: How far around a surface is drawn, metres.
        gap: Two neighbouring beams that end nearer to each other have met one surface, metres.
    """
    rows, columns = distances.shape
    x, y, yaw = pose
    origin_x, origin_y, resolution = frame
    c, s = math.cos(yaw), math.sin(yaw)
    reach = int(far / resolution)
    last_u, last_v, last = 0.0, 0.0, False
    for k in range(len(points)):
        u = (x + c * points[k, 0] - s * points[k, 1] - origin_x) / resolution - 0.5
        v = (y + s * points[k, 0] + c * points[k, 1] - origin_y) / resolution - 0.5
        pieces = 1
        if last:
            apart = math.hypot(u - last_u, v - last_v)
            if apart * resolution <= gap:
                pieces = max(1, math.ceil(apart))
        for piece in range(1, pieces + 1):
            share = piece / pieces
            at_u = u if piece == pieces else last_u + share * (u - last_u)
            at_v = v if piece == pieces else last_v + share * (v - last_v)
            column, row = round(at_u), round(at_v)
            if not (reach <= row < rows - reach and reach <= column < columns - reach):
                continue
            for i in range(row - reach, row + reach + 1):
                line, away = distances[i, column - reach : column + reach + 1], (i - at_v) ** 2
                for j in range(2 * reach + 1):
                    distance = np.float32(resolution * math.sqrt(away + (column - reach + j - at_u) ** 2))
                    line[j] = min(line[j], distance)
        last_u, last_v, last = u, v, True


@njit(cache=True)
def _fit_of(
    distances: NDArray[np.float32],
    us: NDArray[np.float64],
    vs: NDArray[np.float64],
    du: float,
    dv: float,
    near: float,
) -> float:
    """Score how well beam ends (columns and rows, shape (n,)) fit when shifted by some cells, 0 to 1."""
    rows, columns = distances.shape
    total = 0.0
    for k in range(len(us)):
        column, row = math.floor(us[k] + du), math.floor(vs[k] + dv)
        if 0 <= row < rows and 0 <= column < columns:
            total += max(0.0, 1.0 - abs(distances[row, column]) / near)
    return total / len(us)


@njit(cache=True)
def best_pose(
    distances: NDArray[np.float32],
    points: NDArray[np.float64],
    centre: Pose,
    frame: Frame,
    step: float,
    steps: int,
    turn_step: float,
    turns: int,
    near: float,
    cost_d: float,
    cost_a: float,
) -> Pose:
    """Return the pose around another one at which a scan fits best.

    Args:
        distances: Shape (rows, columns), metres to the nearest surface, below zero inside of it.
        points: Shape (n, 2), beam ends in the base frame, metres.
        centre: The middle of the search, in the grid's frame.
        frame: Of the grid.
        step: From place to place, metres.
        steps: This many to each side.
        turn_step: From heading to heading, radians.
        turns: This many to each side.
        near: A beam fits the less the farther from a surface it ends, and not at all from here on, metres.
        cost_d: How much more of the scan has to fit at a place, per squared metre from the middle.
        cost_a: The same per squared radian.
    """
    x, y, yaw = centre
    origin_x, origin_y, resolution = frame
    best_score, best = -1e9, centre
    us, vs = np.empty(len(points)), np.empty(len(points))
    for h in range(-turns, turns + 1):
        turned = yaw + h * turn_step
        c, s = math.cos(turned), math.sin(turned)
        for k in range(len(points)):
            us[k] = (c * points[k, 0] - s * points[k, 1] + x - origin_x) / resolution
            vs[k] = (s * points[k, 0] + c * points[k, 1] + y - origin_y) / resolution
        for i in range(-steps, steps + 1):
            for j in range(-steps, steps + 1):
                cost = cost_d * step * step * (i * i + j * j) + cost_a * (h * turn_step) ** 2
                if i * i + j * j > steps * steps or 1.0 - cost <= best_score:
                    continue
                du, dv = j * step / resolution, i * step / resolution
                score = _fit_of(distances, us, vs, du, dv, near) - cost
                if score > best_score:
                    best_score, best = score, (x + j * step, y + i * step, turned)
    return best


@njit(cache=True)
def scores_around(
    distances: NDArray[np.float32],
    points: NDArray[np.float64],
    centre: Pose,
    frame: Frame,
    step: float,
    steps: int,
    near: float,
) -> NDArray[np.float64]:
    """Score how well a scan fits at the places around a pose, with its heading.

    Args:
        distances: As in :func:`best_pose`, with those that follow.
        points: As there.
        centre: As there.
        frame: As there.
        step: From place to place, metres.
        steps: This many to each side.
        near: As there.

    Returns:
        Shape (2 steps + 1, 2 steps + 1), 0 to 1, along y and x.
    """
    x, y, yaw = centre
    origin_x, origin_y, resolution = frame
    c, s = math.cos(yaw), math.sin(yaw)
    us, vs = np.empty(len(points)), np.empty(len(points))
    for k in range(len(points)):
        us[k] = (c * points[k, 0] - s * points[k, 1] + x - origin_x) / resolution
        vs[k] = (s * points[k, 0] + c * points[k, 1] + y - origin_y) / resolution
    scores = np.empty((2 * steps + 1, 2 * steps + 1))
    for i in range(-steps, steps + 1):
        for j in range(-steps, steps + 1):
            du, dv = j * step / resolution, i * step / resolution
            scores[i + steps, j + steps] = _fit_of(distances, us, vs, du, dv, near)
    return scores
