"""What the master's drives may exert, by their own records. Pure; how rules see a run: invariants.py."""
from collections import defaultdict, deque

from rule import SLACK_S, Rule

PF = 0                  # the law without feedback: all of the torque is the percept's
ROW_GAP_S = 0.03        # between rows of a drive that runs


class TorqueAfterLoss(Rule):
    name = "torque zero after a loss"
    promise = "Once the slave is not heard for the staleness, the master's drives exert nothing after the ramp."
    unit = "s"

    def __init__(self, scene):
        super().__init__(scene)
        limits = self.limits
        # Two periods to notice, two until the drives do it.
        self.bound = limits.staleness_s + limits.ramp_down_s + 4 * limits.period_s + SLACK_S
        self.loss = None

    def drive(self, row, gaps):
        if row.side != "master":
            return
        heard = self.scene.partner_heard("master")
        if heard is None or row.t - heard <= self.limits.staleness_s:
            return
        own = self.scene.own_gaps["master"]
        if row.t - own.last > SLACK_S:
            return  # the servo does not run: the drives' own watch counts ("torque zero after silence")
        if heard != self.loss:
            self.loss = heard
            self.checks += 1
        if abs(row.torque) <= 1.5 * self.limits.quantum[row.joint]:
            return
        if self.scene.tap_missed("master", heard, row.t):
            self.unobservable += 1
            return
        held_up = own.within(heard, row.t) + gaps.within(heard, row.t)
        late = row.t - heard - held_up
        if late > self.bound:
            self.violated(row.t, f"{self.joint(row)} exerts {row.torque:.3f} {row.t - heard:.3f} s after the slave was last heard in time "
                                 f"({held_up:.3f} s of these the loop did not run)", heard)
        else:
            self.measured(late, row.t)


class PerceptAfterLoss(Rule):
    name = "percept zero after a loss"
    promise = "Once no valid drag_field is heard for the staleness, the percept is nothing after the ramp."
    unit = "s"

    def __init__(self, scene):
        super().__init__(scene)
        limits = self.limits
        self.bound = limits.staleness_s + limits.ramp_down_s + 4 * limits.period_s + SLACK_S
        self.loss = None

    def own(self, side, sample):
        heard = self.scene.drag_heard
        stamped = sample.content.stamp.monotonic_ns * 1e-9
        if side != "master" or heard is None or stamped - heard <= self.limits.staleness_s:
            return
        if heard != self.loss:
            self.loss = heard
            self.checks += 1
        if not any(sample.content.percept):
            return
        newer = sample.content.drag_echo.monotonic_ns * 1e-9 > self.scene.drag_stamp + self.scene.TAP_GAP_S
        if newer or self.scene.tap_gaps["master"].within(heard, stamped) > 0.0:
            self.unobservable += 1
            return
        late = stamped - heard - self.scene.own_gaps["master"].within(heard, stamped)
        if late > self.bound:
            self.violated(sample.t, f"master_state has a percept {stamped - heard:.3f} s after a valid drag_field was last heard in time", heard)
        else:
            self.measured(late, stamped)


class TorqueAfterSilence(Rule):
    name = "torque zero after silence"
    promise = "Once master_io is silent, its drives miss its heartbeat and exert nothing."
    unit = "s"

    def __init__(self, scene):
        super().__init__(scene)
        self.bound = self.limits.heartbeat_timeout_s + self.limits.heartbeat_s + 2 * SLACK_S
        self.silence = None

    def drive(self, row, gaps):
        last = self.scene.own_gaps["master"].last
        if row.side != "master" or last is None or row.t - last <= 0.3:
            return
        gone = "master_io" in self.scene.held_up or "master_io/servo" in self.scene.held_up
        if last != self.silence and gone:
            self.silence = last
            self.checks += 1
        if abs(row.torque) <= 1.5 * self.limits.quantum[row.joint]:
            return
        held_up = gaps.within(last, row.t)
        late = row.t - last - held_up
        if late <= self.bound:
            if gone:
                self.measured(late, row.t)
        elif gone:
            self.violated(row.t, f"{self.joint(row)} exerts {row.torque:.3f} {row.t - last:.3f} s after master_io's last word", last)
        else:
            self.unobservable += 1  # silent on the wire, yet neither dead nor frozen as a whole: it may well run


class TorqueUnderStop(Rule):
    name = "torque zero under a stop"
    promise = "Once master_io says that it is stopped, its drives exert nothing after the ramp, until a reset names that stop."
    unit = "s"

    def __init__(self, scene):
        super().__init__(scene)
        self.bound = self.limits.ramp_down_s + 4 * self.limits.period_s + SLACK_S
        self.since = None

    def drive(self, row, gaps):
        since = self.scene.stopped_since("master")
        if row.side != "master" or since is None or row.t <= since:
            return
        if since != self.since:
            self.since = since
            self.checks += 1
        if abs(row.torque) <= 1.5 * self.limits.quantum[row.joint]:
            return
        held_up = self.scene.own_gaps["master"].within(since, row.t) + gaps.within(since, row.t)
        late = row.t - since - held_up
        if late > self.bound:
            self.violated(row.t, f"{self.joint(row)} exerts {row.torque:.3f} {row.t - since:.3f} s after master_io's stop", since)
        else:
            self.measured(late, row.t)


