"""Lets spin walk through the model at random, and writes the law's tables and the walks.

traces.py FOLDER            writes FOLDER/*.trace, the walks that link_twin_test.cpp drives
traces.py --check-tables    ends with 1 if link_tables.csv is not what the model says; --write-tables writes it
"""
import subprocess
import sys
from pathlib import Path

MODEL = Path(__file__).resolve().with_name("link.pml")
TABLES = MODEL.with_name("link_tables.csv")
STEPS = 1_500_000  # of spin; about a hundred are one tick
TROUBLES = ("RESTARTS=1", "DRIVES=1", "STARVE=1", "SWITCH=1", "DELAY=3", "REPEAT=1", "RIVAL=2")
# Ticks of staleness, alignment, recovery and ramp: three sets, so that no number is right by chance.
LIMITS = ((1, 1, 1, 2), (3, 2, 4, 3), (2, 5, 3, 1))


def spin(*flags):
    try:
        done = subprocess.run(["spin", "-T", *flags, MODEL], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        sys.exit("traces: spin is missing: scripts/setup installs it")
    if done.returncode != 0 or "assertion violated" in done.stdout:
        sys.exit(f"traces: spin {' '.join(flags)}: {done.stdout[-1000:]}{done.stderr}")
    return done.stdout.splitlines()


def tables():
    return "\n".join(line for line in spin("-DTABLES=1") if "," in line) + "\n"


def write_traces(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.trace"):
        old.unlink()
    for number, (stale, hold, recovery, ramp) in enumerate(LIMITS):
        flags = [f"-DSTALE={stale}", f"-DHOLD={hold}", f"-DRECOVERY={recovery}", f"-DRAMP={ramp}", "-DTRACE=1", f"-u{STEPS}"]
        for seed, troubles in enumerate((TROUBLES[:4], TROUBLES)):
            lines = [line for line in spin(*flags, f"-n{10 * number + seed + 1}", *(f"-D{word}" for word in troubles))
                     if line.startswith(("tick", "restart"))]
            if len(lines) < 1000:
                sys.exit(f"traces: a walk of {len(lines)} lines only")
            text = "\n".join([f"limits {stale} {hold} {recovery} {ramp}", *lines]) + "\n"
            (folder / f"{number}_{seed}.trace").write_text(text)


def main(words):
    if words == ["--write-tables"]:
        TABLES.write_text(tables())
    elif words == ["--check-tables"]:
        if TABLES.read_text() != tables():
            print("traces: link_tables.csv is not what link.pml says; traces.py --write-tables writes it", file=sys.stderr)
            return 1
    elif len(words) == 1 and not words[0].startswith("-"):
        write_traces(Path(words[0]))
    else:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
