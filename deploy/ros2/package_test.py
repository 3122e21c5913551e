#!/usr/bin/env python3
"""package_test.py CMAKE BUILD_DIR VERSION: package.xml is valid as ROS's own reader has it (catkin_pkg, of which colcon and rosdep are made) and true to the build;
what is installed for ROS 2 is where its tools look; the launch file uses what launch_xml has. ROS 2 itself is not at hand."""
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path

from catkin_pkg.package import InvalidPackage, parse_package, parse_package_string

ROOT = Path(__file__).resolve().parent.parent.parent
CMAKE, BUILD, VERSION = sys.argv[1:4]
# rosdep's keys (ros/rosdistro, rosdep/base.yaml and python.yaml, 2026-08) and what Debian calls them; None: a package of ROS 2.
KEYS = {"assimp-dev": "libassimp-dev", "cli11": "libcli11-dev", "cmake": "cmake", "eigen": "libeigen3-dev", "launch": None, "launch_xml": None,
        "libcpp-httplib-dev": "libcpp-httplib-dev", "libepoxy-dev": "libepoxy-dev", "libglfw3-dev": "libglfw3-dev", "libopenal-dev": "libopenal-dev",
        "libopencv-dev": "libopencv-", "libopenni2-dev": "libopenni2-dev", "libpng-dev": "libpng-dev", "libsndfile1-dev": "libsndfile1-dev", "libspnav-dev": "libspnav-dev",
        "libssl-dev": "libssl-dev", "liburdfdom-dev": "liburdfdom-dev", "libzstd-dev": "libzstd-dev", "muparser": "libmuparser-dev",
        "ninja-build": "ninja-build", "nlohmann-json-dev": "nlohmann-json3-dev", "nodejs": "nodejs", "npm": "npm", "pkg-config": "pkg-config", "python3-yaml": "python3-yaml",
        "spdlog": "libspdlog-dev", "tinyxml2": "libtinyxml2-dev", "yaml-cpp": "libyaml-cpp-dev", "zlib": "zlib1g-dev"}
# Libraries of scripts/setup that rosdep has no key for, as package.xml says.
WITHOUT_KEY = {"libfastcdr-dev", "libhwy-dev", "libmujoco-dev", "libseccomp-dev", "libminizip-dev", "libegl-dev", "libgl-dev", "libwslay-dev"}


class PackageXml(unittest.TestCase):
    def setUp(self):
        self.warnings = []
        self.package = parse_package(ROOT / "package.xml", warnings=self.warnings)

    def test_is_valid_and_true_to_the_build(self):
        self.package.validate(warnings=self.warnings)
        self.assertEqual(self.warnings, [])
        self.assertEqual((self.package.name, self.package.version, self.package.package_format), ("phantom", VERSION, 3))
        self.assertEqual(self.package.get_build_type(), "cmake")
        self.assertEqual([str(one) for one in self.package.licenses], ["Apache-2.0"])
        self.assertTrue((ROOT / self.package.licenses[0].file).exists())

    def test_what_is_wrong_would_be_found(self):
        text = (ROOT / "package.xml").read_text()
        for right, wrong in (("<name>phantom</name>", "<name>Phantom Gateway</name>"), (VERSION, "one"), ("</maintainer>", ""), ("format=\"3\"", "format=\"9\""),
                             ("<license file", "<licence file"), ("<depend>eigen</depend>", "<needs>eigen</needs>")):
            self.assertIn(right, text)
            with self.assertRaises((InvalidPackage, AssertionError), msg=wrong):
                parse_package_string(text.replace(right, wrong))

    def test_its_dependencies_are_those_of_setup_by_the_keys_of_rosdep(self):
        used = {one.name for kind in ("buildtool_depends", "build_depends", "exec_depends") for one in getattr(self.package, kind)}
        self.assertEqual(used, set(KEYS), "keys that are not in the list are not known to exist")
        setup = re.search(r"^packages=\((.*?)^\)", (ROOT / "scripts/setup").read_text(), re.S | re.M)[1]
        needed = set(re.findall(r"\b[\w.+-]+-dev\b", setup)) - WITHOUT_KEY
        for key in used:
            needed = {package for package in needed if KEYS[key] is None or not package.startswith(KEYS[key].removesuffix("-dev"))}
        self.assertEqual(needed, set(), "libraries of scripts/setup that package.xml does not name")


class Installed(unittest.TestCase):
    def test_is_where_the_tools_of_ros2_look(self):
        with tempfile.TemporaryDirectory() as prefix:
            subprocess.run([CMAKE, "--install", BUILD, "--component", "ros2", "--prefix", prefix], check=True, stdout=subprocess.DEVNULL)
            files = {path.relative_to(prefix).as_posix() for path in Path(prefix).rglob("*") if path.is_file()}
        self.assertEqual(files, {"share/ament_index/resource_index/packages/phantom", "share/phantom/package.xml",
                                 "share/phantom/launch/ros2_arm.launch.xml"})


class LaunchFile(unittest.TestCase):
    def test_names_what_is_installed(self):
        launch = xml.parse(ROOT / "deploy/ros2/ros2_arm.launch.xml").getroot()
        self.assertEqual(launch.tag, "launch")
        allowed = {"arg": {"name", "default", "description"}, "executable": {"name", "cmd", "output", "sigterm_timeout"}}
        for action in launch:
            self.assertLessEqual(set(action.attrib), allowed[action.tag])
        substitutions = [words for action in launch for value in action.attrib.values() for words in re.findall(r"\$\((.*?)\)", value)]
        declared = {arg.attrib["name"] for arg in launch.iter("arg")}
        for words in substitutions:
            kind, name = words.split()
            self.assertIn(kind, ("find-pkg-share", "find-pkg-prefix", "var"))
            self.assertIn(name, declared if kind == "var" else {"phantom"})
        self.assertTrue((ROOT / launch.find("arg").attrib["default"].replace("$(find-pkg-share phantom)/", "")).exists())
        executable = re.match(r"\$\(find-pkg-prefix phantom\)/bin/(\w+) ", launch.find("executable").attrib["cmd"])[1]
        self.assertTrue((ROOT / "components" / executable / "CMakeLists.txt").exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
