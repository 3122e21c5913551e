"""The whole system on hosts of its own: a master arm and a slave arm with simulated drives on CAN, everything between and beside them, cables that
can be bad, disks that can be full, logs that nobody reads, clocks that can be set, and two taps on the wire.

It only does what it is asked to, and writes down what it did (facts.jsonl) for the observer.
"""
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "tests/hosts"))
from hosts import Site, own_mib, run  # noqa: E402

ADDRESSES = {"master": "10.71.1.2", "slave": "10.71.2.2", "view": "10.71.3.2"}
HOST_OF = {"master_io": "master", "master_drives_a": "master", "master_drives_b": "master", "phantom_sensing": "master", "audio_percept": "master",
           "slave_io": "slave", "slave_drives_a": "slave", "slave_drives_b": "slave", "wva_server": "slave", "synthetic_viewer": "view"}
PROCESSES_IN_ORDER = ("master_drives_a", "master_drives_b", "slave_drives_a", "slave_drives_b", "wva_server", "slave_io", "phantom_sensing", "master_io",
                      "audio_percept", "synthetic_viewer")
TAP_PRIORITY = 15  # of the recorders that see for the observer: what they miss cannot be concluded from
NICE = {"audio_percept": 5}
JOINTS = ("j1_gantry", "j2_yaw", "j3_shoulder", "j4_elbow", "j5_roll", "j6_wrist", "j7_tool_roll")
SPEED = (0.4, 1.2, 1.2, 1.2, 1.4, 1.4, 1.5)  # of the arm's URDF
N_PER_NM = 2 * math.pi / 0.2  # of the gantry: 0.2 m per turn
# A pose amid the pump's fluid, between the arm's home and the reach "gripper to pump motor": drag is felt wherever the hand goes.
POSE = (0.155 * N_PER_NM, -1.429, 1.025, -1.631, 0.044, 1.057, 0.0)
HANDS = {2: "hand: {swing_rad: 0.25, period_s: 5}", 1: "hand: {swing_rad: 0.1, period_s: 7}"}
TOPICS = {"master": ("master_state", "slave_state", "drag_field", "operator_command"), "slave": ("master_state", "slave_state", "operator_command")}
# One small machine carries all hosts: the servo loops run at a quarter of their rate, and follow as softly as that allows.
RATE_HZ, BANDWIDTH_HZ = 250, 4
# Bounds low enough that the hand above reaches them; at this rate the caps' sum still falls to nothing within the ramp of 0.1 s.
PERCEPT_CAP, FEEDBACK_CAP, LIMIT, RATE = 0.5, 0.15, 0.6, 7.0
PERCEPT_FORCE_CAP, FEEDBACK_FORCE_CAP, FORCE_LIMIT, FORCE_RATE = 20.0, 30.0, 45.0, 500.0


def limits():
    """What the observer holds the run against (scene.Limits), and which drive moves which joint."""
    def each(sliding, revolute):
        return [sliding] + [revolute] * (len(JOINTS) - 1)
    # While servers of a workspace succeed each other, phantom_sensing holds the one in use, the next and what its reader keeps.
    drives = {}
    for side in ("master", "slave"):
        for bus, joints in (("a", range(0, 4)), ("b", range(4, 7))):
            drives[f"{side}_drives_{bus}"] = {node: (joint, N_PER_NM if joint == 0 else 1.0) for node, joint in enumerate(joints, 1)}
    return {"limits": {"joints": list(JOINTS), "percept_cap": each(PERCEPT_FORCE_CAP, PERCEPT_CAP), "feedback_cap": each(FEEDBACK_FORCE_CAP, FEEDBACK_CAP),
                       "motor_limit": each(FORCE_LIMIT, LIMIT), "rate": each(FORCE_RATE, RATE), "quantum": each(0.01 * N_PER_NM, 0.01), "speed": list(SPEED), "period_s": 1 / RATE_HZ,
                       "more_memory_MiB": {"phantom_sensing": 192.0}}, "drives": drives}


