#!/usr/bin/env python3
"""Hostile clients of the operator's page: while a hundred connections drip, others send bodies in chunks and headers
without end, a stop is posted and served, the page is still given, and the viewer's memory stays bounded.

hostile_clients_test.py SYNTHETIC_VIEWER [--tls]

With --tls the page is served by https: half of the dripping connections never come to the end of their handshake, and others send
records that are none, handshakes without end, and handshakes all the time.
"""
import http.client
import json
import os
import re
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "hosts"))
from hosts import own_mib  # noqa: E402

DRIPPING, STOPS, MOST_GROWN_MIB = 100, 10, 32
HEAD = b"Host: localhost\r\nContent-Type: application/json\r\n"


class Viewer:
    def __init__(self, program, folder, tls):
        config = folder / "viewer.yaml"
        size = "{width_px: 160, height_px: 120}"
        page = "port: 0"
        self.tls = None
        if tls:
            certificate, key = folder / "certificate.pem", folder / "key.pem"
            subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-noenc", "-subj",
                            "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-out", certificate,
                            "-keyout", key], check=True, capture_output=True)
            os.chmod(key, 0o600)
            page += f", certificate: {certificate}, key: {key}"
            self.tls = ssl.create_default_context(cafile=str(certificate))
        config.write_text(f"frame_rate_hz: 2\nmain_view: {size}\nhit_view: {size}\ntool_view: {{enabled: false}}\n"
                          f"page: {{{page}}}\n")
        # A window is wanted, and there is no display for one.
        self.log = (folder / "viewer.log").open("w+")
        self.process = subprocess.Popen([program, "--config", config, "--domain", "77", "--log-level", "warning", "--window"],
                                        stdout=subprocess.PIPE, stderr=self.log, text=True,
                                        env={name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")})
        self.port = 0
        for line in self.process.stdout:
            if found := re.search(r"(https?)://127\.0\.0\.1:(\d+)/", line):
                assert found[1] == ("https" if tls else "http"), line
                self.port = int(found[2])
                break
        assert self.port, "the viewer has not told its page's address"
        page = self.ask("GET", "/")[1].decode()
        self.stream_port = int(re.search(r'name="stream-port" content="(\d+)"', page)[1])

    def ask(self, method, path, body=None, timeout_s=60):
        """Status and body of an answer."""
        if self.tls:
            connection = http.client.HTTPSConnection("127.0.0.1", self.port, timeout=timeout_s, context=self.tls)
        else:
            connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout_s)
        connection.request(method, path, body, {"Content-Type": "application/json"} if body else {})
        answer = connection.getresponse()
        return answer.status, answer.read()

    def insist(self, *request):
        """Asks as the page does: again after 300 ms if the connection ends without an answer (stop.js)."""
        while True:
            try:
                return self.ask(*request)
            except ConnectionError:
                time.sleep(0.3)

    def memory_mib(self):
        return own_mib(self.process.pid)

    def end(self):
        self.process.terminate()
        assert self.process.wait(60) == 0, "the viewer has not ended well"


class Attack:
    """Clients that never send a whole request, each in a thread and again whenever it is cut off."""

    def __init__(self, viewer):
        self.ended, self.sent, self.cut, self.threads = threading.Event(), 0, 0, []
        self.lock, self.tls = threading.Lock(), viewer.tls
        request = b"POST /command HTTP/1.1\r\n" + HEAD + b"X: " + b"x" * 100_000
        hello = b"\x16\x03\x01\x40\x00\x01\x00\x3f\xfc\x03\x03" + b"x" * 16_000
        for port in (viewer.port, viewer.stream_port):
            for i in range(DRIPPING):
                half = viewer.tls and i % 2 == 0
                self.start(self.drip, port, hello if half else request, plain=half)
        self.start(self.flood, viewer.port, b"POST /command HTTP/1.1\r\n" + HEAD + b"Transfer-Encoding: chunked\r\n\r\n",
                   b"10000\r\n" + b" " * 0x10000 + b"\r\n")
        self.start(self.flood, viewer.port, b"GET / HTTP/1.1\r\n" + HEAD, b"".join(b"X-%d: y\r\n" % i for i in range(5000)))
        self.start(self.flood, viewer.port, b"POST /command HTTP/1.1\r\n" + HEAD + b"Content-Length: 999999999\r\n\r\n", b" " * 0x10000)
        if viewer.tls:
            for port in (viewer.port, viewer.stream_port):
                self.start(self.flood, port, b"", os.urandom(0x4000), plain=True)
                self.start(self.flood, port, b"", b"\x16\x03\x01\x40\x00" + b"\x01\xff\xff\xff" + b"\x00" * 0x3ffc, plain=True)
                self.start(self.flood, port, b"", b"\x14\x03\x03\x00\x01\x01" * 1000, plain=True)
                self.start(self.flood, port, b"\x16\x03\x01\x00\x04\x01\xff\xff\xff", b"\x16\x03\x01\x00\x01\x03" * 1000, plain=True)
                self.start(self.handshakes, port, plain=True)

    def start(self, work, *arguments, plain=False):
        thread = threading.Thread(target=self.again, args=(work, plain, *arguments), daemon=True)
        self.threads.append(thread)
        thread.start()

    def again(self, work, plain, port, *arguments):
        while not self.ended.is_set():
            try:
                with socket.create_connection(("127.0.0.1", port), timeout=5) as connection:
                    if self.tls and not plain:
                        with self.tls.wrap_socket(connection, server_hostname="localhost") as encrypted:
                            work(encrypted, *arguments)
                    else:
                        work(connection, *arguments)
            except OSError:
                with self.lock:
                    self.cut += 1
                self.ended.wait(0.02)

    def drip(self, connection, octets):
        for octet in octets:
            connection.sendall(bytes([octet]))
            if self.ended.wait(0.2):
                return

    def flood(self, connection, head, piece):
        connection.sendall(head)
        while not self.ended.is_set():
            connection.sendall(piece)
            with self.lock:
                self.sent += len(piece)

    def handshakes(self, connection):
        """One after the other, each with a key of its own, and never a request."""
        self.tls.wrap_socket(connection, server_hostname="localhost").close()

    def end(self):
        self.ended.set()
        for thread in self.threads:
            thread.join(20)


# Tries synthetic_viewer: `--window` and no display
def expect_no_window_is_said(viewer):
    viewer.log.seek(0)
    said = viewer.log.read()
    assert "no desktop to open a window on" in said and "continuing without a window" in said, said


def main():
    with tempfile.TemporaryDirectory() as folder:
        viewer = Viewer(sys.argv[1], Path(folder), "--tls" in sys.argv[2:])
        try:
            for _ in range(20):  # the first ones make what the viewer keeps
                viewer.ask("GET", "/state")
                time.sleep(0.1)
            before_mib = most_mib = viewer.memory_mib()
            attack = Attack(viewer)
            time.sleep(3)
            took_s = []
            for _ in range(STOPS):
                began = time.monotonic()
                status, body = viewer.insist("POST", "/command", json.dumps({"kind": "emergency_stop"}))
                took_s.append(time.monotonic() - began)
                # Nobody is there to confirm it. The viewer has taken it, and sends it on.
                assert status == 504, f"{status}: {body}"
                assert json.loads(viewer.insist("GET", "/stop")[1])["in_force"], "the stop is not in force"
                most_mib = max(most_mib, viewer.memory_mib())
                time.sleep(0.5)
            assert viewer.insist("GET", "/page.js")[0] == 200
            attack.end()
            print(f"stops took {', '.join(f'{t:.2f}' for t in took_s)} s; {attack.sent / 1e6:.1f} MB were sent, "
                  f"connections were cut off {attack.cut} times; memory grew by {most_mib - before_mib:.1f} MiB")
            assert attack.cut > 0, "the attack was none"
            # A loaded machine delays some of them; waiting for the dripping connections would delay each.
            assert min(took_s) < 1 and max(took_s) < 10, "a stop waited for hostile clients"
            assert most_mib - before_mib < MOST_GROWN_MIB, "hostile clients fill the viewer's memory"
            expect_no_window_is_said(viewer)
        finally:
            viewer.end()


main()
