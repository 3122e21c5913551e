#!/usr/bin/env python3
"""The system across the shield wall: four hosts on routed subnets, the slave's behind a bad cable; open, open with a discovery server, or
secured.

wall_test.py open|served|secured --bin DIR --cable FILE [--keep DIR]
"""
import argparse
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path

from attackers import attackers_fail, onlookers_only_look
from hosts import Site, eventually, need, need_rights, run
from rights import endpoints_have_exactly_their_rights
from servo_pace import expect_as_bare, watched_slip_shares

SOURCE = Path(__file__).resolve().parents[2]
ADDRESSES = {"master": "10.30.1.2", "slave": "10.30.2.2", "view": "10.30.3.2", "diagnostics": "10.30.4.2"}
START_S = 400  # limits only bound a failing test


class Wall:
    def __init__(self, mode, binaries, cable, folder):
        self.secured, self.served, self.bin, self.folder = mode == "secured", mode == "served", binaries, folder
        self.security = self.folder / "security"
        self.sessions = {}
        self.topology = self.make_topology()
        if self.secured:
            self.make_security(self.security)
        self.site = Site(ADDRESSES, cable, ["slave"])

    def make_topology(self, name="topology.yaml", security=None):
        """The shipped topology with absolute paths and the test's own documents."""
        text = (SOURCE / "deploy/topologies" / ("shield_wall.yaml" if self.secured else "shield_wall_open.yaml")).read_text()
        for word in ("qos", "cells"):
            text = text.replace(f"../{word}/", f"{SOURCE}/deploy/{word}/")
        if self.served:
            text, changed = re.subn(r"initial_peers:.*\n *participants_per_host:.*", f"discovery_servers: ['{ADDRESSES['master']}:11811']", text)
            assert changed == 1
        if self.secured:
            assert "/etc/phantom/security" in text
            wanted = f"security: {security or self.security}" if security != "none" else ""
            text = text.replace("security: /etc/phantom/security", wanted)
        # Four hosts and the routers between them share this machine's few cores: their servo loops run at an eighth of their rate,
        # with gains that are stable there.
        slower = {"rate_Hz: 1000": "rate_Hz: 125", "late_limit_s: 0.01": "late_limit_s: 0.05", "sctfb: 0.01": "sctfb: 0.002",
                  "pfff: 0.01": "pfff: 0.002", "  pe: 1 ": "  pe: 0.5 ", "  peff: 1 ": "  peff: 0.2 "}
        for component in ("master_io", "slave_io"):
            config = (SOURCE / f"components/{component}/{component}.yaml").read_text()
            assert "rate_Hz: 1000" in config
            for shipped, here in slower.items():
                config = config.replace(shipped, here)
            (self.folder / f"{component}.yaml").write_text(config)
            text = text.replace(f"component: {component}", f"component: {component}, config: {self.folder}/{component}.yaml")
        text = text.replace("arguments: [record]", f"arguments: [record, --folder, {self.folder}/recordings]")
        (self.folder / name).write_text(text)
        return self.folder / name

    def make_security(self, folder):
        run(str(SOURCE / "deploy/security/make"), "site", str(folder))

    def words(self, program, *rest, topology=None):
        return [self.bin / program, "--deployment", topology or self.topology, *rest]

    def start_session(self, host):
        words = self.words("phantom_session", "--host", host, "--seconds", "0", "--report-dir", self.folder / "report" / host)
        self.sessions[host] = self.site[host].start(words, self.folder / f"session_{host}.log")

    def runs(self):
        """True while every session that was started goes on; one that has ended is an error at once."""
        ended = [host for host, session in self.sessions.items() if session.poll() is not None]
        assert not ended, f"the session of {', '.join(ended)} has ended"
        return True

    def spy(self, host, *topics, name="spy"):
        words = self.words("dds_spy", "echo", *topics, "--json", "--every", "0.1", "--seconds", "0")
        return self.site[host].watch(words, self.folder / f"{name}.log", key)

    def logs(self):
        for log in sorted(self.folder.rglob("*.log")):
            yield log.name, "\n".join(log.read_text(errors="replace").splitlines()[-12:])


