// A scan of a real thing, 114,000 points in millimetres, and another scan of it as its model: Debian's
// opencv-doc.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <numbers>

#include "common/fusion/fusion.hpp"
#include "common/fusion/point_projection.hpp"
#include "common/fusion/tests/scenes.hpp"
#include "common/geometry/mesh/mesh_io.hpp"
#include "components/workspace_camera/cloud_file.hpp"
#include "components/workspace_camera/confirmed_findings.hpp"
#include "components/workspace_camera/pose_check.hpp"

namespace phantom::workspace_camera {
namespace {

const std::filesystem::path kFolder = "/usr/share/doc/opencv-doc/examples/surface_matching/data";
const fusion::PinholeCamera kCamera{320, 240, 480.0, 480.0, 159.5, 119.5, 0.3, 2.0};
/// The scanner looks along −z of the files, and y of the files is up.
const geometry::Pose X_CS{Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal().toDenseMatrix(),
                          Eigen::Vector3d::Zero()};

/// Where the model stands in the scan. Two of the five poses that OpenCV's surface_matching (4.6,
/// PPF3DDetector with its ICP) rates best lead an ICP from point to plane to this one, from 0 and from 75 mm
/// away: half of the model's points are then within 1.2 mm of the scan, rms. From the other three none is
/// found.
geometry::Pose true_pose() {
  geometry::Pose X_SO;
  X_SO.rotation << 0.994022, -0.0893898, 0.0626916, 0.102045, 0.556435, -0.824601, 0.0388271, 0.826069,
      0.56223;
  X_SO.rotation = Eigen::Quaterniond(X_SO.rotation).normalized().toRotationMatrix();
  X_SO.translation_m = Eigen::Vector3d(-73.1148, -604.221, -295.154) * 1e-3;
  return X_CS * X_SO;
}

geometry::TriangleMesh mesh_of(const char* name) {
  const auto loaded = geometry::load_mesh(kFolder / name, {.scale = 1e-3, .y_up = false});
  if (!loaded) throw std::runtime_error(loaded.status().message());
  return *loaded;
}

class Scan : public testing::Test {
 protected:
  void SetUp() override {
    std::ifstream file(kFolder / "rs1_normals.ply", std::ios::binary);
    ASSERT_TRUE(file) << "opencv-doc is missing; scripts/setup --data installs it";
    const std::string octets((std::istreambuf_iterator<char>(file)), {});
    auto points = read_cloud(octets);
    ASSERT_TRUE(points) << points.status().message();
    ASSERT_EQ(points->size(), 3U * 114'373U);
    for (std::size_t i = 0; i < points->size(); i += 3) {
      const Eigen::Vector3d p =
          X_CS * (1e-3 * Eigen::Vector3d((*points)[i], (*points)[i + 1], (*points)[i + 2]));
      for (std::size_t axis = 0; axis < 3; ++axis)
        (*points)[i + axis] = static_cast<float>(p[static_cast<Eigen::Index>(axis)]);
    }
    const core::Status loaded =
        image_.load_mm({kCamera, {}, 1.0}, fusion::depths_of_points(*points, kCamera));
    ASSERT_TRUE(loaded) << loaded.message();
  }

  /// The scan without the thing: what else a model of the cell would know.
  static geometry::TriangleMesh rest(const geometry::TriangleMesh& model) {
    geometry::TriangleMesh scan = mesh_of("rs1_normals.ply").transformed(X_CS);
    const fusion::CameraScene thing({{model.transformed(true_pose()), false}});
    std::vector<bool> far;
    for (const Eigen::Vector3f& vertex : scan.vertices_m)
      far.push_back(thing.distance_m(vertex.cast<double>(), 0.02) > 0.012);
    std::erase_if(scan.triangles, [&](const auto& t) { return !far[t[0]] || !far[t[1]] || !far[t[2]]; });
    return scan;
  }

  PoseFinding judge(const geometry::Pose& X_WO, bool knows_rest = true) {
    std::vector<ModelObject> objects{{1, "parasaurolophus", model_}};
    std::vector<Place> places{X_WO};
    if (knows_rest) {
      objects.push_back({2, "rest", rest(model_)});
      places.emplace_back(geometry::Pose());
    }
    PoseCheck check({}, objects);
    const auto findings = check.judge(image_, {}, places);
    return findings.empty() ? PoseFinding{} : findings.front();
  }

  fusion::DepthImage image_;
  geometry::TriangleMesh model_ = mesh_of("parasaurolophus_6700.ply");
};

TEST_F(Scan, FillsItsImage) { EXPECT_GT(image_.valid_pixels(), 20'000U) << "of 76,800"; }

TEST_F(Scan, AModelThatStandsWhereTheThingDoesAgrees) {
  const PoseFinding finding = judge(true_pose());
  EXPECT_EQ(finding.verdict, PoseVerdict::kAgrees) << finding.agree << " of " << finding.pixels;
}

TEST_F(Scan, AModelThatStandsElsewhereIsFoundWhereTheThingDoes) {
  const geometry::BoundingBox box = model_.bounding_box();
  const Eigen::Vector3d middle_O_m = 0.5 * (box.min_m + box.max_m).cast<double>(),
                        middle_m = true_pose() * middle_O_m;
  for (const Eigen::Vector3d& shift_m :
       {Eigen::Vector3d(0.06, 0.0, 0.0), Eigen::Vector3d(0.0, -0.05, 0.0), Eigen::Vector3d(-0.04, 0.04, 0.0),
        Eigen::Vector3d(0.0, 0.0, 0.06)}) {
    geometry::Pose displaced = true_pose();
    displaced.translation_m += shift_m;
    const PoseFinding finding = judge(displaced);
    ASSERT_EQ(finding.verdict, PoseVerdict::kElsewhere) << sentence(finding);
    const double off_m = (finding.corrected_WO * middle_O_m - middle_m).norm(),
                 turned = Eigen::AngleAxisd(finding.corrected_WO.rotation.transpose() * true_pose().rotation)
                              .angle();
    std::cout << "shifted by " << 1e3 * shift_m.transpose() << " mm: found " << 1e3 * off_m << " mm and "
              << turned * 180.0 / std::numbers::pi << " degrees beside the truth; " << sentence(finding)
              << '\n';
    EXPECT_LT(off_m, 0.01);
    EXPECT_LT(turned, 3.0 * std::numbers::pi / 180.0);
  }
}

TEST_F(Scan, AmongThingsThatTheModelDoesNotKnowNoWrongPoseIsTold) {
  geometry::Pose displaced = true_pose();
  displaced.translation_m.x() += 0.06;
  const PoseFinding finding = judge(displaced, false);
  EXPECT_NE(finding.verdict, PoseVerdict::kAgrees);
  if (finding.verdict == PoseVerdict::kElsewhere) {
    EXPECT_LT((finding.corrected_WO.translation_m - true_pose().translation_m).norm(), 0.01)
        << sentence(finding);
  }
}

TEST_F(Scan, AModelOfWhichNothingIsThereIsGone) {
  geometry::Pose nearer = true_pose();
  nearer.translation_m.z() -= 0.3;
  PoseCheckRules rules;
  rules.reach_m = 0.05;
  PoseCheck check(rules, {{1, "parasaurolophus", model_}});
  const std::vector<Place> places{nearer};
  EXPECT_EQ(check.judge(image_, {}, places).front().verdict, PoseVerdict::kGone);
}

TEST_F(Scan, WhatIsFusedIsTheScannedSurface) {
  fusion::FusionParameters parameters;
  parameters.grid = {{-0.2, -0.16, 0.5}, 0.003, {128, 112, 96}};
  parameters.max_blocks = 3000;
  fusion::Fusion fusion = fusion::Fusion::create(parameters).value();
  for (int i = 0; i < 30; ++i) fusion.integrate(image_);
  const geometry::TriangleMesh scan = mesh_of("rs1_normals.ply").transformed(X_CS);
  const fusion::CameraScene truth({{scan, false}});
  std::size_t occupied = 0, beside = 0;
  workspace::VoxelBox::of(parameters.grid).for_each([&](workspace::Index3 v) {
    if (!fusion.occupied().get(v)) return;
    ++occupied;
    beside += truth.distance_m(parameters.grid.centre_of(v), 0.05) > 0.012 ? 1 : 0;
  });
  std::size_t seen = 0, missing = 0;
  for (std::size_t i = 0; i < scan.vertices_m.size(); i += 7) {
    const workspace::Index3 v = parameters.grid.index_of(scan.vertices_m[i].cast<double>());
    if (!workspace::VoxelBox{{3, 3, 3}, {122, 106, 90}}.contains(v)) continue;
    ++seen;
    bool near = false;
    workspace::VoxelBox{v - workspace::Index3{2, 2, 2}, {5, 5, 5}}.for_each(
        [&](workspace::Index3 u) { near = near || fusion.occupied().get(u); });
    missing += near ? 0 : 1;
  }
  std::cout << occupied << " voxels of 3 mm, " << beside << " of them 12 mm beside the scan; " << missing
            << " of " << seen << " points without a voxel\n";
  EXPECT_GT(occupied, 10'000U);
  EXPECT_LE(beside, occupied / 1000);
  EXPECT_LE(missing, seen / 50) << "thin edges";
}

}  // namespace
}  // namespace phantom::workspace_camera
