// Directional drag of the shipped arm in the shipped cell, on ways in and back on which all its joints move.
// What is an approach is decided by geometry alone: by the distance to the objects' meshes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "common/percept/closeness.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/simulation/mesh_world.hpp"
#include "components/phantom_sensing/model.hpp"

namespace phantom::phantom_sensing {
namespace {

using core::JointArray;

/// A straight way in joint space.
struct Way {
  JointArray start{}, v{};
  double duration_s = 0.0;
  JointArray at(double time_s) const {
    JointArray q = start;
    for (std::size_t j = 0; j < q.size(); ++j) q[j] += v[j] * time_s;
    return q;
  }
};

class Retreat : public testing::Test {
 protected:
  Retreat()
      : cell_(runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml")),
        model_(load_model(cell_, coarse())),
        workspace_(build_workspace(cell_)),
        sensed_{&workspace_, percept::greatest_neighbour_mu(workspace_)} {
    std::vector<geometry::PlacedMesh> bodies;
    for (const auto& loaded : runtime::load_bodies(cell_))
      bodies.push_back({loaded.body.mesh_W, loaded.body.id});
    distance_.emplace(bodies, 0.13);
  }
  /// A tenth of the sensors are enough.
  static Config coarse() {
    Config config;
    config.skin.pitch_vox = 3.0;
    return config;
  }

  /// Whether everything that is felt at a pose nears, with a third of its speed or more, link by link, and
  /// nothing touches.
  bool nears(const JointArray& q, const JointArray& v) const {
    robot::LinkPoses X_WL;
    model_.arm.link_poses(q, X_WL);
    std::array<double, core::kMaxJoints + 1> drag{}, closing{};
    double total = 0.0;
    for (std::size_t link = 1; link <= model_.arm.joint_count(); ++link) {
      for (std::size_t i = model_.skin.first[link]; i < model_.skin.first[link + 1]; ++i) {
        const Eigen::Vector3d p = X_WL[link] * model_.skin.position(i);
        const double mu = static_cast<double>(workspace_.mu(workspace_.grid().index_of(p)));
        if (mu == 0.0) continue;
        if (mu >= 100.0) return false;
        const Eigen::Vector3d u = model_.arm.point_velocity_W(link, p, X_WL, v);
        const double m = model_.skin.weight[i] * mu;
        drag[link] += m * u.squaredNorm();
        closing[link] -= m * u.norm() * u.dot(distance_->query(p).normal_W);
      }
      total += drag[link];
    }
    if (total == 0.0) return false;
    for (std::size_t link = 1; link <= model_.arm.joint_count(); ++link) {
      if (drag[link] > 0.002 * total && closing[link] < drag[link] / 3.0) return false;
    }
    return true;
  }

  /// A way that ends at a pose by chance and on which the arm nears all the time; none if there is none of
  /// 0.15 s.
  std::optional<Way> random_approach(std::mt19937& random) const {
    Way way;
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (std::size_t j = 0; j < model_.arm.joint_count(); ++j) {
      const robot::Joint& joint = model_.arm.joints()[j];
      way.start[j] = joint.lower + share(random) * (joint.upper - joint.lower);
      way.v[j] = (random() % 2 == 0 ? 1.0 : -1.0) * (0.02 + 0.18 * share(random));
    }
    if (!nears(way.start, way.v)) return std::nullopt;
    while (way.duration_s < 1.0 && nears(way.at(-0.05), way.v)) {
      way.start = way.at(-0.05);
      way.duration_s += 0.05;
    }
    return way.duration_s < 0.14 ? std::nullopt : std::optional(way);
  }

  /// Σ|τ_l| and power over the way there or back.
  std::pair<double, double> felt(const Way& way, bool back, const PerceptSettings& settings) const {
    PhantomSensing sensing(model_, settings);
    StepInputs inputs;
    inputs.workspace = sensed_;
    inputs.state_valid = true;
    inputs.dt_s = 0.01;
    inputs.velocity = way.v;
    if (back) {
      for (double& v : inputs.velocity) v = 0.0 - v;
    }
    StepOutputs outputs;
    double torque = 0.0, power = 0.0;
    constexpr int kSteps = 30;
    for (int i = 0; i <= kSteps; ++i) {
      inputs.position = way.at(way.duration_s * (back ? kSteps - i : i) / kSteps);
      sensing.step(inputs, outputs);
      for (std::size_t j = 0; j < model_.arm.joint_count(); ++j) {
        torque += std::abs(outputs.percept.drag_torque[j]);
        power -= outputs.percept.drag_torque[j] * inputs.velocity[j];
      }
    }
    return {torque, power};
  }

  runtime::CellConfig cell_;
  PhantomModel model_;
  workspace::Workspace workspace_;
  SensedWorkspace sensed_;
  std::optional<simulation::MeshWorld> distance_;
};

TEST_F(Retreat, CostsLessThanATenthWithAllJointsMovingAndTheSameWhenSymmetric) {
  std::mt19937 random(3);
  int ways = 0;
  for (int trial = 0; trial < 20'000 && ways < 30; ++trial) {
    const auto way = random_approach(random);
    if (!way) continue;
    ++ways;
    for (const auto mode : {robot::DragMode::kSeparable, robot::DragMode::kCoupled}) {
      SCOPED_TRACE(testing::Message() << "trial " << trial << ", mode " << static_cast<int>(mode));
      PerceptSettings settings;
      settings.mode = mode;
      const auto [torque_in, power_in] = felt(*way, false, settings);
      const auto [torque_out, power_out] = felt(*way, true, settings);
      EXPECT_NEAR(torque_out, torque_in, 1e-9 * torque_in);
      EXPECT_NEAR(power_out, power_in, 1e-9 * power_in);
      settings.directional.enabled = true;
      const auto [nearing_torque, nearing_power] = felt(*way, false, settings);
      const auto [leaving_torque, leaving_power] = felt(*way, true, settings);
      EXPECT_GT(nearing_power, 0.95 * power_in);
      EXPECT_LT(leaving_torque, 0.1 * nearing_torque);
      EXPECT_LT(leaving_power, 0.1 * nearing_power);
    }
  }
  EXPECT_EQ(ways, 30);
}

}  // namespace
}  // namespace phantom::phantom_sensing
