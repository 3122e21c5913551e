#!/usr/bin/env python3
"""Holds the invariants over what was seen of a run: what came over the wire at either host, and what the simulated drives did.

observer.py FOLDER [--follow] [--keep N]

FOLDER is a run's (chaos.py makes it). --follow: while it still grows, until a fact "end" comes; verdicts.json is written every few seconds. --keep:
recordings that were read to their end are removed but for the last N of either host. Shares no code with the components: README.md here says
what it goes by. Exit code: 0 all held, 1 a violation (told at once, with what was done before), 2 wrong call, 3 unreadable.
"""
import argparse
import json
import sys
import time
from pathlib import Path

from invariants import RULES, Memory, Recovery
from recordings import Broken, DriveRecord, DriveRow, Facts, McapFolder
from rule import Rule
from scene import SIDES, Limits, Scene

LATE_S = 4.0   # what comes later than this is seen out of order


class Observer:
    """Everything that was seen, in order of time, past every rule."""

    def __init__(self, limits, on_violation=lambda violation, before: None):
        self.scene = Scene(limits)
        self.rules = [rule(self.scene) for rule in RULES]
        self.on_violation = on_violation
        self.records, self.late, self.now, self.told = 0, 0, None, 0
        self.by_kind = {kind: [r for r in self.rules if getattr(type(r), kind) is not getattr(Rule, kind)]
                        for kind in ("drive", "own", "other", "fact")}
        self.first = None
        self.timeline, self.shown = [], {}  # changes of a side's state

    def take(self, record):
        is_fact = isinstance(record, dict)
        t = record["t"] if is_fact else record.t
        if self.first is None:
            self.first = t
        if self.now is not None and t < self.now:
            self.late += 1
        self.now = t if self.now is None else max(self.now, t)
        self.records += 1
        if is_fact:
            self.scene.note_fact(record)
            self._pass("fact", record)
        elif isinstance(record, DriveRow):
            gaps = self.scene.note_drive(record)
            self._pass("drive", record, gaps)
        else:
            side = self.scene.note_sample(record)
            if side is not None:
                if self.shown.get(side) != record.content.state:
                    self.shown[side] = record.content.state
                    self.timeline.append((t, side, record.content.state))
                self._pass("own", side, record)
            else:
                self._pass("other", record)
        found = sum(len(r.violations) for r in self.rules)
        if found > self.told:
            self._tell()

    def _pass(self, kind, *what):
        for rule in self.by_kind[kind]:
            getattr(rule, kind)(*what)

    def _tell(self):
        for rule in self.rules:
            for violation in rule.violations[getattr(rule, "passed_on", 0):]:
                self.on_violation(violation, self.scene.last_fact)
            rule.passed_on = len(rule.violations)
        self.told = sum(len(r.violations) for r in self.rules)

    def end(self):
        for rule in self.rules:
            rule.end(self.now)
        self._tell()

    def verdicts(self):
        begin = self.first or 0.0
        rules = [{"name": r.name, "promise": r.promise, "checks": r.checks, "unobservable": r.unobservable, "worst": r.worst, "bound": r.bound,
                  "worst_at_s": r.worst_t and r.worst_t - begin, "unit": r.unit,
                  "violations": [{"t_s": v.t - begin, "what": v.what} for v in r.violations]} for r in self.rules]
        recovery = next(r for r in self.rules if isinstance(r, Recovery))
        memory = next(r for r in self.rules if isinstance(r, Memory))
        return {"seen": {"records": self.records, "out_of_order": self.late, "seconds": (self.now or begin) - begin}, "rules": rules,
                "timeline": [{"t_s": t - begin, "side": side, "state": state} for t, side, state in self.timeline], "recoveries": [{"kind": kind, "s": s} for kind, s in recovery.times], "growth_MiB": memory.growth,
                "held": not any(r["violations"] for r in rules)}


class Sources:
    """All files of a run, read as they grow, merged by time."""

    def __init__(self, folder, about, keep):
        self.folder, self.drives = Path(folder), about["drives"]
        self.facts = Facts(self.folder / "facts.jsonl")
        self.taps = [McapFolder(self.folder / "taps" / side, side, keep) for side in SIDES]
        self.records, self.waiting, self.ended, self.complete_s = {}, [], False, 0.0

    def read(self):
        """What came since. Afterwards all that happened until `complete_s` is there, however long the reading took: on a loaded machine the last
        source is read many seconds after the first, and must not be held against facts that were not read yet."""
        self.complete_s = time.monotonic() - LATE_S
        for path in sorted((self.folder / "drives").glob("*.csv")):
            if path not in self.records:
                name, instance = path.stem.rsplit(".", 1)
                joints = {int(node): tuple(joint) for node, joint in self.drives[name].items()}
                self.records[path] = DriveRecord(path, name.split("_")[0], joints, int(instance))
        for source in (self.facts, *self.taps, *self.records.values()):
            for record in source.read():
                is_fact = isinstance(record, dict)
                self.ended = self.ended or (is_fact and record["fact"] == "end")
                self.waiting.append((record["t"] if is_fact else record.t, record))

    def until(self, t):
        self.waiting.sort(key=lambda entry: entry[0])
        ready = [entry for entry in self.waiting if entry[0] <= t]
        self.waiting = self.waiting[len(ready):]
        return [record for _, record in ready]


def explain(violation, before, start_s):
    """A violation in words: when, what, and what was done last before it."""
    done = "nothing was done before" if before is None else "last before it, {:.3f} s earlier: {}".format(
        violation.t - before["t"], " ".join(f"{k}={v}" for k, v in before.items() if k != "t"))
    return f"VIOLATION of \"{violation.rule}\" at {violation.t - start_s:.3f} s: {violation.what}\n  {done}"


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--follow", action="store_true")
    arguments.add_argument("--keep", type=int)
    given = arguments.parse_args()
    about = json.loads((given.folder / "limits.json").read_text())
    sources = Sources(given.folder, about, given.keep)
    start = about["start_s"]
    observer = Observer(Limits(**about["limits"]), lambda violation, before: print(explain(violation, before, start), flush=True))
    verdicts = given.folder / "verdicts.json"
    ended, written = False, 0.0
    try:
        while True:
            sources.read()
            if not given.follow or sources.ended:
                ended = True
                if given.follow:
                    time.sleep(2.0)
                    sources.read()
            for record in sources.until(float("inf") if ended else sources.complete_s):
                observer.take(record)
            if ended:
                break
            if time.monotonic() - written > 5.0:
                written = time.monotonic()
                write(verdicts, observer.verdicts())
            time.sleep(0.5)
    except Broken as problem:
        print(f"observer: {problem}", file=sys.stderr)
        return 3
    observer.end()
    result = observer.verdicts()
    write(verdicts, result)
    return 0 if result["held"] else 1


def write(path, verdicts):
    new = path.with_suffix(".new")
    new.write_text(json.dumps(verdicts, indent=1))
    new.rename(path)


if __name__ == "__main__":
    sys.exit(main())
