"""What was seen of a run: MCAP files with the bytes that came over the wire, and the simulated drives' own records.

Written from the formats' descriptions (mcap.dev/spec; OMG DDS-XTypes 7.4, plain CDR; the IDL in idl/), with nothing of the components: a
mistake in their encoding or decoding does not repeat itself here. Files may still grow: what is not whole yet is read the next time.
"""
import json
import struct
from collections import namedtuple
from pathlib import Path

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, CHANNEL, MESSAGE, CHUNK, METADATA = 0x01, 0x02, 0x04, 0x05, 0x06, 0x0C
JOINTS = 16

Stamp = namedtuple("Stamp", "number monotonic_ns utc_ns session")
Echo = namedtuple("Echo", "number monotonic_ns session")
_Master = namedtuple("MasterState", "stamp state cause stop law joints position velocity percept feedback slave_echo drag_echo")
_Slave = namedtuple("SlaveState", "stamp state cause stop joints position velocity loop master_echo")
DragField = namedtuple("DragField", "stamp slave_echo valid")
OperatorCommand = namedtuple("OperatorCommand", "stamp kind value master_stop slave_stop")
Sample = namedtuple("Sample", "t tap topic process content")  # t: arrival, CLOCK_MONOTONIC in s; process: pid of who wrote it
# joint: its place in the topics' arrays; lies: what it reports of its motion is false, what stands here is true
DriveRow = namedtuple("DriveRow", "t side joint instance power torque position velocity lies", defaults=(False,))


class MasterState(_Master):
    __slots__ = ()
    partner_echo = property(lambda self: self.slave_echo)


class SlaveState(_Slave):
    __slots__ = ()
    partner_echo = property(lambda self: self.master_echo)


LINK = ("init", "ready", "aligned", "coupled", "degraded", "stopped")
EMERGENCY_STOP, RESET = 0, 1  # CommandKind

_STAMP, _ECHO, _ARRAY = "QqqQ", "QqQ", f"{JOINTS}d"
# Offsets in plain CDR, little-endian: every member at a multiple of its size from the beginning.
_MASTER = struct.Struct("<" + _STAMP + "IIQ2?2xII4x" + 5 * _ARRAY + "dd9?3xi" + 2 * _ECHO)
_SLAVE = struct.Struct("<" + _STAMP + _ECHO + "IIQ2?2xI" + 3 * _ARRAY)
_DRAG = struct.Struct("<" + _STAMP + _ECHO)
_DRAG_VALID = 120 + 6 * 8 * JOINTS + 8 * JOINTS * (JOINTS + 1) // 2
_COMMAND = struct.Struct("<" + _STAMP + "I4xdi4xQQ")


def master_state(data):
    v = _MASTER.unpack_from(data)
    n, a = v[10], 11
    arrays = [v[a + k * JOINTS:a + k * JOINTS + n] for k in range(5)]
    rest = v[a + 5 * JOINTS:]
    return MasterState(Stamp(*v[:4]), v[4], v[5], v[6], v[9], n, *arrays[:4], Echo(*rest[12:15]), Echo(*rest[15:18]))


def slave_state(data):
    v = _SLAVE.unpack_from(data)
    n, a = v[12], 13
    arrays = [v[a + k * JOINTS:a + k * JOINTS + n] for k in range(3)]
    return SlaveState(Stamp(*v[:4]), v[7], v[8], v[9], n, *arrays, Echo(*v[4:7]))


def drag_field(data):
    v = _DRAG.unpack_from(data)
    return DragField(Stamp(*v[:4]), Echo(*v[4:7]), data[_DRAG_VALID] != 0)


def operator_command(data):
    v = _COMMAND.unpack_from(data)
    return OperatorCommand(Stamp(*v[:4]), v[4], v[5], v[7], v[8])


DECODERS = {"master_state": master_state, "slave_state": slave_state, "drag_field": drag_field, "operator_command": operator_command}


class Broken(Exception):
    """A file or sample that is not what it must be."""


def decode(topic, data):
    if data[:2] != b"\x00\x01":
        raise Broken(f"{topic}: encapsulation {data[:2].hex()}, not plain CDR, little-endian")
    try:
        sample = DECODERS[topic](memoryview(data)[4:])
    except struct.error as problem:
        raise Broken(f"{topic}: {problem}") from problem
    if hasattr(sample, "joints") and not 0 < sample.joints <= JOINTS:
        raise Broken(f"{topic}: {sample.joints} joints")
    return sample


def _text(data, at):
    size = struct.unpack_from("<I", data, at)[0]
    return bytes(data[at + 4:at + 4 + size]).decode(), at + 4 + size


