#!/usr/bin/env python3
"""The haptic loop on its host while spies, recorders and viewers join, hang (SIGSTOP) and are killed, on its host and on another.

onlookers_test.py --bin DIR

Judged is what must hold on a loaded machine, too: the link stays coupled, the servo's samples go on being written and reach the
partner as in the quiet time of the same run. Figures of timing are told, not judged: tests/hosts/scale.py measures them.
"""
import re
import signal
import time

from haptic_site import START_S, HapticSite
from hosts import eventually, given_paths, need_rights, skip, telling_logs

WINDOW_S = 3
HANG_S = 7       # longer than the lease of a participant (5 s): by then it is forgotten, too
ATTEMPTS = 3     # what an onlooker does to the loop it does every time; what else runs on the machine does not
MOST_VOID = 8
COUPLE_S = 40
STREAMS = (("master_io", "master_state", "slave_io"), ("slave_io", "slave_state", "master_io"))


class Loop:
    """The running loop as its own component_status and logs tell it."""

    def __init__(self, site):
        self.site, self.session = site, site.start_loop("loop")
        self.watch = site.hosts["onlookers"].watch(
            site.words("dds_spy", "echo", "component_status", "--json", "--seconds", "0"), site.folder / "watch.log",
            lambda line: line["sample"]["component_name"])
        eventually(lambda: all(self.watch.get(c) for c in ("master_io", "slave_io")), START_S, "the loop's status")
        eventually(self.coupled, START_S, "master and slave coupled")

    def log(self, component):
        return (self.site.folder / f"loop/logs/{component}.log").read_text(errors="replace")

    def coupled(self):
        steps = re.findall(r"link (\w+) → (\w+)", self.log("master_io"))
        return bool(steps) and steps[-1][1] == "coupled"

    def trips(self):
        return sum(len(re.findall("link coupled → ", self.log(c))) for c in ("master_io", "slave_io"))

    def topic(self, component, topic, writer):
        topics = self.watch.get(component)["topics"]
        return next(t for t in topics if t["topic"] == topic and t["writer"] == writer)

    def readers(self):
        return self.topic("master_io", "master_state", True)["matched"]

    def take(self):
        """Counts so far, each with the time at which it was true."""
        now = {}
        for component in ("master_io", "slave_io"):
            status = self.watch.get(component)
            at_s = 1e-9 * status["stamp"]["monotonic_ns"]
            servo = next(loop for loop in status["loops"] if loop["name"] == "servo")
            now[component] = {"at_s": at_s, "ticks": servo["ticks"], "slips": servo["slips"],
                              "deadlines": sum(t["deadline_missed"] for t in status["topics"])}
            for writer, topic, reader in STREAMS:
                if component in (writer, reader):
                    now[component][topic] = self.topic(component, topic, component == writer)["samples"]
        return now

    def fresh(self):
        """The next status of both ends."""
        seen = {c: self.watch.counted(c) for c in ("master_io", "slave_io")}
        eventually(lambda: all(self.watch.counted(c) > n for c, n in seen.items()), START_S, "the loop's status goes on")
        return self.take()


class Window:
    """What the loop did from its making to close()."""

    def __init__(self, loop):
        self.loop, self.trips, self.first = loop, loop.trips(), loop.fresh()

    def close(self, least_s=WINDOW_S):
        end = time.monotonic() + least_s
        eventually(lambda: time.monotonic() > end, least_s + 60)
        last = self.loop.fresh()
        told = {"trips": self.loop.trips() - self.trips, "slips": 0.0, "written": 1.0, "arrived": 1.0, "deadlines": 0}
        rate = {}
        for component, now in last.items():
            before = self.first[component]
            span_s = now["at_s"] - before["at_s"]
            rate[component] = {k: (now[k] - before[k]) / span_s for k in now if k != "at_s"}
            done = rate[component]["ticks"] + rate[component]["slips"]
            told["slips"] = max(told["slips"], rate[component]["slips"] / max(1.0, done))
            told["deadlines"] += now["deadlines"] - before["deadlines"]
        for writer, topic, reader in STREAMS:
            told["written"] = min(told["written"], rate[writer][topic] / max(1.0, rate[writer]["ticks"]))
            told["arrived"] = min(told["arrived"], rate[reader][topic] / max(1.0, rate[writer][topic]))
        return told


def tell(what, window):
    print(f"  {what:<34} coupled {'all the time' if window['trips'] == 0 else 'NOT all the time'}; of ticks written "
          f"{window['written']:.3f}, of written arrived {window['arrived']:.3f}; slips {window['slips']:.4f}, "
          f"deadlines missed {window['deadlines']}", flush=True)


def undisturbed(window, quiet):
    """No worse than the same loop without onlookers, whatever this machine makes of that."""
    return window["trips"] == 0 and all(window[k] >= 0.9 * quiet[k] - 0.02 for k in ("written", "arrived"))


def stages(loop, kind, host):
    """Joining, hanging, coming back and being killed; each as (what, window)."""
    before = loop.readers()
    window = Window(loop)
    onlooker = loop.site.onlooker(kind, host)
    eventually(lambda: loop.readers() > before or onlooker.poll() is not None, START_S, f"the {kind} reads")
    assert onlooker.poll() is None, f"the {kind} ended: {onlooker.log.read_text()[-800:]}"
    yield "joins", window.close()
    window = Window(loop)
    onlooker.send_signal(signal.SIGSTOP)
    yield "hangs", window.close(HANG_S)
    window = Window(loop)
    onlooker.send_signal(signal.SIGCONT)
    eventually(lambda: loop.readers() > before, START_S, f"the {kind} reads again")
    yield "goes on", window.close()
    window = Window(loop)
    onlooker.kill()
    onlooker.wait()
    eventually(lambda: loop.readers() == before, START_S, f"the killed {kind} is forgotten")
    yield "is killed", window.close()


def coupled_within(loop, limit_s):
    try:
        return eventually(loop.coupled, limit_s)
    except AssertionError:
        return False


def try_onlooker(loop, kind, host):
    """Each attempt between two quiet windows: where the loop alone does not stay coupled, the machine is to blame, and it is void."""
    bad = void = 0
    while bad < ATTEMPTS and void < MOST_VOID:
        if not coupled_within(loop, COUPLE_S):
            void += 1
            continue
        quiet = Window(loop).close()
        if quiet["trips"] > 0:
            tell("nobody", quiet)
            void += 1
            continue
        good = True
        for what, window in stages(loop, kind, host):
            tell(f"a {kind} on host {host} {what}", window)
            good = good and undisturbed(window, quiet)
        if good:
            return
        after = Window(loop).close() if coupled_within(loop, COUPLE_S) else dict(quiet, trips=1)
        tell("nobody again", after)
        if after["trips"] > 0 or after["written"] < 0.9 * quiet["written"]:
            void += 1
        else:
            bad += 1
    if bad > void:
        raise AssertionError(f"a {kind} on host {host} disturbed the loop {bad} times; without it, it went on as ever")
    skip("this machine does not keep the loop coupled even without onlookers: too much else is running")


def main():
    given = given_paths("bin")
    need_rights()
    site = HapticSite(given.bin)
    try:
        with telling_logs(site.folder):
            loop = Loop(site)
            tell("nobody", Window(loop).close())
            for host in ("onlookers", "haptic"):
                for kind in ("spy", "recorder", "viewer"):
                    try_onlooker(loop, kind, host)
            tell("nobody again", Window(loop).close())
            assert loop.session.poll() is None, "the session ended"
    finally:
        site.close()


if __name__ == "__main__":
    main()
