"""Makes the folder of a robot; what is there already is left alone, and shown where it differs."""

from __future__ import annotations

import difflib
import getpass
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.bringup.robot_folder import FILE
from florence_bt.app.robot_setup.discovery import (
    SerialDevice,
    ask_emulated,
    ask_plugged,
    asked_at,
    emulated_devices,
    find_base,
    find_laser,
    serial_devices,
)
from florence_bt.app.robot_setup.files import (
    BASE_NAME,
    LASER_NAME,
    RULES,
    UNIT,
    Answers,
    florence_yaml,
    robot_yaml,
    systemd_unit,
    udev_rules,
)
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.file_sets import replace_files
from florence_bt.core.paths import find_data
from florence_bt.drivers.turtlebot.codec.models import MODELS

SERVICES = ("user", "system", "none")
VERIFY_S = 30.0
"""Seconds that a program gets to check a file."""
FLAT = ("maps/flat.yaml", "maps/flat.pgm")
"""The map of a rehearsal."""

Ask = Callable[[str, str], str]
"""Asks a question that has a default answer."""
Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Given:
    """The options of the command line; None: to be asked, or found out."""

    robot_type: str | None = None
    base: str | None = None
    laser: str | None = None
    speech: str | None = None
    map_file: Path | None = None
    hotspots: Path | None = None
    service: str | None = None
    emulate: bool = False


def set_up(folder: Path, given: Given, ask: Ask, say: Say) -> None:
    """Make the folder of a robot and say what is left to do. Nothing outside the folder is changed.

    Args:
        folder: The robot's folder; made when it is not there.
        given: What is known already.
        ask: Asks for the rest.
        say: Shows a line.

    Raises:
        ConfigError: An answer is wrong, or the folder cannot be written to.
    """
    for file in (given.map_file, given.hotspots):
        if file is not None and not file.is_file():
            raise ConfigError(
                f"there is no file {str(file)!r}", valid=["an existing file", "none: it comes later"]
            )
    service = given.service or ask(
        f"Start it with the machine, as a service of ({', '.join(SERVICES)})", "user"
    )
    _chosen("the service", service, SERVICES)
    robot_type = _chosen("the base", given.robot_type or ask(f"Base ({', '.join(MODELS)})", "create"), MODELS)
    plugged: AbstractContextManager[Sequence[SerialDevice]] = (
        emulated_devices(folder.absolute() / "runs" / "ports")
        if given.emulate
        else nullcontext(serial_devices())
    )
    try:
        with plugged as devices:
            query = ask_emulated if given.emulate else ask_plugged
            base, laser = find_base(devices, robot_type, query), find_laser(devices, query)
            for what, device in (("base", base), ("laser", laser)):
                say(_found(what, device))
            answers = _answers(given, service, robot_type, base, laser, ask)
            for what, node, port in (
                ("base", "turtlebot_node", given.base),
                ("laser", "hokuyo_node", given.laser),
            ):
                if port is not None and Path(port).exists():
                    answer = asked_at(node, {"port": port, "robot_type": robot_type}, query)
                    say(f"{what}: {port} {answer or 'does not answer: is it switched on?'}")
    except OSError as error:
        raise ConfigError(
            f"the folder {str(folder)!r} cannot be used: {error.strerror}",
            valid=["a folder you may write to"],
        ) from error
    _write(folder, _files(folder, answers, {"create": base, "hokuyo": laser}), say)
    for line in _verified(folder, answers.service):
        say(line)
    say("")
    say("left to do:")
    for number, step in enumerate(_left(folder, answers), 1):
        say(f"{number:2}. {step}")


def _found(what: str, device: SerialDevice | None) -> str:
    if device is None:
        return f"{what}: none is plugged in; the usual name is written, and can be changed in robot.yaml"
    marks = ", ".join(
        part for part in (device.usb_id, device.serial and f"serial number {device.serial}") if part
    )
    return f"{what}: {device.path} ({marks}) {device.answer or 'does not answer: is it switched on?'}"


def _answers(
    given: Given,
    service: str,
    robot_type: str,
    base: SerialDevice | None,
    laser: SerialDevice | None,
    ask: Ask,
) -> Answers:
    emulate = given.emulate
    return Answers(
        robot_type=robot_type,
        base=given.base or ask("Port of the base", base.path if base and emulate else BASE_NAME),
        laser=given.laser
        or ask("Port of the laser, or its IP address", laser.path if laser and emulate else LASER_NAME),
        speech=given.speech
        or ask("What speaks: print (only shown), none, or a command such as espeak-ng", "print"),
        map_file=str(given.map_file.absolute()) if given.map_file else FLAT[0] if emulate else "",
        hotspots=str(given.hotspots.absolute()) if given.hotspots else "hotspots.yaml",
        service=service,
        emulate=emulate,
    )


def _chosen(what: str, answer: str, known: Collection[str]) -> str:
    if answer not in known:
        raise ConfigError(f"{what} is {answer!r}", valid=closest_first(answer, known))
    return answer


def _files(folder: Path, answers: Answers, devices: dict[str, SerialDevice | None]) -> dict[str, bytes]:
    """Return what to write: name in the folder -> content."""
    texts = {
        "robot.yaml": robot_yaml(answers, folder / "robot.yaml"),
        FILE: florence_yaml(answers, folder),
        RULES: udev_rules(devices),
    }
    if answers.service != "none":
        texts[UNIT] = systemd_unit(
            folder.absolute(), _florence(), answers.service, getpass.getuser(), _environment()
        )
    files = {name: text.encode() for name, text in texts.items()}
    if answers.hotspots == "hotspots.yaml":
        flat = find_data("hotspots", "flat.yaml").read_bytes()
        files[answers.hotspots] = flat if answers.emulate else _NO_HOTSPOTS.encode()
    if answers.map_file == FLAT[0]:
        files |= {name: find_data(*name.split("/")).read_bytes() for name in FLAT}
    return files


