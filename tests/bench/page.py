#!/usr/bin/env python3
"""Measures the operator's page in a real Chromium: script time, draw calls, the first picture, and how old what is drawn is.

page.py --bin FOLDER [--topology FILE] [--url ADDRESS] [--loads N] [--seconds S] [--pages N] [--open MINUTES] [--graphics software|vulkan|egl]
        [--flag FLAG …] [--pictures drawn|none] [--fluid] [--profile FILE] [--json FILE] [--shots FOLDER]

Without --url the demo runs beside it. N loads (default 5), each without anything kept: when the first picture was drawn, and by the median load's
waterfall what came when. Then S seconds (default 20) of the last page: processor time of the page's thread by frame (so waiting for the
graphics is not in it), wall time of each frame's script and of taking each message, and the age of the arm's sample when it was sent, received
and drawn. With --pages, so many browsers show it in these seconds, and the rows are of all their frames. Of the demo it tells, too, what they cost
the viewer's thread `scene`, and how late master_io's servo was beside an empty loop of the same rate, over the whole session. `--open` leaves the
pages open for so long afterwards, and tells what the first one keeps before and after.
`--graphics`: by software (the default), or by the card through Vulkan or EGL, and --flag gives the browser a further flag; what drew is told.
`--pictures none` lets the browser's graphics draw nothing and copy nothing: what is left is not due to software that stands in for a
graphics card. `--fluid` shows a section and a shell, too. `--profile` writes where the scripts' time of these seconds went, as the browser's
developer tools read it, and tells the functions that took most. `--shots` leaves pictures of the page in FOLDER: on each of SCREENS in both
languages, while something threatens, with the drawers, and with each view large and enlarged.
"""
import argparse
import collections
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from chromium import GRAPHICS, LONGEST_S, Chromium
from viewers import processor_s

STARTS_S = 240  # at most, until all components are ready
# Width and height in CSS pixels, and whether it is touched.
SCREENS = [(1280, 720, False), (1500, 844, False), (1920, 1080, False), (2560, 1440, False), (1024, 768, True), (768, 1024, True)]
# What draws and what copies pictures does nothing; all else is as it is.
NO_PICTURES = """
{
  let scene;
  Object.defineProperty(window, 'phantomScene', { configurable: true, get: () => scene, set: desk => {
    scene = desk;
    desk.whole = true; // what is left out on purpose is not looked for in the picture
  } });
}
const nothing = (of, ...names) => names.forEach(name => { of[name] = () => {}; });
nothing(WebGL2RenderingContext.prototype, 'drawElements', 'drawArrays', 'drawElementsInstanced', 'drawArraysInstanced', 'clear');
nothing(CanvasRenderingContext2D.prototype, 'drawImage');
const extension = WebGL2RenderingContext.prototype.getExtension;
WebGL2RenderingContext.prototype.getExtension = function (name) {
  const found = extension.call(this, name);
  if (found && name === 'WEBGL_multi_draw') nothing(found, 'multiDrawElementsWEBGL', 'multiDrawArraysWEBGL', 'multiDrawElementsInstancedWEBGL');
  return found;
};
"""
# The operator's choice is that this browser draws, however slowly; the tour was seen.
CHOICE = "localStorage.setItem('phantom.pictures', 'browser'); localStorage.setItem('phantom.tour', 'seen');"
FOLLOW = """
const d = phantomScene, take = d.takePoses, message = d.connection.take, push = d.script_ms.push;
window.ages = { sent: [], received: [], drawn: d.ages_ms, received_ms: [], frames: 0, octets: d.connection.bytes };
d.script_ms.push = function (ms) { ++ages.frames; return push.call(this, ms); };
d.connection.take = function (data) {
  const begun = performance.now();
  message.call(this, data);
  ages.received_ms.push(performance.now() - begun);
};
d.ages_ms.length = d.script_ms.length = 0;
d.takePoses = function (poses, buffer) {
  const way_s = d.connection.clock.age_s(poses.time_s, performance.now() / 1000);
  if (way_s !== null) { ages.sent.push(1000 * poses.armAge_s); ages.received.push(1000 * (way_s + poses.armAge_s)); }
  take.call(d, poses, buffer);
};
"""
UNFOLLOW = """
const d = phantomScene;
delete d.script_ms.push;
delete d.takePoses;
delete d.connection.take;
delete window.ages;
"""
READY = """
const d = window.phantomScene;
return Boolean(d && d.shown && d.firstPicture_ms > 0 && d.stage.items.size > 0 && [...d.stage.items.values()].every(i => d.stage.meshes.has(i.mesh)));
"""


