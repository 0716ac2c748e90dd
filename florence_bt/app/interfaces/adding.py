"""``florence interfaces add``: builds a package of interfaces into the environment that florence runs in."""

from __future__ import annotations

import contextlib
import io
import keyword
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

from florence_bt.app.interfaces.building import (
    ADDED,
    C_COMPILERS,
    CXX_COMPILERS,
    KINDS,
    SET_UP,
    Environment,
    InterfacePackage,
    compiler,
    has_python_headers,
    provide,
)
from florence_bt.app.interfaces.installed import InstalledPackage, installed_packages, sourced
from florence_bt.core.errors import ConfigError, FlorenceError, closest_first, raise_all
from florence_bt.core.text_files import decode_utf8, read_bytes

DEFINITIONS = Path(__file__).with_name("definitions")
"""The packages whose definitions come with Florence."""
_LONGEST_NAME = 60
"""Characters of a package's name. Chosen."""
_AT_START = ("sitecustomize", "usercustomize")
"""Modules that every Python imports when it starts, if they are there."""
_TAIL_LINES = 30
"""Lines of a failed build that are shown. Chosen."""
_PIP = "pip install 'florence-bt[build]'"


class BuildFailed(FlorenceError):
    """The generators or the compiler refused a package; the message has the end of what they said."""


def add_package(
    source: str, *, replace: bool = False, prefix: Path | None = None, say: Callable[[str], None] = print
) -> None:
    """Build a package of interfaces, and first those that it needs and whose definitions come with Florence.

    Args:
        source: A folder with ``msg``, ``srv`` or ``action`` in it, or the name of a package of
            :data:`DEFINITIONS`.
        replace: Whether it may take the place of a package of the same name from elsewhere.
        prefix: The folder to install into; the environment of florence when not given.
        say: Receives what happens, line by line.

    Raises:
        ConfigError: The package or one of its definitions is wrong, something that it needs is not installed,
            or it would shadow an installed package.
        BuildFailed: The generators or the compiler failed.
    """
    package = _package(source)
    places = sourced()
    there = installed_packages().get(package.name)
    if places and prefix is None:
        if there is not None and there.prefix in places:
            say(f"{package.name} is part of the ROS 2 that is sourced ({there.prefix}): nothing is built")
            return
        raise ConfigError(
            f"a ROS 2 is sourced in this shell ({places[0]}), and its packages are used",
            valid=["colcon build in a workspace with this package, and sourcing it", "a shell without it"],
        )
    environment = Environment(Path(sys.prefix), prefix or Path(sys.prefix), ADDED)
    if not all(_is_readable(package.folder / name) for name in package.files):
        _refuse_all(_wrong_definitions(package, installed_packages(), environment))
    _check_tools()
    _add(package, environment, replace, say, installed_packages())
    if prefix is not None:
        folder = prefix.absolute()
        modules = next(folder.glob("lib/python*/site-packages"))
        say("programs find it with:")
        say(f'export AMENT_PREFIX_PATH="{folder}${{AMENT_PREFIX_PATH:+:$AMENT_PREFIX_PATH}}"')
        say(f'export LD_LIBRARY_PATH="{folder / "lib"}${{LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}}"')
        say(f'export PYTHONPATH="{modules}${{PYTHONPATH:+:$PYTHONPATH}}"')


