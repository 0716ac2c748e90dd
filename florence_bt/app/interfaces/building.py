"""Builds a package of ROS interfaces for Python into an environment, by the generators of ROS 2.

``make setup`` builds Florence's own packages with it, on a bare Python: nothing but the standard library is
imported; ``generating`` is a program for the environment. The package's own ``CMakeLists.txt`` is not used,
and of ``package.xml`` only the name and the version. What was built is kept in a cache folder of the user, by
the hash of everything it was made from.

Only what a Python node over Fast DDS loads is built: the C messages, their type supports for Fast DDS
(serialization) and introspection (the type that Fast DDS announces), the dispatch between the two, and the
Python extension. Each library is compiled as one file, by one command.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

Call = Callable[[Iterable[str | Path], Mapping[str, str]], None]
"""Runs a command to its end, with these variables besides those of the environment; raises when it fails."""

SET_UP, ADDED = "interfaces", "added"
"""The folders with lists of installed files: of Florence's own packages, and of those that a person added."""
KINDS = ("msg", "srv", "action")
"""The folders of a package of interfaces, and how the names of their files end."""
C_COMPILERS = ("CC", "cc", "gcc", "clang")
CXX_COMPILERS = ("CXX", "c++", "g++", "clang++")
"""The variable that names a compiler, then the names of compilers."""
BUILT_WITH = ("ros_", "numpy", "empy", "lark")
"""Python packages that decide what is built."""
C_FLAGS, CXX_FLAGS = ("-std=gnu11",), ("-std=gnu++17",)
# Generated code that copies fields: optimising it doubles the compile time and saves microseconds.
FLAGS = ("-O0", "-DNDEBUG", "-fPIC", "-shared", "-Wl,--as-needed")
LINKED_WITH = {
    "rosidl_generator_c": ("rosidl_runtime_c", "rcutils"),
    "rosidl_typesupport_fastrtps_c": (
        *("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_fastrtps_cpp", "fastcdr"),
        *("rosidl_runtime_c", "rmw"),
    ),
    "rosidl_typesupport_introspection_c": ("rosidl_typesupport_introspection_c", "rosidl_runtime_c"),
    "rosidl_typesupport_c": ("rosidl_typesupport_c", "rosidl_runtime_c"),
    "rosidl_generator_py": ("rosidl_runtime_c",),
}
"""The libraries of a package, by the generator that writes each, and what of ROS each uses."""
LINKED_FIRST = {
    "rosidl_generator_py": ("rosidl_typesupport_c", "rosidl_generator_c"),
    "rosidl_generator_c": (),
}
"""The libraries of the package itself that one uses; the other ones use the messages."""
_GENERATING = Path(__file__).with_name("generating.py")
_PACKAGE_XML = """\
<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>{version}</version>
  <description>Interfaces of {name}.</description>
  <maintainer email="nobody@florence-bt.invalid">nobody</maintainer>
  <license>see the source of the package</license>
{depends}
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
"""
_REFERENCE = re.compile(r"^\s*([a-z][a-z0-9_]*)/[A-Z]", re.MULTILINE)


