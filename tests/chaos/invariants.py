"""The promises that must hold whatever happens, each as a rule over what was seen. Pure: no clock, file or process.

A rule takes what was seen in order of time. All times are CLOCK_MONOTONIC of the one machine whose hosts are namespaces, in s. What a
loaded machine does is told apart from a violation: a process that did not run is seen by the gap between its own stamps, and may be late by
that gap. Where something cannot be known (the observer's own tap did not run), it is counted as unobservable, and nothing is concluded.
"""
import math

from model_rules import LyingDrive, OtherArmRefused
from recordings import EMERGENCY_STOP, LINK
from rule import SLACK_S, Rule
from scene import COUPLED, STOPPED
from torque_rules import PerceptAfterLoss, PerceptPower, TorqueAfterLoss, TorqueAfterSilence, TorqueCap, TorqueSlew, TorqueUnderStop

BY_PARTNER = 3  # StopCause


class Held(Rule):
    """The slave's drives stay where they are while `reason` gives a time since when they must."""
    unit = "rad"

    def __init__(self, scene):
        super().__init__(scene)
        self.bound = self.limits.held_rad
        self.anchors = {}

    def since(self, t):
        """(since when the arm must be at rest, whether that can be known); None: it may move."""
        raise NotImplementedError

    def drive(self, row, gaps):
        if row.side != "slave":
            return
        since = self.since(row.t)
        if since is None or row.t < since + self.limits.settle_s + gaps.within(since, row.t):
            self.anchors.pop(row.joint, None)
            return
        anchor = self.anchors.get(row.joint)
        if anchor is None or anchor[0] != (since, row.instance):
            self.anchors[row.joint] = ((since, row.instance), row.position)
            self.checks += 1
            return
        moved = abs(row.position - anchor[1])
        if moved > self.bound:
            self.violated(row.t, f"{self.joint(row)} moved by {moved:.4f} rad, {row.t - since:.2f} s after {self.reason}", (row.joint, since))
        else:
            self.measured(moved, row.t)


class NoMotionUnderStop(Held):
    name = "no motion under a stop"
    promise = "Once slave_io says that it is stopped, the arm stays where it is until a reset names that stop."
    reason = "the slave's stop"

    def since(self, t):
        return self.scene.stopped_since("slave")


class SlaveHoldsAfterLoss(Held):
    name = "the arm holds after a loss"
    promise = "Once the master is not heard for the staleness, the arm holds its position."
    reason = "the master was last heard in time"

    def since(self, t):
        scene = self.scene
        heard = scene.partner_heard("slave")
        own = scene.own_gaps["slave"]
        if heard is None or t - heard <= self.limits.staleness_s or own.last is None or t - own.last > SLACK_S:
            return None
        if scene.tap_missed("slave", heard, t):
            self.unobservable += 1
            return None
        return heard + self.limits.staleness_s + own.within(heard, t)


class ArmSpeed(Rule):
    """However long slave_io's loop is held up: its guard and the drives answer for that. Of a drive that itself did not run nothing is concluded for SETTLES_S."""
    name = "the arm's speed within its limits"
    promise = "No joint of the slave is faster than its limit, but for a quarter of it, also while slave_io's servo is held up."
    unit, bound = "share of the limit", 1.25
    SETTLES_S = 1.0

    def drive(self, row, gaps):
        if row.side != "slave" or row.lies:  # of a drive that lies: "a lying drive leads no joint astray"
            return
        self.checks += 1
        share = abs(row.velocity) / self.limits.speed[row.joint]
        if share <= 1.0 and share <= (self.worst or 0.0):
            return
        if gaps.within(row.t - self.SETTLES_S, row.t) > 0.0:
            self.unobservable += 1
        elif share > self.bound:
            self.violated(row.t, f"{self.joint(row)} moves at {row.velocity:.3f}, {share:.2f} of its limit", row.joint)
        else:
            self.measured(share, row.t)


class CoupledWhileHeard(Rule):
    name = "coupled only while heard"
    promise = "A side that does not hear its partner for the staleness says within two periods that it is not coupled."
    unit = "s"

    def __init__(self, scene):
        super().__init__(scene)
        self.bound = self.limits.staleness_s + 2 * self.limits.period_s + SLACK_S
        self.loss = {}

    def own(self, side, sample):
        heard = self.scene.partner_heard(side)
        stamped = sample.content.stamp.monotonic_ns * 1e-9
        if heard is None or stamped - heard <= self.limits.staleness_s:
            return
        if self.loss.get(side) != heard:
            self.loss[side] = heard
            self.checks += 1
        if sample.content.state != COUPLED:
            return
        if self.scene.tap_missed(side, heard, stamped):
            self.unobservable += 1
            return
        late = stamped - heard - self.scene.own_gaps[side].within(heard, stamped)
        if late > self.bound:
            self.violated(sample.t, f"{side}_io is coupled {stamped - heard:.3f} s after its partner was last heard in time", (side, heard))
        else:
            self.measured(late, stamped)


