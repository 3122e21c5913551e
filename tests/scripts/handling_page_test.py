#!/usr/bin/env python3
"""The report of the task of handling: in both languages, in words and units, safe from what it quotes."""
import importlib.machinery
import importlib.util
import re
import unittest
from html.parser import HTMLParser
from pathlib import Path

SCRIPT = Path(__file__).resolve().parent.parent.parent / "scripts/handling"
loader = importlib.machinery.SourceFileLoader("handling", str(SCRIPT))
spec = importlib.util.spec_from_loader("handling", loader)
handling = importlib.util.module_from_spec(spec)
loader.exec_module(handling)

VALUES = {"by": "slave at flange", "said": "change: fixture moved", "at_m": [0.1, -0.25, 1.0]}
STEPS = [{"step": step, "after_s": 1.25} for step in handling.STEPS]
for number, key in enumerate(handling.FACTS):
    STEPS[number % len(STEPS)][key] = VALUES.get(key, 0.0125 if key.endswith("_m") else 7)


class Text(HTMLParser):
    """What a reader reads, and the tags that were not closed."""

    def __init__(self, page):
        super().__init__()
        self.open, self.words, self.language = [], [], ""
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        if tag == "html":
            self.language = dict(attributes)["lang"]
        if tag != "meta":
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)


class HandlingPage(unittest.TestCase):
    def test_every_step_and_fact_has_its_words(self):
        source = SCRIPT.read_text()
        taken = set(re.findall(r'self\.step\("([^"]+)"', source)) | set(re.findall(r'name = "(the [^"]+)"', source))
        self.assertEqual(taken, set(handling.STEPS))
        for facts in re.findall(r"(?:return|and) (\{\"[^}]*\})", source):
            self.assertLessEqual(set(re.findall(r'"(\w+)":', facts)), set(handling.FACTS))

    def test_both_languages_say_the_same_in_words_and_units(self):
        pages = [Text(handling.report_page(STEPS, "", german)) for german in (False, True)]
        for page, language in zip(pages, ("en", "de")):
            self.assertEqual((page.language, page.open), (language, []))
            text = " ".join(page.words)
            for key in handling.FACTS:
                if "_" in key:
                    self.assertNotIn(key, text)
        english, german = (" ".join(page.words) for page in pages)
        self.assertIn("gripper 12.5 mm open", english)
        self.assertIn("Greifer 12,5 mm offen", german)
        self.assertIn("bei 0,100; -0,250; 1,000 m", german)
        self.assertEqual(len(re.findall(r"\d+", english)), len(re.findall(r"\d+", german)))
        for word, wort in handling.STEPS.values():
            self.assertIn(word, english)
            self.assertIn(wort, german)
            self.assertNotEqual(word, wort)

    def test_what_is_quoted_stays_text(self):
        page = handling.report_page(STEPS[:1], "the pump <script>alert(1)</script>: {0} not within 3 s", True)
        self.assertIn("Nicht gelungen: the pump &lt;script&gt;", page)
        self.assertNotIn("<script>alert", page)


if __name__ == "__main__":
    unittest.main()
