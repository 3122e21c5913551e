#!/usr/bin/env python3
"""The operator's page in a real Firefox: it loads, shows the state and the viewer's picture, draws the cell as the viewer does, and no script fails.

firefox_test.py SYNTHETIC_VIEWER

The folder of SYNTHETIC_VIEWER has wva_server, too, which gives the cell. Firefox is steered by its own protocol (Marionette), and draws by software
on a display of its own (Xvfb): headless it has no WebGL. Exit
code 77 where it is missing. PHANTOM_SCREENSHOTS names a folder that gets pictures of the page.
"""
import base64
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SKIPPED = 77
LONGEST_S = 180  # of each thing that is waited for, on a machine that may be busy
LEAST_AGREEMENT = 0.95  # of the pixels of both pictures
# Draws the main view as large as the viewer's picture, and compares the two between that one's banner and figures. `before`: what is done to the scene before.
COMPARE = """
window.agreement = null;
const d = phantomScene, v = d.views.main, theirs = new Image();
theirs.onload = () => {
  const [width, height] = [theirs.naturalWidth, theirs.naturalHeight];
  const pixels = of => {
    const context = Object.assign(document.createElement('canvas'), { width, height }).getContext('2d');
    context.drawImage(of, 0, 0);
    return context.getImageData(0, 0, width, height).data;
  };
  BEFORE;
  Object.assign(v.canvas, { width, height });
  d.stage.update();
  d.stage.draw('main', d.camera(v), v.context);
  const a = pixels(v.canvas), b = pixels(theirs);
  let same = 0, all = 0, bright = 0;
  for (let y = Math.round(0.37 * height); y < 0.86 * height; ++y) {
    for (let at = 4 * y * width; at < 4 * (y + 1) * width; at += 4, ++all) {
      const off = Math.max(Math.abs(a[at] - b[at]), Math.abs(a[at + 1] - b[at + 1]), Math.abs(a[at + 2] - b[at + 2]));
      same += off <= 20 ? 1 : 0;
      bright += Math.max(a[at], a[at + 1], a[at + 2]) > 90 ? 1 : 0;
    }
  }
  window.agreement = { same: same / all, bright: bright / all, items: d.stage.items.size };
};
theirs.src = `snapshot/main.png?${Date.now()}`;
"""


def eventually(probe, what):
    until = time.monotonic() + LONGEST_S
    while not (found := probe()):
        if time.monotonic() > until:
            sys.exit(f"firefox_test: {what() if callable(what) else what} did not come in {LONGEST_S} s")
        time.sleep(0.1)
    return found


class Firefox:
    """A browser with a profile of its own, on a display that nobody sees where there is one, else headless."""

    def __init__(self, program, folder):
        self.display, shown = start_display()
        (folder / "user.js").write_text('user_pref("marionette.port", 0);\nuser_pref("webgl.force-enabled", true);\nuser_pref("app.update.enabled", false);\n'
                                        'user_pref("datareporting.policy.dataSubmissionEnabled", false);\n'
                                        'user_pref("toolkit.telemetry.reportingpolicy.firstRun", false);\n')
        self.log = (folder / "firefox.log").open("w+")
        self.process = subprocess.Popen([program, *([] if shown else ["--headless"]), "--no-remote", "--marionette", "--remote-allow-system-access", "--profile", folder,
                                         "--width", "1600", "--height", "1300"], stdout=self.log, stderr=self.log, start_new_session=True,
                                        env={**os.environ, "HOME": str(folder), "MOZ_DISABLE_CONTENT_SANDBOX": "1", "LIBGL_ALWAYS_SOFTWARE": "1", **shown})
        port = folder / "MarionetteActivePort"
        eventually(lambda: (port.exists() and port.read_text().strip()) or self.process.poll() is not None, "Firefox")
        if self.process.poll() is not None:
            self.log.seek(0)
            sys.exit(f"firefox_test: Firefox has ended: {self.log.read()[-2000:]}")
        self.socket = socket.create_connection(("127.0.0.1", int(port.read_text())), timeout=LONGEST_S)
        self.number = 0
        self.receive()  # who it is
        self.ask("WebDriver:NewSession", {"pageLoadStrategy": "eager"})

    def receive(self):
        head = b""
        while not head.endswith(b":"):
            head += self.octets(1)
        return json.loads(self.octets(int(head[:-1])))

    def octets(self, count):
        got = b""
        while len(got) < count:
            piece = self.socket.recv(count - len(got))
            if not piece:
                sys.exit("firefox_test: Firefox has hung up")
            got += piece
        return got

    def ask(self, command, parameters=None):
        self.number += 1
        text = json.dumps([0, self.number, command, parameters or {}]).encode()
        self.socket.sendall(str(len(text)).encode() + b":" + text)
        _, _, problem, result = self.receive()
        if problem:
            sys.exit(f"firefox_test: {command}: {problem['error']}: {problem['message']}")
        return result

    def run(self, script):
        """What `return` gives of a script in the page."""
        return self.ask("WebDriver:ExecuteScript", {"script": script, "args": [], "sandbox": None})["value"]

    def failures(self, url):
        """Errors of the page's scripts so far, as the browser's console has them."""
        self.ask("Marionette:SetContext", {"value": "chrome"})
        found = self.ask("WebDriver:ExecuteScript", {"args": [url], "script": """
            const url = arguments[0], warning = Ci.nsIScriptError.warningFlag;
            return Services.console.getMessageArray().filter(m => m instanceof Ci.nsIScriptError && m.sourceName.startsWith(url) && !(m.flags & warning))
              .map(m => `${m.sourceName}:${m.lineNumber}: ${m.errorMessage}`);"""})["value"]
        self.ask("Marionette:SetContext", {"value": "content"})
        return found

    def end(self):
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()
        if self.display:
            self.display.terminate()
            self.display.wait()


