// Attach and release over many seeds: poses, order and moments are random, the clock is the test's own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>
#include <string>

#include "common/geometry/implicit/primitives.hpp"
#include "common/teleop/rendering/percept_rendering.hpp"
#include "common/teleop/rendering/torque_slew.hpp"
#include "common/workspace/compression.hpp"
#include "components/phantom_sensing/carried_parts.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/eventually.hpp"

namespace phantom::phantom_sensing {
namespace {

constexpr std::uint16_t kValve = 9;
constexpr double kValveRadius_m = 0.07, kCoarseVoxel_m = 0.02, kMaxMu = 100.0;
constexpr double kTick_s = 0.001, kCap_Nm = 30.0, kRate_Nm_per_s = 200.0;

enum class Place { kStands, kInThisHand, kInAnotherHand };

/// Where the valve is from a version on.
struct Whereabouts {
  Place place = Place::kStands;
  workspace::Workspace world;
  std::vector<messages::CarriedObject> carried;
};

const geometry::TriangleMesh& valve() {
  static const geometry::TriangleMesh mesh = geometry::make_sphere(kValveRadius_m, 3);
  return mesh;
}

messages::MeshChunk valve_in_one_chunk() {
  return {.mesh_hash = valve().content_hash(),
          .chunk = 0,
          .chunk_count = 1,
          .vertex_count = static_cast<std::uint32_t>(valve().vertices_m.size()),
          .triangle_count = static_cast<std::uint32_t>(valve().triangles.size()),
          .data = workspace::compress(geometry::mesh_bytes(valve()))};
}

/// The wall alone.
const workspace::Workspace& cell_without_valve() {
  static const workspace::Workspace world = robot::test_worlds::make(
      [](const Eigen::Vector3d& p) { return robot::test_worlds::layer_code(0.35 - p.x()); }, {0, 0, 1},
      kCoarseVoxel_m);
  return world;
}

/// Where fluids meet, the thicker one counts.
workspace::Workspace cell_with_valve_at(const Eigen::Vector3d& valve_m) {
  workspace::Workspace world = cell_without_valve();
  const workspace::GridSpec& grid = world.grid();
  const Eigen::Vector3d reach_m = Eigen::Vector3d::Constant(0.3);
  const auto low = grid.index_of(valve_m - reach_m), high = grid.index_of(valve_m + reach_m);
  for (std::int32_t z = low.z; z <= high.z; ++z)
    for (std::int32_t y = low.y; y <= high.y; ++y)
      for (std::int32_t x = low.x; x <= high.x; ++x) {
        if (!grid.contains({x, y, z})) continue;
        const auto code =
            robot::test_worlds::layer_code((grid.centre_of({x, y, z}) - valve_m).norm() - kValveRadius_m);
        if (code <= world.mu_code({x, y, z})) continue;
        const auto brick = world.edit_brick({x >> 5, y >> 5, z >> 5});
        const std::size_t at =
            workspace::brick_offset(static_cast<std::uint32_t>(x) & 31U, static_cast<std::uint32_t>(y) & 31U,
                                    static_cast<std::uint32_t>(z) & 31U);
        brick.mu_code[at] = code;
        brick.order[at] = static_cast<std::int8_t>(code == 6 ? workspace::kOrderBoundary : 6 - code);
        brick.object[at] = kValve;
      }
  return world;
}

bool has_valve_in(const workspace::Workspace& world) {
  for (const workspace::BrickKey key : world.bricks())
    for (std::size_t i = 0; i < workspace::kBrickVoxels; ++i)
      if (world.brick(key).object_of(i) == kValve) return true;
  return false;
}

struct NewestOutputs : PerceptSink {
  std::optional<StepOutputs> newest;
  void on_drag(const StepOutputs& outputs, const TickInfo&) override { newest = outputs; }
  void on_percept(const StepOutputs&, const TickInfo&) override {}
  void on_alert(const percept::Alert&, bool) override {}
};

core::JointArray all_joints(double value) {
  core::JointArray all{};
  all.fill(value);
  return all;
}

PhantomModel arm_that_carries() {
  PhantomModel model = rig::suspended_model();
  model.name = "left";
  model.skin_options = {.voxel_size_m = 0.01, .max_sensors = 50'000};
  return model;
}

/// What is seen over all seeds: that there was something to be seen.
struct Seen {
  int results = 0, changes = 0, as_in_both = 0, as_in_neither = 0, steeper_than_slew = 0;
};

/// One arm, its phantom and its master's rendering, with the valve handed to and fro.
class Handling {
 public:
  Handling(unsigned seed, Seen& seen) : random_(seed), seen_(seen) {
    config_.percept.mode = seed % 2 == 0 ? robot::DragMode::kSeparable : robot::DragMode::kCoupled;
    config_.percept.directional.enabled = seed % 3 == 0;
    const std::size_t joints = model_.arm.joint_count();
    renderer_.emplace(teleop::PerceptParameters{.joint_count = joints,
                                                .mode = config_.percept.mode,
                                                .torque_cap_Nm = all_joints(kCap_Nm),
                                                .damping_limit_Nms_per_rad = all_joints(1e3)});
    slew_.emplace(teleop::TorqueSlewParameters{.joint_count = joints,
                                               .mode = config_.percept.mode,
                                               .percept_cap_Nm = all_joints(kCap_Nm),
                                               .feedback_cap_Nm = all_joints(kCap_Nm),
                                               .limit_Nm = all_joints(2.0 * kCap_Nm),
                                               .rate_Nm_per_s = all_joints(kRate_Nm_per_s)});
    // The hand moves steadily: what a torque does as it turns round is TorqueSlew's own matter.
    for (std::size_t j = 0; j < joints; ++j) velocity_[j] = 0.3 * share();
    velocity_[0] = 0.2;
    loop_.emplace(model_, config_, keeper_, sink_);
    EXPECT_TRUE(oracle_parts_.put(valve_in_one_chunk()));
  }

  void run(std::size_t versions) {
    const std::size_t restart = 1 + random_() % (versions - 1);
    for (std::size_t i = 0; i < versions && !testing::Test::HasFailure(); ++i) {
      truths_.push_back(next_place());
      if (i == restart) {  // a server ends, perhaps while the arm carries
        keeper_.gone(server_);
        server_[0] = 2;
      }
      send_bricks_now_and_then_a_tick();
      const bool waits_for_mesh = truths_.back().place == Place::kInThisHand && !known_;
      commit();
      ticks(random_() % 4);  // it may come into use in any of these
      if (waits_for_mesh) {
        EXPECT_LT(keeper_.version(), i + 1);
        ticks(3);
        keeper_.put_mesh(server_, valve_in_one_chunk());
        known_ = true;
      }
      ASSERT_TRUE(test::eventually([&] { return keeper_.version() == i + 1; }));
      EXPECT_EQ(has_valve_in(*keeper_.share()), truths_.back().place == Place::kStands);
      EXPECT_EQ(keeper_.carried().size(), truths_.back().place == Place::kInThisHand ? 1U : 0U);
      ticks(1);
      ASSERT_EQ(felt_version_, i + 1) << "in use, and not felt in the next tick";
      ticks(2 + random_() % 12);
    }
  }

 private:
  double share() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random_); }
  Eigen::Vector3d shares() { return {share(), share(), share()}; }

