#!/usr/bin/env python3
"""Somebody who is neither says for ten seconds that master_io and slave_io leave: they stay coupled, refuse it, and say so.

departures_test.py --programs FOLDER --bin FOLDER

A partner that is not heard for two seconds is lost here, not for the shipped 60 ms: what else runs on this machine takes the link down less
easily, and whom a departure has sent away stays away for as long as it is repeated.
"""
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "hosts"))
from attacked_site import DOMAIN, SOURCE, Site  # noqa: E402
from hosts import eventually, given_paths, need_rights, telling_logs  # noqa: E402

SIDES = {"slave_io": "slave_state", "master_io": "master_state"}
SECONDS = 10
START_S = 120  # only bounds a failing test
PATIENT = {"staleness_s: 0.06 ": "staleness_s: 2 ", "round_trip_limit_s: 0.15": "round_trip_limit_s: 10"}
FORGED = "refused: a departure that was forged"


def patient(folder, component):
    text = (SOURCE / f"components/{component}/{component}.yaml").read_text()
    for shipped, wanted in PATIENT.items():
        assert shipped in text, shipped
        text = text.replace(shipped, wanted)
    (folder / f"{component}.yaml").write_text(text)
    return folder / f"{component}.yaml"


class Pair:
    """Master and slave, coupled."""

    def __init__(self, site):
        words = ("--deployment", site.topology)
        self.processes = {side: site.host.start([site.options.bin / side, *words, "--config", patient(site.folder, side)], site.folder / f"{side}.log")
                          for side in SIDES}
        watching = [site.options.bin / "dds_spy", "echo", "component_status", *SIDES.values(), "--json", "--every", "0.1", "--seconds", "0", *words]
        self.watch = site.host.watch(watching, site.folder / "spy.log", lambda line: line["sample"].get("component_name", line["topic"]))
        eventually(self.coupled, START_S, "master and slave coupled")

    def coupled(self):
        for side, process in self.processes.items():
            assert process.poll() is None, f"{side} ended with {process.returncode}"
        return all((self.watch.get(topic) or {}).get("state") == "LINK_COUPLED" for topic in SIDES.values())

    def trips(self):
        """How often each has left the state of being coupled."""
        return {side: len(re.findall("link coupled → ", process.log.read_text(errors="replace"))) for side, process in self.processes.items()}

    def refused(self, side):
        figures = (self.watch.get(side) or {"figures": []})["figures"]
        return next((figure["value"] for figure in figures if figure["name"] == FORGED), 0)


def main():
    options = given_paths("programs", "bin")
    need_rights()
    site = Site(options)
    try:
        with telling_logs(site.folder):
            pair = Pair(site)
            before = pair.trips()
            forger = site.host.try_run(options.programs / "forger", DOMAIN, SECONDS, limit_s=SECONDS + START_S)
            assert forger.returncode == 0, forger.stderr
            named, sent = map(int, forger.stdout.split())
            assert named >= len(SIDES), f"the stranger heard {named} participants: it forges nothing"
            for side in SIDES:
                eventually(lambda: pair.refused(side) > 0, START_S, f"{side} tells that it refused forged departures")
            trips = {side: count - before[side] for side, count in pair.trips().items()}
            print(f"{sent} departures in the names of {named} participants; refused by " + ", ".join(f"{side}: {pair.refused(side):.0f}" for side in SIDES) +
                  f"; uncoupled: {trips}")
            assert not any(trips.values()), f"forged departures took the link down: {trips}"
            assert pair.coupled(), "they are coupled no more"
    finally:
        site.end()


main()
