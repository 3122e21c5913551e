#include "common/runtime/cell/cell.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/core/errors.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "tests/support/captured_log.hpp"
#include "tests/support/files.hpp"

namespace phantom::runtime {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

// A cell in a folder of its own, with one line of it replaced per case.
class CellFile : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "drum.stl") << "solid drum\nendsolid drum\n";
    std::ofstream(folder_ / "arm.urdf") << "<robot name='a'/>\n";
  }

  CellConfig load(const std::string& from = "", const std::string& to = "") {
    const std::string text = from.empty() ? kCell : test::replaced(kCell, from, to);
    std::ofstream(folder_ / "cell.yaml") << text;
    return load_cell(folder_ / "cell.yaml");
  }
  void expect_refused(const std::string& from, const std::string& to, const std::string& message) {
    EXPECT_THAT([&] { load(from, to); }, ThrowsMessage<ConfigError>(HasSubstr(message))) << to;
  }

  static constexpr const char* kCell = R"(name: bench
workspace: {min_m: [-1, -1, 0], max_m: [1, 1, 1.5], voxel_size_m: 0.005}
profile: {thickness_vox: [4, 4, 4], mu_Pa_s_per_m: [32, 20, 13], mu_skin_Pa_s_per_m: 100}
objects:
  - name: drum
    mesh: drum.stl
    mesh_scale: 0.001
    pose: {xyz_m: [0.3, 0, 0.1]}
    real_deviation: {xyz_m: [0.004, 0, 0]}
arms:
  - name: arm
    urdf: arm.urdf
    tip_link: tool
    home: [0, 0.5]
    skin:
      - link: upper
        segments: [{from_m: [0, 0, 0], to_m: [0, 0, 0.4], from_radius_m: 0.05, to_radius_m: 0.04, sides: 32}]
    interest_points: [{name: elbow, link: upper, position_m: [0, 0, 0.4]}]
)";
  const std::filesystem::path folder_ = test::new_folder();
};

TEST_F(CellFile, LoadsWithUnitsFramesAndDefaults) {
  const CellConfig cell = load();
  EXPECT_EQ(cell.objects.at(0).X_WO.translation_m.x(), 0.3);
  EXPECT_EQ(cell.objects[0].X_deviation.translation_m.x(), 0.004);
  EXPECT_EQ(cell.objects[0].profile.mu_Pa_s_per_m, (std::vector<float>{32, 20, 13}))
      << "the cell's profile is inherited";
  const auto& segment = cell.arm().skin.at(0).segments.at(0);
  EXPECT_EQ(segment.sides, 32);
  EXPECT_FALSE(segment.rings.has_value()) << "absent means automatic";
  EXPECT_EQ(cell.arm("arm").interest_points.at(0).name, "elbow");
}

TEST_F(CellFile, EachFaultIsNamed) {
  EXPECT_THAT([&] { load("drum.stl", "gone.stl"); },
              ThrowsMessage<core::MissingError>(HasSubstr("objects[0].mesh: 'gone.stl' is not there")));
  expect_refused("drum.stl", ".", "objects[0].mesh: '.' is a folder");
  expect_refused("[32, 20, 13]", "[32, 20, 25]", "does not fall outwards at layer 3");
  expect_refused("[32, 20, 13]", "[32, 20]", "has 2 layers, thickness_vox has 3");
  expect_refused("mu_skin_Pa_s_per_m: 100", "mu_skin_Pa_s_per_m: 10", "below the first layer's");
  expect_refused("voxel_size_m: 0.005", "voxel_size_mm: 5", "voxel_size_m: is missing");
  expect_refused("voxel_size_m: 0.005", "voxel_size_m: 5", "allowed: 0.0001 to 1 m");
  expect_refused("voxel_size_m: 0.005", "voxel_size_m: 0.005, merge: newest",
                 "allowed: highest_viscosity, latest_object, object_priority");
  expect_refused("max_m: [1, 1, 1.5]", "max_m: [1, 1, -1.5]", "workspace.max_m");
  expect_refused("tip_link: tool", "tiplink: tool", "tip_link: is missing");
  expect_refused("mesh_scale: 0.001", "mesh_unit: mm", "unknown key");
  expect_refused("to_m: [0, 0, 0.4]", "to_m: [0, 0, 0]", "is the same point as from_m");
  expect_refused("sides: 32", "sides: 2", "allowed: 3 to 10000 sensors");
}