def replaced(text, *pairs):
    for old, new in pairs:
        if old not in text:
            raise RuntimeError(f"\"{old}\" is not there to be replaced")
        text = text.replace(old, new)
    return text


def drives_file(source, side, first_joint):
    """The shipped drives of a bus, at the run's pose, on a bus of this side that carries frames in no time (a userspace bus that paces them costs
    this machine more than all that is tried here); the master's with the hands that move it."""
    text, sections = replaced((SOURCE / "deploy/can" / source).read_text(), ("bit_rate: 1000000", "bit_rate: 0")), []
    head, *drives = text.split("  - node:")
    for i, drive in enumerate(drives):
        lines = [line for line in drive.splitlines() if "hand:" not in line]
        lines = [f"    start_rad: {POSE[first_joint + i]:.5f}" if "start_rad:" in line else line for line in lines]
        lines.append("    keeps_max_speed: false")  # what the loops do must not be hidden by the drives' own limit
        if side == "master" and first_joint + i in HANDS:
            lines.append("    " + HANDS[first_joint + i])
        sections.append("\n".join(lines))
    return head + "  - node:" + "\n  - node:".join(sections) + "\n"


class Facts:
    def __init__(self, path):
        self.file, self.lock = open(path, "a"), threading.Lock()

    def note(self, fact, **what):
        with self.lock:
            entry = {"t": time.monotonic(), "fact": fact, **what}
            self.file.write(json.dumps(entry) + "\n")
            self.file.flush()
            return entry


class Log:
    """A pipe that a process writes its log into, and who reads it into a file, unless he is held up."""
    SIZE = 4096

    def __init__(self, path):
        self.path = path
        self.read_end, self.write_end = os.pipe2(os.O_CLOEXEC)
        try:
            import fcntl
            fcntl.fcntl(self.write_end, 1031, self.SIZE)  # F_SETPIPE_SZ
        except OSError:
            pass
        self.reads, self.closed = threading.Event(), False
        self.reads.set()
        self.thread = threading.Thread(target=self._read, daemon=True)
        self.thread.start()

    def _read(self):
        with open(self.path, "ab", buffering=0) as file:
            while True:
                self.reads.wait()
                data = os.read(self.read_end, 4096)
                if not data:
                    return
                file.write(data.replace(b"\0", b""))

    def block(self):
        """Nobody reads any more, and the pipe is full."""
        self.reads.clear()
        # A description of its own: the process's must not become non-blocking.
        end = os.open(f"/proc/self/fd/{self.write_end}", os.O_WRONLY | os.O_NONBLOCK)
        try:
            while True:
                os.write(end, b"\0" * 64)
        except BlockingIOError:
            pass
        os.close(end)

    def free(self):
        self.reads.set()

    def close(self):
        self.free()
        os.close(self.write_end)
        self.thread.join(10)
        os.close(self.read_end)

    def last_words(self):
        return " | ".join(self.path.read_text(errors="replace").splitlines()[-3:])[-400:]


