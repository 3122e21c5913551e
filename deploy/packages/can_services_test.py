#!/usr/bin/env python3
"""Runs in a virtual machine whose kernel has CAN, which systemd has booted with the packages installed: systemd-networkd brings the buses up, the units run an arm and a
master arm with drives on them, and drives, buses and processes fail. scripts/test_packages --vm boots such a machine and calls it.
"""
import csv
import fcntl
import json
import os
import signal
import socket
import struct
import subprocess
import time
from pathlib import Path

LIMIT_S = 240  # only bounds a failing test
SHARE, SITE = Path("/usr/share/phantom/deploy"), Path("/etc/phantom")
TOPOLOGY = SITE / "topology.yaml"
CELL = SHARE / "cells/hot_cell/coarse.yaml"
SLAVE, MASTER, SENSING, SERVER = (f"phantom-{name}.service" for name in ("slave-io", "master-io", "sensing", "wva-server"))
# Of a bus with two controllers the drives have the second.
BUSES = {"hot_cell_a": ("can0", "can1"), "hot_cell_b": ("can2", "can3"), "master_a": ("vcan0", "vcan0"), "master_b": ("vcan1", "vcan1")}
DRIVES = {"hot_cell_drives_a": "hot_cell_a", "hot_cell_drives_b": "hot_cell_b", "hot_cell_master_drives_a": "master_a", "hot_cell_master_drives_b": "master_b"}


class Pedal:
    """The master's enabling switch: an input device that the kernel makes (linux/uinput.h)."""
    NAME, KEY = "hold-to-run pedal", 0x13E  # BTN_THUMBR

    def __init__(self):
        self.file = os.open("/dev/uinput", os.O_WRONLY)
        fcntl.ioctl(self.file, 0x40045564, 1)  # UI_SET_EVBIT, EV_KEY
        fcntl.ioctl(self.file, 0x40045565, self.KEY)  # UI_SET_KEYBIT
        fcntl.ioctl(self.file, 0x405C5503, struct.pack("4H80sI", 3, 1, 1, 1, self.NAME.encode(), 0))  # UI_DEV_SETUP
        fcntl.ioctl(self.file, 0x5501)  # UI_DEV_CREATE

    def press(self, down):
        os.write(self.file, struct.pack("qqHHi", 0, 0, 1, self.KEY, int(down)) + struct.pack("qqHHi", 0, 0, 0, 0, 0))

    def pull(self):
        os.close(self.file)


def run(*words, may_fail=False):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    assert may_fail or done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"
    return done


def systemctl(*words):
    return run("systemctl", *words).stdout


def show(unit, name):
    return systemctl("show", unit, "--property", name, "--value").strip()


def eventually(probe, what):
    end = time.monotonic() + LIMIT_S
    while not (found := probe()):
        assert time.monotonic() < end, f"{what}: not within {LIMIT_S} s; {sides()}; {says(SLAVE)} / {says(MASTER)}"
        time.sleep(0.5)
    print(f"{what} ({time.monotonic():.0f} s)", flush=True)
    return found


def says(unit):
    return show(unit, "StatusText")


def sides():
    return run("master_io", "command", "status", "--deployment", TOPOLOGY, may_fail=True).stdout.replace("\n", " ")


def both(state):
    now = sides()
    return f"master_io: {state}" in now and f"slave_io: {state}" in now


def replaced(text, *pairs):
    for of, by in pairs:
        assert of in text, f"no '{of}' to replace"
        text = text.replace(of, by)
    return text


