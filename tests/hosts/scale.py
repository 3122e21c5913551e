#!/usr/bin/env python3
"""Measures what onlookers cost the haptic loop and what participants cost a network; prints tables for deploy/site.md.

  scale [loop] [wire] [discovery]   which tables (default: all three)
  --bin DIR        executables (default: build/release/bin)
  --onlookers N …  numbers of onlookers of table loop (default: 0 1 5 20)
  --cells N …      numbers of cells of table discovery (default: 1 2 4 8)
  --write          puts the tables into deploy/site.md
  --seconds S      how long the loop runs for each line (default: 30)

loop: master_io, slave_io, phantom_sensing and wva_server on one host; recorders, spies and viewers, in turn, on another, a cable
between them (network namespaces of this machine, so all share its processors). Each line is a session of its own: wake-up of
master_io's servo behind its due time, next to an empty loop of the same rate; round trip of a sample over DDS; processor time
of each; bytes over the cable. wire: bytes of each periodic topic's sample as a reader on another host gets it.
discovery: bytes until all have found each other, and then each second, by number of cells, in one domain and in one domain each.
Needs the rights of root, and nothing else running. Exit codes: 0 done, 2 wrong arguments, 3 something needed is missing.
"""
import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from haptic_site import LOOP, SOURCE, START_S, HapticSite, Meter, children, cpu_s  # noqa: E402
from hosts import SKIPPED, Host, eventually, need_rights  # noqa: E402
from rights import RUNNING, read_rights  # noqa: E402

PAGE = SOURCE / "deploy/site.md"
KINDS = ("recorder", "spy", "viewer")  # in turn
PERIODIC = ("master_state", "slave_state", "drag_field", "percept", "interest_points", "skin_percept", "component_status")


def table(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *("| " + " | ".join(row) + " |" for row in rows)]) + "\n"


def machine():
    model = next((line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines()
                  if line.startswith("model name")), "unknown processor")
    return f"{os.cpu_count()} × {model}; load before (1, 5, 15 min): " + " ".join(f"{x:.1f}" for x in os.getloadavg())


def of_percent(value):
    return f"{100 * value:.0f} %"


def loop_line(site, count, seconds):
    crowd = [site.onlooker(KINDS[i % len(KINDS)]) for i in range(count)]
    name = f"loop_{count}"
    session = site.start_loop(name, seconds)
    meter = Meter(site, {k: v for k, v in children(session.pid).items() if k in LOOP}).start()
    before = [cpu_s(p.pid) for p in crowd]
    time.sleep(max(1.0, seconds - 2.0))
    cpu, wire, measured_s = meter.stop()
    crowd_cpu = sum(cpu_s(p.pid) - b for p, b in zip(crowd, before)) / measured_s
    assert session.wait(60) == 0, session.log.read_text()
    for process in crowd:
        assert process.poll() is None, f"an onlooker ended with {process.returncode}: {process.log.read_text()[-500:]}"
        process.kill()
        process.wait()
    report = site.report(name)
    servo, bare = report["loops"]["master_io.servo"], report["loops"]["master_io.bare_loop"]
    slave = report["loops"]["slave_io.servo"]

    def slips(loop):
        return f"{loop['slips'] / max(1, loop['ticks'] + loop['slips']):.4f}"

    def late(loop):
        return f"{loop['p50_us']:.0f} / {loop['p99_us']:.0f} / {loop['max_us']:.0f}"
    trip = report["round_trip"]
    return [str(count), late(servo), slips(servo), late(bare), slips(bare), late(slave), slips(slave),
            f"{1e-3 * trip['p50_us']:.2f} / {1e-3 * trip['p99_us']:.2f}" if trip else "–",
            str(sum(report["deadline_missed"].values())), *[of_percent(cpu.get(c, 0)) for c in LOOP], of_percent(crowd_cpu),
            f"{wire['out'] * 8e-6:.1f}", f"{wire['out_packets']:.0f}"]


def loop(given):
    site = HapticSite(given.bin)
    try:
        rows = [loop_line(site, count, given.seconds) for count in given.onlookers]
    finally:
        site.close()
    return table(["onlookers", "servo late p50 / p99 / max, µs", "slips", "empty loop, µs", "slips", "slave's servo, µs", "slips",
                  "round trip p50 / p99, ms", "deadlines missed", *[f"{name}, of a core" for name in LOOP], "onlookers, of a core",
                  "on the cable, Mbit/s", "packets/s"], rows)


def carried_in(site, seconds):
    meter = Meter(site, {}).start()
    time.sleep(seconds)
    return meter.stop()


def written(spy, topic):
    """Samples that the writers have sent so far: by its own numbers, for what is lost on the way was on the cable, too."""
    return spy.counted(topic) if topic == "component_status" else spy.get(topic)["stamp"]["sequence_number"]


