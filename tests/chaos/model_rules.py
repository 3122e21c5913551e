"""What must hold while something answers in form and is wrong: a drive that reports a false motion, a host with another arm. Pure."""
from rule import SLACK_S, Rule
from scene import COUPLED


class LyingDrive(Rule):
    """By the drives' records, which have the true motion: how far a joint of the arm goes from where its master's joint is, since its drive lies.
    A lie that is found stops the arm; one that is not must do no harm."""
    name = "a lying drive leads no joint astray"
    promise = "While a drive of the arm reports a false motion and the sides are coupled, its joint stays by the master's."
    unit, bound = "rad", 0.25

    def __init__(self, scene):
        super().__init__(scene)
        self.master, self.apart = {}, {}  # by joint: the master's position; how far apart the two were when the lie began

    def drive(self, row, gaps):
        if row.side == "master":
            self.master[row.joint] = row.position
            return
        own = self.scene.newest.get("slave")
        coupled = own is not None and own.content.state == COUPLED and row.t - own.t < SLACK_S
        if not row.lies or not coupled or row.joint not in self.master:
            self.apart.pop((row.joint, row.instance), None)
            return
        apart = row.position - self.master[row.joint]
        if (row.joint, row.instance) not in self.apart:
            self.checks += 1
        strayed = abs(apart - self.apart.setdefault((row.joint, row.instance), apart))
        if strayed > self.bound:
            self.violated(row.t, f"{self.joint(row)} is {strayed:.2f} rad farther from the master's than when its drive began to lie, and coupled",
                          (row.joint, row.instance))
        else:
            self.measured(strayed, row.t)


class OtherArmRefused(Rule):
    name = "another arm is refused"
    promise = "Sides whose models of the arm differ do not couple."
    unit = ""

    def __init__(self, scene):
        super().__init__(scene)
        self.sessions = set()

    def own(self, side, sample):
        state, others = sample.content, self.scene.other_arms
        if side == "slave" and sample.process in others:
            if state.stamp.session not in self.sessions:
                self.sessions.add(state.stamp.session)
                self.checks += 1
            partner = state.stamp.session
        else:
            partner = state.partner_echo.session
        if partner in self.sessions and state.state == COUPLED:
            self.violated(sample.t, f"{side}_io is coupled, though the slave's host has another arm", (side, partner))