def key(line):
    """Keep the newest of a topic; of component_status, of a component."""
    sample = line.get("sample", {})
    return sample.get("component_name", line.get("topic"))


def link_state(watch, topic):
    sample = watch.get(topic)
    return sample and sample["state"]


def figure(watch, component, name):
    status = watch.get(component) or {"figures": []}
    return next((f["value"] for f in status["figures"] if f["name"] == name), None)


def torque(sample):
    return sum(abs(t) for t in sample["percept_torque_Nm"]) + sum(abs(t) for t in sample["feedback_torque_Nm"])


def starts_and_couples(wall):
    """All hosts find each other without multicast; over a cable that loses, delays and jitters, percepts arrive."""
    cable = wall.site.cables["slave"]
    cable.set(loss=0.005, delay_ms=2, jitter_ms=1)
    if wall.served:
        wall.site["master"].start(["fast-discovery-server", "-i", "0", "-l", ADDRESSES["master"], "-p", "11811"],
                                  wall.folder / "discovery.log")
    for host in ("slave", "master", "diagnostics"):
        wall.start_session(host)
    watch = wall.spy("diagnostics", "master_state", "slave_state", "percept", "component_status")
    eventually(lambda: wall.runs() and link_state(watch, "master_state") == "LINK_COUPLED", START_S, "master and slave coupled")
    eventually(lambda: (watch.get("percept") or {}).get("valid"), START_S, "a valid percept")
    seen = watch.counted("percept")
    eventually(lambda: watch.counted("percept") > seen + 10, START_S, "percepts go on")
    return watch


def late_viewer_gets_the_whole_cell(wall, watch):
    """A viewer that starts late, on another host, has every object of the cell, and its mesh."""
    wall.start_session("view")
    served = eventually(lambda: figure(watch, "wva_server", "objects"), START_S, "the server's count of objects")
    eventually(lambda: wall.runs() and figure(watch, "synthetic_viewer", "objects") == served, START_S, f"{served:.0f} objects in the viewer")
    eventually(lambda: (figure(watch, "synthetic_viewer", "meshes") or 0) > 0, START_S, "meshes in the viewer")
    listing = watch_bricks(wall)
    print(f"late viewer: {served:.0f} objects; late reader: {listing} bricks, all there are")


def watch_bricks(wall):
    reader = wall.site["view"].watch(
        wall.words("dds_spy", "echo", "workspace_brick", "workspace_version", "--history", "--json", "--seconds", "0"),
        wall.folder / "bricks.log",
        lambda line: line["topic"] if line["topic"] == "workspace_version" else tuple(line["sample"][k] for k in ("bx", "by", "bz")))
    version = eventually(lambda: reader.get("workspace_version"), START_S, "a version of the workspace")

    def bricks():
        with reader.lock:
            return sum(1 for k, b in reader.newest.items() if isinstance(k, tuple) and b["voxels_zstd"])
    eventually(lambda: bricks() == version["brick_count"], START_S, f"all {version['brick_count']} bricks")
    reader.process.terminate()
    return version["brick_count"]


