#!/usr/bin/env python3
"""A stranger with real writers floods each topic with sound samples under invented keys: no process of ours dies or grows,
each tells what it dropped, and what the real server sends next still comes through while the stranger is there.

flood_test.py --programs FOLDER --bin FOLDER [--only KIND] [--scale S]
"""
import argparse
import sys
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "hosts"))
from attacked_site import DOMAIN, GROWTH_MIB, SOURCE, Site, expect_orderly_ends, quick_viewer  # noqa: E402
from hosts import eventually, need_rights, own_mib  # noqa: E402
from servo_pace import expect_as_bare, loops, slip_shares, watched_slip_shares, with_bare_loop  # noqa: E402

# As many as once filled the memory: 299,088 chunks of one octet grew the viewer by 2.1 GB, 34,289 names by 0.8 GB.
COUNTS = {"meshes": 299_088, "chunks": 299_088, "statuses": 34_289, "bricks": 60_000, "versions": 20_000, "objects": 30_000}
OBSERVED = ("meshes", "chunks", "statuses")  # more keys than observers take of a topic
TELL = ("synthetic_viewer", "phantom_sensing", "dds_recorder")  # whose component_status is looked at
# All that read the topic, or all but one: if the viewer or phantom_sensing were matched only after the flood, nobody would drop anything.
READERS = {"meshes": 3, "chunks": 3, "statuses": 4, "bricks": 2, "versions": 4, "objects": 4}
# Bricks are left out to spare the disk. The state that begins each file takes the memory that it is given.
RECORDER = "topics: ['!workspace_brick']\nqueue_MB: 8\ndurable_memory_MB: 8\ndisk: {margin_MB: 0}\n"


class Cell:
    """The processes that are flooded."""

    def __init__(self, site):
        self.site, self.added = site, 0  # objects added by this test
        recorder = site.folder / "recorder.yaml"
        recorder.write_text(f"folder: {site.folder}/recordings\n" + RECORDER)
        self.processes = {words[0]: self.start(words) for words in
                          (["wva_server"], ["slave_io", "--config", str(with_bare_loop(SOURCE, site.folder, "slave_io"))], ["phantom_sensing"],
                           ["synthetic_viewer", "--config", str(quick_viewer(site.folder))], ["dds_recorder", "record", "--config", str(recorder)],
                           ["dds_spy", "events"])}
        words = ["dds_spy", "echo", "component_status", "--json", "--deployment", str(site.topology)]
        words += [word for name in (*TELL, "slave_io") for word in ("--instance", f"component_name={name},*")]
        self.told = site.host.watch([str(site.options.bin / words[0]), *words[1:]], site.folder / "told", lambda line: line["sample"]["component_name"])
        eventually(lambda: self.figure("synthetic_viewer", "meshes") > 1 and self.figure("phantom_sensing", "workspace_version") > 0, what="the cell is up")
        self.quiet = watched_slip_shares(self.told, "slave_io", 8, 120)[0]

    def start(self, words):
        process = self.site.start([str(self.site.options.bin / words[0]), *words[1:], "--deployment", str(self.site.topology)])
        threading.Thread(target=process.stdout.read, daemon=True).start()
        return process

    def status(self, component):
        """The newest component_status of one of ours."""
        return self.told.get(component)

    def figure(self, component, name):
        sample = self.status(component)
        return next((figure["value"] for figure in sample["figures"] if figure["name"] == name), 0) if sample else 0

    def refused(self, component):
        """What its readers refused, and what it lost or gave up behind them."""
        sample = self.status(component) or {"topics": [], "figures": []}
        return (sum(topic["refused"] for topic in sample["topics"]) +
                sum(figure["value"] for figure in sample["figures"] if figure["name"] in ("meshes_refused", "events_lost") or figure["unit"] == "datagrams"))

    def expect_alive(self):
        for name, process in self.processes.items():
            assert process.poll() is None, f"{name} ended with {process.returncode}:\n" + self.site.log()

    def memory(self):
        return {name: own_mib(process.pid) for name, process in self.processes.items()}

    def expect_serves(self):
        """An object that comes now is in the workspace that is sensed and in the picture."""
        self.added += 1
        file = self.site.folder / "post.yaml"
        file.write_text(f"name: post_{self.added}\nprimitive: {{cylinder: {{radius_m: 0.03, height_m: {0.05 + 0.01 * self.added}}}}}\n"
                        f"pose: {{xyz_m: [0.6, {-0.5 + 0.1 * self.added:.1f}, 0.8]}}\n")
        meshes, version = self.figure("synthetic_viewer", "meshes"), self.figure("phantom_sensing", "workspace_version")
        done = self.site.host.try_run(self.site.options.bin / "wva_server", "command", "add", "--file", file, "--deployment", self.site.topology)
        assert done.returncode == 0, done.stdout + done.stderr
        eventually(lambda: self.figure("phantom_sensing", "workspace_version") > version, what="the new version is sensed")
        eventually(lambda: self.figure("synthetic_viewer", "meshes") > meshes, what="the new object is pictured")


def flood(cell, kind, count):
    site = cell.site
    before = most = cell.memory()
    refused = {name: cell.refused(name) for name in TELL}
    paced = loops(cell.told, "slave_io")
    flooder = site.start([str(site.options.programs / "flooder"), str(DOMAIN), kind, str(count), str(READERS[kind])])
    begun = time.monotonic()
    written = []
    reader = threading.Thread(target=lambda: written.extend((flooder.stdout.readline(), flooder.stdout.readline())))
    reader.start()
    while reader.is_alive():
        cell.expect_alive()
        most = {name: max(most[name], mib) for name, mib in cell.memory().items()}
        time.sleep(0.1)
    assert written[1].strip() == str(count), f"the stranger wrote {written} of {count} {kind}: it floods nobody\n" + site.log()[-3000:]
    print(f"{kind}: {count} in {time.monotonic() - begun:.1f} s", flush=True)
    shares = slip_shares(paced, loops(cell.told, "slave_io"))
    print(f"  slave_io skipped {shares[0]:.3f} of its ticks, the bare loop {shares[1]:.3f}; before {cell.quiet:.3f}", flush=True)
    expect_as_bare(f"slave_io under {kind}:", shares, cell.quiet)
    time.sleep(3)
    cell.expect_alive()
    after = cell.memory()
    for name in before:
        print(f"  {name}: {before[name]:.0f} MiB, at most {most[name]:.0f}, then {after[name]:.0f}", flush=True)
        assert most[name] <= before[name] * 1.1 + GROWTH_MIB, f"{name} grew:\n" + site.log()
    told = eventually(lambda: sum(cell.refused(name) - was for name, was in refused.items()), what="somebody tells that it dropped something")
    print(f"  told as refused, lost or given up: {told:.0f}", flush=True)
    if kind in OBSERVED:
        eventually(lambda: cell.refused("dds_recorder") > refused["dds_recorder"], what="the recorder tells that it dropped something")
    cell.expect_serves()
    flooder.kill()
    flooder.wait()
    cell.expect_alive()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=lambda path: Path(path).resolve(), required=True, help="folder of flooder")
    parser.add_argument("--bin", type=lambda path: Path(path).resolve(), required=True, help="folder of the components")
    parser.add_argument("--only", choices=COUNTS)
    parser.add_argument("--scale", type=float, default=1.0, help="times as many samples")
    options = parser.parse_args()
    need_rights()
    site = Site(options)
    try:
        cell = Cell(site)
        for kind, count in COUNTS.items():
            if options.only in (None, kind):
                flood(cell, kind, int(count * options.scale))
        expect_orderly_ends(site, cell.processes)
    finally:
        site.end()


main()
