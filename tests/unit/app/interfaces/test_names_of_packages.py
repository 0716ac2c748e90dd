"""What a package of interfaces may be called, and which files it may replace: tried in a real environment."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("rosidl_adapter")

from florence_bt.app.interfaces import adding
from florence_bt.app.interfaces.adding import add_package
from florence_bt.app.interfaces.building import install
from florence_bt.core.errors import ConfigError


@pytest.fixture(autouse=True)
def no_sourced_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


def package(folder: Path, name: str) -> str:
    """Write a package of this name; gives its folder, which is called otherwise."""
    message = folder / "sources" / "msg" / "Finger.msg"
    message.parent.mkdir(parents=True, exist_ok=True)
    message.write_text("float64 force\n")
    (folder / "sources" / "package.xml").write_text(f"<package><name>{name}</name></package>")
    return str(folder / "sources")


def files_below(folder: Path) -> dict[Path, bytes]:
    return {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("numpy", "is a Python package that is installed"),
        ("pytest", "is a Python package that is installed"),
        ("rclpy", "is a Python package that is installed"),
        ("florence_bt", "is a Python package that is installed"),
        ("os", "is a module of Python"),
        ("json", "is a module of Python"),
        ("this", "is a module of Python"),
        ("sitecustomize", "is a module of Python"),
        ("class", "is a word of Python"),
        ("import", "is a word of Python"),
        ("h" * 300, "has 300 characters"),
        ("../numpy", "not the name of a package"),
        ("a/b", "not the name of a package"),
        ("..", "not the name of a package"),
        ("hand\nmsgs", "not the name of a package"),
        ("Hand", "not the name of a package"),
    ],
)
@pytest.mark.parametrize("replace", [False, True])
def test_a_name_that_is_not_free_is_refused_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, why: str, replace: bool
) -> None:
    def build(*arguments: object, **options: object) -> bool:
        raise AssertionError("it was built")

    monkeypatch.setattr(adding, "provide", build)
    with pytest.raises(ConfigError, match=why) as caught:
        add_package(package(tmp_path, name), replace=replace, prefix=tmp_path / "prefix")
    assert caught.value.valid
    assert not (tmp_path / "prefix").exists()


def test_a_free_name_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that a folder of sources in the working directory has."""
    built: list[str] = []
    monkeypatch.setattr(adding, "provide", lambda call, package, *rest, **more: built.append(package.name))
    (tmp_path / "hand_msgs").mkdir()
    (tmp_path / "prefix" / "lib" / "python3" / "site-packages").mkdir(parents=True)
    monkeypatch.syspath_prepend(tmp_path)
    add_package(package(tmp_path, "hand_msgs"), prefix=tmp_path / "prefix", say=lambda line: None)
    assert built == ["hand_msgs"]


@pytest.fixture
def entry(tmp_path: Path) -> Path:
    """A package that was built: one Python file, one library."""
    for name in ("lib/python3/site-packages/hand_msgs/__init__.py", "lib/libhand_msgs.so"):
        (tmp_path / "built" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "built" / name).write_text("new")
    return tmp_path / "built"


INIT = Path("lib/python3/site-packages/hand_msgs/__init__.py")


def test_a_file_of_somebody_else_stays_as_it_is(tmp_path: Path, entry: Path) -> None:
    prefix = tmp_path / "env"
    (prefix / INIT).parent.mkdir(parents=True)
    (prefix / INIT).write_text("theirs")
    before = files_below(prefix)
    with pytest.raises(FileExistsError, match="not from here"):
        install(entry, prefix, prefix / "state" / "added" / "hand_msgs.files")
    assert files_below(prefix) == before
    install(entry, prefix, prefix / "state" / "added" / "hand_msgs.files", replace=True)
    assert (prefix / INIT).read_text() == "new"


def test_what_was_installed_from_here_is_replaced(tmp_path: Path, entry: Path) -> None:
    prefix = tmp_path / "env"
    install(entry, prefix, prefix / "state" / "interfaces" / "hand_msgs.files")
    (prefix / INIT).write_text("old")
    install(entry, prefix, prefix / "state" / "added" / "hand_msgs.files")
    assert (prefix / INIT).read_text() == "new"


def test_no_link_leads_out_of_the_environment(tmp_path: Path, entry: Path) -> None:
    prefix, elsewhere = tmp_path / "env", tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "__init__.py").write_text("theirs")
    (prefix / INIT.parent.parent).mkdir(parents=True)
    (prefix / INIT.parent).symlink_to(elsewhere)
    with pytest.raises(FileExistsError, match="leads to"):
        install(entry, prefix, prefix / "state" / "added" / "hand_msgs.files", replace=True)
    assert (elsewhere / "__init__.py").read_text() == "theirs"
    assert not (prefix / "state").exists()


def test_links_inside_the_environment_are_fine(tmp_path: Path, entry: Path) -> None:
    prefix = tmp_path / "env"
    (prefix / "lib64").mkdir(parents=True)
    (prefix / "lib").symlink_to("lib64")
    (tmp_path / "by_link").symlink_to(prefix)
    install(entry, tmp_path / "by_link", prefix / "state" / "added" / "hand_msgs.files")
    assert (prefix / "lib64" / "libhand_msgs.so").read_text() == "new"
