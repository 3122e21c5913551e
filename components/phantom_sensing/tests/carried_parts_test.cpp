// What the arm carries is felt as a part of it, from the very version on in which it is no longer in the
// workspace.
#include "components/phantom_sensing/carried_parts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <numbers>
#include <random>
#include <thread>

#include "common/geometry/implicit/primitives.hpp"
#include "common/teleop/rendering/percept_rendering.hpp"
#include "common/teleop/rendering/torque_slew.hpp"
#include "common/workspace/compression.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

using core::kNsPerMillisecond;
using phantom::test::eventually;
using testing::HasSubstr;

constexpr std::uint16_t kPump = 5;
constexpr double kRadius_m = 0.07;

PhantomModel named_model() {
  PhantomModel model = rig::suspended_model();
  model.name = "left";
  model.skin_options = {.voxel_size_m = 0.01, .max_sensors = 50'000};
  return model;
}

const geometry::TriangleMesh& pump() {
  static const geometry::TriangleMesh mesh = geometry::make_sphere(kRadius_m, 3);
  return mesh;
}

/// A mesh in one piece, as it comes over mesh_chunk.
messages::MeshChunk chunk_of(const geometry::TriangleMesh& mesh) {
  return {.mesh_hash = mesh.content_hash(),
          .chunk = 0,
          .chunk_count = 1,
          .vertex_count = static_cast<std::uint32_t>(mesh.vertices_m.size()),
          .triangle_count = static_cast<std::uint32_t>(mesh.triangles.size()),
          .data = workspace::compress(geometry::mesh_bytes(mesh))};
}

messages::CarriedObject carried_at(const geometry::Pose& X_FO, const std::string& arm = "left") {
  return {.id = kPump, .arm = arm, .frame = "l7", .X_FO = X_FO, .mesh_hash = pump().content_hash()};
}

/// The wall, and the pump where it stands (or is not there).
workspace::Workspace world_with(const std::optional<Eigen::Vector3d>& pump_m) {
  return robot::test_worlds::make(
      [&](const Eigen::Vector3d& p) {
        const std::uint8_t wall = robot::test_worlds::layer_code(0.35 - p.x());
        if (!pump_m) return wall;
        return std::max(wall, robot::test_worlds::layer_code((p - *pump_m).norm() - kRadius_m));
      },
      {0, 0, 1}, 0.01,
      [&](const Eigen::Vector3d& p, double radius_m) {
        const double near_m = 0.21 + radius_m;
        return 0.35 - p.x() < near_m || (pump_m && (p - *pump_m).norm() - kRadius_m < near_m);
      });
}

/// One version of the cell: either of the two places where the pump can be.
struct Truth {
  workspace::Workspace world;
  std::vector<messages::CarriedObject> carried;
};

class Carried : public testing::Test {
 protected:
  StepOutputs felt(const workspace::Workspace& world, robot::SkinSensing* carrying, const StepInputs& at) {
    PhantomSensing sensing(model_, config_.percept);
    StepInputs inputs = at;
    inputs.workspace = {&world, percept::greatest_neighbour_mu(world), carrying};
    StepOutputs outputs;
    sensing.step(inputs, outputs);
    return outputs;
  }

  PhantomModel model_ = named_model();
  Config config_;
  CarriedParts parts_{model_, config_.percept};
};

TEST_F(Carried, AreFeltAndOnlyByTheArmThatCarriesThem) {
  const workspace::Workspace world = world_with({});
  ASSERT_TRUE(parts_.put(chunk_of(pump())));
  const geometry::Pose X_FO{Eigen::Matrix3d::Identity(), {0.1, 0.0, -0.1}};
  const messages::CarriedObject ours[] = {carried_at(X_FO)}, theirs[] = {carried_at(X_FO, "right")};
  const auto skin = parts_.skin_with(ours);
  ASSERT_TRUE(skin) << skin.status().message();
  ASSERT_NE(*skin, nullptr);
  EXPECT_THAT((*skin)->objects, testing::ElementsAre(kPump));
  EXPECT_EQ(*parts_.skin_with(ours), *skin) << "the same as long as the same is carried";
  const StepInputs before_the_wall = rig::hanging(0.05, 0.2);
  EXPECT_GT(felt(world, &(*skin)->sensing, before_the_wall).drag.plus[0],
            felt(world, nullptr, before_the_wall).drag.plus[0]);
  EXPECT_EQ(*parts_.skin_with(theirs), nullptr);
  EXPECT_EQ(*parts_.skin_with({}), nullptr);
  EXPECT_NE(*parts_.skin_with(ours), *skin) << "it was put down meanwhile";
}

TEST_F(Carried, AreInTheSameMediumAsTheArm) {
  model_.medium = {{.mu_Pa_s_per_m = 2.0}};
  const workspace::Workspace world = world_with({});
  ASSERT_TRUE(parts_.put(chunk_of(pump())));
  const messages::CarriedObject ours[] = {carried_at({Eigen::Matrix3d::Identity(), {0.1, 0.0, -0.1}})};
  const auto skin = parts_.skin_with(ours);
  ASSERT_TRUE(skin) << skin.status().message();
  const StepInputs in_free_water = rig::hanging(-0.4, 0.2);
  const double pump_m2 = 4.0 * std::numbers::pi * kRadius_m * kRadius_m;
  EXPECT_NEAR(felt(world, &(*skin)->sensing, in_free_water).drag.plus[0] -
                  felt(world, nullptr, in_free_water).drag.plus[0],
              2.0 * pump_m2, 0.02 * 2.0 * pump_m2);
}

// Tries phantom_sensing: the arm has no such link
// Tries phantom_sensing: more sensors than `skin.max_sensors` with it
TEST_F(Carried, WithoutTheirMeshOrLinkCannotBeFelt) {
  messages::CarriedObject object = carried_at({});
  const auto problem = [&] {
    const auto skin = parts_.skin_with(std::span(&object, 1));
    return skin ? std::string() : skin.status().message();
  };
  EXPECT_THAT(problem(), HasSubstr("object 5, carried by arm 'left': its mesh has not come yet"));
  messages::MeshChunk wrong = chunk_of(pump());
  wrong.mesh_hash ^= 1;
  EXPECT_FALSE(parts_.put(wrong)) << "a mesh that is not what it claims to be";
  ASSERT_TRUE(parts_.put(chunk_of(pump())));
  EXPECT_EQ(problem(), "");
  object.frame = "claw";
  EXPECT_THAT(problem(), HasSubstr("no link 'claw'"));
  object = carried_at({});
  model_.skin_options.max_sensors = model_.skin.size() + 10;
  CarriedParts narrow(model_, config_.percept);
  ASSERT_TRUE(narrow.put(chunk_of(pump())));
  EXPECT_FALSE(narrow.skin_with(std::span(&object, 1))) << "more sensors than are allowed";
}

TEST_F(Carried, TheSkinIsChangedWithoutTheHeapAndKeepsWhatMayBeTouched) {
  const workspace::Workspace world = world_with({});
  ASSERT_TRUE(parts_.put(chunk_of(pump())));
  const messages::CarriedObject object[] = {carried_at({Eigen::Matrix3d::Identity(), {0.1, 0.0, -0.1}})};
  const auto skin = parts_.skin_with(object);
  ASSERT_TRUE(skin);
  PhantomSensing sensing(model_, config_.percept);
  StepInputs inputs = rig::hanging(0.2, 0.2);
  const SensedWorkspace bare{&world, percept::greatest_neighbour_mu(world), nullptr};
  StepOutputs outputs;
  const auto step = [&](robot::SkinSensing* carrying) {
    inputs.workspace = bare;
    inputs.workspace.carrying = carrying;
    const test::HeapGuard guard;
    sensing.step(inputs, outputs);
  };
  step(nullptr);
  const std::size_t own = outputs.active_sensors;
  step(&(*skin)->sensing);
  EXPECT_GT(outputs.active_sensors, own);
  inputs.allowed.add(1, percept::AllowedContact::kWholeArm);  // the wall
  step(&(*skin)->sensing);
  EXPECT_EQ(outputs.active_sensors, 0U);
  EXPECT_GT(outputs.muted_sensors, own);
  step(nullptr);
  EXPECT_EQ(outputs.active_sensors, 0U);
  EXPECT_EQ(outputs.muted_sensors, own);
  inputs.allowed = {};
  step(&(*skin)->sensing);
  EXPECT_GT(outputs.active_sensors, own) << "what was muted when it was taken off counts no more";
}

// Tries phantom_sensing: the mesh of a carried object does not come
TEST_F(Carried, AVersionWhoseMeshIsMissingComesIntoUseOnceItIsThere) {
  std::vector<std::string> refused;
  std::atomic<int> problems = 0;
  WorkspaceSubscriber keeper({.refused = [&](const std::string& why) { refused.push_back(why), ++problems; }},
                             SIZE_MAX, &parts_);
  const workspace::Workspace world = world_with({});
  rig::send(world, 1, keeper);
  ASSERT_TRUE(eventually([&] { return keeper.version() == 1; }));
  workspace::VersionDescription version = workspace::description_of(world, world.content_hash());
  version.version = 2;
  keeper.commit({}, version, {carried_at({})});
  ASSERT_TRUE(eventually([&] { return problems == 1; }));
  EXPECT_EQ(keeper.version(), 1U) << "never without what is no longer in the workspace";
  EXPECT_EQ(keeper.announced(), 2U) << "so the percept is marked, and ends in time";
  keeper.put_mesh({}, chunk_of(pump()));
  ASSERT_TRUE(eventually([&] { return keeper.version() == 2; }));
  EXPECT_NE(keeper.newest().carrying, nullptr);
  EXPECT_THAT(keeper.carried(), testing::ElementsAre(kPump));
  EXPECT_EQ(problems, 1);
}

/// Keeps each result of the loop.
struct Results : PerceptSink {
  std::vector<StepOutputs> all;
  void on_drag(const StepOutputs& outputs, const TickInfo&) override { all.push_back(outputs); }
  void on_percept(const StepOutputs&, const TickInfo&) override {}
  void on_alert(const percept::Alert&, bool) override {}
};

// A pump is taken and put down at random poses and times while the arm moves: every single result is, bit for
// bit, that of where the pump is in the version that the result names, never of both places, nor of neither;
// and the torque on the master changes no faster than its slew.
TEST_F(Carried, ARandomSequenceOfAttachAndReleaseNeverLeavesTwoOfItOrNone) {
  std::mt19937 random(23);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  ASSERT_TRUE(parts_.put(chunk_of(pump())));
  std::vector<Truth> truths;  // of version i + 1
  const workspace::Workspace empty = world_with({});
  robot::LinkPoses X_WL;
  model_.arm.link_poses({0.05}, X_WL);
  const Eigen::Vector3d hand_m = X_WL[model_.arm.joint_count()] * Eigen::Vector3d(0.0, 0.0, -0.1);
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d somewhere =
        hand_m + 0.1 * Eigen::Vector3d(share(random), share(random), share(random));
    truths.push_back({world_with(somewhere), {}});
    const Eigen::Vector3d held(0.12 * share(random), 0.12 * share(random), -0.1 + 0.05 * share(random));
    truths.push_back(
        {empty, {carried_at({geometry::rotation_from_rpy(share(random), 0.0, share(random)), held})}});
  }
  const PhantomModel& model = model_;
  WorkspaceSubscriber keeper({[](const std::string& why) { ADD_FAILURE() << why; }}, SIZE_MAX, &parts_);
  Results results;
  SensingLoop loop(model, config_, keeper, results);
  CarriedParts oracle_parts(model_, config_.percept);  // none of the loop's skins
  ASSERT_TRUE(oracle_parts.put(chunk_of(pump())));

  const auto each = [](double value) {
    core::JointArray all{};
    all.fill(value);
    return all;
  };
  const core::JointArray caps = each(30.0), rate = each(200.0), gain = each(1.0);
  teleop::PerceptRenderer renderer({.joint_count = model.arm.joint_count(),
                                    .torque_cap_Nm = caps,
                                    .damping_limit_Nms_per_rad = each(1e3)});
  teleop::TorqueSlew slew({.joint_count = model.arm.joint_count(),
                           .percept_cap_Nm = caps,
                           .feedback_cap_Nm = caps,
                           .limit_Nm = each(60.0),
                           .rate_Nm_per_s = rate});
  core::JointArray torque{};
  std::size_t as_both = 0, as_neither = 0, results_seen = 0, changes = 0;
  std::uint64_t number = 0, felt_version = 0;
  for (std::size_t i = 0; i < truths.size(); ++i) {
    std::thread sender([&, i] {
      const workspace::Workspace& world = truths[i].world;
      for (const workspace::BrickKey key : world.bricks())
        keeper.put_brick({}, key, i + 1, workspace::encode_brick(world.brick(key)));
      if (i > 0) {
        for (const workspace::BrickKey key : truths[i - 1].world.bricks())
          if (!world.has_brick(key)) keeper.put_brick({}, key, i + 1, {});
      }
      workspace::VersionDescription version = workspace::description_of(world, world.content_hash());
      version.version = i + 1;
      keeper.commit({}, version, truths[i].carried);
    });
    const core::Nanoseconds latest_ns = core::monotonic_ns() + 60 * core::kNsPerSecond;
    for (int after = 0; after < 15 && core::monotonic_ns() < latest_ns;) {
      ++number;
      SlaveSample sample;
      sample.received_ns = static_cast<core::Nanoseconds>(number) * kNsPerMillisecond;
      sample.stamp = {number, sample.received_ns, 77};
      // By what was seen, not by the time it took: a slow machine feels the same poses as a fast one.
      const auto phase = static_cast<double>(15 * i + static_cast<std::size_t>(after));
      sample.position[0] = 0.05 + 0.1 * std::sin(0.41 * phase);
      sample.position[2] = 0.3 * std::sin(0.27 * phase);
      sample.velocity[0] = 0.2;
      loop.offer(sample);
      results.all.clear();
      loop.turn(sample.received_ns);
      if (results.all.empty() || !results.all.back().valid) continue;
      const StepOutputs& got = results.all.back();
      changes += got.workspace_version != felt_version ? 1 : 0;
      felt_version = got.workspace_version;
      after += felt_version == i + 1 ? 1 : 0;
      StepInputs inputs;
      inputs.position = sample.position;
      inputs.velocity = sample.velocity;
      inputs.state_valid = true;
      const auto skin_of = [&](std::size_t version) {
        return *oracle_parts.skin_with(truths[version - 1].carried);
      };
      const auto skin = skin_of(felt_version);
      const StepOutputs right = felt(truths[felt_version - 1].world, skin ? &skin->sensing : nullptr, inputs);
      EXPECT_EQ(got.drag, right.drag) << "in version " << felt_version;
      EXPECT_EQ(got.active_sensors, right.active_sensors);
      // In both places, or in neither, it would be felt otherwise.
      const std::size_t other = felt_version > 1 ? felt_version - 1 : 2;
      const auto other_skin = skin_of(other);
      const workspace::Workspace& standing = truths[(skin ? other : felt_version) - 1].world;
      const auto both = felt(standing, &(skin ? skin : other_skin)->sensing, inputs);
      const auto neither = felt(empty, nullptr, inputs);
      ++results_seen;
      as_both += both.drag == right.drag ? 1 : 0;
      as_neither += neither.drag == right.drag ? 1 : 0;

      teleop::DragCoefficients drag;
      static_cast<robot::DragCoefficients&>(drag) = got.drag;
      drag.valid = true;
      const auto rendered = renderer.step(drag, true, true, gain, sample.velocity, 0.001);
      const auto& now = slew.step(rendered.torque_Nm, {}, sample.velocity, 0.001).percept_Nm;
      for (std::size_t j = 0; j < model.arm.joint_count(); ++j)
        EXPECT_LE(std::abs(now[j] - torque[j]), 0.001 * rate[j] + 1e-12);
      torque = now;
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    sender.join();
    ASSERT_EQ(felt_version, i + 1) << "it never came into use";
  }
  EXPECT_GE(changes, truths.size());
  EXPECT_LT(as_both, results_seen) << "of " << results_seen << ": this shows little";
  EXPECT_LT(as_neither, results_seen) << "of " << results_seen << ": this shows little";
}

}  // namespace
}  // namespace phantom::phantom_sensing
