#!/usr/bin/env python3
"""Draws what experiments left: for each OUT/ID/plots.json its plots as SVG, and OUT/index.html, a page that shows them beside
what the thesis states. Needs Debian's python3-matplotlib.

usage: draw.py OUT LIST.json      LIST.json: what `experiments --list --json` prints
"""
import base64
import csv
import html
import json
import math
import re
import string
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

STYLE = {
    "font.size": 9, "axes.titlesize": 9.5, "axes.labelsize": 9, "legend.fontsize": 7.5, "figure.titlesize": 10.5,
    "axes.grid": True, "grid.color": "#dddddd", "grid.linewidth": 0.6, "axes.axisbelow": True,
    "axes.spines.top": False, "axes.spines.right": False, "lines.linewidth": 1.3,
    # Okabe and Ito's colours: told apart by the colour-blind too.
    "axes.prop_cycle": matplotlib.cycler(color=["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#8c6d31"]),
    "svg.fonttype": "path", "svg.hashsalt": "phantom",
}
SUPERSCRIPT = dict(zip("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
PANEL_INCHES = {1: (7.2, 3.2), 2: (4.4, 3.2), 3: (3.6, 3.2), 4: (2.9, 2.7)}


def read_table(path):
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    columns = rows[0]
    values = [[float(cell) if cell else math.nan for cell in row] for row in rows[1:]]
    return {name: [row[i] for row in values] for i, name in enumerate(columns)}


def draw_map(axes, x, y, values, label):
    xs, ys = sorted(set(x)), sorted(set(y))
    column, row = {v: i for i, v in enumerate(xs)}, {v: i for i, v in enumerate(ys)}
    cells = [[math.nan] * len(xs) for _ in ys]
    for a, b, value in zip(x, y, values):
        cells[row[b]][column[a]] = value
    half_x, half_y = (0.5 * (v[-1] - v[0]) / max(len(v) - 1, 1) or 0.5 for v in (xs, ys))
    kinds = sorted({value for value in values if not math.isnan(value)})
    whole = kinds[-1] - kinds[0] <= 12 and all(value == int(value) for value in kinds)  # kinds or layers: a colour each
    colours = matplotlib.colormaps["viridis"].resampled(int(kinds[-1] - kinds[0]) + 1) if whole else "viridis"
    limits = {"vmin": kinds[0] - 0.5, "vmax": kinds[-1] + 0.5} if whole else {}
    image = axes.imshow(cells, origin="lower", aspect="auto", interpolation="nearest", cmap=colours, **limits,
                        extent=(xs[0] - half_x, xs[-1] + half_x, ys[0] - half_y, ys[-1] + half_y))
    axes.grid(False)
    axes.figure.colorbar(image, ax=axes, label=label, shrink=0.75, ticks=range(int(kinds[0]), int(kinds[-1]) + 1) if whole else None)


def draw_series(axes, series, tables, bars):
    table = tables[series["table"]]
    x, y = table[series["x"]], table[series["y"]]
    kind, label = series["kind"], series["label"]
    if kind == "map":
        draw_map(axes, x, y, table[series["value"]], label)
    elif kind == "arrows":
        axes.quiver(x, y, table[series["u"]], table[series["v"]], label=label, angles="xy", color="#D55E00", width=0.006, scale=11)
    elif kind == "bars":
        index, count = bars
        width = 0.8 / count
        axes.bar([v + (index - (count - 1) / 2) * width for v in x], y, width=width, label=label)
    elif kind == "points":
        axes.plot(x, y, linestyle="none", marker="o", markersize=3, label=label)
    elif kind == "step":
        axes.step(x, y, where="post", label=label)
    else:
        axes.plot(x, y, linestyle="--" if kind == "dashed" else "-", label=label)


def sentence(text):
    """With a capital letter, but for a symbol: "x [mm]", "μ felt"."""
    return text[0].upper() + text[1:] if re.match(r"[a-z]{2}|[a-z] (?!\[)", text) and not re.match(r"[a-z] of |[a-z],", text) else text


def draw_panel(axes, panel, tables):
    if panel["log_x"]:
        axes.set_xscale("log")
    if panel["log_y"]:
        axes.set_yscale("log")
    bars = [s for s in panel["series"] if s["kind"] == "bars"]
    for series in panel["series"]:
        draw_series(axes, series, tables, (bars.index(series), len(bars)) if series in bars else None)
    for mark in panel["marks"]:
        across = mark["axis"] == "x"
        if mark["from"] == mark["to"]:
            (axes.axvline if across else axes.axhline)(mark["from"], color="#666666", linestyle=":", linewidth=1.1, label=mark["label"])
        else:
            (axes.axvspan if across else axes.axhspan)(mark["from"], mark["to"], color="#E69F00", alpha=0.16, linewidth=0, label=mark["label"])
    axes.set(title=panel["title"], xlabel=sentence(panel["x"]), ylabel=sentence(panel["y"]))
    if panel["names_x"]:
        axes.set_xticks(range(len(panel["names_x"])), panel["names_x"])
    if panel["range_x"]:
        axes.set_xlim(panel["range_x"])
    if panel["range_y"]:
        axes.set_ylim(panel["range_y"])
    if panel["equal"]:
        axes.set_aspect("equal")


def legends_of(panel_axes):
    """(axes, handles, labels) of the legends needed; panels with the same entries share the first one's."""
    seen = set()
    for axes in panel_axes:
        handles, labels = axes.get_legend_handles_labels()
        found = {}
        for handle, label in zip(handles, labels):
            if label:
                found.setdefault(label, handle)
        if found and tuple(found) not in seen:
            seen.add(tuple(found))
            yield axes, list(found.values()), list(found)


def draw_plot(folder, plot, tables):
    panels = plot["panels"]
    columns = min(plot["columns"], len(panels))
    rows = math.ceil(len(panels) / columns)
    width, height = PANEL_INCHES[min(columns, 4)]
    with matplotlib.rc_context(STYLE):
        figure, grid = plt.subplots(rows, columns, figsize=(width * columns, height * rows + 0.6), squeeze=False, layout="constrained")
        every = [axes for row in grid for axes in row]
        for letter, axes, panel in zip(string.ascii_lowercase, every, panels):
            draw_panel(axes, panel, tables)
            if len(panels) > 1:
                axes.set_title(f"({letter}) {panel['title']}".rstrip())
        for axes in every[len(panels):]:
            axes.remove()
        legends = list(legends_of(every[:len(panels)]))
        if len(legends) == 1 and len(panels) > 1:  # one for all, below them
            across = min(3, len(legends[0][2]))
            share = (0.1 + 0.18 * math.ceil(len(legends[0][2]) / across)) / figure.get_figheight()
            figure.legend(*legends[0][1:], loc="lower center", ncols=across, frameon=False)
            figure.get_layout_engine().set(rect=(0, share, 1, 1 - share))
        else:
            for axes, handles, labels in legends:
                axes.legend(handles, labels, loc="best", framealpha=0.85)
        path = folder / f"{plot['name']}.svg"
        figure.savefig(path, metadata={"Date": None})
        plt.close(figure)
    return path


def draw_experiment(folder):
    """The experiment's plots as SVG; what plots.json and checks.json say."""
    drawn = json.loads((folder / "plots.json").read_text(encoding="utf-8"))
    names = {s["table"] for plot in drawn["plots"] for panel in plot["panels"] for s in panel["series"]}
    tables = {name: read_table(folder / f"{name}.csv") for name in names}
    drawn["files"] = [draw_plot(folder, plot, tables) for plot in drawn["plots"]]
    checks = json.loads((folder / "checks.json").read_text(encoding="utf-8"))
    drawn["checks"] = [check for check in checks if "thesis" not in check]
    drawn["printed"] = [check for check in checks if "thesis" in check]
    return drawn


def figure_text(value):
    if value is None:
        return "not a number"
    digits, _, exponent = f"{value:.4g}".partition("e")
    return digits.replace("-", "−") + (f" × 10{''.join(SUPERSCRIPT[c] for c in str(int(exponent)))}" if exponent else "")


def band_text(check):
    """JSON has no infinity: an end that is missing is open."""
    low = "−∞" if check["low"] is None else figure_text(check["low"])
    high = "∞" if check["high"] is None else figure_text(check["high"])
    return f"{low} … {high}"


def check_rows(checks):
    for check in checks:
        unit = " " + html.escape(check["unit"]) if check["unit"] else ""
        verdict = "pass" if check["passed"] else "fail"
        yield (f"<tr class={verdict}><td>{html.escape(check['what'])}</td><td>{figure_text(check['value'])}{unit}</td>"
               f"<td>{band_text(check)}{unit}</td><td>{verdict}</td></tr>")


def inline_svg(path, number):
    """The drawing without its XML head, its ids made unique on the page."""
    text = path.read_text(encoding="utf-8")
    text = text[text.index("<svg"):]
    for id_ in set(re.findall(r'id="([^"]+)"', text)):
        text = re.sub(rf'(id="|href="#|url\(#){re.escape(id_)}(?=["\)])', rf"\g<1>n{number}_{id_}", text)
    return re.sub(r'<svg ([^>]*?)width="[^"]*"|<svg ([^>]*?)height="[^"]*"', lambda m: "<svg " + (m.group(1) or m.group(2)), text, count=1)


CSS = """
body { font: 15px/1.5 "DejaVu Sans", system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; color: #1a1a1a }
h1 { font-size: 1.6rem } h2 { font-size: 1.25rem; margin-top: 3rem; border-bottom: 1px solid #bbb }
table { border-collapse: collapse; width: 100%; font-size: .88rem; margin: .8rem 0 }
th, td { text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #ddd; vertical-align: top }
tr.fail td { background: #fbe3e0; font-weight: 600 } tr.pass td:last-child { color: #00664a }
figure { margin: 1rem 0 } figure svg, figure img { max-width: 100%; height: auto; display: block; margin: auto }
figcaption { font-size: .85rem; color: #444 } .source { color: #555 } .difference { background: #f3f3f3; padding: .4rem .8rem; margin: .4rem 0 }
@media print { body { font-size: 10pt; margin: 0; max-width: none } h2 { break-before: page; margin-top: 0 }
  figure, tr, .difference { break-inside: avoid } a { color: inherit; text-decoration: none } @page { size: A4; margin: 14mm } }
"""


def difference_text(printed):
    """Ours less the thesis's, with its unit and as a share."""
    thesis, ours = printed["thesis"], printed["value"]
    if ours is None:  # not a number
        return "not a number"
    less = 0.0 if abs(ours - thesis) < 1e-9 * abs(thesis) else ours - thesis  # not how numbers are rounded
    share = f" ({figure_text(100 * less / abs(thesis))} %)" if thesis else ""
    return f"{figure_text(less)} {html.escape(printed['unit'])}".rstrip() + share


def caption(number, index, text):
    lines = [line.rstrip(".,;") for line in text.split("\n")]
    return f"<figcaption><b>Figure {number + 1}.{index + 1}.</b> {html.escape(sentence('; '.join(lines)))}.</figcaption>"


def section(entry, folder, drawn, number):
    yield f"<h2 id='{entry['id']}'>{number + 1} {html.escape(entry['title'])}</h2>"
    yield f"<p class=source>Thesis: {html.escape(entry['source'])}. Run again with <code>scripts/experiments {entry['id']}</code>.</p>"
    yield f"<p><b>The thesis states:</b> {html.escape(entry['statement'])}</p>"
    yield f"<p class=source>Fails under the broken laws {', '.join(entry['fails_under'])}.</p>"
    if drawn is None:
        yield "<p class=difference>Not run.</p>"
        return
    for i, (path, plot) in enumerate(zip(drawn["files"], drawn["plots"])):
        yield f"<figure>{inline_svg(path, f'{number}_{i}')}{caption(number, i, plot['title'])}</figure>"
    for i, picture in enumerate(drawn["pictures"], len(drawn["files"])):
        data = base64.b64encode((folder / picture["file"]).read_bytes()).decode()
        alt = html.escape(picture["caption"])
        yield f"<figure><img src='data:image/png;base64,{data}' alt='{alt}'>{caption(number, i, picture['caption'])}</figure>"
    yield "<table><tr><th>Checked</th><th>Ours</th><th>Allowed</th><th></th></tr>"
    yield from check_rows(drawn["checks"])
    yield "</table>"
    if drawn["printed"]:
        yield "<table><tr><th>The thesis prints</th><th>Where</th><th>Thesis</th><th>Ours</th><th>Difference</th><th>Allowed</th><th></th></tr>"
        for p in drawn["printed"]:
            words = [html.escape(p["what"]), html.escape(p["place"]), *(f"{figure_text(p[k])} {html.escape(p['unit'])}" for k in ("thesis", "value")),
                     difference_text(p), f"{band_text(p)} {html.escape(p['unit'])}", "pass" if p["passed"] else "fail"]
            yield f"<tr class={words[-1]}>" + "".join(f"<td>{word}</td>" for word in words) + "</tr>"
        yield "</table>"
    for text in drawn["prints_no_more"]:
        yield f"<p class=difference><b>Nothing more to lay beside:</b> {html.escape(text)}</p>"
    for text in drawn["differences"]:
        yield f"<p class=difference><b>Ours differs:</b> {html.escape(text)}</p>"


def page(out, entries, results):
    yield "<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width'>"
    yield f"<title>Phantom: the thesis's experiments</title><style>{CSS}</style></head><body>"
    yield "<h1>The thesis's experiments, run with this product</h1>"
    yield "<p>Made by <code>scripts/experiments</code>: every figure comes from the product's own libraries and executables. "
    yield "The first check of each experiment stands here; all of them stand with it.</p>"
    yield "<table><tr><th>Experiment</th><th>Thesis</th><th>Checked</th><th>Ours</th><th>Allowed</th><th>Checks</th></tr>"
    for entry in entries:
        drawn = results.get(entry["id"])
        name = f"<td><a href='#{entry['id']}'>{html.escape(entry['title'])}</a></td><td>{html.escape(entry['source'])}</td>"
        if drawn is None:
            yield f"<tr>{name}<td colspan=3></td><td>not run</td></tr>"
            continue
        judged = drawn["checks"] + drawn["printed"]
        failed = sum(not check["passed"] for check in judged)
        first = next(iter(check_rows(judged[:1])))
        cells = re.sub(r"^<tr[^>]*>|<td>[^<]*</td></tr>$", "", first)
        of_all = f"{len(judged) - failed} of {len(judged)} pass"
        yield f"<tr class={'fail' if failed else 'pass'}>{name}{cells}<td>{of_all}</td></tr>"
    yield "</table>"
    for number, entry in enumerate(entries):
        yield from section(entry, out / entry["id"], results.get(entry["id"]), number)
    yield "</body></html>\n"


def main(arguments):
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    out, entries = Path(arguments[0]), json.loads(Path(arguments[1]).read_text(encoding="utf-8"))
    results = {}
    for entry in entries:
        folder = out / entry["id"]
        if (folder / "plots.json").exists():
            results[entry["id"]] = draw_experiment(folder)
    (out / "index.html").write_text("\n".join(page(out, entries, results)), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
