#!/usr/bin/env python3
"""Every invariant can fail: a hand-made trace that violates each is found, and one that keeps it is not."""
import json
import tempfile
import unittest
from pathlib import Path
from unittest import mock

from observer import Observer, Sources, explain
from recordings import DragField, DriveRow, Echo, MasterState, OperatorCommand, Sample, SlaveState, Stamp
from scene import COUPLED, DEGRADED, INIT, STOPPED, Limits

PERIOD_S = 0.002
MASTER, SLAVE, STRANGER = 11, 12, 13  # sessions and, times ten, pids


def limits():
    return Limits(joints=["a", "b"], percept_cap=[1.0, 1.0], feedback_cap=[2.0, 2.0], motor_limit=[2.5, 2.5], rate=[20.0, 20.0], quantum=[0.01, 0.01], speed=[1.0, 1.0],
                  recovery_s=20.0, memory_MiB=10.0, settled_s=5.0)


class Trace:
    """Both sides coupled, drives that exert 0.5 of their own choice, nothing done; a test changes what it is about."""

    def __init__(self):
        self.observer = Observer(limits(), lambda violation, before: self.told.append(explain(violation, before, 0.0)))
        self.told, self.t, self.numbers, self.echoed = [], 0.0, {}, {}
        self.master = {"state": COUPLED, "cause": 0, "stop": 0, "law": 1, "session": MASTER, "percept": (-0.1, 0.0), "feedback": (0.2, 0.0), "velocity": (0.3, 0.0),
                       "partner": SLAVE, "speaks": True}
        self.slave = {"state": COUPLED, "cause": 0, "stop": 0, "session": SLAVE, "partner": MASTER, "speaks": True, "position": (0.0, 0.0)}
        self.to_master = self.to_slave = True       # the cable, each way
        self.torque, self.position, self.instance, self.velocity, self.power = 0.5, 0.0, 1, 0.3, "enabled"
        self.speed, self.lies = 0.0, False          # of the arm
        self.drives_run = self.taps_run = self.drag = True

    def stamp(self, session):
        self.numbers[session] = self.numbers.get(session, 0) + 1
        return Stamp(self.numbers[session], round(self.t * 1e9), 0, session)

    def send(self, tap, topic, process, content, later_s=0.0):
        if self.taps_run:
            self.observer.take(Sample(self.t + later_s, tap, topic, process, content))

    def master_state(self):
        m = self.master
        return MasterState(self.stamp(m["session"]), m["state"], m["cause"], m["stop"], m["law"], 2, (0.0, 0.0), m["velocity"], m["percept"], m["feedback"],
                           Echo(1, self.echoed.get(m["partner"], 1), m["partner"]), Echo(1, self.echoed.get(14, 1), 14))

    def slave_state(self):
        s = self.slave
        return SlaveState(self.stamp(s["session"]), s["state"], s["cause"], s["stop"], 2, s["position"], (0.0, 0.0), (0.0, 0.0), Echo(1, 1, s["partner"]))

    def run(self, seconds):
        for _ in range(round(seconds / PERIOD_S)):
            self.t += PERIOD_S
            if self.master["speaks"]:
                state = self.master_state()
                self.send("master", "master_state", MASTER * 10, state)
                if self.to_slave:
                    self.send("slave", "master_state", MASTER * 10, state)
            if self.drag:
                self.send("master", "drag_field", 140, DragField(self.stamp(14), Echo(1, 1, SLAVE), True))
            if self.slave["speaks"]:
                state = self.slave_state()
                self.send("slave", "slave_state", SLAVE * 10, state)
                if self.to_master:
                    self.send("master", "slave_state", SLAVE * 10, state)
            if self.drives_run:
                self.observer.take(DriveRow(self.t, "master", 0, self.instance, self.power, self.torque, 0.0, self.velocity))
                self.observer.take(DriveRow(self.t, "slave", 0, self.instance, self.power, 0.0, self.position, self.speed, self.lies))
        return self

    def fact(self, what, **more):
        self.observer.take({"t": self.t, "fact": what, **more})
        return self

    def command(self, kind, master_stop=0, slave_stop=0, taps=("master", "slave")):
        content = OperatorCommand(self.stamp(99), kind, 0.0, master_stop, slave_stop)
        for tap in taps:
            self.send(tap, "operator_command", 990, content)
        return self

    def stop(self, master=0xA, slave=0xB):
        self.master.update(state=STOPPED, stop=master, cause=1)
        self.slave.update(state=STOPPED, stop=slave, cause=1)
        return self

    def release(self):
        self.master.update(state=INIT, stop=0, cause=0)
        self.slave.update(state=INIT, stop=0, cause=0)
        return self


