"""Generates homes: a seed becomes the entries of a flat's source file, always the same ones.

The plan comes from :mod:`layout`, what stands in the rooms from ``maps/furniture.yaml``. Pieces are put where
chance says, and taken back when something is there already, or when the robot would not get everywhere any
more: through every door, to every hotspot.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy  # its parts load at their first use
import yaml
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.simulation.home.catalogue import Catalogue, Group, PieceKind, load_catalogue
from florence_bt.simulation.home.flat import Flat, FlatFile, PartEntry, Solid, build_flat, load_flat
from florence_bt.simulation.home.free_space import ROBOT_HEIGHT_M, BoolGrid, GridFrame, cells_covered
from florence_bt.simulation.home.layout import WALL_THICKNESS_M, Area, Layout, door_spots, plan_home
from florence_bt.simulation.home.map_world import flat_of_map, is_map
from florence_bt.simulation.home.people import ROBOT_ROOM_M

_RESOLUTION_M = 0.05
_PLANS, _TRIES, _MOVE_TRIES = 40, 80, 10
_MOVED_CHANCE, _CORNER_CHANCE = 0.6, 0.35
_HOTSPOT_FREE_M, _TURN_FREE_M, _DISTANCE_COST = 0.6, 0.32, 0.1
"""Metres around a hotspot that are as good as more, that it must have, and that a metre towards the middle of
the room is worth."""
_BEFORE_M = 0.5
_WALL_GAP_M = 0.02
_DOOR_FREE_M = 0.7
"""Nothing stands nearer to the middle of a door."""


def generate_home(seed: int) -> FlatFile:
    """Generate the entries of a home.

    Args:
        seed: Chooses everything.

    Returns:
        What :func:`~florence_bt.simulation.home.flat.build_flat` makes the home from. On its map, and in it
        while all doors are open, a round robot of ``ROBOT_ROOM_M`` gets from the start to every hotspot.

    Raises:
        FlorenceError: No plan can be furnished so; another seed helps.
    """
    for attempt in range(_PLANS):
        rng = np.random.default_rng((seed, attempt))
        layout = plan_home(rng)
        entries = _furnished(f"home_{seed}", layout, rng)
        if entries is not None:
            return FlatFile.model_validate(entries)
    raise FlorenceError(f"no home can be made from the seed {seed}; take another one")


def generated_flat(seed: int) -> Flat:
    """Generate the home of a seed; see :func:`generate_home`."""
    return build_flat(generate_home(seed))


@functools.lru_cache(maxsize=8)
def choose_flat(world: Path | None = None, seed: int | None = None) -> Flat:
    """Choose the flat: from a file, generated from a seed, or the one that comes with Florence.

    A file may also be a map of map_server: its walls, and nothing else.

    Raises:
        ConfigError: The file is wrong, with file:line:column, or both are given.
    """
    if world is not None and seed is not None:
        raise ConfigError("a home is either read or generated", valid=["--world FILE", "--world-seed SEED"])
    if seed is not None and seed < 0:
        raise ConfigError(f"the seed of a home cannot be {seed}", valid=["0 or a positive whole number"])
    if world is not None and is_map(world):
        return flat_of_map(world)
    return load_flat(world) if seed is None else generated_flat(seed)


def source_text(entries: FlatFile) -> str:
    """Write the entries as the text of a source file, to be read by ``load_flat`` and edited by hand."""
    values = entries.model_dump(by_alias=True, exclude_defaults=True, mode="json")
    return yaml.safe_dump(values, sort_keys=False, default_flow_style=None, width=110)


@dataclass(frozen=True, slots=True)
class _Furniture:
    """A piece as it stands: its entry, and the cells that it covers on the floor and up to the ceiling."""

    entry: dict[str, Any]
    moves: float
    touchable: BoolGrid
    covered: BoolGrid


class _Furnisher:
    """Keeps track of what stands where while a home fills."""

    def __init__(self, layout: Layout, walls: Flat, rng: np.random.Generator) -> None:
        self.catalogue: Catalogue = load_catalogue()
        self.frame = GridFrame.around(walls, _RESOLUTION_M, margin=0.25)
        self.pieces: list[_Furniture] = []
        self.objects: dict[str, Pose2] = {}
        """Hotspots before pieces, by label; not all can be reached."""
        self._layout = layout
        self._rng = rng
        self._used: dict[str, int] = {}
        closed = {door.name for door in walls.doors if door.closed} & {
            name for *_, name in door_spots(layout)
        }
        now = (solid for solid in walls.solids if solid.name not in closed)
        standing = (solid for solid in (*now, *walls.mapped) if solid.bottom < ROBOT_HEIGHT_M)
        self._walls = cells_covered(self.frame, standing, 0.05)
        self._kept_free = np.zeros_like(self._walls)
        self._stops: list[tuple[float, float]] = []
        for first, second, _ in door_spots(layout):
            self._stops += [first, second]
        for door in walls.doors:
            self.keep_free(door.x, door.y, _DOOR_FREE_M)

    def keep_free(self, x: float, y: float, radius: float) -> None:
        """Let nothing stand around a point."""
        self._kept_free |= cells_covered(self.frame, [_disc(x, y, radius)])

    def add_stop(self, x: float, y: float) -> None:
        """Keep a point reachable, with room to turn on it."""
        self._stops.append((x, y))
        self.keep_free(x, y, 0.4)

    def clearance(self, blocked: BoolGrid | None = None) -> NDArray[np.float64]:
        """Return the metres from each cell to what can be touched, shape (rows, columns)."""
        free = ~(self._blocked() if blocked is None else blocked)
        distance: NDArray[np.float64] = scipy.ndimage.distance_transform_edt(free)
        return distance * _RESOLUTION_M - _RESOLUTION_M / 2

    def reachable(self, clearance: NDArray[np.float64]) -> BoolGrid | None:
        """Return where the robot gets to from the doors and hotspots; None if these are not connected."""
        labels, _ = scipy.ndimage.label(clearance >= ROBOT_ROOM_M)
        found = {int(labels[self.frame.cell_of(*stop)]) for stop in self._stops}
        return labels == found.pop() if len(found) == 1 and 0 not in found else None

    def furnish(self, room: str, *, on_map: bool) -> None:
        """Put into a room what fits of what belongs there."""
        kind = room.removesuffix("_2")
        for furnishing in self.catalogue.rooms[kind]:
            group = self.catalogue.groups[furnishing.group]
            if group.on_map is on_map:
                for _ in range(int(self._rng.integers(furnishing.count[0], furnishing.count[1] + 1))):
                    self._place_group(self._layout.rooms[room], group)

    def move_some(self) -> None:
        """Move chairs to where somebody left them; the map does not know."""
        for index, piece in enumerate(self.pieces):
            if not piece.moves or self._rng.random() >= _MOVED_CHANCE:
                continue
            nothing = np.zeros_like(self._walls)
            self.pieces[index] = _Furniture(piece.entry, 0.0, nothing, nothing)
            moved = next(filter(None, (self._moved(piece) for _ in range(_MOVE_TRIES))), None)
            self.pieces[index] = moved or piece

    def _blocked(self) -> BoolGrid:
        return np.logical_or.reduce([self._walls, *(piece.touchable for piece in self.pieces)])

    def _taken(self) -> BoolGrid:
        covered = (piece.covered for piece in self.pieces)
        return np.logical_or.reduce([self._walls, self._kept_free, *covered])

    def _moved(self, piece: _Furniture) -> _Furniture | None:
        old, reach = piece.entry, piece.moves
        dx, dy = self._rng.uniform(-reach, reach, 2).round(2)
        turn = round(float(old["turn_deg"] + self._rng.uniform(-60.0, 60.0)))
        was = {"x": old["x"], "y": old["y"], "phi_deg": old["turn_deg"]}
        x, y = round(old["x"] + float(dx), 3), round(old["y"] + float(dy), 3)
        if any(
            area.contains(old["x"], old["y"]) != area.contains(x, y) for area in self._layout.rooms.values()
        ):
            return None
        moved = self._piece(old | {"x": x, "y": y, "turn_deg": turn, "moved_from": was})
        return moved if self._fits(moved, self._taken(), self._blocked()) else None

    def _place_group(self, area: Area, group: Group) -> None:
        """Try some places for the main piece; leave the group out when none is good."""
        taken, blocked = self._taken(), self._blocked()
        for _ in range(_TRIES):
            look = self._look(group)
            parts = self.catalogue.models[look["model"]]
            main = self._pose(area, group, parts)
            piece = self._piece(look | _standing(main, Pose2()), group)
            front = cells_covered(self.frame, [_front(main, parts, group.front)]) if group.front else None
            if self._fits(piece, taken, blocked, front):
                self._add(piece, on_map=group.on_map)
                self._place_companions(area, main, group)
                if front is not None:
                    self._kept_free |= front
                if group.hotspot:
                    self.objects.setdefault(group.hotspot, _before(main, parts))
                return

    def _place_companions(self, area: Area, main: Pose2, group: Group) -> None:
        """Put beside the main piece what fits of what belongs to it."""
        for kind in group.companions:
            if self._rng.random() < kind.chance:
                own = Pose2(kind.x, kind.y, math.radians(kind.turn_deg))
                piece = self._piece(self._look(kind) | _standing(main, own), kind)
                inside = area.contains(piece.entry["x"], piece.entry["y"])
                if inside and self._fits(piece, self._taken(), self._blocked()):
                    self._add(piece, on_map=group.on_map)

    def _add(self, piece: _Furniture, *, on_map: bool) -> None:
        model = piece.entry["model"]
        self._used[model] = number = self._used.get(model, 0) + 1
        piece.entry["name"] = model if number == 1 else f"{model}_{number}"
        if not on_map:
            piece.entry["on_map"] = False
        self.pieces.append(piece)

    def _look(self, kind: PieceKind) -> dict[str, Any]:
        colours = self.catalogue.colours_of(kind)
        return {
            "name": "",
            "model": kind.models[int(self._rng.integers(len(kind.models)))],
            "colour": colours[int(self._rng.integers(len(colours)))],
        }

    def _pose(self, area: Area, group: Group, parts: Sequence[PartEntry]) -> Pose2:
        """Choose a pose in a room; against a wall often in the corner, as people put their things."""
        rng = self._rng
        quarter = int(rng.integers(4))
        yaw = float(rng.uniform(-math.pi, math.pi)) if group.stands == "any" else quarter * math.pi / 2
        spans = [area.x, area.y]
        if group.stands == "wall":
            across = 1 - quarter % 2
            half = (
                max(abs(part.at[1]) + _half(part)[1] for part in parts) + WALL_THICKNESS_M / 2 + _WALL_GAP_M
            )
            low, high = spans[across][0] + half, spans[across][1] - half
            spans[across] = (
                (low, high) if rng.random() > _CORNER_CHANCE else ((low, low), (high, high))[quarter // 2]
            )
            back = WALL_THICKNESS_M / 2 + _WALL_GAP_M - min(part.at[0] - _half(part)[0] for part in parts)
            low, high = spans[1 - across]
            spans[1 - across] = (low + back, low + back) if quarter < 2 else (high - back, high - back)
        x, y = (low + float(rng.random()) * (high - low) for low, high in spans)
        return Pose2(round(x, 2), round(y, 2), math.radians(round(math.degrees(yaw))))

    def _piece(self, entry: dict[str, Any], kind: PieceKind | None = None) -> _Furniture:
        pose = Pose2(entry["x"], entry["y"], math.radians(entry["turn_deg"]))
        solids = [_solid(pose, part) for part in self.catalogue.models[entry["model"]]]
        low = [solid for solid in solids if solid.bottom < ROBOT_HEIGHT_M]
        covered, touchable = (cells_covered(self.frame, some, 0.05) for some in (solids, low))
        return _Furniture(entry, kind.moves if kind else 0.0, touchable, covered)

    def _fits(
        self, piece: _Furniture, taken: BoolGrid, blocked: BoolGrid, front: BoolGrid | None = None
    ) -> bool:
        """Tell whether nothing is where a piece stands, and the robot still gets everywhere."""
        if (piece.covered & taken).any() or (front is not None and (front & blocked).any()):
            return False
        return self.reachable(self.clearance(blocked | piece.touchable)) is not None


def _furnished(name: str, layout: Layout, rng: np.random.Generator) -> dict[str, Any] | None:
    """Return the entries of a furnished plan; None when the robot cannot get everywhere."""
    rooms = {
        label: {"x": list(area.x), "y": list(area.y), "hotspot": {"x": area.x[0], "y": area.y[0]}}
        for label, area in layout.rooms.items()
    }
    entries: dict[str, Any] = {
        "name": name,
        "start": {"x": 0.0, "y": 0.0},
        "floor": ("#b79a76", "#a58a68", "#c4b59a", "#8f7a60")[int(rng.integers(4))],
        "walls": {
            "height": 2.5,
            "thickness": WALL_THICKNESS_M,
            "colour": ("#ece6d8", "#e4e8e6", "#efe2d2", "#dfe3ea")[int(rng.integers(4))],
            "door_height": 2.0,
            "lines": layout.walls,
        },
        "rooms": rooms,
    }
    furnisher = _Furnisher(layout, build_flat(FlatFile.model_validate(entries)), rng)
    if furnisher.reachable(furnisher.clearance()) is None:
        return None  # open leaves of two doors are in each other's way
    for room in rooms:
        furnisher.furnish(room, on_map=True)
    spots: dict[str, Pose2] = {}
    for room, area in layout.rooms.items():
        spot = _roomy_spot(furnisher, area)
        if spot is None:
            return None
        furnisher.add_stop(spot.x, spot.y)
        spots[room], rooms[room]["hotspot"] = spot, _pose_entry(spot)
    hotspot = spots[layout.entrance]
    start = _far_spot(furnisher, layout.rooms[layout.entrance], hotspot)
    entries["start"] = _pose_entry(start)
    furnisher.add_stop(entries["start"]["x"], entries["start"]["y"])
    before_pieces = dict(_reached(furnisher))
    for pose in before_pieces.values():
        furnisher.add_stop(pose.x, pose.y)
    entries["hotspots"] = {label: _pose_entry(pose) for label, pose in before_pieces.items()}
    for room in rooms:
        furnisher.furnish(room, on_map=False)
    furnisher.move_some()
    entries["furniture"] = [piece.entry for piece in furnisher.pieces]
    used = {piece.entry["model"] for piece in furnisher.pieces}
    catalogue = furnisher.catalogue
    entries["models"] = {label: parts for label, parts in catalogue.models.items() if label in used}
    entries["places"] = {label: places for label, places in catalogue.places.items() if label in used}
    return entries


def _roomy_spot(furnisher: _Furnisher, area: Area) -> Pose2 | None:
    """Return the middle of a room as far as things leave room there, looking at the middle."""
    middle = (sum(area.x) / 2, sum(area.y) / 2)
    clearance, distance, inside = _spots(furnisher, area, middle)
    if not inside.any():
        return None
    score = np.where(inside, np.minimum(clearance, _HOTSPOT_FREE_M) - _DISTANCE_COST * distance, -np.inf)
    x, y = _point(furnisher, score)
    return Pose2(x, y, math.atan2(middle[1] - y, middle[0] - x))


def _far_spot(furnisher: _Furnisher, area: Area, hotspot: Pose2) -> Pose2:
    """Return the place that is furthest from a room's hotspot, to which it looks."""
    _, distance, inside = _spots(furnisher, area, (hotspot.x, hotspot.y))
    x, y = _point(furnisher, np.where(inside, distance, -np.inf))
    return Pose2(x, y, math.atan2(hotspot.y - y, hotspot.x - x))


