#include "common/voxel/layer_methods.hpp"

#include <gtest/gtest.h>

#include "common/geometry/primitives.hpp"
#include "common/voxel/inside.hpp"
#include "common/voxel/surface_layers.hpp"
#include "common/voxel/tests/method_twins.hpp"
#include "common/voxel/tests/random_solid.hpp"

namespace phantom::voxel {
namespace {

using geometry::Pose;

const GridSpec kOffGrid{{-0.1, 0.05, 0.0}, 0.01, {70, 64, 50}};

LayerProfile profile_with(int guard, std::vector<int> inside = {}) {
  LayerProfile profile{{3, 2, 4}, {30.0F, 20.0F, 10.0F}, 100.0F, guard};
  profile.inside_thickness_vox = std::move(inside);
  for (std::size_t i = 0; i < profile.inside_thickness_vox.size(); ++i)
    profile.mu_inside_Pa_s_per_m.push_back(40.0F + 10.0F * static_cast<float>(i));
  return profile;
}

geometry::TriangleMesh tilted_cylinder() {
  return geometry::make_cylinder(0.12F, 0.25F, 24)
      .transformed({geometry::rotation_from_rpy(0.4, 0.8, 0.1), {0.2, 0.35, 0.27}});
}

void expect_surface_like_the_twin(const geometry::TriangleMesh& mesh, const LayerProfile& profile) {
  const SolidVoxels solid = *voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, profile));
  const ObjectBricks bricks =
      surface_bricks(mesh, solid, profile, kOffGrid, VoxelBox::of(kOffGrid), {2, nullptr});
  std::size_t layered = 0;
  twin::for_each(VoxelBox::of(kOffGrid), [&](Index3 v) {
    const std::int8_t expected = twin::is_boundary(solid, v) ? kOrderBoundary
                                 : twin::is_solid(solid, v)
                                     ? kOrderInterior
                                     : twin::order_at(profile, twin::surface_distance(mesh, kOffGrid, v));
    ASSERT_EQ(bricks.at(v), expected) << v.x << ' ' << v.y << ' ' << v.z;
    layered += expected > 0 && expected < kOrderGuard ? 1 : 0;
  });
  EXPECT_GT(layered, 1000U);
}

TEST(SurfaceLayers, EqualTheLiteralTwinInEveryVoxel) {
  expect_surface_like_the_twin(tilted_cylinder(), profile_with(0));
  expect_surface_like_the_twin(tilted_cylinder(), profile_with(2));
}

TEST(SurfaceLayers, EqualTheLiteralTwinOfABodyThatHangsOverTheGrid) {
  const auto mesh = geometry::make_box({0.3F, 0.2F, 0.1F})
                        .transformed({geometry::rotation_from_rpy(1.0, 0.2, 0.3), {-0.12, 0.1, 0.49}});
  expect_surface_like_the_twin(mesh, profile_with(1));
}

TEST(SurfaceLayers, KnowTheExactDistanceOfASphere) {
  // An independent oracle: the sphere's own distance, with a mesh so fine that only voxels at a border may
  // differ.
  const Eigen::Vector3d centre(0.2013, 0.3527, 0.2541);
  const auto mesh = geometry::make_sphere(0.11, 6).transformed({Eigen::Matrix3d::Identity(), centre});
  const LayerProfile profile = profile_with(1);
  const SolidVoxels solid = *voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, profile));
  const ObjectBricks bricks = surface_bricks(mesh, solid, profile, kOffGrid, VoxelBox::of(kOffGrid));
  twin::for_each(VoxelBox::of(kOffGrid), [&](Index3 v) {
    if (twin::is_solid(solid, v)) return;
    const double d = ((kOffGrid.centre_of(v) - centre).norm() - 0.11) / kOffGrid.voxel_size_m;
    const double slack = 0.005;
    EXPECT_TRUE(bricks.at(v) == twin::order_at(profile, d - slack) ||
                bricks.at(v) == twin::order_at(profile, d + slack))
        << d << ' ' << int{bricks.at(v)};
  });
}

TEST(SurfaceLayers, AreTheSameInWhateverPartsTheGridIsDone) {
  const auto mesh = tilted_cylinder();
  const LayerProfile profile = profile_with(1);
  const SolidVoxels solid = *voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, profile));
  const ObjectBricks whole = surface_bricks(mesh, solid, profile, kOffGrid, VoxelBox::of(kOffGrid));
  for (const BrickKey key : whole.keys()) {
    const VoxelBox part = box_of(key).intersection(VoxelBox::of(kOffGrid));
    const ObjectBricks one = surface_bricks(mesh, solid, profile, kOffGrid, part, {2, nullptr});
    twin::for_each(part, [&](Index3 v) { ASSERT_EQ(one.at(v), whole.at(v)); });
  }
}

