"""A haptic host and a host of onlookers on one cable: the loop that must not be disturbed, and those who might."""
import json
import os
import shutil
import tempfile
import time
from pathlib import Path

from hosts import Host, eventually, run

SOURCE = Path(__file__).resolve().parents[2]
ADDRESSES = {"haptic": "10.50.0.1", "onlookers": "10.50.0.2"}
LOOP = ("wva_server", "slave_io", "phantom_sensing", "master_io")
START_S = 150  # limits only bound a failing test
TICKS_PER_S = os.sysconf("SC_CLK_TCK")


class HapticSite:
    def __init__(self, binaries, domain=76):
        self.bin = Path(binaries).resolve()
        self.folder = Path(tempfile.mkdtemp(prefix="phantom_haptic_"))
        self.hosts = {name: Host(name) for name in ADDRESSES}
        run("ip", "link", "add", "eth0", "netns", str(self.hosts["haptic"].pid), "type", "veth", "peer", "name", "eth0", "netns",
            str(self.hosts["onlookers"].pid))
        for name, host in self.hosts.items():
            host.run("ip", "addr", "add", ADDRESSES[name] + "/24", "dev", "eth0")
            host.run("ip", "link", "set", "eth0", "up")
            host.run("ip", "route", "add", "default", "dev", "eth0")
        for host in self.hosts.values():
            eventually(lambda: " state UP " in host.run("ip", "-o", "link", "show", "eth0"), what="the interface is up")
        processes = "".join(f"      - {{component: {name}, simulation: {str(name in ('slave_io', 'master_io')).lower()}}}\n" for name in LOOP)
        self.topology = self.folder / "topology.yaml"
        self.topology.write_text(
            f"name: haptic_site\ndomain: {domain}\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\n"
            f"cell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\nhosts:\n"
            f"  - name: haptic\n    interfaces: [{ADDRESSES['haptic']}]\n    processes:\n{processes}"
            f"  - {{name: onlookers, interfaces: [{ADDRESSES['onlookers']}]}}\n")
        self.viewer = self.folder / "viewer.yaml"
        self.viewer.write_text("page: {port: 0}\n")
        self.count = 0

    def words(self, program, *rest):
        return [self.bin / program, "--deployment", self.topology, *rest]

    def start_loop(self, name, seconds=0):
        """The haptic host's session; returns it once all its components are ready. Its report is in folder/name."""
        session = self.hosts["haptic"].start(
            self.words("phantom_session", "--seconds", seconds, "--report-dir", self.folder / name), self.folder / f"{name}.log")

        def ready():
            assert session.poll() is None, f"the session ended with {session.returncode}"
            return "All components are ready" in session.log.read_text()
        eventually(ready, START_S, "the loop is ready")
        return session

    def report(self, name):
        return json.loads((self.folder / name / "summary.json").read_text())

    def onlooker(self, kind, host="onlookers", nice=10):
        """A spy that reads every topic, a recorder of every topic, or a viewer; with the niceness of the shipped topologies."""
        self.count += 1
        name = f"{kind}_{self.count}"
        words = {"spy": self.words("dds_spy", "hz", "--json", "--seconds", "0"),
                 "recorder": self.words("dds_recorder", "record", "--folder", self.folder / name),
                 "viewer": self.words("synthetic_viewer", "--config", self.viewer)}[kind]
        return self.hosts[host].start(["nice", "-n", nice, *words], self.folder / f"{name}.log")

    def counters(self, host="haptic", interface="eth0"):
        """Octets and packets that an interface has received and sent, with their frames' heads."""
        for line in self.hosts[host].run("cat", "/proc/net/dev").splitlines():
            if line.strip().startswith(interface + ":"):
                numbers = line.split(":")[1].split()
                return {"in": int(numbers[0]), "in_packets": int(numbers[1]), "out": int(numbers[8]), "out_packets": int(numbers[9])}
        raise AssertionError(f"{host} has no {interface}")

    def close(self):
        for host in self.hosts.values():
            host.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def children(pid):
    """Processes that this one started: executable's name → pid."""
    found = {}
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text().split():
            found[Path(f"/proc/{child}/exe").resolve().name] = int(child)
    return found


def cpu_s(pid):
    """Processor time that a process has used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


class Meter:
    """What processes use of a processor, and what goes over the cable, from start() to stop()."""

    def __init__(self, site, processes):
        self.site, self.processes = site, processes

    def start(self):
        self.begun = time.monotonic()
        self.cpu = {name: cpu_s(pid) for name, pid in self.processes.items()}
        self.wire = self.site.counters()
        return self

    def stop(self):
        cpu = {name: cpu_s(pid) - self.cpu[name] for name, pid in self.processes.items()}
        wire = {name: value - self.wire[name] for name, value in self.site.counters().items()}
        seconds = time.monotonic() - self.begun
        return ({name: used / seconds for name, used in cpu.items()}, {name: value / seconds for name, value in wire.items()}, seconds)
