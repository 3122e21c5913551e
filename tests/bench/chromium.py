"""A headless Chromium, steered over the W3C WebDriver protocol."""
import base64
import json
import os
import re
import shutil
import signal
import subprocess
import urllib.error
import urllib.request

LONGEST_S = 300  # for a script, or for a page to come
ARGUMENTS = ["--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
             "--disable-sync", "--disable-dev-shm-usage", "--window-size=1600,1300"]
CARD = ["--ignore-gpu-blocklist", "--disable-gpu-sandbox", "--enable-gpu-rasterization"]
# By what pages are drawn. By EGL all is the card's, as on a desktop; by Vulkan without a display the browser puts its pages together by itself, so
# that each picture of the scene is read back.
GRAPHICS = {
    "software": ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
    "vulkan": ["--use-angle=vulkan", "--enable-features=Vulkan", "--disable-vulkan-surface", *CARD],
    "egl": ["--use-angle=gl-egl", *CARD],
}


class Chromium:
    """A browser of its own. `script` runs in each page before all else, `graphics` is of GRAPHICS, `flags` are given to it as they are."""

    def __init__(self, script, graphics="software", flags=()):
        self.driver, self.address = self.start_driver()
        wanted = {"browserName": "chrome", "pageLoadStrategy": "eager", "timeouts": {"script": 1000 * LONGEST_S},
                  "goog:chromeOptions": {"binary": shutil.which("chromium"), "args": [*ARGUMENTS, *GRAPHICS[graphics], *flags]}}
        self.session = "/session/" + self.begin(wanted)["sessionId"]
        self.command("Performance.enable", timeDomain="threadTicks")  # without what it waits
        self.command("Page.addScriptToEvaluateOnNewDocument", source=script)

    @staticmethod
    def start_driver(tries=3):
        """The driver takes any free port of IPv4, and gives up where IPv6 has it."""
        driver = subprocess.Popen([shutil.which("chromedriver"), "--port=0"], stdout=subprocess.PIPE, text=True, start_new_session=True)
        for line in driver.stdout:
            if found := re.search(r"started successfully on port (\d+)", line):
                return driver, f"http://127.0.0.1:{found[1]}"
        driver.wait()
        if tries == 1:
            raise RuntimeError("chromedriver does not start")
        return Chromium.start_driver(tries - 1)

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

    def held(self):
        """What the page keeps once all that can go has gone: octets of its heap, nodes, listeners."""
        self.command("HeapProfiler.collectGarbage")
        found = {one["name"]: int(one["value"]) for one in self.command("Performance.getMetrics")["metrics"]}
        return {"heap": found["JSHeapUsedSize"], "nodes": found["Nodes"], "listeners": found["JSEventListeners"]}

    def show_on(self, width_px, height_px, touch=False):
        """Makes the page's window a screen of that size; `touch`: one that is touched, without a mouse."""
        self.command("Emulation.setDeviceMetricsOverride", width=width_px, height=height_px, deviceScaleFactor=1, mobile=touch)
        self.command("Emulation.setTouchEmulationEnabled", enabled=touch, maxTouchPoints=2)

    def screenshot(self, path):
        with urllib.request.urlopen(self.address + self.session + "/screenshot", timeout=LONGEST_S) as answer:
            path.write_bytes(base64.b64decode(json.load(answer)["value"]))

    def end(self):
        os.killpg(self.driver.pid, signal.SIGKILL)
        self.driver.wait()
