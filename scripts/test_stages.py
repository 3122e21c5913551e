"""Tests this checkout in stages; ends with a table of what was run and what was left out.

scripts/test                 stage quick: all unit and component tests and one whole system, as an ordinary user
scripts/test --list          every stage: what it shows, what it needs, how long it takes
scripts/test NAME…           these stages (each builds what it needs first)
scripts/test --gate          what CI runs: quick, everything compiled, whole systems, within a budget of minutes
scripts/test --all           every stage: hours
scripts/test --dearest N     of the last results: the N tests that take longest; with --write the table in tests/README.md

Exit codes: 0 all passed (or skipped with a reason), 1 a stage failed, 2 wrong arguments, 3 something needed is missing.
"""
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import test_results

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build/release"
CORES = os.cpu_count() or 2
# Many tests wait more than they compute: one more than there are cores keeps these busy.
JOBS = CORES + 1
# A stage of the gate that would begin after so many minutes is left out, and the table shows it: CI ends a run at 90.
GATE_LIMIT_MIN = 75


class Failed(Exception):
    """A stage failed; what failed was printed."""


@dataclass(frozen=True)
class Stage:
    name: str
    shows: str
    minutes: str
    needs: tuple = ()          # keys of NEEDS
    targets: tuple = ()        # of CMake; () builds nothing
    options: tuple = ()        # of CMake
    labels: tuple = ()         # a ctest stage: tests that carry all of these
    commands: tuple = ()       # run one after the other; {build}: the build folder, {other}: the other release
    gate: bool = False


# A need: how to see it, what to say where it is not met.
def has_apt_mirror():
    """A package list is there and its server answers."""
    return subprocess.run(["apt-get", "--print-uris", "-qq", "download", "dpkg"], stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL).returncode == 0


NEEDS = {
    "root": (lambda: os.geteuid() == 0, "the rights of root"),
    "namespaces": (lambda: subprocess.run(["unshare", "--net", "true"], stderr=subprocess.DEVNULL).returncode == 0, "network namespaces"),
    "qemu": (lambda: shutil.which("qemu-system-x86_64") is not None, "qemu-system-x86"),
    "clang": (lambda: shutil.which("clang++") is not None, "clang"),
    "scans": (lambda: Path("/usr/share/doc/opencv-doc/examples/surface_matching/data").is_dir() and
              Path("/usr/share/mrpt/datasets").is_dir(), "scripts/setup --data"),
    "mirror": (has_apt_mirror, "a mirror of Debian"),
}
HOST = ("root", "namespaces")


def ctest_stage(name, shows, minutes, **more):
    return Stage(name, shows, minutes, targets=(f"stage_{name}",), labels=(f"^stage:{name}$",), **more)