def partition_is_safe_and_heals(wall, watch):
    """Cut off, both sides go to their safe state by themselves; once the cable heals they find each other and couple again."""
    behind = wall.spy("slave", "slave_state", name="behind")
    eventually(lambda: link_state(behind, "slave_state") == "LINK_COUPLED", START_S, "the slave following")
    cable = wall.site.cables["slave"]
    cut = time.monotonic()
    cable.cut()
    eventually(lambda: link_state(watch, "master_state") == "LINK_DEGRADED", 30, "the master degraded")
    eventually(lambda: link_state(behind, "slave_state") == "LINK_DEGRADED", 30, "the slave holding")
    eventually(lambda: torque(watch.get("master_state")) == 0.0, 30, "the master without torque")
    safe_s = time.monotonic() - cut
    held = behind.get("slave_state")["position_rad"]
    # Longer than the lease of a participant (5 s): each side has forgotten the other, so that healing is a new discovery.
    eventually(lambda: time.monotonic() - cut > 8.0, 20)
    now = behind.get("slave_state")["position_rad"]
    assert max(abs(a - b) for a, b in zip(held, now)) < 0.02, f"the slave did not hold: {held} {now}"
    assert link_state(watch, "master_state") == "LINK_DEGRADED", link_state(watch, "master_state")
    cable.heal()
    healed = time.monotonic()
    eventually(lambda: link_state(watch, "master_state") == "LINK_COUPLED", START_S, "coupled again")
    eventually(lambda: link_state(behind, "slave_state") == "LINK_COUPLED", START_S, "the slave following again")
    print(f"partition: both safe as seen after {safe_s:.2f} s; coupled again {time.monotonic() - healed:.2f} s after healing")
    behind.process.terminate()


def slip_shares(watch, seconds):
    return watched_slip_shares(watch, "master_io", seconds, START_S)


def onlookers_do_not_disturb(wall, watch):
    """Five spies join, read everything, and are killed: the servo slips as an empty loop beside it does, not more."""
    quiet, quiet_bare = slip_shares(watch, 8)
    spies = [wall.spy(host, "*", name=f"crowd_{i}") for i, host in enumerate(["diagnostics", "view", "diagnostics", "view", "slave"])]
    for spy in spies:
        eventually(lambda: spy.counted("percept") > 0, START_S, "a spy hears")
    crowded, crowded_bare = slip_shares(watch, 8)
    for spy in spies:
        spy.process.kill()
    left, left_bare = slip_shares(watch, 8)
    print("slips, servo (empty loop beside it): "
          f"quiet {quiet:.3f} ({quiet_bare:.3f}), five spies {crowded:.3f} ({crowded_bare:.3f}), gone {left:.3f} ({left_bare:.3f})")
    for what, servo, bare in (("with five spies", crowded, crowded_bare), ("after they were killed", left, left_bare)):
        expect_as_bare(what, (servo, bare), quiet)
    assert link_state(watch, "master_state") != "LINK_STOPPED"


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("mode", choices=["open", "served", "secured"])
    arguments.add_argument("--bin", required=True)
    arguments.add_argument("--cable", required=True)
    arguments.add_argument("--keep", help="folder for logs that stay")
    given = arguments.parse_args()
    need_rights()
    needed = {"secured": "openssl", "served": "fast-discovery-server"}
    if given.mode in needed:
        need(needed[given.mode])
    folder = Path(given.keep or tempfile.mkdtemp(prefix="phantom_wall_"))
    folder.mkdir(parents=True, exist_ok=True)
    wall = Wall(given.mode, Path(given.bin).resolve(), Path(given.cable).resolve(), folder.resolve())
    try:
        step = time.monotonic()

        def done(what):
            nonlocal step
            print(f"[{time.monotonic() - step:5.1f} s] {what}", flush=True)
            step = time.monotonic()
        watch = starts_and_couples(wall)
        done("four hosts coupled over a cable with loss, delay and jitter, without multicast")
        late_viewer_gets_the_whole_cell(wall, watch)
        done("a late viewer has the whole cell")
        if wall.served:
            return
        if not wall.secured:
            endpoints_have_exactly_their_rights(wall)
            done("every component opens exactly what its rights grant")
            onlookers_do_not_disturb(wall, watch)
            done("onlookers do not disturb the servo")
        partition_is_safe_and_heals(wall, watch)
        done("partition is safe, and heals")
        if wall.secured:
            seconds = attackers_fail(wall, watch)
            done("without the right documents nobody reads or commands")
            onlookers_only_look(wall, seconds)
            done("spy, recorder and session read all and command nothing")
    except BaseException:
        for name, text in wall.logs():
            print(f"--- {name}\n{text}", file=sys.stderr)
        raise
    finally:
        wall.site.close()
        if not given.keep:
            shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
