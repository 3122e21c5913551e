"""Holds the rights that idl/ grants against what the running components open, as discovery tells it."""
import json
import subprocess
import sys
from pathlib import Path

from hosts import eventually

CONTRACT = Path(__file__).resolve().parents[2] / "idl/contract.py"
RUNNING = {"wva_server", "slave_io", "phantom_sensing", "master_io", "audio_percept", "synthetic_viewer", "phantom_session"}


def read_rights():
    rights = {}
    listed = subprocess.run([sys.executable, CONTRACT, "--rights"], capture_output=True, text=True, check=True).stdout
    for line in listed.splitlines():
        line = line.split("#")[0]
        if line.count("|") == 2:
            name, publishes, subscribes = (part.split() for part in line.split("|"))
            rights[name[0]] = (set(publishes), set(subscribes))
    return rights


def endpoints_have_exactly_their_rights(wall):
    rights = read_rights()
    rights["wva_server"][1].discard("occupancy_change")  # only if its `live` names a source
    rights["wva_server"][1].difference_update({"workspace_object", "object_uncertainty", "mesh_chunk"})  # with --follow alone
    rights["slave_io"][0].discard("gripper_state")  # of a gripper, which this arm does not have
    rights["master_io"][1].discard("gripper_state")  # for a haptic device with a grip
    rights["phantom_sensing"][1].difference_update({"gripper_state", "drag_field", "percept"})  # the last two: of shares of the skin
    rights["synthetic_viewer"][0].discard("view_picture")  # only if its pictures_Hz asks for it
    rights["synthetic_viewer"][0].discard("haptic_device")  # both only if its page.headset_hand says that a headset may lead
    rights["synthetic_viewer"][1].discard("haptic_device_wrench")
    rights["synthetic_viewer"][1].discard("camera_picture")  # only if its camera's file says source: topic
    rights["synthetic_viewer"][1].discard("workspace_brick")  # only while a page shows the fluid
    rights["wva_server"][1].discard("gripper_state")

    def opened():
        done = wall.site["diagnostics"].try_run(*wall.words("dds_spy", "topology", "--json", "--seconds", "3"))
        ends = {}
        for participant in json.loads(done.stdout)["participants"]:
            writes, reads = ends.setdefault(participant["name"], (set(), set()))
            writes.update(participant["writes"])
            reads.update(participant["reads"])
        return ends

    ends = {}

    def all_seen():
        ends.update(opened())
        return RUNNING <= set(ends) and all(ends[name] == rights[name] for name in RUNNING)
    try:
        eventually(all_seen, 60)
    except AssertionError:
        for name in sorted(RUNNING):
            for what, have, may in zip(("publishes", "subscribes"), ends.get(name, (set(), set())), rights[name]):
                if have != may:
                    print(f"{name} {what}: beyond its rights {sorted(have - may)}, rights it does not use {sorted(may - have)}")
        raise
