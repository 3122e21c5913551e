"""The report of a run: schedule.json, verdicts.json, violations.txt, logs, plots (gnuplot), index.html."""
import html
import json
import shutil
import statistics
import subprocess
from collections import Counter, defaultdict

LINK = ("init", "ready", "aligned", "coupled", "degraded", "stopped")


def number(value):
    return "–" if value is None else f"{value:.3g}"


def rows(verdicts):
    for rule in verdicts["rules"]:
        bad = len(rule["violations"])
        yield (rule["name"], f"{rule['checks']:,}", f"{rule['unobservable']:,}", f"{number(rule['worst'])} {rule['unit'] if rule['worst'] is not None else ''}".strip(),
               number(rule["bound"]), "held" if not bad else f"{bad} VIOLATIONS")


def recoveries(verdicts):
    by_kind = defaultdict(list)
    for entry in verdicts["recoveries"]:
        by_kind[entry["kind"]].append(entry["s"])
    return by_kind


def table(folder):
    """The summary in words and columns (Markdown)."""
    verdicts, run = (json.loads((folder / name).read_text()) for name in ("verdicts.json", "schedule.json"))
    kinds = Counter(step["kind"] for step in run["steps"])
    actions = Counter(a["do"] for step in run["steps"] for a in step["actions"])
    lines = [f"{run['mode']}, seed {run['seed']}: {run['seconds'] / 60:.1f} min, {len(run['steps'])} steps; load of the machine ({run['cores']} cores) "
             f"{run['load'][0]:.1f} before, {run['load'][1]:.1f} after; {verdicts['seen']['records']:,} records seen, {verdicts['seen']['out_of_order']:,} out of order",
             "", "| invariant | checks | unobservable | worst that held | bound | |", "|---|---|---|---|---|---|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows(verdicts)]
    lines += ["", "| step | times | recovered, median s | slowest s |", "|---|---|---|---|"]
    took = recoveries(verdicts)
    for kind, times in sorted(kinds.items()):
        found = took.get(kind, [])
        lines.append(f"| {kind} | {times} | {number(statistics.median(found)) if found else '–'} | {number(max(found)) if found else '–'} |")
    lines += ["", "Actions: " + ", ".join(f"{do} {count}" for do, count in actions.most_common()) + ".",
              "Memory, greatest growth once settled (MiB): " + (", ".join(f"{name} {value:.1f}" for name, value in sorted(verdicts["growth_MiB"].items())) or "not measured") + "."]
    return "\n".join(lines)


def plot(folder, verdicts, facts):
    """timeline.png: the state of either side, and when steps began; without gnuplot there is none."""
    if shutil.which("gnuplot") is None:
        return False
    for side in ("master", "slave"):
        changes = [(e["t_s"], e["state"]) for e in verdicts["timeline"] if e["side"] == side]
        changes.append((verdicts["seen"]["seconds"], changes[-1][1] if changes else 0))
        (folder / f"{side}.dat").write_text("".join(f"{t} {state}\n" for t, state in changes))
    begin = facts[0]["t"] if facts else 0.0
    (folder / "steps.dat").write_text("".join(f"{f['t'] - begin} -0.6 {f['kind']}\n" for f in facts if f["fact"] == "step") or "0 -0.6 -\n")
    tics = ", ".join(f'"{name}" {i}' for i, name in enumerate(LINK))
    width = int(min(12000, max(1200, verdicts["seen"]["seconds"] * 8)))
    script = (f'set terminal pngcairo size {width},520\nset output "{folder}/timeline.png"\nset ytics ({tics})\nset yrange [-3.2:5.6]\nset xlabel "s"\nset grid x\n'
              f'plot "{folder}/master.dat" using 1:2 with steps lw 2 title "master", "{folder}/slave.dat" using 1:($2+0.12) with steps lw 2 title "slave", '
              f'"{folder}/steps.dat" using 1:2:3 with labels rotate by 90 right font ",8" notitle, "{folder}/steps.dat" using 1:2 with impulses lc "gray" notitle\n')
    done = subprocess.run(["gnuplot"], input=script, text=True, capture_output=True)
    for name in ("master.dat", "slave.dat", "steps.dat"):
        (folder / name).unlink()
    return done.returncode == 0


def page(folder, violations, plotted):
    body, in_table = [], False
    for line in table(folder).splitlines():
        if line.startswith("|"):
            if set(line) <= set("|-"):
                continue
            cells = "".join(f"<td>{html.escape(cell.strip())}</td>" for cell in line.strip("|").split("|"))
            body.append(("" if in_table else "<table>") + f"<tr>{cells}</tr>")
            in_table = True
        else:
            body.append(("</table>" if in_table else "") + f"<p>{html.escape(line)}</p>")
            in_table = False
    if in_table:
        body.append("</table>")
    bad = f"<h2>Violations</h2><pre>{html.escape(violations)}</pre>" if violations else "<p>Every invariant held.</p>"
    picture = '<div style="overflow-x: auto"><img src="timeline.png"></div>' if plotted else ""
    (folder / "index.html").write_text("<!doctype html><meta charset=utf-8><title>Chaos</title><style>body{font:15px sans-serif;margin:2em}td{border:1px solid #ccc;padding:2px 8px}"
                                       "table{border-collapse:collapse}</style><h1>The system under chaos</h1>" + bad + picture + "\n".join(body))


def write(run_folder, folder, about, with_recordings):
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("verdicts.json", "facts.jsonl", "limits.json"):
        shutil.copy(run_folder / name, folder / name)
    (folder / "schedule.json").write_text(json.dumps(about, indent=1))
    violations = (run_folder / "observer.log").read_text()
    (folder / "violations.txt").write_text(violations)
    shutil.rmtree(folder / "logs", ignore_errors=True)
    shutil.copytree(run_folder / "logs", folder / "logs")
    shutil.rmtree(folder / "taps", ignore_errors=True)
    shutil.rmtree(folder / "drives", ignore_errors=True)
    if violations or with_recordings:  # to look into, and for `observer.py FOLDER`
        shutil.copytree(run_folder / "taps", folder / "taps")
        shutil.copytree(run_folder / "drives", folder / "drives")
    verdicts = json.loads((folder / "verdicts.json").read_text())
    facts = [json.loads(line) for line in (folder / "facts.jsonl").read_text().splitlines()]
    page(folder, violations, plot(folder, verdicts, facts))