// Layers of one voxel of 2 mm in voxels 16 mm high: free space, then the body.
TEST_F(CellFile, RefusesLayersThatEndBeforeTheFirstVoxelAlongAnAxis) {
  const auto high = [](const char* profile) {
    return std::string("voxel_size_m: [0.002, 0.002, 0.016]}\nprofile: {") + profile +
           ", mu_Pa_s_per_m: [32, 20, 13], mu_skin_Pa_s_per_m: 100}\nobjects:";
  };
  const std::string from = std::string(kCell).substr(std::string(kCell).find("voxel_size_m"));
  const std::string lines = from.substr(0, from.find("objects:") + 8);
  expect_refused(
      lines, high("thickness_vox: [1, 1, 1]"),
      "profile: layer profile: layers and guard reach 0.006 m, but a voxel is 0.016 m long along z, "
      "where no layer has one");
  expect_refused(lines, high("thickness_vox: [2, 2, 3]"), "reach 0.014 m");
  expect_refused(lines, high("guard_vox: 8, thickness_vox: [2, 2, 3]"), "reach 0.03 m");
  EXPECT_NO_THROW(load(lines, high("thickness_vox: [2, 2, 4]")));
  EXPECT_NO_THROW(load(lines, high("method: dilation, thickness_vox: [1, 1, 1]")));
}

TEST_F(CellFile, WarnsOfLayersThatMayBeMissingAlongAnAxis) {
  const test::CapturedLog log;
  load();
  EXPECT_EQ(log.text(), "");
  load("voxel_size_m: 0.005", "voxel_size_m: [0.004, 0.005, 0.032]");
  EXPECT_THAT(
      log.text(),
      AllOf(HasSubstr("warning: "),
            HasSubstr("cell.yaml:3: profile: layers 1, 2, 3 are thinner than a voxel is long along z, "
                      "0.032 m, and may be missing there; straight along z these have no voxel: 1, 3\n")));
}

TEST_F(CellFile, VoxelsMayHaveASideForEachAxis) {
  EXPECT_EQ(load().voxel_size_m, workspace::VoxelSize(0.005));
  const CellConfig cell = load("voxel_size_m: 0.005", "voxel_size_m: [0.004, 0.005, 0.032]");
  EXPECT_EQ(cell.voxel_size_m.sides_m(), Eigen::Vector3d(0.004, 0.005, 0.032));
  EXPECT_EQ(cell.voxel_size_m.reference_m(), 0.004);
  const auto refused = [&](const std::string& size, const std::string& message) {
    EXPECT_THAT([&] { load("voxel_size_m: 0.005", "voxel_size_m: " + size); },
                ThrowsMessage<ConfigError>(
                    AllOf(HasSubstr("cell.yaml:2: workspace.voxel_size_m: "), HasSubstr(message))))
        << size;
  };
  refused("0", "is out of range; allowed: 0.0001 to 1 m");
  refused("[0.004, 0.004, 0]", "is out of range; allowed: 0.0001 to 1 m");
  refused("[0.004, -0.004, 0.004]", "is out of range; allowed: 0.0001 to 1 m");
  refused("[0.004, 0.004]", "has 2 numbers; allowed: one, or three, [x, y, z]");
  refused("[0.004, 0.004, 0.004, 0.004]", "has 4 numbers; allowed: one, or three, [x, y, z]");
  refused("[0.004, 0.004, 0.033]", "is 8.25 times as long along z as along x; allowed: at most 8 times");
  refused("[0.004, wide, 0.004]", "is not a number; allowed: 0.0001 to 1 m");
  refused("{x: 0.004}", "is not a number; allowed: 0.0001 to 1 m");
  expect_refused("voxel_size_m: 0.005", "voxel_size_m: [0.005, 0.0002, 0.0002]", "is 25 times");
  expect_refused("voxel_size_m: 0.005", "voxel_size_m: [0.0008, 0.0008, 0.0001]",
                 "gives 15000 voxels along axis 2; allowed: 1 to 8192");
}

