#!/usr/bin/env python3
"""deploy/security/tunnel: what it makes joins two hosts, and a stranger on the path between them sees nothing and gets nothing in.

tunnel_test.py --build DIR
"""
import json
import shutil
import subprocess
import tempfile
from pathlib import Path

from every_topic import BRICKS, Every, every_topic_goes, receives_everything
from hosts import Site, eventually, given_paths, need_rights, telling_logs
from tunnel import Tunnel, make

ADDRESSES = {"master": "10.70.1.2", "slave": "10.70.2.2"}
HERE = Path(__file__).resolve().parent
PORT = 51820
# By which a stranger's datagram is followed by one that must arrive: what was sent before it has come by then, or never will.
MARK = "this is the end: "


class Tunnelled:
    """Two hosts, with a router between them that is not to be trusted."""

    def __init__(self, build):
        self.folder = Path(tempfile.mkdtemp(prefix="phantom_tunnel_"))
        self.site = Site(ADDRESSES)
        self.hosts, self.router = self.site.hosts, self.site.router
        self.tunnel = Tunnel(self.hosts, ADDRESSES, self.folder / "tunnel")
        self.programs = {name: build / "tests" for name in self.hosts}
        inner = self.tunnel.inner
        hosts = "".join(f"  - {{name: {name}, interfaces: [{address}]}}\n" for name, address in inner.items())
        source = HERE.parents[1]
        self.topology = self.folder / "topology.yaml"
        self.topology.write_text(f"name: tunnel\ndomain: 42\nqos_profiles: {source}/deploy/qos/phantom.xml\ncell: {source}/deploy/cells/hot_cell/cell.yaml\n"
                                 f"network:\n  participants_per_host: 8\n  initial_peers: [{', '.join(inner.values())}]\nhosts:\n{hosts}")
        # The router knows where to send what is for an address within the tunnel.
        for name, address in inner.items():
            self.router.run("ip", "route", "add", address, "via", ADDRESSES[name])

    def forge(self, source, target, text):
        self.router.run("python3", HERE / "on_the_cable.py", "forge", source, target, "7000", text)

    def send(self, name, target, text):
        self.hosts[name].run("python3", HERE / "on_the_cable.py", "send", target, "7000", text)

    def close(self):
        self.tunnel.close()
        self.site.close()
        shutil.rmtree(self.folder, ignore_errors=True)


