// A share of the skin that its process senses in a workspace of its own, with finer voxels say
// (thesis 7.3(2)).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/core/errors.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/workspace/compression.hpp"
#include "components/phantom_sensing/carried_parts.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/tests/shares_rig.hpp"
#include "components/phantom_sensing/workspace/share_inbox.hpp"
#include "tests/support/files.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

using rig::balls, rig::random_inputs, rig::share_of, rig::shared_model;
using testing::HasSubstr;

constexpr std::size_t kHand = 1;

/// The arm's process, or that of the hand, whose skin has a third of the pitch.
PhantomModel with_own_workspace(std::optional<std::size_t> own_share = {}) {
  PhantomModel model = shared_model(own_share);
  model.shares[kHand].partition = "cell/fine";
  model.soft_bodies = {rig::soft_balls()};
  if (own_share)
    model.skin = *robot::lay_out_skin(model.arm, robot::test_worlds::tubes(),
                                      {.voxel_size_m = 0.01, .pitch_vox = 0.33});
  return model;
}

SensedShare whole_share_of(const StepOutputs& helper) {
  SensedShare share = share_of(helper);
  share.place = helper.percept;
  share.link = helper.percept.link;
  return share;
}

TEST(ShareWorkspace, IsFeltAsItsProcessHasSensedItThere) {
  const PhantomModel arm_model = with_own_workspace(), hand_model = with_own_workspace(kHand);
  PhantomSensing arm(arm_model, {}), without(arm_model, {}), hand(hand_model, {});
  std::mt19937 random(11);
  int by_hand = 0, by_arm = 0, alerts = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const StepInputs inputs = random_inputs(arm_model, random);
    StepOutputs out, rest, of_hand;
    hand.step(inputs, of_hand);
    if (of_hand.outside) continue;
    const SensedShare share = whole_share_of(of_hand), nothing{};
    without.begin(inputs, rest);
    EXPECT_EQ(without.end(inputs, {nullptr, &nothing}, rest), 1U);
    {
      const test::HeapGuard guard;
      arm.begin(inputs, out);
      EXPECT_EQ(arm.end(inputs, {nullptr, &share}, out), 1U) << "the other share, which nobody has sensed";
    }
    for (std::size_t j = 0; j < core::kMaxJoints; ++j) {
      EXPECT_EQ(out.drag.plus[j], rest.drag.plus[j] + of_hand.drag.plus[j]) << j;
      EXPECT_EQ(out.reaction.torque[j], rest.reaction.torque[j] + of_hand.reaction.torque[j]) << j;
      EXPECT_EQ(out.reaction.stiffness[j], rest.reaction.stiffness[j] + of_hand.reaction.stiffness[j]) << j;
    }
    EXPECT_EQ(out.worst.mu, std::max(rest.worst.mu, of_hand.percept.mu));
    const bool worse = of_hand.percept.mu > rest.worst.mu;
    EXPECT_EQ(out.worst.sensor, worse ? of_hand.percept.sensor : rest.worst.sensor);
    EXPECT_EQ(out.worst.position_W_m, worse ? of_hand.percept.position_W_m : rest.worst.position_W_m);
    const bool threatens = !out.threats.empty() && out.threats[0].raises;
    if (threatens) {  // it is of one of the two
      const auto& by = out.threats[0];
      const bool of_its_links = arm_model.shares[kHand].links[by.link];
      const ThreatList& by_one = of_its_links ? of_hand.threats : rest.threats;
      EXPECT_EQ(out.percept.link, by.link);
      EXPECT_TRUE(std::ranges::any_of(by_one, [&](const Threat& one) {
        return one.link == by.link && one.sensor == by.sensor && one.position_W_m == by.position_W_m &&
               one.contact == by.contact;
      }));
    }
    if (threatens) {
      (arm_model.shares[kHand].links[out.percept.link] ? by_hand : by_arm) += 1;
      alerts += static_cast<int>(out.alerts.raised.size());
      continue;
    }
    const SensorPercept& expected = worse ? of_hand.percept : rest.worst;
    EXPECT_EQ(out.percept.closeness, expected.closeness);
    EXPECT_EQ(out.percept.object, expected.object);
    EXPECT_EQ(out.percept.link, expected.link);
    EXPECT_EQ(out.percept.position_W_m, expected.position_W_m);
    EXPECT_EQ(out.percept.velocity_W_m_s, expected.velocity_W_m_s);
    EXPECT_EQ(out.percept.gradient.pgv_W_m, expected.gradient.pgv_W_m);
    EXPECT_EQ(out.percept.motion, expected.motion);
    (worse ? by_hand : by_arm) += 1;
  }
  EXPECT_GT(by_hand, 20);
  EXPECT_GT(by_arm, 20);
  EXPECT_GT(alerts, 0);
}

