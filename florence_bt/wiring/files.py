"""``florence check`` and ``florence draw``: mission files without a running system and without ROS."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.skills.locate.hotspots import load_hotspots
from florence_bt.trees import lint
from florence_bt.trees.declarations import collect_declarations
from florence_bt.trees.draw import FORMATS as DRAWINGS
from florence_bt.trees.draw import draw
from florence_bt.trees.findings import has_errors
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.report import FORMATS, summary


def check_files(files: Sequence[Path], hotspots: Path | None, form: str) -> tuple[str, bool]:
    """Check mission files and all files of mission folders.

    Args:
        files: Files and folders. Missions of one call may call each other and the built-in ones.
        hotspots: A hotspots file to check labels against, or None.
        form: ``text``, ``json`` or ``github``.

    Returns:
        The report, and whether there are errors.

    Raises:
        ConfigError: A path does not exist, or there is no such form.
    """
    if form not in FORMATS:
        raise ConfigError(f"there is no format {form!r}", valid=FORMATS)
    paths = [path for given in files for path in _mission_files(given)]
    labels = [spot.label for spot in load_hotspots(hotspots)] if hotspots else None
    findings = lint.check_files(paths, MissionLibrary.load(), collect_declarations(), labels)
    report = FORMATS[form](findings)
    if form == "text":
        head = f"{len(paths)} mission{'s' * (len(paths) != 1)} checked: {summary(findings)}"
        report = f"{report}\n{head}" if report else head
    return report, has_errors(findings)


def draw_mission(mission: str, out: Path | None, folders: Sequence[Path], *, expand: bool) -> str:
    """Draw a mission.

    Args:
        mission: A mission's name, or a mission file.
        out: The file to write; its ending chooses the form. None draws text.
        folders: More mission folders.
        expand: Whether to draw the trees of called missions too.

    Returns:
        The drawing.

    Raises:
        ConfigError: No such mission, no such form, or the file cannot be written.
    """
    ending = out.suffix.removeprefix(".") if out else "txt"
    if ending not in DRAWINGS:
        what = f"a {ending!r} file" if ending else "a file without an ending"
        raise ConfigError(f"cannot draw {what}", valid=[f".{each}" for each in DRAWINGS])
    library = MissionLibrary.load(folders)
    file = Path(mission)
    if file.suffix in (".yaml", ".yml") and file.exists():
        library.add_file(file)
        mission = file.stem
    drawing = draw(library.get(mission), ending, library, expand=expand)
    if out is not None:
        try:
            out.write_text(drawing, encoding="utf-8")
        except OSError as error:
            raise ConfigError(
                f"cannot be written: {error.strerror}", file=out, valid=["a file in a folder that exists"]
            ) from error
    return drawing


def _mission_files(given: Path) -> list[Path]:
    if given.is_dir():
        files = sorted(given.glob("*.yaml"))
        if not files:
            raise ConfigError(f"there is no mission file in {str(given)!r}", valid=["a folder with *.yaml"])
        return files
    if not given.exists():
        raise ConfigError(
            f"there is no file {str(given)!r}", valid=["a mission file", "a folder of mission files"]
        )
    return [given]
