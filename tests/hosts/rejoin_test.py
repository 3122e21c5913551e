#!/usr/bin/env python3
"""Secured participants on two hosts find each other again, whatever kept them apart, and whoever forgot whom.

rejoin_test.py --member FILE --cable FILE
"""
import argparse
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

from hosts import Site, eventually, need, need_rights, run
from rights import read_rights

SOURCE = Path(__file__).resolve().parents[2]
ADDRESSES = {"master": "10.60.1.2", "slave": "10.60.2.2"}
MEMBERS = {"slave": ("slave_io", "wva_server", "dds_spy"), "master": ("master_io", "phantom_sensing", "synthetic_viewer", "dds_recorder")}
LIMIT_S = 180  # limits only bound a failing test


def rights():
    """Name → (publishes, subscribes), with `*` as what it stands for."""
    all_rights = read_rights()
    topics = {topic for pair in all_rights.values() for ends in pair for topic in ends if topic != "*"}
    return {name: (writes, topics if "*" in reads else reads) for name, (writes, reads) in all_rights.items()}


class Member:
    def __init__(self, host, name, words, log):
        self.name = name
        self.process = subprocess.Popen(host.inside(words), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=open(log, "w"), text=True)
        host.processes.append(self.process)

    def wait_until_up(self):
        assert self.process.stdout.readline() == "up\n", f"{self.name} did not start"

    def matched(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())


class Members:
    def __init__(self, folder, member, cable):
        self.folder, self.rights = folder, rights()
        run(str(SOURCE / "deploy/security/make"), "site", str(folder / "security"))
        self.topology = folder / "topology.yaml"
        hosts = "".join(f"  - {{name: {name}, interfaces: [{address}]}}\n" for name, address in ADDRESSES.items())
        self.topology.write_text(
            f"name: rejoin\ndomain: 42\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\n"
            f"cell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\nnetwork:\n"
            f"  initial_peers: [{', '.join(ADDRESSES.values())}]\n  participants_per_host: 8\n  security: {folder}/security\nhosts:\n{hosts}")
        self.site = Site(ADDRESSES, cable, ["slave"])
        self.cable = self.site.cables["slave"]
        self.cable.set(loss=0.01, delay_ms=2, jitter_ms=1)
        self.members = {name: self.start(member, host, name) for host, names in MEMBERS.items() for name in names}
        for started in self.members.values():
            started.wait_until_up()

    def start(self, member, host, name):
        writes, reads = self.rights[name]
        words = [member, "--deployment", self.topology, "--host", host, "--as", name]
        for option, topics in (("--writes", writes), ("--reads", reads)):
            words += [option, *sorted(topics)] if topics else []
        return Member(self.site[host], name, words, self.folder / f"{name}.log")

    def expected(self, groups):
        """Ends of others, and of its own, that each has matched when those of each group know all of their group."""
        ends = {}
        for group in groups:
            for name in group:
                pairs = [(self.rights[name], self.rights[other]) for other in group]
                ends[name] = sum(len(own[0] & other[1]) + len(own[1] & other[0]) for own, other in pairs)
        return ends

    def matched(self, names=None):
        return {name: self.members[name].matched() for name in names or self.members}

    def become(self, expected, what):
        """Waits until each of those named has as many ends of others as expected."""
        newest = {}

        def reached():
            newest.update(self.matched(expected))
            return newest == expected
        try:
            eventually(reached, LIMIT_S, what)
        except AssertionError:
            print("matched, of how many:", {name: (newest[name], expected[name]) for name in newest if newest[name] != expected[name]})
            raise

    def meet(self, what):
        begun = time.monotonic()
        self.become(self.expected([[name for names in MEMBERS.values() for name in names]]), what)
        print(f"[{time.monotonic() - begun:5.1f} s] {what}", flush=True)

    def forget(self, host):
        """Waits until those of `host` have forgotten the others'."""
        self.become(self.expected([MEMBERS[host]]), f"those on {host} forget the others")

    def all_forget(self):
        self.cable.cut()
        for host in MEMBERS:
            self.forget(host)
        self.cable.heal()

    def slave_is_forgotten(self):
        self.one_forgets("from", "master", "slave")

    def master_is_forgotten(self):
        self.one_forgets("to", "slave", "master")

    def one_forgets(self, lost, who, whom):
        """The case that Fast DDS alone does not end: who is forgotten goes on hearing the others, and so knows them still."""
        before = self.matched(MEMBERS[whom])
        self.cable.cut(lost)
        self.forget(who)
        assert self.matched(MEMBERS[whom]) == before, f"those on {whom} hear the others, and should know them"
        self.cable.heal()

    def stands_still(self):
        """A process that did not run for longer than its lease: the others forget it; what it does is a matter of chance."""
        frozen = self.members["phantom_sensing"].process
        others = [name for name in MEMBERS["master"] if name != "phantom_sensing"] + list(MEMBERS["slave"])
        without = self.expected([others])
        frozen.send_signal(signal.SIGSTOP)
        try:
            self.become(without, "the others forget the process that stands still")
        finally:
            frozen.send_signal(signal.SIGCONT)

    def close(self):
        self.site.close()


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--member", required=True)
    arguments.add_argument("--cable", required=True)
    arguments.add_argument("--keep", help="folder for logs that stay")
    given = arguments.parse_args()
    need_rights()
    need("openssl")
    folder = Path(given.keep or tempfile.mkdtemp(prefix="phantom_rejoin_"))
    folder.mkdir(parents=True, exist_ok=True)
    members = Members(folder.resolve(), Path(given.member).resolve(), Path(given.cable).resolve())
    try:
        members.meet("all find each other")
        for part, what in ((members.all_forget, "again after an outage"),
                           (members.slave_is_forgotten, "again after the slave's host was heard by nobody"),
                           (members.master_is_forgotten, "again after the slave's host heard nobody"),
                           (members.stands_still, "again after a process stood still")):
            part()
            members.meet(what)
    finally:
        members.close()
        if not given.keep:
            shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
