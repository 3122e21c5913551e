#!/usr/bin/env python3
"""Two cells of one network: by partition in one domain, and by domain. Neither hears or moves the other; a spy tells them apart.

cells_test.py open|secured --bin DIR
"""
import json
import shutil
import signal
import tempfile
from pathlib import Path

from hosts import Host, eventually, given_paths, need, need_rights, run, telling_logs

SOURCE = Path(__file__).resolve().parents[2]
START_S = 120  # limits only bound a failing test


class Cells:
    def __init__(self, secured, binaries, folder):
        self.bin, self.folder = binaries, folder
        self.security = ""
        if secured:
            self.security = f"  security: {folder}/security\n"
            run(SOURCE / "deploy/security/make", "site", folder / "security", "--domain", "76-77", "--partition", "hall_*")
        self.host = Host("desk")

    def topology(self, name, domain, partition):
        """The shipped example with one cell's names, and the test's own documents."""
        text = (SOURCE / "deploy/topologies/cell_of_many.yaml").read_text().replace("../", f"{SOURCE}/deploy/")
        for old, new in (("domain: 42", f"domain: {domain}"), ("partition: hall_1/cell_7", f"partition: {partition}" if partition else ""),
                         ("interfaces: [10.30.7.2]", "interfaces: [127.0.0.1]"),
                         ("network:\n", "network:\n" + self.security)):
            assert old in text, old
            text = text.replace(old, new)
        file = self.folder / f"{name}.yaml"
        file.write_text(text)
        return file

    def start(self, program, topology, *rest):
        log = self.folder / f"{program}_{topology.stem}.log"
        return self.host.start([self.bin / program, "--deployment", topology, *rest], log)

    def spy(self, topology, *rest):
        done = self.host.try_run(self.bin / "dds_spy", *rest, "--json", "--seconds", "3", "--deployment", topology)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)


def status_of(watch, process):
    return watch.get(process.pid) or {"topics": [], "message": "", "state": ""}


def heard(watch, process, topic):
    return next((t["samples"] for t in status_of(watch, process)["topics"] if t["topic"] == topic and not t["writer"]), 0)


def matched(watch, process, topic):
    return {t["writer"]: t["matched"] for t in status_of(watch, process)["topics"] if t["topic"] == topic}


def partitioned(cells):
    """Cell a is whole; of cell b only the slave runs: with one writer of master_state in the domain, it must not follow that."""
    a, b = (cells.topology(name, 76, f"hall_1/cell_{name}") for name in "ab")
    watch = cells.host.watch([cells.bin / "dds_spy", "echo", "component_status", "slave_state", "--json", "--seconds", "0",
                              "--deployment", a], cells.folder / "spy.log",
                             lambda line: line["sample"].get("process_id", line["topic"]))
    slave_a, slave_b, master_a = cells.start("slave_io", a), cells.start("slave_io", b), cells.start("master_io", a)
    recorder_b = cells.start("dds_recorder", b, "record", "--folder", cells.folder / "b")
    eventually(lambda: heard(watch, slave_a, "master_state") > 500, START_S, "cell a: the slave hears its master")
    eventually(lambda: heard(watch, master_a, "slave_state") > 500, START_S, "cell a: the master hears its slave")
    eventually(lambda: watch.counted(slave_b.pid) > 4 and watch.counted(recorder_b.pid) > 4, START_S, "cell b runs")
    assert heard(watch, slave_b, "master_state") == 0, "the slave of cell b hears the master of cell a"
    assert matched(watch, slave_b, "master_state") == {False: 0}, matched(watch, slave_b, "master_state")
    assert matched(watch, master_a, "slave_state") == {False: 1}, matched(watch, master_a, "slave_state")
    assert matched(watch, slave_b, "slave_state") == {True: 1 + 1}, "the recorder of its cell, and the spy"

    found = cells.spy(a, "topology")
    partitions = sorted((p["name"], *p["partitions"]) for p in found["participants"] if p["name"] in ("slave_io", "master_io"))
    assert partitions == [("master_io", "hall_1/cell_a"), ("slave_io", "hall_1/cell_a"), ("slave_io", "hall_1/cell_b")], partitions
    streams = cells.spy(a, "hz", "slave_state", "master_state")["streams"]
    assert sorted(s["topic"] for s in streams) == ["master_state", "slave_state", "slave_state"], streams
    alone = {m["reader"]: [r["policy"] for r in m["reasons"]] for m in cells.spy(a, "qos", "master_state")["mismatches"]}
    hear_nobody = {f"slave_io (process {slave_b.pid})", f"dds_recorder (process {recorder_b.pid})"}
    assert alone == dict.fromkeys(hear_nobody, ["partition"]), f"who hears nobody in its partition is told, nobody else: {alone}"
    recorder_b.send_signal(signal.SIGINT)
    assert recorder_b.wait(60) == 0
    recorded = json.loads(run(cells.bin / "dds_recorder", "info", "--json", cells.folder / "b"))[0]["topics"]
    assert recorded["slave_state"]["writers"] == 1 and "master_state" not in recorded, "the recorder of cell b keeps to its cell"
    print("partitions: one domain, two cells; neither hears the other, the spy sees both, the recorder keeps to its own")


def main():
    given = given_paths("bin", mode=["open", "secured"])
    need_rights()
    if given.mode == "secured":
        need("openssl")
    folder = Path(tempfile.mkdtemp(prefix="phantom_cells_"))
    cells = Cells(given.mode == "secured", given.bin, folder)
    try:
        with telling_logs(folder):
            partitioned(cells)
    finally:
        cells.host.close()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
