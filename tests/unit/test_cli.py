"""The command line without a running system: answers, exit codes, and how little it loads."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
import typer
from typer.testing import CliRunner

from florence_bt.cli import VERBS
from florence_bt.cli.application import app
from florence_bt.cli.common import key_values
from florence_bt.cli.exit_codes import FAILED, INTERRUPTED, NOT_THERE, OK, USAGE
from florence_bt.core.errors import ConfigError, DeviceTimeout, FlorenceError
from florence_bt.trees.language.loader import BUILT_IN

GOOD = "mission: {name}\ndescription: A test.\ntree:\n  wait: 1 s\n"
BAD = "mission: {name}\ndescription: A test.\ntree:\n  wate: 1 s\n"


@pytest.fixture
def florence():
    def call(*arguments):
        return CliRunner().invoke(app, [str(argument) for argument in arguments], catch_exceptions=False)

    return call


@pytest.fixture
def mission(tmp_path):
    def write(name, text=GOOD):
        file = tmp_path / f"{name}.yaml"
        file.write_text(text.format(name=name))
        return file

    return write


def test_check_of_good_missions(florence, mission, tmp_path):
    done = florence("check", mission("one"), mission("two"))
    assert done.exit_code == OK and "2 missions checked: no problem found" in done.stdout
    assert florence("check", tmp_path).exit_code == OK
    assert florence("check", BUILT_IN).exit_code == OK


def test_check_tells_the_place_of_an_error(florence, mission):
    file = mission("wrong", BAD)
    done = florence("check", mission("one"), file)
    assert done.exit_code == FAILED
    assert f"{file}:4:3: error:" in done.stdout and "wait" in done.stdout and "1 error" in done.stdout


def test_check_as_json_and_as_annotations(florence, mission):
    file = mission("wrong", BAD)
    done = florence("check", file, "--format", "json")
    assert done.exit_code == FAILED and json.loads(done.stdout)[0]["line"] == 4
    assert florence("check", file, "--format", "github").stdout.startswith("::error file=")
    assert json.loads(florence("check", mission("one"), "--format", "json").stdout) == []


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"a: [", b"- 1", b"\x00", b"mission: x\n", b"&a [*a]"])
def test_check_of_files_that_are_no_missions(florence, tmp_path, content):
    file = tmp_path / "odd.yaml"
    file.write_bytes(content)
    done = florence("check", file)
    assert done.exit_code == FAILED and str(file) in done.stdout


def test_check_of_wrong_usage(florence, mission, tmp_path):
    (tmp_path / "empty").mkdir()
    for arguments, text in (
        ([tmp_path / "nothing.yaml"], "there is no file"),
        ([tmp_path / "empty"], "no mission file"),
        ([mission("one"), "--format", "xml"], "text"),
        ([mission("one"), "--hotspots", tmp_path / "none.yaml"], "hotspots"),
        ([], "Missing argument"),
        ([mission("one"), "--formt", "xml"], "No such option"),
    ):
        done = florence("check", *arguments)
        assert done.exit_code == USAGE and text in done.stderr, done.stderr


def test_check_of_labels_against_the_hotspots(florence, tmp_path):
    file = tmp_path / "go.yaml"
    file.write_text("mission: go\ndescription: Goes.\ntree:\n  call: goto_room\n  in: {room: kitchn}\n")
    spots = tmp_path / "spots.yaml"
    spots.write_text("hotspots:\n- {label: kitchen, x: 1, y: 2}\n")
    assert florence("check", file, "--hotspots", spots).exit_code in (OK, FAILED)
    spots.write_text("hotspots:\n- {label: kitchen, x: 1}\n")
    assert florence("check", file, "--hotspots", spots).exit_code == USAGE


def test_missions_are_listed_with_their_inputs(florence):
    done = florence("missions")
    assert done.exit_code == OK
    assert "goto_user" in done.stdout and "room: text (required)" in done.stdout
    assert "rooms: list of text = []\n" in done.stdout


def test_missions_of_a_folder_and_what_cannot_be_read(florence, mission, tmp_path):
    mission("mine")
    mission("torn", "mission: [")
    done = florence("missions", "--missions", tmp_path)
    assert done.exit_code == OK and "mine" in done.stdout and "torn.yaml" in done.stderr
    assert florence("missions", "--missions", tmp_path / "none").exit_code == USAGE


def test_draw_as_text_and_into_files(florence, mission, tmp_path):
    done = florence("draw", "goto_user")
    assert done.exit_code == OK and "goto_user" in done.stdout
    for ending in ("svg", "txt", "mermaid"):
        out = tmp_path / f"tree.{ending}"
        done = florence("draw", mission("mine"), "-o", out)
        assert done.exit_code == OK and "mine" in out.read_text()
    assert len(florence("draw", "goto_user", "--expand").stdout) > len(florence("draw", "goto_user").stdout)


def test_draw_of_what_cannot_be_drawn(florence, mission, tmp_path):
    for arguments, text in (
        (["goto_usr"], "goto_user"),
        (["goto_user", "-o", tmp_path / "tree.gif"], ".svg"),
        (["goto_user", "-o", tmp_path / "tree"], "without an ending"),
        (["goto_user", "-o", tmp_path / "none" / "tree.svg"], "cannot be written"),
        ([mission("torn", "mission: [")], "torn.yaml"),
        ([tmp_path / "none.yaml"], "there is no file"),
        (["goto_user", "--missions", tmp_path / "none"], "no folder"),
    ):
        done = florence("draw", *arguments)
        assert done.exit_code == USAGE and text in done.stderr, (arguments, done.stderr)


def test_draw_of_a_mission_with_errors_does_not_break(florence, mission):
    assert florence("draw", mission("wrong", BAD)).exit_code in (OK, USAGE)


def test_wrong_usage_of_the_other_verbs(florence, tmp_path):
    for arguments, text in (
        (["run", "goto_room", "kitchen"], "key=value"),
        (["run", "goto_room", "=kitchen"], "key=value"),
        (["run", "goto_room", "room=hall", "room=kitchen"], "room is given twice"),
        (["run", "goto_room", "--policy", "queue", "--policy", "reject"], "--policy is given 2 times"),
        (["hotspot", "add", "sofa", "x=1", "x=2"], "x is given twice"),
        (["run", "goto_room", "room=a", "room=b", "speed=1", "speed=2"], "speed is given twice"),
        (["run", "goto_room", "--policy", "never"], "--policy"),
        (["up"], "--sim"),
        (["up", "--sim", "--robot", "robot.yaml"], "--robot CONFIG"),
        (["up", "--sim", "--emulate"], "--robot CONFIG --emulate"),
        (["up", "--robot", "robot.yaml", "--emulate", "--speed", "2"], "in real time"),
        (["up", "--robot", "robot.yaml", "--start", "1,2,3"], "--start"),
        (["up", "--robot", tmp_path / "none.yaml", "--out", tmp_path / "out"], "cannot be read"),
        (["demo", "--speed", "0", "--out", tmp_path / "out"], "speed"),
        (["demo", "--seed", "-1", "--out", tmp_path / "out"], "seed"),
        (["fly"], "No such command"),
    ):
        done = florence(*arguments)
        assert done.exit_code == USAGE and text in done.stderr, (arguments, done.stderr)
    assert not (tmp_path / "out").exists()


def _verbs(command, *words):
    """Every verb with its words, those of groups and of other packages too."""
    yield words, command
    if hasattr(command, "list_commands"):
        context = typer.Context(command)
        for name in command.list_commands(context):
            yield from _verbs(command.get_command(context, name), *words, name)


def test_no_verb_takes_an_option_twice_that_counts_once(florence):
    """The last one counted, in silence; arguments that are no values of the option are refused later."""
    tried = set()
    for words, verb in _verbs(typer.main.get_command(app)):
        for option in verb.params:
            if option.param_type_name != "option" or option.multiple or option.is_eager:
                continue
            once = [option.opts[0], *([] if option.is_flag else ["1"])]
            if option.opts[0] == "--ros-args":
                continue  # as all programs of ROS 2: it may come again
            done = florence(*words, *once, *once)
            assert done.exit_code == USAGE and f"{option.opts[0]} " in done.stderr, (words, once, done.output)
            assert "is given 2 times" in done.stderr, (words, once, done.output)
            tried.add(words)
    assert len(tried) > 40


def test_the_doctor_looks_at_the_folder_of_a_robot(florence, tmp_path, monkeypatch):
    looked = {}

    def examine(config, out, **rest):
        looked.update(rest, config=config, out=out)
        return iter(())

    monkeypatch.setattr("florence_bt.app.doctor.examination.examine", examine)
    made = florence("init", tmp_path / "mine", "--yes", "--emulate", "--service", "none")
    assert made.exit_code == OK, made.output
    assert florence("doctor", tmp_path / "mine").exit_code == OK
    assert looked["config"] == tmp_path / "mine" / "robot.yaml" and looked["hotspots_file"] is not None
    assert str(tmp_path / "mine") in str(looked["out"]) and not looked["hardware"], "a rehearsal has no ports"
    refused = florence("doctor", tmp_path)
    assert refused.exit_code == USAGE and "florence init" in refused.stderr


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (ConfigError("wrong"), USAGE),
        (DeviceTimeout("late"), NOT_THERE),
        (FlorenceError("broken"), NOT_THERE),
        (KeyboardInterrupt(), INTERRUPTED),
        (ModuleNotFoundError("no module", name="mujoco"), USAGE),
    ],
)
def test_every_error_has_its_exit_code_and_one_line(florence, monkeypatch, error, code):
    def fail(*arguments, **options):
        raise error

    monkeypatch.setattr("florence_bt.app.mission_files.checking.check_files", fail)
    done = florence("check", "x.yaml")
    assert done.exit_code == code
    assert done.stderr.startswith("florence: ") and done.stderr.count("\n") == 1


PROGRAM = """
import sys
from florence_bt.cli.application import app
try:
    app(sys.argv[1:], prog_name="florence")
