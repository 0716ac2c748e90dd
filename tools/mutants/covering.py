"""Which tests run a line: measured once for a commit by coverage.py, with a context for each test."""

from __future__ import annotations

import ast
import hashlib
import subprocess
import sys
from collections import Counter
from collections.abc import Collection, Iterable
from functools import cached_property
from pathlib import Path

from coverage import CoverageData

from tools.tables import BUILD, ROOT, git

QUICK = ("-m", "not slow and not sweep")
WITHOUT_ROS = ("tests/unit/*test_*.py", "tests/emulators/*test_*.py", "packages/*test_*.py")
OVER_ROS = "tests/ros/"
"""Where the tests of what imports rclpy lie."""
MOST = 400
"""Tests that are tried of a line; the ones that run little else come first."""


class Covering:
    """Knows the tests of each line.

    Args:
        file: Data of coverage.py, measured with ``--cov-context=test``.
        root: Where the modules were when it was measured.
    """

    def __init__(self, file: Path, root: Path) -> None:
        self._data = CoverageData(str(file))
        self._data.read()
        self._root = root

    def tests_of(self, path: str, line: int) -> list[str]:
        """Return ids of the tests that run a line of a module.

        Where none does (constants, compiled functions), those of its function, then of its module, then of
        the modules that import it.
        """
        contexts = self._contexts(path)
        for lines in (_statement(path, line), _function(path, line), contexts):
            tests = Counter(test for each in lines for test in contexts.get(each, ()))
            if tests:
                return self._specific_first(tests)
        above = [self._contexts(each) for each in importers([path], "florence_bt/*.py")]
        return self._specific_first(
            Counter(test for each in above for tests in each.values() for test in tests)
        )

    def _contexts(self, path: str) -> dict[int, list[str]]:
        found = self._data.contexts_by_lineno(str(self._root / path))
        return {
            line: [each.partition("|")[0] for each in tests if each]
            for line, tests in found.items()
            if any(tests)
        }

    def _specific_first(self, tests: Counter[str]) -> list[str]:
        """Return the tests that run little else first, those over ROS, which take long, at the end."""
        return sorted(tests, key=lambda test: (over_ros(test), -tests[test] / self._sizes[test], test))[:MOST]

    @cached_property
    def _sizes(self) -> Counter[str]:
        """How many lines of all modules each test runs."""
        sizes: Counter[str] = Counter()
        for file in self._data.measured_files():
            for tests in self._data.contexts_by_lineno(file).values():
                sizes.update({each.partition("|")[0] for each in tests})
        return sizes


def measure(paths: Collection[str], workers: int) -> Covering:
    """Run with coverage.py the tests that import modules, directly or through one other module.

    What was measured of this commit and these modules is taken as it is.

    Raises:
        RuntimeError: A test fails without any change: its word would be worth nothing.
    """
    tests = tests_near(paths)
    what = hashlib.sha256("\n".join([git("rev-parse", "HEAD"), git("diff", "HEAD"), *tests]).encode())
    file = BUILD / "mutants" / f"coverage-{what.hexdigest()[:12]}"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        settings = file.with_suffix(".ini")
        settings.write_text(f"[run]\ndata_file = {file}.part\n")
        command = [sys.executable, "-m", "pytest", "-q", "-n", str(workers), "--dist", "loadgroup", *QUICK]
        options = ["--cov=florence_bt", "--cov-context=test", "--cov-report=", f"--cov-config={settings}"]
        done = subprocess.run([*command, *options, *tests], cwd=ROOT, stdout=sys.stderr, check=False)
        if done.returncode:
            raise RuntimeError("tests fail without any mutation: mend them first")
        Path(f"{file}.part").rename(file)
    return Covering(file, ROOT)


def tests_near(paths: Collection[str]) -> list[str]:
    """Return the files of tests that import one of the modules, or a module that imports one of them.

    Those over ROS are among them for modules that import rclpy: what they do nobody can test without.
    """
    nodes = [path for path in paths if _imports_rclpy(path)]
    return [*importers(_near(paths), *WITHOUT_ROS), *importers(_near(nodes), f"{OVER_ROS}*test_*.py")]


def over_ros(test: str) -> bool:
    """Tell whether a test, by its id, needs ROS."""
    return test.startswith(OVER_ROS)


def _near(paths: Collection[str]) -> set[str]:
    packages = {str(Path(path).parent / "__init__.py") for path in paths if Path(path).name.startswith("_")}
    return {*paths, *packages, *importers({*paths, *packages}, "florence_bt/*.py")}


def _imports_rclpy(path: str) -> bool:
    """Tell whether a module lies where rclpy may be imported (the contracts of ``pyproject.toml``)."""
    parts = Path(path).with_suffix("").parts
    return "node" in parts or parts[1:2] in (("ros",), ("app",))


def importers(paths: Collection[str], *where: str) -> list[str]:
    """Return the files that import one of some modules."""
    modules = {_module(path) for path in paths}
    words = [word for name in modules for word in ("-e", name.rpartition(".")[2])]
    mentioned = git("grep", "-l", "-w", "-F", *words, "--", *where).splitlines() if words else []
    return [each for each in mentioned if each not in paths and _imports(each) & modules]


def _module(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _imports(path: str) -> set[str]:
    """Return the modules that a file imports, and the names in them: either may be a module."""
    found: set[str] = set()
    for node in ast.walk(ast.parse((ROOT / path).read_text())):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{each.name}" for each in node.names)}
    return found


def _statement(path: str, line: int) -> Iterable[int]:
    """Return the lines of the smallest statement around a line."""
    nodes = [node for node in _nodes(path, line) if isinstance(node, ast.stmt)]
    small = [node for node in nodes if not hasattr(node, "body")]
    return range(small[-1].lineno, (small[-1].end_lineno or 0) + 1) if small else (line,)


def _function(path: str, line: int) -> Iterable[int]:
    nodes = [node for node in _nodes(path, line) if isinstance(node, ast.FunctionDef)]
    return range(nodes[-1].body[0].lineno, (nodes[-1].end_lineno or 0) + 1) if nodes else ()


def _nodes(path: str, line: int) -> list[ast.AST]:
    """Return the nodes around a line, the outer ones first."""
    tree = ast.parse((ROOT / path).read_text())
    return [
        node
        for node in ast.walk(tree)
        if hasattr(node, "lineno") and node.lineno <= line <= (node.end_lineno or node.lineno)
    ]
