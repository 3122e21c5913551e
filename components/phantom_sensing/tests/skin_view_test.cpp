// The skin by patches, as viewers paint it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>

#include "common/robot/sensing/skin_patches.hpp"
#include "components/phantom_sensing/tests/rig.hpp"

namespace phantom::phantom_sensing {
namespace {

using rig::hanging;

class Patches : public testing::Test {
 protected:
  PhantomModel model_ = rig::suspended_model();
  robot::SkinPatches patches_{model_.arm, model_.skin};
};

TEST_F(Patches, CoverTheSkinAndStayWithinTheirBound) {
  EXPECT_GT(patches_.count(), 10U);
  EXPECT_LE(patches_.count(), robot::SkinPatches::kMax);
  EXPECT_GE(patches_.edge_m(), 0.02);
}

TEST_F(Patches, FarFromEverythingNothingIsFelt) {
  EXPECT_TRUE(patches_.sense(hanging(-0.4, 0.0).position, rig::wall()).empty());
}

// The worst patch is as bad as the worst sensor that the tick finds.
TEST_F(Patches, AgreeWithTheTickAboutTheWorst) {
  PhantomSensing sensing(model_, {});
  StepOutputs out;
  for (const double x : {0.15, 0.2, 0.25, 0.3}) {
    const StepInputs inputs = hanging(x, 0.1);
    sensing.step(inputs, out);
    float worst = 0.0F;
    for (const robot::SkinPatches::Patch& patch : patches_.sense(inputs.position, rig::wall()))
      worst = std::max(worst, patch.mu);
    EXPECT_EQ(static_cast<double>(worst), out.worst.mu) << x;
  }
}

// Literal twin: every sensor by itself, gathered by the cube of its link's frame that it lies in.
TEST_F(Patches, HoldTheGreatestMuOfTheSensorsInTheirCube) {
  const StepInputs inputs = hanging(0.27, 0.0);
  robot::LinkPoses X_WL;
  model_.arm.link_poses(inputs.position, X_WL);
  const auto cube_of = [&](std::size_t link, const Eigen::Vector3d& p) {
    const Eigen::Vector3d cube = (p / patches_.edge_m()).array().floor();
    return std::array<int, 4>{static_cast<int>(link), static_cast<int>(cube.x()), static_cast<int>(cube.y()),
                              static_cast<int>(cube.z())};
  };
  std::map<std::array<int, 4>, float> expected;
  for (std::size_t sensor = 0; sensor < model_.skin.size(); ++sensor) {
    const std::size_t link = model_.skin.link_of(sensor);
    const Eigen::Vector3d p_L_m = model_.skin.position(sensor);
    const float mu = rig::wall().mu(rig::wall().grid().index_of(X_WL[link] * p_L_m));
    if (mu > 0.0F) expected[cube_of(link, p_L_m)] = std::max(expected[cube_of(link, p_L_m)], mu);
  }
  const auto& felt = patches_.sense(inputs.position, rig::wall());
  ASSERT_GT(expected.size(), 0U);
  EXPECT_EQ(felt.size(), expected.size());
  for (const robot::SkinPatches::Patch& patch : felt)
    EXPECT_EQ(patch.mu, expected[cube_of(patch.link, patch.middle_m)]) << patch.middle_m.transpose();
}

TEST_F(Patches, DoNotFeelWhatMayBeTouched) {
  EXPECT_FALSE(patches_.sense(hanging(0.27, 0.0).position, rig::wall()).empty());
  EXPECT_TRUE(patches_
                  .sense(hanging(0.27, 0.0).position, rig::wall(),
                         [](std::size_t, std::uint16_t object) { return object == 1; })
                  .empty());
}

TEST(SkinPatchesOfAFineSkin, AreCoarserRatherThanMore) {
  PhantomModel model = rig::suspended_model();
  // The same sensors, spread out a hundredfold: far more cubes of 20 mm than there may be patches.
  for (auto* axis : {&model.skin.x_m, &model.skin.y_m, &model.skin.z_m}) {
    for (double& value : *axis) value *= 100.0;
  }
  const robot::SkinPatches patches(model.arm, model.skin);
  EXPECT_GT(patches.edge_m(), 0.02);
  EXPECT_LE(patches.count(), robot::SkinPatches::kMax);
  EXPECT_GT(patches.count(), robot::SkinPatches::kMax / 8);
}

}  // namespace
}  // namespace phantom::phantom_sensing