  /// Anywhere about the hand: standing, held (also held otherwise than before), or taken by another arm.
  Whereabouts next_place() {
    const auto draw = truths_.empty() ? 0UL : random_() % 7;
    if (draw < 3) {
      robot::LinkPoses X_WL;
      model_.arm.link_poses({0.05}, X_WL);
      const Eigen::Vector3d hand_m = X_WL[model_.arm.joint_count()] * Eigen::Vector3d(0.0, 0.0, -0.1);
      return {Place::kStands, cell_with_valve_at(hand_m + 0.12 * shares()), {}};
    }
    const geometry::Pose X_FO{geometry::rotation_from_rpy(share(), share(), share()),
                              {0.12 * share(), 0.12 * share(), -0.1 + 0.05 * share()}};
    const bool ours = draw < 6;
    return {ours ? Place::kInThisHand : Place::kInAnotherHand,
            cell_without_valve(),
            {{.id = kValve,
              .arm = ours ? "left" : "right",
              .frame = "l7",
              .X_FO = X_FO,
              .mesh_hash = valve().content_hash()}}};
  }

  /// Bricks come in any order, and the arm goes on meanwhile.
  void send_bricks_now_and_then_a_tick() {
    const workspace::Workspace& world = truths_.back().world;
    std::vector<workspace::BrickKey> keys = world.bricks();
    std::vector<workspace::BrickKey> gone;
    if (truths_.size() > 1)
      for (const workspace::BrickKey key : truths_[truths_.size() - 2].world.bricks())
        if (!world.has_brick(key)) gone.push_back(key);
    std::shuffle(keys.begin(), keys.end(), random_);
    for (const workspace::BrickKey key : keys) {
      keeper_.put_brick(server_, key, truths_.size(), workspace::encode_brick(world.brick(key)));
      if (random_() % 16 == 0) ticks(1);
    }
    for (const workspace::BrickKey key : gone) keeper_.put_brick(server_, key, truths_.size(), {});
  }
  void commit() {
    const Whereabouts& truth = truths_.back();
    workspace::VersionDescription version =
        workspace::description_of(truth.world, truth.world.content_hash());
    version.version = truths_.size();
    keeper_.commit(server_, version, truth.carried);
  }