TEST(ShareWorkspace, InTheArmsVoxelsItIsFeltAsByOneProcess) {
  PhantomModel one_model = rig::suspended_model(), hand_model = with_own_workspace(kHand);
  one_model.soft_bodies = {rig::soft_balls()};
  hand_model.skin = one_model.skin;
  const PhantomModel arm_model = with_own_workspace();
  PhantomSensing one(one_model, {}), arm(arm_model, {}), hand(hand_model, {});
  std::mt19937 random(17);
  int pressed = 0, by_hand = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const StepInputs inputs = random_inputs(arm_model, random);
    StepOutputs whole, out, of_hand;
    one.step(inputs, whole);
    hand.step(inputs, of_hand);
    if (of_hand.outside) continue;
    const SensedShare share = whole_share_of(of_hand);
    arm.begin(inputs, out);
    arm.end(inputs, {nullptr, &share}, out);
    for (std::size_t j = 0; j < core::kMaxJoints; ++j)
      EXPECT_NEAR(out.drag.plus[j], whole.drag.plus[j], 1e-12 * (1.0 + whole.drag.plus[j])) << j;
    EXPECT_EQ(out.worst.mu, whole.worst.mu);
    EXPECT_EQ(out.percept.object, whole.percept.object);
    pressed += rig::expect_same_reaction(out.reaction, whole.reaction) ? 1 : 0;
    by_hand += of_hand.reaction.torque != core::JointArray{} ? 1 : 0;
  }
  EXPECT_GT(pressed, 20);
  EXPECT_GT(by_hand, 5) << "the share presses, too";
}

// Tries phantom_sensing: reaches out of its workspace
TEST(ShareWorkspace, NothingIsSensedWhileALinkReachesOutOfIt) {
  const PhantomModel model = with_own_workspace(kHand);
  const workspace::Workspace aside = robot::test_worlds::balls({0.6, 0.2, 0.0});
  const workspace::GridSpec& grid = aside.grid();
  const Eigen::Vector3d size_m = grid.extent_m();
  PhantomSensing hand(model, {});
  std::mt19937 random(13);
  int outside = 0, inside = 0;
  for (int trial = 0; trial < 300; ++trial) {
    StepInputs inputs = random_inputs(model, random);
    inputs.workspace.voxels = &aside;
    StepOutputs out;
    hand.step(inputs, out);
    robot::LinkPoses X_WL;
    model.arm.link_poses(inputs.position, X_WL);
    bool any_out = false;
    for (const std::size_t link : {6, 7})
      for (std::size_t i = model.skin.first[link]; i < model.skin.first[link + 1]; ++i) {
        const Eigen::Vector3d p_m = X_WL[link] * model.skin.position(i) - grid.origin_m;
        any_out = any_out || (p_m.array() < 0.0).any() || (p_m.array() > size_m.array()).any();
      }
    EXPECT_EQ(out.outside, !out.valid);
    if (any_out) {
      EXPECT_TRUE(out.outside);
    }
    if (out.outside) {
      EXPECT_EQ(out.drag, robot::DragCoefficients());
    }
    (out.outside ? outside : inside) += 1;
  }
  EXPECT_GT(outside, 20);
  EXPECT_GT(inside, 20);
}