class System:
    def __init__(self, folder, binaries, helpers, secured):
        self.folder, self.bin, self.helpers, self.secured = folder, binaries, helpers, secured
        for name in ("taps", "drives", "logs"):
            (folder / name).mkdir()
        self.facts = Facts(folder / "facts.jsonl")
        self._write_configuration()
        self.site = Site(ADDRESSES, helpers / "cable", ("slave", "view"))
        self.running, self.logs, self.instances, self.frozen_threads, self.load, self.holding = {}, {}, {}, {}, [], []
        self.frozen, self.full, self.intruders = set(), set(), {}
        self.lock, self.taps = threading.RLock(), []
        for name, host in self.site.hosts.items():
            # A small disk of its own for what outlives processes, and a clock of its own.
            host.run("mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", host.state)
            (folder / f"clock.{name}").write_bytes(bytes(8))

    # ---- configuration

    def _write_configuration(self):
        can, folder = SOURCE / "deploy/can", self.folder
        if self.secured:
            run(str(SOURCE / "deploy/security/make"), "site", str(folder / "security"))
        hosts = "".join(f"  - {{name: {name}, interfaces: [{address}]}}\n" for name, address in ADDRESSES.items())
        security = f"  security: {folder}/security\n" if self.secured else ""
        (folder / "topology.yaml").write_text(
            f"name: chaos\ndomain: 42\nqos_profiles: {SOURCE}/deploy/qos/phantom.xml\ncell: {SOURCE}/deploy/cells/hot_cell/cell.yaml\n"
            f"network:\n  initial_peers: [{', '.join(ADDRESSES.values())}]\n  participants_per_host: 12\n{security}hosts:\n{hosts}")
        (folder / "master_io.yaml").write_text(replaced(
            (can / "hot_cell_master_io.yaml").read_text(), ("torque_limit_N_m: 8", f"torque_limit_N_m: {LIMIT}"), ("torque_rate_N_m_per_s: 310", f"torque_rate_N_m_per_s: {RATE}"),
            ("force_limit_N: 60", f"force_limit_N: {FORCE_LIMIT}"), ("force_rate_N_per_s: 2500", f"force_rate_N_per_s: {FORCE_RATE}"),
            ("rate_Hz: 500   ", f"rate_Hz: {RATE_HZ}   "), ("    rate_Hz: 500", f"    rate_Hz: {RATE_HZ}"), ("bandwidth_Hz: 8", f"bandwidth_Hz: {BANDWIDTH_HZ}"),
            ("law: sctfb", "law: pe"), ("torque_cap_N_m: 2.2", f"torque_cap_N_m: {PERCEPT_CAP}"), ("torque_cap_N_m: 4", f"torque_cap_N_m: {FEEDBACK_CAP}")))
        (folder / "slave_io.yaml").write_text(replaced(
            (can / "hot_cell_slave_io.yaml").read_text(), ("speed_rad_s: 0.15", "speed_rad_s: 0.5"),
            # Nobody brings this master to an arm that went astray (a loop without its host's time lets it): the arm comes from anywhere.
            ("range_rad: 0.5", "range_rad: 3"), ("range_m: 0.2", "range_m: 0.9"),
            ("rate_Hz: 500", f"rate_Hz: {RATE_HZ}"), ("bandwidth_Hz: 8", f"bandwidth_Hz: {BANDWIDTH_HZ}"), ("user:hot_cell_", "user:slave_")))
        for bus, first_joint in (("a", 0), ("b", 4)):
            (folder / f"master_drives_{bus}.yaml").write_text(drives_file(f"hot_cell_master_drives_{bus}.yaml", "master", first_joint))
            (folder / f"slave_drives_{bus}.yaml").write_text(
                replaced(drives_file(f"hot_cell_drives_{bus}.yaml", "slave", first_joint), (f"user:hot_cell_{bus}", f"user:slave_{bus}")))
        # The arm of a host that was updated alone: its forearm is longer.
        shutil.copytree(SOURCE / "deploy/cells/hot_cell", folder / "other_cell")
        arm = folder / "other_cell/arm/suspended_arm.urdf"
        forearm = '<child link="forearm_roll"/><origin xyz="0 0 -0.{}"/>'
        arm.write_text(replaced(arm.read_text(), (forearm.format("20"), forearm.format("30"))))
        (folder / "other_arm.yaml").write_text(replaced((folder / "topology.yaml").read_text(), (f"{SOURCE}/deploy/cells/hot_cell/", f"{folder}/other_cell/")))
        # The phantom and the pictures are as coarse as suits a machine that carries all hosts.
        sensing = (SOURCE / "components/phantom_sensing/phantom_sensing.yaml").read_text()
        (folder / "phantom_sensing.yaml").write_text(replaced(sensing, ("pitch_vox: 0.99", "pitch_vox: 4")))
        (folder / "synthetic_viewer.yaml").write_text("frame_rate_hz: 2\nmain_view: {width_px: 320, height_px: 180}\nhit_view: {width_px: 320, height_px: 180}\n"
                                                      "tool_view: {enabled: false}\npage: {port: 0}\n")
        (folder / "tap.yaml").write_text("compression_level: 0\nflush_interval_s: 0.2\nchunk_kB: 256\nsplit: {duration_s: 30}\ndisk: {margin_MB: 200}\n")

    def words(self, process, host=None, topology="topology.yaml"):
        component = "simulated_drive" if "_drives_" in process else process
        words = [self.bin / component, "--deployment", self.folder / topology, "--host", host or HOST_OF.get(process, "view")]
        if component == "simulated_drive":
            words = [self.bin / component, "--record", self.folder / "drives" / f"{process}.{self.instances[process]}.csv"]
        config = self.folder / f"{process}.yaml"
        return words + (["--config", config] if config.exists() else [])

    def environment(self, host):
        return {**self.site[host].environment, "LD_PRELOAD": str(self.helpers / "clock_step.so"), "PHANTOM_CLOCK_STEP": str(self.folder / f"clock.{host}")}

    # ---- processes

    def _spawn(self, name, host, words, **options):
        log = Log(self.folder / "logs" / f"{name}.log")
        process = subprocess.Popen(self.site[host].inside(["nice", "-n", NICE.get(name, 0), *words]), stdout=log.write_end, stderr=log.write_end,
                                   stdin=subprocess.DEVNULL, env=self.environment(host), **options)
        self.logs[name] = log
        return process

    def start(self, name, more=(), topology="topology.yaml", **noted):
        with self.lock:
            if name in self.running:
                return
            self.instances[name] = self.instances.get(name, 0) + 1
            process = self._spawn(name, HOST_OF[name], [*self.words(name, topology=topology), *more])
            self.running[name] = process
            self.facts.note("started", process=name, pid=process.pid, **noted)

    def kill(self, name):
        with self.lock:
            process = self.running.pop(name, None)
            if process is None:
                return
            self._forget_frozen(name)
            process.kill()
            process.wait()
            self.facts.note("killed", process=name, pid=process.pid)
            self.logs.pop(name).close()

    def _forget_frozen(self, name):
        self.frozen.discard(name)
        for key in [k for k in self.frozen_threads if k[0] == name]:
            self.thaw_thread(*key)

    def freeze(self, name):
        with self.lock:
            if name in self.running:
                self.running[name].send_signal(signal.SIGSTOP)
                self.frozen.add(name)
                self.facts.note("frozen", process=name)

    def thaw(self, name):
        with self.lock:
            if name in self.running and name in self.frozen:
                self.facts.note("thawed", process=name)
                self.running[name].send_signal(signal.SIGCONT)
                self.frozen.discard(name)

    def _thread(self, name, thread):
        pid = self.running[name].pid
        if thread == "main":
            return pid
        for task in sorted(Path(f"/proc/{pid}/task").iterdir(), key=lambda t: int(t.name)):
            if (task / "comm").read_text().strip() == thread and int(task.name) != pid:
                return int(task.name)
        return None

    def freeze_thread(self, name, thread):
        with self.lock:
            if name not in self.running or name in self.frozen:
                return
            found = self._thread(name, thread)
            if found is None:
                self.facts.note("no_such_thread", process=name, thread=thread)
                return
            helper = subprocess.Popen([self.helpers / "freeze_thread", str(found)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            if helper.stdout.readline() != "frozen\n":
                helper.wait()
                self.facts.note("no_such_thread", process=name, thread=thread)
                return
            self.frozen_threads[(name, thread)] = helper
            self.facts.note("frozen", process=f"{name}/{thread}")

    def hold_up(self, process, gap_ms, run_ms, count):
        """The servo of a process does not run for gap_ms and runs for run_ms, so many times."""
        with self.lock:
            found = self._thread(process, "servo") if process in self.running and process not in self.frozen else None
            if found is not None:
                self.facts.note("servo_held_up", process=process, gap_ms=gap_ms, run_ms=run_ms, count=count)
                self.holding.append(subprocess.Popen([self.helpers / "freeze_thread", *map(str, (found, gap_ms, run_ms, count))], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    def hold_up_over(self, process, **_):
        for helper in self.holding:
            helper.wait(60)
        self.holding = []
        self.facts.note("servo_runs", process=process)

    def thaw_thread(self, name, thread):
        with self.lock:
            helper = self.frozen_threads.pop((name, thread), None)
            if helper:
                self.facts.note("thawed", process=f"{name}/{thread}")
                helper.stdin.close()
                helper.wait(10)

    def deaths(self):
        """Processes that ended by themselves; those whose disk is full may refuse to start (code 3), as their READMEs say."""
        with self.lock:
            for name, process in list(self.running.items()):
                if process.poll() is None:
                    continue
                words = self.logs[name].last_words()
                refused = process.returncode == 3 and HOST_OF[name] in self.full
                self.facts.note("refused" if refused else "died", process=name, pid=process.pid, code=process.returncode, words=words)
                del self.running[name]
                self.logs.pop(name).close()
                if refused:
                    self.facts.note("ended", process=name)
                    continue
                yield name, process.returncode, words

    # ---- what else can be done to them

    def link(self, host, **quality):
        self.facts.note("link", host=host, **quality)
        self.site.cables[host].set(**quality)

    def cut(self, host, way):
        self.facts.note("cut", host=host, way=way)
        self.site.cables[host].cut(way)

    def heal(self, host, way=""):
        self.site.cables[host].heal()
        self.facts.note("healed", host=host, way=way)

    def clock(self, host, offset_s):
        with open(self.folder / f"clock.{host}", "r+b", buffering=0) as file:
            file.write(round(offset_s * 1e9).to_bytes(8, "little", signed=True))
        self.facts.note("clock", host=host, offset_s=offset_s)

    def fill_disk(self, host):
        self.full.add(host)
        done = self.site[host].try_run("dd", "if=/dev/zero", f"of={self.site[host].state}/filler", "bs=1k")
        self.facts.note("disk_full", host=host, full=done.returncode != 0)

    def free_disk(self, host):
        self.site[host].run("rm", "-f", f"{self.site[host].state}/filler")
        self.facts.note("disk_free", host=host)
        self.full.discard(host)
        for name in HOST_OF:  # whoever refused to start is started again, as a service manager would
            if HOST_OF[name] == host:
                self.start(name)

    def block_log(self, name):
        with self.lock:
            if name in self.logs:
                self.logs[name].block()
                self.facts.note("log_blocked", process=name)

    def free_log(self, name):
        with self.lock:
            if name in self.logs:
                self.logs[name].free()
                self.facts.note("log_free", process=name)

    def start_intruder(self, component):
        """Another process of a side, on another host, with simulated joints of its own."""
        with self.lock:
            name = f"second_{component}"
            words = [self.bin / component, "--deployment", self.folder / "topology.yaml", "--host", "view"]
            process = self._spawn(name, "view", words)
            self.intruders[component] = process
            self.facts.note("started", process=name, pid=process.pid, intruder=True)

    def end_intruder(self, component):
        with self.lock:
            process = self.intruders.pop(component, None)
            if process:
                process.terminate()
                try:
                    process.wait(10)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
                self.facts.note("intruder_ended", process=f"second_{component}", code=process.returncode)
                self.logs.pop(f"second_{component}").close()

    def start_lying(self, process, node, lie, after_s):
        """Restarted drives, one of which reports a false motion after a while."""
        with self.lock:
            self.kill(process)
            self.start(process, ("--fault", f"{lie}@{after_s}:{node}"), lie=lie, node=node)

    def end_lying(self, process):
        with self.lock:
            self.kill(process)
            self.start(process)

    def start_other_arm(self, component):
        with self.lock:
            self.kill(component)
            self.start(component, topology="other_arm.yaml", other_arm=True)

    def end_other_arm(self, component):
        with self.lock:
            self.kill(component)
            self.start(component)

    def lose_fragments(self, host):
        self.site.cables[host].lose_fragments(True)
        self.facts.note("fragments_lost", host=host)

    def pass_fragments(self, host):
        self.site.cables[host].lose_fragments(False)
        self.facts.note("fragments_passed", host=host)

    SPOIL = {"removed": 'rm "$f"', "copied": 'cp "$f" "$f.copy" && mv "$f.copy" "$f"', "emptied": ': > "$f"', "cut": 'truncate -s 7 "$f"',
             "zeroed": 's=$(stat -c %s "$f"); head -c "$s" /dev/zero > "$f"'}

    def spoil_files(self, host, how):
        """All that outlives the host's processes."""
        found = self.site[host].run("find", self.site[host].state, "-type", "f", "!", "-name", "filler").split()
        for file in found:
            self.site[host].try_run("sh", "-c", f'f="$0"; {self.SPOIL[how]}', file)
        self.facts.note("files_spoiled", host=host, how=how, files=[Path(file).name for file in found])

    def start_load(self, processes, nice):
        self.facts.note("load", processes=processes, nice=nice)
        words = ["setpriv", "--pdeathsig", "KILL", "--", "nice", "-n", str(nice), "sh", "-c", "while :; do :; done"]
        self.load += [subprocess.Popen(words) for _ in range(processes)]

    def end_load(self):
        for process in self.load:
            process.kill()
            process.wait()
        self.load = []
        self.facts.note("load_over")

    def signal_stop(self, side):
        with self.lock:
            if f"{side}_io" in self.running:
                self.facts.note("stop_signal", side=side)
                self.running[f"{side}_io"].send_signal(signal.SIGUSR1)

    def memory(self):
        found = []
        with self.lock:
            for name, process in self.running.items():
                try:
                    found.append({"process": name, "pid": process.pid, "own_MiB": round(own_mib(process.pid), 1)})
                except (OSError, KeyError):  # it has just ended
                    continue
        self.facts.note("memory", processes=found)

    # ---- the observer's taps and the operator

    def start_taps(self):
        for side, topics in TOPICS.items():
            words = [self.bin / "dds_recorder", "record", "--deployment", self.folder / "topology.yaml", "--host", side, "--config", self.folder / "tap.yaml",
                     "--folder", self.folder / "taps" / side, "--topics", *topics]
            self.taps.append(self.site[side].start(words, self.folder / "logs" / f"tap_{side}.log"))

    def hasten_taps(self):
        """Their threads run before others' that are not of the loops. Call it once they all are there."""
        for tap in self.taps:
            for task in Path(f"/proc/{tap.pid}/task").iterdir():
                os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(TAP_PRIORITY))

    def start_commander(self):
        words = [self.helpers / "commander", "--deployment", self.folder / "topology.yaml", "--host", "view"]
        return subprocess.Popen(self.site["view"].inside(words), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                stderr=open(self.folder / "logs/commander.log", "w"), text=True)

    def close(self):
        self.end_load()
        for component in list(self.intruders):
            self.end_intruder(component)
        with self.lock:
            for name in list(self.frozen):
                self.thaw(name)
            for key in list(self.frozen_threads):
                self.thaw_thread(*key)
            for log in self.logs.values():
                log.free()
            for process in self.running.values():
                process.send_signal(signal.SIGINT)
            for process in self.running.values():
                try:
                    process.wait(15)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
        self.site.close()
        shutil.rmtree(self.folder / "security", ignore_errors=True)