def start_display():
    """A display in memory, and how programs are told of it; none where Xvfb is missing."""
    if shutil.which("Xvfb") is None:
        return None, {}
    display = subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "1600x1300x24", "-nolisten", "tcp"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return display, {"DISPLAY": ":" + display.stdout.readline().strip()}


def serve(program, folder):
    """A viewer without a system, and its page's address."""
    config = folder / "viewer.yaml"
    config.write_text("frame_rate_hz: 5\nmain_view: {width_px: 640, height_px: 360}\npage: {port: 0}\n")
    viewer = subprocess.Popen([program, "--config", config, "--domain", "78", "--log-level", "warning"], stdout=subprocess.PIPE, text=True)
    for line in viewer.stdout:
        if found := re.search(r"http://\S+", line):
            return viewer, found[0]
    sys.exit("firefox_test: the viewer has not told its page's address")


def compare(firefox, before=""):
    """How far the picture that Firefox draws is the viewer's."""
    firefox.run(COMPARE.replace("BEFORE", before))
    return eventually(lambda: firefox.run("return window.agreement"), "the viewer's picture to compare with")


def draws(firefox):
    """Firefox draws the cell by itself, as the viewer does."""
    firefox.run("const b = document.getElementById('server-pictures'); if (b.ariaPressed === 'true') b.click()")
    eventually(lambda: firefox.run("""const d = window.phantomScene; return d.shown && d.firstPicture_ms > 0 && d.stage.items.size > 10
                                      && [...d.stage.items.values()].every(i => d.stage.meshes.has(i.mesh))"""), "the cell, drawn by Firefox")
    seen = []
    eventually(lambda: seen.append(compare(firefox)) or seen[-1]["same"] >= LEAST_AGREEMENT, lambda: f"a picture that is the viewer's, but {seen[-1]}")
    found = seen[-1]
    print(f"firefox_test: {found['same']:.4f} of the pixels agree, of {found['items']} items; {found['bright']:.2f} of them are bright; "
          f"graphics: {firefox.run('const g = phantomScene.stage.renderer.getContext(); return g.getParameter(g.RENDERER)')}")
    assert found["bright"] > 0.02, "there is hardly anything in the picture"
    keep(firefox, "firefox_drawn.png")
    lacking = compare(firefox, "let n = 0; for (const id of [...d.stage.items.keys()]) if (++n % 2) d.stage.items.delete(id)")
    print(f"firefox_test: without every other item {lacking['same']:.4f}")
    assert lacking["same"] < LEAST_AGREEMENT, "a picture without half of the cell must not pass for the viewer's"


def keep(firefox, name):
    if shots := os.environ.get("PHANTOM_SCREENSHOTS"):
        picture = firefox.ask("WebDriver:TakeScreenshot", {"full": False, "hash": False})["value"]
        Path(shots, name).write_bytes(base64.b64decode(picture))


def main():
    program = shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        print("firefox_test: no Firefox is installed")
        sys.exit(SKIPPED)
    folder = Path(tempfile.mkdtemp(prefix="phantom_firefox_"))
    viewer = firefox = server = None
    try:
        viewer, url = serve(sys.argv[1], folder)
        server = subprocess.Popen([Path(sys.argv[1]).parent / "wva_server", "--domain", "78", "--log-level", "warning"], stdout=subprocess.DEVNULL)
        profile = folder / "profile"
        profile.mkdir()
        firefox = Firefox(program, profile)
        firefox.ask("WebDriver:Navigate", {"url": url})
        eventually(lambda: firefox.run("return document.getElementById('cell')?.textContent") == "hot_cell", "the state")
        eventually(lambda: firefox.run("return document.getElementById('banner').textContent").startswith("NO SLAVE"), "the banner")
        if firefox.run("return Boolean(document.getElementById('server-pictures'))"):  # where this Firefox draws by itself
            firefox.run("const b = document.getElementById('server-pictures'); if (b.ariaPressed !== 'true') b.click()")
        eventually(lambda: firefox.run("return document.getElementById('main-view').naturalWidth > 0"), "the viewer's picture")
        keep(firefox, "firefox.png")
        if firefox.run("return Boolean(window.phantomScene)"):  # built with it
            eventually(lambda: firefox.run("return Boolean(phantomScene.views || phantomScene.problem)"), "an answer whether Firefox has WebGL 2")
            if firefox.run("return Boolean(phantomScene.problem)"):
                print("firefox_test: not drawn by Firefox itself:", firefox.run("return phantomScene.problem.message"))
            else:
                draws(firefox)
        assert not (failures := firefox.failures(url)), failures
        # An error would be found.
        firefox.run(f"const s = document.createElement('script'); s.src = '{url}language.js'; document.head.append(s)")
        eventually(lambda: firefox.failures(url), "the error of a script that declares what is declared")
    finally:
        if firefox:
            firefox.end()
        for process in filter(None, (viewer, server)):
            process.terminate()
            process.wait()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
