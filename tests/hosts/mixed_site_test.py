#!/usr/bin/env python3
"""A site of two releases of Debian: this machine's on the master's host, another one's on the slave's, with their own Fast DDS each.

mixed_site_test.py --build DIR --root DIR --other-build DIR

`root` is where the other Debian is, `other-build` the build folder in it, both as scripts/test_debian makes them: what is at a path here
(the sources, /tmp) is at the same path there. Without security: the two versions of Fast DDS do not complete a secured discovery
(docs/fast_dds.md).
"""
import argparse
import json
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

from hosts import connected, eventually, need_rights, telling_logs

SOURCE = Path(__file__).resolve().parents[2]
ADDRESSES = {"master": "10.70.0.1", "slave": "10.70.0.2"}
PROCESSES = {"master": ("wva_server", "master_io", "audio_percept", "synthetic_viewer", "dds_recorder"),
             "slave": ("slave_io", "phantom_sensing", "dds_recorder")}
BRICKS = 200
LIMIT_S = 180  # only bounds a failing test
# What a session without commands and hits sends.
TOPICS = {"master_state", "slave_state", "drag_field", "percept", "interest_points", "skin_percept", "workspace_version", "workspace_brick",
          "workspace_object", "mesh_chunk", "view_pose", "component_status"}


