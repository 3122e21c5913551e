#!/usr/bin/env python3
"""The whole system under faults of every kind, for as long as asked, and an observer that holds its promises.

chaos --minutes N [--seed S] [--mode plain|secured] [--report DIR]

A seed repeats the schedule: the same steps, each with the same actions at the same times within it; between two steps the system recovers by
itself, which takes as long as it takes. What is printed is also kept, with the recordings' end, the logs, verdicts and plots, in DIR.
What was recorded in a run of up to 5 minutes is also held against the model of the link (scripts/checks/link_trace).
Exit code: 0 all held, 1 a violation, 2 wrong arguments, 3 something needed is missing, 77 without the rights of root.
"""
import argparse
import itertools
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import link_trace
import report
import schedule
from system import PROCESSES_IN_ORDER, SOURCE, System, limits

sys.path.insert(0, str(SOURCE / "tests/hosts"))
from hosts import need, need_rights  # noqa: E402

START_S, RECOVERY_S, STAYS_S, RESTART_S = 150.0, 60.0, 0.7, 5.0
COUPLED, STOPPED = 3, 5
MODELLED_MINUTES = 5.0  # 200 MB a minute are kept until the end
GOOD_LINK = {"loss": 0.0, "delay_ms": 0.0, "jitter_ms": 0.0, "repeated": 0.0}


