#!/usr/bin/env python3
"""Runs as a service of a machine that systemd has booted, with the packages installed: starts every component's unit, and sees
what systemd does when one is killed, hangs, is wrongly configured, or misses its network. scripts/test_packages boots such a machine
and calls it.
"""
import fcntl
import os
import pwd
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

LIMIT_S = 180  # only bounds a failing test


def systemctl(*words):
    done = subprocess.run(["systemctl", *words], capture_output=True, text=True)
    assert done.returncode == 0, f"systemctl {' '.join(words)}: {done.stderr}"
    return done.stdout


def show(unit):
    names = "ActiveState,SubState,MainPID,NRestarts,Result,StatusText,ExecMainStatus,Type"
    return dict(line.split("=", 1) for line in systemctl("show", unit, "--property", names).splitlines())


def eventually(probe, what):
    end = time.monotonic() + LIMIT_S
    while not probe():
        assert time.monotonic() < end, f"{what}: not within {LIMIT_S} s"
        time.sleep(0.1)


def running(unit, not_pid="0"):
    now = show(unit)
    return now["ActiveState"] == "active" and now["SubState"] == "running" and now["MainPID"] not in ("0", not_pid)


def hit(units, number, result):
    """Sends each component the signal; systemd starts it again as another process, and its journal says why."""
    before = {unit: show(unit) for unit in units}
    for unit in units:
        os.kill(int(before[unit]["MainPID"]), number)

    def restarted(unit):
        now = show(unit)
        return int(now["NRestarts"]) > int(before[unit]["NRestarts"]) and running(unit, before[unit]["MainPID"])
    for unit in units:
        eventually(lambda: restarted(unit), f"{unit} runs again after {number.name}")
    log = subprocess.run(["journalctl", "--no-pager", "-o", "cat", "-b"], capture_output=True, text=True).stdout
    for unit in units:
        assert f"{unit}: Failed with result '{result}'" in log, f"{unit}: no result '{result}' in the journal"


def refuses_wrong_configuration(unit):
    folder = Path(f"/run/systemd/system/{unit}.d")
    folder.mkdir(parents=True)
    (folder / "wrong.conf").write_text("[Service]\nEnvironmentFile=\n"
                                       "Environment=PHANTOM_OPTIONS=--config=/nowhere.yaml\n")
    systemctl("daemon-reload")
    before = show(unit)["NRestarts"]
    subprocess.run(["systemctl", "restart", unit], capture_output=True)
    eventually(lambda: show(unit)["ActiveState"] == "failed", f"{unit} with wrong configuration is down")
    now = show(unit)
    assert now["ExecMainStatus"] == "2" and int(now["NRestarts"]) <= int(before), f"it was tried again: {now}"
    (folder / "wrong.conf").unlink()
    systemctl("daemon-reload")


def set_loopback(up):
    """Gives the interface of the topology its link, or takes it away."""
    get_flags, set_flags, up_flag = 0x8913, 0x8914, 1  # SIOCGIFFLAGS, SIOCSIFFLAGS, IFF_UP
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        request = struct.pack("16sh14x", b"lo", 0)
        flags = struct.unpack("16xh14x", fcntl.ioctl(any_socket, get_flags, request))[0]
        fcntl.ioctl(any_socket, set_flags, struct.pack("16sh14x", b"lo", flags | up_flag if up else flags & ~up_flag))


def waits_for_a_link(unit):
    """Without a link it refuses with 3 and is tried again, beyond the failures that end others; with one it runs."""
    set_loopback(False)
    subprocess.run(["systemctl", "start", unit], capture_output=True)

    def refused_again():
        now = show(unit)
        assert now["ActiveState"] != "failed", now
        return int(now["NRestarts"]) >= 6 and now["ExecMainStatus"] == "3"
    eventually(refused_again, f"{unit} without a link is tried again and again")
    set_loopback(True)
    eventually(lambda: running(unit), f"{unit} runs once there is a link")


def main():
    assert Path("/proc/1/comm").read_text().strip() == "systemd"
    names = [line.split()[0] for line in systemctl("list-unit-files", "phantom-*.service", "--no-legend").splitlines()]
    units = [name for name in names if show(name)["Type"] == "notify"]
    assert len(units) >= 7, units
    systemctl("enable", "phantom.target", *units)
    systemctl("start", "phantom.target")
    for unit in units:
        eventually(lambda: running(unit), f"{unit} runs")
        now = show(unit)
        owner = Path(f"/proc/{now['MainPID']}").stat().st_uid
        assert pwd.getpwuid(owner).pw_name == "phantom", f"{unit} runs as {owner}"
        assert now["NRestarts"] == "0", f"{unit} did not start at once: {now}"
        eventually(lambda: show(unit)["StatusText"], f"{unit} says how it is")
        print(f"{unit}: {show(unit)['StatusText']}", flush=True)
    hit(units, signal.SIGKILL, "signal")
    print("killed: all were started again", flush=True)
    hit(units, signal.SIGSTOP, "watchdog")
    print("frozen: the watchdog ended all, and they were started again", flush=True)
    systemctl("stop", "phantom.target")
    for unit in units:
        eventually(lambda: show(unit)["ActiveState"] == "inactive", f"{unit} ends with its target")
        assert show(unit)["ExecMainStatus"] == "0", show(unit)
    print("stopped: all ended in order", flush=True)
    refuses_wrong_configuration("phantom-slave-io.service")
    print("wrongly configured: it is not tried again", flush=True)
    waits_for_a_link("phantom-dds-recorder.service")
    print("without a link: it is tried again until there is one", flush=True)


try:
    main()
except BaseException as problem:
    print(f"failed: {problem}", flush=True)
    sys.stdout.flush()
    subprocess.run(["systemctl", "--no-pager", "--lines=10", "status", "phantom-*.service"])
    sys.exit(1)