class StopKept(Rule):
    name = "a stop is kept"
    promise = "A side that said it is stopped says so ever after, also as a new process, until a reset names that stop."
    unit = ""

    def own(self, side, sample):
        self.checks += 1
        state, ledger, t = sample.content, self.scene.ledgers[side], sample.t
        if state.state == STOPPED:
            if state.stop == 0:
                self.violated(t, f"{side}_io is stopped without a name of that stop", side)
            if state.stop != ledger.stop:
                if state.stop in ledger.ended:
                    self.violated(t, f"{side}_io has a stop {state.stop:x} in force that a reset had ended", (side, state.stop))
                # Who is stopped has a new stop by a new reason; that the other side is stopped is none: this side must have let go in between.
                if ledger.stop and state.cause == BY_PARTNER and ledger.stop not in ledger.named:
                    self.violated(t, f"{side}_io let go of its stop {ledger.stop:x}, which no reset has named, and was stopped again by the other side", (side, ledger.stop))
                if not ledger.stop:
                    ledger.since = state.stamp.monotonic_ns * 1e-9
                ledger.stop = state.stop
            return
        if state.stop != 0:
            self.violated(t, f"{side}_io names stop {state.stop:x}, yet is {LINK[state.state]}", (side, state.stop))
        if ledger.stop and ledger.stop not in ledger.named:
            self.violated(t, f"{side}_io is {LINK[state.state]}, though no reset has named its stop {ledger.stop:x}, in force since {ledger.since:.3f} s "
                             f"(resets named {', '.join(f'{s:x}' for s in list(ledger.named)[-3:]) or 'none'})", (side, ledger.stop))
        if ledger.stop:
            ledger.ended.add(ledger.stop)
        ledger.stop, ledger.since = 0, None


class StopTakesHold(Rule):
    name = "a stop takes hold"
    promise = "A stop that a side's host hears, or a signal to it, stops that side: within 0.3 s, else it is shouted; within 2 s under chaos."
    unit = "s"

    def __init__(self, scene):
        super().__init__(scene)
        self.bound = self.limits.stop_s
        self.pending = []                           # (side, asked at, session)
        self.asked = set()

    def ask(self, side, t):
        own = self.scene.newest.get(side)
        if own and t - own.t < 0.05:                # alive and running as it was asked
            self.pending.append((side, t, own.content.stamp.session))

    def other(self, sample):
        c = sample.content
        if sample.topic == "operator_command" and c.kind == EMERGENCY_STOP:
            key = (sample.tap, c.stamp.session, c.stamp.number)
            if key not in self.asked:
                self.asked.add(key)
                self.ask(sample.tap, sample.t)

    def fact(self, fact):
        if fact["fact"] == "stop_signal":
            self.ask(fact["side"], fact["t"])

    def own(self, side, sample):
        if not self.pending:
            return
        stamped = sample.content.stamp.monotonic_ns * 1e-9
        for entry in [e for e in self.pending if e[0] == side and stamped > e[1]]:
            _, asked, session = entry
            if sample.content.stamp.session != session:  # died before it could; its successor's state is the other side's matter
                self.pending.remove(entry)
                self.unobservable += 1
                continue
            took = stamped - asked - self.scene.own_gaps[side].within(asked, stamped)
            if sample.content.state == STOPPED:
                self.pending.remove(entry)
                self.checks += 1
                self.measured(took, sample.t)
            elif took > self.bound:
                self.pending.remove(entry)
                self.violated(sample.t, f"{side}_io is {LINK[sample.content.state]} {took:.2f} s after a stop was asked for at its host", (side, asked))