def _string_map(data, at):
    size = struct.unpack_from("<I", data, at)[0]
    at, end, found = at + 4, at + 4 + size, {}
    while at < end:
        key, at = _text(data, at)
        found[key], at = _text(data, at)
    return found


class McapFile:
    """The messages of one MCAP file, as they are appended; of those topics alone that are decoded here."""

    def __init__(self, path, tap):
        self.file, self.tap, self.path = open(path, "rb"), tap, path
        self.waiting, self.begun, self.ended = b"", False, False
        self.channels, self.utc_minus_monotonic_ns = {}, None

    def read(self):
        """New samples, in the order of the file."""
        self.waiting += self.file.read()
        samples, at = [], 0
        if not self.begun:
            if len(self.waiting) < len(MAGIC):
                return samples
            if not self.waiting.startswith(MAGIC):
                raise Broken(f"{self.path}: no MCAP file")
            at, self.begun = len(MAGIC), True
        at = self._records(memoryview(self.waiting), at, samples)
        self.waiting = self.waiting[at:]
        return samples

    def _records(self, data, at, samples):
        while len(data) - at >= 9 and not self.ended:
            kind, size = data[at], struct.unpack_from("<Q", data, at + 1)[0]
            if len(data) - at - 9 < size:
                break
            self._record(kind, data[at + 9:at + 9 + size], samples)
            at += 9 + size
        return at

    def _record(self, kind, body, samples):
        if kind == FOOTER:
            self.ended = True
        elif kind == CHUNK:
            compression, at = _text(body, 28)
            if compression:
                raise Broken(f"{self.path}: compressed with {compression}; record with compression_level 0")
            self._records(body[at + 8:], 0, samples)
        elif kind == CHANNEL:
            number = struct.unpack_from("<H", body)[0]
            topic, at = _text(body, 4)
            _, at = _text(body, at)
            self.channels[number] = (topic, _string_map(body, at))
        elif kind == METADATA:
            name, at = _text(body, 0)
            if name == "phantom.recording":
                self.utc_minus_monotonic_ns = int(_string_map(body, at)["utc_minus_monotonic_ns"])
        elif kind == MESSAGE:
            channel, _, log_ns = struct.unpack_from("<HIQ", body)
            topic, about = self.channels[channel]
            if topic in DECODERS and about.get("carried_over") != "yes":
                if self.utc_minus_monotonic_ns is None:
                    raise Broken(f"{self.path}: says nothing of its clock")
                arrived_s = (log_ns - self.utc_minus_monotonic_ns) * 1e-9
                samples.append(Sample(arrived_s, self.tap, topic, int(about["process"] or 0), decode(topic, bytes(body[22:]))))


class McapFolder:
    """All files that a recorder leaves in a folder, one after the other. `keep`: how many stay that were read to their end."""

    def __init__(self, folder, tap, keep=None):
        self.folder, self.tap, self.keep = Path(folder), tap, keep
        self.files, self.done = [], []

    def read(self):
        known = {f.path for f in self.files} | set(self.done)
        self.files += [McapFile(path, self.tap) for path in sorted(self.folder.glob("*.mcap")) if path not in known]
        samples = []
        for file in list(self.files):
            samples += file.read()
            if file.ended:
                file.file.close()
                self.files.remove(file)
                self.done.append(file.path)
        while self.keep is not None and len(self.done) > self.keep:
            self.done.pop(0).unlink()
        return samples


class DriveRecord:
    """Rows of simulated_drive --record FILE. `joints`: of each node, its joint and how much of the
    joint's unit a N·m at the drive's output is (1 for revolute joints; 2π ÷ travel per turn in N for sliding ones); `instance`: which run of the process this is."""

    def __init__(self, path, side, joints, instance):
        self.path, self.side, self.joints, self.instance = Path(path), side, joints, instance
        self.file, self.waiting = None, ""

    def read(self):
        if self.file is None:
            if not self.path.exists():
                return []
            self.file = open(self.path)
        lines = (self.waiting + self.file.read()).split("\n")
        self.waiting = lines.pop()
        rows = []
        for line in lines:
            t, node, power, torque, position, velocity, reports = line.split(",")
            joint, unit = self.joints[int(node)]
            rows.append(DriveRow(int(t) * 1e-9, self.side, joint, self.instance, power, float(torque) * unit, float(position), float(velocity) / unit,
                                 reports == "false"))
        return rows


class Facts:
    """What was done to the system: a JSON object a line, with "t" (CLOCK_MONOTONIC, s) and "fact"."""

    def __init__(self, path):
        self.path, self.file, self.waiting = Path(path), None, ""

    def read(self):
        if self.file is None:
            if not self.path.exists():
                return []
            self.file = open(self.path)
        lines = (self.waiting + self.file.read()).split("\n")
        self.waiting = lines.pop()
        return [json.loads(line) for line in lines]
