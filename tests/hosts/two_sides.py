"""Master and slave with percept on two hosts, whose clocks and arms a test makes worse than they should be."""
import shutil
import struct
import tempfile
from pathlib import Path

from hosts import SIMULATED_ARMS, Site, eventually

SOURCE = Path(__file__).resolve().parents[2]
ADDRESSES = {"master": "10.62.1.2", "slave": "10.62.2.2"}
PROCESSES = {"slave": ("wva_server", "slave_io"), "master": ("phantom_sensing", "master_io")}
LIMIT_S = 180  # only bounds a failing test


class TwoSides:
    def __init__(self, binaries, clock=None, cells=None):
        """`clock`: clock_step.so, for wall clocks that can be set.
        `cells`: cell file of a host that has another than the shipped one."""
        self.bin, self.folder = Path(binaries).resolve(), Path(tempfile.mkdtemp(prefix="phantom_sides_"))
        self.site = Site(ADDRESSES)
        self.clock, self.watches = clock, {}
        for name, host in self.site.hosts.items():
            (self.folder / f"clock.{name}").write_bytes(bytes(8))
            if clock:
                host.environment |= {"LD_PRELOAD": str(clock), "PHANTOM_CLOCK_STEP": str(self.folder / f"clock.{name}")}
            cell = (cells or {}).get(name, SOURCE / "deploy/cells/hot_cell/cell.yaml")
            sides = "".join(f"  - {{name: {side}, interfaces: [127.0.0.1, {address}], {SIMULATED_ARMS}}}\n" for side, address in ADDRESSES.items())
            (self.folder / f"{name}.yaml").write_text(
                f"name: sides\ndomain: 62\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\ncell: {cell}\nnetwork:\n"
                f"  initial_peers: [127.0.0.1, {', '.join(ADDRESSES.values())}]\nhosts:\n{sides}")

    def words(self, host, program, *rest):
        return [self.bin / program, "--deployment", self.folder / f"{host}.yaml", "--host", host, *rest]

    def start(self):
        for host, programs in PROCESSES.items():
            for program in programs:
                self.site[host].start(self.words(host, program), self.folder / f"{program}.log")
        for host in ADDRESSES:
            self.watches[host] = self.site[host].watch(
                self.words(host, "dds_spy", "echo", "master_state", "slave_state", "component_status", "--json", "--every", "0.1", "--seconds", "0"),
                self.folder / f"spy_{host}.log", lambda line: line.get("sample", {}).get("component_name", line.get("topic")))

    def log(self, program):
        return (self.folder / f"{program}.log").read_text(errors="replace")

    def newest(self, key, host="master"):
        return self.watches[host].get(key) or {}

    def figure(self, component, name):
        return next((f["value"] for f in self.newest(component).get("figures", []) if f["name"] == name), None)

    def set_clock(self, host, offset_s):
        with open(self.folder / f"clock.{host}", "r+b", buffering=0) as file:
            file.write(struct.pack("=q", int(offset_s * 1e9)))

    def command(self, *words):
        done = self.site["master"].try_run(*self.words("master", "master_io", "command", *words, "--timeout-s", "10"), limit_s=LIMIT_S)
        return done.returncode, done.stdout + done.stderr

    def states(self):
        return [self.newest(topic).get("state") for topic in ("master_state", "slave_state")]

    def stop(self):
        """By a command from the master's host, as often as a loaded machine needs it."""
        eventually(lambda: self.command("stop")[0] == 0, LIMIT_S, "a stop that both sides confirm")
        eventually(lambda: self.states() == ["LINK_STOPPED"] * 2, LIMIT_S, "both sides stopped")

    def all_run(self):
        ended = [process.log.stem for host in self.site.hosts.values() for process in host.processes if getattr(process, "log", None) and process.poll() is not None]
        assert not ended, f"ended by themselves: {ended}"
        return True

    def coupled(self):
        eventually(lambda: self.all_run() and self.newest("master_state").get("state") == "LINK_COUPLED", LIMIT_S, "coupled")

    def percept_is_felt(self):
        def felt():
            self.all_run()
            state = self.newest("master_state")
            return state.get("state") == "LINK_COUPLED" and max(map(abs, state["percept_torque_Nm"])) > 0.01
        eventually(felt, LIMIT_S, "percept torque while coupled")

    def a_stop_can_be_reset(self):
        self.stop()
        eventually(lambda: self.command("reset")[0] == 0, LIMIT_S, "a reset that both sides confirm")
        self.coupled()

    def close(self):
        self.site.close()
        shutil.rmtree(self.folder, ignore_errors=True)
