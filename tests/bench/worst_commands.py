#!/usr/bin/env python3
"""Measures how long wva_server takes for the dearest commands that its limits let through, and for those that reach a limit.

worst_commands.py --bin FOLDER [--busy PROCESSES] [--only NAME …] [--json FILE] [--config FILE]

For each kind of work it prints the seconds from the command to its result, the server's processor time, the longest pause between two component_status meanwhile,
how long another command that was sent meanwhile waited to be accepted (both with the start of the asking process, 1 s), and the result.
At last it asks the server to end amid the dearest command. --busy: so many other processes compute meanwhile. Takes minutes, and 6 GB.
"""
import argparse
import json
import math
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
LONGEST_S = 600
TRIANGLES = 500_000  # commands.max_triangles, as shipped


def nested(function, times, inner):
    return f"{function}(" * times + inner + ")" * times


def formula(text):
    return f"implicit: {{f: \"{text}\", min_m: [-1.5, -1.5, 0.1], max_m: [1.5, 1.5, 2.9]}}"


def write_stl(file, triangles):
    with open(file, "wb") as out:
        out.write(b" " * 80 + struct.pack("<I", len(triangles)))
        for corners in triangles:
            out.write(struct.pack("<12fH", 0, 0, 0, *corners, 0))


def write_obj(file, triangles):
    """As text, which takes the longest to read."""
    with open(file, "w") as out:
        for c in triangles:
            for i in range(0, 9, 3):
                out.write(f"v {c[i]:.17f} {c[i + 1]:.17f} {c[i + 2]:.17f}\nvt {c[i]:.17f} {c[i + 1]:.17f}\n")
        for i in range(len(triangles)):
            out.write("f " + " ".join(f"{3 * i + k}/{3 * i + k}" for k in (1, 2, 3)) + "\n")


def soup(count, size_m):
    """Triangles anywhere, each alone: nothing is closed, so that winding numbers decide."""
    rng = random.Random(1)
    made = []
    for _ in range(count):
        p = [rng.uniform(-1.2, 1.2), rng.uniform(-1.2, 1.2), rng.uniform(0.2, 2.6)]
        made.append([p[k % 3] + rng.uniform(-size_m, size_m) for k in range(9)])
    return made


LAYERS = "profile: {thickness_vox: [100, 100, 50], mu_Pa_s_per_m: [32, 20, 10], mu_skin_Pa_s_per_m: 100, method: %s}"
SHELL = "primitive: {box: {size_m: [2.6, 2.6, 2.4]}}\npose: {xyz_m: [0, 0, 1.4]}\n"  # its layers reach every brick
BALL = "min(length(x, y, z - 1.4) - 0.05, %s - %s + 1e-300)"  # a small surface, and nothing that bounds exclude
MESH = "mesh: %s\nmesh_scale: 1\nup_axis: z"


def aliases(radius_m):
    return f"csg: {{union: [&a {{sphere: {{radius_m: {radius_m}}}}}" + ",*a" * 4094 + "]}\npose: {xyz_m: [0, 0, 1.4]}"


# name: (what it reaches, the object's description without its name, the mesh file that it needs)
CASES = {
    "small shapes": ("4,096 shapes through aliases, small", aliases(0.05), None),
    "large shapes": ("the same, large", aliases(0.9), None),
    "plain surface": ("a surface by sums and products", formula("+".join(["x*y*z-x*y*z"] * 60)), None),
    "sin surface": ("a surface by sin", formula(nested("sin", 40, "1e5*x*y*z")), None),
    "tan surface": ("a surface by tan", formula("+".join(["tan(1e6*x*y*z)"] * 40)), None),
    "plain voxels": ("voxels by sums and products", formula(BALL % (("x*y*z-(" * 20 + "x" + ")" * 20,) * 2)), None),
    "sin voxels": ("voxels by sin", formula(BALL % ((nested("sin", 20, "x*y*z"),) * 2)), None),
    "pow voxels": ("voxels by pow", formula(BALL % (("pow(" * 20 + "2+x" + ", 1.01)" * 20,) * 2)), None),
    "length voxels": ("voxels by length", formula(BALL % (("length(" * 20 + "x" + ", y)" * 20,) * 2)), None),
    "loose triangles": ("winding numbers of 500,000 small triangles", MESH % "small.stl", ("small.stl", 0.01)),
    "large triangles": ("winding numbers of 500,000 large triangles", MESH % "large.stl", ("large.stl", 0.3)),
    "mesh as text": ("500,000 triangles to read as text", MESH % "small.obj", ("small.obj", 0.01)),
    "too many triangles": ("the same, 500,001", MESH % "more.stl", ("more.stl", 0.01)),
    "layers by distance": ("layers in all bricks", SHELL + LAYERS % "distance", None),
    "layers by dilation": ("the same", SHELL + LAYERS % "dilation", None),
    "layers by surface": ("the same", SHELL + LAYERS % "surface", None),
    "layers of triangles": ("layers by surface round 500,000 triangles", MESH % "small.stl" + "\n" + LAYERS % "surface", ("small.stl", 0.01)),
}


def write_mesh(file, size_m):
    triangles = soup(TRIANGLES + (file.name == "more.stl"), size_m)
    (write_obj if file.suffix == ".obj" else write_stl)(file, triangles)


