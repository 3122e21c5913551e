#include "common/percept/allowed_contact.hpp"

#include <gtest/gtest.h>

#include "common/percept/principal_gradient.hpp"

namespace phantom::percept {
namespace {

TEST(AllowedContact, MutesOneObjectOnOneLinkOrOnTheWholeArm) {
  AllowedContact allowed;
  EXPECT_FALSE(allowed.concerns(3));
  ASSERT_TRUE(allowed.add(7, 3));
  EXPECT_TRUE(allowed.concerns(3));
  EXPECT_FALSE(allowed.concerns(2));
  EXPECT_TRUE(allowed.mutes(3, 7));
  EXPECT_FALSE(allowed.mutes(3, 8));
  EXPECT_FALSE(allowed.mutes(2, 7));
  ASSERT_TRUE(allowed.add(8, AllowedContact::kWholeArm));
  EXPECT_TRUE(allowed.concerns(2));
  EXPECT_TRUE(allowed.mutes(2, 8));
  EXPECT_FALSE(allowed.mutes(2, 7));
}

TEST(AllowedContact, IsBounded) {
  AllowedContact allowed;
  for (std::size_t i = 0; i < AllowedContact::kMax; ++i)
    EXPECT_TRUE(allowed.add(static_cast<std::uint16_t>(i + 1), 0));
  EXPECT_FALSE(allowed.add(100, 0));
  EXPECT_EQ(allowed.size(), AllowedContact::kMax);
  EXPECT_FALSE(allowed.mutes(1, 100));
}

/// Fluid of object 1 for x < 16 and of object 2 for x ≥ 16, thicker the farther from there.
workspace::Workspace two_objects() {
  workspace::Workspace workspace({Eigen::Vector3d::Zero(), 0.01, {32, 32, 32}}, {0.0F, 9.0F, 13.0F, 32.0F});
  const auto brick = workspace.edit_brick({0, 0, 0});
  for (std::uint32_t z = 0; z < 32; ++z) {
    for (std::uint32_t y = 0; y < 32; ++y) {
      for (std::uint32_t x = 0; x < 32; ++x) {
        const std::size_t at = workspace::brick_offset(x, y, z);
        brick.mu_code[at] = x < 14 || x >= 18 ? std::uint8_t{3} : std::uint8_t{1};
        brick.object[at] = x < 16 ? std::uint16_t{1} : std::uint16_t{2};
      }
    }
  }
  return workspace;
}

TEST(AllowedContact, TheGradientSeesAMutedObjectAsFreeSpace) {
  const workspace::Workspace workspace = two_objects();
  const ClusterZone zone(4, ZoneShape::kCube);
  EXPECT_LT(zone.gradient(workspace, {15, 16, 16}).pgv_W_m.x(), 0.0) << "object 1 is the nearer one";
  AllowedContact allowed;
  allowed.add(1, 5);
  const PrincipalGradient muted = zone.gradient(workspace, {15, 16, 16}, 5, allowed);
  EXPECT_GT(muted.pgv_W_m.x(), 0.0) << "only object 2 is left";
  EXPECT_EQ(muted.least, 0.0);
  EXPECT_LT(zone.gradient(workspace, {15, 16, 16}, 4, allowed).pgv_W_m.x(), 0.0)
      << "another link still feels both";
}

}  // namespace
}  // namespace phantom::percept
