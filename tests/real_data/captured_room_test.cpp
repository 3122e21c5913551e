// Depth images of rooms that a headset has captured: real clutter, of which the true surface is known
// exactly.
#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>
#include <set>

#include "common/fusion/fusion.hpp"
#include "common/fusion/tests/scenes.hpp"
#include "common/fusion/tests/surface_errors.hpp"
#include "common/geometry/mesh/mesh_io.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::fusion {
namespace {

using workspace::Index3;
using workspace::VoxelBox;

/// A room, and a camera in it: in its middle, 1.6 m above the floor, that looks at furniture at `azimuth`.
struct Look {
  const char* room;
  int azimuth_deg;
};

class CapturedRoom : public testing::TestWithParam<Look> {
 protected:
  static geometry::TriangleMesh mesh() {
    std::filesystem::path file = PHANTOM_ROOMS;
    (file /= GetParam().room) += ".ply";
    const auto loaded = geometry::load_mesh(file, {.scale = 1.0, .y_up = false});
    if (!loaded) throw std::runtime_error(loaded.status().message());
    return *loaded;
  }
};

/// Returns how many voxels of a block are published that have no surface within 40 mm, or 5 σ where the
/// camera is so far.
std::size_t false_voxels(const Fusion& fusion, const scenes::Simulated& camera, Index3 block) {
  std::size_t count = 0;
  voxels_of(block).intersection(VoxelBox::of(fusion.grid())).for_each([&](Index3 v) {
    if (!fusion.occupied().get(v)) return;
    const Eigen::Vector3d p = fusion.grid().centre_of(v);
    const double depth_m = (camera.header().X_WC.inverse() * p).z(),
                 bound_m = std::max(0.04, 5.0 * fusion.parameters().sigma.at(depth_m));
    count += camera.scene().distance_m(p, 0.5) > bound_m ? 1 : 0;
  });
  return count;
}

TEST_P(CapturedRoom, WhatIsPublishedIsTrueAndNothingElseIs) {
  const geometry::TriangleMesh room = mesh();
  const geometry::BoundingBox box = room.bounding_box();
  const double floor_m = static_cast<double>(box.min_m.z()), turn = GetParam().azimuth_deg * 0.0174532925;
  Eigen::Vector3d eye = 0.5 * (box.min_m + box.max_m).cast<double>();
  eye.z() = floor_m + 1.6;
  const Eigen::Vector3d ahead(std::cos(turn), std::sin(turn), 0.0), middle = eye + 1.2 * ahead;
  FusionParameters parameters;
  parameters.grid = {{middle.x() - 1.0, middle.y() - 1.0, floor_m - 0.05}, 0.005, {400, 400, 300}};
  parameters.max_blocks = 20'000;
  scenes::Simulated camera({{room, false}}, scenes::depth_camera(2),
                           scenes::looking_at(eye, Eigen::Vector3d(middle.x(), middle.y(), floor_m + 0.5)));
  Fusion fusion = Fusion::create(parameters).value();
  constexpr std::uint64_t kImages = 600, kSettled = 100;  // 20 s
  std::size_t false_matter = 0, bricks = 0;
  for (std::uint64_t i = 0; i < kImages; ++i) {
    EXPECT_EQ(fusion.integrate(camera.frame(i)).refused, 0U);
    std::set<Index3> changed;
    for (const Index3 block : fusion.changed_blocks()) {
      changed.insert(workspace::brick_of(kBlockEdge * block));
      false_matter += false_voxels(fusion, camera, block);
    }
    bricks += i < kSettled ? 0 : changed.size();
    fusion.clear_changes();
  }
  const double bricks_an_image = static_cast<double>(bricks) / (kImages - kSettled);
  const scenes::SurfaceErrors errors(fusion, camera.scene(), {{1, 1, 1}, {398, 398, 298}});
  ASSERT_GT(errors.count(), 10'000U);
  std::cout << GetParam().room << " at " << GetParam().azimuth_deg << " degrees: surface error "
            << 1e3 * errors.mean_m() << " mm, 95 %: " << 1e3 * errors.percentile_m(95) << " mm, of "
            << errors.count() << " places; " << false_matter << " voxels were published beside it; "
            << bricks_an_image << " bricks changed an image\n";
  EXPECT_LT(errors.mean_m(), 0.0025);
  EXPECT_LT(errors.percentile_m(95), 0.006);
  EXPECT_EQ(false_matter, 0U);
  EXPECT_LE(bricks_an_image, 5.0);
}

INSTANTIATE_TEST_SUITE_P(Rooms, CapturedRoom,
                         testing::Values(Look{"living_room", 0}, Look{"living_room", 120},
                                         Look{"office_small", 90}, Look{"office_large", 200},
                                         Look{"meeting_room", 45}, Look{"music_room", 270}),
                         [](const auto& one) {
                           return std::string(one.param.room) + "_" + std::to_string(one.param.azimuth_deg);
                         });

}  // namespace
}  // namespace phantom::fusion