TEST_F(CellFile, AnUnknownArmIsNamedWithThoseThereAre) {
  const CellConfig cell = load();
  EXPECT_THAT([&] { cell.arm("left"); },
              ThrowsMessage<ConfigError>(HasSubstr("no arm called 'left'; allowed: arm")));
}

TEST_F(CellFile, LayersInsideMayHaveAStiffness) {
  const std::string inside =
      "mu_skin_Pa_s_per_m: 100, inside: {thickness_vox: [2, 2], mu_Pa_s_per_m: [50, 75]";
  EXPECT_TRUE(load("mu_skin_Pa_s_per_m: 100", inside + "}").profile.stiffness_inside_Pa_per_m.empty());
  EXPECT_EQ(load("mu_skin_Pa_s_per_m: 100", inside + ", stiffness_Pa_per_m: [2e5, 0]}")
                .profile.stiffness_inside_Pa_per_m,
            (std::vector<double>{2e5, 0.0}));
  expect_refused("mu_skin_Pa_s_per_m: 100", inside + ", stiffness_Pa_per_m: [2e5]}",
                 "1 stiffnesses for 2 layers inside the body");
  expect_refused("mu_skin_Pa_s_per_m: 100", inside + ", stiffness_Pa_per_m: [2e5, -1]}", "0 to 1e+09 Pa/m");
}

TEST_F(CellFile, MediaFillABoxOrAllSpace) {
  const CellConfig cell =
      load("arms:\n",
           "media:\n  - {name: water, mu_Pa_s_per_m: 2, max_m: [1, 1, 0.8], current_m_s: "
           "[0.1, 0, 0], density_kg_per_m3: 998}\n  - {name: haze, mu_Pa_s_per_m: 0.1}\narms:\n");
  ASSERT_EQ(cell.media.size(), 2U);
  EXPECT_EQ(cell.media[0].current_m_s.x(), 0.1);
  EXPECT_TRUE(cell.media[0].contains({-50.0, 0.99, -3.0}));
  EXPECT_FALSE(cell.media[0].contains({0.0, 0.0, 0.8})) << "at its surface";
  EXPECT_EQ(cell.media[0].density_kg_per_m3, 998.0);
  EXPECT_FALSE(cell.media[1].density_kg_per_m3) << "as what it is in";
  EXPECT_TRUE(cell.media[1].contains({7.0, 8.0, 9.0}));
  EXPECT_TRUE(load().media.empty()) << "air";
}

TEST_F(CellFile, FaultsOfMediaAreNamed) {
  const auto expect_medium_refused = [&](const std::string& medium, const std::string& message) {
    expect_refused("arms:\n", "media: [" + medium + "]\narms:\n", message);
  };
  expect_medium_refused("{name: water}", "media[0].mu_Pa_s_per_m: is missing");
  expect_medium_refused("{name: water, mu_Pa_s_per_m: 0}", "allowed: 1e-06 to 1e+06 Pa·s/m");
  expect_medium_refused("{name: water, mu_Pa_s_per_m: 2, min_m: [0, 0, 1], max_m: [1, 1, 1]}",
                        "media[0].max_m: is not greater than min_m");
  expect_medium_refused("{name: water, mu_Pa_s_per_m: 2, current_m_s: [0, 0, -200]}",
                        "allowed: -100 to 100 m/s");
  expect_medium_refused("{name: water, mu_Pa_s_per_m: 2, min_m: [0, 0, .nan]}", "min_m");
  expect_medium_refused("{name: water, mu_Pa_s_per_m: 2, density_kg_per_m3: -1}",
                        "allowed: 0 to 25000 kg/m³");
  expect_medium_refused("{name: water, mu_Pa_s_per_m: 2}, {name: water, mu_Pa_s_per_m: 3}",
                        "two entries called 'water'");
}

TEST_F(CellFile, ObjectsWithOneNameAreRefused) {
  expect_refused("arms:\n", "  - {name: drum, mesh: drum.stl}\narms:\n", "two entries called 'drum'");
}

}  // namespace
}  // namespace phantom::runtime
