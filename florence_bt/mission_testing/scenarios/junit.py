"""Results of scenarios as JUnit XML, which continuous-integration services read."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

from florence_bt.mission_testing.scenarios.scenario import Result
from florence_bt.mission_testing.scenarios.scenario_file import ScenarioFile

_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit_xml(files: Iterable[ScenarioFile], results: Iterable[Result]) -> str:
    """The results as a document.

    Args:
        files: The files that were read; what is wrong with one is an error of its own.
        results: The scenarios that were played.
    """
    results = list(results)
    root = ET.Element("testsuites", name="florence test")
    totals = [0, 0, 0]
    for read in files:
        own = [result for result in results if result.scenario.file == read.file]
        suite = _suite(read, own)
        root.append(suite)
        for index, name in enumerate(("tests", "failures", "errors")):
            totals[index] += int(suite.get(name, "0"))
    for index, name in enumerate(("tests", "failures", "errors")):
        root.set(name, str(totals[index]))
    root.set("time", f"{sum(result.seconds for result in results):.3f}")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _suite(read: ScenarioFile, results: list[Result]) -> ET.Element:
    suite = ET.Element(
        "testsuite",
        name=_clean(str(read.file)),
        tests=str(len(results) + bool(read.findings)),
        failures=str(sum(not result.passed for result in results)),
        errors=str(int(bool(read.findings))),
        skipped="0",
        time=f"{sum(result.seconds for result in results):.3f}",
    )
    if read.findings:
        case = ET.SubElement(
            suite, "testcase", classname=_class_name(read.file), name="the file can be read", time="0"
        )
        text = "\n".join(f"{f.file}:{f.line}:{f.column}: {f.message}" for f in read.findings)
        ET.SubElement(case, "error", message=_clean(read.findings[0].message), type="error").text = _clean(
            text
        )
    for result in results:
        suite.append(_case(result))
    return suite


def _case(result: Result) -> ET.Element:
    scenario = result.scenario
    case = ET.Element(
        "testcase",
        classname=_class_name(scenario.file),
        name=_clean(scenario.name),
        file=_clean(str(scenario.file)),
        line=str(scenario.position.line),
        time=f"{result.seconds:.3f}",
    )
    if not result.passed:
        lines = [f"{scenario.file}:{at.line}:{at.column}: {problem}" for at, problem in result.problems]
        failure = ET.SubElement(
            case, "failure", message=_clean(result.problems[0][1].split("\n")[0]), type="failure"
        )
        failure.text = _clean("\n".join([*lines, "", result.report]))
        ET.SubElement(case, "system-out").text = _clean(_traces(result))
    return case


def _traces(result: Result) -> str:
    """What the nodes did, line by line, in each run of a scenario."""
    return "\n\n".join(f"trace of {play.run.run_id}:\n{play.trace()}" for play in result.plays)


def _class_name(file: Path) -> str:
    return _clean(".".join(part for part in file.with_suffix("").parts if part not in ("/", ".", "..")))


def _clean(text: str) -> str:
    """A text without the characters that XML cannot hold."""
    return _NOT_XML.sub("?", text)
