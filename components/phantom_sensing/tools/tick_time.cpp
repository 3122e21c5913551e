#include "components/phantom_sensing/tools/tick_time.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <sstream>

#include "common/core/clock.hpp"
#include "common/percept/closeness.hpp"

namespace phantom::phantom_sensing {
namespace {

constexpr int kPoses = 64;

/// Returns pose and velocity on a small loop around home. The pose stays within the joints' ranges.
StepInputs pose(const robot::SerialArm& arm, const TickCase& at, int step) {
  StepInputs inputs;
  const double angle = 2.0 * std::numbers::pi * (step % kPoses) / kPoses;
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const robot::Joint& joint = arm.joints()[j];
    const double swing = std::min(0.01, 0.1 * (joint.upper - joint.lower));
    const double middle = std::clamp(at.home[j], joint.lower + swing, joint.upper - swing);
    inputs.position[j] = middle + swing * std::sin(angle + static_cast<double>(j));
    inputs.velocity[j] = 0.1 * std::cos(angle + static_cast<double>(j));
  }
  inputs.dt_s = kStatePeriod_s;
  inputs.state_valid = true;
  inputs.allowed = at.allowed;
  return inputs;
}

/// Returns a pseudo-random palette code: neighbouring voxels differ, all codes occur, none of them is free
/// space.
std::uint8_t code_of(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::size_t codes) {
  std::uint32_t mixed = x * 0x9E3779B1U ^ y * 0x85EBCA77U ^ z * 0xC2B2AE3DU;
  mixed = (mixed ^ mixed >> 15U) * 0x2C1B3C6DU;
  return static_cast<std::uint8_t>(1U + (mixed >> 8U) % (codes - 1U));
}

void fill(workspace::Workspace& workspace, workspace::BrickKey key) {
  const auto brick = workspace.edit_brick(key);
  const std::size_t codes = workspace.palette().size();
  for (std::uint32_t z = 0; z < workspace::kBrickEdge; ++z) {
    for (std::uint32_t y = 0; y < workspace::kBrickEdge; ++y) {
      for (std::uint32_t x = 0; x < workspace::kBrickEdge; ++x) {
        const std::size_t i = workspace::brick_offset(x, y, z);
        brick.mu_code[i] = code_of(x, y, z, codes);
        brick.order[i] = 1;
        brick.object[i] = 1;
      }
    }
  }
}

/// Returns a workspace with fluid in every brick that a sensor or interest point passes through.
workspace::Workspace all_in_fluid(const PhantomModel& model, const TickCase& at) {
  workspace::Workspace workspace(at.grid, at.palette);
  std::set<std::size_t> made;
  const auto visit = [&](const Eigen::Vector3d& p_W_m) {
    if (!p_W_m.allFinite()) return;
    const workspace::Index3 v = at.grid.index_of(p_W_m);
    if (!at.grid.contains(v)) return;
    const workspace::BrickKey key{v.x >> 5, v.y >> 5, v.z >> 5};
    if (made.insert(workspace.directory_index(key)).second) fill(workspace, key);
  };
  robot::LinkPoses X_WL;
  for (int step = 0; step < kPoses; step += kPoses / 8) {
    model.arm.link_poses(pose(model.arm, at, step).position, X_WL);
    for (std::size_t link = 1; link <= model.arm.joint_count(); ++link) {
      for (std::size_t i = model.skin.first[link]; i < model.skin.first[link + 1]; ++i)
        visit(X_WL[link] * model.skin.position(i));
    }
    for (const InterestPoint& point : model.interest_points) visit(X_WL[point.link] * point.position_m);
  }
  workspace.version = 1;
  return workspace;
}

/// Returns the seconds of each tick, sorted, without the first ticks, which touch memory for the first time.
std::vector<double> run(const PhantomModel& model, const PerceptSettings& settings, const TickCase& at,
                        const workspace::Workspace& workspace, double duration_s) {
  PhantomSensing sensing(model, settings);
  const SensedWorkspace sensed{&workspace, percept::greatest_neighbour_mu(workspace)};
  // At its dearest: all of the arm is in the fluid of every link of other arms.
  const std::vector<OtherLink> others(model.other_links, {&workspace, sensed.greatest_neighbour_mu, {}});
  StepOutputs outputs;
  std::vector<double> times;
  const core::Nanoseconds end_ns = core::monotonic_ns() + core::from_seconds(duration_s);
  for (int step = 0; step < 2 * kPoses || core::monotonic_ns() < end_ns; ++step) {
    StepInputs inputs = pose(model.arm, at, step);
    inputs.workspace = sensed;
    inputs.others = others;
    const core::Nanoseconds start_ns = core::monotonic_ns();
    sensing.step(inputs, outputs);
    if (step >= kPoses) times.push_back(core::seconds(core::monotonic_ns() - start_ns));
  }
  std::sort(times.begin(), times.end());
  return times;
}

}  // namespace

TickTime time_tick(const PhantomModel& model, const PerceptSettings& settings, const TickCase& at,
                   double duration_s) {
  TickTime time;
  const workspace::Workspace free(at.grid, at.palette);
  const auto in_free_space = run(model, settings, at, free, 0.3 * duration_s);
  time.free_s = in_free_space[in_free_space.size() / 2];
  const workspace::Workspace full = all_in_fluid(model, at);
  const auto in_fluid = run(model, settings, at, full, 0.7 * duration_s);
  time.full_s = in_fluid[in_fluid.size() / 2];
  time.full_p99_s = in_fluid[in_fluid.size() * 99 / 100];
  return time;
}

std::string describe(const TickTime& time) {
  std::ostringstream words;
  words << std::fixed;
  words.precision(0);
  const double share = time.full_s / kStatePeriod_s;
  words << "a tick takes " << 1e6 * time.free_s << " us in free space and " << 1e6 * time.full_s
        << " us where it takes longest, the whole skin in mixed fluid (99 of 100: " << 1e6 * time.full_p99_s
        << " us): ";
  if (share <= 1.0) {
    words << 100.0 * share << " % of the " << 1e3 * kStatePeriod_s << " ms between two slave_states";
  } else {
    words << "longer than the " << 1e3 * kStatePeriod_s
          << " ms between two slave_states, so some would be passed over; "
             "more threads or fewer sensors (skin.pitch_vox) help";
  }
  return words.str();
}

}  // namespace phantom::phantom_sensing
