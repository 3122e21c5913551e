#!/usr/bin/env python3
"""Hosts with different arms or cells do not couple, and each tells which joint of which file differs; a stop is heeded all the same.

arms_test.py --bin DIR
"""
import shutil
import tempfile
from pathlib import Path

from hosts import eventually, given_paths, need_rights, telling_logs
from two_sides import LIMIT_S, SOURCE, TwoSides

# How the slave's host differs: file, text there, text instead, what both sides tell.
CASES = {
    "a joint turned the other way": ("arm/suspended_arm.urdf", '<origin xyz="0 0 -0.06"/><axis xyz="0 0 1"/>', '<origin xyz="0 0 -0.06"/><axis xyz="0 0 -1"/>',
                                     "another joint j2_yaw"),
    "a longer forearm": ("arm/suspended_arm.urdf", '<child link="forearm_roll"/><origin xyz="0 0 -0.20"/>', '<child link="forearm_roll"/><origin xyz="0 0 -0.30"/>',
                         "another joint j5_roll"),
    "an object elsewhere": ("cell.yaml", "xyz_m: [-0.35, 0.12, 0.301]", "xyz_m: [-0.30, 0.12, 0.301]", "its cell is another"),
}


def refused(binaries, folder, what):
    file, text, instead, told = CASES[what]
    cell = folder / what.replace(" ", "_")
    shutil.copytree(SOURCE / "deploy/cells/hot_cell", cell)
    content = (cell / file).read_text()
    assert content.count(text) == 1, (file, text)
    (cell / file).write_text(content.replace(text, instead))
    sides = TwoSides(binaries, cells={"slave": cell / "cell.yaml"})
    try:
        with telling_logs(sides.folder, 20):
            sides.start()
            for component in ("master_io", "slave_io"):
                eventually(lambda c=component: told in sides.newest(c).get("message", ""), LIMIT_S, f"{component} tells: {told}")
                log = sides.log(component)
                assert told in log and str(cell / file)[-60:] in log, (component, log[-2000:])
            sides.stop()
            states = {sides.newest(topic, host).get("state") for topic in ("master_state", "slave_state") for host in ("master", "slave")}
            assert "LINK_COUPLED" not in states and "LINK_COUPLED" not in sides.log("master_io"), states
            print(f"{what}: not coupled, told by both sides, stopped by a command")
    finally:
        sides.close()


def main():
    given = given_paths("bin")
    need_rights()
    folder = Path(tempfile.mkdtemp(prefix="phantom_arms_"))
    try:
        for what in CASES:
            refused(given.bin, folder, what)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