def write_site():
    """The shipped files on this host's buses, at a rate and with times that the guest's one processor can keep."""
    slow = [("rate_Hz: 500", "rate_Hz: 200"), ("bandwidth_Hz: 8", "bandwidth_Hz: 3.2"), ("lag_s: 0.01", "lag_s: 0.025"),
            ("heartbeat_timeout_s: 0.5", "heartbeat_timeout_s: 3"), ("target_timeout_s: 0.5", "target_timeout_s: 3"),
            ("most_missed: 100", "most_missed: 1000"), ("staleness_s: 0.06", "staleness_s: 0.5"), ("round_trip_limit_s: 0.15", "round_trip_limit_s: 1"),
            ("state_timeout_s: 2", "state_timeout_s: 10")]
    late = "\nloop: {late_limit_s: 0.2, window_s: 3, most_late_s: 1}\n"
    slave, master = (replaced((SHARE / f"can/hot_cell_{name}_io.yaml").read_text(), *slow) + late for name in ("slave", "master"))
    # Laws d and e are stable with the longer delay if the master's own loop is softer and better damped.
    master = replaced(master, ("k_p_N_m_per_rad: 8", "k_p_N_m_per_rad: 4"), ("k_p_N_per_m: 150", "k_p_N_per_m: 75"), ("k_v_N_m_s_per_rad: 0.1", "k_v_N_m_s_per_rad: 0.2"),
                      ("k_v_N_s_per_m: 3", "k_v_N_s_per_m: 6"))
    # Nobody leads the simulated hand back to an arm that it left behind.
    slave = replaced(slave, ("range_rad: 0.5", "range_rad: 3"), ("range_m: 0.2", "range_m: 0.9"))
    for bus, (arm, _) in BUSES.items():
        if bus.startswith("master"):
            master = replaced(master, (f"user:{bus}", arm))
        else:
            slave = replaced(slave, (f"user:{bus}", arm))
    (SITE / "slave_io.yaml").write_text(slave)
    master += f"\nenabling_switch: {{source: input, device: {Pedal.NAME}, key: BTN_THUMBR}}\n"
    (SITE / "master_io.yaml").write_text(master)
    # The same layers of coarser voxels: this processor is emulated.
    CELL.write_text(replaced((SHARE / "cells/hot_cell/cell.yaml").read_text(), ("voxel_size_m: 0.005", "voxel_size_m: 0.02"), ("[4, 4, 4, 4, 4, 4]", "[1, 1, 1, 1, 1, 1]")))
    (SITE / "phantom_sensing.yaml").write_text("percept_rate_hz: 10\n")
    for name, bus in DRIVES.items():
        (SITE / f"{name}.yaml").write_text(replaced((SHARE / f"can/{name}.yaml").read_text(), (f"user:{bus}", BUSES[bus][1])))
    TOPOLOGY.write_text(f"""name: can_site
domain: 42
qos_profiles: {SHARE}/qos/phantom.xml
cell: {CELL}
network: {{interfaces: [127.0.0.1]}}
hosts:
  - name: cell
    processes:
      - {{component: wva_server}}
      - {{component: slave_io, config: slave_io.yaml}}
      - {{component: phantom_sensing, config: phantom_sensing.yaml}}
      - {{component: master_io, config: master_io.yaml}}
""")
    Path("/etc/default/phantom").write_text(f"PHANTOM_TOPOLOGY={TOPOLOGY}\n")


def start_drives(name, *options):
    run("systemctl", "stop", f"{name}.service", may_fail=True)
    run("systemctl", "reset-failed", f"{name}.service", may_fail=True)
    # Without rights of its own: a drive that hears of a bus-off would take the host's interface down and up for a restart.
    run("systemd-run", "--quiet", f"--unit={name}", "--property=CapabilityBoundingSet=", "simulated_drive", "--config", SITE / f"{name}.yaml", "--record", f"/run/{name}.csv", *options)