  void ticks(std::size_t count) {
    for (std::size_t i = 0; i < count && !testing::Test::HasFailure(); ++i) tick();
  }
  void tick() {
    ++number_;
    SlaveSample sample;
    sample.received_ns = static_cast<core::Nanoseconds>(number_) * core::kNsPerMillisecond;
    sample.stamp = {number_, sample.received_ns, 77};
    sample.position[0] = 0.05 + 0.1 * std::sin(0.02 * static_cast<double>(number_));
    sample.position[2] = 0.3 * std::sin(0.013 * static_cast<double>(number_));
    sample.velocity = velocity_;
    loop_->offer(sample);
    sink_.newest.reset();
    loop_->turn(sample.received_ns);
    if (!sink_.newest || !sink_.newest->valid) {
      EXPECT_EQ(felt_version_, 0U) << "once there is a percept there always is one";
      return;
    }
    const StepOutputs& got = *sink_.newest;
    ASSERT_GE(got.workspace_version, felt_version_) << "back to an older one";
    ASSERT_LE(got.workspace_version, truths_.size());
    StepInputs inputs;
    inputs.position = sample.position;
    inputs.velocity = sample.velocity;
    inputs.state_valid = true;
    hold_to_truth(got, inputs);
    render(got);
  }

  StepOutputs felt_with(const workspace::Workspace& world, const Whereabouts* hand, const StepInputs& at) {
    const auto skin = hand != nullptr ? *oracle_parts_.skin_with(hand->carried) : nullptr;
    PhantomSensing sensing(model_, config_.percept);
    StepInputs inputs = at;
    inputs.workspace = {&world, percept::greatest_neighbour_mu(world), skin ? &skin->sensing : nullptr};
    StepOutputs outputs;
    sensing.step(inputs, outputs);
    return outputs;
  }