except SystemExit as end:
    assert end.code == 0, end.code
heavy = {"numpy", "numba", "scipy", "cv2", "onnxruntime"}
heavy |= {"mujoco", "matplotlib", "rclpy", "florence_interfaces"}
print("heavy:", sorted(heavy & set(sys.modules)))
"""


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", str(BUILT_IN)],
        ["draw", "goto_user"],
        ["missions"],
        ["schema"],
        ["--help"],
        ["demo", "--help"],
    ],
)
def test_nothing_heavy_is_loaded_for(arguments):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments], capture_output=True, text=True, timeout=300
    )
    assert "heavy: []" in done.stdout, done.stdout + done.stderr


def test_each_verb_has_the_module_that_adds_it():
    found = {
        command.name or command.callback.__name__: {command.callback.__module__}
        for command in app.registered_commands
    }
    for group in app.registered_groups:
        found[group.name] = {each.callback.__module__ for each in group.typer_instance.registered_commands}
    assert set(found) == {verb for verbs in VERBS.values() for verb in verbs}
    for module, verbs in VERBS.items():
        for verb in verbs:
            assert f"florence_bt.cli.{module}" in found[verb], verb


@pytest.mark.parametrize("words", [["map", "--help"], ["where", "--help"], ["chek"]])
def test_a_command_is_the_same_when_only_its_module_is_loaded(florence, words):
    done = subprocess.run(
        [sys.executable, "-m", "florence_bt.cli", *words], capture_output=True, text=True, timeout=300
    )
    whole = florence(*words)
    assert done.returncode == whole.exit_code
    # The words: lines are as wide as the terminal.
    assert done.stdout.split() == whole.stdout.split()
    assert done.stderr.split() == whole.stderr.split()


def test_the_list_of_verbs_has_a_section_for_each_panel_and_loads_nothing_that_draws_boxes():
    program = PROGRAM.replace("heavy |= {", "heavy |= {'rich', ")
    done = subprocess.run(
        [sys.executable, "-c", program, "--help"], capture_output=True, text=True, timeout=300
    )
    assert "heavy: []" in done.stdout
    sections = [line for line in done.stdout.splitlines() if line.endswith(":") and line[:1].isalpha()]
    assert sections == ["Options:", "The system:", "Mission files:", "Runs:", "The robot:"]
    assert "  release     End the manual override: missions may start again.\n" in done.stdout


def test_the_list_of_verbs_loads_no_language():
    program = PROGRAM.replace("heavy |= {", "heavy |= {'yaml', 'florence_btcpp.exporter', ")
    done = subprocess.run(
        [sys.executable, "-c", program, "--help"], capture_output=True, text=True, timeout=300
    )
    assert "export" in done.stdout and "heavy: []" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("patience=30 s", "patience='30 s'"),
        ("pose={x: 1 m, y: 2 m, yaw: 0} speed=1", "pose='{x: 1 m, y: 2 m, yaw: 0}'"),
        ("room=hall text=come here please", "text='come here please'"),
    ],
)
def test_a_value_that_the_shell_split_is_put_together(typed, meant):
    with pytest.raises(ConfigError) as error:
        key_values(typed.split())
    assert error.value.valid == (meant,)