def _add(
    package: InterfacePackage,
    environment: Environment,
    replace: bool,
    say: Callable[[str], None],
    installed: dict[str, InstalledPackage],
) -> None:
    known = {name for name in installed if _has_headers(installed[name])}
    known |= {
        name for name in package.needs if environment.share(name) and environment.into != environment.prefix
    }
    lacking = [name for name in package.needs if name not in known]
    ours = [name for name in lacking if (DEFINITIONS / name).is_dir()]
    wrong = [_missing(package, name, installed) for name in lacking if name not in ours]
    _refuse_all([*wrong, *_wrong_definitions(package, installed, environment)])
    for name in ours:
        _add(InterfacePackage.read(DEFINITIONS / name), environment, replace, say, installed)
    _refuse_all(_wrong_definitions(package, installed, environment))  # by what has just been added, too
    _refuse_shadow(package, environment, replace, installed)
    say(f"{package.name}: {_count(package)} ...")
    whole = package.folder.parent == DEFINITIONS  # the rest of what is there
    try:
        built = provide(_call, package, environment, replace=package.name in installed and (replace or whole))
    except FileExistsError as error:
        raise ConfigError(f"{package.name}: {error}", valid=["another name for the package"]) from error
    _forget_set_up(package.name, environment)
    say(f"{package.name}: {'built' if built else 'from the cache'}, installed in {environment.into}")


def _package(source: str) -> InterfacePackage:
    """Look at the sources.

    Raises:
        ConfigError: There are none, or one of them or ``package.xml`` cannot be read.
    """
    folder = Path(source)
    known = {each.name: each for each in sorted(DEFINITIONS.iterdir())} if DEFINITIONS.is_dir() else {}
    if not folder.is_dir():
        if source in known:
            return InterfacePackage.read(known[source])
        what = f"there is no folder {source!r}, and no package of that name comes with Florence"
        raise ConfigError(
            what, valid=["a folder with msg, srv or action in it", *closest_first(source, known)]
        )
    try:
        package = InterfacePackage.read(folder)
    except ElementTree.ParseError as error:
        line, column = error.position
        problem = f"not well-formed XML: {str(error).partition(':')[0]}"
        raise ConfigError(problem, file=folder / "package.xml", line=line, column=column + 1) from error
    if not package.files:
        valid = [f"{folder / kind / 'Name'}.{kind}" for kind in KINDS]
        raise ConfigError(f"{folder} has no definitions of interfaces", valid=valid)
    from rosidl_adapter.parser import is_valid_package_name

    if not is_valid_package_name(package.name):
        raise ConfigError(f"{package.name!r} is not the name of a package", valid=["gripper_interfaces"])
    _refuse_name(package.name)
    return package


def _text(file: Path) -> str:
    return decode_utf8(read_bytes(file), file)


def _is_readable(file: Path) -> bool:
    try:
        _text(file)
    except ConfigError:
        return False
    return True


def _refuse_name(name: str) -> None:
    """Refuse a name that Python has, or that others import from somewhere else.

    Raises:
        ConfigError: It is too long, a word or a module of Python, or that of another Python package.
    """
    valid = [f"{name[: _LONGEST_NAME // 2]}_msgs", "another name for the package"]
    if len(name) > _LONGEST_NAME:
        what = f"the name of the package has {len(name)} characters, more than {_LONGEST_NAME}"
        raise ConfigError(what, valid=valid[1:])
    if keyword.iskeyword(name):
        raise ConfigError(f"{name!r} is a word of Python: nobody could import the package", valid=valid)
    if name in sys.stdlib_module_names or name in _AT_START:
        raise ConfigError(f"{name!r} is a module of Python, which the package would hide", valid=valid)
    if name not in installed_packages() and _is_python_package(name):
        what = f"{name!r} is a Python package that is installed, and no package of interfaces"
        raise ConfigError(what, valid=valid)


def _is_python_package(name: str) -> bool:
    """Tell whether something of a name can be imported; a mere folder, as of sources, is not meant."""
    try:
        spec = find_spec(name)
    except (ImportError, ValueError):
        return False
    return spec is not None and spec.origin is not None


