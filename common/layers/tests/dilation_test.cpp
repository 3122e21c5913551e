#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "common/geometry/implicit/primitives.hpp"
#include "common/layers/layers.hpp"
#include "common/layers/tests/method_twins.hpp"
#include "common/voxelise/tests/random_solid.hpp"

namespace phantom::layers {
namespace {

workspace::LayerProfile layers(workspace::ShapingElement element, std::vector<int> thickness, int guard = 0) {
  workspace::LayerProfile profile;
  profile.thickness_vox = std::move(thickness);
  for (std::size_t i = 0; i < profile.thickness_vox.size(); ++i)
    profile.mu_Pa_s_per_m.push_back(50.0F - static_cast<float>(i));
  profile.guard_vox = guard;
  profile.method = workspace::LayerMethod::kDilation;
  profile.element = element;
  return profile;
}

constexpr workspace::ShapingElement kElements[] = {workspace::ShapingElement::kCube,
                                                   workspace::ShapingElement::kSphere,
                                                   workspace::ShapingElement::kSphereContained};
const workspace::VoxelBox kDilated{{0, 0, 0}, {150, 100, 100}};

void expect_like_the_dilated_twin(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                                  const workspace::VoxelBox& part = kDilated) {
  ASSERT_TRUE(workspace::check_profile(profile)) << workspace::check_profile(profile).message();
  const ObjectVoxels expected = twin::dilation(solid, profile);
  for (const int threads : {1, 3}) {
    const workspace::ObjectBricks bricks = dilation_bricks(solid, profile, part, {threads, nullptr});
    std::size_t wrong = 0;
    voxelise::twin::for_each(part,
                             [&](workspace::Index3 v) { wrong += bricks.at(v) != expected.at(v) ? 1 : 0; });
    EXPECT_EQ(wrong, 0U) << "m " << profile.thickness_vox.front() << ", guard " << profile.guard_vox;
  }
}

TEST(Dilation, EqualsTheLiteralTwinInEveryVoxelForAllElements) {
  unsigned seed = 1;
  for (const workspace::ShapingElement element : kElements) {
    for (int m = 1; m <= 4; ++m) {
      for (const int guard : {0, 2}) {
        expect_like_the_dilated_twin(voxelise::scattered_solid(seed++, {9, 7, 8}, 60),
                                     layers(element, {m, m, m}, guard));
      }
      expect_like_the_dilated_twin(voxelise::scattered_solid(seed++, {60, 5, 4}, 90),
                                   layers(element, {m, m}, 0));
    }
    expect_like_the_dilated_twin(voxelise::scattered_solid(seed++, {12, 9, 9}, 150),
                                 layers(element, {1, 4, 2, 3}, 1));
    expect_like_the_dilated_twin(voxelise::scattered_solid(seed++, {3, 3, 3}, 20),
                                 layers(element, {9, 2}, 0));
  }
}

TEST(Dilation, EqualsTheLiteralTwinOnBodies) {
  const workspace::GridSpec grid{Eigen::Vector3d::Zero(), 0.01, {150, 100, 100}};
  const auto X = geometry::Pose{geometry::rotation_from_rpy(0.3, 0.5, 0.7), {0.7, 0.5, 0.5}};
  const auto mesh = geometry::make_cylinder(0.13F, 0.3F, 40).transformed(X);
  for (const workspace::ShapingElement element : kElements) {
    const workspace::LayerProfile profile = layers(element, {2, 3, 1});
    expect_like_the_dilated_twin(*voxelise::voxelise(mesh, grid, voxelise_clip(grid, profile)), profile);
  }
}

TEST(Dilation, EqualsTheLiteralTwinAcrossGroupsOfWords) {
  const workspace::VoxelBox wide{{0, 0, 0}, {1700, 20, 20}};
  for (const workspace::ShapingElement element : kElements) {
    for (const std::int32_t x : {-3, 0, 37})
      expect_like_the_dilated_twin(voxelise::scattered_solid(5, {1690, 3, 4}, 500, {x, 9, 8}),
                                   layers(element, {4, 1, 3}), wide);
    // Alone beside where a group ends: 512 voxels from 64 before the solid's box on.
    for (const std::int32_t x : {444, 447, 448, 451}) {
      voxelise::SolidVoxels dot = voxelise::scattered_solid(1, {600, 1, 1}, 1, {0, 9, 8});
      dot.boundary = dot.inside = workspace::BitVolume(dot.box.size);
      dot.boundary.set(x, 0, 0);
      expect_like_the_dilated_twin(dot, layers(element, {4, 1, 3}), wide);
    }
  }
}

TEST(Dilation, ReachesTheNextGroupFromAnyWordOfOne) {
  // A long element from each side of where the first group ends, from its last word but one and its last.
  const workspace::VoxelBox wide{{0, 0, 0}, {700, 3, 3}};
  for (const std::int32_t x : {300, 350, 400, 440, 460, 510}) {
    voxelise::SolidVoxels dot = voxelise::scattered_solid(1, {600, 1, 1}, 1, {0, 1, 1});
    dot.boundary = dot.inside = workspace::BitVolume(dot.box.size);
    dot.boundary.set(x, 0, 0);
    expect_like_the_dilated_twin(dot, layers(workspace::ShapingElement::kCube, {90}), wide);
  }
}

TEST(Dilation, IsTheSameWithEveryInstructionSet) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    unsigned seed = 1;
    for (const workspace::ShapingElement element : kElements)
      expect_like_the_dilated_twin(voxelise::scattered_solid(seed++, {40, 5, 6}, 50),
                                   layers(element, {3, 2}, 1));
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(Dilation, WidensByMoreThanAWord) {
  const voxelise::SolidVoxels dot = voxelise::scattered_solid(3, {1, 1, 1}, 1, {75, 50, 50});
  voxelise::SolidVoxels boundary = dot;
  boundary.boundary.set(0, 0, 0);
  boundary.inside = workspace::BitVolume(boundary.box.size);
  const workspace::LayerProfile profile = layers(workspace::ShapingElement::kSphere, {70});
  const workspace::ObjectBricks bricks = dilation_bricks(boundary, profile, kDilated);
  voxelise::twin::for_each(kDilated, [&](workspace::Index3 v) {
    const int square = (v.x - 75) * (v.x - 75) + (v.y - 50) * (v.y - 50) + (v.z - 50) * (v.z - 50);
    ASSERT_EQ(bricks.at(v), square == 0 ? workspace::kOrderBoundary : square <= 70 * 70 ? 1 : 0);
  });
}

TEST(Dilation, KeepsAWallWithinABodyAsBoundary) {
  const voxelise::SolidVoxels block = voxelise::walled_block();
  const workspace::ObjectBricks bricks =
      dilation_bricks(block, layers(workspace::ShapingElement::kSphere, {2}), kDilated);
  voxelise::twin::for_each(block.box, [&](workspace::Index3 v) {
    ASSERT_EQ(bricks.at(v),
              voxelise::twin::is_boundary(block, v) ? workspace::kOrderBoundary : workspace::kOrderInterior)
        << v.x << ' ' << v.y << ' ' << v.z;
  });
}

TEST(Dilation, DoesNotDependOnPartsNorOnWhatLiesBeyondTheGrid) {
  const workspace::VoxelBox small{{0, 0, 0}, {61, 50, 45}};  // ends inside of bricks; the solid hangs over
  const voxelise::SolidVoxels solid = voxelise::scattered_solid(77, {70, 30, 40}, 200, {-8, 28, 20});
  for (const workspace::ShapingElement element : kElements) {
    for (const workspace::LayerProfile& profile :
         {layers(element, {3, 2, 4}, 1), layers(element, {1, 8}), layers(element, {8, 1}),
          layers(element, {5}), layers(element, {1}, 6)}) {
      expect_like_the_dilated_twin(solid, profile, small);
      const workspace::ObjectBricks whole = dilation_bricks(solid, profile, kDilated);
      for (const workspace::BrickKey key : whole.keys()) {
        const workspace::ObjectBricks one = dilation_bricks(solid, profile, workspace::box_of(key));
        ASSERT_EQ(one.keys(), std::vector{key});
        voxelise::twin::for_each(workspace::box_of(key).intersection(kDilated),
                                 [&](workspace::Index3 v) { ASSERT_EQ(one.at(v), whole.at(v)); });
      }
    }
  }
}

TEST(Dilation, SharesBricksThatAreInteriorThroughout) {
  const workspace::GridSpec grid{Eigen::Vector3d::Zero(), 0.01, {160, 160, 160}};
  const auto mesh =
      geometry::make_box({1.2F, 1.2F, 1.2F}).transformed({Eigen::Matrix3d::Identity(), {0.8, 0.8, 0.8}});
  const workspace::LayerProfile profile = layers(workspace::ShapingElement::kSphere, {2, 2});
  const voxelise::SolidVoxels solid = *voxelise::voxelise(mesh, grid, voxelise_clip(grid, profile));
  const workspace::ObjectBricks bricks = dilation_bricks(solid, profile, workspace::VoxelBox::of(grid));
  EXPECT_EQ(bricks.keys().size(), 125U);
  EXPECT_LT(bricks.bytes(), 100 * workspace::kBrickVoxels);  // 27 bricks in the middle take nothing
  EXPECT_EQ(bricks.at({80, 80, 80}), workspace::kOrderInterior);
}

TEST(Dilation, EndsWhenToldTo) {
  int asked = 0;
  const auto bricks = dilation_bricks(voxelise::scattered_solid(1, {9, 9, 9}, 9),
                                      layers(workspace::ShapingElement::kCube, {1, 1, 1}), kDilated,
                                      {1, [&](double) { return ++asked < 2; }});
  EXPECT_TRUE(bricks.keys().empty());
  EXPECT_EQ(asked, 2);
}

TEST(ShapingElements, HaveTheSizesOfTable41) {
  const auto size = [](workspace::ShapingElement element, int m) {
    int cells = 0;
    std::uint64_t rows = 0;
    voxelise::twin::for_each({{-m - 1, -m - 1, -m - 1}, {2 * m + 3, 2 * m + 3, 2 * m + 3}},
                             [&](workspace::Index3 v) {
                               cells += in_element(element, m, v.x, v.y, v.z) ? 1 : 0;
                               rows += v.x == 0 && in_element(element, m, 0, v.y, v.z) ? 1 : 0;
                             });
    EXPECT_EQ(element_rows(element, m), rows) << m;
    return cells;
  };
  EXPECT_EQ(size(workspace::ShapingElement::kCube, 1), 27);
  EXPECT_EQ(size(workspace::ShapingElement::kCube, 2), 125);
  EXPECT_EQ(size(workspace::ShapingElement::kCube, 3), 343);
  EXPECT_EQ(size(workspace::ShapingElement::kSphere, 1), 7);
  EXPECT_EQ(size(workspace::ShapingElement::kSphereContained, 1), 19);
  EXPECT_EQ(size(workspace::ShapingElement::kSphereContained, 2), 81);
  EXPECT_EQ(size(workspace::ShapingElement::kSphereContained, 3), 179);
}

}  // namespace
}  // namespace phantom::layers
