"""What several invariants need to know of a run at a moment: who was heard when, which stop is in force, what was done. Pure."""
from collections import deque
from dataclasses import dataclass, field

from recordings import RESET

INIT, READY, ALIGNED, COUPLED, DEGRADED, STOPPED = range(6)
SIDES = ("master", "slave")


@dataclass
class Limits:
    """What the components' READMEs and parameters promise. Torques by joint, in the order of the topics' arrays."""
    joints: list                    # names
    percept_cap: list
    feedback_cap: list
    motor_limit: list
    rate: list                      # of the motor's torque, per s
    quantum: list                   # of the master's drives' torque
    speed: list                     # of the slave's joints, by the arm's URDF
    staleness_s: float = 0.06
    round_trip_s: float = 0.15
    period_s: float = 0.002
    ramp_down_s: float = 0.1
    heartbeat_s: float = 0.05
    heartbeat_timeout_s: float = 0.5
    held_rad: float = 0.02
    settle_s: float = 0.5           # until an arm that holds has come to rest
    stop_s: float = 2.0             # from a stop's command, heard at a side's host, to that side's stop
    second_writer_s: float = 0.4    # a partner that is heard more often than this is not given up for another
    recovery_s: float = 60.0
    memory_MiB: float = 48.0        # that a process may grow by once it has run for settled_s …
    more_memory_MiB: dict = field(default_factory=dict)     # … and those that may grow by more
    settled_s: float = 45.0


class Gaps:
    """When a source that should come all the time did not: intervals longer than `usual_s`, of the last half minute."""
    KEPT_S = 30.0

    def __init__(self, usual_s):
        self.usual_s, self.last, self.gaps = usual_s, None, deque()

    def note(self, t):
        if self.last is not None and t - self.last > self.usual_s:
            self.gaps.append((self.last, t))
        self.last = t if self.last is None else max(self.last, t)
        while self.gaps and self.gaps[0][1] < t - self.KEPT_S:
            self.gaps.popleft()

    def within(self, begin, end):
        """How much of [begin, end] lies in gaps; one that still lasts at its end counts too."""
        missing = 0.0
        for a, b in reversed(self.gaps):
            if b <= begin:
                break
            missing += max(0.0, min(b, end) - max(a, begin))
        if self.last is None:
            return end - begin
        if end - self.last > self.usual_s:
            missing += end - max(self.last, begin)
        return missing


@dataclass
class Ledger:
    """The stop of a side that is in force: from its first word of it until a reset that names it."""
    stop: int = 0
    since: float = None
    named: dict = field(default_factory=dict)   # stop → when a reset first named it
    ended: set = field(default_factory=set)     # stops that the side said were over


class Scene:
    TAP_GAP_S, SERVO_GAP_S, DRIVE_GAP_S = 0.05, 0.01, 0.03

    def __init__(self, limits):
        self.limits = limits
        self.newest = {}                                                  # side → its newest own state, heard at its own host
        self.own_gaps = {side: Gaps(self.SERVO_GAP_S) for side in SIDES}  # of a side's own stamps
        self.tap_gaps = {side: Gaps(self.TAP_GAP_S) for side in SIDES}    # of arrivals of anything at a side's host
        self.heard = {side: {} for side in SIDES}       # side → session of a partner → when it was last heard, in time, at this host
        self.stamps = {side: {} for side in SIDES}      # the same, and the stamp of what was heard
        self.drag_heard, self.drag_stamp = None, 0.0    # when the master's host last heard a valid drag_field, in time
        self.drive_gaps = {}
        self.ledgers = {side: Ledger() for side in SIDES}
        self.law, self.law_since = None, 0.0
        self.intruders, self.other_arms, self.last_fact = set(), set(), None
        self.cut, self.held_up = {}, {}                 # host → since; process → since: killed or frozen

    def note_drive(self, row):
        key = (row.side, row.joint, row.instance)
        gaps = self.drive_gaps.get(key)
        if gaps is None:
            gaps = self.drive_gaps[key] = Gaps(self.DRIVE_GAP_S)
        gaps.note(row.t)
        return gaps

    def note_sample(self, s):
        """Returns the side whose own new word this is, at its own host; None for all else."""
        self.tap_gaps[s.tap].note(s.t)
        content = s.content
        if s.topic == "operator_command":
            if content.kind == RESET:
                self.name_in_reset(content.master_stop, content.slave_stop, s.t)
            return None
        stamped = content.stamp.monotonic_ns * 1e-9
        if s.topic == "drag_field":
            if content.valid and s.t - stamped <= self.limits.round_trip_s:
                self.drag_heard, self.drag_stamp = s.t, stamped
            return None
        if s.process in self.intruders:
            return None
        side = s.topic.removesuffix("_state")
        if side != s.tap:
            if s.t - stamped <= self.limits.round_trip_s:
                self.heard[s.tap][content.stamp.session] = s.t
                self.stamps[s.tap][content.stamp.session] = stamped
            return None
        before = self.newest.get(side)
        if before and before.content.stamp.session == content.stamp.session and before.content.stamp.number >= content.stamp.number:
            return None
        self.newest[side] = s
        self.own_gaps[side].note(stamped)
        if side == "master" and content.law != self.law:
            self.law, self.law_since = content.law, stamped
        return side

    def name_in_reset(self, master_stop, slave_stop, t):
        for side, stop in (("master", master_stop), ("slave", slave_stop)):
            if stop:
                self.ledgers[side].named.setdefault(stop, t)

    def note_fact(self, fact):
        what = fact["fact"]
        if what not in ("memory", "step_end", "look", "recovered", "load_average"):
            self.last_fact = fact
        if what == "started" and fact.get("intruder"):
            self.intruders.add(fact["pid"])
        if what == "started" and fact.get("other_arm"):
            self.other_arms.add(fact["pid"])
        if what in ("killed", "frozen", "ended", "died"):
            self.held_up[fact["process"]] = fact["t"]
        if what in ("started", "thawed"):
            self.held_up.pop(fact["process"], None)
        if what == "cut":
            self.cut[fact["host"]] = fact["t"]
        if what == "healed":
            self.cut.pop(fact["host"], None)
        if what == "reset":
            self.name_in_reset(fact["master_stop"], fact["slave_stop"], fact["t"])

    def partner_heard(self, side):
        """When this side's host last heard, in time, the process that the side goes by; None: never."""
        own = self.newest.get(side)
        return self.heard[side].get(own.content.partner_echo.session) if own else None

    def tap_missed(self, side, heard, t):
        """Whether the tap at this side's host cannot know that nothing was heard in [heard, t]: it did not run, or the side answers to a sample
        that is newer than what the tap heard (after a loss each participant discovers the others at its own pace)."""
        if self.tap_gaps[side].within(heard, t) > 0.0:
            return True
        echo = self.newest[side].content.partner_echo
        return echo.monotonic_ns * 1e-9 > self.stamps[side].get(echo.session, 0.0) + self.TAP_GAP_S

    def stopped_since(self, side):
        """Since when a side has been in a stop that no reset has named: from then on it may move as soon as it has the reset."""
        ledger = self.ledgers[side]
        return ledger.since if ledger.stop and ledger.stop not in ledger.named else None
