"""What scripts/bench decides: which limit holds, which row or benchmark does not exist, and when a run of all benchmarks fails."""
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

import bench_rows  # noqa: E402

ROWS = {row["name"]: row for row in bench_rows.load_rows(ROOT / "tests/bench/rows")}
BY_BANDWIDTH = {">= 30 GB/s": "<= 22", "< 30 GB/s": "<= 15"}


def row(**changed):
    return {"table": "t", "name": "r", "work": "w", "bench": "b", "value": ["cpu:ours", "cpu:floor"], **changed}


def measured(seconds, **counters):
    return [{"cpu_time": s * 1e3, "real_time": s * 2e3, "time_unit": "ms", **counters} for s in (seconds, 9 * seconds, seconds)]


class Limits(unittest.TestCase):
    def verdict(self, ratio, GB_per_s, **changed):
        results = {"b": {"ours": measured(ratio), "floor": measured(1.0, bytes_per_second=GB_per_s * 1e9)}}
        judged = bench_rows.judge(row(must=BY_BANDWIDTH, **changed), results, {"b": {"ours", "floor"}})
        return judged["must"], judged["verdict"]

    def test_the_bandwidth_of_memory_chooses_between_two_limits(self):
        self.assertEqual(self.verdict(18, 43), ("<= 22", "must"))
        self.assertEqual(self.verdict(23, 43), ("<= 22", "MISSED"))
        self.assertEqual(self.verdict(22, 30), ("<= 22", "must"))
        self.assertEqual(self.verdict(18, 29.9), ("<= 15", "MISSED"))
        self.assertEqual(self.verdict(15, 20), ("<= 15", "must"))
        self.assertEqual(self.verdict(14, 43, aim="<= 15"), ("<= 22", "aim"))

    def test_a_limit_by_bandwidth_needs_a_benchmark_that_states_it(self):
        results = {"b": {"ours": measured(18, bytes_per_second=43e9), "floor": measured(1.0)}}
        with self.assertRaisesRegex(bench_rows.RowError, "floor states no bytes_per_second"):
            bench_rows.judge(row(must=BY_BANDWIDTH), results, {"b": {"ours", "floor"}})

    def test_one_limit_holds_on_all_machines(self):
        results = {"b": {"ours": measured(3.0), "floor": measured(1.0)}}
        for must, verdict in (("<= 3", "must"), ("<= 2.9", "MISSED"), (">= 3", "must"), (">= 3.1", "MISSED")):
            self.assertEqual(bench_rows.judge(row(must=must), results, {"b": set()})["verdict"], verdict, must)
        self.assertEqual(bench_rows.judge(row(), results, {"b": set()})["verdict"], "stated")

    def test_wall_and_processor_time_are_told_apart(self):
        results = {"b": {"ours": measured(3.0), "floor": measured(1.0)}}
        judged = bench_rows.judge(row(value=["wall:ours", "cpu:floor"]), results, {"b": set()})
        self.assertAlmostEqual(judged["ratio"], 6.0)