def _spots(
    furnisher: _Furnisher, area: Area, centre: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64], BoolGrid]:
    """Return clearance, distance from a point, and where in a room the robot gets to and can turn."""
    clearance = furnisher.clearance()
    x, y = furnisher.frame.centres()
    (left, right), (low, high), edge = area.x, area.y, _TURN_FREE_M
    columns, rows = (x > left + edge) & (x < right - edge), (y > low + edge) & (y < high - edge)
    inside = columns[None, :] & rows[:, None]
    reachable = furnisher.reachable(clearance)
    inside &= (clearance >= _TURN_FREE_M) if reachable is None else reachable & (clearance >= _TURN_FREE_M)
    return clearance, np.hypot(x[None, :] - centre[0], y[:, None] - centre[1]), inside


def _point(furnisher: _Furnisher, score: NDArray[np.float64]) -> tuple[float, float]:
    """Return the middle of the best cell."""
    row, column = np.unravel_index(int(np.argmax(score)), score.shape)
    x, y = furnisher.frame.centres()
    return round(float(x[column]), 3), round(float(y[row]), 3)


def _reached(furnisher: _Furnisher) -> Iterator[tuple[str, Pose2]]:
    """Yield the hotspots before pieces that the robot gets to."""
    clearance = furnisher.clearance()
    reachable = furnisher.reachable(clearance)
    for label, pose in furnisher.objects.items():
        cell = furnisher.frame.cell_of(pose.x, pose.y)
        if reachable is not None and furnisher.frame.contains(*cell) and reachable[cell]:
            yield label, pose