def eventually(probe, what, longest_s=LONGEST_S):
    until = time.monotonic() + longest_s
    while not (found := probe()):
        if time.monotonic() > until:
            sys.exit(f"page.py: {what} did not come in {longest_s} s")
        time.sleep(0.2)
    return found


def share(values, part):
    ordered = sorted(values)
    return ordered[int(part * (len(ordered) - 1))] if ordered else None


def summary(values):
    return {"p50": share(values, 0.5), "p95": share(values, 0.95), "p99": share(values, 0.99), "count": len(values)}


def told(values):
    if not values:
        return "none"
    return f"{share(values, 0.5):.1f} / {share(values, 0.95):.1f} / {share(values, 0.99):.1f}"


def load(browser, url):
    """Opens the page without anything kept: when the first picture was drawn, and what came when."""
    browser.command("Network.clearBrowserCache")
    browser.open("about:blank")
    browser.open(url)
    eventually(lambda: browser.run("return Boolean(window.phantomScene?.firstPicture_ms)"), "the first picture")
    found = browser.run("""
        const entries = [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')];
        return { first_picture_ms: phantomScene.firstPicture_ms, marks: performance.getEntriesByType('mark').map(m => [m.name, m.startTime]),
          came: entries.map(e => [e.name.replace(/^[a-z]+:..[^/]*/, ''), e.startTime, e.responseStart, e.responseEnd, e.transferSize]) };""")
    eventually(lambda: browser.run(READY), "all meshes")
    found["whole_ms"] = browser.run("return performance.now()")
    found["octets"] = browser.run("return phantomScene.connection.bytes + [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')]"
                                  ".filter(e => !e.name.includes('/stream/')).reduce((sum, e) => sum + e.transferSize, 0)")
    return found