class Rows(unittest.TestCase):
    def test_the_target_by_bandwidth_is_a_row(self):
        self.assertEqual(ROWS["activate_512"]["must"], BY_BANDWIDTH)

    def test_a_row_that_cannot_be_judged_is_refused(self):
        bare = {key: value for key, value in row().items() if key != "table"}
        bench_rows.check(bare)
        for fault, broken in {
            "no such key": {"mustt": "<= 1"},
            "allowed": {"must": "< 1"},
            "allowed: ": {"aim": 3},
            "must {": {"must": {">= 30 GB/s": "<= 22", "< 40 GB/s": "<= 15"}},
            "must {.*allowed": {"must": {">= 30 GB/s": "<= 22"}},
            "no benchmark that states it": {"must": BY_BANDWIDTH, "value": ["cpu:ours", 1]},
            "value 'ours'": {"value": ["ours", 1]},
            "two sides": {"value": ["cpu:ours"]},
            "none of its benchmarks": {"slow": ["other"]},
        }.items():
            with self.subTest(fault=fault), self.assertRaisesRegex(bench_rows.RowError, fault):
                bench_rows.check({**bare, **broken})
        with self.assertRaisesRegex(bench_rows.RowError, "work is missing"):
            bench_rows.check({key: value for key, value in bare.items() if key != "work"})

    def test_a_file_of_rows_is_named_with_its_fault(self):
        bare = {key: value for key, value in row().items() if key != "table"}
        for text, fault in ((json.dumps([bare, bare]), "has a row of this name"), (json.dumps([{**bare, "must": 3}]), "row r: must 3"), ("[", "Expecting")):
            with tempfile.TemporaryDirectory() as folder:
                (Path(folder) / "some.json").write_text(text)
                with self.assertRaisesRegex(bench_rows.RowError, "some.json: .*" + fault):
                    bench_rows.load_rows(Path(folder))

    def test_an_unknown_row_is_named_with_those_that_exist(self):
        rows = list(ROWS.values())
        self.assertEqual([each["name"] for each in bench_rows.select(rows, ["tone"])], ["tone"])
        self.assertEqual({each["table"] for each in bench_rows.select(rows, ["viewer"])}, {"viewer"})
        self.assertEqual(bench_rows.select(rows, []), rows)
        with self.assertRaisesRegex(bench_rows.RowError, "tome: .*allowed: .*tone"):
            bench_rows.select(rows, ["tone", "tome"])


class Registered(unittest.TestCase):
    peer = row(peer="Peer", value=["cpu:peer/1", "cpu:ours"])

    def test_a_row_of_a_benchmark_that_does_not_exist_is_a_fault(self):
        self.assertEqual(bench_rows.unregistered([row()], {"b": {"ours", "floor", "more"}}), [])
        self.assertEqual(bench_rows.unregistered([row()], {"b": {"ours"}}), ["t.json: row r: b_bench has no benchmark floor"])

    def test_a_peer_that_is_not_installed_is_excepted_and_nothing_else(self):
        self.assertEqual(bench_rows.unregistered([self.peer], {"b": {"ours"}}), [])
        self.assertEqual(len(bench_rows.unregistered([self.peer], {"b": {"ours", "peer/2"}})), 1)
        self.assertEqual(len(bench_rows.unregistered([self.peer], {"b": {"other"}})), 1)

    def test_what_was_not_measured_fails_unless_the_peer_is_missing(self):
        results = {"b": {"ours": measured(1.0)}}
        self.assertEqual(bench_rows.judge(self.peer, results, {"b": {"ours"}})["verdict"], "Peer not installed")
        self.assertNotIn("Peer not installed", bench_rows.UNMET)
        for registered in ({"ours", "peer/1"}, {"ours", "peer/2"}):
            self.assertIn(bench_rows.judge(self.peer, results, {"b": registered})["verdict"], bench_rows.UNMET)
        self.assertIn(bench_rows.judge(row(), results, {"b": {"ours", "floor"}})["verdict"], bench_rows.UNMET)

    def test_names_are_those_of_the_registration(self):
        for reported in ("a/512", "a/512/iterations:1/repeats:3", "a/512/process_time/real_time", "a/512/iterations:1/manual_time"):
            self.assertEqual(bench_rows.benchmark_name(reported), "a/512")
            self.assertRegex(reported, bench_rows.filter_of({"a/512", "b"}))
        for other in ("a/512/2", "aa/512", "a/5123"):
            self.assertNotRegex(other, bench_rows.filter_of({"a/512", "b"}))


