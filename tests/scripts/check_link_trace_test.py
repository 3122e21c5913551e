"""The judge of recorded runs: what master and slave do is accepted, and each rule refuses what breaks it."""
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "scripts/checks/link_trace"
STATES = ("INIT", "READY", "ALIGNED", "COUPLED", "DEGRADED", "STOPPED")
STOP = {"master": 11, "slave": 22}


class Run:
    """Master and slave at 1 kHz, as they say what they do; each hears the other's sample of the tick before."""

    def __init__(self):
        self.lines, self.number, self.heard = [], {"master": 0, "slave": 0}, {"master": 0, "slave": 0}
        self.session = {"master": 1, "slave": 2}

    def say(self, master, slave, ticks=1, hear=True, torque=0.0, position=0.0, stops=None, cause="STOP_EMERGENCY"):
        """`ticks` of both sides in the states of these letters: I, R, A, C, D, S."""
        stops = stops or STOP
        for _ in range(ticks):
            before = dict(self.number)
            for side, letter in (("master", master), ("slave", slave)):
                self.number[side] += 1
                other = "slave" if side == "master" else "master"
                if hear:
                    self.heard[side] = before[other]
                state = next(name for name in STATES if name[0] == letter)
                echo = {"session": str(self.session[other]) if self.heard[side] else "0", "sequence_number": self.heard[side]}
                sample = {"stamp": {"session": str(self.session[side]), "sequence_number": self.number[side],
                                    "monotonic_ns": 10**9 + self.number[side] * 10**6},
                          "state": f"LINK_{state}", "stop": str(stops[side] if letter == "S" else 0),
                          "stop_cause": cause if letter == "S" else "STOP_NONE", "joint_count": 1}
                if side == "master":
                    sample.update(percept_torque_Nm=[torque], feedback_torque_Nm=[0.0], slave_echo=echo)
                else:
                    sample.update(position_rad=[position], master_echo=echo)
                self.lines.append({"topic": f"{side}_state", "sample": sample})
        return self

    def couple(self):
        return self.say("I", "I", 3).say("R", "R", 50).say("A", "A", 2).say("C", "C", 100, torque=1.0)

    def stop(self):
        return self.say("S", "C", torque=0.9).say("S", "S", 300)

    def reset(self, master=STOP["master"], slave=STOP["slave"]):
        self.lines.append({"topic": "operator_command", "sample": {"kind": "COMMAND_RESET", "master_stop": str(master), "slave_stop": str(slave)}})
        return self

    def event(self, **line):
        self.lines.append(line)
        return self


class CheckLinkTrace(unittest.TestCase):
    def judge(self, run):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "trace.jsonl"
            file.write_text("".join(json.dumps(line) + "\n" for line in run.lines), encoding="utf-8")
            return subprocess.run([sys.executable, SCRIPT, file], capture_output=True, text=True, check=False)

    def accepts(self, run):
        done = self.judge(run)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def refuses(self, run, rule):
        done = self.judge(run)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn(f": {rule}: ", done.stdout)

    def test_what_the_sides_do_is_accepted(self):
        self.accepts(Run().couple().stop().reset().say("I", "I", 2).say("R", "R", 50).say("A", "A", 2).say("C", "C", 10, torque=1.0))

    def test_a_stop_that_ends_unnamed_is_refused(self):
        self.refuses(Run().couple().stop().say("I", "S", 5), "stop")
        self.refuses(Run().couple().stop().reset(master=12).say("I", "S", 5), "stop")

    def test_where_resets_are_not_recorded_a_release_is_believed(self):
        self.accepts(Run().event(event="commands", complete=False).couple().stop().say("I", "I", 5))

    def test_a_stop_of_the_partner_that_does_not_stop_is_refused(self):
        self.refuses(Run().couple().say("S", "C", 20), "model")

    def test_a_stop_that_a_new_process_does_not_know_is_refused(self):
        run = Run().couple().stop()
        run.session["master"], run.number["master"] = 3, 0
        self.refuses(run.say("I", "S", 3, hear=False), "stop")
        run = Run().couple().stop().event(event="stop_file_lost", side="master")
        run.session["master"], run.number["master"] = 3, 0
        self.accepts(run.say("I", "S", 1, hear=False))

    def test_coupled_without_an_aligned_partner_is_refused(self):
        self.refuses(Run().say("I", "I", 3).say("R", "R", 50).say("A", "R", 50).say("C", "R", 5), "model")

    def test_coupled_with_a_partner_that_is_not_heard_is_refused(self):
        self.accepts(Run().couple().say("C", "C", 50, hear=False))
        self.refuses(Run().couple().say("C", "C", 300, hear=False), "staleness")

    def test_torque_that_stays_or_is_beyond_its_cap_is_refused(self):
        self.refuses(Run().couple().say("S", "S", 400, torque=0.5), "torque")
        self.refuses(Run().event(event="limits", torque_cap_Nm=[0.8]).couple(), "cap")
        self.accepts(Run().event(event="limits", torque_cap_Nm=[1.0]).couple())

    def test_an_arm_that_moves_in_a_stop_is_refused(self):
        self.refuses(Run().couple().stop().say("S", "S", 300, position=0.1), "motion")
        self.accepts(Run().couple().stop().say("S", "S", 300, position=0.01))

    def test_lost_samples_do_not_refuse_what_is_right(self):
        run = Run().couple().stop().reset().say("I", "I", 2).say("R", "R", 50).say("A", "A", 2).say("C", "C", 10)
        run.lines = [line for number, line in enumerate(run.lines) if number % 7 not in (2, 3) or line["topic"] == "operator_command"]
        self.accepts(run)

    def test_a_trace_that_begins_late_may_begin_in_any_state(self):
        run = Run().couple().say("D", "D", 20)
        run.lines = run.lines[-20:]
        self.accepts(run)
        # Who is there from its first tick on cannot have lost anybody.
        self.refuses(Run().say("D", "D", 3), "model")

    def test_what_cannot_be_judged_is_an_error_of_its_own(self):
        self.assertEqual(self.judge(Run()).returncode, 2)
        run = Run().couple()
        del run.lines[5]["sample"]["state"]
        done = self.judge(run)
        self.assertEqual(done.returncode, 2)


if __name__ == "__main__":
    unittest.main()
