#!/usr/bin/env python3
"""Runs as a service of a machine that systemd has booted, with the packages installed: starts every component's unit, and sees
what systemd does when one is killed, hangs, is wrongly configured, or misses its network. scripts/test_packages boots such a machine
and calls it.
"""
import fcntl
import grp
import http.client
import os
import pwd
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

LIMIT_S = 180  # only bounds a failing test
MAKE_SECURITY = "/usr/share/phantom/deploy/security/make"


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
    Path("/run/wrong.yaml").write_text("rate_hz: 1000\n")  # no such key: the unit is Hz
    (folder / "wrong.conf").write_text("[Service]\nEnvironmentFile=\n"
                                       "Environment=PHANTOM_OPTIONS=--config=/run/wrong.yaml\n")
    systemctl("daemon-reload")
    before = show(unit)["NRestarts"]
    subprocess.run(["systemctl", "restart", unit], capture_output=True)
    eventually(lambda: show(unit)["ActiveState"] == "failed", f"{unit} with wrong configuration is down")
    now = show(unit)
    assert now["ExecMainStatus"] == "2" and int(now["NRestarts"]) <= int(before), f"it was tried again: {now}"
    (folder / "wrong.conf").unlink()
    systemctl("daemon-reload")


def may_restart_buses(unit):
    """With the example of a drop-in it has the one right that taking a CAN interface down and up needs, and no other."""
    folder = Path(f"/etc/systemd/system/{unit}.d")
    folder.mkdir(parents=True)
    shutil.copy("/usr/share/phantom/examples/can-restart.conf", folder)
    systemctl("daemon-reload")
    systemctl("restart", unit)
    status = Path(f"/proc/{show(unit)['MainPID']}/status").read_text()
    net_admin = f"{1 << 12:016x}"
    assert f"CapEff:\t{net_admin}" in status and f"CapBnd:\t{net_admin}" in status, status
    systemctl("stop", unit)
    shutil.rmtree(folder)
    systemctl("daemon-reload")


def networkd_takes(example):
    """systemd-networkd reads the example without a word of what it does not know."""
    shutil.copy(f"/usr/share/phantom/examples/{example}", "/etc/systemd/network/")
    systemctl("restart", "systemd-networkd")
    log = subprocess.run(["journalctl", "--no-pager", "-o", "cat", "-b", "-u", "systemd-networkd"], capture_output=True, text=True).stdout
    assert example not in log, log
    (Path("/etc/systemd/network") / example).unlink()
    systemctl("stop", "systemd-networkd")


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


def wanted_oom_score(unit):
    """Those that move the arms are the last that the kernel ends, pictures and recordings the first."""
    scores = {"slave-io": -900, "master-io": -900, "sensing": -500, "discovery": -500, "wva-server": 0, "audio-percept": 0, "ros2-gateway": 0, "synthetic-viewer": 500,
              "dds-recorder": 500}
    return scores[unit.removeprefix("phantom-").removesuffix(".service")]


def may_be_ended_later(score):
    """Whether root of this machine may give a process that score: one in a container may be kept from lowering it."""
    with subprocess.Popen(["sleep", "60"]) as process:
        try:
            Path(f"/proc/{process.pid}/oom_score_adj").write_text(str(score))
        except PermissionError:
            return False
        finally:
            process.kill()
    return True


def has_its_own(pid, folder):
    """A file that others put there is not there for it, and the folder is one that it has at all."""
    probe = Path(f"/{folder}/seen_by_others")
    probe.write_text("")
    try:
        inside = Path(f"/proc/{pid}/root/{folder}")
        return inside.is_dir() and not (inside / probe.name).exists()
    finally:
        probe.unlink()


