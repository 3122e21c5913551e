#!/usr/bin/env python3
"""A stop that holds: the cable is out while somebody stops the master, processes are killed and started again; nothing moves
until a reset that names what is stopped; the model of the link judges what both sides said. Also in the shell: exit codes, and who has not confirmed.

stop_test.py --bin DIR --cable EXECUTABLE
"""
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from hosts import SIMULATED_ARMS, Site, eventually, given_paths, need_rights, telling_logs

SOURCE = Path(__file__).resolve().parents[2]
ADDRESSES = {"master": "10.61.1.2", "slave": "10.61.2.2"}
LIMIT_S = 150  # only bounds a failing test
OUTAGE_S = 8   # longer than the lease of 5 s
HELD_RAD = 0.02


class Motion:
    """What the slave's own host hears of it: every state, and how far each joint went while it was stopped."""

    def __init__(self, site, words, log):
        self.lock, self.states, self.moved, self.start, self.session = threading.Lock(), [], 0.0, None, None
        self.watch = site["slave"].watch(words, log, self.keep)

    def keep(self, line):
        sample = line.get("sample")
        if sample is None:
            return None
        with self.lock:
            if sample["stamp"]["session"] != self.session:  # another process: a simulated arm begins at home
                self.session, self.start = sample["stamp"]["session"], None
            if not self.states or self.states[-1] != sample["state"]:
                self.states.append(sample["state"])
            if sample["state"] != "LINK_STOPPED":
                self.start = None
                return "slave_state"
            position = sample["position_rad"][:sample["joint_count"]]
            self.start = self.start or position
            self.moved = max([self.moved] + [abs(a - b) for a, b in zip(position, self.start)])
        return "slave_state"

    def since(self):
        """The states since the last call, in order."""
        with self.lock:
            seen, self.states = self.states, self.states[-1:]
            return seen


