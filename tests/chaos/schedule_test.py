#!/usr/bin/env python3
"""The schedule is a function of its seed, and every step ends what it began."""
import itertools
import unittest

import schedule

ENDS = {
    "freeze": ("thaw", "process"), "freeze_thread": ("thaw_thread", "process"), "cut": ("heal", "host"),
    "fill_disk": ("free_disk", "host"), "block_log": ("free_log", "process"), "start_intruder": ("end_intruder", "component"),
    "start_load": ("end_load", "processes"), "kill": ("start", "process"), "start_lying": ("end_lying", "process"),
    "start_other_arm": ("end_other_arm", "component"), "lose_fragments": ("pass_fragments", "host")}


def first(seed, count=400, only=()):
    return list(itertools.islice(schedule.steps(seed, only), count))


class Schedule(unittest.TestCase):
    def test_a_seed_repeats_it_and_another_does_not(self):
        self.assertEqual(first(7), first(7))
        self.assertNotEqual(first(7), first(8))

    def test_every_kind_comes_before_any_comes_too_often(self):
        deck = len(schedule.KINDS) + sum(weight - 1 for weight in schedule.WEIGHTS.values())
        for begin in range(0, 5 * deck, deck):
            kinds = [step["kind"] for step in first(3, 5 * deck)[begin:begin + deck]]
            self.assertEqual(set(kinds), set(schedule.KINDS))

    def test_only_narrows_and_refuses_what_is_none(self):
        self.assertEqual({step["kind"] for step in first(1, 20, ("stop", "clock"))}, {"stop", "clock"})
        with self.assertRaisesRegex(ValueError, "no such kind: flood; allowed: kill, "):
            first(1, 1, ("flood",))

    def test_a_step_ends_what_it_began(self):
        for step in first(5, 2000):
            actions = step["actions"]
            self.assertEqual(actions, sorted(actions, key=lambda a: a["at_s"]), step)
            for i, action in enumerate(actions):
                end, of = ENDS.get(action["do"], (None, None))
                if end:
                    self.assertTrue(any(a["do"] == end and a[of] == action[of] for a in actions[i + 1:]), step)
            for host in ("master", "slave", "view"):
                last = [a for a in actions if a["do"] in ("clock", "link") and a["host"] == host]
                if last:
                    self.assertTrue(all(last[-1].get(k, 0.0) == 0.0 for k in ("offset_s", "loss", "delay_ms", "repeated")), step)

    def test_all_stories_come_up(self):
        seen = {(a["do"], a.get("how") or a.get("names") or a.get("way") or a.get("lie")) for step in first(2, 3000) for a in step["actions"]}
        for expected in (
                ("stop", "signal_slave"), ("reset", "old"), ("reset", "looked"), ("reset", "now"), ("cut", "from"),
                ("freeze_thread", None), ("spoil_files", "removed"), ("spoil_files", "cut"), ("start_lying", "encoder_mirrored")):
            self.assertIn(expected, seen)


if __name__ == "__main__":
    unittest.main()