STAGES = [
    Stage("quick", "sources checked, all unit and component tests, one whole system with the page open", "20 (built: 5)",
          targets=("stage_quick",), gate=True),
    Stage("compile", "all that is in the tree compiles: every test, benchmark, fuzzer, example, the page without the browser's scene",
          "6", targets=("all", "benchmarks", "stage_compile"), options=("-DPHANTOM_BUILD_BENCH=ON",), labels=("^stage:compile$",), gate=True),
    Stage("bench", "every benchmark runs once, every row of the targets has its benchmarks", "1", targets=("benchmarks", "components"),
          options=("-DPHANTOM_BUILD_BENCH=ON",), commands=("scripts/bench --once --build {build}",), gate=True),
    ctest_stage("system", "the executables together: faults, CAN drives, ROS 2, recordings, surgery, signals, hung threads", "14", gate=True),
    Stage("hosts_short", "two hosts, a stop across a cut cable, the shield wall", "3", needs=HOST, targets=("stage_hosts",),
          labels=("^stage:hosts$", "^gate$"), gate=True),
    Stage("chaos_short", "half a minute of kills, freezes and cuts, and no promise broken", "1", needs=HOST, targets=("stage_chaos",),
          commands=("scripts/chaos --minutes 0.5 --seed 1 --bin {build}/bin --helpers {build}/tests --report {build}/chaos-report/short",),
          gate=True),
    Stage("packages", "each Debian package holds its own files and depends on what it needs", "1", targets=("all",),
          labels=("^stage:packages$",), gate=True),
    ctest_stage("browser", "the operator's page in Chromium and Firefox: every control, stop, review, headset", "15"),
    ctest_stage("thorough", "the long forms of tests that quick runs with fewer seeds, states or minutes", "30"),
    ctest_stage("model", "spin searches the model of the link over all interleavings, and finds every seeded defect", "5"),
    ctest_stage("experiments", "the thesis's experiments in their fast form, and with each law broken", "8"),
    ctest_stage("hosts", "several hosts: the shield wall, bad links, kills, rejoining, tunnels", "20", needs=HOST),
    ctest_stage("wire", "floods, forged departures and damaged datagrams at processes of ours", "12", needs=HOST),
    ctest_stage("chaos", "the whole system under chaos, plain and secured", "5", needs=HOST),
    Stage("fuzz", "what parses input from outside, by libFuzzer for a minute", "10", needs=("clang",), commands=("scripts/fuzz 60",)),
    Stage("can_vm", "the drive code on real SocketCAN, a gamepad and a camera, in a virtual machine", "12", needs=("qemu", "mirror"),
          targets=("components", "can_test", "drives_test", "master_io_test", "video_device_test"), commands=("scripts/test_can_vm {build}",)),
    Stage("services", "the packages on a bare Debian that systemd boots: every service killed, frozen and started again", "8",
          needs=("root", "mirror"), targets=("all",), commands=("scripts/test_packages {build}",)),
    Stage("services_vm", "the packages in a virtual machine with CAN, arms whose drives, buses and processes fail", "12",
          needs=("root", "mirror", "qemu"), targets=("all",), commands=("scripts/test_packages --vm {build}",)),
    Stage("other_release", "the other release of Debian: the demo, the tests of DDS, a site of both releases", "40", needs=("root", "mirror"),
          targets=("all",), commands=("scripts/test_debian {other} --ci",)),
    ctest_stage("real_data", "depth images, fusion and pose checks on a scanned thing, a real range image and captured rooms", "3", needs=("scans",)),
    ctest_stage("seeded_faults", "the tool that seeds faults works", "2"),
    Stage("all_seeded_faults", "each fault that is seeded into the code is found by a test", "60", commands=("scripts/checks/seeded_faults --all",)),
    Stage("without_scene", "the operator's page of a viewer that is built without the browser's scene", "10",
          commands=("cmake --preset release -B build/noscene -DPHANTOM_BROWSER_SCENE=OFF", "cmake --build build/noscene --target operators_page_test",
                    "ctest --test-dir build/noscene --output-on-failure -R ^operators_page[.]")),
    Stage("objects", "every source compiles alone", "25", commands=("scripts/checks/objects --without-tests",)),
    Stage("reproducible", "packages built twice are the same, byte by byte", "30", targets=("all",),
          commands=("scripts/checks/reproducible_packages --whole {build}",)),
]
BY_NAME = {stage.name: stage for stage in STAGES}


def run(*command, **more):
    """Runs a command with its output shown; raises Failed with its words if it fails."""
    words = [str(word) for word in command]
    status = subprocess.run(words, cwd=ROOT, **more).returncode
    if status != 0:
        print(f"test: ended with {status}: {' '.join(words)}", file=sys.stderr)
        raise Failed()


def check_sources():
    """The checks of the sources, silent unless one fails: they run beside the build."""
    return subprocess.run(["scripts/checks/all"], cwd=ROOT).returncode == 0


def build(stage):
    if not stage.targets:
        return
    run("cmake", "--preset", "release", *stage.options, stdout=subprocess.DEVNULL)
    # One compiler a core: more of them take turns in the caches, and a build takes 10 % longer.
    run("cmake", "--build", BUILD, "--parallel", CORES, "--target", *stage.targets)


def ctest(stage):
    """Runs the tests of a stage; returns what became of each."""
    results = test_results.Folder(BUILD)
    junit = results.begin(stage.name)
    chosen = [word for label in stage.labels for word in ("--label-regex", label)] or ["--label-exclude", "^stage:"]
    # A folder for what tests write, which goes with the run: /tmp may hold files of the same names, of another user.
    with tempfile.TemporaryDirectory(prefix="phantom-") as scratch:
        Path(scratch).chmod(0o1777)
        status = subprocess.run(["ctest", "--test-dir", BUILD, "--parallel", str(JOBS), "--output-on-failure", "--no-tests=error",
                                 "--progress", "--output-junit", junit, *chosen], cwd=ROOT, env={**os.environ, "TMPDIR": scratch}).returncode
    cases = results.read(junit)
    if status != 0:
        failed = [name for name, case in cases.items() if case.outcome == "failed"]
        print(f"test: failed in stage {stage.name}: {', '.join(failed) or 'see above'}", file=sys.stderr)
        raise Failed()
    return cases


def run_quick(stage):
    """Sources are checked beside the build."""
    run("scripts/setup")
    checks = subprocess.Popen([sys.executable, __file__, "--check-sources"], cwd=ROOT)
    try:
        build(stage)
    finally:
        checked = checks.wait()
    if checked != 0:
        raise Failed()
    return ctest(stage)


