// Two arms that sense each other: the shipped pair, held to the other arm put into the workspace as it
// stands.
#include "components/phantom_sensing/other_arms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/core/errors.hpp"
#include "common/layers/live_workspace.hpp"
#include "common/percept/closeness.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "components/phantom_sensing/model.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"
#include "components/phantom_sensing/tests/rig.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/files.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::phantom_sensing {
namespace {

using core::JointArray;
using testing::HasSubstr;

constexpr const char* kPair = PHANTOM_SOURCE_DIR "/deploy/cells/scara_pair/";

/// The shipped cell, in voxels of 1 cm.
const runtime::CellConfig& pair_cell() {
  static const auto cell = [] {
    auto loaded = runtime::load_cell(std::string(kPair) + "cell.yaml");
    loaded.voxel_size_m = 0.01;
    return loaded;
  }();
  return cell;
}

/// One arm of the pair with its phantom.
struct Side {
  explicit Side(const std::string& name)
      : config(load_config(kPair + ("phantom_sensing_" + name + ".yaml"))),
        others(load_other_arms(pair_cell(), config)),
        model(load_model(pair_cell(), config)) {
    model.other_links = links_of(others);
    sensing.emplace(model, config.percept);
  }
  /// What this arm feels at `q`, moving at `v`, in `world` beside the other arm.
  StepOutputs feel(const workspace::Workspace& world, const JointArray& q, const JointArray& v,
                   const JointArray& other_q, const JointArray& other_v, bool beside = true) {
    links.resize(links_of(others));
    others[0].put(other_q, other_v, links);
    StepInputs inputs;
    inputs.position = q;
    inputs.velocity = v;
    inputs.dt_s = 0.6;
    inputs.workspace = {&world, percept::greatest_neighbour_mu(world)};
    inputs.state_valid = true;
    if (beside) inputs.others = links;
    StepOutputs out;
    const test::HeapGuard guard;
    sensing->step(inputs, out);
    return out;
  }

