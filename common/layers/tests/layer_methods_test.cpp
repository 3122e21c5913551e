#include <gtest/gtest.h>

#include "common/geometry/implicit/primitives.hpp"
#include "common/layers/layers.hpp"
#include "common/layers/tests/method_twins.hpp"
#include "common/voxelise/tests/random_solid.hpp"

namespace phantom::layers {
namespace {

using geometry::Pose;

const workspace::GridSpec kOffGrid{{-0.1, 0.05, 0.0}, 0.01, {70, 64, 50}};
/// As large, of voxels that are no cubes.
const workspace::GridSpec kFlatGrid{
    {-0.1, 0.05, 0.0}, workspace::VoxelSize(Eigen::Vector3d(0.01, 0.013, 0.0173)), {70, 50, 30}};

workspace::LayerProfile profile_with(int guard, std::vector<int> inside = {}) {
  workspace::LayerProfile profile{{3, 2, 4}, {30.0F, 20.0F, 10.0F}, 100.0F, guard};
  profile.inside_thickness_vox = std::move(inside);
  for (std::size_t i = 0; i < profile.inside_thickness_vox.size(); ++i)
    profile.mu_inside_Pa_s_per_m.push_back(40.0F + 10.0F * static_cast<float>(i));
  return profile;
}

geometry::TriangleMesh tilted_cylinder() {
  return geometry::make_cylinder(0.12F, 0.25F, 24)
      .transformed({geometry::rotation_from_rpy(0.4, 0.8, 0.1), {0.2, 0.35, 0.27}});
}

void expect_surface_like_the_twin(const geometry::TriangleMesh& mesh, const workspace::LayerProfile& profile,
                                  const workspace::GridSpec& grid = kOffGrid) {
  const voxelise::SolidVoxels solid = *voxelise::voxelise(mesh, grid, voxelise_clip(grid, profile));
  const workspace::ObjectBricks bricks =
      surface_bricks(mesh, solid, profile, grid, workspace::VoxelBox::of(grid), {2, nullptr});
  std::size_t layered = 0;
  voxelise::twin::for_each(workspace::VoxelBox::of(grid), [&](workspace::Index3 v) {
    const std::int8_t expected = voxelise::twin::is_boundary(solid, v) ? workspace::kOrderBoundary
                                 : voxelise::twin::is_solid(solid, v)
                                     ? workspace::kOrderInterior
                                     : twin::order_at(profile, twin::surface_distance(mesh, grid, v));
    ASSERT_EQ(bricks.at(v), expected) << v.x << ' ' << v.y << ' ' << v.z;
    layered += expected > 0 && expected < workspace::kOrderGuard ? 1 : 0;
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

TEST(SurfaceLayers, EqualTheLiteralTwinInMetresWhereVoxelsAreNoCubes) {
  expect_surface_like_the_twin(tilted_cylinder(), profile_with(1), kFlatGrid);
  workspace::GridSpec upright = kFlatGrid;
  upright.voxel_size_m = workspace::VoxelSize(Eigen::Vector3d(0.016, 0.02, 0.01));
  upright.size_vox = {44, 32, 50};
  expect_surface_like_the_twin(tilted_cylinder(), profile_with(0), upright);
}

TEST(LayerSteps, AreCountedBeforeAnyWorkAndForEachSearch) {
  const auto mesh = tilted_cylinder();
  for (const auto method : {workspace::LayerMethod::kDistance, workspace::LayerMethod::kDilation,
                            workspace::LayerMethod::kSurface}) {
    auto profile = profile_with(1);
    profile.method = method;
    const voxelise::SolidVoxels solid = *voxelise::voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, profile));
    const workspace::VoxelBox part = workspace::VoxelBox::of(kOffGrid);
    const std::uint64_t least = layer_steps(solid, profile, part);
    EXPECT_GT(least, 1000U);
    core::WorkBudget enough;
    EXPECT_FALSE(lay_layers(mesh, solid, profile, kOffGrid, part, {2, {}, &enough}).keys().empty());
    EXPECT_GE(enough.spent(), least);
    if (method == workspace::LayerMethod::kSurface) {
      EXPECT_GT(enough.spent(), 50 * least) << "its searches are not counted";
    }
    for (const std::uint64_t most : {std::uint64_t{0}, least - 1, enough.spent() / 2}) {
      if (most >= enough.spent()) continue;
      core::WorkBudget little(most);
      EXPECT_TRUE(lay_layers(mesh, solid, profile, kOffGrid, part, {2, {}, &little}).keys().empty() ||
                  little.exceeded());
      EXPECT_TRUE(little.exceeded());
      if (method == workspace::LayerMethod::kSurface) {
        EXPECT_LT(little.spent(), most + 100 * core::WorkMeter::kEvery + least);
      }
    }
  }
}

TEST(LayerSteps, RiseWithEachLayerThatDilationGrows) {
  const auto mesh = tilted_cylinder();
  auto one = profile_with(0);
  one.method = workspace::LayerMethod::kDilation;
  const voxelise::SolidVoxels solid = *voxelise::voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, one));
  auto distance = one;
  distance.method = workspace::LayerMethod::kDistance;
  const workspace::VoxelBox part = workspace::VoxelBox::of(kOffGrid);
  const std::uint64_t passes = 1 + one.thickness_vox.size();
  std::uint64_t rows = element_rows(workspace::ShapingElement::kSphere, one.guard_vox);
  for (const int thickness : one.thickness_vox) rows += element_rows(one.element, thickness);
  const double once = static_cast<double>(layer_steps(solid, distance, part));
  const double of_rows = 8.0 * once / 64.0 * static_cast<double>(rows) / 40.0;
  EXPECT_NEAR(static_cast<double>(layer_steps(solid, one, part)),
              static_cast<double>(passes) * once + of_rows, 10.0 + static_cast<double>(rows));
}

TEST(LayerSteps, OfThickDilationAreThoseOfItsElementAndNotOnlyOfTheVoxels) {
  const auto mesh = tilted_cylinder();
  auto thick = profile_with(0);
  thick.method = workspace::LayerMethod::kDilation;
  thick.thickness_vox = {100, 100, 50};
  auto thin = thick;
  thin.thickness_vox = {10, 10, 230};
  thin.method = workspace::LayerMethod::kDistance;  // reaches as far
  const voxelise::SolidVoxels solid = *voxelise::voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, thick));
  const workspace::VoxelBox part = workspace::VoxelBox::of(kOffGrid);
  EXPECT_GT(layer_steps(solid, thick, part), 50 * layer_steps(solid, thin, part))
      << "measured: 128 s of a processor against 6";
}

