"""scripts/checks/seeded_faults on a small project of its own: a fault that a test finds, one that survives, one whose place is gone, one that
does not build; and what it keeps of them."""
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "scripts/checks/seeded_faults"

PROJECT = {
    "CMakeLists.txt": """cmake_minimum_required(VERSION 3.25)
project(small LANGUAGES CXX)
enable_testing()
find_package(GTest REQUIRED)
set(CMAKE_CXX_FLAGS_RELEASE -O0)
function(phantom_test NAME)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${NAME}_test ${ARG_SOURCES})
  set_target_properties(${NAME}_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
  target_include_directories(${NAME}_test PRIVATE "${CMAKE_SOURCE_DIR}")
  target_link_libraries(${NAME}_test PRIVATE ${ARG_LIBRARIES} GTest::gtest_main)
endfunction()
add_subdirectory(common/limits)
""",
    "common/limits/CMakeLists.txt": "phantom_test(limits SOURCES tests/limits_test.cpp limits.cpp LIBRARIES)\n",
    "common/limits/limits.hpp": "#pragma once\nint limited(int value);\nint doubled(int value);\n",
    "common/limits/limits.cpp": """#include "common/limits/limits.hpp"
int limited(int value) {
  const int most = 10;
  return value > most ? most : value;
}
int doubled(int value) { return 2 * value; }
""",
    "common/limits/tests/limits_test.cpp": """#include "common/limits/limits.hpp"
#include <gtest/gtest.h>
TEST(Limited, StopsAtTen) { EXPECT_EQ(limited(11), 10); }
TEST(Limited, LetsLessThrough) { EXPECT_EQ(limited(3), 3); }
""",
}


def entry(name, text, becomes, file="common/limits/limits.cpp", tests="common/limits/tests/limits_test.cpp"):
    return (f'- name: {name}\n  file: {file}\n  text: "{text}"\n  becomes: "{becomes}"\n  breaks: what {name} breaks\n'
            f"  requirement: values are limited\n  tests: [{tests}]\n")


FOUND = entry("no_limit", "value > most ? most : value", "value")
STUCK = entry("ends_badly", "const int most = 10;", "const int most = 10; __builtin_trap();")
SURVIVOR = entry("tripled", "return 2 * value;", "return 3 * value;")


