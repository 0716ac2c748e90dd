"""What the code imports is named in ``package.xml``, or comes from pip (docs/manual/setup.md)."""

from __future__ import annotations

import ast
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from florence_bt.core.installation import EXTRAS, OWN_INTERFACES, PACKAGES

ROOT = Path(__file__).parents[2]
KEYS = {
    "cv2": "python3-opencv",
    "yaml": "python3-yaml",
    "paho": "python3-paho-mqtt",
    "usb": "python3-usb",
    "pydantic_core": "python3-pydantic",
    "em": "python3-empy",
    "lark": "python3-lark-parser",
}
"""Module -> rosdep key, where the key is neither the module nor ``python3-MODULE``."""
FROM_PIP = {
    "numba",
    "onnxruntime",
    "mujoco",
    "resvg_py",
    "gtsam",
    "rosbags",
    "foxglove",
    "mcap",
    "lz4",
    "zstandard",
    "nicegui",
    "fastapi",
    "starlette",
    "uvicorn",
    "h11",
    "distributed",
}
"""rosdep has no keys for these."""


def imported(package: Path) -> set[str]:
    """The modules that the code of a package imports from outside of Python and of itself."""
    names = set()
    for file in package.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names.add(node.module or "")
    return {name.partition(".")[0] for name in names} - sys.stdlib_module_names - {package.name}


@pytest.mark.parametrize(
    "place", [".", "packages/florence_btcpp", "packages/florence_page", "packages/florence_sweep"]
)
def test_everything_imported_is_named(place: str) -> None:
    file = ROOT / place / "package.xml"
    tree = ET.parse(file)
    package = file.parent / str(tree.findtext("name"))
    named = {element.text for element in tree.getroot() if element.tag in ("depend", "exec_depend")}
    modules = imported(package)
    for module in modules - FROM_PIP:
        assert {module, f"python3-{module}", KEYS.get(module, module)} & named, module
    for module in modules & FROM_PIP:
        assert module.replace("_", "-") in file.read_text(), module


def test_advice_knows_every_module_that_pip_brings() -> None:
    known = {module for modules in (*EXTRAS.values(), *PACKAGES.values()) for module in modules}
    assert known >= FROM_PIP and not known & set(OWN_INTERFACES)
    own = {path.parent.name for path in (ROOT / "interfaces").glob("*/package.xml")}
    assert set(OWN_INTERFACES) == own | {"nav2_msgs"}, "of nav2_msgs Florence has the definitions inside"