TEST(SurfaceLayers, KnowTheExactDistanceOfASphere) {
  // An independent oracle: the sphere's own distance, with a mesh so fine that only voxels at a border may
  // differ.
  const Eigen::Vector3d centre(0.2013, 0.3527, 0.2541);
  const auto mesh = geometry::make_sphere(0.11, 6).transformed({Eigen::Matrix3d::Identity(), centre});
  const workspace::LayerProfile profile = profile_with(1);
  const voxelise::SolidVoxels solid = *voxelise::voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, profile));
  const workspace::ObjectBricks bricks =
      surface_bricks(mesh, solid, profile, kOffGrid, workspace::VoxelBox::of(kOffGrid));
  voxelise::twin::for_each(workspace::VoxelBox::of(kOffGrid), [&](workspace::Index3 v) {
    if (voxelise::twin::is_solid(solid, v)) return;
    const double d = ((kOffGrid.centre_of(v) - centre).norm() - 0.11) / kOffGrid.voxel_size_m.reference_m();
    const double slack = 0.005;
    EXPECT_TRUE(bricks.at(v) == twin::order_at(profile, d - slack) ||
                bricks.at(v) == twin::order_at(profile, d + slack))
        << d << ' ' << int{bricks.at(v)};
  });
}

TEST(SurfaceLayers, AreTheSameInWhateverPartsTheGridIsDone) {
  const auto mesh = tilted_cylinder();
  const workspace::LayerProfile profile = profile_with(1);
  const voxelise::SolidVoxels solid = *voxelise::voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, profile));
  const workspace::ObjectBricks whole =
      surface_bricks(mesh, solid, profile, kOffGrid, workspace::VoxelBox::of(kOffGrid));
  for (const workspace::BrickKey key : whole.keys()) {
    const workspace::VoxelBox part = workspace::box_of(key).intersection(workspace::VoxelBox::of(kOffGrid));
    const workspace::ObjectBricks one = surface_bricks(mesh, solid, profile, kOffGrid, part, {2, nullptr});
    voxelise::twin::for_each(part, [&](workspace::Index3 v) { ASSERT_EQ(one.at(v), whole.at(v)); });
  }
}

