#!/usr/bin/env python3
"""What the observer reads: files that grow, samples by the IDL's layout, and what is no such thing."""
import json
import struct
import tempfile
import unittest
from pathlib import Path

import recordings
from recordings import MAGIC, Broken, DriveRecord, Facts, McapFile, McapFolder


def text(word):
    return struct.pack("<I", len(word)) + word.encode()


def record(kind, body):
    return struct.pack("<BQ", kind, len(body)) + body


def string_map(**entries):
    body = b"".join(text(key) + text(value) for key, value in entries.items())
    return struct.pack("<I", len(body)) + body


def channel(number, topic, **about):
    return record(recordings.CHANNEL, struct.pack("<HH", number, 0) + text(topic) + text("cdr") + string_map(**about))


def message(number, log_ns, data):
    return record(recordings.MESSAGE, struct.pack("<HIQQ", number, 1, log_ns, log_ns) + data)


def chunk(records, compression=""):
    return record(recordings.CHUNK, struct.pack("<QQQI", 0, 0, len(records), 0) + text(compression) + struct.pack("<Q", len(records)) + records)


class Cdr:
    """Plain CDR, written member by member with its padding: a twin of the decoders' fixed layouts."""

    def __init__(self):
        self.data = b""

    def put(self, form, *values):
        for value in values:
            size = struct.calcsize(form)
            self.data += b"\0" * (-len(self.data) % size) + struct.pack("<" + form, value)
        return self

    def array(self, *values):
        return self.put("d", *(list(values) + [0.0] * (16 - len(values))))

    def stamp(self, number, monotonic_ns=0, session=0):
        return self.put("Q", number).put("q", monotonic_ns, 0).put("Q", session)

    def echo(self, number, monotonic_ns, session):
        return self.put("Q", number).put("q", monotonic_ns).put("Q", session)

    def encapsulated(self):
        return b"\0\1\0\0" + self.data


def master_state():
    c = Cdr().stamp(5, 7_000_000_000, 77).put("I", 3, 0).put("Q", 0).put("?", True, False).put("I", 1, 2)
    c.array(0.1, 0.2).array(1.0, 2.0).array(-0.3, 0.0).array(0.4, 0.5).array()
    return c.put("d", 20.0, 0.01).put("?", True, *8 * [False]).put("i", 4).echo(8, 9, 88).echo(1, 2, 3).put("d", -1.0).encapsulated()


def slave_state():
    c = Cdr().stamp(6, 8, 66).echo(5, 7, 77).put("I", 5, 1).put("Q", 0xABC).put("?", False, True).put("I", 2).array(0.1, 0.2).array().array(3.0, 4.0)
    return c.put("I", 1).put("?", False).array().put("?", False).put("d", -1.0).put("H", 0).put("d", 0, 0, 0, 0, -1).encapsulated()


def drag_field(valid):
    c = Cdr().stamp(6).echo(5, 7, 77).echo(1, 2, 3).echo(4, 5, 6).put("Q", 1).put("I", 0, 7).array().array().put("d", *([0.0] * 136)).array().array().array().array()
    return c.put("?", valid).put("d", 0.1).encapsulated()


def reset():
    return Cdr().stamp(3, 0, 9).put("I", 1).put("d", 0.5).put("i", -1).put("Q", 0xA, 0xB).put("I", 6).encapsulated() + b"chaos\0"


