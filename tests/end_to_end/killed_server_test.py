#!/usr/bin/env python3
"""wva_server is killed while it carries out a command: who asked is told within its time limit, a restarted server serves the
cell as it was before or after the change, and a request that is repeated to it is carried out once.

killed_server_test.py --bin FOLDER
"""
import re
import signal
import time

from command_site import CommandSite
from hosts import eventually, given_paths, need_rights, telling_logs

SHAPE = ('implicit: {f: "sin(60*x)*cos(60*y) + sin(60*y)*cos(60*z) + sin(60*z)*cos(60*x)", min_m: [-0.05, -0.05, -0.05], max_m: [0.05, 0.05, 0.05]}\n'
         "pose: {xyz_m: [0, 0, 0.8]}\n")


def kill_under_way(site, server, client, before):
    eventually(lambda: site.told.counted("workspace_reply") > before or client.poll() is not None, what="the command is taken")
    server.send_signal(signal.SIGKILL)
    server.wait()


# Tries wva_server: it is killed and started anew
def expect_told_and_whole(site):
    server = site.serve()
    before = site.told.counted("workspace_reply")
    begun = time.monotonic()
    client = site.add("first", SHAPE, timeout_s=15)
    kill_under_way(site, server, client, before)
    out = client.communicate(timeout=120)[0]  # a loaded machine is slow to start and to end it
    print(f"who asked heard after {time.monotonic() - begun:.1f} s: {client.returncode}, {out.strip()}")
    assert client.returncode in (0, 1, 3) and out.strip(), "it was not told"
    server = site.serve()
    names = site.names()
    count = len(re.findall(r"\bfirst\b", names))
    assert count in (0, 1), names
    assert client.returncode != 0 or count == 1, "it was told that its object is there:\n" + names
    assert "work_table" in names and "cable_duct" in names, names
    return server


def expect_carried_out_once(site, server):
    before = site.told.counted("workspace_reply")
    client = site.add("second", SHAPE, timeout_s=200)
    kill_under_way(site, server, client, before)
    server = site.serve()
    out = client.communicate(timeout=300)[0]
    print(f"over a restart: {client.returncode}, {out.strip()}")
    # Where the killed server had kept the object already, the repeated command finds it there.
    assert client.returncode == 0 or "is there already" in out, out
    names = site.names()
    assert len(re.findall(r"\bsecond\b", names)) == 1, names
    server.terminate()
    assert server.wait(60) == 0


def main():
    options = given_paths("bin")
    need_rights()
    site = CommandSite(options.bin, "killed", domain=43)
    try:
        with telling_logs(site.folder):
            expect_carried_out_once(site, expect_told_and_whole(site))
    finally:
        site.close()


main()
