#!/usr/bin/env python3
"""A site of two releases of Debian: this machine's on the master's host, another one's on the slave's, with their own Fast DDS each,
without security, and through a tunnel (deploy/security/tunnel).

mixed_site_test.py --build DIR --root DIR --other-build DIR

`root` is where the other Debian is, `other-build` the build folder in it, both as scripts/test_debian makes them: what is at a path here
(the sources, /tmp) is at the same path there. A tunnel secures such a site, since the two versions of Fast DDS do not complete a
secured discovery (docs/fast_dds.md).
"""
import argparse
import json
import shutil
import tempfile
import time
from pathlib import Path

from every_topic import LIMIT_S, every_topic_goes
from hosts import connected, eventually, need_rights, telling_logs
from tunnel import Tunnel

SOURCE = Path(__file__).resolve().parents[2]
ADDRESSES = {"master": "10.70.0.1", "slave": "10.70.0.2"}
PROCESSES = {"master": ("wva_server", "master_io", "audio_percept", "synthetic_viewer", "dds_recorder"),
             "slave": ("slave_io", "phantom_sensing", "dds_recorder")}
# What a session without commands and hits sends.
TOPICS = {"master_state", "slave_state", "drag_field", "percept", "interest_points", "skin_percept", "workspace_version", "workspace_brick",
          "workspace_object", "mesh_chunk", "view_pose", "component_status"}


class Mixed:
    def __init__(self, given, tunnelled):
        self.folder = Path(tempfile.mkdtemp(prefix="phantom_mixed_"))
        self.programs = {"master": given.build / "tests", "slave": given.other_build / "tests"}
        self.bin = {"master": given.build / "bin", "slave": given.other_build / "bin"}
        self.topology = self.folder / "topology.yaml"
        viewer = self.folder / "synthetic_viewer.yaml"
        viewer.write_text("frame_rate_hz: 2\nmain_view: {width_px: 160, height_px: 120}\nhit_view: {width_px: 160, height_px: 120}\n"
                          "tool_view: {enabled: false}\npage: {port: 0}\n")
        options = {"synthetic_viewer": f", config: {viewer}", "slave_io": ", simulation: true", "master_io": ", simulation: true"}
        self.hosts = connected(ADDRESSES, {"slave": given.root})
        self.tunnel = Tunnel(self.hosts, ADDRESSES, self.folder / "tunnel") if tunnelled else None
        addresses = self.tunnel.inner if tunnelled else ADDRESSES
        lines = [f"name: mixed\ndomain: 42\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\ncell: {SOURCE}/deploy/cells/hot_cell/cell.yaml"]
        if tunnelled:  # it carries no multicast
            lines.append(f"network: {{initial_peers: [{', '.join(addresses.values())}], participants_per_host: 16}}")
        lines.append("hosts:")
        for host, processes in PROCESSES.items():
            lines.append(f"  - name: {host}\n    interfaces: [{addresses[host]}]\n    processes:")
            for process in processes:
                arguments = f", arguments: [record, --folder, {self.folder}/recordings_{host}]" if process == "dds_recorder" else ""
                lines.append(f"      - {{component: {process}{options.get(process, '')}{arguments}}}")
        self.topology.write_text("\n".join(lines) + "\n")

    def words(self, host, program, *rest):
        return [self.bin[host] / program, *rest]

    def close(self):
        if self.tunnel:
            self.tunnel.close()
        for host in self.hosts.values():
            host.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def releases_differ(site):
    """What is tried is what the name says."""
    versions = {host: site.hosts[host].run("sh", "-c", f"ldd {site.bin[host]}/slave_io | grep -o 'libfast[a-z]*\\.so\\.[0-9.]*' | grep -v cdr | sort -u") for host in site.hosts}
    assert versions["master"] != versions["slave"], f"both hosts have {versions['master']}"
    print("master: " + versions["master"].strip() + "; slave: " + versions["slave"].strip())


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
    for tunnelled in (False, True):
        print("through a tunnel:" if tunnelled else "without security:", flush=True)
        site = Mixed(given, tunnelled)
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


if __name__ == "__main__":
    main()
