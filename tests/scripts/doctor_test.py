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
            for name in {"q.xml", "c.yaml", "slave.yaml"} - set(changes or {}):
                (self.root / name).write_text("")
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

    def refused(self, content, *more):
        """The one sentence about a topology with that text or these bytes, without "doctor: " and the folder."""
        file = self.root / "t.yaml"
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        for name in ("q.xml", "c.yaml"):
            (self.root / name).touch()
        done = subprocess.run([DOCTOR, "--root", self.root, "--topology", file, *more], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertTrue(done.stderr.startswith(f"doctor: {file}:"), done.stderr)
        return done.stderr.strip().removeprefix(f"doctor: {self.root}/")

    def test_files_that_are_no_topology(self):
        mapping = "t.yaml:1: the file must be a mapping of keys to values; it is "
        for content, sentence in (
                (TOPOLOGY.encode("utf-16"), "t.yaml:1: holds a byte that is no text; allowed: UTF-8"),
                (b"name: t\ndomain: \xff\n", "t.yaml:2: holds a byte that is no text; allowed: UTF-8"),
                ("- a\n", mapping + "a list"),
                ("hello\n", mapping + "'hello'"),
                ("", "t.yaml:1: name: is missing; allowed: a text"),
                ("# nothing\n", "t.yaml:1: name: is missing; allowed: a text"),
                ("name: t\n", "t.yaml:1: domain: is missing; allowed: 0 to 232"),
                ("a: [1\n", "t.yaml:2: not valid YAML: while parsing a flow sequence, expected ',' or ']', but got '<stream end>'"),
                ("name: t\nb: \0\n", "t.yaml:2: not valid YAML: special characters are not allowed"),
                ("a: " + "[" * 5000, "t.yaml: not valid YAML: lists or mappings lie too deep in each other"),
                ("a: &a [*a]\n", "t.yaml:1: a: unknown key; allowed: cell, domain, hosts, name, network, qos_profiles")):
            with self.subTest(content=content[:40]):
                self.assertEqual(self.refused(content), sentence)

    HEAD = "name: t\ndomain: 1\nqos_profiles: q.xml\ncell: c.yaml\n"

    def test_values_that_no_component_accepts(self):
        for text, sentence in (
                (self.HEAD.replace("1", "300"), "2: domain: '300' is out of range; allowed: 0 to 232"),
                (self.HEAD.replace("1", "abc"), "2: domain: 'abc' is not a number; allowed: 0 to 232"),
                (self.HEAD.replace("1", "1.5"), "2: domain: '1.5' is not a whole number; allowed: 0 to 232"),
                (self.HEAD.replace("1", "[1]"), "2: domain: is not a number; allowed: 0 to 232"),
                (self.HEAD.replace(" t", " [t]"), "1: name: is or holds a list; allowed: a text"),
                (self.HEAD + "nonsense: 3\n", "5: nonsense: unknown key; allowed: cell, domain, hosts, name, network, qos_profiles"),
                (self.HEAD + "domain: 1\n", "5: domain: stands twice; allowed: once"),
                (self.HEAD + "network: lo\n", "5: network: is 'lo'; allowed: a mapping"),
                (self.HEAD + "hosts: {name: a}\n", "5: hosts: is a mapping; allowed: a list of mappings"),
                (self.HEAD + "hosts: [a]\n", "5: hosts: holds 'a' at hosts[0]; allowed: mappings"),
                (self.HEAD + "hosts:\n- {processes: []}\n", "6: hosts[0].name: is missing; allowed: a text"),
                (self.HEAD + "hosts:\n- name: a\n  processes: [{component: b, nice: 20}]\n",
                 "7: hosts[0].processes[0].nice: '20' is out of range; allowed: -20 to 19"),
                (self.HEAD + "hosts:\n- name: a\n  processes: [{component: b, simulation: maybe}]\n",
                 "7: hosts[0].processes[0].simulation: 'maybe' is not true or false; allowed: one of these")):
            with self.subTest(sentence=sentence):
                self.assertEqual(self.refused(text), "t.yaml:" + sentence)

    def test_what_the_components_loader_asks_of_texts_in_its_words(self):
        loader = (SOURCE / "common/runtime/configuration/deployment.cpp").read_text()
        for text, place, sentence in (
                ("network: {initial_peers: [foo]}", "network.initial_peers: 'foo' ", "is no address; allowed: IPv4, as 10.0.1.2"),
                ("network: {interfaces: [127.0.0.300]}", "network.interfaces: '127.0.0.300' ", "is no address; allowed: IPv4, as 10.0.1.2"),
                ("network: {discovery_servers: ['10.0.1.2:70000']}", "network.discovery_servers: '10.0.1.2:70000' ",
                 "is no server; allowed: IPv4 address and port, as 10.0.1.2:11811"),
                ("network: {partition: 'cell_*'}", "network.partition: 'cell_*' ",
                 "is no name of a partition; allowed: 1 to 64 of A-Z a-z 0-9 _ - . /"),
                ("network: {discovery_servers: ['10.0.1.2:1'], security: k}", "network.discovery_servers: ",
                 "do not work together with security in this Fast DDS; allowed: initial_peers instead"),
                ("network: {discovery_servers: ['10.0.1.2:1'], initial_peers: [10.0.1.2]}", "network.discovery_servers: ",
                 "and initial_peers exclude each other; allowed: one of the two"),
                ("hosts: [{name: a, processes: [{component: b}, {component: b}]}]", "hosts[0].processes[1].component: 'b' ",
                 "is there already; allowed: each name once per host (key name)")):
            with self.subTest(sentence=sentence):
                self.assertEqual(self.refused(self.HEAD + text + "\n"), f"t.yaml:5: {place}{sentence}")
                self.assertIn(sentence, loader)

    def test_files_that_are_not_there(self):
        def missing(line, key, name):
            return f"t.yaml:{line}: {key}: '{name}' is not there ({self.root}/{name}); allowed: a file; relative paths begin at the topology's folder"
        one = "hosts:\n- name: a\n  processes:\n  - {component: slave_io, %s}\n"
        for text, sentence in (
                (self.HEAD.replace("q.xml", "no.xml"), missing(3, "qos_profiles", "no.xml")),
                (self.HEAD.replace("c.yaml", "no.yaml"), missing(4, "cell", "no.yaml")),
                (self.HEAD + one % "config: no.yaml", missing(8, "hosts[0].processes[0].config", "no.yaml")),
                (self.HEAD + one % "cell: no.yaml", missing(8, "hosts[0].processes[0].cell", "no.yaml")),
                (self.HEAD.replace("c.yaml", "."), f"t.yaml:4: cell: '.' is a folder ({self.root}); allowed: a file")):
            with self.subTest(sentence=sentence):
                self.assertEqual(self.refused(text), sentence)

    def test_parameters_of_another_host_may_be_there_alone(self):
        there = "- {name: slave, interfaces: [10.30.2.2], processes: [{component: slave_io, config: there.yaml}]}\n"
        self.assertEqual(self.look(topology=TOPOLOGY % "10.30.1.2" + there)[0], 0)
        self.assertIn("hosts[1].processes[0].config", self.refused(TOPOLOGY % "10.30.1.9" + there.replace("10.30.2.2", "10.30.1.2")))

    def test_a_topology_without_hosts_is_for_every_host(self):
        for hosts in ("", "hosts:\n", "hosts: []\n"):
            code, found = self.look(topology=self.HEAD + "network: {interfaces: [10.30.1.2]}\n" + hosts)
            self.assertEqual((code, found["interfaces"]["level"]), (0, "good"))
            self.assertEqual(found["interfaces"]["says"], "this is a host of t: 10.30.1.2")
        self.finds("interfaces", "bad", "every host: 192.0.2.9", {}, self.HEAD + "network: {interfaces: [192.0.2.9]}\n")
        self.assertEqual(self.look(topology=self.HEAD + "network:\n")[1]["interfaces"]["level"], "note")

    def test_shipped_topologies_are_read(self):
        for file in sorted((SOURCE / "deploy/topologies").glob("*.yaml")):
            done = subprocess.run([DOCTOR, "--root", self.root, "--topology", file], capture_output=True, text=True)
            self.assertIn(done.returncode, (0, 1), done.stderr)

    def test_the_installed_doctor_has_the_table_of_keys(self):
        doctor, table = self.root / "usr/bin/phantom-doctor", self.root / "usr/share/phantom/deploy/topology.yaml"
        module = self.root / "usr/share/phantom/scripts/topology_file.py"
        for file, source in ((doctor, DOCTOR), (table, SOURCE / "common/runtime/configuration/topology.yaml"),
                             (module, SOURCE / "scripts/topology_file.py")):
            file.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, file)
        topology = self.root / "t.yaml"
        topology.write_text("domain: 1\n")
        words = [doctor, "--topology", topology]
        done = subprocess.run(words, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (2, f"doctor: {topology}:1: name: is missing; allowed: a text\n"))
        table.unlink()
        done = subprocess.run(words, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (3, f"doctor: {table}: is not there; install phantom-common\n"))

    def test_this_host_can_be_looked_at(self):
        done = subprocess.run([DOCTOR], capture_output=True, text=True)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        self.assertIn("socket buffers", done.stdout)


if __name__ == "__main__":
    unittest.main()
