"""What other users of the machine can do to our files, and read of them."""

import errno
import os
import socket
import stat
import sys

import pytest

from florence_bt.app.bringup import private_files
from florence_bt.app.bringup.locks import lock_domain, lock_folder
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.private_files import owner_only
from florence_bt.app.bringup.supervisor import Supervisor
from florence_bt.core.errors import ConfigError
from tests.script_process import ScriptStart

WRITES = """
import sqlite3, sys
with sqlite3.connect(sys.argv[1]) as journal:
    journal.execute("PRAGMA journal_mode = WAL")
    journal.execute("CREATE TABLE runs (id)")
"""


def rights(path):
    """The rights of everybody but the owner."""
    return stat.S_IMODE(path.stat().st_mode) & 0o077


@pytest.fixture(autouse=True)
def usual_umask():
    before = os.umask(0o022)
    yield
    assert os.umask(before) == 0o022


def test_what_a_bring_up_makes_is_for_its_owner(tmp_path):
    folder = tmp_path / "up"
    with owner_only(folder, folder / "runs"):
        lock = lock_folder(folder)
        BringUp(str(folder)).write()
        command = [sys.executable, "-c", WRITES, str(folder / "journal.sqlite")]
        with Supervisor(folder / "told", folder / "logs", ScriptStart(lambda *_: command)) as supervisor:
            supervisor.start(["writer"])
            for child in supervisor._children:
                child.process.wait()
        with socket.socket(socket.AF_UNIX) as port:
            port.bind(str(folder / "port"))
        lock.close()
    made = [folder, *folder.rglob("*")]
    assert {"lock", "options.json", "journal.sqlite", "writer.log", "port"} <= {path.name for path in made}
    assert [path for path in made if rights(path)] == []


def test_what_an_earlier_bring_up_left_is_for_its_owner_too(tmp_path):
    folder, runs = tmp_path / "up", tmp_path / "elsewhere"
    for path in (folder / "logs", folder / "mine", runs):
        path.mkdir(parents=True)
    for name in ("options.json", "notes.txt"):
        (folder / name).write_text("")
    with owner_only(folder, runs):
        pass
    assert not any(rights(path) for path in (folder / "logs", folder / "options.json", runs))
    assert all(rights(path) for path in (folder, folder / "mine", folder / "notes.txt"))
    kept = {
        path.name: stat.S_IMODE(path.stat().st_mode) for path in (folder / "logs", folder / "options.json")
    }
    assert kept == {"logs": 0o700, "options.json": 0o600}, "the owner may what they could before"


def test_a_link_is_not_followed(tmp_path):
    target = tmp_path / "diary"
    target.mkdir()
    (tmp_path / "up").mkdir()
    (tmp_path / "up" / "logs").symlink_to(target)
    with owner_only(tmp_path / "up", tmp_path / "up" / "runs"):
        pass
    assert rights(target)


def test_parts_of_somebody_else_are_named(tmp_path, monkeypatch):
    (tmp_path / "logs").mkdir()

    def refuse(path, mode):
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(private_files.Path, "chmod", refuse)
    with (
        pytest.raises(ConfigError, match=r"logs cannot be kept.*not permitted.*--out"),
        owner_only(tmp_path, tmp_path),
    ):
        pass


@pytest.fixture
def lock_place(tmp_path, monkeypatch):
    """Where the lock of a domain is; nothing is there yet."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", "41")
    return tmp_path / f"florence-{os.getuid()}" / "domain-41"


def test_the_lock_of_a_domain_is_for_its_owner(lock_place, tmp_path):
    lock_domain(tmp_path).close()
    assert not rights(lock_place) and not rights(lock_place.parent)


@pytest.mark.parametrize("lock", ["domain", "folder"])
def test_a_lock_that_is_a_link_overwrites_nothing(lock_place, tmp_path, lock):
    victim = tmp_path / "diary"
    victim.write_text("dear diary")
    link = lock_place if lock == "domain" else tmp_path / "up" / "lock"
    link.parent.mkdir(mode=0o700)
    link.symlink_to(victim)
    with pytest.raises(ConfigError, match="is a symbolic link"):
        lock_domain(tmp_path) if lock == "domain" else lock_folder(tmp_path / "up")
    assert victim.read_text() == "dear diary"


def test_a_linked_folder_is_refused(lock_place, tmp_path):
    (tmp_path / "mine").mkdir(mode=0o700)
    lock_place.parent.symlink_to(tmp_path / "mine")
    with pytest.raises(ConfigError, match=r"not a folder that only this user may write to.*TMPDIR"):
        lock_domain(tmp_path)
    assert list((tmp_path / "mine").iterdir()) == []


def test_a_folder_that_others_may_write_to_is_refused(lock_place, tmp_path):
    lock_place.parent.mkdir()
    lock_place.parent.chmod(0o777)
    with pytest.raises(ConfigError, match="only this user may write to"):
        lock_domain(tmp_path)


@pytest.mark.skipif(os.geteuid() != 0, reason="gives a folder away, which only root may do")
def test_a_folder_of_somebody_else_is_refused(lock_place, tmp_path):
    lock_place.parent.mkdir(mode=0o700)
    os.chown(lock_place.parent, 12345, 12345)
    with pytest.raises(ConfigError, match="only this user may write to"):
        lock_domain(tmp_path)


def test_the_folder_of_an_earlier_version_is_taken(lock_place, tmp_path):
    lock_place.parent.mkdir(mode=0o755)
    lock_domain(tmp_path).close()
    assert lock_place.read_text().splitlines()[0] == str(os.getpid())
