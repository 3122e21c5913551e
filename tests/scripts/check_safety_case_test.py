"""The check of the safety case must find each broken link between hazards, requirements, tests and results, and pass what is whole."""
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
HAZARDS = """| id | hazard | answered by |
|---|---|---|
| H-01 | It runs on | [SR-01](requirements.md#sr-01) |
| H-02 | It jumps | [SR-02](requirements.md#sr-02) |
"""
REQUIREMENTS = """### SR-01
It stops. Answers below.
Answers H-01.
Whole: `hosts.stop`

### SR-02
It does not jump.
Answers H-02.
"""
README = """# arm
| failure | reaction |
|---|---|
| its cable is cut; crushed | stops |
| a drive is in fault | stops, and `a | b` |

| key | |
|---|---|
"""
TRIES = "".join(f"// {line}\n" for line in ("Tries arm: its cable is cut … crushed", "Tries arm: a drive is", "And says so."))
TESTS = TRIES + "TEST(Arm, SR02_DoesNotJump) {}\nTEST(Arm, SR01_SR02_Both) {}\n"
CMAKE = """cmake_minimum_required(VERSION 3.20)
project(p NONE)
enable_testing()
add_test(NAME arm.Arm.SR02_DoesNotJump COMMAND true)
add_test(NAME arm.Arm.SR01_SR02_Both COMMAND true)
add_test(NAME hosts.stop COMMAND true)
set_tests_properties(hosts.stop PROPERTIES LABELS "stage:hosts;SR01" SKIP_RETURN_CODE 77)
"""