def buses_are_up():
    """Needs no network of systemd-networkd's besides, as the file says."""
    for bus in ("can0", "can1", "can2", "can3"):
        eventually(lambda: "state UP" in run("ip", "link", "show", bus).stdout, f"systemd-networkd has brought {bus} up")
        details = run("ip", "-details", "link", "show", bus).stdout
        assert "bitrate 1000000" in details and "restart-ms 100" in details and "qlen 128" in details, details
        # The emulated controllers know no bit times: paced as a bus of 1 Mbit/s is, or their receive buffers overflow.
        run("tc", "qdisc", "replace", "dev", bus, "root", "netem", "rate", "1024kbit", "limit", "1000")
    for bus in ("vcan0", "vcan1"):
        run("ip", "link", "add", bus, "type", "vcan")
        run("ip", "link", "set", bus, "up")


def check_asks_the_drives():
    refused = run("slave_io", "--check", "--deployment", TOPOLOGY, may_fail=True)
    assert refused.returncode == 3 and "j1_gantry, node 1 on can0: no answer" in refused.stderr, refused
    for name in DRIVES:
        start_drives(name)
    for component, joint in (("slave_io", "j7_tool_roll, node 3 on can2"), ("master_io", "j7_tool_roll, node 3 on vcan1")):
        def found():
            done = run(component, "--check", "--deployment", TOPOLOGY, may_fail=True)
            assert done.returncode == 0 or "no answer" in done.stderr, done.stderr
            return done.stdout if done.returncode == 0 else ""
        found = eventually(found, f"{component} --check finds its drives")
        assert joint in found and "vendor" in found, found
    missing = SITE / "elsewhere.yaml"
    missing.write_text((SITE / "slave_io.yaml").read_text().replace("can2", "can7"))
    refused = run("slave_io", "--check", "--deployment", TOPOLOGY, "--config", missing, may_fail=True)
    assert refused.returncode == 3 and "can7: no such network interface" in refused.stderr, refused
    print("slave_io --check: names drives that are silent, who they are, and an interface that is not there", flush=True)


def a_shipped_topology_simulates_nothing_by_mistake():
    own = SITE / "no_word_of_simulation.yaml"
    own.write_text(TOPOLOGY.read_text().replace(", config: slave_io.yaml", ""))
    refused = run("slave_io", "--deployment", own, may_fail=True)
    assert refused.returncode == 2 and "simulation: true" in refused.stderr, refused


def couples():
    """After as many resets as it takes: what had piled up on a bus comes first."""
    last = [0.0]

    def coupled():
        if both("coupled"):
            return True
        if time.monotonic() - last[0] > 8:
            last[0] = time.monotonic()
            run("master_io", "command", "reset", "--deployment", TOPOLOGY, may_fail=True)
        return False
    eventually(coupled, "coupled")


def positions(name, node):
    rows = [row for row in csv.reader(Path(f"/run/{name}.csv").read_text().splitlines()) if len(row) >= 6 and row[1].isdigit()]
    return [(int(row[0]) * 1e-9, float(row[4])) for row in rows if int(row[1]) == node]


def the_arm_follows_the_hand():
    """The hand swings two joints of the master arm; the arm's own motors make the same way."""
    begin = time.monotonic()
    eventually(lambda: time.monotonic() - begin > 13, "a swing of the hand has passed")
    for node in (2,):
        hand = [q for t, q in positions("hot_cell_master_drives_a", node) if t > begin]
        arm = [q for t, q in positions("hot_cell_drives_a", node) if t > begin]
        assert max(hand) - min(hand) > 0.2, f"the hand moved only {max(hand) - min(hand)} rad"
        assert max(arm) - min(arm) > 0.8 * (max(hand) - min(hand)), f"hand {max(hand) - min(hand)} rad, arm {max(arm) - min(arm)} rad"
    print("the arm follows the hand", flush=True)