  /// The result is, bit for bit, that of the one place in which the version has the valve.
  void hold_to_truth(const StepOutputs& got, const StepInputs& inputs) {
    const Whereabouts& truth = truths_[got.workspace_version - 1];
    const StepOutputs right = felt_with(truth.world, &truth, inputs);
    EXPECT_EQ(got.drag, right.drag) << "in version " << got.workspace_version;
    EXPECT_EQ(got.active_sensors, right.active_sensors);
    const StepOutputs neither = felt_with(cell_without_valve(), nullptr, inputs);
    const bool changed = got.workspace_version != felt_version_;
    if (changed && felt_version_ > 0) {
      const Whereabouts& before = truths_[felt_version_ - 1];
      const bool to_hand = before.place == Place::kStands && truth.place == Place::kInThisHand;
      if (to_hand) seen_.as_in_both += felt_with(before.world, &truth, inputs).drag == right.drag ? 1 : 0;
      seen_.changes += to_hand ? 1 : 0;
      seen_.as_in_neither += to_hand && neither.drag == right.drag ? 1 : 0;
    }
    felt_version_ = got.workspace_version;
    ++seen_.results;
    // How far the field may jump: wherever the valve is, it only adds to the drag, along the first joint's
    // axis (a gantry's) at most the greatest μ times the weight of the skin that it can reach: its own in the
    // hand, the arm's where it stands.
    const auto own = oracle_weight(truth);
    const double added = got.drag.coupled[0] - neither.drag.coupled[0];
    EXPECT_GE(added, -1e-9);
    EXPECT_LE(added, kMaxMu * own + 1e-9);
    if (truth.place == Place::kInAnotherHand) {
      EXPECT_EQ(got.drag, neither.drag) << "what another arm carries";
    }
  }
  double oracle_weight(const Whereabouts& truth) {
    const double arm = std::accumulate(model_.skin.weight.begin(), model_.skin.weight.end(), 0.0);
    const auto skin = *oracle_parts_.skin_with(truth.carried);
    if (!skin) return arm;
    return std::accumulate(skin->layout.weight.begin(), skin->layout.weight.end(), 0.0) - arm;
  }

  /// On the master: no step of the torque beyond the percept's share of the slew.
  void render(const StepOutputs& got) {
    teleop::DragCoefficients drag;
    static_cast<robot::DragCoefficients&>(drag) = got.drag;
    drag.valid = true;
    const auto wanted = robot::drag_torque(drag, config_.percept.mode, velocity_, model_.arm.joint_count());
    const auto rendered = renderer_->step(drag, true, true, all_joints(1.0), velocity_, kTick_s);
    const core::JointArray now = slew_->step(rendered.torque_Nm, {}, velocity_, kTick_s).percept_Nm;
    constexpr double kPerceptsShare = 0.5;  // its cap is that of the feedback
    for (std::size_t j = 0; j < model_.arm.joint_count(); ++j) {
      EXPECT_LE(std::abs(now[j] - torque_Nm_[j]), kPerceptsShare * kRate_Nm_per_s * kTick_s + 1e-12);
      seen_.steeper_than_slew +=
          std::abs(wanted[j] - wanted_Nm_[j]) > kPerceptsShare * kRate_Nm_per_s * kTick_s ? 1 : 0;
    }
    torque_Nm_ = now;
    wanted_Nm_ = wanted;
  }

  std::mt19937 random_;
  Seen& seen_;
  PhantomModel model_ = arm_that_carries();
  Config config_;
  CarriedParts parts_{model_, config_.percept}, oracle_parts_{model_, config_.percept};
  bool known_ = false;               // the mesh has come once
  std::vector<Whereabouts> truths_;  // of version i + 1
  NewestOutputs sink_;
  WorkspaceSubscriber keeper_{
      {[](const std::string& why) { EXPECT_THAT(why, testing::HasSubstr("its mesh has not come yet")); }},
      SIZE_MAX,
      &parts_};
  std::optional<SensingLoop> loop_;
  workspace::SourceId server_{1};
  std::optional<teleop::PerceptRenderer> renderer_;
  std::optional<teleop::TorqueSlew> slew_;
  core::JointArray velocity_{}, torque_Nm_{}, wanted_Nm_{};
  std::uint64_t number_ = 0, felt_version_ = 0;
};

TEST(CarriedAtRandom, IsInOnePlaceInEveryResultAndNoTorqueStepsBeyondTheSlew) {
  Seen seen;
  for (unsigned seed = 1; seed <= 30 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Handling(seed, seen).run(10);
  }
  RecordProperty("results", seen.results);
  RecordProperty("taken", seen.changes);
  RecordProperty("steeper_than_slew", seen.steeper_than_slew);
  if (testing::Test::HasFailure()) return;
  EXPECT_GT(seen.results, 2'000);
  EXPECT_GT(seen.changes, 30);
  EXPECT_LT(seen.as_in_both, seen.changes) << "a second copy would not show";
  EXPECT_LT(seen.as_in_neither, seen.changes) << "a lost one would not show";
  EXPECT_GT(seen.steeper_than_slew, 30) << "the slew has nothing to do";
}

}  // namespace
}  // namespace phantom::phantom_sensing
