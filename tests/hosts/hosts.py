"""Hosts of a test's own: network namespaces (with a /dev/shm, a name and a state folder of their own) on routed subnets without multicast.

Nothing of it is left behind: namespaces, interfaces and processes end with the test, however it ends.
"""
import argparse
import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

SKIPPED = 77  # what CTest takes for "not run" (SKIP_RETURN_CODE)


def hot_cell_topology(folder, name, domain, addresses):
    """Writes a topology of the shipped hot cell on these hosts (name: address) into the folder; returns its file."""
    source, file = Path(__file__).resolve().parents[2], folder / "topology.yaml"
    hosts = "".join(f"  - {{name: {host}, interfaces: [{address}]}}\n" for host, address in addresses.items())
    file.write_text(f"name: {name}\ndomain: {domain}\nqos_profiles: {source}/deploy/qos/phantom.xml\ncell: {source}/deploy/cells/hot_cell/cell.yaml\n"
                    f"network:\n  participants_per_host: 8\n  initial_peers: [{', '.join(addresses.values())}]\nhosts:\n{hosts}")
    return file


def skip(why):
    print(f"skipped: {why}")
    sys.exit(SKIPPED)


def need(*tools):
    for tool in tools:
        if shutil.which(tool) is None:
            skip(f"{tool} is missing; scripts/setup installs it")


def need_rights():
    need("ip", "unshare", "nsenter")
    probe = subprocess.run(["unshare", "--net", "--mount", "--uts", "sh", "-c", "mount -t tmpfs tmpfs /dev/shm && ip link set lo up"],
                           capture_output=True, text=True)
    if probe.returncode != 0:
        skip("network namespaces need the rights of root: " + probe.stderr.strip())


def given_paths(*names, mode=None):
    """The command line of a test that is given nothing but paths ("--bin") and, first, one of the words in `mode`."""
    arguments = argparse.ArgumentParser()
    if mode:
        arguments.add_argument("mode", choices=mode)
    for name in names:
        arguments.add_argument("--" + name, required=True, type=lambda path: Path(path).resolve())
    return arguments.parse_args()


@contextlib.contextmanager
def telling_logs(folder, lines=12):
    """If what is within fails, the last lines of every log in `folder` are told."""
    try:
        yield
    except BaseException:
        for log in sorted(Path(folder).rglob("*.log")):
            print(f"--- {log.name}", *log.read_text(errors="replace").splitlines()[-lines:], sep="\n", file=sys.stderr)
        raise


# Of a host in a topology: whoever starts them there, both arms are simulated.
SIMULATED_ARMS = "processes: [{component: slave_io, simulation: true}, {component: master_io, simulation: true}]"


def run(*words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(words)}: {done.stderr.strip()}")
    return done.stdout


def own_mib(pid):
    """The memory of a process, in MiB, without what it maps of files: the kernel drops parts of libraries that are not run for a while, and reads
    them again. A viewer grew by 60 MiB by that, and by nothing of its own."""
    fields = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines() if ":" in line)
    return sum(int(fields[name].split()[0]) for name in ("RssAnon", "RssShmem", "VmSwap")) / 1024


def eventually(probe, limit_s=60.0, what="the condition"):
    """Waits until probe() is true; the limit only bounds a failing test."""
    end = time.monotonic() + limit_s
    while True:
        value = probe()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError(f"{what}: not within {limit_s:.0f} s")
        time.sleep(0.05)


class Host:
    """One machine, as far as the network, shared memory and the host name are concerned; with `root` of another release of Debian."""

    def __init__(self, name, root=None):
        self.name, self.root = name, root
        script = f"mount -t tmpfs tmpfs /dev/shm; hostname {name}; ip link set lo up; echo up; exec cat"
        self.holder = subprocess.Popen(["unshare", "--net", "--mount", "--uts", "sh", "-c", script],
                                       stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if self.holder.stdout.readline() != "up\n":
            raise RuntimeError(f"{name}: no namespace")
        self.pid = self.holder.pid
        self.processes = []
        # What outlives its processes (a stop in force) is this host's own, and ends with it.
        self.state = tempfile.mkdtemp(prefix=f"phantom_state_{name}_")
        self.environment = {**os.environ, "PHANTOM_STATE_DIR": self.state}

    def inside(self, words, own_root=True):
        within = ["chroot", str(self.root)] if self.root and own_root else []
        return ["nsenter", "-t", str(self.pid), "-n", "-m", "-u", "--", "setpriv", "--pdeathsig", "TERM", "--", *within, *map(str, words)]

    def run(self, *words):
        return run(*self.inside(words))

    def try_run(self, *words, limit_s=60):
        return subprocess.run(self.inside(words), capture_output=True, text=True, timeout=limit_s, env=self.environment)

    def start(self, words, log):
        process = subprocess.Popen(self.inside(words), stdout=open(log, "w"), stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                                   env=self.environment)
        process.log = Path(log)
        self.processes.append(process)
        return process

    def watch(self, words, log, keep=None):
        watch = Watch(self.inside(words), log, keep)
        self.processes.append(watch.process)
        return watch

    def close(self):
        for process in reversed(self.processes):
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for process in self.processes:
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.holder.stdin.close()
        self.holder.wait()
        shutil.rmtree(self.state, ignore_errors=True)


class Watch:
    """A program that prints a JSON object a line; the newest of every kind is kept."""

    def __init__(self, words, log, keep):
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=open(log, "w"), stdin=subprocess.DEVNULL, text=True)
        self.newest, self.count, self.lock = {}, {}, threading.Lock()
        self.keep = keep or (lambda line: line.get("topic"))
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for text in self.process.stdout:
            try:
                line = json.loads(text)
            except ValueError:
                continue
            with self.lock:
                key = self.keep(line)
                self.newest[key] = line.get("sample", line)
                self.count[key] = self.count.get(key, 0) + 1

    def get(self, key):
        with self.lock:
            return self.newest.get(key)

    def counted(self, key):
        with self.lock:
            return self.count.get(key, 0)


