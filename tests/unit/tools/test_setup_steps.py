"""The parts of ``make setup``, without a network and without a compiler."""

from __future__ import annotations

import sys
import sysconfig
import threading
import time
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from florence_bt.app.interfaces import building

ROOT = Path(__file__).parents[3]
PYTHON = f"python{sys.version_info[0]}.{sys.version_info[1]}"
MODULE = f"lib/{PYTHON}/site-packages/tf2_msgs/_tf.py"


@pytest.fixture
def steps(monkeypatch):
    """The package ``tools/setup_steps``."""
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from setup_steps import dependencies, interfaces, kernels, machine, progress

    class Steps:
        pass

    for module in (dependencies, interfaces, kernels, machine, progress):
        setattr(Steps, module.__name__.rpartition(".")[2], module)
    return Steps


@pytest.fixture
def interfaces(steps, monkeypatch, tmp_path):
    """The step of the interfaces, for an empty environment and an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(steps.machine, "VENV", tmp_path / "venv")
    monkeypatch.setattr(steps.interfaces, "SOURCES", tmp_path / "interfaces")
    monkeypatch.setattr(steps.interfaces, "NAV2_MSGS", tmp_path / "interfaces" / "tf2_msgs")
    monkeypatch.setattr(steps.interfaces, "OF_NAV2", ("msg/TFMessage.msg",))
    package = tmp_path / "interfaces" / "tf2_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>tf2_msgs</name></package>")
    (package / "msg" / "TFMessage.msg").write_text("int8 a")
    return steps.interfaces


class FakeBuild:
    """Answers the commands of a build: the generators write a header and a Python module, and are counted."""

    def __init__(self, fails: Exception | None = None) -> None:
        self.fails = fails
        self.builds = 0

    def call(self, command, environment=None) -> None:
        words = [str(word) for word in command]
        if "generating.py" not in words[1]:
            out = Path(words[words.index("-o") + 1])
            out.write_text(out.name)
            return
        self.builds += 1
        folder, name, (message,) = Path(words[2]), words[3], words[5:]
        for generator in building.LINKED_WITH:
            (folder / generator / name).mkdir(parents=True)
            (folder / f"{generator}.c").touch()
        text = (folder / "source" / message).read_text()
        (folder / "rosidl_generator_c" / name / "tf.h").write_text(text)
        (folder / "rosidl_generator_py" / name / "_tf.py").write_text(text)
        if self.fails:
            raise self.fails

    def side_by_side(self, *works) -> None:
        for work in works:
            work()


def installed(tmp_path: Path) -> set[str]:
    return {
        str(file.relative_to(tmp_path / "venv"))
        for folder in ("lib", "include", "share")
        for file in (tmp_path / "venv" / folder).rglob("*")
        if file.is_file()
    }


def test_a_package_is_built_once_for_all_checkouts(interfaces, tmp_path, monkeypatch, capsys):
    build = FakeBuild()
    interfaces.step(build).work()
    assert installed(tmp_path) == {
        MODULE,
        "include/tf2_msgs/tf2_msgs/tf.h",
        *(f"lib/libtf2_msgs__{generator}.so" for generator in building.LINKED_WITH),
        f"lib/{PYTHON}/site-packages/tf2_msgs/"
        f"tf2_msgs_s__rosidl_typesupport_c{sysconfig.get_config_var('EXT_SUFFIX')}",
        "share/tf2_msgs/package.xml",
        "share/tf2_msgs/msg/TFMessage.msg",
        "share/ament_index/resource_index/packages/tf2_msgs",
        "share/ament_index/resource_index/rosidl_interfaces/tf2_msgs",
    }
    monkeypatch.setattr(interfaces.machine, "VENV", tmp_path / "second")
    interfaces.step(build).work()
    assert build.builds == 1
    assert (tmp_path / "second" / MODULE).read_text() == "int8 a"
    said = capsys.readouterr().out
    assert said.index("tf2_msgs built") < said.index("tf2_msgs from the cache")


def test_a_changed_message_is_built_and_the_one_of_before_comes_from_the_cache(interfaces, tmp_path):
    build, step = FakeBuild(), interfaces.step(FakeBuild())
    message = tmp_path / "interfaces" / "tf2_msgs" / "msg" / "TFMessage.msg"
    interfaces.step(build).work()
    assert step.is_done()
    message.write_text("int8 b")
    assert not step.is_done()
    interfaces.step(build).work()
    assert (tmp_path / "venv" / MODULE).read_text() == "int8 b"
    message.write_text("int8 a")
    interfaces.step(build).work()
    assert build.builds == 2
    assert (tmp_path / "venv" / MODULE).read_text() == "int8 a"


@pytest.mark.parametrize("change", ["generator", "compiler"])
def test_other_tools_build_again(interfaces, steps, tmp_path, monkeypatch, change):
    build = FakeBuild()
    interfaces.step(build).work()
    if change == "generator":
        installed = tmp_path / "venv" / "lib" / PYTHON / "site-packages" / "ros_rosidl_parser-9.dist-info"
        installed.mkdir(parents=True)
    else:
        monkeypatch.setattr(building, "_version", lambda program: "cc 99")
    interfaces.step(build).work()
    assert build.builds == 2


@pytest.mark.parametrize("error", [KeyboardInterrupt(), RuntimeError("the compiler failed")])
def test_a_build_that_did_not_end_leaves_nothing_in_the_cache(interfaces, tmp_path, error):
    with pytest.raises(type(error)):
        interfaces.step(FakeBuild(error)).work()
    assert list((tmp_path / "cache" / "florence_bt" / "interfaces").iterdir()) == []
    assert installed(tmp_path) == set()
    interfaces.step(build := FakeBuild()).work()
    assert build.builds == 1


def test_two_set_ups_that_build_the_same_package_keep_one(interfaces, tmp_path):
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(name)
        building.keep(tmp_path / "entry", tmp_path / name)
    assert (tmp_path / "entry" / "file").read_text() == "first"


def test_a_cache_that_cannot_be_written_is_replaced_by_one_in_the_environment(interfaces, tmp_path):
    (tmp_path / "cache").write_text("a file, so that nobody can make the folder, not even root")
    assert building.cache_folder(interfaces._environment()) == tmp_path / "venv" / "florence-setup" / "cache"
    interfaces.step(FakeBuild()).work()
    assert MODULE in installed(tmp_path)


def test_files_that_a_package_no_longer_has_are_removed_and_no_others(interfaces, tmp_path):
    files_list = tmp_path / "files"
    for names in (("a", "b"), ("b",)):
        entry = tmp_path / f"entry-{len(names)}"
        (entry / "lib").mkdir(parents=True)
        for name in names:
            (entry / "lib" / name).write_text(name)
        building.install(entry, tmp_path / "venv", files_list)
        (tmp_path / "venv" / "lib" / "other").touch()
    assert {file.name for file in (tmp_path / "venv" / "lib").iterdir()} == {"b", "other"}


def test_a_package_of_the_distribution_is_not_built(interfaces, tmp_path):
    theirs = tmp_path / "venv" / "share" / "tf2_msgs" / "package.xml"
    theirs.parent.mkdir(parents=True)
    theirs.write_text("theirs")
    interfaces.step(build := FakeBuild()).work()
    assert build.builds == 0
    assert theirs.read_text() == "theirs"


def test_every_requirement_is_pinned_in_its_section(steps):
    lock = steps.dependencies.read_lock(steps.dependencies.LOCK.read_text())
    project = tomllib.loads(steps.dependencies.PROJECT.read_text())
    extras = project["project"]["optional-dependencies"]
    needed = {
        "base": project["build-system"]["requires"],
        "build": [*extras["ros"], *extras["build"]],
        "run": [*project["project"]["dependencies"], *extras["robot"], *extras["sim"], *extras["draw"]],
        "test": extras["dev"],
    }
    pinned: dict[str, str] = {}
    for section, requirements in needed.items():
        pinned |= dict(pin.split("==") for pin in lock[section])
        for text in requirements:
            requirement = Requirement(text)
            version = pinned[requirement.name.lower().replace("_", "-")]
            assert requirement.specifier.contains(version), text


def test_no_package_is_in_two_sections(steps):
    lock = steps.dependencies.read_lock(steps.dependencies.LOCK.read_text())
    names = [pin.partition("==")[0] for pins in lock.values() for pin in pins]
    assert len(names) == len(set(names))


def test_a_lock_is_read_as_it_was_written(steps):
    text = steps.dependencies.write_lock(
        ["a==1", "b==2", "c==3", "d==4", "e==5"],
        {"base": ["e==5"], "build": ["a==1", "e==5"], "run": ["c==3", "a==1"]},
    )
    assert steps.dependencies.read_lock(text) == {
        "base": ["e==5"],
        "build": ["a==1"],
        "run": ["c==3"],
        "test": ["b==2", "d==4"],
    }


def test_a_lock_without_a_section_is_refused(steps):
    with pytest.raises(steps.progress.StepFailed, match="base, run, test: make lock"):
        steps.dependencies.read_lock(f"# {steps.dependencies.SECTIONS['build']}\na==1\n")


def test_a_stamped_step_is_done_until_what_it_is_made_from_changes(steps, tmp_path):
    source, works = ["one"], []
    step = steps.progress.stamped("it", tmp_path / "x.stamp", lambda: source[0], lambda: works.append(1))
    assert not step.is_done()
    step.work()
    assert step.is_done()
    source[0] = "two"
    assert not step.is_done()


def test_a_step_that_failed_is_not_done(steps, tmp_path):
    step = steps.progress.stamped("it", tmp_path / "x.stamp", lambda: "one", lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        step.work()
    assert not step.is_done()


def test_what_is_done_is_not_mentioned(steps, tmp_path, capsys):
    log = steps.progress.Log(tmp_path / "log")
    works = []
    step = steps.progress.stamped("it", tmp_path / "x.stamp", lambda: "one", lambda: works.append(1))
    log.do("[1/1]", step)
    assert capsys.readouterr().out == "[1/1] it ...\n[1/1] it: 0 s\n"
    log.do("[1/1]", step)
    assert capsys.readouterr().out == ""
    assert works == [1]


def test_when_one_thing_fails_the_commands_beside_it_are_ended(steps, tmp_path):
    log = steps.progress.Log(tmp_path / "log")
    started = tmp_path / "started"
    ends: list[object] = []

    def long() -> None:
        code = f"import pathlib, time; pathlib.Path({str(started)!r}).touch(); time.sleep(100)"
        for _ in range(2):
            try:
                log.call([sys.executable, "-c", code])
            except steps.progress.StepFailed as error:
                ends.append(error)

    def fails() -> None:
        deadline = time.monotonic() + 30.0
        while not started.exists() and time.monotonic() < deadline:
            threading.Event().wait(0.01)
        log.call([sys.executable, "-c", "print('what went wrong'); raise SystemExit(3)"])

    begin = time.monotonic()
    with pytest.raises(steps.progress.StepFailed, match=r"code 3.*\n.*what went wrong"):
        log.side_by_side(long, fails)
    assert time.monotonic() - begin < 60.0
    assert [str(error).split(":")[0].split(" with")[0] for error in ends] == [
        "this failed",
        "not started, because something else failed",
    ]


def test_the_first_failure_is_reported_and_not_what_was_ended_because_of_it(steps, tmp_path):
    log = steps.progress.Log(tmp_path / "log")
    started = threading.Barrier(3, timeout=30.0)

    def sleep() -> None:
        started.wait()
        log.call([sys.executable, "-c", "import time; time.sleep(100)"])

    def fail() -> None:
        started.wait()
        log.call([sys.executable, "-c", "raise SystemExit(3)"])

    with pytest.raises(steps.progress.StepFailed, match="code 3"):
        log.side_by_side(sleep, lambda: log.side_by_side(sleep, fail))


def test_the_step_of_the_kernels_asks_the_stamp_that_florence_up_asks(steps, tmp_path, monkeypatch):
    commands = []

    class FakeLog:
        def call(self, command) -> None:
            commands.append([str(word) for word in command])

    monkeypatch.setattr(steps.machine, "PYTHON", Path(sys.executable))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    step = steps.kernels.step(FakeLog())
    assert not step.is_done()
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert step.is_done()
    step.work()
    assert commands == [[sys.executable, "-m", "florence_bt.app.demo.kernel_cache"]]


def test_a_machine_without_the_headers_of_python_is_refused(steps, tmp_path, monkeypatch):
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    steps.machine.check()
    monkeypatch.setattr(sysconfig, "get_path", lambda name: str(tmp_path))
    with pytest.raises(steps.progress.StepFailed, match="apt install python3-dev"):
        steps.machine.check()
