"""What writes files that belong together, for :mod:`tests.dying`: into the folder that it is in."""

from __future__ import annotations

import shutil
from datetime import datetime
from pathlib import Path

import numpy as np
from florence_page.editor.shelf import Shelf
from typer.testing import CliRunner

from florence_bt.app.devices.config_edit import set_numbers
from florence_bt.app.maps.build import Built, write_built
from florence_bt.cli.application import app
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.localisation.saved_pose import save_pose
from florence_bt.skills.navigation.map_server.map_file import load_map
from florence_bt.skills.navigation.mapping.parameters import SlamParameters
from florence_bt.skills.navigation.mapping.slam import Slam
from tests.unit.app.recorded_drives import MOUNT, moments

ROOT = Path(__file__).parents[3]
MISSION = "mission: tea\ntree:\n  wait: {} s\n"
XML = """<root BTCPP_format="4">
<BehaviorTree ID="Main"><AlwaysSuccess/></BehaviorTree>
<BehaviorTree ID="Other"><SubTree ID="Main"/></BehaviorTree>
</root>"""


def make_home(folder: Path) -> None:
    """Make a folder with all that the functions change."""
    for name in ("maps", "hotspots"):
        (folder / name).mkdir()
    for name in ("maps/flat.yaml", "maps/flat.pgm", "hotspots/flat.yaml"):
        shutil.copy(ROOT / name, folder / name)
    save_pose(folder / "pose.json", Pose2(6.0, 3.0, 1.0), load_map(folder / "maps/flat.yaml"))
    (folder / "robot.yaml").write_text("turtlebot_node:\n  wheel_base: 0.26\n")
    shelf = Shelf(folder / "missions", date=lambda: datetime(2026, 11, 1))
    shelf.save("tea", MISSION.format(1), "")
    shelf.save_draft("tea", MISSION.format(2))
    (folder / "trees.xml").write_text(XML)


def _florence(*arguments: str) -> bool:
    done = CliRunner().invoke(app, arguments, catch_exceptions=False)
    return done.exit_code != 0


def crop() -> bool:
    """Crop a map."""
    return _florence("map", "crop", "maps/flat.yaml", "--box", "[[1, 1], [5, 4]]")


def rotate() -> bool:
    """Turn a map with its places and the pose of the robot."""
    belongings = ("--hotspots", "hotspots/flat.yaml", "--pose", "pose.json")
    return _florence("map", "rotate", "maps/flat.yaml", "--by", "25 deg", *belongings)


def undo() -> bool:
    """Take the last change of the map back."""
    return _florence("map", "crop", "maps/flat.yaml", "--undo")


def clean_to() -> bool:
    """Write a cleaned map under another name."""
    return _florence(
        "map", "clean", "maps/flat.yaml", "--out", "maps/new.yaml", "--hotspots", "hotspots/flat.yaml"
    )


def rooms() -> bool:
    """Propose rooms in place of those that are there."""
    return _florence("map", "rooms", "maps/flat.yaml", "--out", "hotspots/flat.yaml", "--overwrite")


def _built(steps: int) -> bool:
    slam = Slam(SlamParameters())
    for moment in moments(steps):
        slam.update(moment.scan, MOUNT, moment.odom)
    slam.settle()
    try:
        write_built(Built(slam, slam.grid(), steps, 1.0, 1.0, 1.0), Path("maps/home.yaml"))
    except ConfigError:
        return True
    return False


def build() -> bool:
    """Write a map with its drive."""
    return _built(4)


def build_again() -> bool:
    """Write a map in place of the one of :func:`build`."""
    return _built(8)


def add_hotspot() -> bool:
    """Add a hotspot."""
    return _florence("hotspot", "add", "shelf", "x=3", "y=3", "--hotspots", "hotspots/flat.yaml")


def name_rooms() -> bool:
    """Give the rooms that :func:`rooms` proposed their names."""
    return _florence("hotspot", "name", "room_1=den", "room_2=hall", "--hotspots", "hotspots/flat.yaml")


def add_zone() -> bool:
    """Add a zone."""
    zone = ("rug", "kind=keep_out", "polygon=[[1, 1], [2, 1], [2, 2]]")
    return _florence("hotspot", "zone", "add", *zone, "--hotspots", "hotspots/flat.yaml")


def add_skills() -> bool:
    """Add a skill to a file of skills."""
    what = ("service", "lamp", "std_srvs/srv/SetBool")
    return _florence("skills", "add", *what, "--file", "missions/lamp.skills.yaml")


def calibrate() -> bool:
    """Write what was calibrated."""
    try:
        set_numbers(Path("robot.yaml"), "turtlebot_node", {"wheel_base": 0.27, "wheel_diameter": 0.07})
    except ConfigError:
        return True
    return False


def save_mission() -> bool:
    """Save a mission in the editor."""
    shelf = Shelf(Path("missions"), date=lambda: datetime(2026, 11, 2))
    try:
        shelf.save("tea", MISSION.format(3), shelf.open("tea").print)
    except ConfigError:
        return True
    return False


def save_draft() -> bool:
    """Keep a draft of the editor in place of an earlier one."""
    try:
        shelf = Shelf(Path("missions"), date=lambda: datetime(2026, 11, 2))
        shelf.save_draft("tea", MISSION.format(4))
    except ConfigError:
        return True
    return False


def import_trees() -> bool:
    """Import two trees."""
    return _florence("import", "trees.xml", "--out", "imported")


def init() -> bool:
    """Make the folder of a robot."""
    answers = (
        "--robot-type",
        "create",
        "--base",
        "none",
        "--laser",
        "none",
        "--speech",
        "print",
        "--service",
        "none",
    )
    return _florence("init", "my_robot", *answers)


def grid_of(file: Path) -> tuple[float, ...] | None:
    """Read a map as a program does that knows nothing of Florence; None when there is none."""
    import cv2
    import yaml

    if not file.exists():
        return None
    told = yaml.safe_load(file.read_text())
    image = cv2.imread(str(file.parent / told["image"]), cv2.IMREAD_UNCHANGED)
    assert image is not None, f"{file} names an image that cannot be read"
    return (*told["origin"], told["resolution"], *image.shape, float(np.square(image.astype(float)).sum()))
