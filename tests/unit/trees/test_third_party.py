"""What installed packages bring: skills, missions, commands and processes; what becomes of broken ones."""

import sys

import pytest
from typer.testing import CliRunner

from florence_bt.app.bringup import preflight
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.package_processes import package_processes
from florence_bt.app.bringup.topology import loaded_for, observers, processes
from florence_bt.cli import application
from florence_bt.cli.exit_codes import OK, USAGE
from florence_bt.core.errors import ConfigError
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations, own_declarations
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary

SKILL = "from florence_bt.core.declaration import SkillDeclaration\n{}\n"
TREE = "tree: {{{}: {{}}}}\n"


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Puts packages on the path as an installer leaves them; forgets their modules afterwards."""
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    before = set(sys.modules)

    def installer(name, files, skills=None, missions=None, commands=None, processes=None):
        for path, text in files.items():
            file = site / name / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        info = site / f"{name}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        points = [f"[florence_bt.skills]\n{name} = {skills}\n"] if skills else []
        points += [f"[florence_bt.missions]\n{name} = {missions}\n"] if missions else []
        points += [f"[florence_bt.commands]\n{name} = {commands}\n"] if commands else []
        points += [f"[florence_bt.processes]\n{name} = {processes}\n"] if processes else []
        (info / "entry_points.txt").write_text("\n".join(points))

    yield installer
    for name in set(sys.modules) - before:
        # Only theirs: libraries that were loaded meanwhile must not be loaded twice.
        if str(site) in str(
            getattr(sys.modules[name], "__file__", "") or getattr(sys.modules[name], "__path__", "")
        ):
            del sys.modules[name]


def wave(code):
    return SKILL.format(code)


def test_a_package_brings_skills_and_missions(install):
    install(
        "waver",
        {
            "__init__.py": "",
            "skills.py": wave("WAVE = SkillDeclaration('wave_hand', 'Wave')"),
            "missions/greet.yaml": "mission: greet\ntree: {wave_hand: }\n",
        },
        skills="waver.skills",
        missions="waver.missions",
    )
    declarations, library = collect_declarations(), MissionLibrary.load()
    assert declarations["wave_hand"].summary == "Wave"
    assert list(declarations) == sorted(declarations)
    assert check(library.get("greet"), library, declarations) == []
    assert (declarations.findings, library.findings) == ((), [])
    assert "wave_hand" not in own_declarations()
    assert "greet" not in MissionLibrary.load(built_in=False)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (
            "1 / 0",
            "'waver.skills' (entry point 'waver' of florence_bt.skills) cannot be imported: ZeroDivision",
        ),
        ("import sys; sys.exit(3)", "cannot be imported: SystemExit: 3"),
        (
            "import no_such_module",
            "cannot be imported: ModuleNotFoundError: No module named 'no_such_module'",
        ),
        ("def broken(:", "cannot be imported: SyntaxError"),
        (
            "TURN = SkillDeclaration('turn', 'Turn')",
            "its skill 'turn' is ignored: Florence BT itself has one",
        ),
        ("IF = SkillDeclaration('if', 'If')", "a skill cannot be called 'if'"),
        ("IF = SkillDeclaration('Wave-Hand', 'Wave')", "a skill cannot be called 'Wave-Hand'"),
    ],
)
def test_a_broken_package_takes_nothing_else_away(install, code, message):
    install("waver", {"__init__.py": "", "skills.py": wave(code)}, skills="waver.skills")
    install(
        "zebra",
        {"__init__.py": "", "skills.py": wave("A = SkillDeclaration('act', 'Act')")},
        skills="zebra.skills",
    )
    declarations = collect_declarations()
    assert "act" in declarations and "turn" in declarations
    (finding,) = declarations.findings
    assert (finding.file, finding.severity) == ("package waver", "warning")
    assert message in finding.message


def test_a_package_that_is_installed_later_is_found(install):
    files = {"__init__.py": "", "hello.yaml": "mission: hello\ntree: {fail: x}\n"}
    assert "hello" not in MissionLibrary.load()
    install("waver", files, missions="waver")
    assert "hello" in MissionLibrary.load()


def test_two_packages_with_one_skill(install):
    for name in ("apple", "berry"):
        files = {"__init__.py": "", "skills.py": wave(f"A = SkillDeclaration('act', '{name}')")}
        install(name, files, skills=f"{name}.skills")
    declarations = collect_declarations()
    assert declarations["act"].summary == "apple"
    (finding,) = declarations.findings
    assert finding.file == "package berry" and "package apple has one of that name" in finding.message


@pytest.mark.parametrize(
    ("missions", "message"),
    [("waver.gone", "is not a package folder"), ("waver", None), ("nowhere.missions", "cannot be found")],
)
def test_folders_of_missions(install, missions, message):
    install(
        "waver", {"__init__.py": "", "hello.yaml": "mission: hello\ntree: {fail: x}\n"}, missions=missions
    )
    library = MissionLibrary.load()
    if message is None:
        assert "hello" in library
    else:
        (finding,) = library.findings
        assert finding.file == "package waver" and message in finding.message
    assert "goto_user" in library


def test_shadowing_is_said_with_both_files(install, tmp_path):
    install(
        "waver",
        {"__init__.py": "", "missions/goto_room.yaml": "mission: goto_room\ntree: {fail: x}\n"},
        missions="waver.missions",
    )
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "goto_room.yaml").write_text("mission: goto_room\ntree: {fail: y}\n")
    library = MissionLibrary.load([folder])
    theirs = tmp_path / "site" / "waver" / "missions" / "goto_room.yaml"
    said = [(f.file, f.severity, f.message) for f in library.findings]
    assert said == [
        (
            str(folder / "goto_room.yaml"),
            "warning",
            f"this mission shadows the one of the same name in {theirs}",
        ),
        (
            str(theirs),
            "warning",
            f"this mission shadows the one of the same name in {BUILT_IN / 'goto_room.yaml'}",
        ),
    ]
    assert library.get("goto_room").file == folder / "goto_room.yaml"


def test_a_plain_copy_shadows_nothing(tmp_path):
    (tmp_path / "goto_room.yaml").write_bytes((BUILT_IN / "goto_room.yaml").read_bytes())
    library = MissionLibrary.load([tmp_path, tmp_path])
    assert library.findings == []


COMMANDS = """import typer
from florence_bt.core.errors import ConfigError
app = typer.Typer()
@app.command()
def dance(steps: int) -> None:
    \"\"\"Dance.\"\"\"
    if steps < 1:
        raise ConfigError("too few steps", valid=["1"])
    print(f"{steps} steps")