void expect_inside_like_the_twin(const workspace::GridSpec& grid) {
  const auto mesh = tilted_cylinder();
  for (const workspace::LayerMethod method :
       {workspace::LayerMethod::kDistance, workspace::LayerMethod::kSurface,
        workspace::LayerMethod::kDilation}) {
    workspace::LayerProfile profile = profile_with(1, {2, 1, 3});
    profile.method = method;
    ASSERT_TRUE(workspace::check_profile(profile)) << workspace::check_profile(profile).message();
    const voxelise::SolidVoxels solid = *voxelise::voxelise(mesh, grid, voxelise_clip(grid, profile));
    const workspace::ObjectBricks bricks =
        lay_layers(mesh, solid, profile, grid, workspace::VoxelBox::of(grid), {2, nullptr});
    workspace::LayerProfile without = profile;
    without.inside_thickness_vox.clear();
    without.mu_inside_Pa_s_per_m.clear();
    const workspace::ObjectBricks outer =
        lay_layers(mesh, solid, without, grid, workspace::VoxelBox::of(grid));
    std::size_t deep = 0, innermost = 0;
    voxelise::twin::for_each(workspace::VoxelBox::of(grid), [&](workspace::Index3 v) {
      if (outer.at(v) != workspace::kOrderInterior) {
        ASSERT_EQ(bricks.at(v), outer.at(v));
        return;
      }
      ASSERT_EQ(bricks.at(v), twin::inside_order(solid, profile, v, grid.voxel_size_m));
      deep += bricks.at(v) == workspace::kOrderInterior ? 1 : 0;
      innermost += bricks.at(v) == -3 ? 1 : 0;
    });
    EXPECT_GT(deep, 10U);
    EXPECT_GT(innermost, 100U);
  }
}

TEST(InsideLayers, EqualTheLiteralTwinForEveryMethod) { expect_inside_like_the_twin(kOffGrid); }

TEST(InsideLayers, EqualTheLiteralTwinInMetresWhereVoxelsAreNoCubes) {
  expect_inside_like_the_twin(kFlatGrid);
}

TEST(DilationLayers, CountVoxelsAlongEachAxisWhateverTheVoxels) {
  const auto mesh = geometry::make_cylinder(0.04F, 0.1F, 24)
                        .transformed({geometry::rotation_from_rpy(0.4, 0.8, 0.1), {0.2, 0.35, 0.27}});
  for (const auto element : {workspace::ShapingElement::kCube, workspace::ShapingElement::kSphereContained}) {
    workspace::LayerProfile profile = profile_with(1);
    profile.method = workspace::LayerMethod::kDilation;
    profile.element = element;
    const voxelise::SolidVoxels solid =
        *voxelise::voxelise(mesh, kFlatGrid, voxelise_clip(kFlatGrid, profile));
    const workspace::VoxelBox all = workspace::VoxelBox::of(kFlatGrid);
    const workspace::ObjectBricks bricks = lay_layers(mesh, solid, profile, kFlatGrid, all, {2, nullptr});
    const ObjectVoxels expected = twin::dilation(solid, profile);
    voxelise::twin::for_each(all, [&](workspace::Index3 v) { ASSERT_EQ(bricks.at(v), expected.at(v)); });
  }
}

TEST(InsideLayers, DoNotTakeTheGridsEndForTheBodys) {
  // A box that fills the grid's lower half and reaches far out of it: only its top is near.
  const auto mesh =
      geometry::make_box({4.0F, 4.0F, 2.0F}).transformed({Eigen::Matrix3d::Identity(), {0.2, 0.3, -0.75}});
  const workspace::LayerProfile profile = profile_with(0, {4});
  const voxelise::SolidVoxels solid = *voxelise::voxelise(mesh, kOffGrid, voxelise_clip(kOffGrid, profile));
  const workspace::ObjectBricks bricks =
      lay_layers(mesh, solid, profile, kOffGrid, workspace::VoxelBox::of(kOffGrid));
  voxelise::twin::for_each(workspace::VoxelBox::of(kOffGrid), [&](workspace::Index3 v) {
    const int above = v.z - 25;  // the top face lies on the border below voxel 25, which is boundary
    if (above <= 0) {
      ASSERT_EQ(bricks.at(v), above == 0    ? workspace::kOrderBoundary
                              : above >= -4 ? -1
                                            : workspace::kOrderInterior)
          << v.z;
    }
  });
}

TEST(LayerProfile, WithLayersInsideIsCheckedAndCoded) {
  workspace::LayerProfile profile = profile_with(0, {2, 1});
  const auto reason = [](const workspace::LayerProfile& wrong) {
    return workspace::check_profile(wrong).message();
  };
  EXPECT_TRUE(workspace::check_profile(profile));
  EXPECT_EQ(profile.inside_depth_vox(), 3);
  const auto palette = workspace::make_palette({profile});
  ASSERT_TRUE(palette);
  EXPECT_EQ(*palette, (std::vector<float>{0, 10, 20, 30, 40, 50, 100}));
  const workspace::CodeTable codes = workspace::code_table(profile, *palette);
  EXPECT_EQ(codes[255], 4);  // order −1
  EXPECT_EQ(codes[254], 5);
  EXPECT_EQ(codes[workspace::kOrderBoundary], 4);
  EXPECT_EQ(codes[workspace::kOrderInterior], 6);

  workspace::LayerProfile wrong = profile;
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
}  // namespace phantom::layers
