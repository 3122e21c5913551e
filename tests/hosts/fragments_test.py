#!/usr/bin/env python3
"""A network that drops fragments of IP packets, as many firewalls and tunnels do: the host that lacks something tells of whom and what to try, and work
as soon as fragments pass.

fragments_test.py --bin DIR --cable FILE
"""
import shutil
import tempfile
from pathlib import Path

from hosts import Site, eventually, given_paths, hot_cell_topology, need_rights, telling_logs

ADDRESSES = {"cell": "10.71.1.2", "desk": "10.71.2.2"}
LIMIT_S = 150  # only bounds a failing test
TOLD = "have not become known for"


def main():
    given = given_paths("bin", "cable")
    need_rights()
    folder = Path(tempfile.mkdtemp(prefix="phantom_fragments_"))
    file = hot_cell_topology(folder, "fragments", 43, ADDRESSES)
    site = Site(ADDRESSES, given.cable, ["desk"])
    cable = site.cables["desk"]

    def start(host, component, log):
        return site[host].start([given.bin / component, "--deployment", file, "--host", host], folder / f"{log}.log")

    def statuses(host):
        words = [given.bin / "dds_spy", "echo", "component_status", "--json", "--seconds", "0", "--deployment", file, "--host", host]
        return site[host].watch(words, folder / f"spy_{host}.log", lambda line: line.get("sample", {}).get("component_name"))

    def message(watch, component):
        return (watch.get(component) or {}).get("message", "")

    try:
        with telling_logs(folder):
            cell, desk = statuses("cell"), statuses("desk")
            start("cell", "wva_server", "wva_server")
            sensing = start("desk", "phantom_sensing", "phantom_sensing")
            eventually(lambda: "phantom_sensing" in cell.newest and "wva_server" in desk.newest, LIMIT_S, "the hosts hear each other")
            sensing.terminate()
            sensing.wait(30)
            assert TOLD not in (folder / "wva_server.log").read_text(), "nothing is wrong yet"

            cable.lose_fragments(True)
            start("desk", "phantom_sensing", "phantom_sensing_alone")
            eventually(lambda: TOLD in message(desk, "phantom_sensing"), LIMIT_S, "phantom_sensing tells it")
            there = message(desk, "phantom_sensing")  # what wva_server lacks, if anything, depends on how it came
            assert f"some readers and writers of wva_server at {ADDRESSES['cell']}" in there, there
            assert "phantom-doctor" in there, there
            eventually(lambda: TOLD in (folder / "phantom_sensing_alone.log").read_text(), LIMIT_S, "the log has it, too")
            print(there)

            cable.lose_fragments(False)
            eventually(lambda: TOLD not in message(cell, "wva_server") and TOLD not in message(desk, "phantom_sensing"), LIMIT_S,
                       "with fragments the hosts find each other")
    finally:
        site.close()
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
