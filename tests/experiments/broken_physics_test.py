#!/usr/bin/env python3
"""Breaks one law of the physics and sees that exactly those experiments fail which say that they would notice. The slow ones run under
the laws that they say they notice alone: under another they would be as they are unbroken.

usage: broken_physics_test.py EXPERIMENTS LAW
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

SLOW = ("touch", "running-system")


def main(executable, law):
    entries = json.loads(subprocess.run([executable, "--list", "--json"], check=True, stdout=subprocess.PIPE, text=True).stdout)
    entries = [entry for entry in entries if law in entry["fails_under"] or entry["id"] not in SLOW]
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([executable, "--fast", "--break", law, "--out", out, *(entry["id"] for entry in entries)], check=False)
        wrong = []
        for entry in entries:
            checks = Path(out, entry["id"], "checks.json")
            if not checks.exists():
                wrong.append(f"{entry['id']}: did not run to its end with {law}")
                continue
            failed = [check["what"] for check in json.loads(checks.read_text()) if not check["passed"]]
            if bool(failed) != (law in entry["fails_under"]):
                wrong.append(f"{entry['id']}: with {law} " + ("fails: " + "; ".join(failed) if failed else "passes"))
    if not any(law in entry["fails_under"] for entry in entries):
        wrong.append(f"no experiment notices {law}")
    print("\n".join(wrong) or f"{law}: noticed by exactly those that say so")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
