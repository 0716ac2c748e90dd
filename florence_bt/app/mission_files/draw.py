"""``florence draw``: pictures of missions without a running system and without ROS."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path

from florence_bt.app.mission_files.mission_list import mission_name
from florence_bt.app.mission_files.output import write_output
from florence_bt.core.errors import ConfigError
from florence_bt.trees.drawings.draw import draw
from florence_bt.trees.language.loader import MissionLibrary

ENDINGS = {"svg": "svg", "txt": "txt", "mermaid": "mermaid", "mmd": "mermaid", "png": "svg"}
"""Ending of a file -> what is drawn; a PNG is made from the SVG."""
PNG_ZOOM = 2.0
"""Pixels of a PNG for each pixel of the SVG, so that it stays sharp on paper."""


def draw_mission(
    mission: str, out: Path | None, folders: Sequence[Path], *, expand: bool, width: int | None = None
) -> str:
    """Draw a mission.

    Args:
        mission: A mission's name, or a mission file.
        out: The file to write; its ending chooses the form. None draws text.
        folders: More mission folders.
        expand: Whether to draw the trees of called missions too.
        width: Widest a picture may be, in pixels.

    Returns:
        The drawing (of a PNG the SVG that it was made from).

    Raises:
        ConfigError: No such mission, no such form, or the file cannot be written.
    """
    ending = out.suffix.removeprefix(".") if out else "txt"
    if ending not in ENDINGS:
        what = f"a {ending!r} file" if ending else "a file without an ending"
        raise ConfigError(f"cannot draw {what}", valid=[f".{each}" for each in ENDINGS])
    library = MissionLibrary.load(folders)
    name = mission_name(mission, library)
    drawing = draw(library.get(name), ENDINGS[ending], library, expand=expand, width=width)
    if out is not None:
        write_output(out, png_of(drawing) if ending == "png" else drawing.encode())
    return drawing


def png_of(svg: str) -> bytes:
    """Convert an SVG to a PNG.

    Raises:
        ModuleNotFoundError: The package that does it is not installed.
    """
    from resvg_py import svg_to_bytes

    # A computer without fonts of its own may have those of matplotlib.
    matplotlib = importlib.util.find_spec("matplotlib")
    folder = (
        Path(matplotlib.origin).parent / "mpl-data" / "fonts" / "ttf"
        if matplotlib and matplotlib.origin
        else None
    )
    fonts = [str(folder)] if folder is not None and folder.is_dir() else None
    return bytes(svg_to_bytes(svg_string=svg, zoom=PNG_ZOOM, font_dirs=fonts, background="#ffffff"))