class TorqueCap(Rule):
    name = "torque within its caps"
    promise = "Percept, feedback and their sum stay within their caps, on the wire; at the drives the sum does, and with law pf the percept."
    unit, bound = "share of the cap", 1.0

    def own(self, side, sample):
        if side != "master":
            return
        self.checks += 1
        state, limits = sample.content, self.limits
        for parts, caps, what in ((state.percept, limits.percept_cap, "percept"), (state.feedback, limits.feedback_cap, "feedback")):
            for j, torque in enumerate(parts):
                self.hold(abs(torque) / caps[j], 1e-9, sample.t, f"{what} on {limits.joints[j]}, by master_state", torque)

    def drive(self, row, gaps):
        if row.side != "master":
            return
        self.checks += 1
        limits, j = self.limits, row.joint
        slack = 1.5 * limits.quantum[j]
        self.hold(abs(row.torque) / limits.motor_limit[j], slack / limits.motor_limit[j], row.t, self.joint(row), row.torque)
        # The feedback of the law before has faded out after a ramp; what the drives do comes a little after what is said.
        if self.scene.law == PF and row.t - self.scene.law_since > 1.0:
            self.hold(abs(row.torque) / limits.percept_cap[j], slack / limits.percept_cap[j], row.t, self.joint(row) + ", percept alone", row.torque)

    def hold(self, share, slack, t, what, torque):
        if share > 1.0 + slack:
            self.violated(t, f"{what}: {torque:.4g}, {share:.3f} of its cap", what)
        else:
            self.measured(min(share, 1.0), t)


class TorqueSlew(Rule):
    """Over a window: what two ticks or frames that come close together do is evened out; what a jump does is not."""
    name = "torque changes within its rate"
    promise = "The torque of the master's drives grows no faster than torque_rate; it may fall to nothing at once."
    unit, bound = "share of the rate", 1.0
    WINDOW_S = 0.03

    def __init__(self, scene):
        super().__init__(scene)
        self.rows = defaultdict(deque)

    def drive(self, row, gaps):
        if row.side != "master":
            return
        rows = self.rows[(row.joint, row.instance)]
        rows.append((row.t, row.torque))
        while rows[0][0] < row.t - self.WINDOW_S:
            rows.popleft()
        then, torque = rows[0]
        if abs(row.torque) <= abs(torque) or len(rows) < 2:
            return  # a fall
        self.checks += 1
        limits, j = self.limits, row.joint
        # A percept that would push falls at once, and takes the sum with it, towards the feedback.
        grown = abs(row.torque - torque) if row.torque * torque >= 0.0 else abs(row.torque)
        lasted = row.t - then + 4 * limits.period_s + self.scene.own_gaps["master"].within(then - SLACK_S, row.t) + gaps.within(then - SLACK_S, row.t)
        allowed = limits.rate[j] * lasted + 1.5 * limits.quantum[j]
        fall = limits.percept_cap[j] if self.scene.law != PF and row.power == "enabled" else 0.0
        if grown > allowed + fall:
            self.violated(row.t, f"{self.joint(row)} went from {torque:.3f} to {row.torque:.3f} within {(row.t - then) * 1e3:.1f} ms; "
                                 f"{allowed:.3f} are allowed", row.joint)
        else:
            self.measured(min(1.0, grown / allowed), row.t)


class PerceptPower(Rule):
    """By the wire: of the same tick. At the drives, with law pf: what they gave to the hand in a second, because their torque is some
    periods old; the bound is what that is worth at the hand's accelerations."""
    name = "percept never pushes"
    promise = "The percept's power is never positive on any joint; with law pf the drives give the hand no energy."
    unit, bound = "J in a second", 0.01

    def __init__(self, scene):
        super().__init__(scene)
        self.given, self.before = defaultdict(float), {}
        self.second = None

    def own(self, side, sample):
        if side != "master":
            return
        self.checks += 1
        for j, (torque, velocity) in enumerate(zip(sample.content.percept, sample.content.velocity)):
            if torque * velocity > 1e-12:
                self.violated(sample.t, f"percept on {self.limits.joints[j]}: {torque:.4g} at {velocity:.4g} rad/s or m/s gives {torque * velocity:.3g} W", j)

    def drive(self, row, gaps):
        if row.side != "master":
            return
        key = (row.joint, row.instance)
        before = self.before.get(key)
        self.before[key] = row
        scene = self.scene
        pf = scene.law == PF and row.t - scene.law_since > 1.0 and row.power == "enabled"
        own = scene.own_gaps["master"]
        if not pf or before is None or row.t - before.t > ROW_GAP_S or own.last is None or row.t - own.last > SLACK_S or own.within(row.t - 0.2, row.t) > 0.0:
            return
        self.checks += 1
        if self.second is None or row.t - self.second > 1.0:
            for joint, energy in self.given.items():
                self.hold(joint, energy, row.t)
            self.second = row.t
            self.given.clear()
        self.given[row.joint] += max(0.0, before.torque * before.velocity) * (row.t - before.t)

    def hold(self, joint, energy, t):
        if energy > self.bound:
            self.violated(t, f"master's drive of {self.limits.joints[joint]} gave the hand {energy:.4f} J within a second, by the percept alone", ("drive", joint))
        else:
            self.measured(energy, t)