def forces_are_felt():
    """The yaw joint meets a wall that stands 0.1 rad from home; with laws c and e the hand feels it."""
    site = SITE / "hot_cell_drives_a.yaml"
    free = site.read_text()
    yaw, start = 1, "    start_rad: -1.5708\n"
    site.write_text(replaced(free, (start, start + "    wall: {at_rad: -1.47, stiffness_Nm_per_rad: 5000, damping_Nms_per_rad: 20}\n")))
    start_drives("hot_cell_drives_a")
    for law in ("pfff", "peff"):
        run("master_io", "command", "law", law, "--deployment", TOPOLOGY)
        couples()
        heard = run("dds_spy", "--deployment", TOPOLOGY, "--json", "--seconds", 14, "echo", "master_state", "slave_state", "--every", 0.05).stdout
        slave, in_contact, free_Nm, wall_Nm = None, [], [0.0], []
        for one in map(json.loads, heard.splitlines()):
            if one["topic"] == "slave_state":
                slave = one["sample"]
                wall_Nm.append(slave["external_torque_Nm"][yaw])
            elif slave is not None:
                (in_contact if slave["contact"] else free_Nm).append(one["sample"]["feedback_torque_Nm"][yaw])
        assert in_contact and min(wall_Nm) < -20, f"law {law}: no contact: {min(wall_Nm)} N·m, {len(in_contact)} samples"
        print(f"  law {law}: the wall pushes with {min(wall_Nm):.1f} N·m, the hand feels {min(in_contact):.3f} N·m, in free motion {min(free_Nm):.3f} to {max(free_Nm):.3f} N·m", flush=True)
        assert min(in_contact) < 0.002 * min(wall_Nm), f"law {law}: {min(in_contact)} N·m of {min(wall_Nm)} N·m"
        # Samples of the two sides are some cycles apart.
        assert law == "peff" or max(map(abs, free_Nm)) < 0.2 * max(map(abs, in_contact)), f"law {law}: {max(map(abs, free_Nm))} N·m in free motion"
    site.write_text(free)
    start_drives("hot_cell_drives_a")
    run("master_io", "command", "law", "sctfb", "--deployment", TOPOLOGY)
    couples()


def stands(seconds):
    """No drive of the arm moves, once those that hear nothing have missed their targets (target_timeout_s)."""
    time.sleep(4)
    start = time.monotonic()
    time.sleep(seconds)
    for name in ("hot_cell_drives_a", "hot_cell_drives_b"):
        for node in range(1, 5):
            way = [q for t, q in positions(name, node) if t > start]
            assert not way or max(way) - min(way) < 5e-3, f"{name}, node {node}: {max(way) - min(way)} rad although the arm holds"


def holds(seconds):
    """No drive of the arm moves, since a stop is in force."""
    stands(seconds)
    assert both("stopped"), sides()


def stopped_by(words, what, unit=SLAVE):
    eventually(lambda: both("stopped"), f"{what}: both sides are stopped")
    eventually(lambda: all(word in says(unit) for word in words), f"{unit} says so: {words}")
    print(f"  {says(unit)}", flush=True)
    holds(3)


def drives_fail():
    start_drives("hot_cell_drives_b", "--fault", "trip@20:2")
    couples()
    stopped_by(["j6_wrist"], "a drive trips")
    start_drives("hot_cell_drives_b")
    couples()
    systemctl("kill", "--signal=KILL", "hot_cell_drives_a.service")
    stopped_by(["j1_gantry"], "the drives of a bus lose their power")
    start_drives("hot_cell_drives_a")
    couples()


def a_bus_fails():
    run("ip", "link", "set", "can2", "down")
    stopped_by(["the CAN interface is down"], "a bus is pulled")
    run("ip", "link", "set", "can2", "up")
    run("tc", "qdisc", "replace", "dev", "can2", "root", "netem", "rate", "1024kbit", "limit", "1000")
    couples()