class Record:
    """What the slave's host hears of both sides and of commands, as a recording, for the model of the link to judge."""

    TOPICS = ("master_state", "slave_state", "operator_command")

    def __init__(self, cell):
        self.recordings, self.path = cell.folder / "recordings", cell.folder / "trace.jsonl"
        self.convert = [cell.bin / "dds_recorder", "convert", self.recordings, "--out", self.path]
        words = cell.words("slave", "dds_recorder", "record", "--folder", self.recordings, "--topics", *self.TOPICS)
        self.process = cell.site["slave"].start(words, cell.folder / "record.log")
        eventually(lambda: list(self.recordings.glob("*.mcap")), LIMIT_S, "the recorder has begun a file")

    def judge(self):
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(30) == 0, "the recorder did not end in order"
        done = subprocess.run(self.convert, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        # The shell's command may have ended before the recorder knew of it: its reset is then not in the trace.
        self.path.write_text(json.dumps({"event": "commands", "complete": False}) + "\n" + self.path.read_text())
        done = subprocess.run([sys.executable, SOURCE / "scripts/checks/link_trace", self.path], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        print("the model accepts what was recorded:", done.stdout.strip())


class Cell:
    def __init__(self, binaries, cable):
        self.bin = Path(binaries).resolve()
        self.folder = Path(tempfile.mkdtemp(prefix="phantom_stop_"))
        self.site = Site(ADDRESSES, cable, cables=("slave",))
        self.topology = self.folder / "topology.yaml"
        peers = ", ".join(ADDRESSES.values())
        hosts = "".join(f"  - {{name: {name}, interfaces: [127.0.0.1, {address}], {SIMULATED_ARMS}}}\n" for name, address in ADDRESSES.items())
        self.topology.write_text(
            f"name: stop\ndomain: 61\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\n"
            f"cell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\nnetwork:\n  initial_peers: [127.0.0.1, {peers}]\nhosts:\n{hosts}")
        self.processes, self.count = {}, 0

    def words(self, host, program, *rest):
        return [self.bin / program, "--deployment", self.topology, "--host", host, *rest]

    def start(self, side):
        self.count += 1
        self.processes[side] = self.site[side].start(self.words(side, f"{side}_io"), self.folder / f"{side}_{self.count}.log")

    def kill(self, side):
        self.processes[side].send_signal(signal.SIGKILL)
        self.processes[side].wait()

    def command(self, host, *words, program="master_io"):
        done = self.site[host].try_run(*self.words(host, program, "command", *words))
        return done.returncode, done.stdout + done.stderr

    def status(self, host):
        return self.command(host, "status")[1]

    def reaches(self, host, *lines, limit_s=LIMIT_S):
        eventually(lambda: all(line in self.status(host) for line in lines), limit_s, f"{lines}, as seen on {host}")

    def close(self):
        self.site.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def both_coupled(cell):
    cell.reaches("master", "master_io: coupled", "slave_io: coupled")


def reset(cell):
    code, words = cell.command("master", "reset")
    assert code == 0, words
    both_coupled(cell)


def held(motion):
    """Whether the slave has been stopped all the time, and has not moved."""
    states = motion.since()
    assert set(states) == {"LINK_STOPPED"}, states
    assert motion.moved < HELD_RAD, f"a joint moved by {motion.moved:.3f} rad in a stop"


def shell_without_anybody(cell):
    code, words = cell.command("master", "stop", "--timeout-s", "1")
    assert code == 3 and "NOT CONFIRMED by master_io, slave_io" in words, (code, words)
    for bad in (("law", "q"), ("percept", "perhaps"), ("percept-gain", "-1"), ("percept-gain", "2", "--joint", "j9"), ()):
        code, words = cell.command("master", *bad)
        assert code == 2, (bad, code, words)
    print("shell: nobody there is code 3, what cannot be meant is code 2")


def stop_while_the_cable_is_out(cell, motion):
    cell.site.cables["slave"].cut()
    cell.reaches("slave", "slave_io: degraded", "master_io: not heard")
    time.sleep(OUTAGE_S)  # the outage that was found to lose a stop
    code, words = cell.command("master", "stop", "--timeout-s", "2")
    assert code == 1 and "NOT CONFIRMED by slave_io" in words and "stopped: master_io" in words, (code, words)
    cell.reaches("slave", "slave_io: degraded")
    motion.since()
    cell.site.cables["slave"].heal()
    cell.reaches("slave", "slave_io: stopped (the other side is stopped", "master_io: stopped (emergency stop")
    states = motion.since()
    assert states == ["LINK_DEGRADED", "LINK_STOPPED"], f"on the way to its stop the slave was {states}"
    time.sleep(1)
    held(motion)
    code, words = cell.command("slave", "reset", program="slave_io")
    assert code == 0, words
    both_coupled(cell)
    print(f"a stop while the cable was out for {OUTAGE_S} s is in force on both sides once it is back")


def stop_and_kill(cell, motion, sides):
    code, words = cell.command("master", "stop")
    assert code == 0 and "stopped: master_io, slave_io" in words, (code, words)
    eventually(lambda: motion.since()[-1:] == ["LINK_STOPPED"], LIMIT_S, "the spy hears of the stop")
    for side in sides:
        cell.kill(side)
    for side in sides:
        cell.start(side)
    cell.reaches("master", "master_io: stopped", "slave_io: stopped")
    time.sleep(2)
    held(motion)
    reset(cell)
    print(f"a stop outlives {' and '.join(sides)} killed with -9")


def a_signal_stops_both(cell):
    for side in ("slave", "master"):
        cell.site[side].run("pkill", "-USR1", "-x", f"{side}_io")
        cell.reaches("master", "master_io: stopped", "slave_io: stopped")
        reset(cell)
    print("a signal to either side stops both")


def settings_from_the_shell(cell):
    for words in (("law", "pf"), ("law", "sctfb"), ("percept", "off"), ("percept", "on"), ("percept-gain", "2"),
                  ("percept-gain", "1", "--joint", "j3_shoulder")):
        code, said = cell.command("master", *words)
        assert code == 0 and "master_io: " in said, (words, code, said)
    code, said = cell.command("master", "percept-gain", "1e9")
    assert code == 1 and "allowed" in said, (code, said)
    print("law, gains and percept from the shell are answered")


def main():
    given = given_paths("bin", "cable")
    need_rights()
    cell = Cell(given.bin, given.cable)
    try:
        with telling_logs(cell.folder, 25):
            shell_without_anybody(cell)
            for side in ADDRESSES:
                cell.start(side)
            both_coupled(cell)
            motion = Motion(cell.site, cell.words("slave", "dds_spy", "echo", "slave_state", "--json", "--every", "0", "--seconds", "0"),
                            cell.folder / "spy.log")
            eventually(motion.since, LIMIT_S, "the spy hears the slave")
            record = Record(cell)
            stop_while_the_cable_is_out(cell, motion)
            stop_and_kill(cell, motion, ["slave"])
            stop_and_kill(cell, motion, ["master"])
            stop_and_kill(cell, motion, ["master", "slave"])
            a_signal_stops_both(cell)
            record.judge()
            settings_from_the_shell(cell)
    finally:
        cell.close()


if __name__ == "__main__":
    main()