TEST(ShareWorkspace, IsNotBelievedWhileTheArmCarriesWhatItLacks) {
  const PhantomModel model = with_own_workspace();
  PhantomSensing arm(model, {}), twin(model, {});
  robot::SkinSensing carrying(model.skin, sensing_options(model, {}, model.skin.size()));
  robot::SkinSensing of_twin(model.skin, sensing_options(model, {}, model.skin.size()));
  std::mt19937 random(17);
  StepInputs inputs = random_inputs(model, random);
  SensedShare wrong{};
  wrong.drag.plus[0] = 1e6;
  StepOutputs out, expected;
  inputs.workspace.carrying = &of_twin;
  twin.step(inputs, expected);
  inputs.workspace.carrying = &carrying;
  inputs.workspace.carried_key = 9;
  for (const std::uint64_t other_key : {0, 8}) {
    wrong.carried_key = other_key;
    arm.begin(inputs, out);
    EXPECT_EQ(arm.end(inputs, {nullptr, &wrong}, out), 2U);
    EXPECT_EQ(out.drag, expected.drag);
  }
  wrong.carried_key = 9;
  arm.begin(inputs, out);
  EXPECT_EQ(arm.end(inputs, {nullptr, &wrong}, out), 1U) << "what it has, too, is felt as it says";
}

/// An instrument in the arm's hand, whose skin the processes make in their own voxels.
class CarriedInShare : public testing::Test {
 protected:
  static constexpr double kRadius_m = 0.05;

