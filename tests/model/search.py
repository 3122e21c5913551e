"""Searches the model of the link by spin, over all interleavings: every state is stored, nothing is hashed away.

search.py CONFIGURATION…   searches these; ends with 1 if a property does not hold, or the search is not complete
search.py --defect NAME…   searches the model with this defect; ends with 1 unless its property is found broken
search.py --list           names all; --list defects, --list long
search.py --long           searches the long configurations, some minutes each, and writes results.md beside this file
"""
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MODEL = Path(__file__).resolve().with_name("link.pml")
RESULTS = MODEL.with_name("results.md")
MEMORY_MB = 6000
DEPTH = 3_000_000
SHORT = dict(STALE=0, HOLD=0, RECOVERY=0, RAMP=1)

# Name: what may happen in it. Constants that are left out have the values of link.pml.
CONFIGURATIONS = {
    "interleavings": dict(HOLD=0, RECOVERY=0, RAMP=2),
    "restarts": dict(SHORT, RESTARTS=1),
    "drives": dict(SHORT, DRIVES=1, ASKS=1, POSES=0),
    "drives_alone": dict(SHORT, DRIVES=1, ASKS=0, POSES=0),
    "starved": dict(SHORT, STARVE=1),
    "switches": dict(SWITCH=1, RAMP=1, ASKS=0),
    "second_master": dict(SHORT, RIVAL=2, ASKS=0, POSES=0),
    "second_slave": dict(SHORT, RIVAL=1, ASKS=0, POSES=0),
    "late_at_slave": dict(SHORT, STALE=2, DELAY=2, TRIP=1, ROUND_TRIP=1, ASKS=1, POSES=0, RESETS=0),
    "late_at_master": dict(SHORT, STALE=2, DELAY=1, TRIP=1, ROUND_TRIP=1, ASKS=2, POSES=0, RESETS=0),
    "repeated": dict(SHORT, DELAY=2, REPEAT=1, ASKS=1, POSES=0, RESETS=0),
    "way_out": dict(SHORT, SETTLE=16),
    "way_out_drives": dict(SHORT, SETTLE=16, DRIVES=1, POSES=0),
    "way_out_starved": dict(SHORT, SETTLE=16, STARVE=1, POSES=0),
    "way_out_switches": dict(SHORT, SETTLE=16, SWITCH=1, ASKS=1, POSES=0),
    "way_out_restarts": dict(SHORT, SETTLE=16, RESTARTS=1, POSES=0),
    "way_out_second_master": dict(SHORT, SETTLE=16, RIVAL=2, ASKS=0, POSES=0),
}
LONG = {
    "interleavings_longer": dict(),
    "restarts_longer": dict(RESTARTS=1),
    "drives_longer": dict(SHORT, DRIVES=1),
    "second_master_longer": dict(SHORT, RIVAL=2, ASKS=1, POSES=0),
}
# Name: number in link.pml, configuration that finds it.
DEFECTS = {
    "any_reset_releases": (1, "interleavings"),
    "stop_lasts_as_long_as_its_cause": (2, "interleavings"),
    "reset_in_the_tick_of_a_stop": (3, "interleavings"),
    "second_stop_keeps_the_name": (4, "interleavings"),
    "partner_stop_ignored": (5, "interleavings"),
    "never_stale": (6, "interleavings"),
    "round_trip_ignored": (7, "late_at_slave"),
    "coupled_without_alignment": (8, "interleavings"),
    "released_in_fault": (9, "drives"),
    "torque_stays_in_a_stop": (10, "interleavings"),
    "answers_another_ignored": (11, "restarts"),
    "no_cap": (12, "interleavings"),
    "power_with_a_stopped_partner": (13, "interleavings"),
    "stop_dies_with_its_process": (14, "restarts"),
    "reset_needs_a_running_partner": (15, "way_out"),
    "starved_stays_coupled": (16, "starved"),
    "power_while_starved": (17, "starved"),
    "own_switch_ignored": (18, "switches"),
    "partners_switch_ignored": (19, "switches"),
}


def search(constants, defect=0):
    """Returns (broken property or None, complete, states, transitions, seconds)."""
    folder = Path(tempfile.mkdtemp(prefix="phantom_model_"))
    try:
        flags = [f"-D{name}={value}" for name, value in constants.items()] + [f"-DDEFECT={defect}"]
        must(["spin", *flags, "-a", MODEL], folder)
        # SAFETY: assertions only; no cycles are looked for. A defect is found so soon that compiling is the longer part.
        must(["cc", "-O1" if defect else "-O2", "-w", "-DSAFETY", f"-DMEMLIM={MEMORY_MB}", "-o", "pan", "pan.c"], folder)
        begin = time.monotonic()
        told = subprocess.run(["./pan", f"-m{DEPTH}"], cwd=folder, capture_output=True, text=True, check=False)
        text = told.stdout + told.stderr
        broken = re.search(r"assertion violated (.*) \(at depth", text)
        errors = re.search(r"errors: (\d+)", text)
        complete = errors is not None and "too small" not in text and "not completed" not in text and told.returncode == 0
        # Whatever else spin calls an error (a number out of its range, say) is one.
        found = broken.group(1) if broken else (f"spin tells of {errors.group(1)} errors" if errors and errors.group(1) != "0" else None)
        count = {word: int(float(number)) for number, word in re.findall(r"([\d.e+]+) (states, stored|transitions)", text)}
        if not complete and not found:
            sys.stderr.write(text[-2000:])
        return found, complete, count.get("states, stored", 0), count.get("transitions", 0), time.monotonic() - begin
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def must(words, folder):
    try:
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        sys.exit(f"search: {words[0]} is missing: scripts/setup installs it")
    if done.returncode != 0:
        sys.exit(f"search: {words[0]}: {done.stdout}{done.stderr}")


def holds(name, constants, rows=None):
    broken, complete, states, transitions, seconds = search(constants)
    verdict = f"BROKEN: {broken}" if broken else ("every property holds" if complete else "NOT COMPLETE")
    print(f"{name}: {states:,} states, {transitions:,} transitions, {seconds:.1f} s: {verdict}", flush=True)
    if rows is not None:
        rows.append(f"| {name} | {' '.join(f'{k}={v}' for k, v in constants.items()) or 'as in link.pml'} | {states:,} | {transitions:,} | {verdict} |")
    # A model in which nothing can happen would have nothing to find.
    return broken is None and complete and states > 1000


def found(name):
    number, configuration = DEFECTS[name]
    broken, *_ = search(CONFIGURATIONS[configuration], number)
    print(f"{name}: {'found: ' + broken if broken else 'NOT FOUND'}", flush=True)
    return broken is not None


def main(words):
    if words[:1] == ["--list"]:
        print("\n".join({"defects": DEFECTS, "long": LONG}.get((words + [""])[1], CONFIGURATIONS)))
        return 0
    if words == ["--long"]:
        rows = []
        done = [holds(name, constants, rows) for name, constants in {**CONFIGURATIONS, **LONG}.items()]
        RESULTS.write_text("# Results of the last long search\n\nMade by `search.py --long`. Every search is exhaustive.\n\n"
                           "| configuration | constants | states | transitions | result |\n|---|---|---|---|---|\n" + "\n".join(rows) + "\n")
        return 0 if all(done) else 1
    known = DEFECTS if words[:1] == ["--defect"] else {**CONFIGURATIONS, **LONG}
    names = words[1:] if words[:1] == ["--defect"] else words
    if not names or any(name not in known for name in names):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    done = [found(name) if known is DEFECTS else holds(name, known[name]) for name in names]
    return 0 if all(done) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
