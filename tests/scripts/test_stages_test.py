"""Every stage of scripts/test can build and run what it names, and no test stands outside of all stages."""
import json
import subprocess
import sys
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "scripts"))
import test_stages  # noqa: E402

BUILD = Path(sys.argv.pop())


def labels():
    """{label of a stage} of all tests of the build."""
    shown = subprocess.run(["ctest", "--test-dir", BUILD, "--show-only=json-v1"], capture_output=True, text=True, check=True)
    return {label for test in json.loads(shown.stdout)["tests"] for each in test.get("properties", []) if each["name"] == "LABELS"
            for label in each["value"] if label.startswith("stage:")}


class Stages(unittest.TestCase):
    def test_every_target_of_a_stage_exists(self):
        listed = subprocess.run(["cmake", "--build", BUILD, "--target", "help"], capture_output=True, text=True, check=True).stdout
        known = {line.split(":")[0].strip() for line in listed.splitlines()} | {"all"}
        for stage in test_stages.STAGES:
            if "-DPHANTOM_BUILD_BENCH=ON" not in stage.options:
                self.assertEqual(set(stage.targets) - known, set(), stage.name)

    def test_every_label_of_a_test_is_that_of_a_stage(self):
        self.assertEqual(labels() - {f"stage:{stage.name}" for stage in test_stages.STAGES}, set())

    def test_every_stage_that_ctest_runs_has_tests(self):
        for stage in test_stages.STAGES:
            chosen = {label.strip("^$") for label in stage.labels if label.startswith("^stage:")}
            self.assertEqual(chosen - labels(), set(), stage.name)

    def test_what_a_stage_needs_can_be_asked(self):
        for stage in test_stages.STAGES:
            self.assertEqual(set(stage.needs) - set(test_stages.NEEDS), set(), stage.name)

    def test_the_commands_of_a_stage_exist(self):
        for stage in test_stages.STAGES:
            for command in stage.commands:
                program = command.split()[0]
                if "/" in program:
                    self.assertTrue((ROOT / program).is_file(), program)


if __name__ == "__main__":
    unittest.main()
