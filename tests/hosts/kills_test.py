#!/usr/bin/env python3
"""Processes that are killed or stand still, at any moment, are heard again by all others, and hear them: nobody else is restarted. Nothing is left in
shared memory.

kills_test.py --talker FILE [--discovery multicast|peers] [--kills N] [--freezes N] [--work-us N] [--seed N] [--keep FOLDER]
"""
import argparse
import json
import random
import shutil
import signal
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

from hosts import Host, need_rights

SOURCE = Path(__file__).resolve().parents[2]
NAMES = ("wva_server", "slave_io", "phantom_sensing", "master_io", "audio_percept", "synthetic_viewer")
LEASE_S = 5.0
# Samples of everybody that everybody must hear after an event, on each topic.
NEWS = {"master_state": 20, "operator_command": 3, "component_status": 1}


class Talker:
    def __init__(self, host, words, log):
        self.process = subprocess.Popen(host.inside(words), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=open(log, "a"), text=True)
        host.processes.append(self.process)
        self.session, self.longest_write_ms, self.stood_still = None, 0.0, False

    def wait_until_up(self):
        self.session = self.process.stdout.readline().strip()
        assert self.session, "a talker did not start"

    def ask(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def answer(self):
        told = json.loads(self.process.stdout.readline())
        self.longest_write_ms = told["longest_write_ms"]
        return told["heard"]

    def kill(self, host):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()
        host.processes.remove(self.process)


class Cell:
    def __init__(self, folder, talker, discovery, work_us, limit_s):
        self.folder, self.talker, self.work_us, self.limit_s = folder, talker, work_us, limit_s
        self.topology = folder / "topology.yaml"
        peers = "  initial_peers: [127.0.0.1]\n" if discovery == "peers" else ""
        self.topology.write_text(
            f"name: kills\ndomain: 42\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\ncell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\n"
            f"network:\n  interfaces: [127.0.0.1]\n{peers}hosts:\n  - {{name: here}}\n")
        self.host = Host("cell")
        self.host.run("ip", "route", "add", "224.0.0.0/4", "dev", "lo")
        self.talkers = {name: self.start(name) for name in NAMES}
        for talker in self.talkers.values():
            talker.wait_until_up()

    def start(self, name):
        words = [self.talker, "--deployment", self.topology, "--host", "here", "--as", name, "--work-us", self.work_us]
        return Talker(self.host, words, self.folder / f"{name}.log")

    def heard(self):
        """Who hears how much of whom: {hearer: {topic: {session: samples}}}."""
        for talker in self.talkers.values():
            talker.ask()
        return {name: talker.answer() for name, talker in self.talkers.items()}

    def missing(self, before, now):
        """Pairs, by topic, of which less than the news has come."""
        sessions = {name: talker.session for name, talker in self.talkers.items()}
        return [(topic, speaker, hearer) for hearer in NAMES for speaker in NAMES for topic, news in NEWS.items() if speaker != hearer and
                now[hearer].get(topic, {}).get(sessions[speaker], 0) - before[hearer].get(topic, {}).get(sessions[speaker], 0) < news]

    def recover(self, what):
        """Waits until everybody has news of everybody; returns the seconds that takes."""
        begun = time.monotonic()
        before = self.heard()
        while missing := self.missing(before, self.heard()):
            if time.monotonic() - begun > self.limit_s:
                raise AssertionError(f"{what}: after {self.limit_s:.0f} s, not heard (topic, who, by whom): {missing}")
            time.sleep(0.02)
        return time.monotonic() - begun

    def kill(self, name, chance):
        """Kills it, half of the times again and again while it starts, and starts it again at once or after a while."""
        self.talkers[name].kill(self.host)
        for _ in range(chance.choice((0, 0, 1, 3))):
            half_started = self.start(name)
            time.sleep(chance.uniform(0.0, 0.3))
            half_started.kill(self.host)
        time.sleep(chance.choice((0.0, 0.0, 0.2, 1.5)))
        self.talkers[name] = self.start(name)
        self.talkers[name].wait_until_up()

    def freeze(self, name, chance):
        """Stops it for longer than its lease, or for a moment, and lets it go on."""
        process = self.talkers[name].process
        self.talkers[name].stood_still = True  # perhaps while it wrote
        process.send_signal(signal.SIGSTOP)
        try:
            time.sleep(chance.choice((0.5, LEASE_S + 2.0)))
        finally:
            process.send_signal(signal.SIGCONT)

    def shared_memory_files(self):
        """Of this host, which runs nothing else."""
        return self.host.run("ls", "-A", "/dev/shm").split()

    def close(self):
        self.host.close()


def figures(what, took_s):
    if not took_s:
        return f"{what}: none"
    return f"{what}: {len(took_s)} recovered, median {statistics.median(took_s):.2f} s, slowest {max(took_s):.2f} s"


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--talker", required=True)
    arguments.add_argument("--discovery", choices=("multicast", "peers"), default="multicast")
    arguments.add_argument("--kills", type=int, default=20)
    arguments.add_argument("--freezes", type=int, default=6)
    arguments.add_argument("--work-us", type=int, default=0, help="that each sample keeps a reader busy: the more, the more often one is killed at it")
    arguments.add_argument("--limit-s", type=float, default=60, help="after which a process counts as lost")
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--keep", help="folder for logs that stay")
    arguments.add_argument("--go-on", action="store_true", help="count what does not recover, restart all, and go on")
    given = arguments.parse_args()
    need_rights()
    folder = Path(given.keep or tempfile.mkdtemp(prefix="phantom_kills_")).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    chance = random.Random(given.seed)
    cell = Cell(folder, Path(given.talker).resolve(), given.discovery, given.work_us, given.limit_s)
    killed, frozen, lost, longest_write_ms = [], [], [], 0.0
    try:
        print(f"all hear each other after {cell.recover('at the start'):.2f} s", flush=True)
        events = ["kill"] * given.kills + ["freeze"] * given.freezes
        chance.shuffle(events)
        for number, event in enumerate(events):
            name = chance.choice(NAMES)
            try:
                if event == "kill":
                    cell.kill(name, chance)
                    killed.append(cell.recover(f"event {number}, {name} killed"))
                else:
                    cell.freeze(name, chance)
                    frozen.append(cell.recover(f"event {number}, {name} stood still"))
            except AssertionError as problem:
                if not given.go_on:
                    raise
                print(problem, flush=True)
                lost.append(number)
                for victim in NAMES:
                    cell.talkers[victim].kill(cell.host)
                for victim in NAMES:
                    cell.talkers[victim] = cell.start(victim)
                    cell.talkers[victim].wait_until_up()
                cell.recover("after all were started anew")
            longest_write_ms = max(longest_write_ms, 0.0, *(talker.longest_write_ms for talker in cell.talkers.values() if not talker.stood_still))
            left = cell.shared_memory_files()
            assert not left, f"event {number}, {event} of {name}: in /dev/shm, though samples go by UDP alone: {left}"
            if number % 50 == 49:
                print(f"{number + 1} events", flush=True)
        print(figures("kills", killed))
        print(figures("freezes", frozen))
        print(f"not recovered: {len(lost)}; longest write of who never stood still: {longest_write_ms:.1f} ms; "
              "nothing in /dev/shm after any event")
        assert not lost
    finally:
        cell.close()
        if not given.keep:
            shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