class CheckSafetyCase(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name) / "project"
        for name, text in {"docs/safety/hazards.md": HAZARDS, "docs/safety/requirements.md": REQUIREMENTS, "arm/arm_test.cpp": TESTS, "arm/README.md": README,
                           "CMakeLists.txt": CMAKE, "tests/hosts/stop_test.py": ""}.items():
            self.put(name, text)
        (self.root / "scripts/checks").mkdir(parents=True)
        for script in ("checks/safety_case", "test_results.py"):
            shutil.copy(SOURCE / "scripts" / script, self.root / "scripts" / script)
        subprocess.run(["git", "init", "-q", self.root], check=True)

    def put(self, name, text):
        (self.root / name).parent.mkdir(parents=True, exist_ok=True)
        (self.root / name).write_text(text, encoding="utf-8")

    def check(self, *words):
        return subprocess.run([sys.executable, self.root / "scripts/checks/safety_case", *words], capture_output=True, text=True, check=False)

    def run_tests(self, *stages):
        """Builds and runs the tests of these stages; returns the words by which they are checked."""
        build = self.root / "build"
        subprocess.run(["cmake", "-S", self.root, "-B", build], capture_output=True, check=True)
        (build / "test_results").mkdir(exist_ok=True)
        for stage in stages or ("quick", "hosts"):
            chosen = ["-LE", "^stage:"] if stage == "quick" else ["-L", f"^stage:{stage}$"]
            subprocess.run(["ctest", "--test-dir", build, "--output-junit", build / f"test_results/{stage}.junit", *chosen], capture_output=True, check=False)
        return build, "--results"

    def refuses(self, what, *words):
        done = self.check(*words)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn(what, done.stdout)

    def test_what_is_whole_passes(self):
        done = self.check(*self.run_tests())
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("[Arm.SR01_SR02_Both](../../arm/arm_test.cpp)", (self.root / "build/safety_case/evidence.md").read_text())

    def test_links_of_the_pages_lead_to_files_headings_and_lines(self):
        page = "[a](requirements.md#sr-01) [b](../../arm/arm_test.cpp#L2) [c](https://example.org/x#y) [d](#what-is-here)\n\n## What is here\n"
        self.put("docs/safety/README.md", page)
        self.assertEqual(self.check().returncode, 0, self.check().stdout)
        for old, new, told in [("requirements.md", "requirement.md", "README.md:1: requirement.md#sr-01: there is no such file"),
                               ("#sr-01", "#sr-09", "README.md:1: requirements.md#sr-09: docs/safety/requirements.md has no such heading or line"),
                               ("#L2", "#L20", "arm/arm_test.cpp has no such heading or line"), ("(#what", "(#where", "#where-is-here: ")]:
            self.put("docs/safety/README.md", page.replace(old, new))
            self.refuses(told)

    def test_broken_links_are_named_with_their_place(self):
        for file, old, new, told in [
            ("hazards", "[SR-02](requirements.md#sr-02)", "", "hazards.md:4: H-02 has no requirement"),
            ("hazards", "[SR-02](requirements.md#sr-02)", "[SR-03](requirements.md#sr-03)", "H-02 names SR-03, which does not exist"),
            ("hazards", "#sr-02", "#sr-01", "the link of SR-02 leads to sr-01"),
            ("hazards", "H-02", "H-01", "H-01 is there twice"),
            ("requirements", "Answers H-02.", "", "SR-02 does not say that it answers H-02"),
            ("requirements", "Answers H-02.", "Answers H-02, H-07.", "SR-02 answers H-07, which does not name it"),
            ("requirements", "### SR-02", "### SR-01", "SR-01 is there twice"),
        ]:
            with self.subTest(told=told):
                path = self.root / f"docs/safety/{file}.md"
                before = path.read_text()
                path.write_text(before.replace(old, new))
                self.refuses(told)
                path.write_text(before)

    def test_a_requirement_without_a_test_and_a_test_without_a_requirement(self):
        self.put("arm/arm_test.cpp", "TEST(Arm, SR09_Other) {}\n")
        self.refuses("SR-02 has no test")
        self.refuses("arm/arm_test.cpp:1: carries SR09")

    def test_evidence_is_that_of_the_sources(self):
        self.put("arm/arm_test.cpp", TESTS.replace("SR02_DoesNotJump", "SR02_DoesNotJerk"))
        self.assertEqual(self.check().returncode, 0)
        self.assertIn("- [Arm.SR02_DoesNotJerk](../../arm/arm_test.cpp)", (self.root / "build/safety_case/evidence.md").read_text())

    def test_every_failure_of_a_readme_is_tried_piece_by_piece(self):
        self.check()
        page = (self.root / "build/safety_case/failures.md").read_text()
        self.assertIn("- its cable is cut; crushed: [Arm.SR02_DoesNotJump](../../arm/arm_test.cpp)", page)
        for old, new, told in [(" … crushed", "", 'arm/README.md:4: no test tries "crushed"'),
                               ("its cable is cut … ", "", 'arm/README.md:4: no test tries "its cable is cut"'),
                               ("// Tries arm: a drive is\n", "", 'arm/README.md:5: no test tries "a drive is in fault"'),
                               ("a drive is", "a drove is", "arm/arm_test.cpp:2: no failure of arm has these words"),
                               ("a drive is", "i", "arm/arm_test.cpp:2: more than one failure of arm has these words"),
                               ("// And says so.\n", "int x;\n", "arm/arm_test.cpp:1: stands before no test")]:
            self.put("arm/arm_test.cpp", TESTS.replace(old, new))
            self.refuses(told)
        self.put("arm/arm_test.cpp", TESTS)
        self.put("arm/README.md", README + README)
        self.refuses("arm/README.md:12: is there twice")
        self.put("arm/README.md", README.replace("cable", "plug"))
        self.refuses('no test tries "its plug is cut"')

    def test_a_failure_may_be_tried_in_python_and_by_what_runs_many_tests(self):
        self.put("arm/arm_test.cpp", TESTS.replace(TRIES, ""))
        self.put("tests/hosts/stop_test.py", "# Tries arm: its cable is cut; crushed\n# Tries arm: a drive is in fault\ndef expect_a_stop(arm):\n    pass\n")
        self.put("CMakeLists.txt", CMAKE.replace("hosts.stop COMMAND true", "hosts.stop COMMAND sh -c true stop_test.py"))
        done = self.check(*self.run_tests())
        self.assertEqual(done.returncode, 0, done.stdout)
        self.put("CMakeLists.txt", CMAKE)
        self.refuses('stop_test.expect_a_stop, which tries "a drive is in fault", does not exist in this build', self.run_tests()[0])
        self.put("CMakeLists.txt", CMAKE.replace("hosts.stop COMMAND true", "hosts.stop COMMAND sh -c \"exit 77\" stop_test.py"))
        self.refuses('no test that tries "a drive is in fault" was run and passed', *self.run_tests())

    def test_a_test_that_the_build_does_not_have(self):
        self.put("CMakeLists.txt", CMAKE.replace("add_test(NAME arm.Arm.SR02_DoesNotJump COMMAND true)\n", ""))
        self.refuses("its test Arm.SR02_DoesNotJump does not exist in this build", self.run_tests()[0])
        self.put("CMakeLists.txt", CMAKE.replace(";SR01", ""))
        self.refuses("hosts.stop: is named by SR-01 and does not carry it", self.run_tests()[0])
        self.put("CMakeLists.txt", CMAKE.replace(";SR01", ";SR01;SR02"))
        self.refuses("hosts.stop: carries SR-02, which does not name it", self.run_tests()[0])

    def test_the_cases_of_a_typed_suite(self):
        self.put("arm/arm_test.cpp", TESTS + "TYPED_TEST(Typed, SR02_OfEachType) {}\n")
        self.put("CMakeLists.txt", CMAKE + "add_test(NAME arm.Typed/0.SR02_OfEachType COMMAND true)\n")
        done = self.check(self.run_tests()[0])
        self.assertEqual(done.returncode, 0, done.stdout)
        self.put("CMakeLists.txt", CMAKE)
        self.refuses("its test Typed.SR02_OfEachType does not exist in this build", self.run_tests()[0])

    def test_a_test_that_failed_or_was_only_skipped(self):
        self.put("CMakeLists.txt", CMAKE.replace("hosts.stop COMMAND true", "hosts.stop COMMAND false"))
        self.refuses("hosts.stop: is evidence for SR-01 and failed", *self.run_tests())
        self.put("CMakeLists.txt", CMAKE.replace("hosts.stop COMMAND true", "hosts.stop COMMAND sh -c \"exit 77\""))
        self.refuses("hosts.stop: is evidence for SR-01 and was only skipped", *self.run_tests())

    def test_a_test_of_a_stage_that_was_not_run_is_left_out(self):
        self.put("CMakeLists.txt", CMAKE.replace("hosts.stop COMMAND true", "hosts.stop COMMAND false"))
        done = self.check(*self.run_tests("quick"))
        self.assertEqual(done.returncode, 0, done.stdout)
        self.put("CMakeLists.txt", CMAKE.replace("SR02_DoesNotJump COMMAND true", "SR02_DoesNotJump COMMAND false"))
        self.refuses("arm.Arm.SR02_DoesNotJump: is evidence for SR-02 and failed", *self.run_tests("quick"))

    def test_the_cases_of_a_suite_that_runs_as_one_process(self):
        """The suite passes for CTest; of its cases one was skipped, which GoogleTest's results show."""
        self.put("CMakeLists.txt", CMAKE.replace("add_test(NAME arm.Arm.SR02_DoesNotJump COMMAND true)\nadd_test(NAME arm.Arm.SR01_SR02_Both COMMAND true)",
                                                 "add_test(NAME arm.Arm COMMAND true)"))
        self.put("build/tests/suites/arm.cmake.cases", "arm.Arm.SR02_DoesNotJump\narm.Arm.SR01_SR02_Both\n")
        case = '<testcase name="{}" classname="Arm" status="run" result="{}" time="0.1"/>'
        results = '<testsuites><testsuite name="Arm">{}{}</testsuite></testsuites>'
        for result, code in [("completed", 0), ("skipped", 1)]:
            self.put("build/test_results/arm.Arm.xml", results.format(case.format("SR02_DoesNotJump", result), case.format("SR01_SR02_Both", "completed")))
            done = self.check(*self.run_tests("quick"))
            self.assertEqual(done.returncode, code, done.stdout)
        self.assertIn("arm.Arm.SR02_DoesNotJump: is evidence for SR-02 and was only skipped", done.stdout)


if __name__ == "__main__":
    unittest.main()