class Cable:
    """A bad cable between two interfaces of a host; see cable.cpp."""

    def __init__(self, host, executable, a, b):
        self.process = subprocess.Popen(host.inside([executable, a, b]), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if self.process.stdout.readline() != "ok\n":
            raise RuntimeError("the cable does not run")

    def tell(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        word, carried, lost = self.process.stdout.readline().split()
        assert word == "ok", line
        return int(carried), int(lost)

    def set(self, loss=0.0, delay_ms=0.0, jitter_ms=0.0, repeated=0.0):
        return self.tell(f"set {loss} {delay_ms} {jitter_ms} {repeated}")

    def cut(self, lost=""):
        """Both ways; or `lost` is "from" (what the host sends) or "to" (what is sent to it)."""
        return self.tell({"": "cut", "to": "cut a", "from": "cut b"}[lost])

    def heal(self):
        return self.tell("heal")

    def lose_fragments(self, lost):
        """Fragments of IP packets, as many firewalls and tunnels do."""
        return self.tell("fragments lost" if lost else "fragments passed")

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class Site:
    """Hosts on subnets of their own around a router that forwards no multicast; those in `cables` by a cable that can be bad."""

    def __init__(self, addresses, cable_executable=None, cables=()):
        self.router = Host("router")
        self.router.run("sysctl", "-qw", "net.ipv4.ip_forward=1")
        self.hosts, self.cables = {}, {}
        for name, address in addresses.items():
            host = Host(name)
            self.hosts[name] = host
            gateway = address.rsplit(".", 1)[0] + ".1"
            short = name[:6]
            self._pair(self.router, f"r_{short}", host, "eth0", name in cables)
            if name in cables:
                self._pair(self.router, f"r_{short}", self.router, f"b_{short}", False)
                self.cables[name] = Cable(self.router, cable_executable, f"b_{short}", f"c_{short}")
            self.router.run("ip", "addr", "add", gateway + "/24", "dev", f"r_{short}")
            host.run("ip", "addr", "add", address + "/24", "dev", "eth0")
            host.run("ip", "route", "add", "default", "via", gateway)
        for host in self.hosts.values():  # as network-online.target waits
            eventually(lambda: " state UP " in host.run("ip", "-o", "link", "show", "eth0"), what="the interface is up")

    @staticmethod
    def _pair(one, one_name, other, other_name, to_cable):
        if to_cable:
            one_name = "c" + one_name[1:]
        run("ip", "link", "add", one_name, "netns", str(one.pid), "type", "veth", "peer", "name", other_name, "netns", str(other.pid))
        one.run("ip", "link", "set", one_name, "up")
        other.run("ip", "link", "set", other_name, "up")

    def __getitem__(self, name):
        return self.hosts[name]

    def close(self):
        for host in reversed(list(self.hosts.values())):
            host.close()
        for cable in self.cables.values():
            cable.close()
        self.router.close()


def connected(addresses, roots=None):
    """Two hosts and one network between them, that carries multicast; `roots`: of those that have another release."""
    hosts = {name: Host(name, (roots or {}).get(name)) for name in addresses}
    one, other = hosts.values()
    run("ip", "link", "add", "eth0", "netns", str(one.pid), "type", "veth", "peer", "name", "eth0", "netns", str(other.pid))
    for name, address in addresses.items():
        hosts[name].run("ip", "addr", "add", address + "/24", "dev", "eth0")
        hosts[name].run("ip", "link", "set", "eth0", "up")
        hosts[name].run("ip", "route", "add", "default", "dev", "eth0")
    for host in hosts.values():  # as network-online.target waits
        eventually(lambda: " state UP " in host.run("ip", "-o", "link", "show", "eth0"), what="the interface is up")
    return hosts
