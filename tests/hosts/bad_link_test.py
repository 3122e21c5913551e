#!/usr/bin/env python3
"""A late joiner behind a cable that delays all frames and loses two of a hundred gets the whole cell.

A message that is cut into many frames is lost with any of them, and what came of it fills the receiver's memory for 30 s: then
nothing more arrives, and the sender sends all the time (messages of 64 kB: 120,000 to 380,000 frames; as shipped about 10,000).

bad_link_test.py --bin DIR --cable FILE
"""
import shutil
import tempfile
from pathlib import Path

from hosts import Site, eventually, given_paths, hot_cell_topology, need_rights, telling_logs

ADDRESSES = {"cell": "10.70.1.2", "desk": "10.70.2.2"}
LIMIT_S = 200  # only bounds a failing test
MOST_FRAMES = 100_000
CLEAN, BAD = {}, {"loss": 0.02, "delay_ms": 25}


class Desk:
    """The consumers of a cell: sensing takes its bricks, the viewer its meshes."""

    def __init__(self, site, words, folder):
        self.host, self.words, self.folder = site["desk"], words, folder
        self.spy = self.host.watch(words("dds_spy", "echo", "component_status", "--json", "--seconds", "0"), folder / "spy.log",
                                   lambda line: line.get("sample", {}).get("component_name"))

    def figure(self, component, name):
        status = self.spy.get(component) or {"figures": []}
        return next((f["value"] for f in status["figures"] if f["name"] == name), 0)

    def join(self, quality):
        """Sensing and viewer start, and end once they have all."""
        joiners = [self.host.start(self.words(name), self.folder / f"{name}_{quality}.log") for name in ("phantom_sensing", "synthetic_viewer")]
        eventually(lambda: 0 < self.figure("wva_server", "version") == self.figure("phantom_sensing", "workspace_version"), LIMIT_S,
                   f"the bricks over a {quality} cable")
        eventually(lambda: 0 < self.figure("wva_server", "objects") <= self.figure("synthetic_viewer", "meshes"), LIMIT_S,
                   f"the meshes over a {quality} cable")
        for joiner in joiners:
            joiner.terminate()
            joiner.wait(30)


def main():
    given = given_paths("bin", "cable")
    need_rights()
    folder = Path(tempfile.mkdtemp(prefix="phantom_bad_link_"))
    file = hot_cell_topology(folder, "bad_link", 42, ADDRESSES)
    site = Site(ADDRESSES, given.cable, ["desk"])
    cable = site.cables["desk"]

    def words_on(host):
        return lambda name, *more: [given.bin / name, *more, "--deployment", file, "--host", host]
    try:
        with telling_logs(folder):
            site["cell"].start(words_on("cell")("wva_server"), folder / "wva_server.log")
            desk = Desk(site, words_on("desk"), folder)
            eventually(lambda: desk.figure("wva_server", "version"), LIMIT_S, "the cell is published")
            for quality, link in (("good", CLEAN), ("bad", BAD)):
                before, _ = cable.set(**link)
                desk.join(quality)
                frames = cable.set(**link)[0] - before
                print(f"{quality} cable: {frames} frames", flush=True)
                if frames > MOST_FRAMES:
                    raise AssertionError(f"a late joiner over a {quality} cable took {frames} frames, {MOST_FRAMES} at most are expected")
                desk.spy.newest.clear()  # of the joiners that ended
                eventually(lambda: desk.figure("wva_server", "version"), LIMIT_S, "news of wva_server")
    finally:
        site.close()
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
