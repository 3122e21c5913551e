#!/usr/bin/env python3
"""A host whose interface is not there, or has no link: every program refuses in words instead of finding nobody.

interfaces_test.py --bin DIR
"""
import signal
import tempfile
from pathlib import Path

from hosts import Host, eventually, given_paths, need_rights

SOURCE = Path(__file__).resolve().parents[2]
MISSING = 3  # exit code: a needed thing is missing


def topology(folder, name, network, hosts):
    file = Path(folder) / f"{name}.yaml"
    file.write_text(f"name: {name}\ndomain: 76\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\n"
                    f"cell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\nnetwork: {network}\nhosts:\n{hosts}")
    return file


def refuses(host, words, *wanted):
    done = host.try_run(*words)
    assert done.returncode == MISSING, f"{words} ends with {done.returncode}: {done.stderr}"
    for text in wanted:
        assert text in done.stderr, f"{words} does not say '{text}': {done.stderr}"
    print("  " + done.stderr.strip().splitlines()[-1])


def main():
    binaries = given_paths("bin").bin
    need_rights()
    with tempfile.TemporaryDirectory(prefix="phantom_interfaces_") as folder:
        pinned = topology(folder, "pinned", "{interfaces: [10.40.0.2]}", "- {name: here, processes: [{component: slave_io, simulation: true}]}\n")
        hosts = topology(folder, "hosts", "{}", "- {name: here, interfaces: [10.40.0.2]}\n")
        host = Host("here")
        try:
            record = [binaries / "dds_recorder", "record", "--folder", folder, "--deployment"]
            spy = [binaries / "dds_spy", "topology", "--seconds", "2", "--deployment"]
            for words in (record, spy, [binaries / "slave_io", "--deployment"]):
                refuses(host, [*words, pinned], f"{pinned}:5: network.interfaces: 10.40.0.2 is no address of this host",
                        "127.0.0.1 (lo)")
            refuses(host, [*record, hosts], f"{hosts}: hosts: this machine has no host's interfaces: it has 127.0.0.1 (lo)")
            refuses(host, [*record, hosts, "--host", "here"], f"{hosts}:7: hosts[0].interfaces: 10.40.0.2 is no address")

            host.run("ip", "link", "add", "eth0", "type", "veth", "peer", "name", "cable")
            host.run("ip", "addr", "add", "10.40.0.2/24", "dev", "eth0")
            refuses(host, [*record, pinned], "10.40.0.2 is there, but its interface eth0 is down or without a link")
            host.run("ip", "link", "set", "eth0", "up")  # the cable's other end is not
            refuses(host, [*record, hosts], f"{hosts}:7: hosts[0].interfaces: 10.40.0.2 is there",
                    "10.40.0.2 (eth0, not running)", "ip link set eth0 up")
            host.run("ip", "link", "set", "cable", "up")
            eventually(lambda: " state UP " in host.run("ip", "-o", "link", "show", "eth0"), what="the interface is up")
            recorder = host.start([*record, pinned], f"{folder}/record.log")
            eventually(lambda: "dds_recorder" in host.try_run(*spy, pinned).stdout, what="with a link it is found")
            recorder.send_signal(signal.SIGINT)
            assert recorder.wait(30) == 0, recorder.log.read_text()
            print("with a link: recorder and spy meet")
        finally:
            host.close()


if __name__ == "__main__":
    main()
