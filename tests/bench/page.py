#!/usr/bin/env python3
"""Measures the operator's page in a real Chromium: script time, draw calls, the first picture, and how old what is drawn is.

page.py --bin FOLDER [--topology FILE] [--url ADDRESS] [--loads N] [--seconds S] [--pictures drawn|none] [--fluid] [--json FILE] [--shots FOLDER]

Without --url the demo runs beside it. N loads (default 5), each without anything kept: when the first picture was drawn, and by the median load's
waterfall what came when. Then S seconds (default 20) of the last page: processor time of the page's thread by frame (so waiting for the
graphics is not in it), wall time of each frame's script and of taking each message, and the age of the arm's sample when it was sent, received
and drawn. `--pictures none` lets the browser's graphics draw nothing and copy nothing: what is left is not due to software that stands in for a
graphics card. `--fluid` shows a section and a shell, too.
"""
import argparse
import base64
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

STARTS_S = 240  # at most, until all components are ready
LONGEST_S = 300
ARGUMENTS = ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
             "--disable-sync", "--disable-dev-shm-usage", "--window-size=1600,1300", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
# What draws and what copies pictures does nothing; all else is as it is.
NO_PICTURES = """
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
# The operator's choice is that this browser draws, however slowly.
CHOICE = "localStorage.setItem('phantom.pictures', 'browser');"
FOLLOW = """
const d = phantomScene, take = d.takePoses, message = d.connection.take, push = d.script_ms.push;
window.ages = { sent: [], received: [], drawn: d.ages_ms, received_ms: [], frames: 0 };
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


class Chromium:
    """A browser of its own, steered over the W3C WebDriver protocol."""

    def __init__(self, script):
        self.driver = subprocess.Popen([shutil.which("chromedriver"), "--port=0"], stdout=subprocess.PIPE, text=True, start_new_session=True)
        for line in self.driver.stdout:
            if found := re.search(r"started successfully on port (\d+)", line):
                self.address = f"http://127.0.0.1:{found[1]}"
                break
        wanted = {"browserName": "chrome", "pageLoadStrategy": "eager", "timeouts": {"script": 1000 * LONGEST_S},
                  "goog:chromeOptions": {"binary": shutil.which("chromium"), "args": ARGUMENTS}}
        self.session = "/session/" + self.begin(wanted)["sessionId"]
        self.command("Performance.enable", timeDomain="threadTicks")  # without what it waits
        self.command("Page.addScriptToEvaluateOnNewDocument", source=script)

    def begin(self, wanted, tries=3):
        """On a machine under load a browser's start now and then fails; that says nothing about the page."""
        try:
            return self.post("/session", {"capabilities": {"alwaysMatch": wanted}})
        except urllib.error.HTTPError:
            if tries == 1:
                raise
            return self.begin(wanted, tries - 1)

    def post(self, path, body):
        request = urllib.request.Request(self.address + path, json.dumps(body).encode(), {"Content-Type": "application/json"})
        with urllib.request.urlopen(request, timeout=2 * LONGEST_S) as answer:
            return json.load(answer)["value"]

    def command(self, name, **parameters):
        return self.post(self.session + "/goog/cdp/execute", {"cmd": name, "params": parameters})

    def run(self, script):
        return self.post(self.session + "/execute/sync", {"script": script, "args": []})

    def open(self, url):
        self.post(self.session + "/url", {"url": url})

    def processor_ms(self):
        """Processor time of the page's thread so far: in scripts, and in all."""
        found = {one["name"]: 1000 * one["value"] for one in self.command("Performance.getMetrics")["metrics"]}
        return found["ScriptDuration"], found["TaskDuration"]

    def screenshot(self, path):
        with urllib.request.urlopen(self.address + self.session + "/screenshot", timeout=LONGEST_S) as answer:
            path.write_bytes(base64.b64decode(json.load(answer)["value"]))

    def end(self):
        os.killpg(self.driver.pid, signal.SIGKILL)
        self.driver.wait()


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


def measure(browser, url, options):
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
    time.sleep(3)
    browser.run(FOLLOW)
    before = browser.processor_ms()
    time.sleep(options.seconds)
    after = browser.processor_ms()
    figures, ages, walls, received_ms = browser.run("return [phantomScene.figures(), ages, phantomScene.script_ms, ages.received_ms]")
    frames = browser.run("return ages.frames")
    script_ms, all_ms = ((b - a) / max(1, frames) for a, b in zip(before, after))
    print(f"draw calls {figures['calls']}; {frames} frames, {figures['frames_per_s'] or 0:.1f} a second while all moves")
    print(f"processor time of the page's thread for each frame: scripts {script_ms:.2f} ms, with layout, painting and the browser's own {all_ms:.2f} ms")
    print("p50 / p95 / p99, ms:")
    rows = {"wall time of a frame's script": walls, "  of taking one message": received_ms,
            "age of the arm's sample as sent": ages["sent"], "  as received": ages["received"], "  as drawn": ages["drawn"]}
    for name, values in rows.items():
        print(f"    {name:36} {told(values)}")
    if options.shots:
        browser.screenshot(options.shots / "page.png")
    return {"loads": loads, "figures": figures, "script_ms": script_ms, "thread_ms": all_ms, "frames": {name.strip(): summary(values) for name, values in rows.items()}, "load": os.getloadavg()[0]}


def main():
    sys.stdout.reconfigure(line_buffering=True)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("page.py: ended"))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=Path, help="folder of the executables, to run the demo")
    parser.add_argument("--topology", type=Path)
    parser.add_argument("--url", help="of a page that is there already")
    parser.add_argument("--loads", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20)
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
                more = ["--topology", options.topology] if options.topology else []
                session = subprocess.Popen([options.bin / "phantom_session", "--report-dir", scratch + "/report", *more], stdout=subprocess.PIPE, text=True,
                                           env={**os.environ, "XDG_STATE_HOME": scratch + "/state"})
                until = time.monotonic() + STARTS_S
                while not (found := re.search(r"Operator's page: (http\S+)", line := session.stdout.readline())):
                    if not line or time.monotonic() > until:
                        sys.exit("page.py: the demo did not start")
                url = found[1]
            browser = Chromium(CHOICE + (NO_PICTURES if options.pictures == "none" else ""))
            result = measure(browser, url, options)
            print(f"    load of the machine {result['load']:.1f}")
            if options.json:
                options.json.write_text(json.dumps(result, indent=1))
        finally:
            if browser:
                browser.end()
            if session:
                session.send_signal(signal.SIGINT)
                session.communicate(timeout=STARTS_S)


if __name__ == "__main__":
    main()
