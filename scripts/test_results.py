"""What became of the tests: reads CTest's results and, of suites that ran as one process, GoogleTest's for each case."""
import re
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

BEST = ["skipped", "failed", "passed"]
README = Path(__file__).resolve().parent.parent / "tests/README.md"
MARK = re.compile(r"(<!-- dearest tests -->\n).*?(<!-- end -->)", re.S)


@dataclass(frozen=True)
class Case:
    outcome: str    # "passed", "failed" or "skipped"
    seconds: float


class Folder:
    """BUILD/test_results: STAGE.junit by CTest, TEST.xml by GoogleTest."""

    def __init__(self, build):
        self.path = Path(build) / "test_results"

    def begin(self, stage):
        """Returns the file that CTest is to write for `stage`."""
        self.path.mkdir(parents=True, exist_ok=True)
        return self.path / f"{stage}.junit"

    def read(self, junit):
        """{name: Case}: of a suite every case, of another test the test."""
        if not junit.exists():
            return {}
        cases = {}
        for test in ElementTree.parse(junit).getroot().iter("testcase"):
            name = test.get("name")
            details = self.path / (name.replace("/", "_") + ".xml")
            outcome = outcome_of(test)
            if outcome != "skipped" and details.exists():
                inner = suite_cases(details, name.partition(".")[0])
                cases.update(inner)
                if outcome == "passed" or any(case.outcome == "failed" for case in inner.values()):
                    continue
            cases[name] = Case(outcome, float(test.get("time") or 0))
        return cases

    def stages(self):
        """Names of the stages that were run."""
        return {junit.stem for junit in self.path.glob("*.junit")}

    def read_all(self):
        """Of all stages that ran, the best outcome of each test."""
        cases = {}
        for junit in sorted(self.path.glob("*.junit")):
            for name, case in self.read(junit).items():
                if name not in cases or BEST.index(case.outcome) > BEST.index(cases[name].outcome):
                    cases[name] = case
        return cases


def outcome_of(test):
    """Of a CTest's <testcase>."""
    if test.find("skipped") is not None or test.get("status") in ("notrun", "disabled"):
        return "skipped"
    return "passed" if test.get("status") == "run" and test.find("failure") is None else "failed"


def suite_cases(file, prefix):
    """{PREFIX.Suite.Name: Case} of GoogleTest's XML."""
    try:
        tests = ElementTree.parse(file).getroot().iter("testcase")
    except ElementTree.ParseError:  # the process ended before it had written all
        return {}
    found = {}
    for test in tests:
        if test.get("status") == "notrun":
            continue
        skipped = test.get("result") == "skipped" or test.find("skipped") is not None
        outcome = "skipped" if skipped else "failed" if test.find("failure") is not None else "passed"
        found[f"{prefix}.{test.get('classname')}.{test.get('name')}"] = Case(outcome, float(test.get("time") or 0))
    return found


def dearest(build, words):
    """Prints the N dearest tests of the last results, or with --write puts them into tests/README.md. Returns an exit code."""
    write = "--write" in words
    numbers = [word for word in words if word != "--write"]
    if len(numbers) > 1 or not all(re.fullmatch(r"[1-9]\d{0,3}", number) for number in numbers):
        print(f"test: --dearest {' '.join(words)}: allowed: one whole number from 1 to 9999, and --write", file=sys.stderr)
        return 2
    count = int(numbers[0]) if numbers else 30
    cases = Folder(build).read_all()
    if not cases:
        print("test: no results yet; scripts/test leaves them", file=sys.stderr)
        return 3
    rows = sorted(((case.seconds, name) for name, case in cases.items()), reverse=True)[:count]
    total = sum(case.seconds for case in cases.values())
    lines = [f"{len(cases)} tests, {total:.0f} test seconds.", "", "| test | s |", "|---|---|"]
    lines += [f"| {name.replace('|', ' ')} | {seconds:.1f} |" for seconds, name in rows]
    text = "\n".join(lines) + "\n"
    if write:
        page, changed = MARK.subn(lambda match: match[1] + text + match[2], README.read_text())
        if not changed:
            print(f"test: {README}: no marks for the table", file=sys.stderr)
            return 1
        README.write_text(page)
    else:
        print(text, end="")
    return 0
