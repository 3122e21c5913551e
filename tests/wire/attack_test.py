#!/usr/bin/env python3
"""A stranger's damaged datagrams end Fast DDS, and harm no process of ours: none dies, none grows, and all go on hearing each other.

attack_test.py --programs FOLDER --bin FOLDER [--datagrams N] [--per-second N] [--seed N] [--only bare|participants|components|secured]
"""
import argparse
import json
import subprocess
import sys
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "hosts"))
from attacked_site import DOMAIN, GROWTH_MIB, SOURCE, Site, expect_orderly_ends, quick_viewer  # noqa: E402
from hosts import eventually, need, need_rights, own_mib  # noqa: E402
from servo_pace import expect_as_bare, loops, slip_shares, watched_slip_shares, with_bare_loop  # noqa: E402

MOST_PARTICIPANTS = 8
DATAGRAMS = {"bare": 10_000_000, "participants": 160_000, "components": 280_000, "secured": 280_000}
SERVOS = ("slave_io", "master_io")
START_S = 120  # only bounds a failing test
PLACES_BACK_S = 151  # after a stranger's last word, all places that it took at an address of ours are free again (docs/decisions, 20)
# Everything at a participant's two ports: discovery, and its readers and writers (DDSI-RTPS 9.6.1.1).
PORTS = {number: [7400 + 250 * DOMAIN + 10 + 2 * number + offset for offset in (0, 1)] for number in range(MOST_PARTICIPANTS)}


def attack_of(site, datagrams, participants, seed):
    ports = [str(port) for number in range(participants) for port in PORTS[number]]
    words = [site.options.programs / "attacker", str(seed), str(datagrams), str(site.options.per_second), *ports]
    return subprocess.Popen(site.host.inside([str(word) for word in words]), stdout=subprocess.DEVNULL)


MOST_BARE_MIB = 2048  # far more than any participant needs: it would take the host's memory


def expect_bare_dies(site):
    """The harness is worth something only if it ends the library as it comes (2.9.1), or makes it grow without end (3.1.2)."""
    bare = site.start([str(site.options.programs / "bare_participant"), str(DOMAIN)])
    assert bare.stdout.readline().strip() == "up"
    attack = attack_of(site, DATAGRAMS["bare"], 1, site.options.seed)
    begun, most = time.monotonic(), 0.0
    while bare.poll() is None and attack.poll() is None and most < MOST_BARE_MIB and time.monotonic() - begun < 300:
        try:
            most = max(most, own_mib(bare.pid))
        except (FileNotFoundError, ProcessLookupError, KeyError):
            pass
        time.sleep(0.05)
    died = bare.poll()
    attack.kill()
    attack.wait()
    bare.kill()
    bare.wait()
    print(f"Fast DDS as it comes: {'ended with ' + str(died) if died is not None else 'lived'} after {time.monotonic() - begun:.1f} s "
          f"of {site.options.per_second} datagrams/s; at most {most:.0f} MiB")
    assert died not in (None, 0) or most >= MOST_BARE_MIB, "the harness did the bare library no harm: it proves nothing"


def ask(talker):
    talker.stdin.write("\n")
    talker.stdin.flush()
    return json.loads(talker.stdout.readline())["heard"]


def expect_participants_go_on(site):
    talkers = [site.start([str(site.options.programs / "talker"), "--deployment", str(site.topology), "--as", name]) for name in ("one", "two")]
    sessions = [talker.stdout.readline().strip() for talker in talkers]
    assert all(sessions), "a talker did not start:\n" + site.log()
    time.sleep(2)
    before = [own_mib(talker.pid) for talker in talkers]
    attack = attack_of(site, site.options.datagrams, 2, site.options.seed + 1)
    while attack.poll() is None:
        for talker in talkers:
            assert talker.poll() is None, f"a participant ended with {talker.returncode}:\n" + site.log()
        time.sleep(0.2)
    after = [own_mib(talker.pid) for talker in talkers]
    first = [ask(talker) for talker in talkers]
    time.sleep(2)
    second = [ask(talker) for talker in talkers]
    for own, other in ((0, 1), (1, 0)):
        for topic in ("master_state", "operator_command", "component_status"):
            news = second[own].get(topic, {}).get(sessions[other], 0) - first[own].get(topic, {}).get(sessions[other], 0)
            assert news > 0, f"{topic} of the other is heard no more:\n" + site.log()
    for name, was, now in zip(("one", "two"), before, after):
        print(f"participant {name}: {was:.0f} MiB before, {now:.0f} MiB after {site.options.datagrams} datagrams")
        assert now <= was * 1.1 + GROWTH_MIB, "it grew:\n" + site.log()
    expect_orderly_ends(site, {"one": talkers[0], "two": talkers[1]})