class Invariants(unittest.TestCase):
    def held(self, trace, rule=None):
        trace.observer.end()
        self.assertEqual(trace.told, [])
        if rule:
            checks = next(r for r in trace.observer.verdicts()["rules"] if r["name"] == rule)["checks"]
            self.assertGreater(checks, 0, rule)

    def violated(self, trace, rule, words, also=()):
        trace.observer.end()
        found = {r["name"]: r["violations"] for r in trace.observer.verdicts()["rules"] if r["violations"]}
        self.assertIn(rule, found)
        self.assertEqual(set(found) - {rule} - set(also), set())
        self.assertIn(words, found[rule][0]["what"])

    def test_a_calm_run_holds_everything(self):
        self.held(Trace().run(3.0))

    # ---- torque

    def test_coupled_only_while_heard(self):
        rule = "coupled only while heard"
        for side, way in (("master", "to_master"), ("slave", "to_slave")):
            trace = Trace().run(1.0)
            setattr(trace, way, False)
            trace.run(0.06)
            getattr(trace, side)["state"] = DEGRADED
            trace.torque = 0.0
            self.held(trace.run(0.5), rule)
            trace = Trace().run(1.0)
            setattr(trace, way, False)
            trace.run(0.06)
            trace.torque = 0.0
            self.violated(trace.run(0.5), rule, f"{side}_io is coupled 0.1")

    def test_torque_after_a_loss(self):
        rule = "torque zero after a loss"
        trace = Trace().run(1.0)
        trace.to_master = False
        trace.master["state"] = DEGRADED
        trace.run(0.15)
        trace.torque = 0.0
        self.held(trace.run(1.0), rule)
        trace = Trace().run(1.0)
        trace.to_master = False
        trace.master["state"] = DEGRADED
        self.violated(trace.run(0.5), rule, "after the slave was last heard in time (0.000 s of these")

    def test_a_loss_while_the_loop_did_not_run_may_last_longer_by_that(self):
        trace = Trace().run(1.0)
        trace.to_master = False
        trace.master["state"] = DEGRADED
        trace.run(0.1)
        trace.t += 0.1                              # nothing runs: no rows, no states
        trace.run(0.06)
        trace.torque = 0.0
        self.held(trace.run(0.5), "torque zero after a loss")

    def test_a_slave_that_is_heard_late_is_a_loss(self):
        trace = Trace().run(1.0)
        trace.to_master = False
        trace.master["state"] = DEGRADED
        for _ in range(300):
            trace.run(PERIOD_S)
            old = trace.slave_state()._replace(stamp=Stamp(10**6 + trace.numbers[SLAVE], round((trace.t - 0.2) * 1e9), 0, SLAVE))
            trace.send("master", "slave_state", SLAVE * 10, old)
        self.violated(trace, "torque zero after a loss", "after the slave was last heard in time")

    def test_what_the_tap_could_not_see_is_counted_and_not_concluded_from(self):
        trace = Trace().run(1.0)
        trace.taps_run = False
        trace.run(0.4)
        trace.taps_run = True
        trace.to_master = False                     # heard again, but nothing of the slave
        trace.master["state"] = DEGRADED
        trace.run(0.1)
        trace.torque = 0.0
        trace.run(0.5)
        self.held(trace)
        self.assertGreater(next(r for r in trace.observer.verdicts()["rules"] if r["name"] == "torque zero after a loss")["unobservable"], 0)

    def test_percept_after_a_loss(self):
        rule = "percept zero after a loss"
        trace = Trace().run(1.0)
        trace.drag = False
        trace.run(0.15)
        trace.master["percept"] = (0.0, 0.0)
        self.held(trace.run(1.0), rule)
        trace = Trace().run(1.0)
        trace.drag = False
        self.violated(trace.run(0.5), rule, "after a valid drag_field was last heard")

    def test_what_the_master_heard_and_the_tap_did_not_is_no_loss(self):
        for echoed in (SLAVE, 14):
            trace = Trace().run(1.0)
            trace.to_master, trace.drag = echoed != SLAVE, echoed != 14
            for _ in range(100):
                trace.echoed[echoed] = round(trace.t * 1e9)
                trace.run(PERIOD_S)
            self.held(trace.run(0.05))

    def test_torque_after_silence(self):
        rule = "torque zero after silence"
        for frozen in ("master_io", "master_io/servo"):
            trace = Trace().run(1.0)
            trace.master["speaks"], trace.slave["state"] = False, DEGRADED
            trace.fact("frozen", process=frozen).run(0.55)
            trace.torque = 0.0
            self.held(trace.run(1.0), rule)
            trace = Trace().run(1.0)
            trace.master["speaks"], trace.slave["state"] = False, DEGRADED
            self.violated(trace.fact("frozen", process=frozen).run(1.0), rule, "after master_io's last word")

    def test_torque_under_a_stop(self):
        rule = "torque zero under a stop"
        trace = Trace().run(1.0).stop().run(0.1)
        trace.torque = 0.0
        self.held(trace.run(1.0), rule)
        self.violated(Trace().run(1.0).stop().run(0.5), rule, "after master_io's stop")

    def test_caps(self):
        rule = "torque within its caps"
        trace = Trace().run(0.5)
        trace.master["percept"] = (-1.001, 0.0)
        self.violated(trace.run(0.1), rule, "percept on a, by master_state: -1.001")
        trace = Trace().run(0.5)
        trace.master["feedback"] = (0.0, 2.1)
        self.violated(trace.run(0.1), rule, "feedback on b")
        trace = Trace()
        trace.torque = 2.6
        self.violated(trace.run(0.5), rule, "master's drive of a: 2.6")
        trace = Trace()
        trace.torque = -1.5                         # allowed as a sum, not as the percept alone
        self.held(trace.run(3.0), rule)
        trace = Trace()
        trace.torque, trace.master["law"] = -1.5, 0
        self.violated(trace.run(3.0), rule, "percept alone")

    def test_slew(self):
        rule = "torque changes within its rate"
        trace = Trace().run(0.5)
        trace.master["law"] = 0
        for _ in range(100):
            trace.torque += 20.0 * PERIOD_S * 0.1
            trace.run(PERIOD_S)
        trace.torque = 0.0                          # a fall may be sudden
        self.held(trace.run(0.5), rule)
        trace = Trace()
        trace.master["law"] = 0
        trace.torque = 0.1
        trace.run(0.5)
        trace.torque = 0.9
        self.violated(trace.run(0.1), rule, "went from 0.100 to 0.900")

    def test_percept_power(self):
        rule = "percept never pushes"
        trace = Trace().run(0.5)
        trace.master["percept"] = (0.1, 0.0)
        self.violated(trace.run(0.1), rule, "percept on a: 0.1 at 0.3")
        trace = Trace()
        trace.master["law"], trace.torque = 0, -0.4  # at the drives: against the motion
        self.held(trace.run(4.0), rule)
        trace = Trace()
        trace.master["law"], trace.torque = 0, 0.4
        self.violated(trace.run(4.0), rule, "gave the hand 0.1")

    # ---- the arm

    def test_motion_under_a_stop(self):
        rule = "no motion under a stop"

        def stopped():
            trace = Trace().run(1.0).stop()
            trace.torque = 0.0
            return trace.run(1.0)
        trace = stopped()
        trace.position = 0.015
        self.held(trace.run(1.0), rule)
        trace = stopped()
        trace.position = 0.03
        self.violated(trace.run(0.1), rule, "slave's drive of a moved by 0.0300 rad")
        trace = stopped()                           # other drives begin elsewhere
        trace.position, trace.instance = 0.5, 2
        self.held(trace.run(1.0), rule)
        trace = stopped().command(1, 0xA, 0xB).release()
        trace.run(0.1)
        trace.position = 0.3                        # released: it may move
        self.held(trace.run(1.0), rule)

    def test_the_arm_holds_after_a_loss(self):
        rule = "the arm holds after a loss"
        trace = Trace().run(1.0)
        trace.to_slave = False
        trace.slave["state"] = DEGRADED
        trace.run(1.0)
        self.held(trace, rule)
        trace.position = 0.04
        self.violated(trace.run(0.1), rule, "after the master was last heard in time", also=("torque zero after a loss",))

    def test_the_arms_speed(self):
        rule = "the arm's speed within its limits"
        trace = Trace().run(2.0)
        trace.speed = 1.2
        self.held(trace.run(0.1), rule)
        trace.speed = -1.3
        self.violated(trace.run(0.1), rule, "slave's drive of a moves at -1.300")
        trace = Trace().run(2.0)
        trace.t += 0.2                              # nothing ran
        trace.speed = 2.0
        self.held(trace.run(0.1))
        trace = Trace().run(2.0)
        trace.slave["speaks"] = False               # slave_io alone was held up: its drives ran on
        trace.run(0.05)
        trace.slave["speaks"] = True
        trace.speed = 2.0
        self.violated(trace.run(0.1), rule, "slave's drive of a moves at 2.000")

    # ---- stops

    def test_a_stop_is_kept(self):
        rule = "a stop is kept"

        def stopped():
            trace = Trace().run(1.0).stop()
            trace.torque = 0.0
            return trace.run(0.5)
        self.held(stopped().command(1, 0xA, 0xB).release().run(0.5), rule)
        self.violated(stopped().release().run(0.5), rule, "no reset has named its stop a")
        self.violated(stopped().command(1, 0xC, 0xD).release().run(0.5), rule, "resets named c")
        # A reset that names the stop before undoes no later one.
        trace = stopped().command(1, 0xA, 0xB)
        trace.stop(0xE, 0xF).run(0.2)
        self.violated(trace.release().run(0.2), rule, "no reset has named its stop e")
        # It let go, and the other side's stop stopped it again at once.
        trace = stopped()
        trace.slave.update(stop=0xF, cause=3)
        self.violated(trace.run(0.2), rule, "slave_io let go of its stop b")
        trace = stopped()
        trace.slave.update(stop=0xF, cause=1)       # another emergency stop
        self.held(trace.run(0.2), rule)
        # Killed and started again, it has forgotten.
        trace = stopped()
        trace.slave.update(session=112, state=INIT, stop=0)
        self.violated(trace.run(0.5), rule, "slave_io is init, though no reset")
        # Killed and started again, it has not.
        trace = stopped()
        trace.slave.update(session=112)
        self.held(trace.run(0.5), rule)
        trace = stopped().command(1, 0xA, 0xB).release().run(0.2)
        trace.stop()
        self.violated(trace.run(0.2), rule, "in force that a reset had ended")
        trace = Trace().run(0.5).stop(0, 0xB)
        trace.torque = 0.0
        self.violated(trace.run(0.2), rule, "without a name")

    def test_a_stop_takes_hold(self):
        rule = "a stop takes hold"
        trace = Trace().run(1.0).command(0).run(0.01).stop()
        trace.torque = 0.0
        self.held(trace.run(3.0), rule)
        self.violated(Trace().run(1.0).command(0).run(3.0), rule, "is coupled 2.00 s after a stop was asked for")
        self.violated(Trace().run(1.0).fact("stop_signal", side="slave").run(3.0), rule, "slave_io is coupled")
        self.held(Trace().run(1.0).command(0, taps=()).run(3.0))

    # ---- partners, numbers, recovery, memory

    def test_a_second_writer(self):
        rule = "a second writer is refused"
        trace = Trace().run(1.0)
        trace.master["partner"] = STRANGER          # though the slave is heard
        self.violated(trace.run(0.1), rule, "master_io goes by another process")
        trace = Trace().run(1.0)
        trace.slave["speaks"] = False
        trace.torque, trace.master["state"] = 0.0, DEGRADED
        trace.run(0.6)
        trace.master["partner"] = STRANGER
        self.held(trace.run(0.1), rule)

    # ---- what answers in form and is wrong

    def test_a_lying_drive(self):
        rule = "a lying drive leads no joint astray"
        trace = Trace().run(1.0)
        trace.lies, trace.position = True, 0.1
        trace.run(0.5)
        trace.position = 0.3                        # by 0.2 since the lie began
        self.held(trace.run(0.5), rule)
        trace.position = 0.4
        self.violated(trace.run(0.1), rule, "slave's drive of a is 0.30 rad farther from the master's")
        trace = Trace().run(1.0)                    # found: the arm is stopped, and may be moved by hand
        trace.lies = True
        trace.run(0.1)
        trace.slave["state"], trace.position = DEGRADED, 2.0
        self.held(trace.run(0.5), rule)

    def test_another_arm(self):
        rule = "another arm is refused"
        trace = Trace().run(1.0).fact("started", process="slave_io", pid=SLAVE * 10, other_arm=True)
        trace.slave["state"] = trace.master["state"] = INIT
        self.held(trace.run(1.0), rule)
        trace.master["state"] = COUPLED             # by a process whose arm is another
        self.violated(trace.run(0.1), rule, "master_io is coupled, though the slave's host has another arm")
        trace = Trace().run(1.0).fact("started", process="slave_io", pid=SLAVE * 10, other_arm=True)
        self.violated(trace.run(0.1), rule, "slave_io is coupled")

    def test_a_strangers_words_are_not_the_sides(self):
        trace = Trace().run(0.5).fact("started", process="second_master_io", pid=777, intruder=True)
        for _ in range(50):
            trace.run(PERIOD_S)
            trace.send("master", "master_state", 777, trace.master_state()._replace(state=STOPPED, stop=5, stamp=trace.stamp(STRANGER)))
        self.held(trace.run(0.5))

    def test_numbers(self):
        trace = Trace().run(0.5)
        trace.slave["position"] = (float("nan"), 0.0)
        self.violated(trace.run(0.1), "numbers are numbers", "slave_state")

    def test_recovery(self):
        rule = "recovery without restarting others"
        trace = Trace().run(0.5).fact("step_end", step=1, kind="kill")
        trace.master["state"] = DEGRADED
        trace.run(1.0)
        trace.master["state"] = COUPLED
        self.held(trace.run(1.0), rule)
        self.assertAlmostEqual(trace.observer.verdicts()["recoveries"][0]["s"], 1.0, delta=0.05)
        self.violated(Trace().run(0.5).fact("step_end", step=1, kind="kill").fact("gave_up", step=1, kind="kill"), rule, "not coupled 20 s after step 1 (kill)")
        self.violated(Trace().run(0.5).fact("died", process="wva_server", pid=1, code=139), rule, "wva_server ended by itself with 139")

    def test_memory(self):
        def grows(by_MiB):
            trace = Trace()
            for i in range(10):
                trace.run(1.0).fact("memory", processes=[{"process": "slave_io", "pid": 1, "own_MiB": 50.0 + i * by_MiB}])
            return trace
        self.held(grows(1.0), "memory is bounded")
        self.violated(grows(4.0), "memory is bounded", "slave_io grew by")

    def test_a_violation_is_told_with_what_was_done_before_it(self):
        trace = Trace().run(1.0).fact("cut", host="slave", way="to").run(0.1)
        trace.master["percept"] = (-3.0, 0.0)
        trace.run(PERIOD_S)
        self.assertIn('VIOLATION of "torque within its caps" at 1.102 s', trace.told[0])
        self.assertIn("0.002 s earlier: fact=cut host=slave way=to".replace("0.002", "0.102"), trace.told[0])


class Reading(unittest.TestCase):
    """What is read from several files that grow is taken in order of time."""

    def test_a_fact_comes_before_what_happened_after_it_though_reading_takes_long(self):
        with tempfile.TemporaryDirectory() as name, mock.patch("observer.time.monotonic") as now:
            folder = Path(name)
            (folder / "drives").mkdir()
            (folder / "facts.jsonl").write_text("")
            sources = Sources(folder, {"drives": {}}, None)

            def slow_tap():  # while it is read, something is done to the system, and heard of
                now.return_value = 150.0
                (folder / "facts.jsonl").write_text(json.dumps({"t": 120.0, "fact": "reset"}) + "\n")
                return [Sample(130.0, "slave", "slave_state", 1, None)]
            now.return_value = 100.0
            with mock.patch.object(sources.taps[1], "read", slow_tap):
                sources.read()
            self.assertEqual(sources.until(sources.complete_s), [])
            sources.read()
            self.assertEqual([r["t"] if isinstance(r, dict) else r.t for r in sources.until(sources.complete_s)], [120.0, 130.0])


if __name__ == "__main__":
    unittest.main()