def measure(browser, url, options, script, session):
    loads = [load(browser, url) for _ in range(options.loads)]
    loads.sort(key=lambda one: one["first_picture_ms"])
    median = loads[len(loads) // 2]
    print(f"first picture after (ms): {', '.join(str(round(one['first_picture_ms'])) for one in loads)}; {median['octets'] / 1e6:.2f} MB until all was there")
    for name, begun, first, end, octets in sorted(median["came"], key=lambda one: one[1]):
        if begun < median["first_picture_ms"]:
            print(f"    {begun:7.0f} {first:7.0f} {end:7.0f} ms {octets:8} octets  {name}")
    for name, at in median["marks"]:
        print(f"    {at:7.0f} ms {name}")
    if options.fluid:
        browser.run("phantomScene.fluid.choose({ on: true, object: 'pump', shells: 'outer', plane: 'z', cut: true })")
        eventually(lambda: browser.run("return phantomScene.stage.fluid.sectioned && phantomScene.stage.fluid.count > 0"), "the fluid")
    others = [Chromium(script, options.graphics, options.flag) for _ in range(options.pages - 1)]
    try:
        for other in others:
            load(other, url)
        result = watch([browser, *others], options, session)
        if options.open:
            result["kept"] = leave_open(browser, options, session)
    finally:
        for other in others:
            other.end()
    return {"loads": loads, **result}


def watch(browsers, options, session):
    """What the pages' frames cost, and how old what they draw is."""
    time.sleep(3)
    for browser in browsers:
        browser.run(FOLLOW)
    if options.profile:
        for name, values in {"enable": {}, "setSamplingInterval": {"interval": 200}, "start": {}}.items():
            browsers[0].command("Profiler." + name, **values)
    scene_s, before, began = viewer_s(session), [browser.processor_ms() for browser in browsers], time.monotonic()
    time.sleep(options.seconds)
    after, took_s = [browser.processor_ms() for browser in browsers], time.monotonic() - began
    core = (viewer_s(session) - scene_s) / took_s
    if options.profile:
        tell_profile(browsers[0].command("Profiler.stop")["profile"], options.profile)
    found = [browser.run("""
        const gl = phantomScene.stage.renderer.getContext(), names = gl.getExtension('WEBGL_debug_renderer_info');
        return { figures: phantomScene.figures(), ages, walls: phantomScene.script_ms, octets: phantomScene.connection.bytes - ages.octets,
          renderer: gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER) };""") for browser in browsers]
    frames = sum(one["ages"]["frames"] for one in found)
    script_ms, all_ms = (sum(b[i] - a[i] for a, b in zip(before, after)) / max(1, frames) for i in (0, 1))
    each_kB_s = sum(one["octets"] for one in found) / took_s / len(found) / 1e3
    print(f"drawn by {found[0]['renderer']}")
    print(f"{len(found)} pages, draw calls {found[0]['figures']['calls']}; frames a second by page "
          f"{', '.join(format(one['ages']['frames'] / took_s, '.1f') for one in found)}; {each_kB_s:.1f} kB/s each")
    if session:
        print(f"the viewer's thread scene took {100 * core:.2f} % of a core, {100 * core / len(found):.2f} % a page")
    print(f"processor time of the page's thread for each frame: scripts {script_ms:.2f} ms, with layout, painting and the browser's own {all_ms:.2f} ms")
    print("p50 / p95 / p99, ms:")
    ages = {name: [age for one in found for age in one["ages"][name]] for name in ("sent", "received", "drawn", "received_ms")}
    rows = {"wall time of a frame's script": [wall for one in found for wall in one["walls"]], "  of taking one message": ages["received_ms"],
            "age of the arm's sample as sent": ages["sent"], "  as received": ages["received"], "  as drawn": ages["drawn"]}
    for name, values in rows.items():
        print(f"    {name:36} {told(values)}")
    if options.shots:
        take_shots(browsers[0], options.shots)
    return {"renderer": found[0]["renderer"], "figures": found[0]["figures"], "pages": len(found), "frames_per_s": frames / took_s / len(found), "kB_s": each_kB_s,
            "core": core, "script_ms": script_ms, "thread_ms": all_ms, "frames": {name.strip(): summary(values) for name, values in rows.items()},
            "load": os.getloadavg()[0]}


def take_shots(browser, folder):
    """Pictures of the page on all screens, of its drawers and of its views' places."""
    folder.mkdir(parents=True, exist_ok=True)

    def shot(name):
        time.sleep(1.5)  # it is drawn at the new size
        browser.screenshot(folder / f"{name}.png")
    threatens = "return state.view.threatening && state.percept.threats.length > 0"
    for width_px, height_px, touch in SCREENS:
        browser.show_on(width_px, height_px, touch)
        for language in ("en", "de"):
            browser.run(f"speak('{language}')")
            eventually(lambda: browser.run(threatens), "a threat")
            shot(f"page_{width_px}x{height_px}_{language}")
    browser.show_on(1280, 720)
    for drawer in ("settings", "system", "history", "keys"):
        for language in ("en", "de"):
            browser.run(f"speak('{language}'); openDrawer('{drawer}')")
            shot(f"{drawer}_{language}")
            browser.run(f"openDrawer('{drawer}')")
    for view in ("hit", "tool"):
        browser.run(f"setLarge('{view}')")
        shot(f"large_{view}")
        browser.run("toggleEnlarged()")
        shot(f"enlarged_{view}")
    browser.run("setLarge('main')")


def viewer_s(session):
    return processor_s(session.pid, "scene") if session else 0.0


def tell_profile(profile, path):
    """Writes the profile, and tells by function how much of the time it ran itself."""
    path.write_text(json.dumps(profile))
    nodes, own_us = {node["id"]: node["callFrame"] for node in profile["nodes"]}, collections.Counter()
    for node, took_us in zip(profile["samples"], profile["timeDeltas"]):
        frame = nodes[node]
        own_us[f"{frame['functionName'] or '(anonymous)'} {frame['url'].rpartition('/')[2]}:{frame['lineNumber'] + 1}"] += took_us
    whole_us = sum(own_us.values())
    print("share of the seconds that functions of the first page ran themselves:")
    for name, took_us in own_us.most_common(24):
        print(f"    {100 * took_us / whole_us:6.2f} %  {name}")


def leave_open(browser, options, session):
    """What the page keeps, and which files the viewer has open, before and after some minutes."""
    def kept():
        found = browser.held()
        for process in Path("/proc").glob("[0-9]*/stat") if session else ():
            try:
                if int(process.read_text().rpartition(")")[2].split()[1]) == session.pid and b"synthetic_viewer" in (process.parent / "cmdline").read_bytes():
                    found["viewer_files"] = len(list((process.parent / "fd").iterdir()))
            except (FileNotFoundError, ProcessLookupError):
                continue  # it has ended
        return found
    browser.run(UNFOLLOW)  # what is measured would be counted with what the page keeps
    found = [kept()]
    time.sleep(60 * options.open)
    found.append(kept())
    print(f"what the page keeps, before and after {options.open:g} minutes: " + "; ".join(f"{name} {found[0][name]} and {found[1][name]}" for name in found[0]))
    return found


def tell_servo(report):
    """How late the servo woke up over the session, beside an empty loop of its rate."""
    loops = json.loads((report / "summary.json").read_text())["loops"]
    for name, words in {"servo": "the servo", "bare_loop": "an empty loop"}.items():
        loop = loops["master_io." + name]
        print(f"{words} woke up late by {loop['p50_us']:.0f} / {loop['p99_us']:.0f} µs (p50 / p99), {loop['slips']} slips of {loop['ticks']} ticks")
    return {name: loops["master_io." + name] for name in ("servo", "bare_loop")}


def main():
    sys.stdout.reconfigure(line_buffering=True)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("page.py: ended"))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=Path, help="folder of the executables, to run the demo")
    parser.add_argument("--topology", type=Path)
    parser.add_argument("--url", help="of a page that is there already")
    parser.add_argument("--loads", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--pages", type=int, default=1)
    parser.add_argument("--open", type=float, default=0, metavar="MINUTES")
    parser.add_argument("--graphics", choices=GRAPHICS, default="software")
    parser.add_argument("--flag", action="append", default=[], help="of the browser, as --flag=--disable-gpu-vsync")
    parser.add_argument("--profile", type=Path)
    parser.add_argument("--pictures", choices=["drawn", "none"], default="drawn")
    parser.add_argument("--fluid", action="store_true")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--shots", type=Path)
    options = parser.parse_args()
    if not options.url and not options.bin:
        parser.error("--bin or --url is needed")
    session = browser = None
    with tempfile.TemporaryDirectory(prefix="phantom_page_") as scratch:
        try:
            url = options.url
            if not url:
                more = ["--deployment", options.topology] if options.topology else []
                session = subprocess.Popen([options.bin / "phantom_session", "--report-dir", scratch + "/report", *more], stdout=subprocess.PIPE, text=True,
                                           env={**os.environ, "PHANTOM_STATE_DIR": scratch + "/state"})
                until = time.monotonic() + STARTS_S
                while not (found := re.search(r"Operator's page: (http\S+)", line := session.stdout.readline())):
                    if not line or time.monotonic() > until:
                        sys.exit("page.py: the demo did not start")
                url = found[1]
            script = CHOICE + (NO_PICTURES if options.pictures == "none" else "")
            browser = Chromium(script, options.graphics, options.flag)
            result = measure(browser, url, options, script, session)
            print(f"    load of the machine {result['load']:.1f}")
        finally:
            if browser:
                browser.end()
            if session:
                session.send_signal(signal.SIGINT)
                session.communicate(timeout=STARTS_S)
        if session:
            result.update(tell_servo(Path(scratch, "report")))
        if options.json:
            options.json.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
