#!/usr/bin/env python3
"""deploy/security/make: what it makes fits together, is rotated without a gap, and its check finds each fault."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from rights import read_rights  # noqa: E402

SOURCE = Path(__file__).resolve().parents[2]
MAKE = SOURCE / "deploy/security/make"


def make(*words, **options):
    return subprocess.run([MAKE, *map(str, words)], capture_output=True, text=True, **options)


class Documents(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.made = Path(cls.folder.name) / "made"
        done = make("site", cls.made, "--domain", "7")
        assert done.returncode == 0, done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def setUp(self):
        self.site = Path(tempfile.mkdtemp(dir=self.folder.name)) / "site"
        shutil.copytree(self.made, self.site)

    def finds(self, words, **options):
        done = make("check", self.site, **options)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn(words, done.stdout)
        self.assertEqual(len(done.stdout.strip().splitlines()), 1, "nothing else is blamed: " + done.stdout)

    def test_everybody_gets_exactly_the_rights_of_the_list(self):
        topics = [topic for file in (SOURCE / "idl").glob("*.idl") for topic in re.findall(r"^// Topic (\w+):", file.read_text(), re.M)]
        self.assertGreaterEqual(len(topics), 17)
        for name, (publishes, subscribes) in read_rights().items():
            self.assertLessEqual((publishes | subscribes) - {"*"}, set(topics), f"{name} has rights to topics that there are not")
            text = (self.site / name / "permissions.p7s").read_text()
            for word, wanted in (("publish", publishes), ("subscribe", subscribes)):
                part = re.search(f"<{word}>(.*?)</{word}>", text, re.S)
                self.assertEqual(set(re.findall("<topic>(.*?)</topic>", part.group(1))) if part else set(), wanted, name)
            self.assertIn("<id>7</id>", text)
            self.assertIn("<default>DENY</default>", text)

    def test_a_whole_site_passes(self):
        done = make("check", self.site)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn(f"{len(read_rights())} identities", done.stdout)

    def test_a_site_is_not_made_twice(self):
        self.assertEqual(make("site", self.site).returncode, 2)

    def test_rotation_gives_new_keys_by_the_same_authority(self):
        files = [self.site / name for name in ("slave_io/key.pem", "slave_io/identity.pem", "identity_ca.pem", "master_io/key.pem")]
        before = [f.read_bytes() for f in files]
        done = make("rotate", self.site, "slave_io", "--domain", "9")
        self.assertEqual(done.returncode, 0, done.stderr)
        changed = [f.read_bytes() != b for f, b in zip(files, before)]
        self.assertEqual(changed, [True, True, False, False])
        self.assertIn("<id>7</id>", (self.site / "slave_io/permissions.p7s").read_text(), "the site's domain, not another")
        self.assertEqual(make("check", self.site).returncode, 0)
        self.assertEqual([p.name for p in self.site.glob(".*")], [], "nothing half made is left")

    def test_new_authorities_sign_everything_anew(self):
        old = (self.site / "identity_ca.pem").read_bytes()
        self.assertEqual(make("authorities", self.site, "--domain", "7").returncode, 0)
        self.assertNotEqual((self.site / "identity_ca.pem").read_bytes(), old)
        self.assertEqual(make("check", self.site).returncode, 0)

    def test_a_host_gets_its_own_documents_alone(self):
        out = self.site.parent / "host"
        self.assertEqual(make("host", self.site, out, "slave_io", "wva_server").returncode, 0)
        self.assertEqual({p.name for p in out.iterdir()},
                         {"identity_ca.pem", "permissions_ca.pem", "governance.p7s", "slave_io", "wva_server"})
        self.assertEqual(make("check", out).returncode, 0)
        self.assertEqual(make("rotate", out).returncode, 3, "a host has no authority")

    def test_what_ends_soon_is_found(self):
        make("rotate", self.site, "dds_spy", "--days", "10")
        done = make("check", self.site)
        self.assertEqual(done.returncode, 1)
        self.assertIn("dds_spy/identity.pem: ends on", done.stdout)
        self.assertIn("dds_spy/permissions.p7s: ends on", done.stdout)
        self.assertEqual(make("check", self.site, "--margin", "5").returncode, 0)

    def test_another_authority_is_found(self):
        other = self.site.parent / "other"
        make("site", other)
        for file in ("identity.pem", "key.pem"):
            shutil.copy(other / "slave_io" / file, self.site / "slave_io" / file)
        self.finds("slave_io/identity.pem: not signed by")

    def test_edited_permissions_are_found(self):
        file = self.site / "dds_spy/permissions.p7s"
        file.write_bytes(file.read_bytes().replace(b"DENY", b"ALLOW"))
        self.finds("dds_spy/permissions.p7s: the signature does not fit")

    def test_permissions_of_another_are_found(self):
        shutil.copy(self.site / "master_io/permissions.p7s", self.site / "dds_spy/permissions.p7s")
        self.finds("for another subject than CN=dds_spy,O=Phantom")

    def test_a_readable_key_is_found(self):
        (self.site / "slave_io/key.pem").chmod(0o644)
        self.finds("slave_io/key.pem: others may read it")

    def test_a_key_of_the_group_that_all_components_share_is_found(self):
        """On a host where the group `phantom` is the one that these files have."""
        tools = self.site.parent / "tools"
        tools.mkdir()
        key = self.site / "slave_io/key.pem"
        (tools / "getent").write_text(f'#!/bin/sh\n[ "$*" = "group phantom" ] && echo phantom:x:{key.stat().st_gid}:\n')
        (tools / "getent").chmod(0o755)
        host = {"env": {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}"}}
        self.assertEqual(make("check", self.site, **host).returncode, 0, "the group may not read them")
        key.chmod(0o640)
        self.assertEqual(make("check", self.site).returncode, 0, "on a host without that group")
        self.finds("slave_io/key.pem: every component may read it (group phantom, as before each had an account); as root: make own", **host)

    def test_a_key_that_does_not_fit_is_found(self):
        shutil.copy(self.site / "master_io/key.pem", self.site / "slave_io/key.pem")
        self.finds("slave_io/key.pem: not the key of the certificate")

    def test_a_missing_document_is_found(self):
        (self.site / "slave_io/key.pem").unlink()
        self.finds("slave_io/key.pem: missing")

    def test_only_the_commanding_identities_may_command(self):
        may = {name: {t for t in writes if t.endswith("_command")} for name, (writes, _) in read_rights().items()}
        self.assertEqual({name: topics for name, topics in may.items() if topics}, {
            "slave_io": {"operator_command"}, "master_io": {"operator_command"}, "synthetic_viewer": {"operator_command", "workspace_command"},
            "wva_server_command": {"workspace_command"}, "workspace_survey": {"workspace_command"}, "ros2_gateway": {"workspace_command"}, "phantom_sensing_command": {"sensing_command"},
            "operator_command_line": {"operator_command"}})
        for name, publishes in (("dds_spy", []), ("dds_recorder", ["component_status"]), ("phantom_session", [])):
            rule = (self.site / name / "permissions.p7s").read_text().split("<publish>")[1:]
            self.assertEqual([t for part in rule for t in re.findall("<topic>(.*?)</topic>", part.split("</publish>")[0])], publishes)

    def test_wrong_arguments(self):
        for words in (["site"], ["nonsense", self.site], ["rotate", self.site, "nobody"], ["site", "/x", "--domain", "400"], ["site", "/x", "--partition", "a b"],
                      ["check", self.site, "--days", "many"], ["host", self.site, "/tmp/x"]):
            self.assertEqual(make(*words).returncode, 2, words)
        self.assertEqual(make("check", "/nonexistent").returncode, 3)


if __name__ == "__main__":
    unittest.main()