class Server:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        (folder / "cell.yaml").write_text("name: large\nworkspace: {min_m: [-1.6, -1.6, 0], max_m: [1.6, 1.6, 3.2], voxel_size_m: 0.0032}\n"
                                          "profile: {thickness_vox: [4, 4], mu_Pa_s_per_m: [32, 20], mu_skin_Pa_s_per_m: 100}\nobjects:\n"
                                          "  - {name: base, primitive: {box: {size_m: [0.1, 0.1, 0.1]}}, pose: {xyz_m: [0, 0, 0.05]}}\n")
        self.topology = folder / "topology.yaml"
        self.topology.write_text(f"name: worst\ndomain: {options.domain}\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\ncell: {folder}/cell.yaml\n"
                                 "network:\n  interfaces: [127.0.0.1]\nhosts:\n  - {name: here}\n")
        self.log = open(folder / "log", "a")
        words = [str(options.bin / "wva_server"), "--deployment", str(self.topology)]
        self.process = subprocess.Popen(words + (["--config", str(options.config)] if options.config else []), stdout=self.log, stderr=self.log)
        self.heard_s = []
        self.spy = subprocess.Popen([str(options.bin / "dds_spy"), "echo", "component_status", "--json", "--instance", "component_name=wva_server,*",
                                     "--deployment", str(self.topology)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        threading.Thread(target=self.listen, daemon=True).start()
        until = time.monotonic() + LONGEST_S
        while self.command("list").returncode != 0:
            assert self.process.poll() is None and time.monotonic() < until, (folder / "log").read_text()

    def cpu_s(self):
        """Processor time of the server, and of the mesh importers that have ended."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return sum(int(fields[i]) for i in (11, 12, 13, 14)) / os.sysconf("SC_CLK_TCK")

    def listen(self):
        for _ in self.spy.stdout:
            self.heard_s.append(time.monotonic())

    def longest_pause_s(self, begun, ended):
        times = [begun] + [at for at in self.heard_s if begun < at < ended] + [ended]
        return max(b - a for a, b in zip(times, times[1:]))

    def words(self, *words):
        return [str(self.options.bin / "wva_server"), "command", words[0], *words[1:], "--deployment", str(self.topology), "--timeout-s", str(LONGEST_S)]

    def command(self, *words):
        return subprocess.run(self.words(*words), capture_output=True, text=True)

    def add(self, name, body):
        file = self.folder / "object.yaml"
        file.write_text(f"name: {name}\n{body}\n")
        return subprocess.Popen(self.words("add", "--file", str(file)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def end(self):
        self.spy.kill()
        self.process.send_signal(signal.SIGTERM)
        begun = time.monotonic()
        code = self.process.wait(LONGEST_S)
        return time.monotonic() - begun, code


def measure(server, name, body):
    """Sends the command and, a second later, another one; returns the figures of the first."""
    begun, cpu_s = time.monotonic(), server.cpu_s()
    added = server.add(name, body)
    line = added.stdout.readline()
    time.sleep(1.0)
    other_begun, other_s = time.monotonic(), math.nan
    if added.poll() is None:
        other = subprocess.Popen(server.words("remove", "--id", "60000"), stdout=subprocess.PIPE, text=True)
        other.stdout.readline()
        other_s = time.monotonic() - other_begun
    text = line + added.communicate()[0]
    ended = time.monotonic()
    result = [one for one in text.splitlines() if one.startswith(("done", "refused"))]
    return {"case": name, "seconds": ended - begun, "cpu_s": server.cpu_s() - cpu_s, "other_s": other_s, "pause_s": server.longest_pause_s(begun, ended),
            "result": (result or [text.strip()])[0].replace(str(server.folder), "")[:120]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=lambda path: Path(path).resolve(), required=True, help="folder of the components")
    parser.add_argument("--busy", type=int, default=0, help="other processes that compute meanwhile")
    parser.add_argument("--only", nargs="*", choices=CASES, metavar="CASE", help="of these alone: " + ", ".join(CASES))
    parser.add_argument("--config", type=lambda path: Path(path).resolve(), help="of wva_server")
    parser.add_argument("--json", type=Path, help="file for the figures")
    parser.add_argument("--domain", type=int, default=77)
    options = parser.parse_args()
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(options.busy)]
    figures = []
    try:
        with tempfile.TemporaryDirectory(prefix="phantom-worst-") as name:
            folder = Path(name)
            server = Server(options, folder)
            for case, (what, body, mesh) in CASES.items():
                if options.only and case not in options.only:
                    continue
                if mesh and not (folder / mesh[0]).exists():
                    write_mesh(folder / mesh[0], mesh[1])
                figures.append(measure(server, case, body) | {"what": what})
                one = figures[-1]
                print(f"{case:20} {one['seconds']:7.1f} s  {one['cpu_s']:7.1f} s  {one['pause_s']:4.1f} s  {one['other_s']:4.1f} s  {one['result']}", flush=True)
                server.command("remove", "--object", case)
            dearest = max(figures, key=lambda one: one["seconds"])["case"]
            server.add("last", CASES[dearest][1])
            time.sleep(min(5.0, 0.5 * max(one["seconds"] for one in figures)))
            seconds, code = server.end()
            print(f"ends {seconds:.1f} s after SIGTERM amid '{dearest}', with {code}", flush=True)
            figures.append({"case": "SIGTERM", "seconds": seconds, "code": code})
    finally:
        for process in busy:
            process.kill()
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n")


main()
