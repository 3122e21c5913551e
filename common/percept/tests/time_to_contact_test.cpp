#include "common/percept/time_to_contact.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/percept/principal_gradient.hpp"

namespace phantom::percept {
namespace {

constexpr double kVoxel_m = 0.005, kLayer_m = 0.02;
constexpr int kEdge_vox = 96;
const Eigen::Vector3d kMiddle_m = Eigen::Vector3d::Constant(0.5 * kEdge_vox * kVoxel_m);

/// Five layers of four voxels around a body, given by the distance to it.
template <class Distance>
workspace::Workspace around(const Distance& distance_m) {
  workspace::GridSpec grid{Eigen::Vector3d::Zero(), kVoxel_m, {kEdge_vox, kEdge_vox, kEdge_vox}};
  workspace::Workspace voxels(grid, {0.0F, 5.0F, 9.0F, 13.0F, 20.0F, 32.0F, 100.0F});
  for (std::int32_t z = 0; z < kEdge_vox; ++z)
    for (std::int32_t y = 0; y < kEdge_vox; ++y)
      for (std::int32_t x = 0; x < kEdge_vox; ++x) {
        const double d_m = distance_m(grid.centre_of({x, y, z}));
        const int layer = d_m <= 0.0 ? 0 : 1 + static_cast<int>(d_m / kLayer_m);
        if (layer > 5) continue;
        const auto brick = voxels.edit_brick(workspace::brick_of({x, y, z}));
        const std::size_t at = workspace::brick_offset(workspace::Index3{x, y, z});
        brick.mu_code[at] = static_cast<std::uint8_t>(6 - layer);
        brick.order[at] = static_cast<std::int8_t>(layer == 0 ? workspace::kOrderBoundary : layer);
        brick.object[at] = 1;
      }
  return voxels;
}

const workspace::Workspace& wall() {
  static const workspace::Workspace voxels =
      around([](const Eigen::Vector3d& p_m) { return kMiddle_m.x() - p_m.x(); });
  return voxels;
}

TEST(TimeToContact, IsTheGapOverTheClosingSpeed) {
  const double x_m = kMiddle_m.x() - 0.06;
  const TimeToContact contact =
      time_to_contact(wall(), {x_m, 0.2, 0.2}, {0.01, 0.0, 0.0}, {0.3, 0.4, 0.0}, 0.002);
  EXPECT_NEAR(contact.gap_m, 0.06, kVoxel_m);
  EXPECT_DOUBLE_EQ(contact.time_s, contact.gap_m / 0.3) << "what goes along the wall does not count";
  EXPECT_TRUE(contact.is_nearing());
  EXPECT_GT(contact.error_s, 0.0);
}

TEST(TimeToContact, WhatDoesNotNearHasNone) {
  const Eigen::Vector3d at_m(kMiddle_m.x() - 0.03, 0.2, 0.2), pgv_m(0.01, 0.0, 0.0);
  for (const Eigen::Vector3d& v_m_s : {Eigen::Vector3d(-0.3, 0.0, 0.0), Eigen::Vector3d(0.0, 0.3, 0.0),
                                       Eigen::Vector3d(0.001, 0.3, 0.0), Eigen::Vector3d(0.0, 0.0, 0.0)}) {
    const TimeToContact contact = time_to_contact(wall(), at_m, pgv_m, v_m_s, 0.002);
    EXPECT_FALSE(contact.is_nearing());
    EXPECT_EQ(contact.error_s, -1.0);
    EXPECT_NEAR(contact.gap_m, 0.03, kVoxel_m) << "how far it is is known";
  }
  EXPECT_EQ(time_to_contact(wall(), at_m, Eigen::Vector3d::Zero(), {0.3, 0.0, 0.0}, 0.002), TimeToContact{})
      << "without a direction nothing is known";
}

TEST(TimeToContact, InTheBodyItIsNow) {
  const TimeToContact contact =
      time_to_contact(wall(), {kMiddle_m.x() + 0.01, 0.2, 0.2}, {0.01, 0.0, 0.0}, {0.3, 0.0, 0.0}, 0.002);
  EXPECT_EQ(contact.gap_m, 0.0);
  EXPECT_EQ(contact.time_s, 0.0);
}

TEST(TimeToContact, WhereTheDirectionMissesTheSurfaceItIsTheEarliestThatTheLayersAllow) {
  // Along a direction that leaves the fluid without meeting the wall.
  const double x_m = kMiddle_m.x() - 0.07;
  const TimeToContact contact =
      time_to_contact(wall(), {x_m, 0.2, 0.2}, {-0.01, 0.0, 0.0}, {-0.3, 0.0, 0.0}, 0.002);
  EXPECT_EQ(contact.gap_m, -1.0);
  EXPECT_EQ(contact.error_s, -1.0);
  EXPECT_GE(contact.time_s, 0.0);
  EXPECT_LE(contact.time_s, 0.03 / 0.3);
}

/// Checks what is stated of the error: at random places in the fluid that near, with the gradient as sensed.
template <class Distance>
void expect_within_the_error(const workspace::Workspace& voxels, const Distance& distance_m, unsigned seed) {
  const ClusterZone zone(3, ZoneShape::kSphere);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place_m(0.02, kEdge_vox * kVoxel_m - 0.02), speed_m_s(-0.4, 0.4);
  int tried = 0, within = 0;
  while (tried < 400) {
    const Eigen::Vector3d p_m(place_m(random), place_m(random), place_m(random));
    const double d_m = distance_m(p_m);
    if (!(d_m > 0.005) || d_m > 0.095) continue;
    constexpr double kStep_m = 1e-5;
    Eigen::Vector3d towards;  // the nearest place of the surface
    for (Eigen::Index k = 0; k < 3; ++k)
      towards[k] = (distance_m(p_m) - distance_m(p_m + kStep_m * Eigen::Vector3d::Unit(k))) / kStep_m;
    const Eigen::Vector3d v_m_s(speed_m_s(random), speed_m_s(random), speed_m_s(random));
    const Eigen::Vector3d pgv_m = zone.gradient(voxels, voxels.grid().index_of(p_m)).pgv_W_m;
    const double closing_m_s = towards.dot(v_m_s);
    if (closing_m_s < 0.5 * v_m_s.norm() || pgv_m.dot(v_m_s) < 0.5 * pgv_m.norm() * v_m_s.norm()) continue;
    const TimeToContact contact = time_to_contact(voxels, p_m, pgv_m, v_m_s, 0.002);
    ++tried;
    within +=
        contact.error_s >= 0.0 && std::abs(contact.time_s - d_m / closing_m_s) <= contact.error_s ? 1 : 0;
  }
  EXPECT_GE(within, 380) << "95 of 100";
}

TEST(TimeToContact, SR20_ItsErrorBeforeAWallIsAsStated) {
  expect_within_the_error(
      wall(), [](const Eigen::Vector3d& p_m) { return kMiddle_m.x() - p_m.x(); }, 1);
}

TEST(TimeToContact, SR20_ItsErrorAroundABallIsAsStated) {
  const auto distance_m = [](const Eigen::Vector3d& p_m) { return (p_m - kMiddle_m).norm() - 0.1; };
  expect_within_the_error(around(distance_m), distance_m, 2);
}

}  // namespace
}  // namespace phantom::percept