def run_stage(stage):
    if stage.name == "quick":
        return run_quick(stage)
    build(stage)
    cases = ctest(stage) if stage.labels else {}
    for command in stage.commands:
        run(*command.format(build=BUILD, other=other_release()).split())
    return cases


def other_release():
    codename = next((line.split("=")[1].strip() for line in Path("/etc/os-release").read_text().splitlines()
                     if line.startswith("VERSION_CODENAME=")), "")
    return {"bookworm": "trixie", "trixie": "bookworm"}.get(codename, "trixie")


@dataclass
class Row:
    stage: Stage
    verdict: str = "not run"
    cases: dict = field(default_factory=dict)
    seconds: float = 0.0


def unmet(stage):
    return [NEEDS[need][1] for need in stage.needs if not NEEDS[need][0]()]


def run_stages(stages, limit_min=None):
    """Runs them in order; a stage whose needs are not met is skipped, one that fails ends the run. At the end the tests
    that are evidence in the safety case must have passed, but for those of other stages."""
    rows, begin = [Row(stage) for stage in stages], time.monotonic()
    shutil.rmtree(BUILD / "test_results", ignore_errors=True)
    for row in rows:
        if missing := unmet(row.stage):
            row.verdict = f"skipped: needs {', '.join(missing)}"
            print(f"test: {row.stage.name} is {row.verdict}")
            continue
        if limit_min is not None and time.monotonic() - begin > 60 * limit_min:
            row.verdict = f"left out: {limit_min} minutes had passed"
            continue
        print(f"test: stage {row.stage.name}: {row.stage.shows}", flush=True)
        start = time.monotonic()
        try:
            row.cases = run_stage(row.stage)
            row.verdict = "passed"
        except Failed:
            row.verdict = "FAILED"
        row.seconds = time.monotonic() - start
        if row.verdict == "FAILED":
            break
    failed = any(row.verdict == "FAILED" for row in rows)
    if not failed and any(row.cases for row in rows):
        try:
            run("scripts/checks/safety_case", BUILD, "--results")
        except Failed:
            failed = True
    show(rows)
    return 1 if failed else 0


def show(rows):
    print(f"\n{'stage':18} {'result':12} {'tests':>6} {'skipped':>8} {'minutes':>8}")
    for row in rows:
        skipped = sum(case.outcome == "skipped" for case in row.cases.values())
        verdict = row.verdict.split(":")[0]
        print(f"{row.stage.name:18} {verdict:12} {len(row.cases) or '-':>6} {skipped or '-':>8} {row.seconds / 60:8.1f}")
    print(f"{'total':18} {'':12} {sum(len(row.cases) for row in rows):>6} {'':>8} {sum(row.seconds for row in rows) / 60:8.1f}")
    for row in rows:
        if ":" in row.verdict:
            print(f"{row.stage.name}: {row.verdict}")
        for name, case in row.cases.items():
            if case.outcome == "skipped":
                print(f"skipped: {name}")
    ran = {row.stage.name for row in rows}
    if rest := [stage for stage in STAGES if stage.name not in ran]:
        print("\nNot part of this run (scripts/test NAME runs one, scripts/test --all every stage):")
        print("  " + ", ".join(stage.name for stage in rest))


def show_list():
    print(f"{'stage':18} {'minutes':>14}  {'CI':3} {'needs':32} shows")
    for stage in STAGES:
        needs = ", ".join(NEEDS[need][1] for need in stage.needs) or "-"
        print(f"{stage.name:18} {stage.minutes:>14}  {'yes' if stage.gate else '':3} {needs:32} {stage.shows}")


def main(words):
    if words == ["--check-sources"]:
        return 0 if check_sources() else 1
    if words and words[0] in ("--help", "-h"):
        print(__doc__.strip())
        return 0
    if words == ["--list"]:
        show_list()
        return 0
    if words and words[0] == "--dearest":
        return test_results.dearest(BUILD, words[1:])
    if words in (["--all"], ["--gate"]):
        stages = [stage for stage in STAGES if words == ["--all"] or stage.gate]
        return run_stages(stages, GATE_LIMIT_MIN if words == ["--gate"] else None)
    for word in words:
        if word not in BY_NAME:
            print(f"test: {word}: no such stage or option; allowed: --list, --gate, --all, --dearest N, --help, {', '.join(BY_NAME)}", file=sys.stderr)
            return 2
    return run_stages([BY_NAME[word] for word in words] or [BY_NAME["quick"]])


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
