"""Single numbers in a configuration: comments stay, the file is whole, the old one is kept."""

from __future__ import annotations

import os

import pytest

from florence_bt.app.bringup.config import load_config
from florence_bt.app.devices.config_edit import set_numbers
from florence_bt.core.errors import ConfigError
from florence_bt.core.paths import find_data


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "robot.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("base:\n  gain: 1.35   # measured\n  port: x\n", "base:\n  gain: 2.5   # measured\n  port: x\n"),
        ("base:\n  gain: '1.35'\n", "base:\n  gain: 2.5\n"),
        ("base:\n  # why\n  port: x\n", "base:\n  # why\n  gain: 2.5\n  port: x\n"),
        ("base: {port: x}\n", "base: {gain: 2.5, port: x}\n"),
        ("base: {gain: 1, port: x}\n", "base: {gain: 2.5, port: x}\n"),
        ("base: {}\n", "base: {gain: 2.5}\n"),
        ("/base:\n  ros__parameters:\n    gain: 1\n", "/base:\n  ros__parameters:\n    gain: 2.5\n"),
        ("base: {ros__parameters: {port: x}}\n", "base: {ros__parameters: {gain: 2.5, port: x}}\n"),
        ("other: {gain: 1}", "other: {gain: 1}\n\nbase:\n  gain: 2.5\n"),
        ("# nothing yet\n", "# nothing yet\nbase:\n  gain: 2.5\n"),
        ("", "base:\n  gain: 2.5\n"),
    ],
)
def test_one_number(file, before, after):
    path = file(before)
    backup = set_numbers(path, "base", {"gain": 2.5})
    assert path.read_text() == after and backup.read_text() == before
    assert load_config(path)["base"]["gain"] == 2.5


def test_a_link_stays_a_link(file, tmp_path):
    path = file("base:\n  gain: 1\n")
    link = tmp_path / "link.yaml"
    link.symlink_to(path)
    set_numbers(link, "base", {"gain": 2.5})
    assert link.is_symlink() and path.read_text() == "base:\n  gain: 2.5\n"


def test_our_own_configuration(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_bytes(find_data("config", "robot.yaml").read_bytes())
    before = load_config(path)
    set_numbers(
        path, "turtlebot_node", {"gyro_scale_correction": 1.58139, "odom_angular_scale_correction": 1.015922}
    )
    after = load_config(path)
    assert after["turtlebot_node"].pop("gyro_scale_correction") == 1.58139
    assert after["turtlebot_node"].pop("odom_angular_scale_correction") == 1.01592
    for name in ("gyro_scale_correction", "odom_angular_scale_correction"):
        before["turtlebot_node"].pop(name)
    assert after == before and path.read_text().count("#") == find_data(
        "config", "robot.yaml"
    ).read_text().count("#")


@pytest.mark.parametrize("text", ["- a\n", "base: 3\n", "base: [a\n"])
def test_what_cannot_be_edited_stays_as_it_is(file, text):
    path = file(text)
    with pytest.raises(ConfigError):
        set_numbers(path, "base", {"gain": 2.5})
    assert path.read_text() == text


def test_a_folder_that_cannot_be_written_to(file, monkeypatch):
    path = file("base: {gain: 1}\n")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ConfigError, match="No space left"):
        set_numbers(path, "base", {"gain": 2.5})
    assert path.read_text() == "base: {gain: 1}\n"
    assert not [name for name in os.listdir(path.parent) if name.startswith(".robot")]
