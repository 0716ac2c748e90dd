"""``florence hotspot list``: the hotspots and zones of a file, as a table or as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Sequence
from typing import Any

from florence_bt.core.geometry import degrees_text
from florence_bt.core.polygons import area
from florence_bt.skills.locator.hotspots import Hotspots


def as_json(hotspots: Hotspots) -> str:
    """Write the hotspots and zones as a JSON object; metres, degrees, m/s."""
    spots: list[dict[str, Any]] = [
        {
            "label": spot.label,
            "kind": spot.kind,
            "x": spot.pose.x,
            "y": spot.pose.y,
            "yaw_deg": round(math.degrees(spot.pose.yaw), 3),
            "polygon": spot.polygon,
        }
        for spot in hotspots
    ]
    zones = [
        {
            "label": zone.label,
            "kind": zone.kind,
            "polygon": zone.polygon,
            "speed_limit": zone.limit_text or None,
        }
        for zone in hotspots.zones
    ]
    return json.dumps({"hotspots": spots, "zones": zones}, indent=1, ensure_ascii=False)


def as_table(hotspots: Hotspots) -> str:
    """Write the hotspots and zones for people."""
    spots = [
        (
            spot.label,
            spot.kind,
            f"{spot.pose.x:.2f}",
            f"{spot.pose.y:.2f}",
            degrees_text(spot.pose.yaw),
            f"{area(spot.polygon):.1f} m²" if spot.polygon else "",
        )
        for spot in hotspots
    ]
    zones = [
        (
            zone.label,
            zone.kind,
            f"{area(zone.polygon):.1f} m²",
            f"at most {zone.limit_text}" if zone.limit_text else "",
        )
        for zone in hotspots.zones
    ]
    tables = [_table(("hotspot", "kind", "x", "y", "yaw", "area"), spots, right=range(2, 6))] if spots else []
    tables += [_table(("zone", "kind", "area", ""), zones, right=(2,))] if zones else []
    return "\n\n".join(tables) or "no hotspots"


def _table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]], right: Collection[int]) -> str:
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    lines = (
        "  ".join(
            text.rjust(width) if number in right else text.ljust(width)
            for number, (text, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in (head, *rows)
    )
    return "\n".join(lines)