def _pose_entry(pose: Pose2) -> dict[str, float]:
    return {"x": round(pose.x, 3), "y": round(pose.y, 3), "phi_deg": round(math.degrees(pose.yaw), 1)}


def _standing(main: Pose2, own: Pose2) -> dict[str, float]:
    """Return where a piece stands whose pose is given in the frame of another one."""
    x, y = main.apply(own.x, own.y)
    return {"x": round(x, 3), "y": round(y, 3), "turn_deg": round(math.degrees(main.yaw + own.yaw), 1)}


def _half(part: PartEntry) -> tuple[float, float]:
    """Return half of the sides of a part along x and y."""
    radius = part.cylinder or 0.0
    return (part.box[0] / 2, part.box[1] / 2) if part.box else (radius, radius)


def _solid(pose: Pose2, part: PartEntry) -> Solid:
    x, y = pose.apply(*part.at)
    half = _half(part) if part.box else None
    return Solid("", x, y, pose.yaw, half, part.cylinder or 0.0, *part.z, (0, 0, 0))


def _disc(x: float, y: float, radius: float) -> Solid:
    return Solid("", x, y, 0.0, None, radius, 0.0, 1.0, (0, 0, 0))


def _front(main: Pose2, parts: Sequence[PartEntry], depth: float) -> Solid:
    """Return the floor before a piece, as wide as the piece."""
    front = max(part.at[0] + _half(part)[0] for part in parts)
    width = max(abs(part.at[1]) + _half(part)[1] for part in parts)
    x, y = main.apply(front + depth / 2, 0.0)
    return Solid("", x, y, main.yaw, (depth / 2, width), 0.0, 0.0, 1.0, (0, 0, 0))


def _before(main: Pose2, parts: Sequence[PartEntry]) -> Pose2:
    """Return where the robot stands before a piece and looks at it."""
    x, y = main.apply(max(part.at[0] + _half(part)[0] for part in parts) + _BEFORE_M, 0.0)
    return Pose2(x, y, normalize_angle(main.yaw + math.pi))
