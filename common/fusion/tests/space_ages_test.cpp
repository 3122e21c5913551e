// How long ago each part of the space was seen: by a wall, by what it hides, and by an arm before it.
#include "common/fusion/space_ages.hpp"

#include <gtest/gtest.h>

#include "common/fusion/tests/scenes.hpp"

namespace phantom::fusion {
namespace {

using scenes::placed;
using workspace::Index3;

/// 0.8 m before a camera that looks along x from the grid's side; a wall at x = 0.4.
FusionParameters parameters() {
  FusionParameters parameters;
  parameters.grid = {{0.0, -0.32, -0.32}, 0.005, {160, 128, 128}};
  parameters.max_blocks = 4000;
  return parameters;
}
const std::vector<CameraScene::Object> kWall{placed(geometry::make_box({0.1, 3.0, 3.0}), {0.45, 0.0, 0.0})};

class SpaceAgesOfAWall : public testing::Test {
 protected:
  void see(int from, int to, std::span<const float> arm_depth_m = {}) {
    for (int frame = from; frame < to; ++frame)
      fusion_.integrate(camera_.frame(static_cast<std::uint64_t>(frame)), arm_depth_m);
  }
  /// Of the cubes along the middle of the view.
  double age_s(std::int32_t x, double now_s) const {
    const SpaceAges ages = space_ages(fusion_, now_s, 32768);
    EXPECT_EQ(ages.cube_vox, 32);
    EXPECT_EQ(ages.cubes.end(), (Index3{5, 4, 4}));
    return ages.ages_s.at(ages.cubes.index({x, 2, 2}));
  }
  scenes::Simulated camera_{kWall, scenes::depth_camera(2),
                            scenes::looking_at({-0.5, 0.0, 0.0}, {1.0, 0.0, 0.0})};
  Fusion fusion_ = Fusion::create(parameters()).value();
};

TEST_F(SpaceAgesOfAWall, NothingWasSeenBeforeTheFirstImage) {
  for (std::int32_t x = 0; x < 5; ++x) EXPECT_EQ(age_s(x, 10.0), SpaceAges::kNever);
}

TEST_F(SpaceAgesOfAWall, WhatIsBeforeItIsSeenAndWhatIsBehindItIsNot) {
  see(0, 61);  // the last one at 2 s
  // A block without content is looked at in one of eight images: 0.27 s.
  for (std::int32_t x = 0; x < 3; ++x) {
    EXPECT_GE(age_s(x, 2.0), 0.0);
    EXPECT_LE(age_s(x, 2.0), 0.35) << x;
    EXPECT_NEAR(age_s(x, 7.0) - age_s(x, 2.0), 5.0, 1e-9) << "an age grows while nothing is seen";
  }
  EXPECT_EQ(age_s(3, 2.0), SpaceAges::kNever);
  EXPECT_EQ(age_s(4, 2.0), SpaceAges::kNever);
}

TEST_F(SpaceAgesOfAWall, AnImageOfAnotherTimeMakesNothingOlder) {
  see(30, 61);
  const double before_s = age_s(1, 2.0);
  see(0, 20);  // of another camera, say, which is late
  EXPECT_LE(age_s(1, 2.0), before_s);
}

TEST_F(SpaceAgesOfAWall, WhatTheArmHidesGrowsOld) {
  see(0, 61);
  const std::vector<float> arm_depth_m(camera_.header().camera.pixels(), 0.3F);  // all over the image
  see(61, 151, arm_depth_m);
  EXPECT_GT(age_s(1, 5.0), 2.9);
  EXPECT_GT(age_s(2, 5.0), 2.9);
  see(151, 181);
  EXPECT_LE(age_s(1, 6.0), 0.35);
  EXPECT_LE(age_s(2, 6.0), 0.35);
}

TEST_F(SpaceAgesOfAWall, WhatIsSeenBetweenPartsOfTheArmIsSeen) {
  const PinholeCamera& camera = camera_.header().camera;
  const auto behind_stripes = [&](int stripe_px) {  // of an arm before the grid, 24 pixels apart
    std::vector<float> arm_depth_m;
    for (std::size_t i = 0; i < camera.pixels(); ++i)
      arm_depth_m.push_back(static_cast<int>(i) % camera.width_px % 24 < stripe_px ? 0.45F : 0.0F);
    fusion_ = Fusion::create(parameters()).value();
    see(0, 61, arm_depth_m);
    return age_s(1, 2.0);
  };
  EXPECT_LE(behind_stripes(6), 0.6) << "three of five pixels: the mask is two wider at each side";
  EXPECT_EQ(behind_stripes(20), SpaceAges::kNever) << "none";
}

TEST_F(SpaceAgesOfAWall, BlocksThatAreLeftOutDoNotCount) {
  see(0, 61);
  const workspace::VoxelBox blocks = blocks_of(parameters().grid);
  std::vector<std::uint8_t> left_out(blocks.voxel_count());
  const auto age_s = [&](Index3 cube) {
    const SpaceAges ages = space_ages(fusion_, 2.0, 32768, left_out);
    return ages.ages_s.at(ages.cubes.index(cube));
  };
  const Index3 seen{1, 2, 2}, behind{3, 2, 2};
  for (const Index3 cube : {seen, behind}) {
    EXPECT_EQ(age_s(cube) == SpaceAges::kNever, cube == behind);
    const workspace::VoxelBox of_cube{4 * cube, {4, 4, 4}};
    of_cube.for_each([&](Index3 block) {
      const bool last = block == of_cube.end() - Index3{1, 1, 1};
      left_out[blocks.index(block)] = last ? 0 : 1;
    });
    EXPECT_EQ(age_s(cube) == SpaceAges::kNever, cube == behind) << "by the one block that counts";
    left_out[blocks.index(of_cube.end() - Index3{1, 1, 1})] = 1;
    EXPECT_EQ(age_s(cube), 0.0) << "none counts";
  }
}

TEST_F(SpaceAgesOfAWall, WhatIsForgottenWasNeverSeen) {
  see(0, 61);
  fusion_.forget(workspace::VoxelBox::of(parameters().grid));
  for (std::int32_t x = 0; x < 5; ++x) EXPECT_EQ(age_s(x, 2.0), SpaceAges::kNever);
}

TEST_F(SpaceAgesOfAWall, ThereAreAsFewCubesAsAskedFor) {
  see(0, 31);
  const SpaceAges coarse = space_ages(fusion_, 1.0, 20);
  EXPECT_EQ(coarse.cube_vox, 64);
  EXPECT_EQ(coarse.cubes.end(), (Index3{3, 2, 2}));
  EXPECT_EQ(coarse.ages_s.size(), 12U);
  const SpaceAges one = space_ages(fusion_, 1.0, 1);
  EXPECT_EQ(one.ages_s.size(), 1U);
  EXPECT_LE(one.ages_s.front(), 0.35) << "half of it was seen";
}

}  // namespace
}  // namespace phantom::fusion
