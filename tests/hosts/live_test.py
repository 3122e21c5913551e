#!/usr/bin/env python3
"""Live matter across hosts, and what the percept says of unseen space: workspace_camera behind a cable that is cut for longer than
the lease, killed, frozen, and there twice; phantom_sensing started again.

live_test.py --bin DIR --cable FILE
"""
import shutil
import signal
import tempfile
import time
from pathlib import Path

from hosts import Site, eventually, given_paths, need_rights, telling_logs

SOURCE = Path(__file__).resolve().parents[2]
ADDRESSES = {"cell": "10.64.1.2", "camera": "10.64.2.2"}
LIMIT_S, LONGER_THAN_THE_LEASE_S = 120, 8.0

CAMERA = """cameras:
  - name: above
    driver: sim
    looks_from_m: [0.95, -1.0, 1.4]
    looks_at_m: [-0.05, 0.0, 0.55]
    sim: {width_px: 160, height_px: 120, focal_px: 140, rate_hz: 10}
things:
  - {name: box, shape: box, size_m: [0.14, 0.12, 0.16], from_m: [-0.1, -0.38, 0.66], appears_s: 0, stays_s: 0}
"""


class LiveSite:
    def __init__(self, given):
        self.bin, self.folder = given.bin, Path(tempfile.mkdtemp(prefix="phantom_live_"))
        self.site = Site(ADDRESSES, given.cable, ("camera",))
        (self.folder / "workspace_camera.yaml").write_text(CAMERA)
        (self.folder / "wva_server.yaml").write_text("live: {source: workspace_camera, tolerance_vox: 5, on_loss: end}\n")
        hosts = "".join(
            f"  - name: {name}\n    interfaces: [127.0.0.1, {address}]\n    processes:\n"
            f"      - {{component: workspace_camera, simulation: true}}\n      - {{component: slave_io, simulation: true}}\n"
            f"      - {{component: phantom_sensing}}\n"
            for name, address in ADDRESSES.items())
        (self.folder / "topology.yaml").write_text(
            f"name: live\ndomain: 64\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\ncell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\n"
            f"network:\n  initial_peers: [127.0.0.1, {', '.join(ADDRESSES.values())}]\nhosts:\n{hosts}")

    def start(self, host, component, *rest, log=None):
        config = self.folder / f"{component}.yaml"
        words = [self.bin / component, "--deployment", self.folder / "topology.yaml", "--host", host, *rest]
        return self.site[host].start(words + (["--config", config] if config.exists() else []), self.folder / f"{log or component}.log")

    def watch(self):
        def spy(topic, key):
            words = [self.bin / "dds_spy", "echo", topic, "--json", "--every", "0.1", "--seconds", "0",
                     "--deployment", self.folder / "topology.yaml", "--host", "cell"]
            return self.site["cell"].watch(words, self.folder / f"{topic}.log", key)
        self.spy = spy("component_status", lambda line: line.get("sample", {}).get("component_name"))
        self.percepts = spy("percept", None)

    def server(self):
        return self.spy.get("wva_server") or {}

    def voxels(self):
        return next((f["value"] for f in self.server().get("figures", []) if f["name"] == "live_voxels"), None)

    def has_matter(self, what):
        eventually(lambda: (self.voxels() or 0) > 100 and "nothing is heard" not in self.server()["message"], LIMIT_S, f"live matter {what}")
        print(f"live matter {what}: {self.voxels():.0f} voxels", flush=True)

    def sense(self, log):
        process = self.start("cell", "phantom_sensing", log=log)
        hears = lambda: "depth cameras watch the workspace" in (self.folder / f"{log}.log").read_text()  # noqa: E731
        eventually(hears, LIMIT_S, "phantom_sensing hears what cameras see")
        return process

    def is_seen(self, seen, when):
        """The percept says whether a depth camera sees its place."""
        def says():
            percept = self.percepts.get("percept") or {}
            return percept.get("valid") and (percept["condition"] == "PERCEPT_SPACE_UNSEEN") != seen
        eventually(says, LIMIT_S, f"the percept's place is {'seen' if seen else 'unseen'} {when}")
        print(f"the percept says that its place is {'seen' if seen else 'unseen'} {when}", flush=True)

    def has_ended(self, what):
        eventually(lambda: self.voxels() == 0 and "nothing is heard of workspace_camera" in self.server()["message"], LIMIT_S, f"live matter ended {what}")
        print(f"live matter has ended {what}, and wva_server says why", flush=True)


def run(site, cable):
    server = site.start("cell", "wva_server")
    site.start("cell", "slave_io")
    site.watch()
    camera = site.start("camera", "workspace_camera")
    site.has_matter("across the hosts")
    sensing = site.sense("phantom_sensing")
    site.is_seen(True, "at the start")

    cable.cut()
    site.has_ended("with the cable cut")
    site.is_seen(False, "with the cable cut")
    time.sleep(LONGER_THAN_THE_LEASE_S)
    cable.heal()
    site.has_matter("again after the cable was cut for longer than the lease")
    site.is_seen(True, "with the cable healed")

    sensing.kill()
    sensing.wait(30)
    site.sense("sensing_again")
    site.is_seen(True, "by a phantom_sensing that was started again")

    second = site.start("cell", "workspace_camera", log="second")
    eventually(lambda: "two processes send occupancy_change" in site.server()["message"], LIMIT_S, "the second is reported")
    assert site.voxels() > 100, "the first is followed"
    site.is_seen(True, "while two are there")
    second.send_signal(signal.SIGTERM)
    assert second.wait(30) == 0
    eventually(lambda: "two processes" not in site.server()["message"], LIMIT_S, "one is left")

    camera.send_signal(signal.SIGSTOP)
    site.has_ended("while its process stands still")
    site.is_seen(False, "while its process stands still")
    time.sleep(LONGER_THAN_THE_LEASE_S)
    camera.send_signal(signal.SIGCONT)
    site.has_matter("again after its process stood still for longer than the lease")
    site.is_seen(True, "now that it runs on")

    camera.kill()
    site.has_ended("with its process killed")
    site.start("camera", "workspace_camera", log="restarted")
    site.has_matter("again with a new process")
    site.is_seen(True, "by a new process")
    assert server.poll() is None, "wva_server ran throughout"


def main():
    given = given_paths("bin", "cable")
    need_rights()
    site = LiveSite(given)
    try:
        with telling_logs(site.folder, 20):
            run(site, site.site.cables["camera"])
    finally:
        site.site.close()
        shutil.rmtree(site.folder, ignore_errors=True)


if __name__ == "__main__":
    main()
