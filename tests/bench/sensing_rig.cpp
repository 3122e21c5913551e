#include "tests/bench/sensing_rig.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

namespace phantom::bench {
namespace {

constexpr double kVoxel_m = 0.005, kReach_m = 2.1 * 0.45;
constexpr double kRadius_m = 0.05;

template <class T>
T value_of(core::Expected<T> expected) {
  if (!expected) throw std::runtime_error(expected.status().message());
  return std::move(expected).value();
}

workspace::Workspace make_free(int edge_vox) {
  const double half = 0.5 * edge_vox * kVoxel_m;
  const workspace::GridSpec grid{Eigen::Vector3d::Constant(-half), kVoxel_m, {edge_vox, edge_vox, edge_vox}};
  workspace::Workspace workspace(grid, {0.0F, 9.0F, 10.0F, 11.0F, 13.0F, 20.0F, 32.0F, 100.0F});
  workspace.version = 1;
  return workspace;
}

workspace::Workspace make_mixed(int edge_vox) {
  workspace::Workspace workspace = make_free(edge_vox);
  std::mt19937 random(1);
  const auto [nx, ny, nz] = workspace.size_bricks();
  for (workspace::BrickKey key{0, 0, 0}; key.z < nz; ++key.z) {
    for (key.y = 0; key.y < ny; ++key.y) {
      for (key.x = 0; key.x < nx; ++key.x) {
        const auto orders = std::make_shared<std::int8_t[]>(workspace::kBrickVoxels, std::int8_t{1});
        std::uint8_t* const mu_code = workspace.make_brick(key, {orders, nullptr, 1});
        for (std::size_t i = 0; i < workspace::kBrickVoxels; ++i)
          mu_code[i] = static_cast<std::uint8_t>(1 + random() % 7);
      }
    }
  }
  return workspace;
}

/// Code of the fluid of the ball that is nearest to a place.
std::uint8_t code_of_ball(const Eigen::Vector3d& p_m) {
  constexpr double kSpacing_m = 0.4, kBall_m = 0.08, kLayer_m = 0.02;
  const Eigen::Vector3d ball_m = kSpacing_m * (p_m / kSpacing_m).array().round();
  const double distance_m = (p_m - ball_m).norm() - kBall_m;
  return static_cast<std::uint8_t>(
      distance_m <= 0.0 ? 7 : std::max(6 - static_cast<int>(distance_m / kLayer_m), 0));
}

/// Balls of one object, in bricks as a receiver of workspace_brick assembles them.
workspace::Workspace make_balls(int edge_vox) {
  workspace::Workspace workspace = make_free(edge_vox);
  std::vector<std::uint8_t> codes(workspace::kBrickVoxels);
  const auto [nx, ny, nz] = workspace.size_bricks();
  for (std::int32_t i = 0; i < nx * ny * nz; ++i) {
    const workspace::BrickKey key{i % nx, i / nx % ny, i / nx / ny};
    const workspace::Index3 corner = workspace::corner_of(key);
    for (std::uint32_t z = 0; z < 32; ++z)
      for (std::uint32_t y = 0; y < 32; ++y)
        for (std::uint32_t x = 0; x < 32; ++x)
          codes[workspace::brick_offset(x, y, z)] = code_of_ball(workspace.grid().centre_of(
              corner + workspace::Index3{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                                         static_cast<std::int32_t>(z)}));
    if (std::ranges::all_of(codes, [](std::uint8_t code) { return code == 0; })) continue;
    const auto orders = std::make_shared_for_overwrite<std::int8_t[]>(workspace::kBrickVoxels);
    std::ranges::transform(codes, orders.get(), [](std::uint8_t code) {
      return code == 0   ? workspace::kOrderFree
             : code == 7 ? workspace::kOrderBoundary
                         : static_cast<std::int8_t>(7 - code);
    });
    std::ranges::copy(codes, workspace.make_brick(key, {orders, nullptr, 1}));
  }
  return workspace;
}

const workspace::Workspace& made_once(std::map<int, workspace::Workspace>& made, int edge_vox,
                                      workspace::Workspace (*make)(int)) {
  const auto found = made.find(edge_vox);
  return found != made.end() ? found->second : made.emplace(edge_vox, make(edge_vox)).first->second;
}

}  // namespace

const workspace::Workspace& balls(int edge_vox) {
  static std::map<int, workspace::Workspace> made;
  return made_once(made, edge_vox, make_balls);
}

const workspace::Workspace& free_space(int edge_vox) {
  static std::map<int, workspace::Workspace> made;
  return made_once(made, edge_vox, make_free);
}

const workspace::Workspace& mixed_fluid(int edge_vox) {
  static std::map<int, workspace::Workspace> made;
  return made_once(made, edge_vox, make_mixed);
}

robot::SerialArm tube_arm(std::size_t joints) {
  std::vector<robot::DhRow> rows;
  for (std::size_t i = 0; i < joints; ++i) {
    robot::DhRow row;
    row.link = "tube_" + std::to_string(i + 1);
    row.a_m = kReach_m / static_cast<double>(joints);
    row.alpha_rad = i % 2 == 0 ? 0.4 : -0.4;
    row.lower = -3.0, row.upper = 3.0, row.max_speed = 1.0, row.max_effort = 1.0;
    rows.push_back(row);
  }
  return value_of(robot::SerialArm::from_dh(rows, robot::DhConvention::kClassic,
                                            {Eigen::Matrix3d::Identity(), {-0.45, -0.25, 0.0}}));
}

robot::SkinLayout tube_skin(const robot::SerialArm& arm, std::size_t sensors) {
  const double share = kReach_m / static_cast<double>(arm.joint_count());
  const double pitch_m =
      std::sqrt(2.0 * std::numbers::pi * kRadius_m * kReach_m / static_cast<double>(sensors));
  std::vector<robot::LinkSkin> skin;
  for (std::size_t i = 1; i < arm.links().size(); ++i) {
    robot::SkinSegment tube;
    tube.from_m = {-share, 0.0, 0.0};
    tube.to_m = {-0.01 * share, 0.0, 0.0};
    tube.from_radius_m = tube.to_radius_m = kRadius_m;
    skin.push_back({arm.links()[i].name, {tube}, {}, {}});
  }
  return value_of(robot::lay_out_skin(
      arm, skin, {.voxel_size_m = kVoxel_m, .pitch_vox = pitch_m / kVoxel_m, .max_sensors = 4'000'000}));
}

robot::SkinLayout cluster_skin(const robot::SerialArm& arm, std::size_t sensors,
                               const robot::ClusterSpec& cluster) {
  const double share = kReach_m / static_cast<double>(arm.joint_count());
  std::vector<robot::LinkSkin> skin;
  for (std::size_t i = 1; i < arm.links().size(); ++i) {
    robot::AxisSensors axis;
    axis.from_m = {-share, 0.0, 0.0};
    axis.count = static_cast<int>(sensors / arm.joint_count());
    axis.cluster = cluster;
    skin.push_back({arm.links()[i].name, {}, {axis}, {}});
  }
  return value_of(robot::lay_out_skin(arm, skin, {.voxel_size_m = kVoxel_m}));
}

core::JointArray pose(std::size_t joints, int step) {
  core::JointArray q{};
  for (std::size_t i = 0; i < joints; ++i)
    q[i] = 0.5 / static_cast<double>(joints) + 0.05 * std::sin(0.013 * step + static_cast<double>(i));
  return q;
}

}  // namespace phantom::bench
