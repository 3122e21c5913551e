#pragma once
// Workspaces and skins for tests.

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "common/robot/skin/skin.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::robot::test_worlds {

inline const std::vector<float> kPalette{0.0F, 5.0F, 9.0F, 13.0F, 20.0F, 32.0F, 100.0F};

/// Box of 2.4 m around `centre` with 10 mm voxels. `code_at` gives the μ code of a voxel's centre. In a
/// sphere (centre, radius in m) for which `holds_something` is false every code is 0, and none is asked for.
template <class CodeAt>
workspace::Workspace make(
    const CodeAt& code_at, const Eigen::Vector3d& centre = {0, 0, 1},
    const workspace::VoxelSize& voxel_m = 0.01,
    const std::function<bool(const Eigen::Vector3d&, double)>& holds_something = nullptr) {
  workspace::GridSpec grid{centre - Eigen::Vector3d::Constant(1.2), voxel_m, {}};
  for (std::size_t axis = 0; axis < 3; ++axis)
    grid.size_vox[axis] = static_cast<std::int32_t>(2.4 / voxel_m[axis]);
  workspace::Workspace workspace(grid, kPalette);
  constexpr std::int32_t kEdge = 8;  // of the cubes that are asked for as a whole; a brick holds 4³ of them
  const auto fill = [&](const workspace::Index3& first) {
    const workspace::Index3 end{std::min(first.x + kEdge, grid.size_vox[0]),
                                std::min(first.y + kEdge, grid.size_vox[1]),
                                std::min(first.z + kEdge, grid.size_vox[2])};
    const Eigen::Vector3d low = grid.centre_of(first),
                          high = grid.centre_of({end.x - 1, end.y - 1, end.z - 1});
    if (holds_something && !holds_something(0.5 * (low + high), 0.5 * (high - low).norm())) return;
    std::optional<workspace::Workspace::MutableBrick> brick;
    for (std::int32_t z = first.z; z < end.z; ++z) {
      for (std::int32_t y = first.y; y < end.y; ++y) {
        for (std::int32_t x = first.x; x < end.x; ++x) {
          const std::uint8_t code = code_at(grid.centre_of({x, y, z}));
          if (code == 0) continue;
          if (!brick) brick = workspace.edit_brick(workspace::brick_of(first));
          const std::size_t at = workspace::brick_offset(workspace::Index3{x, y, z});
          brick->mu_code[at] = code;
          brick->order[at] = static_cast<std::int8_t>(code == 6 ? workspace::kOrderBoundary : 6 - code);
          brick->object[at] = 1;
        }
      }
    }
  };
  for (std::int32_t z = 0; z < grid.size_vox[2]; z += kEdge) {
    for (std::int32_t y = 0; y < grid.size_vox[1]; y += kEdge) {
      for (std::int32_t x = 0; x < grid.size_vox[0]; x += kEdge) fill({x, y, z});
    }
  }
  workspace.version = 1;
  return workspace;
}

/// Five layers of `thickness_m` around a solid whose surface is at distance 0.
inline std::uint8_t layer_code(double distance_m, double thickness_m = 0.04) {
  if (distance_m <= 0.0) return 6;
  const double layer = std::floor(distance_m / thickness_m);
  return static_cast<std::uint8_t>(layer >= 5.0 ? 0 : 5 - static_cast<int>(layer));
}

/// The balls of balls(): centre and radius in m.
inline const std::vector<Eigen::Vector4d> kBalls{
    {0.3, 0.2, 0.9, 0.12}, {-0.3, 0.1, 0.6, 0.1}, {0.0, -0.4, 1.1, 0.15}, {0.1, 0.1, 0.3, 0.2}};

/// The one whose surface is nearest.
inline const Eigen::Vector4d& nearest_ball(const Eigen::Vector3d& p) {
  return *std::min_element(kBalls.begin(), kBalls.end(),
                           [&p](const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
                             return (p - a.head<3>()).norm() - a[3] < (p - b.head<3>()).norm() - b[3];
                           });
}

/// Balls scattered through the suspended arm's reach, in layers of 0.2 m in all.
inline workspace::Workspace balls_in(const workspace::VoxelSize& voxel_m,
                                     const Eigen::Vector3d& shift = Eigen::Vector3d::Zero()) {
  const auto distance_m = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector4d& ball = nearest_ball(p - shift);
    return (p - shift - ball.head<3>()).norm() - ball[3];
  };
  return make([&](const Eigen::Vector3d& p) { return layer_code(distance_m(p)); },
              Eigen::Vector3d(0, 0, 1) + shift, voxel_m,
              [&](const Eigen::Vector3d& p, double radius_m) { return distance_m(p) - radius_m < 0.21; });
}
inline workspace::Workspace balls(const Eigen::Vector3d& shift = Eigen::Vector3d::Zero()) {
  return balls_in(0.01, shift);
}

/// Tubes of 4 cm along −z of every moving link of the suspended arm.
inline std::vector<LinkSkin> tubes() {
  std::vector<LinkSkin> skin;
  const std::vector<std::pair<const char*, double>> lengths{
      {"l1", 0.1}, {"l2", 0.2}, {"l3", 0.45}, {"l4", 0.3}, {"l5", 0.1}, {"l6", 0.1}, {"l7", 0.12}};
  for (const auto& [link, length] : lengths) {
    SkinSegment segment;
    segment.to_m = {0.0, 0.0, -length};
    segment.from_radius_m = 0.04;
    segment.to_radius_m = 0.03;
    segment.gain = 1.5;
    skin.push_back({link, {segment}});
  }
  return skin;
}

}  // namespace phantom::robot::test_worlds
