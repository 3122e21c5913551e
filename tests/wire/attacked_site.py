"""A host of its own (a network namespace) with processes of the product, to be attacked or flooded from within it."""
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "tests/hosts"))
from hosts import SIMULATED_ARMS, Host, run  # noqa: E402

DOMAIN = 42
GROWTH_MIB = 32  # and a tenth
VIEWER = "frame_rate_hz: 2\nmain_view: {width_px: 160, height_px: 120}\nhit_view: {width_px: 160, height_px: 120}\ntool_view: {enabled: false}\npage: {port: 0}\n"


def quick_viewer(folder):
    """Parameters of a viewer that draws little."""
    file = folder / "viewer.yaml"
    file.write_text(VIEWER)
    return file


class Site:
    def __init__(self, options, secured=False):
        self.options = options
        self.folder = Path(tempfile.mkdtemp(prefix="phantom-attack-"))
        self.host = Host("attacked")
        self.started = []
        self.topology = self.folder / "topology.yaml"
        security = self.folder / "security"
        if secured:
            run(str(SOURCE / "deploy/security/make"), "site", str(security))
        self.topology.write_text(f"name: attack\ndomain: {DOMAIN}\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\n"
                                 f"cell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\nnetwork:\n  interfaces: [127.0.0.1]\n" +
                                 (f"  security: {security}\n" if secured else "") + f"hosts:\n  - {{name: here, {SIMULATED_ARMS}}}\n")

    def start(self, words):
        process = subprocess.Popen(self.host.inside(words), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=open(self.folder / "log", "a"), text=True,
                                   env=self.host.environment)
        self.started.append(process)
        return process

    def log(self):
        return (self.folder / "log").read_text()

    def end(self):
        for process in self.started:
            process.kill()
            process.wait()
        self.host.close()
        shutil.rmtree(self.folder)


def expect_orderly_ends(site, processes):
    """No lock is left taken: each ends by itself when it is asked to."""
    for process in processes.values():
        process.stdin.close()
        process.terminate()
    for name, process in processes.items():
        try:
            code = process.wait(60)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{name} does not end:\n" + site.log()) from None
        assert code == 0, f"{name} ended with {code}:\n" + site.log()