_NO_HOTSPOTS = "# The rooms and places of this home: florence hotspot --help\n"


def _florence() -> list[str]:
    """Return the words that start ``florence`` as it was started now."""
    script = Path(sys.executable).with_name("florence")
    return [str(script)] if script.exists() else [sys.executable, "-m", "florence_bt.cli"]


def _environment() -> dict[str, str]:
    """Return the variables of this shell, without what the ROS 2 of PyPI sets again by itself."""
    variables = dict(os.environ)
    parts = variables.get("LD_LIBRARY_PATH", "").split(":")
    own = (sys.prefix, os.path.realpath(sys.prefix))
    variables["LD_LIBRARY_PATH"] = ":".join(part for part in parts if part and not part.startswith(own))
    return variables


def _write(folder: Path, files: dict[str, bytes], say: Say) -> None:
    """Write what is not there; tell what is, and how it differs."""
    try:
        for place in (folder, folder / "missions", *((folder / name).parent for name in files)):
            place.mkdir(parents=True, exist_ok=True)
        there = {name: (folder / name).read_bytes() for name in files if (folder / name).exists()}
        replace_files({folder / name: content for name, content in files.items() if name not in there})
    except OSError as error:
        raise ConfigError(
            f"the folder {str(folder)!r} cannot be used: {error.strerror}",
            valid=["a folder you may write to"],
        ) from error
    for name, content in files.items():
        if name not in there:
            say(f"{folder / name}: written")
        elif there[name] == content:
            say(f"{folder / name}: is there, as it should be")
        else:
            say(f"{folder / name}: is there and stays as it is; what would be written now differs:")
            for line in _difference(there[name], content):
                say(f"    {line}")


def _difference(before: bytes, after: bytes) -> Iterator[str]:
    old, new = (content.decode(errors="replace").splitlines() for content in (before, after))
    for line in difflib.unified_diff(old, new, n=0, lineterm=""):
        if not line.startswith(("---", "+++", "@@")):
            yield line


def _verified(folder: Path, service: str) -> Iterator[str]:
    """Check the files with the programs that will read them, where these are installed."""
    checks = [(RULES, ["udevadm", "verify"])]
    if service != "none":
        checks.append((UNIT, ["systemd-analyze", *(["--user"] if service == "user" else []), "verify"]))
    for name, command in checks:
        file, tool = folder.absolute() / name, " ".join(command)
        if shutil.which(command[0]) is None:
            yield f"{folder / name}: not checked, there is no {command[0]} here"
            continue
        try:
            with tempfile.TemporaryDirectory() as run:  # which systemd wants of a user
                done = subprocess.run(
                    [*command, str(file)],
                    env={"XDG_RUNTIME_DIR": run, **os.environ},
                    capture_output=True,
                    text=True,
                    timeout=VERIFY_S,
                    check=False,
                )
        except (OSError, subprocess.TimeoutExpired) as error:
            yield f"{folder / name}: not checked, {tool} broke down: {error}"
            continue
        said = (done.stdout + done.stderr).strip().splitlines()
        mine = [line for line in said if name in line]
        if mine:
            yield f"{folder / name}: {tool} says: {'; '.join(mine)}"
        elif done.returncode != 0:
            yield f"{folder / name}: not checked, {tool} says: {said[-1] if said else 'nothing'}"
        else:
            yield f"{folder / name}: {tool} finds nothing wrong"


def _left(folder: Path, answers: Answers) -> Iterator[str]:
    """Tell what is left to do, a command each."""
    place = shlex.quote(str(folder))
    if BASE_NAME in answers.base or LASER_NAME in answers.laser:
        rules = shlex.quote(str(folder / RULES))
        yield (
            "let the devices have their names, and you use them:\n"
            f"    sudo cp {rules} /etc/udev/rules.d/\n"
            "    sudo udevadm control --reload && sudo udevadm trigger\n"
            "    sudo usermod -aG dialout $USER    # then log in again"
        )
    if not answers.emulate:
        yield f"look whether everything works:\n    florence doctor {place}"
    yield f"start it, here or in a terminal of its own:\n    florence up {place}"
    if not answers.emulate:
        yield f"calibrate, in front of a bare wall:\n    florence calibrate --write {place}/robot.yaml"
    if not answers.map_file:
        yield (
            "make a map of the home, once the system has ended; it explores, or drive by florence teleop:\n"
            f"    florence up {place} --mapping\n"
            f"    florence map explore {place}/maps/home.yaml\n"
            f"    # then take the mark # away before `map:` in {place}/florence.yaml, and start it again"
        )
    if not answers.emulate:
        yield "teach it the rooms: drive there, then\n    florence hotspot --help"
    yield f"try it, then put missions of your own into {place}/missions:\n    florence run goto_user"
    unit = shlex.quote(str(folder.absolute() / UNIT))
    if answers.service == "user":
        yield (
            "start it with the machine:\n"
            f"    systemctl --user link {unit} && systemctl --user enable --now florence\n"
            "    loginctl enable-linger    # also when nobody is logged in"
        )
    elif answers.service == "system":
        yield (
            "start it with the machine:\n"
            f"    sudo cp {unit} /etc/systemd/system/ && sudo systemctl enable --now florence"
        )
