#!/usr/bin/env python3
"""A run's trace for scripts/checks/link_trace, which holds it against the model of the link: one file for each tap.

link_trace.py FOLDER [--out DIR]

FOLDER is the report of a run that kept its recordings (chaos --keep-recordings; a run with a violation keeps them anyway). The lines are those of
`dds_spy echo --json` for master_state, slave_state and operator_command, without what a second writer sent; before them the run's limits, between
them what was done, as notes, and the resets that were sent, as a tap may have missed one.
"""
import argparse
import json
from pathlib import Path

from recordings import Facts, McapFolder
from scene import SIDES

STATES = ("LINK_INIT", "LINK_READY", "LINK_ALIGNED", "LINK_COUPLED", "LINK_DEGRADED", "LINK_STOPPED")
CAUSES = ("STOP_NONE", "STOP_EMERGENCY", "STOP_DRIVE_FAULT", "STOP_PARTNER")
KINDS = ("COMMAND_EMERGENCY_STOP", "COMMAND_RESET", "COMMAND_SET_PERCEPT_GAIN", "COMMAND_SET_FEEDBACK_GAIN", "COMMAND_ENABLE_PERCEPT", "COMMAND_VIEW_HOLD",
         "COMMAND_VIEW_NODE", "COMMAND_SET_LAW", "COMMAND_MARK", "COMMAND_HOME", "COMMAND_GRIPPER_WIDTH", "COMMAND_GRIPPER_FORCE",
         "COMMAND_TARE_FORCE_SENSOR", "COMMAND_SET_PERCEPTS", "COMMAND_COUNTERBALANCE")


def padded(values):
    return list(values) + [0.0] * (16 - len(values))


def stamp(s):
    return {"session": s.session, "sequence_number": s.number, "monotonic_ns": s.monotonic_ns}


def echo(e):
    return {"session": e.session, "sequence_number": e.number, "monotonic_ns": e.monotonic_ns}


def side_state(c):
    return {"stamp": stamp(c.stamp), "state": STATES[c.state], "stop_cause": CAUSES[c.cause], "stop": c.stop, "joint_count": c.joints,
            "position_rad": padded(c.position)}


def line(sample):
    c = sample.content
    if sample.topic == "master_state":
        fields = {**side_state(c), "percept_torque_Nm": padded(c.percept), "feedback_torque_Nm": padded(c.feedback), "slave_echo": echo(c.slave_echo)}
    elif sample.topic == "slave_state":
        fields = {**side_state(c), "master_echo": echo(c.master_echo)}
    else:
        fields = {"stamp": stamp(c.stamp), "kind": KINDS[c.kind], "master_stop": c.master_stop, "slave_stop": c.slave_stop}
    return {"topic": sample.topic, "sample": fields}


def fact_lines(fact):
    if fact["fact"] == "reset":
        sample = {"stamp": {"session": 0, "sequence_number": 0, "monotonic_ns": round(fact["t"] * 1e9)}, "kind": "COMMAND_RESET",
                  "master_stop": fact["master_stop"], "slave_stop": fact["slave_stop"]}
        yield {"topic": "operator_command", "sample": sample}
    if fact["fact"] != "memory":
        yield {"event": "note", "text": " ".join(f"{k}={v}" for k, v in fact.items() if k != "t")}


def limits_line(limits):
    caps = [p + f for p, f in zip(limits["percept_cap"], limits["feedback_cap"])]
    return {"event": "limits", "staleness_s": 0.06, "round_trip_limit_s": 0.15, "ramp_down_s": 0.1, "recovery_s": 0.2, "torque_cap_Nm": caps, "held_rad": 0.02, "slack_s": 0.1}


def lines(folder, tap):
    """All lines of a tap's trace, in order."""
    facts = Facts(folder / "facts.jsonl").read()
    strangers = {f["pid"] for f in facts if f["fact"] == "started" and f.get("intruder")}
    samples = [s for s in McapFolder(folder / "taps" / tap, tap).read() if s.topic != "drag_field" and s.process not in strangers]
    entries = [(s.t, 1, s) for s in samples] + [(f["t"], 0, f) for f in facts]
    yield limits_line(json.loads((folder / "limits.json").read_text())["limits"])
    for _, kind, entry in sorted(entries, key=lambda e: e[:2]):
        yield from [line(entry)] if kind else fact_lines(entry)


def write(folder, out):
    """Writes each tap's trace; returns the files."""
    paths = [out / f"link_{tap}.jsonl" for tap in SIDES]
    for tap, path in zip(SIDES, paths):
        with open(path, "w") as file:
            file.writelines(json.dumps(entry) + "\n" for entry in lines(folder, tap))
    return paths


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--out", type=Path, help="default: FOLDER")
    given = arguments.parse_args()
    print(*write(given.folder, given.out or given.folder), sep="\n")


if __name__ == "__main__":
    main()
