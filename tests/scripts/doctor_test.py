#!/usr/bin/env python3
"""scripts/doctor on hosts made of files: a healthy one, then each fault alone, named with what to do."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
DOCTOR = SOURCE / "scripts/doctor"
LIMITS = "Limit                     Soft Limit           Hard Limit           Units\n" \
         "Max locked memory         {lock:<20} unlimited            bytes\nMax realtime priority     {rt:<20} 99\n"
ADDRESSES = "1: lo    inet 127.0.0.1/8 scope host lo\n2: eth0    inet 10.30.1.2/24 brd 10.30.1.255 scope global eth0\n"
HEALTHY = {
    "commands/chronyc": "A,10.0.0.1,2,1700000000.0,0.000012,0.00001,0.00002,1,0,0.1,0.01,0.001,64,Normal",
    "commands/ip": ADDRESSES,
    "proc/sys/net/core/rmem_max": "4194304",
    "proc/sys/net/core/wmem_max": "4194304",
    "proc/sys/kernel/sched_rt_runtime_us": "950000",
    "proc/sys/kernel/sched_rt_period_us": "1000000",
    "proc/self/limits": LIMITS.format(lock="unlimited", rt="99"),
    "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor": "performance",
    "sys/class/net/eth0/operstate": "up",
    "sys/class/net/eth0/type": "1",
    str(SOURCE / "deploy/qos/phantom.xml").lstrip("/"): "<dds/>",
}
TOPOLOGY = "name: t\ndomain: 1\nqos_profiles: q.xml\ncell: c.yaml\nnetwork: {}\n" \
           "hosts:\n- {name: master, interfaces: [%s], processes: [{component: slave_io, config: slave.yaml}]}\n"


class Doctor(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name)

    def look(self, changes=None, topology=None, mode=None):
        """On a healthy host with some files changed (None: not there), these of that mode: exit code and findings by check."""
        for name, text in {**HEALTHY, **(changes or {})}.items():
            path = self.root / name
            if text is None:
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            if mode is not None and name in (changes or {}):
                path.chmod(mode)
        words = [DOCTOR, "--json", "--root", self.root]
        if topology:
            (self.root / "t.yaml").write_text(topology)
            (self.root / "q.xml").write_text("<dds/>")
            words += ["--topology", self.root / "t.yaml"]
        done = subprocess.run(words, capture_output=True, text=True)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        told = json.loads(done.stdout)
        self.assertEqual(told["healthy"], done.returncode == 0)
        return done.returncode, {f["check"]: f for f in told["findings"]}

    def finds(self, check, level, words, changes, topology=None, mode=None):
        code, found = self.look(changes, topology, mode)
        self.assertEqual(found[check]["level"], level, found[check])
        self.assertIn(words, found[check]["says"] + " → " + found[check]["do"])
        self.assertEqual(code, 1 if level == "bad" else 0)
        self.assertTrue(found[check]["do"], "it says what to do")
        others = {name: f for name, f in found.items() if name != check and f["level"] in ("bad", "warning")}
        self.assertEqual(others, {}, "nothing else is blamed")

    def test_a_healthy_host_has_nothing_to_do(self):
        code, found = self.look()
        self.assertEqual(code, 0)
        self.assertEqual({f["level"] for f in found.values()}, {"good"}, found)
        self.assertEqual(len(found), 10)

    def test_clock_not_synchronised(self):
        self.finds("clock", "warning", "apt-get install chrony", {"commands/chronyc": ""})

    def test_clock_far_off(self):
        off = HEALTHY["commands/chronyc"].replace("0.000012", "-0.250")
        self.finds("clock", "warning", "chrony is 250.0 ms off", {"commands/chronyc": off})

    def test_socket_buffers_too_small(self):
        self.finds("socket buffers", "bad", "net.core.rmem_max is 212992", {"proc/sys/net/core/rmem_max": "212992"})

    def test_no_real_time_rights(self):
        self.finds("real-time priority", "warning", "LimitRTPRIO", {"proc/self/limits": LIMITS.format(lock="unlimited", rt="0")})

    def test_no_right_to_lock_memory(self):
        self.finds("memory lock", "warning", "only 8 MiB", {"proc/self/limits": LIMITS.format(lock=8 << 20, rt="99")})

    def test_processor_that_changes_its_clock(self):
        self.finds("processor clock", "warning", "governor powersave",
                   {"sys/devices/system/cpu/cpu0/cpufreq/scaling_governor": "powersave"})

    def test_can_bus_down(self):
        self.finds("CAN", "warning", "80-phantom-can.network says how",
                   {"sys/class/net/can0/type": "280", "sys/class/net/can0/operstate": "down"})

    def test_can_bus_that_the_topology_needs(self):
        self.finds("CAN", "bad", "can1 is not there", {"slave.yaml": "can:\n  buses: [can1]   # not can7\n"}, TOPOLOGY % "10.30.1.2")

    def test_a_host_of_the_topology_is_recognised(self):
        _, found = self.look(topology=TOPOLOGY % "10.30.1.2")
        self.assertIn("this is host master", found["interfaces"]["says"])
        self.assertEqual(found["security"]["level"], "note")

    def test_none_of_the_topologys_hosts(self):
        self.finds("interfaces", "bad", "master: 192.0.2.9", {}, TOPOLOGY % "192.0.2.9")

    def test_interface_down(self):
        for state in ("down", "lowerlayerdown", "dormant"):
            self.finds("interfaces", "bad", "ip link set eth0 up", {"sys/class/net/eth0/operstate": state}, TOPOLOGY % "10.30.1.2")

    def test_interface_that_tells_no_state_has_a_link(self):
        _, found = self.look({"sys/class/net/eth0/operstate": "unknown"}, TOPOLOGY % "10.30.1.2")
        self.assertEqual(found["interfaces"]["level"], "good")

    def test_a_tunnel_secures_a_topology_that_names_its_addresses(self):
        topology = TOPOLOGY % "10.80.0.1"
        tunnel = {"commands/ip": ADDRESSES + "3: phantom0    inet 10.80.0.1/24 scope global phantom0\n", "sys/class/net/phantom0/operstate": "unknown",
                  "commands/wg": "phantom0"}
        _, found = self.look(tunnel, topology)
        self.assertEqual(found["security"]["level"], "good")
        self.assertIn("through the tunnel phantom0", found["security"]["says"])
        for beside in (TOPOLOGY % "10.30.1.2", TOPOLOGY % "10.80.0.1, 10.30.1.2"):
            self.assertEqual(self.look(tunnel, beside)[1]["security"]["level"], "note", beside)

    TWO = TOPOLOGY % "10.30.1.2" + "- {name: slave, interfaces: [10.30.2.2]}\n"

    def test_packets_get_to_the_other_hosts(self):
        small, fragments = "10.30.2.2 84\n", "10.30.2.2 16028\n"
        self.assertEqual(self.look({"commands/echo": small + fragments}, self.TWO)[1]["packets"]["level"], "good")
        self.finds("packets", "bad", "fragments of IP do not get to slave (10.30.2.2)", {"commands/echo": small}, self.TWO)
        self.finds("packets", "note", "slave (10.30.2.2) answers no echo request", {"commands/echo": ""}, self.TWO)

    def test_clocks_of_hosts_that_differ(self):
        def status(component, figure, seconds):
            sample = {"component_name": component, "figures": [{"name": "simulated", "value": 1}, {"name": figure, "value": seconds}]}
            return json.dumps({"topic": "component_status", "sample": sample}) + "\n"
        near = status("slave_io", "clock_ahead_of_master_io", 0.1)
        topology = TOPOLOGY % "10.30.1.2"
        self.assertEqual(self.look({"commands/dds_spy": near}, topology)[1]["clocks of hosts"]["level"], "good")
        self.finds("clocks of hosts", "warning", "clocks differ by 5.0 s: master_io's host is behind slave_io's",
                   {"commands/dds_spy": near + status("master_io", "clock_ahead_of_slave_io", -5.0) + "no JSON\n"}, topology)

    def test_documents_that_end_soon_are_a_warning(self):
        if shutil.which("openssl") is None:
            self.skipTest("openssl is missing")
        topology = (TOPOLOGY % "10.30.1.2").replace("network: {}", "network: {security: keys}")
        rights = self.root / "rights"
        rights.write_text("slave_io | slave_state | *\n")
        make = [SOURCE / "deploy/security/make", "site", self.root / "keys", "--rights", rights]
        subprocess.run([*make, "--days", "20"], check=True, capture_output=True)
        self.look({}, topology)  # makes the tree
        shutil.copytree(self.root / "keys", self.root / str(self.root).lstrip("/") / "keys")
        self.finds("security", "warning", "ends on", {}, topology)

    def test_security_without_documents(self):
        topology = (TOPOLOGY % "10.30.1.2").replace("network: {}", "network: {security: keys}")
        self.finds("security", "bad", "bring this host its own", {}, topology)

    def test_shared_memory_of_others(self):
        files = {"dev/shm/fastrtps_b51d3c8caa46dd1f": "", "dev/shm/sem.fastrtps_port7410_mutex": "", "dev/shm/of_something_else": ""}
        self.finds("shared memory", "note", "2 files of DDS in /dev/shm, as fastrtps_b51d3c8caa46dd1f of ", files, mode=0o600)
        self.finds("shared memory", "note", "of other programs or of an older version", files, mode=0o640)

    def test_shared_memory_that_every_account_may_open(self):
        for name in ("fastrtps_port7411", "fastdds_port7411", "fast_datasharing_01.0f.aa"):
            self.finds("shared memory", "warning", "0666: of other programs or of an older version of Phantom, and every account",
                       {f"dev/shm/{name}": ""}, mode=0o666)
            (self.root / f"dev/shm/{name}").unlink()

    def test_shared_memory_of_an_older_version(self):
        accounts = f"root:x:99:0::/:/bin/sh\nphantom-slave-io:x:{os.getuid()}:999::/var/lib/phantom:/usr/sbin/nologin\n"
        self.finds("shared memory", "warning", "of phantom-slave-io, mode 0600: of an older version of Phantom; this one uses UDP alone",
                   {"dev/shm/fastdds_0a1b2c3d": "", "etc/passwd": accounts}, mode=0o600)

    def test_wrong_arguments_and_topologies(self):
        for words in (["--nonsense"], ["--topology", "/nonexistent.yaml"], ["--topology", str(DOCTOR)]):
            done = subprocess.run([DOCTOR, *words], capture_output=True, text=True)
            self.assertEqual(done.returncode, 2, done)

    def test_this_host_can_be_looked_at(self):
        done = subprocess.run([DOCTOR], capture_output=True, text=True)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        self.assertIn("socket buffers", done.stdout)


if __name__ == "__main__":
    unittest.main()