class Commander:
    """The operator: sees both sides and commands them; knows the stops that he saw."""

    def __init__(self, system):
        self.system, self.process = system, system.start_commander()
        self.stops = {"master": [], "slave": []}
        self.looked = None

    def tell(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        answer = json.loads(self.process.stdout.readline())
        for side, seen in self.stops.items():
            stop = answer[side]["stop"]
            if stop and stop not in seen:
                seen.append(stop)
        return answer

    def look(self):
        return self.tell("look")

    def stop(self):
        self.system.facts.note("stop_command")
        self.tell("stop")

    def reset(self, names):
        now = self.look()
        current = {side: now[side]["stop"] for side in self.stops}
        old = {side: (seen[-2] if len(seen) > 1 else 0) for side, seen in self.stops.items()}
        looked = {side: (self.looked or now)[side]["stop"] for side in self.stops}
        named = {"now": current, "old": old, "looked": looked, "nothing": {"master": 0, "slave": 0},
                 "other_side": {"master": current["slave"], "slave": current["master"]}}[names]
        self.system.facts.note("reset", names=names, master_stop=named["master"], slave_stop=named["slave"])
        self.tell(f"reset {named['master']} {named['slave']}")

    def close(self):
        self.process.stdin.close()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()


class Run:
    def __init__(self, system, commander):
        self.system, self.commander = system, commander
        self.over = threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()

    def _watch(self):
        """Deaths that nobody asked for, and memory."""
        measured, due = 0.0, {}
        while not self.over.wait(0.2):
            for name, code, words in self.system.deaths():
                print(f"  {name} ended by itself with {code}: {words}", flush=True)
                due[name] = time.monotonic() + RESTART_S
            for name in [n for n, at in due.items() if at < time.monotonic()]:
                del due[name]
                self.system.start(name)
            if time.monotonic() - measured > 2.0:
                measured = time.monotonic()
                self.system.memory()

    def do(self, action):
        system, do = self.system, action["do"]
        what = {k: v for k, v in action.items() if k not in ("at_s", "do")}
        if do in ("kill", "start", "freeze", "thaw", "block_log", "free_log"):
            getattr(system, do)(what["process"])
        elif do in ("freeze_thread", "thaw_thread"):
            getattr(system, do)(what["process"], what["thread"])
        elif do == "stop" and what["how"] == "command":
            self.commander.stop()
        elif do == "stop":
            system.signal_stop(what["how"].removeprefix("signal_"))
        elif do == "reset":
            self.commander.reset(what["names"])
        elif do == "look":
            self.commander.looked = self.commander.look()
        elif do == "set":
            system.facts.note("set", **what)
            self.commander.tell(f"{what['name']} {what['value']}")
        elif do == "end_load":
            system.end_load()
        else:  # link, cut, heal, clock, fill_disk, spoil_files, start_intruder, start_lying, start_other_arm, lose_fragments, what ends them, start_load
            getattr(system, do)(**what)

    def step(self, step):
        time.sleep(step["pause_s"])
        self.system.facts.note("step", step=step["number"], kind=step["kind"])
        begun = time.monotonic()
        for action in step["actions"]:
            time.sleep(max(0.0, begun + action["at_s"] - time.monotonic()))
            self.do(action)
        self.system.facts.note("step_end", step=step["number"], kind=step["kind"])

    def recover(self, limit_s=RECOVERY_S):
        """Waits until both sides are coupled, and stay so; whoever is stopped is reset, as an operator does. Returns the seconds, None if it took
        too long."""
        begun, reset_at, coupled_at = time.monotonic(), 0.0, None
        while time.monotonic() - begun < limit_s:
            now = self.commander.look()
            fresh = all(0.0 <= now[side]["age_s"] < 0.5 for side in ("master", "slave"))
            if not fresh or any(now[side]["state"] != COUPLED for side in ("master", "slave")):
                coupled_at = None
            elif coupled_at is None:
                coupled_at = time.monotonic()
            elif time.monotonic() - coupled_at > STAYS_S:
                return coupled_at - begun
            if fresh and any(now[side]["state"] == STOPPED for side in ("master", "slave")) and time.monotonic() - reset_at > 1.0:
                reset_at = time.monotonic()
                self.commander.reset("now")
            time.sleep(0.1)
        return None

    def restart_all(self):
        for name in reversed(PROCESSES_IN_ORDER):
            self.system.kill(name)
        for name in PROCESSES_IN_ORDER:
            self.system.start(name)


def words_of(step):
    parts = []
    for action in step["actions"]:
        what = " ".join(str(v) for k, v in action.items() if k not in ("at_s", "do"))
        parts.append(f"{action['at_s']:.2f} {action['do']} {what}".strip())
    return f"{step['kind']}: " + "; ".join(parts)


def given_arguments():
    arguments = argparse.ArgumentParser(prog="chaos", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--minutes", type=float, required=True, help="how long steps are begun; the start takes half a minute more")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--mode", choices=("plain", "secured"), default="plain", help="secured: with DDS Security, as across the shield wall")
    arguments.add_argument("--only", default="", metavar="KIND,…", help="only these kinds of steps: " + ", ".join(schedule.KINDS))
    arguments.add_argument("--schedule", type=Path, metavar="FILE", help="the steps of this file (schedule.json of a report) instead of a seed's")
    arguments.add_argument("--print-schedule", action="store_true", help="print the steps that would be made, and end")
    arguments.add_argument("--report", type=Path, help="folder; default: build/chaos-report")
    arguments.add_argument("--keep-recordings", action="store_true", help="keep all that was recorded in the report (200 MB a minute), for link_trace.py")
    arguments.add_argument("--until-violation", action="store_true", help="end with the first violation")
    arguments.add_argument("--bin", type=Path, default=SOURCE / "build/release/bin")
    arguments.add_argument("--helpers", type=Path, default=SOURCE / "build/release/tests", help="where cable, commander, freeze_thread and clock_step.so are")
    given = arguments.parse_args()
    if not 0.05 <= given.minutes <= 100_000:
        arguments.error(f"--minutes {given.minutes}: allowed: 0.05 to 100000")
    given.only = tuple(filter(None, given.only.split(",")))
    try:
        next(schedule.steps(given.seed, given.only))
        given.steps = itertools.cycle(json.loads(given.schedule.read_text())["steps"]) if given.schedule else schedule.steps(given.seed, given.only)
    except (ValueError, KeyError, OSError) as problem:
        arguments.error(str(problem))
    return given


def main():
    given = given_arguments()
    if given.print_schedule:
        for step in itertools.islice(given.steps, max(1, round(given.minutes * 7))):
            print(f"{step['number']:4} {words_of(step)}")
        return 0
    need_rights()
    need("openssl" if given.mode == "secured" else "ip")
    for needed in (given.bin / "master_io", given.helpers / "commander", given.helpers / "cable", given.helpers / "freeze_thread", given.helpers / "clock_step.so"):
        if not needed.exists():
            print(f"chaos: {needed} is missing; build first: cmake --preset release && cmake --build --preset release", file=sys.stderr)
            return 3
    folder = Path(tempfile.mkdtemp(prefix="phantom_chaos_")).resolve()
    kept = given.report or SOURCE / "build/chaos-report"
    try:
        return chaos(given, folder, kept)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def model_refuses(folder, say):
    """Whether a tap's recording is no behaviour of the model of the link."""
    traces = link_trace.write(folder, folder)
    done = subprocess.run([sys.executable, SOURCE / "scripts/checks/link_trace", *traces], capture_output=True, text=True, check=False)
    say(("the model of the link accepts the run: " if done.returncode == 0 else "VIOLATION: the model of the link refuses the run:\n") + (done.stdout + done.stderr).strip())
    return done.returncode != 0


def chaos(given, folder, kept):
    modelled = given.keep_recordings or given.minutes <= MODELLED_MINUTES
    about = {**limits(), "start_s": time.monotonic()}
    (folder / "limits.json").write_text(json.dumps(about, indent=1))
    system = System(folder, given.bin.resolve(), given.helpers.resolve(), given.mode == "secured")
    start_s, made, run, observer, commander = about["start_s"], [], None, None, None

    def say(text):
        print(f"{time.monotonic() - start_s:8.2f} s  {text}", flush=True)
    load_begun = os.getloadavg()[0]
    try:
        say(f"{given.mode}, seed {given.seed}: the system starts; load {load_begun:.1f}")
        observer = subprocess.Popen([sys.executable, str(Path(__file__).parent / "observer.py"), str(folder), "--follow", *([] if modelled else ["--keep", "4"])],
                                    stdout=open(folder / "observer.log", "w"), stderr=subprocess.STDOUT)
        system.start_taps()
        commander = Commander(system)
        run = Run(system, commander)
        for name in PROCESSES_IN_ORDER:
            system.start(name)
        took = run.recover(START_S)
        if took is None:
            raise RuntimeError(f"the system did not couple within {START_S:.0f} s: {commander.look()}")
        system.hasten_taps()
        time.sleep(3.0)
        system.facts.note("begin")
        say(f"coupled after {took:.1f} s; chaos begins")
        end = time.monotonic() + given.minutes * 60.0
        for step in given.steps:
            if time.monotonic() > end or (given.until_violation and "VIOLATION" in (folder / "observer.log").read_text()):
                break
            if observer.poll() is not None:
                raise RuntimeError("the observer ended: " + (folder / "observer.log").read_text()[-1000:])
            made.append(step)
            say(f"{step['number']:4} {words_of(step)}")
            run.step(step)
            took = run.recover()
            if took is None:
                state = commander.look()
                system.facts.note("gave_up", step=step["number"], kind=step["kind"], words=json.dumps(state))
                say(f"     not recovered: {state}; all are started anew")
                run.restart_all()
                if run.recover(START_S) is None:
                    say("     not even then: the run ends")
                    break
            else:
                system.facts.note("recovered", step=step["number"])
                say(f"     coupled again after {took:.2f} s")
        time.sleep(2.0)
    finally:
        if run:
            run.over.set()
            time.sleep(0.3)
        system.facts.note("end")
        if commander:
            commander.close()
        code = observer.wait(300) if observer else 3
        system.close()
    seconds = time.monotonic() - start_s
    about = {"mode": given.mode, "seed": given.seed, "minutes": given.minutes, "seconds": seconds, "only": list(given.only), "steps": made,
             "load": [load_begun, os.getloadavg()[0]], "cores": os.cpu_count()}
    if modelled and code in (0, 1) and model_refuses(folder, say):
        code = 1
    report.write(folder, kept, about, given.keep_recordings)
    violations = (folder / "observer.log").read_text()
    print(report.table(kept))
    if code == 1:
        print(violations.split("\nVIOLATION")[0])
        only = f" --only {','.join(given.only)}" if given.only else ""
        print(f"again: scripts/chaos --minutes {given.minutes:g} --seed {given.seed} --mode {given.mode}{only}\n"
              f"       scripts/chaos --minutes {given.minutes:g} --mode {given.mode} --schedule {kept}/schedule.json")
    elif code != 0:
        print(violations)
    print(f"report: {kept}/index.html")
    return code


if __name__ == "__main__":
    sys.exit(main())