  static PhantomModel carrying(PhantomModel model) {
    model.name = "left";
    model.skin_options = {.voxel_size_m = 0.01, .max_sensors = 50'000};
    return model;
  }
  static messages::CarriedObject instrument(const geometry::TriangleMesh& mesh, std::uint16_t id = 5) {
    return {.id = id,
            .arm = "left",
            .frame = "l7",
            .X_FO = {Eigen::Matrix3d::Identity(), {0.05, 0.0, -0.15}},
            .mesh_hash = mesh.content_hash()};
  }
  /// The skin of a process's arm with the instrument, as its workspace's versions bring it.
  struct Carrier {
    Carrier(const PhantomModel& model, const geometry::TriangleMesh& mesh) : parts(model, settings) {
      EXPECT_TRUE(parts.put({.mesh_hash = mesh.content_hash(),
                             .chunk = 0,
                             .chunk_count = 1,
                             .vertex_count = static_cast<std::uint32_t>(mesh.vertices_m.size()),
                             .triangle_count = static_cast<std::uint32_t>(mesh.triangles.size()),
                             .data = workspace::compress(geometry::mesh_bytes(mesh))}));
      const messages::CarriedObject held[] = {instrument(mesh)};
      skin = *parts.skin_with(held);
    }
    void put_into(SensedWorkspace& workspace) const {
      workspace.carrying = &skin->sensing;
      workspace.carried_key = skin->key;
      workspace.boxes = &skin->boxes;
    }
    PerceptSettings settings;
    CarriedParts parts;
    std::shared_ptr<CarryingSkin> skin;
  };

  const geometry::TriangleMesh mesh_ = geometry::make_sphere(kRadius_m, 3);
};

TEST_F(CarriedInShare, IsFeltInTheArmsVoxelsAsByOneProcess) {
  PhantomModel of_hand = with_own_workspace(kHand), of_one = rig::suspended_model();
  of_hand.skin = of_one.skin;
  of_one.soft_bodies = {rig::soft_balls()};
  const PhantomModel one_model = carrying(of_one), hand_model = carrying(of_hand),
                     arm_model = carrying(with_own_workspace());
  PhantomSensing one(one_model, {}), arm(arm_model, {}), hand(hand_model, {});
  const Carrier by_one(one_model, mesh_), by_arm(arm_model, mesh_), by_hand(hand_model, mesh_);
  EXPECT_EQ(by_arm.skin->key, by_hand.skin->key) << "they know each other's";
  EXPECT_NE(by_arm.skin->key, 0U);
  std::mt19937 random(19);
  int on_instrument = 0, sensed = 0;
  for (int trial = 0; trial < 300; ++trial) {
    StepInputs inputs = random_inputs(arm_model, random);
    StepOutputs whole, out, of_share;
    by_one.put_into(inputs.workspace);
    one.step(inputs, whole);
    by_hand.put_into(inputs.workspace);
    hand.step(inputs, of_share);
    if (of_share.outside) continue;
    SensedShare share = whole_share_of(of_share);
    share.carried_key = of_share.carried_key;
    by_arm.put_into(inputs.workspace);
    arm.begin(inputs, out);
    EXPECT_EQ(arm.end(inputs, {nullptr, &share}, out), 1U) << "the other share alone is sensed here";
    for (std::size_t j = 0; j < core::kMaxJoints; ++j)
      EXPECT_NEAR(out.drag.plus[j], whole.drag.plus[j], 1e-12 * (1.0 + whole.drag.plus[j])) << j;
    EXPECT_EQ(out.worst.mu, whole.worst.mu);
    EXPECT_EQ(out.percept.object, whole.percept.object);
    rig::expect_same_reaction(out.reaction, whole.reaction);
    ++sensed;
    on_instrument += whole.worst.link == 7 && whole.worst.sensor >= one_model.skin.first[8] ? 1 : 0;
  }
  EXPECT_GT(sensed, 100);
  EXPECT_GT(on_instrument, 10) << "sensors beyond the arm's own";
}

TEST_F(CarriedInShare, ReachesOutOfItsWorkspaceWithTheHand) {
  const PhantomModel model = carrying(with_own_workspace(kHand));
  const geometry::TriangleMesh rod =
      geometry::make_box({0.02, 0.02, 4.4});  // longer than the workspace's diagonal
  const Carrier with_rod(model, rod), with_ball(model, mesh_);
  PhantomSensing hand(model, {});
  std::mt19937 random(23);
  int inside = 0;
  for (int trial = 0; trial < 100; ++trial) {
    StepInputs inputs = random_inputs(model, random);
    StepOutputs bare, ball, out;
    hand.step(inputs, bare);
    with_ball.put_into(inputs.workspace);
    hand.step(inputs, ball);
    with_rod.put_into(inputs.workspace);
    hand.step(inputs, out);
    EXPECT_TRUE(out.outside);
    EXPECT_TRUE(ball.outside || !bare.outside) << "what is carried only reaches farther";
    inside += ball.outside ? 0 : 1;
  }
  EXPECT_GT(inside, 50);
}

TEST_F(CarriedInShare, IsKnownByItsKeyWhereverItIsHeld) {
  const std::vector<messages::CarriedObject> one{instrument(mesh_)},
      two{instrument(mesh_), instrument(mesh_, 6)};
  EXPECT_EQ(key_of({}), 0U);
  EXPECT_NE(key_of(one), 0U);
  EXPECT_NE(key_of(two), key_of(one));
  EXPECT_EQ(key_of(std::vector{two[1], two[0]}), key_of(two));
  auto changed = one;
  changed[0].X_FO.translation_m.x() += 1e-9;
  EXPECT_EQ(key_of(changed), key_of(one))
      << "poses differ by rounding; a greater difference is reported as objects that stand elsewhere";
  changed[0].frame = "l6";
  EXPECT_NE(key_of(changed), key_of(one));
  changed = one;
  changed[0].mesh_hash ^= 1U;
  EXPECT_NE(key_of(changed), key_of(one));
}

TEST(ShareWorkspace, ItsVersionIsItsOwnAndItMaySayThatItSensesNothing) {
  const std::vector<SkinShare> shares{{"hand", {}, "cell/fine"}};
  constexpr double kWait_s = 0.05;
  ShareInbox inbox(shares, kWait_s);
  const auto offer = [&](std::uint64_t number, bool valid) {
    messages::DragField field;
    field.slave_echo = {number, 5, 7};
    field.workspace_version = 1000 + number;
    field.drag.plus[0] = static_cast<double>(number);
    field.drag.valid = valid;
    messages::Percept percept;
    percept.slave_echo = field.slave_echo;
    percept.workspace_version = field.workspace_version;
    percept.valid = valid;
    percept.mu_Pa_s_per_m = 32.0;
    percept.closeness = 0.5;
    percept.pgv = {0.0, 0.0, -0.001};
    percept.pgs = 12.0;
    percept.object = 3;
    percept.link = 5;
    inbox.offer(0, field);
    inbox.offer(0, percept);
  };
  const auto basis = [](std::uint64_t number) {
    return ShareBasis{{number, 5, 7}, {}, 3, robot::DragMode::kSeparable};
  };
  offer(1, true);
  const SensedShare* sensed = inbox.await(basis(1))[0];
  ASSERT_NE(sensed, nullptr);
  EXPECT_EQ(sensed->carried_key, 1001U) << "what it carries stands in place of its version";
  EXPECT_EQ(sensed->place.closeness, 0.5);
  EXPECT_EQ(sensed->place.object, 3);
  EXPECT_EQ(sensed->place.gradient.pgv_W_m.z(), -0.001);
  EXPECT_EQ(sensed->place.gradient.strength, 12.0);
  EXPECT_EQ(sensed->link, 5U);
  EXPECT_EQ(inbox.await(basis(2))[0], nullptr) << "of another state";
  const core::Nanoseconds start_ns = core::monotonic_ns();
  for (std::uint64_t n = 3; n < 3 + 2 * ShareInbox::kMissesToRest; ++n) {
    offer(n, false);
    EXPECT_EQ(inbox.await(basis(n))[0], nullptr);
  }
  EXPECT_LT(core::seconds(core::monotonic_ns() - start_ns), 5 * kWait_s) << "it is not waited for";
  EXPECT_TRUE(inbox.resting().none()) << "and counts as in time";
}

TEST(ShareWorkspace, ProcessesMeetThatNameTheSameCellWhateverTheirSkins) {
  Config config;
  config.file = test::new_file("threads: 1\n");
  config.shares = {{"upper", {}, {}, {}}, {"hand", {}, test::new_file("name: fine\n"), "cell/fine"}};
  const auto of_arm = share_partitions("", config, with_own_workspace(), {});
  const auto of_hand = share_partitions("", config, with_own_workspace(kHand), {});
  EXPECT_EQ(of_arm[kHand], of_hand[kHand]);
  EXPECT_NE(of_arm[0], of_hand[0]) << "whose skin is not the same";
  config.shares[kHand].cell = test::new_file("name: finer\n");
  EXPECT_NE(share_partitions("", config, with_own_workspace(), {})[kHand], of_arm[kHand]);
}

TEST(ShareWorkspace, IsOfTheSameObjectsAndTheSameArm) {
  const std::string bench = PHANTOM_SOURCE_DIR "/deploy/cells/surgery_bench/";
  const auto cell = runtime::load_cell(bench + "cell.yaml");
  Config config = load_config(bench + "phantom_sensing.yaml");
  EXPECT_EQ(sensed_cell(cell, config).voxel_size_m, 0.004);
  config.own_share = "probe";
  const auto fine = sensed_cell(cell, config);
  EXPECT_EQ(fine.voxel_size_m, 0.0005);
  const PhantomModel model = load_model(fine, config);
  EXPECT_EQ(model.skin.first[5], 0U) << "of the probe alone";
  EXPECT_GT(model.skin.size(), 10'000U);
  const auto refusal = [&](const std::string& from, const std::string& to) -> std::string {
    std::string text = test::read_text(bench + "fine.yaml");
    text = test::all_replaced(text, "../../arms/", PHANTOM_SOURCE_DIR "/deploy/arms/");
    text = test::all_replaced(text, from, to);
    config.shares[0].cell = test::new_file(text);
    try {
      sensed_cell(cell, config);
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("0.0005", "0.001"), "");
  EXPECT_THAT(refusal("name: vessel", "name: artery"), HasSubstr("objects: are not those of"));
  EXPECT_THAT(refusal("kind: protected_zone", "kind: solid"), HasSubstr("the same names and kinds"));
  EXPECT_THAT(refusal("-0.15, -0.15, 0.12", "-0.15, -0.15, 0.13"),
              HasSubstr("arm 'probe_arm': is not that of"));
}

TEST(ShareWorkspace, ConfigurationsThatMakeNoSenseAreRefused) {
  const auto refusal = [](const std::string& yaml) -> std::string {
    try {
      load_config(test::new_file(yaml));
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "";
  };
  const std::string share = "sharing: {shares: [{name: hand, links: [tool]";
  EXPECT_EQ(refusal(share + ", cell: fine.yaml, partition: fine}]}"), "");
  EXPECT_THAT(refusal(share + ", cell: fine.yaml}]}"), HasSubstr("allowed: both, or none"));
  EXPECT_THAT(refusal(share + ", partition: fine}]}"), HasSubstr("allowed: both, or none"));
  EXPECT_THAT(refusal(share + ", cell: fine.yaml, partition: 'a*'}]}"),
              HasSubstr("is no name of a partition"));
  EXPECT_THAT(refusal("normalisation: none\n" + share + ", cell: fine.yaml, partition: fine}]}"),
              HasSubstr("allowed: area, count, active"));
}

}  // namespace
}  // namespace phantom::phantom_sensing