@app.command()
def check() -> None:
    print("mine")
"""


@pytest.fixture
def florence():
    return lambda *words: CliRunner().invoke(application.app, words)


def test_a_package_brings_commands_with_florences_errors_and_exit_codes(install, florence):
    install("dancer", {"__init__.py": "", "commands.py": COMMANDS}, commands="dancer.commands:app")
    assert (florence("dance", "2").exit_code, florence("dance", "2").stdout) == (OK, "2 steps\n")
    failed = florence("dance", "0")
    assert failed.exit_code == USAGE and "too few steps" in failed.stderr
    assert "Dance." in florence("--help").stdout


def test_a_package_cannot_replace_a_command(install, florence, tmp_path):
    install("dancer", {"__init__.py": "", "commands.py": COMMANDS}, commands="dancer.commands:app")
    (tmp_path / "idle.yaml").write_text("mission: idle\ntree: {wait: 1 s}\n")
    checked = florence("check", str(tmp_path))
    assert checked.exit_code == OK and "mine" not in checked.stdout
    assert "package dancer: its command 'check' is ignored" in florence("--help").stderr


def test_commands_that_cannot_be_loaded_take_nothing_else_away(install, florence, tmp_path):
    install("broken", {"__init__.py": "", "commands.py": "1 / 0"}, commands="broken.commands:app")
    install("dancer", {"__init__.py": "", "commands.py": COMMANDS}, commands="dancer.commands:app")
    danced = florence("dance", "3")
    assert danced.stdout == "3 steps\n"
    assert "package broken" in danced.stderr and "ZeroDivisionError" in danced.stderr


PROCESS = """
from florence_bt.app.bringup.package_processes import PackageProcess

WATCHER = PackageProcess(
    name="watcher", node="watcher_node", node_class="watcher.node:Watcher",
    is_wanted=lambda options: options.emulated, parameters=lambda options: {}, check=lambda options: None,
    told=lambda options: "it watches",
)
"""


@pytest.fixture
def found():
    """The processes of installed packages, looked for anew."""
    package_processes.cache_clear()
    yield package_processes
    package_processes.cache_clear()


def test_a_package_brings_a_process_that_nothing_depends_on(install, found):
    install("watcher", {"__init__.py": PROCESS}, processes="watcher:WATCHER")
    assert "watcher" in [each.name for each in found()]
    without, options = BringUp(folder="x"), BringUp(folder="x", emulated=True)
    assert "watcher" not in processes(without)
    assert [*processes(options)][-1] == "watcher" and "watcher" in observers(options)
    assert "watcher.node" in loaded_for("watcher", options)


@pytest.mark.parametrize(
    ("text", "points", "told"),
    [
        ("", "broken:NONE", "package broken.*cannot be loaded.*NONE"),
        ("raise RuntimeError('no')", "broken:NONE", "package broken.*RuntimeError: no"),
        ("NONE = 3", "broken:NONE", "3.*would have worked: a PackageProcess"),
    ],
)
def test_a_process_that_cannot_be_loaded_is_told_with_its_package(install, found, text, points, told):
    install("broken", {"__init__.py": text}, processes=points)
    with pytest.raises(ConfigError, match=told):
        found()


def test_a_page_that_is_not_installed_is_told_with_how_to_get_it(monkeypatch):
    monkeypatch.setattr(preflight, "package_processes", lambda: ())
    with pytest.raises(ConfigError, match=r"the page is not installed.*make setup"):
        preflight.check_options(BringUp(folder="x", page_port=8080))