  Config config;
  std::vector<OtherArm> others;
  PhantomModel model;
  std::optional<PhantomSensing> sensing;
  std::vector<OtherLink> links;
};

const workspace::Workspace& nothing() {
  static const workspace::Workspace empty(runtime::grid_of(pair_cell()), {0.0F});
  return empty;
}

/// Tips at either side of the channel, links side by side some 9 cm apart.
constexpr JointArray kOverChannel{-0.40, 1.41, 0.05, 0.0}, kHome{0.9, 0.7, 0.05, 0.0};

/// The other arm at `q`, activated with all its links in W, as an object is.
workspace::Workspace with_arm_in_it(const std::string& name, const JointArray& q) {
  const auto arm = runtime::load_arm(pair_cell().arm(name));
  robot::LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  std::vector<layers::Body> bodies;
  for (std::size_t link = 0; link < arm.links().size(); ++link)
    for (const auto& seen : arm.links()[link].meshes) {
      layers::Body& body = bodies.emplace_back();
      body.name = name;
      body.id = static_cast<std::uint16_t>(bodies.size());
      body.mesh_W = robot::load_mesh(seen)->transformed(X_WL[link] * seen.X_link_mesh);
      body.profile = pair_cell().profile;
    }
  std::vector<layers::LiveBody> live;
  for (const layers::Body& body : bodies) live.push_back({&body, 0});
  layers::LiveWorkspace world(runtime::grid_of(pair_cell()), pair_cell().merge);
  if (const auto added = world.add(live, 1); !added) throw std::runtime_error(added.status().message());
  return std::move(world).take();
}

TEST(OtherArms, AreFeltAsIfTheyStoodInTheWorkspace) {
  Side a("a");
  std::mt19937 random(3);
  std::uniform_real_distribution<double> spread(-0.25, 0.25);
  double worst_error = 0.0;
  for (int trial = 0; trial < 6; ++trial) {
    JointArray q = kOverChannel, other_q = kOverChannel;
    for (std::size_t j = 0; j < 4; ++j) q[j] += 0.3 * spread(random), other_q[j] += 0.3 * spread(random);
    q[2] = 0.05, other_q[2] = 0.03 + 0.1 * std::abs(spread(random));
    const workspace::Workspace world = with_arm_in_it("scara_b", other_q);
    const StepOutputs as_object = a.feel(world, q, {}, other_q, {}, false),
                      as_arm = a.feel(nothing(), q, {}, other_q, {});
    ASSERT_GT(as_object.percept.mu, 0.0);
    ASSERT_GT(as_object.drag.plus[0], 0.0);
    for (const std::size_t j : {0, 1}) {
      const double error = std::abs(as_arm.drag.plus[j] / as_object.drag.plus[j] - 1.0);
      worst_error = std::max(worst_error, error);
    }
    EXPECT_LT((as_arm.percept.position_W_m - as_object.percept.position_W_m).norm(), 0.15);
    EXPECT_EQ(as_arm.percept.object, OtherArm::kFirstId);
  }
  // Two voxelisations of one body differ by half a voxel in either direction: of layers of four voxels a few
  // per cent.
  EXPECT_LT(worst_error, 0.12);
  RecordProperty("greatest relative difference", std::to_string(worst_error));
}

TEST(OtherArms, FeelEachOtherAlike) {
  Side a("a"), b("b");
  std::mt19937 random(5);
  std::uniform_real_distribution<double> spread(-0.15, 0.15);
  int felt = 0;
  for (int trial = 0; trial < 40; ++trial) {
    JointArray p = kOverChannel, r = kOverChannel, vp{}, vr{};
    for (std::size_t j = 0; j < 4; ++j) {
      p[j] += spread(random), r[j] += spread(random);
      vp[j] = spread(random), vr[j] = spread(random);
    }
    const StepOutputs of_a = a.feel(nothing(), p, vp, r, vr), of_b = b.feel(nothing(), p, vp, r, vr);
    for (std::size_t j = 0; j < 4; ++j)
      EXPECT_NEAR(of_a.drag.plus[j], of_b.drag.plus[j], 0.01 * of_a.drag.coupled[0] + 1e-12) << j;
    EXPECT_EQ(of_a.percept.mu, of_b.percept.mu);
    EXPECT_NEAR(of_a.percept.velocity_W_m_s.norm(), of_b.percept.velocity_W_m_s.norm(), 0.1);
    felt += of_a.percept.mu > 0.0 ? 1 : 0;
  }
  EXPECT_GT(felt, 20);
  EXPECT_EQ(a.feel(nothing(), kHome, {}, kHome, {}).percept.mu, 0.0) << "nor does either feel itself";
}

TEST(OtherArms, ThatMoveRaiseThePerceptOfAnArmAtRestAndPushItNot) {
  Side a("a");
  double before = 0.0;
  bool alert = false;
  const JointArray swing{-0.6, 0.4, 0.0, 0.0};
  for (int step = 0; step <= 10; ++step) {
    JointArray other = kHome;
    for (std::size_t j = 0; j < 4; ++j) other[j] += 0.1 * step * (kOverChannel[j] - kHome[j]);
    const StepOutputs out = a.feel(nothing(), kOverChannel, {}, other, swing);
    EXPECT_GE(out.worst.mu + 1e-9, before) << "nearer and nearer";
    before = out.worst.mu;
    EXPECT_EQ(out.percept.drag_torque, JointArray{}) << "at rest it feels no drag";
    if (out.percept.mu == 0.0) continue;
    alert = alert || !out.alerts.raised.empty();
    EXPECT_GT(out.percept.velocity_W_m_s.norm(), 0.05) << "relative to the fluid, which moves";
    const StepOutputs still = a.feel(nothing(), kOverChannel, {}, other, {});
    EXPECT_EQ(still.percept.velocity_W_m_s.norm(), 0.0);
    EXPECT_EQ(still.percept.motion, percept::MotionClass::kNone);
  }
  EXPECT_GT(before, 10.0);
  EXPECT_TRUE(alert) << "a hit by the other arm threatens";
}

TEST(OtherArms, DragAnswersTheSpeedRelativeToTheirs) {
  Side a("a");
  // The lifts near each other, the arms behind them: each is mostly in the fluid of the other.
  const JointArray q{-0.7465, 1.661, 0.20, 0.0};  // tips 12 cm apart, face to face
  const auto with = [&](double own_m_s, double other_m_s) {
    JointArray v{}, other_v{};
    v[2] = own_m_s, other_v[2] = other_m_s;
    return a.feel(nothing(), q, v, q, other_v);
  };
  const StepOutputs at_rest = with(0.1, 0.0);
  ASSERT_GT(at_rest.drag.plus[2], 0.0);
  EXPECT_EQ(at_rest.drag.plus[2], at_rest.drag.coupled[2 * 3 / 2 + 2]);
  double before = at_rest.drag.plus[2];
  for (const double along_m_s : {0.02, 0.05, 0.08, 0.1, 0.3}) {
    const StepOutputs out = with(0.1, along_m_s);
    EXPECT_LE(out.drag.plus[2], before);
    EXPECT_GE(out.drag.plus[2], 0.0);
    before = out.drag.plus[2];
  }
  EXPECT_LT(before, 0.7 * at_rest.drag.plus[2]);
  const StepOutputs against = with(0.1, -0.1);
  EXPECT_EQ(against.drag.plus[2], at_rest.drag.plus[2]) << "never more than against fluid at rest";
  EXPECT_LT(against.drag.minus[2], at_rest.drag.minus[2]);
}

TEST(OtherArms, AreOtherArmsOfTheCellWhoseLinksAreSeen) {
  const auto refusal = [](const std::string& cell, const std::string& text) -> std::string {
    try {
      load_other_arms(runtime::load_cell(cell), load_config(test::new_file(text)));
    } catch (const core::ConfigError& error) {
      return error.what();
    }
    return "";
  };
  const std::string pair = std::string(kPair) + "cell.yaml",
                    bench = PHANTOM_SOURCE_DIR "/deploy/cells/arm_bench/cell.yaml";
  EXPECT_EQ(refusal(pair, "arm: scara_a\nother_arms: [{arm: scara_b}]"), "");
  EXPECT_THAT(refusal(pair, "arm: scara_a\nother_arms: [{arm: scara_a}]"),
              HasSubstr("is this arm, or stands twice"));
  EXPECT_THAT(refusal(pair, "arm: scara_a\nother_arms: [{arm: scara_b}, {arm: scara_b}]"),
              HasSubstr("each once"));
  EXPECT_THAT(refusal(pair, "arm: scara_a\nother_arms: [{arm: scara_c}]"), HasSubstr("scara_c"));
  EXPECT_THAT(refusal(bench, "arm: test_arm\nother_arms: [{arm: scara}]"),
              HasSubstr("nothing is seen of its links"));
}

struct Heard : PerceptSink {
  std::vector<PerceptCondition> conditions;
  double mu = 0.0, speed_m_s = 0.0;
  void on_drag(const StepOutputs& out, const TickInfo& info) override {
    conditions.push_back(info.condition);
    mu = out.percept.mu;
    speed_m_s = out.percept.velocity_W_m_s.norm();
  }
  void on_percept(const StepOutputs&, const TickInfo&) override {}
  void on_alert(const percept::Alert&, bool) override {}
};

// Tries phantom_sensing: no `slave_state` of another arm comes
TEST(OtherArms, AreFeltWhereTheyWereWhileTheyAreSilentAndThenThereIsNoPercept) {
  Side a("a");
  Heard heard;
  WorkspaceSubscriber keeper({[](const std::string&) {}});
  SensingLoop loop(a.model, a.config, keeper, heard, a.others);
  rig::send(nothing(), 1, keeper);
  ASSERT_TRUE(test::eventually([&] { return keeper.version() == 1; }));
  core::Nanoseconds now_ns = core::kNsPerSecond;
  std::uint64_t number = 0;
  const auto sample = [&](const JointArray& q, const JointArray& v) {
    SlaveSample state;
    state.stamp = {++number, now_ns, 7};
    state.received_ns = now_ns;
    state.position = q;
    state.velocity = v;
    return state;
  };
  const auto turn_after = [&](double s, bool other_speaks) {
    now_ns += core::from_seconds(s);
    loop.offer(sample(kOverChannel, {}));
    if (other_speaks) loop.offer_other(0, sample(kOverChannel, {0.2, 0.0, 0.0, 0.0}));
    loop.turn(now_ns);
    return heard.conditions.back();
  };
  EXPECT_EQ(turn_after(0.001, false), PerceptCondition::kNoWorkspace) << "it may stand anywhere";
  EXPECT_EQ(turn_after(0.001, true), PerceptCondition::kFresh);
  EXPECT_GT(heard.mu, 0.0);
  EXPECT_GT(heard.speed_m_s, 0.01);
  const double felt = heard.mu;
  EXPECT_EQ(turn_after(0.09, false), PerceptCondition::kFresh);
  EXPECT_EQ(turn_after(0.02, false), PerceptCondition::kWorkspaceBehind);
  EXPECT_EQ(heard.mu, felt) << "where it was last";
  EXPECT_EQ(heard.speed_m_s, 0.0) << "at rest there";
  EXPECT_EQ(turn_after(4.9, false), PerceptCondition::kWorkspaceBehind);
  EXPECT_EQ(turn_after(0.2, false), PerceptCondition::kWorkspaceStale);
  EXPECT_EQ(heard.mu, 0.0);
  EXPECT_EQ(turn_after(0.001, true), PerceptCondition::kFresh);
  EXPECT_EQ(heard.mu, felt);
}

}  // namespace
}  // namespace phantom::phantom_sensing
