#!/usr/bin/env python3
"""idl/contract.py: what two edits add, and its errors."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import recipe

CONTRACT = recipe.SOURCE / "idl/contract.py"


class Generator(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(lambda: subprocess.run(["rm", "-r", self.folder], check=True))

    def made(self, name):
        return (self.folder / "include" / name).read_text(encoding="utf-8")

    def test_two_edits_add_a_topic_everywhere(self):
        recipe.follow(self.folder)
        self.assertIn("| `tool_temperature` | `phantom::msg::ToolTemperature` | 10 Hz | best effort | volatile | 1 | 500 ms | 2000 ms | "
                      "tool_sensor | synthetic_viewer |\n", self.made("topics.md"))
        self.assertRegex(self.made("rights"), r"(?m)^tool_sensor +\| tool_temperature \|$")
        self.assertRegex(self.made("rights"), r"(?m)^synthetic_viewer .* tool_temperature")
        self.assertIn('<data_reader profile_name="tool_temperature">', self.made("qos_profiles.xml"))
        self.assertIn("extern const TopicSpec<msg::ToolTemperature> kToolTemperature;", self.made("phantom_contract/topics.hpp"))
        self.assertIn("&kToolTemperature,", self.made("phantom_contract/topics.inc"))
        self.assertIn("entry(dds::kToolTemperature)", self.made("phantom_contract/topic_samples.inc"))
        self.assertIn("struct Of<msg::ToolTemperature>", self.made("phantom_contract/topic_faults.inc"))
        self.assertIn("TOPIC(kToolTemperature, ToolTemperature)\n", self.made("phantom_contract/topics.def"))

    def test_what_has_not_changed_keeps_its_time(self):
        recipe.follow(self.folder)
        before = (self.folder / "include/phantom_contract/topics.hpp").stat().st_mtime_ns
        recipe.follow(self.folder)
        self.assertEqual((self.folder / "include/phantom_contract/topics.hpp").stat().st_mtime_ns, before)

    def refusal(self, idl):
        """What is said of a family with that content."""
        (self.folder / "some.idl").write_text("module phantom {\nmodule msg {\n" + idl + "\n};\n};\n", encoding="utf-8")
        places = self.folder / "places.txt"
        places.touch()
        done = subprocess.run([sys.executable, CONTRACT, "--idl", self.folder, "--places", places, "--out", self.folder / "include"],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 2 if done.stderr else 0, done.stderr)
        return done.stderr

    def test_errors_name_line_and_what_is_allowed(self):
        struct = "// Topic t: words.\n// [@qos {}]\n@final\nstruct S {{\n  {}\n}};"
        self.assertEqual(self.refusal(struct.format("event", "double x;")), "")
        for qos, says in (("often", "some.idl:6: @qos 'often'; allowed: periodic, event, durable, large"),
                          ("event, deadline 20 ms", "@qos event: 'deadline 20 ms'; allowed: nothing more"),
                          ("periodic, deadline 20 ms", "@qos periodic needs a deadline and a lease"),
                          ("periodic, deadline 20, lease 200 ms", "'deadline 20'; allowed: deadline, fragments, growing, lease (times as '20 ms')")):
            self.assertIn(says, self.refusal(struct.format(qos, "double x;")))
        for member, says in (("double x;  // [@range 3]", "some.idl:7: @range '3'; allowed: A..B"),
                             ("double x;  // [@range 1..2 items]", "@range '1..2 items'"),
                             ("sequence<double> x;  // [@range 1..2]", "of a sequence: A..B items"),
                             ("sequence<S> x;", "x has no bound; allowed: sequence<S, N>, or [@range 0..N items]"),
                             ("Vector3 x;  // [@range 0..2]", "a vector's range is symmetric; allowed: [@range -B..B]"),
                             ("string<8> x;  // [@text long]", "@text 'long'; allowed: name, whole, whole or empty"),
                             ("double x", "found '}'; allowed: ;, ["),
                             ("double $;", "some.idl:7: unexpected character '$'")):
            self.assertIn(says, self.refusal(struct.format("event", member)), member)
        enumerated = "enum E {{\n  E_A,\n  E_B\n}};\n" + struct
        self.assertEqual(self.refusal(enumerated.format("event", "E x;  // [@default E_B]")), "")
        self.assertIn("E x = E::kB;", self.made("phantom_contract/some_samples.hpp"))
        self.assertIn("@default 'E_C'; allowed: E_A, E_B", self.refusal(enumerated.format("event", "E x;  // [@default E_C]")))
        self.assertIn("topic t lacks @qos", self.refusal("// Topic t: words.\n@final\nstruct S {\n  double x;\n};"))
        self.assertIn("topic t has a tag @qso", self.refusal("// Topic t: words. [@qos event] [@qso event]\n@final\nstruct S {\n  double x;\n};"))
        twice = struct.format("event", "double x;")
        self.assertIn("topic t comes twice", self.refusal(twice + "\n" + twice.replace("S {", "R {")))

    def test_places_must_fit_the_idl(self):
        places = self.folder / "places.txt"
        for text, says in (("message MasterState teleoperation\n  stopp stop.id\n", "MasterState has no field stopp"),
                           ("massage MasterState teleoperation\n", "places.txt:1: 'massage MasterState teleoperation'; allowed: enum NAME TYPE")):
            places.write_text(text, encoding="utf-8")
            done = subprocess.run([sys.executable, CONTRACT, "--places", places, "--out", self.folder / "include"], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2)
            self.assertIn(says, done.stderr)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    unittest.main()