def _check_tools() -> None:
    """Refuse a machine that cannot build, and say what is missing.

    Raises:
        ConfigError: With how to get it.
    """
    if not (compiler(*C_COMPILERS) and compiler(*CXX_COMPILERS)):
        raise ConfigError(
            "no C and C++ compiler", valid=["apt install build-essential", "CC=... CXX=... florence ..."]
        )
    if not has_python_headers():
        raise ConfigError("Python's headers are not there", valid=["apt install python3-dev"])
    generators = ("rosidl_generator_py", "rosidl_generator_c", "rosidl_typesupport_fastrtps_c", "em", "lark")
    lacking = [name for name in generators if find_spec(name) is None]
    if lacking:
        raise ConfigError(f"what builds interfaces is not installed ({', '.join(lacking)})", valid=[_PIP])


def _has_headers(package: InstalledPackage) -> bool:
    """Tell whether other packages can be built against one."""
    return (package.prefix / "include" / package.name).is_dir()


def _missing(package: InterfacePackage, name: str, installed: Mapping[str, InstalledPackage]) -> ConfigError:
    file = next(
        each for each in package.files if f"{name}/" in (package.folder / each).read_text(encoding="utf-8")
    )
    text = (package.folder / file).read_text(encoding="utf-8").splitlines()
    line = next(number for number, each in enumerate(text, 1) if f"{name}/" in each)
    close = closest_first(name, installed)
    valid = [f"florence interfaces add FOLDER_OF_{name}", *(close if len(close) <= 3 else ())]
    problem = f"needs the package {name!r}, which is not installed"
    return ConfigError(problem, file=package.folder / file, line=line, column=1, valid=valid)


def _refuse_shadow(
    package: InterfacePackage,
    environment: Environment,
    replace: bool,
    installed: Mapping[str, InstalledPackage],
) -> None:
    """Refuse to take the place of a package from elsewhere; one's own of before may be replaced.

    Raises:
        ConfigError: It would.
    """
    there = installed.get(package.name)
    if there is None or environment.files_list(package.name).is_file():
        return
    if environment.into == environment.prefix:
        owner = _owner(package.name)
        if owner:
            what = (
                f"{package.name} is installed by the Python package {owner}, and others are built against it"
            )
            raise ConfigError(what, valid=["another name for the package"])
        if package.folder.parent == DEFINITIONS:
            return  # the whole of what make setup has built a part of
    if not replace:
        what = f"{package.name} is installed already, by {there.origin}"
        raise ConfigError(what, valid=["--replace", "another name for the package"])


def _owner(name: str) -> str:
    """Return the Python package that an interface package comes with; empty when there is none."""
    wanted = f"share/{name}/package.xml"
    for distribution in metadata.distributions():
        # A folder that an interrupted uninstall left behind has no name.
        if (distribution.name or "").startswith("ros-") and any(
            str(file).endswith(wanted) for file in distribution.files or ()
        ):
            return distribution.name
    return ""


def _forget_set_up(name: str, environment: Environment) -> None:
    """Remove what ``make setup`` had put there of a package, and only what the new one does not have."""
    before = Environment(environment.prefix, environment.into, SET_UP).files_list(name)
    if before.is_file():
        now = set(environment.files_list(name).read_text().splitlines())
        for file in set(before.read_text().splitlines()) - now:
            (environment.into / file).unlink(missing_ok=True)
        before.unlink()


def _refuse_all(wrong: Iterable[ConfigError]) -> None:
    """Refuse a package for everything that is wrong with it at once, in the order of its files.

    Raises:
        ConfigError: With the file and the line; of several mistakes each has a line of the message.
    """
    raise_all(sorted(wrong, key=lambda error: (error.file or "", error.line or 0)))


