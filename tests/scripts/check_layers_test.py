"""The layer check must find each kind of broken rule and pass what is allowed."""
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "scripts/checks/layers"


class CheckLayers(unittest.TestCase):
    def check(self, path, include):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            (root / "scripts/checks").mkdir(parents=True)
            shutil.copy(SCRIPT, root / "scripts/checks/layers")
            source = root / path
            source.parent.mkdir(parents=True)
            source.write_text(f"#pragma once\n#include {include}\n", encoding="utf-8")
            return subprocess.run([sys.executable, root / "scripts/checks/layers"], capture_output=True, text=True, check=False)

    def test_broken_rules_are_named_with_their_place(self):
        for path, include in [
            ("common/core/a.hpp", '"common/geometry/pose.hpp"'),
            ("common/geometry/a.cpp", '"common/workspace/grid.hpp"'),
            ("common/voxelise/a.cpp", '"phantom_idl/percept.hpp"'),
            ("common/voxelise/a.cpp", "<fastdds/dds/topic/Topic.hpp>"),
            ("common/voxelise/a.cpp", '"fast_dds/types.hpp"'),
            ("common/geometry/a.hpp", "<assimp/scene.h>"),
            ("common/robot/a.hpp", "<Eigen/Geometry>"),
            ("common/dds/a.cpp", '"common/runtime/cell/cell.hpp"'),
            ("common/runtime/a.cpp", '"common/dds/endpoints/endpoint.hpp"'),
            ("common/runtime/a.cpp", '"common/messages/teleoperation.hpp"'),
            ("common/messages/teleoperation.hpp", '"phantom_idl/teleoperation.hpp"'),
            ("common/messages/teleoperation.hpp", '"common/messages/codecs/teleoperation_codec.hpp"'),
            ("common/messages/teleoperation.hpp", '"common/dds/endpoints/stamp.hpp"'),
            ("components/master_io/servo.cpp", '"common/messages/codecs/teleoperation_codec.hpp"'),
            ("common/messages/command_queue.hpp", '"common/dds/endpoints/stamp.hpp"'),
            ("common/messages/ask.hpp", '"common/dds/endpoints/endpoint.hpp"'),
            ("common/dds/a.cpp", '"common/messages/teleoperation.hpp"'),
            ("components/master_io/servo.cpp", '"common/messages/topic_receiver.hpp"'),
            ("components/master_io/servo.cpp", '"common/messages/status_reporter.hpp"'),
            ("components/master_io/a.cpp", '"components/slave_io/config.hpp"'),
            ("common/teleop/a.cpp", '"common/robot/kinematics/internal/urdf_file.hpp"'),
            ("components/master_io/master_io.cpp", '"phantom_idl/percept.hpp"'),
            ("components/master_io/main.cpp", '"common/dds/endpoints/endpoint.hpp"'),
            ("components/master_io/a.cpp", '"tests/support/heap_guard.hpp"'),
        ]:
            with self.subTest(path=path, include=include):
                result = self.check(path, include)
                self.assertEqual(result.returncode, 1, result.stdout)
                self.assertIn(f"{path}:2: includes", result.stdout)

    def test_what_is_allowed_passes(self):
        for path, include in [
            ("common/voxelise/a.cpp", '"common/geometry/mesh/mesh.hpp"'),
            ("common/geometry/a.cpp", "<assimp/scene.h>"),
            ("common/robot/a.hpp", "<Eigen/Core>"),
            ("common/robot/kinematics/internal/a.hpp", "<urdf_parser/urdf_parser.h>"),
            ("components/master_io/dds_adapter.cpp", '"phantom_idl/percept.hpp"'),
            ("components/master_io/dds_adapter.cpp", '"common/messages/topic_receiver.hpp"'),
            ("components/master_io/servo.cpp", '"common/messages/teleoperation.hpp"'),
            ("components/master_io/main.cpp", '"common/messages/operator_command_line.hpp"'),
            ("common/messages/status_reporter.cpp", '"common/dds/endpoints/endpoint.hpp"'),
            ("common/messages/codecs/percept_codec.cpp", '"phantom_idl/percept.hpp"'),
            ("components/master_io/tests/a_test.cpp", '"phantom_idl/percept.hpp"'),
            ("tests/end_to_end/a.cpp", '"components/slave_io/config.hpp"'),
        ]:
            with self.subTest(path=path, include=include):
                self.assertEqual(self.check(path, include).returncode, 0)


if __name__ == "__main__":
    unittest.main()