class Recordings(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def test_samples_by_the_layout_of_the_idl(self):
        m = recordings.decode("master_state", master_state())
        self.assertEqual((m.stamp.number, m.stamp.monotonic_ns, m.stamp.session, m.state, m.stop, m.law), (5, 7_000_000_000, 77, 3, 0, 1))
        self.assertEqual((m.position, m.velocity, m.percept, m.feedback), ((0.1, 0.2), (1.0, 2.0), (-0.3, 0.0), (0.4, 0.5)))
        self.assertEqual((tuple(m.slave_echo), tuple(m.drag_echo)), ((8, 9, 88), (1, 2, 3)))
        s = recordings.decode("slave_state", slave_state())
        self.assertEqual((s.state, s.cause, s.stop, s.position, s.loop, s.master_echo.session), (5, 1, 0xABC, (0.1, 0.2), (3.0, 4.0), 77))
        self.assertEqual([recordings.decode("drag_field", drag_field(valid)).valid for valid in (True, False)], [True, False])
        c = recordings.decode("operator_command", reset())
        self.assertEqual((c.kind, c.value, c.master_stop, c.slave_stop), (1, 0.5, 0xA, 0xB))

    def test_what_is_no_sample(self):
        for data, words in ((b"\0\0\0\0" + bytes(800), "encapsulation 0000"), (master_state()[:300], "master_state"),
                            (master_state()[:60] + struct.pack("<I", 17) + master_state()[64:], "17 joints")):
            with self.assertRaisesRegex(Broken, words):
                recordings.decode("master_state", data)

    def whole_file(self):
        about = record(recordings.METADATA, text("phantom.recording") + string_map(utc_minus_monotonic_ns="1000000000"))
        inner = (channel(1, "master_state", process="42") + message(1, 3_000_000_000, master_state()) + channel(2, "percept", process="43") +
                 message(2, 3_100_000_000, b"anything") + channel(3, "master_state", process="42", carried_over="yes") + message(3, 3_200_000_000, master_state()))
        return MAGIC + record(recordings.HEADER, text("") + text("")) + about + chunk(inner) + record(recordings.FOOTER, bytes(20))

    def test_a_file_that_grows_octet_by_octet(self):
        path, data, samples = self.folder / "a.mcap", self.whole_file(), []
        path.write_bytes(b"")
        file = McapFile(path, "master")
        with open(path, "ab", buffering=0) as out:
            for i in range(len(data)):
                out.write(data[i:i + 1])
                samples += file.read()
        self.assertTrue(file.ended)
        self.assertEqual([(s.t, s.tap, s.topic, s.process, s.content.stamp.number) for s in samples], [(2.0, "master", "master_state", 42, 5)])

    def test_a_folder_keeps_what_is_asked_for(self):
        folder = McapFolder(self.folder, "slave", keep=1)
        for name in ("a", "b", "c"):
            (self.folder / f"{name}.mcap").write_bytes(self.whole_file())
        self.assertEqual(len(folder.read()), 3)
        self.assertEqual([p.name for p in self.folder.iterdir()], ["c.mcap"])

    def test_what_is_no_recording(self):
        path = self.folder / "a.mcap"
        for data, words in ((b"something else altogether", "no MCAP file"), (MAGIC + chunk(b"", "zstd"), "compressed with zstd"),
                            (MAGIC + chunk(channel(1, "master_state", process="1") + message(1, 5, master_state())), "nothing of its clock")):
            path.write_bytes(data)
            with self.assertRaisesRegex(Broken, words):
                McapFile(path, "master").read()

    def test_drives_and_facts(self):
        (self.folder / "d.csv").write_text("1500000000,1,enabled,0.5,2,3,true\n1600000000,1,fau")
        record = DriveRecord(self.folder / "d.csv", "master", {1: (0, 2.0)}, 3)
        row, = record.read()
        self.assertEqual(tuple(row), (1.5, "master", 0, 3, "enabled", 1.0, 2.0, 1.5, False))  # a sliding joint: power stays what it is
        with open(self.folder / "d.csv", "a") as file:
            file.write("lt,0,2,0,false\n")
        self.assertEqual([(r.power, r.lies) for r in record.read()], [("fault", True)])
        facts = Facts(self.folder / "facts.jsonl")
        self.assertEqual(facts.read(), [])
        (self.folder / "facts.jsonl").write_text(json.dumps({"t": 1.0, "fact": "begin"}) + "\n{")
        self.assertEqual(facts.read(), [{"t": 1.0, "fact": "begin"}])


if __name__ == "__main__":
    unittest.main()