def wire(given):
    site = HapticSite(given.bin)
    try:
        session = site.start_loop("wire")
        _, alone, _ = carried_in(site, 5)
        deaf = site.hosts["onlookers"].start(site.words("dds_spy", "echo", "no_such_topic", "--seconds", "0"), site.folder / "deaf.log")
        time.sleep(5)  # until those who met have said what they have to
        _, quiet, _ = carried_in(site, 5)
        deaf.terminate()
        deaf.wait()
        rows = []
        for topic in PERIODIC:
            spy = site.hosts["onlookers"].watch(site.words("dds_spy", "echo", topic, "--json", "--seconds", "0"),
                                                site.folder / f"{topic}.log", None)
            eventually(lambda: spy.counted(topic) > 3, START_S, f"{topic} is heard")
            time.sleep(2)
            before = written(spy, topic)
            _, carried, seconds = carried_in(site, 6)
            rate = (written(spy, topic) - before) / seconds
            spy.process.terminate()
            spy.process.wait()
            octets = json.loads(site.hosts["onlookers"].run(*site.words("dds_spy", "hz", topic, "--json", "--seconds", "3")))["streams"]
            payload = sum(s["octets"] for s in octets) / max(1, sum(s["samples"] for s in octets))
            bytes_each = (carried["out"] - quiet["out"]) / rate
            rows.append([f"`{topic}`", f"{rate:.0f}", f"{payload:.0f}", f"{bytes_each:.0f}", f"{bytes_each * rate * 8e-6:.2f}"])
        session.terminate()
        session.wait(60)
        told = f"Announcements of the loop's host, nobody on the other: {alone['out']:.0f} bytes/s; with somebody there who reads " \
               f"nothing: {quiet['out']:.0f} (left out below).\n\n"
    finally:
        site.close()
    return told + table(["topic", "samples/s", "payload, bytes", "on the cable, bytes/sample", "Mbit/s at this rate, for each reader on another host"], rows)


class Network:
    """Cells of silent members on one host: its loopback carries what a network would."""

    def __init__(self, given, folder):
        self.host, self.bin, self.folder = Host("site"), Path(given.bin).resolve().parent / "tests/member", folder
        self.rights, self.members = read_rights(), []

    def start(self, cell, domain, partition):
        file = self.folder / f"cell_{cell}.yaml"
        file.write_text(f"name: cell\ndomain: {domain}\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\ncell: none.yaml\n"
                        f"network: {{interfaces: [127.0.0.1]{partition}}}\n")
        for name in sorted(RUNNING | {"dds_recorder"}):
            writes, reads = (sorted(topics) for topics in self.rights[name])
            if "*" in reads:
                reads = sorted({t for w, r in self.rights.values() for t in w | r} - {"*"})
            words = [self.bin, "--deployment", file, "--as", name]
            words += (["--writes", *writes] if writes else []) + (["--reads", *reads] if reads else [])
            member = subprocess.Popen(self.host.inside(words), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            member.writes, member.reads, member.cell = writes, reads, cell
            self.members.append(member)

    def whole(self):
        for member in self.members:
            member.stdin.write("?\n")
            member.stdin.flush()
        found = [int(member.stdout.readline()) for member in self.members]
        wanted = [sum(m.writes.count(t) for t in member.reads for m in self.members if m.cell == member.cell) +
                  sum(m.reads.count(t) for t in member.writes for m in self.members if m.cell == member.cell)
                  for member in self.members]
        return found == wanted

    def carried(self):
        line = next(line for line in self.host.run("cat", "/proc/net/dev").splitlines() if line.strip().startswith("lo:"))
        return int(line.split(":")[1].split()[8])

    def close(self):
        for member in self.members:
            member.stdin.close()
        for member in self.members:
            member.wait()
        self.host.close()


def discovery_line(given, folder, cells, together):
    network = Network(given, folder)
    try:
        begun = time.monotonic()
        for cell in range(cells):
            network.start(cell, 76 if together else 76 + cell, f", partition: cell_{cell}" if together else "")
        for member in network.members:
            assert member.stdout.readline() == "up\n"
        eventually(network.whole, 300, "all have found each other")
        found_s, joining = time.monotonic() - begun, network.carried()
        time.sleep(5)  # what is under way
        steady, since = network.carried(), time.monotonic()
        time.sleep(10)
        each_s = (network.carried() - steady) / (time.monotonic() - since)
        return [str(cells), "one" if together else "one each", str(len(network.members)), f"{joining / 1e6:.2f}",
                f"{joining / len(network.members) / 1e3:.0f}", f"{each_s / 1e3:.1f}", f"{found_s:.1f}"]
    finally:
        network.close()


def discovery(given):
    import tempfile
    with tempfile.TemporaryDirectory() as folder:
        rows = [discovery_line(given, Path(folder), cells, together) for together in (True, False) for cells in given.cells]
    return table(["cells", "domains", "participants", "until all are found, MB", "kB for each participant", "afterwards, kB/s", "s"], rows)


def put_into_page(name, measured):
    text = PAGE.read_text()
    begin = f"<!-- table: scripts/scale {name} -->\n"
    before, rest = text.split(begin)
    PAGE.write_text(before + begin + measured + rest[rest.index("<!-- /table -->"):])


TABLES = {"loop": loop, "wire": wire, "discovery": discovery}


def main():
    arguments = argparse.ArgumentParser(
        prog="scale", usage="scale [loop] [wire] [discovery] [options]", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("tables", nargs="*", choices=[[], *TABLES], metavar="table")
    arguments.add_argument("--bin", default=SOURCE / "build/release/bin")
    arguments.add_argument("--onlookers", nargs="+", type=int, default=[0, 1, 5, 20])
    arguments.add_argument("--cells", nargs="+", type=int, default=[1, 2, 4, 8])
    arguments.add_argument("--write", action="store_true")
    arguments.add_argument("--seconds", type=int, default=30)
    given = arguments.parse_args()
    try:
        need_rights()
    except SystemExit as end:
        sys.exit(3 if end.code == SKIPPED else end.code)
    for name in given.tables or TABLES:
        measured = f"{machine()}\n\n"
        measured += TABLES[name](given)
        print(f"{name}: {measured}", flush=True)
        if given.write:
            put_into_page(name, measured)


if __name__ == "__main__":
    main()
