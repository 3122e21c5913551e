#!/usr/bin/env python3
"""Measures what browsers that draw the scene by themselves cost the running demo.

viewers.py --bin FOLDER [--viewers NUMBER …] [--seconds S] [--numbers] [--json FILE]

For each number of viewers (default: 0 1 10) the demo runs S seconds (default 30), and as many plain clients follow the scene stream, numbers and
scene, and read all of it. A line each: octets that one gets, processor time of the viewer's thread `scene` as a share of a core, in all and by viewer,
and how late master_io's servo wakes up beside an empty loop of the same rate in the same session. Nothing else should run, nor the page's port be taken.
Exit code 1 if a viewer's stream broke off.
"""
import argparse
import json
import os
import re
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

STARTS_S = 120  # at most, until all components are ready
UPGRADE = ("GET /scene HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")
SCENE = b"\x81\x8f\0\0\0\0" + b'{"rate_Hz": 60}'  # a text of 15 octets, masked with zeros


def follow(port, scene):
    """A follower of the numbers and, with `scene`, of the scene; what it gets has not been read."""
    client = socket.create_connection(("127.0.0.1", port), timeout=10)
    client.sendall(UPGRADE.format(port=port).encode())
    head = b""
    while not head.endswith(b"\r\n\r\n"):
        octet = client.recv(1)
        if not octet:
            break
        head += octet
    if b" 101 " not in head.split(b"\r\n")[0]:
        raise RuntimeError(f"the scene stream answers {head.decode(errors='replace')!r}")
    if scene:
        client.sendall(SCENE)
    client.setblocking(False)
    return client


def read_all(clients, seconds):
    """Octets that came in all, and how many streams broke off."""
    octets, broken = 0, 0
    with selectors.DefaultSelector() as selector:
        for client in clients:
            selector.register(client, selectors.EVENT_READ)
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            for key, _ in selector.select(min(left, 0.1)):
                got = key.fileobj.recv(1 << 16)
                octets += len(got)
                if not got:
                    broken += 1
                    selector.unregister(key.fileobj)
    return octets, broken


def processor_s(session, thread):
    """Processor time of the viewer's threads of that name, of the session whose process is `session`."""
    ticks = 0
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
            if int(fields[1]) != session or "synthetic_viewer" not in (status.parent / "cmdline").read_text().split("\0")[0]:
                continue
            for task in (status.parent / "task").iterdir():
                if (task / "comm").read_text().strip() == thread:
                    user, kernel = (task / "stat").read_text().rpartition(")")[2].split()[11:13]
                    ticks += int(user) + int(kernel)
        except (FileNotFoundError, ProcessLookupError):
            continue  # it has ended
    return ticks / os.sysconf("SC_CLK_TCK")


def measure(folder, count, seconds, scene):
    with tempfile.TemporaryDirectory(prefix="phantom_viewers_") as scratch:
        environment = {**os.environ, "PHANTOM_STATE_DIR": scratch + "/state"}
        session = subprocess.Popen([folder / "phantom_session", "--report-dir", scratch + "/report"], stdout=subprocess.PIPE, text=True, env=environment)
        clients = []
        try:
            watchdog = time.monotonic() + STARTS_S
            while not (found := re.search(r"Operator's page: (http\S+)", line := session.stdout.readline())):
                if not line or time.monotonic() > watchdog:
                    raise RuntimeError("the demo did not start")
            page = urllib.request.urlopen(found[1], timeout=10).read().decode()
            port = int(re.search(r'name="stream-port" content="(\d+)"', page)[1])
            clients = [follow(port, scene) for _ in range(count)]
            read_all(clients, 2)  # what a new follower gets first
            before_s, began = processor_s(session.pid, "scene"), time.monotonic()
            octets, broken = read_all(clients, seconds)
            took_s = time.monotonic() - began
            core = (processor_s(session.pid, "scene") - before_s) / took_s
        finally:
            session.send_signal(signal.SIGINT)
            session.communicate(timeout=STARTS_S)
            for client in clients:
                client.close()
        loops = json.loads(Path(scratch, "report/summary.json").read_text())["loops"]
    lateness = {name: {key: loops["master_io." + name][key] for key in ("p50_us", "p99_us", "slips", "ticks")} for name in ("servo", "bare_loop")}
    return {"viewers": count, "octets_per_s": octets / took_s / count if count else 0, "core": core, "core_each": core / count if count else 0,
            "broken": broken, **lateness}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=Path, required=True, help="folder of the executables")
    parser.add_argument("--viewers", type=int, nargs="+", default=[0, 1, 10])
    parser.add_argument("--seconds", type=float, default=30)
    parser.add_argument("--numbers", action="store_true", help="they follow the numbers alone, as a page that does not draw the scene")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    print("viewers  kB/s each  core, all  core, each   servo p50 / p99 µs, slips   empty loop p50 / p99 µs, slips   load")
    results = []
    for count in options.viewers:
        result = measure(options.bin, count, options.seconds, not options.numbers)
        result["load"] = os.getloadavg()[0]
        results.append(result)
        servo, bare = (f"{r['p50_us']:8.0f} / {r['p99_us']:5.0f}, {r['slips']:4}" for r in (result["servo"], result["bare_loop"]))
        print(f"{count:7}  {result['octets_per_s'] / 1e3:9.1f}  {100 * result['core']:7.2f} %  {100 * result['core_each']:8.2f} %   {servo:>26}   {bare:>31}   {result['load']:4.1f}",
              flush=True)
    if options.json:
        options.json.write_text(json.dumps(results, indent=1))
    sys.exit(any(result["broken"] for result in results))


if __name__ == "__main__":
    main()
