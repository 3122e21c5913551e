"""Building for the scripts that run what they build: quiet when all goes well, the compiler's words when it does not."""
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def build(script, folder, targets, *definitions):
    """Configures `folder` for a release, if it is new or `definitions` are given, and builds `targets` in it; ends the script
    with 1 if that fails, with 3 if there is no CMake."""
    steps = [["cmake", "--build", folder, "--parallel", str(os.cpu_count() or 2), "--target", *targets]]
    if definitions or not (Path(folder) / "build.ninja").exists():
        # As README has it, so that what stands in the folder need not be compiled again.
        steps.insert(0, ["cmake", "--preset", "release", "-S", ROOT, "-B", folder, *definitions])
    print(f"{script}: building {' '.join(targets)} in {folder}, which takes minutes the first time", file=sys.stderr)
    for step in steps:
        try:
            done = subprocess.run(step, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        except FileNotFoundError as missing:
            print(f"{script}: {missing.filename} is missing; scripts/setup installs it", file=sys.stderr)
            sys.exit(3)
        if done.returncode:
            print(done.stdout[-8000:], file=sys.stderr)
            print(f"{script}: this failed: {' '.join(map(str, step))}", file=sys.stderr)
            sys.exit(1)