def the_arm_follows_only_while_the_switch_is_held(pedal):
    """Letting go is no stop, and nor is a pulled plug: the arm holds, and couples again by itself."""
    pedal.press(False)
    eventually(lambda: "enabling switch" in says(MASTER) and "enabling switch" in says(SLAVE), "the enabling switch is let go: both sides say so")
    print(f"  {says(MASTER)} / {says(SLAVE)}", flush=True)
    stands(3)
    pedal.press(True)
    eventually(lambda: both("coupled"), "held again: coupled, without a reset")
    pedal.pull()
    eventually(lambda: "not heard" in says(MASTER) and "enabling switch" in says(SLAVE), "the enabling switch is pulled out: both sides say so")
    print(f"  {says(MASTER)} / {says(SLAVE)}", flush=True)
    stands(3)
    pedal = Pedal()
    eventually(lambda: "has to be released" in says(MASTER) or "released" in says(MASTER), "plugged in again")
    pedal.press(True)
    eventually(lambda: both("coupled"), "held again: coupled, without a reset")
    return pedal


def a_controller_goes_off_its_bus():
    """What the kernel says to everybody on a bus whose controller counted too many errors."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.bind(("vcan1",))
        for what in (0x40, 0x100):  # CAN_ERR_BUSOFF, and CAN_ERR_RESTARTED after restart-ms
            bus.send(struct.pack("=IB3x8s", 0x20000000 | what, 8, bytes(8)))  # CAN_ERR_FLAG
            time.sleep(0.1)
    stopped_by(["bus-off"], "a controller of the master goes bus-off", MASTER)
    couples()


def processes_fail(pedal):
    before = int(show(MASTER, "NRestarts"))
    os.kill(int(show(MASTER, "MainPID")), signal.SIGSTOP)
    eventually(lambda: "slave_io: degraded" in sides() or "slave_io: stopped" in sides(), "a hung master_io: the arm holds")
    eventually(lambda: int(show(MASTER, "NRestarts")) > before, "its watchdog has it started again")
    eventually(lambda: "released" in says(MASTER), "a switch that was held at the start does not count")
    pedal.press(False)
    eventually(lambda: "enabling switch released" in says(MASTER), "let go")
    pedal.press(True)
    couples()
    run("master_io", "command", "stop", "--deployment", TOPOLOGY, may_fail=True)
    eventually(lambda: both("stopped"), "a person stops both sides")
    os.kill(int(show(SLAVE, "MainPID")), signal.SIGKILL)
    eventually(lambda: int(show(SLAVE, "NRestarts")) > 0 and both("stopped"), "slave_io is killed and started again: the stop holds")
    holds(3)
    couples()


def main():
    write_site()
    buses_are_up()
    a_shipped_topology_simulates_nothing_by_mistake()
    pedal = Pedal()
    check_asks_the_drives()
    systemctl("start", SERVER, SLAVE, SENSING, MASTER)
    eventually(lambda: "enabling switch" in says(SLAVE), "nothing follows before the enabling switch is held")
    pedal.press(True)
    couples()
    log = run("journalctl", "--no-pager", "-o", "cat", "-u", SLAVE).stdout
    assert "the arm's drives are on CAN: can0, can2" in log, log
    assert Path(f"/proc/{show(SLAVE, 'MainPID')}/status").read_text().count("CapEff:\t0000000000000000") == 1
    the_arm_follows_the_hand()
    forces_are_felt()
    pedal = the_arm_follows_only_while_the_switch_is_held(pedal)
    drives_fail()
    a_bus_fails()
    a_controller_goes_off_its_bus()
    processes_fail(pedal)
    systemctl("stop", "phantom.target")
    for unit in (SLAVE, MASTER, SENSING, SERVER):
        eventually(lambda: show(unit, "ActiveState") == "inactive" and show(unit, "ExecMainStatus") == "0", f"{unit} ended in order")


try:
    main()
    print("passed", flush=True)
except BaseException as problem:
    print(f"failed: {problem}", flush=True)
    print(subprocess.run(["journalctl", "--no-pager", "-o", "short-monotonic", "-n", "60", "-u", "phantom-*"], capture_output=True, text=True).stdout, flush=True)
    raise SystemExit(1) from problem
