"""Writes the sources of a package of ROS interfaces, by the generators of ROS 2; ``building`` compiles them.

A program of its own, for the Python of an environment that has the generators; ``building`` starts it::

    python generating.py FOLDER NAME ENVIRONMENT[:ENVIRONMENT...] msg/Grip.msg srv/Open.srv ...

The definitions are below ``FOLDER/source``. What it writes in FOLDER:

    idl/                      definitions in IDL, and the descriptions of their types (JSON)
    GENERATOR/NAME/           what each generator writes, by the generator
    GENERATOR.c, GENERATOR.cpp  a file that includes all sources of a library

Only what Python over Fast DDS loads is generated. Each generator alone would read every definition and every
template again, which is nearly all of its time: here one process runs them all and reads each once.
"""

from __future__ import annotations

import functools
import json
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import CodeType
from typing import Any

DESCRIPTIONS, FAST_DDS = "rosidl_generator_type_description", "rosidl_typesupport_fastrtps_c"
MESSAGES, INTROSPECTION = "rosidl_generator_c", "rosidl_typesupport_introspection_c"
DISPATCH, PYTHON = "rosidl_typesupport_c", "rosidl_generator_py"
LIBRARIES = {MESSAGES: ".c", FAST_DDS: ".cpp", INTROSPECTION: ".c", DISPATCH: ".cpp", PYTHON: ".c"}
"""The generators that write a library, with the language of their sources."""
WITH_EXPORTS = (MESSAGES, FAST_DDS, INTROSPECTION)
"""Those whose headers include one that says what the library exports."""
_STATIC = re.compile(r"^static [\w ]*?(\w+)(?:\[\])? =", re.MULTILINE)


def generate(folder: Path, name: str, environments: list[Path], files: list[str]) -> None:
    """Write everything.

    Args:
        folder: Holds the definitions below ``source``, and receives the rest.
        name: The name of the package.
        environments: Where the packages are installed that it needs, and in the last one the generators.
        files: The definitions, such as ``msg/Grip.msg``.
    """
    _read_everything_once()
    idl, source = folder / "idl", folder / "source"
    from rosidl_adapter import convert_to_idl

    written = [convert_to_idl(source, name, Path(file), idl).relative_to(idl) for file in files]
    run = functools.partial(_run, folder, name, environments[-1], written)
    run(DESCRIPTIONS, idl, include_paths=list(_installed(environments)))
    about = {
        "type_description_tuples": [f"{file}:{(idl / file).with_suffix('.json')}" for file in written],
        "ros_interface_files": [str(source / file) for file in files],
    }
    for generator in LIBRARIES:
        run(generator, folder / generator / name, **(about if generator == MESSAGES else {}))
        if generator in WITH_EXPORTS:
            _write_exports(folder / generator / name, name, environments[-1], generator)
        _write_library(folder, generator)
    for package in (folder / PYTHON / name, *(folder / PYTHON / name / file.parent for file in written)):
        (package / "__init__.py").touch()


def _generators() -> dict[str, Callable[[str], object]]:
    import rosidl_generator_c
    import rosidl_generator_py.generate_py_impl
    import rosidl_generator_type_description
    import rosidl_typesupport_c
    import rosidl_typesupport_fastrtps_c
    import rosidl_typesupport_introspection_c

    return {
        DESCRIPTIONS: rosidl_generator_type_description.generate_type_hash,
        MESSAGES: rosidl_generator_c.generate_c,
        FAST_DDS: rosidl_typesupport_fastrtps_c.generate_typesupport_fastrtps_c,
        INTROSPECTION: rosidl_typesupport_introspection_c.generate_c,
        DISPATCH: functools.partial(rosidl_typesupport_c.generate_c, type_supports=[FAST_DDS, INTROSPECTION]),
        # Python loads the extension of the dispatch; those of the type supports behind it are never imported.
        PYTHON: functools.partial(
            rosidl_generator_py.generate_py_impl.generate_py, typesupport_impls=[DISPATCH]
        ),
    }


def _run(
    folder: Path, name: str, environment: Path, files: Iterable[Path], generator: str, out: Path, **more: Any
) -> None:
    arguments = folder / f"{generator}.json"
    told = {
        "package_name": name,
        "idl_tuples": [f"{folder / 'idl'}:{file}" for file in files],
        "output_dir": str(out),
        "template_dir": str(environment / "share" / generator / "resource"),
        # What the age of an earlier result is compared with; there is none.
        "target_dependencies": [str(arguments)],
        **more,
    }
    arguments.write_text(json.dumps(told), encoding="utf-8")
    _generators()[generator](str(arguments))


def _installed(environments: Iterable[Path]) -> Iterator[str]:
    """Yield where the descriptions of types of other packages are; the first one of a name counts."""
    found: set[str] = set()
    for folder in (folder for place in environments for folder in (place / "share").glob("*")):
        if folder.name not in found:
            found.add(folder.name)
            yield f"{folder.name}:{folder}"


def _write_exports(out: Path, name: str, environment: Path, generator: str) -> None:
    file = f"{generator}__visibility_control.h"
    text = (environment / "share" / generator / "resource" / f"{file}.in").read_text(encoding="utf-8")
    text = text.replace("@PROJECT_NAME@", name).replace("@PROJECT_NAME_UPPER@", name.upper())
    (out / "msg").mkdir(exist_ok=True)
    (out / "msg" / file).write_text(text, encoding="utf-8")


def _write_library(folder: Path, generator: str) -> None:
    """Write a file that includes all sources: reading the same headers for each is most of a compiler's work.

    Static names of several sources clash, so that each source has its own.
    """
    suffix = LIBRARIES[generator]
    sources = sorted(file for file in (folder / generator).rglob(f"*{suffix}") if ".ep." not in file.name)
    lines = []
    for number, file in enumerate(sources):
        names = sorted(set(_STATIC.findall(file.read_text(encoding="utf-8"))))
        lines += [f"#define {name} {name}_of_{number}" for name in names]
        lines += [f'#include "{file}"', *(f"#undef {name}" for name in names)]
    (folder / f"{generator}{suffix}").write_text("\n".join([*lines, ""]), encoding="utf-8")


def _read_everything_once() -> None:
    import em
    import rosidl_generator_py.generate_py_impl
    import rosidl_generator_type_description
    import rosidl_pycommon
    from rosidl_parser.parser import parse_idl_file

    by_file: dict[Path, Any] = {}

    def parse(locator: Any) -> Any:
        file = locator.get_absolute_path()
        if file not in by_file:
            by_file[file] = parse_idl_file(locator)
        return by_file[file]

    for module in (
        rosidl_pycommon,
        rosidl_generator_type_description,
        rosidl_generator_py.generate_py_impl,
    ):
        module.parse_idl_file = parse

    @functools.cache
    def tokens(prefix: str, text: str) -> list[Any]:
        return list(iter(em.Scanner(prefix, text).one, None))

    @functools.cache
    def compiled(expression: str) -> CodeType:
        return compile(expression.strip(), "<template>", "eval")

    class Interpreter(em.Interpreter):
        """Expands a template whose text was taken apart before."""

        def parse(self, scanner: Any, locals: Any = None) -> None:
            for token in tokens(scanner.prefix, scanner.rest()):
                token.run(self, locals)

        def evaluate(self, expression: str, locals: Any = None) -> Any:
            return super().evaluate(compiled(expression), locals)

    em.Interpreter = Interpreter


if __name__ == "__main__":
    generate(Path(sys.argv[1]), sys.argv[2], [Path(each) for each in sys.argv[3].split(":")], sys.argv[4:])
