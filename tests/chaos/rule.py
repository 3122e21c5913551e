"""What every invariant has: what it promises, how often it was held against something, how close it came, and what broke it. Pure."""
from collections import namedtuple

Violation = namedtuple("Violation", "rule t what")
SLACK_S = 0.05          # between what a tap hears and a component beside it, on a busy machine


class Rule:
    """One promise. `checks`: how often it was held against something; `worst`: the greatest value at which it still held, beside `bound`."""
    name, promise, unit, bound = "", "", "", None

    def __init__(self, scene):
        self.scene, self.limits = scene, scene.limits
        self.checks = self.unobservable = 0
        self.worst = self.worst_t = None
        self.violations, self.told = [], set()

    def drive(self, row, gaps):
        """A row of a simulated drive; the gaps between its rows."""

    def own(self, side, sample):
        """A side's own new word, heard at its own host."""

    def other(self, sample):
        """Everything else that came over the wire."""

    def fact(self, fact):
        """Something was done to the system, or seen of its processes."""

    def end(self, t):
        """Nothing comes any more."""

    def measured(self, value, t):
        if self.worst is None or value > self.worst:
            self.worst, self.worst_t = value, t

    def violated(self, t, what, once=None):
        """`once`: of what has the same key only the first is kept."""
        if once is None or once not in self.told:
            self.told.add(once)
            self.violations.append(Violation(self.name, t, what))

    def joint(self, row):
        return f"{row.side}'s drive of {self.limits.joints[row.joint]}"
