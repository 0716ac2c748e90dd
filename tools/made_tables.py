"""The tables of figures in the docs: which command makes each, on which page, and what it depends on.

``make figures`` works through them (:mod:`tools.figures`); the suite makes each in a small form.
"""

from __future__ import annotations

from dataclasses import dataclass

_RIG = ("florence_bt/simulation", "florence_bt/skills", "florence_bt/drivers", "config")
_MISSIONS = (*_RIG, "florence_bt/trees", "florence_bt/behaviours", "florence_bt/runtime")
_STACK = (*_MISSIONS, "florence_bt/ros", "florence_bt/app/bringup")
_DEPOT, _SANDBOX = "../shared/data/maps/depot.yaml", "../shared/data/maps/tb3_sandbox.yaml"
_FREIBURG = "../shared/data/carmen/freiburg-079-corrected.log.gz"


@dataclass(frozen=True, slots=True)
class Figures:
    """The tables that one command makes.

    Attributes:
        page: Where the tables are, below ``docs/``.
        tables: Names of their marks.
        tool: What Python is given to run, e.g. ``tools/crossing.py`` or ``-m tools.rooms``.
        arguments: Those that make what is in the page.
        small: Those of a run of seconds, for the suite; empty where what it needs is not part of the
            repository. ``LOG`` is a small log.
        depends: Folders and files whose changes can change the figures.
        write: What stands before the page in the command.
        alone: Whether it measures times, so that nothing else may run beside it.
    """

    page: str
    tables: tuple[str, ...]
    tool: str
    arguments: str
    small: str
    depends: tuple[str, ...]
    write: str = "--write"
    alone: bool = False

    @property
    def command(self) -> str:
        """Write what Python is given to make the tables of the page."""
        return " ".join(f"{self.tool} {self.arguments} {self.write} docs/{self.page}".split())


def _bench(name: str, *depends: str) -> Figures:
    return Figures(
        "notes/benchmarks.md",
        (name,),
        f"-m pytest benchmarks/{name}.py",
        "--benchmark-only",
        "--benchmark-only --small",
        (f"benchmarks/{name}.py", *depends),
        write="--figures",
        alone=True,
    )


def _attack(
    name: str, arguments: str, small: str = "--count 1", page: str = "notes/safety.md", *depends: str
) -> Figures:
    tool, parts = f"tools/safety_campaign {name}", ("tools/safety_campaign", *_STACK, *depends)
    return Figures(page, (name,), tool, arguments, small, parts, alone=True)


def _swept(page: str, name: str) -> Figures:
    depends = (f"experiments/{name}.yaml", "packages/florence_sweep/florence_sweep", *_MISSIONS)
    return Figures(page, (name,), "tools/swept.py", name, f"{name} --small --jobs 1", depends)


