"""One host with a wva_server that keeps its changes, who commands it, and a spy that hears what it says."""
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "hosts"))
from hosts import Host, eventually  # noqa: E402

SOURCE = Path(__file__).resolve().parents[2]


class CommandSite:
    def __init__(self, bin_folder, name, domain, parameters=None):
        """`parameters`: of wva_server, as YAML; none: the shipped ones."""
        self.bin, self.folder, self.host = bin_folder, Path(tempfile.mkdtemp(prefix=f"phantom-{name}-")), Host(name)
        self.topology = self.folder / "topology.yaml"
        self.topology.write_text(f"name: {name}\ndomain: {domain}\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\n"
                                 f"cell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\nnetwork:\n  interfaces: [127.0.0.1]\nhosts:\n  - {{name: here}}\n")
        self.changes = self.folder / "changes"
        self.options = ["--keep-changes", self.changes]
        if parameters:
            (self.folder / "wva_server.yaml").write_text(parameters)
            self.options += ["--config", self.folder / "wva_server.yaml"]
        words = [self.bin / "dds_spy", "echo", "workspace_reply", "workspace_version", "component_status", "--history", "--json",
                 "--deployment", self.topology]
        self.statuses = []  # of wva_server, each as a whole sample
        self.told = self.host.watch(words, self.folder / "spy.log", self._keep)
        self.starts = 0

    def _keep(self, line):
        if line.get("topic") == "component_status" and line["sample"]["component_name"] == "wva_server":
            self.statuses.append(line["sample"])
        return line.get("topic")

    def serve(self):
        self.starts += 1
        before = self.told.counted("workspace_version")
        server = self.host.start([self.bin / "wva_server", "--deployment", self.topology, *self.options], self.folder / f"server{self.starts}.log")
        eventually(lambda: self.told.counted("workspace_version") > before or server.poll() is not None, what="a version is served")
        assert server.poll() is None, "the server did not start again on what it had kept"
        return server

    def command(self, *words, timeout_s):
        """Someone at a shell who waits for the answer for that long."""
        return subprocess.Popen(self.host.inside([self.bin / "wva_server", "command", *words, "--timeout-s", timeout_s, "--deployment", self.topology]),
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=self.host.environment)

    def add(self, name, shape, timeout_s):
        file = self.folder / f"{name}.yaml"
        file.write_text(f"name: {name}\n{shape}")
        return self.command("add", "--file", file, timeout_s=timeout_s)

    def names(self):
        done = self.host.try_run(self.bin / "wva_server", "command", "list", "--deployment", self.topology)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def close(self):
        self.host.close()
        shutil.rmtree(self.folder)