def is_confined(unit, pid):
    """An account of its own, no capability and no way to one, a filter of system calls, a bound of memory and a place in the order in which the kernel ends
    processes where memory ends, temporary files that nobody else sees, and nobody's key but its own."""
    account = unit.removesuffix(".service")
    status = dict(line.split(":\t", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines() if ":\t" in line)
    owner = pwd.getpwuid(int(status["Uid"].split()[0]))
    assert owner.pw_name == account, f"{unit} runs as {owner.pw_name}"
    assert status["NoNewPrivs"] == "1" and status["Seccomp"] == "2", status
    assert int(status["CapBnd"], 16) == 0 and int(status["CapEff"], 16) == 0, status
    assert (grp.getgrnam("input").gr_gid in map(int, status["Groups"].split())) == (account == "phantom-master-io"), f"{unit}: groups {status['Groups']}"
    assert int(systemctl("show", unit, "--property", "MemoryMax", "--value")) <= 8 << 30
    # As the kernel has it of the running process; where this machine does not let it, as the unit asks for it.
    wanted = wanted_oom_score(unit)
    score = Path(f"/proc/{pid}/oom_score_adj").read_text() if may_be_ended_later(wanted) else systemctl("show", unit, "--property", "OOMScoreAdjust", "--value")
    assert int(score) == wanted, f"{unit} is ended out of its turn where memory ends: {score}"
    for folder in ("tmp", "var/tmp"):
        assert has_its_own(pid, folder), f"{unit} shares /{folder} with everybody"
    own = "phantom_sensing" if account == "phantom-sensing" else account.removeprefix("phantom-").replace("-", "_")
    other = "slave_io" if own != "slave_io" else "master_io"
    security = Path("/run/security_of_" + own)
    for name in (own, other):
        (security / name).mkdir(parents=True)
        (security / name / "key.pem").write_text("secret")
    for name in ("identity_ca.pem", "permissions_ca.pem", "governance.p7s"):
        (security / name).write_text("public")
    made = subprocess.run([MAKE_SECURITY, "own", str(security)], capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
    for name, allowed in ((own, True), (other, False)):
        read = subprocess.run(["setpriv", f"--reuid={account}", f"--regid={account}", "--init-groups", "cat", str(security / name / "key.pem")],
                              capture_output=True, text=True)
        assert (read.returncode == 0) == allowed, f"{account} and the key of {name}: {read.stdout}{read.stderr}"


def upgrade_tells_of_common_keys():
    """Keys of a time when all components shared one group are told of until each has its own."""
    security = Path("/etc/phantom/security")
    (security / "slave_io").mkdir(parents=True)
    for name in ("identity_ca.pem", "permissions_ca.pem", "governance.p7s", "slave_io/key.pem"):
        (security / name).write_text("of before")
    shutil.chown(security / "slave_io/key.pem", "root", "phantom")
    (security / "slave_io/key.pem").chmod(0o640)

    def told(*words):
        return subprocess.run(["/var/lib/dpkg/info/phantom-common.postinst", "configure", *words], capture_output=True, text=True, check=True).stderr
    assert "make own /etc/phantom/security" in told("0.1")
    assert "make own" not in told(), "a first installation has no keys of before"
    subprocess.run([MAKE_SECURITY, "own", str(security)], check=True, capture_output=True)
    assert "make own" not in told("0.1")
    shutil.rmtree(security)


def ask_page(method, path, body=None, cookie=""):
    """Status and headers of the operator's page's answer."""
    connection = http.client.HTTPConnection("127.0.0.1", 8080, timeout=LIMIT_S)
    connection.request(method, path, body, {"Content-Type": "application/json", "Cookie": cookie})
    answer = connection.getresponse()
    answer.read()
    return answer.status, answer.headers


def page_has_its_roles():
    """As installed, who reaches the page sees and commands nothing without a secret, which root may read."""
    folder = Path("/etc/phantom/page")
    secrets = {role: (folder / role).read_text().strip() for role in ("watch", "operate", "configure")}
    assert len(set(secrets.values())) == 3 and all(len(secret) == 32 for secret in secrets.values())
    assert all((folder / role).stat().st_mode & 0o777 == 0o600 for role in secrets)
    assert ask_page("GET", "/state")[0] == 401 and ask_page("POST", "/command", '{"kind": "reset"}')[0] == 401
    assert ask_page("POST", "/login", '{"secret": "0123456789abcdef"}')[0] == 401
    status, headers = ask_page("POST", "/login", f'{{"secret": "{secrets["watch"]}"}}')
    assert status == 200, status
    cookie = headers["Set-Cookie"].split(";")[0]
    assert ask_page("GET", "/state", cookie=cookie)[0] in (200, 503)  # 503: no state yet
    assert ask_page("POST", "/command", '{"kind": "reset"}', cookie)[0] == 403, "watch may reset"


def discovery_server_is_confined(unit):
    """It is Fast DDS's own program, which opens shared memory: that is its own, too."""
    systemctl("start", unit)
    eventually(lambda: running(unit), f"{unit} runs")
    pid = show(unit)["MainPID"]
    is_confined(unit, pid)
    eventually(lambda: any(Path(f"/proc/{pid}/root/dev/shm").iterdir()), f"{unit} has opened shared memory")  # else there is nothing to see
    assert not list(Path("/dev/shm").glob("*fastrtps*")) and not list(Path("/dev/shm").glob("*fastdds*")), "others can see its shared memory"
    assert has_its_own(pid, "dev/shm")
    systemctl("stop", unit)


def main():
    assert Path("/proc/1/comm").read_text().strip() == "systemd"
    names = [line.split()[0] for line in systemctl("list-unit-files", "phantom-*.service", "--no-legend").splitlines()]
    units = [name for name in names if show(name)["Type"] == "notify"]
    assert len(units) >= 8, units
    systemctl("enable", "phantom.target", *units)
    systemctl("start", "phantom.target")
    assert show("phantom-ros2-gateway.service")["ActiveState"] == "inactive", "it joins a network of others unasked"
    shutil.copy("/usr/share/phantom/examples/ros2_gateway.yaml", "/etc/phantom/ros2_gateway.yaml")
    systemctl("start", "phantom-ros2-gateway.service")
    for unit in units:
        eventually(lambda: running(unit), f"{unit} runs")
        now = show(unit)
        is_confined(unit, now["MainPID"])
        assert now["NRestarts"] == "0", f"{unit} did not start at once: {now}"
        eventually(lambda: show(unit)["StatusText"], f"{unit} says how it is")
        print(f"{unit}: {show(unit)['StatusText']}", flush=True)
    discovery_server_is_confined("phantom-discovery.service")
    print("the discovery server: its shared memory is its own", flush=True)
    page_has_its_roles()
    print("the operator's page: nothing is seen or commanded without a secret", flush=True)
    upgrade_tells_of_common_keys()
    print("an upgrade tells of keys that every component may read", flush=True)
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
    may_restart_buses("phantom-slave-io.service")
    networkd_takes("80-phantom-can.network")
    print("the examples for CAN: one right, and no word of networkd's", flush=True)
    waits_for_a_link("phantom-dds-recorder.service")
    print("without a link: it is tried again until there is one", flush=True)


try:
    main()
except BaseException as problem:
    print(f"failed: {problem}", flush=True)
    sys.stdout.flush()
    subprocess.run(["systemctl", "--no-pager", "--lines=10", "status", "phantom-*.service"])
    sys.exit(1)