def start_components(site):
    """All that run in a cell, one process each; audio_percept and the recorder as in a session without a device."""
    words = {"wva_server": [], "slave_io": ["--config", with_bare_loop(SOURCE, site.folder, "slave_io")], "phantom_sensing": [],
             "master_io": ["--config", with_bare_loop(SOURCE, site.folder, "master_io")], "audio_percept": [],
             "synthetic_viewer": ["--config", quick_viewer(site.folder)], "dds_recorder": ["record", "--folder", site.folder / "recordings"]}
    return {name: site.start([str(word) for word in (site.options.bin / name, *rest, "--deployment", site.topology)]) for name, rest in words.items()}


def event_lines(site):
    """A dds_spy, and what it reports from now on: a list that grows."""
    spy = site.start([str(site.options.bin / "dds_spy"), "events", "--deployment", str(site.topology)])
    lines = []
    threading.Thread(target=lambda: lines.extend(iter(spy.stdout.readline, "")), daemon=True).start()
    return spy, lines


def expect_components_go_on(site):
    """They live, do not grow, keep their servos' pace, are heard by who comes later, and dds_spy reports what they refuse, and from whom."""
    components = start_components(site)
    status = site.host.watch([site.options.bin / "dds_spy", "echo", "component_status", "--json", "--deployment", site.topology, "--seconds", "0"],
                             site.folder / "told", lambda line: line["sample"]["component_name"])

    def started():
        for name, process in components.items():
            assert process.poll() is None, f"{name} did not start:\n" + site.log()
        return all((status.get(name) or {"state": "COMPONENT_STARTING"})["state"] != "COMPONENT_STARTING" for name in components)
    eventually(started, START_S, "every component is up")
    quiet = {name: watched_slip_shares(status, name, 8, START_S) for name in SERVOS}
    before = {name: own_mib(process.pid) for name, process in components.items()}
    begun = {name: loops(status, name) for name in SERVOS}
    spy, events = event_lines(site)
    attack = attack_of(site, site.options.datagrams, len(components), site.options.seed + 2)
    while attack.poll() is None:
        for name, process in components.items():
            assert process.poll() is None, f"{name} ended with {process.returncode}:\n" + site.log()
        time.sleep(0.2)
    for name in SERVOS:
        servo, bare = slip_shares(begun[name], loops(status, name))
        print(f"{name}: the servo skipped {servo:.3f} of its ticks under attack, the bare loop {bare:.3f}; before {quiet[name][0]:.3f} and {quiet[name][1]:.3f}")
        expect_as_bare(f"{name} under attack:", (servo, bare), quiet[name][0])
    assert "datagrams refused" in site.log(), "none says that it refused any:\n" + site.log()
    eventually(lambda: any("it refused" in line and "of them from 127.0.0.1" in line for line in events), START_S,
               "dds_spy reports what was refused, and from whom")
    spy.terminate()  # the attack has taken all other places that participants of this address have, for up to PLACES_BACK_S
    assert spy.wait(60) == 0

    def late_one_hears():
        heard = site.start([str(site.options.bin / "dds_spy"), "hz", "slave_state", "workspace_version", "--history", "--json", "--deployment",
                            str(site.topology), "--seconds", "12"]).communicate()[0]
        return "slave_state" in heard and "workspace_version" in heard
    eventually(late_one_hears, PLACES_BACK_S + START_S, "a late one hears them")
    for name, process in components.items():
        now = own_mib(process.pid)
        print(f"{name}: {before[name]:.0f} MiB before, {now:.0f} MiB after {site.options.datagrams} datagrams")
        assert now <= before[name] * 1.1 + GROWTH_MIB, f"{name} grew:\n" + site.log()
    expect_orderly_ends(site, components)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=lambda path: Path(path).resolve(), required=True, help="folder of attacker, bare_participant and talker")
    parser.add_argument("--bin", type=lambda path: Path(path).resolve(), required=True, help="folder of the components")
    parser.add_argument("--datagrams", type=int, help="at each kind of process of ours; left out: DATAGRAMS")
    parser.add_argument("--per-second", type=int, default=8000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=("bare", "participants", "components", "secured"))
    options = parser.parse_args()
    need_rights()
    need("openssl")
    cases = {"bare": expect_bare_dies, "participants": expect_participants_go_on, "components": expect_components_go_on, "secured": expect_components_go_on}
    for name, case in cases.items():
        if options.only in (None, name):
            site = Site(argparse.Namespace(**{**vars(options), "datagrams": options.datagrams or DATAGRAMS[name]}), secured=name == "secured")
            try:
                case(site)
            finally:
                site.end()


main()