FIGURES: tuple[Figures, ...] = (
    Figures(
        "notes/people.md",
        ("detection",),
        "tools/detection.py",
        "--first 5000 --jobs 1",
        "--first 5000 --homes 2 --pictures 6 --jobs 1",
        ("tools/detection.py", "tools/person_network", "florence_bt/skills/people", "florence_bt/simulation"),
    ),
    Figures(
        "notes/people.md",
        ("colour",),
        "tools/colour_detection.py",
        "",
        "",
        ("tools/colour_detection.py", "tools/colour_network", "florence_bt/skills/people"),
        alone=True,
    ),
    Figures(
        "notes/people.md",
        ("crossing",),
        "tools/crossing.py",
        "--minutes 60 --jobs 1",
        "--minutes 1 --seconds 1 --jobs 1",
        ("tools/crossing.py", "florence_bt/skills/people", "florence_bt/simulation"),
    ),
    _swept("notes/trials.md", "goto_user"),
    _swept("notes/follow.md", "follow_me"),
    _swept("notes/exploration.md", "explore"),
    Figures(
        "notes/rooms.md",
        ("rooms",),
        "-m tools.rooms",
        "--seeds 1-10 11-20 101-116 21-30 201-260 301-360 --pictures build/rooms",
        "--seeds 1",
        ("tools/rooms.py", "florence_bt/skills/navigation/mapping", "florence_bt/simulation/home"),
    ),
    Figures(
        "notes/navigation.md",
        ("driving",),
        "tools/driving.py",
        f"flat {_DEPOT} {_SANDBOX} --goals 200 100 100 --seed 31",
        "flat --goals 1 --people 1",
        ("tools/driving.py", *_MISSIONS),
    ),
    Figures(
        "notes/navigation.md",
        ("lost robots",),
        "tools/lost.py",
        "--homes flat 21 22 23 24 25 --seed 61",
        "--homes flat --limit 2",
        ("tools/lost.py", *_MISSIONS),
    ),
    Figures(
        "notes/navigation.md",
        ("localisation",),
        "tools/localisation.py",
        f"--log {_FREIBURG} --seeds 1",
        "--log LOG --seeds 1 --part 0.02",
        ("tools/localisation.py", "tools/carmen_log.py", "florence_bt/skills/navigation/localisation"),
    ),
    Figures(
        "notes/navigation.md",
        ("generated localisation",),
        "tools/localisation.py",
        f"--maps {_DEPOT} {_SANDBOX} --seeds 1",
        "--maps --seeds 1 --part 0.02",
        ("tools/localisation.py", "tools/generated_log.py", "florence_bt/skills/navigation/localisation"),
    ),
    Figures(
        "notes/navigation.md",
        ("sparse localisation",),
        "tools/localisation.py",
        f"--log {_FREIBURG} --every 1 --seeds 1",
        "--every 1 --seeds 1 --part 0.02",
        ("tools/localisation.py", "tools/generated_log.py", "florence_bt/skills/navigation/localisation"),
    ),
    Figures(
        "notes/mapping.md",
        ("log",),
        "tools/mapping.py",
        f"--log {_FREIBURG} --picture docs/img/freiburg-079.png",
        "--log LOG",
        ("tools/mapping.py", "tools/carmen_log.py", "florence_bt/skills/navigation/mapping"),
        alone=True,
    ),
    Figures(
        "notes/mapping.md",
        ("generated", "flat"),
        "tools/mapping.py",
        "--generated --flat",
        "--generated --flat --part 0.02",
        ("tools/mapping.py", "tools/generated_log.py", *_MISSIONS),
        alone=True,
    ),
    Figures(
        "notes/verify.md",
        ("verified",),
        "tools/verified.py",
        "",
        "--missions goto_room go_home",
        (
            *("tools/verified.py", "florence_bt/assurance", "florence_bt/trees", "florence_bt/behaviours"),
            *("florence_bt/skills", "examples"),
        ),
    ),
    Figures(
        "notes/mutate.md",
        ("mutated",),
        "tools/mutated.py",
        "",
        "--missions goto_room goto_pose --jobs 1",
        (
            *("tools/mutated.py", "florence_bt/assurance", "florence_bt/trees", "florence_bt/behaviours"),
            *("florence_bt/mission_testing", "scenarios", "examples"),
        ),
    ),
    Figures(
        "notes/mutants.md",
        ("mutants",),
        "-m tools.mutants",
        "--count 40",
        "--count 1 --jobs 1 florence_bt/core/unquoted_commas.py",
        ("tools/mutants", "florence_bt", "tests/unit", "tests/emulators", "tests/ros", "packages"),
    ),
    Figures(
        "notes/page.md",
        ("figures",),
        "-m tools.page_figures",
        "",
        "--part 0.02",
        (
            "tools/page_figures.py",
            "packages/florence_page/florence_page",
            "florence_bt/app/guard",
            "florence_bt/runtime/journal",
        ),
        alone=True,
    ),
    _attack("overrides", "--count 500"),
    _attack("kills", "", "--count 1 --others 0"),
    _attack("hangs", "--count 5", "--count 1 --processes people"),
    _attack("pauses", ""),
    _attack("hands", "", "--count 1 --processes people"),
    _attack("restarts", "--count 200", ""),
    _attack("messages", "--count 120", "--count 2"),
    _attack(
        "presses",
        "--count 100",
        "--count 1",
        "manual/safety.md",
        "tools/faulty_proxy.py",
        "packages/florence_page/florence_page",
    ),
    _attack("busy", "--count 50", ""),
    _bench("test_bench_check", "florence_bt/trees", "florence_bt/app/mission_files", "florence_bt/cli"),
    _bench("test_bench_drivers", "florence_bt/drivers", "florence_bt/ros"),
    _bench("test_bench_localisation", "florence_bt/skills/navigation/localisation"),
    _bench("test_bench_navigation", "florence_bt/skills/navigation"),
    _bench("test_bench_people", "florence_bt/skills/people"),
    _bench("test_bench_recording", *_STACK),
    _bench("test_bench_rig", *_MISSIONS),
    _bench("test_bench_ros", "florence_bt/ros", "florence_bt/runtime", "florence_bt/trees"),
    _bench("test_bench_runs", "florence_bt/runtime", "florence_bt/trees", "florence_bt/behaviours"),
    _bench("test_bench_stack", *_STACK),
    _bench("test_bench_start", *_STACK, "florence_bt/cli"),
    _bench("test_bench_ticking", "florence_bt/behaviours", "florence_bt/trees", "florence_bt/runtime"),
)


def figures_of(table: str) -> Figures:
    """Return what makes a table.

    Raises:
        KeyError: There is no such table.
    """
    for figures in FIGURES:
        if table in figures.tables:
            return figures
    raise KeyError(f"{table!r} is not among {', '.join(name for each in FIGURES for name in each.tables)}")