def _wrong_definitions(
    package: InterfacePackage, installed: Mapping[str, InstalledPackage], environment: Environment
) -> Iterator[ConfigError]:
    """Yield what is wrong with the definitions, with the file and the line."""
    own = {Path(name).stem for name in package.files if name.startswith("msg/")}
    for name in package.files:
        file = package.folder / name
        try:
            lines = _text(file).splitlines()
        except ConfigError as error:
            yield error
            continue
        kind = name.partition("/")[0]
        what, parts = {"msg": ("a message", 1), "srv": ("a service", 2), "action": ("an action", 3)}[kind]
        if sum(line.strip() == "---" for line in lines) != parts - 1:
            problem = f"{what} has {parts} part{'s, with a line --- between them' if parts > 1 else ''}"
            yield ConfigError(problem, file=file, line=1, column=1)
        for number, problem, valid in _problems(package.name, file.stem, lines):
            yield ConfigError(problem, file=file, line=number, column=1, valid=valid)
        for number, owner, message in _references(package.name, lines):
            known = _types(owner, installed, environment) if owner != package.name else own
            if known is not None and message not in known:
                valid = [f"{owner}/{each}" for each in closest_first(message, known)] if known else []
                what = f"{owner} has no message {message!r}"
                yield ConfigError(what, file=file, line=number, column=1, valid=valid[:3])


def _types(
    owner: str, installed: Mapping[str, InstalledPackage], environment: Environment
) -> set[str] | None:
    share = environment.share(owner)
    if share is not None:
        return {file.stem for file in (share / "msg").glob("*.idl")}
    there = installed.get(owner)
    return {each[4:] for each in there.types if each.startswith("msg/")} if there is not None else None


def _references(package: str, lines: Iterable[str]) -> Iterator[tuple[int, str, str]]:
    """Yield the messages that a definition names: line, package, message."""
    from rosidl_adapter.parser import Type

    for number, line in enumerate(lines, 1):
        words = line.partition("#")[0].split()
        if len(words) >= 2 and "=" not in words[1]:
            with contextlib.suppress(Exception):  # told before
                kind = Type(words[0], context_package_name=package)
                if not kind.is_primitive_type():
                    yield number, kind.pkg_name, kind.type


def _problems(package: str, name: str, lines: list[str]) -> Iterator[tuple[int, str, list[str]]]:
    """Yield what is wrong with each line, by the parser of ROS: its number, the problem, what is right."""
    from rosidl_adapter.parser import InvalidResourceName, is_valid_message_name, parse_message_string

    if not is_valid_message_name(name):
        yield 1, f"the file's name {name!r} is not that of a type", ["GripObject"]
        name = "GripObject"  # its lines are looked at all the same
    start = 0
    for end in [*(number for number, line in enumerate(lines) if line.strip() == "---"), len(lines)]:
        good: list[str] = []
        for number, line in enumerate(lines[start:end], start + 1):
            said = io.StringIO()
            try:
                with contextlib.redirect_stderr(said):
                    parse_message_string(package, name, "\n".join([*good, line]))
            except Exception as error:
                text = line.strip()
                if isinstance(error, InvalidResourceName):
                    problem, valid = f"{text.split()[0]!r} is not a type", ["float64", "geometry_msgs/Pose"]
                elif len(text.split()) < 2:
                    problem, valid = f"{text!r} is not a field", ["float64 width", "uint8 OPEN=1"]
                else:
                    problem, valid = f"{text!r} is not understood: {error or type(error).__name__}", []
                yield number, problem, valid
            else:
                good.append(line)
        start = end + 1


def _call(command: Iterable[str | Path], variables: Mapping[str, str]) -> None:
    words = [str(word) for word in command]
    done = subprocess.run(
        words,
        env={**os.environ, **variables},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode != 0:
        tail = "\n".join(f"    {line}" for line in done.stdout.splitlines()[-_TAIL_LINES:])
        raise BuildFailed(f"the build failed: {' '.join(words)}\n{tail}")


def _count(package: InterfacePackage) -> str:
    words = {"msg": "messages", "srv": "services", "action": "actions"}
    count = {kind: sum(name.startswith(f"{kind}/") for name in package.files) for kind in KINDS}
    return ", ".join(
        f"{number} {words[kind][:-1] if number == 1 else words[kind]}"
        for kind, number in count.items()
        if number
    )
