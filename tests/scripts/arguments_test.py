"""Every script says what it is for, refuses what it does not know in one line, from whichever folder it is called, and deletes nothing
that is not its own."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
NO_SCRIPTS = {"bench_rows.py", "cmake_build.py", "test_results.py", "test_stages.py", "topology_file.py", "tsan.supp"}
REFUSED = {
    "bench": ["no-such-table"],
    "bill_of_materials": ["--staged", "nowhere", "--build", "nowhere", "--output", "none"],
    "checks/all": ["--nonsense"],
    "checks/layers": ["--nonsense"],
    "checks/links": ["--nonsense"],
    "checks/reproducible_packages": ["--nonsense"],
    "checks/seeded_faults": ["no-such-fault"],
    "demo": ["--nonsense"],
    "doctor": ["--topology", "no-such-file.yaml"],
    "experiments": ["--nonsense"],
    "format": ["--nonsense"],
    "fuzz": ["soon"],
    "scale": ["no-such-table"],
    "setup": ["--nonsense"],
    "test": ["--nonsense"],
}


def run(folder, name, *words):
    return subprocess.run([SCRIPTS / name, *words], cwd=folder, capture_output=True, text=True, timeout=60, check=False)


class Arguments(unittest.TestCase):
    def setUp(self):
        self.elsewhere = tempfile.TemporaryDirectory()
        self.addCleanup(self.elsewhere.cleanup)

    def test_every_script_tells_what_it_is_for(self):
        for file in sorted([*SCRIPTS.iterdir(), *(SCRIPTS / "checks").iterdir()]):
            if file.is_file() and file.name not in NO_SCRIPTS:
                with self.subTest(script=file.name):
                    done = run(self.elsewhere.name, file.relative_to(SCRIPTS), "--help")
                    self.assertEqual(done.returncode, 0, done.stderr)
                    self.assertGreater(len(done.stdout), 80)

    def test_what_is_not_known_is_refused_and_named(self):
        for name, words in REFUSED.items():
            with self.subTest(script=name):
                done = run(self.elsewhere.name, name, *words)
                self.assertIn(done.returncode, (2, 3) if name == "scale" else (2,), done.stderr)
                self.assertNotIn("Traceback", done.stderr)
                self.assertIn(f"{Path(name).name}: ", done.stderr)

    def test_the_demo_deletes_no_folder_that_is_not_its_own(self):
        mine = Path(self.elsewhere.name) / "thesis"
        mine.mkdir()
        (mine / "chapter.txt").write_text("kept")
        for report in (mine, mine / "chapter.txt"):
            done = run(self.elsewhere.name, "demo", "--report", str(report))
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(f"--report {report}", done.stderr)
        self.assertEqual((mine / "chapter.txt").read_text(), "kept")

    def test_the_demos_length_is_checked_before_anything_is_built(self):
        for seconds in ("soon", "-1", ""):
            done = run(self.elsewhere.name, "demo", "--seconds", seconds)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn("--seconds", done.stderr)


if __name__ == "__main__":
    sys.exit(unittest.main())