def content_hash(parts: Iterable[Path | str]) -> str:
    """Compute a hash of texts, files and folders (all files in them, by name)."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, str):
            digest.update(part.encode() + b"\0")
            continue
        for file in sorted(part.rglob("*")) if part.is_dir() else [part]:
            if file.is_file():
                digest.update(str(file.relative_to(part)).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def compiler(variable: str, *names: str) -> str:
    """Return the path of a compiler, empty when there is none."""
    found = (shutil.which(name) for name in (os.environ.get(variable, ""), *names) if name)
    return next(filter(None, found), "")


def has_python_headers() -> bool:
    """Tell whether extensions of this Python can be compiled."""
    return Path(sysconfig.get_path("include"), "Python.h").is_file()


@dataclass(frozen=True)
class InterfacePackage:
    """The sources of a package of interfaces.

    Attributes:
        folder: The folder with ``msg``, ``srv`` and ``action``.
        name: The name of the package.
        version: Its version.
        files: The definitions, relative to the folder, such as ``msg/Grip.msg``.
    """

    folder: Path
    name: str
    version: str
    files: tuple[str, ...]

    @classmethod
    def read(cls, folder: Path, only: Iterable[str] = ()) -> InterfacePackage:
        """Look at a folder; without ``package.xml`` the name of the folder is that of the package.

        Args:
            folder: The folder.
            only: The definitions that count; all when empty.

        Raises:
            ElementTree.ParseError: ``package.xml`` is no XML.
        """
        manifest = folder / "package.xml"
        root = ElementTree.parse(manifest).getroot() if manifest.is_file() else ElementTree.Element("package")
        found = (file for kind in KINDS for file in sorted((folder / kind).glob(f"*.{kind}")))
        return cls(
            folder,
            (root.findtext("name") or folder.resolve().name).strip(),
            (root.findtext("version") or "0.0.0").strip(),
            tuple(only) or tuple(str(file.relative_to(folder)) for file in found),
        )

    @cached_property
    def needs(self) -> tuple[str, ...]:
        """The packages whose types stand in the definitions, and those that every service or action needs."""
        found = set()
        for name in self.files:
            found |= set(_REFERENCE.findall((self.folder / name).read_text(encoding="utf-8")))
            if not name.startswith("msg/"):
                found |= {"service_msgs"}
            if name.startswith("action/"):
                found |= {"action_msgs", "builtin_interfaces", "unique_identifier_msgs"}
        return tuple(sorted(found - {self.name}))

    def made_from(self) -> str:
        """Hash what the package is made from, besides the tools and the packages that it needs."""
        sources = (part for name in self.files for part in (name, self.folder / name))
        return content_hash([self.name, self.version, *sources])


@dataclass(frozen=True)
class Environment:
    """A virtual environment with the generators of ROS 2.

    Attributes:
        prefix: Its folder.
        into: The folder that packages are installed into, with ``lib`` and ``share``; usually the same.
        lists: The name of the folder of the lists of installed files, :data:`SET_UP` or :data:`ADDED`.
    """

    prefix: Path
    into: Path
    lists: str

    @property
    def state(self) -> Path:
        """The folder of what is noted about the environment."""
        return self.into / "florence-setup"

    @property
    def site_packages(self) -> Path:
        """The folder of the Python packages of the environment."""
        return self.prefix / "lib" / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages"

    def files_list(self, name: str) -> Path:
        """Return the file that lists what was installed of a package that was built here."""
        return self.state / self.lists / f"{name}.files"

    def share(self, name: str) -> Path | None:
        """Return the folder ``share`` of an installed package; None when there is none."""
        folders = (place / "share" / name for place in (self.into, self.prefix))
        return next((folder for folder in folders if (folder / "package.xml").is_file()), None)


def cache_folder(environment: Environment) -> Path:
    """Return where built packages are kept for a user; in the environment if that cannot be written."""
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "florence_bt" / "interfaces"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        writable = False
    else:
        writable = os.access(folder, os.W_OK)
    return folder if writable else environment.state / "cache"


def recipe(environment: Environment) -> str:
    """Hash what the result depends on besides the package: how it is built, and with which versions."""
    tools = [
        each.name
        for each in environment.site_packages.glob("*.dist-info")
        if each.name.startswith(BUILT_WITH)
    ]
    compilers = [_version(compiler(*names)) for names in (C_COMPILERS, CXX_COMPILERS)]
    machine = (str(sys.version_info[:2]), platform.machine(), *platform.libc_ver())
    return content_hash([*machine, *compilers, *sorted(tools), _GENERATING, Path(__file__)])


def provide(
    call: Call, package: InterfacePackage, environment: Environment, *, replace: bool = False
) -> bool:
    """Bring a package into an environment, from the cache or by building it.

    Args:
        call: Runs a command.
        package: The package.
        environment: The environment.
        replace: Whether files from elsewhere may be replaced.

    Returns:
        Whether it was built.

    Raises:
        FileExistsError: As of :func:`install`.
    """
    needed = [environment.share(name) or name for name in package.needs]
    made_from = content_hash([recipe(environment), package.made_from(), *needed])
    entry = cache_folder(environment) / f"{package.name}-{made_from[:24]}"
    built = not entry.is_dir()
    if built:
        _build(call, package, environment, entry)
    install(entry, environment.into, environment.files_list(package.name), replace=replace)
    return built


def keep(entry: Path, built: Path) -> None:
    """Put a built package into the cache, whole or not at all.

    Args:
        entry: Folder that it becomes.
        built: Folder on the same file system that it is now.
    """
    try:
        built.rename(entry)
    except OSError:
        if not entry.is_dir():
            raise
        # Another set-up was faster with the same package.


def install(entry: Path, prefix: Path, files_list: Path, *, replace: bool = False) -> None:
    """Copy a package from the cache in place of what an earlier build put there.

    A deleted message must not live on: the files of before are removed.

    Args:
        entry: The package in the cache, with the folders ``lib`` and ``share``.
        prefix: The environment.
        files_list: Names the files that come from here; written before they are copied.
        replace: Whether files from elsewhere may be replaced, too.

    Raises:
        FileExistsError: A file would be replaced that does not come from here, or a link leads out of the
            environment; nothing has been changed.
    """
    files = [file.relative_to(entry) for file in sorted(entry.rglob("*")) if not file.is_dir()]
    lists = [each for each in files_list.parent.parent.glob(f"*/{files_list.name}") if each.is_file()]
    ours = {name for each in lists for name in each.read_text().splitlines()}
    for file in files:
        _refuse_other_file(prefix, file, replace or str(file) in ours)
    if files_list.is_file():
        for name in files_list.read_text().splitlines():
            (prefix / name).unlink(missing_ok=True)
    files_list.parent.mkdir(parents=True, exist_ok=True)
    files_list.write_text("".join(f"{file}\n" for file in files))
    for file in files:
        (prefix / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(entry / file, prefix / file)


def _refuse_other_file(prefix: Path, file: Path, is_ours: bool) -> None:
    """Refuse to write where a link leads out of the environment, or, unless it is ours, where a file is."""
    target = prefix / file
    there = os.path.realpath(target)
    if os.path.commonpath([there, os.path.realpath(prefix)]) != os.path.realpath(prefix):
        raise FileExistsError(f"{target} leads to {there}")
    if not is_ours and os.path.lexists(target):
        raise FileExistsError(f"{target} is there already, and not from here")


def _build(call: Call, package: InterfacePackage, environment: Environment, entry: Path) -> None:
    places = tuple(dict.fromkeys([environment.into, environment.prefix]))
    entry.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=entry.parent, prefix="new-") as name:
        folder, built = Path(name), Path(name) / "built"
        for file in package.files:
            (folder / "source" / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(package.folder / file, folder / "source" / file)
        python, paths = environment.prefix / "bin" / "python", os.pathsep.join(map(str, places))
        call([python, _GENERATING, folder, package.name, paths, *package.files], {})
        _compile(call, package, environment, folder, built)
        _collect(package, environment, folder, built)
        keep(entry, built)


def _compile(
    call: Call, package: InterfacePackage, environment: Environment, folder: Path, built: Path
) -> None:
    """Make the libraries and the Python extension of a package, those that use others after them."""
    name, lib = package.name, built / "lib"
    places = dict.fromkeys([environment.into, environment.prefix])
    headers = [f"-I{folder / generator}" for generator in LINKED_WITH]
    headers += [f"-I{each}" for each in _include_folders(places, environment)]
    search = [f"-L{lib}", *(f"-L{place / 'lib'}" for place in places)]

    def link(source: Path, out: Path, *libraries: str) -> None:
        language = (compiler(*C_COMPILERS), *C_FLAGS)
        if source.suffix == ".cpp":
            language = (compiler(*CXX_COMPILERS), *CXX_FLAGS)
        soname = f"-Wl,-soname,{out.name}"
        used = [f"-l{each}" for each in libraries]
        call([*language, *FLAGS, soname, *headers, source, "-o", out, *search, *used], {})

    def make_library(generator: str) -> None:
        own = [f"{name}__{each}" for each in LINKED_FIRST.get(generator, ("rosidl_generator_c",))]
        kinds = (generator, "rosidl_generator_c")
        others = [f"{needed}__{kind}" for needed in package.needs for kind in kinds]
        there = [
            each for each in others if any((place / "lib" / f"lib{each}.so").exists() for place in places)
        ]
        (source,) = folder.glob(f"{generator}.c*")
        link(source, lib / f"lib{name}__{generator}.so", *own, *there, *LINKED_WITH[generator])

    lib.mkdir(parents=True)
    make_library("rosidl_generator_c")
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        list(pool.map(make_library, [each for each in LINKED_WITH if each not in LINKED_FIRST]))
    make_library("rosidl_generator_py")
    python = folder / "rosidl_generator_py" / name
    link(
        python / f"_{name}_s.ep.rosidl_typesupport_c.c",
        python / f"{name}_s__rosidl_typesupport_c{sysconfig.get_config_var('EXT_SUFFIX')}",
        *(f"{name}__{each}" for each in ("rosidl_generator_py", *LINKED_FIRST["rosidl_generator_py"])),
    )


def _include_folders(places: Iterable[Path], environment: Environment) -> Iterator[Path]:
    yield Path(sysconfig.get_path("include"))
    for core in ("_core", "core"):  # of numpy 2 and numpy 1
        yield environment.site_packages / "numpy" / core / "include"
    for place in places:
        yield place / "include"  # of Fast DDS
        yield from sorted((place / "include").glob("*"))  # of packages, which have a folder each


def _collect(package: InterfacePackage, environment: Environment, folder: Path, built: Path) -> None:
    """Put together what is installed, besides the libraries: Python, headers for others, definitions."""
    name, share = package.name, built / "share"
    python = environment.site_packages.relative_to(environment.prefix)
    parts = [
        (folder / "rosidl_generator_py" / name, built / python / name, ("*.py", f"{name}_s__*.so")),
        *((folder / each / name, built / "include" / name / name, ("*.h",)) for each in LINKED_WITH),
        (folder / "source", share / name, tuple(f"*.{kind}" for kind in KINDS)),
        (folder / "idl", share / name, ("*.idl", *(f"{Path(file).stem}.json" for file in package.files))),
    ]
    for source, target, patterns in parts:
        for file in (file for pattern in patterns for file in source.rglob(pattern)):
            out = target / file.relative_to(source)
            out.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, out)
    depends = "\n".join(f"  <depend>{each}</depend>" for each in package.needs)
    manifest = _PACKAGE_XML.format(name=name, version=package.version, depends=depends)
    (share / name / "package.xml").write_text(manifest, encoding="utf-8")
    types = [each for file in package.files for each in (file, str(Path(file).with_suffix(".idl")))]
    for kind, text in (("packages", ""), ("rosidl_interfaces", "\n".join(sorted(types)))):
        index = share / "ament_index" / "resource_index" / kind
        index.mkdir(parents=True)
        (index / name).write_text(text, encoding="utf-8")


def _version(program: str) -> str:
    done = subprocess.run(
        [program, "--version"], capture_output=True, text=True, errors="replace", check=False
    )
    return done.stdout.partition("\n")[0]