class Watched:
    """What goes by at the router, to and from the master's host."""

    def __init__(self, site):
        self.site = site
        self.process = subprocess.Popen(site.router.inside(["python3", HERE / "on_the_cable.py", "watch", "r_master", MARK]), stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "up\n"

    def seen(self):
        self.site.send("slave", ADDRESSES["master"], MARK)
        return json.loads(self.process.communicate(timeout=60)[0])


def arguments_are_checked():
    with tempfile.TemporaryDirectory() as folder:
        for words in (["nonsense", folder], ["make", f"{folder}/a", "one=10.0.0.1"], ["make", f"{folder}/a", "one=10.0.0.1", "one=10.0.0.2"],
                      ["make", f"{folder}/a", "one", "two"], ["make", f"{folder}/a", "one=1.1.1.1", "two=1.1.1.2", "--network", "10.80.0.1"],
                      ["make", f"{folder}/a", "one=1.1.1.1", "two=1.1.1.2", "--network", "10.800.0.0"], ["make", f"{folder}/a", "one=1.1.1.1", "two=1.1.1.2", "--port", "0"],
                      ["make", f"{folder}/a", "o/ne=1.1.1.1", "two=1.1.1.2"], ["make", f"{folder}/a", "one=1.1.1.1", "two=1.1.1.2", "--interface", "../x"]):
            done = make(*words)
            assert done.returncode == 2 and done.stderr.startswith("tunnel: "), f"{words}: {done.returncode} {done.stderr}"
            assert not list(Path(folder).iterdir()), f"{words} left something"
        made = make("make", f"{folder}/site", "a=10.0.0.1", "b=10.0.0.2", "c=gate.example.org")
        assert made.returncode == 0, made.stderr
        assert make("make", f"{folder}/site", "a=10.0.0.1", "b=10.0.0.2").returncode == 2, "made twice"
        files = sorted(Path(folder, "site").rglob("phantom0.conf"))
        assert len(files) == 3 and all(file.stat().st_mode & 0o077 == 0 for file in files), "keys are for their owner"
        keys = [line for file in files for line in file.read_text().splitlines() if line.startswith("PrivateKey")]
        assert len(set(keys)) == 3
        shared = [line for file in files for line in file.read_text().splitlines() if line.startswith("PresharedKey")]
        assert len(shared) == 6 and len(set(shared)) == 3, "one for each pair"
    print("arguments are checked; each host has a key of its own, and one that it shares with each other host")


def nothing_is_seen(site):
    watched = Watched(site)
    every_topic_goes(site, "master", "slave")
    every_topic_goes(site, "slave", "master")
    seen = watched.seen()
    assert seen["frames"] > 1000 and seen["clear"] == 0 and seen["udp_ports"] == [PORT], f"on the cable: {seen}"
    watched = Watched(site)
    site.send("slave", ADDRESSES["master"], "RTPS")
    assert watched.seen()["clear"] > 0, "who watches would see what goes in the clear"
    print(f"a stranger on the path saw {seen['frames']} frames, all of the tunnel")


def nothing_gets_in(site):
    inner = site.tunnel.inner
    heard = site.hosts["master"].watch(["python3", HERE / "on_the_cable.py", "listen", inner["master"], "7000"], site.folder / "listen.log")
    eventually(lambda: heard.counted("up"), what="a listener")

    def sends(as_whom, what):
        site.forge(as_whom, inner["master"], what)
        site.send("slave", inner["master"], MARK + what)
        eventually(lambda: heard.counted(MARK + what), what="what was sent through the tunnel")
    sends(inner["slave"], "in another's name")
    sends("10.70.1.1", "in his own name")
    assert not heard.counted("in another's name") and not heard.counted("in his own name"), "a stranger's datagram came in"
    site.hosts["master"].run("nft", "delete", "table", "inet", "phantom0")
    checked = site.tunnel.check("master")
    assert checked.returncode == 1 and "its firewall is not in force" in checked.stdout, checked.stdout
    sends("10.70.1.1", "without the firewall")
    eventually(lambda: heard.counted("without the firewall"), what="a stranger's datagram where there is no firewall")
    site.hosts["master"].run("nft", "-f", "/etc/wireguard/phantom0.nft")
    sends("10.70.1.1", "with the firewall again")
    assert not heard.counted("with the firewall again")
    print("what a stranger sends to addresses within the tunnel does not arrive")


def a_dead_tunnel_sends_nothing_in_the_clear(site):
    """While it is down nothing arrives and nothing is seen; up again, all is as before without a restart."""
    sender, receiver = Every(site, "master", "send"), Every(site, "slave", "receive")
    receives_everything(receiver, sender.told())
    watched = Watched(site)
    site.tunnel.die("master")
    assert "is not up" in site.tunnel.check("master").stdout
    before = receiver.told()["samples"]
    sent = sender.told()
    site.send("master", site.tunnel.inner["slave"], "RTPS")
    seen = watched.seen()
    assert seen["clear"] == 0, f"on the cable: {seen}"
    site.tunnel.up("master")
    eventually(lambda: all(count > before[topic] for topic, count in receiver.told()["samples"].items() if topic in ("master_state", "slave_state")), 180,
               "samples through the tunnel that came back")
    assert receiver.told()["bricks"] == BRICKS and set(sent["cdr"]) == set(receiver.told()["cdr"])
    receiver.end()
    sender.end()
    assert site.tunnel.check("slave").returncode == 0, site.tunnel.check("slave").stdout
    print("the tunnel was killed: nothing went in the clear, and all goes on once it is back")


def main():
    given = given_paths("build")
    need_rights()
    site = Tunnelled(given.build)
    try:
        with telling_logs(site.folder):
            arguments_are_checked()
            nothing_is_seen(site)
            nothing_gets_in(site)
            a_dead_tunnel_sends_nothing_in_the_clear(site)
    finally:
        site.close()


if __name__ == "__main__":
    main()
