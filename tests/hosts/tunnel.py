"""WireGuard between the hosts of a test, by the files that deploy/security/tunnel makes, brought up by wg-quick as on a real host; where
the kernel has no WireGuard, by its implementation in userspace."""
import contextlib
import os
import subprocess
from pathlib import Path

from hosts import need

TOOL = Path(__file__).resolve().parents[2] / "deploy/security/tunnel"


def make(*words):
    return subprocess.run([TOOL, *map(str, words)], capture_output=True, text=True)


class Tunnel:
    def __init__(self, hosts, addresses, folder):
        """`addresses`: by which the hosts reach each other without it."""
        need("wg", "wg-quick", "wireguard-go", "nft")
        done = make("make", folder, *(f"{name}={address}" for name, address in addresses.items()))
        assert done.returncode == 0, done.stderr
        self.hosts, self.log = hosts, folder.parent / "tunnel.log"
        self.inner = {name: f"10.80.0.{i + 1}" for i, name in enumerate(addresses)}
        for name in hosts:
            self._on(name, "mount", "--bind", folder / name, "/etc/wireguard")
            self._on(name, "mkdir", "-p", "/run/wireguard")
            self._on(name, "mount", "-t", "tmpfs", "tmpfs", "/run/wireguard")
            self.up(name)

    def _on(self, name, *words):
        """In the host's namespaces, with this machine's programs. What they print goes to a file: the process that wg-quick leaves holds it open."""
        with open(self.log, "a") as log:
            done = subprocess.run(self.hosts[name].inside(words, own_root=False), stdout=log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                                  env={**os.environ, "WG_QUICK_USERSPACE_IMPLEMENTATION": "wireguard-go", "LOG_LEVEL": "error"})
        assert done.returncode == 0, f"{name}: {' '.join(map(str, words))}: ends with {done.returncode}"

    def up(self, name):
        self._on(name, "wg-quick", "up", "phantom0")

    def check(self, name):
        return subprocess.run(self.hosts[name].inside([TOOL, "check", "/etc/wireguard"], own_root=False), capture_output=True, text=True)

    def die(self, name):
        """Its process is killed, and its interface gone with it."""
        for process in self._processes(name):
            os.kill(process, 9)
        with contextlib.suppress(AssertionError):  # of a kernel that has it there is no process
            self._on(name, "ip", "link", "del", "phantom0")
        self._on(name, "sh", "-c", "rm -f /run/wireguard/*")

    def _processes(self, name):
        network = os.readlink(f"/proc/{self.hosts[name].pid}/ns/net")
        for folder in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                if (folder / "comm").read_text().strip() == "wireguard-go" and os.readlink(folder / "ns/net") == network:
                    yield int(folder.name)

    def close(self):
        for name in self.hosts:
            self.die(name)
