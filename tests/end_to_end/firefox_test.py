#!/usr/bin/env python3
"""The operator's page in a real Firefox: it loads, shows the state and the viewer's picture, and no script of it fails.

firefox_test.py SYNTHETIC_VIEWER

Firefox is steered by its own protocol (Marionette). Exit code 77 where it is missing. PHANTOM_SCREENSHOTS names a folder that gets a picture of the page.
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


def eventually(probe, what):
    until = time.monotonic() + LONGEST_S
    while not (found := probe()):
        if time.monotonic() > until:
            sys.exit(f"firefox_test: {what} did not come in {LONGEST_S} s")
        time.sleep(0.1)
    return found


class Firefox:
    """A browser without a window, with a profile of its own."""

    def __init__(self, program, folder):
        (folder / "user.js").write_text('user_pref("marionette.port", 0);\nuser_pref("app.update.enabled", false);\n'
                                        'user_pref("datareporting.policy.dataSubmissionEnabled", false);\n'
                                        'user_pref("toolkit.telemetry.reportingpolicy.firstRun", false);\n')
        self.log = (folder / "firefox.log").open("w+")
        self.process = subprocess.Popen([program, "--headless", "--no-remote", "--marionette", "--remote-allow-system-access", "--profile", folder,
                                         "--width", "1600", "--height", "1300"], stdout=self.log, stderr=self.log, start_new_session=True,
                                        env={**os.environ, "HOME": str(folder), "MOZ_DISABLE_CONTENT_SANDBOX": "1"})
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


def serve(program, folder):
    """A viewer without a system, and its page's address."""
    config = folder / "viewer.yaml"
    config.write_text("frame_rate_hz: 5\nmain_view: {width_px: 640, height_px: 360}\npage: {port: 0}\n")
    viewer = subprocess.Popen([program, "--config", config, "--domain", "78", "--log-level", "warning"], stdout=subprocess.PIPE, text=True)
    for line in viewer.stdout:
        if found := re.search(r"http://\S+", line):
            return viewer, found[0]
    sys.exit("firefox_test: the viewer has not told its page's address")


def main():
    program = shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        print("firefox_test: no Firefox is installed")
        sys.exit(SKIPPED)
    folder = Path(tempfile.mkdtemp(prefix="phantom_firefox_"))
    viewer = firefox = None
    try:
        viewer, url = serve(sys.argv[1], folder)
        profile = folder / "profile"
        profile.mkdir()
        firefox = Firefox(program, profile)
        firefox.ask("WebDriver:Navigate", {"url": url})
        eventually(lambda: firefox.run("return document.getElementById('cell')?.textContent") == "hot_cell", "the state")
        eventually(lambda: firefox.run("return document.getElementById('banner').textContent").startswith("NO SLAVE"), "the banner")
        if firefox.run("return Boolean(document.getElementById('server-pictures'))"):  # where this Firefox draws by itself
            firefox.run("const b = document.getElementById('server-pictures'); if (b.ariaPressed !== 'true') b.click()")
        eventually(lambda: firefox.run("return document.getElementById('main-view').naturalWidth > 0"), "the viewer's picture")
        if shots := os.environ.get("PHANTOM_SCREENSHOTS"):
            picture = firefox.ask("WebDriver:TakeScreenshot", {"full": False, "hash": False})["value"]
            Path(shots, "firefox.png").write_bytes(base64.b64decode(picture))
        assert not (failures := firefox.failures(url)), failures
        # An error would be found.
        firefox.run(f"const s = document.createElement('script'); s.src = '{url}language.js'; document.head.append(s)")
        eventually(lambda: firefox.failures(url), "the error of a script that declares what is declared")
    finally:
        if firefox:
            firefox.end()
        if viewer:
            viewer.terminate()
            viewer.wait()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
