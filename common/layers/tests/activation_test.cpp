#include "common/layers/activation.hpp"

#include <gtest/gtest.h>

#include "common/geometry/implicit/primitives.hpp"
#include "common/layers/merge.hpp"
#include "common/voxelise/tests/literal_twins.hpp"

namespace phantom::layers {
namespace {

const workspace::LayerProfile kProfile{{2, 3}, {30.0F, 20.0F}, 100.0F, 1};

/// The workspace of one body.
workspace::Workspace workspace_of(const Body& body, const workspace::GridSpec& grid) {
  const auto object = activate_object(body, grid);
  if (!object) throw std::runtime_error(object.status().message());
  workspace::Workspace workspace(grid, *workspace::make_palette({body.profile}));
  const workspace::CodeTable codes = workspace::code_table(body.profile, workspace.palette());
  const MergeEntry entry{&object->bricks, body.id, &codes};
  merge_bricks(MergeLaw::kHighestViscosity, {&entry, 1}, object->bricks.keys(), workspace);
  return workspace;
}

TEST(GridOver, HasTheVoxelsThatTheBoxHolds) {
  const workspace::GridSpec cell = grid_over({-1.1, -1.1, 0.0}, {1.1, 1.1, 1.6}, 0.005);
  EXPECT_EQ(cell.size_vox, (std::array<std::int32_t, 3>{440, 440, 320}));
  EXPECT_EQ(grid_over({0, 0, 0}, {1.0, 1.0, 1.0}, 0.3).size_vox, (std::array<std::int32_t, 3>{4, 4, 4}));
}

TEST(Activation, OfABodyAloneIsThatOfTheBodyInACell) {
  const Body body{
      "torus", 5,
      geometry::make_torus(0.12, 0.03).transformed({Eigen::Matrix3d::Identity(), {0.3, -0.1, 0.2}}),
      kProfile};
  const auto alone = activate_alone(body, 0.01);
  ASSERT_TRUE(alone) << alone.status().message();
  const workspace::Workspace& small = alone->first;
  const workspace::Workspace cell = workspace_of(body, {{-0.2, -0.5, -0.1}, 0.01, {90, 90, 60}});
  const Eigen::Vector3d shift = (small.grid().origin_m - cell.grid().origin_m) / 0.01;
  const workspace::Index3 d{static_cast<int>(std::lround(shift.x())),
                            static_cast<int>(std::lround(shift.y())),
                            static_cast<int>(std::lround(shift.z()))};
  EXPECT_LT((shift - Eigen::Vector3d(d.x, d.y, d.z)).norm(), 1e-9);
  std::size_t different = 0;
  voxelise::twin::for_each(workspace::VoxelBox::of(small.grid()), [&](workspace::Index3 v) {
    const workspace::Index3 w{v.x + d.x, v.y + d.y, v.z + d.z};
    different +=
        small.order(v) != cell.order(w) || small.mu(v) != cell.mu(w) || small.object(v) != cell.object(w) ? 1
                                                                                                          : 0;
  });
  EXPECT_EQ(different, 0U);
  // Nothing of it lies outside of its own grid.
  EXPECT_EQ(count_orders(small)[workspace::kOrderInterior], count_orders(cell)[workspace::kOrderInterior]);
  EXPECT_EQ(count_orders(small)[2], count_orders(cell)[2]);
}

TEST(Activation, OfABodyAloneTakesTheSmallestBox) {
  const Body box{"box", 1,
                 geometry::make_box({0.1, 0.2, 0.3})
                     .transformed({Eigen::Matrix3d::Identity(), {0.0531, 0.1031, 0.1531}}),
                 kProfile};
  const auto alone = activate_alone(box, 0.01);
  ASSERT_TRUE(alone);
  // 11, 21 and 31 voxels hold the box off the lattice; reach 6 on each side.
  EXPECT_EQ(alone->first.grid().size_vox, (std::array<std::int32_t, 3>{23, 33, 43}));
  EXPECT_TRUE(alone->first.grid().origin_m.isApprox(Eigen::Vector3d::Constant(-0.06), 1e-9));
}

TEST(Activation, LayersBeyondTheGridStillReachIn) {
  // The body stands wholly outside of the grid; its layers do not.
  const Body body{
      "outside", 1,
      geometry::make_box({0.1, 0.1, 0.1}).transformed({Eigen::Matrix3d::Identity(), {-0.0731, 0.1, 0.1}}),
      kProfile};
  const workspace::Workspace workspace = workspace_of(body, {{0, 0, 0}, 0.01, {20, 20, 20}});
  EXPECT_EQ(workspace.order({0, 10, 10}), 1);  // the solid's last voxel is x = −3
  EXPECT_EQ(workspace.order({1, 10, 10}), 2);
  EXPECT_EQ(workspace.order({3, 10, 10}), 2);
  EXPECT_EQ(workspace.order({4, 10, 10}), workspace::kOrderFree);
}

TEST(Activation, PartByPartIsThatOfTheWhole) {
  const workspace::GridSpec grid{{-0.05, -0.3, 0.0}, 0.01, {100, 70, 75}};  // part of it lies beyond
  geometry::TriangleMesh open =
      geometry::make_torus(0.3, 0.06).transformed({Eigen::Matrix3d::Identity(), {0.2, 0.1, 0.3}});
  open.triangles.resize(open.triangles.size() - 40);
  for (const auto& mesh :
       {geometry::make_sphere(0.35, 4).transformed({Eigen::Matrix3d::Identity(), {0.3, 0, 0.3}}), open}) {
    Body body{"body", 1, mesh, kProfile};
    for (const workspace::LayerMethod method :
         {workspace::LayerMethod::kDistance, workspace::LayerMethod::kDilation,
          workspace::LayerMethod::kSurface}) {
      body.profile.method = method;
      ActivationOptions in_parts;
      in_parts.most_voxels_at_once = 32 * 32 * 32;
      std::vector<double> shares;
      in_parts.on_progress = [&](double share) { shares.push_back(share); };
      const auto whole = activate_object(body, grid), parts = activate_object(body, grid, in_parts);
      ASSERT_TRUE(whole && parts);
      EXPECT_EQ(whole->bricks.keys(), parts->bricks.keys());
      std::size_t different = 0;
      voxelise::twin::for_each(workspace::VoxelBox::of(grid), [&](workspace::Index3 v) {
        different += whole->bricks.at(v) != parts->bricks.at(v) ? 1 : 0;
      });
      EXPECT_EQ(different, 0U);
      EXPECT_EQ(whole->report.boundary_voxels, parts->report.boundary_voxels);
      EXPECT_EQ(whole->report.interior_voxels, parts->report.interior_voxels);
      EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
      EXPECT_EQ(shares.back(), 1.0);
    }
  }
}

TEST(Activation, AProtectedZoneIsLayerOneThroughoutAndAsABodyAroundIt) {
  const workspace::GridSpec grid{{0, 0, 0}, 0.01, {100, 100, 100}};
  const geometry::Pose at{Eigen::Matrix3d::Identity(), {0.48, 0.48, 0.48}};
  Body body{"ball", 3, geometry::make_sphere(0.35, 4).transformed(at), kProfile};
  for (const workspace::LayerMethod method :
       {workspace::LayerMethod::kDistance, workspace::LayerMethod::kDilation,
        workspace::LayerMethod::kSurface}) {
    body.profile.method = method;
    Body zone = body;
    zone.solid = false;
    const auto of_body = activate_object(body, grid), of_zone = activate_object(zone, grid);
    ASSERT_TRUE(of_body && of_zone);
    ASSERT_TRUE(of_body->bricks.is_interior({1, 1, 1})) << "a brick of its own kind";
    EXPECT_EQ(of_zone->bricks.keys(), of_body->bricks.keys());
    std::size_t different = 0, solid = 0;
    voxelise::twin::for_each(workspace::VoxelBox::of(grid), [&](workspace::Index3 v) {
      const std::int8_t order = of_body->bricks.at(v);
      const bool within = order == workspace::kOrderGuard || order == workspace::kOrderBoundary ||
                          order == workspace::kOrderInterior;
      different += of_zone->bricks.at(v) != (within ? 1 : order) ? 1 : 0;
      solid += within ? 1 : 0;
    });
    EXPECT_EQ(different, 0U);
    EXPECT_GT(solid, 150'000U);
    const workspace::Workspace world = workspace_of(zone, grid);
    EXPECT_EQ(world.mu({48, 48, 48}), 30.0F);
    EXPECT_EQ(world.object({48, 48, 48}), 3);
  }
}

TEST(Activation, ABodyInAProtectedZonePrevailsByItsViscosity) {
  const workspace::GridSpec grid{{0, 0, 0}, 0.01, {60, 60, 60}};
  const geometry::Pose at{Eigen::Matrix3d::Identity(), {0.3, 0.3, 0.3}};
  Body zone{"zone", 1, geometry::make_sphere(0.2, 4).transformed(at), kProfile};
  zone.solid = false;
  const Body bone{"bone", 2, geometry::make_sphere(0.05, 4).transformed(at), kProfile};
  const auto of_zone = activate_object(zone, grid), of_bone = activate_object(bone, grid);
  ASSERT_TRUE(of_zone && of_bone);
  workspace::Workspace world(grid, *workspace::make_palette({kProfile}));
  const workspace::CodeTable codes = workspace::code_table(kProfile, world.palette());
  const MergeEntry entries[] = {{&of_zone->bricks, 1, &codes}, {&of_bone->bricks, 2, &codes}};
  merge_bricks(MergeLaw::kHighestViscosity, entries, keys_of(entries), world);
  EXPECT_EQ(world.object({30, 30, 30}), 2);
  EXPECT_EQ(world.order({30, 30, 30}), workspace::kOrderInterior);
  EXPECT_EQ(world.object({40, 30, 30}), 1);
  EXPECT_EQ(world.order({40, 30, 30}), 1);
}

TEST(Activation, AProtectedZoneHasNoLayersInside) {
  Body zone{"zone", 1, geometry::make_sphere(0.1, 3), kProfile};
  zone.profile.inside_thickness_vox = {2};
  zone.profile.mu_inside_Pa_s_per_m = {50.0F};
  ASSERT_TRUE(activate_alone(zone, 0.01));
  zone.solid = false;
  const auto refused = activate_alone(zone, 0.01);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.status().message().find("'zone': has layers inside"), std::string::npos);
}

TEST(Activation, EndsWhenToldTo) {
  const Body body{"ball", 1, geometry::make_sphere(0.2, 4), kProfile};
  for (int answers = 0; answers < 2; ++answers) {
    ActivationOptions options;
    int asked = 0;
    options.keep_going = [&] { return asked++ < answers; };
    const auto stopped = activate_object(body, {{-0.3, -0.3, -0.3}, 0.01, {60, 60, 60}}, options);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.status().code(), core::ErrorCode::kUnavailable);
  }
}

TEST(Activation, NamesTheBodyThatItCannotTake) {
  const workspace::GridSpec grid{{0, 0, 0}, 0.01, {20, 20, 20}};
  const auto refused = activate_object({"drum", 1, geometry::make_sphere(5000, 2), kProfile}, grid);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.status().message().find("'drum'"), std::string::npos);
  const auto huge = activate_alone({"drum", 1, geometry::make_sphere(500, 2), kProfile}, 0.01);
  ASSERT_FALSE(huge);
  EXPECT_NE(huge.status().message().find("scale"), std::string::npos);
  EXPECT_FALSE(activate_alone({"drum", 1, geometry::make_sphere(1e30, 2), kProfile}, 0.01));
}

TEST(Activation, CountsTheVoxelsOfEveryOrder) {
  const auto alone = activate_alone({"ball", 1, geometry::make_sphere(0.2, 4), kProfile}, 0.01);
  ASSERT_TRUE(alone);
  const auto counts = count_orders(alone->first);
  std::array<std::uint64_t, 256> literal{};
  voxelise::twin::for_each(workspace::VoxelBox::of(alone->first.grid()), [&](workspace::Index3 v) {
    ++literal[static_cast<std::uint8_t>(alone->first.order(v))];
  });
  EXPECT_EQ(counts, literal);
  EXPECT_EQ(counts[workspace::kOrderBoundary], alone->second.boundary_voxels);
  EXPECT_EQ(counts[workspace::kOrderInterior], alone->second.interior_voxels);
}

}  // namespace
}  // namespace phantom::layers