TEST(InsideLayers, EqualTheLiteralTwinForEveryMethod) {
  const auto mesh = tilted_cylinder();
  for (const LayerMethod method : {LayerMethod::kDistance, LayerMethod::kSurface, LayerMethod::kDilation}) {
    LayerProfile profile = profile_with(1, {2, 1, 3});
    profile.method = method;
    ASSERT_TRUE(check_profile(profile)) << check_profile(profile).message();
    const SolidVoxels solid = *voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, profile));
    const ObjectBricks bricks =
        lay_layers(mesh, solid, profile, kOffGrid, VoxelBox::of(kOffGrid), {2, nullptr});
    LayerProfile without = profile;
    without.inside_thickness_vox.clear();
    without.mu_inside_Pa_s_per_m.clear();
    const ObjectBricks outer = lay_layers(mesh, solid, without, kOffGrid, VoxelBox::of(kOffGrid));
    std::size_t deep = 0, innermost = 0;
    twin::for_each(VoxelBox::of(kOffGrid), [&](Index3 v) {
      if (outer.at(v) != kOrderInterior) {
        ASSERT_EQ(bricks.at(v), outer.at(v));
        return;
      }
      ASSERT_EQ(bricks.at(v), twin::inside_order(solid, profile, v));
      deep += bricks.at(v) == kOrderInterior ? 1 : 0;
      innermost += bricks.at(v) == -3 ? 1 : 0;
    });
    EXPECT_GT(deep, 10U);
    EXPECT_GT(innermost, 100U);
  }
}

TEST(InsideLayers, DoNotTakeTheGridsEndForTheBodys) {
  // A box that fills the grid's lower half and reaches far out of it: only its top is near.
  const auto mesh =
      geometry::make_box({4.0F, 4.0F, 2.0F}).transformed({Eigen::Matrix3d::Identity(), {0.2, 0.3, -0.75}});
  const LayerProfile profile = profile_with(0, {4});
  const SolidVoxels solid = *voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, profile));
  const ObjectBricks bricks = lay_layers(mesh, solid, profile, kOffGrid, VoxelBox::of(kOffGrid));
  twin::for_each(VoxelBox::of(kOffGrid), [&](Index3 v) {
    const int above = v.z - 25;  // the top face lies on the border below voxel 25, which is boundary
    if (above <= 0) {
      ASSERT_EQ(bricks.at(v), above == 0 ? kOrderBoundary : above >= -4 ? -1 : kOrderInterior) << v.z;
    }
  });
}

TEST(LayerProfile, WithLayersInsideIsCheckedAndCoded) {
  LayerProfile profile = profile_with(0, {2, 1});
  const auto reason = [](const LayerProfile& wrong) { return check_profile(wrong).message(); };
  EXPECT_TRUE(check_profile(profile));
  EXPECT_EQ(profile.inside_depth_vox(), 3);
  const auto palette = make_palette({profile});
  ASSERT_TRUE(palette);
  EXPECT_EQ(*palette, (std::vector<float>{0, 10, 20, 30, 40, 50, 100}));
  const CodeTable codes = code_table(profile, *palette);
  EXPECT_EQ(codes[255], 4);  // order −1
  EXPECT_EQ(codes[254], 5);
  EXPECT_EQ(codes[kOrderBoundary], 4);
  EXPECT_EQ(codes[kOrderInterior], 6);

  LayerProfile wrong = profile;
  wrong.mu_inside_Pa_s_per_m = {30.0F, 50.0F};
  EXPECT_NE(reason(wrong).find("does not rise inwards at layer -1"), std::string::npos);
  wrong.mu_inside_Pa_s_per_m = {40.0F, 120.0F};
  EXPECT_NE(reason(wrong).find("above the skin's"), std::string::npos);
  wrong.mu_inside_Pa_s_per_m = {40.0F};
  EXPECT_NE(reason(wrong).find("one per layer"), std::string::npos);
  wrong = profile;
  wrong.inside_thickness_vox = {0, 1};
  EXPECT_NE(reason(wrong).find("at least 1"), std::string::npos);
  wrong.inside_thickness_vox = {200, 100};
  EXPECT_NE(reason(wrong).find("at most 254"), std::string::npos);
}

}  // namespace
}  // namespace phantom::voxel