class StrangersRefused(Rule):
    name = "a second writer is refused"
    promise = "While its partner is heard, a side goes by nobody else."
    unit = ""

    def __init__(self, scene):
        super().__init__(scene)
        self.partner, self.session = {}, {}

    def own(self, side, sample):
        echo = sample.content.partner_echo
        known = self.partner.get(side)
        if echo.session and known and echo.session != known:
            self.checks += 1
            heard = self.scene.heard[side].get(known)
            stamped = sample.content.stamp.monotonic_ns * 1e-9
            if heard is not None and stamped - heard < self.limits.second_writer_s and sample.content.stamp.session == self.session.get(side):
                self.violated(sample.t, f"{side}_io goes by another process {stamped - heard:.3f} s after it last heard its partner", (side, known))
        if echo.session:
            self.partner[side] = echo.session
        self.session[side] = sample.content.stamp.session


class Finite(Rule):
    name = "numbers are numbers"
    promise = "Nothing on the wire and no drive is ever infinite or not a number."
    unit = ""

    def own(self, side, sample):
        self.checks += 1
        state = sample.content
        numbers = state.position + state.velocity + (state.percept + state.feedback if side == "master" else state.loop)
        if not math.isfinite(sum(numbers)):
            self.violated(sample.t, f"{side}_state has a number that is none", side)

    def drive(self, row, gaps):
        if not math.isfinite(row.torque + row.position + row.velocity):
            self.violated(row.t, f"{self.joint(row)} has a number that is none", row.joint)


class Recovery(Rule):
    name = "recovery without restarting others"
    promise = "After each step the system is coupled again by itself (after a stop: by a reset), and no process has ended that was not killed."
    unit = "s"

    def __init__(self, scene):
        super().__init__(scene)
        self.bound = self.limits.recovery_s
        self.waiting = None                         # (since, step)
        self.both_since = None
        self.times = []                             # (kind, s)

    def fact(self, fact):
        what = fact["fact"]
        if what == "step_end":
            self.waiting = [fact["t"], fact]
            self.both_since = None
        if what == "reset" and self.waiting:        # whoever was stopped could not recover before
            self.waiting[0] = fact["t"]
            self.both_since = None
        if what == "died":
            self.violated(fact["t"], f"{fact['process']} ended by itself with {fact['code']}: {fact.get('words', '')}", ("died", fact["process"], fact["t"]))
        if what == "gave_up":
            self.checks += 1
            self.waiting = None
            self.violated(fact["t"], f"not coupled {self.bound:.0f} s after step {fact['step']} ({fact['kind']}): {fact.get('words', '')}", ("step", fact["step"]))

    def own(self, side, sample):
        if self.waiting is None or sample.content.state != COUPLED:
            if self.waiting is not None:
                self.both_since = None
            return
        other = self.scene.newest.get("slave" if side == "master" else "master")
        if other is None or other.content.state != COUPLED or sample.t < self.waiting[0]:
            return
        self.both_since = self.both_since or sample.t
        if sample.t - self.both_since > 0.3:
            self.checks += 1
            took = self.both_since - self.waiting[0]
            self.times.append((self.waiting[1]["kind"], max(0.0, took)))
            self.measured(max(0.0, took), sample.t)
            self.waiting = None


class Memory(Rule):
    name = "memory is bounded"
    promise = "No process grows by more than it may beyond what it has once it has settled."
    unit, bound = "share of what it may", 1.0

    def __init__(self, scene):
        super().__init__(scene)
        self.first, self.growth, self.started = {}, {}, {}

    def fact(self, fact):
        if fact["fact"] != "memory":
            return
        for entry in fact["processes"]:
            key = (entry["process"], entry["pid"])
            self.started.setdefault(key, fact["t"])
            if fact["t"] - self.started[key] < self.limits.settled_s:
                continue
            first = self.first.setdefault(key, entry["own_MiB"])
            grown = entry["own_MiB"] - first
            self.checks += 1
            self.growth[entry["process"]] = max(grown, self.growth.get(entry["process"], 0.0))
            bound = self.limits.more_memory_MiB.get(entry["process"], self.limits.memory_MiB)
            if grown > bound:
                self.violated(fact["t"], f"{entry['process']} grew by {grown:.0f} MiB, from {first:.0f} MiB", key)
            else:
                self.measured(grown / bound, fact["t"])


RULES = (TorqueAfterLoss, PerceptAfterLoss, TorqueAfterSilence, TorqueUnderStop, TorqueCap, TorqueSlew, PerceptPower, NoMotionUnderStop, SlaveHoldsAfterLoss, ArmSpeed,
         CoupledWhileHeard, StopKept,
         StopTakesHold, StrangersRefused, LyingDrive, OtherArmRefused, Finite, Recovery, Memory)
