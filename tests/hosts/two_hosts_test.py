#!/usr/bin/env python3
"""The shipped topology of two hosts, as it is, on two hosts with one network between them: they find each other by multicast.

two_hosts_test.py --bin DIR
"""
import shutil
import tempfile
from pathlib import Path

from hosts import connected, eventually, given_paths, need_rights, telling_logs

SOURCE = Path(__file__).resolve().parents[2]
ADDRESSES = {"haptic": "10.20.0.1", "view": "10.20.0.2"}
LIMIT_S = 150  # only bounds a failing test


def main():
    binaries = given_paths("bin").bin
    need_rights()
    folder = Path(tempfile.mkdtemp(prefix="phantom_two_hosts_"))
    topology = SOURCE / "deploy/topologies/two_hosts.yaml"
    hosts = connected(ADDRESSES)
    try:
        with telling_logs(folder):
            for name, host in hosts.items():
                host.start([binaries / "phantom_session", "--deployment", topology, "--host", name, "--seconds", "0", "--report-dir",
                            folder / name], folder / f"{name}.log")
            # The spy is not told where it is: it finds out by its addresses.
            watch = hosts["view"].watch(
                [binaries / "dds_spy", "echo", "master_state", "component_status", "--deployment", topology, "--json", "--every", "0.1",
                 "--seconds", "0"], folder / "spy.log", lambda line: line.get("sample", {}).get("component_name", line.get("topic")))
            eventually(lambda: (watch.get("master_state") or {}).get("state") == "LINK_COUPLED", LIMIT_S, "coupled, as seen from the view host")

            def objects(component):
                status = watch.get(component) or {"figures": []}
                return next((f["value"] for f in status["figures"] if f["name"] == "objects"), 0)
            eventually(lambda: 0 < objects("wva_server") == objects("synthetic_viewer"), LIMIT_S, "the whole cell at the view host")
            print(f"coupled; {objects('synthetic_viewer'):.0f} objects at the view host")
    finally:
        for host in hosts.values():
            host.close()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