# An executable that answers as one of Google Benchmark does.
EXECUTABLE = """#!{python}
import json, os, re, sys
given = dict(word.lstrip("-").split("=", 1) for word in sys.argv[1:])
plan = json.load(open(sys.argv[0] + ".json"))
reported = [name + "/iterations:1/repeats:1" for name in plan["names"]]
if "benchmark_list_tests" in given:
    print("\\n".join(reported))
    sys.exit()
if plan.get("exit"):
    sys.exit(plan["exit"])
ran = [name for name in reported if re.search(given["benchmark_filter"], name) and name.split("/iter")[0] != plan.get("lost")]
results = [dict(name=name, run_type="iteration", repetition_index=0) for name in ran]
for result in results:
    if result["name"].startswith(plan.get("error", "none")):
        result.update(error_occurred=True, error_message="no sound device")
open(given["benchmark_out"], "w").write(json.dumps(dict(benchmarks=results)))
open(sys.argv[0] + ".ran", "w").write(json.dumps([ran, given, os.environ.get("PHANTOM_BENCH_ONCE")]))
"""


class Once(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.build = Path(folder.name)
        self.plans = {}
        for each in ROWS.values():
            if not (ROOT / "tests/bench" / f"{each['bench']}_bench").exists():  # else it is a script, which is there
                names = {name for name in bench_rows.benchmarks(each) if not name.startswith(("openvdb", "octomap"))}
                self.plans.setdefault(each["bench"], {"names": set()})["names"] |= names
        self.plans["audio"]["names"].add("of_no_row")

    def once(self, *names):
        (self.build / "bench").mkdir(exist_ok=True)
        for name, plan in self.plans.items():
            executable = self.build / "bench" / f"{name}_bench"
            executable.write_text(EXECUTABLE.format(python=sys.executable))
            executable.chmod(0o755)
            Path(f"{executable}.json").write_text(json.dumps({**plan, "names": sorted(plan["names"])}))
        # Without tools that build: nothing is to be built.
        tools = self.build / "tools"
        tools.mkdir(exist_ok=True)
        if not (tools / "python3").exists():
            (tools / "python3").symlink_to(sys.executable)
        return subprocess.run([sys.executable, ROOT / "scripts/bench", "--once", "--build", self.build, *names], text=True, timeout=280,
                              capture_output=True, check=False, env={**os.environ, "PATH": str(tools)})

    def ran(self, name):
        ran, given, once = json.loads((self.build / "bench" / f"{name}_bench.ran").read_text())
        return {bench_rows.benchmark_name(each) for each in ran}, given, once

    def test_all_run_for_one_iteration_but_those_that_take_minutes(self):
        done = self.once()
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        for name, plan in self.plans.items():
            ran, given, once = self.ran(name)
            slow = {each for each in plan["names"] if each in ("huge/1mm", "late_joiner/hot_cell/2mm")}
            self.assertEqual(ran, plan["names"] - slow)
            self.assertEqual((given["benchmark_min_time"], given["benchmark_repetitions"], once), ("0", "1", "1"))
        left_out = done.stdout.splitlines()[-1]
        for name in ("huge/1mm", "late_joiner/hot_cell/2mm", "build/demo", "page.py"):
            self.assertIn(name, left_out)

    def test_a_benchmark_that_a_row_names_and_no_executable_has_fails(self):
        self.plans["audio"]["names"].remove("synthesize/1s")
        done = self.once("audio")
        self.assertEqual(done.returncode, 1)
        self.assertIn("audio.json: row tone: audio_bench has no benchmark synthesize/1s", done.stderr)
        self.assertEqual(self.once("viewer").returncode, 0)

    def test_a_benchmark_that_reports_an_error_fails(self):
        self.plans["audio"]["error"] = "percept_to_sound"
        done = self.once("audio")
        self.assertEqual(done.returncode, 1)
        self.assertIn("audio_bench: percept_to_sound: no sound device", done.stderr)

    def test_an_executable_that_ends_otherwise_than_with_0_fails(self):
        self.plans["audio"]["exit"] = 3
        done = self.once("audio")
        self.assertEqual(done.returncode, 1)
        self.assertIn("audio_bench: ended with 3", done.stderr)

    def test_a_benchmark_that_does_not_run_fails(self):
        self.plans["audio"]["lost"] = "of_no_row"
        done = self.once("audio")
        self.assertEqual(done.returncode, 1)
        self.assertIn("audio_bench: of_no_row: it did not run", done.stderr)


if __name__ == "__main__":
    sys.exit(unittest.main())
