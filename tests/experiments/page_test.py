#!/usr/bin/env python3
"""Draws the results of all experiments and looks at the page: every experiment in the specification's order, with a plot
whose axes are named, its statement and its checks; nothing loaded from elsewhere.

usage: page_test.py EXPERIMENTS RESULTS
"""
import html
import json
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import draw  # noqa: E402

SPECIFIED = ("mpc-steps filter-cost triangulation search-scope voxelise layers layer-sections rejected-shells "
             "drag-tracks speed smoothing merge joystick arm-sensors sensing-models lean-sensors pffb-speed coworking "
             "btm-cases percept-sets contact-gain enhanced pgd aid-views hit-view lead-time audio model-error survey touch "
             "submerged palpation resolutions shared-skin arm-pair scara running-system").split()
PENDING = set()  # specified, and not there yet


class Page(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.entries = json.loads(subprocess.run([EXECUTABLE, "--list", "--json"], check=True, stdout=subprocess.PIPE, text=True).stdout)
        with tempfile.NamedTemporaryFile("w", suffix=".json") as listed:
            json.dump(cls.entries, listed)
            listed.flush()
            assert draw.main([RESULTS, listed.name]) == 0
        cls.text = Path(RESULTS, "index.html").read_text(encoding="utf-8")

    def test_names_experiments_in_the_specifications_order(self):
        ids = [entry["id"] for entry in self.entries]
        self.assertEqual(ids, [id_ for id_ in SPECIFIED if id_ in ids])
        self.assertLessEqual(set(SPECIFIED) - set(ids), PENDING)
        self.assertEqual(re.findall(r"<h2 id='([^']+)'", self.text), ids)
        self.assertNotIn("not run", self.text)

    def test_every_experiment_says_which_broken_law_it_would_notice(self):
        for entry in self.entries:
            self.assertTrue(entry["fails_under"], entry["id"])

    def test_every_experiment_has_a_plot_with_named_axes_and_units(self):
        for entry in self.entries:
            plots = json.loads(Path(RESULTS, entry["id"], "plots.json").read_text())["plots"]
            self.assertTrue(plots, entry["id"])
            for plot in plots:
                where = f"{entry['id']}/{plot['name']}"
                ElementTree.parse(Path(RESULTS, entry["id"], plot["name"] + ".svg"))
                self.assertTrue(plot["title"], where)
                self.assertIn(html.escape(plot["title"].split("\n")[0].rstrip(".,;"))[1:], self.text, where)  # the caption
                for panel in plot["panels"]:
                    self.assertTrue(panel["x"] and panel["y"] and panel["series"], where)
                    for label in (panel["y"],) if panel["names_x"] else (panel["x"], panel["y"]):  # names have no unit
                        self.assertRegex(label, r"\[.+\]|^(fraction|number|share|case|ratio|pixels)", where)

    def test_the_page_needs_nothing_from_elsewhere(self):
        self.assertFalse(re.findall(r'(?:src|href)=["\'](?!#|data:)', re.sub(r"<svg.*?</svg>", "", self.text, flags=re.S)))

    def test_what_the_thesis_prints_stands_beside_ours_with_its_page_and_the_difference(self):
        beside = 0
        for entry in self.entries:
            for printed in self.printed(entry):
                beside += 1
                self.assertTrue(printed["low"] is not None or printed["high"] is not None, f"{entry['id']}: {printed['what']}: no band")
                self.assertIn(f"<td>{draw.band_text(printed)} {html.escape(printed['unit'])}</td><td>{'pass' if printed['passed'] else 'fail'}</td>",
                              self.section(entry["id"]))
                self.assertRegex(printed["place"], r", (page \d+|appendix [ABD])$", entry["id"])
                self.assertIn(html.escape(printed["what"]), self.section(entry["id"]))
                self.assertIn(draw.difference_text(printed), self.section(entry["id"]))
        self.assertGreater(beside, 20)
        self.assertEqual(draw.difference_text({"thesis": 40.0, "value": 39.0, "unit": "°"}), "−1 ° (−2.5 %)")
        self.assertEqual(draw.difference_text({"thesis": 0.0, "value": 0.5, "unit": ""}), "0.5")

    def test_every_experiment_judges_what_the_thesis_prints_or_says_that_it_prints_nothing(self):
        for entry in self.entries:
            drawn = json.loads(Path(RESULTS, entry["id"], "plots.json").read_text())
            self.assertTrue(self.printed(entry) or drawn["prints_no_more"], entry["id"])
            for text in drawn["prints_no_more"]:
                self.assertRegex(text, r"\(pages? \d+", entry["id"])
                self.assertIn(html.escape(text), self.section(entry["id"]))

    def test_a_folder_that_cannot_be_written_is_refused_before_any_work(self):
        with tempfile.NamedTemporaryFile() as file:  # no folder can be made below a file, not even by root
            ended = subprocess.run([EXECUTABLE, "--out", f"{file.name}/x", "layers"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(ended.returncode, 2, ended.stderr)
        self.assertIn("--out", ended.stderr)
        self.assertEqual(ended.stdout, "")

    def test_a_failing_check_is_shown_as_one(self):
        rows = list(draw.check_rows([{"what": "a", "value": None, "low": 0.0, "high": 1.0, "unit": "N", "passed": False}]))
        self.assertIn("class=fail", rows[0])
        self.assertIn("not a number", rows[0])

    def test_headings_labels_and_captions_are_words(self):
        for entry in self.entries:
            self.assertIn(f"{html.escape(entry['title'])}</h2>", self.text)
            figures = len(re.findall(r"<figure>.*?</figure>", self.section(entry["id"]), flags=re.S))
            self.assertEqual(len(re.findall(r"<b>Figure \d+\.\d+\.</b> \S", self.section(entry["id"]))), figures, entry["id"])
            for plot in json.loads(Path(RESULTS, entry["id"], "plots.json").read_text())["plots"]:
                for panel in plot["panels"]:
                    for label in (panel["x"], panel["y"], *(series["label"] for series in panel["series"])):
                        self.assertNotRegex(label, r"_(?!q)|\bdeg\b|\btheta\b|[a-z]-[a-z]+-[a-z]", f"{entry['id']}/{plot['name']}")

    def printed(self, entry):
        """What the thesis prints and the experiment judges."""
        return [check for check in json.loads(Path(RESULTS, entry["id"], "checks.json").read_text()) if "thesis" in check]

    def section(self, id_):
        begin = self.text.index(f"<h2 id='{id_}'")
        end = self.text.find("<h2 id=", begin + 1)
        return self.text[begin:end if end > 0 else None]

    def test_figures_are_printed_as_one_writes_them(self):
        self.assertEqual(draw.figure_text(1.872e-8), "1.872 × 10⁻⁸")
        self.assertEqual(draw.figure_text(-0.25), "−0.25")
        self.assertEqual(draw.sentence("torque on θ [N·m]"), "Torque on θ [N·m]")
        self.assertEqual(draw.sentence("x [mm]"), "x [mm]")

    def test_a_band_may_be_open(self):
        self.assertEqual(draw.band_text({"low": 10.0, "high": None}), "10 … ∞")


if __name__ == "__main__":
    EXECUTABLE, RESULTS = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1])