class Every:
    """A sender or receiver of every topic (every_topic.cpp)."""

    def __init__(self, site, host, what):
        words = [site.programs[host] / "every_topic", "--what", what, "--deployment", site.topology, "--host", host]
        self.log = open(site.folder / f"{what}_{host}.log", "a")
        self.process = subprocess.Popen(site.hosts[host].inside(words), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, text=True,
                                        env=site.hosts[host].environment)
        assert self.process.stdout.readline() == "up\n", f"{what} on {host} did not start"

    def told(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def kill(self):
        self.process.kill()
        self.process.wait()

    def end(self):
        self.process.stdin.close()
        assert self.process.wait(60) == 0
        self.log.close()


class Mixed:
    def __init__(self, given):
        self.folder = Path(tempfile.mkdtemp(prefix="phantom_mixed_"))
        self.programs = {"master": given.build / "tests", "slave": given.other_build / "tests"}
        self.bin = {"master": given.build / "bin", "slave": given.other_build / "bin"}
        self.topology = self.folder / "topology.yaml"
        viewer = self.folder / "synthetic_viewer.yaml"
        viewer.write_text("frame_rate_hz: 2\nmain_view: {width_px: 160, height_px: 120}\nhit_view: {width_px: 160, height_px: 120}\n"
                          "tool_view: {enabled: false}\npage: {port: 0}\n")
        options = {"synthetic_viewer": f", config: {viewer}", "slave_io": ", simulation: true", "master_io": ", simulation: true"}
        lines = [f"name: mixed\ndomain: 42\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\ncell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\nhosts:"]
        for host, processes in PROCESSES.items():
            lines.append(f"  - name: {host}\n    interfaces: [{ADDRESSES[host]}]\n    processes:")
            for process in processes:
                arguments = f", arguments: [record, --folder, {self.folder}/recordings_{host}]" if process == "dds_recorder" else ""
                lines.append(f"      - {{component: {process}{options.get(process, '')}{arguments}}}")
        self.topology.write_text("\n".join(lines) + "\n")
        self.hosts = connected(ADDRESSES, {"slave": given.root})

    def words(self, host, program, *rest):
        return [self.bin[host] / program, *rest]

    def close(self):
        for host in self.hosts.values():
            host.close()


def releases_differ(site):
    """What is tried is what the name says."""
    versions = {host: site.hosts[host].run("sh", "-c", f"ldd {site.bin[host]}/slave_io | grep -o 'libfast[a-z]*\\.so\\.[0-9.]*' | grep -v cdr") for host in site.hosts}
    assert versions["master"] != versions["slave"], f"both hosts have {versions['master']}"
    print("master: " + versions["master"].strip() + "; slave: " + versions["slave"].strip())


def receives_everything(receiver, sent):
    """Each topic's sample as it was sent, octet by octet when it is serialised again, and all bricks."""
    def whole():
        got = receiver.told()
        return got["bricks"] == BRICKS and set(got["cdr"]) == set(sent["cdr"])
    eventually(whole, LIMIT_S, "a sample of every topic, and all bricks")
    got = receiver.told()
    for topic, cdr in sent["cdr"].items():
        assert got["cdr"][topic] == cdr, f"{topic} was sent as {cdr} and came as {got['cdr'][topic]}"


def every_topic_goes(site, of, to):
    """What `of` sends arrives at `to`, which joins late; so it does after either was killed. Returns what was sent."""
    sender = Every(site, of, "send")
    sent = sender.told()
    assert sent["bricks"] == BRICKS
    receiver = Every(site, to, "receive")
    receives_everything(receiver, sent)
    receiver.kill()
    receiver = Every(site, to, "receive")
    receives_everything(receiver, sender.told())
    sender.kill()
    before = receiver.told()["samples"]  # the new sender writes what is durable once
    sender = Every(site, of, "send")

    def missing():
        samples = receiver.told()["samples"]
        return [topic for topic in before if samples[topic] <= before[topic]]
    try:
        eventually(lambda: not missing(), LIMIT_S, "every topic from the new sender")
    except AssertionError as late:
        raise AssertionError(f"{late}; missing: {', '.join(missing())}") from None
    sent = sender.told()["cdr"]
    receiver.end()
    sender.end()
    print(f"{len(sent)} topics and {BRICKS} bricks of 30 kB from {of} to {to}: late, again after a kill of the receiver and of the sender")
    return sent


def works_as_one_system(site):
    """Components of both releases couple, and each host's spy hears all topics of both."""
    sessions = {host: site.hosts[host].start(site.words(host, "phantom_session", "--deployment", site.topology, "--host", host, "--seconds", "0", "--report-dir",
                                                        site.folder / f"report_{host}"), site.folder / f"session_{host}.log") for host in site.hosts}
    spies = {host: site.hosts[host].watch(site.words(host, "dds_spy", "echo", "*", "--history", "--json", "--every", "0.2", "--seconds", "0", "--deployment",
                                                     site.topology), site.folder / f"spy_{host}.log") for host in site.hosts}
    for host, spy in spies.items():
        def coupled():
            assert all(session.poll() is None for session in sessions.values()), "a session has ended"
            return all((spy.get(topic) or {}).get("state") == "LINK_COUPLED" for topic in ("master_state", "slave_state"))
        eventually(coupled, LIMIT_S, f"coupled, as seen from the {host}'s host")
        eventually(lambda: TOPICS <= {topic for topic in TOPICS if spy.counted(topic)}, LIMIT_S, f"all topics at the {host}'s host")
        eventually(lambda: (spy.get("percept") or {}).get("valid"), LIMIT_S, "a valid percept")
    time.sleep(3)  # something to record
    for session in sessions.values():
        session.terminate()
    for host, session in sessions.items():
        assert session.wait(120) == 0, f"the session on {host} ended with {session.returncode}"
    print("master of one release and slave of the other coupled; each host hears all topics of both")


def recordings_are_read_by_the_other(site):
    """Both releases find the same in each other's recordings, and play them back to each other."""
    for of, by in (("master", "slave"), ("slave", "master")):
        folder = site.folder / f"recordings_{of}"
        own, other = (json.loads(site.hosts[host].run(*site.words(host, "dds_recorder", "info", "--json", folder))) for host in (of, by))
        assert own == other, f"{by} finds other things in {of}'s recording"
        site.hosts[by].run(*site.words(by, "dds_recorder", "check", folder))
        spy = site.hosts[of].watch(site.words(of, "dds_spy", "echo", "*", "--history", "--json", "--every", "0.2", "--seconds", "0", "--deployment", site.topology, "--domain", "77"),
                                   site.folder / f"replay_{of}.log")
        replay = site.hosts[by].start(site.words(by, "dds_recorder", "replay", folder, "--deployment", site.topology, "--domain", "77", "--loop"), site.folder / f"replay_by_{by}.log")
        recorded = {topic for file in own for topic in file["topics"]}

        def silent():
            return [topic for topic in sorted(recorded) if not spy.counted(topic)]
        try:
            eventually(lambda: not silent(), LIMIT_S, f"{of}'s recording, played back by {by}, as heard by {of}")
        except AssertionError as late:
            raise AssertionError(f"{late}; missing: {', '.join(silent())}") from None
        for process in (replay, spy.process):
            process.terminate()
            process.wait(60)
        print(f"{of}'s recording, read, checked and played back by {by}'s release")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--build", type=lambda path: Path(path).resolve(), required=True)
    arguments.add_argument("--root", type=lambda path: Path(path).resolve(), required=True)
    arguments.add_argument("--other-build", type=Path, required=True)
    given = arguments.parse_args()
    need_rights()
    site = Mixed(given)
    try:
        with telling_logs(site.folder):
            releases_differ(site)
            there = every_topic_goes(site, "master", "slave")
            back = every_topic_goes(site, "slave", "master")
            assert there == back, "the two releases serialise the same samples differently"
            works_as_one_system(site)
            recordings_are_read_by_the_other(site)
    finally:
        site.close()
        shutil.rmtree(site.folder, ignore_errors=True)


if __name__ == "__main__":
    main()