class SeededFaults(unittest.TestCase):
    def setUp(self):
        held = tempfile.TemporaryDirectory()
        self.addCleanup(held.cleanup)
        self.root = Path(held.name)
        for path, text in PROJECT.items():
            self.write(path, text)
        self.write(".gitignore", "/build/\n")
        (self.root / "scripts/checks").mkdir(parents=True)
        shutil.copy(SCRIPT, self.root / "scripts/checks")
        subprocess.run(["git", "init", "-q", self.root], check=True)

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text)

    def seed(self, *words, faults=None):
        if faults is not None:
            self.write("tests/seeded_faults/limits.yaml", faults)
        return subprocess.run([self.root / "scripts/checks/seeded_faults", *words], capture_output=True, text=True, timeout=600, check=False)

    def kept(self):
        return (self.root / "build/seeded_faults/results.md").read_text()

    def test_found_and_surviving_faults_are_told_kept_and_seeded_again_only_if_something_changed(self):
        before = PROJECT["common/limits/limits.cpp"]
        done = self.seed("--all", faults=FOUND + STUCK)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("no_limit: found by limits_test: Limited.StopsAtTen", done.stdout)
        self.assertIn("ends_badly: found by limits_test: Limited.StopsAtTen (SIG", done.stdout)
        self.assertIn("2 faults, 2 found.", self.kept())
        self.assertEqual((self.root / "common/limits/limits.cpp").read_text(), before, "the tree itself is never touched")
        self.assertEqual(self.seed("--check").returncode, 0)
        self.assertIn("nothing has changed", self.seed("--changed").stdout)

        done = self.seed("--changed", faults=FOUND + STUCK + SURVIVOR)
        self.assertEqual(done.returncode, 1)
        self.assertIn("1/1 tripled: SURVIVES: what tripled breaks", done.stdout)
        self.assertIn("3 faults, 2 found.", self.kept())
        refused = self.seed("--check")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("no test finds tripled", refused.stderr)

        self.write("common/limits/tests/limits_test.cpp", PROJECT["common/limits/tests/limits_test.cpp"] +
                   "TEST(Doubled, IsTwice) { EXPECT_EQ(doubled(2), 4); }\n")
        done = self.seed("tripled")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("found by limits_test: Doubled.IsTwice", done.stdout)
        checked = self.seed("--check")
        self.assertEqual(checked.returncode, 0)
        self.assertIn("to be seeded again (--changed): no_limit, ends_badly", checked.stdout)

    def test_what_the_minutes_do_not_suffice_for_is_named_and_left_for_the_next_time(self):
        done = self.seed("--check", faults=FOUND + STUCK)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("2 faults fit the code; 0 were found in it as it stands; 2 have no kept result yet", done.stdout)
        # The first fault always begins; building with it takes longer than the 60 µs.
        done = self.seed("--all", "--minutes", "1e-6", faults=FOUND + STUCK + SURVIVOR)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("no_limit: found by", done.stdout)
        self.assertIn("1 of 1 found", done.stdout)
        self.assertIn("not begun within 1e-06 min: ends_badly, tripled", done.stdout)
        self.assertIn("1 faults, 1 found.", self.kept())
        checked = self.seed("--check")
        self.assertEqual(checked.returncode, 0, checked.stderr)
        self.assertIn("1 were found in it as it stands; 2 have no kept result yet", checked.stdout)
        done = self.seed("--changed", "--minutes", "60")
        self.assertEqual(done.returncode, 1, "a survivor counts, with or without a limit")
        self.assertIn("2/2 tripled: SURVIVES", done.stdout)
        self.assertNotIn("not begun", done.stdout)

    def test_minutes_are_a_time_and_go_with_changed_or_all(self):
        for words, why in [(("--check", "--minutes", "1"), "--minutes goes with"), (("no_limit", "--minutes", "1"), "--minutes goes with"),
                           *((("--all", f"--minutes={bad}"), "allowed: minutes above 0") for bad in ("0", "-1", "nan", "inf", "ten"))]:
            with self.subTest(words=words):
                done = self.seed(*words, faults=FOUND)
                self.assertEqual(done.returncode, 2, done.stdout)
                self.assertIn(why, done.stderr)
                self.assertFalse((self.root / "build").exists())

    def test_a_requirement_that_is_named_exists_and_is_linked(self):
        named = FOUND.replace("requirement: values are limited", 'requirement: "SR-08: values are limited"')
        done = self.seed("--check", faults=named)
        self.assertEqual(done.returncode, 1)
        self.assertIn("no_limit: SR-08: docs/safety/requirements.md has no such requirement", done.stderr)
        self.write("docs/safety/requirements.md", "### SR-08\n")
        self.assertEqual(self.seed("--check").returncode, 0)
        self.assertEqual(self.seed("--all").returncode, 0)
        self.assertIn("| [SR-08](../../docs/safety/requirements.md#sr-08): values are limited |", self.kept())
        self.assertEqual(self.seed("--check").returncode, 0)

    def test_tests_that_fail_anyway_show_nothing(self):
        self.write("common/limits/limits.cpp", PROJECT["common/limits/limits.cpp"].replace("most = 10", "most = 9"))
        done = self.seed("--all", faults=FOUND)
        self.assertEqual(done.returncode, 1)
        self.assertIn("fails without any fault: limits_test: Limited.StopsAtTen", done.stderr)

    def test_a_fault_that_does_not_build_is_an_error_of_the_list_and_the_others_go_on(self):
        done = self.seed("--all", faults=entry("nonsense", "return 2 * value;", "return 2 * nothing;") + FOUND)
        self.assertEqual(done.returncode, 1)
        self.assertIn("nonsense: does not build", done.stdout)
        self.assertIn("no_limit: found by", done.stdout)
        self.assertIn("do not build: nonsense", done.stderr)

    def test_a_list_that_does_not_fit_the_code_is_refused_before_anything_is_built(self):
        for faults, words in [
            (entry("gone", "no such text", ""), "its text is found 0 times; allowed: once"),
            (entry("twice", "value", "other"), "times; allowed: once"),
            (entry("same", "return 2 * value;", "return 2 * value;"), "same: changes nothing"),
            (entry("nowhere", "a", "b", file="common/none.cpp"), "there is no such file"),
            (entry("untested", "return 2 * value;", "return 0;", tests="common/limits/limits.cpp"), "limits.cpp: holds no tests"),
            (entry("elsewhere", "return 2 * value;", "return 0;", tests="none_test.cpp"), "is no source of a phantom_test"),
            (FOUND + FOUND, "no_limit: the name is given twice"),
            ("- name: half\n", "needs exactly the keys"),
            ("", "holds no faults"),
        ]:
            with self.subTest(words=words):
                done = self.seed("--check", faults=faults)
                self.assertEqual(done.returncode, 1, done.stdout)
                self.assertIn(words, done.stderr)
                self.assertFalse((self.root / "build").exists())

    def test_here_the_tree_is_as_before_afterwards(self):
        done = self.seed("--all", "--here", faults=FOUND + SURVIVOR)
        self.assertEqual(done.returncode, 1)
        self.assertIn("no_limit: found by", done.stdout)
        self.assertIn("survive: tripled", done.stderr)
        self.assertEqual((self.root / "common/limits/limits.cpp").read_text(), PROJECT["common/limits/limits.cpp"])
        self.assertFalse(list((self.root / "build/release").glob("seeded.*")), "no executable is left behind")


if __name__ == "__main__":
    sys.exit(unittest.main())
